/* fuzz_cache.c: any bytes as a PC2 or MDD cache: what is read is finite, and comes back the same when written and
 * read.
 * Leaves out the mesh beside a cache.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

enum { MOST_FRAMES = 64 };

static void demand(bool holds)
{
    if (!holds) abort();
}

/* All values of a cache, frame after frame; the code of reading to the end. */
static int read_all(const vgi_sequence_format *format, const void *data, size_t n, vg_bytes *values, vg_head *h)
{
    vg_err e = {0};
    void *state = NULL;
    vgi_input *in;
    vg_frame f = {0};
    size_t frames = 0;
    demand(vgi_input_memory(&in, data, n, "fuzz", &e) == VG_OK);
    int r = format->open(&state, h, in, &(vg_reading){0}, "'fuzz'", &e);
    while (r >= 0 && frames++ < MOST_FRAMES) {
        demand(vg_frame_shape(&f, h, &e) == VG_OK);
        if ((r = format->next(state, &f, &e)) <= 0) break;
        demand(vgi_finite(f.values, 3 * h->count) && (!f.has_time || vgi_finite(&f.time, 1)));
        demand(vgi_bytes_append(values, f.values, 3 * h->count * sizeof *f.values, &e) == VG_OK);
    }
    demand(r >= 0 || (e.code == r && e.message[0]));
    format->close(state);
    vgi_input_free(&in);
    vg_frame_clear(&f);
    return r;
}

static void write_again(const vgi_sequence_format *format, vg_head *h, const vg_bytes *values)
{
    vg_sink_options o = {0};
    vgi_output out = {.fd = memfd_create("fuzz", MFD_CLOEXEC), .name = "fuzz"};
    size_t per_frame = 3 * h->count * sizeof(double);
    vg_head again = {0};
    vg_bytes b = {0}, same = {0};
    void *state = NULL;
    demand(format->begin(&state, h, &o, &out, NULL) == VG_OK);
    for (size_t off = 0; off < values->size; off += per_frame) {
        vg_frame f = {.name = (char *)"f", .values = (double *)(values->data + off)};
        demand(format->put(state, &f, NULL) == VG_OK);
    }
    demand(format->end(state, NULL) == VG_OK && vgi_output_flush(&out, NULL) == VG_OK);
    demand(vgi_bytes_reserve(&b, out.size, NULL) == VG_OK && pread(out.fd, b.data, out.size, 0) == (ssize_t)out.size);
    demand(read_all(format, b.data, out.size, &same, &again) == 0);
    demand(same.size == values->size && !memcmp(same.data, values->data, same.size));
    format->release(state);
    close(out.fd);
    vgi_output_clear(&out);
    vg_bytes_clear(&b);
    vg_bytes_clear(&same);
    vg_head_clear(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static const vgi_sequence_format *const both[] = {&vgi_sequence_pc2, &vgi_sequence_mdd};
    for (int i = 0; i < 2 && n <= 1 << 16; i++) {
        vg_bytes values = {0};
        vg_head h = {0};
        if (read_all(both[i], data, n, &values, &h) == 0) write_again(both[i], &h, &values);
        vg_bytes_clear(&values);
        vg_head_clear(&h);
    }
    return 0;
}
