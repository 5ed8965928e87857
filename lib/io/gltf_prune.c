/* gltf_prune.c: removes from a document of glTF the accessors and buffer views that nothing uses, and gathers the bytes
 * of the others.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_prune.h"

#include <stdlib.h>

enum { ALIGNED = 8 };

/* Both lists have the new number + 1 of each item; 0: not used. */
typedef struct pruning {
    vgi_gltf *g;
    const vgi_gltf_pruned *which;
    size_t *accessor, *view;
    bool numbered; /* first everything is marked, then all references are renumbered */
    vg_err *e;
} pruning;

static size_t count_items(const pruning *k, const char *list)
{
    return vgi_json_count(vgi_json_get(k->g->json, list));
}

/* A reference to an item of one of the lists. */
static int refer(pruning *k, vgi_json *holder, const char *key, size_t *list, size_t n)
{
    uint64_t i;
    if (!vgi_json_whole(vgi_json_get(holder, key), &i) || i >= n) return VG_OK;
    if (!k->numbered) list[i] = 1;
    else return vgi_json_put(holder, key, vgi_json_of_whole(list[i] ? list[i] - 1 : 0, k->e), k->e);
    return VG_OK;
}

static int refer_to_accessor(pruning *k, vgi_json *holder, const char *key)
{
    return refer(k, holder, key, k->accessor, count_items(k, "accessors"));
}

static int refer_to_view(pruning *k, vgi_json *holder)
{
    return refer(k, holder, "bufferView", k->view, count_items(k, "bufferViews"));
}

static bool is_replaced(const pruning *k, const char *attribute)
{
    return k->which->replaced && (!strcmp(attribute, "POSITION") || !strcmp(attribute, "NORMAL"));
}

static int visit_attributes(pruning *k, vgi_json *attributes, bool base)
{
    int r = VG_OK;
    for (const char *key = vgi_json_key(attributes, NULL); key && r == VG_OK; key = vgi_json_key(attributes, key))
        if (k->numbered || !base || !is_replaced(k, key)) r = refer_to_accessor(k, attributes, key);
    return r;
}

static int visit_mesh(pruning *k, vgi_json *mesh)
{
    vgi_json *primitives = vgi_json_inner(mesh, "primitives");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(primitives) && r == VG_OK; i++) {
        vgi_json *primitive = vgi_json_inner_at(primitives, i), *targets = vgi_json_inner(primitive, "targets");
        const bool base = !vgi_json_count(targets); /* with targets of their own they stay */
        r = visit_attributes(k, vgi_json_inner(primitive, "attributes"), base);
        if (r == VG_OK) r = refer_to_accessor(k, primitive, "indices");
        for (size_t t = 0; t < vgi_json_count(targets) && r == VG_OK; t++)
            r = visit_attributes(k, vgi_json_inner_at(targets, t), false);
    }
    return r;
}

static int visit_node(pruning *k, vgi_json *node)
{
    vgi_json *instances = vgi_json_inner(vgi_json_inner(node, "extensions"), "EXT_mesh_gpu_instancing");
    return visit_attributes(k, vgi_json_inner(instances, "attributes"), false);
}

static int visit_skins(pruning *k)
{
    vgi_json *all = vgi_json_inner(k->g->json, "skins");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(all) && r == VG_OK; i++)
        if (k->numbered || !k->which->bound || !k->which->bound[i])
            r = refer_to_accessor(k, vgi_json_inner_at(all, i), "inverseBindMatrices");
    return r;
}

static int visit_animation(pruning *k, vgi_json *animation)
{
    vgi_json *samplers = vgi_json_inner(animation, "samplers");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(samplers) && r == VG_OK; i++) {
        r = refer_to_accessor(k, vgi_json_inner_at(samplers, i), "input");
        if (r == VG_OK) r = refer_to_accessor(k, vgi_json_inner_at(samplers, i), "output");
    }
    return r;
}

static int visit_accessor(pruning *k, vgi_json *accessor)
{
    vgi_json *sparse = vgi_json_inner(accessor, "sparse");
    int r = refer_to_view(k, accessor);
    if (r == VG_OK) r = refer_to_view(k, vgi_json_inner(sparse, "indices"));
    return r < 0 ? r : refer_to_view(k, vgi_json_inner(sparse, "values"));
}

/* used (may be NULL): which items of the list. */
static int visit_list(pruning *k, const char *list, const bool *used, int (*visit)(pruning *, vgi_json *))
{
    vgi_json *all = vgi_json_inner(k->g->json, list);
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(all) && r == VG_OK; i++)
        if (!used || used[i]) r = visit(k, vgi_json_inner_at(all, i));
    return r;
}

static int visit_accessors(pruning *k)
{
    vgi_json *all = vgi_json_inner(k->g->json, "accessors");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(all) && r == VG_OK; i++)
        if (k->accessor[i]) r = visit_accessor(k, vgi_json_inner_at(all, i));
    return r;
}

static int visit_all(pruning *k)
{
    int r = visit_list(k, "meshes", k->which->meshes, visit_mesh);
    if (r == VG_OK) r = visit_list(k, "nodes", NULL, visit_node);
    if (r == VG_OK) r = visit_skins(k);
    if (r == VG_OK) r = visit_list(k, "animations", NULL, visit_animation);
    if (r == VG_OK) r = visit_list(k, "images", NULL, refer_to_view);
    return r < 0 ? r : visit_accessors(k);
}

static void number_used(size_t *list, size_t n)
{
    for (size_t i = 0, used = 0; i < n; i++)
        if (list[i]) list[i] = ++used;
}

/* The bytes of a view, of whatever buffer, are appended to the only buffer that there will be. */
static int move_view(pruning *k, const vgi_json *old, size_t number, vgi_json *views, vg_bytes *to)
{
    static const unsigned char zeros[ALIGNED];
    const unsigned char *data = NULL;
    size_t n = 0;
    vgi_json *ref = vgi_json_of_whole(number, k->e), *view = vgi_json_copy(old, k->e);
    int r = ref ? vgi_gltf_view_bytes(k->g, ref, &data, &n, k->e) : VG_ENOMEM;
    vgi_json_free(&ref);
    if (r < 0) vgi_json_free(&view);
    if (r == VG_OK) r = vgi_json_add(views, view, k->e);
    if (r == VG_OK) r = vgi_bytes_append(to, zeros, (ALIGNED - to->size % ALIGNED) % ALIGNED, k->e);
    if (r == VG_OK) r = vgi_json_put(view, "buffer", vgi_json_of_whole(0, k->e), k->e);
    if (r == VG_OK) r = vgi_json_put(view, "byteOffset", vgi_json_of_whole(to->size, k->e), k->e);
    return r < 0 ? r : vgi_bytes_append(to, data, n, k->e);
}

static int keep_views(pruning *k, vg_bytes *to)
{
    static const char list[] = "bufferViews";
    static const unsigned char zeros[ALIGNED];
    const vgi_json *old = vgi_json_get(k->g->json, list);
    vgi_json *kept = vgi_json_array(k->e);
    int r = kept ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(old) && r == VG_OK; i++)
        if (k->view[i]) r = move_view(k, vgi_json_at(old, i), i, kept, to);
    if (r == VG_OK) r = vgi_bytes_append(to, zeros, (ALIGNED - to->size % ALIGNED) % ALIGNED, k->e);
    if (r == VG_OK) return vgi_json_put(k->g->json, list, kept, k->e);
    vgi_json_free(&kept);
    return r;
}

static int keep_accessors(pruning *k)
{
    static const char list[] = "accessors";
    const vgi_json *old = vgi_json_get(k->g->json, list);
    vgi_json *kept = vgi_json_array(k->e);
    int r = kept ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(old) && r == VG_OK; i++)
        if (k->accessor[i]) r = vgi_json_add(kept, vgi_json_copy(vgi_json_at(old, i), k->e), k->e);
    if (r == VG_OK) return vgi_json_put(k->g->json, list, kept, k->e);
    vgi_json_free(&kept);
    return r;
}

int vgi_gltf_prune(vgi_gltf *g, const vgi_gltf_pruned *which, vg_bytes *to, vg_err *e)
{
    pruning k = {.g = g, .which = which, .e = e};
    const size_t accessors = count_items(&k, "accessors"), views = count_items(&k, "bufferViews");
    k.accessor = vgi_array(accessors, sizeof *k.accessor, e), k.view = vgi_array(views, sizeof *k.view, e);
    int r = k.accessor && k.view ? visit_all(&k) : VG_ENOMEM;
    if (r == VG_OK) {
        number_used(k.accessor, accessors), number_used(k.view, views);
        k.numbered = true;
        r = visit_all(&k);
    }
    if (r == VG_OK) r = keep_views(&k, to);
    if (r == VG_OK) r = keep_accessors(&k);
    free(k.accessor);
    free(k.view);
    return r;
}
