/* npy.h: the header of a NumPy array, shared by npy.c (one array) and npz.c (a zip of them).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NPY_H
#define VG_NPY_H

#include "io/io.h"

enum { VGI_NPY_HEADER = 128, VGI_NPY_DIMENSIONS = 4 };

typedef struct vgi_npy {
    char kind;   /* 'f' 'i' 'u' 'b' 'U' 'S' as in NumPy */
    size_t item; /* bytes of one element */
    bool big, fortran;
    size_t ndim; /* 0: a single element */
    uint64_t shape[VGI_NPY_DIMENSIONS];
} vgi_npy;

/* vgi_npy_read: read magic and header, versions 1 to 3; the elements follow. VG_EINPUT for objects, structures and
 * more than four dimensions. *bytes: size of the elements, which fits in a size_t. */
int vgi_npy_read(vgi_npy *a, size_t *bytes, vgi_input *in, const char *subject, vg_err *e) VG_MUST_CHECK;
/* vgi_npy_write: VGI_NPY_HEADER bytes of version 1. */
void vgi_npy_write(unsigned char to[VGI_NPY_HEADER], const char *descr, size_t ndim, const uint64_t *shape);
/* vgi_npy_float: the element at p, of kind 'f', 4 or 8 bytes. */
double vgi_npy_float(const vgi_npy *a, const unsigned char *p);
/* vgi_npy_stride: the distance between elements along dimension d, in elements. */
size_t vgi_npy_stride(const vgi_npy *a, size_t d);
/* vgi_npy_store: write n numbers as little-endian binary32 or binary64. VG_EINPUT for one that is out of range. */
int vgi_npy_store(vg_bytes *to, const double *x, size_t n, bool doubles, vg_err *e) VG_MUST_CHECK;

#endif
