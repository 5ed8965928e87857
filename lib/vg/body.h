/* vg/body.h: a body: mesh, attributes, skeleton, patches, rig.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_BODY_H
#define VG_PART_BODY_H

#include "vg/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A mesh: nf faces of any mix of sizes >= 2 (2 = line segment or bone). Face f is the cycle of vertices
 * vert[start[f]] .. vert[start[f + 1] - 1]; start has nf + 1 entries, vert has start[nf] entries, each < nv.
 * A corner is a position in vert. A valid mesh names no vertex twice in one face. nv and corners are < 2^32 - 1. */
typedef struct vg_mesh {
    size_t nv, nf;
    uint32_t *start;
    uint32_t *vert;
} vg_mesh;

size_t vg_mesh_corners(const vg_mesh *m); /* start[nf], or 0 for a mesh without faces */
void vg_mesh_clear(vg_mesh *m);
int vg_mesh_copy(vg_mesh *to, const vg_mesh *from, vg_err *e) VG_MUST_CHECK;

/* vg_mesh_check: VG_OK, or VG_EINPUT naming the first face that is too small, has an index out of range, or names a
 * vertex twice, or when there are too many of anything. `subject` is what the message calls the mesh ("file
 * 'a.obj'"). O(corners). */
int vg_mesh_check(const vg_mesh *m, const char *subject, vg_err *e) VG_MUST_CHECK;

/* vg_mesh_same: VG_OK when both have the same vertex count and the same faces in the same order; else VG_EINPUT, and
 * the message says what differs first ("'b.obj' has 12 vertices where 'a.obj' has 8"). */
int vg_mesh_same(const vg_mesh *a, const char *a_name, const vg_mesh *b, const char *b_name,
                 vg_err *e) VG_MUST_CHECK;

/* vg_mesh_components: label[v] (length nv) = number of the connected component of vertex v, in order of first vertex;
 * every vertex in no face has label UINT32_MAX. *count = number of components. */
int vg_mesh_components(const vg_mesh *m, uint32_t *label, size_t *count, vg_err *e) VG_MUST_CHECK;

/* vg_diagonal: D, the diagonal of the bounding box of n points. 0 for n = 0. */
double vg_diagonal(const double *points, size_t n);

/* vg_centroid: mean of n points; zeros for n = 0. */
void vg_centroid(const double *points, size_t n, double centroid[3]);

/* What a mesh file says beside positions and faces, kept so that it can be written again. */
typedef enum vg_label_kind {
    VG_LABEL_OBJECT = 1,    /* OBJ o */
    VG_LABEL_GROUP = 2,     /* OBJ g */
    VG_LABEL_MATERIAL = 3,  /* OBJ usemtl */
    VG_LABEL_SMOOTHING = 4, /* OBJ s */
    VG_LABEL_LIBRARY = 5    /* OBJ mtllib */
} vg_label_kind;

typedef struct vg_label { /* holds from face `face` on, until the next label of its kind; labels are in face order */
    uint64_t face;        /* 0 .. nf */
    uint32_t kind;
    char *text; /* UTF-8 */
} vg_label;

typedef struct vg_attributes {
    size_t ntex;         /* texture coordinates */
    uint32_t tex_dim;    /* 1 to 3 numbers each */
    double *tex;         /* ntex * tex_dim */
    uint32_t *corner_tex; /* per corner its texture coordinate, UINT32_MAX = none; NULL when ntex is 0 */
    size_t nlabels;
    vg_label *labels;
} vg_attributes;

void vg_attributes_clear(vg_attributes *a);
int vg_attributes_copy(vg_attributes *to, const vg_attributes *from, const vg_mesh *mesh, vg_err *e) VG_MUST_CHECK;

/* A skeleton: joint j is vertex j of the mesh, whose faces are the bones (parent, child) in the order of their
 * children. */
typedef struct vg_joint {
    char *name;       /* UTF-8; an end site has its parent's name with ".end" behind it */
    uint32_t parent;  /* less than its own number; UINT32_MAX: a root */
    double offset[3]; /* from the parent, in the reference pose */
    uint32_t nchannels;
    uint8_t channels[6]; /* 1 2 3: x y z position, 4 5 6: x y z rotation, in the order of the file; none: an end
                            site */
} vg_joint;

typedef struct vg_skeleton {
    size_t njoints; /* 0: the sequence has no skeleton */
    vg_joint *joints;
} vg_skeleton;

void vg_skeleton_clear(vg_skeleton *s);
int vg_skeleton_copy(vg_skeleton *to, const vg_skeleton *from, vg_err *e) VG_MUST_CHECK;
size_t vg_skeleton_channels(const vg_skeleton *s); /* of all joints */
/* vg_skeleton_mesh: the bones as faces. */
int vg_skeleton_mesh(const vg_skeleton *s, vg_mesh *m, vg_err *e) VG_MUST_CHECK;
/* vg_skeleton_pose: forward kinematics. values: one for each channel, joint after joint (NULL: the reference pose): a
 * position stands for that coordinate of the offset, of a root for its place; the rotations of a joint, in degrees,
 * are multiplied in their order and turn what is below it. Out: njoints positions, and njoints unit quaternions w x y
 * z that take directions of the reference pose to where the joint has turned them. */
void vg_skeleton_pose(const vg_skeleton *s, const double *values, double *positions, double *turns);

/* The way back. A joint with children in several directions turns as they do together (least squares, lengths of the
 * reference), one with children in one direction by the smallest turn beside its parent's, one without children not
 * at all. Joints that lie on their parent in the reference pose pass on to it what their own children say. */
typedef struct vg_joint_fitter vg_joint_fitter;
/* s borrowed until free */
int vg_joint_fitter_new(vg_joint_fitter **f, const vg_skeleton *s, vg_err *e) VG_MUST_CHECK;
void vg_joint_fitter_free(vg_joint_fitter **f);
/* vg_joint_fitter_fit: positions (njoints points) in, values (may be NULL) out, angles as near as can be to those of
 * the call before. turns (may be NULL): how the joints are turned, as vg_skeleton_pose gives it, where that is known:
 * then nothing of it has to be found. Returns the largest distance of a joint from where the values put it, and that
 * joint: bones keep their lengths unless the joint has position channels, and a joint with fewer than three rotations
 * cannot turn every way. */
double vg_joint_fitter_fit(vg_joint_fitter *f, const double *positions, const double *turns, double *values,
                           size_t *joint);
/* vg_joint_fitter_turns: the turns of all joints by the last fit. Borrowed until the next. */
const double *vg_joint_fitter_turns(const vg_joint_fitter *f);

/* A division of the faces into patches. */
typedef struct vg_patches {
    size_t n;          /* 0: there is none */
    uint32_t *of_face; /* nf: the patch of each face, less than n */
} vg_patches;

void vg_patches_clear(vg_patches *p);

/* A skeleton that drives the mesh, and linear blend skinning with it (MATH 6; T 5). Transform b of the rig is the
 * motion of joint bone[b]: what takes a point of the reference pose that is rigid with it to where it is now. */
enum { VG_SKIN = 4 };
typedef struct vg_rig {
    vg_skeleton skeleton; /* njoints 0: there is no rig */
    double *at;           /* a point for each joint: where it is in the reference pose of the mesh */
    double *turn;         /* a unit quaternion for each joint: how it is turned there, beside the skeleton's pose
                             without rotations */
    size_t nbones;
    uint32_t *bone;       /* the joints that have channels, ascending: those that turn */
    uint32_t *skin_bone;  /* VG_SKIN bones for each vertex of the mesh; NULL: there are no weights */
    double *skin_weight;  /* VG_SKIN for each vertex: >= 0, sum 1, the largest first; 0 where fewer bones move it */
} vg_rig;

void vg_rig_clear(vg_rig *r);
int vg_rig_copy(vg_rig *to, const vg_rig *from, size_t nv, vg_err *e) VG_MUST_CHECK;
/* vg_rig_make: a rig without weights; the skeleton is copied. positions, turns: of its joints in the reference pose
 * of the mesh, as vg_skeleton_pose gives them. VG_EINPUT when no joint has channels. */
int vg_rig_make(vg_rig *r, const vg_skeleton *s, const double *positions, const double *turns,
                vg_err *e) VG_MUST_CHECK;
/* vg_rig_transforms: positions and turns of all joints in a pose to nbones transforms of 7 numbers, as in
 * VG_TRANSFORMS. */
void vg_rig_transforms(const vg_rig *r, const double *positions, const double *turns, double *transforms);
/* vg_rig_skin: linear blend skinning of n vertices' reference pose by transforms. */
void vg_rig_skin(const vg_rig *r, size_t nv, const double *reference, const double *transforms, double *vertices);

/* vg_rig_find: the bone of this name; nbones: there is none. */
size_t vg_rig_find(const vg_rig *r, const char *name);
/* vg_rig_axis: where bone b points in the reference pose, a unit vector: to what is below its joint. false: nothing
 * is. */
bool vg_rig_axis(const vg_rig *r, size_t b, double axis[3]);
/* vg_rig_edit: turn bone b, and all that hangs on it, by degrees about its joint; the axis, in the reference pose,
 * turns with the bone. In place. */
void vg_rig_edit(const vg_rig *r, size_t b, const double axis[3], double degrees, double *transforms);

/* A body: what goes together whatever happens to the frames of a sequence. Arrays are owned. */
typedef struct vg_body {
    vg_mesh mesh;
    double *reference;    /* nv points: the undeformed pose. Always there when the mesh has vertices */
    char *reference_name; /* never NULL in a body that was read */
    vg_attributes attributes;
    vg_skeleton skeleton;
    vg_patches patches;   /* a stream of vg-segment, and those that come of it */
    vg_rig rig;           /* of a map of bones; also in streams of transforms of bones */
} vg_body;

void vg_body_clear(vg_body *b);
/* vg_body_copy: all of it. */
int vg_body_copy(vg_body *to, const vg_body *from, vg_err *e) VG_MUST_CHECK;
/* vg_body_take: *to becomes *from, what it held is cleared, and *from is left empty. */
void vg_body_take(vg_body *to, vg_body *from);

/* vg_mesh_digest: a number that tells meshes apart by their vertex count and faces (XXH64, fmt/STREAM.md). */
uint64_t vg_mesh_digest(const vg_mesh *m);

#ifdef __cplusplus
}
#endif
#endif
