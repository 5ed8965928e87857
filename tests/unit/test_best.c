/* test_best.c: the best parameters come back the same from memory and from an unnamed file.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/best.h"

#include "meshes.h"

enum { MANY = 100003 };

static void check_best(size_t most, bool in_file)
{
    vg_err e = {0, ""};
    vgi_best b;
    float *p = room(MANY, sizeof *p), *back = room(MANY, sizeof *back);
    CHECK(vgi_best_make(&b, MANY, most, &e) == VG_OK);
    CHECK((b.values == NULL) == in_file && (b.file >= 0) == in_file);
    CHECK(vgi_best_get(&b, back, &e) == VG_OK);
    for (size_t i = 0; i < MANY; i++) CHECK(back[i] == 0);
    for (int times = 0; times < 2; times++) {
        for (size_t i = 0; i < MANY; i++) p[i] = (float)noise();
        CHECK(vgi_best_put(&b, p, &e) == VG_OK);
        CHECK(vgi_best_get(&b, back, &e) == VG_OK);
        CHECK(!memcmp(p, back, MANY * sizeof *p));
    }
    vgi_best_clear(&b);
    free(p), free(back);
}

static void in_memory(void)
{
    check_best(MANY * sizeof(float), false);
}

static void in_a_file(void)
{
    check_best(MANY * sizeof(float) - 1, true);
}

static void no_folder(void)
{
    vg_err e = {0, ""};
    vgi_best b;
    char *was = getenv("TMPDIR");
    setenv("TMPDIR", "/does/not/exist", 1);
    CHECK(vgi_best_make(&b, 4, 1, &e) == VG_ESYS);
    CHECK(strstr(e.message, "/does/not/exist"));
    vgi_best_clear(&b);
    if (was) setenv("TMPDIR", was, 1);
    else unsetenv("TMPDIR");
}

TESTS({"in memory", in_memory}, {"in a file", in_a_file}, {"no folder for it", no_folder})
