/* face_rows.c: the faces of a graph, as rows of a solver's factor. Searches that start from the plain solution
 * (planar.c, robust.c) visit all faces in every step; in row order neighbours are close in memory.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/face_rows.h"
#include "model/incidence.h"
#include "numeric/vec3.h"

#include <stdlib.h>

typedef struct place {
    uint32_t row, face;
} place;

static int compare_places(const void *a, const void *b)
{
    const place *x = a, *y = b;
    return x->row != y->row ? (x->row > y->row) - (x->row < y->row) : (x->face > y->face) - (x->face < y->face);
}

static uint32_t least_row(const vg_graph *g, const uint32_t *row, size_t f)
{
    uint32_t least = UINT32_MAX;
    for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++)
        if (row[g->faces.vert[c]] < least) least = row[g->faces.vert[c]];
    return least;
}

/* Number the held vertices, so that every attached vertex has a row. */
static void number_held(vgi_face_rows *r, const vgi_solver_view *s, uint32_t *rows)
{
    size_t n = 0;
    for (size_t v = 0; v < s->g->faces.nv; v++) {
        if (!s->g->in_face[v] || rows[v] < s->rows) continue;
        rows[v] = (uint32_t)(s->rows + n);
        r->held[n++] = (uint32_t)v;
    }
}

static void list_faces(vgi_face_rows *r, const vg_graph *g, size_t least, const uint32_t *rows, place *places)
{
    size_t n = 0;
    for (size_t f = 0; f < g->faces.nf; f++) {
        if (vgi_face_size(&g->faces, f) < least) continue;
        r->face[n] = (uint32_t)f;
        places[n] = (place){least_row(g, rows, f), (uint32_t)n};
        n++;
    }
    qsort(places, n, sizeof *places, compare_places);
    for (size_t i = 0; i < n; i++) {
        size_t f = r->face[places[i].face];
        r->order[places[i].face] = (uint32_t)i;
        r->start[i + 1] = r->start[i];
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) r->row[r->start[i + 1]++] = rows[g->faces.vert[c]];
    }
}

int vgi_face_rows_make(vgi_face_rows *r, const vgi_solver_view *s, size_t least, vg_err *e)
{
    const vg_graph *g = s->g;
    size_t corners = 0;
    *r = (vgi_face_rows){0};
    for (size_t f = 0; f < g->faces.nf; f++)
        if (vgi_face_size(&g->faces, f) >= least) r->nf++, corners += vgi_face_size(&g->faces, f);
    for (size_t v = 0; v < g->faces.nv; v++) r->nheld += g->in_face[v] && s->row[v] >= s->rows;
    uint32_t *rows = vgi_copy_array(s->row, g->faces.nv, sizeof *rows, e);
    place *places = vgi_array_raw(r->nf, sizeof *places, e);
    r->held = vgi_array_raw(r->nheld, sizeof *r->held, e);
    r->face = vgi_array_raw(r->nf, sizeof *r->face, e);
    r->order = vgi_array_raw(r->nf, sizeof *r->order, e);
    r->start = vgi_array(r->nf + 1, sizeof *r->start, e);
    r->row = vgi_array_raw(corners, sizeof *r->row, e);
    bool ok = rows && places && r->held && r->face && r->order && r->start && r->row;
    if (ok) {
        number_held(r, s, rows);
        list_faces(r, g, least, rows, places);
    }
    free(rows);
    free(places);
    return ok ? VG_OK : VG_ENOMEM;
}

void vgi_face_rows_clear(vgi_face_rows *r)
{
    free(r->held);
    free(r->face);
    free(r->order);
    free(r->start);
    free(r->row);
    *r = (vgi_face_rows){0};
}

void vgi_keep_root(const vg_graph *g, double *x, const double root[3])
{
    double now[3], shift[3];
    vg_graph_root(g, x, now);
    vgi_subtract(root, now, shift);
    for (size_t v = 0; v < g->faces.nv; v++)
        if (g->in_face[v]) vgi_add(x + 3 * v, shift);
}
