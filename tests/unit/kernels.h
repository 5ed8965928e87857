/* kernels.h: checks of the kernels of signals, networks and fronts, each beside a plain loop, for test_isa.c,
 * and how they are run under every instruction set.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TEST_KERNELS_H
#define VG_TEST_KERNELS_H

#include "net/layer_kernel.h"
#include "net/product_kernel.h"
#include "numeric/fronts_kernel.h"
#include "signal/signal_kernel.h"
#include "test.h"

/* Call `run` once for each set, and come back to the widest. */
static void under_each(void (*run)(void))
{
    vg_err e;
    const char *set;
    for (size_t i = 0; (set = vg_isa_at(i)); i++) {
        CHECK(vg_isa_choose(set, &e) == VG_OK);
        CHECK_TEXT(vg_isa(), set);
        int before = test_bad;
        run();
        if (test_bad > before) printf("with %s\n", set);
    }
    CHECK(vg_isa_choose(NULL, &e) == VG_OK);
}

/* In (-1, 1), without a pattern. */
__attribute__((noinline, noclone)) static double ripple(size_t i)
{
    return sin(2.3 * (double)i + 0.7 * (double)(i % 17));
}

/* ---- signals ---- */

static void check_layout_pull(void)
{
    enum { MOST = 21 };
    double want[MOST], x[MOST], y[MOST], bx[MOST], by[MOST];
    for (size_t n = 0; n <= MOST; n++) {
        for (size_t j = 0; j < n; j++) {
            want[j] = 1.5 + ripple(j), x[j] = ripple(100 + j), y[j] = ripple(200 + j);
            bx[j] = ripple(300 + j), by[j] = ripple(400 + j);
        }
        if (n > 3) x[3] = 0.25, y[3] = -0.5; /* where the point is */
        vgi_pull p = {.count = n, .want = want, .x = x, .y = y, .least = 0.1, .at = {0.25, -0.5}, .bx = bx, .by = by};
        double stress = 0, sum[2] = {0, 0};
        vgi_signal_kernel_now()->pull(&p);
        for (size_t j = 0; j < n; j++) {
            double u = 0.25 - x[j], v = -0.5 - y[j], d = hypot(u, v), pull = want[j] / fmax(d, 0.1);
            stress += (d - want[j]) * (d - want[j]), sum[0] += pull * u, sum[1] += pull * v;
            CHECK_NEAR(bx[j], ripple(300 + j) - pull * u, 1e-14 * (1 + pull));
            CHECK_NEAR(by[j], ripple(400 + j) - pull * v, 1e-14 * (1 + pull));
        }
        CHECK_NEAR(p.stress, stress, 1e-13 * (1 + stress));
        for (int k = 0; k < 2; k++) CHECK_NEAR(p.sum[k], sum[k], 1e-12);
    }
}

/* What is left is at right angles to the rows, which are a basis; what was taken is in the coefficients. */
static void check_projection(void)
{
    enum { N = 19 };
    for (size_t rows = 0; rows <= 9; rows++) {
        double q[9 * N] = {0}, v[N], c[9];
        for (size_t j = 0; j < rows; j++) q[j * N + (7 * j + 3) % N] = j % 2 ? 1 : -1;
        for (size_t i = 0; i < N; i++) v[i] = ripple(i);
        for (size_t j = 0; j < rows; j++) c[j] = 3;
        vgi_signal_kernel_now()->project(q, rows, N, v, c);
        bool taken[N] = {false};
        for (size_t j = 0; j < rows; j++) {
            size_t at = (7 * j + 3) % N;
            taken[at] = true;
            CHECK_NEAR(c[j], 3 + (j % 2 ? 1 : -1) * ripple(at), 1e-15);
        }
        for (size_t i = 0; i < N; i++) CHECK_NEAR(v[i], taken[i] ? 0 : ripple(i), 1e-15);
    }
}

static void check_distances(void)
{
    enum { N = 7, MOST = 20 };
    double v[MOST], others[N * MOST], far[N];
    for (size_t i = 0; i < MOST; i++) v[i] = ripple(50 + i);
    for (size_t i = 0; i < N * MOST; i++) others[i] = ripple(i);
    for (size_t m = 1; m <= MOST; m++) {
        vgi_signal_kernel_now()->distances(v, others, N, MOST, m, far);
        for (size_t j = 0; j < N; j++) {
            double sum = 0;
            for (size_t c = 0; c < m; c++) sum += (v[c] - ripple(j * MOST + c)) * (v[c] - ripple(j * MOST + c));
            CHECK_NEAR(far[j], sum, 1e-14);
        }
    }
}

/* Widths with and without numbers over, rows with and without rows over. */
static void check_through(void)
{
    enum { N = 21, MOST = 11 };
    double v[N], a[N * MOST], product[MOST], sum[N];
    for (size_t i = 0; i < N; i++) v[i] = ripple(50 + i);
    for (size_t i = 0; i < N * MOST; i++) a[i] = ripple(i);
    for (size_t n = 1; n <= N; n++)
        for (size_t m = 0; m <= MOST; m++) {
            double expect[N] = {0};
            vgi_signal_kernel_now()->through(n, m, v, a, product, sum);
            for (size_t c = 0; c < m; c++) {
                double t = 0;
                for (size_t i = 0; i < n; i++) t += v[i] * ripple(c * n + i);
                CHECK_NEAR(product[c], t, 1e-14);
                for (size_t i = 0; i < n; i++) expect[i] += t * ripple(c * n + i);
            }
            for (size_t i = 0; i < n; i++) CHECK_NEAR(sum[i], expect[i], 1e-13);
        }
}

static void check_signals(void)
{
    check_layout_pull();
    check_projection();
    check_distances();
    check_through();
}

/* ---- networks ---- */

static const double tiny = 1e-6; /* some units in the last place of binary32 */

static void fill(net_lanes *x, size_t rows, size_t from)
{
    for (size_t i = 0; i < rows; i++)
        for (size_t k = 0; k < NET_LANES; k++) x[i][k] = (float)(3 * ripple(from + NET_LANES * i + k));
}

static double logistic_of(double x)
{
    return 1 / (1 + exp(-x));
}

static void check_gates(void)
{
    enum { N = 5 };
    net_lanes g[4 * N], in[4 * N], before[N], c[N], h[N];
    fill(in, 4 * N, 1), fill(before, N, 2000);
    in[0][0] = 200, in[0][1] = -200; /* no infinities */
    memcpy(g, in, sizeof g);
    net_layer_kernel_now()->gates(N, g, before, c, h);
    for (size_t i = 0; i < N; i++)
        for (size_t k = 0; k < NET_LANES; k++) {
            double a = logistic_of(in[i][k]), f = logistic_of(in[N + i][k]), u = tanh(in[2 * N + i][k]);
            double o = logistic_of(in[3 * N + i][k]), state = f * before[i][k] + a * u;
            CHECK_NEAR(g[i][k], a, tiny);
            CHECK_NEAR(g[N + i][k], f, tiny);
            CHECK_NEAR(g[2 * N + i][k], u, tiny);
            CHECK_NEAR(g[3 * N + i][k], o, tiny);
            CHECK_NEAR(c[i][k], state, 4 * tiny);
            CHECK_NEAR(h[i][k], o * tanh(state), 4 * tiny);
        }
}

/* y = tanh(x own + mean of the neighbours' x times mean + bias), matrices transposed in a mirrored layer; the last vertex
 * has no neighbours. */
static void check_convolution(size_t channels, bool mirrored)
{
    enum { N = 4, MOST = 12 };
    static const uint32_t first[N + 1] = {0, 2, 3, 6, 6}, to[6] = {1, 2, 0, 0, 1, 3};
    float own[MOST * MOST], mean[MOST * MOST], bias[MOST];
    net_lanes x[N * MOST], y[N * MOST], work[N * MOST];
    for (size_t i = 0; i < channels * channels; i++) own[i] = (float)ripple(i) / 4, mean[i] = (float)ripple(500 + i) / 4;
    for (size_t i = 0; i < channels; i++) bias[i] = (float)ripple(900 + i) / 4;
    fill(x, N * channels, 7);
    net_layer_kernel_now()->convolve(&(net_neighbours){N, first, to},
                                     &(net_convolution){channels, own, mean, bias, mirrored}, x, y, work);
    for (size_t v = 0; v < N; v++)
        for (size_t j = 0; j < channels; j++)
            for (size_t k = 0; k < NET_LANES; k++) {
                double sum = bias[j];
                for (size_t i = 0; i < channels; i++) {
                    size_t at = mirrored ? j * channels + i : i * channels + j;
                    double around = 0;
                    for (uint32_t n = first[v]; n < first[v + 1]; n++) around += x[channels * to[n] + i][k];
                    if (first[v + 1] > first[v]) around /= first[v + 1] - first[v];
                    sum += (double)x[channels * v + i][k] * own[at] + around * mean[at];
                }
                CHECK_NEAR(y[channels * v + j][k], tanh(sum), 4 * tiny);
            }
}

/* Rows and columns that fill no block, one, and several with a rest. */
static void check_product(size_t rows, size_t columns)
{
    enum { MOST = 61 };
    static float w[MOST * MOST];
    static net_lanes x[MOST], y[MOST], before[MOST];
    for (size_t i = 0; i < rows * columns; i++) w[i] = (float)ripple(i + rows);
    for (int turned = 0; turned < 2; turned++)
        for (int add = 0; add < 2; add++) {
            size_t ins = turned ? rows : columns, outs = turned ? columns : rows;
            fill(x, ins, 11), fill(before, outs, 5000);
            memcpy(y, before, sizeof y);
            if (turned) net_product_kernel_now()->multiply_turned(rows, columns, w, x, add, y);
            else net_product_kernel_now()->multiply(rows, columns, w, x, add, y);
            for (size_t o = 0; o < outs; o++)
                for (size_t k = 0; k < NET_LANES; k++) {
                    double sum = add ? before[o][k] : 0;
                    for (size_t i = 0; i < ins; i++)
                        sum += (double)x[i][k] * w[turned ? i * columns + o : o * columns + i];
                    CHECK_NEAR(y[o][k], sum, 100 * tiny);
                }
        }
}

static void check_products(void)
{
    static const size_t sizes[][2] = {{1, 1}, {6, 2}, {5, 12}, {13, 27}, {61, 5}, {60, 61}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) check_product(sizes[i][0], sizes[i][1]);
}

static void check_losses(void)
{
    enum { ROWS = 300 };
    net_lanes x[ROWS], y[ROWS], z[ROWS], g[ROWS], by[2];
    double to_y[NET_LANES], to_z[NET_LANES];
    fill(x, ROWS, 3), fill(y, ROWS, 3000), fill(z, ROWS, 6000), fill(by, 2, 9000);
    for (unsigned turn = 0; turn <= 4; turn += 4) {
        fill(g, ROWS, 12000);
        net_layer_kernel_now()->differences(ROWS, x, y, z, turn, to_y, to_z);
        net_layer_kernel_now()->pull(ROWS, x, y, z, turn, by, g);
        for (size_t k = 0; k < NET_LANES; k++) {
            double a = 0, b = 0;
            for (size_t i = 0; i < ROWS; i++) {
                double d = (double)x[i][k] - y[i][k], c = (double)x[i][k] - z[i][(k + turn) % NET_LANES];
                double was = (float)(3 * ripple(12000 + NET_LANES * i + k));
                a += d * d, b += c * c;
                CHECK_NEAR(g[i][k], was + by[0][k] * d + by[1][k] * c, 40 * tiny);
            }
            CHECK_NEAR(to_y[k] / a, 1, 20 * tiny);
            CHECK_NEAR(to_z[k] / b, 1, 20 * tiny);
        }
    }
}

static void check_layers(void)
{
    check_gates();
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        check_convolution(9, mirrored);
        check_convolution(12, mirrored);
        check_convolution(5, mirrored);
    }
    check_losses();
    check_products();
}

/* ---- fronts ---- */

/* A front of a known factor gives that back, and in u what its rows below leave of the matrix. */
static void check_front(size_t m, size_t c)
{
    enum { MOST = 23 };
    double L[MOST * MOST] = {0}, l[MOST * MOST], u[MOST * MOST], again[MOST * MOST];
    size_t left = m - c;
    for (size_t j = 0; j < c; j++)
        for (size_t i = j; i < m; i++) L[j * m + i] = i == j ? 2 + ripple(j) : ripple(9 + 31 * j + i) / 2;
    for (size_t j = 0; j < m; j++)
        for (size_t i = 0; i < m; i++) {
            double sum = i >= c && j >= c ? ripple(5000 + i * j) : 0;
            for (size_t k = 0; k < c; k++) sum += L[k * m + i] * L[k * m + j];
            if (j < c) l[j * m + i] = sum;
            else if (i >= c) u[(j - c) * left + i - c] = again[(j - c) * left + i - c] = sum;
        }
    CHECK(vgi_fronts_kernel_now()->eliminate(m, c, l, u) == c);
    vgi_fronts_kernel_now()->complete(m, c, L, again);
    for (size_t j = 0; j < c; j++)
        for (size_t i = j; i < m; i++) CHECK_NEAR(l[j * m + i], L[j * m + i], 1e-11);
    for (size_t j = 0; j < left; j++)
        for (size_t i = j; i < left; i++) {
            CHECK_NEAR(u[j * left + i], ripple(5000 + (c + i) * (c + j)), 1e-11);
            CHECK_NEAR(again[j * left + i], ripple(5000 + (c + i) * (c + j)), 1e-13);
        }
}

/* Every entry of the lower triangle arrives at its place. */
static void check_scatter(bool with_l)
{
    enum { M = 30, C = 12, LD = 20, N = 17 };
    uint32_t at[N], to[N], run[N];
    double from[LD * LD], l[M * C] = {0}, u[(M - C) * (M - C)] = {0}, want[M * M] = {0};
    for (size_t i = 0; i < N; i++) at[i] = (uint32_t)(i + (i > 4) + (i > 13)), to[i] = (uint32_t)(i + 1 + (i > 8) * 9);
    for (size_t i = 0; i < LD * LD; i++) from[i] = ripple(i);
    for (size_t j = 0; j < N; j++)
        for (size_t i = j; i < N; i++) want[to[j] * M + to[i]] = from[at[j] * LD + at[i]];
    vgi_fronts_kernel_now()->scatter(N, at, to, run, LD, from, M, C, with_l ? l : NULL, u);
    for (size_t j = 0; j < M; j++)
        for (size_t i = j; i < M; i++) {
            if (j < C) CHECK(l[j * M + i] == (with_l ? want[j * M + i] : 0));
            else CHECK(u[(j - C) * (M - C) + i - C] == want[j * M + i]);
        }
}

static void check_fronts(void)
{
    for (size_t m = 1; m <= 23; m++)
        for (size_t c = 0; c <= m; c += 1 + m / 6) check_front(m, c);
    double bad[4] = {1, 2, 0, 1}; /* 1 2; 2 1 */
    CHECK(vgi_fronts_kernel_now()->eliminate(2, 2, bad, NULL) < 2);
    check_scatter(true);
    check_scatter(false);
}

/* ---- under every set ---- */

static void signals_are_fitted(void)
{
    under_each(check_signals);
}

static void layers_are_passed(void)
{
    under_each(check_layers);
}

static void fronts_are_eliminated(void)
{
    under_each(check_fronts);
}

#endif
