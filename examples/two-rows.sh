#!/bin/sh
# two-rows.sh OUTDIR: the pictures of the README. Takes some poses out of a sequence, by way of a directory, and puts source
# and result on one sheet.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC1091,SC2016,SC2154
set -eu
. "$(dirname "$0")/run.sh"

run 'vg-decode --replace $data/human-man-poses.tar.xz -o poses/'
run 'vg-decode --replace $data/human-heavy-poses.tar.xz -o truth/'
run 'for i in 000 005 006 008 009 014; do echo poses/*_${i}_*.obj; done >poses.txt'
run 'for i in 000 005 006 008 009 014; do echo truth/*_${i}_*.obj; done >truth.txt'

run 'vg-encode $(cat poses.txt) | vg-deform --onto truth/human-heavy_000_rest.obj | vg-solve -o result.vgs'
run 'vg-view $(cat poses.txt) result.vgs --frames 12 --columns 6 --size 220x240 --view 25,10 -o transfer.png'
run 'vg-encode $(cat truth.txt) | vg-view result.vgs --against - --centred --columns 6 --size 220x240 --view 25,10 -o errors.png'
