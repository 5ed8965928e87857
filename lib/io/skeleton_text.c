/* skeleton_text.c: skeletons as people write them, a bone per line: "BONE PARENT HEAD_X HEAD_Y HEAD_Z TAIL_X TAIL_Y TAIL_Z",
 * and joints as groups of mesh vertices: "JOINT PARENT vertices VERTEX VERTEX ...".
 * Leaves out motion (joints_text.c, bvh.c) and where the groups are (who has the mesh knows).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;
static const char groups_word[] = "vertices";

enum { BONE_FIELDS = 8, FIRST_NUMBER = 2 };

/* A line of either kind: a name, that of its parent, and where it was said. */
typedef struct entry {
    char *name, *above; /* above NULL: a root */
    size_t line;
    uint32_t parent;    /* number of the entry; NONE: a root */
    double head[3], tail[3];
    size_t nvertices;
    uint32_t *vertices;
} entry;

typedef struct entries {
    size_t n, cap;
    entry *at;
    uint32_t *order; /* entries, parents before children: each is followed by all below it */
} entries;

static void clear_entries(entries *s)
{
    for (size_t i = 0; i < s->n; i++) {
        free(s->at[i].name);
        free(s->at[i].above);
        free(s->at[i].vertices);
    }
    free(s->at);
    free(s->order);
    *s = (entries){0};
}

/* ---- who is below whom ---- */

static int compare_names(const void *a, const void *b)
{
    const entry *const *x = a, *const *y = b;
    int order = strcmp((*x)->name, (*y)->name);
    return order ? order : ((*x)->line > (*y)->line) - ((*x)->line < (*y)->line);
}

static const entry *find_name(const entry *const *sorted, size_t n, const char *name)
{
    size_t low = 0, high = n;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (strcmp(sorted[middle]->name, name) < 0) low = middle + 1;
        else high = middle;
    }
    return low < n && !strcmp(sorted[low]->name, name) ? sorted[low] : NULL;
}

static int find_parents(entries *s, const char *subject, vg_err *e)
{
    const entry **sorted = vgi_array_raw(s->n, sizeof *sorted, e);
    if (!sorted) return VG_ENOMEM;
    for (size_t i = 0; i < s->n; i++) sorted[i] = &s->at[i];
    qsort(sorted, s->n, sizeof *sorted, compare_names);
    int r = VG_OK;
    for (size_t i = 1; r == VG_OK && i < s->n; i++)
        if (!strcmp(sorted[i]->name, sorted[i - 1]->name))
            r = vg_fail(e, VG_EINPUT, "%s line %zu: '%.80s' is there already, in line %zu", subject, sorted[i]->line,
                        sorted[i]->name, sorted[i - 1]->line);
    for (size_t i = 0; r == VG_OK && i < s->n; i++) {
        entry *b = &s->at[i];
        const entry *above = b->above ? find_name(sorted, s->n, b->above) : NULL;
        b->parent = above ? (uint32_t)(above - s->at) : NONE;
        if (b->above && !above)
            r = vg_fail(e, VG_EINPUT, "%s line %zu: '%.80s' hangs on '%.80s', which is not there ('-' for none)", subject, b->line,
                        b->name, b->above);
    }
    free(sorted);
    return r;
}

/* Down from the roots, in the order of the file. Who is not met hangs on itself. */
static int order_entries(entries *s, const char *subject, vg_err *e)
{
    size_t n = s->n, met = 0;
    uint32_t *first = vgi_array_raw(n + 1, sizeof *first, e), *next = vgi_array_raw(n, sizeof *next, e);
    s->order = vgi_array_raw(n, sizeof *s->order, e);
    int r = first && next && s->order ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        memset(first, 0xff, (n + 1) * sizeof *first);
        for (size_t i = n; i-- > 0;) {
            uint32_t *list = &first[s->at[i].parent == NONE ? n : s->at[i].parent];
            next[i] = *list;
            *list = (uint32_t)i;
        }
        for (uint32_t i = first[n]; i != NONE;) {
            s->order[met++] = i;
            if (first[i] != NONE) {
                i = first[i];
                continue;
            }
            while (i != NONE && next[i] == NONE) i = s->at[i].parent;
            if (i != NONE) i = next[i];
        }
    }
    free(first);
    free(next);
    if (r == VG_OK && met < n) r = vg_fail(e, VG_EINPUT, "%s has joints that hang on themselves, round in a circle", subject);
    return r;
}

/* ---- lines ---- */

static bool says_group(const vgi_line *l)
{
    return l->n > 2 && vgi_field_is(&l->at[2], groups_word);
}

static int take_names(const vgi_lines *t, const vgi_line *l, entry *b, vg_err *e)
{
    b->line = l->number;
    int r = vgi_line_name(t, l, 0, &b->name, e);
    if (r < 0 || vgi_field_is(&l->at[1], "-")) return r;
    return vgi_line_name(t, l, 1, &b->above, e);
}

static int take_bone(const vgi_lines *t, const vgi_line *l, entry *b, vg_err *e)
{
    if (says_group(l))
        return vg_fail(e, VG_EINPUT, "%s line %zu names the vertices of a mesh for a joint: it is for vg-fitmap --groups", t->subject,
                       l->number);
    if (l->n != BONE_FIELDS)
        return vg_fail(e, VG_EINPUT, "%s line %zu: a bone is 'BONE PARENT HEAD_X HEAD_Y HEAD_Z TAIL_X TAIL_Y TAIL_Z'", t->subject,
                       l->number);
    int r = take_names(t, l, b, e);
    for (size_t k = 0; r == VG_OK && k < 3; k++) r = vgi_line_number(t, l, FIRST_NUMBER + k, &b->head[k], e);
    for (size_t k = 0; r == VG_OK && k < 3; k++) r = vgi_line_number(t, l, FIRST_NUMBER + 3 + k, &b->tail[k], e);
    return r;
}

static int compare_vertices(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static int check_once(const vgi_lines *t, const entry *b, vg_err *e)
{
    uint32_t *sorted = vgi_copy_array(b->vertices, b->nvertices, sizeof *sorted, e);
    if (!sorted) return VG_ENOMEM;
    qsort(sorted, b->nvertices, sizeof *sorted, compare_vertices);
    int r = VG_OK;
    for (size_t i = 1; r == VG_OK && i < b->nvertices; i++)
        if (sorted[i] == sorted[i - 1])
            r = vg_fail(e, VG_EINPUT, "%s line %zu: joint '%.80s' has a vertex twice", t->subject, b->line, b->name);
    free(sorted);
    return r;
}

static int take_group(const vgi_lines *t, const vgi_line *l, int base, entry *b, vg_err *e)
{
    if (l->n < 4 || !says_group(l))
        return vg_fail(e, VG_EINPUT, "%s line %zu: a joint is 'JOINT PARENT vertices VERTEX VERTEX ...'", t->subject, l->number);
    int r = take_names(t, l, b, e);
    vgi_field f;
    size_t cap = 0;
    for (const char *p = l->at[2].end; r == VG_OK && vgi_line_more(l, &p, &f);) {
        r = vgi_grow(&b->vertices, &cap, b->nvertices + 1, sizeof *b->vertices, e);
        if (r == VG_OK) r = vgi_field_vertex(t, l, &f, base, &b->vertices[b->nvertices], e);
        if (r == VG_OK) b->nvertices++;
    }
    return r < 0 ? r : check_once(t, b, e);
}

/* All lines, in the order of the file, and their order as joints. groups: of the second kind, with this base; else base is -1. */
static int take_entries(entries *s, vgi_lines *t, int base, vg_err *e)
{
    vgi_line l;
    int r = VG_OK;
    while (r == VG_OK && vgi_lines_next(t, &l)) {
        if ((r = vgi_grow(&s->at, &s->cap, s->n + 1, sizeof *s->at, e)) < 0) break;
        entry *b = &s->at[s->n++]; /* counted at once, so that clearing frees it in any case */
        *b = (entry){0};
        r = base < 0 ? take_bone(t, &l, b, e) : take_group(t, &l, base, b, e);
        if (r == VG_OK && s->n >= UINT32_MAX / 4) r = vg_fail(e, VG_EINPUT, "%s has too many joints", t->subject);
    }
    if (r == VG_OK && s->n == 0) r = vg_fail(e, VG_EINPUT, "%s names no joint", t->subject);
    if (r == VG_OK) r = find_parents(s, t->subject, e);
    return r < 0 ? r : order_entries(s, t->subject, e);
}

/* ---- groups of vertices ---- */

void vg_joint_groups_clear(vg_joint_groups *g)
{
    for (size_t i = 0; i < g->n; i++) {
        free(g->at[i].name);
        free(g->at[i].vertices);
    }
    free(g->at);
    *g = (vg_joint_groups){0};
}

int vg_joint_groups_read(vg_joint_groups *g, const void *data, size_t n, int base, const char *name, vg_err *e)
{
    char subject[VGI_SUBJECT];
    vgi_lines t = vgi_lines_of(data, n, vgi_quote(name, subject));
    entries s = {0};
    *g = (vg_joint_groups){0};
    int r = take_entries(&s, &t, base, e);
    uint32_t *place = r == VG_OK ? vgi_array_raw(s.n, sizeof *place, e) : NULL;
    if (place && (g->at = vgi_array(s.n, sizeof *g->at, e))) {
        for (; g->n < s.n; g->n++) {
            entry *b = &s.at[s.order[g->n]];
            place[s.order[g->n]] = (uint32_t)g->n;
            g->at[g->n] = (vg_joint_group){.name = b->name, .parent = b->parent == NONE ? NONE : place[b->parent],
                                           .nvertices = b->nvertices, .vertices = b->vertices, .line = b->line};
            b->name = NULL, b->vertices = NULL;
        }
    } else if (r == VG_OK) {
        r = VG_ENOMEM;
    }
    free(place);
    clear_entries(&s);
    return r;
}
