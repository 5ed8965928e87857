/* losses.c: what an output does not keep of a sequence, as text.
 * Leaves out who says it, and of which file (sink.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

static bool has_faces_of(const vg_mesh *m, size_t least, size_t most)
{
    for (size_t f = 0; f < m->nf; f++) {
        size_t n = m->start[f + 1] - m->start[f];
        if (n >= least && n <= most) return true;
    }
    return false;
}

/* Whether the OBJ names a material library, which the new file also names. */
static bool names_library(const vg_body *b)
{
    for (size_t i = 0; i < b->attributes.nlabels; i++)
        if (b->attributes.labels[i].kind == VG_LABEL_LIBRARY) return true;
    return false;
}

static int add_loss(vg_bytes *line, const char *what, vg_err *e)
{
    int r = line->size ? vgi_bytes_append(line, "; ", 2, e) : VG_OK;
    return r < 0 ? r : vgi_bytes_append(line, what, strlen(what), e);
}

int vgi_losses_list(const vgi_losses *x, vg_bytes *line, vg_err *e)
{
    const vg_body *b = &x->head->body;
    const unsigned keeps = x->keeps;
    char scalars[120], asset[160];
    vg_asset_text(&b->asset, asset, sizeof asset);
    snprintf(scalars, sizeof scalars, "the '%s' of the vertices", x->scalars);
    bool faces = keeps & VGI_KEEPS_FACES, triangles = faces && !(keeps & VGI_KEEPS_POLYGONS);
    const struct {
        bool lost;
        const char *what;
    } all[] = {{!faces && b->mesh.nf, "the faces"},
               {triangles && has_faces_of(&b->mesh, 4, SIZE_MAX), "polygons, which became triangles"},
               {triangles && has_faces_of(&b->mesh, 2, 2), "line segments"},
               {!(keeps & VGI_KEEPS_ORDER), "the numbers of the vertices, and those in no face"},
               {!(keeps & VGI_KEEPS_TEXTURE) && b->attributes.ntex, "texture coordinates"},
               {!(keeps & VGI_KEEPS_LABELS) && b->attributes.nlabels, "groups and materials"},
               {!(keeps & VGI_KEEPS_COLOURS) && b->attributes.ncolours, "colours of vertices"},
               {!(keeps & VGI_KEEPS_ASSET) && *asset && !(keeps & VGI_KEEPS_LABELS && names_library(b)), asset},
               {!(keeps & VGI_KEEPS_SKELETON) && b->skeleton.njoints, "the skeleton"},
               {!(keeps & VGI_KEEPS_NAMES) && x->names, "the names of the frames"},
               {!(keeps & VGI_KEEPS_TIMES) && x->times, "the times of the frames"},
               {*x->scalars, scalars},
               {x->own != NULL, x->own}};
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < sizeof all / sizeof *all; i++)
        if (all[i].lost) r = add_loss(line, all[i].what, e);
    return r;
}
