#!/usr/bin/env bats
# Files that somebody reported as read wrongly or refused, or of which a public collection holds some: each stands for its
# whole kind. What must come out was worked out by hand, by another reader (three.js for glTF), or from the format's text.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

reports() {
    cp "$DATA"/reports/* .
}

# geometry FILE: its vertices and faces as text, one element a line
geometry() {
    pipe "vg-encode -q '$1' | vg-decode --format ply-ascii -q -o - | sed '1,/end_header/d'"
}

@test "NaN and infinity as Windows writes them are refused with their line, not read as -1" {
    reports
    must_fail 3 vg-encode nan_ind.obj -o out.vgs
    one_line
    says "'nan_ind.obj' line 1" "-1.#IND00"
    must_fail 3 vg-encode ind.skeleton.txt -o out.vgs
    one_line
    says "'ind.skeleton.txt' line 1" "-1.#IND00"
    printf '0 hips 0 1.#INF 0\n' >a.joints.txt
    printf 'hips - 0 0 0 0 1 0\n' >a.skeleton.txt
    must_fail 3 vg-encode --mesh a.skeleton.txt a.joints.txt -o out.vgs
    says "line 1" "1.#INF"
    printf '1 2#3\n' >a.markers.txt
    mesh cube >cube.obj
    must_fail 3 vg-register cube.obj cube.obj --markers a.markers.txt -o out.vgs
    says "line 1" "2#3"
}

@test "a face with a hole is cut into faces of the same area; degenerate faces are left out and counted" {
    reports
    must_warn vg-encode keyhole.obj -o out.vgs
    one_line
    says "'keyhole.obj': cut 1 face that names a vertex twice (around a hole) into 4"
    must vg-decode -o cut.obj out.vgs
    py <<'EOF'
v, area = [], 0
for line in open('cut.obj'):
    w = line.split()
    if w and w[0] == 'v': v.append([float(x) for x in w[1:]])
    if w and w[0] == 'f':
        at = [int(x) - 1 for x in w[1:]]
        assert len(set(at)) == len(at)
        area += sum(v[a][0] * v[b][1] - v[b][0] * v[a][1] for a, b in zip(at, at[1:] + at[:1])) / 2
assert abs(area - 12) < 1e-12, area
EOF
    must_warn vg-encode dupcorner.obj -o out.vgs
    one_line
    says "'dupcorner.obj': left out 1 face"
    must_warn vg-encode face01.ply -o out.vgs
    says "'face01.ply': left out 2 faces"
    geometry face01.ply
    shows "4 0 1 2 3"
}

@test "what is not used cannot stop a load: normals, texture, trailing bytes, lines" {
    reports
    must_warn vg-encode nan_vt.obj -o out.vgs
    says "left out 1 texture coordinates"
    must vg-decode -o back.obj out.vgs
    grep -qx 'f 1/1 2 3/2' back.obj || fail "the wrong texture coordinate was left out" "$(cat back.obj)"
    must_warn vg-encode bin_extra.stl -o out.vgs
    says "left out 7 bytes behind the last triangle"
    geometry multiline_face.off
    [ "$(tail -1 <<<"$output")" = "4 0 1 2 3" ] || fail "$output"
    geometry tristrips.ply
    [ "$(tail -2 <<<"$output")" = $'3 0 1 3\n3 1 2 3' ] || fail "$output"
}

@test "BVH: more rows, wrong rows, no motion, scales, EndSite" {
    reports
    must_warn vg-encode frames_more.bvh -o out.vgs
    one_line
    says "it announces 1 frames and holds 2, which are read"
    pipe 'vg-info out.vgs'
    shows 'frames     2'
    must vg-encode nomotion.bvh -o still.vgs
    geometry nomotion.bvh
    shows $'0 0 0\n0 1 0\n0 2 0'
    # a skeleton at rest is one to carry a motion to
    pipe 'vg-encode -q frames_more.bvh | vg-deform --onto nomotion.bvh | vg-solve | vg-info'
    shows 'frames     2'
    # one value too few in a row, one too many in the next: nothing is shifted
    head -n 18 frames_more.bvh | sed 's/Frames: 1/Frames: 2/' >shifted.bvh
    printf '0 0 0 0 0 0 0 0\n1 2 3 10 20 30 40 50 60 70\n' >>shifted.bvh
    must_fail 3 vg-encode shifted.bvh -o out.vgs
    one_line
    says "'shifted.bvh' line 19: a row of 8 values, and the channels are 9"
    head -n 19 frames_more.bvh >long.bvh
    printf '1 2 3 10 20 30 40 50 60 70\n' >>long.bvh
    must_fail 3 vg-encode long.bvh -o out.vgs
    says "'long.bvh' line 20: a row of 10 values"
    cat >scales.bvh <<'EOF'
HIERARCHY
ROOT Hips
{
OFFSET 0 0 0
CHANNELS 9 Xposition Yposition Zposition Zrotation Xrotation Yrotation Xscale Yscale Zscale
EndSite
{
OFFSET 0 1 0
}
}
MOTION
Frames: 1
Frame Time: 1
1 2 3 90 0 0 5 5 5
EOF
    must_warn vg-encode scales.bvh -o scales.vgs
    says "left out the scales of 1 joints"
    must vg-decode -q --format ply-ascii -o scales.ply scales.vgs
    py <<'EOF'
x = [[float(w) for w in l.split()] for l in open('scales.ply').read().split('end_header\n')[1].splitlines()[:2]]
assert max(abs(p - q) for p, q in zip(x[0] + x[1], [1, 2, 3, 0, 2, 3])) < 1e-6, x
EOF
    iconv -f utf-8 -t utf-16le nomotion.bvh | { printf '\xff\xfe'; cat; } >wide.bvh
    geometry wide.bvh
    shows $'0 0 0\n0 1 0\n0 2 0'
}

@test "NPZ: positions and faces under the names that people use, axes in any order, and what is there" {
    reports
    pipe 'vg-encode verts_faces.npz | vg-info'
    shows 'frames     3' 'vertices    5' 'faces       3'
    cat >make.py <<'EOF'
import struct, zipfile
def npz(name, **arrays):
    with zipfile.ZipFile(name + '.npz', 'w') as z:
        for key, (descr, shape, data) in arrays.items():
            head = repr({'descr': descr, 'fortran_order': False, 'shape': shape}).encode()
            z.writestr(key + '.npy', b'\x93NUMPY\1\0' + struct.pack('<H', len(head)) + head + data)
def doubles(*x): return struct.pack('<%dd' % len(x), *x)
square = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]
quad = ('<i4', (1, 4), struct.pack('<4i', 0, 1, 2, 3))
two = [square, [x + 10 for x in square]]
value = lambda f, v, k: two[f][3 * v + k]
npz('v', v=('<f8', (4, 3), doubles(*square)), f=quad)
npz('points', points=('<f8', (4, 3), doubles(*square)), triangles=('<i4', (2, 3), struct.pack('<6i', 0, 1, 2, 0, 2, 2)))
npz('own', positions=('<f8', (4, 3), doubles(*square)), verts=('<f8', (1, 3), doubles(9, 9, 9)), faces=quad)
npz('vxf', vertices=('<f8', (4, 3, 2), doubles(*[value(f, v, k) for v in range(4) for k in range(3) for f in range(2)])), faces=quad)
npz('vfx', vertices=('<f8', (4, 2, 3), doubles(*[value(f, v, k) for v in range(4) for f in range(2) for k in range(3)])), faces=quad)
npz('xvf', vertices=('<f8', (3, 4, 2), doubles(*[value(f, v, k) for k in range(3) for v in range(4) for f in range(2)])), faces=quad)
npz('unclear', vertices=('<f8', (4, 3, 2), doubles(*range(24))))
npz('smpl', poses=('<f8', (2, 72), bytes(8 * 144)), betas=('<f8', (10,), bytes(80)), trans=('<f8', (2, 3), bytes(48)))
npz('other', weights=('<f8', (2, 5), bytes(80)), labels=('<i8', (), bytes(8)))
EOF
    must python3 make.py
    local name
    for name in v own; do
        geometry $name.npz
        [ "$output" = $'0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3' ] || fail "$name: $output"
    done
    must_warn vg-encode points.npz -o out.vgs
    says "left out 1 face"
    for name in vxf vfx xvf; do
        pipe "vg-encode $name.npz | vg-decode -q --format npy --no-mesh -o - | tail -c 96 | od -An -v -w12 -t f4 | tr -s ' '"
        [ "$output" = $' 0 0 0\n 1 0 0\n 1 1 0\n 0 1 0\n 10 10 10\n 11 10 10\n 11 11 10\n 10 11 10' ] || fail "$name: $output"
    done
    must_fail 3 vg-encode unclear.npz -o out.vgs
    one_line
    says "'vertices'" "cannot be told apart" "--array-axes"
    must vg-encode --array-axes vxf unclear.npz -o out.vgs
    pipe 'vg-info out.vgs'
    shows 'frames     2' 'vertices    4'
    must_fail 2 vg-encode --array-axes vxx unclear.npz -o out.vgs
    must_fail 3 vg-encode smpl.npz -o out.vgs
    one_line
    says "SMPL" "betas (10), poses (2, 72), trans (2, 3)"
    must_fail 3 vg-encode other.npz -o out.vgs
    says "it has: labels (), weights (2, 5)"
}

@test "a compressed stream opens like an archive, and must be whole" {
    poses cube 3
    must vg-encode pose1.obj pose2.obj pose3.obj -o walk.vgs
    local kind
    for kind in gz xz zst; do
        case $kind in
        gz) gzip -k walk.vgs ;;
        xz) xz -k walk.vgs ;;
        zst) zstd -q walk.vgs ;;
        esac
        must vg-diff -t 0 walk.vgs walk.vgs.$kind
        pipe "vg-info --digest walk.vgs.$kind"
        [ "$output" = "$(vg-info --digest walk.vgs)" ] || fail "$kind"
        pipe "cat walk.vgs.$kind | vg-info --digest -"
        [ "$output" = "$(vg-info --digest walk.vgs)" ] || fail "$kind from a pipe"
        pipe "vg-info --digest - <walk.vgs.$kind"
        [ "$output" = "$(vg-info --digest walk.vgs)" ] || fail "$kind from a file on standard input"
        head -c 300 walk.vgs.$kind >cut.vgs.$kind
        must_fail 3 vg-info cut.vgs.$kind
    done
    must vg-deform --onto walk.vgs.gz walk.vgs.xz -o out.vgs
    # compressed poses are still poses
    xz -k pose1.obj
    pipe 'vg-encode pose1.obj.xz | vg-info'
    shows 'frames     1'
}
