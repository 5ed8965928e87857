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
    CHECK(vg_measures_new(&x, m, reference, centred, 1, &e) == VG_OK);
    return x;
}

static void add(vg_measures *x, const double *truth, const double *result)
{
    double errors[1000]; /* of the largest mesh here */
    vg_err e;
    CHECK(vg_measures_add(x, 1, &truth, &result, (double *[]){errors}, NULL, &e) == VG_OK);
}

static vg_measure_stats finish(vg_measures *x)
{
    vg_measure_stats r;
    vg_measures_get_stats(x, &r);
    vg_measures_free(&x);
    CHECK(x == NULL);
    return r;
}

static void equal_sequences_have_no_error(void)
{
    vg_measures *x = begin(&cube, cube_points, false);
    for (int i = 0; i < 3; i++) add(x, cube_points, cube_points);
    vg_measure_stats r = finish(x);
    CHECK(r.frames == 3 && r.vertices == 8 && r.faces == 6 && r.faces_measured == 18);
    CHECK_NEAR(r.diagonal, sqrt(3), 1e-15);
    CHECK(r.mean == 0 && r.rms == 0 && r.max == 0 && r.p95 == 0 && r.sigma == 0);
    CHECK(r.orientation_mean == 0 && r.orientation_max == 0 && r.area_mean == 0 && r.area_sd == 0);
    CHECK(r.planarity_faces[0] == 18 && r.planarity_histogram[0][0] == 18 && r.planarity_max[1] < 1e-15);
}

static void one_moved_vertex(void)
{
    double moved[24], errors[8];
    vg_pose_error found;
    const double d = 0.25;
    vg_err e;
    memcpy(moved, cube_points, sizeof moved);
    moved[3 * 6 + 1] += d;
    vg_measures *x = begin(&cube, cube_points, false);
    add(x, cube_points, cube_points);
    CHECK(vg_measures_add(x, 1, (const double *[]){cube_points}, (const double *[]){moved}, (double *[]){errors},
                          &found, &e) == VG_OK);
    CHECK_NEAR(found.mean, d / 8, 1e-16);
    CHECK_NEAR(found.max, d, 1e-16);
    CHECK(errors[6] == d && errors[0] == 0 && errors[7] == 0);
    vg_measure_stats r = finish(x);
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
    vg_measure_stats r = finish(x);
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
    vg_measure_stats plain = finish(x), centred = finish(c);
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
        vg_measure_stats r = finish(x);
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
        vg_measure_stats r = finish(x);
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
    vg_measure_stats r = finish(x);
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
    vg_measure_stats same = finish(x);
    CHECK(same.faces_measured == 1 && same.planarity_faces[0] == 0);
    x = begin(&m, truth, false);
    add(x, truth, collapsed);
    vg_measure_stats gone = finish(x);
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
    vg_measure_stats r = finish(x);
    /* of a uniform distribution; an error is known to 1e-10, its running mean to some ten times that */
    CHECK_NEAR(r.sigma, 1e-3 * sqrt((100.0 * 100 - 1) / 12), 1e-8);
}

static void nothing_added(void)
{
    vg_measure_stats r = finish(begin(&cube, cube_points, false));
    CHECK(r.frames == 0 && r.mean == 0 && r.rms == 0 && r.p95 == 0 && r.sigma == 0 && r.planarity_mean[0] == 0);
    vg_mesh empty = {0, 0, NULL, NULL};
    vg_measures *x = begin(&empty, NULL, true);
    add(x, NULL, NULL);
    r = finish(x);
    CHECK(r.frames == 1 && r.mean == 0 && r.max == 0 && r.p95 == 0);
}

static int add_one(vg_measures *x, const double *truth, const double *result, vg_err *e)
{
    double error;
    return vg_measures_add(x, 1, &truth, &result, (double *[]){&error}, NULL, e);
}

static void numbers_too_large_are_refused(void)
{
    vg_mesh m = {1, 0, NULL, NULL};
    vg_err e;
    vg_measures *x = begin(&m, (double[3]){0, 0, 0}, false);
    CHECK(add_one(x, (double[3]){1e308, 0, 0}, (double[3]){-1e308, 0, 0}, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "frame 0: its coordinates are too large to be compared");
    vg_measures_free(&x);
    x = begin(&m, (double[3]){0, 0, 0}, true);
    const double endless[3] = {1, -INFINITY, 0}; /* readers refuse it; it must not break the histogram here */
    CHECK(add_one(x, endless, endless, &e) == VG_EINPUT);
    vg_measures_free(&x);
}

/* ---- many faces of many sizes ---- */

enum { SIZES = 5, POINTS = 70, POSES = 7 };
static const size_t faces_of[SIZES] = {19, 11, 8, 1, 2}; /* of 3, 4, ... corners: some fill eights, some do not */

typedef struct many {
    vg_mesh mesh;
    uint32_t start[64], vert[400];
    double truth[POSES][3 * POINTS], result[POSES][3 * POINTS];
} many;

static double random_number(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) / (1 << 24);
}

/* Faces of distinct vertices, sizes mixed; one triangle is without area in every truth, one in every result. */
static void make_many(many *m)
{
    uint32_t seed = 3, at = 0, f = 0;
    for (size_t round = 0; round < 19; round++)
        for (size_t k = 0; k < SIZES; k++) {
            if (round >= faces_of[k]) continue;
            for (size_t i = 0; i < k + 3; i++) m->vert[at++] = (uint32_t)(f * 7 + i * 9 + k) % POINTS;
            m->start[++f] = at;
        }
    m->mesh = (vg_mesh){POINTS, f, m->start, m->vert};
    for (size_t p = 0; p < POSES; p++)
        for (size_t i = 0; i < 3 * POINTS; i++) {
            m->truth[p][i] = random_number(&seed);
            m->result[p][i] = m->truth[p][i] + 0.1 * random_number(&seed);
        }
    for (size_t p = 0; p < POSES; p++) /* faces without area, in one of the two */
        for (size_t i = 0; i < 3; i++) {
            for (size_t k = 0; k < 3; k++) m->truth[p][3 * m->vert[m->start[9] + i] + k] = 0.5;
            for (size_t k = 0; k < 3; k++) m->result[p][3 * m->vert[m->start[12] + i] + k] = 0.25;
        }
}

/* Unit normal of a face, and its area, by its definition. */
static bool normal_of(const many *m, size_t f, const double *points, long double n[3], long double *area)
{
    long double length = 0, longest = 0;
    const uint32_t *vert = m->vert + m->start[f];
    size_t r = m->start[f + 1] - m->start[f];
    for (size_t k = 0; k < 3; k++) {
        n[k] = 0;
        for (size_t i = 0; i < r; i++) {
            const double *p = points + 3 * vert[i], *q = points + 3 * vert[(i + 1) % r];
            n[k] += (long double)p[(k + 1) % 3] * q[(k + 2) % 3] - (long double)p[(k + 2) % 3] * q[(k + 1) % 3];
            if (fabsl((long double)p[k] - q[k]) > longest) longest = fabsl((long double)p[k] - q[k]);
        }
        length += n[k] * n[k];
    }
    length = sqrtl(length);
    for (size_t k = 0; k < 3; k++) n[k] /= length;
    *area = length / 2;
    return length > 1e-12L * longest; /* in this test a face has a good area or none */
}

static void faces_of_many_sizes_by_their_definition(void)
{
    static many m;
    long double list[2][POSES * 64], mean[2] = {0, 0}, squares[2] = {0, 0}, most[2] = {0, 0};
    size_t n = 0;
    make_many(&m);
    for (size_t p = 0; p < POSES; p++)
        for (size_t f = 0; f < m.mesh.nf; f++) {
            long double a[3], b[3], area[2];
            if (!normal_of(&m, f, m.truth[p], a, &area[0])) continue;
            bool has = normal_of(&m, f, m.result[p], b, &area[1]);
            list[0][n] = has ? 1 - a[0] * b[0] - a[1] * b[1] - a[2] * b[2] : 1;
            list[1][n++] = has ? fabsl(1 - area[1] / area[0]) : 1;
        }
    CHECK(n < POSES * m.mesh.nf && 2 * n > POSES * m.mesh.nf);
    for (int k = 0; k < 2; k++) {
        for (size_t i = 0; i < n; i++) mean[k] += list[k][i] / n, most[k] = fmaxl(most[k], list[k][i]);
        for (size_t i = 0; i < n; i++) squares[k] += (list[k][i] - mean[k]) * (list[k][i] - mean[k]);
    }
    vg_measures *x = begin(&m.mesh, m.truth[0], false);
    for (size_t p = 0; p < POSES; p++) add(x, m.truth[p], m.result[p]);
    vg_measure_stats r = finish(x);
    CHECK(r.faces_measured == n && r.planarity_faces[0] == POSES * 22 && r.planarity_faces[1] == POSES * 22);
    CHECK_NEAR(r.orientation_mean, (double)mean[0], 1e-12);
    CHECK_NEAR(r.orientation_sd, (double)sqrtl(squares[0] / n), 1e-12);
    CHECK_NEAR(r.orientation_max, (double)most[0], 1e-12);
    CHECK_NEAR(r.area_mean, (double)mean[1], 1e-10 * (double)most[1]);
    CHECK_NEAR(r.area_sd, (double)sqrtl(squares[1] / n), 1e-10 * (double)most[1]);
    CHECK_NEAR(r.area_max, (double)most[1], 1e-10 * (double)most[1]);
}

/* In batches of any size, by any number of threads: every digit of the report. */
static void batches_and_threads_change_no_digit(void)
{
    static many m;
    static double errors[POSES][POINTS];
    const double *truth[POSES], *result[POSES];
    double *to[POSES];
    vg_measure_stats reports[4];
    vg_err e;
    make_many(&m);
    for (size_t p = 0; p < POSES; p++) truth[p] = m.truth[p], result[p] = m.result[p], to[p] = errors[p];
    for (size_t k = 0; k < 4; k++) {
        static const size_t sizes[4] = {1, POSES, 3, 2};
        static const int threads[4] = {1, 3, 2, 1};
        vg_measures *x = NULL;
        CHECK(vg_measures_new(&x, &m.mesh, m.truth[0], true, threads[k], &e) == VG_OK);
        for (size_t p = 0; p < POSES; p += sizes[k]) {
            size_t n = POSES - p < sizes[k] ? POSES - p : sizes[k];
            CHECK(vg_measures_add(x, n, truth + p, result + p, to + p, NULL, &e) == VG_OK);
        }
        memset(&reports[k], 0, sizeof *reports);
        vg_measures_get_stats(x, &reports[k]);
        vg_measures_free(&x);
        CHECK(reports[k].frames == POSES && reports[k].max > 0 && reports[k].sigma > 0);
        CHECK(!memcmp(&reports[k], &reports[0], sizeof *reports));
    }
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
    vg_measure_stats r = finish(x);
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
      {"numbers too large are refused", numbers_too_large_are_refused},
      {"faces of many sizes by their definition", faces_of_many_sizes_by_their_definition},
      {"batches and threads change no digit", batches_and_threads_change_no_digit})
