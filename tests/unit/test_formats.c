/* test_formats.c: mesh files: there and back, every form that is read, every damage refused.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"

#include "io/io.h"

#include <locale.h>

static const char *const format_names[] = {"obj", "ply", "ply-ascii", "ply-be", "off"};
enum { FORMATS = sizeof format_names / sizeof *format_names };

/* A line, a triangle, a quad, a pentagon, two lines behind; vertex 8 is in no face. */
static uint32_t mixed_start[] = {0, 2, 5, 9, 14, 16, 18};
static uint32_t mixed_vert[] = {0, 1, 1, 2, 3, 3, 2, 1, 0, 4, 5, 6, 7, 3, 6, 0, 7, 2};
static double mixed_vertices[] = {0.1, -0.0, 1.0 / 3, 1e-300, 2, 3, 123456789.123, 1e22, -7, 4.9e-324, 5, 1e-7,
                                  0.5, 0.25, 1e15,    1,      1, 1, -1e-30,        0,    0,  1e300,    1, 2,
                                  9,   9,    9};
static double mixed_tex[] = {0, 0.25, 1.0 / 7, 1, 0.1, 0.2};
static uint32_t mixed_corner_tex[] = {0,          1,          UINT32_MAX, 2, 1, 0, 0, 1,          2,
                                      UINT32_MAX, UINT32_MAX, 1,          1, 1, 2, 0, UINT32_MAX, 0};
static vg_label mixed_labels[] = {
    {0, VG_LABEL_LIBRARY, (char *)"parts.mtl"}, {0, VG_LABEL_OBJECT, (char *)"house"},
    {1, VG_LABEL_GROUP, (char *)"a b"},         {1, VG_LABEL_MATERIAL, (char *)"caf\xc3\xa9 #25"},
    {1, VG_LABEL_SMOOTHING, (char *)"off"},     {3, VG_LABEL_GROUP, (char *)""},
    {6, VG_LABEL_MATERIAL, (char *)"last\\"}};
static const vg_mesh mixed = {9, 6, mixed_start, mixed_vert};
static uint8_t mixed_colours[] = {255, 0, 0, 255, 0, 128, 0, 254, 0, 0, 1,   255, 1, 2, 3, 0, 4, 5, 6, 7,
                                  8,   9, 10, 11, 12, 13,  14, 15, 16, 17, 18, 19, 20, 21, 22, 255};
static const vg_attributes mixed_attributes = {3, 2, mixed_tex, mixed_corner_tex, 7, mixed_labels, 9, mixed_colours};

/* The bytes as they are, at the end of an allocation, so that a sanitizer sees reading beyond. */
static int read_bytes(vg_model *m, const void *data, size_t n, const char *format, vg_err *e)
{
    void *exact = malloc(n ? n : 1);
    memcpy(exact, data, n);
    *e = (vg_err){0};
    int result = vg_model_read(m, exact, n, format, "x", e);
    free(exact);
    return result;
}

static int read_text(vg_model *m, const char *text, vg_err *e)
{
    return read_bytes(m, text, strlen(text), NULL, e);
}

static bool write_mixed(vg_bytes *out, const char *format, bool full)
{
    double fitting[27];
    memcpy(fitting, mixed_vertices, sizeof fitting);
    if (!full) fitting[21] = 1e30; /* 1e300 is beyond single precision */
    return vg_model_write(out, format, &mixed, fitting, &mixed_attributes, full, NULL) == VG_OK;
}

static bool colours_same(const vg_attributes *a, const vg_attributes *b)
{
    return a->ncolours == b->ncolours && (!a->ncolours || !memcmp(a->colours, b->colours, 4 * a->ncolours));
}

static bool attributes_same(const vg_attributes *a, const vg_attributes *b, size_t corners)
{
    if (a->ntex != b->ntex || a->tex_dim != b->tex_dim || a->nlabels != b->nlabels) return false;
    if (memcmp(a->tex, b->tex, a->ntex * a->tex_dim * sizeof *a->tex)) return false;
    if (memcmp(a->corner_tex, b->corner_tex, corners * sizeof *a->corner_tex)) return false;
    for (size_t i = 0; i < a->nlabels; i++)
        if (a->labels[i].face != b->labels[i].face || a->labels[i].kind != b->labels[i].kind ||
            strcmp(a->labels[i].text, b->labels[i].text))
            return false;
    return colours_same(a, b);
}

static void there_and_back_exactly(void)
{
    for (size_t i = 0; i < FORMATS; i++) {
        vg_bytes once = {0}, again = {0};
        vg_model m;
        vg_err e;
        CHECK(write_mixed(&once, format_names[i], true));
        int result = read_bytes(&m, once.data, once.size, NULL, &e);
        CHECK_TEXT(e.message, "");
        CHECK(result == VG_OK);
        if (result < 0) continue;
        CHECK(vg_mesh_same(&mixed, "a", &m.mesh, "b", &e) == VG_OK);
        CHECK(m.mesh.nv == 9 && !memcmp(m.vertices, mixed_vertices, sizeof mixed_vertices));
        if (!strcmp(format_names[i], "obj")) CHECK(attributes_same(&mixed_attributes, &m.attributes, 18));
        else if (strcmp(format_names[i], "off")) CHECK(colours_same(&mixed_attributes, &m.attributes));
        CHECK(vg_model_write(&again, format_names[i], &m.mesh, m.vertices, &m.attributes, true, &e) == VG_OK);
        CHECK(once.size == again.size && !memcmp(once.data, again.data, once.size));
        vg_model_clear(&m);
        vg_bytes_clear(&once);
        vg_bytes_clear(&again);
    }
}

static void there_and_back_in_single_precision(void)
{
    for (size_t i = 0; i < FORMATS; i++) {
        vg_bytes once = {0};
        vg_model m;
        vg_err e;
        CHECK(write_mixed(&once, format_names[i], false));
        if (read_bytes(&m, once.data, once.size, NULL, &e) < 0) {
            CHECK_TEXT(e.message, "");
            continue;
        }
        CHECK(vg_mesh_same(&mixed, "a", &m.mesh, "b", &e) == VG_OK);
        for (size_t k = 0; k < 27; k++) {
            float want = (float)(k == 21 ? 1e30 : mixed_vertices[k]), got = (float)m.vertices[k];
            CHECK(!memcmp(&want, &got, sizeof got));
        }
        vg_model_clear(&m);
        vg_bytes_clear(&once);
    }
}

static void obj_text_is_as_promised(void)
{
    vg_bytes out = {0};
    vg_err e;
    static uint32_t start[] = {0, 4, 6}, vert[] = {0, 1, 2, 3, 3, 0}, tex[] = {0, 1, 1, UINT32_MAX, 0, 1};
    static double x[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.1}, uv[] = {0, 0, 0.5, 1};
    static vg_label labels[] = {{0, VG_LABEL_GROUP, (char *)"side"},
                                {1, VG_LABEL_MATERIAL, (char *)"red"},
                                {1, VG_LABEL_LIBRARY, (char *)"m.mtl"}};
    const vg_mesh mesh = {4, 2, start, vert};
    const vg_attributes a = {2, 2, uv, tex, 3, labels, 0, NULL};
    CHECK(vg_model_write(&out, "obj", &mesh, x, &a, false, &e) == VG_OK);
    CHECK(vgi_bytes_append(&out, "", 1, &e) == VG_OK);
    CHECK_TEXT((char *)out.data, "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.1\nvt 0 0\nvt 0.5 1\n"
                                 "g side\nf 1/1 2/2 3/2 4\nusemtl red\nl 4/1 1/2\n");
    out.size = 0;
    CHECK(vg_model_write(&out, "ply-ascii", &mesh, x, NULL, false, &e) == VG_OK);
    CHECK(vgi_bytes_append(&out, "", 1, &e) == VG_OK);
    CHECK_TEXT((char *)out.data,
               "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
               "element face 1\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int vertex1\n"
               "property int vertex2\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0.1\n4 0 1 2 3\n3 0\n");
    out.size = 0;
    CHECK(vg_model_write(&out, "off", &mesh, x, NULL, false, &e) == VG_OK);
    CHECK(vgi_bytes_append(&out, "", 1, &e) == VG_OK);
    CHECK_TEXT((char *)out.data, "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0.1\n4 0 1 2 3\n2 3 0\n");
    vg_bytes_clear(&out);
}

static void refuses_to_write_what_does_not_fit(void)
{
    double x[27];
    vg_bytes out = {0};
    vg_err e;
    memcpy(x, mixed_vertices, sizeof x);
    CHECK(vgi_bytes_append(&out, "before", 6, &e) == VG_OK);
    CHECK(vg_model_write(&out, "obj", &mixed, x, NULL, false, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "vertex 7 does not fit binary32 (1e+300): 'vg-decode --f64' writes binary64");
    CHECK(vg_model_write(&out, "fbx", &mixed, x, NULL, true, &e) == VG_EARG);
    CHECK_TEXT(e.message, "unknown mesh format 'fbx' (known: obj, ply, ply-ascii, ply-be, off, stl, stl-ascii)");
    vg_label broken = {0, VG_LABEL_GROUP, (char *)"two\nlines"};
    vg_attributes a = {.nlabels = 1, .labels = &broken};
    CHECK(vg_model_write(&out, "obj", &mixed, x, &a, true, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "g 'two?lines' has a line break, which OBJ cannot hold");
    x[4] = NAN;
    for (size_t i = 0; i < FORMATS; i++) {
        CHECK(vg_model_write(&out, format_names[i], &mixed, x, NULL, true, &e) == VG_EINPUT);
        CHECK_TEXT(e.message, "vertex 1 is not finite");
    }
    CHECK(out.size == 6 && !memcmp(out.data, "before", 6)); /* a failure appends nothing */
    vg_bytes_clear(&out);
}

/* A face of more than 255 corners needs a longer list length in PLY; large ones another way of finding vertices named
 * twice. */
static void large_face(uint32_t n)
{
    enum { MOST = 300 };
    uint32_t start[] = {0, n}, vert[MOST];
    double x[3 * MOST];
    for (uint32_t i = 0; i < n; i++) vert[i] = n - 1 - i, x[3 * i] = i, x[3 * i + 1] = i / 3.0, x[3 * i + 2] = 0;
    vg_mesh mesh = {n, 1, start, vert};
    vg_err e;
    for (size_t i = 0; i < FORMATS; i++) {
        vg_bytes out = {0};
        vg_model m;
        CHECK(vg_model_write(&out, format_names[i], &mesh, x, NULL, true, &e) == VG_OK);
        CHECK(read_bytes(&m, out.data, out.size, NULL, &e) == VG_OK);
        CHECK(vg_mesh_same(&mesh, "a", &m.mesh, "b", &e) == VG_OK && !memcmp(x, m.vertices, 24 * n));
        vg_model_clear(&m);
        out.size = 0;
        vert[n / 2] = vert[3];
        CHECK(vg_model_write(&out, format_names[i], &mesh, x, NULL, true, &e) == VG_OK);
        CHECK(read_bytes(&m, out.data, out.size, NULL, &e) == VG_OK);
        CHECK(strstr(m.note.text, "cut 1 face that names a vertex twice"));
        vg_model_clear(&m);
        vert[n / 2] = n - 1 - n / 2;
        vg_bytes_clear(&out);
    }
}

static void large_faces(void)
{
    large_face(255);
    large_face(256);
    large_face(300);
}

/* Programs that draw know edges only as an element of their own; a segment between faces keeps its place among them. */
static void segments_of_ply_come_last_or_stay(void)
{
    static uint32_t start[] = {0, 2, 5, 7}, vert[] = {0, 1, 0, 1, 2, 2, 0};
    static double x[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const vg_mesh between = {3, 3, start, vert};
    vg_bytes out = {0};
    CHECK(vg_model_write(&out, "ply-ascii", &between, x, NULL, false, NULL) == VG_OK);
    CHECK(vgi_bytes_append(&out, "", 1, NULL) == VG_OK);
    CHECK(strstr((char *)out.data, "element face 3\n") && !strstr((char *)out.data, "element edge"));
    CHECK(strstr((char *)out.data, "\n2 0 1\n3 0 1 2\n2 2 0\n"));
    vg_bytes_clear(&out);
}

/* What each text must read as: faces as "0 1 2;2 3", and vertices as their x coordinates. */
static void describe(const vg_model *m, char *to, size_t room)
{
    size_t n = 0;
    for (size_t v = 0; v < m->mesh.nv; v++)
        n += (size_t)snprintf(to + n, room - n, v ? " %g" : "%g",
                              m->vertices[3 * v] + 10 * m->vertices[3 * v + 1] + 100 * m->vertices[3 * v + 2]);
    for (size_t f = 0; f < m->mesh.nf; f++)
        for (uint32_t c = m->mesh.start[f]; c < m->mesh.start[f + 1]; c++) {
            n += (size_t)snprintf(to + n, room - n, "%s%u", c == m->mesh.start[f] ? "; " : " ", m->mesh.vert[c]);
            if (m->attributes.corner_tex && m->attributes.corner_tex[c] != UINT32_MAX)
                n += (size_t)snprintf(to + n, room - n, "/%u", m->attributes.corner_tex[c]);
        }
}

#define CHECK_READS(text, n, want) check_reads(__LINE__, text, n, want)

static void check_reads(int line, const char *text, size_t n, const char *want)
{
    vg_model m;
    vg_err e;
    char got[1000] = "";
    if (read_bytes(&m, text, n, NULL, &e) == VG_OK) {
        describe(&m, got, sizeof got);
        vg_model_clear(&m);
    } else {
        snprintf(got, sizeof got, "%s", e.message);
    }
    if (!strcmp(got, want)) return;
    test_bad++;
    printf("%s:%d: reads as \"%s\", not \"%s\"\n", __FILE__, line, got, want);
}

static void reads_all_forms_of_obj(void)
{
#define P3 "v 0 0 0\nv 1 0 0\nv 2 0 0\n"
    static const struct {
        const char *text, *want;
    } forms[] = {
        {P3 "f 1 2 3\n", "0 1 2; 0 1 2"},
        {P3 "f 1 2 3", "0 1 2; 0 1 2"},
        {P3 "f 3 1", "0 1 2; 2 0"},
        {P3, "0 1 2"},
        {P3 "vt 0 0\nvt 1 1\nf 1/1 2/2 3/1\n", "0 1 2; 0/0 1/1 2/0"},
        {P3 "vt 0 0\nvt 1 1\nf 1/-1 2/-2 3\n", "0 1 2; 0/1 1/0 2"},
        {P3 "vn 0 0 1\nf 1//1 2//1 3//1\n", "0 1 2; 0 1 2"},
        {P3 "vt 0\nvn 0 0 1\nf 1/1/1 2/1/1 3//-1\n", "0 1 2; 0/0 1/0 2"},
        {P3 "f 1/ 2/ 3/\n", "0 1 2; 0 1 2"},
        {P3 "f -1 -2 -3\nv 3 0 0\nf -1 -2 -3\n", "0 1 2 3; 2 1 0; 3 2 1"},
        {"f 1 2 3\n" P3, "0 1 2; 0 1 2"},
        {P3 "l 1 2 3\n", "0 1 2; 0 1; 1 2"},
        {P3 "vt 0\nvt 1\nl 1/1 2/2 3/1 1\n", "0 1 2; 0/0 1/1; 1/1 2/0; 2/0 0"},
        {P3 "fo 1 2 3\n", "0 1 2; 0 1 2"},
        {"v 1 2 3 1\nv 4 5 6 0.1 0.2 0.3\nv 7 8 9 1 0.1 0.2 0.3\nl 1 2", "321 654 987; 0 1"},
        {"v\t1\t2\t3\r\n\r\nv  1e0   -2.5E+1 .5 \r\nl\t1  2 \r\n", "321 -199; 0 1"},
        {"v 1 0 0\rv 2 0 0\rl 1 2\r", "1 2; 0 1"},
        {"v 1 \\\n 0 0\nv 2 0 \\\r\n0\nl 1\\\n 2 # two\n", "1 2; 0 1"},
        {"# one\\\nv 1 0 0\n  # two\n\n\nv 2 0 0 # three\nl 1 2#four\n", "1 2; 0 1"},
        {"\xef\xbb\xbfv 1 0 0\nv 2 0 0\nl 1 2\n", "1 2; 0 1"},
        {P3 "p 1 2\nvp 0.5\ncstype bezier\ndeg 3\ncurv 0 1 1 2 \\\n3\nend\nvertex\nfoo\nf 1 2 3\n", "0 1 2; 0 1 2"},
        {"o thing\nv 1 0 0\nmtllib\n", "1"},
    };
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        CHECK_READS(forms[i].text, strlen(forms[i].text), forms[i].want);
}

static void keeps_labels_and_texture_of_obj(void)
{
    vg_model m;
    vg_err e;
    CHECK(read_text(&m,
                    "mtllib  a b.mtl \no caf\xe9\nv 0 0 0\nv 1 0 0\nvt 0.5\nvt 1 2 3\nvt 4 5\ng\n"
                    "l 1 2\nusemtl two \\\r\n words\ns off\nl 2 1\ng C:\\end\\ \n",
                    &e) == VG_OK);
    static const vg_label want[] = {
        {0, VG_LABEL_LIBRARY, (char *)"a b.mtl"}, {0, VG_LABEL_OBJECT, (char *)"caf\xc3\xa9"},
        {0, VG_LABEL_GROUP, (char *)""},          {1, VG_LABEL_MATERIAL, (char *)"two   words"},
        {1, VG_LABEL_SMOOTHING, (char *)"off"},   {2, VG_LABEL_GROUP, (char *)"C:\\end\\"}};
    CHECK(m.attributes.nlabels == 6);
    for (size_t i = 0; i < 6 && i < m.attributes.nlabels; i++) {
        CHECK(m.attributes.labels[i].face == want[i].face && m.attributes.labels[i].kind == want[i].kind);
        CHECK_TEXT(m.attributes.labels[i].text, want[i].text);
    }
    static const double tex[] = {0.5, 0, 0, 1, 2, 3, 4, 5, 0};
    CHECK(m.attributes.ntex == 3 && m.attributes.tex_dim == 3 && !memcmp(m.attributes.tex, tex, sizeof tex));
    for (size_t c = 0; c < 4; c++) CHECK(m.attributes.corner_tex[c] == UINT32_MAX); /* there, but no face uses them */
    vg_model_clear(&m);
    CHECK(read_text(&m, "v 0 0 0\nvt 1\nvt 2 3\n", &e) == VG_OK);
    static const double flat[] = {1, 0, 2, 3};
    CHECK(m.attributes.tex_dim == 2 && !memcmp(m.attributes.tex, flat, sizeof flat));
    vg_model_clear(&m);
}

static void refuses_broken_obj(void)
{
    static const struct {
        const char *text, *message;
    } broken[] = {
        {P3 "f 0 1 2\n", "'x' line 4: index 0 (indices count from 1, or back from -1)"},
        {P3 "\n\nf 1 2 3\nf 1 2 4\n", "'x' line 7: vertex 4 is out of range, there are 3"},
        {P3 "l 1 2 3 1\nl 3 2 9\n", "'x' line 5: vertex 9 is out of range, there are 3"},
        {P3 "f -1 -2 -4\n", "'x' line 4: index -4 is out of range"},
        {P3 "f 1 2 4294967296\n", "'x' line 4: index 4294967296 is out of range"},
        {P3 "f 1 2 18446744073709551617\n", "'x' line 4: index 18446744073709551617 is out of range"},
        {P3 "f 1 2 x\n", "'x' line 4: an index expected, not 'x'"},
        {P3 "f 1 2 3x\n", "'x' line 4: a blank between corners expected, not 'x'"},
        {P3 "f 1.5 2 3\n", "'x' line 4: a blank between corners expected, not '.5'"},
        {P3 "f 1/x 2 3\n", "'x' line 4: an index expected, not 'x'"},
        {"v 0 0\n", "'x' line 1: vertex with 2 numbers (expected x y z)"},
        {"v 0 0 0\r\nv 1 2\r\n", "'x' line 2: vertex with 2 numbers (expected x y z)"},
        {"v 0 0 0\rv 0 0 a\r", "'x' line 2: a number expected, not 'a'"},
        {"v 0 0 1,5\n", "'x' line 1: '1,5' is not a finite number"},
        {"v 0 0 1-2\n", "'x' line 1: '1-2' is not a finite number"},
        {"v 0 -1.#IND00 0\n", "'x' line 1: '-1.#IND00' is not a finite number"},
        {"v 1.#INF 0 0\n", "'x' line 1: '1.#INF' is not a finite number"},
        {"v 0 0 1.#QNAN\n", "'x' line 1: '1.#QNAN' is not a finite number"},
        {"v 0 nan 0\n", "'x' line 1: 'nan' is not a finite number"},
        {"v 0 0 -inf\n", "'x' line 1: '-inf' is not a finite number"},
        {"v 0 0 1e999\n", "'x' line 1: '1e999' is not a finite number"},
        {"f 1 2 3\n", "'x' has no vertices (no line 'v x y z')"},
        {"o nothing\n", "'x' has no vertices (no line 'v x y z')"},
    };
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++)
        CHECK_READS(broken[i].text, strlen(broken[i].text), broken[i].message);
    CHECK_READS("v 0 0 0\no a\0b\n", 14, "'x' line 2: a name with a zero byte");
}

#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define QUAD "element face 1\nproperty list uchar int vertex_indices\n"

static void reads_all_forms_of_ply(void)
{
    static const struct {
        const char *text, *want;
    } forms[] = {
        {"ply\nformat ascii 1.0\nelement vertex 2\n" XYZ "end_header\n1 2 3\n4 5 6\n", "321 654"},
        {"ply\r\nformat ascii 1.0\r\ncomment a\r\nobj_info b\r\nelement vertex 3\r\nproperty double z\r\n"
         "property uchar red\r\n"
         "property int8 y\r\nproperty uint16 x\r\nelement face 2\r\nproperty list uint8 uint32 vertex_index\r\n"
         "end_header\r\n"
         "3 255 2 1\r\n0.5 7 -1 65535\r\n0 0 0 0\r\n3 0 1 2\r\n2 2 1",
         "321 65575 0; 0 1 2; 2 1"},
        {"ply\rformat ascii 1.0\relement vertex 1\rproperty float x\rproperty float y\rproperty float z\r"
         "end_header\r1 0 0\r",
         "1"},
        {"ply\nformat ascii 1.0\nelement junk 2\nproperty list int float a\nproperty char b\nelement edge 1\n"
         "property int vertex2\n"
         "property uchar red\nproperty int vertex1\nelement vertex 3\n" XYZ
         "property list uchar int n\nelement face 1\n"
         "property list uchar int flags\nproperty list char short vertex_indices\nelement tristrips 0\n"
         "property list int int vertex_indices\nend_header\n"
         "2 1.5 2.5 7\n0 8\n1 255 0\n0 0 0 0\n1 0 0 1 5\n2 0 0 0\n2 9 9 3 0 1 2\n",
         "0 1 2; 0 1; 0 1 2"},
    };
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        CHECK_READS(forms[i].text, strlen(forms[i].text), forms[i].want);
}

/* Every scalar type under both names, in text and both binary orders, as coordinate and (integers) as index. */
static void reads_all_types_of_ply(void)
{
    static const struct {
        const char *name;
        size_t bytes;
        bool real;
    } types[] = {{"char", 1, false},  {"int8", 1, false},   {"uchar", 1, false},  {"uint8", 1, false},
                 {"short", 2, false}, {"int16", 2, false},  {"ushort", 2, false}, {"uint16", 2, false},
                 {"int", 4, false},   {"int32", 4, false},  {"uint", 4, false},   {"uint32", 4, false},
                 {"float", 4, true},  {"float32", 4, true}, {"double", 8, true},  {"float64", 8, true}};
    for (size_t t = 0; t < sizeof types / sizeof *types; t++)
        for (int big = 0; big < 2; big++) {
            unsigned char file[1024];
            const char *index = types[t].real ? "int" : types[t].name;
            size_t index_bytes = types[t].real ? 4 : types[t].bytes;
            size_t n = (size_t)snprintf(
                (char *)file, sizeof file,
                "ply\nformat binary_%s_endian 1.0\nelement vertex 2\nproperty %s x\nproperty %s y\n"
                "property %s z\nelement face 1\nproperty list %s %s vertex_indices\nend_header\n",
                big ? "big" : "little", types[t].name, types[t].name, types[t].name, index, index);
            static const int values[] = {1, 2, 3, 4, 5, 66, 2, 1, 0}; /* six coordinates, then the list 1 0 */
            for (int i = 0; i < 9; i++) {
                size_t bytes = i < 6 ? types[t].bytes : index_bytes;
                uint64_t bits = (uint64_t)values[i];
                float f = (float)values[i];
                double d = values[i];
                uint32_t f_bits;
                memcpy(&f_bits, &f, sizeof f);
                if (i < 6 && types[t].real && bytes == 4) bits = f_bits;
                if (i < 6 && types[t].real && bytes == 8) memcpy(&bits, &d, sizeof d);
                for (size_t k = 0; k < bytes; k++)
                    file[n + (big ? bytes - 1 - k : k)] = (unsigned char)(bits >> 8 * k);
                n += bytes;
            }
            CHECK_READS((char *)file, n, "321 6654; 1 0");
            file[n] = 0;
            CHECK_READS((char *)file, n + 1, "321 6654; 1 0"); /* with a byte behind the last element */
        }
}

static void negative_numbers_of_ply(void)
{
    static const char header[] =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty char x\nproperty short y\n"
        "property int z\nend_header\n";
    char file[200];
    memcpy(file, header, sizeof header - 1);
    memcpy(file + sizeof header - 1, "\xff\xfe\xff\xfd\xff\xff\xff", 7);
    CHECK_READS(file, sizeof header - 1 + 7, "-321");
}

static void refuses_broken_ply(void)
{
    static const struct {
        const char *text, *message;
    } broken[] = {
        {"ply\nformat ascii 1.0\nelement vertex 2\n" XYZ "end_header\n1 2 3\n4000 5", "'x' ends in vertex 1 of 2"},
        {"ply\nformat ascii 1.0\nelement vertex 9\n" XYZ "end_header\n1 2 3\n",
         "'x' announces 9 of element 'vertex', but ends before"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "end_header\n1 2 a\n",
         "'x': 'a' in vertex 0 is not a valid number"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "end_header\n1 2 nan\n", "'x': vertex 0 is not finite"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ QUAD "end_header\n1 2 3\n3 0 1 1\n",
         "'x': face 0 names vertex 1 of 1"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ QUAD "end_header\n1 2 3\n3 0 -1 1\n",
         "'x': face 0 names vertex -1"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ QUAD "end_header\n1 2 3\n-3 0 1 2\n",
         "'x': face 0 has a list of negative length"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ QUAD "end_header\n1 2 3\n4000000000 0 1 2\n",
         "'x' ends in face 0 of 1"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ QUAD "end_header\n1 2 3\n3 0 1.5 2\n",
         "'x': a number in face 0 should be an integer but is 1.5"},
        {"ply\nformat ascii 1.0\nelement vertex 0\n" XYZ "end_header\n", "'x' has no vertices"},
        {"ply\nformat ascii 1.0\nend_header\n", "'x' has no vertices"},
        {"ply\nelement vertex 0\n" XYZ "end_header\n", "'x': the PLY header has no format line"},
        {"ply\nformat ascii 2.0\nend_header\n", "'x': the PLY header has no format and version 1.0"},
        {"ply\nformat base64 1.0\nend_header\n", "'x': unknown PLY format 'base64'"},
        {"ply\nformat ascii 1.0\nelement vertex\n", "'x': the PLY header has an element without name and count"},
        {"ply\nformat ascii 1.0\nelement vertex -1\n", "'x': the PLY header has an element without name and count"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float\n",
         "'x': the PLY header has an incomplete property"},
        {"ply\nformat ascii 1.0\nproperty float x\n", "'x': the PLY header has a property before any element"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n", "'x': PLY property 'x' has an unknown type"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float x\n",
         "'x': PLY element 'vertex' has 'x' twice"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
         "'x': its vertices have no x, y and z"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\nproperty int a\nend_header\n1 2 3\n1\n",
         "'x': its faces have no list vertex_indices"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n",
         "'x': the PLY header announces vertices twice"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ
         "element tristrips 1\nproperty list int int vertex_indices\nend_header\n1 2 3\n3 0 -2 0\n",
         "'x': tristrips 0 names vertex -2"},
        {"ply\nformat ascii 1.0\nsomething\n", "'x' ends inside the PLY header"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n", "'x' ends inside the PLY header"},
        {"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n" XYZ "end_header\n",
         "'x' announces 4000000000 of element 'vertex', but ends before"},
        {"ply\nformat binary_little_endian 1.0\nelement vertex 9223372036854775807\n" XYZ "end_header\n",
         "'x' has too many vertices (the limit is 2^32 - 2)"},
        {"ply\nformat binary_little_endian 1.0\nelement vertex 1\n" XYZ
         "element a 9223372036854775807\nelement b 9223372036854775807\n"
         "property double x\nend_header\n123412341234",
         "'x' announces 9223372036854775807 of element 'b', but ends before"},
        {"ply\nformat binary_little_endian 1.0\nelement vertex 1\n" XYZ
         "element face 1\nproperty list uint int vertex_index\n"
         "end_header\n123412341234\377\377\377\377....",
         "'x' ends in face 0 of 1"},
    };
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++)
        CHECK_READS(broken[i].text, strlen(broken[i].text), broken[i].message);
}

static void reads_all_forms_of_off(void)
{
    static const struct {
        const char *text, *want;
    } forms[] = {
        {"OFF\n3 1 3\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n", "0 1 2; 0 1 2"},
        {"OFF 3 1\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2", "0 1 2; 0 1 2"},
        {"OFF3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2", "0 1 2; 0 1 2"},
        {"# first\n\nOFF # second\n# third\n 2 1 0 #\n\n 1 2 3 # x\n4 5 6\n\n2 0 1 255 0 0 # red\n\n# end\n",
         "321 654; 0 1"},
        {"COFF\r\n2 0 0\r\n1 2 3 255 0 0 255\r\n4 5 6 0.5 0.5 0.5 1\r\n", "321 654"},
        {"STCNOFF\n1 0 0\n1 2 3 0 0 1 1 1 1 1 0.5 0.5\n", "321"},
        {"NOFF\r1 0 0\r1 2 3 0 0 1\r", "321"},
        {"OFF\n2 2 0\n1 0 0\n2 0 0\n2 1 0\n2 0 1 0.5 0.5 0.5\n", "1 2; 1 0; 0 1"},
    };
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        CHECK_READS(forms[i].text, strlen(forms[i].text), forms[i].want);
}

static void refuses_broken_off(void)
{
    static const struct {
        const char *text, *message;
    } broken[] = {
        {"OFF\n", "'x' ends where a count is expected"},
        {"OFF\n3\n", "'x' ends where a count is expected"},
        {"OFF\nx 1 0\n", "'x' line 2: a count expected, not 'x'"},
        {"OFF\n3 1 0 7\n", "'x' line 2: end of line expected, not '7'"},
        {"OFF\n-3 1 0\n", "'x' line 2: a count expected, not '-3'"},
        {"OFF\n3 0 0\n0 0 0\n1.00000 0 0\n", "'x' ends before vertex 2 of 3"},
        {"OFF\n1 1 0\n0 0 0\n", "'x' ends before face 0 of 1"},
        {"OFF\n1 0 0\n0 0.0\n", "'x' ends where a finite number is expected"},
        {"OFF\n1 0 0\n0 0 inf\n", "'x' line 3: a finite number expected, not 'inf'"},
        {"OFF\n1 0 0\n0 -1.#IND 0\n", "'x' line 3: a finite number expected, not '-1.#IND'"},
        {"OFF\n2 1 0\n0 0 0\n1 0 0\n2 0 2\n",
         "'x' line 5: the index of a vertex below their count expected, not '2'"},
        {"OFF\n2 1 0\n0 0 0\n1 0 0\n2 0 -1\n",
         "'x' line 5: the index of a vertex expected, not '-1'"},
        {"OFF\n2 1 0\n0 0 0\n1 0 0\n3 0 1  \n", "'x' ends where the index of a vertex is expected"},
        {"OFF\n2 1 0\n0 0 0\n1 0 0\n30 0 1\n", "'x' line 5: face with less than the 30 vertices announced"},
        {"OFF\n0 0 0\n", "'x' has no vertices"},
        {"OFF\n1000000000 1000000000 0\n0 0 0\n",
         "'x' announces 1000000000 vertices and 1000000000 faces, but ends before"},
        {"OFF\n9223372036854775807 9223372036854775807 0\n0 0 0\n",
         "'x' announces 9223372036854775807 vertices and 9223372036854775807 faces, but ends before"},
        {"OFF BINARY\n", "'x' is binary OFF, which is not supported: write it as text"},
        {"4OFF\n1 0 0\n0 0 0 1\n", "'x' is 4OFF, whose vertices do not have 3 coordinates, which is not supported"},
        {"nOFF\n3\n1 0 0\n0 0 0\n", "'x' is nOFF, whose vertices do not have 3 coordinates, which is not supported"},
    };
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++)
        CHECK_READS(broken[i].text, strlen(broken[i].text), broken[i].message);
}

static void tells_formats_apart(void)
{
    static const struct {
        const char *text, *name; /* NULL: none */
    } contents[] = {{"ply\nformat", "ply"},
                    {"ply\r\n", "ply"},
                    {"OFF\n", "off"},
                    {"STCN4nOFF\n", "off"},
                    {"# x\nCOFF\n", "off"},
                    {"v 1 2 3", "obj"},
                    {"# x\n\n  v -1 2 3", "obj"},
                    {"mtllib a\n", "obj"},
                    {"o x\n", "obj"},
                    {"f 1 2 3\n", "obj"},
                    {"vn 0 0 1\n", "obj"},
                    {"# only this\n", NULL},
                    {"hello\n", NULL},
                    {"plywood\n", NULL},
                    {"OFFICE\n", NULL},
                    {"v x\n", NULL},
                    {"", NULL},
                    {"\n\n", NULL},
                    {"very\n", NULL},
                    {"PK\3\4", NULL}};
    for (size_t i = 0; i < sizeof contents / sizeof *contents; i++) {
        const vgi_format *f = vgi_format_by_content((const unsigned char *)contents[i].text,
                                                    strlen(contents[i].text));
        CHECK_TEXT(f ? f->name : "", contents[i].name ? contents[i].name : "");
    }
    CHECK(!vgi_format_by_content((const unsigned char *)"v 1 2 \0 3\n", 10));
    CHECK(vgi_format_by_suffix("a/b.OBJ") == &vgi_format_obj && vgi_format_by_suffix("x.ply") == &vgi_format_ply);
    CHECK(vgi_format_by_suffix("x.off") == &vgi_format_off && !vgi_format_by_suffix("x.fbx") &&
          !vgi_format_by_suffix("obj"));
    for (size_t i = 0; i < FORMATS; i++) {
        const vgi_format *f = vgi_format_by_name(format_names[i], strlen(format_names[i]));
        CHECK(f && !strcmp(f->name, format_names[i]));
    }
    CHECK(vgi_format_by_name("ply-ascii", 3) == &vgi_format_ply && !vgi_format_by_name("OBJ", 3) &&
          !vgi_format_by_name("", 0));
}

static void says_what_is_no_mesh(void)
{
    vg_model m;
    vg_err e;
    CHECK(vg_model_read(&m, "", 0, NULL, "a.obj", &e) == VG_ETRUNC);
    CHECK_TEXT(e.message, "'a.obj' is empty");
    CHECK(vg_model_read(&m, "hello\n", 6, NULL, "a.txt", &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "'a.txt' is not a mesh file (read: OBJ, PLY, OFF, STL)");
    CHECK(vg_model_read(&m, "hello\n", 6, NULL, "a.obj", &e) == VG_EINPUT); /* told by the name */
    CHECK_TEXT(e.message, "'a.obj' has no vertices (no line 'v x y z')");
    CHECK(vg_model_read(&m, "hello\n", 6, "ply", "a", &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "'a' does not start like PLY");
    CHECK(vg_model_read(&m, "v 0 0 0\n", 8, NULL, "wrong.ply", &e) ==
          VG_OK); /* the content decides before the name */
    vg_model_clear(&m);
    CHECK(vg_model_read(&m, "v 0 0 0\n", 8, "3ds", "a", &e) == VG_EARG);
    CHECK(vg_model_read(&m, "v 0 0 x\n", 8, NULL, "a.obj", NULL) == VG_EINPUT); /* nobody wants to know why */
    CHECK(!m.vertices && !m.mesh.start);
    CHECK(vgi_model_read(&m, "v 0 0\n", 6, NULL, "b.obj", "'b.obj' in 'a.zip'", &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "'b.obj' in 'a.zip' line 1: vertex with 2 numbers (expected x y z)");
}

/* Damaged bytes: refused with a message, or read as some valid mesh. */
static void check_damaged(const unsigned char *data, size_t n, const char *format)
{
    vg_model m;
    vg_err e;
    int result = read_bytes(&m, data, n, format, &e);
    if (result == VG_OK) {
        CHECK(m.mesh.nv > 0 && vg_mesh_check(&m.mesh, "it", &e) == VG_OK && vgi_finite(m.vertices, 3 * m.mesh.nv));
        vg_model_clear(&m);
    } else {
        CHECK((result == VG_EINPUT || result == VG_ETRUNC) && e.code == result && e.message[0]);
        CHECK(!m.vertices && !m.mesh.vert);
    }
}

static void survives_every_damage(void)
{
    for (size_t i = 0; i < FORMATS; i++) {
        vg_bytes out = {0};
        const char *format = !strncmp(format_names[i], "ply", 3) ? "ply" : format_names[i];
        CHECK(write_mixed(&out, format_names[i], true));
        for (size_t n = 0; n < out.size; n++) check_damaged(out.data, n, format);
        for (size_t at = 0; at < out.size; at++) {
            unsigned char kept = out.data[at];
            for (unsigned value = 0; value < 256; value += test_bad ? 256 : 1) {
                out.data[at] = (unsigned char)value;
                check_damaged(out.data, out.size, format);
            }
            out.data[at] = kept;
        }
        vg_bytes_clear(&out);
    }
}

/* Every prefix of a binary file, which has no other reading, is refused. */
static void refuses_every_prefix_of_binary(void)
{
    vg_bytes out = {0};
    CHECK(write_mixed(&out, "ply", true));
    for (size_t n = 1; n < out.size; n++) {
        vg_model m;
        vg_err e;
        int result = read_bytes(&m, out.data, n, "ply", &e);
        CHECK(result == VG_ETRUNC || (n < 5 && result == VG_EINPUT));
        if (result == VG_OK) vg_model_clear(&m);
    }
    vg_bytes_clear(&out);
}

static void ignores_the_locale(void)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8",  "fr_FR.UTF-8",
                                        "fr_FR.utf8",  "ru_RU.UTF-8", "de_DE"};
    bool found = false;
    for (size_t i = 0; i < sizeof names / sizeof *names && !found; i++) found = setlocale(LC_ALL, names[i]) != NULL;
    if (!found) printf("# no locale with a decimal comma here\n");
    there_and_back_exactly();
    obj_text_is_as_promised();
    setlocale(LC_ALL, "C");
}

TESTS({"there and back exactly", there_and_back_exactly},
      {"there and back in single precision", there_and_back_in_single_precision},
      {"written text is as promised", obj_text_is_as_promised},
      {"refuses to write what does not fit", refuses_to_write_what_does_not_fit}, {"large faces", large_faces},
      {"segments of PLY come last or stay", segments_of_ply_come_last_or_stay},
      {"reads all forms of OBJ", reads_all_forms_of_obj},
      {"keeps labels and texture of OBJ", keeps_labels_and_texture_of_obj},
      {"refuses broken OBJ", refuses_broken_obj}, {"reads all forms of PLY", reads_all_forms_of_ply},
      {"reads all types of PLY", reads_all_types_of_ply}, {"negative numbers of PLY", negative_numbers_of_ply},
      {"refuses broken PLY", refuses_broken_ply}, {"reads all forms of OFF", reads_all_forms_of_off},
      {"refuses broken OFF", refuses_broken_off}, {"tells formats apart", tells_formats_apart},
      {"says what is no mesh", says_what_is_no_mesh}, {"survives every damage", survives_every_damage},
      {"refuses every prefix of binary", refuses_every_prefix_of_binary}, {"ignores the locale", ignores_the_locale})
