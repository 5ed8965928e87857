/* isa.h: which instruction set the numeric kernels use. Internal; callers of libvg see vg_isa and vg_isa_choose.
 *
 * A kernel is a file *_kernel.c, written over a vector as wide as the registers (wide.h). The Makefile compiles it once
 * for each set, and each object defines one table of its functions, as `vgi_x_kernel_avx2`. vgi_isa says which table to
 * call.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ISA_H
#define VG_ISA_H

#include "core/core.h"

/* VGI_KERNEL(type): declares the table of type `type` of every set, and type_now(), the one in use. */
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

/* Index of the set in use, narrowest first; the widest of the machine unless vg_isa_choose says otherwise. */
extern int vgi_isa;

#endif
