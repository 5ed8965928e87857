/* plain.c: text files as plain UTF-8: removes a byte order mark and converts UTF-16, which Windows programs call
 * "Unicode". Text in other encodings is not changed, because only names are affected (vgi_to_utf8).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

enum { LATIN = 0x80 };

static uint32_t unit_at(const unsigned char *p, bool big)
{
    return big ? (uint32_t)p[0] << 8 | p[1] : (uint32_t)p[1] << 8 | p[0];
}

/* A binary file may begin with the same two bytes; in text an ASCII character follows the mark. */
static bool is_utf16(const unsigned char *data, size_t n, bool *big)
{
    if (n < 4) return false;
    *big = data[0] == 0xfe && data[1] == 0xff;
    if (!*big && !(data[0] == 0xff && data[1] == 0xfe)) return false;
    uint32_t c = unit_at(data + 2, *big);
    return c == '\t' || c == '\n' || c == '\r' || (c >= ' ' && c < LATIN);
}

size_t vgi_mark_bytes(const void *data, size_t n)
{
    enum { START = 84 }; /* a binary STL may begin so, but contains a zero in its first bytes */
    bool marked = n >= 3 && !memcmp(data, "\xef\xbb\xbf", 3);
    return marked && !memchr(data, 0, n < START ? n : START) ? 3 : 0;
}

int vgi_append_letter(vg_bytes *to, uint32_t c, vg_err *e)
{
    unsigned char s[4];
    size_t n = c < 0x80 ? 1 : c < 0x800 ? 2 : c < 0x10000 ? 3 : 4;
    static const unsigned char lead[5] = {0, 0, 0xc0, 0xe0, 0xf0};
    for (size_t k = n; k-- > 1; c >>= 6) s[k] = (unsigned char)(0x80 | (c & 0x3f));
    s[0] = (unsigned char)(lead[n] | c);
    return vgi_bytes_append(to, s, n, e);
}

static int from_utf16(vg_bytes *to, const unsigned char *data, size_t n, bool big, vg_err *e)
{
    int r = vgi_bytes_reserve(to, n / 2, e);
    for (size_t i = 2; i + 1 < n && r == VG_OK; i += 2) {
        uint32_t c = unit_at(data + i, big), low = i + 3 < n ? unit_at(data + i + 2, big) : 0;
        if (c >= 0xd800 && c < 0xdc00 && low >= 0xdc00 && low < 0xe000) {
            c = 0x10000 + ((c - 0xd800) << 10) + (low - 0xdc00);
            i += 2;
        } else if (c >= 0xd800 && c < 0xe000) {
            c = '?';
        }
        r = vgi_append_letter(to, c, e);
    }
    return r;
}

int vgi_plain_text(vg_bytes *own, const unsigned char **data, size_t *n, vg_err *e)
{
    bool big = false;
    size_t mark = vgi_mark_bytes(*data, *n);
    if (mark) {
        *data += mark, *n -= mark;
        return VG_OK;
    }
    if (!is_utf16(*data, *n, &big)) return VG_OK;
    int r = from_utf16(own, *data, *n, big, e);
    *data = own->data, *n = own->size;
    return r;
}

int vgi_input_slurp_text(vgi_input *in, vg_bytes *b, vg_err *e)
{
    vg_bytes own = {0};
    int r = vgi_input_slurp(in, b, e);
    const unsigned char *data = b->data;
    size_t n = b->size;
    if (r == VG_OK && n) r = vgi_plain_text(&own, &data, &n, e);
    if (r == VG_OK && own.data) {
        vg_bytes_clear(b);
        *b = own;
        return VG_OK;
    }
    if (r == VG_OK && data != b->data) memmove(b->data, data, n);
    if (r == VG_OK) b->size = n;
    vg_bytes_clear(&own);
    return r;
}
