/* plot.c: charts of curves and bars, drawn once as shapes, which become SVG or pixels.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "view/paint.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

enum { /* lengths in pixels */
    WIDTH = 900, HEIGHT = 340, /* of a chart */
    LEFT = 84, RIGHT = 24, TOP = 44, BOTTOM = 56,
    TICKS = 40,                /* most per axis */
    LETTER = 12                /* size of the font */
};
static const unsigned char ink[3] = {38, 42, 50}, soft[3] = {112, 118, 128}, faint[3] = {226, 229, 233};
/* distinguishable also by colour-blind people, and in grey */
static const unsigned char colours[VG_PLOT_SERIES][3] = {{31, 95, 168}, {216, 96, 20}, {90, 90, 90}, {20, 140, 110}, {150, 60, 140}, {190, 150, 10}};

enum anchor { START, MIDDLE, END };

typedef struct plot { /* target of shapes: the SVG text, or the canvas */
    bool svg;
    char *text;
    size_t size, room;
    vgi_canvas canvas;
    vg_err *e;
    int failed; /* VG_OK, or the first error */
} plot;

typedef struct axis {
    double least, most; /* in units; on a logarithmic axis powers of 10 */
    double from, to;    /* in pixels */
    bool log;
    size_t n;
    double tick[TICKS];
} axis;

/* ---- shapes ---- */

static void put_shape(plot *p, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put_shape(plot *p, const char *format, ...)
{
    char line[400];
    va_list list;
    va_start(list, format);
    int n = vsnprintf(line, sizeof line, format, list);
    va_end(list);
    size_t length = n < 0 ? 0 : (size_t)n < sizeof line ? (size_t)n : sizeof line - 1;
    if (p->failed < 0) return;
    p->failed = vgi_grow(&p->text, &p->room, p->size + length, 1, p->e);
    if (p->failed < 0) return;
    memcpy(p->text + p->size, line, length);
    p->size += length;
}

/* Tenths of a pixel, independent of the locale. */
static void print_tenths(double x, char to[VGI_NUMBER])
{
    vgi_print_number(to, VGI_NUMBER, "%.1f", x);
}

static void draw_line(plot *p, double x0, double y0, double x1, double y1, double width, const unsigned char c[3])
{
    char n[5][VGI_NUMBER];
    if (!p->svg) {
        vgi_paint_line(&p->canvas, (double[]){x0, y0}, (double[]){x1, y1}, width, c);
        return;
    }
    const double all[5] = {x0, y0, x1, y1, width};
    for (int i = 0; i < 5; i++) print_tenths(all[i], n[i]);
    put_shape(p, "<path d=\"M%s %sL%s %s\" stroke=\"#%02x%02x%02x\" stroke-width=\"%s\"/>\n", n[0], n[1], n[2], n[3], c[0], c[1], c[2], n[4]);
}

static void draw_bar(plot *p, double x0, double y0, double x1, double y1, const unsigned char c[3])
{
    char n[4][VGI_NUMBER];
    const double all[4] = {x0, y0, x1 - x0, y1 - y0};
    if (p->svg) {
        for (int i = 0; i < 4; i++) print_tenths(all[i], n[i]);
        put_shape(p, "<rect x=\"%s\" y=\"%s\" width=\"%s\" height=\"%s\" fill=\"#%02x%02x%02x\"/>\n", n[0], n[1], n[2], n[3], c[0], c[1], c[2]);
        return;
    }
    for (double y = floor(y0) + 0.5; y < y1; y++) vgi_paint_line(&p->canvas, (double[]){x0 + 0.5, y}, (double[]){x1 - 0.5, y}, 1.2, c);
}

/* A dot, also for a curve of one number. */
static void draw_dot(plot *p, double x, double y, double radius, const unsigned char c[3])
{
    char n[3][VGI_NUMBER];
    if (!p->svg) {
        vgi_paint_disc(&p->canvas, (double[]){x, y}, radius, c);
        return;
    }
    print_tenths(x, n[0]), print_tenths(y, n[1]), print_tenths(radius, n[2]);
    put_shape(p, "<circle cx=\"%s\" cy=\"%s\" r=\"%s\" fill=\"#%02x%02x%02x\"/>\n", n[0], n[1], n[2], c[0], c[1], c[2]);
}

/* Text as XML; control characters, which XML does not allow, become blanks. */
static void say_text(plot *p, const char *text)
{
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '&') put_shape(p, "&amp;");
        else if (c == '<') put_shape(p, "&lt;");
        else if (c == '>') put_shape(p, "&gt;");
        else put_shape(p, "%c", c < 32 || c == 127 ? ' ' : c);
    }
}

/* y: the baseline. */
static void draw_text(plot *p, double x, double y, enum anchor anchor, bool strong, const unsigned char c[3], const char *text)
{
    static const char *const anchors[] = {"start", "middle", "end"};
    char n[2][VGI_NUMBER];
    if (!p->svg) {
        double share = anchor == MIDDLE ? 0.5 : anchor == END ? 1 : 0;
        vgi_text(&p->canvas, x, y, &(vgi_lettering){c, strong ? 1.2 * LETTER : LETTER, share, 0}, text);
        return;
    }
    print_tenths(x, n[0]), print_tenths(y, n[1]);
    put_shape(p, "<text x=\"%s\" y=\"%s\" text-anchor=\"%s\" fill=\"#%02x%02x%02x\"%s>", n[0], n[1], anchors[anchor], c[0], c[1], c[2],
        strong ? " font-weight=\"bold\"" : "");
    say_text(p, text);
    put_shape(p, "</text>\n");
}

/* ---- axes ---- */

static double at(const axis *a, double x)
{
    double share = ((a->log ? log10(x) : x) - a->least) / (a->most - a->least);
    return a->from + share * (a->to - a->from);
}

static void widen_axis(axis *a, double x)
{
    if (a->log && !(x > 0)) return;
    double place = a->log ? log10(x) : x;
    a->least = fmin(a->least, place);
    a->most = fmax(a->most, place);
}

/* 1, 2 or 5 times a power of 10, so that there are about `want` steps. */
static double step_of(double range, double want)
{
    double power = pow(10, floor(log10(range / want))), rest = range / want / power;
    return power * (rest < 1.5 ? 1 : rest < 3.5 ? 2 : rest < 7.5 ? 5 : 10);
}

/* Ends and ticks: on a linear axis multiples of the step; on a logarithmic one powers of 10, with 2 and 5 if there
 * are few. */
static void end_axis(axis *a, bool to_zero, double want)
{
    if (!(a->least <= a->most)) a->least = 0, a->most = 1;
    if (to_zero && !a->log) a->least = fmin(a->least, 0);
    if (a->most - a->least < 1e-12 * fmax(fabs(a->most), 1e-300)) a->most = a->least + (a->log || a->least == 0 ? 1 : fabs(a->least));
    double step = step_of(a->most - a->least, want);
    if (a->log) {
        bool few = a->most - a->least < 3;
        step = fmax(1, round(step));
        if (!few) a->least = floor(a->least + 1e-9), a->most = ceil(a->most - 1e-9);
        static const double parts[] = {1, 2, 5};
        for (double k = floor(a->least); k <= a->most + 1e-9; k += step)
            for (int i = 0; i < (few ? 3 : 1) && a->n < TICKS; i++) {
                double place = k + log10(parts[i]);
                if (place >= a->least - 1e-9 && place <= a->most + 1e-9) a->tick[a->n++] = pow(10, place);
            }
        return;
    }
    if (to_zero) a->most = step * ceil(a->most / step - 1e-9);
    for (double k = ceil(a->least / step - 1e-9); k * step <= a->most + 1e-9 * step && a->n < TICKS; k++) a->tick[a->n++] = k * step + 0.0; /* not -0 */
}

static void fit_axes(const vg_chart *c, axis *x, axis *y)
{
    for (size_t s = 0; s < c->n; s++) {
        const vg_series *v = c->series + s;
        for (size_t i = 0; i < v->n + (c->bars && v->n > 0); i++) widen_axis(x, v->x ? v->x[i] : (double)i);
        for (size_t i = 0; i < v->n; i++) widen_axis(y, v->y[i]);
    }
    end_axis(x, false, 10);
    end_axis(y, true, 5);
}

static void draw_axes(plot *p, const vg_chart *c, const axis *x, const axis *y, double top)
{
    char label[VGI_NUMBER];
    for (size_t i = 0; i < y->n; i++) {
        double h = at(y, y->tick[i]);
        draw_line(p, x->from, h, x->to, h, 1, faint);
        vgi_print_number(label, sizeof label, "%.4g", y->tick[i]);
        draw_text(p, x->from - 8, h + 4, END, false, soft, label);
    }
    for (size_t i = 0; i < x->n; i++) {
        double w = at(x, x->tick[i]);
        draw_line(p, w, y->from, w, y->from + 5, 1, soft);
        vgi_print_number(label, sizeof label, "%.6g", x->tick[i]);
        draw_text(p, w, y->from + 20, MIDDLE, false, soft, label);
    }
    draw_line(p, x->from, y->from, x->to, y->from, 1.2, soft);
    draw_text(p, (x->from + x->to) / 2, y->from + 42, MIDDLE, false, ink, c->x);
    draw_text(p, LEFT, top + 34, START, false, soft, c->y);
    draw_text(p, LEFT, top + 16, START, true, ink, c->title);
}

/* ---- contents ---- */

static bool drawable(const vg_series *v, size_t i, const axis *x, const axis *y)
{
    return (!y->log || v->y[i] > 0) && (!x->log || (v->x ? v->x[i] > 0 : i > 0));
}

static void draw_curve(plot *p, const vg_series *v, const axis *x, const axis *y, const unsigned char colour[3])
{
    for (size_t i = 0; i < v->n; i++) {
        double now = v->x ? v->x[i] : (double)i;
        bool before = i > 0 && drawable(v, i - 1, x, y), behind = i + 1 < v->n && drawable(v, i + 1, x, y);
        if (!drawable(v, i, x, y)) continue;
        if (before) draw_line(p, at(x, v->x ? v->x[i - 1] : (double)(i - 1)), at(y, v->y[i - 1]), at(x, now), at(y, v->y[i]), 1.8, colour);
        if (!before && !behind) draw_dot(p, at(x, now), at(y, v->y[i]), 3, colour);
    }
}

static void draw_bars(plot *p, const vg_series *v, const axis *x, const axis *y, const unsigned char colour[3])
{
    for (size_t i = 0; i < v->n; i++)
        if (v->y[i] > 0) draw_bar(p, at(x, v->x[i]) + 0.5, at(y, v->y[i]), at(x, v->x[i + 1]) - 0.5, y->from, colour);
}

/* Names to the right of the title, the last one at the edge; widths are those of the font of PNG pictures. */
static void draw_legend(plot *p, const vg_chart *c, double top)
{
    double left = WIDTH - RIGHT;
    for (size_t s = c->n; s-- > 0; left -= 46) {
        left -= vgi_text_width(p->canvas.font, LETTER, c->series[s].name);
        draw_text(p, left, top + 34, START, false, ink, c->series[s].name);
        draw_line(p, left - 26, top + 30, left - 8, top + 30, 3, colours[s]);
    }
}

static void draw_chart(plot *p, const vg_chart *c, double top)
{
    axis x = {.least = INFINITY, .most = -INFINITY, .from = LEFT, .to = WIDTH - RIGHT, .log = c->log_x};
    axis y = {.least = INFINITY, .most = -INFINITY, .from = top + HEIGHT - BOTTOM, .to = top + TOP, .log = c->log_y};
    fit_axes(c, &x, &y);
    draw_axes(p, c, &x, &y, top);
    for (size_t s = 0; s < c->n; s++) {
        if (c->bars) draw_bars(p, c->series + s, &x, &y, colours[s]);
        else draw_curve(p, c->series + s, &x, &y, colours[s]);
    }
    if (!c->bars) draw_legend(p, c, top);
}

static int write_png(const plot *p, int fd, const char *name, vg_err *e)
{
    vgi_png *png;
    int r = vgi_png_open(&png, fd, name, p->canvas.w, p->canvas.h, e);
    if (r < 0) return r;
    r = vgi_png_rows(png, p->canvas.rgb, p->canvas.h, e);
    if (r >= 0) r = vgi_png_end(png, e);
    vgi_png_close(&png);
    return r;
}

int vg_plot_write(const vg_chart *charts, size_t n, bool svg, int fd, const char *name, vg_err *e)
{
    if (n < 1 || n > VG_PLOT_CHARTS) return vg_fail(e, VG_EARG, "a plot has 1 to %d charts, not %zu", VG_PLOT_CHARTS, n);
    for (size_t i = 0; i < n; i++)
        if (charts[i].n > VG_PLOT_SERIES || (charts[i].bars && charts[i].n > 1))
            return vg_fail(e, VG_EARG, "a chart has at most %d curves, or one row of bars", VG_PLOT_SERIES);
    plot p = {.svg = svg, .e = e};
    int r = vgi_canvas_init(&p.canvas, WIDTH, n * HEIGHT, e); /* of an SVG only the font is used */
    if (r < 0) goto out;
    if (svg)
        put_shape(&p, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%zu\" viewBox=\"0 0 %d %zu\" "
            "font-family=\"sans-serif\" font-size=\"%d\" fill=\"none\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
            WIDTH, p.canvas.h, WIDTH, p.canvas.h, LETTER);
    for (size_t i = 0; i < n; i++) draw_chart(&p, charts + i, (double)(i * HEIGHT));
    if (svg) put_shape(&p, "</svg>\n");
    r = p.failed < 0 ? p.failed : vgi_font_check(p.canvas.font, e);
    if (r == VG_OK) r = svg ? vgi_write_all(fd, p.text, p.size, name, e) : write_png(&p, fd, name, e);
out:
    free(p.text);
    vgi_canvas_clear(&p.canvas);
    return r;
}
