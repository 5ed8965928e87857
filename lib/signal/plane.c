/* plane.c: positions in the plane with distances as near as possible to given ones: stress majorisation.
 *
 * A step replaces p_i by the mean over j of p_j + distance_ij (p_i - p_j) / |p_i - p_j| (Guttman). Steps of double
 * length are used while they lower the stress, which halves their number. Distances are chosen in layout.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/signal.h"
#include "signal/signal_kernel.h"

#include <math.h>
#include <stdlib.h>

void vgi_distances(size_t n, size_t m, const double *x, size_t stride, double *square)
{
    for (size_t i = 0; i < n; i++) {
        vgi_signal_kernel_now()->distances(x + i * stride, x, i, stride, m, square + i * n);
        square[i * n + i] = 0;
        for (size_t j = 0; j < i; j++) square[j * n + i] = square[i * n + j];
    }
}

double vgi_plane_radius(size_t n, const double *p, double centre[2])
{
    double c[2] = {0, 0}, sum = 0;
    for (size_t i = 0; i < 2 * n; i++) c[i & 1] += p[i] / (double)n;
    for (size_t i = 0; i < 2 * n; i++) sum += (p[i] - c[i & 1]) * (p[i] - c[i & 1]);
    if (centre) centre[0] = c[0], centre[1] = c[1];
    return sqrt(sum / (double)n);
}

/* Input of a step: coordinates separate, so that frames are side by side in registers. */
typedef struct plane {
    size_t n;
    const double *distance;
    double least; /* smaller distances in the plane count as this */
    const bool *held;
    size_t nheld;
} plane;

/* The stress at p (x then y), and the result of a step. */
static double guttman_step(const plane *s, const double *p, double *to)
{
    size_t n = s->n;
    double stress = 0, sum[2] = {0, 0};
    memset(to, 0, 2 * n * sizeof *to);
    for (size_t i = 0; i < n; i++) {
        vgi_pull one = {.count = i, .want = s->distance + i * n, .x = p, .y = p + n, .least = s->least,
                        .at = {p[i], p[n + i]}, .bx = to, .by = to + n};
        vgi_signal_kernel_now()->pull(&one);
        stress += one.stress;
        to[i] += one.sum[0], to[n + i] += one.sum[1];
    }
    if (!s->nheld) {
        for (size_t i = 0; i < 2 * n; i++) to[i] /= (double)n;
        return stress;
    }
    /* the block of the other frames in the matrix n I - 1 1' has the inverse (I + 1 1' / nheld) / n */
    double fixed[2] = {0, 0};
    for (size_t i = 0; i < 2 * n; i++)
        if (s->held[i % n]) fixed[i / n] += p[i];
    for (size_t i = 0; i < 2 * n; i++)
        if (!s->held[i % n]) sum[i / n] += to[i] += fixed[i / n];
    for (size_t i = 0; i < 2 * n; i++)
        to[i] = s->held[i % n] ? p[i] : (to[i] + sum[i / n] / (double)s->nheld) / (double)n;
    return stress;
}

static void swap_arrays(double **a, double **b)
{
    double *t = *a;
    *a = *b, *b = t;
}

/* now: current positions; leads: result of a step from there. The result is in now. */
static vgi_stress_stats settle_plane(const plane *s, double *room[4])
{
    enum { MOST_STEPS = 2000 };
    double **now = &room[0], **leads = &room[1], **far = &room[2], **beyond = &room[3];
    double stress = guttman_step(s, *now, *leads);
    size_t steps = 1;
    for (; steps < MOST_STEPS; steps++) {
        for (size_t i = 0; i < 2 * s->n; i++) (*far)[i] = 2 * (*leads)[i] - (*now)[i];
        double next = guttman_step(s, *far, *beyond);
        if (next < stress) {
            swap_arrays(now, far);
            swap_arrays(leads, beyond);
        } else {
            swap_arrays(now, leads);
            next = guttman_step(s, *now, *leads);
        }
        double less = stress - next;
        stress = next;
        if (!(less > 1e-7 * stress)) break;
    }
    swap_arrays(now, leads); /* the last one is a plain step */
    return (vgi_stress_stats){.stress = guttman_step(s, *now, *leads), .steps = steps};
}

int vgi_plane_settle(size_t n, const double *distance, const bool *held, double *p, vgi_stress_stats *stats, vg_err *e)
{
    plane s = {.n = n, .distance = distance, .held = held};
    double most = 0, *all = vgi_array(n, 8 * sizeof *all, e);
    if (!all) return VG_ENOMEM;
    for (size_t i = 0; i < n * n; i++) most = fmax(most, distance[i]);
    for (size_t i = 0; held && i < n; i++) s.nheld += held[i];
    s.least = most > 0 ? 1e-12 * most : 1;
    double *room[4] = {all, all + 2 * n, all + 4 * n, all + 6 * n};
    for (size_t i = 0; i < n; i++) room[0][i] = p[2 * i], room[0][n + i] = p[2 * i + 1];
    vgi_stress_stats f = {0};
    if (s.nheld < n) f = settle_plane(&s, room);
    for (size_t i = 0; i < n; i++) p[2 * i] = room[0][i], p[2 * i + 1] = room[0][n + i];
    if (stats) *stats = f;
    free(all);
    return VG_OK;
}
