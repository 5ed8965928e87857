"""hand_over.py: what from_blender.py and to_blender.py share: their command lines, axes, and the files that go between Blender and the
suite: OBJ with its polygons and all its vertices, PC2, MDD. Needs NumPy, which Blender brings; knows nothing of Blender.

Arrays of points are (n, 3), of a sequence (frames, n, 3). Files have y up, Blender has z up.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import argparse
import os
import struct
import sys
import traceback

import numpy

USAGE, INPUT, SYSTEM = 2, 3, 4  # exit status, as the programs of the suite have it


class Trouble(Exception):
    """What to say, and the exit status."""

    def __init__(self, message: str, status: int = INPUT):
        super().__init__(message)
        self.status = status


def run(name: str, main) -> None:
    """Call main(arguments behind '--') and end Blender by its outcome: left to itself it ends with 0 whatever happened."""
    arguments = sys.argv[sys.argv.index('--') + 1:] if '--' in sys.argv else []
    status = 0
    try:
        main(arguments)
    except Trouble as trouble:
        print(f'{name}: {trouble}', file=sys.stderr)
        status = trouble.status
    except OSError as error:
        print(f"{name}: cannot use '{error.filename}': {error.strerror}", file=sys.stderr)
        status = SYSTEM
    except SystemExit as leaving:  # of argparse: it has said why
        status = leaving.code or 0
    except Exception:
        traceback.print_exc()
        status = SYSTEM
    sys.stdout.flush()
    sys.exit(status)


def parser(name: str, operands: str, text: str) -> argparse.ArgumentParser:
    return argparse.ArgumentParser(prog=name, description=text, allow_abbrev=False,
                                   usage=f'blender -b [FILE.blend] --python {name}.py -- [options] {operands}')


# ---- axes ----------------------------------------------------------------------------------------------------------


def y_up(points):
    """From Blender's axes to those of files: x, z, -y."""
    return numpy.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def z_up(points):
    """And back."""
    return numpy.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


# ---- files ---------------------------------------------------------------------------------------------------------


def finish(path: str) -> None:
    """What was written beside its place takes it."""
    os.replace(path + '.part', path)


def write_obj(path: str, points, faces, texture=None) -> None:
    """faces: tuples of vertices, of two: line segments. texture: (u, v) of each corner of the faces of three or more, in order."""
    with open(path + '.part', 'w', encoding='utf-8') as out:
        for p in points:
            out.write('v %.9g %.9g %.9g\n' % tuple(p))
        number = {}
        if texture is not None:
            for uv in map(tuple, texture):
                if uv not in number:
                    number[uv] = len(number) + 1
                    out.write('vt %.9g %.9g\n' % uv)
        corner = 0
        for face in faces:
            if len(face) == 2:
                out.write('l %d %d\n' % (face[0] + 1, face[1] + 1))
            elif texture is None:
                out.write('f ' + ' '.join(str(v + 1) for v in face) + '\n')
            else:
                out.write('f ' + ' '.join(f'{v + 1}/{number[tuple(texture[corner + k])]}' for k, v in enumerate(face)) + '\n')
                corner += len(face)
    finish(path)


def obj_index(word: str, count: int, where: str) -> int:
    try:
        index = int(word)
    except ValueError:
        raise Trouble(f"{where}: '{word}' is no vertex") from None
    index = index - 1 if index > 0 else count + index
    if not 0 <= index < count:
        raise Trouble(f"{where}: there is no vertex '{word}'")
    return index


def read_obj(path: str):
    """Points, faces (of two: line segments), and (u, v) of each corner of the faces of three or more, or None."""
    points, coordinates, faces, corners = [], [], [], []
    with open(path, encoding='utf-8', errors='replace') as lines:
        for n, line in enumerate(lines, 1):
            words, where = line.split('#')[0].split(), f"'{path}', line {n}"
            try:
                if words[:1] == ['v']:
                    points.append(tuple(float(w) for w in words[1:4]))
                elif words[:1] == ['vt']:
                    coordinates.append((float(words[1]), float(words[2]) if len(words) > 2 else 0.0))
            except (ValueError, IndexError):
                raise Trouble(f'{where}: not a number where one should be') from None
            if words[:1] == ['f'] or words[:1] == ['l']:
                parts = [w.split('/') for w in words[1:]]
                face = [obj_index(p[0], len(points), where) for p in parts]
                if words[0] == 'l':
                    faces += [(a, b) for a, b in zip(face, face[1:])]
                    continue
                faces.append(tuple(face))
                corners += [obj_index(p[1], len(coordinates), where) if len(p) > 1 and p[1] else -1 for p in parts]
    if not points or any(len(p) != 3 for p in points):
        raise Trouble(f"'{path}' is no mesh: it has no vertices of three numbers")
    texture = None
    if coordinates and corners and min(corners) >= 0:
        texture = numpy.array(coordinates)[corners]
    return numpy.array(points), faces, texture


def write_pc2(path: str, frames, seconds: float) -> None:
    """seconds: from frame to frame."""
    with open(path + '.part', 'wb') as out:
        out.write(struct.pack('<12siiffi', b'POINTCACHE2\0', 1, frames.shape[1], 0.0, seconds, frames.shape[0]))
        out.write(frames.astype('<f4').tobytes())
    finish(path)


def cut_short(path: str) -> Trouble:
    return Trouble(f"'{path}' is not whole: it says of itself that it is longer, or is no cache at all")


def read_pc2(path: str):
    """The frames, and their times in seconds (of our own caches; others count frames: the rate is 1) or None."""
    data = open(path, 'rb').read()
    if len(data) < 32 or data[:12] != b'POINTCACHE2\0':
        raise cut_short(path)
    _, points, start, rate, samples = struct.unpack('<iiffi', data[12:32])
    if points < 1 or samples < 1 or len(data) - 32 < 12 * points * samples:
        raise cut_short(path)
    frames = numpy.frombuffer(data, '<f4', 3 * points * samples, 32).reshape(samples, points, 3)
    return frames, None if rate == 1 or rate <= 0 else start + rate * numpy.arange(samples)


def read_mdd(path: str):
    data = open(path, 'rb').read()
    if len(data) < 8:
        raise cut_short(path)
    samples, points = struct.unpack('>ii', data[:8])
    if points < 1 or samples < 1 or len(data) - 8 < 4 * samples + 12 * points * samples:
        raise cut_short(path)
    times = numpy.frombuffer(data, '>f4', samples, 8).astype(float)
    return numpy.frombuffer(data, '>f4', 3 * points * samples, 8 + 4 * samples).reshape(samples, points, 3), times
