/* rate.h: the rate of sequences without times.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RATE_H
#define VG_RATE_H

/* Frames a second of a sequence whose frames have no times, wherever a rate is needed; also in page_read.js, and stated
 * in vg(7). */
enum { VGI_FPS = 24 };

#endif
