/* banned.h: included before every file of this project; calls that hide errors, overrun buffers or depend on the
 * locale do not compile. The system headers that declare them are included first, so that only our own uses are
 * caught.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BANNED_H
#define VG_BANNED_H
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#pragma GCC poison strcpy strcat sprintf vsprintf gets atoi atol atof strtok strncpy strncat
#endif
