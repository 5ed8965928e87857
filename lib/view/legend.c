/* legend.c: the colour bar with its numbers, and the lines of text around it. The sheet decides where it is.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>

enum { BAR_WIDTH = 420, BAR_HEIGHT = 14 };
static const double size = 12; /* of the font, in pixels */
static const unsigned char ink[3] = {38, 42, 50}, soft_ink[3] = {112, 118, 128};

static double number_at(const vgi_tint *t, double share)
{
    return t->shown_low + (t->shown_high - t->shown_low) * share;
}

static void put_bar(vgi_canvas *c, const vgi_tint *t, const vgi_palette *p, size_t x, size_t y, size_t w)
{
    for (size_t j = 0; j < BAR_HEIGHT; j++)
        for (size_t i = 0; i < w; i++) {
            double place = vgi_tint_place(t, number_at(t, w > 1 ? (double)i / (double)(w - 1) : 0));
            const float *colour = p->map[(size_t)(place * (VGI_MAP_STEPS - 1) + 1e-6)];
            unsigned char *to = c->rgb + 3 * ((y + j) * c->w + x + i);
            for (int k = 0; k < 3; k++) to[k] = vgi_encode(p, colour[k]);
        }
}

/* As many numbers under the bar as fit; a diverging map has a number in its middle. */
static void put_ticks(vgi_canvas *c, const vgi_tint *t, size_t x, size_t y, size_t w)
{
    size_t parts = w >= 330 ? (t->diverging ? 4 : 5) : w >= 170 ? 2 : 1;
    for (size_t i = 0; i <= parts; i++) {
        char text[VGI_NUMBER];
        double share = (double)i / (double)parts, at = (double)x + (double)(w - 1) * share;
        vgi_tint_number(t, number_at(t, share), text);
        for (size_t j = 0; j < 4; j++) memcpy(c->rgb + 3 * ((y + j) * c->w + (size_t)at), soft_ink, 3);
        double width = vgi_text_width(c->font, size, text), left = fmax(at - width / 2, (double)x);
        vgi_text(c, fmin(left, (double)(x + w) - width), (double)y + 16, &(vgi_lettering){ink, size, 0, 0}, text);
    }
}

void vgi_legend(vgi_canvas *c, const vgi_tint *t, const vgi_palette *p, size_t margin, const char *title,
                const char *note)
{
    size_t room = c->w - 2 * margin, w = room < BAR_WIDTH ? room : BAR_WIDTH;
    vgi_text(c, (double)margin, 13, &(vgi_lettering){ink, size, 0, (double)room}, title);
    put_bar(c, t, p, margin, 20, w);
    put_ticks(c, t, margin, 20 + BAR_HEIGHT, w);
    vgi_text(c, (double)margin, 20 + BAR_HEIGHT + 33, &(vgi_lettering){soft_ink, size, 0, (double)room}, note);
}
