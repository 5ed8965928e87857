/* fronts.c: Cholesky factors of many principal submatrices of one matrix, by the multifrontal method (Duff and Reid
 * 1983) on the supernodes of a CHOLMOD factor.
 *
 * A supernode is eliminated in a dense front: its entries of the matrix plus the updates (remainders) of its
 * children's fronts. A held row is left out of all fronts. This changes numbers only in the supernode of the row and
 * its ancestors. Blocks of all other supernodes are those of CHOLMOD, and their updates are computed once for all
 * sets of held rows. Where only rows below a block are held, they are dropped from a copy.
 *
 * The border is a separate supernode, the last, and a row of every front above a row in which it has an entry. Blocks
 * and updates of these fronts include it and are also shared. The border's own block is not, because without held
 * rows it may be singular.
 *
 * Updates of one set are on a stack, because supernodes are in postorder. Dense arithmetic is in fronts_kernel.c,
 * triangular solves in solve_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/fronts.h"
#include "numeric/fronts_kernel.h"

#include <stdlib.h>

#define NONE UINT32_MAX
enum { MOST_SHARED = 16 << 20 }; /* numbers in shared blocks and updates; above this nothing is shared */

struct vgi_fronts {
    vgi_factor base; /* from CHOLMOD, borrowed */
    vgi_factor f;    /* with the border, without blocks */
    int *super, *pi, *rows; /* of f */
    int *parent;     /* per supernode; -1: root */
    int *child, *next; /* per supernode: its last child, its sibling before; -1: none */
    size_t most_rows;  /* of a front */
    int *start, *at; /* the lower triangle by columns, in the order of f */
    double *value;
    double *shared;  /* updates, and blocks with the border; NULL: none */
    const double **block, **update; /* per supernode; NULL: not shared */
};

typedef struct front {
    size_t rows, columns; /* numbers of rows and columns that are not held */
    bool changed;         /* its numbers differ from the shared ones */
} front;

/* One set of held rows. */
typedef struct elimination {
    const vgi_fronts *b;
    const bool *held; /* per row of f; NULL: none held, blocks and updates are to be shared */
    front *front;     /* per supernode */
    uint32_t *place;  /* per row of f: its position in the current front, or NONE */
    double *stack;
    const double **update; /* per supernode */
    uint32_t *at, *to, *run; /* rows of a child's update, their positions in the current front, runs of them */
} elimination;

static size_t rows_of(const vgi_factor *f, size_t s)
{
    return (size_t)(f->pi[s + 1] - f->pi[s]);
}

static size_t columns_of(const vgi_factor *f, size_t s)
{
    return (size_t)(f->super[s + 1] - f->super[s]);
}

static bool is_held(const elimination *x, int row)
{
    return x->held && x->held[row];
}

/* ---- supernodes, with the border ---- */

static int find_parents(const vgi_factor *f, int *parent, vg_err *e)
{
    int *owner = vgi_array_raw(f->n, sizeof *owner, e);
    if (!owner) return VG_ENOMEM;
    for (size_t s = 0; s < f->supernodes; s++)
        for (int j = f->super[s]; j < f->super[s + 1]; j++) owner[j] = (int)s;
    for (size_t s = 0; s < f->supernodes; s++)
        parent[s] = rows_of(f, s) > columns_of(f, s) ? owner[f->rows[(size_t)f->pi[s] + columns_of(f, s)]] : -1;
    free(owner);
    return VG_OK;
}

/* Mark the rows, in the factor's order, in which the border has entries. */
static int mark_entries(const vgi_cholesky *c, const vgi_border *border, bool *entry, vg_err *e)
{
    size_t n = vgi_cholesky_factor(c).n;
    const int *order = vgi_cholesky_order(c);
    bool *of_matrix = vgi_array(n, sizeof *of_matrix, e);
    if (!of_matrix) return VG_ENOMEM;
    for (size_t i = 0; i < border->n; i++) of_matrix[border->row[i]] = true;
    for (size_t i = 0; i < n; i++) entry[i] = of_matrix[order[i]];
    free(of_matrix);
    return VG_OK;
}

/* Mark the supernodes of base that get the border as their last row. */
static int mark_bordered(vgi_fronts *b, const vgi_cholesky *c, const vgi_border *border, bool *bordered, vg_err *e)
{
    bool *entry = vgi_array(b->base.n, sizeof *entry, e);
    int *parent = vgi_array_raw(b->base.supernodes, sizeof *parent, e);
    int r = entry && parent ? mark_entries(c, border, entry, e) : VG_ENOMEM;
    if (r == VG_OK) r = find_parents(&b->base, parent, e);
    for (size_t s = 0; r == VG_OK && s < b->base.supernodes; s++) {
        for (int j = b->base.super[s]; j < b->base.super[s + 1]; j++) bordered[s] |= entry[j];
        if (bordered[s] && parent[s] >= 0) bordered[parent[s]] = true;
    }
    free(entry);
    free(parent);
    return r;
}

static int make_supernodes(vgi_fronts *b, const vgi_cholesky *c, const vgi_border *border, vg_err *e)
{
    const vgi_factor *base = &b->base;
    size_t n = base->supernodes, all = n + (border != NULL), nrows = 0;
    bool *bordered = vgi_array(n, sizeof *bordered, e);
    b->super = vgi_array(all + 1, sizeof *b->super, e);
    b->pi = vgi_array(all + 1, sizeof *b->pi, e);
    b->rows = vgi_array_raw((n ? (size_t)base->pi[n] : 0) + all, sizeof *b->rows, e);
    int r = bordered && b->super && b->pi && b->rows ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && border) r = mark_bordered(b, c, border, bordered, e);
    for (size_t s = 0; r == VG_OK && s < all; s++) {
        for (int i = s < n ? base->pi[s] : 0; s < n && i < base->pi[s + 1]; i++) b->rows[nrows++] = base->rows[i];
        if (s == n || bordered[s]) b->rows[nrows++] = (int)base->n;
        b->super[s + 1] = s < n ? base->super[s + 1] : (int)base->n + 1;
        b->pi[s + 1] = (int)nrows;
    }
    b->f = (vgi_factor){base->n + (border != NULL), all, b->super, b->pi, b->rows, NULL};
    free(bordered);
    return r;
}

static int make_tree(vgi_fronts *b, vg_err *e)
{
    size_t n = b->f.supernodes;
    b->parent = vgi_array_raw(n, sizeof *b->parent, e);
    b->child = vgi_array_raw(n, sizeof *b->child, e);
    b->next = vgi_array_raw(n, sizeof *b->next, e);
    b->block = vgi_array(n, sizeof *b->block, e);
    b->update = vgi_array(n, sizeof *b->update, e);
    if (!b->parent || !b->child || !b->next || !b->block || !b->update) return VG_ENOMEM;
    if (find_parents(&b->f, b->parent, e) < 0) return VG_ENOMEM;
    for (size_t s = 0; s < n; s++) b->child[s] = b->next[s] = -1;
    for (size_t s = 0; s < n; s++) {
        if (rows_of(&b->f, s) > b->most_rows) b->most_rows = rows_of(&b->f, s);
        if (b->parent[s] < 0) continue;
        b->next[s] = b->child[b->parent[s]];
        b->child[b->parent[s]] = (int)s;
    }
    return VG_OK;
}

/* ---- the matrix ---- */

static void count_entry(int *next, uint32_t p, uint32_t q)
{
    next[(p < q ? p : q) + 1]++;
}

static void put_entry(vgi_fronts *b, int *next, uint32_t p, uint32_t q, double value)
{
    int to = next[p < q ? p : q]++;
    b->at[to] = (int)(p < q ? q : p);
    b->value[to] = value;
}

/* new: per row of a, its row in f. */
static void copy_entries(vgi_fronts *b, const vgi_sparse *a, const vgi_border *border, const uint32_t *new)
{
    size_t last = a->n;
    int *next = b->start + 1; /* moved to the start of the next column below */
    for (size_t j = 0; j < a->n; j++)
        for (int k = a->start[j]; k < a->start[j + 1]; k++) count_entry(next, new[j], new[a->row[k]]);
    for (size_t i = 0; border && i < border->n; i++) count_entry(next, new[border->row[i]], (uint32_t)last);
    if (border) next[last + 1]++;
    for (size_t j = 0; j < b->f.n; j++) next[j + 1] += next[j];
    for (size_t j = 0; j < a->n; j++)
        for (int k = a->start[j]; k < a->start[j + 1]; k++) put_entry(b, next, new[j], new[a->row[k]], a->value[k]);
    for (size_t i = 0; border && i < border->n; i++)
        put_entry(b, next, new[border->row[i]], (uint32_t)last, border->value[i]);
    if (border) put_entry(b, next, (uint32_t)last, (uint32_t)last, border->diagonal);
}

static int permute_matrix(vgi_fronts *b, const vgi_sparse *a, const vgi_cholesky *c, const vgi_border *border, vg_err *e)
{
    const int *order = vgi_cholesky_order(c);
    size_t entries = (size_t)a->start[a->n] + (border ? border->n + 1 : 0);
    uint32_t *new = vgi_array_raw(a->n, sizeof *new, e);
    b->start = vgi_array(b->f.n + 2, sizeof *b->start, e);
    b->at = vgi_array_raw(entries, sizeof *b->at, e);
    b->value = vgi_array_raw(entries, sizeof *b->value, e);
    int r = new && b->start && b->at && b->value ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < a->n; i++) new[order[i]] = (uint32_t)i;
    if (r == VG_OK) copy_entries(b, a, border, new);
    free(new);
    return r;
}

/* ---- shared data: layout ---- */

/* Whether CHOLMOD's elimination of front s is valid. */
static bool is_of_base(const vgi_fronts *b, size_t s)
{
    return s < b->base.supernodes && rows_of(&b->f, s) == rows_of(&b->base, s);
}

/* Number of values in blocks that are not CHOLMOD's, and in updates. */
static size_t count_shared(const vgi_fronts *b)
{
    size_t n = 0;
    for (size_t s = 0; s < b->base.supernodes; s++) {
        size_t rows = rows_of(&b->f, s), columns = columns_of(&b->f, s), left = rows - columns;
        n += left * left + (is_of_base(b, s) ? 0 : rows * columns);
    }
    return n;
}

static void place_shared(vgi_fronts *b)
{
    double *at = b->shared;
    for (size_t s = 0; s < b->base.supernodes; s++) {
        size_t rows = rows_of(&b->f, s), columns = columns_of(&b->f, s), left = rows - columns;
        b->block[s] = is_of_base(b, s) ? b->base.block[s] : at;
        at += is_of_base(b, s) ? 0 : rows * columns;
        b->update[s] = at, at += left * left;
    }
}

/* ---- assembly and elimination ---- */

/* Assign positions to the rows of front s that are not held. */
static void open_front(const elimination *x, size_t s)
{
    const vgi_factor *f = &x->b->f;
    uint32_t n = 0;
    for (int i = f->pi[s]; i < f->pi[s + 1]; i++)
        if (!is_held(x, f->rows[i])) x->place[f->rows[i]] = n++;
}

static void close_front(const elimination *x, size_t s)
{
    const vgi_factor *f = &x->b->f;
    for (int i = f->pi[s]; i < f->pi[s + 1]; i++) x->place[f->rows[i]] = NONE;
}

static void add_matrix(const elimination *x, size_t s, double *l)
{
    const vgi_fronts *b = x->b;
    size_t rows = x->front[s].rows;
    for (int j = b->f.super[s]; j < b->f.super[s + 1]; j++) {
        if (is_held(x, j)) continue;
        double *column = l + x->place[j] * rows;
        for (int k = b->start[j]; k < b->start[j + 1]; k++)
            if (x->place[b->at[k]] != NONE) column[x->place[b->at[k]]] += b->value[k];
    }
}

/* Add the update of child s to the current front with m rows and c columns; l NULL: to u alone. A shared update still
 * contains held rows. */
static void add_update(const elimination *x, size_t s, size_t m, size_t c, double *l, double *u)
{
    const vgi_factor *f = &x->b->f;
    const int *rows = f->rows + f->pi[s];
    uint32_t n = 0, ld = 0;
    for (size_t i = columns_of(f, s); i < rows_of(f, s); i++) {
        bool gone = is_held(x, rows[i]);
        if (!gone) x->at[n] = ld, x->to[n++] = x->place[rows[i]];
        ld += !gone || !x->front[s].changed;
    }
    vgi_fronts_kernel_now()->scatter(n, x->at, x->to, x->run, ld, x->update[s], m, c, l, u);
}

/* Eliminate front s; l and u receive its block and its update. */
static int eliminate_front(const elimination *x, size_t s, double *l, double *u, vg_err *e)
{
    size_t m = x->front[s].rows, c = x->front[s].columns, left = m - c;
    memset(l, 0, m * c * sizeof *l);
    memset(u, 0, left * left * sizeof *u);
    open_front(x, s);
    add_matrix(x, s, l);
    for (int k = x->b->child[s]; k >= 0; k = x->b->next[k]) add_update(x, (size_t)k, m, c, l, u);
    close_front(x, s);
    size_t done = vgi_fronts_kernel_now()->eliminate(m, c, l, u);
    if (done == c) return VG_OK;
    return vg_fail(e, VG_EINPUT, "cannot factorize: not positive definite at row %zu", (size_t)x->b->f.super[s] + done);
}

/* The update of front s, whose block is known. */
static void find_update(const elimination *x, size_t s, double *u)
{
    size_t m = x->front[s].rows, c = x->front[s].columns, left = m - c;
    memset(u, 0, left * left * sizeof *u);
    open_front(x, s);
    for (int k = x->b->child[s]; k >= 0; k = x->b->next[k]) add_update(x, (size_t)k, m, c, NULL, u);
    close_front(x, s);
    vgi_fronts_kernel_now()->complete(m, c, x->b->block[s], u);
}

static int make_elimination(elimination *x, const vgi_fronts *b, vg_err *e)
{
    *x = (elimination){.b = b};
    x->front = vgi_array(b->f.supernodes, sizeof *x->front, e);
    x->place = vgi_array_raw(b->f.n, sizeof *x->place, e);
    x->at = vgi_array_raw(3 * b->most_rows, sizeof *x->at, e);
    x->update = vgi_copy_array(b->update, b->f.supernodes, sizeof *x->update, e);
    if (!x->front || !x->place || !x->at || !x->update) return VG_ENOMEM;
    x->to = x->at + b->most_rows, x->run = x->to + b->most_rows;
    for (size_t i = 0; i < b->f.n; i++) x->place[i] = NONE;
    return VG_OK;
}

static void clear_elimination(elimination *x)
{
    free(x->front);
    free(x->place);
    free(x->at);
    free(x->update);
    free(x->stack);
}

/* ---- shared data: numbers ---- */

static int compute_shared(vgi_fronts *b, vg_err *e)
{
    elimination x;
    size_t n = count_shared(b);
    if (n > MOST_SHARED) return VG_OK;
    int r = make_elimination(&x, b, e);
    if (r == VG_OK && !(b->shared = vgi_array_raw(n, sizeof *b->shared, e))) r = VG_ENOMEM;
    if (r == VG_OK) {
        place_shared(b);
        memcpy(x.update, b->update, b->f.supernodes * sizeof *x.update);
    }
    for (size_t s = 0; r == VG_OK && s < b->base.supernodes; s++) {
        x.front[s] = (front){.rows = rows_of(&b->f, s), .columns = columns_of(&b->f, s)};
        if (is_of_base(b, s)) find_update(&x, s, (double *)b->update[s]);
        else r = eliminate_front(&x, s, (double *)b->block[s], (double *)b->update[s], e);
    }
    clear_elimination(&x);
    return r;
}

int vgi_fronts_new(vgi_fronts **out, const vgi_sparse *a, const vgi_cholesky *c, const vgi_border *border, vg_err *e)
{
    vgi_fronts *b = *out = vgi_array(1, sizeof *b, e);
    if (!b) return VG_ENOMEM;
    b->base = vgi_cholesky_factor(c);
    int r = make_supernodes(b, c, border, e);
    if (r == VG_OK) r = make_tree(b, e);
    if (r == VG_OK) r = permute_matrix(b, a, c, border, e);
    if (r == VG_OK) r = compute_shared(b, e);
    if (r < 0) vgi_fronts_free(out);
    return r;
}

void vgi_fronts_free(vgi_fronts **out)
{
    vgi_fronts *b = *out;
    if (!b) return;
    free(b->super);
    free(b->pi);
    free(b->rows);
    free(b->parent);
    free(b->child);
    free(b->next);
    free(b->start);
    free(b->at);
    free(b->value);
    free(b->shared);
    free(b->block);
    free(b->update);
    free(b);
    *out = NULL;
}

/* ---- one set of held rows ---- */

static bool is_copied(const elimination *x, size_t s)
{
    return x->front[s].changed || x->front[s].rows < rows_of(&x->b->f, s);
}

static void measure_fronts(elimination *x)
{
    const vgi_factor *f = &x->b->f;
    for (size_t s = 0; s < f->supernodes; s++) {
        front *t = &x->front[s];
        for (int i = f->pi[s]; i < f->pi[s + 1]; i++) t->rows += !is_held(x, f->rows[i]);
        for (int j = f->super[s]; j < f->super[s + 1]; j++) t->columns += !is_held(x, j);
        t->changed |= !x->b->block[s] || t->columns < columns_of(f, s);
        if (t->changed && x->b->parent[s] >= 0) x->front[x->b->parent[s]].changed = true;
    }
}

/* Number of values on the stack that front s takes from its children. */
static size_t count_taken(const elimination *x, size_t s)
{
    size_t n = 0;
    for (int k = x->b->child[s]; k >= 0; k = x->b->next[k]) {
        size_t left = x->front[k].rows - x->front[k].columns;
        n += x->front[k].changed ? left * left : 0;
    }
    return n;
}

static int make_stack(elimination *x, vg_err *e)
{
    size_t top = 0, most = 0;
    for (size_t s = 0; s < x->b->f.supernodes; s++) {
        size_t left = x->front[s].rows - x->front[s].columns;
        if (!x->front[s].changed) continue;
        if (top + left * left > most) most = top + left * left;
        top += left * left - count_taken(x, s);
    }
    x->stack = vgi_array_raw(most, sizeof *x->stack, e);
    return x->stack ? VG_OK : VG_ENOMEM;
}

static int make_factor(const elimination *x, vgi_held_factor *out, vg_err *e)
{
    const vgi_factor *f = &x->b->f;
    size_t rows = 0, values = 0, n = 0;
    for (size_t s = 0; s < f->supernodes; s++) {
        const front *t = &x->front[s];
        if (!t->columns) continue;
        n++, rows += t->rows, out->entries += t->rows * t->columns;
        values += is_copied(x, s) ? t->rows * t->columns : 0;
    }
    out->super = vgi_array(n + 1, sizeof *out->super, e);
    out->pi = vgi_array(n + 1, sizeof *out->pi, e);
    out->rows = vgi_array_raw(rows, sizeof *out->rows, e);
    out->block = vgi_array(n, sizeof *out->block, e);
    out->values = vgi_array_raw(values, sizeof *out->values, e);
    if (!out->super || !out->pi || !out->rows || !out->block || !out->values) return VG_ENOMEM;
    double *at = out->values;
    size_t u = 0, nrows = 0;
    for (size_t s = 0; s < f->supernodes; s++) {
        const front *t = &x->front[s];
        if (!t->columns) continue;
        for (int i = f->pi[s]; i < f->pi[s + 1]; i++)
            if (!is_held(x, f->rows[i])) out->rows[nrows++] = (int)out->row[f->rows[i]];
        out->block[u] = is_copied(x, s) ? at : x->b->block[s];
        at += is_copied(x, s) ? t->rows * t->columns : 0;
        out->super[u + 1] = out->super[u] + (int)t->columns;
        out->pi[++u] = (int)nrows;
    }
    out->factor = (vgi_factor){(size_t)out->super[n], n, out->super, out->pi, out->rows, out->block};
    return VG_OK;
}

/* Copy a shared block without the held rows below its head. */
static void drop_rows(const elimination *x, size_t s, double *to)
{
    const vgi_factor *f = &x->b->f;
    const double *from = x->b->block[s];
    size_t rows = rows_of(f, s);
    for (size_t j = 0; j < columns_of(f, s); j++, from += rows)
        for (size_t i = 0; i < rows; i++)
            if (!is_held(x, f->rows[(size_t)f->pi[s] + i])) *to++ = from[i];
}

static int factorize_held(elimination *x, const vgi_held_factor *out, vg_err *e)
{
    double *at = out->values, *top = x->stack;
    int r = VG_OK;
    for (size_t s = 0; r == VG_OK && s < x->b->f.supernodes; s++) {
        const front *t = &x->front[s];
        size_t left = t->rows - t->columns;
        if (t->changed) {
            double *u = top;
            r = eliminate_front(x, s, at, u, e);
            top -= count_taken(x, s);
            memmove(top, u, left * left * sizeof *u);
            x->update[s] = top;
            top += left * left;
        } else if (is_copied(x, s)) {
            drop_rows(x, s, at);
        }
        if (is_copied(x, s)) at += t->rows * t->columns;
    }
    return r;
}

int vgi_fronts_hold(const vgi_fronts *b, const bool *held, vgi_held_factor *out, vg_err *e)
{
    elimination x;
    size_t n = b->f.n;
    *out = (vgi_held_factor){0};
    uint32_t free_rows = 0;
    out->row = vgi_array_raw(n, sizeof *out->row, e);
    int r = make_elimination(&x, b, e);
    if (!out->row) r = VG_ENOMEM;
    if (r == VG_OK) {
        for (size_t i = 0; i < n; i++) out->row[i] = held[i] ? NONE : free_rows++;
        x.held = held;
        measure_fronts(&x);
        r = make_stack(&x, e);
    }
    if (r == VG_OK) r = make_factor(&x, out, e);
    if (r == VG_OK) r = factorize_held(&x, out, e);
    clear_elimination(&x);
    if (r < 0) vgi_held_factor_clear(out);
    return r;
}

void vgi_held_factor_clear(vgi_held_factor *h)
{
    free(h->row);
    free(h->super);
    free(h->pi);
    free(h->rows);
    free(h->block);
    free(h->values);
    *h = (vgi_held_factor){0};
}
