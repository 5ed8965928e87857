/* gltf_scene.h: a glTF scene as read; shared by gltf_scene.c, gltf_weld.c and gltf_play.c.
 *
 * Nothing is unpacked: a frame is computed from the bytes of the file when it is requested.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_SCENE_H
#define VG_GLTF_SCENE_H

#include "io/gltf.h"

enum { VGI_GLTF_SETS = 8, VGI_GLTF_NONE = -1 };

/* Many nodes may show one mesh, and many channels may use the times of one accessor, so that a small file could
 * require any amount of memory. Limit: */
static const size_t vgi_gltf_most = (size_t)1 << 27; /* vertices, corners, keys */
static const size_t vgi_gltf_most_targets = (size_t)1 << 21, vgi_gltf_most_moments = (size_t)1 << 24;
static const size_t vgi_gltf_most_instances = (size_t)1 << 17;

typedef enum vgi_gltf_path {
    VGI_GLTF_TRANSLATION,
    VGI_GLTF_ROTATION,
    VGI_GLTF_SCALE,
    VGI_GLTF_WEIGHTS
} vgi_gltf_path;

typedef struct vgi_gltf_placed { /* rotation: x y z w */
    double translation[3], rotation[4], scale[3];
} vgi_gltf_placed;

typedef struct vgi_gltf_node {
    const vgi_json *json;
    size_t parent;         /* SIZE_MAX: none */
    bool shown, matters;   /* matters: it moves a vertex */
    bool mirrors;          /* in the pose of the file, its matrix including those above reverses orientation */
    bool fixed;            /* given by a matrix */
    double matrix[12];     /* three rows of four */
    vgi_gltf_placed rest, now;
    double world[12];
    size_t nweights;       /* morph targets of its mesh */
    double *weights, *rest_weights;
    size_t *shape_of;      /* per morph target: the shape, across meshes, to which it belongs */
} vgi_gltf_node;

typedef struct vgi_gltf_skin {
    size_t n;
    size_t *joints;
    bool bound, used;     /* used: by a node that is shown */
    vgi_accessor inverse; /* bind matrices, if bound */
    double *matrices;     /* n x 12 */
} vgi_gltf_skin;

/* The vertices of a primitive as a node shows it, or of several primitives that share them. */
typedef struct vgi_gltf_part {
    size_t node, count, first; /* first: number of its first vertex among all, before welding */
    int64_t skin;              /* VGI_GLTF_NONE */
    size_t instance;           /* instance of the node's mesh, from 1; 0: no instances */
    double place[12];          /* of the instance, in the node */
    const vgi_json *attributes, *targets;
    vgi_accessor position, uv;
    bool textured;             /* it has uv, */
    size_t first_uv;           /* index of the first one among all */
    size_t ntargets, nsets;
    vgi_accessor *moved, joints[VGI_GLTF_SETS], shares[VGI_GLTF_SETS];
    uint32_t *kept;            /* those that become vertices of the mesh, ascending */
    size_t nkept;
} vgi_gltf_part;

typedef struct vgi_gltf_channel {
    size_t node, width;
    vgi_gltf_path path;
    bool cubic, step;
    vgi_accessor in, out;
} vgi_gltf_channel;

typedef struct vgi_gltf_clip {
    size_t first, nchannels, frames; /* frames: its first moment */
    size_t animation;      /* its number in the file */
    const char *name;      /* or NULL */
    const vgi_json *names; /* of its frames; or NULL */
} vgi_gltf_clip;

typedef struct vgi_gltf_moment {
    size_t clip;
    double time;
} vgi_gltf_moment;

struct vgi_gltf_piece;
typedef struct vgi_gltf_scene {
    vgi_gltf g;
    size_t nnodes, nskins, nparts, parts_cap, nchannels, channels_cap, nclips, clips_cap, nmoments, moments_cap;
    vgi_gltf_node *nodes;
    size_t *order; /* nodes, parents first */
    vgi_gltf_skin *skins;
    vgi_gltf_part *parts;
    size_t npieces, pieces_cap;
    struct vgi_gltf_piece *pieces;
    size_t all;    /* vertices of all parts, before welding */
    size_t targets, keys; /* morph targets of all parts; times of all channels */
    vgi_gltf_channel *channels;
    vgi_gltf_clip *clips;
    vgi_gltf_moment *moments;
    size_t instances;
    size_t most_targets, frames, next;
    vgi_name_set shapes; /* the morph targets of all meshes, by name */
    bool own;      /* our own file: vertices and faces are not welded */
    size_t nuv;     /* texture coordinates of all parts */
    vg_attributes attributes;
    size_t labels_cap;
    uint32_t *number; /* all: the vertex of the mesh for each */
    size_t dropped; /* triangles without three vertices */
    bool strips;    /* some faces are strips or fans */
    char *wanted;  /* the requested animation; NULL: all */
    double rate;   /* samples per second; 0: at the times of the keys */
    const vg_body *like; /* its welding is used where it fits, while the file is opened; or NULL */
    bool unwelded; /* do not weld vertices */
    bool as_shapes; /* morph targets instead of animations */
    vg_note note;
} vgi_gltf_scene;

/* A primitive of a mesh as a node shows it. */
typedef struct vgi_gltf_piece {
    const vgi_json *json;
    size_t part;
} vgi_gltf_piece;

/* The faces of all parts, with vertices before welding. */
typedef struct vgi_gltf_faces {
    vg_mesh mesh;
    size_t start_cap, vert_cap;
    vgi_accessor index;
    bool indexed, turned; /* turned: with reversed orientation */
    const vgi_gltf_part *part;
} vgi_gltf_faces;

/* ---- gltf_scene.c ---- */
/* vgi_gltf_scene_read: nodes, skins and meshes of an open file. The caller clears both in any case. */
int vgi_gltf_scene_read(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_scene_clear(vgi_gltf_scene *x);
void vgi_gltf_local_matrix(const vgi_gltf_placed *p, double m[12]);
void vgi_gltf_from_columns(const double c[16], double m[12]); /* the upper rows of a matrix of 16, columns first */

/* ---- gltf_play.c ---- */
/* vgi_gltf_rest: reset nodes and joints to the file's values, without morph targets. */
void vgi_gltf_rest(vgi_gltf_scene *x);
/* vgi_gltf_pose_at, vgi_gltf_pose_shape: positions of all kept vertices: at a moment (NULL: at rest, with the morph weights of
 * the file), or with one shape alone (0: none, else its number + 1). */
int vgi_gltf_pose_at(vgi_gltf_scene *x, const vgi_gltf_moment *m, double *to, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_pose_shape(vgi_gltf_scene *x, size_t shape, double *to, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_move_point(const double m[12], const double p[3], double to[3]); /* to = m p; `to` must not be p */
/* vgi_gltf_vertex_matrix: the matrix from vertex v of a part to the world, for the current nodes and joints. */
void vgi_gltf_vertex_matrix(const vgi_gltf_scene *x, const vgi_gltf_part *p, size_t v, double m[12]);

/* ---- gltf_shapes.c: the morph targets of all meshes ---- */
/* vgi_gltf_list_shapes: match the morph targets of the meshes. */
int vgi_gltf_list_shapes(vgi_gltf_scene *x, vg_err *e) VG_MUST_CHECK;
const char *vgi_gltf_shape_name(const vgi_gltf_scene *x, size_t shape); /* empty if it has none */

/* ---- gltf_clips.c: animations ---- */
/* vgi_gltf_read_animations: channels, clips and moments, for the scene's `wanted` and `rate`. */
int vgi_gltf_read_animations(vgi_gltf_scene *x, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_animate: set nodes and weights to this moment. */
int vgi_gltf_animate(vgi_gltf_scene *x, const vgi_gltf_moment *m, vg_err *e) VG_MUST_CHECK;

/* ---- gltf_asset.c ---- */
/* vgi_gltf_take_asset: the contents of the file besides shape and motion; nothing if there are none. */
int vgi_gltf_take_asset(vgi_gltf_scene *x, vgi_input *in, const vg_mesh *mesh, vg_asset *to, vg_err *e) VG_MUST_CHECK;

/* ---- gltf_weld.c ---- */
/* vgi_gltf_mend: restore the mesh as it was before export: polygons of our own files, and vertices that were split.
 * Sets `kept` of the parts, and m->nv. */
int vgi_gltf_mend(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e) VG_MUST_CHECK;

#endif
