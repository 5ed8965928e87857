#!/usr/bin/env bats
# vg-features, and vg-solve of features: there and back, by NPZ and Python, what is said of them, what is refused.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash
bats_require_minimum_version 1.5.0

setup_file() {
    cd "$BATS_FILE_TMPDIR" || return 1
    vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o horse.vgs
    vg-features horse.vgs -o horse.features.vgs
}

horse() { echo "$BATS_FILE_TMPDIR/horse.$1"; }

@test "features come back to 1e-9 D: as a stream, as NPZ, without the root, in any number of threads" {
    pipe "vg-solve '$(horse features.vgs)' | vg-diff -t 1e-9 '$(horse vgs)' -"
    pipe "vg-features --plain '$(horse vgs)' | vg-solve | vg-diff -t 1e-9 '$(horse vgs)' -"
    must vg-decode --f64 -o horse.npz "$(horse features.vgs)"
    [ "$(vg-info --digest "$(horse features.vgs)")" = "$(vg-encode horse.npz | vg-info --digest)" ] || fail "NPZ changed them"
    pipe "vg-encode horse.npz | vg-solve | vg-diff -t 1e-9 '$(horse vgs)' -"
    for j in 1 3; do must vg-features --no-provenance -j $j "$(horse vgs)" -o $j.vgs; done
    must cmp 1.vgs 3.vgs
    for j in 1 3; do must vg-solve --no-provenance -j $j 1.vgs -o back$j.vgs; done
    must cmp back1.vgs back3.vgs
}

@test "nine numbers come back nearly, and not exactly" {
    pipe_fail 1 "vg-features --nine '$(horse vgs)' | vg-solve | vg-diff -t 1e-5 '$(horse vgs)' -"
    pipe "vg-features --nine '$(horse vgs)' | vg-solve | vg-diff -t 0.05 '$(horse vgs)' -"
}

@test "a rigid turn changes the root alone" {
    py <<'END'
import os
from math import cos, sin
lines = open(os.environ["DATA"] + "/horse.rest.obj").read().splitlines()
a = 2.5
with open("turned.obj", "w") as f:
    for line in lines:
        w = line.split()
        if w and w[0] == "v":
            x, y, z = map(float, w[1:4])
            line = "v %.17g %.17g %.17g" % (cos(a) * x - sin(a) * y + 3, sin(a) * x + cos(a) * y, z)
        print(line, file=f)
END
    must vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse.rest.obj" turned.obj -o turned.vgs
    must vg-features turned.vgs -o turned.features.vgs
    py <<'END'
from math import cos, sin
from read_stream import read_stream
first, turned = read_stream("turned.features.vgs").frames
assert max(abs(a - b) for a, b in zip(first.values, turned.values)) < 1e-9
root = turned.channels["root_turn"].values
assert max(abs(a - b) for a, b in zip(root, (cos(1.25), 0, 0, sin(1.25)))) < 1e-9, list(root)
END
}

@test "-v says jumps, degenerate neighbourhoods and the error of the way back" {
    must_warn vg-features -v "$(horse vgs)" -o v.vgs
    says "0 times an edge over which the rotation jumps by more than half a turn"
    says "0 vertices whose neighbourhood is degenerate"
    [[ $stderr =~ "largest error of the reconstruction: "[0-9.]+e-1[0-9]" D" ]] || fail "$stderr"
}

@test "Python learns from features by NPZ, and vg-solve takes what it made" {
    /usr/bin/python3 -c 'import numpy' 2>/dev/null || skip "there is no NumPy"
    must vg-decode --f64 -o horse.npz "$(horse features.vgs)"
    must /usr/bin/python3 "$ROOT/examples/pca_features.py" 100 horse.npz all.npz
    pipe "vg-encode all.npz | vg-solve | vg-diff -t 1e-9 '$(horse vgs)' -"
    must /usr/bin/python3 "$ROOT/examples/pca_features.py" 2 horse.npz few.npz
    pipe "vg-encode few.npz | vg-solve -o few.vgs"
    pipe_fail 1 "vg-diff -t 1e-6 '$(horse vgs)' few.vgs"
    pipe "vg-diff -t 0.1 '$(horse vgs)' few.vgs"
}

@test "what is no feature is refused; what is missing is said" {
    must_fail 3 vg-features "$(horse features.vgs)" -o no.vgs
    says "the input holds features"
    must_fail 2 vg-solve --fit squares "$(horse features.vgs)" -o no.vgs
    says "--fit is for vectors, the input holds features"
    must vg-decode --f64 -o horse.npz "$(horse features.vgs)"
    py <<'END'
import zipfile
def rewrite(name, drop=(), change={}):
    with zipfile.ZipFile("horse.npz") as a, zipfile.ZipFile(name, "w") as z:
        for n in a.namelist():
            if n[:-4] not in drop:
                data = a.read(n)
                z.writestr(n, change[n[:-4]](data) if n[:-4] in change else data)
rewrite("unplaced.npz", drop=("centroids",))
rewrite("homeless.npz", drop=("reference",))
rewrite("still.npz", change={"root_turns": lambda d: d[:-32] + bytes(32)})
END
    must_warn bash -c 'vg-encode unplaced.npz | vg-solve -o placed.vgs'
    says "frames have no 'centroids': their components are where the reference pose has them"
    must_fail 3 vg-encode homeless.npz -o no.vgs
    says "none called 'reference'"
    pipe_fail 3 "vg-encode still.npz | vg-solve -o no.vgs"
    says "has a 'root_turn' that is not a rotation"
    [ ! -e no.vgs ]
}

@test "what an array or an archive of arrays cannot keep of features is said" {
    must_warn vg-decode "$(horse features.vgs)" -o horse.npy
    says "rotations of the root and centroids"
    must vg-decode --f64 -o horse.npz "$(horse features.vgs)"
    [ -z "$stderr" ]
    PYTHONPATH=$ROOT/examples/python python3 - "$(horse features.vgs)" <<'END'
import sys, vgstream
with vgstream.Reader(sys.argv[1]) as s:
    w = vgstream.Writer("some.vgs", s)
    for i, frame in enumerate(s):
        if i == 3:
            frame.drop_channels()
        w.put(frame)
    w.close(s.tail)
END
    must_warn vg-decode some.vgs -o some.npz
    says "rotations of the root or centroids: not every frame has them"
}
