/* bone_edits.c: --edit of vg-play: parses rotations of single bones, finds the bones in a rig, and rotates them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "bone_edits.h"

#include <string.h>

struct bone_edit {
    char *bone;
    char axis; /* 'x', 'y', 'z'; 't': about the bone itself */
    double degrees;
    size_t number;    /* of the bone in the rig */
    double around[3]; /* unit vector of the axis in the reference pose */
};

void bone_edits_take(const char *text, void *edits)
{
    bone_edits *e = edits;
    char *copy = cli_copy_text(text, "the edits");
    e->at = cli_resize(e->at, e->n + 1, sizeof *e->at, "the edits");
    char *angle = strrchr(copy, ' ');
    if (angle) *angle++ = 0;
    char *axis = angle ? strrchr(copy, ' ') : NULL;
    if (axis) *axis++ = 0;
    bool twist = axis && !strcmp(axis, "twist");
    if (!axis || !*copy || !(twist || (strlen(axis) == 1 && strchr("xyz", *axis))))
        cli_usage("--edit is 'BONE x|y|z|twist DEGREES', not '%s'", text);
    e->at[e->n++] = (struct bone_edit){
        .bone = copy, .axis = twist ? 't' : *axis, .degrees = cli_parse_number("--edit", angle)};
}

static const char *bone_name(const void *rig, size_t i)
{
    const vg_rig *r = rig;
    return r->skeleton.joints[r->bone[i]].name;
}

static void refuse_bone(const char *bone, const vg_rig *r, const char *operand) __attribute__((noreturn));
static void refuse_bone(const char *bone, const vg_rig *r, const char *operand)
{
    size_t likely = cli_likely(bone, strlen(bone), r->nbones, bone_name, r);
    if (likely < r->nbones) cli_usage("the rig has no bone '%s': did you mean '%s'?", bone, bone_name(r, likely));
    cli_usage("the rig has no bone '%s': 'vg-info %s' lists them", bone, operand);
}

/* Axes x, y and z are those of the skeleton's pose without rotations; they move with the bone. */
static void find_bone(struct bone_edit *edit, const vg_rig *r, const char *operand)
{
    edit->number = vg_rig_find(r, edit->bone);
    if (edit->number == r->nbones) refuse_bone(edit->bone, r, operand);
    if (edit->axis != 't') {
        double unit[3] = {edit->axis == 'x', edit->axis == 'y', edit->axis == 'z'};
        vg_quat_apply(r->turn + 4 * (size_t)r->bone[edit->number], unit, edit->around);
    } else if (!vg_rig_axis(r, edit->number, edit->around)) {
        cli_usage("bone '%s' has no end to twist towards: turn it about x, y or z", edit->bone);
    }
}

void bone_edits_find(bone_edits *e, const vg_map *map, const vg_rig *rig, const char *operand)
{
    if (!e->n) return;
    if (map->kind != VG_MAP_BONES)
        cli_stop(VG_EINPUT, "'%s' is a map of patches, --edit needs one of bones: make it with vg-fitmap --skeleton",
                 operand);
    for (size_t i = 0; i < e->n; i++) find_bone(&e->at[i], rig, operand);
}

void bone_edits_apply(const bone_edits *e, const vg_rig *rig, double *transforms)
{
    for (size_t i = 0; i < e->n; i++)
        vg_rig_edit(rig, e->at[i].number, e->at[i].around, e->at[i].degrees, transforms);
}
