/* stats.h: order, mean, spread, median and percentiles of numbers.
 * Internal. For data that does not fit into memory, measures.c has histograms.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_STATS_H
#define VG_STATS_H

#include <stddef.h>

/* vgi_by_number, vgi_by_index: for qsort: doubles (no NaN), uint32_t in ascending order. */
int vgi_by_number(const void *a, const void *b);
int vgi_by_index(const void *a, const void *b);

double vgi_mean(const double *x, size_t n);               /* 0 if n is 0 */
/* vgi_select: the element with that rank in ascending order, rank < n. Reorders x: x[rank] is the result, elements
 * before it are not larger, those after it not smaller. O(n) on average. No NaN. */
double vgi_select(double *x, size_t n, size_t rank);
/* vgi_median: the element of rank n / 2; 0 if n is 0. Reorders x. */
double vgi_median(double *x, size_t n);
/* vgi_percentile: the smallest element that at least p % of the n do not exceed, p in [0, 100]: rank ceil(p n / 100)
 * - 1; 0 if n is 0. Reorders x. */
double vgi_percentile(double *x, size_t n, double p);

/* Mean and variance of numbers in parts that are merged, without cancellation (Chan et al. 1979). {0}: of no numbers; of one
 * number x: {1, x, 0, x}. */
typedef struct vgi_running {
    double n, mean, squares, max; /* squares: sum (x - mean)^2; max: at least 0 */
} vgi_running;
/* vgi_running_merge: *r becomes that of its numbers and those of `more`. */
void vgi_running_merge(vgi_running *r, const vgi_running *more);
double vgi_running_deviation(const vgi_running *r); /* sqrt(squares / n); 0 if n is 0 */

#endif
