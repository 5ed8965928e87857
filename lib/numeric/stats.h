/* stats.h: mean, spread, median and percentiles of numbers.
 * Internal. Leaves out histograms of what does not fit into memory (measures.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_STATS_H
#define VG_STATS_H

#include <stddef.h>

double vgi_mean(const double *x, size_t n);               /* 0 for none */
double vgi_variance(const double *x, size_t n);           /* sum (x - mean)^2 / n, in two passes; 0 for none */
/* vgi_select: the element of that rank in ascending order, rank < n. Changes the order of x: x[rank] is the answer,
 * what is before it is not larger, what follows is not smaller. O(n) in the mean. No NaN. */
double vgi_select(double *x, size_t n, size_t rank);
/* vgi_median: the element of rank n / 2; 0 for none. Changes the order of x. */
double vgi_median(double *x, size_t n);
/* vgi_percentile: the least element that at least p % of the n do not exceed, p in [0, 100]: rank ceil(p n / 100) - 1;
 * 0 for none. Changes the order of x. */
double vgi_percentile(double *x, size_t n, double p);

/* Mean and variance of numbers that come one after another, without cancellation (Welford 1962). Prepared by = {0}. */
typedef struct vgi_running {
    double n, mean, squares, max; /* squares: sum (x - mean)^2; max: 0 at first */
} vgi_running;
void vgi_running_add(vgi_running *r, double x);
/* vgi_running_merge: as if the numbers that `more` has taken had been added to *r, after its own (Chan et al. 1979). */
void vgi_running_merge(vgi_running *r, const vgi_running *more);
double vgi_running_deviation(const vgi_running *r); /* sqrt(squares / n); 0 for none */

#endif
