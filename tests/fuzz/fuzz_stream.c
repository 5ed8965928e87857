/* fuzz_stream.c: the stream reader: it takes or refuses, with a reason; what it takes comes back the same from the
 * writer. Each input is tried as it is and with its checksums mended, since no search finds a checksum by itself.
 * Leaves out what the programs do with a stream.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "mend.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_BYTES = 1 << 16 };

/* ---- reading and writing ---- */

/* A signal is sampled within and outside of its times and traced; shapes that are no vertices become vectors, or the signal is
 * refused. */
static void use_signal(const vg_head *h)
{
    const vg_signal *s = &h->signal;
    vg_err e = {0};
    vg_sampler *p = NULL;
    vg_unshaper *u = NULL;
    vg_graph *g = NULL;
    vg_trace trace;
    double at[2], *x = calloc(s->m + 1, sizeof *x), *shape = calloc(s->d + 1, sizeof *shape), *vectors = NULL;
    demand(x && shape);
    int r = vg_sampler_new(&p, s, false, &e);
    demand(r == VG_OK || r == VG_EINPUT || r == VG_ENOMEM);
    if (r == VG_OK && s->space != VG_SPACE_VERTICES) {
        demand(vg_head_graph(&g, h, &e) == VG_OK && (vectors = calloc(vg_graph_corners(g) + 1, 3 * sizeof *vectors)));
        r = vg_unshaper_new(&u, s, g, h->body.reference, &e);
        demand(r == VG_OK || r == VG_EINPUT);
    }
    for (double time = 0.5; r == VG_OK && time <= 4; time += 0.75) {
        vg_sampler_position(p, time, at);
        vg_sampler_coordinates(p, 1, at, x);
        vg_sampler_shapes(p, 1, x, (double *const[]){shape});
        if (u && vgi_finite(shape, s->d)) (void)!vg_unshaper_vectors(u, shape, vectors, &e);
        else if (!u) vg_sampler_place(p, time, h->body.mesh.nv, shape);
    }
    if (r == VG_OK && s->n * s->m * s->m < 1000 && vg_signal_trace(&trace, s, 2, &e) == VG_OK) vg_trace_clear(&trace);
    vg_unshaper_free(&u);
    vg_sampler_free(&p);
    vg_graph_free(&g);
    free(x);
    free(shape);
    free(vectors);
}

/* A head or frame is used as programs use it: copied, its vector graph built, its signal sampled. */
static void use_head(const vg_head *h)
{
    vg_err e = {0};
    vg_head copy = {0};
    vg_graph *g = NULL;
    demand(vg_head_copy(&copy, h, &e) == VG_OK);
    if (h->body.reference) {
        demand(vg_mesh_check(&h->body.mesh, "it", &e) == VG_OK);
        demand(vg_mesh_same(&h->body.mesh, "first", &copy.body.mesh, "second", &e) == VG_OK);
    }
    if (h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS) {
        demand(vg_head_graph(&g, h, &e) == VG_OK && vg_graph_corners(g) == h->count);
        vg_graph_free(&g);
    }
    if (h->signal.n) use_signal(h);
    vg_head_clear(&copy);
}

static void use_frame(const vg_frame *f, const vg_head *h)
{
    demand(f->name != NULL && vgi_is_utf8(f->name, strlen(f->name)));
    demand(vgi_finite(f->values, h->count * vg_head_width(h)));
    for (size_t i = 0; i < f->nchannels; i++) {
        const vg_channel *c = &f->channels[i];
        demand(*c->name && vgi_is_utf8(c->unit, strlen(c->unit)) && *c->element_name | !c->element && c->width);
        if (c->vertices) demand(c->count && c->width == 1 && c->vertices[c->count - 1] < h->body.mesh.nv);
        else demand(vgi_finite(c->numbers, c->width * c->count));
        size_t n = vg_head_elements(h, c->element);
        demand(c->vertices || n == SIZE_MAX || n == c->count);
    }
    if (vg_head_element(h) == VG_OF_CORNER) demand(vgi_finite(f->root, 3) && !h->nanchors == !vg_frame_anchors(f));
}

/* Read all of data; with fd >= 0 also write it there as a filter would. True when it was a whole stream. */
static bool pass(const unsigned char *data, size_t size, int fd)
{
    vg_err e = {0};
    vg_reader *r = NULL;
    vg_writer *w = NULL;
    vg_frame f = {0};
    int ok = vg_reader_open_memory(&r, data, size, "fuzz", &e);
    if (ok == VG_OK) {
        vg_head *h = vg_reader_head(r);
        use_head(h);
        if (fd >= 0) demand(vg_writer_open(&w, fd, "memory", h, &e) == VG_OK);
        while ((ok = vg_reader_next(r, &f, &e)) > 0) {
            use_frame(&f, h);
            if (w) demand(vg_writer_put(w, &f, &e) == VG_OK);
        }
        if (ok == VG_OK && w) demand(vg_writer_end(w, vg_reader_tail(r), &e) == VG_OK);
        if (ok < 0 && w) vg_writer_abandon(w, "fuzz", 3, e.message);
        vg_writer_close(&w);
    }
    if (ok < 0) demand((e.code == VG_EINPUT || e.code == VG_ETRUNC) && e.code == ok && e.message[0]);
    vg_frame_clear(&f);
    vg_reader_close(&r);
    return ok == VG_OK;
}

/* What pass() writes, in memory of its own; free with munmap. */
static unsigned char *rewritten(const unsigned char *data, size_t size, size_t *n, bool *whole)
{
    struct stat st;
    int fd = memfd_create("fuzz_stream", MFD_CLOEXEC);
    demand(fd >= 0);
    *whole = pass(data, size, fd);
    demand(fstat(fd, &st) == 0);
    *n = (size_t)st.st_size;
    unsigned char *p = *n ? mmap(NULL, *n, PROT_READ, MAP_PRIVATE, fd, 0) : NULL;
    demand(p != MAP_FAILED);
    close(fd);
    return p;
}

/* A whole stream is written as a whole stream, which is written as itself.
 * A broken one is written as a broken one. */
static void there_and_back(const unsigned char *data, size_t size)
{
    size_t n, again_n = 0;
    bool whole, again_whole = false;
    unsigned char *once = rewritten(data, size, &n, &whole), *again = NULL;
    if (once) again = rewritten(once, n, &again_n, &again_whole);
    demand(again_whole == whole);
    if (whole) demand(n == again_n && !memcmp(once, again, n));
    if (once) munmap(once, n);
    if (again) munmap(again, again_n);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > MOST_BYTES) return 0;
    there_and_back(data, size);
    unsigned char *copy = malloc(size ? size : 1);
    demand(copy != NULL);
    if (size) memcpy(copy, data, size);
    mend(copy, size);
    there_and_back(copy, size);
    free(copy);
    return 0;
}
