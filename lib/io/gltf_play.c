/* gltf_play.c: evaluates a glTF scene as frames: its animations, or each morph target separately, with nodes and
 * skins applied. The scene's contents are in gltf_scene.c, animations in gltf_clips.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_scene.h"
#include "numeric/vec3.h"

#include <stdlib.h>

/* ---- transforms ---- */

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* to = a b; `to` must differ from both. */
static void multiply_affine(const double a[12], const double b[12], double to[12])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            to[4 * i + j] = j == 3 ? a[4 * i + 3] : 0;
            for (int k = 0; k < 3; k++) to[4 * i + j] += a[4 * i + k] * b[4 * k + j];
        }
}

void vgi_gltf_move_point(const double m[12], const double p[3], double to[3])
{
    for (int i = 0; i < 3; i++) to[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
}

static void place_nodes(vgi_gltf_scene *x)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        vgi_gltf_node *n = &x->nodes[x->order[i]];
        double local[12];
        if (n->fixed) memcpy(local, n->matrix, sizeof local);
        else vgi_gltf_local_matrix(&n->now, local);
        multiply_affine(n->parent == SIZE_MAX ? identity : x->nodes[n->parent].world, local, n->world);
    }
}

static void place_joints(vgi_gltf_scene *x)
{
    for (size_t s = 0; s < x->nskins; s++) {
        const vgi_gltf_skin *k = &x->skins[s];
        for (size_t j = 0; j < k->n; j++) {
            double columns[16], inverse[12];
            memcpy(inverse, identity, sizeof inverse);
            if (k->bound) {
                vgi_accessor_get(&k->inverse, j, columns);
                vgi_gltf_from_columns(columns, inverse);
            }
            multiply_affine(x->nodes[k->joints[j]].world, inverse, k->matrices + 12 * j);
        }
    }
}

/* ---- frames ---- */

/* Reset nodes to the file's values. morphed: keep the file's morph weights, otherwise use none. */
static void reset_nodes(vgi_gltf_scene *x, bool morphed)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        vgi_gltf_node *n = &x->nodes[i];
        n->now = n->rest;
        for (size_t t = 0; t < n->nweights; t++) n->weights[t] = morphed ? n->rest_weights[t] : 0;
    }
}

/* The position of vertex v under its joints; false if no joint has a weight. */
static bool skin_vertex(const vgi_gltf_scene *x, const vgi_gltf_part *p, size_t v, const double at[3], double to[3])
{
    const vgi_gltf_skin *k = &x->skins[p->skin];
    double sum = 0, total[3] = {0}, joints[4], shares[4];
    for (size_t s = 0; s < p->nsets; s++) {
        vgi_accessor_get(&p->joints[s], v, joints);
        vgi_accessor_get(&p->shares[s], v, shares);
        for (int i = 0; i < 4; i++) {
            double moved[3];
            if (shares[i] == 0) continue;
            vgi_gltf_move_point(k->matrices + 12 * (size_t)joints[i], at, moved);
            vgi_add_scaled(total, shares[i], moved);
            sum += shares[i];
        }
    }
    vgi_divided(total, sum, to);
    return sum != 0;
}

void vgi_gltf_rest(vgi_gltf_scene *x)
{
    reset_nodes(x, false);
    place_nodes(x);
    place_joints(x);
}

void vgi_gltf_vertex_matrix(const vgi_gltf_scene *x, const vgi_gltf_part *p, size_t v, double m[12])
{
    double sum = 0, joints[4], shares[4], total[12] = {0};
    for (size_t s = 0; s < (p->skin == VGI_GLTF_NONE ? 0 : p->nsets); s++) {
        vgi_accessor_get(&p->joints[s], v, joints);
        vgi_accessor_get(&p->shares[s], v, shares);
        for (int i = 0; i < 4; i++) {
            if (shares[i] == 0) continue;
            for (int k = 0; k < 12; k++) total[k] += shares[i] * x->skins[p->skin].matrices[12 * (size_t)joints[i] + (size_t)k];
            sum += shares[i];
        }
    }
    if (sum == 0) multiply_affine(x->nodes[p->node].world, p->place, m);
    else
        for (int k = 0; k < 12; k++) m[k] = total[k] / sum;
}

static void pose_part(const vgi_gltf_scene *x, const vgi_gltf_part *p, double *to)
{
    const vgi_gltf_node *n = &x->nodes[p->node];
    double d[3], at[3];
    for (size_t i = 0; i < p->nkept; i++) vgi_accessor_get(&p->position, p->kept[i], to + 3 * i);
    for (size_t t = 0; t < p->ntargets; t++) {
        if (n->weights[t] == 0) continue;
        for (size_t i = 0; i < p->nkept; i++) {
            vgi_accessor_get(&p->moved[t], p->kept[i], d);
            vgi_add_scaled(to + 3 * i, n->weights[t], d);
        }
    }
    double world[12];
    multiply_affine(n->world, p->place, world);
    for (size_t i = 0; i < p->nkept; i++) {
        memcpy(at, to + 3 * i, sizeof at);
        if (p->skin == VGI_GLTF_NONE || !skin_vertex(x, p, p->kept[i], at, to + 3 * i)) vgi_gltf_move_point(world, at, to + 3 * i);
    }
}

static int pose_vertices(vgi_gltf_scene *x, double *to, vg_err *e)
{
    size_t n = 0;
    place_nodes(x);
    place_joints(x);
    for (size_t i = 0; i < x->nparts; i++) {
        pose_part(x, &x->parts[i], to + 3 * n);
        n += x->parts[i].nkept;
    }
    return vgi_finite(to, 3 * n) ? VG_OK : vgi_gltf_bad(&x->g, e, "a position is not a finite number");
}

/* "Walk.0001" */
static int name_by_clip(vg_frame *f, const char *clip, size_t number, vg_err *e)
{
    const size_t n = strlen(clip) + 32;
    char *name = vgi_array_raw(n, 1, e);
    if (!name) return VG_ENOMEM;
    snprintf(name, n, "%s.%04zu", clip, number);
    int r = vg_frame_rename(f, name, e);
    free(name);
    return r;
}

static int begin_moment(vgi_gltf_scene *x, size_t i, vg_frame *f, vg_err *e)
{
    const vgi_gltf_moment *m = &x->moments[i];
    const vgi_gltf_clip *c = &x->clips[m->clip];
    const char *name = vgi_json_text(vgi_json_at(c->names, i - c->frames));
    f->has_time = x->nclips == 1 || c->name; /* names distinguish animations, each with its own times */
    f->time = f->has_time ? m->time : 0;
    int r = vgi_gltf_animate(x, m, e);
    if (r == VG_OK && name) return vg_frame_rename(f, name, e);
    return r == VG_OK && c->name && !x->own ? name_by_clip(f, c->name, i - c->frames + 1, e) : r;
}

/* Shape i - 1 alone, in all meshes that have it; 0: none. */
static void set_shape(vgi_gltf_scene *x, size_t i)
{
    for (size_t n = 0; n < x->nnodes; n++)
        for (size_t t = 0; i > 0 && t < x->nodes[n].nweights; t++)
            if (x->nodes[n].shape_of[t] == i - 1) x->nodes[n].weights[t] = 1;
}

static int begin_shape(vgi_gltf_scene *x, size_t i, vg_frame *f, vg_err *e)
{
    const char *name = i ? vgi_gltf_shape_name(x, i - 1) : x->frames > 1 ? VGI_GLTF_BASE : "";
    set_shape(x, i);
    return *name ? vg_frame_rename(f, name, e) : VG_OK;
}

int vgi_gltf_pose_at(vgi_gltf_scene *x, const vgi_gltf_moment *m, double *to, vg_err *e)
{
    reset_nodes(x, true);
    int r = m ? vgi_gltf_animate(x, m, e) : VG_OK;
    return r < 0 ? r : pose_vertices(x, to, e);
}

int vgi_gltf_pose_shape(vgi_gltf_scene *x, size_t shape, double *to, vg_err *e)
{
    reset_nodes(x, false);
    set_shape(x, shape);
    return pose_vertices(x, to, e);
}

int vgi_gltf_next(void *state, vg_frame *f, vg_err *e)
{
    vgi_gltf_scene *x = state;
    if (x->next == x->frames) return 0;
    reset_nodes(x, x->nclips > 0);
    int r = x->nclips ? begin_moment(x, x->next, f, e) : begin_shape(x, x->next, f, e);
    if (r == VG_OK) r = pose_vertices(x, f->values, e);
    x->next++;
    return r < 0 ? r : 1;
}

uint64_t vgi_gltf_frames(const void *state)
{
    return ((const vgi_gltf_scene *)state)->frames;
}

/* ---- opening ---- */

static int take_reference(vgi_gltf_scene *x, vg_head *h, vg_err *e)
{
    const vgi_json *mesh;
    int r = vgi_gltf_item(&x->g, vgi_json_get(x->nodes[x->parts[0].node].json, "mesh"), "meshes", &mesh, NULL, e);
    if (r < 0) return r;
    const char *name = vgi_json_text(vgi_json_get(mesh, "name"));
    if (name && *name && !(h->body.reference_name = vgi_copy_string(name, strlen(name), e))) return VG_ENOMEM;
    if (!(h->body.reference = vgi_array(h->body.mesh.nv, 3 * sizeof *h->body.reference, e))) return VG_ENOMEM;
    return x->nclips ? vgi_gltf_pose_at(x, NULL, h->body.reference, e) : vgi_gltf_pose_shape(x, 0, h->body.reference, e);
}

static int set_up(vgi_gltf_scene *x, const vg_reading *how, vg_err *e)
{
    x->rate = how->fps, x->as_shapes = how->shapes, x->unwelded = how->unwelded, x->like = how->like;
    if (!how->animation) return VG_OK;
    return (x->wanted = vgi_copy_string(how->animation, strlen(how->animation), e)) ? VG_OK : VG_ENOMEM;
}

int vgi_gltf_play(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject, vg_err *e)
{
    vgi_gltf_scene *x = *state = vgi_array(1, sizeof *x, e);
    vgi_gltf_faces f = {0};
    int r = x ? set_up(x, how, e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_gltf_open(&x->g, in, subject, e);
    if (r == VG_OK) r = vgi_gltf_scene_read(x, &f, e);
    if (r == VG_OK) r = vgi_gltf_mend(x, &f, e);
    vg_head_put(h, &f.mesh, "mesh");
    if (r == VG_OK) vg_head_put(h, &x->attributes, "attributes");
    h->kind = VG_VERTICES, h->precision = VG_F32, h->count = h->body.mesh.nv;
    if (r == VG_OK) r = vgi_gltf_take_asset(x, in, &h->body.mesh, &h->body.asset, e);
    if (r == VG_OK && !x->as_shapes) r = vgi_gltf_read_animations(x, e);
    if (r == VG_OK) r = vgi_gltf_list_shapes(x, e);
    if (r < 0) return r;
    x->frames = x->nclips ? x->nmoments : x->shapes.names.n ? x->shapes.names.n + 1 : 1;
    if (!x->strips) vgi_note_dropped(&x->note, x->dropped); /* strips contain such triangles */
    vgi_gltf_note_extensions(&x->g, &x->note);
    return take_reference(x, h, e);
}

const char *vgi_gltf_note(const void *state)
{
    return ((const vgi_gltf_scene *)state)->note.text;
}

void vgi_gltf_close(void *state)
{
    vgi_gltf_scene *x = state;
    if (!x) return;
    vgi_gltf_scene_clear(x);
    free(x);
}
