/* gltf_library.c: materials of a mesh that contains only their names, such as OBJ. They come from a library, which is
 * an asset without meshes (mtl.c); otherwise default materials are written.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_write.h"

/* Open an asset without meshes that belongs to the mesh. An unreadable one counts as none. */
static int open_library(vgi_gltf_writing *w, vg_err *e)
{
    const vg_body *b = &w->h->body;
    vgi_input *in = NULL;
    if (!b->asset.n || b->asset.digest != vg_mesh_digest(&b->mesh)) return VG_OK;
    int r = vgi_input_memory(&in, b->asset.data, b->asset.size, "asset", e);
    if (r == VG_OK) r = vgi_gltf_open(&w->library, in, "the asset", e);
    vgi_input_free(&in);
    if (r < 0 || vgi_json_count(vgi_json_get(w->library.json, "meshes"))) vgi_gltf_clear(&w->library);
    return r == VG_ENOMEM ? r : VG_OK;
}

int vgi_gltf_find_materials(vgi_gltf_writing *w, vg_err *e)
{
    int r = open_library(w, e);
    for (size_t i = 0; i < w->shape.nruns && r >= 0; i++)
        if (w->shape.run[i].material) r = vgi_name_set_add(&w->materials, w->shape.run[i].material, e);
    if (r >= 0 && !w->materials.names.n) vgi_gltf_clear(&w->library);
    return r < 0 ? r : VG_OK;
}

size_t vgi_gltf_material(const vgi_gltf_writing *w, const char *name)
{
    size_t i = 0;
    while (strcmp(w->materials.names.at[i], name)) i++;
    return i;
}

/* Its views come first, so that its images keep their numbers. */
int vgi_gltf_describe_library(vgi_gltf_writing *w, vg_err *e)
{
    if (!w->library.json) return VG_OK;
    w->bytes = w->library.nbuffers ? w->library.buffers[0].size : 0;
    return vgi_gltf_say_elements(w->library.json, "bufferViews", &w->views, &w->nviews, e);
}

/* The library's material with this name, or NULL. */
static const vgi_json *look_up(const vgi_gltf_writing *w, const char *name)
{
    const vgi_json *all = vgi_json_get(w->library.json, "materials");
    for (size_t i = 0; i < vgi_json_count(all); i++) {
        const char *its = vgi_json_text(vgi_json_get(vgi_json_at(all, i), "name"));
        if (its && !strcmp(its, name)) return vgi_json_at(all, i);
    }
    return NULL;
}

static int say_material(vgi_gltf_writing *w, const char *name, vg_err *e)
{
    const vgi_json *found = look_up(w, name);
    if (found) return vgi_json_print(found, &w->json, e);
    int r = vgi_gltf_say(&w->json, e, "{\"name\":");
    if (r == VG_OK) r = vgi_gltf_say_text(&w->json, name, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}");
}

int vgi_gltf_say_materials(vgi_gltf_writing *w, vg_err *e)
{
    static const char *const lists[] = {"textures", "images"};
    const vgi_names *names = &w->materials.names;
    if (!names->n) return VG_OK;
    int r = vgi_gltf_say(&w->json, e, "\"materials\":[");
    for (size_t i = 0; i < names->n && r == VG_OK; i++) {
        if (i) r = vgi_gltf_say(&w->json, e, ",\n");
        if (r == VG_OK) r = say_material(w, names->at[i], e);
    }
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "],\n");
    for (size_t i = 0; i < sizeof lists / sizeof *lists && r == VG_OK; i++) {
        const vgi_json *list = vgi_json_get(w->library.json, lists[i]);
        if (!list) continue;
        r = vgi_gltf_say(&w->json, e, "\"%s\":", lists[i]);
        if (r == VG_OK) r = vgi_json_print(list, &w->json, e);
        if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\n");
    }
    return r;
}
