#!/usr/bin/env bats
# Further files of the kinds in reports.bats, two or more of each: what readers take, what they leave out and say, what they refuse.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# geometry FILE [OPTION...]: its vertices and faces as text, one element a line
geometry() {
    capture vg-encode -q "$@" -o geometry.vgs || return 1
    [ "$status" = 0 ] || fail "$*" "$stderr" || return 1
    pipe "vg-decode -q --format ply-ascii -o - geometry.vgs | sed '1,/end_header/d'"
}

# ply_ascii ELEMENTS...: the header of a PLY of $1 vertices, and then the other lines
ply_ascii() {
    printf '%s\n' ply 'format ascii 1.0' "element vertex $1" 'property float x' 'property float y' 'property float z' "${@:2}"
}

@test "numbers that are none: each text format names the line or the vertex" {
    printf 'OFF\n3 1 0\n0 0 0\n1 0 1.#QNAN\n1 1 0\n3 0 1 2\n' >q.off
    must_fail 3 vg-encode q.off -o out.vgs
    one_line
    says "'q.off' line 4" "1.#QNAN"
    ply_ascii 3 'element face 1' 'property list uchar int vertex_indices' end_header '0 0 0' '1 0 -1.#IND00' '1 1 0' '3 0 1 2' >q.ply
    must_fail 3 vg-encode q.ply -o out.vgs
    says "-1.#IND00" "vertex 1"
    printf 'solid a\nfacet normal 0 0 1.#QNAN\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n' >q.stl
    geometry q.stl
    shows '3 0 1 2'
    sed 's/vertex 0 1 0/vertex 0 1.#INF 0/' q.stl >inf.stl
    must_fail 3 vg-encode inf.stl -o out.vgs
    says "'inf.stl', line 6" "1.#INF"
    printf 'HIERARCHY\nROOT Hips\n{\nOFFSET 0 1.#INF 0\nCHANNELS 0\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n' >q.bvh
    must_fail 3 vg-encode q.bvh -o out.vgs
    says "'q.bvh' line 4" "1.#INF"
}

@test "normals and texture coordinates that are no numbers lose only themselves" {
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1.#QNAN\nvn 0 0 1\nf 1//1 2//2 3//1\n' >normal.obj
    must vg-encode normal.obj -o out.vgs
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 1.#INF 0\nvt nan nan\nvt 0.5 inf\nvt 1 1\nf 1/1 2/4 3/2\n' >texture.obj
    must_warn vg-encode texture.obj -o out.vgs
    one_line
    says "left out 3 texture coordinates"
    must vg-decode -o back.obj out.vgs
    grep -qx 'f 1 2/1 3' back.obj || fail "$(cat back.obj)"
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/2 3/9\n' >beyond.obj
    must_warn vg-encode beyond.obj -o out.vgs
    says "2 corners name texture coordinates that are not there"
}

@test "holes: two in one face, tilted, with texture coordinates, in every format that has polygons" {
    py <<'EOF'
square = [(0, 0), (10, 0), (10, 10), (0, 10)]
one, two = [(1, 1), (1, 3), (3, 3), (3, 1)], [(5, 5), (5, 8), (8, 8), (8, 5)]
at = square + one + two
face = [0, 1, 2, 10, 11, 8, 9, 10, 2, 3, 0, 4, 5, 6, 7, 4]
rows = ''.join('%d %d %g\n' % (x, y, x / 2) for x, y in at)
words = '%d %s\n' % (len(face), ' '.join(map(str, face)))
open('holes.off', 'w').write('OFF\n%d 1 0\n' % len(at) + rows + words)
open('holes.ply', 'w').write('ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n'
    'element face 1\nproperty list uchar int vertex_indices\nend_header\n' % len(at) + rows + words)
open('holes.obj', 'w').write(''.join('v ' + r + '\n' for r in rows.splitlines()) + ''.join('vt %g %g\n' % (x / 10, y / 10) for x, y in at) +
    'f ' + ' '.join('%d/%d' % (v + 1, v + 1) for v in face) + '\n')
EOF
    local name
    for name in off ply obj; do
        must_warn vg-encode holes.$name -o out.vgs
        one_line
        says "'holes.$name': cut 1 face that names a vertex twice (around a hole) into 10"
        must vg-decode -q -o holes.$name.obj out.vgs
    done
    py <<'EOF'
for name in 'off', 'ply', 'obj':
    v, t, area = [], [], 0
    for line in open('holes.%s.obj' % name):
        w = line.split()
        if w[:1] == ['v']: v.append([float(x) for x in w[1:]])
        if w[:1] == ['vt']: t.append([float(x) for x in w[1:]])
        if w[:1] != ['f']: continue
        corners = [[int(x) - 1 for x in c.split('/')] for c in w[1:]]
        ring = [c[0] for c in corners]
        assert len(set(ring)) == len(ring)
        area += sum(v[a][0] * v[b][1] - v[b][0] * v[a][1] for a, b in zip(ring, ring[1:] + ring[:1])) / 2
        for c in corners if name == 'obj' else []:
            assert max(abs(v[c[0]][k] / 10 - t[c[1]][k]) for k in (0, 1)) < 1e-6
    assert abs(area - (100 - 4 - 9)) < 1e-9, (name, area)
EOF
}

@test "degenerate faces: the same count, and the same faces, in every format" {
    printf 'OFF\n4 5 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0\n1 2\n3 0 0 1\n3 0 1 2\n4 0 1 1 2\n' >d.off
    ply_ascii 4 'element face 5' 'property list uchar int vertex_indices' end_header '0 0 0' '1 0 0' '1 1 0' '0 1 0' 0 '1 2' '3 0 0 1' '3 0 1 2' '4 0 1 1 2' >d.ply
    printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf\nf 3\nf 1 1 2\nf 1 2 3\nf 1 2 2 3\n' >d.obj
    py <<'EOF'
import struct, zipfile
def array(descr, shape, data):
    head = repr({'descr': descr, 'fortran_order': False, 'shape': shape}).encode()
    return b'\x93NUMPY\1\0' + struct.pack('<H', len(head)) + head + data
with zipfile.ZipFile('d.npz', 'w') as z:
    z.writestr('V.npy', array('<f8', (4, 3), struct.pack('<12d', 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0)))
    z.writestr('F.npy', array('<i8', (5, 4), struct.pack('<20q', 0, 0, 0, 0, 2, 2, 2, 2, 0, 0, 1, 1, 0, 1, 2, 2, 0, 1, 1, 2)))
EOF
    local name
    for name in off ply obj npz; do
        must_warn vg-encode d.$name -o out.vgs
        one_line
        says "left out 3 faces that name a vertex twice or have fewer than 2 corners" "twice in a row, which is kept once"
        geometry d.$name
        [ "$output" = $'0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 1 2' ] || fail "$name: $output"
    done
}

@test "OFF is words: on one line, without the keyword, with comments and colours" {
    local quad=$'0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3'
    printf 'OFF 4 1 0 0 0 0 1 0 0 1 1 0 0 1 0 4 0 1 2 3' >line.off
    printf 'OFF4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n' >glued.off
    printf '# by hand\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n' >bare.off
    printf '# by hand\nOFF # words\n4 1 0\n0 0 0 1 0 0 1 1 0 0 1 0\n4 0 1 2 3 255 0 0\n' >face-colour.off
    printf 'COFF\n4 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n1 1 0 1 0 0 1\n0 1 0 1 0 0 1\n4 0 1 2 3\n' >vertex-colour.off
    local name
    for name in line glued bare; do
        must vg-encode $name.off -o out.vgs
        geometry $name.off
        [ "$output" = "$quad" ] || fail "$name: $output"
    done
    must_warn vg-encode face-colour.off -o out.vgs
    says "left out the colours of 1 faces"
    geometry face-colour.off
    [ "$output" = "$quad" ] || fail "$output"
    must vg-encode vertex-colour.off -o out.vgs
    geometry vertex-colour.off
    [ "$output" = $'0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 255 0 0\n0 1 0 255 0 0\n4 0 1 2 3' ] || fail "$output"
    printf 'OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n4 0 1 2 3\n' >missing.off
    must_fail 3 vg-encode missing.off -o out.vgs
    one_line
}

@test "PLY: strips that begin anew, that are binary; lists of every count type; old headers" {
    ply_ascii 6 'element tristrips 1' 'property list int int vertex_indices' end_header \
        '0 0 0' '1 0 0' '0 1 0' '1 1 0' '0 2 0' '1 2 0' '9 0 1 2 3 -1 2 3 4 5' >anew.ply
    geometry anew.ply
    [ "$(tail -4 <<<"$output")" = $'3 0 1 2\n3 2 1 3\n3 2 3 4\n3 4 3 5' ] || fail "$output"
    py <<'EOF'
import struct
head = '''ply
format binary_big_endian 1.0
element vertex 5
property float x
property float y
property float z
element tristrips 1
property list int int vertex_index
end_header
'''
# a vertex twice in a strip turns it: the triangles between are none
open('big.ply', 'wb').write(head.encode() + struct.pack('>15f', *range(15)) + struct.pack('>7i', 6, 0, 1, 2, 2, 3, 4))
EOF
    geometry big.ply
    [ "$(tail -2 <<<"$output")" = $'3 0 1 2\n3 3 2 4' ] || fail "$output"
    local type
    for type in char uchar short ushort int uint float double int8 uint8 int16 uint16 int32 uint32 float32 float64; do
        ply_ascii 3 'element face 1' "property list $type int vertex_indices" end_header '0 0 0' '1 0 0' '1 1 0' '3 0 1 2' >type.ply
        geometry type.ply
        [ "$(tail -1 <<<"$output")" = '3 0 1 2' ] || fail "$type: $output"
    done
    printf '%s\r\n' ply 'format ascii 1.0' 'comment Created by Blender' 'element vertex 3' 'property float x' 'property float y' 'property float z' \
        'property float nx' 'property float ny' 'property float nz' 'property float s' 'property float t' 'property uchar red' \
        'property uchar green' 'property uchar blue' 'element face 1' 'property list uchar uint vertex_indices' end_header \
        '0 0 0 0 0 1 0 0 255 0 0' '1 0 0 0 0 1 1 0 255 0 0' '0 1 0 0 0 1 0 1 255 0 0' '3 0 1 2' >blender.ply
    geometry blender.ply
    [ "$output" = $'0 0 0 255 0 0\n1 0 0 255 0 0\n0 1 0 255 0 0\n3 0 1 2' ] || fail "$output"
    ply_ascii 3 'property uchar red' 'property float green' 'property ushort blue' 'element face 1' \
        'property list uchar int vertex_indices' end_header '0 0 0 300 0.5 65535' '1 0 0 red nan 0' '1 1 0 7 -1 257' '3 0 1 2' >channels.ply
    must_warn vg-encode channels.ply -o out.vgs
    one_line
    says "4 channels of colours are out of their range"
    must vg-decode out.vgs -o out.obj
    [ "$(grep '^v ' out.obj)" = $'v 0 0 0 1 0.5019608 1\nv 1 0 0 0 0 0\nv 1 1 0 0.02745098 0 0.003921569' ] || fail "$(cat out.obj)"
    ply_ascii 3 'property uchar red' 'property uchar blue' 'element face 1' 'property list uchar int vertex_indices' end_header \
        '0 0 0 1 2' '1 0 0 1 2' '1 1 0 1 2' '3 0 1 2' >two.ply
    must_warn vg-encode two.ply -o out.vgs
    says "left out colours of vertices without red, green and blue"
}

@test "OBJ: colours behind the coordinates of vertices are kept, a bad one loses itself, a fourth coordinate is passed over" {
    printf 'v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 1 0\nf 1 2 3\n' >colours.obj
    must vg-encode colours.obj -o out.vgs
    must vg-decode out.vgs -o out.obj
    cmp colours.obj out.obj
    printf 'v 0 0 0 1 0 nan\nv 1 0 0 1 0 0\nv 0 1 0 0 255 0\nv 0 1 1 0 0 0 0 0\nf 1 2 3 4\n' >bad.obj
    must_warn vg-encode bad.obj -o out.vgs
    one_line
    says "left out 3 colours of vertices that are not numbers from 0 to 1"
    must vg-decode out.vgs -o out.obj
    [ "$(grep '^v ' out.obj)" = $'v 0 0 0 1 1 1\nv 1 0 0 1 0 0\nv 0 1 0 1 1 1\nv 0 1 1 1 1 1' ] || fail "$(cat out.obj)"
    printf 'v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n' >weights.obj
    must vg-encode weights.obj -o out.vgs
}

@test "STL: text behind the last solid, several solids, less and more than a triangle behind the last" {
    solid() {
        printf 'solid %s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 %s\nvertex 1 0 %s\nvertex 0 1 %s\nendloop\nendfacet\nendsolid %s\n' "$1" "$2" "$2" "$2" "$1"
    }
    { solid a 0; solid b 1; printf '\nwritten by hand\n'; } >text.stl
    must_warn vg-encode text.stl -o out.vgs
    one_line
    says "left out data after the last solid, from line 20 on"
    geometry text.stl
    [ "$(tail -2 <<<"$output")" = $'3 0 1 2\n3 3 4 5' ] || fail "$output"
    cp "$DATA"/reports/bin_extra.stl more.stl
    head -c 60 /dev/zero >>more.stl
    must_warn vg-encode more.stl -o out.vgs
    says "left out 67 bytes after the last triangle"
    head -c 100 more.stl >cut.stl
    must_fail 3 vg-encode cut.stl -o out.vgs
}

@test "STL: colours as VisCAM and Materialise keep them, in the attribute bytes, are left out with a word, whatever the size" {
    py <<'END'
import struct
def stl(name, n, attribute, head=b""):
    rows = [struct.pack("<12fH", 0, 0, 1, i, 0, 0, i + 1, 0, 0, i, 1, 0, attribute(i)) for i in range(n)]
    open(name, "wb").write(head.ljust(80, b" ") + struct.pack("<I", n) + b"".join(rows))
stl("viscam.stl", 3, lambda i: 0x8000 | 31 << 10 if i else 0)
stl("large.stl", 5000, lambda i: 0x8000 | i)
stl("materialise.stl", 5000, lambda i: i, b"solid COLOR=\x10\x20\x30\xff,MATERIAL=")
stl("plain.stl", 5000, lambda i: 0)
END
    must_warn vg-encode viscam.stl -o out.vgs
    one_line
    says "'viscam.stl': left out the attribute bytes of 2 triangles, which may be colours"
    geometry plain.stl
    local truth=$output name
    for name in large:5000 materialise:4999; do
        capture vg-encode - -o out.vgs <${name%:*}.stl # known by its content, of which the beginning is seen
        [ "$status" = 0 ] || fail "$stderr"
        says "left out the attribute bytes of ${name#*:} triangles"
        geometry ${name%:*}.stl
        [ "$output" = "$truth" ] || fail "other triangles"
    done
}

@test "BVH: blank lines between rows, no announced frame, fewer rows, no motion, marks and line ends" {
    cp "$DATA"/reports/*.bvh .
    { cat frames_more.bvh; printf '\n\n1 2 3 1 1 1 1 1 1\n\n'; } >blank.bvh
    must_warn vg-encode blank.bvh -o out.vgs
    says "it announces 1 frames but holds 3, which are read"
    sed 's/Frames: 1/Frames: 0/' frames_more.bvh >none.bvh
    must_warn vg-encode none.bvh -o out.vgs
    says "it announces 0 frames but holds 2, which are read"
    sed 's/Frames: 1/Frames: 5/' frames_more.bvh >fewer.bvh
    must_fail 3 vg-encode fewer.bvh -o out.vgs
    one_line
    says "'fewer.bvh' ends in frame 2 of 5"
    { cat frames_more.bvh; echo '1 2 3'; } >part.bvh
    must_fail 3 vg-encode part.bvh -o out.vgs
    says "'part.bvh' line 21: row 3 has 3 values"
    # two rows on one line, one row on two lines; but all rows may be on two lines each
    local head
    head=$(sed '/^Frame Time/q; s/Frames: 1/Frames: 4/' frames_more.bvh)
    printf '%s\n' "$head" '1 2 3 4 5 6 7 8 9' '1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9' '1 2 3 4 5 6 7 8 9' >two.bvh
    must_fail 3 vg-encode two.bvh -o out.vgs
    says "'two.bvh' line 20: row 2 has 18 values, but there are 9 channels"
    printf '%s\n' "$head" '1 2 3 4 5 6 7 8 9' '1 2 3 4 5 6 7' '8 9' '1 2 3 4 5 6 7 8 9' '1 2 3 4 5 6 7 8 9' >half.bvh
    must_fail 3 vg-encode half.bvh -o out.vgs
    says "'half.bvh' line 20: row 2 has 7 values, but there are 9 channels"
    printf '%s\n' "$head" '1 2 3 4 5 6 7' '8 9' '1 2 3 4 5 6 7 8 9' '1 2 3 4 5 6 7 8 9' '1 2 3 4 5 6 7 8 9' >half.bvh
    must_fail 3 vg-encode half.bvh -o out.vgs
    says "'half.bvh' line 19: row 1 has 7 values, but there are 9 channels"
    { printf '%s\n' "$head"; for i in 1 2 3 4; do printf '%s\n' '1 2 3 4 5 6 7' '8 9'; done; } >halves.bvh
    must vg-encode halves.bvh -o out.vgs
    pipe 'vg-info out.vgs'
    shows 'frames     4'
    # no motion: a skeleton with a branch, and one in small letters with a mark and Windows' line ends
    printf 'HIERARCHY\nROOT a\n{\nOFFSET 1 2 3\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT b\n{\nOFFSET 0 1 0\nCHANNELS 0\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\nJOINT c\n{\nOFFSET 1 0 0\nCHANNELS 0\nEndSite\n{\nOFFSET 1 0 0\n}\n}\n}\n' >branch.bvh
    geometry branch.bvh
    [ "$(head -5 <<<"$output" | tr '\n' ,)" = '1 2 3,1 3 3,1 4 3,2 2 3,3 2 3,' ] || fail "$output"
    { printf '\357\273\277'; sed 's/$/\r/; s/ROOT/root/; s/OFFSET/Offset/; s/CHANNELS/Channels/' branch.bvh; } >marked.bvh
    local truth=$output
    geometry marked.bvh
    [ "$output" = "$truth" ] || fail "$output"
    pipe 'vg-encode -q frames_more.bvh | vg-deform --onto nomotion.bvh | vg-solve | vg-info'
    shows 'frames     2'
}

@test "BVH: positions of joints that are no roots replace their OFFSETs, or are added to them: the first row tells" {
    local plain='3 Zrotation Xrotation Yrotation' full='6 Xposition Yposition Zposition Zrotation Xrotation Yrotation'
    arm() { # CHANNELS ROW...: two bones
        printf 'HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS %s\nJOINT b\n{\nOFFSET 0 4 0\nCHANNELS %s\nJOINT c\n{\nOFFSET 0 3 1\nCHANNELS %s\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n}\n}\nMOTION\nFrames: %d\nFrame Time: 1\n' \
            "$full" "$1" "$1" $(($# - 1))
        printf '%s\n' "${@:2}"
    }
    arm "$plain" '1 2 3 10 20 30 40 50 60 5 6 7' '1 2 3 0 0 0 0 90 0 0 0 0' >truth.bvh
    must vg-encode truth.bvh -o truth.vgs
    # as Blender writes them
    arm "$full" '1 2 3 10 20 30 0 4 0 40 50 60 0 3 1 5 6 7' '1 2 3 0 0 0 0 4 0 0 90 0 0 3 1 0 0 0' >replaced.bvh
    must vg-encode replaced.bvh -o out.vgs
    must vg-diff -t 1e-12 truth.vgs out.vgs
    # as MakeHuman's poses have them
    arm "$full" '1 2 3 10 20 30 0 0 0 40 50 60 0 0 0 5 6 7' '1 2 3 0 0 0 0 0 0 0 90 0 0 0 0 0 0 0' >added.bvh
    must_warn vg-encode added.bvh -o out.vgs
    one_line
    says "'added.bvh': positions of joints are near 0, not near their OFFSETs: they are added to them"
    must vg-diff -t 1e-12 truth.vgs out.vgs
    # and what moves a joint stays
    arm "$full" '1 2 3 0 0 0 0 .5 0 0 0 0 0 0 0 0 0 0' >moved.bvh
    must_warn vg-encode moved.bvh -o out.vgs
    pipe 'vg-decode -q --format ply-ascii -o - out.vgs | sed "1,/end_header/d" | head -4 | tr "\n" ,'
    [ "$output" = '1 2 3,1 6.5 3,1 9.5 4,1 10.5 4,' ] || fail "$output"
    # written again, they replace
    must vg-decode -q -o again.bvh out.vgs
    must vg-encode again.bvh -o again.vgs
    must vg-diff -t 1e-6 out.vgs again.vgs
}

@test "text with the marks of UTF-8 and UTF-16, joined lines, tabs, every line end" {
    local triangle=$'0 0 0\n1 0 0\n0 1 0\n3 0 1 2' name
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >plain.obj
    printf 'OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n' >plain.off
    ply_ascii 3 'element face 1' 'property list uchar int vertex_indices' end_header '0 0 0' '1 0 0' '0 1 0' '3 0 1 2' >plain.ply
    for name in obj off ply; do
        { printf '\377\376'; iconv -f utf-8 -t utf-16le plain.$name; } >little.$name
        { printf '\376\377'; iconv -f utf-8 -t utf-16be plain.$name; } >big.$name
        { printf '\357\273\277'; cat plain.$name; } >marked.$name
        tr '\n' '\r' <plain.$name >old.$name
        local kind
        for kind in little big marked old; do
            geometry $kind.$name
            [ "$output" = "$triangle" ] || fail "$kind.$name: $output"
        done
    done
    printf '\tv  0\t0 0  \n  v 1 \\  \r\n0 0\r\nv 0 1 0\n\tf\t1  2 \\\n3 \n' >joined.obj
    geometry joined.obj
    [ "$output" = "$triangle" ] || fail "$output"
}

@test "files with negative numbers sort as numbers, whatever stands before the number" {
    local separator i
    for separator in '' _ . ' '; do
        mkdir "d$separator"
        for i in -10 -2 -1 0 1 2 10; do printf 'v %s 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' "$i" >"d$separator/${separator:+pose}$separator$i.obj"; done
        pipe "vg-encode 'd$separator' | vg-decode -q --format npy --no-mesh -o - | tail -c 252 | od -An -v -w36 -t f4 | awk '{print \$1}' | tr '\n' ' '"
        [ "$output" = '-10 -2 -1 0 1 2 10 ' ] || fail "'$separator': $output"
    done
    mkdir dash
    for i in 1 2 10; do printf 'v %s 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' "$i" >dash/pose-$i.obj; done
    pipe "vg-encode dash | vg-info --frames | awk 'NR > 1 {print \$2}' | tr '\n' ' '"
    [ "$output" = 'pose-1 pose-2 pose-10 ' ] || fail "$output"
}

@test "an OBJ with an object for each frame offers itself, and is a sequence with --objects frames" {
    py <<'EOF'
def write(name, objects, face='%d/%d %d/%d %d/%d'):
    with open(name, 'w') as f:
        for k, o in enumerate(objects):
            f.write('o %s\n' % o + ''.join('v %g %g %g\n' % p for p in [(0, 0, k), (1, 0, k), (0, 1, k)]) + 'vt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\n')
            f.write('f ' + face % tuple(i for j in (1, 2, 3) for i in (3 * k + j, 3 * k + j)) + '\n')
write('walk.obj', ['frame_%03d' % i for i in (8, 9, 10)])
write('parts.obj', ['Head', 'Teeth', 'Body'])
open('other.obj', 'w').write(open('walk.obj').read() + 'v 0 0 0\n')
EOF
    must_warn vg-encode walk.obj -o out.vgs
    one_line
    says "'walk.obj': its 3 objects are of one topology: --objects frames reads them as a sequence"
    pipe 'vg-info out.vgs'
    shows 'frames     1' 'components           3'
    must vg-encode parts.obj -o out.vgs
    must vg-encode --objects frames walk.obj -o out.vgs
    pipe 'vg-info out.vgs'
    shows "frames     3: 'frame_008' to 'frame_010'" 'a frame    3 vertices'
    must vg-decode -o out/ out.vgs
    [ "$(cat out/frame_009.obj)" = $'v 0 0 1\nv 1 0 1\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3' ] || fail "$(cat out/frame_009.obj)"
    must_fail 3 vg-encode --objects frames other.obj -o no.vgs
    one_line
    says "'other.obj' is not a sequence of objects"
    # in an archive, from a pipe, and with degenerate faces, which are counted once
    tar cf walk.tar walk.obj
    pipe 'vg-encode --objects frames walk.tar | vg-info --digest'
    [ "$output" = "$(vg-info --digest out.vgs)" ] || fail "an archive"
    pipe 'vg-encode --objects frames - <walk.obj | vg-info'
    shows 'frames     3'
    sed 's/^f \([^ ]*\) [^ ]* /f \1 \1 /' walk.obj >flat.obj
    sed 's/^usemtl skin$/f -3 -2 -1/' flat.obj >twice.obj
    must_warn vg-encode --objects frames twice.obj -o out.vgs
    one_line
    says "left out 1 face"
}

@test "NPZ: names in large letters, parameters of body models, shapes that are there" {
    py <<'EOF'
import struct, zipfile
def npz(name, **arrays):
    with zipfile.ZipFile(name + '.npz', 'w') as z:
        for key, (descr, shape, data) in arrays.items():
            head = repr({'descr': descr, 'fortran_order': False, 'shape': shape}).encode()
            z.writestr(key + '.npy', b'\x93NUMPY\1\0' + struct.pack('<H', len(head)) + head + data)
def zeros(*shape):
    n = 8
    for s in shape: n *= s
    return ('<f8', shape, bytes(n))
square = ('<f8', (4, 3), struct.pack('<12d', 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0))
quad = ('<i4', (1, 4), struct.pack('<4i', 0, 1, 2, 3))
npz('large', V=square, F=quad)
npz('named', Vertices=square, Faces=quad)
npz('both', v=square, V=zeros(2, 3), f=quad)
npz('amass', trans=zeros(2, 3), betas=zeros(16), pose_body=zeros(2, 63), root_orient=zeros(2, 3))
npz('betas', betas=zeros(10), gender=zeros())
npz('poses', poses=zeros(2, 156))
npz('flat', vertices=zeros(4, 2), faces=quad)
npz('row', vertices=square, faces=('<i4', (4,), quad[2]))
npz('empty', vertices=zeros(0, 3), faces=quad)
EOF
    local name
    for name in large named both; do
        geometry $name.npz
        [ "$output" = $'0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3' ] || fail "$name: $output"
    done
    for name in amass betas poses; do
        must_fail 3 vg-encode $name.npz -o out.vgs
        one_line
        says "'$name.npz' holds parameters of a body model (SMPL: poses, betas) and no vertices"
    done
    must_fail 3 vg-encode flat.npz -o out.vgs
    says "array 'vertices' in 'flat.npz' is of shape (4, 2), not (frames, vertices, 3)"
    must_fail 3 vg-encode row.npz -o out.vgs
    says "array 'faces' in 'row.npz' is of shape (4), not (faces, corners of a face)"
    must_fail 3 vg-encode empty.npz -o out.vgs
    says "is of shape (0, 3)"
}

@test "a file that is replaced keeps its permissions" {
    local mesh=$'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3'
    echo "$mesh" >a.obj
    touch out.obj out.vgs out.glb
    chmod 600 out.obj
    chmod 640 out.vgs
    chmod 664 out.glb
    must vg-encode a.obj -o out.vgs
    must vg-decode -q -o out.obj out.vgs
    must vg-decode -q -o out.glb out.vgs
    [ "$(stat -c %a out.obj out.vgs out.glb | tr '\n' ' ')" = '600 640 664 ' ] || fail "$(stat -c '%a %n' out.*)"
}

@test "PLY, OFF: texture coordinates and colours of vertices are read; those of faces, points and curves are left out with a word" {
    ply_ascii 3 'property float s' 'property float t' 'element face 1' 'property list uchar int vertex_indices' \
        'property list uchar float texcoord' 'property uchar red' end_header '0 0 0 0.5 0.25' '1 0 0 nan 0' '1 1 0 1 1' '3 0 1 2 0 255' >uv.ply
    must_warn vg-encode uv.ply -o uv.vgs
    one_line
    says "left out the colours of its faces; left out the texture coordinates of its faces; left out 1 texture coordinates that are not finite"
    must vg-decode uv.vgs -o uv.obj
    [ "$(cat uv.obj)" = $'v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5 0.25\nvt 0 0\nvt 1 1\nf 1/1 2 3/3' ] || fail "$(cat uv.obj)"
    py <<'EOF'
import struct
with open("uv-binary.ply", "wb") as f:
    f.write(b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty double u\nproperty float y\n"
            b"property float v\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n")
    for x, y, u, v in (0, 0, 0.5, 0.25), (1, 0, 0, 0), (1, 1, 1, 1):
        f.write(struct.pack(">fdfff", x, u, y, v, 0))
    f.write(struct.pack(">Biii", 3, 0, 1, 2))
EOF
    must vg-encode uv-binary.ply -o uv.vgs
    must vg-decode uv.vgs -o uv.obj
    [ "$(cat uv.obj)" = $'v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5 0.25\nvt 0 0\nvt 1 1\nf 1/1 2/2 3/3' ] || fail "$(cat uv.obj)"
    printf 'STCNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0 1 .5 .25\n1 0 0 0 0 1 0 1 0 0.2 nan 0\n0 1 0 0 0 1 x 0 1 1 1 1\n3 0 1 2 9 9 9\n' >all.off
    must_warn vg-encode all.off -o all.vgs
    one_line
    says "left out 1 malformed colours of vertices; left out the colours of 1 faces; left out 2 texture coordinates that are not finite"
    must vg-decode all.vgs -o all.obj
    [ "$(cat all.obj)" = $'v 0 0 0 1 0 0\nv 1 0 0 0 1 0 0.2\nv 0 1 0 1 1 1\nvt 0.5 0.25\nvt 0 0\nvt 0 0\nf 1/1 2 3' ] || fail "$(cat all.obj)"
    printf 'COFF\n3 1 0\n0 0 0 255 0 51\n1 0 0 0 255 0 51\n0 1 0 0 1 0\n3 0 1 2\n' >bytes.off
    must vg-encode bytes.off -o bytes.vgs
    must vg-decode bytes.vgs -o bytes.obj
    [ "$(grep '^v ' bytes.obj)" = $'v 0 0 0 1 0 0.2\nv 1 0 0 0 1 0 0.2\nv 0 1 0 0 0.003921569 0' ] || fail "$(cat bytes.obj)"
    printf 'STCOFF 3 1 0 0 0 0 1 0 0 0 1 0 3 0 1 2\n' >words.off
    must vg-encode words.off -o words.vgs
    must vg-decode words.vgs -o words.obj
    [ "$(cat words.obj)" = $'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3' ] || fail "$(cat words.obj)"
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2\ncurv 0 1 1 2\nf 1 2 3\n' >points.obj
    must_warn vg-encode points.obj -o points.vgs
    one_line
    says "left out 2 points, curves or surfaces"
}

# opens STREAM: corners of the lips that touch in the first frame are half a unit apart in the second
opens() {
    py "$1" <<'END'
import math, sys
import read_stream
s = read_stream.read_stream(sys.argv[1])
at = [[f.values[3 * v:3 * v + 3] for v in range(len(f.values) // 3)] for f in s.frames]
assert len(at) == 2, len(at)
pairs = [(a, b) for a in range(len(at[0])) for b in range(a) if math.dist(at[0][a], at[0][b]) < 1e-6]
assert len(pairs) == 2, pairs
for a, b in pairs: assert abs(math.dist(at[1][a], at[1][b]) - 0.5) < 0.1, (a, b)
END
}

@test "glTF: a mouth closed in the neutral pose opens: without welding, of two primitives, as a GLB" {
    cp "$DATA"/reports/lips_*.gltf .
    local name
    for name in source target; do must vg-encode --weld off lips_$name.gltf -o $name.vgs; done
    pipe 'vg-deform --onto target.vgs source.vgs | vg-solve -o out.vgs'
    opens out.vgs
    # the upper lip and the lower one are primitives of their own, with vertices of their own
    py <<'END'
import base64, json, struct
for name in "source", "target":
    g = json.load(open(f"lips_{name}.gltf"))
    raw = base64.b64decode(g["buffers"][0]["uri"].split(",")[1])
    index = struct.unpack_from("<21H", raw, 120)
    data, views, accessors, parts = b"", [], [], []
    def put(values, form, kind, extra={}):
        global data
        b = struct.pack(f"<{len(values)}{form}", *values)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(b)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126 if form == "f" else 5123, "type": kind,
                          "count": len(values) // (3 if kind == "VEC3" else 1), **extra})
        data += b + bytes(-len(b) % 4)
        return len(accessors) - 1
    for faces in (0, 1, 4), (2, 3, 5, 6):
        used = sorted({v for f in faces for v in index[3 * f:3 * f + 3]})
        def points(offset):
            x = [x for v in used for x in struct.unpack_from("<3f", raw, offset + 12 * v)]
            return put(x, "f", "VEC3", {"min": [min(x[k::3]) for k in range(3)], "max": [max(x[k::3]) for k in range(3)]})
        part = {"attributes": {"POSITION": points(0)}, "indices": put([used.index(v) for f in faces for v in index[3 * f:3 * f + 3]], "H", "SCALAR")}
        if name == "source": part["targets"] = [{"POSITION": points(164)}]
        parts.append(part)
    g["meshes"][0]["primitives"] = parts
    g["accessors"], g["bufferViews"], g["buffers"] = accessors, views, [{"byteLength": len(data)}]
    j = json.dumps(g).encode()
    j += b" " * (-len(j) % 4)
    open(f"two_{name}.glb", "wb").write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(j) + len(data), len(j), 0x4E4F534A) + j +
                                        struct.pack("<II", len(data), 0x004E4942) + data)
END
    pipe 'vg-encode two_source.glb | vg-deform --onto two_target.glb | vg-solve -o out.vgs'
    opens out.vgs
    pipe 'vg-encode two_target.glb | vg-info' # alone it is welded: the lips are one
    shows 'vertices    8'
}
