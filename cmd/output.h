/* output.h: the interface of output.c for cli.c and options.c; programs use cli.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_OUTPUT_H
#define VG_OUTPUT_H

#include <stdbool.h>

/* output_check: check --output before any work. Stops if it cannot be written. */
void output_check(bool stream);
/* output_remove: remove the temporary file, if there is one. */
void output_remove(void);
/* output_abandon: remove the temporary file, and end a stream with a FAIL record. */
void output_abandon(const char *program, int status, const char *message);
/* output_discard: remove output before the process ends by a signal or a library's exit(). Async-signal-safe. */
void output_discard(void);
/* output_hand_on: write the frames of a stream that were collected, before waiting for others. Stops if that fails. */
void output_hand_on(void);
/* output_flush: flush standard output. Stops if output was lost. */
void output_flush(void);

#endif
