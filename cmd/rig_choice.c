/* rig_choice.c: mix envelope and skinning, vertex by vertex, with the least error in poses left out of the fit.
 *
 * In a pose left out, vertex v has the error s by skinning and s + d by the envelope; with a share a of the envelope it has
 * s + a d. Its squares change by 2 a (sum of s d) + a a (sum of d d), summed over the poses of a fold, each left out once, and
 * over the faces around the vertex. The share is the one whose worst fold gains most: poses to come are farther from the
 * fitted ones than those left out, so an envelope that loses in one fold is not taken.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "rig_choice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FOLDS = 3, RIDGES = 3, MOST_CANDIDATES = 2 * RIDGES, SMOOTHINGS = 2, SEARCH = 24 };
static const size_t large = 1000000; /* vertices times bones: beyond it one number of bones per corner is tried */

typedef struct candidate {
    size_t bones_per_corner;
    double refine;
    double *sums[FOLDS]; /* of the poses of each fold, 2 nv: s d, d d */
} candidate;

typedef struct choosing {
    const fitting *f;
    double *const *transforms;
    size_t fold, folds, fitted; /* blocks; poses that are not held out */
    size_t *rank;               /* of each of these poses among them */
    vg_rig_fitter *fitter;
    size_t nridges;
    candidate at[MOST_CANDIDATES], *now; /* those of the same bones per corner follow one another, one for each ridge */
    size_t n;
} choosing;

static void *choice_array(size_t n, size_t size)
{
    return cli_allocate(n, size, "the choice of a map");
}

static bool is_in_fold(const choosing *x, size_t i)
{
    return x->rank[i] * x->folds / x->fitted == x->fold;
}

static bool is_fitted(void *context, size_t i)
{
    const choosing *x = context;
    return !fitting_is_held_out(x->f, i) && !is_in_fold(x, i);
}

static bool is_left_out(void *context, size_t i)
{
    const choosing *x = context;
    return !fitting_is_held_out(x->f, i) && is_in_fold(x, i);
}

static void take_transforms(const choosing *x, const fitting_batch *b, const double **transforms)
{
    for (size_t i = 0; i < b->n; i++) transforms[i] = x->transforms[b->index[i]];
}

static void add_batch(void *context, const fitting_batch *b)
{
    choosing *x = context;
    const double *transforms[FITTING_BATCH];
    take_transforms(x, b, transforms);
    vg_rig_fitter_add(x->fitter, b->n, b->values, transforms);
}

static void judge_batch(void *context, const fitting_batch *b)
{
    choosing *x = context;
    vg_err e;
    const double *transforms[FITTING_BATCH];
    double *sums[RIDGES];
    take_transforms(x, b, transforms);
    for (size_t i = 0; i < x->nridges; i++) sums[i] = x->now[i].sums[x->fold];
    if (vg_rig_fitter_judge(x->fitter, b->n, b->values, transforms, sums, &e) < 0) cli_die(&e);
}

/* All candidates on one fold. */
static void try_fold(choosing *x, const vg_rig_options *o)
{
    vg_err e;
    vg_rig_options trial = *o;
    trial.trial = true;
    if (vg_rig_fitter_new(&x->fitter, x->f->h, &trial, &e) < 0) cli_die(&e);
    fitting_pass(x->f, is_fitted, add_batch, x);
    for (size_t c = 0; c < x->n; c += x->nridges) {
        double ridge[RIDGES];
        x->now = &x->at[c];
        for (size_t i = 0; i < x->nridges; i++) ridge[i] = x->now[i].refine;
        vg_rig_fitter_choose(x->fitter, x->now->bones_per_corner, o->refine);
        if (vg_rig_fitter_try(x->fitter, x->nridges, ridge, &e) < 0) cli_die(&e);
        fitting_pass(x->f, is_left_out, judge_batch, x);
    }
    vg_rig_fitter_free(&x->fitter);
}

/* Sums over the faces around each vertex. */
static void smooth(const vg_mesh *m, double *sums, double *work)
{
    memset(work, 0, 2 * m->nv * sizeof *work);
    for (size_t f = 0; f < m->nf; f++)
        for (int k = 0; k < 2; k++) {
            double sum = 0;
            for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) sum += sums[2 * (size_t)m->vert[c] + (size_t)k];
            for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) work[2 * (size_t)m->vert[c] + (size_t)k] += sum;
        }
    for (size_t i = 0; i < 2 * m->nv; i++)
        if (work[i / 2 * 2 + 1] > 0) sums[i] = work[i];
}

/* By what a share of the envelope changes the sum of squares of one vertex in one fold. */
static double change_by(const double *sums, double share)
{
    return 2 * share * sums[0] + share * share * sums[1];
}

static double worst_change(const double *const *sums, size_t folds, size_t v, double share)
{
    double most = -INFINITY;
    for (size_t f = 0; f < folds; f++) most = fmax(most, change_by(sums[f] + 2 * v, share));
    return most;
}

/* The share between 0 and 1 whose worst fold is best: the worst of parabolas is convex. */
static double find_share(const double *const *sums, size_t folds, size_t v)
{
    static const double golden = 0.6180339887498949;
    double a = 0, b = 1;
    for (size_t f = 0; f < folds; f++)
        if (sums[f][2 * v] >= 0) return 0;
    for (int i = 0; i < SEARCH; i++) {
        double width = golden * (b - a), left = b - width, right = a + width;
        if (worst_change(sums, folds, v, left) < worst_change(sums, folds, v, right)) b = right;
        else a = left;
    }
    return (a + b) / 2;
}

/* The shares of one candidate, in share; what the sum of squares changes by. */
static double find_shares(const choosing *x, const candidate *c, double *share, double *const *smoothed, double *work)
{
    const vg_mesh *m = &x->f->h->body.mesh;
    double change = 0;
    for (size_t f = 0; f < x->folds; f++) {
        memcpy(smoothed[f], c->sums[f], 2 * m->nv * sizeof *work);
        for (int i = 0; i < SMOOTHINGS; i++) smooth(m, smoothed[f], work);
    }
    for (size_t v = 0; v < m->nv; v++) {
        share[v] = find_share((const double *const *)smoothed, x->folds, v);
        for (size_t f = 0; f < x->folds; f++) change += change_by(c->sums[f] + 2 * v, share[v]);
    }
    return change;
}

static void choose_best(const choosing *x, rig_choice *choice)
{
    const vg_mesh *m = &x->f->h->body.mesh;
    double *share = choice_array(m->nv, sizeof *share), *work = choice_array(2 * m->nv, sizeof *work), best = 0;
    double *smoothed[FOLDS];
    for (int f = 0; f < FOLDS; f++) smoothed[f] = choice_array(2 * m->nv, sizeof *work);
    choice->share = choice_array(m->nv, sizeof *choice->share);
    choice->mean = 0, choice->folds = x->folds;
    choice->bones_per_corner = x->at[0].bones_per_corner, choice->refine = x->at[0].refine;
    for (size_t c = 0; c < x->n; c++) {
        double change = find_shares(x, &x->at[c], share, smoothed, work);
        if (!(change < best)) continue;
        best = change;
        memcpy(choice->share, share, m->nv * sizeof *share);
        choice->bones_per_corner = x->at[c].bones_per_corner, choice->refine = x->at[c].refine;
    }
    for (size_t v = 0; v < m->nv; v++) choice->mean += choice->share[v] / (double)m->nv;
    free(share);
    for (int f = 0; f < FOLDS; f++) free(smoothed[f]);
    free(work);
}

static candidate make_candidate(size_t nv, size_t corners, double refine)
{
    candidate c = {.bones_per_corner = corners, .refine = refine};
    for (int f = 0; f < FOLDS; f++) c.sums[f] = choice_array(2 * nv, sizeof *c.sums[f]);
    return c;
}

static void list_candidates(choosing *x, const vg_rig_options *o, bool corners_given, bool refine_given)
{
    static const double strengths[RIDGES] = {0.003, 0.03, 0.3};
    const vg_head *h = x->f->h;
    size_t least = corners_given || h->body.mesh.nv * h->body.rig.nbones > large ? o->bones_per_corner : 1;
    x->nridges = refine_given ? 1 : RIDGES;
    for (size_t corners = o->bones_per_corner + 1; corners-- > least;)
        for (size_t i = 0; i < x->nridges; i++)
            x->at[x->n++] = make_candidate(h->body.mesh.nv, corners, refine_given ? o->refine : strengths[i]);
}

void rig_choose(const fitting *f, double *const *transforms, const vg_rig_options *o, bool corners_given,
                bool refine_given, rig_choice *choice)
{
    choosing x = {.f = f, .transforms = transforms};
    x.rank = choice_array(f->n, sizeof *x.rank);
    for (size_t i = 0; i < f->n; i++)
        if (!fitting_is_held_out(f, i)) x.rank[i] = x.fitted++;
    x.folds = x.fitted < FOLDS ? x.fitted : FOLDS;
    list_candidates(&x, o, corners_given, refine_given);
    for (x.fold = 0; x.fold < x.folds && x.folds > 1; x.fold++) {
        cli_progress_of("folds", x.fold, x.folds);
        try_fold(&x, o);
    }
    choose_best(&x, choice);
    for (size_t c = 0; c < x.n; c++)
        for (int k = 0; k < FOLDS; k++) free(x.at[c].sums[k]);
    free(x.rank);
}
