/* text.c: lines of text in a font, in any script for which the machine has one. No other file includes FreeType and
 * Fontconfig. Complex shaping, as the scripts of India and Arabic need it, is not done.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <fontconfig/fontconfig.h>
#include <limits.h>
#include <math.h>
/* In place of FreeType's table of library functions, which names some that banned.h bans. */
#define FT_CONFIG_STANDARD_LIBRARY_H <stddef.h>
#define ft_ptrdiff_t ptrdiff_t
#define FT_CHAR_BIT CHAR_BIT
#define FT_INT_MAX INT_MAX
#define FT_UINT_MAX UINT_MAX
#define FT_LONG_MAX LONG_MAX
#define FT_ULONG_MAX ULONG_MAX
#include <ft2build.h>
#include FT_FREETYPE_H
#include FT_ERRORS_H

enum { FACES = 6 };
/* The package fonts-dejavu-core. Opened without Fontconfig, so that most pictures look the same on every machine. */
static const char first_choice[] = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
static const char ellipsis[] = "\xe2\x80\xa6";

struct vgi_font {
    FT_Library library;
    FcConfig *config;   /* NULL until a character is missing in the faces so far */
    FT_Face face[FACES];
    size_t n;
    uint32_t missing;   /* the last character that no font has */
    int failed;         /* VG_OK, or the first error */
};

static void remember(vgi_font *f, FT_Error error)
{
    if (error && f->failed == VG_OK) f->failed = FT_ERROR_BASE(error) == FT_Err_Out_Of_Memory ? VG_ENOMEM : VG_ESYS;
}

static void open_face(vgi_font *f, const char *file, long index)
{
    FT_Error error = FT_New_Face(f->library, file, index, f->face + f->n);
    if (FT_ERROR_BASE(error) == FT_Err_Out_Of_Memory) remember(f, error);
    if (!error) f->n++;
}

/* The font of the system that has the character, after the fonts opened so far. */
static void find_face(vgi_font *f, uint32_t character)
{
    FcResult result;
    FcChar8 *file;
    int index = 0;
    if (!f->config && !(f->config = FcInitLoadConfigAndFonts())) return;
    FcPattern *pattern = FcPatternCreate(), *match = NULL;
    FcCharSet *set = FcCharSetCreate();
    if (pattern && set && FcCharSetAddChar(set, character) && FcPatternAddCharSet(pattern, FC_CHARSET, set) &&
        FcPatternAddBool(pattern, FC_SCALABLE, FcTrue) && FcConfigSubstitute(f->config, pattern, FcMatchPattern)) {
        FcDefaultSubstitute(pattern);
        match = FcFontMatch(f->config, pattern, &result);
    }
    if (match && FcPatternGetString(match, FC_FILE, 0, &file) == FcResultMatch) {
        FcPatternGetInteger(match, FC_INDEX, 0, &index);
        open_face(f, (const char *)file, index);
    }
    if (match) FcPatternDestroy(match);
    if (pattern) FcPatternDestroy(pattern);
    if (set) FcCharSetDestroy(set);
}

int vgi_font_check(const vgi_font *f, vg_err *e)
{
    if (f->failed == VG_ENOMEM) return vg_fail(e, VG_ENOMEM, "out of memory");
    return f->failed < 0 ? vg_fail(e, f->failed, "a font cannot be read") : VG_OK;
}

int vgi_font_open(vgi_font **font, vg_err *e)
{
    vgi_font *f = vgi_array(1, sizeof *f, e);
    if (!f) return VG_ENOMEM;
    *font = f;
    if (FT_Init_FreeType(&f->library)) return vg_fail(e, VG_ENOMEM, "out of memory");
    open_face(f, first_choice, 0);
    if (!f->n && f->failed == VG_OK) find_face(f, 'a');
    if (f->failed < 0) return vgi_font_check(f, e);
    return f->n ? VG_OK : vg_fail(e, VG_ESYS, "there is no font for the captions: install fonts-dejavu-core");
}

void vgi_font_close(vgi_font **font)
{
    vgi_font *f = *font;
    if (!f) return;
    for (size_t i = 0; i < f->n; i++) FT_Done_Face(f->face[i]);
    FT_Done_FreeType(f->library);
    if (f->config) FcConfigDestroy(f->config);
    free(f);
    *font = NULL;
}

/* The next character of UTF-8; a byte that belongs to none is U+FFFD. */
static uint32_t next_character(const char **text)
{
    const unsigned char *t = (const unsigned char *)*text;
    size_t n = *t < 0x80 ? 1 : *t < 0xc2 ? 0 : *t < 0xe0 ? 2 : *t < 0xf0 ? 3 : *t < 0xf5 ? 4 : 0;
    uint32_t c = n == 1 ? *t : *t & (0xffu >> (n + 1));
    for (size_t i = 1; i < n; i++) {
        if ((t[i] & 0xc0) != 0x80) n = 0;
        c = c << 6 | (t[i] & 0x3f);
    }
    *text += n ? n : 1;
    return n ? c : 0xfffd;
}

/* The face and the glyph of a character; glyph 0, a box, if no font has it. */
static FT_Face face_of(vgi_font *f, uint32_t character, FT_UInt *glyph)
{
    if (character < 32 || character == 127) character = ' ';
    for (size_t i = 0; i < f->n; i++)
        if ((*glyph = FT_Get_Char_Index(f->face[i], character))) return f->face[i];
    size_t n = f->n;
    if (n < FACES && character != f->missing) find_face(f, character);
    if (f->n > n && (*glyph = FT_Get_Char_Index(f->face[n], character))) return f->face[n];
    while (f->n > n) FT_Done_Face(f->face[--f->n]);
    f->missing = character;
    return f->face[0];
}

static void blend(vgi_canvas *c, long x, long y, const FT_Bitmap *b, const unsigned char colour[3])
{
    for (long j = 0; j < (long)b->rows; j++)
        for (long i = 0; i < (long)b->width; i++) {
            if (x + i < 0 || y + j < 0 || x + i >= (long)c->w || y + j >= (long)c->h) continue;
            unsigned char *p = c->rgb + 3 * ((size_t)(y + j) * c->w + (size_t)(x + i));
            int cover = b->buffer[j * b->pitch + i];
            for (int k = 0; k < 3; k++) p[k] = (unsigned char)((p[k] * (255 - cover) + colour[k] * cover + 127) / 255);
        }
}

/* Draw a character at the pen and return how far the pen moves, in pixels; without a canvas only measure it. */
static double set_character(vgi_font *f, uint32_t character, double size, vgi_canvas *c, double x, double y, const unsigned char *colour)
{
    FT_UInt glyph;
    FT_Face face = face_of(f, character, &glyph);
    double left = floor(x);
    FT_Vector part = {(FT_Pos)((x - left) * 64), 0};
    FT_Error error = FT_Set_Char_Size(face, 0, (FT_F26Dot6)(size * 64 + 0.5), 72, 72);
    FT_Set_Transform(face, NULL, c ? &part : NULL);
    if (!error) error = FT_Load_Glyph(face, glyph, FT_LOAD_TARGET_LIGHT | FT_LOAD_NO_BITMAP | (c ? FT_LOAD_RENDER : 0));
    remember(f, error);
    if (error) return 0;
    const FT_GlyphSlot g = face->glyph;
    if (c && g->bitmap.pixel_mode == FT_PIXEL_MODE_GRAY)
        blend(c, (long)left + g->bitmap_left, (long)floor(y + 0.5) - g->bitmap_top, &g->bitmap, colour);
    return (double)g->linearHoriAdvance / 65536;
}

double vgi_text_width(vgi_font *f, double size, const char *text)
{
    double width = 0;
    while (*text) width += set_character(f, next_character(&text), size, NULL, 0, 0, NULL);
    return width;
}

/* Draw what lies between two places of a text. Returns where the pen ends. */
static double set_part(vgi_canvas *c, double x, double y, const vgi_lettering *l, const char *from, const char *to)
{
    while (from < to) x += set_character(c->font, next_character(&from), l->size, c, x, y, l->colour);
    return x;
}

/* How much of the text fits into this width. */
static const char *head_of(vgi_font *f, double size, double width, const char *text)
{
    while (*text) {
        const char *next = text;
        width -= set_character(f, next_character(&next), size, NULL, 0, 0, NULL);
        if (width < 0) break;
        text = next;
    }
    return text;
}

/* Where the end of the text starts that fits into this width. */
static const char *tail_of(vgi_font *f, double size, double width, const char *text)
{
    double all = vgi_text_width(f, size, text);
    while (*text && all > width) all -= set_character(f, next_character(&text), size, NULL, 0, 0, NULL);
    return text;
}

void vgi_text(vgi_canvas *c, double x, double y, const vgi_lettering *l, const char *text)
{
    double width = vgi_text_width(c->font, l->size, text);
    const char *end = text + strlen(text), *head = end, *tail = end;
    if (l->room > 0 && width > l->room) {
        double half = fmax(l->room - vgi_text_width(c->font, l->size, ellipsis), 0) / 2;
        head = head_of(c->font, l->size, half, text);
        tail = tail_of(c->font, l->size, half, head);
        width = l->room;
    }
    x -= l->anchor * width;
    x = set_part(c, x, y, l, text, head);
    if (head < end) x = set_part(c, x, y, l, ellipsis, ellipsis + strlen(ellipsis));
    set_part(c, x, y, l, tail, end);
}

/* ---- canvas ---- */

int vgi_canvas_init(vgi_canvas *c, size_t w, size_t h, vg_err *e)
{
    *c = (vgi_canvas){.w = w, .h = h, .rgb = vgi_array_raw(w * h, 3, e)};
    if (!c->rgb) return VG_ENOMEM;
    vgi_canvas_wipe(c);
    return vgi_font_open(&c->font, e);
}

void vgi_canvas_wipe(vgi_canvas *c)
{
    memset(c->rgb, 255, 3 * c->w * c->h);
}

void vgi_canvas_clear(vgi_canvas *c)
{
    vgi_font_close(&c->font);
    free(c->rgb);
    *c = (vgi_canvas){0};
}
