/* fuzz_cli.c: any words as a command line: every one is parsed, or refused with exit status 2 or 4; help and version
 * end with 0. Words are lines of the input; the first chooses the program's shape.
 * Leaves out what the programs themselves make of their words (hostile.bats tries those).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <math.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

/* The programs end by _exit, and speak by write: here both come back. */
static jmp_buf ended;
static int exit_status;
static void fuzz_exit(int status) __attribute__((noreturn));
static void fuzz_exit(int status)
{
    exit_status = status;
    longjmp(ended, 1);
}

static size_t said;
static ssize_t fuzz_write(int fd, const void *data, size_t n)
{
    if (fd != STDERR_FILENO || !data) abort();
    said += n;
    return (ssize_t)n;
}

static int fuzz_close(int fd)
{
    return fd == STDOUT_FILENO ? 0 : close(fd);
}

#define _exit fuzz_exit
#define write fuzz_write
#define close fuzz_close
#define atexit(f) ((void)(f), 0)
#define printf(...) ((void)snprintf(NULL, 0, __VA_ARGS__))
#include "../../cmd/cli.c"
#include "../../cmd/decimal.c"
#include "../../cmd/options.c"
#include "../../cmd/output.c"
#include "../../cmd/processors.c"
#include "../../cmd/progress.c"
#undef _exit
#undef write
#undef close
#undef atexit
#undef printf

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_BYTES = 4096, MOST_WORDS = 64 };

static void demand(bool holds)
{
    if (!holds) abort();
}

static bool flag;
static const char *text;
static double number;
static long integer;
static uint32_t *vertices;
static size_t taken;

static void take(const char *value, void *context)
{
    demand(value && context == &taken);
    taken++;
    free(vertices);
    vertices = NULL;
    size_t n = cli_parse_vertices("--vertices", value, &vertices);
    demand(n > 0);
    for (size_t i = 1; i < n; i++) demand(vertices[i - 1] < vertices[i]);
}

static void take_number(const char *value, void *context)
{
    (void)context;
    demand(isfinite(cli_parse_number("factor", value)));
}

static const cli_option options[] = {
    {"flag", 'f', NULL, "a flag", .flag = &flag},
    {"flat", 0, NULL, "another, so that names can be ambiguous", .flag = &flag, .needs = "flag|count"},
    {"text", 0, "TEXT", "a text", .text = &text, .reads = true},
    {"number", 'n', "X", "a number", .number = &number, .least = -1, .most = 1e9},
    {"large", 0, "X", "a number without an upper end", .number = &number, .least = 1, .most = INFINITY},
    {"count", 'c', "N", "a whole number", .integer = &integer, .least = 1, .most = 100, .excludes = "any"},
    {"any", 0, "N", "any whole number", .integer = &integer},
    {"vertices", 0, "V,V,...", "a list", .take = take, .context = &taken},
    {"factor", 0, "X", "a number by a function", .take = take_number},
    {.name = NULL}};

static const cli_program programs[] = {
    {"vg-fuzz", "[options] [FILE]", "a filter", options, .most_operands = 1, .writes_stream = true, .threaded = true},
    {"vg-fuzz", "[options] FILE FILE", "a report", options, .most_operands = 2, .writes_text = true, .traces = true},
    {"vg-fuzz", "[options] FILE...", "a writer", options, .most_operands = SIZE_MAX, .writes_file = true, .threaded = true},
    {.name = "vg-fuzz", .synopsis = "[options]", .summary = "a thing", .options = options}};

/* The words of the input; words[0] is the program. */
static int split(char *input, size_t size, char *words[MOST_WORDS + 2])
{
    int n = 1;
    words[0] = (char *)"vg-fuzz";
    for (size_t at = 0; at < size && n <= MOST_WORDS;) {
        words[n++] = input + at;
        char *end = memchr(input + at, '\n', size - at);
        if (!end) break;
        *end = 0;
        at = (size_t)(end - input) + 1;
    }
    words[n] = NULL;
    return n;
}

static void reset(void)
{
    memset(&state, 0, sizeof state);
    memset(&out, 0, sizeof out);
    out.fd = -1;
    want_help = want_version = flag = false;
    threads_asked = 0;
    number = 0, integer = 1, text = NULL;
    optind = 0; /* getopt begins anew */
    *input_is_for = 0;
    said = 0;
}

static void check_parsed(const cli_program *p, size_t n, char **operands)
{
    demand(n <= p->most_operands && cli_threads() >= 1 && isfinite(number));
    size_t reads = text && !strcmp(text, "-");
    for (size_t i = 0; i < n; i++) demand(operands[i] != NULL), reads += !strcmp(operands[i], "-");
    demand(reads <= 1 && !(cli_given("count") && cli_given("any")));
    demand(!cli_given("flat") || cli_given("flag") || cli_given("count"));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char input[MOST_BYTES + 1];
    static char **operands; /* longjmp leaves what is static as it is */
    char *words[MOST_WORDS + 2];
    if (size < 1 || size > MOST_BYTES) return 0;
    const cli_program *p = &programs[data[0] % 4];
    memcpy(input, data + 1, size - 1);
    input[size - 1] = 0;
    static int count;
    count = split(input, size - 1, words);
    reset();
    operands = NULL;
    if (!setjmp(ended)) {
        size_t n = cli_start(p, count, words, &operands);
        check_parsed(p, n, operands);
    } else if (exit_status == 0) {
        demand(want_help || want_version);
    } else {
        demand((exit_status == 2 || exit_status == 4) && said > 0);
    }
    free(operands);
    free(vertices);
    vertices = NULL;
    return 0;
}
