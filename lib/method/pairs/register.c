/* register.c: registration: from a few pairs of points to the source faces that drive each target face. Steps: a
 * common frame, rejection of inconsistent pairs, the fit (fit.c), the pairing (pair.c). Files are read elsewhere.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/register.h"
#include "method/pairs/similarity.h"
#include "numeric/vec3.h"
#include "numeric/kdtree.h"
#include "numeric/stats.h"
#include "numeric/polar.h"

#include <stdlib.h>

enum { NEIGHBOURS = 4, ROBUST_ROUNDS = 20 };

/* A pair is wrong if its distance from the place that its neighbours predict is at least this many times the typical
 * one, and at least this far in D. */
static const double WRONG_TIMES = 5, WRONG_FAR = 0.08;

struct registration {
    const vg_register_input *in;
    vg_register_result *out;
    double unit, centre[3];     /* of the target: lengths are divided by D, and its centroid is moved to 0 */
    double *source, *target;    /* points, normalised */
    double *rest;               /* the similarity that aligns source and target */
    vgi_tie *tie;
    size_t nties, nmarkers;     /* the first ones are the markers */
    vgi_similarity s;
    vgi_surface *source_surface, *target_surface, *fitted_surface;
    uint32_t *links;
    size_t nlinks;
    uint32_t *component;        /* per vertex of the source */
    bool *take, *take_vertex;   /* per face and per vertex of the source: whether its component takes part */
    bool flipped;
    double *x;
};

/* ---- the similarity ---- */

/* False if the points coincide or lie on one line: the covariance needs a second non-zero eigenvalue. */
static bool spread_out(const double *x, size_t n)
{
    double centre[3], S[9] = {0};
    vg_centroid(x, n, centre);
    for (size_t i = 0; i < n; i++) {
        double d[3] = {x[3 * i] - centre[0], x[3 * i + 1] - centre[1], x[3 * i + 2] - centre[2]};
        vgi_add_outer(S, 1, d, d);
    }
    double trace = S[0] + S[4] + S[8];
    double minors = S[0] * S[4] - S[1] * S[3] + S[0] * S[8] - S[2] * S[6] + S[4] * S[8] - S[5] * S[7];
    return minors > 1e-8 * trace * trace;
}

/* Reweight pairs: the weight decreases for residuals much larger than most (Geman and McClure). */
static int robust_similarity(vgi_similarity *s, const double *from, const double *to, size_t n, vg_err *e)
{
    double *weight = vgi_array(n, sizeof *weight, e), *miss = vgi_array(n, sizeof *miss, e),
           *room = vgi_array(n, sizeof *room, e);
    if (!weight || !miss || !room) return free(weight), free(miss), free(room), VG_ENOMEM;
    for (size_t i = 0; i < n; i++) weight[i] = 1;
    for (int round = 0; round < ROBUST_ROUNDS; round++) {
        vgi_similarity_fit(s, from, to, weight, n);
        for (size_t i = 0; i < n; i++) {
            double y[3];
            vgi_similarity_apply(s, from + 3 * i, y);
            miss[i] = sqrt(vgi_square(y, to + 3 * i));
        }
        double c = 3 * vgi_median(memcpy(room, miss, n * sizeof *room), n) + 1e-12;
        for (size_t i = 0; i < n; i++) {
            double x = miss[i] / c;
            weight[i] = 1 / ((1 + x * x) * (1 + x * x));
        }
    }
    free(weight);
    free(miss);
    free(room);
    return VG_OK;
}

/* ---- ties ---- */

static void add_marker_ties(struct registration *g)
{
    const vg_markers *m = g->in->markers;
    for (size_t i = 0; m && i < m->n; i++) {
        vgi_tie *t = &g->tie[g->nties++];
        *t = (vgi_tie){{m->at[i].source, m->at[i].source, m->at[i].source}, {1, 0, 0}, {0}, 1};
        memcpy(t->point, g->target + 3 * (size_t)m->at[i].target, sizeof t->point);
    }
    g->nmarkers = g->nties;
}

static void add_seed_ties(struct registration *g)
{
    const vg_register_input *in = g->in;
    for (size_t i = 0; i < in->nseeds; i++) {
        const vg_seed *s = &in->seeds[i];
        vgi_tie *t = &g->tie[g->nties++];
        *t = (vgi_tie){{s->vertex, s->vertex, s->vertex}, {1, 0, 0}, {0}, 1};
        if (in->seeds_of_source) {
            for (int a = 0; a < 3; a++) vgi_add_scaled(t->point, s->weight[a], g->target + 3 * (size_t)s->on[a]);
        } else {
            memcpy(t->vertex, s->on, sizeof t->vertex);
            memcpy(t->share, s->weight, sizeof t->share);
            memcpy(t->point, g->target + 3 * (size_t)s->vertex, sizeof t->point);
        }
    }
}

/* The texture coordinates as a planar mesh in which each corner is a separate vertex. */
static int texture_surface(vgi_surface **s, vg_mesh *flat, double **points, const vg_mesh *m, const vg_attributes *a,
                           vg_err *e)
{
    size_t corners = vg_mesh_corners(m);
    if (vg_mesh_copy(flat, m, e) < 0) return VG_ENOMEM;
    *points = vgi_array(corners, 3 * sizeof **points, e);
    if (!*points) return VG_ENOMEM;
    flat->nv = corners;
    for (size_t c = 0; c < corners; c++) {
        uint32_t t = a->corner_tex[c];
        flat->vert[c] = (uint32_t)c;
        for (size_t k = 0; k < 2; k++)
            (*points)[3 * c + k] = t == UINT32_MAX || k >= a->tex_dim ? 1e6 : a->tex[(size_t)t * a->tex_dim + k];
    }
    return vgi_surface_new(s, flat, *points, e);
}

/* The point of a target face with the same texture coordinates. It is exact for triangles; larger faces use the
 * affine map that fits the corners best. */
static bool lift(const vg_mesh *m, uint32_t face, const double *uv, const double *points, const double at[3],
                 double out[3])
{
    size_t begin = m->start[face], r = m->start[face + 1] - begin;
    double C[3] = {0}, P[3] = {0}, S[3] = {0}, T[6] = {0};
    for (size_t c = begin; c < begin + r; c++)
        for (size_t k = 0; k < 3; k++) {
            C[k] += uv[3 * c + k] / (double)r;
            P[k] += points[3 * (size_t)m->vert[c] + k] / (double)r;
        }
    for (size_t c = begin; c < begin + r; c++) {
        double u = uv[3 * c] - C[0], v = uv[3 * c + 1] - C[1], x[3];
        S[0] += u * u, S[1] += u * v, S[2] += v * v;
        vgi_subtract(points + 3 * (size_t)m->vert[c], P, x);
        vgi_add_scaled(T, u, x), vgi_add_scaled(T + 3, v, x);
    }
    double det = S[0] * S[2] - S[1] * S[1], u = at[0] - C[0], v = at[1] - C[1];
    if (!(det > 1e-9 * (S[0] + S[2]) * (S[0] + S[2]))) return false;
    double a = (S[2] * u - S[1] * v) / det, b = (S[0] * v - S[1] * u) / det;
    memcpy(out, P, sizeof P);
    vgi_add_scaled(out, a, T), vgi_add_scaled(out, b, T + 3);
    return true;
}

static void find_texture_ties(struct registration *g, const vgi_surface *texture, const double *uv, bool *done)
{
    const vg_mesh *m = g->in->source;
    const vg_attributes *a = g->in->source_uv;
    for (size_t c = 0; c < vg_mesh_corners(m); c++) {
        uint32_t v = m->vert[c], t = a->corner_tex[c];
        if (done[v] || t == UINT32_MAX) continue;
        double at[3] = {a->tex[(size_t)t * a->tex_dim], a->tex_dim > 1 ? a->tex[(size_t)t * a->tex_dim + 1] : 0, 0},
               point[3];
        vgi_hit hit;
        done[v] = true;
        if (!vgi_surface_nearest(texture, at, NULL, 0, 1e-3 * 1e-3, &hit)) continue;
        if (!lift(g->in->target, hit.face, uv, g->target, at, point)) continue;
        vgi_tie *tie = &g->tie[g->nties++];
        *tie = (vgi_tie){{v, v, v}, {1, 0, 0}, {point[0], point[1], point[2]}, 1};
        g->out->uv_pairs++;
    }
}

static int add_texture_ties(struct registration *g, vg_err *e)
{
    if (!g->in->source_uv) return VG_OK;
    vg_mesh flat = {0};
    double *uv = NULL;
    vgi_surface *texture = NULL;
    bool *done = vgi_array(g->in->source->nv, sizeof *done, e);
    int r = done ? texture_surface(&texture, &flat, &uv, g->in->target, g->in->target_uv, e) : VG_ENOMEM;
    if (r == VG_OK) find_texture_ties(g, texture, uv, done);
    vgi_surface_free(&texture);
    vg_mesh_clear(&flat);
    free(uv);
    free(done);
    return r;
}

static int make_ties(struct registration *g, vg_err *e)
{
    size_t most =
        (g->in->markers ? g->in->markers->n : 0) + g->in->nseeds + (g->in->source_uv ? g->in->source->nv : 0);
    g->tie = vgi_array(most, sizeof *g->tie, e);
    if (!g->tie) return VG_ENOMEM;
    add_marker_ties(g);
    add_seed_ties(g);
    return add_texture_ties(g, e);
}

static void tied_point(const vgi_tie *t, const double *x, double p[3])
{
    p[0] = p[1] = p[2] = 0;
    for (int a = 0; a < 3; a++) vgi_add_scaled(p, t->share[a], x + 3 * (size_t)t->vertex[a]);
}

/* ---- pairs inconsistent with the others */

/* residual[i]: difference between the displacement of tie i and that predicted by the nearest accepted ties. */
static void neighbour_residuals(const double *from, const double *way, const bool *out, size_t n, double *residual)
{
    for (size_t i = 0; i < n; i++) {
        size_t near[NEIGHBOURS], found = 0;
        double square[NEIGHBOURS];
        for (size_t j = 0; j < n; j++) {
            if (j == i || out[j]) continue;
            double d = vgi_square(from + 3 * i, from + 3 * j);
            size_t k = found < NEIGHBOURS ? found++ : d < square[NEIGHBOURS - 1] ? NEIGHBOURS - 1 : NEIGHBOURS;
            if (k == NEIGHBOURS) continue;
            for (; k > 0 && square[k - 1] > d; k--) square[k] = square[k - 1], near[k] = near[k - 1];
            square[k] = d, near[k] = j;
        }
        double sum = 0, mean[3] = {0};
        for (size_t k = 0; k < found; k++) {
            double w = 1 / (square[k] + 1e-6);
            sum += w;
            vgi_add_scaled(mean, w, way + 3 * near[k]);
        }
        if (found) vgi_divide(mean, sum);
        residual[i] = sqrt(vgi_square(mean, way + 3 * i));
    }
}

/* Remove the worst pair first, because it raises the residuals of its neighbours; then repeat. */
static int judge_markers(struct registration *g, vg_err *e)
{
    size_t n = g->nmarkers;
    vg_register_result *out = g->out;
    out->residual = vgi_array(n, sizeof *out->residual, e);
    out->left_out = vgi_array(n, sizeof *out->left_out, e);
    double *from = vgi_array(n, 3 * sizeof *from, e), *way = vgi_array(n, 3 * sizeof *way, e),
           *room = vgi_array(n, sizeof *room, e);
    int r = out->residual && out->left_out && from && way && room ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        memcpy(from + 3 * i, g->rest + 3 * (size_t)g->tie[i].vertex[0], 3 * sizeof *from);
        vgi_subtract(g->tie[i].point, from + 3 * i, way + 3 * i);
    }
    for (size_t left = 0; r == VG_OK && n > 0 && left <= n / 4; left++) {
        neighbour_residuals(from, way, out->left_out, n, out->residual);
        out->typical_residual = vgi_median(memcpy(room, out->residual, n * sizeof *room), n);
        size_t worst = n;
        for (size_t i = 0; i < n; i++)
            if (!out->left_out[i] && (worst == n || out->residual[i] > out->residual[worst])) worst = i;
        if (!(out->residual[worst] > WRONG_FAR && out->residual[worst] > WRONG_TIMES * out->typical_residual)) break;
        out->left_out[worst] = true;
    }
    for (size_t i = 0; i < n && r == VG_OK && !g->in->keep_all; i++)
        if (out->left_out[i]) g->tie[i].weight = 0;
    free(from);
    free(way);
    free(room);
    return r;
}

/* ---- the steps in order ---- */

static void to_units(const struct registration *g, const double *from, size_t n, double *to)
{
    for (size_t i = 0; i < n; i++) {
        vgi_subtract(from + 3 * i, g->centre, to + 3 * i);
        vgi_divide(to + 3 * i, g->unit);
    }
}

static int normalise(struct registration *g, vg_err *e)
{
    const vg_register_input *in = g->in;
    size_t ns = in->source->nv, nt = in->target->nv;
    g->source = vgi_array_raw(ns, 3 * sizeof *g->source, e);
    g->target = vgi_array_raw(nt, 3 * sizeof *g->target, e);
    g->rest = vgi_array_raw(ns, 3 * sizeof *g->rest, e);
    g->x = vgi_array_raw(ns, 3 * sizeof *g->x, e);
    if (!g->source || !g->target || !g->rest || !g->x) return VG_ENOMEM;
    g->unit = vg_diagonal(in->target_points, nt);
    if (!(g->unit > 0) || !(vg_diagonal(in->source_points, ns) > 0))
        return vg_fail(e, VG_EINPUT, "a mesh without extent cannot be registered");
    vg_centroid(in->target_points, nt, g->centre);
    to_units(g, in->target_points, nt, g->target);
    to_units(g, in->source_points, ns, g->source);
    return VG_OK;
}

static int align_meshes(struct registration *g, vg_err *e)
{
    g->s = (vgi_similarity){1, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}};
    int r = VG_OK;
    if (!g->in->aligned) {
        double *from = vgi_array(g->nties, 3 * sizeof *from, e), *to = vgi_array(g->nties, 3 * sizeof *to, e);
        r = from && to ? VG_OK : VG_ENOMEM;
        for (size_t i = 0; i < g->nties && r == VG_OK; i++) {
            tied_point(&g->tie[i], g->source, from + 3 * i);
            memcpy(to + 3 * i, g->tie[i].point, 3 * sizeof *to);
        }
        if (r == VG_OK && (g->nties < 3 || !spread_out(from, g->nties) || !spread_out(to, g->nties)))
            r = vg_fail(e, VG_EINPUT,
                         "%zu pairs do not determine the alignment: give at least three that are not collinear",
                         g->nties);
        if (r == VG_OK) r = robust_similarity(&g->s, from, to, g->nties, e);
        free(from);
        free(to);
    }
    for (size_t v = 0; v < g->in->source->nv && r == VG_OK; v++)
        vgi_similarity_apply(&g->s, g->source + 3 * v, g->rest + 3 * v);
    return r;
}

/* Decide whether the two meshes have opposite face orientation: at the ties, or over all faces if there are none. */
static void find_sides(struct registration *g)
{
    double votes = 0;
    const double *n = vgi_surface_normals(g->source_surface), *c = vgi_surface_centroids(g->source_surface);
    const vg_mesh *m = g->in->source;
    /* if memory is short, all faces vote: the result is the same but slower */
    bool *tied = g->nties ? calloc(m->nv + 1, sizeof *tied) : NULL;
    for (size_t i = 0; i < g->nties && tied; i++) tied[g->tie[i].vertex[0]] = g->tie[i].weight > 0;
    for (size_t f = 0; f < m->nf; f++) {
        bool asked = !tied;
        for (uint32_t k = m->start[f]; k < m->start[f + 1] && !asked; k++) asked = tied[m->vert[k]];
        vgi_hit hit;
        if (!asked || !vgi_surface_nearest(g->target_surface, c + 3 * f, NULL, 0, INFINITY, &hit)) continue;
        const double *o = vgi_surface_normals(g->target_surface) + 3 * (size_t)hit.face;
        votes += n[3 * f] * o[0] + n[3 * f + 1] * o[1] + n[3 * f + 2] * o[2];
    }
    g->flipped = votes < 0;
    free(tied);
}

static int fit_source(struct registration *g, void (*step)(void *, const vg_register_step *), void *context, vg_err *e)
{
    const vgi_fitting f = {.source = g->in->source,
                           .rest = g->rest,
                           .source_surface = g->source_surface,
                           .target_mesh = g->in->target,
                           .target_points = g->target,
                           .target = g->target_surface,
                           .flipped = g->flipped,
                           .take = g->take,
                           .take_vertex = g->take_vertex,
                           .links = g->links,
                           .nlinks = g->nlinks,
                           .tie = g->tie,
                           .nties = g->nties,
                           .threads = g->in->threads,
                           .step = step,
                           .context = context};
    return vgi_fit(&f, g->x, e);
}

/* ---- which components take part ---- */

static void spread_choice(struct registration *g)
{
    const vg_mesh *m = g->in->source;
    vgi_take_faces(m, g->component, g->out->taken, g->take);
    for (size_t v = 0; v < m->nv; v++) /* isolated vertices belong to no component */
        g->take_vertex[v] = g->component[v] < g->out->components && g->out->taken[g->component[v]];
}

/* Start with the components that the caller names, or those with ties; with all if there are none. */
static int begin_components(struct registration *g, vg_err *e)
{
    const vg_mesh *m = g->in->source;
    vg_register_result *out = g->out;
    g->component = vgi_array(m->nv, sizeof *g->component, e);
    g->take = vgi_array(m->nf, sizeof *g->take, e);
    g->take_vertex = vgi_array(m->nv, sizeof *g->take_vertex, e);
    int r = g->component && g->take && g->take_vertex ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) r = vg_mesh_components(m, g->component, &out->components, e);
    if (r == VG_OK && !(out->taken = vgi_array(out->components, sizeof *out->taken, e))) r = VG_ENOMEM;
    if (r < 0) return r;
    bool any = false;
    for (size_t i = 0; i < g->in->ncomponents; i++) {
        if (g->in->components[i] >= out->components)
            return vg_fail(e, VG_EINPUT, "the source has no component %u: it has %zu, counted from 0",
                           g->in->components[i], out->components);
        any = out->taken[g->in->components[i]] = true;
    }
    for (size_t i = 0; i < g->nties && !g->in->ncomponents && !g->in->all_components; i++)
        for (int a = 0; a < 3; a++)
            if (g->tie[i].weight > 0 && g->tie[i].share[a] > 0 &&
                g->component[g->tie[i].vertex[a]] < out->components)
                any = out->taken[g->component[g->tie[i].vertex[a]]] = true;
    for (size_t k = 0; k < out->components && !any; k++) out->taken[k] = true;
    spread_choice(g);
    return VG_OK;
}

static size_t count_taken(const vg_register_result *out)
{
    size_t n = 0;
    for (size_t k = 0; k < out->components; k++) n += out->taken[k];
    return n;
}

/* Fit the components that take part; if other components explain part of the target, fit again with them. */
static int fit_components(struct registration *g, void (*step)(void *, const vg_register_step *), void *context,
                           vg_err *e)
{
    int r = fit_source(g, step, context, e);
    size_t before = count_taken(g->out);
    if (r < 0 || before == g->out->components || g->in->ncomponents) return r;
    const vgi_component_choice c = {.source = g->in->source, .target = g->in->target, .points = g->x,
                                    .rest = g->rest,
                                    .target_surface = g->target_surface, .label = g->component,
                                    .n = g->out->components, .flipped = g->flipped, .threads = g->in->threads};
    r = vgi_choose_components(&c, g->out->taken, e);
    if (r < 0 || count_taken(g->out) == before) return r;
    spread_choice(g);
    return fit_source(g, step, context, e);
}

static int pair_faces(struct registration *g, vg_err *e)
{
    const vgi_pairing p = {.source = g->in->source, .target = g->in->target, .source_surface = g->fitted_surface,
                           .target_surface = g->target_surface, .take = g->take, .flipped = g->flipped,
                           .threads = g->in->threads};
    return vgi_pair(&p, &g->out->pairs, e);
}

/* Convert back to the target's units: x -> S((x - c) / D) D + c. */
static int hand_over(struct registration *g, vg_err *e)
{
    vg_register_result *out = g->out;
    size_t n = g->in->source->nv;
    out->fitted = vgi_array_raw(n, 3 * sizeof *out->fitted, e);
    if (!out->fitted) return VG_ENOMEM;
    for (size_t i = 0; i < n; i++)
        vgi_scaled(g->unit, g->x + 3 * i, out->fitted + 3 * i), vgi_add(out->fitted + 3 * i, g->centre);
    for (size_t f = 0; f < out->pairs.target_nf; f++) out->pairs.distance[f] *= g->unit;
    out->flipped = g->flipped;
    out->scale = g->s.scale;
    memcpy(out->rotation, g->s.rotation, sizeof out->rotation);
    double turned[3];
    vgi_multiply_vector(g->s.rotation, g->centre, turned);
    vgi_scaled(g->unit, g->s.shift, out->shift);
    vgi_add_scaled(out->shift, -g->s.scale, turned), vgi_add(out->shift, g->centre);
    return VG_OK;
}

static void clear_registration(struct registration *g)
{
    free(g->source);
    free(g->target);
    free(g->rest);
    free(g->tie);
    free(g->links);
    free(g->component);
    free(g->take);
    free(g->take_vertex);
    free(g->x);
    vgi_surface_free(&g->source_surface);
    vgi_surface_free(&g->target_surface);
    vgi_surface_free(&g->fitted_surface);
}

void vg_register_result_clear(vg_register_result *g)
{
    vg_correspondence_clear(&g->pairs);
    free(g->fitted);
    free(g->residual);
    free(g->left_out);
    free(g->taken);
    *g = (vg_register_result){0};
}

static int check_input(const vg_register_input *in, vg_err *e)
{
    for (size_t i = 0; in->markers && i < in->markers->n; i++) {
        const vg_marker *m = &in->markers->at[i];
        bool source = m->source >= in->source->nv;
        char which[80] = "";
        if (!source && m->target < in->target->nv) continue;
        if (m->name) snprintf(which, sizeof which, "marker '%.60s'", m->name);
        else snprintf(which, sizeof which, "the marker of line %zu", m->line);
        return vg_fail(e, VG_EINPUT, "%s names vertex %u, but the %s has %zu vertices", which,
                       source ? m->source : m->target, source ? "source" : "target",
                       source ? in->source->nv : in->target->nv);
    }
    for (size_t i = 0; i < in->nseeds; i++) {
        const vg_seed *s = &in->seeds[i];
        size_t own = in->seeds_of_source ? in->source->nv : in->target->nv;
        size_t other = in->seeds_of_source ? in->target->nv : in->source->nv;
        if (s->vertex >= own || s->on[0] >= other || s->on[1] >= other || s->on[2] >= other)
            return vg_fail(e, VG_EINPUT,
                           "the dense correspondence of vertex %u does not fit the meshes: are the two interchanged?",
                           s->vertex);
    }
    if (in->source->nf == 0 || in->target->nf == 0)
        return vg_fail(e, VG_EINPUT, "a mesh without faces cannot be registered");
    return VG_OK;
}

int vg_register(vg_register_result *out, const vg_register_input *in,
                void (*step)(void *context, const vg_register_step *step), void *context, vg_err *e)
{
    struct registration g = {.in = in, .out = out};
    *out = (vg_register_result){0};
    int r = check_input(in, e);
    if (r == VG_OK) r = normalise(&g, e);
    if (r == VG_OK) r = make_ties(&g, e);
    if (r == VG_OK) r = align_meshes(&g, e);
    if (r == VG_OK) r = judge_markers(&g, e);
    if (r == VG_OK) r = vg_link_components(in->source, g.rest, &g.links, &g.nlinks, e);
    if (r == VG_OK) r = vgi_surface_new(&g.target_surface, in->target, g.target, e);
    if (r == VG_OK) r = vgi_surface_new(&g.source_surface, in->source, g.rest, e);
    if (r == VG_OK) find_sides(&g);
    if (r == VG_OK) r = begin_components(&g, e);
    if (r == VG_OK) r = fit_components(&g, step, context, e);
    if (r == VG_OK) r = vgi_surface_of(&g.fitted_surface, in->source, g.x, g.take, e);
    if (r == VG_OK) r = pair_faces(&g, e);
    if (r == VG_OK) r = hand_over(&g, e);
    clear_registration(&g);
    if (r < 0) vg_register_result_clear(out);
    return r;
}
