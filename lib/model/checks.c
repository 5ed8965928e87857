/* checks.c: conditions on the contents of header records beyond what every reader checks (counts agree with the
 * bytes, numbers are finite, texts are UTF-8: io/artefact_io.c). One function per entry of the table (records.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/artefact.h"

#include <math.h>

/* Whether a list of n + 1 starts begins with 0 and never descends. */
static bool are_starts(const uint32_t *start, size_t n)
{
    if (start[0]) return false;
    for (size_t i = 0; i < n; i++)
        if (start[i + 1] < start[i]) return false;
    return true;
}

static bool is_one(double sum)
{
    return sum > 1 - 1e-9 && sum < 1 + 1e-9;
}

int vgi_check_provenance(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_provenance *p = artefact;
    size_t index = (size_t)(p - h->provenance);
    for (size_t i = 0; i < p->nparents; i++)
        if (p->parents[i] >= index) return vgi_wrong(where, "it names a parent that does not come before it", e);
    return VG_OK;
}

int vgi_check_mesh(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_mesh *m = artefact;
    (void)h;
    if (m->nv >= UINT32_MAX) return vgi_wrong(where, "more than 2^32 - 2 vertices", e);
    if (!are_starts(m->start, m->nf)) return vgi_wrong(where, "its faces are not in order", e);
    return vg_mesh_check(m, where, e);
}

int vgi_check_texture(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_attributes *a = artefact;
    size_t corners = vg_mesh_corners(&h->body.mesh);
    if (a->tex_dim < 1 || a->tex_dim > 3) return vgi_wrong(where, "a texture coordinate must have 1 to 3 numbers", e);
    for (size_t i = 0; i < corners; i++)
        if (a->corner_tex[i] >= a->ntex && a->corner_tex[i] != UINT32_MAX)
            return vgi_wrong(where, "a corner names a texture coordinate that does not exist", e);
    return VG_OK;
}

int vgi_check_colours(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_attributes *a = artefact;
    return a->ncolours == h->body.mesh.nv ? VG_OK : vgi_wrong(where, "it must have a colour for each vertex", e);
}

int vgi_check_labels(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_attributes *a = artefact;
    for (size_t i = 0; i < a->nlabels; i++) {
        const vg_label *l = &a->labels[i];
        if (l->face > h->body.mesh.nf || (i && l->face < a->labels[i - 1].face))
            return vgi_wrong(where, "labels are not in the order of their faces", e);
        if (l->kind < VG_LABEL_OBJECT || l->kind > VG_LABEL_LIBRARY)
            return vgi_wrong(where, "a label is of unknown kind", e);
    }
    return VG_OK;
}

/* Its data are not checked; they matter only to writers of such files. */
int vgi_check_asset(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_asset *a = artefact;
    if (a->n == 0 || a->n >= UINT32_MAX || a->size == 0) return vgi_wrong(where, "its counts are out of range", e);
    for (size_t i = 0; i < a->n; i++)
        if (a->vertex[i] >= h->body.mesh.nv) return vgi_wrong(where, "it names a vertex that does not exist", e);
    return VG_OK;
}

int vgi_check_selection(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    (void)artefact;
    return vgi_check_ascending(where, h->selection.faces, h->selection.n, h->body.mesh.nf, e);
}

int vgi_check_anchors(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    (void)artefact;
    return vgi_check_ascending(where, h->anchors, h->nanchors, h->body.mesh.nv, e);
}

int vgi_check_links(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    (void)artefact;
    for (size_t i = 0; i < h->links.n; i++) {
        uint32_t a = h->links.pairs[2 * i], b = h->links.pairs[2 * i + 1];
        if (a >= h->body.mesh.nv || b >= h->body.mesh.nv) return vgi_wrong(where, "an index is out of range", e);
        if (a == b) return vgi_wrong(where, "a link joins a vertex to itself", e);
    }
    return VG_OK;
}

/* ---- skeletons and rigs ---- */

static int check_joints(const vg_skeleton *s, const char *where, vg_err *e)
{
    for (size_t j = 0; j < s->njoints; j++) {
        const vg_joint *joint = &s->joints[j];
        if (joint->parent != UINT32_MAX && joint->parent >= j)
            return vgi_wrong(where, "a joint's parent does not come before it", e);
        if (joint->nchannels > 6) return vgi_wrong(where, "a joint has more than 6 channels", e);
        for (size_t i = 0; i < 6; i++)
            if (i < joint->nchannels ? joint->channels[i] < 1 || joint->channels[i] > 6 : joint->channels[i] != 0)
                return vgi_wrong(where, "a joint has an unknown channel", e);
    }
    return VG_OK;
}

int vgi_check_skeleton(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_skeleton *s = artefact;
    if (s->njoints != h->body.mesh.nv) return vgi_wrong(where, "it does not have one joint for each vertex", e);
    return check_joints(s, where, e);
}

/* List the bones, which follow from the joints. */
static int list_bones(vg_rig *g, vg_err *e)
{
    size_t bones = 0;
    for (size_t j = 0; j < g->skeleton.njoints; j++) bones += g->skeleton.joints[j].nchannels > 0;
    if (!(g->bone = vgi_array_raw(bones, sizeof *g->bone, e))) return VG_ENOMEM;
    for (size_t j = 0; j < g->skeleton.njoints; j++)
        if (g->skeleton.joints[j].nchannels > 0) g->bone[g->nbones++] = (uint32_t)j;
    return VG_OK;
}

int vgi_check_rig(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    vg_rig *g = artefact;
    (void)h;
    if (!g->skeleton.njoints) return vgi_wrong(where, "it has no joints", e);
    int r = check_joints(&g->skeleton, where, e);
    if (r < 0) return r;
    if (!vgi_are_turns(g->turn, g->skeleton.njoints)) return vgi_wrong(where, "a turn is not a unit quaternion", e);
    r = list_bones(g, e);
    return r == VG_OK && !g->nbones ? vgi_wrong(where, "none of its joints rotates", e) : r;
}

int vgi_check_skin(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_rig *g = artefact;
    for (size_t v = 0; v < h->body.mesh.nv; v++) {
        const uint32_t *bone = g->skin_bone + VG_SKIN * v;
        const double *w = g->skin_weight + VG_SKIN * v;
        double sum = 0;
        for (size_t i = 0; i < VG_SKIN; i++) {
            if (bone[i] >= g->nbones) return vgi_wrong(where, "a vertex is moved by a bone that does not exist", e);
            if (!(w[i] >= 0) || (i && w[i] > w[i - 1]))
                return vgi_wrong(where, "weights are negative, or do not descend", e);
            sum += w[i];
        }
        if (!is_one(sum)) return vgi_wrong(where, "the weights of a vertex do not sum to 1", e);
    }
    return VG_OK;
}

/* ---- correspondence, patches ---- */

static const char *refuse_driven(const vg_correspondence *c, size_t f)
{
    double sum = 0;
    if (c->first[f] == c->first[f + 1]) return "a target face has no driver";
    for (uint32_t i = c->first[f]; i < c->first[f + 1]; i++) {
        if (c->source[i] >= c->source_nf) return "a source face is out of range";
        if (!(c->weight[i] > 0)) return "a weight is not positive";
        sum += c->weight[i];
    }
    if (!is_one(sum)) return "the weights of a face do not sum to 1";
    return c->distance[f] < 0 || c->matched[f] > 2 || (c->matched[f] == 2) != (c->matched[0] == 2)
               ? "a distance or mark is out of range"
               : NULL;
}

int vgi_check_correspondence(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_correspondence *c = artefact;
    (void)h;
    if (c->target_nf >= UINT32_MAX || c->first[c->target_nf] == UINT32_MAX)
        return vgi_wrong(where, "its counts are out of range", e);
    if (!are_starts(c->first, c->target_nf)) return vgi_wrong(where, "its lists of pairs are not in order", e);
    for (size_t f = 0; f < c->target_nf; f++) {
        const char *why = refuse_driven(c, f);
        if (why) return vgi_wrong(where, why, e);
    }
    return VG_OK;
}

int vgi_check_patches(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_patches *p = artefact;
    if (p->n == 0 || p->n > UINT32_MAX) return vgi_wrong(where, "its count is out of range", e);
    for (size_t f = 0; f < h->body.mesh.nf; f++)
        if (p->of_face[f] >= p->n) return vgi_wrong(where, "a face is in a patch that does not exist", e);
    return VG_OK;
}

/* ---- map ---- */

static bool is_zero(const double *q, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (q[i] != 0) return false;
    return true;
}

static const char *refuse_counts(const vg_map *m, const vg_head *h)
{
    if (m->n == 0 || m->n >= UINT32_MAX || m->nhinges >= UINT32_MAX || m->ncorners >= UINT32_MAX || m->nheld > m->nv)
        return "its counts are out of range";
    if (m->nv != h->body.mesh.nv) return "its count does not fit the mesh";
    if (m->kind != VG_MAP_PATCHES && m->kind != VG_MAP_BONES) return "its kind of transforms is unknown";
    if (m->nnames && m->nnames != m->n) return "names are missing";
    return m->size > 0 ? NULL : "its size is not positive";
}

/* Counts of a map of bones against those of its rig. */
static const char *refuse_driver(const vg_map *m, const vg_rig *g)
{
    if (m->kind == VG_MAP_PATCHES) return m->per_corner == 1 ? NULL : "a corner must have one patch";
    if (!g->nbones) return "a RIG record must come before it";
    if (m->n != g->nbones) return "its number of bones is not that of the rig";
    if (m->per_corner < 1 || m->per_corner > 2) return "a corner must have 1 or 2 bones";
    return m->nhinges ? "a map of bones has hinges" : NULL;
}

static const char *refuse_parts(const vg_map *m)
{
    double sum = 0;
    for (size_t i = 0; i < m->n; i++) {
        if (!(m->share[i] >= 0)) return "a share is negative";
        sum += m->share[i];
    }
    if (!is_one(sum)) return "the shares do not sum to 1";
    for (size_t i = 0; i < m->nhinges; i++)
        if (m->hinge[2 * i] >= m->n || m->hinge[2 * i + 1] >= m->n || m->hinge[2 * i] == m->hinge[2 * i + 1] ||
            !(m->hinge_weight[i] > 0))
            return "a hinge is malformed";
    return NULL;
}

/* What moves the corners and the held vertices. */
static const char *refuse_driven_parts(const vg_map *m)
{
    bool bones = m->kind == VG_MAP_BONES;
    for (size_t i = 0; i < m->ncorners; i++)
        if (is_zero(m->corner + 4 * m->per_corner * i, 4 * m->per_corner)) return "a quaternion is zero";
    for (size_t i = 0; bones && i < m->per_corner * m->ncorners; i++)
        if (m->corner_bone[i] >= m->n) return "a corner is moved by a bone that does not exist";
    for (size_t i = 0; !bones && i < m->nheld; i++)
        if (m->held_patch[i] >= m->n) return "a vertex is held by a transform that does not exist";
    return NULL;
}

int vgi_check_map(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_map *m = artefact;
    const char *why = refuse_counts(m, h);
    if (!why) why = refuse_driver(m, &h->body.rig);
    if (!why) why = refuse_parts(m);
    if (!why) why = refuse_driven_parts(m);
    return why ? vgi_wrong(where, why, e) : vgi_check_ascending(where, m->held, m->nheld, m->nv, e);
}
