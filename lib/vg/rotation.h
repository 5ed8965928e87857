/* vg/rotation.h: quaternions as rotations with a scale.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_ROTATION_H
#define VG_PART_ROTATION_H

#include "vg/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Rotations. A deformation is a quaternion w x y z whose squared length is the scale a > 0: r -> Q r Q* (T 3.19). */
void vg_quat_multiply(const double a[4], const double b[4], double ab[4]);
void vg_quat_apply(const double q[4], const double r[3], double d[3]); /* Q r Q*: rotates, and scales by |Q|^2 */
void vg_quat_matrix(const double unit[4], double m[9]);                /* row-major rotation matrix */
/* of a rotation; Shepperd's choice of branch */
void vg_quat_from_matrix(const double m[9], double unit[4]);
/* q != 0. l[0] = ln|q|, l[1..3] = half angle * axis, w >= 0 or not */
void vg_quat_log(const double q[4], double l[4]);
void vg_quat_exp(const double l[4], double q[4]);
/* vg_quat_between: smallest rotation taking r to d (Rodrigues; MATH 4), scale |d|/|r|. r and d must not be 0. */
void vg_quat_between(const double r[3], const double d[3], double q[4]);

#ifdef __cplusplus
}
#endif
#endif
