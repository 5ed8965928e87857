/* skin.c: fits linear blend skinning to poses by least squares: at most four bones per vertex, with weights >= 0 that
 * sum to 1.
 *
 * For one vertex the squared distance over all poses is the quadratic w' G w - 2 b' w + c. Its coefficients are
 * products of the sums with the position of the vertex. Bones are added one by one, each time the one with the
 * largest gain, and then exchanged while that gains.
 * Motions of bones are fitted in inverse_skin.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/skin.h"
#include "model/rig.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { CHUNK = 64, MOST = 20, BEST = 14 }; /* candidate bones per vertex; of these, chosen by their fit alone */

/* A bone in the reference pose: line segments from its joint to its child joints. */
typedef struct bones {
    const vg_rig *r;
    size_t nsegments;
    uint32_t *of;   /* bone of each segment */
    double *from;   /* 3 numbers: where a segment begins */
    double *along;  /* 4: to its end, and 1 over its squared length, or 0 */
} bones;

static void clear_bones(bones *b)
{
    free(b->of);
    free(b->from);
    free(b->along);
}

static void add_segment(bones *b, uint32_t bone, const double from[3], const double to[3])
{
    size_t i = b->nsegments++;
    double *d = b->along + 4 * i, length;
    b->of[i] = bone;
    memcpy(b->from + 3 * i, from, 3 * sizeof *from);
    vgi_subtract(to, from, d);
    length = vgi_dot(d, d);
    d[3] = length > 0 ? 1 / length : 0;
}

static int make_bones(bones *b, const vg_rig *g, vg_err *e)
{
    size_t joints = g->skeleton.njoints;
    uint32_t *mover = vgi_array(joints, sizeof *mover, e);
    *b = (bones){.r = g};
    b->of = vgi_array(2 * joints, sizeof *b->of, e);
    b->from = vgi_array(2 * joints, 3 * sizeof *b->from, e), b->along = vgi_array(2 * joints, 4 * sizeof *b->along, e);
    if (!mover || !b->of || !b->from || !b->along) {
        free(mover);
        clear_bones(b);
        return VG_ENOMEM;
    }
    vgi_rig_movers(g, mover);
    for (size_t j = 0; j < joints; j++) { /* a segment from the parent, and a point at the joint */
        uint32_t parent = g->skeleton.joints[j].parent;
        for (int own = 0; own < 2; own++) {
            uint32_t from = own ? (uint32_t)j : parent, bone = from == UINT32_MAX ? UINT32_MAX : mover[from];
            if (bone == UINT32_MAX) continue;
            add_segment(b, bone, g->at + 3 * (size_t)from, g->at + 3 * j);
        }
    }
    free(mover);
    return VG_OK;
}

/* Squared distance of x from a segment: where it begins, and `along` as in bones. */
static double squared_distance(const double from[3], const double *along, const double x[3])
{
    double y[3];
    vgi_subtract(x, from, y);
    double t = vgi_dot(along, y) * along[3];
    vgi_add_scaled(y, -(t < 0 ? 0 : t > 1 ? 1 : t), along);
    return vgi_dot(y, y);
}

/* far (n): squared distance of a point from each bone */
static void distances(const bones *b, const double x[3], double *far)
{
    for (size_t j = 0; j < b->r->nbones; j++) far[j] = INFINITY;
    for (size_t i = 0; i < b->nsegments; i++) {
        double d = squared_distance(b->from + 3 * i, b->along + 4 * i, x), *to = &far[b->of[i]];
        if (d < *to) *to = d;
    }
}

static int make_skin(vg_rig *g, size_t nv, vg_err *e)
{
    free(g->skin_bone);
    free(g->skin_weight);
    g->skin_bone = vgi_array(nv, VG_SKIN * sizeof *g->skin_bone, e);
    g->skin_weight = vgi_array(nv, VG_SKIN * sizeof *g->skin_weight, e);
    return g->skin_bone && g->skin_weight ? VG_OK : VG_ENOMEM;
}

int vgi_skin_near(vg_rig *g, size_t nv, const double *reference, vg_err *e)
{
    bones b;
    int r = make_skin(g, nv, e);
    if (r < 0 || (r = make_bones(&b, g, e)) < 0) return r;
    double *far = vgi_array(g->nbones, sizeof *far, e);
    if (!far) r = VG_ENOMEM;
    for (size_t v = 0; v < nv && far; v++) {
        size_t best = 0;
        distances(&b, reference + 3 * v, far);
        for (size_t j = 1; j < g->nbones; j++)
            if (far[j] < far[best]) best = j;
        g->skin_bone[VG_SKIN * v] = (uint32_t)best, g->skin_weight[VG_SKIN * v] = 1;
    }
    free(far);
    clear_bones(&b);
    return r;
}

/* ---- the quadratic of one vertex ---- */

/* Up to four bones of a quadratic. */
typedef struct choice {
    size_t n;
    size_t at[VG_SKIN];
    double w[VG_SKIN], value;
} choice;

typedef struct quadratic {
    const struct skinning *x;
    const double *at; /* the vertex */
    size_t n;
    uint32_t bone[MOST];
    double g[MOST][MOST], b[MOST]; /* of g the diagonal, and the rows and columns that are known */
    bool known[MOST];
    double ridge; /* ridge on all weights except that of the last bone chosen */
} quadratic;

static void find_rows(quadratic *q, const choice *c);

/* Solve a x = b for a positive definite a, n <= 3. Returns false, and changes nothing, if a is nearly singular. */
static bool solve_definite(double a[3][3], double *b, size_t n, double scale)
{
    static const double least = 1e-11;
    double l[3] = {0}, d[3] = {1, 1, 1};
    for (size_t i = 0; i < n; i++) {
        double pivot = a[i][i];
        if (i > 0) l[i - 1] = a[i][0] / d[0], pivot -= l[i - 1] * a[i][0];
        if (i > 1) {
            double below = a[2][1] - l[0] * a[2][0];
            l[2] = below / d[1], pivot -= l[2] * below;
        }
        if (!(pivot > least * scale)) return false;
        d[i] = pivot;
    }
    if (n > 1) b[1] -= l[0] * b[0];
    if (n > 2) b[2] -= l[1] * b[0] + l[2] * b[1], b[2] /= d[2];
    if (n > 1) b[1] = b[1] / d[1] - (n > 2 ? l[2] * b[2] : 0);
    if (n > 0) b[0] = b[0] / d[0] - (n > 1 ? l[0] * b[1] : 0) - (n > 2 ? l[1] * b[2] : 0);
    return true;
}

/* Solve a x = b for n <= 3; if a is nearly singular, by elimination with the largest pivot. Unknowns without a pivot stay
 * 0. */
static void solve_small(double a[3][3], double *b, size_t n)
{
    bool used[3] = {false, false, false};
    size_t row_of[3];
    double scale = 0;
    for (size_t i = 0; i < n; i++) scale = fmax(scale, fabs(a[i][i]));
    if (solve_definite(a, b, n, scale)) return;
    for (size_t c = 0; c < n; c++) {
        size_t p = n;
        for (size_t i = 0; i < n; i++)
            if (!used[i] && (p == n || fabs(a[i][c]) > fabs(a[p][c]))) p = i;
        row_of[c] = p;
        if (!(fabs(a[p][c]) > 1e-14 * scale)) {
            row_of[c] = n;
            continue;
        }
        used[p] = true;
        for (size_t i = 0; i < n; i++) {
            if (i == p) continue;
            double f = a[i][c] / a[p][c];
            for (size_t j = c; j < n; j++) a[i][j] -= f * a[p][j];
            b[i] -= f * b[p];
        }
    }
    double x[3] = {0, 0, 0};
    for (size_t c = 0; c < n; c++)
        if (row_of[c] < n) x[c] = b[row_of[c]] / a[row_of[c]][c];
    memcpy(b, x, n * sizeof *b);
}

/* Compute the weights of the chosen bones, removing one by one those that would be negative, and the value of the
 * quadratic, but for its ridge. */
static void weigh_bones(const quadratic *q, choice *c)
{
    for (;;) {
        size_t n = c->n - 1, base = c->at[n];
        double a[3][3], w[VG_SKIN], right[VG_SKIN], sum = 0;
        for (size_t i = 0; i < n; i++) {
            size_t k = c->at[i];
            w[i] = right[i] = q->b[k] - q->b[base] - q->g[k][base] + q->g[base][base];
            for (size_t j = 0; j < n; j++) {
                size_t l = c->at[j];
                a[i][j] = q->g[k][l] - q->g[k][base] - q->g[base][l] + q->g[base][base] + (i == j ? q->ridge : 0);
            }
        }
        solve_small(a, w, n);
        c->value = q->g[base][base] - 2 * q->b[base];
        for (size_t i = 0; i < n; i++) sum += w[i], c->value -= w[i] * right[i];
        w[n] = 1 - sum;
        size_t worst = 0;
        for (size_t i = 1; i <= n; i++)
            if (w[i] < w[worst]) worst = i;
        if (w[worst] >= 0 || n == 0) {
            memcpy(c->w, w, (n + 1) * sizeof *w);
            break;
        }
        memmove(c->at + worst, c->at + worst + 1, (n - worst) * sizeof *c->at);
        c->n--;
    }
}

static bool has_bone(const choice *c, size_t k)
{
    for (size_t i = 0; i < c->n; i++)
        if (c->at[i] == k) return true;
    return false;
}

/* At most how much each bone can lower the quadratic, added to the chosen ones or in place of one. The quadratic is convex,
 * and at its minimum over the chosen bones its derivatives by their weights are alike: the derivative by another weight, at
 * most 1, relative to theirs, bounds what is gained. */
static void bound_gains(const quadratic *q, const choice *c, double *gain)
{
    double slope[MOST], level = 0;
    for (size_t k = 0; k < q->n; k++) {
        slope[k] = -2 * q->b[k];
        for (size_t i = 0; i < c->n; i++) slope[k] += 2 * c->w[i] * q->g[k][c->at[i]];
    }
    for (size_t i = 0; i < c->n; i++) level += c->w[i] * slope[c->at[i]];
    for (size_t k = 0; k < q->n; k++) gain[k] = has_bone(c, k) ? 0 : level - slope[k];
}

/* Add bone k to the best choice, or try it in place of each bone if there are four. */
static void try_bone(const quadratic *q, const choice *best, size_t k, choice *next)
{
    bool full = best->n == VG_SKIN;
    for (size_t out = 0; out < (full ? VG_SKIN : 1); out++) {
        choice c = *best;
        c.at[full ? out : c.n++] = k;
        weigh_bones(q, &c);
        if (c.value < next->value) *next = c;
    }
}

static void choose_bones(quadratic *q, double least_gain, choice *best)
{
    *best = (choice){.n = 1, .w = {1}};
    for (size_t k = 0; k < q->n; k++)
        if (q->g[k][k] - 2 * q->b[k] < q->g[best->at[0]][best->at[0]] - 2 * q->b[best->at[0]]) best->at[0] = k;
    weigh_bones(q, best);
    for (int round = 0; round < 2 * VG_SKIN; round++) { /* add or replace a bone */
        choice next = *best;
        double gain[MOST];
        find_rows(q, best);
        bound_gains(q, best, gain);
        for (;;) {
            size_t k = 0;
            for (size_t i = 1; i < q->n; i++)
                if (gain[i] > gain[k]) k = i;
            if (!(gain[k] > least_gain && gain[k] > best->value - next.value)) break;
            try_bone(q, best, k, &next);
            gain[k] = 0;
        }
        if (!(next.value < best->value - least_gain)) break;
        *best = next;
    }
}

/* Move the bone with the largest weight to the end. */
static void first_last(choice *c)
{
    size_t best = 0, last = c->n - 1;
    for (size_t i = 1; i < c->n; i++)
        if (c->w[i] > c->w[best]) best = i;
    size_t at = c->at[best];
    c->at[best] = c->at[last], c->at[last] = at;
}

typedef struct skinning {
    vg_rig *r;
    const vgi_rig_sums *s;
    const double *reference;
    const bones *b;
    uint32_t *mover; /* per joint */
    double *own;     /* 16 per bone: the block of the bone itself in the cross sums */
    double *space;   /* per chunk in progress: 3 n */
    double diagonal, *miss;
    size_t chunks;
} skinning;

/* p' c q for the point v relative to the joints a and b; c: 4 x 4, its rows `width` apart. */
static double block_product(const double *c, size_t width, const double a[3], const double b[3], const double v[3])
{
    const double p[4] = {v[0] - a[0], v[1] - a[1], v[2] - a[2], 1}, q[4] = {v[0] - b[0], v[1] - b[1], v[2] - b[2], 1};
    double sum = 0;
    for (size_t k = 0; k < 4; k++, c += width) sum += p[k] * (c[0] * q[0] + c[1] * q[1] + c[2] * q[2] + c[3] * q[3]);
    return sum;
}

/* One entry of G: the product of bones i and j at the point. */
static double bone_product(const skinning *x, size_t i, size_t j, const double *v)
{
    const double *a = x->s->at + 3 * i, *b = x->s->at + 3 * j;
    if (i == j) return block_product(x->own + 16 * i, 4, a, a, v);
    return block_product(x->s->cross + 16 * i * x->s->n + 4 * j, 4 * x->s->n, a, b, v);
}

/* The rows and columns of G for the bones of a choice. */
static void find_rows(quadratic *q, const choice *c)
{
    for (size_t k = 0; k < c->n; k++) {
        size_t i = c->at[k];
        if (q->known[i]) continue;
        q->known[i] = true;
        for (size_t j = 0; j < q->n; j++)
            if (j != i && !q->known[j])
                q->g[i][j] = q->g[j][i] = bone_product(q->x, q->bone[i > j ? i : j], q->bone[i > j ? j : i], q->at);
    }
}

static double pull_product(const skinning *x, size_t j, size_t v)
{
    const double *at = x->s->at + 3 * j, *p = x->reference + 3 * v, *y = x->s->pull + v * 4 * x->s->n + 4 * j;
    return (p[0] - at[0]) * y[0] + (p[1] - at[1]) * y[1] + (p[2] - at[2]) * y[2] + y[3];
}

static void take_up(quadratic *q, size_t bone)
{
    for (size_t i = 0; i < q->n; i++)
        if (q->bone[i] == bone) return;
    if (q->n < MOST) q->bone[q->n++] = (uint32_t)bone;
}

/* The bones that fit best alone, then the neighbours in the skeleton of the best two. */
static void find_candidates(const skinning *x, const double *alone, quadratic *q)
{
    const vg_rig *g = x->r;
    q->n = 0;
    for (size_t j = 0; j < g->nbones; j++) { /* the best so far, in order; among equal ones the first found comes
                                                first */
        size_t i = q->n;
        if (i == BEST && !(alone[j] < alone[q->bone[i - 1]])) continue;
        if (i < BEST) q->n++;
        else i--;
        for (; i > 0 && alone[j] < alone[q->bone[i - 1]]; i--) q->bone[i] = q->bone[i - 1];
        q->bone[i] = (uint32_t)j;
    }
    for (size_t i = 0; i < 2 && i < q->n; i++) {
        uint32_t parent = g->skeleton.joints[g->bone[q->bone[i]]].parent;
        if (parent != UINT32_MAX && x->mover[parent] != UINT32_MAX) take_up(q, x->mover[parent]);
        for (size_t j = 0; j < g->nbones; j++)
            if (g->skeleton.joints[g->bone[j]].parent == g->bone[q->bone[i]]) take_up(q, j);
    }
}

static void skin_vertex(const skinning *x, size_t v, double *far, double *alone)
{
    /* Least gain of a bone per pose: per squared distance from the vertex, and in D^2. A bone counts only if its
     * motion differs from the first bone's by at least `apart`, in D. */
    static const double nearness = 1e-8, least_gain = 1e-13, apart = 1e-5;
    const vgi_rig_sums *s = x->s;
    const double *p = x->reference + 3 * v;
    double poses = (double)s->poses;
    quadratic q = {.x = x, .at = p};
    choice c;
    distances(x->b, p, far);
    for (size_t j = 0; j < s->n; j++) alone[j] = bone_product(x, j, j, p) - 2 * pull_product(x, j, v) + nearness * poses * far[j];
    find_candidates(x, alone, &q);
    for (size_t i = 0; i < q.n; i++) {
        q.b[i] = pull_product(x, q.bone[i], v) - 0.5 * nearness * poses * far[q.bone[i]];
        q.g[i][i] = bone_product(x, q.bone[i], q.bone[i], p);
    }
    choose_bones(&q, least_gain * poses * x->diagonal * x->diagonal, &c);
    first_last(&c);
    for (size_t i = 0; i < q.n; i++) q.b[i] = pull_product(x, q.bone[i], v);
    q.ridge = poses * apart * apart * x->diagonal * x->diagonal;
    weigh_bones(&q, &c);
    uint32_t *bone = x->r->skin_bone + VG_SKIN * v;
    double *weight = x->r->skin_weight + VG_SKIN * v, left = s->square[v];
    for (size_t i = 0; i < VG_SKIN; i++) {
        size_t best = 0;
        bone[i] = 0, weight[i] = 0;
        for (size_t k = 1; k < c.n; k++)
            if (c.w[k] > c.w[best]) best = k;
        if (i >= c.n || !(c.w[best] > 0)) continue;
        bone[i] = q.bone[c.at[best]], weight[i] = c.w[best];
        c.w[best] = 0;
    }
    for (size_t i = 0; i < VG_SKIN; i++) {
        left -= 2 * weight[i] * pull_product(x, bone[i], v);
        for (size_t k = 0; k < VG_SKIN; k++)
            if (weight[i] > 0 && weight[k] > 0) left += weight[i] * weight[k] * bone_product(x, bone[i], bone[k], p);
    }
    if (x->miss) x->miss[v] = left > 0 ? sqrt(left / poses) : 0;
}

static void skin_chunk(void *context, size_t task)
{
    const skinning *x = context;
    double *far = x->space + task * 2 * x->s->n;
    size_t first = task * x->s->nv / x->chunks, last = (task + 1) * x->s->nv / x->chunks;
    for (size_t v = first; v < last; v++) skin_vertex(x, v, far, far + x->s->n);
}

int vgi_skin_fit(vg_rig *g, const vgi_rig_sums *s, const double *reference, int threads, double *miss, vg_err *e)
{
    bones b;
    int r = make_skin(g, s->nv, e);
    if (r < 0 || (r = make_bones(&b, g, e)) < 0) return r;
    skinning x = {.r = g,
                  .s = s,
                  .reference = reference,
                  .b = &b,
                  .diagonal = vg_diagonal(reference, s->nv),
                  .miss = miss,
                  .chunks = s->nv < CHUNK ? 1 : CHUNK};
    x.mover = vgi_array(g->skeleton.njoints, sizeof *x.mover, e);
    x.space = vgi_array(x.chunks, 2 * s->n * sizeof *x.space, e);
    x.own = vgi_array(s->n, 16 * sizeof *x.own, e);
    if (x.mover && x.space && x.own) {
        vgi_rig_movers(g, x.mover);
        for (size_t i = 0; i < 16 * s->n; i++) x.own[i] = s->cross[(4 * (i / 16) + i % 16 / 4) * 4 * s->n + 4 * (i / 16) + i % 4];
        vgi_parallel(threads, x.chunks, skin_chunk, &x);
    } else {
        r = VG_ENOMEM;
    }
    free(x.mover);
    free(x.space);
    free(x.own);
    clear_bones(&b);
    return r;
}
