/* artefact_io.h: reads and writes header records by the table of model/artefact.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ARTEFACT_IO_H
#define VG_ARTEFACT_IO_H

#include "io/payload.h"
#include "model/artefact.h"

/* vgi_artefact_decode: decode and check the payload of a record into h. On failure h may only be cleared. */
int vgi_artefact_decode(const vgi_artefact *t, const vgi_payload *p, vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vgi_artefact_encode: append the record of h (i: number of a repeating record); b starts at the first byte of the
 * payload. */
int vgi_artefact_encode(const vgi_artefact *t, vg_bytes *b, const vg_head *h, size_t i, vg_err *e) VG_MUST_CHECK;

/* vgi_is_earlier_provenance: whether this PROV record has the earlier form, with counts of 32 bits
 * (fmt/CHANGES.md). */
bool vgi_is_earlier_provenance(const vgi_artefact *t, const vgi_payload *p);

#endif
