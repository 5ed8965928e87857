/* nameless.h: unnamed files, and reading and writing in whole. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NAMELESS_H
#define VG_NAMELESS_H

#include "core/core.h"

/* vgi_nameless_file: create an unnamed file in $TMPDIR (or /tmp), for reading and writing; returns its descriptor. */
int vgi_nameless_file(vg_err *e) VG_MUST_CHECK;
/* vgi_read_back: read n bytes of such a file from `off` on; VG_ESYS if they cannot be read. */
int vgi_read_back(int fd, uint64_t off, void *to, size_t n, vg_err *e) VG_MUST_CHECK;
/* vgi_write_all: write n bytes to fd, continuing after interruptions; VG_ESYS naming `name`. */
int vgi_write_all(int fd, const void *data, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;

#endif
