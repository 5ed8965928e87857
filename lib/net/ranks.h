/* ranks.h: the processes that train a network together: those of MPI if built with MPI=1, otherwise one. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RANKS_H
#define VG_RANKS_H

#include "core/core.h"

/* vgi_ranks: number of processes. The first call starts MPI. */
size_t vgi_ranks(void);
size_t vgi_rank(void); /* number of this process, from 0 */
/* Broadcast the data of process `from` to all. */
void vgi_ranks_share(size_t from, float *x, size_t n);
void vgi_ranks_share_double(size_t from, double *x, size_t n);
/* vgi_ranks_end: must be the last call of each process. A process that ends without it ends all of them. */
void vgi_ranks_end(void);
bool vgi_ranks_any(bool yes); /* whether any process passes true */

#endif
