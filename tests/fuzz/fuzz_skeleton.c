/* fuzz_skeleton.c: skeletons and groups of vertices as text: refused, or a skeleton in a finite pose, parents before
 * children.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void demand(bool holds)
{
    if (!holds) abort();
}

static void read_skeleton(const uint8_t *data, size_t size)
{
    const vgi_sequence_format *format = &vgi_sequence_skeleton;
    vgi_input *in;
    void *state = NULL;
    vg_head h = {0};
    vg_frame f = {0};
    vg_err e;
    int r = vgi_input_memory(&in, data, size, "fuzz", &e);
    if (r == VG_OK) r = format->open(&state, &h, in, &(vg_reading){0}, "'fuzz'", &e);
    if (r == VG_OK) {
        demand(h.count > 0 && h.count % 2 == 0 && h.body.skeleton.njoints == h.count && h.body.mesh.nv == h.count);
        demand(vg_mesh_check(&h.body.mesh, "it", &e) == VG_OK && vgi_finite(h.body.reference, 3 * h.count));
        for (size_t j = 0; j < h.count; j++)
            demand(h.body.skeleton.joints[j].parent == UINT32_MAX || h.body.skeleton.joints[j].parent < j);
        demand(vg_frame_shape(&f, &h, &e) == VG_OK && format->next(state, &f, &e) == 1);
        size_t turns;
        demand(vg_frame_turns(&f, &turns) && turns == h.count);
        demand(!memcmp(f.values, h.body.reference, 3 * h.count * sizeof *f.values) &&
               format->next(state, &f, &e) == 0);
    }
    format->close(state);
    vg_frame_clear(&f);
    vg_head_clear(&h);
    vgi_input_free(&in);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > 1 << 16) return 0;
    vg_joint_groups g;
    vg_err e;
    (void)vgi_sequence_skeleton.sniff(data, size < 4096 ? size : 4096);
    read_skeleton(data, size);
    if (vg_joint_groups_read(&g, data, size, 1, "fuzz", &e) == VG_OK) {
        demand(g.n > 0);
        for (size_t i = 0; i < g.n; i++) {
            demand((g.at[i].parent == UINT32_MAX || g.at[i].parent < i) && g.at[i].nvertices > 0 && g.at[i].line > 0);
            for (size_t k = 0; k < g.at[i].nvertices; k++) demand(g.at[i].vertices[k] < UINT32_MAX);
        }
    } else {
        demand(g.n == 0 && !g.at);
    }
    vg_joint_groups_clear(&g);
    return 0;
}
