#!/bin/sh
# stout.sh OUTDIR: a target made by hand. A woman's rest pose is widened by a few lines of awk, and jumps as she does: her
# body, hair and clothes, which are six components, stay together.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC1091,SC2016,SC2154
set -eu
. "$(dirname "$0")/run.sh"

# Wider around the height of the hips. The arms, which stretch out along x, are moved, not drawn out.
run 'tr -d "\r" <$data/woman-tanktop.rest.obj | awk '\''
    $1 == "v" {
        height = ($3 - 2.5) / 1.1
        wider = 1.1 * exp(-height * height)
        trunk = $2 > 0.45 ? 0.45 : $2 < -0.45 ? -0.45 : $2
        print "v", $2 + wider * trunk, $3, $4 * (1 + 1.1 * wider * exp(-($2 / 0.8) ^ 2))
        next
    }
    { print }'\'' >stout.obj'

run 'vg-encode --reference $data/woman-tanktop.rest.obj $data/woman-tanktop-jump.tar.xz -o jump.vgs'
run 'vg-deform --onto stout.obj jump.vgs | vg-solve | vg-decode -o stout.zip'
run 'vg-view $data/woman-tanktop.rest.obj jump.vgs -o jump.png'
run 'vg-view stout.obj stout.zip -o stout.png'
