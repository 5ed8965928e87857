"""A character as glTF, made by hand: two cubes on two joints, with normals, two sets of texture coordinates, colours, two
materials, a picture; a third cube in a node of its own, turned and scaled, with a camera below; an animation "Wave" that
turns the upper joint a quarter and back, and one "Nod" that moves the third cube.

    make_character.py FILE.glb

SPDX-License-Identifier: GPL-3.0-or-later
"""
import json
import struct
import sys
import zlib

SIDES = [((1, 0, 0), (0, 1, 0), (0, 0, 1)), ((-1, 0, 0), (0, 0, 1), (0, 1, 0)), ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
         ((0, -1, 0), (1, 0, 0), (0, 0, 1)), ((0, 0, 1), (1, 0, 0), (0, 1, 0)), ((0, 0, -1), (0, 1, 0), (1, 0, 0))]


def picture():
    """A PNG of 2 x 2."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"\0\xff\0\0\0\xff\0" + b"\0\0\0\xff\xff\xff\xff"
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def cube(y):
    """24 vertices with the normals of their sides, and 12 triangles; its middle is (0, y, 0), its side 1."""
    points, normals, uv, faces = [], [], [], []
    for n, a, b in SIDES:
        at = len(points)
        for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            points.append([(n[k] + s * a[k] + t * b[k]) / 2 + (y if k == 1 else 0) for k in range(3)])
            normals.append(n)
            uv.append([(s + 1) / 2, (t + 1) / 2])
        faces += [at, at + 1, at + 2, at, at + 2, at + 3]
    return points, normals, uv, faces


class Maker:
    def __init__(self):
        self.data, self.views, self.accessors = b"", [], []

    def view(self, data, **more):
        self.data += bytes(-len(self.data) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more})
        self.data += data
        return len(self.views) - 1

    def add(self, rows, kind="f", target=None, bounds=False, **more):
        rows = [r if isinstance(r, (list, tuple)) else [r] for r in rows]
        width = len(rows[0])
        data = struct.pack(f"<{len(rows) * width}{kind}", *(x for r in rows for x in r))
        view = self.view(data, **({"target": target} if target else {}))
        a = {"bufferView": view, "componentType": {"f": 5126, "B": 5121, "H": 5123}[kind], "count": len(rows),
             "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[width], **more}
        if bounds:
            a["min"], a["max"] = [min(c) for c in zip(*rows)], [max(c) for c in zip(*rows)]
        self.accessors.append(a)
        return len(self.accessors) - 1


def attributes(m, points, normals, uv, joint=None):
    a = {"POSITION": m.add(points, target=34962, bounds=True), "NORMAL": m.add(normals, target=34962),
         "TEXCOORD_0": m.add(uv, target=34962), "TEXCOORD_1": m.add([[1 - v, u] for u, v in uv], target=34962),
         "COLOR_0": m.add([[255, 40 * (i % 6), 0, 255] for i in range(len(points))], "B", 34962, normalized=True)}
    if joint is not None:
        a["JOINTS_0"] = m.add([[joint, 0, 0, 0]] * len(points), "B", 34962)
        a["WEIGHTS_0"] = m.add([[1, 0, 0, 0]] * len(points), target=34962)
    return a


def character():
    m = Maker()
    parts = [cube(0.5), cube(1.5), cube(0)]
    skinned = [{"attributes": attributes(m, *p[:3], joint=j), "indices": m.add(p[3], "H", 34963), "material": j}
               for j, p in enumerate(parts[:2])]
    free = {"attributes": attributes(m, *parts[2][:3]), "indices": m.add(parts[2][3], "H", 34963), "material": 1}
    identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    inverse = m.add([identity, identity[:13] + [-1, 0, 1]])
    half = 0.5 ** 0.5
    times = m.add([0.25, 0.5, 1.0], bounds=True)
    turns = m.add([[0, 0, 0, 1], [0, 0, half, half], [0, 0, 0, 1]])
    nod_times, places = m.add([0.0, 0.5], bounds=True), m.add([[3, 0, 0], [3, 2, 0]])
    image = m.view(picture())
    return m, {
        "asset": {"version": "2.0", "generator": "make_character.py", "copyright": "CC0"},
        "scene": 0, "scenes": [{"name": "Stage", "nodes": [0, 3, 4]}],
        "nodes": [{"name": "Root", "children": [1]}, {"name": "Upper", "translation": [0, 1, 0], "children": [2]},
                  {"name": "Tip", "translation": [0, 1, 0]}, {"name": "Body", "mesh": 0, "skin": 0},
                  {"name": "Ball", "mesh": 1, "translation": [3, 0, 0], "rotation": [0, half, 0, half],
                   "scale": [2, 1, 0.5], "children": [5]}, {"name": "Eye", "camera": 0}],
        "cameras": [{"name": "Wide", "type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "skins": [{"name": "Bones", "joints": [0, 1], "inverseBindMatrices": inverse, "skeleton": 0}],
        "meshes": [{"name": "BodyMesh", "primitives": skinned}, {"name": "BallMesh", "primitives": [free]}],
        "materials": [{"name": "Cloth", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "roughnessFactor": 0.7}},
                      {"name": "Skin", "doubleSided": True, "extensions": {"KHR_materials_unlit": {}},
                       "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 1]}}],
        "extensionsUsed": ["KHR_materials_unlit"],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33071}],
        "images": [{"name": "Weave", "mimeType": "image/png", "bufferView": image}],
        "animations": [
            {"name": "Wave", "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
             "samplers": [{"input": times, "output": turns}]},
            {"name": "Nod", "channels": [{"sampler": 0, "target": {"node": 4, "path": "translation"}}],
             "samplers": [{"input": nod_times, "output": places}]}],
        "accessors": m.accessors, "bufferViews": m.views, "buffers": [{"byteLength": len(m.data)}]}


def glb(document, data):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    return (b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(data)) + struct.pack("<I", len(text)) + b"JSON" + text +
            struct.pack("<I", len(data)) + b"BIN\0" + data)


def main(path):
    m, document = character()
    with open(path, "wb") as f:
        f.write(glb(document, m.data))


if __name__ == "__main__":
    main(sys.argv[1])
