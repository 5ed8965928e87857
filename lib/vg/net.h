/* vg/net.h: features of a mesh, and networks that learn to continue a sequence.
 * A part of vg.h, which says what holds for all parts. The mathematics: MATH 12; (L n) cites Qiao, Lai, Fu, Gao:
 * Synthesizing Mesh Deformation Sequences With Bidirectional LSTM.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_NET_H
#define VG_PART_NET_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Features (L 3.1): for each vertex the rotation vector w and the symmetric stretch S (xx xy xz yy yz zz) of its
 * neighbourhood relative to the reference pose. With 12 numbers also the offset of the vertex from where w and S of its
 * neighbours put it, in the frame of the neighbourhood, which makes the inverse exact. w is relative to the rotation of the
 * root, the middle of the largest component; that rotation and the centroid of each component are separate. */
typedef struct vg_featurer vg_featurer;
typedef struct vg_feature_options {
    bool nine;  /* w and S alone, as published: the inverse is not exact */
    bool plain; /* w is not relative to the root, whose rotation is the identity */
    int threads;
} vg_feature_options;
typedef struct vg_feature_stats {
    size_t width;      /* numbers per vertex: 9 or 12 */
    size_t parts, main_part; /* connected components; the largest */
    size_t open_rings; /* vertices whose neighbourhood, with its normal, does not span space */
    uint64_t jumps;    /* edges over which w jumps by more than half a turn, summed over the poses so far */
    uint64_t poses;    /* measured so far */
} vg_feature_stats;

/* vg_featurer_new: m is not kept; reference: nv points, copied. o NULL: 12 numbers, the root, one thread. VG_EINPUT
 * when the mesh has no faces. */
int vg_featurer_new(vg_featurer **f, const vg_mesh *m, const double *reference, const vg_feature_options *o,
                    vg_err *e) VG_MUST_CHECK;
void vg_featurer_free(vg_featurer **f);
vg_feature_stats vg_featurer_get_stats(const vg_featurer *f);
/* vg_featurer_restart: the next pose begins another sequence: its w need not be continuous with those of the pose before. */
void vg_featurer_restart(vg_featurer *f);
/* vg_featurer_measure: n poses (nv points each), in the order of the sequence. Out, for each: `width` numbers per vertex, a unit
 * quaternion for the root and a point per component. Eight poses per thread at a time are fastest. On failure the output is
 * undefined. */
int vg_featurer_measure(vg_featurer *f, size_t n, const double *const *poses, double *const *values,
                        double *const *roots, double *const *centroids, vg_err *e) VG_MUST_CHECK;
/* vg_featurer_solve: the inverse: n poses from their features. A root that is NULL is the identity. */
void vg_featurer_solve(vg_featurer *f, size_t n, const double *const *values, const double *const *roots,
                       const double *const *centroids, double *const *vertices);

#define VG_HOLD_BY_SEED (SIZE_MAX - 1)
typedef struct vg_train_options {
    vg_network_model model;
    vg_direction direction;
    size_t layers, hidden, convolutions;
    size_t iterations, batch, frames; /* batch: pieces of sequences per iteration; frames: length of each */
    size_t step;              /* use every step-th frame */
    size_t given_least, given_most; /* number of given frames, drawn for each iteration */
    size_t coordinates;       /* largest number of principal coordinates */
    double hold;              /* share of each sequence that is held out, as one block */
    size_t hold_at;           /* first frame of that block; SIZE_MAX: at the end; VG_HOLD_BY_SEED: drawn */
    double rate;              /* initial learning rate of Adam; falls to 2 % of it along a cosine */
    double bidirectional, divergence, decay; /* weights of losses: between the two directions, KL, squared parameters */
    bool nine;                /* features of 9 numbers */
    uint64_t seed;
    int threads;
} vg_train_options;
/* vg_train_defaults: the defaults of vg-train for this model (MATH 12). */
vg_train_options vg_train_defaults(vg_network_model m);

typedef struct vg_trainer vg_trainer;
typedef struct vg_train_state {
    uint64_t iteration, iterations; /* done, and planned, in this phase */
    int phase;            /* 0: without a validation block, to find the number of iterations; 1: on all frames */
    double loss;          /* mean distance of a predicted frame, forward, in normalised numbers of a frame */
    double gradient;      /* norm of the gradient before clipping */
    double validation;    /* mean distance in the validation block after this iteration; NaN: not measured */
    uint64_t best_iteration;
    size_t parameters, coordinates, frames, held;
} vg_train_state;

/* vg_trainer_new: reference: nv points; both are copied. */
int vg_trainer_new(vg_trainer **t, const vg_mesh *m, const double *reference, const vg_train_options *o,
                   vg_err *e) VG_MUST_CHECK;
void vg_trainer_free(vg_trainer **t);
/* vg_trainer_add: n poses of the current sequence. Poses that repeat the one before are left out.
 * vg_trainer_cut: the next pose begins another sequence. */
int vg_trainer_add(vg_trainer *t, size_t n, const double *const *poses, vg_err *e) VG_MUST_CHECK;
void vg_trainer_cut(vg_trainer *t);
/* vg_trainer_prepare: after the last pose: choose the frames held out, compute the principal coordinates and the regression.
 * VG_EINPUT if there are too few poses. */
int vg_trainer_prepare(vg_trainer *t, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_resume: continue the training of the checkpoint `from`. VG_EINPUT if its training has ended, or if its poses or
 * options are not those of t. */
int vg_trainer_resume(vg_trainer *t, const vg_network *from, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_get_state: the present state; loss and gradient are 0 before the first iteration. */
vg_train_state vg_trainer_get_state(const vg_trainer *t);
/* vg_trainer_step: one iteration. Returns 1, or 0 when training has ended. VG_EINPUT if the loss is not finite. */
int vg_trainer_step(vg_trainer *t, vg_train_state *state, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_judge: measure the errors in the frames held out, and store them in the network. */
int vg_trainer_judge(vg_trainer *t, vg_network_errors *errors, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_network: a copy of the network in its present state; complete: without what only a checkpoint needs. */
int vg_trainer_network(const vg_trainer *t, bool complete, vg_network *n, vg_err *e) VG_MUST_CHECK;

/* Several processes may train together (make MPI=1, started by mpirun): each adds the same poses and takes the same steps.
 * Each then has the network that a single process would have, bit for bit.
 * vg_train_process: the number of this process, from 0. vg_train_any: called by all: whether `yes` is true in any of them.
 * Without MPI: 0, and `yes`. */
size_t vg_train_process(void);
bool vg_train_any(bool yes);

/* Generates poses by a network: continues from given poses. */
typedef struct vg_generator vg_generator;
typedef struct vg_generate_options {
    bool stay;         /* the root stays where it is in the last given pose; else it moves as in training */
    double diversity;  /* standard deviation of random initial states; 0: the initial states of training */
    uint64_t seed;
    /* between keys: */
    bool optimise;     /* search for the initial states from which the poses end nearest to the key */
    double merge;      /* > 0: as published: draw initial states until the poses from both keys come this near to one another;
                          a share of the range of the training data */
    int threads;
} vg_generate_options;

/* How the poses between two keys were found. */
typedef struct vg_way {
    double backward;   /* weight of the poses generated from the second key back to the first, in the mean of both */
    bool merged;       /* both directions came near enough, and are joined where they are nearest */
    double miss;       /* distance of the better end from the key, or of the two directions, before it was spread over the poses; a
                          share of the range of the training data */
    size_t tries;      /* pairs of directions tried, or rounds of the search */
} vg_way;

/* vg_generator_new: n: borrowed until free, fits m (else VG_EINPUT); reference: nv points. */
int vg_generator_new(vg_generator **g, const vg_network *n, const vg_mesh *m, const double *reference,
                     const vg_generate_options *o, vg_err *e) VG_MUST_CHECK;
void vg_generator_free(vg_generator **g);
/* vg_generator_give: the next given pose (nv points). */
int vg_generator_give(vg_generator *g, const double *pose, vg_err *e) VG_MUST_CHECK;
/* vg_generator_next: the pose (nv points out) that follows those given and generated so far. VG_EARG if none was given;
 * VG_EINPUT if it is not finite. */
int vg_generator_next(vg_generator *g, double *pose, vg_err *e) VG_MUST_CHECK;
/* vg_generator_between: n poses from the last given pose to `key`, which then is the last given one. They are generated
 * forward from the first and backward from the second; the distance that the better one misses its end by is spread over its
 * poses; or as the options say. loop: the key closes a cycle: its body is met, and the root moves on as the network moves it.
 * way may be NULL. */
int vg_generator_between(vg_generator *g, const double *key, bool loop, size_t n, double *const *poses, vg_way *way,
                         vg_err *e) VG_MUST_CHECK;
/* vg_generator_change: mean change of the features over the last 16 frames, relative to that of the training data: far below 1
 * the motion freezes, far above 1 it diverges. */
double vg_generator_change(const vg_generator *g);
/* vg_generator_drift: mean distance of the coordinates of the last 16 frames, before clamping, from the range of the training data,
 * as a share of it. */
double vg_generator_drift(const vg_generator *g);

#ifdef __cplusplus
}
#endif
#endif
