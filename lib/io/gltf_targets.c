/* gltf_targets.c: how the base and the morph targets of glTF lie in the file: whole or sparse, as binary32 or whole numbers.
 * Leaves out what they are (gltf_morph.c), and the arithmetic of whole numbers (gltf_quantize.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_morph.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { SPARSE_WORDS = 160, BIND = 64 }; /* bytes: of the JSON of a sparse accessor, of a matrix */

/* ---- layout of targets in the file ---- */

vgi_gltf_laid *vgi_gltf_lying(const vgi_gltf_morphs *x, size_t t, size_t l, int sort)
{
    return &x->at[(t * x->nlists + l) * VGI_GLTF_SORTS + (size_t)sort];
}

static int sorts_of(const vgi_gltf_list *l)
{
    return l->tangents ? VGI_GLTF_SORTS : l->normals ? VGI_GLTF_TANGENTS : VGI_GLTF_NORMALS;
}

static int sorts_of_base(const vgi_gltf_list *l)
{
    return l->normals ? VGI_GLTF_TANGENTS : VGI_GLTF_NORMALS;
}

static bool moves(const float *d, size_t v)
{
    return d[3 * v] != 0 || d[3 * v + 1] != 0 || d[3 * v + 2] != 0;
}

static size_t index_bytes(const vgi_gltf_list *list)
{
    return list->count <= 65536 ? 2 : 4;
}

/* Size of the indices of n vertices, padded to a multiple of 4. */
static size_t indices_size(const vgi_gltf_list *list, size_t n)
{
    return (n * index_bytes(list) + 3) / 4 * 4;
}

/* ---- whole numbers: every node's mesh has a grid ---- */

static double longest_off(const vgi_gltf_writing *w, const vgi_gltf_list *l, const float *a, const float *b)
{
    double most = 0;
    for (size_t v = l->first; v < l->first + l->count; v++) {
        double d[3], shown[3];
        for (size_t k = 0; k < 3; k++) d[k] = (double)a[3 * v + k] + (b ? b[3 * v + k] : 0);
        memcpy(shown, d, sizeof d);
        for (int k = 0; k < 3 && w->character; k++) shown[k] = vgi_dot(w->character->out + 12 * v + 4 * k, d);
        most = fmax(most, vgi_length(shown));
    }
    return most;
}

/* Lists of one node follow one another, and have one grid. */
static void share_grids(vgi_gltf_writing *w)
{
    vgi_gltf_morphs *x = w->own;
    for (size_t i = 0; i < x->nlists; i++) {
        const vgi_gltf_part *p = w->character ? &w->character->scene.parts[i] : NULL;
        if (p && w->whole && p->ntargets) continue; /* its own targets stay as they are, and so does its base */
        if (!p || i == 0 || p->node != p[-1].node) {
            vgi_gltf_grid *g = &x->grids[x->ngrids++];
            if (p) g->node = p->node, g->skinned = p->skin != VGI_GLTF_NONE, g->skin = g->skinned ? (size_t)p->skin : 0;
        }
        x->lists[i].grid = &x->grids[x->ngrids - 1];
    }
}

static vgi_gltf_grid *grid_of(const vgi_gltf_morphs *x, size_t l)
{
    return &x->grids[x->lists[l].grid - x->grids];
}

static int find_grids(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists; i++)
        if (x->lists[i].grid) vgi_gltf_grid_base(grid_of(x, i), x->base[VGI_GLTF_POSITIONS] + 3 * x->lists[i].first, x->lists[i].count);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        r = vgi_gltf_load_target(w, t, e);
        for (size_t i = 0; i < x->nlists && r == VG_OK; i++)
            vgi_gltf_grid_target(grid_of(x, i), x->file[VGI_GLTF_POSITIONS] + 3 * x->lists[i].first, x->lists[i].count);
    }
    for (size_t i = 0; i < x->ngrids; i++) vgi_gltf_grid_close(&x->grids[i]);
    return r;
}

/* The base becomes one of whole numbers; what it was stays for the poses. */
static int round_the_base(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    for (int s = 0; s < (x->base[VGI_GLTF_NORMALS] ? VGI_GLTF_TANGENTS : VGI_GLTF_NORMALS); s++) {
        if (!(x->rounded[s] = vgi_array_raw(x->n, VGI_GLTF_POINT, e))) return VG_ENOMEM;
        memcpy(x->rounded[s], x->base[s], VGI_GLTF_POINT * x->n);
        x->exact[s] = x->base[s], x->base[s] = x->rounded[s];
    }
    for (size_t i = 0; i < x->nlists; i++) {
        const vgi_gltf_list *l = &x->lists[i];
        if (!l->grid) continue;
        vgi_gltf_round_positions(l->grid, true, x->rounded[VGI_GLTF_POSITIONS] + 3 * l->first, l->count, x->off[0] + 3 * l->first);
        if (l->normals) vgi_gltf_round_normals(x->rounded[VGI_GLTF_NORMALS] + 3 * l->first, l->count);
        x->base_off = fmax(x->base_off, longest_off(w, l, x->off[0], NULL));
    }
    x->worst = x->base_off;
    return VG_OK;
}

int vgi_gltf_quantize(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    x->grids = vgi_array(x->nlists, sizeof *x->grids, e);
    x->off[0] = vgi_array(x->n, VGI_GLTF_POINT, e), x->off[1] = vgi_array(x->n, VGI_GLTF_POINT, e);
    x->target_off = vgi_array(x->targets + 1, sizeof *x->target_off, e);
    if (!x->grids || !x->off[0] || !x->off[1] || !x->target_off) return VG_ENOMEM;
    x->based = false;
    share_grids(w);
    int r = find_grids(w, e);
    if (r == VG_OK) r = round_the_base(w, e);
    return r == VG_OK && w->character ? vgi_gltf_find_touches(w->character, x->base[VGI_GLTF_POSITIONS], e) : r;
}

/* The target at work; the error of a frame that it is by itself is that of both. */
static void round_target(vgi_gltf_writing *w, size_t t)
{
    vgi_gltf_morphs *x = w->own;
    for (size_t i = 0; i < x->nlists; i++) {
        const vgi_gltf_list *l = &x->lists[i];
        const size_t at = 3 * l->first;
        vgi_gltf_round_positions(l->grid, false, x->file[VGI_GLTF_POSITIONS] + at, l->count, x->off[1] + at);
        vgi_gltf_lying(x, t, i, VGI_GLTF_POSITIONS)->kind = VGI_GLTF_SHORTS;
        if (l->normals && vgi_gltf_round_turns(x->exact[VGI_GLTF_NORMALS] + at, x->file[VGI_GLTF_NORMALS] + at, l->count))
            vgi_gltf_lying(x, t, i, VGI_GLTF_NORMALS)->kind = VGI_GLTF_BYTES;
        x->target_off[t] = fmax(x->target_off[t], longest_off(w, l, x->off[1], NULL));
        x->worst = fmax(x->worst, longest_off(w, l, x->off[0], x->off[1]));
    }
}

/* Of a vertex, over all frames, at most: of mixing and of rounding. */
double vgi_gltf_largest_error(const vgi_gltf_writing *w)
{
    const vgi_gltf_morphs *x = w->own;
    double most = 0;
    if (x->chosen) return x->worst;
    for (size_t f = 0; f < w->frames && x->target_off; f++) {
        double sum = x->base_off;
        for (size_t t = 0; t < x->targets; t++) sum += fabs((double)x->basis.weights[f * x->targets + t]) * x->target_off[t];
        most = fmax(most, sum);
    }
    return x->basis.error + most;
}

/* ---- how targets lie, once they are known ---- */

/* Of n points, as they lie behind one another in a sparse accessor. */
static size_t values_size(const vgi_gltf_laid *l)
{
    return (l->moved * vgi_gltf_kinds[l->kind].bytes + 3) / 4 * 4;
}

static void look_at(vgi_gltf_laid *l, const vgi_gltf_list *list, const float *d)
{
    const size_t n = list->count;
    l->moved = 0;
    for (size_t v = 0; v < n; v++) l->moved += moves(d, v);
    if (!l->moved) l->moved = 1; /* at least one is required: the first vertex */
    l->sparse = indices_size(list, l->moved) + values_size(l) + SPARSE_WORDS < vgi_gltf_kinds[l->kind].stride * n;
    vgi_gltf_bounds(d, n, l->bounds);
}

int vgi_gltf_look_at_targets(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    int r = (x->at = vgi_array(x->targets, x->nlists * VGI_GLTF_SORTS * sizeof *x->at, e)) ? VG_OK : VG_ENOMEM;
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
        if ((r = vgi_gltf_load_target(w, t, e)) < 0) break;
        if (x->quantize) round_target(w, t);
        for (size_t l = 0; l < x->nlists; l++)
            for (int s = 0; s < sorts_of(&x->lists[l]); s++)
                look_at(vgi_gltf_lying(x, t, l, s), &x->lists[l], x->file[s] + 3 * x->lists[l].first);
    }
    return r;
}

/* ---- JSON ---- */

static const char *normalized(vgi_gltf_numbers kind)
{
    return kind == VGI_GLTF_FLOATS ? "" : ",\"normalized\":true";
}

static int say_sparse(vgi_gltf_writing *w, const vgi_gltf_list *list, const vgi_gltf_laid *l, size_t view, size_t indices,
                      size_t values, vg_err *e)
{
    int r = vgi_gltf_say(&w->accessors, e,
                         ",\n{\"componentType\":%d,\"count\":%zu,\"type\":\"VEC3\"%s,\"sparse\":{\"count\":%zu,"
                         "\"indices\":{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d},"
                         "\"values\":{\"bufferView\":%zu,\"byteOffset\":%zu}}",
                         vgi_gltf_kinds[l->kind].component, list->count, normalized(l->kind), l->moved, view, indices,
                         index_bytes(list) == 2 ? VGI_GLTF_USHORT : VGI_GLTF_UINT, view + 1, values);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"min\":[", l->bounds, 3, "]", e);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"max\":[", l->bounds + 3, 3, "]}", e);
    w->naccessors++;
    return r;
}

/* Where the next accessors begin: in the views of whole points, of indices and of values. */
typedef struct places {
    size_t whole[VGI_GLTF_KINDS], points[VGI_GLTF_KINDS]; /* whole: the views */
    size_t view, indices, values;                         /* view: of indices; that of values is the next */
} places;

static int describe_whole(vgi_gltf_writing *w, places *at, const vgi_gltf_list *list, vgi_gltf_numbers kind,
                          const double bounds[6], vg_err *e)
{
    int r = vgi_gltf_say(&w->accessors, e,
                         "%s{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d,\"count\":%zu,\"type\":\"VEC3\"%s",
                         w->naccessors ? ",\n" : "", at->whole[kind], at->points[kind], vgi_gltf_kinds[kind].component,
                         list->count, normalized(kind));
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"min\":[", bounds, 3, "]", e);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->accessors, ",\"max\":[", bounds + 3, 3, "]}", e);
    w->naccessors++;
    at->points[kind] += vgi_gltf_kinds[kind].stride * list->count;
    return r;
}

static vgi_gltf_numbers kind_of_base(const vgi_gltf_list *l, int sort)
{
    return !l->grid ? VGI_GLTF_FLOATS : sort == VGI_GLTF_POSITIONS ? VGI_GLTF_SHORTS : VGI_GLTF_BYTES;
}

/* Whether the base of this list is written; else it is that of the character's file. */
static bool has_base(const vgi_gltf_morphs *x, const vgi_gltf_list *l)
{
    return !x->based && (l->grid || !x->grids);
}

static int describe_base(vgi_gltf_writing *w, places *at, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK; i++) {
        vgi_gltf_list *l = &x->lists[i];
        if (!has_base(x, l)) continue;
        for (int s = 0; s < sorts_of_base(l) && r == VG_OK; s++) {
            double bounds[6];
            vgi_gltf_bounds(x->base[s] + 3 * l->first, l->count, bounds);
            *(s == VGI_GLTF_NORMALS ? &l->normal : &l->position) = w->naccessors;
            r = describe_whole(w, at, l, kind_of_base(l, s), bounds, e);
        }
    }
    return r;
}

static int describe_target(vgi_gltf_writing *w, places *at, size_t t, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]) && r == VG_OK; s++) {
            vgi_gltf_laid *l = vgi_gltf_lying(x, t, i, s);
            l->accessor = w->naccessors;
            if (!l->sparse) {
                r = describe_whole(w, at, &x->lists[i], l->kind, l->bounds, e);
                continue;
            }
            r = say_sparse(w, &x->lists[i], l, at->view, at->indices, at->values, e);
            at->indices += indices_size(&x->lists[i], l->moved), at->values += values_size(l);
        }
    return r;
}

static size_t whole_bytes(const vgi_gltf_morphs *x, vgi_gltf_numbers kind)
{
    size_t points = 0;
    for (size_t i = 0; i < x->nlists; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]); s++) {
            if (s < sorts_of_base(&x->lists[i]) && has_base(x, &x->lists[i]) && kind_of_base(&x->lists[i], s) == kind) points += x->lists[i].count;
            for (size_t t = 0; t < x->targets; t++)
                if (!vgi_gltf_lying(x, t, i, s)->sparse && vgi_gltf_lying(x, t, i, s)->kind == kind) points += x->lists[i].count;
        }
    return vgi_gltf_kinds[kind].stride * points;
}

/* The base and the targets that are there whole are one view for each kind of numbers; indices and values of the others two
 * more. */
int vgi_gltf_describe_targets(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    places at = {.view = 0};
    int r = VG_OK;
    for (int k = 0; k < VGI_GLTF_KINDS && r == VG_OK; k++) {
        char more[60];
        const size_t bytes = whole_bytes(x, (vgi_gltf_numbers)k);
        at.whole[k] = w->nviews;
        snprintf(more, sizeof more, ",\"target\":34962,\"byteStride\":%zu", vgi_gltf_kinds[k].stride);
        if (bytes) r = vgi_gltf_view(w, bytes, more, e);
    }
    at.view = w->nviews;
    if (r == VG_OK) r = describe_base(w, &at, e);
    for (size_t t = 0; t < x->targets && r == VG_OK; t++) r = describe_target(w, &at, t, e);
    if (r == VG_OK && at.indices) r = vgi_gltf_view(w, at.indices, "", e);
    return r == VG_OK && at.indices ? vgi_gltf_view(w, at.values, "", e) : r;
}

/* Skins of their own for what has a grid. */
int vgi_gltf_describe_binds(vgi_gltf_writing *w, vg_err *e)
{
    vgi_gltf_morphs *x = w->own;
    size_t joints = 0, off = 0;
    for (size_t i = 0; i < x->ngrids; i++)
        if (x->grids[i].skinned) joints += w->character->scene.skins[x->grids[i].skin].n;
    int r = joints ? vgi_gltf_view(w, BIND * joints, "", e) : VG_OK;
    for (size_t i = 0; i < x->ngrids && r == VG_OK; i++) {
        vgi_gltf_grid *g = &x->grids[i];
        if (!g->skinned) continue;
        g->inverse = w->naccessors;
        r = vgi_gltf_say_accessor(w, off, VGI_GLTF_FLOAT, w->character->scene.skins[g->skin].n, "MAT4", NULL, 0, e);
        off += BIND * w->character->scene.skins[g->skin].n;
    }
    return r;
}

/* ---- bytes ---- */

static int emit_indices(vgi_gltf_writing *w, const vgi_gltf_list *list, const vgi_gltf_laid *l, const float *d, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    const size_t step = index_bytes(list);
    unsigned char *p = x->packed, *start = p;
    for (size_t v = 0; v < list->count; v++) {
        if (!moves(d, v)) continue;
        p[0] = (unsigned char)v, p[1] = (unsigned char)(v >> 8);
        if (step == 4) p[2] = (unsigned char)(v >> 16), p[3] = (unsigned char)(v >> 24);
        p += step;
    }
    if (p == start) memset(p, 0, step), p += step;
    const size_t size = indices_size(list, l->moved);
    memset(p, 0, size - (size_t)(p - start));
    return vgi_gltf_emit(w, start, size, e);
}

static int emit_values(vgi_gltf_writing *w, const vgi_gltf_list *list, const vgi_gltf_laid *l, const float *d, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    size_t n = 0;
    for (size_t v = 0; v < list->count; v++)
        if (moves(d, v)) memmove(x->moving + 3 * n++, d + 3 * v, VGI_GLTF_POINT);
    if (!n) memcpy(x->moving, d, VGI_GLTF_POINT), n = 1;
    return vgi_gltf_emit_points(w, l->kind, x->moving, n, false, e);
}

/* Rounds below VGI_GLTF_KINDS are of what is there whole, in numbers of that kind. */
enum { INDICES = VGI_GLTF_KINDS, VALUES, ROUNDS };

static bool has_part_in(const vgi_gltf_laid *l, int round)
{
    return l->sparse ? round >= INDICES : round == (int)l->kind;
}


static int emit_target(vgi_gltf_writing *w, size_t t, int round, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]) && r == VG_OK; s++) {
            const vgi_gltf_list *list = &x->lists[i];
            const vgi_gltf_laid *l = vgi_gltf_lying(x, t, i, s);
            const float *d = x->file[s] + 3 * list->first;
            if (!has_part_in(l, round)) continue;
            r = round < INDICES    ? vgi_gltf_emit_points(w, l->kind, d, list->count, true, e)
                : round == INDICES ? emit_indices(w, list, l, d, e)
                                   : emit_values(w, list, l, d, e);
        }
    return r;
}

static bool has_round(const vgi_gltf_morphs *x, size_t t, int round)
{
    for (size_t i = 0; i < x->nlists; i++)
        for (int s = 0; s < sorts_of(&x->lists[i]); s++)
            if (has_part_in(vgi_gltf_lying(x, t, i, s), round)) return true;
    return false;
}

static int emit_base(vgi_gltf_writing *w, int kind, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->nlists && r == VG_OK; i++)
        for (int s = 0; s < sorts_of_base(&x->lists[i]) && r == VG_OK && has_base(x, &x->lists[i]); s++)
            if ((int)kind_of_base(&x->lists[i], s) == kind)
                r = vgi_gltf_emit_points(w, kind_of_base(&x->lists[i], s), x->base[s] + 3 * x->lists[i].first,
                                         x->lists[i].count, true, e);
    return r;
}

static int emit_binds(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    int r = VG_OK;
    for (size_t i = 0; i < x->ngrids && r == VG_OK; i++) {
        if (!x->grids[i].skinned) continue;
        const vgi_gltf_skin *k = &w->character->scene.skins[x->grids[i].skin];
        float *matrices = vgi_array_raw(k->n, BIND, e);
        if (!matrices) return VG_ENOMEM;
        r = vgi_gltf_grid_bind(&x->grids[i], k, matrices)
                ? vgi_gltf_emit_singles(w, matrices, 16 * k->n, e)
                : vg_fail(e, VG_EINPUT, "the frames are too large to be quantized in binary32");
        free(matrices);
    }
    return r;
}

/* First those that are whole, kind by kind, then the indices of the others, then their values. */
int vgi_gltf_emit_targets(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_morphs *x = w->own;
    int r = emit_binds(w, e);
    for (int round = 0; round < ROUNDS && r == VG_OK; round++) {
        r = emit_base(w, round, e);
        for (size_t t = 0; t < x->targets && r == VG_OK; t++) {
            if (!has_round(x, t, round)) continue;
            r = vgi_gltf_load_target(w, t, e);
            if (r == VG_OK && x->quantize) round_target(w, t);
            if (r == VG_OK) r = emit_target(w, t, round, e);
        }
    }
    return r;
}
