/* view.h: what the files of lib/view share: figure, camera, samples, colours, text, the frames that are shown, PNG.
 * Internal; the picture a C program may ask for is vg_sheet in vg.h.
 *
 * Units: points are kept in D from the first pose's middle, in binary32, which is enough for a picture. A camera
 * takes them to samples: x to the right, y down, z towards the viewer, all three in samples. `oversampling` samples
 * in each direction make a pixel. Colours are linear red, green, blue in [0, 1] until they become a pixel.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_VIEW_H
#define VG_VIEW_H

#include "core/core.h"

/* ---- figure.c: what a mesh looks like: its normals, its faces as triangles ---- */

typedef struct vgi_figure {
    const vg_mesh *mesh;    /* borrowed */
    uint32_t *ring_start;   /* nv + 1: the faces of 3 or more around a vertex are */
    uint32_t *ring;         /* ring[ring_start[v]] .. ring[ring_start[v + 1] - 1] */
    uint32_t *first;        /* nv: the first corner at a vertex, of a face of 3 or more */
    bool *drawn;            /* nv: vertices that are seen */
    size_t max_corners;
    size_t nsides;          /* made by vgi_figure_sides */
    struct vgi_side *side;  /* by their vertices */
} vgi_figure;

typedef struct vgi_side { /* of a face of 3 or more */
    uint32_t a, b; /* a < b */
    uint32_t face;
    bool forth;    /* the face goes from a to b */
} vgi_side;

/* vgi_figure_sides: the sides of all faces, those of one edge one after the other: to be called once, for
 * silhouettes. */
int vgi_figure_sides(vgi_figure *g, vg_err *e) VG_MUST_CHECK;
int vgi_figure_init(vgi_figure *g, const vg_mesh *m, vg_err *e) VG_MUST_CHECK;
void vgi_figure_clear(vgi_figure *g);

/* vgi_drawn_vertices: which of nv are seen: those in a face, or all when there is no face; free(). */
bool *vgi_drawn_vertices(const vg_mesh *m, vg_err *e);
/* vgi_ground_height: of the lowest of them, along the vertical; 0: there are none. */
double vgi_ground_height(const bool *drawn, size_t nv, const double *points, bool z_up);

/* vgi_figure_normals: a unit normal per corner: the mean of the faces around the vertex, by area, that turn less
 * than the crease angle from the corner's own face. points: nv, any unit. face: 3 * nf work; normals: 3 * corners
 * out. */
void vgi_figure_normals(const vgi_figure *g, const float *points, float *face, float *normals);

/* vgi_ear_clip: cut a polygon of n >= 3 corners in the plane (xy: n pairs, counter-clockwise when area > 0, else
 * clockwise) into n - 2 triangles, which may be concave but not cross itself (then: some triangulation). work: 3 * n;
 * triangles: 3 * (n - 2) positions out. O(n * reflex corners). */
void vgi_ear_clip(const double *xy, size_t n, size_t *work, size_t *triangles);

/* ---- camera.c ---- */

typedef struct vgi_camera {
    float right[3], up[3], toward[3]; /* orthonormal; rows of the rotation from the mesh to the eye */
    double scale;                     /* samples per D */
    double x, y;                      /* what is seen in the middle, along right and up, in D */
    double width, height;             /* of the picture, in samples */
} vgi_camera;

typedef struct vgi_box { /* of points seen by a camera, along right and up */
    double least[2], most[2];
} vgi_box;

void vgi_camera_turn(vgi_camera *c, double azimuth, double elevation, bool z_up);
vgi_box vgi_box_empty(void);
void vgi_camera_measure(const vgi_camera *c, const vgi_figure *g, const float *points, const double shift[2],
                        vgi_box *box);
/* vgi_camera_fit: place and scale so that the box fills the picture but for a margin, a share of its smaller side. */
void vgi_camera_fit(vgi_camera *c, const vgi_box *box, double margin);
/* vgi_camera_project: nv points to samples. */
void vgi_camera_project(const vgi_camera *c, const float *points, size_t nv, float *seen);

/* ---- raster.c: visibility ---- */

enum { VGI_EMPTY, VGI_FRONT, VGI_BACK, VGI_WIRE, VGI_CONTOUR };

typedef struct vgi_sample {
    float z;            /* towards the viewer; -INFINITY when empty */
    int16_t normal[3];  /* in the eye's directions (y up), 32767 = 1; about unit, towards the viewer */
    uint16_t value;     /* 65535 = the end of the colour map */
    uint8_t kind;       /* VGI_EMPTY ... */
    uint8_t edge;       /* 1: on an edge of its face */
} vgi_sample;

typedef struct vgi_raster {
    size_t w, h;
    vgi_sample *at;
} vgi_raster;

typedef struct vgi_corner {
    float x, y, z, normal[3], value;
} vgi_corner;

typedef struct vgi_drawing { /* one pose to be drawn */
    const vgi_figure *figure;
    const vgi_camera *camera;
    const float *points; /* nv, in D */
    const float *values; /* nv in [0, 1], or NULL */
    const uint32_t *patches; /* per face, or NULL: samples get the number of their face's patch (modulo 2^16) for a
                                value */
    float wire;          /* radius of 2-vertex faces, in samples */
    float edge;          /* half the width of a drawn edge, in samples; 0: edges are not marked */
    float contour;       /* half the width of silhouettes, in samples; 0: none. Needs vgi_figure_sides */
} vgi_drawing;

int vgi_raster_init(vgi_raster *r, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
void vgi_raster_clear(vgi_raster *r);
int vgi_draw(vgi_raster *r, const vgi_drawing *d, vg_err *e) VG_MUST_CHECK;

/* ---- colour.c ---- */

enum { VGI_MAP_STEPS = 1024, VGI_GAMMA_STEPS = 4096 };
typedef struct vgi_palette {
    float map[VGI_MAP_STEPS][3];                 /* the colours of numbers, lowest first, linear */
    unsigned char encode[VGI_GAMMA_STEPS + 1];   /* linear to sRGB */
} vgi_palette;
void vgi_palette_init(vgi_palette *p, bool diverging);
void vgi_map_colour(double t, bool diverging, float linear[3]);  /* t in [0, 1] */
float vgi_linear(unsigned char srgb);
static inline unsigned char vgi_encode(const vgi_palette *p, float linear)
{
    float x = linear < 0 ? 0 : linear > 1 ? 1 : linear;
    return p->encode[(int)(x * VGI_GAMMA_STEPS + 0.5f)];
}

/* ---- tint.c: the number of each vertex that becomes its colour ---- */

typedef struct vgi_tint { /* of all that is on a sheet or page */
    vg_tint what;
    bool centred;
    char *name, *unit; /* of scalars; NULL: no frame has brought any */
    bool diverging;    /* the colours have a middle: 0, or for scales 1 */
    double low, high;  /* where they end; of scales the logarithms to base 2, as all their numbers */
    double shown_low, shown_high; /* the part of that which occurs: a legend shows no more */
} vgi_tint;

typedef struct vgi_meter { /* of one sequence */
    const vg_mesh *mesh;
    double unit;      /* what errors are divided by */
    double *numbers;  /* nv: of the last frame */
    double *lengths, *now; /* scales: of the vector of each corner in the reference and the present pose */
    uint32_t *count;  /* nv: corners that have a length in the reference */
} vgi_meter;

typedef struct vgi_spread {
    double mean, least, most;
} vgi_spread;

int vgi_meter_init(vgi_meter *m, const vgi_tint *t, const vg_mesh *mesh, const double *reference, double unit,
                   vg_err *e) VG_MUST_CHECK;
void vgi_meter_clear(vgi_meter *m);
/* vgi_tint_has: is there a number for each vertex of this frame? */
bool vgi_tint_has(const vgi_tint *t, const vg_frame *f, const double *truth);
/* vgi_tint_read: the numbers of a frame that has them, into m->numbers.
 * VG_EINPUT when they have another name than those before. */
int vgi_tint_read(vgi_tint *t, vgi_meter *m, const vg_frame *f, const double *truth, vgi_spread *s,
                  vg_err *e) VG_MUST_CHECK;
/* vgi_round_up: the next of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten: five parts of it have short
 * numbers. x > 0. */
double vgi_round_up(double x);
/* vgi_tint_end: choose the ends of the colours: given (> 0), or from `common`, the absolute value that 99 % of the
 * numbers do not exceed. least, most: of all numbers. */
void vgi_tint_end(vgi_tint *t, double given, double common, double least, double most);
double vgi_tint_place(const vgi_tint *t, double x); /* 0 to 1 */
double vgi_tint_shown(const vgi_tint *t, double x); /* a number as people read it: of scales the factor */
void vgi_tint_clear(vgi_tint *t);
enum { VGI_NUMBER = 32 };
/* Words for them, whatever the locale. */
void vgi_print_number(char *to, size_t size, const char *format, double x);
void vgi_tint_number(const vgi_tint *t, double x, char to[VGI_NUMBER]);
void vgi_tint_caption(const vgi_tint *t, const vgi_spread *s, char *to, size_t size);
/* diagonal: D, where errors are in D */
void vgi_tint_title(const vgi_tint *t, double diagonal, char *to, size_t size);

/* ---- shade.c and ground.c: from samples to pixels ---- */

typedef struct vgi_ground { /* a grid on the plane where the reference pose stands, and the figure's shadow on it */
    double height;   /* along the vertical of the world, in D */
    double spacing;  /* of the grid, in D */
    double vertical[3], across[3], along[3]; /* of the world, in the mesh's axes */
    double middle[2], reach; /* where the grid fades out, along across and along, in D */
    size_t n;        /* shadow: n x n, NULL when there is none */
    float *shadow, origin[2], step;
} vgi_ground;
int vgi_ground_shadow(vgi_ground *g, const vgi_drawing *d, vg_err *e) VG_MUST_CHECK;
/* vgi_ground_light: what a sample of the background at (x, y) of the camera, in D, is multiplied by;
 * 1 = nothing there. */
float vgi_ground_light(const vgi_ground *g, const vgi_camera *c, double x, double y, double pixel);

typedef struct vgi_look {
    const vgi_palette *palette;
    const vgi_ground *ground; /* or NULL */
    bool numbers;             /* colours by value, else clay */
    bool patches;             /* ... or value is the number of a patch */
    size_t oversampling;
    float edge_strength;      /* 0 to 1 */
    float outline;            /* a step in depth that is drawn as an outline, in samples */
    float reach;              /* how far one surface shades another, in samples */
} vgi_look;
/* vgi_shade: w x h pixels (RGB) of a raster that is `oversampling` times larger each way. */
int vgi_shade(const vgi_look *l, const vgi_raster *r, const vgi_camera *c, unsigned char *rgb,
              vg_err *e) VG_MUST_CHECK;

/* ---- text.c ---- */

typedef struct vgi_canvas {
    size_t w, h;
    unsigned char *rgb;
} vgi_canvas;
enum { VGI_TEXT_ADVANCE = 6, VGI_TEXT_HEIGHT = 7 }; /* in dots */
/* vgi_text: draw UTF-8 text, dots `dot` pixels apart, with its left top at (x, y); what is not ASCII becomes a box.
 */
void vgi_text(vgi_canvas *c, double x, double y, double dot, const unsigned char colour[3], const char *text);
double vgi_text_width(double dot, const char *text);
/* vgi_text_fit: copy text, with ".." in place of its middle when it is wider than `width` pixels. size >= 4. */
void vgi_text_fit(char *to, size_t size, double dot, double width, const char *text);

/* ---- legend.c: on a canvas of at least VGI_LEGEND rows ---- */

enum { VGI_LEGEND = 74 };
void vgi_legend(vgi_canvas *c, const vgi_tint *t, const vgi_palette *p, size_t margin, const char *title,
                const char *note);

/* ---- album.c: which frames are shown ---- */

typedef struct vgi_shot {
    char *name;
    size_t index;   /* of the frame in the sequence */
    float *points;  /* nv */
    float *numbers; /* nv: what is coloured; its contents do not count unless has_numbers */
    bool has_numbers;
    vgi_spread spread;
} vgi_shot;

typedef struct vgi_album { /* at most 4 * want shots, `stride` frames apart, and the last frame */
    size_t nv, want, seen, stride, n, cap;
    vgi_shot *at, last;
} vgi_album;

int vgi_album_init(vgi_album *a, size_t nv, size_t want, vg_err *e) VG_MUST_CHECK;
void vgi_album_clear(vgi_album *a);
/* vgi_album_next: the shot to be filled with the next frame. It is found in place by vgi_album_close. */
int vgi_album_next(vgi_album *a, vgi_shot **shot, vg_err *e) VG_MUST_CHECK;
/* vgi_album_close: move the best `want` shots to the front; returns how many they are. */
size_t vgi_album_close(vgi_album *a);
/* vgi_album_match: instead of that: which shots are nearest to n frames, ascending; behind the end it is the last. */
void vgi_album_match(vgi_album *a, const size_t *frames, size_t n, size_t *shots);

/* ---- png.c: the one file that knows libpng ---- */

typedef struct vgi_png vgi_png;
/* vgi_png_open: an 8 bit RGB picture, written row by row to fd (borrowed); `name` is what messages call it. */
int vgi_png_open(vgi_png **p, int fd, const char *name, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
int vgi_png_rows(vgi_png *p, const unsigned char *rgb, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_png_end(vgi_png *p, vg_err *e) VG_MUST_CHECK;
void vgi_png_close(vgi_png **p);

#endif
