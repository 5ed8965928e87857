/* ranks.h: the processes that train a network together. With MPI=1 they are those of MPI; else there is one.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RANKS_H
#define VG_RANKS_H

#include "core/core.h"

/* vgi_ranks: how many there are. The first call starts MPI. */
size_t vgi_ranks(void);
size_t vgi_rank(void); /* this one, from 0 */
/* What process `from` has becomes what all have. */
void vgi_ranks_share(size_t from, float *x, size_t n);
void vgi_ranks_share_double(size_t from, double *x, size_t n);
/* vgi_ranks_end: the last call of each. A process that ends without it ends them all. */
void vgi_ranks_end(void);
bool vgi_ranks_any(bool yes); /* does any of them say yes? */

#endif
