/* vg/view.h: pictures: contact sheets and pages.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_VIEW_H
#define VG_PART_VIEW_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the colours of a picture say. A sequence for which they say nothing has those of its patches,
 * or is of clay. */
typedef enum vg_tint {
    VG_TINT_SCALARS = 0, /* the scalars that frames bring; nothing, when the first of a sequence brings none */
    VG_TINT_ERRORS,      /* the distance of a vertex from its place in a truth, in D */
    VG_TINT_SCALES,      /* how much longer the vectors of a vertex are than in the reference pose: their geometric
                            mean */
    VG_TINT_PLAIN        /* nothing, not even patches */
} vg_tint;

/* What a picture has to hold. */
typedef enum vg_fit {
    VG_FIT_AUTO = 0,
    VG_FIT_PATH,  /* all that is shown: the camera stays where it is */
    VG_FIT_FIGURE /* the figure: its centroid stays in the middle */
} vg_fit;

/* A contact sheet: evenly spaced frames of a sequence side by side, drawn without display or GPU, as PNG; of several
 * sequences the same frames below one another. */
typedef struct vg_sheet vg_sheet;
typedef struct vg_sheet_options {
    size_t frames;        /* how many are shown, at most: >= 1 */
    size_t columns;       /* 0: as many as make the sheet about 16 : 9, or of several sequences up to 8 */
    size_t width, height; /* of the picture of one frame, in pixels: 16 .. 4096 */
    double azimuth, elevation; /* of the viewer, in degrees: 0, 0 is before the front, 90, 0 at +x, 0, 90 above */
    double zoom;          /* 1 or 0: all that is shown fits */
    bool z_up;            /* z is up and the front at -y; else y is up and the front at +z */
    vg_fit fit;           /* VG_FIT_AUTO is VG_FIT_PATH */
    bool edges, ground;   /* draw edges of polygons; a grid where the reference stands, with the figure's shadow */
    bool silhouettes;     /* draw the contours of surfaces as lines */
    vg_tint tint;
    bool centred;         /* of errors the shift of the centroid is no part */
    double scale;         /* the end of the colours: in D, in the unit of the scalars, or a factor > 1; 0: the 99th
                             percentile of what is shown, rounded up */
    int threads;
} vg_sheet_options;
enum { VG_SHEET_SEQUENCES = 8 };

int vg_sheet_new(vg_sheet **s, const vg_sheet_options *o, vg_err *e) VG_MUST_CHECK;
void vg_sheet_free(vg_sheet **s);
/* vg_sheet_sequence: the next sequence, of vertices; all come before the first frame. h is borrowed until free. truth
 * (may be NULL): what its frames are compared with; its reference, and not h's, gives D,
 * place and the height of the ground. */
int vg_sheet_sequence(vg_sheet *s, const char *label, const vg_head *h, const vg_head *truth,
                      vg_err *e) VG_MUST_CHECK;
/* vg_sheet_add: the next frame of sequence number i (copied). truth (nv points): what it is compared with; NULL
 * unless the sequence is. Keeps at most 4 * frames + 2 poses of a sequence in binary32, whatever the length, at a
 * stride that is 1 as long as they fit and at most half the spacing of what is shown: the spacing is even to within
 * half a stride at each end. */
int vg_sheet_add(vg_sheet *s, size_t i, const vg_frame *f, const double *truth, vg_err *e) VG_MUST_CHECK;
/* vg_sheet_write: draw what was added and write it to fd (borrowed); `name` is what messages call it. Once. VG_EINPUT
 * when nothing was added, VG_EARG when the sheet would be larger than a PNG can be. A sequence that is shorter stays
 * at its last frame. */
int vg_sheet_write(vg_sheet *s, int fd, const char *name, vg_err *e) VG_MUST_CHECK;

/* A page: one HTML file that plays sequences side by side in a browser, with all that it needs inside. Written as
 * frames come; memory holds 32 frames of each sequence, or as many as fit in 64 MiB, and the names of all. */
typedef struct vg_page vg_page;
typedef struct vg_page_options {
    const char *title;           /* UTF-8; borrowed until free, as are the labels */
    double azimuth, elevation;   /* of the viewer at first, as for a sheet; and so are: */
    double zoom;
    bool z_up, edges, ground;
    vg_fit fit;    /* VG_FIT_AUTO: VG_FIT_FIGURE where the figure goes so far that it would be small else */
    vg_tint tint;  /* VG_TINT_ERRORS: the second sequence is the truth */
    bool centred;
    double scale;  /* the end of the colours, as for a sheet, by all frames */
} vg_page_options;
enum { VG_PAGE_SEQUENCES = 8 };
typedef struct vg_page_facts {
    size_t frames;      /* of the longest sequence */
    uint64_t bytes;
    double loss;        /* the largest distance of a vertex from where the page has it, in D of its sequence */
    bool tinted;        /* the colours say something: */
    double scale;       /* where they end, in D, the unit of the scalars, or as a factor; and in that: */
    double mean, least, max;
} vg_page_facts;

/* vg_page_new: write the beginning to fd (borrowed); `name` is what messages call it. */
int vg_page_new(vg_page **p, int fd, const char *name, const vg_page_options *o, vg_err *e) VG_MUST_CHECK;
void vg_page_free(vg_page **p);
/* vg_page_sequence: the next sequence, of vertices; all come before the first frame. h is borrowed until free. */
int vg_page_sequence(vg_page *p, const char *label, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vg_page_add: the next frame of sequence number i. truth (nv points): what it is compared with, the second
 * sequence's frame; NULL: it is not. What has a truth, or scalars, in its first frame must have it in all. */
int vg_page_add(vg_page *p, size_t i, const vg_frame *f, const double *truth, vg_err *e) VG_MUST_CHECK;
/* vg_page_end: the rest. Without it the page says that it is not whole. VG_EINPUT when a sequence has no frames. */
int vg_page_end(vg_page *p, vg_page_facts *facts, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
