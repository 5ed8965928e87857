/* test_link.c: links join all components by the shortest ways, are not shorter than the edges beside them, and do not
 * depend on unit or run.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "test.h"

static uint64_t state = 1;

static double uniform(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

/* A mesh under construction, with room for what the tests put in. */
struct built {
    vg_mesh m;
    double *v;
};

static struct built new_built(size_t nv, size_t nf)
{
    return (struct built){{0, 0, calloc(nf + 1, 4), calloc(4 * nf + 1, 4)}, calloc(3 * nv + 1, sizeof(double))};
}

static void clear(struct built *b)
{
    vg_mesh_clear(&b->m);
    free(b->v);
}

static uint32_t add_vertex(struct built *b, double x, double y, double z)
{
    memcpy(b->v + 3 * b->m.nv, (double[]){x, y, z}, 3 * sizeof(double));
    return (uint32_t)b->m.nv++;
}

static void add_face(struct built *b, size_t size, const uint32_t *vert)
{
    uint32_t at = b->m.start[b->m.nf];
    memcpy(b->m.vert + at, vert, size * sizeof *vert);
    b->m.start[++b->m.nf] = at + (uint32_t)size;
}

/* Six quads; corner k stands at low + side * (bits of k). Returns its first vertex. */
static uint32_t add_box(struct built *b, double x, double y, double z, double side)
{
    static const uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    uint32_t first = (uint32_t)b->m.nv;
    for (int k = 0; k < 8; k++) add_vertex(b, x + side * (k & 1), y + side * (k >> 1 & 1), z + side * (k >> 2 & 1));
    for (int f = 0; f < 6; f++) {
        uint32_t q[4];
        for (int k = 0; k < 4; k++) q[k] = first + quads[f][k];
        add_face(b, 4, q);
    }
    return first;
}

static double length(const struct built *b, uint32_t u, uint32_t v)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += pow(b->v[3 * u + k] - b->v[3 * v + k], 2);
    return sqrt(sum);
}

/* For every vertex the lowest vertex that faces and links join it with: spread until nothing changes. */
static uint32_t *pieces(const vg_mesh *m, const uint32_t *links, size_t nlinks)
{
    uint32_t *piece = calloc(m->nv + 1, sizeof *piece);
    for (size_t v = 0; v < m->nv; v++) piece[v] = (uint32_t)v;
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t i = 0; i < 2 * (m->nf + nlinks); i++) {
            size_t n = m->nf + nlinks, f = i < n ? i : 2 * n - 1 - i;
            const uint32_t *vert = f < m->nf ? m->vert + m->start[f] : links + 2 * (f - m->nf);
            size_t size = f < m->nf ? m->start[f + 1] - m->start[f] : 2;
            uint32_t least = UINT32_MAX;
            for (size_t k = 0; k < size; k++)
                if (piece[vert[k]] < least) least = piece[vert[k]];
            for (size_t k = 0; k < size; k++) changed |= piece[vert[k]] != least, piece[vert[k]] = least;
        }
    }
    return piece;
}

/* Link, and check what must hold always: one link fewer than components, all joined, isolated vertices left alone. */
static size_t link_and_check(const struct built *b, uint32_t **links)
{
    size_t n = 0, components = 0, joined = 0;
    CHECK(vg_link_components(&b->m, b->v, links, &n, NULL) == VG_OK);
    bool *in_face = calloc(b->m.nv + 1, 1);
    for (size_t c = 0; c < vg_mesh_corners(&b->m); c++) in_face[b->m.vert[c]] = true;
    uint32_t *apart = pieces(&b->m, NULL, 0), *together = pieces(&b->m, *links, n);
    for (uint32_t v = 0; v < b->m.nv; v++) {
        components += in_face[v] && apart[v] == v;
        joined += in_face[v] && together[v] == v;
        CHECK(in_face[v] || together[v] == v);
    }
    CHECK(n == (components ? components - 1 : 0) && joined == (components > 0));
    for (size_t i = 0; i < n; i++) CHECK(apart[(*links)[2 * i]] != apart[(*links)[2 * i + 1]]);
    uint32_t *again;
    size_t n_again;
    CHECK(vg_link_components(&b->m, b->v, &again, &n_again, NULL) == VG_OK);
    CHECK(n_again == n && (n == 0 || !memcmp(again, *links, n * 2 * sizeof *again)));
    free(again), free(in_face), free(apart), free(together);
    return n;
}

static void distant_boxes_are_joined_at_their_nearest_corners(void)
{
    struct built b = new_built(16, 12);
    add_box(&b, 0, 0, 0, 1);
    add_box(&b, 3, 4, 5, 1);
    uint32_t *link;
    CHECK(link_and_check(&b, &link) == 1);
    CHECK(link[0] == 7 && link[1] == 8); /* (1, 1, 1) and (3, 4, 5) */
    free(link);
    clear(&b);
}

/* Boxes that nearly touch: the shortest way is 0.01 long, a link is about an edge long. */
static void close_boxes_are_joined_one_edge_further_on(void)
{
    struct built b = new_built(16, 12);
    add_box(&b, 0, 0, 0, 1);
    add_box(&b, 1.01, 0.1, 0.1, 0.5);
    uint32_t *link;
    CHECK(link_and_check(&b, &link) == 1);
    CHECK(link[0] < 8 && link[1] == 8); /* moved at the larger box, still at the smaller one's nearest corner */
    CHECK(link[0] == 0 || link[0] == 3 || link[0] == 5); /* neighbours of (1, 0, 0) */
    CHECK(length(&b, link[0], link[1]) > 0.9 && length(&b, link[0], link[1]) < 1.5);
    free(link);
    clear(&b);
}

static void nested_boxes_join_to_the_one_around(void)
{
    struct built b = new_built(24, 18);
    add_box(&b, -10, -10, -10, 20);
    add_box(&b, -1, -1, -1, 2);
    add_box(&b, -4, -4, -4, 8);
    uint32_t *link;
    CHECK(link_and_check(&b, &link) == 2);
    for (int i = 0; i < 2; i++) CHECK(link[2 * i + 1] >= 16 || link[2 * i] >= 16); /* both end on the middle box */
    free(link);
    clear(&b);
}

/* Every triangle of a grid has vertices of its own: each link goes from a seam to the next vertex, so that it has a
 * direction and the seam can open. */
static void unwelded_triangles_are_joined_in_their_seams(void)
{
    size_t side = 12;
    struct built b = new_built(6 * side * side, 2 * side * side);
    for (size_t i = 0; i < 2 * side * side; i++) {
        double x = (double)(i / 2 % side), y = (double)(i / 2 / side);
        uint32_t t[3];
        t[0] = add_vertex(&b, x, y, sin(x));
        t[1] = i % 2 ? add_vertex(&b, x, y + 1, sin(x)) : add_vertex(&b, x + 1, y, sin(x + 1));
        t[2] = add_vertex(&b, x + 1, y + 1, sin(x + 1));
        add_face(&b, 3, t);
    }
    uint32_t *links;
    size_t n = link_and_check(&b, &links);
    CHECK(n == 2 * side * side - 1);
    for (size_t i = 0; i < n; i++)
        CHECK(length(&b, links[2 * i], links[2 * i + 1]) > 0.5 && length(&b, links[2 * i], links[2 * i + 1]) < 2);
    free(links);
    clear(&b);
}

static void vertices_in_no_face_get_no_link(void)
{
    struct built b = new_built(20, 12);
    add_vertex(&b, 1.5, 0.5, 0.5); /* between the boxes, nearer to both than they are to each other */
    add_box(&b, 0, 0, 0, 1);
    add_vertex(&b, 1.4, 0.5, 0.5);
    add_box(&b, 2.5, 0, 0, 1);
    add_vertex(&b, 1.6, 0.5, 0.5);
    uint32_t *link;
    CHECK(link_and_check(&b, &link) == 1);
    free(link);
    clear(&b);
    b = new_built(3, 0); /* no face at all */
    for (int i = 0; i < 3; i++) add_vertex(&b, i, 0, 0);
    CHECK(link_and_check(&b, &link) == 0);
    free(link);
    clear(&b);
    b = new_built(0, 0);
    CHECK(link_and_check(&b, &link) == 0);
    free(link);
    clear(&b);
}

/* Total length of a minimum spanning tree of the components, by Prim's method and distances of all pairs. Component c
 * has the vertices 3c, 3c + 1, 3c + 2. */
static double shortest_total(const struct built *b)
{
    size_t n = b->m.nv / 3;
    double *near = calloc(n, sizeof *near), total = 0;
    bool *in = calloc(n, 1);
    for (size_t c = 0; c < n; c++) near[c] = INFINITY;
    for (size_t newest = 0, count = 1; count < n; count++) {
        in[newest] = true;
        size_t next = n;
        for (size_t c = 0; c < n; c++) {
            if (in[c]) continue;
            for (uint32_t k = 0; k < 9; k++)
                near[c] = fmin(near[c], length(b, (uint32_t)(3 * newest) + k / 3, (uint32_t)(3 * c) + k % 3));
            if (next == n || near[c] < near[next]) next = c;
        }
        total += near[next];
        newest = next;
    }
    free(near), free(in);
    return total;
}

/* Triangles so small that no link is shorter than their edges; at random places, or on a grid where most distances
 * between neighbours are equal. */
static void links_are_a_minimum_spanning_tree(void)
{
    for (int round = 0; round < 40; round++) {
        size_t n = 2 + (size_t)(200 * uniform());
        struct built b = new_built(3 * n, n);
        for (size_t i = 0; i < n; i++) {
            double p[3] = {(double)(i % 6), (double)(i / 6 % 6), (double)(i / 36)};
            for (int k = 0; k < 3 && round % 2; k++) p[k] = uniform();
            double s = round % 2 ? 1e-7 : 0x1p-20;
            uint32_t t[3] = {add_vertex(&b, p[0], p[1], p[2]), add_vertex(&b, p[0] + s, p[1], p[2]),
                             add_vertex(&b, p[0], p[1] + s, p[2])};
            add_face(&b, 3, t);
        }
        uint32_t *links;
        size_t count = link_and_check(&b, &links);
        double total = 0, truth = shortest_total(&b);
        for (size_t i = 0; i < count; i++) total += length(&b, links[2 * i], links[2 * i + 1]);
        CHECK_NEAR(total, truth, 1e-12 * truth);
        free(links);
        clear(&b);
    }
}

/* Triangles and segments thrown on few places: coincident vertices and equal distances everywhere. */
static void any_components_at_all(void)
{
    for (int round = 0; round < 300; round++) {
        size_t nf = (size_t)(60 * uniform()), places = 1 + (size_t)(5 * uniform());
        struct built b = new_built(4 * nf, nf);
        for (size_t f = 0; f < nf; f++) {
            size_t size = 2 + (size_t)(2 * uniform());
            uint32_t t[3];
            for (size_t k = 0; k < size; k++) {
                bool old = b.m.nv > 8 && uniform() < 0.3;
                t[k] = old ? (uint32_t)((double)b.m.nv * uniform())
                           : add_vertex(&b, floor((double)places * uniform()), floor(2 * uniform()), 0);
                while ((k > 0 && t[k] == t[0]) || (k > 1 && t[k] == t[1]))
                    t[k] = (uint32_t)((double)b.m.nv * uniform());
            }
            add_face(&b, size, t);
        }
        uint32_t *links;
        link_and_check(&b, &links);
        free(links);
        clear(&b);
    }
}

static void the_unit_does_not_matter(void)
{
    static const double units[] = {0x1p-1000, 0x1p-300, 0x1p300, 0x1p1000};
    struct built b = new_built(160, 120);
    for (int i = 0; i < 20; i++) add_box(&b, 10 * uniform(), 10 * uniform(), 10 * uniform(), uniform());
    uint32_t *links, *other;
    size_t n = link_and_check(&b, &links), n_other;
    for (int u = 0; u < 4; u++) {
        double *v = calloc(3 * b.m.nv, sizeof *v);
        for (size_t i = 0; i < 3 * b.m.nv; i++) v[i] = b.v[i] * units[u];
        CHECK(vg_link_components(&b.m, v, &other, &n_other, NULL) == VG_OK);
        CHECK(n_other == n && !memcmp(links, other, n * 2 * sizeof *links));
        free(other), free(v);
    }
    free(links);
    clear(&b);
}

static void positions_must_be_finite(void)
{
    struct built b = new_built(16, 12);
    add_box(&b, 0, 0, 0, 1);
    add_box(&b, 5, 0, 0, 1);
    b.v[20] = NAN;
    uint32_t *links;
    size_t n;
    vg_err e = {0};
    CHECK(vg_link_components(&b.m, b.v, &links, &n, &e) == VG_EARG && e.message[0]);
    CHECK(links == NULL && n == 0);
    clear(&b);
}

static void a_head_is_prepared_once(void)
{
    struct built b = new_built(16, 12);
    add_box(&b, 0, 0, 0, 1);
    vg_head h = {0};
    CHECK(vg_mesh_copy(&h.body.mesh, &b.m, NULL) == VG_OK);
    h.body.reference = calloc(3 * 16, sizeof(double));
    memcpy(h.body.reference, b.v, 3 * 8 * sizeof(double));
    CHECK(vg_head_prepare_vectors(&h, NULL) == VG_OK && h.links.chosen && h.links.n == 0);
    add_box(&b, 3, 0, 0, 1);
    vg_mesh_clear(&h.body.mesh);
    CHECK(vg_mesh_copy(&h.body.mesh, &b.m, NULL) == VG_OK);
    memcpy(h.body.reference, b.v, 3 * 16 * sizeof(double));
    CHECK(vg_head_prepare_vectors(&h, NULL) == VG_OK && h.links.n == 0); /* what was chosen stays */
    h.links.chosen = false;
    CHECK(vg_head_prepare_vectors(&h, NULL) == VG_OK && h.links.chosen && h.links.n == 1);
    CHECK(h.links.pairs[0] < 8 && h.links.pairs[1] >= 8);
    vg_head_clear(&h);
    clear(&b);
}

TESTS({"distant boxes are joined at their nearest corners", distant_boxes_are_joined_at_their_nearest_corners},
      {"close boxes are joined one edge further on", close_boxes_are_joined_one_edge_further_on},
      {"nested boxes join to the one around", nested_boxes_join_to_the_one_around},
      {"unwelded triangles are joined in their seams", unwelded_triangles_are_joined_in_their_seams},
      {"vertices in no face get no link", vertices_in_no_face_get_no_link},
      {"links are a minimum spanning tree", links_are_a_minimum_spanning_tree},
      {"any components at all are joined", any_components_at_all},
      {"the unit does not matter", the_unit_does_not_matter},
      {"positions must be finite", positions_must_be_finite},
      {"a head is prepared once", a_head_is_prepared_once})
