/* mend.h: right checksums for a stream that is being fuzzed, since no search finds a checksum by itself.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FUZZ_MEND_H
#define VG_FUZZ_MEND_H

#include "core/core.h"

#include <stdlib.h>
#include <xxhash.h>

enum { FILE_HEADER = 16, RECORD_HEADER = 32 };

static void demand(bool holds)
{
    if (!holds) abort();
}

static void mend_end(unsigned char *payload, uint64_t records, XXH64_state_t *running)
{
    vgi_put64(payload, records);
    vgi_put64(payload + 8, XXH64_digest(running));
}

/* Make the checksums of all records that are there right, and count and sum of END.
 * What else is wrong stays wrong. */
static void mend(unsigned char *p, size_t size)
{
    XXH64_state_t *running = XXH64_createState();
    uint64_t records = 0;
    demand(running != NULL);
    XXH64_reset(running, 0);
    for (size_t at = FILE_HEADER; size >= RECORD_HEADER && at <= size - RECORD_HEADER; records++) {
        unsigned char *h = p + at, *payload = h + RECORD_HEADER;
        size_t rest = size - at - RECORD_HEADER;
        uint64_t length = vgi_get64(h + 8);
        if (length <= rest) {
            if (!memcmp(h, "END ", 4) && length == 16) mend_end(payload, records, running);
            vgi_put64(h + 16, XXH64(payload, (size_t)length, 0));
        }
        vgi_put64(h + 24, XXH64(h, 24, 0));
        XXH64_update(running, h + 24, 8);
        uint64_t padded = (length + 7) & ~(uint64_t)7;
        if (length > rest || padded > rest) break;
        memset(payload + length, 0, (size_t)(padded - length));
        at += RECORD_HEADER + (size_t)padded;
    }
    XXH64_freeState(running);
}

#endif
