/* page_data.c: packs poses into few bytes: quantised, predicted, split into byte planes, deflated, base64. page.h
 * documents the format; page_read.js reads it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/page.h"

#include <math.h>
#include <zlib.h>

enum {
    CHUNK_FRAMES = 32,
    CHUNK_BYTES = 64 << 20,   /* in binary64, unless one frame is larger */
    DEFLATE_STEP = 1 << 28,   /* zlib counts in 32 bits */
    LEVELS = 65535,
};

/* ---- deflate ---- */

static int zlib_fails(z_stream *z, vg_err *e)
{
    return vg_fail(e, VG_ENOMEM, "not enough memory to compress%s%s", z->msg ? ": " : "", z->msg ? z->msg : "");
}

static int deflate_all(vg_bytes *packed, const unsigned char *data, size_t n, vg_err *e)
{
    z_stream z = {0};
    packed->size = 0;
    /* the lower bytes of residuals are noise: searching them for repetitions only costs time */
    if (deflateInit2(&z, 4, Z_DEFLATED, 15, 9, Z_FILTERED) != Z_OK) return zlib_fails(&z, e);
    int r = VG_OK, state;
    size_t at = 0;
    do {
        r = vgi_bytes_reserve(packed, packed->size + (1 << 16), e);
        if (r < 0) break;
        if (z.avail_in == 0 && at < n) {
            size_t take = n - at < DEFLATE_STEP ? n - at : DEFLATE_STEP;
            z.next_in = (unsigned char *)(uintptr_t)(data + at);
            z.avail_in = (uInt)take;
            at += take;
        }
        size_t room = packed->cap - packed->size;
        if (room > DEFLATE_STEP) room = DEFLATE_STEP;
        z.next_out = packed->data + packed->size;
        z.avail_out = (uInt)room;
        state = deflate(&z, at < n ? Z_NO_FLUSH : Z_FINISH);
        packed->size += room - z.avail_out;
        if (state != Z_OK && state != Z_STREAM_END && state != Z_BUF_ERROR) r = zlib_fails(&z, e);
    } while (r == VG_OK && state != Z_STREAM_END);
    deflateEnd(&z);
    return r;
}

/* ---- frames ---- */

int vgi_track_init(vgi_track *t, size_t nv, size_t width, vg_err *e)
{
    size_t numbers, total;
    *t = (vgi_track){.nv = nv, .width = width, .cap = CHUNK_FRAMES};
    if (!vgi_mul(nv, width, &numbers)) return vg_fail(e, VG_ENOMEM, "not enough memory for a pose");
    if (numbers > CHUNK_BYTES / sizeof(double) / CHUNK_FRAMES) t->cap = CHUNK_BYTES / sizeof(double) / numbers;
    if (t->cap == 0) t->cap = 1;
    if (!vgi_mul(numbers, t->cap, &total) || total > SIZE_MAX / 4)
        return vg_fail(e, VG_ENOMEM, "not enough memory for a pose");
    t->values = vgi_array_raw(total, sizeof *t->values, e);
    t->q = vgi_array_raw(total, sizeof *t->q, e);
    t->left = vgi_array_raw(t->cap + 2 * total, 1, e);
    if (t->values && t->q && t->left) return VG_OK;
    vgi_track_clear(t);
    return VG_ENOMEM;
}

void vgi_track_clear(vgi_track *t)
{
    free(t->values);
    free(t->q);
    free(t->left);
    *t = (vgi_track){0};
}

double *vgi_track_next(vgi_track *t)
{
    return t->values + t->n++ * t->nv * t->width;
}

static void find_steps(const vgi_track *t, vgi_chunk *c)
{
    size_t elements = t->n * t->nv;
    for (size_t k = 0; k < 3; k++) c->origin[k] = c->step[k] = 0;
    for (size_t k = 0; k < t->width; k++) {
        double least = INFINITY, most = -INFINITY;
        for (size_t i = 0; i < elements; i++) {
            double x = t->values[i * t->width + k];
            least = x < least ? x : least;
            most = x > most ? x : most;
        }
        if (!(least <= most)) continue; /* no vertices */
        c->origin[k] = least;
        c->step[k] = most / LEVELS - least / LEVELS; /* most - least may overflow */
    }
}

static void quantise(vgi_track *t, vgi_chunk *c)
{
    double worst = 0;
    find_steps(t, c);
    for (size_t i = 0; i < t->n; i++) {
        const double *values = t->values + i * t->nv * t->width;
        uint16_t *q = t->q + i * t->nv * t->width;
        for (size_t v = 0; v < t->nv; v++) {
            double sum = 0;
            for (size_t k = 0; k < t->width; k++) {
                double x = values[v * t->width + k];
                double at = c->step[k] > 0 ? (x - c->origin[k]) / c->step[k] + 0.5 : 0;
                uint16_t level = at >= LEVELS ? LEVELS : (uint16_t)at;
                double off = x - (c->origin[k] + c->step[k] * level);
                q[k * t->nv + v] = level;
                sum += off * off;
            }
            worst = sum > worst ? sum : worst;
        }
    }
    c->loss = sqrt(worst);
}

/* The residual of a value whose predictor is `frame` values before it; modulo 2^16. */
static inline uint16_t remainder_of(const uint16_t *q, ptrdiff_t frame, unsigned how)
{
    unsigned x = *q;
    if (how & VGI_PREDICT_FRAME) x -= q[-frame];
    if (how & VGI_PREDICT_MOTION) x -= 2U * q[-frame] - q[-2 * frame];
    return (uint16_t)x;
}

static inline uint16_t zigzag(uint16_t x) /* zigzag: 0 -1 1 -2 2 ... to 0 1 2 3 4 ... */
{
    return (uint16_t)(x & 0x8000 ? ~(x << 1) : x << 1);
}

/* Predict a frame: returns the bits of its residuals, or, if upper is not NULL, stores the two bytes of each. */
static inline __attribute__((always_inline)) uint64_t predict(const uint16_t *values, const vgi_track *t,
                                                              unsigned how, unsigned char *upper,
                                                              unsigned char *lower)
{
    size_t frame = t->nv * t->width, i = 0;
    uint64_t bits = 0;
    for (size_t k = 0; k < t->width; k++) {
        uint16_t before = 0;
        for (size_t v = 0; v < t->nv; v++, i++) {
            uint16_t x = remainder_of(values + i, (ptrdiff_t)frame, how), rest = x;
            if (how & VGI_PREDICT_NEIGHBOUR) rest = (uint16_t)(x - before);
            before = x;
            rest = zigzag(rest);
            if (upper) upper[i] = (unsigned char)(rest >> 8), lower[i] = (unsigned char)rest;
            else bits += 32U - (unsigned)__builtin_clz(2U * rest + 1U);
        }
    }
    return bits;
}

static uint64_t count_bits(const uint16_t *q, const vgi_track *t, unsigned how)
{
    switch (how) { /* so that the compiler specialises each loop */
    case 0: return predict(q, t, 0, NULL, NULL);
    case 1: return predict(q, t, 1, NULL, NULL);
    case 2: return predict(q, t, 2, NULL, NULL);
    case 4: return predict(q, t, 4, NULL, NULL);
    case 5: return predict(q, t, 5, NULL, NULL);
    default: return predict(q, t, 6, NULL, NULL);
    }
}

static unsigned choose_predictor(const vgi_track *t, size_t i)
{
    static const unsigned ways[] = {4, 5, 6, 0, 1, 2};
    const uint16_t *q = t->q + i * t->nv * t->width;
    unsigned best = 0;
    uint64_t least = UINT64_MAX;
    for (size_t j = 0; j < sizeof ways / sizeof *ways; j++) {
        if ((ways[j] & 3) > i) continue; /* needs more previous frames than exist */
        uint64_t bits = count_bits(q, t, ways[j]);
        if (bits < least) least = bits, best = ways[j];
    }
    return best;
}

int vgi_track_pack(vgi_track *t, vgi_chunk *c, vg_err *e)
{
    size_t frame = t->nv * t->width, total = t->n * frame;
    quantise(t, c);
    for (size_t i = 0; i < t->n; i++) {
        unsigned how = choose_predictor(t, i);
        t->left[i] = (unsigned char)how;
        unsigned char *upper = t->left + t->n + i * frame;
        predict(t->q + i * frame, t, how, upper, upper + total);
    }
    c->n = t->n;
    t->n = 0;
    return deflate_all(&c->packed, t->left, c->n + 2 * total, e);
}

/* ---- lists and text ---- */

int vgi_pack_list(vg_bytes *packed, const uint32_t *list, size_t n, bool differences, vg_err *e)
{
    size_t size;
    if (!vgi_mul(n, 4, &size)) return vg_fail(e, VG_ENOMEM, "not enough memory for the faces of the page");
    unsigned char *planes = vgi_array_raw(size, 1, e);
    if (!planes) return VG_ENOMEM;
    for (size_t i = 0; i < n; i++) {
        uint32_t x = list[i] - (differences && i ? list[i - 1] : 0);
        for (size_t k = 0; k < 4; k++) planes[k * n + i] = (unsigned char)(x >> (24 - 8 * k));
    }
    int r = deflate_all(packed, planes, size, e);
    free(planes);
    return r;
}

int vgi_base64(vg_bytes *text, const unsigned char *data, size_t n, vg_err *e)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t size;
    if (!vgi_mul(n / 3 + 1, 4, &size) || size > SIZE_MAX - text->size)
        return vg_fail(e, VG_ENOMEM, "not enough memory for the data of the page");
    int r = vgi_bytes_reserve(text, text->size + size, e);
    if (r < 0) return r;
    unsigned char *to = text->data + text->size;
    for (size_t i = 0; i < n; i += 3) {
        size_t here = n - i < 3 ? n - i : 3;
        unsigned second = here > 1 ? data[i + 1] : 0, third = here > 2 ? data[i + 2] : 0;
        unsigned x = (unsigned)data[i] << 16 | second << 8 | third;
        *to++ = (unsigned char)digits[x >> 18];
        *to++ = (unsigned char)digits[x >> 12 & 63];
        *to++ = here > 1 ? (unsigned char)digits[x >> 6 & 63] : '=';
        *to++ = here > 2 ? (unsigned char)digits[x & 63] : '=';
    }
    text->size = (size_t)(to - text->data);
    return VG_OK;
}
