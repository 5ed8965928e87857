/* codecs.h: geometry codecs of external libraries: Draco and meshopt. Each is wrapped by one file (codec_draco.cc,
 * codec_meshopt.c), which the Makefile leaves out if the library is not installed.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CODECS_H
#define VG_CODECS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Results: 0 decoded; -1 malformed data; -2 out of memory; -3 built without the library. */
enum { VGI_CODEC_OK = 0, VGI_CODEC_BAD = -1, VGI_CODEC_MEMORY = -2, VGI_CODEC_NONE = -3 };

/* A mesh of Draco. vgi_draco_open: *mesh is NULL on failure. */
typedef struct vgi_draco vgi_draco;
int vgi_draco_open(vgi_draco **mesh, const void *data, size_t n);
void vgi_draco_close(vgi_draco *mesh);
size_t vgi_draco_points(const vgi_draco *mesh);
size_t vgi_draco_corners(const vgi_draco *mesh);                 /* three per face */
void vgi_draco_indices(const vgi_draco *mesh, uint32_t *to);     /* corners */
/* vgi_draco_attribute: points x width numbers of the attribute with this unique identifier, in a glTF component type
 * (5120 to 5126), little-endian. */
int vgi_draco_attribute(const vgi_draco *mesh, uint32_t id, int component, size_t width, void *to);

/* vgi_meshopt_decode: count elements of `stride` bytes. mode, filter: the names in EXT_meshopt_compression. */
int vgi_meshopt_decode(const void *data, size_t n, const char *mode, const char *filter, size_t count, size_t stride,
                       void *to);

#ifdef __cplusplus
}
#endif
#endif
