/* decimal.c: numbers in options and texts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* strtod also accepts leading blanks, hexadecimal numbers and names. */
const char *cli_scan_number(const char *text, double *x)
{
    char *end;
    const size_t decimal = strspn(text, "+-.0123456789eE");
    if (!decimal) return NULL;
    *x = strtod(text, &end);
    return end > text && end <= text + decimal && isfinite(*x) ? end : NULL;
}
