/* fuzz_bvh.c: BVH files: what is read is a valid skeleton in finite poses; it can be written, and what was written is
 * read. Leaves out how near the second reading comes to the first (test_bvh.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_BYTES = 1 << 16, MOST_FRAMES = 50 };

static void demand(bool holds)
{
    if (!holds) abort();
}

/* A reader and its writer. */
typedef struct run {
    vgi_input *in;
    void *state, *written;
    vg_head head;
    vg_frame frame;
    vgi_output out;
} run;

static int open_run(run *x, const void *data, size_t size, vg_err *e)
{
    *x = (run){.out = {.fd = -1, .name = "fuzz"}};
    int r = vgi_input_memory(&x->in, data, size, "fuzz", e);
    if (r == VG_OK) r = vgi_sequence_bvh.open(&x->state, &x->head, x->in, &(vg_reading){0}, "'fuzz'", e);
    return r < 0 ? r : vg_frame_shape(&x->frame, &x->head, e);
}

static void close_run(run *x)
{
    vgi_sequence_bvh.close(x->state);
    if (x->written) vgi_sequence_bvh.release(x->written);
    vg_head_clear(&x->head);
    vg_frame_clear(&x->frame);
    vgi_input_free(&x->in);
    if (x->out.fd >= 0) close(x->out.fd);
    vgi_output_clear(&x->out);
}

static void check_head(const vg_head *h)
{
    vg_err e;
    demand(h->kind == VG_VERTICES && h->count > 0 && h->body.mesh.nv == h->count &&
           h->body.skeleton.njoints == h->count);
    demand(vg_mesh_check(&h->body.mesh, "it", &e) == VG_OK && vgi_finite(h->body.reference, 3 * h->count));
    for (size_t j = 0; j < h->count; j++) {
        const vg_joint *joint = &h->body.skeleton.joints[j];
        demand((joint->parent == UINT32_MAX || joint->parent < j) && joint->nchannels <= 6);
        demand(vgi_is_utf8(joint->name, strlen(joint->name)));
    }
}

/* The text that a run has written is read again, to its end. */
static void read_again(const run *x, uint64_t frames)
{
    run y;
    vg_err e = {0};
    char *text = malloc((size_t)x->out.size + 1);
    demand(text && pread(x->out.fd, text, (size_t)x->out.size, 0) == (ssize_t)x->out.size);
    int r = open_run(&y, text, (size_t)x->out.size, &e);
    demand(r == VG_OK);
    demand(y.head.count == x->head.count && y.head.body.mesh.nf == x->head.body.mesh.nf);
    uint64_t n = 0;
    while ((r = vgi_sequence_bvh.next(y.state, &y.frame, &e)) > 0) n++;
    demand((r == 0 && n == frames) || r == VG_EINPUT); /* rounded up, a place can leave the range of numbers */
    close_run(&y);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const vgi_sequence_format *f = &vgi_sequence_bvh;
    const vg_sink_options o = {.full_precision = size % 2};
    run x;
    vg_err e = {0};
    if (size > MOST_BYTES) return 0;
    f->sniff(data, size);
    int r = open_run(&x, data, size, &e);
    demand(r == VG_OK || (r == e.code && e.message[0]));
    if (r == VG_OK) {
        uint64_t n = 0;
        bool whole = true;
        check_head(&x.head);
        demand((x.out.fd = vgi_nameless_file(&e)) >= 0);
        demand(f->check(&x.head, "fuzz", &e) == VG_OK && f->begin(&x.written, &x.head, &o, &x.out, &e) == VG_OK);
        while (n < MOST_FRAMES && (r = f->next(x.state, &x.frame, &e)) > 0) {
            demand(vgi_finite(x.frame.values, 3 * x.head.count));
            if (whole && f->put(x.written, &x.frame, &e) < 0) whole = false; /* joints too far apart */
            n++;
        }
        if (whole && n) {
            demand(f->end(x.written, &e) == VG_OK && vgi_output_flush(&x.out, &e) == VG_OK);
            f->warning(x.written);
            read_again(&x, n);
        }
    }
    close_run(&x);
    return 0;
}
