/* page_json.c: escapes text for HTML, and for JSON inside a script element.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/page.h"

#include "io/io.h"

#include <math.h>
#include <stdio.h>

/* In text that is not UTF-8, such as some file names, every byte beyond ASCII becomes '?'. */
static char shown_character(char c, bool utf8)
{
    return (unsigned char)c >= 0x80 && !utf8 ? '?' : c;
}

int vgi_page_escape(vg_bytes *b, const char *text, vg_err *e)
{
    bool utf8 = vgi_is_utf8(text, strlen(text));
    int r = VG_OK;
    for (; *text && r == VG_OK; text++) {
        char c = shown_character(*text, utf8);
        switch (c) {
        case '<': r = vgi_page_raw(b, "&lt;", e); break;
        case '>': r = vgi_page_raw(b, "&gt;", e); break;
        case '&': r = vgi_page_raw(b, "&amp;", e); break;
        case '"': r = vgi_page_raw(b, "&quot;", e); break;
        default: r = vgi_bytes_append(b, &c, 1, e);
        }
    }
    return r;
}

int vgi_page_string(vg_bytes *b, const char *text, vg_err *e)
{
    int r = vgi_bytes_append(b, "\"", 1, e);
    bool utf8 = vgi_is_utf8(text, strlen(text));
    for (const char *c = text; *c && r == VG_OK; c++) {
        char code[8], one = shown_character(*c, utf8);
        unsigned char u = (unsigned char)one;
        if (u < 0x20 || u == '"' || u == '\\' || u == '<' || u == 0x7f) {
            snprintf(code, sizeof code, "\\u%04x", u);
            r = vgi_bytes_append(b, code, 6, e);
        } else {
            r = vgi_bytes_append(b, &one, 1, e);
        }
    }
    return r == VG_OK ? vgi_bytes_append(b, "\"", 1, e) : r;
}

int vgi_page_raw(vg_bytes *b, const char *text, vg_err *e)
{
    return vgi_bytes_append(b, text, strlen(text), e);
}

int vgi_page_number(vg_bytes *b, double x, vg_err *e)
{
    char text[32];
    return isfinite(x) ? vgi_bytes_append(b, text, vgi_print_double(text, x), e) : vgi_page_raw(b, "null", e);
}

int vgi_page_short(vg_bytes *b, double x, vg_err *e)
{
    char text[32];
    if (!isfinite((float)x)) return vgi_page_number(b, x, e);
    return vgi_bytes_append(b, text, vgi_print_float(text, x), e);
}

int vgi_page_field(vg_bytes *b, const char *name, vg_err *e)
{
    bool first = b->size == 0 || b->data[b->size - 1] == '{';
    int r = first ? VG_OK : vgi_bytes_append(b, ",", 1, e);
    if (r == VG_OK) r = vgi_page_string(b, name, e);
    return r == VG_OK ? vgi_bytes_append(b, ":", 1, e) : r;
}

int vgi_page_field_text(vg_bytes *b, const char *name, const char *text, vg_err *e)
{
    int r = vgi_page_field(b, name, e);
    return r == VG_OK ? vgi_page_string(b, text, e) : r;
}

int vgi_page_field_number(vg_bytes *b, const char *name, double x, vg_err *e)
{
    int r = vgi_page_field(b, name, e);
    return r == VG_OK ? vgi_page_number(b, x, e) : r;
}

int vgi_page_field_flag(vg_bytes *b, const char *name, bool x, vg_err *e)
{
    int r = vgi_page_field(b, name, e);
    return r == VG_OK ? vgi_page_raw(b, x ? "true" : "false", e) : r;
}

int vgi_page_field_list(vg_bytes *b, const char *name, const vg_bytes *open_list, vg_err *e)
{
    int r = vgi_page_field(b, name, e);
    if (r == VG_OK) r = vgi_page_raw(b, open_list->size ? "" : "[", e);
    if (r == VG_OK) r = vgi_bytes_append(b, open_list->data, open_list->size, e);
    return r == VG_OK ? vgi_page_raw(b, "]", e) : r;
}

int vgi_page_next(vg_bytes *list, vg_err *e)
{
    return vgi_page_raw(list, list->size ? "," : "[", e);
}
