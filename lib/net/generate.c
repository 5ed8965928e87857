/* generate.c: generates poses with a network: some are given, and it continues from the last (MATH 12).
 *
 * A network that corrects a regression was trained on sequences of 32 frames. Longer runs restart every four frames
 * from the last eight, and coordinates are kept within five percent of the training range, so that runs neither drift
 * nor freeze. Completion between keys is in complete.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/generator.h"

#include <math.h>
#include <stdlib.h>

enum { KEPT = VGI_LONG_GIVEN, WATCHED = VGI_WATCHED };
static const double lively = 0.3; /* lively: default standard deviation of random states */

/* Allocate all arrays in one block. */
static int make_rooms(vg_generator *g, vg_err *e)
{
    size_t d = g->d, k = g->net->rank, n = g->net->numbers, roots = vgi_network_roots(g->net);
    size_t parts = 3 * g->net->parts, kept = KEPT * g->net->step;
    double *at = g->x = vgi_array(6 * d + 2 * k + roots + 3 * parts + (kept + 1) * n, sizeof *at, e);
    g->frame = at ? net_array(3 * n, e) : NULL;
    if (!g->frame) return VG_ENOMEM;
    g->before = at += d, g->kept = at += d, g->features = at += d, g->c = at += d, g->c_before = at += k;
    g->steps = at += k, g->centroids = at += roots, g->past = at += parts, g->numbers = at += kept * n;
    g->x_from = at += n, g->centroids_from = at += d, g->room = at + parts;
    return VG_OK;
}

int vg_generator_new(vg_generator **out, const vg_network *n, const vg_mesh *m, const double *reference,
                     const vg_generate_options *o, vg_err *e)
{
    *out = NULL;
    if (vg_network_fits(n, m, "the input", e) < 0) return VG_EINPUT;
    vg_generator *g = *out = vgi_array(1, sizeof *g, e);
    if (!g) return VG_ENOMEM;
    vg_feature_options f = {.nine = n->width == 9, .threads = o->threads};
    g->net = n, g->o = *o, g->nv = n->nv, g->d = n->nv * n->width;
    if (o->merge > 0 && !(o->diversity > 0)) g->o.diversity = lively;
    int r = vg_featurer_new(&g->featurer, m, reference, &f, e);
    if (r == VG_OK) {
        vg_feature_stats stats = vg_featurer_get_stats(g->featurer);
        const vgi_rings *rings = vgi_featurer_rings(g->featurer);
        g->main_part = stats.main_part;
        r = stats.parts == n->parts ? vgi_runner_make(&g->runner, n, rings->first, rings->to, NULL, e)
                                       : vg_fail(e, VG_EINPUT, "the network has a different number of components");
    }
    if (r == VG_OK) r = make_rooms(g, e);
    if (r < 0) vg_generator_free(out);
    return r;
}

void vg_generator_free(vg_generator **out)
{
    vg_generator *g = *out;
    if (!g) return;
    vgi_runner_clear(&g->runner);
    vg_featurer_free(&g->featurer);
    free(g->frame);
    free(g->x);
    free(g);
    *out = NULL;
}

/* ---- given poses ---- */

/* The change of the frame that g->x and g->c replace. */
static void note_change(vg_generator *g)
{
    double change = 0;
    for (size_t i = 0; i < g->d; i++) change += fabs(g->x[i] - g->before[i]);
    g->changes[g->made % WATCHED] = change / (double)g->d;
    memcpy(g->before, g->x, g->d * sizeof *g->x);
}

void vgi_generator_remember(vg_generator *g, const double *frame)
{
    size_t n = g->net->numbers, most = g->sparse ? KEPT : KEPT * g->net->step;
    if (g->npast == most) memmove(g->past, g->past + n, (most - 1) * n * sizeof *g->past), g->npast--;
    memcpy(g->past + g->npast++ * n, frame, n * sizeof *frame);
}

void vgi_generator_thin(vg_generator *g)
{
    size_t n = g->net->numbers, step = g->net->step, left = g->sparse ? g->npast : (g->npast + step - 1) / step;
    for (size_t i = 0; i < left && !g->sparse; i++)
        memmove(g->past + i * n, g->past + (g->npast - 1 - (left - 1 - i) * step) * n, n * sizeof *g->past);
    g->npast = left;
    g->sparse = true;
}

int vg_generator_give(vg_generator *g, const double *pose, vg_err *e)
{
    double *values = g->features, *root = g->root, *centroids = g->centroids;
    size_t k = g->net->rank;
    int r = vg_featurer_measure(g->featurer, 1, &pose, &values, &root, &centroids, e);
    if (r < 0) return r;
    bool linear = vgi_network_is_linear(g->net);
    vgi_network_normalise(g->net, values, g->x);
    memcpy(g->c_before, g->c, k * sizeof *g->c);
    vgi_network_encode(g->net, g->x, g->c);
    if (!g->given) memcpy(g->c_before, g->c, k * sizeof *g->c);
    note_change(g);
    if (g->sparse) g->npast = 0, g->sparse = false;
    vgi_generator_remember(g, linear ? g->c : g->x);
    vgi_network_decode(g->net, g->c, g->kept);
    for (size_t i = 0; i < g->d; i++) g->kept[i] = linear ? g->x[i] - g->kept[i] : 0;
    g->given++, g->made = g->part = 0;
    g->begun = false;
    return VG_OK;
}

/* ---- frames ---- */

void vgi_generator_states(vg_generator *g, bool back, uint64_t try)
{
    bool random = g->o.diversity > 0;
    double value = random ? g->o.diversity : 0.1;
    vgi_runner_states(&g->runner, back ? -value : value, random, g->o.seed + 1000003 * try);
}

static void put_frame(const double *from, size_t n, net_lanes *to)
{
    for (size_t i = 0; i < n; i++) to[i] = (net_lanes){0} + (real)from[i];
}

/* Restart the chains from the remembered frames. */
static void restart_chains(vg_generator *g)
{
    size_t n = g->net->numbers;
    vgi_generator_thin(g);
    vgi_generator_states(g, false, 0);
    vgi_runner_begin(&g->runner, false);
    put_frame(g->past, n, g->frame);
    if (g->npast == 1 && vgi_runner_reach_back(&g->runner, g->frame, g->frame + n, g->frame + 2 * n)) {
        vgi_runner_take(&g->runner, g->frame + 2 * n);
        vgi_runner_take(&g->runner, g->frame + n);
    }
    for (size_t i = 0; i < g->npast; i++) {
        put_frame(g->past + i * n, n, g->frame);
        vgi_runner_take(&g->runner, g->frame);
    }
    g->begun = true;
}

/* Distance of the coordinates outside the training range, relative to its size; with `clip` they are clamped to
 * it. */
static double keep_in_range(const vg_generator *g, double *c, bool clip)
{
    double sum = 0, span = vgi_network_span(g->net);
    size_t k = g->net->rank;
    for (size_t i = 0; i < k; i++) {
        double inside = fmin(fmax(c[i], g->net->range[i]), g->net->range[k + i]), far = c[i] - inside;
        sum += far * far;
        if (clip) c[i] = inside;
    }
    return span > 0 ? sqrt(sum) / span : 0;
}

/* The next frame: g->x, normalised, and its coordinates g->c. */
static void next_frame(vg_generator *g)
{
    bool linear = vgi_network_is_linear(g->net), corrects = g->net->model == VG_NETWORK_AUTO;
    bool longer = g->made >= VGI_SHORT_RUN, again = corrects && longer && (g->made - VGI_SHORT_RUN) % VGI_LONG_STEP == 0;
    if (!g->begun || again) restart_chains(g);
    const net_lanes *next = vgi_runner_give(&g->runner);
    for (size_t i = 0; i < g->net->numbers; i++) g->numbers[i] = (double)next[i][0];
    memcpy(g->c_before, g->c, g->net->rank * sizeof *g->c);
    if (!linear) vgi_network_encode(g->net, g->numbers, g->c);
    double *c = linear ? g->numbers : g->c;
    g->drifts[g->made % WATCHED] = keep_in_range(g, c, corrects && longer);
    vgi_generator_remember(g, g->numbers);
    if (linear) {
        memcpy(g->c, c, g->net->rank * sizeof *c);
        vgi_network_decode(g->net, c, g->x);
        for (size_t i = 0; i < g->d; i++) g->x[i] += g->kept[i];
    } else memcpy(g->x, g->numbers, g->d * sizeof *g->x);
    note_change(g);
    g->made++;
}

void vgi_generator_move(const vg_generator *g, const double *c, const double *before, double *root, double *centroids)
{
    vgi_root_predict(g->net, c, before, g->steps);
    for (int k = 0; k < 6 && g->o.stay; k++) g->steps[k] = 0;
    vgi_root_move(g->net, g->main_part, g->steps, root, centroids);
}

int vgi_generator_pose(vg_generator *g, const double *x, const double *root, const double *centroids, double *pose,
                       vg_err *e)
{
    const double *values = g->features;
    vgi_network_features(g->net, x, g->features);
    vg_featurer_solve(g->featurer, 1, &values, &root, &centroids, &pose);
    for (size_t i = 0; i < 3 * g->nv; i++)
        if (!isfinite(pose[i])) return vg_fail(e, VG_EINPUT, "the network diverges: its numbers are not finite");
    return VG_OK;
}

void vgi_turn_towards(const double a[4], const double b[4], double part, double to[4])
{
    double back[4] = {a[0], -a[1], -a[2], -a[3]}, turn[4], l[4], q[4];
    vg_quat_multiply(back, b, turn);
    double sign = turn[0] < 0 ? -1 : 1;
    for (int k = 0; k < 4; k++) turn[k] *= sign;
    vg_quat_log(turn, l);
    for (int k = 1; k < 4; k++) l[k] *= part;
    l[0] = 0;
    vg_quat_exp(l, q);
    vg_quat_multiply(a, q, to);
}

/* The pose between the network's last two frames. */
static int pose_between(vg_generator *g, double part, double *pose, vg_err *e)
{
    double root[4], *x = g->room, *centroids = g->room + g->d;
    if (part >= 1) return vgi_generator_pose(g, g->x, g->root, g->centroids, pose, e);
    vgi_turn_towards(g->root_from, g->root, part, root);
    for (size_t i = 0; i < g->d; i++) x[i] = (1 - part) * g->x_from[i] + part * g->x[i];
    for (size_t i = 0; i < 3 * g->net->parts; i++) centroids[i] = (1 - part) * g->centroids_from[i] + part * g->centroids[i];
    return vgi_generator_pose(g, x, root, centroids, pose, e);
}

int vg_generator_next(vg_generator *g, double *pose, vg_err *e)
{
    if (!g->given) return vg_fail(e, VG_EINPUT, "no pose is given to continue from");
    if (!g->part) {
        memcpy(g->x_from, g->x, g->d * sizeof *g->x);
        memcpy(g->root_from, g->root, sizeof g->root);
        memcpy(g->centroids_from, g->centroids, 3 * g->net->parts * sizeof *g->centroids);
        next_frame(g);
        vgi_generator_move(g, g->c, g->c_before, g->root, g->centroids);
    }
    double part = (double)++g->part / (double)g->net->step;
    g->part %= g->net->step;
    return pose_between(g, part, pose, e);
}

/* mean over the watched frames */
static double recent(const vg_generator *g, const double *values)
{
    double sum = 0;
    size_t n = g->made < WATCHED ? g->made : WATCHED;
    for (size_t i = 0; i < n; i++) sum += values[i];
    return n ? sum / (double)n : 0;
}

double vg_generator_change(const vg_generator *g)
{
    return g->made && g->net->change > 0 ? recent(g, g->changes) / g->net->change : 1;
}

double vg_generator_drift(const vg_generator *g)
{
    return recent(g, g->drifts);
}
