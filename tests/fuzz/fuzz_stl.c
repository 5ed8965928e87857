/* fuzz_stl.c: any bytes as STL: what is read is a valid mesh of triangles without two vertices at one place, and
 * comes back the same, text in full precision to the bit.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static void demand(bool holds)
{
    if (!holds) abort();
}

static void check_mesh(const vg_model *m)
{
    demand(m->mesh.nv >= 3 && m->mesh.nf >= 1 && vg_mesh_check(&m->mesh, "it", NULL) == VG_OK);
    for (size_t f = 0; f <= m->mesh.nf; f++) demand(m->mesh.start[f] == 3 * f);
    for (size_t i = 1; i < m->mesh.nv && m->mesh.nv < 200; i++)
        for (size_t j = 0; j < i; j++) demand(memcmp(m->vertices + 3 * i, m->vertices + 3 * j, 24) != 0);
}

/* Triangles that the note says were left out. */
static size_t left_out(const vg_model *m)
{
    size_t n = 0;
    int end = 0;
    const char *at = strstr(m->note.text, "left out ");
    for (; at; at = strstr(at + 1, "left out "))
        if (sscanf(at, "left out %zu face%n", &n, &end) == 1 && end > 0) return n;
    return 0;
}

/* Left-out triangles may have been the only ones of a vertex, so that numbers change; corners do not. */
static void check_corners(const vg_model *a, const vg_model *b, bool full)
{
    demand(full ? a->mesh.nf == b->mesh.nf : b->mesh.nf + left_out(b) == a->mesh.nf);
    if (a->mesh.nf != b->mesh.nf) return;
    for (size_t c = 0; c < 3 * a->mesh.nf; c++)
        for (size_t k = 0; k < 3; k++) {
            double x = a->vertices[3 * (size_t)a->mesh.vert[c] + k], y = b->vertices[3 * (size_t)b->mesh.vert[c] + k];
            demand(full ? x == y : (float)x == (float)y);
        }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    vg_model m, back;
    vg_err e = {0};
    if (n > 1 << 16) return 0;
    int r = vg_model_read(&m, data, n, "stl", "fuzz", &e);
    if (r != VG_OK) {
        demand(r == e.code && e.message[0]);
        return 0;
    }
    check_mesh(&m);
    for (int full = 0; full < 2; full++) {
        vg_bytes b = {0};
        r = vg_model_write(&b, full ? "stl-ascii" : "stl", &m.mesh, m.vertices, NULL, full, &e);
        demand(r == VG_OK || (!full && r == VG_EINPUT)); /* beyond binary32 */
        if (r == VG_OK) r = vg_model_read(&back, b.data, b.size, "stl", "back", &e);
        demand(r == VG_OK || (!full && r == VG_EINPUT)); /* in binary32 nothing was left */
        if (r == VG_OK) {
            check_corners(&m, &back, full);
            vg_model_clear(&back);
        }
        vg_bytes_clear(&b);
    }
    vg_model_clear(&m);
    return 0;
}
