/* sheet.h: shared by sheet.c and movie.c: a sheet that collects frames, and the drawing of one of its pictures.
 * Internal; the public interface is vg_sheet in vg.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SHEET_H
#define VG_SHEET_H

#include "view/view.h"

enum { /* lengths in pixels */
    MARGIN = 16,      /* margin and gap between pictures, in pixels */
    CAPTION = 22,     /* below a picture */
    NUMBERS = 18,     /* below the caption, if frames have numbers */
    TITLE = 24,       /* above each row, if there are several sequences */
    FOOTER = 24,      /* at the bottom, with a ground */
    TEXT_BYTES = 512,
    LEAST_SIDE = 16, MOST_SIDE = 4096,
    WIDE_SIDE = 1536, /* pictures larger than this have 2 x 2 samples per pixel instead of 3 x 3 */
    MOST_COLUMNS = 8, /* default with several sequences */
};

typedef struct vgi_row {
    const char *label;
    const vg_head *head;
    vgi_figure figure;
    vgi_album album;
    vgi_meter meter;
    double origin[3], unit;      /* points are stored as (p - origin) / unit: D, or that of the first sequence */
    double diagonal;             /* D; 0 if all points coincide; unit is then 1 */
    double ground_height;        /* in D, along the vertical */
    bool tinted;
    uint32_t *look;              /* nlook vertices whose mean is in the middle; NULL: none chosen */
    size_t nlook;
    size_t *shot;                /* index into the album for column i */
} vgi_row;

struct vg_sheet {
    vg_sheet_options o;
    size_t nsequences;
    vgi_row at[VG_SHEET_SEQUENCES];
    vgi_tint tint;
    bool tinted;                 /* at least one sequence has numbers */
    vgi_palette palette;
    size_t n, columns, oversampling; /* number of frames shown */
    vgi_camera camera;
    const vgi_row *largest_of, *least_of; /* the largest and the least number, and their sequences */
    const vgi_shot *largest, *least;
};

static inline const vgi_shot *shot_of(const vgi_row *q, size_t i)
{
    return q->album.at + q->shot[i];
}

/* vgi_sheet_draw: picture i of a sequence, o.width x o.height pixels, RGB. */
int vgi_sheet_draw(const vg_sheet *s, const vgi_row *q, size_t i, unsigned char *rgb, vg_err *e) VG_MUST_CHECK;
void vgi_canvas_paste(vgi_canvas *c, size_t x, size_t y, const unsigned char *rgb, size_t w, size_t h);

/* vgi_movie_write: the pictures of all sequences one after another, as an animated WebP. */
int vgi_movie_write(const vg_sheet *s, int fd, const char *name, vg_err *e) VG_MUST_CHECK;

#endif
