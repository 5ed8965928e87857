/* test_rig.c: rigs: bodies that move rigidly with their bones are met, weights and motions are found again, a map is
 * its uncollapsed chain, other skeletons drive it, and edits, joints of vertices and other bodies.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "method/rig/skin.h"

enum { JOINTS = 5, BONES = 4, POSES = 9 };
static const double LENGTH = 3;

/* Four bones in a row along z, and an end. */
static vg_skeleton make_skeleton(double length)
{
    static const char *const names[JOINTS] = {"hip", "knee", "foot", "toe", "toe.end"};
    vg_skeleton s = {.njoints = JOINTS, .joints = room(JOINTS, sizeof *s.joints)};
    for (size_t j = 0; j < JOINTS; j++) {
        vg_joint *joint = &s.joints[j];
        *joint = (vg_joint){
            .name = strdup(names[j]), .parent = j ? (uint32_t)j - 1 : UINT32_MAX, .offset = {0, 0, j ? length : 0}};
        if (j < BONES) {
            joint->nchannels = j ? 3 : 6;
            memcpy(joint->channels, j ? (const uint8_t[]){6, 4, 5, 0, 0, 0} : (const uint8_t[]){1, 2, 3, 6, 4, 5}, 6);
        }
    }
    return s;
}

static void draw_values(double *values, double degrees)
{
    for (size_t i = 0; i < 3; i++) values[i] = 2 * noise();
    for (size_t i = 3; i < 6 + 3 * (BONES - 1); i++) values[i] = degrees * noise();
}

typedef struct stage {
    vg_head h;
    vg_skeleton s;
    double values[POSES][6 + 3 * (BONES - 1)];
    double *positions[POSES], *turns[POSES], *transforms[POSES], *poses[POSES];
} stage;

/* A mesh with its skeleton, and random motions of it. `shift`: where the root is in the mesh. */
static void set_stage(stage *x, vg_head h, double degrees)
{
    vg_err e;
    double positions[3 * JOINTS], turns[4 * JOINTS];
    *x = (stage){.h = h, .s = make_skeleton(LENGTH)};
    vg_skeleton_pose(&x->s, NULL, positions, turns);
    CHECK(vg_rig_make(&x->h.body.rig, &x->s, positions, turns, &e) == VG_OK);
    CHECK(x->h.body.rig.nbones == BONES);
    for (size_t k = 0; k < POSES; k++) {
        x->positions[k] = room(3 * JOINTS, sizeof(double)), x->turns[k] = room(4 * JOINTS, sizeof(double));
        x->transforms[k] = room(7 * BONES, sizeof(double)), x->poses[k] = room(3 * h.body.mesh.nv, sizeof(double));
        draw_values(x->values[k], degrees);
        vg_skeleton_pose(&x->s, x->values[k], x->positions[k], x->turns[k]);
        vg_rig_transforms(&x->h.body.rig, x->positions[k], x->turns[k], x->transforms[k]);
    }
}

static void strike(stage *x)
{
    for (size_t k = 0; k < POSES; k++) {
        free(x->positions[k]);
        free(x->turns[k]);
        free(x->transforms[k]);
        free(x->poses[k]);
    }
    vg_skeleton_clear(&x->s);
    vg_head_clear(&x->h);
}

/* Weights by hand: along z, from bone to bone over the joint. */
static void paint(vg_rig *r, size_t nv, const double *reference, double blend)
{
    free(r->skin_bone);
    free(r->skin_weight);
    r->skin_bone = room(VG_SKIN * nv, sizeof *r->skin_bone),
    r->skin_weight = room(VG_SKIN * nv, sizeof *r->skin_weight);
    for (size_t v = 0; v < nv; v++) {
        double at = reference[3 * v + 2] / LENGTH, near = round(at);
        double t = blend > 0 ? (at - near) / (2 * blend) + 0.5 : at > near;
        t = near < 1 ? 1 : near > BONES - 1 ? 0 : fmax(0, fmin(1, t));
        uint32_t up = (uint32_t)fmin(BONES - 1, fmax(0, near)), low = up ? up - 1 : 0;
        bool first = t >= 0.5;
        r->skin_bone[VG_SKIN * v] = first ? up : low, r->skin_weight[VG_SKIN * v] = first ? t : 1 - t;
        if (t > 0 && t < 1)
            r->skin_bone[VG_SKIN * v + 1] = first ? low : up, r->skin_weight[VG_SKIN * v + 1] = first ? 1 - t : t;
    }
}

static void skin_poses(stage *x)
{
    for (size_t k = 0; k < POSES; k++)
        vg_rig_skin(&x->h.body.rig, x->h.body.mesh.nv, x->h.body.reference, x->transforms[k], x->poses[k]);
}

/* The fit to all poses; the stage has its rig and map. */
static void fit_with(stage *x, vg_rig_method method, const vg_rig_options *o)
{
    vg_err e;
    vg_rig_fitter *f;
    vg_rig rig;
    vg_map map;
    CHECK(vg_head_prepare_vectors(&x->h, &e) == VG_OK);
    CHECK(vg_rig_fitter_new(&f, &x->h, o, &e) == VG_OK);
    vg_rig_fitter_add(f, POSES, (const double *const *)x->poses, (const double *const *)x->transforms);
    CHECK(vg_rig_fitter_finish(f, method, &rig, &map, &e) == VG_OK);
    vg_rig_fitter_free(&f);
    vg_head_put(&x->h, &rig, "rig");
    vg_head_put(&x->h, &map, "map");
}

static void fit(stage *x, vg_rig_method method, size_t bones, double refine, int threads)
{
    const vg_rig_options o = {bones, 0.03, refine, threads, false};
    fit_with(x, method, &o);
}

static void retarget(vg_head *h, const double *target)
{
    vg_err e;
    vg_map map;
    vg_rig rig;
    CHECK(vg_map_retarget(h, target, 1, 1, &map, &rig, h->body.reference, &e) == VG_OK);
    vg_head_put(h, &map, "map");
    vg_head_put(h, &rig, "rig");
}

/* The farthest that the map is from the poses. */
static double misses(const stage *x)
{
    vg_err e;
    vg_player *p;
    double most = 0, *out = room(3 * x->h.body.mesh.nv, sizeof *out), *outs[1] = {out};
    CHECK(vg_player_new(&p, &x->h.body, &x->h.map, false, 2, &e) == VG_OK);
    for (size_t k = 0; k < POSES; k++) {
        const double *t[1] = {x->transforms[k]};
        vg_player_pose(p, 1, t, outs);
        most = fmax(most, farthest(out, x->poses[k], x->h.body.mesh.nv));
    }
    vg_player_free(&p);
    free(out);
    return most;
}

/* One torus on each bone: components that move rigidly. */
static vg_head make_beads(void)
{
    vg_head h = new_shape();
    for (size_t b = 0; b < BONES; b++) add_torus(&h, 9, 7, (const double[3]){0, 0.3, LENGTH * ((double)b + 0.5)});
    return h;
}

static vg_head make_limb(void)
{
    return make_rod(16, 8, false); /* 2 pi * 16 / 8 = 12.57 long: the chain is 12 */
}

static void rigid_bodies_are_met(void)
{
    for (size_t bones = 1; bones <= 2; bones++)
        for (int method = 0; method < 2; method++) {
            stage x;
            set_stage(&x, make_beads(), 50);
            for (size_t k = 0; k < POSES; k++)
                for (size_t v = 0; v < x.h.body.mesh.nv;
                     v++) { /* by another road than the library's: two columns of a rotation matrix at a time */
                    double m[9], d[3];
                    size_t b = v / (x.h.body.mesh.nv / BONES);
                    vg_quat_matrix(x.turns[k] + 4 * b, m);
                    for (size_t i = 0; i < 3; i++) d[i] = x.h.body.reference[3 * v + i] - x.h.body.rig.at[3 * b + i];
                    for (size_t i = 0; i < 3; i++)
                        x.poses[k][3 * v + i] =
                            x.positions[k][3 * b + i] + m[3 * i] * d[0] + m[3 * i + 1] * d[1] + m[3 * i + 2] * d[2];
                }
            fit(&x, method ? VG_RIG_LBS : VG_RIG_ENVELOPE, bones, 0.003, 2);
            CHECK_NEAR(misses(&x), 0, 1e-9 * vg_diagonal(x.h.body.reference, x.h.body.mesh.nv));
            strike(&x);
        }
}

static void weights_are_found_again(void)
{
    stage x;
    set_stage(&x, make_limb(), 40);
    size_t nv = x.h.body.mesh.nv;
    paint(&x.h.body.rig, nv, x.h.body.reference, 0.3);
    skin_poses(&x);
    double *truth = room(nv * BONES, sizeof *truth), most = 0;
    for (size_t s = 0; s < VG_SKIN * nv; s++)
        truth[s / VG_SKIN * BONES + x.h.body.rig.skin_bone[s]] += x.h.body.rig.skin_weight[s];
    fit(&x, VG_RIG_LBS, 1, 0, 2);
    for (size_t v = 0; v < nv; v++) {
        double sum = 0;
        for (size_t s = VG_SKIN * v; s < VG_SKIN * (v + 1); s++) {
            double w = x.h.body.rig.skin_weight[s];
            CHECK(w >= 0 && (s % VG_SKIN == 0 || w <= x.h.body.rig.skin_weight[s - 1]));
            truth[v * BONES + x.h.body.rig.skin_bone[s]] -= w, sum += w;
        }
        CHECK_NEAR(sum, 1, 1e-12);
    }
    for (size_t i = 0; i < nv * BONES; i++) most = fmax(most, fabs(truth[i]));
    CHECK_NEAR(most, 0, 1e-5);
    CHECK_NEAR(misses(&x), 0, 1e-5);
    free(truth);
    strike(&x);
}

static void motions_are_found_again(void)
{
    stage x;
    vg_err e;
    vg_inverse_skin *b;
    set_stage(&x, make_limb(), 60);
    paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.2);
    skin_poses(&x);
    double *found[POSES];
    for (size_t k = 0; k < POSES; k++) found[k] = room(7 * BONES, sizeof(double));
    CHECK(vg_inverse_skin_new(&b, &x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 2, &e) == VG_OK);
    vg_inverse_skin_fit(b, POSES, (const double *const *)x.poses, found);
    for (size_t k = 0; k < POSES; k++)
        for (size_t j = 0; j < BONES; j++) {
            double *p = found[k] + 7 * j, *q = x.transforms[k] + 7 * j, dot = 0;
            for (int i = 0; i < 4; i++) dot += p[i] * q[i];
            CHECK_NEAR(fabs(dot), 1, 1e-13);
            for (int i = 4; i < 7; i++) CHECK_NEAR(p[i], q[i], 1e-6);
        }
    vg_inverse_skin_free(&b);
    for (size_t k = 0; k < POSES; k++) free(found[k]);
    strike(&x);
}

/* Any turn of the whole, and joints that bend far: found from wherever they are. */
static void far_motions_are_found_again(void)
{
    for (int trial = 0; trial < 5; trial++) {
        stage x;
        vg_err e;
        vg_inverse_skin *b;
        set_stage(&x, make_limb(), 150);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.1);
        skin_poses(&x);
        double *found[POSES], *again = room(3 * x.h.body.mesh.nv, sizeof *again);
        for (size_t k = 0; k < POSES; k++) found[k] = room(7 * BONES, sizeof(double));
        CHECK(vg_inverse_skin_new(&b, &x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 2, &e) == VG_OK);
        vg_inverse_skin_fit(b, POSES, (const double *const *)x.poses, found);
        for (size_t k = 0; k < POSES; k++) {
            vg_rig_skin(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, found[k], again);
            CHECK_NEAR(farthest(again, x.poses[k], x.h.body.mesh.nv), 0, 1e-5);
        }
        vg_inverse_skin_free(&b);
        for (size_t k = 0; k < POSES; k++) free(found[k]);
        free(again);
        strike(&x);
    }
}

/* A bone that moves no vertex, nor has any below it that does, goes with its parent. */
static void a_bone_without_vertices_goes_with_its_parent(void)
{
    enum { BARE = BONES - 1 };
    stage x;
    vg_err e;
    vg_inverse_skin *b;
    double found[7 * BONES], *founds[1] = {found};
    set_stage(&x, make_limb(), 60);
    size_t nv = x.h.body.mesh.nv;
    paint(&x.h.body.rig, nv, x.h.body.reference, 0);
    for (size_t v = 0; v < nv; v++)
        if (x.h.body.rig.skin_bone[VG_SKIN * v] == BARE) x.h.body.rig.skin_bone[VG_SKIN * v] = BARE - 1;
    skin_poses(&x);
    CHECK(vg_inverse_skin_new(&b, &x.h.body.rig, nv, x.h.body.reference, 1, &e) == VG_OK);
    for (size_t k = 0; k < POSES; k++) {
        vg_inverse_skin_fit(b, 1, (const double *const *)x.poses + k, founds);
        const double *p = found + 7 * BARE, *up = found + 7 * (BARE - 1), *truth = x.transforms[k] + 7 * (BARE - 1);
        CHECK_NEAR(fabs(p[0] * up[0] + p[1] * up[1] + p[2] * up[2] + p[3] * up[3]), 1, 1e-13);
        CHECK_NEAR(fabs(truth[0] * up[0] + truth[1] * up[1] + truth[2] * up[2] + truth[3] * up[3]), 1, 1e-13);
    }
    vg_inverse_skin_free(&b);
    strike(&x);
}

/* All of a stage in other units of length. */
static void change_units(stage *x, double unit)
{
    for (size_t i = 0; i < 3 * x->h.body.mesh.nv; i++) x->h.body.reference[i] *= unit;
    for (size_t j = 0; j < JOINTS; j++)
        for (size_t k = 0; k < 3; k++) {
            x->s.joints[j].offset[k] *= unit, x->h.body.rig.skeleton.joints[j].offset[k] *= unit;
            x->h.body.rig.at[3 * j + k] *= unit;
        }
    for (size_t n = 0; n < POSES; n++) {
        for (size_t i = 0; i < 3 * x->h.body.mesh.nv; i++) x->poses[n][i] *= unit;
        for (size_t i = 0; i < 3 * JOINTS; i++) x->positions[n][i] *= unit;
        for (size_t i = 0; i < 7 * BONES; i++)
            if (i % 7 > 3) x->transforms[n][i] *= unit;
    }
}

/* Powers of two, so that nothing is rounded: every fit gives the same but for the unit. */
static void units_do_not_matter(void)
{
    double miss[3], learned[3], turned[3][7 * BONES], shift[3][3], spread;
    for (int i = 0; i < 3; i++) {
        stage x;
        vg_err e;
        vg_inverse_skin *b;
        double unit = ldexp(1, i == 0 ? 0 : i == 1 ? -66 : 66), *found[1] = {turned[i]}; /* 1, 1e-20, 1e20 */
        meshes_state = 9;
        set_stage(&x, make_limb(), 60);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.2);
        skin_poses(&x);
        for (size_t k = 0; k < POSES; k++)
            for (size_t v = 0; v < 3 * x.h.body.mesh.nv; v++) x.poses[k][v] += 0.05 * sin(x.poses[k][v] * 3);
        change_units(&x, unit);
        CHECK(vg_inverse_skin_new(&b, &x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 1, &e) == VG_OK);
        vg_inverse_skin_fit(b, 1, (const double *const *)x.poses, found);
        vg_inverse_skin_free(&b);
        CHECK(vg_rig_locate(&x.s, x.h.body.mesh.nv, x.h.body.reference, POSES, (const double *const *)x.poses,
                            (const double *const *)x.positions, (const double *const *)x.turns, 1, shift[i], &spread,
                            &e) == VG_OK);
        fit(&x, VG_RIG_ENVELOPE, 2, 0.003, 1);
        miss[i] = misses(&x) / unit;
        CHECK(vg_rig_learn(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, POSES, (const double *const *)x.poses, 1, &learned[i], &e) == VG_OK);
        learned[i] /= unit;
        for (size_t k = 0; k < 7 * BONES; k++) turned[i][k] /= k % 7 > 3 ? unit : 1;
        for (int k = 0; k < 3; k++) shift[i][k] /= unit;
        strike(&x);
    }
    for (int i = 1; i < 3; i++) {
        CHECK_NEAR(miss[i], miss[0], 1e-12);
        CHECK_NEAR(learned[i], learned[0], 1e-9);
        for (int k = 0; k < 3; k++) CHECK_NEAR(shift[i][k], shift[0][k], 1e-12);
        for (size_t k = 0; k < 7 * BONES; k++) CHECK_NEAR(turned[i][k], turned[0][k], 1e-9);
    }
}

static void a_rig_is_learned_from_poses_alone(void)
{
    stage x;
    vg_err e;
    double miss;
    set_stage(&x, make_limb(), 40);
    paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.2);
    skin_poses(&x);
    CHECK(vg_rig_learn(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, POSES, (const double *const *)x.poses, 2, &miss, &e) == VG_OK);
    CHECK_NEAR(miss, 0, 1e-3 * vg_diagonal(x.h.body.reference, x.h.body.mesh.nv));
    strike(&x);
}

/* ---- bones without a skeleton ---- */

/* What a rig of free bones leaves of the poses, its motions found by themselves: the farthest. */
static double free_misses(const stage *x, const vg_rig *r, int threads)
{
    vg_err e;
    vg_free_bones *b;
    size_t nv = x->h.body.mesh.nv;
    double *out = room(3 * nv, sizeof *out), *found[POSES], most = 0;
    for (size_t k = 0; k < POSES; k++) found[k] = room(7 * r->nbones, sizeof(double));
    CHECK(vg_free_bones_new(&b, r, nv, x->h.body.reference, threads, &e) == VG_OK);
    vg_free_bones_fit(b, POSES, (const double *const *)x->poses, found);
    for (size_t k = 0; k < POSES; k++) {
        vg_rig_skin(r, nv, x->h.body.reference, found[k], out);
        most = fmax(most, farthest(out, x->poses[k], nv));
        free(found[k]);
    }
    vg_free_bones_free(&b);
    free(out);
    return most;
}

/* Four bodies that move rigidly are four bones, however many are asked for, and are met. */
static void rigid_bodies_are_bones(void)
{
    for (size_t wanted = BONES; wanted <= 7; wanted += 3) {
        stage x;
        vg_err e;
        vg_rig r;
        double miss;
        set_stage(&x, make_beads(), 50);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0);
        skin_poses(&x);
        double d = vg_diagonal(x.h.body.reference, x.h.body.mesh.nv);
        CHECK(vg_rig_decompose(&r, x.h.body.mesh.nv, x.h.body.reference, wanted, POSES,
                               (const double *const *)x.poses, 2, &miss, &e) == VG_OK);
        CHECK(r.nbones >= BONES && r.nbones <= wanted);
        CHECK(wanted > BONES || r.nbones == BONES);
        CHECK_NEAR(miss, 0, 1e-7 * d); /* the square root of rounding in sums of squares */
        CHECK_NEAR(free_misses(&x, &r, 2), 0, 1e-9 * d);
        CHECK_TEXT(r.skeleton.joints[0].name, "bone001");
        vg_rig_clear(&r);
        strike(&x);
    }
}

/* A limb that was skinned by four bones needs no more than that many; one bone is the best rigid motion of all. */
static void a_skinned_limb_is_decomposed(void)
{
    stage x;
    vg_err e;
    vg_rig r, one;
    double miss, rigid, *first = NULL;
    set_stage(&x, make_limb(), 40);
    paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.2);
    skin_poses(&x);
    size_t nv = x.h.body.mesh.nv;
    double d = vg_diagonal(x.h.body.reference, nv);
    for (int threads = 1; threads <= 3; threads++) {
        CHECK(vg_rig_decompose(&r, nv, x.h.body.reference, BONES, POSES, (const double *const *)x.poses, threads,
                               &miss, &e) == VG_OK);
        CHECK_NEAR(miss, 0, 2e-3 * d);
        if (!first) first = room(VG_SKIN * nv, sizeof *first), memcpy(first, r.skin_weight, VG_SKIN * nv * sizeof *first);
        CHECK(!memcmp(first, r.skin_weight, VG_SKIN * nv * sizeof *first));
        vg_rig_clear(&r);
    }
    CHECK(vg_rig_decompose(&one, nv, x.h.body.reference, 1, POSES, (const double *const *)x.poses, 1, &rigid, &e) ==
          VG_OK);
    CHECK(one.nbones == 1 && rigid > 10 * miss);
    CHECK(vg_rig_decompose(&r, nv, x.h.body.reference, 0, POSES, (const double *const *)x.poses, 1, &miss, &e) ==
          VG_EARG);
    CHECK(vg_rig_decompose(&r, nv, x.h.body.reference, nv + 1, POSES, (const double *const *)x.poses, 1, &miss, &e) ==
          VG_EARG);
    CHECK(vg_rig_decompose(&r, nv, x.h.body.reference, 1, 0, NULL, 1, &miss, &e) == VG_EINPUT && !r.nbones);
    vg_rig_clear(&one);
    free(first);
    strike(&x);
}

/* Wanted vectors by each corner's own bones, held vertices by their skin, and the solver:
 * what the matrix stands for. */
static void the_map_is_its_chain(void)
{
    for (size_t per = 1; per <= 2; per++) {
        stage x;
        vg_err e;
        set_stage(&x, make_limb(), 40);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.2);
        skin_poses(&x);
        for (size_t k = 0; k < POSES; k++) /* skin that skinning does not know */
            for (size_t i = 0; i < 3 * x.h.body.mesh.nv; i++) x.poses[k][i] += 0.05 * sin(x.poses[k][i] * 3);
        fit(&x, VG_RIG_ENVELOPE, per, 0, 2);
        const vg_map *m = &x.h.map;
        size_t nv = x.h.body.mesh.nv;
        vg_graph *g = graph_of(&x.h);
        vg_solver *s;
        vg_player *p;
        CHECK(m->nheld >= BONES && m->per_corner == per && m->ncorners == vg_graph_corners(g));
        CHECK(vg_solver_new(&s, g, m->held, m->nheld, x.h.body.reference, VG_WEIGHTS_UNIFORM, 1, &e) == VG_OK);
        CHECK(vg_player_new(&p, &x.h.body, &x.h.map, false, 1, &e) == VG_OK);
        double *vectors = vectors_of(g, x.h.body.reference), *wanted = room(3 * m->ncorners, sizeof *wanted);
        double *held = room(3 * m->nheld, sizeof *held), *skin = room(3 * nv, sizeof *skin);
        double *chain = room(3 * nv, sizeof *chain), *rhs = room(3 * nv, sizeof *rhs),
               *out = room(3 * nv, sizeof *out), *outs[1] = {out};
        for (size_t k = 0; k < POSES; k++) {
            const double *t[1] = {x.transforms[k]}, *w[1] = {wanted}, *r[1] = {rhs}, *a[1] = {held};
            double *c[1] = {chain}, *load[1] = {rhs};
            CHECK(g->nlinks == 0);
            memset(wanted, 0, 3 * m->ncorners * sizeof *wanted);
            for (size_t i = 0; i < m->ncorners * per; i++) {
                double d[3];
                vg_quat_apply(m->corner + 4 * i, vectors + 3 * (i / per), d);
                vg_quat_apply(x.transforms[k] + 7 * m->corner_bone[i], d, d);
                for (size_t q = 0; q < 3; q++) wanted[3 * (i / per) + q] += d[q];
            }
            vg_rig_skin(&x.h.body.rig, nv, x.h.body.reference, x.transforms[k], skin);
            vg_graph_anchors(skin, m->held, m->nheld, held);
            vg_solver_load(s, 1, w, a, c, load);
            vg_solver_solve(s, 1, r, c, a, NULL);
            vg_player_pose(p, 1, t, outs);
            CHECK_NEAR(farthest(out, chain, nv), 0, 1e-9 * vg_diagonal(x.h.body.reference, nv));
        }
        free(vectors);
        free(wanted);
        free(held);
        free(skin);
        free(chain);
        free(rhs);
        free(out);
        vg_player_free(&p);
        vg_solver_free(&s);
        vg_graph_free(&g);
        strike(&x);
    }
}

/* Without poses a vertex goes with the bone that it is beside. */
static void near_bones(void)
{
    stage x;
    vg_err e;
    set_stage(&x, make_limb(), 40);
    CHECK(vgi_skin_near(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, &e) == VG_OK);
    for (size_t v = 0; v < x.h.body.mesh.nv; v++) {
        double at = x.h.body.reference[3 * v + 2] / LENGTH;
        CHECK(x.h.body.rig.skin_weight[VG_SKIN * v] == 1 && x.h.body.rig.skin_weight[VG_SKIN * v + 1] == 0);
        if (fabs(at - round(at)) > 1e-6)
            CHECK(x.h.body.rig.skin_bone[VG_SKIN * v] == (uint32_t)fmin(BONES - 1, floor(at)));
    }
    strike(&x);
}

/* However few vertices are to be held: some of each component are. */
static void every_component_is_held(void)
{
    stage x;
    const vg_rig_options o = {1, 0, 0, 1, false};
    set_stage(&x, make_beads(), 40);
    size_t each = x.h.body.mesh.nv / BONES, held[BONES] = {0};
    paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0);
    skin_poses(&x);
    fit_with(&x, VG_RIG_ENVELOPE, &o);
    for (size_t i = 0; i < x.h.map.nheld; i++) held[x.h.map.held[i] / each]++;
    for (size_t b = 0; b < BONES; b++) CHECK(held[b] > 0);
    strike(&x);
}

/* Where skin is blended two bones for a corner come nearer than one. */
static void two_bones_come_nearer(void)
{
    double miss[3];
    for (size_t per = 1; per <= 2; per++) {
        stage x;
        meshes_state = 11;
        set_stage(&x, make_limb(), 40);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.4);
        skin_poses(&x);
        fit(&x, VG_RIG_ENVELOPE, per, 0, 1);
        miss[per] = misses(&x);
        strike(&x);
    }
    CHECK(miss[2] < 0.5 * miss[1]);
}

static void refinement_brings_nearer(void)
{
    double miss[2];
    for (int i = 0; i < 2; i++) {
        stage x;
        meshes_state = 7;
        set_stage(&x, make_limb(), 40);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.4);
        skin_poses(&x);
        fit(&x, VG_RIG_ENVELOPE, 1, i ? 0.003 : 0, 2);
        miss[i] = misses(&x);
        strike(&x);
    }
    CHECK(miss[0] > 1e-3);
    CHECK_NEAR(miss[1], 0, 0.6 * miss[0]);
}

static void the_root_is_found(void)
{
    stage x;
    vg_err e;
    double shift[3], spread;
    static const double away[3] = {0.7, -2, 0.4};
    set_stage(&x, make_limb(), 40);
    size_t nv = x.h.body.mesh.nv;
    paint(&x.h.body.rig, nv, x.h.body.reference, 0.2);
    skin_poses(&x);
    for (size_t i = 0; i < 3 * nv; i++) x.h.body.reference[i] += away[i % 3]; /* the skeleton does not know */
    CHECK(vg_rig_locate(&x.s, nv, x.h.body.reference, POSES, (const double *const *)x.poses,
                        (const double *const *)x.positions, (const double *const *)x.turns, 2, shift, &spread,
                        &e) == VG_OK);
    for (int k = 0; k < 3; k++) CHECK_NEAR(shift[k], away[k], 1e-9);
    CHECK_NEAR(spread, 0, 1e-9);
    strike(&x);
}

/* Where most vertices move in no rigid way, those that do say where the root is; and how far these are apart, their
 * median says. */
static void the_root_is_found_among_others(void)
{
    stage x;
    vg_err e;
    double shift[3], spread;
    set_stage(&x, make_beads(), 40);
    size_t nv = x.h.body.mesh.nv, each = nv / BONES;
    paint(&x.h.body.rig, nv, x.h.body.reference, 0);
    for (size_t v = 0; v < nv; v++) x.h.body.rig.skin_bone[VG_SKIN * v] = (uint32_t)(v / each);
    skin_poses(&x);
    for (size_t k = 0; k < POSES; k++)
        for (size_t v = 0; v < nv; v++)
            if (v % 5 < 3) x.poses[k][3 * v] += 1 + noise(); /* all the same way */
    CHECK(vg_rig_locate(&x.s, nv, x.h.body.reference, POSES, (const double *const *)x.poses,
                        (const double *const *)x.positions, (const double *const *)x.turns, 2, shift, &spread,
                        &e) == VG_OK);
    for (int k = 0; k < 3; k++) CHECK_NEAR(shift[k], 0, 1e-9);
    CHECK_NEAR(spread, 0, 1e-9);
    /* every vertex is rigid, but a reference that was stretched evenly: opinions from 0 to 1 in x */
    skin_poses(&x);
    for (size_t v = 0; v < nv; v++) x.h.body.reference[3 * v] += (double)v / (double)nv;
    CHECK(vg_rig_locate(&x.s, nv, x.h.body.reference, POSES, (const double *const *)x.poses,
                        (const double *const *)x.positions, (const double *const *)x.turns, 2, shift, &spread,
                        &e) == VG_OK);
    CHECK_NEAR(shift[0], 0.5, 0.1);
    CHECK_NEAR(spread, 0.25, 0.1);
    strike(&x);
}

/* The same skeleton gives the transforms back; a larger one, too;
 * one that rests in another pose when they are aligned. */
static void other_skeletons_drive(void)
{
    stage x;
    vg_err e;
    vg_driver *d;
    vg_driver_options plain = {.align = VG_ALIGN_NONE}, aligned = {.align = VG_ALIGN_ALL};
    double t[7 * BONES];
    set_stage(&x, make_limb(), 40);
    CHECK(vg_driver_new(&d, &x.h.body.rig, &x.s, &plain, &e) == VG_OK);
    CHECK(vg_driver_missing(d) == 0);
    for (size_t k = 0; k < POSES; k++) {
        vg_driver_pose(d, x.positions[k], x.turns[k], t);
        for (size_t i = 0; i < 7 * BONES; i++) CHECK_NEAR(t[i], x.transforms[k][i], 1e-12);
    }
    vg_driver_free(&d);
    vg_skeleton large = make_skeleton(10 * LENGTH), bent = make_skeleton(LENGTH);
    double positions[3 * JOINTS], turns[4 * JOINTS], values[6 + 3 * (BONES - 1)];
    CHECK(vg_driver_new(&d, &x.h.body.rig, &large, &plain, &e) == VG_OK);
    memcpy(values, x.values[0], sizeof values);
    for (int k = 0; k < 3; k++) values[k] *= 10;
    vg_skeleton_pose(&large, values, positions, turns);
    vg_driver_pose(d, positions, turns, t);
    for (size_t i = 0; i < 7 * BONES; i++) CHECK_NEAR(t[i], x.transforms[0][i], 1e-12);
    vg_driver_free(&d);
    for (size_t j = 1; j < JOINTS; j++)
        memcpy(bent.joints[j].offset, (const double[3]){LENGTH, 0, 0}, sizeof bent.joints[j].offset);
    CHECK(vg_driver_new(&d, &x.h.body.rig, &bent, &aligned, &e) == VG_OK);
    vg_skeleton_pose(&bent, NULL, positions, turns);
    vg_driver_pose(d, positions, turns, t);
    for (size_t b = 0; b < BONES; b++) { /* every joint of the rig is where the other's is */
        double at[3];
        vg_quat_apply(t + 7 * b, x.h.body.rig.at + 3 * b, at);
        for (size_t k = 0; k < 3; k++) CHECK_NEAR(at[k] + t[7 * b + 4 + k], positions[3 * b + k], 1e-12);
    }
    vg_driver_free(&d);
    free(large.joints[1].name);
    large.joints[1].name = strdup("nothing alike");
    CHECK(vg_driver_new(&d, &x.h.body.rig, &large, &plain, &e) == VG_OK);
    CHECK(vg_driver_missing(d) == 1);
    vg_driver_free(&d);
    for (size_t j = 0; j < JOINTS; j++) large.joints[j].name[0] = '?';
    CHECK(vg_driver_new(&d, &x.h.body.rig, &large, &plain, &e) == VG_EINPUT && strstr(e.message, "'hip'"));
    vg_skeleton_clear(&large);
    vg_skeleton_clear(&bent);
    strike(&x);
}

/* Two skeletons of n joints in a row; of each joint of the first the joint of the second. */
static void pair_rows(size_t n, const char *const *of, size_t m, const char *const *by, const int *expected)
{
    vg_joint joints[2][16] = {{{0}}};
    vg_skeleton s[2] = {{n, joints[0]}, {m, joints[1]}};
    uint32_t partner[16];
    vg_err e;
    for (int i = 0; i < 2; i++)
        for (size_t j = 0; j < s[i].njoints; j++)
            joints[i][j] = (vg_joint){(char *)(i ? by : of)[j], j ? (uint32_t)j - 1 : UINT32_MAX, {0, 1, 0}, 3, {4, 5, 6}};
    CHECK(vg_skeleton_pair(&s[0], &s[1], partner, &e) == VG_OK);
    for (size_t j = 0; j < n; j++) CHECK((int)partner[j] == expected[j]);
}

/* Names, then parts of the body; chains of other lengths end together, fingers begin together. */
static void joints_find_their_partners(void)
{
    static const char *const cmu[] = {"Hips", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head", "LeftShoulder",
                                      "LeftArm", "LeftForeArm", "LeftHand", "LThumb", "LHipJoint"};
    static const char *const unreal[] = {"root", "pelvis", "spine_01", "spine_02", "neck_01", "head", "clavicle_l",
                                         "upperarm_l", "upperarm_twist_01_l", "lowerarm_l", "hand_l", "thumb_01_l",
                                         "thumb_02_l"};
    pair_rows(13, cmu, 13, unreal, (const int[]){1, 2, 3, 3, 4, 4, 5, 6, 7, 9, 10, 11, -1});
    pair_rows(13, unreal, 13, cmu, (const int[]){-1, 0, 2, 3, 5, 6, 7, 8, -1, 9, 10, 11, 11});
    pair_rows(3, (const char *const[]){"b", "spine", "a"}, 3, (const char *const[]){"a", "b", "c"},
              (const int[]){1, -1, 0}); /* any order */
    /* a shoulder is a clavicle beside an arm, and the arm itself above an elbow */
    pair_rows(3, (const char *const[]){"L_Collar", "L_Shoulder", "L_Elbow"}, 3,
              (const char *const[]){"shoulder.L", "upper_arm.L", "forearm.L"}, (const int[]){0, 1, 2});
    /* beside an arm on the other side, a shoulder without an arm is a clavicle */
    pair_rows(4, (const char *const[]){"RightShoulder", "RightArm", "RightForeArm", "LeftShoulder"}, 4,
              (const char *const[]){"clavicle_r", "upperarm_r", "clavicle_l", "upperarm_l"}, (const int[]){0, 1, -1, 2});
    pair_rows(4, (const char *const[]){"LeftShoulder", "LeftArm", "LeftForeArm", "RightShoulder"}, 4,
              (const char *const[]){"clavicle_r", "upperarm_r", "clavicle_l", "upperarm_l"}, (const int[]){2, 3, -1, 0});
    /* a hip is the middle of the body, or a thigh */
    pair_rows(3, (const char *const[]){"Hip", "r_hip", "RightKnee"}, 3,
              (const char *const[]){"Hips", "RightUpLeg", "RightLeg"}, (const int[]){0, 1, 2});
    pair_rows(2, (const char *const[]){"ring", "LeftToe_End"}, 2, (const char *const[]){"LeftHandRing1", "LeftToeBase"},
              (const int[]){-1, -1}); /* no side, no finger; an end is no toe */
}

/* A joint with two children on one line, as a hip between two legs may be: what they leave open, the turn about that
 * line, is not made up. */
static void a_line_leaves_nothing_to_chance(void)
{
    for (int trial = 0; trial < 20; trial++) {
        vg_err e;
        vg_rig r;
        vg_driver *d;
        vg_skeleton s = make_skeleton(LENGTH);
        double way[3] = {noise(), noise(), noise()}, positions[3 * JOINTS], turned[4 * JOINTS], t[7 * BONES];
        s.joints[2].parent = 0, s.joints[3].parent = 0, s.joints[4].parent = 3;
        for (size_t j = 2; j < JOINTS; j++)
            for (int k = 0; k < 3; k++) s.joints[j].offset[k] = j == 2 ? 2 * way[k] : j == 3 ? -way[k] : 0.5 * way[k];
        memcpy(s.joints[1].offset, way, sizeof way);
        vg_skeleton_pose(&s, NULL, positions, turned);
        CHECK(vg_rig_make(&r, &s, positions, turned, &e) == VG_OK);
        CHECK(vg_driver_new(&d, &r, &s, &(vg_driver_options){.align = VG_ALIGN_ALL}, &e) == VG_OK);
        vg_driver_pose(d, positions, turned, t);
        for (size_t b = 0; b < BONES; b++) CHECK_NEAR(fabs(t[7 * b]), 1, 1e-12); /* it rests as it does */
        vg_driver_free(&d);
        vg_rig_clear(&r);
        vg_skeleton_clear(&s);
    }
}

static void edits_turn_what_hangs_on_a_bone(void)
{
    stage x;
    double t[7 * BONES] = {0}, axis[3], at[3];
    set_stage(&x, make_limb(), 40);
    for (size_t b = 0; b < BONES; b++) t[7 * b] = 1;
    CHECK(vg_rig_find(&x.h.body.rig, "knee") == 1 && vg_rig_find(&x.h.body.rig, "toe.end") == BONES);
    CHECK(vg_rig_axis(&x.h.body.rig, 3, axis));
    CHECK_NEAR(axis[2], 1, 1e-15);
    vg_rig_edit(&x.h.body.rig, 1, (const double[3]){1, 0, 0}, 90, t);
    CHECK_NEAR(t[0], 1, 0); /* the hip stays */
    vg_quat_apply(t + 7 * 3, (const double[3]){0, 0, 3 * LENGTH},
                  at); /* the toe, 2 bones beyond the knee, goes from z to -y */
    CHECK_NEAR(at[0] + t[25], 0, 1e-12);
    CHECK_NEAR(at[1] + t[26], -2 * LENGTH, 1e-12);
    CHECK_NEAR(at[2] + t[27], LENGTH, 1e-12);
    vg_rig_edit(&x.h.body.rig, 2, axis, 30, t); /* a twist leaves the bone where it is */
    vg_quat_apply(t + 7 * 3, (const double[3]){0, 0, 3 * LENGTH}, at);
    CHECK_NEAR(at[1] + t[26], -2 * LENGTH, 1e-12);
    vg_quat_apply(t + 7 * 2, (const double[3]){1, 0, 2 * LENGTH},
                  at); /* and turns what is beside it about it: -y here */
    CHECK_NEAR(at[0] + t[18], cos(M_PI / 6), 1e-12);
    CHECK_NEAR(at[2] + t[20], LENGTH + sin(M_PI / 6), 1e-12);
    strike(&x);
}

static void rotations_alone_say_where_bones_are(void)
{
    stage x;
    vg_err e;
    vg_player *p;
    set_stage(&x, make_limb(), 40);
    paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.2);
    skin_poses(&x);
    fit(&x, VG_RIG_ENVELOPE, 2, 0.003, 1);
    CHECK(vg_player_new(&p, &x.h.body, &x.h.map, false, 1, &e) == VG_OK);
    double t[7 * BONES], shift[3];
    memcpy(t, x.transforms[0], sizeof t);
    vg_player_place(p, t); /* they hang together already: nothing moves */
    for (size_t i = 0; i < 7 * BONES; i++) CHECK_NEAR(t[i], x.transforms[0][i], 1e-9);
    for (size_t b = 0; b < BONES; b++)
        for (size_t k = 0; k < 3; k++) t[7 * b + 4 + k] += noise();
    vg_player_place(p, t);
    for (size_t k = 0; k < 3; k++) shift[k] = t[4 + k] - x.transforms[0][4 + k];
    for (size_t b = 0; b < BONES; b++) /* they hang together again: all are shifted alike */
        for (size_t k = 0; k < 3; k++) CHECK_NEAR(t[7 * b + 4 + k] - x.transforms[0][7 * b + 4 + k], shift[k], 1e-9);
    vg_player_free(&p);
    strike(&x);
}

/* Onto a body that is twice as large and elsewhere: everything is twice as large. */
static void a_rig_serves_another_body(void)
{
    for (int method = 0; method < 2; method++) {
        stage x;
        vg_err e;
        set_stage(&x, make_limb(), 40);
        size_t nv = x.h.body.mesh.nv;
        paint(&x.h.body.rig, nv, x.h.body.reference, 0.2);
        skin_poses(&x);
        fit(&x, method ? VG_RIG_LBS : VG_RIG_ENVELOPE, 2, 0.003, 1);
        double *target = room(3 * nv, sizeof *target), *before = room(3 * nv, sizeof *before),
               *after = room(3 * nv, sizeof *after);
        double *list[1] = {before}, t[7 * BONES];
        vg_player *p;
        for (size_t i = 0; i < 3 * nv; i++) target[i] = 2 * x.h.body.reference[i] + (double)(i % 3);
        const double *from[1] = {x.transforms[0]};
        CHECK(vg_player_new(&p, &x.h.body, &x.h.map, false, 1, &e) == VG_OK);
        vg_player_pose(p, 1, from, list);
        vg_player_free(&p);
        retarget(&x.h, target);
        for (size_t j = 0; j < JOINTS; j++)
            for (size_t k = 0; k < 3; k++)
                CHECK_NEAR(x.h.body.rig.at[3 * j + k], (k == 2 ? 2 * LENGTH * (double)j : 0) + (double)k, 1e-6);
        for (size_t j = 0; j < JOINTS; j++)
            for (size_t k = 0; k < 3; k++) x.positions[0][3 * j + k] = 2 * x.positions[0][3 * j + k] + (double)k;
        vg_rig_transforms(&x.h.body.rig, x.positions[0], x.turns[0], t);
        from[0] = t, list[0] = after;
        CHECK(vg_player_new(&p, &x.h.body, &x.h.map, false, 1, &e) == VG_OK);
        vg_player_pose(p, 1, from, list);
        vg_player_free(&p);
        for (size_t i = 0; i < 3 * nv; i++) before[i] = 2 * before[i] + (double)(i % 3);
        CHECK_NEAR(farthest(before, after, nv), 0, 1e-5);
        free(target);
        free(before);
        free(after);
        strike(&x);
    }
}

/* A joint goes with the vertices that its bones share: a second body that is near it, and another bone's, goes away
 * alone. The reference pose is not that of the skeleton: lengths of bones are told as the skeleton tells them. */
static void joints_go_with_their_own(void)
{
    stage x;
    vg_err e;
    vg_head h = make_limb();
    size_t limb = h.body.mesh.nv;
    add_torus(&h, 9, 7, (const double[3]){0, 0, LENGTH}); /* around the knee, a little wider than the limb */
    for (size_t i = 3 * limb; i < 3 * h.body.mesh.nv; i++) h.body.reference[i] *= i % 3 == 2 ? 1 : 1.2;
    set_stage(&x, h, 40);
    size_t nv = x.h.body.mesh.nv;
    paint(&x.h.body.rig, nv, x.h.body.reference, 0.3);
    for (size_t v = limb; v < nv; v++) {
        memset(x.h.body.rig.skin_weight + VG_SKIN * v, 0, VG_SKIN * sizeof(double));
        x.h.body.rig.skin_bone[VG_SKIN * v] = BONES - 1, x.h.body.rig.skin_weight[VG_SKIN * v] = 1;
    }
    skin_poses(&x);
    vg_rig turned; /* it rests in the first pose */
    CHECK(vg_rig_make(&turned, &x.s, x.positions[0], x.turns[0], &e) == VG_OK);
    turned.skin_bone = x.h.body.rig.skin_bone, turned.skin_weight = x.h.body.rig.skin_weight;
    x.h.body.rig.skin_bone = NULL, x.h.body.rig.skin_weight = NULL;
    vg_rig_clear(&x.h.body.rig);
    x.h.body.rig = turned;
    memcpy(x.h.body.reference, x.poses[0], 3 * nv * sizeof(double));
    for (size_t k = 0; k < POSES; k++) vg_rig_transforms(&x.h.body.rig, x.positions[k], x.turns[k], x.transforms[k]);
    fit(&x, VG_RIG_LBS, 1, 0, 1);
    double *target = room(3 * nv, sizeof *target), positions[3 * JOINTS], turned_to[4 * JOINTS];
    for (size_t i = 0; i < 3 * nv; i++)
        target[i] = i < 3 * limb ? 2 * x.h.body.reference[i] : x.h.body.reference[i] + 9;
    retarget(&x.h, target);
    for (size_t i = 3; i < 9; i++) /* knee and foot are in the limb */
        CHECK_NEAR(x.h.body.rig.at[i], 2 * x.positions[0][i], 0.05);
    vg_skeleton_pose(&x.h.body.rig.skeleton, x.values[0], positions, turned_to);
    for (size_t j = 1; j < JOINTS; j++)
        for (size_t k = 0; k < 3; k++)
            CHECK_NEAR(positions[3 * j + k] - positions[k], x.h.body.rig.at[3 * j + k] - x.h.body.rig.at[k], 1e-12);
    free(target);
    strike(&x);
}

/* Groups of four vertices of a limb that bends rigidly: turns and places by an independent formula. */
static void joints_of_vertices_find_themselves(void)
{
    stage x;
    vg_err e;
    set_stage(&x, make_beads(), 50);
    size_t each = x.h.body.mesh.nv / BONES;
    uint32_t list[BONES][4];
    vg_joint_group groups[BONES];
    for (uint32_t b = 0; b < BONES; b++) {
        for (uint32_t i = 0; i < 4; i++) list[b][i] = (uint32_t)(b * each + i * 11);
        groups[b] = (vg_joint_group){
            .name = x.s.joints[b].name, .parent = b ? b - 1 : UINT32_MAX, .nvertices = 4, .vertices = list[b]};
    }
    vg_joint_groups g = {BONES, groups};
    vg_skeleton s;
    double positions[3 * BONES], turns[4 * BONES], *pose = room(3 * x.h.body.mesh.nv, sizeof *pose),
                                                   q[4] = {0.8, 0.36, 0, 0.48};
    CHECK(vg_joint_groups_skeleton(&g, x.h.body.mesh.nv, x.h.body.reference, &s, &e) == VG_OK);
    CHECK(s.njoints == BONES && s.joints[2].parent == 1 && s.joints[2].nchannels == 3 && s.joints[0].nchannels == 6);
    for (size_t v = 0; v < x.h.body.mesh.nv; v++) { /* all of it turned and moved */
        vg_quat_apply(q, x.h.body.reference + 3 * v, pose + 3 * v);
        pose[3 * v] += 4;
    }
    vg_joint_groups_pose(&g, x.h.body.reference, pose, positions, turns);
    for (size_t b = 0; b < BONES; b++) {
        double dot = 0, at[3] = {0, 0, 0};
        for (int i = 0; i < 4; i++) dot += q[i] * turns[4 * b + (size_t)i];
        CHECK_NEAR(fabs(dot), 1, 1e-12);
        for (int i = 0; i < 4; i++)
            for (size_t k = 0; k < 3; k++) at[k] += pose[3 * (size_t)list[b][i] + k] / 4;
        for (size_t k = 0; k < 3; k++) CHECK_NEAR(positions[3 * b + k], at[k], 1e-12);
    }
    list[3][0] = (uint32_t)x.h.body.mesh.nv;
    vg_skeleton_clear(&s);
    CHECK(vg_joint_groups_skeleton(&g, x.h.body.mesh.nv, x.h.body.reference, &s, &e) == VG_EINPUT &&
          strstr(e.message, "'toe'"));
    free(pose);
    strike(&x);
}

static void threads_do_not_matter(void)
{
    double *first = NULL;
    for (int threads = 1; threads <= 3; threads++) {
        stage x;
        meshes_state = 3;
        set_stage(&x, make_limb(), 40);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.3);
        skin_poses(&x);
        fit(&x, VG_RIG_ENVELOPE, 2, 0.003, threads);
        size_t n = x.h.body.mesh.nv * 4 * BONES;
        if (!first) {
            first = room(n, sizeof *first);
            memcpy(first, x.h.map.weights, n * sizeof *first);
        }
        CHECK(!memcmp(first, x.h.map.weights, n * sizeof *first));
        strike(&x);
    }
    free(first);
}

/* The sums of a trial with the ridges 0, 0.003 and 0.3, fitted to all but the last poses, judged on these. */
static void try_ridges(const stage *x, size_t bones, const double *ridge, size_t left, double *const *sums)
{
    vg_err e;
    vg_rig_fitter *f;
    size_t fitted = POSES - left;
    const vg_rig_options trial = {bones, 0.03, 1, 2, true};
    CHECK(vg_rig_fitter_new(&f, &x->h, &trial, &e) == VG_OK);
    vg_rig_fitter_add(f, fitted, (const double *const *)x->poses, (const double *const *)x->transforms);
    CHECK(vg_rig_fitter_try(f, 3, ridge, &e) == VG_OK);
    CHECK(vg_rig_fitter_judge(f, left, (const double *const *)x->poses + fitted,
                              (const double *const *)x->transforms + fitted, sums, &e) == VG_OK);
    vg_rig_fitter_free(&f);
}

/* The same from maps that are played. */
static void check_trial(stage *x, size_t bones, double ridge, size_t left, const double *sums)
{
    vg_err e;
    size_t nv = x->h.body.mesh.nv, fitted = POSES - left;
    double *out[2], *mine = room(2 * nv, sizeof *mine), scale = 0;
    vg_player *p[2];
    vg_map map[2];
    vg_rig rig;
    vg_rig_fitter *f;
    const vg_rig_options o = {bones, 0.03, ridge, 1, false};
    CHECK(vg_rig_fitter_new(&f, &x->h, &o, &e) == VG_OK);
    vg_rig_fitter_add(f, fitted, (const double *const *)x->poses, (const double *const *)x->transforms);
    for (int way = 0; way < 2; way++) {
        CHECK(vg_rig_fitter_finish(f, way ? VG_RIG_ENVELOPE : VG_RIG_LBS, &rig, &map[way], &e) == VG_OK);
        vg_head_put(&x->h, &rig, "rig");
        CHECK(vg_player_new(&p[way], &x->h.body, &map[way], false, 1, &e) == VG_OK);
        out[way] = room(3 * nv, sizeof(double));
    }
    for (size_t k = fitted; k < POSES; k++) {
        for (int way = 0; way < 2; way++) vg_player_pose(p[way], 1, (const double *const *)x->transforms + k, &out[way]);
        for (size_t i = 0; i < 3 * nv; i++) {
            double s = out[0][i] - x->poses[k][i], d = out[1][i] - out[0][i];
            mine[i / 3 * 2] += s * d, mine[i / 3 * 2 + 1] += d * d;
        }
    }
    for (size_t i = 0; i < 2 * nv; i++) scale = fmax(scale, fabs(mine[i]));
    CHECK(scale > 0);
    for (size_t i = 0; i < 2 * nv; i++) CHECK_NEAR(sums[i], mine[i], 1e-9 * scale);
    for (int way = 0; way < 2; way++) {
        vg_player_free(&p[way]);
        vg_map_clear(&map[way]);
        free(out[way]);
    }
    vg_rig_fitter_free(&f);
    free(mine);
}

/* What a trial says of poses left out is what the maps do that are fitted without them. */
static void trials_are_maps(void)
{
    static const double ridge[3] = {0, 0.003, 0.3};
    for (size_t bones = 1; bones <= 2; bones++) {
        stage x;
        vg_err e;
        double *sums[3];
        set_stage(&x, make_limb(), 40);
        paint(&x.h.body.rig, x.h.body.mesh.nv, x.h.body.reference, 0.4);
        skin_poses(&x);
        for (size_t k = 0; k < POSES; k++)
            for (size_t i = 0; i < 3 * x.h.body.mesh.nv; i++) x.poses[k][i] += 0.02 * noise();
        CHECK(vg_head_prepare_vectors(&x.h, &e) == VG_OK);
        for (size_t i = 0; i < 3; i++) sums[i] = room(2 * x.h.body.mesh.nv, sizeof(double));
        try_ridges(&x, bones, ridge, 3, sums);
        for (size_t i = 0; i < 3; i++) {
            check_trial(&x, bones, ridge[i], 3, sums[i]);
            free(sums[i]);
        }
        strike(&x);
    }
}

static void what_cannot_be_fitted_is_refused(void)
{
    stage x;
    vg_err e;
    vg_rig_fitter *f;
    vg_rig rig;
    vg_map map;
    set_stage(&x, make_limb(), 40);
    const vg_rig_options three = {3, 0.03, 0, 1, false}, one = {1, 0.03, 0, 1, false}, trial = {1, 0.03, 0, 1, true};
    CHECK(vg_rig_fitter_new(&f, &x.h, &three, &e) == VG_EARG);
    CHECK(vg_rig_fitter_new(&f, &x.h, &one, &e) == VG_EARG && strstr(e.message, "links"));
    CHECK(vg_head_prepare_vectors(&x.h, &e) == VG_OK);
    CHECK(vg_rig_fitter_new(&f, &x.h, &one, &e) == VG_OK);
    const double *poses[1] = {x.h.body.reference}, *transforms[1] = {x.transforms[0]};
    vg_rig_fitter_add(f, 1, poses, transforms); /* the reference says nothing */
    CHECK(vg_rig_fitter_finish(f, VG_RIG_ENVELOPE, &rig, &map, &e) == VG_EINPUT && !map.n && strstr(e.message, "no poses"));
    CHECK(vg_rig_fitter_try(f, 1, &one.refine, &e) == VG_EINPUT);
    CHECK(vg_rig_fitter_judge(f, 1, poses, transforms, NULL, &e) == VG_EARG);
    vg_rig_fitter_free(&f);
    CHECK(vg_rig_fitter_new(&f, &x.h, &trial, &e) == VG_OK);
    vg_rig_fitter_add(f, 1, (const double *const *)x.poses, transforms);
    CHECK(vg_rig_fitter_finish(f, VG_RIG_LBS, &rig, &map, &e) == VG_EARG && strstr(e.message, "trial"));
    vg_rig_fitter_free(&f);
    vg_rig_clear(&x.h.body.rig);
    CHECK(vg_rig_fitter_new(&f, &x.h, &one, &e) == VG_EINPUT);
    for (size_t j = 0; j < JOINTS; j++) x.s.joints[j].nchannels = 0;
    CHECK(vg_rig_make(&x.h.body.rig, &x.s, x.positions[0], x.turns[0], &e) == VG_EINPUT);
    strike(&x);
}

TESTS({"rigid bodies are met", rigid_bodies_are_met}, {"weights are found again", weights_are_found_again},
      {"motions are found again", motions_are_found_again},
      {"far motions are found again", far_motions_are_found_again},
      {"a bone without vertices goes with its parent", a_bone_without_vertices_goes_with_its_parent},
      {"units do not matter", units_do_not_matter},
      {"a rig is learned from poses alone", a_rig_is_learned_from_poses_alone},
      {"rigid bodies are bones", rigid_bodies_are_bones},
      {"a skinned limb is decomposed", a_skinned_limb_is_decomposed},
      {"the map is its chain", the_map_is_its_chain}, {"near bones", near_bones},
      {"every component is held", every_component_is_held}, {"two bones come nearer", two_bones_come_nearer},
      {"refinement brings nearer", refinement_brings_nearer},
      {"the root is found", the_root_is_found},
      {"the root is found among others", the_root_is_found_among_others},
      {"other skeletons drive", other_skeletons_drive},
      {"joints find their partners", joints_find_their_partners},
      {"a line leaves nothing to chance", a_line_leaves_nothing_to_chance},
      {"edits turn what hangs on a bone", edits_turn_what_hangs_on_a_bone},
      {"rotations alone say where bones are", rotations_alone_say_where_bones_are},
      {"a rig serves another body", a_rig_serves_another_body},
      {"joints go with their own", joints_go_with_their_own},
      {"joints of vertices find themselves", joints_of_vertices_find_themselves},
      {"threads do not matter", threads_do_not_matter}, {"trials are maps", trials_are_maps},
      {"what cannot be fitted is refused", what_cannot_be_fitted_is_refused})
