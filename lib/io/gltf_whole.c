/* gltf_whole.c: compares the frames that are written with those that the file of a character plays by itself. If they are the
 * same, its skin, animations and morph targets can be written as they were: exact, small, and to be edited further.
 * Leaves out writing (gltf_write.c) and what is done otherwise (gltf_morph.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_whole.h"

#include <math.h>
#include <stdlib.h>

/* Shares of D, and of a coordinate, whose binary32 the stream may hold. */
static const double near_in_d = 1e-7, near_in_place = 1.2e-7;
static const double near_in_time = 1e-5; /* seconds */

/* ---- poses ---- */

static bool is_shown(const vgi_gltf_whole *k, const double *values)
{
    for (size_t v = 0; v < k->body->mesh.nv; v++)
        for (size_t i = 0; i < 3; i++) {
            const double here = k->pose[3 * (size_t)k->shown[v] + i];
            if (!(fabs(here - values[3 * v + i]) <= k->near + near_in_place * fabs(here))) return false;
        }
    return true;
}

/* 1: the file shows these values at this moment. */
static int shows_moment(vgi_gltf_whole *k, const vgi_gltf_moment *m, const double *values, vg_err *e)
{
    int r = vgi_gltf_pose_at(k->x, m, k->pose, e);
    return r < 0 ? r : is_shown(k, values);
}

static int shows_shape(vgi_gltf_whole *k, size_t shape, const double *values, vg_err *e)
{
    int r = vgi_gltf_pose_shape(k->x, shape, k->pose, e);
    return r < 0 ? r : is_shown(k, values);
}

/* ---- animations ---- */

static size_t moments_of(const vgi_gltf_whole *k, size_t clip)
{
    const vgi_gltf_scene *x = k->x;
    return (clip + 1 < x->nclips ? x->clips[clip + 1].frames : x->nmoments) - x->clips[clip].frames;
}

static const vgi_gltf_moment *moment_of(const vgi_gltf_whole *k, size_t clip, size_t i)
{
    return &k->x->moments[k->x->clips[clip].frames + i];
}

/* Whether frame i of a clip may be called so. */
static bool is_named_by(const vgi_gltf_clip *c, size_t i, const char *frame)
{
    const char *given = vgi_json_text(vgi_json_at(c->names, i));
    uint64_t number;
    if (!frame) return !c->name;
    if (given) return !strcmp(given, frame);
    return !c->name || (vg_frame_stem(frame, &number) == strlen(c->name) && !memcmp(frame, c->name, strlen(c->name)));
}

/* Whether the next frame of the present animation is at its next key, by time and name. */
static bool is_next(const vgi_gltf_whole *k, const vg_frame *f)
{
    return k->clip != SIZE_MAX && k->count < moments_of(k, k->clip) &&
           fabs(f->time - moment_of(k, k->clip, k->count)->time) <= near_in_time &&
           is_named_by(&k->x->clips[k->clip], k->count, f->name);
}

static bool is_whole_clip(const vgi_gltf_whole *k)
{
    return k->count == moments_of(k, k->clip);
}

/* 1: a clip that is not used yet begins with this frame. */
static int begin_clip(vgi_gltf_whole *k, const vg_frame *f, vg_err *e)
{
    int r = 0;
    if (k->clip != SIZE_MAX && !is_whole_clip(k)) return 0;
    k->count = 0;
    for (k->clip = 0; k->clip < k->x->nclips && r == 0; k->clip += r == 0)
        if (!k->used[k->clip] && is_next(k, f)) r = shows_moment(k, moment_of(k, k->clip, 0), f->values, e);
    if (r == 1) k->used[k->clip] = true, k->count = 1;
    return r;
}

static int put_timed(vgi_gltf_whole *k, const vg_frame *f, vg_err *e)
{
    if (!is_next(k, f)) return begin_clip(k, f, e);
    int r = shows_moment(k, moment_of(k, k->clip, k->count), f->values, e);
    k->count++;
    return r;
}

/* Several animations without names: the frames are all of their keys. */
static int put_untimed(vgi_gltf_whole *k, const vg_frame *f, vg_err *e)
{
    if (k->frames >= k->x->nmoments) return 0;
    const vgi_gltf_moment *m = &k->x->moments[k->frames];
    k->used[m->clip] = true;
    return shows_moment(k, m, f->values, e);
}

/* ---- shapes ---- */

static int put_shape(vgi_gltf_whole *k, const vg_frame *f, vg_err *e)
{
    const size_t n = k->x->shapes.names.n, i = k->frames;
    if (f->has_time || i > n) return 0;
    const char *name = i ? vgi_gltf_shape_name(k->x, i - 1) : "";
    if (*name && (!f->name || strcmp(f->name, name) != 0)) return 0;
    return shows_shape(k, i, f->values, e);
}

/* ---- the whole ---- */

/* 1: the reference pose is the rest pose of the file, too. */
static int begin_content(vgi_gltf_whole *k, const vg_frame *f, vg_err *e)
{
    const bool based = f->name && !strcmp(f->name, VGI_GLTF_BASE) && !f->has_time;
    const size_t shapes = k->x->shapes.names.n;
    k->timed = f->has_time;
    k->content = shapes && based ? VGI_GLTF_SHAPES : k->x->nclips ? VGI_GLTF_CLIPS : VGI_GLTF_POSE;
    if (k->content == VGI_GLTF_POSE && shapes) return 0;
    int r = k->content == VGI_GLTF_CLIPS ? vgi_gltf_pose_at(k->x, NULL, k->pose, e) : vgi_gltf_pose_shape(k->x, 0, k->pose, e);
    return r < 0 ? r : is_shown(k, k->body->reference);
}

int vgi_gltf_whole_put(vgi_gltf_whole *k, const vg_frame *f, vg_err *e)
{
    int r = 1;
    if (!k->fits) return VG_OK;
    if (k->frames == 0) r = begin_content(k, f, e);
    if (r == 1 && k->content != VGI_GLTF_CLIPS) r = put_shape(k, f, e);
    else if (r == 1) r = f->has_time != k->timed ? 0 : k->timed ? put_timed(k, f, e) : put_untimed(k, f, e);
    if (r == VG_ENOMEM) return r;
    k->fits = r == 1;
    k->frames++;
    return VG_OK;
}

bool vgi_gltf_whole_end(vgi_gltf_whole *k)
{
    if (!k->fits || !k->frames) return false;
    if (k->content == VGI_GLTF_POSE) return k->frames == 1;
    if (k->content == VGI_GLTF_SHAPES) return k->frames == k->x->shapes.names.n + 1;
    return k->timed ? is_whole_clip(k) : k->frames == k->x->nmoments;
}

size_t vgi_gltf_whole_clips(const vgi_gltf_whole *k)
{
    size_t n = 0;
    for (size_t i = 0; i < k->x->nclips; i++) n += k->used[i];
    return n;
}

/* Which clip an animation of the document is; SIZE_MAX: it moves no vertex. */
static size_t clip_of(const vgi_gltf_scene *x, size_t animation)
{
    size_t i = 0;
    while (i < x->nclips && x->clips[i].animation != animation) i++;
    return i < x->nclips ? i : SIZE_MAX;
}

static bool keeps(const vgi_gltf_whole *k, size_t animation)
{
    const size_t clip = clip_of(k->x, animation);
    if (k->content == VGI_GLTF_SHAPES) return false;
    return clip == SIZE_MAX ? vgi_gltf_whole_clips(k) == k->x->nclips : k->used[clip];
}

static const char key[] = "animations";

/* Put the list that was made with result r into the document, if it is not empty. */
static int put_animations(vgi_json *doc, vgi_json *kept, int r, vg_err *e)
{
    if (r == VG_OK && vgi_json_count(kept)) return vgi_json_put(doc, key, kept, e);
    vgi_json_free(&kept);
    vgi_json_drop(doc, key);
    return r;
}

int vgi_gltf_whole_trim(vgi_gltf_whole *k, const char *name, vg_err *e)
{
    vgi_json *doc = k->x->g.json, *kept = vgi_json_array(e);
    const vgi_json *all = vgi_json_get(doc, key);
    int r = kept ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(all) && r == VG_OK; i++) {
        if (!keeps(k, i)) continue;
        vgi_json *copy = vgi_json_copy(vgi_json_at(all, i), e);
        r = vgi_json_add(kept, copy, e);
        if (r == VG_OK && name && clip_of(k->x, i) != SIZE_MAX) r = vgi_json_put(copy, "name", vgi_json_of_text(name, e), e);
    }
    return put_animations(doc, kept, r, e);
}

int vgi_gltf_keep_still(vgi_gltf_scene *x, vg_err *e)
{
    const vgi_json *all = vgi_json_get(x->g.json, key);
    vgi_json *kept = vgi_json_array(e);
    int r = kept ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(all) && r == VG_OK; i++)
        if (clip_of(x, i) == SIZE_MAX) r = vgi_json_add(kept, vgi_json_copy(vgi_json_at(all, i), e), e);
    return put_animations(x->g.json, kept, r, e);
}

/* ---- opening ---- */

/* Every vertex of the file is posed, not only one of each that is welded. */
static int keep_all(vgi_gltf_scene *x, vg_err *e)
{
    for (size_t i = 0; i < x->nparts; i++) {
        vgi_gltf_part *p = &x->parts[i];
        if (!p->kept && !(p->kept = vgi_array_raw(p->count, sizeof *p->kept, e))) return VG_ENOMEM;
        for (size_t v = 0; v < p->count; v++) p->kept[v] = (uint32_t)v;
        p->nkept = p->count;
    }
    return VG_OK;
}

int vgi_gltf_whole_open(vgi_gltf_whole *k, vgi_gltf_character *c, const vg_body *b, vg_err *e)
{
    vgi_gltf_scene *x = &c->scene;
    *k = (vgi_gltf_whole){.x = x, .body = b, .clip = SIZE_MAX, .near = near_in_d * vg_diagonal(b->reference, b->mesh.nv)};
    k->shown = vgi_array_raw(b->mesh.nv, sizeof *k->shown, e), k->pose = vgi_array_raw(c->n, 3 * sizeof *k->pose, e);
    int r = k->shown && k->pose ? keep_all(x, e) : VG_ENOMEM;
    if (r < 0) return r;
    for (size_t f = c->n; f-- > 0;) k->shown[c->vertex[f]] = (uint32_t)f;
    r = vgi_gltf_read_animations(x, e);
    if (r == VG_OK) r = vgi_gltf_list_shapes(x, e);
    if (r == VG_OK && !(k->used = vgi_array(x->nclips, sizeof *k->used, e))) r = VG_ENOMEM;
    k->fits = r == VG_OK;
    return r == VG_ENOMEM ? r : VG_OK;
}

void vgi_gltf_whole_clear(vgi_gltf_whole *k)
{
    free(k->shown);
    free(k->pose);
    free(k->used);
}
