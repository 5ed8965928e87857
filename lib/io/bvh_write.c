/* bvh_write.c: writes Biovision hierarchies (.bvh), a skeleton and its motion, frame by frame. Kinematics (from
 * joints to channels) are in skeleton.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/bvh.h"

#include <math.h>
#include <stdlib.h>

enum {
    MOST_TABS = 64, /* deeper nesting is not indented further */
    FIELD = 26      /* bytes reserved for a number of the header that is known only at the end */
};

static const uint32_t NONE = UINT32_MAX;

/* The hierarchy as lists: the children of joint j, or the roots (at njoints). */
typedef struct kin {
    uint32_t *first, *next; /* NONE: end of list */
} kin;

typedef struct writing {
    vgi_output *out;
    vg_skeleton skeleton; /* its offsets are those of the sequence's reference pose */
    kin kin;
    uint32_t *order;      /* joints in file order */
    size_t *first_value;  /* per joint */
    vg_joint_fitter *fitter;
    double *values;
    int place_decimals, angle_decimals;
    double size;          /* diagonal of the reference pose */
    vg_bytes text;        /* buffer for the next output */
    uint64_t frames_at, time_at; /* positions of the two numbers in the file */
    uint64_t frames;
    bool timed, uneven;   /* all frames so far have times; they are not equally spaced */
    double first_time, step, last_time;
    double worst;         /* largest distance of a joint from its true position */
    size_t worst_joint;
    char *worst_frame;
    char warning[400];
} writing;

static int put_string(vg_bytes *b, const char *s, vg_err *e)
{
    return vgi_bytes_append(b, s, strlen(s), e);
}

/* Print x with that many decimals, without "-0". A number with too many digits is printed in full. */
static int say_fixed(vg_bytes *b, double x, int decimals, vg_err *e)
{
    static const double ten[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
    char text[64], digits[24];
    double scaled = nearbyint(fabs(x) * ten[decimals]);
    if (!(scaled < 9e15)) return vgi_bytes_append(b, text, vgi_print_double(text, x), e);
    size_t n = vgi_print_uint(digits, (uint64_t)scaled), at = 0;
    size_t whole = n > (size_t)decimals ? n - (size_t)decimals : 0;
    if (x < 0 && scaled > 0) text[at++] = '-';
    if (whole == 0) text[at++] = '0';
    memcpy(text + at, digits, whole);
    at += whole;
    if (decimals) text[at++] = '.';
    for (size_t i = n; i < (size_t)decimals; i++) text[at++] = '0';
    memcpy(text + at, digits + whole, n - whole);
    return vgi_bytes_append(b, text, at + n - whole, e);
}

/* Number of decimals for a length: 7 digits of the figure's size (15 in full precision), but at least 6. */
static int decimals_for(double size, bool full)
{
    double d = ceil((full ? 14 : 7) - log10(size > 0 ? size : 1));
    return d < 6 ? 6 : d > 15 ? 15 : (int)d;
}

static int link_kin(writing *w, vg_err *e)
{
    const vg_skeleton *s = &w->skeleton;
    size_t n = s->njoints;
    w->kin.first = vgi_array_raw(n + 1, sizeof *w->kin.first, e);
    w->kin.next = vgi_array_raw(n, sizeof *w->kin.next, e);
    if (!w->kin.first || !w->kin.next) return VG_ENOMEM;
    memset(w->kin.first, 0xff, (n + 1) * sizeof *w->kin.first);
    for (size_t j = n; j-- > 0;) {
        size_t above = s->joints[j].parent == NONE ? n : s->joints[j].parent;
        w->kin.next[j] = w->kin.first[above];
        w->kin.first[above] = (uint32_t)j;
    }
    return VG_OK;
}

/* The joint that follows j in the file, and the number of braces to close in between. */
static uint32_t step_on(const writing *w, uint32_t j, size_t *closed)
{
    *closed = 0;
    if (w->kin.first[j] != NONE) return w->kin.first[j];
    for (; j != NONE; j = w->skeleton.joints[j].parent) {
        ++*closed;
        if (w->kin.next[j] != NONE) return w->kin.next[j];
    }
    return NONE;
}

static int list_order(writing *w, vg_err *e)
{
    const vg_skeleton *s = &w->skeleton;
    size_t at = 0, closed;
    w->order = vgi_array_raw(s->njoints, sizeof *w->order, e);
    w->first_value = vgi_array_raw(s->njoints, sizeof *w->first_value, e);
    if (!w->order || !w->first_value) return VG_ENOMEM;
    for (uint32_t j = w->kin.first[s->njoints]; j != NONE; j = step_on(w, j, &closed)) w->order[at++] = j;
    for (size_t j = 0, value = 0; j < s->njoints; value += s->joints[j++].nchannels) w->first_value[j] = value;
    return VG_OK;
}

/* Take the offsets from the reference pose, which may differ from the skeleton's. */
static void take_offsets(vg_skeleton *s, const double *reference)
{
    for (size_t j = 0; j < s->njoints; j++) {
        vg_joint *joint = &s->joints[j];
        for (int k = 0; k < 3; k++)
            joint->offset[k] =
                reference[3 * j + k] - (joint->parent == NONE ? 0 : reference[3 * (size_t)joint->parent + k]);
    }
}

int vgi_bvh_check(const vg_head *h, const char *output, vg_err *e)
{
    if (h->body.mesh.nv && h->body.skeleton.njoints == h->body.mesh.nv) return VG_OK;
    return vg_fail(e, VG_EINPUT, "cannot write '%s': the input has no skeleton",
                   output);
}

/* ---- frames ---- */

static void note_time(writing *w, const vg_frame *f)
{
    if (w->frames == 0) {
        w->timed = f->has_time, w->first_time = f->time, w->step = 0;
    } else if (!f->has_time) {
        w->uneven = w->uneven || w->timed;
        w->timed = false;
    } else if (w->timed) {
        if (w->frames == 1) w->step = f->time - w->first_time;
        double expected = w->first_time + (double)w->frames * w->step;
        if (!(w->step > 0) || !(fabs(f->time - expected) <= 0.01 * w->step + 1e-9 * fabs(f->time))) w->uneven = true;
    }
    w->last_time = f->time;
}

static int note_distance(writing *w, double distance, size_t joint, const char *frame, vg_err *e)
{
    if (!(distance > w->worst)) return VG_OK;
    char *copy = vgi_copy_string(frame, strlen(frame), e);
    if (!copy) return VG_ENOMEM;
    free(w->worst_frame);
    w->worst = distance, w->worst_joint = joint, w->worst_frame = copy;
    return VG_OK;
}

static int say_row(writing *w, vg_err *e)
{
    int r = VG_OK;
    bool any = false;
    for (size_t i = 0; i < w->skeleton.njoints; i++) {
        const vg_joint *j = &w->skeleton.joints[w->order[i]];
        const double *values = w->values + w->first_value[w->order[i]];
        for (uint32_t c = 0; r == VG_OK && c < j->nchannels; c++, any = true) {
            if (any) r = put_string(&w->text, " ", e);
            if (r == VG_OK)
                r = say_fixed(&w->text, values[c], j->channels[c] > 3 ? w->angle_decimals : w->place_decimals, e);
        }
    }
    return r < 0 ? r : put_string(&w->text, "\n", e);
}

/* ---- file header ---- */

static int say_tabs(vg_bytes *b, size_t depth, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < depth && i < MOST_TABS; i++) r = put_string(b, "\t", e);
    return r;
}

/* A name must not contain a line end or look like a brace. */
static int say_name(vg_bytes *b, const char *name, vg_err *e)
{
    size_t from = b->size;
    int r = put_string(b, name, e);
    for (size_t i = from; r == VG_OK && i < b->size; i++)
        if (b->data[i] < 0x20 || b->data[i] == 0x7f || b->data[i] == '{' || b->data[i] == '}') b->data[i] = '_';
    return r;
}

/* Whether this is a joint without channels and children that is named like an end site. */
static bool is_end_site(const writing *w, uint32_t j)
{
    const vg_joint *joint = &w->skeleton.joints[j];
    if (joint->parent == NONE || joint->nchannels || w->kin.first[j] != NONE) return false;
    const char *parent = w->skeleton.joints[joint->parent].name;
    size_t n = strlen(parent);
    return !strncmp(joint->name, parent, n) && !strcmp(joint->name + n, vgi_bvh_end);
}

/* Whether all names can be read back. */
static int check_names(const writing *w, vg_err *e)
{
    for (uint32_t j = 0; j < w->skeleton.njoints; j++)
        if (!is_end_site(w, j) && strlen(w->skeleton.joints[j].name) > VGI_BVH_NAME)
            return vg_fail(e, VG_EINPUT, "cannot write '%s': the name of joint %u is longer than %d bytes",
                           w->out->name, j, VGI_BVH_NAME);
    return VG_OK;
}

static int say_opening(writing *w, vg_bytes *b, uint32_t j, size_t depth, vg_err *e)
{
    int r = say_tabs(b, depth, e);
    if (r == VG_OK && is_end_site(w, j)) r = put_string(b, "End Site", e);
    else if (r == VG_OK) {
        r = put_string(b, w->skeleton.joints[j].parent == NONE ? "ROOT " : "JOINT ", e);
        if (r == VG_OK) r = say_name(b, w->skeleton.joints[j].name, e);
    }
    if (r == VG_OK) r = put_string(b, "\n", e);
    if (r == VG_OK) r = say_tabs(b, depth, e);
    return r < 0 ? r : put_string(b, "{\n", e);
}

static int say_joint(writing *w, vg_bytes *b, uint32_t j, size_t depth, vg_err *e)
{
    const vg_joint *joint = &w->skeleton.joints[j];
    int r = say_opening(w, b, j, depth, e);
    if (r == VG_OK) r = say_tabs(b, depth + 1, e);
    if (r == VG_OK) r = put_string(b, "OFFSET", e);
    for (int k = 0; r == VG_OK && k < 3; k++) {
        r = put_string(b, " ", e);
        if (r == VG_OK) r = say_fixed(b, joint->offset[k], w->place_decimals, e);
    }
    if (r == VG_OK) r = put_string(b, "\n", e);
    if (r < 0 || is_end_site(w, j)) return r;
    char count[24];
    r = say_tabs(b, depth + 1, e);
    if (r == VG_OK) r = put_string(b, "CHANNELS ", e);
    if (r == VG_OK) r = vgi_bytes_append(b, count, vgi_print_uint(count, joint->nchannels), e);
    for (uint32_t c = 0; r == VG_OK && c < joint->nchannels; c++) {
        r = put_string(b, " ", e);
        if (r == VG_OK) r = put_string(b, vgi_bvh_channels[joint->channels[c] - 1], e);
    }
    return r < 0 ? r : put_string(b, "\n", e);
}

static int say_hierarchy(writing *w, vg_bytes *b, vg_err *e)
{
    size_t depth = 0, closed;
    int r = put_string(b, "HIERARCHY\n", e);
    for (uint32_t j = w->kin.first[w->skeleton.njoints]; r == VG_OK && j != NONE;) {
        r = say_joint(w, b, j, depth++, e);
        for (j = step_on(w, j, &closed); r == VG_OK && closed > 0; closed--) {
            r = say_tabs(b, --depth, e);
            if (r == VG_OK) r = put_string(b, "}\n", e);
        }
    }
    return r;
}

/* Reserve a blank field for a number that is known only at the end, and store its position. */
static int say_field(vg_bytes *b, uint64_t *at, vg_err *e)
{
    char blanks[FIELD + 1];
    memset(blanks, ' ', FIELD);
    blanks[FIELD] = '\n';
    *at = b->size;
    return vgi_bytes_append(b, blanks, sizeof blanks, e);
}

static int put_text(writing *w, vg_err *e)
{
    int r = vgi_output_put(w->out, w->text.data, w->text.size, e);
    w->text.size = 0;
    return r;
}

static int put_head(writing *w, vg_err *e)
{
    int r = say_hierarchy(w, &w->text, e);
    if (r == VG_OK) r = put_string(&w->text, "MOTION\nFrames: ", e);
    if (r == VG_OK) r = say_field(&w->text, &w->frames_at, e);
    if (r == VG_OK) r = put_string(&w->text, "Frame Time: ", e);
    if (r == VG_OK) r = say_field(&w->text, &w->time_at, e);
    w->frames_at += w->out->size, w->time_at += w->out->size;
    return r < 0 ? r : put_text(w, e);
}

int vgi_bvh_begin(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    writing *w = *state = vgi_array(1, sizeof *w, e);
    if (!w) return VG_ENOMEM;
    w->out = out;
    int r = vg_skeleton_copy(&w->skeleton, &h->body.skeleton, e);
    if (r < 0) return r;
    take_offsets(&w->skeleton, h->body.reference);
    w->size = vg_diagonal(h->body.reference, h->body.mesh.nv);
    w->place_decimals = decimals_for(w->size, o->full_precision), w->angle_decimals = o->full_precision ? 12 : 6;
    if (!(w->values = vgi_array(vg_skeleton_channels(&w->skeleton), sizeof *w->values, e))) return VG_ENOMEM;
    r = link_kin(w, e);
    if (r == VG_OK) r = check_names(w, e);
    if (r == VG_OK) r = list_order(w, e);
    if (r == VG_OK) r = vg_joint_fitter_new(&w->fitter, &w->skeleton, e);
    return r < 0 ? r : put_head(w, e);
}

int vgi_bvh_put(void *state, const vg_frame *f, vg_err *e)
{
    writing *w = state;
    size_t joint, n;
    note_time(w, f);
    const double *turns = vg_frame_turns(f, &n);
    if (n != w->skeleton.njoints) turns = NULL;
    double distance = vg_joint_fitter_fit(w->fitter, f->values, turns, w->values, &joint);
    if (!vgi_finite(w->values, vg_skeleton_channels(&w->skeleton)))
        return vg_fail(e, VG_EINPUT, "its joints lie too far apart for a skeleton");
    int r = note_distance(w, distance, joint, f->name ? f->name : "", e);
    if (r == VG_OK) r = say_row(w, e);
    w->frames++;
    return r < 0 ? r : put_text(w, e);
}

/* Seconds per frame: 1 / VG_FPS if unknown. Computed from the whole duration, because single steps may be rounded. */
static double frame_time(const writing *w)
{
    if (w->timed && w->frames > 1 && !w->uneven) return (w->last_time - w->first_time) / (double)(w->frames - 1);
    return w->timed && w->step > 0 ? w->step : 1.0 / VG_FPS;
}

/* Write the number in w->text right-aligned into its field. */
static int patch_field(writing *w, uint64_t at, vg_err *e)
{
    size_t n = w->text.size; /* no number is longer than its field */
    return vgi_output_patch(w->out, at + FIELD - n, w->text.data, n, e);
}

int vgi_bvh_finish(void *state, vg_err *e)
{
    writing *w = state;
    char text[32];
    double time = frame_time(w);
    w->text.size = 0;
    int r = vgi_bytes_append(&w->text, text, vgi_print_uint(text, w->frames), e);
    if (r == VG_OK) r = patch_field(w, w->frames_at, e);
    if (r < 0) return r;
    w->text.size = 0;
    if (time > 1e-6 && time < 1e5) r = say_fixed(&w->text, time, 10, e);
    else r = vgi_bytes_append(&w->text, text, vgi_print_double(text, time), e);
    return r < 0 ? r : patch_field(w, w->time_at, e);
}

const char *vgi_bvh_warning(void *state)
{
    writing *w = state;
    size_t n = 0, room = sizeof w->warning;
    w->warning[0] = 0;
    if (w->worst > 1e-4 * w->size)
        n = (size_t)snprintf(w->warning, room,
                             "changes of the lengths of bones: joint '%.100s' of frame '%.100s' is off by %.3g, %.2g "
                             "%% of the figure",
                             w->skeleton.joints[w->worst_joint].name, w->worst_frame, w->worst,
                             w->size > 0 ? 100 * w->worst / w->size : 100);
    if (w->uneven)
        snprintf(w->warning + n, room - n, "%sthe times of the frames, which are not evenly spaced",
                 n ? "; " : "");
    return w->warning[0] ? w->warning : NULL;
}

void vgi_bvh_release(void *state)
{
    writing *w = state;
    if (!w) return;
    vg_skeleton_clear(&w->skeleton);
    free(w->kin.first);
    free(w->kin.next);
    free(w->order);
    free(w->first_value);
    vg_joint_fitter_free(&w->fitter);
    free(w->values);
    vg_bytes_clear(&w->text);
    free(w->worst_frame);
    free(w);
}
