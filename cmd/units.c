/* units.c: units of length on the command line.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "units.h"

#include <string.h>

double unit_metres(const char *name, size_t n)
{
    static const struct {
        const char *name;
        double metres;
    } units[] = {{"mm", 1e-3}, {"cm", 1e-2}, {"dm", 1e-1}, {"m", 1}, {"km", 1e3}, {"in", 0.0254}, {"ft", 0.3048}};
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (strlen(units[i].name) == n && !memcmp(units[i].name, name, n)) return units[i].metres;
    return 0;
}
