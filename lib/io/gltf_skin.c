/* gltf_skin.c: bone transforms of a rig as a glTF skin: nodes for the joints, weights, and an animation. The rest of
 * the file is in gltf_write.c.
 *
 * At rest a node is a pure translation to its joint in the rig. If the transform T of a bone moves a joint, the
 * global transform of its node is T after that translation; the file stores it relative to the parent. All are
 * similarities, so nothing is lost. A frame is stored as a quaternion x y z w, a translation and a scale for each
 * joint, all binary32.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_write.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { TURN = 0, PLACE = 4, SIZE = 7, LOCAL = 8, NOTHING = UINT32_MAX };

/* A joint that moves by less than this fraction of the skeleton's size does not move, and a scale this close to 1 is
 * 1: the precision of binary32 transforms. */
static const double still = 1e-6;

/* Frames arrive one after another and channels are written one after another: this many bytes are transposed at a time.
 */
static const size_t sorting_bytes = (size_t)16 << 20;

/* A property of a joint that an animation has in each frame: `width` numbers; scales are uniform. */
typedef struct channel {
    size_t joint, from, width;
    const char *path;
} channel;

typedef struct skinning {
    uint32_t *child,
        *next;        /* per joint its first child, and its parent's next child; child[njoints]: the first root */
    uint32_t *bone;   /* the transform that moves each joint; NOTHING: none */
    double *rest;     /* a point per joint, relative to the parent's, such that their binary32 sums are the joints of
                         the rig */
    double *at;       /* the sums */
    double *now;      /* 8 each: quaternion w x y z, position, scale: in the world */
    float *local;     /* LOCAL each, relative to the parent */
    float *before;    /* the quaternions of the previous frame */
    double size;
    bool *moves, *grows;
    unsigned char *packed;
    size_t joint_bytes;   /* size of a number in JOINTS_0 */
    channel *channels;
    size_t nchannels;
    size_t points, normals, joints, weights, inverse, outputs; /* numbers of accessors; outputs: of the first
                                                                  channel */
} skinning;

static size_t joints_of(const vgi_gltf_writing *w)
{
    return w->h->body.rig.skeleton.njoints;
}

static uint32_t parent_of(const vgi_gltf_writing *w, size_t j)
{
    return w->h->body.rig.skeleton.joints[j].parent;
}

/* ---- the rig at rest ---- */

/* A joint without channels moves with its parent. */
static void find_bones(const vgi_gltf_writing *w, uint32_t *bone)
{
    const vg_rig *r = &w->h->body.rig;
    for (size_t j = 0; j < r->skeleton.njoints; j++) bone[j] = NOTHING;
    for (size_t b = 0; b < r->nbones; b++) bone[r->bone[b]] = (uint32_t)b;
    for (size_t j = 0; j < r->skeleton.njoints; j++)
        if (bone[j] == NOTHING && parent_of(w, j) != NOTHING) bone[j] = bone[parent_of(w, j)];
}

static void find_children(const vgi_gltf_writing *w, skinning *x)
{
    const size_t n = joints_of(w);
    for (size_t j = 0; j <= n; j++) x->child[j] = NOTHING;
    for (size_t j = n; j-- > 0;) {
        uint32_t *first = &x->child[parent_of(w, j) == NOTHING ? n : parent_of(w, j)];
        x->next[j] = *first;
        *first = (uint32_t)j;
    }
}

static int place_rest(const vgi_gltf_writing *w, skinning *x, vg_err *e)
{
    const size_t n = joints_of(w);
    for (size_t i = 0; i < 3 * n; i++) {
        x->at[i] = (float)w->h->body.rig.at[i];
        if (!isfinite(x->at[i])) return vg_fail(e, VG_EINPUT, "the position of a joint is too large for binary32");
    }
    for (size_t i = 0; i < 3 * n; i++) {
        uint32_t parent = parent_of(w, i / 3);
        x->rest[i] = x->at[i] - (parent == NOTHING ? 0 : x->at[3 * (size_t)parent + i % 3]);
    }
    x->size = fmax(vg_diagonal(x->at, n), vg_diagonal(w->h->body.reference, w->h->body.mesh.nv));
    return VG_OK;
}

static int check_weights(const vgi_gltf_writing *w, vg_err *e)
{
    for (size_t v = 0; v < w->h->body.mesh.nv; v++)
        if (!(w->h->body.rig.skin_weight[VG_SKIN * v] > 0))
            return vg_fail(e, VG_EINPUT, "vertex %zu has no bone", v);
    return VG_OK;
}

static int begin_skin(vgi_gltf_writing *w, const vg_sink_options *o, vg_err *e)
{
    const size_t n = joints_of(w);
    if (o->most_targets || o->morph_tolerance > 0 || o->shapes || o->quantize)
        return vg_fail(e, VG_EARG, "transforms become a skin, without morph targets: leave out %s",
                       o->most_targets ? "--max-targets" : o->shapes ? "--shapes" : o->quantize ? "--quantize" : "--morph-tolerance");
    skinning *x = w->own = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->bone = vgi_array(n, sizeof *x->bone, e), x->channels = vgi_array(n, 3 * sizeof *x->channels, e);
    x->child = vgi_array(n + 1, sizeof *x->child, e), x->next = vgi_array(n, sizeof *x->next, e);
    x->rest = vgi_array(n, 3 * sizeof *x->rest, e), x->at = vgi_array(n, 3 * sizeof *x->at, e);
    x->now = vgi_array(n, LOCAL * sizeof *x->now, e), x->local = vgi_array(n, LOCAL * sizeof *x->local, e);
    x->before = vgi_array(n, 4 * sizeof *x->before, e);
    x->moves = vgi_array(n, sizeof *x->moves, e), x->grows = vgi_array(n, sizeof *x->grows, e);
    x->packed = vgi_array(n, LOCAL * VGI_GLTF_ITEM, e);
    if (!x->bone || !x->channels || !x->child || !x->next || !x->rest || !x->at || !x->now || !x->local ||
        !x->before || !x->moves || !x->grows || !x->packed)
        return VG_ENOMEM;
    x->joint_bytes = w->h->body.rig.nbones <= 256 ? 1 : 2;
    if (w->h->body.rig.nbones > 65536) return vg_fail(e, VG_EINPUT, "a skin of glTF has at most 65536 bones");
    find_bones(w, x->bone);
    find_children(w, x);
    int r = place_rest(w, x, e);
    return r < 0 ? r : check_weights(w, e);
}

/* ---- a frame ---- */

/* Transform of the joint in the world: a unit quaternion, a position, a scale. */
static int place_joint(const skinning *x, size_t j, const double *transforms, vg_err *e)
{
    double *now = x->now + LOCAL * j;
    if (x->bone[j] == NOTHING) {
        memcpy(now, (const double[]){1, 0, 0, 0}, 4 * sizeof *now);
        memcpy(now + PLACE, x->at + 3 * j, 3 * sizeof *now);
        now[SIZE] = 1;
        return VG_OK;
    }
    const double *t = transforms + 7 * (size_t)x->bone[j];
    now[SIZE] = t[0] * t[0] + t[1] * t[1] + t[2] * t[2] + t[3] * t[3];
    if (!(now[SIZE] > 0)) return vg_fail(e, VG_EINPUT, "the transform of bone %u shrinks it to a point", x->bone[j]);
    for (int k = 0; k < 4; k++) now[k] = t[k] / sqrt(now[SIZE]);
    vg_quat_apply(t, x->at + 3 * j, now + PLACE);
    vgi_add(now + PLACE, t + 4);
    return VG_OK;
}

/* The same relative to its parent. */
static void place_locally(const skinning *x, size_t j, uint32_t parent, float local[LOCAL])
{
    static const double world[LOCAL] = {1, 0, 0, 0, 0, 0, 0, 1};
    const double *now = x->now + LOCAL * j, *p = parent == NOTHING ? world : x->now + LOCAL * (size_t)parent;
    const double back[4] = {p[0], -p[1], -p[2], -p[3]};
    double apart[3], turn[4], place[3];
    for (int k = 0; k < 3; k++) apart[k] = (now[PLACE + k] - p[PLACE + k]) / p[SIZE];
    vg_quat_multiply(back, now, turn);
    vg_quat_apply(back, apart, place);
    for (int k = 0; k < 4; k++) local[TURN + k] = (float)turn[(k + 1) % 4];
    for (int k = 0; k < 3; k++) local[PLACE + k] = (float)place[k];
    local[SIZE] = (float)(now[SIZE] / p[SIZE]);
}

/* Choose the sign of a quaternion that is nearer to the previous frame's. */
static void go_on(float now[4], float before[4])
{
    float cosine = now[0] * before[0] + now[1] * before[1] + now[2] * before[2] + now[3] * before[3];
    for (int k = 0; k < 4; k++) before[k] = now[k] = cosine < 0 ? -now[k] : now[k];
}

static void note_motion(skinning *x, size_t j, const float local[LOCAL])
{
    for (int k = 0; k < 3; k++) x->moves[j] |= fabs(local[PLACE + k] - x->rest[3 * j + (size_t)k]) > still * x->size;
    x->grows[j] |= fabs(local[SIZE] - 1.0) > still;
}

static int put_skin_frame(vgi_gltf_writing *w, const vg_frame *f, vg_err *e)
{
    skinning *x = w->own;
    const size_t n = joints_of(w);
    for (size_t j = 0; j < n; j++) {
        float *local = x->local + LOCAL * j;
        int r = place_joint(x, j, f->values, e);
        if (r < 0) return r;
        place_locally(x, j, parent_of(w, j), local);
        go_on(local, x->before + 4 * j);
        note_motion(x, j, local);
        for (size_t k = 0; k < LOCAL; k++) {
            if (!isfinite(local[k])) return vg_fail(e, VG_EINPUT, "a transform is too large for binary32");
            vgi_gltf_put_single(x->packed + VGI_GLTF_ITEM * (LOCAL * j + k), local[k]);
        }
    }
    return vgi_output_put(&w->spool, x->packed, VGI_GLTF_ITEM * LOCAL * n, e);
}

/* ---- JSON ---- */

static int describe_points(vgi_gltf_writing *w, vg_err *e)
{
    skinning *x = w->own;
    const size_t nv = w->seams.n;
    double bounds[6];
    char stride[48];
    snprintf(stride, sizeof stride, ",\"target\":34962,\"byteStride\":%zu", VG_SKIN * x->joint_bytes);
    vgi_gltf_bounds(w->base, nv, bounds);
    x->points = w->naccessors;
    int r = vgi_gltf_view(w, VGI_GLTF_POINT * nv, ",\"target\":34962,\"byteStride\":12", e);
    if (r == VG_OK) r = vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, nv, "VEC3", bounds, 3, e);
    x->normals = w->naccessors;
    if (r == VG_OK && w->normals.n) r = vgi_gltf_view(w, VGI_GLTF_POINT * nv, ",\"target\":34962,\"byteStride\":12", e);
    if (r == VG_OK && w->normals.n) r = vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, nv, "VEC3", NULL, 0, e);
    x->joints = w->naccessors;
    if (r == VG_OK) r = vgi_gltf_view(w, VG_SKIN * x->joint_bytes * nv, stride, e);
    if (r == VG_OK)
        r = vgi_gltf_say_accessor(w, 0, x->joint_bytes == 1 ? VGI_GLTF_UBYTE : VGI_GLTF_USHORT, nv, "VEC4", NULL, 0,
                                  e);
    x->weights = w->naccessors;
    if (r == VG_OK)
        r = vgi_gltf_view(w, VG_SKIN * VGI_GLTF_ITEM * nv, ",\"target\":34962,\"byteStride\":16", e);
    return r < 0 ? r : vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, nv, "VEC4", NULL, 0, e);
}

static int describe_inverse(vgi_gltf_writing *w, vg_err *e)
{
    skinning *x = w->own;
    x->inverse = w->naccessors;
    int r = vgi_gltf_view(w, 16 * VGI_GLTF_ITEM * w->h->body.rig.nbones, "", e);
    return r < 0 ? r : vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, w->h->body.rig.nbones, "MAT4", NULL, 0, e);
}

static void choose_channels(const vgi_gltf_writing *w, skinning *x)
{
    for (size_t j = 0; j < joints_of(w); j++) {
        if (w->h->body.rig.skeleton.joints[j].nchannels > 0)
            x->channels[x->nchannels++] = (channel){j, TURN, 4, "rotation"};
        if (x->moves[j]) x->channels[x->nchannels++] = (channel){j, PLACE, 3, "translation"};
        if (x->grows[j]) x->channels[x->nchannels++] = (channel){j, SIZE, 3, "scale"};
    }
}

static int describe_channels(vgi_gltf_writing *w, vg_err *e)
{
    skinning *x = w->own;
    int r = VG_OK;
    choose_channels(w, x);
    x->outputs = w->naccessors;
    for (size_t i = 0; i < x->nchannels && r == VG_OK; i++) {
        const channel *c = &x->channels[i];
        r = vgi_gltf_view(w, w->frames * c->width * VGI_GLTF_ITEM, "", e);
        if (r == VG_OK)
            r = vgi_gltf_say_accessor(w, 0, VGI_GLTF_FLOAT, w->frames, c->width == 4 ? "VEC4" : "VEC3", NULL, 0, e);
    }
    return r;
}

/* Node 0 is the mesh, node j + 1 joint j; with several roots, the last node is their parent. */
static int say_children(vgi_gltf_writing *w, uint32_t first, vg_err *e)
{
    const skinning *x = w->own;
    int r = first == NOTHING ? VG_OK : vgi_gltf_say(&w->json, e, ",\"children\":[");
    for (uint32_t c = first; c != NOTHING && r == VG_OK; c = x->next[c])
        r = vgi_gltf_say(&w->json, e, "%s%zu", c == first ? "" : ",", (size_t)c + 1);
    return r < 0 || first == NOTHING ? r : vgi_gltf_say(&w->json, e, "]");
}

static int say_joint(vgi_gltf_writing *w, size_t j, vg_err *e)
{
    const skinning *x = w->own;
    int r = vgi_gltf_say(&w->json, e, ",\n{\"name\":");
    if (r == VG_OK) r = vgi_gltf_say_text(&w->json, w->h->body.rig.skeleton.joints[j].name, e);
    if (r == VG_OK) r = vgi_gltf_say_numbers(&w->json, ",\"translation\":[", x->rest + 3 * j, 3, "]", e);
    if (r == VG_OK) r = say_children(w, x->child[j], e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}");
}

static int say_nodes(vgi_gltf_writing *w, vg_err *e)
{
    const skinning *x = w->own;
    const size_t n = joints_of(w);
    const uint32_t root = x->child[n];
    const bool several = x->next[root] != NOTHING;
    int r =
        vgi_gltf_say(&w->json, e, "\"scene\":0,\"scenes\":[{\"nodes\":[0,%zu]}],\n\"nodes\":[{\"mesh\":0,\"skin\":0,",
                     several ? n + 1 : (size_t)root + 1);
    if (r == VG_OK) r = vgi_gltf_say_mesh_name(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "}");
    for (size_t j = 0; j < n && r == VG_OK; j++) r = say_joint(w, j, e);
    if (r == VG_OK && several) {
        r = vgi_gltf_say(&w->json, e, ",\n{\"name\":\"skeleton\"");
        if (r == VG_OK) r = say_children(w, root, e);
        if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "}");
    }
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "],\n");
}

static int say_skin(vgi_gltf_writing *w, vg_err *e)
{
    const skinning *x = w->own;
    const vg_rig *rig = &w->h->body.rig;
    int r = vgi_gltf_say(&w->json, e, "\"skins\":[{\"inverseBindMatrices\":%zu,\"joints\":[", x->inverse);
    for (size_t b = 0; b < rig->nbones && r == VG_OK; b++)
        r = vgi_gltf_say(&w->json, e, "%s%zu", b ? "," : "", (size_t)rig->bone[b] + 1);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "]}],\n");
}

static int say_mesh(vgi_gltf_writing *w, vg_err *e)
{
    const skinning *x = w->own;
    vg_bytes moving = {0};
    int r = vgi_gltf_say(&moving, e, "\"attributes\":{\"POSITION\":%zu,\"JOINTS_0\":%zu,\"WEIGHTS_0\":%zu", x->points,
                         x->joints, x->weights);
    if (r == VG_OK && w->normals.n) r = vgi_gltf_say(&moving, e, ",\"NORMAL\":%zu", x->normals);
    if (r == VG_OK) r = vgi_gltf_say_attributes(w, &moving, e);
    if (r == VG_OK) r = vgi_gltf_say(&moving, e, "}");
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "\"meshes\":[{");
    if (r == VG_OK) r = vgi_gltf_say_mesh_name(w, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",");
    if (r == VG_OK) r = vgi_gltf_say_primitives(w, &moving, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\n\"extras\":{\"" VGI_GLTF_FACES "\":[");
    if (r == VG_OK) r = vgi_bytes_append(&w->json, w->shape.runs.data, w->shape.runs.size, e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "]");
    if (r == VG_OK) r = vgi_gltf_say_seams(w, e);
    vg_bytes_clear(&moving);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}}],\n");
}

static int say_animation(vgi_gltf_writing *w, vg_err *e)
{
    const skinning *x = w->own;
    int r = vgi_gltf_say(&w->json, e, "\"animations\":[{\"name\":");
    if (r == VG_OK) r = vgi_gltf_say_take_name(w, &w->takes[0], e);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, ",\"channels\":[");
    for (size_t i = 0; i < x->nchannels && r == VG_OK; i++)
        r = vgi_gltf_say(&w->json, e, "%s{\"sampler\":%zu,\"target\":{\"node\":%zu,\"path\":\"%s\"}}", i ? ",\n" : "",
                         i, x->channels[i].joint + 1, x->channels[i].path);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "],\n\"samplers\":[");
    for (size_t i = 0; i < x->nchannels && r == VG_OK; i++)
        r = vgi_gltf_say(&w->json, e, "%s{\"input\":%zu,\"output\":%zu,\"interpolation\":\"LINEAR\"}", i ? ",\n" : "",
                         w->takes[0].moments, x->outputs + i);
    if (r == VG_OK) r = vgi_gltf_say(&w->json, e, "],\n\"extras\":{");
    if (r == VG_OK) r = vgi_gltf_say_names(w, VGI_GLTF_FRAMES, 0, w->frames, e);
    return r < 0 ? r : vgi_gltf_say(&w->json, e, "}}]");
}

static int describe_skin(vgi_gltf_writing *w, vg_err *e)
{
    int r = describe_points(w, e);
    if (r == VG_OK) r = describe_inverse(w, e);
    if (r == VG_OK) r = describe_channels(w, e);
    if (r == VG_OK) r = vgi_gltf_say_materials(w, e);
    if (r == VG_OK) r = say_nodes(w, e);
    if (r == VG_OK) r = say_skin(w, e);
    if (r == VG_OK) r = say_mesh(w, e);
    return r < 0 ? r : say_animation(w, e);
}

/* ---- bytes ---- */

/* The bones of a vertex, each once, and weights whose sum is 1 in binary32; entries without weight are bone 0. */
static void influences(const vg_rig *rig, size_t v, uint32_t bone[VG_SKIN], float weight[VG_SKIN])
{
    const uint32_t *from = rig->skin_bone + VG_SKIN * v;
    double sum = 0, of[VG_SKIN] = {0}, rest = 1;
    for (size_t i = 0; i < VG_SKIN; i++) {
        double share = rig->skin_weight[VG_SKIN * v + i];
        size_t same = 0;
        while (same < i && from[same] != from[i]) same++;
        of[same] += share, sum += share;
    }
    for (size_t i = VG_SKIN; i-- > 0;) {
        weight[i] = (float)(i ? of[i] / sum : rest);
        bone[i] = weight[i] > 0 ? from[i] : 0;
        rest -= weight[i];
    }
}

/* The vertex of the mesh for vertex v of the file. */
static size_t vertex_of(const vgi_gltf_writing *w, size_t v)
{
    return w->seams.from ? w->seams.from[v] : v;
}

static int emit_joints(vgi_gltf_writing *w, vg_err *e)
{
    const skinning *x = w->own;
    uint32_t bone[VG_SKIN];
    float weight[VG_SKIN];
    int r = VG_OK;
    for (size_t v = 0; v < w->seams.n && r == VG_OK; v++) {
        unsigned char p[2 * VG_SKIN];
        influences(&w->h->body.rig, vertex_of(w, v), bone, weight);
        for (size_t i = 0; i < VG_SKIN; i++) {
            p[x->joint_bytes * i] = (unsigned char)bone[i];
            if (x->joint_bytes == 2) p[2 * i + 1] = (unsigned char)(bone[i] >> 8);
        }
        r = vgi_gltf_emit(w, p, x->joint_bytes * VG_SKIN, e);
    }
    for (size_t v = 0; v < w->seams.n && r == VG_OK; v++) {
        influences(&w->h->body.rig, vertex_of(w, v), bone, weight);
        r = vgi_gltf_emit_singles(w, weight, VG_SKIN, e);
    }
    return r;
}

static int emit_inverse(vgi_gltf_writing *w, vg_err *e)
{
    const skinning *x = w->own;
    int r = VG_OK;
    for (size_t b = 0; b < w->h->body.rig.nbones && r == VG_OK; b++) {
        float m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        for (size_t k = 0; k < 3; k++) m[12 + k] = (float)-x->at[3 * (size_t)w->h->body.rig.bone[b] + k];
        r = vgi_gltf_emit_singles(w, m, 16, e);
    }
    return r;
}

/* Numbers of n channels from `first` on, over all frames: 4 numbers per channel and frame, grouped by channel. */
static int sort_channels(vgi_gltf_writing *w, size_t first, size_t n, float *to, vg_err *e)
{
    skinning *x = w->own;
    const size_t bytes = VGI_GLTF_ITEM * LOCAL * joints_of(w);
    int r = VG_OK;
    for (size_t f = 0; f < w->frames && r == VG_OK; f++) {
        if ((r = vgi_gltf_load(w, (uint64_t)f * bytes, x->packed, bytes, e)) < 0) break;
        for (size_t i = 0; i < n; i++) {
            const channel *c = &x->channels[first + i];
            const unsigned char *p = x->packed + VGI_GLTF_ITEM * (LOCAL * c->joint + c->from);
            for (size_t k = 0; k < c->width; k++)
                to[4 * (i * w->frames + f) + k] = vgi_gltf_get_single(p + (c->from == SIZE ? 0 : VGI_GLTF_ITEM * k));
        }
    }
    return r;
}

static int emit_channels(vgi_gltf_writing *w, vg_err *e)
{
    const skinning *x = w->own;
    const size_t each = 4 * sizeof(float) * w->frames, most = sorting_bytes / each ? sorting_bytes / each : 1;
    size_t n = most < x->nchannels ? most : x->nchannels;
    float *sorted = vgi_array_raw(n, each, e);
    int r = sorted ? VG_OK : VG_ENOMEM;
    for (size_t first = 0; first < x->nchannels && r == VG_OK; first += n) {
        if (n > x->nchannels - first) n = x->nchannels - first;
        r = sort_channels(w, first, n, sorted, e);
        for (size_t i = 0; i < n * w->frames && r == VG_OK; i++)
            r = vgi_gltf_emit_singles(w, sorted + 4 * i, x->channels[first + i / w->frames].width, e);
    }
    free(sorted);
    return r;
}

static int emit_skin(vgi_gltf_writing *w, vg_err *e)
{
    int r = vgi_gltf_emit_singles(w, w->base, 3 * w->seams.n, e);
    if (r == VG_OK && w->normals.n) r = vgi_gltf_emit_singles(w, w->normals.base, 3 * w->normals.n, e);
    if (r == VG_OK) r = emit_joints(w, e);
    if (r == VG_OK) r = emit_inverse(w, e);
    return r < 0 ? r : emit_channels(w, e);
}

static void release_skin(void *own)
{
    skinning *x = own;
    if (!x) return;
    void *const arrays[] = {x->bone,  x->channels, x->child, x->next,  x->rest,  x->at,
                            x->now,   x->local,    x->before, x->moves, x->grows, x->packed};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    free(x);
}

static bool report(const vgi_gltf_writing *w, char *to, size_t room)
{
    snprintf(to, room, "a skin of %zu joints in %zu frame%s", w->h->body.rig.skeleton.njoints, w->frames,
             w->frames == 1 ? "" : "s");
    return false;
}

const vgi_gltf_manner vgi_gltf_by_skin = {begin_skin, put_skin_frame, describe_skin, emit_skin, NULL, report, release_skin, "write fewer frames", false};
