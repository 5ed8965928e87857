/* page.c: writes the page that plays sequences in a browser: collects frames, packs them, measures the packing error,
 * and adds the player. Numbers are packed in page_data.c and drawn by page_*.js.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/page.h"

#include "io/io.h"
#include "numeric/face.h"
#include "view/view.h"

#include <math.h>

enum {
    FLUSH_BYTES = 1 << 18,
    LINE_BYTES = 1 << 20,   /* bytes of a block encoded as text at a time; a multiple of 3 */
    MOST_CLIPPED = 4096,    /* largest face cut by ear clipping */
    MAP_STEPS = 65,         /* samples of the colour map in the page; odd, so that one is its middle */
    DECADES = 60, PER_DECADE = 200, /* of the histogram of the coloured numbers */
};
#define LEAST_COUNTED 1e-30

typedef struct sequence {
    const char *label;
    const vg_head *head;
    bool *drawn;               /* nv: vertices that are visible */
    double centre[3], diagonal, unit;
    vgi_hull path, figure;     /* extent over all frames, and relative to the centroid of each frame */
    vgi_track places, numbers;
    vgi_meter meter;
    bool tinted, compared;     /* whether frames have numbers to be coloured; whether these are errors */
    vgi_chunk chunk;
    vg_bytes names, times, means, minima, maxima; /* per frame, as JSON lists without their closing bracket */
    bool timed;
    double last_time, loss;
    size_t frames;
} sequence;

struct vg_page {
    vg_page_options o;
    int fd;
    char *name;
    const char *rest;          /* the part of the template not yet written */
    vg_bytes out;
    uint64_t bytes;
    size_t n;
    sequence at[VG_PAGE_SEQUENCES];
    uint64_t histogram[DECADES * PER_DECADE + 1], counted;
    uint64_t counted_frames;
    vgi_tint tint;
    vgi_spread spread;         /* of the coloured numbers; mean is a sum until the end */
};

/* ---- writing ---- */

static int flush_text(vg_page *p, vg_err *e)
{
    p->bytes += p->out.size;
    int r = vgi_write_all(p->fd, p->out.data, p->out.size, p->name, e);
    p->out.size = 0;
    return r;
}

static int put_bytes(vg_page *p, const void *data, size_t n, vg_err *e)
{
    int r = vgi_bytes_append(&p->out, data, n, e);
    return r == VG_OK && p->out.size >= FLUSH_BYTES ? flush_text(p, e) : r;
}

static int put_text(vg_page *p, const char *text, vg_err *e)
{
    return put_bytes(p, text, strlen(text), e);
}

/* Copy the template up to a mark, which is skipped, or to its end. */
static int put_template(vg_page *p, const char *mark, vg_err *e)
{
    const char *at = mark ? strstr(p->rest, mark) : p->rest + strlen(p->rest);
    if (!at) return vg_fail(e, VG_EARG, "the template of the page has no %s", mark);
    int r = put_bytes(p, p->rest, (size_t)(at - p->rest), e);
    p->rest = at + (mark ? strlen(mark) : 0);
    return r;
}

static int put_escaped(vg_page *p, const char *text, vg_err *e)
{
    vg_bytes b = {0};
    int r = vgi_page_escape(&b, text, e);
    if (r == VG_OK) r = put_bytes(p, b.data, b.size, e);
    vg_bytes_clear(&b);
    return r;
}

/* A block of packed data as text. */
static int put_packed(vg_page *p, const vg_bytes *packed, vg_err *e)
{
    int r = VG_OK;
    size_t line = LINE_BYTES - LINE_BYTES % 3;
    for (size_t at = 0; at < packed->size && r == VG_OK; at += line) {
        r = vgi_base64(&p->out, packed->data + at, packed->size - at < line ? packed->size - at : line, e);
        if (r == VG_OK) r = flush_text(p, e);
    }
    return r == VG_OK ? put_text(p, "</script>\n", e) : r;
}

/* ---- the mesh of a sequence ---- */

int vgi_page_list(vg_page *p, size_t i, const char *what, const uint32_t *list, size_t n, bool differences, vg_err *e)
{
    char head[128];
    vg_bytes packed = {0};
    snprintf(head, sizeof head, "<script type=\"text/plain\" data-sequence=\"%zu\" data-list=\"%s\">", i, what);
    int r = vgi_pack_list(&packed, list, n, differences, e);
    if (r == VG_OK) r = put_text(p, head, e);
    if (r == VG_OK) r = put_packed(p, &packed, e);
    vg_bytes_clear(&packed);
    return r;
}

/* Project a face along the axis nearest to its normal. This distorts angles, which does not matter here. */
static bool flatten_face(const uint32_t *v, size_t n, const double *points, double *xy)
{
    double normal[3];
    const double *o = points + 3 * (size_t)v[0];
    vgi_face_area(points, v, n, normal);
    size_t along = 0;
    for (size_t k = 1; k < 3; k++)
        if (fabs(normal[k]) > fabs(normal[along])) along = k;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 2; k++) {
            size_t axis = (along + 1 + k) % 3;
            xy[2 * i + k] = points[3 * (size_t)v[i] + axis] - o[axis];
        }
    return fabs(normal[along]) > 0 && isfinite(normal[along]);
}

typedef struct cutter {
    double *xy;
    size_t *work, *triangles;
} cutter;

/* The corner positions of n - 2 triangles. */
static void cut_face(const cutter *k, const uint32_t *v, size_t n, const double *points, uint32_t *out)
{
    bool fan = n == 3 || n > MOST_CLIPPED || !flatten_face(v, n, points, k->xy);
    if (!fan) vgi_ear_clip(k->xy, n, k->work, k->triangles);
    for (size_t i = 0; i + 2 < n; i++)
        for (size_t j = 0; j < 3; j++)
            out[3 * i + j] = fan ? (uint32_t)(j ? i + j : 0) : (uint32_t)k->triangles[3 * i + j];
}

static int put_triangles(vg_page *p, size_t i, const vg_mesh *m, const double *points, vg_err *e)
{
    size_t largest = 3, total = 0;
    for (size_t f = 0; f < m->nf; f++) {
        size_t n = m->start[f + 1] - m->start[f];
        largest = n > largest ? n : largest;
        total += n > 2 ? n - 2 : 0;
    }
    cutter k = {vgi_array_raw(2 * largest, sizeof(double), e), vgi_array_raw(3 * largest, sizeof(size_t), e),
                vgi_array_raw(3 * largest, sizeof(size_t), e)};
    uint32_t *out = vgi_array_raw(total, 3 * sizeof *out, e);
    int r = k.xy && k.work && k.triangles && out ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        size_t at = 0;
        for (size_t f = 0; f < m->nf; f++) {
            size_t n = m->start[f + 1] - m->start[f];
            if (n > 2) cut_face(&k, m->vert + m->start[f], n, points, out + at), at += 3 * (n - 2);
        }
        r = vgi_page_list(p, i, "triangles", out, at, false, e);
    }
    free(k.xy);
    free(k.work);
    free(k.triangles);
    free(out);
    return r;
}

static int put_mesh(vg_page *p, size_t i, const vg_head *h, vg_err *e)
{
    const vg_mesh *m = &h->body.mesh;
    uint32_t *sizes = vgi_array_raw(m->nf, sizeof *sizes, e);
    if (!sizes) return VG_ENOMEM;
    for (size_t f = 0; f < m->nf; f++) sizes[f] = m->start[f + 1] - m->start[f];
    int r = vgi_page_list(p, i, "sizes", sizes, m->nf, false, e);
    free(sizes);
    if (r == VG_OK) r = vgi_page_list(p, i, "corners", m->vert, vg_mesh_corners(m), true, e);
    if (r == VG_OK) r = put_triangles(p, i, m, h->body.reference, e);
    if (r == VG_OK && h->body.patches.n) r = vgi_page_list(p, i, "patches", h->body.patches.of_face, m->nf, false, e);
    return r == VG_OK ? vgi_page_skin_lists(p, i, &h->body, e) : r;
}

/* ---- sequences ---- */

static int measure_sequence(sequence *s, vg_err *e)
{
    const vg_mesh *m = &s->head->body.mesh;
    s->drawn = vgi_drawn_vertices(m, e);
    if (!s->drawn) return VG_ENOMEM;
    vg_centroid(s->head->body.reference, m->nv, s->centre);
    s->diagonal = vg_diagonal(s->head->body.reference, m->nv);
    s->unit = s->diagonal > 0 ? s->diagonal : 1;
    return VG_OK;
}

int vg_page_sequence(vg_page *p, const char *label, const vg_head *h, vg_err *e)
{
    if (p->n == VG_PAGE_SEQUENCES) return vg_fail(e, VG_EARG, "a page has at most %d sequences", VG_PAGE_SEQUENCES);
    if (h->kind != VG_VERTICES) return vg_fail(e, VG_EARG, "a page shows vertices, not %s", vg_head_form(h));
    if (p->o.signal && (p->n || !h->signal.n)) return vg_fail(e, VG_EARG, "a page edits one sequence with a signal");
    sequence *s = p->at + p->n;
    *s = (sequence){.label = label, .head = h, .timed = true, .last_time = -INFINITY};
    size_t i = p->n++;
    int r = measure_sequence(s, e);
    if (r == VG_OK && !p->o.signal) r = vgi_track_init(&s->places, h->body.mesh.nv, 3, e);
    if (r == VG_OK) r = put_mesh(p, i, h, e);
    return r == VG_OK && p->o.signal ? vgi_signal_page_lists(p, &h->signal, e) : r;
}

static int put_chunk(vg_page *p, size_t i, const char *what, vgi_track *t, vg_err *e)
{
    sequence *s = p->at + i;
    vg_bytes head = {0};
    vgi_chunk *c = &s->chunk;
    char text[160];
    int r = vgi_track_pack(t, c, e);
    if (r < 0) return r;
    if (t == &s->places) s->loss = fmax(s->loss, c->loss);
    snprintf(text, sizeof text,
             "<script type=\"text/plain\" data-sequence=\"%zu\" data-frames=\"%s\" data-count=\"%zu\" "
             "data-origin=\"", i, what, c->n);
    r = vgi_page_raw(&head, text, e);
    for (size_t k = 0; k < t->width && r == VG_OK; k++) {
        if (k) r = vgi_page_raw(&head, " ", e);
        if (r == VG_OK) r = vgi_page_number(&head, c->origin[k], e);
    }
    if (r == VG_OK) r = vgi_page_raw(&head, "\" data-step=\"", e);
    for (size_t k = 0; k < t->width && r == VG_OK; k++) {
        if (k) r = vgi_page_raw(&head, " ", e);
        if (r == VG_OK) r = vgi_page_number(&head, c->step[k], e);
    }
    if (r == VG_OK) r = vgi_page_raw(&head, "\">", e);
    if (r == VG_OK) r = put_bytes(p, head.data, head.size, e);
    if (r == VG_OK) r = put_packed(p, &c->packed, e);
    vg_bytes_clear(&head);
    return r;
}

/* Count a number. The upper end of step i of the histogram is LEAST_COUNTED * 10^(i / PER_DECADE). */
static void count_number(vg_page *p, double number)
{
    double size = fabs(number), at = size > LEAST_COUNTED ? ceil(log10(size / LEAST_COUNTED) * PER_DECADE) : 0;
    p->histogram[at < DECADES * PER_DECADE ? (size_t)at : DECADES * PER_DECADE]++;
    p->counted++;
}

static int list_spread(sequence *s, const vgi_tint *t, const vgi_spread *x, vg_err *e)
{
    vg_bytes *const lists[3] = {&s->means, &s->minima, &s->maxima};
    const double numbers[3] = {x->mean, x->least, x->most};
    int r = VG_OK;
    for (int i = 0; i < 3 && r == VG_OK; i++) {
        r = vgi_page_next(lists[i], e);
        if (r == VG_OK) r = vgi_page_short(lists[i], vgi_tint_shown(t, numbers[i]), e);
    }
    return r;
}

/* The first frame decides whether a sequence has coloured numbers. */
static int begin_numbers(vg_page *p, sequence *s, const vg_frame *f, const double *truth, vg_err *e)
{
    s->tinted = vgi_tint_has(&p->tint, f, truth);
    s->compared = s->tinted && p->tint.what == VG_TINT_ERRORS;
    if (!s->tinted) return VG_OK;
    double unit = s->compared ? p->at[1].unit : s->unit;
    int r = vgi_track_init(&s->numbers, s->head->body.mesh.nv, 1, e);
    return r == VG_OK ? vgi_meter_init(&s->meter, &p->tint, &s->head->body.mesh, s->head->body.reference, unit, e)
                      : r;
}

static int add_numbers(vg_page *p, sequence *s, const vg_frame *f, const double *truth, vg_err *e)
{
    vgi_spread x;
    size_t nv = s->head->body.mesh.nv;
    if (!s->tinted) return VG_OK;
    if (!vgi_tint_has(&p->tint, f, truth))
        return vg_fail(e, VG_EINPUT, "frame '%s' has no '%s' to colour, unlike earlier frames", f->name,
                       p->tint.name ? p->tint.name : "error");
    int r = vgi_tint_read(&p->tint, &s->meter, f, truth, &x, e);
    if (r < 0) return r;
    if (nv) memcpy(vgi_track_next(&s->numbers), s->meter.numbers, nv * sizeof(double));
    else vgi_track_next(&s->numbers);
    for (size_t v = 0; v < nv; v++)
        if (s->drawn[v]) count_number(p, s->meter.numbers[v]);
    bool first = p->counted_frames++ == 0;
    p->spread.mean += x.mean;
    p->spread.least = first ? x.least : fmin(p->spread.least, x.least);
    p->spread.most = first ? x.most : fmax(p->spread.most, x.most);
    return list_spread(s, &p->tint, &x, e);
}

static int add_label(sequence *s, const vg_frame *f, vg_err *e)
{
    int r = vgi_page_next(&s->names, e);
    if (r == VG_OK) r = vgi_page_string(&s->names, f->name, e);
    /* times that do not increase are ignored */
    s->timed = s->timed && f->has_time && isfinite(f->time) && f->time > s->last_time;
    s->last_time = f->time;
    if (r < 0 || !s->timed) return r;
    r = vgi_page_next(&s->times, e);
    return r == VG_OK ? vgi_page_number(&s->times, f->time, e) : r;
}

static void add_extent(sequence *s, const double *points)
{
    static const double origin[3] = {0, 0, 0};
    double centre[3];
    size_t nv = s->head->body.mesh.nv;
    vg_centroid(points, nv, centre);
    vgi_hull_add(&s->path, points, s->drawn, nv, origin);
    vgi_hull_add(&s->figure, points, s->drawn, nv, centre);
}

int vg_page_add(vg_page *p, size_t i, const vg_frame *f, const double *truth, vg_err *e)
{
    if (i >= p->n || (truth && (p->n < 2 || p->at[i].head->body.mesh.nv != p->at[1].head->body.mesh.nv)))
        return vg_fail(e, VG_EARG, "a frame is for a sequence that the page does not have");
    sequence *s = p->at + i;
    if (p->o.pick && s->frames) return VG_OK;
    if (s->compared && !truth) return vg_fail(e, VG_EARG, "a frame that is compared needs a truth");
    int r = add_label(s, f, e);
    if (r == VG_OK && p->o.signal) {
        add_extent(s, f->values);
        s->frames++;
        return VG_OK;
    }
    if (r == VG_OK && s->frames == 0) r = begin_numbers(p, s, f, truth, e);
    if (r < 0) return r;
    memcpy(vgi_track_next(&s->places), f->values, 3 * s->head->body.mesh.nv * sizeof *f->values);
    add_extent(s, f->values);
    s->frames++;
    r = add_numbers(p, s, f, truth, e);
    if (r == VG_OK && s->places.n == s->places.cap) r = put_chunk(p, i, "places", &s->places, e);
    if (r == VG_OK && s->tinted && s->numbers.n == s->numbers.cap) r = put_chunk(p, i, "numbers", &s->numbers, e);
    return r;
}

/* ---- the page ---- */

int vg_page_new(vg_page **out, int fd, const char *name, const vg_page_options *o, vg_err *e)
{
    *out = NULL;
    if (!(o->scale >= 0 && o->scale < INFINITY) || !(o->zoom >= 0 && o->zoom < INFINITY) || !isfinite(o->azimuth) ||
        !isfinite(o->elevation))
        return vg_fail(e, VG_EARG, "scale, zoom, azimuth and elevation must be numbers, scale and zoom not negative");
    if (o->tint == VG_TINT_SCALES && o->scale > 0 && !(o->scale > 1))
        return vg_fail(e, VG_EARG, "the colours of scales end at a factor above 1, not at %g", o->scale);
    vg_page *p = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->o = *o;
    p->tint = (vgi_tint){.what = o->tint, .centred = o->centred};
    p->fd = fd;
    p->rest = o->signal ? vgi_signal_html : vgi_page_html;
    p->name = vgi_copy_string(name, strlen(name), e);
    int r = p->name ? put_template(p, "@TITLE@", e) : VG_ENOMEM;
    if (r == VG_OK) r = put_escaped(p, o->title, e);
    if (r == VG_OK) r = put_template(p, "@STYLE@", e);
    if (r == VG_OK) r = put_text(p, o->signal ? vgi_signal_css : o->pick ? vgi_pairs_css : vgi_page_css, e);
    if (r == VG_OK) r = put_template(p, "@DATA@", e);
    if (r < 0) {
        vg_page_free(&p);
        return r;
    }
    *out = p;
    return VG_OK;
}

void vg_page_free(vg_page **address)
{
    vg_page *p = *address;
    if (!p) return;
    for (size_t i = 0; i < p->n; i++) {
        sequence *s = p->at + i;
        free(s->drawn);
        vgi_track_clear(&s->places);
        vgi_track_clear(&s->numbers);
        vgi_meter_clear(&s->meter);
        vg_bytes_clear(&s->chunk.packed);
        vg_bytes_clear(&s->names);
        vg_bytes_clear(&s->times);
        vg_bytes_clear(&s->means);
        vg_bytes_clear(&s->minima);
        vg_bytes_clear(&s->maxima);
    }
    vg_bytes_clear(&p->out);
    vgi_tint_clear(&p->tint);
    free(p->name);
    free(p);
    *address = NULL;
}

/* The absolute value that 99 % of the numbers do not exceed. */
static double find_percentile(const vg_page *p)
{
    double largest = fmax(fabs(p->spread.least), fabs(p->spread.most));
    uint64_t seen = p->histogram[0], want = p->counted - p->counted / 100;
    size_t at = 0;
    while (seen < want && at < DECADES * PER_DECADE) seen += p->histogram[++at];
    return fmin(at ? LEAST_COUNTED * pow(10, (double)at / PER_DECADE) : 0, largest);
}

static void end_tint(vg_page *p, vg_page_stats *stats)
{
    vgi_tint_end(&p->tint, p->o.scale, find_percentile(p), p->spread.least, p->spread.most);
    stats->tinted = p->counted_frames > 0;
    if (!stats->tinted) return;
    p->spread.mean /= (double)p->counted_frames;
    stats->scale = vgi_tint_shown(&p->tint, p->tint.high);
    stats->mean = vgi_tint_shown(&p->tint, p->spread.mean);
    stats->least = vgi_tint_shown(&p->tint, p->spread.least);
    stats->max = vgi_tint_shown(&p->tint, p->spread.most);
}

/* One process in the provenance: its command line, and the processes whose output it read. */
static int json_process(vg_bytes *list, const vg_provenance *p, vg_err *e)
{
    vg_bytes line = {0}, parents = {0};
    int r = vgi_page_next(list, e);
    for (size_t j = 0; j < p->nargs && r == VG_OK; j++) {
        if (j) r = vgi_page_raw(&line, " ", e);
        if (r == VG_OK) r = vgi_page_raw(&line, p->args[j], e);
    }
    if (r == VG_OK) r = vgi_bytes_append(&line, "", 1, e);
    for (size_t j = 0; j < p->nparents && r == VG_OK; j++) {
        r = vgi_page_next(&parents, e);
        if (r == VG_OK) r = vgi_page_number(&parents, p->parents[j], e);
    }
    if (r == VG_OK) r = vgi_page_raw(list, "{", e);
    if (r == VG_OK) r = vgi_page_field_text(list, "line", (char *)line.data, e);
    if (r == VG_OK) r = vgi_page_field_list(list, "parents", &parents, e);
    if (r == VG_OK) r = vgi_page_raw(list, "}", e);
    vg_bytes_clear(&line);
    vg_bytes_clear(&parents);
    return r;
}

static int json_provenance(vg_bytes *b, const vg_head *h, vg_err *e)
{
    vg_bytes list = {0};
    int r = VG_OK;
    for (size_t i = 0; i < h->nprovenance && r == VG_OK; i++) r = json_process(&list, h->provenance + i, e);
    if (r == VG_OK) r = vgi_page_field_list(b, "provenance", &list, e);
    vg_bytes_clear(&list);
    return r;
}

int vgi_page_field_numbers(vg_bytes *b, const char *name, const double *x, size_t n, vg_err *e)
{
    vg_bytes list = {0};
    int r = VG_OK;
    for (size_t i = 0; i < n && r == VG_OK; i++) {
        r = vgi_page_next(&list, e);
        if (r == VG_OK) r = vgi_page_number(&list, x[i], e);
    }
    if (r == VG_OK) r = vgi_page_field_list(b, name, &list, e);
    vg_bytes_clear(&list);
    return r;
}

/* The joints of a skeleton sequence, or of a rig that drives the mesh: names, parents, rest positions. */
static int json_joints(vg_bytes *b, const vg_body *body, vg_err *e)
{
    const vg_rig *rig = body->rig.skeleton.njoints ? &body->rig : NULL;
    const vg_skeleton *s = rig ? &rig->skeleton : &body->skeleton;
    vg_bytes names = {0}, parents = {0};
    int r = VG_OK;
    for (size_t j = 0; j < s->njoints && r == VG_OK; j++) {
        r = vgi_page_next(&names, e);
        if (r == VG_OK) r = vgi_page_string(&names, s->joints[j].name, e);
        if (r == VG_OK) r = vgi_page_next(&parents, e);
        if (r == VG_OK) r = vgi_page_number(&parents, s->joints[j].parent == UINT32_MAX ? -1.0 : (double)s->joints[j].parent, e);
    }
    if (r == VG_OK) r = vgi_page_field_list(b, "joints", &names, e);
    if (r == VG_OK) r = vgi_page_field_list(b, "parents", &parents, e);
    if (r == VG_OK && rig) r = vgi_page_field_numbers(b, "jointsAt", rig->at, 3 * s->njoints, e);
    vg_bytes_clear(&names);
    vg_bytes_clear(&parents);
    return r;
}

/* A compared sequence is shown at the position and in the units of the truth. */
static const sequence *frame_of(const vg_page *p, const sequence *s)
{
    return s->compared ? p->at + 1 : s;
}

static int json_sequence(vg_bytes *b, const vg_page *p, size_t i, vg_err *e)
{
    const sequence *s = p->at + i;
    const sequence *frame = frame_of(p, s);
    const vg_mesh *m = &s->head->body.mesh;
    size_t up = p->o.z_up ? 2 : 1;
    int r = vgi_page_raw(b, i ? ",{" : "{", e);
    if (r == VG_OK) r = vgi_page_field_text(b, "label", s->label, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "vertices", (double)m->nv, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "faces", (double)m->nf, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "patches", (double)s->head->body.patches.n, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "diagonal", frame->diagonal, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "centre", frame->centre, 3, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "ground", frame->path.n ? -frame->path.reach[up + VGI_HULL / 2] : 0, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "path", s->path.at[0], 3 * s->path.n, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "figure", s->figure.at[0], 3 * s->figure.n, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "loss", s->loss / frame->unit, e);
    if (r == VG_OK) r = json_provenance(b, s->head, e);
    if (r == VG_OK) r = json_joints(b, &s->head->body, e);
    if (r == VG_OK) r = vgi_page_skin_facts(b, &s->head->body, e);
    if (r == VG_OK) r = vgi_page_field_list(b, "names", &s->names, e);
    if (r == VG_OK && s->timed) r = vgi_page_field_list(b, "times", &s->times, e);
    if (r == VG_OK && s->tinted) r = vgi_page_field_list(b, "means", &s->means, e);
    if (r == VG_OK && s->tinted) r = vgi_page_field_list(b, "minima", &s->minima, e);
    if (r == VG_OK && s->tinted) r = vgi_page_field_list(b, "maxima", &s->maxima, e);
    return r == VG_OK ? vgi_page_raw(b, "}", e) : r;
}

static int json_map(vg_bytes *b, bool diverging, vg_err *e)
{
    vgi_palette *palette = vgi_array_raw(1, sizeof *palette, e);
    if (!palette) return VG_ENOMEM;
    vgi_palette_init(palette, diverging);
    char text[6 * MAP_STEPS + 1];
    for (int i = 0; i < MAP_STEPS; i++) {
        float c[3];
        vgi_map_colour(i / (MAP_STEPS - 1.0), diverging, c);
        snprintf(text + (size_t)i * 6, 7, "%02x%02x%02x", vgi_encode(palette, c[0]), vgi_encode(palette, c[1]),
                 vgi_encode(palette, c[2]));
    }
    free(palette);
    return vgi_page_field_text(b, "map", text, e);
}

/* What the colours mean, and the ends of the map; scales are logarithms to base 2. */
static int json_tint(vg_bytes *b, const vg_page *p, vg_err *e)
{
    static const char *const kinds[] = {"scalars", "errors", "scales", "plain"};
    char title[256];
    const vgi_tint *t = &p->tint;
    vgi_tint_title(t, 0, title, sizeof title);
    int r = vgi_page_field(b, "tint", e);
    if (r == VG_OK) r = vgi_page_raw(b, "{", e);
    if (r == VG_OK) r = vgi_page_field_text(b, "kind", kinds[t->what], e);
    if (r == VG_OK) r = vgi_page_field_text(b, "title", title, e);
    if (r == VG_OK) r = vgi_page_field_text(b, "unit", t->what == VG_TINT_ERRORS ? "D" : t->unit ? t->unit : "", e);
    if (r == VG_OK) r = vgi_page_field_number(b, "low", t->low, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "high", t->high, e);
    if (r == VG_OK) r = vgi_page_field_flag(b, "diverging", t->diverging, e);
    return r == VG_OK ? vgi_page_raw(b, "}", e) : r;
}

static int json_page(vg_bytes *b, const vg_page *p, const vg_page_stats *stats, vg_err *e)
{
    static const char *const fits[] = {"", "path", "figure"};
    int r = vgi_page_raw(b, "{", e);
    if (r == VG_OK) r = vgi_page_field_text(b, "version", VG_VERSION, e);
    if (r == VG_OK) r = vgi_page_field_text(b, "title", p->o.title, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "azimuth", p->o.azimuth, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "elevation", p->o.elevation, e);
    if (r == VG_OK) r = vgi_page_field_flag(b, "zUp", p->o.z_up, e);
    if (r == VG_OK) r = vgi_page_field_text(b, "fit", fits[p->o.fit], e);
    if (r == VG_OK) r = vgi_page_field_flag(b, "edges", p->o.edges, e);
    if (r == VG_OK) r = vgi_page_field_flag(b, "ground", p->o.ground, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "zoom", p->o.zoom > 0 ? p->o.zoom : 1, e);
    if (r == VG_OK) r = vgi_page_field_flag(b, "patches", p->o.tint != VG_TINT_PLAIN, e);
    if (r == VG_OK && stats->tinted) r = json_tint(b, p, e);
    if (r == VG_OK) r = vgi_page_field_flag(b, "centred", p->o.centred, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "scale", stats->scale, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "mean", stats->mean, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "least", stats->least, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "max", stats->max, e);
    if (r == VG_OK) r = json_map(b, p->tint.diverging, e);
    if (r == VG_OK) r = vgi_page_field(b, "sequences", e);
    if (r == VG_OK) r = vgi_page_raw(b, "[", e);
    for (size_t i = 0; i < p->n && r == VG_OK; i++) r = json_sequence(b, p, i, e);
    if (r == VG_OK) r = vgi_page_raw(b, "]", e);
    if (r == VG_OK && p->o.signal) r = vgi_signal_page_facts(b, &p->at[0].head->signal, e);
    return r == VG_OK ? vgi_page_raw(b, "}", e) : r;
}

static int put_remaining(vg_page *p, vg_page_stats *stats, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < p->n && r == VG_OK; i++) {
        sequence *s = p->at + i;
        const sequence *frame = frame_of(p, s);
        if (!s->frames) return vg_fail(e, VG_EINPUT, "'%s' has no frames: there is nothing to show", s->label);
        if (s->places.n) r = put_chunk(p, i, "places", &s->places, e);
        if (r == VG_OK && s->numbers.n) r = put_chunk(p, i, "numbers", &s->numbers, e);
        stats->frames = s->frames > stats->frames ? s->frames : stats->frames;
        stats->loss = fmax(stats->loss, s->loss / frame->unit);
    }
    return r;
}

int vg_page_end(vg_page *p, vg_page_stats *stats, vg_err *e)
{
    vg_bytes json = {0};
    *stats = (vg_page_stats){0};
    if (p->n == 0) return vg_fail(e, VG_EINPUT, "there is no sequence to show");
    int r = put_remaining(p, stats, e);
    if (r < 0) return r;
    end_tint(p, stats);
    r = put_template(p, "@FACTS@", e);
    if (r == VG_OK) r = json_page(&json, p, stats, e);
    if (r == VG_OK) r = put_bytes(p, json.data, json.size, e);
    if (r == VG_OK) r = put_template(p, "@SCRIPT@", e);
    if (r == VG_OK) r = put_text(p, p->o.signal ? vgi_signal_js : p->o.pick ? vgi_pairs_js : vgi_page_js, e);
    if (r == VG_OK) r = put_template(p, NULL, e);
    if (r == VG_OK) r = flush_text(p, e);
    vg_bytes_clear(&json);
    stats->bytes = p->bytes;
    return r;
}
