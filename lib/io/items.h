/* items.h: the inputs that operands name, and their kinds; used by source.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ITEMS_H
#define VG_ITEMS_H

#include "io/sequence_reader.h"

typedef enum vgi_content { VGI_MESH, VGI_ARCHIVE, VGI_STREAM, VGI_SEQUENCE } vgi_content;

typedef struct vgi_item {
    char *path;      /* NULL: standard input */
    bool regular;    /* can be opened, or read from `base` on, a second time */
    int64_t base;    /* offset at which standard input was */
    vgi_content content;
    const vgi_sequence_format *sequence;
    vgi_input *input;  /* kept from the first examination, if it cannot be repeated */
    vg_reader *reader; /* the same, for a stream */
} vgi_item;

typedef struct vgi_items {
    vgi_item *at;
    size_t n, cap;
    bool stdin_named;
    bool objects;      /* OBJ files are read as sequences of objects */
    vgi_limits limits;
} vgi_items;

/* vgi_standard_input: name of standard input in messages. */
extern const char vgi_standard_input[];
/* vgi_item_name: its path, or vgi_standard_input. */
const char *vgi_item_name(const vgi_item *it);

/* vgi_items_add: append the files that an operand names. "-" is standard input, which can be named only once. */
int vgi_items_add(vgi_items *items, const char *operand, vg_err *e) VG_MUST_CHECK;
/* vgi_items_keep: remove all but the first n. */
void vgi_items_keep(vgi_items *items, size_t n);
void vgi_items_clear(vgi_items *items);

/* vgi_item_look: determine the kind of the input, reading no more than necessary. */
int vgi_item_look(const vgi_items *items, vgi_item *it, vg_err *e) VG_MUST_CHECK;
/* vgi_item_input, vgi_item_reader: the contents from the start; those of a stream, after its header. Passes on what
 * was kept from the first examination. */
int vgi_item_input(const vgi_items *items, vgi_item *it, vgi_input **in, vg_err *e) VG_MUST_CHECK;
int vgi_item_reader(const vgi_items *items, vgi_item *it, vg_reader **reader, vg_err *e) VG_MUST_CHECK;
/* vgi_item_archive: for an archive; a pipe is first copied to a temporary file. */
int vgi_item_archive(const vgi_items *items, vgi_item *it, vgi_archive **archive, vg_err *e) VG_MUST_CHECK;

#endif
