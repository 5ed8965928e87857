/* shade.c: from samples to pixels: clay or mapped colours under fixed lights, ambient occlusion, outlines. The lights
 * move with the viewer, so that all views are lit alike. Visibility is in raster.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/colour.h"
#include "view/view.h"

#include <math.h>

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

static float dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static float clamp01(float x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

/* ---- ambient occlusion in the plane of the picture ---- */

typedef struct pixels {
    const vgi_raster *r;
    size_t w, h, step; /* step: samples per pixel */
    float *light;      /* w * h */
} pixels;

static const vgi_sample *middle_sample(const pixels *p, size_t x, size_t y)
{
    return p->r->at + (y * p->step + p->step / 2) * p->r->w + x * p->step + p->step / 2;
}

static void unit_normal(const vgi_sample *s, float n[3])
{
    for (int k = 0; k < 3; k++) n[k] = s->normal[k];
    if (n[2] < 0) n[2] = 0; /* a smooth normal may face away at the outline */
    float size = sqrtf(dot(n, n));
    if (!(size > 0)) n[0] = n[1] = 0, n[2] = size = 1;
    for (int k = 0; k < 3; k++) n[k] /= size;
}

/* One tap: how much of the sky of sample s its neighbour t hides. */
static float hidden(const vgi_sample *s, const float n[3], const vgi_sample *t, float dx, float dy, float reach)
{
    if (t->kind == VGI_EMPTY) return 0;
    float d[3] = {dx, dy, t->z - s->z}, square = dot(d, d), near = 1 - square / (reach * reach);
    if (near <= 0 || square <= 0) return 0;
    float cosine = dot(n, d) / sqrtf(square) - 0.12f;
    return cosine > 0 ? cosine * near : 0;
}

static float sky_seen(const pixels *p, size_t x, size_t y, const float taps[][2], float reach)
{
    const vgi_sample *s = middle_sample(p, x, y);
    if (s->kind == VGI_EMPTY || s->kind >= VGI_WIRE) return 1;
    float n[3], sum = 0;
    unit_normal(s, n);
    /* few taps would show as rings: rotate their start from pixel to pixel, and blur */
    float angle = (float)((x % PATTERN) * PATTERN + y % PATTERN) * (float)(2 * M_PI / (PATTERN * PATTERN));
    float cosine = cosf(angle), sine = sinf(angle);
    for (int i = 0; i < TAPS; i++) {
        float dx = reach * (taps[i][0] * cosine - taps[i][1] * sine),
              dy = reach * (taps[i][0] * sine + taps[i][1] * cosine);
        long px = (long)x + lrintf(dx / (float)p->step), py = (long)y - lrintf(dy / (float)p->step);
        if (px < 0 || py < 0 || px >= (long)p->w || py >= (long)p->h) continue;
        sum += hidden(s, n, middle_sample(p, (size_t)px, (size_t)py), (float)(px - (long)x) * (float)p->step,
                      (float)((long)y - py) * (float)p->step, reach);
    }
    return clamp01(1 - 2.1f * sum / TAPS);
}

/* Mean over the pattern, within the same surface only. */
static float smooth_sky(const pixels *p, const float *raw, size_t x, size_t y, float step_limit)
{
    const vgi_sample *s = middle_sample(p, x, y);
    float sum = 0, weight = 0;
    for (int j = -PATTERN / 2; j < PATTERN / 2; j++)
        for (int i = -PATTERN / 2; i < PATTERN / 2; i++) {
            long px = (long)x + i, py = (long)y + j;
            if (px < 0 || py < 0 || px >= (long)p->w || py >= (long)p->h) continue;
            const vgi_sample *t = middle_sample(p, (size_t)px, (size_t)py);
            if (t->kind == VGI_EMPTY || fabsf(t->z - s->z) > step_limit) continue;
            sum += raw[(size_t)py * p->w + (size_t)px];
            weight++;
        }
    return weight > 0 ? sum / weight : 1;
}

static int light_corners(pixels *p, float reach, vg_err *e)
{
    size_t n = p->w * p->h; /* smaller than the samples, which are already allocated */
    float taps[TAPS][2], *raw = vgi_array_raw(n, sizeof *raw, e);
    p->light = vgi_array_raw(n, sizeof *p->light, e);
    if (!raw || !p->light) {
        free(raw);
        return VG_ENOMEM;
    }
    for (int i = 0; i < TAPS; i++) { /* sunflower pattern: even in area, denser inside by the exponent */
        float radius = powf(((float)i + 0.5f) / TAPS, 0.75f), angle = 2.39996323f * (float)i;
        taps[i][0] = radius * cosf(angle), taps[i][1] = radius * sinf(angle);
    }
    for (size_t y = 0; y < p->h; y++)
        for (size_t x = 0; x < p->w; x++) raw[y * p->w + x] = sky_seen(p, x, y, taps, reach);
    for (size_t y = 0; y < p->h; y++)
        for (size_t x = 0; x < p->w; x++)
            p->light[y * p->w + x] =
                middle_sample(p, x, y)->kind == VGI_EMPTY ? 1 : smooth_sky(p, raw, x, y, reach * 0.25f);
    free(raw);
    return VG_OK;
}

/* Outline samples of a pixel whose centre is empty take the light of a neighbour. */
static float corner_light(const pixels *p, size_t x, size_t y)
{
    if (middle_sample(p, x, y)->kind != VGI_EMPTY) return p->light[y * p->w + x];
    float least = 1;
    for (size_t j = y ? y - 1 : 0; j <= y + 1 && j < p->h; j++)
        for (size_t i = x ? x - 1 : 0; i <= x + 1 && i < p->w; i++)
            least = fminf(least, p->light[j * p->w + i]);
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
    return 2 * z - fmaxf(a, floor) - fmaxf(b, floor);
}

static float outline(const vgi_raster *raster, size_t x, size_t y, size_t reach, float limit)
{
    size_t at = y * raster->w + x;
    float step = fmaxf(depth_step(raster, at, x, raster->w - 1 - x, 1, reach, limit),
                       depth_step(raster, at, y, raster->h - 1 - y, raster->w, reach, limit));
    float t = clamp01((step - 0.5f * limit) / limit);
    return t * t * (3 - 2 * t);
}

/* ---- light ---- */

static void light_clay(const float n[3], const float albedo[3], float sky_seen_here, float out[3])
{
    float k = clamp01((dot(n, key) + 0.08f) / 1.08f), f = clamp01(dot(n, fill)), sky = 0.5f + 0.5f * n[1];
    float r = clamp01(dot(n, rim)), h = clamp01(dot(n, half_way)), open = sky_seen_here * sky_seen_here;
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
    float facing = (key[2] + 0.3f) / 1.3f, k = clamp01((dot(n, key) + 0.3f) / 1.3f) / facing;
    return (0.38f + 0.62f * fminf(k, 1.12f)) * (0.25f + 0.75f * sky_seen_here);
}

static void patch_colour(uint32_t number, float linear[3])
{
    unsigned char rgb[3];
    vgi_patch_colour(number, rgb);
    for (int k = 0; k < 3; k++) linear[k] = vgi_linear(rgb[k]);
}

static void light_sample(const vgi_look *l, const vgi_sample *s, float sky_seen_here, float line, float out[3])
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
    float dark = (1 - 0.62f * line) * (s->edge ? 1 - l->edge_strength : 1);
    for (int k = 0; k < 3; k++) out[k] *= dark;
}

/* ---- pixels ---- */

typedef struct background {
    const vgi_look *look;
    const vgi_camera *camera;
    double height;
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

static void shade_pixel(const vgi_look *l, const pixels *p, const background *b, size_t x, size_t y,
                        unsigned char rgb[3])
{
    const vgi_raster *raster = p->r;
    float sum[3] = {0, 0, 0}, page[3], sky = -1;
    size_t empty = 0, s = p->step;
    for (size_t j = 0; j < s; j++)
        for (size_t i = 0; i < s; i++) {
            size_t sx = x * s + i, sy = y * s + j;
            const vgi_sample *sample = raster->at + sy * raster->w + sx;
            float c[3];
            if (sample->kind == VGI_EMPTY) {
                empty++;
                continue;
            }
            if (sky < 0) sky = corner_light(p, x, y);
            float line = sample->kind >= VGI_WIRE ? 0 : outline(raster, sx, sy, s > 2 ? s - 1 : 1, l->outline);
            light_sample(l, sample, sky, line, c);
            for (int k = 0; k < 3; k++) sum[k] += fminf(c[k], 1);
        }
    if (empty) {
        /* the grid is already anti-aliased: one evaluation per pixel is enough */
        light_background(b, (double)(x * s) + (double)s / 2, (double)(y * s) + (double)s / 2, page);
        for (int k = 0; k < 3; k++) sum[k] += (float)empty * page[k];
    }
    for (int k = 0; k < 3; k++) rgb[k] = vgi_encode(l->palette, sum[k] / (float)(s * s));
}

int vgi_shade(const vgi_look *l, const vgi_raster *raster, const vgi_camera *c, unsigned char *rgb, vg_err *e)
{
    pixels p = {.r = raster, .w = raster->w / l->oversampling, .h = raster->h / l->oversampling, .step = l->oversampling};
    background b = {l, c, (double)raster->h};
    int r = light_corners(&p, l->reach, e);
    for (size_t y = 0; r == VG_OK && y < p.h; y++)
        for (size_t x = 0; x < p.w; x++) shade_pixel(l, &p, &b, x, y, rgb + 3 * (y * p.w + x));
    free(p.light);
    return r;
}
