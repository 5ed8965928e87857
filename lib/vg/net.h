/* vg/net.h: features of a mesh, and networks that learn how a sequence goes on.
 * A part of vg.h, which says what holds for all parts. The mathematics: MATH 12; (L n) cites Qiao, Lai, Fu, Gao:
 * Synthesizing Mesh Deformation Sequences With Bidirectional LSTM.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_NET_H
#define VG_PART_NET_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Features (L 3.1): per vertex the rotation vector w and the symmetric stretch S (xx xy xz yy yz zz) of its
 * neighbourhood, beside the reference pose, and with 12 numbers also the vector from where these alone would put the
 * vertex, in the frame of the neighbourhood: then the way back is exact. The rotation of the root, the middle of the
 * largest component, is taken out of w; it and the centroid of each component go beside the features. */
typedef struct vg_featurer vg_featurer;
typedef struct vg_feature_options {
    bool nine;  /* w and S alone, as printed: the way back is not exact */
    bool plain; /* the root is not turned: w is that of the pose as it is */
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
/* vg_featurer_restart: the next pose begins another sequence: its whole turns are chosen afresh. */
void vg_featurer_restart(vg_featurer *f);
/* vg_featurer_measure: n poses (nv points each), in order, to width numbers per vertex, a unit quaternion for the root
 * and a point per component each. Eight poses per thread at a time are fastest. On failure nothing is defined. */
int vg_featurer_measure(vg_featurer *f, size_t n, const double *const *poses, double *const *values,
                        double *const *roots, double *const *centroids, vg_err *e) VG_MUST_CHECK;
/* vg_featurer_solve: the way back. A root NULL: not turned. */
void vg_featurer_solve(vg_featurer *f, size_t n, const double *const *values, const double *const *roots,
                       const double *const *centroids, double *const *vertices);

#define VG_HOLD_BY_SEED (SIZE_MAX - 1)
typedef struct vg_train_options {
    vg_network_model model;
    vg_direction direction;
    size_t layers, hidden, convolutions;
    size_t iterations, batch, frames; /* batch: sequences per iteration; frames: length of each */
    size_t step;              /* use every step-th frame */
    size_t given_least, given_most; /* frames that are given, drawn for each iteration */
    size_t coordinates;       /* at most */
    double hold;              /* share of each sequence that is held out: one block */
    size_t hold_at;           /* from this frame of each sequence on; SIZE_MAX: at its end; VG_HOLD_BY_SEED: by the seed */
    double rate;              /* of Adam, falling to 2 % by a cosine */
    double bidirectional, divergence, decay; /* weights of losses: between the chains, KL, squared parameters */
    bool nine;                /* features as printed */
    uint64_t seed;
    int threads;
} vg_train_options;
/* vg_train_defaults: what MATH 12 found to work for this model. */
vg_train_options vg_train_defaults(vg_network_model m);

typedef struct vg_trainer vg_trainer;
typedef struct vg_train_state {
    uint64_t iteration, iterations; /* done, and planned, in this phase */
    int phase;            /* 0: beside a validation block, to find out how long; 1: on all frames */
    double loss;          /* mean distance per frame of the forward chains, in the numbers of a frame */
    double gradient;      /* its length before it was clipped */
    double validation;    /* mean distance in the validation block behind this iteration; NaN: not measured */
    uint64_t best_iteration;
    size_t parameters, coordinates, frames, held;
} vg_train_state;

/* vg_trainer_new: reference: nv points; both are copied. */
int vg_trainer_new(vg_trainer **t, const vg_mesh *m, const double *reference, const vg_train_options *o,
                   vg_err *e) VG_MUST_CHECK;
void vg_trainer_free(vg_trainer **t);
/* vg_trainer_add: n poses of the sequence at hand. Poses that repeat the one before are left out.
 * vg_trainer_cut: the next pose begins another sequence. */
int vg_trainer_add(vg_trainer *t, size_t n, const double *const *poses, vg_err *e) VG_MUST_CHECK;
void vg_trainer_cut(vg_trainer *t);
/* vg_trainer_prepare: all poses are there: hold some out, find the coordinates and the regression. VG_EINPUT when
 * there are too few. */
int vg_trainer_prepare(vg_trainer *t, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_resume: go on where the training of `from`, prepared in the same way from the same poses, was. */
int vg_trainer_resume(vg_trainer *t, const vg_network *from, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_get_state: as it is now; no loss is known before the first iteration. */
vg_train_state vg_trainer_get_state(const vg_trainer *t);
/* vg_trainer_step: one iteration: 1, or 0 when training has ended. VG_EINPUT when numbers have run away. */
int vg_trainer_step(vg_trainer *t, vg_train_state *state, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_judge: measure the errors in what is held out; kept in the network. */
int vg_trainer_judge(vg_trainer *t, vg_network_errors *errors, vg_err *e) VG_MUST_CHECK;
/* vg_trainer_network: as it is now; complete: nothing is kept that only training needs. */
int vg_trainer_network(const vg_trainer *t, bool complete, vg_network *n, vg_err *e) VG_MUST_CHECK;

/* Several processes may train together (make MPI=1, started by mpirun): each adds the same poses and takes the same steps,
 * and all have the same network, which is that of one process to the last bit.
 * vg_train_process: the number of this one, from 0. vg_train_any: does any of them say yes? Without MPI: 0, and yes. */
size_t vg_train_process(void);
bool vg_train_any(bool yes);

/* A network at work: some poses are given, and it goes on from the last. */
typedef struct vg_generator vg_generator;
typedef struct vg_generate_options {
    bool stay;         /* the root stays where the last given pose has it; else it moves as it learned to */
    double diversity;  /* deviation of random initial states; 0: those of the training */
    uint64_t seed;
    /* between keys: */
    bool optimise;     /* search for the initial states whose way ends nearest to the key */
    double merge;      /* > 0: as printed: random initial states until the ways from both keys come so near to one another,
                          as a share of the training's range */
    int threads;
} vg_generate_options;

/* How a way from key to key was found. */
typedef struct vg_way {
    double backward;   /* weight of the way from the second key back to the first, in the mean of both */
    bool merged;       /* both ways came near enough, and are joined where they are nearest */
    double miss;       /* how far the end of the better one was from the key, or both ways from one another, as a share of the training's
                          range, before it was spread over the way */
    size_t tries;      /* pairs of ways that were looked at, or rounds of the search */
} vg_way;

/* vg_generator_new: n: borrowed until free, fits m (else VG_EINPUT); reference: nv points. */
int vg_generator_new(vg_generator **g, const vg_network *n, const vg_mesh *m, const double *reference,
                     const vg_generate_options *o, vg_err *e) VG_MUST_CHECK;
void vg_generator_free(vg_generator **g);
/* vg_generator_give: the next given pose (nv points). */
int vg_generator_give(vg_generator *g, const double *pose, vg_err *e) VG_MUST_CHECK;
/* vg_generator_next: the next pose (nv points out), from what was given and what came of it. */
int vg_generator_next(vg_generator *g, double *pose, vg_err *e) VG_MUST_CHECK;
/* vg_generator_between: n poses that lead from the last given pose to `key`, which then is the last given one: the
 * better of the network's ways from the first and back from the second, whose miss at the end is spread over it; or as
 * the options say. loop: the key closes a cycle: its body is met, and the root's shift goes on as the network moves it.
 * way may be NULL. */
int vg_generator_between(vg_generator *g, const double *key, bool loop, size_t n, double *const *poses, vg_way *way,
                         vg_err *e) VG_MUST_CHECK;
/* vg_generator_change: mean change of features over the last frames that came out, beside that of the training:
 * far below 1, and the motion freezes; far above, and it runs away. */
double vg_generator_change(const vg_generator *g);
/* vg_generator_drift: how far the last coordinates wanted to be outside of the range of the training, as a share of it. */
double vg_generator_drift(const vg_generator *g);

#ifdef __cplusplus
}
#endif
#endif
