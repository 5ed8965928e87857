/* planar.c: poses with more nearly planar polygons: minimises w1 times the energy of the reconstruction plus w2 times
 * the sum over corners of faces with four or more of (m_f . t_c)^2, m_f the normal of the wanted vectors (MATH 5; T
 * 4.2.3).
 *
 * x, y and z are coupled, and the matrix M = w1 N + w2 P differs from pose to pose, so it is not factorised. P lies
 * between 0 and N (of uniform weights). Hence conjugate gradients preconditioned by the one factor of N see only
 * eigenvalues between w1 and w1 + w2, on any mesh. They start from the plain solution V, where the residual is -w2 P
 * V, and solve for the difference from it. Products with N are not needed: with p := z + beta p and z = N^-1 r, N p
 * := r + beta N p.
 *
 * Eight poses are solved side by side, each with its own coefficients and stopping point, so that a pose does not
 * depend on its neighbours. The loops over rows are in planar_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/face_rows.h"
#include "method/vectors/planar_kernel.h"
#include "numeric/vec3.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum {
    CORNERS = 4, /* of the smallest face that may be bent */
    LIMIT = 1000 /* steps; about 40 suffice for weights of 0.05 and 1 */
};
static const double enough = 1e-10; /* relative to the initial residual, in the norm of N^-1 */
static const double thin = 1e-12;   /* a face with an area below this part of its squared vectors has no normal */

/* Workspace of one block of eight poses. */
typedef struct room {
    vgi_row *x, *r, *z, *p, *s, *y; /* rows of unknowns; p and y also have the held vertices after them */
    vgi_row *normals;               /* one per planar face */
    vgi_lanes *h;
} room;

struct vg_planar {
    vgi_solver_view solver;
    double ratio;        /* w2 / w1: the system is N + ratio P */
    vgi_face_rows faces; /* with four or more corners */
    vgi_row *memory;
    room *rooms;         /* one per thread */
    vg_planar_stats *found; /* per thread */
    vg_planar_stats stats;
};

static int make_rooms(vg_planar *p, vg_err *e)
{
    size_t n = p->solver.rows, all = n + p->faces.nheld, largest = (p->solver.g->max_corners + 2) / 3, each, total;
    size_t threads = (size_t)p->solver.threads;
    each = 4 * n + 2 * all + p->faces.nf + largest + 1; /* even for the largest possible mesh all are below 2^33 */
    p->rooms = vgi_array(threads, sizeof *p->rooms, e);
    p->found = vgi_array(threads, sizeof *p->found, e);
    if (!p->rooms || !p->found) return VG_ENOMEM;
    if (p->faces.nf == 0) return VG_OK; /* vg_planar_solve has nothing to do */
    if (vgi_mul(each, threads, &total) && vgi_mul(total, sizeof *p->memory, &total))
        p->memory = aligned_alloc(sizeof(vgi_lanes), total);
    if (!p->memory) return vg_fail(e, VG_ENOMEM, "not enough memory to make %zu faces planar", p->faces.nf);
    for (size_t i = 0; i < threads; i++) {
        room *m = &p->rooms[i];
        vgi_row *at = p->memory + i * each;
        m->x = at, m->r = m->x + n, m->z = m->r + n, m->s = m->z + n, m->p = m->s + n, m->y = m->p + all;
        m->normals = m->y + all, m->h = (m->normals + p->faces.nf)->xyz;
    }
    return VG_OK;
}

int vg_planar_new(vg_planar **out, const vg_solver *s, double fidelity, double planarity, vg_err *e)
{
    *out = NULL;
    if (!(fidelity > 0) || !(planarity >= 0) || !isfinite(planarity / fidelity))
        return vg_fail(e, VG_EARG, "the weights of planarity must be one above 0 and one of at least 0, not %g and %g",
                       fidelity, planarity);
    vg_planar *p = *out = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->solver = vgi_solver_look(s);
    p->ratio = planarity / fidelity;
    int r = vgi_face_rows_make(&p->faces, &p->solver, CORNERS, e);
    p->stats.faces = p->faces.nf;
    if (r == VG_OK) r = make_rooms(p, e);
    if (r < 0) vg_planar_free(out);
    return r;
}

void vg_planar_free(vg_planar **out)
{
    vg_planar *p = *out;
    if (!p) return;
    vgi_face_rows_clear(&p->faces);
    free(p->memory);
    free(p->rooms);
    free(p->found);
    free(p);
    *out = NULL;
}

size_t vg_planar_faces(const vg_planar *p)
{
    return p->faces.nf;
}

vg_planar_stats vg_planar_get_stats(const vg_planar *p)
{
    return p->stats;
}

/* The normalised mean of the cross products of successive vectors; 0 if there is none. Adding a constant to all
 * vectors of a face changes nothing (they need not sum to 0), so they are taken relative to the first, in units of
 * the largest. */
static void face_normal(const double *w, size_t r, double m[3])
{
    double n[3] = {0, 0, 0}, size = 0, largest = 0;
    for (size_t i = 3; i < 3 * r; i++) largest = fmax(largest, fabs(w[i] - w[i % 3]));
    double scale = largest >= DBL_MIN && largest < INFINITY ? 1 / largest : 0;
    for (size_t i = 1; i + 1 < r; i++) {
        double a[3], b[3], c[3];
        vgi_subtract(w + 3 * i, w, a), vgi_scale(a, scale);
        vgi_subtract(w + 3 * (i + 1), w, b), vgi_scale(b, scale);
        vgi_cross(a, b, c);
        vgi_add(n, c);
        size += vgi_dot(a, a);
    }
    double length = vgi_length(n);
    for (int k = 0; k < 3; k++) m[k] = length > thin * size ? n[k] / length : 0;
}

void vg_planar_load(const vg_planar *p, const double *vectors, double *normals)
{
    const vg_graph *g = p->solver.g;
    for (size_t i = 0; i < p->faces.nf; i++) {
        size_t f = p->faces.face[i];
        face_normal(vectors + 3 * (size_t)g->faces.start[f], g->faces.start[f + 1] - g->faces.start[f], normals + 3 * i);
    }
}

/* ---- conjugate gradients ---- */

typedef struct plane_job {
    vg_planar *p;
    size_t n;
    const double *const *normals;
    double *const *x;
    bool *converged; /* n */
} plane_job;

/* Residual of the plain solution, -ratio P V. Each pose is in units of its largest entry, which is returned in
 * `unit`. */
static void load_residual(const vg_planar *p, const room *m, const vgi_planar_faces *f, const double *const *pose,
                          vgi_lanes unit)
{
    const vgi_planar_kernel *kernel = vgi_planar_kernel_now();
    size_t n = p->solver.rows;
    vgi_lanes none, most, factor;
    memset(m->y, 0, (n + p->faces.nheld) * sizeof *m->y);
    memset(m->p, 0, (n + p->faces.nheld) * sizeof *m->p); /* rows of centroids stay 0 */
    vgi_load_rows(m->p, p->solver.row, p->solver.g->faces.nv, n, pose);
    for (size_t i = 0; i < p->faces.nheld; i++)
        for (size_t c = 0; c < 3; c++)
            for (int k = 0; k < VGI_LANES; k++) m->p[n + i].xyz[c][k] = pose[k][3 * (size_t)p->faces.held[i] + c];
    kernel->product(f, m->normals, m->p, m->y, m->h, none);
    kernel->largest(n, m->y, most);
    for (int k = 0; k < VGI_LANES; k++) unit[k] = p->ratio * most[k], factor[k] = most[k] > 0 ? -1 / most[k] : 0;
    kernel->scale(n, factor, m->y, m->r);
    memcpy(m->z, m->r, n * sizeof *m->z);
    memset(m->x, 0, n * sizeof *m->x);
    memset(m->s, 0, n * sizeof *m->s);
    memset(m->y, 0, (n + p->faces.nheld) * sizeof *m->y);
    memset(m->p, 0, (n + p->faces.nheld) * sizeof *m->p);
}

/* Remaining residual of each pose, relative to the initial one. Returns whether all poses are done. */
static bool all_done(const vgi_lanes start, const vgi_lanes rz, double *left, bool *active)
{
    bool all = true;
    for (int k = 0; k < VGI_LANES; k++) {
        left[k] = start[k] > 0 ? sqrt(fmax(rz[k], 0) / start[k]) : start[k] == 0 ? 0 : NAN;
        active[k] = left[k] > enough;
        all = all && !active[k];
    }
    return all;
}

/* Conjugate gradients on (N + ratio P) x = r. left[k]: relative residual with which pose k ended. */
static size_t conjugate_gradients(const vg_planar *p, const room *m, const vgi_planar_faces *f, double *left)
{
    const vgi_planar_kernel *kernel = vgi_planar_kernel_now();
    size_t n = p->solver.rows, steps = 0;
    vgi_lanes rz, start, next, ps, pPp, alpha, beta = {0}, gamma;
    bool active[VGI_LANES];
    vgi_factor_solve(p->solver.factor, m->z);
    kernel->dot(n, m->r, m->z, rz);
    memcpy(start, rz, sizeof start);
    for (; !all_done(start, rz, left, active) && steps < LIMIT; steps++) {
        kernel->turn(n, m->z, m->r, beta, m->p, m->s, ps);
        kernel->product(f, m->normals, m->p, m->y, m->h, pPp);
        for (int k = 0; k < VGI_LANES; k++) {
            alpha[k] = active[k] ? rz[k] / (ps[k] + p->ratio * pPp[k]) : 0;
            gamma[k] = alpha[k] * p->ratio;
        }
        kernel->advance(n, alpha, gamma, m->p, m->s, m->y, m->x, m->r, m->z);
        vgi_factor_solve(p->solver.factor, m->z);
        kernel->dot(n, m->r, m->z, next);
        for (int k = 0; k < VGI_LANES; k++) {
            beta[k] = active[k] ? next[k] / rz[k] : 0;
            if (active[k]) rz[k] = next[k];
        }
    }
    return steps;
}

static void note(vg_planar_stats *found, size_t steps, double left)
{
    if (steps > found->most_steps) found->most_steps = steps;
    if (!isnan(found->worst_residual) && !(left <= found->worst_residual)) found->worst_residual = left;
}

static void plane_block(void *context, size_t i)
{
    const plane_job *j = context;
    vg_planar *p = j->p;
    const room *m = &p->rooms[i];
    size_t first = i * VGI_LANES, lanes = j->n - first < VGI_LANES ? j->n - first : VGI_LANES;
    const vgi_planar_faces f = {p->faces.nf, p->faces.start, p->faces.row};
    const double *normals[VGI_LANES], *pose[VGI_LANES];
    double left[VGI_LANES], root[VGI_LANES][3];
    for (size_t k = 0; k < VGI_LANES; k++) {
        size_t from = first + (k < lanes ? k : lanes - 1);
        normals[k] = j->normals[from], pose[k] = j->x[from];
        vg_graph_root(p->solver.g, pose[k], root[k]);
    }
    vgi_load_rows(m->normals, p->faces.order, p->faces.nf, p->faces.nf, normals);
    vgi_lanes unit;
    load_residual(p, m, &f, pose, unit);
    size_t steps = conjugate_gradients(p, m, &f, left);
    vgi_planar_kernel_now()->scale(p->solver.rows, unit, m->x, m->x);
    vgi_add_rows(m->x, p->solver.row, p->solver.g->faces.nv, p->solver.rows, j->x + first, lanes);
    for (size_t k = 0; k < lanes; k++) {
        /* the difference is 0 at the held vertex, but without anchors the mean must stay */
        if (!p->solver.anchored) vgi_keep_root(p->solver.g, j->x[first + k], root[k]);
        j->converged[first + k] = left[k] <= enough;
        note(&p->found[i], steps, left[k]);
    }
}

size_t vg_planar_solve(vg_planar *p, size_t n, const double *const *normals, double *const *x)
{
    enum { ROUND = 256 }; /* poses whose results are recorded together */
    bool converged[ROUND];
    size_t threads = (size_t)p->solver.threads, good = n;
    if (p->faces.nf == 0 || p->solver.rows == 0 || p->ratio == 0) return n; /* the plain solution, bit for bit */
    size_t most = ROUND / VGI_LANES < threads ? ROUND / VGI_LANES : threads;
    for (size_t done = 0; done < n; done += most * VGI_LANES) {
        size_t some = n - done < most * VGI_LANES ? n - done : most * VGI_LANES;
        plane_job j = {.p = p, .n = some, .normals = normals + done, .x = x + done, .converged = converged};
        vgi_parallel(p->solver.threads, (some + VGI_LANES - 1) / VGI_LANES, plane_block, &j);
        for (size_t k = 0; k < some && good == n; k++)
            if (!converged[k]) good = done + k;
    }
    for (size_t i = 0; i < threads; i++) note(&p->stats, p->found[i].most_steps, p->found[i].worst_residual);
    return good;
}
