/* planar_kernel.h: the steps of conjugate gradients for eight poses at once, and the product with the planarity
 * matrix.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PLANAR_KERNEL_H
#define VG_PLANAR_KERNEL_H

#include "numeric/solve_kernel.h"

/* Faces as rows of their vertices; a face has at least 4 corners. */
typedef struct vgi_planar_faces {
    size_t n;
    const uint32_t *start, *row; /* corners of face f: row[start[f]] .. row[start[f + 1] - 1] */
} vgi_planar_faces;

typedef struct vgi_planar_kernel {
    /* product: y += P p, P the matrix of the sum over faces f and their corners c of (m_f . t_c)^2, t_c the vector of
     * the corner (MATH 5), m_f = normals[f]. pPp := p.P p. h: workspace for the corners of the largest face. */
    void (*product)(const vgi_planar_faces *f, const vgi_row *normals, const vgi_row *p, vgi_row *y, vgi_lanes *h,
                    vgi_lanes pPp);
    /* turn: p := z + beta p, s := r + beta s, ps := p.s, n rows */
    void (*turn)(size_t n, const vgi_row *z, const vgi_row *r, const vgi_lanes beta, vgi_row *p, vgi_row *s,
                 vgi_lanes ps);
    /* advance: x += alpha p, r -= alpha s + gamma y, z := r, y := 0 */
    void (*advance)(size_t n, const vgi_lanes alpha, const vgi_lanes gamma, const vgi_row *p, const vgi_row *s,
                    vgi_row *y, vgi_row *x, vgi_row *r, vgi_row *z);
    void (*dot)(size_t n, const vgi_row *a, const vgi_row *b, vgi_lanes ab);
    /* largest: the largest absolute value in each pose's rows */
    void (*largest)(size_t n, const vgi_row *a, vgi_lanes most);
    /* scale: to := factor a */
    void (*scale)(size_t n, const vgi_lanes factor, const vgi_row *a, vgi_row *to);
} vgi_planar_kernel;
VGI_KERNEL(vgi_planar_kernel)

#endif
