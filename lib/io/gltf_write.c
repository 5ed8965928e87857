/* gltf_write.c: writes a sequence as a glTF file: a mesh, an animation with a time for each frame, and the bytes of
 * both. Motion is in gltf_morph.c (morph targets) or gltf_skin.c (skin), splitting at texture seams in gltf_seams.c,
 * normals in gltf_normals.c.
 *
 * The frames wait in an unnamed file.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_write.h"
#include "model/colour.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <unistd.h>

enum { COLOUR = 8 }; /* bytes */


/* ---- supported input ---- */

static int check_skin(const vg_head *h, const char *output, vg_err *e)
{
    const char *lacks = NULL;
    if (!h->body.rig.skeleton.njoints)
        lacks = "the input holds transforms without a skeleton: convert them to vertices with 'vg-play MAP' first";
    else if (!h->body.rig.skin_bone)
        lacks = "the rig of the input has no weights: convert it to vertices with 'vg-play MAP' first";
    else if (h->count != h->body.rig.nbones) lacks = "the input has a different number of transforms than its rig "
                                                     "has bones";
    return lacks ? vg_fail(e, VG_EINPUT, "cannot write '%s': %s", output, lacks) : VG_OK;
}

int vgi_gltf_check(const vg_head *h, const char *output, vg_err *e)
{
    int r = h->kind == VG_TRANSFORMS ? check_skin(h, output, e) : VG_OK;
    if (r < 0 || h->body.mesh.nv) return r;
    return vg_fail(e, VG_EINPUT, "cannot write '%s': a mesh of glTF must have vertices", output);
}

/* ---- frames ---- */

void vgi_gltf_put_single(unsigned char *to, float x)
{
    vgi_put32(to, vgi_float_bits(x));
}

float vgi_gltf_get_single(const unsigned char *p)
{
    return vgi_as_float(vgi_get32(p));
}

static int round_base(vgi_gltf_writing *w, vg_err *e)
{
    if (!(w->base = vgi_array_raw(w->seams.n, VGI_GLTF_POINT, e))) return VG_ENOMEM;
    for (size_t i = 0; i < 3 * w->h->body.mesh.nv; i++) {
        w->base[i] = (float)w->h->body.reference[i];
        if (!isfinite(w->base[i])) return vg_fail(e, VG_EINPUT, "a position is too large for binary32");
    }
    for (size_t v = w->seams.nv; v < w->seams.n; v++)
        memcpy(w->base + 3 * v, w->base + 3 * (size_t)w->seams.from[v], VGI_GLTF_POINT);
    return VG_OK;
}

static int open_character(vgi_gltf_writing *w, vg_err *e)
{
    if (!w->h->body.asset.n) return VG_OK;
    if (!(w->character = vgi_array(1, sizeof *w->character, e))) return VG_ENOMEM;
    int r = vgi_gltf_character_open(w->character, &w->h->body, e);
    if (r == 1) return VG_OK;
    vgi_gltf_character_clear(w->character);
    free(w->character);
    w->character = NULL;
    return r;
}

/* Animations by paths of text, which the nodes of quantized meshes would change. */
static bool has_pointers(const vgi_json *doc)
{
    const vgi_json *used = vgi_json_get(doc, "extensionsUsed");
    for (size_t i = 0; i < vgi_json_count(used); i++) {
        const char *name = vgi_json_text(vgi_json_at(used, i));
        if (name && !strcmp(name, "KHR_animation_pointer")) return true;
    }
    return false;
}

/* Whether most vertices have morph targets, which are rounded only if all frames become some. */
static bool has_many_targets(const vgi_gltf_scene *x)
{
    size_t n = 0;
    for (size_t i = 0; i < x->nparts; i++) n += x->parts[i].ntargets ? x->parts[i].count : 0;
    return 2 * n > x->all;
}

/* Where nothing asks for morph targets, the animations of the character's own file are kept if they show the frames. */
static int open_whole(vgi_gltf_writing *w, const vg_sink_options *o, vg_err *e)
{
    if (!w->character || o->most_targets || o->morph_tolerance > 0) return VG_OK;
    if (o->quantize && (has_many_targets(&w->character->scene) || has_pointers(w->character->scene.g.json))) return VG_OK;
    if (!(w->whole = vgi_array(1, sizeof *w->whole, e))) return VG_ENOMEM;
    return vgi_gltf_whole_open(w->whole, w->character, &w->h->body, e);
}

static void close_whole(vgi_gltf_writing *w)
{
    if (w->whole) vgi_gltf_whole_clear(w->whole);
    free(w->whole);
    w->whole = NULL;
}

/* Keep it if the frames are all of it. shapes: no animation is wanted. */
static void decide_whole(vgi_gltf_writing *w)
{
    if (!w->whole) return;
    const vgi_gltf_content content = w->whole->content;
    const bool renamed = w->clip && vgi_gltf_whole_clips(w->whole) > 1;
    bool keep = vgi_gltf_whole_end(w->whole);
    if (content == VGI_GLTF_SHAPES && w->quantized) keep = false; /* they are rounded as morph targets */
    if (content == VGI_GLTF_CLIPS && (w->shapes || renamed)) keep = false;
    if (!keep) close_whole(w);
    if (w->whole) w->still = true, w->times_lost = false;
    w->as_it_was = w->whole && !w->quantized;
}

/* The vertices of the file, and their normals; a character has its own. */
static int cut_mesh(vgi_gltf_writing *w, bool normals, vg_err *e)
{
    static const vg_attributes none;
    const vg_body *b = &w->h->body;
    const vg_attributes *a = w->character ? &none : &b->attributes;
    int r = VG_OK;
    if (!w->character && normals) r = vgi_gltf_normals_make(&w->normals, &b->mesh, a, b->reference, e);
    const bool shaded = w->normals.ngroups > 0;
    if (r == VG_OK) r = vgi_gltf_seams_make(&w->seams, &b->mesh, a, shaded ? w->normals.corner : NULL, e);
    return r == VG_OK && shaded ? vgi_gltf_normals_place(&w->normals, w->seams.n, w->seams.corner, b->reference, e) : r;
}

int vgi_gltf_begin(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, bool binary, vg_err *e)
{
    vgi_gltf_writing *w = *state = vgi_array(1, sizeof *w, e);
    if (!w) return VG_ENOMEM;
    w->manner = h->kind == VG_TRANSFORMS ? &vgi_gltf_by_skin : &vgi_gltf_by_morphs;
    w->out = out, w->h = h, w->binary = binary, w->clip = o->name, w->quantized = o->quantize;
    w->spool.name = "temporary file";
    if ((w->spool.fd = vgi_nameless_file(e)) < 0) return w->spool.fd;
    w->shapes = o->shapes;
    int r = h->kind == VG_VERTICES ? open_character(w, e) : VG_OK;
    if (r == VG_OK) r = open_whole(w, o, e);
    if (r == VG_OK) r = cut_mesh(w, !o->no_normals, e);
    if (r == VG_OK) r = round_base(w, e);
    return r < 0 ? r : w->manner->begin(w, o, e);
}

int vgi_gltf_put(void *state, const vg_frame *f, vg_err *e)
{
    vgi_gltf_writing *w = state;
    int r = w->manner->put(w, f, e);
    if (r == VG_OK && w->whole) r = vgi_gltf_whole_put(w->whole, f, e);
    if (r == VG_OK) r = vgi_names_add(&w->names, f->name ? f->name : "", f->name ? strlen(f->name) : 0, e);
    if (r == VG_OK) r = vgi_grow(&w->times, &w->times_cap, w->frames + 1, sizeof *w->times, e);
    if (r < 0) return r;
    w->times[w->frames++] = f->has_time ? f->time : NAN;
    return VG_OK;
}

int vgi_gltf_load(const vgi_gltf_writing *w, uint64_t off, unsigned char *to, size_t n, vg_err *e)
{
    return vgi_read_back(w->spool.fd, off, to, n, e);
}

/* ---- JSON ---- */

int vgi_gltf_say(vg_bytes *to, vg_err *e, const char *format, ...)
{
    char text[400];
    va_list list;
    va_start(list, format);
    int n = vsnprintf(text, sizeof text, format, list);
    va_end(list);
    return vgi_bytes_append(to, text, (size_t)n, e);
}

int vgi_gltf_say_text(vg_bytes *to, const char *s, vg_err *e)
{
    int r = vgi_bytes_append(to, "\"", 1, e);
    for (; *s && r == VG_OK; s++) {
        if (*s == '"' || *s == '\\' || (unsigned char)*s < 0x20) r = vgi_gltf_say(to, e, "\\u%04x", (unsigned)*s);
        else r = vgi_bytes_append(to, s, 1, e);
    }
    return r < 0 ? r : vgi_bytes_append(to, "\"", 1, e);
}

int vgi_gltf_say_numbers(vg_bytes *to, const char *before, const double *p, size_t n, const char *behind, vg_err *e)
{
    int r = vgi_gltf_say(to, e, "%s", before);
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        char digits[32];
        if (i > 0) r = vgi_gltf_say(to, e, ",");
        if (r == VG_OK) r = vgi_bytes_append(to, digits, vgi_print_double(digits, p[i]), e);
    }
    return r < 0 ? r : vgi_gltf_say(to, e, "%s", behind);
}

int vgi_gltf_say_names(vgi_gltf_writing *w, const char *key, size_t first, size_t n, vg_err *e)
{
    int r = vgi_gltf_say(&w->json, e, "\"%s\":[", key);
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        if (i > 0) r = vgi_gltf_say(&w->json, e, ",");
        if (r == VG_OK) r = vgi_gltf_say_text(&w->json, w->names.at[first + i], e);
    }
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]");
}

int vgi_gltf_say_mesh_name(vgi_gltf_writing *w, vg_err *e)
{
    const char *name = w->h->body.reference_name ? w->h->body.reference_name : "";
    int r = vgi_gltf_say(&w->json, e, "\"name\":");
    return r < 0 ? r : vgi_gltf_say_text(&w->json, *name ? name : "mesh", e);
}

/* Extras with the originals of copied vertices, so that our own reader can merge them. */
int vgi_gltf_say_seams(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_seams *s = &w->seams;
    if (s->n == s->nv) return VG_OK;
    int r = vgi_gltf_say(&w->json, e, ",\n\"" VGI_GLTF_VERTICES "\":[%zu", s->nv);
    for (size_t v = s->nv; v < s->n && r == VG_OK; v++) r = vgi_gltf_say(&w->json, e, ",%u", s->from[v]);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]");
}

static int say_primitive(vgi_gltf_writing *w, size_t *n, int mode, size_t indices, const char *material,
                         const vg_bytes *moving, vg_err *e)
{
    int r = vgi_gltf_say(&w->json, e, "%s{\"mode\":%d,", (*n)++ ? ",\n" : "", mode);
    if (r == VG_OK && indices != SIZE_MAX) r = vgi_gltf_say(&w->json, e, "\"indices\":%zu,", indices);
    if (r == VG_OK && material) r = vgi_gltf_say(&w->json, e, "\"material\":%zu,", vgi_gltf_material(w, material));
    if (r == VG_OK) r = vgi_bytes_append(&w->json, moving->data, moving->size, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}");
}

int vgi_gltf_say_primitives(vgi_gltf_writing *w, const vg_bytes *moving, vg_err *e)
{
    const vgi_gltf_shape *s = &w->shape;
    size_t n = 0, triangles = w->triangles, lines = w->lines;
    int r = vgi_gltf_say(&w->json, e, "\"primitives\":[");
    for (size_t i = 0; i < s->nruns && r == VG_OK; i++) {
        const vgi_gltf_run *run = &s->run[i];
        if (run[1].triangles > run->triangles)
            r = say_primitive(w, &n, VGI_GLTF_TRIANGLES, triangles++, run->material, moving, e);
        if (r == VG_OK && run[1].lines > run->lines)
            r = say_primitive(w, &n, VGI_GLTF_LINES, lines++, run->material, moving, e);
    }
    if (r == VG_OK && !n) r = say_primitive(w, &n, VGI_GLTF_POINTS, SIZE_MAX, NULL, moving, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]");
}

/* ---- views and accessors ---- */

int vgi_gltf_view(vgi_gltf_writing *w, size_t bytes, const char *more, vg_err *e)
{
    int r = vgi_gltf_say(&w->views, e, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu%s}",
                         w->nviews ? "," : "", w->bytes, bytes, more);
    w->nviews++;
    w->bytes += bytes;
    return r;
}

int vgi_gltf_say_accessor(vgi_gltf_writing *w, size_t off, int component, size_t count, const char *type,
                          const double *bounds, size_t width, vg_err *e)
{
    int r = vgi_gltf_say(&w->accessors, e,
                         "%s{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%d,\"count\":%zu,"
                         "\"type\":\"%s\"",
                         w->naccessors ? ",\n" : "", w->nviews - 1, off, component, count, type);
    if (r == VG_OK && bounds) r = vgi_gltf_say_numbers(&w->accessors, ",\"min\":[", bounds, width, "]", e);
    if (r == VG_OK && bounds) r = vgi_gltf_say_numbers(&w->accessors, ",\"max\":[", bounds + width, width, "]", e);
    w->naccessors++;
    return r < 0 ? r : vgi_gltf_say(&w->accessors, e, "}");
}

static size_t bytes_before(const vgi_gltf_run *run, bool lines)
{
    return lines ? run->lines : run->triangles;
}

/* One view, and an accessor for each non-empty run. */
static int describe_indices(vgi_gltf_writing *w, bool lines, size_t *accessor, vg_err *e)
{
    const vg_bytes *indices = lines ? &w->shape.lines : &w->shape.triangles;
    *accessor = w->naccessors;
    if (!indices->size) return VG_OK;
    int r = vgi_gltf_view(w, indices->size, ",\"target\":34963", e);
    for (size_t i = 0; i < w->shape.nruns && r == VG_OK; i++) {
        const size_t from = bytes_before(&w->shape.run[i], lines), to = bytes_before(&w->shape.run[i + 1], lines);
        if (to > from)
            r = vgi_gltf_say_accessor(w, from, VGI_GLTF_UINT, (to - from) / VGI_GLTF_ITEM, "SCALAR", NULL, 0, e);
    }
    return r;
}

static int describe_texture(vgi_gltf_writing *w, vg_err *e)
{
    w->texture = w->naccessors;
    if (!w->seams.uv) return VG_OK;
    int r = vgi_gltf_view(w, 2 * VGI_GLTF_ITEM * w->seams.n, ",\"target\":34962", e);
    return r < 0 ? r : vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, w->seams.n, "VEC2", NULL, 0, e);
}

static bool has_colours(const vgi_gltf_writing *w)
{
    return !w->character && w->h->body.attributes.ncolours;
}

/* Whole numbers of 16 bits: linear light, which 8 bits would not tell apart where it is dark. */
static int describe_colours(vgi_gltf_writing *w, vg_err *e)
{
    w->colours = w->naccessors;
    if (!has_colours(w)) return VG_OK;
    int r = vgi_gltf_view(w, COLOUR * w->seams.n, ",\"target\":34962", e);
    if (r == VG_OK)
        r = vgi_gltf_say(&w->accessors, e,
                         "%s{\"bufferView\":%zu,\"componentType\":%d,\"normalized\":true,\"count\":%zu,\"type\":\"VEC4\"}",
                         w->naccessors ? ",\n" : "", w->nviews - 1, VGI_GLTF_USHORT, w->seams.n);
    w->naccessors++;
    return r;
}

int vgi_gltf_say_attributes(vgi_gltf_writing *w, vg_bytes *to, vg_err *e)
{
    int r = w->seams.uv ? vgi_gltf_say(to, e, ",\"TEXCOORD_0\":%zu", w->texture) : VG_OK;
    return r == VG_OK && has_colours(w) ? vgi_gltf_say(to, e, ",\"COLOR_0\":%zu", w->colours) : r;
}

static int emit_colours(vgi_gltf_writing *w, vg_err *e)
{
    const uint8_t *colours = w->h->body.attributes.colours;
    int r = VG_OK;
    for (size_t v = 0; v < w->seams.n && r == VG_OK; v++) {
        const uint8_t *c = colours + 4 * (v < w->seams.nv ? v : (size_t)w->seams.from[v]);
        unsigned char packed[COLOUR];
        for (int k = 0; k < 4; k++) {
            const long x = lrint(65535 * (k < 3 ? vgi_linear_of_srgb(c[k]) : c[k] / 255.0));
            packed[2 * k] = (unsigned char)x, packed[2 * k + 1] = (unsigned char)(x >> 8);
        }
        r = vgi_gltf_emit(w, packed, COLOUR, e);
    }
    return r;
}

/* What is used of the character's file comes first. */
static int describe_character(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_character *c = w->character;
    int r = w->whole ? vgi_gltf_trim_whole(w, e) : vgi_gltf_trim_cast(w, w->quantized, e);
    if (r == VG_OK) r = vgi_gltf_say_elements(c->scene.g.json, "bufferViews", &w->views, &w->nviews, e);
    w->bytes = w->asset.size;
    return r < 0 ? r : vgi_gltf_say_elements(c->scene.g.json, "accessors", &w->accessors, &w->naccessors, e);
}

static int describe_file(vgi_gltf_writing *w, vg_err *e)
{
    int r = w->character ? describe_character(w, e) : vgi_gltf_describe_library(w, e);
    if (r == VG_OK && !w->character) r = describe_indices(w, false, &w->triangles, e);
    if (r == VG_OK) r = describe_indices(w, true, &w->lines, e);
    if (r == VG_OK) r = describe_texture(w, e);
    if (r == VG_OK) r = describe_colours(w, e);
    if (r == VG_OK && !w->still) r = vgi_gltf_describe_times(w, e);
    return r < 0 ? r : w->manner->describe(w, e);
}

static int say_all(vgi_gltf_writing *w, vg_err *e)
{
    int r = describe_file(w, e);
    vg_bytes members = w->json;
    w->json = (vg_bytes){0};
    if (r == VG_OK)
        r = w->character ? vgi_gltf_say_cast_asset(w, e)
                         : vgi_gltf_say(&w->json, e,
                                        "{\"asset\":{\"version\":\"2.0\",\"generator\":\"vg " VG_VERSION "\"},\n");
    if (r == VG_OK) r = vgi_bytes_append(&w->json, members.data, members.size, e);
    vg_bytes_clear(&members);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\n\"accessors\":[");
    if (r == VG_OK) r = vgi_bytes_append(&w->json, w->accessors.data, w->accessors.size, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "],\n\"bufferViews\":[");
    if (r == VG_OK) r = vgi_bytes_append(&w->json, w->views.data, w->views.size, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "],\n\"buffers\":[{\"byteLength\":%zu%s", w->bytes,
                                    w->binary ? "}]}" : ",\"uri\":\"data:application/octet-stream;base64,");
}

/* ---- bytes ---- */

static void encode3(const unsigned char *p, size_t n, char to[4])
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    uint32_t bits = (uint32_t)p[0] << 16 | (uint32_t)(n > 1 ? p[1] : 0) << 8 | (n > 2 ? p[2] : 0);
    for (int k = 0; k < 4; k++) to[k] = (size_t)k > n ? '=' : digits[bits >> (18 - 6 * k) & 63];
}

int vgi_gltf_emit(vgi_gltf_writing *w, const unsigned char *p, size_t n, vg_err *e)
{
    if (w->binary) return vgi_output_put(w->out, p, n, e);
    int r = VG_OK;
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        char four[4];
        w->carry[w->ncarry++] = p[i];
        if (w->ncarry < 3) continue;
        encode3(w->carry, 3, four);
        w->ncarry = 0;
        r = vgi_output_put(w->out, four, 4, e);
    }
    return r;
}

int vgi_gltf_emit_singles(vgi_gltf_writing *w, const float *p, size_t n, vg_err *e)
{
    int r = VG_OK;
    unsigned char packed[VGI_GLTF_ITEM * 256];
    for (size_t done = 0; done < n && r == VG_OK;) {
        size_t some = n - done < 256 ? n - done : 256;
        for (size_t i = 0; i < some; i++) vgi_gltf_put_single(packed + VGI_GLTF_ITEM * i, p[done + i]);
        r = vgi_gltf_emit(w, packed, VGI_GLTF_ITEM * some, e);
        done += some;
    }
    return r;
}

static void pack_point(vgi_gltf_numbers kind, const float *p, unsigned char *to)
{
    for (int k = 0; k < 3; k++) {
        const unsigned whole = (unsigned)(int)(kind == VGI_GLTF_FLOATS ? 0 : p[k]);
        if (kind == VGI_GLTF_FLOATS) vgi_gltf_put_single(to + VGI_GLTF_ITEM * k, p[k]);
        else if (kind == VGI_GLTF_BYTES) to[k] = (unsigned char)whole;
        else to[2 * k] = (unsigned char)whole, to[2 * k + 1] = (unsigned char)(whole >> 8);
    }
}

int vgi_gltf_emit_points(vgi_gltf_writing *w, vgi_gltf_numbers kind, const float *p, size_t n, bool apart, vg_err *e)
{
    static const unsigned char zeros[VGI_GLTF_ITEM];
    const vgi_gltf_kind *k = &vgi_gltf_kinds[kind];
    int r = VG_OK;
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        unsigned char packed[VGI_GLTF_POINT + VGI_GLTF_ITEM] = {0};
        pack_point(kind, p + 3 * i, packed);
        r = vgi_gltf_emit(w, packed, apart ? k->stride : k->bytes, e);
    }
    return r < 0 || apart ? r : vgi_gltf_emit(w, zeros, (4 - n * k->bytes % 4) % 4, e);
}

static int emit_all(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf *g = &w->library;
    int r = vgi_gltf_emit(w, w->asset.data, w->asset.size, e);
    if (r == VG_OK && g->nbuffers) r = vgi_gltf_emit(w, g->buffers[0].data, g->buffers[0].size, e);
    if (r == VG_OK) r = vgi_gltf_emit(w, w->shape.triangles.data, w->shape.triangles.size, e);
    if (r == VG_OK) r = vgi_gltf_emit(w, w->shape.lines.data, w->shape.lines.size, e);
    if (r == VG_OK && w->seams.uv) r = vgi_gltf_emit_singles(w, w->seams.uv, 2 * w->seams.n, e);
    if (r == VG_OK && has_colours(w)) r = emit_colours(w, e);
    if (r == VG_OK && !w->still) r = vgi_gltf_emit_times(w, e);
    return r < 0 ? r : w->manner->emit(w, e);
}

void vgi_gltf_bounds(const float *p, size_t points, double bounds[6])
{
    for (int k = 0; k < 3; k++) bounds[k] = bounds[k + 3] = p[k];
    for (size_t i = 3; i < 3 * points; i++) {
        if (p[i] < bounds[i % 3]) bounds[i % 3] = p[i];
        if (p[i] > bounds[i % 3 + 3]) bounds[i % 3 + 3] = p[i];
    }
}

static int put_binary(vgi_gltf_writing *w, vg_err *e)
{
    static const char blanks[4] = "   ";
    unsigned char head[VGI_GLTF_HEADER + VGI_GLTF_CHUNK] = "glTF", chunk[VGI_GLTF_CHUNK];
    int r = vgi_bytes_append(&w->json, blanks, (4 - w->json.size % 4) % 4, e);
    if (r < 0) return r;
    const uint64_t whole = sizeof head + w->json.size + sizeof chunk + (uint64_t)w->bytes;
    if (whole > UINT32_MAX)
        return vg_fail(e, VG_EINPUT, "cannot write '%s': it would be larger than a GLB can be: %s", w->out->name,
                       w->manner->too_big);
    vgi_put32(head + 4, 2);
    vgi_put32(head + 8, (uint32_t)whole);
    vgi_put32(head + 12, (uint32_t)w->json.size);
    vgi_put32(head + 16, VGI_GLTF_JSON);
    vgi_put32(chunk, (uint32_t)w->bytes);
    vgi_put32(chunk + 4, VGI_GLTF_BIN);
    r = vgi_output_put(w->out, head, sizeof head, e);
    if (r == VG_OK) r = vgi_output_put(w->out, w->json.data, w->json.size, e);
    if (r == VG_OK) r = vgi_output_put(w->out, chunk, sizeof chunk, e);
    return r < 0 ? r : emit_all(w, e);
}

static int put_text(vgi_gltf_writing *w, vg_err *e)
{
    char four[4];
    int r = vgi_output_put(w->out, w->json.data, w->json.size, e);
    if (r == VG_OK) r = emit_all(w, e);
    if (r == VG_OK && w->ncarry) {
        encode3(w->carry, w->ncarry, four);
        r = vgi_output_put(w->out, four, sizeof four, e);
    }
    return r < 0 ? r : vgi_output_put(w->out, "\"}]}\n", 5, e);
}

/* ---- completion ---- */

static void note_loss(vgi_gltf_writing *w, const char *what)
{
    const size_t n = strlen(w->warning);
    snprintf(w->warning + n, sizeof w->warning - n, "%s; ", what);
}

/* Groups and objects; smoothing groups only if normals do not show them. */
static bool has_groups(const vgi_gltf_writing *w)
{
    const vg_attributes *a = &w->h->body.attributes;
    for (size_t i = 0; i < a->nlabels; i++) {
        const uint32_t kind = a->labels[i].kind;
        if (kind == VG_LABEL_OBJECT || kind == VG_LABEL_GROUP || (kind == VG_LABEL_SMOOTHING && !w->normals.n)) return true;
    }
    return false;
}

static bool has_materials(const vg_attributes *a)
{
    for (size_t i = 0; i < a->nlabels; i++)
        if (a->labels[i].kind == VG_LABEL_MATERIAL || a->labels[i].kind == VG_LABEL_LIBRARY) return true;
    return false;
}

static void note_losses(vgi_gltf_writing *w)
{
    const vg_body *b = &w->h->body;
    if (w->times_lost) note_loss(w, "the times of the frames, which do not ascend from 0 or later");
    if (!w->character) {
        char asset[120];
        vg_asset_text(&b->asset, asset, sizeof asset);
        if (*asset && !w->library.json) note_loss(w, asset);
        if (b->attributes.ntex && !w->seams.uv) note_loss(w, "texture coordinates");
        const bool materials_lost = has_materials(&b->attributes) && !w->materials.names.n;
        if (has_groups(w) || materials_lost)
            note_loss(w, !materials_lost ? "groups" : !has_groups(w) ? "materials" : "groups and materials");
    }
    const size_t n = strlen(w->warning);
    if (w->manner->warning) w->manner->warning(w, w->warning + n, sizeof w->warning - n);
    if (n && !w->warning[n]) w->warning[n - 2] = 0;
}

/* The faces, with vertices of the file. */
static int make_shape(vgi_gltf_writing *w, vg_err *e)
{
    const vgi_gltf_seams *s = &w->seams;
    vg_mesh mesh = w->h->body.mesh;
    const vg_attributes *a = &w->h->body.attributes;
    if (!s->corner) return vgi_gltf_shape_make(&w->shape, &mesh, w->h->body.reference, a, e);
    double *points = vgi_array_raw(s->n, 3 * sizeof *points, e);
    if (!points) return VG_ENOMEM;
    for (size_t v = 0; v < s->n; v++)
        memcpy(points + 3 * v, w->h->body.reference + 3 * (size_t)s->from[v], 3 * sizeof *points);
    mesh.nv = s->n, mesh.vert = s->corner;
    int r = vgi_gltf_shape_make(&w->shape, &mesh, points, a, e);
    free(points);
    return r;
}

int vgi_gltf_end(void *state, vg_err *e)
{
    vgi_gltf_writing *w = state;
    int r = vgi_output_flush(&w->spool, e);
    if (r == VG_OK) r = vgi_gltf_find_takes(w, w->manner->splits, e);
    if (r == VG_OK) decide_whole(w);
    if (r == VG_OK && !w->character) r = make_shape(w, e);
    if (r == VG_OK && !w->character) r = vgi_gltf_find_materials(w, e);
    if (r == VG_OK) r = say_all(w, e);
    if (r == VG_OK) r = w->binary ? put_binary(w, e) : put_text(w, e);
    note_losses(w);
    return r;
}

const char *vgi_gltf_warning(void *state)
{
    const vgi_gltf_writing *w = state;
    return *w->warning ? w->warning : NULL;
}

const char *vgi_gltf_report(void *state, bool *inexact)
{
    vgi_gltf_writing *w = state;
    *inexact = w->manner->report(w, w->report, sizeof w->report);
    return *w->report ? w->report : NULL;
}

void vgi_gltf_release(void *state)
{
    vgi_gltf_writing *w = state;
    if (!w) return;
    w->manner->release(w->own);
    vgi_gltf_clear(&w->library);
    vgi_name_set_clear(&w->materials);
    close_whole(w);
    if (w->character) vgi_gltf_character_clear(w->character);
    free(w->character);
    if (w->spool.fd >= 0) close(w->spool.fd);
    vgi_output_clear(&w->spool);
    vgi_names_clear(&w->names);
    free(w->times);
    free(w->takes);
    free(w->base);
    vgi_gltf_shape_clear(&w->shape);
    vgi_gltf_seams_clear(&w->seams);
    vgi_gltf_normals_clear(&w->normals);
    vg_bytes_clear(&w->asset);
    vg_bytes_clear(&w->json);
    vg_bytes_clear(&w->views);
    vg_bytes_clear(&w->accessors);
    free(w);
}
