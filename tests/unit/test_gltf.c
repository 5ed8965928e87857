/* test_gltf.c: glTF made here by hand and read: morph targets, sparse accessors, seams, nodes, skins, animations; our
 * own files there and back; what is refused. Leaves out the validator, which is asked in gltf.bats where it is
 * installed.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "play.h"

/* A GLB of this JSON, with ' for ", behind the usual beginning: one buffer view, number 0, of the n bytes. */
static vg_bytes make(const char *json, const void *bin, size_t n)
{
    vg_bytes b = {0};
    char text[4096];
    unsigned char head[20] = "glTF", chunk[8] = {0, 0, 0, 0, 'B', 'I', 'N', 0};
    int size = snprintf(text, sizeof text, "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu}],"
                        "'bufferViews':[{'buffer':0,'byteLength':%zu}],%s}", n, n, json);
    CHECK(size > 0 && size < (int)sizeof text - 4);
    while (size % 4) text[size++] = ' ';
    for (int i = 0; i < size; i++)
        if (text[i] == '\'') text[i] = '"';
    vgi_put32(head + 4, 2);
    vgi_put32(head + 8, (uint32_t)(sizeof head + (size_t)size + sizeof chunk + n));
    vgi_put32(head + 12, (uint32_t)size);
    memcpy(head + 16, "JSON", 4);
    vgi_put32(chunk, (uint32_t)n);
    CHECK(vgi_bytes_append(&b, head, sizeof head, NULL) == VG_OK &&
          vgi_bytes_append(&b, text, (size_t)size, NULL) == VG_OK);
    CHECK(vgi_bytes_append(&b, chunk, sizeof chunk, NULL) == VG_OK && vgi_bytes_append(&b, bin, n, NULL) == VG_OK);
    return b;
}

static played play_json(const char *json, const void *bin, size_t n)
{
    vg_bytes b = make(json, bin, n);
    played p = play(&vgi_sequence_glb, b.data, b.size);
    if (p.result < 0) printf("# %s\n", p.e.message);
    vg_bytes_clear(&b);
    return p;
}

#define FLOATS(offset, n, type) "{'bufferView':0,'byteOffset':" #offset ",'componentType':5126,'count':" #n ",'type':'" type "'}"
#define SCENE "'scenes':[{'nodes':[0]}],"

static void check_point(const played *p, size_t frame, size_t v, double x, double y, double z)
{
    const double *at = p->values + 3 * (frame * p->h.count + v);
    CHECK_NEAR(at[0], x, 1e-6);
    CHECK_NEAR(at[1], y, 1e-6);
    CHECK_NEAR(at[2], z, 1e-6);
}

/* ---- our own files ---- */

/* A quad, a concave pentagon whose first corner sees not all, a triangle, a line, and a vertex in no face. */
static uint32_t starts[] = {0, 4, 9, 12, 14};
static uint32_t corners[] = {0, 1, 2, 3, 5, 6, 7, 8, 4, 2, 1, 9, 9, 10};
static double rest_pose[] = {0, 0, 0, 1,   0,   0, 1, 1, 0, 0, 1, 0, 2, 0, 0, 4, 0, 0,
                             4, 4, 0, 2.9, 0.5, 0, 2, 4, 0, 3, 3, 3, 5, 5, 5, 9, 9, 9};

static void fill(vg_head *h, vg_frame frames[3], double values[3][36])
{
    static char name[3][8] = {"a\"b", "\xc3\xa4\\", "c"}, reference[] = "rest";
    *h = (vg_head){.body.mesh = {12, 4, starts, corners},
                   .body.reference = rest_pose,
                   .body.reference_name = reference,
                   .kind = VG_VERTICES,
                   .count = 12};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 36; k++) values[i][k] = rest_pose[k] + 0.1 * i * (k % 5) - 0.25 * i;
        frames[i] = (vg_frame){.name = name[i], .has_time = true, .time = 0.5 * i, .values = values[i]};
    }
}

static void comes_back(const vgi_sequence_format *format)
{
    vg_head h;
    vg_frame frames[3];
    double values[3][36];
    int r;
    char warning[200];
    fill(&h, frames, values);
    vg_bytes b = record(format, &h, frames, 3, false, &r, warning);
    CHECK(r == VG_OK);
    CHECK_TEXT(warning, "");
    CHECK(format->sniff(b.data, b.size));
    if (format == &vgi_sequence_gltf) b.size--; /* the last line's end is not needed */
    played p = play(format, b.data, b.size);
    CHECK(p.result == 0 && p.frames == 3 && p.timed && p.times[2] == 1);
    CHECK(vg_mesh_same(&h.body.mesh, "a", &p.h.body.mesh, "b", NULL) == VG_OK);
    CHECK_TEXT(p.names, "a\"b \xc3\xa4\\ c ");
    CHECK_TEXT(p.h.body.reference_name, "rest");
    for (int k = 0; k < 36; k++) CHECK_NEAR(p.h.body.reference[k], rest_pose[k], 1e-6);
    for (int i = 0; i < 108; i++) CHECK_NEAR(p.values[i], values[i / 36][i % 36], 1e-6);
    played_clear(&p);
    check_prefixes(format, &b);
    vg_bytes_clear(&b);
}

static void binary_comes_back(void)
{
    comes_back(&vgi_sequence_glb);
}

static void text_comes_back(void)
{
    comes_back(&vgi_sequence_gltf);
}

/* ---- skins of ours ---- */

/* Two roots: hip (bone 0), of which spine, which turns nothing, and head (bone 1) with an end; and tail (bone 2). */
static vg_joint rig_joints[] = {
    {(char[]){"hip"}, UINT32_MAX, {0, 1, 0}, 6, {1, 2, 3, 6, 4, 5}}, {(char[]){"spine"}, 0, {0, 1, 0}, 0, {0}},
    {(char[]){"head \"x\""}, 1, {0.1, 1, 0}, 3, {6, 4, 5}},
    {(char[]){"head.end"}, 2, {0, 0.5, 0}, 0, {0}}, {(char[]){"tail"}, UINT32_MAX, {3, 0, 0.3}, 3, {6, 4, 5}}};
static double rig_at[] = {0, 1, 0, 0, 2, 0, 0.1, 3, 0, 0.1, 3.5, 0, 3, 0, 0.3};
static double rig_turns[] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};

/* A weight that is split between two places of one bone, places without weight whose bone says anything, thirds. */
static void hang(vg_rig *rig, uint32_t bones[48], double weights[48])
{
    for (size_t v = 0; v < 12; v++) {
        const double third[4] = {1. / 3, 1. / 3, 1. / 3, 0}, twice[4] = {0.5, 0.3, 0.2, 0}, alone[4] = {1, 0, 0, 0};
        memcpy(weights + 4 * v, v % 3 == 0 ? third : v % 3 == 1 ? twice : alone, sizeof third);
        const uint32_t of[3][4] = {{0, 1, 2, 2}, {1, 2, 1, 2}, {(uint32_t)v % 3, 1, 2, 2}};
        memcpy(bones + 4 * v, of[v % 3], sizeof of[0]);
    }
    rig->skin_bone = bones, rig->skin_weight = weights;
}

static void turn(const double axis[3], double angle, double scale, double to[4])
{
    double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    to[0] = sqrt(scale) * cos(angle / 2);
    for (int k = 0; k < 3; k++) to[k + 1] = sqrt(scale) * sin(angle / 2) * axis[k] / length;
}

/* Transforms that turn about the joint, and push it; of frame 0 none at all. */
static void move_bones(const vg_rig *rig, int frame, double scale, double to[21])
{
    for (size_t b = 0; b < 3; b++) {
        double *t = to + 7 * b, moved[3];
        const double *at = rig->at + 3 * rig->bone[b], axis[3] = {1, 0.3 * (double)b, -0.5};
        turn(axis, frame * (0.7 + (double)b), frame && b == 1 ? scale : 1, t);
        vg_quat_apply(t, at, moved);
        for (size_t k = 0; k < 3; k++)
            t[4 + k] = at[k] - moved[k] + (b == 0 ? 0.2 * frame * (double)(k + 1) : 0.01 * frame);
    }
}

static bool has(const vg_bytes *b, const char *text)
{
    return memmem(b->data, b->size, text, strlen(text));
}

static void skin_comes_back(const vgi_sequence_format *format, double scale)
{
    vg_head h;
    vg_frame frames[3];
    double values[3][36], transforms[3][21], weights[48], truth[36];
    uint32_t bones[48];
    int r;
    const vg_skeleton skeleton = {5, rig_joints};
    fill(&h, frames, values);
    CHECK(vg_rig_make(&h.body.rig, &skeleton, rig_at, rig_turns, NULL) == VG_OK && h.body.rig.nbones == 3);
    hang(&h.body.rig, bones, weights);
    h.kind = VG_TRANSFORMS, h.count = 3;
    CHECK(format->check(&h, "out", NULL) == VG_OK);
    for (int i = 0; i < 3; i++) {
        move_bones(&h.body.rig, i, scale, transforms[i]);
        frames[i].values = transforms[i];
    }
    vg_bytes b = record(format, &h, frames, 3, false, &r, NULL);
    CHECK(r == VG_OK && has(&b, "head \\u0022x") && has(&b, "\"skeleton\"") && has(&b, "JOINTS_0"));
    CHECK(has(&b, "\"path\":\"scale\"") == (scale != 1));
    if (format == &vgi_sequence_gltf) b.size--;
    played p = play(format, b.data, b.size);
    CHECK(p.result == 0 && p.frames == 3 && p.timed && p.times[1] == 0.5 && p.h.kind == VG_VERTICES);
    CHECK(vg_mesh_same(&h.body.mesh, "a", &p.h.body.mesh, "b", NULL) == VG_OK);
    CHECK_TEXT(p.names, "a\"b \xc3\xa4\\ c ");
    for (int i = 0; i < 3; i++) {
        vg_rig_skin(&h.body.rig, 12, h.body.reference, transforms[i], truth);
        /* the mesh is 15 across */
        for (int k = 0; k < 36; k++) CHECK_NEAR(p.values[36 * i + k], truth[k], 2e-6 * 15);
    }
    h.body.rig.skin_bone = NULL, h.body.rig.skin_weight = NULL;
    CHECK(format->check(&h, "out", NULL) == VG_EINPUT);
    vg_rig_clear(&h.body.rig);
    CHECK(format->check(&h, "out", NULL) == VG_EINPUT);
    played_clear(&p);
    vg_bytes_clear(&b);
}

static void skins_come_back(void)
{
    skin_comes_back(&vgi_sequence_glb, 1);
    skin_comes_back(&vgi_sequence_gltf, 1);
    skin_comes_back(&vgi_sequence_glb, 1.7);
}

static void points_come_back(void)
{
    vg_head h;
    vg_frame frames[3];
    double values[3][36];
    int r;
    char warning[200];
    fill(&h, frames, values);
    h.body.mesh.nf = 0;
    frames[1].time = -1; /* does not ascend */
    memcpy(values[0] + 3, values[0], 3 * sizeof(double)); /* two points that coincide stay two */
    vg_bytes b = record(&vgi_sequence_glb, &h, frames, 3, false, &r, warning);
    CHECK(r == VG_OK && strstr(warning, "the times of the frames"));
    played p = play(&vgi_sequence_glb, b.data, b.size);
    CHECK(p.result == 0 && p.frames == 3 && p.h.count == 12 && p.h.body.mesh.nf == 0);
    CHECK_NEAR(p.times[2], 2 / 24.0, 1e-6);
    played_clear(&p);
    vg_bytes_clear(&b);
    values[1][0] = 1e39;
    b = record(&vgi_sequence_glb, &h, frames, 3, false, &r, NULL);
    CHECK(r == VG_EINPUT);
    vg_bytes_clear(&b);
}

/* ---- morph targets ---- */

static void targets_are_frames(void)
{
    struct { float base[9], moved[9], replaced[3]; unsigned char index[4]; } bin = {
        {0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 0, 1, 0, 0, 2, 0, 0, 3}, {7, 8, 9}, {2, 0, 0, 0}};
    played p = play_json(SCENE "'nodes':[{'mesh':0,'translation':[10,0,0]}],'meshes':[{'name':'face','primitives':[{'attributes':{'POSITION':0},"
                         "'targets':[{'POSITION':1},{'POSITION':2},{'NORMAL':1}]}],'extras':{'targetNames':['smile','frown']}}],"
                         "'accessors':[" FLOATS(0, 3, "VEC3") "," FLOATS(36, 3, "VEC3") ",{'componentType':5126,'count':3,'type':'VEC3',"
                         "'sparse':{'count':1,'indices':{'bufferView':0,'byteOffset':84,'componentType':5121},"
                         "'values':{'bufferView':0,'byteOffset':72}}}]", &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 4 && p.h.count == 3 && p.h.body.mesh.nf == 1 && !p.timed);
    CHECK_TEXT(p.names, "base smile frown  ");
    CHECK_TEXT(p.h.body.reference_name, "face");
    check_point(&p, 0, 1, 11, 0, 0);
    check_point(&p, 1, 1, 11, 0, 2);
    check_point(&p, 1, 2, 10, 1, 3);
    check_point(&p, 2, 1, 11, 0, 0);
    check_point(&p, 2, 2, 17, 9, 9);
    check_point(&p, 3, 2, 10, 1, 0);
    played_clear(&p);
}

/* Two triangles of a quad, cut along the diagonal; the target tears one end of the cut apart. */
static void only_equal_vertices_are_welded(void)
{
    struct { float base[18], moved[18]; } bin = {
        {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 5, 0, 0, 0, 0, 0, 6, 0, 0, 0}};
    static const char targets[] = SCENE "'nodes':[{'mesh':0}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}%s}]}],"
                                  "'accessors':[" FLOATS(0, 6, "VEC3") "," FLOATS(72, 6, "VEC3") "]";
    char json[1024];
    snprintf(json, sizeof json, targets, "");
    played p = play_json(json, &bin, sizeof bin);
    const uint32_t whole[] = {0, 1, 2, 0, 2, 3}, torn[] = {0, 1, 2, 0, 3, 4};
    CHECK(p.result == 0 && p.frames == 1 && p.h.count == 4 && p.h.body.mesh.nf == 2 &&
          !memcmp(p.h.body.mesh.vert, whole, sizeof whole));
    check_point(&p, 0, 3, 0, 1, 0);
    played_clear(&p);
    snprintf(json, sizeof json, targets, ",'targets':[{'POSITION':1}]");
    p = play_json(json, &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 2 && p.h.count == 5 && p.h.body.mesh.nf == 2 &&
          !memcmp(p.h.body.mesh.vert, torn, sizeof torn));
    check_point(&p, 1, 2, 1, 1, 5);
    check_point(&p, 1, 3, 1, 1, 6);
    played_clear(&p);
}

static void weights_are_played(void)
{
    struct { float base[9], one[9], two[9], times[3], weights[6]; } bin = {
        {0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 1, 1, 1, 1, 1, 1, 1, 1}, {0, 0, 4, 0, 0, 4, 0, 0, 4}, {0, 0.5f, 2}, {0, 0, 1, 0, 0.5f, 0.25f}};
    played p = play_json(SCENE "'nodes':[{'mesh':0}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},"
                         "'targets':[{'POSITION':1},{'POSITION':2}]}]}],'animations':[{'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}],"
                         "'samplers':[{'input':3,'output':4}]}],'accessors':[" FLOATS(0, 3, "VEC3") "," FLOATS(36, 3, "VEC3") ","
                         FLOATS(72, 3, "VEC3") "," FLOATS(108, 3, "SCALAR") "," FLOATS(120, 6, "SCALAR") "]", &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 3 && p.timed && p.times[1] == 0.5 && p.times[2] == 2);
    check_point(&p, 0, 1, 1, 0, 0);
    check_point(&p, 1, 1, 2, 1, 1);
    check_point(&p, 2, 1, 1.5, 0.5, 1.5);
    played_clear(&p);
}

/* What is not animated keeps the weights of its node, or else of its mesh, and so does the reference. */
static void weights_stay(void)
{
    struct { float base[3], one[3], two[3], times[2], moves[6]; } bin = {
        {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1}, {0, 0, 0, 5, 0, 0}};
    static const char *const own[] = {"", ",'weights':[0,3]"};
    for (int i = 0; i < 2; i++) {
        char json[1024];
        snprintf(json, sizeof json, SCENE "'nodes':[{'mesh':0%s}],'meshes':[{'weights':[0.5,2],'primitives':[{'mode':0,"
                 "'attributes':{'POSITION':0},'targets':[{'POSITION':1},{'POSITION':2}]}]}],"
                 "'animations':[{'channels':[{'sampler':0,'target':{'node':0,'path':'translation'}}],"
                 "'samplers':[{'input':3,'output':4}]}],'accessors':[" FLOATS(0, 1, "VEC3") "," FLOATS(12, 1, "VEC3") ","
                 FLOATS(24, 1, "VEC3") "," FLOATS(36, 2, "SCALAR") "," FLOATS(44, 2, "VEC3") "]", own[i]);
        played p = play_json(json, &bin, sizeof bin);
        CHECK(p.result == 0 && p.frames == 2);
        check_point(&p, 0, 0, 1, i ? 0 : 0.5, i ? 3 : 2);
        check_point(&p, 1, 0, 6, i ? 0 : 0.5, i ? 3 : 2);
        CHECK(p.h.body.reference[0] == 1 && p.h.body.reference[1] == (i ? 0 : 0.5) && p.h.body.reference[2] == (i ? 3 : 2));
        played_clear(&p);
    }
}

/* ---- nodes ---- */

/* A point at (1, 0, 0) below a node that turns about z by 90 degrees and grows, which another one moves: times 0, 1
 * and 0, 2. */
static void nodes_move(void)
{
    const float h = 0.70710678f;
    struct { float base[3], one[2], two[2], turn[8], scale[6], cubic[18]; } bin = {
        {1, 0, 0}, {0, 1}, {0, 2}, {0, 0, 0, 1, 0, 0, -h, -h}, {1, 1, 1, 3, 3, 3},
        {0, 0, 0, 0, 0, 0, 4, 0, 0, -8, 0, 0, 8, 0, 0, 0, 0, 0}}; /* in, value, out; in, value, out */
    played p = play_json("'scene':0,'scenes':[{'nodes':[1]}],'nodes':[{'mesh':0},{'children':[0],'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]},"
                         "{'mesh':0}],'meshes':[{'primitives':[{'mode':0,'attributes':{'POSITION':0}}]}],'animations':[{'channels':["
                         "{'sampler':0,'target':{'node':0,'path':'rotation'}},{'sampler':1,'target':{'node':0,'path':'scale'}},"
                         "{'sampler':2,'target':{'node':0,'path':'translation'}},{'sampler':9,'target':{'node':2,'path':'scale'}}],"
                         "'samplers':[{'input':1,'output':3},{'input':2,'output':4,'interpolation':'STEP'},"
                         "{'input':2,'output':5,'interpolation':'CUBICSPLINE'}]}],"
                         "'accessors':[" FLOATS(0, 1, "VEC3") "," FLOATS(12, 2, "SCALAR") "," FLOATS(20, 2, "SCALAR") "," FLOATS(28, 2, "VEC4") ","
                         FLOATS(60, 2, "VEC3") "," FLOATS(84, 6, "VEC3") "]", &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 3 && p.h.count == 1);
    check_point(&p, 0, 0, 1, 0, 5);
    /* at 1, half way from 0 to 8: the scale waits; slopes 4 at the start and -8 at the end of 2 s add 2 (4 + 8) /
     * 8 */
    check_point(&p, 1, 0, 7, 1, 5);
    check_point(&p, 2, 0, 8, 3, 5);
    played_clear(&p);
}

/* Half way to a turn of 90 degrees that is written as the other one of its quaternions. */
static void turns_go_the_short_way(void)
{
    const float h = 0.70710678f;
    struct { float base[3], ends[2], three[3], turn[8], still[9]; } bin = {
        {1, 0, 0}, {0, 2}, {0, 1, 2}, {0, 0, 0, 1, 0, 0, -h, -h}, {0}};
    played p = play_json("'nodes':[{'mesh':0}],'meshes':[{'primitives':[{'mode':0,'attributes':{'POSITION':0}}]}],'animations':[{'channels':["
                         "{'sampler':0,'target':{'node':0,'path':'rotation'}},{'sampler':1,'target':{'node':0,'path':'translation'}}],"
                         "'samplers':[{'input':1,'output':3},{'input':2,'output':4}]}],'accessors':[" FLOATS(0, 1, "VEC3") ","
                         FLOATS(12, 2, "SCALAR") "," FLOATS(20, 3, "SCALAR") "," FLOATS(32, 2, "VEC4") "," FLOATS(64, 3, "VEC3") "]",
                         &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 3);
    check_point(&p, 1, 0, 0.70710678, 0.70710678, 0);
    check_point(&p, 2, 0, 0, 1, 0);
    played_clear(&p);
}

static void weights_are_shares(void)
{
    struct { float base[3], weights[4]; unsigned char joints[4]; } bin = {{0, 0, 0}, {0.25f, 0.25f, 0, 0}, {0, 1, 0, 0}};
    played p = play_json("'nodes':[{'mesh':0,'skin':0},{'translation':[2,0,0]},{'translation':[0,6,0]}],'skins':[{'joints':[1,2]}],"
                         "'meshes':[{'primitives':[{'mode':0,'attributes':{'POSITION':0,'JOINTS_0':1,'WEIGHTS_0':2}}]}],"
                         "'accessors':[" FLOATS(0, 1, "VEC3") ",{'bufferView':0,'byteOffset':28,'componentType':5121,'count':1,'type':'VEC4'},"
                         FLOATS(12, 1, "VEC4") "]", &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 1);
    check_point(&p, 0, 0, 1, 3, 0);
    played_clear(&p);
}

/* Two joints along y; the upper one bends by 90 degrees about z. Weights are bytes, joints too. */
static void skins_bend(void)
{
    const float h = 0.70710678f;
    struct { float base[9], inverse[32], times[2], turn[8]; unsigned char joints[12], weights[12]; } bin = {
        {0, 0, 0, 0, 1, 0, 0, 2, 0},
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1}, {0, 1}, {0, 0, 0, 1, 0, 0, h, h},
        {0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0}, {255, 0, 0, 0, 51, 204, 0, 0, 255, 0, 0, 0}};
    played p = play_json("'nodes':[{'mesh':0,'skin':0,'translation':[99,99,99]},{'children':[2]},{'translation':[0,1,0]}],"
                         "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':1,'WEIGHTS_0':2}}]}],"
                         "'skins':[{'joints':[1,2],'inverseBindMatrices':3}],"
                         "'animations':[{'channels':[{'sampler':0,'target':{'node':2,'path':'rotation'}}],'samplers':[{'input':4,'output':5}]}],"
                         "'accessors':[" FLOATS(0, 3, "VEC3") ",{'bufferView':0,'byteOffset':204,'componentType':5121,'count':3,'type':'VEC4'},"
                         "{'bufferView':0,'byteOffset':216,'componentType':5121,'normalized':true,'count':3,'type':'VEC4'},"
                         FLOATS(36, 2, "MAT4") "," FLOATS(164, 2, "SCALAR") "," FLOATS(172, 2, "VEC4") "]", &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 2 && p.h.count == 3);
    check_point(&p, 0, 2, 0, 2, 0);
    check_point(&p, 1, 0, 0, 0, 0);
    check_point(&p, 1, 1, 0, 1, 0);
    check_point(&p, 1, 2, -1, 1, 0);
    played_clear(&p);
}

/* The least of the normalized signed integers is -1, not a little less, as the next one is. */
static void normalized_numbers_end_at_minus_one(void)
{
    const int16_t shorts[] = {-32768, -32767, 32767, 0, 0, 0, 16384, 0, 0};
    const int8_t bytes[] = {-128, -127, 127, 0, 0, 0, 64, 0, 0};
    for (int i = 0; i < 2; i++) {
        char json[512];
        snprintf(json, sizeof json, "'nodes':[{'mesh':0}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],'accessors':["
                 "{'bufferView':0,'componentType':%d,'normalized':true,'count':3,'type':'VEC3'}]", i ? 5120 : 5122);
        played p = play_json(json, i ? (const void *)bytes : shorts, i ? sizeof bytes : sizeof shorts);
        CHECK(p.result == 0 && p.h.count == 3);
        check_point(&p, 0, 0, -1, -1, 1);
        check_point(&p, 0, 2, i ? 64 / 127.0 : 16384 / 32767.0, 0, 0);
        played_clear(&p);
    }
}

static void all_kinds_of_primitives(void)
{
    float bin[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 1, 0};
    const struct { int mode; size_t faces, size; uint32_t last[3]; } cases[] = {
        {0, 0, 0, {0}}, {2, 5, 2, {4, 0}}, {3, 4, 2, {3, 4}}, {5, 3, 3, {2, 3, 4}}, {6, 3, 3, {0, 3, 4}}};
    for (size_t i = 0; i < 5; i++) {
        char json[512];
        snprintf(json, sizeof json, "'nodes':[{'mesh':0}],'meshes':[{'primitives':[{'mode':%d,'attributes':{'POSITION':0}}]}],"
                 "'accessors':[" FLOATS(0, 5, "VEC3") "]", cases[i].mode);
        played p = play_json(json, bin, sizeof bin);
        const size_t n = vg_mesh_corners(&p.h.body.mesh);
        CHECK(p.result == 0 && p.h.count == 5 && p.h.body.mesh.nf == cases[i].faces &&
              n == cases[i].faces * cases[i].size);
        if (n)
            CHECK(!memcmp(p.h.body.mesh.vert + n - cases[i].size, cases[i].last, cases[i].size * sizeof(uint32_t)));
        played_clear(&p);
    }
}

/* Extras that triangles do not agree with, since another program has changed the file, are passed over. */
static void stale_polygons_are_passed_over(void)
{
    float bin[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0}; /* a quad in two triangles, cut apart */
    static const char *const runs[] = {"1,4", "2,4", "1,5",  "1,3",  "1000000000000,3", "1,1000000000000",
                                       "1",   "2,2", "-1,4", "'x',3"};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        char json[512];
        snprintf(json, sizeof json, "'nodes':[{'mesh':0}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}],"
                 "'extras':{'vg_faces':[%s]}}],'accessors':[" FLOATS(0, 6, "VEC3") "]", runs[i]);
        played p = play_json(json, bin, sizeof bin);
        CHECK(p.result == 0 && p.h.count == 4 && p.h.body.mesh.nf == 2 && vg_mesh_corners(&p.h.body.mesh) == 6);
        played_clear(&p);
    }
}

static void animations_follow_one_another(void)
{
    struct { float base[9], times[2], moved[6]; } bin = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1}, {0, 0, 0, 0, 0, 8}};
    static const char clip[] = "{'channels':[{'sampler':0,'target':{'node':0,'path':'translation'}}],'samplers':[{'input':1,'output':2}]}";
    char json[1024];
    snprintf(json, sizeof json, "'nodes':[{'mesh':0}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],'animations':[%s,%s],"
             "'accessors':[" FLOATS(0, 3, "VEC3") "," FLOATS(36, 2, "SCALAR") "," FLOATS(44, 2, "VEC3") "]", clip, clip);
    played p = play_json(json, &bin, sizeof bin);
    CHECK(p.result == 0 && p.frames == 4 && !p.timed);
    check_point(&p, 1, 0, 0, 0, 8);
    check_point(&p, 2, 0, 0, 0, 0);
    check_point(&p, 3, 1, 1, 0, 8);
    played_clear(&p);
}

/* ---- what is refused ---- */

static void malformed_is_refused(void)
{
    float bin[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, NAN, 0, 0, 5, 4, 3};
#define MESH "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}],"
#define GOOD "'accessors':[" FLOATS(0, 3, "VEC3") "]"
#define NODE "'nodes':[{'mesh':0}],"
    static const struct { const char *json, *says; } cases[] = {
        {MESH GOOD, "shows no mesh"},
        {NODE GOOD, "'meshes' that does not exist"},
        {"'nodes':[{'mesh':0,'children':[1]},{'children':[0]}]," MESH GOOD, "in a cycle"},
        {"'nodes':[{'mesh':0,'children':[0]}]," MESH GOOD, "in a cycle"},
        {"'nodes':[{'children':[2]},{'children':[2]},{'mesh':0}]," MESH GOOD, "two parents"},
        {"'nodes':[{'mesh':0,'children':[1]}]," MESH GOOD, "'nodes' that does not exist"},
        {"'nodes':[{'mesh':-1}]," MESH GOOD, "'meshes' that does not exist"},
        {"'nodes':[{'mesh':0,'scale':[1,1]}]," MESH GOOD, "is not 3 numbers"},
        {"'nodes':[{'mesh':0,'scale':[1e300,1e300,1e300]},{'mesh':0,'matrix':[1e999]}]," MESH GOOD, "malformed JSON"},
        {NODE MESH "'accessors':[" FLOATS(0, 4000000000, "VEC3") "]", "goes beyond its buffer view"},
        {NODE MESH "'accessors':[" FLOATS(0, 18446744073709551615, "VEC3") "]", "malformed JSON"},
        {NODE MESH "'accessors':[" FLOATS(0, -3, "VEC3") "]", "'count' is not an integer"},
        {NODE MESH "'accessors':[" FLOATS(0, 1.5, "VEC3") "]", "'count' is not an integer"},
        {NODE MESH "'accessors':[" FLOATS(0, 0, "VEC3") "]", "has 0 elements"},
        {NODE MESH "'accessors':[" FLOATS(28, 3, "VEC3") "]", "goes beyond its buffer view"},
        {NODE MESH "'accessors':[" FLOATS(9007199254740991, 3, "VEC3") "]", "goes beyond its buffer view"},
        {NODE MESH "'accessors':[" FLOATS(0, 3, "VEC2") "]", "of another type"},
        {NODE MESH "'accessors':[" FLOATS(12, 3, "VEC3") "]", "not a finite number"},
        {NODE MESH "'accessors':[{'componentType':5126,'count':9000000000,'type':'VEC3'}]", "has no bytes"},
        {NODE MESH "'accessors':[{'bufferView':0,'componentType':5130,'count':3,'type':'VEC3'}]", "componentType is not known"},
        {NODE MESH "'accessors':[{'bufferView':7,'componentType':5126,'count':3,'type':'VEC3'}]", "'bufferViews' that does not exist"},
        {NODE MESH GOOD ",'bufferViews':[{'buffer':0,'byteLength':60,'byteStride':8}]", "byteStride is less than an element"},
        {NODE MESH GOOD ",'extensionsRequired':['KHR_draco_mesh']", "requires the extension 'KHR_draco_mesh', which is not known"},
        {NODE "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],'accessors':[" FLOATS(0, 3, "VEC3")
         ",{'bufferView':0,'byteOffset':48,'componentType':5125,'count':3,'type':'SCALAR'}]", "an index is 1084227584, but there are 3"},
        {NODE "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':0}]}]," GOOD, "of another type"},
        {NODE "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':1}]}]}],'accessors':[" FLOATS(0, 3, "VEC3") ","
         FLOATS(0, 2, "VEC3") "]", "has 2 elements, not 3"},
        {NODE "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'mode':7}]}]," GOOD, "mode is not known"},
        {NODE MESH "'accessors':[" FLOATS(0, 2, "VEC3") "]", "do not form complete triangles"},
        {NODE MESH "'animations':[{'channels':[{'sampler':0,'target':{'node':0,'path':'scale'}}],'samplers':[{'input':1,'output':0}]}],"
         "'accessors':[" FLOATS(0, 3, "VEC3") "," FLOATS(48, 3, "SCALAR") "]", "times of an animation do not ascend"},
        {NODE MESH "'animations':[{'channels':[{'sampler':1,'target':{'node':0,'path':'scale'}}],'samplers':[]}]," GOOD, "sampler that does not exist"},
        {"'nodes':[{'mesh':0,'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}]," MESH "'animations':[{'channels':[{'sampler':0,"
         "'target':{'node':0,'path':'scale'}}],'samplers':[{'input':1,'output':0}]}],'accessors':[" FLOATS(0, 3, "VEC3") ","
         FLOATS(0, 1, "SCALAR") "]", "is animated and has a matrix"},
        {"'nodes':[{'mesh':0,'skin':0}],'skins':[{'joints':[5]}]," MESH GOOD, "'nodes' that does not exist"},
        {NODE MESH "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3','sparse':{'count':2,"
         "'indices':{'bufferView':0,'componentType':5121},'values':{'bufferView':0}}}]", "do not ascend"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        vg_bytes b = make(cases[i].json, bin, sizeof bin);
        CHECK(refused(&vgi_sequence_glb, b.data, b.size) == VG_EINPUT);
        if (!strstr(message, cases[i].says)) printf("# case %zu: %s\n", i, message);
        CHECK(strstr(message, cases[i].says));
        vg_bytes_clear(&b);
    }
    vg_bytes b = make(NODE MESH GOOD, bin, 36); /* an empty chunk behind the end that the file says it has */
    CHECK(vgi_bytes_append(&b, "\0\0\0\0XXXX", 8, NULL) == VG_OK);
    CHECK(refused(&vgi_sequence_glb, b.data, b.size) == VG_EINPUT && strstr(message, "bytes after the end of the GLB"));
    vg_bytes_clear(&b);
}

static void wrong_texts_are_refused(void)
{
    static const char *const bad[] = {"{\"asset\":{\"version\":\"1.0\"}}", "{\"asset\":{}}", "[]", "{\"asset\":", "{\"asset\":{\"version\":\"2.0\"}} x",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":4,\"uri\":\"data:;base64,AAA\"}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":3,\"uri\":\"data:;base64,A*AA\"}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":3,\"uri\":\"data:text/plain,abc\"}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":3,\"uri\":\"beside.bin\"}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":3}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":-3}]}"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(refused(&vgi_sequence_gltf, bad[i], strlen(bad[i])) == VG_EINPUT);
}

TESTS({"a GLB of ours comes back whole", binary_comes_back}, {"a glTF of ours comes back whole", text_comes_back},
       {"a rig that moves comes back as its vertices", skins_come_back},
      {"points without faces come back", points_come_back}, {"morph targets are frames", targets_are_frames},
      {"only equal vertices are welded", only_equal_vertices_are_welded}, {"weights are played", weights_are_played}, {"weights stay", weights_stay},
      {"turns go the short way", turns_go_the_short_way}, {"weights are shares", weights_are_shares},
      {"normalized numbers end at minus one", normalized_numbers_end_at_minus_one},
      {"nodes move", nodes_move}, {"skins bend", skins_bend}, {"all kinds of primitives", all_kinds_of_primitives},
      {"stale polygons are passed over", stale_polygons_are_passed_over},
      {"animations follow one another", animations_follow_one_another},
      {"malformed files are refused", malformed_is_refused}, {"wrong texts are refused", wrong_texts_are_refused})
