#!/usr/bin/env bats
# The mistakes that are made most: what a program says then names what to do next. One line, and the status of the manual.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# mistake STATUS COMMANDLINE TEXT...: it fails so, and says each TEXT
mistake() {
    local want=$1 line=$2
    shift 2
    must_fail "$want" bash -c "$line"
    says "$@"
    [ "$(grep -c -v '^usage: ' <<<"$stderr")" = 1 ] || fail "more than one line:" "$stderr"
    [[ $stderr != *.$'\n'* && $stderr != *: ]] || fail "a full stop or nothing at the end:" "$stderr"
}

@test "the likely mistakes" {
    poses cube 2
    mesh tetra >tetra.obj
    echo hello >notes.txt
    mkdir empty
    vg-encode pose1.obj pose2.obj -o walk.vgs
    vg-encode --vectors walk.vgs -o vectors.vgs
    vg-deform walk.vgs -o deformations.vgs

    # files that are not there, are no meshes, are of different meshes
    mistake 4 'vg-encode missing.obj' "cannot open 'missing.obj': No such file or directory"
    mistake 4 'vg-encode "*.fbx"' "no file matches '*.fbx'"
    mistake 3 'vg-encode notes.txt' "cannot tell what 'notes.txt' is" "OBJ, PLY" "GLB" "export it"
    mistake 3 'vg-encode empty' "directory 'empty' holds no mesh file (OBJ"
    mistake 3 'vg-encode pose1.obj tetra.obj' "has 4 vertices where 'pose1.obj' has 8: all poses of a sequence have the same vertices"
    mistake 3 'vg-deform --onto tetra.obj walk.vgs' "pair them with vg-register and --correspondence"
    mistake 3 'vg-deform --onto pose2.obj --correspondence walk.vgs walk.vgs' "make one with vg-register"
    mistake 2 'vg-register pose1.obj tetra.obj' "--markers FILE"

    # a program of the pipe is forgotten
    mistake 3 'vg-decode vectors.vgs -o out.zip' "holds vectors: pipe it through 'vg-solve' first"
    mistake 3 'vg-decode deformations.vgs -o out.zip' "holds deformations: apply them with 'vg-deform --onto MESH'"
    mistake 3 'vg-view vectors.vgs -o out.png' "pipe it through 'vg-solve' first"
    mistake 3 'vg-diff walk.vgs vectors.vgs' "pipe it through 'vg-solve' first"
    mistake 3 'vg-poisson --first pose1.obj vectors.vgs' "'vg-solve' first"
    mistake 3 'vg-solve deformations.vgs' "apply them with 'vg-deform --onto MESH'"
    mistake 3 'vg-play walk.vgs walk.vgs' "make one with vg-fitmap"
    mistake 2 'vg-fitmap walk.vgs' "--patches, made by vg-segment"
    mistake 3 'true | vg-solve' "standard input is empty: did the program before it fail?"

    # the output's name
    mistake 2 'vg-decode walk.vgs' "name the output: -o poses.zip, -o 'pose-%04d.obj', or -o poses/"
    mistake 2 'vg-decode walk.vgs -o out' "cannot tell the format of 'out'" "a directory ends in '/'"
    mistake 2 'vg-decode walk.vgs -o out.fbx' "known are obj, ply"
    mistake 2 'vg-decode walk.vgs -o out.obj' "use a pattern like 'out-%04d.obj', a directory or an archive"
    mistake 2 'vg-solve vectors.vgs -o out.obj' "the output is a stream: pipe it into 'vg-decode -o out.obj'"
    mistake 2 'vg-solve vectors.vgs -o out.png' "the output is a stream: pipe it into 'vg-view -o out.png'"
    mistake 2 'vg-view walk.vgs -o out.jpg' "must end in .html, .png or .webp"
    mistake 4 'vg-decode walk.vgs -o nowhere/out.zip' "nowhere" "No such file or directory"

    # options
    mistake 2 'vg-solve --wieghts area vectors.vgs' "unknown option '--wieghts': did you mean '--weights'?"
    mistake 2 'vg-deform --on-to=pose2.obj walk.vgs' "did you mean '--onto'?"
    mistake 2 'vg-info --ver walk.vgs' "ambiguous option '--ver': it could be '--vertices' or '--version'"
    mistake 2 'vg-solve --nonsense vectors.vgs' "unknown option '--nonsense': 'vg-solve --help' lists them"
    mistake 2 'vg-solve -x vectors.vgs' "'vg-solve --help' lists them"
    mistake 2 'vg-solve vectors.vgs -o' "option '--output' needs a value: FILE"
    mistake 2 'vg-deform --by poses --onto pose2.obj walk.vgs' "'blend', 'pose', 'gradient' or 'shape', not 'poses'"
    mistake 2 'vg-deform --root x --onto pose2.obj walk.vgs' "'centroid', 'stay' or the number of a vertex, not 'x'"
    mistake 2 'vg-deform --root 99 --onto pose2.obj walk.vgs' "vertex 99, but there are 8, counted from 0"
    mistake 2 'vg-deform --by shape walk.vgs' "--by needs --onto"
    mistake 2 'vg-segment -k many walk.vgs' "a whole number from 1 on or 'auto', not 'many'"
    mistake 2 'vg-diff walk.vgs' "two sequences are needed"
    mistake 2 'vg-encode -o "" walk.vgs' "option '--output' needs the name of a file"
    mistake 2 'vg-train --checkpoint "" walk.vgs' "option '--checkpoint' needs the name of a file"
    mistake 2 'vg-train --loss "" walk.vgs' "needs bidirectional=W, kl=W or l2=W"
    mistake 2 'vg-train --loss kl=0x1 walk.vgs' "commas between, not 'kl=0x1'"
    mistake 2 'vg-generate --merge " 5%" --between 3 walk.vgs walk.vgs' "a share of the training range such as 5%, not ' 5%'"
    mistake 2 "vg-sample --at 0x10 '$GOLDEN/signal.vgs'" "times and ranges A:B:STEP"
    mistake 2 'vg-encode --array-axes vvx walk.vgs' "needs f, v and x in the order of the axes, such as vxf, not 'vvx'"
    mistake 3 'vg-poisson --key 99=pose1.obj walk.vgs' "whose numbers are 0 to 1"
    [ ! -e out.zip ] && [ ! -e out.obj ] && [ ! -e out ]
}

# ignored OPTION... FORMATS: an option for files of these formats is said to have no effect on a stream
ignored() {
    must_warn vg-encode "${@:1:$#-1}" walk.vgs -o out.vgs
    [ "$stderr" = "vg-encode: warning: ${*:1:$#-1} is for ${!#}, and no input is one" ] || fail "$stderr"
}

@test "an option that no input has a use for is named" {
    poses cube 2
    must vg-encode pose1.obj pose2.obj -o walk.vgs
    ignored --objects frames OBJ
    ignored --shapes "GLB and glTF"
    ignored --weld off "GLB and glTF"
    for option in array-axes animation; do must_warn vg-encode --$option xvf walk.vgs -o out.vgs; done
    says "warning: --animation is for GLB and glTF, and no input is one"
    # where there is one, nothing is said, whatever else is read
    must vg-decode walk.vgs -o walk.glb
    must vg-encode --weld off pose1.obj walk.glb -o out.vgs
    must vg-encode --animation sequence walk.glb -o out.vgs
}

@test "in a pipe every program names the one that failed first, and its reason, once" {
    poses cube 2
    mesh tetra >tetra.obj
    pipe_fail 3 'vg-encode pose1.obj pose2.obj tetra.obj | vg-deform --onto pose2.obj | vg-solve | vg-poisson --first pose1.obj |
        vg-decode -o out.zip'
    reason="'tetra.obj' has 4 vertices where 'pose1.obj' has 8: all poses of a sequence have the same vertices and faces"
    says "vg-encode: $reason"
    for program in vg-deform vg-solve vg-poisson vg-decode; do
        says "$program: 'standard input' was cut short: vg-encode failed with status 3: $reason"
    done
    [ "$(wc -l <<<"$stderr")" = 5 ]
    [ ! -e out.zip ]
}

@test "no poses to write is said" {
    must vg-encode "$GOLDEN/empty-sequence.vgs" -o empty.vgs
    must_warn vg-decode empty.vgs -o out.zip
    says "vg-decode: warning: the input has no poses: 'out.zip' holds none"
    [[ $stderr != *--map* ]]
    # an artefact shows its reference pose
    must_warn vg-decode "$GOLDEN/map.vgs" -o out.obj
    says "holds no poses but a map: its reference pose is written; vg-play plays it"
    must vg-diff -t 1e-7 "$GOLDEN/map.vgs" "$GOLDEN/map.vgs"
    [ -s out.obj ]
    for artefact in map signal patches network rig; do must vg-info "$GOLDEN/$artefact.vgs"; done
    for artefact in map patches network; do must vg-view "$GOLDEN/$artefact.vgs" -o "$artefact.png"; done
}
