/* test_signal.c: the numeric parts of continuous signals: principal components, positions, thin plates, splines in time,
 * the choice of a layout. Witness values are those of a NumPy prototype (dense eigenvectors, least squares by SVD) on the
 * same formula.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "dense.h"
#include "signal/rows_kernel.h"
#include "signal/signal.h"

enum { N = 48, D = 30 };

/* Eight shapes' worth of closed motion: its layout by distances alone has a saddle. */
static double *poses(void)
{
    double *y = room(N * D, sizeof *y);
    for (size_t i = 0; i < N; i++)
        for (size_t c = 0; c < D; c++) {
            double t = 2 * M_PI * (double)i / (N - 1);
            y[i * D + c] = sin(t * (double)(1 + c % 4) + 0.7 * (double)c) + 0.3 * cos(t * (double)(2 + c % 3) + 1.3 * (double)c);
        }
    return y;
}

static vgi_basis basis(void)
{
    vgi_basis b;
    if (vgi_basis_make(&b, poses(), N, D, 2, NULL) < 0) abort();
    return b;
}

static double largest(const double *a, const double *b, size_t n)
{
    double most = 0;
    for (size_t i = 0; i < n; i++) most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

/* ---- principal components ---- */

static void principal_components(void)
{
    vgi_basis b = basis();
    double *y = poses();
    CHECK(b.rank == 8);
    CHECK_NEAR(b.value[0], 138.02760666, 1e-7);
    CHECK_NEAR(b.value[1], 133.1621822, 1e-7);
    CHECK_NEAR(b.value[2], 116.16425774, 1e-7);
    for (size_t i = 0; i < b.rank; i++)
        for (size_t j = 0; j < b.rank; j++) {
            double sum = 0;
            for (size_t c = 0; c < D; c++) sum += b.vectors[i * D + c] * b.vectors[j * D + c];
            CHECK_NEAR(sum, i == j, 1e-14);
        }
    for (size_t i = 0; i < N; i++)
        for (size_t c = 0; c < D; c++) {
            double sum = b.mean[c];
            for (size_t j = 0; j < b.rank; j++) sum += b.x[i * b.rank + j] * b.vectors[j * D + c];
            CHECK_NEAR(sum, y[i * D + c], 1e-13);
        }
    free(y);
    vgi_basis_clear(&b);
}

/* What is left without the last vectors is their part, point by point. */
static void errors_of_fewer_vectors(void)
{
    vgi_basis b = basis();
    double of_frame[N], most = 0, square = 0;
    for (size_t m = 0; m <= b.rank; m += 4) {
        vgi_error error = {.of_frame = of_frame};
        if (vgi_basis_error(&b, b.x, b.rank, m, 2, &error, NULL) < 0) abort();
        most = square = 0;
        for (size_t i = 0; i < N; i++)
            for (size_t p = 0; p < D / 3; p++) {
                double far = 0;
                for (size_t k = 3 * p; k < 3 * p + 3; k++) {
                    double left = 0;
                    for (size_t j = m; j < b.rank; j++) left += b.x[i * b.rank + j] * b.vectors[j * D + k];
                    far += left * left;
                }
                most = fmax(most, sqrt(far));
                square += far;
                CHECK(sqrt(far) <= of_frame[i] + 1e-13);
            }
        CHECK_NEAR(error.most, most, 1e-13);
        CHECK_NEAR(error.rms, sqrt(square / N / (D / 3)), 1e-13);
    }
    CHECK_NEAR(most, 0, 1e-13);
    vgi_basis_clear(&b);
}

/* Poses that are nearly alike, far away from the origin, and more of them than they have numbers. */
static void components_of_small_motion(void)
{
    enum { MANY = 40, FEW = 12 };
    double *y = room(MANY * FEW, sizeof *y), *kept = room(MANY * FEW, sizeof *kept);
    for (size_t i = 0; i < MANY * FEW; i++) y[i] = kept[i] = 1000 + noise() * pow(10, -(double)(i % FEW) / 2);
    vgi_basis b;
    if (vgi_basis_make(&b, y, MANY, FEW, 1, NULL) < 0) abort();
    CHECK(b.rank == FEW);
    for (size_t i = 0; i < MANY; i++)
        for (size_t c = 0; c < FEW; c++) {
            double sum = b.mean[c];
            for (size_t j = 0; j < b.rank; j++) sum += b.x[i * b.rank + j] * b.vectors[j * FEW + c];
            CHECK_NEAR(sum, kept[i * FEW + c], 1e-11);
        }
    vgi_basis_clear(&b);
    y = room(4 * FEW, sizeof *y); /* held still */
    for (size_t i = 0; i < 4 * FEW; i++) y[i] = (double)(i % FEW);
    if (vgi_basis_make(&b, y, 4, FEW, 1, NULL) < 0) abort();
    CHECK(b.rank == 0);
    CHECK_NEAR(b.mean[5], 5, 0);
    vgi_basis_clear(&b);
    free(kept);
}

/* ---- the plane ---- */

static double stress(size_t n, const double *p, const double *distance)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < i; j++) {
            double off = hypot(p[2 * i] - p[2 * j], p[2 * i + 1] - p[2 * j + 1]) - distance[i * n + j];
            sum += off * off;
        }
    return sum;
}

static double *distances(const vgi_basis *b)
{
    double *d = room(N * N, sizeof *d);
    vgi_distances(N, b->rank, b->x, b->rank, d);
    for (size_t i = 0; i < N * N; i++) d[i] = sqrt(d[i]);
    return d;
}

static void stress_falls(void)
{
    vgi_basis b = basis();
    double *d = distances(&b), p[2 * N], least = INFINITY;
    for (size_t start = 0; start < 3; start++) {
        vgi_stress_stats f;
        for (size_t i = 0; i < N; i++) p[2 * i] = b.x[i * b.rank + start / 2], p[2 * i + 1] = b.x[i * b.rank + 1 + (start > 0)];
        double before = stress(N, p, d);
        if (vgi_plane_settle(N, d, NULL, p, &f, NULL) < 0) abort();
        CHECK_NEAR(f.stress, stress(N, p, d), 1e-9 * f.stress);
        CHECK(f.stress < before);
        least = fmin(least, f.stress);
        double again = f.stress; /* at the end nothing more is to be had */
        if (vgi_plane_settle(N, d, NULL, p, &f, NULL) < 0) abort();
        CHECK(f.stress <= again * (1 + 1e-12));
    }
    CHECK_NEAR(least, 3330.544293462945, 0.01); /* the prototype's, stopped at 1e-7 */
    free(d);
    vgi_basis_clear(&b);
}

/* Points of the plane come back from their distances, whatever the start. */
static void flat_shapes_are_met(void)
{
    double at[2 * N], d[N * N], p[2 * N];
    for (size_t i = 0; i < 2 * N; i++) at[i] = noise();
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++) d[i * N + j] = hypot(at[2 * i] - at[2 * j], at[2 * i + 1] - at[2 * j + 1]);
    for (size_t i = 0; i < 2 * N; i++) p[i] = at[i] + 0.2 * noise();
    if (vgi_plane_settle(N, d, NULL, p, NULL, NULL) < 0) abort();
    CHECK_NEAR(stress(N, p, d), 0, 1e-6);
    bool held[N] = {false};
    for (size_t i = 0; i < 2 * N; i++) p[i] = at[i] + 0.2 * noise();
    for (size_t i = 3; i < 6; i++) held[i] = true, p[2 * i] = at[2 * i], p[2 * i + 1] = at[2 * i + 1];
    if (vgi_plane_settle(N, d, held, p, NULL, NULL) < 0) abort();
    CHECK_NEAR(largest(p + 6, at + 6, 6), 0, 0);
    CHECK_NEAR(largest(p, at, 2 * N), 0, 1e-2);
}

/* Held frames: a step is the minimum of Guttman's majorant over the others, so that at the end its gradient, which is
 * that of the stress, is 0 for them. */
static void held_frames_stay(void)
{
    vgi_basis b = basis();
    double *d = distances(&b), p[2 * N];
    bool held[N] = {false};
    held[7] = held[20] = true;
    for (size_t i = 0; i < N; i++) p[2 * i] = b.x[i * b.rank], p[2 * i + 1] = b.x[i * b.rank + 1];
    p[14] = 5, p[15] = -3, p[40] = 0.1, p[41] = 0.2;
    double before = stress(N, p, d);
    if (vgi_plane_settle(N, d, held, p, NULL, NULL) < 0) abort();
    CHECK(p[14] == 5 && p[15] == -3 && p[40] == 0.1 && p[41] == 0.2);
    CHECK(stress(N, p, d) < before);
    double steepest = 0;
    for (size_t i = 0; i < 2 * N; i++) {
        double kept = p[i], h = 1e-5;
        p[i] = kept + h;
        double up = stress(N, p, d);
        p[i] = kept - h;
        double down = stress(N, p, d);
        p[i] = kept;
        if (!held[i / 2]) steepest = fmax(steepest, fabs(up - down) / (2 * h));
    }
    CHECK(steepest < 1.0); /* of 1e3 at the start */
    free(d);
    vgi_basis_clear(&b);
}

/* ---- thin plates ---- */

static double phi(double r)
{
    return r > 0 ? r * r * log(r) : 0;
}

/* The interpolant by its definition: coefficients orthogonal to 1, x, y at all points. */
static void plate_is_the_interpolant(void)
{
    enum { POINTS = 20, M = 2, ALL = POINTS + 3 };
    double p[2 * POINTS], x[M * POINTS], a[ALL * ALL] = {0}, right[ALL * M] = {0}, c[POINTS * M];
    for (size_t i = 0; i < 2 * POINTS; i++) p[i] = noise(), x[i] = noise();
    for (size_t i = 0; i < POINTS; i++) {
        const double line[3] = {1, p[2 * i], p[2 * i + 1]};
        for (size_t j = 0; j < POINTS; j++) a[i * ALL + j] = phi(hypot(p[2 * i] - p[2 * j], p[2 * i + 1] - p[2 * j + 1]));
        for (size_t k = 0; k < 3; k++) a[i * ALL + POINTS + k] = a[(POINTS + k) * ALL + i] = line[k];
        for (size_t k = 0; k < M; k++) right[i * M + k] = x[i * M + k];
    }
    eliminate(a, right, ALL, M);
    vgi_plate s;
    if (vgi_plate_order(&s, POINTS, M, p, x, M, VGI_FARTHEST, NULL) < 0) abort();
    CHECK(s.l == POINTS && s.anchors == 3);
    vgi_plate_solve(&s, s.l, M, x, M, c);
    for (int trial = 0; trial < 50; trial++) {
        double at[2] = {2 * noise(), 2 * noise()}, f[POINTS];
        vgi_plate_functions(&s, s.l, at, f);
        for (size_t k = 0; k < M; k++) {
            double wanted = right[POINTS * M + k] + right[(POINTS + 1) * M + k] * at[0] + right[(POINTS + 2) * M + k] * at[1];
            double found = 0;
            for (size_t j = 0; j < POINTS; j++) {
                wanted += right[j * M + k] * phi(hypot(at[0] - p[2 * j], at[1] - p[2 * j + 1]));
                found += f[j] * c[j * M + k];
            }
            CHECK_NEAR(found, wanted, 1e-8);
        }
    }
    vgi_plate_clear(&s);
}

static double squared_error(const vgi_plate *s, size_t l, size_t m, const double *x)
{
    double *fitted = room(N * m, sizeof *fitted), *spare = room(l * m, sizeof *spare), sum = 0;
    vgi_plate_fitted(s, l, m, x, m, fitted, spare);
    for (size_t i = 0; i < N * m; i++) sum += (fitted[i] - x[i]) * (fitted[i] - x[i]);
    free(fitted);
    free(spare);
    return sum;
}

/* More sites, less error; all, none. The same sites in the same order by name give the same. */
static void every_site_helps(vgi_site_rule rule)
{
    vgi_basis b = basis();
    double p[2 * N], before = INFINITY;
    for (size_t i = 0; i < 2 * N; i++) p[i] = noise();
    vgi_plate s, t;
    if (vgi_plate_order(&s, N, b.rank, p, b.x, b.rank, rule, NULL) < 0) abort();
    CHECK(s.l == N);
    for (size_t l = 3; l <= s.l; l++) {
        double now = squared_error(&s, l, b.rank, b.x);
        CHECK(now <= before * (1 + 1e-12) + 1e-18);
        before = now;
    }
    CHECK_NEAR(before, 0, 1e-18);
    if (vgi_plate_make(&t, N, p, s.site, 12, NULL) < 0) abort();
    CHECK(t.l == 12 && !memcmp(t.site, s.site, 12 * sizeof *s.site));
    double *c = room(N * b.rank, sizeof *c), *d = room(N * b.rank, sizeof *d);
    vgi_plate_solve(&s, 12, b.rank, b.x, b.rank, c);
    vgi_plate_solve(&t, 12, b.rank, b.x, b.rank, d);
    CHECK_NEAR(largest(c, d, 12 * b.rank), 0, 1e-10);
    free(c);
    free(d);
    vgi_plate_clear(&s);
    vgi_plate_clear(&t);
    vgi_basis_clear(&b);
}

static void sites_help(void)
{
    every_site_helps(VGI_FARTHEST);
    every_site_helps(VGI_GAIN);
}

/* The scale, the place and the turn of the plane make no difference; a linear map is met with three sites. */
static void plates_know_no_unit(void)
{
    vgi_basis b = basis();
    double p[2 * N], q[2 * N], linear[N], fitted[2][N * 8], spare[20 * 8];
    for (size_t i = 0; i < N; i++) {
        p[2 * i] = noise(), p[2 * i + 1] = noise();
        q[2 * i] = 700 * (0.6 * p[2 * i] - 0.8 * p[2 * i + 1]) + 1e4, q[2 * i + 1] = 700 * (0.8 * p[2 * i] + 0.6 * p[2 * i + 1]) - 55;
        linear[i] = 3 - 2 * p[2 * i] + 5 * p[2 * i + 1];
    }
    vgi_plate s, t;
    if (vgi_plate_order(&s, N, b.rank, p, b.x, b.rank, VGI_FARTHEST, NULL) < 0 || vgi_plate_make(&t, N, q, s.site, 20, NULL) < 0)
        abort();
    CHECK(t.l == 20);
    vgi_plate_fitted(&s, 20, b.rank, b.x, b.rank, fitted[0], spare);
    vgi_plate_fitted(&t, 20, b.rank, b.x, b.rank, fitted[1], spare);
    CHECK_NEAR(largest(fitted[0], fitted[1], N * b.rank), 0, 1e-9);
    vgi_plate_fitted(&s, 3, 1, linear, 1, fitted[0], spare);
    CHECK_NEAR(largest(fitted[0], linear, N), 0, 1e-13);
    vgi_plate_clear(&s);
    vgi_plate_clear(&t);
    vgi_basis_clear(&b);
}

/* Positions on a line, and all in one place; frames that are there twice. */
static void degenerate_planes(void)
{
    double p[2 * N], x[N], fitted[N], spare[N], c[N];
    for (size_t i = 0; i < N; i++) p[2 * i] = 3 * (double)i / N, p[2 * i + 1] = 4 * (double)i / N - 1, x[i] = sin((double)i);
    vgi_plate s;
    if (vgi_plate_order(&s, N, 1, p, x, 1, VGI_FARTHEST, NULL) < 0) abort();
    CHECK(s.anchors == 2 && s.l == N);
    vgi_plate_fitted(&s, s.l, 1, x, 1, fitted, spare);
    CHECK_NEAR(largest(fitted, x, N), 0, 1e-10);
    vgi_plate_clear(&s);
    for (size_t i = 0; i < 2 * N; i++) p[i] = 4;
    if (vgi_plate_order(&s, N, 1, p, x, 1, VGI_FARTHEST, NULL) < 0) abort();
    CHECK(s.anchors == 1 && s.l == 1);
    double mean = 0, f;
    for (size_t i = 0; i < N; i++) mean += x[i] / N;
    vgi_plate_solve(&s, 1, 1, x, 1, c);
    vgi_plate_functions(&s, 1, p, &f);
    CHECK_NEAR(f * c[0], mean, 1e-14);
    vgi_plate_clear(&s);
    for (size_t i = 0; i < 2 * N; i++) p[i] = i < N ? noise() : p[i - N]; /* each place twice */
    for (size_t i = 0; i < N; i++) x[i] = i < N / 2 ? noise() : x[i - N / 2];
    if (vgi_plate_order(&s, N, 1, p, x, 1, VGI_GAIN, NULL) < 0) abort();
    CHECK(s.l == N / 2);
    vgi_plate_fitted(&s, s.l, 1, x, 1, fitted, spare);
    CHECK_NEAR(largest(fitted, x, N), 0, 1e-10);
    vgi_plate_clear(&s);
}

/* ---- splines in time ---- */

static void spiral(double *p)
{
    for (size_t i = 0; i < N; i++) {
        double t = 0.3 * (double)i + 0.1 * sin((double)i), r = 1 + 0.05 * (double)i;
        p[2 * i] = r * cos(t), p[2 * i + 1] = r * sin(t);
    }
}

static uint32_t *first_numbers(const uint32_t *order, size_t count)
{
    uint32_t *at = room(count, sizeof *at);
    for (size_t i = 0; i < count; i++) {
        size_t k = i;
        for (; k && at[k - 1] > order[i]; k--) at[k] = at[k - 1];
        at[k] = order[i];
    }
    return at;
}

static double curve_error(const vgi_curve *c, const double *p)
{
    double sum = 0, at[2];
    for (size_t i = 0; i < c->n; i++) {
        vgi_curve_at(c, (double)i + 1, at);
        sum += pow(at[0] - p[2 * i], 2) + pow(at[1] - p[2 * i + 1], 2);
    }
    return sum;
}

/* More knots, less error; with all of them none, and the curve is the natural cubic spline through the points. */
static void every_knot_helps(void)
{
    double p[2 * N], t[N], before = INFINITY;
    uint32_t order[N];
    vgi_curve c = {0};
    spiral(p);
    vgi_parameters(N, p, t);
    if (vgi_curve_order(N, p, t, order, NULL) < 0) abort();
    for (size_t count = 2; count <= N; count++) {
        uint32_t *at = first_numbers(order, count);
        vgi_curve_clear(&c);
        if (vgi_curve_fit(&c, N, p, t, at, count, NULL) < 0) abort();
        CHECK(c.k == count + 2);
        double now = curve_error(&c, p);
        CHECK(now <= before * (1 + 1e-10) + 1e-24);
        before = now;
        free(at);
    }
    CHECK_NEAR(before, 0, 1e-22);
    double a[N * N] = {0}, second[2 * N] = {0}; /* of the natural spline, by its definition */
    a[0] = a[N * N - 1] = 1;
    for (size_t i = 1; i + 1 < N; i++) {
        double l = t[i] - t[i - 1], r = t[i + 1] - t[i];
        a[i * N + i - 1] = l, a[i * N + i] = 2 * (l + r), a[i * N + i + 1] = r;
        for (size_t k = 0; k < 2; k++)
            second[2 * i + k] = 6 * ((p[2 * i + 2 + k] - p[2 * i + k]) / r - (p[2 * i + k] - p[2 * i - 2 + k]) / l);
    }
    eliminate(a, second, N, 2);
    for (size_t i = 0; i + 1 < N; i++) {
        double at[2], h = t[i + 1] - t[i];
        vgi_curve_point(&c, t[i] + 0.3 * h, at);
        for (size_t k = 0; k < 2; k++)
            CHECK_NEAR(at[k], 0.7 * p[2 * i + k] + 0.3 * p[2 * i + 2 + k] + h * h / 6 *
                       ((0.343 - 0.7) * second[2 * i + k] + (0.027 - 0.3) * second[2 * i + 2 + k]), 1e-11);
    }
    vgi_curve_clear(&c);
}

/* A control point moves the curve over its four intervals and leaves the rest alone to the last bit; one more of them
 * changes nothing. */
static void control_is_local(void)
{
    double p[2 * N], t[N];
    uint32_t at[] = {0, 4, 9, 13, 20, 22, 30, 37, 41, 47};
    vgi_curve c, moved, more;
    spiral(p);
    vgi_parameters(N, p, t);
    if (vgi_curve_fit(&c, N, p, t, at, 10, NULL) < 0 || vgi_curve_fit(&moved, N, p, t, at, 10, NULL) < 0 ||
        vgi_curve_fit(&more, N, p, t, at, 10, NULL) < 0)
        abort();
    moved.control[2 * 5] += 0.25;
    if (vgi_curve_insert(&more, t[20] + 0.1, NULL) < 0 || vgi_curve_insert(&more, t[2], NULL) < 0) abort();
    CHECK(more.k == c.k + 2);
    size_t changed = 0;
    for (double time = 1; time <= N; time += 0.125) {
        double a[2], b[2], u = vgi_curve_parameter(&c, time);
        vgi_curve_at(&c, time, a);
        vgi_curve_at(&moved, time, b);
        bool inside = u > c.knot[5] && u < c.knot[9];
        CHECK((a[0] != b[0]) == inside || (inside && fabs(a[0] - b[0]) < 1e-9));
        CHECK(inside || (a[0] == b[0] && a[1] == b[1]));
        changed += a[0] != b[0];
        vgi_curve_at(&more, time, b);
        CHECK_NEAR(hypot(a[0] - b[0], a[1] - b[1]), 0, 1e-14);
    }
    CHECK(changed > 50);
    CHECK(vgi_curve_insert(&more, c.knot[3], NULL) == VG_EARG);
    CHECK(vgi_curve_remove(&more, 1, NULL) == VG_EARG && vgi_curve_remove(&more, more.k - 2, NULL) == VG_EARG);
    while (more.k > 4)
        if (vgi_curve_remove(&more, 2, NULL) < 0) abort();
    CHECK(vgi_curve_remove(&more, 2, NULL) == VG_EARG);
    vgi_curve_clear(&c);
    vgi_curve_clear(&moved);
    vgi_curve_clear(&more);
}

static void time_runs_forward(void)
{
    double p[2 * N] = {0}, t[N], slope[N], line[N];
    for (size_t i = 20; i < N; i++) p[2 * i] = noise() * (i % 5 == 0), p[2 * i + 1] = noise(); /* held at first */
    vgi_parameters(N, p, t);
    vgi_monotone_slopes(N, NULL, t, slope);
    double before = -1;
    for (double x = 1; x <= N; x += 0.01) {
        double y = vgi_monotone_at(N, NULL, t, slope, x);
        CHECK(y > before);
        before = y;
    }
    for (size_t i = 0; i < N; i++) CHECK_NEAR(vgi_monotone_at(N, NULL, t, slope, (double)i + 1), t[i], 0);
    for (size_t i = 0; i < N; i++) line[i] = 2 * (double)i;
    vgi_monotone_slopes(N, NULL, line, slope);
    CHECK_NEAR(vgi_monotone_at(N, NULL, line, slope, 7.3), 12.6, 1e-14);
    CHECK_NEAR(vgi_monotone_at(N, NULL, line, slope, -3), 0, 0);
    CHECK_NEAR(vgi_monotone_at(N, NULL, line, slope, 1e9), line[N - 1], 0);
}

/* Cubics whose second derivative is 0 at both ends come back; whole times give what was put in. */
static void natural_splines(void)
{
    double x[2 * N], second[2 * N], spare[N], out[2];
    for (size_t i = 0; i < N; i++) x[2 * i] = 3 * (double)i - 1, x[2 * i + 1] = noise();
    vgi_natural_make(N, 2, x, second, spare);
    for (size_t i = 1; i + 1 < N; i++)
        CHECK_NEAR(second[2 * i - 1] + 4 * second[2 * i + 1] + second[2 * i + 3],
                   6 * (x[2 * i + 3] - 2 * x[2 * i + 1] + x[2 * i - 1]), 1e-12);
    for (size_t i = 0; i < N; i++) {
        vgi_natural_at(N, 2, x, second, (double)i + 1, out);
        CHECK(out[0] == x[2 * i] && out[1] == x[2 * i + 1]);
    }
    vgi_natural_at(N, 2, x, second, 5.25, out);
    CHECK_NEAR(out[0], 3 * 4.25 - 1, 1e-12);
    vgi_natural_make(1, 2, x, second, spare);
    vgi_natural_at(1, 2, x, second, 9, out);
    CHECK_NEAR(out[0], -1, 0);
}

/* ---- layouts ---- */

static void layouts(void)
{
    vgi_basis b = basis();
    double p[2 * N], period, ratio, deviation[3 * (N - 1)], sum = 0;
    vg_layout_trial chosen, tried[VG_LAYOUT_TRIALS];
    size_t ntried;
    double *square = malloc(N * N * sizeof *square);
    if (!square) abort();
    vgi_distances(N, b.rank, b.x, b.rank, square);
    if (vgi_period(N, square, &period, NULL) < 0) abort();
    free(square);
    CHECK_NEAR(period, 47, 0);
    for (int threads = 1; threads <= 3; threads++) {
        if (vgi_layout_choose(N, b.rank, b.x, NULL, 0, NULL, threads, p, &chosen, &period, tried, &ntried, NULL) < 0) abort();
        CHECK(ntried == 2 && chosen.layout == VG_LAYOUT_RING && chosen.weight == 1);
        CHECK_NEAR(tried[0].ratio, 6.502477100937531, 2e-3);
        CHECK_NEAR(tried[1].ratio, 0.1287290426923371, 1e-4);
    }
    CHECK_NEAR(vgi_plane_radius(N, p, NULL), 1, 1e-14);
    if (vgi_layout_judge(N, b.rank, b.x, p, &ratio, deviation, NULL) < 0) abort();
    for (size_t i = 0; i < 3 * (N - 1); i++) sum += deviation[i] / (3 * (N - 1));
    CHECK_NEAR(ratio, chosen.ratio, 1e-12);
    CHECK_NEAR(sum, ratio * ratio, 1e-12);
    const vg_pin pins[] = {{3, {2, 0.5}}, {40, {-1, 1}}, {11, {0, 0}}};
    if (vgi_layout_choose(N, b.rank, b.x, pins, 3, NULL, 2, p, &chosen, &period, tried, &ntried, NULL) < 0) abort();
    for (size_t i = 0; i < 3; i++) CHECK(p[2 * pins[i].frame] == pins[i].at[0] && p[2 * pins[i].frame + 1] == pins[i].at[1]);
    vgi_basis_clear(&b);
}

static void crossings(void)
{
    const double p[] = {0, 0, 2, 0, 2, 1, 1, 1, 1, -1, 0, -1}; /* the fourth stretch goes through the first */
    vgi_crossing *list;
    size_t n;
    if (vgi_crossings(6, p, &list, &n, NULL) < 0) abort();
    CHECK(n == 1);
    CHECK_NEAR(list[0].a, 1.5, 1e-15);
    CHECK_NEAR(list[0].b, 4.5, 1e-15);
    free(list);
}

/* ---- products of rows ---- */

enum { LDA = 61 };

static double *numbers(size_t n)
{
    double *x = room(n, sizeof *x);
    for (size_t i = 0; i < n; i++) x[i] = sin(1 + 1.7 * (double)i + 1e-3 * (double)(i * i));
    return x;
}

/* Sums of exact terms of which each has an error of at most half a unit of its own: 1e-14 is far above that of 20 of them. */
static void multiply_rows(size_t rows, size_t depth, size_t first, size_t end, bool lower)
{
    double *a = numbers(rows * depth), *b = numbers(depth * LDA), *add = numbers(LDA), *packed = room(vgi_packed(rows, depth), 8);
    double *tile = room(depth * VGI_TILE, sizeof *tile), *out = room(rows * LDA, sizeof *out), *to[16], worst = 0;
    for (size_t i = 0; i < rows && lower; i++)
        for (size_t k = i + 1; k < depth; k++) a[i * depth + k] = 0;
    for (size_t i = 0; i < rows; i++) to[i] = (lower ? b : out) + i * LDA;
    for (size_t i = 0; i < rows * LDA; i++) out[i] = 7;
    double *before = room(depth * LDA, sizeof *before);
    memcpy(before, b, depth * LDA * sizeof *b);
    vgi_pack_rows(rows, depth, a, packed);
    vgi_rows_kernel_now()->multiply(&(vgi_product){.rows = rows, .depth = depth, .first = first, .end = end, .a = packed,
                                                   .lower = lower, .b = b, .ldb = LDA, .add = lower ? NULL : add, .to = to,
                                                   .room = tile});
    for (size_t i = 0; i < rows; i++)
        for (size_t c = 0; c < LDA; c++) {
            double sum = lower ? 0 : add[c];
            for (size_t k = 0; k < depth; k++) sum += a[i * depth + k] * before[k * LDA + c];
            if (c < first || c >= end) sum = lower ? before[i * LDA + c] : 7; /* as it was */
            worst = fmax(worst, fabs(to[i][c] - sum));
        }
    CHECK_NEAR(worst, 0, 1e-14);
    free(a), free(b), free(add), free(packed), free(tile), free(out), free(before);
}

static void gram_of_rows(size_t n, size_t width)
{
    double *a = numbers(n * LDA), *g = room(n * (n + 2), sizeof *g), worst = 0;
    vgi_rows_kernel_now()->gram(n, width, a, LDA, g, n + 2);
    vgi_rows_kernel_now()->gram(n, width, a, LDA, g, n + 2); /* added */
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n + 2; j++) {
            double sum = 0;
            for (size_t c = 0; c < width && j <= i; c++) sum += 2 * a[i * LDA + c] * a[j * LDA + c];
            worst = fmax(worst, fabs(g[i * (n + 2) + j] - sum));
        }
    CHECK_NEAR(worst, 0, 1e-13);
    free(a), free(g);
}

static void centred_rows(size_t n, size_t width)
{
    double *a = numbers(n * LDA), *mean = room(width, sizeof *mean), worst = 0;
    vgi_rows_kernel_now()->centre(n, width, a, LDA, mean);
    double *before = numbers(n * LDA);
    for (size_t c = 0; c < LDA; c++) {
        double sum = 0;
        for (size_t i = 0; i < n && c < width; i++) sum += before[i * LDA + c] / (double)n;
        for (size_t i = 0; i < n; i++) worst = fmax(worst, fabs(before[i * LDA + c] - sum - a[i * LDA + c]));
        if (c < width) worst = fmax(worst, fabs(mean[c] - sum));
    }
    CHECK_NEAR(worst, 0, 1e-15);
    free(a), free(before), free(mean);
}

static void products_of_rows(void)
{
    for (size_t set = 0; vg_isa_at(set); set++) {
        if (vg_isa_choose(vg_isa_at(set), NULL) < 0) abort();
        for (size_t rows = 1; rows <= 13; rows++)
            for (size_t end = 1; end <= LDA; end += 4) {
                multiply_rows(rows, 1 + end % 9, end / 3, end, false);
                multiply_rows(rows, rows, end / 2, end, true);
            }
        for (size_t n = 1; n <= 13; n++)
            for (size_t width = 1; width <= LDA; width += 5) gram_of_rows(n, width), centred_rows(n, width);
    }
    if (vg_isa_choose(NULL, NULL) < 0) abort();
}

TESTS({"principal components", principal_components}, {"errors of fewer vectors", errors_of_fewer_vectors},
      {"components of small motion", components_of_small_motion}, {"stress falls", stress_falls},
      {"flat shapes are met", flat_shapes_are_met}, {"held frames stay", held_frames_stay},
      {"a plate is the interpolant", plate_is_the_interpolant}, {"every site helps", sites_help},
      {"plates know no unit", plates_know_no_unit}, {"degenerate planes", degenerate_planes},
      {"every knot helps", every_knot_helps}, {"control is local", control_is_local},
      {"time runs forward", time_runs_forward}, {"natural splines", natural_splines}, {"layouts", layouts},
      {"crossings", crossings}, {"products of rows", products_of_rows})
