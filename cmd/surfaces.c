/* surfaces.c: vg-diff --surface: the distance between the surfaces of two sequences, frame by frame, and its report.
 * The distance is computed in lib/method/pairs/distance.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "surfaces.h"
#include "cli.h"

enum { COLUMNS_FRAME = 8, COLUMNS_WAY = 11 };
static const report_column frame_columns[] = {
    {.key = "frame", .title = "frame"}, {.key = "name", .title = "name"},   {.key = "mean", .title = "mean"},
    {.key = "p95", .title = "p95"},     {.key = "max", .title = "max"},     {.key = "mean_D", .title = "mean % of D"},
    {.key = "p95_D", .title = "p95 % of D"}, {.key = "max_D", .title = "max % of D"}};
static const report_column way_columns[] = {
    {.key = "way", .title = "surface distance"}, {.key = "mean", .title = "mean"}, {.key = "rms", .title = "rms"},
    {.key = "p95", .title = "p95"}, {.key = "max", .title = "max"}, {.title = "mean % of D"}, {.title = "max % of D"},
    {.key = "mean_D", .json_only = true}, {.key = "max_D", .json_only = true}, {.key = "frame", .json_only = true},
    {.key = "at", .json_only = true}};

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static double in_D(double x, double diagonal)
{
    return x == 0 ? 0 : x / diagonal;
}

void surfaces_begin(surfaces *s, const vg_body *truth, const vg_body *result, report *frames)
{
    vg_err e;
    s->diagonal = vg_diagonal(truth->reference, truth->mesh.nv);
    s->frames = frames;
    if (vg_surface_measures_new(&s->measures, &truth->mesh, &result->mesh, s->diagonal, cli_threads(), &e) < 0) cli_die(&e);
    if (frames) report_table(frames, "frame_errors", "", false, frame_columns, COLUMNS_FRAME);
}

const double *surfaces_add(surfaces *s, size_t i, const char *name, const double *truth, const double *result)
{
    vg_err e;
    vg_surface_distance found[2];
    if (vg_surface_measures_add(s->measures, truth, result, found, &e) < 0) cli_die(&e);
    if (s->frames) {
        double x[3] = {larger(found[0].mean, found[1].mean), larger(found[0].p95, found[1].p95), larger(found[0].max, found[1].max)};
        const double to = cli_json() ? 1 : 100;
        const report_value row[COLUMNS_FRAME] = {
            report_count(i), report_text(name), report_number(x[0]), report_number(x[1]), report_number(x[2]),
            report_number(to * in_D(x[0], s->diagonal)), report_number(to * in_D(x[1], s->diagonal)),
            report_number(to * in_D(x[2], s->diagonal))};
        report_row(s->frames, row);
    }
    return vg_surface_measures_vertices(s->measures);
}

static void report_way(report *r, const char *name, const vg_surface_distance *d, double diagonal)
{
    double mean = in_D(d->mean, diagonal), most = in_D(d->max, diagonal);
    const report_value row[COLUMNS_WAY] = {
        report_text(name), report_number(d->mean), report_number(d->rms), report_number(d->p95), report_number(d->max),
        report_number(100 * mean), report_number(100 * most), report_number(mean), report_number(most),
        report_count(d->frame), report_numbers(d->at, 3)};
    report_row(r, row);
}

void surfaces_report(const surfaces *s, report *r, double found[4])
{
    vg_surface_distance d[2];
    vg_surface_measures_get(s->measures, d);
    found[0] = larger(d[0].mean, d[1].mean), found[1] = larger(d[0].rms, d[1].rms);
    found[2] = larger(d[0].p95, d[1].p95), found[3] = larger(d[0].max, d[1].max);
    report_gap(r);
    report_table(r, "surface_distance", "", true, way_columns, COLUMNS_WAY);
    report_way(r, "truth_to_result", &d[0], s->diagonal);
    report_way(r, "result_to_truth", &d[1], s->diagonal);
    report_put(r, "hausdorff", "Hausdorff", report_number(found[3]));
    report_put(r, "hausdorff_D", NULL, report_number(in_D(found[3], s->diagonal)));
    report_gap(r);
    report_note(r, "From each point of one surface to the nearest point of the other, per frame; weighted by area.");
    report_note(r, "p95: 95 %% of the surface are nearer. Hausdorff: the larger of both directions.");
    report_note(r, "A hole or a part that only one of the two has shows in one direction only.");
    report_note(r, "D: the diagonal of the box around the reference pose of the truth, %.6g mesh units.", s->diagonal);
}

void surfaces_end(surfaces *s)
{
    vg_surface_measures_free(&s->measures);
}
