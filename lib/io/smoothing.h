/* smoothing.h: where the surface of an OBJ is smooth; used by readers and writers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SMOOTHING_H
#define VG_SMOOTHING_H

#include "io/io.h"

/* Faces that meet at 60 degrees or more form an edge where nothing else is said. */
static const double vgi_least_cosine = 0.5;

/* Smoothing of each face: SMOOTH_BY_ANGLE without labels; 0: flat; otherwise a number that neighbours must share. */
enum { VGI_SMOOTH_BY_ANGLE = -1 };
void vgi_smoothing_of(const vg_mesh *m, const vg_attributes *a, int64_t *of);

/* vgi_smooth_by_normals: make smoothing groups that are sharp where normals differ, in place of those of the body, unless these
 * are sharp at the same edges. normal: three numbers for each corner, of unit length; any for faces of two corners. */
int vgi_smooth_by_normals(vg_body *b, const double *normal, vg_err *e) VG_MUST_CHECK;

/* ---- obj_normals.c ---- */
/* vgi_obj_take_smoothing: the same by the normals (vn) of this text, if it is an OBJ that has one for each corner of the body's
 * faces. */
int vgi_obj_take_smoothing(vg_body *b, const char *data, size_t n, vg_err *e) VG_MUST_CHECK;

#endif
