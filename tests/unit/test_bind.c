/* test_bind.c: a mesh that rides on another one: with rigid motion and stretch as in closed form; what the binding holds.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"

/* n x n squares over [0, side]^2 at `height` */
static vg_head make_sheet(uint32_t n, double low, double side, double height)
{
    vg_head h = new_shape();
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t k = 0; k <= n; k++) add_vertex(&h, low + side * i / n, low + side * k / n, height);
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t k = 0; k < n; k++) {
            uint32_t a = i * (n + 1) + k;
            FACE(&h, a, a + 1, a + n + 2, a + n + 1);
        }
    return h;
}

typedef struct riding {
    vg_head source, target;
    vg_correspondence c;
    vg_rider *rider;
    double *out;
} riding;

static riding start(vg_head source, vg_head target)
{
    riding r = {.source = source, .target = target};
    vg_err e;
    const vg_body *s = &r.source.body, *t = &r.target.body;
    if (vg_bind(&r.c, &s->mesh, s->reference, &t->mesh, t->reference, 2, &e) < 0) abort();
    return r;
}

static const double *ride(riding *r, const double *pose)
{
    const vg_body *s = &r->source.body, *t = &r->target.body;
    vg_err e;
    if (!r->rider && vg_rider_new(&r->rider, &s->mesh, s->reference, &r->c, &t->mesh, t->reference, 2, &e) < 0) abort();
    if (!r->out) r->out = room(3 * t->mesh.nv, sizeof *r->out);
    vg_rider_apply(r->rider, pose, r->out);
    return r->out;
}

static void end(riding *r)
{
    vg_rider_free(&r->rider);
    CHECK(r->rider == NULL);
    vg_head_put(&r->source, &r->c, "correspondence");
    vg_head_clear(&r->source);
    vg_head_clear(&r->target);
    free(r->out);
}

/* Every face of the target has source faces whose weights sum to 1, and says how far it is away. */
static void test_binding(void)
{
    riding r = start(make_torus(20, 12), make_torus(9, 5));
    CHECK(vg_is_bound(&r.c));
    CHECK(r.c.target_nf == 45 && r.c.source_nf == 240);
    for (size_t f = 0; f < r.c.target_nf; f++) {
        double sum = 0;
        CHECK(r.c.first[f + 1] > r.c.first[f]);
        for (uint32_t i = r.c.first[f]; i < r.c.first[f + 1]; i++) {
            CHECK(r.c.source[i] < r.c.source_nf && r.c.weight[i] > 0);
            sum += r.c.weight[i];
        }
        CHECK_NEAR(sum, 1, 1e-12);
        CHECK(r.c.distance[f] < 0.35 && r.c.matched[f] == VG_BOUND);
    }
    end(&r);
}

/* In the rest pose the target rests; it turns and shifts with the source. */
static void test_rigid(void)
{
    riding r = start(make_torus(20, 12), make_torus(9, 5));
    const vg_body *s = &r.source.body, *t = &r.target.body;
    CHECK_NEAR(farthest(ride(&r, s->reference), t->reference, t->mesh.nv), 0, 1e-13);
    for (int k = 1; k < 4; k++) {
        const motion m = turn(k, 1, 3 * k);
        double *pose = move_points(&m, s->reference, s->mesh.nv), *expected = move_points(&m, t->reference, t->mesh.nv);
        CHECK_NEAR(farthest(ride(&r, pose), expected, t->mesh.nv), 0, 1e-12);
        free(pose), free(expected);
    }
    end(&r);
}

/* A sheet over a sheet that gets three times as wide: three times as wide itself, and as high above it as before. */
static void test_stretch(void)
{
    riding r = start(make_sheet(8, 0, 4, 0), make_sheet(5, 1, 2, 0.25));
    const vg_body *s = &r.source.body, *t = &r.target.body;
    double *pose = room(3 * s->mesh.nv, sizeof *pose);
    for (size_t v = 0; v < s->mesh.nv; v++)
        for (size_t k = 0; k < 3; k++) pose[3 * v + k] = (k == 0 ? 3 : 1) * s->reference[3 * v + k];
    const double *out = ride(&r, pose);
    for (size_t v = 0; v < t->mesh.nv; v++) {
        CHECK_NEAR(out[3 * v], 3 * t->reference[3 * v], 1e-12);
        CHECK_NEAR(out[3 * v + 1], t->reference[3 * v + 1], 1e-12);
        CHECK_NEAR(out[3 * v + 2], 0.25, 1e-12);
    }
    end(&r);
    free(pose);
}

/* Half of the source lifted: what rides on the other half, out of its reach, stays. */
static void test_local(void)
{
    riding r = start(make_sheet(16, 0, 4, 0), make_sheet(6, 0.25, 1, 0.1));
    const vg_body *s = &r.source.body, *t = &r.target.body;
    double *pose = room(3 * s->mesh.nv, sizeof *pose);
    memcpy(pose, s->reference, 3 * s->mesh.nv * sizeof *pose);
    for (size_t v = 0; v < s->mesh.nv; v++) pose[3 * v + 2] = pose[3 * v] > 2.5 ? pose[3 * v] - 2.5 : 0;
    CHECK_NEAR(farthest(ride(&r, pose), t->reference, t->mesh.nv), 0, 1e-13);
    end(&r);
    free(pose);
}

static void test_refused(void)
{
    vg_head line = new_shape(), sheet = make_sheet(2, 0, 1, 0), none = new_shape(), other = make_sheet(3, 0, 1, 0);
    vg_correspondence c;
    vg_rider *rider;
    vg_err e;
    for (int v = 0; v < 4; v++) add_vertex(&line, v, 0, 0);
    FACE(&line, 0, 1, 2, 3);
    add_vertex(&none, 0, 0, 0);
    CHECK(vg_bind(&c, &line.body.mesh, line.body.reference, &sheet.body.mesh, sheet.body.reference, 1, &e) == VG_EINPUT);
    CHECK(strstr(e.message, "no face of the source has an area") != NULL);
    CHECK(vg_bind(&c, &sheet.body.mesh, sheet.body.reference, &none.body.mesh, none.body.reference, 1, &e) == VG_EINPUT);
    CHECK(vg_bind(&c, &sheet.body.mesh, sheet.body.reference, &other.body.mesh, other.body.reference, 1, &e) == VG_OK);
    CHECK(vg_rider_new(&rider, &other.body.mesh, other.body.reference, &c, &other.body.mesh, other.body.reference, 1, &e) ==
          VG_EINPUT);
    CHECK(rider == NULL);
    vg_head_put(&none, &c, "correspondence");
    vg_head_clear(&line), vg_head_clear(&sheet), vg_head_clear(&none), vg_head_clear(&other);
}

TESTS({"the binding", test_binding}, {"rigid motion", test_rigid}, {"stretch", test_stretch},
      {"what moves elsewhere", test_local}, {"what is refused", test_refused})
