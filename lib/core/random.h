/* random.h: pseudo-random numbers that depend only on a seed and a counter: number i of stream s is the same on every
 * machine and in every thread, whatever was drawn before.
 * Internal. Not for secrets.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RANDOM_H
#define VG_RANDOM_H

#include <stddef.h>
#include <stdint.h>

/* vgi_random_mix: a bijection of 64-bit numbers with values that look independent (the finaliser of splitmix64;
 * Steele, Lea, Flood 2014). */
static inline uint64_t vgi_random_mix(uint64_t x)
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/* A sequence of numbers. A copy continues from the same position; set `counter` to jump to any position. */
typedef struct vgi_random {
    uint64_t key, counter;
} vgi_random;

/* vgi_random_start: stream number `stream` of a seed, at its first number. A parallel task uses its task number as
 * the stream. */
vgi_random vgi_random_start(uint64_t seed, uint64_t stream);
uint64_t vgi_random_bits(vgi_random *r);             /* uniform over 0 .. 2^64 - 1 */
double vgi_random_uniform(vgi_random *r);            /* uniform in [0, 1), multiples of 2^-53 */
size_t vgi_random_below(vgi_random *r, size_t n);    /* uniform over 0 .. n-1, n > 0 */
double vgi_random_normal(vgi_random *r);             /* mean 0, variance 1 (Box and Muller); takes two numbers */

#endif
