/* product: how many poses a plain product in binary32 gives: transforms (3 rows a pose, 4 columns a patch) times an
 * operator. usage: product PATCHES VERTICES prints poses/s in blocks of 32 poses, and one pose at a time
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <cblas.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double rate(int poses, int k, int q, const float *a, const float *b, float *c)
{
    double begin = now();
    long n = 0;
    do {
        cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, 3 * poses, q, k, 1, a, k, b, q, 0, c, q);
        n += poses;
    } while (now() - begin < 1);
    return (double)n / (now() - begin);
}

int main(int argc, char **argv)
{
    enum { BLOCK = 32 };
    if (argc != 3) {
        fprintf(stderr, "usage: product PATCHES VERTICES\n");
        return 2;
    }
    int k = 4 * (int)strtol(argv[1], NULL, 10), q = (int)strtol(argv[2], NULL, 10);
    if (k <= 0 || q <= 0 || k > 1 << 20 || q > 1 << 26) return 2;
    float *a = calloc((size_t)(3 * BLOCK) * (size_t)k, sizeof *a), *b = calloc((size_t)k * (size_t)q, sizeof *b);
    float *c = calloc((size_t)(3 * BLOCK) * (size_t)q, sizeof *c);
    if (!a || !b || !c) return 4;
    for (size_t i = 0; i < (size_t)(3 * BLOCK) * (size_t)k; i++) a[i] = (float)(i % 7) - 3;
    for (size_t i = 0; i < (size_t)k * (size_t)q; i++) b[i] = (float)(i % 5) - 2;
    printf("%.0f %.0f\n", rate(BLOCK, k, q, a, b, c), rate(1, k, q, a, b, c));
    free(a);
    free(b);
    free(c);
    return 0;
}
