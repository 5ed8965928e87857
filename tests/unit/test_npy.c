/* test_npy.c: headers of NumPy arrays in all their spellings, orders of bytes and axes, and an NPZ there and back.
 * The arrays are made here by hand; what NumPy itself makes is read in formats.bats where it is installed.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "play.h"
#include "io/npy.h"

/* An array with this header and the n bytes of its elements. version 2 and 3 have a longer length. */
static vg_bytes make(int version, const char *header, const void *elements, size_t n)
{
    vg_bytes b = {0};
    unsigned char front[12] = "\x93NUMPY";
    size_t length = strlen(header);
    front[6] = (unsigned char)version;
    vgi_put32(front + 8, (uint32_t)length);
    CHECK(vgi_bytes_append(&b, front, version == 1 ? 10 : 12, NULL) == VG_OK);
    CHECK(vgi_bytes_append(&b, header, length, NULL) == VG_OK && vgi_bytes_append(&b, elements, n, NULL) == VG_OK);
    return b;
}

/* Element i of n is i + 0.25, in this type. */
static vg_bytes numbers(size_t n, size_t item, bool big)
{
    vg_bytes b = {0};
    for (size_t i = 0; i < n; i++) {
        unsigned char p[8], q[8];
        float f = (float)i + 0.25f;
        double d = (double)i + 0.25;
        uint64_t bits = 0;
        if (item == 4) memcpy(&bits, &f, 4);
        else memcpy(&bits, &d, 8);
        vgi_put64(p, bits);
        for (size_t k = 0; k < item; k++) q[k] = p[big ? item - 1 - k : k];
        CHECK(vgi_bytes_append(&b, q, item, NULL) == VG_OK);
    }
    return b;
}

static void reads_all_spellings(void)
{
    const struct { int version; const char *header; size_t item; bool big; } cases[] = {
        {1, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3), }     \n", 4, false},
        {1, "{\"shape\":(2,3,3),\"descr\":\"<f8\",\"fortran_order\":False}", 8, false},
        {2, "{'descr': '>f4', 'fortran_order': False, 'shape': (2, 3, 3)}\n", 4, true},
        {3, "{'descr': '>f8', 'fortran_order': False, 'shape': (2L, 3L, 3L), }\n", 8, true}};
    for (size_t i = 0; i < 4; i++) {
        vg_bytes x = numbers(18, cases[i].item, cases[i].big),
                 b = make(cases[i].version, cases[i].header, x.data, x.size);
        played p = play(&vgi_sequence_npy, b.data, b.size);
        CHECK(p.result == 0 && p.frames == 2 && p.h.count == 3 && !p.timed);
        CHECK(p.h.precision == (cases[i].item == 4 ? VG_F32 : VG_F64));
        for (int k = 0; k < 18; k++) CHECK(p.values[k] == k + 0.25);
        played_clear(&p);
        check_prefixes(&vgi_sequence_npy, &b);
        vg_bytes_clear(&b);
        vg_bytes_clear(&x);
    }
}

/* From version 2 on a header may be longer than 65535 bytes; beyond 65536 there is nothing that we would read. */
static void reads_long_headers(void)
{
    static const char said[] = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3)}";
    vg_bytes x = numbers(3, 8, false);
    for (size_t n = 65535; n <= 65537; n++) {
        char *header = malloc(n + 1);
        memset(header, ' ', n);
        header[n] = 0;
        memcpy(header, said, sizeof said - 1);
        vg_bytes b = make(2, header, x.data, x.size);
        played p = play(&vgi_sequence_npy, b.data, b.size);
        CHECK(n <= 65536 ? p.result == 0 && p.frames == 1 && p.values[2] == 2.25 : p.result == VG_EINPUT);
        played_clear(&p);
        vg_bytes_clear(&b);
        free(header);
    }
    vg_bytes_clear(&x);
}

static void reads_fortran_order(void)
{
    vg_bytes x = numbers(18, 8, false);
    vg_bytes b = make(1, "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3, 3), }\n", x.data, x.size);
    played p = play(&vgi_sequence_npy, b.data, b.size);
    CHECK(p.result == 0 && p.frames == 2);
    for (int t = 0; t < 2; t++)
        for (int v = 0; v < 3; v++)
            for (int k = 0; k < 3; k++) CHECK(p.values[9 * t + 3 * v + k] == t + 2 * v + 6 * k + 0.25);
    played_clear(&p);
    check_prefixes(&vgi_sequence_npy, &b);
    vg_bytes_clear(&b);
    b = make(1, "{'descr': '<f8', 'fortran_order': True, 'shape': (6, 3), }\n", x.data, x.size);
    p = play(&vgi_sequence_npy, b.data, b.size); /* one frame */
    CHECK(p.result == 0 && p.frames == 1 && p.h.count == 6 && p.values[3] == 1.25 && p.values[1] == 6.25);
    played_clear(&p);
    vg_bytes_clear(&b);
    vg_bytes_clear(&x);
}

static void refuses_other_arrays(void)
{
    static const char *const bad[] = {
        "",
        "{",
        "{}",
        "{'descr': '<f4', 'fortran_order': False}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': 3}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3)} x",
        "{'descr': '<f4', 'fortran_order': 0, 'shape': (2, 3, 3)}",
        "{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-2, 3, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3}",
        "{'descr': '<f4', 'fortran_order': False 'shape': (2, 3, 3)}",
        "{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (2, 3, 3)}",
        "{'descr': '|O', 'fortran_order': False, 'shape': (2, 3, 3)}",
        "{'descr': '<i4', 'fortran_order': False, 'shape': (2, 3, 3)}",
        "{'descr': '<f2', 'fortran_order': False, 'shape': (2, 3, 3)}",
        "{'descr': '<f0', 'fortran_order': False, 'shape': (2, 3, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (18,)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': ()}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 2, 3, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 0, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (9223372036854775807, 3, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 4294967295, 3)}"};
    vg_bytes x = numbers(18, 4, false);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        vg_bytes b = make(1, bad[i], x.data, x.size);
        int r = refused(&vgi_sequence_npy, b.data, b.size);
        CHECK(r == VG_EINPUT);
        if (r != VG_EINPUT) printf("# %s: %d\n", bad[i], r);
        vg_bytes_clear(&b);
    }
    /* counts that are not there: memory must not follow them */
    vg_bytes b = make(1, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 4294967290, 3)}", x.data, x.size);
    CHECK(refused(&vgi_sequence_npy, b.data, b.size) == VG_ETRUNC);
    vg_bytes_clear(&b);
    b = make(1, "{'descr': '<f4', 'fortran_order': True, 'shape': (1000000000, 1000, 3)}", x.data, x.size);
    CHECK(refused(&vgi_sequence_npy, b.data, b.size) == VG_ETRUNC);
    vg_bytes_clear(&b);
    b = make(4, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3)}", x.data, x.size);
    CHECK(refused(&vgi_sequence_npy, b.data, b.size) == VG_EINPUT);
    vg_bytes_clear(&b);
    vgi_put32(x.data + 4 * 7, 0x7fc00000u);
    b = make(1, "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3)}", x.data, x.size);
    CHECK(refused(&vgi_sequence_npy, b.data, b.size) == VG_EINPUT);
    CHECK_TEXT(message, "'x': point 2 of frame 1 is not finite");
    vg_bytes_clear(&b);
    vg_bytes_clear(&x);
}

static uint32_t start[] = {0, 3, 7}, vert[] = {0, 1, 2, 0, 2, 3, 1}, selected[] = {1}, anchors[] = {1, 3},
                links[] = {0, 3};
static double reference[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};

static vg_head make_head(vg_kind kind)
{
    vg_head h = {.body.mesh = {4, 2, start, vert},
                 .body.reference = reference,
                 .body.reference_name = (char *)"Ruhe \xc3\xa4",
                 .kind = kind,
                 .precision = VG_F64,
                 .count = 4};
    if (kind == VG_VERTICES) return h;
    h.selection.chosen = true, h.selection.n = 1, h.selection.faces = selected;
    h.links.chosen = true, h.links.n = 1, h.links.pairs = links;
    h.nanchors = 2, h.anchors = anchors;
    h.count = 6; /* a face of four and a link */
    return h;
}

static double values[2][24];
static double places[] = {1, 2, 3, 4, 5, 6};

static void make_frames(vg_frame f[2])
{
    static char *const names[] = {(char *)"sm\xc3\xaele \xf0\x9f\x90\x8e", (char *)"b"};
    static vg_channel positions = {.name = (char *)"anchors", .unit = (char *)"", .element = VG_OF_ANCHOR,
                                 .element_name = (char *)"anchor", .width = 3, .count = sizeof places / 24,
                                 .numbers = places};
    for (int i = 0; i < 48; i++) values[i / 24][i % 24] = i / 3.0 + 0.125;
    for (int i = 0; i < 2; i++)
        f[i] = (vg_frame){.name = names[i],
                          .has_time = true,
                          .time = i + 0.5,
                          .root = {i, 2, 3},
                          .nchannels = 1,
                          .channels = &positions,
                          .values = values[i]};
}

static void npz_there_and_back(void)
{
    static const vg_kind kinds[] = {VG_VERTICES, VG_VECTORS, VG_DEFORMATIONS};
    for (int i = 0; i < 3; i++) {
        vg_head h = make_head(kinds[i]);
        vg_frame frames[2];
        int r;
        char warning[200];
        make_frames(frames);
        vg_bytes b = record(&vgi_sequence_npz, &h, frames, 2, true, &r, warning);
        CHECK(r == VG_OK && vgi_sequence_npz.sniff(b.data, b.size) && !*warning);
        played p = play(&vgi_sequence_npz, b.data, b.size);
        CHECK(p.result == 0);
        if (p.result < 0) printf("# %s\n", p.e.message);
        CHECK(p.frames == 2 && p.h.kind == kinds[i] && p.h.count == h.count && p.times[1] == 1.5 && p.timed);
        CHECK_TEXT(p.names, "sm\xc3\xaele \xf0\x9f\x90\x8e b ");
        CHECK(p.h.body.reference_name && !strcmp(p.h.body.reference_name, h.body.reference_name));
        CHECK(vg_mesh_same(&h.body.mesh, "", &p.h.body.mesh, "", NULL) == VG_OK);
        CHECK(p.h.body.reference && !memcmp(p.h.body.reference, reference, sizeof reference));
        size_t n = h.count * vg_head_width(&h);
        CHECK(p.n == 2 * n && !memcmp(p.values, values[0], n * 8) && !memcmp(p.values + n, values[1], n * 8));
        CHECK(p.h.selection.n == h.selection.n && p.h.links.n == h.links.n && p.h.nanchors == h.nanchors);
        played_clear(&p);
        vg_bytes_clear(&b);
    }
}

static void npz_refuses_damage(void)
{
    vg_head h = make_head(VG_VECTORS);
    vg_frame frames[2];
    int r;
    make_frames(frames);
    vg_bytes b = record(&vgi_sequence_npz, &h, frames, 2, false, &r, NULL);
    CHECK(r == VG_OK);
    for (size_t n = 0; n < b.size; n += 13) CHECK(refused(&vgi_sequence_npz, b.data, n) < 0 && message[0]);
    h.selection.faces = NULL, h.selection.n = 0; /* no longer the graph that the vectors belong to */
    vg_bytes_clear(&b);
    h.count = 8;
    b = record(&vgi_sequence_npz, &h, frames, 2, false, &r, NULL);
    CHECK(r == VG_OK);
    if (r < 0) printf("# %s\n", message);
    CHECK(refused(&vgi_sequence_npz, b.data, b.size) == VG_EINPUT);
    CHECK_TEXT(message, "array 'vectors' in 'x' has 8 elements where the vector graph has 2 corners");
    vg_bytes_clear(&b);
}

/* A zip of one array. */
static int refused_alone(const char *name, const char *header, const void *data, size_t n)
{
    vg_bytes a = make(1, header, data, n), b = {0};
    vgi_packer *p = NULL;
    int fd = memfd_create("zip", MFD_CLOEXEC);
    CHECK(vgi_packer_open_plain(&p, fd, "zip", NULL) == VG_OK &&
          vgi_packer_add(p, name, a.data, a.size, NULL) == VG_OK && vgi_packer_end(p, NULL) == VG_OK);
    vgi_packer_close(&p);
    CHECK(vgi_bytes_reserve(&b, 10000, NULL) == VG_OK);
    b.size = (size_t)pread(fd, b.data, 10000, 0);
    close(fd);
    int r = refused(&vgi_sequence_npz, b.data, b.size);
    vg_bytes_clear(&a);
    vg_bytes_clear(&b);
    return r;
}

static void npz_refuses_what_is_missing(void)
{
    vg_bytes x = numbers(24, 4, false);
    CHECK(refused_alone("other.npy", "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4)}", x.data,
                        x.size) == VG_EINPUT);
    CHECK_TEXT(message, "'x' has no array of positions (called positions, vertices, verts, v or points), vectors, "
                        "deformations or features; it has: other (2, 3, 4)");
    CHECK(refused_alone("vectors.npy", "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 2, 3)}", x.data,
                        x.size) == VG_EINPUT);
    CHECK_TEXT(message, "'x' has an array 'vectors', but none called 'reference'");
    CHECK(refused_alone("positions.npy", "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 2, 4)}", x.data,
                        x.size) == VG_EINPUT);
    CHECK(refused_alone("positions.npy", "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 2, 3)}", x.data,
                        92) == VG_ETRUNC);
    CHECK(refused_alone("positions.npy", "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 2, 3)}", x.data,
                        96) == VG_EINPUT);
    CHECK_TEXT(message, "array 'positions' in 'x' has data after its elements");
    CHECK(refused_alone("positions.npy", "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 2, 3)}", x.data,
                        96) == 0);
    vg_bytes_clear(&x);
}

TESTS({"reads all spellings", reads_all_spellings}, {"reads Fortran order", reads_fortran_order}, {"reads long headers", reads_long_headers},
      {"refuses other arrays", refuses_other_arrays}, {"an NPZ there and back", npz_there_and_back},
      {"refuses a damaged NPZ", npz_refuses_damage},
      {"refuses an NPZ without what it needs", npz_refuses_what_is_missing})
