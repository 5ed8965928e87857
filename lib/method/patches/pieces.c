/* pieces.c: connected pieces of labelled faces, adjacent labels, and the points where they meet. Segmentation is in
 * segment.c, components of whole meshes in mesh.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/patches/pieces.h"
#include "numeric/vec3.h"
#include "model/incidence.h"
#include "numeric/sets.h"

#include <stdlib.h>

enum { MOST = 32 }; /* most labels examined around one vertex */

int vgi_connected_pieces(const vg_mesh *m, const uint32_t *label, size_t nlabels, uint32_t *piece, size_t *count,
                         vg_err *e)
{
    vgi_incidence around;
    int r = vgi_incidence_make(&around, m, e);
    if (r < 0) return r;
    uint32_t *at = vgi_array_raw(nlabels, sizeof *at, e), *last = vgi_array_raw(nlabels, sizeof *last, e);
    uint32_t *number = vgi_array_raw(m->nf, sizeof *number, e);
    if (at && last && number) {
        memset(at, 0xff, nlabels * sizeof *at); /* per label: the last vertex at which it was seen, and the face */
        vgi_sets_init(piece, m->nf);
        for (size_t v = 0; v < m->nv; v++)
            for (uint32_t i = around.first[v]; i < around.first[v + 1]; i++) {
                uint32_t f = around.face[i], k = label[f];
                if (at[k] == v) vgi_sets_join(piece, f, last[k]);
                at[k] = (uint32_t)v, last[k] = f;
            }
        *count = 0;
        for (size_t f = 0; f < m->nf; f++) { /* the root of a set is its lowest face */
            uint32_t root = vgi_sets_find(piece, (uint32_t)f);
            if (root == f) number[f] = (uint32_t)(*count)++;
        }
        for (size_t f = m->nf; f-- > 0;) piece[f] = number[vgi_sets_find(piece, (uint32_t)f)];
    } else {
        r = VG_ENOMEM;
    }
    vgi_incidence_clear(&around);
    free(at);
    free(last);
    free(number);
    return r;
}

/* The labels of the faces around a vertex, ascending; returns their number. */
static size_t labels_around(const vgi_incidence *around, size_t v, const uint32_t *label, uint32_t seen[MOST])
{
    size_t n = 0;
    for (uint32_t i = around->first[v]; i < around->first[v + 1] && n < MOST; i++) {
        uint32_t k = label[around->face[i]];
        size_t at = n;
        while (at > 0 && seen[at - 1] > k) at--;
        if (at > 0 && seen[at - 1] == k) continue;
        memmove(seen + at + 1, seen + at, (n++ - at) * sizeof *seen);
        seen[at] = k;
    }
    return n;
}

static int by_pair(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

int vgi_neighbours(const vg_mesh *m, const uint32_t *label, uint32_t (**pair)[2], uint32_t **shared, size_t *count,
                   vg_err *e)
{
    vgi_incidence around;
    uint64_t *all = NULL;
    size_t n = 0, cap = 0;
    *pair = NULL, *shared = NULL, *count = 0;
    int r = vgi_incidence_make(&around, m, e);
    if (r < 0) return r;
    for (size_t v = 0; r == VG_OK && v < m->nv; v++) {
        uint32_t seen[MOST];
        size_t nseen = labels_around(&around, v, label, seen);
        if (nseen > 1) r = vgi_grow(&all, &cap, n + nseen * nseen / 2 + 1, sizeof *all, e);
        for (size_t b = 1; r == VG_OK && b < nseen; b++)
            for (size_t a = 0; a < b; a++) all[n++] = (uint64_t)seen[a] << 32 | seen[b];
    }
    vgi_incidence_clear(&around);
    if (n) qsort(all, n, sizeof *all, by_pair);
    if (r == VG_OK) {
        *pair = vgi_array_raw(n, sizeof **pair, e), *shared = vgi_array(n, sizeof **shared, e);
        if (!*pair || !*shared) r = VG_ENOMEM;
    }
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        if (i == 0 || all[i] != all[i - 1]) {
            (*pair)[*count][0] = (uint32_t)(all[i] >> 32), (*pair)[*count][1] = (uint32_t)all[i];
            (*count)++;
        }
        (*shared)[*count - 1]++;
    }
    free(all);
    if (r < 0) {
        free(*pair);
        free(*shared);
        *pair = NULL, *shared = NULL;
    }
    return r;
}

/* Binary search for a pair; returns n if it is not found. */
static size_t find_pair(const uint32_t *pairs, size_t n, uint32_t a, uint32_t b)
{
    size_t low = 0, high = n;
    while (low < high) {
        size_t mid = (low + high) / 2;
        if (pairs[2 * mid] < a || (pairs[2 * mid] == a && pairs[2 * mid + 1] < b)) low = mid + 1;
        else high = mid;
    }
    return low < n && pairs[2 * low] == a && pairs[2 * low + 1] == b ? low : n;
}

int vgi_shared_points(const vg_mesh *m, const uint32_t *label, const uint32_t *pairs, size_t n, const double *points,
                      double *mean, vg_err *e)
{
    vgi_incidence around;
    uint32_t *count = vgi_array(n, sizeof *count, e);
    if (!count) return VG_ENOMEM;
    int r = vgi_incidence_make(&around, m, e);
    if (r < 0) return free(count), r;
    memset(mean, 0, 3 * n * sizeof *mean);
    for (size_t v = 0; v < m->nv; v++) {
        uint32_t seen[MOST];
        size_t nseen = labels_around(&around, v, label, seen);
        for (size_t b = 1; b < nseen; b++)
            for (size_t a = 0; a < b; a++) {
                size_t at = find_pair(pairs, n, seen[a], seen[b]);
                if (at == n) continue;
                count[at]++;
                vgi_add(mean + 3 * at, points + 3 * v);
            }
    }
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3 && count[i]; c++) mean[3 * i + c] /= count[i];
    vgi_incidence_clear(&around);
    free(count);
    return VG_OK;
}
