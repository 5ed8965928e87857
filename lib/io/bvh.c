/* bvh.c: reads Biovision hierarchies (.bvh), a skeleton and its motion, frame by frame. Kinematics (from channels to
 * joints) are in skeleton.c, writing is in bvh_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/bvh.h"

#include <math.h>
#include <stdlib.h>
#include <strings.h>

enum {
    SHOWN = 40,        /* bytes of the input that a message shows */
    MOST_DEPTH = 4096, /* joints from a root to an end */
    MOST_CHANNELS = 6, /* of a joint, without scales */
    SCALES = 3
};

static const uint32_t NONE = UINT32_MAX;
const char vgi_bvh_end[] = ".end";
const char *const vgi_bvh_channels[] = {"Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation"};
static const char *const scale_channels[SCALES] = {"Xscale", "Yscale", "Zscale"};

/* Statements seen for a joint. */
enum { HAS_OFFSET = 1, HAS_CHANNELS = 2, IS_END = 4 };

typedef struct reading {
    vg_bytes text;       /* the file */
    const char *data, *end, *at;
    const char *subject; /* borrowed */
    vg_skeleton skeleton;
    size_t joints_cap;
    unsigned char *said; /* per joint: statements seen */
    size_t said_cap;
    uint32_t current;    /* joint whose braces are open; NONE: between roots */
    size_t depth;
    vg_bytes kept;       /* per value of a row: 1, or 0 for scales, which are skipped */
    size_t scaled;       /* number of joints with scales */
    size_t channels;     /* values of a row without scales */
    bool still;          /* no motion: one frame at rest */
    bool added;          /* positions of joints that are no roots are added to their OFFSETs */
    uint64_t frames, next;
    double frame_time;
    double *values, *turns;
    vg_note note;
} reading;

static bool is_blank(char c)
{
    return c == ' ' || (c >= '\t' && c <= '\r');
}

static bool is_line_end(char c)
{
    return c == '\n' || c == '\r';
}

static size_t line_of(const reading *b, const char *p)
{
    return vgi_line_number_of(b->data, b->end, p);
}

static void skip_blanks(reading *b)
{
    while (b->at < b->end && is_blank(*b->at)) b->at++;
}

/* Length of the word at p: a brace, or everything up to a blank or brace. */
static size_t word_length(const reading *b, const char *p)
{
    size_t n = 0;
    if (p < b->end && (*p == '{' || *p == '}')) return 1;
    while (p + n < b->end && !is_blank(p[n]) && p[n] != '{' && p[n] != '}') n++;
    return n;
}

/* Report that the file ends, or that something other than `expected` follows. */
static int fail_here(reading *b, const char *expected, vg_err *e)
{
    size_t n = word_length(b, b->at);
    if (n == 0)
        return vg_fail(e, VG_ETRUNC, "%s line %zu: the file ends where %s is expected", b->subject,
                       line_of(b, b->at), expected);
    return vg_fail(e, VG_EINPUT, "%s line %zu: %s expected, not '%.*s'", b->subject, line_of(b, b->at), expected,
                   n > SHOWN ? SHOWN : (int)n, b->at);
}

/* Take the next word if it is this one, ignoring case. */
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

/* "Frames:", "Frame Time:": a blank in `label` matches any number of blanks; the colon may be separate or missing. */
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

/* A finite number that is a whole word. */
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

/* The rest of the line, or up to a brace in it, because names may contain blanks. */
static int take_name(reading *b, char **name, vg_err *e)
{
    while (b->at < b->end && is_blank(*b->at) && !is_line_end(*b->at)) b->at++;
    const char *start = b->at, *p = start;
    while (p < b->end && !is_line_end(*p) && *p != '{') p++;
    const char *stop = p;
    while (p > start && is_blank(p[-1])) p--;
    b->at = stop;
    size_t n = p - start > VGI_BVH_NAME ? VGI_BVH_NAME + 1 : (size_t)(p - start);
    if (!(*name = vgi_to_utf8(start, n, e))) return VG_ENOMEM;
    if (strlen(*name) <= VGI_BVH_NAME) return VG_OK;
    return vg_fail(e, VG_EINPUT, "%s line %zu: a name is longer than %d bytes", b->subject, line_of(b, start),
                   VGI_BVH_NAME);
}

static char *end_name(const char *parent, vg_err *e)
{
    size_t n = strlen(parent) + sizeof vgi_bvh_end;
    char *name = vgi_array_raw(n, 1, e);
    if (name) snprintf(name, n, "%s%s", parent, vgi_bvh_end);
    return name;
}

/* Start a joint, after its keyword. */
static int open_joint(reading *b, bool is_end, vg_err *e)
{
    vg_skeleton *s = &b->skeleton;
    char *name = NULL;
    int r = take_name(b, &name, e);
    if (r == VG_OK && is_end) { /* nothing refers to a name after "End Site" */
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

/* Report what is wrong with "joint 'Hips'", at the current line */
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
    static const unsigned char keep = 1, pass = 0;
    for (int c = 0; c < SCALES; c++)
        if (take_word(b, scale_channels[c])) return vgi_bytes_append(&b->kept, &pass, 1, e);
    for (int c = 0; c < MOST_CHANNELS; c++) {
        if (!take_word(b, vgi_bvh_channels[c])) continue;
        uint8_t channel = (uint8_t)(c + 1);
        if (channel <= 3 && memchr(j->channels, channel, j->nchannels))
            return wrong_joint(b, "two channels for one coordinate of its position", e);
        if (j->nchannels == MOST_CHANNELS) return wrong_joint(b, "more than 6 positions and rotations", e);
        j->channels[j->nchannels++] = channel;
        return vgi_bytes_append(&b->kept, &keep, 1, e);
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
    if (r == VG_OK && n > MOST_CHANNELS + SCALES) r = wrong_joint(b, "more than 9 channels", e);
    for (int64_t i = 0; r == VG_OK && i < n; i++) r = read_channel(b, j, e);
    b->channels += j->nchannels;
    b->scaled += n > j->nchannels;
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
    if (take_word(b, "EndSite")) return open_joint(b, true, e);
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
    if (r < 0 || take_word(b, "MOTION")) return r;
    b->still = b->at == b->end;
    return b->still ? VG_OK : fail_here(b, "ROOT or MOTION", e);
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
    /* a frame is at least one line; without channels nothing else would limit a false count */
    if (b->channels == 0 && b->frames > (uint64_t)(b->end - b->at))
        return vg_fail(e, VG_ETRUNC, "%s has fewer than the %llu frames that it announces", b->subject,
                       (unsigned long long)b->frames);
    return VG_OK;
}

/* ---- rows ---- */

/* A row of the motion, which may be several lines. */
typedef struct row {
    const char *at;
    uint64_t number;    /* from 1 */
    size_t values;      /* of its first line */
    size_t lines;
} row;

typedef struct rows {
    uint64_t values;
    row first, now, wrong; /* wrong: the first row at fault, with no lines if there is none */
} rows;

static size_t count_words(const char *p, const char *end)
{
    size_t n = 0;
    while (p < end) {
        while (p < end && is_blank(*p)) p++;
        n += p < end;
        while (p < end && !is_blank(*p)) p++;
    }
    return n;
}

static void set_wrong(rows *k, row r)
{
    if (!k->wrong.lines) k->wrong = r;
}

/* A row is one line, or all rows are as many lines each: `room` values are left to the row that this line of n values belongs
 * to. */
static void take_line(rows *k, const char *line, size_t n, size_t room, bool begins)
{
    if (begins) k->now = (row){line, k->now.number + 1, n, 0};
    k->now.lines++;
    if (n > room) set_wrong(k, k->now);
    if (n == room && !k->first.lines) k->first = k->now;
    if (n == room && k->now.lines != k->first.lines) set_wrong(k, k->now.lines > 1 ? k->now : k->first);
    k->values += n;
}

static rows look_at_rows(const reading *b)
{
    const size_t width = b->kept.size;
    rows k = {0};
    for (const char *p = b->at, *stop; p < b->end; p = stop + 1) {
        for (stop = p; stop < b->end && !is_line_end(*stop);) stop++;
        const size_t n = count_words(p, stop), before = (size_t)(k.values % width);
        if (n) take_line(&k, p, n, width - before, !before);
    }
    if (k.values % width && k.values / width >= b->frames) set_wrong(&k, k.now);
    return k;
}

/* A missing value would shift all that follow. A truncated file is reported when its end is reached. */
static int check_rows(reading *b, vg_err *e)
{
    const size_t width = b->kept.size;
    if (width == 0) return VG_OK;
    const rows k = look_at_rows(b);
    if (k.wrong.lines)
        return vg_fail(e, VG_EINPUT, "%s line %zu: row %llu has %zu values, but there are %zu channels", b->subject,
                       line_of(b, k.wrong.at), (unsigned long long)k.wrong.number, k.wrong.values, width);
    const uint64_t whole = k.values / width;
    if (whole <= b->frames) return VG_OK;
    vgi_note(&b->note, "it announces %llu frames but holds %llu, which are read", (unsigned long long)b->frames,
             (unsigned long long)whole);
    b->frames = whole;
    return VG_OK;
}

static int check_places(reading *b, const double *positions, const char *what, vg_err *e)
{
    for (size_t j = 0; j < b->skeleton.njoints; j++)
        if (!vgi_finite(positions + 3 * j, 3))
            return vg_fail(e, VG_EINPUT, "%s line %zu: %s, the position of joint '%s' is too large", b->subject,
                           line_of(b, b->at), what, b->skeleton.joints[j].name);
    return VG_OK;
}

static int open_text(reading *b, vgi_input *in, vg_err *e)
{
    int r = vgi_input_slurp_text(in, &b->text, e);
    if (r < 0) return r;
    if (b->text.size == 0) return vg_fail(e, VG_ETRUNC, "%s is empty", b->subject);
    b->data = b->at = (char *)b->text.data, b->end = b->data + b->text.size;
    r = read_hierarchy(b, e);
    if (b->scaled) vgi_note(&b->note, "left out the scales of %zu joints", b->scaled);
    if (b->still) b->frames = 1;
    if (r < 0 || b->still) return r;
    r = read_motion_head(b, e);
    return r < 0 ? r : check_rows(b, e);
}

/* The bones, in the pose without rotations. */
static int fill_head(reading *b, vg_head *h, vg_err *e)
{
    const vg_skeleton *s = &b->skeleton;
    int r = vg_skeleton_mesh(s, &h->body.mesh, e);
    if (r == VG_OK) r = vg_skeleton_copy(&h->body.skeleton, s, e);
    if (r == VG_OK && !(h->body.reference = vgi_array(s->njoints, 3 * sizeof *h->body.reference, e))) r = VG_ENOMEM;
    if (r < 0) return r;
    h->kind = VG_VERTICES, h->precision = VG_F64, h->count = s->njoints;
    vg_skeleton_pose(s, NULL, h->body.reference, b->turns);
    return check_places(b, h->body.reference, "in the reference pose", e);
}

/* All frames were read: only blanks may follow. */
static int end_motion(reading *b, vg_err *e)
{
    char expected[64];
    skip_blanks(b);
    if (b->at == b->end) return 0;
    snprintf(expected, sizeof expected, "the end of the file after %llu frames", (unsigned long long)b->frames);
    return fail_here(b, expected, e);
}

static int read_row(reading *b, vg_err *e)
{
    double *to = b->values, scale;
    for (size_t i = 0; i < b->kept.size; i++) {
        skip_blanks(b);
        if (b->at == b->end)
            return vg_fail(e, VG_ETRUNC, "%s ends in frame %llu of %llu, after %zu of %zu values", b->subject,
                           (unsigned long long)b->next, (unsigned long long)b->frames, i, b->kept.size);
        int r = take_number(b, "a number", b->kept.data[i] ? to++ : &scale, e);
        if (r < 0) return r;
    }
    return VG_OK;
}

/* Adds OFFSETs to the positions of joints that are no roots. Returns their number; sum: the absolute values of these positions as
 * they were, and of what differs from OFFSET. */
static size_t add_offsets(const vg_skeleton *s, double *values, double sum[2])
{
    size_t n = 0;
    for (size_t j = 0; j < s->njoints; values += s->joints[j++].nchannels) {
        const vg_joint *joint = &s->joints[j];
        for (uint32_t i = 0; joint->parent != NONE && i < joint->nchannels; i++) {
            if (joint->channels[i] > 3) continue;
            double offset = joint->offset[joint->channels[i] - 1];
            sum[0] += fabs(values[i]), sum[1] += fabs(values[i] - offset);
            values[i] += offset;
            n++;
        }
    }
    return n;
}

/* Programs differ: positions of joints that are no roots replace their OFFSETs, or are added to them. Those of the first row tell:
 * they are near OFFSET, or near 0. */
static int find_added(reading *b, vg_err *e)
{
    const char *start = b->at;
    double sum[2] = {0, 0};
    if (!b->frames) return VG_OK;
    int r = read_row(b, e);
    size_t n = r == VG_OK ? add_offsets(&b->skeleton, b->values, sum) : 0;
    b->at = start;
    b->added = n && sum[0] < 0.5 * sum[1];
    if (b->added) vgi_note(&b->note, "positions of joints are near 0, not near their OFFSETs: they are added to them");
    return r;
}

static int open_bvh(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                    vg_err *e)
{
    (void)how;
    reading *b = *state = vgi_array(1, sizeof *b, e);
    if (!b) return VG_ENOMEM;
    b->subject = subject;
    int r = open_text(b, in, e);
    if (r < 0) return r;
    b->values = vgi_array(b->channels, sizeof *b->values, e);
    b->turns = vgi_array(b->skeleton.njoints, 4 * sizeof *b->turns, e);
    if (!b->values || !b->turns) return VG_ENOMEM;
    r = fill_head(b, h, e);
    return r < 0 || b->still ? r : find_added(b, e);
}

static int next_frame(void *state, vg_frame *f, vg_err *e)
{
    reading *b = state;
    char what[96];
    if (b->next == b->frames) return end_motion(b, e);
    int r = b->still ? VG_OK : read_row(b, e);
    if (r < 0) return r;
    if (b->added) add_offsets(&b->skeleton, b->values, (double[2]){0, 0});
    vg_skeleton_pose(&b->skeleton, b->still ? NULL : b->values, f->values, b->turns);
    snprintf(what, sizeof what, "in frame %llu", (unsigned long long)b->next);
    r = check_places(b, f->values, what, e);
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
    vg_bytes_clear(&b->kept);
    free(b->said);
    free(b->values);
    free(b->turns);
    free(b);
}

static const char *note_of(const void *state)
{
    return ((const reading *)state)->note.text;
}

static bool sniff_bvh(const unsigned char *data, size_t n)
{
    static const char first[] = "HIERARCHY";
    size_t i = 0, length = sizeof first - 1;
    while (i < n && is_blank((char)data[i])) i++;
    return n - i >= length && !strncasecmp((const char *)data + i, first, length) &&
           (n - i == length || is_blank((char)data[i + length]));
}

const vgi_sequence_format vgi_sequence_bvh = {
    .name = "bvh", .suffix = ".bvh",
    .keeps = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_TIMES | VGI_KEEPS_SKELETON |
             VGI_KEEPS_DOUBLES,
    .sniff = sniff_bvh, .open = open_bvh, .next = next_frame, .frames = count_frames, .note = note_of,
    .close = close_bvh,
    .kinds = 1 << VG_VERTICES, .check = vgi_bvh_check, .begin = vgi_bvh_begin, .put = vgi_bvh_put,
    .end = vgi_bvh_finish, .warning = vgi_bvh_warning, .release = vgi_bvh_release};
