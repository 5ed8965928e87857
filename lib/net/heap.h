/* heap.h: a priority queue of vertices whose keys may decrease, for shortest paths and spanning trees. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_HEAP_H
#define VG_HEAP_H

#include <stddef.h>
#include <stdint.h>

/* A binary heap. `at` holds n vertices; `place` is the position of each vertex in it, UINT32_MAX if absent. */
typedef struct vgi_heap {
    size_t n;
    uint32_t *at, *place;
    const double *key;
} vgi_heap;

static inline void vgi_heap_set(vgi_heap *h, size_t i, uint32_t v)
{
    h->at[i] = v;
    h->place[v] = (uint32_t)i;
}

/* vgi_heap_lower: the key of v has decreased, or v is new. */
static inline void vgi_heap_lower(vgi_heap *h, uint32_t v)
{
    size_t i = h->place[v] == UINT32_MAX ? h->n++ : h->place[v];
    for (; i > 0 && h->key[h->at[(i - 1) / 2]] > h->key[v]; i = (i - 1) / 2) vgi_heap_set(h, i, h->at[(i - 1) / 2]);
    vgi_heap_set(h, i, v);
}

/* vgi_heap_take: remove and return the vertex with the smallest key. */
static inline uint32_t vgi_heap_take(vgi_heap *h)
{
    uint32_t least = h->at[0], last = h->at[--h->n];
    h->place[least] = UINT32_MAX;
    size_t i = 0, child;
    for (; h->n && (child = 2 * i + 1) < h->n; i = child) {
        if (child + 1 < h->n && h->key[h->at[child + 1]] < h->key[h->at[child]]) child++;
        if (!(h->key[h->at[child]] < h->key[last])) break;
        vgi_heap_set(h, i, h->at[child]);
    }
    if (h->n) vgi_heap_set(h, i, last);
    return least;
}

#endif
