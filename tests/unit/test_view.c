/* test_view.c: the contact sheet: visibility, light, colours, choice of frames, text, PNG.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"

#include "view/view.h"

#include <fcntl.h>
#include <png.h>
#include <unistd.h>

/* ---- figures ---- */

typedef struct shape {
    vg_mesh mesh;
    double points[3 * 2000];
    uint32_t start[2000], vert[8000];
} shape;

static void begin(shape *s)
{
    memset(s, 0, sizeof *s);
    s->mesh.start = s->start;
    s->mesh.vert = s->vert;
}

static void point(shape *s, double x, double y, double z)
{
    double *p = s->points + 3 * s->mesh.nv++;
    p[0] = x, p[1] = y, p[2] = z;
}

static void face(shape *s, size_t n, const uint32_t *v)
{
    uint32_t *to = s->vert + s->start[s->mesh.nf];
    for (size_t i = 0; i < n; i++) to[i] = v[i];
    s->start[s->mesh.nf + 1] = s->start[s->mesh.nf] + (uint32_t)n;
    s->mesh.nf++;
}
#define FACE(s, ...) face(s, sizeof((uint32_t[]){__VA_ARGS__}) / sizeof(uint32_t), (uint32_t[]){__VA_ARGS__})

static void make_cube(shape *s)
{
    begin(s);
    for (int i = 0; i < 8; i++) point(s, i & 1, i >> 1 & 1, i >> 2 & 1);
    FACE(s, 4, 5, 7, 6);
    FACE(s, 1, 0, 2, 3);
    FACE(s, 5, 1, 3, 7);
    FACE(s, 0, 4, 6, 2);
    FACE(s, 6, 7, 3, 2);
    FACE(s, 0, 1, 5, 4);
}

enum { AROUND = 32, DOWN = 16 };
static void make_sphere(shape *s)
{
    begin(s);
    point(s, 0, 1, 0);
    for (int j = 1; j < DOWN; j++)
        for (int i = 0; i < AROUND; i++) {
            double a = 2 * M_PI * i / AROUND, b = M_PI * j / DOWN;
            point(s, sin(b) * sin(a), cos(b), sin(b) * cos(a));
        }
    point(s, 0, -1, 0);
    uint32_t last = (uint32_t)s->mesh.nv - 1;
    for (uint32_t i = 0; i < AROUND; i++) {
        uint32_t k = (i + 1) % AROUND;
        FACE(s, 0, 1 + i, 1 + k);
        for (uint32_t j = 0; j + 2 < DOWN; j++) {
            uint32_t r = 1 + j * AROUND;
            FACE(s, r + i, r + AROUND + i, r + AROUND + k, r + k);
        }
        FACE(s, last, last - AROUND + k, last - AROUND + i);
    }
}

/* A square of side 1 that faces the front. */
static void make_square(shape *s)
{
    begin(s);
    point(s, 0, 0, 0), point(s, 1, 0, 0), point(s, 1, 1, 0), point(s, 0, 1, 0);
    FACE(s, 0, 1, 2, 3);
}

/* ---- drawing without a sheet ---- */

typedef struct drawn {
    vgi_figure figure;
    vgi_raster raster;
    vgi_camera camera;
    float points[3 * 2000];
} drawn;

static void draw(drawn *d, const shape *s, double azimuth, double elevation, size_t side, const float *values)
{
    CHECK(vgi_figure_init(&d->figure, &s->mesh, NULL) == VG_OK);
    for (size_t i = 0; i < 3 * s->mesh.nv; i++) d->points[i] = (float)s->points[i];
    d->camera = (vgi_camera){.width = (double)side, .height = (double)side};
    vgi_camera_turn(&d->camera, azimuth, elevation, false);
    vgi_box box = vgi_box_empty();
    vgi_camera_measure(&d->camera, &d->figure, d->points, (double[2]){0, 0}, &box);
    vgi_camera_fit(&d->camera, &box, 0.1);
    vgi_drawing drawing = {
        .figure = &d->figure, .camera = &d->camera, .points = d->points, .values = values, .wire = 2};
    CHECK(vgi_raster_init(&d->raster, side, side, NULL) == VG_OK);
    CHECK(vgi_draw(&d->raster, &drawing, NULL) == VG_OK);
}

static void undraw(drawn *d)
{
    vgi_raster_clear(&d->raster);
    vgi_figure_clear(&d->figure);
}

static size_t count_kind(const vgi_raster *r, int kind)
{
    size_t n = 0;
    for (size_t i = 0; i < r->w * r->h; i++) n += r->at[i].kind == kind;
    return n;
}

static drawn d;
static shape s;

static void cube_covers_its_area(void)
{
    make_cube(&s);
    draw(&d, &s, 0, 0, 300, NULL);
    CHECK_NEAR(d.camera.scale, 240, 1e-9);
    CHECK(count_kind(&d.raster, VGI_FRONT) == 240 * 240); /* the sides are on sample borders: exact */
    CHECK(count_kind(&d.raster, VGI_EMPTY) == 300 * 300 - 240 * 240);
    CHECK(d.raster.at[30 * 300 + 30].kind == VGI_FRONT && d.raster.at[29 * 300 + 30].kind == VGI_EMPTY);
    CHECK(d.raster.at[150 * 300 + 150].normal[2] == 32767); /* flat: not smoothed over the edge */
    CHECK(d.raster.at[31 * 300 + 31].normal[2] == 32767);
    undraw(&d);
    draw(&d, &s, 45, 0, 300, NULL); /* turned by 45 degrees it is sqrt 2 wide and 1 high */
    CHECK_NEAR((double)count_kind(&d.raster, VGI_FRONT), d.camera.scale * d.camera.scale * sqrt(2), 4 * 300);
    undraw(&d);
}

static void views_show_their_side(void)
{
    static const double views[6][5] = {/* azimuth, elevation, and which way the seen normal points */
                                       {0, 0, 0, 0, 1},    {180, 0, 0, 0, -1}, {90, 0, 1, 0, 0},
                                       {-90, 0, -1, 0, 0}, {0, 90, 0, 1, 0},   {0, -90, 0, -1, 0}};
    for (int i = 0; i < 6; i++) {
        vgi_camera c;
        vgi_camera_turn(&c, views[i][0], views[i][1], false);
        for (int k = 0; k < 3; k++) CHECK_NEAR(c.toward[k], views[i][2 + k], 1e-6);
        double handed = c.toward[0] * (c.right[1] * c.up[2] - c.right[2] * c.up[1]) +
                        c.toward[1] * (c.right[2] * c.up[0] - c.right[0] * c.up[2]) +
                        c.toward[2] * (c.right[0] * c.up[1] - c.right[1] * c.up[0]);
        CHECK_NEAR(handed, 1, 1e-6);
    }
    vgi_camera z;
    vgi_camera_turn(&z, 0, 0, true);
    CHECK_NEAR(z.toward[1], -1, 1e-6);
    CHECK_NEAR(z.up[2], 1, 1e-6);
    CHECK_NEAR(z.right[0], 1, 1e-6);
}

/* Two squares one behind the other, in both orders: the nearer is seen where they overlap. */
static void nearer_hides_farther(void)
{
    for (int order = 0; order < 2; order++) {
        begin(&s);
        for (int i = 0; i < 2; i++) {
            double z = i == order ? 1 : 0, x = i == order ? 0.5 : 0;
            point(&s, x, 0, z), point(&s, x + 1, 0, z), point(&s, x + 1, 1, z), point(&s, x, 1, z);
        }
        FACE(&s, 0, 1, 2, 3);
        FACE(&s, 4, 5, 6, 7);
        float values[8];
        for (int i = 0; i < 8; i++) values[i] = (i / 4 == order) ? 1 : 0; /* the nearer one, to the right */
        draw(&d, &s, 0, 0, 320, values);
        size_t y = 160 * 320;
        CHECK(d.raster.at[y + 60].value == 0);
        CHECK(d.raster.at[y + 160].value == 65535);
        CHECK(d.raster.at[y + 260].value == 65535);
        undraw(&d);
    }
}

static void back_faces_are_told_apart(void)
{
    make_square(&s);
    draw(&d, &s, 180, 0, 100, NULL);
    CHECK(count_kind(&d.raster, VGI_BACK) == 80 * 80);
    CHECK(count_kind(&d.raster, VGI_FRONT) == 0);
    CHECK(d.raster.at[50 * 100 + 50].normal[2] == 32767); /* lit from the side that is seen */
    undraw(&d);
}

static void concave_face_keeps_its_notch(void)
{
    begin(&s);
    point(&s, 0, 0, 0), point(&s, 4, 0, 0), point(&s, 4, 4, 0), point(&s, 2, 1, 0), point(&s, 0, 4, 0);
    FACE(&s, 0, 1, 2, 3, 4);
    draw(&d, &s, 0, 0, 200, NULL);
    double unit = d.camera.scale;
    CHECK_NEAR((double)count_kind(&d.raster, VGI_FRONT), 10 * unit * unit, 2 * 200);
    CHECK(d.raster.at[60 * 200 + 100].kind == VGI_EMPTY);
    CHECK(d.raster.at[170 * 200 + 100].kind == VGI_FRONT);
    undraw(&d);
}

static double triangle_area(const double *xy, const size_t *t)
{
    const double *a = xy + 2 * t[0], *b = xy + 2 * t[1], *c = xy + 2 * t[2];
    return ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
}

/* A comb: the hardest case for a fan. Triangles of one sign whose areas add up cover it exactly once. */
static void ears_cover_a_comb(void)
{
    enum { TEETH = 20, N = 2 * TEETH + 2 };
    double xy[2 * N];
    size_t work[3 * N], t[3 * (N - 2)], n = 0;
    xy[n++] = 2 * TEETH, xy[n++] = -1;
    for (int i = 2 * TEETH; i >= 0; i--) xy[n++] = i, xy[n++] = i % 2 ? 9 : 0.5;
    CHECK(n == 2 * N);
    xy[2 * N - 2] = 0, xy[2 * N - 1] = -1;
    for (int turned = 0; turned < 2; turned++) {
        double whole = 0, parts = 0;
        for (size_t i = 0; i < N; i++) {
            size_t j = (i + 1) % N;
            whole += (xy[2 * i] * xy[2 * j + 1] - xy[2 * j] * xy[2 * i + 1]) / 2;
        }
        vgi_ear_clip(xy, N, work, t);
        for (size_t i = 0; i < N - 2; i++) {
            double area = triangle_area(xy, t + 3 * i);
            CHECK(turned ? area < 0 : area > 0);
            parts += area;
        }
        CHECK_NEAR(parts, whole, 1e-9);
        for (size_t i = 0; i < N; i++) xy[2 * i] = -xy[2 * i]; /* clockwise */
    }
}

static void ears_end_on_crossed_polygons(void)
{
    size_t work[15], t[9];
    const double star[10] = {0, 1, 0.6, -0.8, -0.95, 0.3, 0.95, 0.3, -0.6, -0.8}, nothing[10] = {0};
    vgi_ear_clip(star, 5, work, t);
    for (int i = 0; i < 9; i++) CHECK(t[i] < 5);
    vgi_ear_clip(nothing, 5, work, t);
    for (int i = 0; i < 9; i++) CHECK(t[i] < 5);
}

static void wires_are_round_and_visible(void)
{
    begin(&s);
    point(&s, 0, 0, 0), point(&s, 1, 1, 0), point(&s, 1, 0, 0);
    FACE(&s, 0, 1);
    FACE(&s, 1, 2);
    draw(&d, &s, 0, 0, 200, NULL);
    size_t wire = count_kind(&d.raster, VGI_WIRE);
    double length = d.camera.scale * (1 + sqrt(2));
    CHECK_NEAR((double)wire, 4 * length, 0.06 * 4 * length); /* twice the radius 2, and a little for the joints */
    CHECK(d.raster.at[100 * 200 + 100].kind == VGI_WIRE);
    undraw(&d);
}

static void odd_figures_are_drawn(void)
{
    begin(&s); /* a point */
    point(&s, 5, 6, 7);
    draw(&d, &s, 30, 15, 100, NULL);
    CHECK(count_kind(&d.raster, VGI_WIRE) > 10);
    CHECK(d.raster.at[50 * 100 + 50].kind == VGI_WIRE);
    undraw(&d);
    begin(&s); /* a face that has shrunk to a point */
    for (int i = 0; i < 3; i++) point(&s, 1, 1, 1);
    FACE(&s, 0, 1, 2);
    draw(&d, &s, 30, 15, 100, NULL);
    CHECK(count_kind(&d.raster, VGI_WIRE) > 0);
    undraw(&d);
    make_square(&s); /* from its side */
    draw(&d, &s, 90, 0, 100, NULL);
    CHECK(count_kind(&d.raster, VGI_WIRE) > 80);
    undraw(&d);
    begin(&s); /* nothing at all */
    draw(&d, &s, 0, 0, 100, NULL);
    CHECK(count_kind(&d.raster, VGI_EMPTY) == 100 * 100);
    undraw(&d);
}

/* ---- light and colours ---- */

static double brightness(const unsigned char *rgb)
{
    return rgb[0] + rgb[1] + rgb[2];
}

static void sphere_is_brighter_towards_the_key(void)
{
    enum { SIDE = 90 };
    static unsigned char rgb[3 * SIDE * SIDE];
    static vgi_palette palette;
    vgi_palette_init(&palette, false);
    make_sphere(&s);
    draw(&d, &s, 0, 0, 3 * SIDE, NULL);
    CHECK(count_kind(&d.raster, VGI_BACK) == 0);
    vgi_look look = {.palette = &palette, .oversampling = 3, .outline = 5, .reach = 20};
    CHECK(vgi_shade(&look, &d.raster, &d.camera, rgb, NULL) == VG_OK);
    double lit = brightness(rgb + 3 * (28 * SIDE + 30)), middle = brightness(rgb + 3 * (45 * SIDE + 45)),
           dark = brightness(rgb + 3 * (66 * SIDE + 64));
    CHECK(lit > middle + 20 && middle > dark + 100);
    /* smooth: along the middle row no step between neighbours as a facet would make */
    for (int x = 22; x < 66; x++)
        CHECK(fabs(brightness(rgb + 3 * (45 * SIDE + x)) - brightness(rgb + 3 * (45 * SIDE + x + 1))) < 24);
    undraw(&d);
}

static double lightness(const float linear[3]) /* CIE L* */
{
    double y = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    return y > 0.008856 ? 116 * cbrt(y) - 16 : 903.3 * y;
}

static void colour_map_gets_lighter_evenly(void)
{
    float colour[3];
    vgi_map_colour(0, false, colour);
    double first = lightness(colour);
    vgi_map_colour(1, false, colour);
    double last = lightness(colour), before = first;
    CHECK(last - first > 55);
    for (int i = 1; i <= 20; i++) {
        vgi_map_colour(i / 20.0, false, colour);
        CHECK(lightness(colour) > before + 0.3 * (last - first) / 20);
        CHECK(lightness(colour) < before + 2 * (last - first) / 20);
        before = lightness(colour);
        for (int k = 0; k < 3; k++) CHECK(colour[k] >= 0 && colour[k] <= 1);
    }
}

/* ---- sheets ---- */

typedef struct picture {
    unsigned w, h;
    unsigned char *rgb;
} picture;

static vg_head head_of(const shape *f)
{
    return (vg_head){.body.mesh = f->mesh,
                     .body.reference = (double *)(uintptr_t)f->points,
                     .kind = VG_VERTICES,
                     .count = f->mesh.nv};
}

static vg_sheet_options options(void)
{
    return (vg_sheet_options){.frames = 8, .width = 64, .height = 64, .threads = 1};
}

static picture read_png(int fd)
{
    picture p = {0};
    png_image image = {.version = PNG_IMAGE_VERSION};
    FILE *f = fdopen(fd, "rb");
    rewind(f);
    CHECK(png_image_begin_read_from_stdio(&image, f));
    CHECK(image.format == PNG_FORMAT_RGB); /* 8 bit, no alpha, no palette */
    image.format = PNG_FORMAT_RGB;
    p.w = image.width, p.h = image.height;
    p.rgb = malloc(PNG_IMAGE_SIZE(image));
    CHECK(p.rgb && png_image_finish_read(&image, NULL, p.rgb, 0, NULL));
    fclose(f);
    return p;
}

static int temporary(void)
{
    FILE *f = tmpfile();
    int fd = f ? dup(fileno(f)) : -1;
    if (f) fclose(f);
    CHECK(fd >= 0);
    return fd;
}

/* A sheet of n frames of a shape, each moved by `step` more along x; compared with the same moved by `off` along y.
 */
static int write_sheet(const vg_sheet_options *o, const shape *shape_, size_t n, double step, double off, int fd,
                       vg_err *e)
{
    static double pose[3 * 2000], truth[3 * 2000];
    vg_sheet *sheet = NULL;
    vg_frame frame = {0};
    vg_head head = head_of(shape_);
    int r = vg_sheet_new(&sheet, o, e);
    if (r == VG_OK) r = vg_sheet_sequence(sheet, "shape", &head, NULL, e);
    for (size_t f = 0; r == VG_OK && f < n; f++) {
        char name[32];
        snprintf(name, sizeof name, "frame%zu", f);
        memcpy(pose, shape_->points, sizeof pose);
        for (size_t v = 0; v < shape_->mesh.nv; v++) pose[3 * v] += step * (double)f;
        memcpy(truth, pose, sizeof truth);
        for (size_t v = 0; v < shape_->mesh.nv; v++) truth[3 * v + 1] -= off;
        frame.name = name, frame.values = pose;
        r = vg_sheet_add(sheet, 0, &frame, o->tint == VG_TINT_ERRORS ? truth : NULL, e);
    }
    if (r == VG_OK) r = vg_sheet_write(sheet, fd, "test.png", e);
    vg_sheet_free(&sheet);
    return r;
}

static picture make_sheet(const vg_sheet_options *o, const shape *shape_, size_t n, double step, double off)
{
    int fd = temporary();
    vg_err e = {0};
    CHECK(write_sheet(o, shape_, n, step, off, fd, &e) == VG_OK);
    CHECK_TEXT(e.message, "");
    return read_png(fd);
}

static size_t count_colour(const picture *p, const float linear[3])
{
    static vgi_palette palette;
    size_t n = 0;
    vgi_palette_init(&palette, false);
    for (size_t i = 0; i < (size_t)p->w * p->h; i++)
        n += p->rgb[3 * i] == vgi_encode(&palette, linear[0]) &&
             p->rgb[3 * i + 1] == vgi_encode(&palette, linear[1]) &&
             p->rgb[3 * i + 2] == vgi_encode(&palette, linear[2]);
    return n;
}

static void sheet_has_the_size_of_its_frames(void)
{
    vg_sheet_options o = options();
    o.columns = 3;
    make_cube(&s);
    picture p = make_sheet(&o, &s, 5, 0, 0);
    CHECK(p.w == 3 * (64 + 16) + 16);
    CHECK(p.h == 16 + 2 * (64 + 22 + 16));
    /* the hole in the last row is page */
    CHECK(p.rgb[3 * (p.w * (p.h - 60) + p.w - 40)] == 255);
    free(p.rgb);
}

static void zero_error_has_the_lowest_colour(void)
{
    vg_sheet_options o = options();
    o.tint = VG_TINT_ERRORS;
    make_square(&s);
    picture p = make_sheet(&o, &s, 1, 0, 0);
    float lowest[3], highest[3];
    vgi_map_colour(0, false, lowest);
    vgi_map_colour(1, false, highest);
    /* 56 x 56 pixels face the viewer; the bar is 14 high and at least a pixel wide */
    CHECK(count_colour(&p, lowest) > 50 * 50);
    CHECK(count_colour(&p, highest) >= 14 && count_colour(&p, highest) < 200);
    free(p.rgb);
    p = make_sheet(&o, &s, 1, 0, 0.25); /* the same error everywhere: the end of the colours is near it */
    CHECK(count_colour(&p, lowest) < 200);
    free(p.rgb);
    o.scale = 0.25 / sqrt(2); /* D is sqrt 2 */
    p = make_sheet(&o, &s, 1, 0, 0.25);
    CHECK(count_colour(&p, highest) > 50 * 50);
    free(p.rgb);
    o.centred = true; /* it was only a shift */
    p = make_sheet(&o, &s, 1, 0, 0.25);
    CHECK(count_colour(&p, lowest) > 50 * 50);
    free(p.rgb);
}

static void legend_is_there_only_for_errors(void)
{
    vg_sheet_options o = options();
    float highest[3], middle[3];
    vgi_map_colour(1, false, highest);
    vgi_map_colour(0.5, false, middle);
    make_cube(&s);
    picture p = make_sheet(&o, &s, 1, 0, 0);
    unsigned plain = p.h;
    CHECK(count_colour(&p, highest) == 0);
    free(p.rgb);
    o.tint = VG_TINT_ERRORS;
    p = make_sheet(&o, &s, 1, 0, 0);
    CHECK(p.h == plain + 18 + 74);
    CHECK(count_colour(&p, highest) >= 14);
    free(p.rgb);
}

static void following_holds_the_figure(void)
{
    vg_sheet_options o = options();
    make_cube(&s);
    for (int follow = 0; follow < 2; follow++) {
        o.fit = follow ? VG_FIT_FIGURE : VG_FIT_PATH;
        o.columns = 2;
        picture p = make_sheet(&o, &s, 2, 3, 0);
        size_t differ = 0;
        for (size_t y = 16; y < 16 + 64; y++)
            differ += memcmp(p.rgb + 3 * (y * p.w + 16), p.rgb + 3 * (y * p.w + 16 + 80), 3 * 64) != 0;
        CHECK(follow ? differ == 0 : differ > 10);
        free(p.rgb);
    }
}

static void options_change_the_picture(void)
{
    make_cube(&s);
    vg_sheet_options o = options();
    o.azimuth = 30, o.elevation = 15;
    picture plain = make_sheet(&o, &s, 1, 0, 0);
    o.edges = true;
    picture edges = make_sheet(&o, &s, 1, 0, 0);
    CHECK(plain.h == edges.h);
    double sum = 0;
    for (size_t i = 0; i < (size_t)plain.w * plain.h * 3; i++) {
        CHECK(edges.rgb[i] <= plain.rgb[i]); /* only darker */
        sum += plain.rgb[i] - edges.rgb[i];
    }
    CHECK(sum > 1000);
    o.edges = false, o.ground = true;
    picture ground = make_sheet(&o, &s, 1, 0, 0);
    size_t darker = 0;
    for (size_t y = 16; y < 16 + 64; y++)
        for (size_t x = 16; x < 16 + 64; x++)
            darker += ground.rgb[3 * (y * ground.w + x)] < plain.rgb[3 * (y * plain.w + x)];
    CHECK(ground.h == plain.h + 24);
    CHECK(darker > 50);
    free(plain.rgb), free(edges.rgb), free(ground.rgb);
}

static size_t read_all(int fd, unsigned char *to, size_t n)
{
    lseek(fd, 0, SEEK_SET);
    ssize_t k = read(fd, to, n);
    return k > 0 ? (size_t)k : 0;
}

static void threads_do_not_change_bytes(void)
{
    static unsigned char bytes[2][1 << 18];
    size_t n[2];
    vg_sheet_options o = options();
    o.ground = true, o.azimuth = 30, o.elevation = 15;
    make_sphere(&s);
    for (int i = 0; i < 2; i++) {
        int fd = temporary();
        o.threads = i ? 3 : 1;
        CHECK(write_sheet(&o, &s, 7, 0.1, 0, fd, NULL) == VG_OK);
        n[i] = read_all(fd, bytes[i], sizeof bytes[i]);
        close(fd);
    }
    CHECK(n[0] > 1000 && n[0] == n[1] && !memcmp(bytes[0], bytes[1], n[0]));
}

static void refusals(void)
{
    vg_err e = {0};
    vg_sheet_options o = options();
    vg_sheet *sheet = NULL;
    make_cube(&s);
    int fd = temporary();
    CHECK(write_sheet(&o, &s, 0, 0, 0, fd, &e) == VG_EINPUT);
    o.columns = 20000, o.frames = 20000; /* 20000 frames of 80 pixels are wider than a PNG may be */
    CHECK(write_sheet(&o, &s, 20000, 0, 0, fd, &e) == VG_EARG);
    close(fd);
    o = options(), o.width = 8;
    CHECK(vg_sheet_new(&sheet, &o, &e) == VG_EARG && !sheet);
    o = options(), o.frames = 0;
    CHECK(vg_sheet_new(&sheet, &o, &e) == VG_EARG && !sheet);
    o = options(), o.azimuth = NAN;
    CHECK(vg_sheet_new(&sheet, &o, &e) == VG_EARG && !sheet);
    o = options();
    CHECK(vg_sheet_new(&sheet, &o, &e) == VG_OK);
    double far[24];
    memcpy(far, s.points, sizeof far);
    far[7] = 1e12;
    vg_head head = head_of(&s);
    vg_frame frame = {.name = (char *)(uintptr_t)"a", .values = far};
    CHECK(vg_sheet_sequence(sheet, "s", &head, NULL, &e) == VG_OK);
    CHECK(vg_sheet_add(sheet, 1, &frame, NULL, &e) == VG_EARG);
    CHECK(vg_sheet_add(sheet, 0, &frame, NULL, &e) == VG_EINPUT);
    CHECK_TEXT(e.message, "vertex 2 of frame 'a' is too far away to be drawn");
    vg_sheet_free(&sheet);
    int full = open("/dev/full", O_WRONLY);
    if (full >= 0) {
        CHECK(write_sheet(&o, &s, 3, 0, 0, full, &e) == VG_ESYS);
        close(full);
    }
}

/* ---- which frames ---- */

static void check_album(size_t want, size_t frames)
{
    vgi_album a;
    CHECK(vgi_album_init(&a, 1, want, NULL) == VG_OK);
    for (size_t f = 0; f < frames; f++) {
        vgi_shot *shot;
        CHECK(vgi_album_next(&a, &shot, NULL) == VG_OK);
        shot->points[0] = (float)f; /* travels with its shot */
    }
    double stride = (double)a.stride, spacing = want > 1 ? (double)(frames - 1) / (double)(want - 1) : 0;
    size_t n = vgi_album_close(&a);
    CHECK(n == (frames < want ? frames : want));
    for (size_t i = 0; i < n; i++) {
        CHECK(a.at[i].points[0] == (float)a.at[i].index);
        if (i) CHECK(a.at[i].index > a.at[i - 1].index);
        if (frames > want) CHECK_NEAR((double)a.at[i].index, (double)i * spacing, stride / 2);
    }
    CHECK(a.at[0].index == 0);
    if (want > 1) CHECK(a.at[n - 1].index == frames - 1);
    if (stride > 1) CHECK(want == 1 || 2 * stride <= spacing * (double)want / (double)(want - 1) + 1e-9);
    vgi_album_clear(&a);
}

static void album_is_evenly_spaced(void)
{
    for (size_t want = 1; want <= 12; want++)
        for (size_t frames = 1; frames <= 300; frames++) check_album(want, frames);
    check_album(8, 100000);
}

/* What is shown of a shorter sequence, kept at its own stride, are the same frames, and behind its end the last. */
static void albums_match(void)
{
    static const size_t lengths[] = {1, 2, 7, 40, 41, 300};
    for (size_t want = 1; want <= 9; want += 4)
        for (size_t k = 0; k < 36; k++) {
            size_t frames[9], shots[9];
            vgi_album a, b;
            CHECK(vgi_album_init(&a, 1, want, NULL) == VG_OK && vgi_album_init(&b, 1, want, NULL) == VG_OK);
            for (size_t i = 0; i < 2; i++)
                for (size_t f = 0; f < lengths[i ? k % 6 : k / 6]; f++) {
                    vgi_shot *shot;
                    CHECK(vgi_album_next(i ? &b : &a, &shot, NULL) == VG_OK);
                }
            size_t n = vgi_album_close(&a), last = lengths[k % 6] - 1;
            for (size_t i = 0; i < n; i++) frames[i] = a.at[i].index;
            vgi_album_match(&b, frames, n, shots);
            for (size_t i = 0; i < n && lengths[k % 6] <= lengths[k / 6]; i++)
                CHECK(b.at[shots[i]].index == (frames[i] < last ? frames[i] : last));
            vgi_album_clear(&a);
            vgi_album_clear(&b);
        }
}

/* ---- what colours say ---- */

static void colours_end_at_short_numbers(void)
{
    static const double given[][2] = {{1, 1},    {1.01, 1.2},  {0.00447, 0.005}, {8.1, 10},
                                      {99, 100}, {1e-9, 1e-9}, {2.5e12, 2.5e12}};
    for (size_t i = 0; i < sizeof given / sizeof *given; i++)
        CHECK_NEAR(vgi_round_up(given[i][0]), given[i][1], 1e-9 * given[i][1]);
    vgi_tint t = {.what = VG_TINT_ERRORS};
    vgi_tint_end(&t, 0, 0.00447, 0, 0.0046);
    CHECK(t.low == 0 && !t.diverging);
    CHECK_NEAR(vgi_tint_place(&t, 0.0025), 0.5, 1e-12);
    vgi_tint_end(&t, 0, 1e-14, 0, 1e-14); /* rounding */
    CHECK(t.high == 1e-9);
    t.what = VG_TINT_SCALARS;
    vgi_tint_end(&t, 0, 3.2, -0.5, 3.3);
    CHECK(t.diverging && t.low == -4 && t.high == 4 && vgi_tint_place(&t, 0) == 0.5 && vgi_tint_place(&t, -9) == 0);
    vgi_tint_end(&t, 0, 0, 0, 0); /* all are 0: there is an end nevertheless */
    CHECK(t.high == 1 && vgi_tint_place(&t, 0) == 0);
    t.what = VG_TINT_SCALES;
    vgi_tint_end(&t, 2, 123, -5, 5);
    CHECK(t.diverging && t.low == -1 && t.high == 1 && vgi_tint_shown(&t, t.low) == 0.5);
    vgi_tint_end(&t, 0, -log2(0.553), log2(0.55), log2(1.11)); /* 1 / 0.553 = 1.808 */
    CHECK_NEAR(vgi_tint_shown(&t, t.high), 1.81, 1e-12);
    CHECK(t.low == -t.high && t.shown_low == t.low); /* the least lies beyond the end */
    CHECK_NEAR(vgi_tint_shown(&t, t.shown_high), 1.11, 1e-12);
    vgi_tint_end(&t, 4, 123, -5, 123);
    CHECK(t.low == -2 && t.high == 2);
}

static void map_with_a_middle_is_grey_there(void)
{
    float low[3], middle[3], high[3], near[3];
    vgi_map_colour(0, true, low);
    vgi_map_colour(0.5, true, middle);
    vgi_map_colour(1, true, high);
    vgi_map_colour(0.5 - 1e-9, true, near);
    for (int k = 0; k < 3; k++)
        CHECK(fabsf(middle[k] - middle[0]) < 1e-3f && fabsf(middle[k] - near[k]) < 1e-3f && middle[k] > 0.7f);
    CHECK(low[2] > 4 * low[0] && high[0] > 4 * high[2]);
}

/* Vectors of a vertex: one halved and one four times as long are together as long again by the square root of 2. */
static void scales_are_geometric_means(void)
{
    static const double rest[] = {-1, 0, 0, 1, 0, 0, 0, 3, 0, 5, 5, 5},
                        pose[] = {-0.5, 0, 0, 0.5, 0, 0, -0.5, 4, 0, 5, 5, 5};
    static uint32_t start[] = {0, 2, 4}, vert[] = {0, 1, 0, 2};
    const vg_mesh m = {4, 2, start, vert};
    vgi_tint t = {.what = VG_TINT_SCALES};
    vgi_meter meter;
    vgi_spread spread;
    vg_frame f = {.name = (char *)(uintptr_t)"p", .values = (double *)(uintptr_t)pose};
    CHECK(vgi_meter_init(&meter, &t, &m, rest, 1, NULL) == VG_OK);
    CHECK(vgi_tint_read(&t, &meter, &f, NULL, &spread, NULL) == VG_OK);
    double second = log2(4 / sqrt(10)); /* from (-1 0 0)-(0 3 0) to (-0.5 0 0)-(-0.5 4 0) */
    CHECK_NEAR(meter.numbers[0], (-1 + second) / 2, 1e-14);
    CHECK_NEAR(meter.numbers[1], -1, 1e-14);
    CHECK_NEAR(meter.numbers[2], second, 1e-14);
    CHECK(meter.numbers[3] == 0 && spread.least == -1); /* in no face */
    double gone[12] = {0}; /* vectors that have shrunk to nothing are no infinity */
    f.values = gone;
    CHECK(vgi_tint_read(&t, &meter, &f, NULL, &spread, NULL) == VG_OK && spread.least == -20 &&
          isfinite(spread.mean));
    vgi_meter_clear(&meter);
}

/* Of a square and its two sides: contours are where it ends; an edge between two fronts is none,
 * one that is folded over is. */
static void contours_are_where_fronts_end(void)
{
    begin(&s); /* two triangles that share the edge 0-2 */
    point(&s, 0, 0, 0), point(&s, 1, 0, 0), point(&s, 1, 1, 0), point(&s, 0, 1, 0);
    FACE(&s, 0, 1, 2);
    FACE(&s, 0, 2, 3);
    size_t lines[2];
    for (int folded = 0; folded < 2; folded++) {
        /* 3 comes before 1: 0 2 3 is a back */
        if (folded) memcpy(s.points + 9, (double[]){0.9, 0.1, 0.5}, 3 * sizeof(double));
        draw(&d, &s, 0, 0, 200, NULL);
        CHECK(vgi_figure_sides(&d.figure, NULL) == VG_OK && d.figure.nsides == 6);
        vgi_drawing drawing = {.figure = &d.figure, .camera = &d.camera, .points = d.points, .contour = 1.5f};
        vgi_raster_clear(&d.raster);
        CHECK(vgi_raster_init(&d.raster, 200, 200, NULL) == VG_OK && vgi_draw(&d.raster, &drawing, NULL) == VG_OK);
        lines[folded] = 0;
        /* the diagonal */
        for (size_t i = 60; i < 140; i++) lines[folded] += d.raster.at[(199 - i) * 200 + i].kind == VGI_CONTOUR;
        CHECK(count_kind(&d.raster, VGI_CONTOUR) > 3 * 160 * 2);
        undraw(&d);
    }
    CHECK(lines[0] == 0 && lines[1] > 70);
}

/* ---- text ---- */

enum { LINE_W = 240, LINE_H = 24 };

static const unsigned char black[3] = {0, 0, 0};

/* A line of text on a canvas of its own. */
static void set_line(vgi_canvas *c, double anchor, double room, const char *text)
{
    vg_err e = {0};
    CHECK(vgi_canvas_init(c, LINE_W, LINE_H, &e) == VG_OK);
    vgi_text(c, anchor * LINE_W, 16, &(vgi_lettering){black, 12, anchor, room}, text);
    CHECK(vgi_font_check(c->font, &e) == VG_OK);
}

static bool same_picture(const vgi_canvas *a, const vgi_canvas *b)
{
    return memcmp(a->rgb, b->rgb, 3 * LINE_W * LINE_H) == 0;
}

/* The first and the last column that is not white; first > last: none. */
static void find_ink(const vgi_canvas *c, size_t *first, size_t *last)
{
    *first = LINE_W, *last = 0;
    for (size_t y = 0; y < LINE_H; y++)
        for (size_t x = 0; x < LINE_W; x++) {
            if (c->rgb[3 * (y * LINE_W + x)] == 255) continue;
            if (x < *first) *first = x;
            if (x > *last) *last = x;
        }
}

static void every_character_has_its_own_shape(void)
{
    enum { N = 127 - 33 };
    static const char *const foreign[] = {"\xc3\xa4", "\xc3\xa9", "\xd0\xb6", "\xce\xbb", "\xc4\xb0"}; /* a-umlaut e-acute zhe lambda I-dot */
    enum { ALL = N + sizeof foreign / sizeof *foreign };
    vgi_canvas c[ALL];
    for (int i = 0; i < ALL; i++) {
        size_t first, last;
        set_line(c + i, 0, 0, i < N ? (char[]){(char)(33 + i), 0} : foreign[i - N]);
        find_ink(c + i, &first, &last);
        CHECK(first <= last);
        for (int j = 0; j < i; j++) CHECK(!same_picture(c + i, c + j));
    }
    for (int i = 0; i < ALL; i++) vgi_canvas_clear(c + i);
}

static void text_outside_of_the_canvas_is_cut_off(void)
{
    vgi_canvas c;
    size_t first, last;
    set_line(&c, 0, 0, "");
    for (int i = -1; i <= 1; i++)
        for (int j = -1; j <= 1; j++)
            if (i || j) vgi_text(&c, i * 500, j * 500, &(vgi_lettering){black, 12, 0, 0}, "off");
    find_ink(&c, &first, &last);
    CHECK(first > last);
    vgi_canvas_clear(&c);
}

/* A byte that belongs to no character is drawn as U+FFFD, wherever it stands. */
static void text_that_is_no_utf8_is_drawn(void)
{
    static const char *const wrong[] = {"a\xff" "b", "a\xc3" "b", "a\xe2\x80" "b", "ab\xc3", "ab\xf0\x9f", "\x80", "\xc0\xaf"};
    static const char *const right[] = {"a\xef\xbf\xbd" "b", "a\xef\xbf\xbd" "b", "a\xef\xbf\xbd\xef\xbf\xbd" "b", "ab\xef\xbf\xbd",
                                        "ab\xef\xbf\xbd\xef\xbf\xbd", "\xef\xbf\xbd", "\xef\xbf\xbd\xef\xbf\xbd"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        vgi_canvas a, b;
        set_line(&a, 0, 0, wrong[i]);
        set_line(&b, 0, 0, right[i]);
        CHECK(same_picture(&a, &b));
        vgi_canvas_clear(&a);
        vgi_canvas_clear(&b);
    }
}

static void long_names_lose_their_middle(void)
{
    vgi_canvas a, b;
    size_t first, last;
    set_line(&a, 0, 0, "short");
    set_line(&b, 0, 200, "short");
    CHECK(same_picture(&a, &b));
    vgi_canvas_clear(&a);
    vgi_canvas_clear(&b);
    for (int i = 0; i <= 2; i++) {
        set_line(&a, i / 2.0, 100, "a-very-long-name-of-a-frame-in-a-sequence_001");
        find_ink(&a, &first, &last);
        double left = i / 2.0 * LINE_W - i / 2.0 * 100;
        CHECK((double)first >= left - 1 && (double)last <= left + 101 && last - first > 80);
        vgi_canvas_clear(&a);
    }
    set_line(&a, 0, 2, "nothing fits");
    find_ink(&a, &first, &last);
    CHECK(last < 16); /* the ellipsis alone */
    vgi_canvas_clear(&a);
}

static void text_is_as_wide_as_its_parts(void)
{
    vg_err e = {0};
    vgi_font *f = NULL;
    CHECK(vgi_font_open(&f, &e) == VG_OK);
    double all = vgi_text_width(f, 12, "frame_001"), parts = vgi_text_width(f, 12, "frame_") + vgi_text_width(f, 12, "001");
    CHECK(all > 40 && fabs(all - parts) < 1e-9);
    CHECK(fabs(vgi_text_width(f, 24, "frame_001") - 2 * all) < 0.01 * all);
    CHECK(vgi_text_width(f, 12, "") == 0);
    vgi_font_close(&f);
}

TESTS({"cube covers its area", cube_covers_its_area}, {"views show their side", views_show_their_side},
      {"nearer hides farther", nearer_hides_farther}, {"back faces are told apart", back_faces_are_told_apart},
      {"concave face keeps its notch", concave_face_keeps_its_notch}, {"ears cover a comb", ears_cover_a_comb},
      {"ears end on crossed polygons", ears_end_on_crossed_polygons},
      {"wires are round and visible", wires_are_round_and_visible}, {"odd figures are drawn", odd_figures_are_drawn},
      {"sphere is brighter towards the key", sphere_is_brighter_towards_the_key},
      {"colour map gets lighter evenly", colour_map_gets_lighter_evenly},
      {"sheet has the size of its frames", sheet_has_the_size_of_its_frames},
      {"zero error has the lowest colour", zero_error_has_the_lowest_colour},
      {"legend is there only for errors", legend_is_there_only_for_errors},
      {"following holds the figure", following_holds_the_figure},
      {"options change the picture", options_change_the_picture},
      {"threads do not change bytes", threads_do_not_change_bytes}, {"refusals", refusals},
      {"album is evenly spaced", album_is_evenly_spaced},
      {"albums match", albums_match},
      {"colours end at short numbers", colours_end_at_short_numbers},
      {"the map with a middle is grey there", map_with_a_middle_is_grey_there},
      {"scales are geometric means", scales_are_geometric_means},
      {"contours are where fronts end", contours_are_where_fronts_end},
      {"every character has its own shape", every_character_has_its_own_shape},
      {"text outside of the canvas is cut off", text_outside_of_the_canvas_is_cut_off},
      {"text that is not UTF-8 is drawn", text_that_is_no_utf8_is_drawn},
      {"long names lose their middle", long_names_lose_their_middle},
      {"text is as wide as its parts", text_is_as_wide_as_its_parts})
