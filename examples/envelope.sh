#!/bin/sh
# envelope.sh OUTDIR: example poses in, a rig out, new poses applied. A man's skeleton drives him through poses that
# were not fitted, and a trex, of which only the rest skeleton is known, learns to walk and attacks; linear blend
# skinning of the same fit stands beside it.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC1091,SC2016,SC2154
set -eu
. "$(dirname "$0")/run.sh"

# rows NUMBERS BVH: the BVH file with these frames alone, counted from 1
rows() {
    awk -v rows="$1" 'BEGIN { n = split(rows, row, " "); for (i in row) wanted[row[i]] }
        /^Frames:/ { print "Frames: " n; next }
        motion { if (++frame in wanted) print; next }
        { print }
        /^Frame Time/ { motion = 1 }' "$2"
}

# leg OBJ: of a trex, the faces of its left leg below the knee, told by their vertices in the rest pose
leg() {
    awk 'FNR == NR { if ($1 == "v" && ++v && $2 > 0.8 && $3 < 6.5 && $4 < 4.5) kept[v] = 1; next }
        $1 == "v" && ++w in kept { number[w] = ++n; print }
        $1 == "f" { line = "f"
            for (i = 2; i <= NF; i++) {
                split($i, at, "/")
                if (!(at[1] in kept)) next
                line = line " " number[at[1]]
            }
            print line }' "$data/trex.rest.obj" "$1"
}

printf '\n# A man in 15 poses, four of which are set aside; his skeleton, with a frame for each:\n'
run 'vg-decode --replace $data/human-man-poses.tar.xz -o poses/'
run 'xz -dc $data/human-man-poses.bvh.xz >man.bvh'
run 'mkdir -p aside && mv poses/*_003_* poses/*_006_* poses/*_007_* poses/*_010_* aside/'
run 'rows "1 2 3 5 6 9 10 12 13 14 15" man.bvh >fit.bvh; rows "4 7 8 11" man.bvh >dance.bvh'

printf '\n# The rig, an envelope mixed with skinning, and linear blend skinning alone; their errors in the poses they were fitted to:\n'
run 'vg-fitmap --skeleton fit.bvh poses/ -o man.rig'
run 'vg-fitmap -q --method lbs --skeleton fit.bvh poses/ -o skinning.rig'

printf '\n# The poses that were set aside, by the skeleton alone:\n'
run 'vg-encode --reference poses/human-man_000_rest.obj aside/ -o truth.vgs'
run 'vg-play man.rig dance.bvh -o envelope.vgs'
run 'vg-play skinning.rig dance.bvh -o skinning.vgs'
run 'vg-diff truth.vgs envelope.vgs | grep -E "^(mean|max)"'
run 'vg-diff truth.vgs skinning.vgs | grep -E "^(mean|max)"'
run 'vg-view truth.vgs --beside envelope.vgs --beside skinning.vgs --against truth.vgs \
    --size 240x210 --view 25,10 -o envelope.png'

printf '\n# By hand, and as a skin for engines:\n'
run 'vg-play man.rig --edit "lowerarm01.L y -80" --edit "upperleg01.R x -60" \
    --edit "lowerleg01.R x 70" -o edited.vgs'
run 'vg-view edited.vgs --size 400x400 -o edited.png'
run 'vg-play man.rig --transforms dance.bvh | vg-decode -o skin.glb'

printf '\n# A trex: how its bones move is learned from the poses. Then it attacks, by its joints:\n'
run 'vg-encode --reference $data/trex.rest.obj $data/trex-walk.tar.xz -o walk.vgs'
run 'vg-fitmap --skeleton $data/trex.skeleton.txt walk.vgs -o trex.rig'
run 'vg-fitmap -q --method lbs --skeleton $data/trex.skeleton.txt walk.vgs -o trex-skinning.rig'
run 'xz -dc $data/trex-attack.joints.txt.xz | grep -v "^000" >attack.joints.txt'
run 'vg-encode --mesh $data/trex.skeleton.txt attack.joints.txt | vg-play trex.rig -o attack.vgs'
run 'vg-encode --reference $data/trex.rest.obj $data/trex-attack.tar.xz |
    vg-view - --beside attack.vgs --frames 5 --size 280x200 --view 60,10 -o attack.png'

printf '\n# Its foot in the walk, close up: as it is, by the rig, by skinning alone:\n'
run 'vg-decode --replace walk.vgs -o steps/'
run 'vg-play trex.rig walk.vgs | vg-decode --replace -o steps-envelope/'
run 'vg-play trex-skinning.rig walk.vgs | vg-decode --replace -o steps-skinning/'
run 'for i in "" -envelope -skinning; do
    mkdir -p foot$i
    for n in 012 017 022; do leg steps$i/trex-walk_$n.obj >foot$i/$n.obj; done
done'
run 'vg-view foot --beside foot-envelope --beside foot-skinning --against foot --edges \
    --size 240x210 --view 130,10 -o foot.png'
