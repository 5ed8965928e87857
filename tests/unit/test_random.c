/* test_random.c: random numbers: the published values of the generator, moments of the distributions, independence of
 * streams; medians and percentiles against sorting, running sums against two passes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/random.h"
#include "numeric/stats.h"
#include "test.h"

enum { DRAWS = 200000 };

static void add(vgi_running *r, double x)
{
    vgi_running_merge(r, &(vgi_running){1, x, 0, x});
}

/* The first values of splitmix64 with seed 1234567, as Rosetta Code and the Java class SplittableRandom have them: the
 * state grows by the constant that vgi_random_mix adds. */
static void published_values(void)
{
    static const uint64_t truth[] = {6457827717110365317u, 3203168211198807973u, 9817491932198370423u,
                                     4593380528125082431u, 16408922859458223821u};
    uint64_t state = 1234567;
    for (size_t i = 0; i < 5; i++, state += 0x9e3779b97f4a7c15u) CHECK(vgi_random_mix(state) == truth[i]);
}

/* Standard errors of the mean and of the variance at so many draws are 0.0007 and 0.0003 (uniform), 0.0022 and 0.0032
 * (normal): five of them. */
static void moments(void)
{
    vgi_random r = vgi_random_start(1, 0);
    vgi_running uniform = {0}, normal = {0};
    double cubes = 0, within = 0;
    for (size_t i = 0; i < DRAWS; i++) {
        double u = vgi_random_uniform(&r), x = vgi_random_normal(&r);
        CHECK(u >= 0 && u < 1);
        add(&uniform, u);
        add(&normal, x);
        cubes += x * x * x, within += fabs(x) < 1;
    }
    CHECK_NEAR(uniform.mean, 0.5, 0.0035);
    CHECK_NEAR(uniform.squares / DRAWS, 1.0 / 12, 0.0015);
    CHECK_NEAR(normal.mean, 0, 0.011);
    CHECK_NEAR(vgi_running_deviation(&normal), 1, 0.008);
    CHECK_NEAR(cubes / DRAWS, 0, 0.045);       /* standard error sqrt(15 / draws) = 0.0087 */
    CHECK_NEAR(within / DRAWS, 0.6827, 0.0055); /* of a share p: sqrt(p (1 - p) / draws) = 0.0010 */
}

/* Chi squared of 10 cells has mean 9 and variance 18: 40 is more than seven deviations. */
static void whole_numbers(void)
{
    vgi_random r = vgi_random_start(2, 0);
    size_t count[10] = {0};
    double chi = 0;
    for (size_t i = 0; i < DRAWS; i++) {
        size_t k = vgi_random_below(&r, 10);
        CHECK(k < 10);
        count[k]++;
    }
    for (size_t k = 0; k < 10; k++) {
        double d = (double)count[k] - DRAWS / 10.0;
        chi += d * d / (DRAWS / 10.0);
    }
    CHECK(chi < 40);
}

/* A number is told by seed, stream and counter; streams next to each other do not follow one another. */
static void streams(void)
{
    vgi_random a = vgi_random_start(5, 3), b = vgi_random_start(5, 4), again = vgi_random_start(5, 3);
    double product = 0;
    for (size_t i = 0; i < DRAWS; i++) product += (vgi_random_uniform(&a) - 0.5) * (vgi_random_uniform(&b) - 0.5);
    CHECK_NEAR(product / DRAWS, 0, 5.0 / 12 / sqrt(DRAWS));
    a.counter = 17;
    for (int i = 0; i < 17; i++) vgi_random_bits(&again);
    CHECK(vgi_random_bits(&a) == vgi_random_bits(&again));
    vgi_random other = vgi_random_start(6, 3);
    again.counter = 0;
    CHECK(vgi_random_bits(&other) != vgi_random_bits(&again));
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static void ranks(void)
{
    enum { MOST = 101 };
    vgi_random r = vgi_random_start(3, 0);
    CHECK(vgi_median(NULL, 0) == 0 && vgi_percentile(NULL, 0, 50) == 0 && vgi_mean(NULL, 0) == 0);
    for (size_t n = 1; n <= MOST; n++)
        for (size_t kinds = 1; kinds < 60; kinds += 7) { /* few kinds: many equal numbers */
            double x[MOST], sorted[MOST], work[MOST];
            for (size_t i = 0; i < n; i++) x[i] = sorted[i] = (double)vgi_random_below(&r, kinds);
            qsort(sorted, n, sizeof *sorted, by_value);
            for (size_t rank = 0; rank < n; rank += 9) {
                memcpy(work, x, sizeof work);
                CHECK(vgi_select(work, n, rank) == sorted[rank]);
            }
            memcpy(work, x, sizeof work);
            CHECK(vgi_median(work, n) == sorted[n / 2]);
            for (double p = 0; p <= 100; p += 12.5) {
                memcpy(work, x, sizeof work);
                double answer = vgi_percentile(work, n, p);
                size_t below = 0, up_to = 0;
                for (size_t i = 0; i < n; i++) below += x[i] < answer, up_to += x[i] <= answer;
                CHECK(100 * (double)up_to >= p * (double)n);
                CHECK(100 * (double)below < p * (double)n || below == 0);
            }
        }
}

static void running_sums(void)
{
    enum { N = 1000 };
    double x[N];
    vgi_random r = vgi_random_start(4, 0);
    vgi_running all = {0}, halves[2] = {0};
    for (size_t i = 0; i < N; i++) {
        x[i] = 1e6 + vgi_random_normal(&r);
        add(&all, x[i]);
        add(&halves[i >= N / 3], x[i]);
    }
    const double mean = vgi_mean(x, N);
    double squares = 0;
    for (size_t i = 0; i < N; i++) squares += (x[i] - mean) * (x[i] - mean);
    vgi_running_merge(&halves[0], &halves[1]);
    CHECK_NEAR(all.mean, mean, 1e-8);
    CHECK_NEAR(vgi_running_deviation(&all), sqrt(squares / N), 1e-9);
    CHECK_NEAR(halves[0].mean, all.mean, 1e-8);
    CHECK_NEAR(halves[0].squares, all.squares, 1e-6);
    CHECK(halves[0].max == all.max && halves[0].n == N);
}

TESTS({"published values", published_values}, {"moments", moments}, {"whole numbers", whole_numbers},
      {"streams", streams}, {"ranks", ranks}, {"running sums", running_sums})
