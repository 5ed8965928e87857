/* npy.c: NPY, one NumPy array: positions (frames x vertices x 3); vectors, deformations and transforms can be written
 * too. The faces are in a mesh file beside the array; several arrays in one file are in npz.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/npy.h"

#include <math.h>
#include <stdlib.h>

static const char magic[6] = "\x93NUMPY";

/* -------------------------------------------------------------------------------------------- header -- */

/* The header is the text of a Python dictionary with the keys descr, fortran_order and shape. */
struct text {
    const char *p, *end;
};

static void skip_blanks(struct text *t)
{
    while (t->p < t->end && (*t->p == ' ' || *t->p == '\t' || *t->p == '\n')) t->p++;
}

static bool take_character(struct text *t, char c)
{
    skip_blanks(t);
    if (t->p == t->end || *t->p != c) return false;
    t->p++;
    return true;
}

static bool take_word(struct text *t, const char *word)
{
    size_t n = strlen(word);
    skip_blanks(t);
    if ((size_t)(t->end - t->p) < n || memcmp(t->p, word, n) != 0) return false;
    t->p += n;
    return true;
}

/* A string in either kind of quotes, without escapes. */
static bool take_string(struct text *t, const char **s, size_t *n)
{
    skip_blanks(t);
    if (t->p == t->end || (*t->p != '\'' && *t->p != '"')) return false;
    const char *close = memchr(t->p + 1, *t->p, (size_t)(t->end - t->p - 1));
    if (!close) return false;
    *s = t->p + 1;
    *n = (size_t)(close - *s);
    t->p = close + 1;
    return true;
}

/* "<f4": byte order, kind, bytes (of 'U': characters of 4 bytes). */
static bool take_descr(struct text *t, vgi_npy *a)
{
    const char *s;
    size_t n;
    int64_t item;
    if (!take_string(t, &s, &n) || n < 3 || !strchr("<>|=", *s) || !strchr("fiubUS", s[1])) return false;
    if (vgi_parse_int(s + 2, s + n, &item) != s + n || item < 0 || item > 1 << 20) return false;
    if (item == 0 && s[1] != 'U' && s[1] != 'S') return false;
    a->big = *s == '>';
    a->kind = s[1];
    a->item = (size_t)item * (a->kind == 'U' ? 4 : 1);
    return true;
}

/* "(2, 3)", "(2,)", "()" */
static bool take_shape(struct text *t, vgi_npy *a)
{
    if (!take_character(t, '(')) return false;
    for (a->ndim = 0; !take_character(t, ')'); a->ndim++) {
        int64_t x;
        if (a->ndim && !take_character(t, ',')) return false;
        if (a->ndim && take_character(t, ')')) break;
        skip_blanks(t);
        const char *end = t->p < t->end && *t->p != '-' ? vgi_parse_int(t->p, t->end, &x) : NULL;
        if (!end || a->ndim == VGI_NPY_DIMENSIONS) return false;
        t->p = end;
        if (t->p < t->end && *t->p == 'L') t->p++; /* Python 2 */
        a->shape[a->ndim] = (uint64_t)x;
    }
    return true;
}

static bool take_bool(struct text *t, bool *b)
{
    *b = take_word(t, "True");
    return *b || take_word(t, "False");
}

static bool parse_header(struct text *t, vgi_npy *a)
{
    bool descr = false, order = false, shape = false;
    if (!take_character(t, '{')) return false;
    while (!take_character(t, '}')) {
        const char *key;
        size_t n;
        if ((descr || order || shape) && !take_character(t, ',')) return false;
        if (take_character(t, '}')) break;
        if (!take_string(t, &key, &n) || !take_character(t, ':')) return false;
        if (n == 5 && !memcmp(key, "descr", 5) && !descr) descr = take_descr(t, a);
        else if (n == 13 && !memcmp(key, "fortran_order", 13) && !order) order = take_bool(t, &a->fortran);
        else if (n == 5 && !memcmp(key, "shape", 5) && !shape) shape = take_shape(t, a);
        else return false;
        if (t->p == t->end) return false;
    }
    skip_blanks(t);
    return t->p == t->end && descr && order && shape;
}

static int cut_short(int r, const char *subject, vg_err *e)
{
    return r == VG_ETRUNC ? vg_fail(e, r, "%s ends within the header of the array", subject) : r;
}

static int count_bytes(const vgi_npy *a, size_t *bytes, const char *subject, vg_err *e)
{
    *bytes = a->item;
    for (size_t d = 0; d < a->ndim; d++)
        if (a->shape[d] > SIZE_MAX || !vgi_mul(*bytes, (size_t)a->shape[d], bytes))
            return vg_fail(e, VG_EINPUT, "%s announces an array that is too large for this machine", subject);
    return VG_OK;
}

static bool sniff_npy(const unsigned char *data, size_t n)
{
    return n >= sizeof magic && !memcmp(data, magic, sizeof magic);
}

int vgi_npy_read(vgi_npy *a, size_t *bytes, vgi_input *in, const char *subject, vg_err *e)
{
    enum { MOST = 1 << 16 };
    unsigned char head[12];
    *a = (vgi_npy){0};
    int r = cut_short(vgi_input_read(in, head, 10, NULL, e), subject, e);
    if (r < 0) return r;
    if (!sniff_npy(head, 10)) return vg_fail(e, VG_EINPUT, "%s is not a NumPy array", subject);
    if (head[6] < 1 || head[6] > 3)
        return vg_fail(e, VG_EINPUT, "%s is a NumPy array of version %d: 1 to 3 are known", subject, head[6]);
    size_t n = head[8] | (size_t)head[9] << 8;
    if (head[6] > 1) {
        if ((r = cut_short(vgi_input_read(in, head + 10, 2, NULL, e), subject, e)) < 0) return r;
        n = vgi_get32(head + 8);
    }
    if (n > MOST) return vg_fail(e, VG_EINPUT, "%s: the header of the array is %zu bytes long", subject, n);
    vg_bytes b = {0};
    r = cut_short(vgi_input_take(in, &b, n, NULL, e), subject, e);
    struct text t = {(const char *)b.data, b.data ? (const char *)b.data + b.size : NULL};
    if (r == VG_OK && !(n && parse_header(&t, a)))
        r = vg_fail(e, VG_EINPUT, "%s: the header of the array is not supported: plain numbers or text, at "
                    "most %d dimensions", subject, VGI_NPY_DIMENSIONS);
    vg_bytes_clear(&b);
    return r < 0 ? r : count_bytes(a, bytes, subject, e);
}

void vgi_npy_write(unsigned char to[VGI_NPY_HEADER], const char *descr, size_t ndim, const uint64_t *shape)
{
    char text[VGI_NPY_HEADER];
    size_t n = (size_t)snprintf(text, sizeof text, "{'descr': '%s', 'fortran_order': False, 'shape': (", descr);
    for (size_t d = 0; d < ndim; d++)
        n += (size_t)snprintf(text + n, sizeof text - n, d ? ", %llu" : "%llu", (unsigned long long)shape[d]);
    n += (size_t)snprintf(text + n, sizeof text - n, ndim == 1 ? ",), }" : "), }");
    memcpy(to, magic, sizeof magic);
    to[6] = 1, to[7] = 0;
    to[8] = VGI_NPY_HEADER - 10, to[9] = 0;
    memset(to + 10, ' ', VGI_NPY_HEADER - 11);
    memcpy(to + 10, text, n);
    to[VGI_NPY_HEADER - 1] = '\n';
}

/* ------------------------------------------------------------------------------------------- numbers -- */

double vgi_npy_float(const vgi_npy *a, const unsigned char *p)
{
    if (a->item == 4) return vgi_as_float(a->big ? __builtin_bswap32(vgi_get32(p)) : vgi_get32(p));
    return vgi_as_double(a->big ? __builtin_bswap64(vgi_get64(p)) : vgi_get64(p));
}

size_t vgi_npy_stride(const vgi_npy *a, size_t d)
{
    size_t n = 1;
    if (a->fortran)
        for (size_t i = 0; i < d; i++) n *= (size_t)a->shape[i];
    else
        for (size_t i = d + 1; i < a->ndim; i++) n *= (size_t)a->shape[i];
    return n;
}

int vgi_npy_store(vg_bytes *to, const double *x, size_t n, bool doubles, vg_err *e)
{
    size_t item = doubles ? 8 : 4;
    int r = vgi_bytes_reserve(to, to->size + n * item, e);
    if (r < 0) return r;
    unsigned char *p = to->data + to->size;
    for (size_t i = 0; i < n; i++, p += item) {
        float f = (float)x[i];
        if (!isfinite(doubles ? x[i] : (double)f))
            return vg_fail(e, VG_EINPUT,
                           "number %zu of it does not fit binary32 (%g): 'vg-decode --f64' writes binary64", i, x[i]);
        if (doubles) vgi_put64(p, vgi_double_bits(x[i]));
        else vgi_put32(p, vgi_float_bits(f));
    }
    to->size += n * item;
    return VG_OK;
}

/* ------------------------------------------------------------------------------------------- reading -- */

typedef struct reading {
    vgi_npy a;
    vgi_input *in;
    const char *subject;
    size_t frames, points, next;
    bool whole;     /* Fortran order scatters frames: `data` holds the whole file, otherwise one frame */
    bool have_data;
    vg_bytes data;
} reading;

static int wrong_shape(const vgi_npy *a, const char *subject, vg_err *e)
{
    char shape[100] = "";
    for (size_t d = 0, n = 0; d < a->ndim; d++)
        n += (size_t)snprintf(shape + n, sizeof shape - n, d ? ", %llu" : "%llu", (unsigned long long)a->shape[d]);
    return vg_fail(e, VG_EINPUT, "%s has shape (%s): expected positions, (frames, vertices, 3) or (vertices, 3)",
                   subject, shape);
}

static int judge_shape(reading *x, vg_err *e)
{
    const vgi_npy *a = &x->a;
    if (a->kind != 'f' || (a->item != 4 && a->item != 8))
        return vg_fail(e, VG_EINPUT, "%s holds no binary32 or binary64 numbers: store it as float32 or float64",
                       x->subject);
    if (a->ndim < 2 || a->ndim > 3 || a->shape[a->ndim - 1] != 3) return wrong_shape(a, x->subject, e);
    uint64_t points = a->shape[a->ndim - 2], frames = a->ndim == 3 ? a->shape[0] : 1;
    if (points == 0 || points >= UINT32_MAX || frames == 0) return wrong_shape(a, x->subject, e);
    x->points = (size_t)points, x->frames = (size_t)frames;
    x->whole = a->fortran && frames > 1;
    return VG_OK;
}

static int take_data(reading *x, vg_err *e)
{
    size_t bytes = x->points * 3 * x->a.item;
    x->data.size = 0;
    int r = vgi_input_take(x->in, &x->data, x->whole ? bytes * x->frames : bytes, NULL, e);
    x->have_data = r == VG_OK;
    return r == VG_ETRUNC
               ? vg_fail(e, r, "%s ends too early: in frame %zu of %zu", x->subject, x->next + 1, x->frames)
               : r;
}

static int open_npy(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                    vg_err *e)
{
    (void)how;
    size_t bytes;
    reading *x = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->in = in, x->subject = subject;
    int r = vgi_npy_read(&x->a, &bytes, in, subject, e);
    if (r == VG_OK) r = judge_shape(x, e);
    if (r == VG_OK) r = take_data(x, e);
    h->kind = VG_VERTICES, h->precision = x->a.item == 4 ? VG_F32 : VG_F64;
    h->count = h->body.mesh.nv = x->points;
    return r;
}

/* Returns 0 (end of sequence) if the file ends, too. */
static int finish_frames(reading *x, vg_err *e)
{
    int r = vgi_input_ended(x->in, e);
    if (r != 0) return r < 0 ? r : 0;
    return vg_fail(e, VG_EINPUT, "%s has data after its %zu frames of %zu points", x->subject, x->frames, x->points);
}

static int next_npy(void *state, vg_frame *f, vg_err *e)
{
    reading *x = state;
    const vgi_npy *a = &x->a;
    int r;
    if (x->next == x->frames) return finish_frames(x, e);
    if (!x->have_data && (r = take_data(x, e)) < 0) return r;
    size_t per_point = vgi_npy_stride(a, a->ndim - 2), per_axis = vgi_npy_stride(a, a->ndim - 1);
    size_t first = x->whole ? x->next * vgi_npy_stride(a, 0) : 0;
    for (size_t v = 0; v < x->points; v++)
        for (size_t k = 0; k < 3; k++) {
            double value = vgi_npy_float(a, x->data.data + (first + v * per_point + k * per_axis) * a->item);
            if (!isfinite(value))
                return vg_fail(e, VG_EINPUT, "%s: point %zu of frame %zu is not finite", x->subject, v, x->next + 1);
            f->values[3 * v + k] = value;
        }
    x->have_data = x->whole;
    x->next++;
    return 1;
}

static uint64_t count_frames(const void *state)
{
    return ((const reading *)state)->frames;
}

static void close_npy(void *state)
{
    reading *x = state;
    if (!x) return;
    vg_bytes_clear(&x->data);
    free(x);
}

/* ------------------------------------------------------------------------------------------- writing -- */

typedef struct writing {
    vgi_output *out;
    const vg_head *h;
    bool doubles;
    uint64_t frames;
    vg_bytes frame;
} writing;

static void header(const writing *x, unsigned char to[VGI_NPY_HEADER])
{
    const uint64_t shape[3] = {x->frames, x->h->count, vg_head_width(x->h)};
    vgi_npy_write(to, x->doubles ? "<f8" : "<f4", 3, shape);
}

static int begin_npy(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e)
{
    unsigned char head[VGI_NPY_HEADER];
    writing *x = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->out = out, x->h = h, x->doubles = o->full_precision;
    header(x, head);
    return vgi_output_put(out, head, sizeof head, e);
}

static int put_npy(void *state, const vg_frame *f, vg_err *e)
{
    writing *x = state;
    x->frame.size = 0;
    int r = vgi_npy_store(&x->frame, f->values, x->h->count * vg_head_width(x->h), x->doubles, e);
    x->frames++;
    return r < 0 ? r : vgi_output_put(x->out, x->frame.data, x->frame.size, e);
}

static int end_npy(void *state, vg_err *e)
{
    unsigned char head[VGI_NPY_HEADER];
    writing *x = state;
    header(x, head);
    return vgi_output_patch(x->out, 0, head, sizeof head, e);
}

static const char *warn_npy(void *state)
{
    const writing *x = state;
    bool rooted = x->h->kind == VG_VECTORS || x->h->kind == VG_DEFORMATIONS;
    if (x->h->kind == VG_FEATURES) return "rotations of the root and centroids (an .npz keeps them)";
    return rooted ? "where the frames are in space (an .npz keeps it)" : NULL;
}

static void release_npy(void *state)
{
    writing *x = state;
    if (!x) return;
    vg_bytes_clear(&x->frame);
    free(x);
}

const vgi_sequence_format vgi_sequence_npy = {
    .name = "npy", .suffix = ".npy", .keeps = VGI_KEEPS_ORDER | VGI_KEEPS_DOUBLES, .bare = true,
    .sniff = sniff_npy, .open = open_npy, .next = next_npy, .frames = count_frames, .close = close_npy,
    .kinds = 1 << VG_VERTICES | 1 << VG_VECTORS | 1 << VG_DEFORMATIONS | 1 << VG_TRANSFORMS |
             1 << VG_FEATURES | 1 << VG_COORDINATES,
    .begin = begin_npy, .put = put_npy, .end = end_npy, .warning = warn_npy, .release = release_npy};
