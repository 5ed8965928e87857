/* signal_page.c: a signal inside a page that edits it: large arrays packed, everything else as JSON. The page around
 * it is in page.c; the browser evaluates it in signal_math.js.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/curve.h"
#include "view/page.h"

#include "io/io.h"

/* Binary64 numbers as pairs of words, the lower one first. */
static int put_doubles(vg_page *p, const char *what, const double *x, size_t n, vg_err *e)
{
    size_t count;
    if (!vgi_mul(n, 2, &count)) return vg_fail(e, VG_ENOMEM, "not enough memory for the signal in the page");
    uint32_t *words = vgi_array_raw(count, sizeof *words, e);
    if (!words) return VG_ENOMEM;
    for (size_t i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, x + i, sizeof bits);
        words[2 * i] = (uint32_t)bits;
        words[2 * i + 1] = (uint32_t)(bits >> 32);
    }
    int r = vgi_page_list(p, 0, what, words, count, false, e);
    free(words);
    return r;
}

/* The int16 numbers of the basis, grouped by number of the shape. */
static void gather_short(const vg_signal *s, uint32_t *words)
{
    size_t m = s->m, d = s->d;
    memset(words, 0, (m * d + 1) / 2 * sizeof *words);
    for (size_t j = 0; j < m; j++)
        for (size_t c = 0; c < d; c++) {
            const uint8_t *from = s->basis_short + 2 * (j * d + c);
            size_t at = c * m + j;
            words[at / 2] |= (uint32_t)(from[0] | from[1] << 8) << 16 * (at & 1);
        }
}

/* The same in binary32. h: workspace of d numbers. */
static void gather_single(const vg_signal *s, double *h, uint32_t *words)
{
    for (size_t j = 0; j < s->m; j++) {
        vgi_signal_vector(s, j, h);
        for (size_t c = 0; c < s->d; c++) {
            float x = (float)h[c];
            memcpy(words + c * s->m + j, &x, sizeof x);
        }
    }
}

static int put_basis(vg_page *p, const vg_signal *s, vg_err *e)
{
    size_t count;
    if (!vgi_mul(s->m, s->d, &count)) return vg_fail(e, VG_ENOMEM, "not enough memory for the signal in the page");
    uint32_t *words = vgi_array_raw(count, sizeof *words, e);
    double *h = vgi_array_raw(s->d, sizeof *h, e);
    int r = words && h ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        if (s->bits == 16) gather_short(s, words), count = (count + 1) / 2;
        else gather_single(s, h, words);
        r = vgi_page_list(p, 0, "basis", words, count, false, e);
    }
    free(words);
    free(h);
    return r;
}

int vgi_signal_page_lists(vg_page *p, const vg_signal *s, vg_err *e)
{
    int r = put_doubles(p, "mean", s->mean, s->d, e);
    if (r == VG_OK) r = put_doubles(p, "coordinate", s->coordinate, s->n * s->m, e);
    return r == VG_OK ? put_basis(p, s, e) : r;
}

/* Frames, counted from 0. */
static int json_sites(vg_bytes *b, const vg_signal *s, vg_err *e)
{
    vg_bytes list = {0};
    int r = VG_OK;
    for (size_t i = 0; i < s->l && r == VG_OK; i++) {
        r = vgi_page_next(&list, e);
        if (r == VG_OK) r = vgi_page_number(&list, s->site[i], e);
    }
    if (r == VG_OK) r = vgi_page_field_list(b, "site", &list, e);
    vg_bytes_clear(&list);
    return r;
}

int vgi_signal_page_facts(vg_bytes *b, const vg_signal *s, vg_err *e)
{
    int r = vgi_page_field(b, "signal", e);
    if (r == VG_OK) r = vgi_page_raw(b, "{", e);
    if (r == VG_OK) r = vgi_page_field_number(b, "n", (double)s->n, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "m", (double)s->m, e);
    if (r == VG_OK) r = vgi_page_field_number(b, "bits", (double)s->bits, e);
    if (r == VG_OK) r = vgi_page_field_flag(b, "examples", s->examples, e);
    if (r == VG_OK && s->bits == 16) r = vgi_page_field_numbers(b, "unit", s->basis_unit, s->m, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "position", s->position, 2 * s->n, e);
    if (r == VG_OK) r = json_sites(b, s, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "parameter", s->parameter, s->n, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "knot", s->knot, s->k + 2, e);
    if (r == VG_OK) r = vgi_page_field_numbers(b, "control", s->control, 2 * s->k, e);
    if (r == VG_OK && s->rooted) r = vgi_page_field_numbers(b, "turn", s->turn, 4 * s->n, e);
    if (r == VG_OK && s->rooted) r = vgi_page_field_numbers(b, "shift", s->shift, 3 * s->n, e);
    return r == VG_OK ? vgi_page_raw(b, "}", e) : r;
}
