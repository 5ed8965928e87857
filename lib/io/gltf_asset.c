/* gltf_asset.c: the contents of a glTF file besides shape and motion, as a GLB of the character at rest: materials,
 * textures, images, attributes of vertices, skins, nodes, cameras, lights, animations, morph targets. Unreferenced items
 * are dropped. The stream carries the asset unchanged (record ASST). It is written again in gltf_character.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_pack.h"
#include "io/gltf_scene.h"

#include <stdlib.h>

enum { ARRAY_BUFFER = 34962, ELEMENT_BUFFER = 34963, NO_TARGET = 0, ALIGNED = 8 };

typedef vgi_gltf_packing packing;

/* ---- views and accessors ---- */

static int align_bytes(packing *k, vg_err *e)
{
    static const unsigned char zeros[ALIGNED];
    return vgi_bytes_append(&k->data, zeros, (ALIGNED - k->data.size % ALIGNED) % ALIGNED, e);
}

/* Make a view of the bytes from `start` on. */
static int add_view(packing *k, size_t start, int target, size_t stride, size_t *number, vg_err *e)
{
    vgi_json *view = vgi_json_object(e);
    *number = vgi_json_count(k->views);
    int r = vgi_json_add(k->views, view, e);
    if (r == VG_OK) r = vgi_json_put(view, "buffer", vgi_json_of_whole(0, e), e);
    if (r == VG_OK) r = vgi_json_put(view, "byteOffset", vgi_json_of_whole(start, e), e);
    if (r == VG_OK) r = vgi_json_put(view, "byteLength", vgi_json_of_whole(k->data.size - start, e), e);
    if (r == VG_OK && stride) r = vgi_json_put(view, "byteStride", vgi_json_of_whole(stride, e), e);
    if (r == VG_OK && target) r = vgi_json_put(view, "target", vgi_json_of_whole((uint64_t)target, e), e);
    return r;
}

/* Write the elements before sparse ones replace them contiguously; those of vertices start at multiples of 4. */
static int put_elements(packing *k, const vgi_accessor *a, bool vertices, size_t *stride, vg_err *e)
{
    static const unsigned char zeros[64];
    const size_t element = vgi_accessor_bytes(a), step = vertices ? (element + 3) / 4 * 4 : element;
    int r = vgi_bytes_reserve(&k->data, k->data.size + a->count * step, e);
    for (size_t i = 0; i < a->count && r == VG_OK; i++) {
        r = vgi_bytes_append(&k->data, a->data + i * a->stride, element, e);
        if (r == VG_OK) r = vgi_bytes_append(&k->data, zeros, step - element, e);
    }
    *stride = vertices ? step : 0;
    return r;
}

/* n bytes as a view of their own, as the part `key` of a sparse accessor. */
static int put_part(packing *k, vgi_json *sparse, const char *key, const unsigned char *p, size_t n, vg_err *e)
{
    vgi_json *part = vgi_json_inner(sparse, key);
    size_t view = 0;
    int r = align_bytes(k, e);
    const size_t start = k->data.size;
    if (r == VG_OK) r = vgi_bytes_append(&k->data, p, n, e);
    if (r == VG_OK) r = add_view(k, start, NO_TARGET, 0, &view, e);
    vgi_json_drop(part, "byteOffset");
    return r < 0 ? r : vgi_json_put(part, "bufferView", vgi_json_of_whole(view, e), e);
}

static int put_sparse(packing *k, vgi_json *accessor, const vgi_accessor *a, vg_err *e)
{
    vgi_json *sparse = vgi_json_inner(accessor, "sparse");
    int r = put_part(k, sparse, "indices", a->sparse, a->nsparse * vgi_gltf_component_bytes(a->sparse_component), e);
    return r < 0 ? r : put_part(k, sparse, "values", a->replaced, a->nsparse * vgi_accessor_bytes(a), e);
}

static int add_accessor(packing *k, const vgi_json *old, const vgi_accessor *a, int target, vg_err *e)
{
    static const char *const gone[] = {"bufferView", "byteOffset", "extensions", "extras"};
    vgi_json *copy = vgi_json_copy(old, e);
    size_t stride, view = 0;
    for (size_t i = 0; copy && i < sizeof gone / sizeof *gone; i++) vgi_json_drop(copy, gone[i]);
    if (copy && !a->nsparse) vgi_json_drop(copy, "sparse");
    int r = vgi_json_add(k->accessors, copy, e);
    if (r == VG_OK && a->nsparse) r = put_sparse(k, copy, a, e);
    if (r < 0 || !a->data) return r;
    r = align_bytes(k, e);
    const size_t start = k->data.size;
    if (r == VG_OK) r = put_elements(k, a, target == ARRAY_BUFFER, &stride, e);
    if (r == VG_OK) r = add_view(k, start, target, stride, &view, e);
    return r < 0 ? r : vgi_json_put(copy, "bufferView", vgi_json_of_whole(view, e), e);
}

/* Replace member `key`, a reference to an accessor of `count` elements (0: any number), by the number of its copy.
 * Returns 0 if it cannot be copied. */
static int move_accessor(packing *k, vgi_json *holder, const char *key, int target, size_t count, vg_err *e)
{
    const vgi_json *ref = vgi_json_get(holder, key), *old;
    size_t number;
    vgi_accessor a;
    if (vgi_gltf_item(k->g, ref, "accessors", &old, &number, NULL) < 0 ||
        vgi_gltf_any_accessor(k->g, ref, &a, NULL) < 0 || (count && a.count != count))
        return 0;
    if (!k->accessor_of[number]) {
        int r = add_accessor(k, old, &a, target, e);
        if (r < 0) return r;
        k->accessor_of[number] = vgi_json_count(k->accessors);
    }
    int r = vgi_json_put(holder, key, vgi_json_of_whole(k->accessor_of[number] - 1, e), e);
    return r < 0 ? r : 1;
}

/* Replace all references to accessors in the members; drop those that cannot be copied. */
static int move_accessors(packing *k, vgi_json *holder, int target, size_t count, vg_err *e)
{
    for (const char *key = vgi_json_key(holder, NULL), *next; key; key = next) {
        next = vgi_json_key(holder, key);
        int r = move_accessor(k, holder, key, target, count, e);
        if (r < 0) return r;
        if (!r) vgi_json_drop(holder, key);
    }
    return VG_OK;
}

/* ---- images ---- */

const char *vgi_gltf_image_type(const unsigned char *p, size_t n)
{
    if (n >= 8 && !memcmp(p, "\x89PNG\r\n\x1a\n", 8)) return "image/png";
    if (n >= 3 && !memcmp(p, "\xff\xd8\xff", 3)) return "image/jpeg";
    if (n >= 12 && !memcmp(p, "RIFF", 4) && !memcmp(p + 8, "WEBP", 4)) return "image/webp";
    return n >= 12 && !memcmp(p, "\xabKTX 20\xbb\r\n\x1a\n", 12) ? "image/ktx2" : NULL;
}

int vgi_gltf_embed(packing *k, vgi_json *image, const unsigned char *p, size_t n, const char *type, vg_err *e)
{
    size_t start, view = 0;
    int r = align_bytes(k, e);
    start = k->data.size;
    if (r == VG_OK) r = vgi_bytes_append(&k->data, p, n, e);
    if (r == VG_OK) r = add_view(k, start, NO_TARGET, 0, &view, e);
    if (r == VG_OK) r = vgi_json_put(image, "bufferView", vgi_json_of_whole(view, e), e);
    if (r == VG_OK && type) r = vgi_json_put(image, "mimeType", vgi_json_of_text(type, e), e);
    if (r == VG_OK) vgi_json_drop(image, "uri");
    return r;
}

/* An image that cannot be read keeps its URI. */
static int embed_beside(packing *k, vgi_json *image, const char *uri, vg_err *e)
{
    vg_bytes bytes = {0};
    int r = vgi_gltf_read_beside(k->g, k->in, uri, &bytes, NULL);
    const char *type = r == VG_OK ? vgi_gltf_image_type(bytes.data, bytes.size) : NULL;
    if (type) r = vgi_gltf_embed(k, image, bytes.data, bytes.size, type, e);
    else vgi_note(k->note, "the image '%.60s' is not beside it", uri), r = VG_OK;
    vg_bytes_clear(&bytes);
    return r;
}

static int move_image(packing *k, vgi_json *image, vg_err *e)
{
    const char *uri = vgi_json_text(vgi_json_get(image, "uri"));
    const unsigned char *data;
    size_t n;
    if (uri && !strncmp(uri, "data:", 5)) return VG_OK;
    if (uri) return embed_beside(k, image, uri, e);
    if (vgi_gltf_view_bytes(k->g, vgi_json_get(image, "bufferView"), &data, &n, NULL) == VG_OK)
        return vgi_gltf_embed(k, image, data, n, NULL, e);
    vgi_json_drop(image, "bufferView");
    vgi_note(k->note, "left out an image without bytes");
    return vgi_json_put(image, "uri", vgi_json_of_text("data:,", e), e);
}

/* ---- the parts of the document ---- */

static bool is_carried(const char *extension)
{
    return vgi_gltf_is_understood(extension) && strncmp(extension, "KHR_audio_", 10);
}

static void drop_unknown(vgi_json *extensions)
{
    for (const char *key = vgi_json_key(extensions, NULL), *next; key; key = next) {
        next = vgi_json_key(extensions, key);
        if (!is_carried(key)) vgi_json_drop(extensions, key);
    }
}

/* Remove unknown extensions at any depth, which the parser has limited. */
static void strip_extensions(vgi_json *j)
{
    static const char extensions[] = "extensions";
    drop_unknown(vgi_json_inner(j, extensions));
    if (vgi_json_get(j, extensions) && !vgi_json_key(vgi_json_get(j, extensions), NULL)) vgi_json_drop(j, extensions);
    for (size_t i = 0; i < vgi_json_count(j); i++) strip_extensions(vgi_json_inner_at(j, i));
    for (const char *key = vgi_json_key(j, NULL); key; key = vgi_json_key(j, key)) strip_extensions(vgi_json_inner(j, key));
}

static int filter_list(vgi_json *doc, const char *key, vg_err *e)
{
    const vgi_json *old = vgi_json_get(doc, key);
    vgi_json *list = vgi_json_array(e);
    int r = list ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(old) && r == VG_OK; i++) {
        const char *name = vgi_json_text(vgi_json_at(old, i));
        if (name && is_carried(name)) r = vgi_json_add(list, vgi_json_of_text(name, e), e);
    }
    if (r == VG_OK && vgi_json_count(list)) return vgi_json_put(doc, key, list, e);
    vgi_json_free(&list);
    vgi_json_drop(doc, key);
    return r;
}

static int move_primitive(packing *k, vgi_json *primitive, vg_err *e)
{
    vgi_json *attributes = vgi_json_inner(primitive, "attributes");
    vgi_accessor position = {0};
    if (vgi_gltf_any_accessor(k->g, vgi_json_get(attributes, "POSITION"), &position, NULL) < 0) position.count = 0;
    int r = move_accessors(k, attributes, ARRAY_BUFFER, position.count, e);
    vgi_json *targets = vgi_json_inner(primitive, "targets");
    for (size_t t = 0; t < vgi_json_count(targets) && r == VG_OK; t++)
        r = move_accessors(k, vgi_json_inner_at(targets, t), ARRAY_BUFFER, position.count, e);
    if (r == VG_OK && vgi_json_get(primitive, "indices")) r = move_accessor(k, primitive, "indices", ELEMENT_BUFFER, 0, e);
    return r < 0 ? r : VG_OK;
}

static int move_mesh(packing *k, vgi_json *mesh, vg_err *e)
{
    vgi_json *primitives = vgi_json_inner(mesh, "primitives");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(primitives) && r == VG_OK; i++)
        r = move_primitive(k, vgi_json_inner_at(primitives, i), e);
    return r;
}

static int move_node(packing *k, vgi_json *node, vg_err *e)
{
    vgi_json *instances = vgi_json_inner(vgi_json_inner(node, "extensions"), "EXT_mesh_gpu_instancing");
    return move_accessors(k, vgi_json_inner(instances, "attributes"), NO_TARGET, 0, e);
}

static int move_skin(packing *k, vgi_json *skin, vg_err *e)
{
    static const char key[] = "inverseBindMatrices";
    int r = vgi_json_get(skin, key) ? move_accessor(k, skin, key, NO_TARGET, 0, e) : VG_OK;
    return r < 0 ? r : VG_OK;
}

/* 0: the animation cannot be copied. */
static int move_samplers(packing *k, vgi_json *animation, vg_err *e)
{
    vgi_json *samplers = vgi_json_inner(animation, "samplers");
    int r = 1;
    for (size_t i = 0; i < vgi_json_count(samplers) && r == 1; i++) {
        r = move_accessor(k, vgi_json_inner_at(samplers, i), "input", NO_TARGET, 0, e);
        if (r == 1) r = move_accessor(k, vgi_json_inner_at(samplers, i), "output", NO_TARGET, 0, e);
    }
    return r;
}

static int move_animations(packing *k, vg_err *e)
{
    static const char key[] = "animations";
    const vgi_json *old = vgi_json_get(k->doc, key);
    vgi_json *list = vgi_json_array(e);
    int r = list ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(old) && r >= 0; i++) {
        vgi_json *copy = vgi_json_copy(vgi_json_at(old, i), e);
        r = copy ? move_samplers(k, copy, e) : VG_ENOMEM;
        if (r == 1) r = vgi_json_add(list, copy, e);
        else vgi_json_free(&copy);
    }
    if (r >= 0 && vgi_json_count(list)) return vgi_json_put(k->doc, key, list, e);
    vgi_json_free(&list);
    vgi_json_drop(k->doc, key);
    return r < 0 ? r : VG_OK;
}

static int for_each(packing *k, const char *list, int (*move)(packing *, vgi_json *, vg_err *), vg_err *e)
{
    vgi_json *all = vgi_json_inner(k->doc, list);
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(all) && r == VG_OK; i++) r = move(k, vgi_json_inner_at(all, i), e);
    return r;
}

static int move_all(packing *k, vg_err *e)
{
    static const char *const gone[] = {"buffers", "accessors", "bufferViews"};
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++) vgi_json_drop(k->doc, gone[i]);
    strip_extensions(k->doc);
    int r = filter_list(k->doc, "extensionsUsed", e);
    if (r == VG_OK) r = filter_list(k->doc, "extensionsRequired", e);
    if (r == VG_OK) r = vgi_gltf_pack_begin(k, e);
    if (r == VG_OK) r = for_each(k, "meshes", move_mesh, e);
    if (r == VG_OK) r = for_each(k, "nodes", move_node, e);
    if (r == VG_OK) r = for_each(k, "skins", move_skin, e);
    if (r == VG_OK) r = move_animations(k, e);
    return r < 0 ? r : for_each(k, "images", move_image, e);
}

/* ---- the file ---- */

static int put_buffer(packing *k, vg_err *e)
{
    vgi_json *buffers = vgi_json_array(e), *buffer = NULL;
    int r = vgi_json_put(k->doc, "buffers", buffers, e);
    if (r == VG_OK) r = vgi_json_add(buffers, buffer = vgi_json_object(e), e);
    return r < 0 ? r : vgi_json_put(buffer, "byteLength", vgi_json_of_whole(k->data.size, e), e);
}

static int put_chunk(vg_bytes *to, uint32_t type, const vg_bytes *from, char filler, vg_err *e)
{
    unsigned char head[VGI_GLTF_CHUNK];
    const size_t padding = (4 - from->size % 4) % 4;
    vgi_put32(head, (uint32_t)(from->size + padding));
    vgi_put32(head + 4, type);
    int r = vgi_bytes_append(to, head, sizeof head, e);
    if (r == VG_OK) r = vgi_bytes_append(to, from->data, from->size, e);
    for (size_t i = 0; i < padding && r == VG_OK; i++) r = vgi_bytes_append(to, &filler, 1, e);
    return r;
}

int vgi_gltf_pack_end(packing *k, vg_bytes *to, vg_err *e)
{
    unsigned char head[VGI_GLTF_HEADER] = "glTF";
    vg_bytes text = {0};
    int r = align_bytes(k, e);
    static const char *const lists[] = {"accessors", "bufferViews"};
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        if (!vgi_json_count(vgi_json_get(k->doc, lists[i]))) vgi_json_drop(k->doc, lists[i]); /* empty lists are not allowed */
    if (r == VG_OK && k->data.size) r = put_buffer(k, e);
    if (r == VG_OK) r = vgi_json_print(k->doc, &text, e);
    if (r == VG_OK) r = vgi_bytes_append(to, head, sizeof head, e);
    if (r == VG_OK) r = put_chunk(to, VGI_GLTF_JSON, &text, ' ', e);
    if (r == VG_OK && k->data.size) r = put_chunk(to, VGI_GLTF_BIN, &k->data, 0, e);
    vg_bytes_clear(&text);
    if (r < 0) return r;
    vgi_put32(to->data + 4, 2);
    vgi_put32(to->data + 8, (uint32_t)to->size);
    return VG_OK;
}

int vgi_gltf_pack_begin(packing *k, vg_err *e)
{
    if (!k->doc && !(k->doc = vgi_json_object(e))) return VG_ENOMEM;
    int r = vgi_json_put(k->doc, "accessors", k->accessors = vgi_json_array(e), e);
    return r < 0 ? r : vgi_json_put(k->doc, "bufferViews", k->views = vgi_json_array(e), e);
}

void vgi_gltf_pack_clear(packing *k)
{
    vgi_json_free(&k->doc);
    free(k->accessor_of);
    vg_bytes_clear(&k->data);
}

static bool has_name(const vgi_json *item)
{
    const char *name = vgi_json_text(vgi_json_get(item, "name"));
    return name && *name;
}

/* Whether a node or mesh has a name. */
static bool has_names(const vgi_gltf_scene *x)
{
    return has_name(vgi_json_at(vgi_json_get(x->g.json, "nodes"), 0)) || has_name(vgi_json_at(vgi_json_get(x->g.json, "meshes"), 0));
}

/* Whether the file holds more than faces, positions, the first texture coordinates and the vertices of the mesh. */
static bool has_more(const vgi_gltf_scene *x, const vg_mesh *mesh)
{
    static const char *const lists[] = {"materials", "skins", "cameras", "images"};
    const vgi_json *doc = x->g.json;
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++)
        if (vgi_json_count(vgi_json_get(doc, lists[i]))) return true;
    const bool plain = x->own && x->nparts == 1; /* its normals were computed by the writer */
    if (!x->own && (x->most_targets || vgi_json_count(vgi_json_get(doc, "animations")))) return true;
    if (x->nnodes > 1 || (!x->own && (mesh->nv != x->all || has_names(x)))) return true;
    for (size_t i = 0; i < x->nparts; i++)
        for (const char *key = vgi_json_key(x->parts[i].attributes, NULL); key;
             key = vgi_json_key(x->parts[i].attributes, key))
            if (strcmp(key, "POSITION") && strcmp(key, "TEXCOORD_0") && !(plain && (!strcmp(key, "NORMAL") || !strcmp(key, "COLOR_0")))) return true;
    return false;
}

int vgi_gltf_take_asset(vgi_gltf_scene *x, vgi_input *in, const vg_mesh *mesh, vg_asset *to, vg_err *e)
{
    packing k = {.g = &x->g, .in = in, .note = &x->note};
    vg_bytes file = {0};
    if (!has_more(x, mesh)) return VG_OK;
    k.doc = vgi_json_copy(x->g.json, e);
    k.accessor_of = vgi_array(vgi_json_count(vgi_json_get(x->g.json, "accessors")), sizeof *k.accessor_of, e);
    int r = k.doc && k.accessor_of ? move_all(&k, e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_gltf_pack_end(&k, &file, e);
    if (r == VG_OK && file.size <= UINT32_MAX) {
        *to = (vg_asset){x->all, vg_mesh_digest(mesh), x->number, file.size, file.data};
        x->number = NULL, file = (vg_bytes){0};
    }
    vgi_gltf_pack_clear(&k);
    vg_bytes_clear(&file);
    return r;
}
