/* names.c: lists of names, the order people expect of them, and the name a pose takes from its file.
 * Leaves out what a suffix means: format.c knows the mesh formats.
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

/* Where the name is in the table, or the free slot where it belongs. */
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

int vgi_name_set_add(vgi_name_set *set, const char *name, vg_err *e)
{
    int r = grow_slots(set, e);
    if (r < 0) return r;
    size_t slot = find_slot(set, name);
    if (set->slots[slot]) return 0;
    if ((r = vgi_names_add(&set->names, name, strlen(name), e)) < 0) return r;
    set->slots[slot] = set->names.n;
    return 1;
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

/* Compare the runs of digits at *a and *b by value and step over them. Any length: nothing is converted. */
static int compare_digits(const char **a, const char **b)
{
    while (**a == '0') ++*a;
    while (**b == '0') ++*b;
    const char *x = *a, *y = *b;
    while (is_digit(**a)) ++*a;
    while (is_digit(**b)) ++*b;
    size_t nx = (size_t)(*a - x), ny = (size_t)(*b - y);
    if (nx != ny) return nx < ny ? -1 : 1;
    return memcmp(x, y, nx);
}

int vgi_natural_compare(const char *a, const char *b)
{
    const char *p = a, *q = b;
    while (*p && *q) {
        if (is_digit(*p) && is_digit(*q)) {
            int order = compare_digits(&p, &q);
            if (order) return order;
        } else if (*p == *q) {
            p++, q++;
        } else {
            break;
        }
    }
    if (*p != *q) return (unsigned char)*p < (unsigned char)*q ? -1 : 1;
    return strcmp(a, b);
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
    if (!vgi_mul(n, 2, &twice)) twice = SIZE_MAX - 1; /* fails for want of memory below */
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
    char *utf8 = vgi_to_utf8(name, strlen(name), e); /* old archives and file systems have other names */
    free(name);
    return utf8;
}
