/* gltf_shapes.c: combines the morph targets of several meshes into shapes of the whole: head, teeth and body of a
 * character have different lists, and targets with the same name belong together. Targets are applied in gltf_play.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_scene.h"

#include <stdlib.h>

/* Names are in the extras of the mesh, or of one of its primitives. */
static const vgi_json *names_of(const vgi_json *mesh)
{
    static const char key[] = "targetNames";
    const vgi_json *names = vgi_json_get(vgi_json_get(mesh, "extras"), key), *all = vgi_json_get(mesh, "primitives");
    for (size_t i = 0; !vgi_json_count(names) && i < vgi_json_count(all); i++)
        names = vgi_json_get(vgi_json_get(vgi_json_at(all, i), "extras"), key);
    return vgi_json_count(names) ? names : NULL;
}

/* The index of a name, or of occurrence `number` of a name that one mesh uses repeatedly. */
static int find_shape(vgi_gltf_scene *x, const char *name, size_t number, size_t *shape, vg_err *e)
{
    char head[32] = "";
    vg_bytes key = {0};
    if (number) snprintf(head, sizeof head, "\x01%zu\x01", number);
    int r = vgi_bytes_append(&key, head, strlen(head), e);
    if (r == VG_OK) r = vgi_bytes_append(&key, name, strlen(name) + 1, e);
    if (r == VG_OK) r = vgi_name_set_place(&x->shapes, (char *)key.data, shape, e);
    vg_bytes_clear(&key);
    return r;
}

/* Per shape: the last node that gave it a target, + 1, and how many times. */
typedef struct use {
    size_t node, times;
} use;

static int name_targets(vgi_gltf_scene *x, vgi_gltf_node *n, const vgi_json *names, use *uses, vg_err *e)
{
    const size_t node = (size_t)(n - x->nodes) + 1;
    int r = VG_OK;
    for (size_t t = 0; t < n->nweights && r == VG_OK; t++) {
        const char *name = vgi_json_text(vgi_json_at(names, t));
        if (!name) name = "";
        if ((r = find_shape(x, name, 0, &n->shape_of[t], e)) < 0) break;
        use *u = &uses[n->shape_of[t]];
        if (u->node == node) r = find_shape(x, name, ++u->times, &n->shape_of[t], e);
        else *u = (use){node, 0};
    }
    return r;
}

/* Without names the number identifies the shape, or appends a new one. */
static int number_targets(vgi_gltf_scene *x, vgi_gltf_node *n, vg_err *e)
{
    int r = VG_OK;
    for (size_t t = 0; t < n->nweights && r == VG_OK; t++) {
        n->shape_of[t] = t;
        if (t >= x->shapes.names.n) r = find_shape(x, "", t + 1, &n->shape_of[t], e);
    }
    return r;
}

int vgi_gltf_list_shapes(vgi_gltf_scene *x, vg_err *e)
{
    use *uses = vgi_array(x->targets + 1, sizeof *uses, e);
    int r = uses ? VG_OK : VG_ENOMEM;
    for (int named = 1; named >= 0; named--)
        for (size_t i = 0; i < x->nnodes && r == VG_OK; i++) {
            vgi_gltf_node *n = &x->nodes[i];
            const vgi_json *mesh;
            if (!n->nweights) continue;
            r = vgi_gltf_item(&x->g, vgi_json_get(n->json, "mesh"), "meshes", &mesh, NULL, e);
            const vgi_json *names = r == VG_OK ? names_of(mesh) : NULL;
            if (r == VG_OK && names && named) r = name_targets(x, n, names, uses, e);
            if (r == VG_OK && !names && !named) r = number_targets(x, n, e);
        }
    free(uses);
    return r;
}

const char *vgi_gltf_shape_name(const vgi_gltf_scene *x, size_t shape)
{
    const char *name = x->shapes.names.at[shape], *behind = *name == '\x01' ? strchr(name + 1, '\x01') : NULL;
    return behind ? behind + 1 : name;
}
