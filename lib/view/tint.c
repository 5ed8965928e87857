/* tint.c: the number of each vertex that is mapped to a colour: its distance from a truth, a scalar of the frame, or
 * the growth of its vectors; and the ends of the colour map. Shared by sheets and pages. The colours are in colour.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdio.h>

/* Smaller errors, in D, are rounding; the colour map never ends below. */
#define LEAST_ERROR 1e-9
/* Scales closer to 1 than this have one colour. */
#define LEAST_SCALE 0.01
/* Limit of doublings and halvings, for vectors that have collapsed or exploded. */
#define MOST_DOUBLED 20

/* ---- numbers ---- */

/* The distance of each corner from the centroid of its face. */
static void corner_lengths(const vg_mesh *m, const double *points, double *lengths)
{
    for (size_t f = 0; f < m->nf; f++) {
        double centre[3] = {0, 0, 0}, share = 1 / (double)(m->start[f + 1] - m->start[f]);
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++)
            vgi_add_scaled(centre, share, points + 3 * (size_t)m->vert[c]);
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            const double *p = points + 3 * (size_t)m->vert[c];
            lengths[c] = hypot(hypot(p[0] - centre[0], p[1] - centre[1]), p[2] - centre[2]);
        }
    }
}

static int measure_lengths(vgi_meter *m, const double *reference, vg_err *e)
{
    m->lengths = vgi_array_raw(vg_mesh_corners(m->mesh), sizeof *m->lengths, e);
    m->count = vgi_array(m->mesh->nv, sizeof *m->count, e);
    if (!m->lengths || !m->count) return VG_ENOMEM;
    corner_lengths(m->mesh, reference, m->lengths);
    for (size_t c = 0; c < vg_mesh_corners(m->mesh); c++) m->count[m->mesh->vert[c]] += m->lengths[c] > 0;
    return VG_OK;
}

int vgi_meter_init(vgi_meter *m, const vgi_tint *t, const vg_mesh *mesh, const double *reference, double unit,
                   vg_err *e)
{
    *m = (vgi_meter){.mesh = mesh, .unit = unit};
    m->numbers = vgi_array(mesh->nv, sizeof *m->numbers, e);
    int r = m->numbers ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && t->what == VG_TINT_SCALES) {
        m->now = vgi_array_raw(vg_mesh_corners(mesh), sizeof *m->now, e);
        r = m->now ? measure_lengths(m, reference, e) : VG_ENOMEM;
    }
    if (r < 0) vgi_meter_clear(m);
    return r;
}

void vgi_meter_clear(vgi_meter *m)
{
    free(m->numbers);
    free(m->lengths);
    free(m->now);
    free(m->count);
    *m = (vgi_meter){0};
}

/* The mean over a vertex's vectors of log2(length / reference length): the logarithm of the geometric mean of
 * their scales. */
static void measure_scales(vgi_meter *m, const double *points)
{
    const vg_mesh *mesh = m->mesh;
    memset(m->numbers, 0, mesh->nv * sizeof *m->numbers);
    corner_lengths(mesh, points, m->now);
    for (size_t c = 0; c < vg_mesh_corners(mesh); c++) {
        if (!(m->lengths[c] > 0)) continue;
        double doubled = log2(m->now[c] / m->lengths[c]);
        doubled = fmin(fmax(doubled, -MOST_DOUBLED), MOST_DOUBLED);
        m->numbers[mesh->vert[c]] += doubled / m->count[mesh->vert[c]];
    }
}

static void measure_errors(vgi_meter *m, bool centred, const double *points, const double *truth)
{
    size_t nv = m->mesh->nv;
    double shift[3] = {0, 0, 0}, a[3], b[3];
    if (centred) {
        vg_centroid(points, nv, a);
        vg_centroid(truth, nv, b);
        vgi_subtract(a, b, shift);
    }
    for (size_t v = 0; v < nv; v++) {
        double d[3];
        vgi_subtract(points + 3 * v, truth + 3 * v, d), vgi_deduct(d, shift), vgi_divide(d, m->unit);
        m->numbers[v] = vgi_length(d);
    }
}

static int same_name(vgi_tint *t, const vg_frame *f, vg_err *e)
{
    const vg_channel *c = vg_frame_scalars(f);
    if (!t->name) {
        t->name = vgi_copy_string(c->name, strlen(c->name), e);
        t->unit = vgi_copy_string(c->unit, strlen(c->unit), e);
        return t->name && t->unit ? VG_OK : VG_ENOMEM;
    }
    if (!strcmp(t->name, c->name) && !strcmp(t->unit, c->unit)) return VG_OK;
    return vg_fail(e, VG_EINPUT,
                   "frame '%s' has '%s' in '%s', but earlier frames have '%s' in '%s': one colour map cannot show "
                   "both", f->name,
                   c->name, c->unit, t->name, t->unit);
}

bool vgi_tint_has(const vgi_tint *t, const vg_frame *f, const double *truth)
{
    return t->what == VG_TINT_SCALES || (t->what == VG_TINT_ERRORS && truth) ||
           (t->what == VG_TINT_SCALARS && vg_frame_scalars(f));
}

int vgi_tint_read(vgi_tint *t, vgi_meter *m, const vg_frame *f, const double *truth, vgi_spread *s, vg_err *e)
{
    size_t nv = m->mesh->nv;
    int r = VG_OK;
    if (t->what == VG_TINT_SCALES) measure_scales(m, f->values);
    else if (t->what == VG_TINT_ERRORS) measure_errors(m, t->centred, f->values, truth);
    else r = same_name(t, f, e);
    if (r < 0) return r;
    if (t->what == VG_TINT_SCALARS && nv) memcpy(m->numbers, vg_frame_scalars(f)->numbers, nv * sizeof *m->numbers);
    *s = (vgi_spread){.least = nv ? m->numbers[0] : 0, .most = nv ? m->numbers[0] : 0};
    for (size_t v = 0; v < nv; v++) {
        s->mean += m->numbers[v] / (double)nv;
        s->least = fmin(s->least, m->numbers[v]), s->most = fmax(s->most, m->numbers[v]);
    }
    if (!isfinite(s->mean))
        return vg_fail(e, VG_EINPUT, "frame '%s': its coordinates are too large for colours", f->name ? f->name : "");
    return VG_OK;
}

/* ---- ends of the colours ---- */

double vgi_round_up(double x)
{
    static const double steps[] = {1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10};
    double power = pow(10, floor(log10(x) + 1e-9));
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++)
        if (steps[i] * power >= x * (1 - 1e-9)) return steps[i] * power;
    return 10 * power;
}

/* End of the colours of scales: the factor that 99 % do not exceed, up or down, rounded up to two digits. */
static double end_of_scales(double doubled)
{
    double beyond = exp2(doubled) - 1, step = beyond > LEAST_ERROR ? pow(10, floor(log10(beyond)) - 1) : 1;
    return 1 + fmax(ceil(beyond / step - 1e-9) * step, LEAST_SCALE);
}

void vgi_tint_end(vgi_tint *t, double given, double common, double least, double most)
{
    t->diverging = t->what == VG_TINT_SCALES || (t->what == VG_TINT_SCALARS && least < 0);
    if (t->what == VG_TINT_SCALES) t->high = log2(given > 0 ? given : end_of_scales(common));
    else if (given > 0) t->high = given;
    else if (t->what == VG_TINT_ERRORS) t->high = common > LEAST_ERROR ? vgi_round_up(common) : LEAST_ERROR;
    else t->high = common > 0 ? vgi_round_up(common) : 1;
    t->low = t->diverging ? -t->high : 0;
    t->shown_low = t->diverging ? fmin(fmax(least, t->low), 0) : t->low;
    t->shown_high = t->diverging ? fmax(fmin(most, t->high), 0) : t->high;
    if (!(t->shown_low < t->shown_high)) t->shown_low = t->low, t->shown_high = t->high;
}

double vgi_tint_place(const vgi_tint *t, double x)
{
    return fmin(fmax((x - t->low) / (t->high - t->low), 0), 1);
}

double vgi_tint_shown(const vgi_tint *t, double x)
{
    return t->what == VG_TINT_SCALES ? exp2(x) : x;
}

void vgi_tint_clear(vgi_tint *t)
{
    free(t->name);
    free(t->unit);
    *t = (vgi_tint){0};
}

/* ---- words ---- */

void vgi_print_number(char *to, size_t size, const char *format, double x)
{
    snprintf(to, size, format, x);
    for (; *to; to++)
        if (*to == ',') *to = '.';
}

void vgi_tint_number(const vgi_tint *t, double x, char to[VGI_NUMBER])
{
    vgi_print_number(to, VGI_NUMBER, t->what == VG_TINT_SCALES ? "%.3gx" : "%.3g", vgi_tint_shown(t, x));
}

void vgi_tint_caption(const vgi_tint *t, const vgi_spread *s, char *to, size_t size)
{
    char mean[VGI_NUMBER], least[VGI_NUMBER], most[VGI_NUMBER];
    vgi_tint_number(t, s->mean, mean);
    vgi_tint_number(t, s->least, least);
    vgi_tint_number(t, s->most, most);
    if (t->diverging) snprintf(to, size, "%s to %s  mean %s", least, most, mean);
    else snprintf(to, size, "mean %s  max %s", mean, most);
}

void vgi_tint_title(const vgi_tint *t, double diagonal, char *to, size_t size)
{
    char number[VGI_NUMBER];
    const char *centred = t->centred ? ", centred" : "";
    vgi_print_number(number, sizeof number, "%.4g", diagonal);
    if (t->what == VG_TINT_SCALES)
        snprintf(to, size, "length of vectors, as a multiple of that in the reference (geometric mean at a vertex)");
    else if (t->what == VG_TINT_SCALARS)
        snprintf(to, size, "%s%s%s%s", t->name, *t->unit ? " in units of " : "", t->unit,
                 strcmp(t->unit, "D") ? "" : " (diagonal of the reference)");
    else if (diagonal > 0)
        snprintf(to, size, "vertex error%s in units of D = %s (diagonal of the reference)",
                 t->centred ? ", centred," : "", number);
    else
        snprintf(to, size, "vertex error%s", centred);
}
