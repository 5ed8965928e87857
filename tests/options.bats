#!/usr/bin/env bats
# Options that stand together: what needs another, excludes another, or would do nothing is refused with status 2 before any
# work, and the message names both. What one option takes by itself is in the file of its program.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

files() {
    find . ! -name .stdout ! -name .stderr | LC_ALL=C sort
}

# refused COMMANDLINE TEXT...: status 2, each TEXT is said, and no file is made
refused() {
    local line=$1 before
    shift
    before=$(files)
    must_fail 2 timeout 300 bash -c "$line" || fail "$line" || return 1
    says "$@" || fail "$line" || return 1
    [ "$(files)" = "$before" ] || fail "made a file: $line"
}

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    poses two 3
    mesh two 0.05 2 >target.obj
    vg-encode pose*.obj -o walk.vgs
    vg-encode --vectors walk.vgs -o vectors.vgs
    vg-segment -k 2 walk.vgs -o patches.vgs
    vg-fitmap -q --patches patches.vgs walk.vgs -o map.vgs
}

@test "an option that needs another" {
    for option in '--by pose' '--root stay' '--pin always' '--correspondence x'; do
        refused "vg-deform $option walk.vgs -o out" "${option%% *} needs --onto"
    done
    refused 'vg-solve --planar-weights 1,1 vectors.vgs -o out' '--planar-weights needs --planar'
    for option in '--method lbs' '--bones-per-corner 1' '--refine 1'; do
        refused "vg-fitmap $option --patches patches.vgs walk.vgs -o out" "${option%% *} needs --skeleton, --groups or --bones"
    done
    refused 'vg-fitmap --learn --groups g walk.vgs -o out' '--learn needs --skeleton'
    refused 'vg-fitmap --root-at 0,0,0 --groups g walk.vgs -o out' '--root-at needs --skeleton'
    refused 'vg-retarget --morph 1 map.vgs -o out' 'name the new body: --onto MESH'
    refused 'vg-diff --of mean walk.vgs walk.vgs -o out' '--of needs --tolerance'
    refused 'vg-diff --no-provenance walk.vgs walk.vgs -o out' '--no-provenance' '--heat'
    refused 'vg-register --aligned --keep-all pose1.obj target.obj -o out' '--keep-all needs --markers'
    refused 'vg-register --aligned --index-base 1 pose1.obj target.obj -o out' \
        '--index-base needs --markers, --dense or --dense-source'
    refused 'vg-view --centred walk.vgs -o out.png' '--centred needs --against'
}

@test "an option that moved to another program" {
    for option in --interpolate=30 '--at 0,1' --smooth; do
        refused "vg-deform $option walk.vgs -o out" "${option%%[ =]*} is now " 'vg-interpolate'
    done
    refused 'vg-deform --interpolate 30 walk.vgs -o out' '--interpolate is now the program vg-interpolate: vg-interpolate 30'
    for option in '--map map.vgs' '--edit "a x 1"' --rotations --transforms --live; do
        refused "vg-deform $option walk.vgs -o out" "${option%% *} is now " "vg-play MAP"
    done
    refused 'vg-fitmap --retarget target.obj map.vgs -o out' '--retarget is now the program vg-retarget: vg-retarget --onto MESH MAP'
    refused 'vg-fitmap --morph 0.5 map.vgs -o out' '--morph is now an option of vg-retarget'
}

@test "operands that a program cannot do without" {
    refused 'vg-interpolate <walk.vgs -o out' 'say how many poses to write: vg-interpolate 30'
    refused 'vg-interpolate walk.vgs -o out' "the number of poses is from 1 to 1000000000, not 'walk.vgs'"
    for n in 0 1e3 1000000001 2.5 ''; do
        refused "vg-interpolate '$n' walk.vgs -o out" 'the number of poses' "not '$n'"
    done
    refused 'vg-interpolate --at 0 walk.vgs pose1.obj -o out' 'one operand too many'
    refused 'vg-interpolate 3 walk.vgs pose1.obj -o out' "one operand too many: 'pose1.obj'"
    refused 'vg-play -o out' 'name the map to play'
    refused 'vg-play map.vgs walk.vgs pose1.obj -o out' "one operand too many: 'pose1.obj'"
    refused 'vg-retarget map.vgs -o out' '--onto MESH'
}

@test "options that exclude each other" {
    refused 'vg-interpolate 3 --at 1 walk.vgs -o out' "--at defines which poses are written" "'3'"
    refused 'vg-play map.vgs --live --at 1 walk.vgs -o out' '--live does not go with --at'
    refused 'vg-play map.vgs --interpolate 3 --at 1 walk.vgs -o out' '--interpolate does not go with --at'
    refused 'vg-deform --onto target.obj --by shape --correspondence c walk.vgs -o out' '--by shape' '--correspondence'
    refused 'vg-fitmap --skeleton s --groups g walk.vgs -o out' '--skeleton does not go with --groups'
    refused 'vg-fitmap --skeleton s --patches p walk.vgs -o out' '--patches does not go with --skeleton'
    refused 'vg-register --dense a --dense-source b pose1.obj target.obj -o out' '--dense does not go with --dense-source'
    refused 'vg-view --against walk.vgs --scales walk.vgs -o out.png' '--against does not go with --scales'
    refused 'vg-view --against walk.vgs --plain walk.vgs -o out.png' '--against does not go with --plain'
    for option in --scales '--patches patches.vgs' '--scale 2'; do
        refused "vg-view --plain $option walk.vgs -o out.png" "--plain does not go with ${option%% *}"
    done
    refused 'vg-info --check --digest walk.vgs -o out' '--check does not go with --digest'
    refused 'vg-info --frames --weights map.vgs -o out' '--frames does not go with --weights'
    refused 'vg-info --weights --json map.vgs -o out' '--weights does not go with --json'
}

@test "an option that would do nothing" {
    refused 'vg-deform --onto target.obj --by shape --pin always walk.vgs -o out' '--pin' '--by shape'
    refused 'vg-deform --onto target.obj --pin always vectors.vgs -o out' '--pin needs a sequence of vertices' 'holds vectors'
    must vg-deform --onto target.obj --pin none vectors.vgs -o pinned.vgs # that is what happens
    refused 'vg-play map.vgs --edit "a x 1" --align all -o out' '--align' 'no input'
    refused 'vg-view --patches patches.vgs --against walk.vgs walk.vgs -o out.png' '--patches' '--against'
    refused 'vg-view --patches patches.vgs --scales walk.vgs -o out.png' '--patches' '--scales'
    must vg-view --patches patches.vgs --scales walk.vgs -o both.html # a page shows either
    refused 'vg-decode --first-number 3 walk.vgs -o out.zip' '--first-number' "'out.zip'"
    must_warn vg-view --scale 3 walk.vgs -o sheet.png
    says 'warning' '--scale'
}

@test "standard input is read once" {
    for line in 'vg-deform --onto - <walk.vgs' 'vg-play - <map.vgs' 'vg-deform --onto target.obj --correspondence - <walk.vgs' \
        'vg-encode --reference - <walk.vgs' 'vg-encode --mesh - <walk.vgs' 'vg-fitmap --patches - <walk.vgs' \
        'vg-fitmap --skeleton - - <walk.vgs' 'vg-retarget --onto - <map.vgs' 'vg-register - - --aligned <pose1.obj' \
        'vg-register - target.obj --markers - <pose1.obj' 'vg-register pose1.obj target.obj --markers - --dense - <pose1.obj' \
        'vg-diff - - <walk.vgs' 'vg-view --against - <walk.vgs' 'vg-view --beside - --beside - walk.vgs <walk.vgs' \
        'vg-view --patches - - <walk.vgs' 'vg-poisson --first - <walk.vgs' 'vg-poisson --first - --key 1=- walk.vgs <pose1.obj' \
        'vg-encode - - <walk.vgs'; do
        refused "$line >/dev/null" 'standard input can be read only once'
    done
    # once is enough
    pipe 'vg-deform --onto - walk.vgs <target.obj | vg-solve | vg-diff - walk.vgs'
    pipe 'vg-encode --reference - pose2.obj <pose1.obj | vg-poisson --first pose1.obj - >/dev/null'
    pipe 'vg-view walk.vgs --against - -o once.png <walk.vgs'
}

@test "names of streams that promise meshes or pictures" {
    for name in out.usda out.obj out/ 'out-%d.ply' out.zip:ply out.fbx; do
        refused "vg-solve vectors.vgs -o '$name'" "the output is a stream: pipe it into 'vg-decode -o $name'"
    done
    for name in out.png out.html out.htm; do
        refused "vg-solve vectors.vgs -o $name" "the output is a stream: pipe it into 'vg-view -o $name'"
    done
    refused 'vg-deform --onto target.obj walk.vgs -o out.obj' "pipe it into 'vg-solve | vg-decode -o out.obj'"
    refused 'vg-interpolate 3 walk.vgs -o out.png' "pipe it into 'vg-solve | vg-view -o out.png'"
    refused 'vg-play map.vgs walk.vgs -o out.glb' "pipe it into 'vg-decode -o out.glb'"
    refused 'vg-fitmap --patches patches.vgs walk.vgs -o out.glb' "a map, not poses" "'vg-play MAP POSES | vg-decode -o out.glb'"
    refused 'vg-retarget --onto target.obj map.vgs -o out.html' "'vg-play MAP POSES | vg-view -o out.html'"
    must vg-solve vectors.vgs -o out.any
}

@test "one file for the stream and the report, by whatever name" {
    for name in both ./both "$PWD/both" ../"$(basename "$PWD")"/both; do
        refused "vg-diff walk.vgs walk.vgs --heat '$name' -o both" 'cannot be both the stream and the report'
    done
    ln -s both link
    : >both
    refused 'vg-diff walk.vgs walk.vgs --heat link -o both' 'cannot be both the stream and the report'
    must vg-diff walk.vgs walk.vgs --heat a -o b
    must bash -c 'vg-diff walk.vgs walk.vgs --heat /dev/null -o /dev/null'
}

@test "--faces all: all of them, also of a stream that has some selected" {
    must vg-encode --faces selected walk.vgs -o selected.vgs
    must vg-encode selected.vgs -o kept.vgs
    must vg-encode --faces all selected.vgs -o all.vgs
    must vg-info --json kept.vgs -o kept.json
    must vg-info --json all.vgs -o all.json
    py <<'END2'
import json
kept, every = (json.load(open(name))["mesh"] for name in ("kept.json", "all.json"))
assert 0 < kept["selected_faces"] < kept["faces"] and every["selected_faces"] is None
END2
    pipe 'vg-encode --faces all --vectors selected.vgs | vg-solve | vg-diff -t 1e-12 walk.vgs -'
}
