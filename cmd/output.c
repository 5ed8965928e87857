/* output.c: the stream or text output of a program: standard output, or a file that is replaced as a whole when it
 * is complete (vg_targets). Mesh files are written by vg_sink.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "output.h"
#include "cli.h"
#include "options.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

/* The one output of a program at a time. */
static struct {
    int fd; /* -1: not open */
    FILE *text;
    vg_writer *writer;
    char shown[PATH_MAX + 8]; /* its name in messages */
    vg_targets targets;       /* empty: standard output */
} out = {.fd = -1};

static void (*discard_other)(void); /* removes other output; NULL: there is none */

static bool has_temporary(void)
{
    return out.targets.n && !vg_targets_in_place(&out.targets);
}

void output_remove(void)
{
    vg_targets_remove(&out.targets);
    vg_targets_clear(&out.targets);
}

void output_discard(void)
{
    vg_targets_remove(&out.targets);
    if (discard_other) discard_other();
}

void output_abandon(const char *program, int status, const char *message)
{
    if (discard_other) discard_other();
    if (has_temporary()) output_remove();
    else if (out.writer) vg_writer_abandon(out.writer, program, status, message);
}

static void end_by_signal(int number)
{
    output_discard();
    raise(number); /* the handler is reset: raising the signal again ends the process by it */
}

static void catch_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU};
    struct sigaction handler = {.sa_handler = end_by_signal, .sa_flags = (int)SA_RESETHAND}, old;
    sigemptyset(&handler.sa_mask);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (!sigaction(numbers[i], NULL, &old) && old.sa_handler != SIG_IGN) sigaction(numbers[i], &handler, NULL);
}

void cli_discard_by(void (*discard)(void))
{
    discard_other = discard;
    catch_signals();
}

static void die_writing(int error) __attribute__((noreturn));
static void die_writing(int error)
{
    cli_stop(VG_ESYS, "cannot write to %s: %s", out.shown, strerror(error));
}

static bool ends_with_one(const char *name, const char *const *suffixes)
{
    size_t n = strlen(name);
    for (; *suffixes; suffixes++) {
        size_t k = strlen(*suffixes);
        if (n > k && !strcasecmp(name + n - k, *suffixes)) return true;
    }
    return false;
}

/* Names of other formats: refused before the work, not after an hour of it. */
static bool names_picture(const char *name)
{
    static const char *const pictures[] = {".png", ".html", ".htm", NULL};
    return ends_with_one(name, pictures);
}

static bool names_meshes(const char *name)
{
    static const char *const foreign[] = {".fbx", ".dae", ".abc", ".usd", ".usdc", ".usdz", NULL};
    struct stat st;
    bool exists = !stat(name, &st) && !S_ISREG(st.st_mode); /* for a directory or a pipe the suffix does not matter */
    return (!exists && vg_sink_check(name, &(vg_sink_options){.replace = true}, NULL) == VG_OK) || ends_with_one(name, foreign);
}

static bool writes_vectors(void)
{
    const cli_program *p = options_program();
    return p->writes_vectors || (p->vectors_if && *p->vectors_if);
}

static void refuse_terminal(void) __attribute__((noreturn));
static void refuse_terminal(void)
{
    cli_usage("a stream is not written to a terminal: use -o FILE or pipe it into %s",
              writes_vectors()                ? "'vg-solve | vg-decode -o NAME'"
              : options_program()->writes_map ? "a file for vg-play"
                                              : "'vg-decode -o NAME'");
}

static void refuse_stream(const char *name) __attribute__((noreturn));
static void refuse_stream(const char *name)
{
    const char *last = names_picture(name) ? "vg-view" : "vg-decode";
    if (options_program()->writes_map)
        cli_usage("the output is a map, not poses: write it with -o MAP, then 'vg-play MAP POSES | %s -o %s'", last,
                  name);
    cli_usage("the output is a stream: pipe it into '%s%s -o %s'", writes_vectors() ? "vg-solve | " : "",
              last, name);
}

void output_check(bool stream)
{
    vg_err e;
    const char *name = cli_output();
    if (stream && name && (names_meshes(name) || names_picture(name))) refuse_stream(name);
    if (stream && !name && isatty(STDOUT_FILENO)) refuse_terminal();
    if (!name) return;
    snprintf(out.shown, sizeof out.shown, "'%s'", name);
    if (vg_target_check(name, &e) < 0) cli_die(&e);
}

static void open_output(void)
{
    vg_err e;
    if (!cli_output()) {
        out.fd = STDOUT_FILENO;
        snprintf(out.shown, sizeof out.shown, "standard output");
        return;
    }
    catch_signals();
    out.fd = vg_targets_open(&out.targets, cli_output(), &e);
    if (out.fd < 0) cli_die(&e);
}

/* Close the output and rename it. Standard output is left to cli_finish. */
static void close_output(void)
{
    vg_err e;
    if (out.fd != STDOUT_FILENO) {
        int failed = out.text ? fclose(out.text) : close(out.fd);
        if (failed) die_writing(errno);
    }
    if (vg_targets_rename(&out.targets, &e) < 0) cli_die(&e);
    vg_targets_clear(&out.targets);
    out.fd = -1;
    out.text = NULL;
}

/* The directory that holds `path`, with a final slash, or empty. */
static void directory_of(const char *path, char directory[PATH_MAX])
{
    const char *slash = strrchr(path, '/');
    size_t n = slash ? (size_t)(slash - path) + 1 : 0;
    memcpy(directory, path, n);
    directory[n] = 0;
}

static const char *last_component(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

bool cli_same_output(const char *a, const char *b)
{
    struct stat s, t;
    bool there = !stat(a, &s);
    if (there != !stat(b, &t)) return false;
    if (there) return S_ISREG(s.st_mode) && s.st_dev == t.st_dev && s.st_ino == t.st_ino;
    char of_a[PATH_MAX], of_b[PATH_MAX];
    if (strlen(a) >= PATH_MAX || strlen(b) >= PATH_MAX) return false;
    if (strcmp(last_component(a), last_component(b))) return false;
    directory_of(a, of_a), directory_of(b, of_b);
    return !stat(*of_a ? of_a : ".", &s) && !stat(*of_b ? of_b : ".", &t) && s.st_dev == t.st_dev &&
           s.st_ino == t.st_ino;
}

void cli_redirect(const char *file, bool stream)
{
    options_of_process()->output = file && strcmp(file, "-") ? file : NULL;
    output_check(stream);
}

void cli_stream_open(vg_head *h)
{
    vg_err e;
    open_output();
    if (isatty(out.fd)) refuse_terminal();
    if (!options_of_process()->no_provenance) {
        /* the program's name without its path: the same bytes on any machine */
        const options_state *o = options_of_process();
        char *called = o->argv[0];
        o->argv[0] = (char *)(uintptr_t)o->program->name;
        int r = vg_head_trace(h, o->program->name, o->argc, o->argv, &e);
        o->argv[0] = called;
        if (r < 0) cli_die(&e);
    }
    const char *name = cli_output() ? cli_output() : "standard output";
    if (vg_writer_open(&out.writer, out.fd, name, h, &e) < 0) cli_die(&e);
}

void cli_stream_put(const vg_frame *f)
{
    vg_err e;
    if (vg_writer_put(out.writer, f, &e) < 0) cli_die(&e);
}

void output_hand_on(void)
{
    vg_err e;
    if (out.writer && vg_writer_flush(out.writer, &e) < 0) cli_die(&e);
}

void cli_stream_end(const vg_records *tail)
{
    vg_err e;
    if (vg_writer_end(out.writer, tail, &e) < 0) cli_die(&e);
    vg_writer_close(&out.writer);
    close_output();
}

FILE *cli_text_open(void)
{
    open_output();
    out.text = out.fd == STDOUT_FILENO ? stdout : fdopen(out.fd, "w");
    if (!out.text) die_writing(errno);
    return out.text;
}

void cli_text_end(void)
{
    errno = 0;
    if (fflush(out.text) || ferror(out.text)) die_writing(errno ? errno : EIO);
    close_output();
}

void output_flush(void)
{
    snprintf(out.shown, sizeof out.shown, "standard output");
    errno = 0;
    if (fflush(stdout) || ferror(stdout)) die_writing(errno ? errno : EIO);
    /* some file systems report a full disk only here; a descriptor that was never open is no error */
    if (close(STDOUT_FILENO) && errno != EBADF) die_writing(errno);
}
