/* lines.c: reads small text files of options line by line.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "lines.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

lines lines_open(const char *file)
{
    size_t size;
    lines l = {.file = file, .text = cli_read_file(file, &size)};
    if (memchr(l.text, 0, size)) cli_stop(VG_EINPUT, "'%s' is not text", file);
    l.next = l.text;
    return l;
}

void lines_close(lines *l)
{
    free(l->text);
    *l = (lines){0};
}

bool lines_next(lines *l)
{
    while (l->next && *l->next) {
        l->now = l->next;
        l->number++;
        if ((l->next = strchr(l->now, '\n'))) *l->next++ = 0;
        l->now[strcspn(l->now, "#\r")] = 0;
        l->now += strspn(l->now, " \t");
        if (*l->now) return true;
    }
    return false;
}

bool lines_word(lines *l, const char *word)
{
    size_t n = strlen(word);
    if (strncmp(l->now, word, n) || !strchr(" \t", l->now[n])) return false;
    l->now += n;
    return true;
}

size_t lines_numbers(lines *l, double *x, size_t most)
{
    size_t n = 0;
    for (const char *end;; n++, l->now += end - l->now) {
        l->now += strspn(l->now, " \t");
        if (!*l->now) return n;
        if (n == most) return 0;
        end = cli_scan_number(l->now, &x[n]);
        if (!end || (*end && !strchr(" \t", *end)) || fabs(x[n]) > 1e100) return 0;
    }
}

void lines_stop(const lines *l, const char *format, ...)
{
    char what[300];
    va_list ap;
    va_start(ap, format);
    vsnprintf(what, sizeof what, format, ap);
    va_end(ap);
    cli_stop(VG_EINPUT, "'%s' line %zu: %s", l->file, l->number, what);
}
