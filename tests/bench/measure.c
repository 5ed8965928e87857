/* measure: run a shell command and say how long it took and how much memory its largest process held.
 * usage: measure TIMES COMMAND    Prints "SECONDS KIB": the shortest time and the largest peak of TIMES runs.
 * Leaves out what the command prints: its standard output goes where it says.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds of one run; negative when it could not be started or did not end with status 0. */
static double run(const char *command)
{
    double start = now();
    int status;
    pid_t child = fork();
    if (child < 0) return -1;
    if (child == 0) {
        execl("/bin/sh", "sh", "-c", command, (char *)NULL);
        _exit(127);
    }
    if (waitpid(child, &status, 0) != child || status != 0) return -1;
    return now() - start;
}

int main(int argc, char **argv)
{
    long times = argc == 3 ? strtol(argv[1], NULL, 10) : 0;
    if (times < 1) {
        fprintf(stderr, "usage: measure TIMES COMMAND\n");
        return 2;
    }
    double best = 0;
    for (long i = 0; i < times; i++) {
        double seconds = run(argv[2]);
        if (seconds < 0) {
            fprintf(stderr, "measure: this command failed: %s\n", argv[2]);
            return 4;
        }
        if (i == 0 || seconds < best) best = seconds;
    }
    struct rusage used;
    getrusage(RUSAGE_CHILDREN, &used); /* of all that were waited for, also by the shell */
    printf("%.4f %ld\n", best, used.ru_maxrss);
    return 0;
}
