/* register.h: shared by the parts of registration: the fit of one surface to another, and the pairing of faces.
 * Internal; programs call vg_register (vg.h). All lengths here are in units of the target's D.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REGISTER_H
#define VG_REGISTER_H

#include "numeric/vec3.h"
#include "method/pairs/surface.h"

/* A tie: a point of the source and its target position. The point is the mean of up to three vertices, weighted by
 * shares; a single vertex is given three times. weight 1: as strong as the final stiffness of the surface. */
typedef struct vgi_tie {
    uint32_t vertex[3];
    double share[3], point[3], weight;
} vgi_tie;

typedef struct vgi_fitting {
    const vg_mesh *source;
    const double *rest;         /* positions of the source after the similarity */
    const vgi_surface *source_surface; /* of rest, for its borders */
    const vg_mesh *target_mesh;
    const double *target_points;
    const vgi_surface *target;
    bool flipped;               /* one of the meshes has reversed faces: matching normals are opposite */
    const bool *take, *take_vertex; /* per face and vertex of the source: whether the target pulls it; NULL: all */
    const uint32_t *links;      /* nlinks pairs of source vertices */
    size_t nlinks;
    const vgi_tie *tie;
    size_t nties;
    int threads;
    void (*step)(void *context, const vg_register_step *step); /* may be NULL */
    void *context;
} vgi_fitting;

/* vgi_fit: x (nv x 3, out): the source deformed so that it lies on the target. */
int vgi_fit(const vgi_fitting *in, double *x, vg_err *e) VG_MUST_CHECK;

typedef struct vgi_pairing {
    const vg_mesh *source, *target;
    const vgi_surface *source_surface, *target_surface; /* the source as fitted */
    const bool *take; /* per face of the source: whether it may drive target faces; NULL: all */
    bool flipped;
    int threads;
} vgi_pairing;

/* vgi_pair: fill first, source, weight, distance (in units of D) and matched of *c. */
int vgi_pair(const vgi_pairing *in, vg_correspondence *c, vg_err *e) VG_MUST_CHECK;

/* Input to the choice of source components: the taken ones are already fitted. */
typedef struct vgi_component_choice {
    const vg_mesh *source, *target;
    const double *points, *rest; /* positions of the source: fitted, and after the similarity alone */
    const vgi_surface *target_surface;
    const uint32_t *label; /* per source vertex: its component */
    size_t n;
    bool flipped;
    int threads;
} vgi_component_choice;

/* vgi_choose_components: add to `taken` (per component) the components that explain parts of the target which the
 * taken ones do not. */
int vgi_choose_components(const vgi_component_choice *in, bool *taken, vg_err *e) VG_MUST_CHECK;
/* vgi_take_faces: faces[f]: whether the component of face f is taken. Does nothing if faces is NULL. */
void vgi_take_faces(const vg_mesh *m, const uint32_t *label, const bool *taken, bool *faces);

#endif
