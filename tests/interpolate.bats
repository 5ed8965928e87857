#!/usr/bin/env bats
# Interpolation through the programs: keys exact, rigid turns rigid, names and times, smooth paths, morphing, refusals.
# The unit test has the volume of a limb, the bar beyond a whole turn, and degenerate faces.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# turned DEGREES DX: the vertices of an OBJ on standard input turned about a skew axis, then moved along x
turned() {
    LC_ALL=C awk -v a="$1" -v dx="$2" 'BEGIN {
        a *= atan2(0, -1) / 180; c = cos(a); n = sin(a); x = 2 / 7; y = -3 / 7; z = 6 / 7; d = 1 - c
    }
    $1 == "v" {
        p = (c + x * x * d) * $2 + (x * y * d - z * n) * $3 + (x * z * d + y * n) * $4
        q = (y * x * d + z * n) * $2 + (c + y * y * d) * $3 + (y * z * d - x * n) * $4
        r = (z * x * d - y * n) * $2 + (z * y * d + x * n) * $3 + (c + z * z * d) * $4
        printf "v %.17g %.17g %.17g\n", p + dx, q, r
        next
    }
    { print }'
}

# every_eighth ARCHIVE: keys/ and, between them, truth/
every_eighth() {
    must vg-decode --f64 "$1" -o all/
    mkdir keys truth
    local i=0 file waiting=()
    for file in all/*; do
        if [ $((i % 8)) = 0 ]; then
            cp "$file" keys/
            [ ${#waiting[@]} = 0 ] || mv "${waiting[@]}" truth/
            waiting=()
        else
            waiting+=("$file")
        fi
        i=$((i + 1))
    done
    at=$(python3 -c 'import sys; print(",".join(repr(i / 8) for i in range(8 * int(sys.argv[1])) if i % 8))' "$(($(ls keys | wc -l) - 1))")
}

@test "every key of every data set is met within 1e-10 D, straight and smooth" {
    for set in trex-walk horse-run woman-tanktop-jump faceA human-man-poses; do
        must vg-encode "$DATA/$set.tar.xz" -o in.vgs
        n=$(vg-info --json in.vgs | python3 -c 'import json, sys; print(json.load(sys.stdin)["frames"])')
        for smooth in '' --smooth; do
            pipe "vg-interpolate $smooth $n in.vgs 2>/dev/null | vg-solve >out.vgs"
            must vg-diff -t 1e-10 in.vgs out.vgs
        done
    done
}

@test "a pose turned by 170 degrees: every pose between is that pose turned by part of it, and outside by more" {
    mesh=$DATA/trex.rest.obj
    turned 170 3 <"$mesh" >b.obj
    for t in 0.25 0.5 0.9 1.2 -0.5; do
        turned "$(python3 -c "print(170 * $t)")" 0 <"$mesh" >truth.obj
        pipe "vg-encode '$mesh' b.obj | vg-interpolate --at $t | vg-solve >out.vgs"
        must vg-diff -c -t 1e-9 truth.obj out.vgs
    done
}

@test "selected faces, vectors and deformations on the way in" {
    set=$DATA/woman-tanktop-jump.tar.xz
    pipe "vg-encode '$set' | vg-interpolate --at 0.5,3.25 | vg-solve >want.vgs"
    pipe "vg-encode --vectors '$set' | vg-interpolate --at 0.5,3.25 | vg-solve >out.vgs"
    must vg-diff -t 1e-10 want.vgs out.vgs
    must vg-encode --faces selected "$set" -o selected.vgs
    pipe "vg-interpolate 26 selected.vgs | vg-solve >out.vgs"
    must vg-diff -t 1e-10 "$set" out.vgs
    pipe "vg-encode '$set' | vg-deform | vg-interpolate --at 0,7,25 2>/dev/null | vg-solve >out.vgs"
    pipe "vg-encode '$set' | vg-interpolate --at 0,7,25 | vg-solve >want.vgs"
    must vg-diff -t 1e-10 want.vgs out.vgs
}

@test "frames are named after keys and moment, in the order asked for" {
    poses two 3
    pipe "vg-encode pose1.obj pose2.obj pose3.obj | vg-interpolate --at 1.5,0,-0.5,0.25,1,2,2.75 | vg-solve >out.vgs"
    py <<'END'
from read_stream import read_stream
names = [f.name for f in read_stream("out.vgs").frames]
assert names == ["pose2~pose3@0.5", "pose1", "pose1~pose2@-0.5", "pose1~pose2@0.25", "pose2", "pose3", "pose2~pose3@1.75"], names
END
    pipe "vg-encode pose1.obj pose2.obj pose3.obj | vg-interpolate 5 | vg-solve >out.vgs"
    py <<'END'
from read_stream import read_stream
names = [f.name for f in read_stream("out.vgs").frames]
assert names == ["pose1", "pose1~pose2@0.5", "pose2", "pose2~pose3@0.5", "pose3"], names
END
    pipe "vg-encode pose1.obj pose3.obj | vg-interpolate 1 | vg-solve >out.vgs"
    must vg-diff -t 1e-10 pose1.obj out.vgs
}

@test "times are interpolated, and go on outside; without times there are none" {
    poses cube 3
    must vg-encode pose1.obj pose2.obj pose3.obj -o plain.vgs
    must vg-decode --quiet plain.vgs -o in.mdd
    pipe "vg-encode in.mdd | vg-interpolate --at 0.5,1,3 >timed.vgs"
    pipe "vg-interpolate --at 0.5,1,3 plain.vgs >untimed.vgs"
    must vg-encode in.mdd -o keys.vgs
    py <<'END'
from read_stream import read_stream
key = [f.time for f in read_stream("keys.vgs").frames]
assert None not in key and key[0] < key[1] < key[2], key
got = [f.time for f in read_stream("timed.vgs").frames]
want = [(key[0] + key[1]) / 2, key[1], 2 * key[2] - key[1]]
assert all(abs(a - b) < 1e-12 for a, b in zip(got, want)), (got, want)
assert [f.time for f in read_stream("untimed.vgs").frames] == [None] * 3
END
}

@test "times that do not grow say nothing about speed" {
    py <<'END'
import make_corpus as m
points = [m.POINTS[:4], m.BENT[:4], [[x + 1, y, z] for x, y, z in m.POINTS[:4]]]
for name, times in ("plain", (None, None, None)), ("same", (0, 0, 1)), ("back", (0, 2, 1)), ("grow", (0, 1, 4)):
    m.write(name + ".vgs", m.whole(m.content(frames=[m.pose("p%d" % i, p, time=t) for i, (p, t) in enumerate(zip(points, times))])))
END
    for name in plain same back grow; do
        pipe "vg-interpolate --smooth --at 0.25,0.5,1.5 $name.vgs | vg-solve -o $name-between.vgs"
    done
    must vg-diff -t 0 plain-between.vgs same-between.vgs
    must vg-diff -t 0 plain-between.vgs back-between.vgs
    must_fail 1 vg-diff -t 1e-6 plain-between.vgs grow-between.vgs
}

@test "an anchor is where its keys have it" {
    poses two 3
    pipe "vg-encode --anchor 0,9 pose1.obj pose2.obj pose3.obj | vg-interpolate --smooth 3 | vg-solve >out.vgs"
    must vg-encode pose1.obj pose2.obj pose3.obj -o want.vgs
    must vg-diff -t 1e-10 want.vgs out.vgs
}

@test "every eighth frame of a walk: the frames between, by the known errors" {
    every_eighth "$DATA/trex-walk.tar.xz"
    pipe "vg-encode keys | vg-interpolate --at $at | vg-solve >straight.vgs"
    pipe "vg-encode keys | vg-interpolate --smooth --at $at | vg-solve >smooth.vgs"
    at_most "$(vertex_error mean -c truth straight.vgs)" 7.8e-3
    at_most "$(vertex_error mean -c truth smooth.vgs)" 6.3e-3
}

@test "poses between go on into transfer, and give the same as when transferred first" {
    a=$DATA/human-man-poses.tar.xz
    pipe "vg-encode '$a' | vg-interpolate --at 0,1,2 | vg-deform --onto '$DATA/human-heavy-poses.tar.xz' | vg-solve >after.vgs"
    pipe "vg-encode '$a' | vg-deform --onto '$DATA/human-heavy-poses.tar.xz' | vg-interpolate --at 0,1,2 | vg-solve >before.vgs"
    must vg-diff -t 1e-9 before.vgs after.vgs
}

@test "morphing: what vg-register fitted is the second pose" {
    mesh=$DATA/horse.rest.obj
    turned 20 0.5 <"$mesh" | LC_ALL=C awk '$1 == "v" {print "v", 1.2 * $2, $3, 0.9 * $4; next} {print}' >other.obj
    python3 - "$mesh" >markers.txt <<'END'
import sys
n = sum(line.startswith('v ') for line in open(sys.argv[1]))
print(*(f'{i} {i}' for i in range(0, n, n // 12)), sep='\n')
END
    capture vg-register "$mesh" other.obj --markers markers.txt -o fitted.vgs
    [ "$status" = 0 ]
    pipe "vg-encode '$mesh' fitted.vgs | vg-interpolate --at 0,0.5,1 | vg-solve >out.vgs"
    must vg-encode "$mesh" fitted.vgs -o keys.vgs
    pipe "vg-interpolate --at 0,1 keys.vgs | vg-solve >ends.vgs"
    must vg-diff -t 1e-10 keys.vgs ends.vgs
    [ "$(vg-info --json out.vgs | python3 -c 'import json, sys; print(json.load(sys.stdin)["frames"])')" = 3 ]
}

@test "the same bytes whatever the number of threads" {
    must vg-encode "$DATA/human-man-poses.tar.xz" -o in.vgs
    for smooth in '' --smooth; do
        must vg-interpolate --no-provenance -j 1 $smooth --at 0.3,2.5,4.1 in.vgs -o one.vgs
        must vg-interpolate --no-provenance -j 3 $smooth --at 0.3,2.5,4.1 in.vgs -o three.vgs
        same_file one.vgs three.vgs
    done
}

@test "wrong usage" {
    poses cube 2
    must_fail 2 vg-interpolate 3 --at 0.5 pose1.obj
    says "--at defines which poses are written"
    must_fail 2 vg-interpolate --smooth pose1.obj
    says "the number of poses is from 1"
    must_fail 2 vg-interpolate 0 pose1.obj
    for list in '' ',' '0,' ,1 x 0.5,nan 1e999; do must_fail 2 vg-interpolate --at "$list" pose1.obj; done
    must_fail 2 vg-interpolate 3 --onto pose2.obj pose1.obj
    says "unknown option '--onto'"
}

@test "one pose is no path, and numbers that overflow are refused" {
    poses cube 2
    pipe_fail 3 "vg-encode pose1.obj | vg-interpolate 3 >out.vgs"
    says "there is one pose in the input, but a path needs at least two"
    LC_ALL=C awk '$1 == "v" {print "v", 9 * $2, 9 * $3, 9 * $4; next} {print}' pose1.obj >large.obj
    pipe_fail 2 "vg-encode pose1.obj large.obj | vg-interpolate --at 1e6 >out.vgs"
    says "so far outside that numbers overflow"
}

@test "--speed: every keyth frame is a key, times last as much longer, and animations are numbered on" {
    for i in 1 2 3 4 5; do mesh cube "0.$i" >"Walk.000$i.obj"; done
    must vg-encode --fps 10 'Walk.*.obj' -o walk.vgs
    pipe 'vg-interpolate --speed 0.5 walk.vgs | vg-solve -o slow.vgs'
    py <<'END'
import read_stream
a, b = (read_stream.read_stream(n).frames for n in ("walk.vgs", "slow.vgs"))
assert [f.name for f in b] == ["Walk.%04d" % (i + 1) for i in range(9)]
assert all(abs(f.time - 0.1 * i) < 1e-12 for i, f in enumerate(b))
for i, f in enumerate(a):
    assert max(abs(x - y) for x, y in zip(f.values, b[2 * i].values)) < 1e-9
END
    pipe 'vg-interpolate --speed 3 walk.vgs | vg-solve | vg-diff -t 1e-9 <(vg-encode --take 0-/3 walk.vgs) -'
    must_fail 2 vg-interpolate --speed 0.5 --at 1,2 walk.vgs
    must_fail 2 vg-interpolate --speed 0.5 30 walk.vgs
    must_fail 2 vg-interpolate --speed 0 walk.vgs
}
