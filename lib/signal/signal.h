/* signal.h: the numeric parts of continuous signals (MATH 11; after Cashman and Hormann 2012), from arrays to arrays.
 * Internal; no meshes, no files. Frames are rows: an n x m array holds the m numbers of frame 0 first. Points of the
 * pose plane are pairs. Times count frames from 1, as in the source: frame i (from 0) is at time i + 1.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_PARTS_H
#define VG_SIGNAL_PARTS_H

#include "core/core.h"

/* ---- basis.c: the shape signal h(x) = mean + sum x_j h_j ---- */

typedef struct vgi_basis {
    size_t n, d;
    size_t rank;     /* number of basis vectors */
    double *mean;    /* d */
    double *centred; /* n x d: the poses minus their mean */
    double *vectors; /* rank x d: orthonormal rows h_j, by descending variance */
    double *x;       /* n x rank: coordinates of the frames */
    double *value;   /* rank: eigenvalues of the Gram matrix of the centred poses, descending */
} vgi_basis;

/* vgi_basis_make: principal components of n poses of d numbers from their Gram matrix. Takes ownership of poses (n x
 * d, from malloc), also on failure. Eigenvalues up to 1e-14 of the largest are dropped. VG_ENOMEM. */
int vgi_basis_make(vgi_basis *b, double *poses, size_t n, size_t d, int threads, vg_err *e) VG_MUST_CHECK;
void vgi_basis_clear(vgi_basis *b);

/* Distance between points of the poses and their approximation. */
typedef struct vgi_error {
    double most;  /* largest distance of a point */
    double rms;   /* over all points and frames */
    double *of_frame; /* n: largest distance per frame; provided by the caller, may be NULL */
} vgi_error;
/* vgi_basis_error: poses with three numbers per point against h with the first m vectors at x (n x stride, stride >=
 * m). */
int vgi_basis_error(const vgi_basis *b, const double *x, size_t stride, size_t m, int threads, vgi_error *error,
                    vg_err *e) VG_MUST_CHECK;

/* vgi_gram: g (n x n) := products of n rows of d numbers. Call between vgi_blas_alone and _shared. */
void vgi_gram(size_t n, size_t d, const double *rows, double *g, int threads);

/* ---- natural.c: natural cubic splines through values at 1, 2, ..., n ---- */

/* vgi_natural_make: second derivatives (n x w) of the spline through x (n x w). room: workspace of n numbers. */
void vgi_natural_make(size_t n, size_t w, const double *x, double *second, double *room);
/* vgi_natural_at: w numbers at time t, clamped to 1 .. n. At t = i they equal row i - 1 of x bit for bit. */
void vgi_natural_at(size_t n, size_t w, const double *x, const double *second, double t, double *out);

/* ---- plane.c: positions with the distances of the shapes ---- */

/* vgi_distances: squares of the distances between n rows of m numbers (n x n), 0 on the diagonal. */
void vgi_distances(size_t n, size_t m, const double *x, size_t stride, double *square);

typedef struct vgi_stress_stats {
    double stress; /* sum over pairs of (|p_i - p_j| - distance)^2 */
    size_t steps;
} vgi_stress_stats;
/* vgi_plane_settle: Guttman steps from p (n points) to a minimum of the stress, which never increases. distance: n x
 * n. held (n, may be NULL): frames whose position in p is fixed. */
int vgi_plane_settle(size_t n, const double *distance, const bool *held, double *p, vgi_stress_stats *stats,
                     vg_err *e) VG_MUST_CHECK;
/* vgi_plane_radius: root mean square distance from the centroid; centre (2 numbers) may be NULL. */
double vgi_plane_radius(size_t n, const double *p, double centre[2]);

/* ---- layout.c: choice of distances ---- */

/* vgi_period: the length of a cycle in frames, 0 if there is none. square: from vgi_distances. */
int vgi_period(size_t n, const double *square, double *period, vg_err *e) VG_MUST_CHECK;
/* vgi_layout_judge: rms distance between the full-precision signals at these positions and a cubic spline through the
 * x, at a quarter, a half and three quarters between frames, relative to that of straight lines. deviation (3 (n - 1)
 * squares, may be NULL): relative to the mean square of straight lines. */
int vgi_layout_judge(size_t n, size_t m, const double *x, const double *p, double *ratio, double *deviation,
                     vg_err *e) VG_MUST_CHECK;
/* vgi_layout_choose: the first candidate whose ratio is at most 0.6, or else the best. `only` (may be NULL): only
 * candidates with this layout, and with this weight unless it is 0. tried: the candidates judged, in order; *ntried
 * at most VG_LAYOUT_TRIALS. VG_EINPUT if a ring is requested and there is no cycle. */
int vgi_layout_choose(size_t n, size_t m, const double *x, const vg_pin *pins, size_t npins,
                      const vg_layout_trial *only, int threads, double *p, vg_layout_trial *chosen, double *period,
                      vg_layout_trial *tried, size_t *ntried, vg_err *e) VG_MUST_CHECK;

typedef struct vgi_crossing {
    double a, b; /* times at which the curve is at the same point, a < b */
} vgi_crossing;
/* vgi_crossings: of a polyline of n points; times count its points from 1. The caller frees *list. */
int vgi_crossings(size_t n, const double *p, vgi_crossing **list, size_t *count, vg_err *e) VG_MUST_CHECK;

/* ---- spline_pose.c: the pose signal g, a thin-plate spline ---- */

typedef struct vgi_plate {
    size_t n;        /* frames */
    size_t anchors;  /* number of the first sites, whose functions are the linear ones: 3; 2 if all points are
                        collinear, 1 if they coincide */
    size_t l;        /* number of sites */
    size_t apart;    /* number of the first sites that keep a distance from one another; between frames, near
                        duplicates ruin the surface */
    size_t most;     /* capacity for sites */
    double centre[2], scale; /* in the plane: computations use (p - centre) / scale */
    double bary[9];  /* barycentric coordinates with respect to the anchors: bary (3 x 3, row-major) times (1, x, y) */
    double *p;       /* n points, scaled */
    uint32_t *site;  /* l frames; the first `anchors` are the anchors */
    double *weight;  /* l x 3: barycentric coordinates of the sites */
    double *anchor;  /* 3 x n: radial functions of the anchors on the frames */
    size_t stride;   /* numbers of a row of q: n and zeros, so that rows begin at multiples of 64 bytes */
    double *q;       /* l x stride: orthonormal functions on the frames; the first r span the functions of r sites */
    double *q_room;  /* the allocation that q lies in */
    double *r;       /* most x most, row-major, upper triangle: function j itself is sum_i q_i r_ij */
    double *column;  /* most: of r, while it is found */
} vgi_plate;

typedef enum vgi_site_rule { VGI_FARTHEST, VGI_GAIN } vgi_site_rule;
/* vgi_plate_order: all useful sites, in order of descending gain: n positions p, n x m coordinates x. */
int vgi_plate_order(vgi_plate *s, size_t n, size_t m, const double *p, const double *x, size_t stride,
                    vgi_site_rule rule, vg_err *e) VG_MUST_CHECK;
/* vgi_plate_make: with these sites, the anchors among them first; sites that depend on others are left out. */
int vgi_plate_make(vgi_plate *s, size_t n, const double *p, const uint32_t *sites, size_t l, vg_err *e) VG_MUST_CHECK;
void vgi_plate_clear(vgi_plate *s);
/* vgi_plate_fitted: g at the frames with the first l sites: fitted (n x m) from x (n x stride). room: workspace of l
 * * m. */
void vgi_plate_fitted(const vgi_plate *s, size_t l, size_t m, const double *x, size_t stride, double *fitted,
                      double *room);
/* vgi_plate_solve: coefficients (l x m) of the first l sites: of the barycentric coordinates, then of the functions
 * of sites. */
void vgi_plate_solve(const vgi_plate *s, size_t l, size_t m, const double *x, size_t stride, double *coefficients);
/* vgi_plate_functions: the l functions at a point of the plane; g(p) is their sum weighted by the coefficients. */
void vgi_plate_functions(const vgi_plate *s, size_t l, const double p[2], double *functions);

/* ---- spline_time.c: the time signal f, a cubic spline with natural ends ---- */

typedef struct vgi_curve {
    size_t n, k;
    double *t;       /* n: parameters of the frames, ascending */
    double *slope;   /* n: of the monotone interpolant from time to parameter */
    double *knot;    /* k + 4; the first four are equal, and the last four */
    double *control; /* k points */
} vgi_curve;

/* vgi_parameters: centripetal parameters t of n points. */
void vgi_parameters(size_t n, const double *p, double *t);
/* vgi_monotone_slopes: Fritsch and Carlson's slopes of the monotone interpolant of y at positions x; NULL: 1, 2, ...,
 * n. */
void vgi_monotone_slopes(size_t n, const double *x, const double *y, double *slope);
/* vgi_monotone_at: `at` is clamped to the first and last position. */
double vgi_monotone_at(size_t n, const double *x, const double *y, const double *slope, double at);
/* vgi_curve_fit: least squares with natural ends; knots at the parameters of the frames `at` (count >= 2, ascending,
 * from 0 to n - 1): k = count + 2. n >= 2. */
int vgi_curve_fit(vgi_curve *c, size_t n, const double *p, const double *t, const uint32_t *at, size_t count,
                  vg_err *e) VG_MUST_CHECK;
void vgi_curve_clear(vgi_curve *c);
double vgi_curve_parameter(const vgi_curve *c, double time);
void vgi_curve_point(const vgi_curve *c, double parameter, double p[2]);
void vgi_curve_at(const vgi_curve *c, double time, double p[2]);
/* vgi_curve_order: frames in order of their parameters' gain as knots, beginning with the two ends. order: n. */
int vgi_curve_order(size_t n, const double *p, const double *t, uint32_t *order, vg_err *e) VG_MUST_CHECK;
/* vgi_curve_insert: add one knot and control point without changing the curve. VG_EARG outside the ends. */
int vgi_curve_insert(vgi_curve *c, double parameter, vg_err *e) VG_MUST_CHECK;
/* vgi_curve_remove: remove a control point and a knot. VG_EARG for the first and last two, and if only four are
 * left. */
int vgi_curve_remove(vgi_curve *c, size_t control, vg_err *e) VG_MUST_CHECK;

#endif
