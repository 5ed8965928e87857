/* sheet.c: the contact sheet: collects frames of one or more sequences, chooses those to show, draws them row by row,
 * and adds captions and a legend. Rasterisation is in raster.c and shade.c, colours in tint.c, the file format in
 * png.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/sheet.h"

#include <math.h>
#include <stdio.h>

static const double title_size = 17, caption_size = 14, small_size = 12; /* of the font, in pixels */
static const unsigned char ink[3] = {38, 42, 50}, soft_ink[3] = {112, 118, 128};

/* Points further away than this, in D, cannot be drawn together with the figure. */
#define MOST_DISTANCE 1e9
/* Sequences whose diagonals differ by less than this factor share one scale. */
#define ONE_SCALE 2

/* ---- collecting frames ---- */

static int check_options(const vg_sheet_options *o, vg_err *e)
{
    if (o->frames < 1 || o->frames > 1000000)
        return vg_fail(e, VG_EARG, "a sheet needs between 1 and 1000000 frames");
    if (o->width < LEAST_SIDE || o->width > MOST_SIDE || o->height < LEAST_SIDE || o->height > MOST_SIDE)
        return vg_fail(e, VG_EARG, "a picture of %zu x %zu pixels is not possible: %d to %d each way", o->width,
                       o->height, LEAST_SIDE, MOST_SIDE);
    if (!(o->scale >= 0 && o->scale < INFINITY) || !(o->zoom >= 0 && o->zoom < INFINITY) || !isfinite(o->azimuth) ||
        !isfinite(o->elevation) || !isfinite(o->turn))
        return vg_fail(e, VG_EARG, "scale, zoom, azimuth, elevation and turn must be numbers, scale and zoom not "
                                   "negative");
    if (o->tint == VG_TINT_SCALES && o->scale > 0 && !(o->scale > 1))
        return vg_fail(e, VG_EARG, "the colours of scales end at a factor above 1, not at %g", o->scale);
    return VG_OK;
}

int vg_sheet_new(vg_sheet **out, const vg_sheet_options *o, vg_err *e)
{
    *out = NULL;
    int r = check_options(o, e);
    if (r < 0) return r;
    vg_sheet *s = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->o = *o;
    s->tint = (vgi_tint){.what = o->tint, .centred = o->centred};
    *out = s;
    return VG_OK;
}

void vg_sheet_free(vg_sheet **address)
{
    vg_sheet *s = *address;
    if (!s) return;
    for (size_t i = 0; i < s->nsequences; i++) {
        vgi_album_clear(&s->at[i].album);
        vgi_meter_clear(&s->at[i].meter);
        vgi_figure_clear(&s->at[i].figure);
        free(s->at[i].shot);
        free(s->at[i].look);
    }
    vgi_tint_clear(&s->tint);
    free(s);
    *address = NULL;
}

/* Bodies of similar size are drawn at one scale; others are scaled to D. */
static void measure_reference(const vg_sheet *s, vgi_row *q, const double *reference, bool z_up)
{
    size_t nv = q->head->body.mesh.nv, vertical = z_up ? 2 : 1;
    double first = s->at->diagonal;
    q->diagonal = vg_diagonal(reference, nv);
    q->unit = q->diagonal > 0 ? q->diagonal : 1;
    if (q != s->at && first > 0 && q->unit < ONE_SCALE * first && first < ONE_SCALE * q->unit) q->unit = first;
    vg_centroid(reference, nv, q->origin);
    q->ground_height = (vgi_ground_height(q->figure.drawn, nv, reference, z_up) - q->origin[vertical]) / q->unit;
}

int vg_sheet_sequence(vg_sheet *s, const char *label, const vg_head *h, const vg_head *truth, vg_err *e)
{
    if (s->nsequences == VG_SHEET_SEQUENCES)
        return vg_fail(e, VG_EARG, "a sheet has at most %d sequences", VG_SHEET_SEQUENCES);
    if (h->kind != VG_VERTICES) return vg_fail(e, VG_EARG, "a sheet shows vertices, not %s", vg_head_form(h));
    if (truth && truth->body.mesh.nv != h->body.mesh.nv)
        return vg_fail(e, VG_EARG, "a sequence and its truth have different numbers of vertices");
    vgi_row *q = s->at + s->nsequences++;
    *q = (vgi_row){.label = label, .head = h};
    int r = vgi_figure_init(&q->figure, &h->body.mesh, e);
    if (r == VG_OK && s->o.silhouettes) r = vgi_figure_sides(&q->figure, e);
    if (r == VG_OK) r = vgi_album_init(&q->album, h->body.mesh.nv, s->o.frames, e);
    if (r < 0) return r;
    measure_reference(s, q, truth ? truth->body.reference : h->body.reference, s->o.z_up);
    return vgi_meter_init(&q->meter, &s->tint, &h->body.mesh, h->body.reference,
                          q->diagonal > 0 ? q->diagonal : 1, e);
}

static int keep_points(const vgi_row *q, vgi_shot *shot, const double *vertices, vg_err *e)
{
    for (size_t i = 0; i < 3 * q->album.nv; i++) {
        double x = (vertices[i] - q->origin[i % 3]) / q->unit;
        if (!(fabs(x) < MOST_DISTANCE))
            return vg_fail(e, VG_EINPUT, "vertex %zu of frame '%s' is too far away to be drawn", i / 3, shot->name);
        shot->points[i] = (float)x;
    }
    return VG_OK;
}

static int keep_numbers(vg_sheet *s, vgi_row *q, vgi_shot *shot, const vg_frame *f, const double *truth, vg_err *e)
{
    bool has = vgi_tint_has(&s->tint, f, truth);
    if (q->album.seen == 1) q->tinted = has;
    if (q->tinted && !has)
        return vg_fail(e, VG_EINPUT, "frame '%s' has no '%s' to colour, unlike earlier frames", f->name,
                       s->tint.name ? s->tint.name : "error");
    if (!q->tinted) return VG_OK;
    s->tinted = shot->has_numbers = true;
    if (!shot->numbers && !(shot->numbers = vgi_array(q->album.nv, sizeof *shot->numbers, e))) return VG_ENOMEM;
    int r = vgi_tint_read(&s->tint, &q->meter, f, truth, &shot->spread, e);
    for (size_t v = 0; r == VG_OK && v < q->album.nv; v++) shot->numbers[v] = (float)q->meter.numbers[v];
    return r;
}

int vg_sheet_add(vg_sheet *s, size_t i, const vg_frame *f, const double *truth, vg_err *e)
{
    if (i >= s->nsequences) return vg_fail(e, VG_EARG, "a frame is for a sequence that the sheet does not have");
    vgi_row *q = s->at + i;
    vgi_shot *shot;
    int r = vgi_album_next(&q->album, &shot, e);
    if (r < 0) return r;
    free(shot->name);
    shot->name = vgi_copy_string(f->name, strlen(f->name), e);
    if (!shot->name) return VG_ENOMEM;
    shot->time = f->has_time ? f->time : NAN;
    r = keep_points(q, shot, f->values, e);
    return r == VG_OK ? keep_numbers(s, q, shot, f, truth, e) : r;
}

/* ---- choice of frames: those of the longest sequence; shorter ones stay at their last frame ---- */

static int choose_frames(vg_sheet *s, vg_err *e)
{
    vgi_row *longest = s->at;
    for (size_t i = 1; i < s->nsequences; i++)
        if (s->at[i].album.seen > longest->album.seen) longest = s->at + i;
    s->n = vgi_album_close(&longest->album);
    if (s->n == 0) return vg_fail(e, VG_EINPUT, "there is no frame to draw");
    size_t *frames = vgi_array_raw(s->n, sizeof *frames, e);
    int r = frames ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < s->n && r == VG_OK; i++) frames[i] = longest->album.at[i].index;
    for (size_t k = 0; k < s->nsequences && r == VG_OK; k++) {
        vgi_row *q = s->at + k;
        if (!q->album.seen) r = vg_fail(e, VG_EINPUT, "'%s' has no frames: there is nothing to draw", q->label);
        else if (!(q->shot = vgi_array_raw(s->n, sizeof *q->shot, e))) r = VG_ENOMEM;
        else if (q != longest) vgi_album_match(&q->album, frames, s->n, q->shot);
        else
            for (size_t i = 0; i < s->n; i++) q->shot[i] = i;
    }
    free(frames);
    return r;
}

/* ---- the ends of the colours ---- */

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static size_t count_drawn(const vgi_row *q)
{
    size_t n = 0;
    for (size_t v = 0; v < q->album.nv; v++) n += q->figure.drawn[v];
    return n;
}

/* The absolute value that 99 % of the visible vertices do not exceed, over all pictures. */
static int find_percentile(const vg_sheet *s, double *number, vg_err *e)
{
    size_t total = 0, n = 0;
    *number = 0;
    for (size_t k = 0; k < s->nsequences; k++) {
        size_t of_one;
        bool fits = vgi_mul(s->at[k].tinted ? count_drawn(s->at + k) : 0, s->n, &of_one);
        if (!fits || __builtin_add_overflow(total, of_one, &total))
            return vg_fail(e, VG_ENOMEM, "not enough memory for the numbers of %zu frames", s->n);
    }
    if (total == 0) return VG_OK;
    float *all = vgi_array_raw(total, sizeof *all, e);
    if (!all) return VG_ENOMEM;
    for (size_t k = 0; k < s->nsequences; k++) {
        const vgi_row *q = s->at + k;
        for (size_t i = 0; q->tinted && i < s->n; i++)
            for (size_t v = 0; v < q->album.nv; v++)
                if (q->figure.drawn[v]) all[n++] = fabsf(shot_of(q, i)->numbers[v]);
    }
    qsort(all, n, sizeof *all, compare_floats);
    *number = all[(size_t)ceil(0.99 * (double)n) - 1];
    if (!(*number > 0)) *number = all[n - 1]; /* nearly all are exact: use the largest, so that the others are
                                                 visible */
    free(all);
    return VG_OK;
}

static int choose_colours(vg_sheet *s, vg_err *e)
{
    double common = 0;
    for (size_t k = 0; k < s->nsequences; k++)
        for (size_t i = 0; s->at[k].tinted && i < s->n; i++) {
            const vgi_shot *shot = shot_of(s->at + k, i);
            if (!s->largest || shot->spread.most > s->largest->spread.most)
                s->largest = shot, s->largest_of = s->at + k;
            if (!s->least || shot->spread.least < s->least->spread.least) s->least = shot, s->least_of = s->at + k;
        }
    int r = s->tinted && !(s->o.scale > 0) ? find_percentile(s, &common, e) : VG_OK;
    vgi_tint_end(&s->tint, s->o.scale, common, s->least ? s->least->spread.least : 0,
                 s->largest ? s->largest->spread.most : 0);
    vgi_palette_init(&s->palette, s->tint.diverging);
    return r;
}

/* ---- layout ---- */

static size_t caption_height(const vg_sheet *s)
{
    return CAPTION + (s->tinted ? NUMBERS : 0);
}

static size_t title_height(const vg_sheet *s)
{
    return s->nsequences > 1 ? TITLE : 0;
}

/* Close to 16 : 9 with few empty places in the last row; with several sequences as many columns as fit, in equal
 * rows. */
static size_t choose_columns(const vg_sheet *s)
{
    size_t best = 1;
    double least = INFINITY, w = (double)(s->o.width + MARGIN),
           h = (double)(s->o.height + caption_height(s) + MARGIN);
    if (s->nsequences > 1) {
        size_t blocks = (s->n + MOST_COLUMNS - 1) / MOST_COLUMNS;
        return (s->n + blocks - 1) / blocks;
    }
    for (size_t c = 1; c <= s->n; c++) {
        size_t rows = (s->n + c - 1) / c;
        double shape = fabs(log((double)c * w / ((double)rows * h) / (16.0 / 9)));
        double cost = shape + 1.5 * (double)(rows * c - s->n) / (double)s->n;
        if (cost < least) least = cost, best = c;
    }
    return best;
}

static bool follows(const vg_sheet *s)
{
    return s->o.fit == VG_FIT_FIGURE || s->at[0].look;
}

/* The centre of a picture if the camera follows: the mean of the vertices that it is centred on, or the centroid of
 * the shot. */
static void shot_middle(const vgi_camera *c, const vgi_row *q, const vgi_shot *shot, double middle[2])
{
    double sum[3] = {0, 0, 0};
    size_t n = 0;
    for (size_t i = 0; i < (q->look ? q->nlook : q->album.nv); i++) {
        size_t v = q->look ? q->look[i] : i;
        if (!q->look && !q->figure.drawn[v]) continue;
        for (size_t k = 0; k < 3; k++) sum[k] += shot->points[3 * v + k];
        n++;
    }
    middle[0] = middle[1] = 0;
    for (int k = 0; k < 3 && n; k++) {
        middle[0] += c->right[k] * sum[k] / (double)n;
        middle[1] += c->up[k] * sum[k] / (double)n;
    }
}

/* The camera of picture i; in an animation it may rotate around the figure. */
static vgi_camera camera_of(const vg_sheet *s, size_t i)
{
    vgi_camera c = s->camera;
    if (s->o.animated && s->o.turn != 0) /* so that the end meets the beginning */
        vgi_camera_turn(&c, s->o.azimuth + s->o.turn * (double)i / (double)s->n, s->o.elevation, s->o.z_up);
    return c;
}

/* One scale for all pictures, so that sizes can be compared; also one position, unless the camera follows. */
static void place_camera(vg_sheet *s)
{
    vgi_box box = vgi_box_empty();
    vgi_camera_turn(&s->camera, s->o.azimuth, s->o.elevation, s->o.z_up);
    s->camera.width = (double)(s->o.width * s->oversampling);
    s->camera.height = (double)(s->o.height * s->oversampling);
    for (size_t k = 0; k < s->nsequences; k++)
        for (size_t i = 0; i < s->n; i++) {
            double middle[2] = {0, 0};
            const vgi_shot *shot = shot_of(s->at + k, i);
            vgi_camera camera = camera_of(s, i);
            if (follows(s)) shot_middle(&camera, s->at + k, shot, middle);
            vgi_camera_measure(&camera, &s->at[k].figure, shot->points, middle, &box);
        }
    for (int k = 0; k < 2 && s->at[0].look && box.least[k] <= box.most[k]; k++) { /* what is looked at stays in the middle */
        box.most[k] = fmax(fabs(box.least[k]), fabs(box.most[k]));
        box.least[k] = -box.most[k];
    }
    vgi_camera_fit(&s->camera, &box, 0.06);
    if (s->o.zoom > 0) s->camera.scale *= s->o.zoom;
}

/* ---- pictures ---- */

typedef struct row { /* number of pictures drawn at a time */
    const vg_sheet *s;
    const vgi_row *of;
    size_t first;
    unsigned char **rgb; /* one picture each */
    vg_err *err;
} row;

static double nice_spacing(const vgi_row *q)
{
    double want = 0.14 * q->unit, power = pow(10, floor(log10(want)));
    return (want / power < 1.5 ? 1 : want / power < 3.5 ? 2 : want / power < 7.5 ? 5 : 10) * power;
}

/* The grid surrounds the feet in all shots, or in this one if the camera follows. */
static void place_ground(const vg_sheet *s, const vgi_row *q, size_t shot, vgi_ground *g)
{
    *g = (vgi_ground){.height = q->ground_height, .spacing = nice_spacing(q) / q->unit, .across = {1, 0, 0}};
    g->vertical[s->o.z_up ? 2 : 1] = 1;
    g->along[s->o.z_up ? 1 : 2] = s->o.z_up ? -1 : 1;
    vgi_camera above = {0};
    for (int k = 0; k < 3; k++) above.right[k] = (float)g->across[k], above.up[k] = (float)g->along[k];
    vgi_box box = vgi_box_empty();
    for (size_t i = follows(s) ? shot : 0; i < (follows(s) ? shot + 1 : s->n); i++)
        vgi_camera_measure(&above, &q->figure, shot_of(q, i)->points, (double[2]){0, 0}, &box);
    for (int k = 0; k < 2; k++) g->middle[k] = (box.least[k] + box.most[k]) / 2;
    g->reach = 0.45 + 0.5 * hypot(box.most[0] - box.least[0], box.most[1] - box.least[1]);
}

int vgi_sheet_draw(const vg_sheet *s, const vgi_row *q, size_t i, unsigned char *rgb, vg_err *e)
{
    const vgi_shot *shot = shot_of(q, i);
    size_t nv = q->album.nv;
    double side = fmin(s->camera.width, s->camera.height), pixel = (double)s->oversampling;
    vgi_camera camera = camera_of(s, i);
    vgi_raster raster = {0};
    vgi_ground ground = {0};
    float *values = NULL;
    int r = VG_OK;
    if (follows(s)) {
        double middle[2];
        shot_middle(&camera, q, shot, middle);
        camera.x += middle[0], camera.y += middle[1];
    }
    if (q->tinted) {
        values = vgi_array_raw(nv, sizeof *values, e);
        if (!values) return VG_ENOMEM;
        for (size_t v = 0; v < nv; v++) values[v] = (float)vgi_tint_place(&s->tint, shot->numbers[v]);
    }
    bool patches = !q->tinted && s->o.tint != VG_TINT_PLAIN && q->head->body.patches.n;
    vgi_drawing drawing = {.figure = &q->figure,
                           .camera = &camera,
                           .points = shot->points,
                           .values = values,
                           .patches = patches ? q->head->body.patches.of_face : NULL,
                           .wire = (float)(0.9 * pixel),
                           .edge = s->o.edges ? (float)(0.45 * pixel) : 0,
                           .contour = s->o.silhouettes ? (float)(0.8 * pixel) : 0};
    vgi_look look = {.palette = &s->palette, .numbers = q->tinted, .patches = patches,
                     .oversampling = s->oversampling, .edge_strength = 0.5f, .outline = (float)(0.02 * side),
                     .reach = (float)(0.07 * side)};
    if (s->o.ground && nv > 0) {
        place_ground(s, q, i, &ground);
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
    k->err[i].code = vgi_sheet_draw(k->s, k->of, k->first + i, k->rgb[i], k->err + i);
}

/* ---- the page ---- */

void vgi_canvas_paste(vgi_canvas *c, size_t x, size_t y, const unsigned char *rgb, size_t w, size_t h)
{
    for (size_t j = 0; j < h; j++) memcpy(c->rgb + 3 * ((y + j) * c->w + x), rgb + 3 * j * w, 3 * w);
}

/* The name of a frame, or its number if it has no name. */
static void print_label(char *to, size_t size, const vgi_shot *shot)
{
    if (*shot->name)
        snprintf(to, size, "%s", shot->name);
    else
        snprintf(to, size, "frame %zu", shot->index);
}

static void put_caption(const vg_sheet *s, vgi_canvas *c, size_t x, const vgi_shot *shot)
{
    char line[TEXT_BYTES];
    double width = (double)s->o.width, middle = (double)x + width / 2, y = (double)s->o.height + 18;
    print_label(line, sizeof line, shot);
    vgi_text(c, middle, y, &(vgi_lettering){ink, caption_size, 0.5, width}, line);
    if (!shot->has_numbers) return;
    vgi_tint_caption(&s->tint, &shot->spread, line, sizeof line);
    vgi_text(c, middle, y + CAPTION - 5, &(vgi_lettering){soft_ink, small_size, 0.5, width}, line);
}

/* Where an extreme value occurs: "1.5 in 'pose3'"; with several sequences, also in which one. */
static void print_place(const vg_sheet *s, char *to, size_t size, double number, const vgi_row *q,
                        const vgi_shot *shot)
{
    char text[VGI_NUMBER], label[TEXT_BYTES];
    vgi_tint_number(&s->tint, number, text);
    print_label(label, sizeof label, shot);
    snprintf(to, size, "%s in '%.200s'%s%.200s", text, label, s->nsequences > 1 ? " of " : "",
             s->nsequences > 1 ? q->label : "");
}

static void put_legend(const vg_sheet *s, vgi_canvas *c)
{
    char title[TEXT_BYTES], note[4 * TEXT_BYTES], largest[TEXT_BYTES], least[TEXT_BYTES];
    bool given = s->o.scale > 0 || s->tint.what == VG_TINT_SCALES;
    vgi_tint_title(&s->tint, s->largest_of->diagonal, title, sizeof title);
    print_place(s, largest, sizeof largest, s->largest->spread.most, s->largest_of, s->largest);
    print_place(s, least, sizeof least, s->least->spread.least, s->least_of, s->least);
    const char *end = !given ? "99% of the vertices shown are below" : s->o.scale > 0 ? "given" : "half and double";
    snprintf(note, sizeof note, "end of the colours: %s; largest %s%s%s", end, largest,
             s->tint.diverging ? "; least " : "", s->tint.diverging ? least : "");
    vgi_legend(c, &s->tint, &s->palette, MARGIN, title, note);
}

static void put_title(vgi_canvas *c, const vgi_row *q)
{
    vgi_text(c, MARGIN, 15, &(vgi_lettering){ink, title_size, 0, (double)(c->w - 2 * MARGIN)}, q->label);
}

static void put_footer(const vg_sheet *s, vgi_canvas *c)
{
    char line[TEXT_BYTES], spacing[32];
    vgi_print_number(spacing, sizeof spacing, "%.3g", nice_spacing(s->at));
    snprintf(line, sizeof line, "grid lines are %s apart%s%s", spacing, s->nsequences > 1 ? " in " : "",
             s->nsequences > 1 ? s->at->label : "");
    vgi_text(c, MARGIN, 13, &(vgi_lettering){soft_ink, small_size, 0, (double)(c->w - 2 * MARGIN)}, line);
}

/* ---- the sheet ---- */

typedef struct press {
    vgi_png *png;
    vgi_canvas canvas;
    row row;
} press;

static size_t footer_height(const vg_sheet *s)
{
    return (s->tinted ? VGI_LEGEND : 0) + (s->o.ground ? FOOTER : 0);
}

static int open_press(press *p, const vg_sheet *s, int fd, const char *name, vg_err *e)
{
    size_t rows = (s->n + s->columns - 1) / s->columns * s->nsequences;
    size_t line = s->o.height + caption_height(s) + MARGIN;
    size_t w = s->columns * (s->o.width + MARGIN) + MARGIN;
    size_t h = MARGIN + rows * (line + title_height(s)) + footer_height(s);
    int r = vgi_png_open(&p->png, fd, name, w, h, e);
    if (r < 0) return r;
    if ((r = vgi_canvas_init(&p->canvas, w, line > VGI_LEGEND ? line : VGI_LEGEND, e)) < 0) return r; /* both below 2^20 */
    p->row = (row){.s = s, .rgb = vgi_array(s->columns, sizeof *p->row.rgb, e),
                   .err = vgi_array(s->columns, sizeof *p->row.err, e)};
    if (!p->row.rgb || !p->row.err) return VG_ENOMEM;
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
    vgi_canvas_clear(&p->canvas);
}

static int print_row(press *p, const vg_sheet *s, const vgi_row *q, size_t first, vg_err *e)
{
    size_t n = s->n - first < s->columns ? s->n - first : s->columns;
    p->row.first = first, p->row.of = q;
    vgi_parallel(s->o.threads, n, draw_task, &p->row);
    vgi_canvas_wipe(&p->canvas);
    if (title_height(s)) {
        put_title(&p->canvas, q);
        int r = vgi_png_rows(p->png, p->canvas.rgb, TITLE, e);
        if (r < 0) return r;
        vgi_canvas_wipe(&p->canvas);
    }
    for (size_t i = 0; i < n; i++) {
        size_t x = MARGIN + i * (s->o.width + MARGIN);
        if (p->row.err[i].code < 0) {
            if (e) *e = p->row.err[i];
            return p->row.err[i].code;
        }
        vgi_canvas_paste(&p->canvas, x, 0, p->row.rgb[i], s->o.width, s->o.height);
        put_caption(s, &p->canvas, x, shot_of(q, first + i));
    }
    return vgi_png_rows(p->png, p->canvas.rgb, s->o.height + caption_height(s) + MARGIN, e);
}

static int print_sheet(press *p, const vg_sheet *s, vg_err *e)
{
    vgi_canvas_wipe(&p->canvas);
    int r = vgi_png_rows(p->png, p->canvas.rgb, MARGIN, e);
    for (size_t first = 0; r == VG_OK && first < s->n; first += s->columns)
        for (size_t k = 0; r == VG_OK && k < s->nsequences; k++) r = print_row(p, s, s->at + k, first, e);
    if (r == VG_OK && s->o.ground) {
        vgi_canvas_wipe(&p->canvas);
        put_footer(s, &p->canvas);
        r = vgi_png_rows(p->png, p->canvas.rgb, FOOTER, e);
    }
    if (r == VG_OK && s->tinted) {
        vgi_canvas_wipe(&p->canvas);
        put_legend(s, &p->canvas);
        r = vgi_png_rows(p->png, p->canvas.rgb, VGI_LEGEND, e);
    }
    if (r == VG_OK) r = vgi_font_check(p->canvas.font, e);
    return r == VG_OK ? vgi_png_end(p->png, e) : r;
}

int vg_sheet_write(vg_sheet *s, int fd, const char *name, vg_err *e)
{
    if (s->nsequences == 0) return vg_fail(e, VG_EINPUT, "there is no frame to draw");
    int r = choose_frames(s, e);
    if (r == VG_OK) r = choose_colours(s, e);
    if (r < 0) return r;
    s->oversampling = s->o.width > WIDE_SIDE || s->o.height > WIDE_SIDE ? 2 : 3;
    s->columns = s->o.columns ? (s->o.columns < s->n ? s->o.columns : s->n) : choose_columns(s);
    place_camera(s);
    if (s->o.animated) return vgi_movie_write(s, fd, name, e);
    press p = {0};
    r = open_press(&p, s, fd, name, e);
    if (r == VG_OK) r = print_sheet(&p, s, e);
    close_press(&p, s->columns);
    return r;
}
