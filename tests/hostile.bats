#!/usr/bin/env bats
# Files that mean no good, and meshes that nobody models: a defined answer or a clear refusal, in bounded time and memory; no NaN,
# no half a file. What is refused on the level of a format is in formats.bats and the corpora.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

hostile() {
    must python3 "$ROOT/tests/tools/hostile.py" "$@"
}

# soon COMMAND...: within a minute of processor time, and within 2 GB of memory where no sanitizer needs more. The time that
# passes depends on what else the machine does: it ends only what hangs.
soon() {
    case ${CONFIG:-release} in
    release) timeout 1200 bash -c 'ulimit -v 2000000; ulimit -t 60; "$@"' bash "$@" ;;
    *) timeout 1200 bash -c 'ulimit -t 240; "$@"' bash "$@" ;;
    esac
}

# answers COMMAND...: status 0, or 1 or 3 with one line; and what it wrote with -o is whole
answers() {
    local out=
    capture soon "$@" || return 1
    case $status in
    0) ;;
    1 | 3) one_line && [ -n "$stderr" ] || return 1 ;;
    *) fail "'$*' ended with status $status" "$stderr" || return 1 ;;
    esac
    [[ $output != *[nN]a[nN]* && $stderr != *[nN]a[nN]* ]] || fail "'$*' speaks of NaN" "$output" "$stderr" || return 1
    while [ $# -gt 1 ]; do
        [ "$1" != -o ] || out=$2
        shift
    done
    if [ "$status" = 0 ] && [[ $out == *.vgs ]]; then must vg-info --check "$out"; fi # which refuses what is not finite
}

# ---- archives ---------------------------------------------------------------------------------------------------------

@test "names that lead out of the archive are names only" {
    hostile names
    must soon vg-encode names.tar.gz -o t.vgs
    must soon vg-encode names.zip -o z.vgs
    must vg-info --json t.vgs
    [ "$(python3 -c 'import json,sys; print(json.load(sys.stdin)["frames"])' <.stdout)" = 5 ]
    [[ $output != *$'\033'* ]]
    pipe "vg-encode names.tar.gz | vg-decode -q -o out/"
    [ "$(find out -type f -printf x)" = xxxxx ]
    nothing_but names.tar.gz names.zip t.vgs z.vgs out
}

@test "links, devices, pipes and directories in an archive are not followed" {
    hostile links
    must soon vg-encode symbolic.tar.gz -o out.vgs
    must vg-info --json out.vgs
    [ "$(python3 -c 'import json,sys; print(json.load(sys.stdin)["frames"])' <.stdout)" = 1 ]
    must_fail 3 soon vg-encode hard.tar.gz -o no.vgs
    says "'b.obj' in 'hard.tar.gz' is a link"
    must_fail 3 soon vg-encode devices.tar.gz -o no.vgs
    says "devices.tar.gz"
}

@test "archives in archives are not opened" {
    hostile nested
    must_fail 3 soon vg-encode nested.zip -o out.vgs
    says "archive 'nested.zip' holds no mesh file"
    must_fail 3 soon vg-encode nested.obj.gz -o out.vgs
    one_line
}

@test "encrypted members are refused by name" {
    hostile encrypted
    must_fail 3 soon vg-encode encrypted.zip -o out.vgs
    says "encrypted: unpack it first"
    [ ! -e out.vgs ]
}

@test "a member that expands without end stops at --max-bytes" {
    hostile bomb
    [ "$(stat -c %s bomb.obj.gz)" -lt 1000000 ]
    for file in bomb.obj.gz bomb.zip; do
        must_fail 3 soon vg-encode --max-bytes 16M $file -o out.vgs
        says "$file" "unpacks to more than 16777216 bytes" "--max-bytes"
        one_line
    done
    must_fail 3 soon vg-encode --max-bytes 16M between.tar.gz -o out.vgs
    says "'between.tar.gz' unpacks to more than 16777216 bytes"
    must_fail 3 soon vg-encode liar.zip -o out.vgs
    must soon vg-encode --max-bytes 300M between.tar.gz -o out.vgs
    pipe_fail 3 "yes 'v 0 0 0' 2>/dev/null | vg-encode --max-bytes 16M -o no.vgs"
    says "'standard input' holds more than 16777216 bytes"
    pipe_fail 3 "cat bomb.zip | vg-encode --max-bytes 100K -o no.vgs"
    [ ! -e no.vgs ]
    for size in 0 '' x 1X -1 '1 ' '1K '; do must_fail 2 vg-encode --max-bytes "$size" bomb.zip -o no.vgs; done
}

@test "a text that has no end is refused" {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >a.obj
    must_fail 3 soon vg-register --markers /dev/zero a.obj a.obj -o no.vgs
    says "'/dev/zero' holds more than 256 MiB, too much for a text of this kind"
    one_line
    pipe_fail 3 "yes '# nothing' 2>/dev/null | vg-sample --edit - '$GOLDEN/signal.vgs' -o no.vgs"
    says "'-' holds more than 256 MiB"
    [ ! -e no.vgs ]
}

@test "a pipe gives no more than --max-bytes to any reader, however short; arrays that are stored may be longer" {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >a.obj
    pipe_fail 3 "cat a.obj | vg-encode --max-bytes 20 -o no.vgs"
    says "'standard input' holds more than 20 bytes"
    pipe_fail 3 "(echo HIERARCHY; yes) 2>/dev/null | vg-encode --max-bytes 16M -o no.vgs"
    says "'standard input' holds more than 16777216 bytes"
    pipe_fail 3 "(echo '{ \"asset\": '; yes ' ') 2>/dev/null | vg-encode --max-bytes 16M -o no.vgs"
    says "'standard input' holds more than 16777216 bytes"
    must vg-encode a.obj a.obj a.obj -o a.vgs
    must vg-decode a.vgs -o a.npz
    must vg-encode --max-bytes 100 a.npz -o b.vgs
    must vg-diff a.vgs b.vgs
    python3 - <<'END'
import zipfile
with zipfile.ZipFile('a.npz') as a, zipfile.ZipFile('bomb.npz', 'w', zipfile.ZIP_DEFLATED) as b:
    for i in a.infolist():
        data = a.read(i)
        if i.filename == 'positions.npy':
            shape = "'shape': (3, 3, 3), }" + ' ' * 20
            data = data.replace(shape.encode(), b"'shape': (500000, 3, 3), }".ljust(len(shape)))[:128] + bytes(500000 * 36)
        b.writestr(i.filename, data)
END
    must_fail 3 vg-encode --max-bytes 1M bomb.npz -o no.vgs
    says "unpacks to more than 1048576 bytes"
    [ ! -e no.vgs ]
}

@test "a GLB whose attribute claims 100 million elements without bytes: the attribute alone is left out" {
    python3 - <<'END'
import json, struct
def glb(count, name):
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}, {"name": "beside"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "_MASS": 1}}]}], "buffers": [{"byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                      {"componentType": 5126, "count": count, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    with open(name, "wb") as f:
        f.write(b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(data)) + struct.pack("<I4s", len(text), b"JSON") + text +
                struct.pack("<I4s", len(data), b"BIN\0") + data)
glb(3, "few.glb")
glb(100000000, "many.glb")
END
    must vg-encode few.glb -o few.vgs
    must soon vg-encode many.glb -o many.vgs
    must vg-diff few.vgs many.vgs
    [ "$(stat -c %s many.vgs)" -lt "$(stat -c %s few.vgs)" ] && [ "$(stat -c %s many.vgs)" -gt 1000 ]
}

@test "without --max-bytes a file in an archive may hold 1 GiB" {
    [ "${CONFIG:-release}" = release ] || skip "a sanitizer takes too long"
    python3 - <<'END'
import gzip
chunk = b"v 0 0 0\n" * 131072
with gzip.GzipFile("giant.obj.gz", "wb", compresslevel=1) as f:
    for _ in range(1025):
        f.write(chunk)
END
    must_fail 3 bash -c 'ulimit -v 4000000; ulimit -t 100; timeout 1200 vg-encode giant.obj.gz -o out.vgs'
    says "unpacks to more than 1073741824 bytes"
}

@test "millions of entries are refused, none of them a mesh" {
    hostile many
    must_fail 3 soon vg-encode many.tar.gz -o out.vgs
    says "'many.tar.gz' holds more than 2097152 files"
}

@test "small files that ask for much: a million properties, nodes times targets, channels times keys" {
    hostile crowds
    for file in properties.ply primitives.gltf joints.gltf pile.gltf; do
        must soon vg-encode $file -o $file.vgs
    done
    must soon vg-encode --mesh bones.skeleton.txt bones.joints.txt -o bones.vgs
    for file in targets clips channels; do
        must_fail 3 soon vg-encode $file.gltf -o no.vgs
        says "'$file.gltf': it" " more than "
    done
    [ ! -e no.vgs ]
}

# ---- geometry ---------------------------------------------------------------------------------------------------------

# there_and_back KIND: vectors, solved, are the poses again
there_and_back() {
    must vg-encode "$1"-[123].obj -o "$1.vgs"
    for faces in all selected; do
        must soon vg-encode --vectors --faces $faces "$1"-[123].obj -o vectors.vgs
        must soon vg-solve vectors.vgs -o again.vgs
        must vg-diff -t 1e-7 "$1.vgs" again.vgs
    done
}

# every_program KIND: whatever it is asked for
every_program() {
    local k=$1 by
    answers vg-encode "$k"-[123].obj -o "$k.vgs" && [ "$status" = 0 ] || return 1
    answers vg-encode --vectors "$k.vgs" -o v.vgs || return 1
    answers vg-solve v.vgs -o s.vgs || return 1
    answers vg-solve --weights area --planar v.vgs -o s.vgs || return 1
    answers vg-deform "$k.vgs" -o d.vgs || return 1
    for by in pose gradient blend offset shape; do
        answers vg-deform --onto "$k-target.obj" --by $by "$k.vgs" -o d.vgs || return 1
        if [ "$status" = 0 ]; then answers vg-solve d.vgs -o s.vgs || return 1; fi
    done
    answers vg-interpolate --at -1,0.5,2.5 --smooth "$k.vgs" -o i.vgs || return 1
    if [ "$status" = 0 ]; then answers vg-solve i.vgs -o s.vgs || return 1; fi
    answers vg-poisson --first "$k-target.obj" "$k.vgs" -o p.vgs || return 1
    for filter in lowpass polynomial robust; do answers vg-smooth --filter $filter --frames 2 "$k.vgs" -o sm.vgs || return 1; done
    answers vg-encode "$k"-[123].obj "$k"-[123].obj "$k"-[123].obj -o nine.vgs || return 1
    if [ "$status" = 0 ]; then answers vg-smooth --filter together nine.vgs -o sm.vgs || return 1; fi
    answers vg-segment -k 2 "$k.vgs" -o seg.vgs || return 1
    if [ "$status" = 0 ] && [ "$2" != no-map ]; then
        answers vg-fitmap -q --patches seg.vgs "$k.vgs" -o map.vgs || return 1
        if [ "$status" = 0 ]; then answers vg-play map.vgs --interpolate 4 "$k.vgs" -o m.vgs || return 1; fi
    fi
    printf '0 0\n1 1\n2 2\n' >markers.txt
    [ "$3" = no-pairs ] || answers vg-register -q "$k-1.obj" "$k-target.obj" --markers markers.txt -o c.vgs || return 1
    if [ "$status" = 0 ] && [ -f c.vgs ]; then
        answers vg-deform --onto "$k-target.obj" --correspondence c.vgs "$k.vgs" -o d.vgs || return 1
    fi
    answers vg-register -q --bind "$k-1.obj" "$k-target.obj" -o bound.vgs || return 1
    if [ "$status" = 0 ]; then answers vg-deform --onto "$k-target.obj" --correspondence bound.vgs "$k.vgs" -o d.vgs || return 1; fi
    answers vg-encode --mirror x "$k.vgs" -o mirrored.vgs || return 1
    answers vg-diff --surface --frames "$k.vgs" "$k-target.obj" || return 1
    answers vg-diff "$k.vgs" s.vgs || return 1
    answers vg-diff --json "$k.vgs" s.vgs || return 1
    answers vg-info "$k.vgs" || return 1
    answers vg-view "$k.vgs" -o a.png || return 1
    answers vg-view "$k.vgs" -o a.html || return 1
    answers vg-decode -q --replace "$k.vgs" -o 'a-%d.stl' || return 1
    for out in a.zip:ply a.glb a.usda; do answers vg-decode -q "$k.vgs" -o $out || return 1; done
    answers vg-decode -q --no-mesh "$k.vgs" -o a.pc2 || return 1
}

@test "edges with three faces, faces there twice, flipped faces, duplicate vertices" {
    hostile nonmanifold flipped duplicates
    for kind in nonmanifold flipped duplicates; do
        there_and_back $kind
        every_program $kind
    done
}

@test "faces without area, vertices without a face, all vertices at one place" {
    hostile zeroarea isolated onepoint
    there_and_back zeroarea
    for kind in zeroarea isolated onepoint; do every_program $kind; done
}

@test "one face, no face" {
    hostile oneface noface
    there_and_back oneface
    for kind in oneface noface; do every_program $kind; done
}

@test "lengths of 1e-20 and 1e20, a small thing far away" {
    hostile tiny huge far
    for kind in tiny huge; do
        there_and_back $kind
        must vg-diff -t 1e-7 $kind.vgs $kind.vgs
    done
    for kind in tiny huge far; do every_program $kind; done
}

@test "what is transferred at 1e-20 and 1e20 is what is transferred at 1" {
    hostile tiny huge
    for i in 1 2 3; do awk '/^v/ { printf "v %.17g %.17g %.17g\n", $2 / 1e20, $3 / 1e20, $4 / 1e20; next } { print }' huge-$i.obj >one-$i.obj; done
    awk '/^v/ { printf "v %.17g %.17g %.17g\n", $2 / 1e20, $3 / 1e20, $4 / 1e20; next } { print }' huge-target.obj >one-target.obj
    for kind in tiny huge one; do
        pipe "vg-encode $kind-[123].obj | vg-deform --onto $kind-target.obj | vg-solve --fit squares -o $kind.vgs" # the other fit ends by a tolerance
    done
    py <<'END'
import read_stream
one, tiny, huge = (read_stream.read_stream(k + ".vgs").frames for k in ("one", "tiny", "huge"))
for a, b, c in zip(one, tiny, huge):
    for x, y, z in zip(a.values, b.values, c.values):
        assert abs(x - y * 1e20) < 1e-9 and abs(x - z / 1e20) < 1e-9, (a.name, x, y, z)
END
}

@test "lengths whose squares are no numbers: refused, or finite" {
    hostile beyond
    every_program beyond
    every_program beneath
}

@test "100,000 components" {
    hostile islands=100000
    there_and_back islands
    every_program islands no-map no-pairs # a map's memory is components times vertices; pairs take a minute
    hostile islands=10000
    must vg-encode islands-[123].obj -o islands.vgs
    must soon vg-register -q islands-1.obj islands-target.obj --markers markers.txt -o c.vgs
    must_warn soon vg-register islands-1.obj islands-target.obj --markers markers.txt -o c.vgs
    [ "$(wc -l <.stderr)" -lt 20 ] # not a warning for each component
}

@test "a face of 10,000 corners" {
    hostile polygon
    there_and_back polygon
    every_program polygon
}

# ---- what is well formed, and makes no sense -----------------------------------------------------------------------

# scale FACTOR FILE: an OBJ, larger
scale() {
    awk -v s="$1" '/^v/ { printf "v %.17g %.17g %.17g\n", $2 * s, $3 * s, $4 * s; next } { print }' "$2"
}

# no_output STATUS COMMAND...: refused with one line, and no file called out.*
no_output() {
    must_fail "$@"
    one_line
    [ -z "$(find . -name '*out.*')" ] || fail "'${*:2}' left a file"
}

@test "a body whose size no number holds is refused by vg-retarget" {
    poses cube 3
    must vg-encode pose*.obj -o cube.vgs
    must vg-segment -k 2 cube.vgs -o patches.vgs
    must vg-fitmap -q --patches patches.vgs cube.vgs -o cube.map
    for size in 1e300 1e155 1e-300 1e-310; do
        scale $size pose2.obj >body.obj
        no_output 3 vg-retarget --onto body.obj cube.map -o out.map
    done
    no_output 3 vg-retarget --onto pose2.obj --morph 1e308 cube.map -o out.map
}

@test "a map or a rig does not stay with a mesh that it is no longer true of" {
    for map in map rig; do
        must vg-encode --reference "$GOLDEN/$map.vgs" "$GOLDEN/$map.vgs" -o reference.vgs
        must vg-encode --vectors --faces selected "$GOLDEN/$map.vgs" -o selected.vgs
        for file in reference.vgs selected.vgs; do must vg-info --check $file; done
        py <<'END'
import read_stream
a, b = map(read_stream.read_stream, ("reference.vgs", "selected.vgs"))
assert a.map is None and a.rig is None and b.map is None
END
    done
}

@test "joints of patches that are missed by more than any length: they count for nothing" {
    poses cube 3
    pipe "vg-encode pose*.obj | vg-segment -k 2 -o patches.vgs"
    for size in 1e-100 1e-150 1e-160 1e-200; do
        scale $size pose1.obj >reference.obj
        must vg-encode --reference reference.obj pose*.obj -o poses.vgs
        answers vg-fitmap -q --patches patches.vgs poses.vgs -o map.vgs
    done
}

@test "errors and scales that no colour shows: a page of finite numbers, or a refusal" {
    poses cube 2
    scale 1e100 pose2.obj >large.obj
    must vg-view --against pose1.obj large.obj -o large.html
    grep -q '"means":\[[0-9.e+]*\]' large.html
    scale 1e200 pose2.obj >huge.obj
    scale 1e-200 pose1.obj >tiny.obj
    must vg-encode --reference tiny.obj pose1.obj -o truth.vgs
    no_output 3 vg-view --against truth.vgs huge.obj -o out.html
    must vg-encode --reference tiny.obj huge.obj -o scales.vgs
    answers vg-view --scales scales.vgs -o scales.html
    [ "$(grep -cE '[[,:]-?(inf|nan)' scales.html)" = 0 ]
}

@test "a pose between two that are too far apart is refused as input, one too far outside as usage" {
    poses cube 2
    scale 1.7e307 pose2.obj >huge.obj
    must vg-encode pose1.obj huge.obj -o keys.vgs
    no_output 3 vg-interpolate --at 0.25 keys.vgs -o out.vgs
    says "too far apart"
    no_output 2 vg-interpolate --at -1 keys.vgs -o out.vgs
}

@test "one vertex in 60,000 faces: drawn in time that does not grow with its square" {
    [ "${CONFIG:-release}" = release ] || skip "a sanitizer takes too long"
    awk 'BEGIN {
        n = 60000
        print "v 0 0 1"
        for (i = 0; i < n; i++) printf "v %.9f %.9f 0\n", cos(6.2831853 * i / n), sin(6.2831853 * i / n)
        for (i = 0; i < n; i++) print "f", 1, 2 + i, 2 + (i + 1) % n
    }' >fan.obj
    must bash -c 'ulimit -t 5; exec vg-view -j 1 --size 100x100 fan.obj -o fan.png'
}
