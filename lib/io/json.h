/* json.h: JSON values. json.c is the only file of the library that uses Jansson. Lookups accept NULL, the result
 * of a failed lookup, and return "not found".
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_JSON_H
#define VG_JSON_H

#include "core/core.h"

typedef struct json_t vgi_json;

/* vgi_json_parse: parse one JSON text without trailing data; else VG_EINPUT naming `subject` (with quotes). */
int vgi_json_parse(vgi_json **j, const void *text, size_t n, const char *subject, vg_err *e) VG_MUST_CHECK;
void vgi_json_free(vgi_json **j);

const vgi_json *vgi_json_get(const vgi_json *object, const char *key); /* NULL: absent, or not an object */
const vgi_json *vgi_json_at(const vgi_json *array, size_t i);          /* NULL: the same for an array */
size_t vgi_json_count(const vgi_json *array);                          /* 0 also if it is not an array */
bool vgi_json_is_object(const vgi_json *j);
bool vgi_json_is_array(const vgi_json *j);
bool vgi_json_is_true(const vgi_json *j);
bool vgi_json_number(const vgi_json *j, double *x);
bool vgi_json_whole(const vgi_json *j, uint64_t *x); /* an integer from 0 to 2^53 */
const char *vgi_json_text(const vgi_json *j);        /* NULL: not a string. Valid UTF-8, borrowed */
/* vgi_json_key: the name of the member after the given one (its own text, from here), or of the first one if NULL.
 * NULL at the end. Borrowed. */
const char *vgi_json_key(const vgi_json *object, const char *before);
bool vgi_json_same(const vgi_json *a, const vgi_json *b);

/* ---- creation and modification ---- */

vgi_json *vgi_json_object(vg_err *e); /* NULL: out of memory, as below */
vgi_json *vgi_json_array(vg_err *e);
vgi_json *vgi_json_of_whole(uint64_t x, vg_err *e);
vgi_json *vgi_json_of_number(double x, vg_err *e);
vgi_json *vgi_json_of_text(const char *utf8, vg_err *e);
vgi_json *vgi_json_copy(const vgi_json *j, vg_err *e);
/* vgi_json_put, vgi_json_add: take ownership of value, also on failure; value NULL: VG_ENOMEM. vgi_json_put replaces
 * a member with that name. */
int vgi_json_put(vgi_json *object, const char *key, vgi_json *value, vg_err *e) VG_MUST_CHECK;
int vgi_json_add(vgi_json *array, vgi_json *value, vg_err *e) VG_MUST_CHECK;
void vgi_json_drop(vgi_json *object, const char *key);
/* A member or element that can be modified. */
vgi_json *vgi_json_inner(vgi_json *object, const char *key);
vgi_json *vgi_json_inner_at(vgi_json *array, size_t i);
/* vgi_json_print: append the text, without whitespace. */
int vgi_json_print(const vgi_json *j, vg_bytes *to, vg_err *e) VG_MUST_CHECK;

#endif
