/* joint_guess.c: the roles of joints whose names mean nothing, from the shape of the resting skeleton: two pairs of limbs of
 * equal length, the legs where the pair is nearer to the root, the arms on the other branch; toes tell what is ahead.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/joint_roles.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

static const uint32_t NONE = UINT32_MAX;
static const double EVEN = 0.05;  /* two limbs are a pair if their lengths differ by less than this, relative */
static const double LIMB = 0.15;  /* least length of a limb, relative to the skeleton's diagonal */
static const double HALVES = 0.5; /* least ratio of the two long bones of a limb */
static const double OUTER = 0.7;  /* how much shorter bones farther out may be and still be the limb */
static const double WHOLE = 0.5;  /* least share of upper and lower limb in the way from its first joint to its end */
static const double AHEAD = 0.3;  /* least horizontal part of a foot */
static const double NECK = 1.5;   /* a bone this much longer than others above the arms is the head */

enum { PATH = 24 };

typedef struct shape {
    const vg_skeleton *s;
    const double *at;
    double *reach;     /* per joint: length of the longest way down */
    uint32_t *further; /* per joint: the child on this way, or NONE */
    double shortest;   /* of a limb */
} shape;

/* The way from a joint to its farthest end. */
typedef struct path {
    size_t n;
    uint32_t joint[PATH];
} path;

/* Two limbs that branch from one joint, and the first of their two long bones. */
typedef struct limbs {
    uint32_t from;
    path side[2];
    size_t upper;
} limbs;

static double length_of(const shape *x, uint32_t a, uint32_t b)
{
    double d[3];
    vgi_subtract(x->at + 3 * (size_t)b, x->at + 3 * (size_t)a, d);
    return vgi_length(d);
}

static void measure(shape *x)
{
    for (size_t j = x->s->njoints; j-- > 0;) {
        uint32_t up = x->s->joints[j].parent;
        if (up == NONE) continue;
        double way = x->reach[j] + length_of(x, up, (uint32_t)j);
        if (x->further[up] == NONE || way > x->reach[up]) x->reach[up] = way, x->further[up] = (uint32_t)j;
    }
}

static path walk(const shape *x, uint32_t from)
{
    path p = {0};
    for (; from != NONE && p.n < PATH; from = x->further[from]) p.joint[p.n++] = from;
    return p;
}

/* Two consecutive bones are upper and lower limb: those whose shorter one is longest, or outer ones that are nearly as long:
 * a clavicle can be as long as a forearm. */
static bool divide_limb(const shape *x, const path *p, size_t *upper)
{
    double best = 0, ratio = 0, whole = 0;
    for (size_t i = 0; i + 2 < p->n; i++) {
        double a = length_of(x, p->joint[i], p->joint[i + 1]), b = length_of(x, p->joint[i + 1], p->joint[i + 2]);
        if (fmin(a, b) <= OUTER * best) continue;
        best = fmin(a, b), ratio = best / fmax(a, b), whole = a + b, *upper = i;
    }
    return ratio > HALVES && whole > WHOLE * x->reach[p->joint[0]]; /* not halves of one, as twist joints make them */
}

/* The longest pair of limbs whose joint is `from`. */
static bool find_limbs(const shape *x, uint32_t from, limbs *to)
{
    double most = x->shortest;
    bool found = false;
    for (uint32_t a = from + 1; a < x->s->njoints; a++) {
        for (uint32_t b = a + 1; b < x->s->njoints && x->s->joints[a].parent == from; b++) {
            if (x->s->joints[b].parent != from) continue;
            double la = x->reach[a] + length_of(x, from, a), lb = x->reach[b] + length_of(x, from, b);
            limbs l = {.from = from, .side = {walk(x, a), walk(x, b)}};
            size_t other;
            if (fabs(la - lb) > EVEN * fmax(la, lb) || la < most || l.side[0].n != l.side[1].n) continue;
            if (!divide_limb(x, &l.side[0], &l.upper) || !divide_limb(x, &l.side[1], &other) || other != l.upper)
                continue;
            *to = l, most = la, found = true;
        }
    }
    return found;
}

static bool is_below(const shape *x, uint32_t joint, uint32_t above)
{
    while (joint != NONE && joint != above) joint = x->s->joints[joint].parent;
    return joint == above;
}

/* Legs first: joints come after their parents. */
static bool find_pairs(const shape *x, limbs *legs, limbs *arms)
{
    uint32_t j = 0, n = (uint32_t)x->s->njoints;
    while (j < n && !find_limbs(x, j, legs)) j++;
    for (j++; j < n; j++) {
        if (is_below(x, j, legs->side[0].joint[0]) || is_below(x, j, legs->side[1].joint[0])) continue;
        if (is_below(x, j, legs->from) && find_limbs(x, j, arms)) return true;
    }
    return false;
}

static void middle_of(const shape *x, const limbs *l, double m[3])
{
    vgi_mix(x->at + 3 * (size_t)l->side[0].joint[l->upper], x->at + 3 * (size_t)l->side[1].joint[l->upper], 0.5, m);
}

/* Whether the first of the legs is the left one: 1, -1, or 0 if the feet do not tell. */
static int find_side(const shape *x, const limbs *legs, const limbs *arms)
{
    double hips[3], chest[3], up[3], ahead[3] = {0, 0, 0}, left[3], across[3], all = 0;
    middle_of(x, legs, hips), middle_of(x, arms, chest);
    vgi_subtract(chest, hips, up);
    double tall = vgi_length(up);
    if (!(tall > 0)) return 0;
    vgi_divided(up, tall, up);
    for (int i = 0; i < 2; i++) {
        const path *p = &legs->side[i];
        double foot[3];
        vgi_subtract(x->at + 3 * (size_t)p->joint[p->n - 1], x->at + 3 * (size_t)p->joint[legs->upper + 2], foot);
        all += vgi_length(foot);
        vgi_add(ahead, foot);
    }
    vgi_add_scaled(ahead, -vgi_dot(ahead, up), up);
    if (!(vgi_length(ahead) > AHEAD * all)) return 0;
    vgi_cross(up, ahead, left);
    vgi_subtract(x->at + 3 * (size_t)legs->side[0].joint[legs->upper],
                 x->at + 3 * (size_t)legs->side[1].joint[legs->upper], across);
    return vgi_dot(across, left) > 0 ? 1 : -1;
}

/* ---- roles ---- */

static void name_limbs(vgi_role *roles, const limbs *l, int first, vgi_part above, vgi_part upper, size_t parts)
{
    for (int i = 0; i < 2; i++) {
        const path *p = &l->side[i];
        int8_t side = (int8_t)(i ? -first : first);
        if (l->upper) roles[p->joint[l->upper - 1]] = (vgi_role){.part = (uint8_t)above, .side = side};
        for (size_t k = 0; k < parts && l->upper + k < p->n; k++)
            roles[p->joint[l->upper + k]] = (vgi_role){.part = (uint8_t)(upper + k), .side = side};
    }
}

/* The first of the arms is the left one if it is on the side of the left leg. */
static int side_of_arms(const shape *x, const limbs *legs, const limbs *arms, int side)
{
    double a[3], b[3];
    vgi_subtract(x->at + 3 * (size_t)legs->side[0].joint[legs->upper],
                 x->at + 3 * (size_t)legs->side[1].joint[legs->upper], a);
    vgi_subtract(x->at + 3 * (size_t)arms->side[0].joint[arms->upper],
                 x->at + 3 * (size_t)arms->side[1].joint[arms->upper], b);
    return vgi_dot(a, b) > 0 ? side : -side;
}

/* Above the arms: neck, then the head, which is the longest bone if one is, or else the last joint. */
static void name_head(const shape *x, vgi_role *roles, const limbs *arms)
{
    uint32_t best = NONE;
    for (uint32_t j = arms->from + 1; j < x->s->njoints; j++) {
        if (x->s->joints[j].parent != arms->from || j == arms->side[0].joint[0] || j == arms->side[1].joint[0])
            continue;
        if (best == NONE || x->reach[j] > x->reach[best]) best = j;
    }
    if (best == NONE) return;
    path p = walk(x, best);
    if (p.n > 1 && !x->s->joints[p.joint[p.n - 1]].nchannels) p.n--; /* an end */
    size_t head = p.n - 1;
    double longest = 0, next = 0;
    for (size_t i = 0; i + 1 < p.n; i++) {
        double length = length_of(x, p.joint[i], p.joint[i + 1]);
        if (length > longest) next = longest, longest = length, head = i;
        else next = fmax(next, length);
    }
    if (!(longest > NECK * next) || !head) head = p.n - 1;
    for (size_t i = 0; i <= head; i++) roles[p.joint[i]] = (vgi_role){.part = i < head ? VGI_NECK : VGI_HEAD};
}

static void name_middle(const shape *x, vgi_role *roles, const limbs *legs, const limbs *arms)
{
    for (uint32_t j = arms->from; j != legs->from; j = x->s->joints[j].parent)
        roles[j] = (vgi_role){.part = VGI_SPINE};
    roles[legs->from] = (vgi_role){.part = VGI_HIPS};
    name_head(x, roles, arms);
}

int vgi_guess_roles(const vg_skeleton *s, const double *at, vgi_role *roles, vg_err *e)
{
    size_t n = s->njoints;
    limbs legs = {0}, arms = {0};
    shape x = {.s = s, .at = at, .shortest = LIMB * vg_diagonal(at, n)};
    x.reach = vgi_array(n, sizeof *x.reach, e), x.further = vgi_array(n, sizeof *x.further, e);
    int r = x.reach && x.further ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        memset(x.further, 0xff, n * sizeof *x.further);
        measure(&x);
        int side = find_pairs(&x, &legs, &arms) ? find_side(&x, &legs, &arms) : 0;
        if (side) {
            name_limbs(roles, &legs, side, VGI_HIP_JOINT, VGI_THIGH, 4);
            name_limbs(roles, &arms, side_of_arms(&x, &legs, &arms, side), VGI_CLAVICLE, VGI_UPPER_ARM, 3);
            name_middle(&x, roles, &legs, &arms);
        }
    }
    free(x.reach);
    free(x.further);
    return r;
}
