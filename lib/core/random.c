/* random.c: pseudo-random numbers from a seed and a counter.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/random.h"

#include <math.h>

vgi_random vgi_random_start(uint64_t seed, uint64_t stream)
{
    return (vgi_random){.key = vgi_random_mix(vgi_random_mix(seed) + stream)};
}

/* Two keys give unrelated sequences, because the counter is mixed before it is combined with the key. */
uint64_t vgi_random_bits(vgi_random *r)
{
    return vgi_random_mix(r->key ^ vgi_random_mix(r->counter++));
}

double vgi_random_uniform(vgi_random *r)
{
    return (double)(vgi_random_bits(r) >> 11) * 0x1p-53;
}

/* The upper half of a product of 128 bits. Numbers that would make some results more likely are drawn again (Lemire
 * 2019). */
size_t vgi_random_below(vgi_random *r, size_t n)
{
    uint64_t unfair = (0 - (uint64_t)n) % (uint64_t)n;
    for (;;) {
        unsigned __int128 product = (unsigned __int128)vgi_random_bits(r) * n;
        if ((uint64_t)product >= unfair) return (size_t)(product >> 64);
    }
}

double vgi_random_normal(vgi_random *r)
{
    static const double full_turn = 6.28318530717958647692;
    double radius = sqrt(-2 * log(1 - vgi_random_uniform(r)));
    return radius * cos(full_turn * vgi_random_uniform(r));
}
