/* robust_kernel.h: the steps of the search for the least absolute misfit (robust.c), for eight poses at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ROBUST_KERNEL_H
#define VG_ROBUST_KERNEL_H

#include "numeric/solve_kernel.h"

/* Faces as rows of their vertices, with the metric of each. The misfit of a face with r corners is r - 1 vectors:
 * those of its corners minus that of its first. Misfit i of face f has number start[f] - f + i. */
typedef struct vgi_robust_faces {
    size_t n;
    const uint32_t *start, *row; /* corners of face f: row[start[f]] .. row[start[f + 1] - 1] */
    const size_t *entry;         /* per face: start of its metric */
    const double *metric;        /* for r - 1 corners, the lower triangle by rows; for a star its weight alone */
    const unsigned char *star;   /* per face: its metric is a multiple of the projector */
} vgi_robust_faces;

/* Sums over faces, per pose. */
typedef struct vgi_robust_sums {
    vgi_lanes energy; /* sum of sqrt(e^2 + soft^2), e^2 the squared misfit of a face in its metric */
    vgi_lanes weight; /* sum of 1 / sqrt(e^2 + soft^2) */
} vgi_robust_sums;

/* The products for the next direction. g, z: gradient and N^-1 gradient at the last point; gn, zn: at this point; d:
 * the direction between. dy = d.(gn - g), yv = (gn - g).(zn - z), dg = d.gn, yz = (gn - g).zn, gz = gn.zn. */
typedef struct vgi_robust_products {
    vgi_lanes dy, yv, dg, yz, gz;
} vgi_robust_products;

typedef struct vgi_robust_kernel {
    /* interleave: the misfits of eight poses (n numbers each) side by side: to[8 i + k] = from[k][i] */
    void (*interleave)(size_t n, const float *const *from, float *to);
    /* energy: with the vertices displaced by u from where the misfits were measured; its gradient is added to g.
     * soft2: soft^2 per pose; NULL: the energy alone, g and weight are not written. room: workspace for twice the
     * corners of the largest face. */
    void (*energy)(const vgi_robust_faces *f, const float *misfit, const vgi_row *u, const double *soft2, vgi_row *g,
                   vgi_row *room, vgi_robust_sums *sums);
    void (*multiply)(size_t n, const vgi_row *g, const vgi_row *gn, const vgi_row *z, const vgi_row *zn,
                     const vgi_row *d, vgi_robust_products *p);
    /* turn: d := abc[0] d + abc[1] z + abc[2] zn, n rows */
    void (*turn)(size_t n, const vgi_lanes *abc, const vgi_row *z, const vgi_row *zn, vgi_row *d);
    /* step: to := u + t d, n rows */
    void (*step)(size_t n, const vgi_row *u, const vgi_lanes t, const vgi_row *d, vgi_row *to);
    /* scale: x := factor x, n rows */
    void (*scale)(size_t n, const vgi_lanes factor, vgi_row *x);
} vgi_robust_kernel;
VGI_KERNEL(vgi_robust_kernel)

#endif
