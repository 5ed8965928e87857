/* vg-poisson: guide a sequence in time through given poses, keeping its second differences.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

/* A given pose and the frame it is for. */
typedef struct key {
    enum { FIRST, LAST, NAMED, NUMBERED } by; /* NAMED: FRAME may be a number all the same */
    const char *option, *mesh;                /* "--key 40", and the operand that brings the pose */
    char *frame;
    bool has_number;
    uint64_t number;
    double *pose;
    bool met;       /* its frame has come, as number `at` */
    bool named;     /* and has the name FRAME */
    uint64_t at;
} key;

static struct {
    size_t nkeys;
    key *keys;
    uint64_t memory; /* bytes */
    size_t over;     /* 0: time, 1: pose */
} opts = {.memory = 256 << 20};

static key *add_key(int by, const char *option, const char *mesh)
{
    cli_claim_input(option, mesh);
    opts.keys = cli_resize(opts.keys, opts.nkeys + 1, sizeof *opts.keys, "the given poses");
    key *k = &opts.keys[opts.nkeys++];
    *k = (key){.by = by, .mesh = mesh};
    return k;
}

static void add_end(const char *mesh, int by, const char *option)
{
    for (size_t i = 0; i < opts.nkeys; i++)
        if ((int)opts.keys[i].by == by) cli_usage("option '%s' is given twice", option);
    add_key(by, option + 2, mesh)->option = option;
}

static void take_first(const char *mesh, void *context)
{
    (void)context;
    add_end(mesh, FIRST, "--first");
}

static void take_last(const char *mesh, void *context)
{
    (void)context;
    add_end(mesh, LAST, "--last");
}

static bool parse_count(const char *text, uint64_t *x)
{
    *x = 0;
    if (!*text || text[strspn(text, "0123456789")]) return false;
    for (; *text; text++)
        if (__builtin_mul_overflow(*x, 10, x) || __builtin_add_overflow(*x, (uint64_t)(*text - '0'), x)) return false;
    return true;
}

/* FRAME=MESH; "#N" is number N, whatever frames are called */
static void take_key(const char *text, void *context)
{
    (void)context;
    const char *equals = strchr(text, '=');
    if (!equals || equals == text || !equals[1]) cli_usage("option '--key' needs FRAME=MESH, not '%s'", text);
    key *k = add_key(NAMED, "key", equals + 1);
    size_t n = (size_t)(equals - text);
    char *option = malloc(n + sizeof "--key ");
    if (!option || !(k->frame = strndup(text, n))) cli_stop(VG_ENOMEM, "not enough memory for the given poses");
    memcpy(option, "--key ", 6);
    memcpy(option + 6, k->frame, n + 1);
    k->option = option;
    k->has_number = parse_count(k->frame, &k->number);
    if (*k->frame == '#' && parse_count(k->frame + 1, &k->number)) k->by = NUMBERED, k->has_number = true;
}

static void take_memory(const char *text, void *context)
{
    (void)context;
    opts.memory = cli_parse_size("memory", text);
}

static const cli_option options[] = {
    {"first", 0, "MESH", "the first frame becomes this pose", .take = take_first},
    {"last", 0, "MESH", "the last frame becomes this pose", .take = take_last},
    {"key", 0, "FRAME=MESH", "this frame, by name or by number from 0, becomes this pose; repeat as needed",
     .take = take_key},
    {"over", 0, "time|pose",
     "weights of the keys for the frames between them: linear in time (default for one or two), or by similarity of "
     "the pose",
     .choice = &opts.over},
    {"memory", 0, "SIZE", "keep this much of the waiting frames in memory, the rest in a file (default: 256M)",
     .take = take_memory},
    {0}};

static const cli_program program = {
    .name = "vg-poisson",
    .synopsis = "[options] [FILE]",
    .summary = "guide a sequence in time through given poses: exact there, with unchanged second differences "
               "elsewhere",
    .options = options,
    .most_operands = 1,
    .writes_stream = true};

/* ---- the given poses ---- */

/* The first pose of the operand; the rest is not read. */
static void load_key(key *k, vg_head *h)
{
    vg_err e;
    vg_source *s;
    vg_frame f = {0};
    char subject[200];
    snprintf(subject, sizeof subject, "'%.180s'", k->mesh);
    if (vg_source_open(&s, &k->mesh, 1, &e) < 0) cli_die(&e);
    const vg_head *from = vg_source_head(s);
    cli_need_vertices(from, subject);
    if (vg_mesh_same(&h->body.mesh, "the sequence", &from->body.mesh, subject, &e) < 0) cli_die(&e);
    if (!cli_next(s, &f)) cli_stop(VG_EINPUT, "%s holds no pose", subject);
    if (vg_head_merge_trace(h, from, &e) < 0) cli_die(&e);
    k->pose = cli_allocate(3 * h->body.mesh.nv, sizeof *k->pose, "the given poses");
    memcpy(k->pose, f.values, 3 * h->body.mesh.nv * sizeof *k->pose);
    vg_frame_clear(&f);
    vg_source_close(&s);
}

/* ---- the sequence ---- */

typedef struct work {
    vg_head *h;
    vg_guide *guide;      /* in time, or */
    vg_pose_guide *poses; /* over the pose: one of them is NULL */
    vg_spool *spool;
    vg_frame held;     /* a frame on its way out of the spool */
    vg_frame late;     /* the latest frame: it may turn out to be the last */
    uint64_t frames;   /* that have come */
    uint64_t released; /* number of the first frame that is still held */
    size_t ahead;      /* keys whose frames have not come */
    bool begun;        /* a key's frame has come */
} work;

static bool is_for(const key *k, uint64_t n, const char *name, bool last)
{
    switch (k->by) {
    case FIRST: return n == 0;
    case LAST: return last;
    case NAMED: return !strcmp(k->frame, name) || (k->has_number && k->number == n);
    default: return k->number == n;
    }
}

/* A key that has met its frame by number meets one of that name later. */
static void refuse_ambiguous(const key *k, uint64_t n, const char *name)
{
    if (k->by != NAMED || k->named || strcmp(k->frame, name)) return;
    cli_stop(VG_EINPUT,
             "'%s' is the number of one frame and the name of a later one: "
             "write '--key #%llu=%s' or '--key #%llu=%s'",
             k->option, (unsigned long long)k->at, k->mesh, (unsigned long long)n, k->mesh);
}

/* The pose that frame n is to become, or NULL. */
static const double *find_given(work *w, uint64_t n, const char *name, bool last)
{
    const key *found = NULL;
    for (size_t i = 0; i < opts.nkeys; i++) {
        key *k = &opts.keys[i];
        if (k->met) refuse_ambiguous(k, n, name);
        if (k->met || !is_for(k, n, name, last)) continue;
        k->met = true, k->at = n;
        k->named = k->by == NAMED && !strcmp(k->frame, name);
        w->ahead--;
        if (found && memcmp(found->pose, k->pose, 3 * w->h->body.mesh.nv * sizeof *k->pose)) {
            cli_stop(VG_EINPUT, "'%s' and '%s' give two poses to one frame, number %llu, '%s'", found->option,
                     k->option, (unsigned long long)n, name);
        }
        found = k;
    }
    return found ? found->pose : NULL;
}

static void apply_keys(work *w, uint64_t n, double *pose)
{
    if (w->poses) vg_pose_guide_apply(w->poses, n, pose);
    else vg_guide_apply(w->guide, n, pose);
}

static void set_key(work *w, uint64_t n, double *pose, const double *given)
{
    if (w->poses) vg_pose_guide_key(w->poses, n, pose, given);
    else vg_guide_key(w->guide, n, pose, given);
}

static void release_held(work *w)
{
    vg_err e;
    int r;
    while ((r = vg_spool_next(w->spool, &w->held, &e)) > 0) {
        apply_keys(w, w->released++, w->held.values);
        cli_stream_put(&w->held);
    }
    if (r < 0) cli_die(&e);
}

static void guide(work *w, vg_frame *f, uint64_t n, bool last)
{
    const double *given = find_given(w, n, f->name, last);
    vg_err e;
    vg_frame_drop_all(f); /* channels of the vertices are not valid for the new positions */
    if (given) {
        set_key(w, n, f->values, given);
        w->begun = true;
    }
    /* over the pose, all frames wait for the last key */
    if (w->poses ? w->ahead > 0 : !given && (!w->begun || w->ahead)) {
        if (vg_spool_put(w->spool, f, &e) < 0) cli_die(&e);
        return;
    }
    if (given) release_held(w);
    if (!given || w->poses) apply_keys(w, n, f->values);
    w->released = n + 1;
    cli_stream_put(f);
}

/* Each frame waits until the next has come, so that the last is known as such. */
static void guide_late(void *context, size_t n, vg_frame *in)
{
    work *w = context;
    for (size_t i = 0; i < n; i++) {
        vg_frame late = w->late;
        w->late = in[i], in[i] = late;
        if (w->frames) guide(w, &in[i], w->frames - 1, false);
        w->frames++;
    }
}

static void refuse_unmet(uint64_t frames)
{
    char list[300] = "";
    size_t at = 0;
    for (size_t i = 0; i < opts.nkeys; i++) {
        if (opts.keys[i].met || at + 1 >= sizeof list) continue;
        int n = snprintf(list + at, sizeof list - at, "%s'%s'", at ? ", " : "", opts.keys[i].option);
        at += n > 0 ? (size_t)n : 0;
    }
    if (frames == 0) cli_stop(VG_EINPUT, "there is no frame for %s: the sequence is empty", list);
    cli_stop(VG_EINPUT, "there is no frame for %s among the %llu, whose numbers are 0 to %llu", list,
             (unsigned long long)frames, (unsigned long long)(frames - 1));
}

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    work *w = context;
    vg_err e;
    size_t limit = opts.memory < SIZE_MAX ? (size_t)opts.memory : SIZE_MAX;
    (void)in;
    w->h = h;
    cli_need_vertices(h, "the input");
    for (size_t i = 0; i < opts.nkeys; i++) load_key(&opts.keys[i], h);
    w->ahead = opts.nkeys;
    bool over_pose = cli_given("over") ? opts.over == 1 : opts.nkeys > 2;
    int r = over_pose ? vg_pose_guide_new(&w->poses, h->body.mesh.nv, opts.nkeys, &e)
                      : vg_guide_new(&w->guide, h->body.mesh.nv, &e);
    if (r < 0 || vg_spool_new(&w->spool, h, limit, &e) < 0) cli_die(&e);
}

static void guide_last(void *context)
{
    work *w = context;
    if (w->frames) guide(w, &w->late, w->frames - 1, true);
    if (w->ahead) refuse_unmet(w->frames);
    vg_spool_stats stats = vg_spool_get_stats(w->spool);
    cli_note("%llu frames, at most %llu waited, %llu bytes of them in a temporary file",
             (unsigned long long)w->frames, (unsigned long long)stats.most_frames,
             (unsigned long long)stats.file_bytes);
}

static void close_work(work *w)
{
    vg_frame_clear(&w->held);
    vg_frame_clear(&w->late);
    vg_spool_free(&w->spool);
    vg_guide_free(&w->guide);
    vg_pose_guide_free(&w->poses);
    for (size_t i = 0; i < opts.nkeys; i++) {
        key *k = &opts.keys[i];
        if (k->frame) free((char *)(uintptr_t)k->option);
        free(k->frame);
        free(k->pose);
    }
    free(opts.keys);
}

int main(int argc, char **argv)
{
    static const step guiding = {
        .batch = 1, .unit = "frames", .init = prepare, .process = guide_late, .finish = guide_last};
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    if (opts.nkeys == 0) cli_usage("name at least one given pose: --first, --last or --key");
    work w = {0};
    vg_source *s = cli_source(operands, n);
    step_run(&guiding, &w, s);
    close_work(&w);
    vg_source_close(&s);
    cli_finish(0);
}
