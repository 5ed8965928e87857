/* take.c: parses which frames of a sequence are wanted, as numbers and ranges.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "take.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

static const uint64_t most = UINT64_MAX / 4; /* so that sums cannot overflow */

/* parse digits; NULL: there are none, or too many */
static const char *take_number(const char *p, uint64_t *x)
{
    const char *start = p;
    for (*x = 0; *p >= '0' && *p <= '9'; p++) {
        *x = 10 * *x + (uint64_t)(*p - '0');
        if (*x > most) return NULL;
    }
    return p == start ? NULL : p;
}

/* "7", "7-9" or "7-"; the last two may end in "/2" */
static const char *take_one(const char *p, take_range *r)
{
    p = take_number(p, &r->first);
    r->last = r->first, r->step = 1;
    if (!p || *p != '-') return p;
    r->last = UINT64_MAX;
    if (*++p >= '0' && *p <= '9') p = take_number(p, &r->last);
    if (p && *p == '/') p = take_number(p + 1, &r->step);
    return r->step && r->last >= r->first ? p : NULL;
}

void take_parse(const char *text, void *list)
{
    take_list *t = list;
    free(t->range);
    t->n = 0;
    t->range = cli_allocate(strlen(text) / 2 + 1, sizeof *t->range, "a list of frames");
    for (const char *p = text;; p++) {
        take_range *r = &t->range[t->n];
        p = take_one(p, r);
        if (!p || (*p && *p != ',') || (t->n && r[-1].last >= r->first))
            cli_usage("option '--take' needs frames like 3,10-20,30-/2, counted from 0 and ascending, not '%s'", text);
        t->n++;
        if (!*p) return;
    }
}

bool take_wants(take_list *t, uint64_t frame)
{
    if (!t->n) return true;
    while (t->at < t->n && frame > t->range[t->at].last) t->at++;
    if (t->at == t->n || frame < t->range[t->at].first) return false;
    return (frame - t->range[t->at].first) % t->range[t->at].step == 0;
}

void take_end(const take_list *t, uint64_t frames)
{
    if (!t->n) return;
    const take_range *r = &t->range[t->n - 1];
    uint64_t asked = r->last == UINT64_MAX ? r->first : r->last;
    if (asked >= frames)
        cli_stop(VG_EINPUT, "option '--take' asks for frame %" PRIu64 ", but there are %" PRIu64 ", counted from 0",
                 asked, frames);
}
