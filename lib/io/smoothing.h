/* smoothing.h: where the surface of an OBJ is smooth; used by readers and writers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SMOOTHING_H
#define VG_SMOOTHING_H

#include "io/io.h"

/* An edge of a face, between the vertices low < high. */
typedef struct vgi_side {
    uint32_t low, high, face, at_low, at_high; /* at_low, at_high: the corners there */
} vgi_side;

/* Where a surface is smooth: by the smoothing groups of its labels; where there are none, by the angles of its faces. */
typedef struct vgi_smoothing {
    int64_t *group;  /* of each face: -1: by angle; 0: flat; otherwise a number that neighbours share */
    double *normal;  /* of each face: of unit length, or 0 */
    vgi_side *sides; /* of faces with three corners or more; those of one edge follow one another */
    size_t nsides;
} vgi_smoothing;

/* vgi_smoothing_make: a may be NULL. The caller clears it in any case. */
int vgi_smoothing_make(vgi_smoothing *k, const vg_mesh *m, const vg_attributes *a, const double *reference,
                       vg_err *e) VG_MUST_CHECK;
void vgi_smoothing_clear(vgi_smoothing *k);
bool vgi_on_one_edge(const vgi_side *s, const vgi_side *t);
/* vgi_is_smooth: whether two faces form one surface at the edge of these sides. */
bool vgi_is_smooth(const vgi_smoothing *k, const vgi_side *s, const vgi_side *t);

/* vgi_smooth_by_normals: make smoothing groups that are sharp where normals differ, in place of those of the body, unless these
 * are sharp at the same edges. normal: three numbers for each corner, of unit length; any for faces of two corners. */
int vgi_smooth_by_normals(vg_body *b, const double *normal, vg_err *e) VG_MUST_CHECK;

/* Normals of an OBJ, in the order of the file. */
typedef struct vgi_obj_normals {
    double *normal;   /* n x 3, as given; 0: malformed */
    uint32_t *corner; /* for each corner the index of its normal, >= n: none; undefined in faces of two corners */
    size_t n, cap;
} vgi_obj_normals;

/* ---- obj.c ---- */
/* vgi_obj_read_normals: read normals and faces of a text that vgi_obj_read has read without error. The caller clears `to` and m
 * in any case. VG_ENOMEM. */
int vgi_obj_read_normals(vgi_obj_normals *to, vg_model *m, const char *data, size_t n, vg_err *e) VG_MUST_CHECK;

/* ---- obj_normals.c ---- */
/* vgi_obj_take_smoothing: the same by the normals (vn) of this text, if it is an OBJ that has one for each corner of the body's
 * faces. VG_ENOMEM. */
int vgi_obj_take_smoothing(vg_body *b, const char *data, size_t n, vg_err *e) VG_MUST_CHECK;

#endif
