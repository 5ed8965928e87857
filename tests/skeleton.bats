# skeleton.bats: skeletons and motions of joints as text.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# A body whose joints lie apart from each other, the hand before its arm; a leg whose end lies at a foot that hangs on the root.
body() {
    cat <<'END'
# a body: bone parent head tail
hand.L arm.L 3 4 0 4 4 0
hips - 0 2 0 0 3 0
spine hips 0 3 0 0 4 0.5
arm.L spine 1 4 0.25 3 4 0
arm.R spine -1 4 0.25 -3 4 0
head spine 0 5 0 0 6 0
leg.L hips 1 2 0 1.01 0 0
foot.L hips 1 0 0 1 0 1
END
}

@test "a skeleton as text is a sequence of its rest pose, with an end for each bone" {
    body >body.skeleton.txt
    must vg-encode body.skeleton.txt -o body.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("body.vgs")
bones = [line.split() for line in open("body.skeleton.txt") if not line.startswith("#")]
assert len(s.skeleton) == s.mesh.nv == 2 * len(bones) and len(s.frames) == 1 and s.frames[0].name == "body"
index = {j.name: i for i, j in enumerate(s.skeleton)}
assert [j.name for j in s.skeleton] == ["hips", "spine", "arm.L", "hand.L", "hand.L.end", "arm.L.end", "arm.R", "arm.R.end", "head",
                                        "head.end", "spine.end", "leg.L", "leg.L.end", "foot.L", "foot.L.end", "hips.end"]
for name, parent, *numbers in bones:
    numbers, j = list(map(float, numbers)), index[name]
    joint, end = s.skeleton[j], index[name + ".end"]
    assert joint.parent == (None if parent == "-" else index[parent]) and s.skeleton[end].parent == j
    assert joint.channels == ([1, 2, 3, 6, 4, 5] if parent == "-" else [6, 4, 5]) and s.skeleton[end].channels == []
    assert list(s.reference[3 * j:3 * j + 3]) == numbers[:3] and list(s.reference[3 * end:3 * end + 3]) == numbers[3:]
assert s.frames[0].values == s.reference and list(s.frames[0].turns) == [1, 0, 0, 0] * len(s.skeleton)
END
    must vg-decode body.vgs -o body.bvh
    must vg-encode body.bvh -o again.vgs
    must vg-diff -t 1e-9 body.vgs again.vgs
    must vg-encode --no-provenance body.skeleton.txt -o named.vgs
    cp body.skeleton.txt told-by-content
    must vg-diff -t 0 told-by-content named.vgs
    pipe 'vg-diff -t 0 - named.vgs <told-by-content'
    must vg-view body.skeleton.txt -o body.png
}

@test "joints over time: their turns are found, ends go with their bones, a leg reaches for its foot" {
    body >body.txt
    py <<'END'
import math, random
from read_stream import rotate
random.seed(5)
def times(p, q):
    w, x, y, z = p
    a, b, c, d = q
    return [w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c, w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a]
bones = {}
for line in open("body.txt"):
    if not line.startswith("#"):
        name, parent, *numbers = line.split()
        bones[name] = (parent, list(map(float, numbers[:3])), list(map(float, numbers[3:])))
truth = open("truth.txt", "w")
with open("body.joints.txt", "w") as out:
    for frame in range(0, 20, 2):
        turn, place = {}, {}
        for name in ("hips", "spine", "arm.L", "hand.L", "arm.R", "head", "leg.L", "foot.L"):
            parent, head, tail = bones[name]
            q = [1.0, *(random.uniform(-0.5, 0.5) for _ in range(3))] if name in ("hips", "spine") else [1.0, 0, 0, 0]
            q = [x / math.sqrt(sum(y * y for y in q)) for x in q]
            turn[name] = q if parent == "-" else times(turn[parent], q)
            at = [frame, 2.0, -frame] if parent == "-" else [
                a + b for a, b in zip(place[parent], rotate(turn[parent], [x - y for x, y in zip(head, bones[parent][1])]))]
            place[name] = at
            print(f"{frame:03d}", name, *at, file=out)
            print(f"{frame:03d}", name, *turn[name], *(a + b for a, b in zip(at, rotate(turn[name], [x - y for x, y in zip(tail, head)]))),
                  file=truth)
END
    must vg-encode --mesh body.txt body.joints.txt -o moved.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("moved.vgs")
index = {j.name: i for i, j in enumerate(s.skeleton)}
frames = {f.name: f for f in s.frames}
assert list(frames) == [f"{i:03d}" for i in range(0, 20, 2)]
for line in open("body.joints.txt"):
    frame, name, *at = line.split()
    j = index[name]
    assert list(frames[frame].values[3 * j:3 * j + 3]) == list(map(float, at))
for line in open("truth.txt"):
    frame, name, *numbers = line.split()
    numbers, f, j = list(map(float, numbers)), frames[frame], index[name]
    if name == "spine" or name == "hips":  # joints in several directions say all
        assert abs(abs(sum(a * b for a, b in zip(f.turns[4 * j:4 * j + 4], numbers))) - 1) < 1e-10, (frame, name)
    end = index[name + ".end"]
    error = max(abs(a - b) for a, b in zip(f.values[3 * end:3 * end + 3], numbers[4:]))
    assert error < (0.02 if name == "leg.L" else 1e-9), (frame, name, error)
END
    must vg-decode -q moved.vgs -o moved.bvh
    must vg-diff -t 1e-6 moved.vgs moved.bvh
    # the skeleton may come as any file of a skeleton, or before the joints
    must vg-encode --no-provenance body.txt -o body.vgs
    must vg-encode --no-provenance --mesh body.vgs body.joints.txt -o a.vgs
    must vg-encode --no-provenance --mesh body.txt body.joints.txt -o b.vgs
    same_file a.vgs b.vgs
    must vg-encode body.txt body.joints.txt -o both.vgs
    must vg-info both.vgs
    [[ $output == *"11: 'body.txt' to '018'"* ]] || fail "$output"
}

@test "a leg that ends at a foot of another bone bends with it" {
    body | grep -E '^(hips|leg|foot)' >legs.txt
    printf '0 hips 0 2 0\n0 leg.L 1 2 0\n0 foot.L 1 2 -2\n' >kick.joints.txt
    must vg-encode --mesh legs.txt kick.joints.txt -o kick.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("kick.vgs")
end = [j.name for j in s.skeleton].index("leg.L.end")
at = s.frames[0].values[3 * end:3 * end + 3]
assert max(abs(a - b) for a, b in zip(at, (1.01, 2, -2))) < 1e-3, list(at)  # 2 long, now straight back
END
}

@test "skeletons and joints that make no sense are refused, with the line" {
    refused() {
        printf "$1" >bad.skeleton.txt
        must_fail 3 vg-encode bad.skeleton.txt -o bad.vgs
        [[ $stderr == *"$2"* ]] || fail "$stderr"
        [ ! -e bad.vgs ] || fail "bad.vgs was left"
    }
    refused 'a - 0 0 0 1 1\n' "line 1: a bone is 'BONE PARENT HEAD_X"
    refused 'a - 0 0 0 1 1 x\n' "line 1: 'x' is not a number"
    refused 'a - 0 0 0 1 1 nan\n' "line 1: 'nan' is not a number"
    refused 'a b 0 0 0 1 1 1\n' "line 1: the parent 'b' of 'a' is not defined"
    refused 'a - 0 0 0 1 1 1\na - 0 0 0 1 1 1\n' "line 2: 'a' is already defined, in line 1"
    refused 'a b 0 0 0 1 1 1\nb a 0 0 0 1 1 1\n' 'has a cycle of joints'
    refused '# nothing\n' 'names no joint'
    refused 'a - vertices 1 2 3\n' 'vg-fitmap --groups'
    printf 'a - vertices 1 2 3\n' >groups.txt
    must_fail 3 vg-encode groups.txt -o bad.vgs
    [[ $stderr == *"vg-fitmap --groups"* ]] || fail "$stderr"

    printf 'a - 0 0 0 0 1 0\nb a 0 1 0 0 2 0\n' >two.txt
    moved() {
        printf "$1" >bad.joints.txt
        must_fail 3 vg-encode --mesh two.txt bad.joints.txt -o bad.vgs
        [[ $stderr == *"$2"* ]] || fail "$stderr"
    }
    moved '0 a 0 0 0\n' "has no joint 'b' in frame 0"
    moved '0 a 0 0 0\n0 b 0 0 1\n0 c 0 0 1\n' "line 3: the skeleton has no joint 'c'"
    moved '0 a 0 0 0\n0 b 0 0 1\n0 a 0 0 1\n' "line 3: joint 'a' is already defined"
    moved '0 a 0 0 0\n0 b 0 0 1\n1 a 0 0 1\n' "has no joint 'b' in frame 1"
    moved '0 a 0 0 0\n0 b 0 0 1\n1 a.end 0 0 1\n' "line 3: joint 'a.end' is not in earlier frames"
    moved '1 a 0 0 0\n1 b 0 0 1\n0 a 0 0 1\n' 'line 3: frame 0 comes after frame 1'
    moved '0 a 0 0 0\nx b 0 0 1\n' "line 2: a joint is 'FRAME BONE X Y Z'"
    moved '0 a 0 0 0\n0 b 0 0\n' "line 2: a joint is 'FRAME BONE X Y Z'"
    moved '0 a 0 0 0\n0 b 0 0 1e400\n' "'1e400' is not a number"
    moved '# nothing\n' 'holds no frame'
    must_fail 3 vg-encode bad.joints.txt -o bad.vgs
    printf '0 a 0 0 0\n0 b 0 1 0\n' >good.joints.txt
    must_fail 3 vg-encode good.joints.txt -o bad.vgs
    [[ $stderr == *'--mesh'* ]] || fail "$stderr"
    mesh strip >strip.obj
    must_fail 3 vg-encode --mesh strip.obj good.joints.txt -o bad.vgs
    [[ $stderr == *'--mesh'* ]] || fail "$stderr"
}
