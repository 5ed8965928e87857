/* edit.c: changes to a signal as lines of text, typed or written by a script or by the page of vg-view.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/curve.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- old and new times ---- */

void vg_retime_clear(vg_retime *r)
{
    free(r->old_time);
    free(r->new_time);
    *r = (vg_retime){0};
}

static int grow_times(double **x, size_t n, vg_err *e)
{
    double *more = realloc(*x, n * sizeof *more);
    if (!more) return vg_fail(e, VG_ENOMEM, "not enough memory for %zu times", n);
    *x = more;
    return VG_OK;
}

int vg_retime_add(vg_retime *r, double old_time, double new_time, vg_err *e)
{
    size_t at = r->n;
    while (at && r->new_time[at - 1] > new_time) at--;
    if (at && !(r->new_time[at - 1] < new_time && r->old_time[at - 1] <= old_time))
        return vg_fail(e, VG_EINPUT, "time %g at new time %g does not follow time %g at %g", old_time, new_time,
                       r->old_time[at - 1], r->new_time[at - 1]);
    if (at < r->n && !(r->old_time[at] >= old_time))
        return vg_fail(e, VG_EINPUT, "time %g at new time %g does not come before time %g at %g", old_time, new_time,
                       r->old_time[at], r->new_time[at]);
    if (grow_times(&r->old_time, r->n + 1, e) < 0 || grow_times(&r->new_time, r->n + 1, e) < 0) return VG_ENOMEM;
    memmove(r->old_time + at + 1, r->old_time + at, (r->n - at) * sizeof(double));
    memmove(r->new_time + at + 1, r->new_time + at, (r->n - at) * sizeof(double));
    r->old_time[at] = old_time, r->new_time[at] = new_time;
    r->n++;
    return VG_OK;
}

int vg_retime_at(const vg_retime *r, double new_time, double *old_time, vg_err *e)
{
    double some[64], *slope = r->n <= 64 ? some : vgi_array_raw(r->n, sizeof *slope, e);
    if (!slope) return VG_ENOMEM;
    vgi_monotone_slopes(r->n, r->new_time, r->old_time, slope);
    *old_time = vgi_monotone_at(r->n, r->new_time, r->old_time, slope, new_time);
    if (slope != some) free(slope);
    return VG_OK;
}

/* ---- lines ---- */

typedef struct editing {
    vg_signal *s;
    vg_retime *retime;
    vgi_curve curve;
    const char *where; /* "'edits.txt' line 3" */
} editing;

/* A whole number from 1 to most, as an index from 0. */
static int take_index(const editing *x, const char *what, double number, size_t most, size_t *index, vg_err *e)
{
    if (!(number >= 1 && number <= (double)most) || number != floor(number))
        return vg_fail(e, VG_EINPUT, "%s: there is no %s %g: they are numbered from 1 to %zu", x->where, what, number, most);
    *index = (size_t)number - 1;
    return VG_OK;
}

static int move_control(editing *x, const double *number, vg_err *e)
{
    size_t i = 0;
    if (take_index(x, "control point", number[0], x->curve.k, &i, e) < 0) return VG_EINPUT;
    memcpy(x->curve.control + 2 * i, number + 1, 2 * sizeof *number);
    return VG_OK;
}

static int insert_control(editing *x, const double *number, vg_err *e)
{
    vg_err why;
    if (x->curve.k >= 100000) return vg_fail(e, VG_EINPUT, "%s: there are 100,000 control points already", x->where);
    int r = vgi_curve_insert(&x->curve, vgi_curve_parameter(&x->curve, number[0]), &why);
    return r < 0 ? vg_fail(e, r == VG_ENOMEM ? r : VG_EINPUT, "%s: %s", x->where, why.message) : r;
}

static int remove_control(editing *x, const double *number, vg_err *e)
{
    size_t i = 0;
    vg_err why;
    if (take_index(x, "control point", number[0], x->curve.k, &i, e) < 0) return VG_EINPUT;
    int r = vgi_curve_remove(&x->curve, i, &why);
    return r < 0 ? vg_fail(e, VG_EINPUT, "%s: %s", x->where, why.message) : r;
}

static int move_frame(editing *x, const double *number, vg_err *e)
{
    size_t i = 0;
    if (take_index(x, "frame", number[0], x->s->n, &i, e) < 0) return VG_EINPUT;
    memcpy(x->s->position + 2 * i, number + 1, 2 * sizeof *number);
    return VG_OK;
}

static int change_site(editing *x, const double *number, vg_err *e)
{
    vg_signal *s = x->s;
    size_t i = 0, at = 0;
    if (take_index(x, "frame", fabs(number[0]), s->n, &i, e) < 0) return VG_EINPUT;
    while (at < s->l && s->site[at] != i) at++;
    if (number[0] > 0) {
        if (at < s->l) return VG_OK;
        uint32_t *more = realloc(s->site, (s->l + 1) * sizeof *more);
        if (!more) return vg_fail(e, VG_ENOMEM, "not enough memory for %zu sites", s->l + 1);
        s->site = more;
        s->site[s->l++] = (uint32_t)i;
        return VG_OK;
    }
    if (at == s->l) return vg_fail(e, VG_EINPUT, "%s: frame %zu is not a site", x->where, i + 1);
    if (s->l == 1) return vg_fail(e, VG_EINPUT, "%s: the last site cannot be removed", x->where);
    memmove(s->site + at, s->site + at + 1, (s->l - at - 1) * sizeof *s->site);
    s->l--;
    return VG_OK;
}

static int add_time(editing *x, const double *number, vg_err *e)
{
    vg_err why;
    if (!(number[0] >= 1 && number[0] <= (double)x->s->n))
        return vg_fail(e, VG_EINPUT, "%s: time %g is not in the sequence, which is from 1 to %zu", x->where, number[0],
                       x->s->n);
    int r = vg_retime_add(x->retime, number[0], number[1], &why);
    return r < 0 ? vg_fail(e, r, "%s: %s", x->where, why.message) : r;
}

static const struct verb {
    const char *name;
    int numbers;
    int (*apply)(editing *x, const double *number, vg_err *e);
    const char *usage;
} verbs[] = {{"control", 3, move_control, "'control NUMBER X Y'"}, {"insert", 1, insert_control, "'insert TIME'"},
             {"remove", 1, remove_control, "'remove NUMBER'"},     {"frame", 3, move_frame, "'frame NUMBER X Y'"},
             {"site", 1, change_site, "'site FRAME' or 'site -FRAME'"}, {"time", 2, add_time, "'time OLD NEW'"}};

/* The word at *p, and the position after it; 0 if there is none. */
static size_t next_word(const char **p, const char **word)
{
    *p += strspn(*p, " \t\r");
    *word = *p;
    size_t n = strcspn(*p, " \t\r");
    *p += n;
    return n;
}

static int refuse_verb(const editing *x, const char *word, size_t n, vg_err *e)
{
    char *end;
    strtod(word, &end);
    if (end == word + n)
        return vg_fail(e, VG_EINPUT, "%s: an edit begins with control, insert, remove, frame, site or time, not with a number; points of "
                       "a curve, as 'vg-info --curve' prints them, are for 'vg-sample --curve'", x->where);
    return vg_fail(e, VG_EINPUT, "%s: '%.*s' is not known: control, insert, remove, frame, site or time", x->where,
                   (int)(n < 40 ? n : 40), word);
}

static int apply_line(editing *x, const char *line, vg_err *e)
{
    const char *word;
    size_t n = next_word(&line, &word);
    if (!n) return VG_OK;
    const struct verb *v = NULL;
    for (size_t i = 0; i < sizeof verbs / sizeof *verbs && !v; i++)
        if (strlen(verbs[i].name) == n && !memcmp(verbs[i].name, word, n)) v = &verbs[i];
    if (!v) return refuse_verb(x, word, n, e);
    double number[3];
    for (int i = 0; i < v->numbers; i++) {
        char *end;
        if (!next_word(&line, &word)) return vg_fail(e, VG_EINPUT, "%s: %s expected", x->where, v->usage);
        number[i] = strtod(word, &end);
        bool decimal = strspn(word, "+-.0123456789eE") >= (size_t)(line - word); /* strtod takes hexadecimal ones too */
        if (end != line || !decimal || !isfinite(number[i]) || fabs(number[i]) > 1e100)
            return vg_fail(e, VG_EINPUT, "%s: '%.*s' is not valid here: %s expected", x->where,
                           (int)(line - word < 40 ? line - word : 40), word, v->usage);
    }
    if (next_word(&line, &word)) return vg_fail(e, VG_EINPUT, "%s: %s expected, and nothing more", x->where, v->usage);
    return v->apply(x, number, e);
}

int vg_signal_edit(vg_signal *s, vg_retime *retime, const char *text, size_t size, const char *name, vg_err *e)
{
    editing x = {.s = s, .retime = retime};
    char where[200], line[256];
    int r = vgi_signal_curve(s, &x.curve, e);
    x.where = where;
    size_t number = 0;
    for (const char *p = text, *end = text + size; r == VG_OK && p < end;) {
        const char *stop = memchr(p, '\n', (size_t)(end - p));
        size_t n = (size_t)((stop ? stop : end) - p);
        const char *comment = memchr(p, '#', n);
        size_t kept = comment ? (size_t)(comment - p) : n;
        snprintf(where, sizeof where, "'%.150s' line %zu", name, ++number);
        if (kept >= sizeof line || memchr(p, 0, kept)) r = vg_fail(e, VG_EINPUT, "%s: this is not an edit", where);
        else {
            memcpy(line, p, kept);
            line[kept] = 0;
            r = apply_line(&x, line, e);
        }
        p += n + (stop != NULL);
    }
    if (r == VG_OK) r = vgi_signal_set_curve(s, &x.curve, e);
    vgi_curve_clear(&x.curve);
    return r;
}
