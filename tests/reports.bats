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
    says "left out 7 bytes after the last triangle"
    geometry multiline_face.off
    [ "$(tail -1 <<<"$output")" = "4 0 1 2 3" ] || fail "$output"
    geometry tristrips.ply
    [ "$(tail -2 <<<"$output")" = $'3 0 1 3\n3 1 2 3' ] || fail "$output"
}

@test "BVH: more rows, wrong rows, no motion, scales, EndSite" {
    reports
    must_warn vg-encode frames_more.bvh -o out.vgs
    one_line
    says "it announces 1 frames but holds 2, which are read"
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
    says "'shifted.bvh' line 19: row 1 has 8 values, but there are 9 channels"
    head -n 19 frames_more.bvh >long.bvh
    printf '1 2 3 10 20 30 40 50 60 70\n' >>long.bvh
    must_fail 3 vg-encode long.bvh -o out.vgs
    says "'long.bvh' line 20: row 2 has 10 values"
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
npz('from1', vertices=('<f8', (5, 4, 3), doubles(*range(60))), faces=('<i4', (2, 3), struct.pack('<6i', 1, 2, 3, 1, 3, 4)))
npz('more', vertices=('<f8', (4, 3), doubles(*square)), verts=('<f8', (4, 3), doubles(*square)), faces=quad, colors=('<f8', (4, 3), bytes(96)))
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
        pipe "vg-encode -q $name.npz | vg-decode -q --format npy --no-mesh -o - | tail -c 96 | od -An -v -w12 -t f4 | tr -s ' '"
        [ "$output" = $' 0 0 0\n 1 0 0\n 1 1 0\n 0 1 0\n 10 10 10\n 11 10 10\n 11 11 10\n 10 11 10' ] || fail "$name: $output"
    done
    must_warn vg-encode vfx.npz -o out.vgs
    one_line
    says "took the axes of 'vertices' as vertices, frames, x y z"
    must_fail 3 vg-encode from1.npz -o out.vgs
    one_line
    says "array 'faces'" "counts the vertices from 1"
    must_warn vg-encode more.npz -o out.vgs
    one_line
    says "left out the arrays colors, verts"
    must_fail 3 vg-encode unclear.npz -o out.vgs
    one_line
    says "'vertices'" "ambiguous axes" "--array-axes"
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

@test "glTF: morph targets of several meshes belong together by name" {
    reports
    must vg-encode arkit_partial.gltf -o out.vgs
    must vg-decode -q -o shapes/ out.vgs
    py <<'EOF'
import os
def least(name):
    y = [float(l.split()[2]) for l in open('shapes/%s.obj' % name) if l.startswith('v ')]
    assert len(y) == 24
    return min(y[:8]), min(y[8:16])
assert sorted(os.listdir('shapes')) == ['base.obj', 'eyeBlinkLeft.obj', 'jawOpen.obj', 'tongueOut.obj'], os.listdir('shapes')
assert least('base') == (0, 0)
assert least('eyeBlinkLeft') == (2, 0), least('eyeBlinkLeft')
assert least('jawOpen') == (-1, -1), least('jawOpen')
assert least('tongueOut') == (0, 5), least('tongueOut')
EOF
    # names in the extras of a primitive; meshes without names go by number; a name twice in one mesh is two shapes
    py <<'EOF'
import json
def change(name, what):
    g = json.load(open('arkit_partial.gltf'))
    what(g)
    json.dump(g, open(name, 'w'))
def to_primitives(g):
    for m in g['meshes'][:2]: m['primitives'][0]['extras'] = m.pop('extras')
def nameless(g):
    del g['meshes'][1]['extras']
def twice(g):
    g['meshes'][0]['extras']['targetNames'] = ['jawOpen', 'jawOpen']
change('primitives.gltf', to_primitives)
change('nameless.gltf', nameless)
change('twice.gltf', twice)
EOF
    pipe 'vg-encode primitives.gltf | vg-info --digest'
    [ "$output" = "$(vg-info --digest out.vgs)" ] || fail "names in the extras of primitives"
    must vg-encode nameless.gltf -o nameless.vgs
    must vg-decode -q -o nameless/ nameless.vgs
    [ "$(ls nameless | tr '\n' ' ')" = 'base.obj eyeBlinkLeft.obj jawOpen.obj ' ] || fail "$(ls nameless)"
    pipe 'vg-encode twice.gltf | vg-info --frames'
    [ "$(grep -c jawOpen <<<"$output")" = 2 ] || fail "$output"
}

@test "glTF: a node that mirrors turns faces over; instances are shown; pointers animate" {
    reports
    py <<'EOF'
import json
g = json.load(open('negscale.gltf'))
g['nodes'] = [{'mesh': 0}, {'matrix': [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1], 'children': [2]}, {'mesh': 0}]
g['scenes'] = [{'nodes': [0, 1]}]
json.dump(g, open('above.gltf', 'w'))          # the parent mirrors, by a matrix
g['nodes'][2]['scale'] = [1, -1, 1]
json.dump(g, open('twice.gltf', 'w'))          # twice mirrored is not
g = json.load(open('instancing.gltf'))
g['nodes'][0]['scale'] = [1, 1, -1]
json.dump(g, open('mirrored.gltf', 'w'))
EOF
    local name
    for name in negscale instancing above twice mirrored; do
        must vg-encode $name.gltf -o $name.vgs
        must vg-decode -q -o $name.obj $name.vgs
    done
    py <<'EOF'
def volume(name):
    v, total = [], 0
    for l in open(name + '.obj'):
        w = l.split()
        if w and w[0] == 'v': v.append([float(x) for x in w[1:]])
        if w and w[0] == 'f':
            a, b, c = [v[int(x) - 1] for x in w[1:]]
            total += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6
    return len(v), total, v
assert volume('negscale')[0] == 16 and abs(volume('negscale')[1] - 2) < 1e-9, volume('negscale')[:2]
assert abs(volume('above')[1] - 2) < 1e-9 and abs(volume('twice')[1] - 2) < 1e-9
n, v, at = volume('instancing')
assert n == 24 and abs(v - 3) < 1e-9 and max(p[0] for p in at) == 5, (n, v)
assert abs(volume('mirrored')[1] - 3) < 1e-9
EOF
    # the same animation, said by a node and by pointers
    py <<'EOF'
import base64, json, struct
times, moves = struct.pack('<3f', 0, 1, 2), struct.pack('<9f', 0, 0, 0, 1, 0, 0, 0, 2, 0)
points = struct.pack('<9f', 0, 0, 0, 1, 0, 0, 0, 1, 0)
data = points + times + moves
def write(name, target):
    g = {'asset': {'version': '2.0'}, 'buffers': [{'byteLength': len(data), 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
        'bufferViews': [{'buffer': 0, 'byteOffset': 0, 'byteLength': 36}, {'buffer': 0, 'byteOffset': 36, 'byteLength': 12}, {'buffer': 0, 'byteOffset': 48, 'byteLength': 36}],
        'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 1, 0]},
            {'bufferView': 1, 'componentType': 5126, 'count': 3, 'type': 'SCALAR', 'min': [0], 'max': [2]}, {'bufferView': 2, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0}}]}], 'nodes': [{'mesh': 0}], 'scenes': [{'nodes': [0]}], 'scene': 0,
        'animations': [{'name': n, 'channels': [{'sampler': 0, 'target': target}], 'samplers': [{'input': 1, 'output': 2}]} for n in ('Walk', 'Run')]}
    json.dump(g, open(name, 'w'))
write('node.gltf', {'node': 0, 'path': 'translation'})
write('pointer.gltf', {'path': 'pointer', 'extensions': {'KHR_animation_pointer': {'pointer': '/nodes/0/translation'}}})
EOF
    pipe 'vg-encode --animation Walk node.gltf | vg-info --digest'
    local truth=$output
    pipe 'vg-encode --animation Walk pointer.gltf | vg-info --digest'
    [ "$output" = "$truth" ] || fail "the pointer does not animate"
    # names, times, and sampling at a rate: half-way between keys it is the mean
    pipe 'vg-encode --animation Walk node.gltf | vg-info --frames'
    shows Walk.0001 Walk.0003
    pipe 'vg-encode node.gltf | vg-info --frames'
    shows Walk.0003 Run.0001
    must_fail 3 vg-encode --animation Jump node.gltf -o no.vgs
    one_line
    says "no animation 'Jump'" "Walk, Run"
    must vg-encode --animation Run --fps 2 node.gltf -o half.vgs
    pipe 'vg-info half.vgs'
    shows 'frames     5' '0 s to 2 s'
    must vg-decode -q --format npy --no-mesh -o half.npy half.vgs
    pipe "tail -c 180 half.npy | od -An -v -w36 -t f4 -j 36 -N 36 | tr -s ' '"
    [ "$output" = ' 0.5 0 0 1.5 0 0 0.5 1 0' ] || fail "$output"
}

@test "glTF: an unknown extension is named, and none is called Draco that is not" {
    reports
    py <<'EOF'
import json
def write(name, key, *extensions):
    g = json.load(open('negscale.gltf'))
    g[key] = list(extensions)
    json.dump(g, open(name, 'w'))
write('used.gltf', 'extensionsUsed', 'VENDOR_bend', 'KHR_materials_unlit')
write('required.gltf', 'extensionsRequired', 'VENDOR_bend')
g = json.load(open('negscale.gltf'))
g['extensionsRequired'] = ['KHR_draco_mesh_compression']
g['meshes'][0]['primitives'][0]['extensions'] = {'KHR_draco_mesh_compression': {'bufferView': 0, 'attributes': {'POSITION': 0}}}
for a in g['accessors']: a.pop('bufferView')
json.dump(g, open('draco.gltf', 'w'))
g = json.load(open('negscale.gltf'))
g['extensionsRequired'] = ['EXT_meshopt_compression']
g['bufferViews'][0]['extensions'] = {'EXT_meshopt_compression': {'buffer': 0, 'byteLength': 24, 'byteStride': 12, 'mode': 'ATTRIBUTES', 'count': 8}}
json.dump(g, open('meshopt.gltf', 'w'))
EOF
    must_warn vg-encode used.gltf -o out.vgs
    one_line
    says "VENDOR_bend" "unknown and ignored"
    [[ $stderr != *unlit* ]] || fail "$stderr"
    must_fail 3 vg-encode required.gltf -o no.vgs
    says "requires the extension 'VENDOR_bend'"
    must_fail 3 vg-encode draco.gltf -o no.vgs
    one_line
    says "compressed with Draco (KHR_draco_mesh_compression)"
    must_fail 3 vg-encode meshopt.gltf -o no.vgs
    one_line
    says "compressed with meshopt (EXT_meshopt_compression)"
}

@test "glTF compressed with Draco and meshopt is what it was before" {
    py <<'EOF'
import make_character
make_character.main("in.glb")
EOF
    must vg-encode --animation Wave in.glb -o in.vgs
    local codec
    for codec in draco meshopt; do
        capture vg-encode --animation Wave "$DATA/character-$codec.glb" -o $codec.vgs
        [[ $stderr != *"which this build does not read"* ]] || skip "built without the library of $codec"
        [ "$status" = 0 ] && [ -z "$stderr" ] || fail "$stderr"
        pipe "vg-info $codec.vgs"
        shows 'asset                2 materials, 1 texture, normals, further texture coordinates, 1 skin, 1 camera'
        # the same triangles, in any order: Draco is exact here, for the corners of a cube are; meshopt has 16 bits a coordinate
        must vg-decode -q -o $codec/ $codec.vgs
        must vg-decode $codec.vgs -o $codec.glb
        pipe "vg-encode $codec.glb | vg-diff -t 1e-7 $codec.vgs -"
    done
    must vg-decode -q -o in/ in.vgs
    must vg-diff -t 3e-5 in.vgs meshopt.vgs
    py <<'EOF'
def triangles(name):
    v, f = [], []
    for line in open(name):
        w = line.split()
        if w[:1] == ['v']: v.append(tuple(round(float(x), 3) + 0.0 for x in w[1:4]))
        if w[:1] == ['f']:
            t = [v[int(c.split('/')[0]) - 1] for c in w[1:]]
            f.append(tuple(t[t.index(min(t)):] + t[:t.index(min(t))]))
    return sorted(f)
for frame in range(1, 4):
    assert triangles('draco/Wave.%04d.obj' % frame) == triangles('in/Wave.%04d.obj' % frame)
EOF
    # cut short, or broken: refused, never read past
    py <<'EOF'
import json, struct
b = open('DATA/character-draco.glb'.replace('DATA', __import__('os').environ['DATA']), 'rb').read()
n, = struct.unpack('<I', b[12:16])
g, data = json.loads(b[20:20 + n]), b[28 + n:]
for i, view in enumerate(g['bufferViews']):
    broken = bytearray(data)
    at = view.get('byteOffset', 0)
    for k in range(at, at + view['byteLength'], 7): broken[k] ^= 0x55
    text = json.dumps(g).encode()
    text += b' ' * (-len(text) % 4)
    open('broken-%d.glb' % i, 'wb').write(struct.pack('<4sIIII', b'glTF', 2, 28 + len(text) + len(broken), len(text), 0x4E4F534A) + text +
        struct.pack('<II', len(broken), 0x004E4942) + bytes(broken))
EOF
    local file
    for file in broken-*.glb; do
        capture vg-encode -q "$file" -o out.vgs
        [ "$status" = 0 ] || [ "$status" = 3 ] || fail "$file: status $status" "$stderr"
    done
}

@test "glTF: vertices that touch in one neutral pose need not be welded" {
    reports
    pipe 'vg-encode lips_target.gltf | vg-info'
    shows 'vertices    8'
    pipe 'vg-encode --weld off lips_target.gltf | vg-info'
    shows 'vertices    10'
    # As a target it takes the welding of the source, in which the lips are apart: the mouth opens, by half a unit in the source.
    pipe 'vg-encode lips_source.gltf | vg-deform --onto lips_target.gltf | vg-solve | vg-decode -o - --format npz >out.npz'
    py <<'END'
import io, struct, zipfile, ast
z = zipfile.ZipFile("out.npz")
def array(name):
    b = z.read(name + ".npy")
    n, = struct.unpack("<H", b[8:10])
    shape = ast.literal_eval(b[10:10 + n].decode())["shape"]
    return shape, struct.unpack(f"<{len(b[10 + n:]) // 4}f", b[10 + n:])
(frames, nv, _), p = array("positions")
assert (frames, nv) == (2, 10), (frames, nv)
at = [[p[30 * f + 3 * v:30 * f + 3 * v + 3] for v in range(10)] for f in range(2)]
pairs = [(a, b) for a in range(10) for b in range(a) if max(abs(x - y) for x, y in zip(at[0][a], at[0][b])) < 1e-6]
assert len(pairs) == 2, pairs
for a, b in pairs:
    assert abs(sum((x - y) ** 2 for x, y in zip(at[1][a], at[1][b])) ** 0.5 - 0.5) < 0.1
END
}

@test "glTF: texture coordinates and the names of nodes and materials reach OBJ; images are named as left out" {
    reports
    py <<'EOF'
import base64, json, struct
# a square of two triangles, cut apart along the diagonal where the texture jumps
points = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0]
uv = [0, 1, 0.5, 1, 0.5, 0.25, 0.5, 1, 1, 0, 0.5, 0]
data = struct.pack('<18f', *points) + struct.pack('<12f', *uv)
g = {'asset': {'version': '2.0'}, 'buffers': [{'byteLength': len(data), 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
    'bufferViews': [{'buffer': 0, 'byteOffset': 0, 'byteLength': 72}, {'buffer': 0, 'byteOffset': 72, 'byteLength': 48}],
    'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 6, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 1, 0]},
        {'bufferView': 1, 'componentType': 5126, 'count': 6, 'type': 'VEC2'}],
    'images': [{'uri': 'skin.png'}], 'materials': [{'name': 'red skin'}],
    'meshes': [{'primitives': [{'attributes': {'POSITION': 0, 'TEXCOORD_0': 1}, 'material': 0}]}],
    'nodes': [{'mesh': 0, 'name': 'Flag'}], 'scenes': [{'nodes': [0]}], 'scene': 0}
json.dump(g, open('flag.gltf', 'w'))
g['accessors'][1]['count'] = 5
json.dump(g, open('short.gltf', 'w'))
EOF
    must_warn vg-encode flag.gltf -o flag.vgs
    one_line
    says "'flag.gltf': the image 'skin.png' is not beside it"
    must_warn vg-decode -o flag.obj flag.vgs
    says "not kept in 'flag.obj': 1 material, 1 texture"
    [ "$(grep -c '^v ' flag.obj)" = 4 ] || fail "not welded" "$(cat flag.obj)"
    grep -qx 'o Flag' flag.obj || fail "the node's name is lost"
    grep -qx 'usemtl red skin' flag.obj || fail "the material's name is lost"
    py <<'EOF'
vt = [tuple(float(x) for x in l.split()[1:]) for l in open('flag.obj') if l.startswith('vt ')]
f = [[tuple(int(x) - 1 for x in c.split('/')) for c in l.split()[1:]] for l in open('flag.obj') if l.startswith('f ')]
assert [[c[0] for c in face] for face in f] == [[0, 1, 2], [0, 2, 3]], f
# v grows upwards in OBJ, downwards in glTF
assert [vt[c[1]] for face in f for c in face] == [(0, 0), (0.5, 0), (0.5, 0.75), (0.5, 0), (1, 1), (0.5, 1)], (vt, f)
EOF
    must_warn vg-encode short.gltf -o short.vgs
    says "left out malformed texture coordinates"
}
