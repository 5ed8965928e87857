/* cli.h: what all programs share: options (options.c), output (output.c), messages, input, exit (cli.c). cli.c is the
 * only file that prints to standard error.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CLI_H
#define VG_CLI_H

#include "vg.h"

#include <stdio.h>

/* One option of a program. All programs also have -h --help, -V --version, -q --quiet, -v --verbose and those that
 * their cli_program asks for, which are not listed here. */
typedef struct cli_option {
    const char *name;  /* long name, without the dashes */
    char letter;       /* 0: none */
    const char *value; /* the name of the argument in -h ("FILE"); NULL: a flag */
    const char *help;  /* one line for -h */
    size_t *choice;    /* not NULL: value is "a|b|c", any other argument is refused, and its index is stored here */
    /* what parsing does; the first that is not NULL: */
    bool *flag;
    const char **text;
    const char **second; /* with text: the option takes two words, and this is the second */
    double *number;
    long *integer;
    void (*take)(const char *value, void *context); /* repeated or structured options; fails by cli_usage */
    void *context;
    double least, most; /* for number and integer; both 0: any */
    bool reads;         /* text and second name inputs: "-" is standard input */
    const char *needs;  /* "a|b": one of these options must be given, too; NULL: none */
    const char *excludes; /* "a|b": none of these may be given; stated for one option of a pair */
} cli_option;

/* An option that moved to another program: the rest of the message "`--name` is now ...". */
typedef struct cli_moved {
    const char *name, *now;
} cli_moved;

typedef struct cli_program {
    const char *name;     /* "vg-solve" */
    const char *synopsis; /* "[options] [FILE]": the text after the name */
    const char *summary;  /* one-line description */
    const cli_option *options; /* ends with a NULL name */
    const cli_moved *moved;    /* ends with a NULL name; NULL: none have moved */
    size_t most_operands;
    bool writes_stream;   /* has -o --output and --no-provenance */
    bool writes_vectors;  /* the stream is for vg-solve */
    const size_t *vectors_if; /* ... or it is if this choice is not the first one; NULL: there is no such option */
    bool writes_map;      /* the stream holds a map and no frames: it is for vg-play */
    bool writes_text;     /* has -o --output and --json */
    bool reports_json;    /* has --json, for a report beside its output */
    bool writes_file;     /* has -o --output, written through cli_text_open */
    bool traces;          /* has --no-provenance, because it writes another stream */
    bool threaded;        /* has -j --threads */
    bool any_form;        /* accepts frames of unknown form, because it does not use their values */
} cli_program;

/* The values of the options that programs share, once cli_start has parsed them. */
const char *cli_output(void); /* NULL: standard output */
int cli_threads(void);        /* >= 1 */
bool cli_quiet(void);
bool cli_verbose(void);
bool cli_json(void);
/* cli_be_quiet: as if --quiet were given: of several processes of one job only the first speaks. */
void cli_be_quiet(void);

/* cli_start: call this first. Parses the command line; -h and -V print and exit 0; wrong usage prints the synopsis
 * and exits 2. Returns the number of operands and sets *operands. Repairs descriptors 0 to 2 and resets SIGPIPE. */
size_t cli_start(const cli_program *p, int argc, char **argv, char ***operands);

/* cli_given: is the option on the command line? */
bool cli_given(const char *name);
/* cli_likely: which of n names is the most similar to the first `length` bytes of text; n when a third or more of the letters
 * differ. For "did you mean". */
size_t cli_likely(const char *text, size_t length, size_t n, const char *(*name)(const void *names, size_t i), const void *names);
/* cli_claim_input: declare that `operand` will be read, for an option (NULL: as the input). It is wrong usage if
 * standard input would be read twice. cli_start claims the operands and the options that say `reads`. */
void cli_claim_input(const char *option, const char *operand);
/* cli_expect_input: without operands, standard input is the input; wrong usage if it is a terminal. cli_source
 * calls this; programs that read something else first call it before. */
void cli_expect_input(size_t operands);

/* cli_die: print "PROGRAM: MESSAGE" on standard error, remove half-written output, and exit with the status of the
 * code. An open output stream gets a FAIL record that names this program. */
void cli_die(const vg_err *e) __attribute__((noreturn));
/* cli_stop: the same with a message of the program's own. */
void cli_stop(int code, const char *format, ...) VG_PRINTF(2, 3) __attribute__((noreturn));
/* cli_allocate: n zeroed elements, and room for one more. Without memory it stops with a message that names
 * `what`. */
void *cli_allocate(size_t n, size_t size, const char *what);
/* cli_resize: realloc to n elements; stops like cli_allocate. */
void *cli_resize(void *p, size_t n, size_t size, const char *what);
/* cli_copy_text: free(); stops like cli_allocate. */
char *cli_copy_text(const char *text, const char *what);
/* cli_usage: the same with status 2 and the usage line. */
void cli_usage(const char *format, ...) VG_PRINTF(1, 2) __attribute__((noreturn));
/* cli_no: the same with status 1: the answer is negative. */
void cli_no(const char *format, ...) VG_PRINTF(1, 2) __attribute__((noreturn));
void cli_warn(const char *format, ...) VG_PRINTF(1, 2); /* unless --quiet */
void cli_note(const char *format, ...) VG_PRINTF(1, 2); /* only with --verbose */
/* a result that the user asked for, on standard error; unless --quiet */
void cli_say(const char *format, ...) VG_PRINTF(1, 2);
/* cli_line_open: a stream that collects a text; cli_line_close returns it, and the caller frees it. Both stop like
 * cli_allocate. */
typedef struct cli_line {
    FILE *f;
    char *text;
    size_t size;
    const char *what;
} cli_line;
FILE *cli_line_open(cli_line *line, const char *what);
char *cli_line_close(cli_line *line);
/* cli_by_number: for qsort: uint32_t in ascending order. */
int cli_by_number(const void *a, const void *b);
/* cli_ends_with: compare the end of a name with a suffix; case does not matter. */
bool cli_ends_with(const char *name, const char *suffix);
/* cli_seconds: since some moment in the past. */
double cli_seconds(void);
/* cli_strip_controls: replace control characters by '?', because names from files may contain terminal escapes. */
void cli_strip_controls(char *s);
/* cli_progress: show "label n" on standard error, if it is a terminal, a second has passed, and no other program
 * of the pipe is slower; with --progress json as a line of JSON. label names what is counted; it is borrowed for
 * the rest of the run. */
void cli_progress(const char *label, uint64_t n);
/* cli_progress_of: the same with a total (0: not known) and the time left. */
void cli_progress_of(const char *label, uint64_t n, uint64_t total);
/* cli_progress_detail: what the next line of cli_progress_of on a terminal ends with, such as ", loss 0.02". */
void cli_progress_detail(const char *format, ...) VG_PRINTF(1, 2);
/* cli_working: show "doing, 12 s" in the same way until the next call of these functions, for work that does not say how
 * far it is. doing is borrowed for the rest of the run. */
void cli_working(const char *doing);

/* cli_scan_number: the finite decimal number that the text begins with; returns what follows it, or NULL. */
const char *cli_scan_number(const char *text, double *x);
/* cli_parse_number: parse the whole text as a finite number; else cli_usage with the name of the option. */
double cli_parse_number(const char *option, const char *text);
/* cli_parse_numbers: parse "1,2.5,-3" to at most `most` numbers. Returns the number of them, 0 if the text is
 * anything else. */
size_t cli_parse_numbers(const char *text, double *x, size_t most);
/* cli_parse_size: parse "4096", "64K" or "2G" to bytes, UINT64_MAX if it is larger; else cli_usage with the name
 * of the option. */
uint64_t cli_parse_size(const char *option, const char *text);
/* cli_parse_vertices: parse "3,17,4" to an ascending list without duplicates (caller frees it); else cli_usage. */
size_t cli_parse_vertices(const char *option, const char *text, uint32_t **vertices);

/* The input of a filter: its operands, or standard input without operands. Close it only after the last read,
 * because cli_die takes the message of an earlier program from it. */
vg_source *cli_source(char **operands, size_t n);
/* The same with options (may be NULL); `threads` is set here. */
vg_source *cli_source_with(char **operands, size_t n, const vg_source_options *o);

/* cli_next: the next frame; false at the end. Damage ends the program. */
bool cli_next(vg_source *s, vg_frame *f);
/* cli_load: vg_load; reports what was ignored in the mesh, and stops on failure. */
void cli_load(vg_head *h, const char *operand, const char *what);
/* cli_need_vertices: stop unless the frames are vertices, with a message that names the program to use first.
 * Messages call the sequence `subject` ("the input", "'a.vgs'"). */
void cli_need_vertices(const vg_head *h, const char *subject);

/* cli_read_file: a whole file ("-": standard input), terminated by 0; caller frees it. Stops if it cannot be read, or
 * holds more than 256 MiB (it may have no end). */
char *cli_read_file(const char *path, size_t *n);

/* The output stream of a filter. cli_stream_open takes the head, adds this process to the provenance (unless
 * --no-provenance), and opens the output: standard output, which must not be a terminal, or a temporary file that
 * cli_stream_end renames to --output. */
void cli_stream_open(vg_head *h);
void cli_stream_put(const vg_frame *f);
void cli_stream_end(const vg_records *tail);

/* cli_discard_by: `discard` removes other output of the program. It is called when the program fails, and by a
 * signal handler, so it may call only async-signal-safe functions. */
void cli_discard_by(void (*discard)(void));

/* The text output of a report: standard output, or a temporary file that cli_text_end renames to --output. */
FILE *cli_text_open(void);
void cli_text_end(void);

/* cli_same_output: would these two names be written to one file? */
bool cli_same_output(const char *a, const char *b);
/* cli_redirect: the next output goes to `file` ("-" or NULL: standard output), which is checked now. For a program
 * that writes a stream and then a report. */
void cli_redirect(const char *file, bool stream);

/* cli_finish: flush, close and check standard output; exit with `status` (0 or 1), or 4 if output was lost. */
void cli_finish(int status) __attribute__((noreturn));

#endif
