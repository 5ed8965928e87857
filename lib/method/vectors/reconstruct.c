/* reconstruct.c: reconstructs a mesh from its vectors: min over V of sum |v(c) - C_f - w*_c|^2 (T 3.7), with one
 * factorisation for all poses.
 *
 * The normal matrix is the sum over faces of I - 11'/r on the vertices of the face (MATH 2): a graph Laplacian with
 * weight 1/r on every pair. A face with many corners would fill r^2/2 entries. There the centroid is a separate
 * unknown, joined to each corner with weight 1: the minimum is the same (eliminating the centroid gives I - 11'/r),
 * with r entries.
 *
 * The system is solved not for V but for its difference from a first guess: the pose obtained by walking from corner
 * to corner along a spanning tree, adding up vectors. If the vectors are consistent, the guess is exact up to
 * rounding and the solution is 0; if they are not, the solution distributes the residual. Solving for V itself would
 * lose two to four digits on long meshes, because its rounding errors are those of positions, not of vectors.
 *
 * Without anchors one vertex is held at 0, and the pose is moved to its root at the end. Triangular solves are in
 * solve_kernel.c, the guess in guess_kernel.c, the factorisation in sparse.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/solver.h"
#include "model/incidence.h"
#include "numeric/vec3.h"

#include <stdlib.h>
#include <time.h>

enum {
    STAR = 12,         /* from this many corners on the centroid of a face is an unknown ... */
    STAR_METRIC = 200  /* ... or from this many, if the face has a metric; its metric is then the weight alone */
};

double vgi_solver_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

bool vgi_solver_is_star(const vg_solver *s, size_t f)
{
    return vgi_face_size(&s->g->faces, f) >= (s->metric.face ? STAR_METRIC : STAR);
}

/* Number the unknowns: row[v] counts attached vertices that are not held. */
static int number_unknowns(vg_solver *s, const uint32_t *anchors, size_t n, const double *reference, vg_err *e)
{
    const vg_graph *g = s->g;
    s->row = vgi_array_raw(g->faces.nv, sizeof *s->row, e);
    s->anchors = vgi_copy_array(anchors, n, sizeof *anchors, e);
    s->isolated = vgi_array_raw(g->faces.nv - g->attached, sizeof *s->isolated, e);
    s->isolated_at = vgi_array_raw(3 * (g->faces.nv - g->attached), sizeof *s->isolated_at, e);
    if (!s->row || !s->anchors || !s->isolated || !s->isolated_at) return VG_ENOMEM;
    s->nanchors = n;
    for (size_t v = 0; v < g->faces.nv; v++) s->row[v] = 0;
    for (size_t i = 0; i < n; i++) {
        if (!g->in_face[anchors[i]]) return vg_fail(e, VG_EINPUT, "anchor %u is in no face", anchors[i]);
        s->row[anchors[i]] = NO_ROW;
    }
    size_t pinned = g->faces.nv;
    for (size_t v = 0; v < g->faces.nv; v++) {
        if (!g->in_face[v]) {
            s->row[v] = NO_ROW;
            for (int k = 0; k < 3; k++) s->isolated_at[3 * s->nisolated + (size_t)k] = reference[3 * v + (size_t)k];
            s->isolated[s->nisolated++] = (uint32_t)v;
        } else if (n == 0 && pinned == g->faces.nv) {
            pinned = v;
        } else if (s->row[v] != NO_ROW) {
            s->row[v] = (uint32_t)s->unknowns++;
        }
    }
    s->vertices_unknown = s->unknowns;
    for (size_t f = 0; f < g->faces.nf; f++) s->unknowns += vgi_solver_is_star(s, f);
    if (s->unknowns > INT32_MAX / 2) return vg_fail(e, VG_EINPUT, "a mesh of %zu unknowns is too large", s->unknowns);
    if (pinned < g->faces.nv) s->row[pinned] = NO_ROW;
    s->pinned = (uint32_t)pinned;
    return VG_OK;
}

/* Breadth first from the held vertices, so that paths are short and few rounding errors add up. */
static int walk_from_held(vg_solver *s, const vgi_incidence *around, vg_err *e)
{
    const vg_graph *g = s->g;
    bool *reached = vgi_array(g->faces.nv, sizeof *reached, e), *used = vgi_array(g->faces.nf, sizeof *used, e);
    uint32_t *queue = vgi_array_raw(g->faces.nv, sizeof *queue, e);
    s->walk = vgi_array_raw(g->attached, sizeof *s->walk, e);
    size_t head = 0, tail = 0;
    int r = reached && used && queue && s->walk ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < s->nanchors; i++)
        queue[tail++] = s->anchors[i], reached[s->anchors[i]] = true;
    if (r == VG_OK && s->pinned < g->faces.nv) queue[tail++] = s->pinned, reached[s->pinned] = true;
    while (r == VG_OK && head < tail) {
        uint32_t v = queue[head++];
        for (uint32_t i = around->first[v]; i < around->first[v + 1]; i++) {
            uint32_t f = around->face[i];
            if (used[f]) continue;
            used[f] = true;
            for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) {
                if (reached[g->faces.vert[c]]) continue;
                reached[g->faces.vert[c]] = true;
                queue[tail++] = g->faces.vert[c];
                s->walk[s->nsteps++] = (vgi_step){c, around->corner[i]};
            }
        }
    }
    if (r == VG_OK && tail < g->attached)
        r = vg_fail(e, VG_EINPUT,
                    "%zu vertices are in components that no link joins to the others: a link is missing",
                    g->attached - tail);
    free(reached);
    free(used);
    free(queue);
    return r;
}

static int plan_walk(vg_solver *s, vg_err *e)
{
    vgi_incidence around;
    if (vgi_incidence_make(&around, &s->g->faces, e) < 0) return VG_ENOMEM;
    int r = walk_from_held(s, &around, e);
    vgi_incidence_clear(&around);
    return r;
}

/* Upper bound of the number of entries in the lower triangle, counting duplicates. */
static size_t count_entries(const vg_solver *s)
{
    size_t n = 0;
    for (size_t f = 0; f < s->g->faces.nf; f++) {
        size_t r = vgi_face_size(&s->g->faces, f);
        n += vgi_solver_is_star(s, f) ? 2 * r + 1 : r * (r + 1) / 2;
    }
    return n;
}

static void assemble_pairs(vgi_triplets *t, const vg_solver *s, size_t f)
{
    size_t begin = s->g->faces.start[f], r = vgi_face_size(&s->g->faces, f);
    const uint32_t *vert = s->g->faces.vert + begin;
    for (size_t p = 0; p < r; p++) {
        size_t i = s->row[vert[p]];
        if (i == NO_ROW) continue;
        for (size_t q = 0; q <= p; q++) {
            if (s->row[vert[q]] == NO_ROW) continue;
            vgi_triplets_put(t, i, s->row[vert[q]], vgi_metric_entry(&s->metric, s->g, f, p, q));
        }
    }
}

static void assemble_star(vgi_triplets *t, const vg_solver *s, size_t f, size_t centre)
{
    size_t r = vgi_face_size(&s->g->faces, f);
    const uint32_t *vert = s->g->faces.vert + s->g->faces.start[f];
    double weight = vgi_metric_weight(&s->metric, f);
    vgi_triplets_put(t, centre, centre, weight * (double)r);
    for (size_t p = 0; p < r; p++) {
        size_t i = s->row[vert[p]];
        if (i == NO_ROW) continue;
        vgi_triplets_put(t, i, i, weight);
        vgi_triplets_put(t, i, centre, -weight);
    }
}

/* Centroids are the last unknowns. */
static int assemble(const vg_solver *s, vgi_sparse *N, vg_err *e)
{
    size_t centre = s->vertices_unknown;
    vgi_triplets t;
    int r = vgi_triplets_make(&t, count_entries(s), e);
    if (r < 0) return r;
    for (size_t f = 0; f < s->g->faces.nf; f++) {
        if (vgi_solver_is_star(s, f)) assemble_star(&t, s, f, centre++);
        else assemble_pairs(&t, s, f);
    }
    r = vgi_triplets_sum(&t, s->unknowns, N, e);
    vgi_triplets_clear(&t);
    return r;
}

static int factorize_solver(vg_solver *s, vg_err *e)
{
    int r = assemble(s, &s->matrix, e);
    if (r < 0) return r;
    double t0 = vgi_solver_seconds(), t1 = t0;
    r = vgi_cholesky_new(&s->cholesky, &s->matrix, NULL, e);
    if (r == VG_OK) {
        t1 = vgi_solver_seconds();
        r = vgi_cholesky_factorize(s->cholesky, &s->matrix, e);
    }
    if (r == VG_OK) {
        s->stats = (vg_solver_stats){s->unknowns, vgi_cholesky_entries(s->cholesky), t1 - t0, vgi_solver_seconds() - t1};
        s->factor = vgi_cholesky_factor(s->cholesky);
    }
    return r;
}

/* Change row[v] to the row in the factor's order. */
static int permute_rows(vg_solver *s, vg_err *e)
{
    uint32_t *inverse = vgi_array_raw(s->unknowns, sizeof *inverse, e);
    if (!inverse) return VG_ENOMEM;
    const int *perm = vgi_cholesky_order(s->cholesky);
    for (size_t i = 0; i < s->unknowns; i++) inverse[perm[i]] = (uint32_t)i;
    for (size_t v = 0; v < s->g->faces.nv; v++)
        if (s->row[v] != NO_ROW) s->row[v] = inverse[s->row[v]];
    free(inverse);
    return VG_OK;
}

/* n elements per thread, aligned for vectors; element sizes are multiples of 32 */
void *vgi_solver_for_threads(const vg_solver *s, size_t n, size_t size, vg_err *e)
{
    size_t all;
    void *p = NULL;
    if (vgi_mul(n, (size_t)s->threads, &all) && vgi_mul(all, size, &all) && all <= SIZE_MAX - sizeof(vgi_lanes))
        p = aligned_alloc(sizeof(vgi_lanes), (all + sizeof(vgi_lanes)) / sizeof(vgi_lanes) * sizeof(vgi_lanes));
    if (!p) vg_fail(e, VG_ENOMEM, "not enough memory to solve for %zu unknowns", s->unknowns);
    return p;
}

static int make_spare(vg_solver *s, vg_err *e)
{
    s->spare = vgi_solver_for_threads(s, s->g->faces.nv + s->g->max_corners, sizeof *s->spare, e);
    return s->spare ? VG_OK : VG_ENOMEM;
}

static int make_workspace(vg_solver *s, vg_err *e)
{
    s->x = vgi_solver_for_threads(s, s->unknowns, sizeof *s->x, e);
    return s->x ? VG_OK : VG_ENOMEM;
}

static int make_metric(vg_solver *s, const double *reference, vg_err *e)
{
    int r = vgi_metric_make(&s->metric, s->g, reference, e);
    for (size_t f = 0; r == VG_OK && f < s->g->faces.nf; f++)
        if (vgi_solver_is_star(s, f)) memset(s->metric.face[f].s, 0, sizeof s->metric.face[f].s);
    return r;
}

int vg_solver_new(vg_solver **out, const vg_graph *g, const uint32_t *anchors, size_t nanchors, const double *reference,
                  vg_weights weights, int threads, vg_err *e)
{
    vg_solver *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->g = g, s->threads = threads;
    int r = weights == VG_WEIGHTS_AREA ? make_metric(s, reference, e) : VG_OK;
    if (r == VG_OK) r = number_unknowns(s, anchors, nanchors, reference, e);
    if (r == VG_OK) r = plan_walk(s, e);
    if (r == VG_OK) r = make_spare(s, e);
    if (r == VG_OK && s->unknowns) {
        r = factorize_solver(s, e);
        if (r == VG_OK) r = permute_rows(s, e);
        if (r == VG_OK) r = make_workspace(s, e);
    }
    if (r < 0) vg_solver_free(out);
    return r;
}

static void free_own(vg_solver *s)
{
    vgi_metric_clear(&s->metric);
    vgi_sparse_clear(&s->matrix);
    free(s->isolated);
    free(s->isolated_at);
    free(s->spare);
    free(s->walk);
}

void vg_solver_free(vg_solver **out)
{
    vg_solver *s = *out;
    if (!s) return;
    if (!s->like) free_own(s);
    vgi_sharing_free(&s->sharing);
    vgi_held_factor_clear(&s->held);
    vgi_cholesky_free(&s->cholesky);
    free(s->row);
    free(s->anchors);
    free(s->x);
    free(s);
    *out = NULL;
}

vgi_solver_view vgi_solver_look(const vg_solver *s)
{
    return (vgi_solver_view){.g = s->g,
                             .metric = &s->metric,
                             .factor = &s->factor,
                             .row = s->row,
                             .rows = s->unknowns,
                             .anchored = s->nanchors > 0,
                             .threads = s->threads};
}

/* ---- solving ---- */

size_t vg_solver_batch(const vg_solver *s)
{
    return VGI_LANES * (size_t)s->threads;
}

vg_solver_stats vg_solver_get_stats(const vg_solver *s)
{
    return s->stats;
}

typedef struct load_job {
    const vg_solver *s;
    vg_solver *const *each; /* solver of each pose; NULL: s */
    size_t n, share; /* number of poses; poses per task */
    const double *const *vectors, *const *anchors;
    double *const *x, *const *rhs;
} load_job;

static void load_share(void *context, size_t task)
{
    const load_job *j = context;
    vgi_point *spare = j->s->spare + task * (j->s->g->faces.nv + j->s->g->max_corners);
    for (size_t i = task * j->share; i < j->n && i < (task + 1) * j->share; i++) {
        const vg_solver *s = j->each ? j->each[i] : j->s;
        vgi_guesser g = {.g = s->g, .metric = &s->metric, .walk = s->walk, .nsteps = s->nsteps,
                         .pinned = s->like ? s->like->pinned : s->pinned, .anchors = s->anchors, .nanchors = s->nanchors};
        vgi_guess(&g, j->vectors[i], s->nanchors ? j->anchors[i] : NULL, j->x[i], j->rhs[i], spare);
    }
}

static void load_poses(const vg_solver *s, vg_solver *const *each, size_t n, const double *const *vectors,
                 const double *const *anchors, double *const *x, double *const *rhs)
{
    size_t tasks = (size_t)s->threads < n ? (size_t)s->threads : n;
    load_job j = {s, each, n, tasks ? (n + tasks - 1) / tasks : 0, vectors, anchors, x, rhs};
    vgi_parallel(s->threads, tasks, load_share, &j);
}

void vg_solver_load(vg_solver *s, size_t n, const double *const *vectors, const double *const *anchors,
                    double *const *x, double *const *rhs)
{
    load_poses(s, NULL, n, vectors, anchors, x, rhs);
}

void vg_solver_load_each(size_t n, vg_solver *const *each, const double *const *vectors, const double *const *anchors,
                         double *const *x, double *const *rhs)
{
    if (n) load_poses(each[0], each, n, vectors, anchors, x, rhs);
}

typedef struct solve_job {
    vg_solver *s;
    size_t n;
    const double *const *rhs;
    double *const *x;
    const double *const *anchors, *const *roots;
    size_t first; /* first block of this round */
} solve_job;

/* On input the held vertex is at 0. */
void vgi_solver_place(const vg_solver *s, double *x, const double *to)
{
    const vg_graph *g = s->g;
    double shift[3], mean[3] = {0, 0, 0};
    if (!s->nanchors) vg_graph_root(g, x, mean);
    vgi_subtract(to, mean, shift);
    for (size_t v = 0; v < g->faces.nv; v++)
        vgi_add(x + 3 * v, shift);
    for (size_t i = 0; i < s->nanchors; i++) memcpy(x + 3 * (size_t)s->anchors[i], to + 3 * i, 3 * sizeof *x);
    for (size_t i = 0; i < s->nisolated; i++)
        memcpy(x + 3 * (size_t)s->isolated[i], s->isolated_at + 3 * i, 3 * sizeof *x);
}

static void solve_block(void *context, size_t i)
{
    const solve_job *j = context;
    const vg_solver *s = j->s;
    size_t first = (j->first + i) * VGI_LANES, lanes = j->n - first < VGI_LANES ? j->n - first : VGI_LANES;
    if (s->unknowns) {
        vgi_row *x = s->x + i * s->unknowns;
        const double *rhs[VGI_LANES];
        for (size_t k = 0; k < VGI_LANES; k++) rhs[k] = j->rhs[first + (k < lanes ? k : lanes - 1)];
        if (s->unknowns > s->vertices_unknown) memset(x, 0, s->unknowns * sizeof *x); /* right-hand sides of centroids
                                                                                         are 0 */
        vgi_load_rows(x, s->row, s->g->faces.nv, s->unknowns, rhs);
        vgi_factor_solve(&s->factor, x);
        vgi_add_rows(x, s->row, s->g->faces.nv, s->unknowns, j->x + first, lanes);
    }
    for (size_t k = first; k < first + lanes; k++)
        vgi_solver_place(s, j->x[k], s->nanchors ? j->anchors[k] : j->roots[k]);
}

static void solve_plainly(vg_solver *s, size_t n, const double *const *rhs, double *const *x,
                          const double *const *anchors, const double *const *roots)
{
    solve_job j = {.s = s, .n = n, .rhs = rhs, .x = x, .anchors = anchors, .roots = roots};
    size_t blocks = (n + VGI_LANES - 1) / VGI_LANES;
    for (; j.first < blocks; j.first += (size_t)s->threads) {
        size_t round = blocks - j.first < (size_t)s->threads ? blocks - j.first : (size_t)s->threads;
        vgi_parallel(s->threads, round, solve_block, &j);
    }
}

static size_t run_of(size_t n, vg_solver *const *each)
{
    size_t i = 1;
    while (i < n && (each[0]->like ? each[i]->like != NULL : each[i] == each[0])) i++;
    return i;
}

void vg_solver_solve_each(size_t n, vg_solver *const *each, const double *const *rhs, double *const *x,
                          const double *const *anchors, const double *const *roots)
{
    for (size_t i = 0, run; i < n; i += run) {
        run = run_of(n - i, each + i);
        if (each[i]->like) vgi_solver_solve_like(run, NULL, each + i, rhs + i, x + i, anchors + i, roots + i);
        else solve_plainly(each[i], run, rhs + i, x + i, anchors + i, roots + i);
    }
}

void vg_solver_solve(vg_solver *s, size_t n, const double *const *rhs, double *const *x, const double *const *anchors,
                     const double *const *roots)
{
    if (s->like) vgi_solver_solve_like(n, s, NULL, rhs, x, anchors, roots);
    else solve_plainly(s, n, rhs, x, anchors, roots);
}
