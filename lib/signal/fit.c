/* fit.c: fits the three signals to a sequence, each as small as the tolerance allows.
 *
 * First the smallest m whose shapes are within 0.7 of the tolerance, then the smallest l within 0.9, then the
 * smallest k within all of it. Sites and knots are nested, so that each trial is one product. The signals are in
 * basis, layout, spline_pose and spline_time.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "numeric/stats.h"
#include "signal/curve.h"
#include "signal/root.h"
#include "signal/span.h"
#include "signal/unshape.h"

#include <math.h>
#include <stdlib.h>

enum { CROSSING_PARTS = 16 }; /* straight segments per frame interval that are searched for crossings */

typedef struct fitting {
    vg_signal *s;
    const vg_signal_options *o;
    vg_signal_stats *report;
    size_t n;
    double d, tolerance; /* D; the largest distance allowed */
    vgi_basis basis;
    vgi_span span;         /* of examples */
    vgi_unshape unshape;   /* if shapes are not vertices */
    double limit;          /* larger errors need not be exact */
    double *other;         /* with examples: the frames as sums of the examples if basis has the frames, and vice
                              versa; NULL without examples */
    vgi_plate plate;
    double *room, *fitted; /* n x rank each */
    double *coefficients, *functions;
    double *t;
    uint32_t *order, *sorted;
    vgi_curve curve;
} fitting;

void vg_signal_stats_clear(vg_signal_stats *r)
{
    free(r->frame_error);
    free(r->deviation);
    free(r->crossing);
    *r = (vg_signal_stats){0};
}

/* ---- cost of a choice of m, l, k ---- */

static bool of_vertices(const fitting *f)
{
    return f->s->space == VG_SPACE_VERTICES;
}

static int error_of(fitting *f, const double *x, size_t stride, size_t m, vgi_error *error, vg_err *e)
{
    if (!of_vertices(f)) return vgi_unshape_error(&f->unshape, &f->basis, x, stride, m, f->limit, error, e);
    return vgi_basis_error(&f->basis, x, stride, m, f->o->threads, error, e);
}

static int error_of_shape(fitting *f, size_t m, vgi_error *error, vg_err *e)
{
    return error_of(f, f->basis.x, f->basis.rank, m, error, e);
}

static int error_of_pose(fitting *f, size_t l, vgi_error *error, vg_err *e)
{
    size_t m = f->s->m;
    if (m) vgi_plate_fitted(&f->plate, l, m, f->basis.x, f->basis.rank, f->fitted, f->room);
    return error_of(f, f->fitted, m, m, error, e);
}

static int error_of_time(fitting *f, size_t knots, vgi_error *error, vg_err *e)
{
    size_t m = f->s->m, l = f->s->l;
    double p[2];
    memcpy(f->sorted, f->order, knots * sizeof *f->order);
    qsort(f->sorted, knots, sizeof *f->sorted, vgi_by_index);
    vgi_curve_clear(&f->curve);
    if (vgi_curve_fit(&f->curve, f->n, f->s->position, f->t, f->sorted, knots, e) < 0) return VG_ENOMEM;
    for (size_t i = 0; i < f->n; i++) {
        vgi_curve_point(&f->curve, f->t[i], p);
        vgi_plate_functions(&f->plate, l, p, f->functions + i * l);
    }
    if (m) vgi_product_double(f->n, m, l, f->functions, l, f->coefficients, m, f->fitted, m);
    return error_of(f, f->fitted, m, m, error, e);
}

/* Sites and control points approximate what the examples span: searches compare with that, reports with the frames. */
static void exchange_poses(fitting *f)
{
    double *poses = f->basis.centred;
    if (!f->other) return;
    f->basis.centred = f->other, f->other = poses;
}

/* The smallest of low .. high within the limit, or high if none is. */
static int smallest(fitting *f, size_t low, size_t high, double limit,
                    int (*measure)(fitting *f, size_t count, vgi_error *error, vg_err *e), size_t *found, vg_err *e)
{
    int r = VG_OK;
    exchange_poses(f);
    f->limit = limit;
    while (low < high && r == VG_OK) {
        size_t middle = (low + high) / 2;
        vgi_error error = {0};
        r = measure(f, middle, &error, e);
        if (error.most <= limit) high = middle;
        else low = middle + 1;
    }
    exchange_poses(f);
    f->limit = INFINITY;
    *found = high;
    return r;
}

/* ---- the steps ---- */

static int fit_root(fitting *f, const vg_body *body, double *poses, vg_err *e)
{
    vg_signal *s = f->s;
    if (!f->o->root && of_vertices(f)) return VG_OK;
    s->rooted = true;
    if (!(s->turn = vgi_array(f->n, 4 * sizeof *s->turn, e)) || !(s->shift = vgi_array(f->n, 3 * sizeof *s->shift, e)))
        return VG_ENOMEM;
    for (size_t i = 0; i < f->n; i++) s->turn[4 * i] = 1;
    if (f->o->root) vgi_root_remove(f->n, body->mesh.nv, body->reference, poses, s->turn, s->shift);
    if (!of_vertices(f)) vgi_root_centre(f->n, f->o->graph, f->unshape.root, poses, s->turn, s->shift);
    return VG_OK;
}

/* Shapes of the poses, stored for the errors. */
static int fit_space(fitting *f, const vg_body *body, double *poses, vg_err *e)
{
    vg_signal *s = f->s;
    vgi_unshape *u = &f->unshape;
    u->poses = poses;
    s->d = u->space.d;
    double *values = vgi_array_raw(f->n * s->d, sizeof *values, e);
    int r = values ? vgi_space_measure(&u->space, body->reference, f->n, poses, values, u->home, &f->report->jumps,
                                       f->o->threads, e) : VG_ENOMEM;
    if (r == VG_OK && vgi_space_homes(&u->space)) {
        s->nturns = vgi_space_homes(&u->space);
        s->home_turn = vgi_copy_array(u->home, s->nturns, 4 * sizeof(double), e);
        if (!s->home_turn) r = VG_ENOMEM;
    }
    if (r == VG_OK) return vgi_basis_make(&f->basis, values, f->n, s->d, f->o->threads, e);
    free(values);
    return r;
}

static int fit_shape(fitting *f, vg_err *e)
{
    vg_signal *s = f->s;
    vgi_error error = {0};
    size_t rank = f->basis.rank, size = f->n * (rank + 1);
    int r = VG_ENOMEM;
    if (!(f->room = vgi_array(size, sizeof *f->room, e)) || !(f->fitted = vgi_array(size, sizeof *f->fitted, e)))
        return VG_ENOMEM;
    s->m = f->o->m && f->o->m < rank ? f->o->m : rank;
    if (f->o->nexamples && (r = vgi_span_project(&f->basis, &f->other, e)) < 0) return r;
    if (!f->o->m && !f->o->nexamples && (r = smallest(f, 0, rank, 0.7 * f->tolerance, error_of_shape, &s->m, e)) < 0) return r;
    if ((r = error_of_shape(f, s->m, &error, e)) < 0) return r;
    s->error_shape = error.most / f->d;
    return VG_OK;
}

/* Distances use all coordinates, not the first m, so that the layout does not depend on the tolerance. */
static int place_frames(fitting *f, vg_err *e)
{
    vg_signal *s = f->s;
    const vg_signal_options *o = f->o;
    vg_signal_stats *report = f->report;
    size_t n = f->n, rank = f->basis.rank;
    vg_layout_trial only = {.layout = o->layout, .weight = o->weight}, chosen = {.layout = o->layout};
    int r;
    if (!(s->position = vgi_array(n, 2 * sizeof *s->position, e))) return VG_ENOMEM;
    if (o->layout == VG_LAYOUT_PLACED) memcpy(s->position, o->place, 2 * n * sizeof *s->position);
    else if ((r = vgi_layout_choose(n, rank, f->basis.x, o->pins, o->npins,
                                    o->layout == VG_LAYOUT_AUTO ? NULL : &only, o->threads, s->position, &chosen,
                                    &report->period, report->trials, &report->ntrials, e)) < 0)
        return r;
    double *deviation = vgi_array(3 * (n - 1), sizeof *deviation, e);
    if (!deviation || !(report->deviation = vgi_array(n - 1, sizeof(double), e))) {
        free(deviation);
        return VG_ENOMEM;
    }
    if ((r = vgi_layout_judge(n, rank, f->basis.x, s->position, &s->layout_ratio, deviation, e)) == VG_OK)
        for (size_t i = 0; i < 3 * (n - 1); i++) report->deviation[i / 3] += deviation[i] / 3;
    s->layout = chosen.layout;
    s->layout_weight = chosen.weight;
    free(deviation);
    return r;
}

static int fit_pose(fitting *f, vg_err *e)
{
    vg_signal *s = f->s;
    size_t n = f->n, m = s->m, rank = f->basis.rank;
    vgi_error error = {0};
    int r = vgi_plate_order(&f->plate, n, m, s->position, f->basis.x, rank, f->o->gain ? VGI_GAIN : VGI_FARTHEST, e);
    if (r < 0) return r;
    size_t least = f->plate.anchors, most = f->plate.l;
    s->l = f->o->l < least ? least : f->o->l < most ? f->o->l : most;
    if (!f->o->l && (r = smallest(f, least, most, 0.9 * f->tolerance, error_of_pose, &s->l, e)) < 0) return r;
    if ((r = error_of_pose(f, s->l, &error, e)) < 0) return r;
    s->error_pose = error.most / f->d;
    if (!(s->coordinate = vgi_array(n * m, sizeof *s->coordinate, e)) ||
        !(s->site = vgi_copy_array(f->plate.site, s->l, sizeof *s->site, e)) ||
        !(f->coefficients = vgi_array(s->l * m, sizeof(double), e)) ||
        !(f->functions = vgi_array(n * s->l, sizeof(double), e)))
        return VG_ENOMEM;
    for (size_t i = 0; i < n; i++) memcpy(s->coordinate + i * m, f->basis.x + i * rank, m * sizeof(double));
    vgi_plate_solve(&f->plate, s->l, m, s->coordinate, m, f->coefficients);
    return VG_OK;
}

static int fit_time(fitting *f, vg_err *e)
{
    vg_signal *s = f->s;
    size_t n = f->n, knots = n;
    vgi_error error = {0};
    int r;
    if (!(f->t = vgi_array(n, sizeof *f->t, e)) || !(f->order = vgi_array(n, sizeof *f->order, e)) ||
        !(f->sorted = vgi_array(n, sizeof *f->sorted, e)) ||
        !(f->report->frame_error = vgi_array(n, sizeof(double), e)))
        return VG_ENOMEM;
    vgi_parameters(n, s->position, f->t);
    if ((r = vgi_curve_order(n, s->position, f->t, f->order, e)) < 0) return r;
    if (f->o->k) knots = f->o->k < 4 ? 2 : f->o->k < n + 2 ? f->o->k - 2 : n;
    else if ((r = smallest(f, 2, n, f->tolerance, error_of_time, &knots, e)) < 0) return r;
    error.of_frame = f->report->frame_error;
    if ((r = error_of_time(f, knots, &error, e)) < 0) return r;
    for (size_t i = 0; i < n; i++) f->report->frame_error[i] /= f->d;
    s->error_time = error.most / f->d;
    s->error_rms = error.rms / f->d;
    s->parameter = f->t, f->t = NULL;
    return vgi_signal_set_curve(s, &f->curve, e);
}

static void keep_examples(fitting *f)
{
    vg_signal *s = f->s;
    s->examples = true;
    s->mean = f->span.home, f->span.home = NULL;
    s->basis = f->span.difference, f->span.difference = NULL;
    vgi_span_coordinates(&f->span, f->n, s->coordinate);
}

static int keep_shapes(fitting *f, vg_err *e)
{
    vg_signal *s = f->s;
    s->bits = 64;
    if (f->o->nexamples) keep_examples(f);
    else {
        s->mean = f->basis.mean, f->basis.mean = NULL;
        s->basis = f->basis.vectors, f->basis.vectors = NULL;
    }
    double *less = realloc(s->basis, s->m * s->d * sizeof *less + 1);
    if (less) s->basis = less;
    return f->o->bits && f->o->bits != 64 ? vg_signal_store(s, f->o->bits, e) : VG_OK;
}

static int check_options(const vg_body *body, size_t n, const vg_signal_options *o, vg_err *e)
{
    if (n < 2) return vg_fail(e, VG_EINPUT, "a signal needs at least 2 frames, but there %s %zu", n == 1 ? "is" : "are", n);
    if (n > VG_SIGNAL_FRAMES)
        return vg_fail(e, VG_EINPUT, "%zu frames are more than a signal shows at once (%d): take fewer with vg-encode "
                       "--take, or pieces of the sequence one by one", n, VG_SIGNAL_FRAMES);
    if (!body->mesh.nv) return vg_fail(e, VG_EINPUT, "the mesh has no vertices");
    if (o->space > VG_SPACE_VERTICES && (!o->graph || o->nexamples || o->space > VG_SPACE_LENGTHS))
        return vg_fail(e, VG_EARG, "a space other than vertices needs a graph and excludes examples");
    if (o->nexamples == 1) return vg_fail(e, VG_EINPUT, "one example is not enough: there must be at least 2");
    for (size_t i = 0; i < o->npins; i++)
        if (o->pins[i].frame >= n)
            return vg_fail(e, VG_EARG, "there is no frame %zu to be pinned: there are %zu", o->pins[i].frame + 1, n);
    return VG_OK;
}

/* Examples without rigid motion of the body. *examples is NULL if there are none. */
static int take_examples(fitting *f, const vg_body *body, double **examples, vg_err *e)
{
    size_t n = f->o->nexamples, nv = body->mesh.nv;
    *examples = NULL;
    if (!n) return VG_OK;
    double *shift = vgi_array(n, 3 * sizeof *shift, e);
    *examples = vgi_copy_array(f->o->examples, n * nv, 3 * sizeof **examples, e);
    int r = shift && *examples ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && f->o->root) {
        f->s->nturns = n;
        if (!(f->s->home_turn = vgi_array(n, 4 * sizeof(double), e))) r = VG_ENOMEM;
        else vgi_root_remove(n, nv, body->reference, *examples, f->s->home_turn, shift);
    }
    free(shift);
    return r;
}

/* The basis of the poses; takes ownership of them. */
static int fit_basis(fitting *f, const vg_body *body, double *poses, vg_err *e)
{
    double *examples = NULL;
    int r = VG_OK;
    if (!of_vertices(f)) r = vgi_unshape_make(&f->unshape, f->s->space, f->o->graph, body->reference, f->o->threads, e);
    if (r == VG_OK) r = fit_root(f, body, poses, e);
    if (r == VG_OK) r = take_examples(f, body, &examples, e);
    if (r < 0) free(poses);
    else if (!of_vertices(f)) r = fit_space(f, body, poses, e);
    else if (examples)
        r = vgi_span_make(&f->span, &f->basis, poses, f->n, f->s->d, examples, f->o->nexamples, f->o->threads, e);
    else r = vgi_basis_make(&f->basis, poses, f->n, f->s->d, f->o->threads, e);
    free(examples);
    return r;
}

int vg_signal_fit(vg_signal *s, const vg_body *body, double *poses, size_t n, const vg_signal_options *o,
                  vg_signal_stats *report, vg_err *e)
{
    fitting f = {.s = s, .o = o, .report = report, .n = n};
    int r = check_options(body, n, o, e);
    *report = (vg_signal_stats){0};
    *s = (vg_signal){.space = o->space ? o->space : VG_SPACE_VERTICES, .d = 3 * body->mesh.nv};
    f.limit = INFINITY;
    if (r < 0) {
        free(poses);
        return r;
    }
    report->diagonal = f.d = vg_diagonal(body->reference, body->mesh.nv);
    if (!(f.d > 0)) f.d = 1;
    f.tolerance = o->tolerance * f.d;
    vgi_blas_alone();
    r = fit_basis(&f, body, poses, e);
    report->rank = f.basis.rank;
    if (r < 0 || (r = fit_shape(&f, e)) < 0 || (r = place_frames(&f, e)) < 0 || (r = fit_pose(&f, e)) < 0 ||
        (r = fit_time(&f, e)) < 0 ||
        (r = vgi_curve_crossings(&f.curve, CROSSING_PARTS, &report->crossing, &report->ncrossings, e)) < 0 || (r = keep_shapes(&f, e)) < 0)
        goto out;
    s->n = n;
out:
    vgi_blas_shared();
    vgi_basis_clear(&f.basis);
    vgi_span_clear(&f.span);
    vgi_unshape_clear(&f.unshape);
    free(f.other);
    vgi_plate_clear(&f.plate);
    vgi_curve_clear(&f.curve);
    free(f.room);
    free(f.fitted);
    free(f.coefficients);
    free(f.functions);
    free(f.t);
    free(f.order);
    free(f.sorted);
    if (r < 0) {
        s->n = n;
        vg_signal_clear(s);
        vg_signal_stats_clear(report);
    }
    return r;
}
