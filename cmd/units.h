/* units.h: units of length on the command line.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_UNITS_H
#define VG_UNITS_H

#include <stddef.h>

#define UNITS_LIST "mm, cm, dm, m, km, in and ft"
/* unit_metres: length in metres of the unit with this name of n bytes; 0 if there is no such unit. */
double unit_metres(const char *name, size_t n);

#endif
