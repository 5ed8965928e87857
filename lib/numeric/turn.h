/* turn.h: the rotation that fits pairs of vectors best.
 * Internal. Leaves out rotations of single vectors (rotation.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TURN_H
#define VG_TURN_H

/* vgi_best_turn: the unit quaternion of the rotation R that makes tr(R^T b) largest (b row-major): of all, it
 * takes the vectors o nearest to the d when b is the sum of d o^T. Never a reflection;
 * some best one where b leaves it open. */
void vgi_best_turn(const double b[9], double q[4]);
/* vgi_best_turn_near: the same of b + weight * (the rotation of the unit quaternion `prior`): with a small weight,
 * what b leaves open is as in `prior`. */
void vgi_best_turn_near(const double b[9], double weight, const double prior[4], double q[4]);

#endif
