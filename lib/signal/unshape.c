/* unshape.c: shapes that are not vertices: converted to vectors, and the distance of the resulting vertices from the
 * poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/unshape.h"
#include "numeric/blas.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { MOST = 64 }; /* most poses solved at a time */

/* ---- of a signal ---- */

struct vg_unshaper {
    const vg_signal *s;
    vgi_space space;
    vg_solver *solver;   /* NULL until vertices are requested */
    double *reference, root[3];
    double *vectors, *rhs; /* of one pose */
};

int vg_unshaper_new(vg_unshaper **out, const vg_signal *s, const vg_graph *g, const double *reference, vg_err *e)
{
    vg_unshaper *u = *out = vgi_array(1, sizeof *u, e);
    if (!u) return VG_ENOMEM;
    u->s = s;
    int r = s->space == VG_SPACE_VERTICES ? vg_fail(e, VG_EARG, "the shapes of the signal are vertices")
                                          : vgi_space_make(&u->space, s->space, g, reference, e);
    if (r == VG_OK && (u->space.d != s->d || vgi_space_homes(&u->space) != s->nturns))
        r = vg_fail(e, VG_EINPUT, "the shapes of the signal are not of this mesh");
    if (r == VG_OK && !(u->reference = vgi_copy_array(reference, g->faces.nv, 3 * sizeof *reference, e))) r = VG_ENOMEM;
    if (r < 0) vg_unshaper_free(out);
    return r;
}

void vg_unshaper_free(vg_unshaper **out)
{
    if (!*out) return;
    vgi_space_clear(&(*out)->space);
    vg_solver_free(&(*out)->solver);
    free((*out)->reference);
    free((*out)->vectors);
    free((*out)->rhs);
    free(*out);
    *out = NULL;
}

int vg_unshaper_vectors(vg_unshaper *u, const double *shape, double *vectors, vg_err *e)
{
    return vgi_space_vectors(&u->space, u->s->home_turn, shape, vectors, e);
}

static int make_solver(vg_unshaper *u, vg_err *e)
{
    const vg_graph *g = u->space.g;
    if (u->solver) return VG_OK;
    vg_graph_root(g, u->reference, u->root);
    if (!(u->vectors = vgi_array(vg_graph_corners(g), 3 * sizeof(double), e)) ||
        !(u->rhs = vgi_array(g->faces.nv, 3 * sizeof(double), e)))
        return VG_ENOMEM;
    return vg_solver_new(&u->solver, g, NULL, 0, u->reference, VG_WEIGHTS_AREA, 1, e);
}

int vgi_unshaper_vertices(vg_unshaper *u, const double *shape, double *vertices, vg_err *e)
{
    int r = make_solver(u, e);
    if (r == VG_OK) r = vg_unshaper_vectors(u, shape, u->vectors, e);
    if (r < 0) return r;
    vg_solver_load(u->solver, 1, (const double *const[]){u->vectors}, NULL, (double *const[]){vertices},
                   (double *const[]){u->rhs});
    vg_solver_solve(u->solver, 1, (const double *const[]){u->rhs}, (double *const[]){vertices}, NULL,
                    (const double *const[]){u->root});
    return VG_OK;
}

/* ---- errors ---- */

void vgi_unshape_clear(vgi_unshape *u)
{
    vgi_space_clear(&u->space);
    vg_solver_free(&u->solver);
    free(u->poses);
    free(u->home);
    free(u->shape);
    free(u->vectors);
    free(u->x);
    free(u->rhs);
    free(u->distance);
    free(u->squares);
    *u = (vgi_unshape){0};
}

int vgi_unshape_make(vgi_unshape *u, vg_space kind, const vg_graph *g, const double *reference, int threads, vg_err *e)
{
    int r = vgi_space_make(&u->space, kind, g, reference, e);
    if (r == VG_OK) r = vg_solver_new(&u->solver, g, NULL, 0, reference, VG_WEIGHTS_AREA, threads, e);
    if (r < 0) return r;
    u->batch = vg_solver_batch(u->solver) < MOST ? vg_solver_batch(u->solver) : MOST;
    size_t batch = u->batch, values = 3 * g->faces.nv;
    vg_graph_root(g, reference, u->root);
    return (u->home = vgi_array(vgi_space_homes(&u->space), 4 * sizeof(double), e)) &&
           (u->shape = vgi_array(batch, u->space.d * sizeof(double), e)) &&
           (u->vectors = vgi_array(batch * vg_graph_corners(g), 3 * sizeof(double), e)) &&
           (u->x = vgi_array(batch, values * sizeof(double), e)) &&
           (u->rhs = vgi_array(batch, values * sizeof(double), e)) ? VG_OK : VG_ENOMEM;
}

/* The vertices of a batch of shapes (u->shape). */
static int solve_shapes(vgi_unshape *u, size_t n, vg_err *e)
{
    const vg_graph *g = u->space.g;
    size_t corners = vg_graph_corners(g);
    const double *vectors[MOST], *rhs[MOST], *roots[MOST];
    double *x[MOST], *b[MOST];
    for (size_t i = 0; i < n; i++) {
        int r = vgi_space_vectors(&u->space, u->home, u->shape + i * u->space.d, u->vectors + 3 * i * corners, e);
        if (r < 0) return r;
        vectors[i] = u->vectors + 3 * i * corners;
        x[i] = u->x + 3 * i * g->faces.nv, rhs[i] = b[i] = u->rhs + 3 * i * g->faces.nv;
        roots[i] = u->root;
    }
    vg_solver_load(u->solver, n, vectors, NULL, x, b);
    vg_solver_solve(u->solver, n, rhs, x, NULL, roots);
    return VG_OK;
}

static void measure_frame(vgi_unshape *u, size_t frame, const double *x)
{
    const vg_graph *g = u->space.g;
    const double *pose = u->poses + 3 * frame * g->faces.nv;
    double most = 0, *sum = u->squares + frame;
    *sum = 0;
    for (size_t v = 0; v < g->faces.nv; v++) {
        if (!g->in_face[v]) continue;
        double square = vgi_square(pose + 3 * v, x + 3 * v);
        *sum += square;
        most = fmax(most, square);
    }
    u->distance[frame] = sqrt(most);
    if (most > u->most) u->most = most, u->worst = frame;
}

int vgi_unshape_error(vgi_unshape *u, const vgi_basis *b, const double *x, size_t stride, size_t m, double limit,
                      vgi_error *error, vg_err *e)
{
    size_t n = b->n, d = b->d, batch = u->batch, groups = (n + batch - 1) / batch;
    size_t start = u->worst / batch;
    double sum = 0;
    if (!u->distance && !(u->distance = vgi_array(n, sizeof *u->distance, e))) return VG_ENOMEM;
    if (!u->squares && !(u->squares = vgi_array(n, sizeof *u->squares, e))) return VG_ENOMEM;
    u->most = 0;
    for (size_t group = 0; group < groups && !(sqrt(u->most) > limit); group++) {
        size_t first = (start + group) % groups * batch, some = n - first < batch ? n - first : batch;
        vgi_blas_alone();
        if (m) vgi_product_double(some, d, m, x + first * stride, stride, b->vectors, d, u->shape, d);
        else memset(u->shape, 0, some * d * sizeof *u->shape);
        vgi_blas_shared();
        for (size_t i = 0; i < some; i++)
            for (size_t c = 0; c < d; c++) u->shape[i * d + c] += b->mean[c];
        int r = solve_shapes(u, some, e);
        if (r < 0) return r;
        for (size_t i = 0; i < some; i++) measure_frame(u, first + i, u->x + 3 * i * u->space.g->faces.nv);
    }
    for (size_t i = 0; i < n; i++) sum += u->squares[i]; /* in the order of frames: batches depend on the threads */
    error->most = sqrt(u->most);
    error->rms = sqrt(sum / (double)n / (double)(u->space.g->attached ? u->space.g->attached : 1));
    if (error->of_frame) memcpy(error->of_frame, u->distance, n * sizeof *u->distance);
    return VG_OK;
}
