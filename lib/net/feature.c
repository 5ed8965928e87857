/* feature.c: features of a sequence of poses, and poses from features (MATH 12). Blocks of eight poses are measured
 * side by side; whole turns are chosen pose after pose. The computation is in feature_kernel.c, the mesh in rings.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/feature.h"
#include "net/branch.h"
#include "net/feature_kernel.h"
#include "numeric/polar.h"

#include <stdlib.h>

struct vg_featurer {
    vgi_rings rings;
    size_t width;
    bool plain;
    int threads;
    vgi_feature_block *blocks; /* one per thread */
    double **spill;  /* per thread: target of unused lanes of a block */
    bool begun;      /* whether there is a previous pose: */
    double *before;  /* its rotation vectors w, 3 per vertex */
    double before_root[4];
    uint64_t jumps, poses;
};

static int make_block(vgi_feature_block *b, const vgi_rings *r, vg_err *e)
{
    *b = (vgi_feature_block){0};
    size_t rows = 3 * r->nv + r->nparts, all = rows * sizeof(vgi_row) + 18 * r->nv * sizeof(vgi_lanes);
    b->point = aligned_alloc(sizeof(vgi_lanes), all + sizeof(vgi_lanes));
    if (!b->point) return vg_fail(e, VG_ENOMEM, "out of memory: features of eight poses need %zu bytes", all);
    b->normal = b->point + r->nv;
    b->x = b->normal + r->nv;
    b->sum = b->x + r->nv;
    b->gradient = (vgi_lanes *)(b->sum + r->nparts);
    b->turn = b->gradient + 9 * r->nv;
    return VG_OK;
}

static void clear_block(vgi_feature_block *b)
{
    free(b->point);
    *b = (vgi_feature_block){0};
}

int vg_featurer_new(vg_featurer **out, const vg_mesh *m, const double *reference, const vg_feature_options *o,
                    vg_err *e)
{
    vg_featurer *f = *out = vgi_array(1, sizeof *f, e);
    if (!f) return VG_ENOMEM;
    f->width = o && o->nine ? VGI_NINE : VGI_TWELVE;
    f->plain = o && o->plain;
    f->threads = o && o->threads > 1 ? o->threads : 1;
    int r = vgi_rings_make(&f->rings, m, reference, e);
    size_t n = (size_t)f->threads, spill = f->width * m->nv + 3 * (f->rings.nparts + m->nv);
    if (r == VG_OK && (!(f->before = vgi_array(3 * m->nv, sizeof *f->before, e)) ||
                          !(f->blocks = vgi_array(n, sizeof *f->blocks, e)) ||
                          !(f->spill = vgi_array(n, sizeof *f->spill, e))))
        r = VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        r = make_block(&f->blocks[i], &f->rings, e);
        if (r == VG_OK && !(f->spill[i] = vgi_array(spill, sizeof **f->spill, e))) r = VG_ENOMEM;
    }
    if (r < 0) vg_featurer_free(out);
    return r;
}

void vg_featurer_free(vg_featurer **out)
{
    vg_featurer *f = *out;
    if (!f) return;
    for (size_t i = 0; i < (size_t)f->threads; i++) {
        if (f->blocks) clear_block(&f->blocks[i]);
        if (f->spill) free(f->spill[i]);
    }
    free(f->blocks);
    free(f->spill);
    free(f->before);
    vgi_rings_clear(&f->rings);
    free(f);
    *out = NULL;
}

vg_feature_stats vg_featurer_get_stats(const vg_featurer *f)
{
    return (vg_feature_stats){.width = f->width,
                              .parts = f->rings.nparts,
                              .main_part = f->rings.main_part,
                              .open_rings = f->rings.nopen,
                              .jumps = f->jumps,
                              .poses = f->poses};
}

void vg_featurer_restart(vg_featurer *f)
{
    f->begun = false;
}

typedef struct job {
    vg_featurer *f;
    size_t n, first; /* number of poses; first block of this round */
    const double *const *in, *const *roots_in, *const *centroids_in;
    double *const *out, *const *roots_out, *const *centroids_out;
} job;

static void in_rounds(vg_featurer *f, job *j, void (*task)(void *context, size_t i))
{
    size_t blocks = (j->n + VGI_LANES - 1) / VGI_LANES, most = (size_t)f->threads;
    for (j->first = 0; j->first < blocks; j->first += most)
        vgi_parallel(f->threads, blocks - j->first < most ? blocks - j->first : most, task, j);
}

/* ---- from poses to features ---- */

/* the common rotation of the vertices around the centre */
static void find_root(const vg_featurer *f, vgi_feature_block *b, size_t lane, double q[4])
{
    double sum[9] = {0}, *g = b->root[lane];
    for (size_t i = 0; i < f->rings.nball; i++)
        for (size_t k = 0; k < 9; k++) sum[k] += b->turn[9 * (size_t)f->rings.ball[i] + k][lane];
    vgi_fit_rotation(sum, g);
    if (f->plain)
        for (int k = 0; k < 9; k++) g[k] = k % 4 == 0;
    vg_quat_from_matrix(g, q);
    vg_quat_matrix(q, g); /* as the inverse will compute it */
}

static void measure_block(void *context, size_t task)
{
    const job *j = context;
    const vg_featurer *f = j->f;
    vgi_feature_block *b = &f->blocks[task];
    size_t first = (j->first + task) * VGI_LANES, lanes = j->n - first < VGI_LANES ? j->n - first : VGI_LANES;
    const double *poses[VGI_LANES];
    double *values[VGI_LANES], *centroids[VGI_LANES], q[4], *spill = f->spill[task];
    for (size_t k = 0; k < VGI_LANES; k++) {
        poses[k] = j->in[first + (k < lanes ? k : lanes - 1)];
        values[k] = k < lanes ? j->out[first + k] : spill;
        centroids[k] = k < lanes ? j->centroids_out[first + k] : spill + f->width * f->rings.nv;
    }
    vgi_feature_measure(&f->rings, b, poses);
    for (size_t k = 0; k < VGI_LANES; k++) find_root(f, b, k, k < lanes ? j->roots_out[first + k] : q);
    vgi_feature_put(&f->rings, b, f->width, poses, values, centroids);
}

/* choose the whole turns of one pose, and the sign of its root */
static int follow_branches(vg_featurer *f, double *w, double *root, vg_err *e)
{
    double same = 0;
    if (!f->begun && vgi_branch_first(&f->rings, w, f->width, e) < 0) return VG_ENOMEM;
    f->jumps += f->begun ? vgi_branch_next(&f->rings, w, f->width, f->before, 3)
                         : vgi_branch_settle(&f->rings, w, f->width, NULL, 0);
    for (int k = 0; k < 4; k++) same += root[k] * (f->begun ? f->before_root[k] : k == 0);
    for (int k = 0; k < 4; k++) f->before_root[k] = root[k] = same < 0 ? -root[k] : root[k];
    for (size_t v = 0; v < f->rings.nv; v++) memcpy(f->before + 3 * v, w + f->width * v, 3 * sizeof *w);
    f->begun = true;
    f->poses++;
    return VG_OK;
}

int vg_featurer_measure(vg_featurer *f, size_t n, const double *const *poses, double *const *values,
                        double *const *roots, double *const *centroids, vg_err *e)
{
    job j = {.f = f, .n = n, .in = poses, .out = values, .roots_out = roots, .centroids_out = centroids};
    in_rounds(f, &j, measure_block);
    for (size_t i = 0; i < n; i++)
        if (follow_branches(f, values[i], roots[i], e) < 0) return VG_ENOMEM;
    return VG_OK;
}

/* ---- from features to poses ---- */

static void solve_block(void *context, size_t task)
{
    const job *j = context;
    const vg_featurer *f = j->f;
    static const double unturned[4] = {1, 0, 0, 0};
    vgi_feature_block *b = &f->blocks[task];
    size_t first = (j->first + task) * VGI_LANES, lanes = j->n - first < VGI_LANES ? j->n - first : VGI_LANES;
    const double *values[VGI_LANES], *centroids[VGI_LANES];
    double *vertices[VGI_LANES] = {NULL};
    for (size_t k = 0; k < VGI_LANES; k++) {
        size_t i = first + (k < lanes ? k : lanes - 1);
        values[k] = j->in[i], centroids[k] = j->centroids_in[i];
        if (k < lanes) vertices[k] = j->out[i];
        vg_quat_matrix(j->roots_in && j->roots_in[i] ? j->roots_in[i] : unturned, b->root[k]);
    }
    vgi_feature_back(&f->rings, b, f->width, values, centroids, vertices, lanes);
}

void vg_featurer_solve(vg_featurer *f, size_t n, const double *const *values, const double *const *roots,
                       const double *const *centroids, double *const *vertices)
{
    job j = {.f = f, .n = n, .in = values, .roots_in = roots, .centroids_in = centroids, .out = vertices};
    in_rounds(f, &j, solve_block);
}

const vgi_rings *vgi_featurer_rings(const vg_featurer *f)
{
    return &f->rings;
}
