/* report.h: one builder for all reports: named values and tables, printed as aligned text or as JSON. Every item
 * has a key, its name in JSON, and a label, its name in the text; an item without one of them appears only in the
 * other form. Without memory the program stops. Numbers do not depend on the locale; non-finite ones are "-" or
 * null.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_REPORT_H
#define VG_REPORT_H

#include "vg.h"

#include <stdio.h>

typedef struct report report;

/* A value: a cell of a table or a separate line. Texts and lists are copied. */
typedef enum report_type { REPORT_NOTHING, REPORT_TEXT, REPORT_COUNT, REPORT_NUMBER, REPORT_FLAG, REPORT_TEXTS,
                           REPORT_COUNTS, REPORT_NUMBERS } report_type;
typedef struct report_value {
    report_type type;
    size_t n; /* of a list */
    union {
        const char *text;
        uint64_t count;
        double number;
        bool flag;
        const char *const *texts;
        const uint64_t *counts;
        const double *numbers;
    } is;
} report_value;

report_value report_nothing(void); /* null in JSON, empty in the text */
report_value report_text(const char *s);
report_value report_count(uint64_t n);
report_value report_number(double x);
report_value report_flag(bool b);
report_value report_texts(const char *const *s, size_t n);
report_value report_counts(const uint64_t *x, size_t n);
report_value report_numbers(const double *x, size_t n); /* all finite */

typedef struct report_column {
    const char *key, *title;
    bool json_only;
} report_column;

report *report_new(void);
void report_free(report **r);

/* report_put: one named value. label NULL: JSON only; key NULL: text only. */
void report_put(report *r, const char *key, const char *label, report_value value);
/* report_note: a line of text that is not in JSON. report_gap: an empty line. */
void report_note(report *r, const char *format, ...) VG_PRINTF(2, 3);
void report_gap(report *r);
/* report_group .. report_end: the items between are an object in JSON; the text does not change. */
void report_group(report *r, const char *key);
void report_end(report *r);

/* report_table: starts a table; report_row adds rows. In JSON an array of objects, or if `keyed` an object of
 * objects named by the first column. title NULL: JSON only; "": a table without a title. columns are borrowed
 * until free. */
void report_table(report *r, const char *key, const char *title, bool keyed, const report_column *columns, size_t n);
void report_row(report *r, const report_value *cells); /* one per column */

/* report_join: append `more` to r, and free `more`. */
void report_join(report *r, report *more);

void report_print(const report *r, FILE *f, bool json);

#endif
