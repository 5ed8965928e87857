/* core.h: shared by all layers of libvg: checked allocation, growing byte arrays, threads, byte order. Internal;
 * independent of meshes and files.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CORE_H
#define VG_CORE_H

#include "vg.h"

#include <string.h>

/* vgi_array: n elements of `size` bytes, zeroed. NULL with VG_ENOMEM in *e if memory is short or n * size overflows.
 * n = 0 gives a valid pointer. Release with free(). */
void *vgi_array(size_t n, size_t size, vg_err *e);
/* vgi_array_raw: like vgi_array, but the contents are undefined. */
void *vgi_array_raw(size_t n, size_t size, vg_err *e);
/* vgi_copy_array: a copy of n elements. */
void *vgi_copy_array(const void *from, size_t n, size_t size, vg_err *e);
/* vgi_copy_string: a copy of the first n bytes, with a terminator. */
char *vgi_copy_string(const char *s, size_t n, vg_err *e);
/* vgi_grow: make room for `need` elements in *array (realloc, at least doubling); VG_OK or VG_ENOMEM. */
int vgi_grow(void *array_address, size_t *cap, size_t need, size_t size, vg_err *e) VG_MUST_CHECK;
bool vgi_mul(size_t a, size_t b, size_t *product); /* false on overflow */

int vgi_bytes_reserve(vg_bytes *b, size_t cap, vg_err *e) VG_MUST_CHECK;
int vgi_bytes_append(vg_bytes *b, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;

/* vgi_is_utf8: whether n bytes are valid UTF-8 without NUL. */
bool vgi_is_utf8(const char *s, size_t n);

/* vgi_finite: whether all n numbers are finite. */
bool vgi_finite(const double *x, size_t n);

/* vgi_parallel: call task(context, i) for i = 0 .. n-1 on up to `threads` threads, including the caller's, and
 * wait. Tasks start in order and must not depend on one another. With one thread this is a plain loop. */
void vgi_parallel(int threads, size_t n, void (*task)(void *context, size_t i), void *context);

/* A belt: an ordered work queue. The caller puts items on it one after another, threads process them in any order,
 * and the caller takes them off in the order in which it put them. Places are numbered from 0; the caller owns the
 * items stored there. Memory is bounded by the number of places. Only one thread at a time may call the functions
 * below.
 *
 *     if (vgi_belt_full(b)) use(item[vgi_belt_take(b)]); fill(item[vgi_belt_place(b)]); vgi_belt_put(b); */
typedef struct vgi_belt vgi_belt;
/* vgi_belt_new: up to `threads` threads call work(context, place), including the caller's thread while it waits in
 * vgi_belt_take. With one thread all work is done inside vgi_belt_take. */
int vgi_belt_new(vgi_belt **b, int threads, size_t places, void (*work)(void *context, size_t place), void *context,
                 vg_err *e) VG_MUST_CHECK;
/* vgi_belt_free: wait for items that are being processed and drop those that have not started. */
void vgi_belt_free(vgi_belt **b);
size_t vgi_belt_things(const vgi_belt *b); /* number of items on the belt */
bool vgi_belt_full(const vgi_belt *b);
size_t vgi_belt_place(const vgi_belt *b);  /* place of the next item; only if the belt is not full */
void vgi_belt_put(vgi_belt *b);            /* call when the item at vgi_belt_place is filled */
/* vgi_belt_take: wait for the oldest item and return its place. The belt must not be empty. */
size_t vgi_belt_take(vgi_belt *b);

/* Little-endian numbers. */
static inline uint32_t vgi_get32(const unsigned char *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}
static inline uint64_t vgi_get64(const unsigned char *p)
{
    return (uint64_t)vgi_get32(p) | (uint64_t)vgi_get32(p + 4) << 32;
}
static inline void vgi_put32(unsigned char *p, uint32_t x)
{
    p[0] = (unsigned char)x, p[1] = (unsigned char)(x >> 8), p[2] = (unsigned char)(x >> 16),
    p[3] = (unsigned char)(x >> 24);
}
static inline void vgi_put64(unsigned char *p, uint64_t x)
{
    vgi_put32(p, (uint32_t)x);
    vgi_put32(p + 4, (uint32_t)(x >> 32));
}

/* Reinterpret a number as its bits, and back. */
static inline uint32_t vgi_float_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
static inline uint64_t vgi_double_bits(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}
static inline float vgi_as_float(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
static inline double vgi_as_double(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

#endif
