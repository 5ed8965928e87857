/* centroids FILE...: where the middle of each pose is: reading whatever vg-encode reads.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <vg.h>

int main(int argc, char **argv)
{
    vg_err e;
    vg_source *source = NULL;
    vg_frame pose = {0};
    int r = vg_source_open(&source, (const char *const *)argv + 1, (size_t)argc - 1, &e);
    while (r >= 0 && (r = vg_source_next(source, &pose, &e)) > 0) {
        double c[3];
        vg_centroid(pose.values, vg_source_head(source)->body.mesh.nv, c);
        printf("%s %g %g %g\n", pose.name, c[0], c[1], c[2]);
    }
    if (r < 0) fprintf(stderr, "%s\n", e.message);
    vg_frame_clear(&pose);
    vg_source_close(&source);
    return vg_exit_status(r);
}
