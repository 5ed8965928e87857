/* record.c: reads and writes the bytes of the stream's file header, records and END mark (fmt/STREAM.md). Payloads
 * are in payload.c, the order of records in stream.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/record.h"

#include <errno.h>
#include <stdlib.h>
#include <sys/uio.h>
#include <time.h>
#include <xxhash.h>

enum { FILE_HEADER = 16, RECORD_HEADER = 32, MINOR = 0, END_PAYLOAD = 16, MOST_PARTS = 3 };
static const uint64_t longest_payload = (uint64_t)1 << 40;
static const uint32_t reserved_flags = 0xfffc;
static const unsigned char magic[8] = {0x89, 'V', 'G', 'S', '\r', '\n', 0x1a, '1'};

bool vgi_is_stream(const unsigned char *data, size_t n)
{
    return n >= 4 && !memcmp(data, magic, 4);
}

int vgi_tally_init(vgi_tally *t, vg_err *e)
{
    t->records = 0;
    t->sum = XXH64_createState();
    if (!t->sum) return vg_fail(e, VG_ENOMEM, "not enough memory for a checksum");
    XXH64_reset(t->sum, 0);
    return VG_OK;
}

void vgi_tally_clear(vgi_tally *t)
{
    XXH64_freeState(t->sum);
    t->sum = NULL;
}

static void tally(vgi_tally *t, const unsigned char header[RECORD_HEADER])
{
    t->records++;
    XXH64_update(t->sum, header + 24, 8);
}

/* ---- reading ---- */

int vgi_record_begin_read(vgi_input *in, vg_err *e)
{
    const char *name = vgi_input_name(in);
    unsigned char h[FILE_HEADER];
    size_t got = 0;
    int r = vgi_input_read(in, h, sizeof h, &got, e);
    if (r == VG_ETRUNC && got == 0)
        return vg_fail(e, VG_ETRUNC, "'%s' is empty: did the program before it fail?", name);
    if (got >= 4 && memcmp(h, magic, 4)) return vg_fail(e, VG_EINPUT, "'%s' is not a vg stream", name);
    if (got >= 7 && memcmp(h, magic, 7))
        return vg_fail(e, VG_EINPUT, "'%s' was damaged by a transfer that changes line ends", name);
    if (r < 0) return r == VG_ETRUNC ? vg_fail(e, r, "'%s' ends inside the stream's first 16 bytes", name) : r;
    if (h[7] != magic[7])
        return vg_fail(e, VG_EINPUT, "'%s' is a stream of major version '%c': this program reads version 1", name,
                       h[7]);
    if (vgi_get32(h + 12)) return vg_fail(e, VG_EINPUT, "'%s': reserved bytes of the file header are not zero", name);
    return VG_OK;
}

static bool is_tag(const unsigned char *t)
{
    for (int i = 0; i < 4; i++)
        if (!((t[i] >= 'A' && t[i] <= 'Z') || (t[i] >= '0' && t[i] <= '9') || t[i] == ' ')) return false;
    return true;
}

static int cut_short(const char *name, const vgi_tally *t, const char *where, vg_err *e)
{
    return vg_fail(e, VG_ETRUNC, "'%s' is cut short: it ends %s %llu, without the END mark", name, where,
                   (unsigned long long)t->records);
}

static int check_end(vgi_input *in, const vgi_tally *t, const vg_record *record, vg_err *e)
{
    const char *name = vgi_input_name(in);
    if (record->payload.size != END_PAYLOAD) return vg_fail(e, VG_EINPUT, "'%s': the END record has a wrong length", name);
    uint64_t count = vgi_get64(record->payload.data);
    if (count != t->records)
        return vg_fail(e, VG_EINPUT, "'%s': the END mark states %llu records, but there were %llu", name,
                       (unsigned long long)count, (unsigned long long)t->records);
    if (vgi_get64(record->payload.data + 8) != XXH64_digest(t->sum))
        return vg_fail(e, VG_EINPUT, "'%s': the END mark's checksum is wrong: records were changed or moved", name);
    int ended = vgi_input_ended(in, e);
    if (ended != 0) return ended < 0 ? ended : 0;
    return vg_fail(e, VG_EINPUT, "'%s' has data after the END mark: join streams with vg-encode, not cat", name);
}

int vgi_record_read(vgi_input *in, vgi_tally *t, vg_record *record, vg_err *e)
{
    const char *name = vgi_input_name(in);
    unsigned char h[RECORD_HEADER], padding[8];
    size_t got = 0;
    int r = vgi_input_read(in, h, sizeof h, &got, e);
    if (r == VG_ETRUNC)
        return got ? cut_short(name, t, "inside the header of record", e) : cut_short(name, t, "before record", e);
    if (r < 0) return r;
    unsigned long long index = t->records;
    if (vgi_get64(h + 24) != XXH64(h, 24, 0))
        return vg_fail(e, VG_EINPUT, "'%s': the header of record %llu is damaged (checksum)", name, index);
    if (!is_tag(h)) return vg_fail(e, VG_EINPUT, "'%s': the tag of record %llu is malformed", name, index);
    memcpy(record->tag, h, 4);
    record->tag[4] = 0;
    record->flags = vgi_get32(h + 4);
    uint64_t length = vgi_get64(h + 8);
    if (record->flags & reserved_flags)
        return vg_fail(e, VG_EINPUT, "'%s': record %llu (%s) has reserved flags set", name, index, record->tag);
    if (length > longest_payload)
        return vg_fail(e, VG_EINPUT, "'%s': record %llu (%s) claims %llu bytes", name, index, record->tag,
                       (unsigned long long)length);

    record->payload.size = 0;
    r = vgi_input_take(in, &record->payload, (size_t)length, NULL, e);
    if (r == VG_OK) r = vgi_input_read(in, padding, (size_t)(-length & 7), NULL, e);
    if (r == VG_ETRUNC) return cut_short(name, t, "inside record", e);
    if (r < 0) return r;
    for (size_t i = 0; i < (size_t)(-length & 7); i++)
        if (padding[i])
            return vg_fail(e, VG_EINPUT, "'%s': the padding of record %llu (%s) is not zero", name, index, record->tag);
    if (vgi_get64(h + 16) != XXH64(record->payload.data, (size_t)length, 0))
        return vg_fail(e, VG_EINPUT, "'%s': record %llu (%s) is damaged (checksum)", name, index, record->tag);
    if (!strcmp(record->tag, "END ")) return check_end(in, t, record, e);
    tally(t, h);
    return 1;
}

bool vgi_record_may_wait(const vgi_input *in)
{
    size_t have;
    const unsigned char *h = vgi_input_arrived(in, &have);
    if (have == SIZE_MAX) return false;
    if (have < RECORD_HEADER || memcmp(h, "FRAM", 4)) return true;
    uint64_t length = vgi_get64(h + 8);
    return length > have - RECORD_HEADER || have - RECORD_HEADER - length < (-length & 7);
}

/* ---- writing ---- */

enum {
    PIECE = 256 * 1024,  /* bytes written at a time; a record of more than a quarter of it is not copied */
    SLOWLY = 1000 * 1000 /* ns between two records */
};

static int64_t now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* Append to what waits, which has room. */
static void hold(vgi_recorder *w, const void *data, size_t n)
{
    if (n) memcpy(w->waiting + w->nwaiting, data, n);
    w->nwaiting += n;
}

int vgi_recorder_init(vgi_recorder *w, int fd, const char *name, vg_err *e)
{
    unsigned char h[FILE_HEADER] = {0};
    *w = (vgi_recorder){.fd = fd, .name = name};
    if (!(w->waiting = vgi_array_raw(PIECE, 1, e))) return VG_ENOMEM;
    int r = vgi_tally_init(&w->tally, e);
    if (r < 0) {
        vgi_recorder_clear(w);
        return r;
    }
    memcpy(h, magic, sizeof magic);
    vgi_put32(h + 8, MINOR);
    hold(w, h, sizeof h);
    return VG_OK;
}

void vgi_recorder_clear(vgi_recorder *w)
{
    if (w->tally.sum) vgi_tally_clear(&w->tally);
    free(w->waiting);
    *w = (vgi_recorder){.fd = -1};
}

static int write_vector(vgi_recorder *w, struct iovec *v, int n, vg_err *e)
{
    w->failed = true;
    w->nwaiting = 0;
    while (n > 0) {
        ssize_t done = writev(w->fd, v, n);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return vg_fail(e, VG_ESYS, "cannot write to '%s': %s", w->name, strerror(errno));
        while (n > 0 && (size_t)done >= v->iov_len) done -= (ssize_t)v->iov_len, v++, n--;
        if (n > 0) v->iov_base = (char *)v->iov_base + done, v->iov_len -= (size_t)done;
    }
    w->failed = false;
    return VG_OK;
}

int vgi_recorder_flush(vgi_recorder *w, vg_err *e)
{
    return w->nwaiting ? write_vector(w, &(struct iovec){w->waiting, w->nwaiting}, 1, e) : VG_OK;
}

/* Write or collect the n parts of a record. */
static int put_parts(vgi_recorder *w, struct iovec *v, int n, vg_err *e)
{
    uint64_t size = 0;
    for (int i = 1; i < n; i++) size += v[i].iov_len;
    if (size > PIECE / 4) {
        v[0] = (struct iovec){w->waiting, w->nwaiting};
        return write_vector(w, v, n, e);
    }
    int r = w->nwaiting + size > PIECE ? vgi_recorder_flush(w, e) : VG_OK;
    if (r < 0) return r;
    for (int i = 1; i < n; i++) hold(w, v[i].iov_base, v[i].iov_len);
    int64_t last = w->last;
    w->last = now();
    return w->last - last > SLOWLY ? vgi_recorder_flush(w, e) : VG_OK;
}

static int checksum(const vgi_part *parts, size_t nparts, uint64_t *sum, vg_err *e)
{
    if (nparts == 1) {
        *sum = XXH64(parts[0].data, parts[0].size, 0);
        return VG_OK;
    }
    XXH64_state_t *s = XXH64_createState();
    if (!s) return vg_fail(e, VG_ENOMEM, "not enough memory for a checksum");
    XXH64_reset(s, 0);
    for (size_t i = 0; i < nparts; i++)
        if (parts[i].size) XXH64_update(s, parts[i].data, parts[i].size);
    *sum = XXH64_digest(s);
    XXH64_freeState(s);
    return VG_OK;
}

int vgi_record_write(vgi_recorder *w, const char *tag, uint32_t flags, const vgi_part *parts, size_t nparts, vg_err *e)
{
    static const unsigned char zeros[8];
    unsigned char h[RECORD_HEADER];
    struct iovec v[MOST_PARTS + 3] = {{0}}; /* the first is for what waits */
    int n = 1;
    uint64_t length = 0, sum = 0;
    for (size_t i = 0; i < nparts; i++) length += parts[i].size;
    if (length > longest_payload)
        return vg_fail(e, VG_EARG, "a %s record of %llu bytes is too large for a stream", tag,
                       (unsigned long long)length);
    int r = checksum(parts, nparts, &sum, e);
    if (r < 0) return r;
    memcpy(h, tag, 4);
    vgi_put32(h + 4, flags);
    vgi_put64(h + 8, length);
    vgi_put64(h + 16, sum);
    vgi_put64(h + 24, XXH64(h, 24, 0));
    tally(&w->tally, h);
    v[n++] = (struct iovec){h, sizeof h};
    for (size_t i = 0; i < nparts; i++)
        if (parts[i].size) v[n++] = (struct iovec){(void *)parts[i].data, parts[i].size};
    if (length & 7) v[n++] = (struct iovec){(void *)zeros, (size_t)(-length & 7)};
    return put_parts(w, v, n, e);
}

int vgi_record_end_write(vgi_recorder *w, vg_err *e)
{
    unsigned char payload[END_PAYLOAD];
    vgi_put64(payload, w->tally.records);
    vgi_put64(payload + 8, XXH64_digest(w->tally.sum));
    vgi_part part = {payload, sizeof payload};
    int r = vgi_record_write(w, "END ", VGI_CRITICAL, &part, 1, e);
    return r < 0 ? r : vgi_recorder_flush(w, e);
}
