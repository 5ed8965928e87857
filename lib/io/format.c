/* format.c: the table of mesh formats; reads and writes one mesh file in memory. The formats are in obj.c, ply.c,
 * off.c and stl.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <math.h>
#include <stdlib.h>

/* Detection by content takes the first match, so formats with a signature come before STL and OBJ, which have none.
 * Detection by suffix takes the first with that suffix. */
static const vgi_format *const formats[] = {&vgi_format_ply, &vgi_format_ply_ascii, &vgi_format_ply_be,
                                            &vgi_format_off, &vgi_format_stl,
                                            &vgi_format_stl_ascii, &vgi_format_obj};
enum { FORMATS = sizeof formats / sizeof *formats };

const vgi_format *vgi_format_by_name(const char *name, size_t n)
{
    for (size_t i = 0; i < FORMATS; i++)
        if (strlen(formats[i]->name) == n && !memcmp(formats[i]->name, name, n)) return formats[i];
    return NULL;
}

const vgi_format *vgi_format_by_suffix(const char *file_name)
{
    size_t n = strlen(file_name);
    for (size_t i = 0; i < FORMATS; i++)
        if (vgi_has_suffix(file_name, n, formats[i]->suffix)) return formats[i];
    return NULL;
}

const vgi_format *vgi_format_by_content(const unsigned char *data, size_t n)
{
    for (size_t i = 0; i < FORMATS; i++)
        if (formats[i]->sniff(data, n)) return formats[i];
    return NULL;
}

const char *vgi_format_names(void)
{
    return "obj, ply, ply-ascii, ply-be, off, stl, stl-ascii";
}

static int unknown_format(const char *format, vg_err *e)
{
    return vg_fail(e, VG_EARG, "unknown mesh format '%s' (known: %s)", format ? format : "", vgi_format_names());
}

void vg_model_clear(vg_model *m)
{
    vg_mesh_clear(&m->mesh);
    free(m->vertices);
    vg_attributes_clear(&m->attributes);
    *m = (vg_model){0};
}

static int read_plain(vg_model *m, const void *data, size_t n, const vgi_format *format, const char *file_name,
                      const char *subject, vg_err *e)
{
    if (n == 0) return vg_fail(e, VG_ETRUNC, "%s is empty", subject);
    if (!format) format = vgi_format_by_content(data, n);
    if (!format) format = vgi_format_by_suffix(file_name);
    if (!format) return vg_fail(e, VG_EINPUT, "%s is not a mesh file (read: OBJ, PLY, OFF, STL)", subject);
    int r = format->read(m, data, n, subject, e);
    if (r == VG_OK) r = vgi_mend_faces(&m->mesh, m->vertices, &m->attributes, &m->note, subject, e);
    if (r < 0) vg_model_clear(m);
    return r;
}

int vgi_model_read(vg_model *m, const void *data, size_t n, const vgi_format *format, const char *file_name,
                   const char *subject, vg_err *e)
{
    vg_bytes own = {0};
    const unsigned char *plain = data;
    *m = (vg_model){0};
    int r = n ? vgi_plain_text(&own, &plain, &n, e) : VG_OK;
    if (r == VG_OK) r = read_plain(m, plain, n, format, file_name, subject, e);
    vg_bytes_clear(&own);
    return r;
}

int vg_model_read(vg_model *m, const void *data, size_t n, const char *format, const char *name, vg_err *e)
{
    *m = (vg_model){0};
    const vgi_format *known = format ? vgi_format_by_name(format, strlen(format)) : NULL;
    if (format && !known) return unknown_format(format, e);
    char subject[300];
    snprintf(subject, sizeof subject, "'%.290s'", name);
    return vgi_model_read(m, data, n, known, name, subject, e);
}

/* Check whether n numbers are finite in the precision of the file. */
static int check_range(const double *x, size_t n, size_t per_item, const char *what, bool full_precision, bool may_be_full, vg_err *e)
{
    for (size_t i = 0; i < n; i++) {
        if (isfinite(full_precision ? x[i] : (double)(float)x[i])) continue;
        if (isfinite(x[i]))
            return vg_fail(e, VG_EINPUT, "%s %zu does not fit binary32 (%g)%s", what, i / per_item, x[i],
                           may_be_full ? ": 'vg-decode --f64' writes binary64" : "");
        return vg_fail(e, VG_EINPUT, "%s %zu is not finite", what, i / per_item);
    }
    return VG_OK;
}

int vgi_model_write(vg_bytes *out, const char *format, const vgi_writing *w, vg_err *e)
{
    const vgi_format *known = format ? vgi_format_by_name(format, strlen(format)) : NULL;
    const vg_attributes *a = w->attributes;
    if (!known) return unknown_format(format, e);
    size_t size = out->size;
    const bool doubles = known->keeps & VGI_KEEPS_DOUBLES;
    int r = check_range(w->vertices, 3 * w->mesh->nv, 3, "vertex", w->full_precision, doubles, e);
    if (r == VG_OK && a)
        r = check_range(a->tex, a->ntex * a->tex_dim, a->tex_dim, "texture coordinate", w->full_precision, doubles, e);
    if (r == VG_OK) r = known->write(out, w, e);
    if (r == VG_OK && w->rest) r = vgi_bytes_append(out, w->rest->data, w->rest->size, e);
    else if (r == VG_OK && known->rest) r = known->rest(out, w, e);
    if (r < 0) out->size = size; /* append nothing on failure */
    return r;
}

int vg_model_write(vg_bytes *out, const char *format, const vg_mesh *mesh, const double *vertices,
                   const vg_attributes *attributes, bool full_precision, vg_err *e)
{
    const vgi_writing w = {mesh, vertices, vertices, attributes, full_precision, NULL, NULL};
    return vgi_model_write(out, format, &w, e);
}
