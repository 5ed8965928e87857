/* gltf_morph.c: frames as morph targets of glTF, and an animation of their weights that plays them; or shapes without one.
 * Leaves out the rest of the file (gltf_write.c), and how few targets serve many frames (gltf_basis.c).
 *
 * The frames wait as displacements from the reference pose. Up to 100 of them are targets as they are, so that shapes stay
 * what they were; more are met by a basis.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_basis.h"
#include "io/gltf_write.h"

#include <math.h>
#include <stdlib.h>

enum { USUAL_TARGETS = 100, USUAL_PER_MILLE = 1, SPARSE_WORDS = 160 }; /* SPARSE_WORDS: bytes of JSON for a sparse one */

/* A target as it lies in the file. */
typedef struct lying {
    size_t moved;      /* vertices that it moves */
    bool sparse;       /* only these are there */
    double bounds[6];
} lying;

typedef struct morphs {
    size_t most;
    double tolerance;      /* in D */
    bool asked, shapes;    /* asked: for a tolerance */
    unsigned char *packed; /* a frame as it waits */
    float *first;          /* a frame at work */
    /* at the end: */
    size_t *chosen, targets; /* chosen: the frames that are targets; NULL: the targets are those of the basis */
    vgi_gltf_basis basis;
    lying *at;
    size_t weights;        /* number of their accessor */
    size_t points;         /* of the base; those of the targets follow */
} morphs;

static int begin(vgi_gltf_writing *w, const vg_sink_options *o, vg_err *e)
{
    const size_t nv = w->seams.n;
    morphs *x = w->own = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    w->still = x->shapes = o->shapes;
    x->most = o->most_targets;
    x->asked = o->morph_tolerance > 0, x->tolerance = x->asked ? o->morph_tolerance : USUAL_PER_MILLE / 1000.0;
    x->packed = vgi_array_raw(nv, VGI_GLTF_POINT, e), x->first = vgi_array_raw(nv, VGI_GLTF_POINT, e);
    return x->packed && x->first ? VG_OK : VG_ENOMEM;
}

static int put(vgi_gltf_writing *w, const vg_frame *f, vg_err *e)
{
    morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    for (size_t i = 0; i < n; i++) {
        float d = (float)(f->values[i] - w->base[i]);
        if ((float)f->values[i] == w->base[i]) d = 0; /* no nearer with what binary32 has lost */
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

static int load_for_basis(void *context, size_t frame, float *to, vg_err *e)
{
    return load(context, frame, to, e);
}

static bool moves_nothing(const float *d, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (d[i] != 0) return false;
    return true;
}

/* Every frame; of shapes not the first one when it is the base itself. */
static int take_frames(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    if (!(x->chosen = vgi_array(w->frames, sizeof *x->chosen, e))) return VG_ENOMEM;
    int r = load(w, 0, x->first, e);
    const bool skip = r == VG_OK && x->shapes && moves_nothing(x->first, 3 * w->h->body.mesh.nv);
    for (size_t i = skip; i < w->frames && r == VG_OK; i++) x->chosen[x->targets++] = i;
    return r;
}

static int choose_targets(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    const size_t most = x->most ? x->most : USUAL_TARGETS, nv = w->h->body.mesh.nv;
    if (x->shapes || (w->frames <= most && !x->asked)) return take_frames(w, e);
    const vgi_gltf_frames_in in = {w->frames, nv, load_for_basis, w};
    int r = vgi_gltf_basis_make(&x->basis, &in, x->most ? x->most : w->frames,
                                x->tolerance * vg_diagonal(w->h->body.reference, nv), e);
    x->targets = x->basis.n;
    return r;
}

/* Of all vertices of the file. */
static int load_target(vgi_gltf_writing *w, size_t t, vg_err *e)
{
    morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    int r = x->chosen ? load(w, x->chosen[t], x->first, e) : VG_OK;
    if (!x->chosen) memcpy(x->first, x->basis.targets + t * n, n * sizeof *x->first);
    for (size_t v = w->seams.nv; v < w->seams.n && r == VG_OK; v++)
        memcpy(x->first + 3 * v, x->first + 3 * (size_t)w->seams.from[v], VGI_GLTF_POINT);
    return r;
}

/* ---- how targets lie in the file ---- */

static bool moves(const float *d, size_t v)
{
    return d[3 * v] != 0 || d[3 * v + 1] != 0 || d[3 * v + 2] != 0;
}

static size_t index_bytes(const vgi_gltf_writing *w)
{
    return w->seams.n <= 65536 ? 2 : 4;
}

/* Of the indices of n vertices, filled up to whole numbers of 4. */
static size_t indices_size(const vgi_gltf_writing *w, size_t n)
{
    return (n * index_bytes(w) + 3) / 4 * 4;
}

static int look_at_targets(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    const size_t nv = w->seams.n;
    int r = (x->at = vgi_array(x->targets, sizeof *x->at, e)) ? VG_OK : VG_ENOMEM;
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        lying *l = &x->at[t];
        if ((r = load_target(w, t, e)) < 0) break;
        for (size_t v = 0; v < nv; v++) l->moved += moves(x->first, v);
        if (!l->moved) l->moved = 1; /* there must be one: the first vertex */
        l->sparse = indices_size(w, l->moved) + VGI_GLTF_POINT * l->moved + SPARSE_WORDS < VGI_GLTF_POINT * nv;
        vgi_gltf_bounds(x->first, nv, l->bounds);
    }
    return r;
}

/* ---- what is said ---- */

static int say_sparse(vgi_gltf_writing *w, const lying *l, size_t view, size_t indices, size_t values, vg_err *e)
{
    int r = vgi_gltf_say(&w->accessors, e,
                         ",\n{\"componentType\":%d,\"count\":%zu,\"type\":\"VEC3\",\"sparse\":{\"count\":%zu,"
                         "\"indices\":{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d},"
                         "\"values\":{\"bufferView\":%zu,\"byteOffset\":%zu}}",
                         VGI_GLTF_FLOAT, w->seams.n, l->moved, view, indices,
                         index_bytes(w) == 2 ? VGI_GLTF_USHORT : VGI_GLTF_UINT, view + 1, values);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"min\":[", l->bounds, 3, "]", e);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"max\":[", l->bounds + 3, 3, "]}", e);
    w->naccessors++;
    return r;
}

/* The base and the targets that are there whole are one view; indices and values of the others two more. */
static int describe_points(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    const size_t nv = w->seams.n, bytes = VGI_GLTF_POINT * nv;
    size_t whole = 1, indices = 0, values = 0;
    double bounds[6];
    for (size_t t = 0; t < x->targets; t++) whole += !x->at[t].sparse;
    x->points = w->naccessors;
    int r = vgi_gltf_view(w, bytes * whole, ",\"target\":34962,\"byteStride\":12", e);
    vgi_gltf_bounds(w->base, nv, bounds);
    if (r == VG_OK) r = vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, nv, "VEC3", bounds, 3, e);
    whole = 1;
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        const lying *l = &x->at[t];
        if (!l->sparse) {
            r = vgi_gltf_say_accessor(w, bytes * whole++, VGI_GLTF_FLOAT, nv, "VEC3", l->bounds, 3, e);
            continue;
        }
        r = say_sparse(w, l, w->nviews, indices, values, e);
        indices += indices_size(w, l->moved), values += VGI_GLTF_POINT * l->moved;
    }
    if (r == VG_OK && indices) r = vgi_gltf_view(w, indices, "", e);
    return r == VG_OK && indices ? vgi_gltf_view(w, values, "", e) : r;
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
    int r = vgi_gltf_say(&moving, e, "\"attributes\":{\"POSITION\":%zu", x->points);
    if (r == VG_OK && w->seams.uv) r = vgi_gltf_say(&moving, e, ",\"TEXCOORD_0\":%zu", w->texture);
    if (r == VG_OK) r = vgi_gltf_say(&moving, e, "}");
    for (size_t t = 0; t < x->targets && r == VG_OK; t++)
        r = vgi_gltf_say(&moving, e, "%s{\"POSITION\":%zu}", t ? "," : ",\"targets\":[", x->points + 1 + t);
    if (r == VG_OK && x->targets) r = vgi_gltf_say(&moving, e, "]");
    if (r == VG_OK) r = vgi_gltf_say_primitives(w, &moving, e);
    vg_bytes_clear(&moving);
    return r;
}

/* Frames that are targets have names; what a basis is made of has numbers. */
static int say_target_names(vgi_gltf_writing *w, vg_err *e)
{
    static const char key[] = "targetNames";
    const morphs *x = w->own;
    if (x->chosen) return vgi_gltf_say_names(w, key, x->chosen, x->targets, e);
    int r = vgi_gltf_say(&w->json, e, "\"%s\":[", key);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++)
        r = vgi_gltf_say(&w->json, e, "%s\"basis %zu\"", t ? "," : "", t + 1);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]");
}

/* Which vertices the copies are of, so that our own reader can put them together again. */
static int say_seams(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_seams *s = &w->seams;
    if (s->n == s->nv) return VG_OK;
    int r = vgi_gltf_say(&w->json, e, ",\n\"" VGI_GLTF_VERTICES "\":[%zu", s->nv);
    for (size_t v = s->nv; v < s->n && r == VG_OK; v++) r = vgi_gltf_say(&w->json, e, ",%u", s->from[v]);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]");
}

static int say_mesh(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = vgi_gltf_say(&w->json, e, "\"meshes\":[{");
    if (r == VG_OK) r = vgi_gltf_say_mesh_name(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",");
    if (r == VG_OK) r = say_primitives(w, e);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++)
        r = vgi_gltf_say(&w->json, e, "%s0", t ? "," : ",\n\"weights\":[");
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "%s,\n\"extras\":{", x->targets ? "]" : "");
    if (r == VG_OK) r = say_target_names(w, e);
    if (r == VG_OK) r = say_seams(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\n\"" VGI_GLTF_FACES "\":[");
    if (r == VG_OK) r = vgi_bytes_append(&w->json, w->shape.runs.data, w->shape.runs.size, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]}}]");
}

static int say_animation(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = vgi_gltf_say(&w->json, e, ",\n\"animations\":[{\"name\":");
    if (r == VG_OK) r = vgi_gltf_say_clip_name(w, e);
    if (r == VG_OK)
        r = vgi_gltf_say(&w->json, e,
                         ",\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"weights\"}}],"
                         "\"samplers\":[{\"input\":%zu,\"output\":%zu,\"interpolation\":\"LINEAR\"}],\n\"extras\":{",
                         w->moments, x->weights);
    if (r == VG_OK) r = vgi_gltf_say_names(w, VGI_GLTF_FRAMES, NULL, w->frames, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}}]");
}

static int describe(vgi_gltf_writing *w, vg_err *e)
{
    int r = choose_targets(w, e);
    if (r == VG_OK) r = look_at_targets(w, e);
    if (r == VG_OK && !w->still) r = describe_weights(w, e);
    if (r == VG_OK) r = describe_points(w, e);
    if (r == VG_OK)
        r = vgi_gltf_say(&w->json, e, "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\n");
    if (r == VG_OK) r = say_mesh(w, e);
    return r < 0 || w->still ? r : say_animation(w, e);
}

/* ---- bytes ---- */

static int emit_weights(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = VG_OK;
    if (!x->chosen) return vgi_gltf_emit_singles(w, x->basis.weights, w->frames * x->targets, e);
    for (size_t i = 0; i < w->frames && r == VG_OK; i++)
        for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
            const float weight = x->chosen[t] == i;
            r = vgi_gltf_emit_singles(w, &weight, 1, e);
        }
    return r;
}

static int emit_indices(vgi_gltf_writing *w, const lying *l, vg_err *e)
{
    const morphs *x = w->own;
    const size_t nv = w->seams.n, step = index_bytes(w);
    unsigned char *p = x->packed, *start = p;
    for (size_t v = 0; v < nv; v++) {
        if (!moves(x->first, v)) continue;
        p[0] = (unsigned char)v, p[1] = (unsigned char)(v >> 8);
        if (step == 4) p[2] = (unsigned char)(v >> 16), p[3] = (unsigned char)(v >> 24);
        p += step;
    }
    if (p == start) memset(p, 0, step), p += step;
    const size_t size = indices_size(w, l->moved);
    memset(p, 0, size - (size_t)(p - start));
    return vgi_gltf_emit(w, start, size, e);
}

static int emit_values(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    const size_t nv = w->seams.n;
    int r = VG_OK;
    size_t n = 0;
    for (size_t v = 0; v < nv && r == VG_OK; v++)
        if (moves(x->first, v)) r = vgi_gltf_emit_singles(w, x->first + 3 * v, 3, e), n++;
    return r == VG_OK && !n ? vgi_gltf_emit_singles(w, x->first, 3, e) : r;
}

/* First those that are whole, then the indices of the others, then their values. */
static int emit_targets(vgi_gltf_writing *w, int round, vg_err *e)
{
    const morphs *x = w->own;
    int r = VG_OK;
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        const lying *l = &x->at[t];
        if (l->sparse != (round > 0) || (r = load_target(w, t, e)) < 0) continue;
        if (round == 0) r = vgi_gltf_emit_singles(w, x->first, 3 * w->seams.n, e);
        else r = round == 1 ? emit_indices(w, l, e) : emit_values(w, e);
    }
    return r;
}

static int emit(vgi_gltf_writing *w, vg_err *e)
{
    int r = w->still ? VG_OK : emit_weights(w, e);
    if (r == VG_OK) r = vgi_gltf_emit_singles(w, w->base, 3 * w->seams.n, e);
    for (int round = 0; round < 3 && r == VG_OK; round++) r = emit_targets(w, round, e);
    return r;
}

static void warning(const vgi_gltf_writing *w, char *to, size_t room)
{
    const morphs *x = w->own;
    const double d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    if (!x->chosen && x->basis.error > x->tolerance * d)
        snprintf(to, room,
                 "every frame: %zu are mixed from %zu morph targets, with vertices off by at "
                 "most %.3g%% of the diagonal (--max-targets)",
                 w->frames, x->targets, d > 0 ? 100 * x->basis.error / d : 0);
}

static void release(void *own)
{
    morphs *x = own;
    if (!x) return;
    vgi_gltf_basis_clear(&x->basis);
    void *const arrays[] = {x->packed, x->chosen, x->at, x->first};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    free(x);
}

const vgi_gltf_manner vgi_gltf_morphs = {begin, put, describe, emit, warning, release, "use --max-targets"};
