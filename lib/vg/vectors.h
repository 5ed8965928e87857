/* vg/vectors.h: the vector graph: deformation, transfer, interpolation, reconstruction.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_VECTORS_H
#define VG_PART_VECTORS_H

#include "vg/frames.h"
#include "vg/rotation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The vector graph of a sequence: the faces that carry vectors, in order (all or the selected ones), then the
 * links. Corner c of the graph is a position in faces.vert. */
typedef struct vg_graph {
    vg_mesh faces;
    size_t nlinks;      /* the last ones of the faces */
    size_t attached;    /* vertices in at least one face */
    size_t max_corners; /* of a face */
    bool *in_face;      /* faces.nv */
} vg_graph;

/* vg_graph_new: the graph of the selected faces of m and the links; NULL: all faces, no links. Links must join all
 * components of m (vg_link_components); this is not checked here. O(corners). */
int vg_graph_new(vg_graph **g, const vg_mesh *m, const vg_selection *selection, const vg_links *links,
                 vg_err *e) VG_MUST_CHECK;
/* vg_head_graph: the graph of h's mesh, selection and links. */
int vg_head_graph(vg_graph **g, const vg_head *h, vg_err *e) VG_MUST_CHECK;
void vg_graph_free(vg_graph **g);
size_t vg_graph_corners(const vg_graph *g);

/* vg_graph_vectors: w_c = v(c) - C_f (T 3.1). vertices: nv points in; vectors: one per corner out. */
void vg_graph_vectors(const vg_graph *g, const double *vertices, double *vectors);
/* vg_graph_root: the mean of the attached vertices; zeros if there are none. */
void vg_graph_root(const vg_graph *g, const double *vertices, double root[3]);
/* vg_graph_anchors: the positions of n anchors out of nv points. */
void vg_graph_anchors(const double *vertices, const uint32_t *anchors, size_t n, double *positions);

/* vg_threads_with_room: the number of threads, at most `most`, that may call BLAS in the remaining address space;
 * 0: none. Ask first, because OpenBLAS never returns if its work memory is refused. */
int vg_threads_with_room(int most);

/* vg_select_faces: a subset of the faces that still determines the mesh (T 3.2, Algorithm 1), completed so that
 * every vertex in a face stays in one and every component stays connected. Out: *faces (ascending, free with
 * free()) and *n. */
int vg_select_faces(const vg_mesh *m, uint32_t **faces, size_t *n, vg_err *e) VG_MUST_CHECK;

/* vg_link_components: the fewest virtual line segments that join all components of m: a minimum spanning tree
 * between nearby vertices of `vertices` (nv points), where a link shorter than the edges beside it is moved to the
 * next vertex of the face. Out: *pairs (2 per link, free with free()) and *n. VG_EARG if a vertex is not finite. */
int vg_link_components(const vg_mesh *m, const double *vertices, uint32_t **pairs, size_t *n,
                       vg_err *e) VG_MUST_CHECK;

/* vg_head_prepare_vectors: choose the links of h from its reference pose unless it has links. To be called before
 * vg_head_graph by every program that derives vectors from vertices. A map that was fitted without these links is
 * dropped. */
int vg_head_prepare_vectors(vg_head *h, vg_err *e) VG_MUST_CHECK;

/* Deformation of vectors from the reference pose to a deformed pose (MATH 4): Frames (T 3.12 ff.) on faces of 3
 * corners or more, Rodrigues on line segments, and on links the mean rotation of the faces at their ends followed
 * by Rodrigues. Degenerate corners take the rotation of their face's other corners and scale 1. */
typedef struct vg_deformer vg_deformer;
typedef struct vg_deform_stats {
    uint64_t corners;    /* degenerate corners met, over all poses */
    uint64_t first_face; /* the first face of the graph that has one; UINT64_MAX: none */
} vg_deform_stats;

/* vg_deformer_new: g borrowed until free; reference: nv points, copied in part. threads >= 1. */
int vg_deformer_new(vg_deformer **d, const vg_graph *g, const double *reference, int threads,
                    vg_err *e) VG_MUST_CHECK;
void vg_deformer_free(vg_deformer **d);
/* What is transferred to the target (MATH 5): the rotation and scale of the corner (T 4.2); the deformation
 * gradient of the face (Sumner and Popovic 2004), for polygons; the mean of both results; or the source's deformed
 * vector at the target's size, to which the difference of the two reference vectors is added, turned with the face.
 * Line segments and links always use the first. */
typedef enum vg_method { VG_BY_POSE = 0, VG_BY_GRADIENT = 1, VG_BY_BLEND = 2, VG_BY_OFFSET = 3 } vg_method;
/* vg_deformer_target: apply deformations to these reference vectors (one per corner of the graph, copied) from now
 * on. */
int vg_deformer_target(vg_deformer *d, const double *target_vectors, vg_method method, vg_err *e) VG_MUST_CHECK;
/* vg_deformer_measure: n poses in (kind VG_VERTICES: nv points each; VG_VECTORS: one vector per corner), n arrays
 * of one quaternion per corner out. With a target, vg_deformer_apply: quaternions in, deformed target vectors out;
 * vg_deformer_transfer: poses in, deformed target vectors out (VG_BY_POSE: equal to measure and apply up to
 * rounding). Calls on one deformer must not overlap. */
void vg_deformer_measure(vg_deformer *d, size_t n, vg_kind kind, const double *const *poses,
                         double *const *quaternions);
void vg_deformer_transfer(vg_deformer *d, size_t n, vg_kind kind, const double *const *poses, double *const *vectors);
void vg_deformer_apply(vg_deformer *d, size_t n, const double *const *quaternions, double *const *vectors);
vg_deform_stats vg_deformer_get_stats(const vg_deformer *d);

/* A path through key poses (MATH 7; T 6.1): each vector rotates and scales along the geodesic from one key to the
 * next, in the same sense as its neighbours also beyond half a turn; the root moves in a straight line. Outside
 * the keys the first or last segment is extrapolated. */
typedef struct vg_path vg_path;
typedef struct vg_key {
    const double *values;  /* of a frame of vertices, vectors or deformations; borrowed until the path is freed */
    double root[3];
    const double *anchors; /* nanchors points; borrowed */
    double place;          /* increases from key to key: a number or time; affects only the speed of a smooth path */
} vg_key;
typedef struct vg_path_options {
    vg_kind kind;    /* of the keys' values */
    size_t nanchors;
    bool smooth;     /* velocities do not jump at keys */
    int threads;     /* >= 1 */
} vg_path_options;
typedef struct vg_path_stats {
    size_t segments; /* segments between keys prepared so far, counted again if prepared again */
    size_t beyond;   /* of these, those with rotations by more than half a turn */
    vg_deform_stats degenerate;
} vg_path_stats;

/* vg_path_new: g and keys are borrowed until free; reference: nv points. VG_EARG with fewer than two keys. */
int vg_path_new(vg_path **p, const vg_graph *g, const double *reference, const vg_key *keys, size_t nkeys,
                const vg_path_options *o, vg_err *e) VG_MUST_CHECK;
void vg_path_free(vg_path **p);
/* vg_path_at: the pose at t: vectors (one per corner), root and anchors (NULL if there are none) out. Key i is at
 * t = i. A segment is prepared when it is first needed and cached until another one is (three segments if smooth),
 * so ask in order. */
int vg_path_at(vg_path *p, double t, double *vectors, double root[3], double *anchors, vg_err *e) VG_MUST_CHECK;
vg_path_stats vg_path_get_stats(const vg_path *p);

/* Shape deformation (T 4.1 to 4.6): the deformations that take the source's reference vectors to those of the
 * target are applied to the vectors of each pose at the source face's centroid; corners that share a vertex are
 * averaged. No linear system; fails for large deformations. Gives vertices; the mean of the attached ones is the
 * source's. */
typedef struct vg_shaper vg_shaper;
/* vg_shaper_new: g, the graph of both, is borrowed until free; references: nv points each, not kept. */
int vg_shaper_new(vg_shaper **s, const vg_graph *g, const double *source_reference, const double *target_reference,
                  int threads, vg_err *e) VG_MUST_CHECK;
void vg_shaper_free(vg_shaper **s);
/* vg_shaper_transfer: n poses of the source in, n of the target out (nv points each); vertices in no face stay as
 * in the target's reference. */
void vg_shaper_transfer(vg_shaper *s, size_t n, const double *const *poses, double *const *vertices);

/* The position of the whole body in a transfer (MATH 5): root and anchors move from their positions in the
 * target's reference as the source's move from theirs, scaled by the ratio of the reference diagonals; or they
 * stay. */
typedef struct vg_mover vg_mover;
/* vg_mover_new: `to` is borrowed until free. anchors: of both meshes, if they have the same vertices. */
int vg_mover_new(vg_mover **m, const vg_graph *from, const double *source_reference, const vg_graph *to,
                 const double *target_reference, const uint32_t *anchors, size_t nanchors, bool stay,
                 vg_err *e) VG_MUST_CHECK;
void vg_mover_free(vg_mover **m);
/* vg_mover_move: set root and anchors of `out` from those of `in`. */
void vg_mover_move(const vg_mover *m, const vg_frame *in, vg_frame *out);
/* vg_mover_follow: what the root of the source is in its reference, and the ratio of the sizes, where those of the whole
 * meshes do not count. near: the ratio for ways that are short beside the source (up to 0.4 of its diagonal; from
 * 1.4 on `ratio` counts). If the body stays, it does. */
void vg_mover_follow(vg_mover *m, const double root[3], double near, double ratio);
/* vg_mover_place: translate a pose of the target until its root is at `root`; vertices in no face stay. */
void vg_mover_place(const vg_mover *m, const double root[3], double *vertices);

/* The vertices of the target that stay in a pose: those all of whose faces are driven only by source faces whose
 * vertices are all within 1e-6 D of their reference position. */
typedef struct vg_pinner vg_pinner;
/* vg_pinner_new: all arguments are borrowed until free. pairs NULL: shared connectivity. always: also when less
 * than a tenth of the source's vertices stay. */
int vg_pinner_new(vg_pinner **p, const vg_graph *from, const double *source_reference, const vg_graph *to,
                  const vg_correspondence *pairs, bool always, vg_err *e) VG_MUST_CHECK;
void vg_pinner_free(vg_pinner **p);
/* vg_pinner_find: the number of vertices that stay in a pose of the source, and the vertices, ascending; borrowed
 * until the next call. */
size_t vg_pinner_find(vg_pinner *p, const double *pose, const uint32_t **vertices);

/* Reconstruction: min over V of the squared difference between the vectors of V and the given ones (MATH 2; T
 * 3.7-3.9), by one sparse Cholesky factorisation, many poses per solve. */
typedef struct vg_solver vg_solver;
/* The metric of the misfit: all corners alike (T 3.7), or the reference surface's metric, which does not depend on
 * how the surface is cut into faces: cotangent weights on triangles that are not thin. Both meet consistent vectors
 * exactly. */
typedef enum vg_weights { VG_WEIGHTS_UNIFORM = 0, VG_WEIGHTS_AREA = 1 } vg_weights;
typedef struct vg_solver_stats {
    size_t unknowns, factor_entries; /* entries of the factor, explicit zeros included */
    double analyse_seconds, factor_seconds;
} vg_solver_stats;

/* vg_solver_new: g borrowed until free; anchors (n ascending vertices, each attached) are met exactly; without any,
 * the mean of the attached vertices is. reference (nv points, copied in part) places the vertices that are in no
 * face. VG_EINPUT when the graph is not connected, an anchor is in no face, or all of it is too large. */
int vg_solver_new(vg_solver **s, const vg_graph *g, const uint32_t *anchors, size_t nanchors, const double *reference,
                  vg_weights weights, int threads, vg_err *e) VG_MUST_CHECK;
/* vg_solver_new_like: n solvers for the graph and weights of `like` (from vg_solver_new), each with the anchors of that
 * one and others besides (nanchors[i] ascending vertices), for poses that hold vertices of their own. They cost far less
 * than new ones: what the anchors do not affect is shared. like is borrowed until they are freed. The threads share the
 * solvers. Errors as above; VG_EARG when an anchor of like is missing. */
int vg_solver_new_like(vg_solver **s, size_t n, vg_solver *like, const uint32_t *const *anchors, const size_t *nanchors,
                       vg_err *e) VG_MUST_CHECK;
void vg_solver_free(vg_solver **s);
/* vg_solver_load: from the vectors of n poses (and their anchors, nanchors points each; NULL if there are none),
 * compute first guesses x and right-hand sides for the difference to them, nv x 3 each. One call at a time per
 * solver; the threads share the poses. */
void vg_solver_load(vg_solver *s, size_t n, const double *const *vectors, const double *const *anchors,
                    double *const *x, double *const *rhs);
/* vg_solver_solve: n guesses x, with their right-hand sides, become n poses in place. anchors[i]: nanchors points of
 * pose i, or roots[i]: its root; the other is not looked at. Best when n is a multiple of vg_solver_batch. */
void vg_solver_solve(vg_solver *s, size_t n, const double *const *rhs, double *const *x, const double *const *anchors,
                     const double *const *roots);
/* vg_solver_load_each, vg_solver_solve_each: pose i is of solver each[i]: of one made by vg_solver_new, or like that. */
void vg_solver_load_each(size_t n, vg_solver *const *each, const double *const *vectors, const double *const *anchors,
                         double *const *x, double *const *rhs);
void vg_solver_solve_each(size_t n, vg_solver *const *each, const double *const *rhs, double *const *x,
                          const double *const *anchors, const double *const *roots);
size_t vg_solver_batch(const vg_solver *s);
vg_solver_stats vg_solver_get_stats(const vg_solver *s);

/* The least absolute misfit (MATH 2, Robust): poses that minimise the sum over faces of sqrt(e^2 + c^2), e the misfit of
 * a face in the metric of the solver, instead of the sum of e^2. The misfit of a few inconsistent faces stays local;
 * consistent vectors are met exactly. By a quasi-Newton search from the plain solution, one solve a round. */
typedef struct vg_robust vg_robust;
typedef struct vg_robust_stats {
    size_t most_rounds; /* largest number for one pose so far */
    size_t unfinished;  /* poses so far whose energy fell by 0.1 % or more in the last round */
} vg_robust_stats;

/* vg_robust_new: s borrowed until free. rounds: at most so many; eps: c as a part of the mean misfit of the plain
 * solution. VG_EARG unless eps > 0. */
int vg_robust_new(vg_robust **r, const vg_solver *s, size_t rounds, double eps, vg_err *e) VG_MUST_CHECK;
void vg_robust_free(vg_robust **r);
/* vg_robust_load: prepare the solution of n poses from their vectors and the first guesses of vg_solver_load. Out: misfits[i],
 * vg_robust_misfits numbers for pose i, and sizes, one number per pose. */
size_t vg_robust_misfits(const vg_robust *r);
void vg_robust_load(const vg_robust *r, size_t n, const double *const *vectors, const double *const *guesses,
                    float *const *misfits, double *sizes);
/* vg_robust_solve: instead of vg_solver_solve, or of vg_solver_solve_each if `each` is not NULL; its solvers are that of r or
 * made like it. The first call allocates workspace for eight poses per thread. */
int vg_robust_solve(vg_robust *r, size_t n, vg_solver *const *each, const double *const *rhs, const float *const *misfits, const double *sizes,
                    double *const *x, const double *const *anchors, const double *const *roots,
                    vg_err *e) VG_MUST_CHECK;
vg_robust_stats vg_robust_get_stats(const vg_robust *r);

/* Planarity (MATH 5; T 4.2.3): poses that minimise `fidelity` times the energy of the reconstruction plus `planarity`
 * times the sum over corners of faces of four and more of (m_f . t_c)^2, t_c the corner's vector, m_f the unit mean
 * of the cross products of successive given vectors of the face (no such term where that is 0). By conjugate
 * gradients from the plain solution. */
typedef struct vg_planar vg_planar;
typedef struct vg_planar_stats {
    size_t faces;          /* of four and more corners */
    size_t most_steps;     /* of one pose so far */
    double worst_residual; /* left at the end, relative to that of the plain solution; NaN if numbers overflowed */
} vg_planar_stats;

/* vg_planar_new: s borrowed until free. VG_EARG unless fidelity > 0 and planarity >= 0. */
int vg_planar_new(vg_planar **p, const vg_solver *s, double fidelity, double planarity, vg_err *e) VG_MUST_CHECK;
void vg_planar_free(vg_planar **p);
size_t vg_planar_faces(const vg_planar *p);
/* vg_planar_load: from the given vectors of a pose the m_f: 3 numbers for each of vg_planar_faces. */
void vg_planar_load(const vg_planar *p, const double *vectors, double *normals);
/* vg_planar_solve: make the faces of n poses x from vg_solver_solve more nearly planar, in place; anchors (or the root) and
 * vertices in no face do not move. Returns the number of the first pose that did not converge; n if all did. */
size_t vg_planar_solve(vg_planar *p, size_t n, const double *const *normals, double *const *x);
vg_planar_stats vg_planar_get_stats(const vg_planar *p);

/* Guidance in time (MATH 5; T 4.10, 4.16): a sequence keeps its second differences in time and meets given poses
 * at keys. Between two keys a < b the pose U_k becomes U_k + ((b - k) e_a + (k - a) e_b) / (b - a), e = given - U;
 * before the first key and after the last, that key's own e is added. */
typedef struct vg_guide vg_guide;
int vg_guide_new(vg_guide **g, size_t nv, vg_err *e) VG_MUST_CHECK;
void vg_guide_free(vg_guide **g);
/* vg_guide_key: set the pose (nv points) of frame number `frame`, which must be later than the previous key; the
 * result meets it to the last bit. Apply the poses between two keys before setting the next one. */
void vg_guide_key(vg_guide *g, uint64_t frame, double *pose, const double *given);
/* vg_guide_apply: guide the pose of frame number `frame` in place: one between the last two keys, after the last
 * key, or, with a single key, any. Without keys the pose is unchanged. */
void vg_guide_apply(const vg_guide *g, uint64_t frame, double *pose);

/* Guidance over the pose: the offsets of all keys are blended by the coordinates of a pose in the keys' poses, so that a key
 * corrects all poses that resemble its own; blended in time between keys of the same pose. */
typedef struct vg_pose_guide vg_pose_guide;
/* keys: the largest number of keys. */
int vg_pose_guide_new(vg_pose_guide **g, size_t nv, size_t keys, vg_err *e) VG_MUST_CHECK;
void vg_pose_guide_free(vg_pose_guide **g);
/* vg_pose_guide_key: frame number `frame`, later than the previous key, has this pose (nv points) and becomes `given`. */
void vg_pose_guide_key(vg_pose_guide *g, uint64_t frame, const double *pose, const double *given);
/* vg_pose_guide_apply: guide the pose of frame number `frame` in place, once all keys are set; a key's frame meets it to
 * the last bit. */
void vg_pose_guide_apply(vg_pose_guide *g, uint64_t frame, double *pose);

#ifdef __cplusplus
}
#endif
#endif
