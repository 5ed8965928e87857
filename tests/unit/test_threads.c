/* test_threads.c: parallel loops and belts: everything is done once, and belts keep the order, whatever the number of
 * threads. Leaves out how fast.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"
#include "core/core.h"

#include <stdatomic.h>
#include <unistd.h>

enum { THINGS = 500, MOST_PLACES = 7 };

typedef struct things {
    size_t at[MOST_PLACES], made[MOST_PLACES];
    atomic_size_t works, inside, most_inside;
    bool slow;
} things;

static void make(void *context, size_t place)
{
    things *t = context;
    size_t inside = atomic_fetch_add(&t->inside, 1) + 1, most = atomic_load(&t->most_inside);
    while (inside > most && !atomic_compare_exchange_weak(&t->most_inside, &most, inside)) continue;
    if (t->slow && t->at[place] % 3 == 0) usleep(200); /* the next ones overtake it */
    t->made[place] = t->at[place] * t->at[place] + 1;
    atomic_fetch_add(&t->works, 1);
    atomic_fetch_sub(&t->inside, 1);
}

static vgi_belt *begin(things *t, int threads, size_t places)
{
    vgi_belt *b = NULL;
    vg_err e;
    CHECK(vgi_belt_new(&b, threads, places, make, t, &e) == VG_OK);
    CHECK(vgi_belt_things(b) == 0 && !vgi_belt_full(b));
    return b;
}

static void take(vgi_belt *b, const things *t, size_t *taken)
{
    size_t place = vgi_belt_take(b), i = (*taken)++;
    CHECK(t->at[place] == i && t->made[place] == i * i + 1);
}

static void a_belt_keeps_the_order(void)
{
    for (int threads = 1; threads <= 4; threads++)
        for (size_t places = 1; places <= MOST_PLACES; places++) {
            things t = {.slow = places == 5};
            vgi_belt *b = begin(&t, threads, places);
            size_t taken = 0;
            for (size_t i = 0; i < THINGS; i++) {
                if (vgi_belt_full(b)) take(b, &t, &taken);
                t.at[vgi_belt_place(b)] = i;
                vgi_belt_put(b);
            }
            CHECK(vgi_belt_things(b) == places);
            while (vgi_belt_things(b)) take(b, &t, &taken);
            CHECK(taken == THINGS && t.works == THINGS && t.most_inside <= (size_t)threads);
            vgi_belt_free(&b);
            CHECK(b == NULL);
        }
}

static void count(void *context, size_t i)
{
    atomic_fetch_add(&((atomic_size_t *)context)[i], 1);
}

/* Two belts and a loop share the threads. */
static void loops_run_beside_belts(void)
{
    things t[2] = {{.slow = true}, {.slow = false}};
    vgi_belt *b[2] = {begin(&t[0], 3, 4), begin(&t[1], 3, 2)};
    size_t taken[2] = {0, 0};
    static atomic_size_t counts[64];
    for (size_t i = 0; i < 60; i++) {
        for (int k = 0; k < 2; k++) {
            if (vgi_belt_full(b[k])) take(b[k], &t[k], &taken[k]);
            t[k].at[vgi_belt_place(b[k])] = i;
            vgi_belt_put(b[k]);
        }
        vgi_parallel(3, 64, count, counts);
    }
    for (size_t i = 0; i < 64; i++) CHECK(counts[i] == 60);
    for (int k = 0; k < 2; k++) {
        while (vgi_belt_things(b[k])) take(b[k], &t[k], &taken[k]);
        CHECK(taken[k] == 60);
        vgi_belt_free(&b[k]);
    }
}

/* A belt that is given up: what is being made is waited for, nothing is touched afterwards. */
static void a_belt_may_be_given_up(void)
{
    for (int round = 0; round < 50; round++) {
        things t = {.slow = true};
        vgi_belt *b = begin(&t, 3, MOST_PLACES);
        for (size_t i = 0; i < MOST_PLACES; i++) {
            t.at[vgi_belt_place(b)] = i;
            vgi_belt_put(b);
        }
        size_t taken = 0;
        if (round % 2) take(b, &t, &taken);
        vgi_belt_free(&b);
        CHECK(t.inside == 0);
        memset(t.at, 0, sizeof t.at);
    }
    vgi_belt *none = NULL;
    vgi_belt_free(&none);
}

static void one_thread_works_where_it_takes(void)
{
    things t = {.slow = false};
    vgi_belt *b = begin(&t, 1, 3);
    t.at[vgi_belt_place(b)] = 0;
    vgi_belt_put(b);
    usleep(1000);
    CHECK(t.works == 0);
    size_t taken = 0;
    take(b, &t, &taken);
    CHECK(t.works == 1);
    vgi_belt_free(&b);
}

static void a_loop_does_each_once(void)
{
    static atomic_size_t counts[1000];
    for (int threads = 1; threads <= 5; threads++) vgi_parallel(threads, 1000, count, counts);
    for (size_t i = 0; i < 1000; i++) CHECK(counts[i] == 5);
    vgi_parallel(4, 0, count, counts);
}

TESTS({"a belt keeps the order", a_belt_keeps_the_order}, {"loops run beside belts", loops_run_beside_belts},
      {"a belt may be given up", a_belt_may_be_given_up},
      {"one thread works where it takes", one_thread_works_where_it_takes},
      {"a loop does each once", a_loop_does_each_once})
