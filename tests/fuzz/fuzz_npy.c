/* fuzz_npy.c: any bytes as NPY and NPZ: a head that is read is one that the stream's writer takes, and frames are
 * finite.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

enum { MOST_FRAMES = 64 };

static void demand(bool holds)
{
    if (!holds) abort();
}

static void write_frame(vg_writer *w, const vg_head *h, const vg_frame *f)
{
    vg_err e;
    demand(vgi_finite(f->values, h->count * vg_head_width(h)) && (!f->has_time || vgi_finite(&f->time, 1)));
    demand(f->name && vgi_is_utf8(f->name, strlen(f->name)));
    demand(vg_writer_put(w, f, &e) == VG_OK);
}

/* A source adds the reference that an array without one lacks: here it is zeros. */
static void complete(vg_head *h)
{
    if (!h->body.reference)
        demand((h->body.reference = vgi_array(h->body.mesh.nv, 3 * sizeof *h->body.reference, NULL)) != NULL);
    if (!h->body.reference_name) demand((h->body.reference_name = vgi_copy_string("r", 1, NULL)) != NULL);
}

static void read_all(const vgi_sequence_format *format, const void *data, size_t n)
{
    static int nowhere = -1;
    vg_err e = {0};
    vg_head h = {0};
    void *state = NULL;
    vgi_input *in;
    vg_frame f = {0};
    vg_writer *w = NULL;
    if (nowhere < 0) nowhere = open("/dev/null", O_WRONLY);
    demand(vgi_input_memory(&in, data, n, "fuzz", &e) == VG_OK);
    int r = format->open(&state, &h, in, &(vg_reading){0}, "'fuzz'", &e);
    if (r == VG_OK && h.body.mesh.nf) r = vg_mesh_check(&h.body.mesh, "'fuzz'", &e);
    if (r == VG_OK) {
        complete(&h);
        demand(vg_writer_open(&w, nowhere, "nowhere", &h, &e) == VG_OK);
    }
    for (size_t frames = 0; r >= 0 && frames < MOST_FRAMES; frames++) {
        demand(vg_frame_shape(&f, &h, &e) == VG_OK && vg_frame_rename(&f, "", &e) == VG_OK);
        if ((r = format->next(state, &f, &e)) <= 0) break;
        write_frame(w, &h, &f);
    }
    demand(r >= 0 || (e.code == r && e.message[0]));
    vg_writer_close(&w);
    format->close(state);
    vgi_input_free(&in);
    vg_frame_clear(&f);
    vg_head_clear(&h);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    if (n > 1 << 16) return 0;
    read_all(&vgi_sequence_npy, data, n);
    if (vgi_sequence_npz.sniff(data, n)) read_all(&vgi_sequence_npz, data, n);
    return 0;
}
