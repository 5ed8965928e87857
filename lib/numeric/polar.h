/* polar.h: the rotation nearest to any 3 x 3 matrix; the one that best fits pairs of vectors; rotations of faces in
 * eight poses at once.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_POLAR_H
#define VG_POLAR_H

#include "core/isa.h"
#include "core/lanes.h"

/* vgi_fit_rotation: the rotation R that maximises tr(R'm). For m = sum of d r' it is the one that maps the r nearest
 * to the d. Row-major. Among several, the one with the smallest angle; the identity for m = 0. */
void vgi_fit_rotation(const double m[9], double r[9]);

/* vgi_best_turn: the unit quaternion of the rotation R that maximises tr(R^T b) (b row-major). With b = sum of d o^T
 * it is the rotation that maps the vectors o nearest to the d. Never a reflection; any one of several maxima. */
void vgi_best_turn(const double b[9], double q[4]);
/* vgi_best_turn_near: the same for b + weight * (the rotation of the unit quaternion `prior`): with a small weight,
 * what b leaves undetermined is as in `prior`. */
void vgi_best_turn_near(const double b[9], double weight, const double prior[4], double q[4]);
/* vgi_turn_between: the unit quaternion of the smallest rotation from the direction of a to that of b. Neither may be
 * 0. */
void vgi_turn_between(const double a[3], const double b[3], double q[4]);

/* The reference against which rotations of faces are measured. Faces and corners as in a vg_graph. */
typedef struct vgi_turns {
    const uint32_t *start, *vert;
    size_t nf;
    double *vector; /* 3 per corner: in the reference pose */
    double *normal; /* 3 per face: its unit normal times half the sum of squared vectors; 0 if undefined */
} vgi_turns;

int vgi_turns_make(vgi_turns *t, size_t nf, const uint32_t *start, const uint32_t *vert, const double *reference,
                   vg_err *e) VG_MUST_CHECK;
void vgi_turns_clear(vgi_turns *t);

typedef struct vgi_polar_kernel {
    void (*measure)(const vgi_turns *t, size_t f, const double *const *poses, vgi_lanes *rotation);
} vgi_polar_kernel;
VGI_KERNEL(vgi_polar_kernel)

/* vgi_turns_measure: the rotation of face f in eight poses (vertices). */
static inline void vgi_turns_measure(const vgi_turns *t, size_t f, const double *const *poses, vgi_lanes rotation[9])
{
    vgi_polar_kernel_now()->measure(t, f, poses, rotation);
}

#endif
