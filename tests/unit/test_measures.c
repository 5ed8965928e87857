/* test_measures.c: the measures against displacements whose effect is known by hand. Leaves out reading of sequences.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"
#include "vg.h"

/* A unit cube of quads: D is sqrt(3), every face has area 1. */
static double cube_points[24] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
static uint32_t cube_start[] = {0, 4, 8, 12, 16, 20, 24};
static uint32_t cube_vert[] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
static const vg_mesh cube = {8, 6, cube_start, cube_vert};

static vg_measures *begin(const vg_mesh *m, const double *reference, bool centred)
{
    vg_measures *x = NULL;
    vg_err e;
    CHECK(vg_measures_new(&x, m, reference, centred, &e) == VG_OK);
    return x;
}

static void add(vg_measures *x, const double *truth, const double *result)
{
    vg_err e;
    CHECK(vg_measures_add(x, truth, result, NULL, NULL, NULL, &e) == VG_OK);
}

static vg_measure_report finish(vg_measures *x)
{
    vg_measure_report r;
    vg_measures_get(x, &r);
    vg_measures_free(&x);
    CHECK(x == NULL);
    return r;
}

static void equal_sequences_have_no_error(void)
{
    vg_measures *x = begin(&cube, cube_points, false);
    for (int i = 0; i < 3; i++) add(x, cube_points, cube_points);
    vg_measure_report r = finish(x);
    CHECK(r.frames == 3 && r.vertices == 8 && r.faces == 6 && r.faces_measured == 18);
    CHECK_NEAR(r.diagonal, sqrt(3), 1e-15);
    CHECK(r.mean == 0 && r.rms == 0 && r.max == 0 && r.p95 == 0 && r.sigma == 0);
    CHECK(r.orientation_mean == 0 && r.orientation_max == 0 && r.area_mean == 0 && r.area_sd == 0);
    CHECK(r.planarity_faces[0] == 18 && r.planarity_histogram[0][0] == 18 && r.planarity_max[1] < 1e-15);
}

static void one_moved_vertex(void)
{
    double moved[24], errors[8], mean, max;
    const double d = 0.25;
    vg_err e;
    memcpy(moved, cube_points, sizeof moved);
    moved[3 * 6 + 1] += d;
    vg_measures *x = begin(&cube, cube_points, false);
    add(x, cube_points, cube_points);
    CHECK(vg_measures_add(x, cube_points, moved, &mean, &max, errors, &e) == VG_OK);
    CHECK_NEAR(mean, d / 8, 1e-16);
    CHECK_NEAR(max, d, 1e-16);
    CHECK(errors[6] == d && errors[0] == 0 && errors[7] == 0);
    vg_measure_report r = finish(x);
    CHECK_NEAR(r.mean, d / 16, 1e-16);
    CHECK_NEAR(r.rms, d / 4, 1e-16); /* sqrt(d^2 / 16) */
    CHECK_NEAR(r.max, d, 1e-16);
    CHECK(r.max_vertex == 6 && r.max_frame == 1);
    CHECK(r.sigma_vertex == 6);
    CHECK_NEAR(r.sigma, d / 2, 1e-16); /* of the two errors 0 and d */
}

static void percentile_is_that_of_the_sorted_errors(void)
{
    enum { N = 1000 };
    static double truth[3 * N], result[3 * N];
    vg_mesh points = {N, 0, NULL, NULL};
    /* errors 1, 2, ..., 1000 in an order that is not sorted: 7 is prime to 1000 */
    for (size_t i = 0; i < N; i++) result[3 * i + i % 3] = (double)(i * 7 % N + 1);
    vg_measures *x = begin(&points, truth, false);
    add(x, truth, result);
    vg_measure_report r = finish(x);
    CHECK_NEAR(r.p95, 950, 950 * 0.004);
    CHECK_NEAR(r.mean, 500.5, 1e-9);
    CHECK(r.max == 1000 && r.diagonal == 0 && r.faces_measured == 0);
}

static void centring_takes_the_shift_out(void)
{
    double shifted[24];
    for (int i = 0; i < 24; i++) shifted[i] = cube_points[i] + (i % 3 == 0 ? 3 : i % 3 == 1 ? -4 : 12);
    vg_measures *x = begin(&cube, cube_points, false), *c = begin(&cube, cube_points, true);
    add(x, cube_points, shifted);
    add(c, cube_points, shifted);
    vg_measure_report plain = finish(x), centred = finish(c);
    CHECK_NEAR(plain.mean, 13, 1e-14);
    CHECK_NEAR(plain.max, 13, 1e-14);
    CHECK_NEAR(centred.max, 0, 1e-14);
    CHECK_NEAR(plain.orientation_max, 0, 1e-15);
    CHECK_NEAR(plain.area_max, 0, 1e-13);
}

static void a_turned_face_differs_by_its_angle(void)
{
    static uint32_t start[] = {0, 3, 7}, vert[] = {0, 1, 2, 3, 4, 5, 6};
    static double truth[21] = {0, 0, 0, 2, 0, 0, 0, 3, 0, /**/ 5, 5, 0, 6, 5, 0, 6, 6, 0, 5, 6, 0};
    const vg_mesh m = {7, 2, start, vert};
    static const double angles[] = {1e-6, 0.3, 1.5707963267948966, 2.9, 3.141592653589793};
    for (size_t a = 0; a < sizeof angles / sizeof *angles; a++) {
        double result[21];
        memcpy(result, truth, sizeof result);
        for (int v = 0; v < 3; v++) { /* turn the triangle about the x axis */
            result[3 * v + 1] = cos(angles[a]) * truth[3 * v + 1];
            result[3 * v + 2] = sin(angles[a]) * truth[3 * v + 1];
        }
        vg_measures *x = begin(&m, truth, false);
        add(x, truth, result);
        vg_measure_report r = finish(x);
        double expected = 1 - cos(angles[a]);
        if (angles[a] < 1e-3) expected = 0.5 * angles[a] * angles[a];
        CHECK_NEAR(r.orientation_max, expected, 1e-15);
        CHECK_NEAR(r.orientation_mean, expected / 2, 1e-15); /* the quad did not turn */
        CHECK_NEAR(r.orientation_sd, expected / 2, 1e-15);
        CHECK_NEAR(r.area_max, 0, 1e-14);
    }
}

static void a_scaled_mesh_differs_by_the_square(void)
{
    static const double scales[] = {0.5, 1.1, 3};
    for (size_t k = 0; k < 3; k++) {
        double scaled[24];
        for (int i = 0; i < 24; i++) scaled[i] = scales[k] * cube_points[i];
        vg_measures *x = begin(&cube, cube_points, false);
        add(x, cube_points, scaled);
        vg_measure_report r = finish(x);
        double expected = fabs(1 - scales[k] * scales[k]);
        CHECK_NEAR(r.area_mean, expected, 1e-13);
        CHECK_NEAR(r.area_max, expected, 1e-13);
        CHECK_NEAR(r.area_sd, 0, 1e-13);
        CHECK_NEAR(r.orientation_max, 0, 1e-15);
    }
}

static void planarity_of_a_bent_quad(void)
{
    /* corners at (+-1, 0, h) and (0, +-1, -h): centroid 0, normal z; |z| / length = h / sqrt(1 + h^2) at every one */
    static uint32_t start[] = {0, 4, 7}, vert[] = {0, 1, 2, 3, 0, 1, 2};
    const vg_mesh m = {4, 2, start, vert};
    const double flat[12] = {1, 0, 0, 0, 1, 0, -1, 0, 0, 0, -1, 0}, h = 0.75;
    const double bent[12] = {1, 0, h, 0, 1, -h, -1, 0, h, 0, -1, -h};
    vg_measures *x = begin(&m, flat, false);
    add(x, flat, bent);
    add(x, flat, flat);
    vg_measure_report r = finish(x);
    CHECK(r.planarity_faces[0] == 2 && r.planarity_faces[1] == 2); /* the triangle has none */
    CHECK_NEAR(r.planarity_max[0], 0, 1e-16);
    CHECK_NEAR(r.planarity_max[1], 0.6, 1e-15);
    CHECK_NEAR(r.planarity_mean[1], 0.3, 1e-15);
    CHECK(r.planarity_histogram[0][0] == 2 && r.planarity_histogram[1][0] == 1);
    uint64_t counted = 0;
    for (int i = 0; i < 10; i++) counted += r.planarity_histogram[1][i];
    CHECK(counted == 2);
}

static void faces_without_area_are_not_measured(void)
{
    /* a segment, a collapsed triangle, a collinear quad, and one good triangle */
    static uint32_t start[] = {0, 2, 5, 9, 12};
    static uint32_t vert[] = {0, 1, 2, 3, 4, 0, 1, 5, 6, 0, 1, 7};
    static const double truth[24] = {0, 0, 0, 0.1, 0, 0, 4, 4, 4, 4, 4, 4, 4, 4, 4, 0.3, 0, 0, 0.7, 0, 0, 0, 1, 0};
    const vg_mesh m = {8, 4, start, vert};
    double collapsed[24] = {0};
    vg_measures *x = begin(&m, truth, false);
    add(x, truth, truth);
    vg_measure_report same = finish(x);
    CHECK(same.faces_measured == 1 && same.planarity_faces[0] == 0);
    x = begin(&m, truth, false);
    add(x, truth, collapsed);
    vg_measure_report gone = finish(x);
    CHECK(gone.faces_measured == 1);
    CHECK(gone.area_mean == 1 && gone.orientation_mean == 1); /* not passed over as if it were fine */
}

static void sigma_is_stable_far_from_zero(void)
{
    /* errors 1e6 + {0, 1, 2, ..., 99} * 1e-3: two plain sums of squares would lose all digits of the deviation */
    vg_mesh m = {1, 0, NULL, NULL};
    const double truth[3] = {0, 0, 0};
    vg_measures *x = begin(&m, truth, false);
    for (int i = 0; i < 100; i++) add(x, truth, (double[3]){0, 1e6 + 1e-3 * i, 0});
    vg_measure_report r = finish(x);
    /* of a uniform distribution; an error is known to 1e-10, its running mean to some ten times that */
    CHECK_NEAR(r.sigma, 1e-3 * sqrt((100.0 * 100 - 1) / 12), 1e-8);
}

static void nothing_added(void)
{
    vg_measure_report r = finish(begin(&cube, cube_points, false));
    CHECK(r.frames == 0 && r.mean == 0 && r.rms == 0 && r.p95 == 0 && r.sigma == 0 && r.planarity_mean[0] == 0);
    vg_mesh empty = {0, 0, NULL, NULL};
    vg_measures *x = begin(&empty, NULL, true);
    add(x, NULL, NULL);
    r = finish(x);
    CHECK(r.frames == 1 && r.mean == 0 && r.max == 0 && r.p95 == 0);
}

static void numbers_too_large_are_refused(void)
{
    vg_mesh m = {1, 0, NULL, NULL};
    vg_err e;
    vg_measures *x = begin(&m, (double[3]){0, 0, 0}, false);
    CHECK(vg_measures_add(x, (double[3]){1e308, 0, 0}, (double[3]){-1e308, 0, 0}, NULL, NULL, NULL, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "frame 0: its coordinates are too large to be compared");
    vg_measures_free(&x);
    x = begin(&m, (double[3]){0, 0, 0}, true);
    const double endless[3] = {1, -INFINITY, 0}; /* readers refuse it; it must not break the histogram here */
    CHECK(vg_measures_add(x, endless, endless, NULL, NULL, NULL, &e) == VG_EINPUT);
    vg_measures_free(&x);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of lists of all lengths, with and without ties, in order, in reverse and mixed. */
static void p95_of_one_frame_is_that_of_the_sorted_numbers(void)
{
    double list[300], sorted[300];
    uint32_t seed = 5;
    CHECK(vg_error_p95(list, 0) == 0);
    for (size_t n = 1; n < 300; n++)
        for (int how = 0; how < 4; how++) {
            for (size_t i = 0; i < n; i++) {
                seed = seed * 1664525u + 1013904223u;
                list[i] = how == 0 ? (double)i : how == 1 ? -(double)i : (double)(seed >> (how == 2 ? 8 : 30));
            }
            memcpy(sorted, list, sizeof sorted);
            qsort(sorted, n, sizeof *sorted, compare_doubles);
            CHECK(vg_error_p95(list, n) == sorted[n - n / 20 - 1]);
        }
}

static void the_histogram_counts_in_units_of_the_diagonal(void)
{
    double moved[24];
    memcpy(moved, cube_points, sizeof moved);
    moved[0] += 0.02 * sqrt(3) * 1.001; /* D is sqrt 3 */
    moved[3] -= 0.5 * sqrt(3) * 1.001, moved[6] += 100;
    vg_measures *x = begin(&cube, cube_points, false);
    add(x, cube_points, moved);
    vg_measure_report r = finish(x);
    CHECK(vg_error_edges[0] == 0 && vg_error_edges[1] == 1e-12 && vg_error_edges[VG_ERROR_BINS - 1] == 5);
    for (size_t i = 0; i < VG_ERROR_BINS; i++) {
        double edge = vg_error_edges[i];
        CHECK(i == 0 || edge > vg_error_edges[i - 1]);
        CHECK(r.histogram[i] == (edge == 0 ? 5 : edge == 0.02 || edge == 0.5 || edge == 5));
    }
}

TESTS({"equal sequences have no error", equal_sequences_have_no_error},
      {"one moved vertex", one_moved_vertex},
      {"p95 is that of the sorted errors", percentile_is_that_of_the_sorted_errors},
      {"p95 of one frame is that of the sorted numbers", p95_of_one_frame_is_that_of_the_sorted_numbers},
      {"the histogram counts in units of the diagonal", the_histogram_counts_in_units_of_the_diagonal},
      {"centring takes the shift out", centring_takes_the_shift_out},
      {"a turned face differs by its angle", a_turned_face_differs_by_its_angle},
      {"a scaled mesh differs by the square", a_scaled_mesh_differs_by_the_square},
      {"planarity of a bent quad", planarity_of_a_bent_quad},
      {"faces without area are not measured", faces_without_area_are_not_measured},
      {"sigma is stable far from zero", sigma_is_stable_far_from_zero},
      {"nothing added", nothing_added},
      {"numbers too large are refused", numbers_too_large_are_refused})
