/* spline_pose.c: the pose signal: a thin-plate spline from the plane to shape coordinates, by least squares over all
 * frames.
 *
 * The sites are frames. Coefficients of the radial functions must be orthogonal to linear functions at the sites
 * (otherwise the fit depends on the scale of the plane). So the function of a site beyond the anchors is phi(|s_j -
 * p|) - sum_a lambda_a(s_j) phi(|s_a - p|), lambda the barycentric coordinates with respect to the anchors. With the
 * lambda these span all functions of the sites. They are orthogonalised one by one on the frames, so that a fit with
 * fewer sites is the beginning of one with more. Positions are found in layout.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "signal/signal.h"
#include "signal/signal_kernel.h"

#include <math.h>
#include <stdlib.h>

static const double nearest = 1e-3;  /* least distance between sites while others are available */
static const double dependent = 1e-9; /* a function whose remainder is below this, relative to itself, depends on the
                                         others */

static double phi(double square)
{
    return square > 0 ? 0.5 * square * log(square) : 0;
}

static double square_between(const double a[2], const double b[2])
{
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

void vgi_plate_clear(vgi_plate *s)
{
    free(s->p);
    free(s->site);
    free(s->weight);
    free(s->anchor);
    free(s->q_room);
    free(s->r);
    free(s->column);
    *s = (vgi_plate){0};
}

enum { LINE = 64 / sizeof(double) }; /* numbers of a line of the cache */

/* Rows of zeros that begin at whole lines of the cache; *room is what is freed. */
static double *rows_of_lines(size_t rows, size_t stride, double **room, vg_err *e)
{
    size_t size;
    if (!vgi_mul(rows, stride, &size) || !(*room = vgi_array(size + LINE, sizeof **room, e))) return NULL;
    return *room + (LINE - (uintptr_t)*room / sizeof **room % LINE) % LINE;
}

static int start_plate(vgi_plate *s, size_t n, size_t most, const double *p, vg_err *e)
{
    *s = (vgi_plate){.n = n, .most = most, .stride = (n + LINE - 1) / LINE * LINE};
    if (!(s->p = vgi_array(n, 2 * sizeof *s->p, e)) || !(s->site = vgi_array(most, sizeof *s->site, e)) ||
        !(s->weight = vgi_array(most, 3 * sizeof *s->weight, e)) || !(s->anchor = vgi_array(n, 3 * sizeof(double), e)) ||
        !(s->q = rows_of_lines(most, s->stride, &s->q_room, e)) || !(s->r = vgi_array(most * most, sizeof *s->r, e)) || !(s->column = vgi_array(most, sizeof *s->column, e)))
        return VG_ENOMEM;
    s->scale = vgi_plane_radius(n, p, s->centre);
    if (!(s->scale > 0)) s->scale = 1;
    for (size_t i = 0; i < 2 * n; i++) s->p[i] = (p[i] - s->centre[i & 1]) / s->scale;
    return VG_OK;
}

/* ---- anchors: the first sites, far apart ---- */

static void barycentric(const vgi_plate *s, const double p[2], double lambda[3])
{
    for (int a = 0; a < 3; a++) lambda[a] = s->bary[3 * a] + s->bary[3 * a + 1] * p[0] + s->bary[3 * a + 2] * p[1];
}

/* Coordinate a is 1 at anchor a and 0 at the others. */
static void set_barycentric(vgi_plate *s)
{
    const double *a = s->p + 2 * s->site[0], *b = a, *c = a;
    double *m = s->bary;
    memset(m, 0, sizeof s->bary);
    if (s->anchors > 1) b = s->p + 2 * s->site[1];
    if (s->anchors > 2) c = s->p + 2 * s->site[2];
    double u[2] = {b[0] - a[0], b[1] - a[1]}, v[2] = {c[0] - a[0], c[1] - a[1]};
    if (s->anchors == 3) {
        double det = u[0] * v[1] - u[1] * v[0];
        m[4] = v[1] / det, m[5] = -v[0] / det;
        m[7] = -u[1] / det, m[8] = u[0] / det;
    } else if (s->anchors == 2) {
        double square = u[0] * u[0] + u[1] * u[1];
        m[4] = u[0] / square, m[5] = u[1] / square;
    }
    for (int k = 3; k < 9; k += 3) m[k] = -(m[k + 1] * a[0] + m[k + 2] * a[1]);
    m[0] = 1 - m[3] - m[6], m[1] = -m[4] - m[7], m[2] = -m[5] - m[8];
}

/* Among `among` (count frames): the one farthest from the origin, the one farthest from that, and the one that makes
 * the largest triangle. */
static void choose_anchors(vgi_plate *s, const uint32_t *among, size_t count)
{
    static const double origin[2] = {0, 0};
    const double *a = origin, *b = NULL;
    double most = -1;
    for (size_t i = 0; i < count; i++) {
        double far = square_between(s->p + 2 * among[i], origin);
        if (far > most) most = far, s->site[0] = among[i];
    }
    a = s->p + 2 * s->site[0];
    most = 0;
    for (size_t i = 0; i < count; i++) {
        double far = square_between(s->p + 2 * among[i], a);
        if (far > most) most = far, s->site[1] = among[i];
    }
    s->anchors = most > nearest * nearest ? 2 : 1;
    if (s->anchors < 2) return;
    b = s->p + 2 * s->site[1];
    double large = 1e-9 * most;
    for (size_t i = 0; i < count; i++) {
        const double *c = s->p + 2 * among[i];
        double area = fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        if (area > large) large = area, s->site[2] = among[i], s->anchors = 3;
    }
}

/* ---- functions, orthogonalised on the frames ---- */

static double norm(const double *v, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += v[i] * v[i];
    return sqrt(sum);
}

/* Orthogonalise and normalise the function in the next row of q, and count it. Returns false if its remainder,
 * relative to `size`, is negligible. */
static bool orthogonalise(vgi_plate *s, double size)
{
    size_t j = s->l, n = s->stride;
    double *v = s->q + j * n, *column = s->column;
    memset(column, 0, j * sizeof *column);
    for (int pass = 0; pass < 2; pass++) vgi_signal_kernel_now()->project(s->q, j, n, v, column);
    for (size_t i = 0; i < j; i++) s->r[i * s->most + j] = column[i];
    double left = norm(v, s->n);
    if (!(left > dependent * size)) return false;
    s->r[j * s->most + j] = left;
    for (size_t i = 0; i < s->n; i++) v[i] /= left;
    s->l = j + 1;
    return true;
}

static void add_anchors(vgi_plate *s)
{
    set_barycentric(s);
    for (size_t a = 0; a < s->anchors; a++) {
        double *v = s->q + a * s->stride, lambda[3];
        const double *at = s->p + 2 * s->site[a];
        for (size_t i = 0; i < s->n; i++) {
            barycentric(s, s->p + 2 * i, lambda);
            v[i] = lambda[a];
            s->anchor[a * s->n + i] = phi(square_between(s->p + 2 * i, at));
        }
        if (!orthogonalise(s, norm(v, s->n))) {
            s->anchors = a; /* cannot happen: they are 0 and 1 at the anchors themselves */
            return;
        }
    }
}

/* The function of a site on all frames. Returns the norm of its radial part. */
static double write_function(const vgi_plate *s, size_t site, double *v, double lambda[3])
{
    double sum = 0;
    barycentric(s, s->p + 2 * site, lambda);
    for (size_t i = 0; i < s->n; i++) {
        double f = phi(square_between(s->p + 2 * i, s->p + 2 * site));
        sum += f * f;
        for (size_t a = 0; a < s->anchors; a++) f -= lambda[a] * s->anchor[a * s->n + i];
        v[i] = f;
    }
    return sqrt(sum);
}

static bool near_others(const vgi_plate *s, size_t site, double apart)
{
    for (size_t j = 0; j < s->l; j++)
        if (square_between(s->p + 2 * site, s->p + 2 * s->site[j]) < apart * apart) return true;
    return false;
}

static bool add_site(vgi_plate *s, size_t site)
{
    if (s->l == s->most) return false;
    double *lambda = s->weight + 3 * s->l, size = write_function(s, site, s->q + s->l * s->stride, lambda);
    s->site[s->l] = (uint32_t)site;
    return orthogonalise(s, size);
}

static bool is_anchor(const vgi_plate *s, size_t site)
{
    for (size_t a = 0; a < s->anchors; a++)
        if (s->site[a] == site) return true;
    return false;
}

int vgi_plate_make(vgi_plate *s, size_t n, const double *p, const uint32_t *sites, size_t l, vg_err *e)
{
    if (start_plate(s, n, l < 3 ? 3 : l, p, e) < 0) {
        vgi_plate_clear(s);
        return VG_ENOMEM;
    }
    choose_anchors(s, sites, l);
    add_anchors(s);
    for (size_t j = 0; j < l; j++)
        if (!is_anchor(s, sites[j])) add_site(s, sites[j]);
    s->apart = s->l;
    return VG_OK;
}

/* ---- the order of all sites ---- */

enum { BLOCK = 32 }; /* functions that are projected out of the residual at a time */

typedef struct greedy {
    vgi_plate *s;
    size_t m;
    double *rest;    /* m x stride: residual, but for the last `waiting` functions */
    double *room;    /* the allocation that rest lies in */
    double *square;  /* n: squared residuals of the frames */
    double *product; /* m: rest times the last function */
    size_t waiting;
    double *block;   /* BLOCK x m: products of the waiting functions, negated */
    double *sum;     /* stride */
    bool *used;      /* n */
    double *left;    /* VGI_GAIN: n x stride: remainders of the functions of all frames; their products with rest */
    double *match;   /* n x m */
    double *along;   /* n */
} greedy;

static void measure_rest(greedy *g)
{
    size_t n = g->s->n;
    memset(g->square, 0, n * sizeof *g->square);
    for (size_t c = 0; c < g->m; c++) {
        const double *row = g->rest + c * g->s->stride;
        for (size_t i = 0; i < n; i++) g->square[i] += row[i] * row[i];
    }
}

/* Subtract the projections on the waiting functions from rest. */
static void take_out_block(greedy *g)
{
    const vgi_plate *s = g->s;
    if (g->waiting && g->m)
        vgi_gemm_double(true, false, g->m, s->stride, g->waiting, g->block, g->m, s->q + (s->l - g->waiting) * s->stride,
                        s->stride, 1, g->rest, s->stride);
    g->waiting = 0;
    measure_rest(g);
}

/* Project function j, the last one, out: with v its values, w = rest v and t = rest' w, the squared residual of frame i
 * falls by 2 t_i v_i - v_i^2 w'w. rest itself is updated for a block of functions at a time: writing it for each one takes
 * twice the time. */
static void take_out(greedy *g, size_t j)
{
    const vgi_plate *s = g->s;
    const double *v = s->q + j * s->stride;
    double match[BLOCK], size = 0;
    vgi_signal_kernel_now()->through(s->stride, g->m, v, g->rest, g->product, g->sum);
    if (g->waiting && g->m) {
        vgi_product_double_transposed(1, g->waiting, g->m, g->product, g->m, g->block, g->m, match, g->waiting);
        vgi_product_add(1, s->stride, g->waiting, match, g->waiting, v - g->waiting * s->stride, s->stride, g->sum, s->stride);
    }
    for (size_t c = 0; c < g->m; c++) {
        size += g->product[c] * g->product[c];
        g->block[g->waiting * g->m + c] = -g->product[c];
    }
    for (size_t i = 0; i < s->n; i++)
        g->square[i] = fmax(0, g->square[i] - v[i] * (2 * g->sum[i] - v[i] * size));
    if (++g->waiting == BLOCK) take_out_block(g);
}

static size_t farthest(const greedy *g)
{
    size_t best = SIZE_MAX;
    for (size_t i = 0; i < g->s->n; i++)
        if (!g->used[i] && (best == SIZE_MAX || g->square[i] > g->square[best])) best = i;
    return best;
}

static size_t most_gain(const greedy *g)
{
    const vgi_plate *s = g->s;
    size_t n = s->n, m = g->m, best = SIZE_MAX;
    double most = -1;
    for (size_t i = 0; i < n; i++) {
        double match = 0, size = 0;
        if (g->used[i]) continue;
        for (size_t c = 0; c < m; c++) match += g->match[i * m + c] * g->match[i * m + c];
        for (size_t c = 0; c < n; c++) size += g->left[i * s->stride + c] * g->left[i * s->stride + c];
        double gain = size > 0 ? match / size : 0;
        if (gain > most) most = gain, best = i;
    }
    return best;
}

/* Remove the direction v from the remaining functions, and from their products with the residual. */
static void take_out_gain(greedy *g, const double *v)
{
    size_t n = g->s->n, m = g->m;
    for (size_t i = 0; i < n; i++) {
        double along = 0, *left = g->left + i * g->s->stride;
        for (size_t c = 0; c < n; c++) along += left[c] * v[c];
        for (size_t c = 0; c < n; c++) left[c] -= along * v[c];
        for (size_t c = 0; c < m; c++) g->match[i * m + c] -= along * g->product[c];
    }
}

static int start_gain(greedy *g, vg_err *e)
{
    size_t n = g->s->n, m = g->m, stride = g->s->stride;
    double lambda[3];
    take_out_block(g);
    if (!(g->left = vgi_array(n * stride, sizeof *g->left, e)) || !(g->match = vgi_array(n * m, sizeof *g->match, e)) ||
        !(g->along = vgi_array(n, sizeof *g->along, e)))
        return VG_ENOMEM;
    for (size_t i = 0; i < n; i++) write_function(g->s, i, g->left + i * stride, lambda);
    for (size_t i = 0; i < n; i++) {
        memset(g->along, 0, n * sizeof *g->along);
        vgi_signal_kernel_now()->project(g->s->q, g->s->l, stride, g->left + i * stride, g->along);
    }
    vgi_product_double_transposed(n, m, n, g->left, stride, g->rest, stride, g->match, m);
    return VG_OK;
}

/* Add one by one all sites that keep `apart` from those before and are independent of them. */
static void add_others(greedy *g, vgi_site_rule rule, double apart)
{
    vgi_plate *s = g->s;
    for (size_t next; (next = rule == VGI_GAIN ? most_gain(g) : farthest(g)) != SIZE_MAX;) {
        g->used[next] = true;
        if (near_others(s, next, apart) || !add_site(s, next)) continue;
        take_out(g, s->l - 1);
        if (rule == VGI_GAIN) take_out_gain(g, s->q + (s->l - 1) * s->stride);
    }
}

static int run_greedy(greedy *g, vgi_site_rule rule, vg_err *e)
{
    vgi_plate *s = g->s;
    size_t anchors = s->l;
    for (s->l = 0; s->l < anchors;) {
        g->used[s->site[s->l]] = true;
        take_out(g, s->l++);
    }
    if (rule == VGI_GAIN && start_gain(g, e) < 0) return VG_ENOMEM;
    add_others(g, rule, nearest);
    s->apart = s->l;
    memset(g->used, 0, s->n * sizeof *g->used);
    for (size_t j = 0; j < s->l; j++) g->used[s->site[j]] = true;
    add_others(g, rule, 0);
    return VG_OK;
}

static int start_greedy(greedy *g, const double *x, size_t stride, vg_err *e)
{
    const size_t n = g->s->n, m = g->m, width = g->s->stride;
    if (!(g->rest = rows_of_lines(m, width, &g->room, e)) || !(g->square = vgi_array(n, sizeof *g->square, e)) ||
        !(g->product = vgi_array(m, sizeof *g->product, e)) || !(g->block = vgi_array(BLOCK * m, sizeof *g->block, e)) ||
        !(g->sum = vgi_array(width, sizeof *g->sum, e)) || !(g->used = vgi_array(n, sizeof *g->used, e)))
        return VG_ENOMEM;
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < m; c++) g->rest[c * width + i] = x[i * stride + c];
    measure_rest(g);
    return VG_OK;
}

static void end_greedy(greedy *g)
{
    free(g->room);
    free(g->square);
    free(g->product);
    free(g->block);
    free(g->sum);
    free(g->used);
    free(g->left);
    free(g->match);
    free(g->along);
}

int vgi_plate_order(vgi_plate *s, size_t n, size_t m, const double *p, const double *x, size_t stride,
                    vgi_site_rule rule, vg_err *e)
{
    greedy g = {.s = s, .m = m};
    int r = start_plate(s, n, n < 3 ? 3 : n, p, e);
    uint32_t *all = vgi_array(n, sizeof *all, e);
    if (r == VG_OK) r = all ? start_greedy(&g, x, stride, e) : VG_ENOMEM;
    if (r == VG_OK) {
        for (size_t i = 0; i < n; i++) all[i] = (uint32_t)i;
        choose_anchors(s, all, n);
        add_anchors(s);
        r = run_greedy(&g, rule, e);
    }
    free(all);
    end_greedy(&g);
    if (r < 0) vgi_plate_clear(s);
    return r;
}

/* ---- the surface ---- */

void vgi_plate_fitted(const vgi_plate *s, size_t l, size_t m, const double *x, size_t stride, double *fitted,
                      double *room)
{
    vgi_product_double(l, m, s->n, s->q, s->stride, x, stride, room, m);
    vgi_product_transposed_double(s->n, m, l, s->q, s->stride, room, m, fitted, m);
}

void vgi_plate_solve(const vgi_plate *s, size_t l, size_t m, const double *x, size_t stride, double *coefficients)
{
    if (m) vgi_product_double(l, m, s->n, s->q, s->stride, x, stride, coefficients, m);
    for (size_t i = l; i-- > 0;) {
        double *row = coefficients + i * m;
        for (size_t k = i + 1; k < l; k++) {
            double f = s->r[i * s->most + k];
            for (size_t c = 0; c < m; c++) row[c] -= f * coefficients[k * m + c];
        }
        for (size_t c = 0; c < m; c++) row[c] /= s->r[i * s->most + i];
    }
}

void vgi_plate_functions(const vgi_plate *s, size_t l, const double p[2], double *functions)
{
    double at[2] = {(p[0] - s->centre[0]) / s->scale, (p[1] - s->centre[1]) / s->scale}, lambda[3], base[3];
    barycentric(s, at, lambda);
    for (size_t a = 0; a < s->anchors; a++) {
        functions[a] = lambda[a];
        base[a] = phi(square_between(at, s->p + 2 * s->site[a]));
    }
    for (size_t j = s->anchors; j < l; j++) {
        double f = phi(square_between(at, s->p + 2 * s->site[j]));
        for (size_t a = 0; a < s->anchors; a++) f -= s->weight[3 * j + a] * base[a];
        functions[j] = f;
    }
}
