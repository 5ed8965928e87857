/* cli.c: what all programs share: options, help, messages, where output goes, exit. The only file that prints to
 * standard error. Leaves out mesh files as output: their names and temporary files are vg_sink's, in the library.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "processors.h"

#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
    PIPE_BYTES = 1 << 20, /* a pipe of this size carries three to four times what one of 64 KiB does */
    MOST_THREADS = 256,
    MESSAGE_BYTES = 1024,
    HELP_COLUMN = 32
};

struct cli_state cli;

/* Programs end without the C library's clean-up, which would flush half a report. A coverage build wants its counters
 * written all the same. */
void __gcov_dump(void) __attribute__((weak));
static void leave(int status) __attribute__((noreturn));
static void leave(int status)
{
    if (__gcov_dump) __gcov_dump();
    _exit(status);
}

/* ------------------------------------------------------------------------------------------- messages -- */

static bool progress_shown;
static double started;

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* What a terminal would obey rather than show becomes '?': C0, DEL, and C1 in UTF-8. */
static void strip_controls(char *s)
{
    for (unsigned char *p = (unsigned char *)s; *p; p++) {
        if (*p < 0x20 || *p == 0x7f) *p = '?';
        if (*p == 0xc2 && p[1] >= 0x80 && p[1] < 0xa0) p[0] = p[1] = '?';
    }
}

/* One write per message, so that the lines of programs that share a terminal do not mix. */
static void print_error(const char *text, size_t n)
{
    while (n) {
        ssize_t k = write(STDERR_FILENO, text, n);
        if (k < 0 && errno == EINTR) continue;
        if (k <= 0) return; /* there is nobody left to tell */
        text += k, n -= (size_t)k;
    }
}

static void erase_progress(void)
{
    if (progress_shown) print_error("\r\033[K", 4);
    progress_shown = false;
}

static void say_line(const char *kind, const char *format, va_list ap)
{
    char body[MESSAGE_BYTES], line[MESSAGE_BYTES + 64];
    vsnprintf(body, sizeof body, format, ap);
    strip_controls(body);
    int n = snprintf(line, sizeof line, "%s: %s%s\n", cli.program->name, kind, body);
    erase_progress();
    if (n > 0) print_error(line, (size_t)n < sizeof line ? (size_t)n : sizeof line - 1);
}

void cli_warn(const char *format, ...)
{
    if (cli.quiet) return;
    va_list ap;
    va_start(ap, format);
    say_line("warning: ", format, ap);
    va_end(ap);
}

void cli_say(const char *format, ...)
{
    if (cli.quiet) return;
    va_list ap;
    va_start(ap, format);
    say_line("", format, ap);
    va_end(ap);
}

void cli_note(const char *format, ...)
{
    if (!cli.verbose) return;
    va_list ap;
    va_start(ap, format);
    say_line("", format, ap);
    va_end(ap);
}

static void say_error(const char *format, ...) VG_PRINTF(1, 2);
static void say_error(const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    say_line("", format, ap);
    va_end(ap);
}

void cli_progress(const char *label, uint64_t n)
{
    static double last;
    static int terminal = -1;
    if (terminal < 0) terminal = isatty(STDERR_FILENO);
    if (!terminal || cli.quiet) return;
    double now = seconds();
    if (now - started < 1 || now - last < 0.2) return;
    last = now;
    char line[128];
    int k = snprintf(line, sizeof line, "\r\033[K%s: %.64s %llu", cli.program->name, label, (unsigned long long)n);
    progress_shown = true;
    if (k > 0) print_error(line, (size_t)k < sizeof line ? (size_t)k : sizeof line - 1);
}

/* --------------------------------------------------------------------------------------------- output -- */

/* The one output of a program: standard output, a special file opened as it is, or a temporary file that takes its
 * final name at the end. */
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

static void remove_temporary(void)
{
    if (out.has_temporary) unlink(out.temporary);
    out.has_temporary = 0;
}

static void end_by_signal(int number)
{
    if (out.has_temporary) unlink(out.temporary);
    if (discard_other) discard_other();
    raise(number); /* the handler was one-shot: the second time ends the process, and by the right signal */
}

static void catch_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
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

static vg_source *upstream; /* of cli_source: it may know of a program before this one that failed */

/* Leave nothing half-written: no temporary file, and no stream that only stops. Of a pipe's programs the first that
 * failed is named to all behind it. */
static void abandon_output(int code, int status, const char *message)
{
    const vg_failure *before = code == VG_ETRUNC && upstream ? vg_source_failure(upstream) : NULL;
    if (out.has_temporary)
        remove_temporary();
    else if (out.writer && before)
        vg_writer_abandon(out.writer, before->program, (int)before->status, before->message);
    else if (out.writer)
        vg_writer_abandon(out.writer, cli.program->name, status, message);
}

void cli_die(const vg_err *e)
{
    int status = vg_exit_status(e->code);
    if (status < 2) status = 4;
    remove_temporary();
    say_error("%s", e->message);
    abandon_output(e->code, status, e->message);
    leave(status);
}

void cli_no(const char *format, ...)
{
    char text[MESSAGE_BYTES];
    va_list ap;
    va_start(ap, format);
    vsnprintf(text, sizeof text, format, ap);
    va_end(ap);
    strip_controls(text);
    remove_temporary();
    say_error("%s", text);
    abandon_output(VG_OK, 1, text);
    leave(1);
}

void cli_stop(int code, const char *format, ...)
{
    char text[MESSAGE_BYTES];
    va_list ap;
    va_start(ap, format);
    vsnprintf(text, sizeof text, format, ap);
    va_end(ap);
    vg_err e;
    vg_fail(&e, code, "%s", text);
    cli_die(&e);
}

void *cli_allocate(size_t n, size_t size, const char *what)
{
    void *p = calloc(n + 1, size);
    if (!p) cli_stop(VG_ENOMEM, "not enough memory for %s", what);
    return p;
}

void cli_usage(const char *format, ...)
{
    char text[MESSAGE_BYTES], usage[512];
    va_list ap;
    va_start(ap, format);
    vsnprintf(text, sizeof text, format, ap);
    va_end(ap);
    strip_controls(text);
    remove_temporary();
    say_error("%s", text);
    int n = snprintf(usage, sizeof usage, "usage: %s %s\n", cli.program->name, cli.program->synopsis);
    if (n > 0) print_error(usage, (size_t)n < sizeof usage ? (size_t)n : sizeof usage - 1);
    abandon_output(VG_EARG, 2, text);
    leave(2);
}

static void die_writing(int error) __attribute__((noreturn));
static void die_writing(int error)
{
    cli_stop(VG_ESYS, "cannot write to %s: %s", out.shown, strerror(error));
}

static bool ends_with(const char *s, size_t n, const char *suffix)
{
    size_t k = strlen(suffix);
    return n > k && !strncasecmp(s + n - k, suffix, k);
}

/* Names that promise something else than a stream: better said before an hour of work than after it. */
static bool names_picture(const char *name)
{
    return ends_with(name, strlen(name), ".png") || ends_with(name, strlen(name), ".html");
}

static bool names_meshes(const char *name)
{
    static const char *const suffixes[] = {".obj", ".ply", ".off", ".stl", ".glb", ".gltf", ".pc2", ".mdd", ".npy",
        ".npz", ".bvh", ".fbx", ".dae", ".abc", ".usd", ".zip", ".7z", ".tar", ".tgz", ".tar.gz", ".tar.xz",
        ".tar.zst", ".tar.bz2"};
    size_t n = strlen(name);
    const char *colon = strrchr(name, ':'); /* "out.zip:ply" */
    for (size_t i = 0; i < sizeof suffixes / sizeof *suffixes; i++)
        if (ends_with(name, n, suffixes[i]) || (colon && ends_with(name, (size_t)(colon - name), suffixes[i])))
            return true;
    return false;
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

/* Programs leave by leave(): whoever calls exit() is a library that gives up, as libarchive does without memory. Its
 * status would say something else, and half a file would stay. */
static void library_gave_up(void)
{
    if (discard_other) discard_other();
    cli_stop(VG_ENOMEM, "a library gave up, for lack of memory most likely");
}

/* Look at --output before any work: what is wrong with it now will be wrong then. */
static void check_output(bool stream)
{
    const char *name = cli.output;
    struct stat st;
    if (stream && name && (names_meshes(name) || names_picture(name)))
        cli_usage("the output is a stream: pipe it into '%s -o %s'", names_picture(name) ? "vg-view" : "vg-decode",
                  name);
    if (stream && !name && isatty(STDOUT_FILENO))
        cli_usage("a stream is not written to a terminal: use -o FILE or a pipe");
    if (!name) return;
    if (!*name) cli_usage("option '--output' needs the name of a file");
    if (strlen(name) > PATH_MAX - 64)
        cli_stop(VG_ESYS, "cannot write to '%.40s...': %s", name, strerror(ENAMETOOLONG));
    snprintf(out.shown, sizeof out.shown, "'%s'", name);
    if (!stat(name, &st)) {
        if (S_ISDIR(st.st_mode)) die_writing(EISDIR);
        if (!S_ISREG(st.st_mode)) return; /* a pipe or device: opened and written as it is */
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

void cli_redirect(const char *file, bool stream)
{
    cli.output = file && strcmp(file, "-") ? file : NULL;
    *out.final = 0;
    check_output(stream);
}

void cli_stream_open(vg_head *h)
{
    vg_err e;
    open_output();
    if (isatty(out.fd)) cli_usage("a stream is not written to a terminal: use -o FILE or a pipe");
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

void cli_finish(int status)
{
    erase_progress();
    remove_temporary(); /* of an output that was never ended */
    snprintf(out.shown, sizeof out.shown, "standard output");
    errno = 0;
    if (fflush(stdout) || ferror(stdout)) die_writing(errno ? errno : EIO);
    /* some file systems tell only here that the disk is full; a descriptor that was never open is no loss */
    if (close(STDOUT_FILENO) && errno != EBADF) die_writing(errno);
    leave(status);
}

char *cli_read_file(const char *path, size_t *n)
{
    char *data = NULL;
    size_t cap = 0;
    FILE *f = strcmp(path, "-") ? fopen(path, "re") : stdin;
    *n = 0;
    errno = f ? 0 : errno;
    while (f) {
        if (cap - *n < 1 << 16 && !(data = realloc(data, cap = 2 * cap + (1 << 17))))
            cli_stop(VG_ENOMEM, "not enough memory for a file");
        size_t got = fread(data + *n, 1, cap - *n, f);
        *n += got;
        if (got == 0) break;
    }
    if (!f || ferror(f)) cli_stop(VG_ESYS, "cannot read '%s': %s", path, strerror(errno ? errno : EIO));
    if (f != stdin) fclose(f);
    return data;
}

/* -------------------------------------------------------------------------------------------- options -- */

static bool want_help, want_version;
static long threads_asked;

/* The options that programs share, and which programs have them. */
typedef enum shared_use { ALL, OUTPUT, TEXT, STREAM, THREADS } shared_use;
static const struct shared {
    shared_use use;
    cli_option option;
} shared_options[] = {
    {OUTPUT, {.name = "output", .letter = 'o', .value = "FILE", .help = "write to FILE instead of standard output",
              .text = &cli.output}},
    {TEXT, {.name = "json", .help = "print JSON", .flag = &cli.json}},
    {STREAM, {.name = "no-provenance", .help = "do not record this command line in the stream",
              .flag = &cli.no_provenance}},
    {THREADS, {.name = "threads", .letter = 'j', .value = "N", .help = "use N threads (default: all processors)",
               .integer = &threads_asked, .least = 1, .most = MOST_THREADS}},
    {ALL, {.name = "quiet", .letter = 'q', .help = "no warnings and no progress", .flag = &cli.quiet}},
    {ALL, {.name = "verbose", .letter = 'v', .help = "say more on standard error", .flag = &cli.verbose}},
    {ALL, {.name = "help", .letter = 'h', .help = "print this help", .flag = &want_help}},
    {ALL, {.name = "version", .letter = 'V', .help = "print the version", .flag = &want_version}},
};

enum { MOST_OPTIONS = 64 };

static bool applies(const cli_program *p, shared_use use)
{
    switch (use) {
    case OUTPUT: return p->writes_stream || p->writes_text || p->writes_file;
    case TEXT: return p->writes_text;
    case STREAM: return p->writes_stream || p->traces;
    case THREADS: return p->threaded;
    default: return true;
    }
}

/* All options of p, its own first; returns how many. */
static size_t gather_options(const cli_program *p, const cli_option *all[MOST_OPTIONS])
{
    size_t n = 0;
    for (const cli_option *o = p->options; o && o->name && n < MOST_OPTIONS; o++) all[n++] = o;
    for (size_t i = 0; i < sizeof shared_options / sizeof *shared_options && n < MOST_OPTIONS; i++)
        if (applies(p, shared_options[i].use)) all[n++] = &shared_options[i].option;
    return n;
}

static int option_text(const cli_option *o, char *to, size_t n)
{
    char letter[8] = "    ";
    if (o->letter) snprintf(letter, sizeof letter, "-%c, ", o->letter);
    return snprintf(to, n, "  %s--%s%s%s", letter, o->name, o->value ? " " : "", o->value ? o->value : "");
}

/* An option that is too long for the column has its explanation on a line of its own. */
static void print_help(const cli_program *p, const cli_option *const *all, size_t n)
{
    char text[128];
    int width = 0;
    for (size_t i = 0; i < n; i++) {
        int w = option_text(all[i], text, sizeof text);
        if (w > width && w <= HELP_COLUMN) width = w;
    }
    printf("usage: %s %s\n%s\n\n", p->name, p->synopsis, p->summary);
    for (size_t i = 0; i < n; i++) {
        bool fits = option_text(all[i], text, sizeof text) <= width;
        if (!fits) printf("%s\n", text);
        printf("%-*s  %s\n", width, fits ? text : "", all[i]->help);
    }
}

/* strtod takes more than a person means by a number: blanks before it, hexadecimal, names. */
static bool parse_number(const char *text, double *x)
{
    char *end;
    if (!*text || text[strspn(text, "+-.0123456789eE")]) return false;
    *x = strtod(text, &end);
    return !*end && isfinite(*x);
}

static bool parse_integer(const char *text, long *x)
{
    char *end;
    if (!*text || text[strspn(text, "+-0123456789")]) return false;
    errno = 0;
    *x = strtol(text, &end, 10);
    return !*end && !errno;
}

static void refuse_value(const cli_option *o, const char *what, const char *text) __attribute__((noreturn));
static void refuse_value(const cli_option *o, const char *what, const char *text)
{
    char range[80] = "";
    if ((o->least != 0 || o->most != 0) && isinf(o->most))
        snprintf(range, sizeof range, " of at least %g", o->least);
    else if (o->least != 0 || o->most != 0)
        snprintf(range, sizeof range, " from %.10g to %.10g", o->least, o->most);
    cli_usage("option '--%s' needs %s%s, not '%s'", o->name, what, range, text);
}

static bool in_range(const cli_option *o, double x)
{
    return (o->least == 0 && o->most == 0) || (x >= o->least && x <= o->most);
}

/* "a|b|c" as "'a', 'b' or 'c'" */
static void list_choices(const char *choices, char *to, size_t size)
{
    size_t at = 0;
    to[0] = 0;
    for (const char *p = choices; *p && at < size;) {
        size_t n = strcspn(p, "|");
        const char *before = p == choices ? "" : p[n] ? ", " : " or ";
        at += (size_t)snprintf(to + at, size - at, "%s'%.*s'", before, (int)n, p);
        p += n + (p[n] != 0);
    }
}

static size_t choose(const cli_option *o, const char *value)
{
    size_t number = 0, length = strlen(value);
    for (const char *p = o->value;; number++) {
        size_t n = strcspn(p, "|");
        if (n == length && !memcmp(p, value, n)) return number;
        if (!p[n]) break;
        p += n + 1;
    }
    char all[200];
    list_choices(o->value, all, sizeof all);
    cli_usage("option '--%s' needs %s, not '%s'", o->name, all, value);
}

static void take_option(const cli_option *o, const char *value)
{
    if (o->choice) *o->choice = choose(o, value);
    if (o->flag) {
        *o->flag = true;
    } else if (o->text) {
        *o->text = value;
    } else if (o->number) {
        double x;
        if (!parse_number(value, &x) || !in_range(o, x)) refuse_value(o, "a number", value);
        *o->number = x;
    } else if (o->integer) {
        long x;
        if (!parse_integer(value, &x) || !in_range(o, (double)x)) refuse_value(o, "a whole number", value);
        *o->integer = x;
    } else if (o->take) {
        o->take(value, o->context);
    }
}

enum { LONG_BASE = 256 }; /* getopt's value of option i is LONG_BASE + i, whether it has a letter or not */

static const cli_option *find_option(const cli_option *const *all, size_t n, int value)
{
    if (value >= LONG_BASE) return (size_t)(value - LONG_BASE) < n ? all[value - LONG_BASE] : NULL;
    for (size_t i = 0; i < n; i++)
        if (value && all[i]->letter == value) return all[i];
    return NULL;
}

/* The least number of letters to insert, drop, replace or swap with a neighbour that makes `text` of `name`. */
static size_t edit_distance(const char *text, size_t n, const char *name)
{
    enum { MOST = 32 };
    size_t row[MOST + 1], last[MOST + 1] = {0}, before[MOST + 1], k = strlen(name);
    if (n > MOST || k > MOST) return SIZE_MAX;
    for (size_t j = 0; j <= k; j++) row[j] = j;
    for (size_t i = 1; i <= n; i++) {
        memcpy(before, last, sizeof before);
        memcpy(last, row, sizeof last);
        row[0] = i;
        for (size_t j = 1; j <= k; j++) {
            size_t best = last[j - 1] + (text[i - 1] != name[j - 1]);
            if (last[j] + 1 < best) best = last[j] + 1;
            if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
            bool swapped = i > 1 && j > 1 && text[i - 1] == name[j - 2] && text[i - 2] == name[j - 1];
            if (swapped && before[j - 2] + 1 < best) best = before[j - 2] + 1;
            row[j] = best;
        }
    }
    return row[k];
}

/* The option that was meant, most likely: the nearest, unless a third of it or more would be wrong. */
static const cli_option *likely_option(const cli_option *const *all, size_t n, const char *text, size_t length)
{
    const cli_option *likely = NULL;
    size_t least = length / 3 + 1;
    for (size_t i = 0; i < n; i++) {
        size_t d = edit_distance(text, length, all[i]->name);
        if (d < least) least = d, likely = all[i];
    }
    return likely;
}

/* What getopt did not like, in our words. */
static void refuse_option(const cli_option *const *all, size_t n, int problem, char **argv) __attribute__((noreturn));
static void refuse_option(const cli_option *const *all, size_t n, int problem, char **argv)
{
    const cli_option *o = find_option(all, n, optopt);
    if (problem == ':' && o) cli_usage("option '--%s' needs a value: %s", o->name, o->value);
    if (o) cli_usage("option '--%s' takes no value", o->name);
    if (optopt) cli_usage("unknown option '-%c': '%s --help' lists them", optopt, cli.program->name);
    const char *text = argv[optind - 1];
    int length = (int)strcspn(text, "=");
    const cli_option *first = NULL, *second = NULL;
    for (size_t i = 0; i < n; i++)
        if (length > 2 && !strncmp(all[i]->name, text + 2, (size_t)length - 2)) *(first ? &second : &first) = all[i];
    if (second)
        cli_usage("ambiguous option '%.*s': it could be '--%s' or '--%s'", length, text, first->name, second->name);
    if (length > 2 && (o = likely_option(all, n, text + 2, (size_t)length - 2)))
        cli_usage("unknown option '%.*s': did you mean '--%s'?", length, text, o->name);
    cli_usage("unknown option '%.*s': '%s --help' lists them", length, text, cli.program->name);
}

/* Operands are collected in order, options may stand between them; what follows "--" are operands. */
static size_t parse(const cli_option *const *all, size_t n, int argc, char **argv, char **operands)
{
    struct option longs[MOST_OPTIONS + 1] = {{0}};
    char letters[2 * MOST_OPTIONS + 4] = "-:";
    size_t at = strlen(letters), count = 0;
    for (size_t i = 0; i < n; i++) {
        int takes = all[i]->value ? required_argument : no_argument;
        longs[i] = (struct option){all[i]->name, takes, NULL, LONG_BASE + (int)i};
        if (all[i]->letter) letters[at++] = all[i]->letter;
        if (all[i]->letter && all[i]->value) letters[at++] = ':';
    }
    letters[at] = 0;
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, letters, longs, NULL)) != -1;) {
        if (c == 1)
            operands[count++] = optarg;
        else if (c == '?' || c == ':')
            refuse_option(all, n, c, argv);
        else
            take_option(find_option(all, n, c), optarg);
        if (want_help || want_version) return 0;
    }
    while (optind < argc) operands[count++] = argv[optind++];
    return count;
}

/* A descriptor that was closed by the parent would be taken by the next file we open, and be written over. It is
 * opened the wrong way round, so that using it fails instead of losing output in silence. */
static void repair_descriptors(void)
{
    for (int fd = 0; fd <= 2; fd++)
        if (fcntl(fd, F_GETFD) < 0 && errno == EBADF && open("/dev/null", fd ? O_RDONLY : O_WRONLY) != fd) _exit(4);
}

static void widen_pipe(int fd)
{
    struct stat st;
    if (fstat(fd, &st) || !S_ISFIFO(st.st_mode)) return;
    int now = fcntl(fd, F_GETPIPE_SZ);
    if (now >= 0 && now < PIPE_BYTES && fcntl(fd, F_SETPIPE_SZ, PIPE_BYTES) < 0) return; /* as it was: only slower */
}

size_t cli_start(const cli_program *p, int argc, char **argv, char ***operands)
{
    const cli_option *all[MOST_OPTIONS];
    started = seconds();
    cli.program = p, cli.argc = argc, cli.argv = argv;
    repair_descriptors();
    if (atexit(library_gave_up)) cli_stop(VG_ENOMEM, "not enough memory to start");
    signal(SIGPIPE, SIG_DFL); /* a parent may have ignored it */
    signal(SIGXFSZ, SIG_IGN); /* a file size limit is a failed write, with a message */
    size_t nall = gather_options(p, all);
    *operands = calloc((size_t)argc + 1, sizeof **operands);
    if (!*operands) cli_stop(VG_ENOMEM, "not enough memory for %d operands", argc);
    size_t n = parse(all, nall, argc, argv, *operands);
    if (want_help) print_help(p, all, nall);
    if (want_version && !want_help) printf("%s (vg) %s\nstream 1.0\n", p->name, VG_VERSION);
    if (want_help || want_version) cli_finish(0);
    if (n > p->most_operands) {
        if (p->most_operands == 0) cli_usage("%s takes no operands, but got '%s'", p->name, (*operands)[0]);
        cli_usage("one operand too many: '%s'", (*operands)[p->most_operands]);
    }
    cli.threads = threads_asked ? (int)threads_asked : processors_count(MOST_THREADS);
    if (cli.output && !strcmp(cli.output, "-")) cli.output = NULL;
    if (p->writes_stream || p->writes_text || p->writes_file) check_output(p->writes_stream);
    widen_pipe(STDIN_FILENO);
    widen_pipe(STDOUT_FILENO);
    return n;
}

/* An option's name, whether it was given with its dashes or without. */
static const char *bare(const char *option)
{
    return option + strspn(option, "-");
}

double cli_parse_number(const char *option, const char *text)
{
    double x;
    if (!parse_number(text, &x)) cli_usage("option '--%s' needs a number, not '%s'", bare(option), text);
    return x;
}

uint64_t cli_parse_size(const char *option, const char *text)
{
    static const char units[] = "KMGT";
    char *end;
    errno = 0;
    unsigned long long x = strtoull(text, &end, 10);
    const char *unit = *end ? strchr(units, *end & ~0x20) : NULL;
    if (errno || *text < '0' || *text > '9' || (*end && (!unit || end[1])))
        cli_usage("option '--%s' needs a size such as 64M or 2G, not '%s'", bare(option), text);
    for (const char *u = units; unit && u <= unit; u++)
        if (__builtin_mul_overflow(x, 1024, &x)) return UINT64_MAX;
    return x;
}

static int compare_vertices(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

size_t cli_parse_vertices(const char *option, const char *text, uint32_t **vertices)
{
    size_t n = 0, unique = 0;
    *vertices = calloc(strlen(text) / 2 + 1, sizeof **vertices);
    if (!*vertices) cli_stop(VG_ENOMEM, "not enough memory for the vertices of option '--%s'", bare(option));
    for (const char *p = text;; p++) {
        char *end;
        errno = 0;
        unsigned long long x = *p >= '0' && *p <= '9' ? strtoull(p, &end, 10) : ULLONG_MAX;
        if (errno || x >= UINT32_MAX || (*end && *end != ','))
            cli_usage("option '--%s' needs vertex numbers from 0 with commas between, not '%s'", bare(option), text);
        (*vertices)[n++] = (uint32_t)x;
        p = end;
        if (!*p) break;
    }
    qsort(*vertices, n, sizeof **vertices, compare_vertices);
    for (size_t i = 0; i < n; i++)
        if (i == 0 || (*vertices)[i] != (*vertices)[unique - 1]) (*vertices)[unique++] = (*vertices)[i];
    return unique;
}

vg_source *cli_source(char **operands, size_t n)
{
    return cli_source_with(operands, n, NULL);
}

vg_source *cli_source_with(char **operands, size_t n, const vg_source_options *o)
{
    static const char *const standard_input[] = {"-"};
    const char *const *from = n ? (const char *const *)operands : standard_input;
    vg_source *s = NULL;
    vg_err e;
    if (n == 0 && isatty(STDIN_FILENO))
        cli_usage("no input: name a stream, mesh file, archive or directory, or pipe one into %s", cli.program->name);
    if (vg_source_open_with(&s, from, n ? n : 1, o, &e) < 0) cli_die(&e);
    if (vg_source_warning(s)) cli_warn("%s", vg_source_warning(s));
    return upstream = s;
}
