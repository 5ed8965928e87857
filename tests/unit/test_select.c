/* test_select.c: selected faces cover what all faces cover and hold together what all faces hold together.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "test.h"

static uint64_t state = 1;

static size_t below(size_t n)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (size_t)((state >> 32) * n >> 32);
}

static void shuffle(uint32_t *x, size_t n)
{
    for (size_t i = n; i > 1; i--) {
        size_t k = below(i);
        uint32_t t = x[i - 1];
        x[i - 1] = x[k], x[k] = t;
    }
}

static vg_mesh new_mesh(size_t nv, size_t faces, size_t corners)
{
    return (vg_mesh){nv, 0, calloc(faces + 1, sizeof(uint32_t)), calloc(corners + 1, sizeof(uint32_t))};
}

static void add_face(vg_mesh *m, size_t size, const uint32_t *vert)
{
    uint32_t at = m->start[m->nf];
    memcpy(m->vert + at, vert, size * sizeof *vert);
    m->start[++m->nf] = at + (uint32_t)size;
}

/* A torus of a x b quads (size 4) or twice as many triangles (size 3); faces and vertices in random order. */
static vg_mesh torus(size_t a, size_t b, size_t size, bool shuffled)
{
    vg_mesh m = new_mesh(a * b, 2 * a * b, 6 * a * b);
    uint32_t *name = calloc(a * b, sizeof *name), *order = calloc(a * b, sizeof *order);
    for (size_t i = 0; i < a * b; i++) name[i] = order[i] = (uint32_t)i;
    if (shuffled) shuffle(name, a * b), shuffle(order, a * b);
    for (size_t i = 0; i < a * b; i++) {
        size_t x = order[i] % a, y = order[i] / a, x1 = (x + 1) % a, y1 = (y + 1) % b;
        uint32_t q[4] = {name[y * a + x], name[y * a + x1], name[y1 * a + x1], name[y1 * a + x]};
        add_face(&m, size, q);
        if (size == 3) add_face(&m, 3, (uint32_t[]){q[0], q[2], q[3]});
    }
    free(name), free(order);
    return m;
}

/* For every vertex the lowest vertex it is joined with through the given faces (NULL: all), itself if in none: spread
 * along faces until nothing changes. */
static uint32_t *pieces(const vg_mesh *m, const uint32_t *faces, size_t n, bool *covered)
{
    uint32_t *piece = calloc(m->nv + 1, sizeof *piece);
    for (size_t v = 0; v < m->nv; v++) piece[v] = (uint32_t)v;
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t i = 0; i < 2 * n; i++) { /* there and back, so that few rounds do */
            size_t k = i < n ? i : 2 * n - 1 - i, f = faces ? faces[k] : k;
            uint32_t least = UINT32_MAX;
            for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
                if (piece[m->vert[c]] < least) least = piece[m->vert[c]];
                covered[m->vert[c]] = true;
            }
            for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
                changed |= piece[m->vert[c]] != least;
                piece[m->vert[c]] = least;
            }
        }
    }
    return piece;
}

/* Select, check all that must hold of any selection, and return how many faces stay. */
static size_t check_selection(const vg_mesh *m)
{
    uint32_t *faces;
    size_t n;
    CHECK(vg_select_faces(m, &faces, &n, NULL) == VG_OK);
    for (size_t i = 0; i < n; i++) CHECK(faces[i] < m->nf && (i == 0 || faces[i - 1] < faces[i]));
    bool *covered = calloc(m->nv + 1, 1), *covered_by_all = calloc(m->nv + 1, 1);
    uint32_t *some = pieces(m, faces, n, covered), *all = pieces(m, NULL, m->nf, covered_by_all);
    CHECK(!memcmp(covered, covered_by_all, m->nv));
    CHECK(!memcmp(some, all, m->nv * sizeof *all));
    free(covered), free(covered_by_all), free(some), free(all), free(faces);
    return n;
}

static size_t select_and_clear(vg_mesh m)
{
    size_t n = check_selection(&m);
    vg_mesh_clear(&m);
    return n;
}

static void closed_triangle_meshes_lose_nearly_half(void)
{
    size_t n = select_and_clear(torus(60, 40, 3, false));
    CHECK(n >= 2400 && n <= 2640);
    n = select_and_clear(torus(31, 57, 3, false));
    CHECK(n >= 0.50 * 2 * 31 * 57 && n <= 0.55 * 2 * 31 * 57);
}

static void quads_lose_less_than_half_in_any_order(void)
{
    size_t n = select_and_clear(torus(50, 40, 4, false));
    CHECK(n >= 1000 && n <= 1200);
    for (int i = 0; i < 5; i++) {
        n = select_and_clear(torus(50, 40, 4, true));
        CHECK(n >= 1000 && n < 1500);
        n = select_and_clear(torus(50, 40, 3, true));
        CHECK(n >= 2000 && n < 2800);
    }
}

/* Around a vertex of 100,000 faces every second one stays: with quadratic work this test would take minutes. */
static void a_fan_keeps_every_second_face(void)
{
    uint32_t n = 100000;
    vg_mesh m = new_mesh(n + 1, n, 3 * (size_t)n);
    for (uint32_t i = 0; i < n; i++) add_face(&m, 3, (uint32_t[]){0, 1 + i, 1 + (i + 1) % n});
    CHECK(select_and_clear(m) == n / 2);
}

/* A cylinder of 100,000 sides between two polygons: both caps stay, the sides share an edge with them and all go. The
 * caps alone are two pieces, so one side comes back. */
static void large_polygons_are_not_slow(void)
{
    uint32_t n = 100000;
    vg_mesh m = new_mesh(2 * (size_t)n, n + 2, 6 * (size_t)n);
    uint32_t *cap = calloc(n, sizeof *cap);
    for (uint32_t i = 0; i < n; i++) cap[i] = i;
    add_face(&m, n, cap);
    for (uint32_t i = 0; i < n; i++) cap[i] = 2 * n - 1 - i;
    add_face(&m, n, cap);
    for (uint32_t i = 0; i < n; i++) add_face(&m, 4, (uint32_t[]){i, (i + 1) % n, n + (i + 1) % n, n + i});
    uint32_t *faces;
    size_t k;
    CHECK(vg_select_faces(&m, &faces, &k, NULL) == VG_OK);
    CHECK(k == 3 && faces[0] == 0 && faces[1] == 1 && faces[2] == 2);
    free(faces), free(cap);
    vg_mesh_clear(&m);
}

static void line_segments_stay_unless_they_lie_on_an_edge(void)
{
    vg_mesh m = new_mesh(6, 5, 12);
    for (uint32_t i = 0; i < 5; i++) add_face(&m, 2, (uint32_t[]){i, i + 1});
    CHECK(check_selection(&m) == 5);
    m.nf = 1; /* 0-1, then a triangle beside it, then the segment once more */
    add_face(&m, 3, (uint32_t[]){0, 1, 2});
    add_face(&m, 2, (uint32_t[]){1, 0});
    uint32_t *faces;
    size_t n;
    CHECK(vg_select_faces(&m, &faces, &n, NULL) == VG_OK);
    CHECK(n == 2 && faces[0] == 0 && faces[1] == 1); /* the triangle reaches vertex 2, the copy adds nothing */
    free(faces);
    vg_mesh_clear(&m);
}

static void small_and_odd_meshes(void)
{
    vg_mesh m = {0};
    CHECK(check_selection(&m) == 0);
    m = new_mesh(7, 0, 0); /* vertices without faces */
    CHECK(select_and_clear(m) == 0);
    m = new_mesh(9, 1, 4);
    add_face(&m, 4, (uint32_t[]){8, 1, 5, 2});
    CHECK(select_and_clear(m) == 1);
    m = new_mesh(3, 3, 9); /* one triangle three times, turned both ways */
    add_face(&m, 3, (uint32_t[]){0, 1, 2});
    add_face(&m, 3, (uint32_t[]){2, 1, 0});
    add_face(&m, 3, (uint32_t[]){1, 2, 0});
    CHECK(select_and_clear(m) == 1);
    m = new_mesh(6, 4, 12); /* three triangles on one edge, none of which can go: each alone holds a vertex */
    add_face(&m, 3, (uint32_t[]){0, 1, 2});
    add_face(&m, 3, (uint32_t[]){0, 1, 3});
    add_face(&m, 3, (uint32_t[]){1, 0, 4});
    CHECK(select_and_clear(m) == 3);
}

/* Faces of 2 to 7 random vertices: non-manifold, folded, doubled, scattered, in one piece or in many. */
static void any_faces_at_all(void)
{
    for (int round = 0; round < 2000; round++) {
        size_t nv = 2 + below(40), nf = below(2 + (round % 3) * 20);
        vg_mesh m = new_mesh(nv, nf, 7 * nf);
        uint32_t *order = calloc(nv, sizeof *order);
        for (size_t v = 0; v < nv; v++) order[v] = (uint32_t)v;
        for (size_t f = 0; f < nf; f++) {
            size_t size = 2 + below(nv < 7 ? nv - 1 : 6);
            shuffle(order, nv);
            add_face(&m, size, order);
        }
        check_selection(&m);
        free(order);
        vg_mesh_clear(&m);
    }
}

TESTS({"a closed triangle mesh keeps 50 to 55 % of its faces", closed_triangle_meshes_lose_nearly_half},
      {"quads and shuffled meshes lose many faces, too", quads_lose_less_than_half_in_any_order},
      {"a fan of 100,000 triangles keeps every second one", a_fan_keeps_every_second_face},
      {"polygons of 100,000 corners are not slow", large_polygons_are_not_slow},
      {"line segments stay unless they lie on an edge", line_segments_stay_unless_they_lie_on_an_edge},
      {"small and odd meshes", small_and_odd_meshes},
      {"cover and pieces are kept on any faces at all", any_faces_at_all})
