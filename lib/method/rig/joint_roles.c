/* joint_roles.c: the role of a joint in the body. Its name is split into words, prefix and side are removed, and the
 * remainder is looked up. Joints whose names leave the role open get it from the tree of joints.
 * Joints of two skeletons are matched in pair_joints.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/joint_roles.h"

#include <ctype.h>
#include <stdlib.h>

enum { KEY = 40, WORD = 40 };
static const uint32_t NONE = UINT32_MAX;

/* A name without prefix and side: its letters in lower case, and the first number in it. */
typedef struct key {
    char text[KEY];
    int number; /* -1: no number */
    int side;
} key;

static const char *const prefixes[] = {"mixamorig", "bip001",  "bip01", "character1", "cc_base_", "def-",
                                       "org-",      "j_bip_c", "j_bip_", "valvebiped"};

static const struct {
    const char *text;
    vgi_part part;
} parts[] = {{"root", VGI_ROOT},          {"hips", VGI_HIPS},         {"hip", VGI_HIPS},
             {"pelvis", VGI_HIPS},        {"spine", VGI_SPINE},       {"lowerback", VGI_SPINE},
             {"back", VGI_SPINE},         {"chest", VGI_SPINE},       {"upperchest", VGI_SPINE},
             {"chestlower", VGI_SPINE},   {"chestupper", VGI_SPINE},  {"abdomen", VGI_SPINE},
             {"abdomenlower", VGI_SPINE}, {"abdomenupper", VGI_SPINE}, {"torso", VGI_SPINE},
             {"waist", VGI_SPINE},        {"neck", VGI_NECK},         {"necklower", VGI_NECK},
             {"neckupper", VGI_NECK},     {"head", VGI_HEAD},         {"clavicle", VGI_CLAVICLE},
             {"collar", VGI_CLAVICLE},    {"shoulder", VGI_SHOULDER}, {"upperarm", VGI_UPPER_ARM},
             {"uparm", VGI_UPPER_ARM},    {"arm", VGI_UPPER_ARM},     {"shldr", VGI_UPPER_ARM},
             {"shldrbend", VGI_UPPER_ARM}, {"forearm", VGI_FOREARM},  {"forearmbend", VGI_FOREARM},
             {"lowerarm", VGI_FOREARM},   {"lowarm", VGI_FOREARM},    {"elbow", VGI_FOREARM},
             {"hand", VGI_HAND},          {"wrist", VGI_HAND},        {"thumb", VGI_THUMB},
             {"handthumb", VGI_THUMB},    {"index", VGI_INDEX},       {"handindex", VGI_INDEX},
             {"handfinger", VGI_INDEX},   {"findex", VGI_INDEX},      {"middle", VGI_MIDDLE},
             {"mid", VGI_MIDDLE},         {"handmiddle", VGI_MIDDLE}, {"fmiddle", VGI_MIDDLE},
             {"ring", VGI_RING},          {"handring", VGI_RING},     {"fring", VGI_RING},
             {"pinky", VGI_PINKY},        {"handpinky", VGI_PINKY},   {"fpinky", VGI_PINKY},
             {"little", VGI_PINKY},       {"hipjoint", VGI_HIP_JOINT}, {"thigh", VGI_THIGH},
             {"thighbend", VGI_THIGH},    {"upleg", VGI_THIGH},       {"upperleg", VGI_THIGH},
             {"shin", VGI_SHIN},          {"calf", VGI_SHIN},         {"leg", VGI_SHIN},
             {"lowleg", VGI_SHIN},        {"lowerleg", VGI_SHIN},     {"knee", VGI_SHIN},
             {"foot", VGI_FOOT},          {"ankle", VGI_FOOT},        {"toe", VGI_TOE},
             {"toes", VGI_TOE},           {"toebase", VGI_TOE},       {"ball", VGI_TOE},
             {"upperback", VGI_SPINE},    {"thorax", VGI_SPINE},      {"lowerneck", VGI_NECK},
             {"upperneck", VGI_NECK},     {"humerus", VGI_UPPER_ARM}, {"radius", VGI_FOREARM},
             {"fingers", VGI_INDEX},      {"femur", VGI_THIGH},       {"tibia", VGI_SHIN}};

/* The name after the last ':' or '|' and after a known prefix. */
static const char *without_prefix(const char *name)
{
    for (const char *c = name; *c; c++)
        if ((*c == ':' || *c == '|') && c[1]) name = c + 1;
    for (size_t i = 0; i < sizeof prefixes / sizeof *prefixes; i++) {
        size_t n = strlen(prefixes[i]), k = 0;
        while (k < n && tolower((unsigned char)name[k]) == prefixes[i][k]) k++;
        if (k == n && name[n]) return name + n;
    }
    return name;
}

/* The next word of a name, in lower case: "LeftUpLeg", "LHipJoint" and "upper_arm.L" have three each. Returns the
 * position after the word, or NULL at the end. */
static const char *next_word(const char *at, char word[WORD])
{
    size_t n = 0;
    while (*at && !isalnum((unsigned char)*at)) at++;
    if (!*at) return NULL;
    bool digits = isdigit((unsigned char)*at);
    for (; n + 1 < WORD && isalnum((unsigned char)*at); at++) {
        unsigned char c = (unsigned char)at[0], before = n ? (unsigned char)at[-1] : 0;
        if ((bool)isdigit(c) != digits) break;
        if (n && isupper(c) && (islower(before) || islower((unsigned char)at[1]))) break;
        word[n++] = (char)tolower(c);
    }
    word[n] = 0;
    return at;
}

/* Remove "left" or "right" from the front of a word. */
static const char *take_side(const char *word, int *side)
{
    if (!strcmp(word, "l") || !strcmp(word, "r")) {
        *side = *word == 'l' ? 1 : -1;
        return "";
    }
    if (!strncmp(word, "left", 4)) *side = 1, word += 4;
    else if (!strncmp(word, "right", 5)) *side = -1, word += 5;
    return word;
}

static key read_key(const char *name)
{
    key k = {.number = -1};
    char word[WORD];
    for (const char *at = without_prefix(name); (at = next_word(at, word));) {
        if (isdigit((unsigned char)*word)) {
            if (k.number < 0) k.number = (int)strtol(word, NULL, 10);
            continue;
        }
        const char *rest = take_side(word, &k.side);
        size_t n = strlen(k.text);
        snprintf(k.text + n, sizeof k.text - n, "%s", rest);
    }
    return k;
}

static vgi_part find_part(const char *text)
{
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (!strcmp(text, parts[i].text)) return parts[i].part;
    return VGI_NO_PART;
}

static vgi_role look_up(const char *name)
{
    key k = read_key(name);
    vgi_part part = find_part(k.text);
    if (!part && !k.side && (*k.text == 'l' || *k.text == 'r')) /* CMU's own files: "lfemur" */
        if ((part = find_part(k.text + 1))) k.side = *k.text == 'l' ? 1 : -1;
    vgi_role role = {.side = (int8_t)k.side, .part = (uint8_t)part};
    if (!strcmp(k.text, "finger") && k.number >= 1 && k.number <= 5) role.part = (uint8_t)(VGI_THUMB + k.number - 1);
    if (role.part == VGI_HIPS && role.side) role.part = VGI_SIDED_HIP;
    if ((role.part >= VGI_CLAVICLE) != (role.side != 0)) role = (vgi_role){0};
    return role;
}

/* ---- roles from the tree of joints ---- */

static bool has_role(const vgi_role *roles, size_t n, vgi_part part, int side)
{
    for (size_t j = 0; j < n; j++)
        if (roles[j].part == part && (!side || roles[j].side == side)) return true;
    return false;
}

static void rename_part(vgi_role *roles, size_t n, vgi_part from, vgi_part to, int side)
{
    for (size_t j = 0; j < n; j++)
        if (roles[j].part == from && roles[j].side == side) roles[j].part = (uint8_t)to;
}

static void decide_side(vgi_role *roles, size_t n, int side)
{
    bool clavicle = has_role(roles, n, VGI_CLAVICLE, side), arm = has_role(roles, n, VGI_UPPER_ARM, side);
    bool thigh = has_role(roles, n, VGI_THIGH, side);
    vgi_part shoulder = arm ? (clavicle ? VGI_NO_PART : VGI_CLAVICLE) : VGI_UPPER_ARM;
    rename_part(roles, n, VGI_SHOULDER, shoulder, side);
    rename_part(roles, n, VGI_SIDED_HIP, thigh ? VGI_HIP_JOINT : VGI_THIGH, side);
}

/* below[j]: whether joint j or one below it has this part. */
static void find_above(const vg_skeleton *s, const vgi_role *roles, vgi_part part, bool *below)
{
    for (size_t j = s->njoints; j-- > 0;) {
        below[j] = below[j] || roles[j].part == part;
        if (below[j] && s->joints[j].parent != NONE) below[s->joints[j].parent] = true;
    }
}

/* Rigify: the first spine joint, whose children are the thighs, is the hips; spine joints above the arms are neck and
 * head. */
static void divide_spine(const vg_skeleton *s, vgi_role *roles, bool *below)
{
    size_t n = s->njoints, last = n;
    if (!has_role(roles, n, VGI_HIPS, 0)) rename_part(roles, n, VGI_ROOT, VGI_HIPS, 0);
    if (!has_role(roles, n, VGI_HIPS, 0)) {
        find_above(s, roles, VGI_THIGH, below);
        for (size_t j = 0; j < n; j++)
            if (roles[j].part == VGI_SPINE && below[j]) {
                roles[j].part = VGI_HIPS;
                break;
            }
        memset(below, 0, n * sizeof *below);
    }
    if (has_role(roles, n, VGI_NECK, 0) || !has_role(roles, n, VGI_UPPER_ARM, 0)) return;
    find_above(s, roles, VGI_UPPER_ARM, below);
    for (size_t j = 0; j < n; j++)
        if (roles[j].part == VGI_SPINE && !below[j]) roles[j].part = VGI_NECK, last = j;
    if (last < n && !has_role(roles, n, VGI_HEAD, 0)) roles[last].part = VGI_HEAD;
}

int vgi_joint_roles(const vg_skeleton *s, vgi_role *roles, vg_err *e)
{
    bool *below = vgi_array(s->njoints, sizeof *below, e);
    if (!below) return VG_ENOMEM;
    for (size_t j = 0; j < s->njoints; j++) roles[j] = look_up(s->joints[j].name);
    decide_side(roles, s->njoints, 1);
    decide_side(roles, s->njoints, -1);
    divide_spine(s, roles, below);
    free(below);
    return VG_OK;
}

bool vgi_role_is_limb(vgi_role r)
{
    return r.part == VGI_UPPER_ARM || r.part == VGI_FOREARM || r.part == VGI_THIGH || r.part == VGI_SHIN;
}
