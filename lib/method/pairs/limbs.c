/* limbs.c: how the neighbourhoods of a mesh turn in a pose. The surface is divided into cells about 0.04 D wide. The
 * map of a neighbourhood is the mean over the cells within 0.1 D that are connected to the face inside of this ball,
 * weighted by area and distance, so that it changes smoothly over the surface. Folds as small as lips and lids hardly
 * turn it; limbs do.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/limbs.h"
#include "model/incidence.h"
#include "numeric/face.h"

#include <stdlib.h>

enum { CHUNK = 64, ROUNDS = 24, LAST = 3 }; /* of the median; the last ones sharpen it */
static const double CELL = 0.04;            /* in D: largest distance of a face from the centre of its cell */
static const double REACH = 0.1;            /* in D: radius of a neighbourhood */
/* Cosines of the angles up to which an offset does not turn with the neighbourhood of its face, and from which it does:
 * 12 and 22 degrees; and beyond that with the face: 45 and 75. */
static const double AROUND_STAYS = 0.978, AROUND_TURNS = 0.927, STAYS = 0.707, TURNS = 0.259;
/* Shares of the surface that are turned, up to which a pose is a sum of shapes, and from which its limbs move. Expressions
 * of a face come to 0.47, a walk to 0.8. */
static const double SUM = 0.48, LIMBS = 0.6;
static const double HALF = 0.0038; /* 1 - cosine of 5 degrees */
/* Differences of two rotations (Frobenius) below which the median is a mean, and beyond which a part hardly counts in the
 * last rounds. Smaller ones would make more of rounding errors. */
static const double LEAST = 0.01, NEAR = 0.05;

/* Areas of neighbourhoods, in D^2, up to which they do not turn by themselves, and from which they do. */
static const double SMALL = 0.0015, LARGE = 0.005;

/* From 0 at a to 1 at b. */
static double smooth_step(double x, double a, double b)
{
    double t = fmin(fmax((x - a) / (b - a), 0), 1);
    return t * t * (3 - 2 * t);
}

/* A cell near a face, and its weight there. */
typedef struct part {
    uint32_t cell, face;
    double weight;
} part;

struct vgi_limbs {
    size_t n, nf;         /* cells, faces */
    uint32_t *first_face; /* n + 1: of each cell in `face` */
    uint32_t *face;       /* nf: by cell */
    double *area;         /* per face */
    double *large;        /* per face: how far its neighbourhood is large enough to be a limb, from 0 to 1 */
    uint32_t *first;      /* nf + 1: of each face in `parts` */
    part *parts;
    vgi_map *sum, *turn; /* per cell, in eight poses: sum of the maps by area, and its rotation */
    vgi_lanes *weight;   /* per cell: area of the faces that have a map */
    vgi_map *whole;      /* the last one of `turn` */
    double spread[VGI_LANES], limbs[VGI_LANES];
};

/* ---- construction ---- */

typedef struct builder {
    const vg_mesh *mesh;
    vgi_incidence around;
    double *centre;                    /* per face */
    double *nearest;                   /* per face: distance to the centre of its cell */
    uint32_t *cell;                    /* per face: UINT32_MAX until it has one */
    uint32_t *seen_face, *seen_vertex; /* the last cell whose flood came here, + 1 */
    uint32_t *queue;
    part *parts;
    size_t n, room;
    double D;
} builder;

static int make_builder(builder *b, vgi_limbs *r, const vg_mesh *m, const double *reference, vg_err *e)
{
    b->mesh = m;
    b->D = vg_diagonal(reference, m->nv);
    b->centre = vgi_array(m->nf, 3 * sizeof *b->centre, e);
    b->nearest = vgi_array(m->nf, sizeof *b->nearest, e);
    b->cell = vgi_array(m->nf, sizeof *b->cell, e);
    b->seen_face = vgi_array(m->nf, sizeof *b->seen_face, e);
    b->seen_vertex = vgi_array(m->nv, sizeof *b->seen_vertex, e);
    b->queue = vgi_array(m->nf, sizeof *b->queue, e);
    r->area = vgi_array(m->nf, sizeof *r->area, e);
    if (!b->centre || !b->nearest || !b->cell || !b->seen_face || !b->seen_vertex || !b->queue || !r->area)
        return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++) {
        double area[3];
        vgi_face_centre(reference, m->vert + m->start[f], vgi_face_size(m, f), b->centre + 3 * f);
        vgi_face_area(reference, m->vert + m->start[f], vgi_face_size(m, f), area);
        r->area[f] = vgi_length(area);
        b->cell[f] = UINT32_MAX;
    }
    return vgi_incidence_make(&b->around, m, e);
}

static void clear_builder(builder *b)
{
    vgi_incidence_clear(&b->around);
    free(b->centre);
    free(b->nearest);
    free(b->cell);
    free(b->seen_face);
    free(b->seen_vertex);
    free(b->queue);
    free(b->parts);
}

static int add_part(builder *b, part p, vg_err *e)
{
    int r = vgi_grow(&b->parts, &b->room, b->n + 1, sizeof *b->parts, e);
    if (r == VG_OK) b->parts[b->n++] = p;
    return r;
}

/* Face f, at distance d from the centre of a new cell: does it belong there? */
static int reach_face(builder *b, uint32_t cell, uint32_t f, double d, vg_err *e)
{
    if (d <= CELL * b->D && (b->cell[f] == UINT32_MAX || d < b->nearest[f])) b->cell[f] = cell, b->nearest[f] = d;
    double x = d / (REACH * b->D), share = 1 - x * x;
    return add_part(b, (part){cell, f, share * share}, e);
}

/* Queue the faces around the vertices of face f that this flood has not met. */
static void spread(builder *b, uint32_t cell, uint32_t f, size_t *end)
{
    const vg_mesh *m = b->mesh;
    for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
        uint32_t v = m->vert[c];
        if (b->seen_vertex[v] == cell + 1) continue;
        b->seen_vertex[v] = cell + 1;
        for (uint32_t i = b->around.first[v]; i < b->around.first[v + 1]; i++) {
            uint32_t g = b->around.face[i];
            if (b->seen_face[g] == cell + 1) continue;
            b->seen_face[g] = cell + 1;
            b->queue[(*end)++] = g;
        }
    }
}

/* A new cell around a face: all faces within reach to which the way stays within reach. */
static int flood(builder *b, uint32_t cell, uint32_t centre, vg_err *e)
{
    size_t end = 0;
    b->seen_face[centre] = cell + 1;
    b->queue[end++] = centre;
    for (size_t i = 0; i < end; i++) {
        uint32_t f = b->queue[i];
        double away[3];
        vgi_subtract(b->centre + 3 * (size_t)f, b->centre + 3 * (size_t)centre, away);
        double d = vgi_length(away);
        if (f != centre && !(d < REACH * b->D)) continue;
        int r = reach_face(b, cell, f, f == centre ? 0 : d, e);
        if (r < 0) return r;
        spread(b, cell, f, &end);
    }
    return VG_OK;
}

/* Sort the faces by cell, and the parts by face. */
static int sort_all(vgi_limbs *r, const builder *b, vg_err *e)
{
    r->first_face = vgi_array(r->n + 1, sizeof *r->first_face, e);
    r->face = vgi_array(r->nf, sizeof *r->face, e);
    r->first = vgi_array(r->nf + 1, sizeof *r->first, e);
    r->parts = vgi_array(b->n, sizeof *r->parts, e);
    if (!r->first_face || !r->face || !r->first || !r->parts) return VG_ENOMEM;
    for (size_t f = 0; f < r->nf; f++) r->first_face[b->cell[f] + 1]++;
    for (size_t i = 0; i < b->n; i++) r->first[b->parts[i].face + 1]++;
    for (size_t k = 0; k < r->n; k++) r->first_face[k + 1] += r->first_face[k];
    for (size_t f = 0; f < r->nf; f++) r->first[f + 1] += r->first[f];
    for (size_t f = r->nf; f-- > 0;) r->face[--r->first_face[b->cell[f] + 1]] = (uint32_t)f;
    for (size_t i = b->n; i-- > 0;) r->parts[--r->first[b->parts[i].face + 1]] = b->parts[i];
    for (size_t k = 0; k < r->n; k++) r->first_face[k] = r->first_face[k + 1];
    for (size_t f = 0; f < r->nf; f++) r->first[f] = r->first[f + 1];
    r->first_face[r->n] = (uint32_t)r->nf, r->first[r->nf] = (uint32_t)b->n;
    return VG_OK;
}

/* The area of the neighbourhood of each face says whether it can be a limb: an eyelash is none. */
static int measure_size(vgi_limbs *r, double D, vg_err *e)
{
    double *area = vgi_array(r->n, sizeof *area, e);
    r->large = vgi_array(r->nf, sizeof *r->large, e);
    if (area && r->large) {
        for (size_t k = 0; k < r->n; k++)
            for (uint32_t i = r->first_face[k]; i < r->first_face[k + 1]; i++) area[k] += r->area[r->face[i]];
        for (size_t f = 0; f < r->nf; f++) {
            double sum = 0;
            for (uint32_t p = r->first[f]; p < r->first[f + 1]; p++)
                sum += r->parts[p].weight * area[r->parts[p].cell];
            r->large[f] = smooth_step(sum / (D * D), SMALL, LARGE);
        }
    }
    free(area);
    return r->large ? VG_OK : VG_ENOMEM;
}

static int make_lanes(vgi_limbs *r, vg_err *e)
{
    r->sum = aligned_alloc(sizeof(vgi_lanes), (r->n + 1) * sizeof *r->sum);
    r->turn = aligned_alloc(sizeof(vgi_lanes), (r->n + 1) * sizeof *r->turn);
    r->weight = aligned_alloc(sizeof(vgi_lanes), (r->n + 1) * sizeof *r->weight);
    if (r->sum && r->turn && r->weight) {
        r->whole = &r->turn[r->n];
        return VG_OK;
    }
    return vg_fail(e, VG_ENOMEM, "not enough memory for the neighbourhoods of %zu faces", r->nf);
}

int vgi_limbs_new(vgi_limbs **out, const vg_mesh *m, const double *reference, vg_err *e)
{
    vgi_limbs *r = *out = vgi_array(1, sizeof *r, e);
    builder b = {0};
    if (!r) return VG_ENOMEM;
    r->nf = m->nf;
    int done = make_builder(&b, r, m, reference, e);
    for (uint32_t f = 0; done == VG_OK && f < m->nf; f++)
        if (b.cell[f] == UINT32_MAX) done = flood(&b, (uint32_t)r->n++, f, e);
    if (done == VG_OK) done = sort_all(r, &b, e);
    if (done == VG_OK) done = measure_size(r, b.D > 0 ? b.D : 1, e);
    if (done == VG_OK) done = make_lanes(r, e);
    clear_builder(&b);
    if (done < 0) vgi_limbs_free(out);
    return done;
}

void vgi_limbs_free(vgi_limbs **r)
{
    if (!*r) return;
    free((*r)->first_face);
    free((*r)->face);
    free((*r)->area);
    free((*r)->large);
    free((*r)->first);
    free((*r)->parts);
    free((*r)->sum);
    free((*r)->turn);
    free((*r)->weight);
    free(*r);
    *r = NULL;
}

/* ---- eight poses ---- */

typedef struct measure_job {
    vgi_limbs *r;
    const vgi_map *maps;
    const unsigned char *bad;
} measure_job;

static void measure_cells(void *context, size_t chunk)
{
    const measure_job *j = context;
    vgi_limbs *r = j->r;
    size_t end = (chunk + 1) * CHUNK < r->n ? (chunk + 1) * CHUNK : r->n;
    for (size_t k = chunk * CHUNK; k < end; k++) {
        memset(&r->sum[k], 0, sizeof r->sum[k]);
        memset(r->weight[k], 0, sizeof r->weight[k]);
        for (uint32_t i = r->first_face[k]; i < r->first_face[k + 1]; i++) {
            const vgi_drivers d = {j->maps, j->bad, &r->face[i], &r->area[r->face[i]]};
            vgi_transfer_kernel_now()->add(&d, 0, 1, &r->sum[k], r->weight[k]);
        }
        vgi_transfer_kernel_now()->polar(&r->sum[k], &r->turn[k]);
    }
}

/* Weight of a part by its squared difference from the whole: that of a median, or one that leaves out what differs. */
static double weigh(double square, bool sharp)
{
    double near = square + NEAR * NEAR;
    return sharp ? 1 / (near * near) : 1 / sqrt(square + LEAST * LEAST);
}

/* One round: the mean of the cells' rotations, weighted by area and by how near they are to the last one. */
static void improve_whole(vgi_limbs *r, bool sharp)
{
    vgi_map sum;
    memset(&sum, 0, sizeof sum);
    for (size_t k = 0; k < r->n; k++) {
        vgi_lanes square = {0};
        for (int i = 0; i < 9; i++)
            for (int lane = 0; lane < VGI_LANES; lane++) {
                double d = r->turn[k].m[i][lane] - r->whole->m[i][lane];
                square[lane] += d * d;
            }
        for (int lane = 0; lane < VGI_LANES; lane++) square[lane] = r->weight[k][lane] * weigh(square[lane], sharp);
        for (int i = 0; i < 9; i++)
            for (int lane = 0; lane < VGI_LANES; lane++) sum.m[i][lane] += square[lane] * r->turn[k].m[i][lane];
    }
    vgi_transfer_kernel_now()->polar(&sum, r->whole);
}

/* The share of the surface that is turned against the whole; a part that is turned by 5 degrees counts half. */
static void measure_spread(vgi_limbs *r)
{
    for (int lane = 0; lane < VGI_LANES; lane++) {
        double sum = 0, area = 0;
        for (size_t k = 0; k < r->n; k++) {
            double trace = 0;
            for (int i = 0; i < 9; i++) trace += r->turn[k].m[i][lane] * r->whole->m[i][lane];
            double x = fmax(0, (3 - trace) / 2); /* 1 - cosine */
            sum += r->weight[k][lane] * x / (x + HALF);
            area += r->weight[k][lane];
        }
        r->spread[lane] = area > 0 ? sum / area : 0;
        r->limbs[lane] = smooth_step(r->spread[lane], SUM, LIMBS);
    }
}

void vgi_limbs_measure(vgi_limbs *r, const vgi_map *maps, const unsigned char *bad, int threads)
{
    measure_job j = {r, maps, bad};
    vgi_parallel(threads, (r->n + CHUNK - 1) / CHUNK, measure_cells, &j);
    vgi_map sum;
    memset(&sum, 0, sizeof sum);
    for (size_t k = 0; k < r->n; k++)
        for (int i = 0; i < 9; i++)
            for (int lane = 0; lane < VGI_LANES; lane++) sum.m[i][lane] += r->weight[k][lane] * r->turn[k].m[i][lane];
    vgi_transfer_kernel_now()->polar(&sum, r->whole);
    for (int round = 0; round < ROUNDS; round++) improve_whole(r, round >= ROUNDS - LAST);
    measure_spread(r);
}

const vgi_map *vgi_limbs_whole(const vgi_limbs *r)
{
    return r->whole;
}

const double *vgi_limbs_spread(const vgi_limbs *r)
{
    return r->spread;
}

const double *vgi_limbs_share(const vgi_limbs *r)
{
    return r->limbs;
}

void vgi_limbs_around(const vgi_limbs *r, size_t f, vgi_map *mean)
{
    memset(mean, 0, sizeof *mean);
    for (uint32_t p = r->first[f]; p < r->first[f + 1]; p++) {
        const vgi_map *sum = &r->sum[r->parts[p].cell];
        for (int i = 0; i < 9; i++)
            for (int lane = 0; lane < VGI_LANES; lane++) mean->m[i][lane] += r->parts[p].weight * sum->m[i][lane];
    }
}

/* ---- offsets ---- */

/* c = a b, or a' b. */
static void multiply_maps(const vgi_map *a, bool transposed, const vgi_map *b, vgi_map *c)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (size_t k = 0; k < VGI_LANES; k++) {
                double sum = 0;
                for (int n = 0; n < 3; n++) sum += a->m[transposed ? 3 * n + i : 3 * i + n][k] * b->m[3 * n + j][k];
                c->m[3 * i + j][k] = sum;
            }
}

/* The part of the turn from rotation `base` to that of `map` which counts: none for small angles, all of it for large
 * ones, between them a share that grows smoothly, `most` at most. Base is turned by it. */
static void turn_on(vgi_map *base, const vgi_map *map, double stays, double turns, double most)
{
    vgi_map turn, rest, much;
    vgi_transfer_kernel_now()->polar(map, &turn);
    multiply_maps(base, true, &turn, &rest);
    for (size_t k = 0; k < VGI_LANES; k++) {
        double cosine = (rest.m[0][k] + rest.m[4][k] + rest.m[8][k] - 1) / 2;
        double share = most * smooth_step(-cosine, -stays, -turns);
        for (int i = 0; i < 9; i++) rest.m[i][k] = share * rest.m[i][k] + (i % 4 == 0 ? 1 - share : 0);
    }
    multiply_maps(base, false, &rest, &much);
    vgi_transfer_kernel_now()->polar(&much, base);
}

void vgi_limbs_turn(const vgi_limbs *r, size_t f, const vgi_map *map, unsigned bad, vgi_map *turn)
{
    vgi_map base = *r->whole, around, own;
    vgi_limbs_around(r, f, &around);
    turn_on(&base, &around, AROUND_STAYS, AROUND_TURNS, r->large[f]);
    own = map ? *map : base;
    for (int i = 0; i < 9; i++)
        for (int lane = 0; lane < VGI_LANES; lane++)
            if (bad >> lane & 1) own.m[i][lane] = base.m[i][lane];
    turn_on(&base, &own, STAYS, TURNS, 1);
    *turn = base;
}
