/* names.c: lists of names, their natural order, and the name of a pose. Suffixes of formats are in format.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>
#include <strings.h>

void vgi_names_clear(vgi_names *names)
{
    for (size_t i = 0; i < names->n; i++) free(names->at[i]);
    free(names->at);
    *names = (vgi_names){0};
}

int vgi_names_add(vgi_names *names, const char *s, size_t n, vg_err *e)
{
    int r = vgi_grow(&names->at, &names->cap, names->n + 1, sizeof *names->at, e);
    if (r < 0) return r;
    char *copy = vgi_copy_string(s, n, e);
    if (!copy) return VG_ENOMEM;
    names->at[names->n++] = copy;
    return VG_OK;
}

static size_t hash_name(const char *s)
{
    uint64_t h = 14695981039346656037u; /* FNV-1a */
    for (; *s; s++) h = (h ^ (unsigned char)*s) * 1099511628211u;
    return (size_t)(h ^ h >> 32);
}

/* The slot of the name in the table, or the free slot for it. */
static size_t find_slot(const vgi_name_set *set, const char *name)
{
    size_t i = hash_name(name) & (set->nslots - 1);
    while (set->slots[i] && strcmp(set->names.at[set->slots[i] - 1], name) != 0) i = (i + 1) & (set->nslots - 1);
    return i;
}

static int grow_slots(vgi_name_set *set, vg_err *e)
{
    if (2 * (set->names.n + 1) <= set->nslots) return VG_OK;
    size_t n = set->nslots ? 2 * set->nslots : 64, *slots = vgi_array(n, sizeof *slots, e);
    if (!slots) return VG_ENOMEM;
    free(set->slots);
    set->slots = slots, set->nslots = n;
    for (size_t i = 0; i < set->names.n; i++) set->slots[find_slot(set, set->names.at[i])] = i + 1;
    return VG_OK;
}

int vgi_name_set_place(vgi_name_set *set, const char *name, size_t *at, vg_err *e)
{
    int r = grow_slots(set, e);
    if (r < 0) return r;
    size_t slot = find_slot(set, name);
    if (!set->slots[slot] && (r = vgi_names_add(&set->names, name, strlen(name), e)) == VG_OK)
        set->slots[slot] = set->names.n;
    if (r == VG_OK) *at = set->slots[slot] - 1;
    return r;
}

int vgi_name_set_add(vgi_name_set *set, const char *name, vg_err *e)
{
    const size_t before = set->names.n;
    size_t at;
    int r = vgi_name_set_place(set, name, &at, e);
    return r < 0 ? r : set->names.n > before;
}

void vgi_name_set_clear(vgi_name_set *set)
{
    vgi_names_clear(&set->names);
    free(set->slots);
    *set = (vgi_name_set){0};
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* Names are compared as lists of characters and numbers. A number is a run of digits; followed by a point and digits
 * it is a decimal ("0.25"), unless another point and digits follow, as in a date or version ("1.2.10"), whose parts
 * are integers. It is negative after a '-' that is not a hyphen: at the start, or after one of `separators`. */
typedef struct token {
    int character; /* 0: end of the name; '0': a number */
    bool minus;
    const char *whole, *part; /* digits before and after the point, without leading and trailing zeros */
    size_t nwhole, npart;
} token;

static size_t count_digits(const char *s)
{
    size_t n = 0;
    while (is_digit(s[n])) n++;
    return n;
}

static bool is_minus(const char *start, const char *p)
{
    static const char separators[] = "_.@=~,:;/ ([{-+";
    return *p == '-' && is_digit(p[1]) && (p == start || strchr(separators, p[-1]));
}

/* Number of digits after the point of the number that starts at p and has n digits before it; 0 for an integer. */
static size_t count_decimals(const char *start, const char *p, size_t n)
{
    bool within = p - start >= 2 && p[-1] == '.' && is_digit(p[-2]);
    size_t decimals = p[n] == '.' ? count_digits(p + n + 1) : 0;
    const char *behind = p + n + 1 + decimals;
    return within || (decimals && *behind == '.' && is_digit(behind[1])) ? 0 : decimals;
}

/* The token at *p, which moves past it. */
static token next_token(const char *start, const char **p)
{
    token t = {.minus = is_minus(start, *p)};
    if (!t.minus && !is_digit(**p)) {
        t.character = (unsigned char)**p;
        if (t.character) ++*p;
        return t;
    }
    const char *digits = *p + t.minus;
    t.character = '0';
    t.nwhole = count_digits(digits), t.npart = count_decimals(start, digits, t.nwhole);
    t.whole = digits, t.part = digits + t.nwhole + 1;
    *p = t.npart ? t.part + t.npart : digits + t.nwhole;
    for (; t.nwhole && *t.whole == '0'; t.whole++) t.nwhole--;
    while (t.npart && t.part[t.npart - 1] == '0') t.npart--;
    t.minus = t.minus && t.nwhole + t.npart; /* zero has no sign */
    return t;
}

/* Compare absolute values of any length without converting them. */
static int compare_sizes(const token *a, const token *b)
{
    if (a->nwhole != b->nwhole) return a->nwhole < b->nwhole ? -1 : 1;
    int order = memcmp(a->whole, b->whole, a->nwhole);
    if (!order) order = memcmp(a->part, b->part, a->npart < b->npart ? a->npart : b->npart);
    return order ? order : (a->npart > b->npart) - (a->npart < b->npart);
}

static int compare_tokens(const token *a, const token *b)
{
    if (a->character != b->character || a->character != '0') return a->character - b->character;
    if (a->minus != b->minus) return a->minus ? -1 : 1;
    return a->minus ? compare_sizes(b, a) : compare_sizes(a, b);
}

int vgi_natural_compare(const char *a, const char *b)
{
    const char *p = a, *q = b;
    for (;;) {
        token x = next_token(a, &p), y = next_token(b, &q);
        int order = compare_tokens(&x, &y);
        if (order) return order;
        if (!x.character) return strcmp(a, b);
    }
}

static int compare_entries(const void *a, const void *b)
{
    return vgi_natural_compare(*(char *const *)a, *(char *const *)b);
}

void vgi_names_sort(vgi_names *names)
{
    if (names->n) qsort(names->at, names->n, sizeof *names->at, compare_entries);
}

const char *vgi_base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

bool vgi_has_suffix(const char *name, size_t n, const char *suffix)
{
    size_t s = strlen(suffix);
    return n > s && !strncasecmp(name + n - s, suffix, s);
}

size_t vgi_packed_stem(const char *name)
{
    static const char *const packed[] = {".gz", ".xz", ".zst", ".bz2", ".lz4", ".lz", ".lzma", ".z"};
    size_t n = strlen(name);
    for (size_t i = 0; i < sizeof packed / sizeof *packed; i++)
        if (vgi_has_suffix(name, n, packed[i])) return n - strlen(packed[i]);
    return n;
}

char *vgi_to_utf8(const char *s, size_t n, vg_err *e)
{
    size_t twice;
    if (vgi_is_utf8(s, n)) return vgi_copy_string(s, n, e);
    if (!vgi_mul(n, 2, &twice)) twice = SIZE_MAX - 1; /* the allocation below fails */
    char *out = vgi_array_raw(twice + 1, 1, e), *to = out;
    if (!out) return NULL;
    for (size_t i = 0; i < n; i++) {
        unsigned char c = s[i] ? (unsigned char)s[i] : '?';
        if (c < 0x80) {
            *to++ = (char)c;
        } else {
            *to++ = (char)(0xc0 | c >> 6);
            *to++ = (char)(0x80 | (c & 0x3f));
        }
    }
    *to = 0;
    return out;
}

char *vgi_pose_name(const char *path, vg_err *e)
{
    const char *base = vgi_base_name(path);
    char *name = vgi_copy_string(base, vgi_packed_stem(base), e);
    if (!name) return NULL;
    const vgi_format *format = vgi_format_by_suffix(name);
    const vgi_sequence_format *sequence = format ? NULL : vgi_sequence_by_suffix(name);
    if (format) name[strlen(name) - strlen(format->suffix)] = 0;
    if (sequence) name[strlen(name) - strlen(sequence->suffix)] = 0;
    char *utf8 = vgi_to_utf8(name, strlen(name), e); /* old archives and file systems use other encodings */
    free(name);
    return utf8;
}
