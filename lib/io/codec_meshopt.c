/* codec_meshopt.c: decodes buffers compressed with meshoptimizer, for gltf_unpack.c. No other file includes the
 * library.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/codecs.h"

#include <string.h>

#ifdef VG_MESHOPT
#include <meshoptimizer.h>

/* Returns false if the filter does not apply to such elements. */
static bool apply_filter(const char *filter, size_t count, size_t stride, void *to)
{
    if (!strcmp(filter, "NONE")) return true;
    if (!strcmp(filter, "OCTAHEDRAL") && (stride == 4 || stride == 8)) return meshopt_decodeFilterOct(to, count, stride), true;
    if (!strcmp(filter, "QUATERNION") && stride == 8) return meshopt_decodeFilterQuat(to, count, stride), true;
    if (!strcmp(filter, "EXPONENTIAL") && stride % 4 == 0) return meshopt_decodeFilterExp(to, count, stride), true;
    return false;
}

int vgi_meshopt_decode(const void *data, size_t n, const char *mode, const char *filter, size_t count, size_t stride,
                       void *to)
{
    int r = -1;
    if (!strcmp(mode, "ATTRIBUTES")) {
        if (stride == 0 || stride > 256 || stride % 4) return VGI_CODEC_BAD;
        r = meshopt_decodeVertexBuffer(to, count, stride, data, n);
        return r == 0 && apply_filter(filter, count, stride, to) ? VGI_CODEC_OK : VGI_CODEC_BAD;
    }
    if ((stride != 2 && stride != 4) || strcmp(filter, "NONE")) return VGI_CODEC_BAD;
    if (!strcmp(mode, "TRIANGLES") && count % 3 == 0) r = meshopt_decodeIndexBuffer(to, count, stride, data, n);
    else if (!strcmp(mode, "INDICES")) r = meshopt_decodeIndexSequence(to, count, stride, data, n);
    return r == 0 ? VGI_CODEC_OK : VGI_CODEC_BAD;
}

#endif
