/* asset_text.c: describes the contents of an asset in words, for reports and for warnings of writers that cannot keep
 * it; and matches the vertices of its file to those of the mesh. The asset itself is in gltf_asset.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_scene.h"

#include <stdlib.h>

static size_t count_items(const vgi_gltf *g, const char *list)
{
    return vgi_json_count(vgi_json_get(g->json, list));
}

/* Number of primitives that have this attribute. */
static size_t having(const vgi_gltf *g, const char *attribute)
{
    const vgi_json *meshes = vgi_json_get(g->json, "meshes");
    size_t n = 0;
    for (size_t m = 0; m < vgi_json_count(meshes); m++) {
        const vgi_json *primitives = vgi_json_get(vgi_json_at(meshes, m), "primitives");
        for (size_t p = 0; p < vgi_json_count(primitives); p++)
            n += vgi_json_get(vgi_json_get(vgi_json_at(primitives, p), "attributes"), attribute) != NULL;
    }
    return n;
}

static void append_text(char *to, size_t room, const char *text)
{
    const size_t n = strlen(to);
    if (n < room) snprintf(to + n, room - n, "%s%s", n ? ", " : "", text);
}

static void say_count(char *to, size_t room, size_t n, const char *thing)
{
    char text[60];
    snprintf(text, sizeof text, "%zu %s%s", n, thing, n == 1 ? "" : "s");
    if (n) append_text(to, room, text);
}

void vg_asset_text(const vg_asset *a, char *to, size_t room)
{
    vgi_gltf g = {0};
    vgi_input *in = NULL;
    *to = 0;
    int r = a->n ? vgi_input_memory(&in, a->data, a->size, "asset", NULL) : VG_EINPUT;
    if (r == VG_OK) r = vgi_gltf_open(&g, in, "the asset", NULL);
    if (r == VG_OK) {
        say_count(to, room, count_items(&g, "materials"), "material");
        say_count(to, room, count_items(&g, "images"), "texture");
        if (having(&g, "NORMAL")) append_text(to, room, "normals");
        if (having(&g, "TANGENT")) append_text(to, room, "tangents");
        if (having(&g, "TEXCOORD_1")) append_text(to, room, "further texture coordinates");
        say_count(to, room, count_items(&g, "skins"), "skin");
        say_count(to, room, count_items(&g, "cameras"), "camera");
    }
    vgi_input_free(&in);
    vgi_gltf_clear(&g);
}

/* ---- vertices ---- */

/* Among the pieces of one node, the first one with the vertices of this part. */
static size_t primitive_of(const vgi_gltf_scene *x, size_t part)
{
    size_t n = 0;
    for (size_t i = 0; i < x->npieces && x->pieces[i].part != part; i++)
        n += x->parts[x->pieces[i].part].node == x->parts[part].node &&
             x->parts[x->pieces[i].part].instance == x->parts[part].instance;
    return n;
}

static void take_part(const vgi_gltf_scene *x, size_t i, const vg_asset *a, vg_asset_take *take, void *context)
{
    const vgi_gltf_part *p = &x->parts[i];
    const char *name = vgi_json_text(vgi_json_get(x->nodes[p->node].json, "name"));
    const size_t primitive = primitive_of(x, i);
    for (size_t v = 0; v < p->count; v++) take(context, name ? name : "", primitive, v, a->vertex[p->first + v]);
}

int vg_asset_vertices(const vg_asset *a, vg_asset_take *take, void *context, vg_err *e)
{
    vgi_gltf_scene x = {0};
    vgi_gltf_faces faces = {0};
    vgi_input *in = NULL;
    int r = vgi_input_memory(&in, a->data, a->size, "asset", e);
    if (r == VG_OK) r = vgi_gltf_open(&x.g, in, "the asset", e);
    vgi_input_free(&in);
    if (r == VG_OK) r = vgi_gltf_scene_read(&x, &faces, e);
    if (r == VG_OK && x.nparts && x.all != a->n) r = vg_fail(e, VG_EINPUT, "the asset has a different number of "
                                                                           "vertices");
    for (size_t i = 0; r == VG_OK && i < x.nparts; i++) take_part(&x, i, a, take, context);
    vg_mesh_clear(&faces.mesh);
    vgi_gltf_scene_clear(&x);
    return r;
}
