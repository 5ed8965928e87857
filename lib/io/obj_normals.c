/* obj_normals.c: makes smoothing groups of the normals of an OBJ. Of a sequence only the file that gives the mesh needs its
 * normals, so reading poses does not collect them; that file is read once more, and only where "vn" occurs in it: 70 ms beside
 * 35 ms for a pose, measured with 250,000 vertices and normals (28 MB). Poses then take neither time nor memory for normals.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/smoothing.h"
#include "model/incidence.h"
#include "numeric/vec3.h"

#include <stdlib.h>

/* The unit normal of each corner; *normal stays NULL where a face of three corners or more lacks one. */
static int spread(double **normal, const vgi_obj_normals *in, const vg_mesh *m, vg_err *e)
{
    double *to = vgi_array(vg_mesh_corners(m), 3 * sizeof *to, e);
    if (!to) return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++)
        for (size_t c = m->start[f]; c < m->start[f + 1] && vgi_face_size(m, f) > 2; c++) {
            double *n = to + 3 * c;
            if (in->corner[c] < in->n) memcpy(n, in->normal + 3 * (size_t)in->corner[c], 3 * sizeof *n);
            vgi_make_unit(n);
            if (vgi_length(n) > 0) continue;
            free(to);
            return VG_OK;
        }
    *normal = to;
    return VG_OK;
}

static bool has_normals(const char *data, size_t n)
{
    return memmem(data, n, "vn", 2) && vgi_format_obj.sniff((const unsigned char *)data, n);
}

int vgi_obj_take_smoothing(vg_body *b, const char *data, size_t n, vg_err *e)
{
    vgi_obj_normals in = {0};
    vg_model again = {0};
    vg_err own = {0};
    double *normal = NULL;
    if (!has_normals(data, n)) return VG_OK;
    int r = vgi_obj_read_normals(&in, &again, data, n, &own);
    const bool fits = r == VG_OK && vg_mesh_same(&b->mesh, "", &again.mesh, "", NULL) == VG_OK;
    if (r == VG_EINPUT) r = VG_OK; /* another format, which begins like an OBJ */
    if (fits) r = spread(&normal, &in, &b->mesh, &own);
    if (normal) r = vgi_smooth_by_normals(b, normal, &own);
    if (r < 0 && e) *e = own;
    free(normal);
    free(in.normal);
    free(in.corner);
    vg_model_clear(&again);
    return r;
}
