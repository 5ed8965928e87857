/* vg.h: the one public header of libvg, the library under the vg-* programs.
 *
 * The layers, each knowing only those above it in this file: core (errors, memory), model (mesh, head and
 * frame of a sequence, vector graph, rotations, measures), method (selection, deformation, reconstruction),
 * io (stream, mesh files, archives; the two doors `vg_source` and `vg_sink`), view (pictures).
 *
 * Conventions. Arrays of points and vectors are interleaved: xyzxyz... Index base is 0. Lengths are in the unit of
 * the mesh. D is the diagonal of the bounding box of the reference pose. Functions that can fail return an int:
 * VG_OK or more on success, a negative vg_code on failure, with the details in *e (e may be NULL). Whoever calls
 * _new or _open calls _free or _close, which take the address of the pointer and leave NULL there. Structs are
 * prepared by = {0} and released by _clear, which leaves them zero; _copy writes over what was there, and leaves
 * zero when it fails. Where a thing takes threads, these must be >= 1, and calls on it go one after another; the
 * results do not depend on their number. The library never prints and never exits. The mathematics is cited as (T n)
 * from the thesis on vector graphs that the man page vg(7) names.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_H
#define VG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define VG_VERSION "0.1.0"

#if defined(__GNUC__)
#define VG_MUST_CHECK __attribute__((warn_unused_result))
#define VG_PRINTF(a, b) __attribute__((format(printf, a, b)))
#else
#define VG_MUST_CHECK
#define VG_PRINTF(a, b)
#endif

/* ------------------------------------------------------------------------------------------------ core -- */

/* The exit status of a program that stops on an error follows from the code: VG_EARG 2, VG_EINPUT and VG_ETRUNC 3,
 * VG_ESYS and VG_ENOMEM 4. */
typedef enum vg_code {
    VG_OK = 0,
    VG_EARG = -1,   /* the caller asked for something that does not exist or does not fit */
    VG_EINPUT = -2, /* malformed input, or inputs that do not fit one another */
    VG_ETRUNC = -3, /* input that ends too early */
    VG_ESYS = -4,   /* the system refused: open, read, write, ... */
    VG_ENOMEM = -5
} vg_code;

/* What went wrong: one line without a final full stop, with the file or frame it is about. Control characters of
 * the input are replaced by '?'. */
typedef struct vg_err {
    int code;
    char message[480];
} vg_err;

/* vg_fail: fill *e (unless NULL) and return `code`. Control characters are stripped from the result. */
int vg_fail(vg_err *e, int code, const char *format, ...) VG_PRINTF(3, 4);

/* vg_exit_status: the exit status that STYLE gives to a code (see vg_code). */
int vg_exit_status(int code);

/* Bytes that grow. data is NULL while cap is 0. */
typedef struct vg_bytes {
    unsigned char *data;
    size_t size, cap;
} vg_bytes;

void vg_bytes_clear(vg_bytes *b);

/* ----------------------------------------------------------------------------------------------- model -- */

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

/* Which faces of a source mesh drive each face of a target mesh (MATH 9). */
typedef struct vg_correspondence {
    size_t source_nv, source_nf, target_nv, target_nf;
    uint64_t source_digest, target_digest; /* vg_mesh_digest of both */
    uint32_t *first;    /* target_nf + 1; NULL: there is no correspondence. first[f] < first[f + 1]: every face is
                           driven */
    uint32_t *source;   /* pairs of target face f: source[first[f]] .. source[first[f + 1] - 1] */
    double *weight;     /* of each pair, > 0; of one target face they sum to 1 */
    double *distance;   /* target_nf: from its centroid to the matched source face's, after fitting, mesh units of the
                           target */
    uint8_t *matched;   /* target_nf: 1: found near by; 0: rides with the nearest matched face */
} vg_correspondence;

void vg_correspondence_clear(vg_correspondence *c);
int vg_correspondence_copy(vg_correspondence *to, const vg_correspondence *from, vg_err *e) VG_MUST_CHECK;

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

/* A rig driven by a skeleton of its own or another one; joints belong together by name. Joints of the rig that the
 * other does not have follow those above them. The rig keeps the lengths of its bones and goes as far as its size,
 * beside the other's, wants. */
typedef struct vg_driver vg_driver;
/* vg_driver_new: both are borrowed until free. align: the skeletons do not rest alike: bones of the rig point where
 * those of the other one do. VG_EINPUT when no names fit. */
int vg_driver_new(vg_driver **d, const vg_rig *r, const vg_skeleton *by, bool align, vg_err *e) VG_MUST_CHECK;
void vg_driver_free(vg_driver **d);
size_t vg_driver_missing(const vg_driver *d); /* bones of the rig that follow others */
/* vg_driver_pose: positions and turns of the other skeleton's joints to nbones transforms. */
void vg_driver_pose(vg_driver *d, const double *positions, const double *turns, double *transforms);

/* What drives a map: the transforms of patches, or of the bones of a rig. */
typedef enum vg_map_kind { VG_MAP_PATCHES = 1, VG_MAP_BONES = 2 } vg_map_kind;

/* Vertices as a linear function of transforms (MATH 7; T 6.3): with transform p taking x to A_p x + t_p, vertex v is
 * at sum over p of A_p e_vp + tau_vp t_p. What the operator was made of is kept,
 * so that it can be made for another body. */
typedef struct vg_map {
    size_t n;            /* transforms; 0: there is no map */
    size_t nv;           /* vertices, those of the mesh */
    vg_map_kind kind;
    double *weights;     /* nv x 4n: e_vp and tau_vp, p after p */
    double *place;       /* n x 3n: where only the A are known, t_p - root = sum over j of A_j times three numbers */
    double *centre;      /* n points: of each patch in the reference pose */
    double *home_centre; /* the same on the body that poses are measured on */
    double *share;       /* n, sum 1: root = sum of share_p (A_p centre_p + t_p) */
    double size;         /* of this body beside the one that poses are measured on */
    bool has_home;       /* the body that poses are measured on is another one: */
    double *home;        /* its reference pose, nv points; NULL: the mesh's own */
    size_t njoints;      /* pairs of patches that hang together; of bones none: their skeleton says how they do */
    uint32_t *joint;     /* two patches each */
    double *joint_at;    /* the point in the reference pose that both move alike, as well as can be */
    double *joint_weight;
    size_t ncorners;     /* of the vector graph; 0: vertices follow the skin of the rig alone */
    size_t per_corner;   /* transforms that drive a corner: 1, or 2 bones */
    double *corner;      /* per_corner quaternions each: the vector of the corner is the sum of A_p Q r Q* over its
                            p */
    uint32_t *corner_bone; /* bones: per_corner p for each corner; patches: NULL, p is that of the face */
    size_t nheld;        /* vertices held where their patch takes them, or the skin of the rig */
    uint32_t *held;      /* ascending */
    uint32_t *held_patch; /* patches only */
    double *held_at;     /* patches only: the point in the reference pose that the patch takes there */
    size_t nnames;       /* 0 or n */
    char **names;
} vg_map;

void vg_map_clear(vg_map *m);

/* vg_mesh_digest: a number that tells meshes apart by their vertex count and faces (XXH64, fmt/STREAM.md). */
uint64_t vg_mesh_digest(const vg_mesh *m);

/* One process that took part in making a stream. parents are positions in the same list, each before its own. */
typedef struct vg_provenance {
    char *program, *version;
    size_t nargs;
    char **args;
    size_t nparents;
    uint32_t *parents;
} vg_provenance;

/* A record of the stream that this version does not know and passes on. */
typedef struct vg_record {
    char tag[5];
    uint32_t flags;
    vg_bytes payload;
} vg_record;

typedef struct vg_records {
    size_t n;
    vg_record *at;
} vg_records;

void vg_records_clear(vg_records *r);

/* What the values of a frame are, per element. */
typedef enum vg_kind {
    VG_VERTICES = 1,     /* 3 numbers per vertex: position */
    VG_VECTORS = 2,      /* 3 per corner of the vector graph: from the face's centroid to the vertex */
    VG_DEFORMATIONS = 3, /* 4 per corner of the vector graph: quaternion w x y z, squared length = scale */
    VG_TRANSFORMS = 4    /* 7 per bone or patch: quaternion w x y z as above, then translation */
} vg_kind;

size_t vg_kind_width(vg_kind k);         /* 3, 3, 4, 7 */
const char *vg_kind_name(vg_kind k);     /* "vertices", ... ; "unknown" */

typedef enum vg_precision { VG_F32 = 4, VG_F64 = 8 } vg_precision;

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

/* All that is known of a sequence before its frames. Frames carry vertices of the body's mesh, or values on its
 * vector graph (see vg_graph), or transforms. */
typedef struct vg_head {
    vg_body body;
    vg_correspondence correspondence; /* a stream of vg-register: mesh and reference are the source's, its frame is
                                         fitted to the target */
    vg_map map;           /* a stream of vg-fitmap */
    bool has_selection;   /* only the faces `selected` (ascending) carry vectors; else all do */
    size_t nselected;
    uint32_t *selected;
    bool has_links;       /* links were chosen (perhaps none were needed) */
    size_t nlinks;
    uint32_t *links;      /* nlinks pairs of vertices: virtual 2-vertex faces that join components */
    size_t nanchors;
    uint32_t *anchors;    /* vertices (ascending) whose position each frame of vectors or deformations gives */
    size_t nprovenance;
    vg_provenance *provenance;
    vg_records extra;     /* unknown records, in order */
    vg_kind kind;
    vg_precision precision;
    size_t count;         /* elements of a frame: nv, corners of the graph, or number of transforms */
} vg_head;

void vg_head_clear(vg_head *h);
int vg_head_copy(vg_head *to, const vg_head *from, vg_err *e) VG_MUST_CHECK;

/* vg_head_trace: append the record of this process. Its parents are the records that no other names as a parent: the
 * last of the stream's own, and of every one that vg_head_merge_trace has put before it. argv is argc strings; bytes
 * that are no UTF-8 become '?'. */
int vg_head_trace(vg_head *h, const char *program, int argc, char *const *argv, vg_err *e) VG_MUST_CHECK;

/* vg_head_merge_trace: put the provenance of a second input before that of this process (call before
 * vg_head_trace). */
int vg_head_merge_trace(vg_head *h, const vg_head *other, vg_err *e) VG_MUST_CHECK;

/* One pose. The struct is reused from frame to frame; its arrays grow and stay. */
typedef struct vg_frame {
    char *name; /* UTF-8, never NULL in a frame that was read */
    bool has_time;
    double time; /* seconds */
    double root[3];  /* vectors, deformations: mean of the vertices that are in the vector graph */
    double *anchors; /* vectors, deformations: head.nanchors points */
    size_t npins;    /* vectors: vertices (ascending) that stay where the reference has them, in this frame; set by
                        vg_frame_pin */
    uint32_t *pins;
    size_t nturns;   /* vertices of a skeleton: number of joints when it is known how they have turned, else 0; set by
                        vg_frame_turn */
    double *turns;   /* a unit quaternion w x y z each, beside the skeleton's pose without rotations: positions do not
                        say it all */
    bool has_scalars; /* vertices: a number for each vertex comes with the frame, such as its error; set by
                         vg_frame_scalars */
    char *scalars_name, *scalars_unit; /* UTF-8: "error", never ""; "D", or "" */
    double *scalars;  /* mesh.nv */
    double *values;  /* head.count * vg_kind_width(head.kind) */
    vg_records extra; /* unknown records that came before this frame */
    /* private to the reader and to vg_frame_*: */
    vg_bytes raw;
    size_t name_cap, anchors_cap, pins_cap, turns_cap, values_cap, scalars_name_cap, scalars_unit_cap, scalars_cap;
    double *values_own;
} vg_frame;

void vg_frame_clear(vg_frame *f);
/* vg_frame_shape: make room for the values and anchors of a frame of h; contents undefined, no scalars. */
int vg_frame_shape(vg_frame *f, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vg_frame_pin, _turn, _rename: the frame has these from now on (copied; n or njoints 0: none). */
int vg_frame_pin(vg_frame *f, const uint32_t *vertices, size_t n, vg_err *e) VG_MUST_CHECK;
int vg_frame_turn(vg_frame *f, const double *turns, size_t njoints, vg_err *e) VG_MUST_CHECK;
int vg_frame_rename(vg_frame *f, const char *name, vg_err *e) VG_MUST_CHECK;
/* vg_frame_scalars: numbers (nv of them, copied) come with the frame from now on,
 * until it is shaped or labelled again. */
int vg_frame_scalars(vg_frame *f, const char *name, const char *unit, const double *numbers, size_t nv,
                     vg_err *e) VG_MUST_CHECK;
/* vg_frame_label: take over name, time and unknown records of `from`, but no numbers, pins, turns or scalars; `from`
 * loses its records. */
int vg_frame_label(vg_frame *f, vg_frame *from, vg_err *e) VG_MUST_CHECK;

/* The vector graph of a sequence: the faces that carry vectors, in order (all, or the selected ones), then the links.
 * Layout as in vg_mesh; corner c of the graph is a position in vert.
 * `attached` counts the vertices that are in a face. */
typedef struct vg_graph {
    size_t nv, nf, nlinks; /* nf includes the links, which are the last */
    uint32_t *start, *vert;
    size_t attached, max_corners;
    bool *in_face; /* nv */
} vg_graph;

/* vg_graph_new: the graph of h's mesh, selection and links. h must hold links (vg_link_components) when it has more
 * than one component; this is not checked here. O(corners). */
int vg_graph_new(vg_graph **g, const vg_head *h, vg_err *e) VG_MUST_CHECK;
void vg_graph_free(vg_graph **g);
size_t vg_graph_corners(const vg_graph *g);

/* vg_graph_vectors: w_c = v(c) - C_f (T 3.1). vertices: nv points in; vectors: one per corner out. */
void vg_graph_vectors(const vg_graph *g, const double *vertices, double *vectors);
/* vg_graph_root: the mean of the attached vertices (zeros when there are none). */
void vg_graph_root(const vg_graph *g, const double *vertices, double root[3]);
/* vg_graph_anchors: positions of the n anchors out of nv points. */
void vg_graph_anchors(const double *vertices, const uint32_t *anchors, size_t n, double *positions);

/* Rotations. A deformation is a quaternion w x y z whose squared length is the scale a > 0: r -> Q r Q* (T 3.19). */
void vg_quat_multiply(const double a[4], const double b[4], double ab[4]);
void vg_quat_apply(const double q[4], const double r[3], double d[3]); /* Q r Q*: rotates, and scales by |Q|^2 */
void vg_quat_matrix(const double unit[4], double m[9]);                /* row-major rotation matrix */
/* of a rotation; Shepperd's choice of branch */
void vg_quat_from_matrix(const double m[9], double unit[4]);
/* q != 0. l[0] = ln|q|, l[1..3] = half angle * axis, w >= 0 or not */
void vg_quat_log(const double q[4], double l[4]);
void vg_quat_exp(const double l[4], double q[4]);
/* vg_quat_between: smallest rotation taking r to d (Rodrigues; MATH 4), scale |d|/|r|. r and d must not be 0. */
void vg_quat_between(const double r[3], const double d[3], double q[4]);

/* ---------------------------------------------------------------------------------------------- method -- */

/* vg_threads_with_room: how many threads, `most` at most, may multiply matrices in the address space that is left to
 * the process; 0: not even one. OpenBLAS does not return, ever, when it is refused the memory it works in, so ask
 * this before. */
int vg_threads_with_room(int most);

/* vg_select_faces: fewer faces that still determine the mesh (T 3.2, Algorithm 1), completed so that every vertex
 * that is in a face stays in one and every component stays connected. *faces (ascending, caller frees with free())
 * and *n. */
int vg_select_faces(const vg_mesh *m, uint32_t **faces, size_t *n, vg_err *e) VG_MUST_CHECK;

/* vg_link_components: the fewest virtual line segments that join all components of m, between nearby vertices of
 * `vertices` (nv points): a minimum spanning tree of the components, where a link that would be shorter than the
 * edges beside it is moved on to the next vertex of the face. *pairs (2 per link, caller frees) and *n. VG_EARG when
 * a vertex is not finite. */
int vg_link_components(const vg_mesh *m, const double *vertices, uint32_t **pairs, size_t *n,
                       vg_err *e) VG_MUST_CHECK;

/* vg_head_prepare_vectors: choose h's links from its reference pose unless it has them. Every program that derives
 * vectors from vertices calls this before vg_graph_new. A map whose corners the links are not among is left out. */
int vg_head_prepare_vectors(vg_head *h, vg_err *e) VG_MUST_CHECK;

/* Deformation of vectors, reference pose to deformed pose (MATH 4): Frames (T 3.12 ff.) on faces of 3 or more,
 * Rodrigues on line segments, and on links the mean turn of the faces at their ends followed by Rodrigues. Degenerate
 * corners take the rotation of their face's other corners and scale 1. */
typedef struct vg_deformer vg_deformer;
typedef struct vg_deform_counts {
    uint64_t corners;    /* degenerate corners met, over all poses */
    uint64_t first_face; /* the first face of the graph that has one; UINT64_MAX: none */
} vg_deform_counts;

/* vg_deformer_new: g borrowed until free; reference: nv points, copied in part. threads >= 1. */
int vg_deformer_new(vg_deformer **d, const vg_graph *g, const double *reference, int threads,
                    vg_err *e) VG_MUST_CHECK;
void vg_deformer_free(vg_deformer **d);
/* What is carried over to the target (MATH 5): the corner's turn and stretch (T 4.2); the face's deformation gradient
 * (Sumner and Popovic 2004), by polygons; the mean of both. Line segments and links always go by pose. */
typedef enum vg_method { VG_BY_POSE = 0, VG_BY_GRADIENT = 1, VG_BY_BLEND = 2 } vg_method;
/* vg_deformer_target: apply to these reference vectors (one per corner of the graph, copied) from now on. */
int vg_deformer_target(vg_deformer *d, const double *target_vectors, vg_method method, vg_err *e) VG_MUST_CHECK;
/* vg_deformer_measure: n poses in (kind VG_VERTICES: nv points each, or VG_VECTORS: one vector per corner), n arrays
 * of a quaternion per corner out. With a target: vg_deformer_apply: quaternions in, deformed target vectors out;
 * vg_deformer_transfer: poses in, deformed target vectors out: by pose what measuring and applying gives, but for
 * rounding. One call at a time on one deformer. */
void vg_deformer_measure(vg_deformer *d, size_t n, vg_kind kind, const double *const *poses,
                         double *const *quaternions);
void vg_deformer_transfer(vg_deformer *d, size_t n, vg_kind kind, const double *const *poses, double *const *vectors);
void vg_deformer_apply(vg_deformer *d, size_t n, const double *const *quaternions, double *const *vectors);
vg_deform_counts vg_deformer_counts(const vg_deformer *d);

/* A path through key poses (MATH 7; T 6.1): each vector turns and stretches along the geodesic from one key to the
 * next, neighbours the same way round also beyond half a turn; the root moves straight. Outside of the keys it goes
 * on as beside the first or last. */
typedef struct vg_path vg_path;
typedef struct vg_key {
    const double *values;  /* a frame's: of vertices, vectors or deformations; borrowed as long as the path lives */
    double root[3];
    const double *anchors; /* nanchors points; borrowed */
    double place;          /* grows from key to key: number, or time; says only how fast a smooth path goes by */
} vg_key;
typedef struct vg_path_options {
    vg_kind kind;    /* of the keys' values */
    size_t nanchors;
    bool smooth;     /* velocities do not jump at keys */
    int threads;     /* >= 1 */
} vg_path_options;
typedef struct vg_path_facts {
    size_t segments; /* between keys, looked at so far, again if come back to */
    size_t beyond;   /* of these, where something turns by more than half a turn */
    vg_deform_counts degenerate;
} vg_path_facts;

/* vg_path_new: g and keys are borrowed until free; reference: nv points. VG_EARG with fewer than two keys. */
int vg_path_new(vg_path **p, const vg_graph *g, const double *reference, const vg_key *keys, size_t nkeys,
                const vg_path_options *o, vg_err *e) VG_MUST_CHECK;
void vg_path_free(vg_path **p);
/* vg_path_at: the pose at t: vectors (one per corner), root and anchors (NULL if there are none) out. Key i is at t
 * = i. What is between two keys is prepared when it is first asked for and kept until something else is (three
 * stretches if smooth): ask in order. */
int vg_path_at(vg_path *p, double t, double *vectors, double root[3], double *anchors, vg_err *e) VG_MUST_CHECK;
vg_path_facts vg_path_get_facts(const vg_path *p);

/* Transfer between meshes of different connectivity (MATH 9). A face that one face of as many corners drives goes
 * corner by corner, as by vg_deformer. Each other face of the target takes the deformation gradient of the source
 * faces that drive it, and by pose its rotation (polar) with the stretch that the gradient gives the direction of
 * each vector. Here the normal stretches by the root of the area's ratio, for the target's vectors lie across the
 * source's planes. Faces without a match of their own turn rigidly. Links follow the faces at their ends. */
typedef struct vg_carrier vg_carrier;
/* vg_carrier_new: source: the whole source mesh and its reference pose; c: fits both meshes (checked: VG_EINPUT);
 * target: the graph of the target (all faces, then links) and its reference. All are borrowed until free. */
int vg_carrier_new(vg_carrier **c, const vg_mesh *source, const double *source_reference,
                   const vg_correspondence *pairs, const vg_graph *target, const double *target_reference,
                   vg_method method, int threads, vg_err *e) VG_MUST_CHECK;
void vg_carrier_free(vg_carrier **c);
/* vg_carrier_transfer: n poses of the source (vertices) in, n times the target's wanted vectors out. */
void vg_carrier_transfer(vg_carrier *c, size_t n, const double *const *poses, double *const *vectors);
/* corners: source faces without a direction, over all poses */
vg_deform_counts vg_carrier_counts(const vg_carrier *c);
/* vg_carrier_turned: by how many degrees the matched faces of the target are turned against the source faces that drive
 * them, in the two references: the angle of the mean cosine between normals. A mesh that is inside out is not turned. */
double vg_carrier_turned(const vg_carrier *c);

/* Shape deformation (T 4.1 to 4.6): what takes each source vector to the target's in the reference poses, applied to
 * the vectors of each pose and put at the source face's centroid; corners that share a vertex are averaged. No linear
 * system; fails for large deformations. Gives vertices: the mean of the attached ones is the source's. */
typedef struct vg_shaper vg_shaper;
/* vg_shaper_new: g, the graph of both, is borrowed until free; references: nv points each, not kept. */
int vg_shaper_new(vg_shaper **s, const vg_graph *g, const double *source_reference, const double *target_reference,
                  int threads, vg_err *e) VG_MUST_CHECK;
void vg_shaper_free(vg_shaper **s);
/* vg_shaper_transfer: n poses of the source in, n of the target out (nv points each); what is in no face is as in the
 * target's reference. */
void vg_shaper_transfer(vg_shaper *s, size_t n, const double *const *poses, double *const *vertices);

/* Where the whole body goes when a motion is carried over (MATH 5): each root or anchor is as far from its place in
 * the target's reference as the source's is from its own, by the ratio of the diagonals of the references; or it
 * stays. */
typedef struct vg_mover vg_mover;
/* vg_mover_new: to is borrowed until free. anchors: of both, when they have the same vertices. */
int vg_mover_new(vg_mover **m, const vg_graph *from, const double *source_reference, const vg_graph *to,
                 const double *target_reference, const uint32_t *anchors, size_t nanchors, bool stay,
                 vg_err *e) VG_MUST_CHECK;
void vg_mover_free(vg_mover **m);
/* vg_mover_move: root and anchors of `in` become those of `out`. */
void vg_mover_move(const vg_mover *m, const vg_frame *in, vg_frame *out);
/* vg_mover_place: move a pose of the target as a whole until its root is there; vertices in no face stay. */
void vg_mover_place(const vg_mover *m, const double root[3], double *vertices);

/* Which vertices of the target stay in a pose: those all of whose faces are driven only by faces of the source none
 * of whose vertices is further than 1e-6 D from its place in the reference. */
typedef struct vg_pinner vg_pinner;
/* vg_pinner_new: all is borrowed until free. pairs NULL: one connectivity. always: even when less than a tenth of the
 * source's vertices stay. */
int vg_pinner_new(vg_pinner **p, const vg_graph *from, const double *source_reference, const vg_graph *to,
                  const vg_correspondence *pairs, bool always, vg_err *e) VG_MUST_CHECK;
void vg_pinner_free(vg_pinner **p);
/* vg_pinner_find: for a pose of the source, how many they are and which, ascending; borrowed until the next call. */
size_t vg_pinner_find(vg_pinner *p, const double *pose, const uint32_t **vertices);

/* Reconstruction: min over V of the squared difference between the vectors of V and the given ones (MATH 2; T
 * 3.7-3.9), by one sparse Cholesky factorisation, many poses per solve. */
typedef struct vg_solver vg_solver;
/* What a difference counts: every corner alike (T 3.7), or in the reference surface's own metric, which does not
 * depend on how the surface is cut into faces (on triangles the cotangent weights). Consistent vectors are met
 * exactly by both. */
typedef enum vg_weights { VG_WEIGHTS_UNIFORM = 0, VG_WEIGHTS_AREA = 1 } vg_weights;
typedef struct vg_solver_facts {
    size_t unknowns, factor_entries; /* entries of the factor, explicit zeros included */
    double analyse_seconds, factor_seconds;
} vg_solver_facts;

/* vg_solver_new: g borrowed until free; anchors (n ascending vertices, each attached) are met exactly; without any,
 * the mean of the attached vertices is. reference (nv points, copied in part) places the vertices that are in no
 * face. VG_EINPUT when the graph is not connected, an anchor is in no face, or all of it is too large. */
int vg_solver_new(vg_solver **s, const vg_graph *g, const uint32_t *anchors, size_t nanchors, const double *reference,
                  vg_weights weights, int threads, vg_err *e) VG_MUST_CHECK;
void vg_solver_free(vg_solver **s);
/* vg_solver_load: the vectors of n poses (and their anchors, nanchors points each; NULL when there are none) become
 * first guesses x and right-hand sides, nv x 3 each: what the guesses miss. One call at a time on one solver; the
 * threads share the poses. */
void vg_solver_load(vg_solver *s, size_t n, const double *const *vectors, const double *const *anchors,
                    double *const *x, double *const *rhs);
/* vg_solver_solve: n guesses x, with their right-hand sides, become n poses in place. anchors[i]: nanchors points of
 * pose i, or roots[i]: its root; the other is not looked at. Best when n is a multiple of vg_solver_batch. */
void vg_solver_solve(vg_solver *s, size_t n, const double *const *rhs, double *const *x, const double *const *anchors,
                     const double *const *roots);
size_t vg_solver_batch(const vg_solver *s);
vg_solver_facts vg_solver_get_facts(const vg_solver *s);

/* Planarity (MATH 5; T 4.2.3): poses that minimise `fidelity` times the energy of the reconstruction plus `planarity`
 * times the sum over corners of faces of four and more of (m_f . t_c)^2, t_c the corner's vector, m_f the unit mean
 * of the cross products of successive given vectors of the face (no such term where that is 0). By conjugate
 * gradients from the plain solution. */
typedef struct vg_planar vg_planar;
typedef struct vg_planar_facts {
    size_t faces;          /* of four and more corners */
    size_t most_steps;     /* of one pose so far */
    double worst_residual; /* left at the end, relative to that of the plain solution; NaN if numbers overflowed */
} vg_planar_facts;

/* vg_planar_new: s borrowed until free. VG_EARG unless fidelity > 0 and planarity >= 0. */
int vg_planar_new(vg_planar **p, const vg_solver *s, double fidelity, double planarity, vg_err *e) VG_MUST_CHECK;
void vg_planar_free(vg_planar **p);
size_t vg_planar_faces(const vg_planar *p);
/* vg_planar_load: of one pose's given vectors what is needed later: the m_f, 3 numbers for each of
 * vg_planar_faces. */
void vg_planar_load(const vg_planar *p, const double *vectors, double *normals);
/* vg_planar_solve: n poses x from vg_solver_solve, with their normals, become more nearly planar in place; anchors
 * stay, or the root does, and vertices in no face. Returns the number of the first pose that did not converge; n when
 * all did. */
size_t vg_planar_solve(vg_planar *p, size_t n, const double *const *normals, double *const *x);
vg_planar_facts vg_planar_get_facts(const vg_planar *p);

/* Guidance in time (MATH 5; T 4.10, 4.16): a sequence keeps its second differences in time and meets given poses at
 * keys. Between two keys a < b the pose U_k becomes U_k + ((b - k) e_a + (k - a) e_b) / (b - a), e = given - U;
 * before the first key and after the last that key's own e is added. */
typedef struct vg_guide vg_guide;
int vg_guide_new(vg_guide **g, size_t nv, vg_err *e) VG_MUST_CHECK;
void vg_guide_free(vg_guide **g);
/* vg_guide_key: frame number `frame`, later than the key before, has this pose (nv points), which becomes the given
 * one to the bit. Poses between both keys are to be applied before the next key is named. */
void vg_guide_key(vg_guide *g, uint64_t frame, double *pose, const double *given);
/* vg_guide_apply: the pose of frame number `frame` in place: one between the last two keys, or behind the last, or,
 * when only one key was named, any. Without keys it stays. */
void vg_guide_apply(const vg_guide *g, uint64_t frame, double *pose);

/* Segmentation (T 6.2): K-means over faces whose feature is their rotation in every pose; nothing in it is spatial.
 * Features of more than about a hundred poses are folded into 1,024 numbers by random signs, which keeps distances
 * within about 5 %: memory does not grow with the number of poses. The same seed gives the same patches, whatever the
 * number of threads. */
typedef struct vg_segmenter vg_segmenter;
typedef struct vg_segment_report {
    size_t patches, rounds;
    double angle; /* in degrees: root mean square over faces and poses of the rotation between a face and its patch */
} vg_segment_report;

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
                     vg_segment_report *report, vg_err *e) VG_MUST_CHECK;

/* The map from patch transforms to vertices (MATH 7; T 6.3), with its two remedies. */
typedef struct vg_map_fitter vg_map_fitter;
/* vg_map_fitter_new: h: mesh, reference, links, and patches, which are split into connected pieces: these become the
 * patches of h. hold: share of the vertices that are held, those nearest the patches' centres; at least one a patch.
 * h is borrowed until free. */
int vg_map_fitter_new(vg_map_fitter **f, vg_head *h, double hold, int threads, vg_err *e) VG_MUST_CHECK;
void vg_map_fitter_free(vg_map_fitter **f);
int vg_map_fitter_add(vg_map_fitter *f, size_t n, const double *const *poses, vg_err *e) VG_MUST_CHECK;
/* vg_map_fitter_finish: fill h->map, which is empty on failure. VG_EINPUT without poses. */
int vg_map_fitter_finish(vg_map_fitter *f, vg_err *e) VG_MUST_CHECK;

/* vg_map_retarget: the map of h for another body of the same faces (T 6.5), or one on the way to it (T 6.6): its
 * vectors are those of h's reference, turned and stretched towards the target's by `morph` (1: all the way). h's
 * reference becomes that body's. target: nv points. Patches are still measured on the body that the map was fitted
 * on; the joints of a rig go with the vertices around them, and its transforms are those of the other body. VG_EINPUT
 * when there is no map, or a body has no extent. On failure h may be neither body's: it can only be cleared. */
int vg_map_retarget(vg_head *h, const double *target, double morph, int threads, vg_err *e) VG_MUST_CHECK;

/* A map at work. Transforms are 7 numbers each, as in VG_TRANSFORMS. */
typedef struct vg_player vg_player;
/* vg_player_new: h has a map and its patches, or the weights of its rig; borrowed until free. single: the product is
 * formed in binary32. VG_EINPUT when h has not. */
int vg_player_new(vg_player **p, const vg_head *h, bool single, int threads, vg_err *e) VG_MUST_CHECK;
void vg_player_free(vg_player **p);
/* vg_player_measure: n poses (nv points each) to the best similarity of each patch. */
void vg_player_measure(vg_player *p, size_t n, const double *const *poses, double *const *transforms);
/* vg_player_place: keep rotations, scales and root, and put the patches where their joints want them, in place. A map
 * of another body than its home does so whenever it is posed: there nothing is done. */
void vg_player_place(vg_player *p, double *transforms);
/* vg_player_between: from a (t = 0) to b (t = 1) and beyond: rotations and scales go along geodesics, the root in a
 * line, joints hold. transforms: neither a nor b. */
void vg_player_between(vg_player *p, const double *a, const double *b, double t, double *transforms);
/* vg_player_pose: n times transforms to vertices, by one product. */
void vg_player_pose(vg_player *p, size_t n, const double *const *transforms, double *const *vertices);

/* Enveloping (MATH 6; T 5): a skeleton drives the mesh, learned from example poses.
 *
 * vg_bender: the other way round: the motions of the bones in a pose of vertices, joints staying together, so that
 * linear blend skinning comes as near to the vertices as it can (damped Gauss-Newton over all bones at once). Bones
 * that no vertex tells about go with their parents. */
typedef struct vg_bender vg_bender;
/* vg_bender_new: r has weights (else VG_EINPUT); it and reference (nv points) are not kept. */
int vg_bender_new(vg_bender **b, const vg_rig *r, size_t nv, const double *reference, int threads,
                  vg_err *e) VG_MUST_CHECK;
void vg_bender_free(vg_bender **b);
/* vg_bender_fit: n poses (nv points each) to n times nbones transforms of 7 numbers. */
void vg_bender_fit(vg_bender *b, size_t n, const double *const *poses, double *const *transforms);

/* vg_rig_learn: give h's rig weights when the motions of its bones are not known: weights and motions are fitted in
 * turn to n poses. miss: the mean distance that linear blend skinning leaves, in mesh units. */
int vg_rig_learn(vg_head *h, size_t n, const double *const *poses, int threads, double *miss,
                 vg_err *e) VG_MUST_CHECK;
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
} vg_rig_options;

/* vg_rig_fitter_new: h: mesh, reference and a rig (its weights, if any, are replaced); borrowed until free. */
int vg_rig_fitter_new(vg_rig_fitter **f, vg_head *h, const vg_rig_options *o, vg_err *e) VG_MUST_CHECK;
void vg_rig_fitter_free(vg_rig_fitter **f);
/* vg_rig_fitter_add: n poses (nv points) and the transforms of the bones in them.
 * Poses that are the reference are passed over. */
void vg_rig_fitter_add(vg_rig_fitter *f, size_t n, const double *const *poses, const double *const *transforms);
/* vg_rig_fitter_finish: fill h->map and the weights of h->rig. May be called again for another method.
 * VG_EINPUT without poses. */
int vg_rig_fitter_finish(vg_rig_fitter *f, vg_rig_method method, vg_err *e) VG_MUST_CHECK;

/* Measures of two sequences of one connectivity (MATH 8), accumulated pose by pose in bounded memory. */
typedef struct vg_measures vg_measures;
enum { VG_ERROR_BINS = 40 };
/* in D: bin i holds what is at least edge i and less than the next, the last one all from 5 on */
extern const double vg_error_edges[VG_ERROR_BINS];
typedef struct vg_measure_report {
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
} vg_measure_report;

/* vg_measures_new: m borrowed until free. centred: compare poses after moving each one's centroid to 0. threads >= 1:
 * their number changes no digit. p95 is exact to 0.4 % (a histogram of 1/256 octaves). */
int vg_measures_new(vg_measures **x, const vg_mesh *m, const double *reference, bool centred, int threads,
                    vg_err *e) VG_MUST_CHECK;
void vg_measures_free(vg_measures **x);
typedef struct vg_pose_error {
    double mean, max;
} vg_pose_error;
/* vg_measures_add: n poses of the truth and of the result (nv points each); how these are added one after another or
 * together changes no digit. errors: for each nv distances out. found (may be NULL): n. When it fails none counts. */
int vg_measures_add(vg_measures *x, size_t n, const double *const *truth, const double *const *result,
                    double *const *errors, vg_pose_error *found, vg_err *e) VG_MUST_CHECK;
void vg_measures_get(const vg_measures *x, vg_measure_report *r);
/* vg_error_p95: the least of n numbers that 95 of 100 do not exceed; 0 for none. Changes their order. O(n). */
double vg_error_p95(double *numbers, size_t n);

/* A fingerprint of what a sequence says, whoever made it: XXH64 over kind, faces, selection, links, anchors,
 * reference positions, and of every frame name, time, root, anchors, turns of joints and values, all numbers as
 * binary64 (-0 as 0). Provenance, attributes, scalars, pins, unknown records and the precision they are written in
 * do not count, nor does what is no sequence: skeletons, pairs of faces, patches, rigs and maps. */
typedef struct vg_digest vg_digest;
int vg_digest_new(vg_digest **d, const vg_head *h, vg_err *e) VG_MUST_CHECK; /* h is borrowed until free */
void vg_digest_free(vg_digest **d);
void vg_digest_add(vg_digest *d, const vg_frame *f);
uint64_t vg_digest_get(const vg_digest *d); /* of all that was added so far */

/* -------------------------------------------------------------------------------------------- registration -- */

/* A pair of vertices that belong together. */
typedef struct vg_marker {
    uint32_t source, target;
    char *name;  /* NULL: it has none */
    size_t line; /* of the file, from 1; 0: of no file */
} vg_marker;

typedef struct vg_markers {
    size_t n;
    vg_marker *at;
} vg_markers;

void vg_markers_clear(vg_markers *m);
/* vg_markers_read: text with a pair per line, "SOURCE TARGET" or "NAME SOURCE TARGET"; '#' starts a comment. `base`
 * is the number of the first vertex, 0 or 1. name: what messages call the file. */
int vg_markers_read(vg_markers *m, const void *data, size_t n, int base, const char *name, vg_err *e) VG_MUST_CHECK;

/* A point of one mesh (weighted mean of three of its vertices, which may be one thrice) for a vertex of another. */
typedef struct vg_seed {
    uint32_t vertex, on[3];
    double weight[3];
} vg_seed;

/* vg_seeds_read: a dense correspondence as text: "VERTEX A B C WA WB WC" per line, '-' for a vertex that has none. *n
 * seeds, free(). */
int vg_seeds_read(vg_seed **seeds, size_t *n, const void *data, size_t bytes, int base, const char *name,
                  vg_err *e) VG_MUST_CHECK;

/* Joints as groups of mesh vertices (T 5.1): a joint is the mean of its vertices, in whatever pose they are; the roll
 * of its bone is told by the first of them. */
typedef struct vg_joint_group {
    char *name;
    uint32_t parent;    /* less than its own number; UINT32_MAX: a root */
    size_t nvertices;   /* > 0 */
    uint32_t *vertices; /* in the order of the file; none twice */
    size_t line;        /* of the file, from 1 */
} vg_joint_group;

typedef struct vg_joint_groups {
    size_t n;
    vg_joint_group *at;
} vg_joint_groups;

void vg_joint_groups_clear(vg_joint_groups *g);
/* vg_joint_groups_read: text with a joint per line, "JOINT PARENT vertices VERTEX VERTEX ...", '-' for no parent, '#'
 * starts a comment. Parents may stand behind their children: they are put before them. Whether the vertices exist is
 * left to who has the mesh. `base` is the number of the first vertex, 0 or 1. name: what messages call the file. */
int vg_joint_groups_read(vg_joint_groups *g, const void *data, size_t n, int base, const char *name,
                         vg_err *e) VG_MUST_CHECK;

/* vg_joint_groups_skeleton: the joints in a pose of nv vertices as a skeleton.
 * VG_EINPUT when a vertex is not there. */
int vg_joint_groups_skeleton(const vg_joint_groups *g, size_t nv, const double *reference, vg_skeleton *s,
                             vg_err *e) VG_MUST_CHECK;
/* vg_joint_groups_pose: positions of the joints in a pose, and their turns beside the reference pose: with one joint
 * below, that of the frame of bone and roll (T 5.1); else what takes joints below and the group's vertices nearest to
 * where they are. */
void vg_joint_groups_pose(const vg_joint_groups *g, const double *reference, const double *pose, double *positions,
                          double *turns);

/* What is known about which point belongs to which. */
typedef struct vg_register_input {
    const vg_mesh *source, *target;
    const double *source_points, *target_points;
    const vg_markers *markers;  /* may be NULL */
    const vg_seed *seeds;       /* may be NULL */
    size_t nseeds;
    bool seeds_of_source;       /* seeds are vertices of the source on the target; else vertices of the target on the
                                   source */
    const vg_attributes *source_uv, *target_uv; /* both, or NULL: points of the same texture coordinates belong
                                                   together */
    bool aligned;               /* the two lie on one another as they are */
    bool keep_all;              /* markers that contradict the others are not left out */
    int threads;
} vg_register_input;

/* One round of the fit. */
typedef struct vg_register_step {
    size_t round, rounds;
    size_t near;      /* source vertices that the target pulls */
    double stiffness; /* weight of smoothness, that of the target being 1 */
    double mean, largest; /* distance of these vertices from the target, in D */
} vg_register_step;

typedef struct vg_register_result {
    vg_correspondence pairs;
    double *fitted;          /* source nv points: the source on the target, in the target's place and size */
    double scale, rotation[9], shift[3]; /* the similarity that brings the source onto the target as a whole */
    bool flipped;            /* the faces of one mesh turn the other way round */
    double *residual;        /* per marker: how far it is from where its neighbours expect it, in D of the target */
    bool *left_out;          /* per marker */
    double typical_residual; /* the median */
    size_t uv_pairs;         /* points paired by texture coordinates */
} vg_register_result;

void vg_register_result_clear(vg_register_result *r);

/* vg_register: pair the faces of two meshes (MATH 9; after Sumner and Popovic 2004, section 5). step (may be NULL) is
 * told of each round of the fit. VG_EINPUT when the pairs given do not say how the meshes lie (three that are not in
 * line are needed). */
int vg_register(vg_register_result *r, const vg_register_input *in,
                void (*step)(void *context, const vg_register_step *step), void *context, vg_err *e) VG_MUST_CHECK;

/* -------------------------------------------------------------------------------------------------- io -- */

/* The stream (fmt/STREAM.md). A reader takes it from a descriptor or from memory and checks every byte. */
typedef struct vg_reader vg_reader;
/* vg_reader_open: read up to the FORM record. fd is borrowed and read to the END mark by vg_reader_next. `name` is
 * what messages call it. */
int vg_reader_open(vg_reader **r, int fd, const char *name, vg_err *e) VG_MUST_CHECK;
int vg_reader_open_memory(vg_reader **r, const void *data, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;
/* vg_reader_head: what was read; the caller may change it (it is what a filter hands to its writer). */
vg_head *vg_reader_head(vg_reader *r);
/* What a stream says that its writer gave up on: the record FAIL. */
typedef struct vg_failure {
    char *program; /* NULL: there is no such record */
    uint32_t status; /* exit status */
    char *message; /* one line */
} vg_failure;

/* vg_reader_next: 1 and the next frame; 0 at the END mark, nothing left behind it; negative on damage. */
int vg_reader_next(vg_reader *r, vg_frame *f, vg_err *e) VG_MUST_CHECK;
vg_records *vg_reader_tail(vg_reader *r); /* unknown records after the last frame, valid when next has given 0 */
/* vg_reader_failure: why vg_reader_next gave VG_ETRUNC, if the stream says it; else NULL. Borrowed until close. */
const vg_failure *vg_reader_failure(const vg_reader *r);
void vg_reader_close(vg_reader **r);

typedef struct vg_writer vg_writer;
/* vg_writer_open: write everything up to FORM. fd is borrowed. h is borrowed until close and must not change. */
int vg_writer_open(vg_writer **w, int fd, const char *name, const vg_head *h, vg_err *e) VG_MUST_CHECK;
int vg_writer_put(vg_writer *w, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
/* vg_writer_end: unknown records left over (may be NULL), END, flush. Without it the stream is not whole. */
int vg_writer_end(vg_writer *w, const vg_records *tail, vg_err *e) VG_MUST_CHECK;
/* vg_writer_abandon: say in a FAIL record who failed and why; best effort; no END will follow. */
void vg_writer_abandon(vg_writer *w, const char *program, int exit_status, const char *message);
void vg_writer_close(vg_writer **w);

/* The door in. Operands are streams, mesh files, files that hold a whole sequence (point caches, arrays, ...),
 * archives of mesh files, directories, or "-" (standard input: any of them); what each one is, is told by its
 * content, for OBJ by its name or content. Directories and archives give their mesh files in natural order ("pose2"
 * before "pose10"); other files in them are passed over. One operand that is a stream gives that stream as it is.
 * More operands are joined into one sequence of vertices of one mesh. The first pose is the reference unless a stream
 * or a sequence brings its own. */
typedef struct vg_source vg_source;
int vg_source_open(vg_source **s, const char *const *operands, size_t n, vg_err *e) VG_MUST_CHECK;
typedef struct vg_source_options {
    const char *mesh;    /* an operand whose faces and reference pose are those of operands that hold none of their
                            own (point caches, arrays); NULL: those of the operand before, or of the file of the same
                            name that ends in .obj or .ply */
    uint64_t most_bytes; /* what an archive, a compressed file, or a file from a pipe that is no stream may hold,
                            unpacked; 0: 1 GiB in one file, 64 GiB in all */
    int threads;         /* parse as many mesh files at a time; one more waits, if their bytes are less than 256 MiB.
                            What comes through a pipe is not read before it is asked for. 0 or 1: one after another */
} vg_source_options;
/* vg_source_open_with: o may be NULL. */
int vg_source_open_with(vg_source **s, const char *const *operands, size_t n, const vg_source_options *o,
                        vg_err *e) VG_MUST_CHECK;
/* vg_source_warning: what was left out of the mesh, one line; NULL: nothing. Borrowed until close. */
const char *vg_source_warning(const vg_source *s);
vg_head *vg_source_head(vg_source *s);
int vg_source_next(vg_source *s, vg_frame *f, vg_err *e) VG_MUST_CHECK;
vg_records *vg_source_tail(vg_source *s);
const vg_failure *vg_source_failure(const vg_source *s); /* as vg_reader_failure */
void vg_source_close(vg_source **s);

/* vg_load_mesh: the mesh behind one operand, as a head whose reference is the operand's reference pose (for a mesh
 * file its only pose, for BVH the one without rotations; for a stream its reference; for an archive or directory the
 * first pose). The rest is not read. */
int vg_load_mesh(vg_head *h, const char *operand, vg_err *e) VG_MUST_CHECK;

/* Frames that wait, first in, first out: in memory up to a limit,
 * then in a file without a name in $TMPDIR (or /tmp). */
typedef struct vg_spool vg_spool;
typedef struct vg_spool_facts {
    uint64_t most_frames; /* that have waited at once */
    uint64_t file_bytes;  /* the largest size of the file; 0: there was none */
} vg_spool_facts;

/* vg_spool_new: h says what a frame holds; borrowed until free. limit: bytes of frames in memory. */
int vg_spool_new(vg_spool **s, const vg_head *h, size_t limit, vg_err *e) VG_MUST_CHECK;
void vg_spool_free(vg_spool **s);
/* vg_spool_put: keep a copy of f, all of it. vg_spool_next: 1 and the frame that has waited longest;
 * 0 when none waits. */
int vg_spool_put(vg_spool *s, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
int vg_spool_next(vg_spool *s, vg_frame *f, vg_err *e) VG_MUST_CHECK;
vg_spool_facts vg_spool_get_facts(const vg_spool *s);

/* The door out: one mesh file, a '%04d' pattern, a directory ("out/"), an archive, or one file that holds the whole
 * sequence, told by the name and checked at once; "NAME:ply" chooses what is inside an archive or directory, `format`
 * (may be NULL) overrides. Everything is written under temporary names and takes its final name in vg_sink_end. */
typedef struct vg_sink vg_sink;
typedef struct vg_sink_options {
    const char *format;  /* "obj", "pc2", ...; NULL: told by the name */
    bool full_precision; /* numbers read back to the same binary64, not binary32 */
    long first_number;   /* what %d starts at; 0 */
    const char *mesh;    /* where the mesh of a file without faces goes; NULL: beside it, NAME.obj, which must not be
                            another mesh */
    bool no_mesh;        /* nowhere */
    bool drop_loose;     /* leave out the vertices that are in no face */
    size_t most_targets; /* GLB, glTF: morph targets; more frames are mixed from so many. 0: 100 */
    int threads;         /* of mesh files so many are made at a time, and one more waits: no more than 256 MiB, but two
                            in any case, and what went wrong with one is told by a later call. 0 or 1: each at once */
} vg_sink_options;
/* vg_sink_check: is this a name and format that can be written? To be called before any work. */
int vg_sink_check(const char *output, const vg_sink_options *o, vg_err *e) VG_MUST_CHECK;
int vg_sink_open(vg_sink **s, const char *output, const vg_head *h, const vg_sink_options *o,
                 vg_err *e) VG_MUST_CHECK;
/* a frame of vertices; arrays take any kind */
int vg_sink_put(vg_sink *s, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
int vg_sink_end(vg_sink *s, vg_err *e) VG_MUST_CHECK;
/* vg_sink_discard: remove what was written, unless vg_sink_end has given it its names. For the handler of a signal
 * that ends the program: it calls nothing but unlink and rmdir, and leaves the sink as it is. */
void vg_sink_discard(const vg_sink *s);
/* vg_sink_warning: line number i of what the output does not keep, after vg_sink_end; NULL: no more.
 * Borrowed until close. */
const char *vg_sink_warning(const vg_sink *s, size_t i);
void vg_sink_close(vg_sink **s); /* without _end: nothing is left behind */

/* A mesh file in memory, read or written as a whole. */
typedef struct vg_model {
    vg_mesh mesh;
    double *vertices;
    vg_attributes attributes;
    size_t degenerate; /* triangles left out on reading: two corners were at one place (STL, whose corners have no
                          numbers) */
} vg_model;

void vg_model_clear(vg_model *m);
/* vg_model_read: format NULL: told by content, then by the name. name is what messages call it. */
int vg_model_read(vg_model *m, const void *data, size_t n, const char *format, const char *name,
                  vg_err *e) VG_MUST_CHECK;
/* vg_model_write: append to out. attributes may be NULL. */
int vg_model_write(vg_bytes *out, const char *format, const vg_mesh *mesh, const double *vertices,
                   const vg_attributes *attributes, bool full_precision, vg_err *e) VG_MUST_CHECK;

/* ------------------------------------------------------------------------------------------------ view -- */

/* What the colours of a picture say. A sequence for which they say nothing has those of its patches,
 * or is of clay. */
typedef enum vg_tint {
    VG_TINT_SCALARS = 0, /* the scalars that frames bring; nothing, when the first of a sequence brings none */
    VG_TINT_ERRORS,      /* the distance of a vertex from its place in a truth, in D */
    VG_TINT_SCALES,      /* how much longer the vectors of a vertex are than in the reference pose: their geometric
                            mean */
    VG_TINT_PLAIN        /* nothing, not even patches */
} vg_tint;

/* A contact sheet: evenly spaced frames of a sequence side by side, drawn without display or GPU, as PNG; of several
 * sequences the same frames below one another. */
typedef struct vg_sheet vg_sheet;
typedef struct vg_sheet_options {
    size_t frames;        /* how many are shown, at most: >= 1 */
    size_t columns;       /* 0: as many as make the sheet about 16 : 9, or of several sequences up to 8 */
    size_t width, height; /* of the picture of one frame, in pixels: 16 .. 4096 */
    double azimuth, elevation; /* of the viewer, in degrees: 0, 0 is before the front, 90, 0 at +x, 0, 90 above */
    double zoom;          /* 1 or 0: all that is shown fits */
    bool z_up;            /* z is up and the front at -y; else y is up and the front at +z */
    bool follow;          /* the figure's centroid stays in the middle; else the camera stays where it is */
    bool edges, ground;   /* draw edges of polygons; a grid where the reference stands, with the figure's shadow */
    bool silhouettes;     /* draw the contours of surfaces as lines */
    vg_tint tint;
    bool centred;         /* of errors the shift of the centroid is no part */
    double scale;         /* the end of the colours: in D, in the unit of the scalars, or a factor > 1; 0: the 99th
                             percentile of what is shown, rounded up, or the factor 2 */
    int threads;
} vg_sheet_options;
enum { VG_SHEET_SEQUENCES = 8 };

int vg_sheet_new(vg_sheet **s, const vg_sheet_options *o, vg_err *e) VG_MUST_CHECK;
void vg_sheet_free(vg_sheet **s);
/* vg_sheet_sequence: the next sequence, of vertices; all come before the first frame. h is borrowed until free. truth
 * (may be NULL): what its frames are compared with; its reference, and not h's, gives D,
 * place and the height of the ground. */
int vg_sheet_sequence(vg_sheet *s, const char *label, const vg_head *h, const vg_head *truth,
                      vg_err *e) VG_MUST_CHECK;
/* vg_sheet_add: the next frame of sequence number i (copied). truth (nv points): what it is compared with; NULL
 * unless the sequence is. Keeps at most 4 * frames + 2 poses of a sequence in binary32, whatever the length, at a
 * stride that is 1 as long as they fit and at most half the spacing of what is shown: the spacing is even to within
 * half a stride at each end. */
int vg_sheet_add(vg_sheet *s, size_t i, const vg_frame *f, const double *truth, vg_err *e) VG_MUST_CHECK;
/* vg_sheet_write: draw what was added and write it to fd (borrowed); `name` is what messages call it. Once. VG_EINPUT
 * when nothing was added, VG_EARG when the sheet would be larger than a PNG can be. A sequence that is shorter stays
 * at its last frame. */
int vg_sheet_write(vg_sheet *s, int fd, const char *name, vg_err *e) VG_MUST_CHECK;

/* A page: one HTML file that plays sequences side by side in a browser, with all that it needs inside. Written as
 * frames come; memory holds 32 frames of each sequence, or as many as fit in 64 MiB, and the names of all. */
typedef struct vg_page vg_page;
typedef struct vg_page_options {
    const char *title;           /* UTF-8; borrowed until free, as are the labels */
    double azimuth, elevation;   /* of the viewer at first, as for a sheet; and so are: */
    double zoom;
    bool z_up, follow, edges, ground;
    vg_tint tint;  /* VG_TINT_ERRORS: the second sequence is the truth */
    bool centred;
    double scale;  /* the end of the colours, as for a sheet, by all frames */
} vg_page_options;
enum { VG_PAGE_SEQUENCES = 8 };
typedef struct vg_page_facts {
    size_t frames;      /* of the longest sequence */
    uint64_t bytes;
    double loss;        /* the largest distance of a vertex from where the page has it, in D of its sequence */
    bool tinted;        /* the colours say something: */
    double scale;       /* where they end, in D, the unit of the scalars, or as a factor; and in that: */
    double mean, least, max;
} vg_page_facts;

/* vg_page_new: write the beginning to fd (borrowed); `name` is what messages call it. */
int vg_page_new(vg_page **p, int fd, const char *name, const vg_page_options *o, vg_err *e) VG_MUST_CHECK;
void vg_page_free(vg_page **p);
/* vg_page_sequence: the next sequence, of vertices; all come before the first frame. h is borrowed until free. */
int vg_page_sequence(vg_page *p, const char *label, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vg_page_add: the next frame of sequence number i. truth (nv points): what it is compared with, the second
 * sequence's frame; NULL: it is not. What has a truth, or scalars, in its first frame must have it in all. */
int vg_page_add(vg_page *p, size_t i, const vg_frame *f, const double *truth, vg_err *e) VG_MUST_CHECK;
/* vg_page_end: the rest. Without it the page says that it is not whole. VG_EINPUT when a sequence has no frames. */
int vg_page_end(vg_page *p, vg_page_facts *facts, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
