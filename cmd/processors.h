/* processors.h: the default number of threads.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PROCESSORS_H
#define VG_PROCESSORS_H

/* processors_count: the processors this process may use, at least 1 and at most `most`. */
int processors_count(int most);

#endif
