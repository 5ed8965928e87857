/* gltf_quantize.c: positions and normals of glTF as whole numbers of 16 and 8 bits (KHR_mesh_quantization). A mesh has a
 * grid: a position is origin + scale * q, where q is a normalised short, and a node or the skin applies origin and scale.
 * Leaves out where the numbers lie in the file (gltf_morph.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_quantize.h"

#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

static const double most_short = 32767, most_byte = 127;
static const double least_length = 0.25; /* of a normal that is shortened */

/* ---- grids ---- */

void vgi_gltf_grid_base(vgi_gltf_grid *g, const float *p, size_t n)
{
    for (size_t v = 0; v < n; v++)
        for (int k = 0; k < 3; k++) {
            const double x = p[3 * v + (size_t)k];
            if (!g->begun || x < g->low[k]) g->low[k] = x;
            if (!g->begun || x > g->high[k]) g->high[k] = x;
            if (k == 2) g->begun = true;
        }
}

void vgi_gltf_grid_target(vgi_gltf_grid *g, const float *d, size_t n)
{
    for (size_t i = 0; i < 3 * n; i++) g->farthest = fmax(g->farthest, fabs((double)d[i]));
}

/* Values that nodes hold are binary64 as text. */
void vgi_gltf_grid_close(vgi_gltf_grid *g)
{
    g->scale = g->farthest;
    for (int k = 0; k < 3; k++) {
        g->origin[k] = (g->low[k] + g->high[k]) / 2;
        g->scale = fmax(g->scale, (g->high[k] - g->low[k]) / 2);
    }
    if (!(g->scale > 0)) g->scale = 1;
}

/* ---- rounding ---- */

static double whole(double x, double most)
{
    return fmax(-most, fmin(most, nearbyint(x * most)));
}

void vgi_gltf_round_positions(const vgi_gltf_grid *g, bool base, float *p, size_t n, float *off)
{
    for (size_t i = 0; i < 3 * n; i++) {
        const double origin = base ? g->origin[i % 3] : 0, x = p[i], q = whole((x - origin) / g->scale, most_short);
        off[i] = (float)(origin + g->scale * q / most_short - x);
        p[i] = (float)q;
    }
}

void vgi_gltf_round_normals(float *n, size_t count)
{
    for (size_t i = 0; i < 3 * count; i++) n[i] = (float)whole(n[i], most_byte);
}

/* The largest length, at most 1, at which the normal base + d is no farther than 1 from base in any coordinate. */
static double length_within(const float *base, const float *d)
{
    double most = 1;
    for (int k = 0; k < 3; k++) {
        const double now = (double)base[k] + d[k];
        if (fabs((double)d[k]) > 1 && now != 0) most = fmin(most, ((now > 0 ? 1 : -1) + base[k]) / now);
    }
    return most;
}

bool vgi_gltf_round_turns(const float *base, float *d, size_t n)
{
    for (size_t v = 0; v < n; v++)
        if (!(length_within(base + 3 * v, d + 3 * v) >= least_length)) return false;
    for (size_t v = 0; v < n; v++) {
        const float *b = base + 3 * v;
        float *t = d + 3 * v;
        if (t[0] == 0 && t[1] == 0 && t[2] == 0) continue;
        const double length = length_within(b, t);
        for (int k = 0; k < 3; k++)
            t[k] = (float)whole(length * ((double)b[k] + t[k]) - whole(b[k], most_byte) / most_byte, most_byte);
    }
    return true;
}

/* ---- the file of a character ---- */

static bool are_finite(const float *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i])) return false;
    return true;
}

/* Inverse bind matrices that take what a grid holds: M T S, columns first. */
bool vgi_gltf_grid_bind(const vgi_gltf_grid *g, const vgi_gltf_skin *k, float *to)
{
    const float *start = to;
    static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (size_t j = 0; j < k->n; j++, to += 16) {
        double m[16];
        memcpy(m, identity, sizeof m);
        if (k->bound) vgi_accessor_get(&k->inverse, j, m);
        for (int i = 0; i < 12; i++) to[i] = (float)(g->scale * m[i]);
        for (int i = 0; i < 4; i++)
            to[12 + i] = (float)(m[i] * g->origin[0] + m[4 + i] * g->origin[1] + m[8 + i] * g->origin[2] + m[12 + i]);
    }
    return are_finite(start, 16 * k->n);
}

static int put_numbers(vgi_json *object, const char *key, const double x[3], vg_err *e)
{
    vgi_json *list = vgi_json_array(e);
    int r = vgi_json_put(object, key, list, e);
    for (int k = 0; k < 3 && r == VG_OK; k++) r = vgi_json_add(list, vgi_json_of_number(x[k], e), e);
    return r;
}

/* In a list of nodes. */
static int replace_node(vgi_json *holder, const char *key, size_t from, size_t to, vg_err *e)
{
    const vgi_json *old = vgi_json_get(holder, key);
    if (!old) return VG_OK;
    vgi_json *list = vgi_json_array(e);
    int r = list ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < vgi_json_count(old) && r == VG_OK; i++) {
        uint64_t node = 0;
        vgi_json_whole(vgi_json_at(old, i), &node);
        r = vgi_json_add(list, vgi_json_of_whole(node == from ? to : node, e), e);
    }
    if (r == VG_OK) return vgi_json_put(holder, key, list, e);
    vgi_json_free(&list);
    return r;
}

static int replace_in(vgi_json *doc, const char *list, const char *key, size_t from, size_t to, vg_err *e)
{
    vgi_json *all = vgi_json_inner(doc, list);
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(all) && r == VG_OK; i++)
        r = replace_node(vgi_json_inner_at(all, i), key, from, to, e);
    return r;
}

static int add_child(vgi_json *node, size_t child, vg_err *e)
{
    static const char key[] = "children";
    if (!vgi_json_get(node, key)) {
        int r = vgi_json_put(node, key, vgi_json_array(e), e);
        if (r < 0) return r;
    }
    return vgi_json_add(vgi_json_inner(node, key), vgi_json_of_whole(child, e), e);
}

/* Animations of a node without morph targets move the one above. */
static int aim_animations(vgi_json *doc, size_t from, size_t to, vg_err *e)
{
    vgi_json *all = vgi_json_inner(doc, "animations");
    int r = VG_OK;
    for (size_t i = 0; i < vgi_json_count(all); i++) {
        vgi_json *channels = vgi_json_inner(vgi_json_inner_at(all, i), "channels");
        for (size_t c = 0; c < vgi_json_count(channels) && r == VG_OK; c++) {
            vgi_json *target = vgi_json_inner(vgi_json_inner_at(channels, c), "target");
            uint64_t node;
            if (vgi_json_whole(vgi_json_get(target, "node"), &node) && node == from)
                r = vgi_json_put(target, "node", vgi_json_of_whole(to, e), e);
        }
    }
    return r;
}

/* The node keeps its number and mesh, so that vertices keep their order; all else goes to a new node above it. */
static int put_above(vgi_json *doc, const vgi_gltf_grid *g, vg_err *e)
{
    vgi_json *nodes = vgi_json_inner(doc, "nodes"), *node = vgi_json_inner_at(nodes, g->node);
    const size_t above = vgi_json_count(nodes);
    const double scale[3] = {g->scale, g->scale, g->scale};
    int r = replace_in(doc, "scenes", "nodes", g->node, above, e);
    if (r == VG_OK) r = replace_in(doc, "nodes", "children", g->node, above, e);
    if (r == VG_OK) r = replace_in(doc, "skins", "joints", g->node, above, e);
    if (r == VG_OK) r = aim_animations(doc, g->node, above, e);
    vgi_json *copy = r == VG_OK ? vgi_json_copy(node, e) : NULL;
    if (!copy) return r < 0 ? r : VG_ENOMEM;
    vgi_json_drop(copy, "mesh");
    if ((r = vgi_json_add(nodes, copy, e)) < 0) return r;
    for (const char *key = vgi_json_key(node, NULL), *next; key; key = next) {
        next = vgi_json_key(node, key);
        if (strcmp(key, "mesh") != 0) vgi_json_drop(node, key);
    }
    r = put_numbers(node, "translation", g->origin, e);
    if (r == VG_OK) r = put_numbers(node, "scale", scale, e);
    return r < 0 ? r : add_child(copy, g->node, e);
}

size_t vgi_gltf_users_of(const vgi_json *document, size_t skin)
{
    const vgi_json *nodes = vgi_json_get(document, "nodes");
    size_t n = 0;
    for (size_t i = 0; i < vgi_json_count(nodes); i++) {
        uint64_t of;
        n += vgi_json_whole(vgi_json_get(vgi_json_at(nodes, i), "skin"), &of) && of == skin;
    }
    return n;
}

/* A skin of its own, with the grid in its inverse bind matrices; the present one if no other node has it. */
static int put_skin(vgi_json *doc, const vgi_gltf_grid *g, vg_err *e)
{
    vgi_json *node = vgi_json_inner_at(vgi_json_inner(doc, "nodes"), g->node), *skins = vgi_json_inner(doc, "skins");
    const bool alone = vgi_gltf_users_of(doc, g->skin) == 1;
    const size_t number = alone ? g->skin : vgi_json_count(skins);
    vgi_json *skin = alone ? vgi_json_inner_at(skins, number) : vgi_json_copy(vgi_json_at(skins, g->skin), e);
    int r = alone ? VG_OK : vgi_json_add(skins, skin, e);
    if (r == VG_OK) r = vgi_json_put(skin, "inverseBindMatrices", vgi_json_of_whole(g->inverse, e), e);
    return r < 0 ? r : vgi_json_put(node, "skin", vgi_json_of_whole(number, e), e);
}

static int require(vgi_json *doc, const char *key, vg_err *e)
{
    const vgi_json *list = vgi_json_get(doc, key);
    for (size_t i = 0; i < vgi_json_count(list); i++) {
        const char *name = vgi_json_text(vgi_json_at(list, i));
        if (name && !strcmp(name, VGI_GLTF_QUANTIZATION)) return VG_OK;
    }
    int r = list ? VG_OK : vgi_json_put(doc, key, vgi_json_array(e), e);
    return r < 0 ? r : vgi_json_add(vgi_json_inner(doc, key), vgi_json_of_text(VGI_GLTF_QUANTIZATION, e), e);
}

int vgi_gltf_put_grids(vgi_json *doc, const vgi_gltf_grid *grids, size_t n, vg_err *e)
{
    int r = require(doc, "extensionsUsed", e);
    if (r == VG_OK) r = require(doc, "extensionsRequired", e);
    for (size_t i = 0; i < n && r == VG_OK; i++) r = grids[i].skinned ? put_skin(doc, &grids[i], e) : put_above(doc, &grids[i], e);
    return r;
}
