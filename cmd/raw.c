/* raw.c: frames as numbers with nothing around them, for programs that know the mesh already.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "raw.h"
#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool raw_output(const char *name, size_t *width, char **file)
{
    size_t n = strlen(name);
    if (n <= 4 || (strcmp(name + n - 4, ":f32") && strcmp(name + n - 4, ":f64"))) return false;
    *width = name[n - 2] == '3' ? 4 : 8;
    *file = cli_copy_text(name, "the name of the output");
    (*file)[n - 4] = 0;
    return true;
}

static void store_bits(unsigned char *to, uint64_t bits, size_t width)
{
    for (size_t i = 0; i < width; i++) to[i] = (unsigned char)(bits >> 8 * i);
}

static void store_number(unsigned char *to, double x, size_t width)
{
    float narrow = (float)x;
    uint32_t bits32;
    uint64_t bits;
    memcpy(&bits32, &narrow, sizeof bits32);
    memcpy(&bits, &x, sizeof bits);
    store_bits(to, width == 4 ? bits32 : bits, width);
}

void raw_write(FILE *f, const vg_frame *from, size_t count, size_t width)
{
    unsigned char block[1024 * 8];
    for (size_t i = 0; i < count; i += 1024) {
        size_t n = count - i < 1024 ? count - i : 1024;
        for (size_t k = 0; k < n; k++) {
            double x = from->values[i + k];
            if (width == 4 && !isfinite((float)x))
                cli_stop(VG_EINPUT, "frame '%s': number %zu does not fit binary32 (%g): use ':f64'", from->name, i + k, x);
            store_number(block + k * width, x, width);
        }
        fwrite(block, width, n, f); /* cli_text_end sees what was lost */
    }
}

raw_input raw_open(const char *file, size_t count, size_t width)
{
    raw_input in = {.shown = "standard input", .quote = "", .count = count, .width = width};
    bool standard = !strcmp(file, "-");
    if (!standard) in.shown = file, in.quote = "'";
    in.fd = standard ? STDIN_FILENO : open(file, O_RDONLY | O_CLOEXEC);
    if (in.fd < 0) cli_stop(VG_ESYS, "cannot open '%s': %s", file, strerror(errno));
    in.room = cli_allocate(count, width, "a frame");
    return in;
}

/* Before waiting for input, hand on the frames that were written. */
static void hand_on_before_waiting(int fd)
{
    struct pollfd p = {.fd = fd, .events = POLLIN};
    if (poll(&p, 1, 0) == 0) output_hand_on();
}

/* as many of n bytes as there are */
static size_t read_block(raw_input *in, size_t n)
{
    size_t got = 0;
    while (got < n) {
        hand_on_before_waiting(in->fd);
        ssize_t r = read(in->fd, in->room + got, n - got);
        if (r < 0 && errno == EINTR) continue;
        if (r < 0) cli_stop(VG_ESYS, "cannot read %s%s%s: %s", in->quote, in->shown, in->quote, strerror(errno));
        if (r == 0) break;
        got += (size_t)r;
    }
    return got;
}

static double load_number(const unsigned char *from, size_t width)
{
    uint64_t bits = 0;
    for (size_t i = width; i-- > 0;) bits = bits << 8 | from[i];
    uint32_t bits32 = (uint32_t)bits;
    float narrow;
    double x;
    memcpy(&narrow, &bits32, sizeof narrow);
    memcpy(&x, &bits, sizeof x);
    return width == 4 ? narrow : x;
}

bool raw_next(raw_input *in, vg_frame *f)
{
    size_t bytes = in->count * in->width, got = read_block(in, bytes);
    char name[24];
    vg_err e;
    if (got == 0) return false;
    if (got < bytes)
        cli_stop(VG_ETRUNC, "%s%s%s ends within frame %llu: %zu bytes of %zu, which are %zu numbers of %zu bytes", in->quote,
                 in->shown, in->quote, (unsigned long long)in->frames, got, bytes, in->count, in->width);
    for (size_t i = 0; i < in->count; i++) {
        f->values[i] = load_number(in->room + i * in->width, in->width);
        if (!isfinite(f->values[i]))
            cli_stop(VG_EINPUT, "%s%s%s: number %zu of frame %llu is not finite", in->quote, in->shown, in->quote, i, (unsigned long long)in->frames);
    }
    snprintf(name, sizeof name, "%llu", (unsigned long long)in->frames++);
    if (vg_frame_rename(f, name, &e) < 0) cli_die(&e);
    return true;
}

void raw_close(raw_input *in)
{
    if (in->fd > STDIN_FILENO) close(in->fd);
    free(in->room);
}
