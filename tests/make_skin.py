"""make_skin.py: a bar that three bones bend, as transforms with their rig in bar.vgs, and where linear blend skinning takes its vertices in
truth.json: independent of the library. Used by gltf.bats and blender.bats: import make_skin; make_skin.make().

SPDX-License-Identifier: GPL-3.0-or-later
"""
import json
import math

from make_corpus import content, pose, whole

AROUND, RINGS, FRAMES = 6, 9, 5


def times(a, b):
    """The product of two quaternions w x y z."""
    return [a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]]


def turned(q, p):
    return times(times(q, [0.0, *p]), [q[0], -q[1], -q[2], -q[3]])[1:]


def axis_angle(axis, angle):
    return [math.cos(angle / 2), *(math.sin(angle / 2) * x for x in axis)]


def mesh():
    points = [[0.4 * math.cos(2 * math.pi * i / AROUND), r * 0.375, 0.4 * math.sin(2 * math.pi * i / AROUND)]
              for r in range(RINGS) for i in range(AROUND)]
    faces = [list(range(AROUND)), [(RINGS - 1) * AROUND + i for i in range(AROUND)][::-1]]
    faces += [[r * AROUND + i, (r + 1) * AROUND + i, (r + 1) * AROUND + (i + 1) % AROUND, r * AROUND + (i + 1) % AROUND]
              for r in range(RINGS - 1) for i in range(AROUND)]
    return points, faces


def skin(points):
    bones, weights = [], []
    for p in points:
        w = sorted(((max(0.0, 1 - abs(p[1] - b - 0.5)) + 0.05, b) for b in range(3)), reverse=True)
        total = sum(x for x, _ in w)
        bones.append([b for _, b in w] + [0])
        weights.append([x / total for x, _ in w] + [0])
    return {"bones": bones, "weights": weights}


def motion(frame):
    """Each bone turns about its joint, which stays at its parent; the root moves too. A turn is written as either of its two
    quaternions, one frame after the other."""
    found, turn, at = [], [1.0, 0.0, 0.0, 0.0], [0.1 * frame, 0.05 * frame, 0.0]
    for b in range(3):
        turn = times(turn, axis_angle(([0, 0, 1], [1, 0, 0], [0.6, 0.8, 0])[b], 0.3 * frame))
        moved = turned(turn, [0, b, 0])
        found.append([*(-c if frame % 2 else c for c in turn), *(at[k] - moved[k] for k in range(3))])
        at = [a + s for a, s in zip(at, turned(turn, [0, 1, 0]))]
    return found


def make():
    points, faces = mesh()
    hang = skin(points)
    names = ("low", None, [0, 0, 0], [1, 2, 3, 6, 4, 5]), ("mid", 0, [0, 1, 0], [6, 4, 5]), ("top", 1, [0, 1, 0], [6, 4, 5]), ("top.end", 2, [0, 1, 0], [])
    joints = [dict(zip(("name", "parent", "offset", "channels"), j)) for j in names]
    rig = {"joints": joints, "at": [[0, y, 0] for y in range(4)], "turns": [[1, 0, 0, 0]] * 4, "skin": hang}
    frames = [pose(f"bend {i}", motion(i), time=i / 25) for i in range(FRAMES)]
    c = content(mesh={"vertices": len(points), "faces": faces}, reference={"name": "bar", "positions": points}, rig=rig,
                kind="transforms", count=3, frames=frames)
    with open("bar.vgs", "wb") as out:
        out.write(whole(c))
    truth = []
    for i in range(FRAMES):
        found = motion(i)
        truth.append([sum(w * (turned(found[b][:4], p)[k] + found[b][4 + k]) for b, w in zip(hang["bones"][v], hang["weights"][v]))
                      for v, p in enumerate(points) for k in range(3)])
    with open("truth.json", "w") as out:
        json.dump({"faces": faces, "frames": truth}, out)
