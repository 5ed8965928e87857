/* meshes.h: the meshes that several unit tests try: generated ones of every kind of face, and those of tests/data.
 * Leaves out what is tested on them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TEST_MESHES_H
#define VG_TEST_MESHES_H

#include "core/core.h"
#include "test.h"

static uint64_t meshes_state = 1;

/* uniform in [-1, 1) */
static inline double noise(void)
{
    meshes_state = meshes_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(meshes_state >> 11) * 0x1p-52 - 1;
}

static inline void *room(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    if (!p) abort();
    return p;
}

/* ---- making: vertices and faces are added to a head of vertices ---- */

static inline uint32_t add_vertex(vg_head *h, double x, double y, double z)
{
    size_t n = h->body.mesh.nv;
    if ((n & (n - 1)) == 0 && !(h->body.reference = realloc(h->body.reference, (n ? 2 * n : 1) * 3 * sizeof(double))))
        abort();
    memcpy(h->body.reference + 3 * n, (double[]){x, y, z}, 3 * sizeof(double));
    h->count = ++h->body.mesh.nv;
    return (uint32_t)n;
}

static inline void add_face(vg_head *h, size_t r, const uint32_t *vert)
{
    vg_mesh *m = &h->body.mesh;
    size_t nf = m->nf, corners = vg_mesh_corners(m), cap = 1;
    while (cap < corners) cap *= 2;
    if (corners == 0) cap = 0;
    if (corners + r > cap) {
        for (cap = cap ? cap : 1; cap < corners + r;) cap *= 2;
        if (!(m->vert = realloc(m->vert, cap * sizeof *m->vert))) abort();
    }
    if (nf == 0 || (nf & (nf - 1)) == 0) {
        if (!(m->start = realloc(m->start, (nf ? 2 * nf + 1 : 2) * sizeof *m->start))) abort();
        if (nf == 0) m->start[0] = 0;
    }
    memcpy(m->vert + corners, vert, r * sizeof *vert);
    m->start[++m->nf] = (uint32_t)(corners + r);
}

#define FACE(h, ...) \
    add_face(h, sizeof((uint32_t[]){__VA_ARGS__}) / sizeof(uint32_t), (uint32_t[]){__VA_ARGS__})

static inline vg_head new_shape(void)
{
    vg_head h = {.kind = VG_VERTICES, .precision = VG_F64};
    h.body.reference_name = strdup("rest");
    h.body.reference = room(3, sizeof(double));
    h.body.mesh.start = room(1, sizeof *h.body.mesh.start);
    return h;
}

/* A closed rod along z: `rings` rings of `sides` vertices, quads (triangles if `split`) and two n-gons as lids. */
static inline vg_head make_rod(size_t rings, size_t sides, bool split)
{
    vg_head h = new_shape();
    uint32_t *lid = room(sides, sizeof *lid), n = (uint32_t)sides;
    for (size_t i = 0; i < rings; i++)
        for (size_t k = 0; k < sides; k++) {
            double a = 2 * M_PI * (double)k / (double)sides, fat = 1 + 0.2 * sin(0.1 * (double)i);
            add_vertex(&h, fat * cos(a), fat * sin(a), 2 * M_PI * (double)i / (double)sides);
        }
    for (uint32_t i = 0; i + 1 < rings; i++)
        for (uint32_t k = 0; k < n; k++) {
            uint32_t a = i * n + k, b = i * n + (k + 1) % n, c = b + n, d = a + n;
            if (split) FACE(&h, a, b, c), FACE(&h, a, c, d);
            else FACE(&h, a, b, c, d);
        }
    for (uint32_t k = 0; k < n; k++) lid[k] = n - 1 - k;
    add_face(&h, sides, lid);
    for (uint32_t k = 0; k < n; k++) lid[k] = (uint32_t)(rings - 1) * n + k;
    add_face(&h, sides, lid);
    free(lid);
    return h;
}

static inline void add_torus(vg_head *h, uint32_t u, uint32_t v, const double at[3])
{
    uint32_t first = (uint32_t)h->body.mesh.nv;
    for (uint32_t i = 0; i < u; i++)
        for (uint32_t k = 0; k < v; k++) {
            double a = 2 * M_PI * i / u, b = 2 * M_PI * k / v, r = 1 + 0.35 * cos(b);
            add_vertex(h, at[0] + r * cos(a), at[1] + r * sin(a), at[2] + 0.35 * sin(b));
        }
    for (uint32_t i = 0; i < u; i++)
        for (uint32_t k = 0; k < v; k++)
            FACE(h, first + i * v + k, first + (i + 1) % u * v + k, first + (i + 1) % u * v + (k + 1) % v,
                 first + i * v + (k + 1) % v);
}

static inline vg_head make_torus(uint32_t u, uint32_t v)
{
    vg_head h = new_shape();
    add_torus(&h, u, v, (double[3]){0, 0, 0});
    return h;
}

/* A sheet in the plane z = 0, of n x n uneven quads, stretched by a along x and b along y. */
static inline vg_head make_uneven_sheet(uint32_t n, double a, double b)
{
    vg_head h = new_shape();
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t k = 0; k <= n; k++)
            add_vertex(&h, a * (i + 0.2 * sin(3 * i + k)), b * (k + 0.2 * cos(i * k + 1)), 0);
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t k = 0; k < n; k++)
            FACE(&h, i * (n + 1) + k, (i + 1) * (n + 1) + k, (i + 1) * (n + 1) + k + 1, i * (n + 1) + k + 1);
    return h;
}

/* One face of r corners: a star that is concave (every second corner pulled in) and bent (a saddle), if asked. */
static inline vg_head make_ngon(size_t r, double pull, double bend)
{
    vg_head h = new_shape();
    uint32_t *face = room(r, sizeof *face);
    for (size_t i = 0; i < r; i++) {
        double a = 2 * M_PI * (double)i / (double)r, far = i % 2 ? 1 - pull : 1;
        face[i] = add_vertex(&h, far * cos(a), far * sin(a), bend * cos(2 * a));
    }
    add_face(&h, r, face);
    free(face);
    return h;
}

/* An n-gon with a ring of triangles around it: r + 1 faces that share edges. */
static inline vg_head make_flower(size_t r)
{
    vg_head h = make_ngon(r, 0.3, 0.2);
    for (uint32_t i = 0; i < r; i++) {
        double a = 2 * M_PI * (i + 0.5) / (double)r;
        uint32_t tip = add_vertex(&h, 1.6 * cos(a), 1.6 * sin(a), -0.3 + 0.1 * sin(3 * a));
        FACE(&h, i, tip, (i + 1) % (uint32_t)r);
    }
    return h;
}

/* n line segments end to end, in zigzag. */
static inline vg_head make_chain(uint32_t n)
{
    vg_head h = new_shape();
    add_vertex(&h, 0, 0, 0);
    for (uint32_t i = 0; i < n; i++) {
        add_vertex(&h, i + 1, i % 2, 0.3 * (i % 5));
        FACE(&h, i, i + 1);
    }
    return h;
}

/* A skeleton: n line segments, each from an earlier vertex. */
static inline vg_head make_tree(uint32_t n)
{
    vg_head h = new_shape();
    add_vertex(&h, 0, 0, 0);
    for (uint32_t i = 1; i <= n; i++) {
        uint32_t p = (uint32_t)((noise() + 1) / 2 * i);
        const double *at = h.body.reference + 3 * (size_t)p;
        add_vertex(&h, at[0] + noise(), at[1] + noise(), at[2] + noise());
        FACE(&h, p, i);
    }
    return h;
}

/* A wavy sheet of n x n cells: quads, pairs of triangles and hexagons of two cells, with line segments hanging from
 * its border, and two isolated vertices. */
static inline vg_head make_mixed(uint32_t n)
{
    vg_head h = new_shape();
    add_vertex(&h, 9, 9, 9); /* isolated */
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t k = 0; k <= n; k++) add_vertex(&h, i, k, 0.4 * sin(1.3 * i) * cos(0.9 * k));
#define AT(i, k) (1 + (i) * (n + 1) + (k))
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t k = 0; k < n; k++) {
            uint32_t a = AT(i, k), b = AT(i + 1, k), c = AT(i + 1, k + 1), d = AT(i, k + 1);
            switch ((i + 2 * k) % 5) {
            case 0: FACE(&h, a, b, c), FACE(&h, a, c, d); break;
            case 1: FACE(&h, a, b, d), FACE(&h, b, c, d); break;
            case 2:
                if (k + 1 < n && (i + 2 * (k + 1)) % 5 == 4) {
                    FACE(&h, a, b, c, AT(i + 1, k + 2), AT(i, k + 2), d);
                    k++;
                    break;
                }
                FACE(&h, a, b, c, d);
                break;
            default: FACE(&h, a, b, c, d);
            }
        }
    for (uint32_t i = 0; i <= n; i++) {
        uint32_t end = add_vertex(&h, i, -1, -0.5 - 0.1 * i);
        FACE(&h, AT(i, 0), end);
    }
#undef AT
    add_vertex(&h, -9, 9, 0); /* isolated */
    return h;
}

/* Tori apart, of which the last two coincide; and a lone triangle far off. */
static inline vg_head make_pieces(void)
{
    vg_head h = new_shape();
    add_torus(&h, 9, 6, (double[3]){0, 0, 0});
    add_torus(&h, 7, 5, (double[3]){2, 0.5, 0.5});
    add_torus(&h, 8, 6, (double[3]){0, 0, 2});
    add_torus(&h, 8, 6, (double[3]){0, 0, 2});
    uint32_t a = add_vertex(&h, 9, 0, 0), b = add_vertex(&h, 9, 1, 0), c = add_vertex(&h, 9, 0, 1);
    FACE(&h, a, b, c);
    return h;
}

/* Faces without area, edges without length, a corner at its face's centroid, beside good ones. */
static inline vg_head make_degenerate(void)
{
    vg_head h = new_shape();
    static const double at[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, /* 0-3 a good quad */
                                   {2, 0, 0}, {3, 0, 0},                       /* 4, 5 with 1: a line */
                                   {2, 2, 1}, {2, 2, 1}, {2, 2, 1},            /* 6-8 one point */
                                   {0.25, 0.25, 0}, /* 9 with 0, 1, 3: centroid of a quad */
                                   {0.75, 0, 0},    /* 0.25 * (3, 0, 0) - so that 9 sits there */
                                   {0, 0.75, 0}, {0, 3, 0}};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) add_vertex(&h, at[i][0], at[i][1], at[i][2]);
    FACE(&h, 0, 1, 2, 3);
    FACE(&h, 1, 4, 5);        /* no area */
    FACE(&h, 6, 7, 8);        /* a point */
    FACE(&h, 6, 7);           /* no length */
    FACE(&h, 2, 6);
    FACE(&h, 2, 5, 8);
    FACE(&h, 0, 10, 9, 11);   /* vertex 9 is the centroid: 0 + 0.75 + 0.25 over 4 */
    FACE(&h, 3, 12, 2);
    return h;
}

static inline void add_isolated(vg_head *h)
{
    add_vertex(h, 5, -7, 11);
    add_vertex(h, -3, 2, 1);
}

/* ---- the meshes of tests/data; the tests run at the root of the sources ---- */

typedef struct film {
    vg_head h;
    size_t n;
    double **pose;
} film;

static inline void film_clear(film *f)
{
    for (size_t i = 0; i < f->n; i++) free(f->pose[i]);
    free(f->pose);
    vg_head_clear(&f->h);
    *f = (film){0};
}

/* At most `most` poses; the reference is that of the sequence's own first pose, or rest_name if given. */
static inline film load_film(const char *name, const char *rest_name, size_t most)
{
    film x = {0};
    vg_err e = {0, ""};
    char path[200];
    const char *operand = path;
    vg_source *s = NULL;
    vg_frame f = {0};
    snprintf(path, sizeof path, "tests/data/%s", name);
    if (vg_source_open(&s, &operand, 1, &e) < 0 || vg_head_copy(&x.h, vg_source_head(s), &e) < 0) {
        printf("%s\n", e.message);
        exit(1);
    }
    x.pose = room(most, sizeof *x.pose);
    while (x.n < most && vg_source_next(s, &f, &e) > 0) {
        x.pose[x.n] = room(3 * x.h.body.mesh.nv, sizeof(double));
        memcpy(x.pose[x.n++], f.values, 3 * x.h.body.mesh.nv * sizeof(double));
    }
    vg_frame_clear(&f);
    vg_source_close(&s);
    if (rest_name) {
        vg_head rest = {0};
        snprintf(path, sizeof path, "tests/data/%s", rest_name);
        if (vg_load(&rest, path, "mesh", &e) < 0) printf("%s\n", e.message), exit(1);
        memcpy(x.h.body.reference, rest.body.reference, 3 * x.h.body.mesh.nv * sizeof(double));
        vg_head_clear(&rest);
    }
    CHECK(x.n > 0);
    return x;
}

/* ---- poses ---- */

typedef struct motion {
    double m[9], shift[3]; /* x -> m x + shift */
} motion;

/* A rotation by `angle` about a skew axis, times a scale, and a shift. */
static inline motion turn(double angle, double scale, double shift)
{
    const double axis[3] = {2.0 / 7, -3.0 / 7, 6.0 / 7}, s = sin(angle / 2);
    const double q[4] = {cos(angle / 2), s * axis[0], s * axis[1], s * axis[2]};
    motion t = {.shift = {shift, -2 * shift, 0.5 * shift}};
    vg_quat_matrix(q, t.m);
    for (int k = 0; k < 9; k++) t.m[k] *= scale;
    return t;
}

static inline void move_vector(const motion *t, const double *x, double *y)
{
    double z[3];
    for (int k = 0; k < 3; k++) z[k] = t->m[3 * k] * x[0] + t->m[3 * k + 1] * x[1] + t->m[3 * k + 2] * x[2];
    memcpy(y, z, sizeof z);
}

static inline double *move_points(const motion *t, const double *x, size_t n)
{
    double *y = room(3 * n, sizeof *y);
    for (size_t i = 0; i < n; i++) {
        move_vector(t, x + 3 * i, y + 3 * i);
        for (int k = 0; k < 3; k++) y[3 * i + (size_t)k] += t->shift[k];
    }
    return y;
}

/* The points twisted about z, bent, stretched, and shaken a little: no corner keeps its angles.
 * Points that coincide still do. */
static inline double *warp(const double *x, size_t n, double amount)
{
    double D = vg_diagonal(x, n), *y = room(3 * n, sizeof *y), shake = 0.03 * amount * D / sqrt((double)n + 1);
    if (!(D > 0)) D = 1;
    for (size_t i = 0; i < n; i++) {
        double a = 2 * amount * x[3 * i + 2] / D, c = cos(a), s = sin(a);
        double wild = 1e3 * (x[3 * i] + 2 * x[3 * i + 1] - x[3 * i + 2]) / D;
        double px = c * x[3 * i] - s * x[3 * i + 1], py = s * x[3 * i] + c * x[3 * i + 1], pz = x[3 * i + 2];
        y[3 * i] = px + amount * py * py / D + shake * sin(wild);
        y[3 * i + 1] = py * (1 + 0.3 * amount) - amount * px * pz / D + shake * sin(2 * wild);
        y[3 * i + 2] = pz + 0.5 * amount * px + shake * sin(3 * wild);
    }
    return y;
}

/* ---- comparing ---- */

/* the largest distance between two lists of points; infinite if anything is not finite */
static inline double farthest(const double *a, const double *b, size_t n)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) {
        double d2 = 0;
        for (size_t k = 3 * i; k < 3 * i + 3; k++) d2 += (a[k] - b[k]) * (a[k] - b[k]);
        if (!(d2 <= most)) most = d2;
        if (!(d2 < INFINITY)) return INFINITY;
    }
    return sqrt(most);
}

static inline vg_graph *graph_of(vg_head *h)
{
    vg_graph *g = NULL;
    vg_err e = {0, ""};
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_head_graph(&g, h, &e) < 0) printf("%s\n", e.message), exit(1);
    return g;
}

static inline double *vectors_of(const vg_graph *g, const double *pose)
{
    double *w = room(3 * vg_graph_corners(g), sizeof *w);
    vg_graph_vectors(g, pose, w);
    return w;
}

/* Every kind of mesh that is generated, by number; false when there are no more. */
static inline bool make_any(size_t i, vg_head *h, const char **name)
{
    static const size_t corners[] = {3, 4, 5, 6, 7, 8, 11, 12, 13, 16, 17, 24, 40};
    enum { NGONS = sizeof corners / sizeof *corners };
    static char text[40];
    *name = text;
    if (i < NGONS) {
        snprintf(text, sizeof text, "face of %zu corners", corners[i]);
        return *h = make_ngon(corners[i], corners[i] > 4 && i % 2 ? 0.7 : 0, i % 3 ? 0.3 : 0), true;
    }
    if ((i -= NGONS) < NGONS) {
        snprintf(text, sizeof text, "flower of %zu", corners[i]);
        return *h = make_flower(corners[i]), true;
    }
    switch (i - NGONS) {
    case 0: *name = "segment", *h = make_chain(1); break;
    case 1: *name = "chain", *h = make_chain(100); break;
    case 2: *name = "tree", *h = make_tree(60); break;
    case 3: *name = "rod of quads", *h = make_rod(30, 14, false); break;
    case 4: *name = "rod of triangles", *h = make_rod(12, 9, true); break;
    case 5: *name = "torus", *h = make_torus(17, 11); break;
    case 6: *name = "mixed", *h = make_mixed(8); break;
    case 7: *name = "pieces", *h = make_pieces(); break;
    case 8: *name = "torus and isolated", *h = make_torus(5, 4), add_isolated(h); break;
    default: return false;
    }
    return true;
}

#endif
