/* feature_kernel.c: deformation gradients of vertex rings, their rotations and stretches, and the reconstruction from
 * them, for eight poses at once, in vectors as wide as the registers. Precomputation is in rings.c, the choice of
 * branches in branch.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/feature_kernel.h"
#include "numeric/vec3.h"
#include "numeric/wide_polar.h"

#include <stdlib.h>

VGI_INLINE vgi_wide_at *wide(vgi_lanes *p, int h)
{
    return (vgi_wide_at *)p + h;
}

VGI_INLINE const vgi_wide_at *wide_of(const vgi_lanes *p, int h)
{
    return (const vgi_wide_at *)p + h;
}

/* to += by * x, eight lanes */
VGI_INLINE void add_scaled(vgi_lanes *to, double by, const vgi_lanes *x)
{
    for (int h = 0; h < VGI_PARTS; h++) *wide(to, h) += by * *wide_of(x, h);
}
/* ---- measuring ---- */

VGI_INLINE void load_points(const vgi_rings *r, vgi_feature_block *b, const double *const *poses)
{
    for (size_t v = 0; v < r->nv; v++)
        for (int h = 0; h < VGI_PARTS; h++) {
            vgi_wide x[3];
            vgi_gather_point(poses + h * VGI_WIDTH, 3 * v, x);
            for (int k = 0; k < 3; k++) *wide(&b->point[v].xyz[k], h) = x[k];
        }
}

VGI_INLINE void add_normals(const vgi_rings *r, vgi_feature_block *b)
{
    memset(b->normal, 0, r->nv * sizeof *b->normal);
    for (size_t t = 0; t < r->ntriangles; t++) {
        const uint32_t *c = r->triangle + 3 * t;
        for (int h = 0; h < VGI_PARTS; h++) {
            vgi_wide u[3], v[3];
            for (int k = 0; k < 3; k++) {
                vgi_wide p = *wide(&b->point[c[0]].xyz[k], h);
                u[k] = *wide(&b->point[c[1]].xyz[k], h) - p, v[k] = *wide(&b->point[c[2]].xyz[k], h) - p;
            }
            for (int k = 0; k < 3; k++) {
                int l = k == 2 ? 0 : k + 1, m = k == 0 ? 2 : k - 1;
                vgi_wide n = u[l] * v[m] - u[m] * v[l];
                for (int j = 0; j < 3; j++) *wide(&b->normal[c[j]].xyz[k], h) += n;
            }
        }
    }
}

/* D of one vertex in vgi_wide poses */
VGI_INLINE void ring_gradient(const vgi_rings *r, vgi_feature_block *b, size_t v, int h, vgi_wide *d)
{
    vgi_wide p[3], n[3], n2 = {0};
    for (int k = 0; k < 3; k++) {
        p[k] = *wide(&b->point[v].xyz[k], h), n[k] = *wide(&b->normal[v].xyz[k], h);
        n2 += n[k] * n[k];
    }
    vgi_wide length = vgi_roots(n2);
    length = vgi_only(length > vgi_same(0), 1.0 / length);
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++) d[3 * k + j] = n[k] * length * r->across[3 * v + (size_t)j];
    for (uint32_t i = r->first[v]; i < r->first[v + 1]; i++) {
        const double *g = r->gradient + 3 * (size_t)i;
        vgi_row *to = &b->point[r->to[i]];
        for (int k = 0; k < 3; k++) {
            vgi_wide edge = p[k] - *wide(&to->xyz[k], h);
            for (int j = 0; j < 3; j++) d[3 * k + j] += edge * g[j];
        }
    }
}

/* d := x times the symmetric part of x' d, the part that features represent */
VGI_INLINE void symmetrise(const vgi_wide *x, vgi_wide *d)
{
    vgi_wide s[9];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) s[3 * i + k] = x[i] * d[k] + x[3 + i] * d[3 + k] + x[6 + i] * d[6 + k];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < i; k++) s[3 * i + k] = s[3 * k + i] = 0.5 * (s[3 * i + k] + s[3 * k + i]);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) d[3 * i + k] = x[3 * i] * s[k] + x[3 * i + 1] * s[3 + k] + x[3 * i + 2] * s[6 + k];
}

/* remaining rotations are rounding errors */
static const vgi_polar_stop stop = {.scaled = 3, .enough = 1e-15, .alone = true};

static void measure_poses(const vgi_rings *r, vgi_feature_block *b, const double *const *poses)
{
    load_points(r, b, poses);
    add_normals(r, b);
    for (size_t v = 0; v < r->nv; v++)
        for (int h = 0; h < VGI_PARTS; h++) {
            vgi_wide d[9], x[9];
            ring_gradient(r, b, v, h, d);
            vgi_wide_polar(d, x, stop);
            if (r->is_open[v]) {
                const double *open = r->open + 9 * v;
                for (int i = 0; i < 3; i++)
                    for (int k = 0; k < 3; k++)
                        for (int j = 0; j < 3; j++) d[3 * i + k] += x[3 * i + j] * open[3 * j + k];
            }
            symmetrise(x, d);
            for (size_t i = 0; i < 9; i++) {
                *wide(&b->gradient[9 * v + i], h) = d[i];
                *wide(&b->turn[9 * v + i], h) = x[i];
            }
        }
}

/* ---- reconstruction ---- */

/* x := sum over edges of weight / 2 (D_v + D_to) (r_v - r_to) */
VGI_INLINE void load_sides(const vgi_rings *r, vgi_feature_block *b)
{
    for (size_t v = 0; v < r->nv; v++) {
        if (r->part[v] < 0) continue;
        for (int h = 0; h < VGI_PARTS; h++) {
            const vgi_lanes *own = b->gradient + 9 * v;
            vgi_wide s[3] = {{0}, {0}, {0}};
            for (uint32_t i = r->first[v]; i < r->first[v + 1]; i++) {
                const vgi_lanes *other = b->gradient + 9 * (size_t)r->to[i];
                double share = 0.5 * r->weight[i];
                for (int k = 0; k < 3; k++)
                    for (int j = 0; j < 3; j++)
                        s[k] += (share * r->edge[3 * (size_t)i + (size_t)j]) *
                                (*wide_of(&own[3 * k + j], h) + *wide_of(&other[3 * k + j], h));
            }
            for (int k = 0; k < 3; k++) *wide(&b->x[r->row[v]].xyz[k], h) = s[k];
        }
    }
}

/* per part the mean of a row over its vertices */
static void part_means(const vgi_rings *r, const vgi_row *row, vgi_row *sum)
{
    memset(sum, 0, r->nparts * sizeof *sum);
    for (size_t v = 0; v < r->nv; v++)
        for (int k = 0; k < 3 && r->part[v] >= 0; k++) add_scaled(&sum[r->part[v]].xyz[k], 1, &row[v].xyz[k]);
    for (size_t p = 0; p < r->nparts; p++)
        for (int k = 0; k < 3; k++) add_scaled(&sum[p].xyz[k], 1 / (double)r->part_size[p] - 1, &sum[p].xyz[k]);
}

/* b->normal: the points that fit the gradients, with the centre of each part moved to 0 */
static void reconstruct(const vgi_rings *r, vgi_feature_block *b)
{
    vgi_factor_solve(&r->factor, b->x);
    for (size_t v = 0; v < r->nv; v++)
        if (r->part[v] >= 0) b->normal[v] = b->x[r->row[v]];
        else memset(&b->normal[v], 0, sizeof b->normal[v]);
}

/* ---- features out ---- */

/* the rotation vector of a rotation matrix, |w| <= pi */
static void log_rotation(const double m[9], double w[3])
{
    double q[4], l[4];
    vg_quat_from_matrix(m, q);
    if (q[0] < 0)
        for (int k = 0; k < 4; k++) q[k] = -q[k];
    double u = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    l[0] = u > 0 ? 2 * atan2(u, q[0]) / u : 0;
    for (int k = 0; k < 3; k++) w[k] = l[0] * q[k + 1];
}

static void put_turn(const vgi_feature_block *b, const vgi_lanes *turn, size_t lane, double w[3])
{
    const double *g = b->root[lane];
    double m[9];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            m[3 * i + k] = g[i] * turn[k][lane] + g[3 + i] * turn[3 + k][lane] + g[6 + i] * turn[6 + k][lane];
    log_rotation(m, w);
}

VGI_INLINE void put_vertex(const vgi_rings *r, const vgi_feature_block *b, size_t v, size_t width, double *const *values)
{
    static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    const vgi_lanes *t = b->turn + 9 * v, *d = b->gradient + 9 * v;
    vgi_lanes out[9];
    for (int i = 0; i < 6; i++) {
        int a = row[i], c = column[i];
        for (int h = 0; h < VGI_PARTS; h++) {
            vgi_wide one = {0}, other = {0};
            for (int j = 0; j < 3; j++) {
                one += *wide_of(&t[3 * j + a], h) * *wide_of(&d[3 * j + c], h);
                other += *wide_of(&t[3 * j + c], h) * *wide_of(&d[3 * j + a], h);
            }
            *wide(&out[i], h) = 0.5 * (one + other);
        }
    }
    for (int k = 0; k < 3 && width == VGI_TWELVE; k++)
        for (int h = 0; h < VGI_PARTS; h++) {
            vgi_wide s = {0};
            for (int j = 0; j < 3; j++)
                s += *wide_of(&t[3 * j + k], h) *
                     (*wide_of(&b->point[v].xyz[j], h) - *wide_of(&b->normal[v].xyz[j], h));
            *wide(&out[6 + k], h) = s;
        }
    for (size_t lane = 0; lane < VGI_LANES; lane++) {
        double *to = values[lane] + width * v;
        put_turn(b, t, lane, to);
        for (size_t i = 3; i < width; i++) to[i] = out[i - 3][lane];
    }
    (void)r;
}

/* A vertex without faces moves with the root: no rotation of its own, no stretch, and its position in the root's
 * frame. */
static void put_loose(const vgi_rings *r, const vgi_feature_block *b, size_t v, size_t width, size_t lane,
                      const double *pose, const double *rest_centre, const double *centre, double *values)
{
    double *to = values + width * v, far[3];
    for (size_t i = 0; i < width; i++) to[i] = i == 3 || i == 6 || i == 8;
    if (width == VGI_NINE) return;
    for (size_t k = 0; k < 3; k++) far[k] = pose[3 * v + k] - centre[k];
    for (size_t k = 0; k < 3; k++) {
        const double *g = b->root[lane];
        to[9 + k] = g[k] * far[0] + g[3 + k] * far[1] + g[6 + k] * far[2] - (r->reference[3 * v + k] - rest_centre[k]);
    }
}

static void rest_centre(const vgi_rings *r, double centre[3])
{
    centre[0] = centre[1] = centre[2] = 0;
    for (size_t v = 0; v < r->nv; v++)
        for (size_t k = 0; k < 3 && r->part[v] == (int)r->main_part; k++)
            centre[k] += r->reference[3 * v + k] / (double)r->part_size[r->main_part];
}

/* output the centroids; move points and reconstruction so that each part's centre is at 0 */
static void put_centroids(const vgi_rings *r, vgi_feature_block *b, bool both, double *const *centroids)
{
    part_means(r, b->point, b->sum);
    for (size_t p = 0; p < r->nparts; p++)
        for (size_t lane = 0; lane < VGI_LANES; lane++)
            for (size_t k = 0; k < 3; k++) centroids[lane][3 * p + k] = b->sum[p].xyz[k][lane];
    if (!both) return;
    for (int pass = 0; pass < 2; pass++) {
        vgi_row *row = pass ? b->normal : b->point;
        if (pass) part_means(r, row, b->sum);
        for (size_t v = 0; v < r->nv; v++)
            for (int k = 0; k < 3 && r->part[v] >= 0; k++) add_scaled(&row[v].xyz[k], -1, &b->sum[r->part[v]].xyz[k]);
    }
}

/* Directions that a ring does not determine rotate as the root does, so that features are invariant under rotation of
 * the pose. */
static const double leaning = 1e-3;

static void close_open_rings(const vgi_rings *r, vgi_feature_block *b)
{
    for (size_t v = 0; v < r->nv; v++)
        for (size_t lane = 0; r->is_open[v] && lane < VGI_LANES; lane++) {
            const double *open = r->open + 9 * v, *g = b->root[lane];
            double d[9], seen[9], back[9], turned[9];
            for (size_t i = 0; i < 9; i++) d[i] = b->gradient[9 * v + i][lane], back[i] = g[3 * (i % 3) + i / 3];
            vgi_multiply(d, open, seen);
            for (int i = 0; i < 9; i++) d[i] -= seen[i];
            vgi_multiply(back, d, turned);
            double size = sqrt(vgi_dot(d, d) + vgi_dot(d + 3, d + 3) + vgi_dot(d + 6, d + 6));
            for (int i = 0; i < 9; i += 4) turned[i] += leaning * size; /* pulls towards the rotation of the root */
            vgi_fit_rotation(turned, seen);
            vgi_multiply(g, seen, turned);
            vgi_multiply(turned, open, seen);
            vgi_wide all[9], whole[9];
            for (int i = 0; i < 9; i++) all[i] = vgi_same(turned[i]), whole[i] = vgi_same(d[i] + seen[i]);
            symmetrise(all, whole);
            for (size_t i = 0; i < 9; i++)
                b->gradient[9 * v + i][lane] = whole[i][0], b->turn[9 * v + i][lane] = turned[i];
        }
}

static void put_features(const vgi_rings *r, vgi_feature_block *b, size_t width, const double *const *poses,
                double *const *values, double *const *centroids)
{
    double rest[3];
    if (r->nopen) close_open_rings(r, b);
    if (width == VGI_TWELVE) {
        load_sides(r, b);
        reconstruct(r, b);
    }
    put_centroids(r, b, width == VGI_TWELVE, centroids);
    rest_centre(r, rest);
    for (size_t v = 0; v < r->nv; v++)
        if (r->part[v] >= 0) put_vertex(r, b, v, width, values);
        else
            for (size_t lane = 0; lane < VGI_LANES; lane++)
                put_loose(r, b, v, width, lane, poses[lane], rest, centroids[lane] + 3 * r->main_part, values[lane]);
}

/* ---- from features to poses ---- */

static void exp_rotation(const double w[3], double m[9])
{
    double angle = vgi_length(w), s = angle > 0 ? sin(angle) / angle : 1, half_sine = sin(angle / 2);
    double c = angle > 0 ? 2 * half_sine * half_sine / (angle * angle) : 0.5;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) m[3 * i + k] = c * w[i] * w[k];
    double diagonal = 1 - c * angle * angle;
    m[0] += diagonal, m[4] += diagonal, m[8] += diagonal;
    m[1] -= s * w[2], m[2] += s * w[1], m[3] += s * w[2];
    m[5] -= s * w[0], m[6] -= s * w[1], m[7] += s * w[0];
}

static void take_turn(const vgi_feature_block *b, const double w[3], size_t lane, vgi_lanes *turn)
{
    double m[9];
    exp_rotation(w, m);
    vgi_multiply(b->root[lane], m, m);
    for (size_t i = 0; i < 9; i++) turn[i][lane] = m[i];
}

/* D = R S of a vertex; the residual goes to b->point */
VGI_INLINE void take_vertex(vgi_feature_block *b, size_t v, size_t width, const double *const *values)
{
    static const int at[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
    vgi_lanes in[9], *t = b->turn + 9 * v, *d = b->gradient + 9 * v;
    memset(in, 0, sizeof in);
    for (size_t lane = 0; lane < VGI_LANES; lane++) {
        const double *from = values[lane] + width * v;
        take_turn(b, from, lane, t);
        for (size_t i = 3; i < width; i++) in[i - 3][lane] = from[i];
    }
    for (int h = 0; h < VGI_PARTS; h++)
        for (int i = 0; i < 3; i++) {
            vgi_wide left = {0};
            for (int k = 0; k < 3; k++) {
                vgi_wide s = {0};
                for (int j = 0; j < 3; j++) s += *wide_of(&t[3 * i + j], h) * *wide_of(&in[at[3 * j + k]], h);
                *wide(&d[3 * i + k], h) = s;
                left += *wide_of(&t[3 * i + k], h) * *wide_of(&in[6 + k], h);
            }
            *wide(&b->point[v].xyz[i], h) = left;
        }
}

static void place_vertex(const vgi_rings *r, const vgi_feature_block *b, const double rest[3], size_t lane,
                  const double *centroids, double *vertices)
{
    const double *root = centroids + 3 * r->main_part;
    for (size_t v = 0; v < r->nv; v++) {
        int part = r->part[v];
        double home[3] = {0, 0, 0}, turned[3];
        for (size_t k = 0; k < 3; k++) home[k] = r->reference[3 * v + k] - rest[k];
        if (part < 0) vgi_multiply_vector(b->root[lane], home, turned);
        for (size_t k = 0; k < 3; k++)
            vertices[3 * v + k] = part < 0 ? root[k] + turned[k] + b->point[v].xyz[k][lane]
                                           : centroids[3 * part + (int)k] + b->normal[v].xyz[k][lane] -
                                                 b->sum[part].xyz[k][lane];
    }
}

static void back(const vgi_rings *r, vgi_feature_block *b, size_t width, const double *const *values,
                 const double *const *centroids, double *const *vertices, size_t lanes)
{
    double rest[3];
    for (size_t v = 0; v < r->nv; v++) take_vertex(b, v, width, values);
    load_sides(r, b);
    reconstruct(r, b);
    for (size_t v = 0; v < r->nv; v++)
        for (int k = 0; k < 3; k++) add_scaled(&b->normal[v].xyz[k], 1, &b->point[v].xyz[k]);
    part_means(r, b->normal, b->sum);
    rest_centre(r, rest);
    for (size_t lane = 0; lane < lanes; lane++) place_vertex(r, b, rest, lane, centroids[lane], vertices[lane]);
}

const vgi_feature_kernel VGI_OF_SET(vgi_feature_kernel) = {measure_poses, put_features, back};
