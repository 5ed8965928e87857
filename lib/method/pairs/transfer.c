/* transfer.c: deformation transfer between meshes of different connectivity, face by face along a correspondence
 * (MATH 9). If a target face is driven by one source face with as many corners, corner follows corner, as between
 * meshes of one connectivity (deform.c); so a mesh paired with itself is reproduced exactly, including bent polygons.
 * Elsewhere one map of the source faces drives all corners.
 * The correspondence comes from register.c; the loops over corners are in transfer_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/places.h"
#include "method/pairs/limbs.h"
#include "method/pairs/similarity.h"
#include "method/pairs/transfer_kernel.h"
#include "numeric/face.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"
#include "method/vectors/moments.h"
#include "model/incidence.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

enum { CHUNK = 512, ENOUGH = 64 };
static const double ALIKE = 0.5; /* largest difference of a face from its places, relative to its vectors */

struct vg_cross_transfer {
    const vg_mesh *source;
    const vg_correspondence *pairs;
    const vg_graph *target;
    vg_method method;
    int threads;
    const double *source_reference;
    double ratio;          /* size of the target relative to the source */
    double scale;          /* of motions, by offset */
    vgi_limbs *limbs;  /* of the source, where the way depends on how far parts turn; else NULL */
    double gradient[VGI_LANES]; /* by offset: the share of the gradients in the results, of eight poses */
    double *share;         /* per source vertex: of the part that drives the target, see vg_cross_transfer_root */
    double *p, *q;         /* see vgi_source */
    unsigned char *slow;   /* per source face: 1: a line segment; 2: no gradient in the reference pose, never drives */
    double *segment;       /* reference vector of each source face's first corner */
    double *vectors;       /* the target's reference vectors, per corner of its graph */
    /* By offset, where the source's fit to the target is known; else NULL. */
    vgi_place *place;      /* per target vertex: where it lies on the source */
    bool *placed;          /* per target face: it goes by the places of its vertices */
    double *offset;        /* per corner: the target's reference vector less that of the places at the target's size */
    double *points[VGI_LANES]; /* the places in eight poses */
    vgi_incidence around;  /* of the target, only with links */
    /* Target faces that go corner by corner ("twins"): a graph of them over the source's vertices, and its result for
     * eight poses. */
    size_t ntwins;
    uint32_t *twin;        /* the target faces, ascending, then links between vertices of such faces */
    unsigned char *is_twin; /* per target face */
    vg_graph *twins;
    vg_deformer *deformer;
    double *twin_vectors[VGI_LANES];
    vgi_map *maps;         /* per source face */
    unsigned char *bad;    /* per source face: lanes in which it drives nothing */
    atomic_uint_fast64_t degenerate, first_face;
};

static size_t source_size(const vg_cross_transfer *c, size_t f)
{
    return c->source->start[f + 1] - c->source->start[f];
}

static void note_degenerate(vg_cross_transfer *c, size_t f, unsigned lanes)
{
    if (!lanes) return;
    atomic_fetch_add(&c->degenerate, (unsigned)__builtin_popcount(lanes));
    uint_fast64_t least = atomic_load(&c->first_face);
    while (f < least && !atomic_compare_exchange_weak(&c->first_face, &least, f)) continue;
}

/* ---- construction ---- */

static int check_fit(const vg_mesh *source, const vg_correspondence *k, const vg_graph *target, vg_err *e)
{
    vg_mesh t = {target->faces.nv, target->faces.nf - target->nlinks, target->faces.start, target->faces.vert};
    if (k->source_nv != source->nv || k->source_nf != source->nf || k->source_digest != vg_mesh_digest(source))
        return vg_fail(e, VG_EINPUT,
                       "the correspondence was made for another source: %zu vertices and %zu faces, the sequence "
                       "has %zu and %zu",
                       k->source_nv, k->source_nf, source->nv, source->nf);
    if (k->target_nv != t.nv || k->target_nf != t.nf || k->target_digest != vg_mesh_digest(&t))
        return vg_fail(e, VG_EINPUT,
                       "the correspondence was made for another target: %zu vertices and %zu faces, this one has "
                       "%zu and %zu",
                       k->target_nv, k->target_nf, t.nv, t.nf);
    return VG_OK;
}

static int measure_source(vg_cross_transfer *c, const double *reference, vg_err *e)
{
    const vg_mesh *m = c->source;
    for (size_t f = 0; f < m->nf; f++)
        if (source_size(c, f) == 2) {
            double w[6];
            vgi_face_vectors(reference, m->vert + m->start[f], 2, w);
            memcpy(c->segment + 3 * f, w, 3 * sizeof *w);
        }
    return vgi_mesh_moments(m, reference, c->p, c->q, c->slow, e);
}

/* The corner of source face s that matches the first corner of target face f: the cyclic shift for which their
 * vectors agree best. */
static size_t best_turn(const vg_cross_transfer *c, const double *source_reference, size_t s, size_t f)
{
    const uint32_t *vert = c->source->vert + c->source->start[s];
    const double *t = c->vectors + 3 * (size_t)c->target->faces.start[f];
    size_t r = source_size(c, s), best = 0;
    double most = -INFINITY;
    for (size_t turn = 0; turn < r; turn++) {
        double sum = 0; /* the target's vectors sum to 0, so positions work as well as vectors */
        for (size_t i = 0; i < r; i++)
            for (size_t k = 0; k < 3; k++)
                sum += t[3 * i + k] * source_reference[3 * (size_t)vert[(i + turn) % r] + k];
        if (sum > most) most = sum, best = turn;
    }
    return best;
}

/* Choose the twins; returns the number of their corners. */
static size_t choose_twins(vg_cross_transfer *c)
{
    enum { LARGEST = 64 }; /* trying all shifts of a face costs the square of its corners */
    const vg_graph *g = c->target;
    const vg_correspondence *k = c->pairs;
    size_t corners = 0;
    for (size_t f = 0; f < g->faces.nf - g->nlinks; f++) {
        size_t r = g->faces.start[f + 1] - g->faces.start[f], s = k->source[k->first[f]];
        if (!k->matched[f] || k->first[f + 1] - k->first[f] != 1 || source_size(c, s) != r || r > LARGEST) continue;
        c->is_twin[f] = 1;
        c->twin[c->ntwins++] = (uint32_t)f;
        corners += r;
    }
    return corners;
}

/* Fill the twins' mesh over the source's vertices. twin_of[v]: the source vertex for target vertex v, or
 * UINT32_MAX. */
static void fill_twins(const vg_cross_transfer *c, const double *source_reference, vg_mesh *m, uint32_t *twin_of)
{
    const vg_graph *g = c->target;
    size_t at = 0;
    for (size_t v = 0; v < g->faces.nv; v++) twin_of[v] = UINT32_MAX;
    for (size_t i = 0; i < m->nf; i++) {
        size_t f = c->twin[i], s = c->pairs->source[c->pairs->first[f]], r = source_size(c, s);
        size_t turn = best_turn(c, source_reference, s, f);
        for (size_t j = 0; j < r; j++) {
            uint32_t v = c->source->vert[c->source->start[s] + (j + turn) % r];
            m->vert[at++] = v;
            twin_of[g->faces.vert[g->faces.start[f] + j]] = v;
        }
        m->start[i + 1] = (uint32_t)at;
    }
}

/* Collect the links between twins, which are twins as well. */
static void link_twins(vg_cross_transfer *c, const uint32_t *twin_of, vg_links *links)
{
    const vg_graph *g = c->target;
    for (size_t f = g->faces.nf - g->nlinks; f < g->faces.nf; f++) {
        uint32_t a = twin_of[g->faces.vert[g->faces.start[f]]], b = twin_of[g->faces.vert[g->faces.start[f] + 1]];
        if (a == UINT32_MAX || b == UINT32_MAX || a == b) continue;
        links->pairs[2 * links->n] = a, links->pairs[2 * links->n++ + 1] = b;
        c->is_twin[f] = 1;
        c->twin[c->ntwins++] = (uint32_t)f;
    }
}

/* Build the graph of the twins over the source's vertices, in the order of the target's corners. */
static int find_twins(vg_cross_transfer *c, const double *source_reference, vg_err *e)
{
    const vg_graph *g = c->target;
    c->twin = vgi_array(g->faces.nf, sizeof *c->twin, e);
    c->is_twin = vgi_array(g->faces.nf, 1, e);
    if (!c->twin || !c->is_twin) return VG_ENOMEM;
    size_t corners = choose_twins(c);
    if (!c->ntwins) return VG_OK;
    vg_mesh twins = {c->source->nv, c->ntwins, NULL, NULL};
    twins.start = vgi_array(c->ntwins + 1, sizeof *twins.start, e);
    twins.vert = vgi_array(corners, sizeof *twins.vert, e);
    vg_links links = {.chosen = true, .pairs = vgi_array(2 * g->nlinks, sizeof *links.pairs, e)};
    uint32_t *twin_of = vgi_array(g->faces.nv, sizeof *twin_of, e);
    corners += 2 * g->nlinks;
    double *target = vgi_array(3 * corners, sizeof *target, e);
    int r = twins.start && twins.vert && links.pairs && twin_of && target ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        fill_twins(c, source_reference, &twins, twin_of);
        link_twins(c, twin_of, &links);
        r = vg_graph_new(&c->twins, &twins, NULL, &links, e);
    }
    for (size_t i = 0; r == VG_OK && i < c->ntwins; i++) {
        size_t at = c->twins->faces.start[i], n = c->twins->faces.start[i + 1] - at;
        memcpy(target + 3 * at, c->vectors + 3 * (size_t)g->faces.start[c->twin[i]], 3 * n * sizeof *target);
    }
    if (r == VG_OK) r = vg_deformer_new(&c->deformer, c->twins, source_reference, c->threads, e);
    if (r == VG_OK) r = vg_deformer_target(c->deformer, target, c->method, e);
    for (size_t i = 0; r == VG_OK && i < VGI_LANES; i++)
        if (!(c->twin_vectors[i] = vgi_array(3 * corners, sizeof *target, e))) r = VG_ENOMEM;
    vg_mesh_clear(&twins);
    free(links.pairs);
    free(twin_of);
    free(target);
    return r;
}

static int make_arrays(vg_cross_transfer *c, vg_err *e)
{
    size_t nf = c->source->nf;
    c->p = vgi_array(3 * vg_mesh_corners(c->source), sizeof *c->p, e);
    c->q = vgi_array(3 * nf, sizeof *c->q, e);
    c->slow = vgi_array(nf, 1, e);
    c->bad = vgi_array(nf, 1, e);
    c->segment = vgi_array(3 * nf, sizeof *c->segment, e);
    c->share = vgi_array(c->source->nv, sizeof *c->share, e);
    c->vectors = vgi_array(3 * vg_graph_corners(c->target), sizeof *c->vectors, e);
    c->maps = aligned_alloc(sizeof(vgi_lanes), (nf ? nf : 1) * sizeof *c->maps);
    if (c->p && c->q && c->slow && c->bad && c->segment && c->share && c->vectors && c->maps) return VG_OK;
    return vg_fail(e, VG_ENOMEM, "not enough memory for a transfer of %zu faces", nf);
}

/* The target's mesh: the faces of its graph but for links. */
static vg_mesh target_mesh(const vg_cross_transfer *c)
{
    const vg_graph *g = c->target;
    return (vg_mesh){g->faces.nv, g->faces.nf - g->nlinks, g->faces.start, g->faces.vert};
}

static int measure_share(vg_cross_transfer *c, vg_err *e)
{
    const vg_mesh t = target_mesh(c);
    return vgi_places_share(c->place, c->source, c->pairs, &t, c->share, e);
}

int vg_cross_transfer_new(vg_cross_transfer **out, const vg_mesh *source, const double *source_reference,
                   const vg_correspondence *pairs, const vg_graph *target, const double *target_reference,
                   vg_method method, int threads, vg_err *e)
{
    *out = NULL;
    int r = check_fit(source, pairs, target, e);
    if (r < 0) return r;
    vg_cross_transfer *c = *out = vgi_array(1, sizeof *c, e);
    if (!c) return VG_ENOMEM;
    c->source = source, c->pairs = pairs, c->target = target, c->method = method, c->threads = threads;
    atomic_init(&c->first_face, UINT64_MAX);
    c->source_reference = source_reference;
    r = make_arrays(c, e);
    if (r == VG_OK) r = measure_share(c, e);
    const vg_mesh t = target_mesh(c);
    c->ratio = vgi_places_size(source, source_reference, pairs, &t, target_reference);
    if (r == VG_OK && target->nlinks)
        r = vgi_incidence_make(&c->around, &target->faces, e);
    if (r == VG_OK) r = measure_source(c, source_reference, e);
    if (r == VG_OK) {
        vg_graph_vectors(target, target_reference, c->vectors);
        r = find_twins(c, source_reference, e);
    }
    if (r < 0) vg_cross_transfer_free(out);
    return r;
}

double vg_cross_transfer_turned(const vg_cross_transfer *c)
{
    const vg_graph *t = c->target;
    const vg_correspondence *pairs = c->pairs;
    double sum = 0, n[3];
    size_t count = 0;
    for (size_t f = 0; f < t->faces.nf - t->nlinks; f++) {
        size_t s = pairs->source[pairs->first[f]];
        const double *q = c->q + 3 * s; /* along the normal */
        if (!pairs->matched[f] || c->slow[s]) continue;
        size_t first = t->faces.start[f], size = t->faces.start[f + 1] - first;
        if (!vgi_unit_normal(c->vectors + 3 * first, size, n)) continue;
        sum += (q[0] * n[0] + q[1] * n[1] + q[2] * n[2]) / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
        count++;
    }
    return count ? 180 / M_PI * acos(fmin(fabs(sum) / (double)count, 1)) : 0;
}

void vg_cross_transfer_root(const vg_cross_transfer *c, const double *pose, double root[3])
{
    root[0] = root[1] = root[2] = 0;
    for (size_t v = 0; v < c->source->nv; v++)
        if (c->share[v] != 0) vgi_add_scaled(root, c->share[v], pose + 3 * v);
}

double vg_cross_transfer_size(const vg_cross_transfer *c, bool small_motions)
{
    return small_motions && c->limbs ? c->scale : c->ratio;
}

void vg_cross_transfer_free(vg_cross_transfer **out)
{
    vg_cross_transfer *c = *out;
    if (!c) return;
    free(c->p);
    free(c->q);
    free(c->slow);
    free(c->bad);
    free(c->segment);
    free(c->share);
    free(c->vectors);
    free(c->place);
    free(c->placed);
    free(c->offset);
    for (int i = 0; i < VGI_LANES; i++) free(c->points[i]);
    free(c->maps);
    vgi_incidence_clear(&c->around);
    vgi_limbs_free(&c->limbs);
    free(c->twin);
    free(c->is_twin);
    vg_deformer_free(&c->deformer);
    vg_graph_free(&c->twins);
    for (int i = 0; i < VGI_LANES; i++) free(c->twin_vectors[i]);
    free(c);
    *out = NULL;
}

vg_deform_stats vg_cross_transfer_get_stats(const vg_cross_transfer *c)
{
    return (vg_deform_stats){atomic_load(&c->degenerate), atomic_load(&c->first_face)};
}

/* ---- eight poses ---- */

typedef struct transfer_job {
    vg_cross_transfer *c;
    const double *poses[VGI_LANES];
    double *const *out;
    size_t lanes;
} transfer_job;

/* Map of a line segment: its smallest rotation and its stretch, lane by lane. */
static void measure_segment(const transfer_job *j, size_t f)
{
    const vg_cross_transfer *c = j->c;
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
    transfer_job *j = context;
    vg_cross_transfer *c = j->c;
    size_t nf = c->source->nf, first = i * CHUNK, last = first + CHUNK < nf ? first + CHUNK : nf;
    const vgi_source s = {c->source->start, c->source->vert, c->p, c->q, c->slow, j->poses};
    vgi_transfer_kernel_now()->measure(&s, first, last, c->maps, c->bad);
    for (size_t f = first; f < last; f++) {
        if (c->slow[f] == 1) measure_segment(j, f);
        if (c->slow[f] == 2) c->bad[f] = 0xff;
        note_degenerate(c, f, c->bad[f] & (0xffu >> (VGI_LANES - j->lanes)));
    }
}

/* Add the mean map of a target face's drivers to a sum; drivers without a direction are left out. */
static void add_sources(const vg_cross_transfer *c, size_t f, vgi_map *sum, vgi_lanes weight)
{
    const vgi_drivers d = {c->maps, c->bad, c->pairs->source, c->pairs->weight};
    vgi_transfer_kernel_now()->add(&d, c->pairs->first[f], c->pairs->first[f + 1], sum, weight);
}

/* Centre of the source faces that drive the target faces around a vertex, in eight poses. */
static void centre_beside(const vg_cross_transfer *c, uint32_t v, const double *const *poses, vgi_lanes centre[3])
{
    const vg_correspondence *k = c->pairs;
    size_t faces = c->target->faces.nf - c->target->nlinks;
    uint32_t first = c->around.first[v], last = c->around.first[v + 1];
    double total = 0;
    if (last - first > ENOUGH) last = first + ENOUGH;
    memset(centre, 0, 3 * sizeof *centre);
    for (uint32_t i = first; i < last; i++) {
        size_t f = c->around.face[i];
        for (uint32_t p = f < faces ? k->first[f] : 0; f < faces && p < k->first[f + 1]; p++) {
            size_t s = k->source[p], r = source_size(c, s);
            total += k->weight[p];
            for (uint32_t n = c->source->start[s]; n < c->source->start[s + 1]; n++)
                for (size_t a = 0; a < 3; a++)
                    for (size_t lane = 0; lane < VGI_LANES; lane++)
                        centre[a][lane] +=
                            k->weight[p] / (double)r * poses[lane][3 * (size_t)c->source->vert[n] + a];
        }
    }
    for (size_t a = 0; a < 3; a++)
        for (size_t lane = 0; lane < VGI_LANES && total > 0; lane++) centre[a][lane] /= total;
}

/* A link also follows the relative motion of the source's faces at its ends, beyond their common map: eyes move in
 * their sockets. Scaled to the target's size. */
static void add_drift(const transfer_job *j, size_t f, const vgi_map *map)
{
    const vg_cross_transfer *c = j->c;
    size_t begin = c->target->faces.start[f];
    const double *reference[VGI_LANES];
    for (int k = 0; k < VGI_LANES; k++) reference[k] = c->source_reference;
    vgi_lanes now[2][3], before[2][3];
    for (size_t end = 0; end < 2; end++) {
        centre_beside(c, c->target->faces.vert[begin + end], j->poses, now[end]);
        centre_beside(c, c->target->faces.vert[begin + end], reference, before[end]);
    }
    for (size_t a = 0; a < 3; a++)
        for (size_t k = 0; k < j->lanes; k++) {
            double drift = now[0][a][k] - now[1][a][k];
            for (size_t b = 0; b < 3; b++) drift -= map->m[3 * a + b][k] * (before[0][b][k] - before[1][b][k]);
            j->out[k][3 * begin + a] += 0.5 * c->ratio * drift;
            j->out[k][3 * begin + 3 + a] -= 0.5 * c->ratio * drift;
        }
}

/* The vectors of the places, at the target's size, and the target's offsets, turned, mixed with what is there, which
 * has the share c->gradient. */
static void mix_places(const transfer_job *j, size_t f, const vgi_map *turn)
{
    const vg_cross_transfer *c = j->c;
    size_t begin = c->target->faces.start[f], r = c->target->faces.start[f + 1] - begin;
    const uint32_t *vert = c->target->faces.vert + begin;
    for (size_t k = 0; k < j->lanes; k++) {
        double centre[3], share = c->gradient[k];
        if (share >= 1) continue;
        vgi_face_centre(c->points[k], vert, r, centre);
        for (size_t i = 0; i < r; i++) {
            const double *offset = c->offset + 3 * (begin + i);
            for (size_t a = 0; a < 3; a++) {
                double *to = &j->out[k][3 * (begin + i) + a];
                double x = c->scale * (c->points[k][3 * (size_t)vert[i] + a] - centre[a]);
                for (size_t b = 0; b < 3; b++) x += turn->m[3 * a + b][k] * offset[b];
                *to = share > 0 ? share * *to + (1 - share) * x : x;
            }
        }
    }
}

/* A target face that goes by the places of its vertices, as far as poses do not go by gradient. */
static void follow_places(const transfer_job *j, size_t f, vgi_map *map)
{
    const vg_cross_transfer *c = j->c;
    size_t begin = c->target->faces.start[f], r = c->target->faces.start[f + 1] - begin;
    bool some = false;
    for (size_t k = 0; k < j->lanes; k++) some |= c->gradient[k] > 0;
    if (some)
        vgi_transfer_kernel_now()->follow(map, VGI_FOLLOW_GRADIENT, c->vectors + 3 * begin, r, j->out, 3 * begin,
                                          j->lanes);
    if (c->limbs) vgi_limbs_turn(c->limbs, c->pairs->source[c->pairs->first[f]], map, 0, map);
    else vgi_transfer_kernel_now()->polar(map, map);
    mix_places(j, f, map);
}

static void follow_face(const transfer_job *j, size_t f)
{
    static const vgi_follow how[] = {[VG_BY_POSE] = VGI_FOLLOW_POSE, [VG_BY_GRADIENT] = VGI_FOLLOW_GRADIENT,
                                     [VG_BY_OFFSET] = VGI_FOLLOW_GRADIENT,
                                     [VG_BY_BLEND] = VGI_FOLLOW_BLEND};
    const vg_cross_transfer *c = j->c;
    const vg_graph *g = c->target;
    size_t faces = g->faces.nf - g->nlinks, begin = g->faces.start[f];
    vgi_map sum;
    vgi_lanes weight = {0};
    memset(&sum, 0, sizeof sum);
    bool rigid = f < faces && !c->pairs->matched[f], placed = c->placed && c->placed[f];
    if (f < faces) {
        add_sources(c, f, &sum, weight);
    } else { /* a link uses the faces at both ends */
        for (size_t end = 0; end < 2; end++) {
            uint32_t v = g->faces.vert[begin + end], first = c->around.first[v], last = c->around.first[v + 1];
            if (last - first > ENOUGH) last = first + ENOUGH;
            for (uint32_t i = first; i < last; i++)
                if (c->around.face[i] < faces) add_sources(c, c->around.face[i], &sum, weight);
        }
    }
    vgi_transfer_kernel_now()->finish(&sum, weight);
    if (placed) return follow_places(j, f, &sum);
    vgi_transfer_kernel_now()->follow(&sum, rigid ? VGI_FOLLOW_RIGID : how[c->method], c->vectors + 3 * begin,
                                      g->faces.start[f + 1] - begin, j->out, 3 * begin, j->lanes);
    if (f >= faces) add_drift(j, f, &sum);
}

static void follow_chunk(void *context, size_t i)
{
    const transfer_job *j = context;
    size_t nf = j->c->target->faces.nf, first = i * CHUNK, last = first + CHUNK < nf ? first + CHUNK : nf;
    for (size_t f = first; f < last; f++)
        if (!j->c->is_twin[f]) follow_face(j, f);
}

/* Transfer the twins corner by corner, from the order of the twins to that of the target. */
static void transfer_twins(const transfer_job *j)
{
    const vg_cross_transfer *c = j->c;
    if (!c->ntwins) return;
    vg_deformer_transfer(c->deformer, j->lanes, VG_VERTICES, j->poses, c->twin_vectors);
    for (size_t k = 0; k < j->lanes; k++)
        for (size_t i = 0; i < c->ntwins; i++) {
            size_t from = c->twins->faces.start[i], n = c->twins->faces.start[i + 1] - from;
            memcpy(j->out[k] + 3 * (size_t)c->target->faces.start[c->twin[i]], c->twin_vectors[k] + 3 * from,
                   3 * n * sizeof(double));
        }
}

/* ---- by offset ---- */

static int make_places(vg_cross_transfer *c, const double *target, const double *fitted, vg_err *e)
{
    const vg_graph *g = c->target;
    size_t nv = g->faces.nv;
    const vg_mesh t = target_mesh(c);
    c->place = vgi_array(nv, sizeof *c->place, e);
    c->offset = vgi_array(vg_graph_corners(g), 3 * sizeof *c->offset, e);
    c->placed = vgi_array(g->faces.nf, sizeof *c->placed, e);
    if (!c->place || !c->offset || !c->placed) return VG_ENOMEM;
    for (size_t k = 0; k < VGI_LANES; k++)
        if (!(c->points[k] = vgi_array(nv, 3 * sizeof(double), e))) return VG_ENOMEM;
    return vgi_places_find(c->place, c->source, fitted, c->pairs, &t, target, c->threads, e);
}

static void place_points(const vg_cross_transfer *c, const double *pose, double *points)
{
    for (size_t v = 0; v < c->target->faces.nv; v++)
        if (c->place[v].face != UINT32_MAX) vgi_place_point(c->source, &c->place[v], pose, points + 3 * v);
}

/* Whether target face f can go by the places of its vertices: all have one, and together they look like the face. Else
 * some of them lie on the other lip or lid. Then its offsets are set. */
static bool place_face(vg_cross_transfer *c, size_t f)
{
    const vg_mesh *m = &c->target->faces;
    size_t begin = m->start[f], n = m->start[f + 1] - begin;
    double *offset = c->offset + 3 * begin, off2 = 0, size2 = 0;
    const double *vector = c->vectors + 3 * begin;
    if (!c->pairs->matched[f] || n < 3) return false;
    for (size_t i = begin; i < begin + n; i++)
        if (c->place[m->vert[i]].face == UINT32_MAX) return false;
    vgi_face_vectors(c->points[0], m->vert + begin, n, offset);
    for (size_t i = 0; i < 3 * n; i++) {
        offset[i] = vector[i] - c->scale * offset[i];
        off2 += offset[i] * offset[i], size2 += vector[i] * vector[i];
    }
    return off2 < ALIKE * ALIKE * size2;
}

static int set_motion_size(vg_cross_transfer *c, const double *target, vg_err *e)
{
    size_t nv = c->target->faces.nv;
    double *weight = vgi_array(nv, sizeof *weight, e);
    if (!weight) return VG_ENOMEM;
    for (size_t v = 0; v < nv; v++) weight[v] = c->place[v].face != UINT32_MAX;
    c->scale = vgi_motion_size(c->points[0], target, weight, nv);
    free(weight);
    return VG_OK;
}

int vg_cross_transfer_fitted(vg_cross_transfer *c, const double *target_reference, const double *fitted, bool mixed,
                             vg_err *e)
{
    const vg_graph *g = c->target;
    c->scale = vg_diagonal(fitted, c->source->nv) / vg_diagonal(c->source_reference, c->source->nv);
    int r = make_places(c, target_reference, fitted, e);
    if (r < 0) return r;
    place_points(c, c->source_reference, c->points[0]);
    if (mixed) r = set_motion_size(c, target_reference, e);
    for (size_t f = 0; f < g->faces.nf - g->nlinks; f++) c->placed[f] = place_face(c, f);
    if (r == VG_OK) r = measure_share(c, e);
    if (r < 0) return r;
    return mixed ? vgi_limbs_new(&c->limbs, c->source, c->source_reference, e) : VG_OK;
}

void vg_cross_transfer_apply(vg_cross_transfer *c, size_t n, const double *const *poses, double *const *vectors)
{
    for (size_t p = 0; p < n; p += VGI_LANES) {
        transfer_job j = {.c = c, .out = vectors + p, .lanes = n - p < VGI_LANES ? n - p : VGI_LANES};
        for (size_t k = 0; k < VGI_LANES; k++) j.poses[k] = poses[p + (k < j.lanes ? k : j.lanes - 1)];
        vgi_parallel(c->threads, (c->source->nf + CHUNK - 1) / CHUNK, measure_chunk, &j);
        transfer_twins(&j);
        if (c->limbs) {
            vgi_limbs_measure(c->limbs, c->maps, c->bad, c->threads);
            memcpy(c->gradient, vgi_limbs_share(c->limbs), sizeof c->gradient);
        }
        for (size_t k = 0; k < j.lanes && c->place; k++) place_points(c, j.poses[k], c->points[k]);
        vgi_parallel(c->threads, (c->target->faces.nf + CHUNK - 1) / CHUNK, follow_chunk, &j);
    }
}
