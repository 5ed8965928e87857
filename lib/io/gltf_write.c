/* gltf_write.c: a sequence as one mesh with a morph target for each frame and an animation of weights that plays
 * them.
 * Leaves out normals, which change with the pose, materials, and texture coordinates.
 *
 * The frames wait in a file without a name, as displacements from the reference pose. When there are more of them
 * than targets are wanted, some are chosen, one after another where the others are worst, and the others are mixed
 * from two neighbours.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <unistd.h>

enum { USUAL_TARGETS = 100, MOST_CLIPPED = 512, ITEM = 4, POINT = 12 };

static const double usual_rate = 30;

typedef struct times {
    double *at;
    size_t n, cap;
} times;

/* Frames from..to are mixed from these two; the worst of them, and by how much. */
typedef struct span {
    size_t from, to, worst;
    double error;
} span;

typedef struct writing {
    vgi_output *out, spool;
    const vg_head *h;
    bool binary, timed, some_timed;
    size_t frames, most;
    vgi_names names;
    times times;
    unsigned char *packed; /* a frame as it waits */
    float *base;           /* the reference pose as it will be read */
    /* at the end: */
    vg_bytes triangles, lines, runs; /* runs: count, size, count, size, ... as text */
    size_t *target_of;     /* of each frame the target that comes at or before it */
    size_t *chosen, targets;
    span *spans;
    double *share;         /* of each frame: of the next target */
    double error;
    float *first, *second, *third; /* frames at work */
    double (*bounds)[6];   /* of the base and each target: least and most x y z */
    vg_bytes json;
    unsigned char carry[3]; /* base64: bytes that wait for their third */
    size_t ncarry;
    char warning[280];
} writing;

int vgi_gltf_check(const vg_head *h, const char *output, vg_err *e)
{
    if (h->mesh.nv) return VG_OK;
    return vg_fail(e, VG_EINPUT, "cannot write '%s': a mesh of glTF must have vertices", output);
}

static void put_single(unsigned char *to, float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    vgi_put32(to, bits);
}

static float get_single(const unsigned char *p)
{
    uint32_t bits = vgi_get32(p);
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static int too_large(vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "a position is too large for binary32");
}

static int round_base(writing *x, vg_err *e)
{
    for (size_t i = 0; i < 3 * x->h->mesh.nv; i++) {
        x->base[i] = (float)x->h->reference[i];
        if (!isfinite(x->base[i])) return too_large(e);
    }
    return VG_OK;
}

int vgi_gltf_begin(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, bool binary, vg_err *e)
{
    writing *x = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->out = out, x->h = h, x->binary = binary, x->timed = true;
    x->most = o->most_targets ? o->most_targets : USUAL_TARGETS;
    x->spool.name = "temporary file";
    if ((x->spool.fd = vgi_nameless_file(e)) < 0) return x->spool.fd;
    const size_t nv = h->mesh.nv;
    x->base = vgi_array_raw(nv, POINT, e), x->packed = vgi_array_raw(nv, POINT, e);
    x->first = vgi_array_raw(nv, POINT, e), x->second = vgi_array_raw(nv, POINT, e),
    x->third = vgi_array_raw(nv, POINT, e);
    if (!x->base || !x->packed || !x->first || !x->second || !x->third) return VG_ENOMEM;
    return round_base(x, e);
}

int vgi_gltf_put(void *state, const vg_frame *f, vg_err *e)
{
    writing *x = state;
    const size_t n = 3 * x->h->mesh.nv;
    for (size_t i = 0; i < n; i++) {
        float d = (float)(f->values[i] - x->base[i]);
        if (!isfinite(d)) return too_large(e);
        put_single(x->packed + ITEM * i, d);
    }
    int r = vgi_names_add(&x->names, f->name ? f->name : "", f->name ? strlen(f->name) : 0, e);
    if (r == VG_OK) r = vgi_grow(&x->times.at, &x->times.cap, x->frames + 1, sizeof *x->times.at, e);
    if (r < 0) return r;
    x->times.at[x->frames++] = f->has_time ? f->time : NAN;
    x->some_timed |= f->has_time;
    return vgi_output_put(&x->spool, x->packed, ITEM * n, e);
}

/* ---- faces ---- */

static void area(const double *p, const double *q, const double *r, double n[3])
{
    double a[3], b[3];
    for (int k = 0; k < 3; k++) a[k] = q[k] - p[k], b[k] = r[k] - p[k];
    n[0] = a[1] * b[2] - a[2] * b[1], n[1] = a[2] * b[0] - a[0] * b[2], n[2] = a[0] * b[1] - a[1] * b[0];
}

static const double *place(const writing *x, uint32_t v)
{
    return x->h->reference + 3 * (size_t)v;
}

/* Does the triangle look where the face does, or nowhere? */
static double facing(const writing *x, uint32_t a, uint32_t b, uint32_t c, const double normal[3])
{
    double n[3];
    area(place(x, a), place(x, b), place(x, c), n);
    return n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2];
}

static void face_normal(const writing *x, const uint32_t *v, size_t n, double normal[3])
{
    normal[0] = normal[1] = normal[2] = 0;
    for (size_t i = 1; i + 1 < n; i++) {
        double t[3];
        area(place(x, v[0]), place(x, v[i]), place(x, v[i + 1]), t);
        for (int k = 0; k < 3; k++) normal[k] += t[k];
    }
}

static int put_index(vg_bytes *to, uint32_t v, vg_err *e)
{
    unsigned char p[ITEM];
    vgi_put32(p, v);
    return vgi_bytes_append(to, p, sizeof p, e);
}

static int put_triangle(writing *x, uint32_t a, uint32_t b, uint32_t c, vg_err *e)
{
    int r = put_index(&x->triangles, a, e);
    if (r == VG_OK) r = put_index(&x->triangles, b, e);
    return r < 0 ? r : put_index(&x->triangles, c, e);
}

static bool is_ear(const writing *x, const uint32_t *ring, size_t n, size_t b, const double normal[3])
{
    uint32_t p = ring[(b + n - 1) % n], q = ring[b], s = ring[(b + 1) % n];
    if (!(facing(x, p, q, s, normal) > 0)) return false;
    for (size_t i = 0; i < n; i++) {
        uint32_t v = ring[i];
        if (v != p && v != q && v != s && facing(x, p, q, v, normal) >= 0 && facing(x, q, s, v, normal) >= 0 &&
            facing(x, s, p, v, normal) >= 0)
            return false;
    }
    return true;
}

static bool is_fan(const writing *x, const uint32_t *v, size_t n, const double normal[3])
{
    for (size_t i = 1; i + 1 < n; i++)
        if (!(facing(x, v[0], v[i], v[i + 1], normal) >= 0)) return false;
    return true;
}

static int put_fan(writing *x, const uint32_t *v, size_t n, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 1; i + 1 < n && r == VG_OK; i++) r = put_triangle(x, v[0], v[i], v[i + 1], e);
    return r;
}

static size_t find_ear(const writing *x, const uint32_t *ring, size_t n, const double normal[3])
{
    for (size_t b = 1; b < n; b++)
        if (is_ear(x, ring, n, b, normal)) return b;
    return is_ear(x, ring, n, 0, normal) ? 0 : 1; /* it touches or crosses itself: any will do */
}

/* The triangle with the face's first corner goes first and begins with it, so that the face can be put together
 * again. */
static void begin_with(unsigned char *triangles, size_t n, uint32_t v)
{
    for (size_t i = 0; i < 3 * n; i++) {
        if (vgi_get32(triangles + ITEM * i) != v) continue;
        unsigned char *t = triangles + POINT * (i / 3), first[POINT];
        for (size_t k = 0; k < 3; k++) memcpy(first + ITEM * k, t + ITEM * ((i + k) % 3), ITEM);
        memmove(triangles + POINT, triangles, POINT * (i / 3));
        memcpy(triangles, first, POINT);
        return;
    }
}

static int put_ears(writing *x, const uint32_t *v, size_t n, const double normal[3], vg_err *e)
{
    uint32_t ring[MOST_CLIPPED];
    const size_t start = x->triangles.size;
    int r = VG_OK;
    memcpy(ring, v, n * sizeof *v);
    for (size_t left = n; left > 2 && r == VG_OK; left--) {
        size_t b = find_ear(x, ring, left, normal);
        r = put_triangle(x, ring[(b + left - 1) % left], ring[b], ring[(b + 1) % left], e);
        memmove(ring + b, ring + b + 1, (left - 1 - b) * sizeof *ring);
    }
    if (r == VG_OK) begin_with(x->triangles.data + start, n - 2, v[0]);
    return r;
}

static int put_face(writing *x, const uint32_t *v, size_t n, vg_err *e)
{
    double normal[3];
    if (n == 2) {
        int r = put_index(&x->lines, v[0], e);
        return r < 0 ? r : put_index(&x->lines, v[1], e);
    }
    face_normal(x, v, n, normal);
    if (n == 3 || n > MOST_CLIPPED || is_fan(x, v, n, normal)) return put_fan(x, v, n, e);
    return put_ears(x, v, n, normal, e);
}

static int put_run(writing *x, size_t count, size_t size, vg_err *e)
{
    char text[64];
    int n = snprintf(text, sizeof text, "%s%zu,%zu", x->runs.size ? "," : "", count, size);
    return vgi_bytes_append(&x->runs, text, (size_t)n, e);
}

static int put_faces(writing *x, vg_err *e)
{
    const vg_mesh *m = &x->h->mesh;
    size_t count = 0, size = 0;
    int r = VG_OK;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        size_t n = m->start[f + 1] - m->start[f];
        if (n != size && count) r = put_run(x, count, size, e);
        count = n == size ? count + 1 : 1, size = n;
        if (r == VG_OK) r = put_face(x, m->vert + m->start[f], n, e);
    }
    return r == VG_OK && count ? put_run(x, count, size, e) : r;
}

/* ---- which frames become targets ---- */

static int load(const writing *x, size_t frame, float *to, vg_err *e)
{
    const size_t n = 3 * x->h->mesh.nv;
    uint64_t off = (uint64_t)frame * ITEM * n;
    for (size_t done = 0; done < ITEM * n;) {
        ssize_t got = pread(x->spool.fd, x->packed + done, ITEM * n - done, (off_t)(off + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0)
            return vg_fail(e, VG_ESYS, "cannot read a temporary file: %s",
                           got ? strerror(errno) : "it ends too early");
        done += (size_t)got;
    }
    for (size_t i = 0; i < n; i++) to[i] = get_single(x->packed + ITEM * i);
    return VG_OK;
}

/* The share of b in the mix of a and b that comes nearest to c, as a binary32. */
static double best_share(const float *a, const float *b, const float *c, size_t n)
{
    double along = 0, whole = 0;
    for (size_t i = 0; i < n; i++) {
        double d = (double)b[i] - a[i];
        along += d * ((double)c[i] - a[i]), whole += d * d;
    }
    double s = whole > 0 ? along / whole : 0;
    return (float)(s > 0 ? s < 1 ? s : 1 : 0);
}

static double mix_error(const float *a, const float *b, const float *c, size_t n, double s)
{
    double most = 0;
    for (size_t i = 0; i < n; i += 3) {
        double square = 0;
        for (size_t k = i; k < i + 3; k++) {
            double d = (1 - s) * a[k] + s * b[k] - c[k];
            square += d * d;
        }
        if (square > most) most = square;
    }
    return sqrt(most);
}

static int measure_span(writing *x, span *s, vg_err *e)
{
    const size_t n = 3 * x->h->mesh.nv;
    int r = s->to > s->from + 1 ? load(x, s->from, x->first, e) : VG_OK;
    if (r == VG_OK && s->to > s->from + 1) r = load(x, s->to, x->second, e);
    s->error = 0, s->worst = s->from;
    for (size_t i = s->from + 1; i < s->to && r == VG_OK; i++) {
        if ((r = load(x, i, x->third, e)) < 0) break;
        x->share[i] = best_share(x->first, x->second, x->third, n);
        double error = mix_error(x->first, x->second, x->third, n, x->share[i]);
        if (error > s->error) s->error = error, s->worst = i;
    }
    return r;
}

static int split_spans(writing *x, vg_err *e)
{
    size_t n = 1;
    x->spans[0] = (span){.from = 0, .to = x->frames - 1};
    int r = measure_span(x, &x->spans[0], e);
    while (r == VG_OK) {
        size_t worst = 0;
        for (size_t i = 1; i < n; i++)
            if (x->spans[i].error > x->spans[worst].error) worst = i;
        span *s = &x->spans[worst];
        x->error = s->error;
        if (s->error == 0 || n + 1 >= x->most) break;
        x->spans[n] = (span){.from = s->worst, .to = s->to};
        s->to = s->worst;
        x->share[s->to] = 0;
        r = measure_span(x, s, e);
        if (r == VG_OK) r = measure_span(x, &x->spans[n++], e);
    }
    for (size_t i = 0; i < n; i++) x->target_of[x->spans[i].from] = 1;
    return r;
}

/* target_of first marks the chosen ones. */
static int choose_targets(writing *x, vg_err *e)
{
    int r = VG_OK;
    x->target_of = vgi_array(x->frames, sizeof *x->target_of, e);
    x->chosen = vgi_array(x->frames, sizeof *x->chosen, e);
    x->share = vgi_array(x->frames, sizeof *x->share, e);
    x->spans = vgi_array(x->most < x->frames ? x->most : 1, sizeof *x->spans, e);
    if (!x->target_of || !x->chosen || !x->share || !x->spans) return VG_ENOMEM;
    if (x->frames <= x->most) {
        for (size_t i = 0; i < x->frames; i++) x->target_of[i] = 1;
    } else {
        r = split_spans(x, e);
        x->target_of[x->frames - 1] = 1;
    }
    for (size_t i = 0; i < x->frames; i++) {
        if (x->target_of[i]) x->chosen[x->targets++] = i;
        x->target_of[i] = x->targets - 1;
    }
    return r;
}

/* ---- times ---- */

/* An animation begins at 0 or later and goes on, in binary32. */
static bool times_fit(const writing *x)
{
    for (size_t i = 0; i < x->frames; i++) {
        double t = x->times.at[i];
        if (!(t >= 0 && t <= FLT_MAX) || (i > 0 && !((float)t > (float)x->times.at[i - 1]))) return false;
    }
    return true;
}

static double time_of(const writing *x, size_t i)
{
    return (float)(x->timed ? x->times.at[i] : (double)i / usual_rate);
}

/* ---- JSON ---- */

static int say(writing *x, vg_err *e, const char *format, ...) VG_PRINTF(3, 4);
static int say(writing *x, vg_err *e, const char *format, ...)
{
    char text[400];
    va_list list;
    va_start(list, format);
    int n = vsnprintf(text, sizeof text, format, list);
    va_end(list);
    return vgi_bytes_append(&x->json, text, (size_t)n, e);
}

static int say_text(writing *x, const char *s, vg_err *e)
{
    int r = vgi_bytes_append(&x->json, "\"", 1, e);
    for (; *s && r == VG_OK; s++) {
        if (*s == '"' || *s == '\\' || (unsigned char)*s < 0x20) r = say(x, e, "\\u%04x", (unsigned)*s);
        else r = vgi_bytes_append(&x->json, s, 1, e);
    }
    return r < 0 ? r : vgi_bytes_append(&x->json, "\"", 1, e);
}

static int say_numbers(writing *x, const char *before, const double *p, size_t n, const char *behind, vg_err *e)
{
    int r = say(x, e, "%s", before);
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        char digits[32];
        if (i > 0) r = say(x, e, ",");
        if (r == VG_OK) r = vgi_bytes_append(&x->json, digits, vgi_print_double(digits, p[i]), e);
    }
    return r < 0 ? r : say(x, e, "%s", behind);
}

static int say_extent(writing *x, const double *least, const double *most, size_t n, vg_err *e)
{
    int r = say_numbers(x, ",\"min\":[", least, n, "]", e);
    return r < 0 ? r : say_numbers(x, ",\"max\":[", most, n, "]}", e);
}

/* Views and accessors come in this order; those of no bytes are left out. */
enum part { TRIANGLES, LINES, TIMES, WEIGHTS, POINTS, PARTS };

static size_t part_bytes(const writing *x, enum part p)
{
    switch (p) {
    case TRIANGLES: return x->triangles.size;
    case LINES: return x->lines.size;
    case TIMES: return ITEM * x->frames;
    case WEIGHTS: return ITEM * x->frames * x->targets;
    default: return POINT * x->h->mesh.nv * (x->targets + 1);
    }
}

static size_t number_of(const writing *x, enum part p)
{
    size_t n = 0;
    for (int i = 0; i < (int)p; i++) n += part_bytes(x, (enum part)i) > 0;
    return n;
}

static int say_views(writing *x, vg_err *e)
{
    static const char *const more[PARTS] = {",\"target\":34963", ",\"target\":34963", "", "",
                                            ",\"target\":34962,\"byteStride\":12"};
    size_t off = 0;
    int r = say(x, e, "\"bufferViews\":[");
    for (int i = 0; i < PARTS && r == VG_OK; i++) {
        size_t n = part_bytes(x, (enum part)i);
        if (n)
            r = say(x, e, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu%s}", off ? "," : "", off, n,
                    more[i]);
        off += n;
    }
    return r < 0 ? r : say(x, e, "],\n");
}

static int say_accessor(writing *x, enum part p, size_t off, int component, size_t count, const char *type, vg_err *e)
{
    return say(x, e, "{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d,\"count\":%zu,\"type\":\"%s\"",
               number_of(x, p), off, component, count, type);
}

static int say_accessors(writing *x, vg_err *e)
{
    const double first = time_of(x, 0), last = time_of(x, x->frames - 1);
    int r = say(x, e, "\"accessors\":[");
    for (int i = TRIANGLES; i <= LINES && r == VG_OK; i++) {
        size_t n = part_bytes(x, (enum part)i);
        if (n) r = say_accessor(x, (enum part)i, 0, VGI_GLTF_UINT, n / ITEM, "SCALAR", e);
        if (n && r == VG_OK) r = say(x, e, "},\n");
    }
    if (r == VG_OK) r = say_accessor(x, TIMES, 0, VGI_GLTF_FLOAT, x->frames, "SCALAR", e);
    if (r == VG_OK) r = say_extent(x, &first, &last, 1, e);
    if (r == VG_OK) r = say(x, e, ",\n");
    if (r == VG_OK) r = say_accessor(x, WEIGHTS, 0, VGI_GLTF_FLOAT, x->frames * x->targets, "SCALAR", e);
    if (r == VG_OK) r = say(x, e, "}");
    for (size_t t = 0; t <= x->targets && r == VG_OK; t++) {
        r = say(x, e, ",\n");
        if (r == VG_OK)
            r = say_accessor(x, POINTS, t * POINT * x->h->mesh.nv, VGI_GLTF_FLOAT, x->h->mesh.nv, "VEC3", e);
        if (r == VG_OK) r = say_extent(x, x->bounds[t], x->bounds[t] + 3, 3, e);
    }
    return r < 0 ? r : say(x, e, "],\n");
}

static int say_primitive(writing *x, bool first, int mode, bool indexed, enum part indices, vg_err *e)
{
    const size_t points = number_of(x, POINTS);
    int r = say(x, e, "%s{\"mode\":%d,\"attributes\":{\"POSITION\":%zu}", first ? "" : ",\n", mode, points);
    if (r == VG_OK && indexed) r = say(x, e, ",\"indices\":%zu", number_of(x, indices));
    for (size_t t = 0; t < x->targets && r == VG_OK; t++)
        r = say(x, e, "%s{\"POSITION\":%zu}", t ? "," : ",\"targets\":[", points + 1 + t);
    return r < 0 ? r : say(x, e, "]}");
}

static int say_names(writing *x, const char *key, const size_t *which, size_t n, vg_err *e)
{
    int r = say(x, e, "\"%s\":[", key);
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        if (i > 0) r = say(x, e, ",");
        if (r == VG_OK) r = say_text(x, x->names.at[which ? which[i] : i], e);
    }
    return r < 0 ? r : say(x, e, "]");
}

static int say_mesh(writing *x, vg_err *e)
{
    const bool triangles = x->triangles.size, lines = x->lines.size;
    const char *name = x->h->reference_name ? x->h->reference_name : "";
    int r = say(x, e, "\"meshes\":[{\"name\":");
    if (r == VG_OK) r = say_text(x, *name ? name : "mesh", e);
    if (r == VG_OK) r = say(x, e, ",\"primitives\":[");
    if (r == VG_OK && triangles) r = say_primitive(x, true, VGI_GLTF_TRIANGLES, true, TRIANGLES, e);
    if (r == VG_OK && lines) r = say_primitive(x, !triangles, VGI_GLTF_LINES, true, LINES, e);
    if (r == VG_OK && !triangles && !lines) r = say_primitive(x, true, VGI_GLTF_POINTS, false, POINTS, e);
    if (r == VG_OK) r = say(x, e, "],\n\"weights\":[");
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) r = say(x, e, "%s0", t ? "," : "");
    if (r == VG_OK) r = say(x, e, "],\n\"extras\":{");
    if (r == VG_OK) r = say_names(x, "targetNames", x->chosen, x->targets, e);
    if (r == VG_OK) r = say(x, e, ",\n\"" VGI_GLTF_FACES "\":[");
    if (r == VG_OK) r = vgi_bytes_append(&x->json, x->runs.data, x->runs.size, e);
    return r < 0 ? r : say(x, e, "]}}],\n");
}

static int say_animation(writing *x, vg_err *e)
{
    int r = say(x, e,
                "\"animations\":[{\"name\":\"sequence\",\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,"
                "\"path\":\"weights\"}}],"
                "\"samplers\":[{\"input\":%zu,\"output\":%zu,\"interpolation\":\"LINEAR\"}],\n\"extras\":{",
                number_of(x, TIMES), number_of(x, WEIGHTS));
    if (r == VG_OK) r = say_names(x, VGI_GLTF_FRAMES, NULL, x->frames, e);
    return r < 0 ? r : say(x, e, "}}],\n");
}

static int say_all(writing *x, size_t bytes, vg_err *e)
{
    int r = say(x, e,
                "{\"asset\":{\"version\":\"2.0\",\"generator\":\"vg " VG_VERSION
                "\"},\n\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
                "\"nodes\":[{\"mesh\":0}],\n");
    if (r == VG_OK) r = say_mesh(x, e);
    if (r == VG_OK) r = say_animation(x, e);
    if (r == VG_OK) r = say_accessors(x, e);
    if (r == VG_OK) r = say_views(x, e);
    return r < 0 ? r : say(x, e, "\"buffers\":[{\"byteLength\":%zu%s", bytes,
                           x->binary ? "}]}" : ",\"uri\":\"data:application/octet-stream;base64,");
}

/* ---- bytes ---- */

static void encode3(const unsigned char *p, size_t n, char to[4])
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    uint32_t bits = (uint32_t)p[0] << 16 | (uint32_t)(n > 1 ? p[1] : 0) << 8 | (n > 2 ? p[2] : 0);
    for (int k = 0; k < 4; k++) to[k] = (size_t)k > n ? '=' : digits[bits >> (18 - 6 * k) & 63];
}

/* Bytes of the buffer: as they are, or as base64. */
static int emit(writing *x, const unsigned char *p, size_t n, vg_err *e)
{
    if (x->binary) return vgi_output_put(x->out, p, n, e);
    int r = VG_OK;
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        char four[4];
        x->carry[x->ncarry++] = p[i];
        if (x->ncarry < 3) continue;
        encode3(x->carry, 3, four);
        x->ncarry = 0;
        r = vgi_output_put(x->out, four, 4, e);
    }
    return r;
}

static int emit_singles(writing *x, const float *p, size_t n, vg_err *e)
{
    for (size_t i = 0; i < n; i++) put_single(x->packed + ITEM * i, p[i]);
    return emit(x, x->packed, ITEM * n, e);
}

static int emit_single(writing *x, double value, vg_err *e)
{
    unsigned char p[ITEM];
    put_single(p, (float)value);
    return emit(x, p, sizeof p, e);
}

static int emit_weights(writing *x, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < x->frames && r == VG_OK; i++)
        for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
            double s = x->share[i];
            r = emit_single(x, t == x->target_of[i] ? 1 - s : t == x->target_of[i] + 1 ? s : 0, e);
        }
    return r;
}

static int emit_all(writing *x, vg_err *e)
{
    const size_t n = 3 * x->h->mesh.nv;
    int r = emit(x, x->triangles.data, x->triangles.size, e);
    if (r == VG_OK) r = emit(x, x->lines.data, x->lines.size, e);
    for (size_t i = 0; i < x->frames && r == VG_OK; i++) r = emit_single(x, time_of(x, i), e);
    if (r == VG_OK) r = emit_weights(x, e);
    if (r == VG_OK) r = emit_singles(x, x->base, n, e);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        r = load(x, x->chosen[t], x->first, e);
        if (r == VG_OK) r = emit_singles(x, x->first, n, e);
    }
    return r;
}

static void find_bounds(const float *p, size_t nv, double bounds[6])
{
    for (int k = 0; k < 3; k++) bounds[k] = bounds[k + 3] = p[k];
    for (size_t i = 3; i < 3 * nv; i++) {
        if (p[i] < bounds[i % 3]) bounds[i % 3] = p[i];
        if (p[i] > bounds[i % 3 + 3]) bounds[i % 3 + 3] = p[i];
    }
}

static int measure_bounds(writing *x, vg_err *e)
{
    int r = VG_OK;
    if (!(x->bounds = vgi_array(x->targets + 1, sizeof *x->bounds, e))) return VG_ENOMEM;
    find_bounds(x->base, x->h->mesh.nv, x->bounds[0]);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        r = load(x, x->chosen[t], x->first, e);
        if (r == VG_OK) find_bounds(x->first, x->h->mesh.nv, x->bounds[t + 1]);
    }
    return r;
}

static int too_big(const writing *x, vg_err *e)
{
    return vg_fail(
        e, VG_EINPUT,
        "cannot write '%s': with %zu morph targets it would be larger than a GLB can be: use --max-targets",
        x->out->name, x->targets);
}

static int put_binary(writing *x, size_t bytes, vg_err *e)
{
    static const char blanks[4] = "   ";
    unsigned char head[VGI_GLTF_HEADER + VGI_GLTF_CHUNK] = "glTF", chunk[VGI_GLTF_CHUNK];
    int r = vgi_bytes_append(&x->json, blanks, (4 - x->json.size % 4) % 4, e);
    if (r < 0) return r;
    const uint64_t whole = sizeof head + x->json.size + sizeof chunk + (uint64_t)bytes;
    if (whole > UINT32_MAX) return too_big(x, e);
    vgi_put32(head + 4, 2);
    vgi_put32(head + 8, (uint32_t)whole);
    vgi_put32(head + 12, (uint32_t)x->json.size);
    vgi_put32(head + 16, VGI_GLTF_JSON);
    vgi_put32(chunk, (uint32_t)bytes);
    vgi_put32(chunk + 4, VGI_GLTF_BIN);
    r = vgi_output_put(x->out, head, sizeof head, e);
    if (r == VG_OK) r = vgi_output_put(x->out, x->json.data, x->json.size, e);
    if (r == VG_OK) r = vgi_output_put(x->out, chunk, sizeof chunk, e);
    return r < 0 ? r : emit_all(x, e);
}

static int put_text(writing *x, vg_err *e)
{
    char four[4];
    int r = vgi_output_put(x->out, x->json.data, x->json.size, e);
    if (r == VG_OK) r = emit_all(x, e);
    if (r == VG_OK && x->ncarry) {
        encode3(x->carry, x->ncarry, four);
        r = vgi_output_put(x->out, four, sizeof four, e);
    }
    return r < 0 ? r : vgi_output_put(x->out, "\"}]}\n", 5, e);
}

static void note_losses(writing *x)
{
    size_t n = 0;
    if (x->some_timed && !x->timed)
        n = (size_t)snprintf(x->warning, sizeof x->warning,
                             "the times of the frames: they do not ascend from 0 or later");
    if (x->targets < x->frames && x->error > 0) {
        const double d = vg_diagonal(x->h->reference, x->h->mesh.nv);
        snprintf(x->warning + n, sizeof x->warning - n,
                 "%severy frame: %zu are mixed from %zu morph targets, with vertices off by at "
                 "most %.3g%% of the diagonal (--max-targets)",
                 n ? "; " : "", x->frames, x->targets, d > 0 ? 100 * x->error / d : 0);
    }
}

int vgi_gltf_end(void *state, vg_err *e)
{
    writing *x = state;
    x->timed = times_fit(x);
    int r = vgi_output_flush(&x->spool, e);
    if (r == VG_OK) r = choose_targets(x, e);
    if (r == VG_OK) r = put_faces(x, e);
    if (r == VG_OK) r = measure_bounds(x, e);
    if (r < 0) return r;
    size_t bytes = 0;
    for (int i = 0; i < PARTS; i++) bytes += part_bytes(x, (enum part)i);
    r = say_all(x, bytes, e);
    if (r == VG_OK) r = x->binary ? put_binary(x, bytes, e) : put_text(x, e);
    note_losses(x);
    return r;
}

const char *vgi_gltf_warning(void *state)
{
    const writing *x = state;
    return *x->warning ? x->warning : NULL;
}

void vgi_gltf_release(void *state)
{
    writing *x = state;
    if (!x) return;
    if (x->spool.fd >= 0) close(x->spool.fd);
    vgi_output_clear(&x->spool);
    vgi_names_clear(&x->names);
    free(x->times.at);
    void *const arrays[] = {x->packed, x->base,  x->target_of, x->chosen, x->spans,
                            x->share,  x->first, x->second,    x->third,  x->bounds};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    vg_bytes_clear(&x->triangles);
    vg_bytes_clear(&x->lines);
    vg_bytes_clear(&x->runs);
    vg_bytes_clear(&x->json);
    free(x);
}
