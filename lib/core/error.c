/* error.c: records a failure in a vg_err. Printing is left to the commands.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"

#include <stdarg.h>
#include <stdio.h>

int vg_fail(vg_err *e, int code, const char *format, ...)
{
    if (!e) return code;
    va_list ap;
    va_start(ap, format);
    vsnprintf(e->message, sizeof e->message, format, ap);
    va_end(ap);
    for (char *p = e->message; *p; p++)
        if ((unsigned char)*p < 0x20 || *p == 0x7f) *p = '?';
    e->code = code;
    return code;
}

int vg_exit_status(int code)
{
    switch (code) {
    case VG_EARG: return 2;
    case VG_EINPUT:
    case VG_ETRUNC: return 3;
    case VG_ESYS:
    case VG_ENOMEM: return 4;
    default: return code >= 0 ? 0 : 4;
    }
}
