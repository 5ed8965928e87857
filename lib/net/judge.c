/* judge.c: quality of a network's predictions: on its validation block during training, and on held-out frames,
 * compared with repeating the last pose, linear and damped continuation, and the regression alone (MATH 12).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/trainer.h"

#include <math.h>
#include <stdlib.h>

enum { AHEAD = 15, MOST_WINDOWS = 12 };
static const size_t looked_at[VG_NETWORK_FRAMES] = {5, 10, 15};

/* ---- the validation block ---- */

static double frame_distance(const float *a, const double *b, size_t n)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++) sum += ((double)a[k] - b[k]) * ((double)a[k] - b[k]);
    return sqrt(sum);
}

typedef struct runs {
    size_t n, given, length;
    double **in, **out;
} runs;

static void runs_clear(runs *x)
{
    for (size_t i = 0; x->in && i < NET_LANES; i++) free(x->in[i]);
    for (size_t i = 0; x->out && i < NET_LANES; i++) free(x->out[i]);
    free(x->in);
    free(x->out);
}

static int runs_make(runs *x, size_t given, size_t length, size_t numbers, vg_err *e)
{
    *x = (runs){.given = given, .length = length};
    x->in = vgi_array(NET_LANES, sizeof *x->in, e), x->out = vgi_array(NET_LANES, sizeof *x->out, e);
    int r = x->in && x->out ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < NET_LANES; i++)
        if (!(x->in[i] = vgi_array(given * numbers, sizeof **x->in, e)) ||
            !(x->out[i] = vgi_array(length * numbers, sizeof **x->out, e)))
            r = VG_ENOMEM;
    if (r < 0) runs_clear(x);
    return r;
}

/* frame i as the layers see it */
static void take_frame(const vg_trainer *t, size_t i, double *to)
{
    for (size_t k = 0; k < t->net.numbers; k++) to[k] = (double)t->frames[i * t->net.numbers + k];
}

/* Mean distance of runs from `given` frames that start at every third frame of the block. */
static int validate_from(vg_trainer *t, size_t given, double *error, vg_err *e)
{
    enum { LONGEST = 12, SHORTEST = 5, APART = 3 };
    runs x;
    size_t n = t->net.numbers, total = 0, starts[NET_LANES], lengths[NET_LANES], lanes = 0;
    double sum = 0;
    if (runs_make(&x, given, LONGEST, n, e) < 0) return VG_ENOMEM;
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i <= t->tried.n; i++) {
        size_t first = i < t->tried.n ? t->tried.at[i].first : 0, end = i < t->tried.n ? t->tried.at[i].end : 0;
        for (size_t s = first; s + SHORTEST <= end || (i == t->tried.n && lanes); s += APART) {
            if (i < t->tried.n) starts[lanes] = s, lengths[lanes++] = end - s < LONGEST ? end - s : LONGEST;
            if (lanes < NET_LANES && i < t->tried.n) continue;
            for (size_t l = 0; l < lanes; l++)
                for (size_t g = 0; g < given; g++) take_frame(t, starts[l] - given + g, x.in[l] + g * n);
            r = vgi_runner_go(&t->runner, false, lanes, given, (const double *const *)x.in, LONGEST, x.out, e);
            for (size_t l = 0; r == VG_OK && l < lanes; l++, total++)
                for (size_t g = 0; g < lengths[l]; g++)
                    sum += frame_distance(t->frames + (starts[l] + g) * n, x.out[l] + g * n, n) / (double)lengths[l];
            lanes = 0;
            if (i == t->tried.n || r < 0) break;
        }
    }
    runs_clear(&x);
    *error = total ? sum / (double)total : INFINITY;
    return r;
}

int vgi_trainer_validate(vg_trainer *t, double *error, vg_err *e)
{
    double from_one, from_three;
    vgi_blas_alone();
    int r = validate_from(t, 1, &from_one, e);
    if (r == VG_OK) r = validate_from(t, 3, &from_three, e);
    vgi_blas_shared();
    *error = r == VG_OK ? (from_one + from_three) / 2 : INFINITY;
    return r;
}

/* ---- held-out frames ---- */

typedef struct judging {
    vg_trainer *t;
    size_t windows, start[MOST_WINDOWS], end[MOST_WINDOWS];
    double *x, *features, *vertices, *centroids; /* workspace of eight poses: d, d, 3 nv, 3 parts each */
    size_t waiting, truth[NET_LANES];
    double *to[NET_LANES]; /* where the errors of the pending poses are written */
} judging;

/* Windows start where all their frames are held out; if there are many, twelve evenly spread ones. */
static void choose_windows(judging *j)
{
    const vgi_spans *held = &j->t->data.held;
    size_t all = 0, number = 0, picked = 0;
    for (int shorter = 0; shorter < 2 && !all; shorter++) {
        size_t ahead = shorter ? looked_at[0] : AHEAD;
        for (size_t i = 0; i < held->n; i++) {
            size_t length = held->at[i].end - held->at[i].first;
            all += length >= ahead ? length - ahead + 1 : 0;
        }
        for (size_t i = 0; i < held->n; i++)
            for (size_t s = held->at[i].first; s + ahead <= held->at[i].end; s++, number++) {
                size_t wanted = all <= MOST_WINDOWS ? number
                                : (size_t)rint((double)picked * (double)(all - 1) / (MOST_WINDOWS - 1));
                if (number != wanted || picked == MOST_WINDOWS || s < held->at[i].sequence + 3) continue;
                j->start[picked] = s, j->end[picked++] = held->at[i].end;
            }
        number = 0;
    }
    j->windows = picked;
}

/* Mean distances of the pending poses from the truth, in % of D. */
static void settle_poses(judging *j)
{
    vg_trainer *t = j->t;
    size_t nv = t->mesh.nv, d = t->data.d;
    const double *values[NET_LANES], *centroids[NET_LANES];
    double *vertices[NET_LANES];
    for (size_t i = 0; i < j->waiting; i++) {
        vgi_network_features(&t->net, j->x + i * d, j->features + i * d);
        values[i] = j->features + i * d, centroids[i] = j->centroids, vertices[i] = j->vertices + 3 * nv * i;
    }
    if (j->waiting) vg_featurer_solve(t->featurer, j->waiting, values, NULL, centroids, vertices);
    for (size_t i = 0; i < j->waiting; i++) {
        const float *home = t->data.home + 3 * nv * j->truth[i];
        double sum = 0;
        for (size_t v = 0; v < nv; v++) {
            double far = 0;
            for (size_t k = 3 * v; k < 3 * v + 3; k++) far += ((double)home[k] - vertices[i][k]) * ((double)home[k] - vertices[i][k]);
            sum += sqrt(far);
        }
        *j->to[i] += 100 * sum / (double)nv / t->data.diagonal;
    }
    j->waiting = 0;
}

/* x (d normalised numbers) predicts frame `truth` */
static double *put_pose(judging *j, size_t truth, double *to)
{
    if (j->waiting == NET_LANES) settle_poses(j);
    j->truth[j->waiting] = truth, j->to[j->waiting] = to;
    return j->x + j->waiting++ * j->t->data.d;
}

static void simple_methods(judging *j, size_t w, int given, vg_network_errors *errors, double *room)
{
    vg_trainer *t = j->t;
    size_t d = t->data.d, s = j->start[w];
    double *last = room, *step = room + d;
    vgi_dataset_normalised(&t->data, &t->net, s - 1, last);
    vgi_dataset_normalised(&t->data, &t->net, s - 2, step);
    for (size_t k = 0; k < d; k++) step[k] = last[k] - step[k];
    for (int i = 0; i < VG_NETWORK_FRAMES; i++) {
        size_t ahead = looked_at[i];
        if (s + ahead > j->end[w]) continue;
        for (int m = 0; m < (given ? 3 : 1); m++) {
            double far = m == 0 ? 0 : m == 1 ? (double)ahead : 0.9 * (1 - pow(0.9, (double)ahead)) / 0.1;
            double *x = put_pose(j, s + ahead - 1, &errors->at[given][m][i]);
            for (size_t k = 0; k < d; k++) x[k] = last[k] + far * step[k];
        }
    }
}

/* Convert predicted coordinates to a pose; the part of the last given frame outside the basis is kept. */
static void put_coordinates(judging *j, const double *c, const double *kept, size_t truth, double *to)
{
    double *x = put_pose(j, truth, to);
    vgi_network_decode(&j->t->net, c, x);
    for (size_t k = 0; k < j->t->data.d; k++) x[k] += kept[k];
}

static void find_kept(const vg_trainer *t, size_t frame, double *kept, double *room)
{
    vgi_dataset_normalised(&t->data, &t->net, frame, room);
    vgi_network_decode(&t->net, t->data.coordinates + frame * t->data.rank, kept);
    for (size_t k = 0; k < t->data.d; k++) kept[k] = room[k] - kept[k];
}

static void regression_alone(judging *j, size_t w, int given, vg_network_errors *errors, double *room)
{
    vg_trainer *t = j->t;
    size_t k = t->data.rank, s = j->start[w];
    double *kept = room, *c = room + 2 * t->data.d, *before = c + k, *next = before + k;
    find_kept(t, s - 1, kept, room + t->data.d);
    memcpy(c, t->data.coordinates + (s - 1) * k, k * sizeof *c);
    if (given) memcpy(before, t->data.coordinates + (s - 2) * k, k * sizeof *c);
    else vgi_regression_next(&t->regression[1], c, NULL, before);
    for (size_t ahead = 1; ahead <= AHEAD && s + ahead <= j->end[w]; ahead++) {
        vgi_regression_next(&t->regression[0], c, before, next);
        double *swap = before;
        before = c, c = next, next = swap;
        for (int i = 0; i < VG_NETWORK_FRAMES; i++)
            if (looked_at[i] == ahead) put_coordinates(j, c, kept, s + ahead - 1, &errors->at[given][3][i]);
    }
}

static int network_alone(judging *j, size_t first, size_t lanes, int given, runs *x, vg_network_errors *errors,
                         double *room, vg_err *e)
{
    vg_trainer *t = j->t;
    size_t n = t->net.numbers;
    for (size_t l = 0; l < lanes; l++)
        for (size_t g = 0; g < x->given; g++) take_frame(t, j->start[first + l] - x->given + g, x->in[l] + g * n);
    if (vgi_runner_go(&t->runner, false, lanes, x->given, (const double *const *)x->in, AHEAD, x->out, e) < 0) return VG_ENOMEM;
    for (size_t l = 0; l < lanes; l++) {
        size_t s = j->start[first + l];
        find_kept(t, s - 1, room, room + t->data.d);
        for (int i = 0; i < VG_NETWORK_FRAMES; i++) {
            if (s + looked_at[i] > j->end[first + l]) continue;
            const double *c = x->out[l] + (looked_at[i] - 1) * n;
            if (vgi_network_is_linear(&t->net)) put_coordinates(j, c, room, s + looked_at[i] - 1, &errors->at[given][4][i]);
            else memcpy(put_pose(j, s + looked_at[i] - 1, &errors->at[given][4][i]), c, n * sizeof *c);
        }
    }
    return VG_OK;
}

static int judge_all(judging *j, vg_network_errors *errors, double *room, vg_err *e)
{
    int r = VG_OK;
    for (int given = 0; r == VG_OK && given < 2; given++) {
        runs x;
        for (size_t w = 0; w < j->windows; w++) {
            simple_methods(j, w, given, errors, room);
            regression_alone(j, w, given, errors, room);
        }
        r = runs_make(&x, given ? 3 : 1, AHEAD, j->t->net.numbers, e);
        for (size_t w = 0; r == VG_OK && w < j->windows; w += NET_LANES)
            r = network_alone(j, w, j->windows - w < NET_LANES ? j->windows - w : NET_LANES, given, &x, errors, room, e);
        settle_poses(j);
        runs_clear(&x);
    }
    return r;
}

static void take_means(const judging *j, vg_network_errors *errors)
{
    for (int given = 0; given < 2; given++)
        for (int m = 0; m < VG_NETWORK_METHODS; m++)
            for (int i = 0; i < VG_NETWORK_FRAMES; i++) {
                size_t n = 0;
                for (size_t w = 0; w < j->windows; w++) n += j->start[w] + looked_at[i] <= j->end[w];
                bool none = !n || (!given && (m == 1 || m == 2));
                errors->at[given][m][i] = none ? NAN : errors->at[given][m][i] / (double)n;
            }
}

static void store_errors(vg_trainer *t, const vg_network_errors *errors)
{
    const double *x = &errors->at[0][0][0];
    for (size_t i = 0; i < sizeof errors->at / sizeof *x; i++) t->net.errors[i] = isnan(x[i]) ? -1 : x[i];
    t->net.windows = errors->windows;
}

int vg_trainer_judge(vg_trainer *t, vg_network_errors *errors, vg_err *e)
{
    judging j = {.t = t};
    size_t d = t->data.d, all = NET_LANES * (2 * d + 3 * t->mesh.nv) + 3 * t->data.parts;
    *errors = (vg_network_errors){0};
    choose_windows(&j);
    errors->windows = j.windows;
    double *room = vgi_array(3 * d + 4 * t->data.rank, sizeof *room, e);
    j.x = vgi_array(all, sizeof *j.x, e);
    int r = j.x && room ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        j.features = j.x + NET_LANES * d, j.vertices = j.features + NET_LANES * d;
        j.centroids = j.vertices + NET_LANES * 3 * t->mesh.nv;
        vgi_blas_alone();
        r = judge_all(&j, errors, room, e);
        vgi_blas_shared();
        take_means(&j, errors);
        store_errors(t, errors);
    }
    free(j.x);
    free(room);
    return r;
}
