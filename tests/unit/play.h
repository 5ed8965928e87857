/* play.h: a whole sequence through one of the sequence formats, in memory or through a file without a name.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TEST_PLAY_H
#define VG_TEST_PLAY_H
#include "io/io.h"
#include "test.h"

#include <sys/mman.h>
#include <unistd.h>

typedef struct played {
    int result; /* 0: read to its end */
    vg_err e;
    vg_head h;
    size_t frames;
    double values[512]; /* of all frames, one behind the other */
    size_t n;
    double times[16];
    bool timed;
    char names[256]; /* "a b " */
} played;

static void played_clear(played *p)
{
    vg_head_clear(&p->h);
}

static void note_frame(played *p, const vg_frame *f)
{
    size_t n = p->h.count * vg_head_width(&p->h), used = strlen(p->names);
    if (p->n + n <= sizeof p->values / sizeof *p->values) memcpy(p->values + p->n, f->values, n * sizeof *f->values);
    if (p->frames < 16) p->times[p->frames] = f->time;
    p->timed = f->has_time;
    snprintf(p->names + used, sizeof p->names - used, "%s ", f->name);
    p->n += n;
    p->frames++;
}

/* Read what there is, as a source would. */
static played play(const vgi_sequence_format *format, const void *data, size_t n)
{
    played p = {0};
    void *state = NULL;
    vgi_input *in;
    vg_frame f = {0};
    CHECK(vgi_input_memory(&in, data, n, "x", NULL) == VG_OK);
    p.result = format->open(&state, &p.h, in, &(vg_reading){0}, "'x'", &p.e);
    if (p.result == VG_OK && p.h.body.mesh.nf) p.result = vg_mesh_check(&p.h.body.mesh, "'x'", &p.e);
    while (p.result >= 0) {
        if ((p.result = vg_frame_shape(&f, &p.h, &p.e)) < 0 || (p.result = vg_frame_rename(&f, "", &p.e)) < 0) break;
        if ((p.result = format->next(state, &f, &p.e)) <= 0) break;
        note_frame(&p, &f);
    }
    format->close(state);
    vgi_input_free(&in);
    vg_frame_clear(&f);
    return p;
}

/* The code of a sequence that is refused; its message is left in `message`. */
static char message[480];
static int refused(const vgi_sequence_format *format, const void *data, size_t n)
{
    played p = play(format, data, n);
    snprintf(message, sizeof message, "%s", p.e.message);
    int r = p.result;
    played_clear(&p);
    return r;
}

/* Every beginning of a file is refused as cut short or malformed, and so is the file with a byte behind it. */
static void check_prefixes(const vgi_sequence_format *format, const vg_bytes *whole)
{
    unsigned char *copy = malloc(whole->size + 1);
    for (size_t n = 0; n < whole->size; n++) {
        memcpy(copy, whole->data, n); /* of just this size, so that a sanitizer sees reading too far */
        unsigned char *tight = malloc(n ? n : 1);
        memcpy(tight, copy, n);
        CHECK(refused(format, tight, n) < 0 && message[0]);
        free(tight);
    }
    memcpy(copy, whole->data, whole->size);
    copy[whole->size] = 0;
    CHECK(refused(format, copy, whole->size + 1) == VG_EINPUT);
    free(copy);
}

/* Write frames of a head; the bytes of the file. */
static vg_bytes record(const vgi_sequence_format *format, const vg_head *h, const vg_frame *frames, size_t n,
                       bool full, int *result, char warning[200])
{
    vg_bytes b = {0};
    vg_err e;
    vg_sink_options o = {.full_precision = full};
    vgi_output out = {.fd = memfd_create("out", MFD_CLOEXEC), .name = "out"};
    void *state = NULL;
    int r = format->begin(&state, h, &o, &out, &e);
    for (size_t i = 0; i < n && r == VG_OK; i++) r = format->put(state, &frames[i], &e);
    if (r == VG_OK) r = format->end(state, &e);
    if (r == VG_OK) r = vgi_output_flush(&out, &e);
    const char *text = r == VG_OK && format->warning ? format->warning(state) : NULL;
    if (warning) snprintf(warning, 200, "%s", text ? text : "");
    if (r < 0) snprintf(message, sizeof message, "%s", e.message);
    if (state) format->release(state);
    if (r == VG_OK && vgi_bytes_reserve(&b, out.size + 1, NULL) == VG_OK)
        b.size = (size_t)pread(out.fd, b.data, out.size, 0);
    CHECK(r < 0 || b.size == out.size);
    close(out.fd);
    vgi_output_clear(&out);
    *result = r;
    return b;
}
#endif
