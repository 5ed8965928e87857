/* payload_rig.c: the records of what drives a mesh, both directions side by side: skeletons, rigs, patches, maps
 * (fmt/STREAM.md, sections 3.9, 3.15, 3.16, 3.18). Leaves out all other records (payload.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/cursor.h"
#include "model/map.h"

#include <math.h>
#include <stdlib.h>

/* ---- SKEL ---- */

static int decode_joint(cursor *c, const vgi_payload *p, vg_joint *j, size_t index, vg_err *e)
{
    int r = VG_OK;
    j->parent = take32(c), j->nchannels = take32(c);
    const unsigned char *channels = take(c, 8), *offset = take(c, 24);
    uint32_t n = take32(c);
    if (c->bad) return wrong(p, "it ends inside a joint", e);
    if (j->parent != UINT32_MAX && j->parent >= index) return wrong(p, "a joint's parent does not come before it", e);
    if (j->nchannels > 6) return wrong(p, "a joint has more than 6 channels", e);
    for (uint32_t i = 0; i < 8; i++)
        if (i < j->nchannels ? channels[i] < 1 || channels[i] > 6 : channels[i] != 0)
            return wrong(p, "a joint has an unknown channel", e);
    memcpy(j->channels, channels, sizeof j->channels);
    copy_doubles(j->offset, offset, 3);
    if (!vgi_finite(j->offset, 3)) return wrong(p, "an offset is not finite", e);
    if (!(j->name = take_text(c, n, p, &r, e))) return r;
    return take_padding(c, (4 - n) & 7) ? VG_OK : wrong(p, "padding is missing or not zero", e);
}

/* Joints up to `most` of them or to the end of the payload. */
static int take_joints(cursor *c, const vgi_payload *p, vg_skeleton *s, uint64_t most, vg_err *e)
{
    size_t cap = 0;
    while (s->njoints < most && left(c)) {
        int r = vgi_grow(&s->joints, &cap, s->njoints + 1, sizeof *s->joints, e);
        if (r < 0) return r;
        vg_joint *j = &s->joints[s->njoints++]; /* counted at once, so that clearing frees it in any case */
        *j = (vg_joint){0};
        if ((r = decode_joint(c, p, j, s->njoints - 1, e)) < 0) return r;
    }
    return VG_OK;
}

int vgi_skel_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    int r = take_joints(&c, p, &h->body.skeleton, UINT64_MAX, e);
    if (r < 0) return r;
    return h->body.skeleton.njoints == h->body.mesh.nv ? VG_OK
                                                       : wrong(p, "it does not have one joint for each vertex", e);
}

static int encode_joints(vg_bytes *b, const vg_skeleton *s, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < s->njoints; i++) {
        const vg_joint *j = &s->joints[i];
        unsigned char channels[8] = {0};
        memcpy(channels, j->channels, j->nchannels);
        r = put32(b, j->parent, e);
        if (r == VG_OK) r = put32(b, j->nchannels, e);
        if (r == VG_OK) r = vgi_bytes_append(b, channels, sizeof channels, e);
        if (r == VG_OK) r = put_doubles(b, j->offset, 3, e);
        if (r == VG_OK) r = put_string(b, j->name, e);
        if (r == VG_OK) r = put_padding(b, 0, e);
    }
    return r;
}

int vgi_skel_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    return encode_joints(b, &h->body.skeleton, e);
}

/* ---- RIG ---- */

static int check_skin(const vgi_payload *p, const vg_rig *g, size_t nv, vg_err *e)
{
    for (size_t v = 0; v < nv; v++) {
        const uint32_t *bone = g->skin_bone + VG_SKIN * v;
        const double *w = g->skin_weight + VG_SKIN * v;
        double sum = 0;
        for (size_t i = 0; i < VG_SKIN; i++) {
            if (bone[i] >= g->nbones) return wrong(p, "a vertex is moved by a bone that is not there", e);
            if (!(w[i] >= 0) || (i && w[i] > w[i - 1])) return wrong(p, "weights are negative, or do not descend", e);
            sum += w[i];
        }
        if (!(sum > 1 - 1e-9 && sum < 1 + 1e-9)) return wrong(p, "the weights of a vertex do not sum to 1", e);
    }
    return VG_OK;
}

static int take_skin(cursor *c, const vgi_payload *p, vg_rig *g, size_t nv, vg_err *e)
{
    const unsigned char *bones = take_array(c, nv, 4 * VG_SKIN), *weights = take_array(c, nv, 8 * VG_SKIN);
    if (c->bad) return wrong(p, "its length does not fit the number of vertices", e);
    g->skin_bone = vgi_array_raw(VG_SKIN * nv, sizeof *g->skin_bone, e);
    g->skin_weight = vgi_array_raw(VG_SKIN * nv, sizeof *g->skin_weight, e);
    if (!g->skin_bone || !g->skin_weight) return VG_ENOMEM;
    copy32(g->skin_bone, bones, VG_SKIN * nv);
    copy_doubles(g->skin_weight, weights, VG_SKIN * nv);
    return check_skin(p, g, nv, e);
}

/* A rig without weights: the joints, and how they are in the reference pose. */
static int take_posed(cursor *c, const vgi_payload *p, vg_skeleton *s, vg_rig *g, vg_err *e)
{
    uint64_t n = take64(c);
    int r = c->bad || n == 0 ? wrong(p, "it has no joints", e) : take_joints(c, p, s, n, e);
    if (r < 0) return r;
    const unsigned char *at = take_array(c, n, 24), *turns = take_array(c, n, 32);
    if (c->bad || s->njoints != n) return wrong(p, "it is shorter than its counts say", e);
    double *numbers = vgi_array_raw((size_t)n, 7 * sizeof *numbers, e);
    if (!numbers) return VG_ENOMEM;
    double *unit = numbers + 3 * (size_t)n;
    copy_doubles(numbers, at, 3 * (size_t)n);
    copy_doubles(unit, turns, 4 * (size_t)n);
    if (!vgi_finite(numbers, 3 * (size_t)n)) r = wrong(p, "a position is not finite", e);
    else if (!are_turns(unit, (size_t)n)) r = wrong(p, "a turn is no unit quaternion", e);
    else if (!vg_skeleton_channels(s)) r = wrong(p, "none of its joints turns", e);
    else r = vg_rig_make(g, s, numbers, unit, e);
    free(numbers);
    return r;
}

int vgi_rig_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    vg_skeleton s = {0};
    int r = take_posed(&c, p, &s, &h->body.rig, e);
    vg_skeleton_clear(&s);
    if (r < 0) return r;
    uint32_t skin = take32(&c), zero = take32(&c);
    if (c.bad || skin > 1 || zero) return wrong(p, "it is too short, or reserved bytes are not zero", e);
    if (skin && (r = take_skin(&c, p, &h->body.rig, h->body.mesh.nv, e)) < 0) return r;
    return left(&c) ? wrong(p, "bytes are left over", e) : VG_OK;
}

int vgi_rig_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const vg_rig *g = &h->body.rig;
    size_t n = g->skeleton.njoints, nv = h->body.mesh.nv;
    int r = put64(b, n, e);
    if (r == VG_OK) r = encode_joints(b, &g->skeleton, e);
    if (r == VG_OK) r = put_doubles(b, g->at, 3 * n, e);
    if (r == VG_OK) r = put_doubles(b, g->turn, 4 * n, e);
    if (r == VG_OK) r = put32(b, g->skin_bone != NULL, e);
    if (r == VG_OK) r = put32(b, 0, e);
    if (r < 0 || !g->skin_bone) return r;
    r = vgi_indices_encode(b, g->skin_bone, VG_SKIN * nv, e);
    return r < 0 ? r : put_doubles(b, g->skin_weight, VG_SKIN * nv, e);
}

/* ---- PTCH ---- */

int vgi_ptch_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    uint64_t n = take64(&c);
    size_t nf = h->body.mesh.nf;
    const unsigned char *of_face = take_array(&c, nf, 4);
    if (c.bad || !take_padding(&c, nf % 2 * 4) || left(&c))
        return wrong(p, "its length does not fit the number of faces", e);
    if (n == 0 || n > UINT32_MAX) return wrong(p, "its count is out of range", e);
    h->body.patches.of_face = vgi_array_raw(nf, sizeof *h->body.patches.of_face, e);
    if (!h->body.patches.of_face) return VG_ENOMEM;
    h->body.patches.n = (size_t)n;
    copy32(h->body.patches.of_face, of_face, nf);
    for (size_t f = 0; f < nf; f++)
        if (h->body.patches.of_face[f] >= n) return wrong(p, "a face is in a patch that is not there", e);
    return VG_OK;
}

int vgi_ptch_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    int r = put64(b, h->body.patches.n, e);
    if (r == VG_OK) r = vgi_indices_encode(b, h->body.patches.of_face, h->body.mesh.nf, e);
    return r < 0 ? r : put_padding(b, 0, e);
}

/* ---- MAP ---- */

enum { HAS_HOME = 1u };

static int take_map_names(cursor *c, vg_map *m, size_t n, const vgi_payload *p, vg_err *e)
{
    int r = VG_OK;
    size_t cap = 0;
    while (r == VG_OK && m->nnames < n) {
        if ((r = vgi_grow(&m->names, &cap, m->nnames + 1, sizeof *m->names, e)) < 0) break;
        char *text = take_text(c, take32(c), p, &r, e);
        if (text) m->names[m->nnames++] = text;
    }
    return r;
}

/* The arrays one after the other; each is made only when its bytes are there. */
static int take_map_arrays(cursor *c, vg_map *m, const vgi_payload *p, vg_err *e)
{
    vgi_map_array list[VGI_MAP_ARRAYS];
    size_t n = vgi_map_arrays(m, list);
    for (size_t i = 0; i < n; i++) {
        size_t length = vgi_map_array_length(m, &list[i]), size = list[i].real ? 8 : 4;
        const unsigned char *data = take_array(c, length, size);
        if (c->bad) return wrong(p, "it is shorter than its counts say", e);
        if (!length) continue;
        if (!(*list[i].at = vgi_array_raw(length, size, e))) return VG_ENOMEM;
        if (!list[i].real) {
            copy32(*list[i].at, data, length);
            continue;
        }
        copy_doubles(*list[i].at, data, length);
        if (!vgi_finite(*list[i].at, length)) return wrong(p, "a number is not finite", e);
    }
    return VG_OK;
}

static bool is_zero(const double *q, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (q[i] != 0) return false;
    return true;
}

/* What moves corners and held vertices. */
static int check_driven(const vgi_payload *p, const vg_map *m, vg_err *e)
{
    bool bones = m->kind == VG_MAP_BONES;
    for (size_t i = 0; i < m->ncorners; i++)
        if (is_zero(m->corner + 4 * m->per_corner * i, 4 * m->per_corner)) return wrong(p, "a quaternion is zero", e);
    for (size_t i = 0; bones && i < m->per_corner * m->ncorners; i++)
        if (m->corner_bone[i] >= m->n) return wrong(p, "a corner is moved by a bone that is not there", e);
    for (size_t i = 0; !bones && i < m->nheld; i++)
        if (m->held_patch[i] >= m->n) return wrong(p, "a vertex is held by a transform that is not there", e);
    return check_ascending(p, m->held, m->nheld, m->nv, e);
}

static int check_map(const vgi_payload *p, const vg_map *m, vg_err *e)
{
    double sum = 0;
    for (size_t i = 0; i < m->n; i++) {
        if (!(m->share[i] >= 0)) return wrong(p, "a share is negative", e);
        sum += m->share[i];
    }
    if (!(sum > 1 - 1e-9 && sum < 1 + 1e-9)) return wrong(p, "the shares do not sum to 1", e);
    for (size_t i = 0; i < m->njoints; i++)
        if (m->joint[2 * i] >= m->n || m->joint[2 * i + 1] >= m->n || m->joint[2 * i] == m->joint[2 * i + 1] ||
            !(m->joint_weight[i] > 0))
            return wrong(p, "a joint is malformed", e);
    return check_driven(p, m, e);
}

/* The counts of a map of bones and its rig's. */
static int check_bones(const vgi_payload *p, const vg_map *m, const vg_rig *g, vg_err *e)
{
    if (m->kind == VG_MAP_PATCHES)
        return m->per_corner == 1 ? VG_OK : wrong(p, "a corner has more than one patch", e);
    if (!g->nbones) return wrong(p, "a RIG record must come before it", e);
    if (m->n != g->nbones) return wrong(p, "it has not as many bones as the rig", e);
    if (m->per_corner < 1 || m->per_corner > 2) return wrong(p, "a corner must have 1 or 2 bones", e);
    return m->njoints ? wrong(p, "pairs of patches stand in a map of bones", e) : VG_OK;
}

int vgi_map_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    vg_map *m = &h->map;
    uint64_t n = take64(&c), nv = take64(&c), joints = take64(&c), corners = take64(&c), held = take64(&c);
    uint32_t kind = take32(&c), flags = take32(&c), names = take32(&c), per_corner = take32(&c);
    double size = take_double(&c);
    if (c.bad || n == 0 || n >= UINT32_MAX || joints >= UINT32_MAX || corners >= UINT32_MAX || held > nv)
        return wrong(p, "its counts are out of range", e);
    if (nv != h->body.mesh.nv) return wrong(p, "its count does not fit the mesh", e);
    if (kind != VG_MAP_PATCHES && kind != VG_MAP_BONES) return wrong(p, "it is driven by something unknown", e);
    if ((flags & ~HAS_HOME) || (names && names != n))
        return wrong(p, "unknown flags are set, or names are missing", e);
    if (!vgi_finite(&size, 1) || !(size > 0)) return wrong(p, "its size is not positive", e);
    if (kind == VG_MAP_PATCHES && per_corner == 0) per_corner = 1; /* as it was written before there were bones */
    *m = (vg_map){.n = (size_t)n,
                  .nv = (size_t)nv,
                  .kind = (vg_map_kind)kind,
                  .size = size,
                  .has_home = flags & HAS_HOME,
                  .njoints = (size_t)joints,
                  .ncorners = (size_t)corners,
                  .per_corner = per_corner,
                  .nheld = (size_t)held};
    int r = check_bones(p, m, &h->body.rig, e);
    if (r == VG_OK) r = take_map_arrays(&c, m, p, e);
    if (r == VG_OK) r = check_map(p, m, e);
    if (r == VG_OK) r = take_map_names(&c, m, names, p, e);
    return r < 0 ? r : left(&c) ? wrong(p, "bytes are left over", e) : VG_OK;
}

int vgi_map_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const vg_map *m = &h->map;
    const uint64_t counts[5] = {m->n, m->nv, m->njoints, m->ncorners, m->nheld};
    const uint32_t words[4] = {m->kind, m->has_home ? HAS_HOME : 0, (uint32_t)m->nnames, (uint32_t)m->per_corner};
    vg_map copy = *m; /* the list of arrays does not promise not to change them */
    vgi_map_array list[VGI_MAP_ARRAYS];
    size_t n = vgi_map_arrays(&copy, list);
    int r = VG_OK;
    for (int i = 0; r == VG_OK && i < 5; i++) r = put64(b, counts[i], e);
    if (r == VG_OK) r = vgi_indices_encode(b, words, 4, e);
    if (r == VG_OK) r = put_doubles(b, &m->size, 1, e);
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        size_t length = vgi_map_array_length(m, &list[i]);
        r = list[i].real ? put_doubles(b, *list[i].at, length, e) : vgi_indices_encode(b, *list[i].at, length, e);
    }
    for (size_t i = 0; r == VG_OK && i < m->nnames; i++) r = put_string(b, m->names[i], e);
    return r;
}

