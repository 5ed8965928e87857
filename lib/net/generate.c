/* generate.c: poses from a network: some are given, it goes on from the last, or leads to a key (MATH 12).
 *
 * A network that corrects a regression was trained on sequences of 32 frames. Longer runs begin again every four frames
 * from the last eight, and coordinates stay within five percent of the training's range: so they neither drift nor
 * freeze.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/feature.h"
#include "net/root.h"
#include "net/runner.h"

#include <math.h>
#include <stdlib.h>

enum { KEPT = VGI_LONG_GIVEN, WATCHED = 16 };
static const double margin = 0.05;

struct vg_generator {
    const vg_network *net;
    vg_generate_options o;
    vg_featurer *featurer;
    vgi_runner runner;
    size_t d, nv, main_part;
    size_t given, made;     /* poses of this run */
    net_lanes *past;        /* KEPT x numbers: the last frames, the latest last; npast of them */
    size_t npast;
    net_lanes *frame;       /* 3 x numbers */
    double *x, *before, *kept, *features; /* d each: the last frame normalised, the one before, what the basis misses */
    double *c, *c_before, *steps;         /* rank, rank, roots */
    double root[4], *centroids;
    double *room;
    double changes[WATCHED];
    bool begun;
};

int vg_generator_new(vg_generator **out, const vg_network *n, const vg_mesh *m, const double *reference,
                     const vg_generate_options *o, vg_err *e)
{
    *out = NULL;
    if (vg_network_fits(n, m, "the input", e) < 0) return VG_EINPUT;
    vg_generator *g = *out = vgi_array(1, sizeof *g, e);
    if (!g) return VG_ENOMEM;
    vg_feature_options f = {.nine = n->width == 9, .threads = o->threads};
    g->net = n, g->o = *o, g->nv = n->nv, g->d = n->nv * n->width;
    int code = vg_featurer_new(&g->featurer, m, reference, &f, e);
    if (code == VG_OK) {
        vg_feature_stats stats = vg_featurer_get_stats(g->featurer);
        const vgi_rings *r = vgi_featurer_rings(g->featurer);
        g->main_part = stats.main_part;
        code = stats.parts == n->parts ? vgi_runner_make(&g->runner, n, r->first, r->to, 2, e)
                                       : vg_fail(e, VG_EINPUT, "the network has another number of components");
    }
    size_t k = n->rank, all = 5 * g->d + 2 * k + vgi_network_roots(n) + 3 * n->parts;
    if (code == VG_OK && (!(g->past = net_array((KEPT + 3) * n->numbers, e)) ||
                          !(g->x = vgi_array(all, sizeof *g->x, e))))
        code = VG_ENOMEM;
    if (code < 0) return vg_generator_free(out), code;
    g->frame = g->past + KEPT * n->numbers;
    g->before = g->x + g->d, g->kept = g->before + g->d, g->features = g->kept + g->d, g->room = g->features + g->d;
    g->c = g->room + g->d, g->c_before = g->c + k, g->steps = g->c_before + k;
    g->centroids = g->steps + vgi_network_roots(n);
    return VG_OK;
}

void vg_generator_free(vg_generator **out)
{
    vg_generator *g = *out;
    if (!g) return;
    vgi_runner_clear(&g->runner);
    vg_featurer_free(&g->featurer);
    free(g->past);
    free(g->x);
    free(g);
    *out = NULL;
}

void vg_generator_restart(vg_generator *g)
{
    g->given = g->made = g->npast = 0;
    g->begun = false;
    vg_featurer_restart(g->featurer);
}

/* ---- frames ---- */

/* coordinates of the frame g->x, those of the frame before, and its change */
static void note(vg_generator *g)
{
    double change = 0;
    memcpy(g->c_before, g->c, g->net->rank * sizeof *g->c);
    vgi_network_encode(g->net, g->x, g->c);
    if (!g->given) memcpy(g->c_before, g->c, g->net->rank * sizeof *g->c);
    for (size_t i = 0; i < g->d; i++) change += fabs(g->x[i] - g->before[i]);
    g->changes[g->made % WATCHED] = change / (double)g->d;
    memcpy(g->before, g->x, g->d * sizeof *g->x);
}

static void remember(vg_generator *g, const net_lanes *frame)
{
    size_t n = g->net->numbers;
    if (g->npast == KEPT) memmove(g->past, g->past + n, (KEPT - 1) * n * sizeof *g->past), g->npast--;
    memcpy(g->past + g->npast++ * n, frame, n * sizeof *frame);
}

int vg_generator_give(vg_generator *g, const double *pose, vg_err *e)
{
    double *values = g->features, *root = g->root, *centroids = g->centroids;
    int r = vg_featurer_measure(g->featurer, 1, &pose, &values, &root, &centroids, e);
    if (r < 0) return r;
    vgi_network_normalise(g->net, values, g->x);
    note(g);
    bool linear = vgi_network_is_linear(g->net);
    const double *from = linear ? g->c : g->x;
    for (size_t k = 0; k < g->net->numbers; k++) g->frame[k] = (net_lanes){0} + (real)from[k];
    remember(g, g->frame);
    vgi_network_decode(g->net, g->c, g->kept);
    for (size_t i = 0; i < g->d; i++) g->kept[i] = linear ? g->x[i] - g->kept[i] : 0;
    g->given++, g->made = 0;
    g->begun = false;
    return VG_OK;
}

/* From the frames that are remembered, the chains begin again. */
static void begin(vg_generator *g)
{
    size_t n = g->net->numbers;
    vgi_runner_states(&g->runner, g->o.diversity > 0 ? g->o.diversity : 0.1, g->o.diversity > 0, g->o.seed);
    vgi_runner_begin(&g->runner, false);
    if (g->npast == 1 && vgi_runner_reach_back(&g->runner, g->past, g->frame + n, g->frame + 2 * n)) {
        vgi_runner_take(&g->runner, g->frame + 2 * n);
        vgi_runner_take(&g->runner, g->frame + n);
    }
    for (size_t i = 0; i < g->npast; i++) vgi_runner_take(&g->runner, g->past + i * n);
    g->begun = true;
}

static void keep_in_range(const vg_generator *g, net_lanes *frame)
{
    size_t k = g->net->rank;
    for (size_t i = 0; i < k; i++) {
        double least = g->net->range[i], most = g->net->range[k + i], more = margin * (most - least);
        double x = fmin(fmax((double)frame[i][0], least - more), most + more);
        frame[i] = (net_lanes){0} + (real)x;
    }
}

/* The next frame: g->x, normalised, and g->frame, as the layers see it. */
static void advance(vg_generator *g)
{
    bool linear = vgi_network_is_linear(g->net), corrects = g->net->model == VG_NETWORK_AUTO;
    bool again = corrects && g->made >= VGI_SHORT_RUN && (g->made - VGI_SHORT_RUN) % VGI_LONG_STEP == 0;
    if (!g->begun || again) begin(g);
    memcpy(g->frame, vgi_runner_give(&g->runner), g->net->numbers * sizeof *g->frame);
    if (corrects && g->made >= VGI_SHORT_RUN) keep_in_range(g, g->frame);
    remember(g, g->frame);
    double *to = linear ? g->room : g->x;
    for (size_t k = 0; k < g->net->numbers; k++) to[k] = (double)g->frame[k][0];
    if (linear) {
        vgi_network_decode(g->net, g->room, g->x);
        for (size_t i = 0; i < g->d; i++) g->x[i] += g->kept[i];
    }
    g->made++;
    note(g);
}

static void move_root(vg_generator *g)
{
    vgi_root_predict(g->net, g->c, g->c_before, g->steps);
    for (int k = 0; k < 6 && g->o.stay; k++) g->steps[k] = 0;
    vgi_root_move(g->net, g->main_part, g->steps, g->root, g->centroids);
}

static void pose_of(vg_generator *g, const double *x, const double *root, const double *centroids, double *pose)
{
    const double *values = g->features;
    vgi_network_features(g->net, x, g->features);
    vg_featurer_solve(g->featurer, 1, &values, &root, &centroids, &pose);
}

int vg_generator_next(vg_generator *g, double *pose, vg_err *e)
{
    if (!g->given) return vg_fail(e, VG_EINPUT, "no pose is given to go on from");
    advance(g);
    move_root(g);
    pose_of(g, g->x, g->root, g->centroids, pose);
    for (size_t i = 0; i < 3 * g->nv; i++)
        if (!isfinite(pose[i])) return vg_fail(e, VG_EINPUT, "the network runs away: its numbers are not finite");
    return VG_OK;
}

double vg_generator_change(const vg_generator *g)
{
    double sum = 0;
    size_t n = g->made < WATCHED ? g->made : WATCHED;
    for (size_t i = 0; i < n; i++) sum += g->changes[i];
    return n && g->net->change > 0 ? sum / (double)n / g->net->change : 1;
}

/* ---- between keys ---- */

/* One frame of the way: normalised features, root and centroids. */
typedef struct station {
    double *x, root[4], *centroids;
} station;

static void stations_free(station *s, size_t n)
{
    for (size_t i = 0; s && i < n; i++) free(s[i].x);
    free(s);
}

static station *stations_make(const vg_generator *g, size_t n, vg_err *e)
{
    station *s = vgi_array(n, sizeof *s, e);
    for (size_t i = 0; s && i < n; i++) {
        s[i].x = vgi_array(g->d + 3 * g->net->parts, sizeof *s[i].x, e);
        if (!s[i].x) return stations_free(s, n), NULL;
        s[i].centroids = s[i].x + g->d;
    }
    return s;
}

static void note_station(const vg_generator *g, station *s)
{
    memcpy(s->x, g->x, g->d * sizeof *s->x);
    memcpy(s->root, g->root, sizeof s->root);
    memcpy(s->centroids, g->centroids, 3 * g->net->parts * sizeof *s->centroids);
}

/* The way's end becomes the key: what is missing is spread over it, the root's turn along a geodesic. */
static void bend(const vg_generator *g, station *s, double t, const station *end, const station *key)
{
    double back[4] = {end->root[0], -end->root[1], -end->root[2], -end->root[3]}, miss[4], l[4], q[4];
    for (size_t i = 0; i < g->d; i++) s->x[i] += t * (key->x[i] - end->x[i]);
    for (size_t i = 0; i < 3 * g->net->parts; i++) s->centroids[i] += t * (key->centroids[i] - end->centroids[i]);
    vg_quat_multiply(back, key->root, miss);
    if (miss[0] < 0)
        for (int k = 0; k < 4; k++) miss[k] = -miss[k];
    vg_quat_log(miss, l);
    for (int k = 0; k < 4; k++) l[k] *= k ? t : 0;
    vg_quat_exp(l, q);
    vg_quat_multiply(s->root, q, s->root);
}

static double distance(const double *a, const double *b, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(sum);
}

/* the diagonal of the box that the coordinates of the training fill */
static double span(const vg_network *n)
{
    return distance(n->range, n->range + n->rank, n->rank);
}

int vg_generator_between(vg_generator *g, const double *key, size_t n, double *const *poses, double *miss, vg_err *e)
{
    if (!g->given) return vg_fail(e, VG_EINPUT, "no pose is given to begin from");
    station *s = stations_make(g, n + 2, e);
    if (!s) return VG_ENOMEM;
    for (size_t i = 0; i <= n; i++) {
        advance(g);
        move_root(g);
        note_station(g, &s[i]);
    }
    g->given = g->made = g->npast = 0; /* whole turns of the key follow those of the key before */
    int r = vg_generator_give(g, key, e);
    if (r == VG_OK) {
        note_station(g, &s[n + 1]);
        if (miss) *miss = distance(s[n].x, s[n + 1].x, g->d) / span(g->net);
        for (size_t i = 0; i < n; i++) {
            bend(g, &s[i], (double)(i + 1) / (double)(n + 1), &s[n], &s[n + 1]);
            pose_of(g, s[i].x, s[i].root, s[i].centroids, poses[i]);
        }
    }
    stations_free(s, n + 2);
    return r;
}
