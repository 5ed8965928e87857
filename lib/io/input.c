/* input.c: bytes from a descriptor or from memory, with lookahead. Counts in the input are not trusted before the
 * bytes have arrived.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* Small reads go through a buffer of this size; larger ones directly to their destination. */
enum { BUFFER = 256 * 1024, AHEAD = 4096 };

/* Limits. A member of an archive is in memory as a whole, and as a mesh takes several times its size; the total
 * limits temporary files; all three limit the time. */
const vgi_limits vgi_usual_limits = {
    .member_bytes = (uint64_t)1 << 30, .total_bytes = (uint64_t)64 << 30, .members = (size_t)1 << 21};

struct vgi_input {
    int fd; /* -1: memory only */
    bool own, ended;
    bool known; /* a regular file or memory, whose size does not change */
    char *name;
    unsigned char *buffer;     /* NULL for memory */
    const unsigned char *data; /* bytes read but not yet taken */
    size_t size;
    vgi_limits limits;
};

static int make(vgi_input **in, const char *name, vg_err *e)
{
    *in = vgi_array(1, sizeof **in, e);
    if (!*in) return VG_ENOMEM;
    (*in)->fd = -1;
    (*in)->limits = vgi_usual_limits;
    (*in)->name = vgi_copy_string(name, strlen(name), e);
    if ((*in)->name) return VG_OK;
    vgi_input_free(in);
    return VG_ENOMEM;
}

int vgi_input_fd(vgi_input **in, int fd, bool own, const char *name, vg_err *e)
{
    int r = make(in, name, e);
    if (r == VG_OK && !((*in)->buffer = vgi_array_raw(BUFFER, 1, e))) vgi_input_free(in), r = VG_ENOMEM;
    if (r < 0) {
        if (own) close(fd);
        return r;
    }
    struct stat st;
    (*in)->fd = fd, (*in)->own = own, (*in)->data = (*in)->buffer;
    (*in)->known = fstat(fd, &st) == 0 && S_ISREG(st.st_mode);
    return VG_OK;
}

int vgi_input_memory(vgi_input **in, const void *data, size_t n, const char *name, vg_err *e)
{
    int r = make(in, name, e);
    if (r == VG_OK) (*in)->data = data, (*in)->size = n, (*in)->ended = (*in)->known = true;
    return r;
}

int vgi_input_file(vgi_input **in, const char *path, vg_err *e)
{
    *in = NULL;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return vg_fail(e, VG_ESYS, "cannot open '%s': %s", path, strerror(errno));
    return vgi_input_fd(in, fd, true, path, e);
}

void vgi_input_free(vgi_input **in)
{
    if (!*in) return;
    if ((*in)->own) close((*in)->fd);
    free((*in)->buffer);
    free((*in)->name);
    free(*in);
    *in = NULL;
}

const char *vgi_input_name(const vgi_input *in)
{
    return in->name;
}

const char *vgi_input_path(const vgi_input *in)
{
    return in->own ? in->name : NULL;
}

/* One read; 0 at the end. */
static ssize_t read_some(vgi_input *in, void *to, size_t n, vg_err *e)
{
    if (in->ended) return 0;
    ssize_t got;
    do got = read(in->fd, to, n);
    while (got < 0 && errno == EINTR);
    if (got < 0) return vg_fail(e, VG_ESYS, "cannot read '%s': %s", in->name, strerror(errno));
    if (got == 0) in->ended = true;
    return got;
}

int vgi_input_peek(vgi_input *in, size_t n, const unsigned char **data, size_t *got, vg_err *e)
{
    if (n > AHEAD) n = AHEAD;
    if (in->size < n && !in->ended) {
        memmove(in->buffer, in->data, in->size);
        in->data = in->buffer;
        while (in->size < n) {
            ssize_t more = read_some(in, in->buffer + in->size, BUFFER - in->size, e);
            if (more < 0) return (int)more;
            if (more == 0) break;
            in->size += (size_t)more;
        }
    }
    *data = in->data;
    *got = in->size < n ? in->size : n;
    return VG_OK;
}

const unsigned char *vgi_input_arrived(const vgi_input *in, size_t *n)
{
    *n = in->known || in->ended ? SIZE_MAX : in->size;
    return in->data;
}

int vgi_input_ended(vgi_input *in, vg_err *e)
{
    const unsigned char *data;
    size_t n;
    int r = vgi_input_peek(in, 1, &data, &n, e);
    return r < 0 ? r : n == 0;
}

static size_t take_buffered(vgi_input *in, void *to, size_t n)
{
    if (n > in->size) n = in->size;
    if (n) memcpy(to, in->data, n);
    in->data += n;
    in->size -= n;
    return n;
}

int vgi_input_read(vgi_input *in, void *to, size_t n, size_t *got, vg_err *e)
{
    unsigned char *p = to;
    size_t have = take_buffered(in, p, n);
    while (have < n) {
        ssize_t more;
        if (n - have >= BUFFER / 4 || !in->buffer) {
            more = read_some(in, p + have, n - have, e);
            if (more > 0) have += (size_t)more;
        } else {
            more = read_some(in, in->buffer, BUFFER, e);
            if (more > 0) {
                in->data = in->buffer, in->size = (size_t)more;
                have += take_buffered(in, p + have, n - have);
            }
        }
        if (got) *got = have;
        if (more < 0) return (int)more;
        if (more == 0) return vg_fail(e, VG_ETRUNC, "'%s' ends too early", in->name);
    }
    if (got) *got = have;
    return VG_OK;
}

int vgi_input_take(vgi_input *in, vg_bytes *b, size_t n, size_t *got, vg_err *e)
{
    size_t piece = 1u << 20, have = 0, some = 0;
    int r = VG_OK;
    while (r == VG_OK && have < n) {
        /* spare capacity of the buffer is free; beyond it, at most double what has arrived */
        size_t room = b->cap - b->size, step = room > piece ? room : piece;
        if (step > n - have) step = n - have;
        if ((r = vgi_bytes_reserve(b, b->size + step, e)) < 0) break;
        r = vgi_input_read(in, b->data + b->size, step, &some, e);
        b->size += some;
        have += some;
    }
    if (got) *got = have;
    return r;
}

void vgi_input_limit(vgi_input *in, const vgi_limits *limits)
{
    in->limits = *limits;
}

const vgi_limits *vgi_input_limits(const vgi_input *in)
{
    return &in->limits;
}

static int larger_than(const vgi_input *in, uint64_t most, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "'%s' holds more than %llu bytes: allow more with 'vg-encode --max-bytes'", in->name,
                   (unsigned long long)most);
}

int vgi_input_slurp(vgi_input *in, vg_bytes *b, vg_err *e)
{
    const uint64_t most = in->known ? UINT64_MAX : in->limits.member_bytes;
    int r = vgi_bytes_append(b, in->data, in->size, e);
    if (r < 0) return r;
    in->size = 0;
    while (b->size <= most) {
        if (in->ended) return VG_OK;
        if (b->cap - b->size < 64 * 1024 && (r = vgi_bytes_reserve(b, b->size + (1u << 20), e)) < 0) return r;
        ssize_t more = read_some(in, b->data + b->size, b->cap - b->size, e);
        if (more < 0) return (int)more;
        b->size += (size_t)more;
    }
    return larger_than(in, most, e);
}

/* ---- unnamed files ---- */

int vgi_input_spool(vgi_input *in, int *out, vg_err *e)
{
    const uint64_t most = in->known ? UINT64_MAX : in->limits.total_bytes;
    unsigned char *block = vgi_array_raw(BUFFER, 1, e);
    if (!block) return VG_ENOMEM;
    int fd = vgi_nameless_file(e), r = fd < 0 ? fd : VG_OK;
    uint64_t total = 0;
    while (r == VG_OK) {
        size_t got = 0;
        r = vgi_input_read(in, block, BUFFER, &got, e);
        bool end = r == VG_ETRUNC;
        if (r < 0 && !end) break;
        total += got;
        r = total > most ? larger_than(in, most, e) : vgi_write_all(fd, block, got, "temporary file", e);
        if (end) break;
    }
    free(block);
    if (r < 0 && fd >= 0) close(fd);
    else *out = fd;
    return r;
}
