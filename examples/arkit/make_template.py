#!/usr/bin/env python3
"""make_template.py DIR OUT: a neutral head and 52 shapes from the meshes of ICT-FaceKit in DIR (000_neutral.obj, 001_NAME.obj, ...).

The template that ships was made of the folder OUT by
  vg-encode --no-provenance --f32 neutral.obj $(ls | grep -v neutral) | xz -9e > head52.vgs.xz

The 52 shapes have the names of ARKit. Most are ICT-FaceKit's own; three are made here, for want of them there:
  browInnerUp, cheekPuff  the sum of the shapes of both sides
  eyeLook*                the eyeballs, which ICT-FaceKit turns by joints, turn by 25 degrees
  tongueOut               the tongue comes forward, within a geodesic distance of its tip
Standard library only.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import heapq
import math
import os
import re
import sys

PAIRED = """eyeBlink eyeLookDown eyeLookIn eyeLookOut eyeLookUp eyeSquint eyeWide mouthSmile mouthFrown mouthDimple
mouthStretch mouthPress mouthLowerDown mouthUpperUp browDown browOuterUp cheekSquint noseSneer""".split()
SINGLE = """jawForward jawLeft jawRight jawOpen mouthClose mouthFunnel mouthPucker mouthLeft mouthRight mouthRollLower
mouthRollUpper mouthShrugLower mouthShrugUpper""".split()
SUMS = ["browInnerUp", "cheekPuff"]
EYES = {"Left": ((21451, 22221), (21451, 23021)), "Right": ((23021, 23791), (23021, 24591))}  # ball, all that turns
TURN = math.radians(25)
TONGUE_TIP, TONGUE = 16757, range(14062, 17039)  # gums and tongue are one component
REACH, OUT = 3.0, (0.0, -0.6, 2.6)               # centimetres


def read(path):
    points, faces = [], []
    with open(path, encoding="ascii") as file:
        for line in file:
            if line.startswith("v "):
                points.append(tuple(map(float, line.split()[1:4])))
            elif line.startswith("f "):
                faces.append([int(x) - 1 for x in line.split()[1:]])
    return points, faces


def add(a, b):
    return [tuple(x + y for x, y in zip(p, q)) for p, q in zip(a, b)]


def offsets(shape, neutral):
    return [tuple(x - y for x, y in zip(p, q)) for p, q in zip(shape, neutral)]


def middle(points):
    """The middle of the box around a ball."""
    return [(min(p[k] for p in points) + max(p[k] for p in points)) / 2 for k in range(3)]


def look(neutral, side, way):
    """The offsets of an eyeball that turns: in is towards the nose, the left eye has x > 0, the face looks along +z."""
    ball, turning = EYES[side]
    centre = middle(neutral[ball[0]:ball[1]])
    cosine, sine = math.cos(TURN), math.sin(TURN)
    result = [(0.0, 0.0, 0.0)] * len(neutral)
    for i in range(*turning):
        x, y, z = (neutral[i][k] - centre[k] for k in range(3))
        if way in ("Up", "Down"):
            s = sine if way == "Up" else -sine
            turned = (x, y * cosine + z * s, z * cosine - y * s)
        else:
            s = sine if (way == "Out") == (side == "Left") else -sine
            turned = (x * cosine + z * s, y, z * cosine - x * s)
        result[i] = tuple(centre[k] + turned[k] - neutral[i][k] for k in range(3))
    return result


def from_tip(neutral, faces):
    """Distances along edges from the tip of the tongue, up to REACH."""
    edges = {}
    for face in faces:
        if face[0] in TONGUE:
            for a, b in zip(face, face[1:] + face[:1]):
                edges.setdefault(a, set()).add(b)
                edges.setdefault(b, set()).add(a)
    found, queue = {}, [(0.0, TONGUE_TIP)]
    while queue:
        distance, v = heapq.heappop(queue)
        if v in found or distance > REACH:
            continue
        found[v] = distance
        for u in edges[v]:
            heapq.heappush(queue, (distance + math.dist(neutral[v], neutral[u]), u))
    return found


def tongue_out(neutral, faces):
    result = [(0.0, 0.0, 0.0)] * len(neutral)
    for v, distance in from_tip(neutral, faces).items():
        t = 1 - distance / REACH
        share = t * t * (3 - 2 * t)
        result[v] = tuple(share * x for x in OUT)
    return result


def main(folder, out):
    paths = {re.sub(r"^\d+_|\.obj$", "", name): os.path.join(folder, name) for name in sorted(os.listdir(folder))}
    neutral, faces = read(paths["neutral"])
    shape = lambda name: offsets(read(paths[name])[0], neutral)
    made = {"neutral": [(0.0, 0.0, 0.0)] * len(neutral)}
    for name in PAIRED:
        for side in ("Left", "Right"):
            made[name + side] = shape(f"{name}_{side[0]}")
            if name.startswith("eyeLook"):
                made[name + side] = add(made[name + side], look(neutral, side, name[7:]))
    made.update({name: shape(name) for name in SINGLE})
    made.update({name: add(shape(name + "_L"), shape(name + "_R")) for name in SUMS})
    made["tongueOut"] = tongue_out(neutral, faces)
    assert len(made) == 53
    tail = "".join("f " + " ".join(str(v + 1) for v in face) + "\n" for face in faces)
    os.makedirs(out)
    for name, moved in made.items():
        with open(os.path.join(out, name + ".obj"), "w", encoding="ascii") as file:
            file.writelines("v %.3f %.3f %.3f\n" % p for p in add(neutral, moved))
            file.write(tail)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
