/* guess_kernel.c: the first guess of a pose, by a walk that adds up vectors, and the right-hand side of what it
 * misses.
 *
 * Both are bound by reading the vectors once. A point is one register, so that a face of r corners costs about a
 * dozen instructions each, and sums at vertices are kept in points, whose last number is not used, so that none is
 * stored across another.
 * Leaves out the choice of the walk, and the solve: reconstruct.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/guess.h"

#define INLINE static inline __attribute__((always_inline))

INLINE vgi_point load(const double *p)
{
    return (vgi_point){p[0], p[1], p[2], 0};
}

INLINE void store(double *p, vgi_point a)
{
    p[0] = a[0], p[1] = a[1], p[2] = a[2];
}

INLINE void walk(const vgi_guesser *s, const double *w, const double *anchors, double *x)
{
    const uint32_t *vert = s->g->vert;
    if (s->pinned < s->g->nv) memset(x + 3 * (size_t)s->pinned, 0, 3 * sizeof *x);
    for (size_t i = 0; i < s->nanchors; i++)
        store(x + 3 * (size_t)s->anchors[i], load(anchors + 3 * i) - load(anchors));
    for (size_t i = 0; i < s->nsteps; i++) {
        size_t c = s->walk[i].corner, from = s->walk[i].from;
        vgi_point step = load(w + 3 * c) - load(w + 3 * from);
        store(x + 3 * (size_t)vert[c], load(x + 3 * (size_t)vert[from]) + step);
    }
}

/* What a face of `size` corners misses: G e for e = (w - w0) - (x - x0), e of the first corner being 0. Only
 * differences within a face are formed, so it rounds like vectors. e: room for `size` points. Called with constant
 * sizes, this becomes straight code for triangles and quads. */
INLINE void add_pull(const vgi_guesser *s, size_t f, size_t size, const double *w, const double *x, vgi_point *e,
                     vgi_point *sum)
{
    size_t begin = s->g->start[f];
    const uint32_t *vert = s->g->vert + begin;
    const double *wf = w + 3 * begin;
    vgi_point w0 = load(wf), x0 = load(x + 3 * (size_t)vert[0]), mean = {0};
    e[0] = mean;
    for (size_t i = 1; i < size; i++) {
        e[i] = (load(wf + 3 * i) - w0) - (load(x + 3 * (size_t)vert[i]) - x0);
        mean += e[i];
    }
    mean *= 1.0 / (double)size;
    if (!s->metric->face) {
        for (size_t i = 0; i < size; i++) sum[vert[i]] += e[i] - mean;
        return;
    }
    const vgi_face_metric *m = &s->metric->face[f];
    const double *plane = s->metric->plane + 3 * begin;
    vgi_point y[3] = {{0}}, z[3]; /* y[j] = sum over corners of plane_j e; z = S y */
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < 3; j++) y[j] += plane[3 * i + j] * e[i];
    z[0] = m->s[0] * y[0] + m->s[1] * y[1] + m->s[2] * y[2];
    z[1] = m->s[1] * y[0] + m->s[3] * y[1] + m->s[4] * y[2];
    z[2] = m->s[2] * y[0] + m->s[4] * y[1] + m->s[5] * y[2];
    for (size_t i = 0; i < size; i++)
        sum[vert[i]] +=
            m->weight * (e[i] - mean) + plane[3 * i] * z[0] + plane[3 * i + 1] * z[1] + plane[3 * i + 2] * z[2];
}

INLINE void fold(const vgi_guesser *s, const double *w, const double *x, vgi_point *sum, double *rhs)
{
    const vg_graph *g = s->g;
    vgi_point e[4];
    memset(sum, 0, g->nv * sizeof *sum);
    for (size_t f = 0; f < g->nf; f++) {
        size_t size = g->start[f + 1] - g->start[f];
        if (size == 3) add_pull(s, f, 3, w, x, e, sum);
        else if (size == 4) add_pull(s, f, 4, w, x, e, sum);
        else add_pull(s, f, size, w, x, sum + g->nv, sum);
    }
    for (size_t v = 0; v < g->nv; v++) store(rhs + 3 * v, sum[v]);
}

INLINE void guess(const vgi_guesser *s, const double *w, const double *anchors, double *x, double *rhs,
                  vgi_point *space)
{
    walk(s, w, anchors, x);
    fold(s, w, x, space, rhs);
}

#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) static void
guess_avx2(const vgi_guesser *s, const double *w, const double *anchors, double *x, double *rhs, vgi_point *space)
{
    guess(s, w, anchors, x, rhs, space);
}
#endif

void vgi_guess(const vgi_guesser *s, const double *w, const double *anchors, double *x, double *rhs, vgi_point *space)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return guess_avx2(s, w, anchors, x, rhs, space);
#endif
    guess(s, w, anchors, x, rhs, space);
}
