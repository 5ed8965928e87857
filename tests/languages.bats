# languages.bats: the modules for Python and JavaScript read and write what the programs do: every golden stream goes through
# them byte for byte, damage is refused, and what they make the programs take.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# golden streams that a writer cannot give back as they are: a later minor version, and records that filters leave out
REWRITTEN='future-minor unknown-records'

python() {
    PYTHONPATH=$ROOT/examples/python "${PYTHON:-python3}" "$@"
}

# rewrite_python IN OUT
rewrite_python() {
    must python - "$1" "$2" <<'END'
import sys, vgstream
with vgstream.Reader(sys.argv[1]) as s:
    w = vgstream.Writer(sys.argv[2], s)
    for frame in s: w.put(frame)
    w.close(s.tail)
END
}

rewrite_javascript() {
    cat >rewrite.mjs <<END
import { readFileSync, writeFileSync } from 'node:fs';
import { read, write } from '$ROOT/examples/javascript/vgstream.mjs';
writeFileSync(process.argv[3], write(read(new Uint8Array(readFileSync(process.argv[2])))));
END
    must node rewrite.mjs "$1" "$2"
}

# goldens REWRITE: byte for byte but for the two; those twice, which is the same as once
goldens() {
    local file name
    for file in "$GOLDEN"/*.vgs; do
        name=$(basename "$file" .vgs)
        "$1" "$file" out.vgs || return 1
        must vg-info --check out.vgs || return 1
        if [[ " $REWRITTEN " = *" $name "* ]]; then
            ! cmp -s "$file" out.vgs || fail "$name is no exception" || return 1
            "$1" out.vgs again.vgs || return 1
            must cmp out.vgs again.vgs || return 1
        else
            must cmp "$file" out.vgs || return 1
        fi
    done
}

@test "python: golden streams go through byte for byte, with NumPy and without" {
    goldens rewrite_python
    mkdir no
    echo 'raise ImportError("none here")' >no/numpy.py
    must env PYTHONPATH="$PWD/no:$ROOT/examples/python" python3 - "$GOLDEN" <<'END'
import glob, io, sys, vgstream
assert vgstream.numpy is None
done = 0
for name in sorted(glob.glob(sys.argv[1] + "/*.vgs")):
    if "future-minor" in name or "unknown-records" in name: continue
    out = io.BytesIO()
    with vgstream.Reader(name) as s:
        w = vgstream.Writer(out, s)
        for frame in s: w.put(frame)
        w.close(s.tail)
    with open(name, "rb") as file: assert file.read() == out.getvalue(), name
    done += 1
assert done >= 15, done
END
}

@test "javascript: golden streams go through byte for byte" {
    command -v node >/dev/null || skip "node is not installed"
    goldens rewrite_javascript
}

@test "XXH64: the test vectors of STREAM.md, and the same as the library at every length" {
    must python - <<'END'
import vgstream
assert [vgstream.xxh64_plain(x) for x in (b"", b"a", b"abc")] == [0xEF46DB3751D8E999, 0xD24EC4F1A98C6E5B, 0x44BC2CF5AD770999]
data = bytes(i * 37 & 255 for i in range(200))
for n in range(200): assert vgstream.xxh64(data[:n]) == vgstream.xxh64_plain(data[:n]), n
open("sums", "w").write("".join("%d\n" % vgstream.xxh64_plain(data[:n]) for n in range(200)))
END
    command -v node >/dev/null || skip "node is not installed"
    cat >sums.mjs <<END
import { xxh64 } from '$ROOT/examples/javascript/vgstream.mjs';
const data = Uint8Array.from({ length: 200 }, (_, i) => (i * 37) & 255);
for (let n = 0; n < 200; n++) console.log(String(xxh64(data.subarray(0, n))));
END
    node sums.mjs >sums.js
    must cmp sums sums.js
}

@test "every cut and every damaged byte of a stream is refused by both" {
    must python - "$GOLDEN/times.vgs" <<'END'
import io, sys, vgstream
data = open(sys.argv[1], "rb").read()
def whole(b):
    try: list(vgstream.Reader(io.BytesIO(b)))
    except vgstream.StreamError: return False
    return True
assert whole(data) and not whole(data + b"\0")
for n in range(0, len(data), 3): assert not whole(data[:n]), n
for i in range(len(data)):
    if i not in range(8, 12): assert not whole(data[:i] + bytes([data[i] ^ 0x55]) + data[i + 1:]), i
END
    command -v node >/dev/null || skip "node is not installed"
    cat >damage.mjs <<END
import { readFileSync } from 'node:fs';
import { read, StreamError } from '$ROOT/examples/javascript/vgstream.mjs';
const data = new Uint8Array(readFileSync(process.argv[2]));
const whole = (b) => { try { read(b); return true; } catch (e) { if (!(e instanceof StreamError)) throw e; return false; } };
if (!whole(data)) throw Error('whole');
for (let n = 0; n < data.length; n += 3) if (whole(data.slice(0, n))) throw Error('cut at ' + n);
for (let i = 0; i < data.length; i++) {
    if (i >= 8 && i < 12) continue;
    const b = data.slice();
    b[i] ^= 0x55;
    if (whole(b)) throw Error('damage at ' + i);
}
END
    must node damage.mjs "$GOLDEN/times.vgs"
}

@test "what they make, the programs take; and pipes run from python" {
    poses cube 3
    must python - <<'END'
import sys, vgstream
points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
with vgstream.Writer("made.vgs", vgstream.mesh(points, [[0, 1, 2, 3]])) as out:
    for i in range(3): out.put_pose("p%d" % i, [(x, y, 0.1 * i) for x, y, z in points], time=i / 24)
with vgstream.pipe(["vg-encode", "pose1.obj", "pose2.obj"], ["vg-deform", "--onto", "pose3.obj"], ["vg-solve"]) as frames:
    assert [f.name for f in frames] == ["pose1", "pose2"] and frames.nv == 8 and len(frames.faces) == 6
try:
    with vgstream.pipe(["sh", "-c", "vg-encode none.obj 2>errors"], ["sh", "-c", "vg-solve 2>>errors"]) as frames: list(frames)
    sys.exit("a failure was not seen")
except vgstream.StreamError as e:
    assert str(e) == "sh ended with status 4", e
try:
    with vgstream.Writer("half.vgs", vgstream.mesh(points, [[0, 1, 2]])) as out: out.put_pose("p", [float("nan")] * 12)
except ValueError: pass
import os
assert not [n for n in os.listdir(".") if n.startswith("half")]
END
    vg-info made.vgs | grep -q "3: 'p0' to 'p2'" || fail "$(vg-info made.vgs)"
    command -v node >/dev/null || skip "node is not installed"
    cat >make.mjs <<END
import { writeFileSync } from 'node:fs';
import { mesh, write, read, meshOf } from '$ROOT/examples/javascript/vgstream.mjs';
const points = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], stream = mesh(points, [[0, 1, 2, 3]]);
for (let i = 0; i < 3; i++) stream.frames.push({ name: 'p' + i, channels: [{ name: 'time', unit: 's', element: 'frame', width: 1, type: 8, numbers: [i / 24] }], values: points.map((x, k) => (k % 3 === 2 ? 0.1 * i : x)) });
const bytes = write(stream);
if (meshOf(read(bytes)).faces[0].length !== 4) throw Error('faces');
writeFileSync('script.vgs', bytes);
END
    must node make.mjs
    must vg-diff --tolerance 1e-15 made.vgs script.vgs
}
