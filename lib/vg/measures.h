/* vg/measures.h: distances between two sequences, and fingerprints of sequences. A part of vg.h, which says what
 * holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_MEASURES_H
#define VG_PART_MEASURES_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Measures of two sequences of one connectivity (MATH 8), accumulated pose by pose in bounded memory. */
typedef struct vg_measures vg_measures;
enum { VG_ERROR_BINS = 40 };
/* in D: bin i holds the errors from edge i up to the next; the last bin has no upper edge */
extern const double vg_error_edges[VG_ERROR_BINS];
typedef struct vg_measure_stats {
    size_t frames, vertices, faces;
    double diagonal; /* D of the truth's reference pose */
    double mean, rms, max, p95; /* vertex error, mesh units */
    size_t max_vertex, max_frame;
    uint64_t histogram[VG_ERROR_BINS]; /* vertex errors, by vg_error_edges */
    double sigma;              /* largest over vertices of the standard deviation over poses (T 5.36) */
    size_t sigma_vertex;
    double orientation_mean, orientation_sd, orientation_max; /* 1 - N.N~ per face of 3 or more (T 6.42) */
    double area_mean, area_sd, area_max;                      /* |1 - A/A~| (T 6.44) */
    size_t faces_measured;                                    /* faces with a normal, summed over poses */
    /* truth, result: faces of 4 or more, in [0, 1] (T 4.2.6) */
    double planarity_mean[2], planarity_max[2];
    size_t planarity_faces[2];
    uint64_t planarity_histogram[2][10];
} vg_measure_stats;

/* vg_measures_new: m borrowed until free. centred: move the centroid of each pose to 0 before comparing. threads
 * >= 1; the result does not depend on it. p95 is exact to 0.4 % (a histogram of 1/256 octaves). */
int vg_measures_new(vg_measures **x, const vg_mesh *m, const double *reference, bool centred, int threads,
                    vg_err *e) VG_MUST_CHECK;
void vg_measures_free(vg_measures **x);
typedef struct vg_pose_error {
    double mean, max;
} vg_pose_error;
/* vg_measures_add: n poses of the truth and of the result (nv points each); the grouping of poses into calls does
 * not change the result. errors: nv distances out for each. found (may be NULL): n. On failure no pose counts. */
int vg_measures_add(vg_measures *x, size_t n, const double *const *truth, const double *const *result,
                    double *const *errors, vg_pose_error *found, vg_err *e) VG_MUST_CHECK;
void vg_measures_get_stats(const vg_measures *x, vg_measure_stats *r);
/* vg_error_p95: the smallest of n numbers that 95 % do not exceed; 0 for none. Changes their order. O(n). */
double vg_error_p95(double *numbers, size_t n);

/* A fingerprint of a sequence: XXH64 over kind, faces, selection, links, anchors, reference positions, and of
 * every frame name, time, root, anchors, turns of joints and values, all numbers as binary64 (-0 as 0). It does
 * not cover provenance, attributes, scalars, pins, unknown records, the precision of the values, nor skeletons,
 * correspondences, patches, rigs and maps. */
typedef struct vg_digest vg_digest;
int vg_digest_new(vg_digest **d, const vg_head *h, vg_err *e) VG_MUST_CHECK; /* h is borrowed until free */
void vg_digest_free(vg_digest **d);
void vg_digest_add(vg_digest *d, const vg_frame *f);
uint64_t vg_digest_get(const vg_digest *d); /* of all that was added so far */

#ifdef __cplusplus
}
#endif
#endif
