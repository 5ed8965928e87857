/* fuzz_texts.c: files of places, times and curves: refused with exit status 3, or all of their numbers are finite and what
 * is drawn or timed by them is, too. The first byte chooses which.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "../../cmd/cli.h"

#include <math.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

/* What the readers take of cli.c: the file is the input, and to stop comes back here. What they held is then lost, so that
 * all of it is kept in a list and freed. */
enum { FRAMES = 7, MOST_BYTES = 4096, MOST_HELD = 64 };
static jmp_buf ended;
static int code;
static const uint8_t *file_data;
static size_t file_size;
static void *held[MOST_HELD];
static size_t nheld;

static void *hold(void *p)
{
    if (!p || nheld == MOST_HELD) abort();
    return held[nheld++] = p;
}

static void let_go(void *p)
{
    for (size_t i = 0; i < nheld; i++)
        if (held[i] == p) held[i] = NULL;
    free(p);
}

char *cli_read_file(const char *path, size_t *size)
{
    (void)path;
    char *text = hold(malloc(file_size + 1));
    memcpy(text, file_data, file_size);
    text[*size = file_size] = 0;
    return text;
}

void *cli_allocate(size_t n, size_t size, const char *what)
{
    (void)what;
    return hold(calloc(n + 1, size));
}

void *cli_resize(void *array, size_t n, size_t size, const char *what)
{
    (void)what;
    for (size_t i = 0; array && i < nheld; i++)
        if (held[i] == array) return (held[i] = realloc(array, n * size)) ? held[i] : (abort(), NULL);
    return hold(malloc(n * size));
}

void cli_stop(int why, const char *format, ...)
{
    if (!format[0]) abort();
    code = why;
    longjmp(ended, 1);
}

#include "../../cmd/decimal.c"
#define free let_go
#include "../../cmd/lines.c"
#include "../../cmd/signal_texts.c"
#undef free

static void demand(bool holds)
{
    if (!holds) abort();
}

static void try_places(void)
{
    double *place = read_places("places", FRAMES);
    for (size_t i = 0; i < 2 * FRAMES; i++) demand(fabs(place[i]) <= 1e100);
}

static vg_retime retime;
static void try_retime(void)
{
    vg_err e;
    read_retime("times", FRAMES, &retime);
    demand(retime.n >= 2);
    double last = 0;
    for (size_t i = 0; i <= 50; i++) {
        double share = (double)i / 50, t = retime.new_time[0] * (1 - share) + retime.new_time[retime.n - 1] * share;
        double old;
        demand(vg_retime_at(&retime, t, &old, &e) == VG_OK);
        demand(old >= last - 1e-12 && old >= 1 - 1e-12 && old <= FRAMES + 1e-12);
        last = old;
    }
}

static void try_curve(void)
{
    size_t n;
    bool controls;
    double *point = read_curve("curve", &n, &controls), at[2 * FRAMES];
    vg_err e;
    for (size_t i = 0; i < 2 * n; i++) demand(fabs(point[i]) <= 1e100);
    int r = vg_signal_sketch(point, n, controls, FRAMES, at, &e);
    demand(r == VG_OK || (r == VG_EINPUT && n < 4));
    for (size_t i = 0; r == VG_OK && i < 2 * FRAMES; i++) demand(isfinite(at[i]));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static void (*const trials[])(void) = {try_places, try_retime, try_curve};
    if (size < 1 || size > MOST_BYTES) return 0;
    file_data = data + 1, file_size = size - 1;
    nheld = 0;
    if (!setjmp(ended)) trials[data[0] % 3]();
    else demand(code == VG_EINPUT);
    for (size_t i = 0; i < nheld; i++) free(held[i]);
    vg_retime_clear(&retime);
    return 0;
}
