/* gltf_cast.c: writes the file of a character again, with meshes that move: nodes, skins, materials, textures,
 * images, cameras and lights are unchanged, and each node that shows a mesh gets a separate mesh, because each moves
 * independently. Bytes and accessors are in gltf_morph.c, positions of vertices in gltf_character.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_prune.h"
#include "io/gltf_roots.h"
#include "io/gltf_write.h"

#include <stdlib.h>

int vgi_gltf_say_elements(const vgi_json *document, const char *list, vg_bytes *to, size_t *n, vg_err *e)
{
    const vgi_json *all = vgi_json_get(document, list);
    int r = VG_OK;
    for (*n = 0; *n < vgi_json_count(all) && r == VG_OK; ++*n) {
        if (*n) r = vgi_bytes_append(to, ",\n", 2, e);
        if (r == VG_OK) r = vgi_json_print(vgi_json_at(all, *n), to, e);
    }
    return r;
}

static int list_vertices(const vgi_gltf_character *c, vgi_json *extras, vg_err *e)
{
    vgi_json *list = vgi_json_array(e);
    int r = vgi_json_put(extras, VGI_GLTF_VERTICES, list, e);
    if (r == VG_OK) r = vgi_json_add(list, vgi_json_of_whole(c->nv, e), e);
    for (size_t f = 0; f < c->n && r == VG_OK; f++) r = vgi_json_add(list, vgi_json_of_whole(c->vertex[f], e), e);
    return r;
}

static int ensure_extras(vgi_json *holder, vg_err *e)
{
    if (vgi_json_is_object(vgi_json_get(holder, "extras"))) return VG_OK;
    return vgi_json_put(holder, "extras", vgi_json_object(e), e);
}

/* Copyright and similar members stay; the generator changes. */
int vgi_gltf_say_cast_asset(vgi_gltf_writing *w, vg_err *e)
{
    vgi_json *asset = vgi_json_copy(vgi_json_get(w->character->scene.g.json, "asset"), e);
    int r = asset ? vgi_json_put(asset, "generator", vgi_json_of_text("vg " VG_VERSION, e), e) : VG_ENOMEM;
    const bool lists = w->character->touches && !w->as_it_was; /* its own file says which vertices are one */
    if (r == VG_OK && !w->as_it_was) vgi_json_drop(vgi_json_inner(asset, "extras"), VGI_GLTF_VERTICES);
    if (r == VG_OK && lists) r = ensure_extras(asset, e);
    if (r == VG_OK && lists) r = list_vertices(w->character, vgi_json_inner(asset, "extras"), e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "{\"asset\":");
    if (r == VG_OK) r = vgi_json_print(asset, &w->json, e);
    vgi_json_free(&asset);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, ",\n");
}

/* ---- what goes ---- */

/* Joints and weights of vertices without a skin mean nothing, and the format does not allow them. */
static void drop_influences(vgi_json *attributes)
{
    for (const char *key = vgi_json_key(attributes, NULL), *next; key; key = next) {
        next = vgi_json_key(attributes, key);
        if (!strncmp(key, "JOINTS_", 7) || !strncmp(key, "WEIGHTS_", 8)) vgi_json_drop(attributes, key);
    }
}

static void trim_primitives(vgi_json *mesh, bool targets, bool skinned)
{
    vgi_json *primitives = vgi_json_inner(mesh, "primitives");
    for (size_t i = 0; i < vgi_json_count(primitives); i++) {
        vgi_json *primitive = vgi_json_inner_at(primitives, i);
        if (!targets) vgi_json_drop(primitive, "targets");
        if (!skinned) drop_influences(vgi_json_inner(primitive, "attributes"));
    }
}

static bool shows_mesh(const vgi_gltf_scene *x, size_t node, size_t *mesh)
{
    uint64_t number = 0;
    if (!x->nodes[node].shown || !vgi_json_whole(vgi_json_get(x->nodes[node].json, "mesh"), &number)) return false;
    *mesh = (size_t)number;
    return true;
}

/* What the nodes that show meshes use. */
typedef struct uses {
    bool *meshes, *skinned; /* skinned: meshes that a node shows with a skin */
    bool *bound;            /* skins of a single node */
} uses;

static void find_uses(const vgi_gltf_scene *x, uses *u)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        size_t mesh;
        if (!shows_mesh(x, i, &mesh)) continue;
        u->meshes[mesh] = true;
        u->skinned[mesh] |= vgi_json_get(x->nodes[i].json, "skin") != NULL;
    }
    for (size_t s = 0; s < x->nskins; s++) u->bound[s] = vgi_gltf_users_of(x->g.json, s) == 1;
}

static int trim(vgi_gltf_writing *w, bool quantized, vg_err *e)
{
    vgi_gltf_scene *x = &w->character->scene;
    vgi_json *meshes = vgi_json_inner(x->g.json, "meshes");
    const size_t n = vgi_json_count(meshes);
    uses u = {vgi_array(n, 1, e), vgi_array(n, 1, e), vgi_array(x->nskins, 1, e)};
    int r = u.meshes && u.skinned && u.bound ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) find_uses(x, &u);
    for (size_t m = 0; m < n && r == VG_OK; m++)
        if (u.meshes[m]) trim_primitives(vgi_json_inner_at(meshes, m), w->whole, u.skinned[m]);
    const vgi_gltf_pruned pruned = {w->as_it_was ? NULL : u.meshes, quantized ? u.bound : NULL,
                                    !w->as_it_was && (quantized || !w->character->kept)};
    if (r == VG_OK) r = vgi_gltf_prune(&x->g, &pruned, &w->asset, e);
    free(u.meshes);
    free(u.skinned);
    free(u.bound);
    return r;
}

int vgi_gltf_trim_cast(vgi_gltf_writing *w, bool quantized, vg_err *e)
{
    vgi_gltf_scene *x = &w->character->scene;
    int r = x->nclips ? VG_OK : vgi_gltf_read_animations(x, e);
    if (r == VG_ENOMEM) return r;
    for (size_t i = 0; i < x->nparts; i++) x->parts[i].targets = NULL;
    if (r < 0 || w->ntakes != x->nclips) vgi_json_drop(x->g.json, "animations");
    r = vgi_gltf_keep_still(x, e);
    return r < 0 ? r : trim(w, quantized, e);
}

int vgi_gltf_trim_whole(vgi_gltf_writing *w, vg_err *e)
{
    int r = vgi_gltf_whole_trim(w->whole, w->clip, e);
    if (r == VG_OK && w->as_it_was) r = vgi_gltf_raise_skins(&w->character->scene, w->character->scene.g.json, e);
    return r < 0 ? r : trim(w, w->quantized, e);
}

/* ---- meshes ---- */

static int put_number(vgi_json *object, const char *key, size_t x, vg_err *e)
{
    return vgi_json_put(object, key, vgi_json_of_whole(x, e), e);
}

static int add_targets(vgi_json *primitive, const vgi_gltf_cast *k, size_t l, vg_err *e)
{
    vgi_json *targets = vgi_json_array(e);
    int r = k->targets ? vgi_json_put(primitive, "targets", targets, e) : VG_OK;
    if (!k->targets) vgi_json_free(&targets);
    for (size_t t = 0; t < k->targets && r == VG_OK; t++) {
        vgi_json *target = vgi_json_object(e);
        const size_t at = k->target(k->context, t, l);
        r = vgi_json_add(targets, target, e);
        if (r == VG_OK) r = put_number(target, "POSITION", at, e);
        if (r == VG_OK && k->lists[l].normals) r = put_number(target, "NORMAL", at + 1, e);
        if (r == VG_OK && k->lists[l].tangents) r = put_number(target, "TANGENT", at + 2, e);
    }
    return r;
}

static int add_primitive(vgi_json *primitives, const vgi_gltf_scene *x, const vgi_gltf_piece *piece, const vgi_gltf_cast *k,
                         vg_err *e)
{
    const vgi_gltf_list *l = &k->lists[piece->part];
    vgi_json *primitive = vgi_json_copy(piece->json, e);
    int r = vgi_json_add(primitives, primitive, e);
    if (r < 0) return r;
    vgi_json *attributes = vgi_json_inner(primitive, "attributes");
    if (!k->own_targets) vgi_json_drop(vgi_json_inner(primitive, "extras"), "targetNames");
    if (x->parts[piece->part].skin == VGI_GLTF_NONE) drop_influences(attributes);
    r = put_number(attributes, "POSITION", l->position, e);
    if (r == VG_OK && l->normals) r = put_number(attributes, "NORMAL", l->normal, e);
    return r < 0 ? r : add_targets(primitive, k, piece->part, e);
}

/* The weight that a node's shape of this name has without animation; 0 if there is none. */
static double weight_of(const vgi_gltf_scene *x, size_t node, const char *name)
{
    const vgi_gltf_node *n = &x->nodes[node];
    for (size_t t = 0; t < n->nweights; t++)
        if (!strcmp(vgi_gltf_shape_name(x, n->shape_of[t]), name)) return n->rest_weights[t];
    return 0;
}

static int add_weights(vgi_json *mesh, const vgi_gltf_scene *x, size_t node, const vgi_gltf_cast *k, vg_err *e)
{
    vgi_json *weights = vgi_json_array(e);
    int r = vgi_json_put(mesh, "weights", weights, e);
    for (size_t t = 0; t < k->targets && r == VG_OK; t++) {
        const char *name = vgi_json_text(vgi_json_at(k->names, t));
        const double weight = k->shapes && name ? weight_of(x, node, name) : 0;
        r = vgi_json_add(weights, weight == 0 ? vgi_json_of_whole(0, e) : vgi_json_of_number(weight, e), e);
    }
    return r;
}

static int add_names(vgi_json *mesh, const vgi_json *names, vg_err *e)
{
    int r = ensure_extras(mesh, e);
    return r < 0 ? r : vgi_json_put(vgi_json_inner(mesh, "extras"), "targetNames", vgi_json_copy(names, e), e);
}

/* The mesh of a node: the original mesh with the primitives that the node shows. */
static int add_mesh(vgi_json *meshes, const vgi_gltf_scene *x, size_t node, const vgi_gltf_cast *k, vg_err *e)
{
    const vgi_json *old;
    int r = vgi_gltf_item(&x->g, vgi_json_get(x->nodes[node].json, "mesh"), "meshes", &old, NULL, e);
    vgi_json *mesh = r == VG_OK ? vgi_json_copy(old, e) : NULL, *primitives = NULL;
    if (r == VG_OK) r = vgi_json_add(meshes, mesh, e);
    if (r == VG_OK) r = vgi_json_put(mesh, "primitives", primitives = vgi_json_array(e), e);
    for (size_t i = 0; i < x->npieces && r == VG_OK; i++)
        if (x->parts[x->pieces[i].part].node == node) r = add_primitive(primitives, x, &x->pieces[i], k, e);
    if (r < 0 || k->own_targets) return r;
    vgi_json_drop(mesh, "weights");
    vgi_json_drop(vgi_json_inner(mesh, "extras"), "targetNames");
    if (r == VG_OK && k->targets) r = add_weights(mesh, x, node, k, e);
    return r == VG_OK && k->targets ? add_names(mesh, k->names, e) : r;
}

/* ---- nodes ---- */

static void drop_instancing(vgi_json *holder)
{
    static const char key[] = "extensions";
    vgi_json_drop(vgi_json_inner(holder, key), "EXT_mesh_gpu_instancing");
    if (vgi_json_get(holder, key) && !vgi_json_key(vgi_json_get(holder, key), NULL)) vgi_json_drop(holder, key);
}

/* A separate mesh for each node that shows one; other scenes get none. */
static int cast_nodes(vgi_json *doc, const vgi_gltf_scene *x, const vgi_gltf_cast *k, vg_err *e)
{
    vgi_json *nodes = vgi_json_inner(doc, "nodes"), *meshes = vgi_json_array(e);
    size_t mesh;
    int r = vgi_json_put(doc, "meshes", meshes, e);
    for (size_t i = 0; i < x->nnodes && r == VG_OK; i++) {
        vgi_json *node = vgi_json_inner_at(nodes, i);
        drop_instancing(node);
        if (!k->own_targets) vgi_json_drop(node, "weights");
        if (!shows_mesh(x, i, &mesh)) {
            vgi_json_drop(node, "mesh");
            vgi_json_drop(node, "skin");
            continue;
        }
        r = put_number(node, "mesh", vgi_json_count(meshes), e);
        if (r == VG_OK) r = add_mesh(meshes, x, i, k, e);
    }
    return r;
}

static int drop_from_list(vgi_json *doc, const char *key, const char *gone, vg_err *e)
{
    const vgi_json *old = vgi_json_get(doc, key);
    vgi_json *list = vgi_json_array(e);
    int r = list ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(old) && r == VG_OK; i++) {
        const char *name = vgi_json_text(vgi_json_at(old, i));
        if (name && strcmp(name, gone)) r = vgi_json_add(list, vgi_json_of_text(name, e), e);
    }
    if (r == VG_OK && vgi_json_count(list)) return vgi_json_put(doc, key, list, e);
    vgi_json_free(&list);
    vgi_json_drop(doc, key);
    return r;
}

static int say_members(vgi_gltf_writing *w, const vgi_json *doc, vg_err *e)
{
    int r = VG_OK;
    bool first = true;
    for (const char *key = vgi_json_key(doc, NULL); key && r == VG_OK; key = vgi_json_key(doc, key), first = false) {
        if (!first) r = vgi_gltf_say(&w->json, e, ",\n");
        if (r == VG_OK) r = vgi_gltf_say_text(&w->json, key, e);
        if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ":");
        if (r == VG_OK) r = vgi_json_print(vgi_json_get(doc, key), &w->json, e);
    }
    return r;
}

/* Members that the writer makes. */
static void drop_made(vgi_json *doc)
{
    static const char *const made[] = {"asset", "accessors", "bufferViews", "buffers"};
    for (size_t i = 0; i < sizeof made / sizeof *made; i++) vgi_json_drop(doc, made[i]);
}

int vgi_gltf_say_whole(vgi_gltf_writing *w, vg_err *e)
{
    vgi_json *doc = vgi_json_copy(w->character->scene.g.json, e);
    if (!doc) return VG_ENOMEM;
    drop_made(doc);
    int r = say_members(w, doc, e);
    vgi_json_free(&doc);
    return r;
}

int vgi_gltf_say_cast(vgi_gltf_writing *w, const vgi_gltf_cast *k, vg_err *e)
{
    static const char instancing[] = "EXT_mesh_gpu_instancing", pointers[] = "KHR_animation_pointer";
    vgi_json *doc = vgi_json_copy(w->character->scene.g.json, e);
    int r = doc ? vgi_gltf_list_shapes(&w->character->scene, e) : VG_ENOMEM;
    if (doc) drop_made(doc);
    if (doc && !w->still) vgi_json_drop(doc, "animations"); /* which are written with the others */
    if (r == VG_OK) r = drop_from_list(doc, "extensionsUsed", instancing, e);
    if (r == VG_OK) r = drop_from_list(doc, "extensionsRequired", instancing, e);
    const bool animated = vgi_json_get(w->character->scene.g.json, "animations");
    if (r == VG_OK && !animated) r = drop_from_list(doc, "extensionsUsed", pointers, e);
    if (r == VG_OK && !animated) r = drop_from_list(doc, "extensionsRequired", pointers, e);
    if (r == VG_OK) r = cast_nodes(doc, &w->character->scene, k, e);
    if (r == VG_OK) r = vgi_gltf_raise_skins(&w->character->scene, doc, e);
    if (r == VG_OK && k->ngrids) r = vgi_gltf_put_grids(doc, k->grids, k->ngrids, e);
    if (r == VG_OK) r = say_members(w, doc, e);
    vgi_json_free(&doc);
    return r;
}
