/* sums.c: expressions of a mesh onto another one of the same faces, as sums: the target keeps what it differs by, and the
 * source's motion is added in its own size (MATH 5). Poses whose parts turn far stay as they were transferred.
 * Targets of other faces are in transfer.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/limbs.h"
#include "method/pairs/similarity.h"
#include "method/vectors/moments.h"
#include "numeric/face.h"

#include <stdlib.h>

enum { CHUNK = 512 };

struct vg_sums {
    const vg_graph *g;
    size_t faces; /* without links */
    int threads;
    double scale;   /* of motions */
    double *offset; /* per corner: the target's reference vector less the source's, scaled */
    double *p, *q;  /* see vgi_source */
    unsigned char *slow, *bad;
    uint32_t *beside; /* per link: a face at each end */
    uint32_t *own;    /* per corner: itself, in place of its vertex where poses are vectors */
    vgi_map *maps;
    vgi_limbs *limbs;
};

/* ---- construction ---- */

/* A face at each end of each link; every vertex of a link is in a face. */
static int find_beside(vg_sums *s, vg_err *e)
{
    const vg_graph *g = s->g;
    uint32_t *face_of = vgi_array(g->faces.nv, sizeof *face_of, e);
    s->beside = vgi_array(2 * g->nlinks, sizeof *s->beside, e);
    if (face_of && s->beside) {
        for (size_t f = 0; f < s->faces; f++)
            for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
                face_of[g->faces.vert[c]] = (uint32_t)f;
        for (size_t i = 0; i < 2 * g->nlinks; i++)
            s->beside[i] = face_of[g->faces.vert[g->faces.start[s->faces] + i]];
    }
    bool done = face_of && s->beside;
    free(face_of);
    return done ? VG_OK : VG_ENOMEM;
}

static int make_arrays(vg_sums *s, vg_err *e)
{
    size_t corners = vg_graph_corners(s->g);
    s->offset = vgi_array_raw(3 * corners, sizeof *s->offset, e);
    s->p = vgi_array(3 * corners, sizeof *s->p, e);
    s->q = vgi_array(3 * s->faces, sizeof *s->q, e);
    s->slow = vgi_array(s->faces, 1, e);
    s->bad = vgi_array(s->faces, 1, e);
    s->own = vgi_array(corners, sizeof *s->own, e);
    if (!s->offset || !s->p || !s->q || !s->slow || !s->bad || !s->own) return VG_ENOMEM;
    for (size_t c = 0; c < corners; c++) s->own[c] = (uint32_t)c;
    s->maps = aligned_alloc(sizeof(vgi_lanes), (s->faces + 1) * sizeof *s->maps);
    if (s->maps) return VG_OK;
    return vg_fail(e, VG_ENOMEM, "not enough memory for a transfer of %zu faces", s->faces);
}

static int measure_references(vg_sums *s, const double *source, const double *target, vg_err *e)
{
    const vg_graph *g = s->g;
    const vg_mesh m = {g->faces.nv, s->faces, g->faces.start, g->faces.vert};
    size_t n = 3 * vg_graph_corners(g);
    double *from = vgi_array_raw(n, sizeof *from, e), *weight = vgi_array(g->faces.nv, sizeof *weight, e);
    if (!from || !weight) return free(from), free(weight), VG_ENOMEM;
    for (size_t v = 0; v < g->faces.nv; v++) weight[v] = g->in_face[v];
    s->scale = vgi_motion_size(source, target, weight, g->faces.nv);
    free(weight);
    vg_graph_vectors(g, source, from);
    vg_graph_vectors(g, target, s->offset);
    for (size_t i = 0; i < n; i++) s->offset[i] -= s->scale * from[i];
    free(from);
    int r = vgi_mesh_moments(&m, source, s->p, s->q, s->slow, e);
    return r < 0 ? r : vgi_limbs_new(&s->limbs, &m, source, e);
}

int vg_sums_new(vg_sums **out, const vg_graph *g, const double *source, const double *target, int threads, vg_err *e)
{
    vg_sums *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->g = g, s->faces = g->faces.nf - g->nlinks, s->threads = threads;
    int r = make_arrays(s, e);
    if (r == VG_OK) r = find_beside(s, e);
    if (r == VG_OK) r = measure_references(s, source, target, e);
    if (r < 0) vg_sums_free(out);
    return r;
}

void vg_sums_free(vg_sums **s)
{
    if (!*s) return;
    free((*s)->offset);
    free((*s)->p);
    free((*s)->q);
    free((*s)->slow);
    free((*s)->bad);
    free((*s)->beside);
    free((*s)->own);
    free((*s)->maps);
    vgi_limbs_free(&(*s)->limbs);
    free(*s);
    *s = NULL;
}

double vg_sums_size(const vg_sums *s)
{
    return s->scale;
}

/* ---- eight poses ---- */

typedef struct sums_job {
    vg_sums *s;
    const uint32_t *vert; /* per corner: its point in the poses */
    const double *poses[VGI_LANES];
    double *const *out;
    size_t lanes;
} sums_job;

static void measure_chunk(void *context, size_t i)
{
    const sums_job *j = context;
    vg_sums *s = j->s;
    size_t first = i * CHUNK, last = first + CHUNK < s->faces ? first + CHUNK : s->faces;
    const vgi_source source = {s->g->faces.start, j->vert, s->p, s->q, s->slow, j->poses};
    vgi_transfer_kernel_now()->measure(&source, first, last, s->maps, s->bad);
    for (size_t f = first; f < last; f++)
        if (s->slow[f]) s->bad[f] = 0xff;
}

/* The rotation of the offsets of a face or link. */
static void turn_of(const vg_sums *s, size_t f, vgi_map *turn)
{
    vgi_map map;
    if (f >= s->faces) { /* the mean of both ends */
        const uint32_t *end = s->beside + 2 * (f - s->faces);
        vgi_map other;
        vgi_limbs_turn(s->limbs, end[0], NULL, 0xff, &map);
        vgi_limbs_turn(s->limbs, end[1], NULL, 0xff, &other);
        for (int i = 0; i < 9; i++)
            for (int lane = 0; lane < VGI_LANES; lane++) map.m[i][lane] += other.m[i][lane];
        vgi_transfer_kernel_now()->polar(&map, turn);
        return;
    }
    vgi_limbs_turn(s->limbs, f, &s->maps[f], s->bad[f], turn);
}

/* Corner i of face f: the source's vector now, and the offset, turned, mixed with what is there. */
static void mix_corner(const sums_job *j, size_t lane, size_t corner, const double *vector, const vgi_map *turn,
                       double share)
{
    const double *offset = j->s->offset + 3 * corner;
    double *to = j->out[lane] + 3 * corner;
    for (size_t a = 0; a < 3; a++) {
        double x = j->s->scale * vector[a];
        for (size_t b = 0; b < 3; b++) x += turn->m[3 * a + b][lane] * offset[b];
        to[a] = share > 0 ? share * to[a] + (1 - share) * x : x;
    }
}

static void mix_face(const sums_job *j, size_t f)
{
    const vg_sums *s = j->s;
    const vg_mesh *m = &s->g->faces;
    const double *limbs = vgi_limbs_share(s->limbs);
    size_t begin = m->start[f], r = m->start[f + 1] - begin;
    vgi_map turn;
    if (r == 2 && f < s->faces) return; /* a bone */
    turn_of(s, f, &turn);
    for (size_t lane = 0; lane < j->lanes; lane++) {
        double centre[3], vector[3];
        if (limbs[lane] >= 1) continue;
        vgi_face_centre(j->poses[lane], j->vert + begin, r, centre);
        for (size_t c = begin; c < begin + r; c++) {
            vgi_subtract(j->poses[lane] + 3 * (size_t)j->vert[c], centre, vector);
            mix_corner(j, lane, c, vector, &turn, limbs[lane]);
        }
    }
}

static void mix_chunk(void *context, size_t i)
{
    const sums_job *j = context;
    size_t nf = j->s->g->faces.nf, first = i * CHUNK, last = first + CHUNK < nf ? first + CHUNK : nf;
    for (size_t f = first; f < last; f++) mix_face(j, f);
}

void vg_sums_mix(vg_sums *s, size_t n, vg_kind kind, const double *const *poses, double *const *vectors)
{
    const uint32_t *vert = kind == VG_VERTICES ? s->g->faces.vert : s->own;
    for (size_t p = 0; p < n; p += VGI_LANES) {
        sums_job j = {.s = s, .vert = vert, .out = vectors + p, .lanes = n - p < VGI_LANES ? n - p : VGI_LANES};
        bool some = false;
        for (size_t k = 0; k < VGI_LANES; k++) j.poses[k] = poses[p + (k < j.lanes ? k : j.lanes - 1)];
        vgi_parallel(s->threads, (s->faces + CHUNK - 1) / CHUNK, measure_chunk, &j);
        vgi_limbs_measure(s->limbs, s->maps, s->bad, s->threads);
        for (size_t k = 0; k < j.lanes; k++) some |= vgi_limbs_share(s->limbs)[k] < 1;
        if (some) vgi_parallel(s->threads, (s->g->faces.nf + CHUNK - 1) / CHUNK, mix_chunk, &j);
    }
}
