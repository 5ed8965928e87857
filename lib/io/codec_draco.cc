// codec_draco.cc: meshes compressed with Draco, for gltf_unpack.c: the one file that knows the library, which is C++.
// Leaves out point clouds.
// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/codecs.h"

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>

#include <memory>
#include <new>

struct vgi_draco {
    std::unique_ptr<draco::Mesh> mesh;
};

// Every index is that of a point.
static bool faces_are_whole(const draco::Mesh &m)
{
    for (draco::FaceIndex f(0); f < m.num_faces(); ++f)
        for (int k = 0; k < 3; k++)
            if (m.face(f)[k].value() >= m.num_points()) return false;
    return true;
}

int vgi_draco_open(vgi_draco **out, const void *data, size_t n)
{
    *out = nullptr;
    try {
        draco::DecoderBuffer buffer;
        buffer.Init(static_cast<const char *>(data), n);
        draco::Decoder decoder;
        auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
        if (!mesh.ok() || !faces_are_whole(*mesh.value())) return VGI_CODEC_BAD;
        *out = new vgi_draco{std::move(mesh).value()};
        return VGI_CODEC_OK;
    } catch (const std::bad_alloc &) {
        return VGI_CODEC_MEMORY;
    } catch (...) {
        return VGI_CODEC_BAD;
    }
}

void vgi_draco_close(vgi_draco *x)
{
    delete x;
}

size_t vgi_draco_points(const vgi_draco *x)
{
    return x->mesh->num_points();
}

size_t vgi_draco_corners(const vgi_draco *x)
{
    return 3 * static_cast<size_t>(x->mesh->num_faces());
}

void vgi_draco_indices(const vgi_draco *x, uint32_t *to)
{
    for (draco::FaceIndex f(0); f < x->mesh->num_faces(); ++f)
        for (int k = 0; k < 3; k++) *to++ = x->mesh->face(f)[k].value();
}

template <typename T> static int convert(const vgi_draco *x, const draco::PointAttribute &a, size_t width, void *to)
{
    T *out = static_cast<T *>(to);
    for (draco::PointIndex p(0); p < x->mesh->num_points(); ++p, out += width) {
        const draco::AttributeValueIndex v = a.mapped_index(p);
        if (v.value() >= a.size() || !a.ConvertValue<T>(v, static_cast<int8_t>(width), out)) return VGI_CODEC_BAD;
    }
    return VGI_CODEC_OK;
}

int vgi_draco_attribute(const vgi_draco *x, uint32_t id, int component, size_t width, void *to)
{
    const draco::PointAttribute *a = x->mesh->GetAttributeByUniqueId(id);
    if (!a || static_cast<size_t>(a->num_components()) != width) return VGI_CODEC_BAD;
    try {
        switch (component) {
        case 5120: return convert<int8_t>(x, *a, width, to);
        case 5121: return convert<uint8_t>(x, *a, width, to);
        case 5122: return convert<int16_t>(x, *a, width, to);
        case 5123: return convert<uint16_t>(x, *a, width, to);
        case 5125: return convert<uint32_t>(x, *a, width, to);
        case 5126: return convert<float>(x, *a, width, to);
        default: return VGI_CODEC_BAD;
        }
    } catch (...) {
        return VGI_CODEC_BAD;
    }
}
