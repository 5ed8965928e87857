/* test_page.c: numbers packed for a page: what comes back, what is lost, what a page refuses and escapes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"

#include "view/page.h"

#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

static unsigned char *inflate_all(const vg_bytes *packed, size_t n)
{
    unsigned char *out = malloc(n + 1);
    uLongf got = n + 1;
    CHECK(uncompress(out, &got, packed->data, packed->size) == Z_OK);
    CHECK(got == n);
    return out;
}

/* As page.js does it, but from the description in page.h. */
static void unpack(const vgi_chunk *c, size_t nv, size_t width, double *values)
{
    size_t frame = nv * width, total = c->n * frame;
    unsigned char *b = inflate_all(&c->packed, c->n + 2 * total);
    uint16_t *q = calloc(total + 1, sizeof *q);
    for (size_t i = 0; i < total; i++) {
        unsigned how = b[i / frame], rest = (unsigned)b[c->n + i] << 8 | b[c->n + total + i];
        unsigned x = rest & 1 ? ~(rest >> 1) : rest >> 1;
        /* what was left of the one before: itself less its own prediction */
        if (how & VGI_PREDICT_NEIGHBOUR && i % nv) {
            size_t j = i - 1;
            x += q[j] - (how & VGI_PREDICT_FRAME ? q[j - frame] : 0U) -
                 (how & VGI_PREDICT_MOTION ? 2U * q[j - frame] - q[j - 2 * frame] : 0U);
        }
        if (how & VGI_PREDICT_FRAME) x += q[i - frame];
        if (how & VGI_PREDICT_MOTION) x += 2U * q[i - frame] - q[i - 2 * frame];
        q[i] = (uint16_t)x;
        size_t f = i / frame, k = i % frame / nv, v = i % nv;
        values[(f * nv + v) * width + k] = c->origin[k] + c->step[k] * q[i];
    }
    free(q);
    free(b);
}

static double noise(uint32_t *seed)
{
    *seed = *seed * 1664525U + 1013904223U;
    return *seed / 4294967296.0 - 0.5;
}

typedef enum motion { STILL, SMOOTH, NOISE, JUMPS, LINE } motion;

static void fill(motion m, size_t f, size_t nv, size_t width, double *values)
{
    static uint32_t seed = 17; /* goes on from frame to frame, or one could be predicted from another */
    for (size_t v = 0; v < nv; v++)
        for (size_t k = 0; k < width; k++) {
            double t = (double)f, x = 0.1 * (double)v + (double)k, *to = values + v * width + k;
            switch (m) {
            case STILL: *to = cos(x); break;
            case SMOOTH: *to = cos(x + 0.1 * t); break;
            case NOISE: *to = noise(&seed); break;
            case JUMPS: *to = f % 2 ? 1e30 : -1e30 * (double)(v % 3); break;
            case LINE: *to = 5 + 0.25 * t; break;
            }
        }
}

static size_t check_motion(motion m, size_t n, size_t nv, size_t width)
{
    vgi_track t;
    vgi_chunk c = {0};
    CHECK(vgi_track_init(&t, nv, width, NULL) == VG_OK);
    CHECK(n <= t.cap);
    double *want = calloc(n * nv * width + 1, sizeof *want), *got = calloc(n * nv * width + 1, sizeof *got);
    for (size_t f = 0; f < n; f++) {
        fill(m, f, nv, width, want + f * nv * width);
        memcpy(vgi_track_next(&t), want + f * nv * width, nv * width * sizeof *want);
    }
    CHECK(vgi_track_pack(&t, &c, NULL) == VG_OK);
    CHECK(c.n == n && t.n == 0);
    unpack(&c, nv, width, got);
    double worst = 0, bound = 0;
    for (size_t i = 0; i < n * nv; i++) {
        double sum = 0;
        for (size_t k = 0; k < width; k++) {
            double d = want[i * width + k] - got[i * width + k];
            sum += d * d;
        }
        worst = fmax(worst, sqrt(sum));
    }
    for (size_t k = 0; k < width; k++) bound += c.step[k] * c.step[k] / 4;
    CHECK(worst == c.loss); /* it is what is stated, to the last bit: both are the same arithmetic */
    CHECK(worst <= sqrt(bound) * (1 + 1e-9)); /* half a step each way */
    size_t size = c.packed.size;
    free(want);
    free(got);
    vg_bytes_clear(&c.packed);
    vgi_track_clear(&t);
    return size;
}

static void test_what_comes_back(void)
{
    for (motion m = STILL; m <= LINE; m++)
        for (size_t n = 1; n <= 4; n++)
            for (size_t nv = 0; nv <= 3; nv++) check_motion(m, n, nv, 3);
    for (motion m = STILL; m <= LINE; m++) check_motion(m, 32, 50, 3), check_motion(m, 32, 50, 1);
}

static void test_motion_costs_little(void)
{
    size_t noise_size = check_motion(NOISE, 32, 500, 3), smooth = check_motion(SMOOTH, 32, 500, 3);
    size_t still = check_motion(STILL, 32, 500, 3), once = check_motion(STILL, 1, 500, 3);
    CHECK(noise_size > 80000); /* 96000 bytes that cannot be predicted */
    CHECK(smooth < noise_size / 3);
    CHECK(still < once + 1000); /* repetitions are nearly for nothing */
}

static void test_lists(void)
{
    uint32_t list[300];
    for (uint32_t i = 0; i < 300; i++) list[i] = i % 7 == 0 ? UINT32_MAX - i : 100000 * i;
    for (int differences = 0; differences < 2; differences++) {
        vg_bytes packed = {0};
        CHECK(vgi_pack_list(&packed, list, 300, differences, NULL) == VG_OK);
        unsigned char *b = inflate_all(&packed, 1200);
        uint32_t x = 0, wrong = 0;
        for (size_t i = 0; i < 300; i++) {
            uint32_t y = (uint32_t)b[i] << 24 | (uint32_t)b[300 + i] << 16 | (uint32_t)b[600 + i] << 8 | b[900 + i];
            x = differences ? x + y : y;
            wrong += x != list[i];
        }
        CHECK(wrong == 0);
        free(b);
        vg_bytes_clear(&packed);
    }
}

static void test_base64(void)
{
    static const char *const pairs[][2] = {{"", ""},
                                           {"f", "Zg=="},
                                           {"fo", "Zm8="},
                                           {"foo", "Zm9v"},
                                           {"foob", "Zm9vYg=="},
                                           {"fooba", "Zm9vYmE="},
                                           {"foobar", "Zm9vYmFy"},
                                           {"\xfb\xff\xbf", "+/+/"}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
        vg_bytes text = {0};
        CHECK(vgi_base64(&text, (const unsigned char *)pairs[i][0], strlen(pairs[i][0]), NULL) == VG_OK);
        CHECK(vgi_bytes_append(&text, "", 1, NULL) == VG_OK);
        CHECK_TEXT((char *)text.data, pairs[i][1]);
        vg_bytes_clear(&text);
    }
}

/* ---- a page ---- */

static uint32_t starts[] = {0, 4, 6}, corners[] = {0, 1, 2, 3, 3, 4};
static double places[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 2, 0};

static vg_head make_head(void)
{
    return (vg_head){.body.mesh = {5, 2, starts, corners}, .body.reference = places, .kind = VG_VERTICES, .count = 5};
}

static char *page_text(int fd)
{
    off_t n = lseek(fd, 0, SEEK_END);
    char *text = calloc((size_t)n + 1, 1);
    CHECK(pread(fd, text, (size_t)n, 0) == n);
    return text;
}

static size_t count(const char *text, const char *what)
{
    size_t n = 0;
    for (const char *at = text; (at = strstr(at, what)); at++) n++;
    return n;
}

static void test_page(void)
{
    vg_page *p;
    vg_page_stats stats;
    vg_err e;
    vg_head h = make_head();
    vg_page_options o = {.title = "a <b> & \"c\"", .tint = VG_TINT_ERRORS};
    int fd = memfd_create("page", MFD_CLOEXEC);
    CHECK(vg_page_new(&p, fd, "page", &o, &e) == VG_OK);
    CHECK(vg_page_sequence(p, "x</script>", &h, &e) == VG_OK);
    CHECK(vg_page_sequence(p, "truth", &h, &e) == VG_OK);
    double moved[15];
    for (size_t i = 0; i < 15; i++) moved[i] = places[i] + (i % 3 == 2 ? 0.01 : 0);
    vg_frame f = {.name = (char *)(uintptr_t)"one\n\"</script><!--", .values = moved};
    vg_frame g = {.name = (char *)(uintptr_t)"t", .values = places};
    for (int i = 0; i < 40; i++) {
        CHECK(vg_page_add(p, 0, &f, places, &e) == VG_OK);
        CHECK(vg_page_add(p, 1, &g, NULL, &e) == VG_OK);
    }
    CHECK(vg_page_add(p, 0, &f, NULL, &e) == VG_EARG);
    CHECK(vg_page_add(p, 2, &f, NULL, &e) == VG_EARG);
    CHECK(vg_page_end(p, &stats, &e) == VG_OK);
    CHECK(stats.frames == 40);
    CHECK_NEAR(stats.mean, 0.01 / sqrt(5), 1e-15);
    CHECK_NEAR(stats.max, 0.01 / sqrt(5), 1e-15);
    CHECK_NEAR(stats.scale, 0.005, 1e-15); /* 0.00447, rounded up */
    /* the middle of a side of length 2; ends of a box are exact */
    CHECK_NEAR(stats.loss, 1 / 65535.0 / sqrt(5), 1e-15);
    char *text = page_text(fd);
    CHECK(strlen(text) == stats.bytes);
    CHECK(strstr(text, "<title>a &lt;b&gt; &amp; &quot;c&quot;</title>"));
    CHECK(strstr(text, "\"x\\u003c/script>\""));
    CHECK(strstr(text, "\"one\\u000a\\u0022\\u003c/script>\\u003c!--\""));
    /* lists 2 x 3, chunks 3 x 2; stats, player */
    CHECK(count(text, "<script") == 12 + 2 && count(text, "</script") == 12 + 2);
    CHECK(!strstr(text, "<!--") && !strstr(text, "@TITLE@") && !strstr(text, "@FACTS@") && !strstr(text, "@SCRIPT@"));
    CHECK(strstr(text, "data-frames=\"numbers\" data-count=\"32\""));
    CHECK(strstr(text, "data-frames=\"numbers\" data-count=\"8\""));
    free(text);
    vg_page_free(&p);
    close(fd);
}

static void test_refusals(void)
{
    vg_page *p;
    vg_page_stats stats;
    vg_err e;
    vg_head h = make_head(), vectors = make_head();
    vectors.kind = VG_VECTORS;
    vg_page_options o = {.title = "t"}, bad = {.title = "t", .scale = -1};
    int fd = memfd_create("page", MFD_CLOEXEC);
    CHECK(vg_page_new(&p, fd, "page", &bad, &e) == VG_EARG && !p);
    CHECK(vg_page_new(&p, fd, "page", &o, &e) == VG_OK);
    CHECK(vg_page_end(p, &stats, &e) == VG_EINPUT);
    CHECK(vg_page_sequence(p, "v", &vectors, &e) == VG_EARG);
    for (int i = 0; i < VG_PAGE_SEQUENCES; i++) CHECK(vg_page_sequence(p, "s", &h, &e) == VG_OK);
    CHECK(vg_page_sequence(p, "s", &h, &e) == VG_EARG);
    CHECK(vg_page_end(p, &stats, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "'s' has no frames: there is nothing to show");
    vg_page_free(&p);
    CHECK(p == NULL);
    vg_page_free(&p);
    close(fd);
    CHECK(vg_page_new(&p, fd, "page", &o, &e) == VG_OK); /* nothing is written yet */
    CHECK(vg_page_sequence(p, "s", &h, &e) == VG_ESYS);
    vg_page_free(&p);
}

TESTS({"numbers come back within the stated loss", test_what_comes_back},
      {"motion costs little", test_motion_costs_little}, {"lists come back", test_lists}, {"base64", test_base64},
      {"a page says what it holds, and nothing ends its scripts", test_page}, {"what a page refuses", test_refusals})
