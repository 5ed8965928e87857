/* lines.h: small text files of options, line by line: '#' begins a comment, empty lines are passed over.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_LINES_H
#define VG_CMD_LINES_H

#include "cli.h"

typedef struct lines {
    const char *file;
    char *text, *next, *now; /* all; what has not been read; what is left of the line */
    size_t number;           /* of the line, from 1 */
} lines;

lines lines_open(const char *file); /* stops when it cannot be read, or holds NUL */
void lines_close(lines *l);
bool lines_next(lines *l); /* the next line that says something */
/* lines_word: is this the next word? Then it is read. */
bool lines_word(lines *l, const char *word);
/* lines_numbers: the rest of the line as finite numbers up to 1e100; how many; 0 when there are more than `most`, or
 * something else. */
size_t lines_numbers(lines *l, double *x, size_t most);
void lines_stop(const lines *l, const char *format, ...) VG_PRINTF(2, 3) __attribute__((noreturn));

#endif
