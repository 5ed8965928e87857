/* gltf_play.c: a scene of glTF as frames: its animations at their key times, or each morph target by itself, with
 * nodes and skins where they take the vertices.
 * Leaves out animation of anything but nodes and weights, and what the scene shows (gltf_scene.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_scene.h"

#include <math.h>
#include <stdlib.h>

/* ---- transforms ---- */

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* to = a b; to may be neither. */
static void multiply(const double a[12], const double b[12], double to[12])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            to[4 * i + j] = j == 3 ? a[4 * i + 3] : 0;
            for (int k = 0; k < 3; k++) to[4 * i + j] += a[4 * i + k] * b[4 * k + j];
        }
}

static void move_point(const double m[12], const double p[3], double to[3])
{
    for (int i = 0; i < 3; i++) to[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
}

static void local_matrix(const vgi_gltf_placed *p, double m[12])
{
    const double *q = p->rotation;
    double r[9];
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double unit[4] = {length > 0 ? q[3] / length : 1, length > 0 ? q[0] / length : 0,
                            length > 0 ? q[1] / length : 0, length > 0 ? q[2] / length : 0};
    vg_quat_matrix(unit, r);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) m[4 * i + j] = r[3 * i + j] * p->scale[j];
        m[4 * i + 3] = p->translation[i];
    }
}

static void place_nodes(vgi_gltf_scene *x)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        vgi_gltf_node *n = &x->nodes[x->order[i]];
        double local[12];
        if (n->fixed) memcpy(local, n->matrix, sizeof local);
        else local_matrix(&n->now, local);
        multiply(n->parent == SIZE_MAX ? identity : x->nodes[n->parent].world, local, n->world);
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
            multiply(x->nodes[k->joints[j]].world, inverse, k->matrices + 12 * j);
        }
    }
}

/* ---- animations ---- */

static int check_times(vgi_gltf_scene *x, const vgi_gltf_channel *c, vg_err *e)
{
    double before = -HUGE_VAL, t;
    if (c->in.count > vgi_gltf_most - x->keys)
        return vgi_gltf_bad(&x->g, e, "its animations have more than %zu keys", vgi_gltf_most);
    x->keys += c->in.count;
    for (size_t i = 0; i < c->in.count; i++, before = t) {
        vgi_accessor_get(&c->in, i, &t);
        if (!(t > before) || !isfinite(t)) return vgi_gltf_bad(&x->g, e, "the times of an animation do not ascend");
    }
    return VG_OK;
}

static int read_sampler(vgi_gltf_scene *x, vgi_gltf_channel *c, const vgi_json *sampler, vg_err *e)
{
    const char *way = vgi_json_text(vgi_json_get(sampler, "interpolation"));
    c->cubic = way && !strcmp(way, "CUBICSPLINE"), c->step = way && !strcmp(way, "STEP");
    if (way && !c->cubic && !c->step && strcmp(way, "LINEAR") != 0)
        return vgi_gltf_bad(&x->g, e, "an animation's interpolation is not known");
    int r = vgi_gltf_accessor(&x->g, vgi_json_get(sampler, "input"), 1, 0, "an animation's times", &c->in, e);
    if (r == VG_OK) r = check_times(x, c, e);
    if (r < 0) return r;
    size_t n = c->path == VGI_GLTF_WEIGHTS ? c->width : 1, count;
    if (!vgi_mul(c->in.count, n * (c->cubic ? 3 : 1), &count))
        return vgi_gltf_bad(&x->g, e, "an animation is too long");
    r = vgi_gltf_accessor(&x->g, vgi_json_get(sampler, "output"), c->path == VGI_GLTF_WEIGHTS ? 1 : c->width, count,
                          "an animation's values", &c->out, e);
    return r == VG_OK && !c->out.data && !c->out.nsparse
               ? vgi_gltf_bad(&x->g, e, "an animation's values have no bytes")
               : r;
}

/* 1: it moves something that is shown; 0: it does not. */
static int read_target(const vgi_gltf_scene *x, vgi_gltf_channel *c, const vgi_json *target, vg_err *e)
{
    static const struct {
        const char *name;
        size_t width;
    } paths[] = {{"translation", 3}, {"rotation", 4}, {"scale", 3}, {"weights", 0}};
    const char *name = vgi_json_text(vgi_json_get(target, "path"));
    const vgi_json *item;
    size_t i = 0;
    if (!name || !vgi_json_get(target, "node")) return 0;
    while (i < 4 && strcmp(name, paths[i].name) != 0) i++;
    int r = vgi_gltf_item(&x->g, vgi_json_get(target, "node"), "nodes", &item, &c->node, e);
    if (r < 0 || i == 4) return r;
    const vgi_gltf_node *n = &x->nodes[c->node];
    c->path = (vgi_gltf_path)i, c->width = c->path == VGI_GLTF_WEIGHTS ? n->nweights : paths[i].width;
    if (!n->matters || c->width == 0) return 0;
    return n->fixed && c->path != VGI_GLTF_WEIGHTS
               ? vgi_gltf_bad(&x->g, e, "node %zu is animated and has a matrix", c->node)
               : 1;
}

static int read_channel(vgi_gltf_scene *x, const vgi_json *animation, const vgi_json *from, vg_err *e)
{
    uint64_t sampler;
    vgi_gltf_channel c = {0};
    int r = read_target(x, &c, vgi_json_get(from, "target"), e);
    if (r <= 0) return r;
    const vgi_json *samplers = vgi_json_get(animation, "samplers");
    if (!vgi_json_whole(vgi_json_get(from, "sampler"), &sampler) || sampler >= vgi_json_count(samplers))
        return vgi_gltf_bad(&x->g, e, "an animation refers to a sampler that is not there");
    r = read_sampler(x, &c, vgi_json_at(samplers, (size_t)sampler), e);
    if (r == VG_OK) r = vgi_grow(&x->channels, &x->channels_cap, x->nchannels + 1, sizeof *x->channels, e);
    if (r == VG_OK) x->channels[x->nchannels++] = c;
    return r;
}

static int by_time(const void *a, const void *b)
{
    double s = ((const vgi_gltf_moment *)a)->time, t = ((const vgi_gltf_moment *)b)->time;
    return s < t ? -1 : s > t;
}

static bool same_times(const vgi_gltf_channel *a, const vgi_gltf_channel *b)
{
    return a->in.data == b->in.data && a->in.count == b->in.count && a->in.stride == b->in.stride && !a->in.nsparse &&
           !b->in.nsparse;
}

static int add_moments(vgi_gltf_scene *x, const vgi_gltf_channel *c, vg_err *e)
{
    if (c->in.count > vgi_gltf_most_moments - x->nmoments)
        return vgi_gltf_bad(&x->g, e, "its animations have more than %zu times", vgi_gltf_most_moments);
    int r = vgi_grow(&x->moments, &x->moments_cap, x->nmoments + c->in.count, sizeof *x->moments, e);
    for (size_t i = 0; i < c->in.count && r == VG_OK; i++) {
        vgi_gltf_moment *m = &x->moments[x->nmoments++];
        m->clip = x->nclips;
        vgi_accessor_get(&c->in, i, &m->time);
    }
    return r;
}

/* Moments at one time are one. */
static size_t unite(vgi_gltf_moment *m, size_t n)
{
    size_t kept = 0;
    qsort(m, n, sizeof *m, by_time);
    for (size_t i = 0; i < n; i++)
        if (kept == 0 || m[i].time > m[kept - 1].time) m[kept++] = m[i];
    return kept;
}

static int read_animation(vgi_gltf_scene *x, const vgi_json *animation, vg_err *e)
{
    const vgi_json *channels = vgi_json_get(animation, "channels");
    const size_t first = x->nchannels, moments = x->nmoments;
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(channels) && r == VG_OK; i++)
        r = read_channel(x, animation, vgi_json_at(channels, i), e);
    if (r < 0 || x->nchannels == first) return r;
    for (size_t i = first; i < x->nchannels && r == VG_OK; i++) {
        if (i > first && same_times(&x->channels[i - 1], &x->channels[i])) continue;
        r = add_moments(x, &x->channels[i], e);
    }
    if (r == VG_OK) r = vgi_grow(&x->clips, &x->clips_cap, x->nclips + 1, sizeof *x->clips, e);
    if (r < 0) return r;
    size_t frames = unite(x->moments + moments, x->nmoments - moments);
    x->nmoments = moments + frames;
    const vgi_json *names = vgi_json_get(vgi_json_get(animation, "extras"), VGI_GLTF_FRAMES);
    x->clips[x->nclips++] = (vgi_gltf_clip){first, x->nchannels - first, moments,
                                   vgi_json_count(names) == frames ? names : NULL};
    return VG_OK;
}

static int read_animations(vgi_gltf_scene *x, vg_err *e)
{
    const vgi_json *list = vgi_json_get(x->g.json, "animations");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(list) && r == VG_OK; i++) r = read_animation(x, vgi_json_at(list, i), e);
    x->frames = x->nclips ? x->nmoments : x->most_targets ? x->most_targets + 1 : 1;
    return r;
}

/* ---- a channel at a time ---- */

/* Number k of key `key`: its value, or the tangent in front of it or behind it (which 0, 2) of a spline. */
static void key_value(const vgi_gltf_channel *c, size_t key, size_t which, double *to)
{
    const size_t at = c->cubic ? 3 * key + which : key;
    if (c->path != VGI_GLTF_WEIGHTS) {
        vgi_accessor_get(&c->out, at, to);
        return;
    }
    for (size_t k = 0; k < c->width; k++) vgi_accessor_get(&c->out, at * c->width + k, &to[k]);
}

static void turn_between(const double a[4], const double b[4], double s, double to[4])
{
    double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3], sign = cosine < 0 ? -1 : 1;
    double angle = acos(fmin(fabs(cosine), 1)), p = 1 - s, q = s;
    if (angle > 1e-6) p = sin((1 - s) * angle) / sin(angle), q = sin(s * angle) / sin(angle);
    for (int k = 0; k < 4; k++) to[k] = p * a[k] + sign * q * b[k];
}

static size_t last_key_before(const vgi_accessor *in, double t)
{
    size_t low = 0, high = in->count;
    while (high - low > 1) {
        size_t mid = low + (high - low) / 2;
        double time;
        vgi_accessor_get(in, mid, &time);
        if (time <= t) low = mid;
        else high = mid;
    }
    return low;
}

/* work: room for 4 * width numbers. */
static void sample(const vgi_gltf_channel *c, double t, double *to, double *work)
{
    const size_t key = last_key_before(&c->in, t), n = c->width;
    double t0, t1 = 0;
    double *a = work, *b = work + n, *out = work + 2 * n, *in = work + 3 * n;
    vgi_accessor_get(&c->in, key, &t0);
    if (key + 1 < c->in.count) vgi_accessor_get(&c->in, key + 1, &t1);
    key_value(c, key, 1, to);
    if (c->step || key + 1 == c->in.count || t <= t0) return;
    const double step = t1 - t0, s = (t - t0) / step;
    memcpy(a, to, n * sizeof *a);
    key_value(c, key + 1, 1, b);
    if (c->cubic) {
        key_value(c, key, 2, out);
        key_value(c, key + 1, 0, in);
        for (size_t k = 0; k < n; k++)
            to[k] = (2 * s * s * s - 3 * s * s + 1) * a[k] + step * (s * s * s - 2 * s * s + s) * out[k] +
                    (3 * s * s - 2 * s * s * s) * b[k] + step * (s * s * s - s * s) * in[k];
    } else if (c->path == VGI_GLTF_ROTATION) {
        turn_between(a, b, s, to);
    } else {
        for (size_t k = 0; k < n; k++) to[k] = (1 - s) * a[k] + s * b[k];
    }
}

static int animate(vgi_gltf_scene *x, const vgi_gltf_moment *m, vg_err *e)
{
    const vgi_gltf_clip *c = &x->clips[m->clip];
    double *work = vgi_array_raw(4 * (x->most_targets + 4), sizeof *work, e);
    if (!work) return VG_ENOMEM;
    for (size_t i = c->first; i < c->first + c->nchannels; i++) {
        const vgi_gltf_channel *ch = &x->channels[i];
        vgi_gltf_node *n = &x->nodes[ch->node];
        double *to = ch->path == VGI_GLTF_TRANSLATION ? n->now.translation
                     : ch->path == VGI_GLTF_ROTATION  ? n->now.rotation
                     : ch->path == VGI_GLTF_SCALE     ? n->now.scale
                                                      : n->weights;
        sample(ch, m->time, to, work);
    }
    free(work);
    return VG_OK;
}

/* ---- frames ---- */

/* Nodes as the file has them. morphed: morph targets too, else there are none. */
static void rest(vgi_gltf_scene *x, bool morphed)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        vgi_gltf_node *n = &x->nodes[i];
        n->now = n->rest;
        for (size_t t = 0; t < n->nweights; t++) n->weights[t] = morphed ? n->rest_weights[t] : 0;
    }
}

/* Where the joints take p; false: it hangs on none. */
static bool bend(const vgi_gltf_scene *x, const vgi_gltf_part *p, size_t v, const double at[3], double to[3])
{
    const vgi_gltf_skin *k = &x->skins[p->skin];
    double sum = 0, total[3] = {0}, joints[4], shares[4];
    for (size_t s = 0; s < p->nsets; s++) {
        vgi_accessor_get(&p->joints[s], v, joints);
        vgi_accessor_get(&p->shares[s], v, shares);
        for (int i = 0; i < 4; i++) {
            double moved[3];
            if (shares[i] == 0) continue;
            move_point(k->matrices + 12 * (size_t)joints[i], at, moved);
            for (int c = 0; c < 3; c++) total[c] += shares[i] * moved[c];
            sum += shares[i];
        }
    }
    for (int c = 0; c < 3; c++) to[c] = total[c] / sum;
    return sum != 0;
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
            for (int k = 0; k < 3; k++) to[3 * i + k] += n->weights[t] * d[k];
        }
    }
    for (size_t i = 0; i < p->nkept; i++) {
        memcpy(at, to + 3 * i, sizeof at);
        if (p->skin == VGI_GLTF_NONE || !bend(x, p, p->kept[i], at, to + 3 * i)) move_point(n->world, at, to + 3 * i);
    }
}

static int pose(vgi_gltf_scene *x, double *to, vg_err *e)
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

/* A morph target's name; NULL: it has none. */
static const char *target_name(const vgi_gltf_scene *x, size_t target)
{
    const vgi_json *mesh;
    for (size_t i = 0; i < x->nparts; i++) {
        const vgi_json *ref = vgi_json_get(x->nodes[x->parts[i].node].json, "mesh");
        if (vgi_gltf_item(&x->g, ref, "meshes", &mesh, NULL, NULL) < 0) continue;
        const char *name = vgi_json_text(
            vgi_json_at(vgi_json_get(vgi_json_get(mesh, "extras"), "targetNames"), target));
        if (name) return name;
    }
    return NULL;
}

static int begin_moment(vgi_gltf_scene *x, size_t i, vg_frame *f, vg_err *e)
{
    const vgi_gltf_moment *m = &x->moments[i];
    const vgi_gltf_clip *c = &x->clips[m->clip];
    const char *name = vgi_json_text(vgi_json_at(c->names, i - c->frames));
    f->has_time = x->nclips == 1, f->time = f->has_time ? m->time : 0; /* else time would start again */
    int r = animate(x, m, e);
    return r == VG_OK && name ? vg_frame_rename(f, name, e) : r;
}

/* Target i - 1 alone; 0: none. */
static int begin_shape(vgi_gltf_scene *x, size_t i, vg_frame *f, vg_err *e)
{
    const char *name = i ? target_name(x, i - 1) : x->frames > 1 ? "base" : NULL;
    for (size_t n = 0; n < x->nnodes; n++)
        if (i > 0 && i <= x->nodes[n].nweights) x->nodes[n].weights[i - 1] = 1;
    return name ? vg_frame_rename(f, name, e) : VG_OK;
}

int vgi_gltf_next(void *state, vg_frame *f, vg_err *e)
{
    vgi_gltf_scene *x = state;
    if (x->next == x->frames) return 0;
    rest(x, x->nclips > 0);
    int r = x->nclips ? begin_moment(x, x->next, f, e) : begin_shape(x, x->next, f, e);
    if (r == VG_OK) r = pose(x, f->values, e);
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
    rest(x, false);
    return pose(x, h->body.reference, e);
}

int vgi_gltf_play(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                  vg_err *e)
{
    (void)how;
    vgi_gltf_scene *x = *state = vgi_array(1, sizeof *x, e);
    vgi_gltf_faces f = {0};
    if (!x) return VG_ENOMEM;
    int r = vgi_gltf_open(&x->g, in, subject, e);
    if (r == VG_OK) r = vgi_gltf_scene_read(x, &f, e);
    if (r == VG_OK) r = vgi_gltf_mend(x, &f, e);
    h->body.mesh = f.mesh;
    h->kind = VG_VERTICES, h->precision = VG_F32, h->count = h->body.mesh.nv;
    if (r == VG_OK) r = read_animations(x, e);
    return r < 0 ? r : take_reference(x, h, e);
}

void vgi_gltf_close(void *state)
{
    vgi_gltf_scene *x = state;
    if (!x) return;
    vgi_gltf_scene_clear(x);
    free(x);
}
