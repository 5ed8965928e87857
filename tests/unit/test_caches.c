/* test_caches.c: the bytes of PC2 and MDD, made here by hand, there and back, times, and everything that must be
 * refused.
 * Leaves out the mesh beside a cache, which formats.bats has.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "play.h"

static void append(vg_bytes *b, uint32_t x, bool big)
{
    unsigned char p[4];
    vgi_put32(p, big ? __builtin_bswap32(x) : x);
    CHECK(vgi_bytes_append(b, p, 4, NULL) == VG_OK);
}

static void append_float(vg_bytes *b, float x, bool big)
{
    uint32_t bits;
    memcpy(&bits, &x, 4);
    append(b, bits, big);
}

static void set(vg_bytes *b, size_t off, uint32_t x, bool big)
{
    vgi_put32(b->data + off, big ? __builtin_bswap32(x) : x);
}

/* Three samples of two points: 0.5, 1.5, ... */
static vg_bytes make_pc2(float start, float rate)
{
    vg_bytes b = {0};
    CHECK(vgi_bytes_append(&b, "POINTCACHE2\0", 12, NULL) == VG_OK);
    append(&b, 1, false);
    append(&b, 2, false);
    append_float(&b, start, false);
    append_float(&b, rate, false);
    append(&b, 3, false);
    for (int i = 0; i < 18; i++) append_float(&b, (float)i + 0.5f, false);
    return b;
}

static vg_bytes make_mdd(void)
{
    vg_bytes b = {0};
    append(&b, 3, true);
    append(&b, 2, true);
    append_float(&b, 0.0f, true);
    append_float(&b, 0.25f, true);
    append_float(&b, 4.0f, true);
    for (int i = 0; i < 18; i++) append_float(&b, (float)i + 0.5f, true);
    return b;
}

static void check_values(const played *p)
{
    CHECK(p->result == 0 && p->frames == 3 && p->n == 18 && p->h.body.mesh.nv == 2 && p->h.body.mesh.nf == 0);
    CHECK(p->h.precision == VG_F32 && p->h.kind == VG_VERTICES);
    for (int i = 0; i < 18; i++) CHECK(p->values[i] == i + 0.5);
}

static void reads_pc2(void)
{
    vg_bytes b = make_pc2(2, 0.5f);
    played p = play(&vgi_sequence_pc2, b.data, b.size);
    check_values(&p);
    CHECK(p.timed && p.times[0] == 2 && p.times[1] == 2.5 && p.times[2] == 3);
    CHECK(vgi_sequence_pc2.sniff(b.data, b.size) && !vgi_sequence_pc2.sniff(b.data, 11));
    played_clear(&p);
    check_prefixes(&vgi_sequence_pc2, &b);
    vg_bytes_clear(&b);
}

static void takes_counting_for_no_time(void)
{
    const struct {
        float start, rate;
        bool timed;
    } cases[] = {{0, 1, false}, {1, 1, false}, {-3, 1, false}, {0.5f, 1, true}, {0, 2, true}, {0, 0.04f, true}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        vg_bytes b = make_pc2(cases[i].start, cases[i].rate);
        played p = play(&vgi_sequence_pc2, b.data, b.size);
        CHECK(p.result == 0 && p.timed == cases[i].timed);
        played_clear(&p);
        vg_bytes_clear(&b);
    }
}

static void reads_mdd(void)
{
    vg_bytes b = make_mdd();
    played p = play(&vgi_sequence_mdd, b.data, b.size);
    check_values(&p);
    CHECK(p.timed && p.times[0] == 0 && p.times[1] == 0.25 && p.times[2] == 4);
    played_clear(&p);
    check_prefixes(&vgi_sequence_mdd, &b);
    vg_bytes_clear(&b);
}

static void refuses_false_numbers(void)
{
    const uint32_t bad[] = {0, 0x80000000u, 0xffffffffu, 0x7fffffffu};
    const uint32_t nan = 0x7fc00000u, inf = 0xff800000u;
    for (size_t i = 0; i < 4; i++) { /* points, then samples; the last case is one that lies about what follows */
        vg_bytes b = make_pc2(0, 1), m = make_mdd();
        int code = i < 3 ? VG_EINPUT : VG_ETRUNC;
        set(&b, 16, bad[i], false);
        CHECK(refused(&vgi_sequence_pc2, b.data, b.size) == code);
        set(&b, 16, 2, false);
        set(&b, 28, bad[i], false);
        CHECK(refused(&vgi_sequence_pc2, b.data, b.size) == code);
        set(&m, 0, bad[i], true);
        CHECK(refused(&vgi_sequence_mdd, m.data, m.size) == code);
        set(&m, 0, 3, true);
        set(&m, 4, bad[i], true);
        CHECK(refused(&vgi_sequence_mdd, m.data, m.size) == code);
        vg_bytes_clear(&b);
        vg_bytes_clear(&m);
    }
    vg_bytes b = make_pc2(0, 1), m = make_mdd();
    set(&b, 20, nan, false);
    CHECK(refused(&vgi_sequence_pc2, b.data, b.size) == VG_EINPUT);
    set(&b, 20, 0, false);
    set(&b, 12, 2, false);
    CHECK(refused(&vgi_sequence_pc2, b.data, b.size) == VG_EINPUT);
    CHECK_TEXT(message, "'x' is a PC2 cache of version 2: only version 1 is supported");
    set(&b, 12, 1, false);
    set(&b, 32 + 4 * 10, inf, false);
    CHECK(refused(&vgi_sequence_pc2, b.data, b.size) == VG_EINPUT);
    CHECK_TEXT(message, "'x': point 1 of sample 2 is not finite");
    set(&m, 12, inf, true);
    CHECK(refused(&vgi_sequence_mdd, m.data, m.size) == VG_EINPUT);
    CHECK_TEXT(message, "'x': the time of sample 2 is not finite");
    vg_bytes_clear(&b);
    vg_bytes_clear(&m);
}

/* ---- writing ---- */

static double points[3][6] = {
    {0.5, 1.5, 2.5, 3.5, 4.5, 5.5}, {6.5, 7.5, 8.5, 9.5, 10.5, 11.5}, {12.5, 13.5, 14.5, 15.5, 16.5, 17.5}};

static void make_frames(vg_frame frames[3], double first, double step)
{
    for (int i = 0; i < 3; i++)
        frames[i] =
            (vg_frame){.name = (char *)"f", .has_time = step != 0, .time = first + i * step, .values = points[i]};
}

static const vg_head head = {.body.mesh.nv = 2, .kind = VG_VERTICES, .precision = VG_F64, .count = 2};

static void writes_pc2(void)
{
    vg_frame frames[3];
    int r;
    char warning[200];
    make_frames(frames, 2, 0.5);
    vg_bytes made = record(&vgi_sequence_pc2, &head, frames, 3, false, &r, warning), want = make_pc2(2, 0.5f);
    CHECK(r == VG_OK && made.size == want.size && !memcmp(made.data, want.data, want.size) && !*warning);
    vg_bytes_clear(&made);
    vg_bytes_clear(&want);
    make_frames(frames, 0, 0); /* without times: counting */
    made = record(&vgi_sequence_pc2, &head, frames, 3, false, &r, warning), want = make_pc2(0, 1);
    CHECK(r == VG_OK && made.size == want.size && !memcmp(made.data, want.data, want.size) && !*warning);
    vg_bytes_clear(&made);
    vg_bytes_clear(&want);
    make_frames(frames, 0, 0.5);
    frames[2].time = 1.2;
    made = record(&vgi_sequence_pc2, &head, frames, 3, false, &r, warning), want = make_pc2(0, 1);
    CHECK(r == VG_OK && made.size == want.size && !memcmp(made.data, want.data, want.size));
    CHECK_TEXT(warning, "the times of the frames, which are not evenly spaced");
    vg_bytes_clear(&made);
    vg_bytes_clear(&want);
}

static void writes_mdd(void)
{
    vg_frame frames[3];
    int r;
    make_frames(frames, 0, 0.25);
    frames[2].time = 4;
    vg_bytes made = record(&vgi_sequence_mdd, &head, frames, 3, false, &r, NULL), want = make_mdd();
    CHECK(r == VG_OK && made.size == want.size && !memcmp(made.data, want.data, want.size));
    vg_bytes_clear(&made);
    vg_bytes_clear(&want);
}

static void refuses_what_does_not_fit(void)
{
    vg_frame frames[3];
    double huge[6] = {0, 0, 0, 0, 1e39, 0};
    int r;
    make_frames(frames, 0, 1);
    frames[1].values = huge;
    for (int i = 0; i < 2; i++) {
        vg_bytes b = record(i ? &vgi_sequence_mdd : &vgi_sequence_pc2, &head, frames, 3, false, &r, NULL);
        CHECK(r == VG_EINPUT);
        CHECK_TEXT(message, "vertex 1 does not fit binary32 (1e+39)");
        vg_bytes_clear(&b);
    }
}

/* USDA has one sample for a time code. */
static void refuses_times_too_close(void)
{
    static const double step[] = {1e-310, 1e-310 / 24, 1e-17};
    for (int i = 0; i < 3; i++) {
        vg_frame frames[3];
        int r;
        make_frames(frames, i < 2 ? 0 : 1, step[i]);
        if (i == 2) frames[1].time = 2, frames[2].time = 2 + 1e-15; /* in binary64 apart, as time codes not */
        vg_bytes b = record(&vgi_sequence_usda, &head, frames, i < 2 ? 2 : 3, false, &r, NULL);
        CHECK(r == VG_EINPUT && (strstr(message, "is too close to that of the frame before it") ||
                                 strstr(message, "is not later than")));
        vg_bytes_clear(&b);
    }
}

static void usda_names_are_quoted(void)
{
    vg_frame f = {.name = (char *)"a\"b\\c\n", .values = points[0]};
    int r;
    vg_bytes b = record(&vgi_sequence_usda, &head, &f, 1, false, &r, NULL);
    CHECK(r == VG_OK && vgi_bytes_append(&b, "", 1, NULL) == VG_OK);
    CHECK(strstr((char *)b.data, "vg:frameNames = [\"a\\\"b\\\\c\\x0a\"]\n"));
    vg_bytes_clear(&b);
}

TESTS({"reads PC2", reads_pc2}, {"takes counting for no time", takes_counting_for_no_time}, {"reads MDD", reads_mdd},
      {"refuses false numbers", refuses_false_numbers}, {"writes PC2", writes_pc2}, {"writes MDD", writes_mdd},
      {"refuses what does not fit", refuses_what_does_not_fit}, {"refuses times too close", refuses_times_too_close},
      {"USDA names are quoted", usda_names_are_quoted})
