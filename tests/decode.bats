#!/usr/bin/env bats
# vg-decode: poses become a file, numbered files, a directory or an archive, whole or not at all.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

@test "one pose into one file, in every format, by all digits" {
    must vg-encode "$DATA/horse.rest.obj" -o in.vgs
    for name in a.obj a.ply a.off; do
        must vg-decode --f64 in.vgs -o $name
        must vg-diff -t 0 "$DATA/horse.rest.obj" $name
        must vg-decode in.vgs -o $name
        must vg-diff -t 1e-7 "$DATA/horse.rest.obj" $name
    done
    for format in obj ply ply-ascii ply-be off; do
        must vg-decode --f64 --format $format in.vgs -o out
        must vg-diff -t 0 "$DATA/horse.rest.obj" out
        pipe "vg-decode --f64 --format $format -o - <in.vgs | vg-encode --no-provenance >back.vgs"
        must vg-diff -t 0 in.vgs back.vgs
    done
}

@test "many poses into one file are refused, and the message says how to name the output" {
    poses cube 2
    must vg-encode pose*.obj -o in.vgs
    must_fail 2 vg-decode in.vgs -o out.obj
    one_line
    says "'out.obj'" "%"
    nothing_but pose1.obj pose2.obj in.vgs
}

@test "a pattern numbers the poses in order" {
    poses cube 12
    mkdir in && mv pose*.obj in
    must vg-encode in -o in.vgs
    must vg-decode in.vgs -o 'out-%03d.obj'
    for i in 0 5 11; do must vg-diff -t 1e-7 in/pose$((i + 1)).obj "out-$(printf %03d $i).obj"; done
    [ "$(find . -name 'out-*' | wc -l)" = 12 ]
    must vg-decode --first-number 8 in.vgs -o 'next%d.ply'
    nothing_but in in.vgs out-0{00..11}.obj next{8..19}.ply 2>/dev/null ||
        nothing_but in in.vgs out-00{0..9}.obj out-01{0,1}.obj next{8..19}.ply
}

@test "a directory and every archive keep names, order and numbers" {
    poses two 12
    mkdir in && mv pose*.obj in
    must vg-encode in -o in.vgs
    for to in out/ out.zip out.tar out.tar.gz out.tar.xz out.tar.zst out.7z out2.zip:ply out2/:off; do
        must vg-decode --f64 in.vgs -o "$to"
        must vg-encode "${to%:*}" -o back.vgs
        py <<'END'
import read_stream
a, b = read_stream.read_stream("in.vgs"), read_stream.read_stream("back.vgs")
assert [f.name for f in a.frames] == [f.name for f in b.frames] == ["pose%d" % (i + 1) for i in range(12)]
assert a.mesh.faces() == b.mesh.faces()
for p, q in zip(a.frames, b.frames):
    assert p.values == q.values, p.name
END
    done
    [ "$(ls out | head -n 1)" = pose1.obj ]
    [ "$(ls out2 | head -n 1)" = pose1.off ]
}

@test "faces and vertices keep their order: polygons, line segments and isolated vertices" {
    { mesh strip && echo 'v 9 9 9'; } >a.obj
    must vg-encode a.obj -o in.vgs
    for name in b.obj b.ply b.off; do
        capture vg-decode --f64 in.vgs -o $name
        [ "$status" = 0 ] || continue # a format without line segments says so
        must vg-encode $name -o back.vgs
        must vg-diff -t 0 in.vgs back.vgs
    done
    [ -e b.obj ]
}

@test "vectors and other kinds are refused: there is nothing to draw" {
    mesh cube >a.obj
    must vg-encode --vectors a.obj -o vectors.vgs
    must vg-deform a.obj -o deformations.vgs
    for kind in vectors deformations; do
        must_fail 3 vg-decode $kind.vgs -o out.obj
        one_line
        says "holds $kind" "through 'vg-solve' first"
    done
    must_fail 3 vg-decode "$GOLDEN/transforms.vgs" -o out.obj
    nothing_but a.obj vectors.vgs deformations.vgs
}

@test "the name of the output is checked before any work" {
    for to in a.xyz noname a.obj.gz 'a-%s.obj' 'a-%d-%d.obj' 'a-%.obj' 'a-%021d.obj' 'a-%4d.obj' ''; do
        must_fail 2 vg-decode -o "$to" none.vgs # which is not there: it was not looked at
        says vg-decode:
    done
    must_fail 2 vg-decode none.vgs
    says "-o"
    must_fail 2 vg-decode --format xyz -o a.obj none.vgs
    says "'xyz'"
    must_fail 2 vg-decode --first-number x -o a.obj none.vgs
    must_fail 2 vg-decode --bogus -o a.obj none.vgs
    must_fail 4 vg-decode -o a.obj none.vgs
    says "'none.vgs'"
    nothing_but
}

@test "frames come back in their order, with a number in front where names do not give it" {
    poses cube 2
    pipe "vg-encode pose1.obj pose2.obj | vg-interpolate --at 0,0.125,0.25,0.5,1 | vg-solve -o between.vgs"
    pipe "vg-encode pose1.obj pose2.obj | vg-interpolate --at 1,0.5,0,-0.5 | vg-solve -o back.vgs"
    for to in out/ out.zip out.tar.gz; do
        must vg-decode --f64 between.vgs -o $to # decimals sort
        must vg-diff -t 1e-12 between.vgs $to
        must vg-info --frames $to
        shows 'pose1~pose2@0.125'
    done
    for to in back/ back.zip back.7z; do
        must_warn vg-decode --f64 back.vgs -o $to
        one_line
        says 'number as prefix' "'0001_pose1~pose2@0.5.obj'"
        must vg-diff -t 1e-12 back.vgs $to
    done
    [ "$(ls back | head -n 1)" = 0000_pose2.obj ]
    mkfifo pipe.zip
    cat pipe.zip >copy.zip &
    must_warn vg-decode --f64 back.vgs -o pipe.zip # packed anew, though a pipe
    wait $!
    same_file copy.zip back.zip
    must_warn vg-decode --f64 -j3 back.vgs -o back3.zip
    same_file back3.zip back.zip
}

@test "a set of files is not mixed with one that is there" {
    poses cube 4
    must vg-encode pose*.obj -o four.vgs
    must vg-encode --take 0-1 four.vgs -o two.vgs
    for to in out/ 'p-%02d.ply'; do
        must vg-decode four.vgs -o "$to"
        must_fail 2 vg-decode two.vgs -o "$to"
        one_line
        says 'already' '--replace'
        must_fail 2 vg-decode none.vgs -o "$to" # before any work
        says 'already'
        head -c -16 two.vgs >cut.vgs
        must_fail 3 vg-decode --replace cut.vgs -o "$to" # nothing is replaced
        must vg-diff -t 1e-6 four.vgs "$(sed 's/%02d/*/' <<<"$to")"
        must vg-decode --replace two.vgs -o "$to"
        must vg-diff -t 1e-6 two.vgs "$(sed 's/%02d/*/' <<<"$to")"
    done
    [ "$(ls out)" = $'pose1.obj\npose2.obj' ]
    must vg-decode --first-number 2 two.vgs -o 'p-%02d.ply' # goes on behind what is there
    [ "$(echo p-*.ply)" = 'p-00.ply p-01.ply p-02.ply p-03.ply' ]
}

@test "a failure leaves nothing: cut input, a place that does not exist" {
    poses cube 5
    must vg-encode pose*.obj -o in.vgs
    head -c -16 in.vgs >cut.vgs
    for to in 'out-%d.obj' out/ out.zip out.tar.gz; do
        must_fail 3 vg-decode cut.vgs -o "$to"
        one_line
        says "cut short"
    done
    must_fail 4 vg-decode in.vgs -o none/out.zip
    must_fail 4 vg-decode in.vgs -o 'none/out-%d.obj'
    nothing_but pose{1..5}.obj in.vgs cut.vgs
}

@test "what was there stays when the run fails, and is replaced when it does not" {
    poses cube 3
    must vg-encode pose1.obj -o one.vgs
    head -c -8 one.vgs >cut.vgs
    echo precious >out.obj
    must_fail 3 vg-decode cut.vgs -o out.obj
    [ "$(cat out.obj)" = precious ]
    must vg-decode one.vgs -o out.obj
    must vg-diff -t 1e-7 pose1.obj out.obj
}

@test "a sequence without poses" {
    must vg-encode "$GOLDEN/empty-sequence.vgs" -o empty.vgs
    capture vg-decode empty.vgs -o out/
    [ "$status" = 0 ] || [ "$status" = 3 ] || fail "status $status"
    must_fail 3 vg-decode empty.vgs -o out.obj
    for archive in out.zip out.tar.gz; do # whole, with nothing in it
        must vg-decode -q empty.vgs -o $archive
        must_fail 3 vg-info $archive
        says "archive '$archive' holds no mesh file"
    done
}

@test "names that would leave the directory, or are none, do not make files" {
    for name in ../out . .. a/b / "" -; do
        py "$name" <<'END'
import sys, make_corpus as m
m.write("in.vgs", m.whole(m.content(frames=[m.pose(sys.argv[1], m.content()["frames"][0]["values"])])))
END
        mkdir -p below && cd below || return 1
        for to in out/ out.zip; do
            if [ "$name" = - ]; then
                must vg-decode ../in.vgs -o $to
            else
                must_warn vg-decode ../in.vgs -o $to
                says 'number as prefix'
            fi
            must vg-info $to
            shows 'frames     1: '
        done
        [ "$(ls -A out | wc -l)" = 1 ]
        rm -r out out.zip
        must vg-decode --replace ../in.vgs -o 'pose-%d.obj'
        cd .. || return 1
        nothing_but in.vgs below
    done
}
