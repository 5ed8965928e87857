/* sets.h: disjoint sets of 0..n-1 (union-find) in an array of the caller. Sets are not counted or listed.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SETS_H
#define VG_SETS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Make every element a set by itself. */
static inline void vgi_sets_init(uint32_t *parent, size_t n)
{
    for (size_t i = 0; i < n; i++) parent[i] = (uint32_t)i;
}

/* The lowest element of i's set. Halves the path that it follows. */
static inline uint32_t vgi_sets_find(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

/* Join the sets of i and j; false if they are the same. */
static inline bool vgi_sets_join(uint32_t *parent, uint32_t i, uint32_t j)
{
    i = vgi_sets_find(parent, i);
    j = vgi_sets_find(parent, j);
    if (i == j) return false;
    if (i < j) parent[j] = i;
    else parent[i] = j;
    return true;
}

#endif
