/* usda.c: writes USD as text: one mesh whose points have a sample for every frame; polygons are kept. Texture
 * coordinates, materials, groups and skeletons are not written. There is no reader.
 *
 * Samples are written as they arrive; values before them that are known only later (rate, last time) have reserved
 * fields that are patched.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <math.h>
#include <stdlib.h>

enum { ROOM = 26, PLACES = 4 }; /* bytes reserved for a number; such fields */


typedef struct writing {
    vgi_output *out;
    const vg_head *h;
    vg_bytes text, extents;
    vgi_names names;
    uint64_t frames, first_key_off, place_off[PLACES];
    bool timed, ignored_times; /* set by the first frame; a later one had a time although the first had none */
    double first, last, rate, last_key;
    size_t segments;
} writing;

static int put_text(writing *x, const char *s, vg_err *e)
{
    return vgi_output_put(x->out, s, strlen(s), e);
}

/* Reserve a blank field for a number. */
static int put_room(writing *x, uint64_t *off, vg_err *e)
{
    char blank[ROOM];
    memset(blank, ' ', sizeof blank);
    *off = x->out->size;
    return vgi_output_put(x->out, blank, sizeof blank, e);
}

/* Overwrite the whole field, which may have held another number. */
static int fill_room(writing *x, uint64_t off, double number, vg_err *e)
{
    char digits[ROOM];
    memset(digits, ' ', sizeof digits);
    vgi_print_double(digits, number);
    return vgi_output_patch(x->out, off, digits, sizeof digits, e);
}

static int put_layer(writing *x, vg_err *e)
{
    static const char *const fields[PLACES] = {"startTimeCode", "endTimeCode", "timeCodesPerSecond",
                                               "framesPerSecond"};
    int r = put_text(x, "#usda 1.0\n(\n    defaultPrim = \"mesh\"\n    upAxis = \"Y\"\n", e);
    for (int i = 0; i < PLACES && r == VG_OK; i++) {
        r = put_text(x, "    ", e);
        if (r == VG_OK) r = put_text(x, fields[i], e);
        if (r == VG_OK) r = put_text(x, " = ", e);
        if (r == VG_OK) r = put_room(x, &x->place_off[i], e);
        if (r == VG_OK) r = put_text(x, "\n", e);
    }
    return r == VG_OK
               ? put_text(x, ")\n\ndef Mesh \"mesh\"\n{\n    uniform token subdivisionScheme = \"none\"\n", e)
               : r;
}

/* Numbers separated by commas. */
static int put_integer(writing *x, uint64_t number, bool first, vg_err *e)
{
    char digits[24] = ", ";
    size_t n = first ? 0 : 2;
    return vgi_output_put(x->out, digits, n + vgi_print_uint(digits + n, number), e);
}

/* A USD mesh has only faces with three or more corners. */
static int put_faces(writing *x, vg_err *e)
{
    const vg_mesh *m = &x->h->body.mesh;
    bool first = true;
    int r = put_text(x, "    int[] faceVertexCounts = [", e);
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        uint32_t n = m->start[f + 1] - m->start[f];
        if (n < 3) x->segments++;
        else r = put_integer(x, n, first, e), first = false;
    }
    if (r == VG_OK) r = put_text(x, "]\n    int[] faceVertexIndices = [", e);
    first = true;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        if (m->start[f + 1] - m->start[f] < 3) continue;
        for (uint32_t c = m->start[f]; c < m->start[f + 1] && r == VG_OK; c++)
            r = put_integer(x, m->vert[c], first, e), first = false;
    }
    return r == VG_OK ? put_text(x, "]\n    point3f[] points.timeSamples = {\n", e) : r;
}

static int begin_usda(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    (void)o;
    writing *x = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->out = out, x->h = h, x->rate = VG_FPS;
    int r = put_layer(x, e);
    return r < 0 ? r : put_faces(x, e);
}

/* ---- time ---- */

/* Recover integers that were stored as times in binary32. */
static double settled(double x)
{
    return fabs(x - round(x)) <= 1e-4 ? round(x) : x;
}

static int check_time(writing *x, const vg_frame *f, vg_err *e)
{
    if (x->frames == 0) x->timed = f->has_time;
    if (!x->timed) {
        x->ignored_times |= f->has_time;
        return VG_OK;
    }
    if (!f->has_time)
        return vg_fail(e, VG_EINPUT, "it has no time, but earlier frames have (vg-encode --fps gives all times)");
    if (x->frames && !(f->time > x->last))
        return vg_fail(e, VG_EINPUT, "its time %g is not later than %g, that of the frame before it", f->time,
                       x->last);
    return VG_OK;
}

/* The first step between two frames gives the rate, and so the time code of the previous frame. */
static int settle_rate(writing *x, const vg_frame *f, vg_err *e)
{
    double step = f->time - x->first;
    x->rate = settled(1 / step);
    if (!(x->rate > 0 && isfinite(x->rate))) x->rate = VG_FPS;
    x->last_key = settled(x->first * x->rate);
    return fill_room(x, x->first_key_off, x->last_key, e);
}

/* The time code of this frame, and the start of its line. */
static int put_key(writing *x, const vg_frame *f, vg_err *e)
{
    double key = x->timed ? settled(f->time * x->rate) : (double)x->frames;
    if (x->frames == 0) x->first = f->time;
    x->last = f->time;
    int r = put_text(x, "        ", e);
    if (x->frames == 0) {
        if (r == VG_OK) r = put_room(x, &x->first_key_off, e);
        if (r == VG_OK) r = fill_room(x, x->first_key_off, key, e);
    } else {
        char digits[ROOM];
        if (!(key > x->last_key))
            return vg_fail(e, VG_EINPUT, "its time %g is too close to that of the frame before it", f->time);
        if (r == VG_OK) r = vgi_output_put(x->out, digits, vgi_print_double(digits, key), e);
    }
    x->last_key = key;
    return r == VG_OK ? put_text(x, ": [", e) : r;
}

/* ---- points ---- */

static size_t print_point(char *to, const double p[3])
{
    char *at = to;
    *at++ = '(';
    for (int k = 0; k < 3; k++) {
        at += vgi_print_float(at, p[k]);
        *at++ = k < 2 ? ',' : ')';
    }
    return (size_t)(at - to);
}

/* The bounding box of the points as two points, for "[(..),(..)]". */
static int keep_extent(writing *x, const double *v, vg_err *e)
{
    double box[6] = {v[0], v[1], v[2], v[0], v[1], v[2]};
    for (size_t i = 1; i < x->h->count; i++)
        for (int k = 0; k < 3; k++) {
            box[k] = fmin(box[k], v[3 * i + (size_t)k]);
            box[3 + k] = fmax(box[3 + k], v[3 * i + (size_t)k]);
        }
    double with_key[7] = {x->last_key, box[0], box[1], box[2], box[3], box[4], box[5]};
    return vgi_bytes_append(&x->extents, with_key, sizeof with_key, e);
}

static int put_points(writing *x, const vg_frame *f, vg_err *e)
{
    enum { MOST_POINT = 3 * 17 + 4 };
    size_t n = x->h->count;
    x->text.size = 0;
    int r = vgi_bytes_reserve(&x->text, n * MOST_POINT + 4, e);
    if (r < 0) return r;
    char *to = (char *)x->text.data;
    for (size_t i = 0; i < n; i++) {
        const double *p = f->values + 3 * i;
        if (!isfinite((float)p[0]) || !isfinite((float)p[1]) || !isfinite((float)p[2]))
            return vg_fail(e, VG_EINPUT, "vertex %zu does not fit binary32", i);
        if (i) *to++ = ',';
        to += print_point(to, p);
    }
    memcpy(to, "],\n", 3);
    return vgi_output_put(x->out, x->text.data, (size_t)(to + 3 - (char *)x->text.data), e);
}

static int put_usda(void *state, const vg_frame *f, vg_err *e)
{
    writing *x = state;
    int r = check_time(x, f, e);
    if (r == VG_OK && x->timed && x->frames == 1) r = settle_rate(x, f, e);
    if (r == VG_OK) r = put_key(x, f, e);
    if (r == VG_OK) r = put_points(x, f, e);
    if (r == VG_OK && x->h->count) r = keep_extent(x, f->values, e);
    if (r == VG_OK) r = vgi_names_add(&x->names, f->name ? f->name : "", f->name ? strlen(f->name) : 0, e);
    x->frames++;
    return r;
}

/* ---- the end ---- */

static double first_key(const writing *x)
{
    return x->timed ? settled(x->first * x->rate) : 0;
}

static int put_extents(writing *x, vg_err *e)
{
    double row[7];
    int r = put_text(x, "    }\n    float3[] extent.timeSamples = {\n", e);
    for (size_t at = 0; at < x->extents.size && r == VG_OK; at += sizeof row) {
        char line[200] = "        ", *to = line + 8;
        memcpy(row, x->extents.data + at, sizeof row);
        to += vgi_print_double(to, at ? row[0] : first_key(x));
        memcpy(to, ": [", 3), to += 3;
        to += print_point(to, row + 1);
        *to++ = ',';
        to += print_point(to, row + 4);
        memcpy(to, "],\n", 3), to += 3;
        r = vgi_output_put(x->out, line, (size_t)(to - line), e);
    }
    return r == VG_OK ? put_text(x, "    }\n", e) : r;
}

static int put_string(writing *x, const char *s, vg_err *e)
{
    char piece[8];
    int r = put_text(x, "\"", e);
    for (; *s && r == VG_OK; s++) {
        unsigned char c = (unsigned char)*s;
        if (c < 0x20 || c == 0x7f) snprintf(piece, sizeof piece, "\\x%02x", c);
        else snprintf(piece, sizeof piece, c == '"' || c == '\\' ? "\\%c" : "%c", c);
        r = put_text(x, piece, e);
    }
    return r == VG_OK ? put_text(x, "\"", e) : r;
}

static int put_names(writing *x, vg_err *e)
{
    int r = put_text(x, "    custom string[] vg:frameNames = [", e);
    for (size_t i = 0; i < x->names.n && r == VG_OK; i++) {
        if (i) r = put_text(x, ", ", e);
        if (r == VG_OK) r = put_string(x, x->names.at[i], e);
    }
    return r == VG_OK ? put_text(x, "]\n}\n", e) : r;
}

static int end_usda(void *state, vg_err *e)
{
    writing *x = state;
    const double numbers[PLACES] = {first_key(x), x->last_key, x->rate, x->rate};
    int r = put_extents(x, e);
    if (r == VG_OK) r = put_names(x, e);
    for (int i = 0; i < PLACES && r == VG_OK; i++) r = fill_room(x, x->place_off[i], numbers[i], e);
    return r;
}

static const char *warn_usda(void *state)
{
    const writing *x = state;
    if (x->segments) return x->ignored_times ? "line segments, and the times of the frames" : "line segments";
    return x->ignored_times ? "the times of the frames: the first has none" : NULL;
}

static void release_usda(void *state)
{
    writing *x = state;
    if (!x) return;
    vg_bytes_clear(&x->text);
    vg_bytes_clear(&x->extents);
    vgi_names_clear(&x->names);
    free(x);
}

const vgi_sequence_format vgi_sequence_usda = {
    .name = "usda", .suffix = ".usda",
    .keeps = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_NAMES | VGI_KEEPS_TIMES,
    .kinds = 1 << VG_VERTICES, .begin = begin_usda, .put = put_usda, .end = end_usda, .warning = warn_usda,
    .release = release_usda};
