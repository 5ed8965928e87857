/* artefact.h: the table of header records: everything a stream states before its frames, one entry per record.
 *
 * An entry lists the fields of a struct in vg_head. Clearing, copying, reading, writing and tests of presence are
 * loops over that list (artefact.c, io/artefact_io.c), so that no other code needs to know a new record.
 *
 * To add a record, here "SIGN" for an artefact "signal" that vg-fitsignal makes:
 *
 * 1. vg/NAME.h: a struct of numbers (size_t, uint32_t, uint64_t, bool, an enum, double), texts (char *) and arrays
 *     (double *, float *, uint32_t *, uint8_t *, char **), and a member of that type in vg_head, or in vg_body if it
 *     belongs to the body rather than to the frames:
 *
 *         typedef struct vg_signal { size_t n, degree; double *plane; char **names; } vg_signal;
 *
 * 2. records.c: its number in the enum below (in the order in which records are written), the lengths of its arrays,
 *     its fields in stream order, and its entry in vgi_artefacts:
 *
 *         LENGTH(signal_n, vg_signal, a->n)
 *         static const vgi_member signal_fields[] = {
 *             NUMBER(vg_signal, U64, n), NUMBER(vg_signal, U64, degree),
 *             ARRAY(vg_signal, F64, plane, 2, signal_n),       2 numbers for each of a->n
 *             ARRAY(vg_signal, TEXT, names, 1, signal_n)};
 *
 *         [VGI_SIGN] = {.tag = "SIGN", .flags = VGI_CRITICAL, .name = "signal", .advice = "make one with vg-fitsignal",
 *                       .needs = "MESH", IN_HEAD(signal), PRESENT(signal.n), FIELDS(signal_fields),
 *                       .check = vgi_check_signal},
 *
 * 3. checks.c: vgi_check_signal, which reports what is wrong with the contents. It may rely only on what every reader
 *     checks: counts agree with the bytes, numbers are finite, texts are UTF-8. It may fill fields marked DERIVED, which
 *     follow from the others; they are copied and freed but not stored in the stream.
 *
 * 4. fmt/STREAM.md: the table of its fields; the tables in tests/make_corpus.py and examples/read_stream.py;
 *     fmt/vg-stream.ksy.
 *
 * After that vg_head_clear, vg_head_copy, the stream, and vg_load(&head, operand, "signal", &e) with its messages
 * know it.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ARTEFACT_H
#define VG_ARTEFACT_H

#include "core/core.h"

enum { VGI_CRITICAL = 1u, VGI_COPY_SAFE = 2u };

/* In the order in which they are written. */
enum {
    VGI_PROV, VGI_MESH, VGI_TEXC, VGI_LABL, VGI_COLV, VGI_ASST, VGI_SELE, VGI_LINK, VGI_ANCH, VGI_REFP, VGI_SKEL, VGI_CORR, VGI_PTCH,
    VGI_RIG, VGI_SKIN, VGI_MAP, VGI_SIGN, VGI_NETW, VGI_ARTEFACTS
};

/* Type of a field in the stream. In memory: uint8_t, uint32_t, uint64_t, float, double, char *; a number of type U64
 * may be any unsigned member or an enum. */
typedef enum vgi_type { VGI_U8, VGI_U32, VGI_U64, VGI_F32, VGI_F64, VGI_TEXT } vgi_type;

/* Number of entries of an array, before multiplication by its width. Called once the preceding fields are known;
 * these may hold any numbers. SIZE_MAX: an impossible size. */
typedef size_t vgi_array_length(const void *artefact, const vg_mesh *mesh);

typedef struct vgi_member {
    vgi_type type;
    bool derived;       /* not in the stream */
    bool optional;      /* an array of length 0 is NULL */
    size_t at;          /* offset in the struct: of the number, the text, or the pointer to the array */
    size_t size;        /* bytes of the number, element or row */
    size_t row_at;      /* arrays of structs: offset in such a row; the field is one column of the array */
    bool rows;
    size_t width;       /* elements per entry */
    vgi_array_length *length; /* NULL: a single number or text */
} vgi_member;

/* The check of a record: VG_OK, or VG_EINPUT with "where: what is wrong". artefact is part of h. */
typedef int vgi_check(vg_head *h, void *artefact, const char *where, vg_err *e);

typedef struct vgi_artefact {
    const char *tag;
    uint32_t flags;
    const char *name;   /* the name by which programs request it, alone or with other records; NULL: none */
    const char *advice; /* how to get one ("make one with vg-fitmap"); NULL: no advice */
    const char *needs; /* the tag of the record that must precede it; NULL: none */
    bool in_body;
    size_t at;         /* offset in vg_head, or in vg_body */
    size_t size;       /* of that struct; 0: its fields are members of vg_head or vg_body */
    size_t present_at, present_size; /* the member of vg_head that is 0 if the record is absent */
    size_t mark_at;    /* with `marks`: a bool in vg_head that is set when the record has been read */
    bool marks;
    size_t each;       /* for repeating records, bytes of one struct, else 0. `at` is then the offset of a pointer,
                          and `count_at` that of the number of structs */
    size_t count_at;
    const vgi_member *fields;
    size_t nfields;
    vgi_check *check;
} vgi_artefact;

extern const vgi_artefact vgi_artefacts[VGI_ARTEFACTS];

/* vgi_artefact_by_tag, _by_name: NULL if unknown. If several records share a name, such as RIG and SKIN, the first. */
const vgi_artefact *vgi_artefact_by_tag(const char *tag);
const vgi_artefact *vgi_artefact_by_name(const char *name);
/* vgi_artefact_in: address of the struct in h; i: number of a repeating record. */
void *vgi_artefact_in(const vgi_artefact *t, const vg_head *h, size_t i);
/* vgi_artefact_count: number in h: 0 or 1, or any number of repeating records. */
size_t vgi_artefact_count(const vgi_artefact *t, const vg_head *h);
/* vgi_artefact_append: append a zeroed struct for a repeating record to h. */
int vgi_artefact_append(const vgi_artefact *t, vg_head *h, void **artefact, vg_err *e) VG_MUST_CHECK;

/* vgi_fields_clear: release what the fields hold and zero them. */
void vgi_fields_clear(const vgi_artefact *t, void *artefact);
/* vgi_fields_move: clear *to, move *from to it, and leave *from empty. */
void vgi_fields_move(const vgi_artefact *t, void *to, void *from);
/* vgi_fields_copy: `to` must hold nothing to release; it is cleared on failure. mesh: for lengths that depend on it,
 * else NULL. */
int vgi_fields_copy(const vgi_artefact *t, void *to, const void *from, const vg_mesh *mesh, vg_err *e) VG_MUST_CHECK;
/* vgi_member_elements: elements of an array, SIZE_MAX if the size is impossible; 1 for a number. */
size_t vgi_member_elements(const vgi_member *f, const void *artefact, const vg_mesh *mesh);
/* vgi_type_size: bytes of an element in the stream; 0 for a text. */
size_t vgi_type_size(vgi_type type);

vgi_check vgi_check_provenance, vgi_check_mesh, vgi_check_texture, vgi_check_labels, vgi_check_colours, vgi_check_asset,
    vgi_check_selection, vgi_check_links, vgi_check_anchors, vgi_check_skeleton, vgi_check_correspondence, vgi_check_patches, vgi_check_rig,
    vgi_check_skin, vgi_check_map, vgi_check_signal, vgi_check_network;

/* vgi_wrong: VG_EINPUT, "where: what". */
int vgi_wrong(const char *where, const char *what, vg_err *e);
/* vgi_are_turns: whether q holds n unit quaternions, to 1e-6; false for NaN. */
bool vgi_are_turns(const double *q, size_t n);
/* vgi_check_ascending: indices below a limit, each greater than the one before. */
int vgi_check_ascending(const char *where, const uint32_t *list, size_t n, size_t limit, vg_err *e) VG_MUST_CHECK;

#endif
