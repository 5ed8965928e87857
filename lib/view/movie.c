/* movie.c: an animated sheet: the pictures of all sequences side by side, one after another. Pictures are drawn in
 * sheet.c and written in webp.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/sheet.h"

#include "io/io.h"
#include "view/webp.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double caption_size = 14;
static const unsigned char ink[3] = {38, 42, 50};

/* Time of picture i in milliseconds: from the times of the frames if all have one and they increase. */
static int time_of(const vg_sheet *s, const vgi_row *q, size_t i)
{
    bool timed = true;
    for (size_t k = 1; k < s->n; k++) timed = timed && shot_of(q, k)->time > shot_of(q, k - 1)->time;
    if (s->n < 2 || !timed) return (int)(1000.0 / VG_FPS * (double)shot_of(q, i)->index);
    return (int)fmin(1000 * (shot_of(q, i)->time - shot_of(q, 0)->time), 1e8);
}

static const vgi_row *longest_of(const vg_sheet *s)
{
    const vgi_row *longest = s->at;
    for (size_t k = 1; k < s->nsequences; k++)
        if (s->at[k].album.seen > longest->album.seen) longest = s->at + k;
    return longest;
}

/* Picture i of all sequences, side by side. */
static int compose_picture(const vg_sheet *s, size_t i, vgi_canvas *c, unsigned char *rgb, vg_err *e)
{
    vgi_canvas_wipe(c);
    for (size_t k = 0; k < s->nsequences; k++) {
        int r = vgi_sheet_draw(s, s->at + k, i, rgb, e);
        if (r < 0) return r;
        size_t x = MARGIN + k * (s->o.width + MARGIN);
        vgi_canvas_paste(c, x, 0, rgb, s->o.width, s->o.height);
        if (s->nsequences > 1) {
            double width = (double)s->o.width;
            vgi_text(c, (double)x + width / 2, (double)s->o.height + 18, &(vgi_lettering){ink, caption_size, 0.5, width}, s->at[k].label);
        }
    }
    return vgi_font_check(c->font, e);
}

typedef struct movie { /* `threads` pictures are drawn at a time */
    const vg_sheet *s;
    size_t first;
    vgi_canvas *canvas;
    unsigned char **rgb;
    vg_err *err;
} movie;

static void compose_task(void *context, size_t i)
{
    movie *m = context;
    m->err[i].code = compose_picture(m->s, m->first + i, m->canvas + i, m->rgb[i], m->err + i);
}

static int encode_pictures(movie *m, vgi_webp *webp, size_t threads, vg_err *e)
{
    const vg_sheet *s = m->s;
    const vgi_row *longest = longest_of(s);
    for (m->first = 0; m->first < s->n; m->first += threads) {
        size_t n = s->n - m->first < threads ? s->n - m->first : threads;
        vgi_parallel((int)threads, n, compose_task, m);
        for (size_t i = 0; i < n; i++) {
            if (m->err[i].code < 0 && e) *e = m->err[i];
            if (m->err[i].code < 0) return m->err[i].code;
            int r = vgi_webp_add(webp, m->canvas[i].rgb, time_of(s, longest, m->first + i), e);
            if (r < 0) return r;
        }
    }
    return VG_OK;
}

int vgi_movie_write(const vg_sheet *s, int fd, const char *name, vg_err *e)
{
    size_t threads = (size_t)s->o.threads, w = s->nsequences * (s->o.width + MARGIN) + MARGIN;
    size_t h = s->o.height + (s->nsequences > 1 ? CAPTION : 0);
    movie m = {.s = s, .canvas = vgi_array(threads, sizeof *m.canvas, e), .rgb = vgi_array(threads, sizeof *m.rgb, e),
               .err = vgi_array(threads, sizeof *m.err, e)};
    vgi_webp *webp = NULL;
    vg_bytes file = {0};
    int r = m.canvas && m.rgb && m.err ? vgi_webp_open(&webp, w, h, e) : VG_ENOMEM;
    for (size_t i = 0; i < threads && r == VG_OK; i++) {
        r = vgi_canvas_init(m.canvas + i, w, h, e);
        if (r == VG_OK && !(m.rgb[i] = vgi_array_raw(s->o.width * s->o.height, 3, e))) r = VG_ENOMEM;
    }
    if (r == VG_OK) r = encode_pictures(&m, webp, threads, e);
    int last = r == VG_OK ? time_of(s, longest_of(s), s->n - 1) : 0;
    if (r == VG_OK) r = vgi_webp_end(webp, s->n > 1 ? last + last / (int)(s->n - 1) : 1000, &file, e);
    if (r == VG_OK) r = vgi_write_all(fd, file.data, file.size, name, e);
    for (size_t i = 0; i < threads && m.canvas && m.rgb; i++) vgi_canvas_clear(m.canvas + i), free(m.rgb[i]);
    free(m.canvas);
    free(m.rgb);
    free(m.err);
    vgi_webp_close(&webp);
    vg_bytes_clear(&file);
    return r;
}
