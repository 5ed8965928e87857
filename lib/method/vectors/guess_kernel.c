/* guess_kernel.c: the first guess of a pose, by a walk that adds up vectors, and the right-hand side from its
 * residual.
 *
 * Both are bound by one read of the vectors. A point is one register of four numbers or two of two, so that a face
 * with r corners costs about a dozen instructions per corner. Sums at vertices are kept in such points, whose fourth
 * number is unused, so that stores do not overlap.
 * The walk is chosen and the system solved in reconstruct.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/guess.h"
#include "core/wide.h"

#if VGI_WIDTH == 2
enum { PIECES = 2 };
typedef vgi_pair piece;
#else
enum { PIECES = 1 };
typedef double piece __attribute__((vector_size(32)));
#endif
typedef struct point {
    piece at[PIECES];
} point;

/* Three numbers of an array; the fourth is 0. */
VGI_INLINE point load_point(const double *p)
{
#if VGI_WIDTH == 2
    return (point){{*(const vgi_pair_at *)p, (piece){p[2], 0}}};
#else
    return (point){{(piece){p[0], p[1], p[2], 0}}};
#endif
}

VGI_INLINE void store_point(double *p, point a)
{
    *(vgi_pair_at *)p = __builtin_shufflevector(a.at[0], a.at[0], 0, 1);
    p[2] = a.at[PIECES - 1][2 % (4 / PIECES)];
}

VGI_INLINE point load_sum(const double *p)
{
    point a;
#pragma GCC unroll 2
    for (int i = 0; i < PIECES; i++) a.at[i] = *(const piece *)(p + 4 / PIECES * i);
    return a;
}

VGI_INLINE void store_sum(double *p, point a)
{
#pragma GCC unroll 2
    for (int i = 0; i < PIECES; i++) *(piece *)(p + 4 / PIECES * i) = a.at[i];
}

VGI_INLINE point add(point a, point b)
{
#pragma GCC unroll 2
    for (int i = 0; i < PIECES; i++) a.at[i] += b.at[i];
    return a;
}

VGI_INLINE point less(point a, point b)
{
#pragma GCC unroll 2
    for (int i = 0; i < PIECES; i++) a.at[i] -= b.at[i];
    return a;
}

VGI_INLINE point times(double s, point a)
{
#pragma GCC unroll 2
    for (int i = 0; i < PIECES; i++) a.at[i] *= s;
    return a;
}

VGI_INLINE void put_anchors(const vgi_guesser *s, const double *anchors, double *x)
{
    for (size_t i = 0; i < s->nanchors; i++)
        store_point(x + 3 * (size_t)s->anchors[i], less(load_point(anchors + 3 * i), load_point(anchors)));
}

/* Translate all vertices so that the mean of the anchors is where it should be. */
VGI_INLINE void move_to_anchors(const vgi_guesser *s, const double *anchors, double *x)
{
    point shift = {0};
    for (size_t i = 0; i < s->nanchors; i++)
        shift = add(shift, less(less(load_point(anchors + 3 * i), load_point(anchors)), load_point(x + 3 * (size_t)s->anchors[i])));
    shift = times(1.0 / (double)s->nanchors, shift);
    for (size_t v = 0; v < s->g->faces.nv; v++) store_point(x + 3 * v, add(load_point(x + 3 * v), shift));
}

VGI_INLINE void walk_tree(const vgi_guesser *s, const double *w, const double *anchors, double *x)
{
    const uint32_t *vert = s->g->faces.vert;
    bool from_one = s->pinned < s->g->faces.nv;
    if (from_one) memset(x + 3 * (size_t)s->pinned, 0, 3 * sizeof *x);
    else put_anchors(s, anchors, x);
    for (size_t i = 0; i < s->nsteps; i++) {
        size_t c = s->walk[i].corner, from = s->walk[i].from;
        point step = less(load_point(w + 3 * c), load_point(w + 3 * from));
        store_point(x + 3 * (size_t)vert[c], add(load_point(x + 3 * (size_t)vert[from]), step));
    }
    if (from_one && s->nanchors) move_to_anchors(s, anchors, x);
    put_anchors(s, anchors, x);
}

VGI_INLINE void add_to(vgi_point *sum, uint32_t v, point a)
{
    store_sum(sum[v], add(load_sum(sum[v]), a));
}

/* y[j] = sum over corners of plane_j e; z = S y; each corner adds weight (e - mean) + plane . z */
VGI_INLINE void pull_by_metric(const vgi_guesser *s, size_t f, size_t size, vgi_point *e, point mean, vgi_point *sum)
{
    const vgi_face_metric *m = &s->metric->face[f];
    size_t begin = s->g->faces.start[f];
    const double *plane = s->metric->plane + 3 * begin;
    const uint32_t *vert = s->g->faces.vert + begin;
    point y[3] = {0}, z[3];
    for (size_t i = 0; i < size; i++)
#pragma GCC unroll 3
        for (size_t j = 0; j < 3; j++) y[j] = add(y[j], times(plane[3 * i + j], load_sum(e[i])));
    z[0] = add(times(m->s[0], y[0]), add(times(m->s[1], y[1]), times(m->s[2], y[2])));
    z[1] = add(times(m->s[1], y[0]), add(times(m->s[3], y[1]), times(m->s[4], y[2])));
    z[2] = add(times(m->s[2], y[0]), add(times(m->s[4], y[1]), times(m->s[5], y[2])));
    for (size_t i = 0; i < size; i++) {
        point pull = times(m->weight, less(load_sum(e[i]), mean));
#pragma GCC unroll 3
        for (size_t j = 0; j < 3; j++) pull = add(pull, times(plane[3 * i + j], z[j]));
        add_to(sum, vert[i], pull);
    }
}

/* Residual of a face with `size` corners: G e for e = (w - w0) - (x - x0), where e of the first corner is 0. Only
 * differences within the face are formed, so rounding is that of vectors. e: workspace of `size` points. With
 * constant sizes the compiler unrolls this for triangles and quads. */
VGI_INLINE void add_pull(const vgi_guesser *s, size_t f, size_t size, const double *w, const double *x, vgi_point *e,
                         vgi_point *sum)
{
    size_t begin = s->g->faces.start[f];
    const uint32_t *vert = s->g->faces.vert + begin;
    const double *wf = w + 3 * begin;
    point w0 = load_point(wf), x0 = load_point(x + 3 * (size_t)vert[0]), mean = {0};
    store_sum(e[0], mean);
    for (size_t i = 1; i < size; i++) {
        point miss = less(less(load_point(wf + 3 * i), w0), less(load_point(x + 3 * (size_t)vert[i]), x0));
        store_sum(e[i], miss);
        mean = add(mean, miss);
    }
    mean = times(1.0 / (double)size, mean);
    if (s->metric->face) return pull_by_metric(s, f, size, e, mean, sum);
    for (size_t i = 0; i < size; i++) add_to(sum, vert[i], less(load_sum(e[i]), mean));
}

VGI_INLINE void add_pulls(const vgi_guesser *s, const double *w, const double *x, vgi_point *sum, double *rhs)
{
    const vg_graph *g = s->g;
    vgi_point e[4];
    memset(sum, 0, g->faces.nv * sizeof *sum);
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t size = g->faces.start[f + 1] - g->faces.start[f];
        if (size == 3) add_pull(s, f, 3, w, x, e, sum);
        else if (size == 4) add_pull(s, f, 4, w, x, e, sum);
        else add_pull(s, f, size, w, x, sum + g->faces.nv, sum);
    }
    for (size_t v = 0; v < g->faces.nv; v++) store_point(rhs + 3 * v, load_sum(sum[v]));
}

static void guess(const vgi_guesser *s, const double *w, const double *anchors, double *x, double *rhs,
                  vgi_point *space)
{
    walk_tree(s, w, anchors, x);
    add_pulls(s, w, x, space, rhs);
}

const vgi_guess_kernel VGI_OF_SET(vgi_guess_kernel) = {guess};
