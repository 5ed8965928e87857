/* surface.c: a bounding volume hierarchy over the triangles of a polygon mesh, searched nearest box first.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/random.h"
#include "method/pairs/surface.h"
#include "numeric/face.h"
#include "model/incidence.h"

#include <math.h>
#include <stdlib.h>

enum { LEAF = 4, DEEPEST = 34 };
static const double OPPOSITE = 1e-9; /* what rounding leaves of normals that cancel, relative to their areas */

struct triangle {
    double a[3], ab[3], ac[3];
    uint32_t face, corner;
    uint8_t borders; /* bit 0: edge ab, 1: bc, 2: ca */
    bool flat;       /* no area: only its edges count */
};

/* Node i has the children 2i and 2i + 1. Node k of depth d holds the triangles n k / 2^d to n (k + 1) / 2^d. */
struct box {
    double least[3], most[3];
    double axis[3], cosine, sine; /* of a cone that holds the normals of its faces and their vertices; cosine < 0: none is so
                                   * narrow, or a face has no normal */
};

struct vgi_surface {
    const vg_mesh *m;
    double *normal, *centroid; /* nf x 3 */
    double *size;              /* nf */
    double *vertex_normal;     /* nv x 3 */
    uint8_t *border;           /* per corner */
    size_t n;
    int depth;
    struct triangle *triangle;
    struct box *box;
};

/* ---- building ---- */

static bool find_borders(vgi_surface *s, vg_err *e)
{
    const vg_mesh *m = s->m;
    vgi_incidence around;
    if (vgi_incidence_make(&around, m, e) < 0) return false;
    for (size_t f = 0; f < m->nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            uint32_t next = c + 1 < m->start[f + 1] ? c + 1 : m->start[f], v = m->vert[c], w = m->vert[next], ends[2];
            bool shared = false;
            if (around.first[v + 1] - around.first[v] > around.first[w + 1] - around.first[w]) {
                uint32_t swap = v; /* search at the end with fewer faces: the other may be the centre of a large fan */
                v = w, w = swap;
            }
            for (uint32_t i = around.first[v]; i < around.first[v + 1] && !shared; i++) {
                if (around.face[i] == f) continue;
                vgi_corner_edges(m->start, m->vert, around.face[i], around.corner[i], ends);
                shared = ends[0] == w || ends[1] == w;
            }
            s->border[c] = !shared;
        }
    vgi_incidence_clear(&around);
    return true;
}

static void set_triangle(struct triangle *t, const double *a, const double *b, const double *c, size_t face,
                         size_t corner, uint8_t borders)
{
    double area[3];
    memcpy(t->a, a, sizeof t->a);
    vgi_subtract(b, a, t->ab), vgi_subtract(c, a, t->ac);
    vgi_cross(t->ab, t->ac, area);
    t->face = (uint32_t)face, t->corner = (uint32_t)corner, t->borders = borders;
    t->flat = !(vgi_dot(area, area) > 1e-24 * vgi_dot(t->ab, t->ab) * vgi_dot(t->ac, t->ac));
}

static size_t fan_size(size_t r)
{
    return r <= 3 ? 1 : r;
}

static void make_triangles(vgi_surface *s, const double *points, const bool *take)
{
    const vg_mesh *m = s->m;
    struct triangle *t = s->triangle;
    for (size_t f = 0; f < m->nf; f++) {
        size_t begin = m->start[f], r = m->start[f + 1] - begin;
        const uint32_t *vert = m->vert + begin;
        const uint8_t *border = s->border + begin;
        double *C = s->centroid + 3 * f, *n = s->normal + 3 * f;
        vgi_face_centre(points, vert, r, C);
        if (!vgi_face_has_area(points, vert, r, n)) memset(n, 0, 3 * sizeof *n);
        s->size[f] = sqrt(vgi_make_unit(n));
        const double *p = points + 3 * (size_t)vert[0], *q = points + 3 * (size_t)vert[1];
        if (r == 2) s->size[f] = sqrt(vgi_square(p, q));
        if (take && !take[f]) continue;
        if (r == 2) {
            set_triangle(t++, p, q, q, f, begin, 0);
        } else if (r == 3) {
            uint8_t edges = (uint8_t)(border[0] | border[1] << 1 | border[2] << 2);
            set_triangle(t++, p, q, points + 3 * (size_t)vert[2], f, begin, edges);
        } else {
            for (size_t i = 0; i < r; i++)
                set_triangle(t++, points + 3 * (size_t)vert[i], points + 3 * (size_t)vert[i + 1 < r ? i + 1 : 0], C,
                             f, begin + i, border[i]);
        }
    }
}

void vgi_vertex_normals(const vg_mesh *m, const double *points, double *normal, double *area)
{
    memset(normal, 0, 3 * m->nv * sizeof *normal);
    memset(area, 0, m->nv * sizeof *area);
    for (size_t f = 0; f < m->nf; f++) {
        double n[3];
        if (!vgi_face_has_area(points, m->vert + m->start[f], m->start[f + 1] - m->start[f], n)) continue;
        double size = vgi_length(n);
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            vgi_add(normal + 3 * (size_t)m->vert[c], n);
            area[m->vert[c]] += size;
        }
    }
    for (size_t v = 0; v < m->nv; v++) {
        double *n = normal + 3 * v;
        if (vgi_length(n) > OPPOSITE * area[v]) vgi_make_unit(n);
        else n[0] = n[1] = n[2] = 0;
    }
}

/* Compares triangles by their centre along an axis. The order is total, so that the tree is always the same. */
struct key {
    double middle[3];
    uint32_t index;
};

static inline bool key_before(const struct key *a, const struct key *b, int axis)
{
    return a->middle[axis] < b->middle[axis] || (a->middle[axis] == b->middle[axis] && a->index < b->index);
}

/* Hoare's selection: moves the key of rank `middle` to its place, smaller keys before it. */
static void select_rank(struct key *p, size_t n, size_t middle, int axis)
{
    size_t begin = 0, end = n;
    vgi_random random = {.key = n};
    while (end - begin > 1) {
        struct key pivot = p[begin + vgi_random_below(&random, end - begin)];
        size_t i = begin, j = end - 1;
        for (;;) {
            while (key_before(&p[i], &pivot, axis)) i++;
            while (key_before(&pivot, &p[j], axis)) j--;
            if (i >= j) break;
            struct key swap = p[i];
            p[i++] = p[j], p[j--] = swap;
        }
        if (middle < i) end = i;
        else if (middle > j) begin = j + 1;
        else return;
    }
}

static int widest_axis(const struct key *key, size_t n)
{
    double least[3], most[3];
    for (int k = 0; k < 3; k++) least[k] = most[k] = key[0].middle[k];
    for (size_t i = 1; i < n; i++)
        for (int k = 0; k < 3; k++) {
            if (key[i].middle[k] < least[k]) least[k] = key[i].middle[k];
            if (key[i].middle[k] > most[k]) most[k] = key[i].middle[k];
        }
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (most[k] - least[k] > most[axis] - least[axis]) axis = k;
    return axis;
}

static void node_range(size_t n, uint64_t node, int depth, size_t *begin, size_t *end)
{
    uint64_t k = node - ((uint64_t)1 << depth); /* n and k are below 2^35 */
    *begin = (size_t)((__uint128_t)n * k >> depth);
    *end = (size_t)((__uint128_t)n * (k + 1) >> depth);
}

static void sort_keys(struct key *key, size_t n, int deepest)
{
    for (int depth = 0; depth < deepest; depth++)
        for (uint64_t node = (uint64_t)1 << depth; node < (uint64_t)2 << depth; node++) {
            size_t begin, end, middle, unused;
            node_range(n, node, depth, &begin, &end);
            node_range(n, 2 * node, depth + 1, &unused, &middle);
            select_rank(key + begin, end - begin, middle - begin, widest_axis(key + begin, end - begin));
        }
}

static void widen_box(struct box *box, const double least[3], const double most[3])
{
    for (int k = 0; k < 3; k++) {
        if (least[k] < box->least[k]) box->least[k] = least[k];
        if (most[k] > box->most[k]) box->most[k] = most[k];
    }
}

static const double *corner_normal(const vgi_surface *s, uint32_t corner)
{
    return s->vertex_normal + 3 * (size_t)s->m->vert[corner];
}

/* The normals between which those of a triangle lie: of its face, then of its corners on the mesh. */
static size_t list_normals(const vgi_surface *s, const struct triangle *t, const double *list[4])
{
    uint32_t begin = s->m->start[t->face], r = s->m->start[t->face + 1] - begin;
    list[0] = s->normal + 3 * (size_t)t->face;
    list[1] = corner_normal(s, t->corner), list[2] = corner_normal(s, begin + (t->corner - begin + 1) % r);
    if (r == 3) list[3] = corner_normal(s, begin + 2);
    return r == 3 ? 4 : 3;
}

/* The cone about box->axis, of this half angle. */
static void set_cone(struct box *box, double half)
{
    static const double margin = 1e-7;
    bool narrow = half + margin < M_PI / 2;
    box->cosine = narrow ? cos(half + margin) : -1;
    box->sine = narrow ? sin(half + margin) : 0;
}

static double angle_between(const double a[3], const double b[3])
{
    return acos(fmax(-1, fmin(1, vgi_dot(a, b))));
}

static void make_leaf_cone(const vgi_surface *s, struct box *box, size_t begin, size_t end)
{
    const double *list[4];
    double half = 0;
    memset(box->axis, 0, sizeof box->axis);
    for (size_t j = begin; j < end; j++)
        for (size_t k = list_normals(s, &s->triangle[j], list); k-- > 0;) vgi_add(box->axis, list[k]);
    if (!(vgi_make_unit(box->axis) > 0)) half = M_PI;
    for (size_t j = begin; j < end; j++) {
        size_t n = list_normals(s, &s->triangle[j], list);
        if (!(vgi_dot(list[0], list[0]) > 0)) half = M_PI;
        for (size_t k = 0; k < n; k++)
            if (vgi_dot(list[k], list[k]) > 0) half = fmax(half, angle_between(box->axis, list[k]));
    }
    set_cone(box, half);
}

static void join_cones(struct box *box, const struct box *a, const struct box *b)
{
    vgi_sum(a->axis, b->axis, box->axis);
    if (a->cosine < 0 || b->cosine < 0 || !(vgi_make_unit(box->axis) > 0)) {
        set_cone(box, M_PI);
        return;
    }
    set_cone(box, fmax(angle_between(box->axis, a->axis) + acos(a->cosine), angle_between(box->axis, b->axis) + acos(b->cosine)));
}

static void make_boxes(vgi_surface *s)
{
    uint64_t leaves = (uint64_t)1 << s->depth;
    for (uint64_t i = 2 * leaves - 1; i > 0; i--) {
        struct box *box = &s->box[i];
        for (int k = 0; k < 3; k++) box->least[k] = INFINITY, box->most[k] = -INFINITY;
        if (i < leaves) {
            widen_box(box, s->box[2 * i].least, s->box[2 * i].most);
            widen_box(box, s->box[2 * i + 1].least, s->box[2 * i + 1].most);
            join_cones(box, &s->box[2 * i], &s->box[2 * i + 1]);
            continue;
        }
        size_t begin, end;
        node_range(s->n, i, s->depth, &begin, &end);
        for (size_t j = begin; j < end; j++) {
            const struct triangle *t = &s->triangle[j];
            double b[3], c[3];
            vgi_sum(t->a, t->ab, b), vgi_sum(t->a, t->ac, c);
            widen_box(box, t->a, t->a);
            widen_box(box, b, b);
            widen_box(box, c, c);
        }
        make_leaf_cone(s, box, begin, end);
    }
}

static int grow_tree(vgi_surface *s, vg_err *e)
{
    while (s->n >> s->depth > LEAF) s->depth++;
    struct key *key = vgi_array_raw(s->n, sizeof *key, e);
    struct triangle *sorted = vgi_array_raw(s->n, sizeof *sorted, e);
    s->box = vgi_array_raw((size_t)2 << s->depth, sizeof *s->box, e);
    if (!key || !sorted || !s->box) return free(key), free(sorted), VG_ENOMEM;
    for (size_t i = 0; i < s->n; i++) {
        const struct triangle *t = &s->triangle[i];
        vgi_sum(t->ab, t->ac, key[i].middle), vgi_divide(key[i].middle, 3), vgi_add(key[i].middle, t->a);
        key[i].index = (uint32_t)i;
    }
    if (s->n) sort_keys(key, s->n, s->depth);
    for (size_t i = 0; i < s->n; i++) sorted[i] = s->triangle[key[i].index];
    free(s->triangle);
    free(key);
    s->triangle = sorted;
    make_boxes(s);
    return VG_OK;
}

int vgi_surface_new(vgi_surface **s, const vg_mesh *m, const double *points, vg_err *e)
{
    return vgi_surface_of(s, m, points, NULL, e);
}

int vgi_surface_of(vgi_surface **out, const vg_mesh *m, const double *points, const bool *take, vg_err *e)
{
    vgi_surface *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->m = m;
    for (size_t f = 0; f < m->nf; f++) s->n += !take || take[f] ? fan_size(m->start[f + 1] - m->start[f]) : 0;
    s->normal = vgi_array(m->nf, 3 * sizeof *s->normal, e);
    s->centroid = vgi_array(m->nf, 3 * sizeof *s->centroid, e);
    s->size = vgi_array(m->nf, sizeof *s->size, e);
    s->vertex_normal = vgi_array(m->nv, 3 * sizeof *s->vertex_normal, e);
    s->border = vgi_array(vg_mesh_corners(m), 1, e);
    s->triangle = vgi_array_raw(s->n, sizeof *s->triangle, e);
    double *area = vgi_array(m->nv, sizeof *area, e);
    bool ok = s->normal && s->centroid && s->size && s->vertex_normal && s->border && s->triangle && area &&
              find_borders(s, e);
    if (ok) {
        make_triangles(s, points, take);
        vgi_vertex_normals(m, points, s->vertex_normal, area);
    }
    free(area);
    if (ok && grow_tree(s, e) == VG_OK) return VG_OK;
    vgi_surface_free(out);
    return VG_ENOMEM;
}

void vgi_surface_free(vgi_surface **out)
{
    vgi_surface *s = *out;
    if (!s) return;
    free(s->normal);
    free(s->centroid);
    free(s->size);
    free(s->vertex_normal);
    free(s->border);
    free(s->triangle);
    free(s->box);
    free(s);
    *out = NULL;
}

const double *vgi_surface_normals(const vgi_surface *s)
{
    return s->normal;
}

const double *vgi_surface_centroids(const vgi_surface *s)
{
    return s->centroid;
}

const double *vgi_surface_sizes(const vgi_surface *s)
{
    return s->size;
}

const double *vgi_surface_vertex_normals(const vgi_surface *s)
{
    return s->vertex_normal;
}

bool vgi_surface_border(const vgi_surface *s, uint32_t corner)
{
    return s->border[corner];
}

/* ---- searching ---- */

static double box_distance(const struct box *b, const double p[3])
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double d = p[k] < b->least[k] ? b->least[k] - p[k] : p[k] > b->most[k] ? p[k] - b->most[k] : 0;
        square += d * d;
    }
    return square;
}

static double clamp01(double x)
{
    return x > 0 ? x < 1 ? x : 1 : 0;
}

/* Nearest point to p on the segment from o along d, as a fraction of d. */
static double on_segment(const double o[3], const double d[3], const double p[3])
{
    double dd = vgi_dot(d, d), op[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
    return dd > 0 ? clamp01(vgi_dot(op, d) / dd) : 0;
}

static void try_edge(const struct triangle *t, const double p[3], int edge, double *best, double u[2],
                     uint8_t *touched)
{
    double bc[3], b[3], share, x[2], square = 0;
    vgi_sum(t->a, t->ab, b), vgi_subtract(t->ac, t->ab, bc);
    if (edge == 0) share = on_segment(t->a, t->ab, p), x[0] = share, x[1] = 0;
    else if (edge == 1) share = on_segment(b, bc, p), x[0] = 1 - share, x[1] = share;
    else share = on_segment(t->a, t->ac, p), x[0] = 0, x[1] = share;
    for (int k = 0; k < 3; k++) {
        double d = t->a[k] + x[0] * t->ab[k] + x[1] * t->ac[k] - p[k];
        square += d * d;
    }
    if (square < *best) *best = square, u[0] = x[0], u[1] = x[1], *touched = (uint8_t)(1 << edge);
    else if (!(square > *best)) *touched |= (uint8_t)(1 << edge); /* a corner is on both edges */
}

/* Squared distance of p from a triangle; u: the nearest point is a + u0 ab + u1 ac; touched: the edges on which it
 * lies. */
static double triangle_distance(const struct triangle *t, const double p[3], double u[2], uint8_t *touched)
{
    double best = INFINITY;
    *touched = 0;
    if (!t->flat) {
        double ap[3] = {p[0] - t->a[0], p[1] - t->a[1], p[2] - t->a[2]};
        double d11 = vgi_dot(t->ab, t->ab), d12 = vgi_dot(t->ab, t->ac), d22 = vgi_dot(t->ac, t->ac);
        double r1 = vgi_dot(t->ab, ap), r2 = vgi_dot(t->ac, ap), det = d11 * d22 - d12 * d12;
        double v = (d22 * r1 - d12 * r2) / det, w = (d11 * r2 - d12 * r1) / det;
        if (v >= 0 && w >= 0 && v + w <= 1) {
            double square = 0;
            for (int k = 0; k < 3; k++) {
                double d = ap[k] - v * t->ab[k] - w * t->ac[k];
                square += d * d;
            }
            u[0] = v, u[1] = w;
            if (v <= 0) *touched |= 4;
            if (w <= 0) *touched |= 1;
            if (v + w >= 1) *touched |= 2;
            return square;
        }
    }
    for (int edge = 0; edge < 3; edge++) try_edge(t, p, edge, &best, u, touched);
    return best;
}

/* Smoothed normals at a, b and c of a triangle: the centroid of a larger face has that of the face, the end of a line
 * segment has its own. */
static void smoothed_normals(const vgi_surface *s, const struct triangle *t, const double *n[3])
{
    uint32_t begin = s->m->start[t->face], r = s->m->start[t->face + 1] - begin;
    n[0] = corner_normal(s, t->corner), n[1] = corner_normal(s, begin + (t->corner - begin + 1) % r);
    n[2] = r == 3 ? corner_normal(s, begin + 2) : r == 2 ? n[1] : s->normal + 3 * (size_t)t->face;
}

static void smoothed_normal(const double *const n[3], const double u[2], double smooth[3])
{
    for (int k = 0; k < 3; k++) smooth[k] = (1 - u[0] - u[1]) * n[0][k] + u[0] * n[1][k] + u[1] * n[2][k];
}

/* What is looked for; sine: that of the cosine's angle. */
struct query {
    const double *p, *normal;
    double cosine, sine, reach, limit;
};

/* Whether the normal fits. On sharp edges and tips the vertex normals are tested too, because normals of the adjacent
 * faces do not represent the surface there. */
static bool normal_fits(const vgi_surface *s, const struct triangle *t, const double u[2], const struct query *q)
{
    const double *n = s->normal + 3 * (size_t)t->face, *ends[3];
    if (!q->normal || !(vgi_dot(n, n) > 0) || vgi_dot(n, q->normal) >= q->cosine) return true;
    double smooth[3];
    smoothed_normals(s, t, ends);
    smoothed_normal(ends, u, smooth);
    double length = vgi_length(smooth);
    return length > 0 && vgi_dot(smooth, q->normal) >= q->cosine * length;
}

/* Point and normal, the latter times the reach, are one point in six dimensions, and so is each point of a triangle:
 * their squared distance. u and touched as for triangle_distance. */
static double alike_distance(const vgi_surface *s, const struct triangle *t, const struct query *q, double u[2],
                             uint8_t *touched)
{
    const double *n[3];
    double ab[6], ac[6], ap[6], b2 = 0, c2 = 0, bc = 0, pb = 0, pc = 0, best = INFINITY;
    smoothed_normals(s, t, n);
    for (size_t k = 0; k < 3; k++) {
        ab[k] = t->ab[k], ac[k] = t->ac[k], ap[k] = q->p[k] - t->a[k];
        ab[3 + k] = q->reach * (n[1][k] - n[0][k]), ac[3 + k] = q->reach * (n[2][k] - n[0][k]);
        ap[3 + k] = q->reach * (q->normal[k] - n[0][k]);
    }
    for (size_t k = 0; k < 6; k++) {
        b2 += ab[k] * ab[k], c2 += ac[k] * ac[k], bc += ab[k] * ac[k];
        pb += ab[k] * ap[k], pc += ac[k] * ap[k];
    }
    double det = b2 * c2 - bc * bc, a2 = b2 - 2 * bc + c2; /* a2: of the edge from b to c */
    double v = (c2 * pb - bc * pc) / det, w = (b2 * pc - bc * pb) / det;
    bool inside = det > 1e-24 * b2 * c2 && v >= 0 && w >= 0 && v + w <= 1;
    double on_bc = a2 > 0 ? clamp01((b2 - bc + pc - pb) / a2) : 0;
    const double at[4][2] = {
        {v, w}, {b2 > 0 ? clamp01(pb / b2) : 0, 0}, {1 - on_bc, on_bc}, {0, c2 > 0 ? clamp01(pc / c2) : 0}};
    *touched = 0;
    for (int i = inside ? 0 : 1; i < (inside ? 1 : 4); i++) {
        double square = 0;
        for (size_t k = 0; k < 6; k++) {
            double d = ap[k] - at[i][0] * ab[k] - at[i][1] * ac[k];
            square += d * d;
        }
        uint8_t edge = (uint8_t)(i ? 1 << (i - 1) : 0);
        if (square < best) best = square, u[0] = at[i][0], u[1] = at[i][1], *touched = edge;
        else if (!(square > best)) *touched |= edge;
    }
    return best;
}

static void set_hit(const vgi_surface *s, const struct triangle *t, const struct query *q, const double u[2],
                    uint8_t touched, double measure, vgi_hit *hit)
{
    *hit = (vgi_hit){
        .face = t->face, .measure = measure, .border = touched & t->borders, .corner = t->corner, .u = {u[0], u[1]}};
    memcpy(hit->point, t->a, sizeof t->a);
    vgi_add_scaled(hit->point, u[0], t->ab), vgi_add_scaled(hit->point, u[1], t->ac);
    hit->square = measure;
    if (!(q->reach > 0)) return;
    const double *n[3];
    smoothed_normals(s, t, n);
    smoothed_normal(n, u, hit->normal);
    hit->square = vgi_square(q->p, hit->point);
}

static void try_leaf(const vgi_surface *s, size_t begin, size_t end, const struct query *q, double *best,
                     vgi_hit *hit)
{
    for (size_t i = begin; i < end; i++) {
        const struct triangle *t = &s->triangle[i];
        double u[2] = {0, 0};
        uint8_t touched;
        double measure =
            q->reach > 0 ? alike_distance(s, t, q, u, &touched) : triangle_distance(t, q->p, u, &touched);
        if (!(measure <= *best) || (!(measure < *best) && t->face >= hit->face) || !normal_fits(s, t, u, q)) continue;
        vgi_hit found;
        set_hit(s, t, q, u, touched, measure, &found);
        if (found.square <= q->limit) *best = measure, *hit = found;
    }
}

/* Whether some normal in the box may fit: the angle to its axis is at most that of the cone and that of the cosine together. */
static bool may_fit(const struct box *b, const struct query *q)
{
    if (!q->normal || b->cosine < 0 || !(b->cosine > -q->cosine)) return true;
    return vgi_dot(b->axis, q->normal) >= q->cosine * b->cosine - q->sine * b->sine;
}

/* A lower bound of the measure in a box at this squared distance: its normals, also mixed, lie in its cone. */
static double least_measure(const struct box *b, const struct query *q, double square)
{
    if (b->cosine < 0) return square;
    double cosine = vgi_dot(b->axis, q->normal);
    if (cosine >= b->cosine) return square;
    double sine = sqrt(fmax(0, 1 - cosine * cosine));
    double beyond = sine * b->cosine - cosine * b->sine; /* sine of the angle beyond the cone */
    if (cosine * b->cosine + sine * b->sine < 0) beyond = 1;
    return square + q->reach * q->reach * beyond * beyond * (1 - 1e-12);
}

/* The least measure of at most `best`, nearest box first. */
static bool search(const vgi_surface *s, const struct query *q, double best, vgi_hit *hit)
{
    struct place {
        uint64_t node;
        int depth;
        double measure; /* of no point in it is it less */
    } stack[DEEPEST + 2];
    int top = 0;
    hit->face = UINT32_MAX;
    if (s->n) stack[top++] = (struct place){1, 0, 0};
    while (top > 0) {
        struct place at = stack[--top], child[2];
        if (at.measure > best) continue;
        if (at.depth == s->depth) {
            size_t begin, end;
            node_range(s->n, at.node, at.depth, &begin, &end);
            try_leaf(s, begin, end, q, &best, hit);
            continue;
        }
        for (unsigned i = 0; i < 2; i++) {
            const struct box *b = &s->box[2 * at.node + i];
            double square = box_distance(b, q->p);
            bool possible = square <= best && square <= q->limit && may_fit(b, q);
            if (possible && q->reach > 0) square = least_measure(b, q, square);
            child[i] = (struct place){2 * at.node + i, at.depth + 1, possible ? square : INFINITY};
        }
        bool swap = child[1].measure < child[0].measure;
        for (unsigned i = 0; i < 2; i++) { /* the nearer one last: it comes first */
            const struct place *c = &child[(i == 0) != swap];
            if (c->measure <= best && c->measure < INFINITY) stack[top++] = *c;
        }
    }
    return hit->face != UINT32_MAX;
}

bool vgi_surface_nearest(const vgi_surface *s, const double p[3], const double *normal, double cosine, double limit,
                         vgi_hit *hit)
{
    return vgi_surface_alike(s, p, normal, cosine, 0, limit, limit, hit);
}

bool vgi_surface_alike(const vgi_surface *s, const double p[3], const double *normal, double cosine, double reach,
                       double limit, double most, vgi_hit *hit)
{
    if (normal && !(vgi_dot(normal, normal) > 0)) normal = NULL;
    const struct query q = {p, normal, cosine, sqrt(fmax(0, 1 - cosine * cosine)), normal ? reach : 0, limit};
    return search(s, &q, q.reach > 0 ? most : limit, hit);
}
