/* gltf_roots.c: nodes with a skin become roots of their scenes, as the Khronos validator recommends: joints alone place their
 * vertices, so that nothing that is shown changes. They keep their numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_roots.h"

#include <stdlib.h>

/* Whether a channel moves the node itself. */
static bool moves_node(const vgi_json *channel, size_t node)
{
    const vgi_json *target = vgi_json_get(channel, "target");
    const vgi_json *pointer = vgi_json_get(vgi_json_get(target, "extensions"), "KHR_animation_pointer");
    const char *path = vgi_json_text(vgi_json_get(target, "path")), *at = vgi_json_text(vgi_json_get(pointer, "pointer"));
    char start[40];
    uint64_t number;
    snprintf(start, sizeof start, "/nodes/%zu/", node);
    if (at && !strncmp(at, start, strlen(start))) return true;
    return path && strcmp(path, "weights") != 0 && vgi_json_whole(vgi_json_get(target, "node"), &number) && number == node;
}

static bool is_animated(const vgi_json *doc, size_t node)
{
    const vgi_json *all = vgi_json_get(doc, "animations");
    for (size_t i = 0; i < vgi_json_count(all); i++) {
        const vgi_json *channels = vgi_json_get(vgi_json_at(all, i), "channels");
        for (size_t c = 0; c < vgi_json_count(channels); c++)
            if (moves_node(vgi_json_at(channels, c), node)) return true;
    }
    return false;
}

static bool is_joint(const vgi_gltf_scene *x, size_t node)
{
    for (size_t s = 0; s < x->nskins; s++)
        for (size_t j = 0; j < x->skins[s].n; j++)
            if (x->skins[s].joints[j] == node) return true;
    return false;
}

static bool has_weight(const vgi_gltf_part *p, size_t v)
{
    double shares[4];
    for (size_t s = 0; s < p->nsets; s++) {
        vgi_accessor_get(&p->shares[s], v, shares);
        if (shares[0] != 0 || shares[1] != 0 || shares[2] != 0 || shares[3] != 0) return true;
    }
    return false;
}

/* Whether joints place all vertices of the node's mesh. */
static bool is_placed_by_joints(const vgi_gltf_scene *x, size_t node)
{
    for (size_t i = 0; i < x->nparts; i++)
        for (size_t v = 0; x->parts[i].node == node && v < x->parts[i].count; v++)
            if (!has_weight(&x->parts[i], v)) return false;
    return true;
}

/* Extensions of the nodes above may concern all below, such as their visibility. */
static bool inherits(const vgi_gltf_scene *x, size_t node)
{
    for (size_t i = x->nodes[node].parent; i != SIZE_MAX; i = x->nodes[i].parent)
        if (vgi_json_get(x->nodes[i].json, "extensions")) return true;
    return false;
}

static bool can_move(const vgi_gltf_scene *x, const vgi_json *doc, size_t node)
{
    const vgi_gltf_node *n = &x->nodes[node];
    const vgi_json *json = vgi_json_at(vgi_json_get(doc, "nodes"), node);
    return n->shown && n->parent != SIZE_MAX && vgi_json_get(json, "mesh") && vgi_json_get(json, "skin") &&
           !vgi_json_get(json, "children") && !inherits(x, node) && !is_joint(x, node) && !is_animated(doc, node) &&
           is_placed_by_joints(x, node);
}

/* ---- lists of nodes ---- */

/* Replace the list: without a node, or with one more behind another. */
static int edit_list(vgi_json *holder, const char *key, size_t without, size_t behind, size_t with, vg_err *e)
{
    const vgi_json *old = vgi_json_get(holder, key);
    vgi_json *list = vgi_json_array(e);
    int r = list ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(old) && r == VG_OK; i++) {
        uint64_t node = 0;
        vgi_json_whole(vgi_json_at(old, i), &node);
        if (node != without) r = vgi_json_add(list, vgi_json_of_whole(node, e), e);
        if (r == VG_OK && node == behind) r = vgi_json_add(list, vgi_json_of_whole(with, e), e);
    }
    if (r == VG_OK && vgi_json_count(list)) return vgi_json_put(holder, key, list, e);
    vgi_json_free(&list);
    if (r == VG_OK) vgi_json_drop(holder, key);
    return r;
}

/* The root is followed by nodes that were below it already: the next one comes behind them, so that they keep their order. */
static int move_to_root(const vgi_gltf_scene *x, vgi_json *doc, size_t node, size_t *last, vg_err *e)
{
    static const char *const gone[] = {"matrix", "translation", "rotation", "scale"};
    vgi_json *nodes = vgi_json_inner(doc, "nodes"), *scenes = vgi_json_inner(doc, "scenes");
    size_t root = node;
    while (x->nodes[root].parent != SIZE_MAX) root = x->nodes[root].parent;
    int r = edit_list(vgi_json_inner_at(nodes, x->nodes[node].parent), "children", node, SIZE_MAX, 0, e);
    for (size_t i = 0; i < vgi_json_count(scenes) && r == VG_OK; i++)
        r = edit_list(vgi_json_inner_at(scenes, i), "nodes", SIZE_MAX, last[root], node, e);
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++) vgi_json_drop(vgi_json_inner_at(nodes, node), gone[i]);
    last[root] = node;
    return r;
}

int vgi_gltf_raise_skins(const vgi_gltf_scene *x, vgi_json *doc, vg_err *e)
{
    size_t *last = vgi_array_raw(x->nnodes, sizeof *last, e);
    int r = last ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < x->nnodes && r == VG_OK; i++) last[i] = i;
    for (size_t i = 0; i < x->nnodes && r == VG_OK; i++)
        if (can_move(x, doc, i)) r = move_to_root(x, doc, i, last, e);
    free(last);
    return r;
}
