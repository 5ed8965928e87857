#!/usr/bin/env python3
"""play_map.py: play a map without the programs: transforms in, vertices out. Python 3.9 or later, standard library only.

    python3 play_map.py MAP TRANSFORMS > poses.txt

MAP is what vg-fitmap wrote, TRANSFORMS a stream of transforms, one for each patch of the map (from 'vg-play MAP --transforms', or
your own: a quaternion w x y z whose squared length is the scale, and a translation). Out comes a line "frame NAME" for each frame, then a line
"x y z" for each vertex. fmt/STREAM.md, section 3.16, is all that it needs to know. It leaves out speed: there are products for that.

Exit status: 0 done, 2 wrong usage, 3 malformed input.

SPDX-License-Identifier: GPL-3.0-or-later
"""
from __future__ import annotations

import sys

from read_stream import StreamError, read_stream, rotate


def matrix(q) -> list:
    """The matrix of x -> Q x Q*, row by row."""
    columns = [rotate(q, axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    return [[columns[j][i] for j in range(3)] for i in range(3)]


def times(a, x) -> list:
    return [sum(a[i][k] * x[k] for k in range(3)) for i in range(3)]


def motions(m, values) -> list:
    """The (A, t) of each transform; of a map with Home, t is where the joints of its own body put it."""
    found = [(matrix(values[i:i + 4]), list(values[i + 4:i + 7])) for i in range(0, 7 * m.n, 7)]
    if m.home is None:
        return found
    root, here, home = [0.0] * 3, [0.0] * 3, [0.0] * 3
    for p, (a, t) in enumerate(found):
        centre = m.home_centre[3 * p:3 * p + 3]
        moved = times(a, centre)
        for k in range(3):
            root[k] += m.share[p] * (moved[k] + t[k])
            home[k] += m.share[p] * centre[k]
            here[k] += m.share[p] * m.centre[3 * p + k]
    at = [here[k] + m.size * (root[k] - home[k]) for k in range(3)]
    placed = []
    for p in range(m.n):
        t = list(at)
        for j, (a, _) in enumerate(found):
            g = m.place[3 * m.n * p + 3 * j:3 * m.n * p + 3 * j + 3]
            t = [t[k] + moved for k, moved in enumerate(times(a, g))]
        placed.append((found[p][0], t))
    return placed


def pose(m, values) -> list:
    """The position of every vertex at these transforms."""
    moving = motions(m, values)
    vertices = []
    for start in range(0, len(m.weights), 4 * m.n):
        x = [0.0] * 3
        for p, (a, t) in enumerate(moving):
            *e, tau = m.weights[start + 4 * p:start + 4 * p + 4]
            x = [x[k] + moved + tau * t[k] for k, moved in enumerate(times(a, e))]
        vertices.append(x)
    return vertices


def main() -> int:
    if len(sys.argv) != 3:
        print("usage: play_map.py MAP TRANSFORMS", file=sys.stderr)
        return 2
    try:
        m, sequence = (read_stream(name) for name in sys.argv[1:])
        if m.map is None:
            raise StreamError(f"'{sys.argv[1]}' holds no map")
        if sequence.kind != "transforms" or sequence.count != m.map.n:
            raise StreamError(f"'{sys.argv[2]}' does not hold frames of {m.map.n} transforms")
    except (StreamError, OSError) as error:
        print(f"play_map.py: {error}", file=sys.stderr)
        return 3
    for f in sequence.frames:
        print("frame", f.name)
        for x, y, z in pose(m.map, f.values):
            print(f"{x:.17g} {y:.17g} {z:.17g}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
