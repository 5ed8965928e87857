/* album.c: keeps evenly spaced frames of a sequence of unknown length in bounded memory. One frame in `stride` is
 * kept; when the memory is full, every second one is dropped and the stride doubles. The last frame is always kept.
 * The contents of a shot do not matter here.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

static void clear_shot(vgi_shot *s)
{
    free(s->name);
    free(s->points);
    free(s->numbers);
    *s = (vgi_shot){0};
}

static int make_shot(const vgi_album *a, vgi_shot *s, vg_err *e)
{
    if (!s->points) s->points = vgi_array(a->nv, 3 * sizeof *s->points, e);
    s->has_numbers = false;
    return s->points ? VG_OK : VG_ENOMEM;
}

int vgi_album_init(vgi_album *a, size_t nv, size_t want, vg_err *e)
{
    *a = (vgi_album){.nv = nv, .want = want, .stride = 1};
    /* one more, for the last frame */
    a->at = vgi_array(4 * want + 1, sizeof *a->at, e);
    a->cap = 4 * want;
    return a->at ? VG_OK : VG_ENOMEM;
}

void vgi_album_clear(vgi_album *a)
{
    for (size_t i = 0; a->at && i <= a->cap; i++) clear_shot(a->at + i);
    free(a->at);
    clear_shot(&a->last);
    *a = (vgi_album){0};
}

static void swap_shots(vgi_shot *a, vgi_shot *b)
{
    vgi_shot t = *a;
    *a = *b, *b = t;
}

static void thin_out(vgi_album *a)
{
    size_t kept = (a->n + 1) / 2;
    for (size_t i = 1; i < kept; i++) swap_shots(a->at + i, a->at + 2 * i); /* reuse their memory */
    a->n = kept;
    a->stride *= 2;
}

int vgi_album_next(vgi_album *a, vgi_shot **shot, vg_err *e)
{
    size_t index = a->seen;
    if (index % a->stride == 0 && a->n == a->cap) thin_out(a);
    bool keep = index % a->stride == 0;
    vgi_shot *s = keep ? a->at + a->n : &a->last;
    int r = make_shot(a, s, e);
    if (r < 0) return r;
    if (keep) a->n++;
    s->index = index;
    a->seen++;
    *shot = s;
    return VG_OK;
}

/* Append the last frame to those kept; returns its number. */
static size_t add_last(vgi_album *a)
{
    if (a->seen == 0) return 0;
    size_t last = a->seen - 1;
    if (a->at[a->n - 1].index != last) swap_shots(a->at + a->n++, &a->last);
    return last;
}

void vgi_album_match(vgi_album *a, const size_t *frames, size_t n, size_t *shots)
{
    add_last(a);
    for (size_t i = 0, at = 0; i < n; i++) {
        while (at + 1 < a->n && (a->at[at + 1].index <= frames[i] ||
                                 a->at[at + 1].index - frames[i] < frames[i] - a->at[at].index))
            at++;
        shots[i] = at;
    }
}

size_t vgi_album_close(vgi_album *a)
{
    size_t last = add_last(a);
    if (a->n == 0) return 0;
    if (a->n <= a->want) return a->n;
    for (size_t i = 0, from = 0; i < a->want; i++) {
        /* The frame nearest to the i-th of `want` evenly spaced ones. Wanted frames are more than a stride apart, so
         * that none is chosen twice. */
        double at = a->want > 1 ? (double)i * (double)last / (double)(a->want - 1) : 0;
        while (from + 1 < a->n && (double)a->at[from + 1].index - at < at - (double)a->at[from].index) from++;
        if (from < i) from = i;
        swap_shots(a->at + i, a->at + from);
    }
    return a->want;
}
