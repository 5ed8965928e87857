/* planar_kernel.c: the steps of conjugate gradients for eight poses at once (see planar.c), for the instructions at
 * hand. All of them are bound by memory: what can be done while a row is in registers is done in one go.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/planar_kernel.h"

#define INLINE static inline __attribute__((always_inline))

INLINE vgi_lanes dot(const vgi_row *a, const vgi_row *b)
{
    return a->xyz[0] * b->xyz[0] + a->xyz[1] * b->xyz[1] + a->xyz[2] * b->xyz[2];
}

/* One face: h_c = m.p_c less their mean is m.t_c; what it adds to y_c is (m.t_c) m,
 * for the matrix of t in v is a projector. */
INLINE void face(const uint32_t *row, size_t corners, const vgi_row *m, const vgi_row *p, vgi_row *y, vgi_lanes *h,
                 vgi_lanes *sum)
{
    vgi_lanes mean = {0};
    for (size_t c = 0; c < corners; c++) {
        h[c] = dot(m, &p[row[c]]);
        mean += h[c];
    }
    mean *= 1 / (double)corners;
    for (size_t c = 0; c < corners; c++) {
        vgi_lanes t = h[c] - mean;
        vgi_row *to = &y[row[c]];
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) to->xyz[k] += t * m->xyz[k];
        *sum += t * t;
    }
}

INLINE void product(const vgi_planar_faces *f, const vgi_row *normals, const vgi_row *p, vgi_row *y, vgi_lanes *h,
                    vgi_lanes *pPp)
{
    vgi_lanes sum = {0};
    for (size_t i = 0; i < f->n; i++) {
        size_t corners = f->start[i + 1] - f->start[i];
        const uint32_t *row = f->row + f->start[i];
        vgi_lanes four[4];
        if (corners == 4) face(row, 4, &normals[i], p, y, four, &sum); /* in registers */
        else face(row, corners, &normals[i], p, y, h, &sum);
    }
    *pPp = sum;
}

INLINE void turn(size_t n, const vgi_row *z, const vgi_row *r, const vgi_lanes *beta, vgi_row *p, vgi_row *s,
                 vgi_lanes *ps)
{
    vgi_lanes b = *beta, sum = {0};
    for (size_t i = 0; i < n; i++)
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) {
            p[i].xyz[k] = z[i].xyz[k] + b * p[i].xyz[k];
            s[i].xyz[k] = r[i].xyz[k] + b * s[i].xyz[k];
            sum += p[i].xyz[k] * s[i].xyz[k];
        }
    *ps = sum;
}

INLINE void advance(size_t n, const vgi_lanes *alpha, const vgi_lanes *gamma, const vgi_row *p, const vgi_row *s,
                    vgi_row *y, vgi_row *x, vgi_row *r, vgi_row *z)
{
    vgi_lanes a = *alpha, g = *gamma;
    for (size_t i = 0; i < n; i++)
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) {
            x[i].xyz[k] += a * p[i].xyz[k];
            z[i].xyz[k] = r[i].xyz[k] -= a * s[i].xyz[k] + g * y[i].xyz[k];
            y[i].xyz[k] = (vgi_lanes){0};
        }
}

INLINE void dot_all(size_t n, const vgi_row *a, const vgi_row *b, vgi_lanes *ab)
{
    vgi_lanes sum = {0};
    for (size_t i = 0; i < n; i++) sum += dot(&a[i], &b[i]);
    *ab = sum;
}

#if defined(__x86_64__)
#define VARIANTS(suffix, instructions) \
    __attribute__((target(instructions))) static void product_##suffix(const vgi_planar_faces *f, \
        const vgi_row *normals, const vgi_row *p, vgi_row *y, vgi_lanes *h, vgi_lanes *pPp) \
        { product(f, normals, p, y, h, pPp); } \
    __attribute__((target(instructions))) static void turn_##suffix(size_t n, const vgi_row *z, const vgi_row *r, \
        const vgi_lanes *beta, vgi_row *p, vgi_row *s, vgi_lanes *ps) { turn(n, z, r, beta, p, s, ps); } \
    __attribute__((target(instructions))) static void advance_##suffix(size_t n, const vgi_lanes *alpha, \
        const vgi_lanes *gamma, const vgi_row *p, const vgi_row *s, vgi_row *y, vgi_row *x, vgi_row *r, vgi_row *z) \
        { advance(n, alpha, gamma, p, s, y, x, r, z); } \
    __attribute__((target(instructions))) static void dot_##suffix(size_t n, const vgi_row *a, const vgi_row *b, \
        vgi_lanes *ab) { dot_all(n, a, b, ab); }

VARIANTS(avx512, "avx512f,avx512dq,fma")
VARIANTS(avx2, "avx2,fma")

#define CHOOSE(name, ...) \
    do { \
        if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) { \
            name##_avx512(__VA_ARGS__); \
            return; \
        } \
        if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) { \
            name##_avx2(__VA_ARGS__); \
            return; \
        } \
    } while (0)
#else
#define CHOOSE(name, ...) do { } while (0)
#endif

void vgi_planar_product(const vgi_planar_faces *f, const vgi_row *normals, const vgi_row *p, vgi_row *y, vgi_lanes *h,
                        vgi_lanes *pPp)
{
    CHOOSE(product, f, normals, p, y, h, pPp);
    product(f, normals, p, y, h, pPp);
}

void vgi_planar_turn(size_t n, const vgi_row *z, const vgi_row *r, const vgi_lanes *beta, vgi_row *p, vgi_row *s,
                     vgi_lanes *ps)
{
    CHOOSE(turn, n, z, r, beta, p, s, ps);
    turn(n, z, r, beta, p, s, ps);
}

void vgi_planar_advance(size_t n, const vgi_lanes *alpha, const vgi_lanes *gamma, const vgi_row *p, const vgi_row *s,
                        vgi_row *y, vgi_row *x, vgi_row *r, vgi_row *z)
{
    CHOOSE(advance, n, alpha, gamma, p, s, y, x, r, z);
    advance(n, alpha, gamma, p, s, y, x, r, z);
}

void vgi_planar_dot(size_t n, const vgi_row *a, const vgi_row *b, vgi_lanes *ab)
{
    CHOOSE(dot, n, a, b, ab);
    dot_all(n, a, b, ab);
}
