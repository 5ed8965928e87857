/* frame.c: a frame and its channels: allocation, filling, release. Forms are in form.c, reading and writing in
 * io/frame_io.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/frame.h"
#include "model/form.h"

#include <stdlib.h>

void vg_frame_clear(vg_frame *f)
{
    free(f->name);
    for (size_t i = 0; i < f->channels_cap; i++) {
        vg_bytes_clear(&f->channels[i].texts);
        vg_bytes_clear(&f->channels[i].data);
    }
    free(f->channels);
    free(f->values_own);
    vg_bytes_clear(&f->raw);
    vg_records_clear(&f->extra);
    *f = (vg_frame){0};
}

int vg_frame_rename(vg_frame *f, const char *name, vg_err *e)
{
    size_t n = strlen(name) + 1;
    int r = vgi_grow(&f->name, &f->name_cap, n, 1, e);
    if (r == VG_OK) memcpy(f->name, name, n);
    return r;
}

/* ---- channels ---- */

/* Entries below channels_cap are zero or hold buffers of a former channel, which are reused. */
static int more_places(vg_frame *f, vg_err *e)
{
    size_t had = f->channels_cap;
    int r = vgi_grow(&f->channels, &f->channels_cap, f->nchannels + 1, sizeof *f->channels, e);
    if (r == VG_OK && f->channels_cap > had)
        memset(f->channels + had, 0, (f->channels_cap - had) * sizeof *f->channels);
    return r;
}

static int set_texts(vg_channel *c, const vgi_channel_texts *t, vg_err *e)
{
    static const char end;
    c->texts.size = 0;
    int r = vgi_bytes_append(&c->texts, t->name, t->name_bytes, e);
    if (r == VG_OK) r = vgi_bytes_append(&c->texts, &end, 1, e);
    if (r == VG_OK) r = vgi_bytes_append(&c->texts, t->unit, t->unit_bytes, e);
    if (r == VG_OK) r = vgi_bytes_append(&c->texts, &end, 1, e);
    if (r == VG_OK) r = vgi_bytes_append(&c->texts, t->element, t->element_bytes, e);
    if (r == VG_OK) r = vgi_bytes_append(&c->texts, &end, 1, e);
    if (r < 0) return r;
    c->name = (char *)c->texts.data;
    c->unit = c->name + t->name_bytes + 1;
    c->element_name = c->unit + t->unit_bytes + 1;
    c->element = vgi_element_find(c->element_name);
    return VG_OK;
}

static int set_size(vg_channel *c, size_t width, size_t count, vg_err *e)
{
    size_t n, bytes;
    bool list = c->element == VG_OF_LIST;
    if (!vgi_mul(width, count, &n) || !vgi_mul(n, list ? sizeof *c->vertices : sizeof *c->numbers, &bytes))
        return vg_fail(e, VG_ENOMEM, "not enough memory for channel '%s'", c->name);
    int r = vgi_bytes_reserve(&c->data, bytes, e);
    if (r < 0) return r;
    c->width = width, c->count = count, c->precision = 0;
    c->numbers = list ? NULL : (double *)(void *)c->data.data;
    c->vertices = list ? (uint32_t *)(void *)c->data.data : NULL;
    return VG_OK;
}

static vg_channel *find_channel(const vg_frame *f, const char *name, size_t n)
{
    for (size_t i = 0; i < f->nchannels; i++)
        if (!strncmp(f->channels[i].name, name, n) && !f->channels[i].name[n]) return &f->channels[i];
    return NULL;
}

vg_channel *vg_frame_channel(const vg_frame *f, const char *name)
{
    return find_channel(f, name, strlen(name));
}

int vgi_frame_add(vg_frame *f, const vgi_channel_texts *t, size_t width, size_t count, vg_channel **out, vg_err *e)
{
    vg_channel *c = find_channel(f, t->name, t->name_bytes);
    bool is_new = !c;
    int r = is_new ? more_places(f, e) : VG_OK;
    if (r < 0) return r;
    if (is_new) c = &f->channels[f->nchannels++];
    r = set_texts(c, t, e);
    if (r == VG_OK) r = set_size(c, width, count, e);
    if (r < 0) f->nchannels = 0; /* texts and numbers may come from two channels */
    *out = c;
    return r;
}

int vg_frame_add(vg_frame *f, const char *name, const char *unit, vg_element element, size_t width, size_t count,
                 vg_channel **c, vg_err *e)
{
    const char *of = vg_element_name(element);
    if (!*name) return vg_fail(e, VG_EARG, "a channel needs a name");
    vgi_channel_texts t = {name, unit, of, strlen(name), strlen(unit), strlen(of)};
    return vgi_frame_add(f, &t, width, count, c, e);
}

/* Move the dropped channel behind the last one, so that its buffers are reused. */
void vg_frame_drop(vg_frame *f, const char *name)
{
    vg_channel *c = vg_frame_channel(f, name);
    if (!c) return;
    vg_channel dropped = *c;
    size_t behind = (size_t)(f->channels + f->nchannels - c) - 1;
    memmove(c, c + 1, behind * sizeof *c);
    f->channels[--f->nchannels] = dropped;
}

void vg_frame_drop_all(vg_frame *f)
{
    f->nchannels = 0;
}

int vg_frame_shape(vg_frame *f, const vg_head *h, vg_err *e)
{
    size_t n;
    double *anchors;
    if (!vgi_mul(h->count, vg_head_width(h), &n))
        return vg_fail(e, VG_ENOMEM, "not enough memory for a frame of %zu elements", h->count);
    int r = vgi_grow(&f->values_own, &f->values_cap, n, sizeof *f->values, e);
    if (r == VG_OK) f->values = f->values_own;
    vg_frame_drop_all(f);
    return r == VG_OK && vg_head_element(h) == VG_OF_CORNER ? vg_frame_make_anchors(f, h->nanchors, &anchors, e) : r;
}

size_t vg_frame_stem(const char *name, uint64_t *number)
{
    size_t n = strlen(name), end = n;
    *number = 0;
    while (n > 0 && name[n - 1] >= '0' && name[n - 1] <= '9') n--;
    for (size_t i = n; i < end; i++) /* a number of 19 digits and more is some large one */
        *number = (*number < UINT64_MAX / 10 ? 10 * *number : UINT64_MAX / 10) + (uint64_t)(name[i] - '0');
    return n > 1 && n < end && name[n - 1] == '.' ? n - 1 : 0;
}

bool vg_frame_begins(const char *name)
{
    uint64_t number;
    return vg_frame_stem(name, &number) && number == 1;
}

int vg_frame_label(vg_frame *f, vg_frame *from, vg_err *e)
{
    f->has_time = from->has_time;
    f->time = from->time;
    for (size_t i = f->nchannels; i-- > 0;)
        if (strcmp(f->channels[i].name, "anchors")) vg_frame_drop(f, f->channels[i].name);
    vg_records_clear(&f->extra);
    f->extra = from->extra;
    from->extra = (vg_records){0};
    return vg_frame_rename(f, from->name ? from->name : "", e);
}

/* ---- known channels ---- */

double *vg_frame_anchors(const vg_frame *f)
{
    const vg_channel *c = vg_frame_channel(f, "anchors");
    return c ? c->numbers : NULL;
}

int vg_frame_make_anchors(vg_frame *f, size_t n, double **positions, vg_err *e)
{
    vg_channel *c;
    *positions = NULL;
    if (!n) return vg_frame_drop(f, "anchors"), VG_OK;
    int r = vg_frame_add(f, "anchors", "", VG_OF_ANCHOR, 3, n, &c, e);
    if (r == VG_OK) c->precision = VG_F64, *positions = c->numbers;
    return r;
}

const uint32_t *vg_frame_pins(const vg_frame *f, size_t *n)
{
    const vg_channel *c = vg_frame_channel(f, "pins");
    *n = c && c->vertices ? c->count : 0;
    return c ? c->vertices : NULL;
}

int vg_frame_pin(vg_frame *f, const uint32_t *vertices, size_t n, vg_err *e)
{
    vg_channel *c;
    if (!n) return vg_frame_drop(f, "pins"), VG_OK;
    int r = vg_frame_add(f, "pins", "", VG_OF_LIST, 1, n, &c, e);
    if (r == VG_OK) memcpy(c->vertices, vertices, n * sizeof *vertices);
    return r;
}

const double *vg_frame_turns(const vg_frame *f, size_t *n)
{
    const vg_channel *c = vg_frame_channel(f, "turns");
    *n = c && c->numbers && c->width == 4 ? c->count : 0;
    return c ? c->numbers : NULL;
}

int vg_frame_turn(vg_frame *f, const double *turns, size_t njoints, vg_err *e)
{
    vg_channel *c;
    if (!njoints) return vg_frame_drop(f, "turns"), VG_OK;
    int r = vg_frame_add(f, "turns", "", VG_OF_JOINT, 4, njoints, &c, e);
    if (r < 0) return r;
    memcpy(c->numbers, turns, 4 * njoints * sizeof *turns);
    c->precision = VG_F64;
    return VG_OK;
}

vg_channel *vg_frame_scalars(const vg_frame *f)
{
    for (size_t i = 0; i < f->nchannels; i++)
        if (f->channels[i].element == VG_OF_VERTEX && f->channels[i].width == 1) return &f->channels[i];
    return NULL;
}

/* A frame has one set of scalars. */
int vg_frame_set_scalars(vg_frame *f, const char *name, const char *unit, const double *numbers, size_t nv, vg_err *e)
{
    vg_channel *c;
    while ((c = vg_frame_scalars(f))) vg_frame_drop(f, c->name);
    int r = vg_frame_add(f, name, unit, VG_OF_VERTEX, 1, nv, &c, e);
    if (r == VG_OK && nv) memcpy(c->numbers, numbers, nv * sizeof *numbers);
    return r;
}
