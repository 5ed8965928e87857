/* sheet.c: the contact sheet: takes frames, chooses, draws them row by row and puts captions and a legend to them.
 * Leaves out how a pose becomes pixels (raster.c, shade.c) and how pixels become a file (png.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>
#include <stdio.h>

enum {
    MARGIN = 16,      /* around and between pictures, in pixels */
    CAPTION = 22,     /* below a picture */
    NUMBERS = 18,     /* below the caption, when comparing */
    LEGEND = 74,      /* at the bottom, when comparing */
    BAR_WIDTH = 420, BAR_HEIGHT = 14,
    FOOTER = 24,      /* at the bottom, with a ground */
    TEXT_BYTES = 512,
    LEAST_SIDE = 16, MOST_SIDE = 4096,
    WIDE_SIDE = 1536, /* a picture larger than this has 2 x 2 samples in a pixel instead of 3 x 3 */
};

/* Errors below this are rounding; the colours of the legend never end before it. In D. */
#define LEAST_SCALE 1e-9
/* What is farther away than this cannot be drawn together with the figure. In D. */
#define MOST_DISTANCE 1e9

static const double caption_dot = 1.5, small_dot = 1.25;
static const unsigned char page[3] = {255, 255, 255}, ink[3] = {38, 42, 50}, soft_ink[3] = {112, 118, 128};

struct vg_sheet {
    vg_sheet_options o;
    vgi_figure figure;
    vgi_album album;
    vgi_palette palette;
    double origin[3], unit;      /* points are kept as (p - origin) / unit */
    double diagonal;             /* D; 0 for a figure that is a point, and then unit is 1 */
    double ground_height;        /* in D, along the vertical */
    size_t n, columns, oversampling;
    double scale, largest;       /* of the colours; the largest error shown, in D */
    size_t largest_shot;
    vgi_camera camera;
};

/* ---- taking frames ---- */

static int check_options(const vg_sheet_options *o, vg_err *e)
{
    if (o->frames < 1 || o->frames > 1000000)
        return vg_fail(e, VG_EARG, "a sheet needs between 1 and 1000000 frames");
    if (o->width < LEAST_SIDE || o->width > MOST_SIDE || o->height < LEAST_SIDE || o->height > MOST_SIDE)
        return vg_fail(e, VG_EARG, "a picture of %zu x %zu pixels is not possible: %d to %d each way", o->width,
                       o->height, LEAST_SIDE, MOST_SIDE);
    if (!(o->scale >= 0 && o->scale < INFINITY) || !isfinite(o->azimuth) || !isfinite(o->elevation))
        return vg_fail(e, VG_EARG, "scale, azimuth and elevation must be numbers, and the scale not negative");
    return VG_OK;
}

static void measure_reference(vg_sheet *s, const double *reference, size_t nv)
{
    s->diagonal = vg_diagonal(reference, nv);
    s->unit = s->diagonal > 0 ? s->diagonal : 1;
    vg_centroid(reference, nv, s->origin);
    int vertical = s->o.z_up ? 2 : 1;
    double least = INFINITY;
    for (size_t v = 0; v < nv; v++)
        if (s->figure.drawn[v]) least = fmin(least, reference[3 * v + (size_t)vertical]);
    s->ground_height = isfinite(least) ? (least - s->origin[vertical]) / s->unit : 0;
}

int vg_sheet_new(vg_sheet **out, const vg_mesh *m, const double *reference, const vg_sheet_options *o, vg_err *e)
{
    *out = NULL;
    int r = check_options(o, e);
    if (r < 0) return r;
    vg_sheet *s = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->o = *o;
    r = vgi_figure_init(&s->figure, m, e);
    if (r == VG_OK) r = vgi_album_init(&s->album, m->nv, o->frames, o->compare, e);
    if (r < 0) {
        vg_sheet_free(&s);
        return r;
    }
    measure_reference(s, reference, m->nv);
    *out = s;
    return VG_OK;
}

void vg_sheet_free(vg_sheet **address)
{
    vg_sheet *s = *address;
    if (!s) return;
    vgi_album_clear(&s->album);
    vgi_figure_clear(&s->figure);
    free(s);
    *address = NULL;
}

static int keep_points(const vg_sheet *s, vgi_shot *shot, const double *vertices, vg_err *e)
{
    for (size_t i = 0; i < 3 * s->album.nv; i++) {
        double x = (vertices[i] - s->origin[i % 3]) / s->unit;
        if (!(fabs(x) < MOST_DISTANCE))
            return vg_fail(e, VG_EINPUT, "vertex %zu of frame '%s' is too far away to be drawn", i / 3, shot->name);
        shot->points[i] = (float)x;
    }
    return VG_OK;
}

static void keep_errors(const vg_sheet *s, vgi_shot *shot, const double *vertices, const double *truth)
{
    size_t nv = s->album.nv;
    double shift[3] = {0, 0, 0}, a[3], b[3], sum = 0;
    if (s->o.centred) {
        vg_centroid(vertices, nv, a);
        vg_centroid(truth, nv, b);
        for (int k = 0; k < 3; k++) shift[k] = a[k] - b[k];
    }
    shot->max = 0;
    for (size_t v = 0; v < nv; v++) {
        double d[3];
        for (size_t k = 0; k < 3; k++) d[k] = (vertices[3 * v + k] - truth[3 * v + k] - shift[k]) / s->unit;
        double error = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        shot->errors[v] = (float)error;
        shot->max = fmax(shot->max, error);
        sum += error;
    }
    shot->mean = nv ? sum / (double)nv : 0;
}

int vg_sheet_add(vg_sheet *s, const char *name, const double *vertices, const double *truth, vg_err *e)
{
    vgi_shot *shot;
    int r = vgi_album_next(&s->album, &shot, e);
    if (r < 0) return r;
    free(shot->name);
    shot->name = vgi_copy_string(name, strlen(name), e);
    if (!shot->name) return VG_ENOMEM;
    r = keep_points(s, shot, vertices, e);
    if (r == VG_OK && s->o.compare) keep_errors(s, shot, vertices, truth);
    return r;
}

/* ---- the scale of the colours ---- */

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* The next of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten: five parts of it have short numbers. */
static double round_up(double x)
{
    static const double steps[] = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10};
    double power = pow(10, floor(log10(x)));
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++)
        if (steps[i] * power >= x * (1 - 1e-9)) return steps[i] * power;
    return 10 * power;
}

/* The error that 99 % of the vertices seen do not exceed, over all shots. */
static int find_percentile(const vg_sheet *s, double *error, vg_err *e)
{
    size_t seen = 0, total, n = 0;
    for (size_t v = 0; v < s->album.nv; v++) seen += s->figure.drawn[v];
    *error = 0;
    if (!vgi_mul(seen, s->n, &total)) total = SIZE_MAX; /* vgi_array_raw says that it is too much */
    if (total == 0) return VG_OK;
    float *all = vgi_array_raw(total, sizeof *all, e);
    if (!all) return VG_ENOMEM;
    for (size_t i = 0; i < s->n; i++)
        for (size_t v = 0; v < s->album.nv; v++)
            if (s->figure.drawn[v]) all[n++] = s->album.at[i].errors[v];
    qsort(all, n, sizeof *all, compare_floats);
    *error = all[(size_t)ceil(0.99 * (double)n) - 1];
    if (!(*error > 0)) *error = all[n - 1]; /* nearly all are exact: show those that are not */
    free(all);
    return VG_OK;
}

static int choose_scale(vg_sheet *s, vg_err *e)
{
    for (size_t i = 0; i < s->n; i++)
        if (s->album.at[i].max > s->largest) s->largest = s->album.at[i].max, s->largest_shot = i;
    s->scale = s->o.scale;
    if (s->scale > 0) return VG_OK;
    double error;
    int r = find_percentile(s, &error, e);
    s->scale = error > LEAST_SCALE ? round_up(error) : LEAST_SCALE;
    return r;
}

/* ---- layout ---- */

static size_t caption_height(const vg_sheet *s)
{
    return CAPTION + (s->o.compare ? NUMBERS : 0);
}

/* Near to 16 : 9, and few holes in the last row. */
static size_t choose_columns(const vg_sheet *s)
{
    size_t best = 1;
    double least = INFINITY, w = (double)(s->o.width + MARGIN),
           h = (double)(s->o.height + caption_height(s) + MARGIN);
    for (size_t c = 1; c <= s->n; c++) {
        size_t rows = (s->n + c - 1) / c;
        double shape = fabs(log((double)c * w / ((double)rows * h) / (16.0 / 9)));
        double cost = shape + 1.5 * (double)(rows * c - s->n) / (double)s->n;
        if (cost < least) least = cost, best = c;
    }
    return best;
}

/* The middle of the picture of one shot, when the camera follows: its centroid. */
static void shot_middle(const vg_sheet *s, const vgi_shot *shot, double middle[2])
{
    double sum[3] = {0, 0, 0};
    size_t n = 0;
    for (size_t v = 0; v < s->album.nv; v++) {
        if (!s->figure.drawn[v]) continue;
        for (size_t k = 0; k < 3; k++) sum[k] += shot->points[3 * v + k];
        n++;
    }
    middle[0] = middle[1] = 0;
    for (int k = 0; k < 3 && n; k++) {
        middle[0] += s->camera.right[k] * sum[k] / (double)n;
        middle[1] += s->camera.up[k] * sum[k] / (double)n;
    }
}

/* One scale for all, so that sizes compare; also the place, unless the camera follows. */
static void place_camera(vg_sheet *s)
{
    vgi_box box = vgi_box_empty();
    vgi_camera_turn(&s->camera, s->o.azimuth, s->o.elevation, s->o.z_up);
    s->camera.width = (double)(s->o.width * s->oversampling);
    s->camera.height = (double)(s->o.height * s->oversampling);
    for (size_t i = 0; i < s->n; i++) {
        double middle[2] = {0, 0};
        if (s->o.follow) shot_middle(s, s->album.at + i, middle);
        vgi_camera_measure(&s->camera, &s->figure, s->album.at[i].points, middle, &box);
    }
    vgi_camera_fit(&s->camera, &box, 0.06);
}

/* ---- pictures ---- */

typedef struct row { /* of pictures that are drawn at the same time */
    const vg_sheet *s;
    size_t first;
    unsigned char **rgb; /* one picture each */
    vg_err *err;
} row;

static double nice_spacing(const vg_sheet *s)
{
    double want = 0.14 * s->unit, power = pow(10, floor(log10(want)));
    return (want / power < 1.5 ? 1 : want / power < 3.5 ? 2 : want / power < 7.5 ? 5 : 10) * power;
}

/* The grid lies round the feet of all shots, or of this one when the camera follows it. */
static void place_ground(const vg_sheet *s, size_t shot, vgi_ground *g)
{
    *g = (vgi_ground){.height = s->ground_height, .spacing = nice_spacing(s) / s->unit, .across = {1, 0, 0}};
    g->vertical[s->o.z_up ? 2 : 1] = 1;
    g->along[s->o.z_up ? 1 : 2] = s->o.z_up ? -1 : 1;
    vgi_camera above = {0};
    for (int k = 0; k < 3; k++) above.right[k] = (float)g->across[k], above.up[k] = (float)g->along[k];
    vgi_box box = vgi_box_empty();
    for (size_t i = s->o.follow ? shot : 0; i < (s->o.follow ? shot + 1 : s->n); i++)
        vgi_camera_measure(&above, &s->figure, s->album.at[i].points, (double[2]){0, 0}, &box);
    for (int k = 0; k < 2; k++) g->middle[k] = (box.least[k] + box.most[k]) / 2;
    g->reach = 0.45 + 0.5 * hypot(box.most[0] - box.least[0], box.most[1] - box.least[1]);
}

static int draw_shot(const vg_sheet *s, size_t i, unsigned char *rgb, vg_err *e)
{
    const vgi_shot *shot = s->album.at + i;
    size_t nv = s->album.nv;
    double side = fmin(s->camera.width, s->camera.height), pixel = (double)s->oversampling;
    vgi_camera camera = s->camera;
    vgi_raster raster = {0};
    vgi_ground ground = {0};
    float *values = NULL;
    int r = VG_OK;
    if (s->o.follow) {
        double middle[2];
        shot_middle(s, shot, middle);
        camera.x += middle[0], camera.y += middle[1];
    }
    if (s->o.compare) {
        values = vgi_array_raw(nv, sizeof *values, e);
        if (!values) return VG_ENOMEM;
        for (size_t v = 0; v < nv; v++) values[v] = fminf((float)(shot->errors[v] / s->scale), 1);
    }
    const vg_patches *patches = s->o.compare ? NULL : s->o.patches;
    vgi_drawing drawing = {.figure = &s->figure, .camera = &camera, .points = shot->points, .values = values,
                           .patches = patches ? patches->of_face : NULL, .wire = (float)(0.9 * pixel),
                           .edge = s->o.edges ? (float)(0.45 * pixel) : 0};
    vgi_look look = {.palette = &s->palette, .errors = s->o.compare, .patches = patches != NULL,
                     .oversampling = s->oversampling, .edge_strength = 0.5f, .outline = (float)(0.02 * side),
                     .reach = (float)(0.07 * side)};
    if (s->o.ground && s->figure.mesh->nv > 0) {
        place_ground(s, i, &ground);
        r = vgi_ground_shadow(&ground, &drawing, e);
        look.ground = &ground;
    }
    if (r == VG_OK) r = vgi_raster_init(&raster, (size_t)camera.width, (size_t)camera.height, e);
    if (r == VG_OK) r = vgi_draw(&raster, &drawing, e);
    if (r == VG_OK) r = vgi_shade(&look, &raster, &camera, rgb, e);
    vgi_raster_clear(&raster);
    free(ground.shadow);
    free(values);
    return r;
}

static void draw_task(void *context, size_t i)
{
    row *k = context;
    k->err[i].code = draw_shot(k->s, k->first + i, k->rgb[i], k->err + i);
}

/* ---- the page ---- */

/* A number as people write it, whatever the locale. */
static void print_number(char *to, size_t size, const char *format, double x)
{
    snprintf(to, size, format, x);
    for (; *to; to++)
        if (*to == ',') *to = '.';
}

static void clear_canvas(vgi_canvas *c)
{
    for (size_t i = 0; i < c->w * c->h; i++) memcpy(c->rgb + 3 * i, page, 3);
}

static void centre_text(vgi_canvas *c, double middle, double y, double dot, const unsigned char colour[3],
                        const char *text)
{
    vgi_text(c, floor(middle - vgi_text_width(dot, text) / 2), y, dot, colour, text);
}

static void paste(vgi_canvas *c, size_t x, size_t y, const unsigned char *rgb, size_t w, size_t h)
{
    for (size_t j = 0; j < h; j++) memcpy(c->rgb + 3 * ((y + j) * c->w + x), rgb + 3 * j * w, 3 * w);
}

/* The name of a frame, or its number when it has none. */
static void print_label(char *to, size_t size, const vgi_shot *shot)
{
    if (*shot->name)
        snprintf(to, size, "%s", shot->name);
    else
        snprintf(to, size, "frame %zu", shot->index);
}

static void put_caption(const vg_sheet *s, vgi_canvas *c, size_t x, const vgi_shot *shot)
{
    char text[TEXT_BYTES], number[TEXT_BYTES], mean[32], max[32];
    double middle = (double)x + (double)s->o.width / 2, y = (double)s->o.height + 8;
    print_label(number, sizeof number, shot);
    vgi_text_fit(text, sizeof text, caption_dot, (double)s->o.width, number);
    centre_text(c, middle, y, caption_dot, ink, text);
    if (!s->o.compare) return;
    print_number(mean, sizeof mean, "%.3g", shot->mean);
    print_number(max, sizeof max, "%.3g", shot->max);
    snprintf(number, sizeof number, "mean %s  max %s", mean, max);
    vgi_text_fit(text, sizeof text, small_dot, (double)s->o.width, number);
    centre_text(c, middle, y + CAPTION - 4, small_dot, soft_ink, text);
}

static void put_bar(const vg_sheet *s, vgi_canvas *c, size_t x, size_t y, size_t w)
{
    for (size_t j = 0; j < BAR_HEIGHT; j++)
        for (size_t i = 0; i < w; i++) {
            const float *colour = s->palette.map[w > 1 ? i * (VGI_MAP_STEPS - 1) / (w - 1) : 0];
            unsigned char *p = c->rgb + 3 * ((y + j) * c->w + x + i);
            for (int k = 0; k < 3; k++) p[k] = vgi_encode(&s->palette, colour[k]);
        }
}

/* Under the bar as many numbers as there is room for: six, three or the two ends. */
static void put_ticks(const vg_sheet *s, vgi_canvas *c, size_t x, size_t y, size_t w)
{
    size_t parts = w >= 330 ? 5 : w >= 170 ? 2 : 1;
    for (size_t i = 0; i <= parts; i++) {
        char text[32];
        double at = (double)x + (double)(w - 1) * (double)i / (double)parts;
        print_number(text, sizeof text, "%.3g", s->scale * (double)i / (double)parts);
        for (size_t j = 0; j < 4; j++) memcpy(c->rgb + 3 * ((y + j) * c->w + (size_t)at), soft_ink, 3);
        double left = fmax(at - vgi_text_width(small_dot, text) / 2, (double)x);
        left = fmin(left, (double)(x + w) - vgi_text_width(small_dot, text));
        vgi_text(c, floor(left), (double)y + 7, small_dot, ink, text);
    }
}

static void put_legend(const vg_sheet *s, vgi_canvas *c)
{
    char text[TEXT_BYTES], number[2 * TEXT_BYTES], label[TEXT_BYTES], largest[32], diagonal[32];
    size_t room = c->w - 2 * MARGIN, w = room < BAR_WIDTH ? room : BAR_WIDTH;
    print_number(largest, sizeof largest, "%.3g", s->largest);
    print_number(diagonal, sizeof diagonal, "%.4g", s->diagonal);
    if (s->diagonal > 0)
        snprintf(number, sizeof number, "vertex error%s in units of D = %s (diagonal of the reference)",
                 s->o.centred ? ", centred," : "", diagonal);
    else
        snprintf(number, sizeof number, "vertex error%s", s->o.centred ? ", centred" : "");
    vgi_text_fit(text, sizeof text, small_dot, (double)room, number);
    vgi_text(c, MARGIN, 4, small_dot, ink, text);
    put_bar(s, c, MARGIN, 20, w);
    put_ticks(s, c, MARGIN, 20 + BAR_HEIGHT, w);
    print_label(label, sizeof label, s->album.at + s->largest_shot);
    const char *end = s->o.scale > 0 ? "given" : "99% of the vertices shown are below";
    snprintf(number, sizeof number, "end of the colours: %s; largest %s in '%s'", end, largest, label);
    vgi_text_fit(text, sizeof text, small_dot, (double)room, number);
    vgi_text(c, MARGIN, 20 + BAR_HEIGHT + 24, small_dot, soft_ink, text);
}

static void put_footer(const vg_sheet *s, vgi_canvas *c)
{
    char text[TEXT_BYTES], line[TEXT_BYTES], spacing[32];
    print_number(spacing, sizeof spacing, "%.3g", nice_spacing(s));
    snprintf(line, sizeof line, "grid lines are %s apart", spacing);
    vgi_text_fit(text, sizeof text, small_dot, (double)(c->w - 2 * MARGIN), line);
    vgi_text(c, MARGIN, 4, small_dot, soft_ink, text);
}

/* ---- the sheet ---- */

typedef struct press {
    vgi_png *png;
    vgi_canvas canvas;
    row row;
} press;

static size_t footer_height(const vg_sheet *s)
{
    return (s->o.compare ? LEGEND : 0) + (s->o.ground ? FOOTER : 0);
}

static int open_press(press *p, const vg_sheet *s, int fd, const char *name, vg_err *e)
{
    size_t rows = (s->n + s->columns - 1) / s->columns, line = s->o.height + caption_height(s) + MARGIN;
    size_t w = s->columns * (s->o.width + MARGIN) + MARGIN, h = MARGIN + rows * line + footer_height(s);
    int r = vgi_png_open(&p->png, fd, name, w, h, e);
    if (r < 0) return r;
    p->canvas = (vgi_canvas){w, line > LEGEND ? line : LEGEND, NULL};
    p->canvas.rgb = vgi_array_raw(p->canvas.w * p->canvas.h, 3, e); /* both below 2^20 */
    p->row = (row){.s = s, .rgb = vgi_array(s->columns, sizeof *p->row.rgb, e),
                   .err = vgi_array(s->columns, sizeof *p->row.err, e)};
    if (!p->canvas.rgb || !p->row.rgb || !p->row.err) return VG_ENOMEM;
    for (size_t i = 0; i < s->columns; i++)
        if (!(p->row.rgb[i] = vgi_array_raw(s->o.width * s->o.height, 3, e))) return VG_ENOMEM;
    return VG_OK;
}

static void close_press(press *p, size_t columns)
{
    vgi_png_close(&p->png);
    for (size_t i = 0; p->row.rgb && i < columns; i++) free(p->row.rgb[i]);
    free(p->row.rgb);
    free(p->row.err);
    free(p->canvas.rgb);
}

static int print_row(press *p, const vg_sheet *s, size_t first, vg_err *e)
{
    size_t n = s->n - first < s->columns ? s->n - first : s->columns;
    p->row.first = first;
    vgi_parallel(s->o.threads, n, draw_task, &p->row);
    clear_canvas(&p->canvas);
    for (size_t i = 0; i < n; i++) {
        size_t x = MARGIN + i * (s->o.width + MARGIN);
        if (p->row.err[i].code < 0) {
            if (e) *e = p->row.err[i];
            return p->row.err[i].code;
        }
        paste(&p->canvas, x, 0, p->row.rgb[i], s->o.width, s->o.height);
        put_caption(s, &p->canvas, x, s->album.at + first + i);
    }
    return vgi_png_rows(p->png, p->canvas.rgb, s->o.height + caption_height(s) + MARGIN, e);
}

static int print_sheet(press *p, const vg_sheet *s, vg_err *e)
{
    clear_canvas(&p->canvas);
    int r = vgi_png_rows(p->png, p->canvas.rgb, MARGIN, e);
    for (size_t first = 0; r == VG_OK && first < s->n; first += s->columns) r = print_row(p, s, first, e);
    if (r == VG_OK && s->o.ground) {
        clear_canvas(&p->canvas);
        put_footer(s, &p->canvas);
        r = vgi_png_rows(p->png, p->canvas.rgb, FOOTER, e);
    }
    if (r == VG_OK && s->o.compare) {
        clear_canvas(&p->canvas);
        put_legend(s, &p->canvas);
        r = vgi_png_rows(p->png, p->canvas.rgb, LEGEND, e);
    }
    return r == VG_OK ? vgi_png_end(p->png, e) : r;
}

int vg_sheet_write(vg_sheet *s, int fd, const char *name, vg_err *e)
{
    s->n = vgi_album_close(&s->album);
    if (s->n == 0) return vg_fail(e, VG_EINPUT, "there is no frame to be drawn");
    s->oversampling = s->o.width > WIDE_SIDE || s->o.height > WIDE_SIDE ? 2 : 3;
    s->columns = s->o.columns ? (s->o.columns < s->n ? s->o.columns : s->n) : choose_columns(s);
    vgi_palette_init(&s->palette);
    int r = s->o.compare ? choose_scale(s, e) : VG_OK;
    if (r < 0) return r;
    place_camera(s);
    press p = {0};
    r = open_press(&p, s, fd, name, e);
    if (r == VG_OK) r = print_sheet(&p, s, e);
    close_press(&p, s->columns);
    return r;
}
