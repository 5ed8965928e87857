/* options.h: the interface of options.c for cli.c; programs use cli.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_OPTIONS_H
#define VG_OPTIONS_H

#include "cli.h"

/* options_parse: parse all options of the program. Stores the operands in `operands` (room for argc) and returns
 * their number. -h, -V and wrong usage end the program. */
size_t options_parse(int argc, char **argv, char **operands);

#endif
