/* fuzz_model.c: mesh files: whatever is read is a valid mesh, comes back the same from every format, and takes smoothing groups
 * from the normals of an OBJ. Leaves out archives and the stream.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/smoothing.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_BYTES = 1 << 16 };

static void demand(bool holds)
{
    if (!holds) abort();
}

static bool same_bits(const void *a, const void *b, size_t n)
{
    return n == 0 || !memcmp(a, b, n);
}

static bool same_texture(const vg_model *a, const vg_model *b)
{
    const vg_attributes *x = &a->attributes, *y = &b->attributes;
    if (x->ntex != y->ntex || (x->ntex && x->tex_dim != y->tex_dim)) return false;
    return !x->ntex || (same_bits(x->tex, y->tex, x->ntex * x->tex_dim * sizeof *x->tex) &&
                        same_bits(x->corner_tex, y->corner_tex, vg_mesh_corners(&a->mesh) * sizeof *x->corner_tex));
}

static bool same_single(const double *a, const double *b, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        float x = (float)a[i], y = (float)b[i];
        if (memcmp(&x, &y, sizeof x)) return false;
    }
    return true;
}

/* Written, read, compared, and written again: the same bytes. */
static void there_and_back(const vg_model *m, const char *format, bool full)
{
    vg_bytes once = {0}, again = {0};
    vg_model back;
    vg_err e = {0};
    int result = vg_model_write(&once, format, &m->mesh, m->vertices, &m->attributes, full, &e);
    if (!full && result == VG_EINPUT) return; /* numbers beyond binary32 */
    demand(result == VG_OK);
    demand(vg_model_read(&back, once.data, once.size, NULL, "written", &e) == VG_OK);
    demand(vg_mesh_same(&m->mesh, "first", &back.mesh, "second", &e) == VG_OK);
    if (full) demand(same_bits(m->vertices, back.vertices, 3 * m->mesh.nv * sizeof *m->vertices));
    else demand(same_single(m->vertices, back.vertices, 3 * m->mesh.nv));
    if (full && !strcmp(format, "obj")) {
        demand(same_texture(m, &back));
        demand(m->attributes.nlabels == back.attributes.nlabels);
    }
    demand(vg_model_write(&again, format, &back.mesh, back.vertices, &back.attributes, full, &e) == VG_OK);
    demand(once.size == again.size && same_bits(once.data, again.data, once.size));
    vg_model_clear(&back);
    vg_bytes_clear(&once);
    vg_bytes_clear(&again);
}

/* Groups by normals take the place of those of the labels, in the order of the faces. */
static void take_smoothing(vg_model *m, const uint8_t *data, size_t size)
{
    vg_body b = {.mesh = m->mesh, .attributes = m->attributes, .reference = m->vertices};
    vg_err e = {0};
    demand(vgi_obj_take_smoothing(&b, (const char *)data, size, &e) == VG_OK);
    m->attributes = b.attributes;
    for (size_t i = 0; i < b.attributes.nlabels; i++) {
        const vg_label *l = &b.attributes.labels[i];
        demand(l->text && l->face <= m->mesh.nf && (i == 0 || l[-1].face <= l->face));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const read_as[] = {NULL, "obj", "ply", "off"};
    static const char *const written_as[] = {"obj", "ply", "ply-ascii", "ply-be", "off"};
    if (size > MOST_BYTES) return 0;
    for (size_t i = 0; i < sizeof read_as / sizeof *read_as; i++) {
        vg_model m;
        vg_err e = {0};
        int result = vg_model_read(&m, data, size, read_as[i], "fuzz", &e);
        if (result != VG_OK) {
            demand(result == e.code && e.message[0]);
            continue;
        }
        demand(m.mesh.nv > 0 && vg_mesh_check(&m.mesh, "it", &e) == VG_OK);
        for (size_t k = 0; k < sizeof written_as / sizeof *written_as; k++) {
            there_and_back(&m, written_as[k], true);
            there_and_back(&m, written_as[k], false);
        }
        take_smoothing(&m, data, size);
        vg_model_clear(&m);
    }
    return 0;
}
