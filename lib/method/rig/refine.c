/* refine.c: what an envelope leaves of the poses is regressed, vertex by vertex, on the motions of the bones around it
 * (MATH 6). Only differences of translations enter, so that a rigid motion of the whole body is kept. One set of normal
 * equations serves all ridges. The envelope is fitted in envelope.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/refine.h"
#include "method/rig/rig_kernel.h"
#include "model/rig.h"
#include "numeric/blas.h"
#include "numeric/lapack.h"
#include "numeric/vec3.h"

#include <stdlib.h>

enum { CHUNK = 64, AROUND = 8, MOST = 4 * AROUND, BLOCK = 32, ROWS = 128 };

typedef struct refining {
    const vgi_envelope *x;
    size_t n; /* bones */
    const double *ridge;
    size_t nridges;
    vg_map *m;     /* NULL, or what the regression is added to */
    vgi_trials *t; /* NULL, or where it is kept */
    double origin[3]; /* of the reference pose */
    uint32_t *parent; /* of each bone */
    double *cross;    /* 4 n x 4 n: the sums of T_i' T_j, with the reference pose among the poses */
    size_t chunks;
    double *space; /* per chunk: 4 n */
} refining;

/* What the reference pose adds to element (i, k) x (j, l) of the sums of T_i' T_j. */
static double cross_in_reference(const refining *x, size_t i, size_t k, size_t j, size_t l)
{
    const double *a = x->x->sums->at + 3 * i, *b = x->x->sums->at + 3 * j, *o = x->origin;
    if (k < 3 && l < 3) return k == l;
    if (k < 3) return b[k] - o[k];
    if (l < 3) return a[l] - o[l];
    return (a[0] - o[0]) * (b[0] - o[0]) + (a[1] - o[1]) * (b[1] - o[1]) + (a[2] - o[2]) * (b[2] - o[2]);
}

/* Bones of the vertex, then the neighbours of the first two in the skeleton. */
static size_t bones_around(const refining *x, size_t v, uint32_t *list)
{
    const vg_rig *r = x->x->rig;
    size_t n = 0, own;
    while (n < VG_SKIN && r->skin_weight[VG_SKIN * v + n] > 0) list[n] = r->skin_bone[VG_SKIN * v + n], n++;
    own = n < 2 ? n : 2;
    for (size_t i = 0; i < own; i++)
        for (size_t b = 0; b < r->nbones && n < AROUND; b++) {
            if (x->parent[b] != list[i] && x->parent[list[i]] != b) continue;
            bool there = false;
            for (size_t k = 0; k < n; k++) there |= list[k] == b;
            if (!there) list[n++] = (uint32_t)b;
        }
    return n;
}

/* left (4 per bone): what vertex v, by its row of the base, leaves of the poses along the components of the bones. z: space
 * for the row relative to the joints. */
static void find_left(const refining *x, size_t v, const uint32_t *bone, size_t bones, double *z, double *left)
{
    const vgi_rig_sums *s = x->x->sums;
    size_t width = 4 * x->n;
    const double *row = x->x->base->weights + v * width, *p = x->x->reference + 3 * v, *o = x->origin;
    for (size_t j = 0; j < x->n; j++) {
        for (size_t k = 0; k < 3; k++) z[4 * j + k] = row[4 * j + k] - row[4 * j + 3] * s->at[3 * j + k];
        z[4 * j + 3] = row[4 * j + 3];
    }
    for (size_t b = 0; b < bones; b++) {
        const double *a = s->at + 3 * (size_t)bone[b], *pull = s->pull + v * width + 4 * (size_t)bone[b];
        double made[4];
        vgi_rig_kernel_now()->dots(x->cross + 4 * bone[b] * width, z, width, made);
        for (size_t k = 0; k < 3; k++) left[4 * b + k] = pull[k] + (p[k] - o[k]) - made[k];
        left[4 * b + 3] = pull[3] + (p[0] - o[0]) * (a[0] - o[0]) + (p[1] - o[1]) * (a[1] - o[1]) +
                          (p[2] - o[2]) * (a[2] - o[2]) - made[3];
    }
}

/* The normal equations of one vertex. The translation of its first bone is minus the sum of the others. */
typedef struct equations {
    size_t n, bone[MOST], number[MOST]; /* of each unknown */
    double matrix[MOST * MOST], right[MOST];
} equations;

static void make_system(const refining *x, const uint32_t *bone, size_t bones, const double *left, equations *s)
{
    size_t width = 4 * x->n;
    s->n = 0;
    for (size_t b = 0; b < bones; b++)
        for (size_t k = 0; k < 4; k++)
            if (b || k < 3) s->bone[s->n] = b, s->number[s->n++] = k;
    const double *first = x->cross + (4 * bone[0] + 3) * width;
    for (size_t i = 0; i < s->n; i++) {
        size_t k = s->number[i], at = 4 * bone[s->bone[i]] + k;
        const double *row = x->cross + at * width;
        s->right[i] = left[4 * s->bone[i] + k] - (k == 3 ? left[3] : 0);
        for (size_t j = 0; j <= i; j++) {
            size_t l = s->number[j], to = 4 * bone[s->bone[j]] + l;
            double sum = row[to];
            if (k == 3) sum -= first[to];
            if (l == 3) sum -= row[4 * bone[0] + 3];
            if (k == 3 && l == 3) sum += first[4 * bone[0] + 3];
            s->matrix[i * s->n + j] = sum;
        }
    }
}

/* d (4 per bone): the solution with this ridge; zeros if there is none. */
static void solve_system(const equations *s, double ridge, size_t bones, double *d)
{
    double l[MOST * MOST], y[MOST];
    memset(d, 0, 4 * bones * sizeof *d);
    if (!(ridge > 0)) return;
    memcpy(l, s->matrix, s->n * s->n * sizeof *l);
    memcpy(y, s->right, s->n * sizeof *y);
    for (size_t i = 0; i < s->n; i++) l[i * s->n + i] *= 1 + ridge;
    if (!vgi_spd_factor(s->n, l)) return;
    vgi_spd_solve(s->n, l, 1, y);
    for (size_t i = 0; i < s->n; i++) {
        d[4 * s->bone[i] + s->number[i]] += y[i];
        if (s->number[i] == 3) d[3] -= y[i];
    }
}

static void refine_vertex(const refining *x, size_t v, double *z)
{
    const vgi_rig_sums *sums = x->x->sums;
    uint32_t bone[AROUND];
    double left[MOST], d[MOST];
    equations s;
    size_t bones = bones_around(x, v, bone);
    find_left(x, v, bone, bones, z, left);
    make_system(x, bone, bones, left, &s);
    for (size_t i = 0; i < x->nridges; i++) {
        double *to = x->t ? x->t->add + (v * x->nridges + i) * MOST : d;
        solve_system(&s, x->ridge[i], bones, to);
        for (size_t b = 0; b < bones && x->m; b++) {
            double *row = x->m->weights + 4 * (v * x->n + bone[b]);
            for (size_t k = 0; k < 3; k++) row[k] += d[4 * b + k] + d[4 * b + 3] * sums->at[3 * (size_t)bone[b] + k];
            row[3] += d[4 * b + 3];
        }
    }
    if (!x->t) return;
    memcpy(x->t->bone + v * AROUND, bone, bones * sizeof *bone);
    x->t->count[v] = (uint8_t)bones;
}

static void refine_chunk(void *context, size_t task)
{
    const refining *x = context;
    size_t nv = x->x->sums->nv, first = task * nv / x->chunks, last = (task + 1) * nv / x->chunks;
    for (size_t v = first; v < last; v++)
        if (x->x->in_face[v]) refine_vertex(x, v, x->space + task * 4 * x->n);
}

static int refine(refining *x, vg_err *e)
{
    const vgi_rig_sums *s = x->x->sums;
    size_t width = 4 * s->n;
    x->n = s->n, x->chunks = s->nv < CHUNK ? 1 : CHUNK;
    vg_centroid(x->x->reference, s->nv, x->origin);
    x->space = vgi_array(x->chunks, width * sizeof *x->space, e);
    x->parent = vgi_array(x->n, sizeof *x->parent, e);
    x->cross = vgi_copy_array(s->cross, width, width * sizeof *x->cross, e);
    int r = x->space && x->parent && x->cross ? vgi_rig_parents(x->x->rig, x->parent, e) : VG_ENOMEM;
    if (r == VG_OK) {
        for (size_t i = 0; i < width; i++)
            for (size_t j = 0; j < width; j++)
                x->cross[i * width + j] += cross_in_reference(x, i / 4, i % 4, j / 4, j % 4);
        vgi_blas_alone();
        vgi_parallel(x->x->threads, x->chunks, refine_chunk, x);
        vgi_blas_shared();
    }
    free(x->space);
    free(x->parent);
    free(x->cross);
    return r;
}

int vgi_refine(const vgi_envelope *x, double ridge, vg_map *m, vg_err *e)
{
    refining one = {.x = x, .ridge = &ridge, .nridges = 1, .m = m};
    return ridge > 0 ? refine(&one, e) : VG_OK;
}

/* ---- trials ---- */

int vgi_trials_make(vgi_trials *t, const vgi_envelope *x, size_t n, const double *ridge, vg_err *e)
{
    size_t nv = x->sums->nv;
    *t = (vgi_trials){.n = n};
    t->bone = vgi_array(nv, AROUND * sizeof *t->bone, e), t->count = vgi_array(nv, sizeof *t->count, e);
    t->add = vgi_array(n * nv, MOST * sizeof *t->add, e);
    refining all = {.x = x, .ridge = ridge, .nridges = n, .t = t};
    int r = t->bone && t->count && t->add ? refine(&all, e) : VG_ENOMEM;
    if (r < 0) vgi_trials_clear(t);
    return r;
}

void vgi_trials_clear(vgi_trials *t)
{
    free(t->bone);
    free(t->count);
    free(t->add);
    *t = (vgi_trials){0};
}

/* Some poses at once; the motions of bones are columns: x, y and z of each pose. */
typedef struct judging {
    const vgi_trials *t;
    const vgi_envelope *x;
    size_t poses;
    const double *const *at;
    double *columns; /* 4 n x 3 poses: T of the map, [A t] */
    double *joints;  /* n x 3 poses: A at + t */
    double *const *sums;
    double *space; /* per task: ROWS x 3 poses */
    size_t first;  /* row of the first task */
} judging;

static void place_columns(judging *x, size_t k, const double *transforms)
{
    size_t n = x->x->sums->n, width = 3 * x->poses;
    for (size_t j = 0; j < n; j++) {
        const double *q = transforms + 7 * j, *at = x->x->sums->at + 3 * j;
        double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], root = sqrt(square), a[9];
        const double unit[4] = {q[0] / root, q[1] / root, q[2] / root, q[3] / root};
        vg_quat_matrix(unit, a);
        for (size_t c = 0; c < 3; c++) {
            double *to = x->columns + 4 * j * width + 3 * k + c;
            for (size_t i = 0; i < 3; i++) to[i * width] = square * a[3 * c + i];
            to[3 * width] = q[4 + c];
            x->joints[j * width + 3 * k + c] = to[0] * at[0] + to[width] * at[1] + to[2 * width] * at[2] + q[4 + c];
        }
    }
}

static void skin_vertex(const judging *x, size_t v, double *to)
{
    const vg_rig *r = x->x->rig;
    const double *p = x->x->reference + 3 * v;
    size_t width = 3 * x->poses;
    memset(to, 0, width * sizeof *to);
    for (size_t s = VG_SKIN * v; s < VG_SKIN * v + VG_SKIN; s++) {
        double w = r->skin_weight[s];
        const double c[4] = {w * p[0], w * p[1], w * p[2], w}, *of = x->columns + 4 * r->skin_bone[s] * width;
        if (w > 0) vgi_rig_kernel_now()->add_rows(of, of + 3 * width, c, width, to);
    }
}

/* base: the vertex by the envelope before refinement, in all poses. */
static void judge_vertex(const judging *x, size_t v, const double *base)
{
    size_t width = 3 * x->poses, n = x->t->n;
    double skin[3 * BLOCK], tried[3 * BLOCK];
    skin_vertex(x, v, skin);
    for (size_t i = 0; i < n; i++) {
        double sd = 0, dd = 0;
        memcpy(tried, base, width * sizeof *tried);
        for (size_t b = 0; b < x->t->count[v]; b++) {
            size_t j = x->t->bone[v * AROUND + b];
            vgi_rig_kernel_now()->add_rows(x->columns + 4 * j * width, x->joints + j * width,
                                            x->t->add + (v * n + i) * MOST + 4 * b, width, tried);
        }
        for (size_t q = 0; q < width; q++) {
            double s = skin[q] - x->at[q / 3][3 * v + q % 3], d = tried[q] - skin[q];
            sd += s * d, dd += d * d;
        }
        x->sums[i][2 * v] += sd, x->sums[i][2 * v + 1] += dd;
    }
}

static void judge_rows(void *context, size_t task)
{
    const judging *x = context;
    size_t n = x->x->sums->n, nv = x->x->sums->nv, width = 3 * x->poses, first = x->first + task * ROWS,
           rows = nv - first < ROWS ? nv - first : ROWS;
    double *base = x->space + task * ROWS * width;
    vgi_product_double(rows, width, 4 * n, x->x->base->weights + first * 4 * n, 4 * n, x->columns, width, base, width);
    for (size_t v = 0; v < rows; v++) judge_vertex(x, first + v, base + v * width);
}

static void judge_block(judging *x)
{
    enum { TASKS = 16 };
    size_t nv = x->x->sums->nv, tasks = (nv + ROWS - 1) / ROWS;
    for (size_t done = 0; done < tasks; done += TASKS) {
        x->first = done * ROWS;
        vgi_parallel(x->x->threads, tasks - done < TASKS ? tasks - done : TASKS, judge_rows, x);
    }
}

int vgi_trials_judge(const vgi_trials *t, const vgi_envelope *x, size_t n, const double *const *poses,
                     const double *const *transforms, double *const *sums, vg_err *e)
{
    size_t bones = x->sums->n;
    judging j = {.t = t, .x = x, .sums = sums};
    j.columns = vgi_array(4 * bones, 3 * BLOCK * sizeof *j.columns, e);
    j.joints = vgi_array(bones, 3 * BLOCK * sizeof *j.joints, e);
    j.space = vgi_array(16 * ROWS, 3 * BLOCK * sizeof *j.space, e);
    bool ok = j.columns && j.joints && j.space;
    vgi_blas_alone();
    for (size_t first = 0; ok && first < n; first += BLOCK) {
        j.poses = n - first < BLOCK ? n - first : BLOCK, j.at = poses + first;
        for (size_t k = 0; k < j.poses; k++) place_columns(&j, k, transforms[first + k]);
        judge_block(&j);
    }
    vgi_blas_shared();
    free(j.columns);
    free(j.joints);
    free(j.space);
    return ok ? VG_OK : VG_ENOMEM;
}
