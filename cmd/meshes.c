/* meshes.c: a mesh in reports: how many vertices, faces of which sizes, and components.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "meshes.h"
#include "cli.h"

#include <inttypes.h>

static const report_column size_columns[] = {{.key = "size"}, {.key = "faces"}};

static uint32_t face_size(const vg_mesh *m, size_t f)
{
    return m->start[f + 1] - m->start[f];
}

enum { SIZES_SHOWN = 3 };

/* "838: 134 of 3, 626 of 4, 78 of 5 to 21": more than a few sizes are put together. */
static char *size_line(const vg_mesh *m, const uint64_t *count, size_t largest)
{
    cli_line line;
    size_t kinds = 0, at = 0, first = 0;
    uint64_t rest = 0;
    FILE *f = cli_line_open(&line, "the sizes of faces");
    for (size_t k = 2; k <= largest; k++) kinds += count[k] > 0;
    fprintf(f, "%zu", m->nf);
    for (size_t k = 2; k <= largest; k++) {
        if (!count[k]) continue;
        if (kinds <= SIZES_SHOWN || at < SIZES_SHOWN - 1)
            fprintf(f, "%s%" PRIu64 " of %zu", at ? ", " : ": ", count[k], k);
        else rest += count[k], first = first ? first : k;
        at++;
    }
    if (rest) fprintf(f, ", %" PRIu64 " of %zu to %zu", rest, first, largest);
    return cli_line_close(&line);
}

/* How many faces there are of each size, as rows in JSON and as one line in the text. */
static void report_faces(report *r, const vg_mesh *m)
{
    size_t largest = 0;
    for (size_t f = 0; f < m->nf; f++) largest = face_size(m, f) > largest ? face_size(m, f) : largest;
    uint64_t *count = cli_allocate(largest, sizeof *count, "the sizes of faces");
    for (size_t f = 0; f < m->nf; f++) count[face_size(m, f)]++;
    char *line = size_line(m, count, largest);
    report_put(r, "faces", NULL, report_count(m->nf));
    report_put(r, NULL, "faces", report_text(line));
    report_table(r, "face_sizes", NULL, false, size_columns, 2);
    for (size_t k = 2; k <= largest; k++) {
        const report_value row[2] = {report_count(k), report_count(count[k])};
        if (count[k]) report_row(r, row);
    }
    free(line);
    free(count);
}

static void report_components(report *r, const vg_mesh *m)
{
    size_t components = 0, isolated = 0;
    vg_err e;
    uint32_t *label = cli_allocate(m->nv, sizeof *label, "the components of the mesh");
    if (vg_mesh_components(m, label, &components, &e) < 0) cli_die(&e);
    for (size_t v = 0; v < m->nv; v++) isolated += label[v] == UINT32_MAX;
    free(label);
    report_put(r, "components", "components", report_count(components));
    report_put(r, "isolated_vertices", isolated ? "isolated" : NULL, report_count(isolated));
}

void report_mesh(report *r, const vg_head *h)
{
    const vg_attributes *a = &h->body.attributes;
    if (!h->body.reference) return;
    report_gap(r);
    report_group(r, "mesh");
    report_put(r, "vertices", "vertices", report_count(h->body.mesh.nv));
    report_faces(r, &h->body.mesh);
    report_components(r, &h->body.mesh);
    report_put(r, "D", "D", report_number(vg_diagonal(h->body.reference, h->body.mesh.nv)));
    report_put(r, "reference", "reference", report_text(h->body.reference_name ? h->body.reference_name : ""));
    report_put(r, "texture_coordinates", a->ntex ? "texture coordinates" : NULL, report_count(a->ntex));
    report_put(r, "colours", a->ncolours ? "colours" : NULL, report_count(a->ncolours));
    char asset[200];
    vg_asset_text(&h->body.asset, asset, sizeof asset);
    report_put(r, "asset", *asset ? "asset" : NULL, h->body.asset.n ? report_text(asset) : report_nothing());
    report_put(r, "labels", a->nlabels ? "labels" : NULL, report_count(a->nlabels));
    report_put(r, "selected_faces", h->selection.chosen ? "selected faces" : NULL,
               h->selection.chosen ? report_count(h->selection.n) : report_nothing());
    report_put(r, "links", h->links.chosen ? "links" : NULL, h->links.chosen ? report_count(h->links.n) : report_nothing());
    report_put(r, "anchors", h->nanchors ? "anchors" : NULL, report_count(h->nanchors));
    report_end(r);
}
