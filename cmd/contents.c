/* contents.c: vg-info: what follows from reading all frames of a sequence: their number, names, times and channels.
 * The head is reported in vg-info.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "contents.h"
#include "cli.h"

#include <inttypes.h>
#include <math.h>

static const report_column channel_columns[] = {{.key = "name"},   {.key = "unit"},  {.key = "element"}, {.key = "width"},
                                                {.key = "frames"}, {.key = "least"}, {.key = "most"}};
static const report_column animation_columns[] = {
    {.key = "name"}, {.key = "frames"}, {.key = "first_time"}, {.key = "last_time"}};
static const report_column vertex_columns[] = {
    {.key = "frame", .title = "frame"}, {.key = "name", .title = "name"},    {.key = "time", .title = "time"},
    {.key = "x", .title = "centroid x"}, {.key = "y", .title = "centroid y"}, {.key = "z", .title = "centroid z"}};
static const report_column value_columns[] = {
    {.key = "frame", .title = "frame"}, {.key = "name", .title = "name"}, {.key = "time", .title = "time"},
    {.key = "least", .title = "least"}, {.key = "most", .title = "most"}};

static void replace_text(char **to, const char *from)
{
    free(*to);
    *to = cli_copy_text(from, "the name of a frame");
}

static void range_of(const double *x, size_t n, double *least, double *most)
{
    *least = *most = n ? x[0] : NAN;
    for (size_t i = 1; i < n; i++) *least = fmin(*least, x[i]), *most = fmax(*most, x[i]);
}

static void list_frame(report *r, const vg_head *h, const vg_frame *f, uint64_t i)
{
    double at[3];
    report_value row[6] = {report_count(i), report_text(f->name),
                           f->has_time ? report_number(f->time) : report_nothing()};
    if (h->kind == VG_VERTICES) {
        vg_centroid(f->values, h->count, at);
        for (int k = 0; k < 3; k++) row[3 + k] = report_number(at[k]);
    } else {
        range_of(f->values, h->count * vg_head_width(h), &at[0], &at[1]);
        for (int k = 0; k < 2; k++) row[3 + k] = report_number(at[k]);
    }
    report_row(r, row);
}

/* The frame continues the last animation, or begins one. */
static void note_animation(contents *c, const vg_frame *f)
{
    uint64_t number = 0;
    const size_t n = vg_frame_stem(f->name, &number);
    animation *last = c->nanimations ? &c->animations[c->nanimations - 1] : NULL;
    const double time = f->has_time ? f->time : NAN;
    if (n && last && number == last->frames + 1 && strlen(last->name) == n && !memcmp(last->name, f->name, n)) {
        last->frames++;
        last->last_time = time;
    } else if (vg_frame_begins(f->name)) {
        c->animations = cli_resize(c->animations, c->nanimations + 1, sizeof *c->animations, "the names of animations");
        last = &c->animations[c->nanimations++];
        *last = (animation){cli_copy_text(f->name, "the names of animations"), 1, time, time};
        last->name[n] = 0;
    }
}

static void note_frame(contents *c, const vg_frame *f)
{
    size_t turned;
    if (c->frames == 0) replace_text(&c->first, f->name);
    replace_text(&c->last, f->name);
    if (f->has_time) {
        if (c->timed == 0) c->first_time = f->time;
        c->last_time = f->time;
        c->timed++;
    }
    note_animation(c, f);
    vg_frame_turns(f, &turned);
    c->turned += turned > 0;
    c->extra += f->extra.n;
    c->frames++;
}

static channel_note *note_of(contents *c, const vg_channel *channel)
{
    for (size_t i = 0; i < c->nchannels; i++)
        if (!strcmp(c->channels[i].name, channel->name)) return &c->channels[i];
    c->channels = cli_resize(c->channels, c->nchannels + 1, sizeof *c->channels, "the names of channels");
    channel_note *n = &c->channels[c->nchannels++];
    *n = (channel_note){.width = channel->width, .least = INFINITY, .most = -INFINITY};
    n->name = cli_copy_text(channel->name, "the names of channels");
    n->unit = cli_copy_text(channel->unit, "the names of channels");
    n->element = cli_copy_text(channel->element_name, "the names of channels");
    return n;
}

static void note_channels(contents *c, const vg_frame *f)
{
    for (size_t i = 0; i < f->nchannels; i++) {
        const vg_channel *channel = &f->channels[i];
        channel_note *n = note_of(c, channel);
        size_t numbers = channel->width * channel->count;
        for (size_t k = 0; k < numbers; k++) {
            double x = channel->vertices ? channel->vertices[k] : channel->numbers[k];
            n->least = fmin(n->least, x), n->most = fmax(n->most, x);
        }
        n->frames++;
    }
}

void contents_read(contents *c, vg_source *s, bool digested, bool channels, report *list)
{
    const vg_head *h = vg_source_head(s);
    vg_frame f = {0};
    vg_digest *digest = NULL;
    vg_err e;
    bool poses = h->kind == VG_VERTICES;
    if (list) report_table(list, "frame_list", "", false, poses ? vertex_columns : value_columns, poses ? 6 : 5);
    if (vg_digest_new(&digest, h, &e) < 0) cli_die(&e);
    while (cli_next(s, &f)) {
        if (digested) vg_digest_add(digest, &f);
        if (list) list_frame(list, h, &f, c->frames);
        if (c->frames == 0 && poses) c->D = vg_diagonal(f.values, h->count);
        note_frame(c, &f);
        if (channels) note_channels(c, &f);
        cli_progress("frame", c->frames);
    }
    cli_note("%" PRIu64 " frames read, and the end mark where there has to be one", c->frames);
    c->digest = vg_digest_get(digest);
    c->extra += vg_source_tail(s)->n;
    vg_digest_free(&digest);
    vg_frame_clear(&f);
}

void report_animations(report *r, const contents *c)
{
    char line[400];
    for (size_t i = 0; i < c->nanimations && c->nanimations > 1; i++) {
        const animation *a = &c->animations[i];
        int k = snprintf(line, sizeof line, "'%.300s': %" PRIu64 " frames", a->name, a->frames);
        if (!isnan(a->first_time))
            snprintf(line + k, sizeof line - (size_t)k, ", %.6g s to %.6g s", a->first_time, a->last_time);
        report_put(r, NULL, "animation", report_text(line));
    }
    if (!c->nanimations) return;
    report_table(r, "animations", NULL, false, animation_columns, 4);
    for (size_t i = 0; i < c->nanimations; i++) {
        const animation *a = &c->animations[i];
        const report_value row[4] = {report_text(a->name), report_count(a->frames),
                                     isnan(a->first_time) ? report_nothing() : report_number(a->first_time),
                                     isnan(a->last_time) ? report_nothing() : report_number(a->last_time)};
        report_row(r, row);
    }
}

void report_frames(report *r, const vg_head *h, const contents *c)
{
    char line[700];
    size_t most = SIZE_MAX / 64, bytes = h->count < most ? h->count * vg_head_width(h) * h->precision : 0;
    report_put(r, "kind", NULL, report_text(vg_head_form(h)));
    report_put(r, "precision", NULL, report_count(8 * h->precision));
    report_put(r, "elements", NULL, report_count(h->count));
    snprintf(line, sizeof line, "%zu %s, binary%d", h->count, vg_head_form(h), 8 * (int)h->precision);
    report_put(r, NULL, "a frame", report_text(line));
    report_put(r, "frame_bytes", "its bytes", report_count(bytes));
    report_put(r, "frames", NULL, report_count(c->frames));
    report_put(r, "first", NULL, c->frames ? report_text(c->first) : report_nothing());
    report_put(r, "last", NULL, c->frames ? report_text(c->last) : report_nothing());
    report_put(r, "first_time", NULL, c->timed ? report_number(c->first_time) : report_nothing());
    report_put(r, "last_time", NULL, c->timed ? report_number(c->last_time) : report_nothing());
    if (c->frames == 0) snprintf(line, sizeof line, "0");
    else if (c->frames == 1) snprintf(line, sizeof line, "1: '%.300s'", c->first);
    else snprintf(line, sizeof line, "%" PRIu64 ": '%.300s' to '%.300s'", c->frames, c->first, c->last);
    report_put(r, NULL, "frames", report_text(line));
    if (!c->timed || c->nanimations > 1) return;
    snprintf(line, sizeof line, "%.6g s to %.6g s", c->first_time, c->last_time);
    report_put(r, NULL, "times", report_text(line));
}

void report_channels(report *r, const contents *c)
{
    char line[400];
    for (size_t i = 0; i < c->nchannels; i++) {
        const channel_note *n = &c->channels[i];
        if (!strcmp(n->name, "anchors") || !strcmp(n->name, "turns")) continue; /* mesh and skeleton say it */
        int k = snprintf(line, sizeof line, "'%.100s' of each %.60s in %" PRIu64 " of the frames", n->name, n->element,
                         n->frames);
        if (n->least <= n->most) /* there is an element */
            snprintf(line + k, sizeof line - (size_t)k, ": %.6g to %.6g %.60s", n->least, n->most, n->unit);
        report_put(r, NULL, "with them", report_text(line));
    }
    if (!c->nchannels) return;
    report_table(r, "channels", NULL, false, channel_columns, 7);
    for (size_t i = 0; i < c->nchannels; i++) {
        const channel_note *n = &c->channels[i];
        bool some = n->least <= n->most;
        report_value row[7] = {report_text(n->name), report_text(n->unit), report_text(n->element),
                               report_count(n->width), report_count(n->frames),
                               some ? report_number(n->least) : report_nothing(),
                               some ? report_number(n->most) : report_nothing()};
        report_row(r, row);
    }
}
