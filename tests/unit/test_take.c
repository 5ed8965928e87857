/* test_take.c: readers take what others take and refuse what is wrong: what is not used cannot stop a load, what is used
 * must be right, what is left out is counted in one note. Small files written here, each in every format that can hold
 * it. The right values are worked out by hand.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"

#include "io/smoothing.h"
#include "numeric/face.h"

static int read_bytes(vg_model *m, const void *data, size_t n, const char *name, char message[480])
{
    vg_err e = {0};
    int r = vg_model_read(m, data, n, NULL, name, &e);
    memcpy(message, e.message, 480);
    return r;
}

/* "0 1 2; 0 2 3": the faces; or why there are none. */
static const char *faces_of(const char *name, const void *data, size_t n, char note[400])
{
    static char text[600];
    char message[480];
    vg_model m;
    size_t at = 0;
    *text = *note = 0;
    if (read_bytes(&m, data, n, name, message) < 0) return snprintf(text, sizeof text, "%s", message), text;
    for (size_t f = 0; f < m.mesh.nf; f++)
        for (uint32_t c = m.mesh.start[f]; c < m.mesh.start[f + 1] && at < 500; c++)
            at += (size_t)snprintf(text + at, sizeof text - at, "%s%u", c > m.mesh.start[f] ? " " : f ? "; " : "",
                                   m.mesh.vert[c]);
    snprintf(note, 400, "%s", m.note.text);
    vg_model_clear(&m);
    return text;
}

typedef struct taken {
    const char *name, *text, *faces, *note;
} taken;

static void check_all(const taken *all, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        char note[400];
        CHECK_TEXT(faces_of(all[i].name, all[i].text, strlen(all[i].text), note), all[i].faces);
        if (all[i].note) {
            CHECK_TEXT(note, all[i].note);
        }
    }
}
#define CHECK_ALL(all) check_all(all, sizeof all / sizeof *all)

#define BENT "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
#define OBJ4 "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
#define OFF4(faces) "OFF\n4 " faces " 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
#define PLY4(faces) \
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face " faces \
    "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"

static void degenerate_faces_go_in_every_format_alike(void)
{
    static const char one[] = "left out 1 face that names a vertex twice or has fewer than 2 corners";
    static const char two[] = "left out 2 faces that name a vertex twice or have fewer than 2 corners";
    static const char twice[] = "1 face names a vertex twice in a row, which is kept once";
    static const taken all[] = {
        {"a.obj", OBJ4 "f 1 2 3 4\nf 1 2 2\n", "0 1 2 3", one},
        {"a.ply", PLY4("2") "4 0 1 2 3\n3 0 1 1\n", "0 1 2 3", one},
        {"a.off", OFF4("2") "4 0 1 2 3\n3 0 1 1\n", "0 1 2 3", one},
        {"a.obj", OBJ4 "f\nf 1 2 3 4\nf 2\n", "0 1 2 3", two},
        {"a.ply", PLY4("3") "0\n4 0 1 2 3\n1 2\n", "0 1 2 3", two},
        {"a.off", OFF4("3") "0\n4 0 1 2 3\n1 2\n", "0 1 2 3", two},
        {"a.obj", OBJ4 "l 1 1\nl 3\nf 1 2 3 4\n", "0 1 2 3", two},
        {"a.obj", OBJ4 "l 1 2 2 3\n", "0 1; 1 2", one},
        /* a quad with a corner twice in a row is the triangle that it looks like */
        {"a.obj", OBJ4 "f 1 2 3 3\n", "0 1 2", twice},
        {"a.ply", PLY4("1") "4 0 1 2 0\n", "0 1 2", twice},
        {"a.off", OFF4("1") "5 0 0 1 2 2\n", "0 1 2", twice},
        /* there and back along an edge is no face */
        {"a.obj", OBJ4 "f 1 2 1 3\nf 1 2 3 4\n", "0 1 2 3", one},
        {"a.ply", PLY4("2") "4 0 1 2 3\n4 3 1 3 1\n", "0 1 2 3", one},
        /* nothing but such: points */
        {"a.obj", OBJ4 "f 1 1 1\n", "", one},
        /* a vertex that does not exist is no accident */
        {"a.obj", OBJ4 "f 1 2 2\nf 1 2 9\n", "'a.obj' line 6: vertex 9 is out of range, there are 4", NULL},
        {"a.ply", PLY4("2") "3 0 1 1\n3 0 1 9\n", "'a.ply': face 0 names a vertex twice", NULL},
    };
    CHECK_ALL(all);
}

static void labels_and_texture_move_along(void)
{
    static const char text[] = OBJ4 "vt 0 0\nvt 1 0\nvt 1 1\ng one\nf 1/1 1/1 2/2\ng two\nf 1/1 2/2 3/3 3/3\ng three\n"
                                    "f 2/3 3/2 4/1\n";
    vg_model m;
    char message[480];
    CHECK(read_bytes(&m, text, strlen(text), "a.obj", message) == VG_OK);
    static const uint32_t tex[] = {0, 1, 2, 2, 1, 0};
    CHECK(m.mesh.nf == 2 && vg_mesh_corners(&m.mesh) == 6 && !memcmp(m.attributes.corner_tex, tex, sizeof tex));
    CHECK(m.attributes.nlabels == 3 && m.attributes.labels[0].face == 0 && m.attributes.labels[1].face == 0 &&
          m.attributes.labels[2].face == 1);
    vg_model_clear(&m);
}

/* Twice the area that the faces cover, seen from +z. */
static double area(const vg_model *m)
{
    double sum = 0;
    for (size_t f = 0; f < m->mesh.nf; f++) {
        double n[3];
        vgi_face_area(m->vertices, m->mesh.vert + m->mesh.start[f], m->mesh.start[f + 1] - m->mesh.start[f], n);
        sum += 2 * n[2];
    }
    return sum;
}

/* A square of 4 x 4 with a hole of 2 x 2; one with two holes; one whose hole is bridged at two different corners; and a
 * hole in a face that is turned over. */
static void holes_are_cut_open(void)
{
    static const struct {
        const char *text;
        double twice_area;
    } all[] = {
        {"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n", 24},
        {"v 0 0 0\nv 8 0 0\nv 8 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nv 5 1 0\nv 5 3 0\nv 7 3 0\nv 7 1 0\n"
         "f 1 2 9 10 11 12 9 2 3 4 1 5 6 7 8 5\n", 48},
        {"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 5 8 7 6 5 1 4 3 2\n", -24},
        {"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 2 3 0\nv 3 1 0\nf 3 4 1 2 3 7 5 6 7\n", 28},
    };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        vg_model m;
        char message[480];
        CHECK(read_bytes(&m, all[i].text, strlen(all[i].text), "a.obj", message) == VG_OK);
        CHECK_TEXT(message, "");
        CHECK(vg_mesh_check(&m.mesh, "it", NULL) == VG_OK && m.mesh.nf > 1);
        CHECK_NEAR(area(&m), all[i].twice_area, 1e-12);
        CHECK(strstr(m.note.text, "around a hole"));
        vg_model_clear(&m);
    }
}

static void bad_texture_loses_itself(void)
{
    static const taken all[] = {
        {"a.obj", OBJ4 "vt 0.1 0.2\nvt nan nan\nvt 0.3 0.4\nf 1/1 2/2 3/3\n", "0 1 2",
         "left out 1 texture coordinates that are not finite numbers"},
        {"a.obj", OBJ4 "vt -1.#IND 0\nvt 1 2 3 4\nvt x\nf 1/1 2/2 3/3\n", "0 1 2",
         "left out 3 texture coordinates that are not finite numbers"},
        {"a.obj", OBJ4 "f 1/1 2/2 3/3\n", "0 1 2", "3 corners name texture coordinates that are not there"},
        {"a.obj", OBJ4 "vt 0 0\nf 1/-1 2/-2 3/0\n", "0 1 2", "2 corners name texture coordinates that are not there"},
        {"a.obj", OBJ4 "vn nan nan nan\nvn -1.#IND 0 0\nf 1//1 2//2 3//99\n", "0 1 2", ""},
        {"a.obj", "v 0 0 0 1.#QNAN 0 0\nv 1 0 0 red\nv 1 1 0\nf 1 2 3\n", "0 1 2",
         "left out 1 colours of vertices that are not numbers from 0 to 1"},
    };
    CHECK_ALL(all);
    vg_model m;
    char message[480];
    CHECK(read_bytes(&m, all[0].text, strlen(all[0].text), "a.obj", message) == VG_OK);
    static const uint32_t corner[] = {0, UINT32_MAX, 1};
    static const double tex[] = {0.1, 0.2, 0.3, 0.4};
    CHECK(m.attributes.ntex == 2 && !memcmp(m.attributes.corner_tex, corner, sizeof corner));
    CHECK(m.attributes.tex_dim == 2 && !memcmp(m.attributes.tex, tex, sizeof tex));
    vg_model_clear(&m);
}

static void off_is_a_sequence_of_words(void)
{
    static const taken all[] = {
        {"a.off", OFF4("1") "4 0 1\n2 3\n", "0 1 2 3", ""},
        {"a.off", "OFF 4 1 0 0 0 0 1 0 0 1 1 0 0 1 0 4 0 1 2 3", "0 1 2 3", ""},
        {"a.off", "OFF\n4\n1\n0\n0 0\n0\n1 0 0 1 1 0\n0 1 0\n4\n0\n1\n2\n3\n", "0 1 2 3", ""},
        {"a.off", "OFF\n4 1 0\n0 0 0 1 0 0\n1 1 0 0 1 0\n4 0 1 2 3\n", "0 1 2 3", ""},
        {"a.off", "OFF # a\n4 1 0 # b\n0 0 # c\n0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 # d\n2 3 0.5 0.5 0.5\n", "0 1 2 3",
         "left out the colours of 1 faces"},
        {"a.off", OFF4("1") "4 0 1 2 3\n3 0 1 2\n", "0 1 2 3", "left out data after the last face, from line 8 on"},
        {"a.off", "OFF\n2 0 0\n0 0 0\n1 -1.#IND 0\n", "'a.off' line 4: a finite number expected, not '-1.#IND'", NULL},
        {"a.off", "OFF\n2 0 0\n0 0 0\n1 1.#INF 0\n", "'a.off' line 4: a finite number expected, not '1.#INF'", NULL},
    };
    CHECK_ALL(all);
}

#define PLY_HEAD(vertices) "ply\nformat ascii 1.0\nelement vertex " vertices "\nproperty float x\nproperty float y\nproperty float z\n"
#define FIVE "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 2 0\n"

static void ply_takes_strips_counts_and_old_headers(void)
{
    static const taken all[] = {
        {"a.ply", PLY_HEAD("5") "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" FIVE
                  "8 0 1 3 -1 1 2 3 -1\n", "0 1 3; 1 2 3", ""},
        {"a.ply", PLY_HEAD("5") "element tristrips 2\nproperty list uchar int vertex_indices\nend_header\n" FIVE
                  "4 0 1 2 3\n3 2 3 4\n", "0 1 2; 2 1 3; 2 3 4", ""},
        /* a strip that is carried on over triangles of no area, every other one the other way round all the same */
        {"a.ply", PLY_HEAD("5") "element tristrips 1\nproperty list uchar int vertex_indices\nend_header\n" FIVE
                  "7 0 1 2 2 3 3 4\n", "0 1 2", ""},
        {"a.ply", PLY_HEAD("5") "element face 1\nproperty list float float vertex_indices\nend_header\n" FIVE
                  "3.0 0 1.0 2\n", "0 1 2", ""},
        {"a.ply", PLY_HEAD("5") "element face 1\nproperty list double ushort vertex_index\nend_header\n" FIVE
                  "4 0 1 2 3\n", "0 1 2 3", ""},
        {"a.ply", PLY_HEAD("5") "element face 1\nproperty list float int vertex_index\nend_header\n" FIVE "3.5 0 1 2\n",
         "'a.ply': a number in face 0 should be an integer but is 3.5", NULL},
        {"a.ply", "ply\nformat ascii 1.0\ncomment Created by Blender3D 2.42, source file: a\nb.blend\n"
                  "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                  "property list uchar uint vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "0 1 2",
         "left out 1 meaningless lines of the PLY header"},
        {"a.ply", PLY_HEAD("3") "element face 0\nproperty list uchar int vertex_indices\nend_header\n"
                  "\xef\xbb\xbf" "0 0 0\n1 0 0\n0 1 0\nmore\n", "", "left out 5 bytes after the last element"},
    };
    CHECK_ALL(all);
}

static void stl_passes_over_what_it_does_not_need(void)
{
    static const taken all[] = {
        {"a.stl", "solid x\nfacet normal -1.#IND -1.#IND -1.#IND\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                  "endloop\nendfacet\nendsolid\n", "0 1 2", ""},
        {"a.stl", "solid x\nfacet normal 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
                  "endsolid\n", "0 1 2", ""},
        {"a.stl", "solid x\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 1.#INF\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
         "'a.stl', line 5: '1.#INF' where 'a number' is expected", NULL},
    };
    CHECK_ALL(all);
}

/* A square in UTF-16 of either byte order, with the mark of UTF-8, and a name beyond ASCII. */
static void marks_of_text_are_no_content(void)
{
    static const char *const texts[] = {"# caf\xc3\xa9 \xf0\x9f\x90\x8e\n" OBJ4 "f 1 2 3 4\n", OFF4("1") "4 0 1 2 3\n",
                                        PLY4("1") "4 0 1 2 3\n"};
    for (size_t t = 0; t < 3; t++)
        for (int how = 0; how < 3; how++) {
            unsigned char to[1200] = {0};
            size_t n = 0;
            char note[400];
            if (how == 0) memcpy(to, "\xef\xbb\xbf", n = 3), memcpy(to + 3, texts[t], strlen(texts[t]));
            if (how == 0) n += strlen(texts[t]);
            if (how) to[how == 1 ? 0 : 1] = 0xff, to[how == 1 ? 1 : 0] = 0xfe, n = 2;
            for (const unsigned char *p = (const unsigned char *)texts[t]; how && *p;) {
                uint32_t c = *p++;
                if (c == 0xc3) c = 0xe9, p++; /* the letters of the comment */
                else if (c == 0xf0) p += 3, to[n + (how == 1)] = 0xd8, to[n + (how == 2)] = 0x3d, n += 2, c = 0xdc0e;
                to[n + (how == 2)] = (unsigned char)c, to[n + (how == 1)] = (unsigned char)(c >> 8), n += 2;
            }
            CHECK_TEXT(faces_of("a", to, n, note), "0 1 2 3");
        }
}

static void lines_join_over_blanks(void)
{
    static const taken all[] = {
        {"a.obj", OBJ4 "f 1 2 \\ \n3 4\n", "0 1 2 3", ""},
        {"a.obj", "v 0 0 \\\t \r\n 0\r\nv 1 0 0\r\nv 1 1 0\r\nf 1 2 \\\r\n3\r\n", "0 1 2", ""},
        {"a.obj", OBJ4 "g a\\ \nf 1 2 3\n", "0 1 2", ""}, /* a name may end so */
    };
    CHECK_ALL(all);
}

/* The smoothing groups that a text gets by its normals: "s GROUP" before faces. Read as programs do: the mesh, then these. */
static const char *groups_of(const char *data)
{
    static char text[200];
    vg_model m;
    vg_err e = {0};
    size_t at = 0;
    *text = 0;
    if (vg_model_read(&m, data, strlen(data), "obj", "a.obj", &e) < 0) return "not read";
    vg_body b = {.mesh = m.mesh, .attributes = m.attributes, .reference = m.vertices};
    CHECK(vgi_obj_take_smoothing(&b, data, strlen(data), &e) == VG_OK);
    for (size_t i = 0; i < b.attributes.nlabels; i++)
        at += (size_t)snprintf(text + at, sizeof text - at, "%s%zu: s %s", i ? ", " : "", b.attributes.labels[i].face,
                               b.attributes.labels[i].text);
    m.attributes = b.attributes;
    vg_model_clear(&m);
    return text;
}

/* Two triangles at a right angle, sharp by the angle. One normal for both makes them smooth, as does one that is 0.5 degrees off
 * (files round); one that is 2 degrees off, one that is missing, malformed or 0 does not. */
static void normals_make_groups(void)
{
    static const char *const all[][2] = {
        {BENT "vn 0 1 1\nf 1//1 2//1 3//1\nf 2//1 1//1 4//1\n", "0: s 1"},
        {BENT "vn 0 1 1\nvn 0 1 1.0176\nf 1//1 2//1 3//1\nf 2//2 1//2 4//2\n", "0: s 1"},
        {BENT "vn 0 1 1\nvn 0 1 1.0725\nf 1//1 2//1 3//1\nf 2//2 1//2 4//2\n", ""},
        {BENT "vn 0 1 1\nf 1//1 2//1 3//1\nf 2//1 1//1 4\n", ""},
        {BENT "vn 0 1 1\nf 1//1 2//1 3//1\nf 2//1 1//1 4//2\n", ""},
        {BENT "vn 0 1 1\nvn 0 1\nf 1//1 2//1 3//1\nf 2//1 1//1 4//2\n", ""},
        {BENT "vn 0 0 0\nf 1//1 2//1 3//1\nf 2//1 1//1 4//1\n", ""},
        /* counted back; with texture; lines, which have none; joined lines; lines that end in CR */
        {BENT "vn 1 0 0\nvn 0 1 1\nf 1//-1 2//-1 3//-1\nvn 0 2 2\nf 2//-1 1//-2 4//3\n", "0: s 1"},
        {BENT "vn 0 1 1\nvt 0 0\nl 1 2 3 4\nf 1/1/1 2/1/1 3/1/1\nf 2/1/1 1//1 4//1\n", "0: s off, 3: s 1"},
        {BENT "vn 0 \\\n1 1\nf 1//1 \\\n2//1 3//1\nf 2//1 1//1 4//1\n", "0: s 1"},
        {"v 0 0 0\rv 1 0 0\rv 0 1 0\rv 0 0 1\rvn 0 1 1\rf 1//1 2//1 3//1\rf 2//1 1//1 4//1\r", "0: s 1"},
    };
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) CHECK_TEXT(groups_of(all[i][0]), all[i][1]);
}

#define T(name) {#name, name}
TESTS(T(degenerate_faces_go_in_every_format_alike), T(labels_and_texture_move_along), T(holes_are_cut_open),
      T(bad_texture_loses_itself), T(off_is_a_sequence_of_words), T(ply_takes_strips_counts_and_old_headers),
      T(stl_passes_over_what_it_does_not_need), T(marks_of_text_are_no_content), T(lines_join_over_blanks),
      T(normals_make_groups))
