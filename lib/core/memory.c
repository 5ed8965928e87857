/* memory.c: checked allocation, growing byte arrays, validation of UTF-8. Finite numbers are tested in
 * numbers_kernel.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/numbers_kernel.h"

#include <stdlib.h>

bool vgi_mul(size_t a, size_t b, size_t *product)
{
    return !__builtin_mul_overflow(a, b, product);
}

static void *no_memory(size_t n, size_t size, vg_err *e)
{
    vg_fail(e, VG_ENOMEM, "not enough memory for %zu elements of %zu bytes", n, size);
    return NULL;
}

void *vgi_array(size_t n, size_t size, vg_err *e)
{
    void *p = calloc(n ? n : 1, size);
    return p ? p : no_memory(n, size, e);
}

void *vgi_array_raw(size_t n, size_t size, vg_err *e)
{
    size_t bytes;
    void *p = vgi_mul(n ? n : 1, size, &bytes) ? malloc(bytes) : NULL;
    return p ? p : no_memory(n, size, e);
}

void *vgi_copy_array(const void *from, size_t n, size_t size, vg_err *e)
{
    void *p = vgi_array_raw(n, size, e);
    if (p && n) memcpy(p, from, n * size);
    return p;
}

char *vgi_copy_string(const char *s, size_t n, vg_err *e)
{
    char *p = vgi_array_raw(n + 1, 1, e);
    if (!p) return NULL;
    if (n) memcpy(p, s, n);
    p[n] = 0;
    return p;
}

int vgi_grow(void *array_address, size_t *cap, size_t need, size_t size, vg_err *e)
{
    void **array = array_address;
    if (need <= *cap && *array) return VG_OK;
    size_t want = *cap > SIZE_MAX / 2 ? need : *cap * 2, bytes;
    if (want < need) want = need;
    if (want == 0) want = 1;
    void *p = vgi_mul(want, size, &bytes) ? realloc(*array, bytes) : NULL;
    if (!p) {
        no_memory(want, size, e);
        return VG_ENOMEM;
    }
    *array = p;
    *cap = want;
    return VG_OK;
}

int vgi_bytes_reserve(vg_bytes *b, size_t cap, vg_err *e)
{
    return vgi_grow(&b->data, &b->cap, cap, 1, e);
}

int vgi_bytes_append(vg_bytes *b, const void *data, size_t n, vg_err *e)
{
    if (n > SIZE_MAX - b->size) return no_memory(n, 1, e), VG_ENOMEM;
    int r = vgi_bytes_reserve(b, b->size + n, e);
    if (r < 0) return r;
    if (n) memcpy(b->data + b->size, data, n);
    b->size += n;
    return VG_OK;
}

void vg_bytes_clear(vg_bytes *b)
{
    free(b->data);
    *b = (vg_bytes){0};
}

bool vgi_is_utf8(const char *s, size_t n)
{
    const unsigned char *p = (const unsigned char *)s, *end = p + n;
    while (p < end) {
        unsigned c = *p++;
        if (c == 0) return false;
        if (c < 0x80) continue;
        int more = c >= 0xf0 ? 3 : c >= 0xe0 ? 2 : 1;
        if (c < 0xc2 || c > 0xf4 || end - p < more) return false;
        unsigned code = c & (0x3fu >> more);
        for (int i = 0; i < more; i++, p++) {
            if ((*p & 0xc0) != 0x80) return false;
            code = code << 6 | (*p & 0x3fu);
        }
        if ((more == 2 && code < 0x800) || (more == 3 && code < 0x10000) || code > 0x10ffff ||
            (code >= 0xd800 && code <= 0xdfff))
            return false;
    }
    return true;
}

bool vgi_finite(const double *x, size_t n)
{
    return vgi_numbers_kernel_now()->finite(x, n);
}
