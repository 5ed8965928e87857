/* vg/core.h: errors and bytes.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_CORE_H
#define VG_PART_CORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define VG_MUST_CHECK __attribute__((warn_unused_result))
#define VG_PRINTF(a, b) __attribute__((format(printf, a, b)))
#else
#define VG_MUST_CHECK
#define VG_PRINTF(a, b)
#endif

/* The exit status of a program that fails follows from the code: 2 for VG_EARG, 3 for VG_EINPUT and VG_ETRUNC, 4
 * for VG_ESYS and VG_ENOMEM. */
typedef enum vg_code {
    VG_OK = 0,
    VG_EARG = -1,   /* the request is invalid, or does not fit the data */
    VG_EINPUT = -2, /* malformed input, or inputs that do not fit one another */
    VG_ETRUNC = -3, /* input that ends too early */
    VG_ESYS = -4,   /* a system call failed: open, read, write, ... */
    VG_ENOMEM = -5
} vg_code;

/* A failure: one line without a final full stop that names the file or frame. Control characters of the input are
 * replaced by '?'. */
typedef struct vg_err {
    int code;
    char message[480];
} vg_err;

/* vg_fail: fill *e (unless NULL) and return `code`. Control characters are stripped from the result. */
int vg_fail(vg_err *e, int code, const char *format, ...) VG_PRINTF(3, 4);

/* vg_exit_status: the exit status of a program for a code (see vg_code). */
int vg_exit_status(int code);

/* A growing array of bytes. data is NULL while cap is 0. */
typedef struct vg_bytes {
    unsigned char *data;
    size_t size, cap;
} vg_bytes;

void vg_bytes_clear(vg_bytes *b);

/* The instruction set of the numeric kernels: avx512, avx2 or sse2 on x86-64, neon on ARM of 64 bits; elsewhere plain.
 * vg_isa: the one in use, at first the widest that the machine has. */
const char *vg_isa(void);
/* vg_isa_at: instruction set i of this machine, narrowest first; NULL from some i on. */
const char *vg_isa_at(size_t i);
/* vg_isa_choose: use this one from now on; NULL: the widest. Do not call it while another thread computes. Results
 * differ between sets in the last digits. VG_EARG if the name is unknown or the machine does not have it. */
int vg_isa_choose(const char *name, vg_err *e) VG_MUST_CHECK;

/* What a reader dropped or repaired: one line for a warning; empty: nothing. */
typedef struct vg_note {
    char text[320];
} vg_note;

#ifdef __cplusplus
}
#endif
#endif
