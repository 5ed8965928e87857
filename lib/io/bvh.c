/* bvh.c: Biovision hierarchies (.bvh): a skeleton and its motion, read frame by frame and written.
 * Leaves out kinematics, from channels to joints and back (skeleton.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <math.h>
#include <stdlib.h>
#include <strings.h>

enum {
    SHOWN = 40,         /* bytes of the input that a message shows */
    MOST_NAME = 1024,   /* bytes of a joint's name */
    MOST_DEPTH = 4096,  /* joints from a root to an end */
    MOST_CHANNELS = 6,
    MOST_TABS = 64,     /* what is nested deeper is not moved further to the right */
    FIELD = 26          /* bytes kept free for a number of the head that is known in the end */
};

static const uint32_t NONE = UINT32_MAX;
static const char end_suffix[] = ".end";
static const char byte_order_mark[] = "\xef\xbb\xbf";
static const char *const channel_names[] = {"Xposition", "Yposition", "Zposition",
                                            "Xrotation", "Yrotation", "Zrotation"};

/* ------------------------------------------------------------------------------------------- reading -- */

/* What was said of a joint. */
enum { HAS_OFFSET = 1, HAS_CHANNELS = 2, IS_END = 4 };

typedef struct reading {
    vg_bytes text;       /* the file */
    const char *data, *end, *at;
    const char *subject; /* borrowed */
    vg_skeleton skeleton;
    size_t joints_cap;
    unsigned char *said; /* of each joint */
    size_t said_cap;
    uint32_t current;    /* whose braces are open; NONE: between roots */
    size_t depth;
    size_t channels;     /* of all joints */
    uint64_t frames, next;
    double frame_time;
    double *values, *turns;
} reading;

static bool is_blank(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

static bool is_line_end(char c)
{
    return c == '\n' || c == '\r';
}

/* LF, CR LF and CR end lines. */
static size_t line_of(const reading *b, const char *p)
{
    size_t n = 1;
    for (const char *q = b->data; q < p; q++) n += *q == '\n' || (*q == '\r' && (q + 1 == b->end || q[1] != '\n'));
    return n;
}

static void skip_blanks(reading *b)
{
    while (b->at < b->end && is_blank(*b->at)) b->at++;
}

/* The length of the word at p: a brace, or all up to a blank or brace. */
static size_t word_length(const reading *b, const char *p)
{
    size_t n = 0;
    if (p < b->end && (*p == '{' || *p == '}')) return 1;
    while (p + n < b->end && !is_blank(p[n]) && p[n] != '{' && p[n] != '}') n++;
    return n;
}

/* The file ends, or something else than `expected` comes next. */
static int fail_here(reading *b, const char *expected, vg_err *e)
{
    size_t n = word_length(b, b->at);
    if (n == 0)
        return vg_fail(e, VG_ETRUNC, "%s line %zu: the file ends where %s is expected", b->subject,
                       line_of(b, b->at), expected);
    return vg_fail(e, VG_EINPUT, "%s line %zu: %s expected, not '%.*s'", b->subject, line_of(b, b->at), expected,
                   n > SHOWN ? SHOWN : (int)n, b->at);
}

/* Take the next word if it is this one; capitals do not matter. */
static bool take_word(reading *b, const char *word)
{
    size_t n = strlen(word);
    skip_blanks(b);
    if (word_length(b, b->at) != n || strncasecmp(b->at, word, n) != 0) return false;
    b->at += n;
    return true;
}

static int expect_word(reading *b, const char *word, vg_err *e)
{
    char quoted[32];
    if (take_word(b, word)) return VG_OK;
    snprintf(quoted, sizeof quoted, "'%s'", word);
    return fail_here(b, quoted, e);
}

/* "Frames:", "Frame Time:": a blank in `label` is any number of them, the colon may stand apart or be missing. */
static int expect_label(reading *b, const char *label, vg_err *e)
{
    char quoted[32];
    skip_blanks(b);
    const char *p = b->at;
    for (const char *l = label; *l; l++) {
        while (p < b->end && is_blank(*p) && (*l == ' ' || *l == ':')) p++;
        if (*l == ' ' || (*l == ':' && (p == b->end || *p != ':'))) continue;
        if (p == b->end || strncasecmp(p, l, 1) != 0) {
            snprintf(quoted, sizeof quoted, "'%s'", label);
            return fail_here(b, quoted, e);
        }
        p++;
    }
    b->at = p;
    return VG_OK;
}

/* A finite number, the whole word. */
static int take_number(reading *b, const char *what, double *x, vg_err *e)
{
    skip_blanks(b);
    const char *next = vgi_parse_double(b->at, b->end, x);
    if (!next || (next < b->end && !is_blank(*next) && *next != '}')) return fail_here(b, what, e);
    if (!isfinite(*x))
        return vg_fail(e, VG_EINPUT, "%s line %zu: '%.*s' is not a finite number", b->subject, line_of(b, b->at),
                       next - b->at > SHOWN ? SHOWN : (int)(next - b->at), b->at);
    b->at = next;
    return VG_OK;
}

static int take_count(reading *b, const char *what, int64_t *x, vg_err *e)
{
    skip_blanks(b);
    const char *next = vgi_parse_int(b->at, b->end, x);
    if (!next || *x < 0 || (next < b->end && !is_blank(*next))) return fail_here(b, what, e);
    b->at = next;
    return VG_OK;
}

/* ---- hierarchy ---- */

/* Bytes that are no UTF-8 are Latin-1. `to` has room for twice as many and one more. */
static void to_utf8(const char *s, size_t n, char *to)
{
    bool utf8 = vgi_is_utf8(s, n);
    for (size_t i = 0; i < n; i++) {
        unsigned char c = (unsigned char)s[i];
        if (c == 0) c = '?';
        if (c < 0x80 || utf8) {
            *to++ = (char)c;
        } else {
            *to++ = (char)(0xc0 | c >> 6);
            *to++ = (char)(0x80 | (c & 0x3f));
        }
    }
    *to = 0;
}

/* The rest of the line, or up to a brace in it: names hold blanks. */
static int take_name(reading *b, char **name, vg_err *e)
{
    while (b->at < b->end && is_blank(*b->at) && !is_line_end(*b->at)) b->at++;
    const char *start = b->at, *p = start;
    while (p < b->end && !is_line_end(*p) && *p != '{') p++;
    const char *stop = p;
    while (p > start && is_blank(p[-1])) p--;
    b->at = stop;
    size_t n = p - start > MOST_NAME ? MOST_NAME + 1 : (size_t)(p - start);
    if (!(*name = vgi_array_raw(2 * n + 1, 1, e))) return VG_ENOMEM;
    to_utf8(start, n, *name);
    if (strlen(*name) <= MOST_NAME) return VG_OK;
    return vg_fail(e, VG_EINPUT, "%s line %zu: a name is longer than %d bytes", b->subject, line_of(b, start),
                   MOST_NAME);
}

static char *end_name(const char *parent, vg_err *e)
{
    size_t n = strlen(parent) + sizeof end_suffix;
    char *name = vgi_array_raw(n, 1, e);
    if (name) snprintf(name, n, "%s%s", parent, end_suffix);
    return name;
}

/* A joint begins: behind its keyword. */
static int open_joint(reading *b, bool is_end, vg_err *e)
{
    vg_skeleton *s = &b->skeleton;
    char *name = NULL;
    int r = take_name(b, &name, e);
    if (r == VG_OK && is_end) { /* what stands behind "End Site" is no name that anything refers to */
        free(name);
        if (!(name = end_name(s->joints[b->current].name, e))) r = VG_ENOMEM;
    }
    if (r == VG_OK) r = vgi_grow(&s->joints, &b->joints_cap, s->njoints + 1, sizeof *s->joints, e);
    if (r == VG_OK) r = vgi_grow(&b->said, &b->said_cap, s->njoints + 1, 1, e);
    if (r == VG_OK && s->njoints + 1 >= UINT32_MAX / 2)
        r = vg_fail(e, VG_EINPUT, "%s has too many joints", b->subject);
    if (r == VG_OK && b->depth == MOST_DEPTH)
        r = vg_fail(e, VG_EINPUT, "%s line %zu: joints are nested more than %d deep", b->subject, line_of(b, b->at),
                    MOST_DEPTH);
    if (r < 0) {
        free(name);
        return r;
    }
    b->said[s->njoints] = is_end ? IS_END : 0;
    s->joints[s->njoints] = (vg_joint){.name = name, .parent = b->current};
    b->current = (uint32_t)s->njoints++;
    b->depth++;
    return expect_word(b, "{", e);
}

/* "joint 'Hips'" and what is wrong with it, at the line being read */
static int wrong_joint(reading *b, const char *what, vg_err *e)
{
    const char *kind = b->said[b->current] & IS_END ? "end site" : "joint";
    return vg_fail(e, VG_EINPUT, "%s line %zu: %s '%s' has %s", b->subject, line_of(b, b->at), kind,
                   b->skeleton.joints[b->current].name, what);
}

static int close_joint(reading *b, vg_err *e)
{
    if (!(b->said[b->current] & HAS_OFFSET)) return wrong_joint(b, "no OFFSET", e);
    b->current = b->skeleton.joints[b->current].parent;
    b->depth--;
    return VG_OK;
}

static int read_offset(reading *b, vg_err *e)
{
    vg_joint *j = &b->skeleton.joints[b->current];
    if (b->said[b->current] & HAS_OFFSET) return wrong_joint(b, "two OFFSETs", e);
    b->said[b->current] |= HAS_OFFSET;
    int r = VG_OK;
    for (int k = 0; r == VG_OK && k < 3; k++) r = take_number(b, "a number", &j->offset[k], e);
    return r;
}

static int read_channel(reading *b, vg_joint *j, vg_err *e)
{
    for (int c = 0; c < MOST_CHANNELS; c++) {
        if (!take_word(b, channel_names[c])) continue;
        uint8_t channel = (uint8_t)(c + 1);
        if (channel <= 3 && memchr(j->channels, channel, j->nchannels))
            return wrong_joint(b, "two channels for one coordinate of its position", e);
        j->channels[j->nchannels++] = channel;
        return VG_OK;
    }
    return fail_here(b, "a channel (Xposition ... Zrotation)", e);
}

static int read_channels(reading *b, vg_err *e)
{
    vg_joint *j = &b->skeleton.joints[b->current];
    int64_t n;
    if (b->said[b->current] & IS_END) return wrong_joint(b, "CHANNELS", e);
    if (b->said[b->current] & HAS_CHANNELS) return wrong_joint(b, "CHANNELS twice", e);
    b->said[b->current] |= HAS_CHANNELS;
    int r = take_count(b, "the number of channels", &n, e);
    if (r == VG_OK && n > MOST_CHANNELS) r = wrong_joint(b, "more than 6 channels", e);
    for (int64_t i = 0; r == VG_OK && i < n; i++) r = read_channel(b, j, e);
    b->channels += j->nchannels;
    return r;
}

/* One statement between the braces of a joint. */
static int read_statement(reading *b, vg_err *e)
{
    if (take_word(b, "}")) return close_joint(b, e);
    if (take_word(b, "OFFSET")) return read_offset(b, e);
    if (take_word(b, "CHANNELS")) return read_channels(b, e);
    if (b->said[b->current] & IS_END) return fail_here(b, "OFFSET or '}'", e);
    if (take_word(b, "JOINT")) return open_joint(b, false, e);
    if (!take_word(b, "End")) return fail_here(b, "OFFSET, CHANNELS, JOINT, End Site or '}'", e);
    int r = expect_word(b, "Site", e);
    return r < 0 ? r : open_joint(b, true, e);
}

static int read_hierarchy(reading *b, vg_err *e)
{
    int r = expect_word(b, "HIERARCHY", e);
    b->current = NONE;
    while (r == VG_OK) {
        if (b->current != NONE) r = read_statement(b, e);
        else if (take_word(b, "ROOT")) r = open_joint(b, false, e);
        else break;
    }
    if (r == VG_OK && b->skeleton.njoints == 0) return fail_here(b, "ROOT", e);
    return r < 0 ? r : take_word(b, "MOTION") ? VG_OK : fail_here(b, "ROOT or MOTION", e);
}

/* ---- motion ---- */

static int read_motion_head(reading *b, vg_err *e)
{
    int64_t n = 0;
    int r = expect_label(b, "Frames:", e);
    if (r == VG_OK) r = take_count(b, "the number of frames", &n, e);
    if (r == VG_OK) r = expect_label(b, "Frame Time:", e);
    if (r == VG_OK) r = take_number(b, "the time of a frame", &b->frame_time, e);
    if (r < 0) return r;
    b->frames = (uint64_t)n;
    if (!(b->frame_time > 0) || !isfinite((double)b->frames * b->frame_time))
        return vg_fail(e, VG_EINPUT, "%s line %zu: the frame time is %s", b->subject, line_of(b, b->at),
                       b->frame_time > 0 ? "too large" : "not positive");
    /* a frame is at least a line: without channels there would be no other end to a number that lies */
    if (b->channels == 0 && b->frames > (uint64_t)(b->end - b->at))
        return vg_fail(e, VG_ETRUNC, "%s has fewer than the %llu frames that it promises", b->subject,
                       (unsigned long long)b->frames);
    return VG_OK;
}

static int check_places(reading *b, const double *positions, const char *what, vg_err *e)
{
    for (size_t j = 0; j < b->skeleton.njoints; j++)
        if (!vgi_finite(positions + 3 * j, 3))
            return vg_fail(e, VG_EINPUT, "%s line %zu: %s, joint '%s' lies beyond all numbers", b->subject,
                           line_of(b, b->at), what, b->skeleton.joints[j].name);
    return VG_OK;
}

static int open_text(reading *b, vgi_input *in, vg_err *e)
{
    int r = vgi_input_slurp(in, &b->text, e);
    if (r < 0) return r;
    if (b->text.size == 0) return vg_fail(e, VG_ETRUNC, "%s is empty", b->subject);
    b->data = b->at = (char *)b->text.data, b->end = b->data + b->text.size;
    if (b->text.size >= 3 && !memcmp(b->data, byte_order_mark, 3)) b->at += 3;
    r = read_hierarchy(b, e);
    return r < 0 ? r : read_motion_head(b, e);
}

/* The bones, in the pose without rotations. */
static int fill_head(reading *b, vg_head *h, vg_err *e)
{
    const vg_skeleton *s = &b->skeleton;
    int r = vg_skeleton_mesh(s, &h->mesh, e);
    if (r == VG_OK) r = vg_skeleton_copy(&h->skeleton, s, e);
    if (r == VG_OK && !(h->reference = vgi_array(s->njoints, 3 * sizeof *h->reference, e))) r = VG_ENOMEM;
    if (r < 0) return r;
    h->kind = VG_VERTICES, h->precision = VG_F64, h->count = s->njoints;
    vg_skeleton_pose(s, NULL, h->reference, b->turns);
    return check_places(b, h->reference, "in the reference pose", e);
}

static int open_bvh(void **state, vg_head *h, vgi_input *in, const char *subject, vg_err *e)
{
    reading *b = *state = vgi_array(1, sizeof *b, e);
    if (!b) return VG_ENOMEM;
    b->subject = subject;
    int r = open_text(b, in, e);
    if (r < 0) return r;
    b->values = vgi_array(b->channels, sizeof *b->values, e);
    b->turns = vgi_array(b->skeleton.njoints, 4 * sizeof *b->turns, e);
    return b->values && b->turns ? fill_head(b, h, e) : VG_ENOMEM;
}

/* All frames were read: nothing but blanks may follow. */
static int end_motion(reading *b, vg_err *e)
{
    char expected[64];
    skip_blanks(b);
    if (b->at == b->end) return 0;
    snprintf(expected, sizeof expected, "the end of the file behind %llu frames", (unsigned long long)b->frames);
    return fail_here(b, expected, e);
}

static int next_frame(void *state, vg_frame *f, vg_err *e)
{
    reading *b = state;
    char what[96];
    if (b->next == b->frames) return end_motion(b, e);
    for (size_t i = 0; i < b->channels; i++) {
        skip_blanks(b);
        if (b->at == b->end)
            return vg_fail(e, VG_ETRUNC, "%s ends in frame %llu of %llu, behind %zu of %zu values", b->subject,
                           (unsigned long long)b->next, (unsigned long long)b->frames, i, b->channels);
        int r = take_number(b, "a number", &b->values[i], e);
        if (r < 0) return r;
    }
    vg_skeleton_pose(&b->skeleton, b->values, f->values, b->turns);
    snprintf(what, sizeof what, "in frame %llu", (unsigned long long)b->next);
    int r = check_places(b, f->values, what, e);
    if (r == VG_OK) r = vg_frame_turn(f, b->turns, b->skeleton.njoints, e);
    if (r < 0) return r;
    f->has_time = b->frames > 1; /* a single frame is a pose */
    f->time = f->has_time ? (double)b->next * b->frame_time : 0;
    b->next++;
    return 1;
}

static uint64_t count_frames(const void *state)
{
    return ((const reading *)state)->frames;
}

static void close_bvh(void *state)
{
    reading *b = state;
    if (!b) return;
    vg_bytes_clear(&b->text);
    vg_skeleton_clear(&b->skeleton);
    free(b->said);
    free(b->values);
    free(b->turns);
    free(b);
}

static bool sniff_bvh(const unsigned char *data, size_t n)
{
    static const char first[] = "HIERARCHY";
    size_t i = n >= 3 && !memcmp(data, byte_order_mark, 3) ? 3 : 0, length = sizeof first - 1;
    while (i < n && is_blank((char)data[i])) i++;
    return n - i >= length && !strncasecmp((const char *)data + i, first, length) &&
           (n - i == length || is_blank((char)data[i + length]));
}

/* ------------------------------------------------------------------------------------------- writing -- */

/* The joints below each other: the children of j, or the roots (at njoints), are a list. */
typedef struct kin {
    uint32_t *first, *next; /* NONE: there is none */
} kin;

typedef struct writing {
    vgi_output *out;
    vg_skeleton skeleton; /* its offsets are those of the sequence's reference pose */
    kin kin;
    uint32_t *order;      /* joints as the file has them */
    size_t *first_value;  /* of each joint */
    vg_joint_fitter *fitter;
    double *values;
    int place_decimals, angle_decimals;
    double size;          /* diagonal of the reference pose */
    vg_bytes text;        /* what is about to be put */
    uint64_t frames_at, time_at; /* places of the two numbers in the file */
    uint64_t frames;
    bool timed, uneven;   /* all frames so far have times; not at equal distances */
    double first_time, step, last_time;
    double worst;         /* how far a joint lies from where it should */
    size_t worst_joint;
    char *worst_frame;
    char warning[400];
} writing;

static int say(vg_bytes *b, const char *s, vg_err *e)
{
    return vgi_bytes_append(b, s, strlen(s), e);
}

/* x with that many decimals, without "-0". What has too many digits for that is printed as it is. */
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

/* Decimals for a length: 7 digits of the whole figure's size (15 in full precision), but at least 6. */
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

/* The joint that follows j in the file, and how many braces close between them. */
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

/* Offsets as the reference pose has them: it may be another's than the skeleton's. */
static void take_offsets(vg_skeleton *s, const double *reference)
{
    for (size_t j = 0; j < s->njoints; j++) {
        vg_joint *joint = &s->joints[j];
        for (int k = 0; k < 3; k++)
            joint->offset[k] =
                reference[3 * j + k] - (joint->parent == NONE ? 0 : reference[3 * (size_t)joint->parent + k]);
    }
}

static int check_skeleton(const vg_head *h, const char *output, vg_err *e)
{
    if (h->mesh.nv && h->skeleton.njoints == h->mesh.nv) return VG_OK;
    return vg_fail(e, VG_EINPUT, "cannot write '%s': the input holds no skeleton, as a sequence read from BVH does",
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
            if (any) r = say(&w->text, " ", e);
            if (r == VG_OK)
                r = say_fixed(&w->text, values[c], j->channels[c] > 3 ? w->angle_decimals : w->place_decimals, e);
        }
    }
    return r < 0 ? r : say(&w->text, "\n", e);
}

/* ---- the head of the file ---- */

static int say_tabs(vg_bytes *b, size_t depth, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < depth && i < MOST_TABS; i++) r = say(b, "\t", e);
    return r;
}

/* A name must not end its line nor look like a brace. */
static int say_name(vg_bytes *b, const char *name, vg_err *e)
{
    size_t from = b->size;
    int r = say(b, name, e);
    for (size_t i = from; r == VG_OK && i < b->size; i++)
        if (b->data[i] < 0x20 || b->data[i] == 0x7f || b->data[i] == '{' || b->data[i] == '}') b->data[i] = '_';
    return r;
}

/* A joint without channels and children that is called like one. */
static bool is_end_site(const writing *w, uint32_t j)
{
    const vg_joint *joint = &w->skeleton.joints[j];
    if (joint->parent == NONE || joint->nchannels || w->kin.first[j] != NONE) return false;
    const char *parent = w->skeleton.joints[joint->parent].name;
    size_t n = strlen(parent);
    return !strncmp(joint->name, parent, n) && !strcmp(joint->name + n, end_suffix);
}

/* Is every name one that would be read again? */
static int check_names(const writing *w, vg_err *e)
{
    for (uint32_t j = 0; j < w->skeleton.njoints; j++)
        if (!is_end_site(w, j) && strlen(w->skeleton.joints[j].name) > MOST_NAME)
            return vg_fail(e, VG_EINPUT, "cannot write '%s': the name of joint %u is longer than %d bytes",
                           w->out->name, j, MOST_NAME);
    return VG_OK;
}

static int say_opening(writing *w, vg_bytes *b, uint32_t j, size_t depth, vg_err *e)
{
    int r = say_tabs(b, depth, e);
    if (r == VG_OK && is_end_site(w, j)) r = say(b, "End Site", e);
    else if (r == VG_OK) {
        r = say(b, w->skeleton.joints[j].parent == NONE ? "ROOT " : "JOINT ", e);
        if (r == VG_OK) r = say_name(b, w->skeleton.joints[j].name, e);
    }
    if (r == VG_OK) r = say(b, "\n", e);
    if (r == VG_OK) r = say_tabs(b, depth, e);
    return r < 0 ? r : say(b, "{\n", e);
}

static int say_joint(writing *w, vg_bytes *b, uint32_t j, size_t depth, vg_err *e)
{
    const vg_joint *joint = &w->skeleton.joints[j];
    int r = say_opening(w, b, j, depth, e);
    if (r == VG_OK) r = say_tabs(b, depth + 1, e);
    if (r == VG_OK) r = say(b, "OFFSET", e);
    for (int k = 0; r == VG_OK && k < 3; k++) {
        r = say(b, " ", e);
        if (r == VG_OK) r = say_fixed(b, joint->offset[k], w->place_decimals, e);
    }
    if (r == VG_OK) r = say(b, "\n", e);
    if (r < 0 || is_end_site(w, j)) return r;
    char count[24];
    r = say_tabs(b, depth + 1, e);
    if (r == VG_OK) r = say(b, "CHANNELS ", e);
    if (r == VG_OK) r = vgi_bytes_append(b, count, vgi_print_uint(count, joint->nchannels), e);
    for (uint32_t c = 0; r == VG_OK && c < joint->nchannels; c++) {
        r = say(b, " ", e);
        if (r == VG_OK) r = say(b, channel_names[joint->channels[c] - 1], e);
    }
    return r < 0 ? r : say(b, "\n", e);
}

static int say_hierarchy(writing *w, vg_bytes *b, vg_err *e)
{
    size_t depth = 0, closed;
    int r = say(b, "HIERARCHY\n", e);
    for (uint32_t j = w->kin.first[w->skeleton.njoints]; r == VG_OK && j != NONE;) {
        r = say_joint(w, b, j, depth++, e);
        for (j = step_on(w, j, &closed); r == VG_OK && closed > 0; closed--) {
            r = say_tabs(b, --depth, e);
            if (r == VG_OK) r = say(b, "}\n", e);
        }
    }
    return r;
}

/* A number that is known in the end: where it is in the text, blank until then. */
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
    if (r == VG_OK) r = say(&w->text, "MOTION\nFrames: ", e);
    if (r == VG_OK) r = say_field(&w->text, &w->frames_at, e);
    if (r == VG_OK) r = say(&w->text, "Frame Time: ", e);
    if (r == VG_OK) r = say_field(&w->text, &w->time_at, e);
    w->frames_at += w->out->size, w->time_at += w->out->size;
    return r < 0 ? r : put_text(w, e);
}

static int begin_bvh(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    writing *w = *state = vgi_array(1, sizeof *w, e);
    if (!w) return VG_ENOMEM;
    w->out = out;
    int r = vg_skeleton_copy(&w->skeleton, &h->skeleton, e);
    if (r < 0) return r;
    take_offsets(&w->skeleton, h->reference);
    w->size = vg_diagonal(h->reference, h->mesh.nv);
    w->place_decimals = decimals_for(w->size, o->full_precision), w->angle_decimals = o->full_precision ? 12 : 6;
    if (!(w->values = vgi_array(vg_skeleton_channels(&w->skeleton), sizeof *w->values, e))) return VG_ENOMEM;
    r = link_kin(w, e);
    if (r == VG_OK) r = check_names(w, e);
    if (r == VG_OK) r = list_order(w, e);
    if (r == VG_OK) r = vg_joint_fitter_new(&w->fitter, &w->skeleton, e);
    return r < 0 ? r : put_head(w, e);
}

static int put_frame(void *state, const vg_frame *f, vg_err *e)
{
    writing *w = state;
    size_t joint;
    note_time(w, f);
    const double *turns = f->nturns && f->nturns == w->skeleton.njoints ? f->turns : NULL;
    double distance = vg_joint_fitter_fit(w->fitter, f->values, turns, w->values, &joint);
    if (!vgi_finite(w->values, vg_skeleton_channels(&w->skeleton)))
        return vg_fail(e, VG_EINPUT, "its joints lie too far apart for a skeleton");
    int r = note_distance(w, distance, joint, f->name ? f->name : "", e);
    if (r == VG_OK) r = say_row(w, e);
    w->frames++;
    return r < 0 ? r : put_text(w, e);
}

/* Seconds from frame to frame: 1/30 when nothing is known. Over the whole length: one step may have been rounded. */
static double frame_time(const writing *w)
{
    if (w->timed && w->frames > 1 && !w->uneven) return (w->last_time - w->first_time) / (double)(w->frames - 1);
    return w->timed && w->step > 0 ? w->step : 1.0 / 30;
}

/* The number in w->text goes to the right end of its field. */
static int patch_field(writing *w, uint64_t at, vg_err *e)
{
    size_t n = w->text.size; /* no number is longer than its field */
    return vgi_output_patch(w->out, at + FIELD - n, w->text.data, n, e);
}

static int end_bvh(void *state, vg_err *e)
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

static const char *warn_bvh(void *state)
{
    writing *w = state;
    size_t n = 0, room = sizeof w->warning;
    w->warning[0] = 0;
    if (w->worst > 1e-4 * w->size)
        n = (size_t)snprintf(w->warning, room,
                             "the lengths of the bones as they change: joint '%.100s' of frame '%.100s' is off by "
                             "%.3g, %.2g %% of the figure",
                             w->skeleton.joints[w->worst_joint].name, w->worst_frame, w->worst,
                             w->size > 0 ? 100 * w->worst / w->size : 100);
    if (w->uneven)
        snprintf(w->warning + n, room - n, "%sthe times of the frames: they are not at equal distances",
                 n ? "; " : "");
    return w->warning[0] ? w->warning : NULL;
}

static void release_bvh(void *state)
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

const vgi_sequence_format vgi_sequence_bvh = {
    .name = "bvh", .suffix = ".bvh",
    .keeps = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_TIMES | VGI_KEEPS_SKELETON |
             VGI_KEEPS_DOUBLES,
    .sniff = sniff_bvh, .open = open_bvh, .next = next_frame, .close = close_bvh,
    .frames = count_frames,
    .kinds = 1 << VG_VERTICES, .check = check_skeleton, .begin = begin_bvh, .put = put_frame, .end = end_bvh,
    .warning = warn_bvh, .release = release_bvh};
