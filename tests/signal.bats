#!/usr/bin/env bats
# vg-fitsignal and vg-sample: the tolerance, options, times, edits, curves, and what is refused.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC2086 # lists of numbers in variables are words
load lib.bash
bats_require_minimum_version 1.5.0

setup_file() {
    cd "$BATS_FILE_TMPDIR" || return 1
    vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o horse.vgs
    vg-encode --fps 25 --reference "$DATA/trex.rest.obj" "$DATA/trex-walk.tar.xz" -o trex.vgs
    vg-fitsignal -q horse.vgs -o horse.signal
    vg-fitsignal -q trex.vgs -o trex.signal
}

horse() { echo "$BATS_FILE_TMPDIR/horse.$1"; }
trex() { echo "$BATS_FILE_TMPDIR/trex.$1"; }

# value KEY: of the report in JSON in $output
value() { printf '%s' "$output" | python3 -c "import json, sys; print(json.load(sys.stdin)['$1'])"; }
# within A B TOL: numbers
within() { python3 -c "import sys; a, b, t = map(float, sys.argv[1:]); sys.exit(not abs(a - b) <= t)" "$@"; }
# with_rest REST POSES: the rest pose becomes the first of the poses
with_rest() {
    mkdir -p rest && rm -f rest/*
    cp "$1" rest/0.obj
    must vg-decode -q "$2" -o 'rest/1%03d.obj'
    must vg-encode rest/*.obj -o "$2"
}
# positions FILE: the poses as text, to be compared to the last bit
positions() {
    py "$1" <<'END'
import sys
from read_stream import read_stream
for f in read_stream(sys.argv[1]).frames:
    print(f.name, [x.hex() for x in f.values])
END
    printf '%s\n' "$output"
}

# k, l, m within 2 of those of the prototype (doc/MATH.md, section 11)
fits_like() {
    local signal=$1 tolerance=$2 k=$3 l=$4 m=$5
    must vg-fitsignal -q --report - --json --tolerance "$tolerance" "$signal" -o out.signal
    if ! within "$(value control_points)" "$k" 2 || ! within "$(value sites)" "$l" 2 || ! within "$(value coordinates)" "$m" 2; then
        fail "$output"
    fi
    python3 -c "import sys; sys.exit(not $(value error) <= $tolerance)" || fail "$output"
}

@test "control points, sites and coordinates are few, and the tolerance is kept" {
    fits_like "$(horse vgs)" 1e-2 13 13 11
    fits_like "$(horse vgs)" 5e-3 15 19 12
    fits_like "$(horse vgs)" 1e-3 21 20 18
    fits_like "$(trex vgs)" 1e-2 10 14 8
    fits_like "$(trex vgs)" 5e-3 13 16 11
    fits_like "$(trex vgs)" 1e-3 24 30 16
    vg-sample out.signal | vg-diff -t 1e-3 "$(trex vgs)" -
}

# doc/MATH.md, section 11, the table of fidelity: frames, and k l m at 1e-2, 5e-3 and 1e-3
@test "control points, sites and coordinates on the kit are those of the table (needs VG_DATA, the data kit)" {
    [ -d "${VG_DATA:-}/human" ] || skip "VG_DATA does not name the data kit"
    while read -r sequence rest coarse middle fine; do
        vg-encode ${rest:+--reference "$VG_DATA/${sequence%/*}/$rest"} "$VG_DATA/$sequence.tar.gz" -o poses.vgs
        fits_like poses.vgs 1e-2 ${coarse//,/ }
        fits_like poses.vgs 5e-3 ${middle//,/ }
        fits_like poses.vgs 1e-3 ${fine//,/ }
    done <<'END'
hybrid/horse-run horse.rest.obj 13,13,11 15,19,12 21,20,18
hybrid/cow-run cow.rest.obj 16,21,13 19,28,17 26,32,25
hybrid/trex-walk trex.rest.obj 10,14,8 13,16,11 24,30,16
hybrid/velociraptor-walk velociraptor.rest.obj 10,15,8 12,19,9 27,25,17
human/walk-man walk-man.rest.obj 28,52,16 35,71,20 57,86,41
human/dance-man dance-man.rest.obj 105,208,61 134,237,90 233,293,115
END
    vg-encode "$VG_DATA/cloth/cloth-drop.tar.gz" -o poses.vgs
    fits_like poses.vgs 1e-2 18 22 19
    fits_like poses.vgs 5e-3 17 35 28
    fits_like poses.vgs 1e-3 26 53 54
}

@test "with as many of everything as there can be, frames come back; twice the same bytes with any threads" {
    must vg-fitsignal -q -m 1000 -l 1000 -k 1002 -j 1 --no-provenance "$(trex vgs)" -o one.signal
    must vg-fitsignal -q -m 1000 -l 1000 -k 1002 -j 3 --no-provenance "$(trex vgs)" -o three.signal
    must cmp one.signal three.signal
    vg-sample one.signal | vg-diff -t 1e-9 "$(trex vgs)" -
}

@test "--basis: bytes and errors" {
    must vg-fitsignal -q -m 1000 -l 1000 -k 1002 --no-provenance "$(trex vgs)" -o double.signal
    must vg-fitsignal -q -m 1000 -l 1000 -k 1002 --no-provenance --basis single "$(trex vgs)" -o single.signal
    must vg-fitsignal -q -m 1000 -l 1000 -k 1002 --no-provenance --basis int16 "$(trex vgs)" -o short.signal
    vg-sample single.signal | vg-diff -t 1e-6 "$(trex vgs)" -
    vg-sample short.signal | vg-diff -t 2e-5 "$(trex vgs)" -
    [ "$(stat -c %s single.signal)" -lt "$(stat -c %s double.signal)" ]
    [ "$(stat -c %s short.signal)" -lt "$(stat -c %s single.signal)" ]
    for s in double single short; do must vg-info --check $s.signal; done
}

@test "--root none keeps the body's motion in the shapes" {
    must vg-fitsignal -q --root none -m 1000 -l 1000 -k 1002 "$(trex vgs)" -o none.signal
    vg-sample none.signal | vg-diff -t 1e-9 "$(trex vgs)" -
}

@test "--space: frames come back through vg-solve, and errors are those of its vertices" {
    for space in vectors gradients rotations lengths; do
        must vg-fitsignal -q --space $space -m 1000 -l 1000 -k 1002 --no-provenance -j 1 "$(horse vgs)" -o full.signal
        vg-sample full.signal | vg-solve | vg-diff -t 1e-9 "$(horse vgs)" - || fail "$space"
        must vg-info --check full.signal
        must vg-info --json full.signal
        [[ $output == *"\"space\": \"$space\""* ]] || fail "$output"
        must vg-fitsignal -q --space $space --report fit.json --json "$(horse vgs)" -o some.signal
        vg-sample some.signal | vg-solve --fit squares -o back.vgs
        vg-diff --json "$(horse vgs)" back.vgs >diff.json
        python3 -c "
import json
r, d = json.load(open('fit.json')), json.load(open('diff.json'))
assert r['space'] == '$space' and r['jumps'] == 0 and r['error'] <= 1e-2, r
assert abs(r['error'] - d['vertex_error']['max']['D']) < 1e-9, (r['error'], d)" || fail "$space"
    done
    must vg-fitsignal -q --space gradients -m 1000 -l 1000 -k 1002 --no-provenance -j 1 "$(horse vgs)" -o one.signal
    must vg-fitsignal -q --space gradients -m 1000 -l 1000 -k 1002 --no-provenance -j 3 "$(horse vgs)" -o three.signal
    must cmp one.signal three.signal
    must vg-fitsignal -q --space gradients --root none -m 1000 -l 1000 -k 1002 "$(trex vgs)" -o none.signal
    vg-sample none.signal | vg-solve | vg-diff -t 1e-9 "$(trex vgs)" -
    must vg-fitsignal -q --space lengths --basis int16 -m 1000 -l 1000 -k 1002 "$(trex vgs)" -o short.signal
    vg-sample short.signal | vg-solve --weights uniform | vg-diff -t 1e-3 "$(trex vgs)" -
    vg-sample short.signal | vg-solve | vg-diff --json "$(trex vgs)" - >diff.json
    # rounded numbers of 16 bits: the noise of one toe varies with the weights of thin faces, the mean does not
    python3 -c "import json; e = json.load(open('diff.json'))['vertex_error']; assert 1e-6 < e['mean']['D'] < 1e-4, e"
}

# hinge SUFFIX ANGLE: two quads, the second one turned about the edge that they share, in degrees
hinge() {
    python3 - "$@" <<'END'
import math, sys
c, s = (f(math.radians(float(sys.argv[2]))) for f in (math.cos, math.sin))
with open(f"hinge{sys.argv[1]}.obj", "w") as f:
    for x in (-1, 0, 1):
        for y in (0, 1): print("v", *((x, y, 0) if x <= 0 else (x * c, y, x * s)), file=f)
    print("f 1 3 4 2\nf 3 5 6 4", file=f)
END
}

@test "--space: between poses that turn limbs keep their lengths; what goes with vertices alone is refused" {
    hinge 0 0 && hinge 1 80 && hinge 2 160
    vg-encode hinge0.obj hinge1.obj hinge2.obj -o hinge.vgs
    for space in vectors gradients rotations lengths; do
        must vg-fitsignal -q --root none --space $space -m 1000 -l 1000 -k 1002 hinge.vgs -o hinge.signal
        vg-sample --at 1.5 hinge.signal | vg-solve | vg-decode -o half.obj
        python3 -c "
import math
v = [list(map(float, l.split()[1:])) for l in open('half.obj') if l.startswith('v ')]
for a, b in ((0, 2), (2, 4), (4, 5)): assert abs(math.dist(v[a], v[b]) - 1) < 1e-6, v" || fail "$space"
    done
    must vg-fitsignal -q --root none -m 1000 -l 1000 -k 1002 hinge.vgs -o straight.signal
    vg-sample --at 1.5 straight.signal | vg-decode -o half.obj
    python3 -c "
import math
v = [list(map(float, l.split()[1:])) for l in open('half.obj') if l.startswith('v ')]
assert math.dist(v[2], v[4]) < 0.9, v"
    printf '0 0\n0.5 0\n' >line.txt
    pipe "vg-sample --curve line.txt --frames 3 hinge.signal | vg-solve -o line.vgs"
    must_fail 2 vg-fitsignal --space gradients --examples hinge.vgs hinge.vgs -o out.vgs
    must_fail 3 vg-sample --onto hinge.vgs hinge.signal -o out.vgs
    must_fail 3 vg-view hinge.signal -o out.html
    says "a page shows signals whose shapes are vertices"
    must vg-view hinge.signal -o plane.png
    printf 'v 0 0 0\nv 1 0 0\n' >points.obj
    must_fail 3 vg-fitsignal --space gradients points.obj points.obj -o out.vgs
    says "the mesh has no faces: its shape space can only be vertices"
    [ ! -e out.vgs ]
}

@test "--pin is met exactly, --place is taken as it is" {
    must vg-fitsignal -q --report - --json --pin 3=0.5,-0.25 --pin 10=-1,1 "$(horse vgs)" -o pinned.signal
    printf '%s' "$output" | python3 -c "
import json, sys
f = json.load(sys.stdin)['frame_errors']
assert (f[2]['x'], f[2]['y'], f[9]['x'], f[9]['y']) == (0.5, -0.25, -1, 1), f"
    for i in $(seq 21); do echo "$((i % 5)) $((i * i % 7)) # frame $i"; done >places.txt
    must vg-fitsignal -q --report - --json --place places.txt "$(horse vgs)" -o placed.signal
    printf '%s' "$output" | python3 -c "
import json, sys
f = json.load(sys.stdin)['frame_errors']
assert [(a['x'], a['y']) for a in f] == [(i % 5, i * i % 7) for i in range(1, 22)], f"
    must vg-info --positions placed.signal
    echo "$output" | tac >again.txt # in any order
    must vg-fitsignal -q --place again.txt "$(horse vgs)" -o again.signal
    [ "$(vg-info --positions again.signal)" = "$(vg-info --positions placed.signal)" ]
    for line in 'frame 2 0 0' 'frame 22 0 0' 'frame 1.5 0 0' 'frame 1 0'; do
        { echo 'frame 2 1 1' && echo "$line"; } >bad.txt
        run -3 vg-fitsignal --place bad.txt "$(horse vgs)" -o out.signal
        [[ $output == *"'bad.txt' line 2: "* ]]
    done
    head -20 places.txt >short.txt
    run -3 vg-fitsignal --place short.txt "$(horse vgs)" -o out.signal
    [[ $output == *"'short.txt' places 20 frames of 21"* ]]
    (cat places.txt && echo 1 2) >long.txt
    run -3 vg-fitsignal --place long.txt "$(horse vgs)" -o out.signal
    [[ $output == *"'long.txt' line 22: there are only 21 frames to place"* ]]
    echo '1 x' >bad.txt
    run -3 vg-fitsignal --place bad.txt "$(horse vgs)" -o out.signal
    [[ $output == *"'bad.txt' line 1: two numbers expected"* ]]
}

@test "--layout, --sites; what does not exist is said" {
    for layout in plain ring ring=2 time time=1.5 auto; do
        must vg-fitsignal -q --report - --json --layout $layout "$(trex vgs)" -o out.signal
        [ $layout = auto ] || [ "$(value layout)" = "${layout%=*}" ]
    done
    must vg-fitsignal -q --sites gain "$(trex vgs)" -o out.signal
    vg-sample out.signal | vg-diff -t 1e-2 "$(trex vgs)" -
    for layout in round ring=0 ring=x plain=2 time=; do
        must_fail 2 vg-fitsignal --layout "$layout" "$(trex vgs)" -o out.vgs
    done
    must_fail 2 vg-fitsignal --pin 3=1 "$(trex vgs)" -o out.vgs
    must_fail 2 vg-fitsignal --pin 0=1,1 "$(trex vgs)" -o out.vgs
    must_fail 2 vg-fitsignal --pin 99=1,1 "$(trex vgs)" -o out.vgs
    says 'there is no frame 99'
    must_fail 3 vg-fitsignal "$DATA/horse.rest.obj" -o out.vgs
    says 'a signal needs at least 2 frames, but there is 1'
    must_fail 3 vg-sample "$(horse vgs)" -o out.vgs
    says 'the input holds no signal: make one with vg-fitsignal'
    [ ! -e out.vgs ]
}

@test "--pick names the frames that tell the others" {
    must vg-fitsignal --pick 3 --json "$(trex vgs)"
    printf '%s' "$output" | python3 -c "
import json, sys
f = json.load(sys.stdin)['frames']
left = [a['left'] for a in f]
assert len({a['frame'] for a in f}) == 3 and 1 > left[0] > left[1] > left[2] > 0, f"
    vg-encode --take "$(value take)" "$(trex vgs)" -o picked.vgs # the list is what --take takes; its frames are those named
    names=$(printf '%s' "$output" | python3 -c "
import json, sys
print(*sorted(f['name'] for f in json.load(sys.stdin)['frames']))")
    py picked.vgs <<'END'
import sys
from read_stream import read_stream
print(*[f.name for f in read_stream(sys.argv[1]).frames])
END
    [ "$output" = "$names" ] || fail "$output is not $names"
    must_fail 2 vg-fitsignal --pick 99 "$(trex vgs)"
}

@test "times: at, frames, speed, fps, and the names and times that come of them" {
    must vg-sample "$(trex signal)" -o all.vgs
    must vg-sample --at 1:34:0.25 "$(trex signal)" -o quarters.vgs
    positions all.vgs >all.txt
    positions quarters.vgs | awk 'NR % 4 == 1' >whole.txt
    must cmp all.txt whole.txt # resampling at the same times changes nothing, in whatever company
    must vg-sample --frames 34 "$(trex signal)" -o frames.vgs
    positions frames.vgs | cmp - all.txt
    must vg-sample --speed 0.25 "$(trex signal)" -o slow.vgs
    positions slow.vgs | cmp - <(positions quarters.vgs)
    must vg-sample --fps 50 "$(trex signal)" -o fast.vgs
    py <<'END'
from read_stream import read_stream
f, s, a = (read_stream(n + ".vgs").frames for n in ("fast", "slow", "all"))
assert len(f) == 67 and len(s) == 133 and len(a) == 34
assert abs(f[1].time - f[0].time - 0.02) < 1e-12 and abs(s[1].time - s[0].time - 0.04) < 1e-12
assert f[1].name == f[0].name + "+0.5" and f[2].name == a[1].name, (f[1].name, f[2].name)
END
    for at in 0 35 0.5:3:1 x 1:2:0 2:1:1 1:2:1:3 ''; do
        must_fail 2 vg-sample --at "$at" "$(trex signal)" -o out.vgs
    done
    must_fail 3 vg-sample --fps 30 "$(horse signal)" -o out.vgs
    says "the signal's frames have no times"
}

@test "--retime goes through its lines and never back" {
    printf '1 1\n5 20 # slow\n34 40\n' >times.txt
    must vg-sample --retime times.txt "$(trex signal)" -o out.vgs
    must vg-sample "$(trex signal)" -o all.vgs
    py <<'END'
from read_stream import read_stream
def place(f):
    name, _, rest = f.name.partition("+")
    return names.index(name) + float(rest or 0)
a, r = read_stream("all.vgs").frames, read_stream("out.vgs").frames
names = [f.name for f in a]
assert len(r) == 40
places = [place(f) for f in r]
assert places == sorted(places) and abs(places[19] - 4) < 1e-5 and places[0] == 0 and places[39] == 33, places
assert r[19].values == a[4].values
END
    printf '1 1\n5 0\n' >back.txt
    must_fail 3 vg-sample --retime back.txt "$(trex signal)" -o out2.vgs
    says "'back.txt' line 2: time 5 at new time 0"
    printf '1 1\n50 9\n' >beyond.txt
    must_fail 3 vg-sample --retime beyond.txt "$(trex signal)" -o out2.vgs
    says "'beyond.txt' line 2: time 50 is not in the sequence"
    printf '1 1\n' >one.txt
    must_fail 3 vg-sample --retime one.txt "$(trex signal)" -o out2.vgs
}

@test "an edited control point changes the frames around it and no bit of the others" {
    must vg-sample "$(trex signal)" -o all.vgs
    echo 'control 5 2 -1' >edits.txt
    must vg-sample --edit edits.txt "$(trex signal)" -o edited.vgs
    positions all.vgs >a.txt
    positions edited.vgs >b.txt
    changed=$(diff a.txt b.txt | grep -c '^>')
    [ "$changed" -gt 2 ] && [ "$changed" -lt 30 ] || fail "$changed frames are others"
    printf 'insert 7.5\ninsert 20 # and one more\n\n' >more.txt
    must vg-sample --edit more.txt "$(trex signal)" -o more.vgs
    vg-diff -t 1e-12 all.vgs more.vgs
    printf 'time 1 1\ntime 34 67\n' >slow.txt
    must vg-sample --edit slow.txt "$(trex signal)" -o slow.vgs
    must vg-sample --speed 0.5 "$(trex signal)" -o half.vgs
    vg-diff -t 1e-12 slow.vgs half.vgs
    for edit in 'frame 3 0.1 0.2' 'site 3' 'site -3' 'remove 4'; do
        echo "$edit" >one.txt
        capture vg-sample --edit one.txt "$(trex signal)" -o one.vgs
        if [ "$status" = 3 ]; then says "frame 3 is not a site"; else [ "$status" = 0 ]; fi
    done
}

@test "every line of an edit that says nothing is named" {
    for line in 'control 5' 'control 99 1 1' 'control 0 1 1' 'control 1.5 1 1' 'control 1 1 1 1' 'control 1 nan 1' 'control 1 1e999 1' 'control 0x1 1 1' \
        'move 1 1 1' 'insert 1' 'insert 34' 'insert' 'remove 1' 'remove 2' 'remove 10' 'frame 99 1 1' 'frame 1 x 1' 'site 0' 'site 99' \
        'time 0 1' 'time 1' $'control 1 1\x01 1'; do
        printf '# a comment\n%s\n' "$line" >edits.txt
        must_fail 3 vg-sample --edit edits.txt "$(trex signal)" -o out.vgs
        says "'edits.txt' line 2: "
    done
    printf 'time 2 1\ntime 1 2\n' >edits.txt
    must_fail 3 vg-sample --edit edits.txt "$(trex signal)" -o out.vgs
    printf 'time 2 1\n' >edits.txt
    must_fail 3 vg-sample --edit edits.txt "$(trex signal)" -o out.vgs
    [ ! -e out.vgs ]
    # the points of a curve are no edits: the message says where they belong
    must vg-info --curve "$(trex signal)"
    printf '%s\n' "$output" >points.txt
    must_fail 3 vg-sample --edit points.txt "$(trex signal)" -o out.vgs
    says "points.txt' line 2: an edit begins with control" "for 'vg-sample --curve'"
}

@test "names with quotes, tabs, line ends and letters of other languages go through edits and retimings" {
    python3 - <<'END'
for i, name in enumerate(('a "quoted" one', "tab\there", "<b>größe 日本語", "new\nline", "%s back\\slash & <i>", "$(id)")):
    with open(f"{i}{name}.obj", "w") as f:
        for v in range(4):
            f.write(f"v {(v & 1) + i * i / 10} {(v >> 1) - i / 7} {v * i / 5}\n")
        f.write("f 1 2 4 3\n")
END
    must vg-encode ./*.obj -o poses.vgs
    must vg-fitsignal -q poses.vgs -o hostile.signal
    printf 'control 2 0.3 0.4\nframe 3 0.1 0.2\ntime 1 1\ntime 6 11\n' >edits.txt
    printf '1 1\n6 11\n' >retime.txt
    must vg-sample --edit edits.txt hostile.signal -o edited.vgs
    must vg-sample --retime retime.txt hostile.signal -o slow.vgs
    py <<'END'
from read_stream import read_stream
names = [f.name for f in read_stream("poses.vgs").frames]
assert names[1] == "1tab\there" and names[3] == "3new\nline" and names[2].endswith("größe 日本語"), names
for file in ("edited.vgs", "slow.vgs"):
    seen = [f.name for f in read_stream(file).frames]
    assert len(seen) == 11 and seen[::2] == names, seen
    assert all(s.startswith(n + "+") for s, n in zip(seen[1::2], names)), seen
END
}

@test "--curve: through places of frames their shapes come; control points of a line give a line" {
    must vg-fitsignal -q --report - --json --root none -m 1000 -l 1000 -k 1002 "$(trex vgs)" -o full.signal
    printf '%s' "$output" | python3 -c "
import json, sys
for a in json.load(sys.stdin)['frame_errors'][2:9]: print(repr(a['x']), repr(a['y']))" >sketch.txt
    must vg-sample --curve sketch.txt --frames 2 full.signal -o ends.vgs
    vg-sample --at 3,9 full.signal | vg-diff -t 1e-9 - ends.vgs
    printf 'control %s\n' '-1 0' '0 0' '1 0' '2 0' >line.txt
    must vg-sample --curve line.txt --frames 3 full.signal -o line.vgs
    printf '0 0\n0.5 0\n1 0\n' >points.txt
    must vg-sample --curve points.txt --frames 3 full.signal -o points.vgs
    vg-diff -t 1e-12 line.vgs points.vgs
    printf 'control 1 1\n2 2\n' >mixed.txt
    must_fail 3 vg-sample --curve mixed.txt full.signal -o out.vgs
    says "'mixed.txt' line 2: control points and points that the curve goes through are mixed"
    printf '1 1\n' >short.txt
    must_fail 3 vg-sample --curve short.txt full.signal -o out.vgs
    says 'a curve needs at least 2 points'
}

@test "vg-info: the numbers of a signal, and its places as an edit that changes nothing" {
    must vg-info --json "$(trex signal)"
    printf '%s' "$output" | python3 -c "
import json, sys
s = json.load(sys.stdin)['signal']
assert (s['frames'], s['dimension'], s['basis_bits'], s['rooted'], s['layout']) == (34, 3 * 912, 64, True, 'plain'), s
assert 0 < s['error_shape'] <= 0.7e-2 and 0 < s['error'] <= 1e-2 and s['compression'] > 3, s"
    must vg-info --positions "$(trex signal)" -o all.txt
    must vg-sample --no-provenance "$(trex signal)" -o as-it-is.vgs
    must vg-sample --no-provenance --edit all.txt "$(trex signal)" -o edited.vgs
    must cmp as-it-is.vgs edited.vgs
    must_fail 3 vg-info --positions "$(trex vgs)"
    must_fail 3 vg-info --curve "$(trex vgs)"
    must_fail 2 vg-info --curve --positions "$(trex signal)"
    must vg-info --curve "$(trex signal)" -o curve.txt
    [ "$(grep -c '^[-0-9]' curve.txt)" = $((33 * 4 + 1)) ] || fail "$(head -3 curve.txt)"
    must vg-sample --curve curve.txt --frames 2 "$(trex signal)" -o ends.vgs # from its first to its last point
    must vg-fitsignal -q --root none "$(trex vgs)" -o still.signal
    must vg-sample --at 1,34 still.signal -o wanted.vgs
    must vg-info --curve still.signal -o curve.txt
    must vg-sample --curve curve.txt --frames 2 still.signal -o ends.vgs
    vg-diff -t 1e-12 wanted.vgs ends.vgs
}

# held_out SEQUENCE [REFERENCE]: fitted to every other frame with as many of everything as there can be: the root mean squared
# error of the frames between beside that of natural cubic splines through the vertices
held_out() {
    vg-encode ${2:+--reference "$2"} "$1" -o all.vgs
    vg-encode --take 0-/2 all.vgs -o even.vgs
    vg-fitsignal -q -m 1000 -l 1000 -k 1002 even.vgs -o even.signal
    vg-sample --at "1.5:$(vg-info --json even.vgs | python3 -c 'import json, sys; print(json.load(sys.stdin)["frames"])'):1" even.signal -o odd.vgs
    py <<'END'
from read_stream import read_stream
a, even, odd = ([f.values for f in read_stream(n + ".vgs").frames] for n in ("all", "even", "odd"))
n, truth = len(even), a[1::2][:len(even) - 1]
assert len(odd) == n - 1
c = [0] * n # second derivatives: m[i - 1] + 4 m[i] + m[i + 1] = 6 (y[i - 1] - 2 y[i] + y[i + 1]), 0 at the ends
for i in range(1, n - 1): c[i] = 1 / (4 - c[i - 1])
def sums(k):
    m = [0] * n
    for i in range(1, n - 1): m[i] = (6 * (even[i - 1][k] - 2 * even[i][k] + even[i + 1][k]) - m[i - 1]) * c[i]
    for i in range(n - 2, 0, -1): m[i] -= c[i] * m[i + 1]
    spline = sum(((even[i][k] + even[i + 1][k]) / 2 - (m[i] + m[i + 1]) / 16 - truth[i][k]) ** 2 for i in range(n - 1))
    return spline, sum((odd[i][k] - truth[i][k]) ** 2 for i in range(n - 1))
s = [sums(k) for k in range(len(truth[0]))]
print((sum(b for _, b in s) / sum(a for a, _ in s)) ** 0.5)
END
    [ "$status" = 0 ] || fail "$output"
}

@test "between frames a signal misses by at most 1.75 times what a cubic spline misses" {
    held_out "$(horse vgs)"
    below "$output" 1.05
    held_out "$(trex vgs)"
    below "$output" 1.05
    held_out "$DATA/trex-attack.tar.xz" "$DATA/trex.rest.obj"
    below "$output" 1.05
}

@test "between frames, on all sequences of the kit but woman-tanktop-jump (needs VG_DATA, the data kit)" {
    [ -d "${VG_DATA:-}/human" ] || skip "VG_DATA does not name the data kit"
    for sequence in hybrid/{cow-run,trex-run,velociraptor-walk,velociraptor-run,velociraptor-attack} human/{walk-man,walk-heavy,walk-woman,dance-man}; do
        rest=$VG_DATA/${sequence%-*}.rest.obj
        [ -e "$rest" ] || rest=$VG_DATA/$sequence.rest.obj
        held_out "$VG_DATA/$sequence.tar.gz" "$rest"
        below "$output" 1.75
    done
    held_out "$VG_DATA/cloth/cloth-drop.tar.gz"
    below "$output" 1.75
}

@test "vg-deform --examples: sculpted poses are met, and others are nearer to the truth" {
    vg-encode --take 0,3,6,9,12 "$DATA/human-man-poses.tar.xz" -o man.vgs
    vg-encode --take 0,3,6,9,12 "$DATA/human-heavy-poses.tar.xz" -o heavy.vgs
    vg-encode --take 1-3 man.vgs -o some.vgs
    vg-encode --take 1-3 heavy.vgs -o sculpted.vgs
    pipe "vg-deform --onto heavy.vgs --examples some.vgs sculpted.vgs man.vgs | vg-solve -o out.vgs"
    pipe "vg-deform --onto heavy.vgs man.vgs | vg-solve -o plain.vgs"
    must vg-encode --take 0-3 out.vgs -o met.vgs
    must vg-encode --take 0-3 heavy.vgs -o wanted.vgs
    vg-diff -c -t 1e-9 wanted.vgs met.vgs # the examples, and the reference pose
    must_fail 1 vg-diff -c -t 1e-2 heavy.vgs plain.vgs
    py <<'END'
import json, subprocess
def mean(f):
    out = subprocess.run(["vg-diff", "-c", "--json", "--frames", "heavy.vgs", f], capture_output=True, text=True)
    return json.loads(out.stdout)["frame_errors"][4]["mean"]
assert mean("out.vgs") < min(mean("plain.vgs"), 0.0195), (mean("out.vgs"), mean("plain.vgs"))
END
    must_fail 2 vg-deform --onto heavy.vgs man.vgs --examples some.vgs
    must_fail 2 vg-deform --onto heavy.vgs man.vgs --examples some.vgs --root stay
    says "option '--examples' needs two values: POSES SCULPTED"
    must_fail 2 vg-deform --onto heavy.vgs --examples some.vgs -o out2.vgs man.vgs
    must_fail 2 vg-deform --onto heavy.vgs --examples some.vgs --sculpted sculpted.vgs man.vgs -o out2.vgs
    says "--sculpted is now the second value of --examples"
    must_fail 2 vg-deform --examples some.vgs sculpted.vgs man.vgs -o out2.vgs
    says "--examples needs --onto"
    must_fail 2 vg-deform --onto heavy.vgs --examples - - man.vgs -o out2.vgs
    must_fail 3 vg-deform --onto heavy.vgs --examples some.vgs heavy.vgs man.vgs -o out2.vgs
    says "they must match"
    must_fail 3 vg-deform --onto heavy.vgs --examples man.vgs heavy.vgs man.vgs -o out2.vgs
    says "one of them is the reference pose"
    must_fail 3 vg-deform --onto heavy.vgs --examples "$(trex vgs)" heavy.vgs man.vgs -o out2.vgs
    [ ! -e out2.vgs ]
}

# mean_of TRUTH RESULT FRAME...: over all frames but these, centroids at 0, in D of TRUTH
mean_of() {
    vg-diff -c --frames --json "$1" "$2" | python3 -c "
import json, sys
r = json.load(sys.stdin)
e = [f['mean'] for i, f in enumerate(r['frame_errors']) if str(i) not in sys.argv[1:]]
print(sum(e) / len(e) / r['D'])" "${@:3}"
}
below() { python3 -c "import sys; sys.exit(not float(sys.argv[1]) <= float(sys.argv[2]))" "$@" || fail "$1 is not below $2"; }

@test "vg-deform --examples --correspondence: the same onto a mesh with other vertices" {
    vg-encode --take 0-/2 "$(horse vgs)" -o run.vgs
    vg-decode run.vgs -o run/
    mkdir truth twin
    cp "$DATA/horse.rest.obj" run/rest.obj
    python3 - <<'END'
# truth: the horse stretched, which no transfer knows of; its vertices in another order. twin: the horse in that order
import os
for name in os.listdir("run"):
    lines = open("run/" + name).read().splitlines()
    v = [list(map(float, l.split()[1:])) for l in lines if l.startswith("v ")]
    faces = [[int(i.split("/")[0]) for i in l.split()[1:]] for l in lines if l.startswith("f ")]
    for where, s in ("truth", (1, 1.4, 0.7)), ("twin", (1, 1, 1)):
        with open(f"{where}/{name}", "w") as f:
            for p in reversed(v): print("v", *[a * b for a, b in zip(p, s)], file=f)
            for a in faces: print("f", *[len(v) + 1 - i for i in a], file=f)
END
    must vg-register --aligned run/rest.obj twin/rest.obj -o pairs.vgs
    mv truth/rest.obj stretched.obj
    vg-encode truth/ -o truth.vgs
    vg-encode --take 2,5,8 run.vgs -o some.vgs
    vg-encode --take 2,5,8 truth.vgs -o sculpted.vgs
    pipe "vg-deform --onto stretched.obj --correspondence pairs.vgs run.vgs | vg-solve -o plain.vgs"
    pipe "vg-deform --onto stretched.obj --correspondence pairs.vgs --examples some.vgs sculpted.vgs run.vgs | vg-solve -o out.vgs"
    must vg-encode --take 2,5,8 out.vgs -o met.vgs
    vg-diff -c -t 1e-9 sculpted.vgs met.vgs
    below "$(mean_of truth.vgs out.vgs 2 5 8)" "$(python3 -c "print($(mean_of truth.vgs plain.vgs 2 5 8) / 2)")"
}

# as in the table of doc/MATH.md, section 11, and 5 %
@test "vg-deform --examples: a walk onto a heavy man and onto a woman (needs VG_DATA, the data kit)" {
    [ -d "${VG_DATA:-}/human" ] || skip "VG_DATA does not name the data kit"
    kit=$VG_DATA/human
    for body in man heavy woman; do
        vg-encode --reference "$kit/walk-$body.rest.obj" "$kit/walk-$body.tar.gz" -o $body.vgs
    done
    for set in 4:1.15e-3 8:0.59e-3; do
        must vg-fitsignal --pick ${set%:*} --json man.vgs
        take=$(value take)
        for body in man heavy woman; do vg-encode --take "$take" $body.vgs -o some-$body.vgs; done
        pipe "vg-deform --onto $kit/walk-heavy.rest.obj --examples some-man.vgs some-heavy.vgs man.vgs | vg-solve -o out.vgs"
        below "$(mean_of heavy.vgs out.vgs ${take//,/ })" ${set#*:}
    done
    vg-register --markers "$VG_DATA/correspondences/male1591-female1605.markers.txt" "$kit/walk-man.rest.obj" \
        "$kit/walk-woman.rest.obj" -o pairs.vgs
    pipe "vg-deform --onto $kit/walk-woman.rest.obj --correspondence pairs.vgs man.vgs | vg-solve -o plain.vgs"
    pipe "vg-deform --onto $kit/walk-woman.rest.obj --correspondence pairs.vgs --examples some-man.vgs some-woman.vgs man.vgs |
        vg-solve -o out.vgs"
    below "$(mean_of woman.vgs out.vgs ${take//,/ })" "$(python3 -c "print($(mean_of woman.vgs plain.vgs) / 8)")"
}

# the form as printed, beside the correction: the bounds are the figures of section 11 and 5 %
@test "--examples and --onto: the printed form on a walk and on far poses (needs VG_DATA, the data kit)" {
    [ -d "${VG_DATA:-}/human" ] || skip "VG_DATA does not name the data kit"
    for body in man heavy; do
        vg-encode --reference "$VG_DATA/human/walk-$body.rest.obj" "$VG_DATA/human/walk-$body.tar.gz" -o walk-$body.vgs
        vg-encode "$VG_DATA/human/human-$body-poses.tar.gz" -o poses-$body.vgs
    done
    for set in walk:4:9.87e-3 walk:8:3.57e-3 walk:16:1.13e-3 poses:4:64.05e-3 poses:7:39.9e-3 poses:11:15.75e-3; do
        IFS=: read -r name count most <<<"$set"
        must vg-fitsignal --pick "$count" --json $name-man.vgs
        take=$(value take)
        first=
        [ $name = walk ] || [[ ,$take, = *,0,* ]] || first=0, # the first of these poses is the rest pose
        for body in man heavy; do
            vg-encode --take "$first$take" $name-$body.vgs -o some-$body.vgs
            [ $name = poses ] || with_rest "$VG_DATA/human/walk-$body.rest.obj" some-$body.vgs
        done
        must vg-fitsignal -q -t 1e-9 --examples some-man.vgs $name-man.vgs -o of-some.signal
        must vg-sample --onto some-heavy.vgs of-some.signal -o out.vgs
        below "$(mean_of $name-heavy.vgs out.vgs ${take//,/ })" "$most"
    done
}

@test "vg-deform --examples: poses of a man onto a heavy one" {
    for body in man heavy; do vg-encode "$DATA/human-$body-poses.tar.xz" -o $body.vgs; done
    for set in 4:5.76e-3 7:4.38e-3 11:2.55e-3; do
        must vg-fitsignal --pick ${set%:*} --json man.vgs
        take=$(value take)
        for body in man heavy; do vg-encode --take "$take" $body.vgs -o some-$body.vgs; done
        pipe "vg-deform --onto heavy.vgs --examples some-man.vgs some-heavy.vgs man.vgs | vg-solve -o out.vgs"
        below "$(mean_of heavy.vgs out.vgs ${take//,/ })" ${set#*:}
    done
}

@test "--examples and --onto: shapes are sums of poses, and of those of another body" {
    vg-encode --take 0,3,6,9,12 "$DATA/human-man-poses.tar.xz" -o man.vgs
    vg-encode --take 0-3 man.vgs -o some.vgs
    vg-encode --take 0-3 "$(trex vgs)" -o other.vgs # another body and connectivity: any poses will do
    must vg-fitsignal -t 1e-9 --examples some.vgs --report - --json man.vgs -o of-some.signal
    [ "$(value coordinates)" = 3 ] || fail "$output"
    must vg-info --check of-some.signal
    py of-some.signal <<'END'
import sys
from read_stream import read_stream
assert read_stream(sys.argv[1]).signal.examples
END
    vg-sample of-some.signal -o own.vgs
    must vg-encode --take 0-3 own.vgs -o met.vgs
    vg-diff -t 1e-9 some.vgs met.vgs # the examples; the fifth frame is no sum of them
    must_fail 1 vg-diff -t 1e-2 man.vgs own.vgs
    must vg-sample --onto some.vgs of-some.signal -o same.vgs
    vg-diff -t 1e-12 own.vgs same.vgs
    must vg-sample --onto other.vgs of-some.signal -o onto.vgs
    must vg-encode --take 0-3 onto.vgs -o met.vgs
    vg-diff -c -t 1e-9 other.vgs met.vgs
    # the fifth frame, laid on its least squares by the turn that was taken out: nothing of what is left is along the examples
    must vg-fitsignal -q --root none -t 1e-9 --examples some.vgs man.vgs -o plain.signal
    vg-sample plain.signal -o own.vgs
    py <<'END'
from read_stream import read_stream
man, own = read_stream("man.vgs").frames, read_stream("own.vgs").frames
left = [a - b for a, b in zip(man[4].values, own[4].values)]
for j in (1, 2, 3):
    along = [a - b for a, b in zip(man[j].values, man[0].values)]
    dot = sum(a * b for a, b in zip(left, along))
    assert abs(dot) < 1e-6 * sum(a * a for a in left) ** .5 * sum(a * a for a in along) ** .5, (j, dot)
assert sum(a * a for a in left) > 0
END
    vg-encode --take 0-2 man.vgs -o three.vgs
    must_fail 3 vg-sample --onto three.vgs of-some.signal -o no.vgs
    says "there are 3 poses, but the signal has 4 examples: they must match"
    must_fail 3 vg-sample --onto other.vgs "$(trex signal)" -o no.vgs
    says "the signal's shapes are not sums of examples: fit it with vg-fitsignal --examples"
    vg-encode man.vgs three.vgs -o twice.vgs
    must_fail 3 vg-fitsignal --examples twice.vgs man.vgs -o no.signal
    says "the examples are not independent"
    vg-encode --take 0 man.vgs -o one.vgs
    must_fail 3 vg-fitsignal --examples one.vgs man.vgs -o no.signal
    says "there must be at least 2"
    must_fail 3 vg-fitsignal --examples other.vgs man.vgs -o no.signal
    must_fail 2 vg-fitsignal --examples some.vgs -m 3 man.vgs -o no.signal
    must_fail 2 vg-sample --onto - - -o no.vgs
    [ ! -e no.vgs ] && [ ! -e no.signal ]
}

# red FILE: pixels of exactly the colour of a crossing in a PNG, and its size; red enough to be nothing else
red() {
    py "$1" <<'END'
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
at, rest, size = 8, b"", None
while at < len(data):
    n, tag = struct.unpack(">I4s", data[at:at + 8])
    if tag == b"IHDR": size = struct.unpack(">IIBB", data[at + 8:at + 18])
    if tag == b"IDAT": rest += data[at + 8:at + 8 + n]
    at += 12 + n
w, h, depth, kind = size
assert (depth, kind) == (8, 2)
raw, last, red = zlib.decompress(rest), bytes(3 * w), 0
for y in range(h):
    how, row = raw[y * (3 * w + 1)], bytearray(raw[y * (3 * w + 1) + 1:(y + 1) * (3 * w + 1)])
    for i in range(3 * w):
        a, b, c = row[i - 3] if i > 2 else 0, last[i], last[i - 3] if i > 2 else 0
        p = a + b - c
        near = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
        row[i] = (row[i] + (0, a, b, (a + b) // 2, near)[how]) % 256
    red += sum(row[i] == 205 and row[i + 1] == 30 and row[i + 2] == 40 for i in range(0, 3 * w, 3))
    last = row
print(w, h, red)
END
    printf '%s\n' "$output"
}

@test "vg-view draws the pose plane of a signal: crossings where there are some" {
    poses two 4
    printf '%s\n' '-1 -1' '1 1' '1 -1' '-1 1' >cross.txt
    printf '%s\n' '-1 -1' '1 -1' '1 1' '-1 1' >round.txt
    for way in cross round; do
        must vg-fitsignal -q --place $way.txt pose1.obj pose2.obj pose3.obj pose4.obj --json --report - -o $way.signal
        [ "$(value crossings)" = "$([ $way = cross ] && echo 1 || echo 0)" ] || fail "$output"
        must vg-view $way.signal -o $way.png
    done
    read -r width height crosses <<<"$(red cross.png)"
    [ "$width $height" = '1400 1124' ] && [ "$crosses" -gt 20 ] && [ "$crosses" -lt 200 ] || fail "$width $height $crosses"
    [ "$(red round.png)" = '1400 1124 0' ] || fail "$(red round.png)"
    must vg-view - -o again.png <cross.signal
    cmp cross.png again.png
    must vg-view -j 1 "$(trex signal)" -o trex.png
    must_fail 2 vg-view --frames 3 cross.signal -o no.png
    says "option '--frames' applies to a sequence: of a signal the pose plane is drawn"
    must_fail 2 vg-view cross.signal -o no.webp
    head -c -300 cross.signal >short.signal
    must_fail 3 vg-view short.signal -o no.png
    [ ! -e no.png ] && [ ! -e no.webp ]
}

@test "a sequence that holds still, two frames, a single triangle" {
    poses two 2
    for i in 1 2 3 4; do cp pose1.obj same$i.obj; done
    must vg-fitsignal -q same*.obj -o still.signal
    vg-sample still.signal | vg-diff -t 1e-12 <(vg-encode same*.obj) -
    must vg-fitsignal -q -k 4 -l 2 -m 1 pose1.obj pose2.obj -o two.signal
    vg-sample two.signal | vg-diff -t 1e-9 <(vg-encode pose1.obj pose2.obj) -
}
