/* camera.c: a parallel projection, so that lengths can be compared across the sheet. There is no perspective.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>

/* From y-up axes, in which the viewer rotates, to the axes of the mesh (z up: its front is -y). */
static void to_mesh(const double v[3], bool z_up, float out[3])
{
    out[0] = (float)v[0];
    out[1] = (float)(z_up ? -v[2] : v[1]);
    out[2] = (float)(z_up ? v[1] : v[2]);
}

void vgi_camera_turn(vgi_camera *c, double azimuth, double elevation, bool z_up)
{
    double a = azimuth * (M_PI / 180), b = elevation * (M_PI / 180);
    double right[3] = {cos(a), 0, -sin(a)};
    double up[3] = {-sin(a) * sin(b), cos(b), -cos(a) * sin(b)};
    double toward[3] = {sin(a) * cos(b), sin(b), cos(a) * cos(b)};
    to_mesh(right, z_up, c->right);
    to_mesh(up, z_up, c->up);
    to_mesh(toward, z_up, c->toward);
}

vgi_box vgi_box_empty(void)
{
    return (vgi_box){{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
}

static double along_axis(const float axis[3], const float p[3])
{
    return (double)axis[0] * p[0] + (double)axis[1] * p[1] + (double)axis[2] * p[2];
}

void vgi_camera_measure(const vgi_camera *c, const vgi_figure *g, const float *points, const double shift[2],
                        vgi_box *box)
{
    for (size_t v = 0; v < g->mesh->nv; v++) {
        if (!g->drawn[v]) continue;
        double seen[2] = {along_axis(c->right, points + 3 * v) - shift[0], along_axis(c->up, points + 3 * v) - shift[1]};
        for (int k = 0; k < 2; k++) {
            if (seen[k] < box->least[k]) box->least[k] = seen[k];
            if (seen[k] > box->most[k]) box->most[k] = seen[k];
        }
    }
}

void vgi_camera_fit(vgi_camera *c, const vgi_box *box, double margin)
{
    double w = box->most[0] - box->least[0], h = box->most[1] - box->least[1];
    double space = 2 * margin * fmin(c->width, c->height);
    c->scale = 1;
    c->x = c->y = 0;
    if (!(w >= 0 && h >= 0)) return; /* nothing to see */
    c->x = (box->least[0] + box->most[0]) / 2;
    c->y = (box->least[1] + box->most[1]) / 2;
    /* a single point, or flat within rounding: show one D */
    if (fmax(w, h) < 1e-6) w = h = 1;
    c->scale = fmin((c->width - space) / fmax(w, 1e-9), (c->height - space) / fmax(h, 1e-9));
}

void vgi_camera_project(const vgi_camera *c, const float *points, size_t nv, float *seen)
{
    for (size_t v = 0; v < nv; v++) {
        const float *p = points + 3 * v;
        seen[3 * v] = (float)((along_axis(c->right, p) - c->x) * c->scale + c->width / 2);
        seen[3 * v + 1] = (float)(c->height / 2 - (along_axis(c->up, p) - c->y) * c->scale);
        seen[3 * v + 2] = (float)(along_axis(c->toward, p) * c->scale);
    }
}
