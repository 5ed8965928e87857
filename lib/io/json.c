/* json.c: reads, looks up, modifies and prints JSON through Jansson.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/json.h"

#include <jansson.h>
#include <pthread.h>
#include <stdlib.h>

/* Jansson reports most failed allocations as malformed JSON, so they are recorded here. */
static _Thread_local bool out_of_memory;

static void *noting_malloc(size_t n)
{
    void *p = malloc(n);
    if (!p) out_of_memory = true;
    return p;
}

static void note_memory(void)
{
    json_set_alloc_funcs(noting_malloc, free); /* the default seed, which other users of Jansson in the process
                                                  expect */
}

int vgi_json_parse(vgi_json **j, const void *text, size_t n, const char *subject, vg_err *e)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    json_error_t cause;
    pthread_once(&once, note_memory);
    out_of_memory = false;
    *j = json_loadb(text, n, 0, &cause);
    if (*j) return VG_OK;
    if (out_of_memory) return vg_fail(e, VG_ENOMEM, "not enough memory to read %s", subject);
    return vg_fail(e, VG_EINPUT, "%s: malformed JSON in line %d: %s", subject, cause.line, cause.text);
}

void vgi_json_free(vgi_json **j)
{
    json_decref(*j);
    *j = NULL;
}

const vgi_json *vgi_json_get(const vgi_json *object, const char *key)
{
    return json_object_get(object, key);
}

const vgi_json *vgi_json_at(const vgi_json *array, size_t i)
{
    return json_array_get(array, i);
}

size_t vgi_json_count(const vgi_json *array)
{
    return json_array_size(array);
}

bool vgi_json_is_object(const vgi_json *j)
{
    return json_is_object(j);
}

bool vgi_json_is_array(const vgi_json *j)
{
    return json_is_array(j);
}

bool vgi_json_is_true(const vgi_json *j)
{
    return json_is_true(j);
}

bool vgi_json_number(const vgi_json *j, double *x)
{
    if (!json_is_number(j)) return false;
    *x = json_number_value(j);
    return true;
}

bool vgi_json_whole(const vgi_json *j, uint64_t *x)
{
    double value;
    if (!vgi_json_number(j, &value) || !(value >= 0 && value <= 9007199254740992.0)) return false;
    *x = (uint64_t)value;
    return (double)*x == value;
}

const char *vgi_json_text(const vgi_json *j)
{
    return json_string_value(j);
}

bool vgi_json_same(const vgi_json *a, const vgi_json *b)
{
    return a == b || json_equal(a, b);
}

const char *vgi_json_key(const vgi_json *object, const char *before)
{
    json_t *o = (json_t *)object; /* Jansson's iteration takes a non-const object */
    void *at = before ? json_object_iter_next(o, json_object_key_to_iter(before)) : json_object_iter(o);
    return at ? json_object_iter_key(at) : NULL;
}

/* ---- creation and modification ---- */

static vgi_json *made(vgi_json *j, vg_err *e)
{
    if (!j) vg_fail(e, VG_ENOMEM, "not enough memory for JSON");
    return j;
}

vgi_json *vgi_json_object(vg_err *e)
{
    return made(json_object(), e);
}

vgi_json *vgi_json_array(vg_err *e)
{
    return made(json_array(), e);
}

vgi_json *vgi_json_of_whole(uint64_t x, vg_err *e)
{
    return made(json_integer((json_int_t)x), e);
}

vgi_json *vgi_json_of_number(double x, vg_err *e)
{
    return made(json_real(x), e);
}

vgi_json *vgi_json_of_text(const char *utf8, vg_err *e)
{
    return made(json_string(utf8), e);
}

vgi_json *vgi_json_copy(const vgi_json *j, vg_err *e)
{
    return made(json_deep_copy(j), e);
}

int vgi_json_put(vgi_json *object, const char *key, vgi_json *value, vg_err *e)
{
    if (!value) return VG_ENOMEM;
    return json_object_set_new(object, key, value) ? vg_fail(e, VG_ENOMEM, "not enough memory for JSON") : VG_OK;
}

int vgi_json_add(vgi_json *array, vgi_json *value, vg_err *e)
{
    if (!value) return VG_ENOMEM;
    return json_array_append_new(array, value) ? vg_fail(e, VG_ENOMEM, "not enough memory for JSON") : VG_OK;
}

void vgi_json_drop(vgi_json *object, const char *key)
{
    json_object_del(object, key);
}

vgi_json *vgi_json_inner(vgi_json *object, const char *key)
{
    return json_object_get(object, key);
}

vgi_json *vgi_json_inner_at(vgi_json *array, size_t i)
{
    return json_array_get(array, i);
}

int vgi_json_print(const vgi_json *j, vg_bytes *to, vg_err *e)
{
    char *text = json_dumps(j, JSON_COMPACT | JSON_ENCODE_ANY);
    if (!text) return vg_fail(e, VG_ENOMEM, "not enough memory for JSON");
    int r = vgi_bytes_append(to, text, strlen(text), e);
    free(text);
    return r;
}
