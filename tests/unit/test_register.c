/* test_register.c: nearest points on polygons, sparse systems, markers as text, and registration: a mesh to itself,
 * to a turned and re-triangulated copy, to another body; wrong markers, parts without counterpart, bones, texture
 * coordinates.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "numeric/sparse.h"
#include "method/pairs/surface.h"

static vg_head load(const char *name)
{
    vg_head h = {0};
    vg_err e = {0, ""};
    char path[200];
    snprintf(path, sizeof path, "tests/data/%s", name);
    if (vg_load(&h, path, "mesh", &e) < 0) printf("%s\n", e.message), exit(1);
    return h;
}

static vg_markers read_markers(const char *text, int base)
{
    vg_markers m = {0};
    vg_err e = {0, ""};
    if (vg_markers_read(&m, text, strlen(text), base, "markers", &e) < 0) printf("%s\n", e.message), exit(1);
    return m;
}

static vg_markers load_markers(const char *name)
{
    char path[200], text[4096];
    snprintf(path, sizeof path, "tests/data/%s", name);
    FILE *f = fopen(path, "r");
    if (!f) abort();
    text[fread(text, 1, sizeof text - 1, f)] = 0;
    fclose(f);
    return read_markers(text, 0);
}

/* n markers of vertices that are in faces; to[v] is the target's number of v, NULL: the same */
static vg_markers spread_markers(const vg_mesh *m, size_t n, const uint32_t *to)
{
    vg_markers x = {n, room(n, sizeof *x.at)};
    for (size_t i = 0; i < n; i++) {
        uint32_t v = m->vert[(2 * i + 1) * vg_mesh_corners(m) / (2 * n + 1)];
        x.at[i] = (vg_marker){v, to ? to[v] : v, NULL, 0};
    }
    return x;
}

static vg_register_input between(const vg_head *a, const vg_head *b, const vg_markers *m)
{
    return (vg_register_input){.source = &a->body.mesh,
                               .target = &b->body.mesh,
                               .source_points = a->body.reference,
                               .target_points = b->body.reference,
                               .markers = m,
                               .threads = 1};
}

static vg_register_result registered(const vg_register_input *in)
{
    vg_register_result r;
    vg_err e = {0, ""};
    if (vg_register(&r, in, NULL, NULL, &e) < 0) printf("%s\n", e.message), exit(1);
    return r;
}

/* What every correspondence keeps. */
static void check_whole(const vg_correspondence *c, const vg_head *a, const vg_head *b)
{
    CHECK(c->source_nf == a->body.mesh.nf && c->target_nf == b->body.mesh.nf && c->source_nv == a->body.mesh.nv &&
          c->target_nv == b->body.mesh.nv);
    CHECK(c->source_digest == vg_mesh_digest(&a->body.mesh) && c->target_digest == vg_mesh_digest(&b->body.mesh));
    bool driven = true, fair = true, known = true;
    for (size_t f = 0; f < c->target_nf; f++) {
        double sum = 0;
        driven = driven && c->first[f] < c->first[f + 1];
        for (uint32_t i = c->first[f]; i < c->first[f + 1]; i++) {
            known = known && c->source[i] < c->source_nf && c->weight[i] > 0;
            for (uint32_t k = c->first[f]; k < i; k++) known = known && c->source[k] != c->source[i];
            sum += c->weight[i];
        }
        fair = fair && fabs(sum - 1) < 1e-12;
        known = known && c->distance[f] >= 0 && c->matched[f] <= 1;
    }
    CHECK(driven);
    CHECK(fair);
    CHECK(known);
}

static double share_of_identity(const vg_correspondence *c)
{
    size_t n = 0;
    for (size_t f = 0; f < c->target_nf; f++) n += c->first[f + 1] - c->first[f] == 1 && c->source[c->first[f]] == f;
    return (double)n / (double)c->target_nf;
}

static size_t count_matched(const vg_correspondence *c)
{
    size_t n = 0;
    for (size_t f = 0; f < c->target_nf; f++) n += c->matched[f];
    return n;
}

/* ---- the parts ---- */

static double brute_distance(const vg_head *h, const double p[3])
{
    const vg_mesh *m = &h->body.mesh;
    double best = INFINITY;
    for (size_t f = 0; f < m->nf; f++) {
        size_t r = m->start[f + 1] - m->start[f];
        double C[3] = {0};
        for (size_t i = 0; i < r; i++)
            for (size_t k = 0; k < 3; k++)
                C[k] += h->body.reference[3 * (size_t)m->vert[m->start[f] + i] + k] / (double)r;
        for (size_t i = 0; i < (r <= 3 ? 1 : r); i++) {
            const double *a = h->body.reference + 3 * (size_t)m->vert[m->start[f] + i];
            const double *b = h->body.reference + 3 * (size_t)m->vert[m->start[f] + (i + 1) % r];
            const double *c = r == 2 ? b : r == 3 ? h->body.reference + 3 * (size_t)m->vert[m->start[f] + 2] : C;
            enum { STEPS = 60 };
            for (int s = 0; s <= STEPS; s++)
                for (int t = 0; s + t <= STEPS; t++) {
                    double u = s / (double)STEPS, v = t / (double)STEPS, d2 = 0;
                    for (int k = 0; k < 3; k++) {
                        double d = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]) - p[k];
                        d2 += d * d;
                    }
                    if (d2 < best) best = d2;
                }
        }
    }
    return sqrt(best);
}

/* A search by sampling can only be farther than the true nearest point, and by no more than the samples' spacing. */
static void nearest_points(void)
{
    vg_head h = make_mixed(5);
    vgi_surface *s;
    CHECK(vgi_surface_new(&s, &h.body.mesh, h.body.reference, NULL) == VG_OK);
    for (int i = 0; i < 60; i++) {
        double p[3] = {2.5 + 4 * noise(), 2.5 + 4 * noise(), 2 * noise()}, brute = brute_distance(&h, p);
        vgi_hit hit;
        CHECK(vgi_surface_nearest(s, p, NULL, 0, INFINITY, &hit));
        CHECK(sqrt(hit.square) <= brute + 1e-12 && sqrt(hit.square) >= brute - 0.03);
        double d2 = 0;
        for (int k = 0; k < 3; k++) d2 += (p[k] - hit.point[k]) * (p[k] - hit.point[k]);
        CHECK_NEAR(d2, hit.square, 1e-12);
        CHECK(!vgi_surface_nearest(s, p, NULL, 0, 0.99 * hit.square, &hit) || hit.square == 0);
    }
    vgi_surface_free(&s);
    vg_head_clear(&h);
}

static void nearest_points_by_normal(void)
{
    vg_head h = new_shape(); /* two sheets that look away from one another, and their borders */
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 4; i++) add_vertex(&h, i == 1 || i == 2, i / 2, 0.1 * k);
    FACE(&h, 3, 2, 1, 0);
    FACE(&h, 4, 5, 6, 7);
    vgi_surface *s;
    vgi_hit hit;
    const double at[3] = {0.4, 0.4, 0.06}, up[3] = {0, 0, 1}, down[3] = {0, 0, -1}, beside[3] = {-1, 0.5, 0.1};
    CHECK(vgi_surface_new(&s, &h.body.mesh, h.body.reference, NULL) == VG_OK);
    CHECK(vgi_surface_nearest(s, at, NULL, 0, INFINITY, &hit) && hit.face == 1 && !hit.border);
    CHECK(vgi_surface_nearest(s, at, up, 0.5, INFINITY, &hit) && hit.face == 1);
    CHECK_NEAR(hit.square, 0.0016, 1e-15);
    CHECK(vgi_surface_nearest(s, at, down, 0.5, INFINITY, &hit) && hit.face == 0);
    CHECK_NEAR(hit.square, 0.0036, 1e-15);
    CHECK(!vgi_surface_nearest(s, at, down, 0.5, 0.003, &hit));
    CHECK(vgi_surface_nearest(s, beside, NULL, 0, INFINITY, &hit) && hit.face == 1 && hit.border);
    vgi_surface_free(&s);
    vg_head_clear(&h);
}

static double square6(const double p[3], const double n[3], const double q[3], const double m[3], double reach)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += (p[k] - q[k]) * (p[k] - q[k]) + reach * reach * (n[k] - m[k]) * (n[k] - m[k]);
    return sum;
}

/* The least measure over a grid of points of the triangles into which a surface of quads is divided. */
static double brute_measure(const vg_head *h, const vgi_surface *s, const double p[3], const double n[3], double reach)
{
    enum { STEPS = 20 };
    const vg_mesh *m = &h->body.mesh;
    double best = INFINITY;
    for (size_t f = 0; f < m->nf; f++)
        for (uint32_t i = 0; i < 4; i++) {
            uint32_t a = m->vert[4 * f + i], b = m->vert[4 * f + (i + 1) % 4];
            const double *x = h->body.reference, *v = vgi_surface_vertex_normals(s);
            const double *c = vgi_surface_centroids(s) + 3 * f, *cn = vgi_surface_normals(s) + 3 * f;
            for (int j = 0; j <= STEPS; j++)
                for (int k = 0; j + k <= STEPS; k++) {
                    double u = j / (double)STEPS, w = k / (double)STEPS, q[3], qn[3];
                    for (size_t d = 0; d < 3; d++) {
                        q[d] = (1 - u - w) * x[3 * a + d] + u * x[3 * b + d] + w * c[d];
                        qn[d] = (1 - u - w) * v[3 * a + d] + u * v[3 * b + d] + w * cn[d];
                    }
                    best = fmin(best, square6(p, n, q, qn, reach));
                }
        }
    return best;
}

static void points_alike(void)
{
    vg_head h = new_shape();
    vgi_surface *s;
    const double reach = 0.7;
    add_torus(&h, 12, 9, (const double[3]){0, 0, 0});
    CHECK(vgi_surface_new(&s, &h.body.mesh, h.body.reference, NULL) == VG_OK);
    for (int i = 0; i < 40; i++) {
        double p[3] = {4 * noise(), 4 * noise(), 2 * noise()}, n[3] = {noise(), noise(), noise()};
        double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        vgi_hit hit, near;
        for (int k = 0; k < 3; k++) n[k] /= length;
        double brute = brute_measure(&h, s, p, n, reach);
        CHECK(vgi_surface_alike(s, p, n, -1, reach, INFINITY, INFINITY, &hit));
        CHECK_NEAR(hit.measure, square6(p, n, hit.point, hit.normal, reach), 1e-12);
        CHECK(hit.measure <= brute + 1e-12 && hit.measure > brute - 0.05);
        CHECK(vgi_surface_nearest(s, p, NULL, 0, INFINITY, &near) && near.square <= hit.square + 1e-12);
        /* the bound of the measure excludes what is above it, that of the distance what is farther */
        CHECK(!vgi_surface_alike(s, p, n, -1, reach, INFINITY, 0.99 * hit.measure, &hit));
        CHECK(!vgi_surface_alike(s, p, n, -1, reach, 0.99 * near.square, INFINITY, &hit));
    }
    vgi_surface_free(&s);
    vg_head_clear(&h);
}

/* A point beside a ridge whose normal is that of the ridge goes towards it. */
static void ridges(void)
{
    vg_head h = new_shape();
    for (int i = 0; i < 6; i++) add_vertex(&h, i % 3 - 1, i / 3, i % 3 == 1); /* a roof along y */
    FACE(&h, 0, 1, 4, 3);
    FACE(&h, 1, 2, 5, 4);
    vgi_surface *s;
    vgi_hit near, alike;
    const double p[3] = {0.3, 0.5, 0.7}, up[3] = {0, 0, 1};
    CHECK(vgi_surface_new(&s, &h.body.mesh, h.body.reference, NULL) == VG_OK);
    CHECK(vgi_surface_nearest(s, p, up, 0.4, INFINITY, &near));
    CHECK_NEAR(near.point[0], 0.3, 1e-12);
    CHECK(vgi_surface_alike(s, p, up, 0.4, 0.5, INFINITY, INFINITY, &alike) && alike.point[0] < 0.25);
    CHECK(vgi_surface_alike(s, p, up, 0.4, 100, INFINITY, INFINITY, &alike));
    CHECK_NEAR(alike.point[0], 0, 1e-3);
    vgi_surface_free(&s);
    vg_head_clear(&h);
}

/* The tree leaves out boxes whose normals do not fit: it finds what the nearest of surfaces of one face each finds. */
static void boxes_of_other_normals_are_left_out(void)
{
    enum { FACES = 12 * 9, POINTS = 150 };
    vg_head h = new_shape();
    vgi_surface *whole, *alone[FACES];
    add_torus(&h, 12, 9, (const double[3]){0, 0, 0});
    CHECK(h.body.mesh.nf == FACES);
    CHECK(vgi_surface_new(&whole, &h.body.mesh, h.body.reference, NULL) == VG_OK);
    for (size_t f = 0; f < FACES; f++) {
        bool take[FACES] = {false};
        take[f] = true;
        CHECK(vgi_surface_of(&alone[f], &h.body.mesh, h.body.reference, take, NULL) == VG_OK);
    }
    size_t found = 0, farther = 0;
    for (size_t i = 0; i < POINTS; i++) {
        static const double cosines[] = {-0.5, 0, 0.5, 0.9, 0.99, 0.9999};
        double p[3] = {4 * noise(), 4 * noise(), 4 * noise()}, n[3] = {noise(), noise(), noise()}, cosine = cosines[i % 6];
        double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), best = INFINITY;
        vgi_hit hit, one;
        for (int k = 0; k < 3; k++) n[k] /= length;
        for (size_t f = 0; f < FACES; f++)
            if (vgi_surface_nearest(alone[f], p, n, cosine, INFINITY, &one)) best = fmin(best, one.square);
        bool any = vgi_surface_nearest(whole, p, n, cosine, INFINITY, &hit);
        CHECK(any == (best < INFINITY));
        if (!any) continue;
        CHECK(hit.square == best);
        CHECK(vgi_surface_nearest(whole, p, NULL, 0, INFINITY, &one));
        found++, farther += hit.square > one.square;
    }
    CHECK(found > POINTS / 2 && found < POINTS && farther > POINTS / 4); /* all cases occur */
    for (size_t f = 0; f < FACES; f++) vgi_surface_free(&alone[f]);
    vgi_surface_free(&whole);
    vg_head_clear(&h);
}

/* A chain of springs, both ends held: the solution is a straight line; then the numbers change and the pattern stays.
 */
static void sparse_systems(void)
{
    enum { N = 700 };
    vgi_sparse a = {N, room(N + 1, sizeof(int)), room(2 * N, sizeof(int)), room(2 * N, sizeof(double))};
    double *x = room(3 * N, sizeof *x);
    vgi_cholesky *c;
    vg_err e;
    int n = 0;
    for (int i = 0; i < N; i++) {
        a.row[n] = i, a.value[n++] = 2;
        if (i + 1 < N) a.row[n] = i + 1, a.value[n++] = -1;
        a.start[i + 1] = n;
    }
    CHECK(vgi_cholesky_new(&c, &a, NULL, &e) == VG_OK);
    for (int scale = 1; scale <= 4; scale *= 2) {
        for (int i = 0; i < n; i++) a.value[i] *= scale == 1 ? 1 : 2;
        memset(x, 0, 3 * N * sizeof *x);
        x[3 * (N - 1)] = N + 1, x[0 + 1] = N + 1, x[2] = x[3 * (N - 1) + 2] = 1;
        CHECK(vgi_cholesky_factorize(c, &a, &e) == VG_OK);
        CHECK(vgi_cholesky_solve(c, x, &e) == VG_OK);
        double worst = 0;
        for (int i = 0; i < N; i++) {
            worst = fmax(worst, fabs(x[3 * i] * scale - (i + 1)));
            worst = fmax(worst, fabs(x[3 * i + 1] * scale - (N - i)));
            worst = fmax(worst, fabs(x[3 * i + 2] * scale - 1));
        }
        CHECK_NEAR(worst, 0, 1e-7); /* the condition number is about N^2 */
    }
    for (int i = 0; i < n; i++) a.value[i] = -a.value[i];
    CHECK(vgi_cholesky_factorize(c, &a, &e) == VG_EINPUT);
    vgi_cholesky_free(&c);
    vgi_sparse_clear(&a);
    free(x);
}

static void markers_as_text(void)
{
    vg_markers m = read_markers("# a comment\n0 1\r\n\n  nose\t5  7 # tip\nchin,8;9", 0);
    CHECK(m.n == 3);
    CHECK(m.at[0].source == 0 && m.at[0].target == 1 && !m.at[0].name && m.at[0].line == 2);
    CHECK(m.at[1].source == 5 && m.at[1].target == 7 && m.at[1].line == 4);
    CHECK_TEXT(m.at[1].name, "nose");
    CHECK_TEXT(m.at[2].name, "chin");
    CHECK(m.at[2].source == 8 && m.at[2].target == 9);
    vg_markers_clear(&m);
    CHECK(m.n == 0 && !m.at);
    m = read_markers("1 2", 1);
    CHECK(m.at[0].source == 0 && m.at[0].target == 1);
    vg_markers_clear(&m);
    static const struct {
        const char *text, *message;
    } wrong[] = {{"", "'f' names no pair of vertices"},
                 {"1\n", "'f' line 1: a marker is 'SOURCE TARGET' or 'NAME SOURCE TARGET'"},
                 {"1 2\na b 1 2\n", "'f' line 2: a marker is 'SOURCE TARGET' or 'NAME SOURCE TARGET'"},
                 {"1 x", "'f' line 1: 'x' is not a vertex number"},
                 {"1 2.5", "'f' line 1: '2.5' is not a vertex number"},
                 {"1 -2", "'f' line 1: there is no vertex -2: vertices are counted from 0"},
                 {"1 5000000000", "'f' line 1: there is no vertex 5000000000: vertices are counted from 0"},
                 {"1 99999999999999999999", "'f' line 1: '99999999999999999999' is not a vertex number"},
                 {"\377 1 2", "'f' line 1: the name is not UTF-8"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        vg_err e = {0, ""};
        CHECK(vg_markers_read(&m, wrong[i].text, strlen(wrong[i].text), 0, "f", &e) == VG_EINPUT);
        CHECK_TEXT(e.message, wrong[i].message);
        CHECK(m.n == 0 && !m.at);
    }
}

static void seeds_as_text(void)
{
    static const char text[] = "# dense\n0 - - - 0 0 0\n3 1 2 5 0.25 0.25 0.5\n4 -\n7 1 1 1 2e0 -0.5 0\n";
    vg_seed *s;
    size_t n;
    vg_err e = {0, ""};
    CHECK(vg_seeds_read(&s, &n, text, strlen(text), 0, "f", &e) == VG_OK && n == 2);
    CHECK(s[0].vertex == 3 && s[0].on[2] == 5 && s[0].weight[2] == 0.5 && s[1].vertex == 7);
    CHECK_NEAR(s[1].weight[0] + s[1].weight[1] + s[1].weight[2], 1, 1e-15);
    free(s);
    static const char *const wrong[] = {"1 -\n",         "1 2 3\n",       "1 2 3 4 1 0 nan",
                                        "1 2 3 4 0 0 0", "1 2 3 4 9 9 9", "1 2 x 4 1 0 0"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        CHECK(vg_seeds_read(&s, &n, wrong[i], strlen(wrong[i]), 0, "f", &e) == VG_EINPUT && !s && n == 0);
}

/* ---- MATH 9: must hold ---- */

static void check_identity(const vg_head *h)
{
    vg_markers m = spread_markers(&h->body.mesh, 4, NULL);
    vg_register_input in = between(h, h, &m);
    vg_register_result r = registered(&in);
    check_whole(&r.pairs, h, h);
    CHECK(share_of_identity(&r.pairs) >= 0.99);
    CHECK(count_matched(&r.pairs) == h->body.mesh.nf);
    CHECK_NEAR(farthest(r.fitted, h->body.reference, h->body.mesh.nv), 0,
               1e-6 * vg_diagonal(h->body.reference, h->body.mesh.nv));
    vg_register_result_clear(&r);
    vg_markers_clear(&m);
}

static void identity_on_real_meshes(void)
{
    static const char *const names[] = {"trex.rest.obj", "horse.rest.obj", "woman-tanktop.rest.obj",
                                        "walk-man.rest.obj.xz"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        vg_head h = load(names[i]);
        check_identity(&h);
        vg_head_clear(&h);
    }
}

static void identity_on_generated_meshes(void)
{
    const char *name;
    vg_head h;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        bool flat = h.body.mesh.nf < 12; /* too few vertices for four markers that are not in line */
        if (!flat) check_identity(&h);
        if (test_bad) printf("%s\n", name);
        vg_head_clear(&h);
    }
}

/* A cone whose tip joins thousands of triangles: nothing may grow with the square of their number. */
static void fans(void)
{
    enum { N = 20000 };
    vg_head h = new_shape();
    add_vertex(&h, 0, 0, 1);
    for (uint32_t i = 0; i < N; i++) add_vertex(&h, cos(2 * M_PI * i / N), 0.5 * sin(2 * M_PI * i / N), 0);
    for (uint32_t i = 0; i < N; i++) FACE(&h, 0, 1 + i, 1 + (i + 1) % N);
    check_identity(&h);
    vg_head_clear(&h);
}

/* The mesh turned, scaled, moved; larger faces split into fans from a corner of their own;
 * vertices and faces in another order. */
static vg_head disguise(const vg_head *h, const motion *t, uint32_t *to, bool turn_over)
{
    const vg_mesh *m = &h->body.mesh;
    vg_head x = new_shape();
    double *moved = move_points(t, h->body.reference, m->nv);
    uint32_t *from = room(m->nv, sizeof *from);
    for (uint32_t v = 0; v < m->nv; v++) from[v] = v;
    for (size_t v = m->nv; v > 1; v--) {
        size_t k = (size_t)((noise() + 1) / 2 * (double)v);
        uint32_t swap = from[v - 1];
        from[v - 1] = from[k], from[k] = swap;
    }
    for (uint32_t v = 0; v < m->nv; v++) {
        const double *p = moved + 3 * (size_t)from[v];
        to[from[v]] = v;
        add_vertex(&x, p[0], p[1], p[2]);
    }
    for (size_t i = m->nf; i-- > 0;) {
        size_t f = i, r = m->start[f + 1] - m->start[f], first = (size_t)((noise() + 1) / 2 * (double)r);
        const uint32_t *vert = m->vert + m->start[f];
        for (size_t k = 1; k + 1 < r; k++) {
            uint32_t a = to[vert[first]], b = to[vert[(first + k) % r]], c = to[vert[(first + k + 1) % r]];
            if (turn_over) FACE(&x, a, c, b);
            else FACE(&x, a, b, c);
        }
    }
    free(moved);
    free(from);
    return x;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median_distance(const vg_correspondence *c)
{
    double *d = room(c->target_nf, sizeof *d);
    memcpy(d, c->distance, c->target_nf * sizeof *d);
    qsort(d, c->target_nf, sizeof *d, compare_doubles);
    double median = d[c->target_nf / 2];
    free(d);
    return median;
}

static double mean_edge(const vg_head *h)
{
    double sum = 0;
    for (size_t f = 0; f < h->body.mesh.nf; f++)
        for (uint32_t c = h->body.mesh.start[f]; c < h->body.mesh.start[f + 1]; c++) {
            uint32_t next = c + 1 < h->body.mesh.start[f + 1] ? c + 1 : h->body.mesh.start[f];
            sum += farthest(h->body.reference + 3 * (size_t)h->body.mesh.vert[c],
                            h->body.reference + 3 * (size_t)h->body.mesh.vert[next], 1);
        }
    return sum / (double)vg_mesh_corners(&h->body.mesh);
}

static void disguised_copies(void)
{
    static const char *const names[] = {"trex.rest.obj", "horse.rest.obj", "woman-tanktop.rest.obj",
                                        "walk-man.rest.obj.xz"};
    for (size_t i = 0; i < 2 * sizeof names / sizeof *names; i++) {
        vg_head h = load(names[i / 2]);
        uint32_t *to = room(h.body.mesh.nv, sizeof *to);
        motion t = turn(2.2, 3.7, 10);
        vg_head x = disguise(&h, &t, to, i % 2);
        vg_markers m = spread_markers(&h.body.mesh, 6, to);
        vg_register_input in = between(&h, &x, &m);
        vg_register_result r = registered(&in);
        check_whole(&r.pairs, &h, &x);
        CHECK(r.flipped == (i % 2 == 1));
        CHECK_NEAR(r.scale, 3.7, 1e-9);
        double worst = 0;
        for (int k = 0; k < 9; k++) worst = fmax(worst, fabs(3.7 * r.rotation[k] - t.m[k]));
        for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(r.shift[k] - t.shift[k]));
        CHECK_NEAR(worst, 0, 1e-7);
        CHECK(median_distance(&r.pairs) < 0.5 * mean_edge(&x));
        CHECK((double)count_matched(&r.pairs) > 0.99 * (double)x.body.mesh.nf);
        vg_register_result_clear(&r);
        vg_markers_clear(&m);
        vg_head_clear(&x);
        vg_head_clear(&h);
        free(to);
    }
}

static void another_body(void)
{
    vg_head man = load("walk-man.rest.obj.xz"), woman = load("walk-woman.rest.obj.xz");
    vg_markers m = load_markers("male1591-female1605.markers.txt");
    vg_register_input in = between(&man, &woman, &m);
    vg_register_result r = registered(&in);
    check_whole(&r.pairs, &man, &woman);
    CHECK(count_matched(&r.pairs) == woman.body.mesh.nf);
    double D = vg_diagonal(woman.body.reference, woman.body.mesh.nv), worst = 0;
    for (size_t i = 0; i < m.n; i++) {
        CHECK(!r.left_out[i]);
        worst = fmax(worst, farthest(r.fitted + 3 * (size_t)m.at[i].source,
                                     woman.body.reference + 3 * (size_t)m.at[i].target, 1));
    }
    CHECK(worst < 0.01 * D);
    CHECK(median_distance(&r.pairs) < 0.25 * mean_edge(&woman));
    vg_register_result again;
    in.threads = 3;
    again = registered(&in);
    CHECK(!memcmp(r.fitted, again.fitted, 3 * man.body.mesh.nv * sizeof *r.fitted));
    CHECK(r.pairs.first[woman.body.mesh.nf] == again.pairs.first[woman.body.mesh.nf]);
    CHECK(!memcmp(r.pairs.source, again.pairs.source, r.pairs.first[woman.body.mesh.nf] * sizeof *r.pairs.source));
    CHECK(!memcmp(r.pairs.weight, again.pairs.weight, r.pairs.first[woman.body.mesh.nf] * sizeof *r.pairs.weight));
    vg_register_result_clear(&again);
    vg_register_result_clear(&r);
    vg_markers_clear(&m);
    vg_head_clear(&man);
    vg_head_clear(&woman);
}

/* ---- what goes wrong ---- */

static void wrong_markers(void)
{
    vg_head man = load("walk-man.rest.obj.xz"), woman = load("walk-woman.rest.obj.xz");
    vg_markers m = load_markers("male1591-female1605.markers.txt");
    vg_register_input in = between(&man, &woman, &m);
    uint32_t swap = m.at[7].target;
    m.at[7].target = m.at[30].target, m.at[30].target = swap;
    vg_register_result r = registered(&in);
    for (size_t i = 0; i < m.n; i++) CHECK(r.left_out[i] == (i == 7 || i == 30));
    CHECK(r.residual[7] > 5 * r.typical_residual);
    double D = vg_diagonal(woman.body.reference, woman.body.mesh.nv);
    CHECK(farthest(r.fitted + 3 * (size_t)m.at[7].source, woman.body.reference + 3 * (size_t)swap, 1) < 0.03 * D);
    vg_register_result_clear(&r);
    in.keep_all = true;
    r = registered(&in);
    CHECK(r.left_out[7]); /* said all the same */
    CHECK(farthest(r.fitted + 3 * (size_t)m.at[7].source, woman.body.reference + 3 * (size_t)m.at[7].target, 1) <
          0.1 * D);
    vg_register_result_clear(&r);
    vg_markers_clear(&m);
    vg_head_clear(&man);
    vg_head_clear(&woman);
}

static int refused(const vg_register_input *in, const char *message)
{
    vg_register_result r;
    vg_err e = {0, ""};
    int code = vg_register(&r, in, NULL, NULL, &e);
    CHECK_TEXT(e.message, message);
    CHECK(!r.fitted && !r.pairs.first);
    return code;
}

static void refusals(void)
{
    vg_head h = make_torus(9, 7), none = new_shape(), point = make_torus(9, 7);
    vg_markers two = read_markers("0 0\n1 1\n", 0), line = read_markers("0 0\n1 1\n0 0\n1 1\n", 0),
               far = read_markers("a 0 63", 0);
    vg_register_input in = between(&h, &h, &two);
    CHECK(refused(&in, "2 pairs do not determine the alignment: give at least three that are not collinear") ==
          VG_EINPUT);
    in.markers = &line;
    CHECK(refused(&in, "4 pairs do not determine the alignment: give at least three that are not collinear") ==
          VG_EINPUT);
    in.markers = &far;
    CHECK(refused(&in, "marker 'a' names vertex 63, but the target has 63 vertices") == VG_EINPUT);
    in = between(&h, &none, &two);
    in.markers = NULL, in.aligned = true;
    CHECK(refused(&in, "a mesh without faces cannot be registered") == VG_EINPUT);
    memset(point.body.reference, 0, 3 * point.body.mesh.nv * sizeof(double));
    in.target = &point.body.mesh, in.target_points = point.body.reference;
    CHECK(refused(&in, "a mesh without extent cannot be registered") == VG_EINPUT);
    vg_seed seed = {0, {1, 2, 63}, {1, 0, 0}};
    in = between(&h, &h, NULL);
    in.seeds = &seed, in.nseeds = 1;
    CHECK(refused(&in, "the dense correspondence of vertex 0 does not fit the meshes: are the two interchanged?") ==
          VG_EINPUT);
    vg_head away = make_torus(9, 7);
    for (size_t i = 0; i < away.body.mesh.nv; i++) away.body.reference[3 * i] += 100;
    in = between(&h, &away, NULL);
    in.aligned = true;
    CHECK(refused(&in, "no face of the target is near a source face with a similar normal") == VG_EINPUT);
    vg_markers_clear(&two);
    vg_markers_clear(&line);
    vg_markers_clear(&far);
    vg_head_clear(&h);
    vg_head_clear(&none);
    vg_head_clear(&point);
    vg_head_clear(&away);
}

static void degenerate_faces(void)
{
    vg_head h = make_degenerate();
    vg_markers m = read_markers("0 0\n2 2\n5 5\n12 12\n6 6\n", 0);
    vg_register_input in = between(&h, &h, &m);
    vg_register_result r = registered(&in);
    check_whole(&r.pairs, &h, &h);
    CHECK(farthest(r.fitted, h.body.reference, h.body.mesh.nv) < 1e-6);
    vg_register_result_clear(&r);
    vg_markers_clear(&m);
    vg_head_clear(&h);
}

/* A target with a part that the source does not have: all of that part rides with the same faces. */
static void parts_without_counterpart(void)
{
    vg_head source = make_torus(24, 16), target = make_torus(24, 16);
    size_t shared = target.body.mesh.nf;
    add_torus(&target, 8, 6, (double[3]){6, 0, 0});
    vg_markers m = spread_markers(&source.body.mesh, 6, NULL);
    vg_register_input in = between(&source, &target, &m);
    vg_register_result r = registered(&in);
    const vg_correspondence *c = &r.pairs;
    check_whole(c, &source, &target);
    for (size_t f = 0; f < target.body.mesh.nf; f++) CHECK(c->matched[f] == (f < shared));
    for (size_t f = shared; f < target.body.mesh.nf; f++) {
        uint32_t n = c->first[f + 1] - c->first[f];
        CHECK(n == c->first[shared + 1] - c->first[shared]);
        CHECK(!memcmp(c->source + c->first[f], c->source + c->first[shared], n * sizeof *c->source));
    }
    vg_register_result_clear(&r);
    vg_markers_clear(&m);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

/* Half of a sheet is missing in the source: the other half of the target rides with the faces along the cut. */
static void holes(void)
{
    vg_head source = new_shape(), target = new_shape();
    enum { N = 12 };
    for (uint32_t i = 0; i <= N; i++)
        for (uint32_t k = 0; k <= N; k++) {
            add_vertex(&source, i, k, 0.2 * sin(i) * cos(k));
            add_vertex(&target, i, k, 0.2 * sin(i) * cos(k));
        }
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t k = 0; k < N; k++) {
            uint32_t a = i * (N + 1) + k;
            if (i < N / 2) FACE(&source, a, a + N + 1, a + N + 2, a + 1);
            FACE(&target, a, a + N + 1, a + N + 2, a + 1);
        }
    vg_markers m = spread_markers(&source.body.mesh, 8, NULL);
    vg_register_input in = between(&source, &target, &m);
    vg_register_result r = registered(&in);
    check_whole(&r.pairs, &source, &target);
    size_t matched = count_matched(&r.pairs);
    CHECK(matched >= N * N / 2 && matched <= N * (N / 2 + 1));
    for (size_t f = 0; f < source.body.mesh.nf; f++) CHECK(r.pairs.source[r.pairs.first[f]] == f);
    CHECK(r.pairs.source[r.pairs.first[N * N - 1]] >= N * (N / 2 - 1)); /* the far corner rides with the last row */
    vg_register_result_clear(&r);
    vg_markers_clear(&m);
    vg_head_clear(&source);
    vg_head_clear(&target);
}

static void bones(void)
{
    vg_head a = make_tree(40), b = new_shape();
    motion t = turn(1, 2, 3);
    double *moved = move_points(&t, a.body.reference, a.body.mesh.nv);
    for (size_t v = 0; v < a.body.mesh.nv; v++) add_vertex(&b, moved[3 * v], moved[3 * v + 1], moved[3 * v + 2]);
    for (size_t f = a.body.mesh.nf; f-- > 0;) FACE(&b, a.body.mesh.vert[2 * f], a.body.mesh.vert[2 * f + 1]);
    vg_markers m = spread_markers(&a.body.mesh, 8, NULL);
    vg_register_input in = between(&a, &b, &m);
    vg_register_result r = registered(&in);
    check_whole(&r.pairs, &a, &b);
    for (size_t f = 0; f < b.body.mesh.nf; f++)
        CHECK(r.pairs.first[f + 1] - r.pairs.first[f] == 1 &&
              r.pairs.source[r.pairs.first[f]] == b.body.mesh.nf - 1 - f);
    vg_register_result_clear(&r);
    vg_markers_clear(&m);
    vg_head_clear(&a);
    vg_head_clear(&b);
    free(moved);
}

/* Tori of different resolution with the two angles as texture coordinates: no marker is needed, and angles agree. */
static vg_attributes torus_texture(const vg_head *h, uint32_t u, uint32_t v)
{
    size_t corners = vg_mesh_corners(&h->body.mesh);
    vg_attributes a = {.ntex = corners, .tex_dim = 2, .tex = room(2 * corners, sizeof(double)),
                       .corner_tex = room(corners, sizeof(uint32_t))};
    for (uint32_t i = 0, c = 0; i < u; i++)
        for (uint32_t k = 0; k < v; k++)
            for (int j = 0; j < 4; j++, c++) {
                a.corner_tex[c] = c;
                a.tex[2 * c] = (i + (j == 1 || j == 2)) / (double)u;
                a.tex[2 * c + 1] = (k + (j >= 2)) / (double)v;
            }
    return a;
}

static void texture_coordinates(void)
{
    enum { U = 36, V = 24, U2 = 30, V2 = 20 };
    vg_head a = make_torus(U, V), b = make_torus(U2, V2);
    vg_attributes ta = torus_texture(&a, U, V), tb = torus_texture(&b, U2, V2);
    motion t = turn(2, 5, -1);
    double *moved = move_points(&t, b.body.reference, b.body.mesh.nv);
    vg_register_input in = {.source = &a.body.mesh,
                            .target = &b.body.mesh,
                            .source_points = a.body.reference,
                            .target_points = moved,
                            .source_uv = &ta,
                            .target_uv = &tb,
                            .threads = 2};
    vg_register_result r = registered(&in);
    check_whole(&r.pairs, &a, &b);
    CHECK(r.uv_pairs == U * V);
    for (uint32_t f = 0; f < b.body.mesh.nf; f++) {
        uint32_t s = r.pairs.source[r.pairs.first[f]];
        double du = (s / V + 0.5) / U - (f / V2 + 0.5) / U2, dv = (s % V + 0.5) / V - (f % V2 + 0.5) / V2;
        CHECK(fabs(du) < 1.0 / U2 && fabs(dv) < 1.0 / V2);
    }
    vg_register_result_clear(&r);
    vg_attributes_clear(&ta);
    vg_attributes_clear(&tb);
    vg_head_clear(&a);
    vg_head_clear(&b);
    free(moved);
}

/* The same torus, each vertex of the target known as the middle of a face of the source, or the other way round. */
static void dense_seeds(void)
{
    vg_head a = make_torus(20, 12), b = make_torus(20, 12);
    vg_seed *seed = room(b.body.mesh.nv, sizeof *seed);
    motion t = turn(1.3, 0.5, 2);
    for (uint32_t i = 0; i < b.body.mesh.nv; i++) {
        const uint32_t *v =
            a.body.mesh.vert + 4 * i; /* target vertex i: half way along the diagonal of source face i */
        seed[i] = (vg_seed){i, {v[0], v[2], v[0]}, {0.5, 0.5, 0}};
        for (size_t k = 0; k < 3; k++)
            b.body.reference[3 * i + k] =
                0.5 * (a.body.reference[3 * (size_t)v[0] + k] + a.body.reference[3 * (size_t)v[2] + k]);
    }
    double *moved = move_points(&t, b.body.reference, b.body.mesh.nv);
    for (int reverse = 0; reverse < 2; reverse++) {
        vg_register_input in = between(&a, &b, NULL);
        in.target_points = moved, in.seeds = seed, in.nseeds = b.body.mesh.nv;
        if (reverse) {
            in = between(&b, &a, NULL);
            in.source_points = moved, in.seeds = seed, in.nseeds = b.body.mesh.nv, in.seeds_of_source = true;
        }
        vg_register_result r = registered(&in);
        CHECK(r.pairs.target_nf == a.body.mesh.nf && count_matched(&r.pairs) == a.body.mesh.nf);
        CHECK_NEAR(r.scale, reverse ? 2 : 0.5, 1e-6);
        double D = reverse ? vg_diagonal(a.body.reference, a.body.mesh.nv) : vg_diagonal(moved, b.body.mesh.nv);
        CHECK(median_distance(&r.pairs) < 0.06 * D); /* half a cell is 0.046 D */
        vg_register_result_clear(&r);
    }
    vg_head_clear(&a);
    vg_head_clear(&b);
    free(seed);
    free(moved);
}

TESTS({"nearest points", nearest_points}, {"nearest points by normal", nearest_points_by_normal}, {"points alike", points_alike}, {"ridges", ridges},
      {"boxes of other normals are left out", boxes_of_other_normals_are_left_out},
      {"sparse systems", sparse_systems}, {"markers as text", markers_as_text}, {"seeds as text", seeds_as_text},
      {"identity on real meshes", identity_on_real_meshes},
      {"identity on generated meshes", identity_on_generated_meshes}, {"fans", fans},
      {"disguised copies", disguised_copies},
      {"another body", another_body}, {"wrong markers", wrong_markers}, {"refusals", refusals},
      {"degenerate faces", degenerate_faces}, {"parts without counterpart", parts_without_counterpart},
      {"holes", holes}, {"bones", bones}, {"texture coordinates", texture_coordinates}, {"dense seeds", dense_seeds})
