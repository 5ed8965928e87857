/* gltf_faces.c: faces of any size as the triangles and lines of glTF, in an order from which our own reader can
 * restore them. Vertices, and the place of the indices in the file, are in gltf_write.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_write.h"
#include "io/polygon.h"
#include "numeric/face.h"

#include <stdlib.h>

typedef struct shaping {
    const vg_mesh *mesh;
    const double *reference;
    const vg_attributes *a;
    vgi_gltf_shape *to;
} shaping;

static int put_index(vg_bytes *to, uint32_t v, vg_err *e)
{
    unsigned char p[VGI_GLTF_ITEM];
    vgi_put32(p, v);
    return vgi_bytes_append(to, p, sizeof p, e);
}

static int put_triangle(const shaping *x, uint32_t a, uint32_t b, uint32_t c, vg_err *e)
{
    int r = put_index(&x->to->triangles, a, e);
    if (r == VG_OK) r = put_index(&x->to->triangles, b, e);
    return r < 0 ? r : put_index(&x->to->triangles, c, e);
}

static int put_fan(const shaping *x, const uint32_t *v, size_t n, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 1; i + 1 < n && r == VG_OK; i++) r = put_triangle(x, v[0], v[i], v[i + 1], e);
    return r;
}

static size_t find_ear(const shaping *x, const uint32_t *ring, size_t n, const double normal[3])
{
    for (size_t b = 1; b < n; b++)
        if (vgi_is_ear(x->reference, ring, n, b, normal)) return b;
    return vgi_is_ear(x->reference, ring, n, 0, normal) ? 0 : 1; /* the polygon touches or crosses itself: take any */
}

/* The triangle with the face's first corner comes first and begins with it, so that the face can be restored. */
static void begin_with(unsigned char *triangles, size_t n, uint32_t v)
{
    for (size_t i = 0; i < 3 * n; i++) {
        if (vgi_get32(triangles + VGI_GLTF_ITEM * i) != v) continue;
        unsigned char *t = triangles + VGI_GLTF_POINT * (i / 3), first[VGI_GLTF_POINT];
        for (size_t k = 0; k < 3; k++)
            memcpy(first + VGI_GLTF_ITEM * k, t + VGI_GLTF_ITEM * ((i + k) % 3), VGI_GLTF_ITEM);
        memmove(triangles + VGI_GLTF_POINT, triangles, VGI_GLTF_POINT * (i / 3));
        memcpy(triangles, first, VGI_GLTF_POINT);
        return;
    }
}

static int put_ears(const shaping *x, const uint32_t *v, size_t n, const double normal[3], vg_err *e)
{
    uint32_t ring[VGI_MOST_CLIPPED];
    const size_t start = x->to->triangles.size;
    int r = VG_OK;
    memcpy(ring, v, n * sizeof *v);
    for (size_t left = n; left > 2 && r == VG_OK; left--) {
        size_t b = find_ear(x, ring, left, normal);
        r = put_triangle(x, ring[(b + left - 1) % left], ring[b], ring[(b + 1) % left], e);
        memmove(ring + b, ring + b + 1, (left - 1 - b) * sizeof *ring);
    }
    if (r == VG_OK) begin_with(x->to->triangles.data + start, n - 2, v[0]);
    return r;
}

static int put_face(const shaping *x, const uint32_t *v, size_t n, vg_err *e)
{
    double normal[3];
    if (n == 2) {
        int r = put_index(&x->to->lines, v[0], e);
        return r < 0 ? r : put_index(&x->to->lines, v[1], e);
    }
    vgi_face_area(x->reference, v, n, normal);
    if (n == 3 || n > VGI_MOST_CLIPPED || vgi_is_fan(x->reference, v, n, normal)) return put_fan(x, v, n, e);
    return put_ears(x, v, n, normal, e);
}

static int put_run(const shaping *x, size_t count, size_t size, vg_err *e)
{
    char text[64];
    int n = snprintf(text, sizeof text, "%s%zu,%zu", x->to->runs.size ? "," : "", count, size);
    return vgi_bytes_append(&x->to->runs, text, (size_t)n, e);
}

static int add_run(vgi_gltf_shape *s, const char *material, vg_err *e)
{
    int r = vgi_grow(&s->run, &s->runs_cap, s->nruns + 2, sizeof *s->run, e);
    if (r == VG_OK) s->run[s->nruns] = (vgi_gltf_run){s->triangles.size, s->lines.size, material};
    return r;
}

/* Update the material at face f; *label: the next label. */
static int take_material(const shaping *x, size_t f, size_t *label, vg_err *e)
{
    vgi_gltf_shape *s = x->to;
    const char *name = s->nruns ? s->run[s->nruns - 1].material : NULL, *old = name;
    for (; x->a && *label < x->a->nlabels && x->a->labels[*label].face <= f; ++*label)
        if (x->a->labels[*label].kind == VG_LABEL_MATERIAL) name = x->a->labels[*label].text;
    if (s->nruns && (name == old || (name && old && !strcmp(name, old)))) return VG_OK;
    int r = add_run(s, name, e);
    if (r == VG_OK) s->nruns++;
    return r;
}

static int end_runs(vgi_gltf_shape *s, vg_err *e)
{
    if (s->nruns > VGI_GLTF_MOST_RUNS) s->run[0].material = NULL, s->nruns = 1;
    int r = s->nruns ? VG_OK : add_run(s, NULL, e);
    if (r == VG_OK && !s->nruns) s->nruns = 1;
    return r < 0 ? r : add_run(s, NULL, e);
}

static int put_faces(const shaping *x, vg_err *e)
{
    const vg_mesh *m = x->mesh;
    size_t count = 0, size = 0, label = 0;
    int r = VG_OK;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++) {
        if ((r = take_material(x, f, &label, e)) < 0) break;
        size_t n = m->start[f + 1] - m->start[f];
        if (n != size && count) r = put_run(x, count, size, e);
        count = n == size ? count + 1 : 1, size = n;
        if (r == VG_OK) r = put_face(x, m->vert + m->start[f], n, e);
    }
    if (r == VG_OK && count) r = put_run(x, count, size, e);
    return r < 0 ? r : end_runs(x->to, e);
}

int vgi_gltf_shape_make(vgi_gltf_shape *s, const vg_mesh *m, const double *reference, const vg_attributes *a,
                        vg_err *e)
{
    *s = (vgi_gltf_shape){0};
    return put_faces(&(shaping){m, reference, a, s}, e);
}

void vgi_gltf_shape_clear(vgi_gltf_shape *s)
{
    free(s->run);
    vg_bytes_clear(&s->triangles);
    vg_bytes_clear(&s->lines);
    vg_bytes_clear(&s->runs);
}
