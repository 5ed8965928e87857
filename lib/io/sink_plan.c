/* sink_plan.c: parses the name of an output (one mesh file, a numbered series, a directory, an archive, standard
 * output, or one file for all poses) and its format, and checks before any work that it can be written. Writing is in
 * sink.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

#include <errno.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- the name of the output ---- */

bool vgi_is_directory(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

/* "NAME:ply": whether the name stands for many files, so that the text after the colon is their format. */
static bool holds_many(const char *name, size_t n, vg_err *e)
{
    if (n == 0) return false;
    if (vgi_packer_knows(name, n) || name[n - 1] == '/') return true;
    char *copy = vgi_copy_string(name, n, e);
    bool yes = copy && vgi_is_directory(copy);
    free(copy);
    return yes;
}

static int unknown_format(const char *name, vg_err *e)
{
    return vg_fail(e, VG_EARG, "unknown format '%s': known are %s, %s", name, vgi_format_names(),
                   vgi_sequence_names());
}

static int holds_all(const char *output, const vgi_sequence_format *f, const char *what, vg_err *e)
{
    return vg_fail(e, VG_EARG, "cannot write '%s': a %s file holds all poses: %s", output, f->name, what);
}

static const vgi_sequence_format *writable_sequence(const vgi_sequence_format *f)
{
    return f && f->begin ? f : NULL;
}

static int split_choice(vgi_plan *p, const char *output, vg_err *e)
{
    const char *colon = strrchr(output, ':');
    p->name = output;
    p->length = strlen(output);
    if (!colon || !holds_many(output, (size_t)(colon - output), e)) return VG_OK;
    const vgi_sequence_format *sequence = vgi_sequence_by_name(colon + 1, strlen(colon + 1));
    if (writable_sequence(sequence)) return holds_all(output, sequence, "name one file", e);
    if (!(p->format = vgi_format_by_name(colon + 1, strlen(colon + 1)))) return unknown_format(colon + 1, e);
    p->length = (size_t)(colon - output);
    return VG_OK;
}

static int bad_pattern(const char *output, vg_err *e)
{
    return vg_fail(e, VG_EARG,
                   "'%s' needs exactly one %%d or %%04d for the number of the pose (%%%% for a percent sign)",
                   output);
}

/* The one %d or %0Nd of a series. The name is never passed to printf. */
static int find_number(vgi_plan *p, vg_err *e)
{
    const char *s = p->name;
    int found = 0;
    for (size_t i = 0; i < p->length; i++) {
        if (s[i] != '%') continue;
        size_t start = i++;
        if (i < p->length && s[i] == '%') continue;
        int width = 0;
        if (i < p->length && s[i] == '0')
            for (i++; i < p->length && s[i] >= '0' && s[i] <= '9' && width < 100; i++)
                width = 10 * width + s[i] - '0';
        if (i >= p->length || s[i] != 'd' || width > 20 || found++) return bad_pattern(s, e);
        p->at = start, p->behind = i + 1, p->width = width;
    }
    return found ? VG_OK : bad_pattern(s, e);
}

static int unknown_kind(const char *output, vg_err *e)
{
    return vg_fail(e, VG_EARG,
                   "cannot tell the format of '%s': known are %s, %s, archives %s; a directory ends in '/'", output,
                   vgi_format_names(), vgi_sequence_names(), vgi_packer_suffixes());
}

/* A single file with any name; it is not numbered. */
static int tell_sequence(vgi_plan *p, const char *output, vg_err *e)
{
    p->kind = VGI_PLAN_SEQUENCE;
    p->to_stdout = !strcmp(output, "-");
    if (vgi_packer_knows(output, p->length))
        return holds_all(output, p->sequence, "it does not go into an archive", e);
    if (output[p->length - 1] == '/' || vgi_is_directory(output))
        return holds_all(output, p->sequence, "name one file", e);
    if (memchr(output, '%', p->length)) return holds_all(output, p->sequence, "leave out the %d", e);
    return VG_OK;
}

static int tell_kind(vgi_plan *p, const char *output, vg_err *e)
{
    if (p->sequence) return tell_sequence(p, output, e);
    if (!strcmp(output, "-")) return p->kind = VGI_PLAN_FILE, p->to_stdout = true, VG_OK;
    if (vgi_packer_knows(output, p->length)) return p->kind = VGI_PLAN_ARCHIVE, VG_OK;
    if (p->length < strlen(output) || output[p->length - 1] == '/' || vgi_is_directory(output))
        return p->kind = VGI_PLAN_DIRECTORY, VG_OK;
    if (!p->format && (p->sequence = writable_sequence(vgi_sequence_by_suffix(output))))
        return tell_sequence(p, output, e);
    if (!p->format && !(p->format = vgi_format_by_suffix(output))) return unknown_kind(output, e);
    if (!memchr(output, '%', p->length)) return p->kind = VGI_PLAN_FILE, VG_OK;
    p->kind = VGI_PLAN_SERIES;
    return find_number(p, e);
}

bool vgi_plan_lacks_faces(const vgi_plan *p)
{
    return p->kind == VGI_PLAN_SEQUENCE && !(p->sequence->keeps & VGI_KEEPS_FACES);
}

static int check_mesh_option(const vgi_plan *p, const vg_sink_options *o, vg_err *e)
{
    if (!o->mesh && !o->no_mesh) return VG_OK;
    if (o->mesh && o->no_mesh) return vg_fail(e, VG_EARG, "--mesh and --no-mesh exclude each other");
    if (!vgi_plan_lacks_faces(p))
        return vg_fail(e, VG_EARG, "'%.*s' contains the faces: leave out %s", (int)p->length, p->name,
                       o->mesh ? "--mesh" : "--no-mesh");
    const vgi_format *f = o->mesh ? vgi_format_by_suffix(o->mesh) : NULL;
    if (o->mesh && !(f && f->keeps & VGI_KEEPS_ORDER))
        return vg_fail(e, VG_EARG, "cannot write the mesh '%s': its name must end in .obj, .ply or .off", o->mesh);
    return VG_OK;
}

static int check_gltf_options(const vgi_plan *p, const char *output, const vg_sink_options *o, vg_err *e)
{
    const char *given = o->most_targets          ? "--max-targets"
                        : o->morph_tolerance > 0 ? "--morph-tolerance"
                        : o->no_normals          ? "--no-normals"
                        : o->shapes              ? "--shapes"
                        : o->quantize            ? "--quantize"
                                                 : NULL;
    if (p->sequence == &vgi_sequence_glb || p->sequence == &vgi_sequence_gltf)
        return o->shapes && (o->most_targets || o->morph_tolerance > 0 || o->name)
                   ? vg_fail(e, VG_EARG, "--shapes writes each frame unchanged, without an animation: leave out "
                                         "--max-targets, --morph-tolerance and --name")
                   : VG_OK;
    if (given) return vg_fail(e, VG_EARG, "%s is for GLB and glTF: '%s' has no morph targets", given, output);
    return o->name ? vg_fail(e, VG_EARG, "--name is for GLB and glTF: '%s' has no animation to name", output) : VG_OK;
}

int vgi_plan_make(vgi_plan *p, const char *output, const vg_sink_options *o, vg_err *e)
{
    *p = (vgi_plan){0};
    if (!*output) return vg_fail(e, VG_EARG, "the name of the output is empty");
    if (o->first_number < 0) return vg_fail(e, VG_EARG, "the first number must not be negative");
    int r = split_choice(p, output, e);
    if (r < 0) return r;
    if (o->format) {
        p->sequence = writable_sequence(vgi_sequence_by_name(o->format, strlen(o->format)));
        p->format = vgi_format_by_name(o->format, strlen(o->format));
        if (!p->format && !p->sequence) return unknown_format(o->format, e);
    }
    r = tell_kind(p, output, e);
    if (!p->format) p->format = &vgi_format_obj;
    if (r == VG_OK && o->full_precision &&
        !((p->sequence ? p->sequence->keeps : p->format->keeps) & VGI_KEEPS_DOUBLES))
        r = vg_fail(e, VG_EARG, "cannot write '%s' as binary64: %s holds binary32 only", output,
                    p->sequence ? p->sequence->name : p->format->name);
    if (r == VG_OK) r = check_gltf_options(p, output, o, e);
    return r < 0 ? r : check_mesh_option(p, o, e);
}

/* ---- checks before writing ---- */

int vgi_plan_check_place(const vgi_plan *p, vg_err *e)
{
    if (p->to_stdout) return VG_OK;
    char *name = vgi_copy_string(p->name, p->length, e), *dir = NULL;
    if (!name) return VG_ENOMEM;
    int r;
    if (p->kind == VGI_PLAN_DIRECTORY && vgi_is_directory(name)) {
        r = vgi_check_directory(name, name, e);
    } else if (p->kind == VGI_PLAN_DIRECTORY || p->kind == VGI_PLAN_SERIES) {
        if (!(dir = vgi_parent_directory(name, p->length, e))) r = VG_ENOMEM;
        else
            r = strchr(dir, '%') ? VG_OK
                                 : vgi_check_directory(dir, name, e); /* numbered directories are checked when they
                                                                         are written */
    } else {
        r = vg_target_check(name, e);
    }
    free(name);
    free(dir);
    return r;
}

int vg_sink_check(const char *output, const vg_sink_options *o, vg_err *e)
{
    vgi_plan p;
    vgi_names earlier = {0};
    int r = vgi_plan_make(&p, output, o, e);
    if (r == VG_OK) r = vgi_plan_check_place(&p, e);
    if (r == VG_OK) r = vgi_earlier_list(&earlier, &p, o, e);
    vgi_names_clear(&earlier);
    return r == VG_OK && o->mesh ? vg_target_check(o->mesh, e) : r;
}

int vgi_plan_check_head(const vgi_plan *p, const vg_head *h, const char *output, vg_err *e)
{
    const vgi_sequence_format *f = p->sequence;
    if (f ? f->kinds >> h->kind & 1 : h->kind == VG_VERTICES) return f && f->check ? f->check(h, output, e) : VG_OK;
    const char *advice = "convert them to vertices with 'vg-play MAP' first, or write those of a rig as a skin to a .glb";
    if (h->kind == VG_VECTORS) advice = "pipe it through 'vg-solve' first";
    if (h->kind == VG_DEFORMATIONS)
        advice = "apply them with 'vg-deform --onto MESH' and pipe that through 'vg-solve' first";
    return vg_fail(e, VG_EINPUT, "cannot write '%s': the input holds %s: %s", output, vg_head_form(h), advice);
}
