/* vg/patches.h: patches of faces that rotate alike, and the map from their motions to vertices. A part of vg.h,
 * which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_PATCHES_H
#define VG_PART_PATCHES_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Segmentation (T 6.2): K-means over faces whose feature is their rotation in every pose; it does not use
 * positions. Features of more than about a hundred poses are folded into 1,024 numbers by random signs, which
 * keeps distances within about 5 %: memory does not grow with the number of poses. The same seed gives the same
 * patches, whatever the number of threads. */
typedef struct vg_segmenter vg_segmenter;
typedef struct vg_segment_stats {
    size_t patches, rounds;
    double angle; /* in degrees: root mean square over faces and poses of the rotation between a face and its patch */
} vg_segment_stats;

/* vg_segmenter_new: m is borrowed until free; reference: nv points, not kept. */
int vg_segmenter_new(vg_segmenter **s, const vg_mesh *m, const double *reference, int threads,
                     vg_err *e) VG_MUST_CHECK;
void vg_segmenter_free(vg_segmenter **s);
/* vg_segmenter_add: n poses, nv points each. */
int vg_segmenter_add(vg_segmenter *s, size_t n, const double *const *poses, vg_err *e) VG_MUST_CHECK;
/* vg_segmenter_cut: the patches of the poses so far; may be called again, for others. patches 0: as few of 4 6 8 12
 * 16 24 ... 256 as bring the angle to 10 degrees. connected: every patch is in one piece: pieces are joined with
 * neighbours that turn alike until `patches` are left, or no neighbours. Fewer patches than asked for when fewer
 * faces turn differently. VG_EINPUT when there is no face. */
int vg_segmenter_cut(vg_segmenter *s, size_t patches, uint64_t seed, bool connected, vg_patches *out,
                     vg_segment_stats *report, vg_err *e) VG_MUST_CHECK;

/* The map from patch transforms to vertices (MATH 7; T 6.3), with its two remedies. */
typedef struct vg_map_fitter vg_map_fitter;
/* vg_map_fitter_new: h: mesh, reference, links (vg_head_prepare_vectors) and patches; borrowed until free. hold: share
 * of the vertices that are held, those nearest the patches' centres; at least one a patch. */
int vg_map_fitter_new(vg_map_fitter **f, const vg_head *h, double hold, int threads, vg_err *e) VG_MUST_CHECK;
void vg_map_fitter_free(vg_map_fitter **f);
int vg_map_fitter_add(vg_map_fitter *f, size_t n, const double *const *poses, vg_err *e) VG_MUST_CHECK;
/* vg_map_fitter_finish: the map, and its patches: the connected pieces of those of h, small ones joined with a neighbour.
 * Both are empty on failure. VG_EINPUT without poses. */
int vg_map_fitter_finish(vg_map_fitter *f, vg_patches *patches, vg_map *map, vg_err *e) VG_MUST_CHECK;

/* vg_map_retarget: the map of h for another body of the same faces (T 6.5), or for one on the way to it (T 6.6), whose
 * vectors are those of h's reference, rotated and scaled towards the target's by `morph` (1: all the way).
 * target: nv points. Out: the map; the rig, when h has one: its joints follow the vertices around them, and its
 * transforms are those of the other body; reference: nv points, that body, which may be `target` itself. Patches are
 * still measured on the body that the map was fitted on. VG_EINPUT when there is no map, or a body has no extent; map and
 * rig are empty on failure. */
int vg_map_retarget(const vg_head *h, const double *target, double morph, int threads, vg_map *map, vg_rig *rig,
                    double *reference, vg_err *e) VG_MUST_CHECK;

/* The evaluation of a map. Transforms are 7 numbers each, as in VG_TRANSFORMS. */
typedef struct vg_player vg_player;
/* vg_player_new: a map, and the body that it moves, with the map's patches or the weights of its rig; both are borrowed
 * until free. single: the product is formed in binary32. VG_EINPUT when they do not belong together. */
int vg_player_new(vg_player **p, const vg_body *body, const vg_map *map, bool single, int threads, vg_err *e) VG_MUST_CHECK;
void vg_player_free(vg_player **p);
/* vg_player_measure: n poses (nv points each) to the best-fitting similarity of each patch. */
void vg_player_measure(vg_player *p, size_t n, const double *const *poses, double *const *transforms);
/* vg_player_place: keep rotations, scales and root, and put the patches where their joints want them, in place. A map
 * of another body than its home does so whenever it is posed: there nothing is done. */
void vg_player_place(vg_player *p, double *transforms);
/* vg_player_between: from a (t = 0) to b (t = 1) and beyond: rotations and scales go along geodesics, the root in a
 * line, joints hold. transforms: neither a nor b. */
void vg_player_between(vg_player *p, const double *a, const double *b, double t, double *transforms);
/* vg_player_pose: vertices from n times transforms, by one matrix product. */
void vg_player_pose(vg_player *p, size_t n, const double *const *transforms, double *const *vertices);

#ifdef __cplusplus
}
#endif
#endif
