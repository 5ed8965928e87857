/* gltf_morph.c: frames as morph targets of glTF, with an animation of their weights; or shapes without an animation.
 * Leaves out the rest of the file (gltf_write.c), how targets lie in it (gltf_targets.c), and how few serve many frames
 * (gltf_basis.c).
 *
 * Frames are stored as displacements from the reference pose. Up to 100 of them become targets unchanged; more are
 * represented by a basis.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_morph.h"

#include <math.h>
#include <stdlib.h>

enum { USUAL_TARGETS = 100, USUAL_PER_MILLE = 1 };

static int begin_morphs(vgi_gltf_writing *w, const vg_sink_options *o, vg_err *e)
{
    const size_t nv = w->h->body.mesh.nv;
    vgi_gltf_morphs *x = w->own = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    w->still = x->shapes = o->shapes;
    x->most = o->most_targets, x->quantize = o->quantize;
    x->asked = o->morph_tolerance > 0, x->tolerance = x->asked ? o->morph_tolerance : USUAL_PER_MILLE / 1000.0;
    x->packed = vgi_array_raw(nv, VGI_GLTF_POINT, e), x->first = vgi_array_raw(nv, VGI_GLTF_POINT, e);
    return x->packed && x->first ? VG_OK : VG_ENOMEM;
}

/* Frames as vg-encode reads them from a file of shapes: "base" before all others, none with a time. */
static void look_for_shapes(vgi_gltf_writing *w, const vg_frame *f)
{
    vgi_gltf_morphs *x = w->own;
    if (w->frames == 0) x->named_shapes = !w->clip && f->name && !strcmp(f->name, VGI_GLTF_BASE);
    if (f->has_time) x->named_shapes = false;
}

/* A single frame that is the base itself needs no target and no animation. */
static int put_morph_frame(vgi_gltf_writing *w, const vg_frame *f, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    bool moves = false;
    for (size_t i = 0; i < n; i++) {
        float d = (float)(f->values[i] - w->base[i]);
        if ((float)f->values[i] == w->base[i]) d = 0; /* binary32 cannot be nearer */
        if (!isfinite(d)) return vg_fail(e, VG_EINPUT, "a position is too large for binary32");
        vgi_gltf_put_single(x->packed + VGI_GLTF_ITEM * i, d);
        moves |= d != 0;
    }
    look_for_shapes(w, f);
    w->still = x->shapes || x->named_shapes || (w->frames == 0 && !moves && !f->has_time);
    return vgi_output_put(&w->spool, x->packed, VGI_GLTF_ITEM * n, e);
}

/* ---- choice of target frames ---- */

static int load_frame(const vgi_gltf_writing *w, size_t frame, float *to, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv, bytes = VGI_GLTF_ITEM * n;
    int r = vgi_gltf_load(w, (uint64_t)frame * bytes, x->packed, bytes, e);
    for (size_t i = 0; i < n && r == VG_OK; i++) to[i] = vgi_gltf_get_single(x->packed + VGI_GLTF_ITEM * i);
    return r;
}

static int load_for_basis(void *context, size_t frame, float *to, vg_err *e)
{
    return load_frame(context, frame, to, e);
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
    vgi_gltf_morphs *x = w->own;
    if (!(x->chosen = vgi_array(w->frames, sizeof *x->chosen, e))) return VG_ENOMEM;
    if (w->whole) return VG_OK; /* the animations of the file */
    int r = load_frame(w, 0, x->first, e);
    const bool skip = r == VG_OK && w->still && moves_nothing(x->first, 3 * w->h->body.mesh.nv);
    for (size_t i = skip; i < w->frames && r == VG_OK; i++) x->chosen[x->targets++] = i;
    return r;
}

static int choose_targets(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
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
    vgi_gltf_morphs *x = w->own;
    if (!(x->lists = vgi_array(1, sizeof *x->lists, e))) return VG_ENOMEM;
    x->nlists = 1, x->n = w->seams.n, x->base[VGI_GLTF_POSITIONS] = w->base;
    x->lists[0] = (vgi_gltf_list){.count = x->n};
    if (!w->normals.n) return VG_OK;
    x->lists[0].normals = true, x->base[VGI_GLTF_NORMALS] = w->normals.base;
    x->file[VGI_GLTF_NORMALS] = vgi_array(x->n, VGI_GLTF_POINT, e);
    x->world = vgi_array(w->h->body.mesh.nv, 3 * sizeof *x->world, e);
    return x->file[VGI_GLTF_NORMALS] && x->world ? VG_OK : VG_ENOMEM;
}

static int list_parts(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    const vgi_gltf_character *c = w->character;
    if (!(x->lists = vgi_array(c->scene.nparts, sizeof *x->lists, e))) return VG_ENOMEM;
    x->nlists = c->scene.nparts, x->n = c->n, x->based = c->kept;
    x->base[VGI_GLTF_POSITIONS] = c->base, x->base[VGI_GLTF_NORMALS] = c->normal;
    for (size_t i = 0; i < x->nlists; i++) {
        const vgi_gltf_part *p = &c->scene.parts[i];
        vgi_gltf_list *l = &x->lists[i];
        uint64_t position = 0, normal = 0;
        vgi_json_whole(vgi_json_get(p->attributes, "POSITION"), &position);
        l->normals = c->normal && vgi_json_whole(vgi_json_get(p->attributes, "NORMAL"), &normal);
        l->tangents = l->normals && c->tangent && vgi_gltf_needs_tangents(&c->scene, i);
        l->first = p->first, l->count = p->count, l->position = (size_t)position, l->normal = (size_t)normal;
    }
    if (c->normal && !(x->file[VGI_GLTF_NORMALS] = vgi_array(x->n, VGI_GLTF_POINT, e))) return VG_ENOMEM;
    if (c->normal && c->tangent && !(x->file[VGI_GLTF_TANGENTS] = vgi_array(x->n, VGI_GLTF_POINT, e))) return VG_ENOMEM;
    return (x->world = vgi_array(c->nv, 3 * sizeof *x->world, e)) ? VG_OK : VG_ENOMEM;
}

static int list_vertices(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    int r = w->character ? list_parts(w, e) : list_plain(w, e);
    if (r == VG_OK && !(x->file[VGI_GLTF_POSITIONS] = vgi_array_raw(x->n, VGI_GLTF_POINT, e))) r = VG_ENOMEM;
    if (r == VG_OK && !(x->moving = vgi_array_raw(x->n, VGI_GLTF_POINT, e))) r = VG_ENOMEM;
    free(x->packed);
    const size_t nv = w->h->body.mesh.nv;
    return r == VG_OK && (x->packed = vgi_array_raw(x->n > nv ? x->n : nv, VGI_GLTF_POINT, e)) ? VG_OK : VG_ENOMEM;
}

/* The whole pose of some displacements. */
static void find_world(const vgi_gltf_writing *w, const float *moved)
{
    const vgi_gltf_morphs *x = w->own;
    const double *reference = w->h->body.reference;
    for (size_t i = 0; i < 3 * w->h->body.mesh.nv; i++)
        x->world[i] = moved[i] == 0 ? reference[i] : (double)w->base[i] + moved[i];
}

static void spread_plain(const vgi_gltf_writing *w)
{
    const vgi_gltf_morphs *x = w->own;
    float *to = x->file[VGI_GLTF_POSITIONS];
    memcpy(to, x->first, VGI_GLTF_POINT * w->seams.nv);
    for (size_t v = w->seams.nv; v < x->n; v++)
        memcpy(to + 3 * v, x->first + 3 * (size_t)w->seams.from[v], VGI_GLTF_POINT);
}

/* The normals of x->world. */
static void turn_normals(vgi_gltf_writing *w)
{
    vgi_gltf_morphs *x = w->own;
    if (!x->file[VGI_GLTF_NORMALS]) return;
    if (w->character) vgi_gltf_character_turn(w->character, x->world, x->file[VGI_GLTF_NORMALS], x->file[VGI_GLTF_TANGENTS]);
    else vgi_gltf_normals_turn(&w->normals, x->world, x->file[VGI_GLTF_NORMALS]);
}

static size_t turned_bytes(const vgi_gltf_morphs *x)
{
    return VGI_GLTF_POINT * x->n * ((x->file[VGI_GLTF_NORMALS] != NULL) + (size_t)(x->file[VGI_GLTF_TANGENTS] != NULL));
}

/* Targets are asked for in order the first time. */
static int keep_turned(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    for (int s = VGI_GLTF_NORMALS; s < VGI_GLTF_SORTS && r == VG_OK; s++)
        if (x->file[s]) r = vgi_output_put(&w->spool, x->file[s], VGI_GLTF_POINT * x->n, e);
    x->kept += r == VG_OK;
    return r;
}

static int load_turned(vgi_gltf_writing *w, size_t t, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    uint64_t at = (uint64_t)w->frames * VGI_GLTF_POINT * w->h->body.mesh.nv + (uint64_t)t * turned_bytes(x);
    int r = vgi_output_flush(&w->spool, e);
    for (int s = VGI_GLTF_NORMALS; s < VGI_GLTF_SORTS && r == VG_OK; s++) {
        if (!x->file[s]) continue;
        r = vgi_gltf_load(w, at, (unsigned char *)x->file[s], VGI_GLTF_POINT * x->n, e);
        at += VGI_GLTF_POINT * x->n;
    }
    return r;
}

static int spread_frame(vgi_gltf_writing *w, size_t t, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    if (x->world) find_world(w, x->first);
    if (w->character) vgi_gltf_character_pose(w->character, x->world, x->first, x->file[VGI_GLTF_POSITIONS]);
    else spread_plain(w);
    if (t < x->kept) return load_turned(w, t, e);
    turn_normals(w);
    return t == x->kept ? keep_turned(w, e) : VG_OK;
}

static void spread_basis(vgi_gltf_writing *w, size_t t)
{
    vgi_gltf_morphs *x = w->own;
    if (w->character) vgi_gltf_character_move(w->character, x->first, x->file[VGI_GLTF_POSITIONS]);
    else spread_plain(w);
    for (int s = VGI_GLTF_NORMALS; s < VGI_GLTF_SORTS; s++)
        if (x->file[s]) memcpy(x->file[s], x->turned[s] + t * 3 * x->n, VGI_GLTF_POINT * x->n);
}

/* ---- normals of a basis: mixed with the weights of the positions, they are nearest to the normals of all frames ---- */

/* solved: the share of the frame in target t is solved[t * step]. */
static void add_frame(vgi_gltf_morphs *x, int sort, const double *solved, size_t step)
{
    for (size_t t = 0; t < x->targets; t++) {
        const float share = (float)solved[t * step];
        float *to = x->turned[sort] + t * 3 * x->n;
        for (size_t i = 0; i < 3 * x->n; i++) to[i] += share * x->file[sort][i];
    }
}

static int turn_basis(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    double *solved = NULL;
    if (x->chosen || !x->file[VGI_GLTF_NORMALS]) return VG_OK;
    int r = VG_OK;
    for (int s = VGI_GLTF_NORMALS; s < VGI_GLTF_SORTS && r == VG_OK; s++)
        if (x->file[s] && !(x->turned[s] = vgi_array(x->targets, VGI_GLTF_POINT * x->n, e))) r = VG_ENOMEM;
    if (r == VG_OK) r = vgi_gltf_basis_solve(&x->basis, w->frames, &solved, e);
    for (size_t f = 0; f < w->frames && r == VG_OK; f++) {
        if ((r = load_frame(w, f, x->first, e)) < 0) break;
        find_world(w, x->first);
        turn_normals(w);
        for (int s = VGI_GLTF_NORMALS; s < VGI_GLTF_SORTS; s++)
            if (x->file[s]) add_frame(x, s, solved + f, w->frames);
    }
    free(solved);
    return r;
}

/* For all vertices of the file. */
int vgi_gltf_load_target(vgi_gltf_writing *w, size_t t, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    const size_t n = 3 * w->h->body.mesh.nv;
    int r = x->chosen ? load_frame(w, x->chosen[t], x->first, e) : VG_OK;
    if (!x->chosen) memcpy(x->first, x->basis.targets + t * n, n * sizeof *x->first);
    if (r < 0) return r;
    if (x->chosen) return spread_frame(w, t, e);
    spread_basis(w, t);
    return VG_OK;
}

static int describe_weights(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
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
    const vgi_gltf_morphs *x = w->own;
    vg_bytes moving = {0};
    int r = vgi_gltf_say(&moving, e, "\"attributes\":{\"POSITION\":%zu", x->lists[0].position);
    if (r == VG_OK && w->normals.n) r = vgi_gltf_say(&moving, e, ",\"NORMAL\":%zu", x->lists[0].normal);
    if (r == VG_OK) r = vgi_gltf_say_attributes(w, &moving, e);
    if (r == VG_OK) r = vgi_gltf_say(&moving, e, "}");
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        r = vgi_gltf_say(&moving, e, "%s{\"POSITION\":%zu", t ? "," : ",\"targets\":[",
                         vgi_gltf_lying(x, t, 0, VGI_GLTF_POSITIONS)->accessor);
        if (r == VG_OK && w->normals.n)
            r = vgi_gltf_say(&moving, e, ",\"NORMAL\":%zu", vgi_gltf_lying(x, t, 0, VGI_GLTF_NORMALS)->accessor);
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
    const vgi_gltf_morphs *x = w->own;
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
    const vgi_gltf_morphs *x = w->own;
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
    const vgi_gltf_morphs *x = w->own;
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
    size_t n = 0;
    int r = vgi_gltf_say(&w->json, e, ",\n\"animations\":[");
    if (r == VG_OK && w->character) r = vgi_gltf_say_elements(w->character->scene.g.json, "animations", &w->json, &n, e);
    if (r == VG_OK && n) r = vgi_gltf_say(&w->json, e, ",\n");
    for (size_t i = 0; i < w->ntakes && r == VG_OK; i++) r = say_take(w, i, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]");
}

static size_t target_of(const void *context, size_t t, size_t l)
{
    return vgi_gltf_lying(context, t, l, VGI_GLTF_POSITIONS)->accessor;
}

static int say_cast(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    vgi_json *names = NULL;
    int r = name_targets(w, &names, e);
    const vgi_gltf_cast cast = {x->lists, x->targets, target_of, x, names, w->whole, w->still, x->grids, x->ngrids};
    if (r == VG_OK) r = vgi_gltf_say_cast(w, &cast, e);
    vgi_json_free(&names);
    return r;
}

static int say_node(vgi_gltf_writing *w, vg_err *e)
{
    static const char used[] = "\"extensionsUsed\":[\"" VGI_GLTF_QUANTIZATION "\"],\n"
                               "\"extensionsRequired\":[\"" VGI_GLTF_QUANTIZATION "\"],\n";
    const vgi_gltf_morphs *x = w->own;
    int r = vgi_gltf_say(&w->json, e, "%s\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0", x->grids ? used : "");
    for (int scale = 0; scale < 2 && x->grids && r == VG_OK; scale++) {
        const vgi_gltf_grid *g = x->grids;
        const double scales[3] = {g->scale, g->scale, g->scale};
        r = vgi_gltf_say_numbers(&w->json, scale ? ",\"scale\":[" : ",\"translation\":[", scale ? scales : g->origin, 3, "]", e);
    }
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}],\n");
}

static int say_scene(vgi_gltf_writing *w, vg_err *e)
{
    int r = vgi_gltf_say_materials(w, e);
    if (r == VG_OK) r = say_node(w, e);
    return r < 0 ? r : say_mesh(w, e);
}

static int describe_morphs(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    if (w->as_it_was) return vgi_gltf_say_whole(w, e);
    int r = choose_targets(w, e);
    if (r == VG_OK) r = list_vertices(w, e);
    if (r == VG_OK) r = turn_basis(w, e);
    if (r == VG_OK && x->quantize) r = vgi_gltf_quantize(w, e);
    if (r == VG_OK) r = vgi_gltf_look_at_targets(w, e);
    if (r == VG_OK && !w->still) r = describe_weights(w, e);
    if (r == VG_OK) r = vgi_gltf_describe_binds(w, e);
    if (r == VG_OK) r = vgi_gltf_describe_targets(w, e);
    if (r == VG_OK) r = w->character ? say_cast(w, e) : say_scene(w, e);
    return r < 0 || w->still ? r : say_animations(w, e);
}

/* ---- bytes ---- */

static int emit_weights(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    if (!x->chosen) return vgi_gltf_emit_singles(w, x->basis.weights, w->frames * x->targets, e);
    for (size_t i = 0; i < w->frames && r == VG_OK; i++)
        for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
            const float weight = x->chosen[t] == i;
            r = vgi_gltf_emit_singles(w, &weight, 1, e);
        }
    return r;
}

static int emit_morphs(vgi_gltf_writing *w, vg_err *e)
{
    if (w->as_it_was) return VG_OK;
    int r = w->still ? VG_OK : emit_weights(w, e);
    return r < 0 ? r : vgi_gltf_emit_targets(w, e);
}

static void warning(const vgi_gltf_writing *w, char *to, size_t room)
{
    const vgi_gltf_morphs *x = w->own;
    const double d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    if (!w->whole && !x->chosen && x->basis.error > x->tolerance * d)
        snprintf(to, room,
                 "every frame: %zu are mixed from %zu morph targets, with vertices off by at "
                 "most %.3g%% of the diagonal (--max-targets)",
                 w->frames, x->targets, d > 0 ? 100 * x->basis.error / d : 0);
}

/* false: the numbers are binary32, and those of the frames. */
static bool report(const vgi_gltf_writing *w, char *to, size_t room)
{
    const vgi_gltf_morphs *x = w->own;
    const double d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    int n = w->whole                  ? snprintf(to, room, "what moves is as it was in the GLB that was read")
            : w->still && !x->targets ? snprintf(to, room, "no morph targets")
                                      : snprintf(to, room, "%zu morph target%s for %zu frame%s", x->targets,
                                                 x->targets == 1 ? "" : "s", w->frames, w->frames == 1 ? "" : "s");
    if (w->as_it_was) return false;
    if (x->chosen && !x->quantize) {
        snprintf(to + n, room - (size_t)n, ", positions as they are in binary32");
        return false;
    }
    snprintf(to + n, room - (size_t)n, "; no vertex is off by more than %.2g %% of D", d > 0 ? 100 * vgi_gltf_largest_error(w) / d : 0);
    return true;
}

static void release_morphs(void *own)
{
    vgi_gltf_morphs *x = own;
    if (!x) return;
    vgi_gltf_basis_clear(&x->basis);
    void *const arrays[] = {x->packed, x->chosen, x->at,     x->first, x->lists, x->file[VGI_GLTF_POSITIONS],
                            x->file[VGI_GLTF_NORMALS], x->file[VGI_GLTF_TANGENTS], x->world, x->turned[VGI_GLTF_NORMALS],
                            x->turned[VGI_GLTF_TANGENTS],
                            x->moving, x->grids, x->rounded[VGI_GLTF_POSITIONS], x->rounded[VGI_GLTF_NORMALS], x->off[0], x->off[1],
                            x->target_off};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    free(x);
}

const vgi_gltf_manner vgi_gltf_by_morphs = {begin_morphs, put_morph_frame, describe_morphs, emit_morphs, warning, report, release_morphs, "use --max-targets", true};
