/* progress.c: shows progress on a terminal or to another program. Messages are in cli.c.
 * Loops report counts (cli_progress_of). Of a phase whose steps are not known (cli_working), a thread shows how long it has
 * taken.
 *
 * In a pipe only the slowest program draws its line: its input pipe is full and its output pipe is not.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "progress.h"
#include "cli.h"
#include "options.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

static const double first_after = 1, interval = 0.2; /* seconds */

static struct {
    bool json, drawn;
    int fd; /* of the reports in JSON */
    double started, last;
    const char *label; /* of the phase */
    double phase_started;
    uint64_t phase_first; /* count at its start */
    char detail[80];      /* of the next line */
    bool working;         /* a phase without counts */
    bool ticking, ended;  /* the thread is there; it shall stop */
    pthread_mutex_t lock; /* the thread and the messages share the terminal and all of this */
} progress = {.fd = STDERR_FILENO, .lock = PTHREAD_MUTEX_INITIALIZER};

void progress_start(void)
{
    progress.started = cli_seconds();
}

void progress_take(const char *value, void *context)
{
    (void)context;
    char *end = NULL;
    long fd = STDERR_FILENO;
    bool json = !strncmp(value, "json", 4) && (!value[4] || (value[4] == ':' && value[5] >= '0' && value[5] <= '9'));
    if (json && value[4]) fd = strtol(value + 5, &end, 10);
    if (!json || (end && *end) || fd < 0 || fd > 1 << 20)
        cli_usage("option '--progress' needs 'json' or 'json:DESCRIPTOR', not '%s'", value);
    if (fd == STDOUT_FILENO) cli_usage("option '--progress' needs another descriptor than standard output");
    if (fcntl((int)fd, F_GETFD) < 0) cli_usage("option '--progress': descriptor %ld is not open", fd);
    progress.json = true, progress.fd = (int)fd;
}

/* More than half full: 1; less: 0; no pipe: otherwise. */
static int pipe_is_full(int fd, int otherwise)
{
    struct stat st;
    int held = 0, size = fcntl(fd, F_GETPIPE_SZ);
    if (fstat(fd, &st) || !S_ISFIFO(st.st_mode) || size <= 0 || ioctl(fd, FIONREAD, &held)) return otherwise;
    return 2 * (long)held >= size;
}

/* Has the writer of standard input ended? Then no earlier program is slower. */
static bool input_has_ended(void)
{
    struct pollfd p = {.fd = STDIN_FILENO, .events = POLLIN};
    return poll(&p, 1, 0) > 0 && (p.revents & POLLHUP);
}

static bool is_slowest(void)
{
    return (pipe_is_full(STDIN_FILENO, 1) || input_has_ended()) && !pipe_is_full(STDOUT_FILENO, 0);
}

static void write_some(int fd, const char *text, int n)
{
    ssize_t done;
    do
        done = write(fd, text, (size_t)n);
    while (done < 0 && errno == EINTR);
}

static void erase(void)
{
    if (progress.drawn) write_some(STDERR_FILENO, "\r\033[K", 4);
    progress.drawn = false;
}

void progress_pause(void)
{
    pthread_mutex_lock(&progress.lock);
    erase();
}

void progress_go_on(void)
{
    pthread_mutex_unlock(&progress.lock);
}

void progress_end(void)
{
    progress_pause();
    progress.ended = true;
    progress_go_on();
}

/* "12 s", "3 min 20 s", "2 h 5 min" */
static void print_duration(char *to, size_t size, double seconds)
{
    unsigned long long s = seconds < 1e9 ? (unsigned long long)(seconds + 0.5) : 1000000000;
    if (s < 100) snprintf(to, size, "%llu s", s);
    else if (s < 6000) snprintf(to, size, "%llu min %llu s", s / 60, s % 60);
    else snprintf(to, size, "%llu h %llu min", s / 3600, s / 60 % 60);
}

static void draw_progress(const char *label, uint64_t n, uint64_t total, double left)
{
    char line[256], duration[40];
    int k = snprintf(line, sizeof line, "\r\033[K%s: %.64s %llu", options_program()->name, label, (unsigned long long)n);
    if (total) k += snprintf(line + k, sizeof line - (size_t)k, " of %llu", (unsigned long long)total);
    print_duration(duration, sizeof duration, left);
    if (left >= 1) k += snprintf(line + k, sizeof line - (size_t)k, ", %s left", duration);
    k += snprintf(line + k, sizeof line - (size_t)k, "%s", progress.detail);
    progress.drawn = true;
    write_some(STDERR_FILENO, line, k);
}

static void draw_working(double since)
{
    char line[192], duration[40];
    print_duration(duration, sizeof duration, since);
    int k = snprintf(line, sizeof line, "\r\033[K%s: %.64s, %s", options_program()->name, progress.label, duration);
    progress.drawn = true;
    write_some(STDERR_FILENO, line, k);
}

/* Labels and program names are ours and need no escaping. */
static void print_json(const char *label, uint64_t n, uint64_t total, double left, double now)
{
    char line[256];
    int k = snprintf(line, sizeof line, "{\"program\":\"%s\",\"doing\":\"%.64s\",\"done\":%llu", options_program()->name,
                     label, (unsigned long long)n);
    if (total) k += snprintf(line + k, sizeof line - (size_t)k, ",\"total\":%llu", (unsigned long long)total);
    k += snprintf(line + k, sizeof line - (size_t)k, ",\"seconds\":%.3f", now - progress.started);
    if (left >= 0) k += snprintf(line + k, sizeof line - (size_t)k, ",\"left\":%.3f", left);
    k += snprintf(line + k, sizeof line - (size_t)k, "}\n");
    write_some(progress.fd, line, k);
}

/* Seconds until `total` at the speed of this phase so far; -1: not known. */
static double time_left(uint64_t n, uint64_t total, double now)
{
    uint64_t done = n - progress.phase_first;
    if (!total || n > total || n <= progress.phase_first || now <= progress.phase_started) return -1;
    return (now - progress.phase_started) / (double)done * (double)(total - n);
}

static bool is_watched(void)
{
    static int terminal = -1;
    if (terminal < 0) terminal = isatty(STDERR_FILENO) && !cli_quiet();
    return terminal || progress.json;
}

static void begin_phase(const char *label, uint64_t first, double now)
{
    if (progress.label && !strcmp(progress.label, label)) return;
    progress.label = label, progress.phase_first = first;
    progress.phase_started = now;
    if (progress.json) progress.last = -interval; /* report it at once */
}

/* Is it time for another line? */
static bool is_due(double now)
{
    if (now - progress.last < interval || (!progress.json && now - progress.started < first_after)) return false;
    progress.last = now;
    return true;
}

void cli_progress_of(const char *label, uint64_t n, uint64_t total)
{
    if (!is_watched()) return;
    double now = cli_seconds();
    pthread_mutex_lock(&progress.lock);
    progress.working = false;
    begin_phase(label, n, now);
    if (is_due(now)) {
        double left = time_left(n, total, now);
        if (progress.json) print_json(label, n, total, left, now);
        else if (is_slowest()) draw_progress(label, n, total, left);
        else erase();
    }
    progress.detail[0] = 0;
    pthread_mutex_unlock(&progress.lock);
}

void cli_progress(const char *label, uint64_t n)
{
    cli_progress_of(label, n, 0);
}

void cli_progress_detail(const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    vsnprintf(progress.detail, sizeof progress.detail, format, ap);
    va_end(ap);
}

/* ---- phases without counts ---- */

static void show_working(double now)
{
    if (!progress.working || !is_due(now)) return;
    if (progress.json) print_json(progress.label, 0, 0, -1, now);
    else if (is_slowest()) draw_working(now - progress.phase_started);
    else erase();
}

static void *tick(void *unused)
{
    (void)unused;
    for (bool done = false; !done;) {
        nanosleep(&(struct timespec){.tv_nsec = (long)(interval * 1e9)}, NULL);
        pthread_mutex_lock(&progress.lock);
        done = progress.ended;
        if (!done) show_working(cli_seconds());
        pthread_mutex_unlock(&progress.lock);
    }
    return NULL;
}

/* Signals go to the thread that started the program. Without a thread there are fewer lines. */
static void start_ticking(void)
{
    pthread_t thread;
    sigset_t all, before;
    sigfillset(&all);
    if (progress.ticking || pthread_sigmask(SIG_SETMASK, &all, &before)) return;
    progress.ticking = !pthread_create(&thread, NULL, tick, NULL) && !pthread_detach(thread);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
}

void cli_working(const char *doing)
{
    if (!is_watched()) return;
    double now = cli_seconds();
    pthread_mutex_lock(&progress.lock);
    progress.working = true;
    begin_phase(doing, 0, now);
    show_working(now);
    start_ticking();
    pthread_mutex_unlock(&progress.lock);
}
