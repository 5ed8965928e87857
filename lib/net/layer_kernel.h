/* layer_kernel.h: elementwise operations of a network for eight chains side by side. Internal. Matrix products use
 * BLAS.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NET_KERNEL_H
#define VG_NET_KERNEL_H

#include "core/isa.h"
#include "net/real.h"

/* net_tanh: in place. */
/* net_tanh_back: d *= 1 - (y - x)^2, where y - x is a tanh. */
/* net_gates: gates (4 n rows: i f g o, before activation) become i f g o; c := f c_before + i g, h := o tanh(c). */
/* net_gates_back: dh: gradient of h; dc: gradient of c from the following step, becomes that of c_before; dgates:
 * gradients of the gates before activation. */

/* The neighbours of vertex v: to[first[v]] .. to[first[v + 1] - 1]. */
typedef struct net_neighbours {
    size_t n;
    const uint32_t *first, *to;
} net_neighbours;

/* One mesh convolution y = tanh(x own + mean of neighbours' x times mean + bias). Matrices are channels x channels,
 * row-major, and transposed in a mirrored layer. */
typedef struct net_convolution {
    size_t channels; /* 9 and 12 are optimised */
    const real *own, *mean, *bias;
    bool mirrored;
} net_convolution;

/* net_convolve: x, y: n * channels rows; work: the same size, receives the means. */
/* net_convolve_back: dy: gradient of y, overwritten; dx: of x. Adds to the gradients of matrices and bias. work: 2 n
 * * channels rows. */

/* net_differences: squared distances of eight chains from eight others, and from the mirrored others (NULL: none): x
 * - y and x - z over rows. `turn` is the order of z's lanes: 0 unchanged, 4 halves exchanged. */
/* net_pull: g += by[0] (x - y) + by[1] (x - z), with z's lanes reordered as above, or NULL. (Vectors are not passed
 * by value, because that depends on the instruction set.) */

/* The functions above for one instruction set. */
typedef struct net_layer_kernel {
    void (*tanh)(net_lanes *x, size_t rows);
    void (*tanh_back)(size_t rows, const net_lanes *y, const net_lanes *x, net_lanes *d);
    void (*gates)(size_t n, net_lanes *gates, const net_lanes *c_before, net_lanes *c, net_lanes *h);
    void (*gates_back)(size_t n, const net_lanes *gates, const net_lanes *c_before, const net_lanes *c,
                       const net_lanes *dh, net_lanes *dc, net_lanes *dgates);
    void (*convolve)(const net_neighbours *g, const net_convolution *c, const net_lanes *x, net_lanes *y,
                     net_lanes *work);
    void (*convolve_back)(const net_neighbours *g, const net_convolution *c, const net_lanes *x, const net_lanes *y,
                          net_lanes *dy, net_lanes *dx, real *down, real *dmean, real *dbias, net_lanes *work);
    void (*differences)(size_t rows, const net_lanes *x, const net_lanes *y, const net_lanes *z, unsigned turn,
                        double *to_y, double *to_z);
    void (*pull)(size_t rows, const net_lanes *x, const net_lanes *y, const net_lanes *z, unsigned turn,
                 const net_lanes *by, net_lanes *g);
} net_layer_kernel;

#ifdef VGI_NET_DOUBLE
extern const net_layer_kernel vgi_double_layer_kernel;
#define net_kernel() (&vgi_double_layer_kernel)
#else
VGI_KERNEL(net_layer_kernel)
#define net_kernel() net_layer_kernel_now()
#endif

#define net_tanh net_kernel()->tanh
#define net_tanh_back net_kernel()->tanh_back
#define net_gates net_kernel()->gates
#define net_gates_back net_kernel()->gates_back
#define net_convolve net_kernel()->convolve
#define net_convolve_back net_kernel()->convolve_back
#define net_differences net_kernel()->differences
#define net_pull net_kernel()->pull

#endif
