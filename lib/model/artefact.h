/* artefact.h: the table of header records: everything a stream says before its frames, one entry per record.
 *
 * An entry lists the fields of a struct in vg_head. Clearing, copying, reading, writing, and asking whether it is
 * there are loops over that list (artefact.c, io/artefact_io.c), so nothing else has to know a new record.
 *
 * How to add one, here a record "SIGN" for an artefact "signal" that vg-fitsignal makes:
 *
 *  1. vg/NAME.h: a struct of numbers (size_t, uint32_t, uint64_t, bool, an enum, double), texts (char *) and arrays
 *     (double *, float *, uint32_t *, uint8_t *, char **), and a member of vg_head of that type, or of vg_body when
 *     it belongs to the body whatever happens to the frames:
 *
 *         typedef struct vg_signal { size_t n, degree; double *plane; char **names; } vg_signal;
 *
 *  2. records.c: its number in the enum below, in the order in which records are written, the lengths of its arrays,
 *     its fields in the order in which they lie in the stream, and its entry in vgi_artefacts:
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
 *  3. checks.c: vgi_check_signal, which says what is wrong with it and may trust nothing but what every reader checks
 *     already: that counts and bytes agree, that numbers are finite and texts are UTF-8. It may fill fields that are
 *     marked DERIVED: these follow from the others and are copied and freed, but do not stand in the stream.
 *
 *  4. fmt/STREAM.md: the table of its fields; tests/make_corpus.py and examples/read_stream.py have such tables, too;
 *     fmt/vg-stream.ksy.
 *
 * From then on vg_head_clear, vg_head_copy, the stream, vg_load(&head, operand, "signal", &e) and its messages know it.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ARTEFACT_H
#define VG_ARTEFACT_H

#include "core/core.h"

enum { VGI_CRITICAL = 1u, VGI_COPY_SAFE = 2u };

/* In the order in which they are written. */
enum {
    VGI_PROV, VGI_MESH, VGI_TEXC, VGI_LABL, VGI_ASST, VGI_SELE, VGI_LINK, VGI_ANCH, VGI_REFP, VGI_SKEL, VGI_CORR, VGI_PTCH,
    VGI_RIG, VGI_SKIN, VGI_MAP, VGI_SIGN, VGI_NETW, VGI_ARTEFACTS
};

/* How a field lies in the stream. In memory: uint8_t, uint32_t, uint64_t, float, double, char *; a number of type U64
 * may be any unsigned member or an enum. */
typedef enum vgi_type { VGI_U8, VGI_U32, VGI_U64, VGI_F32, VGI_F64, VGI_TEXT } vgi_type;

/* How many entries an array has, before it is multiplied by its width. It is called when the fields before it are
 * known, which may be any numbers; SIZE_MAX stands for what no size can be. */
typedef size_t vgi_array_length(const void *artefact, const vg_mesh *mesh);

typedef struct vgi_member {
    vgi_type type;
    bool derived;       /* not in the stream */
    bool optional;      /* an array of length 0 is NULL */
    size_t at;          /* offset in the struct: of the number or text, or of the pointer to the array */
    size_t size;        /* bytes of the number, of an element, or of a row */
    size_t row_at;      /* arrays of structs: offset in such a row; the field is one column of the array */
    bool rows;
    size_t width;       /* elements of each entry */
    vgi_array_length *length; /* NULL: a single number or text */
} vgi_member;

/* A record's check: VG_OK, or VG_EINPUT with "where: what is wrong". artefact lies in h. */
typedef int vgi_check(vg_head *h, void *artefact, const char *where, vg_err *e);

typedef struct vgi_artefact {
    const char *tag;
    uint32_t flags;
    const char *name;   /* the name by which programs ask for it, alone or with other records; NULL: none asks */
    const char *advice; /* where to get one ("make one with vg-fitmap"); NULL: nothing is advised */
    const char *needs; /* the tag of the record that must come before; NULL: none */
    bool in_body;
    size_t at;         /* offset in vg_head, or in vg_body */
    size_t size;       /* of the struct there; 0: its fields are members of vg_head or vg_body */
    size_t present_at, present_size; /* the member of vg_head that is 0 when there is none */
    size_t mark_at;    /* with `marks`: a bool in vg_head that is set when the record has been read */
    bool marks;
    size_t each;       /* bytes of a struct when the record repeats, else 0; then `at` is that of a pointer and
                          `count_at` that of their number */
    size_t count_at;
    const vgi_member *fields;
    size_t nfields;
    vgi_check *check;
} vgi_artefact;

extern const vgi_artefact vgi_artefacts[VGI_ARTEFACTS];

/* vgi_artefact_by_tag, _by_name: NULL: unknown. Of several records of one name, such as RIG and SKIN, the first. */
const vgi_artefact *vgi_artefact_by_tag(const char *tag);
const vgi_artefact *vgi_artefact_by_name(const char *name);
/* vgi_artefact_in: where it lies in h, number i of those that repeat. */
void *vgi_artefact_in(const vgi_artefact *t, const vg_head *h, size_t i);
/* vgi_artefact_count: how many h has: 0 or 1, or of those that repeat any number. */
size_t vgi_artefact_count(const vgi_artefact *t, const vg_head *h);
/* vgi_artefact_append: room in h for one more of those that repeat, zeroed. */
int vgi_artefact_append(const vgi_artefact *t, vg_head *h, void **artefact, vg_err *e) VG_MUST_CHECK;

/* vgi_fields_clear: release what the fields hold and zero them. */
void vgi_fields_clear(const vgi_artefact *t, void *artefact);
/* vgi_fields_move: *to is cleared and becomes *from, which is left empty. */
void vgi_fields_move(const vgi_artefact *t, void *to, void *from);
/* vgi_fields_copy: `to` holds nothing that has to be released; it is cleared on failure. mesh: what lengths are
 * counted by, NULL where none needs it. */
int vgi_fields_copy(const vgi_artefact *t, void *to, const void *from, const vg_mesh *mesh, vg_err *e) VG_MUST_CHECK;
/* vgi_member_elements: elements of an array, SIZE_MAX when that is no size; of a number 1. */
size_t vgi_member_elements(const vgi_member *f, const void *artefact, const vg_mesh *mesh);
/* vgi_type_size: bytes of an element in the stream; 0 for a text. */
size_t vgi_type_size(vgi_type type);

vgi_check vgi_check_provenance, vgi_check_mesh, vgi_check_texture, vgi_check_labels, vgi_check_asset,
    vgi_check_selection, vgi_check_links, vgi_check_anchors, vgi_check_skeleton, vgi_check_correspondence, vgi_check_patches, vgi_check_rig,
    vgi_check_skin, vgi_check_map, vgi_check_signal, vgi_check_network;

/* vgi_wrong: VG_EINPUT, "where: what". */
int vgi_wrong(const char *where, const char *what, vg_err *e);
/* vgi_are_turns: n unit quaternions, to 1e-6; false for NaN. */
bool vgi_are_turns(const double *q, size_t n);
/* vgi_check_ascending: indices below a limit, each greater than the one before. */
int vgi_check_ascending(const char *where, const uint32_t *list, size_t n, size_t limit, vg_err *e) VG_MUST_CHECK;

#endif
