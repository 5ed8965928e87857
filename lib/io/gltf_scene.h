/* gltf_scene.h: what gltf_scene.c, gltf_weld.c and gltf_play.c share: a scene of glTF as it is read.
 *
 * Nothing is unpacked: a frame is computed from the bytes of the file when it is asked for.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_SCENE_H
#define VG_GLTF_SCENE_H

#include "io/gltf.h"

enum { VGI_GLTF_SETS = 8, VGI_GLTF_NONE = -1 };

/* Many nodes may show one mesh and many channels have the times of one accessor, so that a small file could ask for
 * more than any memory. */
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
    bool mirrors;          /* its matrix, with those above, turns left into right: in the pose of the file */
    bool fixed;            /* by a matrix */
    double matrix[12];     /* three rows of four */
    vgi_gltf_placed rest, now;
    double world[12];
    size_t nweights;       /* morph targets of its mesh */
    double *weights, *rest_weights;
    size_t *shape_of;      /* of each morph target: the shape, of all meshes, that it is part of */
} vgi_gltf_node;

typedef struct vgi_gltf_skin {
    size_t n;
    size_t *joints;
    bool bound, used;     /* used: a node that is shown has it */
    vgi_accessor inverse; /* bind matrices, if bound */
    double *matrices;     /* n x 12 */
} vgi_gltf_skin;

/* The vertices of a primitive as a node shows it; or of several that share them. */
typedef struct vgi_gltf_part {
    size_t node, count, first; /* first: number of its first vertex among all, before welding */
    int64_t skin;              /* VGI_GLTF_NONE */
    size_t instance;           /* of the node's mesh, from 1; 0: there are none */
    double place[12];          /* of the instance, in the node */
    const vgi_json *attributes, *targets;
    vgi_accessor position, uv;
    bool textured;             /* it has uv, */
    size_t first_uv;           /* of which this is the first one among all */
    size_t ntargets, nsets;
    vgi_accessor *moved, joints[VGI_GLTF_SETS], shares[VGI_GLTF_SETS];
    uint32_t *kept;            /* those that are vertices of the mesh, ascending */
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
    const char *name;      /* NULL: it has none */
    const vgi_json *names; /* of its frames; NULL */
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
    bool own;      /* our own file: its vertices and faces stay as they are */
    size_t nuv;     /* texture coordinates of all parts */
    vg_attributes attributes;
    size_t labels_cap;
    uint32_t *number; /* all: the vertex of the mesh that each is */
    size_t dropped; /* triangles without three vertices */
    bool strips;    /* some faces are strips or fans */
    char *wanted;  /* the animation that is asked for; NULL: all */
    double rate;   /* sampled so often a second; 0: at the times of the keys */
    const vg_body *like; /* its welding is taken where it fits; while the file is opened; NULL */
    bool unwelded; /* vertices stay as the file has them */
    bool as_shapes; /* morph targets instead of animations */
    vg_note note;
} vgi_gltf_scene;

/* A primitive of a mesh as a node shows it. */
typedef struct vgi_gltf_piece {
    const vgi_json *json;
    size_t part;
} vgi_gltf_piece;

/* The faces of all parts, of vertices before welding. */
typedef struct vgi_gltf_faces {
    vg_mesh mesh;
    size_t start_cap, vert_cap;
    vgi_accessor index;
    bool indexed, turned; /* turned: to be seen from the other side */
    const vgi_gltf_part *part;
} vgi_gltf_faces;

/* ---- gltf_scene.c ---- */
/* vgi_gltf_scene_read: nodes, skins and meshes of an open file. The caller clears both, come what may. */
int vgi_gltf_scene_read(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_scene_clear(vgi_gltf_scene *x);
void vgi_gltf_local_matrix(const vgi_gltf_placed *p, double m[12]);
void vgi_gltf_from_columns(const double c[16], double m[12]); /* the upper rows of a matrix of 16, columns first */

/* ---- gltf_play.c ---- */
/* vgi_gltf_rest: nodes and joints as the file has them, without morph targets. */
void vgi_gltf_rest(vgi_gltf_scene *x);
void vgi_gltf_move_point(const double m[12], const double p[3], double to[3]); /* to = m p; to is not p */
/* vgi_gltf_vertex_matrix: what takes vertex v of a part into the world, as nodes and joints are now. */
void vgi_gltf_vertex_matrix(const vgi_gltf_scene *x, const vgi_gltf_part *p, size_t v, double m[12]);

/* ---- gltf_shapes.c: the morph targets of all meshes ---- */
/* vgi_gltf_list_shapes: which morph targets of which meshes belong together. */
int vgi_gltf_list_shapes(vgi_gltf_scene *x, vg_err *e) VG_MUST_CHECK;
const char *vgi_gltf_shape_name(const vgi_gltf_scene *x, size_t shape); /* empty: it has none */

/* ---- gltf_clips.c: animations ---- */
/* vgi_gltf_read_animations: channels, clips and moments, as the scene's wanted and rate say. */
int vgi_gltf_read_animations(vgi_gltf_scene *x, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_animate: nodes and weights at this moment. */
int vgi_gltf_animate(vgi_gltf_scene *x, const vgi_gltf_moment *m, vg_err *e) VG_MUST_CHECK;

/* ---- gltf_asset.c ---- */
/* vgi_gltf_take_asset: what the file holds beside shape and motion; nothing when there is none. */
int vgi_gltf_take_asset(vgi_gltf_scene *x, vgi_input *in, const vg_mesh *mesh, vg_asset *to, vg_err *e) VG_MUST_CHECK;

/* ---- gltf_weld.c ---- */
/* vgi_gltf_mend: put the mesh together as it was before it was exported: polygons of our own files, and vertices that
 * were cut apart. Fills kept of the parts, and m->nv. */
int vgi_gltf_mend(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e) VG_MUST_CHECK;

#endif
