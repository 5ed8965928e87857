/* shade.c: from samples to pixels: clay or mapped colours under fixed lights, ambient occlusion, outlines. The lights
 * move with the viewer, so that all views are lit alike. Visibility is in raster.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/colour.h"
#include "view/view.h"

#include <math.h>
#include <stdlib.h>

enum { TAPS = 24, PATTERN = 4 };

/* Unit directions in the eye's axes: x right, y up, z towards the viewer. */
static const float key[3] = {-0.5194f, 0.5993f, 0.6092f};
static const float half_way[3] = {-0.2895f, 0.3340f, 0.8970f}; /* half-way between key light and viewer */
static const float fill[3] = {0.8421f, 0.1050f, 0.5290f};
static const float rim[3] = {0.5902f, 0.5202f, -0.6173f};

static const float clay_front[3] = {0.630f, 0.525f, 0.437f};
static const float clay_back[3] = {0.265f, 0.375f, 0.545f};
static const float wire_colour[3] = {0.110f, 0.150f, 0.220f}, contour_colour[3] = {0.012f, 0.014f, 0.020f};
static const float page_top[3] = {0.905f, 0.913f, 0.930f}, page_bottom[3] = {0.740f, 0.757f, 0.785f};

static float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static float clamp01(float x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

/* ---- ambient occlusion in the plane of the picture ---- */

/* A neighbour that is looked at: so many pixels away, to the right and down; the same in samples, y up. */
typedef struct tap {
    int x, y;
    float dx, dy;
} tap;

typedef struct pixels {
    const vgi_raster *r;
    size_t w, h, step;   /* step: samples per pixel */
    float reach;         /* of occlusion, in samples */
    int far;             /* in pixels, of every tap */
    tap taps[PATTERN * PATTERN][TAPS];
    vgi_sample *middle;  /* w * h: the sample in the middle of each pixel, close together */
    float *raw, *light;  /* w * h: the share of the sky that is seen; its mean over the pattern */
} pixels;

static void unit_normal(const vgi_sample *s, float n[3])
{
    n[0] = s->normal[0], n[1] = s->normal[1], n[2] = s->normal[2];
    if (n[2] < 0) n[2] = 0; /* a smooth normal may face away at the outline */
    float size = sqrtf(dot3(n, n));
    if (!(size > 0)) n[0] = n[1] = 0, n[2] = size = 1;
    for (int k = 0; k < 3; k++) n[k] /= size;
}

/* Few taps would show as rings: their start turns from pixel to pixel, and what they give is blurred. */
static void turn_taps(pixels *p)
{
    for (int i = 0; i < TAPS; i++) { /* sunflower pattern: even in area, denser inside by the exponent */
        float radius = p->reach * powf(((float)i + 0.5f) / TAPS, 0.75f), angle = 2.39996323f * (float)i;
        for (int turn = 0; turn < PATTERN * PATTERN; turn++) {
            float all = angle + (float)turn * (float)(2 * M_PI / (PATTERN * PATTERN));
            tap *t = &p->taps[turn][i];
            t->x = (int)lrintf(radius * cosf(all) / (float)p->step), t->y = -(int)lrintf(radius * sinf(all) / (float)p->step);
            t->dx = (float)(t->x * (int)p->step), t->dy = (float)(-t->y * (int)p->step);
        }
    }
    p->far = (int)(p->reach / (float)p->step) + 1;
}

/* How much of the sky of sample s its neighbour, d away from it, hides. Nothing where that is empty: d is infinite. */
static float hidden(const float n[3], const float d[3], float reach)
{
    float square = dot3(d, d), near = 1 - square / (reach * reach), above = dot3(n, d);
    if (!(near > 0 && above > 0)) return 0;
    float cosine = above / sqrtf(square) - 0.12f;
    return cosine > 0 ? cosine * near : 0;
}

static float sky_seen(const pixels *p, size_t x, size_t y)
{
    const vgi_sample *s = p->middle + y * p->w + x;
    if (s->kind == VGI_EMPTY || s->kind >= VGI_WIRE) return 1;
    long far = p->far, left = (long)x, above = (long)y, w = (long)p->w, h = (long)p->h;
    bool inside = left >= far && above >= far && left + far < w && above + far < h;
    float n[3], sum = 0;
    unit_normal(s, n);
    const tap *t = p->taps[x % PATTERN * PATTERN + y % PATTERN];
    for (int i = 0; i < TAPS; i++, t++) {
        if (!inside && (left + t->x < 0 || above + t->y < 0 || left + t->x >= w || above + t->y >= h)) continue;
        float d[3] = {t->dx, t->dy, s[t->y * w + t->x].z - s->z};
        sum += hidden(n, d, p->reach);
    }
    return clamp01(1 - 2.1f * sum / TAPS);
}

/* Mean over the pattern, within the same surface only. */
static float smooth_sky(const pixels *p, size_t x, size_t y)
{
    const vgi_sample *s = p->middle + y * p->w + x;
    size_t half = PATTERN / 2, x0 = x > half ? x - half : 0, y0 = y > half ? y - half : 0,
           x1 = x + half < p->w ? x + half : p->w, y1 = y + half < p->h ? y + half : p->h;
    float sum = 0, weight = 0;
    for (size_t j = y0; j < y1; j++)
        for (size_t i = x0; i < x1; i++) {
            if (!(fabsf(p->middle[j * p->w + i].z - s->z) <= p->reach * 0.25f)) continue;
            sum += p->raw[j * p->w + i];
            weight++;
        }
    return weight > 0 ? sum / weight : 1;
}

static int light_corners(pixels *p, vg_err *e)
{
    size_t n = p->w * p->h; /* smaller than the samples, which are already allocated */
    p->middle = vgi_array_raw(n, sizeof *p->middle, e);
    p->raw = vgi_array_raw(n, sizeof *p->raw, e);
    p->light = vgi_array_raw(n, sizeof *p->light, e);
    if (!p->middle || !p->raw || !p->light) return VG_ENOMEM;
    turn_taps(p);
    for (size_t y = 0; y < p->h; y++)
        for (size_t x = 0; x < p->w; x++)
            p->middle[y * p->w + x] = p->r->at[(y * p->step + p->step / 2) * p->r->w + x * p->step + p->step / 2];
    for (size_t y = 0; y < p->h; y++)
        for (size_t x = 0; x < p->w; x++) p->raw[y * p->w + x] = sky_seen(p, x, y);
    for (size_t y = 0; y < p->h; y++)
        for (size_t x = 0; x < p->w; x++)
            p->light[y * p->w + x] = p->middle[y * p->w + x].kind == VGI_EMPTY ? 1 : smooth_sky(p, x, y);
    return VG_OK;
}

/* Outline samples of a pixel whose centre is empty take the light of a neighbour. */
static float corner_light(const pixels *p, size_t x, size_t y)
{
    if (p->middle[y * p->w + x].kind != VGI_EMPTY) return p->light[y * p->w + x];
    float least = 1;
    for (size_t j = y ? y - 1 : 0; j <= y + 1 && j < p->h; j++)
        for (size_t i = x ? x - 1 : 0; i <= x + 1 && i < p->w; i++)
            least = vgi_least(least, p->light[j * p->w + i]);
    return least;
}

/* ---- outlines ---- */

/* By how much a sample is nearer than its two neighbours along one axis predict. */
static float depth_step(const vgi_raster *raster, size_t at, size_t room_before, size_t room_after, size_t stride,
                        size_t reach, float limit)
{
    float z = raster->at[at].z, floor = z - 4 * limit;
    float a = room_before >= reach ? raster->at[at - reach * stride].z : floor;
    float b = room_after >= reach ? raster->at[at + reach * stride].z : floor;
    return 2 * z - vgi_most(a, floor) - vgi_most(b, floor);
}

static float outline(const vgi_raster *raster, size_t x, size_t y, size_t reach, float limit)
{
    size_t at = y * raster->w + x;
    float step = vgi_most(depth_step(raster, at, x, raster->w - 1 - x, 1, reach, limit),
                          depth_step(raster, at, y, raster->h - 1 - y, raster->w, reach, limit));
    float t = clamp01((step - 0.5f * limit) / limit);
    return t * t * (3 - 2 * t);
}

/* ---- light ---- */

static void light_clay(const float n[3], const float albedo[3], float sky_seen_here, float out[3])
{
    float k = clamp01((dot3(n, key) + 0.08f) / 1.08f), f = clamp01(dot3(n, fill)), sky = 0.5f + 0.5f * n[1];
    float r = clamp01(dot3(n, rim)), h = clamp01(dot3(n, half_way)), open = sky_seen_here * sky_seen_here;
    float gloss = h * h, edge = r * r * 0.55f * sky_seen_here;
    gloss *= gloss, gloss *= gloss, gloss *= gloss, gloss *= gloss; /* to the power 32 */
    gloss *= 0.055f * sky_seen_here;
    const float warm[3] = {1.02f, 0.97f, 0.90f}, above[3] = {0.31f, 0.36f, 0.44f},
                below[3] = {0.115f, 0.095f, 0.085f};
    const float cool[3] = {0.065f, 0.085f, 0.12f};
    for (int i = 0; i < 3; i++) {
        float light = 1.08f * k * warm[i] * (0.35f + 0.65f * sky_seen_here) +
                      (sky * above[i] + (1 - sky) * below[i]) * open + f * cool[i] * sky_seen_here;
        out[i] = albedo[i] * light + gloss + edge * above[i];
    }
}

/* A factor that is 1 on an unoccluded surface facing the viewer, so that its colours match the legend. */
static float light_error(const float n[3], float sky_seen_here)
{
    float facing = (key[2] + 0.3f) / 1.3f, k = clamp01((dot3(n, key) + 0.3f) / 1.3f) / facing;
    return (0.38f + 0.62f * vgi_least(k, 1.12f)) * (0.25f + 0.75f * sky_seen_here);
}

static void patch_colour(uint32_t number, float linear[3])
{
    unsigned char rgb[3];
    vgi_patch_colour(number, rgb);
    for (int k = 0; k < 3; k++) linear[k] = vgi_linear(rgb[k]);
}

static void light_sample(const vgi_look *l, const vgi_sample *s, float sky_seen_here, float out[3])
{
    float n[3];
    if (s->kind == VGI_CONTOUR) {
        memcpy(out, contour_colour, sizeof contour_colour);
        return;
    }
    unit_normal(s, n);
    float patch[3];
    if (l->patches) patch_colour(s->value, patch);
    if (l->numbers || l->patches) {
        const float *colour = l->patches ? patch : l->palette->map[(size_t)s->value * (VGI_MAP_STEPS - 1) / 65535];
        float factor = light_error(n, sky_seen_here) * (s->kind == VGI_BACK ? 0.75f : 1);
        for (int k = 0; k < 3; k++) out[k] = colour[k] * factor;
    } else {
        const float *albedo = s->kind == VGI_FRONT ? clay_front : s->kind == VGI_BACK ? clay_back : wire_colour;
        light_clay(n, albedo, sky_seen_here, out);
    }
}

/* ---- pixels ---- */

typedef struct background {
    const vgi_look *look;
    const vgi_camera *camera;
    double height;
    unsigned char row[3]; /* the pixels of one row that show it, where there is no ground */
} background;

static void light_background(const background *b, double x, double y, float out[3])
{
    float down = (float)(y / b->height), light = 1;
    if (b->look->ground) {
        const vgi_camera *c = b->camera;
        double pixel = (double)b->look->oversampling / c->scale;
        light = vgi_ground_light(b->look->ground, c, c->x + (x - c->width / 2) / c->scale,
                                 c->y + (c->height / 2 - y) / c->scale, pixel);
    }
    for (int k = 0; k < 3; k++) out[k] = light * (page_top[k] + down * down * (page_bottom[k] - page_top[k]));
}

/* What is left of the light of a sample where it is on an outline or an edge. */
static float brightness(const vgi_look *l, const vgi_raster *raster, size_t x, size_t y, size_t step)
{
    const vgi_sample *s = raster->at + y * raster->w + x;
    if (s->kind == VGI_CONTOUR) return 1;
    float line = s->kind >= VGI_WIRE ? 0 : outline(raster, x, y, step > 2 ? step - 1 : 1, l->outline);
    return (1 - 0.62f * line) * (s->edge ? 1 - l->edge_strength : 1);
}

/* The mean of a pixel's samples where one surface fills it that is nearly flat there, which is lit once. Else false:
 * each sample is lit by itself. */
static bool mean_sample(const vgi_raster *raster, const vgi_sample *first, size_t step, bool patches, vgi_sample *mean)
{
    int32_t value = 0, normal[3] = {0}, n = (int32_t)(step * step);
    if (first->kind == VGI_EMPTY) return false;
    for (size_t j = 0; j < step; j++)
        for (const vgi_sample *s = first + j * raster->w, *end = s + step; s < end; s++) {
            if (s->kind != first->kind || (patches && s->value != first->value)) return false;
            value += s->value;
            for (int k = 0; k < 3; k++) normal[k] += s->normal[k];
        }
    *mean = *first;
    mean->value = (uint16_t)(value / n);
    for (int k = 0; k < 3; k++) mean->normal[k] = (int16_t)(normal[k] / n);
    float size[3] = {mean->normal[0], mean->normal[1], mean->normal[2]};
    return dot3(size, size) > 0.98f * 0.98f * 32767 * 32767;
}

/* The sum of the colours of a pixel's samples; returns how many are empty. */
static size_t light_samples(const vgi_look *l, const pixels *p, size_t x, size_t y, float sum[3])
{
    const vgi_raster *raster = p->r;
    size_t empty = 0, step = p->step, at = y * step * raster->w + x * step;
    float c[3], sky = -1;
    vgi_sample mean;
    bool once = mean_sample(raster, raster->at + at, step, l->patches, &mean);
    if (once) light_sample(l, &mean, corner_light(p, x, y), c);
    for (size_t j = 0; j < step; j++)
        for (size_t i = 0; i < step; i++) {
            const vgi_sample *s = raster->at + at + j * raster->w + i;
            if (s->kind == VGI_EMPTY) {
                empty++;
                continue;
            }
            if (!once) {
                if (sky < 0) sky = corner_light(p, x, y);
                light_sample(l, s, sky, c);
            }
            float bright = brightness(l, raster, x * step + i, y * step + j, step);
            for (int k = 0; k < 3; k++) sum[k] += vgi_least(c[k] * bright, 1);
        }
    return empty;
}

static void shade_pixel(const vgi_look *l, const pixels *p, const background *b, size_t x, size_t y,
                        unsigned char rgb[3])
{
    float sum[3] = {0, 0, 0}, page[3];
    size_t s = p->step, empty = light_samples(l, p, x, y, sum);
    if (empty == s * s && !l->ground) {
        memcpy(rgb, b->row, 3);
        return;
    }
    if (empty) {
        /* the grid is already anti-aliased: one evaluation per pixel is enough */
        light_background(b, (double)(x * s) + (double)s / 2, (double)(y * s) + (double)s / 2, page);
        for (int k = 0; k < 3; k++) sum[k] += (float)empty * page[k];
    }
    for (int k = 0; k < 3; k++) rgb[k] = vgi_encode(l->palette, sum[k] / (float)(s * s));
}

static void shade_row(const vgi_look *l, const pixels *p, background *b, size_t y, unsigned char *rgb)
{
    float page[3];
    light_background(b, 0, (double)(y * p->step) + (double)p->step / 2, page);
    for (int k = 0; k < 3; k++) b->row[k] = vgi_encode(l->palette, page[k]);
    for (size_t x = 0; x < p->w; x++) shade_pixel(l, p, b, x, y, rgb + 3 * x);
}

int vgi_shade(const vgi_look *l, const vgi_raster *raster, const vgi_camera *c, unsigned char *rgb, vg_err *e)
{
    pixels p = {.r = raster, .w = raster->w / l->oversampling, .h = raster->h / l->oversampling, .step = l->oversampling,
                .reach = l->reach};
    background b = {.look = l, .camera = c, .height = (double)raster->h};
    int r = light_corners(&p, e);
    for (size_t y = 0; r == VG_OK && y < p.h; y++) shade_row(l, &p, &b, y, rgb + 3 * y * p.w);
    free(p.middle);
    free(p.raw);
    free(p.light);
    return r;
}
