/* correspondences.c: a correspondence in reports: the faces it covers, by how many pairs, and how near they are.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "correspondences.h"
#include "cli.h"

#include <inttypes.h>
#include <math.h>

/* What a correspondence covers: how many faces, how near, by how many. */
typedef struct coverage {
    uint64_t matched, most_pairs, used;
    double sum, largest; /* distances of matched faces */
} coverage;

/* How many faces of the source drive anything: counted among the pairs, for how many it has is the stream's word only. */
static uint64_t count_sources(const vg_correspondence *c)
{
    size_t n = c->first[c->target_nf];
    uint32_t *faces = cli_allocate(n, sizeof *faces, "the pairs of a correspondence");
    uint64_t used = n > 0;
    if (n) memcpy(faces, c->source, n * sizeof *faces);
    qsort(faces, n, sizeof *faces, cli_by_number);
    for (size_t i = 1; i < n; i++) used += faces[i] != faces[i - 1];
    free(faces);
    return used;
}

static coverage cover(const vg_correspondence *c)
{
    coverage x = {.used = count_sources(c)};
    for (size_t f = 0; f < c->target_nf; f++) {
        uint64_t pairs = c->first[f + 1] - c->first[f];
        if (pairs > x.most_pairs) x.most_pairs = pairs;
        if (!c->matched[f]) continue;
        x.matched++;
        x.sum += c->distance[f];
        x.largest = fmax(x.largest, c->distance[f]);
    }
    return x;
}

static double percent(uint64_t part, uint64_t all)
{
    return all ? 100.0 * (double)part / (double)all : 0;
}

void report_correspondence(report *r, const vg_head *h, double D)
{
    const vg_correspondence *c = &h->correspondence;
    char line[160];
    if (!c->first) return;
    coverage x = cover(c);
    uint64_t pairs = c->first[c->target_nf];
    double mean = x.matched ? x.sum / (double)x.matched : NAN, largest = x.matched ? x.largest : NAN;
    report_gap(r);
    report_group(r, "correspondence");
    report_put(r, "source_vertices", NULL, report_count(c->source_nv));
    report_put(r, "source_faces", NULL, report_count(c->source_nf));
    report_put(r, "target_vertices", NULL, report_count(c->target_nv));
    report_put(r, "target_faces", NULL, report_count(c->target_nf));
    snprintf(line, sizeof line, "%zu faces, %zu vertices", c->target_nf, c->target_nv);
    report_put(r, NULL, "target", report_text(line));
    report_put(r, "matched_faces", NULL, report_count(x.matched));
    report_put(r, "unmatched_faces", NULL, report_count(c->target_nf - x.matched));
    snprintf(line, sizeof line, "%" PRIu64 " of %zu faces (%.4g %%), %" PRIu64 " follow others", x.matched,
             c->target_nf, percent(x.matched, c->target_nf), (uint64_t)c->target_nf - x.matched);
    report_put(r, NULL, "matched", report_text(line));
    report_put(r, "source_faces_used", NULL, report_count(x.used));
    snprintf(line, sizeof line, "%" PRIu64 " of %zu faces (%.4g %%)", x.used, c->source_nf,
             percent(x.used, c->source_nf));
    report_put(r, NULL, "source used", report_text(line));
    report_put(r, "pairs", NULL, report_count(pairs));
    report_put(r, "most_pairs", NULL, report_count(x.most_pairs));
    snprintf(line, sizeof line, "%" PRIu64 ", %.3g a face on average, at most %" PRIu64, pairs,
             c->target_nf ? (double)pairs / (double)c->target_nf : 0, x.most_pairs);
    report_put(r, NULL, "pairs", report_text(line));
    report_put(r, "mean_distance", NULL, report_number(mean));
    report_put(r, "largest_distance", NULL, report_number(largest));
    report_put(r, "mean_distance_D", NULL, report_number(D > 0 ? mean / D : NAN));
    report_put(r, "largest_distance_D", NULL, report_number(D > 0 ? largest / D : NAN));
    if (x.matched && D > 0) {
        snprintf(line, sizeof line, "mean %.3g, at most %.3g (%.3g D and %.3g D)", mean, largest, mean / D,
                 largest / D);
        report_put(r, NULL, "distances", report_text(line));
    }
    report_end(r);
}
