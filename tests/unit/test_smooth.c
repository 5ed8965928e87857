/* test_smooth.c: filters in time against their closed forms; a rigid body stays rigid; noise of known size is found and
 * taken out where neighbours move together.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"

enum { FRAMES = 240, SIDE = 20, POINTS = SIDE * SIDE };

/* one point on the x axis, at x[i] in frame i, through a filter without root */
static void filter_track(vg_filter filter, double span, size_t n, const double *x, double *y)
{
    static const double reference[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const vg_smoother_options o = {.filter = filter, .root_span = span, .span = span, .threads = 2};
    vg_smoother *s;
    vg_err e;
    double p[12];
    size_t got = 0;
    if (vg_smoother_new(&s, &o, 4, reference, &e) < 0) abort();
    for (size_t i = 0; i <= n; i++) {
        for (size_t v = 0; v < 4 && i < n; v++)
            for (size_t k = 0; k < 3; k++) p[3 * v + k] = reference[3 * v + k] + (k == 0 ? x[i] : 0);
        if (i < n) vg_smoother_add(s, p);
        else vg_smoother_end(s);
        while (vg_smoother_next(s, p)) {
            CHECK_NEAR(p[3] - p[0], 1, 1e-12); /* the pose is constant */
            y[got++] = p[0];
        }
    }
    CHECK(got == n);
    vg_smoother_free(&s);
    CHECK(s == NULL);
}

/* |H|^2 of the Butterworth filter, whose cut-off is moved so that it is 1/sqrt(2) at a period of 2 span frames */
static double lowpass_gain(double frequency, double span)
{
    double w = tan(M_PI * frequency) / tan(M_PI * 0.5 / span) * pow(sqrt(2) - 1, 0.25);
    return 1 / (1 + pow(w, 4));
}

static void test_lowpass(void)
{
    double x[FRAMES], y[FRAMES];
    static const double frequency[] = {0.01, 0.05, 0.125, 0.2, 0.4};
    for (size_t k = 0; k < 5; k++) {
        for (size_t i = 0; i < FRAMES; i++) x[i] = sin(2 * M_PI * frequency[k] * (double)i + 0.3);
        filter_track(VG_LOWPASS, 4, FRAMES, x, y);
        for (size_t i = 60; i < FRAMES - 60; i++) CHECK_NEAR(y[i], lowpass_gain(frequency[k], 4) * x[i], 1e-6);
    }
    CHECK_NEAR(lowpass_gain(0.125, 4), sqrt(0.5), 1e-12);
}

/* A line is a line after it, also at the ends, for all lengths and windows longer than the sequence. */
static void test_lines(void)
{
    double x[FRAMES], y[FRAMES];
    for (size_t n = 1; n < 60; n += n < 8 ? 1 : 17)
        for (int filter = VG_LOWPASS; filter <= VG_ROBUST; filter++) {
            for (size_t i = 0; i < n; i++) x[i] = 3 - 0.25 * (double)i;
            filter_track((vg_filter)filter, 5.5, n, x, y);
            for (size_t i = 0; i < n; i++) CHECK_NEAR(y[i], x[i], 1e-11);
        }
}

static void test_polynomial(void)
{
    double x[FRAMES], y[FRAMES];
    for (size_t i = 0; i < 50; i++) {
        double t = 0.1 * (double)i - 2;
        x[i] = 1 + t - 2 * t * t + 0.5 * t * t * t;
    }
    filter_track(VG_POLYNOMIAL, 5, 50, x, y);
    for (size_t i = 0; i < 50; i++) CHECK_NEAR(y[i], x[i], 1e-9);
    /* the weights of five frames (Savitzky and Golay 1964): -3 12 17 12 -3, over 35 */
    static const double weight[] = {-3, 12, 17, 12, -3};
    for (size_t i = 0; i < 21; i++) x[i] = i == 10;
    filter_track(VG_POLYNOMIAL, 2, 21, x, y);
    for (size_t i = 0; i < 5; i++) CHECK_NEAR(y[8 + i], weight[i] / 35, 1e-12);
    CHECK_NEAR(y[5], 0, 1e-14);
}

/* A parabola is found to the digit although one frame in seven is far away. */
static void test_robust(void)
{
    double x[FRAMES], y[FRAMES];
    for (size_t i = 0; i < 70; i++) {
        double t = 0.05 * (double)i;
        x[i] = t * t - t + (i % 7 == 3 ? 50 : 0);
    }
    filter_track(VG_ROBUST, 5, 70, x, y);
    for (size_t i = 0; i < 70; i++) CHECK_NEAR(y[i], x[i] - (i % 7 == 3 ? 50 : 0), 1e-6);
}

static void test_spans(void)
{
    static const struct { vg_filter filter; double span; int code; } cases[] = {
        {VG_LOWPASS, 1, VG_EARG}, {VG_LOWPASS, 1001, VG_EARG}, {VG_ROBUST, 101, VG_EARG}, {VG_POLYNOMIAL, -1, VG_EARG},
        {VG_LOWPASS, NAN, VG_EARG}, {VG_LOWPASS, 0, VG_OK}, {VG_ROBUST, 100, VG_OK}, {VG_LOWPASS, 1000, VG_OK}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const vg_smoother_options o = {.filter = cases[i].filter, .span = cases[i].span, .threads = 1};
        vg_smoother *s;
        vg_err e;
        CHECK(vg_smoother_new(&s, &o, 0, NULL, &e) == cases[i].code);
        vg_smoother_free(&s);
    }
}

/* A rigid body that turns through two whole turns keeps its edges; averages of its points would shrink it. */
static void test_rigid(void)
{
    static const double reference[12] = {1, 0, 0, -1, 0, 0, 0, 1, 0.5, 0, -1, 1};
    const vg_smoother_options o = {.filter = VG_LOWPASS, .span = 6, .root_span = 6, .threads = 1};
    vg_smoother *s;
    vg_err e;
    double p[12];
    if (vg_smoother_new(&s, &o, 4, reference, &e) < 0) abort();
    for (size_t i = 0; i <= 100; i++) {
        double a = 4 * M_PI * (double)i / 100;
        for (size_t v = 0; v < 4; v++) {
            const double *r = reference + 3 * v;
            p[3 * v] = cos(a) * r[0] - sin(a) * r[1] + 0.1 * (double)i;
            p[3 * v + 1] = sin(a) * r[0] + cos(a) * r[1];
            p[3 * v + 2] = r[2];
        }
        if (i < 100) vg_smoother_add(s, p);
        else vg_smoother_end(s);
        while (vg_smoother_next(s, p)) {
            CHECK_NEAR(hypot(hypot(p[0] - p[3], p[1] - p[4]), p[2] - p[5]), 2, 1e-12);
            CHECK_NEAR(p[8] - p[2], 0.5, 1e-12);
        }
    }
    vg_smoother_free(&s);
}

/* ---- vectors ---- */

/* Three regular tetrahedra: two that turn by opposite angles about parallel axes, and a larger one that stands, so that the
 * body as a whole does not turn. */
static vg_head make_wings(void)
{
    static const double corner[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    vg_head h = {0};
    for (size_t v = 0; v < 12; v++) {
        const double *x = corner[v % 4], size = v < 8 ? 1 : 3;
        add_vertex(&h, size * x[0] + (v < 4 ? -9 : v < 8 ? 9 : 0), size * x[1], size * x[2]);
    }
    for (uint32_t v = 0; v < 12; v += 4) {
        add_face(&h, 3, (uint32_t[]){v, v + 1, v + 2});
        add_face(&h, 3, (uint32_t[]){v, v + 3, v + 1});
        add_face(&h, 3, (uint32_t[]){v, v + 2, v + 3});
        add_face(&h, 3, (uint32_t[]){v + 1, v + 3, v + 2});
    }
    return h;
}

/* vectors: those of the reference, of which the first wing turns about z by `angle`, the second by -angle; all grow */
static void turn_wings(size_t corners, const double *reference, double angle, double scale, double *vectors)
{
    for (size_t c = 0; c < corners; c++) {
        const double *r = reference + 3 * c;
        double a = c < 12 ? angle : c < 24 ? -angle : 0;
        vectors[3 * c] = scale * (cos(a) * r[0] - sin(a) * r[1]);
        vectors[3 * c + 1] = scale * (sin(a) * r[0] + cos(a) * r[1]);
        vectors[3 * c + 2] = scale * r[2];
    }
}

/* The distance of the filtered vectors from those of the angles `expected`, in frames from `skip` to n - skip. In frame i the
 * scale is 1.01^i; root and one anchor move in a line. */
static double filter_wings(vg_filter filter, double span, size_t n, const double *angle, const double *expected, size_t skip)
{
    vg_head h = make_wings();
    vg_graph *g = graph_of(&h);
    size_t corners = vg_graph_corners(g), got = 0;
    double *reference = vectors_of(g, h.body.reference), *in = room(3 * corners, sizeof *in),
           *out = room(3 * corners, sizeof *out), *truth = room(3 * corners, sizeof *truth), worst = 0, root[3], anchor[3];
    const vg_smoother_options o = {.filter = filter, .span = span, .root_span = span, .threads = 2};
    vg_vector_smoother *s;
    vg_err e;
    if (vg_vector_smoother_new(&s, &o, g, h.body.reference, 1, &e) < 0) abort();
    for (size_t i = 0; i <= n; i++) {
        double x = 0.5 * (double)i;
        if (i < n) turn_wings(corners, reference, angle[i], pow(1.01, (double)i), in);
        if (i < n) vg_vector_smoother_add(s, in, (double[]){x, 1, -x}, (double[]){x + 2, 4, -x});
        else vg_vector_smoother_end(s);
        while (vg_vector_smoother_next(s, out, root, anchor)) {
            turn_wings(corners, reference, expected[got], pow(1.01, (double)got), truth);
            if (got >= skip && got < n - skip) worst = fmax(worst, farthest(out, truth, corners) / pow(1.01, (double)got));
            CHECK_NEAR(root[0], 0.5 * (double)got, 1e-11);
            CHECK_NEAR(anchor[0], 0.5 * (double)got + 2, 1e-11);
            CHECK_NEAR(anchor[1], 4, 1e-11);
            got++;
        }
    }
    CHECK(got == n);
    CHECK(vg_vector_smoother_get_stats(s).corners == 0);
    vg_vector_smoother_free(&s);
    CHECK(s == NULL);
    free(reference), free(in), free(out), free(truth);
    vg_graph_free(&g);
    vg_head_clear(&h);
    return worst;
}

/* A swing by a radian loses what the filter takes from its angle and nothing of its length. */
static void test_swing(void)
{
    static const double frequency[] = {0.02, 0.08, 0.125, 0.2};
    double angle[FRAMES], expected[FRAMES];
    for (size_t k = 0; k < 4; k++) {
        for (size_t i = 0; i < FRAMES; i++) {
            angle[i] = sin(2 * M_PI * frequency[k] * (double)i + 0.3);
            expected[i] = lowpass_gain(frequency[k], 4) * angle[i];
        }
        CHECK_NEAR(filter_wings(VG_LOWPASS, 4, FRAMES, angle, expected, 60), 0, 2e-6);
    }
}

/* A wheel that spins at constant speed, 40 degrees a frame, spins on, at the ends too. */
static void test_wheel(void)
{
    double angle[FRAMES];
    for (size_t i = 0; i < FRAMES; i++) angle[i] = 0.7 * (double)i - 30;
    for (size_t n = 1; n < FRAMES; n = 3 * n + 4)
        for (int filter = VG_LOWPASS; filter <= VG_ROBUST; filter++)
            CHECK_NEAR(filter_wings((vg_filter)filter, 5, n, angle, angle, 0), 0, 1e-10);
}

/* One frame in which the wings are elsewhere has no influence on the robust filter. */
static void test_robust_swing(void)
{
    double angle[FRAMES], expected[FRAMES];
    for (size_t i = 0; i < 60; i++) {
        expected[i] = 1e-3 * (double)(i * i) - 1;
        angle[i] = expected[i] + (i % 9 == 4 ? 2 : 0);
    }
    CHECK_NEAR(filter_wings(VG_ROBUST, 4, 60, angle, expected, 0), 0, 1e-5);
}

/* ---- what moves together ---- */

static void make_grid(vg_head *h)
{
    for (size_t i = 0; i < POINTS; i++)
        add_vertex(h, (double)(i % SIDE) / SIDE, (double)(i / SIDE) / SIDE, 0.1 * sin((double)(i % SIDE)));
    for (size_t i = 0; i < POINTS; i++) {
        uint32_t v = (uint32_t)i;
        if (i % SIDE + 1 < SIDE && i / SIDE + 1 < SIDE) add_face(h, 4, (uint32_t[]){v, v + 1, v + SIDE + 1, v + SIDE});
    }
}

static void move_affinely(const double *reference, size_t frame, double *p)
{
    double t = 0.1 * (double)frame;
    for (size_t v = 0; v < POINTS; v++) {
        const double *r = reference + 3 * v;
        p[3 * v] = cos(t) * r[0] - sin(t) * r[1] + t;
        p[3 * v + 1] = sin(t) * r[0] + cos(t) * r[1] + 0.2 * sin(3 * t) * r[2];
        p[3 * v + 2] = (1 + 0.2 * sin(t)) * r[2] + 0.1 * r[0];
    }
}

/* error after the filter over error before; size: standard deviation of a coordinate */
static double filter_regions(size_t frames, double size, double *found)
{
    vg_head h = {0};
    vg_region_filter *r;
    vg_err e;
    make_grid(&h);
    if (vg_region_filter_new(&r, &h.body.mesh, h.body.reference, 2, &e) < 0) abort();
    double *noisy = room(frames * 3 * POINTS, sizeof *noisy), *clean = room(3 * POINTS, sizeof *clean);
    double *out = room(3 * POINTS, sizeof *out), before = 0, after = 0;
    for (size_t i = 0; i < frames; i++) {
        const double *p = noisy + i * 3 * POINTS;
        move_affinely(h.body.reference, i, noisy + i * 3 * POINTS);
        for (size_t k = 0; k < 3 * POINTS; k++) noisy[i * 3 * POINTS + k] += size * sqrt(3) * noise();
        vg_region_filter_look(r, 1, &p);
    }
    CHECK(vg_region_filter_learn(r, &e) == VG_OK);
    for (size_t i = 0; i < frames; i++) {
        const double *p = noisy + i * 3 * POINTS;
        vg_region_filter_apply(r, 1, &p, &out);
        move_affinely(h.body.reference, i, clean);
        for (size_t k = 0; k < 3 * POINTS; k++) {
            before += (p[k] - clean[k]) * (p[k] - clean[k]);
            after += (out[k] - clean[k]) * (out[k] - clean[k]);
        }
    }
    *found = vg_region_filter_noise(r);
    vg_region_filter_free(&r);
    vg_head_clear(&h);
    free(noisy);
    free(clean);
    free(out);
    return size > 0 ? sqrt(after / before) : sqrt(after);
}

/* Of the noise of a region of n vertices in 3 f rows a matrix of rank 4 keeps 4 (n + 3 f - 4) / (3 f n) of the energy:
 * with n = 100, f = 60 a fraction of 0.248, which the overlap of regions makes smaller. */
static void test_regions(void)
{
    double found, left = filter_regions(60, 1e-3, &found);
    CHECK(left < 0.248 && left > 0.1);
    CHECK_NEAR(found, sqrt(3) * 1e-3, 0.03 * sqrt(3) * 1e-3);
}

static void test_regions_clean(void)
{
    double found;
    CHECK_NEAR(filter_regions(60, 0, &found), 0, 1e-7); /* sum over 72,000 numbers of size 1 */
    CHECK(found < 1e-7);
}

static void test_regions_refuse(void)
{
    vg_head h = {0};
    vg_region_filter *r;
    vg_err e;
    make_grid(&h);
    const double *p = h.body.reference;
    if (vg_region_filter_new(&r, &h.body.mesh, h.body.reference, 1, &e) < 0) abort();
    for (int i = 0; i < 7; i++) vg_region_filter_look(r, 1, &p);
    CHECK(vg_region_filter_learn(r, &e) == VG_EINPUT);
    CHECK(strstr(e.message, "7 frames") != NULL);
    vg_region_filter_free(&r);
    vg_head_clear(&h);
}

TESTS({"low-pass: gain of the closed form", test_lowpass}, {"lines stay lines", test_lines},
      {"polynomial: cubics stay, weights of 1964", test_polynomial}, {"robust: outliers do not count", test_robust},
      {"spans out of range", test_spans}, {"a rigid body stays rigid", test_rigid},
      {"vectors: a swing loses of its angle, not its length", test_swing}, {"vectors: a wheel spins on", test_wheel},
      {"vectors: robust", test_robust_swing}, {"regions: noise is found and goes", test_regions}, {"regions: clean motion stays", test_regions_clean},
      {"regions: too few frames", test_regions_refuse})
