/* gltf_morph.c: frames as morph targets of glTF, with an animation of their weights; or shapes without an animation.
 * The rest of the file is in gltf_write.c; gltf_basis.c finds few targets for many frames.
 *
 * Frames are stored as displacements from the reference pose. Up to 100 of them become targets unchanged; more are
 * represented by a basis.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_basis.h"
#include "io/gltf_write.h"
#include "numeric/lapack.h"

#include <math.h>
#include <stdlib.h>

enum { USUAL_TARGETS = 100, USUAL_PER_MILLE = 1, SPARSE_WORDS = 160 }; /* SPARSE_WORDS: bytes of JSON for a sparse one */

/* Layout in the file of the positions or normals of a target, for one list of vertices. */
typedef struct lying {
    size_t moved;      /* number of vertices that it moves */
    bool sparse;       /* only these are stored */
    double bounds[6];
    size_t accessor;
} lying;

enum { POSITIONS, NORMALS, SORTS };

typedef struct morphs {
    size_t most;
    double tolerance;      /* in D */
    bool asked, shapes;    /* asked: for a tolerance */
    unsigned char *packed; /* a frame in stored form */
    float *first;          /* workspace of one frame */
    /* known at the end: */
    size_t *chosen, targets; /* chosen: the frames that become targets; NULL: the targets are a basis */
    vgi_gltf_basis basis;
    size_t n, nlists;      /* vertices of the file */
    vgi_gltf_list *lists;
    bool based;            /* the base is that of the character's file */
    const float *base[SORTS];
    float *file[SORTS];    /* of one target, over all vertices of the file */
    double *world;         /* a pose of the mesh */
    float *turned;         /* for a basis, the normals of all targets */
    lying *at;             /* targets x nlists x SORTS */
    size_t weights;        /* number of their accessor */
} morphs;

static int begin(vgi_gltf_writing *w, const vg_sink_options *o, vg_err *e)
{
    const size_t nv = w->h->body.mesh.nv;
    morphs *x = w->own = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    w->still = x->shapes = o->shapes;
    x->most = o->most_targets;
    x->asked = o->morph_tolerance > 0, x->tolerance = x->asked ? o->morph_tolerance : USUAL_PER_MILLE / 1000.0;
    x->packed = vgi_array_raw(nv, VGI_GLTF_POINT, e), x->first = vgi_array_raw(nv, VGI_GLTF_POINT, e);
    return x->packed && x->first ? VG_OK : VG_ENOMEM;
}

/* A single frame that is the base itself needs no target and no animation. */
static int put(vgi_gltf_writing *w, const vg_frame *f, vg_err *e)
{
    morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    bool moves = false;
    for (size_t i = 0; i < n; i++) {
        float d = (float)(f->values[i] - w->base[i]);
        if ((float)f->values[i] == w->base[i]) d = 0; /* binary32 cannot be nearer */
        if (!isfinite(d)) return vg_fail(e, VG_EINPUT, "a position is too large for binary32");
        vgi_gltf_put_single(x->packed + VGI_GLTF_ITEM * i, d);
        moves |= d != 0;
    }
    w->still = x->shapes || (w->frames == 0 && !moves && !f->has_time);
    return vgi_output_put(&w->spool, x->packed, VGI_GLTF_ITEM * n, e);
}

/* ---- choice of target frames ---- */

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

/* Every frame; for shapes, without the first one if it equals the base. */
static int take_frames(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    if (!(x->chosen = vgi_array(w->frames, sizeof *x->chosen, e))) return VG_ENOMEM;
    int r = load(w, 0, x->first, e);
    const bool skip = r == VG_OK && w->still && moves_nothing(x->first, 3 * w->h->body.mesh.nv);
    for (size_t i = skip; i < w->frames && r == VG_OK; i++) x->chosen[x->targets++] = i;
    return r;
}

static int choose_targets(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    const size_t most = x->most ? x->most : USUAL_TARGETS, nv = w->h->body.mesh.nv;
    if (w->still || (w->frames <= most && !x->asked)) return take_frames(w, e);
    const vgi_gltf_frames_in in = {w->frames, nv, load_for_basis, w};
    int r = vgi_gltf_basis_make(&x->basis, &in, x->most ? x->most : w->frames,
                                x->tolerance * vg_diagonal(w->h->body.reference, nv), e);
    x->targets = x->basis.n;
    return r;
}

/* ---- vertices of the file ---- */

static int list_plain(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    if (!(x->lists = vgi_array(1, sizeof *x->lists, e))) return VG_ENOMEM;
    x->nlists = 1, x->n = w->seams.n, x->base[POSITIONS] = w->base;
    x->lists[0] = (vgi_gltf_list){.count = x->n};
    if (!w->normals.n) return VG_OK;
    x->lists[0].normals = true, x->base[NORMALS] = w->normals.base;
    x->file[NORMALS] = vgi_array(x->n, VGI_GLTF_POINT, e);
    x->world = vgi_array(w->h->body.mesh.nv, 3 * sizeof *x->world, e);
    return x->file[NORMALS] && x->world ? VG_OK : VG_ENOMEM;
}

static int list_parts(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    const vgi_gltf_character *c = w->character;
    if (!(x->lists = vgi_array(c->scene.nparts, sizeof *x->lists, e))) return VG_ENOMEM;
    x->nlists = c->scene.nparts, x->n = c->n, x->based = c->kept;
    x->base[POSITIONS] = c->base, x->base[NORMALS] = c->normal;
    for (size_t i = 0; i < x->nlists; i++) {
        const vgi_gltf_part *p = &c->scene.parts[i];
        vgi_gltf_list *l = &x->lists[i];
        uint64_t position = 0, normal = 0;
        vgi_json_whole(vgi_json_get(p->attributes, "POSITION"), &position);
        l->normals = c->normal && vgi_json_whole(vgi_json_get(p->attributes, "NORMAL"), &normal);
        l->first = p->first, l->count = p->count, l->position = (size_t)position, l->normal = (size_t)normal;
    }
    if (c->normal && !(x->file[NORMALS] = vgi_array(x->n, VGI_GLTF_POINT, e))) return VG_ENOMEM;
    return (x->world = vgi_array(c->nv, 3 * sizeof *x->world, e)) ? VG_OK : VG_ENOMEM;
}

static int list_vertices(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    int r = w->character ? list_parts(w, e) : list_plain(w, e);
    if (r == VG_OK && !(x->file[POSITIONS] = vgi_array_raw(x->n, VGI_GLTF_POINT, e))) r = VG_ENOMEM;
    free(x->packed);
    const size_t nv = w->h->body.mesh.nv;
    return r == VG_OK && (x->packed = vgi_array_raw(x->n > nv ? x->n : nv, VGI_GLTF_POINT, e)) ? VG_OK : VG_ENOMEM;
}

/* The whole pose of some displacements. */
static void find_world(const vgi_gltf_writing *w, const float *moved)
{
    const morphs *x = w->own;
    const double *reference = w->h->body.reference;
    for (size_t i = 0; i < 3 * w->h->body.mesh.nv; i++)
        x->world[i] = moved[i] == 0 ? reference[i] : (double)w->base[i] + moved[i];
}

static void spread_plain(const vgi_gltf_writing *w)
{
    const morphs *x = w->own;
    float *to = x->file[POSITIONS];
    memcpy(to, x->first, VGI_GLTF_POINT * w->seams.nv);
    for (size_t v = w->seams.nv; v < x->n; v++)
        memcpy(to + 3 * v, x->first + 3 * (size_t)w->seams.from[v], VGI_GLTF_POINT);
}

/* The normals of x->world. */
static void turn_normals(vgi_gltf_writing *w)
{
    morphs *x = w->own;
    if (!x->file[NORMALS]) return;
    if (w->character) vgi_gltf_character_turn(w->character, x->world, x->file[NORMALS]);
    else vgi_gltf_normals_turn(&w->normals, x->world, x->file[NORMALS]);
}

static void spread_frame(vgi_gltf_writing *w)
{
    morphs *x = w->own;
    if (x->world) find_world(w, x->first);
    if (w->character) vgi_gltf_character_pose(w->character, x->world, x->first, x->file[POSITIONS]);
    else spread_plain(w);
    turn_normals(w);
}

static void spread_basis(vgi_gltf_writing *w, size_t t)
{
    morphs *x = w->own;
    if (w->character) vgi_gltf_character_move(w->character, x->first, x->file[POSITIONS]);
    else spread_plain(w);
    if (x->file[NORMALS]) memcpy(x->file[NORMALS], x->turned + t * 3 * x->n, VGI_GLTF_POINT * x->n);
}

/* ---- normals of a basis: mixed with the weights of the positions, they are nearest to the normals of all frames ---- */

/* solved: targets x frames: weights of the least-squares solution. */
static int solve_weights(const morphs *x, size_t frames, double **solved, vg_err *e)
{
    const size_t n = x->targets;
    const float *weights = x->basis.weights;
    double *gram = vgi_array(n, n * sizeof *gram, e), *to = vgi_array(n, frames * sizeof *to, e), trace = 0;
    int r = gram && to ? VG_OK : VG_ENOMEM;
    for (size_t f = 0; f < frames && r == VG_OK; f++)
        for (size_t s = 0; s < n; s++) {
            const double a = weights[f * n + s];
            to[s * frames + f] = a;
            for (size_t t = 0; t <= s; t++) gram[s * n + t] += a * weights[f * n + t];
        }
    for (size_t s = 0; s < n && r == VG_OK; s++) trace += gram[s * n + s];
    for (size_t s = 0; s < n && r == VG_OK; s++) gram[s * n + s] += 1e-12 * trace;
    if (r == VG_OK && n && !vgi_spd_factor(n, gram)) r = vg_fail(e, VG_EINPUT, "the frames cannot be mixed");
    if (r == VG_OK) vgi_spd_solve(n, gram, frames, to);
    free(gram);
    if (r < 0) free(to);
    else *solved = to;
    return r;
}

static int turn_basis(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    double *solved = NULL;
    if (x->chosen || !x->file[NORMALS]) return VG_OK;
    x->turned = vgi_array(x->targets, 3 * sizeof *x->turned * x->n, e);
    int r = x->turned ? solve_weights(x, w->frames, &solved, e) : VG_ENOMEM;
    for (size_t f = 0; f < w->frames && r == VG_OK; f++) {
        if ((r = load(w, f, x->first, e)) < 0) break;
        find_world(w, x->first);
        turn_normals(w);
        for (size_t t = 0; t < x->targets; t++) {
            const float share = (float)solved[t * w->frames + f];
            float *to = x->turned + t * 3 * x->n;
            for (size_t i = 0; i < 3 * x->n; i++) to[i] += share * x->file[NORMALS][i];
        }
    }
    free(solved);
    return r;
}

/* For all vertices of the file. */
static int load_target(vgi_gltf_writing *w, size_t t, vg_err *e)
{
    morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    int r = x->chosen ? load(w, x->chosen[t], x->first, e) : VG_OK;
    if (!x->chosen) memcpy(x->first, x->basis.targets + t * n, n * sizeof *x->first);
    if (r < 0) return r;
    if (x->chosen) spread_frame(w);
    else spread_basis(w, t);
    return VG_OK;
}

/* ---- layout of targets in the file ---- */

static lying *lying_of(const morphs *x, size_t t, size_t l, int sort)
{
    return &x->at[(t * x->nlists + l) * SORTS + (size_t)sort];
}

static int sorts_of(const vgi_gltf_list *l)
{
    return l->normals ? SORTS : NORMALS;
}

static bool moves(const float *d, size_t v)
{
    return d[3 * v] != 0 || d[3 * v + 1] != 0 || d[3 * v + 2] != 0;
}

static size_t index_bytes(const vgi_gltf_list *list)
{
    return list->count <= 65536 ? 2 : 4;
}

/* Size of the indices of n vertices, padded to a multiple of 4. */
static size_t indices_size(const vgi_gltf_list *list, size_t n)
{
    return (n * index_bytes(list) + 3) / 4 * 4;
}

static void look_at(lying *l, const vgi_gltf_list *list, const float *d)
{
    const size_t n = list->count;
    for (size_t v = 0; v < n; v++) l->moved += moves(d, v);
    if (!l->moved) l->moved = 1; /* at least one is required: the first vertex */
    l->sparse = indices_size(list, l->moved) + VGI_GLTF_POINT * l->moved + SPARSE_WORDS < VGI_GLTF_POINT * n;
    vgi_gltf_bounds(d, n, l->bounds);
}

static int look_at_targets(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    int r = (x->at = vgi_array(x->targets, x->nlists * SORTS * sizeof *x->at, e)) ? VG_OK : VG_ENOMEM;
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        if ((r = load_target(w, t, e)) < 0) break;
        for (size_t l = 0; l < x->nlists; l++)
            for (int s = 0; s < sorts_of(&x->lists[l]); s++)
                look_at(lying_of(x, t, l, s), &x->lists[l], x->file[s] + 3 * x->lists[l].first);
    }
    return r;
}

/* ---- JSON ---- */

static int say_sparse(vgi_gltf_writing *w, const vgi_gltf_list *list, const lying *l, size_t view, size_t indices,
                      size_t values, vg_err *e)
{
    int r = vgi_gltf_say(&w->accessors, e,
                         ",\n{\"componentType\":%d,\"count\":%zu,\"type\":\"VEC3\",\"sparse\":{\"count\":%zu,"
                         "\"indices\":{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d},"
                         "\"values\":{\"bufferView\":%zu,\"byteOffset\":%zu}}",
                         VGI_GLTF_FLOAT, list->count, l->moved, view, indices,
                         index_bytes(list) == 2 ? VGI_GLTF_USHORT : VGI_GLTF_UINT, view + 1, values);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"min\":[", l->bounds, 3, "]", e);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"max\":[", l->bounds + 3, 3, "]}", e);
    w->naccessors++;
    return r;
}

/* Start of the next accessors in the views of points, of indices and of values. */
typedef struct places {
    size_t view, points, indices, values;
} places;

static int describe_whole(vgi_gltf_writing *w, places *at, const vgi_gltf_list *list, const double bounds[6], vg_err *e)
{
    int r = vgi_gltf_say_accessor(w, at->points, VGI_GLTF_FLOAT, list->count, "VEC3", bounds, 3, e);
    at->points += VGI_GLTF_POINT * list->count;
    return r;
}

static int describe_base(vgi_gltf_writing *w, places *at, vg_err *e)
{
    morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK && !x->based; i++) {
        vgi_gltf_list *l = &x->lists[i];
        for (int s = 0; s < sorts_of(l) && r == VG_OK; s++) {
            double bounds[6];
            vgi_gltf_bounds(x->base[s] + 3 * l->first, l->count, bounds);
            *(s == NORMALS ? &l->normal : &l->position) = w->naccessors;
            r = describe_whole(w, at, l, bounds, e);
        }
    }
    return r;
}

static int describe_target(vgi_gltf_writing *w, places *at, size_t t, vg_err *e)
{
    morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]) && r == VG_OK; s++) {
            lying *l = lying_of(x, t, i, s);
            l->accessor = w->naccessors;
            if (!l->sparse) {
                r = describe_whole(w, at, &x->lists[i], l->bounds, e);
                continue;
            }
            r = say_sparse(w, &x->lists[i], l, at->view, at->indices, at->values, e);
            at->indices += indices_size(&x->lists[i], l->moved), at->values += VGI_GLTF_POINT * l->moved;
        }
    return r;
}

static size_t whole_bytes(const morphs *x)
{
    size_t bytes = 0;
    for (size_t i = 0; i < x->nlists; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]); s++) {
            if (!x->based) bytes += VGI_GLTF_POINT * x->lists[i].count;
            for (size_t t = 0; t < x->targets; t++)
                if (!lying_of(x, t, i, s)->sparse) bytes += VGI_GLTF_POINT * x->lists[i].count;
        }
    return bytes;
}

/* The base and the complete targets are one view; indices and values of the sparse ones two more. */
static int describe_points(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    const size_t whole = whole_bytes(x);
    int r = whole ? vgi_gltf_view(w, whole, ",\"target\":34962,\"byteStride\":12", e) : VG_OK;
    places at = {.view = w->nviews};
    if (r == VG_OK) r = describe_base(w, &at, e);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) r = describe_target(w, &at, t, e);
    if (r == VG_OK && at.indices) r = vgi_gltf_view(w, at.indices, "", e);
    return r == VG_OK && at.indices ? vgi_gltf_view(w, at.values, "", e) : r;
}

static int describe_weights(vgi_gltf_writing *w, vg_err *e)
{
    morphs *x = w->own;
    x->weights = w->naccessors;
    int r = vgi_gltf_view(w, VGI_GLTF_ITEM * w->frames * x->targets, "", e);
    for (size_t i = 0; i < w->ntakes && r == VG_OK; i++) {
        const vgi_gltf_take *t = &w->takes[i];
        r = vgi_gltf_say_accessor(w, VGI_GLTF_ITEM * t->first * x->targets, VGI_GLTF_FLOAT, t->count * x->targets, "SCALAR",
                                  NULL, 0, e);
    }
    return r;
}

static int say_primitives(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    vg_bytes moving = {0};
    int r = vgi_gltf_say(&moving, e, "\"attributes\":{\"POSITION\":%zu", x->lists[0].position);
    if (r == VG_OK && w->normals.n) r = vgi_gltf_say(&moving, e, ",\"NORMAL\":%zu", x->lists[0].normal);
    if (r == VG_OK && w->seams.uv) r = vgi_gltf_say(&moving, e, ",\"TEXCOORD_0\":%zu", w->texture);
    if (r == VG_OK) r = vgi_gltf_say(&moving, e, "}");
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        r = vgi_gltf_say(&moving, e, "%s{\"POSITION\":%zu", t ? "," : ",\"targets\":[",
                         lying_of(x, t, 0, POSITIONS)->accessor);
        if (r == VG_OK && w->normals.n)
            r = vgi_gltf_say(&moving, e, ",\"NORMAL\":%zu", lying_of(x, t, 0, NORMALS)->accessor);
        if (r == VG_OK) r = vgi_gltf_say(&moving, e, "}");
    }
    if (r == VG_OK && x->targets) r = vgi_gltf_say(&moving, e, "]");
    if (r == VG_OK) r = vgi_gltf_say_primitives(w, &moving, e);
    vg_bytes_clear(&moving);
    return r;
}

/* Targets that are frames have names; those of a basis have numbers. */
static int name_targets(const vgi_gltf_writing *w, vgi_json **names, vg_err *e)
{
    const morphs *x = w->own;
    int r = (*names = vgi_json_array(e)) ? VG_OK : VG_ENOMEM;
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        char number[32];
        snprintf(number, sizeof number, "basis %zu", t + 1);
        r = vgi_json_add(*names, vgi_json_of_text(x->chosen ? w->names.at[x->chosen[t]] : number, e), e);
    }
    return r;
}

static int say_target_names(vgi_gltf_writing *w, vg_err *e)
{
    vgi_json *names = NULL;
    int r = name_targets(w, &names, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "\"targetNames\":");
    if (r == VG_OK) r = vgi_json_print(names, &w->json, e);
    vgi_json_free(&names);
    return r;
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
    if (r == VG_OK) r = vgi_gltf_say_seams(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\n\"" VGI_GLTF_FACES "\":[");
    if (r == VG_OK) r = vgi_bytes_append(&w->json, w->shape.runs.data, w->shape.runs.size, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]}}]");
}

/* All meshes of a character use the same weights. */
static int say_channels(vgi_gltf_writing *w, vg_err *e)
{
    static const char channel[] = "%s{\"sampler\":0,\"target\":{\"node\":%zu,\"path\":\"weights\"}}";
    if (!w->character) return vgi_gltf_say(&w->json, e, channel, "", (size_t)0);
    const vgi_gltf_scene *s = &w->character->scene;
    int r = VG_OK;
    for (size_t i = 0, n = 0; i < s->nparts && r == VG_OK; i++)
        if (i == 0 || s->parts[i].node != s->parts[i - 1].node)
            r = vgi_gltf_say(&w->json, e, channel, n++ ? "," : "", s->parts[i].node);
    return r;
}

static int say_take(vgi_gltf_writing *w, size_t number, vg_err *e)
{
    const morphs *x = w->own;
    const vgi_gltf_take *t = &w->takes[number];
    int r = vgi_gltf_say(&w->json, e, "%s{\"name\":", number ? ",\n" : "");
    if (r == VG_OK) r = vgi_gltf_say_take_name(w, t, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\"channels\":[");
    if (r == VG_OK) r = say_channels(w, e);
    if (r == VG_OK)
        r = vgi_gltf_say(&w->json, e,
                         "],\"samplers\":[{\"input\":%zu,\"output\":%zu,\"interpolation\":\"LINEAR\"}],\n\"extras\":{",
                         t->moments, x->weights + number);
    if (r == VG_OK) r = vgi_gltf_say_names(w, VGI_GLTF_FRAMES, t->first, t->count, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}}");
}

static int say_animations(vgi_gltf_writing *w, vg_err *e)
{
    int r = vgi_gltf_say(&w->json, e, ",\n\"animations\":[");
    for (size_t i = 0; i < w->ntakes && r == VG_OK; i++) r = say_take(w, i, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]");
}

static size_t target_of(const void *context, size_t t, size_t l)
{
    return lying_of(context, t, l, POSITIONS)->accessor;
}

static int say_cast(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    vgi_json *names = NULL;
    int r = name_targets(w, &names, e);
    const vgi_gltf_cast cast = {x->lists, x->targets, target_of, x, names};
    if (r == VG_OK) r = vgi_gltf_say_cast(w, &cast, e);
    vgi_json_free(&names);
    return r;
}

static int say_scene(vgi_gltf_writing *w, vg_err *e)
{
    int r = vgi_gltf_say_materials(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\n");
    return r < 0 ? r : say_mesh(w, e);
}

static int describe(vgi_gltf_writing *w, vg_err *e)
{
    int r = choose_targets(w, e);
    if (r == VG_OK) r = list_vertices(w, e);
    if (r == VG_OK) r = turn_basis(w, e);
    if (r == VG_OK) r = look_at_targets(w, e);
    if (r == VG_OK && !w->still) r = describe_weights(w, e);
    if (r == VG_OK) r = describe_points(w, e);
    if (r == VG_OK) r = w->character ? say_cast(w, e) : say_scene(w, e);
    return r < 0 || w->still ? r : say_animations(w, e);
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

static int emit_indices(vgi_gltf_writing *w, const vgi_gltf_list *list, const lying *l, const float *d, vg_err *e)
{
    const morphs *x = w->own;
    const size_t step = index_bytes(list);
    unsigned char *p = x->packed, *start = p;
    for (size_t v = 0; v < list->count; v++) {
        if (!moves(d, v)) continue;
        p[0] = (unsigned char)v, p[1] = (unsigned char)(v >> 8);
        if (step == 4) p[2] = (unsigned char)(v >> 16), p[3] = (unsigned char)(v >> 24);
        p += step;
    }
    if (p == start) memset(p, 0, step), p += step;
    const size_t size = indices_size(list, l->moved);
    memset(p, 0, size - (size_t)(p - start));
    return vgi_gltf_emit(w, start, size, e);
}

static int emit_values(vgi_gltf_writing *w, const vgi_gltf_list *list, const float *d, vg_err *e)
{
    int r = VG_OK;
    size_t n = 0;
    for (size_t v = 0; v < list->count && r == VG_OK; v++)
        if (moves(d, v)) r = vgi_gltf_emit_singles(w, d + 3 * v, 3, e), n++;
    return r == VG_OK && !n ? vgi_gltf_emit_singles(w, d, 3, e) : r;
}

enum { WHOLE, INDICES, VALUES, ROUNDS };

static int emit_target(vgi_gltf_writing *w, size_t t, int round, vg_err *e)
{
    const morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]) && r == VG_OK; s++) {
            const vgi_gltf_list *list = &x->lists[i];
            const lying *l = lying_of(x, t, i, s);
            const float *d = x->file[s] + 3 * list->first;
            if (l->sparse == (round == WHOLE)) continue;
            r = round == WHOLE     ? vgi_gltf_emit_singles(w, d, 3 * list->count, e)
                : round == INDICES ? emit_indices(w, list, l, d, e)
                                   : emit_values(w, list, d, e);
        }
    return r;
}

static bool has_round(const morphs *x, size_t t, int round)
{
    for (size_t i = 0; i < x->nlists; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]); s++)
            if (lying_of(x, t, i, s)->sparse != (round == WHOLE)) return true;
    return false;
}

static int emit_base(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK && !x->based; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]) && r == VG_OK; s++)
            r = vgi_gltf_emit_singles(w, x->base[s] + 3 * x->lists[i].first, 3 * x->lists[i].count, e);
    return r;
}

/* First the complete ones, then the indices of the sparse ones, then their values. */
static int emit(vgi_gltf_writing *w, vg_err *e)
{
    const morphs *x = w->own;
    int r = w->still ? VG_OK : emit_weights(w, e);
    if (r == VG_OK) r = emit_base(w, e);
    for (int round = 0; round < ROUNDS && r == VG_OK; round++)
        for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
            if (!has_round(x, t, round)) continue;
            r = load_target(w, t, e);
            if (r == VG_OK) r = emit_target(w, t, round, e);
        }
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
    void *const arrays[] = {x->packed, x->chosen, x->at,     x->first, x->lists, x->file[POSITIONS],
                            x->file[NORMALS], x->world, x->turned};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    free(x);
}

const vgi_gltf_manner vgi_gltf_by_morphs = {begin, put, describe, emit, warning, release, "use --max-targets", true};
