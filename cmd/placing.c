/* placing.c: --axes, --scale, --unit, --mirror and --origin of vg-encode: poses are rotated, scaled, mirrored and
 * moved, in this order.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "placing.h"
#include "units.h"

#include <stdlib.h>
#include <string.h>

/* ---- options ---- */

/* Right, up and towards the viewer as axes with signs: "xyz" is y up, "xz-y" is z up. */
static const char *take_triple(const char *p, double rows[9])
{
    bool used[3] = {false};
    memset(rows, 0, 9 * sizeof *rows);
    for (size_t row = 0; row < 3; row++) {
        double sign = *p == '-' ? -1 : 1;
        p += *p == '-';
        if (*p < 'x' || *p > 'z' || used[*p - 'x']) return NULL;
        used[*p - 'x'] = true;
        rows[3 * row + (size_t)(*p++ - 'x')] = sign;
    }
    return p;
}

static const char *take_side(const char *p, double rows[9])
{
    if (!strncmp(p, "y-up", 4)) return take_triple("xyz", rows), p + 4;
    if (!strncmp(p, "z-up", 4)) return take_triple("xz-y", rows), p + 4;
    return take_triple(p, rows);
}

static double axes_determinant(const double m[9])
{
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
           m[2] * (m[3] * m[7] - m[4] * m[6]);
}

void placing_take_axes(const char *text, void *context)
{
    placing *p = context;
    double from[9], to[9];
    const char *end;
    if (!strcmp(text, "y-up") || !strcmp(text, "z-up")) {
        take_side(*text == 'y' ? "z-up" : "y-up", from);
        end = take_side(text, to);
    } else {
        end = take_side(text, from);
        end = end && *end == ':' ? take_side(end + 1, to) : NULL;
    }
    if (!end || *end)
        cli_usage("option '--axes' needs y-up, z-up or FROM:TO, each of them y-up, z-up or three axes (right, up, "
                  "towards the viewer) such as xz-y, not '%s'", text);
    if (axes_determinant(from) * axes_determinant(to) < 0)
        cli_usage("--axes %s would mirror the body: reverse one of the axes", text);
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) {
            p->axes[3 * i + k] = 0;
            for (size_t row = 0; row < 3; row++) p->axes[3 * i + k] += to[3 * row + i] * from[3 * row + k];
        }
    memcpy(p->up, to + 3, sizeof p->up);
}

void placing_take_unit(const char *text, void *context)
{
    placing *p = context;
    size_t n = strcspn(text, ":");
    double from = unit_metres(text, n), to = text[n] ? unit_metres(text + n + 1, strlen(text + n + 1)) : 0;
    if (from <= 0 || to <= 0)
        cli_usage("option '--unit' needs FROM:TO, such as cm:m, of " UNITS_LIST ", not '%s'", text);
    p->unit = from / to;
}

void placing_take_mirror(const char *text, void *context)
{
    placing *p = context;
    if (!*text || text[1] || *text < 'x' || *text > 'z') cli_usage("option '--mirror' needs x, y or z, not '%s'", text);
    p->mirror = *text - 'x' + 1;
}

bool placing_wanted(const placing *p)
{
    return p->mirror || p->axes[0] != 0 || p->axes[1] != 0 || p->axes[2] != 0 || p->scale > 0 || p->unit > 0 || p->origin;
}

/* ---- poses ---- */

static void turn_and_scale(const placing *p, double *x)
{
    for (size_t v = 0; v < p->nv; v++, x += 3) {
        double y[3];
        for (size_t k = 0; k < 3; k++)
            y[k] = p->matrix[3 * k] * x[0] + p->matrix[3 * k + 1] * x[1] + p->matrix[3 * k + 2] * x[2];
        memcpy(x, y, sizeof y);
    }
}

static void place_point(const placing *p, double *x)
{
    for (size_t i = 0; i < 3 * p->nv; i++) x[i] += p->shift[i % 3];
}

static void mirror(const placing *p, double *x)
{
    if (!p->mirror || !p->nv) return;
    vg_mirror_pose(&p->mirrored, x, p->room);
    memcpy(x, p->room, 3 * p->nv * sizeof *x);
}

void placing_frame(const placing *p, vg_frame *f)
{
    turn_and_scale(p, f->values);
    mirror(p, f->values);
    place_point(p, f->values);
}

/* ---- the mirror ---- */

static void read_pairs(vg_markers *pairs, const char *file)
{
    vg_err e;
    size_t n;
    char *data = cli_read_file(file, &n);
    if (vg_markers_read(pairs, data, n, 0, file, &e) < 0) cli_die(&e);
    free(data);
}

static void find_mirror(placing *p, const vg_body *b)
{
    vg_err e;
    vg_markers pairs = {0};
    bool file = p->pairs && strcmp(p->pairs, "auto");
    if (file) read_pairs(&pairs, p->pairs);
    double D = vg_diagonal(b->reference, b->mesh.nv);
    if (vg_mirror_find(&p->mirrored, &b->mesh, b->reference, (size_t)p->mirror - 1, file ? &pairs : NULL, &e) < 0)
        cli_stop(e.code, "%s%s", e.message, file ? "" : "; name them with --pairs FILE");
    vg_markers_clear(&pairs);
    const vg_mirror *m = &p->mirrored;
    p->room = cli_allocate(3 * p->nv, sizeof *p->room, "a mirrored pose");
    cli_note("the mirror is at %c = %.6g; the two sides of the rest pose differ by %.3g %% of D on average, at most %.3g %% at vertex %u",
             (int)('w' + p->mirror), m->plane, 100 * m->mean / D, 100 * m->largest / D, m->farthest);
    if (m->broken * 50 > m->edges)
        cli_warn("%zu of %zu edges have no edge on the other side: the mesh is not symmetric", m->broken, m->edges);
}

/* ---- the head ---- */

static void make_matrix(placing *p)
{
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    bool turned = p->axes[0] != 0 || p->axes[1] != 0 || p->axes[2] != 0;
    double factor = (p->scale > 0 ? p->scale : 1) * (p->unit > 0 ? p->unit : 1);
    for (size_t i = 0; i < 9; i++) p->matrix[i] = factor * (turned ? p->axes : identity)[i];
}

static void find_shift(placing *p, const double *reference)
{
    double centre[3];
    size_t up = p->up[0] != 0 ? 0 : p->up[2] != 0 ? 2 : 1;
    double sign = p->up[up] < 0 ? -1 : 1;
    if (!p->origin) return;
    vg_centroid(reference, p->nv, centre);
    if (!strcmp(p->origin, "floor")) {
        for (size_t v = 0; v < p->nv; v++)
            if (v == 0 || sign * reference[3 * v + up] < sign * centre[up]) centre[up] = reference[3 * v + up];
    } else if (strcmp(p->origin, "centre") && cli_parse_numbers(p->origin, centre, 3) != 3) {
        cli_usage("option '--origin' needs centre, floor or X,Y,Z, not '%s'", p->origin);
    }
    for (size_t k = 0; k < 3; k++) p->shift[k] = -centre[k];
}

void placing_head(placing *p, vg_head *h)
{
    if (h->body.skeleton.njoints)
        cli_stop(VG_EINPUT, "the input is a skeleton: --axes, --scale, --unit, --mirror and --origin are for meshes");
    p->nv = h->body.mesh.nv;
    make_matrix(p);
    turn_and_scale(p, h->body.reference);
    if (p->mirror) find_mirror(p, &h->body);
    mirror(p, h->body.reference);
    find_shift(p, h->body.reference);
    place_point(p, h->body.reference);
    vg_rig_clear(&h->body.rig);
    vg_map_clear(&h->map);
}
