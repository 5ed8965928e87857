/* solve: reconstruction in memory, beside CHOLMOD's own solve of the same systems on one thread.
 * usage: OPENBLAS_NUM_THREADS=1 solve VECTORS.vgs
 * Prints, in poses/s: LOAD SOLVE-1-THREAD SOLVE-2-THREADS REFERENCE-SIMPLICIAL REFERENCE-SUPERNODAL, then the largest
 * distance between a vertex of ours and of theirs, in D. Both references are METIS-ordered and take the three
 * right-hand sides of a pose in one cholmod_solve2 that reuses its workspace.
 * Leaves out set-up, files and streams: run.sh.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include <cholmod.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { POSES = 16 };                /* two blocks of eight: one for each thread */
/* The shortest call counts, looked for in turns, so that what disturbs one of those compared disturbs them all. */
enum { ROUNDS = 5 };
static const double turn = 0.16; /* seconds */

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void die(const char *what)
{
    fprintf(stderr, "solve: %s\n", what);
    exit(4);
}

static void check(int r, const vg_err *e)
{
    if (r < 0) die(e->message);
}

static double *numbers(size_t n)
{
    double *x = calloc(n + 1, sizeof *x);
    if (!x) die("not enough memory");
    return x;
}

typedef struct problem {
    vg_graph *g;
    const double *reference;
    double *w[POSES], *x[POSES], *rhs[POSES], root[POSES][3];
} problem;

/* The first poses of the stream, again from the start when there are fewer. */
static void read_poses(problem *p, vg_source *s, const vg_head *h)
{
    vg_err e;
    vg_frame f = {0};
    size_t n = 0, corners = vg_graph_corners(p->g);
    for (int r; n < POSES && (r = vg_source_next(s, &f, &e)) != 0; n++) {
        check(r, &e);
        p->w[n] = numbers(3 * corners);
        memcpy(p->w[n], f.values, 3 * corners * sizeof(double));
        memcpy(p->root[n], f.root, sizeof f.root);
    }
    if (!n) die("there is no pose in the stream");
    for (size_t i = n; i < POSES; i++) {
        p->w[i] = p->w[i - n];
        memcpy(p->root[i], p->root[i - n], sizeof p->root[i]);
    }
    for (size_t i = 0; i < POSES; i++)
        p->x[i] = numbers(3 * h->body.mesh.nv), p->rhs[i] = numbers(3 * h->body.mesh.nv);
    vg_frame_clear(&f);
}

/* One thing that is measured. */
typedef struct entry {
    void (*call)(void *);
    void *context;
    size_t poses;   /* of one call */
    double seconds; /* of the shortest call so far */
} entry;

static void take_turn(entry *x)
{
    double start = now(), last;
    x->call(x->context); /* warms up the caches that the others have filled */
    do {
        double before = now();
        x->call(x->context);
        last = now();
        if (last - before < x->seconds) x->seconds = last - before;
    } while (last - start < turn);
}

static double rate(const entry *x)
{
    return (double)x->poses / x->seconds;
}

/* ---- ours ---- */

typedef struct ours {
    problem *p;
    vg_solver *solver;
} ours;

static void load_poses(void *context)
{
    ours *o = context;
    vg_solver_load(o->solver, POSES, (const double *const *)o->p->w, NULL, o->p->x, o->p->rhs);
}

static void solve_poses(void *context)
{
    ours *o = context;
    problem *p = o->p;
    const double *roots[POSES];
    for (size_t i = 0; i < POSES; i++) roots[i] = p->root[i];
    vg_solver_solve(o->solver, POSES, (const double *const *)p->rhs, p->x, NULL, roots);
}

/* ---- the reference ---- */

typedef struct theirs {
    cholmod_common common;
    cholmod_sparse *matrix;
    cholmod_factor *factor;
    cholmod_dense *b, *x, *work[2];
} theirs;

/* The sum over faces of I - 11'/r, lower triangle; vertices in no face and the first attached one have a row of I. */
static void assemble(theirs *t, const vg_graph *g, size_t pinned)
{
    size_t most = g->faces.nv;
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t r = g->faces.start[f + 1] - g->faces.start[f];
        most += r * (r + 1) / 2;
    }
    cholmod_triplet *a = cholmod_allocate_triplet(g->faces.nv, g->faces.nv, most, -1, CHOLMOD_REAL, &t->common);
    if (!a) die("not enough memory for the matrix");
    int *i = a->i, *j = a->j;
    double *x = a->x;
    for (size_t v = 0; v < g->faces.nv; v++)
        if (v == pinned || !g->in_face[v]) i[a->nnz] = j[a->nnz] = (int)v, x[a->nnz++] = 1;
    for (size_t f = 0; f < g->faces.nf; f++)
        for (size_t p = g->faces.start[f]; p < g->faces.start[f + 1]; p++)
            for (size_t q = g->faces.start[f]; q <= p; q++) {
                size_t u = g->faces.vert[p], v = g->faces.vert[q];
                if (u == pinned || v == pinned) continue;
                i[a->nnz] = (int)(u > v ? u : v), j[a->nnz] = (int)(u > v ? v : u);
                x[a->nnz++] = (p == q) - 1.0 / (g->faces.start[f + 1] - g->faces.start[f]);
            }
    t->matrix = cholmod_triplet_to_sparse(a, 0, &t->common);
    cholmod_free_triplet(&a, &t->common);
    if (!t->matrix) die("not enough memory for the matrix");
}

/* Right-hand sides of one pose: per vertex the sum of its vectors, each less its face's mean. */
static void fill(theirs *t, const vg_graph *g, size_t pinned, const double *w)
{
    double *b = t->b->x;
    memset(b, 0, 3 * g->faces.nv * sizeof *b);
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t begin = g->faces.start[f], end = g->faces.start[f + 1];
        for (size_t k = 0; k < 3; k++) {
            double mean = 0;
            for (size_t c = begin; c < end; c++) mean += w[3 * c + k] / (double)(end - begin);
            for (size_t c = begin; c < end; c++)
                if (g->faces.vert[c] != pinned) b[k * g->faces.nv + g->faces.vert[c]] += w[3 * c + k] - mean;
        }
    }
}

static void solve_theirs(void *context)
{
    theirs *t = context;
    if (!cholmod_solve2(CHOLMOD_A, t->factor, t->b, NULL, &t->x, NULL, &t->work[0], &t->work[1], &t->common))
        die("cholmod_solve2 failed");
}

/* Largest distance of the two solutions of one pose, both moved to the root. */
static double distance(const theirs *t, const vg_graph *g, const double *pose, const double root[3])
{
    const double *x = t->x->x;
    double *v = numbers(3 * g->faces.nv), mean[3], worst = 0;
    for (size_t i = 0; i < g->faces.nv; i++)
        for (size_t k = 0; k < 3; k++) v[3 * i + k] = x[k * g->faces.nv + i];
    vg_graph_root(g, v, mean);
    for (size_t i = 0; i < g->faces.nv; i++) {
        double sum = 0;
        for (size_t k = 0; k < 3; k++) {
            double d = v[3 * i + k] - mean[k] + root[k] - pose[3 * i + k];
            sum += d * d;
        }
        if (g->in_face[i] && !(sum <= worst)) worst = sum;
    }
    free(v);
    return sqrt(worst);
}

static void make_theirs(theirs *t, const vg_graph *g, size_t pinned, int kind)
{
    cholmod_start(&t->common);
    t->common.nmethods = 1;
    t->common.method[0].ordering = CHOLMOD_METIS;
    t->common.supernodal = kind;
    assemble(t, g, pinned);
    t->factor = cholmod_analyze(t->matrix, &t->common);
    t->b = cholmod_zeros(g->faces.nv, 3, CHOLMOD_REAL, &t->common);
    if (!t->factor || !t->b || !cholmod_factorize(t->matrix, t->factor, &t->common) ||
        t->factor->minor < t->factor->n)
        die("the reference cannot factorize");
}

static void clear_theirs(theirs *t)
{
    cholmod_free_dense(&t->b, &t->common);
    cholmod_free_dense(&t->x, &t->common);
    cholmod_free_dense(&t->work[0], &t->common);
    cholmod_free_dense(&t->work[1], &t->common);
    cholmod_free_factor(&t->factor, &t->common);
    cholmod_free_sparse(&t->matrix, &t->common);
    cholmod_finish(&t->common);
}

static void compare(problem *p, double diagonal)
{
    enum { LOAD, ONE, TWO, SIMPLICIAL, SUPERNODAL, ENTRIES };
    static const int kinds[2] = {CHOLMOD_SIMPLICIAL, CHOLMOD_SUPERNODAL};
    vg_err e;
    ours o[2] = {{.p = p}, {.p = p}};
    theirs t[2] = {{.matrix = NULL}, {.matrix = NULL}};
    size_t pinned = 0;
    while (pinned < p->g->faces.nv && !p->g->in_face[pinned]) pinned++;
    for (int i = 0; i < 2; i++) {
        check(vg_solver_new(&o[i].solver, p->g, NULL, 0, p->reference, VG_WEIGHTS_UNIFORM, i + 1, &e), &e);
        make_theirs(&t[i], p->g, pinned, kinds[i]);
        fill(&t[i], p->g, pinned, p->w[0]);
    }
    entry all[ENTRIES] = {[LOAD] = {load_poses, &o[0], POSES, INFINITY},
                          [ONE] = {solve_poses, &o[0], POSES, INFINITY},
                          [TWO] = {solve_poses, &o[1], POSES, INFINITY},
                          [SIMPLICIAL] = {solve_theirs, &t[0], 1, INFINITY},
                          [SUPERNODAL] = {solve_theirs, &t[1], 1, INFINITY}};
    for (int round = 0; round < ROUNDS; round++)
        for (int i = 0; i < ENTRIES; i++) take_turn(&all[i]);

    double apart = 0;
    load_poses(&o[1]); /* what is compared is solved once: a solve adds to its guess */
    solve_poses(&o[1]);
    for (int i = 0; i < 2; i++) {
        double d = distance(&t[i], p->g, p->x[0], p->root[0]);
        if (!(d <= apart)) apart = d;
    }
    for (int i = 0; i < ENTRIES; i++) printf("%.1f ", rate(&all[i]));
    printf("%.1e\n", apart / diagonal);
    for (int i = 0; i < 2; i++) vg_solver_free(&o[i].solver), clear_theirs(&t[i]);
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: OPENBLAS_NUM_THREADS=1 solve VECTORS.vgs\n");
        return 2;
    }
    vg_err e;
    vg_source *s;
    check(vg_isa_choose(getenv("VG_ISA"), &e), &e);
    check(vg_source_open(&s, (const char *const *)(argv + 1), 1, &e), &e);
    const vg_head *h = vg_source_head(s);
    if (h->kind != VG_VECTORS || h->nanchors) die("the stream must hold vectors without anchors");
    problem p = {.reference = h->body.reference};
    check(vg_head_graph(&p.g, h, &e), &e);
    read_poses(&p, s, h);
    compare(&p, vg_diagonal(h->body.reference, h->body.mesh.nv));
    for (size_t i = 0; i < POSES; i++) {
        free(p.x[i]);
        free(p.rhs[i]);
        for (size_t k = i + 1; k < POSES; k++)
            if (p.w[k] == p.w[i]) p.w[k] = NULL;
        free(p.w[i]);
    }
    vg_graph_free(&p.g);
    vg_source_close(&s);
    return 0;
}
