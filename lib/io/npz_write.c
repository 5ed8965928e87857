/* npz_write.c: writes NPZ, NumPy arrays in a zip: a whole sequence except attributes and provenance. Array headers
 * are in npy.c, the zip in pack.c.
 *
 * Names, times, roots and anchors are kept in memory; the numbers wait in an unnamed file until their count is known.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/npz.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

typedef struct writing {
    vgi_output *out, spool; /* spool: the values */
    const vg_head *h;
    bool doubles, timed;
    size_t per_frame;
    uint64_t frames;
    vg_bytes frame, roots, anchors, times;
    vg_bytes turns, centroids; /* for features: channels that every frame has */
    bool turned, placed, lost; /* lost: some frames lack such a channel, or have it in another shape */
    size_t parts;
    vgi_names names;
    vgi_packer *packer;
} writing;

int vgi_npz_begin(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    writing *x = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->out = out, x->h = h, x->doubles = o->full_precision, x->timed = true;
    x->turned = x->placed = h->kind == VG_FEATURES;
    x->per_frame = h->count * vg_head_width(h);
    x->spool.name = "temporary file";
    x->spool.fd = vgi_nameless_file(e);
    return x->spool.fd < 0 ? x->spool.fd : VG_OK;
}

static bool is_rooted(const vg_head *h)
{
    return h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS;
}

/* The numbers of a channel; *all: every frame so far has them in this shape. */
static int put_channel(writing *x, vg_bytes *to, bool *all, const vg_frame *f, const char *name, size_t width, size_t count,
                       vg_err *e)
{
    const vg_channel *c = vg_frame_channel(f, name);
    *all = *all && c && c->numbers && c->width == width && c->count == count;
    x->lost |= !*all && (c || to->size);
    return *all ? vgi_npy_store(to, c->numbers, width * count, true, e) : VG_OK;
}

static int put_channels(writing *x, const vg_frame *f, vg_err *e)
{
    const vg_channel *c = vg_frame_channel(f, VGI_NPZ_CENTROIDS);
    if (x->frames == 0 && c) x->parts = c->count;
    int r = put_channel(x, &x->turns, &x->turned, f, VGI_NPZ_ROOT_TURN, 4, 1, e);
    return r < 0 ? r : put_channel(x, &x->centroids, &x->placed, f, VGI_NPZ_CENTROIDS, 3, x->parts, e);
}

int vgi_npz_put(void *state, const vg_frame *f, vg_err *e)
{
    writing *x = state;
    double time = f->has_time ? f->time : 0;
    x->frame.size = 0;
    int r = vgi_npy_store(&x->frame, f->values, x->per_frame, x->doubles, e);
    if (r == VG_OK) r = vgi_names_add(&x->names, f->name ? f->name : "", f->name ? strlen(f->name) : 0, e);
    x->timed &= f->has_time;
    if (r == VG_OK) r = vgi_npy_store(&x->times, &time, 1, true, e);
    if (r == VG_OK && is_rooted(x->h)) r = vgi_npy_store(&x->roots, f->root, 3, true, e);
    if (r == VG_OK && is_rooted(x->h)) r = vgi_npy_store(&x->anchors, vg_frame_anchors(f), 3 * x->h->nanchors, true, e);
    if (r == VG_OK && x->h->kind == VG_FEATURES) r = put_channels(x, f, e);
    x->frames++;
    return r < 0 ? r : vgi_output_put(&x->spool, x->frame.data, x->frame.size, e);
}

/* ---- one member after another ---- */

static int begin_array(writing *x, enum array i, const char *descr, size_t item, size_t ndim, const uint64_t *shape,
                       vg_err *e)
{
    unsigned char head[VGI_NPY_HEADER];
    char path[32];
    uint64_t bytes = item;
    for (size_t d = 0; d < ndim; d++) bytes *= shape[d];
    snprintf(path, sizeof path, "%s.npy", vgi_npz_names[i]);
    vgi_npy_write(head, descr, ndim, shape);
    int r = vgi_packer_begin(x->packer, path, sizeof head + bytes, e);
    return r < 0 ? r : vgi_packer_more(x->packer, head, sizeof head, e);
}

static int add_array(writing *x, enum array i, const char *descr, size_t item, size_t ndim, const uint64_t *shape,
                     const void *data, size_t n, vg_err *e)
{
    int r = begin_array(x, i, descr, item, ndim, shape, e);
    if (r == VG_OK && n) r = vgi_packer_more(x->packer, data, n, e);
    return r < 0 ? r : vgi_packer_finish(x->packer, e);
}

static int add_doubles(writing *x, enum array i, size_t ndim, const uint64_t *shape, const vg_bytes *b, vg_err *e)
{
    return add_array(x, i, "<f8", 8, ndim, shape, b->data, b->size, e);
}

static int add_indices(writing *x, enum array i, size_t ndim, const uint64_t *shape, const uint32_t *list, size_t n,
                       vg_err *e)
{
    vg_bytes b = {0};
    int r = vgi_bytes_reserve(&b, 4 * n, e);
    for (size_t k = 0; r == VG_OK && k < n; k++) vgi_put32(b.data + 4 * k, list[k]);
    if (r == VG_OK) r = add_array(x, i, "<u4", 4, ndim, shape, b.data, 4 * n, e);
    vg_bytes_clear(&b);
    return r;
}

static int add_mesh(writing *x, enum array offsets, enum array vertices, const uint32_t *start,
                    const uint32_t *vert, size_t nf, vg_err *e)
{
    static const uint32_t none = 0;
    const uint64_t n = nf + 1, corners = nf ? start[nf] : 0;
    int r = add_indices(x, offsets, 1, &n, nf ? start : &none, (size_t)n, e);
    return r < 0 ? r : add_indices(x, vertices, 1, &corners, vert, (size_t)corners, e);
}

static int add_graph(writing *x, vg_err *e)
{
    vg_graph *g;
    int r = vg_head_graph(&g, x->h, e);
    if (r == VG_OK) r = add_mesh(x, GRAPH_OFFSETS, GRAPH_VERTICES, g->faces.start, g->faces.vert, g->faces.nf, e);
    vg_graph_free(&g);
    return r;
}

/* The next code point of valid UTF-8. */
static uint32_t next_letter(const unsigned char **s)
{
    uint32_t c = *(*s)++;
    int more = c >= 0xf0 ? 3 : c >= 0xe0 ? 2 : c >= 0xc0 ? 1 : 0;
    if (more) c &= 0x3fu >> more;
    while (more-- > 0) c = c << 6 | (*(*s)++ & 0x3f);
    return c;
}

static size_t count_letters(const char *s)
{
    size_t n = 0;
    for (; *s; s++) n += ((unsigned char)*s & 0xc0) != 0x80;
    return n;
}

/* Texts of one width, as in NumPy: UTF-32 padded with zeros. */
static int add_texts(writing *x, enum array i, size_t ndim, char *const *texts, size_t n, vg_err *e)
{
    const uint64_t shape = n;
    char descr[32];
    size_t width = 1;
    for (size_t k = 0; k < n; k++) {
        size_t letters = count_letters(texts[k]);
        if (letters > width) width = letters;
    }
    snprintf(descr, sizeof descr, "<U%zu", width);
    int r = begin_array(x, i, descr, 4 * width, ndim, &shape, e);
    unsigned char *line = r == VG_OK ? vgi_array_raw(width, 4, e) : NULL;
    if (r == VG_OK && !line) r = VG_ENOMEM;
    for (size_t k = 0; k < n && r == VG_OK; k++) {
        const unsigned char *s = (const unsigned char *)texts[k];
        memset(line, 0, 4 * width);
        for (size_t at = 0; *s; at += 4) vgi_put32(line + at, next_letter(&s));
        r = vgi_packer_more(x->packer, line, 4 * width, e);
    }
    free(line);
    return r < 0 ? r : vgi_packer_finish(x->packer, e);
}

static int copy_spool(writing *x, vg_err *e)
{
    enum { BLOCK = 1 << 20 };
    unsigned char *block = vgi_array_raw(BLOCK, 1, e);
    int r = block ? vgi_output_flush(&x->spool, e) : VG_ENOMEM;
    for (uint64_t off = 0; r == VG_OK && off < x->spool.size; off += BLOCK) {
        size_t some = x->spool.size - off < BLOCK ? (size_t)(x->spool.size - off) : BLOCK;
        r = vgi_read_back(x->spool.fd, off, block, some, e);
        if (r == VG_OK) r = vgi_packer_more(x->packer, block, some, e);
    }
    free(block);
    return r;
}

static int add_values(writing *x, enum array i, vg_err *e)
{
    const uint64_t shape[3] = {x->frames, x->h->count, vg_head_width(x->h)};
    int r = begin_array(x, i, x->doubles ? "<f8" : "<f4", x->doubles ? 8 : 4, 3, shape, e);
    if (r == VG_OK) r = copy_spool(x, e);
    return r < 0 ? r : vgi_packer_finish(x->packer, e);
}

static int add_reference(writing *x, vg_err *e)
{
    const uint64_t shape[2] = {x->h->body.mesh.nv, 3};
    vg_bytes b = {0};
    int r = vgi_npy_store(&b, x->h->body.reference, 3 * x->h->body.mesh.nv, true, e);
    if (r == VG_OK) r = add_doubles(x, REFERENCE, 2, shape, &b, e);
    vg_bytes_clear(&b);
    return r;
}

/* Whether this array is written. */
static bool belongs(const writing *x, enum array i)
{
    const vg_head *h = x->h;
    switch (i) {
    case ANCHORS: return is_rooted(h) && h->nanchors;
    case ANCHOR_POSITIONS: return is_rooted(h) && h->nanchors;
    case CENTROIDS: return x->placed && x->frames;
    case ROOT_TURNS: return x->turned && x->frames;
    case GRAPH_OFFSETS: return is_rooted(h); /* with graph_vertices */
    case LINKS: return is_rooted(h) && h->links.chosen;
    case SELECTED: return is_rooted(h) && h->selection.chosen;
    case ROOTS: return is_rooted(h);
    case FACE_OFFSETS: return h->body.mesh.nv > 0; /* with face_vertices */
    case REFERENCE: return h->body.mesh.nv > 0 && h->body.reference;
    case REFERENCE_NAME: return h->body.mesh.nv > 0 && h->body.reference_name;
    case TIMES: return x->timed;
    case NAMES: return true;
    case POSITIONS: return h->kind == VG_VERTICES;
    case VECTORS: return h->kind == VG_VECTORS;
    case DEFORMATIONS: return h->kind == VG_DEFORMATIONS;
    case TRANSFORMS: return h->kind == VG_TRANSFORMS;
    case FEATURES: return h->kind == VG_FEATURES;
    default: return false;
    }
}

static int write_member(writing *x, enum array i, vg_err *e)
{
    const vg_head *h = x->h;
    const uint64_t places[3] = {x->frames, h->nanchors, 3}, roots[2] = {x->frames, 3}, links[2] = {h->links.n, 2};
    const uint64_t parts[3] = {x->frames, x->parts, 3}, turns[2] = {x->frames, 4};
    const uint64_t anchors = h->nanchors, selected = h->selection.n, frames = x->frames;
    if (!belongs(x, i)) return VG_OK;
    switch (i) {
    case ANCHOR_POSITIONS: return add_doubles(x, i, 3, places, &x->anchors, e);
    case ANCHORS: return add_indices(x, i, 1, &anchors, h->anchors, h->nanchors, e);
    case CENTROIDS: return add_doubles(x, i, 3, parts, &x->centroids, e);
    case ROOT_TURNS: return add_doubles(x, i, 2, turns, &x->turns, e);
    case FACE_OFFSETS:
        return add_mesh(x, i, FACE_VERTICES, h->body.mesh.start, h->body.mesh.vert, h->body.mesh.nf, e);
    case GRAPH_OFFSETS: return add_graph(x, e);
    case LINKS: return add_indices(x, i, 2, links, h->links.pairs, 2 * h->links.n, e);
    case NAMES: return add_texts(x, i, 1, x->names.at, x->names.n, e);
    case REFERENCE: return add_reference(x, e);
    case REFERENCE_NAME: return add_texts(x, i, 0, &h->body.reference_name, 1, e);
    case ROOTS: return add_doubles(x, i, 2, roots, &x->roots, e);
    case SELECTED: return add_indices(x, i, 1, &selected, h->selection.faces, h->selection.n, e);
    case TIMES: return add_doubles(x, i, 1, &frames, &x->times, e);
    default: return add_values(x, i, e);
    }
}

int vgi_npz_end(void *state, vg_err *e)
{
    writing *x = state;
    int r = vgi_packer_open_plain(&x->packer, x->out->fd, x->out->name, e);
    for (int i = 0; i < ARRAYS && r == VG_OK; i++) r = write_member(x, (enum array)i, e);
    if (r == VG_OK) r = vgi_packer_end(x->packer, e);
    if (r < 0) return r;
    off_t size = lseek(x->out->fd, 0, SEEK_END);
    if (size < 0) return vg_fail(e, VG_ESYS, "cannot write to '%s': %s", x->out->name, strerror(errno));
    x->out->size = (uint64_t)size;
    return VG_OK;
}

const char *vgi_npz_warning(void *state)
{
    const writing *x = state;
    size_t timed = 0;
    for (size_t i = 0; i + 8 <= x->times.size; i += 8) timed += vgi_get64(x->times.data + i) != 0;
    const bool times = !x->timed && timed;
    if (times && x->lost) return "times, rotations of the root or centroids: not every frame has them";
    if (x->lost) return "rotations of the root or centroids: not every frame has them";
    return times ? "the times of the frames: not every frame has one" : NULL;
}

void vgi_npz_release(void *state)
{
    writing *x = state;
    if (!x) return;
    vgi_packer_close(&x->packer);
    if (x->spool.fd >= 0) close(x->spool.fd);
    vgi_output_clear(&x->spool);
    vgi_names_clear(&x->names);
    vg_bytes_clear(&x->frame);
    vg_bytes_clear(&x->roots);
    vg_bytes_clear(&x->anchors);
    vg_bytes_clear(&x->times);
    vg_bytes_clear(&x->turns);
    vg_bytes_clear(&x->centroids);
    free(x);
}
