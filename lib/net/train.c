/* train.c: trains a network by Adam on sequences drawn from the training frames (MATH 12).
 *
 * The number of iterations is found with a validation block, the last fifth of the data. A correction of a regression
 * is then trained again on all data, for as many iterations. Random choices depend only on the seed and the
 * iteration, groups of eight chains are always the same, and their gradients are added in order. So the number of
 * threads changes no bit, and resumed training gives the same result as uninterrupted training. Features are in
 * feature.c, frames in dataset.c, the report in judge.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/trainer.h"
#include "net/root.h"
#include "numeric/vec3.h"
#include "core/random.h"
#include "net/ranks.h"

#include <math.h>
#include <stdlib.h>

static const double clip = 5, least_rate = 0.02, repeats = 1e-5;
enum { MOST_BEST = 64 << 20 }; /* bytes of the best parameters that are held in memory */
enum { VALIDATE_EVERY = 20, FOLDS = 5, CHUNK = 1 << 16, ERRORS = 2 * VG_NETWORK_METHODS * VG_NETWORK_FRAMES };

vg_train_options vg_train_defaults(vg_network_model m)
{
    vg_train_options o = {.model = m, .layers = 1, .hidden = 64, .convolutions = 3, .iterations = 300, .batch = 8,
                          .frames = 32, .step = 1, .given_least = 3, .given_most = 8, .coordinates = 200, .hold = 0.2,
                          .hold_at = VG_HOLD_BY_SEED, .rate = 1e-3, .bidirectional = 0.5, .decay = 1e-3, .seed = 1,
                          .threads = 1};
    if (m == VG_NETWORK_AUTO) return o;
    o.layers = 3, o.hidden = 128, o.given_least = 1, o.rate = 2e-3, o.iterations = 2500, o.coordinates = 48, o.decay = 0;
    if (m == VG_NETWORK_PCA) return o;
    o.decay = 2e-3, o.divergence = 0.1, o.given_least = o.given_most = 1, o.iterations = 7000, o.coordinates = 16;
    return o;
}

/* ---- poses ---- */

static int check_options(const vg_train_options *o, vg_err *e)
{
    if (o->model < VG_NETWORK_AUTO || o->model > VG_NETWORK_CONV || (unsigned)o->direction > VG_FORWARD)
        return vg_fail(e, VG_EARG, "there is no such network");
    if (!o->batch || o->frames < 3 || !o->step || !o->given_least || o->given_least > o->given_most ||
        o->given_most >= o->frames || !o->coordinates || !(o->hold >= 0 && o->hold < 1) || !(o->rate > 0))
        return vg_fail(e, VG_EARG, "invalid training options");
    return VG_OK;
}

int vg_trainer_new(vg_trainer **out, const vg_mesh *m, const double *reference, const vg_train_options *o, vg_err *e)
{
    *out = NULL;
    if (check_options(o, e) < 0) return VG_EARG;
    vg_trainer *t = *out = vgi_array(1, sizeof *t, e);
    if (!t) return VG_ENOMEM;
    t->o = *o;
    vg_feature_options f = {.nine = o->nine, .threads = o->threads};
    int r = vg_featurer_new(&t->featurer, m, reference, &f, e);
    if (r == VG_OK) r = vg_mesh_copy(&t->mesh, m, e);
    if (r == VG_OK && !(t->last = vgi_array(3 * m->nv, sizeof *t->last, e))) r = VG_ENOMEM;
    if (r < 0) return vg_trainer_free(out), r;
    vg_feature_stats stats = vg_featurer_get_stats(t->featurer);
    t->data = (vgi_dataset){.nv = m->nv, .parts = stats.parts, .main_part = stats.main_part, .d = m->nv * stats.width,
                            .diagonal = vg_diagonal(reference, m->nv)};
    t->net = (vg_network){.model = o->model, .direction = o->direction, .mesh_digest = vg_mesh_digest(m), .nv = m->nv,
                          .parts = stats.parts, .width = stats.width, .layers = o->layers, .hidden = o->hidden,
                          .convolutions = o->model == VG_NETWORK_CONV ? o->convolutions : 0,
                          .uncertain = (o->model == VG_NETWORK_FC || o->model == VG_NETWORK_CONV) && o->divergence > 0,
                          .sets = o->direction == VG_SEPARATE ? 2 : 1, .seed = o->seed, .step = o->step,
                          .diagonal = t->data.diagonal};
    if (!(t->data.diagonal > 0)) {
        r = vg_fail(e, VG_EINPUT, "the reference pose has no extent");
        vg_trainer_free(out);
    }
    return r;
}

/* Free the gradients. */
static void clear_gradients(vg_trainer *t)
{
    for (size_t i = 0; t->gradient && i < t->ngradients; i++) free(t->gradient[i]);
    free(t->gradient);
    free(t->total);
    t->gradient = NULL, t->total = NULL, t->ngradients = 0;
}

static void clear_phase(vg_trainer *t)
{
    for (size_t i = 0; t->groups && i < t->ngroups; i++) net_group_clear(&t->groups[i]);
    clear_gradients(t);
    for (int w = 0; w < 2; w++) vgi_regression_clear(&t->regression[w]);
    free(t->fitted.at);
    free(t->tried.at);
    free(t->window);
    free(t->groups);
    free(t->before);
    vgi_runner_clear(&t->runner);
    t->fitted = t->tried = (vgi_spans){0};
    t->window = NULL, t->before = NULL, t->groups = NULL;
    t->nwindows = t->ngroups = t->at_once = 0;
}

void vg_trainer_free(vg_trainer **out)
{
    vg_trainer *t = *out;
    if (!t) return;
    clear_phase(t);
    vg_network_clear(&t->net);
    if (t->frames != t->data.features) free(t->frames);
    vgi_dataset_clear(&t->data);
    vg_mesh_clear(&t->mesh);
    vg_featurer_free(&t->featurer);
    free(t->last);
    free(t->moments);
    vgi_best_clear(&t->best);
    free(t);
    *out = NULL;
    vgi_ranks_end();
}

/* the pose without root motion: the centroid of each component at 0 */
static void bring_home(const vg_trainer *t, const double *pose, const double *root, const double *centroids,
                       double *home)
{
    const vgi_rings *rings = vgi_featurer_rings(t->featurer);
    const double back[4] = {root[0], -root[1], -root[2], -root[3]};
    for (size_t v = 0; v < rings->nv; v++) {
        size_t part = rings->part[v] < 0 ? rings->main_part : (size_t)rings->part[v];
        double x[3];
        vgi_subtract(pose + 3 * v, centroids + 3 * part, x);
        vg_quat_apply(back, x, home + 3 * v);
    }
}

static bool is_repeated(const vg_trainer *t, const double *pose)
{
    double sum = 0;
    for (size_t v = 0; v < t->mesh.nv; v++) {
        double far = 0;
        for (size_t k = 3 * v; k < 3 * v + 3; k++) far += (pose[k] - t->last[k]) * (pose[k] - t->last[k]);
        sum += sqrt(far);
    }
    return t->begun && sum < repeats * t->data.diagonal * (double)t->mesh.nv;
}

static int add_one(vg_trainer *t, const double *pose, double *room, vg_err *e)
{
    double *values = room, *root = values + t->data.d, *centroids = root + 4, *home = centroids + 3 * t->data.parts;
    if (is_repeated(t, pose)) {
        t->data.repeated++;
        return VG_OK;
    }
    if (!t->begun) vg_featurer_restart(t->featurer);
    if (t->cut && vgi_dataset_cut(&t->data, e) < 0) return VG_ENOMEM;
    t->begun = true, t->cut = false;
    memcpy(t->last, pose, 3 * t->mesh.nv * sizeof *pose);
    int r = vg_featurer_measure(t->featurer, 1, &pose, &values, &root, &centroids, e);
    if (r < 0) return r;
    bring_home(t, pose, root, centroids, home);
    return vgi_dataset_add(&t->data, values, t->net.width, root, centroids, home, e);
}

int vg_trainer_add(vg_trainer *t, size_t n, const double *const *poses, vg_err *e)
{
    double *room = vgi_array_raw(t->data.d + 4 + 3 * t->data.parts + 3 * t->mesh.nv, sizeof *room, e);
    int r = room ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < n; i++) r = add_one(t, poses[i], room, e);
    free(room);
    return r;
}

void vg_trainer_cut(vg_trainer *t)
{
    t->begun = false;
    t->cut = true;
}

/* ---- a phase ---- */

/* Validate on the last fifth of each span, at least six frames; on nothing if that leaves too few for training. */
static int choose_block(vg_trainer *t, bool validate, vg_err *e)
{
    enum { LEAST_TRIED = 6, LEAST_FITTED = 12 };
    for (size_t i = 0; i < t->data.train.n; i++) {
        vgi_span s = t->data.train.at[i], rest = s;
        size_t length = s.end - s.first, block = length / 5 < LEAST_TRIED ? LEAST_TRIED : length / 5;
        if (!validate || length < block + LEAST_FITTED) block = 0;
        s.end -= block, rest.first = s.end;
        if (vgi_spans_add(&t->fitted, s, e) < 0 || vgi_spans_add(&t->tried, rest, e) < 0) return VG_ENOMEM;
    }
    return VG_OK;
}

static void free_fold(vgi_fold *f)
{
    free((void *)f->fitted.row);
    free((void *)f->fitted.start);
    free((void *)f->tried.row);
    free((void *)f->tried.start);
}

/* Fold k leaves out the k-th fifth of each span and predicts it from the two frames before it. */
static int make_fold(const vg_trainer *t, size_t k, vgi_fold *f, vg_err *e)
{
    vgi_spans fitted = {0}, tried = {0};
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < t->data.train.n; i++) {
        vgi_span s = t->data.train.at[i], before = s, block = s, behind = s;
        size_t length = s.end - s.first;
        before.end = block.first = s.first + k * length / FOLDS;
        behind.first = block.end = s.first + (k + 1) * length / FOLDS;
        if (k) block.first -= block.first - s.first < 2 ? 0 : 2;
        if (vgi_spans_add(&fitted, before, e) < 0 || vgi_spans_add(&fitted, behind, e) < 0 ||
            vgi_spans_add(&tried, block, e) < 0)
            r = VG_ENOMEM;
    }
    if (r == VG_OK) r = vgi_spans_coordinates(&fitted, &t->data, &f->fitted, e);
    if (r == VG_OK) r = vgi_spans_coordinates(&tried, &t->data, &f->tried, e);
    free(fitted.at);
    free(tried.at);
    return r;
}

/* Choose ridges and damping on five blocks left out in turn; a single block may be unlike all others. */
static int choose_regression(vg_trainer *t, vg_err *e)
{
    vgi_fold folds[FOLDS] = {0};
    int r = VG_OK;
    for (size_t k = 0; r == VG_OK && k < FOLDS; k++) r = make_fold(t, k, &folds[k], e);
    if (r == VG_OK) r = vgi_regression_choose(folds, FOLDS, t->data.sigma, t->o.threads, &t->choice, e);
    for (size_t k = 0; k < FOLDS; k++) free_fold(&folds[k]);
    t->net.ridge = t->choice.ridge, t->net.damping = t->choice.damping;
    return r;
}

/* Fit the regressions of both directions to the training frames. */
static int fit_regressions(vg_trainer *t, vg_err *e)
{
    vgi_frames fitted;
    int r = t->net.damping ? VG_OK : choose_regression(t, e);
    if (r == VG_OK) r = vgi_spans_coordinates(&t->fitted, &t->data, &fitted, e);
    if (r < 0) return r;
    vgi_blas_alone();
    for (int back = 0; r == VG_OK && back < 2; back++) {
        r = vgi_regression_make(&t->regression[back], t->data.rank, e);
        if (r == VG_OK)
            r = vgi_regression_fit(&t->regression[back], &fitted, back, t->data.sigma, &t->choice, e);
    }
    vgi_blas_shared();
    if (r == VG_OK) vgi_regression_even(&t->regression[0], &t->regression[1]);
    free((void *)fitted.row);
    free((void *)fitted.start);
    if (r < 0 || t->o.model != VG_NETWORK_AUTO) return r;
    size_t all = vgi_regression_size(t->data.rank);
    if (!t->net.regression && !(t->net.regression = vgi_array(2 * all, sizeof *t->net.regression, e))) return VG_ENOMEM;
    for (int back = 0; back < 2; back++)
        memcpy(t->net.regression + (size_t)back * all, t->regression[back].turn, all * sizeof *t->net.regression);
    return VG_OK;
}

/* The two frames that the regressions put before each frame, for forward and for backward chains. Runs from a single
 * frame start with them. */
static int find_before(vg_trainer *t, vg_err *e)
{
    size_t n = t->data.rank;
    if (t->o.model != VG_NETWORK_AUTO) return VG_OK;
    double *one = vgi_array_raw(2 * n, sizeof *one, e);
    t->before = vgi_array_raw(t->data.n * 4 * n, sizeof *t->before, e);
    if (!one || !t->before) return free(one), VG_ENOMEM;
    for (size_t i = 0; i < t->data.n; i++)
        for (size_t back = 0; back < 2; back++) {
            const vgi_regression *linear = &t->regression[1 - back];
            const double *c = t->data.coordinates + i * n;
            float *to = t->before + (2 * i + back) * 2 * n;
            vgi_regression_next(linear, c, NULL, one);
            vgi_regression_next(linear, one, c, one + n);
            for (size_t k = 0; k < n; k++) to[k] = (float)one[n + k], to[n + k] = (float)one[k];
        }
    free(one);
    return VG_OK;
}

static int find_windows(vg_trainer *t, vg_err *e)
{
    size_t longest = 0, cap = 0;
    for (size_t i = 0; i < t->fitted.n; i++) {
        size_t length = t->fitted.at[i].end - t->fitted.at[i].first;
        longest = length > longest ? length : longest;
    }
    t->length = t->o.frames < longest ? t->o.frames : longest;
    if (t->length <= t->o.given_least || t->length < 3)
        return vg_fail(e, VG_EINPUT, "the longest run of frames for training is %zu, which is too short", longest);
    for (size_t i = 0; i < t->fitted.n; i++)
        for (size_t w = t->fitted.at[i].first; w + t->length <= t->fitted.at[i].end; w++) {
            if (vgi_grow(&t->window, &cap, t->nwindows + 1, sizeof *t->window, e) < 0) return VG_ENOMEM;
            t->window[t->nwindows++] = w;
        }
    return VG_OK;
}

static int make_groups(vg_trainer *t, vg_err *e)
{
    size_t size = vgi_group_size(t->o.direction), all = t->net.sets * t->net.nparameters;
    t->ngroups = (t->o.batch + size - 1) / size;
    t->at_once = (size_t)t->o.threads * vgi_ranks() < t->ngroups ? (size_t)t->o.threads * vgi_ranks() : t->ngroups;
    t->groups = vgi_array(t->ngroups, sizeof *t->groups, e);
    t->gradient = vgi_array(t->at_once, sizeof *t->gradient, e);
    t->total = vgi_array(all, sizeof *t->total, e);
    if (!t->groups || !t->gradient || !t->total) return VG_ENOMEM;
    t->ngradients = t->ngroups > t->at_once ? t->at_once : t->at_once - 1;
    for (size_t i = 0; i < t->at_once; i++)
        if (net_group_make(&t->groups[i], &t->shape, t->o.direction, t->length, 0, e) < 0) return VG_ENOMEM;
    t->left_out = t->groups[0].chains[0].late ? t->shape.numbers * t->shape.latent : 0;
    for (size_t i = 0; i < t->ngradients; i++)
        if (!(t->gradient[i] = vgi_array(all - t->left_out, sizeof **t->gradient, e))) return VG_ENOMEM;
    return VG_OK;
}

static int start_parameters(vg_trainer *t, vg_err *e)
{
    size_t one = t->net.nparameters, all = t->net.sets * one;
    if (!t->net.parameters) {
        t->net.parameters = vgi_array(all, sizeof *t->net.parameters, e);
        t->moments = vgi_array(2 * all, sizeof *t->moments, e);
        if (!t->net.parameters || !t->moments) return VG_ENOMEM;
        int r = vgi_best_make(&t->best, all, MOST_BEST, e);
        if (r < 0) return r;
    }
    memset(t->moments, 0, 2 * all * sizeof *t->moments);
    for (size_t w = 0; w < t->net.sets; w++)
        if (vgi_shape_start(&t->shape, t->o.seed + 1000003 * w, t->o.model == VG_NETWORK_AUTO, t->net.parameters + w * one, e) < 0)
            return VG_ENOMEM;
    return VG_OK;
}

/* Compute everything that depends on the frames of a phase, and reset the parameters. */
static int begin_phase(vg_trainer *t, bool validate, vg_err *e)
{
    const vgi_rings *rings = vgi_featurer_rings(t->featurer);
    clear_phase(t);
    int r = choose_block(t, validate, e);
    if (r == VG_OK) r = fit_regressions(t, e);
    if (r == VG_OK) r = find_before(t, e);
    if (r == VG_OK) r = find_windows(t, e);
    if (r == VG_OK) r = start_parameters(t, e);
    if (r == VG_OK) r = make_groups(t, e);
    if (r == VG_OK) r = vgi_runner_make(&t->runner, &t->net, rings->first, rings->to, &t->groups[0].chains[0], e);
    if (r < 0) return r;
    t->state.iteration = 0;
    t->state.phase = validate ? 0 : 1;
    return VG_OK;
}

/* frames as the layers see them */
static int make_frames(vg_trainer *t, vg_err *e)
{
    size_t n = t->net.numbers;
    if (!vgi_network_is_linear(&t->net)) {
        vgi_dataset_normalise(&t->data, &t->net);
        t->frames = t->data.features;
        return VG_OK;
    }
    t->frames = vgi_array_raw(t->data.n * n, sizeof *t->frames, e);
    if (!t->frames) return VG_ENOMEM;
    for (size_t i = 0; i < t->data.n * n; i++) t->frames[i] = (float)t->data.coordinates[i];
    return VG_OK;
}

int vg_trainer_prepare(vg_trainer *t, vg_err *e)
{
    const vgi_rings *rings = vgi_featurer_rings(t->featurer);
    int r = vgi_dataset_divide(&t->data, t->o.step, t->o.hold, t->o.hold_at, t->o.seed, e);
    if (r == VG_OK) r = vgi_dataset_find_coordinates(&t->data, &t->net, t->o.coordinates, t->o.threads, e);
    if (r == VG_OK) r = vgi_root_fit(&t->data, &t->net, e);
    if (r < 0) return r;
    t->net.numbers = vgi_network_is_linear(&t->net) ? t->net.rank : t->data.d;
    t->net.data_digest = t->data.digest;
    t->net.frames = vgi_spans_frames(&t->data.train);
    r = vgi_network_shape(&t->net, &t->shape, e);
    if (r < 0) return r;
    t->shape.first = rings->first, t->shape.to = rings->to;
    t->net.nparameters = t->shape.total;
    r = make_frames(t, e);
    if (r == VG_OK && !(t->net.errors = vgi_array(ERRORS, sizeof *t->net.errors, e))) r = VG_ENOMEM;
    for (int i = 0; r == VG_OK && i < ERRORS; i++) t->net.errors[i] = -1;
    t->net.curve_start = -1;
    if (r == VG_OK) r = begin_phase(t, true, e);
    if (r == VG_OK && !t->tried.n) t->state.phase = 1; /* too short for a block: train on all of it, for as long as
                                                             requested */
    if (r < 0) return r;
    t->state.parameters = t->net.sets * t->net.nparameters, t->state.coordinates = t->net.rank;
    t->state.frames = t->net.frames, t->state.held = vgi_spans_frames(&t->data.held);
    t->state.iterations = t->o.iterations;
    t->best_error = INFINITY;
    t->ready = true;
    return VG_OK;
}

/* ---- an iteration ---- */

typedef struct adam {
    float *p, *first, *second, *gradient;
    size_t n;
    float shrink, rate, correction, decay;
} adam;

static void adam_chunk(void *context, size_t chunk)
{
    const adam *a = context;
    size_t end = (chunk + 1) * CHUNK < a->n ? (chunk + 1) * CHUNK : a->n;
    for (size_t i = chunk * CHUNK; i < end; i++) {
        float g = a->shrink * a->gradient[i];
        a->first[i] = 0.9f * a->first[i] + 0.1f * g;
        a->second[i] = 0.999f * a->second[i] + 0.001f * g * g;
        a->p[i] -= a->rate * a->first[i] / (sqrtf(a->second[i] * a->correction) + 1e-8f);
    }
}

static double length_of(const float *g, size_t n)
{
    double sum = 0;
    for (size_t from = 0; from < n; from += CHUNK) {
        double part = 0;
        for (size_t i = from; i < n && i < from + CHUNK; i++) part += (double)g[i] * (double)g[i];
        sum += part;
    }
    return sqrt(sum);
}

static void train_iteration(vg_trainer *t)
{
    size_t all = t->net.sets * t->net.nparameters;
    double done = (double)t->state.iteration, share = done / (double)t->o.iterations;
    for (size_t i = 0; i < all; i++) t->total[i] += (float)(2 * t->o.decay) * t->net.parameters[i];
    t->state.gradient = length_of(t->total, all);
    double rate = t->o.rate * (least_rate + (1 - least_rate) * 0.5 * (1 + cos(M_PI * fmin(share, 1))));
    adam a = {.p = t->net.parameters, .first = t->moments, .second = t->moments + all, .gradient = t->total, .n = all,
              .shrink = (float)(t->state.gradient > clip ? clip / t->state.gradient : 1),
              .rate = (float)(rate / (1 - pow(0.9, done + 1))), .correction = (float)(1 / (1 - pow(0.999, done + 1)))};
    if (t->state.gradient < 1e30) vgi_parallel(t->o.threads, (all + CHUNK - 1) / CHUNK, adam_chunk, &a);
}

/* ---- number of iterations ---- */

/* The training is over: free what only another iteration would need. */
static void end_training(vg_trainer *t)
{
    t->ended = true;
    clear_gradients(t);
    free(t->moments);
    vgi_best_clear(&t->best);
    t->moments = NULL;
}

static int keep_best(vg_trainer *t, double error, vg_err *e)
{
    if (!(error < t->best_error)) return VG_OK;
    t->best_error = error;
    t->state.best_iteration = t->state.iteration;
    return vgi_best_put(&t->best, t->net.parameters, e);
}

/* Set the correction to zero, so that the regression is used alone. */
static void silence(vg_trainer *t)
{
    const vgi_shape *s = &t->shape;
    for (size_t w = 0; w < t->net.sets; w++) {
        float *p = t->net.parameters + w * t->net.nparameters;
        memset(p + s->full, 0, s->hidden * s->numbers * sizeof *p);
        memset(p + s->full_bias, 0, s->numbers * sizeof *p);
    }
}

/* End of the phase with the validation block. */
static int end_phase(vg_trainer *t, vg_err *e)
{
    uint64_t best = t->state.best_iteration;
    if (t->o.model != VG_NETWORK_AUTO) {
        int r = vgi_best_get(&t->best, t->net.parameters, e);
        end_training(t);
        return r;
    }
    if (begin_phase(t, false, e) < 0) return e ? e->code : VG_ENOMEM;
    t->state.iterations = best;
    if (!best) {
        silence(t);
        end_training(t);
    }
    return VG_OK;
}

static int validate(vg_trainer *t, vg_err *e)
{
    double error;
    t->state.validation = NAN;
    if (t->state.phase || t->state.iteration % VALIDATE_EVERY) return VG_OK;
    int r = vgi_trainer_validate(t, &error, e);
    if (r < 0) return r;
    t->state.validation = error;
    return keep_best(t, error, e);
}

static bool has_waited(const vg_trainer *t)
{
    uint64_t patience = t->o.iterations / 3 < 100 ? 100 : t->o.iterations / 3;
    return t->state.iteration >= t->state.best_iteration + patience;
}

vg_train_state vg_trainer_get_state(const vg_trainer *t)
{
    return t->state;
}

/* The error before the first iteration: of a correction that is still small, about that of the regression alone. */
static int begin_curve(vg_trainer *t, vg_err *e)
{
    if (t->state.iteration || t->state.phase) return VG_OK;
    int r = validate(t, e);
    if (r == VG_OK && isfinite(t->state.validation)) t->net.curve_start = t->state.validation;
    return r;
}

/* Adds the iteration that was done to the curve. */
static int add_to_curve(vg_trainer *t, vg_err *e)
{
    float row[3] = {(float)t->state.loss, (float)t->state.gradient, t->state.validation < 1e30 ? (float)t->state.validation : -1};
    int r = vgi_grow(&t->net.curve, &t->curve_cap, t->net.ncurve + 1, sizeof row, e);
    if (r < 0) return r;
    memcpy(t->net.curve + 3 * t->net.ncurve++, row, sizeof row);
    if (!t->state.phase) t->net.ncurve_block++;
    return VG_OK;
}

int vg_trainer_step(vg_trainer *t, vg_train_state *state, vg_err *e)
{
    double loss;
    int r = t->ended ? VG_OK : begin_curve(t, e);
    bool last = t->state.iteration >= t->state.iterations || (!t->state.phase && has_waited(t));
    if (r == VG_OK && !t->ended && last) {
        if (t->state.phase) end_training(t);
        else r = end_phase(t, e);
    }
    if (r < 0 || t->ended) {
        *state = t->state;
        return r;
    }
    r = vgi_trainer_gradient(t, &loss, e);
    if (r < 0) return r;
    train_iteration(t);
    t->state.loss = loss;
    if (!(t->state.gradient < 1e30) || !(loss < 1e30))
        return vg_fail(e, VG_EINPUT, "training diverges at iteration %llu: choose a smaller --rate",
                       (unsigned long long)t->state.iteration);
    t->state.iteration++;
    t->net.iterations = t->state.iteration;
    r = validate(t, e);
    if (r == VG_OK) r = add_to_curve(t, e);
    if (r < 0) return r;
    *state = t->state;
    return 1;
}

/* ---- several processes ---- */

size_t vg_train_process(void)
{
    return vgi_rank();
}

bool vg_train_any(bool yes)
{
    return vgi_ranks_any(yes);
}

/* ---- networks out and in ---- */

int vg_trainer_network(const vg_trainer *t, bool complete, vg_network *n, vg_err *e)
{
    vg_network view = t->net;
    if (!complete && !t->ended) {
        view.open = true;
        view.moments = t->moments, view.best = t->total; /* which is free between iterations */
        int r = vgi_best_get(&t->best, t->total, e);
        if (r < 0) return r;
        view.phase = (uint64_t)t->state.phase, view.best_iteration = t->state.best_iteration, view.best_error = t->best_error;
        if (!(view.best_error < INFINITY)) view.best_error = -1;
    }
    return vg_network_copy(n, &view, e);
}

int vg_trainer_resume(vg_trainer *t, const vg_network *from, vg_err *e)
{
    const vg_network *n = &t->net;
    size_t all = n->sets * n->nparameters;
    if (!from->open) return vg_fail(e, VG_EINPUT, "its training has ended: there is nothing to resume");
    if (from->mesh_digest != n->mesh_digest || from->data_digest != n->data_digest || from->frames != n->frames)
        return vg_fail(e, VG_EINPUT, "it was trained on other poses");
    if (from->model != n->model || from->direction != n->direction || from->nparameters != n->nparameters ||
        from->rank != n->rank || from->seed != n->seed || from->step != n->step)
        return vg_fail(e, VG_EINPUT, "it was trained with other options");
    int r = from->phase && !t->state.phase ? begin_phase(t, false, e) : VG_OK;
    if (r < 0) return r;
    memcpy(t->net.parameters, from->parameters, all * sizeof *t->moments);
    memcpy(t->moments, from->moments, 2 * all * sizeof *t->moments);
    r = vgi_best_put(&t->best, from->best, e);
    if (r < 0) return r;
    free(t->net.curve);
    t->net.curve = vgi_copy_array(from->curve, 3 * from->ncurve, sizeof *from->curve, e);
    if (!t->net.curve) return t->net.ncurve = 0, VG_ENOMEM;
    t->net.ncurve = t->curve_cap = from->ncurve, t->net.ncurve_block = from->ncurve_block;
    t->net.curve_start = from->curve_start;
    t->state.iteration = t->net.iterations = from->iterations;
    t->state.best_iteration = from->best_iteration;
    t->best_error = from->best_error < 0 ? INFINITY : from->best_error;
    if (t->state.phase && t->tried.n == 0 && from->best_error >= 0) t->state.iterations = from->best_iteration;
    return VG_OK;
}
