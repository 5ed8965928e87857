/* gltf_morph.c: frames as morph targets of glTF, and an animation of their weights that plays them.
 * Leaves out the rest of the file (gltf_write.c).
 *
 * The frames wait as displacements from the reference pose. When there are more of them than targets are wanted,
 * some are chosen, one after another where the others are worst, and the others are mixed from two neighbours.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_write.h"

#include <math.h>
#include <stdlib.h>

enum { USUAL_TARGETS = 100 };

/* Frames from..to are mixed from these two; the worst of them, and by how much. */
typedef struct span {
    size_t from, to, worst;
    double error;
} span;

typedef struct morphs {
    size_t most;
    unsigned char *packed; /* a frame as it waits */
    float *first, *second, *third; /* frames at work */
    /* at the end: */
    size_t *target_of;     /* of each frame the target that comes at or before it */
    size_t *chosen, targets;
    span *spans;
    double *share;         /* of each frame: of the next target */
    double error;
    size_t weights;        /* number of their accessor */
    size_t points;         /* of the base; those of the targets follow */
} morphs;

static int begin(vgi_gltf_writing *w, const vg_sink_options *o, vg_err *e)
{
    const size_t nv = w->h->body.mesh.nv;
    morphs *x = w->own = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->most = o->most_targets ? o->most_targets : USUAL_TARGETS;
    x->packed = vgi_array_raw(nv, VGI_GLTF_POINT, e), x->first = vgi_array_raw(nv, VGI_GLTF_POINT, e);
    x->second = vgi_array_raw(nv, VGI_GLTF_POINT, e), x->third = vgi_array_raw(nv, VGI_GLTF_POINT, e);
    return x->packed && x->first && x->second && x->third ? VG_OK : VG_ENOMEM;
}

static int put(vgi_gltf_writing *w, const vg_frame *f, vg_err *e)
{
    morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    for (size_t i = 0; i < n; i++) {
        float d = (float)(f->values[i] - w->base[i]);
        if (!isfinite(d)) return vg_fail(e, VG_EINPUT, "a position is too large for binary32");
        vgi_gltf_put_single(x->packed + VGI_GLTF_ITEM * i, d);
    }
    return vgi_output_put(&w->spool, x->packed, VGI_GLTF_ITEM * n, e);
}

/* ---- which frames become targets ---- */

static int load(const vgi_gltf_writing *w, size_t frame, float *to, vg_err *e)
{
    const morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv, bytes = VGI_GLTF_ITEM * n;
    int r = vgi_gltf_load(w, (uint64_t)frame * bytes, x->packed, bytes, e);
    for (size_t i = 0; i < n && r == VG_OK; i++) to[i] = vgi_gltf_get_single(x->packed + VGI_GLTF_ITEM * i);
    return r;
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

static int measure_span(vgi_gltf_writing *w, span *s, vg_err *e)
{
    morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    int r = s->to > s->from + 1 ? load(w, s->from, x->first, e) : VG_OK;
    if (r == VG_OK && s->to > s->from + 1) r = load(w, s->to, x->second, e);
    s->error = 0, s->worst = s->from;
    for (size_t i = s->from + 1; i < s->to && r == VG_OK; i++) {
        if ((r = load(w, i, x->third, e)) < 0) break;
        x->share[i] = best_share(x->first, x->second, x->third, n);
        double error = mix_error(x->first, x->second, x->third, n, x->share[i]);
        if (error > s->error) s->error = error, s->worst = i;
    }
    return r;
}

static int split_spans(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    size_t n = 1;
    x->spans[0] = (span){.from = 0, .to = w->frames - 1};
    int r = measure_span(w, &x->spans[0], e);
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
        r = measure_span(w, s, e);
        if (r == VG_OK) r = measure_span(w, &x->spans[n++], e);
    }
    for (size_t i = 0; i < n; i++) x->target_of[x->spans[i].from] = 1;
    return r;
}

/* target_of first marks the chosen ones. */
static int choose_targets(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    int r = VG_OK;
    x->target_of = vgi_array(w->frames, sizeof *x->target_of, e);
    x->chosen = vgi_array(w->frames, sizeof *x->chosen, e);
    x->share = vgi_array(w->frames, sizeof *x->share, e);
    x->spans = vgi_array(x->most < w->frames ? x->most : 1, sizeof *x->spans, e);
    if (!x->target_of || !x->chosen || !x->share || !x->spans) return VG_ENOMEM;
    if (w->frames <= x->most) {
        for (size_t i = 0; i < w->frames; i++) x->target_of[i] = 1;
    } else {
        r = split_spans(w, e);
        x->target_of[w->frames - 1] = 1;
    }
    for (size_t i = 0; i < w->frames; i++) {
        if (x->target_of[i]) x->chosen[x->targets++] = i;
        x->target_of[i] = x->targets - 1;
    }
    return r;
}

/* ---- what is said ---- */

static int describe_points(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    const size_t nv = w->h->body.mesh.nv, bytes = VGI_GLTF_POINT * nv;
    double bounds[6];
    x->points = w->naccessors;
    int r = vgi_gltf_view(w, bytes * (x->targets + 1), ",\"target\":34962,\"byteStride\":12", e);
    for (size_t t = 0; t <= x->targets && r == VG_OK; t++) {
        if (t > 0 && (r = load(w, x->chosen[t - 1], x->first, e)) < 0) break;
        vgi_gltf_bounds(t ? x->first : w->base, nv, bounds);
        r = vgi_gltf_say_accessor(w, t * bytes, VGI_GLTF_FLOAT, nv, "VEC3", bounds, 3, e);
    }
    return r;
}

static int describe_weights(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    x->weights = w->naccessors;
    int r = vgi_gltf_view(w, VGI_GLTF_ITEM * w->frames * x->targets, "", e);
    return r < 0 ? r : vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, w->frames * x->targets, "SCALAR", NULL, 0, e);
}

static int say_primitives(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    vg_bytes moving = {0};
    int r = vgi_gltf_say(&moving, e, "\"attributes\":{\"POSITION\":%zu}", x->points);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++)
        r = vgi_gltf_say(&moving, e, "%s{\"POSITION\":%zu}", t ? "," : ",\"targets\":[", x->points + 1 + t);
    if (r == VG_OK) r = vgi_gltf_say(&moving, e, "]");
    if (r == VG_OK) r = vgi_gltf_say_primitives(w, &moving, e);
    vg_bytes_clear(&moving);
    return r;
}

static int say_mesh(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = vgi_gltf_say(&w->json, e, "\"meshes\":[{");
    if (r == VG_OK) r = vgi_gltf_say_mesh_name(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",");
    if (r == VG_OK) r = say_primitives(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\n\"weights\":[");
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) r = vgi_gltf_say(&w->json, e, "%s0", t ? "," : "");
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "],\n\"extras\":{");
    if (r == VG_OK) r = vgi_gltf_say_names(w, "targetNames", x->chosen, x->targets, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\n\"" VGI_GLTF_FACES "\":[");
    if (r == VG_OK) r = vgi_bytes_append(&w->json, w->shape.runs.data, w->shape.runs.size, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]}}],\n");
}

static int say_animation(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = vgi_gltf_say(&w->json, e,
                         "\"animations\":[{\"name\":\"sequence\",\"channels\":[{\"sampler\":0,"
                         "\"target\":{\"node\":0,\"path\":\"weights\"}}],"
                         "\"samplers\":[{\"input\":%zu,\"output\":%zu,\"interpolation\":\"LINEAR\"}],\n\"extras\":{",
                         w->moments, x->weights);
    if (r == VG_OK) r = vgi_gltf_say_names(w, VGI_GLTF_FRAMES, NULL, w->frames, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}}]");
}

static int describe(vgi_gltf_writing *w, vg_err *e)
{
    int r = choose_targets(w, e);
    if (r == VG_OK) r = describe_weights(w, e);
    if (r == VG_OK) r = describe_points(w, e);
    if (r == VG_OK)
        r = vgi_gltf_say(&w->json, e, "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\n");
    if (r == VG_OK) r = say_mesh(w, e);
    return r < 0 ? r : say_animation(w, e);
}

/* ---- bytes ---- */

static int emit_weights(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < w->frames && r == VG_OK; i++)
        for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
            double s = x->share[i];
            float weight = (float)(t == x->target_of[i] ? 1 - s : t == x->target_of[i] + 1 ? s : 0);
            r = vgi_gltf_emit_singles(w, &weight, 1, e);
        }
    return r;
}

static int emit(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    int r = emit_weights(w, e);
    if (r == VG_OK) r = vgi_gltf_emit_singles(w, w->base, n, e);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        r = load(w, x->chosen[t], x->first, e);
        if (r == VG_OK) r = vgi_gltf_emit_singles(w, x->first, n, e);
    }
    return r;
}

static void warning(const vgi_gltf_writing *w, char *to, size_t room)
{
    const morphs *x = w->own;
    const double d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    if (x->targets < w->frames && x->error > 0)
        snprintf(to, room,
                 "every frame: %zu are mixed from %zu morph targets, with vertices off by at "
                 "most %.3g%% of the diagonal (--max-targets)",
                 w->frames, x->targets, d > 0 ? 100 * x->error / d : 0);
}

static void release(void *own)
{
    morphs *x = own;
    if (!x) return;
    void *const arrays[] = {x->packed, x->target_of, x->chosen, x->spans, x->share, x->first, x->second, x->third};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    free(x);
}

const vgi_gltf_manner vgi_gltf_morphs = {begin, put, describe, emit, warning, release, "use --max-targets"};
