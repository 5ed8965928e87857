#!/bin/sh
# demo.sh OUTDIR: the main job on the data in the repository. A man's poses go over to a heavier man, whose true poses are
# known, and a jump goes over to a stout woman of six components.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC1091,SC2016,SC2154
set -eu
. "$(dirname "$0")/run.sh"

printf '\n# 15 poses of a man, 13,380 vertices:\n'
run 'vg-encode $data/human-man-poses.tar.xz -o man.vgs'
run 'vg-view man.vgs --frames 15 --columns 5 -o source.png'

printf '\n# Each corner of each face turns and stretches. A heavier man, of whom one pose is taken, does the same:\n'
run 'vg-deform --onto $data/human-heavy-poses.tar.xz man.vgs | vg-solve -o heavy.vgs'
run 'vg-decode heavy.vgs -o heavy.zip'
run 'vg-view heavy.vgs --frames 15 --columns 5 -o result.png'

printf '\n# His other poses are known, too: the truth. The error is measured, must not be over 0.0074 D, and is drawn:\n'
run 'vg-diff --centred --of mean --tolerance 0.0074 $data/human-heavy-poses.tar.xz heavy.vgs'
run 'vg-view heavy.vgs --against $data/human-heavy-poses.tar.xz --centred --frames 15 --columns 5 -o errors.png'

printf '\n# What is in the result, and how it came about:\n'
run 'vg-info heavy.vgs'

printf '\n# Another example: a woman of six components jumps, and a stouter one with her.\n'
run 'sh "$root/examples/stout.sh" "$out"'

cat <<END

Look at these, in $out:
  source.png             the man's poses
  result.png, heavy.zip  the heavier man in the same poses, drawn and as OBJ files
  errors.png             how far he is from the truth
  jump.png               the jump
  stout.png, stout.zip   the stouter woman's jump, drawn and as OBJ files
END
