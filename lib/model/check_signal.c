/* check_signal.c: conditions on a signal beyond what every reader checks, so that it can be evaluated.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/artefact.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_FRAMES = 1 << 20 }; /* the thin plate needs a matrix of frames by sites */
static const double farthest = 1e100; /* squared distances in the plane, and their sums, stay finite */

static bool within(const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!(fabs(x[i]) <= farthest)) return false;
    return true;
}

/* For shapes that are not vertices. The number of turns is checked against the graph (vg_unshaper_new). */
static const char *refuse_turns(const vg_signal *s)
{
    bool homes = s->space == VG_SPACE_VECTORS || s->space == VG_SPACE_GRADIENTS;
    if (s->examples) return "only shapes of vertices can be sums of examples";
    if (!s->rooted) return "the kind of its shapes is unknown";
    return homes == (s->nturns > 0) ? NULL : "its turns are not those of its shape space";
}

static const char *refuse_counts(const vg_signal *s, const vg_mesh *mesh)
{
    if (s->n < 2) return "it has fewer than 2 frames";
    if (s->n > MOST_FRAMES) return "it has too many frames";
    if (s->k < 4) return "its curve has fewer than 4 control points";
    if (s->l < 1 || s->l > s->n) return "it has no sites, or more than frames";
    if (s->space < VG_SPACE_VERTICES || s->space > VG_SPACE_LENGTHS) return "its shape space is not known";
    if (s->space == VG_SPACE_VERTICES && s->d != 3 * mesh->nv) return "its shapes are not of this mesh";
    if (s->bits != 64 && s->bits != 32 && s->bits != 16) return "the precision of its basis is not known";
    if (s->space != VG_SPACE_VERTICES) return refuse_turns(s);
    if (s->nturns && !(s->examples && s->rooted)) return "its shapes have no turns";
    if (s->nturns && s->nturns - 1 != s->m) return "its turns are not those of its examples";
    return NULL;
}

static const char *refuse_curve(const vg_signal *s)
{
    for (size_t i = 0; i + 1 < s->n; i++)
        if (!(s->parameter[i] < s->parameter[i + 1])) return "its parameters do not ascend";
    for (size_t i = 0; i <= s->k; i++)
        if (!(s->knot[i] <= s->knot[i + 1])) return "its knots fall";
    if (!(s->knot[2] < s->knot[s->k - 1])) return "its knots span an empty interval";
    if (!within(s->knot, s->k + 2) || !within(s->parameter, s->n)) return "a knot is too large";
    return within(s->control, 2 * s->k) ? NULL : "a control point is too far away";
}

static const char *refuse_sites(const vg_signal *s, bool *used)
{
    for (size_t i = 0; i < s->l; i++) {
        if (s->site[i] >= s->n) return "a site is not a frame";
        if (used[s->site[i]]) return "a frame is a site twice";
        used[s->site[i]] = true;
    }
    return within(s->position, 2 * s->n) ? NULL : "a frame is too far away in the plane";
}

int vgi_check_signal(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_signal *s = artefact;
    const char *why = s->layout > VG_LAYOUT_PLACED ? "its layout is not known" : refuse_counts(s, &h->body.mesh);
    if (!why) why = refuse_curve(s);
    if (!why) {
        bool *used = vgi_array(s->n, sizeof *used, e);
        if (!used) return VG_ENOMEM;
        why = refuse_sites(s, used);
        free(used);
    }
    if (!why && s->nturns && !vgi_are_turns(s->home_turn, s->nturns)) why = "a turn is not a unit quaternion";
    if (!why && s->rooted && !vgi_are_turns(s->turn, s->n)) why = "a turn is not a unit quaternion";
    for (size_t j = 0; !why && s->bits == 16 && j < s->m; j++)
        if (!(s->basis_unit[j] > 0)) why = "a unit of its basis is not positive";
    return why ? vgi_wrong(where, why, e) : VG_OK;
}
