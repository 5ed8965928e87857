/* gltf_scene.c: what a glTF scene shows: nodes, skins, and the vertices and faces of its meshes. Welding is in
 * gltf_weld.c, motion in gltf_clips.c and gltf_play.c. Cameras, materials and normals are not read.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_scene.h"

#include <math.h>
#include <stdlib.h>

void vgi_gltf_local_matrix(const vgi_gltf_placed *p, double m[12])
{
    const double *q = p->rotation;
    double r[9];
    double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double unit[4] = {length > 0 ? q[3] / length : 1, length > 0 ? q[0] / length : 0,
                            length > 0 ? q[1] / length : 0, length > 0 ? q[2] / length : 0};
    vg_quat_matrix(unit, r);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) m[4 * i + j] = r[3 * i + j] * p->scale[j];
        m[4 * i + 3] = p->translation[i];
    }
}

void vgi_gltf_from_columns(const double c[16], double m[12])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) m[4 * i + j] = c[4 * j + i];
}

/* ---- nodes ---- */

/* A list of n numbers that may be absent. */
static int take_numbers(const vgi_gltf_scene *x, const vgi_json *from, const char *key, size_t n, double *to,
                        vg_err *e)
{
    const vgi_json *list = vgi_json_get(from, key);
    if (!list) return VG_OK;
    bool good = vgi_json_count(list) == n;
    for (size_t i = 0; i < n && good; i++) good = vgi_json_number(vgi_json_at(list, i), &to[i]);
    return good ? VG_OK : vgi_gltf_bad(&x->g, e, "a node's or mesh's '%s' is not %zu numbers", key, n);
}

static int read_node(vgi_gltf_scene *x, vgi_gltf_node *n, vg_err *e)
{
    double columns[16];
    n->rest = (vgi_gltf_placed){.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};
    n->fixed = vgi_json_get(n->json, "matrix");
    int r = take_numbers(x, n->json, "matrix", 16, columns, e);
    if (r == VG_OK && n->fixed) vgi_gltf_from_columns(columns, n->matrix);
    if (r == VG_OK) r = take_numbers(x, n->json, "translation", 3, n->rest.translation, e);
    if (r == VG_OK) r = take_numbers(x, n->json, "rotation", 4, n->rest.rotation, e);
    if (r == VG_OK) r = take_numbers(x, n->json, "scale", 3, n->rest.scale, e);
    n->now = n->rest;
    return r;
}

static int adopt_children(vgi_gltf_scene *x, size_t parent, vg_err *e)
{
    const vgi_json *children = vgi_json_get(x->nodes[parent].json, "children"), *child;
    for (size_t i = 0; i < vgi_json_count(children); i++) {
        size_t number = 0;
        int r = vgi_gltf_item(&x->g, vgi_json_at(children, i), "nodes", &child, &number, e);
        if (r < 0) return r;
        if (x->nodes[number].parent != SIZE_MAX) return vgi_gltf_bad(&x->g, e, "node %zu has two parents", number);
        x->nodes[number].parent = parent;
    }
    return VG_OK;
}

/* Parents before children; nodes in a cycle are never reached. */
static int order_nodes(vgi_gltf_scene *x, vg_err *e)
{
    size_t n = 0;
    for (size_t i = 0; i < x->nnodes; i++)
        if (x->nodes[i].parent == SIZE_MAX) x->order[n++] = i;
    for (size_t i = 0; i < n; i++) {
        const vgi_json *children = vgi_json_get(x->nodes[x->order[i]].json, "children");
        for (size_t c = 0; c < vgi_json_count(children); c++) {
            uint64_t number;
            if (vgi_json_whole(vgi_json_at(children, c), &number)) x->order[n++] = (size_t)number;
        }
    }
    return n == x->nnodes ? VG_OK : vgi_gltf_bad(&x->g, e, "its nodes are in a cycle");
}

static double affine_determinant(const double m[12])
{
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
           m[2] * (m[4] * m[9] - m[5] * m[8]);
}

/* Whether a node mirrors, by itself and with all above it. Rotations do not. */
static void find_mirrors(vgi_gltf_scene *x)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        vgi_gltf_node *n = &x->nodes[x->order[i]];
        const double *s = n->rest.scale;
        const bool here = n->fixed ? affine_determinant(n->matrix) < 0 : (s[0] < 0) ^ (s[1] < 0) ^ (s[2] < 0);
        n->mirrors = here ^ (n->parent != SIZE_MAX && x->nodes[n->parent].mirrors);
    }
}

/* Mark what the scene shows; without scenes, everything. */
static int show_nodes(vgi_gltf_scene *x, vg_err *e)
{
    static const char scenes[] = "scenes";
    const vgi_json *scene = NULL, *chosen = vgi_json_get(x->g.json, "scene"), *list = vgi_json_get(x->g.json, scenes);
    int r = chosen ? vgi_gltf_item(&x->g, chosen, scenes, &scene, NULL, e) : VG_OK;
    if (r == VG_OK && !chosen) scene = vgi_json_at(list, 0);
    const vgi_json *roots = vgi_json_get(scene, "nodes"), *item;
    for (size_t i = 0; i < vgi_json_count(roots) && r == VG_OK; i++) {
        size_t number = 0;
        r = vgi_gltf_item(&x->g, vgi_json_at(roots, i), "nodes", &item, &number, e);
        if (r == VG_OK) x->nodes[number].shown = true;
    }
    for (size_t i = 0; i < x->nnodes; i++) {
        vgi_gltf_node *n = &x->nodes[x->order[i]];
        n->shown |= !scene || (n->parent != SIZE_MAX && x->nodes[n->parent].shown);
    }
    return r;
}

static int read_nodes(vgi_gltf_scene *x, vg_err *e)
{
    const vgi_json *list = vgi_json_get(x->g.json, "nodes");
    size_t n = vgi_json_count(list);
    x->nodes = vgi_array(n, sizeof *x->nodes, e), x->order = vgi_array(n, sizeof *x->order, e);
    if (!x->nodes || !x->order) return VG_ENOMEM;
    x->nnodes = n;
    int r = VG_OK;
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        x->nodes[i] = (vgi_gltf_node){.json = vgi_json_at(list, i), .parent = SIZE_MAX};
        r = read_node(x, &x->nodes[i], e);
    }
    for (size_t i = 0; i < n && r == VG_OK; i++) r = adopt_children(x, i, e);
    if (r == VG_OK) r = order_nodes(x, e);
    if (r == VG_OK) find_mirrors(x);
    return r < 0 ? r : show_nodes(x, e);
}

/* Mark a node and all above it as moving a vertex. */
static void mark(vgi_gltf_scene *x, size_t i)
{
    for (; i != SIZE_MAX && !x->nodes[i].matters; i = x->nodes[i].parent) x->nodes[i].matters = true;
}

static void mark_joints(vgi_gltf_scene *x, vgi_gltf_skin *k)
{
    for (size_t j = 0; !k->used && j < k->n; j++) mark(x, k->joints[j]);
    k->used = true;
}

/* ---- skins ---- */

static int read_skin(vgi_gltf_scene *x, vgi_gltf_skin *k, const vgi_json *from, vg_err *e)
{
    const vgi_json *joints = vgi_json_get(from, "joints"), *item,
                   *inverse = vgi_json_get(from, "inverseBindMatrices");
    k->n = vgi_json_count(joints);
    if (k->n == 0) return vgi_gltf_bad(&x->g, e, "a skin has no joints");
    k->joints = vgi_array(k->n, sizeof *k->joints, e), k->matrices = vgi_array(k->n, 12 * sizeof(double), e);
    int r = k->joints && k->matrices ? VG_OK : VG_ENOMEM;
    for (size_t j = 0; j < k->n && r == VG_OK; j++)
        r = vgi_gltf_item(&x->g, vgi_json_at(joints, j), "nodes", &item, &k->joints[j], e);
    k->bound = inverse;
    if (r == VG_OK && inverse)
        r = vgi_gltf_accessor(&x->g, inverse, 16, k->n, "inverse bind matrices", &k->inverse, e);
    return r;
}

static int read_skins(vgi_gltf_scene *x, vg_err *e)
{
    const vgi_json *list = vgi_json_get(x->g.json, "skins");
    size_t n = vgi_json_count(list);
    if (!(x->skins = vgi_array(n, sizeof *x->skins, e))) return VG_ENOMEM;
    int r = VG_OK;
    while (x->nskins < n && r == VG_OK) {
        vgi_gltf_skin *k = &x->skins[x->nskins];
        r = read_skin(x, k, vgi_json_at(list, x->nskins++), e);
    }
    return r;
}

/* ---- parts ---- */

static int read_targets(vgi_gltf_scene *x, vgi_gltf_part *p, vg_err *e)
{
    const size_t n = vgi_json_count(p->targets);
    if (n != x->nodes[p->node].nweights)
        return vgi_gltf_bad(&x->g, e, "the primitives of a mesh have different numbers of morph targets");
    if (n > vgi_gltf_most_targets - x->targets)
        return vgi_gltf_bad(&x->g, e, "it shows more than %zu morph targets", vgi_gltf_most_targets);
    x->targets += n;
    if (!(p->moved = vgi_array(n, sizeof *p->moved, e))) return VG_ENOMEM;
    p->ntargets = n;
    int r = VG_OK;
    for (size_t t = 0; t < n && r == VG_OK; t++) {
        const vgi_json *ref = vgi_json_get(vgi_json_at(p->targets, t), "POSITION");
        if (ref) r = vgi_gltf_accessor(&x->g, ref, 3, p->count, "a morph target", &p->moved[t], e);
        else p->moved[t] = (vgi_accessor){.count = p->count, .width = 3, .component = VGI_GLTF_FLOAT};
    }
    return r;
}

static int check_joints(const vgi_gltf_scene *x, const vgi_gltf_part *p, const vgi_accessor *joints, vg_err *e)
{
    double n = (double)x->skins[p->skin].n, j[4];
    for (size_t i = 0; i < p->count; i++) {
        vgi_accessor_get(joints, i, j);
        if (!(j[0] < n && j[1] < n && j[2] < n && j[3] < n))
            return vgi_gltf_bad(&x->g, e, "a vertex refers to a joint that its skin does not have");
    }
    return VG_OK;
}

static int read_influences(vgi_gltf_scene *x, vgi_gltf_part *p, vg_err *e)
{
    int r = VG_OK;
    for (; r == VG_OK; p->nsets++) {
        char joints[32], weights[32];
        snprintf(joints, sizeof joints, "JOINTS_%zu", p->nsets);
        snprintf(weights, sizeof weights, "WEIGHTS_%zu", p->nsets);
        const vgi_json *j = vgi_json_get(p->attributes, joints), *w = vgi_json_get(p->attributes, weights);
        if (!j || !w) break;
        if (p->nsets == VGI_GLTF_SETS)
            return vgi_gltf_bad(&x->g, e, "vertices have more than %d joints", 4 * VGI_GLTF_SETS);
        vgi_accessor *a = &p->joints[p->nsets];
        r = vgi_gltf_accessor(&x->g, j, 4, p->count, "joints", a, e);
        if (r == VG_OK && !vgi_accessor_is_index(a))
            r = vgi_gltf_bad(&x->g, e, "the joints of a vertex are not integers");
        if (r == VG_OK) r = check_joints(x, p, a, e);
        if (r == VG_OK) r = vgi_gltf_accessor(&x->g, w, 4, p->count, "weights", &p->shares[p->nsets], e);
    }
    return r;
}

/* Transforms of the instances of a node's mesh, and whether they mirror it. */
typedef struct instances {
    size_t n; /* 0: the node shows its mesh once */
    vgi_accessor translation, rotation, scale;
    bool moved, turned, scaled;
} instances;

static int read_instance_list(const vgi_gltf_scene *x, const vgi_json *attributes, const char *key, size_t width,
                              vgi_accessor *a, bool *there, size_t *n, vg_err *e)
{
    const vgi_json *ref = vgi_json_get(attributes, key);
    int r = ref ? vgi_gltf_accessor(&x->g, ref, width, *n, "instances", a, e) : VG_OK;
    *there = ref;
    if (r == VG_OK && ref) *n = a->count;
    return r;
}

static int read_instances(vgi_gltf_scene *x, const vgi_json *node, instances *k, vg_err *e)
{
    const vgi_json *ext = vgi_json_get(vgi_json_get(node, "extensions"), "EXT_mesh_gpu_instancing");
    const vgi_json *attributes = vgi_json_get(ext, "attributes");
    *k = (instances){0};
    int r = read_instance_list(x, attributes, "TRANSLATION", 3, &k->translation, &k->moved, &k->n, e);
    if (r == VG_OK) r = read_instance_list(x, attributes, "ROTATION", 4, &k->rotation, &k->turned, &k->n, e);
    if (r == VG_OK) r = read_instance_list(x, attributes, "SCALE", 3, &k->scale, &k->scaled, &k->n, e);
    if (r < 0) return r;
    if (k->n > vgi_gltf_most_instances - x->instances)
        return vgi_gltf_bad(&x->g, e, "it shows more than %zu instances", vgi_gltf_most_instances);
    x->instances += k->n;
    return VG_OK;
}

/* Write the transform of instance i (from 1; 0: the mesh itself) to the place of a part. Returns whether it
 * mirrors. */
static bool place_instance(const instances *k, size_t i, double place[12])
{
    vgi_gltf_placed p = {.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};
    if (i && k->moved) vgi_accessor_get(&k->translation, i - 1, p.translation);
    if (i && k->turned) vgi_accessor_get(&k->rotation, i - 1, p.rotation);
    if (i && k->scaled) vgi_accessor_get(&k->scale, i - 1, p.scale);
    vgi_gltf_local_matrix(&p, place);
    return (p.scale[0] < 0) ^ (p.scale[1] < 0) ^ (p.scale[2] < 0);
}

/* The first set of texture coordinates. A malformed set is dropped. */
static void read_uv(vgi_gltf_scene *x, vgi_gltf_part *p)
{
    const vgi_json *ref = vgi_json_get(p->attributes, "TEXCOORD_0");
    if (!ref) return;
    p->textured = vgi_gltf_accessor(&x->g, ref, 2, p->count, "texture coordinates", &p->uv, NULL) == VG_OK;
    if (!p->textured && !strstr(x->note.text, "texture coord")) vgi_note(&x->note, "left out malformed texture "
                                                                                   "coordinates");
    p->first_uv = x->nuv;
    if (p->textured) x->nuv += p->count;
}

static int add_part(vgi_gltf_scene *x, size_t at, int64_t skinned, const vgi_json *primitive, vg_err *e)
{
    int r = vgi_grow(&x->parts, &x->parts_cap, x->nparts + 1, sizeof *x->parts, e);
    if (r < 0) return r;
    vgi_gltf_part *p = &x->parts[x->nparts++];
    *p = (vgi_gltf_part){.node = at,
                         .first = x->all,
                         .skin = skinned,
                         .attributes = vgi_json_get(primitive, "attributes"),
                         .targets = vgi_json_get(primitive, "targets")};
    r = vgi_gltf_accessor(&x->g, vgi_json_get(p->attributes, "POSITION"), 3, 0, "positions", &p->position, e);
    if (r < 0) return r;
    p->count = p->position.count;
    if (p->count > vgi_gltf_most - x->all)
        return vgi_gltf_bad(&x->g, e, "it shows more than %zu vertices", vgi_gltf_most);
    x->all += p->count;
    read_uv(x, p);
    r = read_targets(x, p, e);
    return r < 0 || p->skin == VGI_GLTF_NONE ? r : read_influences(x, p, e);
}

/* Primitives of a mesh may share their vertices: find the part that has them among the last ones, from `from` on. If
 * none is found, welding still merges them. */
static vgi_gltf_part *sharing(const vgi_gltf_scene *x, size_t from, const vgi_json *primitive)
{
    enum { LOOK_BACK = 64 };
    for (size_t i = x->nparts - from > LOOK_BACK ? x->nparts - LOOK_BACK : from; i < x->nparts; i++)
        if (vgi_json_same(x->parts[i].attributes, vgi_json_get(primitive, "attributes")) &&
            vgi_json_same(x->parts[i].targets, vgi_json_get(primitive, "targets")))
            return &x->parts[i];
    return NULL;
}

/* ---- faces, before welding ---- */

static int corner(const vgi_gltf_scene *x, const vgi_gltf_faces *f, size_t i, uint32_t *to, vg_err *e)
{
    double v = (double)i;
    if (f->indexed) vgi_accessor_get(&f->index, i, &v);
    if (v >= (double)f->part->count)
        return vgi_gltf_bad(&x->g, e, "an index is %.0f, but there are %zu vertices", v, f->part->count);
    *to = (uint32_t)(f->part->first + (size_t)v);
    return VG_OK;
}

static int add_face(const vgi_gltf_scene *x, vgi_gltf_faces *f, const size_t *at, size_t n, vg_err *e)
{
    vg_mesh *m = &f->mesh;
    size_t corners = vg_mesh_corners(m);
    if (corners > vgi_gltf_most) return vgi_gltf_bad(&x->g, e, "it shows more than %zu corners", vgi_gltf_most);
    int r = vgi_grow(&m->start, &f->start_cap, m->nf + 2, sizeof *m->start, e);
    if (r == VG_OK) r = vgi_grow(&m->vert, &f->vert_cap, corners + n, sizeof *m->vert, e);
    for (size_t k = 0; k < n && r == VG_OK; k++) r = corner(x, f, at[k], &m->vert[corners + k], e);
    if (r < 0) return r;
    m->start[m->nf] = (uint32_t)corners;
    m->start[++m->nf] = (uint32_t)(corners + n);
    return VG_OK;
}

static int add_faces(const vgi_gltf_scene *x, vgi_gltf_faces *f, size_t n, uint64_t mode, vg_err *e)
{
    const bool lines = mode <= VGI_GLTF_LINE_STRIP;
    const size_t size = lines ? 2 : 3;
    const bool apart = mode == VGI_GLTF_LINES || mode == VGI_GLTF_TRIANGLES;
    size_t count = apart ? n / size : mode == VGI_GLTF_LINE_LOOP ? n : n >= size ? n - size + 1 : 0;
    int r = VG_OK;
    if (mode == VGI_GLTF_POINTS) return VG_OK;
    if (apart && n % size)
        return vgi_gltf_bad(&x->g, e, "%zu indices do not form complete %s", n, lines ? "lines" : "triangles");
    if (mode == VGI_GLTF_LINE_LOOP && n < 2) return vgi_gltf_bad(&x->g, e, "a loop has %zu vertices", n);
    for (size_t i = 0; i < count && r == VG_OK; i++) {
        const size_t a = apart ? size * i : i, odd = mode == VGI_GLTF_STRIP && i % 2;
        size_t at[3] = {mode == VGI_GLTF_FAN ? 0 : a, (a + 1 + odd) % n, a + 2 - odd};
        if (f->turned && !lines) {
            const size_t second = at[1];
            at[1] = at[2], at[2] = second;
        }
        r = add_face(x, f, at, size, e);
    }
    return r;
}

/* Name for the faces from the next one on. */
static int add_label(vgi_gltf_scene *x, size_t face, vg_label_kind kind, const char *text, vg_err *e)
{
    vg_attributes *a = &x->attributes;
    for (size_t i = a->nlabels; i-- > 0;)
        if (a->labels[i].kind == (uint32_t)kind) {
            if (!strcmp(a->labels[i].text, text)) return VG_OK;
            break;
        }
    int r = vgi_grow(&a->labels, &x->labels_cap, a->nlabels + 1, sizeof *a->labels, e);
    if (r < 0) return r;
    char *copy = vgi_copy_string(text, strlen(text), e);
    if (!copy) return VG_ENOMEM;
    a->labels[a->nlabels++] = (vg_label){face, kind, copy};
    return VG_OK;
}

/* Object: the node; material: that of the primitive; both only if named. */
static int label_faces(vgi_gltf_scene *x, const vgi_gltf_faces *f, const vgi_gltf_part *p, const vgi_json *primitive,
                       vg_err *e)
{
    const vgi_json *material = vgi_json_get(primitive, "material"), *item;
    const char *object = vgi_json_text(vgi_json_get(x->nodes[p->node].json, "name")), *name = NULL;
    if (material && vgi_gltf_item(&x->g, material, "materials", &item, NULL, NULL) == VG_OK)
        name = vgi_json_text(vgi_json_get(item, "name"));
    int r = object && *object ? add_label(x, f->mesh.nf, VG_LABEL_OBJECT, object, e) : VG_OK;
    return r == VG_OK && name && *name ? add_label(x, f->mesh.nf, VG_LABEL_MATERIAL, name, e) : r;
}

static int read_faces(vgi_gltf_scene *x, vgi_gltf_faces *f, const vgi_gltf_part *p, const vgi_json *primitive,
                      vg_err *e)
{
    const vgi_json *indices = vgi_json_get(primitive, "indices"), *given = vgi_json_get(primitive, "mode");
    uint64_t mode = VGI_GLTF_TRIANGLES;
    if (given && (!vgi_json_whole(given, &mode) || mode > VGI_GLTF_FAN))
        return vgi_gltf_bad(&x->g, e, "a primitive's mode is not known");
    x->strips |= mode > VGI_GLTF_TRIANGLES;
    f->part = p, f->indexed = indices;
    int r = indices ? vgi_gltf_accessor(&x->g, indices, 1, 0, "indices", &f->index, e) : VG_OK;
    if (r == VG_OK && indices && !vgi_accessor_is_index(&f->index))
        r = vgi_gltf_bad(&x->g, e, "indices are not integers");
    return r < 0 ? r : add_faces(x, f, indices ? f->index.count : p->count, mode, e);
}

/* Weights of a node's mesh without animation: those of the node, or else of the mesh. */
static int take_weights(vgi_gltf_scene *x, size_t at, const vgi_json *mesh, vg_err *e)
{
    vgi_gltf_node *n = &x->nodes[at];
    n->nweights = vgi_json_count(vgi_json_get(vgi_json_at(vgi_json_get(mesh, "primitives"), 0), "targets"));
    if (n->nweights > x->most_targets) x->most_targets = n->nweights;
    n->weights = vgi_array(n->nweights, sizeof *n->weights, e);
    n->rest_weights = vgi_array(n->nweights, sizeof *n->rest_weights, e);
    n->shape_of = vgi_array(n->nweights, sizeof *n->shape_of, e);
    if (!n->weights || !n->rest_weights || !n->shape_of) return VG_ENOMEM;
    return take_numbers(x, vgi_json_get(n->json, "weights") ? n->json : mesh, "weights", n->nweights,
                        n->rest_weights, e);
}

/* The primitives of a mesh, or of one instance of it. */
static int read_primitives(vgi_gltf_scene *x, vgi_gltf_faces *f, size_t at, int64_t skin, const vgi_json *primitives,
                           size_t instance, const double place[12], vg_err *e)
{
    const size_t from = x->nparts;
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(primitives) && r == VG_OK; i++) {
        const vgi_json *primitive = vgi_json_at(primitives, i);
        vgi_gltf_part *p = sharing(x, from, primitive);
        if (!p && (r = add_part(x, at, skin, primitive, e)) == VG_OK) {
            p = &x->parts[x->nparts - 1];
            p->instance = instance;
            memcpy(p->place, place, sizeof p->place);
        }
        if (r == VG_OK) r = vgi_grow(&x->pieces, &x->pieces_cap, x->npieces + 1, sizeof *x->pieces, e);
        if (r == VG_OK) x->pieces[x->npieces++] = (vgi_gltf_piece){primitive, (size_t)(p - x->parts)};
        if (r == VG_OK) r = label_faces(x, f, p, primitive, e);
        if (r == VG_OK) r = read_faces(x, f, p, primitive, e);
    }
    return r;
}

static int read_mesh(vgi_gltf_scene *x, vgi_gltf_faces *f, size_t at, vg_err *e)
{
    const vgi_json *n = x->nodes[at].json, *mesh, *k = vgi_json_get(n, "skin"), *item;
    size_t skinned = 0;
    int r = vgi_gltf_item(&x->g, vgi_json_get(n, "mesh"), "meshes", &mesh, NULL, e);
    if (r == VG_OK && k) r = vgi_gltf_item(&x->g, k, "skins", &item, &skinned, e);
    if (r == VG_OK) r = take_weights(x, at, mesh, e);
    if (r < 0) return r;
    mark(x, at);
    if (k) mark_joints(x, &x->skins[skinned]);
    const vgi_json *primitives = vgi_json_get(mesh, "primitives");
    instances there;
    if (vgi_json_count(primitives) == 0) return vgi_gltf_bad(&x->g, e, "a mesh has no primitives");
    if ((r = read_instances(x, n, &there, e)) < 0) return r;
    if (k) there.n = 0; /* a skin places the vertices independently of the node */
    for (size_t i = there.n ? 1 : 0; i <= there.n && r == VG_OK; i++) {
        double place[12];
        f->turned = (place_instance(&there, i, place) ^ x->nodes[at].mirrors) && !k;
        r = read_primitives(x, f, at, k ? (int64_t)skinned : VGI_GLTF_NONE, primitives, i, place, e);
    }
    return r;
}

static int read_meshes(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < x->nnodes && r == VG_OK; i++)
        if (x->nodes[i].shown && vgi_json_get(x->nodes[i].json, "mesh")) r = read_mesh(x, f, i, e);
    return r == VG_OK && x->nparts == 0 ? vgi_gltf_bad(&x->g, e, "its scene shows no mesh") : r;
}

/* ---- the whole ---- */

int vgi_gltf_scene_read(vgi_gltf_scene *x, vgi_gltf_faces *f, vg_err *e)
{
    int r = read_nodes(x, e);
    if (r == VG_OK) r = read_skins(x, e);
    return r < 0 ? r : read_meshes(x, f, e);
}

void vgi_gltf_scene_clear(vgi_gltf_scene *x)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        free(x->nodes[i].weights);
        free(x->nodes[i].rest_weights);
        free(x->nodes[i].shape_of);
    }
    for (size_t i = 0; i < x->nskins; i++) {
        free(x->skins[i].joints);
        free(x->skins[i].matrices);
    }
    for (size_t i = 0; i < x->nparts; i++) {
        free(x->parts[i].moved);
        free(x->parts[i].kept);
    }
    void *const arrays[] = {x->nodes, x->order, x->skins, x->parts, x->channels, x->clips, x->moments, x->number, x->pieces};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    vg_attributes_clear(&x->attributes);
    vgi_name_set_clear(&x->shapes);
    free(x->wanted);
    vgi_gltf_clear(&x->g);
}
