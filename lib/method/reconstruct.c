/* reconstruct.c: a mesh from its vectors: min over V of sum |v(c) - C_f - w*_c|^2 (T 3.7), one factorisation for all poses.
 *
 * The normal matrix is the sum over faces of I - 11'/r on the face's own vertices (MATH 2): a graph Laplacian with weight
 * 1/r on every pair. A face of many corners would fill r^2/2 entries; there the centroid is an unknown of its own,
 * joined to each corner with weight 1, which has the same minimum (eliminating it gives I - 11'/r back) and r entries.
 * Without anchors one vertex is pinned at 0 and the pose is moved to its root in the end. Leaves out the triangular solves
 * (solve_kernel.c). The only file that knows CHOLMOD; it calls Core, Cholesky, Partition (LGPL) and Supernodal (GPL).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/solve_kernel.h"

#include <cholmod.h>
#include <stdlib.h>
#include <time.h>

enum {
    STAR = 12,         /* from this many corners on a face gets its centroid as an unknown */
    SMALL = 500,       /* below this many unknowns a minimum-degree order is as good as nested dissection, and faster */
    PASSES = 2         /* solve, then correct by the residual: the first alone loses a digit or two on long thin meshes */
};
#define NO_ROW UINT32_MAX

struct vg_solver {
    const vg_graph *g;
    int threads;
    size_t unknowns;  /* attached vertices that are no anchors, then centroids */
    size_t vertices_unknown;
    size_t nheld;     /* anchors, or the one pinned vertex */
    uint32_t *row;    /* nv: unknowns in the factor's order, then held vertices; NO_ROW if isolated */
    uint32_t *corner_row, *centre; /* the stencil's arrays: per corner, per face */
    uint32_t *anchors;
    size_t nanchors;  /* those the caller gave; 0: one vertex is pinned */
    size_t nisolated;
    uint32_t *isolated;
    double *isolated_at;
    cholmod_common common;
    bool started;
    cholmod_factor *L;
    vgi_factor factor;
    vgi_row *x, *r;   /* threads * (unknowns + held) each: solution and residual */
    vg_solver_facts facts;
};

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static size_t face_size(const vg_graph *g, size_t f)
{
    return g->start[f + 1] - g->start[f];
}

/* Every attached vertex must hang together, or the matrix is singular. */
static int check_connected(const vg_graph *g, vg_err *e)
{
    vg_mesh m = {g->nv, g->nf, g->start, g->vert};
    size_t n = 0;
    uint32_t *label = vgi_array_raw(g->nv, sizeof *label, e);
    if (!label) return VG_ENOMEM;
    int r = vg_mesh_components(&m, label, &n, e);
    free(label);
    if (r == VG_OK && n > 1)
        r = vg_fail(e, VG_EINPUT, "the vectors leave the mesh in %zu pieces that nothing joins: a link is missing", n);
    return r;
}

/* Number the unknowns: row[v] counts up over attached vertices that are not held; held ones come after the unknowns. */
static int number_unknowns(vg_solver *s, const uint32_t *anchors, size_t n, const double *reference, vg_err *e)
{
    const vg_graph *g = s->g;
    s->row = vgi_array_raw(g->nv, sizeof *s->row, e);
    s->anchors = vgi_copy_array(anchors, n, sizeof *anchors, e);
    s->isolated = vgi_array_raw(g->nv - g->attached, sizeof *s->isolated, e);
    s->isolated_at = vgi_array_raw(3 * (g->nv - g->attached), sizeof *s->isolated_at, e);
    if (!s->row || !s->anchors || !s->isolated || !s->isolated_at) return VG_ENOMEM;
    s->nanchors = n;
    for (size_t v = 0; v < g->nv; v++) s->row[v] = 0;
    for (size_t i = 0; i < n; i++) {
        if (!g->in_face[anchors[i]]) return vg_fail(e, VG_EINPUT, "anchor %u is in no face", anchors[i]);
        s->row[anchors[i]] = NO_ROW;
    }
    size_t pinned = g->nv;
    for (size_t v = 0; v < g->nv; v++) {
        if (!g->in_face[v]) {
            s->row[v] = NO_ROW;
            for (int k = 0; k < 3; k++) s->isolated_at[3 * s->nisolated + (size_t)k] = reference[3 * v + (size_t)k];
            s->isolated[s->nisolated++] = (uint32_t)v;
        } else if (n == 0 && pinned == g->nv) {
            pinned = v;
        } else if (s->row[v] != NO_ROW) {
            s->row[v] = (uint32_t)s->unknowns++;
        }
    }
    s->vertices_unknown = s->unknowns;
    for (size_t f = 0; f < g->nf; f++) s->unknowns += face_size(g, f) >= STAR;
    if (s->unknowns > INT32_MAX / 2) return vg_fail(e, VG_EINPUT, "a mesh of %zu unknowns is too large", s->unknowns);
    for (size_t i = 0; i < n; i++) s->row[anchors[i]] = (uint32_t)(s->unknowns + s->nheld++);
    if (pinned < g->nv) s->row[pinned] = (uint32_t)(s->unknowns + s->nheld++);
    return VG_OK;
}

/* Upper bound of the entries of the lower triangle, duplicates counted. */
static size_t count_entries(const vg_graph *g)
{
    size_t n = 0;
    for (size_t f = 0; f < g->nf; f++) {
        size_t r = face_size(g, f);
        n += r >= STAR ? 2 * r + 1 : r * (r + 1) / 2;
    }
    return n;
}

typedef struct assembly {
    int *i, *j;
    double *x;
    size_t n;
} assembly;

static void put(assembly *a, size_t i, size_t j, double x)
{
    a->i[a->n] = (int)(i > j ? i : j), a->j[a->n] = (int)(i > j ? j : i), a->x[a->n] = x;
    a->n++;
}

static void assemble_pairs(assembly *a, const vg_solver *s, const uint32_t *vert, size_t r)
{
    double share = 1.0 / (double)r;
    for (size_t p = 0; p < r; p++) {
        size_t i = s->row[vert[p]];
        if (i >= s->unknowns) continue;
        put(a, i, i, 1 - share);
        for (size_t q = 0; q < p; q++)
            if (s->row[vert[q]] < s->unknowns) put(a, i, s->row[vert[q]], -share);
    }
}

static void assemble_star(assembly *a, const vg_solver *s, const uint32_t *vert, size_t r, size_t centre)
{
    put(a, centre, centre, (double)r);
    for (size_t p = 0; p < r; p++) {
        size_t i = s->row[vert[p]];
        if (i >= s->unknowns) continue;
        put(a, i, i, 1);
        put(a, i, centre, -1);
    }
}

static int assemble(vg_solver *s, cholmod_sparse **N, vg_err *e)
{
    const vg_graph *g = s->g;
    size_t most = count_entries(g), n = s->unknowns;
    if (most > INT32_MAX) return vg_fail(e, VG_EINPUT, "a mesh of %zu matrix entries is too large", most);
    cholmod_triplet *T = cholmod_allocate_triplet(n, n, most, -1, CHOLMOD_REAL, &s->common);
    if (!T) return vg_fail(e, VG_ENOMEM, "not enough memory for a matrix of %zu entries", most);
    assembly a = {T->i, T->j, T->x, 0};
    size_t centre = s->vertices_unknown;
    for (size_t f = 0; f < g->nf; f++) {
        size_t r = face_size(g, f);
        if (r >= STAR) assemble_star(&a, s, g->vert + g->start[f], r, centre++);
        else assemble_pairs(&a, s, g->vert + g->start[f], r);
    }
    T->nnz = a.n;
    *N = cholmod_triplet_to_sparse(T, 0, &s->common);
    cholmod_free_triplet(&T, &s->common);
    return *N ? VG_OK : vg_fail(e, VG_ENOMEM, "not enough memory for a matrix of %zu rows", n);
}

static int factorize(vg_solver *s, cholmod_sparse *N, vg_err *e)
{
    cholmod_common *c = &s->common;
    c->nmethods = 1;
    c->method[0].ordering = s->unknowns < SMALL ? CHOLMOD_AMD : CHOLMOD_METIS;
    c->postorder = 1;
    c->supernodal = CHOLMOD_SUPERNODAL;
    double t0 = seconds();
    s->L = cholmod_analyze(N, c);
    double t1 = seconds();
    if (!s->L) return vg_fail(e, VG_ENOMEM, "not enough memory to factorize %zu unknowns", s->unknowns);
    cholmod_factorize(N, s->L, c);
    s->facts = (vg_solver_facts){s->unknowns, s->L->xsize, t1 - t0, seconds() - t1};
    if (c->status == CHOLMOD_OUT_OF_MEMORY)
        return vg_fail(e, VG_ENOMEM, "not enough memory to factorize %zu unknowns", s->unknowns);
    if (c->status != CHOLMOD_OK || s->L->minor != s->L->n)
        return vg_fail(e, VG_EINPUT, "cannot factorize: not positive definite at row %zu", s->L->minor);
    s->factor = (vgi_factor){s->unknowns, s->L->nsuper, s->L->super, s->L->pi, s->L->px, s->L->s, s->L->x};
    return VG_OK;
}

/* From now on row[v] is the row in the factor's order; and the faces as the stencil wants them. */
static int permute_rows(vg_solver *s, vg_err *e)
{
    const vg_graph *g = s->g;
    uint32_t *inverse = vgi_array_raw(s->unknowns, sizeof *inverse, e);
    s->corner_row = vgi_array_raw(vg_graph_corners(g), sizeof *s->corner_row, e);
    s->centre = vgi_array_raw(g->nf, sizeof *s->centre, e);
    if (!inverse || !s->corner_row || !s->centre) return free(inverse), VG_ENOMEM;
    const int *perm = s->L->Perm;
    for (size_t i = 0; i < s->unknowns; i++) inverse[perm[i]] = (uint32_t)i;
    for (size_t v = 0; v < g->nv; v++)
        if (s->row[v] < s->unknowns) s->row[v] = inverse[s->row[v]];
    for (size_t c = 0; c < vg_graph_corners(g); c++) s->corner_row[c] = s->row[g->vert[c]];
    size_t star = s->vertices_unknown;
    for (size_t f = 0; f < g->nf; f++) s->centre[f] = face_size(g, f) >= STAR ? inverse[star++] : UINT32_MAX;
    free(inverse);
    return VG_OK;
}

static int make_workspace(vg_solver *s, vg_err *e)
{
    size_t rows;
    if (vgi_mul(s->unknowns + s->nheld, (size_t)s->threads, &rows) && rows < SIZE_MAX / sizeof *s->x) {
        s->x = aligned_alloc(sizeof(vgi_lanes), rows * sizeof *s->x);
        s->r = aligned_alloc(sizeof(vgi_lanes), rows * sizeof *s->r);
    }
    return s->x && s->r ? VG_OK : vg_fail(e, VG_ENOMEM, "not enough memory to solve for %zu unknowns", s->unknowns);
}

int vg_solver_new(vg_solver **out, const vg_graph *g, const uint32_t *anchors, size_t nanchors, const double *reference,
                  int threads, vg_err *e)
{
    vg_solver *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->g = g, s->threads = threads;
    cholmod_start(&s->common);
    s->started = true;
    s->common.print = 0;
    s->common.error_handler = NULL;
    cholmod_sparse *N = NULL;
    int r = check_connected(g, e);
    if (r == VG_OK) r = number_unknowns(s, anchors, nanchors, reference, e);
    if (r == VG_OK && s->unknowns) {
        r = assemble(s, &N, e);
        if (r == VG_OK) r = factorize(s, N, e);
        if (r == VG_OK) r = permute_rows(s, e);
        cholmod_free_sparse(&N, &s->common);
        if (r == VG_OK) r = make_workspace(s, e);
    }
    if (r < 0) vg_solver_free(out);
    return r;
}

void vg_solver_free(vg_solver **out)
{
    vg_solver *s = *out;
    if (!s) return;
    if (s->started) {
        cholmod_free_factor(&s->L, &s->common);
        cholmod_finish(&s->common);
    }
    free(s->row);
    free(s->anchors);
    free(s->corner_row);
    free(s->centre);
    free(s->isolated);
    free(s->isolated_at);
    free(s->x);
    free(s->r);
    free(s);
    *out = NULL;
}

/* ---- solving ---- */

size_t vg_solver_batch(const vg_solver *s)
{
    return VGI_LANES * (size_t)s->threads;
}

vg_solver_facts vg_solver_get_facts(const vg_solver *s)
{
    return s->facts;
}

void vg_solver_rhs(const vg_solver *s, const double *vectors, double *rhs)
{
    const vg_graph *g = s->g;
    memset(rhs, 0, 3 * g->nv * sizeof *rhs);
    for (size_t f = 0; f < g->nf; f++) {
        uint32_t begin = g->start[f], end = g->start[f + 1];
        double x = 0, y = 0, z = 0, share = 1.0 / (double)(end - begin);
        for (uint32_t c = begin; c < end; c++) {
            const double *w = vectors + 3 * (size_t)c;
            x += w[0], y += w[1], z += w[2];
        }
        x *= share, y *= share, z *= share;
        for (uint32_t c = begin; c < end; c++) {
            const double *w = vectors + 3 * (size_t)c;
            double *to = rhs + 3 * (size_t)g->vert[c];
            to[0] += w[0] - x, to[1] += w[1] - y, to[2] += w[2] - z;
        }
    }
}

typedef struct solve_job {
    vg_solver *s;
    size_t n;
    double *const *x;
    const double *const *anchors, *const *roots;
    size_t first;   /* first block of this round */
} solve_job;

/* The start: unknowns at 0; anchors relative to the first one, so that a pose far from the origin loses no digits. */
static void start_solution(const vg_solver *s, vgi_row *x, const double *const *anchors, size_t lanes)
{
    memset(x, 0, (s->unknowns + s->nheld) * sizeof *x);
    for (size_t i = 0; i < s->nanchors; i++)
        for (int c = 0; c < 3; c++)
            for (size_t k = 0; k < lanes; k++)
                x[s->unknowns + i].xyz[c][k] = anchors[k][3 * i + (size_t)c] - anchors[k][c];
}

static void load_rhs(const vg_solver *s, vgi_row *r, double *const *rhs, size_t lanes)
{
    if (s->unknowns > s->vertices_unknown) memset(r, 0, s->unknowns * sizeof *r); /* the centroids' are 0 */
    for (size_t v = 0; v < s->g->nv; v++) {
        if (s->row[v] >= s->unknowns) continue;
        vgi_row *to = &r[s->row[v]];
        for (int c = 0; c < 3; c++)
            for (size_t k = 0; k < VGI_LANES; k++) to->xyz[c][k] = rhs[k < lanes ? k : lanes - 1][3 * v + (size_t)c];
    }
    memset(r + s->unknowns, 0, s->nheld * sizeof *r);
}

static void solve_rows(const vg_solver *s, vgi_row *x, vgi_row *r, double *const *rhs, const double *const *anchors, size_t lanes)
{
    const vgi_stencil stencil = {s->g->nf, s->g->start, s->corner_row, s->centre};
    start_solution(s, x, anchors, lanes);
    for (int pass = 0; pass < PASSES; pass++) {
        load_rhs(s, r, rhs, lanes);
        if (pass > 0 || s->nanchors) vgi_residual(&stencil, x, r);
        vgi_factor_solve(&s->factor, r);
        for (size_t i = 0; i < s->unknowns; i++)
            for (int c = 0; c < 3; c++) x[i].xyz[c] += r[i].xyz[c];
    }
}

/* Where the pose's zero goes: to the first anchor, or to wherever its mean becomes the root. */
static void find_shift(const vg_solver *s, const double *x, const double *anchor, const double *root, double shift[3])
{
    if (s->nanchors) {
        for (int c = 0; c < 3; c++) shift[c] = anchor[c];
        return;
    }
    double mean[3];
    vg_graph_root(s->g, x, mean);
    for (int c = 0; c < 3; c++) shift[c] = root[c] - mean[c];
}

static void store(const vg_solver *s, const vgi_row *row, double *const *x, size_t lanes)
{
    for (size_t v = 0; v < s->g->nv; v++) {
        const vgi_row *from = row && s->row[v] != NO_ROW ? &row[s->row[v]] : NULL;
        for (size_t k = 0; k < lanes; k++)
            for (int c = 0; c < 3; c++) x[k][3 * v + (size_t)c] = from ? from->xyz[c][k] : 0;
    }
}

static void place(const vg_solver *s, double *x, const double *anchor, const double *root)
{
    const vg_graph *g = s->g;
    double shift[3];
    find_shift(s, x, anchor, root, shift);
    for (size_t v = 0; v < g->nv; v++)
        for (int c = 0; c < 3; c++) x[3 * v + (size_t)c] += shift[c];
    for (size_t i = 0; i < s->nanchors; i++) memcpy(x + 3 * (size_t)s->anchors[i], anchor + 3 * i, 3 * sizeof *x);
    for (size_t i = 0; i < s->nisolated; i++)
        memcpy(x + 3 * (size_t)s->isolated[i], s->isolated_at + 3 * i, 3 * sizeof *x);
}

static void solve_block(void *context, size_t i)
{
    const solve_job *j = context;
    vg_solver *s = j->s;
    size_t first = (j->first + i) * VGI_LANES, lanes = j->n - first < VGI_LANES ? j->n - first : VGI_LANES;
    size_t buffer = i * (s->unknowns + s->nheld);
    vgi_row *x = s->x ? s->x + buffer : NULL;
    if (x) solve_rows(s, x, s->r + buffer, j->x + first, s->nanchors ? j->anchors + first : NULL, lanes);
    store(s, x, j->x + first, lanes);
    for (size_t k = 0; k < lanes; k++)
        place(s, j->x[first + k], s->nanchors ? j->anchors[first + k] : NULL, s->nanchors ? NULL : j->roots[first + k]);
}

void vg_solver_solve(vg_solver *s, size_t n, double *const *x, const double *const *anchors, const double *const *roots)
{
    solve_job j = {.s = s, .n = n, .x = x, .anchors = anchors, .roots = roots};
    size_t blocks = (n + VGI_LANES - 1) / VGI_LANES;
    for (; j.first < blocks; j.first += (size_t)s->threads) {
        size_t round = blocks - j.first < (size_t)s->threads ? blocks - j.first : (size_t)s->threads;
        vgi_parallel(s->threads, round, solve_block, &j);
    }
}
