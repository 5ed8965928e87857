/* mtl.c: materials of an OBJ, from the MTL file beside it, as an asset: a GLB with only materials, textures and
 * images, which the GLB writer finds by the names of usemtl. The OBJ itself is read in obj.c. Illumination models,
 * reflections and displacement are ignored.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_pack.h"

#include <math.h>
#include <stdlib.h>

typedef struct making {
    vgi_gltf_packing pack;
    vgi_json *materials, *textures, *images; /* borrowed from the document */
    vgi_json *now, *pbr;                     /* the current material; NULL: none yet */
    vgi_names files;                         /* of the images, in order */
} making;

/* ---- images ---- */

/* Look for the name in the file, then for its last component beside the file, because paths often refer to another
 * machine. */
static int read_image(making *k, const char *name, vg_bytes *to)
{
    const char *base = name;
    if (vgi_gltf_read_beside(k->pack.g, k->pack.in, name, to, NULL) == VG_OK) return VG_OK;
    for (const char *p = name; *p; p++)
        if (*p == '/' || *p == '\\') base = p + 1;
    to->size = 0;
    return base == name ? VG_EINPUT : vgi_gltf_read_beside(k->pack.g, k->pack.in, base, to, NULL);
}

/* The number of the texture with this image; -1 if it cannot be read. */
static int find_texture(making *k, const char *name, int *number, vg_err *e)
{
    vg_bytes bytes = {0};
    for (size_t i = 0; i < k->files.n; i++)
        if (!strcmp(k->files.at[i], name)) return *number = (int)i, VG_OK;
    *number = -1;
    const char *type = read_image(k, name, &bytes) == VG_OK ? vgi_gltf_image_type(bytes.data, bytes.size) : NULL;
    if (!type || !strcmp(type, "image/webp") || !strcmp(type, "image/ktx2")) {
        vgi_note(k->pack.note, "the image '%.60s' of its materials is missing, or is not PNG or JPEG", name);
        vg_bytes_clear(&bytes);
        return VG_OK;
    }
    vgi_json *image = vgi_json_object(e), *texture = vgi_json_object(e);
    int r = vgi_json_add(k->images, image, e), s = vgi_json_add(k->textures, texture, e);
    if (r == VG_OK && s == VG_OK) r = vgi_gltf_embed(&k->pack, image, bytes.data, bytes.size, type, e);
    if (r == VG_OK) r = s;
    if (r == VG_OK) r = vgi_json_put(image, "name", vgi_json_of_text(name, e), e);
    if (r == VG_OK) r = vgi_json_put(texture, "source", vgi_json_of_whole(k->files.n, e), e);
    if (r == VG_OK) r = vgi_names_add(&k->files, name, strlen(name), e);
    if (r == VG_OK) *number = (int)k->files.n - 1;
    vg_bytes_clear(&bytes);
    return r;
}

/* "map_Kd -s 1 1 1 cloth.png": the name follows the options; it may contain blanks if there are no options. */
static char *image_name(const vgi_line *l, vg_err *e)
{
    const char *at = l->at[0].end, *begin = l->at[1].begin, *end = l->end;
    vgi_field f = {0};
    if (*begin == '-')
        while (vgi_line_more(l, &at, &f)) begin = f.begin;
    while (end > begin && (end[-1] == ' ' || end[-1] == '\t' || end[-1] == '\r')) end--;
    return vgi_to_utf8(begin, (size_t)(end - begin), e);
}

static int put_texture(making *k, vgi_json *holder, const char *key, const vgi_line *l, vg_err *e)
{
    char *name = image_name(l, e);
    int number = -1, r = name ? find_texture(k, name, &number, e) : VG_ENOMEM;
    free(name);
    if (r < 0 || number < 0) return r;
    vgi_json *info = vgi_json_object(e);
    r = vgi_json_put(holder, key, info, e);
    return r < 0 ? r : vgi_json_put(info, "index", vgi_json_of_whole((uint64_t)number, e), e);
}

/* ---- materials ---- */

static int add_number(vgi_json *list, double x, vg_err *e)
{
    return vgi_json_add(list, vgi_json_of_number(fmax(0, fmin(1, x)), e), e);
}

static int put_list(vgi_json *holder, const char *key, const double *x, size_t n, vg_err *e)
{
    vgi_json *list = vgi_json_array(e);
    int r = vgi_json_put(holder, key, list, e);
    for (size_t i = 0; i < n && r == VG_OK; i++) r = add_number(list, x[i], e);
    return r;
}

static int begin_material(making *k, const vgi_line *l, vg_err *e)
{
    const char *end = l->end;
    while (end > l->at[1].begin && (end[-1] == ' ' || end[-1] == '\t' || end[-1] == '\r')) end--;
    char *name = vgi_to_utf8(l->at[1].begin, (size_t)(end - l->at[1].begin), e);
    int r = name ? vgi_json_add(k->materials, k->now = vgi_json_object(e), e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_json_put(k->now, "name", vgi_json_of_text(name, e), e);
    if (r == VG_OK) r = vgi_json_put(k->now, "pbrMetallicRoughness", k->pbr = vgi_json_object(e), e);
    if (r == VG_OK) r = vgi_json_put(k->pbr, "metallicFactor", vgi_json_of_whole(0, e), e);
    free(name);
    return r;
}

/* Set the base colour and its opacity, either of which may be NULL. */
static int put_colour(making *k, const double *rgb, const double *alpha, vg_err *e)
{
    static const char key[] = "baseColorFactor";
    double x[4] = {1, 1, 1, 1};
    for (size_t i = 0; i < 4; i++) vgi_json_number(vgi_json_at(vgi_json_get(k->pbr, key), i), &x[i]);
    for (int i = 0; rgb && i < 3; i++) x[i] = rgb[i];
    if (alpha) x[3] = *alpha;
    int r = put_list(k->pbr, key, x, 4, e);
    return r < 0 || x[3] >= 1 ? r : vgi_json_put(k->now, "alphaMode", vgi_json_of_text("BLEND", e), e);
}

static int put_factor(vgi_json *holder, const char *key, double x, vg_err *e)
{
    return vgi_json_put(holder, key, vgi_json_of_number(fmax(0, fmin(1, x)), e), e);
}

static int take_line(making *k, const vgi_line *l, vg_err *e)
{
    static const double white[3] = {1, 1, 1};
    const vgi_field *word = &l->at[0];
    double x[3] = {0};
    size_t n = 0;
    if (l->n < 2) return VG_OK;
    if (vgi_field_is(word, "newmtl")) return begin_material(k, l, e);
    if (!k->now) return VG_OK;
    if (vgi_field_is(word, "map_Kd")) {
        int r = put_colour(k, white, NULL, e);
        return r < 0 ? r : put_texture(k, k->pbr, "baseColorTexture", l, e);
    }
    if (vgi_field_is(word, "norm") || vgi_field_is(word, "map_Kn")) return put_texture(k, k->now, "normalTexture", l, e);
    if (vgi_field_is(word, "map_Ke")) {
        int r = put_list(k->now, "emissiveFactor", white, 3, e);
        return r < 0 ? r : put_texture(k, k->now, "emissiveTexture", l, e);
    }
    while (n < 3 && n + 1 < l->n && vgi_field_number(&l->at[n + 1], &x[n])) n++;
    if (n == 3 && vgi_field_is(word, "Kd")) return put_colour(k, vgi_json_get(k->pbr, "baseColorTexture") ? white : x, NULL, e);
    if (n == 3 && vgi_field_is(word, "Ke")) return put_list(k->now, "emissiveFactor", x, 3, e);
    if (n == 1 && vgi_field_is(word, "d")) return put_colour(k, NULL, x, e);
    if (n == 1 && vgi_field_is(word, "Tr")) return put_colour(k, NULL, &(double){1 - x[0]}, e);
    if (n == 1 && vgi_field_is(word, "Ns")) return put_factor(k->pbr, "roughnessFactor", sqrt(2 / (fmax(0, x[0]) + 2)), e);
    if (n == 1 && vgi_field_is(word, "Pr")) return put_factor(k->pbr, "roughnessFactor", x[0], e);
    return n == 1 && vgi_field_is(word, "Pm") ? put_factor(k->pbr, "metallicFactor", x[0], e) : VG_OK;
}

/* One library, with its file `in`; images are beside it. */
static int read_library(making *k, const vgi_gltf *g, vgi_input *in, vg_err *e)
{
    vg_bytes text = {0};
    vgi_line l;
    k->pack.g = g, k->pack.in = in, k->now = NULL;
    int r = vgi_input_slurp_text(in, &text, e);
    vgi_lines t = vgi_lines_of(text.data, text.size, g->subject);
    while (r == VG_OK && vgi_lines_next(&t, &l)) r = take_line(k, &l, e);
    vg_bytes_clear(&text);
    return r;
}

/* The file of a library beside the OBJ; NULL if there is none. */
static vgi_input *open_library(const char *path, const char *name)
{
    const size_t n = (size_t)(vgi_base_name(path) - path), size = n + strlen(name) + 1;
    vgi_input *in = NULL;
    if (*name == '/' || strstr(name, "..")) return NULL;
    char *file = vgi_array(size, 1, NULL);
    if (!file) return NULL;
    memcpy(file, path, n);
    memcpy(file + n, name, size - n - 1);
    if (vgi_input_file(&in, file, NULL) < 0) in = NULL;
    free(file);
    return in;
}

static int read_libraries(making *k, const vg_attributes *a, const char *path, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < a->nlabels && r == VG_OK; i++) {
        const char *name = a->labels[i].text;
        if (a->labels[i].kind != VG_LABEL_LIBRARY) continue;
        vgi_input *in = open_library(path, name);
        const vgi_gltf g = {.subject = name};
        if (in) r = read_library(k, &g, in, e);
        vgi_input_free(&in);
    }
    return r;
}

static int begin_asset(making *k, vgi_json **asset, vg_err *e)
{
    int r = vgi_gltf_pack_begin(&k->pack, e);
    if (r == VG_OK) r = vgi_json_put(k->pack.doc, "asset", *asset = vgi_json_object(e), e);
    if (r == VG_OK) r = vgi_json_put(*asset, "version", vgi_json_of_text("2.0", e), e);
    if (r == VG_OK) r = vgi_json_put(k->pack.doc, "materials", k->materials = vgi_json_array(e), e);
    if (r == VG_OK) r = vgi_json_put(k->pack.doc, "textures", k->textures = vgi_json_array(e), e);
    return r < 0 ? r : vgi_json_put(k->pack.doc, "images", k->images = vgi_json_array(e), e);
}

static bool has_library(const vg_attributes *a)
{
    for (size_t i = 0; i < a->nlabels; i++)
        if (a->labels[i].kind == VG_LABEL_LIBRARY) return true;
    return false;
}

static int put_asset(making *k, vg_body *b, vg_err *e)
{
    vg_bytes file = {0};
    int r = vgi_gltf_pack_end(&k->pack, &file, e);
    uint32_t *vertex = r == VG_OK ? vgi_array(b->mesh.nv, sizeof *vertex, e) : NULL;
    if (!vertex) return vg_bytes_clear(&file), VG_ENOMEM;
    for (size_t v = 0; v < b->mesh.nv; v++) vertex[v] = (uint32_t)v;
    b->asset = (vg_asset){b->mesh.nv, vg_mesh_digest(&b->mesh), vertex, file.size, file.data};
    return VG_OK;
}

int vgi_take_materials(vg_body *b, const char *path, vg_note *note, vg_err *e)
{
    making k = {.pack.note = note};
    vgi_json *asset = NULL;
    if (!has_library(&b->attributes) || !b->mesh.nv) return VG_OK;
    int r = begin_asset(&k, &asset, e);
    if (r == VG_OK) r = read_libraries(&k, &b->attributes, path, e);
    if (r == VG_OK && vgi_json_count(k.materials)) {
        if (!k.files.n) vgi_json_drop(k.pack.doc, "textures"), vgi_json_drop(k.pack.doc, "images");
        r = put_asset(&k, b, e);
    }
    vgi_gltf_pack_clear(&k.pack);
    vgi_names_clear(&k.files);
    return r;
}
