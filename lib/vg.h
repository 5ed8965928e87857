/* vg.h: the one public header of libvg, the library under the vg-* programs.
 *
 * It is made of parts, by what a caller wants; each includes what it needs of the others:
 *
 *   vg/core.h      errors and bytes            vg/pairs.h     meshes of different connectivity
 *   vg/rotation.h  quaternions                 vg/patches.h   faces that turn alike, and their map
 *   vg/body.h      mesh, skeleton, rig         vg/rig.h       skeletons that drive a mesh
 *   vg/frames.h    head, artefacts, frames     vg/measures.h  errors, digest
 *   vg/vectors.h   the vector graph            vg/io.h        streams, mesh files, archives
 *   vg/markers.h   small text files            vg/view.h      pictures and pages of sequences
 *   vg/signal.h    continuous signals          vg/plot.h      charts of numbers
 *   vg/network.h   a trained network           vg/net.h       features, training, generation
 *   vg/smooth.h    noise taken out of a sequence
 *
 * Conventions. Arrays of points and vectors are interleaved: xyzxyz... Index base is 0. Lengths are in the unit of
 * the mesh. D is the diagonal of the bounding box of the reference pose. Functions that can fail return an int:
 * VG_OK or more on success, a negative vg_code on failure, with the details in *e (e may be NULL). Whoever calls
 * _new or _open calls _free or _close, which take the address of the pointer and leave NULL there. Structs are
 * prepared by = {0} and released by _clear, which leaves them zero; _copy writes over what was there, and leaves
 * zero when it fails. Where a thing takes threads, these must be >= 1, and calls on it go one after another; the
 * results do not depend on their number. The library never prints and never exits. The mathematics is cited as (T n)
 * from the thesis on vector graphs that the man page vg(7) names.
 *
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_H
#define VG_H

#define VG_VERSION "0.1.0"

#include "vg/core.h"
#include "vg/rotation.h"
#include "vg/body.h"
#include "vg/network.h"
#include "vg/frames.h"
#include "vg/vectors.h"
#include "vg/markers.h"
#include "vg/pairs.h"
#include "vg/patches.h"
#include "vg/rig.h"
#include "vg/signal.h"
#include "vg/smooth.h"
#include "vg/measures.h"
#include "vg/net.h"
#include "vg/io.h"
#include "vg/view.h"
#include "vg/plot.h"

#endif
