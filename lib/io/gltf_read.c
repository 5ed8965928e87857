/* gltf_read.c: the meshes of a glTF scene as one mesh, and its morph targets, animations and skins as frames.
 * Leaves out cameras, materials, normals, texture coordinates, and animation of anything but nodes and weights.
 *
 * Nothing is unpacked: a frame is computed from the bytes of the file when it is asked for.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>

enum { MOST_SETS = 8, MOST_CLIPPED = 512, NONE = -1 };

/* Many nodes may show one mesh, so that a small file could ask for more than any memory. */
static const size_t most_elements = (size_t)1 << 27;

typedef enum path { TRANSLATION, ROTATION, SCALE, WEIGHTS } path;

typedef struct placed { /* rotation: x y z w */
    double translation[3], rotation[4], scale[3];
} placed;

typedef struct node {
    const vgi_json *json;
    size_t parent;         /* SIZE_MAX: none */
    bool shown, matters;   /* matters: it moves a vertex */
    bool fixed;            /* by a matrix */
    double matrix[12];     /* three rows of four */
    placed rest, now;
    double world[12];
    size_t nweights;       /* morph targets of its mesh */
    double *weights;
} node;

typedef struct skin {
    size_t n;
    size_t *joints;
    bool bound;
    vgi_accessor inverse; /* bind matrices, if bound */
    double *matrices;     /* n x 12 */
} skin;

/* The vertices of a primitive as a node shows it; or of several that share them. */
typedef struct part {
    size_t node, count, first; /* first: number of its first vertex among all, before welding */
    int64_t skin;              /* NONE */
    const vgi_json *attributes, *targets;
    vgi_accessor position;
    size_t ntargets, nsets;
    vgi_accessor *moved, joints[MOST_SETS], shares[MOST_SETS];
    uint32_t *kept;            /* those that are vertices of the mesh, ascending */
    size_t nkept;
} part;

typedef struct channel {
    size_t node, width;
    path path;
    bool cubic, step;
    vgi_accessor in, out;
} channel;

typedef struct clip {
    size_t first, nchannels, frames;
    const vgi_json *names; /* of its frames; NULL */
} clip;

typedef struct moment {
    size_t clip;
    double time;
} moment;

typedef struct reading {
    vgi_gltf g;
    size_t nnodes, nskins, nparts, parts_cap, nchannels, channels_cap, nclips, clips_cap, nmoments, moments_cap;
    node *nodes;
    size_t *order; /* nodes, parents first */
    skin *skins;
    part *parts;
    size_t all;    /* vertices of all parts, before welding */
    channel *channels;
    clip *clips;
    moment *moments;
    size_t most_targets, frames, next;
    bool own;      /* our own file: its vertices and faces stay as they are */
} reading;

static int refuse(const reading *x, vg_err *e, const char *format, ...) VG_PRINTF(3, 4);
static int refuse(const reading *x, vg_err *e, const char *format, ...)
{
    char text[256];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    return vg_fail(e, VG_EINPUT, "%s: %s", x->g.subject, text);
}

/* ---- transforms ---- */

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* to = a b; to may be neither. */
static void multiply(const double a[12], const double b[12], double to[12])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            to[4 * i + j] = j == 3 ? a[4 * i + 3] : 0;
            for (int k = 0; k < 3; k++) to[4 * i + j] += a[4 * i + k] * b[4 * k + j];
        }
}

static void move_point(const double m[12], const double p[3], double to[3])
{
    for (int i = 0; i < 3; i++) to[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
}

/* The upper rows of a matrix of 16, columns first. */
static void from_columns(const double c[16], double m[12])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) m[4 * i + j] = c[4 * j + i];
}

static void local_matrix(const placed *p, double m[12])
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

static void place_nodes(reading *x)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        node *n = &x->nodes[x->order[i]];
        double local[12];
        if (n->fixed) memcpy(local, n->matrix, sizeof local);
        else local_matrix(&n->now, local);
        multiply(n->parent == SIZE_MAX ? identity : x->nodes[n->parent].world, local, n->world);
    }
}

static void place_joints(reading *x)
{
    for (size_t s = 0; s < x->nskins; s++) {
        const skin *k = &x->skins[s];
        for (size_t j = 0; j < k->n; j++) {
            double columns[16], inverse[12];
            memcpy(inverse, identity, sizeof inverse);
            if (k->bound) {
                vgi_accessor_get(&k->inverse, j, columns);
                from_columns(columns, inverse);
            }
            multiply(x->nodes[k->joints[j]].world, inverse, k->matrices + 12 * j);
        }
    }
}

/* ---- nodes ---- */

/* A list of n numbers that may be missing. */
static int take_numbers(const reading *x, const vgi_json *from, const char *key, size_t n, double *to, vg_err *e)
{
    const vgi_json *list = vgi_json_get(from, key);
    if (!list) return VG_OK;
    bool good = vgi_json_count(list) == n;
    for (size_t i = 0; i < n && good; i++) good = vgi_json_number(vgi_json_at(list, i), &to[i]);
    return good ? VG_OK : refuse(x, e, "a node's or mesh's '%s' is not %zu numbers", key, n);
}

static int read_node(reading *x, node *n, vg_err *e)
{
    double columns[16];
    n->rest = (placed){.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};
    n->fixed = vgi_json_get(n->json, "matrix");
    int r = take_numbers(x, n->json, "matrix", 16, columns, e);
    if (r == VG_OK && n->fixed) from_columns(columns, n->matrix);
    if (r == VG_OK) r = take_numbers(x, n->json, "translation", 3, n->rest.translation, e);
    if (r == VG_OK) r = take_numbers(x, n->json, "rotation", 4, n->rest.rotation, e);
    if (r == VG_OK) r = take_numbers(x, n->json, "scale", 3, n->rest.scale, e);
    n->now = n->rest;
    return r;
}

static int adopt_children(reading *x, size_t parent, vg_err *e)
{
    const vgi_json *children = vgi_json_get(x->nodes[parent].json, "children"), *child;
    for (size_t i = 0; i < vgi_json_count(children); i++) {
        size_t number = 0;
        int r = vgi_gltf_item(&x->g, vgi_json_at(children, i), "nodes", &child, &number, e);
        if (r < 0) return r;
        if (x->nodes[number].parent != SIZE_MAX) return refuse(x, e, "node %zu has two parents", number);
        x->nodes[number].parent = parent;
    }
    return VG_OK;
}

/* Parents before children; nodes in a cycle are never reached. */
static int order_nodes(reading *x, vg_err *e)
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
    return n == x->nnodes ? VG_OK : refuse(x, e, "its nodes are in a cycle");
}

/* What the scene shows; without scenes, everything. */
static int show_nodes(reading *x, vg_err *e)
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
        node *n = &x->nodes[x->order[i]];
        n->shown |= !scene || (n->parent != SIZE_MAX && x->nodes[n->parent].shown);
    }
    return r;
}

static int read_nodes(reading *x, vg_err *e)
{
    const vgi_json *list = vgi_json_get(x->g.json, "nodes");
    size_t n = vgi_json_count(list);
    x->nodes = vgi_array(n, sizeof *x->nodes, e), x->order = vgi_array(n, sizeof *x->order, e);
    if (!x->nodes || !x->order) return VG_ENOMEM;
    x->nnodes = n;
    int r = VG_OK;
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        x->nodes[i] = (node){.json = vgi_json_at(list, i), .parent = SIZE_MAX};
        r = read_node(x, &x->nodes[i], e);
    }
    for (size_t i = 0; i < n && r == VG_OK; i++) r = adopt_children(x, i, e);
    if (r == VG_OK) r = order_nodes(x, e);
    return r < 0 ? r : show_nodes(x, e);
}

/* A node and all above it move a vertex. */
static void mark(reading *x, size_t i)
{
    for (; i != SIZE_MAX && !x->nodes[i].matters; i = x->nodes[i].parent) x->nodes[i].matters = true;
}

/* ---- skins ---- */

static int read_skin(reading *x, skin *k, const vgi_json *from, vg_err *e)
{
    const vgi_json *joints = vgi_json_get(from, "joints"), *item,
                   *inverse = vgi_json_get(from, "inverseBindMatrices");
    k->n = vgi_json_count(joints);
    if (k->n == 0) return refuse(x, e, "a skin has no joints");
    k->joints = vgi_array(k->n, sizeof *k->joints, e), k->matrices = vgi_array(k->n, sizeof identity, e);
    int r = k->joints && k->matrices ? VG_OK : VG_ENOMEM;
    for (size_t j = 0; j < k->n && r == VG_OK; j++)
        r = vgi_gltf_item(&x->g, vgi_json_at(joints, j), "nodes", &item, &k->joints[j], e);
    k->bound = inverse;
    if (r == VG_OK && inverse)
        r = vgi_gltf_accessor(&x->g, inverse, 16, k->n, "inverse bind matrices", &k->inverse, e);
    return r;
}

static int read_skins(reading *x, vg_err *e)
{
    const vgi_json *list = vgi_json_get(x->g.json, "skins");
    size_t n = vgi_json_count(list);
    if (!(x->skins = vgi_array(n, sizeof *x->skins, e))) return VG_ENOMEM;
    int r = VG_OK;
    while (x->nskins < n && r == VG_OK) {
        skin *k = &x->skins[x->nskins];
        r = read_skin(x, k, vgi_json_at(list, x->nskins++), e);
    }
    return r;
}

/* ---- parts ---- */

static int read_targets(reading *x, part *p, vg_err *e)
{
    const size_t n = vgi_json_count(p->targets);
    if (!(p->moved = vgi_array(n, sizeof *p->moved, e))) return VG_ENOMEM;
    p->ntargets = n;
    if (n != x->nodes[p->node].nweights)
        return refuse(x, e, "the primitives of a mesh have different numbers of morph targets");
    int r = VG_OK;
    for (size_t t = 0; t < n && r == VG_OK; t++) {
        const vgi_json *ref = vgi_json_get(vgi_json_at(p->targets, t), "POSITION");
        if (ref) r = vgi_gltf_accessor(&x->g, ref, 3, p->count, "a morph target", &p->moved[t], e);
        else p->moved[t] = (vgi_accessor){.count = p->count, .width = 3, .component = VGI_GLTF_FLOAT};
    }
    return r;
}

static int check_joints(const reading *x, const part *p, const vgi_accessor *joints, vg_err *e)
{
    double n = (double)x->skins[p->skin].n, j[4];
    for (size_t i = 0; i < p->count; i++) {
        vgi_accessor_get(joints, i, j);
        if (!(j[0] < n && j[1] < n && j[2] < n && j[3] < n))
            return refuse(x, e, "a vertex hangs on a joint that its skin has not");
    }
    return VG_OK;
}

static int read_influences(reading *x, part *p, vg_err *e)
{
    int r = VG_OK;
    for (; r == VG_OK; p->nsets++) {
        char joints[32], weights[32];
        snprintf(joints, sizeof joints, "JOINTS_%zu", p->nsets);
        snprintf(weights, sizeof weights, "WEIGHTS_%zu", p->nsets);
        const vgi_json *j = vgi_json_get(p->attributes, joints), *w = vgi_json_get(p->attributes, weights);
        if (!j || !w) break;
        if (p->nsets == MOST_SETS) return refuse(x, e, "vertices hang on more than %d joints", 4 * MOST_SETS);
        vgi_accessor *a = &p->joints[p->nsets];
        r = vgi_gltf_accessor(&x->g, j, 4, p->count, "joints", a, e);
        if (r == VG_OK && !vgi_accessor_is_index(a)) r = refuse(x, e, "the joints of a vertex are no whole numbers");
        if (r == VG_OK) r = check_joints(x, p, a, e);
        if (r == VG_OK) r = vgi_gltf_accessor(&x->g, w, 4, p->count, "weights", &p->shares[p->nsets], e);
    }
    return r;
}

static int add_part(reading *x, size_t at, int64_t skinned, const vgi_json *primitive, vg_err *e)
{
    int r = vgi_grow(&x->parts, &x->parts_cap, x->nparts + 1, sizeof *x->parts, e);
    if (r < 0) return r;
    part *p = &x->parts[x->nparts++];
    *p = (part){.node = at, .first = x->all, .skin = skinned, .attributes = vgi_json_get(primitive, "attributes"),
                .targets = vgi_json_get(primitive, "targets")};
    r = vgi_gltf_accessor(&x->g, vgi_json_get(p->attributes, "POSITION"), 3, 0, "positions", &p->position, e);
    if (r < 0) return r;
    p->count = p->position.count;
    if (p->count > most_elements - x->all) return refuse(x, e, "it shows more than %zu vertices", most_elements);
    x->all += p->count;
    r = read_targets(x, p, e);
    return r < 0 || p->skin == NONE ? r : read_influences(x, p, e);
}

/* Primitives of a mesh may share their vertices: the part among those from `from` on that has them. */
static part *sharing(const reading *x, size_t from, const vgi_json *primitive)
{
    for (size_t i = from; i < x->nparts; i++)
        if (vgi_json_same(x->parts[i].attributes, vgi_json_get(primitive, "attributes")) &&
            vgi_json_same(x->parts[i].targets, vgi_json_get(primitive, "targets")))
            return &x->parts[i];
    return NULL;
}

/* ---- faces, before welding ---- */

typedef struct faces {
    vg_mesh mesh;
    size_t start_cap, vert_cap;
    vgi_accessor index;
    bool indexed;
    const part *part;
} faces;

static int corner(const reading *x, const faces *f, size_t i, uint32_t *to, vg_err *e)
{
    double v = (double)i;
    if (f->indexed) vgi_accessor_get(&f->index, i, &v);
    if (v >= (double)f->part->count)
        return refuse(x, e, "an index is %.0f where there are %zu vertices", v, f->part->count);
    *to = (uint32_t)(f->part->first + (size_t)v);
    return VG_OK;
}

static int add_face(const reading *x, faces *f, const size_t *at, size_t n, vg_err *e)
{
    vg_mesh *m = &f->mesh;
    size_t corners = vg_mesh_corners(m);
    if (corners > most_elements) return refuse(x, e, "it shows more than %zu corners", most_elements);
    int r = vgi_grow(&m->start, &f->start_cap, m->nf + 2, sizeof *m->start, e);
    if (r == VG_OK) r = vgi_grow(&m->vert, &f->vert_cap, corners + n, sizeof *m->vert, e);
    for (size_t k = 0; k < n && r == VG_OK; k++) r = corner(x, f, at[k], &m->vert[corners + k], e);
    if (r < 0) return r;
    m->start[m->nf] = (uint32_t)corners;
    m->start[++m->nf] = (uint32_t)(corners + n);
    return VG_OK;
}

static int add_faces(const reading *x, faces *f, size_t n, uint64_t mode, vg_err *e)
{
    const bool lines = mode <= VGI_GLTF_LINE_STRIP;
    const size_t size = lines ? 2 : 3;
    const bool apart = mode == VGI_GLTF_LINES || mode == VGI_GLTF_TRIANGLES;
    size_t count = apart ? n / size : mode == VGI_GLTF_LINE_LOOP ? n : n >= size ? n - size + 1 : 0;
    int r = VG_OK;
    if (mode == VGI_GLTF_POINTS) return VG_OK;
    if (apart && n % size) return refuse(x, e, "%zu indices do not make whole %s", n, lines ? "lines" : "triangles");
    if (mode == VGI_GLTF_LINE_LOOP && n < 2) return refuse(x, e, "a loop has %zu vertices", n);
    for (size_t i = 0; i < count && r == VG_OK; i++) {
        const size_t a = apart ? size * i : i, odd = mode == VGI_GLTF_STRIP && i % 2;
        const size_t at[3] = {mode == VGI_GLTF_FAN ? 0 : a, (a + 1 + odd) % n, a + 2 - odd};
        r = add_face(x, f, at, size, e);
    }
    return r;
}

static int read_faces(const reading *x, faces *f, const part *p, const vgi_json *primitive, vg_err *e)
{
    const vgi_json *indices = vgi_json_get(primitive, "indices"), *given = vgi_json_get(primitive, "mode");
    uint64_t mode = VGI_GLTF_TRIANGLES;
    if (given && (!vgi_json_whole(given, &mode) || mode > VGI_GLTF_FAN))
        return refuse(x, e, "a primitive's mode is not known");
    f->part = p, f->indexed = indices;
    int r = indices ? vgi_gltf_accessor(&x->g, indices, 1, 0, "indices", &f->index, e) : VG_OK;
    if (r == VG_OK && indices && !vgi_accessor_is_index(&f->index)) r = refuse(x, e, "indices are no whole numbers");
    return r < 0 ? r : add_faces(x, f, indices ? f->index.count : p->count, mode, e);
}

static int take_weights(reading *x, size_t at, const vgi_json *mesh, vg_err *e)
{
    node *n = &x->nodes[at];
    n->nweights = vgi_json_count(vgi_json_get(vgi_json_at(vgi_json_get(mesh, "primitives"), 0), "targets"));
    if (n->nweights > x->most_targets) x->most_targets = n->nweights;
    return (n->weights = vgi_array(n->nweights, sizeof *n->weights, e)) ? VG_OK : VG_ENOMEM;
}

static int read_mesh(reading *x, faces *f, size_t at, vg_err *e)
{
    const vgi_json *n = x->nodes[at].json, *mesh, *k = vgi_json_get(n, "skin"), *item;
    size_t skinned = 0;
    int r = vgi_gltf_item(&x->g, vgi_json_get(n, "mesh"), "meshes", &mesh, NULL, e);
    if (r == VG_OK && k) r = vgi_gltf_item(&x->g, k, "skins", &item, &skinned, e);
    if (r == VG_OK) r = take_weights(x, at, mesh, e);
    if (r < 0) return r;
    mark(x, at);
    for (size_t j = 0; k && j < x->skins[skinned].n; j++) mark(x, x->skins[skinned].joints[j]);
    const vgi_json *primitives = vgi_json_get(mesh, "primitives");
    const size_t from = x->nparts;
    if (vgi_json_count(primitives) == 0) return refuse(x, e, "a mesh has no primitives");
    for (size_t i = 0; i < vgi_json_count(primitives) && r == VG_OK; i++) {
        const vgi_json *primitive = vgi_json_at(primitives, i);
        part *p = sharing(x, from, primitive);
        if (!p && (r = add_part(x, at, k ? (int64_t)skinned : NONE, primitive, e)) == VG_OK)
            p = &x->parts[x->nparts - 1];
        if (r == VG_OK) r = read_faces(x, f, p, primitive, e);
    }
    return r;
}

static int read_meshes(reading *x, faces *f, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < x->nnodes && r == VG_OK; i++)
        if (x->nodes[i].shown && vgi_json_get(x->nodes[i].json, "mesh")) r = read_mesh(x, f, i, e);
    return r == VG_OK && x->nparts == 0 ? refuse(x, e, "its scene shows no mesh") : r;
}

/* ---- polygons of our own files ---- */

typedef struct restoring {
    const vg_mesh *from;
    size_t triangle, line; /* the faces of three and two that come next */
    vg_mesh to;
    size_t start_cap, vert_cap;
    uint32_t edge[3 * MOST_CLIPPED][2];
} restoring;

static const uint32_t *next_of_size(const vg_mesh *m, size_t *at, size_t size)
{
    while (*at < m->nf && m->start[*at + 1] - m->start[*at] != size) ++*at;
    return *at < m->nf ? m->vert + m->start[(*at)++] : NULL;
}

static bool is_inner(const restoring *k, size_t n, size_t edge)
{
    for (size_t i = 0; i < n; i++)
        if (k->edge[i][0] == k->edge[edge][1] && k->edge[i][1] == k->edge[edge][0]) return true;
    return false;
}

/* Once around the triangles, along edges that belong to one of them only. */
static bool walk_around(const restoring *k, size_t n, uint32_t *face)
{
    const size_t edges = 3 * (n - 2);
    uint32_t v = face[0] = k->edge[0][0];
    for (size_t i = 1; i <= n; i++) {
        size_t found = edges;
        for (size_t s = 0; s < edges && found == edges; s++)
            if (k->edge[s][0] == v && !is_inner(k, edges, s)) found = s;
        if (found == edges) return false;
        v = k->edge[found][1];
        if (i < n) face[i] = v;
    }
    return v == face[0];
}

/* One face of n corners from the n - 2 triangles that come next; false: they are not one. */
static bool take_polygon(restoring *k, size_t n, uint32_t *face)
{
    bool fan = true;
    for (size_t t = 0; t + 2 < n; t++) {
        const uint32_t *v = next_of_size(k->from, &k->triangle, 3);
        if (!v) return false;
        fan &= t == 0 || (v[0] == face[0] && v[1] == face[t + 1]);
        if (!fan && n > MOST_CLIPPED) return false;
        if (fan && t == 0) face[0] = v[0], face[1] = v[1];
        if (fan) face[t + 2] = v[2];
        for (size_t s = 0; s < 3 && n <= MOST_CLIPPED; s++)
            k->edge[3 * t + s][0] = v[s], k->edge[3 * t + s][1] = v[(s + 1) % 3];
    }
    return fan || walk_around(k, n, face);
}

/* 1: done; 0: it cannot be. The arrays never grow beyond what the triangles fill. */
static int take_face(restoring *k, size_t n, vg_err *e)
{
    vg_mesh *m = &k->to;
    const size_t corners = vg_mesh_corners(m);
    if (n < 2 || n > k->from->nf + 2) return 0;
    int r = vgi_grow(&m->start, &k->start_cap, m->nf + 2, sizeof *m->start, e);
    if (r == VG_OK) r = vgi_grow(&m->vert, &k->vert_cap, corners + n, sizeof *m->vert, e);
    if (r < 0) return r;
    if (n == 2) {
        const uint32_t *v = next_of_size(k->from, &k->line, 2);
        if (!v) return 0;
        memcpy(m->vert + corners, v, 2 * sizeof *v);
    } else if (!take_polygon(k, n, m->vert + corners)) {
        return 0;
    }
    m->start[m->nf] = (uint32_t)corners;
    m->start[++m->nf] = (uint32_t)(corners + n);
    return 1;
}

static int take_runs(restoring *k, const vgi_json *runs, vg_err *e)
{
    int r = 1;
    for (size_t i = 0; i < vgi_json_count(runs) && r == 1; i += 2) {
        uint64_t count, size;
        if (!vgi_json_whole(vgi_json_at(runs, i), &count) || !vgi_json_whole(vgi_json_at(runs, i + 1), &size))
            return 0;
        for (; count && r == 1; count--) r = take_face(k, (size_t)size, e);
    }
    if (r == 1 && (next_of_size(k->from, &k->triangle, 3) || next_of_size(k->from, &k->line, 2))) r = 0;
    return r;
}

/* If the extras of the only mesh tell of polygons, and its triangles agree, they become polygons again. */
static int restore_polygons(reading *x, faces *f, vg_err *e)
{
    const vgi_json *mesh, *runs;
    if (x->nparts != 1 || x->parts[0].skin != NONE) return VG_OK;
    int r = vgi_gltf_item(&x->g, vgi_json_get(x->nodes[x->parts[0].node].json, "mesh"), "meshes", &mesh, NULL, e);
    if (r < 0 || !vgi_json_is_array(runs = vgi_json_get(vgi_json_get(mesh, "extras"), VGI_GLTF_FACES))) return r;
    restoring *k = vgi_array(1, sizeof *k, e);
    if (!k) return VG_ENOMEM;
    k->from = &f->mesh;
    r = take_runs(k, runs, e);
    if (r == 1 && vgi_json_count(runs) == 0) x->own = true;
    else if (r == 1) r = vg_mesh_check(&(vg_mesh){x->all, k->to.nf, k->to.start, k->to.vert}, "it", NULL) == VG_OK;
    if (r == 1 && k->to.nf) {
        const vg_mesh old = f->mesh;
        f->mesh = k->to, k->to = old;
        x->own = true;
    }
    vg_mesh_clear(&k->to);
    free(k);
    return r < 0 ? r : VG_OK;
}

/* ---- welding: exporters cut a mesh where normals or texture coordinates jump ---- */

typedef struct welding {
    const reading *x;
    uint32_t *slots;  /* positions among all vertices, + 1; 0: free */
    uint32_t *number; /* which vertex of the mesh each becomes */
    size_t nslots;
} welding;

static const part *part_of(const reading *x, size_t v)
{
    size_t low = 0, high = x->nparts;
    while (high - low > 1) {
        size_t mid = low + (high - low) / 2;
        if (x->parts[mid].first <= v) low = mid;
        else high = mid;
    }
    return &x->parts[low];
}

static uint64_t mix(uint64_t hash, const double *p, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        double y = p[i] + 0.0; /* -0 is 0 */
        uint64_t bits;
        memcpy(&bits, &y, sizeof bits);
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 29;
    }
    return hash;
}

static uint64_t hash_of(const part *p, size_t v)
{
    double at[4];
    vgi_accessor_get(&p->position, v, at);
    uint64_t hash = mix(p->node + 1, at, 3);
    for (size_t s = 0; s < p->nsets; s++) {
        vgi_accessor_get(&p->shares[s], v, at);
        hash = mix(hash, at, 4);
    }
    for (size_t t = 0; t < p->ntargets; t++) {
        vgi_accessor_get(&p->moved[t], v, at);
        hash = mix(hash, at, 3);
    }
    return hash;
}

static bool same_element(const vgi_accessor *a, size_t i, const vgi_accessor *b, size_t j)
{
    double p[4], q[4];
    vgi_accessor_get(a, i, p);
    vgi_accessor_get(b, j, q);
    for (size_t k = 0; k < a->width; k++)
        if (!(p[k] == q[k])) return false;
    return true;
}

/* Do they stay together whatever moves? */
static bool are_one(const part *p, size_t v, const part *q, size_t w)
{
    if (p->node != q->node || p->nsets != q->nsets || p->ntargets != q->ntargets) return false;
    if (!same_element(&p->position, v, &q->position, w)) return false;
    for (size_t s = 0; s < p->nsets; s++)
        if (!same_element(&p->joints[s], v, &q->joints[s], w) || !same_element(&p->shares[s], v, &q->shares[s], w))
            return false;
    for (size_t t = 0; t < p->ntargets; t++)
        if (!same_element(&p->moved[t], v, &q->moved[t], w)) return false;
    return true;
}

static uint32_t *find_slot(const welding *k, const part *p, size_t v)
{
    size_t i = (size_t)hash_of(p, v) & (k->nslots - 1);
    for (; k->slots[i]; i = (i + 1) & (k->nslots - 1)) {
        size_t other = k->slots[i] - 1;
        const part *q = part_of(k->x, other);
        if (are_one(p, v, q, other - q->first)) break;
    }
    return &k->slots[i];
}

static int weld_part(reading *x, const welding *k, part *p, size_t *n, vg_err *e)
{
    if (!(p->kept = vgi_array_raw(p->count, sizeof *p->kept, e))) return VG_ENOMEM;
    for (size_t v = 0; v < p->count; v++) {
        uint32_t *slot = x->own ? NULL : find_slot(k, p, v);
        if (slot && *slot) {
            k->number[p->first + v] = k->number[*slot - 1];
            continue;
        }
        if (slot) *slot = (uint32_t)(p->first + v) + 1;
        k->number[p->first + v] = (uint32_t)(*n)++;
        p->kept[p->nkept++] = (uint32_t)v;
    }
    return VG_OK;
}

/* Faces of the welded vertices; those that have shrunk to nothing are left out, as strips have them too. */
static void renumber(vg_mesh *m, const uint32_t *number)
{
    size_t nf = 0, corners = 0;
    for (size_t f = 0; f < m->nf; f++) {
        const size_t start = m->start[f], n = m->start[f + 1] - start;
        bool distinct = true;
        for (size_t k = 0; k < n; k++) m->vert[corners + k] = number[m->vert[start + k]];
        if (n <= 3)
            for (size_t k = 0; k < n; k++) distinct &= m->vert[corners + k] != m->vert[corners + (k + 1) % n];
        if (!distinct) continue;
        m->start[nf++] = (uint32_t)corners;
        corners += n;
    }
    if (m->start) m->start[nf] = (uint32_t)corners;
    m->nf = nf;
}

static int weld(reading *x, vg_mesh *m, vg_err *e)
{
    welding k = {.x = x, .nslots = 4};
    while (k.nslots < 2 * x->all) k.nslots *= 2;
    k.slots = vgi_array(k.nslots, sizeof *k.slots, e), k.number = vgi_array_raw(x->all, sizeof *k.number, e);
    int r = k.slots && k.number ? VG_OK : VG_ENOMEM;
    size_t n = 0;
    for (size_t i = 0; i < x->nparts && r == VG_OK; i++) r = weld_part(x, &k, &x->parts[i], &n, e);
    if (r == VG_OK) renumber(m, k.number);
    m->nv = n;
    free(k.slots);
    free(k.number);
    return r;
}

/* ---- animations ---- */

static int check_times(const reading *x, const channel *c, vg_err *e)
{
    double before = -HUGE_VAL, t;
    for (size_t i = 0; i < c->in.count; i++, before = t) {
        vgi_accessor_get(&c->in, i, &t);
        if (!(t > before) || !isfinite(t)) return refuse(x, e, "the times of an animation do not ascend");
    }
    return VG_OK;
}

static int read_sampler(const reading *x, channel *c, const vgi_json *sampler, vg_err *e)
{
    const char *way = vgi_json_text(vgi_json_get(sampler, "interpolation"));
    c->cubic = way && !strcmp(way, "CUBICSPLINE"), c->step = way && !strcmp(way, "STEP");
    if (way && !c->cubic && !c->step && strcmp(way, "LINEAR") != 0)
        return refuse(x, e, "an animation's interpolation is not known");
    int r = vgi_gltf_accessor(&x->g, vgi_json_get(sampler, "input"), 1, 0, "an animation's times", &c->in, e);
    if (r == VG_OK) r = check_times(x, c, e);
    if (r < 0) return r;
    size_t n = c->path == WEIGHTS ? c->width : 1, count;
    if (!vgi_mul(c->in.count, n * (c->cubic ? 3 : 1), &count)) return refuse(x, e, "an animation is too long");
    r = vgi_gltf_accessor(&x->g, vgi_json_get(sampler, "output"), c->path == WEIGHTS ? 1 : c->width, count,
                          "an animation's values", &c->out, e);
    return r == VG_OK && !c->out.data && !c->out.nsparse ? refuse(x, e, "an animation's values have no bytes") : r;
}

/* 1: it moves something that is shown; 0: it does not. */
static int read_target(const reading *x, channel *c, const vgi_json *target, vg_err *e)
{
    static const struct {
        const char *name;
        size_t width;
    } paths[] = {{"translation", 3}, {"rotation", 4}, {"scale", 3}, {"weights", 0}};
    const char *name = vgi_json_text(vgi_json_get(target, "path"));
    const vgi_json *item;
    size_t i = 0;
    if (!name || !vgi_json_get(target, "node")) return 0;
    while (i < 4 && strcmp(name, paths[i].name) != 0) i++;
    int r = vgi_gltf_item(&x->g, vgi_json_get(target, "node"), "nodes", &item, &c->node, e);
    if (r < 0 || i == 4) return r;
    const node *n = &x->nodes[c->node];
    c->path = (path)i, c->width = c->path == WEIGHTS ? n->nweights : paths[i].width;
    if (!n->matters || c->width == 0) return 0;
    return n->fixed && c->path != WEIGHTS ? refuse(x, e, "node %zu is animated and has a matrix", c->node) : 1;
}

static int read_channel(reading *x, const vgi_json *animation, const vgi_json *from, vg_err *e)
{
    uint64_t sampler;
    channel c = {0};
    int r = read_target(x, &c, vgi_json_get(from, "target"), e);
    if (r <= 0) return r;
    const vgi_json *samplers = vgi_json_get(animation, "samplers");
    if (!vgi_json_whole(vgi_json_get(from, "sampler"), &sampler) || sampler >= vgi_json_count(samplers))
        return refuse(x, e, "an animation refers to a sampler that is not there");
    r = read_sampler(x, &c, vgi_json_at(samplers, (size_t)sampler), e);
    if (r == VG_OK) r = vgi_grow(&x->channels, &x->channels_cap, x->nchannels + 1, sizeof *x->channels, e);
    if (r == VG_OK) x->channels[x->nchannels++] = c;
    return r;
}

static int by_time(const void *a, const void *b)
{
    double s = ((const moment *)a)->time, t = ((const moment *)b)->time;
    return s < t ? -1 : s > t;
}

static bool same_times(const channel *a, const channel *b)
{
    return a->in.data == b->in.data && a->in.count == b->in.count && a->in.stride == b->in.stride && !a->in.nsparse &&
           !b->in.nsparse;
}

static int add_moments(reading *x, const channel *c, vg_err *e)
{
    int r = vgi_grow(&x->moments, &x->moments_cap, x->nmoments + c->in.count, sizeof *x->moments, e);
    for (size_t i = 0; i < c->in.count && r == VG_OK; i++) {
        moment *m = &x->moments[x->nmoments++];
        m->clip = x->nclips;
        vgi_accessor_get(&c->in, i, &m->time);
    }
    return r;
}

/* Moments at one time are one. */
static size_t unite(moment *m, size_t n)
{
    size_t kept = 0;
    qsort(m, n, sizeof *m, by_time);
    for (size_t i = 0; i < n; i++)
        if (kept == 0 || m[i].time > m[kept - 1].time) m[kept++] = m[i];
    return kept;
}

static int read_animation(reading *x, const vgi_json *animation, vg_err *e)
{
    const vgi_json *channels = vgi_json_get(animation, "channels");
    const size_t first = x->nchannels, moments = x->nmoments;
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(channels) && r == VG_OK; i++)
        r = read_channel(x, animation, vgi_json_at(channels, i), e);
    if (r < 0 || x->nchannels == first) return r;
    for (size_t i = first; i < x->nchannels && r == VG_OK; i++) {
        if (i > first && same_times(&x->channels[i - 1], &x->channels[i])) continue;
        r = add_moments(x, &x->channels[i], e);
        if (x->nmoments - moments > most_elements) r = refuse(x, e, "an animation has too many times");
    }
    if (r == VG_OK) r = vgi_grow(&x->clips, &x->clips_cap, x->nclips + 1, sizeof *x->clips, e);
    if (r < 0) return r;
    size_t frames = unite(x->moments + moments, x->nmoments - moments);
    x->nmoments = moments + frames;
    const vgi_json *names = vgi_json_get(vgi_json_get(animation, "extras"), VGI_GLTF_FRAMES);
    x->clips[x->nclips++] = (clip){first, x->nchannels - first, moments,
                                   vgi_json_count(names) == frames ? names : NULL};
    return VG_OK;
}

static int read_animations(reading *x, vg_err *e)
{
    const vgi_json *list = vgi_json_get(x->g.json, "animations");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(list) && r == VG_OK; i++) r = read_animation(x, vgi_json_at(list, i), e);
    x->frames = x->nclips ? x->nmoments : x->most_targets ? x->most_targets + 1 : 1;
    return r;
}

/* ---- a channel at a time ---- */

/* Number k of key `key`: its value, or the tangent in front of it or behind it (which 0, 2) of a spline. */
static void key_value(const channel *c, size_t key, size_t which, double *to)
{
    const size_t at = c->cubic ? 3 * key + which : key;
    if (c->path != WEIGHTS) {
        vgi_accessor_get(&c->out, at, to);
        return;
    }
    for (size_t k = 0; k < c->width; k++) vgi_accessor_get(&c->out, at * c->width + k, &to[k]);
}

static void turn_between(const double a[4], const double b[4], double s, double to[4])
{
    double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3], sign = cosine < 0 ? -1 : 1;
    double angle = acos(fmin(fabs(cosine), 1)), p = 1 - s, q = s;
    if (angle > 1e-6) p = sin((1 - s) * angle) / sin(angle), q = sin(s * angle) / sin(angle);
    for (int k = 0; k < 4; k++) to[k] = p * a[k] + sign * q * b[k];
}

static size_t last_key_before(const vgi_accessor *in, double t)
{
    size_t low = 0, high = in->count;
    while (high - low > 1) {
        size_t mid = low + (high - low) / 2;
        double time;
        vgi_accessor_get(in, mid, &time);
        if (time <= t) low = mid;
        else high = mid;
    }
    return low;
}

/* work: room for 4 * width numbers. */
static void sample(const channel *c, double t, double *to, double *work)
{
    const size_t key = last_key_before(&c->in, t), n = c->width;
    double t0, t1 = 0;
    double *a = work, *b = work + n, *out = work + 2 * n, *in = work + 3 * n;
    vgi_accessor_get(&c->in, key, &t0);
    if (key + 1 < c->in.count) vgi_accessor_get(&c->in, key + 1, &t1);
    key_value(c, key, 1, to);
    if (c->step || key + 1 == c->in.count || t <= t0) return;
    const double step = t1 - t0, s = (t - t0) / step;
    memcpy(a, to, n * sizeof *a);
    key_value(c, key + 1, 1, b);
    if (c->cubic) {
        key_value(c, key, 2, out);
        key_value(c, key + 1, 0, in);
        for (size_t k = 0; k < n; k++)
            to[k] = (2 * s * s * s - 3 * s * s + 1) * a[k] + step * (s * s * s - 2 * s * s + s) * out[k] +
                    (3 * s * s - 2 * s * s * s) * b[k] + step * (s * s * s - s * s) * in[k];
    } else if (c->path == ROTATION) {
        turn_between(a, b, s, to);
    } else {
        for (size_t k = 0; k < n; k++) to[k] = (1 - s) * a[k] + s * b[k];
    }
}

static int animate(reading *x, const moment *m, vg_err *e)
{
    const clip *c = &x->clips[m->clip];
    double *work = vgi_array_raw(4 * (x->most_targets + 4), sizeof *work, e);
    if (!work) return VG_ENOMEM;
    for (size_t i = c->first; i < c->first + c->nchannels; i++) {
        const channel *ch = &x->channels[i];
        node *n = &x->nodes[ch->node];
        double *to = ch->path == TRANSLATION ? n->now.translation : ch->path == ROTATION ? n->now.rotation
                   : ch->path == SCALE ? n->now.scale : n->weights;
        sample(ch, m->time, to, work);
    }
    free(work);
    return VG_OK;
}

/* ---- frames ---- */

static void rest(reading *x)
{
    for (size_t i = 0; i < x->nnodes; i++) {
        node *n = &x->nodes[i];
        n->now = n->rest;
        for (size_t t = 0; t < n->nweights; t++) n->weights[t] = 0;
    }
}

/* Where the joints take p; false: it hangs on none. */
static bool bend(const reading *x, const part *p, size_t v, const double at[3], double to[3])
{
    const skin *k = &x->skins[p->skin];
    double sum = 0, total[3] = {0}, joints[4], shares[4];
    for (size_t s = 0; s < p->nsets; s++) {
        vgi_accessor_get(&p->joints[s], v, joints);
        vgi_accessor_get(&p->shares[s], v, shares);
        for (int i = 0; i < 4; i++) {
            double moved[3];
            if (shares[i] == 0) continue;
            move_point(k->matrices + 12 * (size_t)joints[i], at, moved);
            for (int c = 0; c < 3; c++) total[c] += shares[i] * moved[c];
            sum += shares[i];
        }
    }
    for (int c = 0; c < 3; c++) to[c] = total[c] / sum;
    return sum != 0;
}

static void pose_part(const reading *x, const part *p, double *to)
{
    const node *n = &x->nodes[p->node];
    double d[3], at[3];
    for (size_t i = 0; i < p->nkept; i++) vgi_accessor_get(&p->position, p->kept[i], to + 3 * i);
    for (size_t t = 0; t < p->ntargets; t++) {
        if (n->weights[t] == 0) continue;
        for (size_t i = 0; i < p->nkept; i++) {
            vgi_accessor_get(&p->moved[t], p->kept[i], d);
            for (int k = 0; k < 3; k++) to[3 * i + k] += n->weights[t] * d[k];
        }
    }
    for (size_t i = 0; i < p->nkept; i++) {
        memcpy(at, to + 3 * i, sizeof at);
        if (p->skin == NONE || !bend(x, p, p->kept[i], at, to + 3 * i)) move_point(n->world, at, to + 3 * i);
    }
}

static int pose(reading *x, double *to, vg_err *e)
{
    size_t n = 0;
    place_nodes(x);
    place_joints(x);
    for (size_t i = 0; i < x->nparts; i++) {
        pose_part(x, &x->parts[i], to + 3 * n);
        n += x->parts[i].nkept;
    }
    return vgi_finite(to, 3 * n) ? VG_OK : refuse(x, e, "a position is not a finite number");
}

/* A morph target's name; NULL: it has none. */
static const char *target_name(const reading *x, size_t target)
{
    const vgi_json *mesh;
    for (size_t i = 0; i < x->nparts; i++) {
        const vgi_json *ref = vgi_json_get(x->nodes[x->parts[i].node].json, "mesh");
        if (vgi_gltf_item(&x->g, ref, "meshes", &mesh, NULL, NULL) < 0) continue;
        const char *name = vgi_json_text(
            vgi_json_at(vgi_json_get(vgi_json_get(mesh, "extras"), "targetNames"), target));
        if (name) return name;
    }
    return NULL;
}

static int begin_moment(reading *x, size_t i, vg_frame *f, vg_err *e)
{
    const moment *m = &x->moments[i];
    const clip *c = &x->clips[m->clip];
    const char *name = vgi_json_text(vgi_json_at(c->names, i - c->frames));
    f->has_time = x->nclips == 1, f->time = f->has_time ? m->time : 0; /* else time would start again */
    int r = animate(x, m, e);
    return r == VG_OK && name ? vg_frame_rename(f, name, e) : r;
}

/* Target i - 1 alone; 0: none. */
static int begin_shape(reading *x, size_t i, vg_frame *f, vg_err *e)
{
    const char *name = i ? target_name(x, i - 1) : x->frames > 1 ? "base" : NULL;
    for (size_t n = 0; n < x->nnodes; n++)
        if (i > 0 && i <= x->nodes[n].nweights) x->nodes[n].weights[i - 1] = 1;
    return name ? vg_frame_rename(f, name, e) : VG_OK;
}

int vgi_gltf_next(void *state, vg_frame *f, vg_err *e)
{
    reading *x = state;
    if (x->next == x->frames) return 0;
    rest(x);
    int r = x->nclips ? begin_moment(x, x->next, f, e) : begin_shape(x, x->next, f, e);
    if (r == VG_OK) r = pose(x, f->values, e);
    x->next++;
    return r < 0 ? r : 1;
}

uint64_t vgi_gltf_frames(const void *state)
{
    return ((const reading *)state)->frames;
}

/* ---- opening ---- */

static int take_reference(reading *x, vg_head *h, vg_err *e)
{
    const vgi_json *mesh;
    int r = vgi_gltf_item(&x->g, vgi_json_get(x->nodes[x->parts[0].node].json, "mesh"), "meshes", &mesh, NULL, e);
    if (r < 0) return r;
    const char *name = vgi_json_text(vgi_json_get(mesh, "name"));
    if (name && *name && !(h->reference_name = vgi_copy_string(name, strlen(name), e))) return VG_ENOMEM;
    if (!(h->reference = vgi_array(h->mesh.nv, 3 * sizeof *h->reference, e))) return VG_ENOMEM;
    rest(x);
    return pose(x, h->reference, e);
}

int vgi_gltf_play(void **state, vg_head *h, vgi_input *in, const char *subject, vg_err *e)
{
    reading *x = *state = vgi_array(1, sizeof *x, e);
    faces f = {0};
    if (!x) return VG_ENOMEM;
    int r = vgi_gltf_open(&x->g, in, subject, e);
    if (r == VG_OK) r = read_nodes(x, e);
    if (r == VG_OK) r = read_skins(x, e);
    if (r == VG_OK) r = read_meshes(x, &f, e);
    if (r == VG_OK) r = restore_polygons(x, &f, e);
    if (r == VG_OK) r = weld(x, &f.mesh, e);
    h->mesh = f.mesh;
    h->kind = VG_VERTICES, h->precision = VG_F32, h->count = h->mesh.nv;
    if (r == VG_OK) r = read_animations(x, e);
    return r < 0 ? r : take_reference(x, h, e);
}

void vgi_gltf_close(void *state)
{
    reading *x = state;
    if (!x) return;
    for (size_t i = 0; i < x->nnodes; i++) free(x->nodes[i].weights);
    for (size_t i = 0; i < x->nskins; i++) {
        free(x->skins[i].joints);
        free(x->skins[i].matrices);
    }
    for (size_t i = 0; i < x->nparts; i++) {
        free(x->parts[i].moved);
        free(x->parts[i].kept);
    }
    void *const arrays[] = {x->nodes, x->order, x->skins, x->parts, x->channels, x->clips, x->moments};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    vgi_gltf_clear(&x->g);
    free(x);
}
