/* pair.c: chooses the source faces that drive each target face, once the source is fitted to the target (MATH 9).
 *
 * If a source face with a matching normal lies under the centroid of a target face, that face and nearby source faces
 * drive it. Their weights decrease with the distance of the centroids, over a radius equal to the larger of the two
 * face sizes: a fine source is averaged, a coarse one interpolated. Neighbours are found over the surface, so that
 * fingers do not mix. Source faces without a target are assigned to the target face they lie on. A target face
 * without a source follows matched faces: in a hole the nearest across edges; in a component without matches the
 * nearest in space, the same for the whole component so that it stays rigid. The fit is in fit.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/register.h"
#include "numeric/vec3.h"
#include "model/incidence.h"
#include "numeric/kdtree.h"

#include <stdlib.h>

enum {
    BLOCK = 128,  /* faces per task */
    MOST = 24,    /* most source faces per target face, without those assigned to it later */
    AROUND = 512, /* most source faces examined per target face */
    HOSTS = 4     /* matched faces that a component without a counterpart follows */
};
static const double COINCIDENT = 1e-6; /* in D */
static const double COSINE = 0.5;      /* least cosine of the angle between normals that match */
static const double FAR = 0.03;        /* in D: largest distance of a match */
static const double REACH = 1.2;       /* radius of the kernel, in face sizes */

struct candidate {
    uint32_t face;
    double weight;
};

/* The source faces of one target face. */
struct drivers {
    uint32_t n;
    struct candidate at[MOST];
};

struct pairing {
    const vgi_pairing *in;
    vg_correspondence *c;
    vgi_incidence source_around, target_around;
    struct drivers *drivers;           /* per target face */
    uint32_t *given;                   /* per source face: the target face that it is assigned to, or UINT32_MAX */
    bool *used;                        /* per source face */
    uint32_t *host;                    /* per target face: the matched face that it follows */
};

static const double *centroid(const vgi_surface *s, size_t f)
{
    return vgi_surface_centroids(s) + 3 * f;
}

/* A face without a normal matches every normal. */
static bool normals_agree(const struct pairing *p, size_t target, size_t source)
{
    const double *a = vgi_surface_normals(p->in->target_surface) + 3 * target;
    const double *b = vgi_surface_normals(p->in->source_surface) + 3 * source;
    double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if (p->in->flipped) cosine = -cosine;
    bool none = (a[0] == 0 && a[1] == 0 && a[2] == 0) || (b[0] == 0 && b[1] == 0 && b[2] == 0);
    return none || cosine >= COSINE;
}

static size_t face_size(const vg_mesh *m, size_t f)
{
    return m->start[f + 1] - m->start[f];
}

static bool coincide(const struct pairing *p, size_t target, size_t source)
{
    return face_size(p->in->target, target) == face_size(p->in->source, source) &&
           vgi_square(centroid(p->in->target_surface, target), centroid(p->in->source_surface, source)) <
               COINCIDENT * COINCIDENT;
}

/* ---- from target to source ---- */

/* The faces connected to a start face by shared vertices whose centroids lie within a radius of a point. */
struct walk {
    uint32_t face[AROUND];
    size_t n;
    uint32_t seen[2 * AROUND]; /* open addressing: face + 1 */
};

static bool visit(struct walk *w, uint32_t face)
{
    size_t i = face * 2654435761u % (2 * AROUND);
    for (; w->seen[i]; i = (i + 1) % (2 * AROUND))
        if (w->seen[i] == face + 1) return false;
    if (w->n == AROUND) return false;
    w->seen[i] = face + 1;
    w->face[w->n++] = face;
    return true;
}

static void walk_around(struct walk *w, const struct pairing *p, uint32_t first, const double at[3], double radius)
{
    const vg_mesh *m = p->in->source;
    w->n = 0;
    memset(w->seen, 0, sizeof w->seen);
    visit(w, first);
    for (size_t i = 0; i < w->n && w->n < AROUND; i++) {
        uint32_t f = w->face[i];
        if (f != first && vgi_square(centroid(p->in->source_surface, f), at) >= radius * radius) continue;
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            uint32_t v = m->vert[c];
            for (uint32_t k = p->source_around.first[v]; k < p->source_around.first[v + 1] && w->n < AROUND; k++)
                visit(w, p->source_around.face[k]);
        }
    }
}

static int by_weight(const void *a, const void *b)
{
    const struct candidate *x = a, *y = b;
    if (x->weight != y->weight) return x->weight > y->weight ? -1 : 1;
    return x->face < y->face ? -1 : x->face > y->face;
}

static double kernel(double square, double radius)
{
    double x = 1 - square / (radius * radius);
    return x > 0 ? x * x : 0;
}

static void find_drivers(const struct pairing *p, size_t g, uint32_t first, struct drivers *out)
{
    const double *at = centroid(p->in->target_surface, g);
    double a = vgi_surface_sizes(p->in->source_surface)[first], b = vgi_surface_sizes(p->in->target_surface)[g];
    double radius = REACH * (a > b ? a : b), own = sqrt(vgi_square(centroid(p->in->source_surface, first), at));
    if (1.2 * own > radius) radius = 1.2 * own;
    struct walk w;
    struct candidate found[AROUND];
    size_t n = 0;
    if (radius > 0) walk_around(&w, p, first, at, radius);
    else w.n = 0;
    for (size_t i = 0; i < w.n; i++) {
        double weight = kernel(vgi_square(centroid(p->in->source_surface, w.face[i]), at), radius);
        if (weight > 1e-3 && (w.face[i] == first || normals_agree(p, g, w.face[i])))
            found[n++] = (struct candidate){w.face[i], weight};
    }
    if (n == 0) found[n++] = (struct candidate){first, 1};
    qsort(found, n, sizeof *found, by_weight);
    out->n = (uint32_t)(n < MOST ? n : MOST);
    memcpy(out->at, found, out->n * sizeof *found);
}

static bool nearest_source(const struct pairing *p, size_t g, vgi_hit *hit)
{
    const double *n = vgi_surface_normals(p->in->target_surface) + 3 * g;
    double sign = p->in->flipped ? -1 : 1, normal[3] = {sign * n[0], sign * n[1], sign * n[2]};
    double limit = face_size(p->in->target, g) == 2 ? INFINITY : FAR * FAR;
    if (!vgi_surface_nearest(p->in->source_surface, centroid(p->in->target_surface, g), normal, COSINE, limit, hit))
        return false;
    double size = vgi_surface_sizes(p->in->target_surface)[g];
    return !hit->border || hit->square <= size * size;
}

static void match_block(void *context, size_t block)
{
    struct pairing *p = context;
    size_t nf = p->in->target->nf, end = (block + 1) * BLOCK < nf ? (block + 1) * BLOCK : nf;
    for (size_t g = block * BLOCK; g < end; g++) {
        struct drivers *d = &p->drivers[g];
        vgi_hit hit;
        d->n = 0;
        if (g < p->in->source->nf && coincide(p, g, g)) { /* the same mesh, in which faces may coincide */
            *d = (struct drivers){1, {{(uint32_t)g, 1}}};
        } else if (nearest_source(p, g, &hit)) {
            /* bones have one driver: mixing would bend limbs between joints */
            bool alone = face_size(p->in->target, g) == 2 || coincide(p, g, hit.face);
            if (alone) *d = (struct drivers){1, {{hit.face, 1}}};
            else find_drivers(p, g, hit.face, d);
        }
    }
}

/* ---- from source to target ---- */

static void give_block(void *context, size_t block)
{
    struct pairing *p = context;
    size_t nf = p->in->source->nf, end = (block + 1) * BLOCK < nf ? (block + 1) * BLOCK : nf;
    for (size_t f = block * BLOCK; f < end; f++) {
        const double *n = vgi_surface_normals(p->in->source_surface) + 3 * f;
        double sign = p->in->flipped ? -1 : 1, normal[3] = {sign * n[0], sign * n[1], sign * n[2]};
        vgi_hit hit;
        p->given[f] = UINT32_MAX;
        if (p->used[f] || (p->in->take && !p->in->take[f])) continue;
        if (vgi_surface_nearest(p->in->target_surface, centroid(p->in->source_surface, f), normal, COSINE, FAR * FAR,
                                &hit) &&
            !hit.border && p->drivers[hit.face].n > 0)
            p->given[f] = hit.face;
    }
}

/* A source face without a target joins the drivers of its target face, weighted by its distance, but at most as much
 * as the smallest weight there. */
static double given_weight(const struct pairing *p, size_t f)
{
    const struct drivers *d = &p->drivers[p->given[f]];
    if (face_size(p->in->target, p->given[f]) == 2 || (d->n == 1 && coincide(p, p->given[f], d->at[0].face)))
        return 0;
    return d->at[d->n - 1].weight;
}

/* target faces without a match */

/* A target component with matches for less than half of its faces has no counterpart; the matches belong to other
 * components. */
static int drop_strangers(struct pairing *p, vg_err *e)
{
    const vg_mesh *m = p->in->target;
    size_t n = 0;
    uint32_t *label = vgi_array(m->nv, sizeof *label, e);
    size_t *faces = NULL, *found = NULL;
    int r = label ? vg_mesh_components(m, label, &n, e) : VG_ENOMEM;
    if (r == VG_OK) faces = vgi_array(n, sizeof *faces, e), found = vgi_array(n, sizeof *found, e);
    if (r == VG_OK && (!faces || !found)) r = VG_ENOMEM;
    for (size_t g = 0; g < m->nf && r == VG_OK; g++) {
        uint32_t k = label[m->vert[m->start[g]]];
        faces[k]++, found[k] += p->drivers[g].n > 0;
    }
    for (size_t g = 0; g < m->nf && r == VG_OK; g++) {
        uint32_t k = label[m->vert[m->start[g]]];
        if (2 * found[k] < faces[k]) p->drivers[g].n = 0;
    }
    free(label);
    free(faces);
    free(found);
    return r;
}

/* Breadth first from the matched faces: each other face takes the host of the face from which it was reached. */
static void fill_holes(struct pairing *p, uint32_t *queue)
{
    const vg_mesh *m = p->in->target;
    size_t tail = 0;
    for (size_t g = 0; g < m->nf; g++) {
        p->host[g] = p->drivers[g].n ? (uint32_t)g : UINT32_MAX;
        if (p->drivers[g].n) queue[tail++] = (uint32_t)g;
    }
    for (size_t head = 0; head < tail; head++) {
        uint32_t g = queue[head];
        for (uint32_t c = m->start[g]; c < m->start[g + 1]; c++) {
            uint32_t v = m->vert[c];
            for (uint32_t k = p->target_around.first[v]; k < p->target_around.first[v + 1]; k++) {
                uint32_t f = p->target_around.face[k];
                if (p->host[f] != UINT32_MAX) continue;
                p->host[f] = p->host[g];
                queue[tail++] = f;
            }
        }
    }
}

/* Add the drivers of the host, scaled by a share, to d; equal sources are merged. */
static void borrow_drivers(struct drivers *d, const struct drivers *host)
{
    double sum = 0;
    for (uint32_t i = 0; i < host->n; i++) sum += host->at[i].weight;
    for (uint32_t i = 0; i < host->n; i++) {
        uint32_t k = 0;
        while (k < d->n && d->at[k].face != host->at[i].face) k++;
        if (k == d->n && d->n < MOST) d->at[d->n++] = (struct candidate){host->at[i].face, 0};
        if (k < d->n) d->at[k].weight += host->at[i].weight / sum;
    }
}

/* The hosts of a component: the matched faces nearest to the mean of its centroids. */
static void find_hosts(const struct pairing *p, const vgi_kdtree *tree, const uint32_t *matched, const double at[3],
                       struct drivers *out)
{
    vgi_near near[HOSTS];
    size_t hosts = vgi_kdtree_nearest(tree, at, INFINITY, HOSTS, near);
    struct drivers d = {.n = 0};
    for (size_t i = 0; i < hosts; i++) borrow_drivers(&d, &p->drivers[matched[near[i].index]]);
    qsort(d.at, d.n, sizeof *d.at, by_weight);
    *out = d;
}

/* The mean centroid of the faces of each component of the target. */
static void piece_centres(const struct pairing *p, const uint32_t *label, double *centre, size_t *faces,
                          size_t pieces)
{
    const vg_mesh *m = p->in->target;
    for (size_t g = 0; g < m->nf; g++) {
        size_t k = label[m->vert[m->start[g]]];
        for (size_t l = 0; l < 3; l++) centre[3 * k + l] += centroid(p->in->target_surface, g)[l];
        faces[k]++;
    }
    for (size_t k = 0; k < pieces; k++)
        vgi_divide(centre + 3 * k, (double)faces[k]);
}

/* The matched faces and a tree of their centroids. */
static int matched_tree(const struct pairing *p, vgi_kdtree **tree, uint32_t *matched, vg_err *e)
{
    size_t nf = p->in->target->nf, n = 0;
    double *at = vgi_array_raw(nf, 3 * sizeof *at, e);
    if (!at) return VG_ENOMEM;
    for (size_t g = 0; g < nf; g++) {
        if (p->host[g] != g) continue;
        memcpy(at + 3 * n, centroid(p->in->target_surface, g), 3 * sizeof *at);
        matched[n++] = (uint32_t)g;
    }
    int r = vgi_kdtree_new(tree, at, n, e);
    free(at);
    return r;
}

static int seat_pieces(struct pairing *p, vg_err *e)
{
    const vg_mesh *m = p->in->target;
    uint32_t *label = vgi_array(m->nv, sizeof *label, e), *matched = vgi_array_raw(m->nf, sizeof *matched, e);
    uint32_t *first = NULL; /* per component: its first face; UINT32_MAX before it was visited */
    double *centre = NULL;
    size_t *faces = NULL, pieces = 0;
    vgi_kdtree *tree = NULL;
    int r = label && matched ? vg_mesh_components(m, label, &pieces, e) : VG_ENOMEM;
    if (r == VG_OK) {
        first = vgi_array_raw(pieces, sizeof *first, e);
        centre = vgi_array(pieces, 3 * sizeof *centre, e);
        faces = vgi_array(pieces, sizeof *faces, e);
        r = first && centre && faces ? matched_tree(p, &tree, matched, e) : VG_ENOMEM;
    }
    if (r == VG_OK) {
        memset(first, 0xff, pieces * sizeof *first);
        piece_centres(p, label, centre, faces, pieces);
    }
    for (size_t g = 0; g < m->nf && r == VG_OK; g++) {
        if (p->host[g] != UINT32_MAX) continue;
        size_t k = label[m->vert[m->start[g]]];
        if (first[k] != UINT32_MAX) {
            p->drivers[g] = p->drivers[first[k]];
            continue;
        }
        find_hosts(p, tree, matched, centre + 3 * k, &p->drivers[g]);
        first[k] = (uint32_t)g;
    }
    vgi_kdtree_free(&tree);
    free(label);
    free(matched);
    free(first);
    free(centre);
    free(faces);
    return r;
}

/* totals */

static void count_pairs(struct pairing *p)
{
    vg_correspondence *c = p->c;
    for (size_t g = 0; g < c->target_nf; g++) {
        uint32_t h = p->host[g] == UINT32_MAX ? (uint32_t)g : p->host[g];
        if (h != g) p->drivers[g] = p->drivers[h];
        c->first[g + 1] = p->drivers[g].n;
    }
    for (size_t f = 0; f < c->source_nf; f++) {
        if (p->given[f] == UINT32_MAX) continue;
        if (p->host[p->given[f]] == p->given[f] && given_weight(p, f) > 0) c->first[p->given[f] + 1]++;
        else p->given[f] = UINT32_MAX;
    }
}

static int write_down(struct pairing *p, vg_err *e)
{
    vg_correspondence *c = p->c;
    count_pairs(p);
    uint64_t sum = 0;
    for (size_t g = 0; g < c->target_nf; g++) sum += c->first[g + 1];
    if (sum >= UINT32_MAX) return vg_fail(e, VG_EINPUT, "too many pairs of faces (the limit is 2^32 - 2)");
    for (size_t g = 0; g < c->target_nf; g++) c->first[g + 1] += c->first[g];
    c->source = vgi_array_raw(sum, sizeof *c->source, e);
    c->weight = vgi_array_raw(sum, sizeof *c->weight, e);
    uint32_t *at = vgi_copy_array(c->first, c->target_nf + 1, sizeof *at, e);
    if (!c->source || !c->weight || !at) return free(at), VG_ENOMEM;
    for (size_t g = 0; g < c->target_nf; g++) {
        const struct drivers *d = &p->drivers[g];
        c->matched[g] = p->host[g] == g;
        c->distance[g] =
            sqrt(vgi_square(centroid(p->in->target_surface, g), centroid(p->in->source_surface, d->at[0].face)));
        for (uint32_t i = 0; i < d->n; i++) c->source[at[g]] = d->at[i].face, c->weight[at[g]++] = d->at[i].weight;
    }
    for (size_t f = 0; f < c->source_nf; f++) {
        uint32_t g = p->given[f];
        if (g != UINT32_MAX) c->source[at[g]] = (uint32_t)f, c->weight[at[g]++] = given_weight(p, f);
    }
    for (size_t g = 0; g < c->target_nf; g++) {
        double total = 0;
        for (uint32_t i = c->first[g]; i < c->first[g + 1]; i++) total += c->weight[i];
        for (uint32_t i = c->first[g]; i < c->first[g + 1]; i++) c->weight[i] /= total;
    }
    free(at);
    return VG_OK;
}

static int match(struct pairing *p, vg_err *e)
{
    size_t nf = p->in->target->nf, matched = 0;
    uint32_t *queue = vgi_array_raw(nf, sizeof *queue, e);
    if (!queue) return VG_ENOMEM;
    vgi_parallel(p->in->threads, (nf + BLOCK - 1) / BLOCK, match_block, p);
    int r = drop_strangers(p, e);
    for (size_t g = 0; g < nf; g++) {
        matched += p->drivers[g].n > 0;
        for (uint32_t i = 0; i < p->drivers[g].n; i++) p->used[p->drivers[g].at[i].face] = true;
    }
    if (r == VG_OK && matched == 0)
        r = vg_fail(e, VG_EINPUT, "no face of the target is near a source face with a similar normal");
    if (r == VG_OK) {
        vgi_parallel(p->in->threads, (p->in->source->nf + BLOCK - 1) / BLOCK, give_block, p);
        fill_holes(p, queue);
        r = seat_pieces(p, e);
    }
    free(queue);
    return r;
}

int vgi_pair(const vgi_pairing *in, vg_correspondence *c, vg_err *e)
{
    const vg_mesh *s = in->source, *t = in->target;
    struct pairing p = {.in = in, .c = c};
    *c = (vg_correspondence){.source_nv = s->nv, .source_nf = s->nf, .target_nv = t->nv, .target_nf = t->nf,
                             .source_digest = vg_mesh_digest(s), .target_digest = vg_mesh_digest(t)};
    c->first = vgi_array(t->nf + 1, sizeof *c->first, e);
    c->distance = vgi_array(t->nf, sizeof *c->distance, e);
    c->matched = vgi_array(t->nf, sizeof *c->matched, e);
    p.drivers = vgi_array_raw(t->nf, sizeof *p.drivers, e);
    p.host = vgi_array_raw(t->nf, sizeof *p.host, e);
    p.given = vgi_array_raw(s->nf, sizeof *p.given, e);
    p.used = vgi_array(s->nf, sizeof *p.used, e);
    bool room = c->first && c->distance && c->matched && p.drivers && p.host && p.given && p.used;
    int r = room ? vgi_incidence_make(&p.source_around, s, e) : VG_ENOMEM;
    if (r == VG_OK) r = vgi_incidence_make(&p.target_around, t, e);
    if (r == VG_OK) r = match(&p, e);
    if (r == VG_OK) r = write_down(&p, e);
    vgi_incidence_clear(&p.source_around);
    vgi_incidence_clear(&p.target_around);
    free(p.drivers);
    free(p.host);
    free(p.given);
    free(p.used);
    if (r < 0) vg_correspondence_clear(c);
    return r;
}
