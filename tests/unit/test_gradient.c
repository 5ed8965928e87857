/* test_gradient.c: gradients of every kind of network against central differences, in binary64: the files of the
 * library are compiled once more with that type.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#define VGI_NET_DOUBLE
#include "net/layer_kernel.c"
#include "net/product_kernel.c"
#include "net/chain.c"
#include "net/loss.c"

#include "meshes.h"

enum { RING = 7, FRAMES = 9, STEPS = 6 };

/* A ring of vertices, each beside two others. */
static uint32_t first_of[RING + 1], to_of[2 * RING];

typedef struct trial {
    const char *name;
    vgi_front front;
    size_t channels, convolutions;
    bool uncertain, skeleton;
    vg_direction direction;
    size_t given, sequences;
    double bidirectional, divergence;
    size_t apart; /* of the states that are kept; 0: all are */
} trial;

typedef struct rig {
    vgi_shape shape;
    net_group group;
    net_drive drive[2];
    net_skeleton skeleton[2];
    real *parameters[2], *gradient[2], *frames, *matrices, *in, *out;
} rig;

static real *numbers(size_t n, double size)
{
    real *p = room(n, sizeof *p);
    for (size_t i = 0; i < n; i++) p[i] = size * noise();
    return p;
}

static void start(rig *r, const trial *x)
{
    vg_err e = {0, ""};
    for (uint32_t i = 0; i <= RING; i++) first_of[i] = 2 * i;
    for (uint32_t i = 0; i < RING; i++) to_of[2 * i] = (i + RING - 1) % RING, to_of[2 * i + 1] = (i + 1) % RING;
    r->shape = (vgi_shape){.front = x->front, .vertices = RING, .channels = x->channels, .hidden = 6, .layers = 3,
                           .convolutions = x->convolutions, .uncertain = x->uncertain, .first = first_of, .to = to_of};
    CHECK(vgi_shape_plan(&r->shape, &e) == VG_OK);
    CHECK(net_group_make(&r->group, &r->shape, x->direction, STEPS, x->apart, &e) == VG_OK);
    size_t n = r->shape.numbers;
    r->frames = numbers(FRAMES * n, 0.4), r->matrices = numbers(8 * n * n + 2 * n, 0.1);
    r->in = numbers(n, 1), r->out = numbers(n, 1);
    for (int w = 0; w < 2; w++) {
        r->parameters[w] = numbers(r->shape.total, 0.4), r->gradient[w] = numbers(r->shape.total, 0);
        real *m = r->matrices + (size_t)w * (4 * n * n + n);
        for (size_t i = 0; i < n * n; i++) m[2 * n * n + i] = m[i] + m[n * n + i];
        r->skeleton[w] = (net_skeleton){.turn = m, .change = m + n * n, .sum = m + 2 * n * n, .shift = m + 3 * n * n};
        r->drive[w] = (net_drive){.shape = &r->shape, .parameters = r->parameters[w], .scale_in = r->in,
                                  .scale_out = r->out, .given = x->given,
                                  .skeleton = x->skeleton ? r->skeleton : NULL};
    }
    r->group.frames = r->frames, r->group.n = x->sequences, r->group.batch = x->sequences;
    r->group.bidirectional = x->bidirectional, r->group.divergence = x->divergence;
    for (size_t i = 0; i < x->sequences; i++) r->group.start[i] = i % (FRAMES - STEPS + 1);
}

static void end(rig *r)
{
    net_group_clear(&r->group);
    for (int w = 0; w < 2; w++) free(r->parameters[w]), free(r->gradient[w]);
    free(r->frames), free(r->matrices), free(r->in), free(r->out);
}

/* The gradient as the parameters are laid out. */
static void find_gradient(rig *r, real *const gradient[2])
{
    const vgi_shape *s = &r->shape;
    size_t left_out = r->group.chains[0].late ? s->numbers * s->latent : 0, behind = s->total - s->variance - left_out;
    net_group_run(&r->group, r->drive, gradient, 0.1, 5);
    if (!left_out) return;
    memmove(gradient[0] + s->variance + left_out, gradient[0] + s->variance, behind * sizeof **gradient);
    memset(gradient[0] + s->variance, 0, left_out * sizeof **gradient);
    net_group_variance(&r->group, r->drive, gradient[0] + s->variance);
}

static double loss_at(rig *r, real *const gradient[2])
{
    return net_group_run(&r->group, r->drive, gradient, 0.1, 5).total;
}

static void check_gradient(const trial *x)
{
    rig r = {0};
    start(&r, x);
    find_gradient(&r, r.gradient);
    real *ignored[2] = {numbers(r.shape.total, 0), numbers(r.shape.total, 0)};
    for (int w = 0; w < (x->direction == VG_SEPARATE ? 2 : 1); w++) {
        double worst = 0, largest = 0;
        for (size_t p = 0; p < r.shape.nparameters; p++) {
            const vgi_parameter *q = &r.shape.parameter[p];
            for (size_t k = 0; k < 12; k++) {
                size_t i = q->at + (k * 7919) % (q->rows * q->columns);
                const double step = 1e-5;
                double was = r.parameters[w][i];
                r.parameters[w][i] = was + step;
                double above = loss_at(&r, ignored);
                r.parameters[w][i] = was - step;
                double below = loss_at(&r, ignored), slope = (above - below) / (2 * step);
                r.parameters[w][i] = was;
                worst = fmax(worst, fabs(slope - r.gradient[w][i])), largest = fmax(largest, fabs(slope));
            }
        }
        if (!(worst <= 1e-6 * largest)) printf("%s: ", x->name);
        CHECK_NEAR(worst / largest, 0, 1e-6); /* differences of a step of 1e-5 are good to about 1e-9 */
        CHECK(largest > 1e-3);
    }
    free(ignored[0]), free(ignored[1]);
    end(&r);
}

static void gradients(void)
{
    static const trial trials[] = {
        {"coordinates", VGI_FRONT_LINEAR, 1, 0, false, false, VG_SHARED, 2, 3, 0.5, 0, 0},
        {"coordinates, regression", VGI_FRONT_LINEAR, 1, 0, false, true, VG_SHARED, 2, 4, 0.5, 0, 0},
        {"coordinates, regression, one given", VGI_FRONT_LINEAR, 1, 0, false, true, VG_SHARED, 1, 4, 0.5, 0, 0},
        {"coordinates, all given", VGI_FRONT_LINEAR, 1, 0, false, true, VG_SHARED, STEPS, 4, 0.5, 0, 0},
        {"coordinates, forward", VGI_FRONT_LINEAR, 1, 0, false, true, VG_FORWARD, 3, 5, 0, 0, 0},
        {"coordinates, separate", VGI_FRONT_LINEAR, 1, 0, false, true, VG_SEPARATE, 1, 5, 0.5, 0, 0},
        {"full layer", VGI_FRONT_MESH, 9, 0, false, false, VG_SHARED, 1, 4, 0.5, 0, 0},
        {"full layer, uncertain", VGI_FRONT_MESH, 9, 0, true, false, VG_SHARED, 2, 4, 0.5, 0.1, 0},
        {"convolutions", VGI_FRONT_MESH, 9, 3, false, false, VG_SHARED, 1, 4, 0.5, 0, 0},
        {"convolutions of 12", VGI_FRONT_MESH, 12, 3, false, false, VG_SHARED, 3, 2, 0.5, 0, 0},
        {"convolutions of 5", VGI_FRONT_MESH, 5, 2, false, false, VG_SHARED, 1, 4, 0, 0, 0},
        {"convolutions, uncertain", VGI_FRONT_MESH, 9, 3, true, false, VG_SHARED, 1, 3, 0.5, 0.1, 0},
        {"convolutions, separate, uncertain", VGI_FRONT_MESH, 9, 3, true, false, VG_SEPARATE, 2, 8, 0.5, 0.1, 0},
        {"convolutions, forward", VGI_FRONT_MESH, 9, 1, true, false, VG_FORWARD, 1, 8, 0, 0.1, 0},
        {"convolutions, half of the states", VGI_FRONT_MESH, 9, 3, false, false, VG_SHARED, 1, 4, 0.5, 0, 2},
        {"convolutions, uncertain, a third of the states", VGI_FRONT_MESH, 9, 3, true, false, VG_SHARED, 2, 3, 0.5, 0.1, 3},
        {"full layer, uncertain, the first state", VGI_FRONT_MESH, 9, 0, true, false, VG_SHARED, 1, 4, 0.5, 0.1, STEPS},
        {"convolutions, forward, half of the states", VGI_FRONT_MESH, 9, 1, true, false, VG_FORWARD, 1, 8, 0, 0.1, 2}};
    for (size_t i = 0; i < sizeof trials / sizeof *trials; i++) check_gradient(&trials[i]);
}

/* States that are computed again are the same to the last bit, and so is all that is made of them, but for the
 * gradient of the variance, whose steps are added in another order. */
static void states_again(void)
{
    trial x = {"", VGI_FRONT_MESH, 9, 3, true, false, VG_SHARED, 2, 4, 0.5, 0.1, 1};
    for (size_t apart = 2; apart <= STEPS; apart++) {
        rig all = {0}, some = {0};
        x.apart = 1;
        start(&all, &x);
        x.apart = apart;
        start(&some, &x);
        const vgi_shape *s = &all.shape;
        size_t matrix = s->numbers * s->latent;
        memcpy(some.frames, all.frames, FRAMES * s->numbers * sizeof *all.frames);
        memcpy(some.parameters[0], all.parameters[0], s->total * sizeof *all.gradient[0]);
        find_gradient(&all, all.gradient);
        find_gradient(&some, some.gradient);
        CHECK(!all.group.chains[0].late && some.group.chains[0].late);
        for (size_t i = 0; i < s->total; i++)
            if (i < s->variance || i >= s->variance + matrix) CHECK(all.gradient[0][i] == some.gradient[0][i]);
            else CHECK_NEAR(all.gradient[0][i], some.gradient[0][i], 1e-13);
        end(&all);
        end(&some);
    }
}

/* ---- initial states ---- */

typedef struct aim {
    const net_chains *c;
    const net_lanes *target;
} aim;

static void towards(void *context, size_t t, net_lanes *g)
{
    const aim *a = context;
    size_t n = a->c->shape->numbers;
    if (t + 1 < a->c->steps) return;
    for (size_t k = 0; k < n; k++) g[k] += 2 * (a->c->state[t * n + k] - a->target[k]);
}

static void first_frame(const void *context, size_t t, net_lanes *frame)
{
    const net_lanes *given = context;
    (void)t;
    memcpy(frame, given, RING * 9 * sizeof *given);
}

static double miss(net_chains *c, const net_drive *d, const net_lanes *begin_at, const aim *a)
{
    double sum = 0;
    size_t n = c->shape->numbers;
    net_chains_begin(c, begin_at);
    net_chains_forward(c, d);
    for (size_t k = 0; k < n; k++)
        for (int i = 0; i < NET_LANES; i++) {
            double far = c->state[(c->steps - 1) * n + k][i] - a->target[k][i];
            sum += far * far;
        }
    return sum;
}

static void initial_states(void)
{
    vg_err e;
    trial x = {"", VGI_FRONT_MESH, 9, 2, false, false, VG_SHARED, 1, 4, 0.5, 0, 0};
    rig r = {0};
    start(&r, &x);
    size_t n = r.shape.numbers, rows = 2 * r.shape.layers * r.shape.hidden;
    net_lanes *states = net_array(3 * rows + 2 * n, &e), *slope = states + rows, *given = slope + rows;
    for (size_t i = 0; i < 2 * rows + 2 * n; i++)
        for (int k = 0; k < NET_LANES; k++) states[i][k] = 0.5 * noise();
    aim a = {&r.group.chains[0], given + n};
    net_drive d = r.drive[0];
    net_lanes shares = {0};
    d.truth = first_frame, d.context = given, d.forward = NET_LANES;
    miss(&r.group.chains[0], &d, states, &a);
    net_chains_backward(&r.group.chains[0], &d, towards, &a, 0, &shares, r.gradient[0], slope);
    double worst = 0, largest = 0;
    for (size_t i = 0; i < rows; i++) {
        int k = (int)(i % NET_LANES);
        double was = states[i][k], step = 1e-5;
        states[i][k] = was + step;
        double above = miss(&r.group.chains[0], &d, states, &a);
        states[i][k] = was - step;
        double below = miss(&r.group.chains[0], &d, states, &a);
        states[i][k] = was;
        worst = fmax(worst, fabs((above - below) / (2 * step) - slope[i][k])), largest = fmax(largest, fabs(slope[i][k]));
    }
    CHECK_NEAR(worst / largest, 0, 1e-6);
    CHECK(largest > 1e-4);
    free(states);
    end(&r);
}

/* Over a palindrome, chains that begin alike run alike. */
static void palindrome(void)
{
    trial x = {"", VGI_FRONT_MESH, 9, 3, false, false, VG_SHARED, 1, 1, 0.5, 0, 0};
    rig r = {0};
    start(&r, &x);
    size_t n = r.shape.numbers;
    for (size_t t = 0; t < STEPS / 2; t++)
        memcpy(r.frames + (STEPS - 1 - t) * n, r.frames + t * n, n * sizeof *r.frames);
    r.group.start[0] = 0;
    net_group_run(&r.group, r.drive, r.gradient, 0, 1);
    for (size_t k = 0; k < STEPS * n; k++)
        CHECK(r.group.chains[0].state[k][0] == r.group.chains[0].state[k][NET_LANES / 2]);
    end(&r);
}

TESTS({"gradients", gradients}, {"states computed again", states_again}, {"initial states", initial_states}, {"palindrome", palindrome})
