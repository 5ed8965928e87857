/* digest.c: a digest that is equal for sequences with equal content, whatever commands and precision produced them.
 * Checksums of records, which protect bytes, are in io/record.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/numbers_kernel.h"

/* the XXH64 state by value, so that nothing is allocated; its layout is part of xxHash's ABI */
#define XXH_STATIC_LINKING_ONLY
#include <xxhash.h>

struct vg_digest {
    const vg_head *head;
    XXH64_state_t state;
};

/* All data enters as little-endian 64-bit words, and each variable-length part is preceded by its count, so that
 * different contents never give the same bytes. */
enum { WORDS = 512 };

static void mix_words(vg_digest *d, const uint64_t *words, size_t n)
{
    unsigned char bytes[8 * WORDS];
    for (size_t i = 0; i < n; i++) vgi_put64(bytes + 8 * i, words[i]);
    XXH64_update(&d->state, bytes, 8 * n);
}

static void mix_count(vg_digest *d, uint64_t n)
{
    mix_words(d, &n, 1);
}

static void mix_doubles(vg_digest *d, const double *x, size_t n)
{
    double plain[WORDS];
    uint64_t words[WORDS];
    for (size_t i = 0; i < n; i += WORDS) {
        size_t some = n - i < WORDS ? n - i : WORDS;
        vgi_plain_zeros(plain, x + i, some);
        memcpy(words, plain, some * sizeof *words);
        mix_words(d, words, some);
    }
}

static void mix_indices(vg_digest *d, const uint32_t *x, size_t n)
{
    uint64_t words[WORDS];
    mix_count(d, n);
    for (size_t i = 0; i < n;) {
        size_t k = 0;
        for (; k < WORDS && i < n; k++, i++) words[k] = x[i];
        mix_words(d, words, k);
    }
}

static void mix_text(vg_digest *d, const char *s)
{
    size_t n = s ? strlen(s) : 0;
    mix_count(d, n);
    if (n) XXH64_update(&d->state, s, n);
}

/* A form whose name does not determine its width. */
static void mix_form(vg_digest *d, const vg_head *h)
{
    mix_text(d, vg_head_form(h));
    mix_count(d, vg_head_width(h));
}

int vg_digest_new(vg_digest **out, const vg_head *h, vg_err *e)
{
    vg_digest *d = *out = vgi_array(1, sizeof *d, e);
    if (!d) return VG_ENOMEM;
    d->head = h;
    XXH64_reset(&d->state, 0);
    mix_count(d, h->kind);
    if (!vg_kind_width(h->kind)) mix_form(d, h);
    mix_count(d, h->count);
    mix_count(d, h->body.mesh.nv);
    mix_count(d, h->body.mesh.nf);
    for (size_t f = 0; f < h->body.mesh.nf; f++)
        mix_indices(d, h->body.mesh.vert + h->body.mesh.start[f], h->body.mesh.start[f + 1] - h->body.mesh.start[f]);
    mix_count(d, h->selection.chosen);
    mix_indices(d, h->selection.faces, h->selection.chosen ? h->selection.n : 0);
    mix_indices(d, h->links.pairs, 2 * h->links.n);
    mix_indices(d, h->anchors, h->nanchors);
    if (h->body.reference) mix_doubles(d, h->body.reference, 3 * h->body.mesh.nv);
    return VG_OK;
}

void vg_digest_free(vg_digest **d)
{
    free(*d);
    *d = NULL;
}

void vg_digest_add(vg_digest *d, const vg_frame *f)
{
    const vg_head *h = d->head;
    mix_text(d, f->name);
    mix_count(d, f->has_time);
    if (f->has_time) mix_doubles(d, &f->time, 1);
    if (vg_head_element(h) == VG_OF_CORNER) {
        mix_doubles(d, f->root, 3);
        if (h->nanchors) mix_doubles(d, vg_frame_anchors(f), 3 * h->nanchors);
    }
    if (h->kind == VG_VERTICES && h->body.skeleton.njoints) {
        size_t n;
        const double *turns = vg_frame_turns(f, &n);
        mix_count(d, n);
        mix_doubles(d, turns, 4 * n);
    }
    mix_doubles(d, f->values, h->count * vg_head_width(h));
}

uint64_t vg_digest_get(const vg_digest *d)
{
    return XXH64_digest(&d->state);
}

uint64_t vg_mesh_digest(const vg_mesh *m)
{
    vg_digest d;
    XXH64_reset(&d.state, 0);
    mix_count(&d, m->nv);
    mix_count(&d, m->nf);
    for (size_t f = 0; f < m->nf; f++) mix_indices(&d, m->vert + m->start[f], m->start[f + 1] - m->start[f]);
    return XXH64_digest(&d.state);
}
