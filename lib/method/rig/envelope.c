/* envelope.c: fits a map of bones to poses (MATH 6; T 5): bone and offset of each corner, held vertices, and the
 * linear operator they collapse into. Sums over poses are in rig_sums.c, weights in skin.c, the regression of what is
 * left in refine.c, unknown motions in inverse_skin.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/vec3.h"
#include "numeric/lapack.h"
#include "method/rig/map_parts.h"
#include "method/rig/refine.h"
#include "method/rig/skin.h"
#include "model/rig.h"
#include "numeric/stats.h"

#include <math.h>
#include <stdlib.h>

enum { CHUNK = 64, MOST_HELD = 2048, NEAR = 32 };

struct vg_rig_fitter {
    const vg_head *h;
    vg_rig rig;  /* the rig of h with the weights of the last fit */
    vg_rig_options o;
    vg_graph *g;
    vgi_turns turns;
    vgi_rig_sums sums;
    double *miss; /* nv: error of linear blend skinning per vertex */
    bool skinned; /* the skin was fitted to all poses added so far */
    vg_map base;  /* the envelope before refinement, for o.bones_per_corner; n == 0: not computed yet */
    vgi_trials trials; /* of vg_rig_fitter_try */
};

int vg_rig_fitter_new(vg_rig_fitter **out, const vg_head *h, const vg_rig_options *o, vg_err *e)
{
    *out = NULL;
    if (!h->body.rig.nbones) return vg_fail(e, VG_EINPUT, "there is no skeleton to fit");
    if (o->bones_per_corner < 1 || o->bones_per_corner > 2)
        return vg_fail(e, VG_EARG, "a corner has 1 or 2 bones, not %zu", o->bones_per_corner);
    if (!h->links.chosen) return vg_fail(e, VG_EARG, "the links are not chosen: call vg_head_prepare_vectors first");
    vg_rig_fitter *f = *out = vgi_array(1, sizeof *f, e);
    if (!f) return VG_ENOMEM;
    f->h = h, f->o = *o;
    double *at = vgi_array(3 * h->body.rig.nbones, sizeof *at, e);
    int r = at ? vg_rig_copy(&f->rig, &h->body.rig, h->body.mesh.nv, e) : VG_ENOMEM;
    for (size_t b = 0; r == VG_OK && b < h->body.rig.nbones; b++)
        memcpy(at + 3 * b, h->body.rig.at + 3 * (size_t)h->body.rig.bone[b], 3 * sizeof *at);
    if (r == VG_OK) r = vg_head_graph(&f->g, h, e);
    if (r == VG_OK) r = vgi_turns_make(&f->turns, f->g->faces.nf, f->g->faces.start, f->g->faces.vert, h->body.reference, e);
    if (r == VG_OK) r = vgi_rig_sums_make(&f->sums, h->body.mesh.nv, h->body.rig.nbones, at, o->trial ? NULL : &f->turns, e);
    if (r == VG_OK && !(f->miss = vgi_array(h->body.mesh.nv, sizeof *f->miss, e))) r = VG_ENOMEM;
    free(at);
    if (r < 0) vg_rig_fitter_free(out);
    return r;
}

void vg_rig_fitter_free(vg_rig_fitter **out)
{
    vg_rig_fitter *f = *out;
    if (!f) return;
    vg_rig_clear(&f->rig);
    vg_graph_free(&f->g);
    vgi_turns_clear(&f->turns);
    vgi_rig_sums_clear(&f->sums);
    free(f->miss);
    vg_map_clear(&f->base);
    vgi_trials_clear(&f->trials);
    free(f);
    *out = NULL;
}

void vg_rig_fitter_choose(vg_rig_fitter *f, size_t bones_per_corner, double refine)
{
    if (bones_per_corner != f->o.bones_per_corner) vg_map_clear(&f->base);
    f->o.bones_per_corner = bones_per_corner, f->o.refine = refine;
}

void vg_rig_fitter_add(vg_rig_fitter *f, size_t n, const double *const *poses, const double *const *transforms)
{
    enum { SOME = 32 };
    const double *p[SOME], *t[SOME];
    size_t count = 0;
    f->skinned = false;
    vg_map_clear(&f->base);
    for (size_t k = 0; k < n; k++) {
        if (!memcmp(poses[k], f->h->body.reference, 3 * f->h->body.mesh.nv * sizeof(double)))
            continue; /* carries no information */
        p[count] = poses[k], t[count++] = transforms[k];
        if (count == SOME) {
            vgi_rig_sums_add(&f->sums, count, p, t, f->o.threads);
            count = 0;
        }
    }
    vgi_rig_sums_add(&f->sums, count, p, t, f->o.threads);
}

/* ---- corners ---- */

typedef struct cornering {
    const vg_rig_fitter *f;
    vg_map *m;
    size_t chunks;
    double *space; /* per chunk: 4 n */
} cornering;

/* Sum of squared scales of a bone. */
static double weight_of(const vgi_rig_sums *s, size_t j)
{
    return s->cross[4 * j * 4 * s->n + 4 * j];
}

/* Rotation of a face relative to bone j; in a trial any will do, since only vectors count. */
static void face_turn(const vgi_rig_sums *s, size_t face, size_t j, double q[4])
{
    double m[9], h[9];
    if (!s->turn) {
        memcpy(q, (const double[4]){1, 0, 0, 0}, 4 * sizeof *q);
        return;
    }
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) m[3 * i + k] = s->turn[(3 * face + k) * 3 * s->n + 3 * j + i];
    vgi_fit_rotation(m, h);
    vg_quat_from_matrix(h, q);
}

/* The quaternion that maps reference vector r to u: the rotation of its face, then the smallest rotation. */
static void corner_quaternion(const vgi_rig_sums *s, size_t face, size_t j, const double r[3], const double u[3],
                              double q[4])
{
    double turn[4], turned[3], rest[4] = {1, 0, 0, 0};
    face_turn(s, face, j, turn);
    vg_quat_apply(turn, r, turned);
    if (vgi_dot(r, r) > 0 && vgi_dot(u, u) > 1e-18 * vgi_dot(r, r)) vg_quat_between(turned, u, rest);
    else if (vgi_dot(r, r) > 0) rest[0] = 1e-9; /* u vanishes */
    vg_quat_multiply(rest, turn, q);
}

/* Candidate bones of a face: those in the skin of its vertices. */
static size_t face_bones(const vg_rig_fitter *f, size_t face, uint32_t *list)
{
    const vg_rig *r = &f->rig;
    size_t n = 0;
    for (uint32_t c = f->g->faces.start[face]; c < f->g->faces.start[face + 1]; c++)
        for (size_t s = VG_SKIN * f->g->faces.vert[c]; s < VG_SKIN * (f->g->faces.vert[c] + 1); s++) {
            size_t i = 0;
            while (i < n && list[i] != r->skin_bone[s]) i++;
            if (i == n && n < NEAR && r->skin_weight[s] > 0) list[n++] = r->skin_bone[s];
        }
    return n;
}

/* Least squares for d = A_a x + A_b y over the poses, for x and y. Returns the explained part of sum |d|^2. The
 * unknowns are x + y and y, the latter with a ridge: where both bones move alike, the first takes everything. */
static double pair_vectors(const vgi_rig_sums *s, size_t a, size_t b, const double *raw, double x[3], double y[3])
{
    static const double ridge = 1e-4;
    size_t width = 4 * s->n;
    double m[36] = {0}, z[6], explained = 0, wa = weight_of(s, a), wb = weight_of(s, b);
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) {
            double ab = s->cross[(4 * a + i) * width + 4 * b + k], ba = s->cross[(4 * b + i) * width + 4 * a + k];
            m[6 * i + k] = i == k ? wa : 0;
            m[6 * (3 + i) + k] = ba - (i == k ? wa : 0);
            m[6 * (3 + i) + 3 + k] = (i == k ? (1 + ridge) * wa + wb : 0) - ab - ba;
        }
    for (size_t k = 0; k < 3; k++) z[k] = raw[4 * a + k], z[3 + k] = raw[4 * b + k] - raw[4 * a + k];
    if (!vgi_spd_factor(6, m)) return -INFINITY;
    vgi_spd_solve(6, m, 1, z);
    for (size_t k = 0; k < 3; k++) {
        y[k] = z[3 + k], x[k] = z[k] - z[3 + k];
        explained += x[k] * raw[4 * a + k] + y[k] * raw[4 * b + k];
    }
    return explained;
}

/* Fit one corner. raw: for each bone the sum of A' d, in steps of 4. */
static void fit_corner(const cornering *x, size_t face, size_t c, const double *raw, const uint32_t *list, size_t n)
{
    const vgi_rig_sums *s = &x->f->sums;
    const double *r = x->f->turns.vector + 3 * c;
    size_t per = x->m->per_corner, best = list[0];
    double most = -1, u[3], w[3];
    for (size_t i = 0; i < n; i++) {
        const double *own = raw + 4 * (size_t)list[i];
        double explained = vgi_dot(own, own) / weight_of(s, list[i]);
        if (explained > most) most = explained, best = list[i];
    }
    vgi_divided(raw + 4 * best, weight_of(s, best), u);
    if (per == 2) {
        size_t second = best;
        double more = -INFINITY, p[3], q[3];
        for (size_t i = 0; i < n; i++) {
            if (list[i] == best) continue;
            double explained = pair_vectors(s, best, list[i], raw, p, q);
            if (explained > more) more = explained, second = list[i];
        }
        if (second != best && more > most) pair_vectors(s, best, second, raw, u, w);
        else
            for (size_t k = 0; k < 3; k++) second = best, u[k] *= 0.5, w[k] = u[k];
        x->m->corner_bone[2 * c + 1] = (uint32_t)second;
        corner_quaternion(s, face, second, r, w, x->m->corner + 4 * (2 * c + 1));
    }
    x->m->corner_bone[per * c] = (uint32_t)best;
    corner_quaternion(s, face, best, r, u, x->m->corner + 4 * per * c);
}

static void fit_faces(void *context, size_t task)
{
    const cornering *x = context;
    const vg_graph *g = x->f->g;
    const vgi_rig_sums *s = &x->f->sums;
    size_t faces = g->faces.nf - g->nlinks, first = task * faces / x->chunks, last = (task + 1) * faces / x->chunks,
           width = 4 * s->n;
    double *raw = x->space + task * 2 * width, *mean = raw + width;
    for (size_t face = first; face < last; face++) {
        uint32_t list[NEAR];
        size_t n = face_bones(x->f, face, list), begin = g->faces.start[face], r = g->faces.start[face + 1] - begin;
        for (size_t b = 0; b < n; b++)
            for (size_t i = 4 * list[b]; i < 4 * (size_t)list[b] + 3; i++) {
                mean[i] = 0;
                for (size_t c = begin; c < begin + r; c++) mean[i] += s->pull[g->faces.vert[c] * width + i] / (double)r;
            }
        for (size_t c = begin; c < begin + r; c++) {
            for (size_t b = 0; b < n; b++)
                for (size_t i = 4 * list[b]; i < 4 * (size_t)list[b] + 3; i++)
                    raw[i] = s->pull[g->faces.vert[c] * width + i] - mean[i];
            fit_corner(x, face, c, raw, list, n);
        }
    }
}

static int fit_corners(const vg_rig_fitter *f, vg_map *m, vg_err *e)
{
    cornering x = {f, m, f->g->faces.nf < CHUNK ? 1 : CHUNK, NULL};
    if (!(x.space = vgi_array(x.chunks, 8 * m->n * sizeof *x.space, e))) return VG_ENOMEM;
    vgi_parallel(f->o.threads, x.chunks, fit_faces, &x);
    for (size_t i = m->per_corner * (size_t)f->g->faces.start[f->g->faces.nf - f->g->nlinks]; i < m->per_corner * m->ncorners;
         i++)
        m->corner[4 * i] = 1; /* a link follows the skin of its ends */
    free(x.space);
    return VG_OK;
}

/* the held vertices */

/* Distance of vertex v from rigid motion with its best bone, in mesh units. */
static double rigidity(const vgi_rig_sums *s, size_t v)
{
    size_t width = 4 * s->n;
    double least = INFINITY;
    for (size_t j = 0; j < s->n; j++) {
        const double *c = s->cross + 4 * j * width + 4 * j, *y = s->pull + v * width + 4 * j;
        const double d[3] = {y[0] - c[3], y[1] - c[width + 3], y[2] - c[2 * width + 3]};
        double left = s->square[v] - 2 * y[3] + c[3 * width + 3] - vgi_dot(d, d) / c[0];
        if (left < least) least = left;
    }
    return least > 0 ? sqrt(least / (double)s->poses) : 0;
}

typedef struct choosing {
    const vg_rig_fitter *f;
    double *doubt;    /* per vertex: deviation from rigid motion and from its skin */
    double *distance; /* squared distance from the nearest chosen vertex; -1: excluded */
    uint32_t *list;
    size_t n;
} choosing;

static void hold_vertex(choosing *x, size_t v)
{
    const double *p = x->f->h->body.reference, *at = p + 3 * v;
    x->list[x->n++] = (uint32_t)v;
    for (size_t i = 0; i < x->f->g->faces.nv; i++, p += 3) {
        double d =
            (p[0] - at[0]) * (p[0] - at[0]) + (p[1] - at[1]) * (p[1] - at[1]) + (p[2] - at[2]) * (p[2] - at[2]);
        if (d < x->distance[i]) x->distance[i] = d;
    }
    x->distance[v] = -1;
}

/* Choose one vertex per bone and component: the one with the smallest deviation. */
static int hold_groups(choosing *x, vg_err *e)
{
    const vg_head *h = x->f->h;
    size_t nv = h->body.mesh.nv, bones = x->f->rig.nbones, components, slots;
    uint32_t *label = vgi_array(nv, sizeof *label, e), *best = NULL;
    int r = label ? vg_mesh_components(&h->body.mesh, label, &components, e) : VG_ENOMEM;
    if (r == VG_OK && !vgi_mul(components, bones, &slots))
        r = vg_fail(e, VG_ENOMEM, "not enough memory for %zu bones of %zu components", bones, components);
    if (r == VG_OK && !(best = vgi_array(slots, sizeof *best, e))) r = VG_ENOMEM;
    for (size_t v = 0; r == VG_OK && v < nv; v++) {
        if (x->distance[v] < 0) continue;
        uint32_t *to = &best[label[v] * bones + x->f->rig.skin_bone[VG_SKIN * v]];
        if (!*to || x->doubt[v] < x->doubt[*to - 1]) *to = (uint32_t)v + 1;
    }
    for (size_t i = 0; r == VG_OK && i < slots && x->n < MOST_HELD; i++)
        if (best[i]) hold_vertex(x, best[i] - 1);
    free(label);
    free(best);
    return r;
}

/* Then choose vertices with small deviations far from all chosen ones, until the share is reached. */
static int choose_held(const vg_rig_fitter *f, vg_map *m, vg_err *e)
{
    static const double tolerance = 1e-3; /* in D; smaller deviations count as zero */
    size_t nv = f->g->faces.nv, want = (size_t)(f->o.hold * (double)f->g->attached + 0.5);
    double d = vg_diagonal(f->h->body.reference, nv);
    choosing x = {.f = f,
                  .doubt = vgi_array(nv, sizeof *x.doubt, e),
                  .distance = vgi_array(nv, sizeof *x.distance, e),
                  .list = vgi_array(nv, sizeof *x.list, e)};
    int r = x.doubt && x.distance && x.list ? VG_OK : VG_ENOMEM;
    for (size_t v = 0; r == VG_OK && v < nv; v++) {
        x.distance[v] = f->g->in_face[v] ? 4 * d * d : -1;
        x.doubt[v] = (rigidity(&f->sums, v) + f->miss[v]) / (d > 0 ? tolerance * d : 1);
    }
    if (r == VG_OK) r = hold_groups(&x, e);
    while (r == VG_OK && x.n < want && x.n < MOST_HELD) {
        size_t best = nv;
        double most = 0;
        for (size_t v = 0; v < nv; v++) {
            double value = x.distance[v] / (1 + x.doubt[v] * x.doubt[v]);
            if (value > most) most = value, best = v;
        }
        if (best == nv) break;
        hold_vertex(&x, best);
    }
    if (r == VG_OK) {
        qsort(x.list, x.n, sizeof *x.list, vgi_by_index);
        m->held = x.list, m->nheld = x.n, x.list = NULL;
    }
    free(x.doubt);
    free(x.distance);
    free(x.list);
    return r;
}

/* ---- the map ---- */

static int make_arrays(const vg_rig_fitter *f, vg_map *m, bool corners, vg_err *e)
{
    const vg_rig *r = &f->rig;
    size_t n = r->nbones, nv = f->g->faces.nv;
    *m = (vg_map){.n = n,
                  .nv = nv,
                  .kind = VG_MAP_BONES,
                  .size = 1,
                  .per_corner = corners ? f->o.bones_per_corner : 1,
                  .ncorners = corners ? vg_graph_corners(f->g) : 0};
    m->place = vgi_array(n, 3 * n * sizeof *m->place, e);
    m->centre = vgi_copy_array(f->sums.at, 3 * n, sizeof *m->centre, e);
    m->home_centre = vgi_copy_array(f->sums.at, 3 * n, sizeof *m->centre, e);
    m->share = vgi_array(n, sizeof *m->share, e);
    m->weights = vgi_array(nv, 4 * n * sizeof *m->weights, e);
    m->corner = vgi_array(m->ncorners * m->per_corner, 4 * sizeof *m->corner, e);
    m->corner_bone = vgi_array(m->ncorners, m->per_corner * sizeof *m->corner_bone, e);
    if (!m->place || !m->centre || !m->home_centre || !m->share || !m->weights || !m->corner || !m->corner_bone)
        return VG_ENOMEM;
    for (size_t s = 0; s < VG_SKIN * nv; s++) m->share[r->skin_bone[s]] += r->skin_weight[s] / (double)nv;
    return vgi_place_by_bones(r, m, m->place, e);
}

/* The envelope before refinement, into f->base. */
static int make_base(vg_rig_fitter *f, vg_err *e)
{
    const vgi_map_body body = {f->h->body.reference, &f->rig};
    int r = make_arrays(f, &f->base, true, e);
    if (r == VG_OK) r = fit_corners(f, &f->base, e);
    if (r == VG_OK) r = choose_held(f, &f->base, e);
    if (r == VG_OK) r = vgi_map_collapse(&f->base, &body, f->g, NULL, f->turns.vector, f->o.threads, e);
    if (r < 0) vg_map_clear(&f->base);
    return r;
}

static int fit_skin(vg_rig_fitter *f, vg_err *e)
{
    if (!f->sums.poses) return vg_fail(e, VG_EINPUT, "there are no poses but the reference to fit a rig to");
    int r = f->skinned ? VG_OK : vgi_skin_fit(&f->rig, &f->sums, f->h->body.reference, f->o.threads, f->miss, e);
    f->skinned = r == VG_OK;
    return r;
}

static vgi_envelope envelope_of(const vg_rig_fitter *f)
{
    return (vgi_envelope){&f->sums, &f->rig, f->h->body.reference, f->g->in_face, &f->base, f->o.threads};
}

int vg_rig_fitter_finish(vg_rig_fitter *f, vg_rig_method method, vg_rig *rig, vg_map *m, vg_err *e)
{
    const vgi_map_body body = {f->h->body.reference, &f->rig};
    *rig = (vg_rig){0}, *m = (vg_map){0};
    int r = f->o.trial ? vg_fail(e, VG_EARG, "a trial has no map") : fit_skin(f, e);
    if (r == VG_OK && method == VG_RIG_LBS) {
        r = make_arrays(f, m, false, e);
        for (size_t v = 0; r == VG_OK && v < m->nv; v++) vgi_map_skin_row(m, &body, v);
    } else if (r == VG_OK) {
        vgi_envelope x = envelope_of(f);
        if (!f->base.n) r = make_base(f, e);
        if (r == VG_OK) r = vg_map_copy(m, &f->base, e);
        if (r == VG_OK) r = vgi_refine(&x, f->o.refine, m, e);
    }
    if (r == VG_OK) r = vg_rig_copy(rig, &f->rig, f->g->faces.nv, e);
    if (r < 0) vg_map_clear(m);
    return r;
}

int vg_rig_fitter_try(vg_rig_fitter *f, size_t n, const double *ridge, vg_err *e)
{
    vgi_envelope x = envelope_of(f);
    int r = fit_skin(f, e);
    if (r == VG_OK && !f->base.n) r = make_base(f, e);
    vgi_trials_clear(&f->trials);
    return r < 0 ? r : vgi_trials_make(&f->trials, &x, n, ridge, e);
}

int vg_rig_fitter_judge(vg_rig_fitter *f, size_t n, const double *const *poses, const double *const *transforms,
                        double *const *sums, vg_err *e)
{
    vgi_envelope x = envelope_of(f);
    if (!f->trials.n) return vg_fail(e, VG_EARG, "there is nothing to judge: call vg_rig_fitter_try first");
    return vgi_trials_judge(&f->trials, &x, n, poses, transforms, sums, e);
}
