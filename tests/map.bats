#!/usr/bin/env bats
# vg-fitmap, vg-play and vg-retarget: errors on real sequences, another body, frame by frame, a player of its own.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash
bats_require_minimum_version 1.5.0

setup_file() {
    cd "$BATS_FILE_TMPDIR" || return 1
    vg-encode --reference "$DATA/trex.rest.obj" "$DATA/trex-walk.tar.xz" -o trex.vgs
    vg-segment -k 50 --connected trex.vgs -o trex.patches
    vg-fitmap -q --patches trex.patches trex.vgs -o trex.map
    vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o horse.vgs
    vg-segment -k 8 --connected horse.vgs | vg-fitmap -q --patches - horse.vgs -o horse.map
}

# what setup_file made, in the directory of the test
made() {
    ln -s "$BATS_FILE_TMPDIR"/*.vgs "$BATS_FILE_TMPDIR"/*.map "$BATS_FILE_TMPDIR"/*.patches .
}

@test "50 patches of the trex: the error with motions given and with rotations alone" {
    made
    must vg-play trex.map trex.vgs -o given.vgs
    at_most "$(vertex_error mean --centred trex.vgs given.vgs)" 0.0017
    must vg-play trex.map --rotations trex.vgs -o joints.vgs
    at_most "$(vertex_error mean --centred trex.vgs joints.vgs)" 0.00245
}

@test "14 large poses of a man, 50 patches; the heavy man by the same map" {
    made
    must vg-encode "$DATA/human-man-poses.tar.xz" -o man.vgs
    pipe "vg-segment -k 50 --connected man.vgs | vg-fitmap -q --patches - man.vgs -o man.map"
    must vg-play man.map man.vgs -o given.vgs
    at_most "$(vertex_error mean --centred man.vgs given.vgs)" 0.0015
    must vg-retarget --onto "$DATA/human-heavy-poses.tar.xz" man.map -o heavy.map
    must vg-play heavy.map man.vgs -o heavy.vgs
    at_most "$(vertex_error mean --centred "$DATA/human-heavy-poses.tar.xz" heavy.vgs)" 0.008
}

@test "the report: fitted and left out; none when quiet" {
    made
    run -0 vg-fitmap --holdout 4 --patches trex.patches trex.vgs -o out.map
    [[ $output == *"fitted, patch motions given"*"26 poses"*"left out, rotations alone"*"8 poses"* ]]
    run -0 vg-fitmap -q --holdout 4 --patches trex.patches trex.vgs -o out.map
    [ -z "$output" ]
}

@test "motions written and played are the poses; and by the player that shares no code" {
    made
    must vg-play horse.map --transforms horse.vgs -o motions.vgs
    must vg-play horse.map motions.vgs -o a.vgs
    must vg-play horse.map horse.vgs -o b.vgs
    must vg-diff -t 1e-12 a.vgs b.vgs
    python3 "$ROOT/examples/play_map.py" horse.map motions.vgs >played.txt
    py <<'END'
from read_stream import read_stream
ours = [x for f in read_stream("a.vgs").frames for x in f.values]
theirs = [float(x) for line in open("played.txt") if not line.startswith("frame") for x in line.split()]
assert len(ours) == len(theirs) and max(abs(a - b) for a, b in zip(ours, theirs)) < 1e-12
END
}

@test "keys of a path are met, and named" {
    made
    must vg-play trex.map --at 0,33 trex.vgs -o ends.vgs
    must vg-play trex.map trex.vgs -o all.vgs
    py <<'END'
from read_stream import read_stream
ends, every = read_stream("ends.vgs").frames, read_stream("all.vgs").frames
for a, b in zip(ends, (every[0], every[-1])):
    assert a.name == b.name and max(abs(x - y) for x, y in zip(a.values, b.values)) < 1e-9
END
}

@test "--live: each frame comes out before the next goes in" {
    made
    must vg-play horse.map --transforms horse.vgs -o motions.vgs
    py <<'END'
import os, select, struct, subprocess
data = open("motions.vgs", "rb").read()
cuts, at = [], 16
while at < len(data):
    tag, length = data[at:at + 4], struct.unpack_from("<Q", data, at + 8)[0]
    at += 32 + (length + 7) // 8 * 8
    cuts.append((tag, at))
p = subprocess.Popen(["vg-play", "horse.map", "--live"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
sent = frames = 0
got = b""
for tag, end in cuts:
    p.stdin.write(data[sent:end])
    p.stdin.flush()
    sent = end
    if tag != b"FRAM":
        continue
    frames += 1
    while got.count(b"FRAM\1\0\0\0") < frames:
        assert select.select([p.stdout], [], [], 20)[0], f"frame {frames} does not come"
        got += os.read(p.stdout.fileno(), 1 << 20)
p.stdin.close()
p.stdout.read()
assert p.wait() == 0 and frames > 10
END
}

@test "what does not fit is refused" {
    made
    run -3 vg-play horse.map trex.vgs -o out.vgs
    run -3 vg-play trex.patches trex.vgs -o out.vgs
    must vg-play horse.map --transforms horse.vgs -o motions.vgs
    run -3 vg-play trex.map motions.vgs -o out.vgs
    run -2 vg-retarget --morph 0.5 horse.map -o out.map
    run -2 vg-fitmap horse.vgs -o out.map
    run -3 vg-fitmap --patches trex.patches horse.vgs -o out.map
    run -3 vg-retarget --onto "$DATA/trex.rest.obj" horse.map -o out.map
    [ ! -e out.vgs ] && [ ! -e out.map ]
}

@test "poses with patches have a colour for each face in PLY" {
    made
    must vg-play horse.map --at 0 horse.vgs -o one.vgs
    must vg-decode one.vgs --format ply-ascii -o one.ply
    grep -qx "property uchar red" one.ply
    colours=$(awk 'NF == 7 || NF == 8 || NF == 9 || NF == 10 {print $(NF - 2), $(NF - 1), $NF}' one.ply | sort -u | wc -l)
    [ "$colours" -ge 8 ]
    capture vg-encode one.ply -o again.vgs
    [ "$status" = 0 ]
    says "'one.ply': left out the colours of its faces"
}
