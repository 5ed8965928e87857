/* bind.c: binds a mesh to another one: finds the source faces that each target face follows, and computes the bound
 * mesh in a pose of the source.
 * Meshes that correspond part by part are registered instead (register.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/surface.h"
#include "model/incidence.h"
#include "numeric/face.h"
#include "numeric/kdtree.h"

#include <stdlib.h>

enum {
    BLOCK = 64,   /* faces or vertices per task */
    AROUND = 96   /* most source faces per target face */
};
static const double REACH = 1.2; /* radius, in face sizes or distances from the surface, within which source faces are
                                    used */

/* ---- choice of faces ---- */

typedef struct bound_face { /* of one face of the target */
    uint32_t n, face[AROUND];
    double weight[AROUND], distance;
} bound_face;

typedef struct binding {
    const vg_mesh *source, *target;
    const double *target_points;
    vgi_surface *surface;
    vgi_incidence around; /* of the source mesh */
    const bool *take;
    bound_face *by; /* per target face */
} binding;

static void centre_of(const vg_mesh *m, const double *points, size_t f, double centre[3])
{
    vgi_face_centre(points, m->vert + m->start[f], m->start[f + 1] - m->start[f], centre);
}

/* Distance from the centre to the farthest vertex. */
static double radius_of(const vg_mesh *m, const double *points, size_t f, const double centre[3])
{
    double square = 0;
    for (uint32_t i = m->start[f]; i < m->start[f + 1]; i++)
        square = fmax(square, vgi_square(points + 3 * (size_t)m->vert[i], centre));
    return sqrt(square);
}

static bool has_face(const bound_face *c, uint32_t face)
{
    for (uint32_t i = 0; i < c->n; i++)
        if (c->face[i] == face) return true;
    return false;
}

/* Add faces connected over the surface to those chosen so far, so that a hand on a hip does not move the trousers. */
static void add_connected(const binding *b, bound_face *c, const double at[3], double reach)
{
    const vg_mesh *m = b->source;
    const double *centroids = vgi_surface_centroids(b->surface);
    for (uint32_t i = 0; i < c->n; i++)
        for (uint32_t k = m->start[c->face[i]]; k < m->start[c->face[i] + 1]; k++)
            for (uint32_t j = b->around.first[m->vert[k]]; j < b->around.first[m->vert[k] + 1]; j++) {
                uint32_t face = b->around.face[j];
                if (c->n == AROUND) return;
                if (!b->take[face] || has_face(c, face) || vgi_square(centroids + 3 * (size_t)face, at) >= reach * reach) continue;
                c->face[c->n++] = face;
            }
}

static void weigh_faces(const binding *b, bound_face *c, const double at[3], double reach)
{
    const double *centroids = vgi_surface_centroids(b->surface), *sizes = vgi_surface_sizes(b->surface);
    double sum = 0;
    for (uint32_t i = 0; i < c->n; i++) {
        double x = vgi_square(centroids + 3 * (size_t)c->face[i], at) / (reach * reach), size = sizes[c->face[i]];
        c->weight[i] = x < 1 ? (1 - x) * (1 - x) * size * size : 0;
        sum += c->weight[i];
    }
    if (!(sum > 0)) c->n = 1, c->weight[0] = sum = 1;
    for (uint32_t i = 0; i < c->n; i++) c->weight[i] /= sum;
}

static void bind_face(const binding *b, size_t f)
{
    bound_face *c = &b->by[f];
    vgi_hit hit;
    double centre[3], reach;
    centre_of(b->target, b->target_points, f, centre);
    if (!vgi_surface_nearest(b->surface, centre, NULL, 0, INFINITY, &hit)) return;
    c->distance = sqrt(hit.square);
    reach = fmax(radius_of(b->target, b->target_points, f, centre), vgi_surface_sizes(b->surface)[hit.face]);
    reach = fmax(reach, c->distance) * REACH;
    c->n = 1, c->face[0] = hit.face;
    add_connected(b, c, hit.point, reach);
    weigh_faces(b, c, hit.point, reach);
}

static void bind_block(void *context, size_t block)
{
    const binding *b = context;
    for (size_t f = BLOCK * block; f < BLOCK * (block + 1) && f < b->target->nf; f++) bind_face(b, f);
}

static int write_pairs(const binding *b, vg_correspondence *c, vg_err *e)
{
    size_t pairs = 0, nf = b->target->nf;
    for (size_t f = 0; f < nf; f++)
        for (uint32_t i = 0; i < b->by[f].n; i++) pairs += b->by[f].weight[i] > 0;
    if (pairs >= UINT32_MAX) return vg_fail(e, VG_EINPUT, "there are too many faces to bind");
    c->first = vgi_array(nf + 1, sizeof *c->first, e), c->source = vgi_array(pairs, sizeof *c->source, e);
    c->weight = vgi_array(pairs, sizeof *c->weight, e), c->distance = vgi_array(nf, sizeof *c->distance, e);
    c->matched = vgi_array(nf, sizeof *c->matched, e);
    if (!c->first || !c->source || !c->weight || !c->distance || !c->matched) return VG_ENOMEM;
    for (size_t f = 0; f < nf; f++) {
        const bound_face *by = &b->by[f];
        c->first[f + 1] = c->first[f];
        for (uint32_t i = 0; i < by->n; i++) {
            if (!(by->weight[i] > 0)) continue;
            c->source[c->first[f + 1]] = by->face[i];
            c->weight[c->first[f + 1]++] = by->weight[i];
        }
        c->distance[f] = by->distance, c->matched[f] = VG_BOUND;
    }
    return VG_OK;
}

/* Mark the faces with an area, which have a frame. */
static bool *faces_with_area(const vg_mesh *m, const double *points, size_t *n, vg_err *e)
{
    bool *take = vgi_array(m->nf, sizeof *take, e);
    for (size_t f = 0; take && f < m->nf; f++) {
        double area[3];
        size_t r = m->start[f + 1] - m->start[f];
        vgi_face_area(points, m->vert + m->start[f], r, area);
        *n += take[f] = r > 2 && vgi_length(area) > 0;
    }
    return take;
}

int vg_bind(vg_correspondence *c, const vg_mesh *source, const double *source_points, const vg_mesh *target,
            const double *target_points, int threads, vg_err *e)
{
    binding b = {.source = source, .target = target, .target_points = target_points};
    size_t areas = 0;
    *c = (vg_correspondence){.source_nv = source->nv, .source_nf = source->nf, .target_nv = target->nv,
                             .target_nf = target->nf, .source_digest = vg_mesh_digest(source),
                             .target_digest = vg_mesh_digest(target)};
    bool *take = faces_with_area(source, source_points, &areas, e);
    int r = take ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && !areas) r = vg_fail(e, VG_EINPUT, "no face of the source has an area: nothing can be bound to "
                                                        "it");
    if (r == VG_OK && !target->nf) r = vg_fail(e, VG_EINPUT, "the target has no faces");
    b.take = take;
    if (r == VG_OK) r = vgi_surface_of(&b.surface, source, source_points, take, e);
    if (r == VG_OK) r = vgi_incidence_make(&b.around, source, e);
    if (r == VG_OK && !(b.by = vgi_array(target->nf, sizeof *b.by, e))) r = VG_ENOMEM;
    if (r == VG_OK) {
        vgi_parallel(threads, (target->nf + BLOCK - 1) / BLOCK, bind_block, &b);
        r = write_pairs(&b, c, e);
    }
    if (r < 0) vg_correspondence_clear(c);
    vgi_surface_free(&b.surface);
    vgi_incidence_clear(&b.around);
    free(b.by);
    free(take);
    return r;
}

bool vg_is_bound(const vg_correspondence *c)
{
    return c->first && c->target_nf && c->matched[0] == VG_BOUND;
}

/* ---- positions in a pose ---- */

/* A source face that a vertex follows. */
typedef struct frame {
    uint32_t face;
    double centre[3], normal[3]; /* in the rest pose; the length of the normal is the size of the face */
    double inverse[9];           /* (sum of w w' over the corners, relative to the centroid, and of n n')^-1 */
    double now[3], matrix[9];    /* in the pose: its centroid, and the map of directions */
} frame;

struct vg_rider {
    const vg_mesh *source;
    size_t nv, nframes;
    int threads;
    frame *frames;
    uint32_t *first, *by; /* nv + 1; the frames of each vertex, and their weights */
    double *weight;
    vgi_hit *foot;        /* nv: the nearest point of the source at rest */
    double *above;        /* nv: vector from that point to the vertex */
    const double *source_rest;
    const double *pose;   /* argument of the current call */
    double *out;
};

/* The centroid of a face, and its normal with the given length; 0 for a face without area. */
static void face_frame(const vg_mesh *m, const double *points, uint32_t f, double length, double centre[3], double normal[3])
{
    centre_of(m, points, f, centre);
    vgi_face_area(points, m->vert + m->start[f], m->start[f + 1] - m->start[f], normal);
    vgi_make_unit(normal);
    vgi_scale(normal, length);
}

/* Sum of a b' over the corners, relative to the centroids, and over the normals: a in the pose, b at rest. */
static void sum_outer(const vg_mesh *m, const frame *x, const double *points, const double *rest, const double centre[3],
                      const double normal[3], double S[9])
{
    memset(S, 0, 9 * sizeof *S);
    for (uint32_t i = m->start[x->face]; i < m->start[x->face + 1]; i++) {
        const double *p = points + 3 * (size_t)m->vert[i], *q = rest + 3 * (size_t)m->vert[i];
        double u[3], v[3];
        vgi_subtract(p, centre, u), vgi_subtract(q, x->centre, v);
        vgi_add_outer(S, 1, u, v);
    }
    vgi_add_outer(S, 1, normal, x->normal);
}

static void rest_frame(const vg_mesh *m, frame *x, const double *rest)
{
    double area[3], S[9], cofactors[9];
    vgi_face_area(rest, m->vert + m->start[x->face], m->start[x->face + 1] - m->start[x->face], area);
    face_frame(m, rest, x->face, sqrt(vgi_length(area)), x->centre, x->normal);
    sum_outer(m, x, rest, rest, x->centre, x->normal, S);
    double determinant = vgi_cofactors(S, cofactors);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) x->inverse[3 * i + k] = determinant > 0 ? cofactors[3 * k + i] / determinant : 0;
}

static void pose_block(void *context, size_t block)
{
    vg_rider *rider = context;
    for (size_t i = BLOCK * block; i < BLOCK * (block + 1) && i < rider->nframes; i++) {
        frame *x = &rider->frames[i];
        double normal[3], S[9];
        face_frame(rider->source, rider->pose, x->face, vgi_length(x->normal), x->now, normal);
        sum_outer(rider->source, x, rider->pose, rider->source_rest, x->now, normal, S);
        vgi_multiply(S, x->inverse, x->matrix);
    }
}

/* The foot of a vertex in the pose, at the same position in its triangle (see vgi_hit). */
static void foot_in_pose(const vg_rider *rider, const vgi_hit *hit, double at[3])
{
    const vg_mesh *m = rider->source;
    uint32_t begin = m->start[hit->face], end = m->start[hit->face + 1], next = hit->corner + 1 < end ? hit->corner + 1 : begin,
             last = next + 1 < end ? next + 1 : begin;
    const double *a = rider->pose + 3 * (size_t)m->vert[hit->corner], *b = rider->pose + 3 * (size_t)m->vert[next];
    double centre[3];
    const double *c = rider->pose + 3 * (size_t)m->vert[last];
    if (end - begin > 3) centre_of(m, rider->pose, hit->face, centre), c = centre;
    for (int k = 0; k < 3; k++) at[k] = a[k] + hit->u[0] * (b[k] - a[k]) + hit->u[1] * (c[k] - a[k]);
}

/* The offset from the foot follows the frames of the surrounding faces. */
static void vertex_block(void *context, size_t block)
{
    vg_rider *rider = context;
    for (size_t v = BLOCK * block; v < BLOCK * (block + 1) && v < rider->nv; v++) {
        double at[3];
        foot_in_pose(rider, &rider->foot[v], at);
        for (uint32_t i = rider->first[v]; i < rider->first[v + 1]; i++) {
            double above[3];
            vgi_multiply_vector(rider->frames[rider->by[i]].matrix, rider->above + 3 * v, above);
            vgi_add_scaled(at, rider->weight[i], above);
        }
        memcpy(rider->out + 3 * v, at, sizeof at);
    }
}

void vg_rider_apply(vg_rider *rider, const double *pose, double *vertices)
{
    rider->pose = pose, rider->out = vertices;
    vgi_parallel(rider->threads, (rider->nframes + BLOCK - 1) / BLOCK, pose_block, rider);
    vgi_parallel(rider->threads, (rider->nv + BLOCK - 1) / BLOCK, vertex_block, rider);
}

/* ---- construction ---- */

/* The source faces in use, each once; number[f]: index of face f among them. */
static int make_frames(vg_rider *rider, const vg_correspondence *c, uint32_t *number, vg_err *e)
{
    memset(number, 0xff, c->source_nf * sizeof *number);
    for (uint32_t i = 0; i < c->first[c->target_nf]; i++)
        if (number[c->source[i]] == UINT32_MAX) number[c->source[i]] = (uint32_t)rider->nframes++;
    rider->frames = vgi_array(rider->nframes, sizeof *rider->frames, e);
    if (!rider->frames) return VG_ENOMEM;
    for (size_t f = 0; f < c->source_nf; f++) {
        if (number[f] == UINT32_MAX) continue;
        frame *x = &rider->frames[number[f]];
        x->face = (uint32_t)f;
        rest_frame(rider->source, x, rider->source_rest);
    }
    return VG_OK;
}

typedef struct feet {
    vg_rider *r;
    const vgi_surface *surface;
    const double *points;
} feet;

static void find_feet(void *context, size_t block)
{
    const feet *x = context;
    vg_rider *rider = x->r;
    for (size_t v = BLOCK * block; v < BLOCK * (block + 1) && v < rider->nv; v++) {
        vgi_hit *hit = &rider->foot[v];
        if (!vgi_surface_nearest(x->surface, x->points + 3 * v, NULL, 0, INFINITY, hit)) continue;
        vgi_subtract(x->points + 3 * v, hit->point, rider->above + 3 * v);
    }
}

/* Find the feet on the source faces in use. */
static int make_feet(vg_rider *rider, const uint32_t *number, const double *points, vg_err *e)
{
    vgi_surface *surface = NULL;
    bool *take = vgi_array(rider->source->nf, sizeof *take, e);
    rider->foot = vgi_array(rider->nv, sizeof *rider->foot, e);
    rider->above = vgi_array(3 * rider->nv, sizeof *rider->above, e);
    int r = take && rider->foot && rider->above ? VG_OK : VG_ENOMEM;
    for (size_t f = 0; r == VG_OK && f < rider->source->nf; f++) take[f] = number[f] != UINT32_MAX;
    if (r == VG_OK) r = vgi_surface_of(&surface, rider->source, rider->source_rest, take, e);
    feet x = {rider, surface, points};
    if (r == VG_OK) vgi_parallel(rider->threads, (rider->nv + BLOCK - 1) / BLOCK, find_feet, &x);
    vgi_surface_free(&surface);
    free(take);
    return r;
}

/* Per vertex: the vertex whose faces it follows: itself, or the nearest one that has faces. */
static uint32_t *find_hosts(const vgi_incidence *around, const double *points, size_t nv, vg_err *e)
{
    vgi_kdtree *tree = NULL;
    uint32_t *host = vgi_array_raw(nv, sizeof *host, e), *without = vgi_array_raw(nv, sizeof *without, e);
    bool loose = false;
    for (size_t v = 0; host && without && v < nv; v++) {
        without[v] = around->first[v] == around->first[v + 1];
        host[v] = (uint32_t)v, loose |= without[v];
    }
    if (!host || !without || (loose && vgi_kdtree_new(&tree, points, nv, e) < 0)) {
        free(without);
        return free(host), NULL;
    }
    if (loose) vgi_kdtree_label(tree, without);
    for (size_t v = 0; loose && v < nv; v++) {
        vgi_near near;
        if (without[v] && vgi_kdtree_nearest_other(tree, points + 3 * v, 1, INFINITY, &near)) host[v] = near.index;
    }
    vgi_kdtree_free(&tree);
    free(without);
    return host;
}

/* A vertex follows the drivers of its faces in equal shares. A source face that drives several of them is listed for
 * each. */
static int make_weights(vg_rider *rider, const vg_correspondence *c, const vg_mesh *target, const double *points,
                        const uint32_t *number, vg_err *e)
{
    vgi_incidence around = {0};
    uint32_t *host = NULL;
    size_t cap = 0, weight_cap = 0, n = 0;
    int r = vgi_incidence_make(&around, target, e);
    rider->first = vgi_array(rider->nv + 1, sizeof *rider->first, e);
    if (r == VG_OK && (!rider->first || !(host = find_hosts(&around, points, rider->nv, e)))) r = VG_ENOMEM;
    for (size_t v = 0; r == VG_OK && v < rider->nv; v++) {
        uint32_t begin = around.first[host[v]], end = around.first[host[v] + 1];
        for (uint32_t j = begin; j < end && r == VG_OK; j++) {
            uint32_t f = around.face[j];
            size_t more = c->first[f + 1] - c->first[f];
            r = vgi_grow(&rider->by, &cap, n + more, sizeof *rider->by, e);
            if (r == VG_OK) r = vgi_grow(&rider->weight, &weight_cap, n + more, sizeof *rider->weight, e);
            for (uint32_t i = c->first[f]; r == VG_OK && i < c->first[f + 1]; i++, n++)
                rider->by[n] = number[c->source[i]], rider->weight[n] = c->weight[i] / (end - begin);
        }
        if (n >= UINT32_MAX) r = vg_fail(e, VG_EINPUT, "there are too many faces to bind to");
        rider->first[v + 1] = (uint32_t)n;
    }
    vgi_incidence_clear(&around);
    free(host);
    return r;
}

static int check_fit(const vg_correspondence *c, const vg_mesh *source, const vg_mesh *target, vg_err *e)
{
    if (!vg_is_bound(c)) return vg_fail(e, VG_EINPUT, "the correspondence binds nothing: make one with vg-register --bind");
    if (c->source_nv != source->nv || c->source_nf != source->nf || c->source_digest != vg_mesh_digest(source))
        return vg_fail(e, VG_EINPUT, "the correspondence is for another source mesh (%zu vertices, %zu faces)", c->source_nv,
                       c->source_nf);
    if (c->target_nv != target->nv || c->target_nf != target->nf || c->target_digest != vg_mesh_digest(target))
        return vg_fail(e, VG_EINPUT, "the correspondence is for another target mesh (%zu vertices, %zu faces)", c->target_nv,
                       c->target_nf);
    return VG_OK;
}

int vg_rider_new(vg_rider **out, const vg_mesh *source, const double *source_points, const vg_correspondence *c,
                 const vg_mesh *target, const double *target_points, int threads, vg_err *e)
{
    *out = NULL;
    if (check_fit(c, source, target, e) < 0) return VG_EINPUT;
    vg_rider *rider = vgi_array(1, sizeof *rider, e);
    uint32_t *number = vgi_array_raw(source->nf, sizeof *number, e);
    int r = rider && number ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) rider->source = source, rider->source_rest = source_points, rider->nv = target->nv, rider->threads = threads;
    if (r == VG_OK) r = make_frames(rider, c, number, e);
    if (r == VG_OK) r = make_weights(rider, c, target, target_points, number, e);
    if (r == VG_OK) r = make_feet(rider, number, target_points, e);
    free(number);
    if (r < 0 && rider) vg_rider_free(&rider);
    *out = rider;
    return r;
}

void vg_rider_free(vg_rider **rider)
{
    if (!*rider) return;
    free((*rider)->frames);
    free((*rider)->first);
    free((*rider)->by);
    free((*rider)->weight);
    free((*rider)->foot);
    free((*rider)->above);
    free(*rider);
    *rider = NULL;
}
