#!/usr/bin/env bats
# Progress: lines of JSON for a program that runs others; on a terminal only of the slowest program of a pipe.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# terminal.py: what programs have shown on a terminal, until all have closed it
setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    cat >terminal.py <<'END'
import os
def read_terminal(main):
    shown = b""
    try:
        while more := os.read(main, 65536):
            shown += more
    except OSError:
        pass
    return shown
END
}

@test "--progress json: lines of JSON to standard error or a descriptor, with totals where they are known" {
    poses cube 2
    vg-encode pose1.obj pose2.obj -o in.vgs
    must bash -c 'vg-interpolate --progress json:3 200 in.vgs -o out.vgs 3>lines'
    must bash -c 'vg-encode --progress json:3 in.vgs -o out.vgs 3>plain'
    must bash -c 'vg-register --progress json:3 --aligned pose1.obj pose1.obj -o out.vgs 3>register'
    capture vg-encode -q --progress json in.vgs -o out.vgs
    [ "$status" = 0 ]
    says '{"program":"vg-encode","doing":"poses","done":'
    py <<'END'
import json
def read(name):
    lines = [json.loads(line) for line in open(name)]
    assert lines, name
    assert all(line["seconds"] >= 0 and (line["done"] >= 1 or line["doing"] == "aligning") for line in lines)
    return lines
for line in read("lines"):
    assert line["program"] == "vg-interpolate" and line["doing"] in ("keys", "poses")
    assert ("total" in line) == (line["doing"] == "poses") and line.get("total", 200) == 200
assert "total" not in read("plain")[0] and "left" not in read("plain")[0]
first, second = read("register")[:2]
assert first["doing"] == "aligning" and first["done"] == 0 and "total" not in first
assert second["doing"] == "rounds" and 1 <= second["done"] <= second["total"]
END
    for value in xml json: json:x json:3x json:1 json:99; do
        must_fail 2 vg-encode --progress "$value" in.vgs -o out2.vgs
        says --progress
    done
    [ ! -e out2.vgs ]
}

@test "on a terminal the slowest program of a pipe shows its progress, and no other" {
    needs_terminal
    poses cube 9
    vg-encode pose*.obj -o in.vgs
    mkfifo slow
    cat >feed.py <<'END'
import os, subprocess, sys, threading, time
from terminal import read_terminal
def run(from_pipe):
    """What vg-encode shows on a terminal whose input takes two seconds to come: as standard input, or as a named pipe."""
    main, side = os.openpty()
    data = open("in.vgs", "rb").read()
    read_end, write_end = os.pipe()
    p = subprocess.Popen(["vg-encode", "-" if from_pipe else "slow", "-o", "out.vgs"],
                         stdin=read_end if from_pipe else subprocess.DEVNULL, stderr=side)
    os.close(read_end)
    to = os.fdopen(write_end, "wb") if from_pipe else open("slow", "wb")
    piece = len(data) // 10 + 1
    for i in range(0, len(data), piece):
        to.write(data[i:i + piece])
        to.flush()
        if i:
            time.sleep(0.25)
    to.close()
    assert p.wait() == 0
    os.close(side)
    return read_terminal(main)
alone, waiting = run(False), run(True)
assert b"vg-encode: poses " in alone, alone
assert b"poses" not in waiting.split(b"\r\033[K")[0] and b"vg-encode: poses 5" not in waiting, waiting
END
    must python3 feed.py
}

# doing FILE: what the lines of JSON in FILE say is done, each once
doing() {
    sed -n 's/.*"doing":"\([^"]*\)".*/\1/p' "$1" | uniq | tr '\n' ';'
}

@test "every fit says what it does" {
    vg-encode --take 0-11 "$DATA/horse-run.tar.xz" -o in.vgs
    vg-decode --replace in.vgs -o 'pose%d.obj'
    must vg-segment -q --progress json:3 -k 12 in.vgs -o in.patches 3>segment
    [[ $(doing segment) = *'finding patches;'* ]] || fail "$(cat segment)"
    must vg-fitmap -q --progress json:3 --patches in.patches in.vgs -o in.map 3>map
    [[ $(doing map) = *'solving for the map;'* ]] || fail "$(cat map)"
    must vg-retarget -q --progress json:3 --onto pose2.obj in.map -o to.map 3>retarget
    [[ $(doing retarget) = 'retargeting;' ]] || fail "$(cat retarget)"
    must vg-fitsignal -q --progress json:3 in.vgs -o in.signal 3>signal
    [[ $(doing signal) = *'fitting the signal;' ]] || fail "$(cat signal)"
    must vg-smooth -q --progress json:3 --filter together in.vgs -o out.vgs 3>smooth
    [[ $(doing smooth) = *'finding the common motion;'* ]] || fail "$(cat smooth)"
    must vg-train -q --progress json:3 --iterations 300 in.vgs -o in.net 3>train
    [[ $(doing train) = *'iterations'* ]] || fail "$(cat train)"
    py <<'END'
import json
for name in ("segment", "map", "retarget", "signal", "smooth", "train"):
    for line in open(name):
        x = json.loads(line)
        assert x["seconds"] >= 0 and x["done"] >= 0 and ("total" in x) == x["doing"].startswith(("iterations", "frames written")), x
END
}

@test "on a terminal a fit shows how long it takes, its line goes when it has ended, and with -q there is none" {
    needs_terminal
    # 500 different poses: four seconds of work
    vg-encode "$DATA/velociraptor-walk.tar.xz" | vg-interpolate 500 | vg-solve -q --fit squares -o walk.vgs
    cat >watch.py <<'END'
import os, re, subprocess
from terminal import read_terminal
def watch(*command):
    main, side = os.openpty()
    p = subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=side)
    os.close(side)
    shown = read_terminal(main)
    assert p.wait() == 0
    return shown
shown = watch("vg-fitsignal", "-j1", "--space", "gradients", "walk.vgs", "-o", "walk.signal")
assert re.search(rb"vg-fitsignal: fitting the signal, \d+ s", shown), shown
tail = shown[shown.rindex(b"fitting the signal"):]
assert b"\r\033[K" in tail, tail
assert not watch("vg-fitsignal", "-q", "-j1", "--space", "gradients", "walk.vgs", "-o", "walk.signal")
END
    must python3 watch.py
}
