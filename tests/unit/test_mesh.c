/* test_mesh.c: what makes a mesh valid, equal, or fall into components; the vectors of a pose (MATH 1); heads and
 * frames as values that are copied, traced and labelled. Leaves out what is computed from vectors and how they are
 * written.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__)
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

/* ---- valid meshes ---- */

static void refused(vg_head *h, const char *what)
{
    vg_err e = {0, ""};
    CHECK(vg_mesh_check(&h->body.mesh, "file 'a.obj'", &e) == VG_EINPUT && e.code == VG_EINPUT);
    CHECK(strstr(e.message, "file 'a.obj'") == e.message);
    if (!strstr(e.message, what)) printf("\"%s\" does not say \"%s\"\n", e.message, what);
    CHECK(strstr(e.message, what) != NULL);
}

static void test_check(void)
{
    vg_err e;
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        CHECK(vg_mesh_check(&h.body.mesh, name, &e) == VG_OK);
        vg_head_clear(&h);
    }
    h = make_torus(5, 4);
    h.body.mesh.vert[4 * 7 + 2] = 20;
    refused(&h, "face 7 names vertex 20 of 20");
    h.body.mesh.vert[4 * 7 + 2] = UINT32_MAX;
    refused(&h, "face 7 names vertex 4294967295 of 20");
    h.body.mesh.vert[4 * 7 + 2] = h.body.mesh.vert[4 * 7];
    refused(&h, "face 7 names a vertex twice");
    vg_head_clear(&h);
    h = make_torus(5, 4);
    h.body.mesh.start[4] = 13; /* face 3 has 1 corner, face 4 has 7 */
    refused(&h, "face 3 has fewer than 2 vertices");
    h.body.mesh.start[4] = h.body.mesh.start[3];
    refused(&h, "face 3 has fewer than 2 vertices");
    h.body.mesh.start[4] = h.body.mesh.start[3] - 1;
    refused(&h, "has fewer than 2 vertices");
    vg_head_clear(&h);
    for (size_t r = 3; r < 70; r++) { /* small and large faces, repeats near and far */
        static const size_t far[] = {1, 2};
        for (size_t k = 0; k < 3; k++) {
            h = make_flower(r);
            size_t from = k < 2 ? far[k] : r - 1;
            CHECK(vg_mesh_check(&h.body.mesh, "m", &e) == VG_OK);
            h.body.mesh.vert[0] = h.body.mesh.vert[from];
            refused(&h, "face 0 names a vertex twice");
            vg_head_clear(&h);
        }
    }
    h = make_ngon(10000, 0, 0);
    h.body.mesh.vert[9999] = h.body.mesh.vert[1];
    refused(&h, "face 0 names a vertex twice");
    vg_head_clear(&h);
}

/* A claim of four billion vertices is no reason to ask for the memory of four billion vertices. */
static void test_check_needs_no_memory(void)
{
    if (SANITIZED) return; /* the sanitizer has reserved more than any limit */
    pid_t child = fork();
    if (child == 0) {
        vg_head h = make_ngon(40, 0, 0);
        struct rlimit limit = {1u << 30, 1u << 30};
        vg_err e = {0, ""};
        h.body.mesh.nv = UINT32_MAX - 1;
        setrlimit(RLIMIT_AS, &limit);
        _exit(vg_mesh_check(&h.body.mesh, "m", &e) == VG_OK ? 0 : 1);
    }
    int status = -1;
    CHECK(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

static void differ(const vg_head *a, const vg_head *b, const char *message)
{
    vg_err e = {0, ""};
    CHECK(vg_mesh_same(&a->body.mesh, "'a.obj'", &b->body.mesh, "'b.obj'", &e) == VG_EINPUT);
    CHECK_TEXT(e.message, message);
}

static void test_same(void)
{
    vg_err e;
    vg_head a, b;
    const char *name;
    for (size_t i = 0; make_any(i, &a, &name); i++) {
        CHECK(vg_mesh_copy(&b.body.mesh, &a.body.mesh, &e) == VG_OK);
        CHECK(vg_mesh_same(&a.body.mesh, "a", &b.body.mesh, "b", &e) == VG_OK &&
              vg_mesh_digest(&a.body.mesh) == vg_mesh_digest(&b.body.mesh));
        vg_mesh_clear(&b.body.mesh);
        vg_head_clear(&a);
    }
    a = make_torus(5, 4), b = make_torus(5, 4);
    add_isolated(&b);
    differ(&a, &b, "'b.obj' has 22 vertices where 'a.obj' has 20");
    add_isolated(&a);
    FACE(&a, 0, 2, 7);
    differ(&a, &b, "'b.obj' has 20 faces where 'a.obj' has 21");
    FACE(&b, 0, 2, 7, 8);
    differ(&a, &b, "face 20 of 'b.obj' has 4 corners where that of 'a.obj' has 3");
    vg_head_clear(&b);
    b = make_torus(5, 4);
    add_isolated(&b);
    FACE(&b, 0, 7, 2);
    differ(&a, &b, "face 20 of 'b.obj' names vertex 7 where that of 'a.obj' names 2");
    CHECK(vg_mesh_digest(&a.body.mesh) != vg_mesh_digest(&b.body.mesh));
    vg_head_clear(&a);
    vg_head_clear(&b);
}

/* A head that was never filled, one whose faces were all taken away: both are meshes without faces. */
static void test_empty(void)
{
    vg_mesh none = {0}, copy;
    vg_err e;
    uint32_t label;
    size_t count = 9;
    CHECK(vg_mesh_corners(&none) == 0 && vg_mesh_check(&none, "m", &e) == VG_OK);
    CHECK(vg_mesh_copy(&copy, &none, &e) == VG_OK && copy.start && copy.start[0] == 0);
    CHECK(vg_mesh_same(&none, "a", &copy, "b", &e) == VG_OK);
    CHECK(vg_mesh_components(&none, &label, &count, &e) == VG_OK && count == 0);
    vg_mesh_clear(&copy);
    CHECK(!copy.start && !copy.vert && copy.nv == 0);
    CHECK(vg_diagonal(NULL, 0) == 0);
    double centre[3] = {1, 1, 1};
    vg_centroid(NULL, 0, centre);
    CHECK(centre[0] == 0 && centre[1] == 0 && centre[2] == 0);
}

static void test_components(void)
{
    vg_head h = make_pieces();
    add_isolated(&h);
    uint32_t *label = room(h.body.mesh.nv, sizeof *label);
    size_t count;
    vg_err e;
    CHECK(vg_mesh_components(&h.body.mesh, label, &count, &e) == VG_OK && count == 5);
    static const size_t ends[] = {54, 89, 137, 185, 188};
    for (size_t v = 0, piece = 0; v < h.body.mesh.nv; v++) {
        while (piece < 5 && v >= ends[piece]) piece++;
        CHECK(label[v] == (piece < 5 ? (uint32_t)piece : UINT32_MAX));
    }
    free(label);
    vg_head_clear(&h);
    /* pieces that are joined late, from the end: the numbers still go by the first vertex */
    h = new_shape();
    for (int i = 0; i < 9; i++) add_vertex(&h, i, 0, 0);
    FACE(&h, 8, 7), FACE(&h, 6, 5, 4), FACE(&h, 1, 2), FACE(&h, 7, 4), FACE(&h, 2, 8);
    uint32_t few[9], want[9] = {UINT32_MAX, 0, 0, UINT32_MAX, 0, 0, 0, 0, 0};
    CHECK(vg_mesh_components(&h.body.mesh, few, &count, &e) == VG_OK && count == 1 && !memcmp(few, want, sizeof few));
    h.body.mesh.nf = 4;
    static const uint32_t two[9] = {UINT32_MAX, 0, 0, UINT32_MAX, 1, 1, 1, 1, 1};
    CHECK(vg_mesh_components(&h.body.mesh, few, &count, &e) == VG_OK && count == 2 && !memcmp(few, two, sizeof few));
    vg_head_clear(&h);
}

static void test_size_and_centre(void)
{
    static const double points[] = {1, 2, 3, 4, 2, -1, 1, 5, 3, 2, -1, 3};
    double centre[3];
    vg_centroid(points, 4, centre);
    CHECK(centre[0] == 2 && centre[1] == 2 && centre[2] == 2);
    CHECK_NEAR(vg_diagonal(points, 4), sqrt(9 + 36 + 16), 1e-15);
    CHECK(vg_diagonal(points, 1) == 0);
    CHECK_NEAR(vg_diagonal((double[]){1e-20, 0, 0, 4e-20, 4e-20, 0}, 2) / 5e-20, 1, 1e-15);
}

/* ---- vectors ---- */

static void vectors_hold(vg_head *h, const char *name)
{
    vg_graph *g = graph_of(h);
    size_t n = vg_graph_corners(g), nv = g->faces.nv;
    double D = vg_diagonal(h->body.reference, nv), *w = vectors_of(g, h->body.reference), *again, *moved, root[3],
           turned[3], most = 0;
    for (size_t f = 0; f < g->faces.nf; f++) {
        double sum[3] = {0, 0, 0};
        for (size_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
            for (size_t k = 0; k < 3; k++) sum[k] += w[3 * c + k];
        most = fmax(most, farthest(sum, (double[3]){0, 0, 0}, 1));
    }
    CHECK_NEAR(most, 0, 1e-13 * D);
    for (size_t f = 0; f < g->faces.nf; f++) /* what a vector is: differences within a face are those of its vertices */
        for (size_t c = g->faces.start[f] + 1; c < g->faces.start[f + 1]; c++)
            for (size_t k = 0; k < 3; k++) {
                double want =
                    h->body.reference[3 * (size_t)g->faces.vert[c] + k] - h->body.reference[3 * (size_t)g->faces.vert[c - 1] + k];
                CHECK_NEAR(w[3 * c + k] - w[3 * (c - 1) + k], want, 1e-14 * D);
            }
    motion by = turn(1.3, 2.5, 3 * D), shift = turn(0, 1, 3 * D);
    moved = move_points(&shift, h->body.reference, nv), again = vectors_of(g, moved);
    CHECK_NEAR(farthest(w, again, n) / D, 0, 1e-14);
    free(moved), free(again);
    moved = move_points(&by, h->body.reference, nv), again = vectors_of(g, moved);
    for (size_t c = 0; c < n; c++) move_vector(&by, w + 3 * c, w + 3 * c);
    CHECK_NEAR(farthest(w, again, n) / D, 0, 1e-13);
    vg_graph_root(g, h->body.reference, root);
    move_vector(&by, root, turned);
    for (int k = 0; k < 3; k++) turned[k] += by.shift[k];
    vg_graph_root(g, moved, root);
    CHECK_NEAR(farthest(root, turned, 1) / D, 0, 1e-13);
    if (test_bad) printf("%s\n", name);
    free(w), free(moved), free(again);
    vg_graph_free(&g);
}

static void test_vectors(void)
{
    vg_head h;
    const char *name;
    for (size_t i = 0; make_any(i, &h, &name); i++) {
        vectors_hold(&h, name);
        vg_head_clear(&h);
    }
    static const char *const rests[] = {"trex.rest.obj", "horse.rest.obj", "woman-tanktop.rest.obj"};
    for (size_t i = 0; i < 3; i++) {
        film f = load_film(rests[i], NULL, 1);
        vectors_hold(&f.h, rests[i]);
        film_clear(&f);
    }
}

static void test_graph(void)
{
    vg_head h = make_pieces();
    add_isolated(&h);
    vg_err e;
    vg_graph *g = graph_of(&h);
    CHECK(g->nlinks == 4 && g->faces.nf == h.body.mesh.nf + 4 && g->attached == h.body.mesh.nv - 2 && g->max_corners == 4);
    CHECK(vg_graph_corners(g) == vg_mesh_corners(&h.body.mesh) + 8 && !g->in_face[h.body.mesh.nv - 1] &&
          g->in_face[0]);
    CHECK(!memcmp(g->faces.vert + vg_mesh_corners(&h.body.mesh), h.links.pairs, 8 * sizeof *h.links.pairs));
    vg_graph_free(&g);
    CHECK(g == NULL);
    h.selection.chosen = true, h.selection.n = 2, h.selection.faces = room(2, sizeof *h.selection.faces);
    h.selection.faces[0] = 3, h.selection.faces[1] = (uint32_t)h.body.mesh.nf - 1;
    CHECK(vg_head_graph(&g, &h, &e) == VG_OK);
    CHECK(g->faces.nf == 6 && vg_graph_corners(g) == 4 + 3 + 8);
    CHECK(g->faces.start[1] == 4 && g->faces.start[2] == 7 && g->faces.start[3] == 9);
    CHECK(!memcmp(g->faces.vert, h.body.mesh.vert + h.body.mesh.start[3], 4 * sizeof *g->faces.vert));
    double root[3], sum[3] = {0, 0, 0};
    size_t n = 0;
    for (size_t v = 0; v < h.body.mesh.nv; v++)
        for (size_t k = 0; k < 3 && g->in_face[v]; k++) sum[k] += h.body.reference[3 * v + k], n += k == 0;
    vg_graph_root(g, h.body.reference, root);
    CHECK(n == g->attached && n < 20);
    for (int k = 0; k < 3; k++) CHECK_NEAR(root[k], sum[k] / (double)n, 1e-14);
    vg_graph_free(&g);
    vg_head_clear(&h);
}

/* ---- heads and frames ---- */

static vg_record record(const char *tag, const char *text)
{
    vg_record r = {.flags = 2};
    vg_err e;
    memcpy(r.tag, tag, 5);
    CHECK(vgi_bytes_append(&r.payload, text, strlen(text), &e) == VG_OK);
    return r;
}

static void trace(vg_head *h, const char *program, const char *a, const char *b)
{
    char *const args[] = {(char *)(uintptr_t)program, (char *)(uintptr_t)a, (char *)(uintptr_t)b};
    vg_err e;
    CHECK(vg_head_trace(h, program, a ? b ? 3 : 2 : 1, args, &e) == VG_OK);
}

static vg_head full_head(void)
{
    vg_head h = make_mixed(3);
    size_t corners = vg_mesh_corners(&h.body.mesh);
    h.body.attributes = (vg_attributes){.ntex = 2,
                                        .tex_dim = 2,
                                        .tex = room(4, sizeof(double)),
                                        .nlabels = 2,
                                        .corner_tex = room(corners, sizeof(uint32_t)),
                                        .labels = room(2, sizeof(vg_label))};
    h.body.attributes.tex[3] = 0.5, h.body.attributes.corner_tex[corners - 1] = UINT32_MAX;
    h.body.attributes.labels[0] = (vg_label){0, VG_LABEL_GROUP, strdup("body")};
    h.body.attributes.labels[1] = (vg_label){2, VG_LABEL_MATERIAL, strdup("skin")};
    h.selection.chosen = h.links.chosen = true;
    h.selection.n = 2, h.selection.faces = room(2, 4), h.selection.faces[1] = 3;
    h.links.n = 1, h.links.pairs = room(2, 4), h.links.pairs[1] = 5;
    h.nanchors = 1, h.anchors = room(1, 4), h.anchors[0] = 4;
    h.extra = (vg_records){1, room(1, sizeof(vg_record))};
    h.extra.at[0] = record("NOTE", "hello");
    trace(&h, "first", "a b", NULL);
    return h;
}

static void test_copy(void)
{
    vg_head a = full_head(), b;
    vg_err e;
    CHECK(vg_head_copy(&b, &a, &e) == VG_OK);
    CHECK(vg_mesh_same(&a.body.mesh, "a", &b.body.mesh, "b", &e) == VG_OK);
    CHECK(!memcmp(a.body.reference, b.body.reference, 3 * a.body.mesh.nv * sizeof(double)) &&
          a.body.reference != b.body.reference);
    CHECK_TEXT(b.body.reference_name, "rest");
    CHECK(b.body.attributes.ntex == 2 && b.body.attributes.tex_dim == 2 && b.body.attributes.tex[3] == 0.5);
    CHECK(b.body.attributes.corner_tex[vg_mesh_corners(&a.body.mesh) - 1] == UINT32_MAX &&
          b.body.attributes.nlabels == 2);
    CHECK(b.body.attributes.labels[1].face == 2 && b.body.attributes.labels[1].kind == VG_LABEL_MATERIAL);
    CHECK_TEXT(b.body.attributes.labels[1].text, "skin");
    CHECK(b.selection.chosen && b.selection.n == 2 && b.selection.faces[1] == 3 && b.links.chosen && b.links.n == 1 &&
          b.links.pairs[1] == 5);
    CHECK(b.nanchors == 1 && b.anchors[0] == 4 && b.kind == VG_VERTICES && b.precision == VG_F64 &&
          b.count == a.count);
    CHECK(b.nprovenance == 1 && b.provenance[0].nargs == 2 && b.provenance[0].nparents == 0);
    CHECK_TEXT(b.provenance[0].args[1], "a b");
    CHECK(b.extra.n == 1 && b.extra.at[0].flags == 2 && b.extra.at[0].payload.size == 5);
    CHECK_TEXT(b.extra.at[0].tag, "NOTE");
    CHECK(!memcmp(b.extra.at[0].payload.data, "hello", 5));
    vg_head_clear(&a); /* what was copied is the copy's own */
    CHECK(b.provenance[0].program[0] == 'f' && b.extra.at[0].payload.data[4] == 'o' && b.body.mesh.vert[0] > 0);
    CHECK(a.body.mesh.vert == NULL && a.nprovenance == 0 && a.extra.at == NULL);
    vg_head_clear(&b);
}

static void test_trace(void)
{
    vg_head a = {0}, b = {0};
    vg_err e;
    trace(&a, "one", NULL, NULL);
    trace(&a, "two", NULL, NULL);
    CHECK(a.nprovenance == 2 && a.provenance[0].nparents == 0 && a.provenance[1].nparents == 1);
    CHECK(a.provenance[1].parents[0] == 0);
    trace(&b, "other", NULL, NULL);
    trace(&b, "more", NULL, NULL);
    CHECK(vg_head_merge_trace(&a, &b, &e) == VG_OK);
    CHECK(a.nprovenance == 4 && a.provenance[3].nparents == 1 && a.provenance[3].parents[0] == 2);
    trace(&a, "join", "\xff\xc3\xa4\xe2\x82", "");
    vg_provenance *p = &a.provenance[4];
    CHECK(a.nprovenance == 5 && p->nparents == 2 && p->parents[0] == 1 && p->parents[1] == 3 && p->nargs == 3);
    CHECK_TEXT(p->args[1], "?\xc3\xa4??"); /* what is no UTF-8 became '?', the rest stayed */
    CHECK_TEXT(p->args[2], "");
    CHECK_TEXT(p->version, VG_VERSION);
    vg_head_clear(&a);
    vg_head_clear(&b);
}

static void test_frame(void)
{
    vg_head h = full_head();
    vg_frame a = {0}, b = {0};
    vg_err e;
    CHECK(vg_frame_shape(&a, &h, &e) == VG_OK && a.values && !a.nchannels);
    a.values[3 * h.body.mesh.nv - 1] = 1;
    CHECK(vg_frame_rename(&a, "pose", &e) == VG_OK && vg_frame_rename(&a, "a longer name", &e) == VG_OK);
    a.has_time = true, a.time = 2.5;
    a.extra = (vg_records){1, room(1, sizeof(vg_record))};
    a.extra.at[0] = record("NOTE", "x");
    b.extra = (vg_records){1, room(1, sizeof(vg_record))};
    b.extra.at[0] = record("OLD ", "y");
    CHECK(vg_frame_label(&b, &a, &e) == VG_OK);
    CHECK(b.has_time && b.time == 2.5 && b.extra.n == 1 && a.extra.n == 0 && !a.extra.at && !b.values);
    CHECK_TEXT(b.name, "a longer name");
    CHECK_TEXT(b.extra.at[0].tag, "NOTE");
    CHECK(vg_frame_label(&b, &a, &e) == VG_OK && b.extra.n == 0);
    h.count = SIZE_MAX / 4; /* more than there is */
    CHECK(vg_frame_shape(&b, &h, &e) == VG_ENOMEM);
    h.count = SIZE_MAX / 16;
    CHECK(vg_frame_shape(&b, &h, &e) == VG_ENOMEM);
    vg_frame_clear(&a);
    vg_frame_clear(&b);
    CHECK(!a.name && !a.values && !a.channels);
    vg_head_clear(&h);
}

/* One thing goes over, whole, and what was there is released. */
static void test_take(void)
{
    vg_head a = full_head(), b = full_head();
    uint32_t *selected = a.selection.faces, *vert = a.body.mesh.vert;
    double *reference = a.body.reference;
    vg_head_take(&b, &a, "selection");
    CHECK(b.selection.faces == selected && b.selection.chosen && !a.selection.faces && !a.selection.chosen && !a.selection.n);
    vg_head_take(&b, &a, "reference");
    CHECK(b.body.reference == reference && !a.body.reference && !a.body.reference_name && b.body.reference_name);
    vg_head_take(&b, &a, "mesh");
    CHECK(b.body.mesh.vert == vert && b.body.mesh.nf && !a.body.mesh.nf && !a.body.mesh.start);
    vg_head_take(&b, &a, "attributes");
    CHECK(b.body.attributes.nlabels && b.body.attributes.ntex && !a.body.attributes.labels && !a.body.attributes.tex);
    vg_err e;
    CHECK(vg_head_need(&b, "mesh", "b", &e) == VG_OK && vg_head_need(&a, "mesh", "it", &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "it holds no mesh");
    CHECK(vg_head_need(&a, "map", "'x.vgs'", &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "'x.vgs' holds no map: make one with vg-fitmap");
    CHECK(vg_head_need(&a, "nothing", "it", &e) == VG_EARG);
    vg_head_clear(&a);
    vg_head_clear(&b);
}

static void test_channels(void)
{
    vg_head h = full_head();
    vg_frame f = {0};
    vg_channel *c;
    vg_err e;
    size_t n;
    CHECK(vg_frame_set_scalars(&f, "error", "D", h.body.reference, h.body.mesh.nv, &e) == VG_OK);
    CHECK(vg_frame_pin(&f, (uint32_t[]){1, 3}, 2, &e) == VG_OK && f.nchannels == 2);
    CHECK(vg_frame_add(&f, "spin", "rad/s", VG_OF_FRAME, 3, 1, &c, &e) == VG_OK && c->numbers && !c->vertices);
    CHECK(c == vg_frame_channel(&f, "spin") && !vg_frame_channel(&f, "spi") && !vg_frame_channel(&f, "spins"));
    CHECK_TEXT(c->unit, "rad/s");
    CHECK_TEXT(c->element_name, "frame");
    c->numbers[2] = 7;
    vg_frame_drop(&f, "pins");
    CHECK(f.nchannels == 2 && !vg_frame_pins(&f, &n) && n == 0);
    CHECK(vg_frame_channel(&f, "spin")->numbers[2] == 7 && vg_frame_scalars(&f)->numbers[4] == h.body.reference[4]);
    /* the same name again takes its place, another set of scalars that of the first */
    CHECK(vg_frame_add(&f, "spin", "", VG_OF_LIST, 1, 5, &c, &e) == VG_OK && c->vertices && !c->numbers);
    CHECK(f.nchannels == 2 && vg_frame_set_scalars(&f, "load", "N", h.body.reference, 1, &e) == VG_OK);
    CHECK(f.nchannels == 2 && !vg_frame_channel(&f, "error") && vg_frame_scalars(&f)->count == 1);
    CHECK(vg_frame_add(&f, "", "", VG_OF_FRAME, 1, 1, &c, &e) == VG_EARG);
    CHECK(vg_frame_add(&f, "huge", "", VG_OF_COMPONENT, SIZE_MAX / 4, 8, &c, &e) == VG_ENOMEM);
    /* places are used again: the buffers of a frame stay the same from pose to pose */
    vg_frame_drop_all(&f);
    CHECK(vg_frame_add(&f, "a", "", VG_OF_FRAME, 64, 1, &c, &e) == VG_OK);
    const double *buffer = c->numbers;
    vg_frame_drop_all(&f);
    CHECK(vg_frame_add(&f, "b", "", VG_OF_FRAME, 64, 1, &c, &e) == VG_OK && c->numbers == buffer);
    /* anchors are those of frames on corners; a label keeps them and nothing else */
    vg_frame g = {0};
    h.kind = VG_VECTORS;
    CHECK(vg_frame_shape(&f, &h, &e) == VG_OK && f.nchannels == 1 && vg_frame_anchors(&f));
    CHECK(vg_frame_turn(&f, (double[]){1, 0, 0, 0}, 1, &e) == VG_OK && vg_frame_turns(&f, &n) && n == 1);
    CHECK(vg_frame_label(&f, &g, &e) == VG_OK && f.nchannels == 1 && vg_frame_anchors(&f));
    vg_frame_clear(&f);
    vg_frame_clear(&g);
    vg_head_clear(&h);
}

static void test_names(void)
{
    static const struct {
        const char *name;
        size_t stem;
        bool begins;
    } all[] = {{"Walk.0001", 4, true},  {"Walk.1", 4, true},   {"a.b.01", 3, true}, {"Walk.0002", 4, false}, {"Walk.0000", 4, false},
               {"Walk.0011", 4, false}, {"Walk0001", 0, false}, {"0001", 0, false},  {".0001", 0, false},     {"Walk.", 0, false},
               {"Walk.0001a", 0, false}, {"", 0, false},       {"Walk.18446744073709551617", 4, false}}; /* 2^64 + 1 */
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        uint64_t number;
        CHECK(vg_frame_stem(all[i].name, &number) == all[i].stem && vg_frame_begins(all[i].name) == all[i].begins);
    }
}

static void test_kinds(void)
{
    CHECK(vg_kind_width(VG_VERTICES) == 3 && vg_kind_width(VG_VECTORS) == 3);
    CHECK(vg_kind_width(VG_DEFORMATIONS) == 4 && vg_kind_width(VG_TRANSFORMS) == 7);
    CHECK(vg_kind_width(VG_OTHER) == 0 && vg_kind_width(VG_KINDS) == 0 && vg_kind_width((vg_kind)-1) == 0);
    CHECK(vg_kind_width(VG_FEATURES) == 0 && vg_kind_element(VG_FEATURES) == VG_OF_VERTEX);
    vg_head h = {.kind = VG_FEATURES, .width = 9, .count = 4, .body.mesh.nv = 4};
    CHECK(vg_head_width(&h) == 9 && vg_head_elements(&h, VG_OF_VERTEX) == 4);
    CHECK(vg_head_elements(&h, VG_OF_TRANSFORM) == SIZE_MAX && vg_head_elements(&h, VG_OF_FRAME) == 1);
    h.kind = VG_VERTICES;
    CHECK(vg_head_width(&h) == 3); /* what the head says counts only where the form leaves it open */
    h = (vg_head){.kind = VG_OTHER, .form = (char[]){"strains"}, .form_element = (char[]){"vertex"}, .width = 6};
    CHECK(vg_head_width(&h) == 6 && vg_head_element(&h) == VG_OF_VERTEX);
    CHECK_TEXT(vg_head_form(&h), "strains");
    CHECK_TEXT(vg_kind_name(VG_DEFORMATIONS), "deformations");
    CHECK_TEXT(vg_kind_name(VG_KINDS), "unknown");
}

TESTS({"which meshes are valid", test_check},
      {"checking needs no memory for what is claimed", test_check_needs_no_memory},
      {"which meshes are the same", test_same}, {"no faces", test_empty}, {"components", test_components},
      {"diagonal and centroid", test_size_and_centre}, {"vectors sum to 0, and move as the mesh does", test_vectors},
      {"the graph has faces, selection and links", test_graph}, {"a copy is whole and its own", test_copy},
      {"provenance has its parents", test_trace}, {"frames are reused", test_frame}, {"names of frames", test_names}, {"kinds", test_kinds},
      {"channels", test_channels},
      {"one thing of a head goes over to another", test_take})
