/* report.c: named values and tables, printed as aligned text or as JSON; the only file of cmd/ that uses Jansson.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "report.h"
#include "cli.h"

#include <jansson.h>
#include <math.h>
#include <stdarg.h>

typedef enum item_kind { PUT, NOTE, GROUP, END, TABLE } item_kind;

typedef struct item {
    item_kind kind;
    char *key, *label;
    report_value value;
    bool keyed; /* tables */
    const report_column *columns;
    size_t ncolumns, nrows, cap;
    report_value *cells;
} item;

struct report {
    size_t n, cap;
    item *items;
};

/* --------------------------------------------------------------------------------------------- values -- */

report_value report_nothing(void)
{
    return (report_value){.type = REPORT_NOTHING};
}

report_value report_text(const char *s)
{
    return (report_value){.type = REPORT_TEXT, .is.text = s};
}

report_value report_count(uint64_t n)
{
    return (report_value){.type = REPORT_COUNT, .is.count = n};
}

report_value report_number(double x)
{
    return (report_value){.type = REPORT_NUMBER, .is.number = x};
}

report_value report_flag(bool b)
{
    return (report_value){.type = REPORT_FLAG, .is.flag = b};
}

report_value report_texts(const char *const *s, size_t n)
{
    return (report_value){.type = REPORT_TEXTS, .n = n, .is.texts = s};
}

report_value report_counts(const uint64_t *x, size_t n)
{
    return (report_value){.type = REPORT_COUNTS, .n = n, .is.counts = x};
}

report_value report_numbers(const double *x, size_t n)
{
    return (report_value){.type = REPORT_NUMBERS, .n = n, .is.numbers = x};
}

static void *checked(void *p)
{
    if (p) return p;
    cli_stop(VG_ENOMEM, "not enough memory for the report");
}

static char *copy_text(const char *s)
{
    return s ? checked(strdup(s)) : NULL;
}

static report_value keep_value(report_value v)
{
    if (v.type == REPORT_TEXT) {
        v.is.text = copy_text(v.is.text);
    } else if (v.type == REPORT_TEXTS) {
        char **copy = checked(calloc(v.n + 1, sizeof *copy));
        for (size_t i = 0; i < v.n; i++) copy[i] = copy_text(v.is.texts[i]);
        v.is.texts = (const char *const *)copy;
    } else if (v.type == REPORT_COUNTS) {
        uint64_t *copy = checked(calloc(v.n + 1, sizeof *copy));
        for (size_t i = 0; i < v.n; i++) copy[i] = v.is.counts[i];
        v.is.counts = copy;
    } else if (v.type == REPORT_NUMBERS) {
        double *copy = checked(calloc(v.n + 1, sizeof *copy));
        for (size_t i = 0; i < v.n; i++) copy[i] = v.is.numbers[i];
        v.is.numbers = copy;
    }
    return v;
}

static void clear_value(report_value *v)
{
    if (v->type == REPORT_TEXTS)
        for (size_t i = 0; i < v->n; i++) free((void *)(uintptr_t)v->is.texts[i]);
    if (v->type == REPORT_TEXT || v->type == REPORT_TEXTS || v->type == REPORT_COUNTS || v->type == REPORT_NUMBERS)
        free((void *)(uintptr_t)v->is.text);
}

/* ------------------------------------------------------------------------------------------- building -- */

report *report_new(void)
{
    return checked(calloc(1, sizeof(report)));
}

void report_free(report **r)
{
    if (!*r) return;
    for (size_t i = 0; i < (*r)->n; i++) {
        item *t = &(*r)->items[i];
        for (size_t c = 0; c < t->nrows * t->ncolumns; c++) clear_value(&t->cells[c]);
        clear_value(&t->value);
        free(t->cells);
        free(t->key);
        free(t->label);
    }
    free((*r)->items);
    free(*r);
    *r = NULL;
}

static item *add_room(report *r)
{
    if (r->n == r->cap) {
        r->cap = r->cap ? 2 * r->cap : 32;
        r->items = checked(reallocarray(r->items, r->cap, sizeof *r->items));
    }
    return &r->items[r->n++];
}

static item *add_item(report *r, item_kind kind, const char *key, const char *label)
{
    item *t = add_room(r);
    *t = (item){.kind = kind, .key = copy_text(key), .label = copy_text(label)};
    return t;
}

void report_join(report *r, report *more)
{
    for (size_t i = 0; i < more->n; i++) *add_room(r) = more->items[i];
    more->n = 0;
    report_free(&more);
}

void report_put(report *r, const char *key, const char *label, report_value value)
{
    add_item(r, PUT, key, label)->value = keep_value(value);
}

void report_note(report *r, const char *format, ...)
{
    char *text;
    va_list ap;
    va_start(ap, format);
    int n = vasprintf(&text, format, ap);
    va_end(ap);
    checked(n < 0 ? NULL : text);
    add_item(r, NOTE, NULL, text);
    free(text);
}

void report_gap(report *r)
{
    add_item(r, NOTE, NULL, "");
}

void report_group(report *r, const char *key)
{
    add_item(r, GROUP, key, NULL);
}

void report_end(report *r)
{
    add_item(r, END, NULL, NULL);
}

void report_table(report *r, const char *key, const char *title, bool keyed, const report_column *columns, size_t n)
{
    item *t = add_item(r, TABLE, key, title);
    t->keyed = keyed, t->columns = columns, t->ncolumns = n;
}

void report_row(report *r, const report_value *cells)
{
    item *t = &r->items[r->n - 1];
    if (t->nrows == t->cap) {
        t->cap = t->cap ? 2 * t->cap : 16;
        t->cells = checked(reallocarray(t->cells, t->cap * t->ncolumns, sizeof *t->cells));
    }
    for (size_t c = 0; c < t->ncolumns; c++) t->cells[t->nrows * t->ncolumns + c] = keep_value(cells[c]);
    t->nrows++;
}

/* ----------------------------------------------------------------------------------------------- text -- */

/* A value as text; caller frees it. */
static char *value_text(const report_value *v)
{
    cli_line line;
    FILE *f = cli_line_open(&line, "the report");
    switch (v->type) {
    case REPORT_NOTHING: break;
    case REPORT_TEXT: fputs(v->is.text, f); break;
    case REPORT_COUNT: fprintf(f, "%llu", (unsigned long long)v->is.count); break;
    case REPORT_NUMBER: isfinite(v->is.number) ? fprintf(f, "%.6g", v->is.number) : fputs("-", f); break;
    case REPORT_FLAG: fputs(v->is.flag ? "yes" : "no", f); break;
    case REPORT_TEXTS:
        for (size_t i = 0; i < v->n; i++) fprintf(f, "%s%s", i ? " " : "", v->is.texts[i]);
        break;
    case REPORT_COUNTS:
        for (size_t i = 0; i < v->n; i++) fprintf(f, "%s%llu", i ? " " : "", (unsigned long long)v->is.counts[i]);
        break;
    case REPORT_NUMBERS:
        for (size_t i = 0; i < v->n; i++) fprintf(f, "%s%.6g", i ? " " : "", v->is.numbers[i]);
        break;
    }
    char *text = cli_line_close(&line);
    cli_strip_controls(text);
    return text;
}

/* The width of a text on a terminal; each code point counts as one column. */
static int width_of(const char *s)
{
    int n = 0;
    for (; *s; s++) n += ((unsigned char)*s & 0xc0) != 0x80;
    return n;
}

static void print_blanks(FILE *f, int n)
{
    while (n-- > 0) fputc(' ', f);
}

static bool in_text(const item *t)
{
    return t->kind == PUT && t->label;
}

static bool ends_run(const item *t)
{
    return t->kind == NOTE || (t->kind == TABLE && t->label);
}

/* Consecutive values align their labels. */
static size_t print_values(const report *r, size_t first, FILE *f)
{
    size_t end = first;
    int width = 0;
    for (; end < r->n && !ends_run(&r->items[end]); end++)
        if (in_text(&r->items[end]) && width_of(r->items[end].label) > width) width = width_of(r->items[end].label);
    for (size_t i = first; i < end; i++) {
        if (!in_text(&r->items[i])) continue;
        char *text = value_text(&r->items[i].value);
        fputs(r->items[i].label, f);
        if (*text) print_blanks(f, width - width_of(r->items[i].label) + 2);
        fprintf(f, "%s\n", text);
        free(text);
    }
    return end;
}

static bool is_numeric(const item *t, size_t column)
{
    for (size_t i = 0; i < t->nrows; i++) {
        report_type type = t->cells[i * t->ncolumns + column].type;
        if (type == REPORT_TEXT || type == REPORT_FLAG) return false;
    }
    return true;
}

/* One row: numbers right-aligned, words left-aligned, no trailing blanks. */
static void print_row(const item *t, char *const *cells, const int *width, const bool *numeric, FILE *f)
{
    int owed = 0;
    for (size_t c = 0; c < t->ncolumns; c++) {
        if (t->columns[c].json_only) continue;
        int pad = width[c] - width_of(cells[c]);
        if (*cells[c]) {
            print_blanks(f, owed + (numeric[c] ? pad : 0));
            fputs(cells[c], f);
            owed = numeric[c] ? 2 : pad + 2;
        } else {
            owed += width[c] + 2;
        }
    }
    fputc('\n', f);
}

static void print_table(const item *t, FILE *f)
{
    size_t n = t->ncolumns, total = (t->nrows + 1) * n;
    char **text = checked(calloc(total + 1, sizeof *text));
    int *width = checked(calloc(n + 1, sizeof *width));
    bool *numeric = checked(calloc(n + 1, sizeof *numeric));
    for (size_t i = 0; i < total; i++) {
        text[i] = i < n ? copy_text(t->columns[i].title ? t->columns[i].title : "") : value_text(&t->cells[i - n]);
        if (width_of(text[i]) > width[i % n]) width[i % n] = width_of(text[i]);
    }
    for (size_t c = 0; c < n; c++) numeric[c] = is_numeric(t, c);
    if (*t->label) fprintf(f, "%s\n", t->label);
    for (size_t i = 0; i <= t->nrows; i++) print_row(t, text + i * n, width, numeric, f);
    for (size_t i = 0; i < total; i++) free(text[i]);
    free(text);
    free(width);
    free(numeric);
}

static void print_text(const report *r, FILE *f)
{
    for (size_t i = 0; i < r->n;) {
        const item *t = &r->items[i];
        if (t->kind == NOTE) {
            cli_strip_controls(t->label);
            fprintf(f, "%s\n", t->label);
            i++;
        } else if (ends_run(t)) {
            print_table(t, f);
            i++;
        } else {
            i = print_values(r, i, f);
        }
    }
}

/* ----------------------------------------------------------------------------------------------- JSON -- */

/* Jansson continues after a failed allocation and would write an incomplete text. */
static void *json_memory(size_t n)
{
    return checked(malloc(n));
}

/* JSON is UTF-8, but a file name need not be: invalid bytes become '?'. */
static json_t *json_of_text(const char *s)
{
    json_t *j = json_string(s);
    if (j) return j;
    char *copy = copy_text(s);
    for (char *p = copy; *p; p++)
        if ((unsigned char)*p >= 0x80) *p = '?';
    j = json_string(copy);
    free(copy);
    return j;
}

static json_t *json_of(const report_value *v)
{
    json_t *j = NULL;
    switch (v->type) {
    case REPORT_NOTHING: j = json_null(); break;
    case REPORT_TEXT: j = json_of_text(v->is.text); break;
    case REPORT_COUNT: j = json_integer((json_int_t)v->is.count); break;
    case REPORT_NUMBER: j = isfinite(v->is.number) ? json_real(v->is.number) : json_null(); break;
    case REPORT_FLAG: j = json_boolean(v->is.flag); break;
    case REPORT_TEXTS:
        j = json_array();
        for (size_t i = 0; i < v->n; i++) json_array_append_new(j, json_of_text(v->is.texts[i]));
        break;
    case REPORT_COUNTS:
        j = json_array();
        for (size_t i = 0; i < v->n; i++) json_array_append_new(j, json_integer((json_int_t)v->is.counts[i]));
        break;
    case REPORT_NUMBERS:
        j = json_array();
        for (size_t i = 0; i < v->n; i++) json_array_append_new(j, json_real(v->is.numbers[i]));
        break;
    }
    return j;
}

static void set(json_t *object, const char *key, json_t *value)
{
    if (json_object_set_new(object, key, value)) checked(NULL);
}

static json_t *json_of_table(const item *t)
{
    json_t *all = t->keyed ? json_object() : json_array();
    for (size_t i = 0; i < t->nrows; i++) {
        const report_value *cells = t->cells + i * t->ncolumns;
        json_t *row = json_object();
        for (size_t c = t->keyed; c < t->ncolumns; c++)
            if (t->columns[c].key) set(row, t->columns[c].key, json_of(&cells[c]));
        if (t->keyed) set(all, cells[0].is.text, row);
        else json_array_append_new(all, row);
    }
    return all;
}

enum { MOST_DEPTH = 8 };

static void print_json(const report *r, FILE *f)
{
    json_set_alloc_funcs(json_memory, free);
    json_t *open[MOST_DEPTH] = {json_object()};
    int depth = 0;
    for (size_t i = 0; i < r->n; i++) {
        const item *t = &r->items[i];
        if (t->kind == PUT && t->key) set(open[depth], t->key, json_of(&t->value));
        if (t->kind == TABLE && t->key) set(open[depth], t->key, json_of_table(t));
        if (t->kind == GROUP && depth + 1 < MOST_DEPTH) {
            open[depth + 1] = json_object();
            set(open[depth], t->key, open[depth + 1]); /* takes ownership; it lives as long as its parent */
            depth++;
        }
        if (t->kind == END && depth > 0) depth--;
    }
    char *text = json_dumps(open[0], JSON_INDENT(2));
    fprintf(f, "%s\n", text);
    free(text);
    json_decref(open[0]);
}

void report_print(const report *r, FILE *f, bool json)
{
    json ? print_json(r, f) : print_text(r, f);
}
