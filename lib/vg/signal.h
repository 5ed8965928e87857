/* vg/signal.h: a sequence as three continuous signals: time -> pose plane -> shape coordinates -> shape (MATH 11; after
 * Cashman and Hormann 2012). Fit one, sample it at any time, edit it.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_SIGNAL_H
#define VG_PART_SIGNAL_H

#include "vg/body.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the numbers of a shape are. */
typedef enum vg_space {
    VG_SPACE_VERTICES = 1,  /* positions of the vertices */
    VG_SPACE_VECTORS = 2,   /* logarithms of the turn and scale of each corner of the vector graph */
    VG_SPACE_GRADIENTS = 3, /* of the turn of each triangle, and its stretch; faces of more corners are cut into triangles */
    VG_SPACE_ROTATIONS = 4, /* turns from triangle to triangle, and stretches */
    VG_SPACE_LENGTHS = 5    /* lengths of edges, and angles between triangles */
} vg_space;

/* How positions in the plane are found. */
typedef enum vg_layout {
    VG_LAYOUT_AUTO = 0,
    VG_LAYOUT_PLAIN = 1, /* distances of the shapes alone */
    VG_LAYOUT_RING = 2,  /* and the phase of a cycle */
    VG_LAYOUT_TIME = 3,  /* and time */
    VG_LAYOUT_PLACED = 4 /* by the user */
} vg_layout;

/* Times count frames from 1: frame number i (from 0) is at time i + 1. Coefficients of the surface are not kept: they
 * follow from positions, coordinates and sites when the signal is sampled. */
typedef struct vg_signal {
    size_t n;            /* frames it was fitted to; 0: there is no signal */
    vg_space space;
    size_t d;            /* numbers of a shape */
    size_t m;            /* shape coordinates */
    size_t l;            /* sites of the pose signal */
    size_t k;            /* control points of the time signal */
    size_t bits;         /* of a number of the basis: 64, 32 or 16; the other two arrays are NULL */
    double *mean;        /* d: the mean shape */
    double *basis;       /* m x d: orthonormal vectors h_j, one after another */
    float *basis_single;
    uint8_t *basis_short; /* little-endian int16, two bytes each, in units of basis_unit */
    double *basis_unit;  /* m; NULL unless bits is 16 */
    double *coordinate;  /* n x m */
    double *position;    /* n points of the plane */
    uint32_t *site;      /* l frames, from 0 */
    double *parameter;   /* n, rising: where on the curve the frames are */
    double *knot;        /* k + 2, not falling: of the usual k + 4 the first and the last, which say nothing, are left
                            out */
    double *control;     /* k points */
    bool rooted;         /* the body's rigid motion is a signal of its own: */
    double *turn;        /* n unit quaternions, each nearer to the one before than its negative */
    double *shift;       /* n vectors */
    size_t nturns;       /* m + 1 with a root and examples; in the spaces of vectors and gradients one for each face or
                            triangle; else 0 */
    double *home_turn;   /* unit quaternions: the rigid turns that were taken out of the examples, or those that the shapes'
                            turns are measured from */
    char **names;        /* n: of the frames */
    bool timed;          /* the frames had times: */
    double *times;       /* n seconds */
    bool examples;       /* the basis is of differences from the mean, which is a pose, to other poses, and not
                            orthonormal */
    vg_layout layout;
    double layout_weight, layout_ratio; /* of the ring or time; deviation between frames beside that of straight
                                           lines */
    double error_shape, error_pose, error_time; /* largest distance of a vertex, D: of h, of h and g, of all */
    double error_rms;    /* of all */
} vg_signal;

void vg_signal_clear(vg_signal *s);

typedef struct vg_pin {
    size_t frame;
    double at[2];
} vg_pin;

struct vg_graph;
typedef struct vg_signal_options {
    vg_space space;      /* 0: vertices */
    const struct vg_graph *graph; /* of the body, for the other spaces */
    double tolerance;    /* largest distance of a vertex in D, for those of m, l, k that are 0 */
    size_t m, l, k;
    bool root;           /* the rigid motion of the body apart */
    bool gain;           /* sites by what they gain, not where the error is largest */
    vg_layout layout;
    double weight;       /* of ring or time; 0: the best */
    const vg_pin *pins;  /* met exactly */
    size_t npins;
    const double *place; /* n points, with VG_LAYOUT_PLACED */
    size_t bits;         /* of the basis; 0: 64 */
    const double *examples; /* nexamples poses: shapes are the first one and a sum of what the others differ by, m does
                            not count, and sites and control points are for shapes of that sum; NULL: none */
    size_t nexamples;    /* 0, or at least 2 */
    int threads;
} vg_signal_options;

typedef struct vg_layout_trial {
    vg_layout layout;
    double weight, ratio;
} vg_layout_trial;
enum { VG_LAYOUT_TRIALS = 16 };

typedef struct vg_signal_stats {
    size_t rank;           /* how many coordinates there could be */
    size_t jumps;          /* spaces of turns: pairs of neighbours, over all frames, whose logarithms are more than 180
                              degrees apart */
    double diagonal;       /* D */
    double period;         /* of the cycle in frames; 0: none */
    size_t ntrials;
    vg_layout_trial trials[VG_LAYOUT_TRIALS];
    double *frame_error;   /* n: largest distance of a vertex in D */
    double *deviation;     /* n - 1: between frame i and the next, beside the whole sequence's straight lines: squared */
    size_t ncrossings;     /* places where the curve crosses itself: */
    double *crossing;      /* two times each */
} vg_signal_stats;

void vg_signal_stats_clear(vg_signal_stats *r);

enum { VG_SIGNAL_FRAMES = 1000 };
/* vg_signal_fit: n poses (3 nv numbers each, from malloc, one array that is taken over) of a body to a signal. 2 <= n <=
 * VG_SIGNAL_FRAMES, else VG_EINPUT. Names and times are left empty. Memory: four times the poses; in other spaces than
 * vertices the poses and four times their shapes of d numbers. Errors are of vertices in all spaces; vertices in no face
 * stay as in the reference and do not count, unless the space is of vertices. */
int vg_signal_fit(vg_signal *s, const vg_body *body, double *poses, size_t n, const vg_signal_options *o,
                  vg_signal_stats *report, vg_err *e) VG_MUST_CHECK;
/* vg_signal_store: keep the basis with so many bits: 64, 32 or 16. */
int vg_signal_store(vg_signal *s, size_t bits, vg_err *e) VG_MUST_CHECK;
/* vg_signal_floats: numbers that say the signal, and those of the poses, as C 3.4 counts them. */
size_t vg_signal_floats(const vg_signal *s);

/* vg_signal_onto: a signal of examples goes to another body: n poses of it (3 nv numbers each, from malloc, one array that
 * is taken over) take the place of the examples, in their order. The centroid goes as that of `from` does, scaled by the
 * bodies' sizes. */
int vg_signal_onto(vg_signal *s, const vg_body *from, const vg_body *to, double *poses, size_t n, vg_err *e) VG_MUST_CHECK;

/* vg_signal_pick: the `count` frames of n poses (n x 3 nv, destroyed: their rigid motion is taken out) by which the
 * others are told best, each beside those before it. left: root of the share of the squared differences from the reference
 * that is left then. */
int vg_signal_pick(const vg_body *body, double *poses, size_t n, size_t count, int threads, uint32_t *frames, double *left,
                   vg_err *e) VG_MUST_CHECK;

/* Old times at which new frames are taken. */
typedef struct vg_retime {
    size_t n;                 /* pairs, rising in both; 0: none */
    double *old_time, *new_time;
} vg_retime;
void vg_retime_clear(vg_retime *r);
/* vg_retime_add: keeps the pairs in order; VG_EINPUT when the new time falls where the old one rises. */
int vg_retime_add(vg_retime *r, double old_time, double new_time, vg_err *e) VG_MUST_CHECK;
/* vg_retime_at: the old time at a new one: Fritsch and Carlson's monotone interpolant, clamped to the ends. */
int vg_retime_at(const vg_retime *r, double new_time, double *old_time, vg_err *e) VG_MUST_CHECK;

/* vg_signal_edit: apply lines of text: "control I X Y", "insert T", "remove I" (control points), "frame I X Y" (its
 * position), "site I", "site -I" (more, fewer), "time OLD NEW" (to retime). Numbers count from 1. '#' begins a comment.
 * VG_EINPUT names the line. On failure the signal is half edited. */
int vg_signal_edit(vg_signal *s, vg_retime *retime, const char *text, size_t size, const char *name,
                   vg_err *e) VG_MUST_CHECK;

/* vg_signal_sketch: positions of `frames` frames evenly along a curve: a cubic spline with these control points (at least
 * 4), or the natural one through these points (at least 2). */
int vg_signal_sketch(const double *points, size_t n, bool controls, size_t frames, double *positions,
                     vg_err *e) VG_MUST_CHECK;

/* Evaluates a signal. */
typedef struct vg_sampler vg_sampler;
enum { VG_SAMPLER_BATCH = 64 };
/* vg_sampler_new: s is borrowed until free. single: numbers of binary32 precision are enough. VG_EINPUT when the
 * signal's sites say less than its coordinates need. */
int vg_sampler_new(vg_sampler **p, const vg_signal *s, bool single, vg_err *e) VG_MUST_CHECK;
void vg_sampler_free(vg_sampler **p);
void vg_sampler_position(const vg_sampler *p, double time, double at[2]);       /* f */
/* vg_sampler_coordinates: g: of n <= VG_SAMPLER_BATCH points the m numbers of each. vg_sampler_shapes: of n times m
 * coordinates the shapes (d numbers each). The same point gives the same bits in whatever company. */
void vg_sampler_coordinates(vg_sampler *p, size_t n, const double *at, double *x);
void vg_sampler_shapes(vg_sampler *p, size_t n, const double *x, double *const *shapes);
/* vg_sampler_place: vertices where the root takes them at a time; nothing when the signal has no root. */
void vg_sampler_place(const vg_sampler *p, double time, size_t nv, double *vertices);

/* vg_sampler_root: the turn (a unit quaternion) and shift of the root at a time; false: the signal has no root. */
bool vg_sampler_root(const vg_sampler *p, double time, double turn[4], double shift[3]);

/* Turns shapes of spaces other than vertices into vectors of the vector graph. */
typedef struct vg_unshaper vg_unshaper;
/* vg_unshaper_new: s and g are borrowed until free; reference: nv points, not kept. VG_EINPUT when the signal's shapes are
 * not of this graph. */
int vg_unshaper_new(vg_unshaper **u, const vg_signal *s, const struct vg_graph *g, const double *reference,
                    vg_err *e) VG_MUST_CHECK;
void vg_unshaper_free(vg_unshaper **u);
/* vg_unshaper_vectors: a shape (d numbers) to one vector per corner. */
int vg_unshaper_vectors(vg_unshaper *u, const double *shape, double *vectors, vg_err *e) VG_MUST_CHECK;

/* The curve of a signal, `parts` steps from one frame to the next. */
typedef struct vg_trace {
    size_t parts, n;   /* n points: (frames - 1) * parts + 1 */
    double *position;  /* n points of the plane */
    double *deviation; /* n: root mean squared distance of the vertices from the natural cubic spline through the frames; in
                          other spaces than vertices the distance of the shapes */
    size_t ncrossings; /* places where the curve crosses itself: */
    double *crossing;  /* two times each */
} vg_trace;
int vg_signal_trace(vg_trace *t, const vg_signal *s, size_t parts, vg_err *e) VG_MUST_CHECK;
void vg_trace_clear(vg_trace *t);

#ifdef __cplusplus
}
#endif
#endif
