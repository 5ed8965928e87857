/* cli.h: what all programs share: options (options.c), output (output.c), messages, input, exit (cli.c). cli.c is the
 * only file that prints to standard error.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CLI_H
#define VG_CLI_H

#include "vg.h"

#include <stdio.h>

/* One option of a program. Every program also has -h --help, -V --version, -q --quiet, -v --verbose and what its
 * cli_program asks for; those are not listed. */
typedef struct cli_option {
    const char *name;  /* long name, without the dashes */
    char letter;       /* 0: none */
    const char *value; /* what -h calls the argument ("FILE"); NULL: a flag */
    const char *help;  /* one line for -h */
    size_t *choice;    /* not NULL: value is "a|b|c", nothing else is taken, and its number from 0 is put here */
    /* what parsing does besides, the first that is not NULL: */
    bool *flag;
    const char **text;
    const char **second; /* beside text: the option takes two words, and this is the other */
    double *number;
    long *integer;
    void (*take)(const char *value, void *context); /* repeated or structured options; dies by cli_usage */
    void *context;
    double least, most; /* for number and integer; both 0: any */
    bool reads;         /* text, and second, are names of inputs: "-" is standard input */
    const char *needs;  /* "a|b": one of these options must be there, too; NULL: none */
    const char *excludes; /* "a|b": none of these may be; said of one option of a pair */
} cli_option;

/* An option that has gone to another program: what `--name` "is now ...", for the message. */
typedef struct cli_moved {
    const char *name, *now;
} cli_moved;

typedef struct cli_program {
    const char *name;     /* "vg-solve" */
    const char *synopsis; /* "[options] [FILE]": what follows the name */
    const char *summary;  /* one line: what it does */
    const cli_option *options; /* ends with a NULL name */
    const cli_moved *moved;    /* ends with a NULL name; NULL: none have moved */
    size_t most_operands;
    bool writes_stream;   /* has -o --output and --no-provenance */
    bool writes_vectors;  /* the stream is for vg-solve */
    bool writes_map;      /* the stream holds a map and no frames: it is for vg-play */
    bool writes_text;     /* has -o --output and --json */
    bool writes_file;     /* has -o --output, whose bytes go through cli_text_open too */
    bool traces;          /* has --no-provenance also if its output is no stream: another one is */
    bool threaded;        /* has -j --threads */
    bool any_form;        /* takes frames whose form nobody knows: it does not look into their values */
} cli_program;

/* What the shared options said. */
extern struct cli_state {
    const cli_program *program;
    int argc; /* as the program was called, for provenance */
    char **argv;
    bool quiet, verbose, json, no_provenance;
    const char *output; /* NULL: standard output */
    int threads;        /* >= 1 */
} cli;

/* cli_start: to be called first. Parses; -h and -V print and exit 0; wrong usage prints the synopsis and exits 2.
 * Returns the number of operands and where they are. Repairs descriptors 0 to 2, resets SIGPIPE. */
size_t cli_start(const cli_program *p, int argc, char **argv, char ***operands);

/* cli_given: was this option on the command line? */
bool cli_given(const char *name);
/* cli_claim_input: the operand is going to be read, for an option (NULL: as the input). If it is standard input, and
 * that is to be read for something else, too, this is wrong usage. Operands and options that say `reads` are claimed
 * by cli_start. */
void cli_claim_input(const char *option, const char *operand);
/* cli_expect_input: with no operands, standard input is the input; wrong usage when it is a terminal. cli_source does
 * it; before it, programs that read something else first. */
void cli_expect_input(size_t operands);

/* cli_die: one line "PROGRAM: MESSAGE" on standard error, leave nothing half-written, exit by the code. If a stream
 * is being written, it says in a FAIL record who failed. */
void cli_die(const vg_err *e) __attribute__((noreturn));
/* cli_stop: the same of a message of its own. */
void cli_stop(int code, const char *format, ...) VG_PRINTF(2, 3) __attribute__((noreturn));
/* cli_allocate: n zeroed elements, and room for one more; stops when there is no memory for what it is for. */
void *cli_allocate(size_t n, size_t size, const char *what);
/* cli_resize: n elements of which those that were there stay, as realloc; stops like cli_allocate. */
void *cli_resize(void *p, size_t n, size_t size, const char *what);
/* cli_copy_text: free(); stops like cli_allocate. */
char *cli_copy_text(const char *text, const char *what);
/* cli_usage: the same with exit 2 and the usage line. */
void cli_usage(const char *format, ...) VG_PRINTF(1, 2) __attribute__((noreturn));
/* cli_no: the same with exit 1: the answer is no. */
void cli_no(const char *format, ...) VG_PRINTF(1, 2) __attribute__((noreturn));
void cli_warn(const char *format, ...) VG_PRINTF(1, 2); /* unless --quiet */
void cli_note(const char *format, ...) VG_PRINTF(1, 2); /* only with --verbose */
/* what the user waits for on standard error; unless --quiet */
void cli_say(const char *format, ...) VG_PRINTF(1, 2);
/* cli_strip_controls: what a terminal would obey rather than show becomes '?'. Names come from files. */
void cli_strip_controls(char *s);
/* cli_progress: "label n" on standard error, rarely, only when it is a terminal, a second has passed, and no other program
 * of the pipe is slower; with --progress json as a line of JSON. label: what is counted, a text that stays. */
void cli_progress(const char *label, uint64_t n);
/* cli_progress_of: the same with a known total, 0: it is not known, and the time left. */
void cli_progress_of(const char *label, uint64_t n, uint64_t total);

/* cli_parse_number: the whole text as a finite number, or cli_usage naming the option. */
double cli_parse_number(const char *option, const char *text);
/* cli_parse_numbers: "1,2.5,-3" to at most `most` numbers; how many, 0: it is something else. */
size_t cli_parse_numbers(const char *text, double *x, size_t most);
/* cli_parse_size: "4096", "64K", "2G" to bytes, UINT64_MAX when that is more, or cli_usage naming the option. */
uint64_t cli_parse_size(const char *option, const char *text);
/* cli_parse_vertices: "3,17,4" to an ascending list without repetition (free with free()), or cli_usage. */
size_t cli_parse_vertices(const char *option, const char *text, uint32_t **vertices);

/* The input of a filter: its operands, or standard input when there are none. To be closed when nothing is left to be
 * read: what cli_die says of a program before this one comes from it. */
vg_source *cli_source(char **operands, size_t n);
/* The same, with options (may be NULL), of which `threads` is set here. */
vg_source *cli_source_with(char **operands, size_t n, const vg_source_options *o);

/* cli_next: the next frame; false at the end. Damage ends the program. */
bool cli_next(vg_source *s, vg_frame *f);
/* cli_need_vertices: end the program unless the frames are vertices, and say what makes them so. subject: what the
 * message calls the sequence ("the input", "'a.vgs'"). */
void cli_need_vertices(const vg_head *h, const char *subject);

/* cli_read_file: a whole file ("-": standard input), with a 0 behind it; free(). Dies when it cannot be read. */
char *cli_read_file(const char *path, size_t *n);

/* The stream of a filter. cli_stream_open takes the head (adds this process to the provenance unless told not to) and
 * opens the output: standard output, refused when a terminal,
 * or a temporary file beside --output that cli_stream_end renames. */
void cli_stream_open(vg_head *h);
void cli_stream_put(const vg_frame *f);
void cli_stream_end(const vg_records *tail);

/* cli_discard_by: `discard` removes what the program writes by other means than these. Called when the program fails, or
 * is ended by a signal or by a library that gives up: it may call only what a signal handler may. */
void cli_discard_by(void (*discard)(void));

/* The text output of a report: standard output or a temporary file beside --output, which cli_text_end renames. */
FILE *cli_text_open(void);
void cli_text_end(void);

/* cli_same_output: would what is written to these two names be one file? */
bool cli_same_output(const char *a, const char *b);
/* cli_redirect: what is opened next goes to `file` ("-" or NULL: standard output), which is looked at now. For a
 * program that writes a stream and a report, one after the other. */
void cli_redirect(const char *file, bool stream);

/* cli_finish: flush, close, check standard output; exit with `status` (0 or 1), or 4 when output was lost. */
void cli_finish(int status) __attribute__((noreturn));

#endif
