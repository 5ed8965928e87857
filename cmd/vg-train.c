/* vg-train: train a network to continue a sequence of poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "fitting.h"
#include "networks.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static struct {
    size_t model, direction;
    long layers, hidden, iterations, batch, frames, step, seed, every;
    size_t hold_at;
    double hold, rate, losses[3]; /* bidirectional, kl, l2; negative: the default of the model */
    size_t given[2];              /* 0: the default */
    bool nine;
    const char *checkpoint, *resume, *log;
} opts = {.hold_at = VG_HOLD_BY_SEED, .seed = 1, .every = 100, .hold = 0.2, .losses = {-1, -1, -1}};

static void take_given(const char *text, void *context)
{
    (void)context;
    char *end;
    unsigned long least = strtoul(text, &end, 10), most = least;
    if (*end == '-') most = strtoul(end + 1, &end, 10);
    if (*end || text[0] < '1' || text[0] > '9' || most < least || most > 1000000)
        cli_usage("option '--given' needs a count or a range such as 1-8, not '%s'", text);
    opts.given[0] = least, opts.given[1] = most;
}

static void take_loss(const char *text, void *context)
{
    static const char *const names[] = {"bidirectional", "kl", "l2"};
    (void)context;
    const char *p = text;
    do {
        size_t which = 0, length = strcspn(p, "=");
        while (which < 3 && (strlen(names[which]) != length || strncmp(p, names[which], length))) which++;
        double weight;
        const char *end = which < 3 && p[length] ? cli_scan_number(p + length + 1, &weight) : NULL;
        if (!end || (*end && *end != ',') || weight < 0)
            cli_usage("option '--loss' needs bidirectional=W, kl=W or l2=W, commas between, not '%s'", text);
        opts.losses[which] = weight;
        p = *end ? end + 1 : NULL;
    } while (p);
}

static void take_hold(const char *text, void *context)
{
    (void)context;
    char *end;
    if (!strcmp(text, "end")) {
        opts.hold_at = SIZE_MAX;
        return;
    }
    unsigned long at = strtoul(text, &end, 10);
    if (*end || text[0] < '0' || text[0] > '9' || at > 1000000000)
        cli_usage("option '--hold-at' needs the number of a frame or end, not '%s'", text);
    opts.hold_at = at;
}

static const cli_option options[] = {
    {"model", 0, "auto|pca|fc|conv", "the model around the recurrent layers (default auto)", .choice = &opts.model},
    {"direction", 0, "shared|separate|forward", "chains in both directions with shared (default) or separate "
                                                "weights, or forward only",
     .choice = &opts.direction},
    {"layers", 0, "N", "recurrent layers (default 1, other models 3)", .integer = &opts.layers, .least = 1, .most = 8},
    {"hidden", 0, "N", "size of each layer (default 64, other models 128)", .integer = &opts.hidden, .least = 1, .most = 4096},
    {"iterations", 0, "N", "most iterations (default 300, pca 2500, fc and conv 7000)",
     .integer = &opts.iterations, .least = 1, .most = 100000000},
    {"batch", 0, "N", "sequences per iteration (default 8)", .integer = &opts.batch, .least = 1, .most = 4096},
    {"frames", 0, "N", "frames per sequence (default 32)", .integer = &opts.frames, .least = 3, .most = 100000},
    {"step", 0, "N", "use only every Nth frame (default 1)", .integer = &opts.step, .least = 1,
     .most = 1000},
    {"given", 0, "N-M", "frames that are given, drawn anew each time (auto: 3-8, pca: 1-8, fc and conv: 1)",
     .take = take_given},
    {"hold", 0, "SHARE", "share of each sequence held out for evaluation (default 0.2)", .number = &opts.hold,
     .least = 0, .most = 0.9},
    {"hold-at", 0, "N|end", "first frame of that block, or at the end (default: by the seed)",
     .take = take_hold},
    {"rate", 0, "X", "initial learning rate (default 0.001, other models 0.002)", .number = &opts.rate, .least = 1e-9,
     .most = 1},
    {"loss", 0, "NAME=W,...", "weights of bidirectional, kl and l2; 0 leaves one out", .take = take_loss},
    {"nine", 0, NULL, "nine numbers per vertex, as published, not twelve", .flag = &opts.nine},
    {"seed", 0, "N", "seed of all random choices (default 1)", .integer = &opts.seed, .least = 0,
     .most = 4294967295.0},
    {"checkpoint", 0, "FILE", "write the unfinished network to FILE periodically", .text = &opts.checkpoint},
    {"every", 0, "N", "with --checkpoint: iterations between two of them (default 100)", .integer = &opts.every, .least = 1,
     .most = 100000000, .needs = "checkpoint"},
    {"resume", 0, "FILE", "resume from a checkpoint, with the same poses and options", .text = &opts.resume,
     .reads = true},
    {"log", 0, "FILE", "write a line of tab-separated numbers for each iteration", .text = &opts.log},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-train",
    .synopsis = "[options] [FILE ...]",
    .summary = "train a network to continue a sequence of poses",
    .options = options,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .threaded = true};

static volatile sig_atomic_t interrupted;
static bool is_first; /* of the processes that train together: the one that writes and reports */

static void interrupt(int signal_number)
{
    (void)signal_number;
    interrupted = 1;
}

static vg_train_options choose_options(void)
{
    vg_train_options o = vg_train_defaults((vg_network_model)(opts.model + 1));
    o.direction = (vg_direction)opts.direction;
    if (opts.layers) o.layers = (size_t)opts.layers;
    if (opts.hidden) o.hidden = (size_t)opts.hidden;
    if (opts.iterations) o.iterations = (size_t)opts.iterations;
    if (opts.batch) o.batch = (size_t)opts.batch;
    if (opts.frames) o.frames = (size_t)opts.frames;
    if (opts.step) o.step = (size_t)opts.step;
    if (opts.given[0]) o.given_least = opts.given[0], o.given_most = opts.given[1];
    if (o.given_most >= o.frames) cli_usage("option '--given' must be less than the %zu frames of a sequence", o.frames);
    if (opts.rate > 0) o.rate = opts.rate;
    if (opts.losses[0] >= 0) o.bidirectional = opts.losses[0];
    if (opts.losses[1] >= 0) o.divergence = opts.losses[1];
    if (opts.losses[2] >= 0) o.decay = opts.losses[2];
    o.hold = opts.hold, o.hold_at = opts.hold_at;
    o.nine = opts.nine, o.seed = (uint64_t)opts.seed, o.threads = cli_threads();
    return o;
}

/* ---- poses ---- */

static void add_batch(void *context, const fitting_batch *b)
{
    vg_err e;
    if (vg_trainer_add(context, b->n, b->values, &e) < 0) cli_die(&e);
}

static void read_sequence(vg_trainer *t, vg_source *s)
{
    fitting_stream(s, add_batch, t);
    vg_trainer_cut(t);
}

/* The operands after the first: sequences with the same mesh. */
static void read_others(vg_trainer *t, vg_head *h, char **operands, size_t n)
{
    vg_err e;
    for (size_t i = 1; i < n; i++) {
        char name[200];
        snprintf(name, sizeof name, "'%.190s'", operands[i]);
        vg_source *s = cli_source(operands + i, 1);
        cli_need_vertices(vg_source_head(s), name);
        if (vg_mesh_same(&h->body.mesh, "the first sequence", &vg_source_head(s)->body.mesh, name, &e) < 0 ||
            vg_head_merge_trace(h, vg_source_head(s), &e) < 0)
            cli_die(&e);
        read_sequence(t, s);
        vg_source_close(&s);
    }
}

/* ---- checkpoints ---- */

static void write_checkpoint(const vg_trainer *t, vg_head *h)
{
    static vg_targets targets;
    vg_err e;
    vg_writer *w;
    int fd;
    vg_network_clear(&h->network);
    if (vg_trainer_network(t, false, &h->network, &e) < 0 || (fd = vg_targets_open(&targets, opts.checkpoint, &e)) < 0)
        cli_die(&e);
    int r = vg_writer_open(&w, fd, opts.checkpoint, h, &e);
    if (r >= 0) {
        r = vg_writer_end(w, NULL, &e);
        vg_writer_close(&w);
    }
    vg_err close_error;
    int closed = vg_target_close(fd, opts.checkpoint, &close_error);
    if (r >= 0 && closed < 0) r = closed, e = close_error;
    if (r >= 0) r = vg_targets_rename(&targets, &e);
    if (r < 0) {
        vg_targets_remove(&targets);
        cli_die(&e);
    }
    vg_targets_clear(&targets);
    vg_network_clear(&h->network);
}

static void resume(vg_trainer *t)
{
    vg_err e;
    vg_head from = {0};
    if (!opts.resume) return;
    cli_load(&from, opts.resume, "mesh");
    if (!from.network.model) cli_stop(VG_EINPUT, "'%.190s' holds no network: --resume needs a file written by "
                                                 "--checkpoint", opts.resume);
    if (vg_trainer_resume(t, &from.network, &e) < 0) cli_stop(VG_EINPUT, "cannot resume from '%.190s': %s", opts.resume, e.message);
    vg_head_clear(&from);
}

/* ---- the log ---- */

static const char log_head[] = "phase\titeration\tloss\tgradient\tvalidation\n";

/* What the log of an interrupted training says of the iterations that are not done again. */
static void put_old_log(FILE *to, const vg_train_state *done)
{
    size_t size;
    char *text = cli_read_file(opts.log, &size);
    for (char *line = text, *end; (end = strchr(line, '\n')); line = end + 1) {
        int phase;
        unsigned long long iteration;
        *end = 0;
        if (sscanf(line, "%d\t%llu\t", &phase, &iteration) == 2 &&
            (phase < done->phase || (phase == done->phase && iteration <= done->iteration)))
            fprintf(to, "%s\n", line);
    }
    free(text);
}

static void log_failed(void)
{
    cli_stop(VG_ESYS, "cannot write '%.190s': %s", opts.log, strerror(errno));
}

/* The log begins as a whole under another name; from then on it grows by whole lines. */
static FILE *open_log(const vg_train_state *done)
{
    static vg_targets targets;
    vg_err e;
    if (!opts.log) return NULL;
    int fd = vg_targets_open(&targets, opts.log, &e);
    if (fd < 0) cli_die(&e);
    FILE *log = fdopen(dup(fd), "w");
    if (!log) log_failed();
    setvbuf(log, NULL, _IOLBF, 0);
    fputs(log_head, log);
    if (opts.resume && access(opts.log, R_OK) == 0) put_old_log(log, done);
    if (fflush(log) || ferror(log)) log_failed();
    if (vg_target_close(fd, opts.log, &e) < 0 || vg_targets_rename(&targets, &e) < 0) {
        vg_targets_remove(&targets);
        cli_die(&e);
    }
    vg_targets_clear(&targets);
    return log;
}

static void write_log(FILE *log, const vg_train_state *s)
{
    if (!log) return;
    fprintf(log, "%d\t%llu\t%.6g\t%.6g\t", s->phase, (unsigned long long)s->iteration, s->loss, s->gradient);
    if (isnan(s->validation)) fputs("\n", log);
    else fprintf(log, "%.6g\n", s->validation);
    if (ferror(log)) log_failed();
}

/* ---- learning ---- */

static void show(const vg_train_state *s)
{
    if (isnan(s->validation)) cli_progress_detail(", loss %.4g", s->loss);
    else cli_progress_detail(", loss %.4g, held-out error %.4g", s->loss, s->validation);
    cli_progress_of(s->phase ? "iterations on all frames" : "iterations of validation", s->iteration, s->iterations);
}

/* True: to the end. */
static bool train_network(vg_trainer *t, vg_head *h, vg_train_state *s)
{
    vg_err e;
    int r = 0;
    double start = cli_seconds();
    *s = vg_trainer_get_state(t);
    FILE *log = is_first ? open_log(s) : NULL;
    bool stopped;
    while (!(stopped = vg_train_any(interrupted)) && (r = vg_trainer_step(t, s, &e)) > 0) {
        write_log(log, s);
        show(s);
        if (opts.checkpoint && is_first && s->iteration % (uint64_t)opts.every == 0) write_checkpoint(t, h);
    }
    if (log && fclose(log)) log_failed();
    if (!stopped && r < 0) cli_die(&e);
    cli_note("learned in %.1f s", cli_seconds() - start);
    return !stopped;
}

/* ---- the report ---- */

static const double damped_ridge = 1e6; /* with so large a ridge a regression is damped continuation */

static void print_row(const char *name, const vg_network_errors *x, int method)
{
    char text[200];
    int n = snprintf(text, sizeof text, "%-22s", name);
    for (int given = 0; given < 2; given++)
        for (int i = 0; i < VG_NETWORK_FRAMES; i++) {
            double value = x->at[given][method][i];
            n += isnan(value) ? snprintf(text + n, sizeof text - (size_t)n, "%8s", "-")
                              : snprintf(text + n, sizeof text - (size_t)n, "%8.2f", value);
        }
    cli_say("%s", text);
}

/* the method with the least error after three given frames, as shown; of equal ones the last */
static int best_of(const vg_network_errors *x, int most)
{
    int best = 0;
    double least = INFINITY;
    for (int m = 0; m < most; m++) {
        double sum = 0;
        for (int i = 0; i < VG_NETWORK_FRAMES; i++) sum += isnan(x->at[1][m][i]) ? 0 : rint(100 * x->at[1][m][i]);
        if (sum <= least) least = sum, best = m;
    }
    return best;
}

static void report_errors(vg_trainer *t, const vg_train_state *s)
{
    vg_network_errors x;
    vg_err e;
    cli_working("measuring held-out frames");
    if (vg_trainer_judge(t, &x, &e) < 0) cli_die(&e);
    if (!x.windows) {
        cli_note("nothing is held out for evaluation");
        return;
    }
    cli_say("%zu training frames, %zu held out: mean error of a vertex in %% of D, 5, 10 and 15 frames ahead", s->frames,
            s->held);
    cli_say("%-22s%24s%24s", "", "1 frame given", "3 frames given");
    for (int m = 0; m < VG_NETWORK_METHODS; m++) print_row(network_methods[m], &x, m);
    int best = best_of(&x, VG_NETWORK_METHODS);
    if (best != VG_NETWORK_METHODS - 1)
        cli_say("the network is worse on held-out frames than '%s'", network_methods[best]);
}

/* How the network continues poses, if not by regression and layers. */
static void report_forecast(const vg_network *n, const vg_train_state *s)
{
    if (n->model != VG_NETWORK_AUTO) return;
    void (*tell)(const char *, ...) = n->windows ? cli_say : cli_note;
    bool damped = n->ridge >= damped_ridge, alone = !s->best_iteration && n->ncurve_block;
    if (damped)
        tell("on the training frames nothing is better than linear continuation, damped by %g a frame: the network uses it%s",
             n->damping, alone ? "" : ", corrected by its layers");
    else if (alone) tell("the layers improve nothing in the validation block: the network is the regression alone");
}

/* Other outputs must have different names from the network. */
static void check_outputs(void)
{
    const char *names[] = {cli_output(), opts.checkpoint, opts.log};
    vg_err e;
    for (int i = 1; i < 3; i++) {
        if (!names[i]) continue;
        for (int k = 0; k < i; k++)
            if (names[k] && cli_same_output(names[i], names[k])) cli_usage("'%.190s' would be written twice", names[i]);
        if (vg_target_check(names[i], &e) < 0) cli_die(&e);
    }
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_train_options o = choose_options();
    is_first = vg_train_process() == 0;
    if (!is_first) cli_be_quiet();
    vg_source *s = cli_source(operands, n ? 1 : 0);
    vg_head *h = vg_source_head(s);
    vg_trainer *t;
    vg_train_state state = {0};
    vg_err e;
    cli_need_vertices(h, "the input");
    check_outputs();
    if (vg_trainer_new(&t, &h->body.mesh, h->body.reference, &o, &e) < 0) cli_die(&e);
    read_sequence(t, s);
    read_others(t, h, operands, n);
    cli_working("preparing");
    if (vg_trainer_prepare(t, &e) < 0) cli_die(&e);
    resume(t);
    vg_network_clear(&h->network);
    if (opts.checkpoint) signal(SIGINT, interrupt), signal(SIGTERM, interrupt);
    if (!train_network(t, h, &state)) {
        if (is_first) write_checkpoint(t, h);
        vg_trainer_free(&t);
        cli_stop(VG_ESYS, "interrupted after %llu iterations: continue with --resume %s", (unsigned long long)state.iteration,
                 opts.checkpoint);
    }
    if (!is_first) {
        vg_trainer_free(&t);
        cli_finish(0);
    }
    report_errors(t, &state);
    if (vg_trainer_network(t, true, &h->network, &e) < 0) cli_die(&e);
    vg_trainer_free(&t);
    report_forecast(&h->network, &state);
    cli_stream_open(h);
    cli_stream_end(vg_source_tail(s));
    vg_source_close(&s);
    cli_finish(0);
}
