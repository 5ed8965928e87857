/* driving.c: --align and --joints of vg-play and vg-deform. lib/method/rig pairs joints by name and aligns limbs.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "driving.h"
#include "lines.h"

#include <stdlib.h>
#include <string.h>

enum { NAMED = 8 }; /* limbs that a message names: all of a body */

static size_t find_joint(const vg_skeleton *s, const char *name, size_t length)
{
    size_t j = 0;
    while (j < s->njoints && (strncmp(s->joints[j].name, name, length) || s->joints[j].name[length])) j++;
    return j;
}

static const char *joint_name(const void *skeleton, size_t i)
{
    return ((const vg_skeleton *)skeleton)->joints[i].name;
}

/* ": did you mean 'Head'?", or nothing when no joint has a name like this one */
static const char *advise(char to[120], const vg_skeleton *s, const char *name, size_t length)
{
    size_t likely = cli_likely(name, length, s->njoints, joint_name, s);
    to[0] = 0;
    if (likely < s->njoints) snprintf(to, 120, ": did you mean '%.80s'?", s->joints[likely].name);
    return to;
}

/* ---- --align ---- */

static bool *choose_bones(const char *names, const vg_skeleton *s, const char *map)
{
    bool *chosen = cli_allocate(s->njoints, sizeof *chosen, "the joints");
    char advice[120];
    for (const char *at = names;; at++) {
        size_t n = strcspn(at, ","), j = find_joint(s, at, n);
        if (j == s->njoints)
            cli_usage("--align: '%s' has no bone '%.*s'%s", map, (int)(n < 80 ? n : 80), at, advise(advice, s, at, n));
        chosen[j] = true;
        at += n;
        if (!*at) return chosen;
    }
}

static void read_align(const driving_options *o, const vg_skeleton *s, const char *map, vg_driver_options *to,
                       bool **chosen)
{
    const char *text = o->align ? o->align : "auto";
    if (!strcmp(text, "auto")) to->align = VG_ALIGN_AUTO;
    else if (!strcmp(text, "none")) to->align = VG_ALIGN_NONE;
    else if (!strcmp(text, "all")) to->align = VG_ALIGN_ALL;
    else to->align = VG_ALIGN_CHOSEN, to->chosen = *chosen = choose_bones(text, s, map);
}

/* "LeftArm (49 degrees), LeftForeArm (60) and 4 more" */
static void note_aligned(const vg_driver *d, const vg_skeleton *s, const char *map)
{
    char list[600] = "";
    size_t n = 0, at = 0;
    for (size_t j = 0; j < s->njoints; j++) {
        double degrees = vg_driver_aligned(d, j);
        if (!(degrees > 0.5) || ++n > NAMED) continue;
        at += (size_t)snprintf(list + at, sizeof list - at, "%s%.40s (%.0f%s)", n > 1 ? ", " : "", s->joints[j].name,
                               degrees, n > 1 ? "" : " degrees");
    }
    if (n > NAMED) snprintf(list + at, sizeof list - at, " and %zu more", n - NAMED);
    if (n) cli_warn("the skeleton of the input rests in another pose than '%s': aligned %s; --align none leaves them", map, list);
}

static const char *axis_name(int axis)
{
    static const char *const names[] = {"-z", "-y", "-x", "", "x", "y", "z"};
    return names[axis + 3];
}

static void note_stance(const vg_driver *d, const char *map)
{
    vg_stance s;
    vg_driver_stands(d, &s);
    const char *faces = s.faces ? ", and it faces another way" : "";
    if (s.rests && s.moves)
        cli_warn("the skeleton of the input rests with %s up, unlike '%s': its motion is turned upright%s; --align none leaves it",
                 axis_name(s.rests), map, faces);
    else if (s.moves)
        cli_warn("the skeleton of the input moves with %s up, unlike '%s': its motion is turned upright%s; --align none leaves it",
                 axis_name(s.moves), map, faces);
    else if (s.rests)
        cli_warn("the skeleton of the input rests with %s up, unlike '%s', but moves with the same axis up: only its rest pose is "
                 "turned%s; --align none leaves it", axis_name(s.rests), map, faces);
    else if (s.faces)
        cli_warn("the skeleton of the input rests facing another way than '%s', which is made up for; --align none leaves it", map);
}

/* "..., also LeftArm, LeftForeArm and 4 more": parts of the body that would be missed. */
static void note_missing(const vg_driver *d, const vg_rig *rig)
{
    const vg_skeleton *s = &rig->skeleton;
    size_t missing = vg_driver_missing(d), n = 0, at = 0;
    char list[600] = "";
    for (size_t j = 0; j < s->njoints; j++) {
        if (!vg_driver_lacks(d, j) || ++n > NAMED) continue;
        at += (size_t)snprintf(list + at, sizeof list - at, "%s%.40s", n > 1 ? ", " : "; no joint drives ", s->joints[j].name);
    }
    if (n > NAMED) snprintf(list + at, sizeof list - at, " and %zu more", n - NAMED);
    if (vg_driver_guessed(d))
        cli_warn("names of joints do not tell arms and legs: they are matched by the shape of the skeletons; --joints pairs them by a file");
    if (missing)
        cli_warn("%zu of %zu bones have no matching joint of the skeleton: they follow their parents%s", missing, rig->nbones, list);
}

/* ---- --joints ---- */

/* The joint with the longest name with which the text begins, followed by a blank or the end: names may contain blanks. */
static size_t find_first(const vg_skeleton *s, const char *text, size_t *length)
{
    size_t best = s->njoints;
    *length = 0;
    for (size_t j = 0; j < s->njoints; j++) {
        size_t n = strlen(s->joints[j].name);
        if (n > *length && !strncmp(s->joints[j].name, text, n) && strchr(" \t\r\n", text[n])) best = j, *length = n;
    }
    return best;
}

static uint32_t take_joint(lines *l, const vg_skeleton *s, const char *whose)
{
    size_t n, word = strcspn(l->now, " \t\r\n"), j = find_first(s, l->now, &n);
    if (!word) lines_stop(l, "a bone of the rig and a joint of the skeleton expected");
    char advice[120];
    if (j == s->njoints)
        lines_stop(l, "%s has no joint '%.*s'%s", whose, (int)(word < 80 ? word : 80), l->now, advise(advice, s, l->now, word));
    l->now += n;
    l->now += strspn(l->now, " \t\r\n");
    return (uint32_t)j;
}

/* Each line has a bone of the rig and a joint of the skeleton. Bones that are not listed have no partner. */
static uint32_t *read_pairs(const char *file, const vg_skeleton *of, const vg_skeleton *by)
{
    uint32_t *partner = cli_allocate(of->njoints, sizeof *partner, "the joints");
    for (size_t j = 0; j < of->njoints; j++) partner[j] = UINT32_MAX;
    lines l = lines_open(file);
    while (lines_next(&l)) {
        uint32_t bone = take_joint(&l, of, "the rig"), joint = take_joint(&l, by, "the skeleton");
        if (*l.now) lines_stop(&l, "a bone of the rig and a joint of the skeleton expected");
        if (partner[bone] != UINT32_MAX) lines_stop(&l, "bone '%.80s' is paired twice", of->joints[bone].name);
        partner[bone] = joint;
    }
    lines_close(&l);
    return partner;
}

void driving_start(driving *d, const driving_options *o, const vg_rig *rig, const char *name, const vg_skeleton *by)
{
    vg_err e;
    vg_driver_options how = {.align = VG_ALIGN_AUTO};
    bool *chosen = NULL;
    if (vg_skeleton_copy(&d->by, by, &e) < 0 || vg_joint_fitter_new(&d->fitter, &d->by, &e) < 0) cli_die(&e);
    uint32_t *partner = o->joints ? read_pairs(o->joints, &rig->skeleton, &d->by) : NULL;
    read_align(o, &rig->skeleton, name, &how, &chosen);
    how.partner = partner;
    if (vg_driver_new(&d->driver, rig, &d->by, &how, &e) < 0) cli_die(&e);
    note_missing(d->driver, rig);
    d->rig = rig, d->name = name;
    free(chosen);
    free(partner);
}

const double *driving_turns(vg_joint_fitter *fitter, const vg_frame *f)
{
    size_t known, joint;
    const double *turns = vg_frame_turns(f, &known);
    if (known) return turns;
    vg_joint_fitter_fit(fitter, f->values, NULL, NULL, &joint);
    return vg_joint_fitter_turns(fitter);
}

const double *driving_take(driving *d, const vg_frame *f)
{
    if (!d->begun) {
        vg_driver_look(d->driver, f->values);
        note_stance(d->driver, d->name);
        note_aligned(d->driver, &d->rig->skeleton, d->name);
    }
    d->begun = true;
    return driving_turns(d->fitter, f);
}
