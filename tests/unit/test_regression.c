/* test_regression.c: the regression of a sequence's next frame against closed forms.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/random.h"
#include "net/regression.h"
#include "net/root.h"
#include "test.h"

#include <math.h>

enum { FRAMES = 60 };
static const double turn[2] = {0.2, 0.33}, most_radius = 1.0005;

/* Frames growth^t (cos a t, cos b t), for which next = 2 growth cos(a) c - growth^2 before holds exactly. */
static vgi_regression fit_frames(double growth)
{
    static double row[2 * FRAMES];
    static const size_t start[2] = {0, FRAMES};
    const vgi_frames frames = {2, FRAMES, 1, row, start};
    const vgi_choice choice = {.ridge = 1e-13, .damping = 0.8, .first_ridge = 1e-3};
    vgi_regression r;
    vg_err e;
    for (int t = 0; t < FRAMES; t++)
        for (int k = 0; k < 2; k++) row[2 * t + k] = pow(growth, t) * cos(turn[k] * t);
    CHECK(vgi_regression_make(&r, 2, &e) == VG_OK);
    CHECK(vgi_regression_fit(&r, &frames, false, 1, &choice, &e) == VG_OK);
    return r;
}

/* The factors of number i of the last frame, and of the one before it, in number j of the next. */
static void check_recursion(const vgi_regression *r, double last, double before)
{
    for (size_t i = 0; i < 2; i++)
        for (size_t j = 0; j < 2; j++) {
            CHECK_NEAR((i == j) + r->turn[2 * i + j] + r->change[2 * i + j], i == j ? last * 2 * cos(turn[i]) : 0, 1e-5);
            CHECK_NEAR(-r->change[2 * i + j], i == j ? -before : 0, 1e-5);
        }
}

static void stable_motion_is_learned(void)
{
    vgi_regression r = fit_frames(0.99);
    check_recursion(&r, 0.99, 0.99 * 0.99);
    vgi_regression_clear(&r);
}

/* All eigenvalues, growth exp(+-ia) and growth exp(+-ib), are shrunk by one factor: the rhythm stays. */
static void growing_motion_keeps_its_rhythm(void)
{
    vgi_regression r = fit_frames(1.02);
    check_recursion(&r, most_radius, most_radius * most_radius);
    vgi_regression_clear(&r);
}

/* ---- the choice of ridge and damping ---- */

enum { FOLDS = 5, LENGTH = 40, NUMBERS = 4 };

/* Each fold learns from one sequence and predicts another. */
static vgi_choice choose(double (*rows)[2][LENGTH * NUMBERS])
{
    static const size_t start[2] = {0, LENGTH};
    vgi_fold folds[FOLDS];
    vgi_choice choice;
    vg_err e;
    for (int f = 0; f < FOLDS; f++)
        folds[f] = (vgi_fold){{NUMBERS, LENGTH, 1, rows[f][0], start}, {NUMBERS, LENGTH, 1, rows[f][1], start}};
    CHECK(vgi_regression_choose(folds, FOLDS, 1, 1, &choice, &e) == VG_OK);
    return choice;
}

/* Steps that are 0.8 times the one before and an impulse that cannot be known: nothing is to be learned. */
static void damped_motion_is_left_alone(void)
{
    static double rows[FOLDS][2][LENGTH * NUMBERS];
    vgi_random numbers = vgi_random_start(1, 0);
    for (int f = 0; f < FOLDS; f++)
        for (int part = 0; part < 2; part++)
            for (size_t k = 0; k < NUMBERS; k++) {
                double step = 0, at = 0;
                for (size_t t = 0; t < LENGTH; t++) {
                    rows[f][part][t * NUMBERS + k] = at;
                    step = 0.8 * step + vgi_random_normal(&numbers) * (f + 1); /* folds of different violence */
                    at += step;
                }
            }
    vgi_choice choice = choose(rows);
    CHECK(choice.ridge >= 100);
    CHECK_NEAR(choice.damping, 0.8, 0);
}

static void rhythm_is_learned(void)
{
    static double rows[FOLDS][2][LENGTH * NUMBERS];
    for (int f = 0; f < FOLDS; f++)
        for (int part = 0; part < 2; part++)
            for (size_t i = 0; i < LENGTH * NUMBERS; i++)
                rows[f][part][i] = cos(0.2 * (double)(i / NUMBERS) + (double)(i % NUMBERS) + 0.1 * (2 * f + part));
    CHECK(choose(rows).ridge <= 1e-3);
}

/* On a circle with a speed of w a frame, the steps forward and backward from a frame c are (R(w) - 1) c and (R(-w) - 1) c;
 * their mean, turned round, is a quarter turn of c times sin w. */
static void steps_from_one_frame_are_even(void)
{
    enum { N = 2 };
    const double w = 0.3, there[N * N] = {cos(w) - 1, sin(w), -sin(w), cos(w) - 1},
                 back[N * N] = {cos(w) - 1, -sin(w), sin(w), cos(w) - 1}, quarter[N * N] = {0, sin(w), -sin(w), 0};
    vg_err e;
    vgi_regression a, b;
    CHECK(vgi_regression_make(&a, N, &e) == VG_OK && vgi_regression_make(&b, N, &e) == VG_OK);
    memcpy(a.first, there, sizeof there), memcpy(b.first, back, sizeof back);
    a.first_shift[1] = 0.5, b.first_shift[1] = -0.1;
    vgi_regression_even(&a, &b);
    for (size_t i = 0; i < N * N; i++) {
        CHECK_NEAR(a.first[i], quarter[i], 1e-15);
        CHECK_NEAR(b.first[i], -quarter[i], 1e-15);
    }
    const double c[N] = {2, 1};
    double next[N], before[N];
    vgi_regression_next(&a, c, NULL, next);
    vgi_regression_next(&b, c, NULL, before);
    for (size_t k = 0; k < N; k++) CHECK_NEAR(next[k] + before[k], 2 * c[k], 1e-15);
    CHECK_NEAR(next[1], 1 + 2 * sin(w) + 0.3, 1e-15);
    vgi_regression_clear(&a);
    vgi_regression_clear(&b);
}

/* A body of two components whose root turns by 90 degrees about z, from one about x. The shift is in the frame of the root before the
 * step, the place of the other component in that after it; both are in D = 3. Vectors turned by hand. */
static void root_and_components_move(void)
{
    const vg_network n = {.parts = 2, .diagonal = 3};
    const double quarter = acos(0), half = sqrt(0.5);
    const double steps[9] = {0, 0, quarter, 0, 1, 0, 2, 0, 0};
    double root[4] = {half, half, 0, 0}, centroids[6] = {7, 7, 7, 1, 2, 3};
    vgi_root_move(&n, 1, steps, root, centroids);
    const double moved[3] = {1, 2, 3 + 3};       /* y goes to z */
    const double other[3] = {1, 2, 3 + 3 + 3 * 2}; /* x goes to y by the turn about z, then to z */
    for (int k = 0; k < 3; k++) CHECK_NEAR(centroids[3 + k], moved[k], 1e-14);
    for (int k = 0; k < 3; k++) CHECK_NEAR(centroids[k], other[k], 1e-14);
    const double turned[4] = {0.5, 0.5, -0.5, 0.5}; /* (1 + i)(1 + k) / 2, in which i k = -j */
    for (int k = 0; k < 4; k++) CHECK_NEAR(root[k], turned[k], 1e-15);
}

TESTS({"root and components move", root_and_components_move},
      {"steps from one frame are even", steps_from_one_frame_are_even}, {"stable motion is learned", stable_motion_is_learned}, {"growing motion keeps its rhythm", growing_motion_keeps_its_rhythm},
      {"damped motion is left alone", damped_motion_is_left_alone}, {"rhythm is learned", rhythm_is_learned})
