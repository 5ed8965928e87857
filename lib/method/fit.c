/* fit.c: bend one surface of polygons until it lies on another, from ties (markers, seeds) and nearest points.
 *
 * What is kept small is how much the deformation changes from place to place: per vertex v, with L a graph Laplacian of the mesh, s the
 * rest and D_v the linear map that the faces around v undergo in the present fit,
 *
 *     sum over v of |(L x)_v - D_v (L s)_v|^2 / L_vv  +  small * first differences against turned and scaled ones
 *       +  sum of weight * |tied point - where it belongs|^2
 *
 * so that any affine map of the whole costs nothing, and one that changes from limb to limb costs little: what Sumner and Popovic (2004,
 * section 5.1) ask of neighbouring triangles, without extra unknowns and for faces of any number of corners. x, y and z share one matrix. It
 * is factorized once per round; inside a round D and the nearest points follow the fit. The D of a face counts a third direction,
 * its normal, stretched as its area is.
 *
 * Leaves out how the meshes come to lie roughly on one another (register.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/register.h"
#include "method/sparse.h"
#include "model/incidence.h"

#include <stdlib.h>

double P_alpha = 0.01, P_marker = 10, P_lim0 = 0.1, P_lim1 = 0.02, P_w0 = 0.01, P_wmul = 4, P_cos = 0.4, P_inertia = 1, P_back = 0;
int P_rounds = 6, P_inner = 3, P_sweeps = 2, P_free = 6, P_mode = 1;

enum {
    BLOCK = 256,     /* vertices of a task */
    FULL = 8         /* larger faces have no springs between all of their corners */
};

/* A spring of the graph Laplacian. Those of vertex v are first[v] .. first[v + 1] - 1, by ascending neighbour. */
typedef struct springs {
    size_t nv;
    uint32_t *first, *to;
    double *weight, *sum; /* per spring; per vertex: L_vv, 0 for a vertex in no face */
} springs;

typedef struct fit {
    const vgi_fitting *in;
    const vg_mesh *m;
    vgi_incidence around;
    springs L;
    double *laplacian; /* nv x 3: L s */
    double *inverse;   /* nf x 9: (sum r r' + h n n')^-1, see gradients() */
    double *h_normal;  /* nf x 3: h n, of the rest */
    double *area;      /* nf: of the rest */
    double *trust;     /* nf: 1 for a round face, 0 for one without area */
    double *face_map, *vertex_map, *turned; /* D of faces and vertices; D_v without shear */
    bool *border;      /* nv: of the source */
    vgi_sparse matrix; /* value: what is factorized */
    double *bending, *stretching; /* per entry of matrix: the two smoothness terms */
    vgi_cholesky *solver;
    double *x, *rhs, *normal, *tmp; /* nv x 3 */
    double *pull;      /* nv: weight of the nearest point in this round; 0: none */
    double *goal;      /* nv x 3: the nearest point */
    double *distance;  /* nv */
    double limit, cosine;
} fit;

/* ---- the graph ---- */

typedef struct spring_list {
    size_t n, cap;
    struct spring {
        uint32_t a, b;
        double weight;
    } *at;
} spring_list;

static int add_spring(spring_list *l, uint32_t a, uint32_t b, double weight, vg_err *e)
{
    int r = vgi_grow(&l->at, &l->cap, l->n + 1, sizeof *l->at, e);
    if (r == VG_OK) l->at[l->n++] = (struct spring){a, b, weight};
    return r;
}

/* Every pair of corners of a small face; of a large one the edges, the next but one, and what is opposite. */
static int add_face(spring_list *l, const uint32_t *vert, size_t r, vg_err *e)
{
    int ok = VG_OK;
    if (r <= FULL) {
        for (size_t i = 1; i < r && ok == VG_OK; i++)
            for (size_t j = 0; j < i && ok == VG_OK; j++) ok = add_spring(l, vert[i], vert[j], 1.0 / (double)r, e);
        return ok;
    }
    for (size_t i = 0; i < r && ok == VG_OK; i++) {
        ok = add_spring(l, vert[i], vert[(i + 1) % r], 0.25, e);
        if (ok == VG_OK) ok = add_spring(l, vert[i], vert[(i + 2) % r], 0.125, e);
        if (ok == VG_OK && i < r / 2) ok = add_spring(l, vert[i], vert[i + r / 2], 0.125, e);
    }
    return ok;
}

static int gather_springs(spring_list *l, const vgi_fitting *in, vg_err *e)
{
    const vg_mesh *m = in->source;
    int r = VG_OK;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) r = add_face(l, m->vert + m->start[f], m->start[f + 1] - m->start[f], e);
    for (size_t i = 0; i < in->nlinks && r == VG_OK; i++) r = add_spring(l, in->links[2 * i], in->links[2 * i + 1], 0.5, e);
    /* points that a tie joins: no force, only room in the matrix */
    for (size_t i = 0; i < in->nties; i++)
        for (int k = 0; k < 3 && r == VG_OK; k++) {
            uint32_t a = in->tie[i].vertex[k], b = in->tie[i].vertex[(k + 1) % 3];
            if (a != b) r = add_spring(l, a, b, 0, e);
        }
    return r;
}

static int compare_springs(const void *a, const void *b)
{
    const struct spring *x = a, *y = b;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    if (x->b != y->b) return x->b < y->b ? -1 : 1;
    return x->weight < y->weight ? -1 : x->weight > y->weight; /* sums must not depend on the sorting */
}

static int make_springs(fit *t, vg_err *e)
{
    springs *L = &t->L;
    spring_list list = {0};
    int r = gather_springs(&list, t->in, e);
    size_t n = list.n, nv = L->nv = t->m->nv;
    for (size_t i = 0; i < n && r == VG_OK; i++) r = add_spring(&list, list.at[i].b, list.at[i].a, list.at[i].weight, e);
    L->first = vgi_array(nv + 1, sizeof *L->first, e);
    L->to = vgi_array_raw(list.n, sizeof *L->to, e);
    L->weight = vgi_array_raw(list.n, sizeof *L->weight, e);
    L->sum = vgi_array(nv, sizeof *L->sum, e);
    if (r < 0 || !L->first || !L->to || !L->weight || !L->sum) return free(list.at), VG_ENOMEM;
    if (list.n) qsort(list.at, list.n, sizeof *list.at, compare_springs);
    size_t to = 0;
    for (size_t i = 0; i < list.n; i++) {
        const struct spring *s = &list.at[i];
        if (i && s[-1].a == s->a && s[-1].b == s->b) {
            L->weight[to - 1] += s->weight;
        } else {
            L->to[to] = s->b, L->weight[to++] = s->weight;
            L->first[s->a + 1]++;
        }
        L->sum[s->a] += s->weight;
    }
    for (size_t v = 0; v < nv; v++) L->first[v + 1] += L->first[v];
    free(list.at);
    return VG_OK;
}

/* y = L x */
static void apply_laplacian(const springs *L, const double *x, double *y)
{
    for (size_t v = 0; v < L->nv; v++) {
        double *to = y + 3 * v;
        const double *at = x + 3 * v;
        to[0] = to[1] = to[2] = 0;
        for (uint32_t i = L->first[v]; i < L->first[v + 1]; i++) {
            const double *from = x + 3 * (size_t)L->to[i];
            for (int k = 0; k < 3; k++) to[k] += L->weight[i] * (at[k] - from[k]);
        }
    }
}

/* ---- the matrix ---- */

static int compare_ints(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return x < y ? -1 : x > y;
}

/* Rows >= column of the column's neighbours' neighbours, ascending. mark[v] == column + 1: seen. */
static size_t column_rows(const springs *L, uint32_t column, int *rows, uint32_t *mark)
{
    size_t n = 0;
    mark[column] = column + 1, rows[n++] = (int)column;
    for (uint32_t i = L->first[column]; i <= L->first[column + 1]; i++) {
        uint32_t k = i < L->first[column + 1] ? L->to[i] : column; /* the column itself comes last */
        for (uint32_t j = L->first[k]; j < L->first[k + 1]; j++) {
            uint32_t v = L->to[j];
            if (v <= column || mark[v] == column + 1) continue;
            mark[v] = column + 1, rows[n++] = (int)v;
        }
    }
    qsort(rows, n, sizeof *rows, compare_ints);
    return n;
}

static int make_pattern(fit *t, vg_err *e)
{
    const springs *L = &t->L;
    vgi_sparse *A = &t->matrix;
    size_t cap = 0, n = 0, nv = L->nv;
    uint32_t *mark = vgi_array(nv, sizeof *mark, e);
    int *rows = vgi_array_raw(nv, sizeof *rows, e);
    A->n = nv;
    A->start = vgi_array(nv + 1, sizeof *A->start, e);
    int r = mark && rows && A->start ? VG_OK : VG_ENOMEM;
    for (size_t j = 0; j < nv && r == VG_OK; j++) {
        size_t k = column_rows(L, (uint32_t)j, rows, mark);
        if (n + k > INT32_MAX) r = vg_fail(e, VG_EINPUT, "a mesh of %zu vertices is too large to be fitted", nv);
        else r = vgi_grow(&A->row, &cap, n + k, sizeof *A->row, e);
        if (r == VG_OK) memcpy(A->row + n, rows, k * sizeof *rows);
        n += k;
        A->start[j + 1] = (int)n;
    }
    free(mark);
    free(rows);
    if (r < 0) return r;
    A->value = vgi_array(n, sizeof *A->value, e);
    t->bending = vgi_array(n, sizeof *t->bending, e);
    t->stretching = vgi_array(n, sizeof *t->stretching, e);
    return A->value && t->bending && t->stretching ? VG_OK : VG_ENOMEM;
}

/* L_ij with L_ii = sum */
static void fill_column(fit *t, size_t j, double *bend, double *stretch)
{
    const springs *L = &t->L;
    stretch[j] = L->sum[j];
    for (uint32_t i = L->first[j]; i <= L->first[j + 1]; i++) {
        bool self = i == L->first[j + 1];
        size_t k = self ? j : L->to[i];
        double a = self ? L->sum[j] : -L->weight[i];
        if (!self) stretch[k] = -L->weight[i];
        if (!(L->sum[k] > 0)) continue;
        a /= L->sum[k];
        bend[k] += a * L->sum[k];
        for (uint32_t p = L->first[k]; p < L->first[k + 1]; p++) bend[L->to[p]] -= a * L->weight[p];
    }
}

static int fill_smoothness(fit *t, vg_err *e)
{
    const springs *L = &t->L;
    const vgi_sparse *A = &t->matrix;
    double *bend = vgi_array(L->nv, sizeof *bend, e), *stretch = vgi_array(L->nv, sizeof *stretch, e);
    if (!bend || !stretch) return free(bend), free(stretch), VG_ENOMEM;
    for (size_t j = 0; j < L->nv; j++) {
        fill_column(t, j, bend, stretch);
        for (int i = A->start[j]; i < A->start[j + 1]; i++)
            t->bending[i] = bend[A->row[i]], t->stretching[i] = stretch[A->row[i]];
        for (uint32_t i = L->first[j]; i <= L->first[j + 1]; i++) {
            size_t k = i < L->first[j + 1] ? L->to[i] : j;
            bend[k] = stretch[k] = 0;
            for (uint32_t p = L->first[k]; p < L->first[k + 1]; p++) bend[L->to[p]] = 0;
        }
    }
    free(bend);
    free(stretch);
    return VG_OK;
}

static double *entry(const vgi_sparse *A, uint32_t a, uint32_t b)
{
    uint32_t column = a < b ? a : b;
    int row = (int)(a < b ? b : a), low = A->start[column], high = A->start[column + 1];
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (A->row[middle] <= row) low = middle;
        else high = middle;
    }
    return &A->value[low];
}

static int factorize(fit *t, double stiffness, vg_err *e)
{
    vgi_sparse *A = &t->matrix;
    for (int i = 0; i < A->start[A->n]; i++) A->value[i] = stiffness * (t->bending[i] + P_alpha * t->stretching[i]);
    for (size_t v = 0; v < A->n; v++) A->value[A->start[v]] += t->L.sum[v] > 0 ? t->pull[v] : 1;
    for (size_t i = 0; i < t->in->nties; i++) {
        const vgi_tie *tie = &t->in->tie[i];
        for (int a = 0; a < 3; a++)
            for (int b = 0; b <= a; b++) {
                double w = P_marker * tie->weight * tie->share[a] * tie->share[b];
                *entry(A, tie->vertex[a], tie->vertex[b]) += a != b && tie->vertex[a] == tie->vertex[b] ? 2 * w : w;
            }
    }
    return vgi_cholesky_factorize(t->solver, A, e);
}

/* ---- how the faces are deformed ---- */

static double length(const double a[3])
{
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

static void face_centre(const double *x, const uint32_t *vert, size_t r, double centre[3])
{
    centre[0] = centre[1] = centre[2] = 0;
    for (size_t i = 0; i < r; i++)
        for (int k = 0; k < 3; k++) centre[k] += x[3 * (size_t)vert[i] + (size_t)k] / (double)r;
}

static void prepare_faces(fit *t)
{
    const vg_mesh *m = t->m;
    for (size_t f = 0; f < m->nf; f++) {
        const uint32_t *vert = m->vert + m->start[f];
        size_t r = m->start[f + 1] - m->start[f];
        double C[3], S[9] = {0}, n[3], *out = t->inverse + 9 * f;
        face_centre(t->in->rest, vert, r, C);
        for (size_t i = 0; i < r; i++) {
            double w[3];
            for (int k = 0; k < 3; k++) w[k] = t->in->rest[3 * (size_t)vert[i] + (size_t)k] - C[k];
            vgi_add_outer(S, 1, w, w);
        }
        vgi_newell(t->in->rest, vert, r, n);
        double area = length(n), h = 0.5 * (S[0] + S[4] + S[8]), c[9];
        t->area[f] = area;
        if (r == 2 || !(area > 0)) {
            t->trust[f] = r == 2 && h > 0;
            continue;
        }
        for (int k = 0; k < 3; k++) n[k] /= area, t->h_normal[3 * f + (size_t)k] = h * n[k];
        vgi_add_outer(S, h, n, n);
        double det = vgi_cofactors(S, c);
        t->trust[f] = det / (h * h * h); /* with l1, l2 the eigenvalues in the plane: 4 l1 l2 / (l1 + l2)^2 */
        if (!(t->trust[f] > 1e-6)) {
            t->trust[f] = 0;
            continue;
        }
        for (int k = 0; k < 3; k++)
            for (int l = 0; l < 3; l++) out[3 * k + l] = c[3 * l + k] / det;
    }
}

static void bone_map(const double *x, const double *rest, const uint32_t *vert, double D[9])
{
    double r[3], d[3], q[4], unit[4];
    for (int k = 0; k < 3; k++) {
        r[k] = rest[3 * (size_t)vert[1] + (size_t)k] - rest[3 * (size_t)vert[0] + (size_t)k];
        d[k] = x[3 * (size_t)vert[1] + (size_t)k] - x[3 * (size_t)vert[0] + (size_t)k];
    }
    double a = length(d) / length(r);
    if (!(a > 0)) d[0] = r[0], d[1] = r[1], d[2] = r[2], a = 1e-6;
    vg_quat_between(r, d, q);
    double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int k = 0; k < 4; k++) unit[k] = q[k] / size;
    vg_quat_matrix(unit, D);
    for (int k = 0; k < 9; k++) D[k] *= a;
}

static void face_maps(fit *t, const double *x)
{
    const vg_mesh *m = t->m;
    for (size_t f = 0; f < m->nf; f++) {
        const uint32_t *vert = m->vert + m->start[f];
        size_t r = m->start[f + 1] - m->start[f];
        double *D = t->face_map + 9 * f, C[3], S[9] = {0}, n[3];
        if (!(t->trust[f] > 0)) continue;
        if (r == 2) {
            bone_map(x, t->in->rest, vert, D);
            continue;
        }
        face_centre(x, vert, r, C);
        for (size_t i = 0; i < r; i++) {
            double d[3];
            for (int k = 0; k < 3; k++) d[k] = x[3 * (size_t)vert[i] + (size_t)k] - C[k];
            vgi_add_outer(S, 1, d, t->in->rest + 3 * (size_t)vert[i]);
        }
        vgi_newell(x, vert, r, n);
        double area = length(n);
        if (area > 0) vgi_add_outer(S, sqrt(area / t->area[f]) / area, n, t->h_normal + 3 * f);
        const double *P = t->inverse + 9 * f;
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) D[3 * i + k] = S[3 * i] * P[k] + S[3 * i + 1] * P[3 + k] + S[3 * i + 2] * P[6 + k];
    }
}

/* Of vertices: the trusted mean of the faces around. A vertex of none keeps what it has. */
static void faces_to_vertices(fit *t, bool plain)
{
    for (size_t v = 0; v < t->m->nv; v++) {
        double sum = 0, D[9] = {0};
        for (uint32_t i = t->around.first[v]; i < t->around.first[v + 1]; i++) {
            size_t f = t->around.face[i];
            double w = plain ? 1 : t->trust[f];
            for (int k = 0; k < 9; k++) D[k] += w * t->face_map[9 * f + (size_t)k];
            sum += w;
        }
        if (sum > 0)
            for (int k = 0; k < 9; k++) t->vertex_map[9 * v + (size_t)k] = D[k] / sum;
    }
}

static void vertices_to_faces(fit *t)
{
    const vg_mesh *m = t->m;
    for (size_t f = 0; f < m->nf; f++) {
        double *D = t->face_map + 9 * f, share = 1.0 / (double)(m->start[f + 1] - m->start[f]);
        for (int k = 0; k < 9; k++) D[k] = 0;
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
            for (int k = 0; k < 9; k++) D[k] += share * t->vertex_map[9 * (size_t)m->vert[c] + (size_t)k];
    }
}

/* The rotation nearest to m by Newton's iteration (Higham 1986), times the mean stretch; false when m turns inside out. */
static bool without_shear(const double m[9], double out[9])
{
    double q[9], c[9], det = vgi_cofactors(m, c), first = det;
    if (!(det > 1e-12)) return false;
    memcpy(q, m, sizeof q);
    for (int round = 0; round < 20; round++) {
        double change = 0, scale = 1 / cbrt(det);
        for (int k = 0; k < 9; k++) {
            double next = 0.5 * (q[k] * scale + c[k] * scale * scale / (det * scale * scale * scale));
            change += fabs(next - q[k]);
            q[k] = next;
        }
        det = vgi_cofactors(q, c);
        if (change < 1e-9) break;
        if (!(det > 0)) return false;
    }
    for (int k = 0; k < 9; k++) out[k] = q[k] * (P_mode == 1 || P_mode == 5 ? cbrt(first) : 1);
    return true;
}

static void update_maps(fit *t, const double *x)
{
    if (P_mode == 3) return;
    face_maps(t, x);
    faces_to_vertices(t, false);
    for (int i = 0; i < P_sweeps; i++) vertices_to_faces(t), faces_to_vertices(t, true);
    for (size_t v = 0; v < t->m->nv; v++) {
        if (P_mode == 4 || P_mode == 5) { without_shear(t->vertex_map + 9 * v, t->turned + 9 * v); memcpy(t->vertex_map + 9 * v, t->turned + 9 * v, 72); }
        else if (P_mode == 0) memcpy(t->turned + 9 * v, t->vertex_map + 9 * v, 72);
        else without_shear(t->vertex_map + 9 * v, t->turned + 9 * v);
    }
}

/* ---- a round ---- */

static void add_smoothness(fit *t, double stiffness)
{
    const springs *L = &t->L;
    double *wanted = t->tmp;
    for (size_t v = 0; v < L->nv; v++) {
        double *w = wanted + 3 * v;
        vgi_multiply_vector(t->vertex_map + 9 * v, t->laplacian + 3 * v, w);
        for (int k = 0; k < 3; k++) w[k] = L->sum[v] > 0 ? w[k] / L->sum[v] : 0;
    }
    apply_laplacian(L, wanted, t->rhs);
    for (size_t v = 0; v < L->nv; v++) {
        double *to = t->rhs + 3 * v;
        for (uint32_t i = L->first[v]; i < L->first[v + 1]; i++) {
            size_t u = L->to[i];
            double d[3], a[3], b[3];
            for (int k = 0; k < 3; k++) d[k] = t->in->rest[3 * v + (size_t)k] - t->in->rest[3 * u + (size_t)k];
            vgi_multiply_vector(t->turned + 9 * v, d, a);
            vgi_multiply_vector(t->turned + 9 * u, d, b);
            for (int k = 0; k < 3; k++) to[k] += P_alpha * L->weight[i] * 0.5 * (a[k] + b[k]);
        }
        for (int k = 0; k < 3; k++) to[k] *= stiffness;
    }
}

static void add_pulls(fit *t)
{
    for (size_t v = 0; v < t->m->nv; v++) {
        bool isolated = !(t->L.sum[v] > 0);
        double w = isolated ? 1 : t->pull[v];
        const double *goal = isolated ? t->in->rest + 3 * v : t->goal + 3 * v;
        for (size_t k = 0; k < 3; k++) t->rhs[3 * v + k] += w * goal[k];
    }
    for (size_t i = 0; i < t->in->nties; i++) {
        const vgi_tie *tie = &t->in->tie[i];
        for (int a = 0; a < 3; a++)
            for (size_t k = 0; k < 3; k++)
                t->rhs[3 * (size_t)tie->vertex[a] + k] += P_marker * tie->weight * tie->share[a] * tie->point[k];
    }
}

static int solve(fit *t, double stiffness, vg_err *e)
{
    update_maps(t, t->x);
    add_smoothness(t, stiffness);
    add_pulls(t);
    int r = vgi_cholesky_solve(t->solver, t->rhs, e);
    if (r == VG_OK) memcpy(t->x, t->rhs, 3 * t->m->nv * sizeof *t->x);
    return r;
}

static void vertex_normals(fit *t)
{
    const vg_mesh *m = t->m;
    memset(t->normal, 0, 3 * m->nv * sizeof *t->normal);
    for (size_t f = 0; f < m->nf; f++) {
        double n[3];
        vgi_newell(t->x, m->vert + m->start[f], m->start[f + 1] - m->start[f], n);
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
            for (size_t k = 0; k < 3; k++) t->normal[3 * (size_t)m->vert[c] + k] += n[k];
    }
    for (size_t v = 0; v < m->nv; v++) {
        double *n = t->normal + 3 * v, size = length(n), sign = t->in->flipped ? -1 : 1;
        for (int k = 0; k < 3; k++) n[k] = size > 0 ? sign * n[k] / size : 0;
    }
}

/* A nearest point on the border of the target is true only for a vertex on the border of the source: others are beyond it. */
static void find_near(void *context, size_t block)
{
    fit *t = context;
    size_t end = (block + 1) * BLOCK < t->m->nv ? (block + 1) * BLOCK : t->m->nv;
    for (size_t v = block * BLOCK; v < end; v++) {
        vgi_hit hit;
        t->distance[v] = INFINITY;
        if (!(t->L.sum[v] > 0)) continue;
        if (!vgi_surface_nearest(t->in->target, t->x + 3 * v, t->normal + 3 * v, t->cosine, t->limit * t->limit, &hit)) continue;
        if (hit.border && !t->border[v]) continue;
        t->distance[v] = sqrt(hit.square);
        memcpy(t->goal + 3 * v, hit.point, sizeof hit.point);
    }
}

/* first: pulls are chosen anew. Later in a round the matrix stays: who has lost the target stays where it is. */
static void follow_target(fit *t, double weight, bool first)
{
    vertex_normals(t);
    vgi_parallel(t->in->threads, (t->m->nv + BLOCK - 1) / BLOCK, find_near, t);
    for (size_t v = 0; v < t->m->nv; v++) {
        bool found = t->distance[v] < INFINITY;
        double share = found ? t->distance[v] / t->limit : 1;
        if (first) t->pull[v] = found ? weight * (1 - share * share) : 0;
        else if (!found) memcpy(t->goal + 3 * v, t->x + 3 * v, 3 * sizeof *t->x);
    }
}

static void tell(const fit *t, size_t round, size_t rounds, double stiffness)
{
    if (!t->in->step) return;
    vg_register_step s = {.round = round, .rounds = rounds, .stiffness = stiffness};
    for (size_t v = 0; v < t->m->nv; v++) {
        if (!(t->pull[v] > 0) || !(t->distance[v] < INFINITY)) continue;
        s.near++;
        s.mean += t->distance[v];
        s.largest = fmax(s.largest, t->distance[v]);
    }
    if (s.near) s.mean /= (double)s.near;
    t->in->step(t->in->context, &s);
}

static int run(fit *t, vg_err *e)
{
    int r = VG_OK;
    if (t->in->nties) {
        r = factorize(t, 1, e);
        for (int i = 0; i < P_free && r == VG_OK; i++) r = solve(t, 1, e);
    }
    double weight = P_w0;
    for (int round = 0; round < P_rounds && r == VG_OK; round++) {
        t->limit = P_lim0 * pow(P_lim1 / P_lim0, round / (double)(P_rounds - 1)), t->cosine = P_cos;
        for (int i = 0; i < P_inner && r == VG_OK; i++) {
            follow_target(t, weight, i == 0);
            if (i == 0) r = factorize(t, 1, e);
            if (r == VG_OK) r = solve(t, 1, e);
        }
        tell(t, (size_t)round + 1, (size_t)P_rounds, 1 / weight);
        weight *= P_wmul;
    }
    return r;
}

static int prepare(fit *t, vg_err *e)
{
    const vg_mesh *m = t->m;
    size_t nv = m->nv, nf = m->nf;
    int r = vgi_incidence_make(&t->around, nv, nf, m->start, m->vert, e);
    if (r == VG_OK) r = make_springs(t, e);
    if (r == VG_OK) r = make_pattern(t, e);
    if (r == VG_OK) r = fill_smoothness(t, e);
    if (r == VG_OK) r = vgi_cholesky_new(&t->solver, &t->matrix, e);
    double **points[] = {&t->laplacian, &t->x, &t->rhs, &t->normal, &t->tmp, &t->goal};
    for (size_t i = 0; i < sizeof points / sizeof *points; i++)
        if (!(*points[i] = vgi_array(nv, 3 * sizeof(double), e))) return VG_ENOMEM;
    t->inverse = vgi_array(nf, 9 * sizeof(double), e);
    t->h_normal = vgi_array(nf, 3 * sizeof(double), e);
    t->area = vgi_array(nf, sizeof(double), e);
    t->trust = vgi_array(nf, sizeof(double), e);
    t->face_map = vgi_array(nf, 9 * sizeof(double), e);
    t->vertex_map = vgi_array(nv, 9 * sizeof(double), e);
    t->turned = vgi_array(nv, 9 * sizeof(double), e);
    t->border = vgi_array(nv, sizeof *t->border, e);
    t->pull = vgi_array(nv, sizeof(double), e);
    t->distance = vgi_array(nv, sizeof(double), e);
    if (!t->inverse || !t->h_normal || !t->area || !t->trust || !t->face_map || !t->vertex_map || !t->turned || !t->border ||
        !t->pull || !t->distance || r < 0)
        return r < 0 ? r : VG_ENOMEM;
    for (size_t f = 0; f < nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
            if (vgi_surface_border(t->in->source_surface, c))
                t->border[m->vert[c]] = t->border[m->vert[c + 1 < m->start[f + 1] ? c + 1 : m->start[f]]] = true;
    for (size_t v = 0; v < nv; v++)
        for (size_t k = 0; k < 9; k += 4) t->vertex_map[9 * v + k] = t->turned[9 * v + k] = 1;
    memcpy(t->x, t->in->rest, 3 * nv * sizeof *t->x);
    apply_laplacian(&t->L, t->in->rest, t->laplacian);
    prepare_faces(t);
    return VG_OK;
}

static void clear(fit *t)
{
    double *arrays[] = {t->L.weight, t->L.sum, t->laplacian, t->inverse, t->h_normal, t->area, t->trust, t->face_map,
                        t->vertex_map, t->turned, t->bending, t->stretching, t->x, t->rhs, t->normal, t->tmp, t->pull, t->goal,
                        t->distance};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    free(t->L.first);
    free(t->L.to);
    free(t->border);
    vgi_sparse_clear(&t->matrix);
    vgi_cholesky_free(&t->solver);
    vgi_incidence_clear(&t->around);
}

int vgi_fit(const vgi_fitting *in, double *x, vg_err *e)
{
    fit t = {.in = in, .m = in->source};
    int r = prepare(&t, e);
    if (r == VG_OK) r = run(&t, e);
    if (r == VG_OK) memcpy(x, t.x, 3 * t.m->nv * sizeof *x);
    clear(&t);
    return r;
}
