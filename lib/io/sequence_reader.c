/* sequence_reader.c: reads a file that holds a whole sequence, frame by frame; adds names if the file has none, and
 * faces from the mesh file beside it. Formats are in sequence.c; several inputs are joined in source.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sequence_reader.h"

#include <stdlib.h>
#include <unistd.h>

void vgi_play_stop(vgi_playing *p)
{
    if (p->format) p->format->close(p->state);
    vgi_input_free(&p->in);
    free(p->subject);
    free(p->stem);
    vg_frame_clear(&p->first);
    *p = (vgi_playing){0};
}

int vgi_play_open(vgi_playing *p, const vgi_sequence_format *format, vgi_input *in, const vg_reading *how,
                  char *subject, char *stem, vg_head *h, vg_err *e)
{
    *p = (vgi_playing){.in = in, .subject = subject, .stem = stem};
    if (!subject || !stem) return VG_ENOMEM;
    p->format = format;
    int r = format->open(&p->state, h, in, how, subject, e);
    return r == VG_OK && h->body.mesh.nf ? vg_mesh_check(&h->body.mesh, subject, e) : r;
}

/* ---- faces ---- */

/* The mesh file beside the sequence: "walk.obj" or "walk.ply" for "walk.pc2"; release with free(). NULL with VG_OK if
 * there is none.
 */
static int find_beside(const char *file, const char *suffix, char **path, vg_err *e)
{
    static const char *const suffixes[] = {".obj", ".ply"};
    *path = NULL;
    if (!file) return VG_OK;
    size_t n = strlen(file);
    if (vgi_has_suffix(file, n, suffix)) n -= strlen(suffix);
    char *to = vgi_array_raw(n + 8, 1, e);
    if (!to) return VG_ENOMEM;
    for (size_t i = 0; i < sizeof suffixes / sizeof *suffixes; i++) {
        snprintf(to, n + 8, "%.*s%s", (int)n, file, suffixes[i]);
        if (access(to, F_OK) == 0) return *path = to, VG_OK;
    }
    free(to);
    return VG_OK;
}

int vgi_different_count(const vg_head *h, const char *subject, size_t nv, const char *mesh, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "%s has %zu points, but %s has %zu vertices", subject, h->body.mesh.nv, mesh, nv);
}

static int borrow_mesh(const vgi_playing *p, vg_head *h, const char *path, vg_err *e)
{
    vg_head from = {0};
    char subject[VGI_SUBJECT];
    int r = vg_load(&from, path, "mesh", e);
    if (r == VG_OK && from.body.mesh.nv != h->body.mesh.nv)
        r = vgi_different_count(h, p->subject, from.body.mesh.nv, vgi_quote(path, subject), e);
    if (r == VG_OK) {
        vg_head_take(h, &from, "mesh");
        vg_head_take(h, &from, "attributes");
        vg_head_take(h, &from, "asset");
        if (!h->body.reference) vg_head_take(h, &from, "reference");
    }
    vg_head_clear(&from);
    return r;
}

int vgi_play_borrow_faces(const vgi_playing *p, const char *path, vg_head *h, vg_err *e)
{
    char *beside;
    int r = find_beside(path, p->format->suffix, &beside, e);
    if (r < 0) return r;
    if (beside) r = borrow_mesh(p, h, beside, e);
    else if (!p->format->bare)
        r = vg_fail(e, VG_EINPUT,
                    "%s holds no faces: put the mesh of the same name beside it, as .obj or .ply, or name it "
                    "with --mesh",
                    p->subject);
    free(beside);
    return r;
}

/* ---- frames ---- */

static int name_frame(const vgi_playing *p, vg_frame *f, vg_err *e)
{
    size_t n = strlen(p->stem) + 32;
    char *name = vgi_array_raw(n, 1, e);
    if (!name) return VG_ENOMEM;
    if (p->format->frames && p->format->frames(p->state) == 1) snprintf(name, n, "%s", p->stem);
    else snprintf(name, n, "%s.%04llu", p->stem, (unsigned long long)p->frames);
    int r = vg_frame_rename(f, name, e);
    free(name);
    return r;
}

static int read_frame(vgi_playing *p, const vg_head *own, vg_frame *f, vg_err *e)
{
    int r = vg_frame_shape(f, own, e);
    if (r < 0) return r;
    vg_records_clear(&f->extra);
    f->has_time = false, f->time = 0;
    if ((r = vg_frame_rename(f, "", e)) < 0 || (r = p->format->next(p->state, f, e)) <= 0) return r;
    p->frames++;
    if (!*f->name && (r = name_frame(p, f, e)) < 0) return r;
    return 1;
}

int vgi_play_first(vgi_playing *p, const vg_head *own, const vg_frame **first, vg_err *e)
{
    int r = read_frame(p, own, &p->first, e);
    if (r == 0) r = vg_fail(e, VG_EINPUT, "%s holds no pose", p->subject);
    if (r < 0) return r;
    p->waiting = true;
    *first = &p->first;
    return VG_OK;
}

int vgi_play_next(vgi_playing *p, const vg_head *own, vg_frame *f, vg_err *e)
{
    int r;
    if (!p->waiting) {
        if ((r = read_frame(p, own, f, e)) == 0) vgi_play_stop(p);
        return r;
    }
    p->waiting = false;
    if ((r = vg_frame_shape(f, own, e)) < 0 || (r = vg_frame_label(f, &p->first, e)) < 0) return r;
    size_t n;
    const double *turns = vg_frame_turns(&p->first, &n);
    if ((r = vg_frame_turn(f, turns, n, e)) < 0) return r;
    memcpy(f->values, p->first.values, 3 * own->count * sizeof *f->values);
    vg_frame_clear(&p->first);
    return 1;
}
