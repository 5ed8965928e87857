/* png.c: writes a PNG row by row. No other file includes libpng. No time or text chunks are written: the same picture
 * gives the same bytes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include "io/io.h"

#include <png.h>
#include <setjmp.h>

enum { FLUSH_BYTES = 1 << 16 };

struct vgi_png {
    png_structp png;
    png_infop info;
    size_t w;
    int fd;
    char *name;
    vg_bytes out; /* not yet written */
    vg_err err;
};

static void on_error(png_structp png, png_const_charp message)
{
    vgi_png *p = png_get_error_ptr(png);
    if (!p->err.code) vg_fail(&p->err, VG_ESYS, "cannot make the picture '%s': %s", p->name, message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
    (void)png, (void)message; /* libpng warns about colour profiles and the like, which are not written */
}

static int flush_png(vgi_png *p)
{
    int r = vgi_write_all(p->fd, p->out.data, p->out.size, p->name, &p->err);
    p->out.size = 0;
    return r;
}

static void on_write(png_structp png, png_bytep data, size_t n)
{
    vgi_png *p = png_get_io_ptr(png);
    int r = vgi_bytes_append(&p->out, data, n, &p->err);
    if (r == VG_OK && p->out.size >= FLUSH_BYTES) r = flush_png(p);
    if (r < 0) png_longjmp(png, 1);
}

static void on_flush(png_structp png)
{
    (void)png; /* vgi_png_end reports it */
}

static int give_error(const vgi_png *p, vg_err *e)
{
    if (e) *e = p->err;
    return p->err.code;
}

static int start_png(vgi_png *p, size_t w, size_t h)
{
    p->png = png_create_write_struct(PNG_LIBPNG_VER_STRING, p, on_error, on_warning);
    p->info = p->png ? png_create_info_struct(p->png) : NULL;
    if (!p->info) return vg_fail(&p->err, VG_ENOMEM, "not enough memory for the picture '%s'", p->name);
    if (setjmp(png_jmpbuf(p->png))) return p->err.code;
    png_set_write_fn(p->png, p, on_write, on_flush);
    /* fixed, so that the bytes do not depend on defaults; these filters suit smooth shading best */
    png_set_compression_level(p->png, 6);
    png_set_compression_mem_level(p->png, 8);
    png_set_filter(p->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB | PNG_FILTER_UP | PNG_FILTER_PAETH);
    png_set_IHDR(p->png, p->info, (png_uint_32)w, (png_uint_32)h, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(p->png, p->info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(p->png, p->info);
    return VG_OK;
}

int vgi_png_open(vgi_png **out, int fd, const char *name, size_t w, size_t h, vg_err *e)
{
    *out = NULL;
    if (w == 0 || h == 0 || w > PNG_USER_WIDTH_MAX || h > PNG_USER_HEIGHT_MAX)
        return vg_fail(e, VG_EARG, "the picture '%s' would be %zu x %zu pixels, and a PNG has at most %d each way",
                       name, w, h, PNG_USER_WIDTH_MAX);
    vgi_png *p = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->fd = fd;
    p->w = w;
    p->name = vgi_copy_string(name, strlen(name), &p->err);
    int r = p->name ? start_png(p, w, h) : VG_ENOMEM;
    if (r < 0) {
        give_error(p, e);
        vgi_png_close(&p);
    }
    *out = p;
    return r;
}

int vgi_png_rows(vgi_png *p, const unsigned char *rgb, size_t n, vg_err *e)
{
    if (setjmp(png_jmpbuf(p->png))) return give_error(p, e);
    for (size_t i = 0; i < n; i++) png_write_row(p->png, rgb + 3 * p->w * i);
    return VG_OK;
}

int vgi_png_end(vgi_png *p, vg_err *e)
{
    if (setjmp(png_jmpbuf(p->png))) return give_error(p, e);
    png_write_end(p->png, NULL);
    return flush_png(p) < 0 ? give_error(p, e) : VG_OK;
}

void vgi_png_close(vgi_png **address)
{
    vgi_png *p = *address;
    if (!p) return;
    if (p->png) png_destroy_write_struct(&p->png, &p->info);
    vg_bytes_clear(&p->out);
    free(p->name);
    free(p);
    *address = NULL;
}
