/* robust_time.c: the value at the middle of a parabola through the positions of a point over time, robust against
 * outliers: iteratively reweighted least squares (Cleveland 1979).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/smooth.h"
#include "numeric/stats.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { TERMS = 3, MOST_WIDTH = 4, ABSOLUTE = 4, BISQUARE = 3 }; /* rounds of each kind of weight */

typedef struct track {
    size_t n, width;
    const double **place; /* n */
    double *time, *weight, *distance, *room;
    double coefficient[TERMS][MOST_WIDTH];
} track;

static void fit_parabola(track *t)
{
    double a[9] = {0}, inverse[9], right[TERMS][MOST_WIDTH] = {{0}};
    for (size_t j = 0; j < t->n; j++) {
        double x[TERMS] = {1, t->time[j], t->time[j] * t->time[j]};
        vgi_add_outer(a, t->weight[j], x, x);
        for (size_t k = 0; k < TERMS; k++)
            for (size_t c = 0; c < t->width; c++) right[k][c] += t->weight[j] * x[k] * t->place[j][c];
    }
    double det = vgi_cofactors(a, inverse);
    if (!(det > 0)) return; /* fewer than three positions have weight: keep the previous parabola */
    for (size_t k = 0; k < TERMS; k++)
        for (size_t c = 0; c < t->width; c++) {
            t->coefficient[k][c] = 0;
            for (size_t i = 0; i < TERMS; i++) t->coefficient[k][c] += inverse[TERMS * i + k] * right[i][c] / det;
        }
}

static void measure_distances(track *t)
{
    for (size_t j = 0; j < t->n; j++) {
        double x = t->time[j], sum = 0;
        for (size_t c = 0; c < t->width; c++) {
            double at = t->coefficient[0][c] + x * (t->coefficient[1][c] + x * t->coefficient[2][c]);
            sum += (t->place[j][c] - at) * (t->place[j][c] - at);
        }
        t->distance[j] = sqrt(sum);
    }
}

static double median_distance(track *t)
{
    memcpy(t->room, t->distance, t->n * sizeof *t->room);
    return vgi_median(t->room, t->n);
}

static void weigh_again(track *t, bool bisquare)
{
    double middle = median_distance(t), largest = 0;
    for (size_t j = 0; j < t->n; j++) largest = fmax(largest, t->distance[j]);
    for (size_t j = 0; j < t->n; j++) {
        double r = t->distance[j];
        if (!bisquare) {
            t->weight[j] = 1 / fmax(r, 1e-3 * largest);
        } else {
            double u = fmin(r / (6 * middle), 1);
            t->weight[j] = (1 - u * u) * (1 - u * u);
        }
    }
}

/* Least squares, then least absolute distances, then bisquare weights. Stops early when the residual is zero. */
static void fit_track(track *t)
{
    for (size_t j = 0; j < t->n; j++) t->weight[j] = 1;
    memset(t->coefficient, 0, sizeof t->coefficient);
    fit_parabola(t);
    for (int round = 0; round < ABSOLUTE + BISQUARE; round++) {
        measure_distances(t);
        if (!(median_distance(t) > 1e-13 * (1 + fabs(t->coefficient[0][0])))) return;
        weigh_again(t, round >= ABSOLUTE);
        fit_parabola(t);
    }
}

void vgi_robust_points(size_t npoints, size_t width, size_t n, const double *const *frame, size_t at, double reach,
                       double *out)
{
    double time[VGI_MOST_ROBUST], weight[VGI_MOST_ROBUST], distance[VGI_MOST_ROBUST], room[VGI_MOST_ROBUST];
    const double *place[VGI_MOST_ROBUST];
    track t = {.n = n, .width = width, .place = place, .time = time, .weight = weight, .distance = distance,
               .room = room};
    for (size_t j = 0; j < n; j++) time[j] = ((double)j - (double)at) / reach;
    for (size_t p = 0; p < npoints; p++) {
        for (size_t j = 0; j < n; j++) place[j] = frame[j] + width * p;
        if (n < 5) memcpy(t.coefficient[0], place[at], width * sizeof(double));
        else fit_track(&t);
        memcpy(out + width * p, t.coefficient[0], width * sizeof(double));
    }
}
