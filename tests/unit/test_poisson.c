/* test_poisson.c: the closed form of guidance is the solution of the Poisson equation in time: second differences
 * stay, keys are met to the bit, and the relaxation of the thesis ends at the same sequence; over the pose an affine error vanishes. Frames come out of the
 * spool and of the store of poses as they went in.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "frames.h"
#include "meshes.h"

enum { FRAMES = 12, POINTS = 7, N = 3 * POINTS };

typedef struct sequence {
    double at[FRAMES][N];
} sequence;

static sequence make_sequence(void)
{
    sequence s;
    for (size_t k = 0; k < FRAMES; k++)
        for (size_t i = 0; i < N; i++) s.at[k][i] = sin(0.7 * (double)k + (double)i) + 0.2 * noise();
    return s;
}

/* keys: ascending frames; given: one pose for each */
static sequence guide(const sequence *u, size_t nkeys, const size_t *keys, double (*given)[N])
{
    sequence t = *u;
    vg_guide *g;
    vg_err e;
    if (vg_guide_new(&g, POINTS, &e) < 0) abort();
    size_t from = 0;
    for (size_t i = 0; i < nkeys; i++) {
        vg_guide_key(g, keys[i], t.at[keys[i]], given[i]);
        for (; from < keys[i]; from++) vg_guide_apply(g, from, t.at[from]);
        from = keys[i] + 1;
    }
    for (; from < FRAMES; from++) vg_guide_apply(g, from, t.at[from]);
    vg_guide_free(&g);
    CHECK(g == NULL);
    return t;
}

static bool is_key(size_t k, size_t nkeys, const size_t *keys)
{
    for (size_t i = 0; i < nkeys; i++)
        if (keys[i] == k) return true;
    return false;
}

/* Successive over-relaxation (T 4.15) of T_(k-1) - 2 T_k + T_(k+1) = that of U, between the first and the last key;
 * beyond them the first difference is U's. */
static sequence relax(const sequence *u, size_t nkeys, const size_t *keys, double (*given)[N], double omega,
                      int sweeps)
{
    sequence t = *u;
    size_t first = keys[0], last = keys[nkeys - 1];
    for (size_t i = 0; i < nkeys; i++) memcpy(t.at[keys[i]], given[i], sizeof given[i]);
    for (int sweep = 0; sweep < sweeps; sweep++)
        for (size_t k = first + 1; k < last; k++)
            for (size_t i = 0; i < N && !is_key(k, nkeys, keys); i++) {
                double second = u->at[k - 1][i] - 2 * u->at[k][i] + u->at[k + 1][i];
                double wanted = 0.5 * (t.at[k - 1][i] + t.at[k + 1][i] - second);
                t.at[k][i] += omega * (wanted - t.at[k][i]);
            }
    for (size_t k = first; k-- > 0;)
        for (size_t i = 0; i < N; i++) t.at[k][i] = t.at[k + 1][i] + (u->at[k][i] - u->at[k + 1][i]);
    for (size_t k = last + 1; k < FRAMES; k++)
        for (size_t i = 0; i < N; i++) t.at[k][i] = t.at[k - 1][i] + (u->at[k][i] - u->at[k - 1][i]);
    return t;
}

static const struct {
    size_t n, keys[4];
} choices[] = {{1, {0}},    {1, {5}},       {1, {FRAMES - 1}}, {2, {0, FRAMES - 1}},
               {2, {3, 4}}, {3, {2, 6, 9}}, {4, {0, 1, 7, 11}}};

static void test_keys(void)
{
    for (size_t c = 0; c < sizeof choices / sizeof *choices; c++) {
        sequence u = make_sequence();
        double given[4][N];
        for (size_t k = 0; k < 4; k++)
            for (size_t i = 0; i < N; i++) given[k][i] = 3 * noise();
        sequence t = guide(&u, choices[c].n, choices[c].keys, given);
        for (size_t i = 0; i < choices[c].n; i++) CHECK(!memcmp(t.at[choices[c].keys[i]], given[i], sizeof given[i]));
        for (size_t k = 1; k + 1 < FRAMES; k++)
            for (size_t i = 0; i < N && !is_key(k, choices[c].n, choices[c].keys); i++)
                CHECK_NEAR(t.at[k - 1][i] - 2 * t.at[k][i] + t.at[k + 1][i],
                           u.at[k - 1][i] - 2 * u.at[k][i] + u.at[k + 1][i], 1e-13);
        sequence slow = relax(&u, choices[c].n, choices[c].keys, given, 1.9, 600);
        double worst = 0;
        for (size_t k = 0; k < FRAMES; k++) worst = fmax(worst, farthest(t.at[k], slow.at[k], POINTS));
        CHECK_NEAR(worst, 0, 1e-9);
    }
}

static void test_same_offset(void)
{
    sequence u = make_sequence();
    double given[2][N];
    size_t keys[2] = {2, 9};
    for (size_t i = 0; i < N; i++) {
        for (size_t k = 0; k < FRAMES; k++) u.at[k][i] = round(64 * u.at[k][i]) / 64; /* sums without rounding */
        given[0][i] = u.at[2][i] + 0.25, given[1][i] = u.at[9][i] + 0.25;
    }
    sequence t = guide(&u, 2, keys, given);
    for (size_t k = 0; k < FRAMES; k++)
        for (size_t i = 0; i < N; i++) CHECK(t.at[k][i] == u.at[k][i] + 0.25);
    sequence same = guide(&u, 0, keys, given); /* without keys: as it is */
    CHECK(!memcmp(&same, &u, sizeof u));
}

/* ---- the spool ---- */

static vg_head graph_head(vg_kind kind)
{
    static uint32_t anchors[2] = {0, 3};
    return (vg_head){.kind = kind,
                     .precision = VG_F64,
                     .count = POINTS,
                     .nanchors = 2,
                     .anchors = anchors,
                     .body.mesh.nv = POINTS};
}

static void fill(vg_frame *f, const vg_head *h, size_t k)
{
    vg_err e;
    char name[32];
    snprintf(name, sizeof name, "%.*s%zu", (int)(k % 9), "frame ..", k);
    if (vg_frame_shape(f, h, &e) < 0 || vg_frame_rename(f, k == 4 ? "" : name, &e) < 0) abort();
    f->has_time = k % 2, f->time = f->has_time ? 0.04 * (double)k : 0;
    for (size_t i = 0; i < 3; i++) f->root[i] = (double)(k + i);
    for (size_t i = 0; i < 6 && vg_frame_anchors(f); i++) vg_frame_anchors(f)[i] = (double)(k * i) + 0.5;
    for (size_t i = 0; i < POINTS * vg_head_width(h); i++) f->values[i] = (double)k + 0.001 * (double)i;
    if (vg_frame_pin(f, (uint32_t[]){1, 4, 6}, h->kind == VG_VECTORS ? k % 4 : 0, &e) < 0) abort();
    if (h->kind == VG_VERTICES && k % 3 &&
        vg_frame_set_scalars(f, name, k % 2 ? "D" : "", f->values + k % 3, POINTS, &e) < 0)
        abort();
    static const double turns[12] = {1, 0, 0, 0, 0.6, 0.8, 0, 0, 0, 0, -0.6, 0.8};
    if (vg_frame_turn(f, turns, h->kind == VG_VERTICES ? k % 4 : 0, &e) < 0) abort();
    vg_records_clear(&f->extra);
    f->extra.at = room(k % 3, sizeof *f->extra.at);
    for (; f->extra.n < k % 3; f->extra.n++) {
        vg_record *r = &f->extra.at[f->extra.n];
        snprintf(r->tag, sizeof r->tag, "XY%zuZ", f->extra.n);
        r->flags = (uint32_t)(2 + (k << 16));
        if (vgi_bytes_append(&r->payload, name, f->extra.n ? 0 : strlen(name), &e) < 0) abort();
    }
}

static bool same_frame(const vg_frame *a, const vg_frame *b, const vg_head *h)
{
    bool graph = h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS;
    bool same = !strcmp(a->name, b->name) && a->has_time == b->has_time && a->time == b->time &&
                a->extra.n == b->extra.n &&
                !memcmp(a->values, b->values, POINTS * vg_head_width(h) * sizeof(double));
    same = same && same_channels(a, b);
    if (graph) same = same && !memcmp(a->root, b->root, sizeof a->root) && vg_frame_anchors(a);
    for (size_t i = 0; same && i < a->extra.n; i++) {
        const vg_record *x = &a->extra.at[i], *y = &b->extra.at[i];
        same = !strcmp(x->tag, y->tag) && x->flags == y->flags && x->payload.size == y->payload.size &&
               (!x->payload.size || !memcmp(x->payload.data, y->payload.data, x->payload.size));
    }
    return same;
}

/* Frames go in and out in bursts of several sizes, with room in memory for none, some and all of them. */
static void test_spool(void)
{
    static const size_t limits[] = {0, 1, 700, 2000, 1 << 20},
                        bursts[][2] = {{1, 1}, {5, 3}, {40, 40}, {7, 7}, {3, 2}};
    static const vg_kind kinds[] = {VG_VERTICES, VG_VECTORS, VG_DEFORMATIONS, VG_TRANSFORMS};
    vg_frame in = {0}, out = {0}, want = {0};
    vg_err e;
    for (size_t c = 0; c < 4 * 5 * 5; c++) {
        vg_head h = graph_head(kinds[c % 4]);
        size_t limit = limits[c / 4 % 5], most = 0, inside = 0, put = 0, got = 0;
        vg_spool *s;
        CHECK(vg_spool_new(&s, &h, limit, &e) == VG_OK);
        while (put < 60) {
            for (size_t i = 0; i < bursts[c / 20][0]; i++, put++, inside++) {
                fill(&in, &h, put);
                CHECK(vg_spool_put(s, &in, &e) == VG_OK);
                if (inside + 1 > most) most = inside + 1;
            }
            for (size_t i = 0; i < bursts[c / 20][1]; i++, got++, inside--) {
                fill(&want, &h, got);
                CHECK(vg_spool_next(s, &out, &e) == 1 && same_frame(&out, &want, &h));
            }
        }
        for (; inside; inside--, got++) {
            fill(&want, &h, got);
            CHECK(vg_spool_next(s, &out, &e) == 1 && same_frame(&out, &want, &h));
        }
        CHECK(vg_spool_next(s, &out, &e) == 0 && vg_spool_next(s, &out, &e) == 0);
        vg_spool_stats stats = vg_spool_get_stats(s);
        CHECK(stats.most_frames == most);
        if (limit == 2000 && bursts[c / 20][0] == 1) CHECK(stats.file_bytes == 0); /* what has gone makes room */
        CHECK(limit == 1 << 20 ? stats.file_bytes == 0 : limit > 1 || stats.file_bytes > 0);
        fill(&in, &h, 2);
        CHECK(vg_spool_put(s, &in, &e) == VG_OK); /* what is left inside is released */
        vg_spool_free(&s);
        CHECK(s == NULL);
    }
    vg_frame_clear(&in);
    vg_frame_clear(&out);
    vg_frame_clear(&want);
}

static void test_spool_without_room(void)
{
    vg_head h = graph_head(VG_VERTICES);
    vg_spool *s;
    vg_frame f = {0};
    vg_err e = {0, ""};
    setenv("TMPDIR", "/nowhere/at/all", 1);
    CHECK(vg_spool_new(&s, &h, 0, &e) == VG_OK);
    fill(&f, &h, 1);
    CHECK(vg_spool_put(s, &f, &e) == VG_ESYS && strstr(e.message, "/nowhere/at/all"));
    vg_spool_free(&s);
    vg_frame_clear(&f);
    h.count = SIZE_MAX / 2;
    CHECK(vg_spool_new(&s, &h, 0, &e) == VG_ENOMEM && !s);
    vg_guide *g;
    CHECK(vg_guide_new(&g, SIZE_MAX / 2, &e) == VG_ENOMEM && !g);
    unsetenv("TMPDIR");
}

/* ---- frames at random ---- */

typedef struct readers {
    const vg_poses *poses;
    const vg_head *h;
    int wrong[240];
} readers;

/* Values alone, in an order of its own. */
static void read_values(void *context, size_t task)
{
    readers *x = context;
    size_t n = vg_poses_count(x->poses), k = task * 37 % n;
    vg_frame want = {0};
    double buffer[8 * POINTS];
    const double *values;
    vg_err e;
    fill(&want, x->h, k);
    int r = vg_poses_values(x->poses, k, buffer, &values, &e);
    x->wrong[task] =
        r < 0 || memcmp(values, want.values, POINTS * vg_kind_width(x->h->kind) * sizeof *values) != 0;
    vg_frame_clear(&want);
}

/* Every frame is found again from any place, whole or its values alone, with room in memory for none, some and all. */
static void test_poses(void)
{
    static const size_t limits[] = {0, 1, 700, 2000, 1 << 20};
    static const vg_kind kinds[] = {VG_VERTICES, VG_VECTORS, VG_DEFORMATIONS, VG_TRANSFORMS};
    enum { COUNT = 60 };
    vg_frame in = {0}, out = {0}, want = {0};
    vg_err e;
    for (size_t c = 0; c < 4 * 5; c++) {
        vg_head h = graph_head(kinds[c % 4]);
        size_t limit = limits[c / 4];
        vg_poses *p;
        CHECK(vg_poses_new(&p, &h, limit, &e) == VG_OK && vg_poses_count(p) == 0);
        for (size_t k = 0; k < COUNT; k++) {
            fill(&in, &h, k);
            CHECK(vg_poses_add(p, &in, &e) == VG_OK && vg_poses_count(p) == k + 1);
            fill(&want, &h, k / 2);
            CHECK(vg_poses_frame(p, k / 2, &out, &e) == VG_OK && same_frame(&out, &want, &h));
        }
        vg_poses_stats stats = vg_poses_get_stats(p);
        CHECK(stats.memory_bytes <= limit);
        CHECK(limit == 1 << 20 ? !stats.file_bytes : stats.file_bytes > 0);
        CHECK(limit < 700 || stats.memory_bytes > 0);
        readers x = {.poses = p, .h = &h};
        vgi_parallel(4, 240, read_values, &x);
        for (size_t i = 0; i < 240; i++) CHECK(!x.wrong[i]);
        vg_poses_free(&p);
        CHECK(p == NULL);
    }
    vg_frame_clear(&in);
    vg_frame_clear(&out);
    vg_frame_clear(&want);
}

static void guide_over_pose(sequence *t, const size_t keys[3], double (*given)[N])
{
    vg_pose_guide *g;
    vg_err e;
    if (vg_pose_guide_new(&g, POINTS, 3, &e) < 0) abort();
    for (size_t i = 0; i < 3; i++) vg_pose_guide_key(g, keys[i], t->at[keys[i]], given[i]);
    for (size_t k = 0; k < FRAMES; k++) vg_pose_guide_apply(g, k, t->at[k]);
    vg_pose_guide_free(&g);
    CHECK(g == NULL);
}

/* The mean of sum w_j e_j over the points, by weights in time between keys 2, 6 and 9. */
static void shift_in_time(const sequence *u, const sequence *truth, size_t k, double shift[3])
{
    static const size_t keys[] = {2, 6, 9};
    size_t after = k <= 2 ? 0 : k <= 6 ? 1 : 2, before = after && k < 9 ? after - 1 : after;
    double w = after == before ? 1 : (double)(k - keys[before]) / (double)(keys[after] - keys[before]);
    memset(shift, 0, 3 * sizeof *shift);
    for (size_t i = 0; i < N; i++)
        shift[i % 3] += (w * (truth->at[keys[after]][i] - u->at[keys[after]][i]) +
                         (1 - w) * (truth->at[keys[before]][i] - u->at[keys[before]][i])) / POINTS;
}

/* Poses that are affine combinations of the keys', by weights that do not follow time: an error that is affine in the pose is
 * corrected completely, but for the mean, which follows time. */
static void test_over_pose(void)
{
    static const size_t keys[] = {2, 6, 9};
    sequence u = make_sequence(), t, truth;
    double given[3][N];
    for (size_t k = 0; k < FRAMES; k++) {
        double a = 0.3 * sin(3.0 * (double)k), b = 0.15 * cos(5.0 * (double)k);
        for (size_t i = 0; i < N && k != 2 && k != 6 && k != 9; i++)
            u.at[k][i] = (1 - a - b) * u.at[2][i] + a * u.at[6][i] + b * u.at[9][i];
    }
    for (size_t k = 0; k < FRAMES; k++)
        for (size_t p = 0; p < POINTS; p++) { /* stretched, sheared and moved */
            const double *x = u.at[k] + 3 * p;
            double *y = truth.at[k] + 3 * p;
            y[0] = 1.3 * x[0] + 0.2 * x[1] - 1, y[1] = 0.8 * x[1] + 2, y[2] = x[2] - 0.1 * x[0];
        }
    for (size_t j = 0; j < 3; j++) memcpy(given[j], truth.at[keys[j]], sizeof given[j]);
    t = u;
    guide_over_pose(&t, keys, given);
    for (size_t j = 0; j < 3; j++) CHECK(!memcmp(t.at[keys[j]], given[j], sizeof given[j]));
    for (size_t k = 0; k < FRAMES; k++) {
        double shift[3], mean[3] = {0};
        shift_in_time(&u, &truth, k, shift);
        for (size_t i = 0; i < N; i++) mean[i % 3] += (truth.at[k][i] - u.at[k][i]) / POINTS;
        for (size_t i = 0; i < N; i++) CHECK(fabs(t.at[k][i] - shift[i % 3] - truth.at[k][i] + mean[i % 3]) < 1e-12);
    }
}

/* Two keys of one pose: in time, to rounding. A pose far beyond the keys, with weights -99, 100, 0 over the pose and 0, 0.6, 0.4
 * in time: a share of 1 / 198 of the former makes sum |w| = 2. */
static void test_over_pose_falls_back(void)
{
    static const size_t keys[] = {1, 5, 10};
    sequence u = make_sequence(), t, timed;
    double given[3][N];
    memcpy(u.at[5], u.at[1], sizeof u.at[5]);
    for (size_t j = 0; j < 3; j++)
        for (size_t i = 0; i < N; i++) given[j][i] = u.at[keys[j]][i] + noise();
    t = u;
    guide_over_pose(&t, keys, given);
    timed = guide(&u, 3, keys, given);
    for (size_t k = 0; k < FRAMES; k++)
        for (size_t i = 0; i < N; i++) CHECK(fabs(t.at[k][i] - timed.at[k][i]) < 1e-14);
    u = make_sequence();
    for (size_t i = 0; i < N; i++) u.at[7][i] = u.at[1][i] + 100 * (u.at[5][i] - u.at[1][i]);
    for (size_t j = 0; j < 3; j++)
        for (size_t i = 0; i < N; i++) given[j][i] = u.at[keys[j]][i] + (j == 1 ? -1 : 1) * (i < 3 ? POINTS - 1.0 : -1);
    t = u;
    guide_over_pose(&t, keys, given);
    for (size_t i = 0; i < N; i++)
        CHECK(fabs((t.at[7][i] - u.at[7][i]) / (i < 3 ? POINTS - 1.0 : -1) + 0.2 + 198.8 / 198) < 1e-8);
}

TESTS({"keys, second differences, relaxation", test_keys}, {"one offset for all", test_same_offset},
      {"over the pose", test_over_pose}, {"over the pose, in time", test_over_pose_falls_back},
      {"frames come out as they went in", test_spool}, {"frames at random", test_poses},
      {"no room", test_spool_without_room})
