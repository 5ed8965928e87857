/* caches.c: the point caches PC2 (3ds Max, Blender) and MDD (LightWave, Blender): binary32 positions, frame after
 * frame. The faces are in a mesh file beside the cache (source.c, sink.c). Samples are not interpolated.
 *
 * PC2, little-endian: "POINTCACHE2\0", int32 version 1, int32 points, float32 start, float32 rate, int32 samples,
 * then the positions. MDD, big-endian: int32 samples, int32 points, float32 time of each sample, then the positions.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

enum { PC2_HEADER = 32, PC2_RATE_OFF = 20, PC2_SAMPLES_OFF = 28, MDD_HEADER = 8, POINT = 12 };

static const char pc2_magic[12] = "POINTCACHE2";

/* MDD has a time for every sample: the interval for sequences without times. */

static uint32_t load_u32(const unsigned char *p, bool big)
{
    uint32_t x = vgi_get32(p);
    return big ? __builtin_bswap32(x) : x;
}

static void store_u32(unsigned char *p, uint32_t x, bool big)
{
    vgi_put32(p, big ? __builtin_bswap32(x) : x);
}

static float load_float(const unsigned char *p, bool big)
{
    return vgi_as_float(load_u32(p, big));
}

static void store_float(unsigned char *p, float x, bool big)
{
    store_u32(p, vgi_float_bits(x), big);
}

/* ------------------------------------------------------------------------------------------- reading -- */

typedef struct reading {
    vgi_input *in;
    const char *subject;
    bool big;
    uint32_t samples, points, next; /* next: number of the next sample */
    vg_bytes ahead;                 /* its bytes, if have_ahead */
    bool have_ahead;
    bool timed;
    float start, rate; /* PC2 */
    vg_bytes times;    /* MDD */
} reading;

static int cut_short(const reading *x, int r, const char *where, vg_err *e)
{
    return r == VG_ETRUNC ? vg_fail(e, r, "%s ends too early: %s", x->subject, where) : r;
}

static int read_bytes(reading *x, vg_bytes *to, size_t n, const char *where, vg_err *e)
{
    to->size = 0;
    int r = vgi_input_take(x->in, to, n, NULL, e);
    return cut_short(x, r, where, e);
}

static int take_sample(reading *x, vg_err *e)
{
    char where[64];
    snprintf(where, sizeof where, "in sample %u of %u", x->next + 1, x->samples);
    int r = read_bytes(x, &x->ahead, (size_t)x->points * POINT, where, e);
    x->have_ahead = r == VG_OK;
    return r;
}

/* Returns 0 (end of sequence) if the file ends, too. */
static int finish_samples(reading *x, vg_err *e)
{
    int r = vgi_input_ended(x->in, e);
    if (r != 0) return r < 0 ? r : 0;
    return vg_fail(e, VG_EINPUT, "%s has data after its %u samples of %u points", x->subject, x->samples, x->points);
}

static int check_counts(const reading *x, vg_err *e)
{
    if (x->points == 0 || x->points > INT32_MAX)
        return vg_fail(e, VG_EINPUT, "%s announces %d points", x->subject, (int32_t)x->points);
    if (x->samples == 0 || x->samples > INT32_MAX)
        return vg_fail(e, VG_EINPUT, "%s announces %d samples", x->subject, (int32_t)x->samples);
    return VG_OK;
}

static int begin_reading(reading **out, void **state, vgi_input *in, const char *subject, bool big, vg_err *e)
{
    reading *x = *out = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->in = in, x->subject = subject, x->big = big;
    return VG_OK;
}

/* Read the first sample before the count of points is trusted. */
static int finish_head(reading *x, vg_head *h, vg_err *e)
{
    int r = take_sample(x, e);
    if (r < 0) return r;
    h->kind = VG_VERTICES, h->precision = VG_F32;
    h->count = h->body.mesh.nv = x->points;
    return VG_OK;
}

/* Some programs give the rate in frames of the scene, others in seconds. Samples at consecutive integers only
 * count frames: they give no times. */
static void judge_times(reading *x)
{
    x->timed = !(x->rate == 1 && x->start == floorf(x->start));
}

static int open_pc2(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                    vg_err *e)
{
    (void)how;
    unsigned char head[PC2_HEADER];
    reading *x;
    int r = begin_reading(&x, state, in, subject, false, e);
    if (r == VG_OK) r = cut_short(x, vgi_input_read(in, head, sizeof head, NULL, e), "in its header", e);
    if (r < 0) return r;
    if (memcmp(head, pc2_magic, sizeof pc2_magic) != 0)
        return vg_fail(e, VG_EINPUT, "%s is not a PC2 cache: it does not begin with POINTCACHE2", subject);
    if (vgi_get32(head + 12) != 1)
        return vg_fail(e, VG_EINPUT, "%s is a PC2 cache of version %d: only version 1 is supported", subject,
                       (int32_t)vgi_get32(head + 12));
    x->points = vgi_get32(head + 16), x->samples = vgi_get32(head + PC2_SAMPLES_OFF);
    x->start = load_float(head + PC2_RATE_OFF, false), x->rate = load_float(head + PC2_RATE_OFF + 4, false);
    if (!isfinite(x->start) || !isfinite(x->rate))
        return vg_fail(e, VG_EINPUT, "%s: the start or the rate of its samples is not finite", subject);
    judge_times(x);
    r = check_counts(x, e);
    return r < 0 ? r : finish_head(x, h, e);
}

static int open_mdd(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                    vg_err *e)
{
    (void)how;
    unsigned char head[MDD_HEADER];
    reading *x;
    int r = begin_reading(&x, state, in, subject, true, e);
    if (r == VG_OK) r = cut_short(x, vgi_input_read(in, head, sizeof head, NULL, e), "in its header", e);
    if (r < 0) return r;
    x->samples = load_u32(head, true), x->points = load_u32(head + 4, true);
    if ((r = check_counts(x, e)) < 0) return r;
    if ((r = read_bytes(x, &x->times, (size_t)x->samples * 4, "in the times of its samples", e)) < 0) return r;
    x->timed = true;
    for (uint32_t i = 0; i < x->samples; i++)
        if (!isfinite(load_float(x->times.data + 4 * (size_t)i, true)))
            return vg_fail(e, VG_EINPUT, "%s: the time of sample %u is not finite", subject, i + 1);
    return finish_head(x, h, e);
}

static double time_of(const reading *x, uint32_t i)
{
    return x->times.size ? (double)load_float(x->times.data + 4 * (size_t)i, true)
                         : (double)x->start + (double)i * (double)x->rate;
}

static int next_sample(void *state, vg_frame *f, vg_err *e)
{
    reading *x = state;
    int r;
    if (x->next == x->samples) return finish_samples(x, e);
    if (!x->have_ahead && (r = take_sample(x, e)) < 0) return r;
    const unsigned char *p = x->ahead.data;
    for (size_t i = 0; i < 3 * (size_t)x->points; i++, p += 4) f->values[i] = load_float(p, x->big);
    if (!vgi_finite(f->values, 3 * (size_t)x->points)) {
        size_t i = 0;
        while (isfinite(f->values[i])) i++;
        return vg_fail(e, VG_EINPUT, "%s: point %zu of sample %u is not finite", x->subject, i / 3, x->next + 1);
    }
    f->has_time = x->timed;
    f->time = x->timed ? time_of(x, x->next) : 0;
    x->have_ahead = false;
    x->next++;
    return 1;
}

static uint64_t count_samples(const void *state)
{
    return ((const reading *)state)->samples;
}

static void close_cache(void *state)
{
    reading *x = state;
    if (!x) return;
    vg_bytes_clear(&x->ahead);
    vg_bytes_clear(&x->times);
    free(x);
}

static bool sniff_pc2(const unsigned char *data, size_t n)
{
    return n >= sizeof pc2_magic && !memcmp(data, pc2_magic, sizeof pc2_magic);
}

/* ------------------------------------------------------------------------------------------- writing -- */

typedef struct writing {
    vgi_output *out; /* MDD: the file; its positions wait in `spool` because the times come first */
    vgi_output spool;
    bool big;
    size_t points;
    uint32_t samples;
    vg_bytes sample;
    /* times: */
    bool untimed, uneven; /* some frame has no time; times are not evenly spaced */
    double first, last, step;
    vg_bytes times; /* MDD: in file form */
} writing;

static int check_points(const vg_head *h, const char *output, vg_err *e)
{
    if (h->count <= INT32_MAX) return VG_OK;
    return vg_fail(e, VG_EARG, "cannot write '%s': a point cache holds at most %d points", output, INT32_MAX);
}

static writing *begin_writing(void **state, const vg_head *h, vgi_output *out, bool big, vg_err *e)
{
    writing *x = *state = vgi_array(1, sizeof *x, e);
    if (x) x->out = out, x->points = h->count, x->big = big, x->spool.fd = -1;
    return x;
}

static int begin_pc2(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    unsigned char head[PC2_HEADER] = {0};
    (void)o;
    writing *x = begin_writing(state, h, out, false, e);
    if (!x) return VG_ENOMEM;
    memcpy(head, pc2_magic, sizeof pc2_magic);
    vgi_put32(head + 12, 1);
    vgi_put32(head + 16, (uint32_t)x->points);
    return vgi_output_put(out, head, sizeof head, e); /* start, rate and samples are set at the end */
}

static int begin_mdd(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    (void)o;
    writing *x = begin_writing(state, h, out, true, e);
    if (!x) return VG_ENOMEM;
    x->spool.name = "temporary file";
    x->spool.fd = vgi_nameless_file(e);
    return x->spool.fd < 0 ? x->spool.fd : VG_OK;
}

/* Check whether the times are evenly spaced, within the precision of binary32. */
static void note_time(writing *x, const vg_frame *f)
{
    uint32_t i = x->samples;
    if (!f->has_time) {
        x->untimed = true;
        return;
    }
    if (i == 0) x->first = f->time;
    if (i == 1) x->step = f->time - x->first;
    double due = x->first + x->step * (double)i, slack = 1e-4 * fabs(x->step) + 1e-6 * fabs(due);
    if (!(fabs(f->time - due) <= slack)) x->uneven = true;
    x->last = f->time;
}

static int keep_time(writing *x, const vg_frame *f, vg_err *e)
{
    unsigned char time[4];
    double t = f->has_time ? f->time : (double)x->samples / VG_FPS;
    if (!isfinite((float)t)) return vg_fail(e, VG_EINPUT, "its time %g does not fit binary32", t);
    store_float(time, (float)t, true);
    return vgi_bytes_append(&x->times, time, sizeof time, e);
}

static int put_sample(void *state, const vg_frame *f, vg_err *e)
{
    writing *x = state;
    if (x->samples == INT32_MAX) return vg_fail(e, VG_EINPUT, "a point cache holds at most %d samples", INT32_MAX);
    int r = vgi_bytes_reserve(&x->sample, x->points * POINT, e);
    if (r < 0) return r;
    unsigned char *p = x->sample.data;
    for (size_t i = 0; i < 3 * x->points; i++, p += 4) {
        float v = (float)f->values[i];
        if (!isfinite(v))
            return vg_fail(e, VG_EINPUT, "vertex %zu does not fit binary32 (%g)", i / 3, f->values[i]);
        store_float(p, v, x->big);
    }
    note_time(x, f);
    if (x->big && (r = keep_time(x, f, e)) < 0) return r;
    x->samples++;
    return vgi_output_put(x->big ? &x->spool : x->out, x->sample.data, x->points * POINT, e);
}

static int end_pc2(void *state, vg_err *e)
{
    unsigned char tail[12];
    writing *x = state;
    float start = 0, rate = 1;
    if (!x->untimed && !x->uneven) {
        /* from the whole duration, because single steps may have been rounded */
        start = (float)x->first;
        if (x->samples > 1) rate = (float)((x->last - x->first) / (x->samples - 1));
    }
    if (!isfinite(start) || !isfinite(rate))
        return vg_fail(e, VG_EINPUT, "the times of the frames do not fit binary32");
    store_float(tail, start, false);
    store_float(tail + 4, rate, false);
    vgi_put32(tail + 8, x->samples);
    return vgi_output_patch(x->out, PC2_RATE_OFF, tail, sizeof tail, e);
}

static int end_mdd(void *state, vg_err *e)
{
    unsigned char head[MDD_HEADER];
    writing *x = state;
    store_u32(head, x->samples, true);
    store_u32(head + 4, (uint32_t)x->points, true);
    int r = vgi_output_put(x->out, head, sizeof head, e);
    if (r == VG_OK) r = vgi_output_put(x->out, x->times.data, x->times.size, e);
    if (r == VG_OK) r = vgi_output_flush(&x->spool, e);
    return r < 0 ? r : vgi_output_copy(x->out, x->spool.fd, x->spool.size, e);
}

static const char *warn_pc2(void *state)
{
    const writing *x = state;
    return !x->untimed && x->uneven ? "the times of the frames, which are not evenly spaced" : NULL;
}

static void release_cache(void *state)
{
    writing *x = state;
    if (!x) return;
    if (x->spool.fd >= 0) close(x->spool.fd);
    vgi_output_clear(&x->spool);
    vg_bytes_clear(&x->sample);
    vg_bytes_clear(&x->times);
    free(x);
}

const vgi_sequence_format vgi_sequence_pc2 = {
    .name = "pc2", .suffix = ".pc2", .keeps = VGI_KEEPS_ORDER | VGI_KEEPS_TIMES, .sniff = sniff_pc2,
    .open = open_pc2, .next = next_sample, .frames = count_samples, .close = close_cache,
    .kinds = 1 << VG_VERTICES, .check = check_points, .begin = begin_pc2, .put = put_sample, .end = end_pc2,
    .warning = warn_pc2, .release = release_cache};

/* The file begins with two counts and has no signature: the suffix identifies the format. */
const vgi_sequence_format vgi_sequence_mdd = {
    .name = "mdd", .suffix = ".mdd", .keeps = VGI_KEEPS_ORDER | VGI_KEEPS_TIMES,
    .open = open_mdd, .next = next_sample, .frames = count_samples, .close = close_cache,
    .kinds = 1 << VG_VERTICES, .check = check_points, .begin = begin_mdd, .put = put_sample, .end = end_mdd,
    .release = release_cache};
