/* progress.h: the interface of progress.c for cli.c and options.c; programs use cli.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PROGRESS_H
#define VG_PROGRESS_H

/* progress_start: the program has started now. */
void progress_start(void);
/* progress_take: the value of --progress; to be given to cli_option. */
void progress_take(const char *value, void *context);
/* progress_pause: clear the line on the terminal, if there is one, and draw none until progress_go_on. */
void progress_pause(void);
void progress_go_on(void);
/* progress_end: clear the line; there will be no other in the background. */
void progress_end(void);

#endif
