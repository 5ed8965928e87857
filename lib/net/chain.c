/* chain.c: one step of a chain: a frame passes through convolutions and a full layer (or scaled coordinates) into
 * recurrent layers, and back out as the change to the next frame; and backpropagation through time.
 *
 * Activations of convolutions are not stored, because they are as large as the mesh; they are recomputed in the
 * backward pass. Of a large mesh, states are recomputed too, from every sixth or so, and the gradient of the variance,
 * as large as that of the full layer, is made in a pass of its own, so that both need not be held at once.
 * Elementwise operations are in layer_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/chain.h"

#include <math.h>
#include <stdlib.h>

/* Gradients of a full layer are summed over as many steps in one product as need this many bytes, and PACK at least. */
enum { PACK = 4, PACK_BYTES = 40 << 20, ROWS_AT_ONCE = 192 };
/* Chains whose states take more than this many bytes keep only some of them. */
enum { STATE_BYTES = 64 << 20 };

#define FLAT(rows) ((real *)(rows))
#define FLAT_IN(rows) ((const real *)(rows))

/* ---- memory ---- */

static size_t most(size_t a, size_t b)
{
    return a > b ? a : b;
}

/* Kept states and those between two of them are fewest if they are as many. */
static size_t choose_apart(const vgi_shape *s, size_t steps)
{
    size_t bytes, apart = 1;
    if (s->front != VGI_FRONT_MESH || !vgi_mul(steps * s->numbers, sizeof(net_lanes), &bytes)) return 1;
    while (bytes > STATE_BYTES && apart * apart < steps) apart++;
    return apart;
}

/* Lay out all arrays in one block; with base NULL only compute its size. */
static size_t lay_out(net_chains *c, net_lanes *base)
{
    const vgi_shape *s = c->shape;
    size_t n = 0, t = c->steps, mesh = s->front == VGI_FRONT_MESH ? s->numbers : 0, linear = s->numbers - mesh;
#define PLACE(array, rows) (c->array = base ? base + n : NULL, n += (rows))
    PLACE(state, ((t - 1) / c->apart + 1) * s->numbers);
    PLACE(near, (c->apart - 1) * s->numbers);
    PLACE(ahead, c->apart > 1 ? s->numbers : 0);
    PLACE(latent, t * s->latent);
    PLACE(spread, s->uncertain ? t * s->latent : 0);
    PLACE(noise, s->uncertain ? t * s->latent : 0);
    for (size_t l = 0; l < s->layers; l++) {
        PLACE(input[l], (t + 1) * (vgi_shape_input(s, l) + s->hidden));
        PLACE(gates[l], t * 4 * s->hidden);
        PLACE(cell[l], (t + 1) * s->hidden);
    }
    PLACE(top, t * s->hidden);
    for (size_t i = 0; i <= s->convolutions; i++) PLACE(inner[i], s->numbers);
    PLACE(work, 2 * mesh);
    PLACE(dy, s->numbers);
    PLACE(other, mesh);
    PLACE(dstate, s->numbers);
    PLACE(dinput, s->numbers);
    PLACE(room[0], s->numbers);
    PLACE(room[1], linear); /* only a skeleton looks at two frames */
    PLACE(from_behind, linear);
    PLACE(later, linear);
    PLACE(row, (size_t)16 * most(s->latent, 4 * s->hidden));
#undef PLACE
    return n;
}

int net_chains_make(net_chains *c, const vgi_shape *s, size_t steps, size_t apart, vg_err *e)
{
    *c = (net_chains){.shape = s, .steps = steps, .apart = apart ? apart : choose_apart(s, steps)};
    c->late = c->apart > 1 && s->uncertain;
    size_t fit = PACK_BYTES / (2 * s->numbers * sizeof *c->state), most_steps = fit < PACK ? PACK : fit;
    c->packed = steps - 1 < most_steps ? steps - 1 : most_steps;
    size_t widest = s->front == VGI_FRONT_MESH ? c->packed * (2 * s->numbers + 6 * s->latent + 2 * ROWS_AT_ONCE) : 0;
    for (size_t l = 0; l < s->layers; l++)
        widest = most(widest, steps * (vgi_shape_input(s, l) + 5 * s->hidden + s->numbers * (s->front == VGI_FRONT_LINEAR)));
    c->memory = net_array(lay_out(c, NULL), e);
    c->pack = c->memory ? FLAT(net_array(widest, e)) : NULL;
    if (!c->pack) return net_chains_clear(c), VG_ENOMEM;
    lay_out(c, c->memory);
    return VG_OK;
}

void net_chains_clear(net_chains *c)
{
    free(c->memory);
    free(c->pack);
    *c = (net_chains){0};
}

/* ---- forward ---- */

static size_t input_rows(const vgi_shape *s, size_t l)
{
    return vgi_shape_input(s, l) + s->hidden;
}

void net_chains_begin(net_chains *c, const net_lanes *start)
{
    const vgi_shape *s = c->shape;
    for (size_t l = 0; l < s->layers; l++) {
        memcpy(c->input[l] + vgi_shape_input(s, l), start + 2 * l * s->hidden, s->hidden * sizeof *start);
        memcpy(c->cell[l], start + (2 * l + 1) * s->hidden, s->hidden * sizeof *start);
    }
}

static net_neighbours neighbours(const vgi_shape *s)
{
    return (net_neighbours){s->vertices, s->first, s->to};
}

static net_convolution layer(const net_drive *d, size_t k, bool mirrored)
{
    const vgi_shape *s = d->shape;
    const real *p = d->parameters;
    return (net_convolution){s->channels, p + s->own[k], p + s->mean[k],
                             p + (mirrored ? s->bias_back[k] : s->bias[k]), mirrored};
}

/* inner[0 .. convolutions - 1]: outputs of the convolutions of x; returns the last */
static const net_lanes *convolve_in(net_chains *c, const net_drive *d, const net_lanes *x)
{
    const vgi_shape *s = c->shape;
    net_neighbours g = neighbours(s);
    for (size_t k = 0; k < s->convolutions; k++) {
        net_convolution one = layer(d, k, false);
        net_convolve(&g, &one, x, c->inner[k], c->work);
        x = c->inner[k];
    }
    return x;
}

/* inner[0 .. convolutions]: from h of the last layer to the change; returns the last */
static net_lanes *convolve_out(net_chains *c, const net_drive *d, const net_lanes *top)
{
    const vgi_shape *s = c->shape;
    net_neighbours g = neighbours(s);
    net_lanes *x = c->inner[0];
    net_multiply(s->numbers, s->latent, d->parameters + s->full, top, false, x);
    if (!s->convolutions) net_tanh(x, s->numbers);
    for (size_t i = 0; i < s->convolutions; i++) {
        net_convolution one = layer(d, s->convolutions - 1 - i, true);
        net_convolve(&g, &one, x, c->inner[i + 1], c->work);
        x = c->inner[i + 1];
    }
    return x;
}

static void add_spread(net_chains *c, const net_drive *d, size_t t, const net_lanes *x, net_lanes *in)
{
    const vgi_shape *s = c->shape;
    net_lanes *spread = c->spread + t * s->latent, *noise = c->noise + t * s->latent;
    net_multiply_turned(s->numbers, s->latent, d->parameters + s->variance, x, false, spread);
    for (size_t k = 0; k < s->latent; k++)
        for (int i = 0; i < NET_LANES; i++) {
            real v = spread[k][i] + d->parameters[s->variance_bias + k];
            spread[k][i] = v < -10 ? -10 : v > 5 ? 5 : v;
            in[k][i] += (real)exp(0.5 * (double)spread[k][i]) * noise[k][i];
        }
}

/* input of the first recurrent layer for frame x */
static void encode_frame(net_chains *c, const net_drive *d, size_t t, const net_lanes *x)
{
    const vgi_shape *s = c->shape;
    net_lanes *latent = c->latent + t * s->latent, *in = c->input[0] + t * input_rows(s, 0);
    if (s->front == VGI_FRONT_LINEAR) {
        for (size_t k = 0; k < s->numbers; k++) in[k] = x[k] * d->scale_in[k];
        return;
    }
    x = convolve_in(c, d, x);
    net_multiply_turned(s->numbers, s->latent, d->parameters + s->full, x, false, latent);
    memcpy(in, latent, s->latent * sizeof *in);
    if (s->uncertain) add_spread(c, d, t, x, in);
}

static void recur(net_chains *c, const net_drive *d, size_t t)
{
    const vgi_shape *s = c->shape;
    size_t h = s->hidden;
    for (size_t l = 0; l < s->layers; l++) {
        size_t rows = input_rows(s, l), in = vgi_shape_input(s, l);
        net_lanes *gates = c->gates[l] + t * 4 * h, *cell = c->cell[l] + t * h, *next = c->input[l] + (t + 1) * rows + in;
        const real *bias = d->parameters + s->gates_bias[l];
        for (size_t k = 0; k < 4 * h; k++) gates[k] = (net_lanes){0} + bias[k];
        net_multiply_turned(rows, 4 * h, d->parameters + s->gates[l], c->input[l] + t * rows, true, gates);
        net_gates(h, gates, cell, cell + h, next);
        net_lanes *above = l + 1 < s->layers ? c->input[l + 1] + t * input_rows(s, l + 1) : c->top + t * h;
        memcpy(above, next, h * sizeof *next);
    }
}

/* next += the change given by the last recurrent layer */
static void decode_frame(net_chains *c, const net_drive *d, size_t t, net_lanes *next)
{
    const vgi_shape *s = c->shape;
    const net_lanes *top = c->top + t * s->hidden;
    if (s->front == VGI_FRONT_MESH) {
        const net_lanes *y = convolve_out(c, d, top);
        for (size_t k = 0; k < s->numbers; k++) next[k] += y[k];
        return;
    }
    net_lanes *y = c->inner[0];
    net_multiply_turned(s->hidden, s->numbers, d->parameters + s->full, top, false, y);
    for (size_t k = 0; k < s->numbers; k++)
        next[k] += (y[k] + d->parameters[s->full_bias + k]) * d->scale_out[k];
}

/* y += m' x, or m x, for the lanes that run in one direction */
static void add_way(const net_drive *d, bool back, const real *m, bool turn, const net_lanes *x, real sign, net_lanes *y)
{
    size_t n = d->shape->numbers, first = back ? d->forward : 0, lanes = back ? NET_LANES - d->forward : d->forward;
    if (!lanes) return;
    if (sign < 0) { /* the BLAS wrapper has no alpha: y := -(m x - y) */
        for (size_t k = 0; k < n; k++)
            for (size_t i = first; i < first + lanes; i++) y[k][i] = -y[k][i];
    }
    NET_GEMM(turn, false, n, lanes, n, m, n, FLAT_IN(x) + first, NET_LANES, 1, FLAT(y) + first, NET_LANES);
    if (sign < 0)
        for (size_t k = 0; k < n; k++)
            for (size_t i = first; i < first + lanes; i++) y[k][i] = -y[k][i];
}

static void add_skeleton(const net_drive *d, const net_lanes *x, const net_lanes *before, net_lanes *next)
{
    for (int back = 0; back < 2; back++) {
        const net_skeleton *s = &d->skeleton[back];
        for (size_t k = 0; k < d->shape->numbers; k++)
            for (size_t i = back ? d->forward : 0; i < (back ? NET_LANES : d->forward); i++) next[k][i] += s->shift[k];
        add_way(d, back, before ? s->sum : s->turn, true, x, 1, next);
        if (before) add_way(d, back, s->change, true, before, -1, next);
    }
}

void net_chains_step(net_chains *c, const net_drive *d, size_t t, const net_lanes *x, const net_lanes *before,
                     net_lanes *next)
{
    encode_frame(c, d, t, x);
    recur(c, d, t);
    memcpy(next, x, c->shape->numbers * sizeof *x);
    decode_frame(c, d, t, next);
    if (d->skeleton) add_skeleton(d, x, before, next);
}

/* place of frame t of the chains */
static net_lanes *place_of(net_chains *c, size_t t)
{
    size_t n = c->shape->numbers, beside = t % c->apart;
    return beside ? c->near + (beside - 1) * n : c->state + t / c->apart * n;
}

/* input of step t: given, then copied to `room`, or the chains' own output x */
static const net_lanes *input(const net_drive *d, size_t t, const net_lanes *x, net_lanes *room)
{
    if (t >= d->given) return x;
    d->truth(d->context, t, room);
    return room;
}

void net_chains_forward(net_chains *c, const net_drive *d)
{
    const net_lanes *before = NULL;
    d->truth(d->context, 0, c->state);
    for (size_t t = 0; t + 1 < c->steps; t++) {
        const net_lanes *x = input(d, t, place_of(c, t), c->room[c->shape->front == VGI_FRONT_LINEAR && t % 2]);
        net_chains_step(c, d, t, x, before, place_of(c, t + 1));
        before = x;
    }
    c->segment = (c->steps - 1) / c->apart;
    c->ahead_at = 0;
}

/* Frame t + 1 from frame t once more, with what the recurrent layers gave. */
static void repeat_step(net_chains *c, const net_drive *d, size_t t, const net_lanes *from, net_lanes *to)
{
    const net_lanes *x = input(d, t, from, c->room[0]);
    if (x != to) memcpy(to, x, c->shape->numbers * sizeof *to);
    decode_frame(c, d, t, to);
}

const net_lanes *net_chains_state(net_chains *c, const net_drive *d, size_t t)
{
    size_t first = t - t % c->apart;
    if (t > first && c->segment != t / c->apart) {
        for (size_t i = first; i + 1 < first + c->apart && i + 1 < c->steps; i++)
            repeat_step(c, d, i, place_of(c, i), place_of(c, i + 1));
        c->segment = t / c->apart;
    }
    return place_of(c, t);
}

const net_lanes *net_chains_state_ahead(net_chains *c, const net_drive *d, size_t t)
{
    size_t first = t - t % c->apart, from = c->ahead_at > first && c->ahead_at <= t ? c->ahead_at : first;
    if (t == first) return place_of(c, t);
    for (size_t i = from; i < t; i++) repeat_step(c, d, i, i > first ? c->ahead : place_of(c, i), c->ahead);
    c->ahead_at = t;
    return c->ahead;
}

/* ---- backward ---- */

/* `count` steps of rows, `stride` rows apart, as columns of a matrix whose rows are `apart` numbers apart */
static void pack_rows(const net_lanes *from, size_t stride, size_t rows, size_t count, real *to, size_t apart)
{
    for (size_t k = 0; k < rows; k++)
        for (size_t t = 0; t < count; t++) memcpy(to + k * apart + t * NET_LANES, from + t * stride + k, sizeof *from);
}

static void add_sums(const net_lanes *from, size_t stride, size_t rows, size_t count, real *to)
{
    for (size_t k = 0; k < rows; k++) {
        net_lanes sum = {0};
        for (size_t t = 0; t < count; t++) sum += from[t * stride + k];
        for (int i = 0; i < NET_LANES; i++) to[k] += sum[i];
    }
}

/* Steps collected for one product with a full layer. */
typedef struct waiting {
    size_t steps;
    net_lanes *in, *out;             /* numbers each: input and gradient of the output of the full layer */
    net_lanes *latent, *spread, *top; /* latent each: gradients, gradients, h */
    real *left, *right, *right_spread; /* workspace: the steps side by side */
} waiting;

static waiting begin_waiting(net_chains *c)
{
    const vgi_shape *s = c->shape;
    size_t columns = c->packed * NET_LANES;
    waiting w = {.in = (net_lanes *)c->pack};
    w.out = w.in + c->packed * s->numbers;
    w.latent = w.out + c->packed * s->numbers;
    w.spread = w.latent + c->packed * s->latent, w.top = w.spread + c->packed * s->latent;
    w.left = FLAT(w.top + c->packed * s->latent);
    w.right = w.left + 2 * ROWS_AT_ONCE * columns, w.right_spread = w.right + 2 * s->latent * columns;
    return w;
}

static void put_waiting(net_lanes *to, size_t step, const net_lanes *rows, size_t n)
{
    memcpy(to + step * n, rows, n * sizeof *rows);
}

/* Add the gradients of the steps collected: of the layer as the encoder and as the decoder, and of the variance
 * (NULL: not now). */
static void multiply_packed(const vgi_shape *s, waiting *w, real *gradient, real *variance)
{
    size_t n = s->numbers, latent = s->latent, k = w->steps * NET_LANES;
    pack_rows(w->latent, latent, latent, w->steps, w->right, 2 * k);
    pack_rows(w->top, latent, latent, w->steps, w->right + k, 2 * k);
    if (variance) pack_rows(w->spread, latent, latent, w->steps, w->right_spread, k);
    for (size_t first = 0; k && first < n; first += ROWS_AT_ONCE) {
        size_t rows = n - first < ROWS_AT_ONCE ? n - first : ROWS_AT_ONCE;
        pack_rows(w->in + first, n, rows, w->steps, w->left, 2 * k);
        pack_rows(w->out + first, n, rows, w->steps, w->left + k, 2 * k);
        NET_GEMM(false, true, rows, latent, 2 * k, w->left, 2 * k, w->right, 2 * k, 1,
                 gradient + s->full + first * latent, latent);
        if (variance)
            NET_GEMM(false, true, rows, latent, k, w->left, 2 * k, w->right_spread, k, 1, variance + first * latent, latent);
    }
    w->steps = 0;
}

/* Of the variance alone. */
static void multiply_variance(const vgi_shape *s, waiting *w, real *variance)
{
    size_t n = s->numbers, latent = s->latent, k = w->steps * NET_LANES;
    pack_rows(w->spread, latent, latent, w->steps, w->right_spread, k);
    for (size_t first = 0; first < n; first += ROWS_AT_ONCE) {
        size_t rows = n - first < ROWS_AT_ONCE ? n - first : ROWS_AT_ONCE;
        pack_rows(w->in + first, n, rows, w->steps, w->left, k);
        NET_GEMM(false, true, rows, latent, k, w->left, k, w->right_spread, k, 1, variance + first * latent, latent);
    }
    w->steps = 0;
}

typedef struct backward {
    net_chains *c;
    const net_drive *d;
    real *gradient;
    double divergence;
    const net_lanes *shares; /* one row: share of each lane in the divergence */
    net_lanes *dstate, *dinput; /* numbers each */
    net_lanes *dh[VGI_NET_LAYERS], *dc[VGI_NET_LAYERS]; /* hidden: from the following step */
    net_lanes *dlatent; /* latent */
    net_lanes *dspread;
    waiting w;
} backward;

/* where the gradient of the parameters at an offset goes */
static real *gradient_at(const backward *b, size_t offset)
{
    const vgi_shape *s = b->c->shape;
    return b->gradient + (b->c->late && offset > s->variance ? offset - s->numbers * s->latent : offset);
}

static void multiply_waiting(backward *b)
{
    const net_chains *c = b->c;
    const vgi_shape *s = c->shape;
    multiply_packed(s, &b->w, b->gradient, s->uncertain && !c->late ? b->gradient + s->variance : NULL);
}

/* dh of the last layer from the gradient of the change; x: input of step t */
static void decode_back(backward *b, size_t t, const net_lanes *x, net_lanes *dtop)
{
    net_chains *c = b->c;
    const vgi_shape *s = c->shape;
    net_lanes *dy = c->dy, *other = c->other;
    if (s->front == VGI_FRONT_LINEAR) { /* stored until all steps are packed: see below */
        for (size_t k = 0; k < s->numbers; k++) dy[k] = b->dstate[k] * b->d->scale_out[k];
        memcpy(c->latent + t * s->latent, dy, s->numbers * sizeof *dy); /* the same number of rows; the mean is no
                                                                           longer needed */
        net_multiply(s->hidden, s->numbers, b->d->parameters + s->full, dy, false, dtop);
        return;
    }
    net_neighbours g = neighbours(s);
    if (s->convolutions) convolve_out(c, b->d, c->top + t * s->hidden);
    memcpy(dy, b->dstate, s->numbers * sizeof *dy);
    if (!s->convolutions) net_tanh_back(s->numbers, net_chains_state(c, b->d, t + 1), x, dy);
    for (size_t k = 0; k < s->convolutions; k++) {
        size_t out = s->convolutions - k;
        net_convolution one = layer(b->d, k, true);
        net_convolve_back(&g, &one, c->inner[out - 1], c->inner[out], dy, other, b->gradient + s->own[k],
                          b->gradient + s->mean[k], b->gradient + s->bias_back[k], c->work);
        net_lanes *swap = dy;
        dy = other, other = swap;
    }
    put_waiting(b->w.out, b->w.steps, dy, s->numbers);
    put_waiting(b->w.top, b->w.steps, c->top + t * s->hidden, s->hidden);
    net_multiply_turned(s->numbers, s->hidden, b->d->parameters + s->full, dy, false, dtop);
}

/* dtop: gradient of h of the last layer; gradients of gates overwrite the gates */
static void recur_back(backward *b, size_t t, net_lanes *dtop)
{
    net_chains *c = b->c;
    const vgi_shape *s = c->shape;
    size_t h = s->hidden;
    net_lanes *dgates = c->row + 8 * most(s->latent, 4 * h), *din = c->row + 12 * most(s->latent, 4 * h);
    for (size_t l = s->layers; l-- > 0;) {
        size_t rows = input_rows(s, l), in = vgi_shape_input(s, l);
        net_lanes *gates = c->gates[l] + t * 4 * h;
        const net_lanes *cell = c->cell[l] + t * h;
        for (size_t k = 0; k < h; k++) dtop[k] += b->dh[l][k];
        net_gates_back(h, gates, cell, cell + h, dtop, b->dc[l], dgates);
        memcpy(gates, dgates, 4 * h * sizeof *gates);
        net_multiply(rows, 4 * h, b->d->parameters + s->gates[l], gates, false, din);
        memcpy(b->dh[l], din + in, h * sizeof *din);
        memcpy(l ? dtop : b->dlatent, din, in * sizeof *din);
    }
}

/* gradients of mean and log variance, from those of the recurrent layers' input and of the divergence */
static void spread_back(backward *b, size_t t)
{
    const vgi_shape *s = b->c->shape;
    const net_lanes *mean = b->c->latent + t * s->latent, *spread = b->c->spread + t * s->latent,
                    *noise = b->c->noise + t * s->latent;
    for (size_t k = 0; k < s->latent; k++)
        for (int i = 0; i < NET_LANES; i++) {
            double v = (double)spread[k][i], w = b->divergence * (double)b->shares[0][i];
            bool clamped = v <= -10 || v >= 5;
            double g = (double)b->dlatent[k][i] * (double)noise[k][i] * 0.5 * exp(0.5 * v) + w * 0.5 * (exp(v) - 1);
            b->dspread[k][i] = clamped ? 0 : (real)g;
            b->dlatent[k][i] += (real)(w * (double)mean[k][i]);
        }
}

/* b->dinput: gradient of the input of step t, from that of the recurrent layers' input */
static void encode_back(backward *b, size_t t, const net_lanes *x)
{
    net_chains *c = b->c;
    const vgi_shape *s = c->shape;
    if (s->front == VGI_FRONT_LINEAR) {
        for (size_t k = 0; k < s->numbers; k++) b->dinput[k] = b->dlatent[k] * b->d->scale_in[k];
        return;
    }
    net_neighbours g = neighbours(s);
    net_lanes *dx = b->dinput, *other = c->other;
    if (s->uncertain) spread_back(b, t);
    const net_lanes *last = convolve_in(c, b->d, x);
    put_waiting(b->w.in, b->w.steps, last, s->numbers);
    put_waiting(b->w.latent, b->w.steps, b->dlatent, s->latent);
    if (s->uncertain) {
        put_waiting(b->w.spread, b->w.steps, b->dspread, s->latent);
        add_sums(b->dspread, 0, s->latent, 1, gradient_at(b, s->variance_bias));
        memcpy(c->spread + t * s->latent, b->dspread, s->latent * sizeof *c->spread); /* for net_chains_variance */
    }
    if (++b->w.steps == c->packed) multiply_waiting(b);
    net_multiply(s->numbers, s->latent, b->d->parameters + s->full, b->dlatent, false, dx);
    if (s->uncertain) net_multiply(s->numbers, s->latent, b->d->parameters + s->variance, b->dspread, true, dx);
    for (size_t k = s->convolutions; k-- > 0;) {
        net_convolution one = layer(b->d, k, false);
        net_convolve_back(&g, &one, k ? c->inner[k - 1] : x, c->inner[k], dx, other, b->gradient + s->own[k],
                          b->gradient + s->mean[k], b->gradient + s->bias[k], c->work);
        net_lanes *swap = dx;
        dx = other, other = swap;
    }
    if (dx != b->dinput) memcpy(b->dinput, dx, s->numbers * sizeof *dx);
}

/* Gradients of the recurrent layers, and of the output of coordinates, over all steps at once. */
static void finish_gradients(backward *b)
{
    net_chains *c = b->c;
    const vgi_shape *s = c->shape;
    size_t steps = c->steps - 1, h = s->hidden, k = steps * NET_LANES;
    if (s->front == VGI_FRONT_MESH) multiply_waiting(b); /* its workspace is where the next one is */
    for (size_t l = 0; l < s->layers; l++) {
        size_t rows = input_rows(s, l);
        real *in = c->pack, *out = in + rows * k;
        pack_rows(c->input[l], rows, rows, steps, in, k);
        pack_rows(c->gates[l], 4 * h, 4 * h, steps, out, k);
        NET_GEMM(false, true, rows, 4 * h, k, in, k, out, k, 1, gradient_at(b, s->gates[l]), 4 * h);
        add_sums(c->gates[l], 4 * h, 4 * h, steps, gradient_at(b, s->gates_bias[l]));
    }
    if (s->front == VGI_FRONT_MESH) return;
    real *top = c->pack, *out = top + h * k;
    pack_rows(c->top, h, h, steps, top, k);
    pack_rows(c->latent, s->numbers, s->numbers, steps, out, k);
    NET_GEMM(false, true, h, s->numbers, k, top, k, out, k, 1, b->gradient + s->full, s->numbers);
    add_sums(c->latent, s->numbers, s->numbers, steps, b->gradient + s->full_bias);
}

static void prepare_backward(backward *b)
{
    net_chains *c = b->c;
    const vgi_shape *s = c->shape;
    size_t wide = most(s->latent, 4 * s->hidden);
    b->dlatent = c->row + wide, b->dspread = c->row + 2 * wide;
    net_lanes *states = c->row + 3 * wide; /* layers * 2 * hidden <= 4 * wide */
    for (size_t l = 0; l < s->layers; l++) {
        b->dh[l] = states + 2 * l * s->hidden, b->dc[l] = b->dh[l] + s->hidden;
        memset(b->dh[l], 0, 2 * s->hidden * sizeof *states);
    }
    b->dstate = c->dstate, b->dinput = c->dinput;
    if (s->front != VGI_FRONT_MESH) return;
    b->w = begin_waiting(c);
}

/* Gradient of frame t from frame t + 1 and, through a skeleton, from frame t + 2: from b->dstate and `later`. */
static void pass_back(backward *b, size_t t, const net_lanes *later, net_lanes *to)
{
    size_t n = b->c->shape->numbers;
    for (size_t k = 0; k < n; k++) to[k] = b->dstate[k] + b->dinput[k];
    for (int back = 0; b->d->skeleton && back < 2; back++) {
        const net_skeleton *s = &b->d->skeleton[back];
        add_way(b->d, back, t ? s->sum : s->turn, false, b->dstate, 1, to);
        if (later) add_way(b->d, back, s->change, false, later, -1, to);
    }
}

void net_chains_backward(net_chains *c, const net_drive *d, void (*pull)(void *context, size_t t, net_lanes *g),
                         void *context, double divergence, const net_lanes *shares, real *gradient, net_lanes *start)
{
    const vgi_shape *s = c->shape;
    backward b = {.c = c, .d = d, .gradient = gradient, .divergence = divergence, .shares = shares};
    prepare_backward(&b);
    size_t n = s->numbers;
    net_lanes *from_behind = s->front == VGI_FRONT_MESH ? c->dinput : c->from_behind, *later = c->later, *dtop = c->row;
    memset(from_behind, 0, n * sizeof *from_behind);
    for (size_t t = c->steps - 1; t-- > 0;) {
        if (d->skeleton && t + 2 < c->steps) memcpy(later, b.dstate, n * sizeof *later);
        memcpy(b.dstate, from_behind, n * sizeof *from_behind);
        pull(context, t + 1, b.dstate);
        const net_lanes *x = input(d, t, t < d->given ? NULL : net_chains_state(c, d, t), c->room[0]);
        decode_back(&b, t, x, dtop);
        recur_back(&b, t, dtop);
        encode_back(&b, t, x);
        if (t && t >= d->given) pass_back(&b, t, t + 2 < c->steps ? later : NULL, from_behind);
        else memset(from_behind, 0, n * sizeof *from_behind);
    }
    finish_gradients(&b);
    for (size_t l = 0; start && l < s->layers; l++)
        memcpy(start + 2 * l * s->hidden, b.dh[l], 2 * s->hidden * sizeof *start);
}

void net_chains_variance(net_chains *c, const net_drive *d, real *gradient)
{
    const vgi_shape *s = c->shape;
    waiting w = begin_waiting(c);
    c->ahead_at = 0;
    for (size_t t = 0; t + 1 < c->steps; t++) {
        const net_lanes *x = input(d, t, t < d->given ? NULL : net_chains_state_ahead(c, d, t), c->room[0]);
        put_waiting(w.in, w.steps, convolve_in(c, d, x), s->numbers);
        put_waiting(w.spread, w.steps, c->spread + t * s->latent, s->latent);
        if (++w.steps == c->packed || t + 2 == c->steps) multiply_variance(s, &w, gradient);
    }
}
