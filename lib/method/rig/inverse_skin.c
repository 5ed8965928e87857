/* inverse_skin.c: inverse skinning: the motions of a rig's bones in poses given as vertices, and weights for such a
 * rig.
 *
 * With joints connected, linear blend skinning is linear in the rotations R_j of the bones: vertex v is at p + sum of
 * R_j q_vj, where p is the position of the first joint and q_vj comes from the weights and the reference pose. Summed
 * over all vertices the squared distance is the quadratic tr(R G R') - 2 tr(R B') in R = [R_1 R_2 ...]. G depends on
 * the rig alone; B takes one pass over the pose. The quadratic is minimised over rotations: first one bone at a time,
 * then all at once by damped Gauss-Newton steps.
 * Weights for known motions are fitted in skin.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/vec3.h"
#include "numeric/lapack.h"
#include "numeric/blas.h"
#include "numeric/polar.h"
#include "method/rig/learn.h"
#include "method/rig/skin.h"
#include "model/rig.h"

#include <math.h>
#include <stdlib.h>

enum { BLOCK = 8, SHARES = 8, SWEEPS = 8, STEPS = 30, FIRST_STEPS = 8 };
static const double FIRST_PRIOR = 1e-3,
                    LAST_PRIOR = 1e-10; /* weight of the pull of a bone towards its parent, relative to its vertices */

struct vg_inverse_skin {
    size_t nv, n; /* number of vertices, of bones */
    int threads;
    double least;     /* radians: smaller rotations count as zero */
    int steps;        /* most steps of each descent */
    uint32_t *parent; /* parent of each bone; parents come first */
    double *at;       /* 3 n: positions of the joints */
    double *offset;   /* 3 n: offset from the parent's joint */
    uint32_t *bone;   /* VG_SKIN per vertex */
    double *weight,
        *local;    /* per bone of a vertex: its weight; weight times the vertex relative to the joint, 3 numbers */
    double *g;     /* 3 n x 3 n */
    double *mean;  /* 3 n: mean of q */
    double *size;  /* n: trace of the diagonal blocks of g */
    double *own;   /* 4 n: sums of local and of the weight over a bone's own vertices */
    bool *carries; /* n: whether a bone or a descendant has vertices */
    double *space; /* BLOCK times the workspace */
};

/* Workspace of one pose. */
typedef struct working {
    double *r, *trial, *b; /* 9 n each: rotations, trial rotations, B */
    double *left;          /* 9 n: B - R G at the last evaluation of the objective */
    double *rows;          /* 18 n: R, and R G, as 3 x 3 n */
    double *sum, *step;    /* 3 n each */
    double *h;             /* (3 n)^2 */
} working;

static size_t space_of(size_t n)
{
    return 4 * 9 * n + 18 * n + 6 * n + 9 * n * n;
}

static working working_at(const vg_inverse_skin *x, size_t i)
{
    double *p = x->space + i * space_of(x->n);
    size_t n = x->n;
    return (working){p, p + 9 * n, p + 18 * n, p + 27 * n, p + 36 * n, p + 54 * n, p + 57 * n, p + 60 * n};
}

/* The q of vertex v, for the bones listed in `list`: 3 numbers each in q. */
static size_t vertex_row(const vg_inverse_skin *x, size_t v, uint32_t *list, double *q, bool *seen)
{
    size_t count = 0;
    for (size_t s = VG_SKIN * v; s < VG_SKIN * v + VG_SKIN; s++) {
        if (!(x->weight[s] > 0)) continue;
        const double *add = x->local + 3 * s;
        double w = 1;
        for (uint32_t j = x->bone[s], from = VGI_NO_BONE; j != VGI_NO_BONE; from = j, j = x->parent[j]) {
            if (from != VGI_NO_BONE) add = x->offset + 3 * (size_t)from, w = x->weight[s];
            if (!seen[j]) {
                seen[j] = true, list[count++] = j;
                q[3 * j] = q[3 * j + 1] = q[3 * j + 2] = 0;
            }
            vgi_add_scaled(q + 3 * j, w, add);
        }
    }
    for (size_t i = 0; i < count; i++) seen[list[i]] = false;
    return count;
}

/* The sums over one share of the vertices. Shares are fixed, so that the result does not depend on the number of
 * threads. */
typedef struct summing {
    const vg_inverse_skin *x;
    uint32_t *list; /* n per share, as are the others */
    bool *seen;
    double *q, *mean, *g; /* 3 n, 3 n, 3 n x 3 n: blocks with row >= column */
} summing;

static void sum_share(void *context, size_t share)
{
    const summing *s = context;
    const vg_inverse_skin *x = s->x;
    size_t n = x->n, width = 3 * n, last = (share + 1) * x->nv / SHARES;
    uint32_t *list = s->list + share * n;
    double *q = s->q + share * width, *mean = s->mean + share * width, *g = s->g + share * width * width;
    for (size_t v = share * x->nv / SHARES; v < last; v++) {
        size_t count = vertex_row(x, v, list, q, s->seen + share * n);
        for (size_t a = 0; a < count; a++) {
            const double *p = q + 3 * (size_t)list[a];
            vgi_add(mean + 3 * list[a], p);
            for (size_t b = 0; b < count; b++) {
                if (list[b] > list[a]) continue;
                const double *r = q + 3 * (size_t)list[b];
                double *to = g + 3 * list[a] * width + 3 * list[b];
                for (size_t k = 0; k < 3; k++, to += width)
                    to[0] += p[k] * r[0], to[1] += p[k] * r[1], to[2] += p[k] * r[2];
            }
        }
    }
}

static void finish_quadratic(vg_inverse_skin *x, const summing *s)
{
    size_t n = x->n, width = 3 * n;
    double count = (double)x->nv, largest = 0;
    for (size_t k = 0; k < SHARES; k++)
        for (size_t i = 0; i < width; i++) x->mean[i] += s->mean[k * width + i] / count;
    for (size_t i = 0; i < width; i++)
        for (size_t j = 0; j < 3 * (i / 3 + 1); j++) {
            double sum = 0;
            for (size_t k = 0; k < SHARES; k++) sum += s->g[(k * width + i) * width + j];
            x->g[i * width + j] = x->g[j * width + i] = sum / count - x->mean[i] * x->mean[j];
        }
    for (size_t j = 0; j < n; j++) {
        for (size_t k = 0; k < 3; k++) x->size[j] += x->g[(3 * j + k) * (width + 1)];
        if (x->size[j] > largest) largest = x->size[j];
    }
    for (size_t j = 0; j < n; j++) /* bones without vertices */
        if (!(x->size[j] > 1e-6 * largest)) x->size[j] = largest > 0 ? 1e-6 * largest : 1;
}

static int make_quadratic(vg_inverse_skin *x, vg_err *e)
{
    size_t n = x->n, width = 3 * n;
    summing s = {.x = x};
    s.list = vgi_array(SHARES * n, sizeof *s.list, e), s.seen = vgi_array(SHARES * n, sizeof *s.seen, e);
    s.q = vgi_array(SHARES * width, sizeof *s.q, e), s.mean = vgi_array(SHARES * width, sizeof *s.mean, e);
    s.g = vgi_array(SHARES * width, width * sizeof *s.g, e);
    bool ok = s.list && s.seen && s.q && s.mean && s.g;
    if (ok) {
        vgi_parallel(x->threads, SHARES, sum_share, &s);
        finish_quadratic(x, &s);
    }
    free(s.list);
    free(s.seen);
    free(s.q);
    free(s.mean);
    free(s.g);
    return ok ? VG_OK : VG_ENOMEM;
}

static int make_arrays(vg_inverse_skin *x, const vg_rig *g, vg_err *e)
{
    size_t n = x->n, nv = x->nv;
    x->parent = vgi_array(n, sizeof *x->parent, e);
    x->at = vgi_array(3 * n, sizeof *x->at, e), x->offset = vgi_array(3 * n, sizeof *x->offset, e);
    x->bone = vgi_copy_array(g->skin_bone, VG_SKIN * nv, sizeof *x->bone, e);
    x->weight = vgi_copy_array(g->skin_weight, VG_SKIN * nv, sizeof *x->weight, e);
    x->local = vgi_array(VG_SKIN * nv, 3 * sizeof *x->local, e);
    x->g = vgi_array(3 * n, 3 * n * sizeof *x->g, e), x->mean = vgi_array(3 * n, sizeof *x->mean, e);
    x->size = vgi_array(n, sizeof *x->size, e), x->own = vgi_array(4 * n, sizeof *x->own, e);
    x->carries = vgi_array(n, sizeof *x->carries, e);
    x->space = vgi_array(BLOCK, space_of(n) * sizeof *x->space, e);
    bool ok = x->parent && x->at && x->offset && x->bone && x->weight && x->local && x->g && x->mean && x->size &&
              x->own && x->carries && x->space;
    return ok ? VG_OK : VG_ENOMEM;
}

/* The reference pose of the bones, and the vertices relative to them. */
static void read_rest(vg_inverse_skin *x, const vg_rig *g, const double *reference)
{
    for (size_t b = 0; b < x->n; b++)
        for (size_t k = 0; k < 3; k++) {
            x->at[3 * b + k] = g->at[3 * (size_t)g->bone[b] + k];
            if (b) x->offset[3 * b + k] = x->at[3 * b + k] - x->at[3 * (size_t)x->parent[b] + k];
        }
    for (size_t s = 0; s < VG_SKIN * x->nv; s++) {
        double *own = x->own + 4 * (size_t)x->bone[s];
        for (size_t k = 0; k < 3; k++) {
            double away = reference[3 * (s / VG_SKIN) + k] - x->at[3 * (size_t)x->bone[s] + k];
            own[k] += x->local[3 * s + k] = x->weight[s] * away;
        }
        own[3] += x->weight[s];
    }
    for (size_t b = x->n; b-- > 0;) {
        x->carries[b] = x->carries[b] || x->own[4 * b + 3] > 0;
        if (b && x->carries[b]) x->carries[x->parent[b]] = true;
    }
}

int vg_inverse_skin_new(vg_inverse_skin **out, const vg_rig *g, size_t nv, const double *reference, int threads, vg_err *e)
{
    *out = NULL;
    if (!g->nbones || !g->skin_bone) return vg_fail(e, VG_EINPUT, "there is no rig with weights");
    vg_inverse_skin *x = *out = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->n = g->nbones, x->nv = nv, x->threads = threads, x->least = 1e-7, x->steps = STEPS;
    int r = make_arrays(x, g, e);
    if (r == VG_OK) r = vgi_rig_parents(g, x->parent, e);
    if (r == VG_OK) {
        read_rest(x, g, reference);
        r = make_quadratic(x, e);
    }
    if (r < 0) vg_inverse_skin_free(out);
    return r;
}

void vg_inverse_skin_free(vg_inverse_skin **out)
{
    vg_inverse_skin *x = *out;
    if (!x) return;
    free(x->parent);
    free(x->at);
    free(x->offset);
    free(x->bone);
    free(x->weight);
    free(x->local);
    free(x->g);
    free(x->mean);
    free(x->size);
    free(x->own);
    free(x->carries);
    free(x->space);
    free(x);
    *out = NULL;
}

/* B of a pose relative to its centroid, 3 x 3 per bone: first from its own vertices, then including its
 * descendants. */
static void load_pose(const vg_inverse_skin *x, const double *pose, const double centre[3], working *w)
{
    size_t n = x->n;
    memset(w->b, 0, 9 * n * sizeof *w->b);
    memset(w->sum, 0, 3 * n * sizeof *w->sum);
    for (size_t s = 0; s < VG_SKIN * x->nv; s++) {
        if (!(x->weight[s] > 0)) continue;
        const double *y = pose + 3 * (s / VG_SKIN), *q = x->local + 3 * s;
        double *b = w->b + 9 * (size_t)x->bone[s], *sum = w->sum + 3 * (size_t)x->bone[s];
        for (int c = 0; c < 3; c++) {
            double d = (y[c] - centre[c]) / (double)x->nv;
            sum[c] += x->weight[s] * d;
            vgi_add_scaled(b + 3 * c, d, q);
        }
    }
}

static void carry(const vg_inverse_skin *x, working *w)
{
    for (size_t j = x->n; j-- > 1;) {
        size_t up = x->parent[j];
        for (size_t c = 0; c < 3; c++) {
            w->sum[3 * up + c] += w->sum[3 * j + c];
            vgi_add_scaled(w->b + 9 * up + 3 * c, w->sum[3 * j + c], x->offset + 3 * j);
        }
    }
}

/* m = B_j - sum over i != j of R_i G_ij */
static void left_for(const vg_inverse_skin *x, const working *w, size_t j, double m[9])
{
    size_t width = 3 * x->n;
    memcpy(m, w->b + 9 * j, 9 * sizeof *m);
    for (size_t i = 0; i < x->n; i++) {
        if (i == j) continue;
        const double *a = w->r + 9 * i, *g = x->g + 3 * i * width + 3 * j;
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                m[3 * c + k] -=
                    a[3 * c] * g[k] + a[3 * c + 1] * g[width + (size_t)k] + a[3 * c + 2] * g[2 * width + (size_t)k];
    }
}

/* left = B - R G for all bones, with one product. */
static void find_left(const vg_inverse_skin *x, working *w, const double *g)
{
    size_t width = 3 * x->n;
    double *rg = w->rows + 3 * width;
    for (size_t j = 0; j < x->n; j++)
        for (size_t c = 0; c < 3; c++) memcpy(w->rows + c * width + 3 * j, g + 9 * j + 3 * c, 3 * sizeof *g);
    vgi_product_double(3, width, width, w->rows, width, x->g, width, rg, width);
    for (size_t j = 0; j < x->n; j++)
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < 3; k++)
                w->left[9 * j + 3 * c + k] = w->b[9 * j + 3 * c + k] - rg[c * width + 3 * j + k];
}

/* Returns the objective; leaves B - R G in w->left. */
static double objective(const vg_inverse_skin *x, working *w, const double *r, double prior)
{
    double f = 0;
    find_left(x, w, r);
    for (size_t j = 0; j < x->n; j++) {
        for (size_t i = 9 * j; i < 9 * j + 9; i++) f -= 0.5 * r[i] * (w->left[i] + w->b[i]);
        for (size_t i = 0; j && i < 9; i++) {
            double d = r[9 * j + i] - r[9 * (size_t)x->parent[j] + i];
            f += 0.5 * prior * x->size[j] * d * d;
        }
    }
    return f;
}

/* m += prior * (rotations of parent and children) */
static void add_prior(const vg_inverse_skin *x, const double *r, size_t j, double prior, double m[9])
{
    for (size_t i = 0; i < 9; i++) {
        if (j) m[i] += prior * x->size[j] * r[9 * (size_t)x->parent[j] + i];
        for (size_t c = j + 1; c < x->n; c++)
            if (x->parent[c] == j) m[i] += prior * x->size[c] * r[9 * c + i];
    }
}

/* The same for all bones: left += prior * (rotations of parents and children). */
static void add_priors(const vg_inverse_skin *x, const double *r, double prior, double *left)
{
    for (size_t j = 1; j < x->n; j++) {
        size_t up = 9 * (size_t)x->parent[j];
        for (size_t i = 0; i < 9; i++) {
            left[9 * j + i] += prior * x->size[j] * r[up + i];
            left[up + i] += prior * x->size[j] * r[9 * j + i];
        }
    }
}

static void sweep_bones(const vg_inverse_skin *x, working *w, double prior)
{
    for (size_t j = 0; j < x->n; j++) {
        double m[9];
        left_for(x, w, j, m);
        add_prior(x, w->r, j, prior, m);
        vgi_fit_rotation(m, w->r + 9 * j);
    }
}

static void multiply_back(const double a[9], const double b[9], double ab[9]) /* a b' */
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            ab[3 * i + k] = a[3 * i] * b[3 * k] + a[3 * i + 1] * b[3 * k + 1] + a[3 * i + 2] * b[3 * k + 2];
}

/* Rows of bone i of the Gauss-Newton matrix, up to the diagonal. */
static void make_rows(const vg_inverse_skin *x, working *w, size_t i)
{
    size_t width = 3 * x->n;
    double *h = w->h + 3 * i * width;
    for (size_t j = 0; j <= i; j++) {
        const double *g = x->g + 3 * i * width + 3 * j;
        const double block[9] = {g[0],     g[1],         g[2],         g[width],        g[width + 1],
                                 g[width + 2], g[2 * width], g[2 * width + 1], g[2 * width + 2]};
        double t[9], s[9], trace;
        vgi_multiply(w->r + 9 * i, block, t);
        multiply_back(t, w->r + 9 * j, s);
        trace = s[0] + s[4] + s[8];
        for (size_t k = 0; k < 3; k++)
            for (size_t l = 0; l < 3; l++) h[k * width + 3 * j + l] = (k == l ? trace : 0) - s[3 * l + k];
    }
}

/* The Gauss-Newton system in small rotations of all bones: the lower triangle of h, and the right-hand side from B -
 * R G at r. */
static void make_system(const vg_inverse_skin *x, working *w, double prior, double damping)
{
    size_t n = x->n, width = 3 * n;
    add_priors(x, w->r, prior, w->left);
    for (size_t i = 0; i < n; i++) {
        double t[9];
        make_rows(x, w, i);
        multiply_back(w->r + 9 * i, w->left + 9 * i, t);
        w->step[3 * i] = t[5] - t[7], w->step[3 * i + 1] = t[6] - t[2], w->step[3 * i + 2] = t[1] - t[3];
    }
    for (size_t i = 0; i < n; i++) {
        double pull = i ? 2 * prior * x->size[i] : 0;
        for (size_t k = 0; k < 3; k++) {
            w->h[(3 * i + k) * (width + 1)] += pull + (damping + 1e-15) * x->size[i];
            if (!i) continue;
            size_t up = 3 * (size_t)x->parent[i] + k;
            w->h[up * (width + 1)] += pull;
            w->h[(3 * i + k) * width + up] -= pull;
        }
    }
}

/* trial = exp(step) r; returns the largest rotation */
static double turn_bones(const vg_inverse_skin *x, working *w)
{
    double most = 0;
    for (size_t j = 0; j < x->n; j++) {
        const double *s = w->step + 3 * j, half[4] = {0, 0.5 * s[0], 0.5 * s[1], 0.5 * s[2]};
        double q[4], m[9];
        vg_quat_exp(half, q);
        vg_quat_matrix(q, m);
        vgi_multiply(m, w->r + 9 * j, w->trial + 9 * j);
        most = fmax(most, sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]));
    }
    return most;
}

static void descend_pose(const vg_inverse_skin *x, working *w, double prior)
{
    static const double noise = 1e-16; /* relative rounding error of the objective */
    double damping = 1e-6, f = objective(x, w, w->r, prior), turn = 1;
    bool moved = true; /* w->left belongs to w->r */
    for (int step = 0; step < x->steps && turn > x->least && damping < 1e6; step++) {
        if (!moved) find_left(x, w, w->r);
        moved = false;
        make_system(x, w, prior, damping);
        if (!vgi_spd_factor(3 * x->n, w->h)) {
            damping = 10 * damping + 1e-9;
            continue;
        }
        vgi_spd_solve(3 * x->n, w->h, 1, w->step);
        turn = turn_bones(x, w);
        double now = objective(x, w, w->trial, prior), gain = f - now;
        if (gain < -noise * fabs(f)) {
            damping = 10 * damping + 1e-9;
            continue;
        }
        memcpy(w->r, w->trial, 9 * x->n * sizeof *w->r);
        f = now, damping *= 0.1, moved = true;
        if (gain < noise * fabs(f))
            break; /* the last step above rounding error */
    }
    for (size_t j = 0; j < x->n; j++) { /* rounding error of the products */
        double m[9];
        memcpy(m, w->r + 9 * j, sizeof m);
        vgi_fit_rotation(m, w->r + 9 * j);
    }
}

typedef struct fitting {
    const vg_inverse_skin *x;
    const double *const *poses;
    double *const *transforms;
    double *rotations; /* NULL, or 9 n per pose: initial and final rotations */
    bool begun;        /* rotations hold initial values */
} fitting;

/* Start with each bone alone, about the centroid of its own vertices. A bone without vertices takes its parent's
 * rotation. */
static void start_alone(const vg_inverse_skin *x, working *w, size_t j)
{
    const double *own = x->own + 4 * j, *sum = w->sum + 3 * j;
    double m[9];
    if (!(own[3] > 0) && j) {
        memcpy(w->r + 9 * j, w->r + 9 * (size_t)x->parent[j], 9 * sizeof *w->r);
        return;
    }
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < 3; k++)
            m[3 * c + k] = w->b[9 * j + 3 * c + k] - (own[3] > 0 ? sum[c] * own[k] / own[3] : 0);
    vgi_fit_rotation(m, w->r + 9 * j);
}

static void fit_pose(void *context, size_t k)
{
    const fitting *f = context;
    const vg_inverse_skin *x = f->x;
    working w = working_at(x, k);
    double centre[3], root[3];
    vg_centroid(f->poses[k], x->nv, centre);
    load_pose(x, f->poses[k], centre, &w);
    if (f->begun) {
        memcpy(w.r, f->rotations + 9 * x->n * k, 9 * x->n * sizeof *w.r);
        carry(x, &w);
    } else {
        for (size_t j = 0; j < x->n; j++) start_alone(x, &w, j);
        carry(x, &w);
        for (int i = 0; i < SWEEPS; i++) sweep_bones(x, &w, FIRST_PRIOR);
        descend_pose(x, &w, FIRST_PRIOR);
    }
    descend_pose(x, &w, LAST_PRIOR);
    if (f->rotations) memcpy(f->rotations + 9 * x->n * k, w.r, 9 * x->n * sizeof *w.r);
    for (size_t j = 1; j < x->n; j++)
        if (!x->carries[j]) memcpy(w.r + 9 * j, w.r + 9 * (size_t)x->parent[j], 9 * sizeof *w.r);
    memcpy(root, centre, sizeof root);
    for (size_t j = 0; j < x->n; j++)
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < 3; i++) root[c] -= w.r[9 * j + 3 * c + i] * x->mean[3 * j + i];
    for (size_t j = 0; j < x->n; j++) {
        double *p = w.sum + 3 * j, *to = f->transforms[k] + 7 * j;
        const double *o = x->offset + 3 * j, *above = w.r + 9 * (size_t)(j ? x->parent[j] : 0), *r = w.r + 9 * j;
        const double *from = j ? w.sum + 3 * (size_t)x->parent[j] : root;
        vg_quat_from_matrix(r, to);
        for (size_t c = 0; c < 3; c++) {
            p[c] = from[c] + above[3 * c] * o[0] + above[3 * c + 1] * o[1] + above[3 * c + 2] * o[2];
            to[4 + c] =
                p[c] - (r[3 * c] * x->at[3 * j] + r[3 * c + 1] * x->at[3 * j + 1] + r[3 * c + 2] * x->at[3 * j + 2]);
        }
    }
}

/* rotations, begun: see fitting. */
static void fit_poses(const vg_inverse_skin *x, size_t n, const double *const *poses, double *const *transforms,
                      double *rotations, bool begun)
{
    vgi_blas_alone();
    for (size_t first = 0; first < n; first += BLOCK) {
        fitting f = {x, poses + first, transforms + first, rotations ? rotations + 9 * x->n * first : NULL, begun};
        vgi_parallel(x->threads, n - first < BLOCK ? n - first : BLOCK, fit_pose, &f);
    }
    vgi_blas_shared();
}

void vg_inverse_skin_fit(vg_inverse_skin *x, size_t n, const double *const *poses, double *const *transforms)
{
    fit_poses(x, n, poses, transforms, NULL, false);
}

/* ---- weights without motions ---- */

typedef struct turning {
    double *rotations; /* of all poses */
    double least;
    int steps;
} turning;

static int find_motions(vgi_learning *l, void *context, bool begun, vg_err *e)
{
    turning *t = context;
    vg_inverse_skin *x = NULL;
    int r = vg_inverse_skin_new(&x, &l->rig, l->nv, l->reference, l->threads, e);
    if (r == VG_OK) {
        x->least = t->least, x->steps = begun ? t->steps : FIRST_STEPS;
        fit_poses(x, l->n, (const double *const *)l->poses, l->transforms, t->rotations, begun);
    }
    vg_inverse_skin_free(&x);
    return r;
}

/* First approximately on a subset of the vertices, then exactly on all of them. */
static int learn_skin(vgi_learning *l, const vg_rig *rig, size_t nv, const double *reference, size_t n,
                 const double *const *poses, double *rotations, double *miss, vg_err *e)
{
    enum { SOME = 4096 };
    turning rough = {rotations, 1e-4, 2}, fine = {rotations, 1e-5, 8};
    l->rig = *rig, l->rig.skin_bone = NULL, l->rig.skin_weight = NULL;
    int r = vgi_learning_gather(l, nv, reference, n, poses, SOME, e);
    if (r == VG_OK) r = vgi_skin_near(&l->rig, l->nv, l->reference, e);
    if (r == VG_OK) r = vgi_learning_alternate(l, find_motions, &rough, false, miss, e);
    vgi_learning_clear(l);
    if (r == VG_OK) r = vgi_learning_gather(l, nv, reference, n, poses, nv, e);
    if (r == VG_OK) r = vgi_learning_weights(l, miss, e);
    if (r == VG_OK) r = vgi_learning_alternate(l, find_motions, &fine, true, miss, e);
    return r;
}

int vg_rig_learn(vg_rig *rig, size_t nv, const double *reference, size_t n, const double *const *poses, int threads,
                 double *miss, vg_err *e)
{
    size_t bones = rig->nbones;
    vgi_learning l = {.threads = threads};
    double *space = vgi_array(n, 7 * bones * sizeof *space, e), *rotations = vgi_array(n, 9 * bones * sizeof *space, e);
    l.transforms = vgi_array(n, sizeof *l.transforms, e);
    l.at = vgi_array(3 * bones, sizeof *l.at, e);
    int r = space && rotations && l.transforms && l.at ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < n; i++) l.transforms[i] = space + 7 * bones * i;
    for (size_t b = 0; r == VG_OK && b < bones; b++)
        memcpy(l.at + 3 * b, rig->at + 3 * (size_t)rig->bone[b], 3 * sizeof *l.at);
    if (r == VG_OK) r = learn_skin(&l, rig, nv, reference, n, poses, rotations, miss, e);
    if (r == VG_OK) vgi_learning_keep(&l, rig);
    vgi_learning_clear(&l);
    free(space);
    free(rotations);
    free(l.transforms);
    free(l.at);
    return r;
}
