/* lines.h: reads small text files of options line by line; '#' starts a comment, empty lines are skipped.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_LINES_H
#define VG_CMD_LINES_H

#include "cli.h"

typedef struct lines {
    const char *file;
    char *text, *next, *now; /* the text; the rest of it; the rest of the line */
    size_t number;           /* of the line, from 1 */
} lines;

lines lines_open(const char *file); /* stops if it cannot be read or contains NUL */
void lines_close(lines *l);
bool lines_next(lines *l); /* advance to the next line with content */
/* lines_word: read the next word if it is this one; false: it is not. */
bool lines_word(lines *l, const char *word);
/* lines_numbers: read the rest of the line as finite numbers up to 1e100. Returns their number; 0 if there are
 * more than `most` or anything else. */
size_t lines_numbers(lines *l, double *x, size_t most);
void lines_stop(const lines *l, const char *format, ...) VG_PRINTF(2, 3) __attribute__((noreturn));

#endif
