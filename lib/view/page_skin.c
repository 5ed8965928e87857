/* page_skin.c: the materials of a character in a page: the material of each face (from its labels), texture
 * coordinates of the corners, and the colour and picture of each material, from the asset of the body. Normal maps,
 * roughness and metalness are ignored.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf.h"
#include "view/page.h"

/* A material used by faces; number 0 is none. */
typedef struct look {
    const char *name; /* borrowed from the labels */
    double colour[3]; /* linear */
    double cutoff;    /* less opaque parts are not drawn; 0: all parts are */
    size_t picture;   /* index into the pictures of the page; SIZE_MAX: none */
} look;

typedef struct skin {
    const vg_body *body;
    vgi_gltf g;
    size_t n, cap, npictures, pictures_cap;
    look *looks;
    size_t *pictures; /* numbers of the asset's images */
} skin;

static void clear_skin(skin *k)
{
    vgi_gltf_clear(&k->g);
    free(k->looks);
    free(k->pictures);
}

/* 1 if opened; 0 if the body has no asset, or one that does not belong to its mesh or cannot be read. */
static int open_asset(skin *k, vg_err *e)
{
    const vg_asset *a = &k->body->asset;
    vgi_input *in = NULL;
    if (!a->n || a->digest != vg_mesh_digest(&k->body->mesh)) return 0;
    int r = vgi_input_memory(&in, a->data, a->size, "asset", e);
    if (r == VG_OK) r = vgi_gltf_open(&k->g, in, "the asset", e);
    vgi_input_free(&in);
    return r == VG_ENOMEM ? r : r < 0 ? 0 : 1;
}

static const vgi_json *material_of(const skin *k, const char *name)
{
    const vgi_json *all = vgi_json_get(k->g.json, "materials");
    for (size_t i = 0; i < vgi_json_count(all); i++) {
        const char *its = vgi_json_text(vgi_json_get(vgi_json_at(all, i), "name"));
        if (its && !strcmp(its, name)) return vgi_json_at(all, i);
    }
    return NULL;
}

/* The type of an image that browsers can show and whose bytes are in the asset; NULL if it is not one. */
static const char *type_of(const skin *k, const vgi_json *image, const unsigned char **data, size_t *n)
{
    static const char *const types[] = {"image/png", "image/jpeg", "image/webp"};
    const char *type = vgi_json_text(vgi_json_get(image, "mimeType"));
    const vgi_json *view = vgi_json_get(image, "bufferView");
    if (!type || !view || vgi_gltf_view_bytes(&k->g, view, data, n, NULL) < 0) return NULL;
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (!strcmp(type, types[i])) return types[i];
    return NULL;
}

/* The picture of a colour texture that uses the coordinates stored in the body; *picture is unchanged if there is
 * none. */
static int take_picture(skin *k, const vgi_json *texture, size_t *picture, vg_err *e)
{
    const vgi_json *of, *image;
    const unsigned char *data;
    double set = 0;
    size_t number, bytes;
    vgi_json_number(vgi_json_get(texture, "texCoord"), &set);
    if (!texture || set != 0 || vgi_json_get(vgi_json_get(texture, "extensions"), "KHR_texture_transform")) return VG_OK;
    if (vgi_gltf_item(&k->g, vgi_json_get(texture, "index"), "textures", &of, NULL, NULL) < 0) return VG_OK;
    if (!vgi_json_get(of, "source") || vgi_gltf_item(&k->g, vgi_json_get(of, "source"), "images", &image, &number, NULL) < 0) return VG_OK;
    if (!type_of(k, image, &data, &bytes)) return VG_OK;
    for (*picture = 0; *picture < k->npictures; ++*picture)
        if (k->pictures[*picture] == number) return VG_OK;
    int r = vgi_grow(&k->pictures, &k->pictures_cap, k->npictures + 1, sizeof *k->pictures, e);
    if (r == VG_OK) k->pictures[k->npictures++] = number;
    return r;
}

static int add_look(skin *k, const char *name, vg_err *e)
{
    const vgi_json *m = material_of(k, name), *pbr = vgi_json_get(m, "pbrMetallicRoughness"), *factor = vgi_json_get(pbr, "baseColorFactor");
    const char *mode = vgi_json_text(vgi_json_get(m, "alphaMode"));
    look l = {.name = name, .colour = {1, 1, 1}, .picture = SIZE_MAX};
    for (size_t i = 0; i < 3; i++) {
        double x = 1;
        if (vgi_json_number(vgi_json_at(factor, i), &x)) l.colour[i] = x < 0 ? 0 : x > 1 ? 1 : x;
    }
    if (mode && !strcmp(mode, "MASK")) {
        l.cutoff = 0.5;
        vgi_json_number(vgi_json_get(m, "alphaCutoff"), &l.cutoff);
    }
    int r = take_picture(k, vgi_json_get(pbr, "baseColorTexture"), &l.picture, e);
    if (r == VG_OK) r = vgi_grow(&k->looks, &k->cap, k->n + 1, sizeof *k->looks, e);
    if (r == VG_OK) k->looks[k->n++] = l;
    return r;
}

/* The number of a material, from 1 on; a new one is added. */
static int number_of(skin *k, const char *name, uint32_t *number, vg_err *e)
{
    size_t i = 0;
    while (i < k->n && strcmp(k->looks[i].name, name)) i++;
    int r = i < k->n ? VG_OK : add_look(k, name, e);
    if (r == VG_OK) *number = (uint32_t)i + 1;
    return r;
}

/* of_face (nf, or NULL): the number of the material of each face. */
static int find_looks(skin *k, uint32_t *of_face, vg_err *e)
{
    const vg_attributes *a = &k->body->attributes;
    uint32_t now = 0;
    size_t label = 0;
    int r = VG_OK;
    for (size_t f = 0; f < k->body->mesh.nf && r == VG_OK; f++) {
        for (; label < a->nlabels && a->labels[label].face <= f && r == VG_OK; label++)
            if (a->labels[label].kind == VG_LABEL_MATERIAL) r = number_of(k, a->labels[label].text, &now, e);
        if (of_face) of_face[f] = now;
    }
    return r;
}

/* Two words per corner: its coordinates as binary32, u to the right, v upwards. */
static int put_coordinates(vg_page *p, size_t i, const vg_body *b, vg_err *e)
{
    const vg_attributes *a = &b->attributes;
    const size_t n = vg_mesh_corners(&b->mesh);
    uint32_t *words = vgi_array(n, 2 * sizeof *words, e);
    if (!words) return VG_ENOMEM;
    for (size_t c = 0; c < n; c++)
        for (uint32_t j = 0; j < 2 && j < a->tex_dim && a->corner_tex[c] != UINT32_MAX; j++) {
            const float x = (float)a->tex[(size_t)a->tex_dim * a->corner_tex[c] + j];
            memcpy(words + 2 * c + j, &x, sizeof x);
        }
    int r = vgi_page_list(p, i, "coordinates", words, 2 * n, false, e);
    free(words);
    return r;
}

int vgi_page_skin_lists(vg_page *p, size_t i, const vg_body *b, vg_err *e)
{
    skin k = {.body = b};
    uint32_t *of_face = NULL;
    int r = open_asset(&k, e);
    if (r > 0) r = (of_face = vgi_array(b->mesh.nf, sizeof *of_face, e)) ? find_looks(&k, of_face, e) : VG_ENOMEM;
    if (r == VG_OK && k.n) r = vgi_page_list(p, i, "materials", of_face, b->mesh.nf, false, e);
    if (r == VG_OK && k.npictures && b->attributes.ntex) r = put_coordinates(p, i, b, e);
    free(of_face);
    clear_skin(&k);
    return r < 0 ? r : VG_OK;
}

static int say_look(vg_bytes *b, const look *l, vg_err *e)
{
    int r = vgi_page_next(b, e);
    if (r == VG_OK) r = vgi_page_raw(b, "{", e);
    if (r == VG_OK) r = vgi_page_field_text(b, "name", l->name, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "colour", l->colour, 3, e);
    if (r == VG_OK && l->cutoff > 0) r = vgi_page_field_number(b, "cutoff", l->cutoff, e);
    if (r == VG_OK && l->picture != SIZE_MAX) r = vgi_page_field_number(b, "picture", (double)l->picture, e);
    return r == VG_OK ? vgi_page_raw(b, "}", e) : r;
}

static int say_picture(vg_bytes *b, const skin *k, size_t i, vg_err *e)
{
    const unsigned char *data = NULL;
    size_t n = 0;
    const char *type = type_of(k, vgi_json_at(vgi_json_get(k->g.json, "images"), k->pictures[i]), &data, &n);
    int r = vgi_page_next(b, e);
    if (r == VG_OK) r = vgi_page_raw(b, "\"data:", e);
    if (r == VG_OK) r = vgi_page_raw(b, type, e);
    if (r == VG_OK) r = vgi_page_raw(b, ";base64,", e);
    if (r == VG_OK) r = vgi_base64(b, data, n, e);
    return r == VG_OK ? vgi_page_raw(b, "\"", e) : r;
}

int vgi_page_skin_facts(vg_bytes *b, const vg_body *body, vg_err *e)
{
    skin k = {.body = body};
    vg_bytes looks = {0}, pictures = {0};
    int r = open_asset(&k, e);
    if (r > 0) r = find_looks(&k, NULL, e);
    for (size_t i = 0; i < k.n && r == VG_OK; i++) r = say_look(&looks, k.looks + i, e);
    for (size_t i = 0; i < k.npictures && r == VG_OK; i++) r = say_picture(&pictures, &k, i, e);
    if (r == VG_OK && k.n) r = vgi_page_field_list(b, "materials", &looks, e);
    if (r == VG_OK && k.npictures) r = vgi_page_field_list(b, "pictures", &pictures, e);
    vg_bytes_clear(&looks);
    vg_bytes_clear(&pictures);
    clear_skin(&k);
    return r < 0 ? r : VG_OK;
}
