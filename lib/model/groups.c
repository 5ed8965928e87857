/* groups.c: a skeleton that follows a mesh: its joints are means of vertices (T 5.1). The text format that names the
 * vertices is in lib/io.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/vec3.h"
#include "numeric/polar.h"

#include <math.h>
#include <stdlib.h>

static void mean_position(const vg_joint_group *group, const double *pose, double at[3])
{
    at[0] = at[1] = at[2] = 0;
    for (size_t i = 0; i < group->nvertices; i++)
        for (size_t k = 0; k < 3; k++) at[k] += pose[3 * (size_t)group->vertices[i] + k] / (double)group->nvertices;
}

int vg_joint_groups_skeleton(const vg_joint_groups *g, size_t nv, const double *reference, vg_skeleton *s, vg_err *e)
{
    *s = (vg_skeleton){0};
    for (size_t j = 0; j < g->n; j++)
        for (size_t i = 0; i < g->at[j].nvertices; i++)
            if (g->at[j].vertices[i] >= nv)
                return vg_fail(e, VG_EINPUT, "joint '%.80s' names vertex %u, but the mesh has %zu vertices", g->at[j].name,
                               g->at[j].vertices[i], nv);
    if (!(s->joints = vgi_array(g->n, sizeof *s->joints, e))) return VG_ENOMEM;
    for (; s->njoints < g->n; s->njoints++) {
        const vg_joint_group *group = &g->at[s->njoints];
        vg_joint *joint = &s->joints[s->njoints];
        bool root = group->parent == UINT32_MAX;
        static const uint8_t channels[6] = {1, 2, 3, 6, 4, 5};
        double above[3] = {0, 0, 0};
        if (!(joint->name = vgi_copy_string(group->name, strlen(group->name), e))) {
            vg_skeleton_clear(s);
            return VG_ENOMEM;
        }
        joint->parent = group->parent;
        joint->nchannels = root ? 6 : 3;
        memcpy(joint->channels, root ? channels : channels + 3, joint->nchannels);
        mean_position(group, reference, joint->offset);
        if (!root) mean_position(&g->at[group->parent], reference, above);
        vgi_deduct(joint->offset, above);
    }
    return VG_OK;
}

/* b += weight * d r', with d and r normalised */
static void add_pair(double b[9], double weight, const double d[3], const double r[3])
{
    double x = vgi_dot(d, d), y = vgi_dot(r, r);
    if (!(x > 0 && y > 0)) return;
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) b[3 * k + l] += weight * d[k] * r[l] / sqrt(x * y);
}

/* the part of x perpendicular to u */
static void reject(const double u[3], double x[3])
{
    double along = vgi_dot(u, x), square = vgi_dot(u, u);
    if (square > 0) vgi_add_scaled(x, -(along / square), u);
}

static void turn_joint(const vg_joint_groups *g, size_t j, const double *reference, const double *pose,
                       const double *positions, double *turns)
{
    static const double unturned[4] = {1, 0, 0, 0};
    const vg_joint_group *group = &g->at[j];
    double b[9] = {0}, rest[3], d[3], r[3], below[2][3];
    size_t children = 0;
    mean_position(group, reference, rest);
    for (size_t c = j + 1; c < g->n; c++) {
        double at[3];
        if (g->at[c].parent != j) continue;
        mean_position(&g->at[c], reference, at);
        vgi_subtract(at, rest, r);
        vgi_subtract(positions + 3 * c, positions + 3 * j, d);
        add_pair(b, 1, d, r);
        memcpy(below[0], d, sizeof d);
        memcpy(below[1], r, sizeof r);
        children++;
    }
    for (size_t i = 0; i < (children == 1 ? 1 : group->nvertices); i++) {
        vgi_subtract(pose + 3 * (size_t)group->vertices[i], positions + 3 * j, d);
        vgi_subtract(reference + 3 * (size_t)group->vertices[i], rest, r);
        if (children == 1)
            reject(below[0], d), reject(below[1], r); /* perpendicular to the bone: the frame is met exactly */
        add_pair(b, children == 1 ? 1 : 0.01, d, r);
    }
    /* what the vertices leave undetermined follows the parent */
    vgi_best_turn_near(b, 1e-9, group->parent == UINT32_MAX ? unturned : turns + 4 * (size_t)group->parent,
                       turns + 4 * j);
}

void vg_joint_groups_pose(const vg_joint_groups *g, const double *reference, const double *pose, double *positions,
                          double *turns)
{
    for (size_t j = 0; j < g->n; j++) mean_position(&g->at[j], pose, positions + 3 * j);
    for (size_t j = 0; j < g->n; j++) turn_joint(g, j, reference, pose, positions, turns);
}
