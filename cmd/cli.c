/* cli.c: what all programs share: start, messages, exit, input. The only file that prints to standard error.
 * options.c has the command line, output.c the output.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"
#include "options.h"
#include "output.h"
#include "progress.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
    PIPE_BYTES = 1 << 20, /* a pipe of this size carries three to four times what one of 64 KiB does */
    MESSAGE_BYTES = 1024
};

/* Programs exit without the C library's clean-up, which would flush half a report. A coverage build needs it to
 * write its counters. */
void __gcov_dump(void) __attribute__((weak));
static void leave(int status) __attribute__((noreturn));
static void leave(int status)
{
    if (__gcov_dump) __gcov_dump();
    _exit(status);
}

/* ------------------------------------------------------------------------------------------- messages -- */

int cli_by_number(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

bool cli_ends_with(const char *name, const char *suffix)
{
    size_t n = strlen(name), k = strlen(suffix);
    return n > k && !strcasecmp(name + n - k, suffix);
}

double cli_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* C0, DEL, and C1 in UTF-8. */
void cli_strip_controls(char *s)
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
        if (k <= 0) return; /* a failure to write the message cannot be reported */
        text += k, n -= (size_t)k;
    }
}

static void say_line(const char *kind, const char *format, va_list ap)
{
    char body[MESSAGE_BYTES], line[MESSAGE_BYTES + 64];
    vsnprintf(body, sizeof body, format, ap);
    cli_strip_controls(body);
    int n = snprintf(line, sizeof line, "%s: %s%s\n", options_program()->name, kind, body);
    progress_pause();
    if (n > 0) print_error(line, (size_t)n < sizeof line ? (size_t)n : sizeof line - 1);
    progress_go_on();
}

void cli_warn(const char *format, ...)
{
    if (cli_quiet()) return;
    va_list ap;
    va_start(ap, format);
    say_line("warning: ", format, ap);
    va_end(ap);
}

void cli_say(const char *format, ...)
{
    if (cli_quiet()) return;
    va_list ap;
    va_start(ap, format);
    say_line("", format, ap);
    va_end(ap);
}

void cli_note(const char *format, ...)
{
    if (!cli_verbose()) return;
    va_list ap;
    va_start(ap, format);
    say_line("", format, ap);
    va_end(ap);
}

static void say_error(const char *format, ...) VG_PRINTF(1, 2);
static void say_error(const char *format, ...)
{
    va_list ap;
    progress_end();
    va_start(ap, format);
    say_line("", format, ap);
    va_end(ap);
}

/* ---------------------------------------------------------------------------------------- the end -- */

static vg_source *upstream; /* the input of cli_source: it may hold the message of an earlier program that failed */

/* Remove half-written output. All later programs of a pipe name the first one that failed. */
static void give_up(int code, int status, const char *message) __attribute__((noreturn));
static void give_up(int code, int status, const char *message)
{
    const vg_failure *before = code == VG_ETRUNC && upstream ? vg_source_failure(upstream) : NULL;
    if (before) output_abandon(before->program, (int)before->status, before->message);
    else output_abandon(options_program()->name, status, message);
    leave(status);
}

void cli_die(const vg_err *e)
{
    int status = vg_exit_status(e->code);
    if (status < 2) status = 4;
    output_remove();
    say_error("%s", e->message);
    give_up(e->code, status, e->message);
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

void cli_no(const char *format, ...)
{
    char text[MESSAGE_BYTES];
    va_list ap;
    va_start(ap, format);
    vsnprintf(text, sizeof text, format, ap);
    va_end(ap);
    cli_strip_controls(text);
    output_remove();
    say_error("%s", text);
    give_up(VG_OK, 1, text);
}

void cli_usage(const char *format, ...)
{
    char text[MESSAGE_BYTES], usage[512];
    va_list ap;
    va_start(ap, format);
    vsnprintf(text, sizeof text, format, ap);
    va_end(ap);
    cli_strip_controls(text);
    output_remove();
    say_error("%s", text);
    int n = snprintf(usage, sizeof usage, "usage: %s %s\n", options_program()->name, options_program()->synopsis);
    if (n > 0) print_error(usage, (size_t)n < sizeof usage ? (size_t)n : sizeof usage - 1);
    give_up(VG_EARG, 2, text);
}

void cli_finish(int status)
{
    progress_end();
    output_remove(); /* the temporary file of an unfinished output */
    output_flush();
    leave(status);
}

/* Programs exit by leave(). Only a library that gives up calls exit(), as libarchive does without memory; its
 * status would be wrong, and half a file would remain. */
static void library_gave_up(void)
{
    output_discard();
    cli_stop(VG_ENOMEM, "a library failed, probably for lack of memory");
}

/* ---------------------------------------------------------------------------------------------- memory -- */

void *cli_allocate(size_t n, size_t size, const char *what)
{
    void *p = calloc(n + 1, size);
    if (!p) cli_stop(VG_ENOMEM, "not enough memory for %s", what);
    return p;
}

FILE *cli_line_open(cli_line *line, const char *what)
{
    *line = (cli_line){.what = what};
    if (!(line->f = open_memstream(&line->text, &line->size))) cli_stop(VG_ENOMEM, "not enough memory for %s", what);
    return line->f;
}

char *cli_line_close(cli_line *line)
{
    bool lost = ferror(line->f) != 0;
    if (fclose(line->f) || lost || !line->text) /* glibc may close well and have no text */
        cli_stop(VG_ENOMEM, "not enough memory for %s", line->what);
    return line->text;
}

void *cli_resize(void *p, size_t n, size_t size, const char *what)
{
    p = reallocarray(p, n ? n : 1, size);
    if (!p) cli_stop(VG_ENOMEM, "not enough memory for %s", what);
    return p;
}

char *cli_copy_text(const char *text, const char *what)
{
    char *copy = strdup(text);
    if (!copy) cli_stop(VG_ENOMEM, "not enough memory for %s", what);
    return copy;
}

/* no file was read before */

/* If the parent closed a standard descriptor, the next open would take its number, and output would overwrite that
 * file. Open it with the opposite access mode, so that using it fails. */
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
    if (now >= 0 && now < PIPE_BYTES && fcntl(fd, F_SETPIPE_SZ, PIPE_BYTES) < 0) return; /* else only slower */
}

/* VG_ISA: the instruction set of the kernels. */
static void choose_kernels(void)
{
    vg_err e;
    const char *name = getenv("VG_ISA");
    if (name && *name && vg_isa_choose(name, &e) < 0) cli_stop(VG_EARG, "VG_ISA: %s", e.message);
}

size_t cli_start(const cli_program *p, int argc, char **argv, char ***operands)
{
    progress_start();
    options_start(p, argc, argv);
    repair_descriptors();
    if (atexit(library_gave_up)) cli_stop(VG_ENOMEM, "not enough memory to start");
    signal(SIGPIPE, SIG_DFL); /* the parent may have ignored SIGPIPE */
    signal(SIGXFSZ, SIG_IGN); /* exceeding a file size limit becomes a failed write with a message */
    choose_kernels();
    *operands = cli_allocate((size_t)argc, sizeof **operands, "the operands");
    size_t n = options_parse(*operands);
    for (size_t i = 0; i < n; i++) cli_claim_input(NULL, (*operands)[i]);
    if (p->writes_stream || p->writes_text || p->writes_file) output_check(p->writes_stream);
    widen_pipe(STDIN_FILENO);
    widen_pipe(STDOUT_FILENO);
    return n;
}

/* ----------------------------------------------------------------------------------------------- input -- */

static char input_is_for[64]; /* the option or operand that reads standard input; empty: none yet */

void cli_claim_input(const char *option, const char *operand)
{
    char what[sizeof input_is_for];
    if (strcmp(operand, "-")) return;
    snprintf(what, sizeof what, "%s%s", option ? "--" : "", option ? option : "the input");
    if (!strcmp(input_is_for, what)) cli_usage("standard input can be read only once, not for two operands");
    if (*input_is_for) cli_usage("standard input can be read only once, not for %s and %s", input_is_for, what);
    memcpy(input_is_for, what, sizeof what);
}

void cli_expect_input(size_t operands)
{
    static bool expected;
    if (operands || expected) return;
    expected = true;
    cli_claim_input(NULL, "-");
    if (isatty(STDIN_FILENO))
        cli_usage("no input: name a stream, mesh file, archive or directory, or pipe one into %s", options_program()->name);
}

vg_source *cli_source(char **operands, size_t n)
{
    return cli_source_with(operands, n, NULL);
}

vg_source *cli_source_with(char **operands, size_t n, const vg_source_options *o)
{
    static const char *const standard_input[] = {"-"};
    const char *const *from = n ? (const char *const *)operands : standard_input;
    vg_source_options options = o ? *o : (vg_source_options){0};
    vg_source *s = NULL;
    vg_err e;
    options.threads = cli_threads();
    cli_expect_input(n);
    if (vg_source_open_with(&s, from, n ? n : 1, &options, &e) < 0) cli_die(&e);
    if (vg_source_warning(s)) cli_warn("%s", vg_source_warning(s));
    const vg_head *h = vg_source_head(s);
    if (h->kind == VG_OTHER && !options_program()->any_form)
        cli_stop(VG_EINPUT, "the input holds '%s', a form of frames that this program does not know", vg_head_form(h));
    return upstream = s;
}

void cli_load(vg_head *h, const char *operand, const char *what)
{
    vg_note note;
    vg_err e;
    if (vg_load_with(h, operand, what, NULL, &note, &e) < 0) cli_die(&e);
    if (*note.text) cli_warn("%s", note.text);
}

bool cli_next(vg_source *s, vg_frame *f)
{
    vg_err e;
    if (vg_source_may_wait(s)) output_hand_on();
    int r = vg_source_next(s, f, &e);
    if (r < 0) cli_die(&e);
    return r > 0;
}

void cli_need_vertices(const vg_head *h, const char *subject)
{
    static const char *const advice[] = {
        [VG_VECTORS] = "pipe it through 'vg-solve' first",
        [VG_DEFORMATIONS] = "apply them with 'vg-deform --onto MESH' and pipe that through 'vg-solve' first",
        [VG_TRANSFORMS] = "convert them to vertices with 'vg-play MAP' first"};
    if (h->kind == VG_VERTICES) return;
    bool known = h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS || h->kind == VG_TRANSFORMS;
    cli_stop(VG_EINPUT, "%s holds %s: %s", subject, vg_head_form(h),
             known ? advice[h->kind] : "vertices are needed here");
}

enum { MOST_TEXT = 256 << 20 };

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
        if (*n > MOST_TEXT) cli_stop(VG_EINPUT, "'%s' holds more than %d MiB, too much for a text of this kind", path, MOST_TEXT >> 20);
    }
    if (!f || ferror(f)) cli_stop(VG_ESYS, "cannot read '%s': %s", path, strerror(errno ? errno : EIO));
    if (f != stdin) fclose(f);
    data[*n] = 0; /* the last read found the end of the input */
    return data;
}
