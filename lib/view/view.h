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
    bool *drawn;            /* nv: vertices that are seen: those in a face, or all when there is no face */
    size_t max_corners;
} vgi_figure;

int vgi_figure_init(vgi_figure *g, const vg_mesh *m, vg_err *e) VG_MUST_CHECK;
void vgi_figure_clear(vgi_figure *g);

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

enum { VGI_EMPTY, VGI_FRONT, VGI_BACK, VGI_WIRE };

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
    const uint32_t *patches; /* per face, or NULL: samples get the number of their face's patch (modulo 2^16) for a value */
    float wire;          /* radius of 2-vertex faces, in samples */
    float edge;          /* half the width of a drawn edge, in samples; 0: edges are not marked */
} vgi_drawing;

int vgi_raster_init(vgi_raster *r, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
void vgi_raster_clear(vgi_raster *r);
/* edges: bit i marks the side opposite corner i as an edge of the face. */
void vgi_raster_triangle(vgi_raster *r, const vgi_corner *const corner[3], unsigned edges, float edge_width);
void vgi_raster_wire(vgi_raster *r, const vgi_corner *a, const vgi_corner *b, float radius);
int vgi_draw(vgi_raster *r, const vgi_drawing *d, vg_err *e) VG_MUST_CHECK;

/* ---- colour.c ---- */

enum { VGI_MAP_STEPS = 1024, VGI_GAMMA_STEPS = 4096 };
typedef struct vgi_palette {
    float map[VGI_MAP_STEPS][3];                 /* the error colours, lowest first, linear */
    unsigned char encode[VGI_GAMMA_STEPS + 1];   /* linear to sRGB */
} vgi_palette;
void vgi_palette_init(vgi_palette *p);
void vgi_map_colour(double t, float linear[3]);  /* t in [0, 1] */
float vgi_linear(unsigned char srgb);
static inline unsigned char vgi_encode(const vgi_palette *p, float linear)
{
    float x = linear < 0 ? 0 : linear > 1 ? 1 : linear;
    return p->encode[(int)(x * VGI_GAMMA_STEPS + 0.5f)];
}

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
/* vgi_ground_light: what a sample of the background at (x, y) of the camera, in D, is multiplied by; 1 = nothing
 * there. */
float vgi_ground_light(const vgi_ground *g, const vgi_camera *c, double x, double y, double pixel);

typedef struct vgi_look {
    const vgi_palette *palette;
    const vgi_ground *ground; /* or NULL */
    bool errors;              /* colours by value, else clay */
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

/* ---- album.c: which frames are shown ---- */

typedef struct vgi_shot {
    char *name;
    size_t index;   /* of the frame in the sequence */
    float *points;  /* nv */
    float *errors;  /* nv, in D; NULL without comparison */
    double mean, max;
} vgi_shot;

typedef struct vgi_album { /* at most 4 * want shots, `stride` frames apart, and the last frame */
    size_t nv, want, seen, stride, n, cap;
    bool compare;
    vgi_shot *at, last;
} vgi_album;

int vgi_album_init(vgi_album *a, size_t nv, size_t want, bool compare, vg_err *e) VG_MUST_CHECK;
void vgi_album_clear(vgi_album *a);
/* vgi_album_next: the shot to be filled with the next frame. It is found in place by vgi_album_close. */
int vgi_album_next(vgi_album *a, vgi_shot **shot, vg_err *e) VG_MUST_CHECK;
/* vgi_album_close: move the best `want` shots to the front; returns how many they are. */
size_t vgi_album_close(vgi_album *a);

/* ---- png.c: the one file that knows libpng ---- */

typedef struct vgi_png vgi_png;
/* vgi_png_open: an 8 bit RGB picture, written row by row to fd (borrowed); `name` is what messages call it. */
int vgi_png_open(vgi_png **p, int fd, const char *name, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
int vgi_png_rows(vgi_png *p, const unsigned char *rgb, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_png_end(vgi_png *p, vg_err *e) VG_MUST_CHECK;
void vgi_png_close(vgi_png **p);

#endif
