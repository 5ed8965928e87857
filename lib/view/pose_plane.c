/* pose_plane.c: a picture of a signal: its curve through the pose plane, coloured by the distance of its shapes from
 * a smooth motion; frames, sites, control points and crossings; and some of its poses around it (as figures 1 and 5
 * of the source, Cashman and Hormann 2012). The page on which the curve can be edited is separate.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/paint.h"
#include "numeric/stats.h"
#include "signal/unshape.h"

#include <math.h>
#include <stdio.h>

enum { /* lengths in pixels */
    WIDTH = 1400,
    TITLE = 40,
    POSE = 170,        /* the picture of a pose */
    NAME = 22,         /* under it */
    PLANE = 600,       /* height of the plane */
    KEY = 26,          /* the line that explains the marks */
    GAP = 20,
    ACROSS = 5, ASIDE = 2, /* poses above and below, and at each side */
    SLOTS = 2 * (ACROSS + ASIDE),
    HEIGHT = TITLE + 2 * (POSE + NAME) + PLANE + KEY + VGI_LEGEND,
    OVERSAMPLING = 3,
    PARTS = 16         /* segments of the curve per frame interval */
};
static const double title_size = 17, text_size = 12; /* of the font, in pixels */
static const unsigned char ink[3] = {38, 42, 50}, soft_ink[3] = {112, 118, 128}, faint[3] = {206, 210, 216}, white[3] = {255, 255, 255},
                           alarm[3] = {205, 30, 40};

typedef struct place {
    double x, y, angle; /* of a frame or of a pose's picture, relative to the middle of the plane */
    size_t index;
} place;

typedef struct chart {
    const vg_head *h;
    const vg_signal *s;
    const vg_plane_options *o;
    vg_trace trace;
    vgi_canvas canvas;
    vgi_palette palette;
    vgi_tint tint;
    double middle[2], scale; /* of the plane: pixels per unit */
    size_t nposes;
    place slot[SLOTS], frame[SLOTS]; /* picture i shows frame i */
    float *points;           /* nposes x 3 nv */
    vgi_figure figure;
    vgi_camera camera;
} chart;

static void to_canvas(const chart *c, const double p[2], double at[2])
{
    at[0] = WIDTH / 2.0 + c->scale * (p[0] - c->middle[0]);
    at[1] = TITLE + POSE + NAME + PLANE / 2.0 - c->scale * (p[1] - c->middle[1]);
}

/* Scale so that the whole curve and all frames fit between the pictures. */
static void fit_plane(chart *c)
{
    double least[2] = {INFINITY, INFINITY}, most[2] = {-INFINITY, -INFINITY};
    for (size_t i = 0; i < c->trace.n + c->s->n; i++) {
        const double *p = i < c->trace.n ? c->trace.position + 2 * i : c->s->position + 2 * (i - c->trace.n);
        for (int k = 0; k < 2; k++) least[k] = fmin(least[k], p[k]), most[k] = fmax(most[k], p[k]);
    }
    double w = most[0] - least[0], h = most[1] - least[1];
    for (int k = 0; k < 2; k++) c->middle[k] = (least[k] + most[k]) / 2;
    c->scale = fmin((WIDTH - 2 * (POSE + 3 * GAP)) / fmax(w, 1e-9), (PLANE - 4 * GAP) / fmax(h, 1e-9));
}

/* The colour map ends at the 99th percentile over the curve. */
static int choose_colours(chart *c, vg_err *e)
{
    bool of_vertices = c->s->space == VG_SPACE_VERTICES;
    double unit = of_vertices ? vg_diagonal(c->h->body.reference, c->h->body.mesh.nv) : 1;
    for (size_t i = 0; i < c->trace.n; i++) c->trace.deviation[i] /= unit > 0 ? unit : 1;
    double *sorted = vgi_copy_array(c->trace.deviation, c->trace.n, sizeof *sorted, e);
    if (!sorted) return VG_ENOMEM;
    qsort(sorted, c->trace.n, sizeof *sorted, vgi_by_number);
    c->tint.what = VG_TINT_ERRORS;
    vgi_tint_end(&c->tint, 0, sorted[(size_t)(0.99 * (double)(c->trace.n - 1))], 0, sorted[c->trace.n - 1]);
    vgi_palette_init(&c->palette, false);
    free(sorted);
    return VG_OK;
}

/* ---- choice of poses and their positions ---- */

static int by_angle(const void *a, const void *b)
{
    double x = ((const place *)a)->angle, y = ((const place *)b)->angle;
    return x < y ? -1 : x > y;
}

static void set_angle(place *p)
{
    p->angle = atan2(p->y - (TITLE + POSE + NAME + PLANE / 2.0), p->x - WIDTH / 2.0);
}

/* The centres of the pictures, in order around the plane. */
static void list_slots(place *slot)
{
    double top = TITLE + POSE / 2.0, bottom = TITLE + POSE + NAME + PLANE + POSE / 2.0;
    for (size_t i = 0; i < ACROSS; i++) {
        double x = WIDTH * ((double)i + 0.5) / ACROSS;
        slot[2 * i] = (place){.x = x, .y = top};
        slot[2 * i + 1] = (place){.x = x, .y = bottom};
    }
    for (size_t i = 0; i < ASIDE; i++) {
        double y = TITLE + POSE + NAME + PLANE * ((double)i + 0.5) / ASIDE;
        slot[2 * (ACROSS + i)] = (place){.x = GAP + POSE / 2.0, .y = y};
        slot[2 * (ACROSS + i) + 1] = (place){.x = WIDTH - GAP - POSE / 2.0, .y = y};
    }
    for (size_t i = 0; i < SLOTS; i++) set_angle(slot + i);
    qsort(slot, SLOTS, sizeof *slot, by_angle);
}

/* Frames evenly spaced in time, each in a picture on its side of the plane. Both go round in the same order, rotated
 * to be as near to each other as possible. */
static void choose_poses(chart *c)
{
    place all[SLOTS];
    size_t n = c->nposes = c->s->n < SLOTS ? c->s->n : SLOTS, best = 0;
    double least = INFINITY;
    list_slots(all);
    for (size_t i = 0; i < n; i++) {
        size_t index = n > 1 ? (i * (c->s->n - 1) + (n - 1) / 2) / (n - 1) : 0;
        double at[2];
        to_canvas(c, c->s->position + 2 * index, at);
        c->frame[i] = (place){.x = at[0], .y = at[1], .index = index};
        set_angle(c->frame + i);
    }
    qsort(c->frame, n, sizeof *c->frame, by_angle);
    for (size_t turn = 0; turn < SLOTS; turn++) {
        double sum = 0;
        for (size_t i = 0; i < n; i++) {
            const place *slot = all + (turn + i * SLOTS / n) % SLOTS;
            sum += hypot(slot->x - c->frame[i].x, slot->y - c->frame[i].y);
        }
        if (sum < least) least = sum, best = turn;
    }
    for (size_t i = 0; i < n; i++) c->slot[i] = all[(best + i * SLOTS / n) % SLOTS];
}

/* ---- pictures of poses ---- */

/* Shapes that are not vertices are reconstructed. */
static int sample_vectors(chart *c, vg_sampler *p, double *x, double *const *points, vg_err *e)
{
    vg_graph *g = NULL;
    vg_unshaper *u = NULL;
    double *shape = vgi_array(c->s->d, sizeof *shape, e);
    int r = shape ? vg_head_graph(&g, c->h, e) : VG_ENOMEM;
    if (r == VG_OK) r = vg_unshaper_new(&u, c->s, g, c->h->body.reference, e);
    for (size_t i = 0; r == VG_OK && i < c->nposes; i++) {
        vg_sampler_coordinates(p, 1, c->s->position + 2 * c->frame[i].index, x);
        vg_sampler_shapes(p, 1, x, &shape);
        r = vgi_unshaper_vertices(u, shape, points[i], e);
    }
    vg_unshaper_free(&u);
    vg_graph_free(&g);
    free(shape);
    return r;
}

static void sample_vertices(chart *c, vg_sampler *p, double *x, double *const *points)
{
    for (size_t i = 0; i < c->nposes; i++) {
        vg_sampler_coordinates(p, 1, c->s->position + 2 * c->frame[i].index, x);
        vg_sampler_shapes(p, 1, x, points + i);
    }
}

static int sample_poses(chart *c, vg_err *e)
{
    size_t nv = c->h->body.mesh.nv;
    double centre[3], unit = vg_diagonal(c->h->body.reference, nv), *shapes = vgi_array(c->nposes * nv, 3 * sizeof *shapes, e);
    double *x = vgi_array(c->s->m, sizeof *x, e), **points = vgi_array(c->nposes, sizeof *points, e);
    vg_sampler *p = NULL;
    int r = shapes && x && points && (c->points = vgi_array(c->nposes * nv, 3 * sizeof *c->points, e)) ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) r = vg_sampler_new(&p, c->s, false, e);
    for (size_t i = 0; r == VG_OK && i < c->nposes; i++) points[i] = shapes + 3 * nv * i;
    if (r == VG_OK && c->s->space == VG_SPACE_VERTICES) sample_vertices(c, p, x, points);
    else if (r == VG_OK) r = sample_vectors(c, p, x, points, e);
    for (size_t i = 0; r == VG_OK && i < c->nposes; i++) {
        vg_centroid(points[i], nv, centre);
        for (size_t k = 0; k < 3 * nv; k++)
            c->points[3 * nv * i + k] = (float)((points[i][k] - centre[k % 3]) / (unit > 0 ? unit : 1));
    }
    vg_sampler_free(&p);
    free(shapes);
    free(points);
    free(x);
    return r;
}

static void place_camera(chart *c)
{
    vgi_box box = vgi_box_empty();
    vgi_camera_turn(&c->camera, c->o->azimuth, c->o->elevation, c->o->z_up);
    c->camera.width = c->camera.height = POSE * OVERSAMPLING;
    for (size_t i = 0; i < c->nposes; i++)
        vgi_camera_measure(&c->camera, &c->figure, c->points + 3 * c->h->body.mesh.nv * i, (double[]){0, 0}, &box);
    vgi_camera_fit(&c->camera, &box, 0.03);
}

static int draw_pose(const chart *c, size_t i, unsigned char *rgb, vg_err *e)
{
    vgi_raster raster = {0};
    bool patches = c->h->body.patches.n > 0;
    vgi_drawing drawing = {.figure = &c->figure, .camera = &c->camera, .points = c->points + 3 * c->h->body.mesh.nv * i,
                           .patches = patches ? c->h->body.patches.of_face : NULL, .wire = 0.9f * OVERSAMPLING};
    vgi_look look = {.palette = &c->palette, .patches = patches, .oversampling = OVERSAMPLING, .edge_strength = 0.5f,
                     .outline = 0.02f * POSE * OVERSAMPLING, .reach = 0.07f * POSE * OVERSAMPLING};
    int r = vgi_raster_init(&raster, POSE * OVERSAMPLING, POSE * OVERSAMPLING, e);
    if (r == VG_OK) r = vgi_draw(&raster, &drawing, e);
    if (r == VG_OK) r = vgi_shade(&look, &raster, &c->camera, rgb, e);
    vgi_raster_clear(&raster);
    return r;
}

static int put_poses(chart *c, vg_err *e)
{
    unsigned char *rgb = vgi_array(POSE * POSE, 3, e);
    int r = rgb ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < c->nposes; i++) {
        char name[300];
        size_t left = (size_t)(c->slot[i].x - POSE / 2.0), top = (size_t)(c->slot[i].y - POSE / 2.0);
        if ((r = draw_pose(c, i, rgb, e)) < 0) break;
        for (size_t y = 0; y < POSE; y++)
            memcpy(c->canvas.rgb + 3 * ((top + y) * WIDTH + left), rgb + 3 * y * POSE, 3 * POSE);
        snprintf(name, sizeof name, "%zu: %.200s", c->frame[i].index + 1, c->s->names[c->frame[i].index]);
        vgi_text(&c->canvas, c->slot[i].x, c->slot[i].y + POSE / 2.0 + 12, &(vgi_lettering){soft_ink, text_size, 0.5, POSE + 2 * GAP}, name);
    }
    free(rgb);
    return r;
}

/* ---- the plane ---- */

static void put_leaders(chart *c)
{
    for (size_t i = 0; i < c->nposes; i++) {
        double from[2] = {c->slot[i].x, c->slot[i].y}, to[2] = {c->frame[i].x, c->frame[i].y};
        vgi_paint_line(&c->canvas, from, to, 1, faint);
    }
}

static void put_controls(chart *c)
{
    double at[2], last[2];
    for (size_t i = 0; i < c->s->k; i++) {
        to_canvas(c, c->s->control + 2 * i, at);
        if (i) vgi_paint_line(&c->canvas, last, at, 1, faint);
        memcpy(last, at, sizeof last);
    }
    for (size_t i = 0; i < c->s->k; i++) {
        to_canvas(c, c->s->control + 2 * i, at);
        vgi_paint_box(&c->canvas, at, 3, 1, soft_ink);
    }
}

static void put_curve(chart *c)
{
    const vg_trace *t = &c->trace;
    for (int pass = 0; pass < 2; pass++) /* first a dark border */
        for (size_t i = 0; i + 1 < t->n; i++) {
            double a[2], b[2], share = vgi_tint_place(&c->tint, (t->deviation[i] + t->deviation[i + 1]) / 2);
            const float *linear = c->palette.map[(size_t)(share * (VGI_MAP_STEPS - 1))];
            unsigned char colour[3];
            for (int k = 0; k < 3; k++) colour[k] = vgi_encode(&c->palette, linear[k]);
            to_canvas(c, t->position + 2 * i, a);
            to_canvas(c, t->position + 2 * i + 2, b);
            vgi_paint_line(&c->canvas, a, b, pass ? 5 : 7, pass ? colour : ink);
        }
}

static void put_frames(chart *c)
{
    const vg_signal *s = c->s;
    double at[2];
    for (size_t i = 0; i < s->n; i++) {
        to_canvas(c, s->position + 2 * i, at);
        vgi_paint_disc(&c->canvas, at, 3, white);
        vgi_paint_disc(&c->canvas, at, 2, ink);
    }
    for (size_t j = 0; j < s->l; j++) {
        to_canvas(c, s->position + 2 * s->site[j], at);
        vgi_paint_ring(&c->canvas, at, 5.5, 1.2, ink);
    }
    for (size_t i = 0; i < c->nposes; i++) {
        at[0] = c->frame[i].x, at[1] = c->frame[i].y;
        vgi_paint_disc(&c->canvas, at, 4.5, ink);
    }
}

/* The point of the polyline at a time. */
static void put_crossings(chart *c)
{
    const vg_trace *t = &c->trace;
    for (size_t i = 0; i < t->ncrossings; i++) {
        double step = (t->crossing[2 * i] - 1) * (double)t->parts, p[2], at[2];
        size_t first = (size_t)fmin(step, (double)(t->n - 2));
        double share = step - (double)first;
        for (size_t k = 0; k < 2; k++)
            p[k] = t->position[2 * first + k] * (1 - share) + t->position[2 * first + 2 + k] * share;
        to_canvas(c, p, at);
        vgi_paint_cross(&c->canvas, at, 6, 2.4, alarm);
    }
}

static void put_ends(chart *c)
{
    static const char *const words[] = {"start", "end"};
    for (size_t i = 0; i < 2; i++) {
        double at[2];
        to_canvas(c, c->trace.position + (i ? 2 * (c->trace.n - 1) : 0), at);
        vgi_paint_disc(&c->canvas, at, 6, ink);
        vgi_paint_disc(&c->canvas, at, 3, white);
        vgi_text(&c->canvas, at[0] + 10, at[1] + (i ? 17 : -5), &(vgi_lettering){ink, text_size, 0, 0}, words[i]);
    }
}

static void put_words(chart *c)
{
    const vg_signal *s = c->s;
    char text[400];
    snprintf(text, sizeof text, "%zu frames, %zu control points, %zu sites, %zu shape coordinates", s->n, s->k, s->l, s->m);
    vgi_text(&c->canvas, WIDTH / 2.0, 27, &(vgi_lettering){ink, title_size, 0.5, WIDTH}, text);
    snprintf(text, sizeof text, "dots: frames, ringed: sites; squares: control points; crosses: where the curve crosses itself, %zu times",
             c->trace.ncrossings);
    vgi_text(&c->canvas, WIDTH / 2.0, HEIGHT - VGI_LEGEND - KEY + 17, &(vgi_lettering){soft_ink, text_size, 0.5, WIDTH}, text);
}

static void put_legend(chart *c)
{
    vgi_canvas strip = {.w = WIDTH, .h = VGI_LEGEND, .font = c->canvas.font, .rgb = c->canvas.rgb + 3 * WIDTH * (HEIGHT - VGI_LEGEND)};
    vgi_legend(&strip, &c->tint, &c->palette, GAP, c->s->space == VG_SPACE_VERTICES ? "rms distance of the vertices from a cubic spline through the frames, D"
                                                : "distance of the shapes from a cubic spline through the frames", "");
}

static int draw_chart(chart *c, vg_err *e)
{
    fit_plane(c);
    int r = choose_colours(c, e);
    choose_poses(c);
    if (r == VG_OK) r = vgi_figure_init(&c->figure, &c->h->body.mesh, e);
    if (r == VG_OK) r = sample_poses(c, e);
    if (r < 0) return r;
    place_camera(c);
    put_leaders(c);
    if ((r = put_poses(c, e)) < 0) return r;
    put_controls(c);
    put_curve(c);
    put_frames(c);
    put_crossings(c);
    put_ends(c);
    put_words(c);
    put_legend(c);
    return vgi_font_check(c->canvas.font, e);
}

static int write_picture(const chart *c, int fd, const char *name, vg_err *e)
{
    vgi_png *png = NULL;
    int r = vgi_png_open(&png, fd, name, WIDTH, HEIGHT, e);
    if (r == VG_OK) r = vgi_png_rows(png, c->canvas.rgb, HEIGHT, e);
    if (r == VG_OK) r = vgi_png_end(png, e);
    vgi_png_close(&png);
    return r;
}

int vg_plane_write(const vg_head *h, const vg_plane_options *o, int fd, const char *name, vg_err *e)
{
    chart c = {.h = h, .s = &h->signal, .o = o};
    if (!h->signal.n) return vg_fail(e, VG_EINPUT, "there is no signal to draw");
    int r = vg_signal_trace(&c.trace, c.s, PARTS, e);
    if (r == VG_OK) r = vgi_canvas_init(&c.canvas, WIDTH, HEIGHT, e);
    if (r == VG_OK) r = draw_chart(&c, e);
    if (r == VG_OK) r = write_picture(&c, fd, name, e);
    vg_trace_clear(&c.trace);
    vgi_figure_clear(&c.figure);
    vgi_tint_clear(&c.tint);
    vgi_canvas_clear(&c.canvas);
    free(c.points);
    return r;
}
