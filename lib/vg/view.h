/* vg/view.h: pictures: contact sheets and pages.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_VIEW_H
#define VG_PART_VIEW_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the colours of a picture show. A sequence without such numbers has the colours of its patches, or looks
 * like clay. */
typedef enum vg_tint {
    VG_TINT_SCALARS = 0, /* the scalars of the frames; none if the first frame of a sequence has none */
    VG_TINT_ERRORS,      /* the distance of a vertex from its position in a truth, in D */
    VG_TINT_SCALES,      /* the length of a vertex's vectors relative to the reference pose: their geometric mean */
    VG_TINT_PLAIN        /* nothing, not even patches */
} vg_tint;

/* What must fit into a picture. */
typedef enum vg_fit {
    VG_FIT_AUTO = 0,
    VG_FIT_PATH,  /* everything that is shown: the camera does not move */
    VG_FIT_FIGURE /* the figure: its centroid stays in the middle */
} vg_fit;

/* A contact sheet: evenly spaced frames of a sequence side by side, rendered without display or GPU, as PNG; with
 * several sequences the same frames in rows below one another. */
typedef struct vg_sheet vg_sheet;
typedef struct vg_sheet_options {
    size_t frames;        /* how many are shown, at most: >= 1 */
    bool animated;        /* one after another, as an animated WebP: several sequences stand side by side */
    double turn;          /* animated: degrees by which the viewer goes around the figure from first to last frame */
    size_t columns;       /* 0: automatic, about 16 : 9; with several sequences up to 8 */
    size_t width, height; /* of the picture of one frame, in pixels: 16 .. 4096 */
    double azimuth, elevation; /* of the viewer, in degrees: 0, 0 in front; 90, 0 at +x; 0, 90 above */
    double zoom;          /* 1 or 0: all that is shown fits */
    bool z_up;            /* z is up and the front at -y; else y is up and the front at +z */
    vg_fit fit;           /* VG_FIT_AUTO is VG_FIT_PATH */
    bool edges, ground;   /* draw edges of polygons; a grid where the reference stands, with the figure's shadow */
    bool silhouettes;     /* draw the contours of surfaces as lines */
    vg_tint tint;
    bool centred;         /* move centroids to 0 before measuring errors */
    double scale;         /* end of the colour map: in D, in the unit of the scalars, or a factor > 1; 0: the 99th
                             percentile of the numbers shown, rounded up */
    int threads;
} vg_sheet_options;
enum { VG_SHEET_SEQUENCES = 8 };

int vg_sheet_new(vg_sheet **s, const vg_sheet_options *o, vg_err *e) VG_MUST_CHECK;
void vg_sheet_free(vg_sheet **s);
/* vg_sheet_sequence: add a sequence of vertices; all sequences come before the first frame. h is borrowed until
 * free. truth (may be NULL): the sequence it is compared with, whose reference then gives D, position and ground
 * height. */
int vg_sheet_sequence(vg_sheet *s, const char *label, const vg_head *h, const vg_head *truth,
                      vg_err *e) VG_MUST_CHECK;
/* vg_sheet_add: add the next frame of sequence i (copied). truth (nv points): the pose it is compared with; NULL
 * if the sequence is not compared. At most 4 * frames + 2 poses per sequence are kept in binary32, at a stride of
 * 1 while they fit and at most half the spacing of the pictures otherwise, so the spacing is even to within half a
 * stride at each end. */
int vg_sheet_add(vg_sheet *s, size_t i, const vg_frame *f, const double *truth, vg_err *e) VG_MUST_CHECK;
/* vg_look_find: the vertices that `what` names: the number of a vertex; else the name of a joint of the skeleton that
 * the body is, or of a rig (the vertex nearest to it in the reference pose); else of an object, group or material (the
 * vertices of its faces). *n of them, at least one; free with free(). VG_EARG when nothing has that name. */
int vg_look_find(const vg_body *b, const char *what, uint32_t **vertices, size_t *n, vg_err *e) VG_MUST_CHECK;

/* vg_sheet_look_at: centre each picture of sequence i on the mean of these vertices (copied). Call it for all
 * sequences of a sheet or for none, before vg_sheet_write. */
int vg_sheet_look_at(vg_sheet *s, size_t i, const uint32_t *vertices, size_t n, vg_err *e) VG_MUST_CHECK;
/* vg_sheet_write: draw the sheet and write it to fd (borrowed); call it once. `name` is used in messages.
 * VG_EINPUT if there are no frames, VG_EARG if the sheet exceeds the limits of PNG. A shorter sequence stays at
 * its last frame. */
int vg_sheet_write(vg_sheet *s, int fd, const char *name, vg_err *e) VG_MUST_CHECK;

/* A picture of the signal of h: its curve through the pose plane, and some poses around it, as PNG. */
typedef struct vg_plane_options {
    double azimuth, elevation; /* of the poses' viewer, as for a sheet */
    bool z_up;
} vg_plane_options;
/* vg_plane_write: to fd (borrowed). `name` is used in messages. VG_EINPUT when there is no signal. */
int vg_plane_write(const vg_head *h, const vg_plane_options *o, int fd, const char *name, vg_err *e) VG_MUST_CHECK;

/* A page: one HTML file that plays sequences side by side in a browser and needs nothing else. It is written as
 * frames come; memory holds 32 frames of each sequence, or as many as fit in 64 MiB, and all names. */
typedef struct vg_page vg_page;
typedef struct vg_page_options {
    const char *title;           /* UTF-8; borrowed until free, as are the labels */
    double azimuth, elevation;   /* of the viewer at first, as for a sheet; and so are: */
    double zoom;
    bool z_up, edges, ground;
    vg_fit fit;    /* VG_FIT_AUTO: VG_FIT_FIGURE if the figure would be small otherwise */
    vg_tint tint;  /* VG_TINT_ERRORS: the second sequence is the truth */
    bool centred;
    double scale;  /* the end of the colours, as for a sheet, by all frames */
    bool signal;   /* edit the signal of the only sequence in its pose plane: its frames, sampled, say what the camera has
                      to show, and are not kept */
    bool pick;     /* pairs of vertices of two sequences are picked by clicks, in the first frame of each; others are dropped */
} vg_page_options;
enum { VG_PAGE_SEQUENCES = 8 };
typedef struct vg_page_stats {
    size_t frames;      /* of the longest sequence */
    uint64_t bytes;
    double loss;        /* the largest distance between a vertex and its position in the page, in D of its sequence */
    bool tinted;        /* the colours have a meaning: */
    double scale;       /* end of the colours in D, in the unit of the scalars, or as a factor; in the same unit: */
    double mean, least, max;
} vg_page_stats;

/* vg_page_new: write the first part of the page to fd (borrowed); `name` is used in messages. */
int vg_page_new(vg_page **p, int fd, const char *name, const vg_page_options *o, vg_err *e) VG_MUST_CHECK;
void vg_page_free(vg_page **p);
/* vg_page_sequence: add a sequence of vertices; all sequences come before the first frame. h is borrowed until
 * free. */
int vg_page_sequence(vg_page *p, const char *label, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vg_page_add: add the next frame of sequence i. truth (nv points): the frame of the second sequence it is
 * compared with, or NULL. If the first frame has a truth or scalars, all frames must. */
int vg_page_add(vg_page *p, size_t i, const vg_frame *f, const double *truth, vg_err *e) VG_MUST_CHECK;
/* vg_page_end: write the rest. A page without it says that it is incomplete. VG_EINPUT if a sequence has no
 * frames. */
int vg_page_end(vg_page *p, vg_page_stats *stats, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
