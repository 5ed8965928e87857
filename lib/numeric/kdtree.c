/* kdtree.c: a balanced k-d tree over a copy of the points, without pointers: node i has the children 2i and 2i + 1,
 * and node k of depth d holds the points n k / 2^d to n (k + 1) / 2^d, so neither is stored. Points cannot be
 * inserted or removed.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/random.h"
#include "numeric/kdtree.h"

#include <math.h>
#include <stdlib.h>

enum { LEAF = 8 };     /* a leaf holds at most about this many points */
enum { DEEPEST = 32 }; /* depth bound for 2^32 points */
static const uint32_t NONE = UINT32_MAX;  /* no point */
static const uint32_t MIXED = UINT32_MAX; /* no common label */
static const uint64_t ANY = UINT64_MAX;   /* a label that no point or node has */

struct point {
    double x[3];
    uint32_t index, label;
};

struct node {
    double least[3], most[3]; /* tight box: prunes better than the splitting plane if the points lie on a surface */
    uint32_t lowest;          /* lowest index in the box */
    uint32_t label;           /* common label of all points in the box, or MIXED */
};

struct vgi_kdtree {
    size_t n;
    int depth;           /* of the leaves */
    struct point *point; /* n, in the order of the leaves */
    struct node *node;   /* 2^(depth + 1); node[1] is the root, node[0] is not used */
};

/* A node on the stack, with its squared distance from the query point. */
struct place {
    uint64_t node;
    int depth;
    double square;
};

static void node_range(const vgi_kdtree *t, uint64_t node, int depth, size_t *begin, size_t *end)
{
    uint64_t k = node - ((uint64_t)1 << depth); /* n and k are below 2^32: the products fit */
    *begin = t->n * k >> depth;
    *end = t->n * (k + 1) >> depth;
}

/* ---- building ---- */

/* A total order along an axis: equal coordinates are ordered by index, so that coincident points split too. */
static inline bool point_before(const struct point *a, const struct point *b, int axis)
{
    return a->x[axis] < b->x[axis] || (a->x[axis] == b->x[axis] && a->index < b->index);
}

static inline void swap_points(struct point *a, struct point *b)
{
    struct point c = *a;
    *a = *b;
    *b = c;
}

/* The median of three points at pseudo-random positions, so that no order of the input makes the selection slow. */
static struct point choose_pivot(const struct point *p, size_t n, int axis, vgi_random *random)
{
    const struct point *three[3];
    for (int k = 0; k < 3; k++) three[k] = p + vgi_random_below(random, n);
    int low = point_before(three[1], three[0], axis), high = !low;
    if (point_before(three[2], three[low], axis)) return *three[low];
    return point_before(three[2], three[high], axis) ? *three[2] : *three[high];
}

/* Hoare's selection: move the point of rank `middle` to its position, and smaller ones before it. */
static void select_rank(struct point *p, size_t n, size_t middle, int axis)
{
    vgi_random random = {.key = n};
    size_t begin = 0, end = n;
    while (end - begin > 1) {
        struct point pivot = choose_pivot(p + begin, end - begin, axis, &random);
        size_t i = begin, j = end - 1;
        for (;;) {
            while (point_before(&p[i], &pivot, axis)) i++;
            while (point_before(&pivot, &p[j], axis)) j--;
            if (i >= j) break;
            swap_points(&p[i++], &p[j--]);
        }
        /* now no point before i is above the pivot and none after j is below it; j is i - 1, or i at the pivot
         * itself */
        if (middle < i) end = i;
        else if (middle > j) begin = j + 1;
        else return;
    }
}

static void fit_box(struct node *node, const struct point *p, size_t n)
{
    for (int k = 0; k < 3; k++) node->least[k] = node->most[k] = p[0].x[k];
    for (size_t i = 1; i < n; i++)
        for (int k = 0; k < 3; k++) {
            if (p[i].x[k] < node->least[k]) node->least[k] = p[i].x[k];
            if (p[i].x[k] > node->most[k]) node->most[k] = p[i].x[k];
        }
}

static int widest_axis(const struct node *node)
{
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (node->most[k] - node->least[k] > node->most[axis] - node->least[axis]) axis = k;
    return axis;
}

/* Depth first, so that a subtree is built while it is in the cache. */
static void build(vgi_kdtree *t)
{
    struct place stack[DEEPEST + 2] = {{.node = 1}};
    for (int top = 1; top > 0;) {
        struct place at = stack[--top];
        struct node *node = &t->node[at.node];
        size_t begin, end, middle, unused;
        node_range(t, at.node, at.depth, &begin, &end);
        fit_box(node, t->point + begin, end - begin);
        if (at.depth == t->depth) continue;
        node_range(t, 2 * at.node, at.depth + 1, &unused, &middle);
        select_rank(t->point + begin, end - begin, middle - begin, widest_axis(node));
        stack[top++] = (struct place){2 * at.node + 1, at.depth + 1, 0};
        stack[top++] = (struct place){2 * at.node, at.depth + 1, 0};
    }
}

/* Compute the lowest index and the common label, from points to leaves and from children to nodes. */
static void summarise(vgi_kdtree *t)
{
    uint64_t leaves = (uint64_t)1 << t->depth;
    for (uint64_t i = leaves; i < 2 * leaves; i++) {
        size_t begin, end;
        node_range(t, i, t->depth, &begin, &end);
        struct node *node = &t->node[i];
        node->lowest = t->point[begin].index;
        node->label = t->point[begin].label;
        for (size_t k = begin + 1; k < end; k++) {
            if (t->point[k].index < node->lowest) node->lowest = t->point[k].index;
            if (t->point[k].label != node->label) node->label = MIXED;
        }
    }
    for (uint64_t i = leaves - 1; i > 0; i--) {
        const struct node *a = &t->node[2 * i], *b = a + 1;
        t->node[i].lowest = a->lowest < b->lowest ? a->lowest : b->lowest;
        t->node[i].label = a->label == b->label ? a->label : MIXED;
    }
}

int vgi_kdtree_new(vgi_kdtree **out, const double *points, size_t n, vg_err *e)
{
    vgi_kdtree *t = *out = vgi_array(1, sizeof *t, e);
    if (!t) return VG_ENOMEM;
    t->n = n;
    while (n >> t->depth > LEAF) t->depth++; /* leaves then hold up to LEAF + 1 points, and none is empty */
    t->point = vgi_array_raw(n, sizeof *t->point, e);
    t->node = vgi_array_raw((size_t)2 << t->depth, sizeof *t->node, e);
    if (!t->point || !t->node) return vgi_kdtree_free(out), VG_ENOMEM;
    for (size_t i = 0; i < n; i++)
        t->point[i] = (struct point){{points[3 * i], points[3 * i + 1], points[3 * i + 2]}, (uint32_t)i, 0};
    if (n) {
        build(t);
        summarise(t);
    }
    return VG_OK;
}

void vgi_kdtree_free(vgi_kdtree **t)
{
    if (!*t) return;
    free((*t)->point);
    free((*t)->node);
    free(*t);
    *t = NULL;
}

void vgi_kdtree_label(vgi_kdtree *t, const uint32_t *label)
{
    for (size_t i = 0; i < t->n; i++) t->point[i].label = label[t->point[i].index];
    if (t->n) summarise(t);
}

/* ---- search ---- */

struct query {
    double p[3];
    uint64_t not_label; /* or ANY */
    size_t k;
    vgi_near *near; /* the k nearest so far; free entries have the limit as distance and index NONE */
};

/* The only function that sums a squared distance, always in this order. So rounding is monotone, a box is never
 * farther than a point inside it, and a pair of points has the same distance in both directions. */
static inline double square_sum(double x, double y, double z)
{
    return x * x + y * y + z * z;
}

static inline double outside(double least, double most, double x)
{
    return x < least ? least - x : x > most ? x - most : 0;
}

static double box_square(const struct node *node, const double p[3])
{
    return square_sum(outside(node->least[0], node->most[0], p[0]), outside(node->least[1], node->most[1], p[1]),
                      outside(node->least[2], node->most[2], p[2]));
}

static inline bool nearer(double square, uint32_t index, const vgi_near *than)
{
    return square < than->square || (square == than->square && index < than->index);
}

static void keep_nearest(struct query *q, double square, uint32_t index)
{
    size_t i = q->k - 1;
    for (; i > 0 && nearer(square, index, &q->near[i - 1]); i--) q->near[i] = q->near[i - 1];
    q->near[i] = (vgi_near){index, square};
}

static void search_leaf(const vgi_kdtree *t, uint64_t node, struct query *q)
{
    size_t begin, end;
    node_range(t, node, t->depth, &begin, &end);
    for (const struct point *a = t->point + begin; a < t->point + end; a++) {
        if (a->label == q->not_label) continue;
        double square = square_sum(a->x[0] - q->p[0], a->x[1] - q->p[1], a->x[2] - q->p[2]);
        if (nearer(square, a->index, &q->near[q->k - 1])) keep_nearest(q, square, a->index);
    }
}

/* Whether no point of this node can improve the result. */
static inline bool hopeless(const struct node *node, double square, const struct query *q)
{
    return node->label == q->not_label || !nearer(square, node->lowest, &q->near[q->k - 1]);
}

static size_t search(const vgi_kdtree *t, struct query *q, double limit)
{
    for (size_t i = 0; i < q->k; i++) q->near[i] = (vgi_near){NONE, limit};
    if (t->n == 0 || q->k == 0) return 0;
    struct place stack[DEEPEST + 2] = {{1, 0, box_square(&t->node[1], q->p)}};
    for (int top = 1; top > 0;) {
        struct place at = stack[--top];
        if (hopeless(&t->node[at.node], at.square, q)) continue;
        if (at.depth == t->depth) {
            search_leaf(t, at.node, q);
            continue;
        }
        const struct node *child = &t->node[2 * at.node];
        double a = box_square(child, q->p), b = box_square(child + 1, q->p);
        /* push the more promising child last */
        int first = b < a || (b == a && child[1].lowest < child[0].lowest);
        stack[top++] = (struct place){2 * at.node + !first, at.depth + 1, first ? a : b};
        stack[top++] = (struct place){2 * at.node + first, at.depth + 1, first ? b : a};
    }
    size_t found = 0;
    while (found < q->k && q->near[found].index != NONE) found++;
    return found;
}

size_t vgi_kdtree_nearest(const vgi_kdtree *t, const double p[3], double limit, size_t k, vgi_near *near)
{
    struct query q = {{p[0], p[1], p[2]}, ANY, k, near};
    return search(t, &q, limit);
}

bool vgi_kdtree_nearest_other(const vgi_kdtree *t, const double p[3], uint32_t label, double limit, vgi_near *near)
{
    struct query q = {{p[0], p[1], p[2]}, label, 1, near};
    return search(t, &q, limit) == 1;
}
