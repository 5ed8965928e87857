/* bandwidth: how fast memory is copied within one process, by one thread: what a stage that holds whole sequences can
 * reach. usage: bandwidth MEGABYTES Prints MB/s (1e6 bytes) that are copied, the best of five; MEGABYTES should be
 * beyond all caches.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char **argv)
{
    long megabytes = argc == 2 ? strtol(argv[1], NULL, 10) : 0;
    if (megabytes < 1 || megabytes > 1 << 16) {
        fprintf(stderr, "usage: bandwidth MEGABYTES\n");
        return 2;
    }
    size_t n = (size_t)megabytes * 1000000;
    unsigned char *from = malloc(n), *to = malloc(n);
    if (!from || !to) return 4;
    memset(from, 1, n);
    memset(to, 2, n);
    double best = 0;
    for (int i = 0; i < 5; i++) {
        from[n / 2] = (unsigned char)i;
        double start = now();
        memcpy(to, from, n);
        double seconds = now() - start;
        if (to[n / 2] != from[n / 2]) return 4;
        if ((double)n / seconds > best) best = (double)n / seconds;
    }
    printf("%.0f\n", best / 1e6);
    free(from);
    free(to);
    return 0;
}
