/* vg-solve: reconstruct vertices from vectors or features, one factorisation for all poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"
#include "solve_features.h"

#include <stdlib.h>
#include <string.h>

static struct {
    size_t weights; /* 1: uniform */
    size_t fit;     /* 1: squares */
    long rounds;
    double eps;
    bool planar;
    double planar_weights[2]; /* of the vectors, and of the planes */
} opts = {.rounds = 100, .eps = 0.5, .planar_weights = {0.5, 1}};

static void take_planar_weights(const char *text, void *context)
{
    (void)context;
    if (cli_parse_numbers(text, opts.planar_weights, 2) != 2 || !(opts.planar_weights[0] > 0) ||
        !(opts.planar_weights[1] >= 0))
        cli_usage("option '--planar-weights' needs a number above 0, a comma, and one of at least 0, not '%s'", text);
}

static const cli_option options[] = {
    {"weights", 0, "area|uniform", "weights: the metric of the reference surface (default), or equal for all corners",
     .choice = &opts.weights},
    {"fit", 0, "absolute|squares", "least sum of the faces' misfits (default), or of their squares, which is faster",
     .choice = &opts.fit},
    {"rounds", 0, "N", "the most rounds of --fit absolute (default: 100)", .integer = &opts.rounds, .least = 1,
     .most = 100000},
    {"eps", 0, "X", "misfits below this fraction of the mean count by their squares (default: 0.5)",
     .number = &opts.eps, .least = 1e-6, .most = 1e6},
    {"planar", 0, NULL, "make faces with four or more corners more planar", .flag = &opts.planar},
    {"planar-weights", 0, "W1,W2", "weights of the vectors and of planarity (default: 0.5,1)",
     .take = take_planar_weights, .needs = "planar"},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-solve",
    .synopsis = "[options] [FILE]",
    .summary = "reconstruct vertices from vectors: one factorisation, many poses per solve",
    .options = options,
    .most_operands = 1,
    .writes_stream = true,
    .threaded = true};

/* A solver and the vertices it holds: the sequence's anchors, or those and the pins of some frames. */
typedef struct machine {
    vg_solver *solver;
    vg_planar *planar; /* with --planar */
    uint32_t *held;    /* ascending */
    size_t nheld;
} machine;

/* A pose that waits for its solve. Its vectors are not kept so long: it costs 6 numbers a vertex, not 3 a corner. */
typedef struct waiting {
    vg_frame frame; /* values: first guess, then vertices */
    const machine *machine;
    const double *vectors; /* until it is loaded: of one of the frames that came in */
    double *rhs, *held, *normals; /* held: where the held vertices go; normals: with --planar */
    size_t held_cap;
    float *misfit; /* with --fit absolute */
    double size;
} waiting;

enum { KEPT = 8, MOST_ENTRIES = 64 << 20 }; /* machines for pins that are kept, and entries of their factors */

typedef struct work {
    vg_head *h;
    vg_graph *g;
    vg_kind kind;            /* what comes in */
    machine plain;
    vg_robust *robust;       /* with --fit absolute */
    machine **pinned;        /* npinned for pins of frames gone by, the latest first: shapes come again */
    size_t npinned;
    waiting *waiting;
    size_t n, most;
    size_t loaded;           /* of the n */
    double **vectors;        /* of the frames of a batch, when they come as vertices */
    size_t most_steps, planar_faces, most_rounds, unfinished;
    double worst_residual;
    vg_weights weights;
} work;

static void keep_stats(work *w, const machine *m)
{
    if (!m->planar) return;
    vg_planar_stats found = vg_planar_get_stats(m->planar);
    if (found.most_steps > w->most_steps) w->most_steps = found.most_steps;
    if (found.worst_residual > w->worst_residual) w->worst_residual = found.worst_residual;
    w->planar_faces = found.faces;
}

static void free_machine(work *w, machine *m)
{
    keep_stats(w, m);
    vg_planar_free(&m->planar);
    vg_solver_free(&m->solver);
    free(m->held);
    *m = (machine){0};
}

/* What a machine needs besides its solver. */
static void equip(machine *m)
{
    vg_err e;
    if (opts.planar && vg_planar_new(&m->planar, m->solver, opts.planar_weights[0], opts.planar_weights[1], &e) < 0)
        cli_die(&e);
    vg_solver_stats stats = vg_solver_get_stats(m->solver);
    cli_note("%zu unknowns, %zu entries in the factor, analysed in %.3f s, factorized in %.3f s", stats.unknowns,
             stats.factor_entries, stats.analyse_seconds, stats.factor_seconds);
}

/* takes `held` over */
static void make_plain(work *w, uint32_t *held, size_t nheld)
{
    vg_err e;
    machine *m = &w->plain;
    *m = (machine){.held = held, .nheld = nheld};
    cli_working("factorising");
    if (vg_solver_new(&m->solver, w->g, held, nheld, w->h->body.reference, w->weights, cli_threads(), &e) < 0 ||
        (opts.fit == 0 && vg_robust_new(&w->robust, m->solver, (size_t)opts.rounds, opts.eps, &e) < 0))
        cli_die(&e);
    equip(m);
}

/* What the poses of a batch need, one element each. */
typedef struct batch {
    size_t n;
    waiting **pose;
    vg_solver **solver;
    const double **vectors, **held, **roots, **normals;
    double **x, **rhs;
    float **misfit;
    double *sizes;
} batch;

static void free_batch(batch *b)
{
    free(b->pose);
    free(b->solver);
    free(b->vectors);
    free(b->held);
    free(b->roots);
    free(b->normals);
    free(b->x);
    free(b->rhs);
    free(b->misfit);
    free(b->sizes);
}

/* Those that wait from `first` on; eight without pins in a row go together. */
static batch make_batch(work *w, size_t first)
{
    size_t most = w->n - first;
    const char *what = "a batch of poses";
    batch b = {.pose = cli_allocate(most, sizeof *b.pose, what),
               .solver = cli_allocate(most, sizeof *b.solver, what),
               .vectors = cli_allocate(most, sizeof *b.vectors, what),
               .held = cli_allocate(most, sizeof *b.held, what),
               .roots = cli_allocate(most, sizeof *b.roots, what),
               .normals = cli_allocate(most, sizeof *b.normals, what),
               .x = cli_allocate(most, sizeof *b.x, what),
               .rhs = cli_allocate(most, sizeof *b.rhs, what),
               .misfit = cli_allocate(most, sizeof *b.misfit, what),
               .sizes = cli_allocate(most, sizeof *b.sizes, what)};
    for (int pins = 0; pins < 2; pins++)
        for (size_t i = first; i < w->n; i++) {
            waiting *p = &w->waiting[i];
            if ((p->machine != &w->plain) != pins) continue;
            b.pose[b.n] = p, b.solver[b.n] = p->machine->solver, b.vectors[b.n] = p->vectors, b.held[b.n] = p->held;
            b.roots[b.n] = p->frame.root, b.normals[b.n] = p->normals, b.x[b.n] = p->frame.values;
            b.rhs[b.n] = p->rhs, b.misfit[b.n] = p->misfit, b.sizes[b.n++] = p->size;
        }
    return b;
}

/* Frames that came in become guesses and right-hand sides, and may be used again. */
static void load_taken(work *w)
{
    batch b = make_batch(w, w->loaded);
    vg_solver_load_each(b.n, b.solver, b.vectors, b.held, b.x, b.rhs);
    if (w->robust) vg_robust_load(w->robust, b.n, b.vectors, (const double *const *)b.x, b.misfit, b.sizes);
    for (size_t i = 0; i < b.n; i++) b.pose[i]->size = b.sizes[i];
    w->loaded = w->n;
    free_batch(&b);
}

static void make_planar(const batch *b)
{
    for (size_t i = 0, n; i < b->n; i += n) {
        const machine *m = b->pose[i]->machine;
        for (n = 1; i + n < b->n && b->pose[i + n]->machine == m;) n++;
        size_t good = vg_planar_solve(m->planar, n, b->normals + i, b->x + i);
        if (good < n)
            cli_no("frame '%s' is not planar yet after %zu steps: choose --planar-weights that are less far apart",
                   b->pose[i + good]->frame.name, vg_planar_get_stats(m->planar).most_steps);
    }
}

/* Those of the solve just done. */
static void keep_rounds(work *w)
{
    if (!w->robust) return;
    vg_robust_stats found = vg_robust_get_stats(w->robust);
    if (found.most_rounds > w->most_rounds) w->most_rounds = found.most_rounds;
    w->unfinished += found.unfinished;
}

static void solve_waiting(work *w)
{
    vg_err e;
    if (!w->n) return;
    load_taken(w);
    batch b = make_batch(w, 0);
    const double *const *rhs = (const double *const *)b.rhs;
    if (!w->robust)
        vg_solver_solve_each(b.n, b.solver, rhs, b.x, b.held, b.roots);
    else if (vg_robust_solve(w->robust, b.n, b.solver, rhs, (const float *const *)b.misfit, b.sizes, b.x, b.held, b.roots,
                             &e) < 0)
        cli_die(&e);
    keep_rounds(w);
    if (opts.planar) make_planar(&b);
    for (size_t i = 0; i < w->n; i++) cli_stream_put(&w->waiting[i].frame);
    w->n = w->loaded = 0;
    free_batch(&b);
}

/* ---- pins ---- */

/* Anchors and pins, ascending, each once. */
static uint32_t *unite_held(const work *w, const vg_frame *f, size_t *n)
{
    const vg_head *h = w->h;
    size_t npins;
    const uint32_t *pins = vg_frame_pins(f, &npins);
    uint32_t *both = cli_allocate(h->nanchors + npins, sizeof *both, "a batch of poses");
    *n = 0;
    for (size_t a = 0, p = 0; a < h->nanchors || p < npins;) {
        bool anchor = p == npins || (a < h->nanchors && h->anchors[a] <= pins[p]);
        uint32_t v = anchor ? h->anchors[a] : pins[p];
        a += a < h->nanchors && h->anchors[a] == v;
        p += p < npins && pins[p] == v;
        both[(*n)++] = v;
    }
    return both;
}

/* Keep `most` machines at most, and not too many entries: drop those that have not been asked for longest. No pose may
 * wait for them. */
static void drop_machines(work *w, size_t most)
{
    size_t entries = 0, kept = 0;
    for (; kept < w->npinned && kept < most; kept++) {
        entries += vg_solver_get_stats(w->pinned[kept]->solver).factor_entries;
        if (entries > MOST_ENTRIES) break;
    }
    while (w->npinned > kept) {
        free_machine(w, w->pinned[--w->npinned]);
        free(w->pinned[w->npinned]);
    }
}

/* Waiting poses have separate solvers; with --planar they are large. */
static bool is_crowded(const work *w)
{
    size_t entries = 0;
    for (size_t i = 0; i < w->npinned; i++) entries += vg_solver_get_stats(w->pinned[i]->solver).factor_entries;
    return entries > MOST_ENTRIES || (opts.planar && w->npinned > KEPT);
}

/* The machine that holds these; a new one has no solver yet. Takes `held` over. */
static machine *find_machine(work *w, uint32_t *held, size_t n)
{
    size_t i = 0;
    while (i < w->npinned && !(w->pinned[i]->nheld == n && !memcmp(w->pinned[i]->held, held, n * sizeof *held))) i++;
    machine *m;
    if (i < w->npinned) {
        m = w->pinned[i];
        free(held);
    } else {
        m = cli_allocate(1, sizeof *m, "a set of pins");
        *m = (machine){.held = held, .nheld = n};
        w->npinned++;
    }
    memmove(w->pinned + 1, w->pinned, i * sizeof *w->pinned);
    return w->pinned[0] = m;
}

/* The machines of n frames; new ones are made side by side. */
static void find_machines(work *w, size_t n, const vg_frame *in, machine **of)
{
    vg_err e;
    vg_solver **solver = cli_allocate(n, sizeof *solver, "a set of pins");
    const uint32_t **held = cli_allocate(n, sizeof *held, "a set of pins");
    size_t *nheld = cli_allocate(n, sizeof *nheld, "a set of pins"), fresh = 0;
    machine **made = cli_allocate(n, sizeof *made, "a set of pins");
    for (size_t i = 0; i < n; i++) {
        size_t count, before = w->npinned;
        vg_frame_pins(&in[i], &count);
        of[i] = &w->plain;
        if (count) {
            uint32_t *both = unite_held(w, &in[i], &count);
            of[i] = find_machine(w, both, count);
        }
        if (w->npinned > before) made[fresh] = of[i], held[fresh] = of[i]->held, nheld[fresh++] = of[i]->nheld;
    }
    if (fresh && vg_solver_new_like(solver, fresh, w->plain.solver, held, nheld, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < fresh; i++) {
        made[i]->solver = solver[i];
        equip(made[i]);
    }
    free(solver);
    free(held);
    free(nheld);
    free(made);
}

/* Where the held vertices go: anchors as the frame says, pins where the reference has them. */
static void place_held(const work *w, const vg_frame *f, waiting *p)
{
    const machine *m = p->machine;
    if (p->held_cap < 3 * m->nheld || !p->held) {
        free(p->held);
        p->held = cli_allocate(3 * m->nheld, sizeof *p->held, "a batch of poses");
        p->held_cap = 3 * m->nheld;
    }
    size_t a = 0;
    const double *anchors = vg_frame_anchors(f);
    for (size_t i = 0; i < m->nheld; i++) {
        bool anchor = a < w->h->nanchors && w->h->anchors[a] == m->held[i];
        const double *at = anchor ? anchors + 3 * a : w->h->body.reference + 3 * (size_t)m->held[i];
        memcpy(p->held + 3 * i, at, 3 * sizeof *at);
        a += anchor;
    }
}

/* Joints of a skeleton come out where they went in, so that their rotations are still right. */
static void keep_turns(const work *w, const vg_frame *in, vg_frame *out)
{
    vg_err e;
    size_t n;
    const double *turns = vg_frame_turns(in, &n);
    if (w->kind == VG_VERTICES && n && vg_frame_turn(out, turns, n, &e) < 0) cli_die(&e);
}

/* Frame i of a batch. Its vectors stay until load_taken. */
static void take_frame(work *w, size_t i, vg_frame *in, const machine *m)
{
    vg_err e;
    const double *vectors = in->values;
    double *anchors;
    if (w->kind == VG_VERTICES) {
        if (vg_frame_make_anchors(in, w->h->nanchors, &anchors, &e) < 0) cli_die(&e);
        vg_graph_vectors(w->g, in->values, w->vectors[i]);
        vg_graph_root(w->g, in->values, in->root);
        vg_graph_anchors(in->values, w->h->anchors, w->h->nanchors, anchors);
        vectors = w->vectors[i];
    }
    waiting *p = &w->waiting[w->n++];
    if (vg_frame_label(&p->frame, in, &e) < 0) cli_die(&e);
    memcpy(p->frame.root, in->root, sizeof in->root);
    keep_turns(w, in, &p->frame);
    p->machine = m;
    place_held(w, in, p);
    p->vectors = vectors;
    if (m->planar) vg_planar_load(m->planar, vectors, p->normals);
}

static void take_batch(void *context, size_t n, vg_frame *in)
{
    work *w = context;
    machine **of = cli_allocate(n, sizeof *of, "a batch of poses");
    if (is_crowded(w)) solve_waiting(w);
    if (!w->n) drop_machines(w, KEPT);
    find_machines(w, n, in, of);
    for (size_t i = 0; i < n; i++) {
        take_frame(w, i, &in[i], of[i]);
        if (w->n == w->most) solve_waiting(w);
    }
    load_taken(w);
    free(of);
}

static void make_waiting(work *w)
{
    vg_err e;
    w->most = vg_solver_batch(w->plain.solver);
    w->waiting = cli_allocate(w->most, sizeof *w->waiting, "a batch of poses");
    w->pinned = cli_allocate(KEPT + w->most + (size_t)cli_threads(), sizeof *w->pinned, "a batch of poses");
    for (size_t i = 0; i < w->most; i++) {
        waiting *p = &w->waiting[i];
        p->rhs = cli_allocate(3 * w->h->body.mesh.nv, sizeof *p->rhs, "a batch of poses");
        p->misfit = cli_allocate(w->robust ? vg_robust_misfits(w->robust) : 0, sizeof *p->misfit,
                                 "a batch of poses");
        p->normals = cli_allocate(w->plain.planar ? 3 * vg_planar_faces(w->plain.planar) : 0, sizeof *p->normals,
                                  "a batch of poses");
        if (vg_frame_shape(&p->frame, w->h, &e) < 0) cli_die(&e);
    }
}

/* Room for the vectors and anchors of the frames of a batch; to be called while the head is still that of the input. */
static void make_room_for_vertices(work *w, vg_frame *in)
{
    vg_err e;
    w->vectors = cli_allocate((size_t)cli_threads(), sizeof *w->vectors, "a batch of poses");
    for (size_t i = 0; i < (size_t)cli_threads() && w->kind == VG_VERTICES; i++) {
        w->vectors[i] = cli_allocate(3 * vg_graph_corners(w->g), sizeof **w->vectors, "a batch of poses");
        if (vg_frame_shape(&in[i], w->h, &e) < 0) cli_die(&e);
    }
}

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    work *w = context;
    vg_err e;
    w->h = h, w->kind = h->kind;
    if (w->kind != VG_VECTORS && w->kind != VG_VERTICES)
        cli_stop(VG_EINPUT, "the input holds %s, vg-solve takes vectors: apply them with 'vg-deform --onto MESH'",
                 vg_head_form(h));
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_head_graph(&w->g, h, &e) < 0) cli_die(&e);
    uint32_t *anchors = cli_allocate(h->nanchors, sizeof *anchors, "a batch of poses");
    if (h->nanchors) memcpy(anchors, h->anchors, h->nanchors * sizeof *anchors);
    make_plain(w, anchors, h->nanchors);
    make_room_for_vertices(w, in);
    h->kind = VG_VERTICES, h->count = h->body.mesh.nv;
    make_waiting(w);
}

static void solve_rest(void *context)
{
    solve_waiting(context);
}

static void clear_work(work *w)
{
    vg_robust_free(&w->robust);
    drop_machines(w, 0);
    free(w->pinned);
    free_machine(w, &w->plain);
    if (opts.fit == 0) cli_note("least absolute misfit: at most %zu rounds", w->most_rounds);
    if (w->unfinished)
        cli_warn("%zu poses have not converged: in the last of %ld rounds the misfit still fell by 0.1 %% or more; "
                 "give more --rounds",
                 w->unfinished, opts.rounds);
    if (opts.planar)
        cli_note("%zu faces of four and more, at most %zu steps to planarity, residual at most %.1e", w->planar_faces,
                 w->most_steps, w->worst_residual);
    for (size_t i = 0; i < w->most; i++) {
        vg_frame_clear(&w->waiting[i].frame);
        free(w->waiting[i].rhs);
        free(w->waiting[i].held);
        free(w->waiting[i].normals);
        free(w->waiting[i].misfit);
    }
    free(w->waiting);
    for (size_t i = 0; i < (size_t)cli_threads(); i++) free(w->vectors[i]);
    free(w->vectors);
    vg_graph_free(&w->g);
}

/* Features leave nothing to choose. */
static void refuse_options(void)
{
    static const char *const of_vectors[] = {"weights", "fit", "rounds", "eps", "planar", "planar-weights"};
    for (size_t i = 0; i < sizeof of_vectors / sizeof *of_vectors; i++)
        if (cli_given(of_vectors[i])) cli_usage("--%s is for vectors, the input holds features", of_vectors[i]);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    work w = {.weights = opts.weights == 0 ? VG_WEIGHTS_AREA : VG_WEIGHTS_UNIFORM};
    vg_source *s = cli_source(operands, n);
    if (vg_source_head(s)->kind == VG_FEATURES) {
        refuse_options();
        features_solve(s);
        vg_source_close(&s);
        cli_finish(0);
    }
    const step solve = {.batch = (size_t)cli_threads(), /* loaded in parallel */
                        .unit = "poses",
                        .init = prepare,
                        .process = take_batch,
                        .finish = solve_rest};
    step_run(&solve, &w, s);
    clear_work(&w);
    vg_source_close(&s);
    cli_finish(0);
}
