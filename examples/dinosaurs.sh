#!/bin/sh
# dinosaurs.sh OUTDIR: a transfer between meshes of different connectivity: a velociraptor's run, and a trex that runs alike.
# Makes the README's pictures of it, and the animation at its top.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC1091,SC2016,SC2154
set -eu
. "$(dirname "$0")/run.sh"

run 'vg-register -q $data/velociraptor.rest.obj $data/trex.rest.obj --markers $data/velociraptor-trex.markers.txt -o pairs.vgs'
run 'vg-info pairs.vgs'
run 'vg-encode --reference $data/velociraptor.rest.obj $data/velociraptor-run.tar.xz -o velociraptor.vgs'
run 'vg-deform --onto $data/trex.rest.obj --correspondence pairs.vgs velociraptor.vgs | vg-solve -o trex.vgs'
run 'vg-view velociraptor.vgs --frames 5 --columns 5 --size 280x200 --ground -o velociraptor.png'
run 'vg-view trex.vgs --frames 5 --columns 5 --size 280x200 --ground -o trex.png'
run 'vg-view velociraptor.vgs --beside trex.vgs --size 330x250 --ground -o dinosaurs.webp'
