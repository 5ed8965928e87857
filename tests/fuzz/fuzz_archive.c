/* fuzz_archive.c: any bytes as an archive: listed, put in order, unpacked. Leaves out what the members mean
 * (fuzz_model).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
    static const vgi_limits limits = {.member_bytes = 1 << 20, .total_bytes = 4 << 20, .members = 64};
    vgi_archive *a = NULL;
    vg_bytes contents = {0};
    const char *path;
    vg_err e;
    int fd = memfd_create("archive", MFD_CLOEXEC);
    if (fd < 0 || n > 1 << 16 || vgi_write_all(fd, data, n, "archive", &e) < 0) {
        if (fd >= 0) close(fd);
        return 0;
    }
    if (vgi_archive_open(&a, fd, 0, "archive", &limits, &e) == VG_OK)
        while (vgi_archive_next(a, &path, &contents, &e) > 0) {
            char *name = vgi_pose_name(path, &e);
            if (name && !vgi_is_utf8(name, strlen(name))) abort();
            free(name);
        }
    vgi_archive_close(&a);
    vg_bytes_clear(&contents);
    return 0;
}
