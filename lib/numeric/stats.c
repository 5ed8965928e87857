/* stats.c: mean, spread, median and percentiles of numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/stats.h"

#include <math.h>
#include <stdint.h>

int vgi_by_number(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int vgi_by_index(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

double vgi_mean(const double *x, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += x[i];
    return n ? sum / (double)n : 0;
}

/* Hoare's selection: only the part that contains the rank is processed further. */
double vgi_select(double *x, size_t n, size_t rank)
{
    size_t low = 0, high = n - 1;
    while (low < high) {
        double pivot = x[low + (high - low) / 2];
        size_t i = low, j = high;
        for (;;) {
            while (x[i] < pivot) i++;
            while (x[j] > pivot) j--;
            if (i >= j) break;
            double t = x[i];
            x[i++] = x[j], x[j--] = t;
        }
        if (rank <= j) high = j;
        else low = j + 1;
    }
    return x[rank];
}

double vgi_median(double *x, size_t n)
{
    return n ? vgi_select(x, n, n / 2) : 0;
}

double vgi_percentile(double *x, size_t n, double p)
{
    if (!n) return 0;
    double rank = ceil(p * (double)n / 100) - 1;
    return vgi_select(x, n, !(rank > 0) ? 0 : rank < (double)(n - 1) ? (size_t)rank : n - 1);
}

void vgi_running_merge(vgi_running *r, const vgi_running *more)
{
    double n = r->n + more->n, d = more->mean - r->mean;
    if (more->n == 0) return;
    r->mean += d * (more->n / n);
    r->squares += more->squares + d * d * (r->n * more->n / n);
    r->n = n;
    if (more->max > r->max) r->max = more->max;
}

double vgi_running_deviation(const vgi_running *r)
{
    return r->n > 0 ? sqrt(r->squares / r->n) : 0;
}
