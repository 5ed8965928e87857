/* view.h: shared by the files of lib/view: figure, camera, samples, colours, text, shots, PNG. Internal; the public
 * interface is vg_sheet in vg.h.
 *
 * Units: points are in D, relative to the middle of the first pose, in binary32. A camera maps them to samples: x
 * to the right, y down, z towards the viewer, all in samples. A pixel has `oversampling` x `oversampling` samples.
 * Colours are linear red, green, blue in [0, 1] until they become pixels.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_VIEW_H
#define VG_VIEW_H

#include "core/core.h"

/* The lesser and the greater of two numbers, b when one is NaN. Unlike fminf and fmaxf these are no calls. */
static inline float vgi_least(float a, float b)
{
    return a < b ? a : b;
}

static inline float vgi_most(float a, float b)
{
    return a > b ? a : b;
}

/* ---- figure.c: the drawable form of a mesh ---- */

typedef struct vgi_figure {
    const vg_mesh *mesh;    /* borrowed */
    uint32_t *ring_start;   /* nv + 1: the faces (of 3 corners or more) around vertex v are */
    uint32_t *ring;         /* ring[ring_start[v]] .. ring[ring_start[v + 1] - 1] */
    uint32_t *first;        /* nv: the first corner at a vertex, among faces of 3 corners or more */
    bool *drawn;            /* nv: vertices that are visible */
    size_t max_corners;
    size_t nsides;          /* made by vgi_figure_sides */
    struct vgi_side *side;  /* sorted by their vertices */
} vgi_figure;

typedef struct vgi_side { /* a side of a face of 3 corners or more */
    uint32_t a, b; /* a < b */
    uint32_t face;
    bool forth;    /* the face runs from a to b */
} vgi_side;

/* vgi_figure_sides: list the sides of all faces, those of one edge together. Call it once; silhouettes need it. */
int vgi_figure_sides(vgi_figure *g, vg_err *e) VG_MUST_CHECK;
int vgi_figure_init(vgi_figure *g, const vg_mesh *m, vg_err *e) VG_MUST_CHECK;
void vgi_figure_clear(vgi_figure *g);

/* vgi_drawn_vertices: which of the nv vertices are visible: those in a face, or all if there are no faces. Release
 * with free(). */
bool *vgi_drawn_vertices(const vg_mesh *m, vg_err *e);
/* vgi_ground_height: the lowest visible vertex along the vertical; 0 if there is none. */
double vgi_ground_height(const bool *drawn, size_t nv, const double *points, bool z_up);

/* vgi_figure_normals: a unit normal per corner: the area-weighted mean over the faces around the vertex that differ
 * from the corner's own face by less than the crease angle. points: nv, any unit; face: workspace of 3 * nf; normals:
 * 3 * corners, out. */
void vgi_figure_normals(const vgi_figure *g, const float *points, float *face, float *normals);

/* vgi_ear_clip: triangulate a polygon of n >= 3 corners in the plane (xy: n pairs; counter-clockwise if its area >
 * 0). It may be concave; if it crosses itself, the result is some triangulation. work: workspace of 3 * n; triangles:
 * 3 * (n - 2) positions, out. O(n * reflex corners). */
void vgi_ear_clip(const double *xy, size_t n, size_t *work, size_t *triangles);

/* ---- camera.c ---- */

typedef struct vgi_camera {
    float right[3], up[3], toward[3]; /* orthonormal; rows of the rotation from the mesh to the eye */
    double scale;                     /* samples per D */
    double x, y;                      /* the centre of the picture along right and up, in D */
    double width, height;             /* of the picture, in samples */
} vgi_camera;

typedef struct vgi_box { /* bounds of points along right and up of a camera */
    double least[2], most[2];
} vgi_box;

void vgi_camera_turn(vgi_camera *c, double azimuth, double elevation, bool z_up);
vgi_box vgi_box_empty(void);
void vgi_camera_measure(const vgi_camera *c, const vgi_figure *g, const float *points, const double shift[2],
                        vgi_box *box);
/* vgi_camera_fit: place and scale so that the box fills the picture except for a margin, given as a share of its
 * smaller side. */
void vgi_camera_fit(vgi_camera *c, const vgi_box *box, double margin);
/* vgi_camera_project: project nv points to samples. */
void vgi_camera_project(const vgi_camera *c, const float *points, size_t nv, float *seen);

/* ---- raster.c: visibility ---- */

enum { VGI_EMPTY, VGI_FRONT, VGI_BACK, VGI_WIRE, VGI_CONTOUR };

typedef struct vgi_sample {
    float z;            /* towards the viewer; -INFINITY when empty */
    int16_t normal[3];  /* in the eye's directions (y up), 32767 = 1; about unit length, towards the viewer */
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

typedef struct vgi_drawing { /* one pose to draw */
    const vgi_figure *figure;
    const vgi_camera *camera;
    const float *points; /* nv, in D */
    const float *values; /* nv in [0, 1], or NULL */
    const uint32_t *patches; /* per face, or NULL: a sample's value is then the patch number of its face (modulo
                                2^16) */
    float wire;          /* radius of 2-vertex faces, in samples */
    float edge;          /* half the width of drawn edges, in samples; 0: not drawn */
    float contour;       /* half the width of silhouettes, in samples; 0: none. Needs vgi_figure_sides */
} vgi_drawing;

int vgi_raster_init(vgi_raster *r, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
void vgi_raster_clear(vgi_raster *r);
int vgi_draw(vgi_raster *r, const vgi_drawing *d, vg_err *e) VG_MUST_CHECK;

/* ---- colour.c ---- */

enum { VGI_MAP_STEPS = 1024, VGI_GAMMA_STEPS = 4096 };
typedef struct vgi_palette {
    float map[VGI_MAP_STEPS][3];                 /* the colour map from its lowest end, linear */
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

/* ---- tint.c: the number of each vertex that is mapped to a colour ---- */

typedef struct vgi_tint { /* for everything on a sheet or page */
    vg_tint what;
    bool centred;
    char *name, *unit; /* of scalars; NULL until a frame has any */
    bool diverging;    /* the map has a middle: 0, or 1 for scales */
    double low, high;  /* the ends of the map; for scales log2, like all their numbers */
    double shown_low, shown_high; /* the part of it that occurs, which the legend shows */
} vgi_tint;

typedef struct vgi_meter { /* of one sequence */
    const vg_mesh *mesh;
    double unit;      /* unit by which errors are divided */
    double *numbers;  /* nv: of the latest frame */
    double *lengths, *now; /* scales: lengths of the corners' vectors in the reference and the current pose */
    uint32_t *count;  /* nv: corners whose reference vector is not zero */
} vgi_meter;

typedef struct vgi_spread {
    double mean, least, most;
} vgi_spread;

int vgi_meter_init(vgi_meter *m, const vgi_tint *t, const vg_mesh *mesh, const double *reference, double unit,
                   vg_err *e) VG_MUST_CHECK;
void vgi_meter_clear(vgi_meter *m);
/* vgi_tint_has: whether this frame has a number for each vertex. */
bool vgi_tint_has(const vgi_tint *t, const vg_frame *f, const double *truth);
/* vgi_tint_read: store the numbers of a frame that has them in m->numbers. VG_EINPUT if their name differs from that
 * of earlier frames. */
int vgi_tint_read(vgi_tint *t, vgi_meter *m, const vg_frame *f, const double *truth, vgi_spread *s,
                  vg_err *e) VG_MUST_CHECK;
/* vgi_round_up: x > 0 rounded up to 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6 or 8 times a power of ten, whose fifths have
 * short decimals. */
double vgi_round_up(double x);
/* vgi_tint_end: choose the ends of the colours: given (> 0), or from `common`, the absolute value that 99 % of the
 * numbers do not exceed. least, most: of all numbers. */
void vgi_tint_end(vgi_tint *t, double given, double common, double least, double most);
double vgi_tint_place(const vgi_tint *t, double x); /* 0 to 1 */
double vgi_tint_shown(const vgi_tint *t, double x); /* a number in the form shown to people: a factor, for scales */
void vgi_tint_clear(vgi_tint *t);
enum { VGI_NUMBER = 32 };
/* Text for them, independent of the locale. */
void vgi_print_number(char *to, size_t size, const char *format, double x);
void vgi_tint_number(const vgi_tint *t, double x, char to[VGI_NUMBER]);
void vgi_tint_caption(const vgi_tint *t, const vgi_spread *s, char *to, size_t size);
/* diagonal: D, where errors are in D */
void vgi_tint_title(const vgi_tint *t, double diagonal, char *to, size_t size);

/* ---- shade.c and ground.c: from samples to pixels ---- */

typedef struct vgi_ground { /* a grid at the height of the reference pose, and the figure's shadow on it */
    double height;   /* along the vertical of the world, in D */
    double spacing;  /* of the grid, in D */
    double vertical[3], across[3], along[3]; /* of the world, in the mesh's axes */
    double middle[2], reach; /* where the grid fades out, along `across` and `along`, in D */
    size_t n;        /* shadow: n x n, NULL if there is none */
    float *shadow, origin[2], step;
} vgi_ground;
int vgi_ground_shadow(vgi_ground *g, const vgi_drawing *d, vg_err *e) VG_MUST_CHECK;
/* vgi_ground_light: the factor of a background sample at (x, y) of the camera, in D; 1 without grid or shadow
 * there. */
float vgi_ground_light(const vgi_ground *g, const vgi_camera *c, double x, double y, double pixel);

typedef struct vgi_look {
    const vgi_palette *palette;
    const vgi_ground *ground; /* or NULL */
    bool numbers;             /* colours by value, else clay */
    bool patches;             /* ... or by patch number */
    size_t oversampling;
    float edge_strength;      /* 0 to 1 */
    float outline;            /* smallest step in depth drawn as an outline, in samples */
    float reach;              /* radius of ambient occlusion, in samples */
} vgi_look;
/* vgi_shade: w x h pixels (RGB) from a raster that is `oversampling` times larger in each direction. */
int vgi_shade(const vgi_look *l, const vgi_raster *r, const vgi_camera *c, unsigned char *rgb,
              vg_err *e) VG_MUST_CHECK;

/* ---- text.c ---- */

typedef struct vgi_font vgi_font;
typedef struct vgi_canvas { /* a picture with its own font: no two threads use one font */
    size_t w, h;
    unsigned char *rgb; /* w x h x 3 */
    vgi_font *font;
} vgi_canvas;
typedef struct vgi_lettering {
    const unsigned char *colour; /* RGB */
    double size;   /* of the font, in pixels; a capital is 0.73 of it high */
    double anchor; /* the share of the line left of x: 0 starts at x, 0.5 is centred, 1 ends at x */
    double room;   /* a line wider than this loses its middle; 0: any width */
} vgi_lettering;
int vgi_font_open(vgi_font **f, vg_err *e) VG_MUST_CHECK;
void vgi_font_close(vgi_font **f);
/* vgi_font_check: whether all text so far could be drawn. */
int vgi_font_check(const vgi_font *f, vg_err *e) VG_MUST_CHECK;
/* vgi_canvas_init: white. */
int vgi_canvas_init(vgi_canvas *c, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
void vgi_canvas_wipe(vgi_canvas *c);
void vgi_canvas_clear(vgi_canvas *c);
/* vgi_text: draw a line of UTF-8 text; y is its baseline. Characters that no font of the machine has become a box. */
void vgi_text(vgi_canvas *c, double x, double y, const vgi_lettering *l, const char *text);
/* vgi_text_width: in pixels. */
double vgi_text_width(vgi_font *f, double size, const char *text);

/* ---- legend.c: on a canvas of at least VGI_LEGEND rows ---- */

enum { VGI_LEGEND = 74 };
void vgi_legend(vgi_canvas *c, const vgi_tint *t, const vgi_palette *p, size_t margin, const char *title,
                const char *note);

/* ---- album.c: which frames are shown ---- */

typedef struct vgi_shot {
    char *name;
    size_t index;   /* frame number in the sequence */
    double time;    /* seconds; NAN: none */
    float *points;  /* nv */
    float *numbers; /* nv: the coloured numbers; valid only if has_numbers */
    bool has_numbers;
    vgi_spread spread;
} vgi_shot;

typedef struct vgi_album { /* at most 4 * want shots, `stride` frames apart, plus the last frame */
    size_t nv, want, seen, stride, n, cap;
    vgi_shot *at, last;
} vgi_album;

int vgi_album_init(vgi_album *a, size_t nv, size_t want, vg_err *e) VG_MUST_CHECK;
void vgi_album_clear(vgi_album *a);
/* vgi_album_next: the shot to fill with the next frame. vgi_album_close puts it into its place. */
int vgi_album_next(vgi_album *a, vgi_shot **shot, vg_err *e) VG_MUST_CHECK;
/* vgi_album_close: move the best `want` shots to the front and return their number. */
size_t vgi_album_close(vgi_album *a);
/* vgi_album_match: instead of vgi_album_close: the shots nearest to n ascending frame numbers; beyond the end, the
 * last. */
void vgi_album_match(vgi_album *a, const size_t *frames, size_t n, size_t *shots);

/* ---- png.c: the only file that includes libpng ---- */

typedef struct vgi_png vgi_png;
/* vgi_png_open: start an 8-bit RGB picture, written row by row to fd (borrowed); `name` is used in messages. */
int vgi_png_open(vgi_png **p, int fd, const char *name, size_t w, size_t h, vg_err *e) VG_MUST_CHECK;
int vgi_png_rows(vgi_png *p, const unsigned char *rgb, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_png_end(vgi_png *p, vg_err *e) VG_MUST_CHECK;
void vgi_png_close(vgi_png **p);

#endif
