/* threads.c: a parallel loop over a pool of threads that is made once and waits between loops.
 * Leaves out everything about what is computed. One loop runs at a time; a loop inside a loop runs alone.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"

#include <pthread.h>
#include <stdatomic.h>

enum { MOST_THREADS = 256 };

static struct {
    pthread_mutex_t lock;
    pthread_cond_t start, done;
    int workers;  /* threads made so far */
    int wanted;   /* of them, how many take part in the present loop */
    int running;  /* of them, how many have not finished it */
    uint64_t loop; /* number of the present loop */
    bool busy;
    atomic_size_t next;
    size_t n;
    void (*task)(void *, size_t);
    void *context;
} pool = {.lock = PTHREAD_MUTEX_INITIALIZER, .start = PTHREAD_COND_INITIALIZER, .done = PTHREAD_COND_INITIALIZER};

static void take_tasks(void)
{
    for (size_t i; (i = atomic_fetch_add(&pool.next, 1)) < pool.n;) pool.task(pool.context, i);
}

static void *work(void *arg)
{
    int me = (int)(intptr_t)arg;
    uint64_t seen = 0;
    pthread_mutex_lock(&pool.lock);
    for (;;) {
        while (pool.loop == seen || me >= pool.wanted) {
            seen = pool.loop;
            pthread_cond_wait(&pool.start, &pool.lock);
        }
        seen = pool.loop;
        pthread_mutex_unlock(&pool.lock);
        take_tasks();
        pthread_mutex_lock(&pool.lock);
        if (--pool.running == 0) pthread_cond_signal(&pool.done);
    }
    return NULL;
}

void vgi_parallel(int threads, size_t n, void (*task)(void *, size_t), void *context)
{
    if (threads > MOST_THREADS) threads = MOST_THREADS;
    if ((size_t)threads > n) threads = (int)n;
    if (threads > 1) {
        pthread_mutex_lock(&pool.lock);
        bool mine = !pool.busy;
        if (mine) {
            while (pool.workers < threads - 1) {
                pthread_t t;
                if (pthread_create(&t, NULL, work, (void *)(intptr_t)pool.workers)) break; /* fewer threads will do */
                pthread_detach(t);
                pool.workers++;
            }
            pool.busy = true;
            pool.wanted = pool.workers < threads - 1 ? pool.workers : threads - 1;
            pool.running = pool.wanted;
            pool.n = n, pool.task = task, pool.context = context;
            atomic_store(&pool.next, 0);
            pool.loop++;
            pthread_cond_broadcast(&pool.start);
        }
        pthread_mutex_unlock(&pool.lock);
        if (mine) {
            take_tasks();
            pthread_mutex_lock(&pool.lock);
            while (pool.running > 0) pthread_cond_wait(&pool.done, &pool.lock);
            pool.busy = false;
            pthread_mutex_unlock(&pool.lock);
            return;
        }
    }
    for (size_t i = 0; i < n; i++) task(context, i);
}
