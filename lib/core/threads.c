/* threads.c: a pool of threads, created once: parallel loops, and belts, on which items are processed while the
 * caller continues. One loop runs at a time; a nested loop runs on its own thread alone.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

enum { MOST_THREADS = 256 };

struct vgi_belt {
    vgi_belt *next; /* list of the belts with work for the pool */
    bool shared;    /* whether it is in that list */
    void (*work)(void *, size_t);
    void *context;
    size_t places, first, n; /* items are at first, first + 1, ... (mod places) */
    size_t begun, working;   /* of the n items: started so far; in progress */
    bool *done;              /* by place */
};

static struct {
    pthread_mutex_t lock;
    pthread_cond_t start, done;
    int workers;     /* threads created so far */
    vgi_belt *belts; /* a thread may be waiting for it */
    /* the loop in progress: */
    int wanted;      /* number of threads that may join it */
    int running;     /* number of threads in it */
    uint64_t loop;   /* its number */
    bool busy, open; /* a loop is in progress, and may be joined */
    atomic_size_t next;
    size_t n;
    void (*task)(void *, size_t);
    void *context;
} pool = {.lock = PTHREAD_MUTEX_INITIALIZER, .start = PTHREAD_COND_INITIALIZER, .done = PTHREAD_COND_INITIALIZER};

static void take_tasks(void)
{
    for (size_t i; (i = atomic_fetch_add(&pool.next, 1)) < pool.n;) pool.task(pool.context, i);
}

static void join_loop(void)
{
    pool.running++;
    pthread_mutex_unlock(&pool.lock);
    take_tasks();
    pthread_mutex_lock(&pool.lock);
    if (--pool.running == 0) pthread_cond_broadcast(&pool.done);
}

/* Process the next item of a belt that has not started. */
static void process_next(vgi_belt *b)
{
    size_t place = (b->first + b->begun++) % b->places;
    b->working++;
    pthread_mutex_unlock(&pool.lock);
    b->work(b->context, place);
    pthread_mutex_lock(&pool.lock);
    b->done[place] = true;
    b->working--;
    pthread_cond_broadcast(&pool.done);
}

static vgi_belt *waiting_belt(void)
{
    vgi_belt *b = pool.belts;
    while (b && b->begun == b->n) b = b->next;
    return b;
}

static void *work(void *arg)
{
    int me = (int)(intptr_t)arg;
    uint64_t seen = 0;
    vgi_belt *b;
    pthread_mutex_lock(&pool.lock);
    for (;;) {
        if (pool.open && pool.loop != seen && me < pool.wanted) {
            seen = pool.loop;
            join_loop();
        } else if ((b = waiting_belt())) {
            process_next(b);
        } else {
            pthread_cond_wait(&pool.start, &pool.lock);
        }
    }
    return NULL;
}

/* If a thread cannot be created, go on with those that exist. */
static void make_workers(int n)
{
    pthread_t t;
    while (pool.workers < n && !pthread_create(&t, NULL, work, (void *)(intptr_t)pool.workers)) {
        pthread_detach(t);
        pool.workers++;
    }
}

static bool open_loop(int threads, size_t n, void (*task)(void *, size_t), void *context)
{
    pthread_mutex_lock(&pool.lock);
    bool mine = !pool.busy;
    if (mine) {
        make_workers(threads - 1);
        pool.busy = pool.open = true;
        pool.wanted = threads - 1;
        pool.n = n, pool.task = task, pool.context = context;
        atomic_store(&pool.next, 0);
        pool.loop++;
        pthread_cond_broadcast(&pool.start);
    }
    pthread_mutex_unlock(&pool.lock);
    return mine;
}

/* All tasks have started: wait for those on other threads. */
static void close_loop(void)
{
    pthread_mutex_lock(&pool.lock);
    pool.open = false;
    while (pool.running > 0) pthread_cond_wait(&pool.done, &pool.lock);
    pool.busy = false;
    pthread_mutex_unlock(&pool.lock);
}

void vgi_parallel(int threads, size_t n, void (*task)(void *, size_t), void *context)
{
    if (threads > MOST_THREADS) threads = MOST_THREADS;
    if ((size_t)threads > n) threads = (int)n;
    if (threads > 1 && open_loop(threads, n, task, context)) {
        take_tasks();
        close_loop();
    } else {
        for (size_t i = 0; i < n; i++) task(context, i);
    }
}

/* ---- belts ---- */

int vgi_belt_new(vgi_belt **out, int threads, size_t places, void (*task)(void *, size_t), void *context, vg_err *e)
{
    vgi_belt *b = *out = vgi_array(1, sizeof *b, e);
    if (!b) return VG_ENOMEM;
    b->work = task, b->context = context, b->places = places;
    if (!(b->done = vgi_array(places, sizeof *b->done, e))) return free(b), *out = NULL, VG_ENOMEM;
    if (threads < 2) return VG_OK;
    pthread_mutex_lock(&pool.lock);
    make_workers((threads < MOST_THREADS ? threads : MOST_THREADS) - 1);
    b->shared = true;
    b->next = pool.belts;
    pool.belts = b;
    pthread_mutex_unlock(&pool.lock);
    return VG_OK;
}

void vgi_belt_free(vgi_belt **belt)
{
    vgi_belt *b = *belt;
    if (!b) return;
    pthread_mutex_lock(&pool.lock);
    b->begun = b->n; /* drop items that have not started */
    for (vgi_belt **at = &pool.belts; b->shared && *at; at = &(*at)->next) {
        if (*at != b) continue;
        *at = b->next;
        break;
    }
    while (b->working > 0) pthread_cond_wait(&pool.done, &pool.lock);
    pthread_mutex_unlock(&pool.lock);
    free(b->done);
    free(b);
    *belt = NULL;
}

size_t vgi_belt_things(const vgi_belt *b)
{
    return b->n;
}

bool vgi_belt_full(const vgi_belt *b)
{
    return b->n == b->places;
}

size_t vgi_belt_place(const vgi_belt *b)
{
    return (b->first + b->n) % b->places;
}

void vgi_belt_put(vgi_belt *b)
{
    pthread_mutex_lock(&pool.lock);
    b->n++;
    if (b->shared) pthread_cond_signal(&pool.start);
    pthread_mutex_unlock(&pool.lock);
}

size_t vgi_belt_take(vgi_belt *b)
{
    pthread_mutex_lock(&pool.lock);
    size_t place = b->first;
    while (!b->done[place]) {
        if (b->begun < b->n) process_next(b);
        else pthread_cond_wait(&pool.done, &pool.lock);
    }
    b->done[place] = false;
    b->first = (place + 1) % b->places;
    b->n--, b->begun--;
    pthread_mutex_unlock(&pool.lock);
    return place;
}
