#!/usr/bin/env bats
# Progress: lines of JSON for a program that runs others; on a terminal only of the slowest program of a pipe.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

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
    assert all(line["seconds"] >= 0 and line["done"] >= 1 for line in lines)
    return lines
for line in read("lines"):
    assert line["program"] == "vg-interpolate" and line["doing"] in ("keys", "poses")
    assert ("total" in line) == (line["doing"] == "poses") and line.get("total", 200) == 200
assert "total" not in read("plain")[0] and "left" not in read("plain")[0]
first = read("register")[0]
assert first["doing"] == "rounds" and 1 <= first["done"] <= first["total"]
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
    shown = b""
    try:
        while more := os.read(main, 65536):
            shown += more
    except OSError:
        pass
    return shown
alone, waiting = run(False), run(True)
assert b"vg-encode: poses " in alone, alone
assert b"poses" not in waiting.split(b"\r\033[K")[0] and b"vg-encode: poses 5" not in waiting, waiting
END
    must python3 feed.py
}
