/* output.h: what cli.c and options.c ask of the one output of a program; the programs' side of it is in cli.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_OUTPUT_H
#define VG_OUTPUT_H

#include <stdbool.h>

/* output_check: look at --output before any work: what is wrong with it now will be wrong then. Ends the program. */
void output_check(bool stream);
/* output_remove: the temporary file, if there is one. */
void output_remove(void);
/* output_abandon: leave nothing half-written: no temporary file, and no stream that only stops: that says who
 * failed. */
void output_abandon(const char *program, int status, const char *message);
/* output_discard: before the process ends in a way that is not ours. Safe in the handler of a signal. */
void output_discard(void);
/* output_flush: the last of standard output. Ends the program when it was lost. */
void output_flush(void);

#endif
