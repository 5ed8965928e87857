/* text.c: a small stroke font for captions: dots on a 5 x 9 grid joined to strokes, drawable at any size. ASCII
 * only.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/view.h"

#include <math.h>

enum { COLUMNS = 5, ROWS = 9, FIRST = 32, LAST = 126 };

/* A row of a glyph is five bits, the highest on the left. Capitals stand on row 6; rows 7 and 8 are below the
 * baseline. */
static const unsigned char glyphs[LAST - FIRST + 1][ROWS] = {
    {0},                                    /* space */
    {4, 4, 4, 4, 4, 0, 4},                  /* ! */
    {10, 10, 10},                           /* " */
    {10, 10, 31, 10, 31, 10, 10},           /* # */
    {4, 15, 20, 14, 5, 30, 4},              /* $ */
    {24, 25, 2, 4, 8, 19, 3},               /* % */
    {12, 18, 20, 8, 21, 18, 13},            /* & */
    {4, 4, 4},                              /* ' */
    {2, 4, 8, 8, 8, 4, 2},                  /* ( */
    {8, 4, 2, 2, 2, 4, 8},                  /* ) */
    {0, 4, 21, 14, 21, 4},                  /* * */
    {0, 4, 4, 31, 4, 4},                    /* + */
    {0, 0, 0, 0, 0, 0, 4, 8},               /* , */
    {0, 0, 0, 14},                          /* - */
    {0, 0, 0, 0, 0, 0, 4},                  /* . */
    {1, 1, 2, 4, 8, 16, 16},                /* / */
    {14, 17, 17, 21, 17, 17, 14},           /* 0 */
    {4, 12, 4, 4, 4, 4, 14},                /* 1 */
    {14, 17, 1, 2, 4, 8, 31},               /* 2 */
    {14, 17, 1, 6, 1, 17, 14},              /* 3 */
    {2, 4, 8, 18, 31, 2, 2},                /* 4 */
    {31, 16, 30, 1, 1, 17, 14},             /* 5 */
    {6, 8, 16, 30, 17, 17, 14},             /* 6 */
    {31, 1, 2, 2, 4, 4, 4},                 /* 7 */
    {14, 17, 17, 14, 17, 17, 14},           /* 8 */
    {14, 17, 17, 15, 1, 2, 12},             /* 9 */
    {0, 0, 4, 0, 0, 0, 4},                  /* : */
    {0, 0, 4, 0, 0, 0, 4, 8},               /* ; */
    {0, 2, 4, 8, 4, 2},                     /* < */
    {0, 0, 31, 0, 31},                      /* = */
    {0, 8, 4, 2, 4, 8},                     /* > */
    {14, 17, 1, 2, 4, 0, 4},                /* ? */
    {14, 17, 23, 21, 23, 16, 14},           /* @ */
    {4, 10, 17, 17, 31, 17, 17},            /* A */
    {30, 17, 17, 30, 17, 17, 30},           /* B */
    {14, 17, 16, 16, 16, 17, 14},           /* C */
    {30, 17, 17, 17, 17, 17, 30},           /* D */
    {31, 16, 16, 30, 16, 16, 31},           /* E */
    {31, 16, 16, 30, 16, 16, 16},           /* F */
    {14, 17, 16, 19, 17, 17, 14},           /* G */
    {17, 17, 17, 31, 17, 17, 17},           /* H */
    {14, 4, 4, 4, 4, 4, 14},                /* I */
    {7, 2, 2, 2, 2, 18, 12},                /* J */
    {17, 18, 20, 24, 20, 18, 17},           /* K */
    {16, 16, 16, 16, 16, 16, 31},           /* L */
    {17, 27, 21, 17, 17, 17, 17},           /* M */
    {17, 17, 25, 21, 19, 17, 17},           /* N */
    {14, 17, 17, 17, 17, 17, 14},           /* O */
    {30, 17, 17, 30, 16, 16, 16},           /* P */
    {14, 17, 17, 17, 21, 18, 13},           /* Q */
    {30, 17, 17, 30, 20, 18, 17},           /* R */
    {14, 17, 16, 14, 1, 17, 14},            /* S */
    {31, 4, 4, 4, 4, 4, 4},                 /* T */
    {17, 17, 17, 17, 17, 17, 14},           /* U */
    {17, 17, 17, 17, 17, 10, 4},            /* V */
    {17, 17, 17, 17, 21, 27, 17},           /* W */
    {17, 17, 10, 4, 10, 17, 17},            /* X */
    {17, 17, 10, 4, 4, 4, 4},               /* Y */
    {31, 1, 2, 4, 8, 16, 31},               /* Z */
    {14, 8, 8, 8, 8, 8, 14},                /* [ */
    {16, 16, 8, 4, 2, 1, 1},                /* \ */
    {14, 2, 2, 2, 2, 2, 14},                /* ] */
    {4, 10, 17},                            /* ^ */
    {0, 0, 0, 0, 0, 0, 0, 31},              /* _ */
    {8, 4},                                 /* ` */
    {0, 0, 14, 1, 15, 17, 15},              /* a */
    {16, 16, 30, 17, 17, 17, 30},           /* b */
    {0, 0, 14, 17, 16, 17, 14},             /* c */
    {1, 1, 15, 17, 17, 17, 15},             /* d */
    {0, 0, 14, 17, 31, 16, 15},             /* e */
    {3, 4, 14, 4, 4, 4, 4},                 /* f */
    {0, 0, 15, 17, 17, 17, 15, 1, 14},      /* g */
    {16, 16, 30, 17, 17, 17, 17},           /* h */
    {4, 0, 12, 4, 4, 4, 14},                /* i */
    {2, 0, 6, 2, 2, 2, 2, 2, 12},           /* j */
    {16, 16, 17, 18, 28, 18, 17},           /* k */
    {12, 4, 4, 4, 4, 4, 14},                /* l */
    {0, 0, 30, 21, 21, 21, 21},             /* m */
    {0, 0, 30, 17, 17, 17, 17},             /* n */
    {0, 0, 14, 17, 17, 17, 14},             /* o */
    {0, 0, 30, 17, 17, 17, 30, 16, 16},     /* p */
    {0, 0, 15, 17, 17, 17, 15, 1, 1},       /* q */
    {0, 0, 11, 12, 8, 8, 8},                /* r */
    {0, 0, 15, 16, 14, 1, 30},              /* s */
    {4, 4, 14, 4, 4, 4, 3},                 /* t */
    {0, 0, 17, 17, 17, 17, 15},             /* u */
    {0, 0, 17, 17, 17, 10, 4},              /* v */
    {0, 0, 17, 17, 21, 21, 10},             /* w */
    {0, 0, 17, 10, 4, 10, 17},              /* x */
    {0, 0, 17, 17, 17, 17, 15, 1, 14},      /* y */
    {0, 0, 31, 2, 4, 8, 31},                /* z */
    {2, 4, 4, 8, 4, 4, 2},                  /* { */
    {4, 4, 4, 4, 4, 4, 4},                  /* | */
    {8, 4, 4, 2, 4, 4, 8},                  /* } */
    {0, 0, 8, 21, 2},                       /* ~ */
};
static const unsigned char unknown[ROWS] = {31, 17, 17, 17, 17, 17, 31};

/* The glyph of the next code point; advances the position. */
static const unsigned char *next_glyph(const char **text)
{
    unsigned char c = (unsigned char)*(*text)++;
    if (c >= FIRST && c <= LAST) return glyphs[c - FIRST];
    while (((unsigned char)**text & 0xc0) == 0x80) (*text)++;
    return unknown;
}

static size_t glyph_count(const char *text)
{
    size_t n = 0;
    for (; *text; n++) next_glyph(&text);
    return n;
}

static bool lit(const unsigned char *glyph, int x, int y)
{
    return x >= 0 && x < COLUMNS && y >= 0 && y < ROWS && glyph[y] >> (COLUMNS - 1 - x) & 1;
}

static double to_stroke(double x, double y, int dx, int dy)
{
    double t = fmin(fmax((x * dx + y * dy) / (double)(dx * dx + dy * dy), 0), 1);
    return hypot(x - t * dx, y - t * dy);
}

/* Distance, in dots, from a point to the nearest stroke. Neighbouring dots are joined; diagonal ones only if no
 * dot beside them already joins them, which keeps corners sharp. */
static double to_glyph(const unsigned char *glyph, double x, double y)
{
    double least = 9;
    for (int j = 0; j < ROWS; j++)
        for (int i = 0; i < COLUMNS; i++) {
            double ox = x - i, oy = y - j;
            if (!lit(glyph, i, j) || fabs(ox) > 2.5 || fabs(oy) > 2.5) continue;
            least = fmin(least, hypot(ox, oy));
            if (lit(glyph, i + 1, j)) least = fmin(least, to_stroke(ox, oy, 1, 0));
            if (lit(glyph, i, j + 1)) least = fmin(least, to_stroke(ox, oy, 0, 1));
            for (int side = -1; side <= 1; side += 2)
                if (lit(glyph, i + side, j + 1) && !lit(glyph, i + side, j) && !lit(glyph, i, j + 1))
                    least = fmin(least, to_stroke(ox, oy, side, 1));
        }
    return least;
}

static void draw_glyph(vgi_canvas *c, double x, double y, double dot, const unsigned char colour[3],
                       const unsigned char *glyph)
{
    double thick = fmax(0.5 * dot, 0.55); /* half the stroke width, in pixels */
    long x0 = (long)floor(x - 1), x1 = (long)ceil(x + COLUMNS * dot + 1);
    long y0 = (long)floor(y - 1), y1 = (long)ceil(y + ROWS * dot + 1);
    for (long py = y0 < 0 ? 0 : y0; py < y1 && py < (long)c->h; py++)
        for (long px = x0 < 0 ? 0 : x0; px < x1 && px < (long)c->w; px++) {
            double off =
                to_glyph(glyph, ((double)px + 0.5 - x) / dot - 0.5, ((double)py + 0.5 - y) / dot - 0.5) * dot;
            double cover = fmin(fmax(thick + 0.5 - off, 0), 1);
            unsigned char *p = c->rgb + 3 * ((size_t)py * c->w + (size_t)px);
            for (int k = 0; k < 3 && cover > 0; k++) p[k] = (unsigned char)(p[k] + cover * (colour[k] - p[k]) + 0.5);
        }
}

void vgi_text(vgi_canvas *c, double x, double y, double dot, const unsigned char colour[3], const char *text)
{
    for (; *text; x += VGI_TEXT_ADVANCE * dot) draw_glyph(c, x, y, dot, colour, next_glyph(&text));
}

double vgi_text_width(double dot, const char *text)
{
    size_t n = glyph_count(text);
    return n ? dot * (double)(n * VGI_TEXT_ADVANCE - 1) : 0;
}

/* Copy n glyphs after the first `skip`, as far as they fit. Returns the end. */
static char *copy_glyphs(char *to, const char *end, const char *text, size_t skip, size_t n)
{
    for (; skip > 0 && *text; skip--) next_glyph(&text);
    for (; n > 0 && *text; n--) {
        const char *from = text;
        next_glyph(&text);
        if (text - from >= end - to) break;
        memcpy(to, from, (size_t)(text - from));
        to += text - from;
    }
    *to = 0;
    return to;
}

void vgi_text_fit(char *to, size_t size, double dot, double width, const char *text)
{
    size_t n = glyph_count(text), most = (size_t)fmax((width / dot + 1) / VGI_TEXT_ADVANCE, 3);
    const char *end = to + size;
    if (n <= most && strlen(text) < size) {
        memcpy(to, text, strlen(text) + 1);
        return;
    }
    if (most > size / 4 - 1) most = size / 4 - 1; /* a code point has at most 4 bytes */
    if (most < 3) most = 3;
    size_t tail = (most - 2) / 2, head = most - 2 - tail;
    to = copy_glyphs(to, end - 3, text, 0, head);
    *to++ = '.', *to++ = '.';
    copy_glyphs(to, end, text, n - tail, tail);
}
