/* carry.c: deformation transfer between meshes of different connectivity, face by face along a correspondence (MATH 9).
 * Leaves out how the correspondence is found (register.c) and the loops over corners (carry_kernel.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/carry_kernel.h"
#include "method/moments.h"
#include "model/incidence.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

enum { CHUNK = 512, ENOUGH = 64 };

struct vg_carrier {
    const vg_mesh *source;
    const vg_correspondence *pairs;
    const vg_graph *target;
    vg_method method;
    int threads;
    double *p, *q;         /* see vgi_source */
    unsigned char *slow;   /* per source face: 1: a line segment, 2: no gradient in the reference pose, never drives */
    double *segment;       /* reference vector of each source face's first corner */
    double *vectors;       /* the target's reference vectors, per corner of its graph */
    vgi_incidence around;  /* of the target, only if there are links */
    vgi_map *maps;         /* per source face */
    unsigned char *bad;    /* per source face: lanes in which it drives nothing */
    atomic_uint_fast64_t degenerate, first_face;
};

static size_t source_size(const vg_carrier *c, size_t f)
{
    return c->source->start[f + 1] - c->source->start[f];
}

static void note_degenerate(vg_carrier *c, size_t f, unsigned lanes)
{
    if (!lanes) return;
    atomic_fetch_add(&c->degenerate, (unsigned)__builtin_popcount(lanes));
    uint_fast64_t least = atomic_load(&c->first_face);
    while (f < least && !atomic_compare_exchange_weak(&c->first_face, &least, f)) continue;
}

/* ---- making ---- */

static int check_fit(const vg_mesh *source, const vg_correspondence *k, const vg_graph *target, vg_err *e)
{
    vg_mesh t = {target->nv, target->nf - target->nlinks, target->start, target->vert};
    if (k->source_nv != source->nv || k->source_nf != source->nf || k->source_digest != vg_mesh_digest(source))
        return vg_fail(e, VG_EINPUT, "the correspondence was made for another source: %zu vertices and %zu faces, the sequence "
                       "has %zu and %zu", k->source_nv, k->source_nf, source->nv, source->nf);
    if (k->target_nv != t.nv || k->target_nf != t.nf || k->target_digest != vg_mesh_digest(&t))
        return vg_fail(e, VG_EINPUT, "the correspondence was made for another target: %zu vertices and %zu faces, this one has "
                       "%zu and %zu", k->target_nv, k->target_nf, t.nv, t.nf);
    return VG_OK;
}

static void measure_source(vg_carrier *c, const double *reference, double *w)
{
    const vg_mesh *m = c->source;
    for (size_t f = 0; f < m->nf; f++) {
        size_t begin = m->start[f], r = source_size(c, f);
        double centre[3] = {0, 0, 0}, P[6], size;
        for (size_t i = 0; i < r; i++)
            for (size_t k = 0; k < 3; k++) centre[k] += reference[3 * (size_t)m->vert[begin + i] + k] / (double)r;
        for (size_t i = 0; i < r; i++)
            for (size_t k = 0; k < 3; k++) w[3 * i + k] = reference[3 * (size_t)m->vert[begin + i] + k] - centre[k];
        memcpy(c->segment + 3 * f, w, 3 * sizeof *w);
        if (r == 2) {
            c->slow[f] = w[0] != 0 || w[1] != 0 || w[2] != 0 ? 1 : 2;
        } else if (vgi_gradient_moments(w, r, P, c->q + 3 * f, &size)) {
            for (size_t k = 0; k < 3; k++) c->q[3 * f + k] /= sqrt(size);
            for (size_t i = 0; i < r; i++) vgi_symmetric_times(P, w + 3 * i, c->p + 3 * (begin + i));
        } else {
            c->slow[f] = 2;
        }
    }
}

int vg_carrier_new(vg_carrier **out, const vg_mesh *source, const double *source_reference, const vg_correspondence *pairs,
                   const vg_graph *target, const double *target_reference, vg_method method, int threads, vg_err *e)
{
    *out = NULL;
    int r = check_fit(source, pairs, target, e);
    if (r < 0) return r;
    vg_carrier *c = *out = vgi_array(1, sizeof *c, e);
    if (!c) return VG_ENOMEM;
    c->source = source, c->pairs = pairs, c->target = target, c->method = method, c->threads = threads;
    atomic_init(&c->first_face, UINT64_MAX);
    size_t nf = source->nf, most = 0;
    for (size_t f = 0; f < nf; f++) most = source_size(c, f) > most ? source_size(c, f) : most;
    double *w = vgi_array(3 * most, sizeof *w, e);
    c->p = vgi_array(3 * vg_mesh_corners(source), sizeof *c->p, e);
    c->q = vgi_array(3 * nf, sizeof *c->q, e);
    c->slow = vgi_array(nf, 1, e);
    c->bad = vgi_array(nf, 1, e);
    c->segment = vgi_array(3 * nf, sizeof *c->segment, e);
    c->vectors = vgi_array(3 * vg_graph_corners(target), sizeof *c->vectors, e);
    c->maps = aligned_alloc(sizeof(vgi_lanes), (nf ? nf : 1) * sizeof *c->maps);
    bool ok = w && c->p && c->q && c->slow && c->bad && c->segment && c->vectors && c->maps;
    if (ok && target->nlinks)
        ok = vgi_incidence_make(&c->around, target->nv, target->nf, target->start, target->vert, e) == VG_OK;
    if (ok) {
        measure_source(c, source_reference, w);
        vg_graph_vectors(target, target_reference, c->vectors);
    } else {
        vg_fail(e, VG_ENOMEM, "not enough memory for a transfer of %zu faces", nf);
        vg_carrier_free(out);
    }
    free(w);
    return ok ? VG_OK : VG_ENOMEM;
}

void vg_carrier_free(vg_carrier **out)
{
    vg_carrier *c = *out;
    if (!c) return;
    free(c->p);
    free(c->q);
    free(c->slow);
    free(c->bad);
    free(c->segment);
    free(c->vectors);
    free(c->maps);
    vgi_incidence_clear(&c->around);
    free(c);
    *out = NULL;
}

vg_deform_counts vg_carrier_counts(const vg_carrier *c)
{
    return (vg_deform_counts){atomic_load(&c->degenerate), atomic_load(&c->first_face)};
}

/* ---- eight poses ---- */

typedef struct carry_job {
    vg_carrier *c;
    const double *poses[VGI_LANES];
    double *const *out;
    size_t lanes;
} carry_job;

/* A line segment's map: its smallest rotation and its stretch, lane by lane. */
static void measure_segment(const carry_job *j, size_t f)
{
    const vg_carrier *c = j->c;
    const uint32_t *vert = c->source->vert + c->source->start[f];
    const double *r = c->segment + 3 * f;
    vgi_map *map = &c->maps[f];
    unsigned bad = 0;
    for (size_t k = 0; k < VGI_LANES; k++) {
        const double *a = j->poses[k] + 3 * (size_t)vert[0], *b = j->poses[k] + 3 * (size_t)vert[1];
        double d[3] = {(a[0] - b[0]) / 2, (a[1] - b[1]) / 2, (a[2] - b[2]) / 2}, q[4] = {1, 0, 0, 0}, m[9];
        if (d[0] == 0 && d[1] == 0 && d[2] == 0) bad |= 1u << k;
        else vg_quat_between(r, d, q);
        double scale = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], root = sqrt(scale);
        for (int i = 0; i < 4; i++) q[i] /= root;
        vg_quat_matrix(q, m);
        for (int i = 0; i < 9; i++) map->m[i][k] = scale * m[i];
    }
    c->bad[f] = (unsigned char)bad;
}

static void measure_chunk(void *context, size_t i)
{
    carry_job *j = context;
    vg_carrier *c = j->c;
    size_t nf = c->source->nf, first = i * CHUNK, last = first + CHUNK < nf ? first + CHUNK : nf;
    const vgi_source s = {c->source->start, c->source->vert, c->p, c->q, c->slow, j->poses};
    vgi_measure_maps(&s, first, last, c->maps, c->bad);
    for (size_t f = first; f < last; f++) {
        if (c->slow[f] == 1) measure_segment(j, f);
        if (c->slow[f] == 2) c->bad[f] = 0xff;
        note_degenerate(c, f, c->bad[f] & (0xffu >> (VGI_LANES - j->lanes)));
    }
}

/* Add the mean map of a target face's sources to a sum; sources without a direction are left out. */
static void add_sources(const vg_carrier *c, size_t f, vgi_map *sum, vgi_lanes *weight)
{
    const vg_correspondence *k = c->pairs;
    for (uint32_t i = k->first[f]; i < k->first[f + 1]; i++) {
        const vgi_map *map = &c->maps[k->source[i]];
        unsigned bad = c->bad[k->source[i]];
        for (int lane = 0; lane < VGI_LANES; lane++) {
            if (bad >> lane & 1) continue;
            for (int e = 0; e < 9; e++) sum->m[e][lane] += k->weight[i] * map->m[e][lane];
            (*weight)[lane] += k->weight[i];
        }
    }
}

/* Nothing to follow: stay as it is. */
static void finish_mean(vgi_map *sum, vgi_lanes weight)
{
    for (int lane = 0; lane < VGI_LANES; lane++)
        for (int e = 0; e < 9; e++)
            sum->m[e][lane] = weight[lane] > 0 ? sum->m[e][lane] / weight[lane] : e % 4 == 0;
}

static void follow(const carry_job *j, size_t f)
{
    static const vgi_follow how[] = {[VG_BY_POSE] = VGI_FOLLOW_POSE, [VG_BY_GRADIENT] = VGI_FOLLOW_GRADIENT,
                                     [VG_BY_BLEND] = VGI_FOLLOW_BLEND};
    const vg_carrier *c = j->c;
    const vg_graph *g = c->target;
    size_t faces = g->nf - g->nlinks, begin = g->start[f];
    vgi_map sum;
    vgi_lanes weight = {0};
    memset(&sum, 0, sizeof sum);
    bool rigid = f < faces && !c->pairs->matched[f];
    if (f < faces) {
        add_sources(c, f, &sum, &weight);
    } else { /* a link: the faces at both ends */
        for (size_t end = 0; end < 2; end++) {
            uint32_t v = g->vert[begin + end], first = c->around.first[v], last = c->around.first[v + 1];
            if (last - first > ENOUGH) last = first + ENOUGH;
            for (uint32_t i = first; i < last; i++)
                if (c->around.face[i] < faces) add_sources(c, c->around.face[i], &sum, &weight);
        }
    }
    finish_mean(&sum, weight);
    vgi_follow_face(&sum, rigid ? VGI_FOLLOW_RIGID : how[c->method], c->vectors + 3 * begin, g->start[f + 1] - begin, j->out,
                    3 * begin, j->lanes);
}

static void follow_chunk(void *context, size_t i)
{
    const carry_job *j = context;
    size_t nf = j->c->target->nf, first = i * CHUNK, last = first + CHUNK < nf ? first + CHUNK : nf;
    for (size_t f = first; f < last; f++) follow(j, f);
}

void vg_carrier_transfer(vg_carrier *c, size_t n, const double *const *poses, double *const *vectors)
{
    for (size_t p = 0; p < n; p += VGI_LANES) {
        carry_job j = {.c = c, .out = vectors + p, .lanes = n - p < VGI_LANES ? n - p : VGI_LANES};
        for (size_t k = 0; k < VGI_LANES; k++) j.poses[k] = poses[p + (k < j.lanes ? k : j.lanes - 1)];
        vgi_parallel(c->threads, (c->source->nf + CHUNK - 1) / CHUNK, measure_chunk, &j);
        vgi_parallel(c->threads, (c->target->nf + CHUNK - 1) / CHUNK, follow_chunk, &j);
    }
}
