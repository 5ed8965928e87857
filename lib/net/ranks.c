/* ranks.c: MPI, or a single process. Nothing is summed here: gradients are sent unchanged, and every process adds
 * them in the same order, so that the number of processes changes no bit.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/ranks.h"

#ifdef VG_MPI
#include <limits.h>
#include <mpi.h>

static int count, own;

static void start_mpi(void)
{
    if (count) return;
    MPI_Init(NULL, NULL);
    MPI_Comm_size(MPI_COMM_WORLD, &count);
    MPI_Comm_rank(MPI_COMM_WORLD, &own);
}

size_t vgi_ranks(void)
{
    start_mpi();
    return (size_t)count;
}

size_t vgi_rank(void)
{
    start_mpi();
    return (size_t)own;
}

/* MPI counts in int */
static void broadcast(size_t from, void *x, size_t n, size_t size, MPI_Datatype type)
{
    for (size_t at = 0; at < n; at += INT_MAX / 8) {
        size_t part = n - at < INT_MAX / 8 ? n - at : INT_MAX / 8;
        MPI_Bcast((char *)x + at * size, (int)part, type, (int)from, MPI_COMM_WORLD);
    }
}

void vgi_ranks_share(size_t from, float *x, size_t n)
{
    if (vgi_ranks() > 1) broadcast(from, x, n, sizeof *x, MPI_FLOAT);
}

void vgi_ranks_share_double(size_t from, double *x, size_t n)
{
    if (vgi_ranks() > 1) broadcast(from, x, n, sizeof *x, MPI_DOUBLE);
}

bool vgi_ranks_any(bool yes)
{
    int all = 0, one = yes;
    if (vgi_ranks() == 1) return yes;
    MPI_Allreduce(&one, &all, 1, MPI_INT, MPI_LOR, MPI_COMM_WORLD);
    return all;
}

void vgi_ranks_end(void)
{
    int ended = 0;
    MPI_Finalized(&ended);
    if (count && !ended) MPI_Finalize();
}

#else

size_t vgi_ranks(void)
{
    return 1;
}

size_t vgi_rank(void)
{
    return 0;
}

void vgi_ranks_share(size_t from, float *x, size_t n)
{
    (void)from, (void)x, (void)n;
}

void vgi_ranks_share_double(size_t from, double *x, size_t n)
{
    (void)from, (void)x, (void)n;
}

bool vgi_ranks_any(bool yes)
{
    return yes;
}

void vgi_ranks_end(void)
{
}

#endif
