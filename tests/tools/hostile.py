"""hostile.py KIND: files that mean no good, in the current directory, and meshes that nobody models. See the functions below,
each of which is a KIND. The same bytes each time.
SPDX-License-Identifier: GPL-3.0-or-later
"""
import base64
import gzip
import io
import json
import math
import struct
import sys
import tarfile
import zipfile
import zlib

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 %d\nf 1 2 3\n"


def tar(name, entries):
    """entries: (path, contents, attributes of TarInfo)"""
    with tarfile.open(name, "w:gz") as t:
        for path, data, attributes in entries:
            info = tarfile.TarInfo(path)
            info.size = len(data)
            for key, value in attributes.items():
                setattr(info, key, value)
            t.addfile(info, io.BytesIO(data))


def names():
    tar("names.tar.gz", [("/etc/a.obj", TRIANGLE % 0, {}), ("../../b.obj", TRIANGLE % 1, {}),
                         ("x/../../c.obj", TRIANGLE % 2, {}), ("d/" * 3000 + "d.obj", TRIANGLE % 3, {}),
                         ("e\x1b[31m\n.obj", TRIANGLE % 4, {})])
    with zipfile.ZipFile("names.zip", "w") as z:
        for i, path in enumerate(["/etc/a.obj", "../../b.obj", "c:\\d\\c.obj"]):
            z.writestr(path, TRIANGLE % i)


def links():
    tar("symbolic.tar.gz", [("a.obj", TRIANGLE % 0, {}),
                            ("b.obj", b"", {"type": tarfile.SYMTYPE, "linkname": "/etc/passwd"})])
    tar("hard.tar.gz", [("a.obj", TRIANGLE % 0, {}), ("b.obj", b"", {"type": tarfile.LNKTYPE, "linkname": "a.obj"})])
    tar("devices.tar.gz", [("a.obj", b"", {"type": tarfile.CHRTYPE, "devmajor": 1, "devminor": 5}),
                           ("b.obj", b"", {"type": tarfile.FIFOTYPE}), ("c.obj", b"", {"type": tarfile.DIRTYPE})])


def nested():
    data, name = TRIANGLE % 0, "a.obj"
    for i in range(30):
        b = io.BytesIO()
        with zipfile.ZipFile(b, "w", zipfile.ZIP_DEFLATED) as z:
            z.writestr(name, data)
        data, name = b.getvalue(), f"n{i}.zip"
    open("nested.zip", "wb").write(data)
    packed = TRIANGLE % 0
    for _ in range(30):
        packed = gzip.compress(packed, mtime=0)
    open("nested.obj.gz", "wb").write(packed)


def bomb():
    """256 MiB of vertices in a few hundred kilobytes: as one file, as a member, as a member that lies about its size, and as
    what lies between members."""
    chunk = b"v 0 0 0\n" * 131072
    with gzip.GzipFile("bomb.obj.gz", "wb", mtime=0) as f:
        for _ in range(256):
            f.write(chunk)
    with zipfile.ZipFile("bomb.zip", "w", zipfile.ZIP_DEFLATED) as z, z.open("a.obj", "w") as f:
        for _ in range(256):
            f.write(chunk)
    data = bytearray(open("bomb.zip", "rb").read())
    for at, signature in ((22, b"PK\3\4"), (24, b"PK\1\2")):  # the unpacked size
        struct.pack_into("<I", data, data.index(signature) + at, 100)
    open("liar.zip", "wb").write(data)
    info = tarfile.TarInfo("rubbish.bin")
    info.size = len(chunk) * 256
    with gzip.GzipFile("between.tar.gz", "wb", mtime=0) as f:
        f.write(info.tobuf())
        for _ in range(256):
            f.write(chunk)
        mesh = tarfile.TarInfo("a.obj")
        mesh.size = len(TRIANGLE % 0)
        f.write(mesh.tobuf() + (TRIANGLE % 0).ljust(512, b"\0") + bytes(1024))


def many():
    """More entries than are allowed: 2,200,000 empty files."""
    block = tarfile.TarInfo("x.txt").tobuf() * 1000
    with gzip.GzipFile("many.tar.gz", "wb", compresslevel=1, mtime=0) as f:
        for _ in range(2200):
            f.write(block)
        f.write(bytes(1024))


def encrypted():
    """A zip whose member says that it is encrypted, as ZipCrypto has it."""
    packed = zlib.compress(TRIANGLE % 0)[2:-4]
    body = bytes(12) + packed
    crc = zlib.crc32(TRIANGLE % 0)
    head = struct.pack("<HHHHHIIIHH", 20, 1, 8, 0, 33, crc, len(body), len(TRIANGLE % 0), 5, 0)
    local = b"PK\3\4" + head + b"a.obj" + body
    central = b"PK\1\2" + struct.pack("<H", 20) + head + struct.pack("<HHHII", 0, 0, 0, 0, 0) + b"a.obj"
    end = b"PK\5\6" + struct.pack("<HHHHIIH", 0, 0, 1, 1, len(central), len(local), 0)
    open("encrypted.zip", "wb").write(local + central + end)


def write_gltf(name, data, accessors, primitive, **parts):
    """One mesh of one primitive, from one buffer."""
    whole = {"asset": {"version": "2.0"}, "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
             "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," +
                          base64.b64encode(data).decode()}],
             "accessors": [{"bufferView": 0, "byteOffset": offset, "componentType": component, "count": count, "type": kind}
                           for offset, component, count, kind in accessors], "meshes": [{"primitives": [primitive]}], **parts}
    json.dump(whole, open(name, "w"), separators=(",", ":"))


def crowds():
    """Files of a few megabytes in which everything is there a million times, or a thousand times of something is a thousand
    times of another."""
    floats, shorts, ubytes, n = 5126, 5123, 5121, 1000000
    triangle, plain = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0), {"attributes": {"POSITION": 0}}
    three = (0, floats, 3, "VEC3")
    with open("properties.ply", "w") as f:
        f.write("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                "element face 0\n" + "property int a\n" * n + "end_header\n0 0 0\n")
    with open("bones.skeleton.txt", "w") as bones, open("bones.joints.txt", "w") as joints:
        for i in range(n // 5):
            bones.write(f"b{i} - {i} 0 0 {i} 1 0\n")
            joints.write(f"0 b{i} {i} 0 0\n")
    write_gltf("primitives.gltf", triangle, [three], plain, nodes=[{"mesh": 0}], meshes=[
        {"primitives": [{"attributes": {"POSITION": 0, f"_{i}": 0}} for i in range(n // 10)]}])
    write_gltf("targets.gltf", triangle, [three], {**plain, "targets": [{}] * 10000}, nodes=[{"mesh": 0}] * 10000)
    write_gltf("joints.gltf", triangle, [three], plain, nodes=[{"mesh": 0, "skin": 0}] * (n // 5), skins=[{"joints": [0] * n}])
    # one place, one weight, and for each vertex another joint
    m = 60000
    write_gltf("pile.gltf", bytes(12 * m) + b"".join(struct.pack("<4H", i, 0, 0, 0) for i in range(m)) +
               struct.pack("<4f", 1, 0, 0, 0) * m,
               [(0, floats, m, "VEC3"), (12 * m, shorts, m, "VEC4"), (20 * m, floats, m, "VEC4")],
               {"mode": 0, "attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}},
               nodes=[{"mesh": 0, "skin": 0}, {}], skins=[{"joints": [1] * m}])
    keys = triangle + struct.pack(f"<{n}f", *range(n)) + bytes(3 * n)
    list_of = [three, (36, floats, n, "SCALAR"), (36 + 4 * n, ubytes, n, "VEC3")]
    channel = {"sampler": 0, "target": {"node": 0, "path": "scale"}}
    for name, clips, channels in (("clips.gltf", 1000, 1), ("channels.gltf", 1, 100000)):
        write_gltf(name, keys, list_of, plain, nodes=[{"mesh": 0}], animations=[
            {"channels": [channel] * channels, "samplers": [{"input": 1, "output": 2}]}] * clips)


# ---- geometry ----

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
SIDES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def bent(points, t, size):
    """Points turned about the y axis by t times their height in the box of size."""
    for x, y, z in points:
        c, s = math.cos(t * y / size), math.sin(t * y / size)
        yield (c * x + s * z, y, c * z - s * x)


def write_poses(kind, points, faces, size=1):
    """KIND-1.obj to KIND-3.obj, each bent more, and KIND-target.obj, a third wider."""
    def write(name, vertices):
        with open(name, "w") as f:
            f.writelines("v %.17g %.17g %.17g\n" % v for v in vertices)
            f.writelines("f " + " ".join(str(v + 1) for v in face) + "\n" for face in faces)
    for i in range(3):
        write(f"{kind}-{i + 1}.obj", bent(points, 0.2 * i, size))
    write(f"{kind}-target.obj", [(x * 4 / 3, y, z) for x, y, z in points])


def scaled(s):
    return [(x * s, y * s, z * s) for x, y, z in CUBE]


def nonmanifold():
    """Three faces at one edge, a face twice, and two cones that share a vertex only."""
    points = CUBE + [(0.5, -1, 0.5), (2, 2, 2), (3, 2, 2), (2, 3, 2.5)]
    write_poses("nonmanifold", points, SIDES + [(0, 1, 8), (0, 1, 9), (0, 1, 2, 3), (6, 9, 10), (6, 10, 11)])


def flipped():
    write_poses("flipped", CUBE, [side[::-1] if i % 2 else side for i, side in enumerate(SIDES)])


def zeroarea():
    """Faces of no area: three vertices in line, three at one place; and bones."""
    points = CUBE + [(2, 0, 0), (3, 0, 0), (4, 0, 0), (5, 1, 1), (5, 1, 1), (5, 1, 1)]
    write_poses("zeroarea", points, SIDES + [(1, 8, 9), (8, 9, 10), (11, 12, 13), (10, 11)])


def duplicates():
    """Every face has vertices of its own, so that nothing hangs together, at the same places."""
    points = [CUBE[v] for side in SIDES for v in side]
    write_poses("duplicates", points, [tuple(range(4 * f, 4 * f + 4)) for f in range(6)])


def tiny():
    write_poses("tiny", scaled(1e-20), SIDES, 1e-20)


def huge():
    write_poses("huge", scaled(1e20), SIDES, 1e20)


def beyond():
    """Squares of these lengths are no numbers any more, or zero."""
    write_poses("beyond", scaled(1e200), SIDES, 1e200)
    write_poses("beneath", scaled(1e-200), SIDES, 1e-200)


def far():
    """A small thing far away from the origin."""
    write_poses("far", [(x + 1e8, y, z) for x, y, z in CUBE], SIDES)


def oneface():
    write_poses("oneface", CUBE[:3], [(0, 1, 2)])


def noface():
    write_poses("noface", CUBE, [])


def onepoint():
    write_poses("onepoint", [(1, 2, 3)] * 8, SIDES)


def islands(n=20000):
    """n triangles that do not hang together."""
    points = [(3 * i + x, y, 0) for i in range(n) for x, y in ((0, 0), (1, 0), (0, 1))]
    write_poses("islands", points, [(3 * i, 3 * i + 1, 3 * i + 2) for i in range(n)])


def polygon(n=10000):
    """One face of n corners and a fan at its back."""
    points = [(math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n), 0) for i in range(n)] + [(0, 0, -1)]
    write_poses("polygon", points, [tuple(range(n))] + [((i + 1) % n, i, n) for i in range(n)])


def isolated():
    """Vertices in no face."""
    write_poses("isolated", CUBE + [(9, 9, 9), (8, 8, 8)], SIDES)


for kind in sys.argv[1:]:
    name, _, count = kind.partition("=")
    globals()[name](*([int(count)] if count else []))
