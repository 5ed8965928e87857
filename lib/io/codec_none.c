/* codec_none.c: stubs for codecs whose library was not available at build time.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/codecs.h"

#ifndef VG_DRACO
int vgi_draco_open(vgi_draco **mesh, const void *data, size_t n)
{
    (void)data, (void)n;
    *mesh = NULL;
    return VGI_CODEC_NONE;
}

/* No mesh is ever open. */
void vgi_draco_close(vgi_draco *mesh)
{
    (void)mesh;
}

size_t vgi_draco_points(const vgi_draco *mesh)
{
    (void)mesh;
    return 0;
}

size_t vgi_draco_corners(const vgi_draco *mesh)
{
    (void)mesh;
    return 0;
}

void vgi_draco_indices(const vgi_draco *mesh, uint32_t *to)
{
    (void)mesh, (void)to;
}

int vgi_draco_attribute(const vgi_draco *mesh, uint32_t id, int component, size_t width, void *to)
{
    (void)mesh, (void)id, (void)component, (void)width, (void)to;
    return VGI_CODEC_NONE;
}
#endif

#ifndef VG_MESHOPT
int vgi_meshopt_decode(const void *data, size_t n, const char *mode, const char *filter, size_t count, size_t stride,
                       void *to)
{
    (void)data, (void)n, (void)mode, (void)filter, (void)count, (void)stride, (void)to;
    return VGI_CODEC_NONE;
}
#endif
