/* product_kernel.h: products of a layer's matrix with eight chains side by side. Internal. BLAS rearranges the whole
 * matrix before it multiplies, which takes twice as long as the product when the other side has eight columns only.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NET_PRODUCT_KERNEL_H
#define VG_NET_PRODUCT_KERNEL_H

#include "core/isa.h"
#include "net/real.h"

/* net_multiply: y := w x, or with `add` y += w x. w: rows x columns, row-major; x: columns rows of eight chains. */
/* net_multiply_turned: y := w' x, or y += w' x. x: rows, y: columns rows of eight chains. */

/* The functions above for one instruction set. */
typedef struct net_product_kernel {
    void (*multiply)(size_t rows, size_t columns, const real *w, const net_lanes *x, bool add, net_lanes *y);
    void (*multiply_turned)(size_t rows, size_t columns, const real *w, const net_lanes *x, bool add, net_lanes *y);
} net_product_kernel;

#ifdef VGI_NET_DOUBLE
extern const net_product_kernel vgi_double_product_kernel;
#define net_product() (&vgi_double_product_kernel)
#else
VGI_KERNEL(net_product_kernel)
#define net_product() net_product_kernel_now()
#endif

#define net_multiply net_product()->multiply
#define net_multiply_turned net_product()->multiply_turned

#endif
