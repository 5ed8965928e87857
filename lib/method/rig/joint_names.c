/* joint_names.c: the role of a joint, as far as its name tells it. A name is split into words; words that most joints of the
 * skeleton begin or end with, sides and fillers are removed, and what remains is looked up. Roles that depend on other joints
 * are decided in joint_roles.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/joint_roles.h"

#include <ctype.h>
#include <stdlib.h>

enum { KEY = 40, WORD = 24, WORDS = 12 };

/* The words of a name in lower case; a run of digits is a word. Those from first to last - 1 remain. */
typedef struct name {
    char words[WORDS][WORD];
    int first, last;
} name;

/* What remains of a name: its letters, its first number, and a side. */
typedef struct key {
    char text[KEY];
    const char *digits; /* or NULL */
    int side;
} key;

static const struct {
    const char *text;
    vgi_part part;
} parts[] = {{"root", VGI_ROOT},           {"reference", VGI_ROOT},     {"master", VGI_ROOT},
             {"cog", VGI_ROOT},            {"hips", VGI_HIPS},          {"hip", VGI_HIPS},
             {"pelvis", VGI_HIPS},         {"hipcenter", VGI_HIPS},     {"spinebase", VGI_HIPS},
             {"lowertorso", VGI_HIPS},     {"spine", VGI_SPINE},        {"lowerback", VGI_SPINE},
             {"back", VGI_SPINE},          {"chest", VGI_SPINE},        {"upperchest", VGI_SPINE},
             {"lowerchest", VGI_SPINE},    {"chestlower", VGI_SPINE},   {"chestupper", VGI_SPINE},
             {"abdomen", VGI_SPINE},       {"abdomenlower", VGI_SPINE}, {"abdomenupper", VGI_SPINE},
             {"torso", VGI_SPINE},         {"uppertorso", VGI_SPINE},   {"waist", VGI_SPINE},
             {"upperback", VGI_SPINE},     {"thorax", VGI_SPINE},       {"ribs", VGI_SPINE},
             {"ribcage", VGI_SPINE},       {"stomach", VGI_SPINE},      {"belly", VGI_SPINE},
             {"navel", VGI_SPINE},         {"spinenavel", VGI_SPINE},   {"spinechest", VGI_SPINE},
             {"spinemid", VGI_SPINE},      {"spineshoulder", VGI_SPINE}, {"ab", VGI_SPINE},
             {"neck", VGI_NECK},           {"necktwist", VGI_NECK},     {"necklower", VGI_NECK},
             {"neckupper", VGI_NECK},      {"lowerneck", VGI_NECK},     {"upperneck", VGI_NECK},
             {"shouldercenter", VGI_NECK}, {"head", VGI_HEAD},          {"clavicle", VGI_CLAVICLE},
             {"collar", VGI_CLAVICLE},     {"collarbone", VGI_CLAVICLE}, {"scapula", VGI_CLAVICLE},
             {"shoulder", VGI_SHOULDER},   {"upperarm", VGI_UPPER_ARM}, {"armupper", VGI_UPPER_ARM},
             {"uparm", VGI_UPPER_ARM},     {"uarm", VGI_UPPER_ARM},     {"arm", VGI_ARM},
             {"shldr", VGI_UPPER_ARM},     {"shldrbend", VGI_UPPER_ARM}, {"bicep", VGI_UPPER_ARM},
             {"humerus", VGI_UPPER_ARM},   {"forearm", VGI_FOREARM},    {"forearmbend", VGI_FOREARM},
             {"lowerarm", VGI_FOREARM},    {"armlower", VGI_FOREARM},   {"lowarm", VGI_FOREARM},
             {"larm", VGI_FOREARM},        {"farm", VGI_FOREARM},       {"elbow", VGI_FOREARM},
             {"radius", VGI_FOREARM},      {"hand", VGI_HAND},          {"wrist", VGI_WRIST},
             {"palm", VGI_PALM},           {"thumb", VGI_THUMB},        {"thumbmetacarpal", VGI_THUMB},
             {"index", VGI_INDEX},         {"handfinger", VGI_INDEX},   {"findex", VGI_INDEX},
             {"fingers", VGI_INDEX},       {"middle", VGI_MIDDLE},      {"mid", VGI_MIDDLE},
             {"fmiddle", VGI_MIDDLE},      {"ring", VGI_RING},          {"fring", VGI_RING},
             {"pinky", VGI_PINKY},         {"fpinky", VGI_PINKY},       {"little", VGI_PINKY},
             {"hipjoint", VGI_HIP_JOINT},  {"buttock", VGI_HIP_JOINT},  {"thigh", VGI_THIGH},
             {"thighbend", VGI_THIGH},     {"upleg", VGI_THIGH},        {"uleg", VGI_THIGH},
             {"upperleg", VGI_THIGH},      {"legupper", VGI_THIGH},     {"femur", VGI_THIGH},
             {"shin", VGI_SHIN},           {"calf", VGI_SHIN},          {"leg", VGI_LEG},
             {"lowleg", VGI_SHIN},         {"lowerleg", VGI_SHIN},      {"leglower", VGI_SHIN},
             {"lleg", VGI_SHIN},           {"tibia", VGI_SHIN},         {"knee", VGI_SHIN},
             {"foot", VGI_FOOT},           {"ankle", VGI_ANKLE},        {"toe", VGI_TOE},
             {"toes", VGI_TOE},            {"toebase", VGI_TOE},        {"ball", VGI_TOE}};

static bool is_one_of(const char *word, const char *const *list, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!strcmp(word, list[i])) return true;
    return false;
}
#define IS_ONE_OF(word, list) is_one_of(word, list, sizeof(list) / sizeof *(list))

/* ---- words ---- */

static bool is_digits(const char *word)
{
    return isdigit((unsigned char)*word);
}

/* The next word: "LeftUpLeg", "LHipJoint", "LUArm" and "upper_arm.L" have three each. Returns the position after the word,
 * or NULL at the end. */
static const char *next_word(const char *at, char word[WORD])
{
    size_t n = 0;
    while (*at && !isalnum((unsigned char)*at)) at++;
    if (!*at) return NULL;
    bool digits = isdigit((unsigned char)*at);
    bool glued = (*at == 'L' || *at == 'R') && isupper((unsigned char)at[1]) && isupper((unsigned char)at[2]) &&
                 islower((unsigned char)at[3]); /* of "LUArm" */
    for (; n + 1 < WORD && isalnum((unsigned char)*at); at++) {
        unsigned char c = (unsigned char)at[0], before = n ? (unsigned char)at[-1] : 0;
        if ((bool)isdigit(c) != digits) break;
        if (n && isupper(c) && (islower(before) || islower((unsigned char)at[1]) || glued)) break;
        word[n++] = (char)tolower(c);
    }
    word[n] = 0;
    return at;
}

/* The words after the last ':' or '|'. */
static void split_name(const char *text, name *x)
{
    for (const char *c = text; *c; c++)
        if ((*c == ':' || *c == '|') && c[1]) text = c + 1;
    x->first = x->last = 0;
    while (x->last < WORDS && (text = next_word(text, x->words[x->last]))) x->last++;
}

/* Remove "left" or "right" from the front or end of a word. */
static void take_side(char *word, int *side)
{
    static const char *const lefts[] = {"l", "lt", "lf"}, *const rights[] = {"r", "rt", "rf"};
    static const char *const sides[] = {"left", "right"};
    bool left = IS_ONE_OF(word, lefts);
    if (left || IS_ONE_OF(word, rights)) {
        *side = left ? 1 : -1, *word = 0;
        return;
    }
    for (int i = 0; i < 2; i++) {
        size_t n = strlen(word), m = strlen(sides[i]);
        if (n < m) continue;
        bool front = !strncmp(word, sides[i], m);
        if (!front && strcmp(word + n - m, sides[i])) continue;
        *side = i ? -1 : 1;
        if (front) memmove(word, word + m, n - m + 1);
        else word[n - m] = 0;
    }
}

static vgi_part find_part(const char *text)
{
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (!strcmp(text, parts[i].text)) return parts[i].part;
    return VGI_NO_PART;
}

/* ---- words that most joints share ---- */

/* Whether a word can be part of a name of the body or of a side. */
static bool has_meaning(const char *word)
{
    static const char *const others[] = {"upper", "lower", "up", "low", "u", "fore", "finger", "f", "big"};
    char rest[WORD];
    int side = 0;
    memcpy(rest, word, WORD);
    take_side(rest, &side);
    return side || find_part(rest) || IS_ONE_OF(rest, others);
}

/* The first or last word that remains, or NULL. */
static char *end_word(name *x, bool front)
{
    return x->first == x->last ? NULL : x->words[front ? x->first : x->last - 1];
}

/* Remove the word with which more than half of the names begin or end, unless it has a meaning. Numbers are removed only
 * after a word: "Bip01". */
static bool drop_shared(name *names, size_t n, bool front, bool numbers)
{
    const char *most = NULL, *word;
    size_t votes = 0, have = 0;
    for (size_t j = 0; j < n; j++) {
        if (!(word = end_word(&names[j], front))) continue;
        if (!votes) most = word;
        if (!strcmp(word, most)) votes++;
        else votes--;
    }
    for (size_t j = 0; most && j < n; j++) have += (word = end_word(&names[j], front)) && !strcmp(word, most);
    if (2 * have <= n || has_meaning(most) || (is_digits(most) && !numbers)) return false;
    char shared[WORD];
    memcpy(shared, most, WORD);
    for (size_t j = 0; j < n; j++) {
        if (!(word = end_word(&names[j], front)) || strcmp(word, shared)) continue;
        if (front) names[j].first++;
        else names[j].last--;
    }
    return true;
}

/* ---- roles ---- */

/* Words of a program, not of the body. */
static bool is_filler(const name *x, int i)
{
    static const char *const always[] = {"joint", "jnt", "jt", "bone", "bind", "skin", "def", "org", "skeleton", "armature", "rig"};
    static const char *const in_front[] = {"mixamorig", "bip", "character", "cc", "base", "j", "valve", "biped"};
    static const char *const middle[] = {"m", "c"};
    const char *word = x->words[i];
    bool end = i == x->first || i == x->last - 1;
    return IS_ONE_OF(word, always) || (i < x->last - 1 && IS_ONE_OF(word, in_front)) || (end && IS_ONE_OF(word, middle));
}

/* Letters without the words that only tell which joint of a finger it is, if `fingers`. */
static key read_key(const name *x, bool fingers)
{
    static const char *const of_fingers[] = {"hand", "finger", "proximal", "intermediate", "distal"};
    key k = {.digits = NULL};
    for (int i = x->first; i < x->last; i++) {
        char word[WORD];
        memcpy(word, x->words[i], WORD);
        if (is_digits(word)) {
            bool of_prefix = i && !*k.text && !k.side && is_filler(x, i - 1); /* "Bip01" */
            if (!k.digits && !of_prefix) k.digits = x->words[i];
            continue;
        }
        take_side(word, &k.side);
        if (is_filler(x, i) || (fingers && IS_ONE_OF(word, of_fingers))) continue;
        size_t n = strlen(k.text);
        snprintf(k.text + n, sizeof k.text - n, "%s", word);
    }
    return k;
}

/* Xsens: the vertebrae L5, L3, T12 and T8. */
static vgi_part find_vertebra(const name *x)
{
    if (x->last - x->first != 2 || !is_digits(x->words[x->first + 1])) return VGI_NO_PART;
    const char *letter = x->words[x->first];
    long number = strtol(x->words[x->first + 1], NULL, 10);
    if (number < 1 || number > 12) return VGI_NO_PART;
    if (!strcmp(letter, "l") || !strcmp(letter, "t")) return VGI_SPINE;
    return !strcmp(letter, "c") ? VGI_NECK : VGI_NO_PART;
}

/* Numbers of fingers begin with the thumb: at 0 in Biped ("Finger0", "Finger01"), at 1 in MakeHuman ("finger1-1"). */
static vgi_part find_finger(const key *k, int thumb)
{
    if (strcmp(k->text, "finger") || !k->digits) return VGI_NO_PART;
    int i = k->digits[0] - '0' - thumb;
    return i >= 0 && i < 5 ? (vgi_part)(VGI_THUMB + i) : VGI_NO_PART;
}

static vgi_role look_up(const name *x, int thumb)
{
    key k = read_key(x, false);
    vgi_part part = find_part(k.text), vertebra = find_vertebra(x);
    if (vertebra) return (vgi_role){.part = (uint8_t)vertebra};
    if (!part) part = find_finger(&k, thumb);
    if (!part && !k.side && (*k.text == 'l' || *k.text == 'r')) /* CMU's own files: "lfemur" */
        if ((part = find_part(k.text + 1))) k.side = *k.text == 'l' ? 1 : -1;
    if (!part) {
        part = find_part(read_key(x, true).text);
        if (part < VGI_THUMB || part > VGI_PINKY) part = VGI_NO_PART;
    }
    if (part == VGI_HIPS && k.side) part = VGI_SIDED_HIP;
    if ((part >= VGI_CLAVICLE) != (k.side != 0)) return (vgi_role){0};
    return (vgi_role){.side = (int8_t)k.side, .part = (uint8_t)part};
}

static int first_thumb(const name *names, size_t n)
{
    for (size_t j = 0; j < n; j++) {
        key k = read_key(&names[j], false);
        if (!strcmp(k.text, "finger") && k.digits && *k.digits == '0') return 0;
    }
    return 1;
}

int vgi_name_roles(const vg_skeleton *s, vgi_role *roles, vg_err *e)
{
    size_t n = s->njoints;
    name *names = vgi_array(n, sizeof *names, e);
    if (!names) return VG_ENOMEM;
    for (size_t j = 0; j < n; j++) split_name(s->joints[j].name, &names[j]);
    for (int i = 0; i < WORDS && drop_shared(names, n, true, i > 0); i++) continue;
    for (int i = 0; i < WORDS && drop_shared(names, n, false, false); i++) continue;
    int thumb = first_thumb(names, n);
    for (size_t j = 0; j < n; j++) roles[j] = look_up(&names[j], thumb);
    free(names);
    return VG_OK;
}
