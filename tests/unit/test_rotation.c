/* test_rotation.c: what must hold of deformations as quaternions: rotations are rotations, r goes to d, log and exp
 * are inverse to each other also near no turn, half a turn and a whole one, scale and rotation commute.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "test.h"

enum { ROUNDS = 20000 };
static const double PI = 3.14159265358979323846;

static uint64_t state = 1;

static double uniform(void) /* in (-1, 1) */
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return ((double)(state >> 11) + 0.5) * 0x1p-52 - 1;
}

static double length(const double *x, int n)
{
    double sum = 0;
    for (int k = 0; k < n; k++) sum += x[k] * x[k];
    return sqrt(sum);
}

static void random_unit(double *x, int n)
{
    double l;
    do {
        for (int k = 0; k < n; k++) x[k] = uniform();
        l = length(x, n);
    } while (!(l > 0.1 && l < 1));
    for (int k = 0; k < n; k++) x[k] /= l;
}

static void random_perpendicular(const double r[3], double p[3])
{
    double u[3];
    random_unit(u, 3);
    p[0] = r[1] * u[2] - r[2] * u[1], p[1] = r[2] * u[0] - r[0] * u[2], p[2] = r[0] * u[1] - r[1] * u[0];
    double l = length(p, 3);
    if (l < 0.01) random_perpendicular(r, p);
    else for (int k = 0; k < 3; k++) p[k] /= l;
}

/* The largest difference of n numbers. */
static double apart(const double *a, const double *b, int n)
{
    double most = 0;
    for (int k = 0; k < n; k++) {
        double d = fabs(a[k] - b[k]);
        if (!(d <= most)) most = d; /* NaN stays */
    }
    return most;
}

/* Q and -Q are the same rotation. */
static double turns_apart(const double a[4], const double b[4])
{
    double minus[4] = {-b[0], -b[1], -b[2], -b[3]}, x = apart(a, b, 4), y = apart(a, minus, 4);
    return x < y ? x : y;
}

static void check_rotation(const double j[9])
{
    double square[9], one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) square[3 * a + b] = j[a] * j[b] + j[a + 3] * j[b + 3] + j[a + 6] * j[b + 6];
    CHECK_NEAR(apart(square, one, 9), 0, 1e-12);
    double det = j[0] * (j[4] * j[8] - j[5] * j[7]) - j[1] * (j[3] * j[8] - j[5] * j[6]) +
                 j[2] * (j[3] * j[7] - j[4] * j[6]);
    CHECK_NEAR(det, 1, 1e-12);
}

static void the_matrix_is_a_rotation_and_turns_as_the_quaternion(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double q[4], back[4], m[9], r[3], d[3];
        random_unit(q, 4);
        if (i % 4 == 1) q[i / 4 % 4] = 0; /* half turns, turns about an axis' plane, ... */
        if (i % 4 == 2) q[i / 4 % 4] *= 1e-9;
        if (i % 4 == 3) q[i / 4 % 4] *= 1e9;
        double l = length(q, 4);
        for (int k = 0; k < 4; k++) q[k] /= l;
        vg_quat_matrix(q, m);
        check_rotation(m);
        random_unit(r, 3);
        vg_quat_apply(q, r, d);
        double turned[3];
        for (int k = 0; k < 3; k++) turned[k] = m[3 * k] * r[0] + m[3 * k + 1] * r[1] + m[3 * k + 2] * r[2];
        CHECK_NEAR(apart(turned, d, 3), 0, 1e-14);
        vg_quat_from_matrix(m, back);
        CHECK_NEAR(turns_apart(q, back), 0, 1e-14);
    }
}

static void a_quarter_turn_about_z_takes_x_to_y(void)
{
    double q[4] = {sqrt(0.5), 0, 0, sqrt(0.5)}, x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, d[3], m[9];
    vg_quat_apply(q, x, d);
    CHECK_NEAR(apart(d, y, 3), 0, 1e-15);
    vg_quat_matrix(q, m);
    CHECK_NEAR(m[3], 1, 1e-15); /* row-major: row y of column x */
}

static void products_turn_one_after_the_other(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double a[4], b[4], ab[4], r[3], d[3], e[3], in_place[4];
        random_unit(a, 4), random_unit(b, 4), random_unit(r, 3);
        for (int k = 0; k < 4; k++) a[k] *= 1.7, b[k] *= 0.6;
        vg_quat_multiply(a, b, ab);
        vg_quat_apply(b, r, d);
        vg_quat_apply(a, d, d); /* in place */
        vg_quat_apply(ab, r, e);
        CHECK_NEAR(apart(d, e, 3), 0, 1e-14);
        CHECK_NEAR(length(ab, 4), 1.7 * 0.6, 1e-14);
        memcpy(in_place, a, sizeof a);
        vg_quat_multiply(in_place, b, in_place);
        CHECK(!memcmp(in_place, ab, sizeof ab));
    }
}

/* One vector from r to d: check everything that is asked of the smallest rotation. */
static void check_between(const double r[3], const double d[3])
{
    double q[4], unit[4], m[9], mapped[3], rl = length(r, 3), dl = length(d, 3);
    vg_quat_between(r, d, q);
    double l = length(q, 4);
    CHECK_NEAR(l * l, dl / rl, 1e-12 * dl / rl);
    vg_quat_apply(q, r, mapped);
    CHECK_NEAR(apart(mapped, d, 3), 0, 1e-12 * dl);
    for (int k = 0; k < 4; k++) unit[k] = q[k] / l;
    vg_quat_matrix(unit, m);
    check_rotation(m);
    /* smallest: the axis is perpendicular to r, and the turn is not beyond half a turn */
    CHECK_NEAR(unit[1] * r[0] + unit[2] * r[1] + unit[3] * r[2], 0, 1e-12 * rl);
    CHECK(unit[0] >= 0);
}

static void between_takes_r_to_d(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double r[3], d[3], a = pow(10, 3 * uniform()), b = pow(10, 3 * uniform());
        random_unit(r, 3), random_unit(d, 3);
        for (int k = 0; k < 3; k++) r[k] *= a, d[k] *= b;
        check_between(r, d);
    }
}

/* Angles of 10^-20 to 10^-1 away from parallel and from opposite. */
static void between_holds_near_parallel_and_near_opposite(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double r[3], p[3], d[3], angle = pow(10, -10.5 + 9.5 * uniform()), side = i % 2 ? -1 : 1;
        random_unit(r, 3);
        random_perpendicular(r, p);
        for (int k = 0; k < 3; k++) d[k] = side * cos(angle) * r[k] + sin(angle) * p[k];
        check_between(r, d);
    }
}

static void parallel_is_no_turn_and_opposite_always_the_same(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double r[3], d[3], q[4], again[4], one[4] = {1, 0, 0, 0};
        random_unit(r, 3);
        if (i < 8) for (int k = 0; k < 3; k++) r[k] = i >> k & 1 ? 1 : 0;
        if (i == 0) r[0] = -1;
        vg_quat_between(r, r, q);
        CHECK_NEAR(apart(q, one, 4), 0, 1e-15);
        for (int k = 0; k < 3; k++) d[k] = -4 * r[k];
        check_between(r, d);
        vg_quat_between(r, d, q);
        vg_quat_between(r, d, again);
        CHECK(!memcmp(q, again, sizeof q));
        CHECK_NEAR(q[0], 0, 1e-15);
    }
}

/* exp(log Q) = Q for every Q; log(exp L) = L for turns of less than a whole one (half angle below pi). */
static void log_and_exp_are_inverse(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double q[4], l[4], back[4], axis[3], size = exp(2 * uniform());
        /* half angles: anything; 1e-20 to 1e-1 off none, off pi / 2 (half a turn) and off pi (a whole turn) */
        double small = pow(10, -10.5 + 9.5 * uniform());
        double half[4] = {PI / 2 * (1 + uniform()), small, PI / 2 + (i % 8 < 4 ? small : -small), PI - small};
        double angle = half[i % 4];
        random_unit(axis, 3);
        l[0] = log(size);
        for (int k = 0; k < 3; k++) l[k + 1] = angle * axis[k];
        vg_quat_exp(l, q);
        CHECK_NEAR(length(q, 4), size, 1e-14 * size);
        vg_quat_log(q, back);
        CHECK_NEAR(back[0], l[0], 1e-14);
        /* close to a whole turn the axis is known only to rounding divided by what is left of the turn */
        double blur = i % 4 == 3 ? 1e-15 / small : i % 4 == 0 ? 1e-15 / sin(angle) : 0;
        if (blur < 1e-3) CHECK_NEAR(apart(back + 1, l + 1, 3), 0, 1e-14 + 8 * blur);
        vg_quat_exp(back, q);
        double again[4];
        vg_quat_exp(l, again);
        CHECK_NEAR(apart(q, again, 4), 0, 2e-15 * size);
    }
}

static void logs_at_the_limits(void)
{
    double l[4], q[4], one[4] = {1, 0, 0, 0}, minus[4] = {-1, 0, 0, 0}, turn[4] = {0, 0, 0, 2}, zero[4] = {0};
    vg_quat_log(one, l);
    CHECK(apart(l, zero, 4) == 0);
    vg_quat_exp(zero, q);
    CHECK(apart(q, one, 4) == 0);
    vg_quat_log(minus, l); /* a whole turn: the axis is free, the length is pi */
    CHECK_NEAR(length(l + 1, 3), PI, 1e-15);
    vg_quat_exp(l, q);
    CHECK_NEAR(apart(q, minus, 4), 0, 1e-15);
    vg_quat_log(turn, l);
    CHECK_NEAR(l[0], log(2), 1e-15);
    CHECK_NEAR(l[3], PI / 2, 1e-15);
    double denormal[4] = {1, 0, 5e-324, 0}; /* its square is 0 */
    vg_quat_log(denormal, l);
    vg_quat_exp(l, q);
    CHECK_NEAR(apart(q, denormal, 4), 0, 1e-300);
    double tiny[4] = {0.25, 1e-170, 0, 0};
    vg_quat_log(tiny, l);
    CHECK_NEAR(l[0], log(0.25), 1e-15);
    CHECK(fabs(l[1]) <= 5e-170);
}

/* Powers: exp(t log Q) turns by t times the angle and scales by the t-th power. */
static void powers_are_fractions_of_the_turn(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double q[4], l[4], third[4], product[4];
        random_unit(q, 4);
        for (int k = 0; k < 4; k++) q[k] *= 1.3;
        vg_quat_log(q, l);
        for (int k = 0; k < 4; k++) l[k] /= 3;
        vg_quat_exp(l, third);
        vg_quat_multiply(third, third, product);
        vg_quat_multiply(third, product, product);
        CHECK_NEAR(apart(product, q, 4), 0, 1e-14);
    }
}

/* (T 3.19): a J = J a. */
static void scale_and_rotation_commute(void)
{
    for (int i = 0; i < ROUNDS; i++) {
        double unit[4], q[4], scale[4] = {0}, a = exp(uniform()), left[4], right[4], r[3], scaled[3], d[3], e[3];
        random_unit(unit, 4), random_unit(r, 3);
        scale[0] = sqrt(a); /* a scale alone is a real quaternion */
        vg_quat_multiply(scale, unit, left);
        vg_quat_multiply(unit, scale, right);
        CHECK(!memcmp(left, right, sizeof left));
        for (int k = 0; k < 4; k++) q[k] = sqrt(a) * unit[k];
        CHECK_NEAR(apart(left, q, 4), 0, 1e-15);
        for (int k = 0; k < 3; k++) scaled[k] = a * r[k];
        vg_quat_apply(q, r, d);
        vg_quat_apply(unit, scaled, e);
        CHECK_NEAR(apart(d, e, 3), 0, 1e-14);
        CHECK_NEAR(length(d, 3), a, 1e-14);
    }
}

TESTS({"the matrix is a rotation, and turns as the quaternion", the_matrix_is_a_rotation_and_turns_as_the_quaternion},
      {"a quarter turn about z takes x to y", a_quarter_turn_about_z_takes_x_to_y},
      {"products turn one after the other", products_turn_one_after_the_other},
      {"between takes r to d", between_takes_r_to_d},
      {"between holds near parallel and near opposite", between_holds_near_parallel_and_near_opposite},
      {"parallel is no turn, opposite always the same half turn", parallel_is_no_turn_and_opposite_always_the_same},
      {"log and exp are inverse to each other", log_and_exp_are_inverse},
      {"logs at the limits", logs_at_the_limits},
      {"powers are fractions of the turn", powers_are_fractions_of_the_turn},
      {"scale and rotation commute", scale_and_rotation_commute})
