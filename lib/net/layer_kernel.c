/* layer_kernel.c: activation functions of gates, mesh convolutions and losses, eight chains side by side (in binary32
 * one AVX2 register). Sums are in a fixed order. Products with large matrices use BLAS.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/layer_kernel.h"
#ifndef VGI_NET_DOUBLE
#include "core/wide.h"
#endif

#include <math.h>

#define INLINE static inline __attribute__((always_inline))

INLINE net_lanes same(real x)
{
    return (net_lanes){0} + x;
}

/* ---- activation functions ---- */

#ifdef VGI_NET_DOUBLE
INLINE net_lanes exponential(net_lanes x)
{
    for (int i = 0; i < NET_LANES; i++) x[i] = exp(x[i]);
    return x;
}
#else
typedef int32_t net_bits __attribute__((vector_size(NET_LANES * sizeof(int32_t))));

/* Cephes' expf: 2^k times a polynomial, to 2 units in the last place */
INLINE net_lanes exponential(net_lanes x)
{
    for (int i = 0; i < NET_LANES; i++) x[i] = x[i] > 87.0f ? 87.0f : x[i] < -87.0f ? -87.0f : x[i];
    const net_lanes shift = same(12582912.0f); /* 1.5 * 2^23: adding it rounds to integers */
    net_lanes k = (x * 1.44269504f + shift) - shift, r = x - k * 0.693359375f + k * 2.12194440e-4f, p = same(1.9875691500e-4f);
    p = p * r + 1.3981999507e-3f;
    p = p * r + 8.3334519073e-3f;
    p = p * r + 4.1665795894e-2f;
    p = p * r + 1.6666665459e-1f;
    p = p * r + 5.0000001201e-1f;
    net_bits power = (__builtin_convertvector(k, net_bits) + 127) << 23;
    return (p * r * r + r + 1.0f) * (net_lanes)power;
}
#endif

INLINE net_lanes logistic(net_lanes x)
{
    return same(1) / (exponential(-x) + (real)1);
}

INLINE net_lanes tangent(net_lanes x)
{
    return same(1) - same(2) / (exponential(x + x) + (real)1);
}

static void all_tanh(net_lanes *x, size_t rows)
{
    for (size_t i = 0; i < rows; i++) x[i] = tangent(x[i]);
}

static void all_tanh_back(size_t rows, const net_lanes *y, const net_lanes *x, net_lanes *d)
{
    const net_lanes one = same(1);
    for (size_t i = 0; i < rows; i++) d[i] *= one - (y[i] - x[i]) * (y[i] - x[i]);
}

static void all_gates(size_t n, net_lanes *g, const net_lanes *before, net_lanes *c, net_lanes *h)
{
    for (size_t k = 0; k < n; k++) {
        net_lanes i = logistic(g[k]), f = logistic(g[n + k]), u = tangent(g[2 * n + k]), o = logistic(g[3 * n + k]);
        c[k] = f * before[k] + i * u;
        h[k] = o * tangent(c[k]);
        g[k] = i, g[n + k] = f, g[2 * n + k] = u, g[3 * n + k] = o;
    }
}

static void all_gates_back(size_t n, const net_lanes *g, const net_lanes *before, const net_lanes *c,
                           const net_lanes *dh, net_lanes *dc, net_lanes *d)
{
    const net_lanes one = same(1);
    for (size_t k = 0; k < n; k++) {
        net_lanes i = g[k], f = g[n + k], u = g[2 * n + k], o = g[3 * n + k], t = tangent(c[k]);
        net_lanes e = dc[k] + dh[k] * o * (one - t * t);
        d[k] = e * u * i * (one - i);
        d[n + k] = e * before[k] * f * (one - f);
        d[2 * n + k] = e * i * (one - u * u);
        d[3 * n + k] = dh[k] * t * o * (one - o);
        dc[k] = e * f;
    }
}

/* ---- convolutions ---- */

enum { MOST_CHANNELS = 16 };

INLINE void neighbour_means(const net_neighbours *g, size_t c, const net_lanes *x, net_lanes *m)
{
    for (size_t v = 0; v < g->n; v++) {
        net_lanes sum[MOST_CHANNELS];
        for (size_t k = 0; k < c; k++) sum[k] = (net_lanes){0};
        uint32_t begin = g->first[v], end = g->first[v + 1];
        for (uint32_t i = begin; i < end; i++) {
            const net_lanes *u = x + c * g->to[i];
            for (size_t k = 0; k < c; k++) sum[k] += u[k];
        }
        real share = end > begin ? (real)1 / (real)(end - begin) : 0;
        for (size_t k = 0; k < c; k++) m[c * v + k] = sum[k] * share;
    }
}

/* y (+)= x times a matrix of c x c, per vertex; by_rows: rows of the matrix belong to the inputs */
INLINE void multiply_vertices(size_t n, size_t c, const net_lanes *x, const real *matrix, bool by_rows, const real *bias, bool add,
                  net_lanes *y)
{
    real w[MOST_CHANNELS * MOST_CHANNELS];
    for (size_t i = 0; i < c; i++)
        for (size_t j = 0; j < c; j++) w[i * c + j] = by_rows ? matrix[i * c + j] : matrix[j * c + i];
    for (size_t v = 0; v < n; v++) {
        net_lanes out[MOST_CHANNELS];
        for (size_t j = 0; j < c; j++) out[j] = add ? y[c * v + j] : bias ? same(bias[j]) : (net_lanes){0};
        for (size_t i = 0; i < c; i++) {
            net_lanes in = x[c * v + i];
            for (size_t j = 0; j < c; j++) out[j] += in * w[i * c + j];
        }
        for (size_t j = 0; j < c; j++) y[c * v + j] = out[j];
    }
}

INLINE void convolve_by(const net_neighbours *g, const net_convolution *p, size_t c, const net_lanes *x, net_lanes *y,
                        net_lanes *work)
{
    neighbour_means(g, c, x, work);
    multiply_vertices(g->n, c, x, p->own, !p->mirrored, p->bias, false, y);
    multiply_vertices(g->n, c, work, p->mean, !p->mirrored, NULL, true, y);
    all_tanh(y, c * g->n);
}

/* w += sum over vertices and lanes of x d' (c x c), in blocks that stay in registers */
INLINE void add_products(size_t n, size_t c, const net_lanes *x, const net_lanes *d, bool turned, real *w)
{
    enum { ROWS = 3, COLUMNS = 4 };
    for (size_t i = 0; i < c; i += ROWS)
        for (size_t j = 0; j < c; j += COLUMNS) {
            net_lanes sum[ROWS][COLUMNS];
            size_t rows = c - i < ROWS ? c - i : ROWS, columns = c - j < COLUMNS ? c - j : COLUMNS;
            for (size_t a = 0; a < ROWS; a++)
                for (size_t b = 0; b < COLUMNS; b++) sum[a][b] = (net_lanes){0};
            if (rows == ROWS && columns == COLUMNS)
                for (size_t v = 0; v < n; v++)
                    for (size_t a = 0; a < ROWS; a++)
                        for (size_t b = 0; b < COLUMNS; b++) sum[a][b] += x[c * v + i + a] * d[c * v + j + b];
            else
                for (size_t v = 0; v < n; v++)
                    for (size_t a = 0; a < rows; a++)
                        for (size_t b = 0; b < columns; b++) sum[a][b] += x[c * v + i + a] * d[c * v + j + b];
            for (size_t a = 0; a < rows; a++)
                for (size_t b = 0; b < columns; b++)
                    for (int k = 0; k < NET_LANES; k++)
                        w[turned ? (j + b) * c + i + a : (i + a) * c + j + b] += sum[a][b][k];
        }
}

/* transpose of the mean: a vertex adds its share to the gradient of each neighbour */
INLINE void add_shares(const net_neighbours *g, size_t c, const net_lanes *e, net_lanes *dx)
{
    for (size_t v = 0; v < g->n; v++)
        for (uint32_t i = g->first[v]; i < g->first[v + 1]; i++)
            for (size_t k = 0; k < c; k++) dx[c * v + k] += e[c * g->to[i] + k];
}

INLINE void convolve_back_by(const net_neighbours *g, const net_convolution *p, size_t c, const net_lanes *x,
                             const net_lanes *y, net_lanes *dy, net_lanes *dx, real *down, real *dmean, real *dbias,
                             net_lanes *work)
{
    net_lanes *m = work, *e = work + c * g->n, sum[MOST_CHANNELS];
    for (size_t k = 0; k < c; k++) sum[k] = (net_lanes){0};
    for (size_t v = 0; v < g->n; v++)
        for (size_t k = 0; k < c; k++) {
            net_lanes t = y[c * v + k];
            sum[k] += dy[c * v + k] *= same(1) - t * t;
        }
    for (size_t k = 0; k < c; k++)
        for (int i = 0; i < NET_LANES; i++) dbias[k] += sum[k][i];
    neighbour_means(g, c, x, m);
    add_products(g->n, c, x, dy, p->mirrored, down);
    add_products(g->n, c, m, dy, p->mirrored, dmean);
    multiply_vertices(g->n, c, dy, p->own, p->mirrored, NULL, false, dx);
    multiply_vertices(g->n, c, dy, p->mean, p->mirrored, NULL, false, e);
    for (size_t v = 0; v < g->n; v++) {
        uint32_t n = g->first[v + 1] - g->first[v];
        for (size_t k = 0; k < c; k++) e[c * v + k] *= n ? (real)1 / (real)n : 0;
    }
    add_shares(g, c, e, dx);
}

static void convolve_any(const net_neighbours *g, const net_convolution *p, const net_lanes *x, net_lanes *y,
                         net_lanes *work)
{
    if (p->channels == 9) convolve_by(g, p, 9, x, y, work);
    else if (p->channels == 12) convolve_by(g, p, 12, x, y, work);
    else convolve_by(g, p, p->channels, x, y, work);
}

static void convolve_back_any(const net_neighbours *g, const net_convolution *p, const net_lanes *x,
                              const net_lanes *y, net_lanes *dy, net_lanes *dx, real *down, real *dmean, real *dbias,
                              net_lanes *work)
{
    if (p->channels == 9) convolve_back_by(g, p, 9, x, y, dy, dx, down, dmean, dbias, work);
    else if (p->channels == 12) convolve_back_by(g, p, 12, x, y, dy, dx, down, dmean, dbias, work);
    else convolve_back_by(g, p, p->channels, x, y, dy, dx, down, dmean, dbias, work);
}

/* ---- losses ---- */

INLINE net_lanes exchanged(net_lanes x)
{
    return (net_lanes){x[4], x[5], x[6], x[7], x[0], x[1], x[2], x[3]};
}

/* Partial sums of a few hundred rows are in `real`, their sum in binary64. */
static void all_differences(size_t rows, const net_lanes *x, const net_lanes *y, const net_lanes *z, unsigned turn,
                            double *to_y, double *to_z)
{
    enum { PART = 256 };
    for (int k = 0; k < NET_LANES; k++) to_y[k] = to_z[k] = 0;
    for (size_t from = 0; from < rows; from += PART) {
        net_lanes a = {0}, b = {0};
        for (size_t i = from; i < rows && i < from + PART; i++) {
            net_lanes d = x[i] - y[i];
            a += d * d;
            if (!z) continue;
            net_lanes c = x[i] - (turn ? exchanged(z[i]) : z[i]);
            b += c * c;
        }
        for (int k = 0; k < NET_LANES; k++) to_y[k] += (double)a[k], to_z[k] += (double)b[k];
    }
}

static void all_pull(size_t rows, const net_lanes *x, const net_lanes *y, const net_lanes *z, unsigned turn,
                     const net_lanes *by, net_lanes *g)
{
    const net_lanes a = by[0], b = by[1];
    for (size_t i = 0; i < rows; i++) {
        net_lanes d = a * (x[i] - y[i]);
        if (z) d += b * (x[i] - (turn ? exchanged(z[i]) : z[i]));
        g[i] += d;
    }
}

#ifdef VGI_NET_DOUBLE
const net_layer_kernel vgi_double_layer_kernel = {all_tanh, all_tanh_back, all_gates, all_gates_back, convolve_any, convolve_back_any,
                                                  all_differences, all_pull};
#else
const net_layer_kernel VGI_OF_SET(net_layer_kernel) = {all_tanh, all_tanh_back, all_gates, all_gates_back, convolve_any,
                                                       convolve_back_any, all_differences, all_pull};
#endif
