/* vg/smooth.h: filters that remove noise from a sequence, in time or by the common motion of neighbouring vertices.
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
 *                   Beyond the ends the sequence is continued by its point reflection in the first or last frame.
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

/* vg_smoother_new: reference: nv points, borrowed until free. The rigid motion that fits the reference to each frame best (a unit
 * quaternion and the centroid) is filtered separately from the rest of the pose. VG_EARG if a span is out of range. Memory:
 * 2 vg_smoother_reach + 1 frames. */
int vg_smoother_new(vg_smoother **s, const vg_smoother_options *o, size_t nv, const double *reference,
                    vg_err *e) VG_MUST_CHECK;
void vg_smoother_free(vg_smoother **s);
size_t vg_smoother_reach(const vg_smoother *s); /* frames on either side that a frame depends on */
/* vg_smoother_add: the next frame (nv points, copied). vg_smoother_end: there are no more. After each of them, call
 * vg_smoother_next until it returns false: it returns the filtered frames in order, as far as they are ready. */
void vg_smoother_add(vg_smoother *s, const double *vertices);
void vg_smoother_end(vg_smoother *s);
bool vg_smoother_next(vg_smoother *s, double *vertices);

/* The same filters on the vector graph: the logarithm of each vector's rotation and scale relative to the reference pose is
 * filtered. Swinging parts keep their size, which filters of vertices reduce. */
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

/* A filter in space instead of time: neighbouring vertices move nearly alike, noise does not. For overlapping regions
 * of up to 100 vertices the coordinates of all frames form a matrix of low rank (4 for a region that moves affinely); its
 * singular values are shrunk optimally for white noise (Gavish and Donoho 2017), whose level is estimated for each region.
 * Frames are not mixed, so nothing is smoothed in time. */
typedef struct vg_region_filter vg_region_filter;
/* vg_region_filter_new: reference: nv points; regions are grown along edges by their length there. Memory: about 6 KB a
 * vertex. */
int vg_region_filter_new(vg_region_filter **r, const vg_mesh *m, const double *reference, int threads,
                         vg_err *e) VG_MUST_CHECK;
void vg_region_filter_free(vg_region_filter **r);
/* First pass: _look at all frames, n at a time (nv points each), then _learn once: VG_EINPUT if there were fewer than 8. Second
 * pass: _apply to n frames; in and out must not overlap. */
void vg_region_filter_look(vg_region_filter *r, size_t n, const double *const *vertices);
int vg_region_filter_learn(vg_region_filter *r, vg_err *e) VG_MUST_CHECK;
void vg_region_filter_apply(const vg_region_filter *r, size_t n, const double *const *in, double *const *out);
/* vg_region_filter_noise: the median over the regions of the estimated noise: root mean square displacement of a vertex, in
 * mesh units. */
double vg_region_filter_noise(const vg_region_filter *r);

#ifdef __cplusplus
}
#endif
#endif
