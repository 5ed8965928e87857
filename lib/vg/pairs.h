/* vg/pairs.h: meshes of different connectivity: registration and transfer.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_PAIRS_H
#define VG_PART_PAIRS_H

#include "vg/markers.h"
#include "vg/vectors.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The known correspondences. */
typedef struct vg_register_input {
    const vg_mesh *source, *target;
    const double *source_points, *target_points;
    const vg_markers *markers;  /* may be NULL */
    const vg_seed *seeds;       /* may be NULL */
    size_t nseeds;
    bool seeds_of_source;       /* seeds are vertices of the source on the target; else of the target on the source */
    const vg_attributes *source_uv, *target_uv; /* both, or NULL: points with equal texture coordinates correspond */
    bool aligned;               /* the two meshes are aligned */
    bool keep_all;              /* keep markers that contradict the others */
    const uint32_t *components; /* the components of the source that take part, numbered as by vg_mesh_components; */
    size_t ncomponents;         /* 0: those with markers or seeds, and others that explain more of the target */
    bool all_components;        /* all of them */
    int threads;
} vg_register_input;

/* One round of the fit. */
typedef struct vg_register_step {
    size_t round, rounds;
    size_t near;      /* source vertices that the target pulls */
    double stiffness; /* weight of smoothness, relative to the target's */
    double mean, largest; /* distance of these vertices from the target, in D */
} vg_register_step;

typedef struct vg_register_result {
    vg_correspondence pairs;
    double *fitted;          /* source nv points: the source fitted to the target */
    double scale, rotation[9], shift[3]; /* the similarity that aligns the source with the target */
    bool flipped;            /* the two meshes have opposite orientations */
    double *residual;        /* per marker: its distance from where its neighbours predict it, in D of the target */
    bool *left_out;          /* per marker */
    double typical_residual; /* the median */
    size_t uv_pairs;         /* points paired by texture coordinates */
    size_t components;       /* of the source */
    bool *taken;             /* per component: it takes part */
} vg_register_result;

void vg_register_result_clear(vg_register_result *r);

/* vg_register: pair the faces of two meshes (MATH 9; after Sumner and Popovic 2004, section 5). step (may be NULL)
 * is called after each round of the fit. VG_EINPUT if the given pairs do not determine the alignment (three that
 * are not collinear are needed). */
int vg_register(vg_register_result *r, const vg_register_input *in,
                void (*step)(void *context, const vg_register_step *step), void *context, vg_err *e) VG_MUST_CHECK;

/* Transfer between meshes of different connectivity (MATH 9). A face that one face of as many corners drives goes
 * corner by corner, as by vg_deformer. Each other face of the target takes the deformation gradient of the source
 * faces that drive it, and by pose its rotation (polar) with the stretch that the gradient gives the direction of
 * each vector. Here the normal stretches by the root of the area's ratio, for the target's vectors lie across the
 * source's planes. Faces without a match of their own turn rigidly. Links follow the faces at their ends. */
typedef struct vg_cross_transfer vg_cross_transfer;
/* vg_cross_transfer_new: source: the whole source mesh and its reference pose; c: fits both meshes (checked: VG_EINPUT);
 * target: the graph of the target (all faces, then links) and its reference. All are borrowed until free. */
int vg_cross_transfer_new(vg_cross_transfer **c, const vg_mesh *source, const double *source_reference,
                   const vg_correspondence *pairs, const vg_graph *target, const double *target_reference,
                   vg_method method, int threads, vg_err *e) VG_MUST_CHECK;
void vg_cross_transfer_free(vg_cross_transfer **c);
/* vg_cross_transfer_fitted: the source as it was fitted to the target, source nv points, which VG_BY_OFFSET needs:
 * without it that is VG_BY_GRADIENT. mixed: poses whose parts turn little go as sums of
 * shapes: motions keep their size between people whose meshes have one unit, and the target's offsets turn with the
 * whole body and where parts or faces turn far; the more the parts turn, the more go by gradient. */
int vg_cross_transfer_fitted(vg_cross_transfer *c, const double *target_reference, const double *fitted,
                             bool mixed, vg_err *e) VG_MUST_CHECK;
/* vg_cross_transfer_root: the centroid of what drives the target in a pose: of the places of its vertices. Other parts of
 * the source do not count. */
void vg_cross_transfer_root(const vg_cross_transfer *c, const double *pose, double root[3]);
/* vg_cross_transfer_size: the size of the target relative to that part; of small motions: where they keep their size, that
 * of a unit. */
double vg_cross_transfer_size(const vg_cross_transfer *c, bool small_motions);
/* vg_cross_transfer_apply: n poses of the source (vertices) in, n times the target's wanted vectors out. */
void vg_cross_transfer_apply(vg_cross_transfer *c, size_t n, const double *const *poses, double *const *vectors);
/* corners: source faces without a direction, over all poses */
vg_deform_stats vg_cross_transfer_get_stats(const vg_cross_transfer *c);
/* vg_cross_transfer_turned: the rotation in degrees of the matched faces of the target relative to the source
 * faces that drive them, in the two references: the angle of the mean cosine between normals. Opposite orientation
 * does not count. */
double vg_cross_transfer_turned(const vg_cross_transfer *c);

/* vg_points_turn: the rotation that lays n points about their centroid nearest to as many others about theirs, and its angle
 * in degrees. *miss: the distance that is left, both at one size, in the root of the mean square, relative to the size. */
double vg_points_turn(const double *from, const double *to, size_t n, double turn[9], double *miss);

/* Expressions onto a mesh of the same faces, as sums of shapes: the source's motion, in its own size, is added to what the
 * target is. It replaces what vg_deformer_transfer gives by offset, the less the further parts are turned against each
 * other. */
typedef struct vg_sums vg_sums;
/* vg_sums_new: the graph of both and their references; the graph is borrowed until free. */
int vg_sums_new(vg_sums **s, const vg_graph *g, const double *source_reference, const double *target_reference, int threads,
                vg_err *e) VG_MUST_CHECK;
void vg_sums_free(vg_sums **s);
/* vg_sums_size: how much larger motions are on the target. */
double vg_sums_size(const vg_sums *s);
/* vg_sums_mix: n poses of the source, as VG_VERTICES or VG_VECTORS, and the target's wanted vectors by offset, which change
 * in place. */
void vg_sums_mix(vg_sums *s, size_t n, vg_kind kind, const double *const *poses, double *const *vectors);

/* Transfer that is exact at a few sculpted poses (MATH 11; after the example-based transfer of Cashman and Hormann
 * 2012, 4.3, as a correction of plain transfer): the error of plain transfer in the examples is subtracted in
 * proportion to a pose's similarity to them. */
typedef struct vg_examples {
    size_t n;
    const double *const *source;      /* n poses of the source: vertices */
    const double *const *target;      /* the same poses of the target: vertices */
    const double *const *transferred; /* plain transfer of these poses: vectors of the target's graph */
} vg_examples;
typedef struct vg_corrector vg_corrector;
/* vg_corrector_new: graphs are borrowed until free; the rest is copied. VG_EINPUT if an example depends linearly
 * on the others. */
int vg_corrector_new(vg_corrector **c, const vg_graph *source, const double *source_reference, const vg_graph *target,
                     const double *target_reference, const vg_examples *examples, int threads, vg_err *e) VG_MUST_CHECK;
void vg_corrector_free(vg_corrector **c);
/* vg_corrector_apply: correct, in place, the vectors that plain transfer gave for a pose of the source. */
void vg_corrector_apply(vg_corrector *c, const double *pose, double *vectors);

/* The vertices that change places when a body is mirrored in the middle of its rest pose. */
typedef struct vg_mirror {
    size_t nv, axis;     /* 0 1 2 = x y z */
    double plane;        /* the mirror is where this coordinate has this value */
    uint32_t *partner;   /* nv: partner[partner[v]] = v; on the middle line the vertex itself */
    double mean, largest; /* distance of the mirrored partner from the vertex in the rest pose, mesh units */
    uint32_t farthest;   /* the vertex with the largest */
    size_t edges, broken; /* edges of the mesh, and those whose partners are no edge */
} vg_mirror;

void vg_mirror_clear(vg_mirror *m);
/* vg_mirror_find: pair the vertices by position, and by normal where several are at one place. VG_EINPUT when a vertex has
 * no partner within 2 % of D. pairs: the known pairs; nothing is searched then, and all other vertices are their own partners.
 * NULL: search. O(n log n). */
int vg_mirror_find(vg_mirror *m, const vg_mesh *mesh, const double *points, size_t axis, const vg_markers *pairs,
                   vg_err *e) VG_MUST_CHECK;
/* vg_mirror_pose: nv points in, nv mirrored points out; out is not in. */
void vg_mirror_pose(const vg_mirror *m, const double *in, double *out);

/* The distance between two surfaces of any connectivity, both ways: of points of one from the nearest point of the other,
 * which is exact. The points are the vertices and the centroids of triangles, weighted so that mean and rms integrate
 * quadratic functions over each triangle exactly; a face of four or more corners is a fan around its centroid. */
typedef struct vg_surface_distance {
    double mean, rms, p95, max; /* weighted by area; mesh units. p95 is exact to 0.3 % */
    double at[3];               /* the point with the largest */
    size_t frame;               /* ... and its frame, counted from 0 */
} vg_surface_distance;
typedef struct vg_surface_measures vg_surface_measures;
/* vg_surface_measures_new: the meshes are borrowed until free; both need faces (VG_EINPUT). scale: D, or any length of that
 * order. */
int vg_surface_measures_new(vg_surface_measures **x, const vg_mesh *truth, const vg_mesh *result, double scale, int threads,
                            vg_err *e) VG_MUST_CHECK;
void vg_surface_measures_free(vg_surface_measures **x);
/* vg_surface_measures_add: one frame. found (may be NULL): of this frame, [0] from the truth to the result, [1] back. */
int vg_surface_measures_add(vg_surface_measures *x, const double *truth, const double *result,
                            vg_surface_distance found[2], vg_err *e) VG_MUST_CHECK;
/* vg_surface_measures_get: of all frames, as found. */
void vg_surface_measures_get(const vg_surface_measures *x, vg_surface_distance found[2]);
/* vg_surface_measures_vertices: the distance of each vertex of the result in the last frame. Borrowed until the next call. */
const double *vg_surface_measures_vertices(const vg_surface_measures *x);

/* A mesh that rides on another one: clothes, hair, a prop, a cage. */
/* vg_bind: each face of the target is bound to the source faces around the point that is nearest to its centroid in the
 * two rest poses. matched is VG_BOUND for all faces. VG_EINPUT when the source has no face with an area. */
enum { VG_BOUND = 2 };
int vg_bind(vg_correspondence *c, const vg_mesh *source, const double *source_points, const vg_mesh *target,
            const double *target_points, int threads, vg_err *e) VG_MUST_CHECK;
bool vg_is_bound(const vg_correspondence *c);

/* Each vertex of the target keeps its nearest point on the source. What it is away from there turns and stretches with the
 * source faces that its faces are bound to: along a face as that does, along its normal without stretch. */
typedef struct vg_rider vg_rider;
/* vg_rider_new: c is bound and fits both meshes (VG_EINPUT); source and source_points are borrowed until free. */
int vg_rider_new(vg_rider **r, const vg_mesh *source, const double *source_points, const vg_correspondence *c,
                 const vg_mesh *target, const double *target_points, int threads, vg_err *e) VG_MUST_CHECK;
void vg_rider_free(vg_rider **r);
/* vg_rider_apply: a pose of the source in, the vertices of the target out. */
void vg_rider_apply(vg_rider *r, const double *pose, double *vertices);

#ifdef __cplusplus
}
#endif
#endif
