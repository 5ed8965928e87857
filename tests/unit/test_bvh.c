/* test_bvh.c: skeletons: what is read from BVH, kinematics and back, what is written, and what is refused.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include "test.h"

#include <unistd.h>

enum { MOST_FRAMES = 64 };

/* A sequence in memory: its head and the positions, turns and times of its frames. */
typedef struct sequence {
    vg_head head;
    size_t n;
    double *at[MOST_FRAMES], *turns[MOST_FRAMES], time[MOST_FRAMES];
    bool timed[MOST_FRAMES];
} sequence;

static void clear(sequence *s)
{
    for (size_t i = 0; i < s->n; i++) free(s->at[i]), free(s->turns[i]);
    vg_head_clear(&s->head);
    *s = (sequence){0};
}

/* Read a BVH file of n bytes; VG_OK and *s, or the failure. */
static int read_bytes(sequence *s, const char *text, size_t n, vg_err *e)
{
    const vgi_sequence_format *f = &vgi_sequence_bvh;
    vgi_input *in;
    void *state = NULL;
    vg_frame frame = {0};
    *s = (sequence){0};
    int r = vgi_input_memory(&in, text, n, "t.bvh", e);
    if (r < 0) return r;
    r = f->open(&state, &s->head, in, &(vg_reading){0}, "'t.bvh'", e);
    if (r == VG_OK) r = vg_frame_shape(&frame, &s->head, e);
    while (r >= 0 && s->n < MOST_FRAMES && (r = f->next(state, &frame, e)) > 0) {
        size_t size = 3 * s->head.count * sizeof(double);
        s->at[s->n] = malloc(size ? size : 1);
        memcpy(s->at[s->n], frame.values, size);
        size_t joints;
        const double *turns = vg_frame_turns(&frame, &joints);
        CHECK(joints == s->head.count);
        s->turns[s->n] = malloc(32 * joints + 1);
        if (joints) memcpy(s->turns[s->n], turns, 32 * joints);
        s->time[s->n] = frame.time, s->timed[s->n++] = frame.has_time;
    }
    f->close(state);
    vg_frame_clear(&frame);
    vgi_input_free(&in);
    if (r < 0) clear(s);
    return r;
}

static int read_text(sequence *s, const char *text, vg_err *e)
{
    return read_bytes(s, text, strlen(text), e);
}

/* Write it, with its turns or positions only; the text is the caller's, NULL on failure. *warning (may be NULL): what
 * was lost. */
static char *write_turned(const sequence *s, bool turned, bool full, char *warning, vg_err *e)
{
    const vgi_sequence_format *f = &vgi_sequence_bvh;
    vg_sink_options o = {.full_precision = full};
    vgi_output out = {.fd = vgi_nameless_file(e), .name = "t.bvh"};
    void *state = NULL;
    int r = f->check(&s->head, "t.bvh", e);
    if (r == VG_OK) r = f->begin(&state, &s->head, &o, &out, e);
    for (size_t i = 0; r == VG_OK && i < s->n; i++) {
        char name[32];
        snprintf(name, sizeof name, "f%zu", i);
        vg_frame frame = {.name = name, .has_time = s->timed[i], .time = s->time[i], .values = s->at[i]};
        r = turned ? vg_frame_turn(&frame, s->turns[i], s->head.count, e) : VG_OK;
        if (r == VG_OK) r = f->put(state, &frame, e);
        frame.name = NULL, vg_frame_clear(&frame);
    }
    if (r == VG_OK) r = f->end(state, e);
    if (r == VG_OK) r = vgi_output_flush(&out, e);
    const char *said = r == VG_OK ? f->warning(state) : NULL;
    if (warning) snprintf(warning, 400, "%s", said ? said : "");
    f->release(state);
    char *text = r == VG_OK ? calloc(1, (size_t)out.size + 1) : NULL;
    if (text && pread(out.fd, text, (size_t)out.size, 0) != (ssize_t)out.size) free(text), text = NULL;
    if (out.fd >= 0) close(out.fd);
    vgi_output_clear(&out);
    return text;
}

static char *write_text(const sequence *s, bool full, char *warning, vg_err *e)
{
    return write_turned(s, false, full, warning, e);
}

/* The largest distance between the joints of two sequences. */
static double distance(const sequence *a, const sequence *b)
{
    double most = a->n == b->n && a->head.count == b->head.count ? 0 : INFINITY;
    for (size_t i = 0; i < a->n && most < INFINITY; i++) {
        for (size_t j = 0; j < a->head.count; j++) {
            const double *p = a->at[i] + 3 * j, *q = b->at[i] + 3 * j;
            double d =
                sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]));
            if (!(d <= most)) most = d;
        }
    }
    return most;
}

#define ARM(a, b) "HIERARCHY\nROOT Hip\n{\nOFFSET 0 1 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n" \
    "JOINT Knee\n{\nOFFSET 0 -1 0\nCHANNELS " a "\nEnd Site\n{\nOFFSET 0 -2 0\n}\n}\n}\nMOTION\n" b

static void check_refused(const char *text, int code, const char *words)
{
    sequence s;
    vg_err e = {0};
    int r = read_text(&s, text, &e);
    CHECK(r == code);
    if (!strstr(e.message, words)) {
        CHECK_TEXT(e.message, words);
    }
    if (r >= 0) clear(&s);
}

static void reads_and_poses(void)
{
    sequence s;
    vg_err e;
    /* the knee is bent by 90 degrees about x, the whole turned by 90 about z and moved */
    CHECK(read_text(&s, ARM("3 Zrotation Xrotation Yrotation", "Frames: 2\nFrame Time: 0.5\n"
                            "0 1 0 0 0 0 0 0 0\n7 8 9 90 0 0  0 90 0\n"), &e) == VG_OK);
    CHECK(s.head.kind == VG_VERTICES && s.head.count == 3 && s.head.body.mesh.nv == 3 && s.head.body.mesh.nf == 2 &&
          s.n == 2);
    static const uint32_t bones[] = {0, 1, 1, 2};
    CHECK(!memcmp(s.head.body.mesh.vert, bones, sizeof bones) && s.head.body.mesh.start[2] == 4);
    CHECK(vg_mesh_check(&s.head.body.mesh, "it", &e) == VG_OK);
    static const double rest[] = {0, 1, 0, 0, 0, 0, 0, -2, 0}, turned[] = {7, 8, 9, 8, 8, 9, 8, 8, 7};
    for (int i = 0; i < 9; i++) {
        CHECK_NEAR(s.head.body.reference[i], rest[i], 0);
        CHECK_NEAR(s.at[0][i], rest[i], 0);
        CHECK_NEAR(s.at[1][i], turned[i], 1e-14);
    }
    CHECK(s.timed[1] && s.time[0] == 0 && s.time[1] == 0.5);
    const vg_skeleton *k = &s.head.body.skeleton;
    CHECK(k->njoints == 3 && k->joints[0].parent == UINT32_MAX && k->joints[2].parent == 1 &&
          k->joints[2].nchannels == 0);
    CHECK_TEXT(k->joints[0].name, "Hip");
    CHECK_TEXT(k->joints[2].name, "Knee.end");
    CHECK(k->joints[0].nchannels == 6 && !memcmp(k->joints[0].channels, "\1\2\3\6\4\5", 6));
    clear(&s);
}

/* Capitals, CR LF, tabs, a byte order mark, exponents, names with blanks, braces in the same line, values over
 * several lines, several roots, channels of all numbers, an end site with a name. */
static void reads_what_people_have(void)
{
    static const char text[] =
        "\xef\xbb\xbf\r\n hierarchy\r\n\troot  Left Hip \t{ offset 1e0 -2.5E-1 +.5\r\n channels 1 YPOSITION "
        "joint a b{\r\nOFFSET 0 0 1 CHANNELS 0 End Site the end\r\n{ OFFSET 0 0 0 } }\r\njoint \r\n{\r\nCHANNELS 2 Xrotation "
        "Xposition OFFSET 1 2 3 }\r\n}\r\nROOT caf\xe9\r\n{\r\nOFFSET 5 5 5\r\nCHANNELS 0\r\n}\r\nmotion\r\nFRAMES 2\r\n"
        "frame time:.04\r\n 7\r\n\r\n90 8\t \r\n 1\r\n2 3  \r\n\r\n ";
    sequence s;
    vg_err e = {0};
    CHECK(read_text(&s, text, &e) == VG_OK);
    CHECK_TEXT(e.message, "");
    CHECK(s.n == 2 && s.head.count == 5 && s.head.body.mesh.nf == 3);
    if (s.n != 2 || s.head.count != 5) return;
    const vg_joint *j = s.head.body.skeleton.joints;
    CHECK_TEXT(j[0].name, "Left Hip");
    CHECK_TEXT(j[1].name, "a b");
    CHECK_TEXT(j[2].name, "a b.end");
    CHECK_TEXT(j[3].name, "");
    CHECK_TEXT(j[4].name, "caf\xc3\xa9");
    CHECK(j[4].parent == UINT32_MAX && j[3].parent == 0 && j[2].parent == 1);
    static const double second[] = {1, 1, .5, 1, 1, 1.5, 1, 1, 1.5, 4, 3, 3.5, 5, 5, 5};
    for (int i = 0; i < 15; i++) CHECK_NEAR(s.at[1][i], second[i], 1e-15);
    CHECK_NEAR(s.time[1], 0.04, 0);
    char *again = write_text(&s, true, NULL, &e);
    sequence t = {0};
    CHECK(again && read_text(&t, again, &e) == VG_OK);
    CHECK(distance(&s, &t) < 1e-12 && t.head.body.skeleton.joints[1].nchannels == 0 &&
          t.head.body.skeleton.joints[3].nchannels == 2);
    free(again);
    clear(&t);
    clear(&s);
    /* no line end; one pose, no time */
    CHECK(read_text(&s, ARM("0", "Frames: 1\nFrame Time: 1\n1 2 3 0 0 0"), &e) == VG_OK);
    CHECK(s.n == 1 && !s.timed[0]);
    clear(&s);
    CHECK(read_text(&s, ARM("0", "Frames: 0\nFrame Time: 1\n"), &e) == VG_OK && s.n == 0);
    clear(&s);
}

static void refuses(void)
{
    check_refused("", VG_ETRUNC, "'t.bvh' is empty");
    check_refused("HIERARCHY\n", VG_ETRUNC, "line 2: the file ends where ROOT is expected");
    check_refused("HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n", VG_EINPUT, "ROOT expected, not 'MOTION'");
    check_refused("HIERARCHY\nROOT a\nOFFSET 0 0 0\n}\n", VG_EINPUT, "line 3: '{' expected, not 'OFFSET'");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\nMOTION\n",
                  VG_EINPUT, "line 6: OFFSET, CHANNELS, JOINT, End Site or '}' expected, not 'MOTION'");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n", VG_ETRUNC, "line 5: the file ends where");
    check_refused("HIERARCHY\r\nROOT a\r\n{\r\nOFFSET 0 0\r\n}\r\n", VG_EINPUT, "line 5: a number expected, not '}'");
    check_refused("HIERARCHY\rROOT a\r{\rOFFSET 0 0 nan\r}\r", VG_EINPUT, "line 4: 'nan' is not a finite number");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 1,5\n}\n", VG_EINPUT, "line 4: a number expected, not '1,5'");
    check_refused("HIERARCHY\nROOT a\n{\nCHANNELS 0\n}\nMOTION\n", VG_EINPUT, "line 5: joint 'a' has no OFFSET");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0 OFFSET 0 0 0\n}\nMOTION\n",
                  VG_EINPUT, "joint 'a' has two OFFSETs");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0 CHANNELS 0 CHANNELS 0\n}\n", VG_EINPUT, "CHANNELS twice");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nEnd Site\n{\nOFFSET 0 0 0 CHANNELS 0\n}\n}\n",
                  VG_EINPUT, "end site 'a.end' has CHANNELS");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nEnd Site\n{\nOFFSET 0 0 0 JOINT b\n}\n}\n",
                  VG_EINPUT, "OFFSET or '}' expected, not 'JOINT'");
    check_refused("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nEnd Stop\n", VG_EINPUT, "'Site' expected, not 'Stop'");
    check_refused(ARM("7 Xrotation Xrotation Xrotation Xrotation Xrotation Xrotation Xrotation", ""),
                  VG_EINPUT, "line 9: joint 'Knee' has more than 6 positions and rotations");
    check_refused(ARM("2 Xrotation", ""), VG_EINPUT, "a channel (Xposition ... Zrotation) expected, not 'End'");
    check_refused(ARM("-1", ""), VG_EINPUT, "the number of channels expected, not '-1'");
    check_refused(ARM("2 Xposition Xposition", ""), VG_EINPUT, "two channels for one coordinate");
    check_refused(ARM("1 Wrotation", ""), VG_EINPUT, "not 'Wrotation'");
    check_refused(ARM("0", ""), VG_ETRUNC, "'Frames:' is expected");
    check_refused(ARM("0", "Frames: x"), VG_EINPUT, "the number of frames expected, not 'x'");
    check_refused(ARM("0", "Frames: -1\n"), VG_EINPUT, "the number of frames expected, not '-1'");
    check_refused(ARM("0", "Frames: 99999999999999999999\n"), VG_EINPUT, "the number of frames expected");
    check_refused(ARM("0", "Frames: 1\nFrame Time: 0\n"), VG_EINPUT, "line 18: the frame time is not positive");
    check_refused(ARM("0", "Frames: 1\nFrame Time: -0.1\n"), VG_EINPUT, "the frame time is not positive");
    check_refused(ARM("0", "Frames: 99999\nFrame Time: 1e307\n"), VG_EINPUT, "the frame time is too large");
    check_refused(ARM("0", "Frames: 1\nFrame Time: inf\n"), VG_EINPUT, "'inf' is not a finite number");
    check_refused(ARM("0", "Frames: 2\nFrame Time: 1\n1 2 3 4 5 6\n1 2 3 4 5\n"),
                  VG_ETRUNC, "ends in frame 1 of 2, after 5 of 6 values");
    check_refused(ARM("0", "Frames: 1000000000000000000\nFrame Time: 1\n1 2 3 4 5 6\n"),
                  VG_ETRUNC, "ends in frame 1 of");
    check_refused(ARM("0", "Frames: 1\nFrame Time: 1\n1 2 3 4 5 6 7\n"),
                  VG_EINPUT, "line 19: row 1 has 7 values, but there are 6 channels");
    check_refused(ARM("0", "Frames: 1\nFrame Time: 1\n1 2 3 4 5 x\n"),
                  VG_EINPUT, "line 19: a number expected, not 'x'");
    check_refused(ARM("0", "Frames: 1\nFrame Time: 1\n1 2 3 4 5 1e999\n"), VG_EINPUT, "not a finite number");
    check_refused("HIERARCHY ROOT a\n{ OFFSET 0 0 0 } MOTION Frames: 999999999999999999 Frame Time: 1\n",
                  VG_ETRUNC, "fewer than the");
    check_refused("HIERARCHY ROOT a\n{ OFFSET 0 0 1e308 JOINT b\n{ OFFSET 0 0 1e308 } } MOTION Frames: 0 Frame Time: 1\n",
                  VG_EINPUT, "the position of joint 'b' is too large");
}

/* Each prefix of a file is refused, in words, but those that only lack the line end, and the hierarchy alone, which is a
 * skeleton at rest. */
static void refuses_prefixes(void)
{
    static const char text[] = ARM("1 Xrotation", "Frames: 2\nFrame Time: 0.5\n0 1 0 0 0 0 11\n7 8 9 90 0 0 22\n");
    const size_t hierarchy = (size_t)(strstr(text, "MOTION") - text);
    for (size_t n = 0; n < sizeof text - 1; n++) {
        sequence s;
        vg_err e = {0};
        int r = read_bytes(&s, text, n, &e);
        CHECK((r == VG_OK) == (n >= sizeof text - 3 || n == hierarchy || n == hierarchy - 1) && (r == VG_OK || e.message[0]));
        if (r == VG_OK) clear(&s);
    }
}

/* Names of up to 1024 bytes, counted in UTF-8: what is read can be written and read again. */
static void limits_names(void)
{
    static const struct { char c; int n, code; } cases[] = {
        {'a', 1024, VG_OK}, {'a', 1025, VG_EINPUT}, {'\xe9', 512, VG_OK}, {'\xe9', 513, VG_EINPUT}, {'a', 3000, VG_EINPUT}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char name[3001] = {0}, text[3200];
        sequence s, t = {0};
        vg_err e = {0};
        memset(name, cases[i].c, (size_t)cases[i].n);
        snprintf(text, sizeof text, "HIERARCHY\nROOT %s\n{ OFFSET 1 2 3 End Site { OFFSET 0 0 1 } }\nMOTION Frames: 1\n"
                 "Frame Time: 1\n\n", name);
        CHECK(read_text(&s, text, &e) == cases[i].code);
        if (cases[i].code != VG_OK) {
            CHECK(strstr(e.message, "line 2: a name is longer than 1024 bytes"));
            continue;
        }
        char *again = write_text(&s, false, NULL, &e);
        CHECK(again && read_text(&t, again, &e) == VG_OK && distance(&s, &t) == 0);
        free(again);
        free(s.head.body.skeleton.joints[0].name);
        s.head.body.skeleton.joints[0].name = strdup(text); /* as a stream might hold it */
        if (strlen(text) > 1024)
            CHECK(!write_text(&s, false, NULL, &e) && strstr(e.message, "the name of joint 0 is longer"));
        clear(&s);
        clear(&t);
    }
}

static void limits_depth(void)
{
    vg_bytes b = {0};
    vg_err e = {0};
    sequence s;
    for (int deep = 0; deep < 2; deep++) {
        size_t n = 4096 + (size_t)deep;
        b.size = 0;
        CHECK(vgi_bytes_append(&b, "HIERARCHY\n", 10, &e) == VG_OK);
        for (size_t i = 0; i < n; i++)
            CHECK(vgi_bytes_append(&b, i ? "JOINT a\n{OFFSET 0 0 1\n" : "ROOT  a\n{OFFSET 0 0 1\n", 22, &e) == VG_OK);
        for (size_t i = 0; i < n; i++) CHECK(vgi_bytes_append(&b, "}", 1, &e) == VG_OK);
        CHECK(vgi_bytes_append(&b, "MOTION\nFrames: 1\nFrame Time: 1\n", 32, &e) == VG_OK);
        b.data[b.size - 1] = ' ';
        int r = read_bytes(&s, (char *)b.data, b.size, &e);
        CHECK(r == (deep ? VG_EINPUT : VG_OK));
        if (r < 0) continue;
        CHECK_NEAR(s.at[0][3 * n - 1], (double)n, 0);
        char *text = write_text(&s, false, NULL, &e);
        CHECK(text && strlen(text) < 2000000); /* indentation does not grow without end */
        sequence t = {0};
        CHECK(text && read_text(&t, text, &e) == VG_OK && distance(&s, &t) == 0);
        free(text);
        clear(&t);
        clear(&s);
    }
    CHECK(strstr(e.message, "nested more than 4096 deep"));
    vg_bytes_clear(&b);
}

/* ---- writing ---- */

static uint64_t seed = 88172645463325252u;
static double uniform(double low, double high)
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return low + (high - low) * (double)(seed >> 11) / 9007199254740992.0;
}

static void append(vg_bytes *b, const char *s)
{
    vg_err e;
    CHECK(vgi_bytes_append(b, s, strlen(s), &e) == VG_OK);
}

/* A body of 10 joints with three-armed hip and chest; `order` is the rotations of each. Smooth motion of n frames. */
static void make_body(vg_bytes *b, const char *order, int n, double size)
{
    static const struct { const char *name; double x, y, z; int closes; } joints[] = {
        {"Hip", 0, 0, 0, 0}, {"LLeg", 1, -1, 0, 0}, {"LKnee", 0, -4, .5, 0}, {"LFoot", 0, -4, -.5, 3},
        {"RLeg", -1, -1, 0, 0}, {"RKnee", 0, -4, .5, 2}, {"Chest", 0, 3, .2, 0}, {"LArm", 2, 1, 0, 1},
        {"RArm", -2, 1, 0, 1}, {"Head", 0, 2, .3, 3}};
    char line[200];
    b->size = 0;
    append(b, "HIERARCHY\n");
    for (size_t j = 0; j < sizeof joints / sizeof *joints; j++) {
        snprintf(line, sizeof line, "%s %s\n{\nOFFSET %g %g %g\nCHANNELS %s %s\n", j ? "JOINT" : "ROOT", joints[j].name,
                 size * joints[j].x, size * joints[j].y, size * joints[j].z,
                 j ? "3" : "6 Xposition Yposition Zposition", order);
        append(b, line);
        if (joints[j].closes) {
            snprintf(line, sizeof line, "End Site\n{\nOFFSET %g %g 0\n}\n", size * .3, -size);
            append(b, line);
        }
        for (int c = 0; c < joints[j].closes; c++) append(b, "}\n");
    }
    append(b, "}\n");
    b->size -= 2;
    snprintf(line, sizeof line, "MOTION\nFrames: %d\nFrame Time: 0.0333\n", n);
    append(b, line);
    double phase[33], extent[33];
    for (int i = 0; i < 33; i++) phase[i] = uniform(0, 6), extent[i] = uniform(20, 60);
    for (int f = 0; f < n; f++) {
        for (int i = 0; i < 33; i++) {
            double angle = i < 3 ? size * (f + i) : extent[i] * sin(0.15 * f + phase[i]) + (i == 4 ? 20 * f : 0);
            snprintf(line, sizeof line, "%.9f ", angle);
            append(b, line);
        }
        append(b, "\n");
    }
}

/* The largest change of a value (positions left out) from one frame to the next in BVH text. */
static double largest_step(const char *text)
{
    const char *p = strstr(text, "Frame Time:");
    const char *end = text + strlen(text);
    double last[33], most = 0, x;
    bool first = true;
    p = strchr(p, '\n') + 1;
    for (size_t i = 0; (p = vgi_parse_double(p, end, &x)); i++) {
        if (i % 33 >= 3 && !first) most = fmax(most, fabs(x - last[i % 33]));
        last[i % 33] = x;
        if (i % 33 == 32) first = false;
        while (p < end && (*p == ' ' || *p == '\n')) p++;
    }
    return most;
}

static void there_and_back(void)
{
    static const char *const orders[] = {
        "Zrotation Xrotation Yrotation", "Zrotation Yrotation Xrotation", "Xrotation Yrotation Zrotation",
        "Xrotation Zrotation Yrotation", "Yrotation Xrotation Zrotation", "Yrotation Zrotation Xrotation",
        "Zrotation Xrotation Zrotation", "Xrotation Zrotation Xrotation", "Yrotation Xrotation Yrotation"};
    static const double sizes[] = {1, 1e-3, 1e4};
    vg_bytes b = {0};
    for (size_t i = 0; i < sizeof orders / sizeof *orders; i++) {
        for (size_t k = 0; k < 3; k++) {
            for (int full = 0; full < 2; full++) {
                sequence s, t = {0};
                vg_err e = {0};
                char warning[400];
                make_body(&b, orders[i], 40, sizes[k]);
                CHECK(read_bytes(&s, (char *)b.data, b.size, &e) == VG_OK);
                char *text = write_text(&s, full, warning, &e);
                CHECK(text && read_text(&t, text, &e) == VG_OK);
                CHECK_TEXT(e.message, "");
                CHECK_TEXT(warning, "");
                CHECK_NEAR(distance(&s, &t) / vg_diagonal(s.head.body.reference, s.head.count), 0,
                           full ? 2e-12 : 2e-7);
                CHECK_NEAR(t.time[39], 39 * 0.0333, 1e-8);
                for (size_t j = 0; j < s.head.body.skeleton.njoints; j++) {
                    CHECK(s.head.body.skeleton.joints[j].parent == t.head.body.skeleton.joints[j].parent);
                    CHECK_TEXT(s.head.body.skeleton.joints[j].name, t.head.body.skeleton.joints[j].name);
                }
                if (text && i < 6) CHECK(largest_step(text) < 60); /* smooth motion: no jump by half a turn */
                char *again = text ? write_text(&t, full, warning, &e) : NULL;
                sequence u = {0};
                CHECK(again && read_text(&u, again, &e) == VG_OK &&
                      distance(&s, &u) / sizes[k] < (full ? 1e-10 : 1e-5));
                free(text);
                free(again);
                clear(&u);
                clear(&s);
                clear(&t);
            }
        }
    }
    vg_bytes_clear(&b);
}

/* Frames that say how their joints have turned: every angle comes back, also those about a bone itself and of a joint
 * at the end, of hinges and of joints with rotations about two axes. */
static void brings_turns_back(void)
{
    static const char head[] =
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        "JOINT b\n{\nOFFSET 0 2 0\nCHANNELS 3 Yrotation Xrotation Zrotation\n"
        "JOINT hinge\n{\nOFFSET 0 2 0\nCHANNELS 1 Yrotation\n"
        "JOINT two\n{\nOFFSET 0 2 0\nCHANNELS 2 Zrotation Yrotation\n"
        "JOINT end\n{\nOFFSET 0 1 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n}\n}\n}\n}\n"
        "JOINT alone\n{\nOFFSET 1 0 0\nCHANNELS 3 Zrotation Xrotation Zrotation\n}\n}\nMOTION\nFrames: 30\nFrame Time: 1\n";
    enum { CHANNELS = 18, FRAMES = 30 };
    double want[FRAMES][CHANNELS], x;
    char number[32];
    vg_bytes b = {0};
    sequence s, t = {0};
    vg_err e = {0};
    append(&b, head);
    for (int f = 0; f < FRAMES; f++)
        for (int i = 0; i < CHANNELS; i++) { /* the middle angle of z x z keeps its sign: 0 would be gimbal lock */
            want[f][i] = i == CHANNELS - 2 ? uniform(20, 80) : uniform(-40, 40);
            snprintf(number, sizeof number, "%.12f%s", want[f][i], i + 1 < CHANNELS ? " " : "\n");
            append(&b, number);
        }
    CHECK(read_bytes(&s, (char *)b.data, b.size, &e) == VG_OK);
    char *text = write_turned(&s, true, true, NULL, &e);
    CHECK_TEXT(e.message, "");
    CHECK(text && read_text(&t, text, &e) == VG_OK);
    CHECK(distance(&s, &t) < 1e-9);
    const char *p = strchr(strstr(text, "Frame Time:"), '\n') + 1, *end = text + strlen(text);
    for (int f = 0; f < FRAMES; f++)
        for (int i = 0; i < CHANNELS; i++) {
            while (p < end && (*p == ' ' || *p == '\n')) p++;
            const char *next = vgi_parse_double(p, end, &x);
            CHECK(next != NULL);
            if (!next) goto done;
            CHECK_NEAR(x, want[f][i], 1e-8);
            p = next;
        }
done:
    free(text);
    clear(&s);
    clear(&t);
    vg_bytes_clear(&b);
}

/* A joint with arms in two directions turns as it was turned, one with one arm without twist,
 * one without any not at all. */
static void finds_turns(void)
{
    static const char text[] =
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        "JOINT b\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 1 0 0\n}\n}\n"
        "JOINT c\n{\nOFFSET 0 2 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\n"
        "MOTION\nFrames: 2\nFrame Time: 1\n1 2 3 30 40 50  0 0 0  0 70 0\n1 2 3 30 40 50  0 77 0  20 30 88\n";
    sequence s;
    vg_err e;
    vg_joint_fitter *f;
    double values[12];
    size_t joint;
    CHECK(read_text(&s, text, &e) == VG_OK);
    CHECK(vg_skeleton_channels(&s.head.body.skeleton) == 12);
    CHECK(vg_joint_fitter_new(&f, &s.head.body.skeleton, &e) == VG_OK);
    /* b lies on a: that it turns with a is seen from its end */
    CHECK_NEAR(vg_joint_fitter_fit(f, s.at[0], NULL, values, &joint), 0, 1e-8);
    static const double first[] = {1, 2, 3, 30, 40, 50, 0, 0, 0, 0, 70, 0};
    for (int i = 0; i < 12; i++) CHECK_NEAR(values[i], first[i], 1e-6);
    CHECK_NEAR(vg_joint_fitter_fit(f, s.at[1], NULL, values, &joint), 0, 1e-8);
    for (int i = 3; i < 9; i++) CHECK_NEAR(values[i], first[i], 1e-6);
    /* 20 about z, ... */
    double down[3] = {0, 1, 0}, now[3], q[4] = {cos(10 * M_PI / 180), 0, 0, sin(10 * M_PI / 180)};
    /* ... then 30 about x */
    double x[4] = {cos(15 * M_PI / 180), sin(15 * M_PI / 180), 0, 0};
    vg_quat_multiply(q, x, q);
    vg_quat_apply(q, down, now);
    vg_quat_between(down, now, x);
    vg_skeleton_pose(&s.head.body.skeleton, values, s.at[0], (double[20]){0});
    CHECK(distance(&s, &s) == 0);
    double turns[20], back[4], local[4];
    vg_skeleton_pose(&s.head.body.skeleton, values, s.at[0], turns);
    back[0] = turns[0];
    for (int i = 1; i < 4; i++) back[i] = -turns[i];
    vg_quat_multiply(back, turns + 12, local);
    for (int i = 0; i < 4; i++) CHECK_NEAR(local[i] * (local[0] < 0 ? -1 : 1), x[i], 1e-8);
    vg_joint_fitter_free(&f);
    clear(&s);
}

/* Hinges, too few and too many rotations, gimbal lock, coincident joints, a bone that is turned over: always finite,
 * and as near as can be. */
static void fits_what_it_can(void)
{
    static const struct { const char *channels; double x, y, z, reached; } cases[] = {
        {"1 Xrotation", 0, -1, -1, 0},  /* in the plane of the hinge */
        {"1 Xrotation", .6, -.8, 0, 1}, /* out of it: as far as it goes */
        {"2 Zrotation Xrotation", .6, -.64, .48, 0},
        {"2 Zrotation Zrotation", .6, -.8, 0, 0},
        {"5 Zrotation Xrotation Yrotation Zrotation Xrotation", .6, -.64, .48, 0},
        {"3 Zrotation Xrotation Yrotation", 0, 1, 0, 0}, /* turned over */
        {"3 Zrotation Xrotation Yrotation", 0, 0, 0, 4}, /* its end lies on it */
        {"3 Yrotation Xrotation Zrotation", 0, 0, -1, 0}, /* Xrotation 90: gimbal lock */
        {"3 Zrotation Zrotation Xrotation", 0, -.6, .8, 0},
        {"0", 0, -1, 0, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[600], format[600];
        snprintf(format, sizeof format, "%s", ARM("%s", "Frames: 0\nFrame Time: 1\n"));
        snprintf(text, sizeof text, format, cases[i].channels);
        sequence s;
        vg_err e = {0};
        CHECK(read_text(&s, text, &e) == VG_OK);
        CHECK_TEXT(e.message, "");
        double length = sqrt(cases[i].x * cases[i].x + cases[i].y * cases[i].y + cases[i].z * cases[i].z);
        double l = length > 0 ? 2 / length : 0, values[12] = {0};
        double pose[9] = {0, 1, 0, 0, 0, 0, l * cases[i].x, l * cases[i].y, l * cases[i].z};
        vg_joint_fitter *f;
        size_t joint;
        CHECK(vg_joint_fitter_new(&f, &s.head.body.skeleton, &e) == VG_OK);
        for (int k = 0; k < 3; k++) {
            double d = vg_joint_fitter_fit(f, pose, NULL, values, &joint);
            CHECK(vgi_finite(values, vg_skeleton_channels(&s.head.body.skeleton)));
            if (cases[i].reached == 0) CHECK_NEAR(d, 0, 1e-5);
            else CHECK(d > 0.5 && d <= cases[i].reached + 1 && joint == 2);
        }
        vg_joint_fitter_free(&f);
        clear(&s);
    }
}

/* A hinge that turns beyond half a turn goes on: 170, 180, 190. */
static void goes_on_turning(void)
{
    static const char text[] = ARM("1 Xrotation", "Frames: 60\nFrame Time: 1\n");
    vg_bytes b = {0};
    sequence s, t = {0};
    vg_err e;
    append(&b, text);
    for (int i = 0; i < 60; i++) {
        char line[80];
        snprintf(line, sizeof line, "0 1 0 0 0 0 %d\n", 10 * i);
        append(&b, line);
    }
    CHECK(read_bytes(&s, (char *)b.data, b.size, &e) == VG_OK && s.n == 60);
    char *again = write_text(&s, false, NULL, &e);
    CHECK(again && strstr(again, " 590.000000\n") && read_text(&t, again, &e) == VG_OK && distance(&s, &t) < 1e-6);
    free(again);
    clear(&s);
    clear(&t);
    vg_bytes_clear(&b);
}

static void says_what_is_lost(void)
{
    sequence s;
    vg_err e = {0};
    char warning[400];
    CHECK(read_text(&s, ARM("3 Xrotation Yrotation Zrotation", "Frames: 3\nFrame Time: 0.25\n0 1 0 0 0 0 0 0 0\n"
                            "0 1 0 0 0 0 0 0 0\n0 1 0 0 0 0 0 0 0\n"), &e) == VG_OK);
    s.at[1][7] = -2.5; /* the end is half a unit further away */
    char *text = write_text(&s, false, warning, &e);
    CHECK(text && strstr(warning, "joint 'Knee.end' of frame 'f1' is off by 0.5, 17 % of the figure"));
    CHECK(text && strstr(text, "Frame Time:               0.2500000000\n") &&
          strstr(text, "Frames:                          3\n"));
    free(text);
    s.time[2] = 0.6;
    text = write_text(&s, false, warning, &e);
    CHECK(text && strstr(warning, "; the times of the frames, which are not evenly spaced") &&
          strstr(text, " 0.2500000000\n"));
    free(text);
    s.timed[0] = s.timed[1] = s.timed[2] = false;
    text = write_text(&s, false, warning, &e);
    CHECK(text && !strstr(warning, "times") && strstr(text, " 0.0416666667\n"));
    free(text);
    vg_skeleton_clear(&s.head.body.skeleton);
    CHECK(!write_text(&s, false, warning, &e) &&
          strstr(e.message, "cannot write 't.bvh': the input has no skeleton"));
    clear(&s);
}

/* Six channels on an inner joint: what its bone does is carried whole, and the joint keeps its place. */
static void keeps_places_of_joints(void)
{
    sequence s, t = {0};
    vg_err e;
    char warning[400];
    CHECK(read_text(&s, ARM("6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
                            "Frames: 2\nFrame Time: 1\n0 1 0 10 20 30 0 -1 0 0 0 0\n0 1 0 10 20 30 .25 -1.75 .5 40 50 60\n"),
                    &e) == VG_OK);
    char *text = write_text(&s, false, warning, &e);
    CHECK(text && read_text(&t, text, &e) == VG_OK && distance(&s, &t) < 2e-6);
    CHECK_TEXT(warning, "");
    free(text);
    clear(&s);
    clear(&t);
}

/* Joints that are not in the order of a file, names that would break it. */
static void writes_any_skeleton(void)
{
    vg_joint joints[] = {{.name = (char *)"a\nb", .parent = UINT32_MAX, .nchannels = 3, .channels = {1, 2, 3}},
                         {.name = (char *)"c", .parent = UINT32_MAX, .nchannels = 1, .channels = {2}},
                         {.name = (char *)"{d}", .parent = 0, .offset = {1, 0, 0}},
                         {.name = (char *)"e", .parent = 1, .offset = {0, 1, 0}, .nchannels = 1, .channels = {6}},
                         {.name = (char *)"a\nb.end", .parent = 0, .offset = {0, 0, 1}}};
    double pose[] = {0, 0, 0, 5, 6, 7, 1, 0, 0, 5, 7, 7, 0, 0, 1};
    sequence s = {.n = 1, .at = {pose}}, t;
    vg_err e = {0};
    s.head.body.skeleton = (vg_skeleton){5, joints};
    s.head.body.reference = pose, s.head.count = s.head.body.mesh.nv = 5;
    char *text = write_text(&s, false, NULL, &e);
    CHECK(text && read_text(&t, text, &e) == VG_OK && t.head.count == 5);
    CHECK_TEXT(e.message, "");
    if (!text || t.head.count != 5) return;
    static const int order[] = {0, 2, 4, 1, 3};
    for (int j = 0; j < 5; j++)
        for (int k = 0; k < 3; k++) CHECK_NEAR(t.at[0][3 * j + k], pose[3 * order[j] + k], 1e-6);
    CHECK_TEXT(t.head.body.skeleton.joints[0].name, "a_b");
    CHECK_TEXT(t.head.body.skeleton.joints[1].name, "_d_");
    CHECK_TEXT(t.head.body.skeleton.joints[2].name, "a_b.end");
    free(text);
    clear(&t);
}

/* A hair below zero is zero, without a sign. */
static void writes_no_minus_zero(void)
{
    vg_joint joints[] = {{.name = (char *)"a", .parent = UINT32_MAX, .nchannels = 3, .channels = {1, 2, 3}},
                         {.name = (char *)"b", .parent = 0, .offset = {10, -1e-12, 0}}};
    double pose[] = {-1e-12, -0.0, 3, 10, -1e-12, 3};
    sequence s = {.n = 1, .at = {pose}};
    vg_err e = {0};
    s.head.body.skeleton = (vg_skeleton){2, joints};
    s.head.body.reference = pose, s.head.count = s.head.body.mesh.nv = 2;
    char *text = write_text(&s, false, NULL, &e);
    CHECK(text && !strstr(text, "-0"));
    free(text);
}

/* Times that were rounded say the frame time together, not the first two of them. */
static void frame_time_is_of_the_whole(void)
{
    vg_joint joints[] = {{.name = (char *)"a", .parent = UINT32_MAX, .nchannels = 3, .channels = {1, 2, 3}}};
    double pose[] = {1, 2, 3};
    sequence s = {.n = 4, .at = {pose, pose, pose, pose}, .time = {0, 0.0333, 0.0667, 0.1}, .timed = {true, true, true, true}};
    vg_err e = {0};
    s.head.body.skeleton = (vg_skeleton){1, joints};
    s.head.body.reference = pose, s.head.count = s.head.body.mesh.nv = 1;
    char *text = write_text(&s, false, NULL, &e);
    CHECK(text && strstr(text, " 0.0333333333\n"));
    free(text);
}

static void tells_its_files(void)
{
    const vgi_sequence_format *f = &vgi_sequence_bvh;
    CHECK(f->sniff((const unsigned char *)"HIERARCHY\nROOT", 14) &&
          f->sniff((const unsigned char *)" \r\nhierarchy", 12));
    CHECK(!f->sniff((const unsigned char *)"HIERARCHYX", 10) && !f->sniff((const unsigned char *)"v 0 0 0", 7) &&
          !f->sniff(NULL, 0));
    CHECK(vgi_sequence_by_suffix("a/Walk.BVH") == f && vgi_sequence_by_name("bvh", 3) == f);
}

TESTS({"reads_and_poses", reads_and_poses}, {"reads_what_people_have", reads_what_people_have}, {"refuses", refuses},
      {"refuses_prefixes", refuses_prefixes}, {"limits_names", limits_names}, {"limits_depth", limits_depth},
      {"there_and_back", there_and_back}, {"finds_turns", finds_turns}, {"brings_turns_back", brings_turns_back},
      {"fits_what_it_can", fits_what_it_can}, {"goes_on_turning", goes_on_turning},
      {"says_what_is_lost", says_what_is_lost}, {"keeps_places_of_joints", keeps_places_of_joints},
      {"writes_any_skeleton", writes_any_skeleton}, {"writes_no_minus_zero", writes_no_minus_zero},
      {"frame_time_is_of_the_whole", frame_time_is_of_the_whole},
      {"tells_its_files", tells_its_files})
