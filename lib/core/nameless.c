/* nameless.c: unnamed files, and reading and writing in whole.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/nameless.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

int vgi_nameless_file(vg_err *e)
{
    const char *dir = getenv("TMPDIR");
    if (!dir || !*dir) dir = "/tmp";
    int fd = open(dir, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd >= 0) return fd;
    char path[4096]; /* not every file system supports O_TMPFILE */
    int n = snprintf(path, sizeof path, "%s/vg-XXXXXX", dir);
    if (n > 0 && (size_t)n < sizeof path && (fd = mkostemp(path, O_CLOEXEC)) >= 0) {
        unlink(path);
        return fd;
    }
    return vg_fail(e, VG_ESYS, "cannot make a temporary file in '%s': %s", dir, strerror(errno));
}

int vgi_read_back(int fd, uint64_t off, void *to, size_t n, vg_err *e)
{
    for (size_t done = 0; done < n;) {
        ssize_t got = pread(fd, (unsigned char *)to + done, n - done, (off_t)(off + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0)
            return vg_fail(e, VG_ESYS, "cannot read a temporary file: %s",
                           got ? strerror(errno) : "it ends too early");
        done += (size_t)got;
    }
    return VG_OK;
}

int vgi_write_all(int fd, const void *data, size_t n, const char *name, vg_err *e)
{
    const unsigned char *p = data;
    while (n > 0) {
        ssize_t done = write(fd, p, n);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return vg_fail(e, VG_ESYS, "cannot write to '%s': %s", name, strerror(errno));
        p += done;
        n -= (size_t)done;
    }
    return VG_OK;
}
