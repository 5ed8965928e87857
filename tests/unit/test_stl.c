/* test_stl.c: STL read from bytes made here, welding to the bit, splitting of polygons, and what must be refused.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "test.h"

static const char two[] =
    "solid a name\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n"
    "  endloop\n endfacet\n FACET NORMAL nan nan nan OUTER LOOP\r\n"
    "   vertex 1 0 -0\n   vertex 1 1 0\n   vertex 0 1 -0.0\n  endloop endfacet\nendsolid a name\n";

static int read_stl(vg_model *m, const void *data, size_t n, char message[480])
{
    vg_err e = {0};
    int r = vg_model_read(m, data, n, "stl", "x.stl", &e);
    snprintf(message, 480, "%s", e.message);
    return r;
}

static void welds_to_the_bit(void)
{
    static const uint32_t want[] = {0, 1, 2, 1, 3, 2};
    vg_model m;
    char message[480];
    CHECK(read_stl(&m, two, strlen(two), message) == VG_OK);
    CHECK(m.mesh.nv == 4 && m.mesh.nf == 2 && !*m.note.text);
    if (m.mesh.nf == 2) CHECK(!memcmp(m.mesh.vert, want, sizeof want));
    vg_model_clear(&m);
    /* the least difference keeps corners apart */
    char near[sizeof two + 32];
    const char *at = strstr(two, "vertex 1 0 -0\n");
    int n = snprintf(near, sizeof near, "%.*svertex 1.0000000000000002 0 0\n%s", (int)(at - two), two, at + 14);
    CHECK(read_stl(&m, near, (size_t)n, message) == VG_OK && m.mesh.nv == 5);
    vg_model_clear(&m);
}

static void leaves_out_what_is_no_triangle(void)
{
    vg_model m;
    char message[480], text[1000];
    snprintf(text, sizeof text,
             "solid\nfacet normal 0 0 0 outer loop vertex 5 5 5 vertex 5 5 5 vertex 1 2 3 endloop "
             "endfacet\nendsolid\n%s",
             two);
    CHECK(read_stl(&m, text, strlen(text), message) == VG_OK && m.mesh.nf == 2);
    CHECK_TEXT(m.note.text, "left out 1 face that names a vertex twice or has fewer than 2 corners");
    vg_model_clear(&m);
    text[strlen(text) - strlen(two)] = 0;
    CHECK(read_stl(&m, text, strlen(text), message) == VG_EINPUT);
    CHECK_TEXT(message, "'x.stl' has no triangle with three different corners");
}

static void refuses_text_that_breaks_off(void)
{
    vg_model m;
    char message[480];
    for (size_t n = 0; n < strlen(two) - strlen("endsolid a name\n") + 7; n++) {
        int r = read_stl(&m, two, n, message);
        CHECK(r < 0 && message[0]);
        if (r == VG_OK) vg_model_clear(&m);
    }
    static const char inf[] =
        "solid\nfacet normal 0 0 1 outer loop vertex 0 0 inf vertex 1 0 0 vertex 0 1 0 endloop endfacet endsolid";
    CHECK(read_stl(&m, inf, strlen(inf), message) == VG_EINPUT);
    CHECK_TEXT(message, "'x.stl': corner 0 of triangle 0 is not finite");
    static const char word[] =
        "solid\nfacet normal 0 0 1 outer loop vertex 0 0 x vertex 1 0 0 vertex 0 1 0 endloop endfacet endsolid";
    CHECK(read_stl(&m, word, strlen(word), message) == VG_EINPUT);
    CHECK_TEXT(message, "'x.stl', line 2: 'x' where 'a number' is expected");
    CHECK(read_stl(&m, "solid\nendsolid\n", 15, message) == VG_EINPUT);
    CHECK_TEXT(message, "'x.stl' has no triangles");
}

/* ---- binary ---- */

static vg_bytes write_mesh(const char *format, const vg_mesh *m, const double *x, bool full, int *result)
{
    vg_bytes b = {0};
    vg_err e;
    *result = vg_model_write(&b, format, m, x, NULL, full, &e);
    return b;
}

static uint32_t start[] = {0, 4, 7, 9}, vert[] = {0, 1, 2, 3, 1, 0, 4, 2, 4};
static double points[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, -1, 0.1};
static const vg_mesh mixed = {5, 3, start, vert};

static void reads_binary(void)
{
    int r;
    char message[480];
    vg_model m;
    vg_bytes b = write_mesh("stl", &mixed, points, false, &r);
    CHECK(r == VG_OK && b.size == 84 + 3 * 50 && vgi_get32(b.data + 80) == 3);
    CHECK(vgi_format_by_content(b.data, b.size) == &vgi_format_stl);
    CHECK(read_stl(&m, b.data, b.size, message) == VG_OK && m.mesh.nf == 3 && m.mesh.nv == 5);
    if (r == VG_OK) CHECK(m.vertices[3 * 4 + 2] == (double)0.1f);
    vg_model_clear(&m);
    for (size_t n = 0; n < b.size; n++) {
        unsigned char *tight = malloc(n ? n : 1);
        memcpy(tight, b.data, n);
        CHECK(read_stl(&m, tight, n, message) == VG_ETRUNC);
        free(tight);
    }
    CHECK(vgi_bytes_append(&b, "", 1, NULL) == VG_OK && read_stl(&m, b.data, b.size, message) == VG_OK);
    CHECK_TEXT(m.note.text, "left out 1 bytes after the last triangle");
    vg_model_clear(&m);
    b.size--;
    vgi_put32(b.data + 80, UINT32_MAX);
    CHECK(read_stl(&m, b.data, b.size, message) == VG_ETRUNC);
    vgi_put32(b.data + 80, 3);
    memcpy(b.data, "solid", 6); /* some programs do that */
    CHECK(read_stl(&m, b.data, b.size, message) == VG_OK);
    vg_model_clear(&m);
    vgi_put32(b.data + 84 + 50 + 12, 0x7f800000u);
    CHECK(read_stl(&m, b.data, b.size, message) == VG_EINPUT);
    CHECK_TEXT(message, "'x.stl': corner 0 of triangle 1 is not finite");
    vg_bytes_clear(&b);
}

static void writes_text(void)
{
    int r;
    char message[480];
    vg_model m;
    double x[15];
    memcpy(x, points, sizeof x);
    x[0] = 1 / 3.0;
    vg_bytes b = write_mesh("stl-ascii", &mixed, x, true, &r);
    CHECK(r == VG_OK && read_stl(&m, b.data, b.size, message) == VG_OK && m.mesh.nf == 3 && m.vertices[0] == 1 / 3.0);
    vg_model_clear(&m);
    vg_bytes_clear(&b);
}

/* The area of all triangles, and that each looks the same way as `sign`. */
static double area(const vg_model *m, double sign)
{
    double sum = 0;
    for (size_t f = 0; f < m->mesh.nf; f++) {
        const double *a = m->vertices + 3 * (size_t)m->mesh.vert[3 * f],
                     *b = m->vertices + 3 * (size_t)m->mesh.vert[3 * f + 1],
                     *c = m->vertices + 3 * (size_t)m->mesh.vert[3 * f + 2];
        double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        CHECK(sign * twice > 0);
        sum += twice / 2;
    }
    return sum;
}

static void splits_polygons(void)
{
    /* an L and a comb, whose fans from some corners would lie outside; every corner begins once,
     * and both ways round */
    static const double shapes[2][20] = {{0, 0, 2, 0, 2, 1, 1, 1, 1, 3, 0, 3},
                                         {0, 0, 7, 0, 7, 3, 5, 3, 5, 1, 4, 1, 4, 3, 2, 3, 2, 1, 0, 1}};
    static const size_t sizes[2] = {6, 10};
    static const double areas[2] = {4, 15};
    for (int s = 0; s < 2; s++)
        for (size_t first = 0; first < sizes[s]; first++)
            for (int back = 0; back < 2; back++) {
                size_t n = sizes[s];
                uint32_t face[10], ends[2] = {0, (uint32_t)n};
                double x[30] = {0};
                for (size_t i = 0; i < n; i++) {
                    face[i] = (uint32_t)(back ? (first + n - i) % n : (first + i) % n);
                    x[3 * i] = shapes[s][2 * i], x[3 * i + 1] = shapes[s][2 * i + 1];
                }
                vg_mesh m = {n, 1, ends, face};
                vg_model read;
                int r;
                char message[480];
                vg_bytes b = write_mesh("stl", &m, x, false, &r);
                CHECK(r == VG_OK && read_stl(&read, b.data, b.size, message) == VG_OK);
                CHECK(read.mesh.nf == n - 2 && read.mesh.nv == n);
                CHECK_NEAR(area(&read, back ? -1 : 1), back ? -areas[s] : areas[s], 1e-12);
                vg_model_clear(&read);
                vg_bytes_clear(&b);
            }
}

static void refuses_what_it_cannot_write(void)
{
    int r;
    double x[15];
    vg_mesh lines = {5, 1, (uint32_t[]){0, 2}, vert};
    vg_bytes b = write_mesh("stl", &lines, points, false, &r);
    CHECK(r == VG_EINPUT && b.size == 0);
    vg_bytes_clear(&b);
    memcpy(x, points, sizeof x);
    x[4] = 1e300;
    b = write_mesh("stl", &mixed, x, true, &r);
    CHECK(r == VG_EINPUT && b.size == 0);
    vg_bytes_clear(&b);
}

TESTS({"welds to the bit", welds_to_the_bit}, {"leaves out what is no triangle", leaves_out_what_is_no_triangle},
      {"refuses text that breaks off", refuses_text_that_breaks_off}, {"reads binary", reads_binary},
      {"writes text", writes_text}, {"splits polygons", splits_polygons},
      {"refuses what it cannot write", refuses_what_it_cannot_write})
