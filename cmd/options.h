/* options.h: what cli.c asks of the command line; the programs' side of it is in cli.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_OPTIONS_H
#define VG_OPTIONS_H

#include "cli.h"

/* options_parse: take all options of the program; returns the number of operands, which are put into `operands`
 * (room for argc). -h and -V print and end the program, and so does wrong usage. */
size_t options_parse(int argc, char **argv, char **operands);

#endif
