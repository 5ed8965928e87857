/* npz.c: reads NPZ, NumPy arrays in a zip: the numbers of all frames; faces, reference, names and times.
 * man/vg-decode.1 lists the arrays. Array headers are in npy.c, the zip in archive.c, writing in npz_write.c.
 *
 * The whole file is kept in memory, as NumPy does, because the axes of the frames may be in any order.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/npz.h"

#include <math.h>
#include <stdlib.h>
#include <sys/stat.h>

const char *const vgi_npz_names[ARRAYS] = {
    "anchor_positions", "anchors", "centroids", "deformations", "face_offsets", "face_vertices", "faces", "features",
    "graph_offsets", "graph_vertices", "links", "names", "positions", "reference", "reference_name", "root_turns", "roots",
    "selected", "times", "transforms", "vectors"};

/* Names that other programs use for positions and faces. Our own names take precedence, and earlier ones over later
 * ones. */
static const struct {
    const char *name;
    enum array array;
} other_names[] = {{"vertices", POSITIONS}, {"verts", POSITIONS}, {"v", POSITIONS}, {"points", POSITIONS},
                   {"f", FACES},            {"triangles", FACES}};
enum { OTHER_NAMES = sizeof other_names / sizeof *other_names, OWN_NAME = 0 };

/* Arrays that files of SMPL and related models contain instead of vertices. */
static const char *const body_names[] = {"poses", "pose", "betas", "pose_body", "body_pose", "root_orient", "global_orient"};

enum { SHAPE_TEXT = 24 * VGI_NPY_DIMENSIONS + 3 };

struct held {
    bool there;
    const char *name; /* in the file */
    size_t rank;      /* OWN_NAME, or the rank in other_names + 1; larger for a name in different letter case */
    char shape[SHAPE_TEXT]; /* in the file */
    vgi_npy a;
    bool strided;     /* the axes were reordered: */
    size_t stride[VGI_NPY_DIMENSIONS];
    vg_bytes data;
};

typedef struct reading {
    const char *subject;
    char inventory[240]; /* all arrays of the file with their shapes, as many as fit, for messages */
    char unused[160];    /* names of those that are not read */
    bool of_body; /* contains an array of body_names */
    vg_note note;
    struct held held[ARRAYS];
    enum array values; /* the array that holds the frames */
    size_t frames, count, width, nanchors, next;
} reading;

static bool is_array_name(const char *path)
{
    return vgi_has_suffix(path, strlen(path), ".npy");
}

static bool is_called(const char *path, const char *name)
{
    size_t n = strlen(path) - 4;
    return strlen(name) == n && !memcmp(name, path, n);
}

/* The same, ignoring case: V and F, Vertices and Faces. */
static bool is_called_loosely(const char *path, const char *name)
{
    size_t n = strlen(path) - 4;
    return strlen(name) == n && !strncasecmp(name, path, n);
}

static enum array find_array(const char *path, const char **name, size_t *rank)
{
    for (int i = 0; i < ARRAYS; i++)
        if (is_called(path, *name = vgi_npz_names[i])) return *rank = OWN_NAME, (enum array)i;
    for (size_t i = 0; i < OTHER_NAMES; i++)
        if (is_called(path, *name = other_names[i].name)) return *rank = i + 1, other_names[i].array;
    for (size_t i = 0; i < OTHER_NAMES; i++)
        if (is_called_loosely(path, *name = other_names[i].name))
            return *rank = OTHER_NAMES + i + 1, other_names[i].array;
    if (is_called_loosely(path, *name = vgi_npz_names[FACES])) return *rank = OTHER_NAMES + 1, FACES;
    return ARRAYS;
}

/* "(120, 6890, 3)" */
static void write_shape(char text[SHAPE_TEXT], const vgi_npy *a)
{
    size_t n = 0;
    text[n++] = '(';
    for (size_t d = 0; d < a->ndim; d++)
        n += (size_t)snprintf(text + n, SHAPE_TEXT - n, "%s%llu", d ? ", " : "", (unsigned long long)a->shape[d]);
    snprintf(text + n, SHAPE_TEXT - n, ")");
}

/* "positions (120, 6890, 3)" */
static void list_array(reading *x, const char *path, const vg_bytes *data)
{
    vgi_npy a = {0};
    char shape[SHAPE_TEXT] = "(?)";
    size_t bytes, n = strlen(x->inventory);
    vgi_input *in;
    int known = vgi_input_memory(&in, data->data, data->size, path, NULL);
    if (known == VG_OK) known = vgi_npy_read(&a, &bytes, in, "it", NULL);
    vgi_input_free(&in);
    for (size_t i = 0; i < sizeof body_names / sizeof *body_names; i++) x->of_body |= is_called(path, body_names[i]);
    if (known == VG_OK) write_shape(shape, &a);
    if (n + strlen(shape) + 34 > sizeof x->inventory) return;
    snprintf(x->inventory + n, sizeof x->inventory - n, "%s%.*s %s", n ? ", " : "",
             (int)(strlen(path) - 4 > 30 ? 30 : strlen(path) - 4), path, shape);
}

/* `in` is at an array that extends to its end. */
static int hold_array(reading *x, enum array i, vgi_input *in, const char *subject, vg_err *e)
{
    struct held *h = &x->held[i];
    size_t bytes;
    int r = vgi_npy_read(&h->a, &bytes, in, subject, e);
    if (r < 0) return r;
    h->there = true;
    write_shape(h->shape, &h->a);
    h->data.size = 0;
    r = vgi_input_take(in, &h->data, bytes, NULL, e);
    if (r == VG_ETRUNC) return vg_fail(e, r, "%s ends too early", subject);
    if (r == VG_OK) r = vgi_input_ended(in, e);
    if (r != 0) return r < 0 ? r : VG_OK;
    return vg_fail(e, VG_EINPUT, "%s has data after its elements", subject);
}

static void list_unused(reading *x, const char *path)
{
    const size_t n = strlen(x->unused), length = strcspn(path, ".");
    if (n + length + 6 > sizeof x->unused) return;
    snprintf(x->unused + n, sizeof x->unused - n, "%s%.*s", n ? ", " : "", (int)length, path);
}

static int hold_member(reading *x, const char *path, const vg_bytes *data, vg_err *e)
{
    const char *name;
    size_t rank = 0;
    enum array i = find_array(path, &name, &rank);
    char subject[200];
    vgi_input *in;
    list_array(x, path, data);
    if (i == ARRAYS) { /* of another program */
        list_unused(x, path);
        return VG_OK;
    }
    snprintf(subject, sizeof subject, "array '%s' in %.150s", name, x->subject);
    if (x->held[i].there && x->held[i].rank == rank) return vg_fail(e, VG_EINPUT, "%s is in the file twice", subject);
    if (x->held[i].there && x->held[i].rank < rank) {
        list_unused(x, path);
        return VG_OK;
    }
    if (x->held[i].there) list_unused(x, x->held[i].name);
    x->held[i].name = name, x->held[i].rank = rank;
    int r = vgi_input_memory(&in, data->data, data->size, path, e);
    if (r == VG_OK) r = hold_array(x, i, in, subject, e);
    vgi_input_free(&in);
    return r;
}

static int hold_all(reading *x, vgi_input *in, vg_err *e)
{
    vgi_archive *a = NULL;
    vg_bytes data = {0};
    const char *path;
    vgi_limits limits = *vgi_input_limits(in);
    struct stat st;
    int fd = -1, r = vgi_input_spool(in, &fd, e);
    if (r == VG_OK && fstat(fd, &st) == 0) { /* an uncompressed array cannot be a decompression bomb */
        if ((uint64_t)st.st_size > limits.member_bytes) limits.member_bytes = (uint64_t)st.st_size;
        if ((uint64_t)st.st_size > limits.total_bytes) limits.total_bytes = (uint64_t)st.st_size;
    }
    if (r == VG_OK) r = vgi_archive_open_for(&a, fd, 0, vgi_input_name(in), is_array_name, &limits, e);
    while (r == VG_OK && (r = vgi_archive_next(a, &path, &data, e)) > 0) r = hold_member(x, path, &data, e);
    vgi_archive_close(&a);
    vg_bytes_clear(&data);
    return r;
}

/* ---- shapes and elements ---- */

static int wrong_array(const reading *x, enum array i, const char *what, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "array '%s' in %s %s", x->held[i].name, x->subject, what);
}

static int wrong_shape(const reading *x, enum array i, const char *shape, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "array '%s' in %s is of shape %s, not %s", x->held[i].name, x->subject,
                   x->held[i].shape, shape);
}

static int missing_array(const reading *x, enum array i, enum array because, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "%s has an array '%s', but none called '%s'", x->subject, x->held[because].name,
                   vgi_npz_names[i]);
}

/* Whether it has this shape. UINT64_MAX: any. */
static bool has_shape(const struct held *h, size_t ndim, const uint64_t *shape)
{
    if (h->a.ndim != ndim) return false;
    for (size_t d = 0; d < ndim; d++)
        if (shape[d] != UINT64_MAX && h->a.shape[d] != shape[d]) return false;
    return true;
}

static bool is_float(const struct held *h)
{
    return h->a.kind == 'f' && (h->a.item == 4 || h->a.item == 8);
}

static size_t elements(const struct held *h)
{
    size_t n = 1;
    for (size_t d = 0; d < h->a.ndim; d++) n *= (size_t)h->a.shape[d];
    return n;
}

/* Address of element i, counted in C order. */
static const unsigned char *element(const struct held *h, size_t i)
{
    size_t at = 0;
    if (!h->a.fortran && !h->strided) return h->data.data + i * h->a.item;
    for (size_t d = h->a.ndim; d-- > 0; i /= (size_t)h->a.shape[d])
        at += i % (size_t)h->a.shape[d] * (h->strided ? h->stride[d] : vgi_npy_stride(&h->a, d));
    return h->data.data + at * h->a.item;
}

static int copy_floats(const reading *x, enum array i, size_t from, size_t n, double *to, vg_err *e)
{
    const struct held *h = &x->held[i];
    for (size_t k = 0; k < n; k++) {
        to[k] = vgi_npy_float(&h->a, element(h, from + k));
        if (!isfinite(to[k])) return wrong_array(x, i, "holds a number that is not finite", e);
    }
    return VG_OK;
}

/* An integer of any size; -1 if it is negative or too large for an index. */
static int64_t integer_at(const struct held *h, size_t i)
{
    const unsigned char *p = element(h, i);
    uint64_t x = 0;
    for (size_t k = 0; k < h->a.item; k++) x |= (uint64_t)p[h->a.big ? h->a.item - 1 - k : k] << 8 * k;
    bool negative = h->a.kind == 'i' && x >> (8 * h->a.item - 1);
    return negative || x > UINT32_MAX ? -1 : (int64_t)x;
}

/* A whole array of indices below `limit`; *list is NULL if it is absent. */
static int copy_indices(const reading *x, enum array i, uint64_t limit, uint32_t **list, size_t *n, vg_err *e)
{
    const struct held *h = &x->held[i];
    *list = NULL, *n = 0;
    if (!h->there) return VG_OK;
    if ((h->a.kind != 'i' && h->a.kind != 'u') || h->a.item > 8) return wrong_array(x, i, "does not hold integers", e);
    *n = elements(h);
    if (!(*list = vgi_array_raw(*n, sizeof **list, e))) return VG_ENOMEM;
    for (size_t k = 0; k < *n; k++) {
        int64_t v = integer_at(h, k);
        if (v < 0 || (uint64_t)v >= limit) return wrong_array(x, i, "holds an index that is out of range", e);
        (*list)[k] = (uint32_t)v;
    }
    return VG_OK;
}

static int check_ascending(const reading *x, enum array i, const uint32_t *list, size_t n, vg_err *e)
{
    for (size_t k = 1; k < n; k++)
        if (list[k] <= list[k - 1]) return wrong_array(x, i, "is not ascending", e);
    return VG_OK;
}

/* Text of kind 'U' or 'S', without padding NULs. */
static int text_at(const reading *x, enum array i, size_t k, char **text, vg_err *e)
{
    const struct held *h = &x->held[i];
    const unsigned char *p = element(h, k);
    size_t step = h->a.kind == 'U' ? 4 : 1;
    vg_bytes b = {0};
    int r = VG_OK;
    for (size_t at = 0; r == VG_OK && at < h->a.item; at += step) {
        uint32_t c = step == 1 ? p[at] : h->a.big ? __builtin_bswap32(vgi_get32(p + at)) : vgi_get32(p + at);
        if (c == 0) break;
        if (step == 1) r = vgi_bytes_append(&b, p + at, 1, e);
        else if (c > 0x10ffff || (c >= 0xd800 && c < 0xe000))
            r = wrong_array(x, i, "holds an invalid code point", e);
        else r = vgi_append_letter(&b, c, e);
    }
    if (r == VG_OK && !vgi_is_utf8((char *)b.data, b.size)) r = wrong_array(x, i, "holds text that is not UTF-8", e);
    if (r == VG_OK && !(*text = vgi_copy_string((char *)b.data, b.size, e))) r = VG_ENOMEM;
    vg_bytes_clear(&b);
    return r;
}

/* ---- the head ---- */

static int holds_no_frames(const reading *x, vg_err *e)
{
    if (x->of_body)
        return vg_fail(e, VG_EINPUT,
                       "%s holds parameters of a body model (SMPL: poses, betas) and no vertices: let the model make the "
                       "vertices first; it has: %s",
                       x->subject, x->inventory);
    return vg_fail(e, VG_EINPUT,
                   "%s has no array of positions (called positions, vertices, verts, v or points), vectors, "
                   "deformations or features; it has: %s",
                   x->subject, *x->inventory ? x->inventory : "nothing");
}

/* ---- axes: frames, vertices and xyz in any order ---- */

/* The number of vertices that the faces or the reference require; exact: not a lower bound. 0: unknown. *from: the least
 * index of the faces. */
static size_t vertices_wanted(const reading *x, bool *exact, size_t *from)
{
    const struct held *r = &x->held[REFERENCE];
    size_t most = 0;
    *exact = false, *from = SIZE_MAX;
    if (r->there && r->a.ndim == 2) return *exact = true, (size_t)r->a.shape[0];
    static const enum array lists[] = {FACES, FACE_VERTICES};
    for (int i = 0; i < 2; i++) {
        const struct held *h = &x->held[lists[i]];
        if (!h->there || (h->a.kind != 'i' && h->a.kind != 'u') || h->a.item > 8) continue;
        for (size_t k = 0, n = elements(h); k < n; k++) {
            int64_t v = integer_at(h, k);
            if (v >= 0 && (size_t)v + 1 > most) most = (size_t)v + 1;
            if (v >= 0 && (size_t)v < *from) *from = (size_t)v;
        }
    }
    return most;
}

/* frames, vertices, xyz: the axis of each */
static void order_axes(struct held *h, const int axis[3])
{
    uint64_t shape[3];
    for (int d = 0; d < 3; d++) shape[d] = h->a.shape[axis[d]], h->stride[d] = vgi_npy_stride(&h->a, (size_t)axis[d]);
    memcpy(h->a.shape, shape, sizeof shape);
    h->strided = true;
}

static int named_axes(reading *x, struct held *h, const char *axes, vg_err *e)
{
    static const char letters[] = "fvx";
    int axis[3];
    for (int k = 0; k < 3; k++) {
        const char *at = strchr(axes, letters[k]);
        if (!at || strlen(axes) != 3)
            return vg_fail(e, VG_EARG, "'%.20s' are not axes: give an order of f (frames), v (vertices) and x (x y z)", axes);
        axis[k] = (int)(at - axes);
    }
    if (h->a.ndim != 3) return wrong_array(x, POSITIONS, "does not have the three axes given", e);
    order_axes(h, axis);
    return VG_OK;
}

/* 0: these axes cannot be frames, vertices, xyz; 1: they can; 2: the number of vertices is the required one. */
static int axes_suit(const uint64_t *shape, const int axis[3], size_t wanted, bool exact)
{
    const uint64_t nv = shape[axis[1]];
    if (shape[axis[2]] != 3 || nv < wanted || (exact && nv != wanted)) return 0;
    return wanted && nv == wanted ? 2 : 1;
}

/* As (frames, vertices, 3) if possible, otherwise in the only other order that is possible. */
static int find_axes(reading *x, struct held *h, vg_err *e)
{
    static const int orders[6][3] = {{0, 1, 2}, {1, 0, 2}, {2, 0, 1}, {0, 2, 1}, {1, 2, 0}, {2, 1, 0}};
    bool exact;
    size_t from;
    int best = 0, score = 0, equals = 0;
    if (h->a.ndim != 3) return VG_OK;
    const size_t wanted = vertices_wanted(x, &exact, &from);
    if (axes_suit(h->a.shape, orders[0], wanted, exact)) return VG_OK;
    if (h->a.shape[2] == 3 && from == 1 && wanted == h->a.shape[1] + 1)
        return wrong_array(x, x->held[FACES].there ? FACES : FACE_VERTICES, "counts the vertices from 1: subtract 1", e);
    for (int i = 1; i < 6; i++) {
        int s = axes_suit(h->a.shape, orders[i], wanted, exact);
        equals = s == score ? equals + 1 : s > score ? 1 : equals;
        if (s > score) best = i, score = s;
    }
    if (score == 0) return VG_OK;
    if (equals > 1)
        return wrong_array(x, POSITIONS, "has ambiguous axes: name them with --array-axes (vxf: vertices, x y z, frames)", e);
    order_axes(h, orders[best]);
    if (best == 1) vgi_note(&x->note, "took the axes of '%s' as vertices, frames, x y z", h->name);
    return VG_OK;
}

static int choose_values(reading *x, vg_head *h, const vg_reading *how, vg_err *e)
{
    static const enum array all[] = {POSITIONS, VECTORS, DEFORMATIONS, FEATURES};
    static const vg_kind kinds[] = {VG_VERTICES, VG_VECTORS, VG_DEFORMATIONS, VG_FEATURES};
    int found = -1;
    for (int i = 0; i < 4; i++) {
        if (!x->held[all[i]].there) continue;
        if (found >= 0)
            return vg_fail(e, VG_EINPUT, "%s has both '%s' and '%s': frames are one of them", x->subject,
                           vgi_npz_names[all[found]], vgi_npz_names[all[i]]);
        found = i;
    }
    if (found < 0) return holds_no_frames(x, e);
    struct held *v = &x->held[x->values = all[found]];
    vgi_npy *a = &v->a;
    x->width = vg_kind_width(kinds[found]);
    if (!is_float(v))
        return wrong_array(x, x->values, "holds no binary32 or binary64 numbers: store it as float32 or float64", e);
    if (x->values == POSITIONS) {
        int r = how->array_axes ? named_axes(x, v, how->array_axes, e) : find_axes(x, v, e);
        if (r < 0) return r;
    }
    if (a->ndim == 2) { /* one frame */
        a->shape[2] = a->shape[1], a->shape[1] = a->shape[0], a->shape[0] = 1;
        a->ndim = 3;
    }
    if (kinds[found] == VG_FEATURES && a->ndim == 3 && a->shape[2] < 1 << 20) x->width = h->width = (size_t)a->shape[2];
    if (a->ndim != 3 || a->shape[2] != x->width || x->width == 0 || a->shape[1] == 0 || a->shape[1] >= UINT32_MAX)
        return wrong_shape(x, x->values,
                           kinds[found] == VG_FEATURES   ? "(frames, vertices, numbers)"
                           : kinds[found] == VG_VERTICES ? "(frames, vertices, 3)"
                           : x->width == 3               ? "(frames, elements, 3)"
                                                         : "(frames, elements, 4)",
                           e);
    if (a->shape[0] == 0) return wrong_array(x, x->values, "holds no frame", e);
    x->frames = (size_t)a->shape[0], x->count = (size_t)a->shape[1];
    h->kind = kinds[found], h->count = x->count;
    h->precision = a->item == 4 ? VG_F32 : VG_F64;
    return VG_OK;
}

static int take_reference(reading *x, vg_head *h, vg_err *e)
{
    const struct held *given = &x->held[REFERENCE];
    bool vertices = h->kind == VG_VERTICES || h->kind == VG_FEATURES;
    const uint64_t shape[2] = {vertices ? x->count : UINT64_MAX, 3};
    h->body.mesh.nv = x->count;
    if (!given->there) return h->kind == VG_VERTICES ? VG_OK : missing_array(x, REFERENCE, x->values, e);
    if (!is_float(given) || !has_shape(given, 2, shape) || given->a.shape[0] == 0 || given->a.shape[0] >= UINT32_MAX - 1)
        return wrong_array(x, REFERENCE, "is not of shape (vertices, 3) with float32 or float64", e);
    h->body.mesh.nv = (size_t)given->a.shape[0];
    h->body.reference = vgi_array_raw(h->body.mesh.nv, 3 * sizeof *h->body.reference, e);
    int r = h->body.reference ? copy_floats(x, REFERENCE, 0, 3 * h->body.mesh.nv, h->body.reference, e)
                               : VG_ENOMEM;
    const struct held *name = &x->held[REFERENCE_NAME];
    if (r < 0 || !name->there) return r;
    if ((name->a.kind != 'U' && name->a.kind != 'S') || elements(name) != 1)
        return wrong_array(x, REFERENCE_NAME, "is not one text", e);
    return text_at(x, REFERENCE_NAME, 0, &h->body.reference_name, e);
}

/* face_offsets and face_vertices; checked enough for the source to check the rest. */
static int take_polygons(reading *x, vg_head *h, vg_err *e)
{
    size_t n, corners;
    vg_mesh *m = &h->body.mesh;
    if (!x->held[FACE_VERTICES].there) return missing_array(x, FACE_VERTICES, FACE_OFFSETS, e);
    if (!x->held[FACE_OFFSETS].there) return missing_array(x, FACE_OFFSETS, FACE_VERTICES, e);
    int r = copy_indices(x, FACE_OFFSETS, UINT32_MAX, &m->start, &n, e);
    if (r == VG_OK) r = copy_indices(x, FACE_VERTICES, m->nv, &m->vert, &corners, e);
    if (r < 0) return r;
    if (n == 0 || m->start[0] != 0 || m->start[n - 1] != corners)
        return wrong_array(x, FACE_OFFSETS, "does not begin with 0 and end with the length of 'face_vertices'", e);
    if ((r = check_ascending(x, FACE_OFFSETS, m->start, n, e)) < 0) return r;
    m->nf = n - 1;
    return VG_OK;
}

/* faces: one row per face, all of one size. */
static int take_equal_faces(reading *x, vg_head *h, vg_err *e)
{
    const struct held *f = &x->held[FACES];
    size_t corners;
    vg_mesh *m = &h->body.mesh;
    if (x->held[FACE_OFFSETS].there)
        return wrong_array(x, FACES, "is given in addition to 'face_offsets': only one of them may define faces", e);
    if (f->a.ndim != 2 || f->a.shape[1] < 2) return wrong_shape(x, FACES, "(faces, corners of a face)", e);
    int r = copy_indices(x, FACES, m->nv, &m->vert, &corners, e);
    if (r < 0) return r;
    if (corners >= UINT32_MAX || f->a.shape[0] >= UINT32_MAX) return wrong_array(x, FACES, "is too long", e);
    size_t nf = (size_t)f->a.shape[0];
    if (!(m->start = vgi_array_raw(nf + 1, sizeof *m->start, e))) return VG_ENOMEM;
    for (size_t i = 0; i <= nf; i++) m->start[i] = (uint32_t)(i * (size_t)f->a.shape[1]);
    m->nf = nf;
    return VG_OK;
}

static int take_faces(reading *x, vg_head *h, vg_err *e)
{
    if (x->held[FACES].there) return take_equal_faces(x, h, e);
    if (x->held[FACE_OFFSETS].there || x->held[FACE_VERTICES].there) return take_polygons(x, h, e);
    return h->kind == VG_VERTICES ? VG_OK : missing_array(x, FACE_OFFSETS, x->values, e);
}

static int take_links(reading *x, vg_head *h, vg_err *e)
{
    static const uint64_t pairs[2] = {UINT64_MAX, 2};
    if (!x->held[LINKS].there) return missing_array(x, LINKS, x->values, e);
    if (!has_shape(&x->held[LINKS], 2, pairs)) return wrong_shape(x, LINKS, "(links, 2)", e);
    h->links.chosen = true;
    size_t n;
    int r = copy_indices(x, LINKS, h->body.mesh.nv, &h->links.pairs, &n, e);
    h->links.n = n / 2;
    for (size_t i = 0; r == VG_OK && i < h->links.n; i++)
        if (h->links.pairs[2 * i] == h->links.pairs[2 * i + 1]) return wrong_array(x, LINKS, "joins a vertex to itself", e);
    return r;
}

/* The vector graph: the faces with vectors, links, anchors. Derived arrays (graph_offsets, graph_vertices) are
 * computed again. */
static int take_graph(reading *x, vg_head *h, vg_err *e)
{
    const uint64_t roots[2] = {x->frames, 3};
    if (h->kind == VG_VERTICES) return VG_OK;
    int r = vg_mesh_check(&h->body.mesh, x->subject, e);
    if (r == VG_OK) r = copy_indices(x, SELECTED, h->body.mesh.nf, &h->selection.faces, &h->selection.n, e);
    h->selection.chosen = x->held[SELECTED].there;
    if (r == VG_OK) r = check_ascending(x, SELECTED, h->selection.faces, h->selection.n, e);
    if (r == VG_OK) r = take_links(x, h, e);
    if (r == VG_OK) r = copy_indices(x, ANCHORS, h->body.mesh.nv, &h->anchors, &h->nanchors, e);
    if (r == VG_OK) r = check_ascending(x, ANCHORS, h->anchors, h->nanchors, e);
    if (r < 0) return r;
    x->nanchors = h->nanchors;
    const uint64_t places[3] = {x->frames, h->nanchors, 3};
    if (h->nanchors && !x->held[ANCHOR_POSITIONS].there) return missing_array(x, ANCHOR_POSITIONS, ANCHORS, e);
    if (h->nanchors && (!is_float(&x->held[ANCHOR_POSITIONS]) || !has_shape(&x->held[ANCHOR_POSITIONS], 3, places)))
        return wrong_array(x, ANCHOR_POSITIONS, "is not of shape (frames, anchors, 3) with float32 or float64", e);
    if (!x->held[ROOTS].there) return missing_array(x, ROOTS, x->values, e);
    if (!is_float(&x->held[ROOTS]) || !has_shape(&x->held[ROOTS], 2, roots))
        return wrong_array(x, ROOTS, "is not of shape (frames, 3) with float32 or float64", e);
    vg_graph *g;
    if ((r = vg_head_graph(&g, h, e)) < 0) return r;
    size_t corners = vg_graph_corners(g);
    vg_graph_free(&g);
    if (corners == x->count) return VG_OK;
    return vg_fail(e, VG_EINPUT, "array '%s' in %s has %zu elements where the vector graph has %zu corners",
                   vgi_npz_names[x->values], x->subject, x->count, corners);
}

/* Check the arrays that accompany features, if present. */
static int check_features(reading *x, const vg_head *h, vg_err *e)
{
    const uint64_t turns[2] = {x->frames, 4}, centroids[3] = {x->frames, UINT64_MAX, 3};
    const struct held *t = &x->held[ROOT_TURNS], *c = &x->held[CENTROIDS];
    int r = vg_mesh_check(&h->body.mesh, x->subject, e);
    if (r < 0) return r;
    if (t->there && (!is_float(t) || !has_shape(t, 2, turns)))
        return wrong_array(x, ROOT_TURNS, "is not of shape (frames, 4) with float32 or float64", e);
    if (c->there && (!is_float(c) || !has_shape(c, 3, centroids) || c->a.shape[1] == 0))
        return wrong_array(x, CENTROIDS, "is not of shape (frames, components, 3) with float32 or float64", e);
    return VG_OK;
}

static int check_labels(const reading *x, vg_err *e)
{
    const uint64_t shape[1] = {x->frames};
    const struct held *names = &x->held[NAMES], *times = &x->held[TIMES];
    if (names->there && ((names->a.kind != 'U' && names->a.kind != 'S') || !has_shape(names, 1, shape)))
        return wrong_array(x, NAMES, "is not a list of texts, one for each frame", e);
    if (times->there && (!is_float(times) || !has_shape(times, 1, shape)))
        return wrong_array(x, TIMES, "is not of shape (frames) with float32 or float64", e);
    return VG_OK;
}

/* Remove faces that are invalid in a mesh, unless the frames have one value per corner. */
static int mend(reading *x, vg_head *h, vg_err *e)
{
    if (h->kind == VG_VERTICES && *x->unused) vgi_note(&x->note, "left out the arrays %s", x->unused);
    if (h->kind != VG_VERTICES || !h->body.mesh.nf) return VG_OK;
    double *first = vgi_array_raw(x->count, 3 * sizeof *first, e);
    int r = first ? copy_floats(x, x->values, 0, 3 * x->count, first, e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_mend_faces(&h->body.mesh, first, NULL, &x->note, x->subject, e);
    free(first);
    return r;
}

static const char *note_of(const void *state)
{
    return ((const reading *)state)->note.text;
}

static int open_npz(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject, vg_err *e)
{
    reading *x = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->subject = subject;
    int r = hold_all(x, in, e);
    if (r == VG_OK) r = choose_values(x, h, how, e);
    if (r == VG_OK) r = take_reference(x, h, e);
    if (r == VG_OK) r = take_faces(x, h, e);
    if (r == VG_OK) r = mend(x, h, e);
    if (r == VG_OK) r = h->kind == VG_FEATURES ? check_features(x, h, e) : take_graph(x, h, e);
    return r < 0 ? r : check_labels(x, e);
}

static int check_quaternions(const reading *x, const double *q, vg_err *e)
{
    for (size_t i = 0; x->values == DEFORMATIONS && i < x->count; i++, q += 4)
        if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0)
            return wrong_array(x, x->values, "holds a quaternion that is zero", e);
    return VG_OK;
}

static int take_name(reading *x, vg_frame *f, vg_err *e)
{
    if (!x->held[NAMES].there) return VG_OK;
    char *name = NULL;
    int r = text_at(x, NAMES, x->next, &name, e);
    if (r == VG_OK) r = vg_frame_rename(f, name, e);
    free(name);
    return r;
}

static int take_channel(reading *x, vg_frame *f, enum array i, const char *name, vg_element element, size_t width,
                        size_t count, vg_err *e)
{
    vg_channel *c;
    int r = vg_frame_add(f, name, "", element, width, count, &c, e);
    if (r < 0) return r;
    c->precision = x->held[i].a.item == 4 ? VG_F32 : VG_F64;
    return copy_floats(x, i, x->next * width * count, width * count, c->numbers, e);
}

static int take_channels(reading *x, vg_frame *f, vg_err *e)
{
    int r = VG_OK;
    vg_frame_drop_all(f);
    if (x->held[ROOT_TURNS].there) r = take_channel(x, f, ROOT_TURNS, VGI_NPZ_ROOT_TURN, VG_OF_FRAME, 4, 1, e);
    if (r == VG_OK && x->held[CENTROIDS].there)
        r = take_channel(x, f, CENTROIDS, VGI_NPZ_CENTROIDS, VG_OF_COMPONENT, 3, (size_t)x->held[CENTROIDS].a.shape[1], e);
    return r;
}

static int next_npz(void *state, vg_frame *f, vg_err *e)
{
    reading *x = state;
    size_t per_frame = x->count * x->width;
    if (x->next == x->frames) return 0;
    int r = copy_floats(x, x->values, x->next * per_frame, per_frame, f->values, e);
    if (r == VG_OK) r = check_quaternions(x, f->values, e);
    if (r == VG_OK && x->values == FEATURES) r = take_channels(x, f, e);
    if (r == VG_OK && (x->values == VECTORS || x->values == DEFORMATIONS))
        r = copy_floats(x, ROOTS, 3 * x->next, 3, f->root, e);
    if (r == VG_OK && x->nanchors)
        r = copy_floats(x, ANCHOR_POSITIONS, 3 * x->nanchors * x->next, 3 * x->nanchors,
                        vg_frame_anchors(f), e);
    f->has_time = x->held[TIMES].there;
    if (r == VG_OK && f->has_time) r = copy_floats(x, TIMES, x->next, 1, &f->time, e);
    if (r == VG_OK) r = take_name(x, f, e);
    x->next++;
    return r < 0 ? r : 1;
}

static uint64_t count_frames(const void *state)
{
    return ((const reading *)state)->frames;
}

static void close_npz(void *state)
{
    reading *x = state;
    if (!x) return;
    for (int i = 0; i < ARRAYS; i++) vg_bytes_clear(&x->held[i].data);
    free(x);
}

/* Whether it is a zip whose first member is named "... .npy". */
static bool sniff_npz(const unsigned char *data, size_t n)
{
    enum { LOCAL = 30, NAME_BYTES = 26 };
    if (n < LOCAL || memcmp(data, "PK\3\4", 4) != 0) return false;
    size_t name = data[NAME_BYTES] | (size_t)data[NAME_BYTES + 1] << 8;
    return name <= n - LOCAL && vgi_has_suffix((const char *)data + LOCAL, name, ".npy");
}

const vgi_sequence_format vgi_sequence_npz = {
    .name = "npz", .suffix = ".npz", .uses = VGI_USES_AXES,
    .keeps = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_NAMES | VGI_KEEPS_TIMES |
             VGI_KEEPS_DOUBLES,
    .sniff = sniff_npz, .open = open_npz, .next = next_npz, .frames = count_frames, .note = note_of,
    .close = close_npz,
    .kinds = 1 << VG_VERTICES | 1 << VG_VECTORS | 1 << VG_DEFORMATIONS | 1 << VG_TRANSFORMS | 1 << VG_FEATURES,
    .begin = vgi_npz_begin, .put = vgi_npz_put, .end = vgi_npz_end, .warning = vgi_npz_warning,
    .release = vgi_npz_release};
