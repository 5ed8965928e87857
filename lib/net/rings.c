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

#include <stdlib.h>

static const double least_weight = 0.05, most_weight = 20, singular = 1e-9, ball_share = 0.15;
enum { BALL_LEAST = 7, SWEEPS = 24 };

static const double *point(const vgi_rings *r, size_t v)
{
    return r->reference + 3 * v;
}

/* ---- triangles ---- */

/* twice the area divided by the sum of squared sides: larger is better */
static double quality(const double *a, const double *b, const double *c)
{
    double n[3];
    vgi_triangle_normal(a, b, c, n);
    return vgi_length(n) / (vgi_square(a, b) + vgi_square(a, c) + vgi_square(b, c) + 1e-300);
}

static double worst_of_fan(const vgi_rings *r, const uint32_t *vert, size_t n, size_t from)
{
    double worst = INFINITY;
    for (size_t i = 1; i + 1 < n; i++)
        worst = fmin(worst, quality(point(r, vert[from]), point(r, vert[(from + i) % n]),
                                    point(r, vert[(from + i + 1) % n])));
    return worst;
}

static void cut_face(vgi_rings *r, const uint32_t *vert, size_t n)
{
    size_t best = 0;
    double most = -1;
    for (size_t s = 0; s < (n == 3 ? 1 : n == 4 ? 2 : n); s++) {
        double q = worst_of_fan(r, vert, n, s);
        if (q > most) most = q, best = s;
    }
    for (size_t i = 1; i + 1 < n; i++) {
        uint32_t *t = r->triangle + 3 * r->ntriangles++;
        t[0] = vert[best], t[1] = vert[(best + i) % n], t[2] = vert[(best + i + 1) % n];
    }
}

static int cut_faces(vgi_rings *r, const vg_mesh *m, vg_err *e)
{
    size_t most = 0;
    for (size_t f = 0; f < m->nf; f++) most += m->start[f + 1] - m->start[f] - 2;
    r->triangle = vgi_array_raw(3 * most, sizeof *r->triangle, e);
    if (!r->triangle) return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++) {
        size_t n = m->start[f + 1] - m->start[f];
        if (n > 2) cut_face(r, m->vert + m->start[f], n);
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

static int list_edges(const vgi_rings *r, const vg_mesh *m, vgi_edges *list, vg_err *e)
{
    int code = VG_OK;
    for (size_t i = 0; i < r->ntriangles; i++) {
        const uint32_t *t = r->triangle + 3 * i;
        for (int k = 0; k < 3 && code == VG_OK; k++) {
            uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
            code = vgi_edges_add(list, b, c, cotangent(point(r, a), point(r, b), point(r, c)) / 2, OF_TRIANGLE, e);
        }
    }
    for (size_t f = 0; f < m->nf && code == VG_OK; f++) {
        const uint32_t *vert = m->vert + m->start[f];
        if (m->start[f + 1] - m->start[f] == 2) code = vgi_edges_add(list, vert[0], vert[1], 0, OF_SEGMENT, e);
    }
    return code;
}

static int make_edges(vgi_rings *r, const vg_mesh *m, vg_err *e)
{
    vgi_edges list = {0};
    vgi_laplacian L = {0};
    int code = list_edges(r, m, &list, e);
    if (code == VG_OK) code = vgi_laplacian_make(&L, r->nv, &list, e);
    vgi_edges_clear(&list);
    if (code < 0) return code;
    size_t n = L.first[r->nv];
    r->edge = vgi_array_raw(3 * n, sizeof *r->edge, e);
    r->gradient = vgi_array_raw(3 * n, sizeof *r->gradient, e);
    for (size_t i = 0; i < n; i++)
        L.weight[i] = L.kinds[i] == OF_SEGMENT ? 1 : fmin(fmax(L.weight[i], least_weight), most_weight);
    for (size_t v = 0; r->edge && v < r->nv; v++)
        for (uint32_t i = L.first[v]; i < L.first[v + 1]; i++)
            vgi_subtract(point(r, v), point(r, L.to[i]), r->edge + 3 * (size_t)i);
    r->first = L.first, r->to = L.to, r->weight = L.weight;
    L.first = L.to = NULL, L.weight = NULL;
    vgi_laplacian_clear(&L);
    return r->edge && r->gradient ? VG_OK : VG_ENOMEM;
}

/* ---- components, their centres, the ball ---- */

static int find_parts(vgi_rings *r, const vg_mesh *m, vg_err *e)
{
    uint32_t *label = vgi_array_raw(r->nv, sizeof *label, e);
    r->part = vgi_array_raw(r->nv, sizeof *r->part, e);
    int code = label && r->part ? vg_mesh_components(m, label, &r->nparts, e) : VG_ENOMEM;
    if (code == VG_OK && !(r->part_size = vgi_array(r->nparts, sizeof *r->part_size, e))) code = VG_ENOMEM;
    for (size_t v = 0; code == VG_OK && v < r->nv; v++) {
        r->part[v] = label[v] == UINT32_MAX ? VGI_NO_PART : (int)label[v];
        if (r->part[v] >= 0) r->part_size[r->part[v]]++;
    }
    for (size_t p = 0; code == VG_OK && p < r->nparts; p++)
        if (r->part_size[p] > r->part_size[r->main_part]) r->main_part = p;
    free(label);
    return code;
}

size_t vgi_rings_heap(const vgi_rings *r)
{
    return 2 * r->nv;
}

void vgi_rings_from(const vgi_rings *r, uint32_t v, double *distance, uint32_t *heap)
{
    vgi_heap h = {0, heap, heap + r->nv, distance};
    for (size_t i = 0; i < r->nv; i++) distance[i] = INFINITY, h.place[i] = UINT32_MAX;
    distance[v] = 0;
    vgi_heap_lower(&h, v);
    while (h.n) {
        uint32_t a = vgi_heap_take(&h);
        for (uint32_t i = r->first[a]; i < r->first[a + 1]; i++) {
            double far = distance[a] + vgi_length(r->edge + 3 * (size_t)i);
            if (!(far < distance[r->to[i]])) continue;
            distance[r->to[i]] = far;
            vgi_heap_lower(&h, r->to[i]);
        }
    }
}

/* Sources are spread: each is the vertex farthest from those before. The largest distance to them is, for every
 * vertex, nearly the distance to the farthest vertex. most, near, from: nv numbers. */
static uint32_t find_centre(const vgi_rings *r, size_t part, double *most, double *near, double *from, uint32_t *heap)
{
    uint32_t v = 0;
    while (r->part[v] != (int)part) v++;
    for (size_t i = 0; i < r->nv; i++) most[i] = 0, near[i] = INFINITY;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        vgi_rings_from(r, v, from, heap);
        for (size_t i = 0; i < r->nv; i++) {
            if (r->part[i] != (int)part) continue;
            most[i] = fmax(most[i], from[i]);
            near[i] = sweep ? fmin(near[i], from[i]) : INFINITY; /* the first source is arbitrary and does not count */
        }
        const double *farthest = sweep ? near : from;
        for (size_t i = 0; i < r->nv; i++)
            if (r->part[i] == (int)part && farthest[i] > farthest[v]) v = (uint32_t)i;
    }
    uint32_t best = v;
    for (size_t i = 0; i < r->nv; i++)
        if (r->part[i] == (int)part && most[i] < most[best]) best = (uint32_t)i;
    return best;
}

static int by_number(const void *x, const void *y)
{
    double a = *(const double *)x, b = *(const double *)y;
    return a < b ? -1 : a > b;
}

/* the vertices within a fraction of the largest distance from the centre, at least seven; sorted: nv numbers */
static int find_ball(vgi_rings *r, const double *from, double *sorted, vg_err *e)
{
    size_t n = 0;
    double farthest = 0;
    for (size_t v = 0; v < r->nv; v++)
        if (r->part[v] == (int)r->main_part) sorted[n++] = from[v], farthest = fmax(farthest, from[v]);
    qsort(sorted, n, sizeof *sorted, by_number);
    double radius = fmax(ball_share * farthest, sorted[n < BALL_LEAST ? n - 1 : BALL_LEAST - 1]);
    if (!(r->ball = vgi_array_raw(n, sizeof *r->ball, e))) return VG_ENOMEM;
    for (size_t v = 0; v < r->nv; v++)
        if (r->part[v] == (int)r->main_part && from[v] <= radius) r->ball[r->nball++] = (uint32_t)v;
    return VG_OK;
}

static int find_centres(vgi_rings *r, vg_err *e)
{
    double *work = vgi_array_raw(3 * r->nv, sizeof *work, e);
    uint32_t *heap = vgi_array_raw(vgi_rings_heap(r), sizeof *heap, e);
    r->centre = vgi_array_raw(r->nparts, sizeof *r->centre, e);
    int code = work && heap && r->centre ? VG_OK : VG_ENOMEM;
    for (size_t p = 0; code == VG_OK && p < r->nparts; p++)
        r->centre[p] = find_centre(r, p, work, work + r->nv, work + 2 * r->nv, heap);
    if (code == VG_OK) {
        vgi_rings_from(r, r->centre[r->main_part], work, heap);
        code = find_ball(r, work, work + r->nv, e);
    }
    free(work);
    free(heap);
    return code;
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

static void unit_normals(const vgi_rings *r, double *n)
{
    memset(n, 0, 3 * r->nv * sizeof *n);
    for (size_t i = 0; i < r->ntriangles; i++) {
        const uint32_t *t = r->triangle + 3 * i;
        double c[3];
        vgi_triangle_normal(point(r, t[0]), point(r, t[1]), point(r, t[2]), c);
        for (int j = 0; j < 3; j++) vgi_add(n + 3 * (size_t)t[j], c);
    }
    for (size_t v = 0; v < r->nv; v++) vgi_make_unit(n + 3 * v);
}

static void make_ring(vgi_rings *r, size_t v, const double n[3])
{
    double m[9] = {0}, size = 0, inverse[9];
    for (uint32_t i = r->first[v]; i < r->first[v + 1]; i++) {
        const double *edge = r->edge + 3 * (size_t)i;
        vgi_add_outer(m, r->weight[i], edge, edge);
        size += r->weight[i] * vgi_dot(edge, edge);
    }
    vgi_add_outer(m, size / 2, n, n);
    r->is_open[v] = invert_ring(m, inverse, r->open + 9 * v);
    r->nopen += r->is_open[v] && r->part[v] >= 0;
    vgi_multiply_vector(inverse, n, r->across + 3 * v);
    vgi_scale(r->across + 3 * v, size / 2);
    for (uint32_t i = r->first[v]; i < r->first[v + 1]; i++) {
        double *g = r->gradient + 3 * (size_t)i;
        vgi_multiply_vector(inverse, r->edge + 3 * (size_t)i, g);
        vgi_scale(g, r->weight[i]);
    }
}

static int make_rings(vgi_rings *r, vg_err *e)
{
    double *normals = vgi_array_raw(3 * r->nv, sizeof *normals, e);
    r->across = vgi_array_raw(3 * r->nv, sizeof *r->across, e);
    r->open = vgi_array_raw(9 * r->nv, sizeof *r->open, e);
    r->is_open = vgi_array_raw(r->nv, sizeof *r->is_open, e);
    int code = normals && r->across && r->open && r->is_open ? VG_OK : VG_ENOMEM;
    if (code == VG_OK) unit_normals(r, normals);
    for (size_t v = 0; code == VG_OK && v < r->nv; v++) make_ring(r, v, normals + 3 * v);
    free(normals);
    return code;
}

/* ---- the factor ---- */

static void list_laplacian(const vgi_rings *r, const uint32_t *number, vgi_triplets *t)
{
    for (size_t v = 0; v < r->nv; v++) {
        if (r->part[v] < 0) continue;
        double sum = 0;
        for (uint32_t i = r->first[v]; i < r->first[v + 1]; i++) {
            sum += r->weight[i];
            if (r->to[i] < v) vgi_triplets_put(t, number[v], number[r->to[i]], -r->weight[i]);
        }
        vgi_triplets_put(t, number[v], number[v], sum + (r->centre[r->part[v]] == v ? 1 : 0));
    }
}

/* Right-hand sides sum to 0 over a component, so adding 1 to the diagonal of one vertex sets it to 0. */
static int factorize(vgi_rings *r, vg_err *e)
{
    vgi_triplets t = {0};
    vgi_sparse a = {0};
    uint32_t *number = vgi_array_raw(r->nv, sizeof *number, e), n = 0;
    r->row = vgi_array_raw(r->nv, sizeof *r->row, e);
    int code = number && r->row ? vgi_triplets_make(&t, r->first[r->nv] / 2 + r->nv, e) : VG_ENOMEM;
    for (size_t v = 0; code == VG_OK && v < r->nv; v++) number[v] = r->part[v] < 0 ? UINT32_MAX : n++;
    if (code == VG_OK) {
        list_laplacian(r, number, &t);
        code = vgi_triplets_sum(&t, n, &a, e);
    }
    if (code == VG_OK) code = vgi_cholesky_new(&r->cholesky, &a, NULL, e);
    if (code == VG_OK) code = vgi_cholesky_factorize(r->cholesky, &a, e);
    if (code == VG_OK) {
        r->factor = vgi_cholesky_factor(r->cholesky);
        const int *order = vgi_cholesky_order(r->cholesky);
        uint32_t *row_of = number; /* read once more below, then reused for the inverse order */
        uint32_t *inverse = vgi_array_raw(n, sizeof *inverse, e);
        if (!inverse) code = VG_ENOMEM;
        for (uint32_t i = 0; code == VG_OK && i < n; i++) inverse[order[i]] = i;
        for (size_t v = 0; code == VG_OK && v < r->nv; v++)
            r->row[v] = row_of[v] == UINT32_MAX ? UINT32_MAX : inverse[row_of[v]];
        free(inverse);
    }
    vgi_triplets_clear(&t);
    vgi_sparse_clear(&a);
    free(number);
    return code;
}

int vgi_rings_make(vgi_rings *r, const vg_mesh *m, const double *reference, vg_err *e)
{
    *r = (vgi_rings){.nv = m->nv};
    if (!m->nf) return vg_fail(e, VG_EINPUT, "the mesh has no faces: its vertices have no neighbourhoods to measure");
    int code = (r->reference = vgi_copy_array(reference, 3 * m->nv, sizeof *reference, e)) ? VG_OK : VG_ENOMEM;
    if (code == VG_OK) code = cut_faces(r, m, e);
    if (code == VG_OK) code = make_edges(r, m, e);
    if (code == VG_OK) code = find_parts(r, m, e);
    if (code == VG_OK) code = find_centres(r, e);
    if (code == VG_OK) code = make_rings(r, e);
    if (code == VG_OK) code = factorize(r, e);
    if (code < 0) vgi_rings_clear(r);
    return code;
}

void vgi_rings_clear(vgi_rings *r)
{
    free(r->triangle);
    free(r->first);
    free(r->to);
    free(r->weight);
    free(r->edge);
    free(r->gradient);
    free(r->across);
    free(r->open);
    free(r->is_open);
    free(r->part);
    free(r->part_size);
    free(r->centre);
    free(r->ball);
    free(r->reference);
    free(r->row);
    vgi_cholesky_free(&r->cholesky);
    *r = (vgi_rings){0};
}
