/* gltf.c: glTF 2.0 as a container: GLB chunks, JSON, embedded and external buffers, accessors; the format tables.
 * Scenes are in gltf_play.c, writing in gltf_write.c, compressed geometry in gltf_unpack.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf.h"

#include <stdarg.h>
#include <stdlib.h>

static const uint64_t vgi_gltf_most_elements = (uint64_t)1 << 27; /* per accessor, because accessors may have no
                                                                     bytes */

int vgi_gltf_bad(const vgi_gltf *g, vg_err *e, const char *format, ...)
{
    char text[256];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    return vg_fail(e, VG_EINPUT, "%s: %s", g->subject, text);
}

/* ---- the file ---- */

static int cut_short(const vgi_gltf *g, vg_err *e)
{
    return vg_fail(e, VG_ETRUNC, "%s is cut short", g->subject);
}

/* One chunk at *off, which moves to the next chunk. */
static int take_chunk(const vgi_gltf *g, size_t *off, uint32_t *type, const unsigned char **data, size_t *n,
                      vg_err *e)
{
    size_t left = g->file.size - *off;
    if (left < VGI_GLTF_CHUNK) return vgi_gltf_bad(g, e, "there are bytes after the last chunk");
    *n = vgi_get32(g->file.data + *off);
    *type = vgi_get32(g->file.data + *off + 4);
    *data = g->file.data + *off + VGI_GLTF_CHUNK;
    if (*n > left - VGI_GLTF_CHUNK) return vgi_gltf_bad(g, e, "a chunk of %zu bytes does not fit into the file", *n);
    *off += VGI_GLTF_CHUNK + *n;
    return VG_OK;
}

static int read_binary(vgi_gltf *g, const unsigned char **bin, size_t *nbin, vg_err *e)
{
    const unsigned char *p = g->file.data, *data;
    size_t off = VGI_GLTF_HEADER, n;
    uint32_t type;
    if (g->file.size < VGI_GLTF_HEADER) return cut_short(g, e);
    if (vgi_get32(p + 4) != 2)
        return vgi_gltf_bad(g, e, "it is GLB version %u, but only version 2 is supported", vgi_get32(p + 4));
    if (vgi_get32(p + 8) > g->file.size) return cut_short(g, e);
    if (vgi_get32(p + 8) < g->file.size) return vgi_gltf_bad(g, e, "there are bytes after the end of the GLB");
    int r = take_chunk(g, &off, &type, &data, &n, e);
    if (r == VG_OK && type != VGI_GLTF_JSON) r = vgi_gltf_bad(g, e, "its first chunk is not JSON");
    if (r == VG_OK) r = vgi_json_parse(&g->json, data, n, g->subject, e);
    for (bool first = true; r == VG_OK && off < g->file.size; first = false) {
        r = take_chunk(g, &off, &type, &data, &n, e);
        if (r == VG_OK && first && type == VGI_GLTF_BIN) *bin = data, *nbin = n;
    }
    return r;
}

static bool starts_with(const char *s, const char *with)
{
    return !strncmp(s, with, strlen(with));
}

/* Extensions that change no position, or that are supported. A name ending in _ matches every name with this
 * prefix. */
bool vgi_gltf_is_understood(const char *extension)
{
    static const char *const understood[] = {
        "KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_xmp_",
        "EXT_lights_", "EXT_mesh_gpu_instancing", "KHR_animation_pointer", "EXT_materials_", "KHR_audio_",
        "MSFT_texture_", "MSFT_packing_", "KHR_node_selectability", "KHR_node_hoverability", "FB_",
        "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"};
    for (size_t i = 0; i < sizeof understood / sizeof *understood; i++)
        if (starts_with(extension, understood[i])) return true;
    return false;
}

/* Report extensions that may change visible geometry and are neither supported nor known to be harmless. */
void vgi_gltf_note_extensions(const vgi_gltf *g, vg_note *note)
{
    const vgi_json *used = vgi_json_get(g->json, "extensionsUsed");
    for (size_t i = 0; i < vgi_json_count(used); i++) {
        const char *name = vgi_json_text(vgi_json_at(used, i));
        if (name && !vgi_gltf_is_understood(name)) vgi_note(note, "the extension %.60s is unknown and ignored", name);
    }
}

static int check_claims(const vgi_gltf *g, vg_err *e)
{
    const char *version = vgi_json_text(vgi_json_get(vgi_json_get(g->json, "asset"), "version"));
    const vgi_json *required = vgi_json_get(g->json, "extensionsRequired");
    if (!version) return vgi_gltf_bad(g, e, "it is not glTF: asset.version is missing");
    if (!starts_with(version, "2."))
        return vgi_gltf_bad(g, e, "it is glTF version '%.20s', but only version 2 is supported", version);
    for (size_t i = 0; i < vgi_json_count(required); i++) {
        const char *name = vgi_json_text(vgi_json_at(required, i));
        if (!name || !vgi_gltf_is_understood(name))
            return vgi_gltf_bad(g, e, "it requires the extension '%.60s', which is not known", name ? name : "?");
    }
    return VG_OK;
}

/* ---- buffers ---- */

static int digit_of(unsigned char c)
{
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

static int decode_base64(const vgi_gltf *g, const char *s, vg_bytes *to, vg_err *e)
{
    size_t n = strlen(s);
    uint32_t bits = 0;
    while (n > 0 && s[n - 1] == '=') n--;
    if (n % 4 == 1) return vgi_gltf_bad(g, e, "a buffer's base64 is cut short");
    int r = vgi_bytes_reserve(to, n / 4 * 3 + 3, e);
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        int digit = digit_of((unsigned char)s[i]);
        if (digit < 0) return vgi_gltf_bad(g, e, "a buffer's base64 has an invalid character");
        bits = bits << 6 | (uint32_t)digit;
        size_t have = i % 4; /* preceding digits: with 1, 2 and 3 of them this one completes a byte */
        if (have) to->data[to->size++] = (unsigned char)(bits >> (6 - 2 * have));
    }
    return r;
}

static int hex_of(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* The path of a URI relative to the file `from`; never above or outside its directory. */
static int path_beside(const vgi_gltf *g, const char *from, const char *uri, vg_bytes *path, vg_err *e)
{
    int r = vgi_bytes_append(path, from, (size_t)(vgi_base_name(from) - from), e);
    size_t start = path->size;
    for (const char *s = uri; *s && r == VG_OK; s++) {
        char c = *s;
        if (c == '%' && hex_of(s[1]) >= 0 && hex_of(s[2]) >= 0) c = (char)(hex_of(s[1]) << 4 | hex_of(s[2])), s += 2;
        if (!c) return vgi_gltf_bad(g, e, "a buffer has the URI '%.100s', which is not a file name", uri);
        r = vgi_bytes_append(path, &c, 1, e);
    }
    if (r == VG_OK) r = vgi_bytes_append(path, "", 1, e);
    if (r < 0) return r;
    const char *name = (const char *)path->data + start;
    if (*name == '/' || !*name || strstr(name, "..") || strchr(name, ':') || strchr(name, '\\'))
        return vgi_gltf_bad(g, e, "a buffer is at '%.100s': only files in the same directory or below it are read", uri);
    return VG_OK;
}

/* Read n bytes of it, or all (SIZE_MAX). */
static int read_beside(const vgi_gltf *g, vgi_input *in, const char *uri, size_t n, vg_bytes *to, vg_err *e)
{
    const char *from = vgi_input_path(in);
    vg_bytes path = {0};
    vgi_input *beside = NULL;
    if (!from)
        return vgi_gltf_bad(g, e, "its buffer '%.100s' is a separate file, which cannot be found from here: use a "
                                  ".glb",
                            uri);
    int r = path_beside(g, from, uri, &path, e);
    if (r == VG_OK) r = vgi_input_file(&beside, (char *)path.data, e);
    if (r == VG_OK)
        r = n == SIZE_MAX ? vgi_input_slurp(beside, to, e) : vgi_input_take(beside, to, n, NULL, e);
    vgi_input_free(&beside);
    vg_bytes_clear(&path);
    return r;
}

int vgi_gltf_read_beside(const vgi_gltf *g, vgi_input *in, const char *uri, vg_bytes *to, vg_err *e)
{
    return read_beside(g, in, uri, SIZE_MAX, to, e);
}

static int read_buffer(const vgi_gltf *g, vgi_gltf_buffer *b, const vgi_json *from, vgi_input *in, vg_err *e)
{
    const char *uri = vgi_json_text(vgi_json_get(from, "uri"));
    uint64_t n;
    if (!vgi_json_whole(vgi_json_get(from, "byteLength"), &n) || n > SIZE_MAX)
        return vgi_gltf_bad(g, e, "a buffer has no valid byteLength");
    if (uri) {
        const char *comma = starts_with(uri, "data:") ? strchr(uri, ',') : NULL;
        bool base64 = comma && comma - uri >= 7 && !memcmp(comma - 7, ";base64", 7);
        if (starts_with(uri, "data:") && !base64)
            return vgi_gltf_bad(g, e, "a buffer is in a data URI that is not base64");
        int r = base64 ? decode_base64(g, comma + 1, &b->own, e) : read_beside(g, in, uri, (size_t)n, &b->own, e);
        if (r < 0) return r;
        b->data = b->own.data, b->size = b->own.size;
    }
    if (n > b->size && vgi_gltf_is_fallback(from)) return VG_OK; /* its views are compressed and stored elsewhere */
    if (n > b->size)
        return vgi_gltf_bad(g, e, "a buffer should have %llu bytes but has %zu", (unsigned long long)n, b->size);
    b->size = (size_t)n;
    return VG_OK;
}

static int read_buffers(vgi_gltf *g, const unsigned char *bin, size_t nbin, vgi_input *in, vg_err *e)
{
    const vgi_json *list = vgi_json_get(g->json, "buffers");
    size_t n = vgi_json_count(list);
    if (!(g->buffers = vgi_array(n, sizeof *g->buffers, e))) return VG_ENOMEM;
    g->buffers_cap = n;
    int r = VG_OK;
    for (; g->nbuffers < n && r == VG_OK; g->nbuffers++) {
        vgi_gltf_buffer *b = &g->buffers[g->nbuffers];
        if (g->nbuffers == 0) b->data = bin, b->size = nbin;
        r = read_buffer(g, b, vgi_json_at(list, g->nbuffers), in, e);
    }
    return r;
}

int vgi_gltf_open(vgi_gltf *g, vgi_input *in, const char *subject, vg_err *e)
{
    const unsigned char *bin = NULL;
    size_t nbin = 0;
    *g = (vgi_gltf){.subject = subject};
    int r = vgi_input_slurp_text(in, &g->file, e);
    if (r < 0) return r;
    if (g->file.size >= 4 && !memcmp(g->file.data, "glTF", 4)) r = read_binary(g, &bin, &nbin, e);
    else r = vgi_json_parse(&g->json, g->file.data, g->file.size, subject, e);
    if (r == VG_OK) r = check_claims(g, e);
    if (r == VG_OK) r = read_buffers(g, bin, nbin, in, e);
    return r < 0 ? r : vgi_gltf_unpack(g, e);
}

void vgi_gltf_clear(vgi_gltf *g)
{
    for (size_t i = 0; i < g->nbuffers; i++) vg_bytes_clear(&g->buffers[i].own);
    free(g->buffers);
    vgi_json_free(&g->json);
    vg_bytes_clear(&g->file);
    *g = (vgi_gltf){0};
}

/* ---- accessors ---- */

int vgi_gltf_item(const vgi_gltf *g, const vgi_json *ref, const char *list, const vgi_json **item, size_t *number,
                  vg_err *e)
{
    const vgi_json *all = vgi_json_get(g->json, list);
    uint64_t i;
    if (!vgi_json_whole(ref, &i) || i >= vgi_json_count(all))
        return vgi_gltf_bad(g, e, "something refers to an element of '%s' that does not exist", list);
    *item = vgi_json_at(all, (size_t)i);
    if (!vgi_json_is_object(*item))
        return vgi_gltf_bad(g, e, "element %llu of '%s' is not an object", (unsigned long long)i, list);
    if (number) *number = (size_t)i;
    return VG_OK;
}

/* An integer, 0 if absent. */
static int take_whole(const vgi_gltf *g, const vgi_json *from, const char *key, size_t *x, vg_err *e)
{
    const vgi_json *j = vgi_json_get(from, key);
    uint64_t value = 0;
    if (j && (!vgi_json_whole(j, &value) || value > SIZE_MAX))
        return vgi_gltf_bad(g, e, "'%s' is not an integer", key);
    *x = (size_t)value;
    return VG_OK;
}

size_t vgi_gltf_component_bytes(int component)
{
    switch (component) {
    case VGI_GLTF_BYTE:
    case VGI_GLTF_UBYTE: return 1;
    case VGI_GLTF_SHORT:
    case VGI_GLTF_USHORT: return 2;
    case VGI_GLTF_UINT:
    case VGI_GLTF_FLOAT: return 4;
    default: return 0;
    }
}

static int take_component(const vgi_gltf *g, const vgi_json *from, int *component, vg_err *e)
{
    size_t x = 0;
    int r = take_whole(g, from, "componentType", &x, e);
    if (r == VG_OK && (x > INT32_MAX || !vgi_gltf_component_bytes((int)x)))
        r = vgi_gltf_bad(g, e, "an accessor's componentType is not known");
    if (r == VG_OK) *component = (int)x;
    return r;
}

/* Locate count elements of the given size in a buffer view, from its byteOffset on. */
static int find_bytes(const vgi_gltf *g, const vgi_json *from, size_t count, size_t element,
                      const unsigned char **data, size_t *stride, vg_err *e)
{
    const vgi_json *view, *buffer;
    size_t number = 0, start = 0, length = 0, off = 0, own = 0;
    int r = vgi_gltf_item(g, vgi_json_get(from, "bufferView"), "bufferViews", &view, NULL, e);
    if (r == VG_OK) r = vgi_gltf_item(g, vgi_json_get(view, "buffer"), "buffers", &buffer, &number, e);
    if (r == VG_OK) r = take_whole(g, view, "byteOffset", &start, e);
    if (r == VG_OK) r = take_whole(g, view, "byteLength", &length, e);
    if (r == VG_OK) r = take_whole(g, view, "byteStride", &own, e);
    if (r == VG_OK) r = take_whole(g, from, "byteOffset", &off, e);
    if (r < 0) return r;
    const vgi_gltf_buffer *b = &g->buffers[number];
    if (start > b->size || length > b->size - start)
        return vgi_gltf_bad(g, e, "a buffer view goes beyond its buffer");
    *stride = own ? own : element;
    if (own && own < element) return vgi_gltf_bad(g, e, "a buffer view's byteStride is less than an element");
    if (off > length || element > length - off || (count - 1) > (length - off - element) / *stride)
        return vgi_gltf_bad(g, e, "an accessor of %zu elements goes beyond its buffer view", count);
    *data = b->data + start + off;
    return VG_OK;
}

int vgi_gltf_view_bytes(const vgi_gltf *g, const vgi_json *ref, const unsigned char **data, size_t *n, vg_err *e)
{
    const vgi_json *view, *buffer;
    size_t number = 0, start = 0;
    int r = vgi_gltf_item(g, ref, "bufferViews", &view, NULL, e);
    if (r == VG_OK) r = vgi_gltf_item(g, vgi_json_get(view, "buffer"), "buffers", &buffer, &number, e);
    if (r == VG_OK) r = take_whole(g, view, "byteOffset", &start, e);
    if (r == VG_OK) r = take_whole(g, view, "byteLength", n, e);
    if (r < 0) return r;
    const vgi_gltf_buffer *b = &g->buffers[number];
    if (start > b->size || *n > b->size - start) return vgi_gltf_bad(g, e, "a buffer view goes beyond its buffer");
    *data = b->data + start;
    return VG_OK;
}

static double number_at(const unsigned char *p, int component)
{
    switch (component) {
    case VGI_GLTF_BYTE: return (int8_t)*p;
    case VGI_GLTF_UBYTE: return *p;
    case VGI_GLTF_SHORT: return (int16_t)(p[0] | p[1] << 8);
    case VGI_GLTF_USHORT: return p[0] | p[1] << 8;
    case VGI_GLTF_UINT: return vgi_get32(p);
    default: return vgi_as_float(vgi_get32(p));
    }
}

static double sparse_number(const vgi_accessor *a, size_t i)
{
    return number_at(a->sparse + i * vgi_gltf_component_bytes(a->sparse_component), a->sparse_component);
}

static int take_sparse(const vgi_gltf *g, const vgi_json *from, vgi_accessor *a, vg_err *e)
{
    const vgi_json *indices = vgi_json_get(from, "indices");
    size_t stride;
    int r = take_whole(g, from, "count", &a->nsparse, e);
    if (r == VG_OK && (a->nsparse == 0 || a->nsparse > a->count))
        r = vgi_gltf_bad(g, e, "a sparse accessor's count is not valid");
    if (r == VG_OK) r = take_component(g, indices, &a->sparse_component, e);
    if (r == VG_OK && a->sparse_component != VGI_GLTF_UBYTE && a->sparse_component != VGI_GLTF_USHORT &&
        a->sparse_component != VGI_GLTF_UINT)
        r = vgi_gltf_bad(g, e, "a sparse accessor's indices are not integers");
    if (r == VG_OK)
        r = find_bytes(g, indices, a->nsparse, vgi_gltf_component_bytes(a->sparse_component), &a->sparse, &stride, e);
    if (r == VG_OK && stride != vgi_gltf_component_bytes(a->sparse_component))
        r = vgi_gltf_bad(g, e, "a sparse accessor's indices have a stride");
    const size_t element = a->width * vgi_gltf_component_bytes(a->component);
    if (r == VG_OK) r = find_bytes(g, vgi_json_get(from, "values"), a->nsparse, element, &a->replaced, &stride, e);
    if (r == VG_OK && stride != element) r = vgi_gltf_bad(g, e, "a sparse accessor's values have a stride");
    for (size_t i = 0; i < a->nsparse && r == VG_OK; i++)
        if (sparse_number(a, i) >= (double)a->count || (i > 0 && sparse_number(a, i) <= sparse_number(a, i - 1)))
            r = vgi_gltf_bad(g, e, "a sparse accessor's indices do not ascend, or go beyond its count");
    return r;
}

size_t vgi_gltf_width(const char *type)
{
    static const struct {
        const char *name;
        size_t width;
    } types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    for (size_t i = 0; type && i < sizeof types / sizeof *types; i++)
        if (!strcmp(type, types[i].name)) return types[i].width;
    return 0;
}

int vgi_gltf_any_accessor(const vgi_gltf *g, const vgi_json *ref, vgi_accessor *a, vg_err *e)
{
    const vgi_json *from;
    uint64_t count;
    int r = vgi_gltf_item(g, ref, "accessors", &from, NULL, e);
    if (r < 0) return r;
    const size_t width = vgi_gltf_width(vgi_json_text(vgi_json_get(from, "type")));
    if (!width || !vgi_json_whole(vgi_json_get(from, "count"), &count) || count > vgi_gltf_most_elements)
        return vgi_gltf_bad(g, e, "an accessor is of an unknown type or count");
    return vgi_gltf_accessor(g, ref, width, (size_t)count, "the asset", a, e);
}

int vgi_gltf_accessor(const vgi_gltf *g, const vgi_json *ref, size_t width, size_t count, const char *what,
                      vgi_accessor *a, vg_err *e)
{
    const vgi_json *from;
    *a = (vgi_accessor){0};
    int r = vgi_gltf_item(g, ref, "accessors", &from, NULL, e);
    if (r == VG_OK) r = take_whole(g, from, "count", &a->count, e);
    if (r == VG_OK) r = take_component(g, from, &a->component, e);
    if (r < 0) return r;
    a->width = vgi_gltf_width(vgi_json_text(vgi_json_get(from, "type")));
    a->normalized = vgi_json_is_true(vgi_json_get(from, "normalized"));
    if (a->width != width) return vgi_gltf_bad(g, e, "the accessor of %s is of another type", what);
    if (a->count == 0) return vgi_gltf_bad(g, e, "the accessor of %s has 0 elements", what);
    if (count && a->count != count)
        return vgi_gltf_bad(g, e, "the accessor of %s has %zu elements, not %zu", what, a->count, count);
    if (vgi_json_get(from, "bufferView"))
        r = find_bytes(g, from, a->count, width * vgi_gltf_component_bytes(a->component), &a->data, &a->stride, e);
    else if (!count) return vgi_gltf_bad(g, e, "the accessor of %s has no bytes", what);
    if (r == VG_OK && vgi_json_get(from, "sparse")) r = take_sparse(g, vgi_json_get(from, "sparse"), a, e);
    return r;
}

/* Bytes of element i; NULL: zeros. */
static const unsigned char *element_at(const vgi_accessor *a, size_t i)
{
    size_t low = 0, high = a->nsparse;
    while (low < high) {
        size_t mid = low + (high - low) / 2;
        if (sparse_number(a, mid) < (double)i) low = mid + 1;
        else high = mid;
    }
    if (low < a->nsparse && sparse_number(a, low) == (double)i)
        return a->replaced + low * a->width * vgi_gltf_component_bytes(a->component);
    return a->data ? a->data + i * a->stride : NULL;
}

static double normal_of(double x, int component)
{
    switch (component) {
    case VGI_GLTF_BYTE: return x < -127 ? -1 : x / 127;
    case VGI_GLTF_UBYTE: return x / 255;
    case VGI_GLTF_SHORT: return x < -32767 ? -1 : x / 32767;
    case VGI_GLTF_USHORT: return x / 65535;
    default: return x;
    }
}

void vgi_accessor_get(const vgi_accessor *a, size_t i, double *to)
{
    const unsigned char *p = element_at(a, i);
    size_t bytes = vgi_gltf_component_bytes(a->component);
    for (size_t k = 0; k < a->width; k++) {
        double x = p ? number_at(p + k * bytes, a->component) : 0;
        to[k] = a->normalized ? normal_of(x, a->component) : x;
    }
}

size_t vgi_accessor_bytes(const vgi_accessor *a)
{
    return a->width * vgi_gltf_component_bytes(a->component);
}

bool vgi_accessor_is_index(const vgi_accessor *a)
{
    return !a->normalized &&
           (a->component == VGI_GLTF_UBYTE || a->component == VGI_GLTF_USHORT || a->component == VGI_GLTF_UINT);
}

/* ---- the tables ---- */

static bool sniff_glb(const unsigned char *data, size_t n)
{
    return n >= 4 && !memcmp(data, "glTF", 4);
}

static bool sniff_gltf(const unsigned char *data, size_t n)
{
    size_t i = 0;
    while (i < n && (data[i] == ' ' || data[i] == '\n' || data[i] == '\r' || data[i] == '\t')) i++;
    return i < n && data[i] == '{' && memmem(data, n, "\"asset\"", 7);
}

static int begin_glb(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    return vgi_gltf_begin(state, h, o, out, true, e);
}

static int begin_gltf(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    return vgi_gltf_begin(state, h, o, out, false, e);
}

/* Labels, and texture coordinates of vertices: the writer reports itself what it drops. */
enum { KEEPS = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_TEXTURE | VGI_KEEPS_COLOURS | VGI_KEEPS_LABELS | VGI_KEEPS_NAMES |
               VGI_KEEPS_TIMES | VGI_KEEPS_ASSET };

enum { KINDS = 1 << VG_VERTICES | 1 << VG_TRANSFORMS }; /* transforms: of a rig */

const vgi_sequence_format vgi_sequence_glb = {
    .name = "glb", .suffix = ".glb", .keeps = KEEPS, .uses = VGI_USES_GLTF, .bare = true, .sniff = sniff_glb,
    .open = vgi_gltf_play, .next = vgi_gltf_next, .frames = vgi_gltf_frames, .note = vgi_gltf_note,
    .close = vgi_gltf_close,
    .kinds = KINDS, .check = vgi_gltf_check, .begin = begin_glb, .put = vgi_gltf_put, .end = vgi_gltf_end,
    .warning = vgi_gltf_warning, .report = vgi_gltf_report, .release = vgi_gltf_release};

const vgi_sequence_format vgi_sequence_gltf = {
    .name = "gltf", .suffix = ".gltf", .keeps = KEEPS, .uses = VGI_USES_GLTF, .bare = true, .sniff = sniff_gltf,
    .open = vgi_gltf_play, .next = vgi_gltf_next, .frames = vgi_gltf_frames, .note = vgi_gltf_note,
    .close = vgi_gltf_close,
    .kinds = KINDS, .check = vgi_gltf_check, .begin = begin_gltf, .put = vgi_gltf_put, .end = vgi_gltf_end,
    .warning = vgi_gltf_warning, .report = vgi_gltf_report, .release = vgi_gltf_release};
