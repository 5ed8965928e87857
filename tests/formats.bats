#!/usr/bin/env bats
# Caches, arrays, STL and USD through the programs, each checked by a reader of its own: Python's standard library, and NumPy
# where it is installed; blender.bats has Blender's word.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# make_walk [MESH]: three poses at 25 a second in walk.vgs, and truth.txt with their positions for the readers in Python
make_walk() {
    poses "${1:-cube}" 3
    must vg-encode --fps 25 pose1.obj pose2.obj pose3.obj -o walk.vgs
    awk '$1 == "v" {print $2, $3, $4}' pose1.obj pose2.obj pose3.obj >truth.txt
}

# decoded OPTIONS...: vg-decode of walk.vgs without its warnings
decoded() {
    must vg-decode -q "$@" walk.vgs
}

# close_to FILE: it reads back as walk.vgs, to the precision of binary32
close_to() {
    must vg-diff -t 1e-6 walk.vgs "$1"
}

# python_with MODULE: an interpreter that has it, in $python; else skip
python_with() {
    for python in python3 /usr/bin/python3; do
        "$python" -c "import $1" 2>/dev/null && return
    done
    skip "the Python module $1 is not installed"
}

@test "PC2: the bytes as Python's struct reads them, and back" {
    make_walk
    decoded -o walk.pc2
    nothing_but pose1.obj pose2.obj pose3.obj walk.vgs truth.txt walk.pc2 walk.obj
    py <<'END'
import struct
b = open('walk.pc2', 'rb').read()
magic, version, points, start, rate, samples = struct.unpack('<12siiffi', b[:32])
assert (magic, version, points, start, samples) == (b'POINTCACHE2\0', 1, 8, 0, 3), b[:32]
assert abs(rate - 0.04) < 1e-8, rate
x = struct.unpack('<72f', b[32:])
truth = [float(w) for w in open('truth.txt').read().split()]
assert len(truth) == 72 and all(abs(p - q) < 1e-6 for p, q in zip(x, truth))
END
    same_file walk.obj <(vg-decode pose1.obj -o -)
    close_to walk.pc2
    pipe 'vg-encode walk.pc2 | vg-info --frames'
    shows walk.0001 walk.0003 0.08
}

@test "MDD: the bytes as Python's struct reads them, and back" {
    make_walk
    decoded -o walk.mdd
    py <<'END'
import struct
b = open('walk.mdd', 'rb').read()
assert struct.unpack('>2i', b[:8]) == (3, 8)
t = struct.unpack('>3f', b[8:20])
assert max(abs(t[i] - i / 25) for i in range(3)) < 1e-8, t
x = struct.unpack('>72f', b[20:])
truth = [float(w) for w in open('truth.txt').read().split()]
assert len(truth) == 72 and all(abs(p - q) < 1e-6 for p, q in zip(x, truth))
END
    close_to walk.mdd
}

@test "NPY: header and numbers as Python reads them, single and double, and back" {
    make_walk
    decoded -o walk.npy
    decoded --f64 --no-mesh -o wide.npy
    py <<'END'
import ast, struct
truth = [float(w) for w in open('truth.txt').read().split()]
for name, descr, letter, tolerance in ('walk.npy', '<f4', 'f', 1e-6), ('wide.npy', '<f8', 'd', 0):
    b = open(name, 'rb').read()
    assert b[:8] == b'\x93NUMPY\x01\x00'
    n, = struct.unpack('<H', b[8:10])
    assert (10 + n) % 64 == 0 and b[9 + n:10 + n] == b'\n'
    assert ast.literal_eval(b[10:10 + n].decode()) == {'descr': descr, 'fortran_order': False, 'shape': (3, 8, 3)}
    x = struct.unpack('<72' + letter, b[10 + n:])
    assert all(abs(p - q) <= tolerance for p, q in zip(x, truth))
END
    close_to walk.npy
    must vg-encode --mesh walk.obj wide.npy -o back.vgs
    must vg-diff -t 0 walk.vgs back.vgs
    pipe 'vg-encode wide.npy | vg-info' # without a mesh: points
    shows 'faces       0'
}

@test "NPZ: arrays as Python's zipfile reads them; a stream comes back whole" {
    make_walk
    decoded --f64 -o walk.npz
    py <<'END'
import ast, struct, zipfile
z = zipfile.ZipFile('walk.npz')
assert z.testzip() is None
a = {}
for name in z.namelist():
    b = z.read(name)
    n, = struct.unpack('<H', b[8:10])
    head = ast.literal_eval(b[10:10 + n].decode())
    a[name[:-4]] = head['descr'], head['shape'], b[10 + n:]
assert sorted(a) == ['face_offsets', 'face_vertices', 'names', 'positions', 'reference', 'reference_name', 'times'], sorted(a)
assert a['face_offsets'][:2] == ('<u4', (7,)) and struct.unpack('<7I', a['face_offsets'][2]) == tuple(range(0, 25, 4))
assert a['names'][0] == '<U5' and a['names'][2].decode('utf-32-le') == 'pose1pose2pose3'
assert struct.unpack('<3d', a['times'][2]) == (0, 1 / 25, 2 / 25)
truth = [float(w) for w in open('truth.txt').read().split()]
assert list(struct.unpack('<72d', a['positions'][2])) == truth
END
    pipe 'vg-encode walk.npz | vg-info --digest'
    local here=$output
    pipe 'vg-info --digest walk.vgs'
    [ "$here" = "$output" ] || fail "the sequence changed: $here" "$output"
}

@test "NPZ: vectors and deformations come back, so that what was learnt can be solved" {
    make_walk two
    must vg-encode --vectors --anchor 1,9 walk.vgs -o vectors.vgs
    must vg-deform walk.vgs -o deformations.vgs
    local kind
    for kind in vectors deformations; do
        must vg-decode --f64 -o $kind.npz $kind.vgs
        [ "$(vg-info --digest $kind.vgs)" = "$(vg-encode $kind.npz | vg-info --digest)" ] || fail "$kind changed"
    done
    pipe 'vg-encode vectors.npz | vg-solve | vg-diff -t 1e-9 walk.vgs -'
    must vg-deform --onto pose2.obj deformations.vgs -o straight.vgs
    pipe 'vg-encode deformations.npz | vg-deform --onto pose2.obj | vg-info --digest'
    [ "$output" = "$(vg-info --digest straight.vgs)" ] || fail "deformations do something else"
}

@test "NPZ: arrays that say what cannot be are refused by name; names may have any letters" {
    cat >bad.py <<'END'
import struct, zipfile
def npz(name, **arrays):
    with zipfile.ZipFile(name + '.npz', 'w') as z:
        for key, (descr, shape, data) in arrays.items():
            head = repr({'descr': descr, 'fortran_order': False, 'shape': shape}).encode()
            z.writestr(key + '.npy', b'\x93NUMPY\1\0' + struct.pack('<H', len(head)) + head + data)
points = ('<f4', (300, 3), struct.pack('<900f', *range(900)))
npz('indices', positions=points, faces=('|i1', (1, 3), struct.pack('3b', 0, 1, -1)))
npz('letters', positions=points, names=('<U2', (1,), struct.pack('<2I', 0xd800, 65)))
npz('horse', positions=points, names=('>U2', (1,), struct.pack('>2I', 0x1f40e, 0xfc)))
npz('few', positions=points, names=('<U1', (2,), struct.pack('<2I', 65, 66)))
corners = ('<f8', (1, 3, 4), struct.pack('<12d', 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0))
graph = dict(deformations=corners, reference=('<f8', (3, 3), struct.pack('<9d', 0, 0, 0, 1, 0, 0, 0, 1, 0)),
    faces=('<i4', (1, 3), struct.pack('<3i', 0, 1, 2)), roots=('<f8', (1, 3), bytes(24)))
npz('quaternion', links=('<u4', (0, 2), b''), **graph)
npz('unlinked', **graph)
END
    py <bad.py
    must_fail 3 vg-encode indices.npz -o no.vgs
    says "array 'faces' in 'indices.npz' holds an index that is out of range"
    must_fail 3 vg-encode letters.npz -o no.vgs
    says "array 'names' in 'letters.npz' holds an invalid code point"
    must_fail 3 vg-encode quaternion.npz -o no.vgs
    says "array 'deformations' in 'quaternion.npz' holds a quaternion that is zero"
    must_fail 3 vg-encode unlinked.npz -o no.vgs
    says "an array 'deformations', but none called 'links'"
    must_fail 3 vg-encode few.npz -o no.vgs
    says "array 'names' in 'few.npz' is not a list of texts, one for each frame"
    pipe "vg-encode horse.npz | vg-info --frames"
    shows 🐎ü
    [ ! -e no.vgs ]
}

@test "NumPy loads our arrays, and we its own, stored and deflated" {
    python_with numpy
    make_walk
    decoded -o walk.npz
    decoded -o walk.npy
    cat >arrays.py <<'END'
import numpy
truth = numpy.array(open('truth.txt').read().split(), dtype=float).reshape(3, 8, 3)
a = numpy.load('walk.npy')
z = numpy.load('walk.npz')
assert numpy.abs(a - truth).max() < 1e-6 and (z['positions'] == a).all()
assert list(z['names']) == ['pose1', 'pose2', 'pose3'] and z['face_offsets'][-1] == len(z['face_vertices']) == 24
arrays = {k: numpy.asfortranarray(z[k]) if z[k].ndim else z[k] for k in z.files}
arrays['positions'] = numpy.asfortranarray(truth.astype('>f8'))
numpy.savez('stored.npz', **arrays)
numpy.savez_compressed('deflated.npz', feature=numpy.zeros(4), **arrays)
numpy.savez('triangles.npz', positions=truth, faces=numpy.array([[0, 1, 2], [4, 5, 6]]))
numpy.save('fortran.npy', arrays['positions'])
END
    must "$python" arrays.py
    must vg-diff -t 0 walk.vgs stored.npz
    must_warn vg-diff -t 0 walk.vgs deflated.npz
    says "left out the arrays feature"
    must vg-encode --mesh walk.obj fortran.npy -o back.vgs
    must vg-diff -t 0 walk.vgs back.vgs
    pipe 'vg-encode triangles.npz | vg-info'
    shows 'faces       2: 2 of 3'
}

@test "STL: triangles as Python's struct reads them, and back" {
    mesh cube >cube.obj
    must_warn vg-decode -o cube.stl cube.obj
    says "warning: not kept in 'cube.stl': polygons, which became triangles"
    py <<'END'
import struct
b = open('cube.stl', 'rb').read()
n, = struct.unpack('<I', b[80:84])
assert n == 12 and len(b) == 84 + 50 * n
volume = 0
for i in range(n):
    t = struct.unpack('<12fH', b[84 + 50 * i:134 + 50 * i])
    normal, a, p, q = t[:3], t[3:6], t[6:9], t[9:12]
    cross = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    volume += sum(x * y for x, y in zip(a, cross)) / 6
    assert abs(sum(x * x for x in normal) - 1) < 1e-6
assert abs(volume - 1) < 1e-6, volume
END
    printf 'v 0 0 0\nv 3 0 0\nv 0 5 0\nf 1 2 3\n' >large.obj
    must vg-decode -q -o large.stl large.obj
    py <<'END'
import struct
assert struct.unpack('<3f', open('large.stl', 'rb').read()[84:96]) == (0, 0, 1) # of length 1 whatever the triangle's size
END
    must vg-decode -q --format stl-ascii -o text.stl cube.obj
    local file
    for file in cube.stl text.stl; do
        pipe "vg-encode $file | vg-info"
        shows 'vertices    8' 'faces       12: 12 of 3'
        pipe "cat $file | vg-encode - | vg-info"
        shows 'vertices    8' 'faces       12: 12 of 3'
    done
}

@test "STL: what is no triangle is left out with a warning" {
    mesh tetra >tetra.obj
    must vg-decode -q --format stl-ascii -o tetra.stl tetra.obj
    {
        cat tetra.stl
        echo 'solid bad'
        echo 'facet normal 0 0 0 outer loop vertex 7 7 7 vertex 7 7 7 vertex 1 2 3 endloop endfacet endsolid'
    } >odd.stl
    must_warn vg-encode odd.stl -o odd.vgs
    says "'odd.stl': left out 1 face that names a vertex twice or has fewer than 2 corners"
    one_line
}

@test "USDA: a sample for each frame, at their rate; polygons and names kept" {
    make_walk
    decoded -o walk.usda
    py <<'END'
import ast, re
s = open('walk.usda').read()
assert s.startswith('#usda 1.0\n') and s.count('{') == s.count('}') and s.count('[') == s.count(']')
def field(name): return re.search(r'\b%s = (.*)' % name, s).group(1).strip()
assert (field('startTimeCode'), field('endTimeCode'), field('timeCodesPerSecond')) == ('0', '2', '25')
assert ast.literal_eval(field('faceVertexCounts')) == [4] * 6 and len(ast.literal_eval(field('faceVertexIndices'))) == 24
assert ast.literal_eval(field('vg:frameNames')) == ['pose1', 'pose2', 'pose3']
samples = ast.literal_eval('{' + re.search(r'points.timeSamples = \{(.*?)\}', s, re.S).group(1) + '}')
truth = [float(w) for w in open('truth.txt').read().split()]
assert list(samples) == [0, 1, 2]
x = [c for frame in samples.values() for point in frame for c in point]
assert len(x) == 72 and all(abs(p - q) < 1e-6 for p, q in zip(x, truth))
END
    python3 - <<'END'
import struct
frames = [c for t in (0, 1, 2) for c in (t, 0, 0, t, 1, 0, t, 0, 1)]
open('late.mdd', 'wb').write(struct.pack('>ii3f27f', 3, 3, 0.1, 0.2, 0.3, *frames)) # its first time code is known at the second frame
END
    printf 'v 0 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n' >late.obj
    pipe "vg-encode late.mdd | vg-decode -o late.usda"
    must grep -Eo '^ +[0-9.]+ *:' late.usda
    [ "$(tr -d ' \n' <<<"$output")" = "1:2:3:1:2:3:" ]
    must_fail 2 vg-decode --f64 -o wide.usda walk.vgs
    says "cannot write 'wide.usda' as binary64"
    must_fail 3 vg-encode walk.usda -o out.vgs
}

@test "a cache takes its mesh from beside, from --mesh, or from the operand before" {
    make_walk
    mkdir away
    decoded --mesh away/cube.ply -o walk.pc2
    nothing_but pose1.obj pose2.obj pose3.obj walk.vgs truth.txt walk.pc2 away
    must_fail 3 vg-encode walk.pc2 -o out.vgs
    says "'walk.pc2' holds no faces: put the mesh of the same name beside it" --mesh
    one_line
    must vg-encode --mesh away/cube.ply walk.pc2 -o out.vgs
    must vg-diff -t 1e-6 walk.vgs out.vgs
    must vg-encode pose1.obj walk.pc2 -o out.vgs
    must vg-info --frames out.vgs
    shows pose1 walk.0001 walk.0003
    mesh two >walk.ply # what a file is, is told by its content
    must_fail 3 vg-encode walk.pc2 -o out.vgs
    says "'walk.pc2' has 8 points, but 'walk.ply' has 12 vertices"
    must_fail 2 vg-encode --mesh pose1.obj walk.vgs -o out.vgs
    says "which has its own mesh"
}

@test "the mesh beside a cache is never written over another one" {
    make_walk
    mesh tetra >walk.obj
    cp walk.obj kept.obj
    must_fail 2 vg-decode -o walk.pc2 walk.vgs
    says "'walk.obj', the mesh for 'walk.pc2', exists" --no-mesh
    one_line
    same_file walk.obj kept.obj
    [ ! -e walk.pc2 ]
    decoded --no-mesh -o walk.pc2
    same_file walk.obj kept.obj
    decoded --mesh walk.obj -o walk.pc2
    close_to walk.pc2
    { echo '# mine' && mesh cube; } >walk.obj
    cp walk.obj kept.obj
    decoded -o walk.mdd # it is the reference pose: it stays as it is
    same_file walk.obj kept.obj
    must_fail 2 vg-decode --no-mesh -o a.obj walk.vgs
    says "leave out --no-mesh"
    must_fail 2 vg-decode --mesh a.stl -o a.pc2 walk.vgs
    says "'a.stl'" .obj
}

@test "vertices in no face: a warning for caches, and --drop-loose" {
    { mesh cube && echo 'v 9 9 9'; } >loose.obj
    must_warn vg-decode -o loose.pc2 --mesh m.obj loose.obj
    says '1 vertices are in no face' --drop-loose
    must vg-decode -q --drop-loose -o slim.pc2 loose.obj
    mesh cube >cube.obj
    must vg-diff -t 1e-6 slim.pc2 cube.obj
    must vg-decode --drop-loose -o slim2.obj loose.obj
    must vg-decode -o cube2.obj cube.obj
    same_file slim2.obj cube2.obj
    printf 'v 9 9 9\nv 0 0 0\nv 1 0 0\nv 8 8 8\nv 0 1 0\nf 2 3 5\n' >among.obj # those that stay close up
    must vg-decode --drop-loose -o closed.obj among.obj
    [ "$(cat closed.obj)" = "$(printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3')" ]
}

@test "a warning names what a format does not keep, and -q none" {
    make_walk
    { echo 'vt 0 0' && echo 'g group' && mesh cube; } |
        awk '/^f/{for (i = 2; i <= NF; i++) $i = $i "/1"} {print}' >tex.obj
    must_warn vg-decode -o tex.ply tex.obj
    says "not kept in 'tex.ply': texture coordinates; groups and materials"
    one_line
    must vg-decode -q -o tex.ply tex.obj
    must_warn vg-decode -o walk.pc2 walk.vgs
    says "not kept in 'walk.pc2': the names of the frames"
    one_line
    must vg-encode walk.pc2 -o counted.vgs # names that a reader gives again are not lost
    must vg-decode -o walk.pc2 counted.vgs
    must_fail 2 vg-decode --f64 -o wide.pc2 walk.vgs
    says 'pc2 holds binary32 only'
}

@test "one file holds all poses: no pattern, no archive, no directory; a pipe gets it too" {
    make_walk
    must_fail 2 vg-decode -o 'walk-%04d.pc2' walk.vgs
    must_fail 2 vg-decode -o walk.zip:npz walk.vgs
    must_fail 2 vg-decode --format mdd -o walk.zip walk.vgs
    mkdir dir
    must_fail 2 vg-decode --format npz -o dir walk.vgs
    local format
    for format in pc2 mdd npy npz usda; do
        decoded -o file.$format
        vg-decode -q --format $format -o - walk.vgs | cat >piped
        same_file file.$format piped
        rm -f file.obj
    done
}

@test "a cache that was cut, or lies, is refused, and nothing stays" {
    make_walk
    local format n size
    for format in pc2 mdd npy npz; do
        decoded -o walk.$format
        size=$(stat -c %s walk.$format)
        for n in 5 40 $((size / 2)) $((size - 1)); do
            head -c "$n" walk.$format >cut.$format
            must_fail 3 vg-encode --mesh pose1.obj cut.$format -o out.vgs
            one_line
            [ ! -e out.vgs ] || fail "something was written from cut.$format"
        done
    done
    for format in pc2 mdd npy; do
        { cat walk.$format && printf x; } >long.$format
        must_fail 3 vg-encode --mesh pose1.obj long.$format -o out.vgs
        says 'has data after its'
        [ ! -e out.vgs ]
    done
}

@test "an array beside mesh files in a directory or archive is passed over; alone it is read" {
    make_walk
    mkdir all alone
    decoded -o all/walk.npz
    cp all/walk.npz alone
    cp pose?.obj all
    (cd all && python3 -m zipfile -c ../all.zip walk.npz pose2.obj pose1.obj)
    (cd alone && python3 -m zipfile -c ../alone.zip walk.npz)
    local place
    for place in all/ alone/ alone.zip; do
        pipe "vg-encode $place | vg-info"
        shows "frames     3: 'pose1' to 'pose3'"
    done
    pipe 'vg-encode all.zip | vg-info'
    shows "frames     2: 'pose1' to 'pose2'"
}

@test "frames without times come 24 a second in every format, with --fps N a second" {
    poses cube 3
    must vg-encode pose*.obj -o in.vgs
    must vg-decode -q in.vgs -o usual.mdd
    must vg-decode -q in.vgs -o usual.glb
    must vg-decode -q in.vgs -o usual.usda
    must vg-decode -q --fps 10 in.vgs -o ten.mdd
    must vg-decode -q --fps 10 in.vgs -o ten.glb
    must vg-decode -q --fps 10 in.vgs -o ten.usda
    grep -q 'timeCodesPerSecond = 24 *$' usual.usda
    grep -q 'timeCodesPerSecond = 10 *$' ten.usda
    for name in usual ten; do
        must vg-encode $name.mdd -o $name.mdd.vgs
        must vg-encode $name.glb -o $name.glb.vgs
    done
    must vg-decode -q "$GOLDEN/turns.vgs" -o usual.bvh
    grep -q '^Frame Time: *0.0416666667$' usual.bvh
    must vg-encode --take 0-2 "$DATA/human-man-poses.bvh.xz" -o sit.vgs
    must vg-decode -q --fps 10 sit.vgs -o ten.bvh
    grep -q '^Frame Time: *0.10*$' ten.bvh
    must vg-view in.vgs -o usual.html
    must vg-view --fps 10 in.vgs -o ten.html
    grep -q 'FRAMES_PER_SECOND = 24;' usual.html
    grep -q '"times":\[0,0.1,0.2\]' ten.html
    must_fail 2 vg-view --fps 10 in.vgs -o ten.png
    says '--fps' 'page'
    py <<'END'
import read_stream
for name, rate in ("usual", 24), ("ten", 10):
    for kind in "mdd", "glb":
        times = [f.time for f in read_stream.read_stream(f"{name}.{kind}.vgs").frames]
        assert max(abs(t - i / rate) for i, t in enumerate(times)) < 1e-7, (name, kind, times)
END
}

@test "the table of formats in vg(7) is true: what a row names comes back, and nothing else does" {
    local format file
    py <<'END'
import make_character
make_character.main("in.glb")
END
    must vg-encode --animation Wave --fps 4 in.glb -o all.vgs
    must vg-encode --take 0 all.vgs -o one.vgs
    for format in obj ply off stl; do
        capture vg-decode one.vgs -o one.$format
        must vg-encode one.$format -o $format.vgs
    done
    for format in glb gltf npz npy pc2 mdd; do
        mkdir $format
        capture vg-decode all.vgs -o $format/all.$format
        must vg-encode $format/all.$format -o $format.vgs
    done
    py "$ROOT/man/vg.7" <<'END'
import re, sys
import read_stream
text = open(sys.argv[1], encoding="utf-8").read().split(".Ss Formats")[1].split(".El")[0]
rows = re.findall(r"^\.It (.*) Ta (.*) Ta (.*) Ta (.*)$", text, re.M)
kept = {name.lower(): (holds, words) for names, holds, way, words in rows for name in names.split(", ") if way == "in, out"}
source = {"sequence": read_stream.read_stream("all.vgs"), "one pose": read_stream.read_stream("one.vgs")}
def corners(s):
    return s.texture and [tuple(s.texture.coordinates[2 * c:2 * c + 2]) for c in s.texture.corners]
def names_of(s, kind):
    return [x for x in s.labels or [] if x[1] == kind]
checked = 0
for name in "obj", "ply", "off", "stl", "glb", "gltf", "npz", "npy", "pc2", "mdd":
    holds, words = kept[name]
    a, b = source[holds], read_stream.read_stream(name + ".vgs")
    beside = name in ("npy", "pc2", "mdd")  # an OBJ beside gives faces, texture and groups
    facts = {
        "texture": corners(a) == corners(b), "materials": names_of(a, "material") == names_of(b, "material"),
        "faces": a.mesh.faces() == b.mesh.faces(), "assets": a.asset is not None and b.asset is not None,
        "colours": a.colours is not None and a.colours == b.colours,
        "names": [f.name for f in a.frames] == [f.name for f in b.frames],
        "times": [f.time for f in a.frames] == [f.time for f in b.frames]}
    for word, fact in facts.items():
        if word in ("texture", "materials", "colours", "faces", "names") and beside or word in ("names", "times") and holds == "one pose":
            continue
        assert fact == (word in words.split(", ")), (name, word, fact, words)
        checked += 1
assert checked > 40, checked
END
}
