/* vg/markers.h: small text files about a mesh: pairs of vertices, dense correspondences, joints as groups of vertices.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_MARKERS_H
#define VG_PART_MARKERS_H

#include "vg/body.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A pair of corresponding vertices. */
typedef struct vg_marker {
    uint32_t source, target;
    char *name;  /* NULL: it has none */
    size_t line; /* line in the file, from 1; 0: not from a file */
} vg_marker;

typedef struct vg_markers {
    size_t n;
    vg_marker *at;
} vg_markers;

void vg_markers_clear(vg_markers *m);
/* vg_markers_read: text with a pair per line, "SOURCE TARGET" or "NAME SOURCE TARGET"; '#' starts a comment.
 * `base` is the number of the first vertex, 0 or 1. Messages call the file `name`. */
int vg_markers_read(vg_markers *m, const void *data, size_t n, int base, const char *name, vg_err *e) VG_MUST_CHECK;

/* A vertex and its position on another mesh: the weighted mean of three vertices, possibly the same vertex three
 * times. */
typedef struct vg_seed {
    uint32_t vertex, on[3];
    double weight[3];
} vg_seed;

/* vg_seeds_read: a dense correspondence as text: "VERTEX A B C WA WB WC" per line, '-' for a vertex that has none. *n
 * seeds, free(). */
int vg_seeds_read(vg_seed **seeds, size_t *n, const void *data, size_t bytes, int base, const char *name,
                  vg_err *e) VG_MUST_CHECK;

/* Joints as groups of mesh vertices (T 5.1): a joint is the mean of its vertices in any pose; the first of them
 * gives the roll of its bone. */
typedef struct vg_joint_group {
    char *name;
    uint32_t parent;    /* less than its own number; UINT32_MAX: a root */
    size_t nvertices;   /* > 0 */
    uint32_t *vertices; /* in the order of the file, without duplicates */
    size_t line;        /* of the file, from 1 */
} vg_joint_group;

typedef struct vg_joint_groups {
    size_t n;
    vg_joint_group *at;
} vg_joint_groups;

void vg_joint_groups_clear(vg_joint_groups *g);
/* vg_joint_groups_read: text with a joint per line, "JOINT PARENT vertices VERTEX VERTEX ...", '-' for no parent,
 * '#' starts a comment. Parents may follow their children in the file; they are sorted first. The caller checks
 * that the vertices exist. `base` is the number of the first vertex, 0 or 1. `name` is used in messages. */
int vg_joint_groups_read(vg_joint_groups *g, const void *data, size_t n, int base, const char *name,
                         vg_err *e) VG_MUST_CHECK;

/* vg_joint_groups_skeleton: the joints in a pose of nv vertices as a skeleton. VG_EINPUT if a vertex does not
 * exist. */
int vg_joint_groups_skeleton(const vg_joint_groups *g, size_t nv, const double *reference, vg_skeleton *s,
                             vg_err *e) VG_MUST_CHECK;
/* vg_joint_groups_pose: positions of the joints in a pose, and their rotations relative to the reference pose:
 * with one child, that of the frame of bone and roll (T 5.1); else the rotation that fits the children and the
 * group's vertices best. */
void vg_joint_groups_pose(const vg_joint_groups *g, const double *reference, const double *pose, double *positions,
                          double *turns);

#ifdef __cplusplus
}
#endif
#endif
