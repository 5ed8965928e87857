/* trainer.h: state of the training of a network. Internal; shared by train.c and judge.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TRAINER_H
#define VG_TRAINER_H

#include "net/best.h"
#include "net/dataset.h"
#include "net/loss.h"
#include "net/feature.h"
#include "net/runner.h"

struct vg_trainer {
    vg_train_options o;
    vg_featurer *featurer;
    vg_mesh mesh;
    vgi_dataset data;
    double *last;           /* the previous pose, nv points; begun: whether there is one */
    bool begun, cut; /* cut: the next pose starts a sequence */
    vg_network net;         /* current state: parameters, basis, regression of this phase, curve */
    size_t curve_cap;
    vgi_shape shape;
    /* this phase */
    vgi_spans fitted, tried; /* frames used for training, and the validation block */
    float *frames;          /* n x numbers, as the layers see them: coordinates, or borrowed from data */
    size_t length;          /* frames per training sequence */
    size_t *window, nwindows; /* possible first frames */
    vgi_choice choice;      /* chosen once for both phases */
    vgi_regression regression[2]; /* fitted to the frames of this phase */
    float *before;          /* for a network that corrects a regression: the frames that it puts before each frame,
                               see net_group */
    net_group *groups;
    size_t ngroups, at_once; /* at_once groups run at a time */
    float **gradient;       /* ngradients x sets * nparameters - left_out: of all groups at a time but the first, which
                               uses total */
    size_t ngradients;
    size_t left_out;        /* numbers of the matrix of the variance, if its gradient is made after all others */
    float *total, *moments;
    vgi_best best;
    vgi_runner runner;
    bool ready, ended;
    vg_train_state state;
    double best_error;
};

/* vgi_trainer_validate: mean distance of runs in the validation block, in numbers of a frame. */
int vgi_trainer_validate(vg_trainer *t, double *error, vg_err *e) VG_MUST_CHECK;

/* vgi_trainer_gradient: of one iteration, in t->total; loss: mean distance from the truth. */
int vgi_trainer_gradient(vg_trainer *t, double *loss, vg_err *e) VG_MUST_CHECK;

#endif
