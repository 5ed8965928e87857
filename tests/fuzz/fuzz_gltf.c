/* fuzz_gltf.c: any bytes as GLB and glTF: what is read is a valid mesh in finite poses; it can be written, and what
 * was written is read as the same. Leaves out how near the second reading comes to the first (test_gltf.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* MOST_VALUES: a small file may show one mesh many times, which is slow and nothing new */
enum { MOST_BYTES = 1 << 15, MOST_FRAMES = 20, MOST_VALUES = 1 << 20 };

static void demand(bool holds)
{
    if (!holds) abort();
}

typedef struct run {
    const vgi_sequence_format *format;
    vgi_input *in;
    void *state, *written;
    vg_head head;
    vg_frame frame;
    vgi_output out;
} run;

static int open_run(run *x, const vgi_sequence_format *format, const void *data, size_t size, vg_err *e)
{
    *x = (run){.format = format, .out = {.fd = -1, .name = "fuzz"}};
    int r = vgi_input_memory(&x->in, data, size, "fuzz", e);
    if (r == VG_OK) r = format->open(&x->state, &x->head, x->in, &(vg_reading){0}, "'fuzz'", e);
    if (r == VG_OK) r = vg_mesh_check(&x->head.body.mesh, "'fuzz'", e);
    return r < 0 ? r : vg_frame_shape(&x->frame, &x->head, e);
}

static void close_run(run *x)
{
    x->format->close(x->state);
    if (x->written) x->format->release(x->written);
    vg_head_clear(&x->head);
    vg_frame_clear(&x->frame);
    vgi_input_free(&x->in);
    if (x->out.fd >= 0) close(x->out.fd);
    vgi_output_clear(&x->out);
}

static int next(run *x, vg_err *e)
{
    demand(vg_frame_rename(&x->frame, "", e) == VG_OK);
    x->frame.has_time = false;
    int r = x->format->next(x->state, &x->frame, e);
    demand(r <= 0 || vgi_finite(x->frame.values, 3 * x->head.count));
    demand(r <= 0 || vgi_is_utf8(x->frame.name, strlen(x->frame.name)));
    return r;
}

static void read_again(const run *x, uint64_t frames)
{
    run y;
    vg_err e = {0};
    char *text = malloc((size_t)x->out.size + 1);
    demand(text && pread(x->out.fd, text, (size_t)x->out.size, 0) == (ssize_t)x->out.size);
    demand(open_run(&y, x->format, text, (size_t)x->out.size, &e) == VG_OK);
    demand(vg_mesh_same(&x->head.body.mesh, "a", &y.head.body.mesh, "b", &e) == VG_OK);
    uint64_t n = 0;
    while (next(&y, &e) > 0) n++;
    demand(n == frames);
    close_run(&y);
    free(text);
}

/* What can be written in binary32 is, but for sums of frames that overflow there. What was not read to its end is not
 * compared: vertices that only a later frame tells apart would be welded. */
static void write_run(run *x, size_t most_targets)
{
    const vg_sink_options o = {.most_targets = most_targets, .quantize = most_targets % 2};
    vg_err e = {0};
    uint64_t n = 0;
    int more = 0;
    demand((x->out.fd = vgi_nameless_file(&e)) >= 0);
    int r = x->format->begin(&x->written, &x->head, &o, &x->out, &e);
    while (r == VG_OK && n < MOST_FRAMES && (more = next(x, &e)) > 0)
        if ((r = x->format->put(x->written, &x->frame, &e)) == VG_OK) n++;
    demand(r == VG_OK || r == VG_EINPUT);
    if (r < 0 || n == 0) return;
    r = x->format->end(x->written, &e);
    if (r == VG_EINPUT && strstr(e.message, "in binary32")) return;
    demand(r == VG_OK && vgi_output_flush(&x->out, &e) == VG_OK);
    x->format->warning(x->written);
    if (more == 0) read_again(x, n);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const vgi_sequence_format *f = vgi_sequence_glb.sniff(data, size) ? &vgi_sequence_glb : &vgi_sequence_gltf;
    run x;
    vg_err e = {0};
    if (size > MOST_BYTES) return 0;
    vgi_sequence_gltf.sniff(data, size);
    int r = open_run(&x, f, data, size, &e);
    demand(r == VG_OK || (r == e.code && e.message[0]));
    if (r == VG_OK) {
        demand(x.head.count > 0 && x.head.count == x.head.body.mesh.nv &&
               vgi_finite(x.head.body.reference, 3 * x.head.count));
        if (x.head.count < MOST_VALUES) write_run(&x, 2 + size % 5);
    }
    close_run(&x);
    return 0;
}
