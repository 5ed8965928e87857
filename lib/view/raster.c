/* raster.c: visibility: triangles and round wires against a z-buffer. A sample stores depth, normal and value; light
 * and colour are in shade.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>

/* Positions are rounded to 1/256 of a sample and the sides of triangles are evaluated in integers, so that faces
 * sharing a side leave no gap. */
enum { GRID = 256 };
/* Pictures are at most 2^15 samples wide; anything further out is not drawn, so that products fit 64 bits. */
#define FAR_OUT 1e6f

/* A concave face with more corners than this is drawn as if it were convex. */
enum { MOST_EARS = 4096 };

int vgi_raster_init(vgi_raster *raster, size_t w, size_t h, vg_err *e)
{
    size_t n;
    *raster = (vgi_raster){.w = w, .h = h};
    if (!vgi_mul(w, h, &n)) return vg_fail(e, VG_ENOMEM, "not enough memory for %zu x %zu samples", w, h);
    raster->at = vgi_array_raw(n, sizeof *raster->at, e);
    if (!raster->at) return VG_ENOMEM;
    const vgi_sample empty = {.z = -INFINITY};
    for (size_t i = 0; i < n; i++) raster->at[i] = empty;
    return VG_OK;
}

void vgi_raster_clear(vgi_raster *raster)
{
    free(raster->at);
    *raster = (vgi_raster){0};
}

static int16_t pack(float x)
{
    return (int16_t)(x * 32767 + (x < 0 ? -0.5f : 0.5f));
}

static void put_sample(vgi_sample *s, float z, const float n[3], float value, int kind)
{
    s->z = z;
    for (int k = 0; k < 3; k++) s->normal[k] = pack(vgi_least(vgi_most(n[k], -1), 1));
    s->value = (uint16_t)(vgi_least(vgi_most(value, 0), 1) * 65535 + 0.5f);
    s->kind = (uint8_t)kind;
    s->edge = 0;
}

/* ---- triangles ---- */

typedef struct side { /* of a triangle: at + dx per sample to the right, dy per sample down; >= 0 inside */
    int64_t at, dx, dy;
} side;

static side side_of(const int64_t p[2], const int64_t q[2], int64_t x, int64_t y)
{
    int64_t ux = q[0] - p[0], uy = q[1] - p[1];
    return (side){ux * (y - p[1]) - uy * (x - p[0]), -uy * GRID, ux * GRID};
}

typedef struct span { /* the range of samples to test, end excluded */
    size_t x0, x1, y0, y1;
} span;

static bool clip_span(const vgi_raster *raster, double x0, double x1, double y0, double y1, span *s)
{
    x0 = fmax(floor(x0), 0), y0 = fmax(floor(y0), 0);
    x1 = fmin(ceil(x1) + 1, (double)raster->w), y1 = fmin(ceil(y1) + 1, (double)raster->h);
    if (!(x0 < x1 && y0 < y1)) return false;
    *s = (span){(size_t)x0, (size_t)x1, (size_t)y0, (size_t)y1};
    return true;
}

/* The samples whose middles are in the box around a triangle. */
static bool cover(const vgi_raster *raster, int64_t p[3][2], span *s)
{
    int64_t end[2] = {(int64_t)raster->w, (int64_t)raster->h}, low[2], high[2];
    for (int k = 0; k < 2; k++) {
        int64_t a = p[0][k], b = p[1][k], c = p[2][k];
        int64_t least = a < b ? (a < c ? a : c) : b < c ? b : c, most = a > b ? (a > c ? a : c) : b > c ? b : c;
        least = least > GRID / 2 ? (least + GRID / 2 - 1) / GRID : 0;
        most = most < GRID / 2 ? 0 : (most + GRID / 2) / GRID;
        low[k] = least, high[k] = most < end[k] ? most : end[k];
        if (low[k] >= high[k]) return false;
    }
    *s = (span){(size_t)low[0], (size_t)high[0], (size_t)low[1], (size_t)high[1]};
    return true;
}

static void fill_sample(vgi_sample *s, const vgi_corner *const c[3], const float w[3], float z, float facing)
{
    float n[3];
    for (int k = 0; k < 3; k++)
        n[k] = facing * (w[0] * c[0]->normal[k] + w[1] * c[1]->normal[k] + w[2] * c[2]->normal[k]);
    put_sample(s, z, n, w[0] * c[0]->value + w[1] * c[1]->value + w[2] * c[2]->value, facing > 0 ? VGI_FRONT : VGI_BACK);
}

static bool near_edge(const float w[3], const float height[3], unsigned edges, float width)
{
    for (int k = 0; k < 3; k++)
        if (edges >> k & 1 && w[k] * height[k] < width) return true;
    return false;
}

/* edges: bit i marks the side opposite corner i as an edge of the face. */
static void draw_triangle(vgi_raster *raster, const vgi_corner *const corner[3], unsigned edges, float edge_width)
{
    const vgi_corner *c[3] = {corner[0], corner[1], corner[2]};
    int64_t p[3][2];
    for (int k = 0; k < 3; k++) {
        if (!(fabsf(c[k]->x) < FAR_OUT && fabsf(c[k]->y) < FAR_OUT)) return;
        p[k][0] = llrintf(c[k]->x * GRID), p[k][1] = llrintf(c[k]->y * GRID);
    }
    int64_t area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    span s;
    if (area == 0 || !cover(raster, p, &s)) return;
    /* y points down: a face that is counter-clockwise for the viewer has a negative area here */
    float facing = area < 0 ? 1 : -1;
    int64_t sign = area < 0 ? -1 : 1;
    float inverse = 1 / (float)(area * sign), height[3] = {0};
    if (!(edge_width > 0)) edges = 0;
    side e[3];
    for (int k = 0; k < 3; k++) {
        const int64_t *a = p[(k + 1) % 3], *b = p[(k + 2) % 3];
        e[k] = side_of(a, b, (int64_t)s.x0 * GRID + GRID / 2, (int64_t)s.y0 * GRID + GRID / 2);
        e[k] = (side){sign * e[k].at, sign * e[k].dx, sign * e[k].dy};
        if (edges) height[k] = 1 / (inverse * hypotf((float)(b[0] - a[0]), (float)(b[1] - a[1])) * GRID);
    }
    for (size_t y = s.y0; y < s.y1; y++) {
        int64_t w0 = e[0].at, w1 = e[1].at, w2 = e[2].at;
        vgi_sample *row = raster->at + y * raster->w;
        for (size_t x = s.x0; x < s.x1; x++, w0 += e[0].dx, w1 += e[1].dx, w2 += e[2].dx) {
            if ((w0 | w1 | w2) < 0) continue;
            float w[3] = {(float)w0 * inverse, (float)w1 * inverse, (float)w2 * inverse};
            float z = w[0] * c[0]->z + w[1] * c[1]->z + w[2] * c[2]->z;
            if (!(z > row[x].z)) continue;
            fill_sample(row + x, c, w, z, facing);
            if (edges) row[x].edge = near_edge(w, height, edges, edge_width);
        }
        for (int k = 0; k < 3; k++) e[k].at += e[k].dy;
    }
}

/* ---- wires ---- */

/* The part of a row inside the strip of the given radius around the line a-b; the caller has clipped to the box of
 * the rounded ends. */
static void strip_span(const vgi_corner *a, float dx, float dy, float reach, double y, size_t *x0, size_t *x1)
{
    if (fabsf(dy) < 1e-3f) return;
    double middle = a->x + (y - a->y) * dx / dy, half = reach / fabsf(dy) + 1;
    if (middle - half > (double)*x0) *x0 = (size_t)fmin(middle - half, (double)*x1);
    if (middle + half < (double)*x1) *x1 = (size_t)fmax(ceil(middle + half), (double)*x0);
}

static void draw_wire(vgi_raster *raster, const vgi_corner *a, const vgi_corner *b, float radius, int kind)
{
    span s;
    if (!(fabsf(a->x) < FAR_OUT && fabsf(a->y) < FAR_OUT && fabsf(b->x) < FAR_OUT && fabsf(b->y) < FAR_OUT)) return;
    if (!clip_span(raster, fminf(a->x, b->x) - radius, fmaxf(a->x, b->x) + radius, fminf(a->y, b->y) - radius,
                   fmaxf(a->y, b->y) + radius, &s))
        return;
    float dx = b->x - a->x, dy = b->y - a->y, square = dx * dx + dy * dy;
    for (size_t y = s.y0; y < s.y1; y++) {
        size_t x0 = s.x0, x1 = s.x1;
        float py = (float)y + 0.5f;
        strip_span(a, dx, dy, radius * sqrtf(square), py, &x0, &x1);
        for (size_t x = x0; x < x1; x++) {
            float px = (float)x + 0.5f;
            float t = square > 0 ? vgi_least(vgi_most(((px - a->x) * dx + (py - a->y) * dy) / square, 0), 1) : 0;
            float ox = (px - a->x - t * dx) / radius, oy = (py - a->y - t * dy) / radius, off = ox * ox + oy * oy;
            if (off > 1) continue;
            float n[3] = {ox, -oy, sqrtf(1 - off)}, z = a->z + t * (b->z - a->z) + radius * n[2];
            vgi_sample *sample = raster->at + y * raster->w + x;
            if (z > sample->z) put_sample(sample, z, n, a->value + t * (b->value - a->value), kind);
        }
    }
}

/* ---- a whole figure ---- */

typedef struct work { /* of one drawing */
    vgi_raster *raster;
    const vgi_drawing *drawing;
    float *seen, *face, *normals;
    vgi_corner *corner; /* of the current face, plus one for its middle */
    double *flat;       /* the face projected into a plane */
    size_t *clip, *triangles;
} work;

static void turn_normal(const vgi_camera *c, const float n[3], float out[3])
{
    const float *axes[3] = {c->right, c->up, c->toward};
    for (int k = 0; k < 3; k++) out[k] = axes[k][0] * n[0] + axes[k][1] * n[1] + axes[k][2] * n[2];
}

static void load_corner(const work *k, uint32_t v, const float *normal, vgi_corner *to)
{
    const vgi_drawing *d = k->drawing;
    to->x = k->seen[3 * (size_t)v], to->y = k->seen[3 * (size_t)v + 1], to->z = k->seen[3 * (size_t)v + 2];
    to->value = d->values ? d->values[v] : 0;
    if (normal) turn_normal(d->camera, normal, to->normal);
    else to->normal[0] = to->normal[1] = 0, to->normal[2] = 1;
}

/* The mean of the corners: the centre of a fan that does not favour any corner. */
static void load_middle(vgi_corner *corner, size_t n)
{
    vgi_corner sum = {0};
    for (size_t i = 0; i < n; i++) {
        sum.x += corner[i].x, sum.y += corner[i].y, sum.z += corner[i].z, sum.value += corner[i].value;
        for (int k = 0; k < 3; k++) sum.normal[k] += corner[i].normal[k];
    }
    float share = 1 / (float)n;
    sum.x *= share, sum.y *= share, sum.z *= share, sum.value *= share;
    float size = sqrtf(sum.normal[0] * sum.normal[0] + sum.normal[1] * sum.normal[1] + sum.normal[2] * sum.normal[2]);
    for (int k = 0; k < 3; k++) sum.normal[k] = size > 0 ? sum.normal[k] / size : 0;
    corner[n] = sum;
}

/* Whether the face can be drawn as a fan about its centre: no triangle of the fan is reversed relative to the face's
 * normal. */
static bool is_fan(const vgi_corner *c, size_t n, const float area[3])
{
    const vgi_corner *o = c + n;
    float limit = -1e-6f * (area[0] * area[0] + area[1] * area[1] + area[2] * area[2]);
    for (size_t i = 0; i < n; i++) {
        const vgi_corner *p = c + i, *q = c + (i + 1 == n ? 0 : i + 1);
        float a[3] = {p->x - o->x, p->y - o->y, p->z - o->z}, b[3] = {q->x - o->x, q->y - o->y, q->z - o->z};
        float turn = (a[1] * b[2] - a[2] * b[1]) * area[0] + (a[2] * b[0] - a[0] * b[2]) * area[1] +
                     (a[0] * b[1] - a[1] * b[0]) * area[2];
        if (turn < limit) return false;
    }
    return true;
}

/* The projected area vector of the corners. */
static void seen_area(const vgi_corner *c, size_t n, float area[3])
{
    area[0] = area[1] = area[2] = 0;
    for (size_t i = 1; i + 1 < n; i++) {
        float a[3] = {c[i].x - c->x, c[i].y - c->y, c[i].z - c->z};
        float b[3] = {c[i + 1].x - c->x, c[i + 1].y - c->y, c[i + 1].z - c->z};
        area[0] += a[1] * b[2] - a[2] * b[1];
        area[1] += a[2] * b[0] - a[0] * b[2];
        area[2] += a[0] * b[1] - a[1] * b[0];
    }
}

static void draw_fan(work *k, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const vgi_corner *c[3] = {k->corner + n, k->corner + i, k->corner + (i + 1 == n ? 0 : i + 1)};
        draw_triangle(k->raster, c, 1, k->drawing->edge);
    }
}

/* Project along the axis in which the area is largest, which distorts the shape least. */
static void draw_ears(work *k, size_t n, const float area[3])
{
    int drop = 0;
    for (int i = 1; i < 3; i++)
        if (fabsf(area[i]) > fabsf(area[drop])) drop = i;
    for (size_t i = 0; i < n; i++) {
        const vgi_corner *c = k->corner + i;
        double xyz[3] = {c->x, c->y, c->z};
        k->flat[2 * i] = xyz[(drop + 1) % 3], k->flat[2 * i + 1] = xyz[(drop + 2) % 3];
    }
    vgi_ear_clip(k->flat, n, k->clip, k->triangles);
    for (size_t t = 0; t < n - 2; t++) {
        const size_t *p = k->triangles + 3 * t;
        const vgi_corner *c[3] = {k->corner + p[0], k->corner + p[1], k->corner + p[2]};
        unsigned edges = 0;
        for (int i = 0; i < 3; i++)
            if ((p[(i + 1) % 3] + 1) % n == p[(i + 2) % 3]) edges |= 1u << i;
        draw_triangle(k->raster, c, edges, k->drawing->edge);
    }
}

static void draw_face(work *k, size_t f)
{
    const vg_mesh *m = k->drawing->figure->mesh;
    size_t first = m->start[f], n = m->start[f + 1] - first;
    for (size_t i = 0; i < n; i++)
        load_corner(k, m->vert[first + i], n > 2 ? k->normals + 3 * (first + i) : NULL, k->corner + i);
    for (size_t i = 0; k->drawing->patches && i < n; i++)
        k->corner[i].value = (float)(k->drawing->patches[f] & 0xffff) / 65535;
    if (n == 2) {
        draw_wire(k->raster, k->corner, k->corner + 1, k->drawing->wire, VGI_WIRE);
        for (int i = 0; i < 2; i++)
            draw_wire(k->raster, k->corner + i, k->corner + i, 1.6f * k->drawing->wire, VGI_WIRE);
    } else if (n == 3) {
        const vgi_corner *c[3] = {k->corner, k->corner + 1, k->corner + 2};
        draw_triangle(k->raster, c, 7, k->drawing->edge);
    } else {
        float area[3];
        seen_area(k->corner, n, area);
        load_middle(k->corner, n);
        if (n > MOST_EARS || is_fan(k->corner, n, area)) draw_fan(k, n);
        else draw_ears(k, n, area);
    }
}

static bool is_empty(const vgi_raster *raster)
{
    for (size_t i = 0; i < raster->w * raster->h; i++)
        if (raster->at[i].kind != VGI_EMPTY) return false;
    return true;
}

/* A flat figure seen from the side, or one collapsed to a line or point, covers no sample: draw its edges. */
static void draw_edges(work *k, float radius)
{
    const vg_mesh *m = k->drawing->figure->mesh;
    for (size_t f = 0; f < m->nf; f++) {
        size_t first = m->start[f], n = m->start[f + 1] - first;
        for (size_t i = 0; i < n; i++) {
            load_corner(k, m->vert[first + i], NULL, k->corner);
            load_corner(k, m->vert[first + (i + 1) % n], NULL, k->corner + 1);
            draw_wire(k->raster, k->corner, k->corner + 1, radius, VGI_WIRE);
        }
    }
}

/* Whether the face shows its front to the viewer; false if seen edge-on. */
static bool faces_viewer(const work *k, const vgi_side *s)
{
    const float *area = k->face + 3 * (size_t)s->face, *toward = k->drawing->camera->toward;
    return area[0] * toward[0] + area[1] * toward[1] + area[2] * toward[2] > 0;
}

/* An edge is on the contour if a front face meets a back face there, or at a border. Two faces that run in the same
 * direction along their edge have opposite orientation: the front of one is the back of the other. */
static bool is_contour(const work *k, const vgi_side *s, size_t n)
{
    if (n == 1) return true;
    for (size_t i = 1; i < n; i++)
        if (faces_viewer(k, s + i) != (faces_viewer(k, s) != (s[i].forth == s->forth))) return true;
    return false;
}

/* Contours are drawn as wires around edges: a surface in front hides them. */
static void draw_contours(work *k, float radius)
{
    const vgi_figure *g = k->drawing->figure;
    for (size_t i = 0, n; i < g->nsides; i += n) {
        for (n = 1; i + n < g->nsides && g->side[i + n].a == g->side[i].a && g->side[i + n].b == g->side[i].b;) n++;
        if (!is_contour(k, g->side + i, n)) continue;
        load_corner(k, g->side[i].a, NULL, k->corner);
        load_corner(k, g->side[i].b, NULL, k->corner + 1);
        draw_wire(k->raster, k->corner, k->corner + 1, radius, VGI_CONTOUR);
    }
}

static int make_work(work *k, vg_err *e)
{
    const vgi_figure *g = k->drawing->figure;
    size_t n = g->max_corners + 1, ears = n < MOST_EARS + 1 ? n : MOST_EARS + 1;
    k->seen = vgi_array_raw(g->mesh->nv, 3 * sizeof *k->seen, e);
    k->face = vgi_array_raw(g->mesh->nf, 3 * sizeof *k->face, e);
    k->normals = vgi_array_raw(vg_mesh_corners(g->mesh), 3 * sizeof *k->normals, e);
    k->corner = vgi_array(n, sizeof *k->corner, e);
    k->flat = vgi_array_raw(ears, 2 * sizeof *k->flat, e);
    k->clip = vgi_array_raw(ears, 3 * sizeof *k->clip, e);
    k->triangles = vgi_array_raw(ears, 3 * sizeof *k->triangles, e);
    return k->seen && k->face && k->normals && k->corner && k->flat && k->clip && k->triangles ? VG_OK : VG_ENOMEM;
}

static void free_work(work *k)
{
    free(k->seen);
    free(k->face);
    free(k->normals);
    free(k->corner);
    free(k->flat);
    free(k->clip);
    free(k->triangles);
}

int vgi_draw(vgi_raster *raster, const vgi_drawing *d, vg_err *e)
{
    const vg_mesh *m = d->figure->mesh;
    work k = {.raster = raster, .drawing = d};
    int r = make_work(&k, e);
    if (r == VG_OK) {
        vgi_camera_project(d->camera, d->points, m->nv, k.seen);
        vgi_figure_normals(d->figure, d->points, k.face, k.normals);
        for (size_t f = 0; f < m->nf; f++) draw_face(&k, f);
        if (m->nf > 0 && is_empty(raster)) draw_edges(&k, d->wire);
        else if (d->contour > 0) draw_contours(&k, d->contour);
        for (size_t v = 0; m->nf == 0 && v < m->nv; v++) {
            load_corner(&k, (uint32_t)v, NULL, k.corner);
            draw_wire(raster, k.corner, k.corner, 1.6f * d->wire, VGI_WIRE);
        }
    }
    free_work(&k);
    return r;
}
