/* gltf_takes.c: divides the frames of a sequence into glTF animations, with names and times. Frames "Walk.0001",
 * "Walk.0002", "Run.0001", "Run.0002" are two animations, matching the names that the reader gives.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_write.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

static bool same_stem(const char *a, const char *b, size_t n)
{
    uint64_t number;
    return n && vg_frame_stem(a, &number) == n && vg_frame_stem(b, &number) == n && !memcmp(a, b, n);
}

static bool begins(const vgi_gltf_writing *w, size_t i)
{
    return i == 0 || vg_frame_begins(w->names.at[i]);
}

/* Whether the names number the frames of each animation from 1 without gaps, with more than one frame each. */
static bool are_counted(const vgi_gltf_writing *w)
{
    for (size_t i = 0, first = 0; i < w->frames; i++) {
        uint64_t number;
        const size_t n = vg_frame_stem(w->names.at[i], &number);
        if (begins(w, i)) {
            if (i > 0 && i - first < 2) return false;
            first = i;
        }
        if (number != i - first + 1 || !same_stem(w->names.at[i], w->names.at[first], n)) return false;
        if (i + 1 == w->frames && i == first) return false;
    }
    return true;
}

/* Whether the times of an animation begin at 0 or later and ascend in binary32. */
static bool times_fit(const vgi_gltf_writing *w, const vgi_gltf_take *t)
{
    for (size_t i = t->first; i < t->first + t->count; i++) {
        const double at = w->times[i];
        if (!(at >= 0 && at <= FLT_MAX) || (i > t->first && !((float)at > (float)w->times[i - 1]))) return false;
    }
    return true;
}

static void finish_take(vgi_gltf_writing *w, vgi_gltf_take *t)
{
    uint64_t number;
    const char *first = w->names.at[t->first];
    t->stem = vg_frame_stem(first, &number);
    t->timed = times_fit(w, t);
    for (size_t i = t->first; i < t->first + t->count; i++) {
        if (!same_stem(first, w->names.at[i], t->stem)) t->stem = 0;
        w->times_lost |= !t->timed && !isnan(w->times[i]);
    }
}

int vgi_gltf_find_takes(vgi_gltf_writing *w, bool split, vg_err *e)
{
    size_t n = 1;
    split = split && !w->clip && are_counted(w);
    for (size_t i = 1; i < w->frames && split; i++) n += begins(w, i);
    if (!(w->takes = vgi_array(n, sizeof *w->takes, e))) return VG_ENOMEM;
    for (size_t i = 0; i < w->frames; i++) {
        if (i == 0 || (split && begins(w, i))) w->takes[w->ntakes++].first = i;
        w->takes[w->ntakes - 1].count++;
    }
    for (size_t i = 0; i < w->ntakes; i++) finish_take(w, &w->takes[i]);
    return VG_OK;
}

/* ---- JSON ---- */

static double time_of(const vgi_gltf_writing *w, const vgi_gltf_take *t, size_t i)
{
    return (float)(t->timed ? w->times[t->first + i] : (double)i / VG_FPS);
}

int vgi_gltf_describe_times(vgi_gltf_writing *w, vg_err *e)
{
    int r = vgi_gltf_view(w, VGI_GLTF_ITEM * w->frames, "", e);
    for (size_t i = 0; i < w->ntakes && r == VG_OK; i++) {
        vgi_gltf_take *t = &w->takes[i];
        const double between[2] = {time_of(w, t, 0), time_of(w, t, t->count - 1)};
        t->moments = w->naccessors;
        r = vgi_gltf_say_accessor(w, VGI_GLTF_ITEM * t->first, VGI_GLTF_FLOAT, t->count, "SCALAR", between, 1, e);
    }
    return r;
}

int vgi_gltf_emit_times(vgi_gltf_writing *w, vg_err *e)
{
    int r = VG_OK;
    for (size_t k = 0; k < w->ntakes; k++)
        for (size_t i = 0; i < w->takes[k].count && r == VG_OK; i++) {
            const float t = (float)time_of(w, &w->takes[k], i);
            r = vgi_gltf_emit_singles(w, &t, 1, e);
        }
    return r;
}

/* The name given by the caller, or the prefix of the frame names, or "sequence". */
int vgi_gltf_say_take_name(vgi_gltf_writing *w, const vgi_gltf_take *t, vg_err *e)
{
    if (w->clip) return vgi_gltf_say_text(&w->json, w->clip, e);
    char *stem = t->stem ? vgi_copy_string(w->names.at[t->first], t->stem, e) : NULL;
    if (t->stem && !stem) return VG_ENOMEM;
    int r = vgi_gltf_say_text(&w->json, stem ? stem : "sequence", e);
    free(stem);
    return r;
}
