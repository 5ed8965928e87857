/* branches.c: chooses branches of the logarithms of rotations: neighbours with the most similar rotations are joined
 * first (Kruskal 1956), and each piece follows the one it is joined to. A breadth-first tree does worse than no tree
 * (MATH 11).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/branches.h"
#include "method/vectors/unwrap.h"
#include "numeric/sets.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

void vgi_branches_clear(vgi_branches *b)
{
    free(b->order);
    free(b->parent);
    *b = (vgi_branches){0};
}

/* ---- the forest ---- */

typedef struct ranked {
    double key;
    uint32_t index;
} ranked;

static int by_key(const void *a_, const void *b_)
{
    const ranked *a = a_, *b = b_;
    if (a->key != b->key) return a->key < b->key ? -1 : 1;
    return a->index < b->index ? -1 : a->index > b->index;
}

typedef struct forest {
    vgi_branches *b;
    size_t npairs;
    const uint32_t *pair;
    ranked *ranks;       /* of pairs, then of pieces */
    uint32_t *set;       /* pieces joined so far */
    uint32_t *next;      /* linked lists of the kept pairs at each piece: 2 i and 2 i + 1 are the ends of pair i */
    uint32_t *head;      /* the first of each list; END: empty */
    bool *reached;
} forest;

enum { END = 0xffffffff };

static void keep_pair(forest *f, uint32_t i)
{
    for (uint32_t side = 0; side < 2; side++) {
        uint32_t piece = f->pair[2 * (size_t)i + side];
        f->next[2 * (size_t)i + side] = f->head[piece];
        f->head[piece] = 2 * i + side;
    }
}

static void join_pairs(forest *f, const double *cost)
{
    for (size_t i = 0; i < f->npairs; i++) f->ranks[i] = (ranked){cost[i], (uint32_t)i};
    qsort(f->ranks, f->npairs, sizeof *f->ranks, by_key);
    for (uint32_t i = 0; i < f->b->n; i++) f->set[i] = i, f->head[i] = END;
    for (size_t k = 0; k < f->npairs; k++) {
        uint32_t i = f->ranks[k].index, a = vgi_sets_find(f->set, f->pair[2 * (size_t)i]), b = vgi_sets_find(f->set, f->pair[2 * (size_t)i + 1]);
        if (a == b) continue;
        f->set[a] = b;
        keep_pair(f, i);
    }
}

static size_t walk_tree(forest *f, uint32_t root, size_t n)
{
    vgi_branches *b = f->b;
    size_t at = n;
    b->order[n++] = root;
    b->parent[root] = root;
    f->reached[root] = true;
    for (; at < n; at++) {
        uint32_t piece = b->order[at];
        for (uint32_t i = f->head[piece]; i != END; i = f->next[i]) {
            uint32_t other = f->pair[i ^ 1u];
            if (f->reached[other]) continue;
            f->reached[other] = true;
            b->parent[other] = piece;
            b->order[n++] = other;
        }
    }
    return n;
}

static void walk_trees(forest *f)
{
    vgi_branches *b = f->b;
    size_t n = 0;
    for (size_t i = 0; i < b->n; i++) f->ranks[i] = (ranked){-b->share[i], (uint32_t)i};
    qsort(f->ranks, b->n, sizeof *f->ranks, by_key);
    for (size_t i = 0; i < b->n; i++)
        if (!f->reached[f->ranks[i].index]) n = walk_tree(f, f->ranks[i].index, n);
}

int vgi_branches_make(vgi_branches *b, size_t n, const double *share, size_t npairs, const uint32_t *pair,
                      const double *cost, vg_err *e)
{
    size_t most = n > npairs ? n : npairs;
    *b = (vgi_branches){.n = n, .share = share};
    forest f = {.b = b, .npairs = npairs, .pair = pair};
    int r = VG_ENOMEM;
    if ((b->order = vgi_array(n, sizeof *b->order, e)) && (b->parent = vgi_array(n, sizeof *b->parent, e)) &&
        (f.ranks = vgi_array(most, sizeof *f.ranks, e)) && (f.set = vgi_array(n, sizeof *f.set, e)) &&
        (f.next = vgi_array(npairs, 2 * sizeof *f.next, e)) && (f.head = vgi_array(n, sizeof *f.head, e)) &&
        (f.reached = vgi_array(n, sizeof *f.reached, e))) {
        join_pairs(&f, cost);
        walk_trees(&f);
        r = VG_OK;
    }
    free(f.ranks);
    free(f.set);
    free(f.next);
    free(f.head);
    free(f.reached);
    if (r < 0) vgi_branches_clear(b);
    return r;
}

/* ---- traversal ---- */

static void follow_parents(const vgi_branches *b, const double *q, double *l)
{
    for (size_t i = 0; i < b->n; i++) {
        size_t piece = b->order[i], parent = b->parent[piece];
        if (parent != piece) vgi_branch_follow(q + 4 * piece, l + 3 * parent, l + 3 * piece);
    }
}

/* Mean over the surface of the steps by which pieces would have to move to be nearest to the previous frame. */
static void mean_step(const vgi_branches *b, const double *q, const double *before, const double *l, double step[3])
{
    step[0] = step[1] = step[2] = 0;
    for (size_t i = 0; i < b->n; i++) {
        double wanted[3];
        vgi_branch_near(q + 4 * i, before + 3 * i, wanted);
        vgi_deduct(wanted, l + 3 * i);
        vgi_add_scaled(step, b->share[i], wanted);
    }
}

void vgi_branches_walk(const vgi_branches *b, const double *q, const double *before, double *l)
{
    static const double none[3] = {0, 0, 0};
    double step[3];
    for (size_t i = 0; i < b->n; i++)
        if (b->parent[i] == i) vgi_branch_near(q + 4 * i, none, l + 3 * i);
    follow_parents(b, q, l);
    if (!before) return;
    mean_step(b, q, before, l, step);
    if (!(vgi_length(step) > M_PI / 2)) return; /* of the half angle: most of the surface differs by a whole turn */
    for (size_t i = 0; i < b->n; i++) {
        double near[3];
        vgi_sum(l + 3 * i, step, near);
        if (b->parent[i] == i) vgi_branch_near(q + 4 * i, near, l + 3 * i);
    }
    follow_parents(b, q, l);
}
