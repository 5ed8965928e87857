/* page.h: what the files of the page share: numbers packed into text, JSON, and the page's own texts.
 * Internal; the page a C program may ask for is vg_page in vg.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PAGE_H
#define VG_PAGE_H

#include "core/core.h"

/* ---- page_data.c ----
 *
 * A chunk holds n frames of nv x width numbers. Each axis of a chunk has an origin and a step: a number is origin +
 * step * q, q an integer of 16 bits. Frame by frame, axis by axis, vertex by vertex, q is predicted, and what is left
 * (modulo 2^16, then 0 -1 1 -2 2 ... as 0 1 2 3 4 ...) is kept. The prediction is chosen for each frame; its number
 * is a sum:
 *     0 nothing, 1 the frame before, 2 that and the step that led to it (all within the chunk),
 *     4: what is left is predicted by what was left of the vertex before (of the same axis; 0 for the first).
 * Bytes: n of predictions, then all upper bytes, then all lower bytes; deflated with a zlib head. Lists of 32 bit
 * numbers are four such planes, the uppermost first. In the page both are base64. */

enum { VGI_PREDICT_FRAME = 1, VGI_PREDICT_MOTION = 2, VGI_PREDICT_NEIGHBOUR = 4 };

typedef struct vgi_track { /* frames on their way into a chunk */
    size_t nv, width, n, cap;
    double *values;      /* cap frames of nv * width, as they came */
    uint16_t *q;         /* the same, axis by axis */
    unsigned char *left; /* cap + 2 * cap * nv * width */
} vgi_track;

typedef struct vgi_chunk {
    size_t n;
    double origin[3], step[3];
    double loss; /* the largest distance of an element from what is kept of it */
    vg_bytes packed;
} vgi_chunk;

int vgi_track_init(vgi_track *t, size_t nv, size_t width, vg_err *e) VG_MUST_CHECK;
void vgi_track_clear(vgi_track *t);
/* vgi_track_next: where the numbers of the next frame go. There must be room: n < cap. */
double *vgi_track_next(vgi_track *t);
/* vgi_track_pack: all frames into c, and none left. c->packed is overwritten; the caller clears it in the end. */
int vgi_track_pack(vgi_track *t, vgi_chunk *c, vg_err *e) VG_MUST_CHECK;
/* vgi_pack_list: n numbers of 32 bits, each less the one before it if `differences` (modulo 2^32). */
int vgi_pack_list(vg_bytes *packed, const uint32_t *list, size_t n, bool differences, vg_err *e) VG_MUST_CHECK;
/* vgi_base64: append n bytes as text; n is a multiple of 3 unless they are the last. */
int vgi_base64(vg_bytes *text, const unsigned char *data, size_t n, vg_err *e) VG_MUST_CHECK;

/* ---- page_json.c: text appended to b. What is no UTF-8 loses all that is not ASCII. ---- */

int vgi_page_escape(vg_bytes *b, const char *text, vg_err *e) VG_MUST_CHECK; /* for HTML, also between quotes */
/* JSON that may stand inside of a script element: no '<', so that nothing ends it. */
int vgi_page_raw(vg_bytes *b, const char *text, vg_err *e) VG_MUST_CHECK; /* as it is */
int vgi_page_string(vg_bytes *b, const char *text, vg_err *e) VG_MUST_CHECK;
int vgi_page_number(vg_bytes *b, double x, vg_err *e) VG_MUST_CHECK; /* all digits; null when it is not finite */
int vgi_page_short(vg_bytes *b, double x, vg_err *e) VG_MUST_CHECK;  /* as many digits as are worth being shown */
/* The next field of an object: its name alone, or with its value. */
int vgi_page_field(vg_bytes *b, const char *name, vg_err *e) VG_MUST_CHECK;
int vgi_page_field_text(vg_bytes *b, const char *name, const char *text, vg_err *e) VG_MUST_CHECK;
int vgi_page_field_number(vg_bytes *b, const char *name, double x, vg_err *e) VG_MUST_CHECK;
int vgi_page_field_flag(vg_bytes *b, const char *name, bool x, vg_err *e) VG_MUST_CHECK;
/* open_list: what vgi_page_next has begun, an element behind each; without elements it is empty. */
int vgi_page_field_list(vg_bytes *b, const char *name, const vg_bytes *open_list, vg_err *e) VG_MUST_CHECK;
int vgi_page_next(vg_bytes *list, vg_err *e) VG_MUST_CHECK;

/* ---- hull.c: what a camera has to show of a sequence ---- */

enum { VGI_HULL = 26 };
typedef struct vgi_hull { /* the outermost points in 26 directions, of all frames so far */
    size_t n;             /* VGI_HULL, or 0: there are none */
    double reach[VGI_HULL], at[VGI_HULL][3];
} vgi_hull;
/* vgi_hull_add: the drawn ones of nv points of a frame, relative to `centre`. */
void vgi_hull_add(vgi_hull *h, const double *points, const bool *drawn, size_t nv, const double centre[3]);

/* ---- page_text.c, made by the Makefile from page.html, page.css and the files page_*.js; each ends with a 0 ---- */

extern const char vgi_page_html[], vgi_page_css[], vgi_page_js[];

#endif
