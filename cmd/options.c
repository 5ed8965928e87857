/* options.c: the command line: options, operands and -h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "options.h"
#include "processors.h"
#include "progress.h"

#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_OPTIONS = 64, MOST_THREADS = 256, HELP_COLUMN = 32 };

static options_state state;
static bool want_help, want_version;
static long threads_asked;

/* The shared options, and which programs have them. */
typedef enum shared_use { ALL, OUTPUT, JSON, STREAM, THREADS } shared_use;
static const struct shared {
    shared_use use;
    cli_option option;
} shared_options[] = {
    {OUTPUT, {.name = "output", .letter = 'o', .value = "FILE", .help = "write to FILE instead of standard output",
              .text = &state.output}},
    {JSON, {.name = "json", .help = "print JSON", .flag = &state.json}},
    {STREAM, {.name = "no-provenance", .help = "do not record this command line in the stream",
              .flag = &state.no_provenance}},
    {THREADS, {.name = "threads", .letter = 'j', .value = "N", .help = "use N threads (default: all processors)",
               .integer = &threads_asked, .least = 1, .most = MOST_THREADS}},
    {ALL, {.name = "quiet", .letter = 'q', .help = "no warnings and no progress", .flag = &state.quiet}},
    {ALL, {.name = "verbose", .letter = 'v', .help = "report more on standard error", .flag = &state.verbose}},
    {ALL, {.name = "help", .letter = 'h', .help = "print this help", .flag = &want_help}},
    {ALL, {.name = "version", .letter = 'V', .help = "print the version", .flag = &want_version}},
};

static bool applies(const cli_program *p, shared_use use)
{
    switch (use) {
    case OUTPUT: return p->writes_stream || p->writes_text || p->writes_file;
    case JSON: return p->writes_text || p->reports_json;
    case STREAM: return p->writes_stream || p->traces;
    case THREADS: return p->threaded;
    default: return true;
    }
}

/* For scripts and other programs, so -h only mentions it: vg(7) describes it. */
static const cli_option progress_option = {
    .name = "progress", .value = "json[:FD]", .help = "", .take = progress_take};

/* All options of the program, its own first, and whether each was given. */
static struct {
    size_t n;
    const cli_option *at[MOST_OPTIONS];
    bool given[MOST_OPTIONS];
} known;

static void gather_options(const cli_program *p)
{
    known.n = 0;
    for (const cli_option *o = p->options; o && o->name && known.n < MOST_OPTIONS; o++) known.at[known.n++] = o;
    for (size_t i = 0; i < sizeof shared_options / sizeof *shared_options && known.n < MOST_OPTIONS; i++)
        if (applies(p, shared_options[i].use)) known.at[known.n++] = &shared_options[i].option;
    if (known.n < MOST_OPTIONS) known.at[known.n++] = &progress_option;
    memset(known.given, 0, sizeof known.given);
}

static bool is_given(const char *name, size_t n)
{
    for (size_t i = 0; i < known.n; i++)
        if (known.given[i] && strlen(known.at[i]->name) == n && !memcmp(known.at[i]->name, name, n)) return true;
    return false;
}

bool cli_given(const char *name)
{
    return is_given(name, strlen(name));
}

static int option_text(const cli_option *o, char *to, size_t n)
{
    char letter[8] = "    ";
    if (o->letter) snprintf(letter, sizeof letter, "-%c, ", o->letter);
    return snprintf(to, n, "  %s--%s%s%s", letter, o->name, o->value ? " " : "", o->value ? o->value : "");
}

/* The help of an option too long for its column goes on the next line. */
static void print_help(const cli_program *p)
{
    char text[128];
    int width = 0;
    for (size_t i = 0; i < known.n; i++) {
        if (known.at[i] == &progress_option) continue;
        int w = option_text(known.at[i], text, sizeof text);
        if (w > width && w <= HELP_COLUMN) width = w;
    }
    printf("usage: %s %s\n%s\n\n", p->name, p->synopsis, p->summary);
    for (size_t i = 0; i < known.n; i++) {
        if (known.at[i] == &progress_option) continue;
        bool fits = option_text(known.at[i], text, sizeof text) <= width;
        if (!fits) printf("%s\n", text);
        printf("%-*s  %s\n", width, fits ? text : "", known.at[i]->help);
    }
    printf("\nProgress as lines of JSON, for other programs: --progress json[:DESCRIPTOR], see vg(7).\n");
}

static bool parse_number(const char *text, double *x)
{
    const char *end = cli_scan_number(text, x);
    return end && !*end;
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

/* "a|b|c" as "'a', 'b' or 'c'", or with dashes before each instead of the quotes */
static void list_words(const char *words, bool options, char *to, size_t size)
{
    size_t at = 0;
    to[0] = 0;
    for (const char *p = words; *p && at < size;) {
        size_t n = strcspn(p, "|");
        const char *before = p == words ? "" : p[n] ? ", " : " or ";
        at += (size_t)snprintf(to + at, size - at, options ? "%s--%.*s" : "%s'%.*s'", before, (int)n, p);
        p += n + (p[n] != 0);
    }
}

static size_t take_choice(const cli_option *o, const char *value)
{
    size_t number = 0, length = strlen(value);
    for (const char *p = o->value;; number++) {
        size_t n = strcspn(p, "|");
        if (n == length && !memcmp(p, value, n)) return number;
        if (!p[n]) break;
        p += n + 1;
    }
    char all[200];
    list_words(o->value, false, all, sizeof all);
    cli_usage("option '--%s' needs %s, not '%s'", o->name, all, value);
}

static void take_option(size_t number, const char *value)
{
    const cli_option *o = known.at[number];
    known.given[number] = true;
    if (o->choice) *o->choice = take_choice(o, value);
    if (o->flag) {
        *o->flag = true;
    } else if (o->text) {
        if (!*value && !strcmp(o->value, "FILE")) cli_usage("option '--%s' needs the name of a file", o->name);
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

/* The index of the option for getopt's value; known.n: none. */
static size_t find_option(int value)
{
    if (value >= LONG_BASE) return (size_t)(value - LONG_BASE);
    size_t i = 0;
    while (i < known.n && !(value && known.at[i]->letter == value)) i++;
    return i;
}

/* The edit distance: the smallest number of letters to insert, delete, replace or swap with a neighbour. */
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

size_t cli_likely(const char *text, size_t length, size_t n, const char *(*name)(const void *names, size_t i), const void *names)
{
    size_t least = length / 3 + 1, likely = n;
    for (size_t i = 0; i < n; i++) {
        size_t d = edit_distance(text, length, name(names, i));
        if (d < least) least = d, likely = i;
    }
    return likely;
}

static const char *option_name(const void *names, size_t i)
{
    (void)names;
    return known.at[i]->name;
}

static const cli_option *likely_option(const char *text, size_t length)
{
    size_t i = cli_likely(text, length, known.n, option_name, NULL);
    return i < known.n ? known.at[i] : NULL;
}

static const cli_moved *moved_option(const char *text, size_t length)
{
    for (const cli_moved *m = state.program->moved; m && m->name; m++)
        if (strlen(m->name) == length && !memcmp(m->name, text, length)) return m;
    return NULL;
}

/* The error of getopt in our words. */
static void refuse_option(int problem, char **argv) __attribute__((noreturn));
static void refuse_option(int problem, char **argv)
{
    size_t number = find_option(optopt);
    const cli_option *o = number < known.n ? known.at[number] : NULL;
    if (problem == ':' && o) cli_usage("option '--%s' needs a value: %s", o->name, o->value);
    if (o) cli_usage("option '--%s' takes no value", o->name);
    if (optopt) cli_usage("unknown option '-%c': '%s --help' lists them", optopt, state.program->name);
    const char *text = argv[optind - 1];
    int length = (int)strcspn(text, "=");
    const cli_moved *moved = moved_option(text + 2, length > 2 ? (size_t)length - 2 : 0);
    if (moved) cli_usage("--%s %s", moved->name, moved->now);
    const cli_option *first = NULL, *second = NULL;
    for (size_t i = 0; i < known.n; i++)
        if (length > 2 && !strncmp(known.at[i]->name, text + 2, (size_t)length - 2))
            *(first ? &second : &first) = known.at[i];
    if (second)
        cli_usage("ambiguous option '%.*s': it could be '--%s' or '--%s'", length, text, first->name, second->name);
    if (length > 2 && (o = likely_option(text + 2, (size_t)length - 2)))
        cli_usage("unknown option '%.*s': did you mean '--%s'?", length, text, o->name);
    cli_usage("unknown option '%.*s': '%s --help' lists them", length, text, state.program->name);
}

/* An option of two words takes the next argument, too, unless that is an option. */
static void take_second(const cli_option *o, int argc, char **argv)
{
    const char *next = optind < argc ? argv[optind] : "-?";
    const cli_moved *moved = strncmp(next, "--", 2) ? NULL : moved_option(next + 2, strcspn(next + 2, "="));
    if (moved) cli_usage("--%s %s", moved->name, moved->now);
    if (next[0] == '-' && next[1])
        cli_usage("option '--%s' needs two values: %s", o->name, o->value);
    *o->second = argv[optind++];
}

/* Collect operands in order; options may stand between them; everything after "--" is an operand. */
static size_t collect_operands(int argc, char **argv, char **operands)
{
    struct option longs[MOST_OPTIONS + 1] = {{0}};
    char letters[2 * MOST_OPTIONS + 4] = "-:";
    size_t at = strlen(letters), count = 0;
    for (size_t i = 0; i < known.n; i++) {
        int takes = known.at[i]->value ? required_argument : no_argument;
        longs[i] = (struct option){known.at[i]->name, takes, NULL, LONG_BASE + (int)i};
        if (known.at[i]->letter) letters[at++] = known.at[i]->letter;
        if (known.at[i]->letter && known.at[i]->value) letters[at++] = ':';
    }
    letters[at] = 0;
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, letters, longs, NULL)) != -1;) {
        if (c == 1) {
            operands[count++] = optarg;
        } else if (c != '?' && c != ':') {
            size_t number = find_option(c);
            take_option(number, optarg);
            if (known.at[number]->second) take_second(known.at[number], argc, argv);
        } else if (!want_version) {
            refuse_option(c, argv);
        }
        if (want_help) return 0;
    }
    while (optind < argc) operands[count++] = argv[optind++];
    return count;
}

static void check_needs(const cli_option *o)
{
    char names[200];
    for (const char *p = o->needs; p; p = p[strcspn(p, "|")] ? p + strcspn(p, "|") + 1 : NULL)
        if (is_given(p, strcspn(p, "|"))) return;
    list_words(o->needs, true, names, sizeof names);
    cli_usage("--%s needs %s", o->name, names);
}

static void check_excludes(const cli_option *o)
{
    for (const char *p = o->excludes; p; p = p[strcspn(p, "|")] ? p + strcspn(p, "|") + 1 : NULL)
        if (is_given(p, strcspn(p, "|")))
            cli_usage("--%s does not go with --%.*s", o->name, (int)strcspn(p, "|"), p);
}

/* Print the version after all options are read: --verbose may follow --version. */
static void print_version(const char *name)
{
    printf("%s (vg) %s\nstream 1.0\n", name, VG_VERSION);
    if (!state.verbose) return;
    printf("kernels for %s; this machine has", vg_isa());
    const char *set;
    for (size_t i = 0; (set = vg_isa_at(i)); i++) printf("%s %s", i ? "," : "", set);
    putchar('\n');
}

/* Check that the given options are compatible. */
static void check_together(void)
{
    for (size_t i = 0; i < known.n; i++) {
        const cli_option *o = known.at[i];
        if (!known.given[i]) continue;
        if (o->needs) check_needs(o);
        check_excludes(o);
        if (o->reads && o->text) cli_claim_input(o->name, *o->text);
        if (o->reads && o->second) cli_claim_input(o->name, *o->second);
    }
}

void options_start(const cli_program *p, int argc, char **argv)
{
    state.program = p, state.argc = argc, state.argv = argv;
}

size_t options_parse(char **operands)
{
    const cli_program *p = state.program;
    gather_options(p);
    size_t n = collect_operands(state.argc, state.argv, operands);
    if (want_help) print_help(p);
    if (want_version && !want_help) print_version(p->name);
    if (want_help || want_version) cli_finish(0);
    if (n > p->most_operands) {
        if (p->most_operands == 0) cli_usage("%s takes no operands, but got '%s'", p->name, operands[0]);
        cli_usage("one operand too many: '%s'", operands[p->most_operands]);
    }
    check_together();
    state.threads = !p->threaded ? 1 : threads_asked ? (int)threads_asked : processors_count(MOST_THREADS);
    if (p->threaded && !(state.threads = vg_threads_with_room(state.threads)))
        cli_stop(VG_ENOMEM, "not enough memory to calculate: is there a limit, such as ulimit -v?");
    if (state.output && !strcmp(state.output, "-")) state.output = NULL;
    return n;
}

options_state *options_of_process(void)
{
    return &state;
}

const cli_program *options_program(void)
{
    return state.program;
}

const char *cli_output(void)
{
    return state.output;
}

int cli_threads(void)
{
    return state.threads;
}

bool cli_quiet(void)
{
    return state.quiet;
}

bool cli_verbose(void)
{
    return state.verbose;
}

bool cli_json(void)
{
    return state.json;
}

void cli_be_quiet(void)
{
    state.quiet = true;
}

/* --------------------------------------------------------------------------------------------- values -- */

/* Compare names of options with or without their dashes. */
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

size_t cli_parse_numbers(const char *text, double *x, size_t most)
{
    for (size_t n = 0; n < most; n++) {
        char one[64];
        size_t length = strcspn(text, ",");
        if (length >= sizeof one) return 0;
        memcpy(one, text, length);
        one[length] = 0;
        if (!parse_number(one, &x[n])) return 0;
        if (!text[length]) return n + 1;
        text += length + 1;
    }
    return 0;
}

uint64_t cli_parse_size(const char *option, const char *text)
{
    static const char units[] = "KMGT";
    char *end;
    errno = 0;
    unsigned long long x = strtoull(text, &end, 10);
    const char *unit = isalpha((unsigned char)*end) ? strchr(units, *end & ~0x20) : NULL;
    if (errno || *text < '0' || *text > '9' || (*end && (!unit || end[1])))
        cli_usage("option '--%s' needs a size such as 64M or 2G, not '%s'", bare(option), text);
    for (const char *u = units; unit && u <= unit; u++)
        if (__builtin_mul_overflow(x, 1024, &x)) return UINT64_MAX;
    return x;
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
    qsort(*vertices, n, sizeof **vertices, cli_by_number);
    for (size_t i = 0; i < n; i++)
        if (i == 0 || (*vertices)[i] != (*vertices)[unique - 1]) (*vertices)[unique++] = (*vertices)[i];
    return unique;
}
