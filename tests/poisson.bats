# poisson.bats: vg-poisson: keys are met to the bit, second differences stay, memory stays bounded, and what is refused.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# second_differences BEFORE AFTER [KEY...]: those of the vertices agree, in text made by values_of, at all frames but the keys
second_differences() {
    must python3 - "$@" <<'END'
import sys
def frames(path):
    with open(path) as file: return [list(map(float, line.split())) for line in file]
u, t, keys = frames(sys.argv[1]), frames(sys.argv[2]), set(map(int, sys.argv[3:]))
assert len(u) == len(t) > 4
worst = max(abs((t[k-1][i] - 2*t[k][i] + t[k+1][i]) - (u[k-1][i] - 2*u[k][i] + u[k+1][i]))
            for k in range(1, len(u) - 1) if k not in keys for i in range(len(u[0])))
if worst > 1e-13: sys.exit("second differences differ by %g" % worst)
END
}

# values_of STREAM: one line a frame
values_of() {
    PYTHONPATH=$ROOT/examples python3 - "$1" <<'END'
import sys, read_stream
for frame in read_stream.read_stream(sys.argv[1]).frames: print(*map(repr, frame.values))
END
}

# labels_of STREAM: what goes with the frames and must pass
labels_of() {
    PYTHONPATH=$ROOT/examples python3 - "$1" <<'END'
import sys, read_stream
s = read_stream.read_stream(sys.argv[1])
def records(list): return [(r.tag, r.flags, bytes(r.payload).hex()) for r in list if r.flags & 2]
print(s.precision, s.count, s.reference_name, list(s.reference), s.selection, s.links, s.anchors, records(s.extra), records(s.tail))
for f in s.frames: print(repr(f.name), f.time, records(f.extra))
END
}

# is_frame STREAM NUMBER POSE: that frame is this mesh's pose, to the bit
is_frame() {
    vg-encode "$3" -o .given.vgs
    [ "$(values_of "$1" | sed -n "$(($2 + 1))p")" = "$(values_of .given.vgs)" ] || fail "frame $2 of $1 is not $3"
}

# walk: u.vgs, 9 frames walk1 .. walk9 of two components, and poses a.obj, b.obj, c.obj
walk() {
    local i
    mkdir walk
    for ((i = 1; i <= 9; i++)); do mesh two "0.$i" "$i" >"walk/walk$i.obj"; done
    vg-encode walk -o u.vgs
    mesh two 0.5 2 >a.obj
    mesh two 0.1 9 >b.obj
    mesh two 0.7 4 >c.obj
}

@test "first and last are met to the bit, second differences stay, wherever frames wait" {
    walk
    must vg-poisson --first a.obj --last b.obj u.vgs --no-provenance -o t.vgs
    is_frame t.vgs 0 a.obj
    is_frame t.vgs 8 b.obj
    values_of u.vgs >u
    values_of t.vgs >t
    second_differences u t
    must vg-info --check t.vgs
    for size in 0 1K 1g; do # in the file, in both, in memory
        must vg-poisson --memory $size --first a.obj --last b.obj u.vgs --no-provenance -o again.vgs
        same_file again.vgs t.vgs
    done
}

@test "keys by name and by number; before the first and behind the last its own offset holds" {
    walk
    must vg-poisson --over time --key walk8=c.obj --key 2=a.obj --key walk6=b.obj u.vgs -o t.vgs
    is_frame t.vgs 2 a.obj
    is_frame t.vgs 5 b.obj
    is_frame t.vgs 7 c.obj
    values_of u.vgs >u
    values_of t.vgs >t
    second_differences u t 2 5 7
    must python3 - <<'END'
u, t = ([list(map(float, line.split())) for line in open(name)] for name in "ut")
for frame, key in (0, 2), (1, 2), (8, 7):
    for i in range(len(u[0])):
        assert abs((t[frame][i] - u[frame][i]) - (t[key][i] - u[key][i])) < 1e-14
END
}

@test "one given pose, or the same offset at both ends: a constant offset" {
    walk
    values_of u.vgs >u
    must vg-poisson --last b.obj u.vgs -o last.vgs
    is_frame last.vgs 8 b.obj
    values_of last.vgs >t
    second_differences u t
    must vg-poisson --first walk/walk1.obj --last walk/walk9.obj u.vgs -o same.vgs
    must diff u <(values_of same.vgs) # no offset at all: no bit changes
    mesh two 0.1 1.5 >first.obj
    mesh two 0.9 9.5 >second.obj
    pipe 'vg-poisson --first first.obj --last second.obj u.vgs | vg-diff --centred -t 1e-6 u.vgs -'
    vg-encode walk/walk1.obj -o one.vgs
    must vg-poisson --first a.obj --last a.obj one.vgs -o t.vgs # the only frame is the first and the last
    is_frame t.vgs 0 a.obj
}

@test "a name wins where both are there, and what cannot be told apart is refused" {
    local i
    for i in 3 0 1 7; do mesh cube "0.$i" >"$i.obj"; done
    mesh cube 1 5 >given.obj
    vg-encode 3.obj 0.obj 1.obj 7.obj -o u.vgs       # numbers 0 1 2 3
    must vg-poisson --key 3=given.obj u.vgs -o t.vgs # what is named 3 is number 0
    is_frame t.vgs 0 given.obj
    is_frame <(vg-poisson --key '#3=given.obj' u.vgs) 3 given.obj
    is_frame <(vg-poisson --key 2=given.obj u.vgs) 2 given.obj # no such name
    must_fail 3 vg-poisson --key 1=given.obj u.vgs -o none.vgs # number 1 comes before what is named 1
    one_line
    says "'--key 1' is the number of one frame and the name of a later one: write '--key #1=given.obj' or '--key #2=given.obj'"
    vg-encode 7.obj 7.obj 7.obj -o same.vgs
    is_frame <(vg-poisson --key 7=given.obj same.vgs) 0 given.obj # the first of that name
    vg-encode 0.obj 0.obj -o same.vgs
    is_frame <(vg-poisson --key 0=given.obj same.vgs) 0 given.obj # which has that number, too
}

@test "keys without a frame are named, and the stream gets no end" {
    walk
    must_fail 3 bash -c 'vg-poisson --key walk3=a.obj --key 9=b.obj --key "#12=c.obj" --key hop=c.obj u.vgs >t.vgs'
    one_line
    says "there is no frame for '--key 9', '--key #12', '--key hop' among the 9, whose numbers are 0 to 8"
    must_fail 3 vg-info --check t.vgs
    says 'vg-poisson failed'
    must_fail 3 vg-poisson --key hop=a.obj u.vgs -o none.vgs
    [ ! -e none.vgs ]
}

@test "an empty sequence, and two poses for one frame" {
    walk
    py u.vgs empty.vgs <<'END'
import struct, sys, make_corpus
data = open(sys.argv[1], "rb").read()
at, records = 16, []
while at < len(data):
    tag, size = data[at:at + 4], struct.unpack_from("<Q", data, at + 8)[0]
    end = at + 32 + (size + 7) // 8 * 8
    if tag not in (b"FRAM", b"END "): records.append(data[at:end])
    at = end
payload = struct.pack("<QQ", len(records), make_corpus.xxh64(b"".join(r[24:32] for r in records)))
head = b"END " + struct.pack("<IQQ", 1, len(payload), make_corpus.xxh64(payload))
end = head + struct.pack("<Q", make_corpus.xxh64(head)) + payload
open(sys.argv[2], "wb").write(data[:16] + b"".join(records) + end)
END
    must vg-info --check empty.vgs
    must_fail 3 vg-poisson --first a.obj --last b.obj empty.vgs -o t.vgs
    says "there is no frame for '--first', '--last': the sequence is empty"
    must_fail 3 vg-poisson --first a.obj --key walk1=b.obj u.vgs -o t.vgs
    says "'--first' and '--key walk1' give two poses to one frame, number 0, 'walk1'"
    must vg-poisson --first a.obj --key 0=a.obj u.vgs -o t.vgs
}

@test "given poses: an archive, a stream, standard input; another mesh or vectors are refused" {
    walk
    (cd walk && python3 -m zipfile -c ../walk.zip ./*.obj)
    vg-encode b.obj a.obj -o ba.vgs
    must vg-poisson --first walk.zip --last ba.vgs u.vgs -o t.vgs # the first pose of each
    is_frame t.vgs 0 walk/walk1.obj
    is_frame t.vgs 8 b.obj
    pipe 'vg-encode c.obj | vg-poisson --first - u.vgs -o t.vgs'
    is_frame t.vgs 0 c.obj
    must_fail 2 bash -c 'vg-poisson --first - --last a.obj <ba.vgs >t.vgs'
    must_fail 2 vg-poisson --first - --last - u.vgs -o t.vgs
    says 'standard input can be read only once, not for --first and --last'
    mesh cube >cube.obj
    must_fail 3 vg-poisson --first cube.obj u.vgs -o t.vgs
    says "'cube.obj' has 8 vertices where the sequence has 12"
    vg-encode --vectors a.obj -o vectors.vgs
    must_fail 3 vg-poisson --first vectors.vgs u.vgs -o t.vgs
    says "'vectors.vgs' holds vectors: pipe it through 'vg-solve' first"
    must_fail 3 vg-poisson --first a.obj vectors.vgs -o t.vgs
    says "the input holds vectors: pipe it through 'vg-solve' first"
    vg-deform vectors.vgs -o turns.vgs
    must_fail 3 vg-poisson --first a.obj turns.vgs -o t.vgs
    says 'the input holds deformations' 'vg-deform --onto MESH'
    must_fail 3 vg-poisson --first a.obj "$GOLDEN/transforms.vgs" -o t.vgs
    says 'the input holds transforms'
    must_fail 4 vg-poisson --first nothing.obj u.vgs -o t.vgs
    says nothing.obj
}

@test "usage" {
    walk
    must_fail 2 vg-poisson u.vgs -o t.vgs
    says 'name at least one given pose: --first, --last or --key'
    for key in '' = =a.obj 3 3= walk; do must_fail 2 vg-poisson --key "$key" u.vgs -o t.vgs; done
    says "option '--key' needs FRAME=MESH, not 'walk'"
    must_fail 2 vg-poisson --first a.obj --first b.obj u.vgs -o t.vgs
    says "option '--first' is given twice"
    for size in '' M 3X -1 1.5M 99999999999999999999 1MM; do
        must_fail 2 vg-poisson --memory "$size" --first a.obj u.vgs -o t.vgs
        says "option '--memory' needs a size such as 64M or 2G, not '$size'"
    done
    must vg-poisson --key walk1=a.obj --memory 12345678901234567890T u.vgs -o t.vgs
}

@test "names, times, records and precision pass" {
    for golden in times unknown-records f32 every-header-record; do
        in=$GOLDEN/$golden.vgs
        [ "$(vg-info --json "$in" | python3 -c 'import json, sys; print(json.load(sys.stdin)["kind"])')" = vertices ] || continue
        must vg-poisson --memory 0 --last "$in" "$in" -o out.vgs
        labels_of "$in" >before
        labels_of out.vgs >after
        must diff before after
    done
    [ -s out.vgs ]
}

# peak_kilobytes COMMANDLINE: the largest resident set of its processes
peak_kilobytes() {
    python3 -c '
import resource, subprocess, sys
subprocess.run(["bash", "-e", "-o", "pipefail", "-c", sys.argv[1]], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)' "$1"
}

@test "a long sequence waits in a file, not in memory" {
    [ "${CONFIG:-release}" = release ] || skip 'sanitizers have a use of memory of their own'
    python3 - >u.obj <<'END'
for i in range(4000): print("v", i % 63, i // 63, 0)
for i in range(3900):
    if i % 63 < 62: print("f", i + 1, i + 2, i + 65, i + 64)
END
    sed '/^v/s/ 0$/ 1/' u.obj >a.obj
    vg-encode u.obj -o one.vgs
    # shellcheck disable=SC2046 # words
    vg-encode $(for _ in {1..200}; do echo one.vgs; done) -o part.vgs
    parts='part.vgs part.vgs part.vgs part.vgs part.vgs' # 1000 frames of 96 kB
    short=$(peak_kilobytes 'vg-encode one.vgs | vg-poisson --first a.obj -o t.vgs')
    held=$(peak_kilobytes "vg-encode $parts | vg-poisson --memory 4M --first u.obj --last a.obj -o t.vgs")
    through=$(peak_kilobytes "vg-encode $parts | vg-poisson --first a.obj -o t.vgs")
    [ "$held" -lt $((short + 4096 + 8000)) ] || fail "$held kB where a single frame takes $short"
    [ "$through" -lt $((short + 8000)) ] || fail "$through kB where a single frame takes $short"
    must_fail 4 env TMPDIR=/nowhere vg-poisson --memory 0 --last a.obj part.vgs -o t.vgs
    says "cannot make a temporary file in '/nowhere'"
}

@test "how joints turned goes with where they were, and is dropped" {
    must vg-info "$GOLDEN/turns.vgs"
    shows 'known in 1 of 1 frames'
    must vg-poisson --first "$GOLDEN/turns.vgs" "$GOLDEN/turns.vgs" -o guided.vgs
    must vg-info guided.vgs
    shows 'known in 0 of 1 frames'
}

@test "over the pose: keys are met to the bit, frames wait for the last key, and a third pose is not worse than two" {
    mkdir truth
    vg-encode --reference "$DATA/trex.rest.obj" "$DATA/trex-walk.tar.xz" -o u.vgs
    must vg-decode u.vgs -o 'walk%02d.obj'
    for file in walk*.obj "$DATA/trex.rest.obj"; do # another body whose true walk is known: taller, and slimmer
        LC_ALL=C awk '$1 == "v" {printf "v %.6f %.6f %.6f\n", 0.8 * $2, 1.3 * $3, $4; next} 1' "$file" >"truth/$(basename "$file")"
    done
    pipe 'vg-deform --onto truth/trex.rest.obj u.vgs | vg-solve >t.vgs'
    mv truth/trex.rest.obj rest.obj
    vg-encode --reference rest.obj truth -o truth.vgs
    ends=(--first truth/walk00.obj --last truth/walk33.obj)
    must vg-poisson "${ends[@]}" t.vgs -o two.vgs
    for middle in 8 16 25; do
        must vg-poisson "${ends[@]}" --key "$middle=truth/walk$(printf %02d "$middle").obj" t.vgs --no-provenance -o three.vgs
        is_frame three.vgs 0 truth/walk00.obj
        is_frame three.vgs "$middle" "truth/walk$(printf %02d "$middle").obj"
        is_frame three.vgs 33 truth/walk33.obj
        must python3 -c 'import sys; assert float(sys.argv[2]) <= float(sys.argv[1]), sys.argv' \
            "$(vertex_error mean --centred truth.vgs two.vgs)" "$(vertex_error mean --centred truth.vgs three.vgs)"
    done
    must vg-poisson --memory 1K "${ends[@]}" --key 25=truth/walk25.obj t.vgs --no-provenance -o again.vgs
    same_file again.vgs three.vgs
    must vg-poisson --over pose "${ends[@]}" t.vgs -o pose.vgs
    must_fail 3 vg-poisson "${ends[@]}" --key 99=truth/walk25.obj t.vgs -o none.vgs
    [ ! -e none.vgs ]
}

@test "three true poses take a third off the error of a transferred walk" {
    mkdir truth
    vg-encode --reference "$DATA/trex.rest.obj" "$DATA/trex-walk.tar.xz" -o u.vgs
    must vg-decode u.vgs -o 'walk%02d.obj'
    for file in walk*.obj "$DATA/trex.rest.obj"; do # another body whose true walk is known: taller, and slimmer
        LC_ALL=C awk '$1 == "v" {printf "v %.6f %.6f %.6f\n", 0.8 * $2, 1.3 * $3, $4; next} 1' "$file" >"truth/$(basename "$file")"
    done
    pipe 'vg-deform --onto truth/trex.rest.obj u.vgs | vg-solve >t.vgs'
    must vg-poisson --first truth/walk00.obj --key 16=truth/walk16.obj --last truth/walk33.obj t.vgs -o guided.vgs
    mv truth/trex.rest.obj rest.obj
    vg-encode --reference rest.obj truth -o truth.vgs
    must python3 -c 'import sys; assert float(sys.argv[2]) < 0.67 * float(sys.argv[1]), sys.argv' \
        "$(vertex_error mean --centred truth.vgs t.vgs)" "$(vertex_error mean --centred truth.vgs guided.vgs)"
}
