/* options.h: the interface of options.c for cli.c, output.c and progress.c; programs use cli.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_OPTIONS_H
#define VG_OPTIONS_H

#include "cli.h"
#include "options.h"

/* The command line of this process; options.c owns it. */
typedef struct options_state {
    const cli_program *program;
    int argc; /* for provenance */
    char **argv;
    bool quiet, verbose, json, no_provenance;
    const char *output; /* NULL: standard output */
    int threads;        /* >= 1 */
} options_state;
options_state *options_of_process(void);
const cli_program *options_program(void);

/* options_start: call this before anything may print a message: it names the program. */
void options_start(const cli_program *p, int argc, char **argv);
/* options_parse: parse all options of the program. Stores the operands in `operands` (room for argc) and returns
 * their number. -h, -V and wrong usage end the program. */
size_t options_parse(char **operands);

#endif
