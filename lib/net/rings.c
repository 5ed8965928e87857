/* rings.c: cotangent rings, components, and the factor for the features of a mesh (MATH 12).
 *
 * Polygons are cut into the fan whose worst triangle is best. Weights are clamped, because those of thin triangles
 * are huge or negative. With the normal as one more direction nearly every ring spans space; where one does not, the
 * missing directions follow the rotation of the others. Poses are in feature_kernel.c, rotation vectors in branch.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/rings.h"
#include "net/heap.h"
#include "model/laplacian.h"
#include "numeric/face.h"
#include "numeric/stats.h"

#include <stdlib.h>

static const double least_weight = 0.05, most_weight = 20, singular = 1e-9, ball_share = 0.15;
enum { BALL_LEAST = 7, SWEEPS = 24 };

static const double *reference_point(const vgi_rings *x, size_t v)
{
    return x->reference + 3 * v;
}

/* ---- triangles ---- */

/* twice the area divided by the sum of squared sides: larger is better */
static double quality(const double *a, const double *b, const double *c)
{
    double n[3];
    vgi_triangle_normal(a, b, c, n);
    return vgi_length(n) / (vgi_square(a, b) + vgi_square(a, c) + vgi_square(b, c) + 1e-300);
}

static double worst_of_fan(const vgi_rings *x, const uint32_t *vert, size_t n, size_t from)
{
    double worst = INFINITY;
    for (size_t i = 1; i + 1 < n; i++)
        worst = fmin(worst, quality(reference_point(x, vert[from]), reference_point(x, vert[(from + i) % n]),
                                    reference_point(x, vert[(from + i + 1) % n])));
    return worst;
}

static void cut_face(vgi_rings *x, const uint32_t *vert, size_t n)
{
    size_t best = 0;
    double most = -1;
    for (size_t s = 0; s < (n == 3 ? 1 : n == 4 ? 2 : n); s++) {
        double q = worst_of_fan(x, vert, n, s);
        if (q > most) most = q, best = s;
    }
    for (size_t i = 1; i + 1 < n; i++) {
        uint32_t *t = x->triangle + 3 * x->ntriangles++;
        t[0] = vert[best], t[1] = vert[(best + i) % n], t[2] = vert[(best + i + 1) % n];
    }
}

static int cut_faces(vgi_rings *x, const vg_mesh *m, vg_err *e)
{
    size_t most = 0;
    for (size_t f = 0; f < m->nf; f++) most += m->start[f + 1] - m->start[f] - 2;
    x->triangle = vgi_array_raw(3 * most, sizeof *x->triangle, e);
    if (!x->triangle) return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++) {
        size_t n = m->start[f + 1] - m->start[f];
        if (n > 2) cut_face(x, m->vert + m->start[f], n);
    }
    return VG_OK;
}

/* ---- edges ---- */

enum { OF_TRIANGLE = 1, OF_SEGMENT = 2 }; /* kinds of edges */

/* the cotangent of the angle at a */
static double cotangent(const double *a, const double *b, const double *c)
{
    double u[3], v[3], n[3];
    vgi_subtract(b, a, u), vgi_subtract(c, a, v);
    vgi_cross(u, v, n);
    return vgi_dot(u, v) / fmax(vgi_length(n), 1e-12 * fmax(vgi_dot(u, u), vgi_dot(v, v)) + 1e-300);
}

static int list_edges(const vgi_rings *x, const vg_mesh *m, vgi_edges *list, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < x->ntriangles; i++) {
        const uint32_t *t = x->triangle + 3 * i;
        for (int k = 0; k < 3 && r == VG_OK; k++) {
            uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
            r = vgi_edges_add(list, b, c, cotangent(reference_point(x, a), reference_point(x, b), reference_point(x, c)) / 2, OF_TRIANGLE, e);
        }
    }
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        const uint32_t *vert = m->vert + m->start[f];
        if (m->start[f + 1] - m->start[f] == 2) r = vgi_edges_add(list, vert[0], vert[1], 0, OF_SEGMENT, e);
    }
    return r;
}

static int make_edges(vgi_rings *x, const vg_mesh *m, vg_err *e)
{
    vgi_edges list = {0};
    vgi_laplacian L = {0};
    int r = list_edges(x, m, &list, e);
    if (r == VG_OK) r = vgi_laplacian_make(&L, x->nv, &list, e);
    vgi_edges_clear(&list);
    if (r < 0) return r;
    size_t n = L.first[x->nv];
    x->edge = vgi_array_raw(3 * n, sizeof *x->edge, e);
    x->gradient = vgi_array_raw(3 * n, sizeof *x->gradient, e);
    for (size_t i = 0; i < n; i++)
        L.weight[i] = L.kinds[i] == OF_SEGMENT ? 1 : fmin(fmax(L.weight[i], least_weight), most_weight);
    for (size_t v = 0; x->edge && v < x->nv; v++)
        for (uint32_t i = L.first[v]; i < L.first[v + 1]; i++)
            vgi_subtract(reference_point(x, v), reference_point(x, L.to[i]), x->edge + 3 * (size_t)i);
    x->first = L.first, x->to = L.to, x->weight = L.weight;
    L.first = L.to = NULL, L.weight = NULL;
    vgi_laplacian_clear(&L);
    return x->edge && x->gradient ? VG_OK : VG_ENOMEM;
}

/* ---- components, their centres, the ball ---- */

static int find_parts(vgi_rings *x, const vg_mesh *m, vg_err *e)
{
    uint32_t *label = vgi_array_raw(x->nv, sizeof *label, e);
    x->part = vgi_array_raw(x->nv, sizeof *x->part, e);
    int r = label && x->part ? vg_mesh_components(m, label, &x->nparts, e) : VG_ENOMEM;
    if (r == VG_OK && !(x->part_size = vgi_array(x->nparts, sizeof *x->part_size, e))) r = VG_ENOMEM;
    for (size_t v = 0; r == VG_OK && v < x->nv; v++) {
        x->part[v] = label[v] == UINT32_MAX ? VGI_NO_PART : (int)label[v];
        if (x->part[v] >= 0) x->part_size[x->part[v]]++;
    }
    for (size_t p = 0; r == VG_OK && p < x->nparts; p++)
        if (x->part_size[p] > x->part_size[x->main_part]) x->main_part = p;
    free(label);
    return r;
}

/* Distances along edges from vertex v to all vertices of its component (others: INFINITY). heap: 2 nv numbers of workspace. */
static void find_distances(const vgi_rings *x, uint32_t v, double *distance, uint32_t *heap)
{
    vgi_heap h = {0, heap, heap + x->nv, distance};
    for (size_t i = 0; i < x->nv; i++) distance[i] = INFINITY, h.place[i] = UINT32_MAX;
    distance[v] = 0;
    vgi_heap_lower(&h, v);
    while (h.n) {
        uint32_t a = vgi_heap_take(&h);
        for (uint32_t i = x->first[a]; i < x->first[a + 1]; i++) {
            double far = distance[a] + vgi_length(x->edge + 3 * (size_t)i);
            if (!(far < distance[x->to[i]])) continue;
            distance[x->to[i]] = far;
            vgi_heap_lower(&h, x->to[i]);
        }
    }
}

/* Sources are spread: each is the vertex farthest from those before. The largest distance to them is, for every
 * vertex, nearly the distance to the farthest vertex. most, near, from: nv numbers. */
static uint32_t find_centre(const vgi_rings *x, size_t part, double *most, double *near, double *from, uint32_t *heap)
{
    uint32_t v = 0;
    while (x->part[v] != (int)part) v++;
    for (size_t i = 0; i < x->nv; i++) most[i] = 0, near[i] = INFINITY;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        find_distances(x, v, from, heap);
        for (size_t i = 0; i < x->nv; i++) {
            if (x->part[i] != (int)part) continue;
            most[i] = fmax(most[i], from[i]);
            near[i] = sweep ? fmin(near[i], from[i]) : INFINITY; /* the first source is arbitrary and does not count */
        }
        const double *farthest = sweep ? near : from;
        for (size_t i = 0; i < x->nv; i++)
            if (x->part[i] == (int)part && farthest[i] > farthest[v]) v = (uint32_t)i;
    }
    uint32_t best = v;
    for (size_t i = 0; i < x->nv; i++)
        if (x->part[i] == (int)part && most[i] < most[best]) best = (uint32_t)i;
    return best;
}

/* the vertices within a fraction of the largest distance from the centre, at least seven; sorted: nv numbers */
static int find_ball(vgi_rings *x, const double *from, double *sorted, vg_err *e)
{
    size_t n = 0;
    double farthest = 0;
    for (size_t v = 0; v < x->nv; v++)
        if (x->part[v] == (int)x->main_part) sorted[n++] = from[v], farthest = fmax(farthest, from[v]);
    qsort(sorted, n, sizeof *sorted, vgi_by_number);
    double radius = fmax(ball_share * farthest, sorted[n < BALL_LEAST ? n - 1 : BALL_LEAST - 1]);
    if (!(x->ball = vgi_array_raw(n, sizeof *x->ball, e))) return VG_ENOMEM;
    for (size_t v = 0; v < x->nv; v++)
        if (x->part[v] == (int)x->main_part && from[v] <= radius) x->ball[x->nball++] = (uint32_t)v;
    return VG_OK;
}

static int find_centres(vgi_rings *x, vg_err *e)
{
    double *work = vgi_array_raw(3 * x->nv, sizeof *work, e);
    uint32_t *heap = vgi_array_raw(x->nv, 2 * sizeof *heap, e);
    x->centre = vgi_array_raw(x->nparts, sizeof *x->centre, e);
    int r = work && heap && x->centre ? VG_OK : VG_ENOMEM;
    for (size_t p = 0; r == VG_OK && p < x->nparts; p++)
        x->centre[p] = find_centre(x, p, work, work + x->nv, work + 2 * x->nv, heap);
    if (r == VG_OK) {
        find_distances(x, x->centre[x->main_part], work, heap);
        r = find_ball(x, work, work + x->nv, e);
    }
    free(work);
    free(heap);
    return r;
}

/* ---- rings ---- */

/* eigenvectors of a symmetric matrix by Jacobi rotations: the columns of x; a becomes diagonal */
static void diagonalise(double a[9], double x[9])
{
    for (int i = 0; i < 9; i++) x[i] = i % 4 == 0;
    for (int sweep = 0; sweep < 12; sweep++)
        for (int i = 0; i < 2; i++)
            for (int j = i + 1; j < 3; j++) {
                if (a[3 * i + j] == 0) continue;
                double t = (a[4 * j] - a[4 * i]) / (2 * a[3 * i + j]);
                t = (t < 0 ? -1 : 1) / (fabs(t) + sqrt(t * t + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c, turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, back[9];
                turn[4 * i] = turn[4 * j] = c, turn[3 * i + j] = s, turn[3 * j + i] = -s;
                for (int p = 0; p < 9; p++) back[p] = turn[3 * (p % 3) + p / 3];
                vgi_multiply(back, a, a);
                vgi_multiply(a, turn, a);
                vgi_multiply(x, turn, x);
                a[3 * i + j] = a[3 * j + i] = 0;
            }
}

/* The pseudo-inverse of m, and the projector onto its null space. Returns true if the null space is not empty. */
static bool invert_ring(const double m[9], double inverse[9], double open[9])
{
    double a[9], x[9], most = 0;
    bool any = false;
    memcpy(a, m, sizeof a);
    diagonalise(a, x);
    for (int i = 0; i < 3; i++) most = fmax(most, a[4 * i]);
    for (int i = 0; i < 9; i++) inverse[i] = open[i] = 0;
    for (int i = 0; i < 3; i++) {
        double direction[3] = {x[i], x[3 + i], x[6 + i]};
        bool missing = !(a[4 * i] > singular * most);
        vgi_add_outer(missing ? open : inverse, missing ? 1 : 1 / a[4 * i], direction, direction);
        any |= missing;
    }
    return any;
}

static void unit_normals(const vgi_rings *x, double *n)
{
    memset(n, 0, 3 * x->nv * sizeof *n);
    for (size_t i = 0; i < x->ntriangles; i++) {
        const uint32_t *t = x->triangle + 3 * i;
        double c[3];
        vgi_triangle_normal(reference_point(x, t[0]), reference_point(x, t[1]), reference_point(x, t[2]), c);
        for (int j = 0; j < 3; j++) vgi_add(n + 3 * (size_t)t[j], c);
    }
    for (size_t v = 0; v < x->nv; v++) vgi_make_unit(n + 3 * v);
}

static void make_ring(vgi_rings *x, size_t v, const double n[3])
{
    double m[9] = {0}, size = 0, inverse[9];
    for (uint32_t i = x->first[v]; i < x->first[v + 1]; i++) {
        const double *edge = x->edge + 3 * (size_t)i;
        vgi_add_outer(m, x->weight[i], edge, edge);
        size += x->weight[i] * vgi_dot(edge, edge);
    }
    vgi_add_outer(m, size / 2, n, n);
    x->is_open[v] = invert_ring(m, inverse, x->open + 9 * v);
    x->nopen += x->is_open[v] && x->part[v] >= 0;
    vgi_multiply_vector(inverse, n, x->across + 3 * v);
    vgi_scale(x->across + 3 * v, size / 2);
    for (uint32_t i = x->first[v]; i < x->first[v + 1]; i++) {
        double *g = x->gradient + 3 * (size_t)i;
        vgi_multiply_vector(inverse, x->edge + 3 * (size_t)i, g);
        vgi_scale(g, x->weight[i]);
    }
}

static int make_rings(vgi_rings *x, vg_err *e)
{
    double *normals = vgi_array_raw(3 * x->nv, sizeof *normals, e);
    x->across = vgi_array_raw(3 * x->nv, sizeof *x->across, e);
    x->open = vgi_array_raw(9 * x->nv, sizeof *x->open, e);
    x->is_open = vgi_array_raw(x->nv, sizeof *x->is_open, e);
    int r = normals && x->across && x->open && x->is_open ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) unit_normals(x, normals);
    for (size_t v = 0; r == VG_OK && v < x->nv; v++) make_ring(x, v, normals + 3 * v);
    free(normals);
    return r;
}

/* ---- the factor ---- */

static void list_laplacian(const vgi_rings *x, const uint32_t *number, vgi_triplets *t)
{
    for (size_t v = 0; v < x->nv; v++) {
        if (x->part[v] < 0) continue;
        double sum = 0;
        for (uint32_t i = x->first[v]; i < x->first[v + 1]; i++) {
            sum += x->weight[i];
            if (x->to[i] < v) vgi_triplets_put(t, number[v], number[x->to[i]], -x->weight[i]);
        }
        vgi_triplets_put(t, number[v], number[v], sum + (x->centre[x->part[v]] == v ? 1 : 0));
    }
}

/* Right-hand sides sum to 0 over a component, so adding 1 to the diagonal of one vertex sets it to 0. */
static int factorize_laplacian(vgi_rings *x, vg_err *e)
{
    vgi_triplets t = {0};
    vgi_sparse a = {0};
    uint32_t *number = vgi_array_raw(x->nv, sizeof *number, e), n = 0;
    x->row = vgi_array_raw(x->nv, sizeof *x->row, e);
    int r = number && x->row ? vgi_triplets_make(&t, x->first[x->nv] / 2 + x->nv, e) : VG_ENOMEM;
    for (size_t v = 0; r == VG_OK && v < x->nv; v++) number[v] = x->part[v] < 0 ? UINT32_MAX : n++;
    if (r == VG_OK) {
        list_laplacian(x, number, &t);
        r = vgi_triplets_sum(&t, n, &a, e);
    }
    if (r == VG_OK) r = vgi_cholesky_new(&x->cholesky, &a, NULL, e);
    if (r == VG_OK) r = vgi_cholesky_factorize(x->cholesky, &a, e);
    if (r == VG_OK) {
        x->factor = vgi_cholesky_factor(x->cholesky);
        const int *order = vgi_cholesky_order(x->cholesky);
        uint32_t *row_of = number; /* read once more below, then reused for the inverse order */
        uint32_t *inverse = vgi_array_raw(n, sizeof *inverse, e);
        if (!inverse) r = VG_ENOMEM;
        for (uint32_t i = 0; r == VG_OK && i < n; i++) inverse[order[i]] = i;
        for (size_t v = 0; r == VG_OK && v < x->nv; v++)
            x->row[v] = row_of[v] == UINT32_MAX ? UINT32_MAX : inverse[row_of[v]];
        free(inverse);
    }
    vgi_triplets_clear(&t);
    vgi_sparse_clear(&a);
    free(number);
    return r;
}

int vgi_rings_make(vgi_rings *x, const vg_mesh *m, const double *reference, vg_err *e)
{
    *x = (vgi_rings){.nv = m->nv};
    if (!m->nf) return vg_fail(e, VG_EINPUT, "the mesh has no faces: its vertices have no neighbourhoods to measure");
    int r = (x->reference = vgi_copy_array(reference, 3 * m->nv, sizeof *reference, e)) ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) r = cut_faces(x, m, e);
    if (r == VG_OK) r = make_edges(x, m, e);
    if (r == VG_OK) r = find_parts(x, m, e);
    if (r == VG_OK) r = find_centres(x, e);
    if (r == VG_OK) r = make_rings(x, e);
    if (r == VG_OK) r = factorize_laplacian(x, e);
    if (r < 0) vgi_rings_clear(x);
    return r;
}

void vgi_rings_clear(vgi_rings *x)
{
    free(x->triangle);
    free(x->first);
    free(x->to);
    free(x->weight);
    free(x->edge);
    free(x->gradient);
    free(x->across);
    free(x->open);
    free(x->is_open);
    free(x->part);
    free(x->part_size);
    free(x->centre);
    free(x->ball);
    free(x->reference);
    free(x->row);
    vgi_cholesky_free(&x->cholesky);
    *x = (vgi_rings){0};
}
