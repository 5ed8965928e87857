/* fuzz_network.c: networks and checkpoints at work: whatever a stream's header lets through generates poses, and resumes a
 * training that it fits. Checksums are mended first. Leaves out the reading itself (fuzz_stream.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "mend.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_BYTES = 1 << 16, MOST_VERTICES = 64, MOST_HIDDEN = 16, MOST_STEP = 64, POSES = 30, AHEAD = 3, STEPS = 2 };

static void demand_code(int r, const vg_err *e)
{
    demand(r >= 0 || ((r == VG_EINPUT || r == VG_EARG || r == VG_ENOMEM) && r == e->code && e->message[0]));
}

/* ---- generating ---- */

static void generate(const vg_head *h, const vg_generate_options *o)
{
    vg_err e = {0};
    vg_generator *g;
    vg_way way;
    size_t n = 3 * h->body.mesh.nv;
    double *out = calloc(n, AHEAD * sizeof *out), *poses[AHEAD];
    demand(out != NULL);
    for (size_t i = 0; i < AHEAD; i++) poses[i] = out + i * n;
    int r = vg_generator_new(&g, &h->network, &h->body.mesh, h->body.reference, o, &e);
    demand_code(r, &e);
    for (int i = 0; r >= 0 && i < 2; i++) r = vg_generator_give(g, h->body.reference, &e);
    for (int i = 0; r >= 0 && i < AHEAD; i++) r = vg_generator_next(g, out, &e);
    if (r >= 0) {
        (void)vg_generator_change(g);
        (void)vg_generator_drift(g);
        r = vg_generator_between(g, h->body.reference, false, AHEAD, poses, &way, &e);
    }
    if (r >= 0) r = vg_generator_between(g, h->body.reference, true, AHEAD, poses, NULL, &e);
    demand_code(r, &e);
    vg_generator_free(&g);
    free(out);
}

/* ---- resuming ---- */

static vg_train_options options_of(const vg_network *n)
{
    vg_train_options o = vg_train_defaults(n->model);
    o.direction = n->direction, o.layers = n->layers, o.hidden = n->hidden, o.convolutions = n->convolutions;
    o.divergence = n->uncertain, o.nine = n->width == 9, o.seed = n->seed, o.step = n->step;
    o.batch = 3, o.frames = 5, o.given_least = o.given_most = 1, o.iterations = 40, o.hold = 0;
    return o;
}

/* Poses that turn and swell, so that there is something to learn. */
static void add_poses(vg_trainer *t, const vg_head *h)
{
    vg_err e;
    size_t n = h->body.mesh.nv;
    double *pose = calloc(3 * n, sizeof *pose);
    demand(pose != NULL);
    for (int i = 0; i < POSES; i++) {
        const double *at = pose;
        for (size_t k = 0; k < 3 * n; k++) pose[k] = h->body.reference[k] * (1 + 0.01 * ((i * (int)(k % 5 + 1)) % 7));
        int r = vg_trainer_add(t, 1, &at, &e);
        demand_code(r, &e);
    }
    free(pose);
}

/* A checkpoint of the same poses and mesh: the digests are made those of the trainer. */
static void resume(const vg_head *h)
{
    vg_err e = {0};
    vg_network own = {0}, from = h->network;
    vg_trainer *t;
    vg_train_state state;
    vg_train_options o = options_of(&from);
    int r = vg_trainer_new(&t, &h->body.mesh, h->body.reference, &o, &e);
    demand_code(r, &e);
    if (r < 0) return;
    add_poses(t, h);
    r = vg_trainer_prepare(t, &e);
    if (r >= 0) r = vg_trainer_network(t, false, &own, &e);
    if (r >= 0) {
        from.mesh_digest = own.mesh_digest, from.data_digest = own.data_digest, from.frames = own.frames;
        r = vg_trainer_resume(t, &from, &e);
    }
    for (int i = 0; r >= 0 && i < STEPS; i++) r = vg_trainer_step(t, &state, &e);
    demand_code(r, &e);
    vg_network_clear(&own);
    vg_trainer_free(&t);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const vg_generate_options options[] = {{.threads = 1}, {.threads = 1, .optimise = true, .stay = true},
                                                  {.threads = 1, .merge = 0.05, .diversity = 0.2}};
    vg_err e = {0};
    vg_reader *r = NULL;
    unsigned char *copy = size <= MOST_BYTES ? malloc(size ? size : 1) : NULL;
    if (!copy) return 0;
    if (size) memcpy(copy, data, size);
    mend(copy, size);
    if (vg_reader_open_memory(&r, copy, size, "fuzz", &e) == VG_OK) {
        const vg_head *h = vg_reader_head(r);
        bool small = h->network.model && h->body.reference && h->body.mesh.nv <= MOST_VERTICES && h->network.hidden <= MOST_HIDDEN && h->network.step <= MOST_STEP;
        for (size_t i = 0; small && i < sizeof options / sizeof *options; i++) generate(h, &options[i]);
        if (small && h->network.open) resume(h);
    }
    vg_reader_close(&r);
    free(copy);
    return 0;
}
