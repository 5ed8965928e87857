/* register.h: what the parts of registration share: the fit of one surface to another, the pairing of faces.
 * Internal; what a program may call is vg_register in vg.h. All lengths in here are in units of the target's D.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REGISTER_H
#define VG_REGISTER_H

#include "numeric/vec3.h"
#include "method/pairs/surface.h"

/* A point of the source, the mean of up to three vertices by their shares (of a single vertex, that vertex three
 * times), that belongs at a point of space. weight 1: as firm as the surface is stiff in the end. */
typedef struct vgi_tie {
    uint32_t vertex[3];
    double share[3], point[3], weight;
} vgi_tie;

typedef struct vgi_fitting {
    const vg_mesh *source;
    const double *rest;         /* of the source, brought onto the target as a whole */
    const vgi_surface *source_surface; /* of rest: its borders */
    const vg_mesh *target_mesh;
    const double *target_points;
    const vgi_surface *target;
    bool flipped;               /* the faces of one mesh turn the other way round: normals are to be opposite */
    const bool *take, *take_vertex; /* per face and vertex of the source: the target pulls it; NULL: all */
    const uint32_t *links;      /* nlinks pairs of source vertices */
    size_t nlinks;
    const vgi_tie *tie;
    size_t nties;
    int threads;
    void (*step)(void *context, const vg_register_step *step); /* may be NULL */
    void *context;
} vgi_fitting;

/* vgi_fit: x (nv x 3, out): the source bent so that it lies on the target. */
int vgi_fit(const vgi_fitting *in, double *x, vg_err *e) VG_MUST_CHECK;

typedef struct vgi_pairing {
    const vg_mesh *source, *target;
    const vgi_surface *source_surface, *target_surface; /* the source as fitted */
    const bool *take; /* per face of the source: it may drive faces of the target; NULL: all */
    bool flipped;
    int threads;
} vgi_pairing;

/* vgi_pair: fill first, source, weight, distance (units of D), matched of *c. */
int vgi_pair(const vgi_pairing *in, vg_correspondence *c, vg_err *e) VG_MUST_CHECK;

/* What of the source, of which the taken components were fitted, explains the target. */
typedef struct vgi_component_choice {
    const vg_mesh *source, *target;
    const double *points, *rest; /* of the source: as fitted, and as brought onto the target as a whole */
    const vgi_surface *target_surface;
    const uint32_t *label; /* per source vertex: its component */
    size_t n;
    bool flipped;
    int threads;
} vgi_component_choice;

/* vgi_choose_components: add to `taken` (per component) those that explain something of the target that the taken
 * ones do not. */
int vgi_choose_components(const vgi_component_choice *in, bool *taken, vg_err *e) VG_MUST_CHECK;
/* vgi_take_faces: faces[f]: is the component of face f taken? Nothing if faces is NULL. */
void vgi_take_faces(const vg_mesh *m, const uint32_t *label, const bool *taken, bool *faces);

#endif
