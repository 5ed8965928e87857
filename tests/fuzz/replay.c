/* replay.c: a main for fuzz targets that runs given files, and all files of given directories, without an engine.
 * Leaves out searching: that is the engine's.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <dirent.h>
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static size_t inputs;

static void fail(const char *path)
{
    fprintf(stderr, "replay: cannot read '%s': %s\n", path, strerror(errno));
    exit(4);
}

static void run_file(const char *path)
{
    FILE *f = fopen(path, "rb");
    if (!f || fseek(f, 0, SEEK_END)) fail(path);
    long size = ftell(f);
    if (size < 0) fail(path);
    rewind(f);
    /* exactly so long that a sanitizer sees reading beyond */
    uint8_t *data = malloc((size_t)size ? (size_t)size : 1);
    if (!data || fread(data, 1, (size_t)size, f) != (size_t)size) fail(path);
    fclose(f);
    /* the name comes before the run, so that a crash says which input it was */
    fprintf(stderr, "%s\n", path);
    LLVMFuzzerTestOneInput(data, (size_t)size);
    free(data);
    inputs++;
}

static void run(const char *path, int depth)
{
    struct stat st;
    if (stat(path, &st)) fail(path);
    if (S_ISREG(st.st_mode)) run_file(path);
    if (!S_ISDIR(st.st_mode) || depth > 0) return;
    struct dirent **entries;
    int n = scandir(path, &entries, NULL, alphasort);
    if (n < 0) fail(path);
    for (int i = 0; i < n; i++) {
        char inside[4096];
        int length = snprintf(inside, sizeof inside, "%s/%s", path, entries[i]->d_name);
        if (length < 0 || (size_t)length >= sizeof inside) errno = ENAMETOOLONG, fail(path);
        if (entries[i]->d_name[0] != '.') run(inside, depth + 1);
        free(entries[i]);
    }
    free(entries);
}

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) run(argv[i], 0);
    printf("%zu inputs\n", inputs);
    return 0;
}
