/* gltf_character.c: a glTF character in poses other than its own: positions and normals of its vertices, in the space
 * of its meshes. Reading and packing are in gltf_asset.c, writing in gltf_morph.c and gltf_cast.c.
 *
 * A vertex at p is shown at M p, where M is the matrix of its node, or the weighted mean of the matrices of its
 * joints. A pose is converted to the space of the mesh by the inverse of M at rest, so that skin, nodes and morph
 * targets together show the pose.
 *
 * Normals keep the artist's shading: each is rotated as the adjacent faces are.
 * Vertices that are one vertex of the mesh and have equal normals share these faces, so that edges stay hard and
 * seams stay smooth.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_character.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

/* ---- matrices ---- */

static void linear(const double m[12], const double p[3], double to[3])
{
    for (int i = 0; i < 3; i++) to[i] = vgi_dot(m + 4 * i, p);
}

static void linear_transposed(const double m[12], const double p[3], double to[3])
{
    for (int i = 0; i < 3; i++) to[i] = m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2];
}

/* Returns false if the matrix is singular. */
static bool invert_matrix(const double m[12], double to[12])
{
    const double a[9] = {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, shift[3] = {m[3], m[7], m[11]};
    double c[9], size = 0;
    const double det = vgi_cofactors(a, c);
    for (int k = 0; k < 9; k++) size += a[k] * a[k];
    if (!(fabs(det) > 1e-9 * size * sqrt(size))) return false;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) to[4 * i + j] = c[3 * j + i] / det;
        to[4 * i + 3] = -vgi_dot(to + 4 * i, shift);
    }
    return true;
}

/* ---- positions of the vertices ---- */

/* 1; 0 if the matrix of a node or skin is singular */
static int place_vertices(vgi_gltf_character *c, vg_err *e)
{
    const vgi_gltf_scene *x = &c->scene;
    c->out = vgi_array_raw(c->n, 12 * sizeof(double), e), c->in = vgi_array_raw(c->n, 12 * sizeof(double), e);
    c->skinned = vgi_array(c->n, sizeof *c->skinned, e);
    if (!c->out || !c->in || !c->skinned) return VG_ENOMEM;
    for (size_t i = 0; i < x->nparts; i++) {
        const vgi_gltf_part *p = &x->parts[i];
        for (size_t v = 0; v < p->count; v++) {
            const size_t at = 12 * (p->first + v);
            c->skinned[p->first + v] = p->skin != VGI_GLTF_NONE;
            vgi_gltf_vertex_matrix(x, p, v, c->out + at);
            if (!vgi_finite(c->out + at, 12) || !invert_matrix(c->out + at, c->in + at)) return 0;
        }
    }
    return 1;
}

static void point_of(const vgi_gltf_character *c, const vgi_gltf_part *p, size_t v, double at[3], double shown[3])
{
    vgi_accessor_get(&p->position, v, at);
    vgi_gltf_move_point(c->out + 12 * (p->first + v), at, shown);
}

/* Whether the file shows the reference pose. */
static bool shows(const vgi_gltf_character *c, const vg_body *b)
{
    const double near = 1e-7 * vg_diagonal(b->reference, b->mesh.nv);
    for (size_t i = 0; i < c->scene.nparts; i++) {
        const vgi_gltf_part *p = &c->scene.parts[i];
        for (size_t v = 0; v < p->count; v++) {
            const double *to = b->reference + 3 * (size_t)c->vertex[p->first + v];
            double at[3], shown[3];
            point_of(c, p, v, at, shown);
            for (int k = 0; k < 3; k++)
                if (!(fabs(shown[k] - to[k]) <= near)) return false;
        }
    }
    return true;
}

/* Keep the positions of the file if it shows the reference pose. */
static int find_base(vgi_gltf_character *c, const vg_body *b, vg_err *e)
{
    if (!(c->base = vgi_array_raw(c->n, 3 * sizeof *c->base, e))) return VG_ENOMEM;
    c->kept = shows(c, b);
    for (size_t i = 0; i < c->scene.nparts; i++) {
        const vgi_gltf_part *p = &c->scene.parts[i];
        for (size_t v = 0; v < p->count; v++) {
            const size_t f = p->first + v;
            double at[3];
            if (c->kept) vgi_accessor_get(&p->position, v, at);
            else vgi_gltf_move_point(c->in + 12 * f, b->reference + 3 * (size_t)c->vertex[f], at);
            for (int k = 0; k < 3; k++) {
                c->base[3 * f + k] = (float)at[k];
                if (!isfinite(c->base[3 * f + k])) return vg_fail(e, VG_EINPUT, "a position is too large for binary32");
            }
        }
    }
    return VG_OK;
}

typedef struct seat {
    float at[3];
    uint32_t vertex; /* of the mesh */
    size_t node, instance;
} seat;

/* Order by position, then by vertex. */
static int by_seat(const void *a, const void *b)
{
    const seat *s = a, *t = b;
    if (s->node != t->node) return s->node < t->node ? -1 : 1;
    if (s->instance != t->instance) return s->instance < t->instance ? -1 : 1;
    for (int k = 0; k < 3; k++)
        if (s->at[k] < t->at[k] || s->at[k] > t->at[k]) return s->at[k] < t->at[k] ? -1 : 1;
    return (s->vertex > t->vertex) - (s->vertex < t->vertex);
}

int vgi_gltf_find_touches(vgi_gltf_character *c, const float *base, vg_err *e)
{
    seat *seats = vgi_array_raw(c->n, sizeof *seats, e);
    if (!seats) return VG_ENOMEM;
    for (size_t i = 0; i < c->scene.nparts; i++) {
        const vgi_gltf_part *p = &c->scene.parts[i];
        for (size_t f = p->first; f < p->first + p->count; f++) {
            const float *at = base + 3 * f;
            seats[f] = (seat){{at[0], at[1], at[2]}, c->vertex[f], p->node, (size_t)p->instance};
        }
    }
    qsort(seats, c->n, sizeof *seats, by_seat);
    for (size_t i = 1; i < c->n && !c->touches; i++) {
        seat before = seats[i - 1];
        before.vertex = seats[i].vertex;
        c->touches = seats[i - 1].vertex != seats[i].vertex && by_seat(&before, &seats[i]) == 0;
    }
    free(seats);
    return VG_OK;
}

/* ---- normals ---- */

/* A skin transforms normals by M itself, as all viewers do; a node by the inverse transpose. */
static void normal_out(const vgi_gltf_character *c, size_t f, const double n[3], double to[3])
{
    if (c->skinned[f]) linear(c->out + 12 * f, n, to);
    else linear_transposed(c->in + 12 * f, n, to);
    vgi_make_unit(to);
}

static void normal_in(const vgi_gltf_character *c, size_t f, const double n[3], double to[3])
{
    if (c->skinned[f]) linear(c->in + 12 * f, n, to);
    else linear_transposed(c->out + 12 * f, n, to);
    vgi_make_unit(to);
}

/* Nodes and skins transform tangents by M itself. */
static void tangent_out(const vgi_gltf_character *c, size_t f, const double t[3], double to[3])
{
    linear(c->out + 12 * f, t, to);
    vgi_make_unit(to);
}

static void tangent_in(const vgi_gltf_character *c, size_t f, const double t[3], double to[3])
{
    linear(c->in + 12 * f, t, to);
    vgi_make_unit(to);
}

/* Normals or tangents: an attribute of so many numbers, and where its directions are kept. */
typedef struct directions {
    const char *attribute, *what;
    size_t numbers;
    float **local;  /* in the space of the vertices, as the file has them */
    double **world;
    void (*out)(const vgi_gltf_character *c, size_t f, const double x[3], double to[3]);
} directions;

static int read_part(vgi_gltf_character *c, const vgi_gltf_part *p, const directions *k, vg_err *e)
{
    const vgi_json *ref = vgi_json_get(p->attributes, k->attribute);
    vgi_accessor a;
    if (!ref || vgi_gltf_accessor(&c->scene.g, ref, k->numbers, p->count, k->what, &a, NULL) < 0) return VG_OK;
    if (!*k->local && (!(*k->local = vgi_array(c->n, 3 * sizeof **k->local, e)) ||
                       !(*k->world = vgi_array(c->n, 3 * sizeof **k->world, e))))
        return VG_ENOMEM;
    for (size_t v = 0; v < p->count; v++) {
        const size_t f = p->first + v;
        double x[4];
        vgi_accessor_get(&a, v, x);
        if (!vgi_finite(x, 3)) continue;
        for (int i = 0; i < 3; i++) (*k->local)[3 * f + i] = (float)x[i];
        k->out(c, f, x, *k->world + 3 * f);
    }
    return VG_OK;
}

static bool has_normal_map(const vgi_gltf_scene *x, const vgi_json *primitive)
{
    const vgi_json *material;
    if (vgi_gltf_item(&x->g, vgi_json_get(primitive, "material"), "materials", &material, NULL, NULL) < 0) return false;
    const vgi_json *clearcoat = vgi_json_get(vgi_json_get(material, "extensions"), "KHR_materials_clearcoat");
    return vgi_json_get(material, "normalTexture") || vgi_json_get(clearcoat, "clearcoatNormalTexture");
}

bool vgi_gltf_needs_tangents(const vgi_gltf_scene *x, size_t part)
{
    if (!vgi_json_get(x->parts[part].attributes, "TANGENT") || !vgi_json_get(x->parts[part].attributes, "NORMAL")) return false;
    for (size_t i = 0; i < x->npieces; i++)
        if (x->pieces[i].part == part && has_normal_map(x, x->pieces[i].json)) return true;
    return false;
}

static int read_directions(vgi_gltf_character *c, vg_err *e)
{
    const directions normals = {"NORMAL", "normals", 3, &c->normal, &c->world_normal, normal_out};
    const directions tangents = {"TANGENT", "tangents", 4, &c->tangent, &c->world_tangent, tangent_out};
    int r = VG_OK;
    for (size_t i = 0; i < c->scene.nparts && r == VG_OK; i++) {
        r = read_part(c, &c->scene.parts[i], &normals, e);
        if (r == VG_OK && vgi_gltf_needs_tangents(&c->scene, i)) r = read_part(c, &c->scene.parts[i], &tangents, e);
    }
    return r;
}

/* Lists of the file's vertices that are one vertex of the mesh. */
static int group_normals(vgi_gltf_character *c, vg_err *e)
{
    uint32_t *head = vgi_array(c->nv, sizeof *head, e), *next = vgi_array(c->n, sizeof *next, e); /* file vertex + 1 */
    c->group = vgi_array_raw(c->n, sizeof *c->group, e);
    int r = head && next && c->group ? VG_OK : VG_ENOMEM;
    for (size_t f = 0; f < c->n && r == VG_OK; f++) {
        const float *n = c->normal + 3 * f;
        c->group[f] = UINT32_MAX;
        if (vgi_length(c->world_normal + 3 * f) == 0) continue;
        uint32_t *at = &head[c->vertex[f]];
        while (*at && memcmp(c->normal + 3 * (size_t)(*at - 1), n, 3 * sizeof *n)) at = &next[*at - 1];
        if (!*at) *at = (uint32_t)f + 1, c->group[f] = (uint32_t)c->ngroups++;
        else c->group[f] = c->group[*at - 1];
    }
    free(head);
    free(next);
    return r;
}

/* The unit sides of a triangle, side k from corner k on, and its unit normal. */
static void frame_of(const vgi_gltf_character *c, const uint32_t *v, const double *world, double frame[4][3])
{
    for (int k = 0; k < 3; k++) {
        vgi_subtract(world + 3 * (size_t)c->vertex[v[(k + 1) % 3]], world + 3 * (size_t)c->vertex[v[k]], frame[k]);
        vgi_make_unit(frame[k]);
    }
    vgi_cross(frame[0], frame[1], frame[3]);
    vgi_make_unit(frame[3]);
}

/* The frames and angles of all triangles in the pose that rotations are measured from. */
static void set_rest(vgi_gltf_character *c, const double *world)
{
    const vg_mesh *m = &c->faces.mesh;
    for (size_t f = 0; f < m->nf; f++) {
        vgi_gltf_frame *to = &c->rest[f];
        if (m->start[f + 1] - m->start[f] != 3) continue;
        frame_of(c, m->vert + m->start[f], world, to->frame);
        for (int k = 0; k < 3; k++)
            to->angle[k] = acos(fmax(-1, fmin(1, -vgi_dot(to->frame[k], to->frame[(k + 2) % 3]))));
    }
}

static void add_product(double m[9], double weight, const double d[3], const double r[3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) m[3 * i + j] += weight * (d[i] * r[j]);
}

/* Add a triangle to the sums of the groups at its corners. The best rotation of the normals and sides of the triangles
 * around a vertex is defined where the surface folds, too, and the sum of their normals points anywhere. */
static void add_face(const vgi_gltf_character *c, const vgi_gltf_frame *rest, const uint32_t *v, const double *world)
{
    double now[4][3];
    frame_of(c, v, world, now);
    for (int k = 0; k < 3; k++) {
        const int last = (k + 2) % 3;
        if (c->group[v[k]] == UINT32_MAX) continue;
        double *m = c->turn + 9 * (size_t)c->group[v[k]];
        add_product(m, rest->angle[k], now[3], rest->frame[3]);
        add_product(m, 1, now[k], rest->frame[k]);
        add_product(m, 1, now[last], rest->frame[last]);
    }
}

static void sum_faces(const vgi_gltf_character *c, const double *world)
{
    const vg_mesh *m = &c->faces.mesh;
    memset(c->turn, 0, 9 * c->ngroups * sizeof *c->turn);
    for (size_t f = 0; f < m->nf; f++)
        if (m->start[f + 1] - m->start[f] == 3) add_face(c, &c->rest[f], m->vert + m->start[f], world);
}

/* Whether the faces around a group are as in the rest pose: a sum of products of vectors with themselves. */
static bool is_still(const double m[9])
{
    return m[1] == m[3] && m[2] == m[6] && m[5] == m[7] && m[0] >= 0 && m[4] >= 0 && m[8] >= 0;
}

/* Change of a direction of vertex f when the world turns by r, in the space of its mesh. */
static void turn_direction(const vgi_gltf_character *c, size_t f, const double r[9], const double *world, const float *local,
                           void (*in)(const vgi_gltf_character *, size_t, const double *, double *), float *to)
{
    double turned[3], now[3];
    if (vgi_length(world + 3 * f) == 0) return;
    for (int i = 0; i < 3; i++) turned[i] = vgi_dot(r + 3 * i, world + 3 * f);
    in(c, f, turned, now);
    for (size_t k = 0; k < 3; k++) to[3 * f + k] = (float)(now[k] - local[3 * f + k]);
}

void vgi_gltf_character_turn(vgi_gltf_character *c, const double *world, float *normals, float *tangents)
{
    sum_faces(c, world);
    memset(normals, 0, 3 * c->n * sizeof *normals);
    if (tangents) memset(tangents, 0, 3 * c->n * sizeof *tangents);
    for (size_t f = 0; f < c->n; f++) {
        const double *m = c->group[f] == UINT32_MAX ? NULL : c->turn + 9 * (size_t)c->group[f];
        double r[9];
        if (!m || is_still(m)) continue;
        vgi_fit_rotation(m, r);
        turn_direction(c, f, r, c->world_normal, c->normal, normal_in, normals);
        if (tangents) turn_direction(c, f, r, c->world_tangent, c->tangent, tangent_in, tangents);
    }
}

/* Rotate the normals from the pose that the file shows to the reference pose. */
static int turn_base(vgi_gltf_character *c, const vg_body *b, vg_err *e)
{
    double *shown = vgi_array(c->nv, 3 * sizeof *shown, e), at[3];
    float *turned = vgi_array(c->n, 3 * sizeof *turned, e);
    int r = shown && turned ? VG_OK : VG_ENOMEM;
    for (size_t i = 0; i < c->scene.nparts && r == VG_OK; i++) {
        const vgi_gltf_part *p = &c->scene.parts[i];
        for (size_t v = 0; v < p->count; v++) point_of(c, p, v, at, shown + 3 * (size_t)c->vertex[p->first + v]);
    }
    if (r == VG_OK) {
        set_rest(c, shown);
        vgi_gltf_character_turn(c, b->reference, turned, NULL);
        for (size_t f = 0; f < c->n; f++) {
            float *n = c->normal + 3 * f;
            for (int k = 0; k < 3; k++) n[k] += turned[3 * f + k];
            normal_out(c, f, (const double[3]){n[0], n[1], n[2]}, c->world_normal + 3 * f);
        }
    }
    free(shown);
    free(turned);
    return r;
}

static int find_normals(vgi_gltf_character *c, const vg_body *b, vg_err *e)
{
    int r = read_directions(c, e);
    if (r < 0 || !c->normal) return r;
    if ((r = group_normals(c, e)) < 0) return r;
    c->rest = vgi_array(c->faces.mesh.nf, sizeof *c->rest, e), c->turn = vgi_array(c->ngroups, 9 * sizeof *c->turn, e);
    if (!c->rest || !c->turn) return VG_ENOMEM;
    if (!c->kept && (r = turn_base(c, b, e)) < 0) return r;
    set_rest(c, b->reference);
    return VG_OK;
}

/* ---- poses ---- */

void vgi_gltf_character_pose(const vgi_gltf_character *c, const double *world, const float *moved, float *to)
{
    for (size_t f = 0; f < c->n; f++) {
        const size_t v = 3 * (size_t)c->vertex[f];
        double local[3];
        vgi_gltf_move_point(c->in + 12 * f, world + v, local);
        const bool stays = moved[v] == 0 && moved[v + 1] == 0 && moved[v + 2] == 0;
        for (int k = 0; k < 3; k++) to[3 * f + k] = stays ? 0 : (float)(local[k] - c->base[3 * f + k]);
    }
}

void vgi_gltf_character_move(const vgi_gltf_character *c, const float *moved, float *to)
{
    for (size_t f = 0; f < c->n; f++) {
        const float *d = moved + 3 * (size_t)c->vertex[f];
        double local[3];
        linear(c->in + 12 * f, (const double[3]){d[0], d[1], d[2]}, local);
        for (int k = 0; k < 3; k++) to[3 * f + k] = (float)local[k];
    }
}

/* ---- opening ---- */

static int open_asset(vgi_gltf_character *c, const vg_asset *a, vg_err *e)
{
    vgi_input *in = NULL;
    int r = vgi_input_memory(&in, a->data, a->size, "asset", e);
    if (r < 0) return r;
    r = vgi_gltf_open(&c->scene.g, in, "the asset", e);
    vgi_input_free(&in);
    if (r == VG_OK) r = vgi_gltf_scene_read(&c->scene, &c->faces, e);
    if (r == VG_OK && c->scene.all != a->n) r = VG_EINPUT;
    return r;
}

int vgi_gltf_character_open(vgi_gltf_character *c, const vg_body *b, vg_err *e)
{
    const vg_asset *a = &b->asset;
    if (!a->n || a->digest != vg_mesh_digest(&b->mesh)) return 0;
    int r = open_asset(c, a, e);
    if (r == VG_ENOMEM) return r;
    if (r < 0) return 0;
    c->n = a->n, c->nv = b->mesh.nv, c->vertex = a->vertex;
    vgi_gltf_rest(&c->scene);
    if ((r = place_vertices(c, e)) <= 0) return r;
    r = find_base(c, b, e);
    if (r == VG_OK) r = vgi_gltf_find_touches(c, c->base, e);
    if (r == VG_OK) r = find_normals(c, b, e);
    return r < 0 ? r : 1;
}

void vgi_gltf_character_clear(vgi_gltf_character *c)
{
    void *const arrays[] = {c->out,     c->in,            c->base,    c->normal, c->world_normal,
                            c->tangent, c->world_tangent, c->skinned, c->group,  c->rest, c->turn};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    vg_mesh_clear(&c->faces.mesh);
    vgi_gltf_scene_clear(&c->scene);
}
