/* vg/smooth.h: noise taken out of a sequence: filters in time, and what moves together.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_SMOOTH_H
#define VG_PART_SMOOTH_H

#include "vg/vectors.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Filters in time, without delay of the motion (zero phase); frames count as evenly spaced.
 *
 *   VG_LOWPASS      a Butterworth filter of second order, forward and back: amplitude 0.707 at a period of 2 span frames.
 *                   Beyond the ends the sequence goes on as its point reflection in the first or last frame.
 *   VG_POLYNOMIAL   Savitzky-Golay: the cubic of least squares through 2 span + 1 frames; at the ends that of the first or
 *                   last 2 span + 1 frames
 *   VG_ROBUST       a parabola through 2 span + 1 frames, found again with bisquare weights: a vertex that jumps away for a
 *                   few frames has no influence */
typedef enum vg_filter { VG_LOWPASS = 0, VG_POLYNOMIAL = 1, VG_ROBUST = 2 } vg_filter;

typedef struct vg_smoother vg_smoother;
typedef struct vg_smoother_options {
    vg_filter filter;
    double span;      /* frames: more than 1, at most 1000, robust 100; 0: the pose is kept */
    double root_span; /* the same for the rigid motion of the whole body; 0: it is kept */
    int threads;      /* >= 1 */
} vg_smoother_options;

/* vg_smoother_new: the rigid motion that takes the reference (nv points, borrowed until free) nearest to each frame is
 * filtered apart from the pose that is left: its rotation as a unit quaternion, and the centroid. VG_EARG: a span out of
 * range. Memory: 2 vg_smoother_reach + 1 frames. */
int vg_smoother_new(vg_smoother **s, const vg_smoother_options *o, size_t nv, const double *reference,
                    vg_err *e) VG_MUST_CHECK;
void vg_smoother_free(vg_smoother **s);
size_t vg_smoother_reach(const vg_smoother *s); /* frames on either side that a frame depends on */
/* vg_smoother_add: the next frame (nv points, copied). vg_smoother_end: there are no more. After each of them take all
 * frames that are ready: vg_smoother_next gives the oldest that was not given yet; false: none is ready. */
void vg_smoother_add(vg_smoother *s, const double *vertices);
void vg_smoother_end(vg_smoother *s);
bool vg_smoother_next(vg_smoother *s, double *vertices);

/* The same filters on the vector graph: what is filtered is how each vector turns and stretches against the reference pose,
 * in the logarithm. Parts that swing keep their size, where the filters of vertices make them smaller. */
typedef struct vg_vector_smoother vg_vector_smoother;
/* vg_vector_smoother_new: g is borrowed until free; reference: nv points. VG_EARG: a span out of range. Memory: as above
 * with 40 bytes a corner and frame. */
int vg_vector_smoother_new(vg_vector_smoother **s, const vg_smoother_options *o, const vg_graph *g,
                           const double *reference, size_t nanchors, vg_err *e) VG_MUST_CHECK;
void vg_vector_smoother_free(vg_vector_smoother **s);
size_t vg_vector_smoother_reach(const vg_vector_smoother *s);
/* As above, with the vectors of a frame (one per corner), its root and its anchors (nanchors points; may be NULL if there
 * are none). */
void vg_vector_smoother_add(vg_vector_smoother *s, const double *vectors, const double root[3], const double *anchors);
void vg_vector_smoother_end(vg_vector_smoother *s);
bool vg_vector_smoother_next(vg_vector_smoother *s, double *vectors, double root[3], double *anchors);
vg_deform_stats vg_vector_smoother_get_stats(const vg_vector_smoother *s); /* of the frames added */

/* A filter of the body in place of time: neighbouring vertices move nearly alike, noise does not. For overlapping regions
 * of up to 100 vertices the coordinates of all frames make a matrix of low rank (4 for a region that moves affinely); its
 * singular values are shrunk as is best for white noise (Gavish and Donoho 2017), whose size each region tells itself.
 * Every frame is filtered alone, so nothing is smoothed in time. */
typedef struct vg_region_filter vg_region_filter;
/* vg_region_filter_new: reference: nv points; regions are grown along edges by their length there. Memory: about 6 KB a
 * vertex. */
int vg_region_filter_new(vg_region_filter **r, const vg_mesh *m, const double *reference, int threads,
                         vg_err *e) VG_MUST_CHECK;
void vg_region_filter_free(vg_region_filter **r);
/* First pass: all frames, n at a time (nv points each), then _learn once. Second pass: _apply to n frames; out is not in.
 * VG_EINPUT from _learn: fewer than 8 frames. */
void vg_region_filter_look(vg_region_filter *r, size_t n, const double *const *vertices);
int vg_region_filter_learn(vg_region_filter *r, vg_err *e) VG_MUST_CHECK;
void vg_region_filter_apply(const vg_region_filter *r, size_t n, const double *const *in, double *const *out);
/* vg_region_filter_noise: the median over the regions of the noise that was found: root mean square of a vertex's
 * distance from its place, in mesh units. */
double vg_region_filter_noise(const vg_region_filter *r);

#ifdef __cplusplus
}
#endif
#endif
