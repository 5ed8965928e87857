#!/usr/bin/env bats
# The stream against its second implementation: examples/read_stream.py reads what the programs write, the programs read what
# tests/make_corpus.py writes, and both refuse the same.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC2086 # programs with options in variables are words
load lib.bash

# ---- golden and accept ------------------------------------------------------------------------------------------------

@test "the generator makes the committed golden streams and corpora again, byte for byte" {
    must python3 "$ROOT/tests/make_corpus.py" "$PWD/new"
    for part in fmt/golden tests/corpus/accept tests/corpus/reject; do
        for file in new/$part/*; do same_file "$file" "$ROOT/$part/${file##*/}"; done
        must diff <(cd "$ROOT/$part" && ls ./*.vgs) <(cd new/$part && ls ./*.vgs)
    done
}

@test "the python reader finds in each golden stream what its JSON says" {
    py "$GOLDEN" <<'END'
import glob, json, sys, read_stream
files = sorted(glob.glob(sys.argv[1] + "/*.vgs"))
assert len(files) >= 11, files
for name in files:
    with open(name[:-3] + "json", encoding="utf-8") as f:
        assert read_stream.to_json(read_stream.read_stream(name)) == json.load(f), name
s = read_stream.read_stream(sys.argv[1] + "/correspondence.vgs")
assert s.digest() == s.correspondence.source[2]
END
}

@test "vg-info and the python reader take every golden stream and all of the accept corpus" {
    for file in "$GOLDEN"/*.vgs "$CORPUS"/accept/*.vgs; do
        must vg-info --check "$file"
        must witness --check "$file"
        must vg-info --check - <"$file"
    done
}

@test "a stream that is passed through comes out as it was" {
    for name in smallest f32 times empty-sequence every-header-record vectors vectors-selected-f32 pins scalars deformations transforms \
        features coordinates unknown-form skeleton correspondence patches map turns rig colours asset; do
        must vg-encode --no-provenance "$GOLDEN/$name.vgs" -o "$name.vgs"
        same_file "$GOLDEN/$name.vgs" "$name.vgs"
    done
    for name in extreme-numbers names line-segments-only points-without-faces transforms-with-mesh no-transforms \
        correspondence-without-mesh scalars-f32-without-unit scalars-of-nothing scalars-behind-unknown \
        map-of-bones-one-per-corner map-of-bones-without-corners rig-without-skin rig-of-transforms turns-f32 turns-in-one-frame \
        channels-255 channels-of-all-elements features-f32 form-unknown-of-vertices form-unknown-of-corners; do
        must vg-encode --no-provenance "$CORPUS/accept/$name.vgs" -o "$name.vgs"
        same_file "$CORPUS/accept/$name.vgs" "$name.vgs"
    done
}

@test "a stream of a future minor version is read, and written with the lowest minor that suffices" {
    must vg-encode --no-provenance "$GOLDEN/future-minor.vgs" -o now.vgs
    same_file "$GOLDEN/smallest.vgs" now.vgs
}

@test "the reference pose of a joined sequence is the first pose; the mesh, names and numbers are those of the files" {
    mesh strip >pose1.obj
    mesh strip 0.25 >pose2.obj
    must vg-encode pose1.obj pose2.obj -o a.vgs
    py <<'END'
import read_stream
s = read_stream.read_stream("a.vgs")
assert s.kind == "vertices" and s.precision == 8 and s.count == 6
assert s.mesh.faces() == [[0, 1, 2, 3], [2, 1, 4], [4, 5]]
assert [f.name for f in s.frames] == ["pose1", "pose2"]
for frame in s.frames:
    with open(frame.name + ".obj") as f:
        wanted = [float(x) for line in f if line.startswith("v ") for x in line.split()[1:]]
    assert list(frame.values) == wanted, frame.name
assert s.reference == s.frames[0].values
END
}

# ---- kinds of frames ----------------------------------------------------------------------------------------------------

@test "vectors are vertex minus mean of the face, root is the mean of the vertices in a face" {
    poses two 3
    must vg-encode pose1.obj pose2.obj pose3.obj -o vertices.vgs
    must vg-encode --vectors vertices.vgs -o vectors.vgs
    must vg-encode --vectors --faces selected --anchor 3,0 vertices.vgs -o selected.vgs
    py <<'END'
import read_stream
a = read_stream.read_stream("vertices.vgs")
for name in ("vectors.vgs", "selected.vgs"):
    v = read_stream.read_stream(name)
    assert v.kind == "vectors" and len(v.frames) == 3 and v.links is not None and len(v.links) == 2
    assert (v.selection is None) == (name == "vectors.vgs")
    for p, w in zip(a.frames, v.frames):
        for got, want in ((w.values, v.vectors_of(p.values)), (w.root, v.root_of(p.values))):
            assert len(got) == len(want) and max(abs(x - y) for x, y in zip(got, want)) < 1e-14
        anchors = list(v.anchors or ())
        assert anchors == ([] if name == "vectors.vgs" else [0, 3])
        assert list(w.anchors) == [x for i in anchors for x in p.values[3 * i:3 * i + 3]]
END
}

@test "a deformation turns and scales the reference's vector into the pose's" {
    poses two 3
    must vg-encode pose1.obj pose2.obj pose3.obj -o vertices.vgs
    must vg-deform vertices.vgs -o deformations.vgs
    py <<'END'
import read_stream
a, d = read_stream.read_stream("vertices.vgs"), read_stream.read_stream("deformations.vgs")
assert d.kind == "deformations" and d.count == sum(map(len, d.graph())) and len(d.frames) == 3
rest = d.vectors_of(d.reference)
for pose, frame in zip(a.frames, d.frames):
    want = d.vectors_of(pose.values)
    for c in range(d.count):
        got = read_stream.rotate(frame.values[4 * c:4 * c + 4], rest[3 * c:3 * c + 3])
        assert max(abs(x - y) for x, y in zip(got, want[3 * c:3 * c + 3])) < 1e-12, (frame.name, c)
    assert max(abs(x - y) for x, y in zip(frame.root, d.root_of(pose.values))) < 1e-13
END
}

@test "--f32 writes the nearest binary32 of every value, and keeps the reference" {
    poses cube 3
    must vg-encode pose*.obj -o f64.vgs
    must vg-encode --f32 pose*.obj -o f32.vgs
    py <<'END'
import read_stream
from array import array
a, b = read_stream.read_stream("f64.vgs"), read_stream.read_stream("f32.vgs")
assert a.precision == 8 and b.precision == 4 and a.reference == b.reference
for x, y in zip(a.frames, b.frames):
    assert array("f", x.values) == y.values
END
}

@test "a number that binary32 cannot hold is refused, not written as infinity" {
    printf 'v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n' >far.obj
    must_fail 3 vg-encode --f32 far.obj -o far.vgs
    says 1e+300 binary32
    nothing_but far.obj
}

@test "a quaternion and its negative are the same deformation" {
    py <<'END'
import make_corpus as m
c = m.graph_content("deformations")
for name, sign in (("a.vgs", 1), ("b.vgs", -1)):
    c["frames"][0]["values"] = [[sign * x for x in q] for q in c["frames"][0]["values"]]
    m.write(name, m.whole(c))
END
    must vg-encode "$GOLDEN/vectors.vgs" --no-provenance -o target.vgs
    for name in a b; do must vg-deform --no-provenance --onto target.vgs $name.vgs -o $name.onto; done
    py <<'END'
import read_stream
a, b = (read_stream.read_stream(name).frames[0] for name in ("a.onto", "b.onto"))
assert len(a.values) == 24 and a.values == b.values and a.root == b.root and a.anchors == b.anchors
END
}

# ---- what is refused ----------------------------------------------------------------------------------------------------

@test "every stream of the reject corpus has its expected message, and the other way round" {
    must diff <(cut -f 1 "$CORPUS/reject/expected.txt" | uniq) <(cd "$CORPUS/reject" && ls ./*.vgs | sed 's/^..//; s/\.vgs$//' | LC_ALL=C sort)
}

@test "vg-info --check refuses every stream of the reject corpus with status 3 and says why" {
    while IFS=$'\t' read -r name part; do
        must_fail 3 vg-info --check "$CORPUS/reject/$name.vgs"
        says "vg-info: " "$name.vgs" "$part"
        one_line
        [ -z "$output" ]
    done <"$CORPUS/reject/expected.txt"
}

@test "vg-encode refuses every stream of the reject corpus and leaves no file" {
    cut -f 1 "$CORPUS/reject/expected.txt" | uniq >names
    while read -r name; do
        must_fail 3 vg-encode "$CORPUS/reject/$name.vgs" -o out.vgs
        [ ! -e out.vgs ]
    done <names
    nothing_but names
}

@test "the python reader refuses every stream of the reject corpus for the same reason" {
    py "$CORPUS/reject" <<'END'
import sys, read_stream
with open(sys.argv[1] + "/expected.txt", encoding="utf-8") as f:
    for line in f:
        name, part = line.rstrip("\n").split("\t")
        try:
            read_stream.read_stream(f"{sys.argv[1]}/{name}.vgs")
        except read_stream.StreamError as error:
            assert part in str(error), (name, part, str(error))
        else:
            raise AssertionError(name + " was taken")
END
    must_fail 3 witness "$CORPUS/reject/end-sum.vgs"
    says "end-sum.vgs" "checksum"
    must_fail 4 witness nowhere.vgs
    must_fail 2 witness --nonsense
}

@test "the python reader refuses every prefix of a stream and every change of a byte" {
    py "$GOLDEN/vectors.vgs" <<'END'
import io, sys, read_stream
with open(sys.argv[1], "rb") as f:
    good = f.read()
read_stream.read_stream(io.BytesIO(good))

def refused(data):
    try:
        read_stream.read_stream(io.BytesIO(data))
    except read_stream.StreamError:
        return True
    return False

for n in range(len(good)):
    assert refused(good[:n]), n
taken = [i for i in range(len(good)) for x in (1, 0x80) if not refused(good[:i] + bytes([good[i] ^ x]) + good[i + 1:])]
# the minor version, bytes 8 to 11, may be anything
assert set(taken) == {8, 9, 10, 11}, taken
END
}

@test "programs refuse prefixes and changed bytes of a stream, from a file and from a pipe" {
    size=$(stat -c %s "$GOLDEN/times.vgs")
    for ((n = 0; n < size; n += 41)); do
        head -c $n "$GOLDEN/times.vgs" >part.vgs
        must_fail 3 vg-info --check part.vgs
        pipe_fail 3 "cat part.vgs | vg-encode -o out.vgs"
        [ ! -e out.vgs ]
    done
    py "$GOLDEN/times.vgs" <<'END'
import sys
with open(sys.argv[1], "rb") as f:
    good = f.read()
for i in range(16, len(good), 17):
    with open(f"changed{i}.vgs", "wb") as f:
        f.write(good[:i] + bytes([good[i] ^ 0x10]) + good[i + 1:])
END
    for file in changed*.vgs; do
        must_fail 3 vg-info --check "$file"
        must_fail 3 vg-encode "$file" -o out.vgs
        [ ! -e out.vgs ]
    done
}

@test "zero bytes on standard input: status 3 and a hint at the program before" {
    for program in vg-encode vg-deform vg-solve vg-info; do
        must_fail 3 $program -o out </dev/null
        says "$program: " "empty" "before"
        one_line
    done
    must_fail 3 vg-decode -o out.obj </dev/null
    says "vg-decode: " "empty"
    must_fail 3 vg-view -o out.png </dev/null
    says "vg-view: " "empty"
    nothing_but
}

# ---- forms nobody knows -----------------------------------------------------------------------------------------------

@test "frames of an unknown form are described and passed on, and stop everything else by their name" {
    must vg-info "$GOLDEN/unknown-form.vgs"
    shows "3 möbius, binary64"
    shows "'hue' of each whisker in 1 of the frames: 0 to 1 1/m"
    must vg-info --json "$GOLDEN/unknown-form.vgs" -o u.json
    grep -q '"kind": "möbius"' u.json
    for program in "vg-encode --vectors" "vg-encode --f32" vg-deform vg-solve "vg-interpolate 3" vg-segment vg-fitmap "vg-poisson --last $GOLDEN/smallest.vgs"; do
        must_fail 3 $program "$GOLDEN/unknown-form.vgs" -o out
        says "möbius"
        one_line
    done
    must_fail 3 vg-decode "$GOLDEN/unknown-form.vgs" -o out.obj
    says "möbius"
    must_fail 3 vg-view "$GOLDEN/unknown-form.vgs" -o out.png
    says "möbius"
    must_fail 3 vg-diff "$GOLDEN/unknown-form.vgs" "$GOLDEN/smallest.vgs"
    says "möbius"
    must_fail 3 vg-encode "$GOLDEN/unknown-form.vgs" "$GOLDEN/smallest.vgs" -o out
    says "möbius"
    nothing_but u.json
}

@test "features and coordinates go where they can be used, and nowhere else" {
    for form in features coordinates; do
        must vg-info "$GOLDEN/$form.vgs"
        shows " $form, binary64"
        must vg-decode -q "$GOLDEN/$form.vgs" -o $form.npy
        for program in "vg-encode --vectors" vg-deform vg-solve "vg-interpolate 3" vg-segment vg-fitmap; do
            [[ $form$program == featuresvg-solve ]] && continue # it takes them back to vertices
            must_fail 3 $program "$GOLDEN/$form.vgs" -o out
            says "$form"
        done
        must_fail 3 vg-view "$GOLDEN/$form.vgs" -o out.png
        says "$form"
    done
    py "$GOLDEN" <<'END'
import struct, sys
import read_stream
for form, shape in (("features", "(1, 4, 9)"), ("coordinates", "(2, 1, 2)")):
    s = read_stream.read_stream(f"{sys.argv[1]}/{form}.vgs")
    data = open(f"{form}.npy", "rb").read()
    n, = struct.unpack_from("<H", data, 8)
    assert shape in data[10:10 + n].decode(), data[:90]
    numbers = [x for f in s.frames for x in f.values]
    assert list(struct.unpack(f"<{len(numbers)}f", data[10 + n:])) == numbers
END
}

# ---- records nobody knows -----------------------------------------------------------------------------------------------

@test "an unknown critical record stops every program, which names it" {
    for file in "$CORPUS"/reject/critical-*.vgs; do
        tag=$(sed -n "s/^$(basename "$file" .vgs)\t\(record '[^']*'\).*/\1/p" "$CORPUS/reject/expected.txt")
        [ -n "$tag" ]
        for program in vg-encode vg-deform vg-solve vg-info; do
            must_fail 3 $program "$file" -o out
            says "$program: " "$tag"
        done
        must_fail 3 vg-decode "$file" -o out.obj
        says "$tag"
        must_fail 3 vg-view "$file" -o out.png
        says "$tag"
        must_fail 3 vg-diff "$file" "$GOLDEN/smallest.vgs"
        says "$tag"
    done
    nothing_but
}

@test "a filter passes copy-safe records on where they were, and drops the others" {
    must vg-encode --no-provenance "$GOLDEN/unknown-records.vgs" -o out.vgs
    py "$GOLDEN/unknown-records.json" <<'END'
import json, sys, read_stream
with open(sys.argv[1], encoding="utf-8") as f:
    want = json.load(f)
want["extra"] = [r for r in want["extra"] if r["flags"] & 2]
assert len(want["extra"]) == 1
got = read_stream.to_json(read_stream.read_stream("out.vgs"))
for key in ("extra", "frames", "tail"):
    assert got[key] == want[key], key
assert got["frames"][0]["extra"][0]["flags"] == 0xABCD0002
END
}

@test "unknown copy-safe records come through vg-solve and vg-deform in their places" {
    py <<'END'
import make_corpus as m
frames = m.graph_content("vectors")["frames"]
def note(text):
    return {"tag": "XNOT", "flags": 2, "payload": text.encode().hex()}
more = [dict(frames[0], name=f"f{i}", extra=[note(f"before {i}"), note("again")]) for i in range(20)]
m.write("in.vgs", m.whole(m.graph_content("vectors", frames=more, extra=[note("head")], tail=[note("tail")])))
END
    must vg-solve in.vgs -o solved.vgs
    must vg-deform in.vgs -o deformed.vgs
    must vg-deform --onto solved.vgs in.vgs -o onto.vgs
    must vg-encode --vectors solved.vgs -o again.vgs
    py <<'END'
import read_stream
def text(records):
    return [r.payload.decode() for r in records]
for name in ("solved.vgs", "deformed.vgs", "onto.vgs", "again.vgs"):
    s = read_stream.read_stream(name)
    assert text(s.extra) == ["head"] and text(s.tail) == ["tail"], name
    assert [text(f.extra) for f in s.frames] == [[f"before {i}", "again"] for i in range(20)], name
    assert [f.name for f in s.frames] == [f"f{i}" for i in range(20)] and s.frames[0].time == 0.5, name
END
}

# ---- provenance ---------------------------------------------------------------------------------------------------------

@test "the provenance has one record for each process, with its arguments" {
    poses tetra 2
    pipe 'vg-encode pose1.obj pose2.obj | vg-deform --onto pose1.obj | vg-solve -j 1 >out.vgs'
    py <<'END'
import read_stream
p = read_stream.read_stream("out.vgs").provenance
assert [x.program for x in p] == ["vg-encode", "vg-deform", "vg-solve"], p
assert [x.parents for x in p] == [[], [0], [1]]
assert p[0].args == ["vg-encode", "pose1.obj", "pose2.obj"]
assert p[1].args == ["vg-deform", "--onto", "pose1.obj"]
assert p[2].args == ["vg-solve", "-j", "1"]
END
    must vg-info out.vgs
    shows vg-encode vg-deform vg-solve "--onto pose1.obj"
}

@test "a process with two streams has two parents" {
    poses tetra 2
    must vg-encode pose1.obj pose2.obj -o a.vgs
    pipe 'vg-encode pose2.obj | vg-solve >b.vgs'
    must vg-deform --onto b.vgs a.vgs -o c.vgs
    py <<'END'
import read_stream
p = read_stream.read_stream("c.vgs").provenance
assert sorted(x.program for x in p[:-1]) == ["vg-encode", "vg-encode", "vg-solve"], p
last = p[-1]
assert last.program == "vg-deform" and len(last.parents) == 2
assert sorted(p[i].program for i in last.parents) == ["vg-encode", "vg-solve"]
assert all(i < at for at, x in enumerate(p) for i in x.parents)
END
}

@test "--no-provenance leaves out this process and no other" {
    poses tetra 2
    must vg-encode --no-provenance pose1.obj -o none.vgs
    must vg-encode pose1.obj -o one.vgs
    must vg-solve --no-provenance one.vgs -o still-one.vgs
    py <<'END'
import read_stream
assert read_stream.read_stream("none.vgs").provenance == []
assert [p.program for p in read_stream.read_stream("still-one.vgs").provenance] == ["vg-encode"]
END
}

@test "arguments that are no UTF-8 come out as question marks" {
    name=$'caf\xe9.obj'
    mesh tetra >"$name" 2>/dev/null || skip "this file system takes only UTF-8 names"
    must vg-encode "$name" -o out.vgs
    must witness out.vgs
    shows 'vg-encode caf?.obj'
}

@test "the same command gives the same bytes, whatever the thread count" {
    poses two 9
    for i in 1 2; do
        pipe "vg-encode pose*.obj | vg-deform --onto pose3.obj | vg-solve >run$i.vgs"
        pipe "vg-encode --no-provenance pose*.obj | vg-deform --no-provenance -j $i --onto pose3.obj |
              vg-solve --no-provenance -j $i >threads$i.vgs"
    done
    same_file run1.vgs run2.vgs
    same_file threads1.vgs threads2.vgs
}

# ---- failure in the stream ----------------------------------------------------------------------------------------------

@test "a filter that fails says so in the stream, and the next one passes the story on" {
    mesh cube >a1.obj
    mesh tetra >a2.obj
    must_fail 3 vg-encode a1.obj a2.obj
    says "vg-encode: " a2.obj
    message=${stderr#vg-encode: }
    cp .stdout broken.vgs
    must_fail 3 witness broken.vgs
    says "vg-encode failed with status 3" "$message"
    must_fail 3 vg-solve broken.vgs
    says "vg-solve: " vg-encode "$message"
    pipe_fail 3 'vg-encode a1.obj a2.obj | vg-solve | vg-decode -o out.obj'
    says "vg-encode: " "vg-solve: " "vg-decode: "
    nothing_but a1.obj a2.obj broken.vgs
}

@test "a stream of an earlier layout is named as such" {
    py <<'END'
import make_corpus as m
def text32(s): return m.u32(len(s)) + s.encode()
old = m.u32(1, 1, 0) + text32("vg-solve") + text32("0.1") + text32("-v")
c = m.content()
for name, payload in ("old.vgs", old), ("cut.vgs", old[:-1]):
    record = m.Record("PROV", payload, m.COPY_SAFE)
    open(name, "wb").write(m.whole(c, [record] + m.records_of(dict(c, provenance=[]))))
END
    must_fail 3 vg-info old.vgs
    says "'old.vgs' was written by an earlier version of this program"
    must_fail 3 vg-info cut.vgs
    says "'cut.vgs': record PROV: "
}

# ---- waiting ----------------------------------------------------------------------------------------------------------

@test "frames go on before the next ones are waited for" {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >a.obj
    for ((i = 0; i < 80; i++)); do cp a.obj "s$i.obj"; done
    must vg-encode --no-provenance s*.obj -o all.vgs
    cut=$(($(wc -c <all.vgs) - 100)) # in the last frame, of 128 bytes; the END mark has 48
    { head -c $cut all.vgs; for ((n = 0; n < 100; n++)); do [ -e seen ] || sleep 0.1; done; tail -c +$((cut + 1)) all.vgs; } 3>&- |
        vg-encode --no-provenance - >out.vgs 3>&- &
    for ((i = 0; i < 80 && $(wc -c <out.vgs) < cut - 76; i++)); do sleep 0.1; done
    early=$(wc -c <out.vgs)
    : >seen
    wait $!
    [ "$early" = $((cut - 76)) ]
    same_file out.vgs all.vgs
}
