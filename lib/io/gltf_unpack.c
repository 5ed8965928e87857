/* gltf_unpack.c: converts compressed glTF (KHR_draco_mesh_compression, EXT_meshopt_compression) to plain glTF:
 * decompressed data becomes additional buffers, to which the JSON then refers. The codecs are in codecs.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/codecs.h"
#include "io/gltf.h"

#include <stdlib.h>

static const char draco[] = "KHR_draco_mesh_compression";
static const char *const meshopt[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

/* Largest expansion of meshopt data: a byte for 256 elements takes at least 4. And of all compressed data together,
 * so that a small file cannot fill the memory by naming its data often. */
enum { MOST_RATIO = 64, MOST_RATIO_OF_ALL = 1024, LEAST_DATA = 1024 };

static int failed(const vgi_gltf *g, int r, const char *codec, const char *extension, vg_err *e)
{
    if (r == VGI_CODEC_MEMORY) return vg_fail(e, VG_ENOMEM, "not enough memory to decompress %s", g->subject);
    if (r == VGI_CODEC_NONE)
        return vgi_gltf_bad(g, e, "it is compressed with %s (%s), which this build does not read: export without compression",
                            codec, extension);
    return vgi_gltf_bad(g, e, "it is compressed with %s (%s), and the data are malformed", codec, extension);
}

static int whole(const vgi_gltf *g, const vgi_json *from, const char *key, size_t *x, vg_err *e)
{
    uint64_t value;
    if (!vgi_json_whole(vgi_json_get(from, key), &value) || value > SIZE_MAX / 2)
        return vgi_gltf_bad(g, e, "'%s' is not an integer", key);
    *x = (size_t)value;
    return VG_OK;
}

/* Whether that much more may be unpacked. */
static bool is_plausible(const vgi_gltf *g, size_t more)
{
    size_t given = 0, made = more;
    for (size_t i = 0; i < g->nbuffers; i++) *(i < g->given ? &given : &made) += g->buffers[i].size;
    return made / MOST_RATIO_OF_ALL <= given + LEAST_DATA;
}

/* Append a buffer, which takes ownership of `own`, also on failure. */
static int add_buffer(vgi_gltf *g, vg_bytes *own, size_t *number, vg_err *e)
{
    if (!is_plausible(g, own->size)) {
        vg_bytes_clear(own);
        return vgi_gltf_bad(g, e, "its compressed data expand to more than %d times their size", MOST_RATIO_OF_ALL);
    }
    vgi_json *list = vgi_json_inner(g->json, "buffers"), *buffer = vgi_json_object(e);
    int r = buffer ? vgi_json_put(buffer, "byteLength", vgi_json_of_whole(own->size, e), e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_grow(&g->buffers, &g->buffers_cap, g->nbuffers + 1, sizeof *g->buffers, e);
    if (r == VG_OK) r = vgi_json_add(list, buffer, e), buffer = NULL;
    vgi_json_free(&buffer);
    if (r < 0) return vg_bytes_clear(own), r;
    *number = g->nbuffers;
    g->buffers[g->nbuffers++] = (vgi_gltf_buffer){own->data, own->size, *own};
    *own = (vg_bytes){0};
    return VG_OK;
}

/* ---- meshopt: buffer views ---- */

/* The extension of a buffer view or buffer; NULL if absent. */
static const vgi_json *meshopt_of(const vgi_json *item, const char **name)
{
    const vgi_json *all = vgi_json_get(item, "extensions");
    for (size_t i = 0; i < sizeof meshopt / sizeof *meshopt; i++) {
        const vgi_json *x = vgi_json_get(all, *name = meshopt[i]);
        if (x) return x;
    }
    return NULL;
}

bool vgi_gltf_is_fallback(const vgi_json *buffer)
{
    const char *name;
    return vgi_json_is_true(vgi_json_get(meshopt_of(buffer, &name), "fallback"));
}

static int compressed_bytes(const vgi_gltf *g, const vgi_json *x, const unsigned char **data, size_t *n, vg_err *e)
{
    size_t number = 0, off = 0;
    int r = whole(g, x, "buffer", &number, e);
    if (r == VG_OK && number >= g->nbuffers) r = vgi_gltf_bad(g, e, "something refers to a buffer that does not exist");
    if (r == VG_OK && vgi_json_get(x, "byteOffset")) r = whole(g, x, "byteOffset", &off, e);
    if (r == VG_OK) r = whole(g, x, "byteLength", n, e);
    if (r < 0) return r;
    const vgi_gltf_buffer *b = &g->buffers[number];
    if (off > b->size || *n > b->size - off) return vgi_gltf_bad(g, e, "compressed data go beyond their buffer");
    *data = b->data + off;
    return VG_OK;
}

static int decode_view(vgi_gltf *g, const vgi_json *x, const char *name, vg_bytes *to, vg_err *e)
{
    const char *mode = vgi_json_text(vgi_json_get(x, "mode")), *filter = vgi_json_text(vgi_json_get(x, "filter"));
    const unsigned char *data = NULL;
    size_t n = 0, count = 0, stride = 0, bytes;
    int r = compressed_bytes(g, x, &data, &n, e);
    if (r == VG_OK) r = whole(g, x, "count", &count, e);
    if (r == VG_OK) r = whole(g, x, "byteStride", &stride, e);
    if (r < 0) return r;
    if (!mode || !count || !vgi_mul(count, stride, &bytes) || bytes / MOST_RATIO > n + LEAST_DATA)
        return failed(g, VGI_CODEC_BAD, "meshopt", name, e);
    if ((r = vgi_bytes_reserve(to, bytes, e)) < 0) return r;
    r = vgi_meshopt_decode(data, n, mode, filter ? filter : "NONE", count, stride, to->data);
    to->size = bytes;
    return r ? failed(g, r, "meshopt", name, e) : VG_OK;
}

static int unpack_view(vgi_gltf *g, vgi_json *view, const vgi_json *x, const char *name, vg_err *e)
{
    vg_bytes bytes = {0};
    size_t number = 0, size;
    int r = decode_view(g, x, name, &bytes, e);
    if (r < 0) return vg_bytes_clear(&bytes), r;
    size = bytes.size;
    if ((r = add_buffer(g, &bytes, &number, e)) < 0) return r;
    vgi_json_drop(view, "extensions");
    vgi_json_drop(view, "byteOffset");
    r = vgi_json_put(view, "buffer", vgi_json_of_whole(number, e), e);
    return r < 0 ? r : vgi_json_put(view, "byteLength", vgi_json_of_whole(size, e), e);
}

static int unpack_views(vgi_gltf *g, vg_err *e)
{
    vgi_json *views = vgi_json_inner(g->json, "bufferViews");
    int r = VG_OK;
    for (size_t i = 0, n = vgi_json_count(views); i < n && r == VG_OK; i++) {
        const char *name;
        vgi_json *view = vgi_json_inner_at(views, i);
        const vgi_json *x = meshopt_of(view, &name);
        if (x) r = unpack_view(g, view, x, name, e);
    }
    return r;
}

/* ---- Draco: primitives ---- */

static vgi_json *accessor_of(const vgi_gltf *g, const vgi_json *ref)
{
    vgi_json *list = vgi_json_inner(g->json, "accessors");
    uint64_t i;
    vgi_json *a = vgi_json_whole(ref, &i) && i < vgi_json_count(list) ? vgi_json_inner_at(list, (size_t)i) : NULL;
    return vgi_json_is_object(a) ? a : NULL;
}

/* Give the accessor these bytes; takes ownership. */
static int put_bytes(vgi_gltf *g, vgi_json *accessor, vg_bytes *bytes, vg_err *e)
{
    vgi_json *views = vgi_json_inner(g->json, "bufferViews"), *view = vgi_json_object(e);
    size_t number = 0, size = bytes->size, at = vgi_json_count(views);
    int r = add_buffer(g, bytes, &number, e);
    if (r == VG_OK && !view) r = VG_ENOMEM;
    if (r == VG_OK) r = vgi_json_put(view, "buffer", vgi_json_of_whole(number, e), e);
    if (r == VG_OK) r = vgi_json_put(view, "byteLength", vgi_json_of_whole(size, e), e);
    if (r == VG_OK) r = vgi_json_add(views, view, e), view = NULL;
    vgi_json_free(&view);
    if (r < 0) return r;
    vgi_json_drop(accessor, "byteOffset");
    vgi_json_drop(accessor, "sparse");
    return vgi_json_put(accessor, "bufferView", vgi_json_of_whole(at, e), e);
}

static bool has_count(const vgi_json *accessor, size_t n)
{
    uint64_t count;
    return accessor && vgi_json_whole(vgi_json_get(accessor, "count"), &count) && count == n && n > 0;
}

static int unpack_indices(vgi_gltf *g, const vgi_draco *m, const vgi_json *primitive, vg_err *e)
{
    vgi_json *a = accessor_of(g, vgi_json_get(primitive, "indices"));
    const size_t n = vgi_draco_corners(m);
    vg_bytes bytes = {0};
    if (!has_count(a, n)) return failed(g, VGI_CODEC_BAD, "Draco", draco, e);
    uint32_t *index = vgi_array_raw(n, sizeof *index, e);
    int r = index ? vgi_bytes_reserve(&bytes, n * sizeof *index, e) : VG_ENOMEM;
    if (r == VG_OK) {
        vgi_draco_indices(m, index);
        for (size_t i = 0; i < n; i++) vgi_put32(bytes.data + sizeof *index * i, index[i]);
        bytes.size = n * sizeof *index;
    }
    free(index);
    if (r < 0) return vg_bytes_clear(&bytes), r;
    r = put_bytes(g, a, &bytes, e);
    return r < 0 ? r : vgi_json_put(a, "componentType", vgi_json_of_whole(VGI_GLTF_UINT, e), e);
}

static int unpack_attribute(vgi_gltf *g, const vgi_draco *m, vgi_json *a, const vgi_json *id, vg_err *e)
{
    const size_t n = vgi_draco_points(m), width = vgi_gltf_width(vgi_json_text(vgi_json_get(a, "type")));
    uint64_t component = 0, unique = 0;
    vg_bytes bytes = {0};
    if (!has_count(a, n) || !vgi_json_whole(vgi_json_get(a, "componentType"), &component) || component > VGI_GLTF_FLOAT ||
        !vgi_json_whole(id, &unique) || unique > UINT32_MAX || !width || width > 4)
        return failed(g, VGI_CODEC_BAD, "Draco", draco, e);
    const size_t size = vgi_gltf_component_bytes((int)component) * width * n;
    int r = vgi_bytes_reserve(&bytes, size, e);
    if (r < 0) return r;
    if ((r = vgi_draco_attribute(m, (uint32_t)unique, (int)component, width, bytes.data)))
        return vg_bytes_clear(&bytes), failed(g, r, "Draco", draco, e);
    bytes.size = size;
    return put_bytes(g, a, &bytes, e);
}

static int unpack_mesh(vgi_gltf *g, const vgi_draco *m, const vgi_json *primitive, const vgi_json *x, vg_err *e)
{
    const vgi_json *ids = vgi_json_get(x, "attributes"), *attributes = vgi_json_get(primitive, "attributes");
    int r = unpack_indices(g, m, primitive, e);
    for (const char *key = vgi_json_key(ids, NULL); key && r == VG_OK; key = vgi_json_key(ids, key)) {
        vgi_json *a = accessor_of(g, vgi_json_get(attributes, key));
        if (a) r = unpack_attribute(g, m, a, vgi_json_get(ids, key), e);
    }
    return r;
}

/* Whether the primitive can be read without the extension. */
static bool has_fallback(const vgi_gltf *g, const vgi_json *primitive)
{
    const vgi_json *a = accessor_of(g, vgi_json_get(vgi_json_get(primitive, "attributes"), "POSITION"));
    return vgi_json_get(a, "bufferView") != NULL;
}

static int unpack_primitive(vgi_gltf *g, vgi_json *primitive, vg_err *e)
{
    vgi_json *extensions = vgi_json_inner(primitive, "extensions");
    const vgi_json *x = vgi_json_get(extensions, draco);
    const unsigned char *data = NULL;
    vgi_draco *mesh = NULL;
    size_t n = 0;
    if (!x) return VG_OK;
    int r = vgi_gltf_view_bytes(g, vgi_json_get(x, "bufferView"), &data, &n, e);
    if (r < 0) return r;
    r = vgi_draco_open(&mesh, data, n);
    if (r == VGI_CODEC_OK) r = unpack_mesh(g, mesh, primitive, x, e);
    else if (r != VGI_CODEC_NONE || !has_fallback(g, primitive)) r = failed(g, r, "Draco", draco, e);
    else r = VG_OK;
    vgi_draco_close(mesh);
    if (r == VG_OK) vgi_json_drop(extensions, draco);
    return r;
}

static int unpack_primitives(vgi_gltf *g, vg_err *e)
{
    vgi_json *meshes = vgi_json_inner(g->json, "meshes");
    int r = VG_OK;
    for (size_t m = 0; m < vgi_json_count(meshes) && r == VG_OK; m++) {
        vgi_json *list = vgi_json_inner(vgi_json_inner_at(meshes, m), "primitives");
        for (size_t p = 0; p < vgi_json_count(list) && r == VG_OK; p++)
            r = unpack_primitive(g, vgi_json_inner_at(list, p), e);
    }
    return r;
}

/* ---- both ---- */

static bool is_codec(const char *name)
{
    return name && (!strcmp(name, draco) || !strcmp(name, meshopt[0]) || !strcmp(name, meshopt[1]));
}

/* Remove the extensions from the lists of the file. */
static int forget_codecs(vgi_gltf *g, const char *key, vg_err *e)
{
    const vgi_json *names = vgi_json_get(g->json, key);
    vgi_json *left = vgi_json_array(e);
    int r = left ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(names) && r == VG_OK; i++)
        if (!is_codec(vgi_json_text(vgi_json_at(names, i))))
            r = vgi_json_add(left, vgi_json_copy(vgi_json_at(names, i), e), e);
    if (r < 0 || vgi_json_count(left) == vgi_json_count(names)) return vgi_json_free(&left), r;
    if (vgi_json_count(left)) return vgi_json_put(g->json, key, left, e);
    vgi_json_free(&left);
    vgi_json_drop(g->json, key);
    return VG_OK;
}

int vgi_gltf_unpack(vgi_gltf *g, vg_err *e)
{
    g->given = g->nbuffers;
    int r = unpack_views(g, e);
    if (r == VG_OK) r = unpack_primitives(g, e);
    if (r == VG_OK) r = forget_codecs(g, "extensionsUsed", e);
    return r < 0 ? r : forget_codecs(g, "extensionsRequired", e);
}
