/* gltf_whole.h: the file of a character whose frames are those that it plays by itself; used by gltf_write.c and
 * gltf_morph.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_WHOLE_H
#define VG_GLTF_WHOLE_H

#include "io/gltf_character.h"

typedef enum vgi_gltf_content { VGI_GLTF_POSE, VGI_GLTF_SHAPES, VGI_GLTF_CLIPS } vgi_gltf_content;

typedef struct vgi_gltf_whole {
    vgi_gltf_scene *x;         /* of the character; borrowed */
    const vg_body *body;
    bool fits;                 /* so far every frame is one that the file shows */
    vgi_gltf_content content;
    size_t frames;
    uint32_t *shown;           /* body->mesh.nv: the first vertex of the file that is this one of the mesh */
    double *pose;              /* of all vertices of the file */
    double near;
    bool *used;                /* clips */
    /* the animation that is being compared: */
    bool timed;
    size_t clip, count;        /* SIZE_MAX: none; frames of it, one for each key */
} vgi_gltf_whole;

/* vgi_gltf_whole_open: read the animations. The caller clears it in any case. */
int vgi_gltf_whole_open(vgi_gltf_whole *k, vgi_gltf_character *c, const vg_body *b, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_whole_put: compare the next frame. */
int vgi_gltf_whole_put(vgi_gltf_whole *k, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_whole_end: whether the frames are all of one pose, of the shapes, or of some animations. */
bool vgi_gltf_whole_end(vgi_gltf_whole *k);
size_t vgi_gltf_whole_clips(const vgi_gltf_whole *k); /* how many are used */
/* vgi_gltf_whole_trim: the document keeps the animations that are used, and those that move no vertex if all of the others
 * are. name (may be NULL): what the only one is called. */
int vgi_gltf_whole_trim(vgi_gltf_whole *k, const char *name, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_keep_still: the document keeps only animations that move no vertex, such as those of a camera. */
int vgi_gltf_keep_still(vgi_gltf_scene *x, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_whole_clear(vgi_gltf_whole *k);

#endif
