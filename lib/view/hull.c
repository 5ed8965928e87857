/* hull.c: the outermost points of a sequence in 26 directions, over all frames: enough to fit a camera
 * (page_draw.js).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/page.h"
#include "numeric/vec3.h"

#include <math.h>

/* The axes, the diagonals of the faces and those of a cube; the other 13 directions are their opposites. */
static const signed char directions[VGI_HULL / 2][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 1, 0}, {1, -1, 0},
                                                        {1, 0, 1},  {1, 0, -1}, {0, 1, 1},  {0, 1, -1},
                                                        {1, 1, 1},  {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};

static double along_direction(size_t i, const double p[3])
{
    return directions[i][0] * p[0] + directions[i][1] * p[1] + directions[i][2] * p[2];
}

/* Store one of the points if it lies further out in direction i of 26. */
static void extend(vgi_hull *h, size_t i, double reach, const double p[3], const double centre[3])
{
    if (h->n && !(reach > h->reach[i])) return;
    h->reach[i] = reach;
    vgi_subtract(p, centre, h->at[i]);
}

void vgi_hull_add(vgi_hull *h, const double *points, const bool *drawn, size_t nv, const double centre[3])
{
    for (size_t i = 0; i < VGI_HULL / 2; i++) {
        double shift = along_direction(i, centre), least = INFINITY, most = -INFINITY;
        size_t first = 0, last = 0;
        for (size_t v = 0; v < nv; v++) {
            double x = along_direction(i, points + 3 * v);
            if (drawn[v] && x < least) least = x, first = v;
            if (drawn[v] && x > most) most = x, last = v;
        }
        if (!(least <= most)) return; /* nothing is drawn */
        extend(h, i, most - shift, points + 3 * last, centre);
        extend(h, i + VGI_HULL / 2, shift - least, points + 3 * first, centre);
    }
    h->n = VGI_HULL;
}
