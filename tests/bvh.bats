#!/usr/bin/env bats
# Skeletons: BVH in and out through whole pipelines. Numbers and syntax are tested in unit/test_bvh.c.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# walk N [LEG [DT]]: a figure of 9 joints that walks N frames, its legs LEG long, as BVH on standard output. Hips and their
# coincident left hip joint, as motion capture has them; the right foot is a joint without a child.
walk() {
    LC_ALL=C awk -v n="$1" -v leg="${2:-4}" -v dt="${3:-0.04}" '
    function joint(kind, name, x, y, z, channels) {
        printf "%s %s\n{\nOFFSET %g %g %g\nCHANNELS %s\n", kind, name, x, y, z, channels
    }
    BEGIN {
        turn = "Zrotation Xrotation Yrotation"
        print "HIERARCHY"
        joint("ROOT", "Hips", 0, 0, 0, "6 Xposition Yposition Zposition " turn)
        joint("JOINT", "LHipJoint", 0, 0, 0, "3 " turn)
        joint("JOINT", "LThigh", 1, -1, 0, "3 " turn)
        joint("JOINT", "LFoot", 0, -leg, 0.5, "3 " turn)
        print "End Site\n{\nOFFSET 0 -1 2\n}\n}\n}\n}"
        joint("JOINT", "RThigh", -1, -1, 0, "3 " turn)
        joint("JOINT", "RFoot", 0, -leg, 0.5, "0")
        print "}\n}"
        joint("JOINT", "Chest", 0, 3, 0.2, "3 " turn)
        joint("JOINT", "Arm", 2, 1, 0, "1 Xrotation")
        print "End Site\n{\nOFFSET 0 -3 0\n}\n}"
        joint("JOINT", "Head", 0, 2, 0.3, "0")
        print "}\n}\n}\nMOTION\nFrames: " n "\nFrame Time: " dt
        for (i = 0; i < n; i++) {
            s = sin(0.2 * i)
            printf "%g %g %g 5 %g 10 0 %g 0 0 %g 0 %g 0 0 0 %g 0 %g 0 0 %g\n", 0.1 * i, leg + 2, 0.3 * i, 3 * s, 0, 40 * s, 10 * s, \
                -40 * s, 10 * s, 30 * s
        }
    }'
}

@test "a BVH file is a sequence of its joints" {
    walk 12 >walk.bvh
    must vg-info walk.bvh
    shows "12: 'walk.0001' to 'walk.0012'" "0 s to 0.44 s" "vertices    11" "10 of 2" "reference   walk"
    must vg-info --frames walk.bvh
    shows 'walk.0005  0.16'
}

@test "the reference is the pose without rotations, for --onto and --reference too" {
    walk 3 >walk.bvh
    awk '/^MOTION/{exit} {print}' walk.bvh >rest.bvh
    printf 'MOTION\nFrames: 1\nFrame Time: 1\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n' >>rest.bvh
    must vg-decode -q rest.bvh -o rest.obj
    printf 'v 0 0 0\nv 0 0 0\nv 1 -1 0\nv 1 -5 0.5\nv 1 -6 2.5\nv -1 -1 0\nv -1 -5 0.5\nv 0 3 0.2\nv 2 4 0.2\nv 2 1 0.2\nv 0 5 0.5\n' >known
    grep ^v rest.obj >have
    same_file known have
    pipe 'vg-deform --onto rest.bvh -q walk.bvh | vg-solve | vg-decode -o a.bvh -q'
    pipe 'vg-deform --onto walk.bvh -q walk.bvh | vg-solve | vg-decode -o b.bvh -q'
    same_file a.bvh b.bvh
}

@test "there and back: the same joints" {
    walk 40 >walk.bvh
    must vg-decode walk.bvh -o again.bvh
    must vg-diff -t 1e-6 walk.bvh again.bvh
    must vg-decode --f64 walk.bvh -o exact.bvh
    must vg-diff -t 1e-11 walk.bvh exact.bvh
    for name in human-man-poses human-heavy-poses sit01 standing03; do
        must vg-decode -q "$DATA/$name.bvh.xz" -o "$name.bvh" # sit01: positions near 0
        must vg-diff -q -t 1e-6 "$DATA/$name.bvh.xz" "$name.bvh"
    done
    must grep -c '^Frames: *15$' human-man-poses.bvh
    # hierarchy and channels are as they were: only the numbers may be written otherwise
    xz -dc "$DATA/human-man-poses.bvh.xz" | grep -E 'ROOT|JOINT|End|CHANNELS' | tr -s ' \t' ' ' | sed 's/^ //' >before
    grep -E 'ROOT|JOINT|End|CHANNELS' human-man-poses.bvh | tr -s ' \t' ' ' | sed 's/^ //' >after
    same_file before after
}

@test "how each joint has turned comes back, about its own bone and at the ends too, also through a stream" {
    for name in human-man-poses sit01 standing03; do
        xz -dc "$DATA/$name.bvh.xz" >"$name.bvh"
        pipe "vg-encode -q $name.bvh | vg-decode -o out-$name.bvh"
        py "$name.bvh" "out-$name.bvh" <<'END'
import math, sys
def turn(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    m = [[float(i == j) for j in range(3)] for i in range(3)]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    m[i][i], m[i][j], m[j][i], m[j][j] = c, -s, s, c
    return m
def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
def turns(path):
    words = open(path).read().replace(":", " ").split()
    start = words.index("MOTION")
    channels = [words[i + 2:i + 2 + int(words[i + 1])] for i in range(start) if words[i] == "CHANNELS"]
    numbers, out = iter(words[words.index("Time", start) + 2:]), []
    for _ in range(int(words[words.index("Frames", start) + 1])):
        for names in channels:
            m = turn(0, 0)
            for name in names:
                x = float(next(numbers))
                if name.endswith("rotation"):
                    m = product(m, turn("XYZ".index(name[0]), x))
            out.append(m)
    assert next(numbers, None) is None
    return out
a, b = turns(sys.argv[1]), turns(sys.argv[2])
assert len(a) == len(b) > 100
worst = max(abs(x - y) for m, n in zip(a, b) for r, s in zip(m, n) for x, y in zip(r, s))
assert worst < 1e-7, worst
END
    done
}

@test "the skeleton and the times go through a pipeline" {
    walk 20 4 0.0125 >walk.bvh
    pipe 'vg-encode walk.bvh | vg-deform -q --onto walk.bvh | vg-solve | vg-decode -o out.bvh'
    must grep -c '^Frame Time: *0.0125000000$' out.bvh
    must vg-diff -t 1e-6 walk.bvh out.bvh
    pipe 'vg-encode --vectors walk.bvh | vg-solve | vg-decode -o vectors.bvh'
    must vg-diff -t 1e-6 walk.bvh vectors.bvh
    pipe 'vg-encode walk.bvh | vg-decode -o - --format bvh >pipe.bvh'
    must vg-decode walk.bvh -o pipe2.bvh
    same_file pipe.bvh pipe2.bvh
}

@test "an action goes to another performer, whose bones keep their lengths" {
    walk 30 >short.bvh
    walk 30 6 >long.bvh
    pipe 'vg-encode short.bvh | vg-deform -q --onto long.bvh | vg-solve | vg-decode -q -o out.bvh'
    grep OFFSET out.bvh | awk '{print $2 + 0, $3 + 0, $4 + 0}' >out.offsets
    grep OFFSET long.bvh | awk '{print $2 + 0, $3 + 0, $4 + 0}' >long.offsets
    same_file out.offsets long.offsets
    # the truth has other steps, so that the body as a whole lies elsewhere: posture is compared
    must vg-diff --centred -t 0.02 long.bvh out.bvh
    # no angle jumps: the source's largest step is 8 degrees, of the thigh
    awk '/^Frame Time/{on = 1; next} on {for (i = 4; i <= NF; i++) {d = $i - last[i]; if (NR > first + 1 && seen && (d > 12 || d < -12)) bad = 1; last[i] = $i} seen = 1}
         END {exit bad}' out.bvh
}

@test "other proportions, a known answer: a man's poses onto another's skeleton" {
    pipe "vg-encode $DATA/human-man-poses.bvh.xz | vg-deform -q --onto $DATA/human-heavy-poses.bvh.xz | vg-solve | vg-decode -q -o out.bvh"
    must vg-diff --centred -t 0.04 "$DATA/human-heavy-poses.bvh.xz" out.bvh
}

# convention STYLE OUT [OPTION...]: the poses of sticks.bvh by another convention, put back onto the skeleton of sticks.bvh
convention() {
    local style=$1 out=$2
    shift 2
    py "$style" <<END || return 1
import sys
sys.path.insert(0, "$ROOT/tests")
import conventions
conventions.sticks("sticks.bvh", 12, 7)
conventions.convert("sticks.bvh", sys.argv[1], "$style.bvh", 1)
END
    must vg-deform "$@" --onto sticks.bvh "$style.bvh" -o turns.vgs
    pipe "vg-solve -q turns.vgs | vg-decode -q -o $out"
}

@test "poses at random by the joints of many conventions: names, units, axes, rest poses; the same places come back" {
    for style in mixamo unreal makehuman rigify metarig asf vrm biped motive smpl xsens maya second-life numbered quaternius nameless; do
        convention $style out.bvh -q
        must vg-diff -q --centred -t 1e-5 sticks.bvh out.bvh
    done
    for style in few kinect roblox cesium; do # no clavicles, whose turns are lost
        convention $style out.bvh -q
        must vg-diff -q --centred --of mean -t 0.01 sticks.bvh out.bvh
    done
}

@test "names that tell nothing: matched by shape, which is said; a missing limb is named; names with blanks" {
    convention nameless out.bvh -q
    must_warn vg-deform --onto sticks.bvh nameless.bvh -o out.vgs
    says 'they are matched by the shape of the skeletons'
    convention vrm out.bvh -q
    sed 's/leftShoulder/d/; s/leftUpperArm/a/; s/leftLowerArm/b/; s/leftHand/c/' vrm.bvh >armless.bvh
    must_warn vg-deform --onto sticks.bvh armless.bvh -o out.vgs
    says '4 of 23 bones have no matching joint of the skeleton: they follow their parents; no joint drives LeftArm, LeftForeArm, LeftHand'
    printf 'LeftArm a\nLeftForeArm b\n' >pairs.txt
    must_warn vg-deform --joints pairs.txt --onto sticks.bvh armless.bvh -o out.vgs
    says 'no joint drives Hips, Head, LeftHand, RightArm, RightForeArm, RightHand, LeftUpLeg, LeftLeg and 4 more'
    convention biped out.bvh -q
    printf '# bone joint\nLeftArm Bip01 L UpperArm\nLeftForeArm Bip01 L Forearm # moves\nHips Bip01\n' >pairs.txt
    must vg-deform -q --joints pairs.txt --onto sticks.bvh biped.bvh -o out.vgs
    printf 'RightForeArm Bip01 L Forearms\n' >pairs.txt
    must_fail 3 vg-deform --joints pairs.txt --onto sticks.bvh biped.bvh -o no.vgs
    says 'a bone of the rig and a joint of the skeleton expected'
}

@test "archives and directories of poses, and several files" {
    mkdir poses
    cp "$DATA"/sit01.bvh.xz "$DATA"/standing03.bvh.xz poses
    must vg-info -q --frames poses
    shows sit01 standing03
    (cd poses && xz -d ./*.xz && tar czf ../poses.tar.gz ./*.bvh)
    must vg-diff -q -t 0 poses poses.tar.gz
    walk 3 >a.bvh
    walk 2 >b.bvh
    pipe 'vg-encode a.bvh b.bvh | vg-info'
    shows "5: 'a.0001' to 'b.0002'"
    must_fail 3 vg-encode a.bvh poses/sit01.bvh -o out.vgs
    says "has 212 vertices where 'a.bvh' has 11"
}

@test "a skeleton onto a mesh, a mesh onto a skeleton: what to do, and it is not vg-register" {
    mesh cube >cube.obj
    walk 3 >walk.bvh
    must_fail 3 vg-deform --onto cube.obj walk.bvh -o out.vgs
    says 'the input is a skeleton, and the target is none: vg-fitmap makes a rig, which vg-play drives'
    one_line
    must_fail 3 vg-deform --onto walk.bvh cube.obj -o out.vgs
    says 'the target is a skeleton, and the input is none: vg-fitmap --skeleton'
    one_line
    awk '/ROOT|JOINT/ {$2 = "b" NR} {print}' walk.bvh >names.bvh
    must_fail 3 vg-deform --onto names.bvh walk.bvh -o out.vgs
    says 'its shape does not tell its arms, legs and toes: --joints pairs them by a file'
    nothing_but cube.obj walk.bvh names.bvh
}

@test "what a BVH file cannot hold is said" {
    mesh cube >cube.obj
    must_fail 3 vg-decode cube.obj -o cube.bvh
    says "cannot write 'cube.bvh'" "no skeleton"
    one_line
    nothing_but cube.obj
    walk 3 >walk.bvh
    walk 3 6 >long.bvh
    pipe 'vg-encode walk.bvh | vg-encode --reference long.bvh >mixed.vgs' # the legs of one, the reference of the other
    must_warn vg-decode mixed.vgs -o out.bvh
    says "not kept in 'out.bvh': changes of the lengths of bones: joint '"
    one_line
}

@test "bad files are refused by line, and leave nothing behind" {
    walk 3 | sed 's/^CHANNELS 1 Xrotation/CHANNELS 1 Rotation/' >a.bvh
    must_fail 3 vg-encode a.bvh -o out.vgs
    says "'a.bvh' line" "a channel (Xposition ... Zrotation) expected, not 'Rotation'"
    walk 3 | sed '$d' >b.bvh
    must_fail 3 vg-decode b.bvh -o out.bvh
    says "'b.bvh' ends in frame 2 of 3, after 0 of 22 values"
    walk 3 0 -1 >c.bvh
    must_fail 3 vg-info c.bvh
    says "the frame time is not positive"
    nothing_but a.bvh b.bvh c.bvh
}

@test "a long sequence, written to a file and to a pipe" {
    walk 20000 >walk.bvh
    must vg-decode walk.bvh -o out.bvh
    pipe 'vg-decode walk.bvh -o - --format bvh | cat >pipe.bvh'
    same_file out.bvh pipe.bvh
    must grep -c '^Frames: *20000$' out.bvh
    must vg-diff -t 1e-6 walk.bvh out.bvh
}

# other_joints IN OUT: the same skeleton and motion as BVH with other names, children in reverse order, and all lengths doubled
other_joints() {
    py "$1" "$2" <<'END'
import sys
lines = [l.split() for l in open(sys.argv[1])]
at = 1
class Joint: pass
def read():
    global at
    j = Joint()
    j.kind, j.name, j.children, j.channels = lines[at][0], lines[at][-1], [], ["0"]
    at += 2
    while lines[at] != ["}"]:
        word, *rest = lines[at]
        if word == "OFFSET": j.offset = [2 * float(x) for x in rest]
        if word == "CHANNELS": j.channels = rest
        if word in ("JOINT", "End"): j.children.append(read())
        else: at += 1
    at += 1
    return j
root = read()
order, span, n = [], {}, 0
def number(j):
    global n
    span[id(j)] = range(n, n + int(j.channels[0]))
    n += int(j.channels[0])
    for c in j.children: number(c)
number(root)
out = open(sys.argv[2], "w")
def write(j):
    end = j.kind == "End"
    print("End Site" if end else j.kind + " other_" + j.name[::-1], "{", "OFFSET %g %g %g" % tuple(j.offset), sep="\n", file=out)
    if not end: print("CHANNELS", *j.channels, file=out)
    order.extend(span[id(j)])
    for c in reversed(j.children): write(c)
    print("}", file=out)
print("HIERARCHY", file=out)
write(root)
print(*map(" ".join, lines[at:at + 3]), sep="\n", file=out)
for row in lines[at + 3:]:
    row = [2 * float(x) if k < 3 else float(x) for k, x in enumerate(row)]
    print(*("%.9g" % row[k] for k in order), file=out)
def pairs(j):
    if j.kind != "End":
        print("other_" + j.name[::-1], j.name)
        for c in j.children: pairs(c)
with open("pairs.txt", "w") as sys.stdout: pairs(root)
END
}

@test "an action goes to a skeleton of other joints, in another order: by a file of pairs, and by name" {
    walk 20 >walk.bvh
    other_joints walk.bvh other.bvh
    must_fail 3 vg-deform --onto other.bvh walk.bvh -o no.vgs # neither names nor what they mean agree
    says "no joint of the skeleton has the name of a bone"
    [[ $stderr != *vg-register* ]]
    [ ! -e no.vgs ]
    must vg-encode --vectors walk.bvh -o vectors.vgs
    must_fail 3 vg-deform --onto other.bvh vectors.vgs -o no.vgs
    says "a skeleton of other joints takes a sequence of vertices"
    pipe 'vg-deform -q --onto other.bvh --joints pairs.txt walk.bvh | vg-solve | vg-decode -q -o out.bvh'
    must vg-diff -t 1e-6 other.bvh out.bvh
    # how joints have turned arrives, too: about their own bones as well
    must vg-encode other.bvh -o truth.vgs
    pipe 'vg-deform -q --onto other.bvh --joints pairs.txt walk.bvh | vg-solve -o got.vgs'
    py <<'END'
import read_stream
truth, got = read_stream.read_stream("truth.vgs").frames, read_stream.read_stream("got.vgs").frames
assert len(truth) == len(got) == 20
for a, b in zip(truth, got):
    assert len(a.turns) == len(b.turns) > 0
    for k in range(0, len(a.turns), 4):
        assert abs(abs(sum(x * y for x, y in zip(a.turns[k:k + 4], b.turns[k:k + 4]))) - 1) < 1e-9, (a.name, k // 4)
END
    sed 's/other_//' other.bvh | awk '$1 == "ROOT" || $1 == "JOINT" {n = ""; for (i = length($2); i; i--) n = n substr($2, i, 1); $2 = n} 1' >named.bvh
    pipe 'vg-deform -q --onto named.bvh walk.bvh | vg-solve | vg-decode -q -o out.bvh'
    must vg-diff -t 1e-6 other.bvh out.bvh
    # --root stay: the mean of the joints does not move
    pipe 'vg-deform -q --onto named.bvh --root stay walk.bvh | vg-solve -o stays.vgs'
    must vg-diff --centred -t 1e-6 other.bvh stays.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("stays.vgs")
def mean(values): return [sum(values[k::3]) / len(values[k::3]) for k in range(3)]
home = mean(s.reference)
assert all(abs(a - b) < 1e-9 for f in s.frames for a, b in zip(mean(f.values), home))
END
    must_fail 2 vg-deform --onto named.bvh --by pose walk.bvh -o no.vgs
    must_fail 2 vg-deform --onto other.bvh --align none <<<"$(mesh cube)" -o no.vgs
}

@test "an action of motion capture goes to a body of another convention: arms that rest elsewhere are aligned" {
    [ -d "${VG_DATA:-}/mocap" ] || skip "VG_DATA does not name the data kit"
    must vg-encode --take 0-300/4 "$VG_DATA/mocap/cmu-02_01.bvh" -o cmu.vgs
    must_warn vg-deform --onto "$VG_DATA/skeletons/walk-man.bvh" cmu.vgs -o vectors.vgs
    says 'aligned LeftArm (49 degrees)'
    must vg-solve vectors.vgs -o man.vgs
    # limbs point where those of the captured person do
    py <<'END'
import read_stream
a, b = read_stream.read_stream("cmu.vgs"), read_stream.read_stream("man.vgs")
def direction(s, f, bone):
    j = next(i for i, x in enumerate(s.skeleton) if x.name == bone[0])
    k = next(i for i, x in enumerate(s.skeleton) if x.name == bone[1])
    d = [f.values[3 * k + i] - f.values[3 * j + i] for i in range(3)]
    n = sum(x * x for x in d) ** 0.5
    return [x / n for x in d]
for f, g in zip(a.frames, b.frames):
    for bone in (("LeftArm", "LeftForeArm"), ("LeftForeArm", "LeftHand"), ("RightArm", "RightForeArm"), ("RightUpLeg", "RightLeg"), ("LeftLeg", "LeftFoot")):
        cosine = sum(x * y for x, y in zip(direction(a, f, bone), direction(b, g, bone)))
        assert cosine > 0.99, (f.name, bone, cosine)
END
}

# captured FILE: thirty joints as CMU names them, legs apart and arms out at rest, in twelve large poses
captured() {
    py "$1" <<'END'
import math, sys
tree = [("Hips", None, (0, 0, 0))]
for s, x in (("Left", 1), ("Right", -1)):
    tree += [(s[0] + "HipJoint", "Hips", (0, 0, 0)), (s + "UpLeg", s[0] + "HipJoint", (1.4 * x, -1.8, 0.8)), (s + "Leg", s + "UpLeg", (2.4 * x, -6.7, 0)),
             (s + "Foot", s + "Leg", (2.6 * x, -7.0, 0)), (s + "ToeBase", s + "Foot", (0.2 * x, -0.4, 2.3))]
tree += [("LowerBack", "Hips", (0, 0, 0)), ("Spine", "LowerBack", (0, 2.0, -0.2)), ("Spine1", "Spine", (0, 2.0, 0)), ("Neck", "Spine1", (0, 0, 0)),
         ("Neck1", "Neck", (0, 1.5, 0.1)), ("Head", "Neck1", (0, 1.7, -0.4))]
for s, x in (("Left", 1), ("Right", -1)):
    tree += [(s + "Shoulder", "Spine1", (0, 0, 0)), (s + "Arm", s + "Shoulder", (3.5 * x, 1.2, -0.4)), (s + "ForeArm", s + "Arm", (5.0 * x, 0, 0)),
             (s + "Hand", s + "ForeArm", (3.4 * x, 0, 0))]
out = ["HIERARCHY"]
def put(i, depth):
    n, up, o = tree[i]
    pad = "  " * depth
    below = [k for k in range(len(tree)) if tree[k][1] == n]
    out.extend([pad + ("JOINT " if depth else "ROOT ") + n, pad + "{", pad + "  OFFSET %g %g %g" % o,
                pad + "  CHANNELS " + ("3 " if depth else "6 Xposition Yposition Zposition ") + "Zrotation Xrotation Yrotation"])
    for k in below: put(k, depth + 1)
    if not below: out.append(pad + "  End Site { OFFSET 0 1 0 }".replace(" { ", "\n" + pad + "  {\n" + pad + "    ").replace(" }", "\n" + pad + "  }"))
    out.append(pad + "}")
put(0, 0)
out += ["MOTION", "Frames: 12", "Frame Time: 0.04"]
for f in range(12):
    row = [math.sin(f) * 3, 17 + math.cos(f), f * 1.5]
    for i in range(len(tree)):
        # a clavicle, a joint of the hip and the root of the spine hardly turn
        size = 3 if tree[i][0] in ("LHipJoint", "RHipJoint", "LeftShoulder", "RightShoulder", "LowerBack") else 20 if i else 40
        row += [size * math.sin(1.3 * f + 2.1 * i + c) for c in range(3)]
    out.append(" ".join("%.6f" % x for x in row))
open(sys.argv[1], "w").write("\n".join(out) + "\n")
END
}

@test "conventions: Mixamo, Unreal, MakeHuman, Rigify, CMU, Daz, VRM: names, order, rest pose, units, up axis, more joints and fewer" {
    captured cmu.bvh
    for style in mixamo unreal unreal-y makehuman rigify metarig asf few vrm; do
        py <<END
import sys
sys.path.insert(0, "$ROOT/tests")
import conventions
conventions.convert("cmu.bvh", "$style", "$style.bvh", 1)
END
        must vg-encode $style.bvh -o $style.vgs
        # there and back: onto the skeleton that the motion comes from
        capture vg-deform --onto cmu.bvh $style.bvh -o vectors.vgs
        [ "$status" = 0 ] || fail "$style: $stderr"
        case $style in unreal | rigify) says 'rests with z up, unlike' 'turned upright' ;; *) [[ $stderr != *upright* ]] ;; esac
        must vg-solve vectors.vgs -o $style-back.vgs
    done
    must vg-encode cmu.bvh -o cmu.vgs
    py <<'END'
import math, read_stream
truth = read_stream.read_stream("cmu.vgs")
def limbs(s, f):
    at = {x.name: i for i, x in enumerate(s.skeleton) if x.name}
    out = {}
    for side in ("Left", "Right"):
        for a, b in (("Arm", "ForeArm"), ("ForeArm", "Hand"), ("UpLeg", "Leg"), ("Leg", "Foot")):
            d = [f.values[3 * at[side + b] + k] - f.values[3 * at[side + a] + k] for k in range(3)]
            n = math.hypot(*d)
            out[side + a] = [x / n for x in d]
    return out
places = {}
for style in "mixamo unreal unreal-y makehuman rigify metarig asf few vrm".split():
    s, worst = read_stream.read_stream(style + "-back.vgs"), 0
    assert len(s.frames) == len(truth.frames) == 12
    for f, g in zip(truth.frames, s.frames):
        a, b = limbs(truth, f), limbs(s, g)
        for k in a: worst = max(worst, math.degrees(math.acos(max(-1, min(1, sum(x * y for x, y in zip(a[k], b[k])))))))
    # every limb whose rest pose differs is aligned; what the motion did to it arrives
    assert worst < 0.01, (style, worst)
    places[style] = [f.values for f in s.frames]
# the up axis changes nothing else
assert max(abs(a - b) for f, g in zip(places["unreal"], places["unreal-y"]) for a, b in zip(f, g)) < 1e-3
END
    # --align none leaves rest poses and axes as they are
    must vg-deform --align none --onto cmu.bvh asf.bvh -o no.vgs
    [ "$(vg-deform --align none --onto cmu.bvh unreal.bvh -o no.vgs 2>&1 | grep -c upright)" = 0 ]
}

@test "conventions: a rest pose with any axis up and ahead, a motion with any axis up, turned by the root or not" {
    captured cmu.bvh
    styled() { # rest pose, motion
        py "$@" <<END
import sys
sys.path.insert(0, "$ROOT/tests")
import conventions
conventions.convert("cmu.bvh", "mixamo", "v.bvh", 1, *sys.argv[1:])
END
        must vg-encode v.bvh -o v.vgs
    }
    styled yz yz
    must_warn vg-deform --onto cmu.bvh v.bvh -o vectors.vgs # the limbs rest apart
    [[ $stderr != *moves* && $stderr != *'rests with'* ]]
    must vg-solve vectors.vgs -o truth.vgs
    for rest in yz yx y-x y-z z-y zx zy xz; do
        for motion in yz z-y; do
            styled $rest $motion
            must_warn vg-deform --onto cmu.bvh v.bvh -o vectors.vgs
            case $rest:$motion in
                yz:yz) [[ $stderr != *upright* && $stderr != *facing* ]] ;;
                y*:z-y) says 'moves with z up' 'its motion is turned upright' ;;
                [zx]*:yz) says "rests with ${rest:0:1} up" 'but moves with the same axis up: only its rest pose is turned' ;;
                [zx]*:z-y) says "rests with ${rest:0:1} up" 'its motion is turned upright' ;;
                *) says 'rests facing another way' ;;
            esac
            must vg-solve vectors.vgs -o out.vgs
            must vg-diff -t 1e-5 truth.vgs out.vgs
        done
    done
    # who lies at first is not stood up: along an axis, the hips near the ground and not as high as those of who stands
    styled yz z-y
    awk '/^Frame Time/ {print; on = 1; next} on {$2 = 2; $3 = 1} {print}' v.bvh >lies.bvh
    must_warn vg-deform --onto cmu.bvh lies.bvh -o vectors.vgs
    [[ $stderr != *upright* ]]
    styled z-y yz # lies in a file whose z is up
    awk '/^Frame Time/ {print; on = 1; next} on {$2 = 1; $3 = 2} {print}' v.bvh >lies.bvh
    must_warn vg-deform --onto cmu.bvh lies.bvh -o vectors.vgs
    says 'rests with z up' 'its motion is turned upright'
}
