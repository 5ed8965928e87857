/* fuzz_markers.c: pairs of vertices and dense correspondences from any bytes: refused, or every number within bounds.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > 1 << 16) return 0;
    vg_err e;
    vg_markers m;
    vg_seed *s;
    size_t n;
    for (int base = 0; base < 2; base++) {
        if (vg_markers_read(&m, data, size, base, "fuzz", &e) == VG_OK) {
            if (m.n == 0) abort();
            for (size_t i = 0; i < m.n; i++)
                if (m.at[i].source == UINT32_MAX || m.at[i].target == UINT32_MAX || m.at[i].line == 0) abort();
        } else if (m.n || m.at) {
            abort();
        }
        vg_markers_clear(&m);
        if (vg_seeds_read(&s, &n, data, size, base, "fuzz", &e) == VG_OK) {
            for (size_t i = 0; i < n; i++) {
                double sum = s[i].weight[0] + s[i].weight[1] + s[i].weight[2];
                if (!(sum > 1 - 1e-6 && sum < 1 + 1e-6)) abort();
            }
        } else if (s || n) {
            abort();
        }
        free(s);
    }
    return 0;
}
