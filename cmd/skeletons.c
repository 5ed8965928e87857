/* skeletons.c: describes skeletons and rigs for vg-info: the tree of joints, and skinning weights as text.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "skeletons.h"
#include "cli.h"

#include <ctype.h>
#include <inttypes.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;
enum {
    MOST_INDENTS = 20,  /* deeper levels are not indented further */
    CHANNELS_LINE = 128 /* six times ", rotation x" and some */
};

static const char *const channel_names[] = {"Xposition", "Yposition", "Zposition",
                                            "Xrotation", "Yrotation", "Zrotation"};
static const report_column columns[] = {{.key = "name"}, {.key = "parent"}, {.key = "channels"}, {.key = "offset"}};

/* Linked lists of the children of each joint j, and of the roots (at njoints). */
typedef struct kin {
    uint32_t *first, *next;
    bool *folded; /* end sites shown with their parent, after which they are named with ".end" */
} kin;

static bool is_end(const vg_skeleton *s, size_t j)
{
    const vg_joint *joint = &s->joints[j];
    if (joint->parent == NONE || joint->nchannels) return false;
    const char *parent = s->joints[joint->parent].name;
    size_t n = strlen(parent);
    return !strncmp(joint->name, parent, n) && !strcmp(joint->name + n, ".end");
}

static kin link_joints(const vg_skeleton *s)
{
    size_t n = s->njoints;
    kin k = {cli_allocate(n, sizeof *k.first, "the joints"), cli_allocate(n, sizeof *k.next, "the joints"),
             cli_allocate(n, sizeof *k.folded, "the joints")};
    for (size_t j = 0; j <= n; j++) k.first[j] = NONE;
    for (size_t j = n; j-- > 0;) {
        k.folded[j] = k.first[j] == NONE && is_end(s, j);
        uint32_t *list = &k.first[s->joints[j].parent == NONE ? n : s->joints[j].parent];
        k.next[j] = *list;
        *list = (uint32_t)j;
    }
    return k;
}

/* "position xyz, rotation zxy": in the order in which they come. */
static const char *channels_line(const vg_joint *j, char line[CHANNELS_LINE])
{
    static const char axes[] = "xyz";
    size_t at = 0;
    int last = -1;
    line[0] = 0;
    for (uint32_t i = 0; i < j->nchannels; i++) {
        int kind = j->channels[i] > 3;
        if (kind != last)
            at += (size_t)snprintf(line + at, CHANNELS_LINE - at, "%s%s ", i ? ", " : "",
                                   kind ? "rotation" : "position");
        line[at++] = axes[(j->channels[i] - 1) % 3];
        line[at] = 0;
        last = kind;
    }
    return line;
}

static void note_joint(report *r, const vg_skeleton *s, const kin *k, uint32_t j, size_t depth)
{
    char line[CHANNELS_LINE];
    uint64_t ends = 0;
    for (uint32_t c = k->first[j]; c != NONE; c = k->next[c]) ends += k->folded[c];
    const char *channels = channels_line(&s->joints[j], line);
    report_note(r, "  %*s%s%s%s%s", (int)(2 * (depth < MOST_INDENTS ? depth : MOST_INDENTS)), "", s->joints[j].name,
                *channels ? ": " : "", channels, ends ? (*channels ? ", end" : ": end") : "");
}

static void note_tree(report *r, const vg_skeleton *s, const kin *k)
{
    size_t depth = 0;
    for (uint32_t j = k->first[s->njoints]; j != NONE;) {
        if (!k->folded[j]) note_joint(r, s, k, j, depth);
        if (k->first[j] != NONE) {
            j = k->first[j];
            depth++;
            continue;
        }
        for (; j != NONE && k->next[j] == NONE; j = s->joints[j].parent) depth -= s->joints[j].parent != NONE;
        if (j != NONE) j = k->next[j];
    }
}

static void list_joints(report *r, const vg_skeleton *s)
{
    report_table(r, "tree", NULL, false, columns, 4);
    for (size_t j = 0; j < s->njoints; j++) {
        const vg_joint *joint = &s->joints[j];
        const char *channels[6];
        for (uint32_t i = 0; i < joint->nchannels; i++) channels[i] = channel_names[joint->channels[i] - 1];
        const report_value row[4] = {report_text(joint->name),
                                     joint->parent == NONE ? report_nothing() : report_count(joint->parent),
                                     report_texts(channels, joint->nchannels), report_numbers(joint->offset, 3)};
        report_row(r, row);
    }
}

/* The joints as a tree, in a group that the caller has begun. label: its name in the text. */
static void report_skeleton(report *r, const char *label, const vg_skeleton *s)
{
    char line[128];
    size_t bones = 0, ends = 0;
    kin k = link_joints(s);
    for (size_t j = 0; j < s->njoints; j++) bones += s->joints[j].nchannels > 0, ends += k.folded[j];
    report_put(r, "joints", NULL, report_count(s->njoints));
    report_put(r, "bones", NULL, report_count(bones));
    report_put(r, "ends", NULL, report_count(ends));
    report_put(r, "channels", NULL, report_count(vg_skeleton_channels(s)));
    snprintf(line, sizeof line, "%zu joints, %zu of them turn", s->njoints, bones);
    report_put(r, NULL, label, report_text(line));
    note_tree(r, s, &k);
    list_joints(r, s);
    free(k.first);
    free(k.next);
    free(k.folded);
}

/* A name is one word. */
static void print_word(FILE *f, const char *name)
{
    if (!*name) fputc('_', f);
    for (; *name; name++) fputc(isspace((unsigned char)*name) || strchr("#,;", *name) ? '_' : *name, f);
}

void write_weights(FILE *f, const vg_rig *g, size_t nv)
{
    fputs("# skinning weights, linear blend: the vertex, counted from 0, then pairs BONE WEIGHT\n", f);
    for (size_t v = 0; v < nv; v++) {
        fprintf(f, "%zu", v);
        for (size_t i = VG_SKIN * v; i < VG_SKIN * (v + 1) && g->skin_weight[i] > 0; i++) {
            fputc(' ', f);
            print_word(f, g->skeleton.joints[g->bone[g->skin_bone[i]]].name);
            fprintf(f, " %.10g", g->skin_weight[i]);
        }
        fputc('\n', f);
    }
}

void report_skeletons(report *r, const vg_head *h, uint64_t turned, uint64_t frames)
{
    const vg_rig *g = &h->body.rig;
    char line[80];
    if (h->body.skeleton.njoints) {
        report_gap(r);
        report_group(r, "skeleton");
        report_skeleton(r, "skeleton", &h->body.skeleton);
        report_put(r, "turned_frames", NULL, report_count(turned));
        snprintf(line, sizeof line, "known in %" PRIu64 " of %" PRIu64 " frames", turned, frames);
        report_put(r, NULL, "turns", report_text(line));
        report_end(r);
    }
    if (!g->skeleton.njoints) return;
    report_gap(r);
    report_group(r, "rig");
    report_skeleton(r, "rig", &g->skeleton);
    report_put(r, "skinned", NULL, report_flag(g->skin_weight != NULL));
    report_put(r, NULL, "skin",
               report_text(g->skin_weight ? "weights of linear blend skinning: --weights" : "no weights"));
    report_end(r);
}
