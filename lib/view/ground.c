/* ground.c: a grid at the height of the reference pose, and a shadow directly below the figure: they show whether a
 * figure walks, jumps or slides. Shadows of the lights are not drawn.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>

enum { SHADOW_SIZE = 128, SHADOW_BLUR = 3 };
#define SHADOW_HEIGHT 0.15 /* D: a surface at this height has 1/e of the shadow of one on the ground */
#define SHADOW_DEPTH 0.5f
#define LINE_DEPTH 0.2f

static double dot3(const double a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- shadow ---- */

/* Box blur over 2 * SHADOW_BLUR + 1 entries; n entries, `stride` apart. */
static void blur_line(float *x, size_t n, size_t stride, float *line)
{
    for (size_t i = 0; i < n; i++) line[i] = x[i * stride];
    for (size_t i = 0; i < n; i++) {
        float sum = 0;
        for (size_t j = i < SHADOW_BLUR ? 0 : i - SHADOW_BLUR; j <= i + SHADOW_BLUR && j < n; j++) sum += line[j];
        x[i * stride] = sum / (2 * SHADOW_BLUR + 1);
    }
}

static void blur(float *x, size_t n)
{
    float line[SHADOW_SIZE];
    for (int pass = 0; pass < 3; pass++) {
        for (size_t i = 0; i < n; i++) blur_line(x + i * n, n, 1, line);
        for (size_t i = 0; i < n; i++) blur_line(x + i, n, n, line);
    }
}

int vgi_ground_shadow(vgi_ground *g, const vgi_drawing *d, vg_err *e)
{
    /* seen from below, the nearest surface is the lowest one */
    vgi_camera below = {.width = SHADOW_SIZE, .height = SHADOW_SIZE};
    for (int k = 0; k < 3; k++) {
        below.right[k] = (float)g->across[k];
        below.up[k] = (float)g->along[k];
        below.toward[k] = -(float)g->vertical[k];
    }
    vgi_box box = vgi_box_empty();
    vgi_camera_measure(&below, d->figure, d->points, (double[2]){0, 0}, &box);
    vgi_camera_fit(&below, &box, 0.12);
    vgi_drawing drawing = {.figure = d->figure, .camera = &below, .points = d->points, .wire = 0.6f};
    vgi_raster raster = {0};
    g->shadow = vgi_array(SHADOW_SIZE * SHADOW_SIZE, sizeof *g->shadow, e);
    int r = g->shadow ? vgi_raster_init(&raster, SHADOW_SIZE, SHADOW_SIZE, e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_draw(&raster, &drawing, e);
    if (r == VG_OK) {
        g->n = SHADOW_SIZE;
        g->step = (float)(1 / below.scale);
        g->origin[0] = (float)(below.x - 0.5 * SHADOW_SIZE / below.scale);
        g->origin[1] = (float)(below.y + 0.5 * SHADOW_SIZE / below.scale); /* rows go down */
        for (size_t i = 0; i < SHADOW_SIZE * SHADOW_SIZE; i++) {
            if (raster.at[i].kind == VGI_EMPTY) continue;
            double height = -raster.at[i].z / below.scale - g->height;
            g->shadow[i] = (float)exp(-fmax(height, 0) / SHADOW_HEIGHT);
        }
        blur(g->shadow, SHADOW_SIZE);
    }
    vgi_raster_clear(&raster);
    return r;
}

static float shadow_at(const vgi_ground *g, double across, double along)
{
    double x = (across - g->origin[0]) / g->step - 0.5, y = (g->origin[1] - along) / g->step - 0.5;
    double last = (double)g->n - 1;
    if (!(x >= 0 && y >= 0 && x < last && y < last)) return 0;
    size_t i = (size_t)x, j = (size_t)y;
    float u = (float)(x - (double)i), v = (float)(y - (double)j);
    const float *p = g->shadow + j * g->n + i, *q = p + g->n;
    float mean = (1 - v) * ((1 - u) * p[0] + u * p[1]) + v * ((1 - u) * q[0] + u * q[1]);
    float raised = fminf(2 * mean, 1); /* keep small feet visible after the blur */
    return raised * (1 - 0.25f * raised);
}

/* ---- grid ---- */

/* Coverage of a line one pixel wide at a distance in pixels. */
static double line_cover(double world, double spacing, double per_pixel)
{
    double off = fabs(world - spacing * round(world / spacing)) / fmax(per_pixel, 1e-12);
    return fmin(fmax(1 - off, 0), 1);
}

static double smooth_step(double a, double b, double x)
{
    double t = fmin(fmax((x - a) / (b - a), 0), 1);
    return t * t * (3 - 2 * t);
}

float vgi_ground_light(const vgi_ground *g, const vgi_camera *c, double x, double y, double pixel)
{
    double rise = dot3(g->vertical, c->toward), tilt = dot3(g->vertical, c->up);
    if (fabs(rise) < 0.02) /* seen from the side, the ground is a line */
        return fabs(y * tilt - g->height) < pixel / 2 ? 1 - 2 * LINE_DEPTH : 1;
    double z = (g->height - y * tilt) / rise; /* right has no rise */
    double at[2], change[2];
    const double *axes[2] = {g->across, g->along};
    for (int k = 0; k < 2; k++) {
        double rx = dot3(axes[k], c->right), ux = dot3(axes[k], c->up), tx = dot3(axes[k], c->toward);
        at[k] = x * rx + y * ux + z * tx;
        change[k] = hypot(rx, ux - tx * tilt / rise) * pixel;
    }
    double far = hypot(at[0] - g->middle[0], at[1] - g->middle[1]) / g->reach;
    double fade = 1 - smooth_step(0.5, 1, far);
    if (fade <= 0) return 1;
    double line = fmax(line_cover(at[0], g->spacing, change[0]), line_cover(at[1], g->spacing, change[1]));
    float shadow = g->shadow && rise > 0 ? shadow_at(g, at[0], at[1]) : 0;
    return (1 - LINE_DEPTH * (float)(line * fade)) * (1 - SHADOW_DEPTH * shadow);
}
