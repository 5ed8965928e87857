/* gltf_morph.h: what gltf_morph.c and gltf_targets.c share: frames as morph targets.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_MORPH_H
#define VG_GLTF_MORPH_H

#include "io/gltf_basis.h"
#include "io/gltf_write.h"

/* Layout in the file of the positions or normals of a target, for one list of vertices. */
typedef struct vgi_gltf_laid {
    size_t moved;      /* number of vertices that it moves */
    bool sparse;       /* only these are stored */
    vgi_gltf_numbers kind;
    double bounds[6];
    size_t accessor;
} vgi_gltf_laid;

/* The base has its own tangents, which are never written again. */
enum { VGI_GLTF_POSITIONS, VGI_GLTF_NORMALS, VGI_GLTF_TANGENTS, VGI_GLTF_SORTS };

typedef struct vgi_gltf_morphs {
    size_t most;
    double tolerance;      /* in D */
    bool asked, shapes, quantize; /* asked: for a tolerance */
    bool named_shapes;     /* the frames are a set of shapes, by their names */
    unsigned char *packed; /* a frame in stored form */
    float *first;          /* workspace of one frame */
    /* known at the end: */
    size_t *chosen, targets; /* chosen: the frames that become targets; NULL: the targets are a basis */
    vgi_gltf_basis basis;
    size_t n, nlists;      /* vertices of the file */
    vgi_gltf_list *lists;
    bool based;            /* the base is that of the character's file */
    const float *base[VGI_GLTF_SORTS];
    float *file[VGI_GLTF_SORTS];    /* of a target: of all vertices of the file */
    float *moving;         /* those of a list that it moves */
    double *world;         /* a pose of the mesh */
    size_t kept;           /* targets whose normals and tangents are behind the frames in the spool: they cost more than reading */
    float *turned[VGI_GLTF_SORTS]; /* for a basis, the normals and tangents of all targets */
    vgi_gltf_laid *at;             /* targets x nlists x VGI_GLTF_SORTS */
    size_t weights;        /* number of their accessor */
    /* with quantize: */
    vgi_gltf_grid *grids;
    size_t ngrids;
    const float *exact[VGI_GLTF_SORTS];   /* the base before rounding; base is then of whole numbers */
    float *rounded[VGI_GLTF_SORTS]; /* owned: base */
    float *off[2];         /* n x 3: errors of the base and of a target */
    double *target_off;    /* targets: the largest error */
    double base_off, worst; /* worst: of the base and one target */
} vgi_gltf_morphs;

/* ---- gltf_morph.c ---- */
/* vgi_gltf_load_target: target t becomes file, of all vertices of the file. */
int vgi_gltf_load_target(vgi_gltf_writing *w, size_t t, vg_err *e) VG_MUST_CHECK;

/* ---- gltf_targets.c ---- */
vgi_gltf_laid *vgi_gltf_lying(const vgi_gltf_morphs *x, size_t t, size_t l, int sort);
/* vgi_gltf_quantize: from now on the base is of whole numbers; to be called before the targets are looked at. */
int vgi_gltf_quantize(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_look_at_targets(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
double vgi_gltf_largest_error(const vgi_gltf_writing *w); /* of a vertex, at most, over all frames: of mixing and rounding */
int vgi_gltf_describe_binds(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK; /* inverse bind matrices of quantized meshes */
int vgi_gltf_describe_targets(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_emit_targets(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK; /* the bytes of both */

#endif
