/* hold.c: solvers that hold more vertices than another one, as poses with pins need them. Most of their factor is
 * that of the base solver or follows from it (fronts.c), so that vertices held in a single pose cost about as much as
 * two solves. Poses are solved one by one, because eight in a row seldom hold the same vertices. The first guess is
 * that of the base solver, moved to the held positions.
 *
 * Without anchors the base solver holds one vertex at 0. It is free here, and its row comes after all others.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/solver.h"

#include <stdlib.h>

/* ---- shared data ---- */

static uint32_t row_of_vertex(const vg_solver *like, size_t v)
{
    return v == like->pinned ? (uint32_t)like->unknowns : like->row[v];
}

/* Entries of corner p of face f in the row of its vertex. Entries at one position add up. star: the row of the face's
 * centroid, if any. */
static void add_to_border(const vg_solver *s, size_t f, size_t p, size_t star, vgi_border *border)
{
    const vg_graph *g = s->g;
    const int *order = vgi_cholesky_order(s->cholesky);
    const uint32_t *vert = g->faces.vert + g->faces.start[f];
    if (vgi_solver_is_star(s, f)) {
        double weight = vgi_metric_weight(&s->metric, f);
        border->row[border->n] = (uint32_t)star, border->value[border->n++] = -weight;
        border->diagonal += weight;
        return;
    }
    for (size_t q = 0; q < g->faces.start[f + 1] - g->faces.start[f]; q++) {
        double entry = vgi_metric_entry(&s->metric, g, f, p, q);
        if (vert[q] == vert[p]) border->diagonal += entry;
        else border->row[border->n] = (uint32_t)order[s->row[vert[q]]], border->value[border->n++] = entry;
    }
}

/* The row of the vertex that s holds at 0. */
static int make_border(const vg_solver *s, vgi_border *border, vg_err *e)
{
    const vg_graph *g = s->g;
    size_t most = 0, star = s->vertices_unknown;
    for (size_t f = 0; f < g->faces.nf; f++)
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
            if (g->faces.vert[c] == s->pinned) most += g->faces.start[f + 1] - g->faces.start[f];
    border->row = vgi_array_raw(most, sizeof *border->row, e);
    border->value = vgi_array_raw(most, sizeof *border->value, e);
    if (!border->row || !border->value) return VG_ENOMEM;
    for (size_t f = 0; f < g->faces.nf; f++) {
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
            if (g->faces.vert[c] == s->pinned) add_to_border(s, f, c - g->faces.start[f], star, border);
        star += vgi_solver_is_star(s, f);
    }
    return VG_OK;
}

/* Make the data shared with derived solvers, unless it exists. */
static int share(vg_solver *s, vg_err *e)
{
    if (s->sharing) return VG_OK;
    vgi_sharing *x = s->sharing = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    int r = VG_OK;
    if (s->unknowns) {
        vgi_border border = {0};
        x->points = vgi_solver_for_threads(s, vgi_solver_all_rows(s), sizeof *x->points, e);
        r = x->points ? make_border(s, &border, e) : VG_ENOMEM;
        if (r == VG_OK) r = vgi_fronts_new(&x->fronts, &s->matrix, s->cholesky, s->pinned < s->g->faces.nv ? &border : NULL, e);
        free(border.row);
        free(border.value);
    }
    if (r < 0) vgi_sharing_free(&s->sharing);
    return r;
}

void vgi_sharing_free(vgi_sharing **x)
{
    if (!*x) return;
    vgi_fronts_free(&(*x)->fronts);
    free((*x)->points);
    free(*x);
    *x = NULL;
}

/* ---- one solver ---- */

/* The vertices held by the base solver must be among the anchors. */
static int check_anchors(const vg_solver *s, vg_err *e)
{
    bool *here = vgi_array(s->g->faces.nv, sizeof *here, e);
    if (!here) return VG_ENOMEM;
    for (size_t i = 0; i < s->nanchors; i++) here[s->anchors[i]] = true;
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < s->like->nanchors; i++)
        if (!here[s->like->anchors[i]])
            r = vg_fail(e, VG_EARG, "vertex %u is an anchor of the base solver but not of this one", s->like->anchors[i]);
    free(here);
    return r;
}

/* held: over all rows of the base solver. */
static int mark_held(const vg_solver *s, bool *held, vg_err *e)
{
    size_t all = vgi_solver_all_rows(s->like);
    for (size_t i = 0; i < s->nanchors; i++) {
        uint32_t v = s->anchors[i], row = row_of_vertex(s->like, v);
        if (!s->g->in_face[v]) return vg_fail(e, VG_EINPUT, "anchor %u is in no face", v);
        if (row < all) held[row] = true;
    }
    if (s->pinned < s->g->faces.nv) held[s->like->unknowns] = true;
    return check_anchors(s, e);
}

static int number_rows(vg_solver *s, vg_err *e)
{
    const vg_solver *like = s->like;
    size_t all = vgi_solver_all_rows(like);
    if (!(s->row = vgi_array_raw(s->g->faces.nv, sizeof *s->row, e))) return VG_ENOMEM;
    for (size_t v = 0; v < s->g->faces.nv; v++) {
        uint32_t row = row_of_vertex(like, v);
        s->row[v] = row < all && like->sharing->fronts ? s->held.row[row] : NO_ROW;
    }
    return VG_OK;
}

static int hold_anchors(vg_solver *s, vg_err *e)
{
    const vgi_sharing *shared = s->like->sharing;
    double begin = vgi_solver_seconds();
    bool *held = vgi_array(vgi_solver_all_rows(s->like), sizeof *held, e);
    int r = held ? mark_held(s, held, e) : VG_ENOMEM;
    if (r == VG_OK && shared->fronts) r = vgi_fronts_hold(shared->fronts, held, &s->held, e);
    if (r == VG_OK) r = number_rows(s, e);
    s->factor = s->held.factor;
    s->unknowns = s->factor.n;
    s->stats = (vg_solver_stats){s->unknowns, s->held.entries, 0, vgi_solver_seconds() - begin};
    free(held);
    return r;
}

static int make_like(vg_solver **out, const vg_solver *like, const uint32_t *anchors, size_t n, vg_err *e)
{
    vg_solver *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->like = like, s->g = like->g, s->walk = like->walk, s->nsteps = like->nsteps, s->threads = like->threads, s->metric = like->metric, s->spare = like->spare;
    s->nisolated = like->nisolated, s->isolated = like->isolated, s->isolated_at = like->isolated_at;
    s->pinned = n ? (uint32_t)s->g->faces.nv : like->pinned;
    s->nanchors = n;
    s->anchors = vgi_copy_array(anchors, n, sizeof *anchors, e);
    int r = s->anchors ? hold_anchors(s, e) : VG_ENOMEM;
    if (r < 0) vg_solver_free(out);
    return r;
}

typedef struct make_job {
    vg_solver **s;
    const vg_solver *like;
    const uint32_t *const *anchors;
    const size_t *nanchors;
    vg_err *errors;
} make_job;

static void make_one(void *context, size_t i)
{
    const make_job *j = context;
    if (make_like(&j->s[i], j->like, j->anchors[i], j->nanchors[i], &j->errors[i]) < 0) j->s[i] = NULL;
}

int vg_solver_new_like(vg_solver **s, size_t n, vg_solver *like, const uint32_t *const *anchors, const size_t *nanchors,
                       vg_err *e)
{
    for (size_t i = 0; i < n; i++) s[i] = NULL;
    if (like->like) return vg_fail(e, VG_EARG, "a derived solver cannot be the base of another one");
    int r = share(like, e);
    if (r < 0) return r;
    vg_err *errors = vgi_array(n, sizeof *errors, e);
    if (!errors) return VG_ENOMEM;
    make_job j = {s, like, anchors, nanchors, errors};
    vgi_parallel(like->threads, n, make_one, &j);
    size_t failed = 0;
    while (failed < n && s[failed]) failed++;
    r = failed < n ? errors[failed].code : VG_OK;
    if (r < 0) {
        if (e) *e = errors[failed];
        for (size_t i = 0; i < n; i++) vg_solver_free(&s[i]);
    }
    free(errors);
    return r;
}

/* ---- solving ---- */

/* Row of the plain solver for row i of all rows. */
static uint32_t row_in_factor(const vg_solver *s, size_t i)
{
    if (s->like) return s->held.row[i];
    return i < s->unknowns ? (uint32_t)i : NO_ROW;
}

void vgi_solver_solve_lane(const vg_solver *s, size_t lane, const vgi_row *from, vgi_row *to, vgi_point *points)
{
    size_t all = vgi_solver_all_rows(s->like ? s->like : s);
    for (size_t i = 0; i < all; i++) {
        uint32_t row = row_in_factor(s, i);
        if (row == NO_ROW) continue;
        for (size_t c = 0; c < 3; c++) points[row][c] = from[i].xyz[c][lane];
        points[row][3] = 0;
    }
    if (s->unknowns) vgi_factor_solve_one(&s->factor, *points);
    for (size_t i = 0; i < all; i++) {
        uint32_t row = row_in_factor(s, i);
        for (size_t c = 0; c < 3; c++) to[i].xyz[c][lane] = row == NO_ROW ? 0 : points[row][c];
    }
}

typedef struct solve_job {
    size_t n, share; /* number of poses; poses per task */
    const vg_solver *s;
    vg_solver *const *each;
    const double *const *rhs;
    double *const *x;
    const double *const *anchors, *const *roots;
} solve_job;

static void solve_pose(const vg_solver *s, const double *rhs, double *x, vgi_point *points)
{
    memset(points, 0, s->unknowns * sizeof *points);
    for (size_t v = 0; v < s->g->faces.nv; v++)
        if (s->row[v] != NO_ROW) memcpy(points[s->row[v]], rhs + 3 * v, 3 * sizeof *rhs);
    vgi_factor_solve_one(&s->factor, *points);
    for (size_t v = 0; v < s->g->faces.nv; v++)
        for (size_t k = 0; s->row[v] != NO_ROW && k < 3; k++) x[3 * v + k] += points[s->row[v]][k];
}

static void solve_share(void *context, size_t task)
{
    const solve_job *j = context;
    for (size_t i = task * j->share; i < j->n && i < (task + 1) * j->share; i++) {
        const vg_solver *s = j->each ? j->each[i] : j->s;
        vgi_point *points = s->like->sharing->points + task * vgi_solver_all_rows(s->like);
        if (s->unknowns) solve_pose(s, j->rhs[i], j->x[i], points);
        vgi_solver_place(s, j->x[i], s->nanchors ? j->anchors[i] : j->roots[i]);
    }
}

void vgi_solver_solve_like(size_t n, const vg_solver *s, vg_solver *const *each, const double *const *rhs,
                           double *const *x, const double *const *anchors, const double *const *roots)
{
    if (!s) s = each[0];
    size_t tasks = (size_t)s->threads < n ? (size_t)s->threads : n;
    solve_job j = {n, tasks ? (n + tasks - 1) / tasks : 0, s, each, rhs, x, anchors, roots};
    vgi_parallel(s->threads, tasks, solve_share, &j);
}
