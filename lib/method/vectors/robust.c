/* robust.c: poses with the least absolute misfit: min over V of sum over faces of e_f, e_f^2 = tr((X_f - W_f) G_f
 * (X_f - W_f)'), G_f the metric of the solver (MATH 2, Robust). Least squares spreads the error of a few inconsistent
 * faces over the whole body; here it stays local.
 *
 * The objective is the sum of sqrt(e_f^2 + c^2), which is smooth; c is a fraction of the mean misfit of the plain
 * solution. Nothing is factorised again. The search starts from the plain solution and uses a quasi-Newton method
 * with a memory of one step (BFGS; Nocedal and Wright 2006, chapter 7), whose initial Hessian is a multiple of the
 * plain normal matrix. A round costs one triangular solve and one pass over the faces, and a step length of 1 is
 * nearly always accepted. Also tried: reweighting with one factorisation per round (8 rounds for the same energy,
 * each as long as 40 solves), more steps in the memory (not fewer rounds), and scaling the factor by the weights
 * (worse).
 *
 * Eight poses are solved side by side, each with its own coefficients and stopping point, so that a pose does not
 * depend on its neighbours. The loops over rows and faces are in robust_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/solver.h"
#include "method/vectors/robust_kernel.h"
#include "model/incidence.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { HALVINGS = 30 };                /* of a step that does not lower the energy */
static const double enough = 1e-3;     /* relative to the energy: the search ends when a round gains less */
static const double sufficient = 1e-4; /* least decrease, relative to the decrease that the slope predicts */
static const double exact = 1e-11;     /* relative to the mean length of the wanted vectors: a smaller misfit counts
                                          as 0 */

/* Workspace of one block of eight poses. */
typedef struct room {
    vgi_row *u, *trial, *g, *gn; /* rows of unknowns and of held vertices */
    vgi_row *z, *zn, *d;         /* rows that can move */
    vgi_row *corners;                         /* corners of the largest face */
    vgi_point *points;                        /* all rows of one pose */
    vgi_row *memory;                          /* one block that holds all of these */
    float *misfit;
} room;

struct vg_robust {
    const vg_solver *s;
    vgi_solver_view solver;
    size_t rounds;
    double eps;
    vgi_face_rows rows;
    uint32_t *face; /* of the graph, in the order of rows.start */
    size_t *entry;
    double *metric;
    unsigned char *star;
    size_t nmisfits;
    size_t moved; /* rows that a pose can move: those of the solver and, without anchors, the vertex it holds */
    room *rooms; /* at most one per thread; nrooms are allocated */
    size_t nrooms;
    vg_robust_stats *found; /* per room */
    vg_robust_stats stats;
};

/* ---- construction ---- */

static size_t count_entries(const vg_robust *b)
{
    size_t n = 0;
    for (size_t f = 0; f < b->solver.g->faces.nf; f++) {
        size_t corners = vgi_face_size(&b->solver.g->faces, f);
        n += vgi_solver_is_star(b->s, f) ? 1 : corners * (corners - 1) / 2;
    }
    return n;
}

/* The metric of the differences from the first corner: the metric without its first row and column. */
static size_t write_metric(vg_robust *b, size_t i, size_t at)
{
    const vg_graph *g = b->solver.g;
    size_t f = b->face[i], corners = vgi_face_size(&g->faces, f);
    b->entry[i] = at;
    b->star[i] = vgi_solver_is_star(b->s, f);
    if (b->star[i]) {
        b->metric[at++] = vgi_metric_weight(b->solver.metric, f);
        return at;
    }
    for (size_t p = 1; p < corners; p++)
        for (size_t q = 1; q <= p; q++) b->metric[at++] = vgi_metric_entry(b->solver.metric, g, f, p, q);
    return at;
}

static int prepare_faces(vg_robust *b, vg_err *e)
{
    const vg_graph *g = b->solver.g;
    int r = vgi_face_rows_make(&b->rows, &b->solver, 2, e);
    if (r < 0) return r;
    b->face = vgi_array_raw(g->faces.nf, sizeof *b->face, e);
    b->entry = vgi_array_raw(g->faces.nf, sizeof *b->entry, e);
    b->star = vgi_array_raw(g->faces.nf, sizeof *b->star, e);
    b->metric = vgi_array_raw(count_entries(b), sizeof *b->metric, e);
    if (!b->face || !b->entry || !b->star || !b->metric) return VG_ENOMEM;
    for (size_t i = 0; i < b->rows.nf; i++) b->face[b->rows.order[i]] = b->rows.face[i];
    for (size_t i = 0, at = 0; i < b->rows.nf; i++) at = write_metric(b, i, at);
    b->nmisfits = 3 * (vg_graph_corners(g) - g->faces.nf);
    b->moved = b->solver.rows + (b->solver.anchored ? 0 : b->rows.nheld);
    return VG_OK;
}

static void free_room(room *m)
{
    free(m->memory);
    free(m->misfit);
    *m = (room){0};
}

static bool make_room(room *m, const vg_robust *b)
{
    size_t n = b->moved, all = b->solver.rows + b->rows.nheld, bytes;
    size_t point_rows = all * sizeof *m->points / sizeof *m->memory + 1;
    if (vgi_mul(4 * all + 3 * n + 2 * b->solver.g->max_corners + point_rows, sizeof *m->memory, &bytes))
        m->memory = aligned_alloc(sizeof(vgi_lanes), bytes);
    if (vgi_mul(b->nmisfits + 2, VGI_LANES * sizeof *m->misfit, &bytes)) m->misfit = aligned_alloc(64, bytes / 64 * 64);
    if (!m->memory || !m->misfit) {
        free_room(m);
        return false;
    }
    vgi_row *at = m->memory;
    m->u = at, m->trial = m->u + all, m->g = m->trial + all, m->gn = m->g + all, m->z = m->gn + all;
    m->zn = m->z + n, m->d = m->zn + n, m->corners = m->d + n;
    m->points = (vgi_point *)(m->corners + 2 * b->solver.g->max_corners);
    return true;
}

/* Make workspaces for as many blocks as there are, at most one per thread; a short sequence on a large mesh needs
 * one. If memory runs out, fewer blocks are solved at a time. */
static int make_rooms(vg_robust *b, size_t blocks, vg_err *e)
{
    size_t most = blocks < (size_t)b->solver.threads ? blocks : (size_t)b->solver.threads;
    while (b->nrooms < most && make_room(&b->rooms[b->nrooms], b)) b->nrooms++;
    return b->nrooms ? VG_OK : vg_fail(e, VG_ENOMEM, "not enough memory for the misfits of %zu faces", b->rows.nf);
}

int vg_robust_new(vg_robust **out, const vg_solver *s, size_t rounds, double eps, vg_err *e)
{
    *out = NULL;
    if (!(eps > 0) || !isfinite(eps)) return vg_fail(e, VG_EARG, "eps must be above 0, not %g", eps);
    vg_robust *b = *out = vgi_array(1, sizeof *b, e);
    if (!b) return VG_ENOMEM;
    b->s = s, b->solver = vgi_solver_look(s), b->rounds = rounds, b->eps = eps;
    int r = prepare_faces(b, e);
    if (r == VG_OK) {
        b->rooms = vgi_array((size_t)b->solver.threads, sizeof *b->rooms, e);
        b->found = vgi_array((size_t)b->solver.threads, sizeof *b->found, e);
        if (!b->rooms || !b->found) r = VG_ENOMEM;
    }
    if (r < 0) vg_robust_free(out);
    return r;
}

void vg_robust_free(vg_robust **out)
{
    vg_robust *b = *out;
    if (!b) return;
    vgi_face_rows_clear(&b->rows);
    free(b->face);
    free(b->entry);
    free(b->metric);
    free(b->star);
    for (size_t i = 0; i < b->nrooms; i++) free_room(&b->rooms[i]);
    free(b->rooms);
    free(b->found);
    free(b);
    *out = NULL;
}

size_t vg_robust_misfits(const vg_robust *b)
{
    return b->nmisfits;
}

vg_robust_stats vg_robust_get_stats(const vg_robust *b)
{
    return b->stats;
}

/* ---- loading ---- */

typedef struct load_job {
    const vg_robust *r;
    const double *const *vectors, *const *guesses;
    float *const *misfits;
    double *sizes;
} load_job;

static double mean_length(const double *w, size_t n)
{
    double sum = 0;
    for (size_t c = 0; c < n; c++) sum += fabs(w[3 * c]) + fabs(w[3 * c + 1]) + fabs(w[3 * c + 2]);
    return n ? sum / (double)n : 0;
}

static void load_pose(void *context, size_t pose)
{
    const load_job *j = context;
    const vg_graph *g = j->r->solver.g;
    const double *w = j->vectors[pose], *x = j->guesses[pose];
    float *misfit = j->misfits[pose];
    double size = mean_length(w, vg_graph_corners(g));
    size = size >= DBL_MIN && size <= 1 / DBL_MIN ? ldexp(1, ilogb(size)) : 0; /* a power of two, so that scaling is
                                                                                  exact */
    double unit = size > 0 ? 1 / size : 0;
    for (size_t i = 0; i < j->r->rows.nf; i++) {
        size_t begin = g->faces.start[j->r->face[i]], end = g->faces.start[j->r->face[i] + 1];
        const double *x0 = x + 3 * (size_t)g->faces.vert[begin], *w0 = w + 3 * begin;
        for (size_t c = begin + 1; c < end; c++)
            for (size_t k = 0; k < 3; k++)
                *misfit++ = (float)(unit * ((x[3 * (size_t)g->faces.vert[c] + k] - x0[k]) - (w[3 * c + k] - w0[k])));
    }
    j->sizes[pose] = size;
}

void vg_robust_load(const vg_robust *b, size_t n, const double *const *vectors, const double *const *guesses,
                    float *const *misfits, double *sizes)
{
    load_job j = {b, vectors, guesses, misfits, sizes};
    vgi_parallel(b->solver.threads, n, load_pose, &j);
}

/* ---- the search ---- */

typedef struct search {
    const vg_robust *r;
    room m;
    vgi_robust_faces faces;
    vgi_lanes soft2, scale, slope, t, energy; /* scale: of the initial Hessian; slope: of the energy along d */
    bool active[VGI_LANES], falling[VGI_LANES]; /* falling: the last round gained more than enough */
    size_t rounds;
    size_t lanes;                      /* number of poses */
    const vg_solver *other[VGI_LANES]; /* solver that a pose uses instead of r's, or NULL */
} search;

static bool any_active(const search *s)
{
    bool any = false;
    for (int k = 0; k < VGI_LANES; k++) any |= s->active[k];
    return any;
}

/* Energy and gradient with the vertices displaced by u. */
static void evaluate_energy(const search *s, const vgi_row *u, vgi_row *g, vgi_robust_sums *sums)
{
    memset(g, 0, (s->r->solver.rows + s->r->rows.nheld) * sizeof *g);
    vgi_robust_kernel_now()->energy(&s->faces, s->m.misfit, u, s->soft2, g, s->m.corners, sums);
}

enum { FEW = 5 }; /* up to this many poses are solved faster one by one than all lanes together */

/* z := N^-1 g, each pose with its own solver; 0 at vertices that it holds. of: the poses to compute; z of the others
 * is undefined. */
static void precondition(const search *s, const bool *of, const vgi_row *g, vgi_row *z)
{
    size_t rows = s->r->solver.rows, plain = 0;
    for (size_t k = 0; k < s->lanes; k++) plain += of[k] && !s->other[k];
    if (plain > FEW) {
        memcpy(z, g, rows * sizeof *z);
        vgi_factor_solve(s->r->solver.factor, z);
        memset(z + rows, 0, (s->r->moved - rows) * sizeof *z);
        plain = 0;
    } else {
        memset(z, 0, s->r->moved * sizeof *z);
    }
    for (size_t k = 0; k < s->lanes; k++)
        if (of[k] && (s->other[k] || plain)) vgi_solver_solve_lane(s->other[k] ? s->other[k] : s->r->s, k, g, z, s->m.points);
}

/* Choose the softness c of the absolute value at 0 from the misfits of the plain solution, and mark the poses that
 * have a misfit. */
static void choose_softness(search *s)
{
    vgi_robust_sums sums;
    vgi_robust_kernel_now()->energy(&s->faces, s->m.misfit, s->m.u, NULL, NULL, s->m.corners, &sums);
    for (int k = 0; k < VGI_LANES; k++) {
        double mean = sums.energy[k] / (double)s->r->rows.nf, soft = s->r->eps * mean;
        s->active[k] = (size_t)k < s->lanes && mean > exact && soft * soft >= DBL_MIN && isfinite(soft * soft);
        s->soft2[k] = s->active[k] ? soft * soft : 1;
    }
}

static void begin_search(search *s)
{
    size_t n = s->r->moved;
    vgi_robust_sums sums;
    vgi_robust_products p;
    vgi_lanes abc[3] = {{0}};
    evaluate_energy(s, s->m.u, s->m.g, &sums);
    precondition(s, s->active, s->m.g, s->m.z);
    vgi_robust_kernel_now()->multiply(n, s->m.g, s->m.g, s->m.z, s->m.z, s->m.z, &p);
    for (int k = 0; k < VGI_LANES; k++) {
        s->scale[k] = (double)s->r->rows.nf / sums.weight[k];
        s->energy[k] = sums.energy[k];
        s->slope[k] = -s->scale[k] * p.gz[k];
        s->t[k] = s->active[k];
        abc[2][k] = s->active[k] ? -s->scale[k] : 0;
    }
    memset(s->m.d, 0, n * sizeof *s->m.d);
    vgi_robust_kernel_now()->turn(n, abc, s->m.z, s->m.z, s->m.d);
}

/* Step length at the minimum of the parabola through the energies at both ends and the slope at the first, kept away
 * from both ends. */
static double shorter_step(double t, double slope, double rise)
{
    double least = -slope * t * t / (2 * (rise - slope * t));
    return least > 0.1 * t && least < 0.5 * t ? least : least >= 0.5 * t ? 0.5 * t : 0.1 * t;
}

/* u := u + t d with sufficient decrease of the energy. A pose for which no such t is found is done. */
static void line_search(search *s, vgi_robust_sums *sums)
{
    size_t n = s->r->moved;
    for (int tries = 0;; tries++) {
        bool again = false;
        vgi_robust_kernel_now()->step(n, s->m.u, s->t, s->m.d, s->m.trial);
        evaluate_energy(s, s->m.trial, s->m.gn, sums);
        for (int k = 0; k < VGI_LANES; k++) {
            double rise = sums->energy[k] - s->energy[k];
            if (!s->active[k] || rise <= sufficient * s->t[k] * s->slope[k]) continue;
            if (tries == HALVINGS) s->t[k] = 0, s->active[k] = s->falling[k] = false;
            else s->t[k] = shorter_step(s->t[k], s->slope[k], rise);
            again = true;
        }
        if (!again) break;
    }
    vgi_row *u = s->m.u;
    s->m.u = s->m.trial, s->m.trial = u;
}

static void judge_round(search *s, const vgi_robust_sums *sums)
{
    s->rounds++;
    for (int k = 0; k < VGI_LANES; k++) {
        if (!s->active[k]) continue;
        s->falling[k] = s->energy[k] - sums->energy[k] >= enough * s->energy[k];
        s->active[k] = s->falling[k];
        s->energy[k] = sums->energy[k];
    }
}

/* d := -H gn, H the inverse Hessian of BFGS after one step, s = t d, y = gn - g, from H0 = scale N^-1. */
static void choose_direction(search *s)
{
    size_t n = s->r->moved;
    vgi_robust_products p;
    vgi_lanes abc[3] = {{0}};
    vgi_robust_kernel_now()->multiply(n, s->m.g, s->m.gn, s->m.z, s->m.zn, s->m.d, &p);
    for (int k = 0; k < VGI_LANES; k++) {
        if (!s->active[k]) {
            s->t[k] = 0;
            continue;
        }
        bool convex = p.dy[k] > 0 && p.yv[k] > 0;
        if (convex) s->scale[k] = s->t[k] * p.dy[k] / p.yv[k];
        double h = s->scale[k], a = convex ? p.dg[k] / p.dy[k] : 0;
        double b = convex ? h * (p.yz[k] - a * p.yv[k]) / (s->t[k] * p.dy[k]) : 0;
        abc[0][k] = convex ? (b - a) * s->t[k] : 0, abc[1][k] = -h * a, abc[2][k] = h * (a - 1);
        s->slope[k] = abc[0][k] * p.dg[k] + abc[1][k] * (p.gz[k] - p.yz[k]) + abc[2][k] * p.gz[k];
        s->t[k] = 1;
    }
    vgi_robust_kernel_now()->turn(n, abc, s->m.z, s->m.zn, s->m.d);
    vgi_row *g = s->m.g, *z = s->m.z;
    s->m.g = s->m.gn, s->m.gn = g, s->m.z = s->m.zn, s->m.zn = z;
}

static void run_search(search *s)
{
    vgi_robust_sums sums;
    choose_softness(s);
    if (!any_active(s) || !s->r->rounds) return;
    begin_search(s);
    for (;;) {
        line_search(s, &sums);
        judge_round(s, &sums);
        if (!any_active(s) || s->rounds == s->r->rounds) return;
        precondition(s, s->active, s->m.gn, s->m.zn);
        choose_direction(s);
    }
}

/* ---- blocks of eight poses ---- */

typedef struct robust_job {
    vg_robust *r;
    size_t n;
    vg_solver *const *each;
    const double *const *rhs;
    const float *const *misfits;
    const double *sizes;
    double *const *x;
    const double *const *anchors, *const *roots;
} robust_job;

/* The right-hand sides as rows. */
static void load_rows(const search *s, const double *const *rhs, vgi_row *g)
{
    const vgi_solver_view *v = &s->r->solver;
    memset(g, 0, (v->rows + s->r->rows.nheld) * sizeof *g); /* those of centroids are 0 */
    vgi_load_rows(g, v->row, v->g->faces.nv, v->rows, rhs);
    for (size_t i = v->rows; i < s->r->moved; i++)
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < VGI_LANES; k++) g[i].xyz[c][k] = rhs[k][3 * (size_t)s->r->rows.held[i - v->rows] + c];
}

/* Add the displacements to the poses. */
static void add_rows(const search *s, double *const *x)
{
    const vgi_solver_view *v = &s->r->solver;
    vgi_add_rows(s->m.u, v->row, v->g->faces.nv, v->rows, x, s->lanes);
    for (size_t i = v->rows; i < s->r->moved; i++)
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < s->lanes; k++) x[k][3 * (size_t)s->r->rows.held[i - v->rows] + c] += s->m.u[i].xyz[c][k];
}

/* The plain solution as a displacement from the guess, in units of each pose's size. */
static void solve_plainly(const robust_job *j, search *s, size_t first, vgi_lanes size)
{
    const vg_robust *b = j->r;
    size_t all = b->solver.rows + b->rows.nheld;
    const double *rhs[VGI_LANES];
    const float *misfit[VGI_LANES];
    vgi_lanes unit;
    for (size_t k = 0; k < VGI_LANES; k++) {
        size_t from = first + (k < s->lanes ? k : s->lanes - 1);
        rhs[k] = j->rhs[from], misfit[k] = j->misfits[from];
        size[k] = j->sizes[from] > 0 ? j->sizes[from] : 1, unit[k] = 1 / size[k];
    }
    memset(s->m.u, 0, all * sizeof *s->m.u); /* rows of held vertices stay 0 */
    memset(s->m.trial, 0, all * sizeof *s->m.trial);
    load_rows(s, rhs, s->m.g);
    bool every[VGI_LANES];
    for (size_t k = 0; k < VGI_LANES; k++) every[k] = true;
    precondition(s, every, s->m.g, s->m.u);
    vgi_robust_kernel_now()->scale(b->moved, unit, s->m.u);
    vgi_robust_kernel_now()->interleave(b->nmisfits, misfit, s->m.misfit);
}

static void choose_solvers(const robust_job *j, search *s, size_t first)
{
    for (size_t k = 0; k < s->lanes && j->each; k++) s->other[k] = j->each[first + k] != j->r->s ? j->each[first + k] : NULL;
}

static void robust_block(void *context, size_t i)
{
    const robust_job *j = context;
    const vg_robust *b = j->r;
    size_t first = i * VGI_LANES, lanes = j->n - first < VGI_LANES ? j->n - first : VGI_LANES;
    search s = {.r = b, .m = b->rooms[i], .lanes = lanes,
                .faces = {b->rows.nf, b->rows.start, b->rows.row, b->entry, b->metric, b->star}};
    vgi_lanes size;
    choose_solvers(j, &s, first);
    if (b->moved) {
        solve_plainly(j, &s, first, size);
        run_search(&s);
        vgi_robust_kernel_now()->scale(b->moved, size, s.m.u);
        add_rows(&s, j->x + first);
    }
    vg_robust_stats *found = &b->found[i];
    if (s.rounds > found->most_rounds) found->most_rounds = s.rounds;
    for (size_t k = 0; k < lanes; k++) {
        const vg_solver *own = s.other[k] ? s.other[k] : b->s;
        bool held = own->nanchors > 0;
        vgi_solver_place(own, j->x[first + k], held ? j->anchors[first + k] : j->roots[first + k]);
        found->unfinished += s.falling[k];
    }
}

int vg_robust_solve(vg_robust *b, size_t n, vg_solver *const *each, const double *const *rhs, const float *const *misfits, const double *sizes,
                    double *const *x, const double *const *anchors, const double *const *roots, vg_err *e)
{
    if (!n) return VG_OK;
    int r = make_rooms(b, (n + VGI_LANES - 1) / VGI_LANES, e);
    if (r < 0) return r;
    size_t most = VGI_LANES * b->nrooms;
    for (size_t done = 0; done < n; done += most) {
        size_t some = n - done < most ? n - done : most;
        robust_job j = {b, some, each ? each + done : NULL, rhs + done, misfits + done, sizes + done, x + done,
                        anchors ? anchors + done : NULL, roots ? roots + done : NULL};
        vgi_parallel(b->solver.threads, (some + VGI_LANES - 1) / VGI_LANES, robust_block, &j);
    }
    b->stats = (vg_robust_stats){0};
    for (size_t i = 0; i < b->nrooms; i++) {
        if (b->found[i].most_rounds > b->stats.most_rounds) b->stats.most_rounds = b->found[i].most_rounds;
        b->stats.unfinished += b->found[i].unfinished;
    }
    return VG_OK;
}
