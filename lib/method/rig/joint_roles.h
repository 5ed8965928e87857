/* joint_roles.h: the role of a joint in the body, from its name.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_JOINT_ROLES_H
#define VG_RIG_JOINT_ROLES_H

#include "core/core.h"

/* The body part that a joint rotates. Parts from VGI_CLAVICLE on have a side. */
typedef enum vgi_part {
    VGI_NO_PART = 0,
    VGI_ROOT,
    VGI_HIPS,
    VGI_SPINE,
    VGI_NECK,
    VGI_HEAD,
    VGI_CLAVICLE,
    VGI_UPPER_ARM,
    VGI_FOREARM,
    VGI_HAND,
    VGI_THUMB,
    VGI_INDEX,
    VGI_MIDDLE,
    VGI_RING,
    VGI_PINKY,
    VGI_HIP_JOINT,
    VGI_THIGH,
    VGI_SHIN,
    VGI_FOOT,
    VGI_TOE,
    /* only while names are read: */
    VGI_SHOULDER,  /* clavicle or upper arm */
    VGI_SIDED_HIP, /* thigh, or a joint above it */
    VGI_ARM,       /* upper arm, or all of the arm joint by joint */
    VGI_LEG,       /* shin, thigh above a knee, or all of the leg joint by joint */
    VGI_WRIST,     /* hand */
    VGI_PALM,      /* hand, or a joint below it */
    VGI_ANKLE      /* foot; a foot below it is a toe */
} vgi_part;

typedef struct vgi_role {
    uint8_t part; /* a vgi_part */
    int8_t side;  /* 1 left, -1 right, 0 middle */
} vgi_role;

/* vgi_name_roles: what the names alone tell, also the parts that are open. */
int vgi_name_roles(const vg_skeleton *s, vgi_role *roles, vg_err *e) VG_MUST_CHECK;
/* vgi_guess_roles: roles from the positions of the joints at rest. If the shape is not that of a body, roles stay as they are. */
int vgi_guess_roles(const vg_skeleton *s, const double *at, vgi_role *roles, vg_err *e) VG_MUST_CHECK;
/* vgi_joint_roles: the roles of all joints (njoints), from their names as Mixamo, CMU, Unreal, MakeHuman, Rigify,
 * Biped, Daz and others write them, and from the hierarchy; from the shape of the skeleton if no name is that of a
 * limb; guessed (or NULL): whether that has found limbs. */
int vgi_joint_roles(const vg_skeleton *s, vgi_role *roles, bool *guessed, vg_err *e) VG_MUST_CHECK;
/* vgi_role_is_limb: whether it is upper arm, forearm, thigh or shin. */
bool vgi_role_is_limb(vgi_role r);

#endif
