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
void vg_mesh_take(vg_mesh *to, vg_mesh *from); /* as vg_body_take */

/* vg_mesh_check: VG_OK, or VG_EINPUT naming the first face that is too small, has an index out of range or names a
 * vertex twice, or a count that exceeds its limit. Messages call the mesh `subject` ("file 'a.obj'"). O(corners). */
int vg_mesh_check(const vg_mesh *m, const char *subject, vg_err *e) VG_MUST_CHECK;

/* vg_mesh_same: VG_OK if both have the same vertex count and the same faces in the same order; else VG_EINPUT with
 * the first difference ("'b.obj' has 12 vertices where 'a.obj' has 8"). */
int vg_mesh_same(const vg_mesh *a, const char *a_name, const vg_mesh *b, const char *b_name,
                 vg_err *e) VG_MUST_CHECK;

/* vg_mesh_components: label[v] (length nv) = the connected component of vertex v, numbered in order of first
 * vertex; UINT32_MAX for a vertex in no face. *count = number of components. */
int vg_mesh_components(const vg_mesh *m, uint32_t *label, size_t *count, vg_err *e) VG_MUST_CHECK;

/* vg_diagonal: D, the diagonal of the bounding box of n points. 0 for n = 0. */
double vg_diagonal(const double *points, size_t n);

/* vg_centroid: mean of n points; zeros for n = 0. */
void vg_centroid(const double *points, size_t n, double centroid[3]);

/* The faces of a mesh that carry vectors. */
typedef struct vg_selection {
    bool chosen;     /* false: all faces do */
    size_t n;
    uint32_t *faces; /* ascending */
} vg_selection;

/* Virtual faces of two vertices that join the components of a mesh. */
typedef struct vg_links {
    bool chosen;     /* perhaps none were needed */
    size_t n;
    uint32_t *pairs; /* 2 vertices per link */
} vg_links;

/* Attributes of a mesh file other than positions and faces, kept so that they can be written again. */
typedef enum vg_label_kind {
    VG_LABEL_OBJECT = 1,    /* OBJ o */
    VG_LABEL_GROUP = 2,     /* OBJ g */
    VG_LABEL_MATERIAL = 3,  /* OBJ usemtl */
    VG_LABEL_SMOOTHING = 4, /* OBJ s */
    VG_LABEL_LIBRARY = 5    /* OBJ mtllib */
} vg_label_kind;

typedef struct vg_label { /* applies from face `face` on, until the next label of its kind; labels are in face
                             order */
    uint64_t face;        /* 0 .. nf */
    uint32_t kind;
    char *text; /* UTF-8 */
} vg_label;

typedef struct vg_attributes {
    size_t ntex;         /* texture coordinates */
    uint32_t tex_dim;    /* 1 to 3 numbers each */
    double *tex;         /* ntex * tex_dim */
    uint32_t *corner_tex; /* the texture coordinate of each corner, UINT32_MAX = none; NULL when ntex is 0 */
    size_t nlabels;
    vg_label *labels;
    size_t ncolours;     /* colours of vertices: 0, or one for each vertex of the mesh */
    uint8_t *colours;    /* ncolours x 4: red, green, blue (sRGB), opacity */
} vg_attributes;

void vg_attributes_clear(vg_attributes *a);
int vg_attributes_copy(vg_attributes *to, const vg_attributes *from, const vg_mesh *mesh, vg_err *e) VG_MUST_CHECK;

/* The materials, textures, normals, skin and nodes of the file that the mesh came from, kept as a whole for a
 * writer of the same format. */
typedef struct vg_asset {
    size_t n;         /* vertices of the file; 0: there is no asset */
    uint64_t digest;  /* vg_mesh_digest of the mesh that it belongs to */
    uint32_t *vertex; /* n: the vertex of the mesh for each vertex of the file */
    size_t size;
    uint8_t *data;    /* a GLB of the character at rest */
} vg_asset;

void vg_asset_clear(vg_asset *a);
/* vg_asset_text: a summary, "2 materials, 1 texture, normals, 1 skin"; empty if there is none, or only nodes and
 * vertices. */
void vg_asset_text(const vg_asset *a, char *to, size_t room);
/* vg_asset_vertices: call take for every vertex of the file, in its order: the name of the node that shows it (empty: it has
 * none), the number of the primitive in the node's mesh, its number in the primitive, and the vertex of the mesh that it is. */
typedef void vg_asset_take(void *context, const char *node, size_t primitive, size_t index, uint32_t vertex);
int vg_asset_vertices(const vg_asset *a, vg_asset_take *take, void *context, vg_err *e) VG_MUST_CHECK;

/* A skeleton: joint j is vertex j of the mesh, whose faces are the bones (parent, child) in the order of their
 * children. */
typedef struct vg_joint {
    char *name;       /* UTF-8; an end site is named after its parent, with ".end" appended */
    uint32_t parent;  /* less than its own number; UINT32_MAX: a root */
    double offset[3]; /* from the parent, in the reference pose */
    uint32_t nchannels;
    uint8_t channels[6]; /* in the order of the file: 1 2 3 = x y z position, 4 5 6 = x y z rotation; an end site
                            has none */
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
/* vg_skeleton_pose: forward kinematics. values: one per channel, joint by joint (NULL: the reference pose). A
 * position replaces that coordinate of the joint's offset, for a root of its position. The rotations of a joint,
 * in degrees, are multiplied in file order and rotate everything below it. Out: njoints positions, and njoints
 * unit quaternions w x y z that take directions of the reference pose to their current directions. */
void vg_skeleton_pose(const vg_skeleton *s, const double *values, double *positions, double *turns);

/* Inverse kinematics: channel values from positions. A joint with children in several directions takes the best
 * common rotation (least squares, reference lengths), one with children in a single direction the smallest
 * rotation relative to its parent, one without children none. Joints at the position of their parent pass on to it
 * what their children say. */
typedef struct vg_joint_fitter vg_joint_fitter;
/* s borrowed until free */
int vg_joint_fitter_new(vg_joint_fitter **f, const vg_skeleton *s, vg_err *e) VG_MUST_CHECK;
void vg_joint_fitter_free(vg_joint_fitter **f);
/* vg_joint_fitter_fit: positions (njoints points) in; values out (may be NULL), with angles closest to those of
 * the previous call. turns (may be NULL): the known rotations of the joints, as from vg_skeleton_pose; then they
 * are not estimated. Returns the largest distance between a joint and its position by these values, and that
 * joint: bones keep their lengths unless the joint has position channels, and a joint with fewer than three
 * rotations cannot reach every orientation. */
double vg_joint_fitter_fit(vg_joint_fitter *f, const double *positions, const double *turns, double *values,
                           size_t *joint);
/* vg_joint_fitter_turns: the rotations of all joints from the last fit. Borrowed until the next fit. */
const double *vg_joint_fitter_turns(const vg_joint_fitter *f);

/* A division of the faces into patches. */
typedef struct vg_patches {
    size_t n;          /* 0: there is none */
    uint32_t *of_face; /* nf: the patch of each face, less than n */
} vg_patches;

void vg_patches_clear(vg_patches *p);
int vg_patches_copy(vg_patches *to, const vg_patches *from, size_t nf, vg_err *e) VG_MUST_CHECK;

/* A skeleton that drives the mesh, with linear blend skinning (MATH 6; T 5). Transform b of the rig is the rigid
 * motion of joint bone[b] from the reference pose. */
enum { VG_SKIN = 4 };
typedef struct vg_rig {
    vg_skeleton skeleton; /* njoints 0: there is no rig */
    double *at;           /* the position of each joint in the reference pose of the mesh */
    double *turn;         /* the rotation of each joint there (unit quaternion), relative to the skeleton's pose
                             without rotations */
    size_t nbones;
    uint32_t *bone;       /* the joints that have channels, ascending */
    uint32_t *skin_bone;  /* VG_SKIN bones per vertex of the mesh; NULL: no weights */
    double *skin_weight;  /* VG_SKIN per vertex: >= 0, sum 1, the largest first; unused places are 0 */
} vg_rig;

void vg_rig_clear(vg_rig *r);
int vg_rig_copy(vg_rig *to, const vg_rig *from, size_t nv, vg_err *e) VG_MUST_CHECK;
/* vg_rig_make: a rig without weights; the skeleton is copied. positions, turns: of its joints in the reference
 * pose of the mesh, as from vg_skeleton_pose. VG_EINPUT if no joint has channels. */
int vg_rig_make(vg_rig *r, const vg_skeleton *s, const double *positions, const double *turns,
                vg_err *e) VG_MUST_CHECK;
/* vg_rig_transforms: convert positions and rotations of all joints in a pose to nbones transforms of 7 numbers, as
 * in VG_TRANSFORMS. */
void vg_rig_transforms(const vg_rig *r, const double *positions, const double *turns, double *transforms);
/* vg_rig_skin: linear blend skinning of nv reference vertices by the transforms. */
void vg_rig_skin(const vg_rig *r, size_t nv, const double *reference, const double *transforms, double *vertices);

/* vg_rig_find: the bone with this name; nbones if there is none. */
size_t vg_rig_find(const vg_rig *r, const char *name);
/* vg_rig_axis: the unit direction of bone b in the reference pose, towards the joints below it; false if there are
 * none. */
bool vg_rig_axis(const vg_rig *r, size_t b, double axis[3]);
/* vg_rig_edit: rotate bone b and everything below it by `degrees` about its joint. The axis is given in the
 * reference pose and follows the bone. In place. */
void vg_rig_edit(const vg_rig *r, size_t b, const double axis[3], double degrees, double *transforms);

/* A body: the data that belongs together whatever happens to the frames of a sequence. Arrays are owned. */
typedef struct vg_body {
    vg_mesh mesh;
    double *reference;    /* nv points: the undeformed pose; present whenever the mesh has vertices */
    char *reference_name; /* never NULL in a body that was read */
    vg_attributes attributes;
    vg_asset asset;
    vg_skeleton skeleton;
    vg_patches patches;   /* of a stream of vg-segment and of streams made from it */
    vg_rig rig;           /* of a map of bones, and of streams of transforms of bones */
} vg_body;

void vg_body_clear(vg_body *b);
/* vg_body_copy: a deep copy. */
int vg_body_copy(vg_body *to, const vg_body *from, vg_err *e) VG_MUST_CHECK;
/* vg_body_take: move *from into *to; the former content of *to is released, *from becomes empty. */
void vg_body_take(vg_body *to, vg_body *from);

/* vg_mesh_digest: a hash of the vertex count and faces (XXH64, fmt/STREAM.md). */
uint64_t vg_mesh_digest(const vg_mesh *m);

#ifdef __cplusplus
}
#endif
#endif
