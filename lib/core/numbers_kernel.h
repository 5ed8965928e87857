/* numbers_kernel.h: passes over an array of numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NUMBERS_KERNEL_H
#define VG_NUMBERS_KERNEL_H

#include "core/isa.h"

typedef struct vgi_numbers_kernel {
    bool (*finite)(const double *x, size_t n);
    void (*plain_zeros)(double *to, const double *from, size_t n);
    bool (*to_single)(float *to, const double *from, size_t n);
} vgi_numbers_kernel;
VGI_KERNEL(vgi_numbers_kernel)

/* vgi_plain_zeros: a copy in which -0 is 0. */
static inline void vgi_plain_zeros(double *to, const double *from, size_t n)
{
    vgi_numbers_kernel_now()->plain_zeros(to, from, n);
}

/* vgi_to_single: round n numbers to binary32; false if one of them is not finite there. */
static inline bool vgi_to_single(float *to, const double *from, size_t n)
{
    return vgi_numbers_kernel_now()->to_single(to, from, n);
}

#endif
