/* fitting.c: the driver of fits: collect, hold out, pass, sample, judge. The fits themselves are in the programs.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "fitting.h"
#include "batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const size_t in_memory = (size_t)256 << 20; /* bytes of poses in memory; the rest goes to a file */

/* ---- reading ---- */

typedef struct streaming {
    fitting_step *each;
    void *context;
    size_t done;
} streaming;

static void stream_batch(void *work, size_t n, vg_frame *in)
{
    streaming *x = work;
    fitting_batch b = {.n = n};
    for (size_t i = 0; i < n; i++) b.index[i] = x->done++, b.values[i] = in[i].values;
    x->each(x->context, &b);
}

uint64_t fitting_stream(vg_source *s, fitting_step *each, void *context)
{
    static const step reading = {.batch = FITTING_BATCH, .unit = "poses", .process = stream_batch};
    streaming x = {each, context, 0};
    vg_frame *in = batch_frames(&reading);
    uint64_t n = batch_read(&reading, &x, s, in);
    batch_frames_free(&reading, in);
    return n;
}

static void collect_batch(void *work, size_t n, vg_frame *in)
{
    fitting *f = work;
    vg_err e;
    for (size_t i = 0; i < n; i++, f->n++)
        if (vg_poses_add(f->poses, &in[i], &e) < 0) cli_die(&e);
}

void fitting_collect(fitting *f, vg_source *s, long holdout, const char *what)
{
    static const step reading = {.batch = 1, .unit = "poses", .process = collect_batch};
    vg_err e;
    vg_frame *in = batch_frames(&reading);
    *f = (fitting){.h = vg_source_head(s), .holdout = (size_t)holdout};
    if (vg_poses_new(&f->poses, f->h, in_memory, &e) < 0) cli_die(&e);
    batch_read(&reading, f, s, in);
    batch_frames_free(&reading, in);
    if (!f->n) cli_stop(VG_EINPUT, "the input has no poses to %s", what);
}

void fitting_clear(fitting *f)
{
    vg_poses_free(&f->poses);
    *f = (fitting){0};
}

bool fitting_is_held_out(const fitting *f, size_t i)
{
    return f->holdout && i % f->holdout == f->holdout - 1;
}

void fitting_pass(const fitting *f, bool (*wanted)(void *context, size_t i),
                  fitting_step *each, void *context)
{
    vg_err e;
    size_t width = f->h->count * vg_head_width(f->h);
    double *room = cli_allocate(FITTING_BATCH, width * sizeof *room, "a batch of poses");
    fitting_batch b = {0};
    for (size_t i = 0; i < f->n; i++) {
        if (wanted && !wanted(context, i)) continue;
        b.index[b.n] = i;
        if (vg_poses_values(f->poses, i, room + b.n * width, &b.values[b.n], &e) < 0) cli_die(&e);
        if (++b.n < FITTING_BATCH) continue;
        each(context, &b);
        b.n = 0;
    }
    if (b.n) each(context, &b);
    free(room);
}

static size_t count_multiples(const fitting *f, size_t stride)
{
    size_t n = 0;
    for (size_t i = 0; i < f->n; i += stride) n += !fitting_is_held_out(f, i);
    return n;
}

size_t fitting_sample(const fitting *f, size_t most, size_t *index, double **values)
{
    vg_err e;
    size_t n = 0, stride = 1, width = f->h->count * vg_head_width(f->h);
    while (count_multiples(f, stride) > most) stride *= 2;
    for (size_t i = 0; i < f->n; i += stride) {
        if (fitting_is_held_out(f, i)) continue;
        const double *from;
        index[n] = i;
        values[n] = cli_allocate(width, sizeof **values, "a sample of the poses");
        if (vg_poses_values(f->poses, i, values[n], &from, &e) < 0) cli_die(&e);
        if (from != values[n]) memcpy(values[n], from, width * sizeof *from);
        n++;
    }
    return n;
}

void fitting_compare(fitting_errors *x, const double *truth, const double *result, size_t nv, bool centred)
{
    double shift[3] = {0, 0, 0}, a[3], b[3];
    if (centred) {
        vg_centroid(truth, nv, a);
        vg_centroid(result, nv, b);
        for (size_t k = 0; k < 3; k++) shift[k] = b[k] - a[k];
    }
    for (size_t v = 0; v < nv; v++) {
        double square = 0;
        for (size_t k = 0; k < 3; k++) {
            double d = result[3 * v + k] - truth[3 * v + k] - shift[k];
            square += d * d;
        }
        double far = sqrt(square);
        x->sum += far / (double)nv;
        if (x->first) x->first[v] += far, x->second[v] += square;
        if (far > x->most) x->most = far;
    }
    x->poses++;
}

double fitting_mean(const fitting_errors *x)
{
    return x->poses ? x->sum / (double)x->poses : 0;
}

double fitting_sigma(const fitting_errors *x, size_t nv)
{
    double most = 0, n = (double)x->poses;
    for (size_t v = 0; v < nv; v++) {
        double mean = x->first[v] / n, variance = x->second[v] / n - mean * mean;
        if (variance > most) most = variance;
    }
    return sqrt(most);
}
