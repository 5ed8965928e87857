/* vg/rig.h: skeletons that drive a mesh: skinning, envelopes, other skeletons.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_RIG_H
#define VG_PART_RIG_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* vg_skeleton_pair: for each joint of a skeleton (njoints of `of`) the corresponding joint of another one,
 * UINT32_MAX: none. Joints correspond by name, whatever their order and number; then by the body part that their
 * names mean by the conventions of Mixamo, CMU, Unreal, MakeHuman, Rigify and others, or by shape if no name is that of an arm
 * or leg. */
int vg_skeleton_pair(const vg_skeleton *of, const vg_skeleton *by, uint32_t *partner, vg_err *e) VG_MUST_CHECK;

/* A rig driven by its own skeleton or another one. Joints of the rig that the other skeleton lacks follow their
 * parents. The rig keeps the lengths of its bones; translations are scaled by the ratio of the leg lengths, or of
 * all bones that both have. */
typedef struct vg_driver vg_driver;
typedef enum vg_align {
    VG_ALIGN_AUTO = 0, /* if a limb differs by more than 8 degrees at rest: all limbs that differ by more than 3 */
    VG_ALIGN_NONE,     /* no alignment: both rest poses and their axes as they are */
    VG_ALIGN_ALL,      /* all joints that have children */
    VG_ALIGN_CHOSEN    /* those of `chosen` */
} vg_align;
typedef struct vg_driver_options {
    vg_align align;
    const bool *chosen;      /* of each joint of the rig; read when align is VG_ALIGN_CHOSEN */
    const uint32_t *partner; /* of each joint of the rig; NULL: by vg_skeleton_pair */
} vg_driver_options;

/* vg_driver_new: rig and skeleton are borrowed until free, the options are not. VG_EINPUT if no joints correspond. */
int vg_driver_new(vg_driver **d, const vg_rig *r, const vg_skeleton *by, const vg_driver_options *o,
                  vg_err *e) VG_MUST_CHECK;
void vg_driver_free(vg_driver **d);
size_t vg_driver_missing(const vg_driver *d); /* bones of the rig that follow their parents */
/* vg_driver_lacks: whether a joint of the rig is a limb, hand, foot, head or the hips, and no joint drives this part of the
 * body. */
bool vg_driver_lacks(const vg_driver *d, size_t joint);
/* vg_driver_guessed: whether the joints of one skeleton have no names of limbs, and were found by its shape. */
bool vg_driver_guessed(const vg_driver *d);
/* vg_driver_aligned: the angle in degrees by which a joint of the rig was aligned with the other skeleton; 0: it
 * was not. */
double vg_driver_aligned(const vg_driver *d, size_t joint);
/* vg_driver_look: finds from the first pose of a motion (positions of the other skeleton's joints) which axis is up in it: that
 * of the rest pose, unless the root turns it. To be called before the first pose is evaluated. */
void vg_driver_look(vg_driver *d, const double *positions);
/* vg_driver_stands: the axes that are up for the other skeleton, where they are not those of the rig, as 1, 2, 3 for x, y, z, or
 * the negative; 0: the same axis, or it is not known. */
typedef struct vg_stance {
    int rests;  /* at rest, which is made up for */
    int moves;  /* in its motion, which is turned upright */
    bool faces; /* whether it faces along another axis at rest, which is made up for */
} vg_stance;
void vg_driver_stands(const vg_driver *d, vg_stance *stance);
/* vg_driver_pose: positions and turns of the other skeleton's joints to nbones transforms. */
void vg_driver_pose(vg_driver *d, const double *positions, const double *turns, double *transforms);
/* vg_driver_joints: to positions and turns of the rig's own joints; both are borrowed until the next call. */
void vg_driver_joints(vg_driver *d, const double *positions, const double *turns, const double **own_positions,
                      const double **own_turns);

/* vg_feet_hold: keep standing feet from sliding, in n consecutive poses of a rig, as nbones transforms each.
 * VG_EINPUT if no bones have names of thigh, shin and foot. */
int vg_feet_hold(const vg_rig *r, size_t n, double *const *transforms, vg_err *e) VG_MUST_CHECK;

/* Enveloping (MATH 6; T 5): a skeleton drives the mesh, learned from example poses.
 *
 * vg_inverse_skin: the other way round: the motions of the bones in a pose of vertices, joints staying together, so that
 * linear blend skinning comes as near to the vertices as it can (damped Gauss-Newton over all bones at once). Bones
 * without weighted vertices follow their parents. */
typedef struct vg_inverse_skin vg_inverse_skin;
/* vg_inverse_skin_new: r has weights (else VG_EINPUT); it and reference (nv points) are not kept. */
int vg_inverse_skin_new(vg_inverse_skin **b, const vg_rig *r, size_t nv, const double *reference, int threads,
                  vg_err *e) VG_MUST_CHECK;
void vg_inverse_skin_free(vg_inverse_skin **b);
/* vg_inverse_skin_fit: n poses (nv points each) to n times nbones transforms of 7 numbers. */
void vg_inverse_skin_fit(vg_inverse_skin *b, size_t n, const double *const *poses, double *const *transforms);

/* vg_rig_learn: fit weights to a rig when the motions of its bones are not known: weights and motions are fitted
 * in turn to n poses (nv points each) of the reference (nv points). miss: the mean error of linear blend skinning,
 * in mesh units. On failure the rig does not change. */
int vg_rig_learn(vg_rig *rig, size_t nv, const double *reference, size_t n, const double *const *poses, int threads,
                 double *miss, vg_err *e) VG_MUST_CHECK;

/* Bones without a skeleton (skinning decomposition; Le and Deng 2012).
 *
 * vg_rig_decompose: a rig of at most `bones` free bones, fewer where the poses do not tell more apart, with weights, from
 * n poses (nv points each) of the reference (nv points). The joint of each bone is a root with six channels, named
 * bone001 and so on, in the middle of the vertices it began with. miss: the mean distance that skinning leaves, in mesh
 * units. VG_EARG when bones is 0 or more than nv. */
int vg_rig_decompose(vg_rig *rig, size_t nv, const double *reference, size_t bones, size_t n,
                     const double *const *poses, int threads, double *miss, vg_err *e) VG_MUST_CHECK;

/* vg_free_bones: the motions of the bones of such a rig in other poses, as vg_inverse_skin finds those of bones that hang
 * together. */
typedef struct vg_free_bones vg_free_bones;
int vg_free_bones_new(vg_free_bones **b, const vg_rig *r, size_t nv, const double *reference, int threads,
                      vg_err *e) VG_MUST_CHECK;
void vg_free_bones_free(vg_free_bones **b);
void vg_free_bones_fit(vg_free_bones *b, size_t n, const double *const *poses, double *const *transforms);

/* vg_rig_locate: a skeleton whose root is not known to the mesh (in BVH it has no place of its own): shift is what
 * has to be added to the positions of its reference pose. n poses of the mesh with the positions and turns of all
 * joints in the same poses. spread: how far the vertices disagree about it (median), in mesh units. */
int vg_rig_locate(const vg_skeleton *s, size_t nv, const double *reference, size_t n, const double *const *poses,
                  const double *const *positions, const double *const *turns, int threads, double shift[3],
                  double *spread, vg_err *e) VG_MUST_CHECK;

/* The fit of a map of bones. Corner i has the vector A u_i, A that of the bone with which it moves most nearly
 * rigidly, and u_i what fits best over the poses; kept as the turn of its face beside the bone (T 5.12, without
 * reflections), the rest by the smallest rotation, and a stretch. Some vertices go where linear blend skinning,
 * fitted to the same poses, takes them: those that move most nearly rigidly with one bone, spread over the mesh, on
 * every component and bone. Both together are reconstructed once for each number of each transform. */
typedef struct vg_rig_fitter vg_rig_fitter;
typedef enum vg_rig_method { VG_RIG_ENVELOPE = 0, VG_RIG_LBS = 1 } vg_rig_method;
typedef struct vg_rig_options {
    size_t bones_per_corner; /* 1, or 2 */
    double hold;             /* share of the vertices that are held; at least one for each bone and component */
    double refine;           /* ridge of the regression by which the bones near a vertex take up what that leaves of the
                                poses: the larger, the less of it; 0: they take up nothing */
    int threads;
    bool trial;              /* only vg_rig_fitter_try is wanted, no map: less memory and time */
} vg_rig_options;

/* vg_rig_fitter_new: h: mesh, reference, links (vg_head_prepare_vectors) and a rig, whose weights do not matter; borrowed
 * until free. */
int vg_rig_fitter_new(vg_rig_fitter **f, const vg_head *h, const vg_rig_options *o, vg_err *e) VG_MUST_CHECK;
void vg_rig_fitter_free(vg_rig_fitter **f);
/* vg_rig_fitter_add: n poses (nv points) and the transforms of the bones in them.
 * Poses that are the reference are passed over. */
void vg_rig_fitter_add(vg_rig_fitter *f, size_t n, const double *const *poses, const double *const *transforms);
/* vg_rig_fitter_choose: another number of bones per corner, another ridge, for the next finish. */
void vg_rig_fitter_choose(vg_rig_fitter *f, size_t bones_per_corner, double refine);
/* vg_rig_fitter_finish: the rig with its weights, and the map of its bones; both are empty on failure. May be called
 * again for another method. VG_EINPUT without poses. */
int vg_rig_fitter_finish(vg_rig_fitter *f, vg_rig_method method, vg_rig *rig, vg_map *map, vg_err *e) VG_MUST_CHECK;
/* vg_rig_fitter_try: fit skinning and, for each of n ridges, the envelope, for vg_rig_fitter_judge. VG_EINPUT without
 * poses. */
int vg_rig_fitter_try(vg_rig_fitter *f, size_t n, const double *ridge, vg_err *e) VG_MUST_CHECK;
/* vg_rig_fitter_judge: compare both with n poses. Where skinning misses vertex v by s, and the envelope of ridge i by
 * s + d, s.d is added to sums[i][2 v] and d.d to sums[i][2 v + 1]. */
int vg_rig_fitter_judge(vg_rig_fitter *f, size_t n, const double *const *poses, const double *const *transforms,
                        double *const *sums, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
