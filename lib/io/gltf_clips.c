/* gltf_clips.c: the animations of a glTF file: which nodes and weights they move, when, and how. Animation that moves
 * no vertex is ignored.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_scene.h"

#include <math.h>
#include <stdlib.h>

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

static const struct {
    const char *name;
    size_t width;
} paths[] = {{"translation", 3}, {"rotation", 4}, {"scale", 3}, {"weights", 0}};
enum { PATHS = sizeof paths / sizeof *paths };

/* Index of the path; PATHS if unknown. */
static size_t path_named(const char *name, size_t n)
{
    size_t i = 0;
    while (i < PATHS && (strlen(paths[i].name) != n || memcmp(paths[i].name, name, n))) i++;
    return i;
}

/* 1 if it moves something that is shown, else 0. */
static int aim_at(const vgi_gltf_scene *x, vgi_gltf_channel *c, size_t node, size_t path, vg_err *e)
{
    const vgi_gltf_node *n = &x->nodes[node];
    c->node = node, c->path = (vgi_gltf_path)path;
    c->width = c->path == VGI_GLTF_WEIGHTS ? n->nweights : paths[path].width;
    if (!n->matters || c->width == 0) return 0;
    return n->fixed && c->path != VGI_GLTF_WEIGHTS
               ? vgi_gltf_bad(&x->g, e, "node %zu is animated and has a matrix", c->node)
               : 1;
}

static int add_channel(vgi_gltf_scene *x, const vgi_json *animation, const vgi_json *from, size_t node, size_t path,
                       vg_err *e)
{
    uint64_t sampler;
    vgi_gltf_channel c = {0};
    int r = aim_at(x, &c, node, path, e);
    if (r <= 0) return r;
    const vgi_json *samplers = vgi_json_get(animation, "samplers");
    if (!vgi_json_whole(vgi_json_get(from, "sampler"), &sampler) || sampler >= vgi_json_count(samplers))
        return vgi_gltf_bad(&x->g, e, "an animation refers to a sampler that does not exist");
    r = read_sampler(x, &c, vgi_json_at(samplers, (size_t)sampler), e);
    if (r == VG_OK) r = vgi_grow(&x->channels, &x->channels_cap, x->nchannels + 1, sizeof *x->channels, e);
    if (r == VG_OK) x->channels[x->nchannels++] = c;
    return r;
}

/* For "12/weights" after "/nodes/": the number, and the path; false if it has another form. */
static bool split_pointer(const char *s, size_t *number, size_t *path)
{
    const char *end = s + strlen(s);
    int64_t n;
    const char *p = *s == '-' || *s == '+' ? NULL : vgi_parse_int(s, end, &n);
    if (!p || *p != '/') return false;
    *number = (size_t)n;
    *path = path_named(p + 1, (size_t)(end - p - 1));
    return *path < PATHS;
}

/* KHR_animation_pointer: these targets move vertices: a node's transform and weights, and the weights of a mesh in
 * all nodes without weights of their own. */
static int add_pointed(vgi_gltf_scene *x, const vgi_json *animation, const vgi_json *from, const vgi_json *target,
                       vg_err *e)
{
    static const char nodes[] = "/nodes/", meshes[] = "/meshes/";
    const char *at = vgi_json_text(
        vgi_json_get(vgi_json_get(vgi_json_get(target, "extensions"), "KHR_animation_pointer"), "pointer"));
    size_t number, path;
    int r = VG_OK;
    if (!at) return VG_OK;
    if (!strncmp(at, nodes, strlen(nodes)) && split_pointer(at + strlen(nodes), &number, &path))
        return number < x->nnodes ? add_channel(x, animation, from, number, path, e)
                                  : vgi_gltf_bad(&x->g, e, "an animation targets '%.60s', which does not exist", at);
    if (strncmp(at, meshes, strlen(meshes)) || !split_pointer(at + strlen(meshes), &number, &path) ||
        path != VGI_GLTF_WEIGHTS)
        return VG_OK;
    for (size_t i = 0; i < x->nnodes && r >= 0; i++) {
        uint64_t mesh;
        if (!vgi_json_whole(vgi_json_get(x->nodes[i].json, "mesh"), &mesh) || mesh != number) continue;
        if (!vgi_json_get(x->nodes[i].json, "weights")) r = add_channel(x, animation, from, i, path, e);
    }
    return r;
}

static int read_channel(vgi_gltf_scene *x, const vgi_json *animation, const vgi_json *from, vg_err *e)
{
    const vgi_json *target = vgi_json_get(from, "target"), *item;
    const char *name = vgi_json_text(vgi_json_get(target, "path"));
    size_t node = 0;
    if (name && !strcmp(name, "pointer")) return add_pointed(x, animation, from, target, e);
    if (!name || !vgi_json_get(target, "node")) return VG_OK;
    int r = vgi_gltf_item(&x->g, vgi_json_get(target, "node"), "nodes", &item, &node, e);
    const size_t path = path_named(name, strlen(name));
    return r < 0 || path == PATHS ? r : add_channel(x, animation, from, node, path, e);
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

/* Merge moments at the same time. */
static size_t merge_moments(vgi_gltf_moment *m, size_t n)
{
    size_t kept = 0;
    qsort(m, n, sizeof *m, by_time);
    for (size_t i = 0; i < n; i++)
        if (kept == 0 || m[i].time > m[kept - 1].time) m[kept++] = m[i];
    return kept;
}

/* Sample at the given rate from the first key to the last. */
static int add_samples(vgi_gltf_scene *x, size_t first, vg_err *e)
{
    double from = HUGE_VAL, to = -HUGE_VAL, t;
    for (size_t i = first; i < x->nchannels; i++) {
        const vgi_accessor *in = &x->channels[i].in;
        vgi_accessor_get(in, 0, &t);
        from = fmin(from, t);
        vgi_accessor_get(in, in->count - 1, &t);
        to = fmax(to, t);
    }
    const double n = floor((to - from) * x->rate + 1e-6) + 1;
    if (!(n <= (double)(vgi_gltf_most_moments - x->nmoments)))
        return vgi_gltf_bad(&x->g, e, "its animations have more than %zu times", vgi_gltf_most_moments);
    int r = vgi_grow(&x->moments, &x->moments_cap, x->nmoments + (size_t)n, sizeof *x->moments, e);
    for (size_t k = 0; k < (size_t)n && r == VG_OK; k++)
        x->moments[x->nmoments++] = (vgi_gltf_moment){x->nclips, from + (double)k / x->rate};
    return r;
}

static int add_keys(vgi_gltf_scene *x, size_t first, vg_err *e)
{
    const size_t moments = x->nmoments;
    int r = VG_OK;
    for (size_t i = first; i < x->nchannels && r == VG_OK; i++) {
        if (i > first && same_times(&x->channels[i - 1], &x->channels[i])) continue;
        r = add_moments(x, &x->channels[i], e);
    }
    if (r == VG_OK) x->nmoments = moments + merge_moments(x->moments + moments, x->nmoments - moments);
    return r;
}

static int read_animation(vgi_gltf_scene *x, const vgi_json *animation, size_t number, vg_err *e)
{
    const vgi_json *channels = vgi_json_get(animation, "channels");
    const size_t first = x->nchannels, moments = x->nmoments;
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(channels) && r == VG_OK; i++)
        r = read_channel(x, animation, vgi_json_at(channels, i), e);
    if (r < 0 || x->nchannels == first) return r;
    r = x->rate > 0 ? add_samples(x, first, e) : add_keys(x, first, e);
    if (r == VG_OK) r = vgi_grow(&x->clips, &x->clips_cap, x->nclips + 1, sizeof *x->clips, e);
    if (r < 0) return r;
    const vgi_json *names = vgi_json_get(vgi_json_get(animation, "extras"), VGI_GLTF_FRAMES);
    const char *name = vgi_json_text(vgi_json_get(animation, "name"));
    x->clips[x->nclips++] = (vgi_gltf_clip){first, x->nchannels - first, moments, number, name && *name ? name : NULL,
                                   vgi_json_count(names) == x->nmoments - moments ? names : NULL};
    return VG_OK;
}

static int no_such_animation(const vgi_gltf_scene *x, const vgi_json *list, vg_err *e)
{
    char names[160] = "";
    size_t at = 0;
    for (size_t i = 0; i < vgi_json_count(list) && at + 40 < sizeof names; i++) {
        const char *name = vgi_json_text(vgi_json_get(vgi_json_at(list, i), "name"));
        at += (size_t)snprintf(names + at, sizeof names - at, "%s%.30s", i ? ", " : "", name ? name : "(no name)");
    }
    return vgi_gltf_bad(&x->g, e, "it has no animation '%.30s' that moves what it shows; it has: %s", x->wanted,
                        *names ? names : "none");
}

/* The animation requested by name, or all. */
int vgi_gltf_read_animations(vgi_gltf_scene *x, vg_err *e)
{
    const vgi_json *list = vgi_json_get(x->g.json, "animations");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(list) && r == VG_OK; i++) {
        const vgi_json *animation = vgi_json_at(list, i);
        const char *name = vgi_json_text(vgi_json_get(animation, "name"));
        if (!x->wanted || (name && !strcmp(name, x->wanted))) r = read_animation(x, animation, i, e);
    }
    return r == VG_OK && x->wanted && !x->nclips ? no_such_animation(x, list, e) : r;
}

/* ---- evaluation of a channel ---- */

/* Number k of key `key`: its value, or its in-tangent or out-tangent (which 0, 2) for a spline. */
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

/* work: workspace of 4 * width numbers. */
static void sample_channel(const vgi_gltf_channel *c, double t, double *to, double *work)
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

int vgi_gltf_animate(vgi_gltf_scene *x, const vgi_gltf_moment *m, vg_err *e)
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
        sample_channel(ch, m->time, to, work);
    }
    free(work);
    return VG_OK;
}

