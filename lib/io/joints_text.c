/* joints_text.c: positions of the joints of a skeleton over time, one joint of one frame per line: "FRAME BONE X Y
 * Z". The skeleton comes from elsewhere (--mesh). Joints that are not in the file (ends of bones) move rigidly with
 * their parent, which is rotated to fit the joints below it. A bone without joints below it whose end is at the joint
 * of another bone points at that joint: so a leg points at its foot where animators attached the feet to the ground.
 * Rotations are found in model/skeleton.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "numeric/kdtree.h"

#include <math.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;

enum { FIELDS = 5, FIRST_NUMBER = 2, SHOWN = 80 };

/* A joint that is looked up by name. */
typedef struct named {
    const char *name;
    bool end; /* it has no channels: found only if no other joint has the name */
    uint32_t joint;
} named;

typedef struct reading {
    vg_bytes text;
    vgi_lines lines;
    vgi_line line;       /* the first line of the next frame */
    bool waiting;        /* whether there is one */
    int64_t number;      /* of the previous frame */
    uint64_t frames;
    /* of the skeleton, by joint: */
    vg_skeleton skeleton;
    double *reference;
    named *by_name;
    uint64_t *met;       /* number (from 1) of the last frame that contained the joint; every frame contains the
                            joints of the first */
    uint32_t *guide;     /* the joint itself if it is in the file, else the nearest one above that is; NONE: none */
    uint32_t *aim;       /* for an end that is not in the file: the joint at which it is; NONE: none */
    double *turns;
    /* the joints in the file, and ends with an aim, as a separate skeleton: */
    vg_skeleton part;
    uint32_t *place;     /* per joint: its index in the part */
    vg_joint_fitter *fitter;
    double *values, *part_places, *part_turns;
} reading;

static int open_joints(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                       vg_err *e)
{
    (void)how;
    reading *b = *state = vgi_array(1, sizeof *b, e);
    if (!b) return VG_ENOMEM;
    b->number = -1;
    int r = vgi_input_slurp_text(in, &b->text, e);
    if (r < 0) return r;
    b->lines = vgi_lines_of(b->text.data, b->text.size, subject);
    b->waiting = vgi_lines_next(&b->lines, &b->line);
    h->kind = VG_VERTICES, h->precision = VG_F64;
    return b->waiting ? VG_OK : vg_fail(e, VG_EINPUT, "%s holds no frame", subject);
}

/* ---- the skeleton ---- */

static int compare_names(const void *a, const void *b)
{
    const named *x = a, *y = b;
    int order = strcmp(x->name, y->name);
    if (order || x->end != y->end) return order ? order : (int)x->end - (int)y->end;
    return (x->joint > y->joint) - (x->joint < y->joint);
}

static int join_skeleton(void *state, const vg_head *with, vg_err *e)
{
    reading *b = state;
    size_t n = with->body.skeleton.njoints;
    int r = vg_skeleton_copy(&b->skeleton, &with->body.skeleton, e);
    if (r < 0) return r;
    b->reference = vgi_copy_array(with->body.reference, n, 3 * sizeof *b->reference, e);
    b->by_name = vgi_array(n, sizeof *b->by_name, e);
    b->met = vgi_array(n, sizeof *b->met, e);
    b->guide = vgi_array_raw(n, sizeof *b->guide, e);
    b->aim = vgi_array_raw(n, sizeof *b->aim, e);
    b->place = vgi_array_raw(n, sizeof *b->place, e);
    b->turns = vgi_array(n, 4 * sizeof *b->turns, e);
    if (!b->reference || !b->by_name || !b->met || !b->guide || !b->aim || !b->place || !b->turns) return VG_ENOMEM;
    for (size_t j = 0; j < n; j++) {
        const vg_joint *joint = &b->skeleton.joints[j];
        b->by_name[j] = (named){.name = joint->name, .end = !joint->nchannels, .joint = (uint32_t)j};
    }
    qsort(b->by_name, n, sizeof *b->by_name, compare_names);
    return VG_OK;
}

static int compare_field(const char *name, const vgi_field *f)
{
    size_t n = (size_t)(f->end - f->begin), m = strlen(name); /* a field may contain NUL */
    int order = memcmp(name, f->begin, m < n ? m : n);
    return order ? order : (m > n) - (m < n);
}

/* The first joint with that name, or NONE. */
static uint32_t find_joint(const reading *b, const vgi_field *f)
{
    size_t low = 0, high = b->skeleton.njoints;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (compare_field(b->by_name[middle].name, f) < 0) low = middle + 1;
        else high = middle;
    }
    return low < b->skeleton.njoints && !compare_field(b->by_name[low].name, f) ? b->by_name[low].joint : NONE;
}

/* The joints in the file, as points. */
typedef struct given {
    size_t n;
    uint32_t *joint; /* per point */
    vgi_kdtree *tree;
} given;

static int list_given(const reading *b, given *g, vg_err *e)
{
    double *points = vgi_array_raw(b->skeleton.njoints, 3 * sizeof *points, e);
    g->joint = vgi_array_raw(b->skeleton.njoints, sizeof *g->joint, e);
    if (!points || !g->joint) return free(points), VG_ENOMEM;
    for (size_t j = 0; j < b->skeleton.njoints; j++) {
        if (!b->met[j]) continue;
        memcpy(points + 3 * g->n, b->reference + 3 * j, 3 * sizeof *points);
        g->joint[g->n++] = (uint32_t)j;
    }
    int r = vgi_kdtree_new(&g->tree, points, g->n, e);
    free(points);
    return r;
}

static double square_distance(const double a[3], const double b[3])
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* The joint in the file at which the end j of bone `above` is in the rest pose, within a tolerance; or NONE. */
static uint32_t find_aim(const reading *b, const given *g, size_t j, size_t above)
{
    const double near = 0.05, *at = b->reference + 3 * j; /* relative to the bone's length, because artists join bones
                                                             by eye */
    const double most = near * near * square_distance(at, b->reference + 3 * (size_t)above);
    vgi_near found; /* never the bone itself, whose joint is a whole length away */
    size_t n = vgi_kdtree_nearest(g->tree, at, most, 1, &found);
    return n && found.square < most ? g->joint[found.index] : NONE;
}

static int find_aims(reading *b, vg_err *e)
{
    given g = {0};
    size_t n = b->skeleton.njoints;
    int r = list_given(b, &g, e);
    for (size_t j = 0; j < n; j++) b->aim[j] = NONE; /* initially: whether a joint in the file is below it */
    for (size_t j = 0; j < n; j++)
        if (b->met[j] && b->skeleton.joints[j].parent != NONE) b->aim[b->skeleton.joints[j].parent] = 0;
    /* children come after their parents, so their own entries are still valid */
    for (size_t j = n; r == VG_OK && j-- > 0;) {
        uint32_t above = b->skeleton.joints[j].parent;
        bool free_end =
            !b->met[j] && b->aim[j] == NONE && !b->skeleton.joints[j].nchannels && above != NONE && b->met[above];
        b->aim[j] = free_end && b->aim[above] == NONE ? find_aim(b, &g, j, above) : NONE;
    }
    vgi_kdtree_free(&g.tree);
    free(g.joint);
    return r;
}

/* Make the skeleton of the joints in the first frame, for the fitter. */
static int make_part(reading *b, vg_err *e)
{
    vg_skeleton *s = &b->part;
    size_t n = b->skeleton.njoints;
    if (!(s->joints = vgi_array(n, sizeof *s->joints, e))) return VG_ENOMEM;
    int r = find_aims(b, e);
    if (r < 0) return r;
    for (size_t j = 0; j < n; j++) {
        const vg_joint *joint = &b->skeleton.joints[j];
        uint32_t above = joint->parent == NONE ? NONE : b->guide[joint->parent];
        b->guide[j] = b->met[j] ? (uint32_t)j : above;
        if (!b->met[j] && b->aim[j] == NONE) continue;
        b->place[j] = (uint32_t)s->njoints;
        vg_joint *to = &s->joints[s->njoints];
        *to = *joint;
        to->parent = above == NONE ? NONE : b->place[above];
        for (size_t k = 0; k < 3; k++)
            to->offset[k] = b->reference[3 * j + k] - (above == NONE ? 0 : b->reference[3 * (size_t)above + k]);
        if (!(to->name = vgi_copy_string(joint->name, strlen(joint->name), e))) return VG_ENOMEM;
        s->njoints++;
    }
    b->values = vgi_array(vg_skeleton_channels(s), sizeof *b->values, e);
    b->part_places = vgi_array(s->njoints, 3 * sizeof *b->part_places, e);
    b->part_turns = vgi_array(s->njoints, 4 * sizeof *b->part_turns, e);
    return b->values && b->part_places && b->part_turns ? vg_joint_fitter_new(&b->fitter, s, e) : VG_ENOMEM;
}

/* ---- frames ---- */

static int frame_number(const reading *b, int64_t *number, vg_err *e)
{
    const vgi_field *f = &b->line.at[0];
    const char *next = vgi_parse_int(f->begin, f->end, number);
    if (b->line.n == FIELDS && next == f->end && *number >= 0) return VG_OK;
    return vg_fail(e, VG_EINPUT, "%s line %zu: a joint is 'FRAME BONE X Y Z', FRAME a number from 0",
                   b->lines.subject, b->line.number);
}

static int take_joint(reading *b, double *places, vg_err *e)
{
    const vgi_line *l = &b->line;
    const vgi_field *f = &l->at[1];
    int shown = f->end - f->begin < SHOWN ? (int)(f->end - f->begin) : SHOWN;
    uint32_t j = find_joint(b, f);
    if (j == NONE)
        return vg_fail(e, VG_EINPUT, "%s line %zu: the skeleton has no joint '%.*s'", b->lines.subject, l->number,
                       shown, f->begin);
    if (b->met[j] == b->frames + 1)
        return vg_fail(e, VG_EINPUT, "%s line %zu: joint '%.*s' is already defined in this frame", b->lines.subject,
                       l->number, shown, f->begin);
    if (b->frames && !b->met[j])
        return vg_fail(e, VG_EINPUT, "%s line %zu: joint '%.*s' is not in earlier frames", b->lines.subject,
                       l->number, shown, f->begin);
    b->met[j] = b->frames + 1;
    int r = VG_OK;
    for (size_t k = 0; r == VG_OK && k < 3; k++)
        r = vgi_line_number(&b->lines, l, FIRST_NUMBER + k, &places[3 * (size_t)j + k], e);
    return r;
}

/* Read all lines of a frame and report missing ones. */
static int take_frame(reading *b, vg_frame *f, vg_err *e)
{
    int64_t number, next;
    char name[32];
    int r = frame_number(b, &number, e);
    if (r < 0) return r;
    const vgi_field *first = &b->line.at[0];
    snprintf(name, sizeof name, "%.*s", (int)(first->end - first->begin < 31 ? first->end - first->begin : 31),
             first->begin);
    if (number <= b->number)
        return vg_fail(e, VG_EINPUT, "%s line %zu: frame %s comes after frame %lld", b->lines.subject, b->line.number,
                       name, (long long)b->number);
    for (next = number; b->waiting && next == number;) {
        if ((r = take_joint(b, f->values, e)) < 0) return r;
        b->waiting = vgi_lines_next(&b->lines, &b->line);
        if (b->waiting && (r = frame_number(b, &next, e)) < 0) return r;
    }
    for (size_t j = 0; j < b->skeleton.njoints; j++) {
        bool wanted = b->frames ? b->met[j] > 0 : b->skeleton.joints[j].nchannels > 0;
        if (wanted && b->met[j] <= b->frames)
            return vg_fail(e, VG_EINPUT, "%s has no joint '%.80s' in frame %s", b->lines.subject,
                           b->skeleton.joints[j].name, name);
    }
    b->number = number;
    return vg_frame_rename(f, name, e);
}

/* Rotations of the joints, and positions of those that are not in the file. */
static int turn_joints(reading *b, vg_frame *f, vg_err *e)
{
    size_t joint, n = b->skeleton.njoints;
    for (size_t j = 0; j < n; j++) {
        size_t from = b->met[j] ? j : b->aim[j];
        for (size_t k = 0; k < 3 && from != NONE; k++)
            b->part_places[3 * (size_t)b->place[j] + k] =
                f->values[3 * from + k] + b->reference[3 * j + k] - b->reference[3 * from + k];
    }
    vg_joint_fitter_fit(b->fitter, b->part_places, NULL, b->values, &joint);
    vg_skeleton_pose(&b->part, b->values, b->part_places, b->part_turns);
    for (size_t j = 0; j < n; j++) {
        static const double unturned[4] = {1, 0, 0, 0};
        size_t guide = b->guide[j];
        bool alone = guide == NONE;
        const double *turn = alone ? unturned : b->part_turns + 4 * (size_t)b->place[guide];
        memcpy(b->turns + 4 * j, turn, 4 * sizeof *turn);
        if (b->met[j]) continue;
        double offset[3];
        for (size_t k = 0; k < 3; k++)
            offset[k] = b->reference[3 * j + k] - (alone ? 0 : b->reference[3 * guide + k]);
        vg_quat_apply(turn, offset, f->values + 3 * j);
        for (size_t k = 0; k < 3 && !alone; k++) f->values[3 * j + k] += f->values[3 * guide + k];
    }
    if (!vgi_finite(b->turns, 4 * n) || !vgi_finite(f->values, 3 * n))
        return vg_fail(e, VG_EINPUT, "%s: the joints of frame %s lie too far apart", b->lines.subject, f->name);
    return vg_frame_turn(f, b->turns, n, e);
}

static int next_frame(void *state, vg_frame *f, vg_err *e)
{
    reading *b = state;
    if (!b->waiting) return 0;
    int r = take_frame(b, f, e);
    if (r == VG_OK && !b->frames) r = make_part(b, e);
    if (r == VG_OK) r = turn_joints(b, f, e);
    if (r < 0) return r;
    b->frames++;
    return 1;
}

static void close_joints(void *state)
{
    reading *b = state;
    if (!b) return;
    vg_bytes_clear(&b->text);
    vg_skeleton_clear(&b->skeleton);
    vg_skeleton_clear(&b->part);
    vg_joint_fitter_free(&b->fitter);
    free(b->reference);
    free(b->by_name);
    free(b->met);
    free(b->guide);
    free(b->aim);
    free(b->place);
    free(b->turns);
    free(b->values);
    free(b->part_places);
    free(b->part_turns);
    free(b);
}

/* Whether its first line is a joint in a frame. */
static bool sniff_joints(const unsigned char *data, size_t n)
{
    vgi_lines t = vgi_lines_of(data, n, "");
    vgi_line l;
    int64_t frame;
    double x;
    if (!vgi_lines_next(&t, &l) || l.n != FIELDS || vgi_field_number(&l.at[1], &x)) return false;
    bool joint = vgi_parse_int(l.at[0].begin, l.at[0].end, &frame) == l.at[0].end && frame >= 0;
    for (size_t i = FIRST_NUMBER; joint && i < FIELDS; i++) joint = vgi_field_number(&l.at[i], &x);
    return joint;
}

const vgi_sequence_format vgi_sequence_joints = {
    .name = "joints", .suffix = ".joints.txt", .keeps = VGI_KEEPS_ORDER | VGI_KEEPS_NAMES | VGI_KEEPS_SKELETON,
    .sniff = sniff_joints, .open = open_joints, .join = join_skeleton, .next = next_frame, .close = close_joints};
