/* pipe: how fast memory goes from one process to another, the most that a filter between two pipes can reach.
 * usage: pipe PIPE_BYTES MEGABYTES    Prints MB/s (1e6 bytes), the best of five.
 * Leaves out what a stream costs beyond that: records, checksums, looking at the numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* A frame of 13,380 vertices is twice this; source and target are walked through like frames that are reused. */
enum { BLOCK = 256 * 1024, BLOCKS = 8 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void give(int fd, const char *memory, size_t total)
{
    for (size_t at = 0, done = 0; done < total;) {
        ssize_t n = write(fd, memory + at, BLOCK);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) _exit(4);
        done += (size_t)n;
        at = (at + BLOCK) % (BLOCK * BLOCKS);
    }
    _exit(0);
}

/* Seconds until all of it has arrived; negative when something failed. */
static double carry(int pipe_bytes, char *memory, size_t total)
{
    int fd[2], status;
    if (pipe(fd) || fcntl(fd[1], F_SETPIPE_SZ, pipe_bytes) < 0) return -1;
    double start = now();
    pid_t child = fork();
    if (child < 0) return -1;
    if (child == 0) give(fd[1], memory, total);
    close(fd[1]);
    size_t got = 0, at = 0;
    ssize_t n;
    while ((n = read(fd[0], memory + at, BLOCK)) != 0) {
        if (n < 0 && errno != EINTR) break;
        if (n > 0) got += (size_t)n, at = (at + BLOCK) % (BLOCK * BLOCKS);
    }
    double seconds = now() - start;
    close(fd[0]);
    if (waitpid(child, &status, 0) != child || status || got < total) return -1;
    return seconds;
}

int main(int argc, char **argv)
{
    long pipe_bytes = argc == 3 ? strtol(argv[1], NULL, 10) : 0;
    long megabytes = argc == 3 ? strtol(argv[2], NULL, 10) : 0;
    if (pipe_bytes < 1 || pipe_bytes > 1 << 30 || megabytes < 1) {
        fprintf(stderr, "usage: pipe PIPE_BYTES MEGABYTES\n");
        return 2;
    }
    char *memory = malloc(BLOCK * BLOCKS);
    if (!memory) return 4;
    memset(memory, 1, BLOCK * BLOCKS);
    double best = 0, total = 1e6 * (double)megabytes;
    for (int i = 0; i < 5; i++) {
        double seconds = carry((int)pipe_bytes, memory, (size_t)total);
        if (seconds < 0) {
            fprintf(stderr, "pipe: no pipe of %ld bytes: %s\n", pipe_bytes, strerror(errno));
            return 4;
        }
        if (total / seconds > best) best = total / seconds;
    }
    printf("%.0f\n", best / 1e6);
    free(memory);
    return 0;
}
