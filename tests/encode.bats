#!/usr/bin/env bats
# vg-encode: poses of files, archives, directories and streams become one stream; what is wrong with them is said.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

names() {
    py "$1" <<'END'
import sys, read_stream
print(" ".join(f.name for f in read_stream.read_stream(sys.argv[1]).frames))
END
}

@test "operands come in their order, archives and directories in natural order" {
    poses cube 12
    must vg-encode pose10.obj pose2.obj pose1.obj -o out.vgs
    names out.vgs
    [ "$output" = "pose10 pose2 pose1" ]
    mkdir dir && mv pose*.obj dir && echo text >dir/README
    must vg-encode dir -o out.vgs
    names out.vgs
    [ "$output" = "pose1 pose2 pose3 pose4 pose5 pose6 pose7 pose8 pose9 pose10 pose11 pose12" ]
    (cd dir && tar cf ../a.tar pose11.obj pose9.obj pose10.obj README)
    must vg-encode a.tar dir/pose1.obj -o out.vgs
    names out.vgs
    [ "$output" = "pose9 pose10 pose11 pose1" ]
    pipe "vg-encode <a.tar >out.vgs"
    names out.vgs
    [ "$output" = "pose9 pose10 pose11" ]
}

@test "a mesh, an archive and a stream on standard input are told apart" {
    poses cube 2
    tar cf a.tar pose1.obj pose2.obj
    must vg-encode pose1.obj pose2.obj --no-provenance -o a.vgs
    pipe "vg-encode --no-provenance <a.tar >b.vgs"
    same_file a.vgs b.vgs
    pipe "vg-encode --no-provenance <a.vgs >b.vgs"
    same_file a.vgs b.vgs
    pipe "vg-encode --no-provenance - <pose1.obj >b.vgs"
    must vg-diff -t 0 pose1.obj b.vgs
}

@test "streams, archives and files join into one sequence; the first pose is the reference unless a stream has one" {
    poses cube 5
    must vg-encode pose1.obj pose2.obj -o a.vgs
    must vg-encode --reference pose5.obj pose3.obj -o b.vgs
    must vg-encode pose4.obj b.vgs a.vgs -o out.vgs
    names out.vgs
    [ "$output" = "pose4 pose3 pose1 pose2" ]
    must vg-encode pose1.obj pose2.obj -o out.vgs
    must vg-info out.vgs
    shows "reference   pose1"
}

@test "--reference: the undeformed pose is not a pose of the sequence" {
    poses cube 3
    must vg-encode --reference pose3.obj pose1.obj pose2.obj -o out.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("out.vgs")
with open("pose3.obj") as f:
    wanted = [float(x) for line in f if line.startswith("v ") for x in line.split()[1:]]
assert list(s.reference) == wanted and s.reference_name == "pose3" and [f.name for f in s.frames] == ["pose1", "pose2"]
END
    must vg-encode --reference out.vgs pose1.obj -o again.vgs # the reference of a stream
    must vg-info again.vgs
    shows "reference   pose3"
    mesh two >two.obj
    must_fail 3 vg-encode --reference two.obj pose1.obj -o bad.vgs
    one_line
    says "12" "8" vertices
    must_fail 4 vg-encode --reference none.obj pose1.obj -o bad.vgs
    says "'none.obj'"
}

@test "--reference chooses the links anew" {
    mesh two >near.obj
    { mesh two | awk '$1 == "v" && ++n > 8 { print "v", $2 - 2.5, $3 + 1.3, $4; next } { print }'; } >other.obj
    must vg-encode --vectors near.obj -o a.vgs
    must vg-encode --vectors --reference other.obj near.obj -o b.vgs
    pipe "vg-solve a.vgs | vg-encode --vectors --reference other.obj >c.vgs" # vertices that have links already
    py <<'END'
import read_stream
a, b, c = (read_stream.read_stream(name) for name in ("a.vgs", "b.vgs", "c.vgs"))
assert len(a.links) == len(b.links) == 2 and list(a.links) != list(b.links), (a.links, b.links)
assert list(b.links) == list(c.links), (b.links, c.links)
END
    must vg-solve c.vgs -o out.vgs
    must vg-diff -t 1e-12 near.obj out.vgs
}

@test "--fps gives times from 0 on, and takes over others" {
    poses cube 3
    must vg-encode --fps 24 pose*.obj -o a.vgs
    must vg-encode --fps 30 --vectors a.vgs -o b.vgs
    py <<'END'
import read_stream
assert [f.time for f in read_stream.read_stream("a.vgs").frames] == [0, 1 / 24, 2 / 24]
assert [f.time for f in read_stream.read_stream("b.vgs").frames] == [0, 1 / 30, 2 / 30]
END
    for n in 0 -1 nan inf 1e30 x 24x ""; do
        must_fail 2 vg-encode --fps "$n" pose1.obj -o bad.vgs
        says "'--fps'"
    done
}

@test "--take: frames by number, in ranges, every other one; the reference stays, times go along or are given anew" {
    poses cube 12
    must vg-encode --fps 10 pose1.obj pose2.obj 'pose[3-9].obj' 'pose1?.obj' -o all.vgs
    while read -r frames expected; do
        must vg-encode --take "$frames" all.vgs -o out.vgs
        names out.vgs
        [ "$output" = "$expected" ] || fail "$frames" "$output"
        must vg-info out.vgs
        shows "reference   pose1"
    done <<'END'
0 pose1
11 pose12
3-5 pose4 pose5 pose6
10- pose11 pose12
0-/4 pose1 pose5 pose9
1-6/5,8,9- pose2 pose7 pose9 pose10 pose11 pose12
2-4/9 pose3
END
    # of files, of vectors, with times
    pipe "vg-encode --take 4- pose1.obj all.vgs | vg-encode --take 0-1 >out.vgs"
    names out.vgs
    [ "$output" = "pose4 pose5" ]
    must vg-encode --vectors --take 5-6 all.vgs -o out.vgs
    py <<'END'
import read_stream
a, b = read_stream.read_stream("all.vgs"), read_stream.read_stream("out.vgs")
assert [f.time for f in b.frames] == [0.5, 0.6] and b.kind == "vectors", [f.time for f in b.frames]
assert b.reference == a.reference
END
    must vg-encode --fps 4 --take 5-6 all.vgs -o out.vgs
    py <<'END'
import read_stream
assert [f.time for f in read_stream.read_stream("out.vgs").frames] == [0, 0.25]
END
    # what stands before a frame goes with it
    must vg-encode --take 1 "$GOLDEN/unknown-records.vgs" -o out.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("out.vgs")
assert [[x.tag for x in f.extra] for f in s.frames] == [["XNON"]] and [x.tag for x in s.tail] == ["XNOT"]
END
}

@test "--take: what is no list of frames, or asks for a frame that does not exist" {
    poses cube 3
    for frames in '' ',' '1,' ',1' '1,,2' a 1-a -1 2-1 2,1 1,1 0-1,1 0-,2 1/2 0-/ 0-/0 0-/-1 99999999999999999999; do
        must_fail 2 vg-encode "--take=$frames" 'pose*.obj' -o out.vgs
        says "needs frames like 3,10-20,30-/2"
    done
    for frames in 3 3- 2-3 0,7-9/9; do
        must_fail 3 vg-encode --take "$frames" 'pose*.obj' -o out.vgs
        says "but there are 3, counted from 0"
    done
    [ ! -e out.vgs ]
}

@test "--anchor is remembered, sorted and without repetition" {
    mesh cube >a.obj
    must vg-encode --anchor 5,0,5,2 a.obj -o out.vgs
    py <<'END'
import read_stream
assert list(read_stream.read_stream("out.vgs").anchors) == [0, 2, 5]
END
    for list in 8 1,8 4294967296 -1 1,,2 "" x 1.5 "1 2"; do
        must_fail 2 vg-encode --anchor "$list" a.obj -o bad.vgs
        says vg-encode: usage:
    done
    must_fail 2 vg-encode --anchor 3,8 a.obj -o bad.vgs
    says "vertex 8, but there are 8"
    nothing_but a.obj out.vgs
}

@test "--faces selected needs fewer corners; what is selected stays selected" {
    must vg-encode --vectors "$DATA/trex.rest.obj" -o all.vgs
    must vg-encode --vectors --faces selected "$DATA/trex.rest.obj" -o selected.vgs
    must vg-encode --faces selected "$DATA/trex.rest.obj" -o vertices.vgs
    must vg-encode --vectors vertices.vgs -o again.vgs
    py <<'END'
import read_stream
a, s, t = (read_stream.read_stream(n + ".vgs") for n in ("all", "selected", "again"))
assert a.selection is None and list(s.selection) == list(t.selection) and s.count == t.count
assert 0.4 * a.count < s.count < 0.7 * a.count, (s.count, a.count)
END
    must_warn vg-encode -v --faces selected "$DATA/trex.rest.obj" -o vertices.vgs
    says "of 838 faces"
    must_fail 2 vg-encode --faces some "$DATA/trex.rest.obj" -o bad.vgs
    says "'some'"
}

@test "options about vertices are refused where there are none" {
    mesh cube >a.obj
    must vg-encode --vectors a.obj -o vectors.vgs
    must vg-deform a.obj -o deformations.vgs
    must vg-encode --vectors vectors.vgs -o again.vgs # it holds them already
    must vg-diff -t 0 a.obj <(vg-solve again.vgs)
    for option in "--faces selected" "--reference a.obj" "--anchor 1"; do
        for file in vectors deformations; do
            # shellcheck disable=SC2086
            must_fail 3 vg-encode $option $file.vgs -o bad.vgs
            one_line
            says "holds $file"
        done
    done
    must_fail 3 vg-encode --vectors deformations.vgs -o bad.vgs
    must_fail 3 vg-encode --vectors "$GOLDEN/transforms.vgs" -o bad.vgs
    must_fail 3 vg-encode vectors.vgs a.obj -o bad.vgs
    nothing_but a.obj vectors.vgs deformations.vgs again.vgs
}

@test "meshes of different faces do not join, and the message says what differs" {
    mesh cube >a.obj
    mesh two >b.obj
    sed 's/^f 5 6 7 8$/f 5 6 8 7/' a.obj >c.obj
    must_fail 3 vg-encode a.obj b.obj -o out.vgs
    one_line
    says "'b.obj' has 12 vertices where 'a.obj' has 8"
    must_fail 3 vg-encode a.obj c.obj -o out.vgs
    one_line
    says "'c.obj'" "face 1" "names vertex 7" "names 6"
    tar cf a.tar a.obj c.obj
    must_fail 3 vg-encode a.tar -o out.vgs
    one_line
    says "c.obj" "a.tar" "face 1"
    nothing_but a.obj b.obj c.obj a.tar
}

@test "numbers that are none and indices out of range are refused with file and line" {
    refuses() { # TEXT EXPECTED...
        printf '%b' "$1" >bad.obj
        shift
        must_fail 3 vg-encode bad.obj -o out.vgs
        one_line
        says "bad.obj" "$@"
    }
    refuses 'v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n' "line 2"
    refuses 'v 0 0 0\nv 1 0 -inf\nv 0 1 0\nf 1 2 3\n' "line 2"
    refuses 'v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n' "line 2"
    refuses 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n' "4"
    refuses 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n' "line 4"
    refuses 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n' "line 4"
    refuses 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n' "line 4"
    refuses 'v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n' "line 2"
    nothing_but bad.obj
}

@test "missing files, directories without meshes, unknown options" {
    mkdir empty
    must_fail 4 vg-encode none.obj -o out.vgs
    one_line
    says "'none.obj'" "No such file"
    must_fail 3 vg-encode empty -o out.vgs
    one_line
    says "'empty'"
    must_fail 2 vg-encode --bogus -o out.vgs
    must_fail 2 vg-encode --vectors=yes -o out.vgs
    must_fail 4 vg-encode "$DATA/horse.rest.obj" -o none/out.vgs
    says "none/out.vgs"
    must_fail 4 vg-encode "$DATA/horse.rest.obj" -o /dev/full
    must_fail 3 vg-encode -o out.vgs </dev/null
    says empty
    nothing_but empty
}

@test "a pose that fails late leaves nothing and tells the next program" {
    poses cube 3
    echo 'v 0 0 x' >pose4.obj
    must_fail 3 vg-encode pose1.obj pose2.obj pose4.obj -o out.vgs
    one_line
    says "'pose4.obj'"
    pipe_fail 3 "vg-encode pose1.obj pose2.obj pose4.obj | vg-decode -o out/"
    says "vg-encode: " "vg-decode: " "vg-encode failed with status 3"
    nothing_but pose1.obj pose2.obj pose3.obj pose4.obj
}

@test "--axes, --scale, --unit and --origin place the whole sequence" {
    mesh two 0.3 0.25 >a.obj
    mesh two 0.8 2 >b.obj
    must vg-encode a.obj b.obj -o in.vgs
    must vg-encode --axes y-up in.vgs -o y.vgs
    must vg-encode --axes z-up y.vgs -o back.vgs
    must vg-encode --axes xz-y:xyz in.vgs -o same.vgs
    must vg-encode --axes z-up:y-up in.vgs -o words.vgs
    must vg-encode --axes yzx:xyz in.vgs -o cycle.vgs
    must vg-encode --scale 3 --unit cm:m in.vgs -o small.vgs
    must vg-encode --unit in:mm in.vgs -o inches.vgs
    must vg-encode --origin 1,-2,0.5 in.vgs -o moved.vgs
    must vg-encode --origin centre in.vgs -o centre.vgs
    must vg-encode --axes z-up --origin floor --scale 2 in.vgs -o floor.vgs
    must vg-encode --vectors --scale 2 in.vgs -o vectors.vgs
    must vg-encode --scale 2 in.vgs -o twice.vgs
    pipe 'vg-solve vectors.vgs | vg-diff -t 1e-9 twice.vgs -'
    py <<'END'
import read_stream
def load(name):
    s = read_stream.read_stream(name + ".vgs")
    return [list(zip(*[iter(v)] * 3)) for v in [s.reference] + [f.values for f in s.frames]]
def check(name, f):
    for given, found in zip(load("in"), load(name), strict=True):
        for p, q in zip(given, found, strict=True):
            assert max(abs(a - b) for a, b in zip(f(*p), q)) < 1e-14 * 60, (name, p, q)
for name in "y", "same", "words":
    check(name, lambda x, y, z: (x, z, -y))
check("back", lambda x, y, z: (x, y, z))
check("cycle", lambda x, y, z: (y, z, x))
check("small", lambda x, y, z: (0.03 * x, 0.03 * y, 0.03 * z))
check("inches", lambda x, y, z: (25.4 * x, 25.4 * y, 25.4 * z))
check("moved", lambda x, y, z: (x - 1, y + 2, z - 0.5))
rest = load("in")[0]
mean = [sum(p[k] for p in rest) / len(rest) for k in range(3)]
check("centre", lambda x, y, z: (x - mean[0], y - mean[1], z - mean[2]))
low = min(p[1] for p in rest)
check("floor", lambda x, y, z: (2 * (x - mean[0]), -2 * (z - mean[2]), 2 * (y - low)))
END
    for option in '--axes up' '--axes xyz' '--axes xyz:xy' '--axes xxz:xyz' '--axes xyz:-xyz' '--unit cm' '--unit cm:parsec' \
        '--origin here' '--origin 1,2' '--scale 0' '--scale -1'; do
        # shellcheck disable=SC2086 # words
        must_fail 2 vg-encode $option in.vgs -o out.vgs
        says "${option%% *}"
    done
    must_fail 3 vg-encode --scale 2 vectors.vgs -o out.vgs
    must_fail 3 vg-encode --scale 2 "$DATA/sit01.bvh.xz" -o out.vgs
    [ ! -e out.vgs ]
}

@test "--raw reads the numbers that vg-decode -o NAME:f64 writes, from files and pipes, frame by frame" {
    poses two 4
    must vg-encode pose1.obj pose2.obj pose3.obj pose4.obj -o in.vgs
    must vg-decode in.vgs -o numbers:f64
    [ "$(stat -c %s numbers)" = $((4 * 12 * 3 * 8)) ]
    must vg-encode --raw f64 --mesh pose1.obj numbers -o back.vgs
    must vg-diff -t 0 in.vgs back.vgs
    pipe 'vg-decode in.vgs -o -:f32 | vg-encode --raw f32 --mesh pose1.obj | vg-diff -t 1e-7 in.vgs -'
    py <<'END'
import array, read_stream
s = read_stream.read_stream("in.vgs")
numbers = array.array("d")
numbers.frombytes(open("numbers", "rb").read())
assert list(numbers) == [x for f in s.frames for x in f.values]
END
    names back.vgs
    [ "$output" = "0 1 2 3" ]
    must vg-encode --raw f64 --mesh pose1.obj --vectors --take 1-2 numbers -o vectors.vgs
    pipe 'vg-solve vectors.vgs | vg-encode - | vg-diff -t 1e-9 - <(vg-encode --take 1-2 in.vgs)'
    # a frame is passed on before the next one comes
    py <<'END'
import subprocess
numbers = open("numbers", "rb").read()
encode = subprocess.Popen(["vg-encode", "--raw", "f64", "--mesh", "pose1.obj", "--no-provenance"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
got = b""
for i in range(4):
    encode.stdin.write(numbers[288 * i:288 * i + 288])
    encode.stdin.flush()
    while numbers[288 * i:288 * i + 288] not in got:
        more = encode.stdout.read1(4096)
        assert more, "the stream ended early"
        got += more
encode.stdin.close()
encode.stdout.read()
assert encode.wait() == 0
END
    # what is wrong
    head -c 300 numbers >short
    must_fail 3 vg-encode --raw f64 --mesh pose1.obj short -o out.vgs
    says "frame 1" "12 bytes of 288"
    printf '\0\0\xc0\x7f%.0s' {1..36} >nan
    must_fail 3 vg-encode --raw f32 --mesh pose1.obj nan -o out.vgs
    says "not finite"
    must_fail 2 vg-encode --raw f32 numbers -o out.vgs
    must_fail 2 vg-encode --raw f32 --mesh pose1.obj numbers numbers -o out.vgs
    must_fail 2 vg-encode --raw i16 --mesh pose1.obj numbers -o out.vgs
    must_fail 2 vg-decode --no-mesh in.vgs -o x:f32
    says "--no-mesh"
    must_fail 4 vg-encode --raw f32 --mesh pose1.obj missing -o out.vgs
    LC_ALL=C awk '$1 == "v" {$2 = 1e300} {print}' pose1.obj >huge.obj
    must_fail 3 vg-decode huge.obj -o x:f32
    says "':f64'"
    [ ! -e out.vgs ] && [ ! -e x ]
}

@test "--mirror: left is right, vertices change partners, faces stay" {
    # a grid from -3 to 4 with its middle at 0.5; the second pose lifts what is right of it, and pulls it forward
    py <<'END'
def write(name, f):
    with open(name, "w") as o:
        for j in range(4):
            for i in range(8):
                print("v", *f(i - 3 - 0.5, j), file=o)
        for j in range(3):
            for i in range(7):
                a = 8 * j + i + 1
                print("f", a, a + 1, a + 9, a + 8, file=o)
write("rest.obj", lambda x, y: (x + 0.5, y, 0.1 * x * x))
write("right.obj", lambda x, y: (x + 0.5 + (x > 0) * 0.25 * y, y + max(x, 0), 0.1 * x * x + 1))
write("left.obj", lambda x, y: (x + 0.5 - (x < 0) * 0.25 * y, y + max(-x, 0), 0.1 * x * x + 1))
with open("pairs.txt", "w") as o:
    print("# partners", file=o)
    for j in range(4):
        for i in range(4):
            print(8 * j + i, 8 * j + 7 - i, file=o)
END
    must vg-encode --mirror x --reference rest.obj right.obj -o mirrored.vgs
    must vg-diff -t 1e-15 left.obj mirrored.vgs
    must vg-encode --mirror x mirrored.vgs -o back.vgs
    must vg-diff -t 1e-15 right.obj back.vgs
    must vg-encode --mirror x --pairs pairs.txt --reference rest.obj right.obj -o named.vgs
    must vg-diff -t 1e-15 left.obj named.vgs
    must vg-encode --mirror x --pairs auto --scale 2 --origin 1,0,0 --reference rest.obj right.obj -o placed.vgs
    pipe 'vg-encode --scale 2 --origin 1,0,0 left.obj | vg-diff -t 1e-15 - placed.vgs'
    capture vg-encode -v --mirror x --reference rest.obj right.obj -o mirrored.vgs
    says "x = 0.5" "differ by 0 %"
    # a file may name a vertex of the middle, too
    printf 'v -1 0 0\nv 1 0 2\nv 0 1 0\nf 1 2 3\n' >lopsided.obj
    printf 'left 0 1\n2 2\n' >middle.txt
    must vg-encode --mirror x --pairs middle.txt lopsided.obj -o lopsided.vgs
    printf 'v -1 0 2\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >other.obj
    must vg-diff -t 1e-15 other.obj lopsided.vgs
    # a real body is nearly its own mirror image
    must vg-encode --mirror x "$DATA/walk-man.rest.obj.xz" -o a.vgs
    must vg-diff --of mean -t 1e-4 "$DATA/walk-man.rest.obj.xz" a.vgs
    must vg-encode --mirror x a.vgs -o b.vgs
    must vg-diff -t 1e-15 "$DATA/walk-man.rest.obj.xz" b.vgs
    # what is not symmetric
    must_fail 3 vg-encode --mirror x right.obj -o out.vgs
    says "not symmetric" "--pairs FILE"
    echo '0 99' >wrong.txt
    must_fail 3 vg-encode --mirror x --pairs wrong.txt rest.obj -o out.vgs
    says "99"
    printf '0 1\n0 2\n' >wrong.txt
    must_fail 3 vg-encode --mirror x --pairs wrong.txt rest.obj -o out.vgs
    printf '0 1\n1 0\n' >wrong.txt
    must_fail 3 vg-encode --mirror x --pairs wrong.txt rest.obj -o out.vgs
    says "twice"
    local pair
    for pair in 'left right' '-1 2' '1e30 2' '4294967296 2'; do
        echo "$pair" >wrong.txt
        must_fail 3 vg-encode --mirror x --pairs wrong.txt rest.obj -o out.vgs
        says "line 1"
    done
    must_fail 2 vg-encode --mirror left rest.obj -o out.vgs
    must_fail 2 vg-encode --pairs auto rest.obj -o out.vgs
    [ ! -e out.vgs ]
}
