/* lines.c: text with one item per line and fields separated by blanks, as people write markers and skeletons by hand.
 * Fields are interpreted in markers.c and skeleton_text.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

enum { SHOWN = 40 }; /* length of a field in messages */

vgi_lines vgi_lines_of(const void *data, size_t n, const char *subject)
{
    size_t mark = n ? vgi_mark_bytes(data, n) : 0;
    return (vgi_lines){.at = n ? (const char *)data + mark : data, .end = n ? (const char *)data + n : data,
                       .subject = subject};
}

const char *vgi_quote(const char *name, char subject[VGI_SUBJECT])
{
    snprintf(subject, VGI_SUBJECT, "'%.200s'", name);
    return subject;
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == ';';
}

size_t vgi_line_number_of(const char *data, const char *end, const char *p)
{
    size_t n = 1;
    for (const char *q = data; q < p; q++) n += *q == '\n' || (*q == '\r' && (q + 1 == end || q[1] != '\n'));
    return n;
}

bool vgi_line_more(const vgi_line *l, const char **at, vgi_field *f)
{
    const char *p = *at;
    while (p < l->end && is_blank(*p)) p++;
    const char *begin = p;
    if (p < l->end && *p != '#') /* not inside a word: Windows writes NaN as "-1.#IND" */
        while (p < l->end && !is_blank(*p)) p++;
    *f = (vgi_field){begin, p};
    *at = p;
    return p > begin;
}

bool vgi_lines_next(vgi_lines *t, vgi_line *l)
{
    while (t->at < t->end) {
        const char *begin = t->at, *end = memchr(begin, '\n', (size_t)(t->end - begin));
        if (!end) end = t->end;
        t->at = end < t->end ? end + 1 : end;
        *l = (vgi_line){.number = ++t->number, .begin = begin, .end = end};
        vgi_field f;
        for (const char *p = begin; vgi_line_more(l, &p, &f); l->n++)
            if (l->n < VGI_FIELDS) l->at[l->n] = f;
        if (l->n) return true;
    }
    return false;
}

bool vgi_field_is(const vgi_field *f, const char *word)
{
    size_t n = strlen(word);
    return (size_t)(f->end - f->begin) == n && !memcmp(f->begin, word, n);
}

bool vgi_field_number(const vgi_field *f, double *x)
{
    return vgi_parse_double(f->begin, f->end, x) == f->end && vgi_finite(x, 1);
}

static int shown_length(const vgi_field *f)
{
    return f->end - f->begin < SHOWN ? (int)(f->end - f->begin) : SHOWN;
}

int vgi_field_vertex(const vgi_lines *t, const vgi_line *l, const vgi_field *f, int base, uint32_t *vertex, vg_err *e)
{
    int64_t x;
    if (vgi_parse_int(f->begin, f->end, &x) != f->end)
        return vg_fail(e, VG_EINPUT, "%s line %zu: '%.*s' is not a vertex number", t->subject, l->number, shown_length(f),
                       f->begin);
    if (x < base || x - base >= UINT32_MAX)
        return vg_fail(e, VG_EINPUT, "%s line %zu: there is no vertex %lld: vertices are counted from %d", t->subject,
                       l->number, (long long)x, base);
    *vertex = (uint32_t)(x - base);
    return VG_OK;
}

int vgi_line_vertex(const vgi_lines *t, const vgi_line *l, size_t field, int base, uint32_t *vertex, vg_err *e)
{
    return vgi_field_vertex(t, l, &l->at[field], base, vertex, e);
}

int vgi_line_number(const vgi_lines *t, const vgi_line *l, size_t field, double *x, vg_err *e)
{
    const vgi_field *f = &l->at[field];
    if (vgi_field_number(f, x)) return VG_OK;
    return vg_fail(e, VG_EINPUT, "%s line %zu: '%.*s' is not a number", t->subject, l->number, shown_length(f), f->begin);
}

int vgi_line_name(const vgi_lines *t, const vgi_line *l, size_t field, char **name, vg_err *e)
{
    const vgi_field *f = &l->at[field];
    size_t n = (size_t)(f->end - f->begin);
    *name = NULL;
    if (!vgi_is_utf8(f->begin, n))
        return vg_fail(e, VG_EINPUT, "%s line %zu: the name is not UTF-8", t->subject, l->number);
    return (*name = vgi_copy_string(f->begin, n, e)) ? VG_OK : VG_ENOMEM;
}
