/* join.c: agglomerative clustering after Ward over a neighbour graph, with the cheapest pair on top of a heap.
 * Pieces and their features come from segment.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/patches/join.h"
#include "numeric/sets.h"

#include <stdlib.h>

#define NONE UINT32_MAX

/* The remaining pairs, and the list of pairs at each piece: end e of pair e / 2, from first[piece] along next[e].
 * A removed pair stays in the other piece's list until that list is walked. */
typedef struct state {
    vgi_joining *j;
    uint32_t *set;
    double *cost;
    uint32_t *heap, *place; /* heap of pairs by cost; position of each pair in it, NONE once removed */
    size_t left;            /* pairs in the heap */
    uint32_t *first, *last, *next;
    uint32_t *seen;         /* per piece: the pair that joins it to the current piece */
} state;

static double cost_of(const vgi_joining *j, uint32_t a, uint32_t b)
{
    double square = 0;
    const double *x = j->mean + a * j->width, *y = j->mean + b * j->width;
    for (size_t i = 0; i < j->width; i++) square += (x[i] - y[i]) * (x[i] - y[i]);
    return square * j->size[a] * j->size[b] / (j->size[a] + j->size[b]);
}

/* ---- the heap ---- */

static bool pair_before(const state *s, uint32_t p, uint32_t q)
{
    double a = s->cost[p], b = s->cost[q];
    return a < b || (a == b && p < q);
}

static void put_pair(state *s, size_t at, uint32_t p)
{
    s->heap[at] = p, s->place[p] = (uint32_t)at;
}

/* Restore the heap order at position `at`. */
static void settle_heap(state *s, size_t at)
{
    uint32_t p = s->heap[at];
    for (; at > 0 && pair_before(s, p, s->heap[(at - 1) / 2]); at = (at - 1) / 2) put_pair(s, at, s->heap[(at - 1) / 2]);
    for (size_t child; (child = 2 * at + 1) < s->left; at = child) {
        if (child + 1 < s->left && pair_before(s, s->heap[child + 1], s->heap[child])) child++;
        if (!pair_before(s, s->heap[child], p)) break;
        put_pair(s, at, s->heap[child]);
    }
    put_pair(s, at, p);
}

static void drop_pair(state *s, uint32_t p)
{
    size_t at = s->place[p];
    uint32_t other = s->heap[--s->left];
    s->place[p] = NONE;
    if (other == p) return;
    put_pair(s, at, other);
    settle_heap(s, at);
}

/* ---- pieces ---- */

static void append_pair(state *s, uint32_t piece, uint32_t end)
{
    if (s->first[piece] == NONE) s->first[piece] = end;
    else s->next[s->last[piece]] = end;
    s->last[piece] = end, s->next[end] = NONE;
}

/* The piece that pair p joins to piece a; a itself if the pair is inside. */
static uint32_t beyond(const state *s, uint32_t p, uint32_t a)
{
    uint32_t x = vgi_sets_find(s->set, s->j->pair[p][0]), y = vgi_sets_find(s->set, s->j->pair[p][1]);
    return x == a ? y : x;
}

/* Merge b into a. If two pairs now join the same pieces, the first one stays. */
static void join_pieces(state *s, uint32_t a, uint32_t b)
{
    vgi_joining *j = s->j;
    double sum = j->size[a] + j->size[b], *x = j->mean + a * j->width, *y = j->mean + b * j->width;
    for (size_t i = 0; i < j->width; i++) x[i] = (j->size[a] * x[i] + j->size[b] * y[i]) / sum;
    j->size[a] = sum;
    vgi_sets_join(s->set, a, b); /* the merged piece takes the lower number, a < b */
    uint32_t lists[2] = {s->first[a], s->first[b]};
    s->first[a] = NONE;
    for (int i = 0; i < 2; i++)
        for (uint32_t end = lists[i], after; end != NONE; end = after) {
            uint32_t p = end / 2, other = beyond(s, p, a);
            after = s->next[end];
            if (s->place[p] == NONE) continue;
            uint32_t twin = s->seen[other];
            if (other == a || (twin != NONE && twin < p)) {
                drop_pair(s, p);
                continue;
            }
            if (twin != NONE) drop_pair(s, twin);
            s->seen[other] = p;
            append_pair(s, a, end);
        }
    for (uint32_t end = s->first[a]; end != NONE; end = s->next[end]) {
        uint32_t p = end / 2, other = beyond(s, p, a);
        if (s->place[p] == NONE) continue;
        s->seen[other] = NONE;
        s->cost[p] = cost_of(j, a, other);
        settle_heap(s, s->place[p]);
    }
}

static int make_state(state *s, vgi_joining *j, uint32_t *set, vg_err *e)
{
    size_t n = j->n, m = j->npairs;
    *s = (state){.j = j, .set = set};
    if (m > INT32_MAX) return vg_fail(e, VG_EINPUT, "too many neighbours among the faces: %zu", m);
    s->cost = vgi_array_raw(m, sizeof *s->cost, e);
    s->heap = vgi_array_raw(m, sizeof *s->heap, e), s->place = vgi_array_raw(m, sizeof *s->place, e);
    s->first = vgi_array_raw(n, sizeof *s->first, e), s->last = vgi_array_raw(n, sizeof *s->last, e);
    s->next = vgi_array_raw(2 * m, sizeof *s->next, e), s->seen = vgi_array_raw(n, sizeof *s->seen, e);
    if (!s->cost || !s->heap || !s->place || !s->first || !s->last || !s->next || !s->seen) return VG_ENOMEM;
    vgi_sets_init(set, n);
    memset(s->first, 0xff, n * sizeof *s->first);
    memset(s->seen, 0xff, n * sizeof *s->seen);
    for (uint32_t p = 0; p < m; p++) {
        s->cost[p] = cost_of(j, j->pair[p][0], j->pair[p][1]);
        for (uint32_t k = 0; k < 2; k++) append_pair(s, j->pair[p][k], 2 * p + k);
        put_pair(s, s->left++, p);
        settle_heap(s, p);
    }
    return VG_OK;
}

int vgi_join_pieces(vgi_joining *j, size_t k, uint32_t *set, vg_err *e)
{
    state s;
    int r = make_state(&s, j, set, e);
    for (size_t pieces = j->n; r == VG_OK && pieces > k && s.left; pieces--) {
        const uint32_t *best = j->pair[s.heap[0]];
        uint32_t a = vgi_sets_find(set, best[0]), b = vgi_sets_find(set, best[1]);
        join_pieces(&s, a < b ? a : b, a < b ? b : a);
    }
    for (size_t i = 0; r == VG_OK && i < j->n; i++) set[i] = vgi_sets_find(set, (uint32_t)i);
    free(s.cost);
    free(s.heap);
    free(s.place);
    free(s.first);
    free(s.last);
    free(s.next);
    free(s.seen);
    return r;
}
