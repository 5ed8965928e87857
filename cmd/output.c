/* output.c: where the stream or text of a program goes: standard output, a special file opened as it is, or a
 * temporary file that takes its final name at the end. Leaves out mesh files: their names and temporary files are
 * vg_sink's, in the library. SPDX-License-Identifier: GPL-3.0-or-later */
#include "output.h"
#include "cli.h"

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
    char shown[PATH_MAX + 8]; /* what messages call it */
    char final[PATH_MAX];     /* empty: nothing to rename */
    char temporary[PATH_MAX];
    volatile sig_atomic_t has_temporary;
} out = {.fd = -1};

static void (*discard_other)(void); /* output that is not ours; NULL: none */

void output_remove(void)
{
    if (out.has_temporary) unlink(out.temporary);
    out.has_temporary = 0;
}

void output_discard(void)
{
    if (out.has_temporary) unlink(out.temporary);
    if (discard_other) discard_other();
}

void output_abandon(const char *program, int status, const char *message)
{
    if (out.has_temporary)
        output_remove();
    else if (out.writer)
        vg_writer_abandon(out.writer, program, status, message);
}

static void end_by_signal(int number)
{
    output_discard();
    raise(number); /* the handler was one-shot: the second time ends the process, and by the right signal */
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

/* Names that promise something else than a stream: better said before an hour of work than after it. */
static bool names_picture(const char *name)
{
    static const char *const pictures[] = {".png", ".html", ".htm", NULL};
    return ends_with_one(name, pictures);
}

static bool names_meshes(const char *name)
{
    static const char *const foreign[] = {".fbx", ".dae", ".abc", ".usd", ".usdc", ".usdz", NULL};
    struct stat st;
    bool exists = !stat(name, &st) && !S_ISREG(st.st_mode); /* a directory, a pipe: what it is goes before its name */
    return (!exists && vg_sink_check(name, &(vg_sink_options){0}, NULL) == VG_OK) || ends_with_one(name, foreign);
}

/* The directory that holds `path`, with a final slash or empty; returns where the last component starts. */
static const char *split_path(const char *path, char directory[PATH_MAX])
{
    const char *slash = strrchr(path, '/');
    size_t n = slash ? (size_t)(slash - path) + 1 : 0;
    memcpy(directory, path, n);
    directory[n] = 0;
    return path + n;
}

static void refuse_terminal(void) __attribute__((noreturn));
static void refuse_terminal(void)
{
    cli_usage("a stream is not written to a terminal: use -o FILE or pipe it into %s",
              cli.program->writes_vectors ? "'vg-solve | vg-decode -o NAME'"
              : cli.program->writes_map   ? "a file for vg-play"
                                          : "'vg-decode -o NAME'");
}

static void refuse_stream(const char *name) __attribute__((noreturn));
static void refuse_stream(const char *name)
{
    const char *last = names_picture(name) ? "vg-view" : "vg-decode";
    if (cli.program->writes_map)
        cli_usage("the output is a map, not poses: write it with -o MAP, then 'vg-play MAP POSES | %s -o %s'", last,
                  name);
    cli_usage("the output is a stream: pipe it into '%s%s -o %s'", cli.program->writes_vectors ? "vg-solve | " : "",
              last, name);
}

void output_check(bool stream)
{
    const char *name = cli.output;
    struct stat st;
    if (stream && name && (names_meshes(name) || names_picture(name))) refuse_stream(name);
    if (stream && !name && isatty(STDOUT_FILENO)) refuse_terminal();
    if (!name) return;
    if (!*name) cli_usage("option '--output' needs the name of a file");
    if (strlen(name) > PATH_MAX - 64)
        cli_stop(VG_ESYS, "cannot write to '%.40s...': %s", name, strerror(ENAMETOOLONG));
    snprintf(out.shown, sizeof out.shown, "'%s'", name);
    if (!stat(name, &st)) {
        if (S_ISDIR(st.st_mode)) die_writing(EISDIR);
        if (!S_ISREG(st.st_mode)) return; /* a pipe or device: opened and written as it is */
    } else if (errno != ENOENT) {
        die_writing(errno);
    } else if (!lstat(name, &st)) { /* a file would come in its place */
        cli_stop(VG_ESYS, "cannot write to %s: it is a link to a file that is not there", out.shown);
    }
    char directory[PATH_MAX];
    if (!*split_path(name, directory)) die_writing(EISDIR);
    if (access(*directory ? directory : ".", W_OK | X_OK)) die_writing(errno);
}

/* Open ".NAME.PID.tmp" beside out.final. */
static int open_temporary(void)
{
    char directory[PATH_MAX];
    const char *base = split_path(out.final, directory);
    for (int i = 0; i < 100; i++) {
        char number[16] = "";
        if (i) snprintf(number, sizeof number, "-%d", i); /* a process of this number was killed here once */
        int n = snprintf(out.temporary, sizeof out.temporary, "%s.%.200s.%ld%s.tmp", directory, base, (long)getpid(),
                         number);
        if (n < 0 || (size_t)n >= sizeof out.temporary) die_writing(ENAMETOOLONG);
        int fd = open(out.temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd >= 0) return fd;
        if (errno != EEXIST) die_writing(errno);
    }
    die_writing(EEXIST);
}

static void open_output(void)
{
    struct stat st;
    if (!cli.output) {
        out.fd = STDOUT_FILENO;
        snprintf(out.shown, sizeof out.shown, "standard output");
        return;
    }
    bool exists = !stat(cli.output, &st);
    if (exists && !S_ISREG(st.st_mode)) {
        out.fd = open(cli.output, O_WRONLY | O_NOCTTY | O_CLOEXEC);
        if (out.fd < 0) die_writing(errno);
        return;
    }
    /* through a symbolic link to the file it means, or the link itself would be replaced */
    if (!exists || !realpath(cli.output, out.final)) snprintf(out.final, sizeof out.final, "%s", cli.output);
    catch_signals();
    sigset_t all, before; /* a signal between the two would leave a file that nobody knows of */
    sigfillset(&all);
    sigprocmask(SIG_BLOCK, &all, &before);
    out.fd = open_temporary();
    out.has_temporary = 1;
    sigprocmask(SIG_SETMASK, &before, NULL);
    if (exists && fchmod(out.fd, st.st_mode & 07777)) { /* keeps the mode where it can; not worth failing for */
    }
}

/* Close the output and give it its final name. Standard output stays for cli_finish. */
static void close_output(void)
{
    if (out.fd != STDOUT_FILENO) {
        int failed = out.text ? fclose(out.text) : close(out.fd);
        if (failed) die_writing(errno);
    }
    if (out.has_temporary) {
        if (rename(out.temporary, out.final)) die_writing(errno);
        out.has_temporary = 0;
    }
    out.fd = -1;
    out.text = NULL;
}

bool cli_same_output(const char *a, const char *b)
{
    struct stat s, t;
    bool there = !stat(a, &s);
    if (there != !stat(b, &t)) return false;
    if (there) return S_ISREG(s.st_mode) && s.st_dev == t.st_dev && s.st_ino == t.st_ino;
    char of_a[PATH_MAX], of_b[PATH_MAX];
    if (strlen(a) >= PATH_MAX || strlen(b) >= PATH_MAX) return false;
    if (strcmp(split_path(a, of_a), split_path(b, of_b))) return false;
    return !stat(*of_a ? of_a : ".", &s) && !stat(*of_b ? of_b : ".", &t) && s.st_dev == t.st_dev &&
           s.st_ino == t.st_ino;
}

void cli_redirect(const char *file, bool stream)
{
    cli.output = file && strcmp(file, "-") ? file : NULL;
    *out.final = 0;
    output_check(stream);
}

void cli_stream_open(vg_head *h)
{
    vg_err e;
    open_output();
    if (isatty(out.fd)) refuse_terminal();
    if (!cli.no_provenance) {
        /* the program's own name instead of the path it was found by: same command, same bytes, on any machine */
        char *called = cli.argv[0];
        cli.argv[0] = (char *)(uintptr_t)cli.program->name;
        int r = vg_head_trace(h, cli.program->name, cli.argc, cli.argv, &e);
        cli.argv[0] = called;
        if (r < 0) cli_die(&e);
    }
    const char *name = cli.output ? cli.output : "standard output";
    if (vg_writer_open(&out.writer, out.fd, name, h, &e) < 0) cli_die(&e);
}

void cli_stream_put(const vg_frame *f)
{
    vg_err e;
    if (vg_writer_put(out.writer, f, &e) < 0) cli_die(&e);
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
    /* some file systems tell only here that the disk is full; a descriptor that was never open is no loss */
    if (close(STDOUT_FILENO) && errno != EBADF) die_writing(errno);
}
