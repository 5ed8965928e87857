/* skeleton_text.c: skeletons as text, one bone per line: "BONE PARENT HEAD_X HEAD_Y HEAD_Z TAIL_X TAIL_Y TAIL_Z"; and
 * joints as groups of mesh vertices: "JOINT PARENT vertices VERTEX VERTEX ...". Motion is in joints_text.c and bvh.c,
 * the positions of groups in model/groups.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "numeric/stats.h"

#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;
static const char groups_word[] = "vertices";
static const char end_suffix[] = ".end";

enum { BONE_FIELDS = 8, FIRST_NUMBER = 2 };

/* A line of either kind: the name, its parent's name, and the line number. */
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

/* ---- hierarchy ---- */

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
            r = vg_fail(e, VG_EINPUT, "%s line %zu: '%.80s' is already defined, in line %zu", subject, sorted[i]->line,
                        sorted[i]->name, sorted[i - 1]->line);
    for (size_t i = 0; r == VG_OK && i < s->n; i++) {
        entry *b = &s->at[i];
        const entry *above = b->above ? find_name(sorted, s->n, b->above) : NULL;
        b->parent = above ? (uint32_t)(above - s->at) : NONE;
        if (b->above && !above)
            r = vg_fail(e, VG_EINPUT, "%s line %zu: the parent '%.80s' of '%.80s' is not defined ('-' for none)",
                        subject, b->line, b->above, b->name);
    }
    free(sorted);
    return r;
}

/* Depth first from the roots, in file order. Entries that are not reached are part of a cycle. */
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
    if (r == VG_OK && met < n)
        r = vg_fail(e, VG_EINPUT, "%s has a cycle of joints", subject);
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
        return vg_fail(e, VG_EINPUT,
                       "%s line %zu names the vertices of a mesh for a joint: it is for vg-fitmap --groups",
                       t->subject, l->number);
    if (l->n != BONE_FIELDS)
        return vg_fail(e, VG_EINPUT, "%s line %zu: a bone is 'BONE PARENT HEAD_X HEAD_Y HEAD_Z TAIL_X TAIL_Y TAIL_Z'",
                       t->subject, l->number);
    int r = take_names(t, l, b, e);
    for (size_t k = 0; r == VG_OK && k < 3; k++) r = vgi_line_number(t, l, FIRST_NUMBER + k, &b->head[k], e);
    for (size_t k = 0; r == VG_OK && k < 3; k++) r = vgi_line_number(t, l, FIRST_NUMBER + 3 + k, &b->tail[k], e);
    return r;
}

static int check_once(const vgi_lines *t, const entry *b, vg_err *e)
{
    uint32_t *sorted = vgi_copy_array(b->vertices, b->nvertices, sizeof *sorted, e);
    if (!sorted) return VG_ENOMEM;
    qsort(sorted, b->nvertices, sizeof *sorted, vgi_by_index);
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
        return vg_fail(e, VG_EINPUT, "%s line %zu: a joint is 'JOINT PARENT vertices VERTEX VERTEX ...'", t->subject,
                       l->number);
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

/* Read all lines in file order, and order them as joints. groups: of the second kind, with this base; otherwise base
 * is -1. */
static int take_entries(entries *s, vgi_lines *t, int base, vg_err *e)
{
    vgi_line l;
    int r = VG_OK;
    while (r == VG_OK && vgi_lines_next(t, &l)) {
        if ((r = vgi_grow(&s->at, &s->cap, s->n + 1, sizeof *s->at, e)) < 0) break;
        entry *b = &s->at[s->n++]; /* counted immediately, so that clearing always frees it */
        *b = (entry){0};
        r = base < 0 ? take_bone(t, &l, b, e) : take_group(t, &l, base, b, e);
        if (r == VG_OK && s->n >= UINT32_MAX / 4) r = vg_fail(e, VG_EINPUT, "%s has too many joints", t->subject);
    }
    if (r == VG_OK && s->n == 0) r = vg_fail(e, VG_EINPUT, "%s names no joint", t->subject);
    if (r == VG_OK) r = find_parents(s, t->subject, e);
    return r < 0 ? r : order_entries(s, t->subject, e);
}

/* ---- bones as a sequence of one pose ---- */

typedef struct reading {
    vg_bytes text;
    entries bones;
    vg_skeleton skeleton; /* each bone's head, and its tail as an end site */
    double *places;       /* positions of its joints */
    bool done;
} reading;

static char *end_name(const char *bone, vg_err *e)
{
    size_t n = strlen(bone) + sizeof end_suffix;
    char *name = vgi_array_raw(n, 1, e);
    if (name) snprintf(name, n, "%s%s", bone, end_suffix);
    return name;
}

/* Append a joint; takes ownership of the name (NULL: out of memory). */
static int add_joint(reading *b, char *name, uint32_t parent, const double at[3], vg_err *e)
{
    vg_skeleton *s = &b->skeleton;
    vg_joint *j = &s->joints[s->njoints];
    if (!name) return VG_ENOMEM;
    *j = (vg_joint){.name = name, .parent = parent};
    memcpy(b->places + 3 * s->njoints++, at, 3 * sizeof *at);
    for (int k = 0; k < 3; k++) j->offset[k] = at[k] - (parent == NONE ? 0 : b->places[3 * (size_t)parent + k]);
    return vgi_finite(j->offset, 3)
               ? VG_OK
               : vg_fail(e, VG_EINPUT, "joint '%.80s' is too far from its parent for a number to hold", name);
}

static int add_head(reading *b, entry *bone, uint32_t parent, vg_err *e)
{
    static const uint8_t channels[6] = {1, 2, 3, 6, 4, 5}; /* position, then z x y */
    char *name = bone->name;
    bone->name = NULL;
    vg_joint *j = &b->skeleton.joints[b->skeleton.njoints];
    int r = add_joint(b, name, parent, bone->head, e);
    size_t skip = parent == NONE ? 0 : 3;
    j->nchannels = (uint32_t)(6 - skip);
    memcpy(j->channels, channels + skip, 6 - skip);
    return r;
}

/* Append the end sites from bone i up to bone `up`, exclusive: all joints below them exist. */
static int add_ends(reading *b, const uint32_t *place, uint32_t i, uint32_t up, vg_err *e)
{
    int r = VG_OK;
    for (; r == VG_OK && i != up; i = b->bones.at[i].parent)
        r = add_joint(b, end_name(b->skeleton.joints[place[i]].name, e), place[i], b->bones.at[i].tail, e);
    return r;
}

static int make_skeleton(reading *b, vg_err *e)
{
    entries *s = &b->bones;
    uint32_t *place = vgi_array_raw(s->n, sizeof *place, e), last = NONE; /* per bone: its joint */
    b->skeleton.joints = vgi_array(2 * s->n, sizeof *b->skeleton.joints, e);
    b->places = vgi_array(2 * s->n, 3 * sizeof *b->places, e);
    int r = place && b->skeleton.joints && b->places ? VG_OK : VG_ENOMEM;
    for (size_t k = 0; r == VG_OK && k < s->n; k++) {
        uint32_t i = s->order[k], above = s->at[i].parent;
        if (last != above) r = add_ends(b, place, last, above, e);
        place[i] = (uint32_t)b->skeleton.njoints;
        if (r == VG_OK) r = add_head(b, &s->at[i], above == NONE ? NONE : place[above], e);
        last = i;
    }
    if (r == VG_OK) r = add_ends(b, place, last, NONE, e);
    free(place);
    return r;
}

static int open_skeleton(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                         vg_err *e)
{
    (void)how;
    reading *b = *state = vgi_array(1, sizeof *b, e);
    if (!b) return VG_ENOMEM;
    int r = vgi_input_slurp_text(in, &b->text, e);
    if (r < 0) return r;
    vgi_lines t = vgi_lines_of(b->text.data, b->text.size, subject);
    if ((r = take_entries(&b->bones, &t, -1, e)) < 0 || (r = make_skeleton(b, e)) < 0) return r;
    size_t n = b->skeleton.njoints;
    r = vg_skeleton_mesh(&b->skeleton, &h->body.mesh, e);
    if (r == VG_OK) r = vg_skeleton_copy(&h->body.skeleton, &b->skeleton, e);
    if (r == VG_OK && !(h->body.reference = vgi_copy_array(b->places, n, 3 * sizeof *b->places, e))) r = VG_ENOMEM;
    h->kind = VG_VERTICES, h->precision = VG_F64, h->count = n;
    return r;
}

/* The rest pose, without rotations. */
static int next_pose(void *state, vg_frame *f, vg_err *e)
{
    reading *b = state;
    if (b->done) return 0;
    size_t n = b->skeleton.njoints;
    double *turns = vgi_array(n, 4 * sizeof *turns, e);
    if (!turns) return VG_ENOMEM;
    for (size_t j = 0; j < n; j++) turns[4 * j] = 1;
    int r = vg_frame_turn(f, turns, n, e);
    free(turns);
    memcpy(f->values, b->places, 3 * n * sizeof *f->values);
    b->done = true;
    return r < 0 ? r : 1;
}

static uint64_t one_frame(const void *state)
{
    (void)state;
    return 1;
}

static void close_skeleton(void *state)
{
    reading *b = state;
    if (!b) return;
    vg_bytes_clear(&b->text);
    clear_entries(&b->bones);
    vg_skeleton_clear(&b->skeleton);
    free(b->places);
    free(b);
}

/* Whether its first line is a bone or a group. Groups are refused with a separate message. */
static bool sniff_skeleton(const unsigned char *data, size_t n)
{
    vgi_lines t = vgi_lines_of(data, n, "");
    vgi_line l;
    double x;
    if (!vgi_lines_next(&t, &l) || l.n < 4 || vgi_field_number(&l.at[1], &x)) return false;
    if (says_group(&l)) return vgi_field_number(&l.at[3], &x);
    bool bone = l.n == BONE_FIELDS;
    for (size_t i = FIRST_NUMBER; bone && i < BONE_FIELDS; i++) bone = vgi_field_number(&l.at[i], &x);
    return bone;
}

const vgi_sequence_format vgi_sequence_skeleton = {
    .name = "skeleton", .suffix = ".skeleton.txt",
    .keeps = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_SKELETON,
    .sniff = sniff_skeleton, .open = open_skeleton, .next = next_pose, .close = close_skeleton, .frames = one_frame};

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
