/* complete.c: completion of motion between keys (L 4.4; MATH 12).
 *
 * A run starts from the first key forward, or from the second backward. Its error at the other key is spread over the
 * run linearly, so that both keys are met exactly. By default both runs are taken, as a mean with weights of one over
 * their squared errors: a run that is held at both ends errs in between in proportion to what it missed.
 * Alternatively the initial states are optimised first, and the better run is taken; or, as printed, random states are
 * tried until the runs from both keys meet.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/generator.h"

#include <math.h>
#include <stdlib.h>

enum { RESTARTS = 64, ROUNDS = 30 };

/* A pose: normalised features, coordinates, the part outside the basis, the frame as the layers see it, root. */
typedef struct station {
    double *x, *c, *kept, *frame, *centroids, root[4];
} station;

/* Runs of n network frames between two stations. */
typedef struct way {
    vg_generator *g;
    size_t n;
    station from, to;
    double *forward[NET_LANES], *back[NET_LANES]; /* n + 1 frames each: after the first key, before the second */
    double *path;      /* the n chosen frames */
    double *past;      /* the frames before the second key was given; npast of them */
    size_t npast;
    double *centroids, *roots; /* n + 1 each */
    double *memory;
    vg_way found;
} way;

static size_t station_size(const vg_generator *g)
{
    return 2 * g->d + g->net->rank + g->net->numbers + 3 * g->net->parts;
}

static double *place_station(const vg_generator *g, station *s, double *at)
{
    s->x = at, s->kept = at += g->d, s->c = at += g->d, s->frame = at += g->net->rank;
    s->centroids = at += g->net->numbers;
    return at + 3 * g->net->parts;
}

static void note_station(const vg_generator *g, station *s)
{
    memcpy(s->x, g->x, g->d * sizeof *s->x);
    memcpy(s->kept, g->kept, g->d * sizeof *s->kept);
    memcpy(s->c, g->c, g->net->rank * sizeof *s->c);
    memcpy(s->frame, vgi_network_is_linear(g->net) ? g->c : g->x, g->net->numbers * sizeof *s->frame);
    memcpy(s->root, g->root, sizeof s->root);
    memcpy(s->centroids, g->centroids, 3 * g->net->parts * sizeof *s->centroids);
}

/* lanes: number of runs in each direction */
static int make_way(way *w, vg_generator *g, size_t n, size_t lanes, vg_err *e)
{
    size_t numbers = g->net->numbers, parts = g->net->parts, frames, all;
    *w = (way){.g = g, .n = n};
    if (!vgi_mul(2 * lanes + 1, n + 1, &frames) || !vgi_mul(frames, numbers, &all))
        return vg_fail(e, VG_ENOMEM, "%zu poses between two keys are too many", n);
    double *at = w->memory = vgi_array(all + 2 * station_size(g) + (n + 1) * (3 * parts + 4) +
                                            VGI_LONG_GIVEN * numbers, sizeof *at, e);
    if (!at) return VG_ENOMEM;
    at = place_station(g, &w->from, at);
    at = place_station(g, &w->to, at);
    for (size_t i = 0; i < lanes; i++) w->forward[i] = at, w->back[i] = at += (n + 1) * numbers, at += (n + 1) * numbers;
    w->path = at, w->centroids = at += (n + 1) * numbers, w->roots = at += 3 * parts * (n + 1), w->past = at + 4 * (n + 1);
    return VG_OK;
}

/* ---- frames ---- */

static double frame_distance(const double *a, const double *b, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(sum);
}

/* a distance of frames relative to the range of the training data */
static double share_of_range(const way *w, double far)
{
    double span = vgi_network_span(w->g->net);
    return span > 0 ? far / span : 0;
}

/* Run all lanes forward from the first key and the poses before it. */
static int run_forward(way *w, size_t lanes, vg_err *e)
{
    const double *in[NET_LANES];
    for (size_t i = 0; i < NET_LANES; i++) in[i] = w->past;
    return vgi_runner_go(&w->g->runner, false, lanes, w->npast, in, w->n + 1, w->forward, e);
}

static int run_back(way *w, size_t lanes, vg_err *e)
{
    const double *in[NET_LANES];
    for (size_t i = 0; i < NET_LANES; i++) in[i] = w->to.frame;
    return vgi_runner_go(&w->g->runner, true, lanes, 1, in, w->n + 1, w->back, e);
}

/* Copy the first `count` frames of the run `along` into the path, with `miss` spread over the first `length` of them.
 * back: the run starts at the second key. */
static void spread_miss(way *w, const double *along, const double *miss, size_t length, size_t count, bool back)
{
    size_t numbers = w->g->net->numbers;
    for (size_t t = 0; t < count; t++) {
        double part = (double)(t + 1) / (double)length, *to = w->path + (back ? w->n - 1 - t : t) * numbers;
        for (size_t k = 0; k < numbers; k++) to[k] = along[t * numbers + k] + part * miss[k];
    }
}

static void subtract_frames(const double *a, const double *b, size_t n, double *to)
{
    for (size_t k = 0; k < n; k++) to[k] = a[k] - b[k];
}

/* Run from both keys, or from the first only. far: how far each run ended from the other key. */
static int run_both(way *w, double far[2], vg_err *e)
{
    vg_generator *g = w->g;
    size_t n = w->n, numbers = g->net->numbers;
    vgi_reach reach;
    int r = VG_OK;
    vgi_generator_states(g, false, 0);
    if (g->o.optimise) {
        r = vgi_runner_reach(&g->runner, w->npast, w->past, n + 1, w->to.frame, ROUNDS, &reach, e);
        if (r == VG_OK) w->found.tries = reach.rounds;
    }
    if (r == VG_OK) r = run_forward(w, 1, e);
    if (r < 0) return r;
    far[0] = frame_distance(w->to.frame, w->forward[0] + n * numbers, numbers);
    if (g->net->direction == VG_FORWARD) return VG_OK;
    vgi_generator_states(g, true, 0);
    r = run_back(w, 1, e);
    far[1] = frame_distance(w->from.frame, w->back[0] + n * numbers, numbers);
    return r;
}

/* The path is the mean of both runs, each with its error spread over it. back: the weight of the second. */
static void mix_runs(way *w, double back)
{
    size_t n = w->n, numbers = w->g->net->numbers;
    const double *there = w->forward[0], *from = w->back[0], *end = there + n * numbers, *begin = from + n * numbers;
    for (size_t t = 0; t < n; t++) {
        double part = (double)(t + 1) / (double)(n + 1);
        const double *a = there + t * numbers, *b = from + (n - 1 - t) * numbers;
        for (size_t k = 0; k < numbers; k++)
            w->path[t * numbers + k] = (1 - back) * (a[k] + part * (w->to.frame[k] - end[k])) +
                                       back * (b[k] + (1 - part) * (w->from.frame[k] - begin[k]));
    }
}

/* Choose the better of the forward and backward runs, or mix them. */
static int find_spread(way *w, vg_err *e)
{
    size_t n = w->n, numbers = w->g->net->numbers;
    double *miss = w->g->numbers, far[2] = {0, INFINITY};
    int r = run_both(w, far, e);
    if (r < 0) return r;
    w->found.miss = share_of_range(w, fmin(far[0], far[1]));
    if (!w->g->o.optimise && far[1] < INFINITY && far[0] + far[1] > 0) {
        w->found.backward = far[0] * far[0] / (far[0] * far[0] + far[1] * far[1]);
        mix_runs(w, w->found.backward);
        return VG_OK;
    }
    bool back = far[1] < far[0];
    const double *along = back ? w->back[0] : w->forward[0];
    w->found.backward = back;
    subtract_frames(back ? w->from.frame : w->to.frame, along + n * numbers, numbers, miss);
    spread_miss(w, along, miss, n + 1, n, back);
    return VG_OK;
}

/* Find where the two runs of a lane are nearest at the same time: frame at + 1 of n; returns the distance. */
static double nearest_frames(const way *w, size_t lane, size_t *at)
{
    size_t numbers = w->g->net->numbers;
    double least = INFINITY;
    for (size_t t = 0; t < w->n; t++) {
        double far = frame_distance(w->forward[lane] + t * numbers, w->back[lane] + (w->n - 1 - t) * numbers, numbers);
        if (far < least) least = far, *at = t;
    }
    return least;
}

/* Bend both runs to the midpoint between them at frame `at`. */
static void join_runs(way *w, size_t lane, size_t at)
{
    size_t numbers = w->g->net->numbers;
    double *half = w->g->numbers;
    const double *there = w->forward[lane] + at * numbers, *back = w->back[lane] + (w->n - 1 - at) * numbers;
    subtract_frames(back, there, numbers, half);
    for (size_t k = 0; k < numbers; k++) half[k] /= 2;
    spread_miss(w, w->forward[lane], half, at + 1, at + 1, false);
    for (size_t k = 0; k < numbers; k++) half[k] = -half[k];
    spread_miss(w, w->back[lane], half, w->n - at, w->n - 1 - at, true);
}

/* As printed: random initial states until the runs come close enough; otherwise join the nearest ones. */
static int find_merge(way *w, vg_err *e)
{
    vg_generator *g = w->g;
    size_t at = 0;
    double best = INFINITY;
    int r = VG_OK;
    for (uint64_t batch = 0; r == VG_OK && batch < RESTARTS / NET_LANES && !w->found.merged; batch++) {
        vgi_generator_states(g, false, 2 * batch);
        r = run_forward(w, NET_LANES, e);
        vgi_generator_states(g, true, 2 * batch + 1);
        if (r == VG_OK) r = run_back(w, NET_LANES, e);
        for (size_t i = 0; r == VG_OK && i < NET_LANES && !w->found.merged; i++) {
            double far = share_of_range(w, nearest_frames(w, i, &at));
            w->found.tries++;
            if (!(far < best)) continue;
            best = far;
            w->found.merged = far <= g->o.merge;
            join_runs(w, i, at);
        }
    }
    w->found.miss = best;
    return r;
}

/* ---- poses ---- */

/* Coordinates of frame t of the path; after the last one those of the second key. */
static const double *coordinates(const way *w, size_t t, double *room)
{
    const double *frame = w->path + t * w->g->net->numbers;
    if (t >= w->n) return w->to.c;
    if (vgi_network_is_linear(w->g->net)) return frame;
    vgi_network_encode(w->g->net, frame, room);
    return room;
}

/* Move the root along the path as the body does. */
static void move_root(way *w)
{
    vg_generator *g = w->g;
    size_t wide = 3 * g->net->parts;
    double root[4], *centroids = g->centroids, *c = g->c, *before = g->c_before;
    memcpy(root, w->from.root, sizeof root);
    memcpy(centroids, w->from.centroids, wide * sizeof *centroids);
    memcpy(before, w->from.c, g->net->rank * sizeof *before);
    for (size_t t = 0; t <= w->n; t++) {
        memmove(c, coordinates(w, t, c), g->net->rank * sizeof *c);
        vgi_generator_move(g, c, before, root, centroids);
        memcpy(before, c, g->net->rank * sizeof *c);
        memcpy(w->roots + 4 * t, root, sizeof root);
        memcpy(w->centroids + wide * t, centroids, wide * sizeof *centroids);
    }
}

/* Spread the error of the root at the second key over the run; in a cycle its shift is not changed. */
static void spread_root_error(way *w, bool loop)
{
    size_t parts = w->g->net->parts, main_part = w->g->main_part, wide = 3 * parts;
    const double *reached = w->centroids + wide * w->n;
    double end[4], turned[4], back[4], *miss = w->g->centroids;
    memcpy(end, w->roots + 4 * w->n, sizeof end);
    for (size_t i = 0; i < wide; i++) {
        double shift = loop ? reached[3 * main_part + i % 3] - w->to.centroids[3 * main_part + i % 3] : 0;
        miss[i] = w->to.centroids[i] + shift - reached[i];
    }
    for (size_t t = 0; t <= w->n; t++) {
        double part = (double)(t + 1) / (double)(w->n + 1), *root = w->roots + 4 * t;
        vgi_turn_towards(end, w->to.root, part, turned);
        double left[4] = {end[0], -end[1], -end[2], -end[3]}; /* the missing part of the turn, after the root's own */
        vg_quat_multiply(left, turned, back);
        vg_quat_multiply(root, back, root);
        for (size_t i = 0; i < wide; i++) w->centroids[wide * t + i] += part * miss[i];
    }
}

/* Normalised features at the fraction `part` between frame k of the run (0: the first key) and the next. */
static void mix_features(way *w, size_t k, double part, double *x)
{
    vg_generator *g = w->g;
    size_t n = g->net->numbers;
    const double *a = k ? w->path + (k - 1) * n : w->from.frame, *b = k < w->n ? w->path + k * n : w->to.frame;
    double whole = ((double)k + part) / (double)(w->n + 1);
    for (size_t i = 0; i < n; i++) g->numbers[i] = (1 - part) * a[i] + part * b[i];
    if (!vgi_network_is_linear(g->net)) {
        memcpy(x, g->numbers, n * sizeof *x);
        return;
    }
    vgi_network_decode(g->net, g->numbers, x);
    for (size_t i = 0; i < g->d; i++) x[i] += (1 - whole) * w->from.kept[i] + whole * w->to.kept[i];
}

/* n poses from the run, whose frames may be farther apart. */
static int make_poses(way *w, size_t n, double *const *poses, vg_err *e)
{
    vg_generator *g = w->g;
    size_t wide = 3 * g->net->parts;
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        double at = (double)((i + 1) * (w->n + 1)) / (double)(n + 1), part = at - floor(at), root[4];
        size_t k = (size_t)at;
        const double *a = k ? w->roots + 4 * (k - 1) : w->from.root, *c = k ? w->centroids + wide * (k - 1) : w->from.centroids;
        mix_features(w, k, part, g->x);
        if (part > 0) vgi_turn_towards(a, w->roots + 4 * k, part, root);
        else memcpy(root, a, sizeof root);
        for (size_t j = 0; j < wide; j++) g->centroids[j] = (1 - part) * c[j] + part * w->centroids[wide * k + j];
        r = vgi_generator_pose(g, g->x, root, g->centroids, poses[i], e);
    }
    return r;
}

/* Make the second key the last given pose; a network that uses several frames also remembers those before it. */
static void arrive(way *w)
{
    vg_generator *g = w->g;
    size_t n = g->net->numbers, before = w->n < VGI_LONG_GIVEN - 1 ? w->n : VGI_LONG_GIVEN - 1;
    memcpy(g->x, w->to.x, g->d * sizeof *g->x);
    memcpy(g->before, w->to.x, g->d * sizeof *g->x);
    memcpy(g->c, w->to.c, g->net->rank * sizeof *g->c);
    memcpy(g->root, w->to.root, sizeof g->root);
    memcpy(g->centroids, w->to.centroids, 3 * g->net->parts * sizeof *g->centroids);
    g->npast = 0, g->sparse = true;
    for (size_t t = w->n - before; t < w->n && vgi_network_is_linear(g->net); t++)
        vgi_generator_remember(g, w->path + t * n);
    vgi_generator_remember(g, w->to.frame);
}

int vg_generator_between(vg_generator *g, const double *key, bool loop, size_t n, double *const *poses, vg_way *found,
                         vg_err *e)
{
    way w;
    if (!g->given) return vg_fail(e, VG_EINPUT, "no pose is given to start from");
    if (g->o.merge > 0 && g->net->direction == VG_FORWARD)
        return vg_fail(e, VG_EINPUT, "the network runs forward only: there is no run back from the second key");
    size_t frames = g->net->step > 1 ? (n + 1 + g->net->step / 2) / g->net->step : n + 1; /* in network frames; the
                                                                                             key is the last */
    if (frames < 2) frames = 2;
    int r = make_way(&w, g, frames - 1, g->o.merge > 0 ? NET_LANES : 1, e);
    if (r < 0) return r;
    note_station(g, &w.from);
    vgi_generator_thin(g);
    memcpy(w.past, g->past, g->npast * g->net->numbers * sizeof *w.past);
    w.npast = g->npast;
    r = vg_generator_give(g, key, e);
    note_station(g, &w.to);
    if (r == VG_OK) r = g->o.merge > 0 ? find_merge(&w, e) : find_spread(&w, e);
    if (r == VG_OK) {
        move_root(&w);
        spread_root_error(&w, loop);
        r = make_poses(&w, n, poses, e);
        arrive(&w);
    }
    if (found) *found = w.found;
    free(w.memory);
    return r;
}
