/* wide.h: a vector of doubles as wide as the registers of the instruction set that a kernel is compiled for, and the
 * operations that kernels need. Included by *_kernel.c alone.
 *
 * These are vector types of GCC and Clang, of 16, 32 or 64 bytes. A vector type wider than the registers would be
 * lowered to single stores and loads, three to ten times slower, so eight poses are VGI_PARTS vectors. Highway and
 * xsimd do the same in C++, which this project does not use; SIMDe emulates the intrinsics of one set on another, but
 * here the width has to change. Arithmetic needs neither; only roots, and moves of points between poses and lanes,
 * are written for each width.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_WIDE_H
#define VG_WIDE_H

#include "core/isa.h"
#include "core/lanes.h"

#if defined(__AVX512F__)
#include <immintrin.h>
#define VGI_WIDTH 8
#define VGI_CHOOSE_WIDTH(two, four, eight) eight
#elif defined(__AVX2__)
#include <immintrin.h>
#define VGI_WIDTH 4
#define VGI_CHOOSE_WIDTH(two, four, eight) four
#else
#if defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif
#define VGI_WIDTH 2
#define VGI_CHOOSE_WIDTH(two, four, eight) two
#endif
#define VGI_PARTS (VGI_LANES / VGI_WIDTH)

/* VGI_OF_SET(name): the name of this set's table: name_avx2 where the Makefile compiles with -DVGI_SET=avx2. */
#define VGI_JOIN2(a, b) a##_##b
#define VGI_JOIN(a, b) VGI_JOIN2(a, b)
#define VGI_OF_SET(name) VGI_JOIN(name, VGI_SET)

#define VGI_INLINE static inline __attribute__((always_inline))

typedef double vgi_wide __attribute__((vector_size(8 * VGI_WIDTH)));
typedef int64_t vgi_mask __attribute__((vector_size(8 * VGI_WIDTH))); /* result of a comparison: -1 or 0 per lane */
typedef double vgi_wide_at __attribute__((vector_size(8 * VGI_WIDTH), aligned(8), may_alias));
typedef double vgi_pair __attribute__((vector_size(16)));
typedef double vgi_pair_at __attribute__((vector_size(16), aligned(8), may_alias));

VGI_INLINE vgi_wide vgi_load(const double *p)
{
    return *(const vgi_wide_at *)p;
}

VGI_INLINE void vgi_store(double *p, vgi_wide x)
{
    *(vgi_wide_at *)p = x;
}

/* vgi_same: x in every lane. */
VGI_INLINE vgi_wide vgi_same(double x)
{
    return VGI_CHOOSE_WIDTH(((vgi_wide){x, x}), ((vgi_wide){x, x, x, x}), ((vgi_wide){x, x, x, x, x, x, x, x}));
}

/* vgi_gather: number i of one array per lane. */
VGI_INLINE vgi_wide vgi_gather(const double *const *p, size_t i)
{
    return VGI_CHOOSE_WIDTH(((vgi_wide){p[0][i], p[1][i]}), ((vgi_wide){p[0][i], p[1][i], p[2][i], p[3][i]}),
                            ((vgi_wide){p[0][i], p[1][i], p[2][i], p[3][i], p[4][i], p[5][i], p[6][i], p[7][i]}));
}

/* One pair from each of the arrays 0, 2, ... (p), or 1, 3, ... (p + 1). */
VGI_INLINE vgi_wide vgi_pairs(const double *const *p, size_t i)
{
    vgi_pair a = *(const vgi_pair_at *)(p[0] + i);
#if VGI_WIDTH == 2
    return a;
#else
    typedef double four __attribute__((vector_size(32)));
    four ab = __builtin_shufflevector(a, *(const vgi_pair_at *)(p[2] + i), 0, 1, 2, 3);
#if VGI_WIDTH == 4
    return ab;
#else
    vgi_pair c = *(const vgi_pair_at *)(p[4] + i), d = *(const vgi_pair_at *)(p[6] + i);
    return __builtin_shufflevector(ab, __builtin_shufflevector(c, d, 0, 1, 2, 3), 0, 1, 2, 3, 4, 5, 6, 7);
#endif
#endif
}

/* The even lanes of a and b interleaved, or the odd ones. */
VGI_INLINE vgi_wide vgi_even(vgi_wide a, vgi_wide b)
{
    return VGI_CHOOSE_WIDTH(__builtin_shufflevector(a, b, 0, 2), __builtin_shufflevector(a, b, 0, 4, 2, 6),
                            __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14));
}

VGI_INLINE vgi_wide vgi_odd(vgi_wide a, vgi_wide b)
{
    return VGI_CHOOSE_WIDTH(__builtin_shufflevector(a, b, 1, 3), __builtin_shufflevector(a, b, 1, 5, 3, 7),
                            __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15));
}

/* vgi_gather_point: numbers i, i + 1 and i + 2 of one array per lane. */
VGI_INLINE void vgi_gather_point(const double *const *p, size_t i, vgi_wide xyz[3])
{
    vgi_wide a = vgi_pairs(p, i), b = vgi_pairs(p + 1, i);
    xyz[0] = vgi_even(a, b), xyz[1] = vgi_odd(a, b), xyz[2] = vgi_gather(p, i + 2);
}

/* Pair k of a vector. */
#define VGI_PAIR(x, k) __builtin_shufflevector(x, x, 2 * (k), 2 * (k) + 1)

/* vgi_scatter_point: the inverse, for the first n arrays. */
VGI_INLINE void vgi_scatter_point(double *const *p, size_t n, size_t i, const vgi_wide xyz[3])
{
    if (n >= VGI_WIDTH) {
        vgi_wide a = vgi_even(xyz[0], xyz[1]), b = vgi_odd(xyz[0], xyz[1]);
        *(vgi_pair_at *)(p[0] + i) = VGI_PAIR(a, 0), *(vgi_pair_at *)(p[1] + i) = VGI_PAIR(b, 0);
#if VGI_WIDTH >= 4
        *(vgi_pair_at *)(p[2] + i) = VGI_PAIR(a, 1), *(vgi_pair_at *)(p[3] + i) = VGI_PAIR(b, 1);
#endif
#if VGI_WIDTH == 8
        *(vgi_pair_at *)(p[4] + i) = VGI_PAIR(a, 2), *(vgi_pair_at *)(p[5] + i) = VGI_PAIR(b, 2);
        *(vgi_pair_at *)(p[6] + i) = VGI_PAIR(a, 3), *(vgi_pair_at *)(p[7] + i) = VGI_PAIR(b, 3);
#endif
#pragma GCC unroll 8
        for (size_t k = 0; k < VGI_WIDTH; k++) p[k][i + 2] = xyz[2][k];
    } else {
        for (size_t c = 0; c < 3; c++) {
            double lane[VGI_WIDTH];
            memcpy(lane, &xyz[c], sizeof lane);
            for (size_t k = 0; k < n; k++) p[k][i + c] = lane[k];
        }
    }
}

/* vgi_part_lanes: number of lanes in part `part` out of `lanes`. */
VGI_INLINE size_t vgi_part_lanes(size_t lanes, size_t part)
{
    size_t first = part * VGI_WIDTH;
    return lanes <= first ? 0 : lanes - first < VGI_WIDTH ? lanes - first : VGI_WIDTH;
}

/* vgi_roots: square roots. */
VGI_INLINE vgi_wide vgi_roots(vgi_wide a)
{
#if defined(__AVX512F__)
    return (vgi_wide)_mm512_sqrt_pd((__m512d)a);
#elif defined(__AVX2__)
    return (vgi_wide)_mm256_sqrt_pd((__m256d)a);
#elif defined(__SSE2__)
    return (vgi_wide)_mm_sqrt_pd((__m128d)a);
#elif defined(__aarch64__)
    return (vgi_wide)vsqrtq_f64((float64x2_t)a);
#else
    return (vgi_wide){__builtin_sqrt(a[0]), __builtin_sqrt(a[1])};
#endif
}

/* As many numbers of binary32, where an estimate will do: their roots and quotients take a third of the time. */
typedef float vgi_rough __attribute__((vector_size(4 * VGI_WIDTH)));

VGI_INLINE vgi_rough vgi_rough_roots(vgi_rough a)
{
#if defined(__AVX512F__)
    return (vgi_rough)_mm256_sqrt_ps((__m256)a);
#elif defined(__AVX2__)
    return (vgi_rough)_mm_sqrt_ps((__m128)a);
#elif defined(__aarch64__)
    return (vgi_rough)vsqrt_f32((float32x2_t)a);
#else
    return (vgi_rough){__builtin_sqrtf(a[0]), __builtin_sqrtf(a[1])};
#endif
}

/* vgi_only: x where the mask is set, else 0; vgi_either: x where it is set, else y. */
VGI_INLINE vgi_wide vgi_only(vgi_mask which, vgi_wide x)
{
    return (vgi_wide)((vgi_mask)x & which);
}

VGI_INLINE vgi_wide vgi_either(vgi_mask which, vgi_wide x, vgi_wide y)
{
    return (vgi_wide)(((vgi_mask)x & which) | ((vgi_mask)y & ~which));
}

VGI_INLINE vgi_wide vgi_absolute(vgi_wide x)
{
    return (vgi_wide)((vgi_mask)x & INT64_MAX);
}

/* vgi_bits: bit k is set if lane k of the mask is. */
VGI_INLINE unsigned vgi_bits(vgi_mask mask)
{
#if defined(__AVX512F__)
    return (unsigned)_mm512_movepi64_mask((__m512i)mask);
#elif defined(__AVX2__)
    return (unsigned)_mm256_movemask_pd((__m256d)mask);
#elif defined(__SSE2__)
    return (unsigned)_mm_movemask_pd((__m128d)mask);
#else
    return (unsigned)(mask[0] & 1) | (unsigned)(mask[1] & 2);
#endif
}

/* vgi_wide_dot: dot product of two points. */
VGI_INLINE vgi_wide vgi_wide_dot(const vgi_wide *a, const vgi_wide *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* 3 x 3 matrices, row-major: sum of squares; cofactors (x^-1 = c' / det), and determinant. */
VGI_INLINE vgi_wide vgi_wide_squares(const vgi_wide *x)
{
    vgi_wide s = x[0] * x[0];
#pragma GCC unroll 8
    for (int i = 1; i < 9; i++) s += x[i] * x[i];
    return s;
}

VGI_INLINE vgi_wide vgi_wide_cofactors(const vgi_wide *x, vgi_wide *c)
{
    c[0] = x[4] * x[8] - x[5] * x[7], c[1] = x[5] * x[6] - x[3] * x[8], c[2] = x[3] * x[7] - x[4] * x[6];
    c[3] = x[2] * x[7] - x[1] * x[8], c[4] = x[0] * x[8] - x[2] * x[6], c[5] = x[1] * x[6] - x[0] * x[7];
    c[6] = x[1] * x[5] - x[2] * x[4], c[7] = x[2] * x[3] - x[0] * x[5], c[8] = x[0] * x[4] - x[1] * x[3];
    return x[0] * c[0] + x[1] * c[1] + x[2] * c[2];
}

#endif
