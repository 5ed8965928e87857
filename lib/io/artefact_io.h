/* artefact_io.h: header records as bytes, by the table of model/artefact.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ARTEFACT_IO_H
#define VG_ARTEFACT_IO_H

#include "io/payload.h"
#include "model/artefact.h"

/* vgi_artefact_decode: the payload of a record into h, checked. On failure h may be cleared and nothing else. */
int vgi_artefact_decode(const vgi_artefact *t, const vgi_payload *p, vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vgi_artefact_encode: append what h has, number i of those that repeat; b begins on the payload's first byte. */
int vgi_artefact_encode(const vgi_artefact *t, vg_bytes *b, const vg_head *h, size_t i, vg_err *e) VG_MUST_CHECK;

/* vgi_is_earlier_provenance: is this a PROV record as it was before its counts had 64 bits (fmt/CHANGES.md)? */
bool vgi_is_earlier_provenance(const vgi_artefact *t, const vgi_payload *p);

#endif
