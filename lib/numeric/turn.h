/* turn.h: the rotation that best fits pairs of vectors. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TURN_H
#define VG_TURN_H

/* vgi_best_turn: the unit quaternion of the rotation R that maximises tr(R^T b) (b row-major). With b = sum of d
 * o^T it is the rotation that takes the vectors o nearest to the d. Never a reflection; if b leaves it open, one
 * of the best. */
void vgi_best_turn(const double b[9], double q[4]);
/* vgi_best_turn_near: the same for b + weight * (the rotation of the unit quaternion `prior`): with a small
 * weight, what b leaves open is as in `prior`. */
void vgi_best_turn_near(const double b[9], double weight, const double prior[4], double q[4]);
/* vgi_turn_between: the unit quaternion of the smallest rotation that takes the direction of a to that of b. Neither may
 * be 0. */
void vgi_turn_between(const double a[3], const double b[3], double q[4]);

#endif
