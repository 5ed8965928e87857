#!/bin/sh
# files.sh OUTDIR: the files that the commands of the README name, made of those in tests/data: a man, a horse, two heads, dinosaurs.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC1091,SC2016,SC2154
set -eu
. "$(dirname "$0")/run.sh"

printf '\n# a man of 15 poses, and the first pose of a heavier one; their skeletons in the same poses\n'
run 'vg-encode $data/human-man-poses.tar.xz | vg-decode -q -o man.zip'
run 'vg-encode --take 0 $data/human-heavy-poses.tar.xz | vg-decode -q -o heavy.obj'
run 'xz -dc $data/human-man-poses.bvh.xz >man.bvh'
run 'xz -dc $data/human-heavy-poses.bvh.xz >heavy.bvh'

printf '\n# a head with the shapes of its face, and another one\n'
run 'mkdir -p shapes && vg-decode -q --replace $data/faceA.tar.xz -o shapes/'
run 'mv "$(ls shapes/*.obj | head -n 1)" neutral.obj'
run 'vg-encode --take 0 $data/faceB.tar.xz | vg-decode -q -o head.obj'

printf '\n# a horse, its gallop, three poses of it, and a pony, which is broader; the true gallop of the pony does not exist: a first one stands for it\n'
run 'cp $data/horse.rest.obj horse.obj'
run 'vg-decode -q $data/horse-run.tar.xz -o gallop.zip'
run 'vg-encode --take 0,5,9 gallop.zip | vg-decode -q --replace -o "pose%d.obj" && mv pose0.obj a.obj && mv pose1.obj b.obj && mv pose2.obj c.obj'
run 'awk "\$1 == \"v\" {\$2 *= 1.3} {print}" horse.obj >pony.obj'
run 'vg-encode --reference horse.obj gallop.zip | vg-deform --onto pony.obj | vg-solve | vg-decode -q -o truth.zip'
run 'vg-encode --take 0,20 truth.zip | vg-decode -q --replace -o "pony%d.obj" && mv pony0.obj pony-a.obj && mv pony1.obj pony-z.obj'

printf '\n# a velociraptor that runs, and a trex\n'
run 'cp $data/velociraptor.rest.obj velociraptor.obj'
run 'vg-decode -q $data/velociraptor-run.tar.xz -o run.zip'
run 'cp $data/trex.rest.obj trex.obj'
run 'cp $data/velociraptor-trex.markers.txt markers.txt'
