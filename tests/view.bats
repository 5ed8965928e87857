#!/usr/bin/env bats
# vg-view: the picture, what may be asked of it, and what happens when it cannot be made.

load lib

# png FILE: "WIDTH HEIGHT" when the file is a whole PNG whose checksums and pixels are right
png() {
    python3 - "$1" <<'PY'
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
assert data[:8] == b"\x89PNG\r\n\x1a\n"
at, pixels, tags = 8, b"", []
while at < len(data):
    size, tag = struct.unpack(">I4s", data[at:at + 8])
    body = data[at + 8:at + 8 + size]
    assert zlib.crc32(tag + body) == struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0]
    if tag == b"IHDR":
        width, height, depth, colour = struct.unpack(">IIBB", body[:10])
    if tag == b"IDAT":
        pixels += body
    tags.append(tag)
    at += 12 + size
assert tags[0] == b"IHDR" and tags[-1] == b"IEND" and (depth, colour) == (8, 2)
assert b"tIME" not in tags and b"tEXt" not in tags
assert len(zlib.decompress(pixels)) == height * (1 + 3 * width)
print(width, height)
PY
}

@test "a mesh file becomes a picture of the right size" {
    mesh cube >cube.obj
    must vg-view cube.obj -o cube.png
    must png cube.png
    [ "$output" = "392 414" ]
    must vg-view cube.obj --size 100x50 -o small.png
    must png small.png
    [ "$output" = "132 104" ]
    nothing_but cube.obj cube.png small.png
}

@test "several poses stand in columns, and no more than were asked for" {
    poses cube 5
    must vg-view pose*.obj --size 32x32 --columns 2 -o sheet.png
    must png sheet.png
    [ "$output" = "112 226" ]
    must vg-view pose*.obj --size 32x32 --frames 3 --columns 9 -o sheet.png
    must png sheet.png
    [ "$output" = "160 86" ]
    poses cube 9
    must vg-view pose*.obj --size 32x32 --columns 9 -o sheet.png # 8 unless told
    must png sheet.png
    [ "$output" = "400 86" ]
}

@test "a stream from a pipe gives the same picture as its files" {
    poses two 3
    must vg-view pose*.obj --size 64x64 -o files.png
    pipe 'vg-encode pose1.obj pose2.obj pose3.obj | vg-view --size 64x64 -o pipe.png'
    same_file files.png pipe.png
    pipe 'vg-encode pose1.obj pose2.obj pose3.obj | vg-view --size 64x64 - -o - >out.png'
    same_file files.png out.png
}

@test "the same input gives the same bytes with any number of threads" {
    poses cube 4
    must vg-view pose*.obj --ground --edges --size 64x64 -j 1 -o one.png
    must vg-view pose*.obj --ground --edges --size 64x64 -j 3 -o three.png
    same_file one.png three.png
}

@test "every view is another picture, and its name means its angles" {
    mesh two >two.obj
    local view
    for view in front back left right top iso; do must vg-view two.obj --size 48x48 --view "$view" -o "$view.png"; done
    [ "$(for view in front back left right top iso; do cksum <"$view.png"; done | sort -u | wc -l)" = 6 ]
    must vg-view two.obj --size 48x48 --view 90,0 -o angle.png
    same_file right.png angle.png
    must vg-view two.obj --size 48x48 --view=-90,0 -o angle.png
    same_file left.png angle.png
    must vg-view two.obj --size 48x48 --view front --up z -o angle.png
    [ "$(cksum <angle.png)" != "$(cksum <front.png)" ]
}

@test "errors are drawn with a legend; those of a sequence against itself are its lowest colour" {
    poses cube 2
    must vg-view pose*.obj --size 40x40 -o plain.png
    must_fail 3 vg-view pose*.obj --against pose1.obj -o errors.png
    says "'pose1.obj' to 'pose2.obj' has 2 frames where 'pose1.obj' has 1"
    one_line
    mkdir truth
    cp pose*.obj truth
    must vg-view pose*.obj --size 40x40 --against truth -o errors.png
    must png errors.png
    [ "$output" = "128 186" ]
    must png plain.png
    [ "$output" = "128 94" ]
}

@test "--centred forgives a shift, --scale sets the end of the colours" {
    mesh cube >a.obj
    mesh cube 0 5 >b.obj
    must vg-view b.obj --against a.obj --scale 0.5 --size 40x40 -o far.png
    must vg-view b.obj --against a.obj --scale 0.5 --size 40x40 --centred -o near.png
    must vg-view b.obj --against b.obj --scale 0.5 --size 40x40 --centred -o same.png
    [ "$(cksum <far.png)" != "$(cksum <near.png)" ]
    same_file near.png same.png
}

@test "meshes that do not fit are refused before anything is written" {
    mesh cube >cube.obj
    mesh tetra >tetra.obj
    must_fail 3 vg-view cube.obj --against tetra.obj -o out.png
    says "'cube.obj' has 8 vertices where 'tetra.obj' has 4"
    one_line
    nothing_but cube.obj tetra.obj
}

@test "a stream of vectors is sent to vg-solve" {
    mesh cube >cube.obj
    pipe 'vg-encode --vectors cube.obj >cube.vgs'
    must_fail 3 vg-view cube.vgs -o out.png
    says "'cube.vgs' holds vectors: pipe it through 'vg-solve' first"
    one_line
    nothing_but cube.obj cube.vgs
}

@test "a truncated stream gives no picture" {
    poses cube 3
    pipe 'vg-encode pose1.obj pose2.obj pose3.obj >whole.vgs'
    head -c $(($(wc -c <whole.vgs) - 40)) whole.vgs >cut.vgs
    must_fail 3 vg-view cut.vgs -o out.png
    one_line
    [ ! -e out.png ]
    must_fail 3 vg-view /dev/null -o out.png
    one_line
    nothing_but pose1.obj pose2.obj pose3.obj whole.vgs cut.vgs
}

@test "wrong names and values are told before the input is read" {
    local arguments
    must_fail 2 vg-view missing.obj -o out.obj
    says "'out.obj'" ".png"
    must_fail 2 vg-view missing.obj -o .png
    for arguments in '--frames 0' '--frames two' '--columns 0' '--size 8x8' '--size 64' '--size 64x64x' '--size 5000x64' \
        '--view up' '--view 30' '--view 30,' '--view 30,91' '--up x' '--scale 0' '--centred' '--zoom 0' '--scales --scale 1' \
        '--plain --scales' '--plain --scale 2' '--plain --patches x' '--scales --against x' '--plain --against x'; do
        # shellcheck disable=SC2086
        must_fail 2 vg-view missing.obj -o out.png $arguments
        says "${arguments%% *}"
    done
    must_fail 2 vg-view --against - -o out.png
    says "only once"
    must_fail 4 vg-view missing.obj -o out.png
    says "'missing.obj'"
    must_fail 4 vg-view missing.obj -o nowhere/out.png
    says "'nowhere/out.png'"
    nothing_but
}

@test "a full device and a closed pipe are no success" {
    mesh cube >cube.obj
    must_fail 4 bash -c 'vg-view cube.obj >/dev/full'
    says "standard output"
    one_line
    must_fail 4 vg-view cube.obj -o /dev/full
    says "/dev/full"
    one_line
    run bash -c 'set -o pipefail; vg-view cube.obj --size 2000x2000 --ground | head -c 1 >/dev/null'
    [ "$status" = 141 ]
}

@test "an existing picture stays when the new one fails" {
    mesh cube >cube.obj
    must vg-view cube.obj --size 40x40 -o out.png
    cp out.png before.png
    printf 'v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n' >bad.obj
    must_fail 3 vg-view bad.obj -o out.png
    same_file before.png out.png
    nothing_but cube.obj out.png before.png bad.obj
}

@test "lines, points and figures without extent are drawn" {
    printf 'v 0 0 0\nv 0 1 0\nv 1 1 0\nl 1 2\nl 2 3\n' >bones.obj
    printf 'v 0 0 0\nv 1 2 3\n' >points.obj
    printf 'v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n' >same.obj
    printf 'v 4 5 6\n' >point.obj
    local name
    for name in bones points same point; do
        must vg-view "$name.obj" --size 48x48 --ground --edges -o "$name.png"
        must png "$name.png"
        [ "$output" = "80 126" ]
        must vg-view "$name.obj" --against "$name.obj" --fit figure --size 48x48 -o "$name.png"
        must png "$name.png"
    done
}

@test "of a long sequence as many frames are shown as were asked for" {
    poses cube 4
    local i files=()
    for ((i = 0; i < 100; i++)); do files+=(pose1.obj pose2.obj pose3.obj pose4.obj); done
    must vg-encode "${files[@]}" -o long.vgs
    must vg-view long.vgs --frames 5 --columns 5 --size 32x32 -o long.png
    must png long.png
    [ "$output" = "256 86" ]
}

@test "-h and -V" {
    must vg-view -h
    shows "usage: vg-view [options] [FILE ...]" --against --frames
    must vg-view --version
    shows "vg-view"
}

# hues FILE: how many of the six sectors of the colour circle hold at least 200 strongly coloured pixels
hues() {
    python3 - "$1" <<'PY'
import colorsys, struct, sys, zlib
data = open(sys.argv[1], "rb").read()
at, packed = 8, b""
while at < len(data):
    n, kind = struct.unpack(">I4s", data[at:at + 8])
    body = data[at + 8:at + 8 + n]
    if kind == b"IHDR":
        width, height, depth, colour = struct.unpack(">IIBB", body[:10])
        assert (depth, colour) == (8, 2)
    packed += body if kind == b"IDAT" else b""
    at += 12 + n
raw, step = zlib.decompress(packed), 3 * width
before, count = bytearray(step), [0] * 6
for y in range(height):
    how, line = raw[y * (step + 1)], bytearray(raw[y * (step + 1) + 1:(y + 1) * (step + 1)])
    for i in range(step):
        a, b, c = line[i - 3] if i > 2 else 0, before[i], before[i - 3] if i > 2 else 0
        p = a + b - c
        paeth = a if abs(p - a) <= abs(p - b) and abs(p - a) <= abs(p - c) else b if abs(p - b) <= abs(p - c) else c
        line[i] = (line[i] + (0, a, b, (a + b) // 2, paeth)[how]) & 255
    before = line
    for x in range(0, step, 3):
        h, s, v = colorsys.rgb_to_hsv(*(c / 255 for c in line[x:x + 3]))
        if s > 0.35 and v > 0.2:
            count[int(h * 6) % 6] += 1
print(sum(n >= 200 for n in count))
PY
}

@test "patches are colours on a sheet: of a stream without frames, and of one that is given beside the poses" {
    poses cube 3
    must vg-segment --patches 3 pose1.obj pose2.obj pose3.obj -o cube.patches
    must vg-view pose1.obj -o clay.png
    must vg-view pose1.obj --patches cube.patches -o poses.png
    must vg-view cube.patches -o patches.png
    [ "$(hues clay.png)" = 0 ] || fail "clay has $(hues clay.png) hues"
    [ "$(hues poses.png)" -ge 2 ] || fail "the poses have $(hues poses.png) hues"
    [ "$(hues patches.png)" -ge 2 ] || fail "the patches have $(hues patches.png) hues"
}

# crops PNG WIDTH HEIGHT X Y ...: one line for each corner: the checksum of that part of the picture
crops() {
    PYTHONPATH="$ROOT/tests" python3 - "$@" <<'PY'
import sys, zlib
from page_driver import read_png
width, height, rows = read_png(open(sys.argv[1], "rb").read())
w, h, corners = int(sys.argv[2]), int(sys.argv[3]), [int(x) for x in sys.argv[4:]]
for x, y in zip(corners[::2], corners[1::2]):
    assert x + w <= width and y + h <= height
    print(zlib.crc32(b"".join(rows[y + j][3 * x:3 * (x + w)] for j in range(h))))
PY
}

@test "rows: a sequence each, the same frames below one another, drawn as in a sheet of its own" {
    poses cube 5
    must vg-encode pose1.obj pose2.obj pose3.obj pose4.obj pose5.obj -o five.vgs
    must vg-encode pose1.obj pose2.obj pose3.obj -o three.vgs
    must vg-view five.vgs --frames 3 --columns 3 --size 48x48 -o alone.png
    must vg-view five.vgs --beside five.vgs --beside three.vgs --frames 3 --size 48x48 -o rows.png
    must png rows.png
    [ "$output" = "$((16 + 3 * 64)) $((16 + 3 * (48 + 22 + 16 + 24)))" ]
    # three rows: that of the single sheet, again, and one that stays at its last frame: frames 0, 2, 2
    crops alone.png 48 70 16 16 80 16 144 16 >single
    crops rows.png 48 70 16 40 80 40 144 40 >first
    crops rows.png 48 70 16 150 80 150 144 150 >second
    crops rows.png 48 70 16 260 80 260 144 260 >third
    same_file single first
    same_file single second
    [ "$(sed -n 1p third)" = "$(sed -n 1p single)" ]
    [ "$(sed -n 2p third)" = "$(sed -n 2p single)" ]
    [ "$(sed -n 3p third)" = "$(sed -n 2p single)" ]
    [ "$(sort -u single | wc -l)" = 3 ]
    # in two blocks of two columns, the first row of each is that of the first sequence
    must vg-view five.vgs --beside three.vgs --frames 3 --columns 2 --size 48x48 -o blocks.png
    must png blocks.png
    [ "$output" = "144 $((16 + 4 * 110))" ]
    crops blocks.png 48 70 16 40 80 40 16 260 >blocks
    same_file single blocks
    must_fail 2 vg-view - --beside - -o out.png
    must_fail 4 vg-view five.vgs --beside missing.vgs -o out.png
    mesh tetra >tetra.obj
    must vg-view five.vgs --beside tetra.obj --size 40x40 -o other.png
}

@test "the heat of vg-diff looks as --against does, without the truth; one scale for all rows" {
    poses two 4
    mkdir truth off
    cp pose*.obj truth
    cp pose1.obj off/pose1.obj
    for i in 2 3 4; do mesh two "0.$i" "$i" >"off/pose$i.obj"; done
    must vg-view off --against truth --frames 4 --columns 4 --size 64x64 -o against.png
    pipe 'vg-diff truth off --heat - | vg-view --frames 4 --columns 4 --size 64x64 -o heat.png'
    crops against.png 64 110 16 16 96 16 176 16 256 16 >a
    crops heat.png 64 110 16 16 96 16 176 16 256 16 >b
    same_file a b
    # rows: the better one is darker than it would be alone, and the same as with --against for both
    mkdir near
    cp pose1.obj near
    for i in 2 3 4; do mesh two "0.0$i" "$((i - 1))" >"near/pose$i.obj"; done
    must vg-diff truth off --heat off.vgs -o report
    must vg-diff truth near --heat near.vgs -o report
    must vg-view off.vgs --beside near.vgs --size 64x64 -o rows.png
    must vg-view off --beside near --against truth --size 64x64 -o both.png
    crops rows.png 64 110 16 40 96 40 256 40 >a
    crops both.png 64 110 16 40 96 40 256 40 >b
    same_file a b
    must vg-view near.vgs --columns 4 --size 64x64 -o alone.png
    [ "$(crops alone.png 64 64 256 16)" != "$(crops rows.png 64 64 256 184)" ]
    must vg-view near.vgs --plain --columns 4 --size 64x64 -o plain.png
    must png plain.png
    [ "$output" = "336 118" ]
    [ "$(hues plain.png)" = 0 ] || fail "plain has $(hues plain.png) hues"
    # frames without numbers among those with them, or with others, have no colour to say so
    must vg-encode near.vgs truth -o mixed.vgs
    must_fail 3 vg-view mixed.vgs -o mixed.png
    says "has no 'error' to colour"
    must vg-diff -c truth off --heat centred.vgs -o report
    must_fail 3 vg-view off.vgs --beside centred.vgs -o mixed.png
    says "has 'centred error' in 'D'"
    must_fail 3 vg-view off --against truth --beside mixed.vgs -o mixed.png
    says "'mixed.vgs' has 8 frames where 'truth' has 4"
    [ ! -e mixed.png ]
}

@test "--scales: twice as long is the one end of the colours, half the other, as long as it was the middle" {
    mesh cube >one.obj
    awk '/^v/ { print "v", 2 * $2, 2 * $3, 2 * $4; next } { print }' one.obj >twice.obj
    awk '/^v/ { print "v", $2 / 2, $3 / 2, $4 / 2; next } { print }' one.obj >half.obj
    must vg-view one.obj twice.obj half.obj --scales --view front --columns 3 --size 96x96 -o scales.png
    PYTHONPATH="$ROOT/tests" must python3 - scales.png <<'END'
import sys
from page_driver import read_png
width, height, rows = read_png(open(sys.argv[1], "rb").read())
at = lambda x, y: rows[y][3 * x:3 * x + 3]
row = height - 74 + 27  # through the bar
bar = [at(x, row) for x in range(16, width - 16)]
low, high, middle = bar[0], bar[-1], [bar[len(bar) // 2], bar[len(bar) // 2 - 1]]
assert low[2] > 1.5 * low[0] and high[0] > 1.5 * high[2], (low, high)
# the square of each pose is in the middle of its picture, or from there to the right and up: the origin is its corner
found = [[at(x, y) for x in range(16 + 112 * i, 112 + 112 * i) for y in range(16, 112)] for i in range(3)]
as_middle = lambda p: all(abs(a - b) < 6 for a, b in zip(p, middle[0]))  # the bar has no pixel right there
assert sum(map(as_middle, found[0])) > 100 and high not in found[0] and low not in found[0]
assert found[1].count(high) > 2000 and low not in found[1]
assert found[2].count(low) > 100 and high not in found[2]
END
    must vg-view one.obj twice.obj --scales --scale 4 --view front --size 96x96 -o four.png
    must_fail 2 vg-view one.obj --scales --scale 0.5 -o four.png
}

@test "--silhouettes draws the contour, and nothing on a plain face; --zoom scales the figure" {
    mesh cube >cube.obj
    local name
    must vg-view cube.obj --view front --size 210x210 -o plain.png
    must vg-view cube.obj --view front --size 210x210 --silhouettes -o lines.png
    must vg-view cube.obj --view iso --size 210x210 --silhouettes -o iso.png
    must vg-view cube.obj --view front --size 210x210 --zoom 0.5 -o small.png
    PYTHONPATH="$ROOT/tests" must python3 - <<'END'
from page_driver import read_png
def load(name):
    rows = read_png(open(name, "rb").read())[2]
    return [[row[3 * x:3 * x + 3] for x in range(16, 226)] for row in rows[16:226]]
dark = lambda picture: [(x, y) for y, row in enumerate(picture) for x, p in enumerate(row) if max(p) < 60]
figure = lambda picture: sum(max(abs(a - b) for a, b in zip(p, row[0])) > 12 for row in picture for p in row)
plain, lines, iso, small = (load(n + ".png") for n in ("plain", "lines", "iso", "small"))
assert not dark(plain)
found = dark(lines)
assert len(found) >= 4 * 170 and all(min(abs(x - e) for e in (12, 197)) < 3 or min(abs(y - e) for e in (12, 197)) < 3
                                     for x, y in found), len(found)
assert not [p for p in dark(iso) if abs(p[0] - 105) < 30 and abs(p[1] - 105) < 30]  # edges between fronts are no contour
assert len(dark(iso)) > 120  # six sides, most of them slanted
assert abs(figure(plain) / figure(small) - 4) < 0.2, (figure(plain), figure(small))
END
}

# strip_of_numbers FILE NUMBER COUNT ...: a strip of 200 vertices, so many of which have each number
strip_of_numbers() {
    py "$@" <<'END'
import sys, make_corpus as m
numbers = [float(x) for x, n in zip(sys.argv[2::2], sys.argv[3::2]) for _ in range(int(n))]
points = [[i // 2 / 8, i % 2, 0] for i in range(200)]
faces = [[i, i + 2, i + 3, i + 1] for i in range(0, 198, 2)]
frame = dict(m.pose("p", points), scalars={"name": "load", "unit": "N", "numbers": numbers})
m.write(sys.argv[1], m.whole(m.content(mesh={"vertices": 200, "faces": faces}, count=200, frames=[frame],
                                       reference={"name": "rest", "positions": points})))
END
}

# same_pictures A B: above the legend
same_pictures() {
    py "$@" <<'END'
import struct, sys, zlib
def rows(name):
    data = open(name, "rb").read()
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        packed += data[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        width = struct.unpack(">I", data[16:20])[0]
        at += 12 + size
    return zlib.decompress(packed)[:(16 + 128) * (1 + 3 * width)]
assert rows(sys.argv[1]) == rows(sys.argv[2])
END
}

@test "colours end where 99 % are below, and of what is nearly all exact at the largest" {
    strip_of_numbers spread.vgs 0.01 185 0.09 14 0.7 1
    strip_of_numbers exact.vgs 0 199 0.7 1
    for name in spread exact; do
        must vg-view --size 128x128 $name.vgs -o $name.png
        must vg-view --size 128x128 --scale 0.1 $name.vgs -o $name-0.1.png
        must vg-view --size 128x128 --scale 0.8 $name.vgs -o $name-0.8.png
    done
    same_pictures spread.png spread-0.1.png
    same_pictures exact.png exact-0.8.png
    if same_pictures spread.png spread-0.8.png 2>/dev/null; then fail "the end of the colours makes no difference"; fi
    must vg-view spread.vgs -o spread.html
    grep -q '"scale":0.1,' spread.html
}

@test "an animation: a picture for each frame, side by side, at the times of the frames; --turn goes around" {
    mesh cube >one.obj
    awk '/^v/ { print "v", 2 * $2, 2 * $3, 2 * $4; next } { print }' one.obj >two.obj
    awk '/^v/ { print "v", $2 + 1, $3, $4; next } { print }' one.obj >three.obj
    must vg-view one.obj two.obj three.obj --size 64x48 -o plain.webp
    must vg-view one.obj two.obj three.obj --size 64x48 -j 2 -o again.webp
    same_file plain.webp again.webp
    must vg-view one.obj two.obj three.obj --beside two.obj --size 64x48 --turn 180 --format webp -o turned
    py <<'END'
import struct
import make_corpus as m

def parts(name):
    data, at, frames, canvas = open(name, "rb").read(), 12, [], None
    assert data[:4] == b"RIFF" and data[8:12] == b"WEBP" and struct.unpack("<I", data[4:8])[0] == len(data) - 8
    while at < len(data):
        tag, size = struct.unpack("<4sI", data[at:at + 8])
        if tag == b"VP8X":
            canvas = tuple(int.from_bytes(data[at + k:at + k + 3], "little") + 1 for k in (12, 15))
        if tag == b"ANMF":
            frames.append(int.from_bytes(data[at + 20:at + 23], "little"))
        at += 8 + size + size % 2
    return canvas, frames

assert parts("plain.webp") == ((64 + 32, 48), [41, 42, 41]), parts("plain.webp")  # 24 frames a second
assert parts("turned") == ((2 * 64 + 48, 48 + 22), [41, 42, 41]), parts("turned")
m.write("timed.vgs", m.whole(m.content(frames=[m.pose("p%d" % i, [[x + i for x in p] for p in m.POINTS[:4]], time=t)
                                               for i, t in enumerate((1, 1.5, 2.5))])))
END
    must vg-view timed.vgs --size 64x48 -o timed.webp
    py <<'END'
data = open("timed.webp", "rb").read()
at, frames = 12, []
while at < len(data):
    size = int.from_bytes(data[at + 4:at + 8], "little")
    if data[at:at + 4] == b"ANMF":
        frames.append(int.from_bytes(data[at + 20:at + 23], "little"))
    at += 8 + size + size % 2
assert frames == [500, 1000, 750], frames  # the last one as long as the mean of the others
END
    must_fail 2 vg-view one.obj -o none.webp --columns 2
    must_fail 2 vg-view one.obj -o none.png --turn 90
    must_fail 4 vg-view one.obj --format webp -o /dev/full
}

@test "--look-at: a vertex, a joint or a group is in the middle of each picture, whatever moves" {
    must vg-encode --take 0,9,18 "$DATA/trex-attack.tar.xz" -o trex.vgs
    must vg-decode -q -o rest-%d.obj trex.vgs
    # a red tag at one vertex: a triangle of its own group, far out of the body
    local i
    for i in 0 1 2; do
        awk -v i=$i '{print} END {x = 3 * i; for (k = 0; k < 3; k++) print "v", x + 40 + (k == 1), 10 * i + (k == 2), 0; print "g tag\nf -3 -2 -1"}' rest-$i.obj >tag-$i.obj
    done
    for i in 0 2; do
        must vg-encode --reference tag-0.obj tag-$i.obj -o one.vgs
        must vg-view --view front --size 201x201 --look-at tag --zoom 8 one.vgs -o tag-$i.png
        must vg-view --view front --size 201x201 --look-at 912 --zoom 8 one.vgs -o vertex-$i.png
    done
    PYTHONPATH="$ROOT/tests" must python3 - <<'END'
from page_driver import read_png
def drawn(name): # the pixels of the picture that are not its ground
    rows = [row[48:48 + 603] for row in read_png(open(name, "rb").read())[2][16:217]]
    return [(x, y) for y, row in enumerate(rows) for x in range(201) if max(abs(row[3 * x + k] - row[k]) for k in range(3)) > 25]
for i in (0, 2):
    for name in ("tag", "vertex"):
        at = drawn("%s-%d.png" % (name, i))
        assert 40 < len(at) < 4000, (name, i, len(at))
        x, y = [p[0] for p in at], [p[1] for p in at]
        # corners at (0, 0), (1, 0), (0, 1): their mean is a third of a side away from the first
        side, seen = (max(x) - min(x) + max(y) - min(y)) / 2, (100 - min(x), max(y) - 100)
        want = side / 3 if name == "tag" else 0
        assert abs(max(x) - min(x) - (max(y) - min(y))) < 3 and all(abs(s - want) < 2.5 for s in seen), (name, i, side, seen)
END
    xz -dc "$DATA/trex-attack.joints.txt.xz" >joints.txt
    must vg-encode --mesh "$DATA/trex.skeleton.txt" joints.txt -o bones.vgs
    must vg-view --look-at Head --frames 3 bones.vgs -o head.png
    must_fail 2 vg-view --look-at Nose --frames 3 bones.vgs -o nose.png
    says "there is no joint, object, group or material 'Nose'"
    must_fail 2 vg-view --look-at 99999 tag-0.obj -o far.png
    says 'there is no vertex 99999: it has 915'
    must_fail 2 vg-view --look-at 1 tag-0.obj -o page.html
    says "'--look-at' applies to a sheet"
    must_fail 2 vg-view --look-at 1 --fit path tag-0.obj -o p.png
}
