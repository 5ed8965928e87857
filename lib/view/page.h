/* page.h: shared by the files of the page: packing of numbers into text, JSON, and the texts of the page.
 * Internal; the public interface is vg_page in vg.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PAGE_H
#define VG_PAGE_H

#include "core/core.h"

/* ---- page_data.c ----
 *
 * A chunk holds n frames of nv x width numbers. Each axis of a chunk has an origin and a step: a number is origin +
 * step * q, where q is a 16-bit integer. Frame by frame, axis by axis, vertex by vertex, q is predicted and the
 * residual (modulo 2^16, then zigzag: 0 -1 1 -2 2 ... as 0 1 2 3 4 ...) is stored. The predictor is chosen per frame;
 * its number is a sum of: 0 none; 1 the previous frame; 2 the previous frame plus the step that led to it (within the
 * chunk); 4: the residual is itself predicted by that of the previous vertex (of the same axis; 0 for the first).
 *
 * Bytes: n predictor numbers, all upper bytes, all lower bytes; deflated with a zlib header. Lists of 32-bit
 * numbers are four such planes, the uppermost first. In the page both are base64. */

enum { VGI_PREDICT_FRAME = 1, VGI_PREDICT_MOTION = 2, VGI_PREDICT_NEIGHBOUR = 4 };

typedef struct vgi_track { /* frames waiting to become a chunk */
    size_t nv, width, n, cap;
    double *values;      /* cap frames of nv * width, as received */
    uint16_t *q;         /* the same, quantised, axis by axis */
    unsigned char *left; /* residuals: cap + 2 * cap * nv * width */
} vgi_track;

typedef struct vgi_chunk {
    size_t n;
    double origin[3], step[3];
    double loss; /* the largest distance of an element from its quantised position */
    vg_bytes packed;
} vgi_chunk;

int vgi_track_init(vgi_track *t, size_t nv, size_t width, vg_err *e) VG_MUST_CHECK;
void vgi_track_clear(vgi_track *t);
/* vgi_track_next: where to store the numbers of the next frame. n must be less than cap. */
double *vgi_track_next(vgi_track *t);
/* vgi_track_pack: pack all frames into c and empty the track. c->packed is overwritten; the caller clears it at
 * the end. */
int vgi_track_pack(vgi_track *t, vgi_chunk *c, vg_err *e) VG_MUST_CHECK;
/* vgi_pack_list: pack n 32-bit numbers; `differences`: each minus the one before it (modulo 2^32). */
int vgi_pack_list(vg_bytes *packed, const uint32_t *list, size_t n, bool differences, vg_err *e) VG_MUST_CHECK;
/* vgi_base64: append n bytes as text; n must be a multiple of 3 except at the end. */
int vgi_base64(vg_bytes *text, const unsigned char *data, size_t n, vg_err *e) VG_MUST_CHECK;

/* ---- page_json.c: text appended to b. In text that is not UTF-8, bytes beyond ASCII become '?'. ---- */

int vgi_page_escape(vg_bytes *b, const char *text, vg_err *e) VG_MUST_CHECK; /* for HTML, also between quotes */
/* JSON for a script element: contains no '<', so that nothing ends the element. */
int vgi_page_raw(vg_bytes *b, const char *text, vg_err *e) VG_MUST_CHECK; /* unchanged */
int vgi_page_string(vg_bytes *b, const char *text, vg_err *e) VG_MUST_CHECK;
int vgi_page_number(vg_bytes *b, double x, vg_err *e) VG_MUST_CHECK; /* all digits; null if not finite */
int vgi_page_short(vg_bytes *b, double x, vg_err *e) VG_MUST_CHECK;  /* rounded to binary32 */
/* The next field of an object: its name alone, or name and value. */
int vgi_page_field(vg_bytes *b, const char *name, vg_err *e) VG_MUST_CHECK;
int vgi_page_field_text(vg_bytes *b, const char *name, const char *text, vg_err *e) VG_MUST_CHECK;
int vgi_page_field_number(vg_bytes *b, const char *name, double x, vg_err *e) VG_MUST_CHECK;
int vgi_page_field_flag(vg_bytes *b, const char *name, bool x, vg_err *e) VG_MUST_CHECK;
/* open_list: a list that vgi_page_next began, without its closing bracket; may be empty. */
int vgi_page_field_list(vg_bytes *b, const char *name, const vg_bytes *open_list, vg_err *e) VG_MUST_CHECK;
int vgi_page_next(vg_bytes *list, vg_err *e) VG_MUST_CHECK;

/* ---- hull.c: extent of a sequence, for the camera ---- */

enum { VGI_HULL = 26 };
typedef struct vgi_hull { /* the outermost points in 26 directions over all frames so far */
    size_t n;             /* VGI_HULL, or 0 without points */
    double reach[VGI_HULL], at[VGI_HULL][3];
} vgi_hull;
/* vgi_hull_add: add the drawn vertices of a frame (nv points), relative to `centre`. */
void vgi_hull_add(vgi_hull *h, const double *points, const bool *drawn, size_t nv, const double centre[3]);

/* ---- page_text.c, made by the Makefile from page.html, page.css and page_*.js; each ends with a 0 ---- */

extern const char vgi_page_html[], vgi_page_css[], vgi_page_js[];
extern const char vgi_pairs_css[], vgi_pairs_js[];
extern const char vgi_signal_html[], vgi_signal_css[], vgi_signal_js[];

/* ---- page.c ---- */

/* vgi_page_list: write n 32-bit numbers as list `what` of sequence i. */
int vgi_page_list(vg_page *p, size_t i, const char *what, const uint32_t *list, size_t n, bool differences,
                  vg_err *e) VG_MUST_CHECK;
int vgi_page_field_numbers(vg_bytes *b, const char *name, const double *x, size_t n, vg_err *e) VG_MUST_CHECK;

/* ---- page_skin.c: the materials of a body that has an asset ----
 *
 * Lists "materials": per face the number of its material, from 1 on, or 0 for none; "coordinates": per corner u and v
 * as binary32. In the facts: "materials", each with name, colour, cutoff and the number of its picture; and
 * "pictures". */

int vgi_page_skin_lists(vg_page *p, size_t i, const vg_body *b, vg_err *e) VG_MUST_CHECK;
int vgi_page_skin_facts(vg_bytes *b, const vg_body *body, vg_err *e) VG_MUST_CHECK;

/* ---- signal_page.c: the data of a signal in a page ----
 *
 * Lists of 32-bit words: "mean" (d binary64 numbers, the lower word first), "coordinate" (n x m of them), "basis":
 * for each of the d numbers of a shape its m numbers of the basis, as binary32, or as two int16 per word if the
 * signal stores 16 bits. Everything else is in the facts. */

int vgi_signal_page_lists(vg_page *p, const vg_signal *s, vg_err *e) VG_MUST_CHECK;
int vgi_signal_page_facts(vg_bytes *b, const vg_signal *s, vg_err *e) VG_MUST_CHECK;

#endif
