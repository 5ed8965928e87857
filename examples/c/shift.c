/* shift DX DY DZ <IN >OUT: a filter of the suite in C: a stream in, a stream out, every pose moved. It passes on what it does not
 * know, says who made the stream, and fails as the others do: in one line, with no end to its output.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include <vg.h>

typedef struct filter {
    double by[3];
    vg_reader *in;
    vg_writer *out;
    vg_frame frame;
} filter;

static void move(const filter *f, double *points, size_t n)
{
    for (size_t i = 0; i < 3 * n; i++) points[i] += f->by[i % 3];
}

static int run(filter *f, int argc, char **argv, vg_err *e)
{
    int r = vg_reader_open(&f->in, STDIN_FILENO, "standard input", e);
    if (r < 0) return r;
    vg_head *h = vg_reader_head(f->in);
    if (h->kind != VG_VERTICES) return vg_fail(e, VG_EINPUT, "the input holds %s: vertices are needed here", vg_head_form(h));
    size_t nv = h->body.mesh.nv;
    move(f, h->body.reference, nv);
    r = vg_head_trace(h, "shift", argc, argv, e);
    if (r == VG_OK) r = vg_writer_open(&f->out, STDOUT_FILENO, "standard output", h, e);
    if (r < 0) return r;
    while ((r = vg_reader_next(f->in, &f->frame, e)) > 0) {
        move(f, f->frame.values, nv);
        if ((r = vg_writer_put(f->out, &f->frame, e)) < 0) return r;
    }
    return r < 0 ? r : vg_writer_end(f->out, vg_reader_tail(f->in), e);
}

int main(int argc, char **argv)
{
    filter f = {.by = {0}};
    vg_err e;
    if (argc != 4) return fprintf(stderr, "usage: shift DX DY DZ <IN >OUT\n"), 2;
    for (int k = 0; k < 3; k++) f.by[k] = strtod(argv[k + 1], NULL);
    int r = run(&f, argc, argv, &e), status = vg_exit_status(r);
    if (r < 0) fprintf(stderr, "shift: %s\n", e.message);
    if (r < 0 && f.out) vg_writer_abandon(f.out, "shift", status, e.message);
    vg_writer_close(&f.out);
    vg_frame_clear(&f.frame);
    vg_reader_close(&f.in);
    return status;
}
