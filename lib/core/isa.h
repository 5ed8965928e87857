/* isa.h: the instruction set that the numeric kernels use. Internal; callers of libvg see vg_isa and vg_isa_choose.
 *
 * A kernel is a file *_kernel.c, written over a vector as wide as the registers (wide.h). The Makefile compiles it
 * once for each set, and each object defines one table of its functions, such as `vgi_x_kernel_avx2`. vgi_isa selects
 * the table to call.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ISA_H
#define VG_ISA_H

#include "core/core.h"

/* VGI_KERNEL(type): declares the tables of type `type` of all sets, and type_now(), the one in use. */
#if defined(__x86_64__)
#define VGI_KERNEL(type) \
    extern const type type##_sse2, type##_avx2, type##_avx512; \
    static inline const type *type##_now(void) \
    { \
        static const type *const all[] = {&type##_sse2, &type##_avx2, &type##_avx512}; \
        return all[vgi_isa]; \
    }
#elif defined(__aarch64__)
#define VGI_KERNEL(type) \
    extern const type type##_neon; \
    static inline const type *type##_now(void) { return &type##_neon; }
#else
#define VGI_KERNEL(type) \
    extern const type type##_plain; \
    static inline const type *type##_now(void) { return &type##_plain; }
#endif

/* Index of the set in use, narrowest first; the widest that the machine supports unless vg_isa_choose changes it. */
extern int vgi_isa;

#endif
