/* frame_io.c: reads and writes a frame (fmt/STREAM.md, section 3.12): name, channels, values. Record headers and
 * checksums are in record.c, their order in stream.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/numbers_kernel.h"
#include "io/cursor.h"
#include "model/artefact.h"
#include "model/form.h"
#include "model/frame.h"

enum { AS_INDICES = 1 }; /* Type of a channel; the others are a vg_precision */
enum { MOST_CHANNELS = 255 };

/* Known channels, and the forms that may have them. */
enum { TIME, ROOT, ANCHORS, PINS, TURNS, MEANINGS };
static const struct {
    const char *name;
    vg_element element;
    size_t width;
} meanings[MEANINGS] = {
    [TIME] = {"time", VG_OF_FRAME, 1},      [ROOT] = {"root", VG_OF_FRAME, 3},
    [ANCHORS] = {"anchors", VG_OF_ANCHOR, 3}, [PINS] = {"pins", VG_OF_LIST, 1},
    [TURNS] = {"turns", VG_OF_JOINT, 4}};

static int meaning_of(const char *name, size_t n)
{
    int i = 0;
    while (i < MEANINGS && (strlen(meanings[i].name) != n || memcmp(meanings[i].name, name, n))) i++;
    return i;
}

static bool goes_with(int meaning, const vgi_form *h)
{
    switch (meaning) {
    case ROOT:
    case ANCHORS: return h->on_corners;
    case PINS: return h->kind == VG_VECTORS;
    case TURNS: return h->kind == VG_VERTICES && h->elements[VG_OF_JOINT] > 0;
    default: return true;
    }
}

static bool count_fits(const vgi_form *h, vg_element element, uint64_t count)
{
    size_t n = h->elements[element];
    if (element == VG_OF_LIST) return count > 0;
    return n == SIZE_MAX || n == count;
}

/* ---- reading ---- */

typedef struct taken { /* the fields that precede the numbers of a channel */
    vgi_channel_texts texts;
    uint64_t width, count, type;
} taken;

static int take_front(cursor *c, taken *t, const vgi_payload *p, vg_err *e)
{
    int r = VG_OK;
    t->texts.name = peek_text(c, &t->texts.name_bytes, p, &r, e);
    if (r == VG_OK) t->texts.unit = peek_text(c, &t->texts.unit_bytes, p, &r, e);
    if (r == VG_OK) t->texts.element = peek_text(c, &t->texts.element_bytes, p, &r, e);
    if (r < 0) return r;
    t->width = take64(c), t->count = take64(c), t->type = take64(c);
    if (c->bad) return wrong(p, "it is shorter than its counts say", e);
    return t->texts.name_bytes ? VG_OK : wrong(p, "a channel has no name", e);
}

static int wrong_channel(const vgi_payload *p, const taken *t, const char *what, vg_err *e)
{
    int n = t->texts.name_bytes < 60 ? (int)t->texts.name_bytes : 60;
    return vg_fail(e, VG_EINPUT, "%s: channel '%.*s': %s", p->where, n, t->texts.name, what);
}

static const char *refuse_meaning(const taken *t, vg_element element, const vgi_form *h)
{
    int meaning = meaning_of(t->texts.name, t->texts.name_bytes);
    if (meaning == MEANINGS) return NULL;
    if (meanings[meaning].element != element || meanings[meaning].width != t->width)
        return "its elements or their width are not those of its name";
    return goes_with(meaning, h) ? NULL : "it does not belong to these frames";
}

static const char *refuse_channel(const taken *t, vg_element element, const vgi_form *h)
{
    if (t->width == 0) return "its elements have no width";
    if ((element == VG_OF_LIST) != (t->type == AS_INDICES)) return "its type does not fit its elements";
    if (t->type != AS_INDICES && t->type != VG_F32 && t->type != VG_F64) return "its type is unknown";
    if (element == VG_OF_LIST && t->width != 1) return "a list has one vertex for each element";
    return count_fits(h, element, t->count) ? refuse_meaning(t, element, h) : "its count does not fit its elements";
}

/* Store the numbers of a channel; time and root have their own members. */
static int take_numbers(cursor *c, vg_frame *f, const vgi_form *h, const taken *t, const vgi_payload *p, vg_err *e)
{
    size_t n, size = t->type == VG_F64 ? 8 : 4;
    const unsigned char *data = vgi_mul((size_t)t->width, (size_t)t->count, &n) ? take_array(c, n, size) : NULL;
    if (!data) return wrong_channel(p, t, "it is shorter than its counts say", e);
    if (!take_padding(c, -(n * size) & 7)) return wrong(p, "padding is missing or not zero", e);
    int meaning = meaning_of(t->texts.name, t->texts.name_bytes);
    double *to = meaning == TIME ? &f->time : f->root;
    if (meaning != TIME && meaning != ROOT) {
        vg_channel *channel;
        int r = vgi_frame_add(f, &t->texts, (size_t)t->width, (size_t)t->count, &channel, e);
        if (r < 0) return r;
        if (t->type == AS_INDICES) {
            copy32(channel->vertices, data, n);
            return vgi_check_ascending(p->where, channel->vertices, n, h->elements[VG_OF_VERTEX], e);
        }
        channel->precision = t->type == h->precision ? 0 : (vg_precision)t->type;
        to = channel->numbers;
    }
    if (t->type == VG_F64) copy_doubles(to, data, n);
    else copy_floats(to, data, n);
    if (!vgi_finite(to, n)) return wrong_channel(p, t, "a number is not finite", e);
    return meaning != TURNS || vgi_are_turns(to, n / 4) ? VG_OK : wrong_channel(p, t, "a turn is not a unit "
                                                                                      "quaternion", e);
}

static int take_channel(cursor *c, vg_frame *f, const vgi_form *h, bool *seen, const vgi_payload *p, vg_err *e)
{
    taken t;
    int r = take_front(c, &t, p, e);
    if (r < 0) return r;
    char name[64] = "";
    vg_element element = VG_OF_UNKNOWN;
    if (t.texts.element_bytes < sizeof name) {
        memcpy(name, t.texts.element, t.texts.element_bytes);
        element = vgi_element_find(name);
    }
    int meaning = meaning_of(t.texts.name, t.texts.name_bytes);
    bool again = meaning < MEANINGS && seen[meaning];
    for (size_t i = 0; !again && i < f->nchannels; i++)
        again = strlen(f->channels[i].name) == t.texts.name_bytes &&
                !memcmp(f->channels[i].name, t.texts.name, t.texts.name_bytes);
    const char *why = again ? "the frame has another one" : refuse_channel(&t, element, h);
    if (why) return wrong_channel(p, &t, why, e);
    if (meaning < MEANINGS) seen[meaning] = true;
    return take_numbers(c, f, h, &t, p, e);
}

static int take_channels(cursor *c, vg_frame *f, const vgi_form *h, const vgi_payload *p, vg_err *e)
{
    bool seen[MEANINGS] = {false};
    int r = VG_OK;
    uint64_t n = take64(c);
    if (c->bad) return wrong(p, "it is shorter than its counts say", e);
    if (n > MOST_CHANNELS) return wrong(p, "it has more than 255 channels", e);
    f->time = 0;
    for (uint64_t i = 0; r == VG_OK && i < n; i++) r = take_channel(c, f, h, seen, p, e);
    f->has_time = seen[TIME];
    if (r < 0) return r;
    if (h->on_corners && !seen[ROOT]) return wrong(p, "it has no channel 'root'", e);
    return h->on_corners && h->elements[VG_OF_ANCHOR] && !seen[ANCHORS] ? wrong(p, "it has no channel 'anchors'", e)
                                                                        : VG_OK;
}

/* Deformations and transforms start with a quaternion. */
static bool has_zero_quaternion(const vgi_form *h, const double *values)
{
    if (h->kind != VG_DEFORMATIONS && h->kind != VG_TRANSFORMS) return false;
    for (size_t i = 0; i < h->count; i++) {
        const double *q = values + i * h->width;
        bool zero = h->precision == VG_F64
                        ? q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0
                        : (float)q[0] == 0 && (float)q[1] == 0 && (float)q[2] == 0 && (float)q[3] == 0;
        if (zero) return true;
    }
    return false;
}

/* Binary64 is used in place. */
static int take_values(cursor *c, vg_frame *f, const vgi_form *h, const vgi_payload *p, vg_err *e)
{
    size_t n;
    if (!vgi_mul(h->count, h->width, &n)) return wrong(p, "its length does not fit the count of FORM", e);
    const unsigned char *data = take_array(c, n, h->precision);
    if (c->bad || !take_padding(c, -(n * h->precision) & 7) || left(c))
        return wrong(p, "its length does not fit the count of FORM", e);
    if (h->precision == VG_F64 && NATIVE && (uintptr_t)data % _Alignof(double) == 0) {
        f->values = (double *)(uintptr_t)data;
        return VG_OK;
    }
    int r = vgi_grow(&f->values_own, &f->values_cap, n, sizeof *f->values, e);
    if (r < 0) return r;
    f->values = f->values_own;
    if (h->precision == VG_F64) copy_doubles(f->values, data, n);
    else copy_floats(f->values, data, n);
    return VG_OK;
}

int vgi_fram_decode(vg_frame *f, const vgi_form *h, const char *where, vg_err *e)
{
    vgi_payload p = {f->raw.data, f->raw.size, where};
    cursor c = start(&p);
    size_t n;
    int r = VG_OK;
    const char *name = peek_text(&c, &n, &p, &r, e);
    if (!name || (r = vgi_grow(&f->name, &f->name_cap, n + 1, 1, e)) < 0) return r;
    memcpy(f->name, name, n);
    f->name[n] = 0;
    vg_frame_drop_all(f);
    if ((r = take_channels(&c, f, h, &p, e)) < 0 || (r = take_values(&c, f, h, &p, e)) < 0) return r;
    if (!vgi_finite(f->values, h->count * h->width)) return wrong(&p, "a value is not finite", e);
    return has_zero_quaternion(h, f->values) ? wrong(&p, "a quaternion is zero", e) : VG_OK;
}

/* ---- writing ---- */

/* Channels whose elements no longer match the head are dropped, such as rotations of a skeleton that was replaced. */
static bool is_written(const vg_channel *c, const vgi_form *h)
{
    int meaning = meaning_of(c->name, strlen(c->name));
    return c->width && count_fits(h, c->element, c->count) &&
           (meaning == MEANINGS || (goes_with(meaning, h) && meaning != TIME && meaning != ROOT));
}

static int put_front(vg_bytes *b, const vgi_channel_texts *t, size_t width, size_t count, uint64_t type, vg_err *e)
{
    int r = put_text(b, t->name, e);
    if (r == VG_OK) r = put_text(b, t->unit, e);
    if (r == VG_OK) r = put_text(b, t->element, e);
    if (r == VG_OK) r = put64(b, width, e);
    if (r == VG_OK) r = put64(b, count, e);
    return r < 0 ? r : put64(b, type, e);
}

/* time, root: one element of the frame. */
static int put_own(vg_bytes *b, int meaning, const char *unit, const double *numbers, vg_err *e)
{
    vgi_channel_texts t = {.name = meanings[meaning].name, .unit = unit, .element = "frame"};
    int r = put_front(b, &t, meanings[meaning].width, 1, VG_F64, e);
    return r < 0 ? r : put_doubles(b, numbers, meanings[meaning].width, e);
}

static int append_values(vg_bytes *b, const double *x, size_t n, vg_precision precision, vg_err *e)
{
    if (precision == VG_F64) return put_doubles(b, x, n, e);
    int r = vgi_bytes_reserve(b, b->size + 4 * n, e); /* the content so far ends at a multiple of 8 */
    if (r == VG_OK && NATIVE && vgi_to_single((float *)(void *)(b->data + b->size), x, n)) b->size += 4 * n, n = 0;
    for (size_t i = 0; r == VG_OK && i < n; i++, b->size += 4) {
        float y = (float)x[i];
        if (!(y - y == 0)) return vg_fail(e, VG_EINPUT, "%g does not fit into binary32: write binary64", x[i]);
        vgi_put32(b->data + b->size, vgi_float_bits(y));
    }
    return r;
}

static int put_channel(vg_bytes *b, const vg_channel *c, const vgi_form *h, vg_err *e)
{
    vg_precision precision = c->precision ? c->precision : h->precision;
    vgi_channel_texts t = {.name = c->name, .unit = c->unit, .element = c->element_name};
    int r = put_front(b, &t, c->width, c->count, c->vertices ? AS_INDICES : precision, e);
    if (r == VG_OK && c->vertices) r = put_indices(b, c->vertices, c->count, e);
    else if (r == VG_OK) r = append_values(b, c->numbers, c->width * c->count, precision, e);
    return r < 0 ? r : put_padding(b, 0, e);
}

/* Check what a reader would refuse. */
static int check_channel(const vg_channel *c, const vgi_form *h, const char *name, vg_err *e)
{
    char where[200];
    snprintf(where, sizeof where, "frame '%.80s': channel '%.60s'", name, c->name);
    if (c->vertices) return vgi_check_ascending(where, c->vertices, c->count, h->elements[VG_OF_VERTEX], e);
    if (!vgi_finite(c->numbers, c->width * c->count)) return vgi_wrong(where, "a number is not finite", e);
    if (!strcmp(c->name, "turns") && !vgi_are_turns(c->numbers, c->count))
        return vgi_wrong(where, "a turn is not a unit quaternion", e);
    return VG_OK;
}

/* vg_writer_put checks that the values are finite. */
static int check_frame(const vgi_form *h, const vg_frame *f, const char *name, uint64_t *written, vg_err *e)
{
    int r = VG_OK;
    *written = (uint64_t)f->has_time + h->on_corners;
    if ((f->has_time && !vgi_finite(&f->time, 1)) || (h->on_corners && !vgi_finite(f->root, 3)))
        return vg_fail(e, VG_EINPUT, "frame '%s' has a time or root that is not finite", name);
    if (has_zero_quaternion(h, f->values))
        return vg_fail(e, VG_EINPUT, "frame '%s' has a quaternion that is zero", name);
    for (size_t i = 0; r == VG_OK && i < f->nchannels; i++)
        if (is_written(&f->channels[i], h)) (*written)++, r = check_channel(&f->channels[i], h, name, e);
    if (r == VG_OK && *written > MOST_CHANNELS)
        return vg_fail(e, VG_EARG, "frame '%s' has more than %d channels", name, MOST_CHANNELS);
    return r;
}

int vgi_fram_encode(vg_bytes *b, const vgi_form *h, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    uint64_t written;
    int r = check_frame(h, f, name, &written, e);
    if (r == VG_OK) r = put_text(b, name, e);
    if (r == VG_OK) r = put64(b, written, e);
    if (r == VG_OK && f->has_time) r = put_own(b, TIME, "s", &f->time, e);
    if (r == VG_OK && h->on_corners) r = put_own(b, ROOT, "", f->root, e);
    for (size_t i = 0; r == VG_OK && i < f->nchannels; i++)
        if (is_written(&f->channels[i], h)) r = put_channel(b, &f->channels[i], h, e);
    return r;
}

int vgi_values_encode(vg_bytes *b, const double *x, size_t n, vg_precision precision, const void **data,
                      size_t *bytes, vg_err *e)
{
    *data = x;
    *bytes = n * sizeof *x;
    if (precision == VG_F64 && NATIVE) return VG_OK;
    b->size = 0;
    int r = append_values(b, x, n, precision, e);
    if (r == VG_OK) r = put_padding(b, 0, e);
    *data = b->data;
    *bytes = b->size;
    return r;
}
