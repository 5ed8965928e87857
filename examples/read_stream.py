#!/usr/bin/env python3
"""read_stream.py: a stand-alone reader of the vg stream, version 1: Python 3.9 or later, standard library only.

It was written from fmt/STREAM.md and shares no code with the programs, so it is their independent witness: it checks
everything the specification demands. It leaves out writing, and reconstruction (that takes a sparse solver).

    python3 read_stream.py [FILE]           what is in it, in a few lines ("-" or nothing: standard input)
    python3 read_stream.py --json [FILE]    the whole content as JSON
    python3 read_stream.py --check [FILE]   say nothing when it is whole

Exit status: 0 whole, 2 wrong usage, 3 malformed or truncated, 4 the system refused.

As a module: read_stream(path or binary file) gives a Stream, or raises StreamError.

SPDX-License-Identifier: GPL-3.0-or-later
"""
from __future__ import annotations

import itertools
import json
import math
import struct
import sys
from array import array
from dataclasses import dataclass, field

MAGIC = b"\x89VGS\r\n\x1a1"
CRITICAL, COPY_SAFE, MUST_BE_ZERO = 1, 2, 0xFFFC
LENGTH_LIMIT = 1 << 40
INDEX_LIMIT = (1 << 32) - 1  # vertices and corners are fewer
NO_TEXTURE = 0xFFFFFFFF
FORMS = {"vertices": ("vertex", 3), "vectors": ("corner", 3), "deformations": ("corner", 4), "transforms": ("transform", 7),
         "features": ("vertex", None), "coordinates": ("frame", None)}  # element, width; None: any
CHANNELS = {"time": ("frame", 1), "root": ("frame", 3), "anchors": ("anchor", 3), "pins": ("vertex list", 1),
            "turns": ("joint", 4)}
MOST_CHANNELS = 255
INDICES, F32, F64 = 1, 4, 8  # Type of a channel
LABEL_KINDS = {1: "object", 2: "group", 3: "material", 4: "smoothing", 5: "library"}
NETWORK_COUNTS = ("model", "direction", "mesh_digest", "data_digest", "vertices", "parts", "width", "numbers", "rank", "layers",
                  "hidden", "convolutions", "uncertain", "sets", "parameters", "seed", "frames", "iterations", "step", "windows",
                  "open", "phase", "best_iteration", "curve_length", "curve_block")
NO_PARENT = 0xFFFFFFFF
NEEDS = {**dict.fromkeys(("TEXC", "LABL", "COLV", "ASST", "SELE", "LINK", "ANCH", "REFP", "SKEL", "PTCH", "RIG ", "MAP ", "SIGN", "NETW"), "MESH"), "SKIN": "RIG "}
TAG_BYTES = frozenset(b"ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ")


class StreamError(ValueError):
    """The input is not a whole and valid stream."""


# ---- what was read -------------------------------------------------------------------------------------------------


@dataclass
class Record:
    """One record as it stands in the stream; payload only of records whose tag this reader does not know."""
    tag: str
    flags: int
    offset: int
    length: int
    payload: bytes = b""


@dataclass
class Mesh:
    nv: int
    start: array  # 'I' or 'L', nf + 1 entries
    vert: array

    @property
    def nf(self) -> int:
        return len(self.start) - 1

    def face(self, f: int) -> array:
        return self.vert[self.start[f]:self.start[f + 1]]

    def faces(self):
        return [list(self.face(f)) for f in range(self.nf)]

    def components(self) -> int:
        """How many sets of connected vertices there are, without those in no face."""
        groups = list(range(self.nv))
        for face in self.faces():
            for v in face:
                groups[find(groups, v)] = find(groups, face[0])
        return sum(find(groups, v) == v for v in set(self.vert))


@dataclass
class Texture:
    dim: int
    coordinates: array  # 'd', nt * dim
    corners: array      # per corner an index, or NO_TEXTURE


@dataclass
class Joint:
    """Joint j of a skeleton is vertex j of the mesh."""
    name: str
    parent: object   # None: a root
    offset: list     # from the parent, in the reference pose
    channels: list   # 1 2 3: x y z position, 4 5 6: x y z rotation


@dataclass
class Correspondence:
    """Which faces of a source mesh drive face f of a target mesh: pairs first[f] .. first[f + 1] - 1."""
    source: tuple     # vertices, faces, digest
    target: tuple
    first: array
    source_face: array
    weight: array
    distance: array
    matched: list


@dataclass
class Rig:
    """Joints that are no vertices of the mesh; those with channels are bones, which move it."""
    joints: list      # of Joint
    at: array         # where each joint is in the reference pose of the mesh
    turns: array      # how it is turned there
    skin_bone: object  # array: 4 bones for each vertex, or None
    skin_weight: object

    def bones(self) -> int:
        return sum(1 for j in self.joints if j.channels)


@dataclass
class Map:
    """Vertices as a linear function of n transforms."""
    kind: str            # "patches" or "bones": what is transformed
    n: int
    size: float
    names: list
    weights: array       # nv x 4 n
    place: array         # n x 3 n
    centre: array
    home_centre: array
    share: array
    home: object         # array, or None
    hinge_at: array
    hinge_weight: array
    corners: array
    held_at: array
    hinges: array
    held: array
    held_patch: array
    per_corner: int
    corner_bones: array  # of bones: per_corner for each corner


@dataclass
class Network:
    """A network that has learned how a sequence goes on."""
    counts: dict         # by the names of NETWORK_COUNTS
    numbers: array       # best error, curve start; diagonal, low (2), high (2), change, ridge, damping
    errors: array
    mean: array
    scale: array
    range: array
    regression: array
    root: array
    parameters: array
    basis: array
    curve: array         # of each iteration: loss, length of the gradient, validation error or -1
    moments: array
    best: array


@dataclass
class Signal:
    """A sequence as continuous signals for time, pose and shape."""
    n: int
    space: int
    d: int
    m: int
    bits: int
    examples: bool
    layout: int
    numbers: array       # layout weight and ratio; errors of shape, pose, time, rms
    mean: array
    basis: array         # m x d; of 16 bits each pair of bytes as a number, in units
    unit: array
    coordinate: array    # n x m
    position: array
    site: array
    parameter: array
    knot: array
    control: array
    turn: array
    shift: array
    times: array
    names: list


@dataclass
class Provenance:
    program: str
    version: str
    parents: list
    args: list


@dataclass
class Channel:
    """What comes with a frame beside its values: `width` numbers for each of `count` elements, or a list of vertices."""
    name: str
    unit: str
    element: str
    width: int
    count: int
    type: int      # INDICES, F32 or F64
    values: array


@dataclass
class Frame:
    name: str
    values: array
    channels: dict  # by name, in their order
    extra: list = field(default_factory=list)

    def _of(self, name):
        return self.channels[name].values if name in self.channels else None

    @property
    def time(self):
        """Seconds, or None."""
        return self._of("time")[0] if "time" in self.channels else None

    @property
    def root(self):
        """[x, y, z] of frames on corners, else None."""
        return list(self._of("root")) if "root" in self.channels else None

    @property
    def anchors(self):
        """Positions; of frames on corners never None."""
        return self._of("anchors") if "anchors" in self.channels or "root" not in self.channels else array("d")

    @property
    def pins(self):
        """Vertices that stay where the reference has them; None: no pins."""
        return self._of("pins")

    @property
    def turns(self):
        """A unit quaternion for each joint of the skeleton; None: not known."""
        return self._of("turns")

    @property
    def scalars(self):
        """(name, unit, a number for each vertex): the first such channel; None: there is none."""
        for c in self.channels.values():
            if (c.element, c.width) == ("vertex", 1):
                return c.name, c.unit, c.values
        return None


@dataclass
class Stream:
    minor: int = 0
    records: list = field(default_factory=list)  # all of them, END too
    provenance: list = field(default_factory=list)
    mesh: object = None
    texture: object = None
    labels: object = None     # list of (face, kind name, text)
    colours: object = None    # bytes: red, green, blue, opacity of each vertex
    asset: object = None      # (digest of the mesh, vertex of the mesh for each of the file, bytes)
    selection: object = None  # array, or None: all faces
    links: object = None      # array of pairs
    anchors: object = None
    reference: object = None  # array 'd'
    reference_name: object = None
    skeleton: object = None   # list of Joint
    correspondence: object = None
    patches: object = None    # (count, array with the patch of each face)
    rig: object = None
    map: object = None
    signal: object = None
    network: object = None
    kind: str = ""            # the form of frames by name
    element: str = ""
    width: int = 0
    precision: int = 0
    count: int = -1
    frames: list = field(default_factory=list)
    extra: list = field(default_factory=list)
    tail: list = field(default_factory=list)
    checksum: int = 0

    def graph(self):
        """The faces that carry vectors, as lists of vertices: the selected ones in order, then the links."""
        chosen = range(self.mesh.nf) if self.selection is None else self.selection
        links = self.links if self.links is not None else ()
        return [list(self.mesh.face(f)) for f in chosen] + [list(links[i:i + 2]) for i in range(0, len(links), 2)]

    def fan(self, face: list) -> list:
        """The triangles of a face, from the corner whose smallest triangle in the reference is largest; a segment stays."""
        n, at, most = len(face), 0, -1.0
        for s in range(n if 3 < n <= 64 else 0):
            least = min(area(self.reference, [face[(s + i) % n] for i in (0, j, j + 1)]) for j in range(1, n - 1))
            if least > most * (1 + 1e-9):
                at, most = s, least
        return [[face[(at + i) % n] for i in (0, j, j + 1)] for j in range(1, n - 1)] if n > 2 else [face]

    def pieces(self) -> list:
        """The triangles and segments of the graph, as lists of lists of vertices: those of each face."""
        return [self.fan(face) for face in self.graph()]

    def digest(self) -> int:
        """What a correspondence calls this mesh: XXH64 over its counts and faces as 64-bit words."""
        words = [self.mesh.nv, self.mesh.nf]
        for f in range(self.mesh.nf):
            words += [len(self.mesh.face(f)), *self.mesh.face(f)]
        return xxh64(struct.pack(f"<{len(words)}Q", *words))

    def vectors_of(self, positions) -> list:
        """The vector of every corner of the graph at these vertex positions (x y z x y z ...), flat."""
        out = []
        for face in self.graph():
            for_axis = [[positions[3 * v + k] for v in face] for k in range(3)]
            mean = [math.fsum(a) / len(face) for a in for_axis]
            for i in range(len(face)):
                out += [for_axis[k][i] - mean[k] for k in range(3)]
        return out

    def root_of(self, positions) -> list:
        """The mean position of the vertices that are in a face of the graph."""
        used = sorted({v for face in self.graph() for v in face})
        return [math.fsum(positions[3 * v + k] for v in used) / max(len(used), 1) for k in range(3)]


def area(positions, triangle) -> float:
    """Twice the area of a triangle."""
    p, q, r = (positions[3 * v:3 * v + 3] for v in triangle)
    u, v = ([b - a for a, b in zip(p, x)] for x in (q, r))
    return math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def find(groups: list, i: int) -> int:
    while groups[i] != i:
        groups[i] = i = groups[groups[i]]
    return i


def neighbours(faces: list) -> tuple:
    """Pairs of pieces as (a, b, edge), the edge None where vertices alone connect them; all edges; how many parts are left."""
    pieces, first = [piece for face in faces for piece in face], list(itertools.accumulate(map(len, faces), initial=0))
    sides = sorted((min(a, b), max(a, b), i) for i, p in enumerate(pieces)
                   for a, b in zip(p, p[1:] + (p[:1] if len(p) > 2 else [])))
    pairs = [(x[2], y[2], x[:2]) for x, y in zip(sides, sides[1:]) if x[:2] == y[:2]]
    groups, around = list(range(len(pieces))), {}
    for a, b, _ in pairs:
        groups[find(groups, a)] = find(groups, b)
    for f, face in enumerate(faces):
        for v in {v for piece in face for v in piece}:
            around.setdefault(v, []).append(first[f])
    for v in sorted(around):
        for a, b in zip(around[v], around[v][1:]):
            if find(groups, a) != find(groups, b):
                pairs.append((a, b, None))
                groups[find(groups, a)] = find(groups, b)
    return pairs, {x[:2] for x in sides}, sum(find(groups, i) == i for i in range(len(pieces)))


def parameters_of(c: dict, linear: bool) -> int:
    """How many parameters the layers of a network have, in one set."""
    w, n, h = c["width"], c["numbers"], c["hidden"]
    front = (h + 1) * n if linear else 2 * c["convolutions"] * (w * w + w) + n * h + ((n + 1) * h if c["uncertain"] else 0)
    return front + sum(((n if linear and not layer else h) + h + 1) * 4 * h for layer in range(c["layers"]))


def rotate(q, r) -> list:
    """Q r Q*: the vector r turned by the quaternion q = w x y z and scaled by |q|^2."""
    w, x, y, z = q
    tx, ty, tz = y * r[2] - z * r[1], z * r[0] - x * r[2], x * r[1] - y * r[0]
    dot = x * r[0] + y * r[1] + z * r[2]
    square = w * w - x * x - y * y - z * z
    return [square * r[0] + 2 * (dot * x + w * tx),
            square * r[1] + 2 * (dot * y + w * ty),
            square * r[2] + 2 * (dot * z + w * tz)]


# ---- XXH64 with seed 0 (github.com/Cyan4973/xxHash, doc/xxhash_spec.md) -----------------------------------------

_M = 0xFFFFFFFFFFFFFFFF
_P1, _P2, _P3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
_P4, _P5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5


def _rotl(x: int, n: int) -> int:
    return (x << n | x >> (64 - n)) & _M


def _stripes(data) -> int:
    a, b, c, d = (_P1 + _P2) & _M, _P2, 0, -_P1 & _M
    for p, q, r, s in struct.iter_unpack("<4Q", data):  # the hot loop: four lanes, written out
        a = a + p * _P2 & _M
        a = (a << 31 | a >> 33) * _P1 & _M
        b = b + q * _P2 & _M
        b = (b << 31 | b >> 33) * _P1 & _M
        c = c + r * _P2 & _M
        c = (c << 31 | c >> 33) * _P1 & _M
        d = d + s * _P2 & _M
        d = (d << 31 | d >> 33) * _P1 & _M
    h = (_rotl(a, 1) + _rotl(b, 7) + _rotl(c, 12) + _rotl(d, 18)) & _M
    for lane in (a, b, c, d):
        h = ((h ^ _rotl(lane * _P2 & _M, 31) * _P1 & _M) * _P1 + _P4) & _M
    return h


def xxh64(data) -> int:
    n = len(data)
    whole = n & ~31
    h = _stripes(memoryview(data)[:whole]) if whole else _P5
    h = (h + n) & _M
    at = whole
    while at + 8 <= n:
        lane = int.from_bytes(data[at:at + 8], "little")
        h = (_rotl(h ^ _rotl(lane * _P2 & _M, 31) * _P1 & _M, 27) * _P1 + _P4) & _M
        at += 8
    if at + 4 <= n:
        h = (_rotl(h ^ int.from_bytes(data[at:at + 4], "little") * _P1 & _M, 23) * _P2 + _P3) & _M
        at += 4
    while at < n:
        h = _rotl(h ^ data[at] * _P5 & _M, 11) * _P1 & _M
        at += 1
    h = (h ^ h >> 33) * _P2 & _M
    h = (h ^ h >> 29) * _P3 & _M
    return h ^ h >> 32


# ---- bytes ---------------------------------------------------------------------------------------------------------

_U32 = next(code for code in "IL" if array(code).itemsize == 4)


def _numbers(code: str, data) -> array:
    a = array(code)
    a.frombytes(data)
    if sys.byteorder == "big":
        a.byteswap()
    return a


class _Payload:
    """The payload of one record, taken from front to back. What it cannot give is an error of that record."""

    def __init__(self, record: Record, data: bytes):
        self.data, self.at = data, 0
        self.where = f"record {record.tag}"  # how messages call it
        self.short = "it is shorter than its counts say"
        self.long = "bytes are left over"

    def fail(self, what: str):
        raise StreamError(f"{self.where}: {what}")

    def left(self) -> int:
        return len(self.data) - self.at

    def take(self, n: int):
        if n > self.left():
            self.fail(self.short)
        self.at += n
        return memoryview(self.data)[self.at - n:self.at]

    def u32(self) -> int:
        return int.from_bytes(self.take(4), "little")

    def u64(self) -> int:
        return int.from_bytes(self.take(8), "little")

    def f64(self) -> float:
        return self.f64s(1, "a number")[0]

    def word(self) -> int:
        """A u64 below 2^32."""
        x = self.u64()
        if x >= 1 << 32:
            self.fail("its counts are out of range")
        return x

    def flag(self) -> bool:
        x = self.u64()
        if x > 1:
            self.fail("its counts are out of range")
        return x == 1

    def u64s(self, n: int) -> array:
        return _numbers("Q", self.take(8 * n))

    def u32s(self, n: int) -> array:
        a = _numbers(_U32, self.take(4 * n))
        self.pad()
        return a

    def u8s(self, n: int) -> list:
        a = list(self.take(n))
        self.pad()
        return a

    def f64s(self, n: int, what: str = "a number", code: str = "d") -> array:
        a = _numbers(code, self.take((8 if code == "d" else 4) * n))
        if not all(map(math.isfinite, a)):
            self.fail(f"{what} is not finite")
        return a

    def zero(self, n: int, what: str):
        if any(self.take(n)):
            self.fail(f"{what} not zero")

    def utf8(self, n: int, long: str = "a text is longer than its record", bad: str = "a text is not UTF-8") -> str:
        if n > self.left():
            self.fail(long)
        data = bytes(self.take(n))
        try:
            s = data.decode("utf-8")
        except UnicodeDecodeError:
            self.fail(bad)
        if "\0" in s:  # NUL is not allowed either
            self.fail(bad)
        return s

    def text(self) -> str:
        if self.left() < 8:
            self.fail("a text is longer than its record")
        s = self.utf8(self.u64())
        self.pad()
        return s

    def texts(self, n: int) -> list:
        if n > self.left() // 8:
            self.fail(self.short)
        return [self.text() for _ in range(n)]

    def pad(self):
        n = -self.at % 8
        if n > self.left() or any(self.take(n)):
            self.fail("padding is missing or not zero")

    def end(self):
        if self.left():
            self.fail(self.long)

    def fits(self, message: str):
        """From here on it is this that is wrong when the payload is too short or too long."""
        self.short = self.long = message


class _Input:
    """A binary file read forward only, in pieces, so that a false length cannot ask for memory."""

    def __init__(self, file):
        self.file, self.at = file, 0

    def upto(self, n: int) -> bytes:
        parts = []
        while n > 0:
            part = self.file.read(min(n, 1 << 20))
            if not part:
                break
            parts.append(part)
            n -= len(part)
            self.at += len(part)
        return b"".join(parts)


# ---- the reader ----------------------------------------------------------------------------------------------------


class _Reader:
    def __init__(self, file):
        self.input = _Input(file)
        self.stream = Stream()
        self.pending = []  # unknown records since the last frame
        self.seen = set()
        self.sums = bytearray()
        self.done = False

    def read(self) -> Stream:
        self.file_header()
        while not self.done:
            self.record()
        if self.input.upto(1):
            raise StreamError("it has data after the END mark")
        return self.stream

    def file_header(self):
        head = self.input.upto(16)
        if not head:
            raise StreamError("it is empty: did the program before it fail?")
        if len(head) >= 4 and head[:4] != MAGIC[:4]:
            raise StreamError("it is not a vg stream")
        if len(head) >= 7 and head[:7] != MAGIC[:7]:
            raise StreamError("it was damaged by a transfer that changes line ends")
        if len(head) < 16:
            raise StreamError("it ends inside the stream's first 16 bytes")
        if head[7] != MAGIC[7]:
            raise StreamError(f"it is a stream of major version {chr(head[7])!r}: this program reads version 1")
        self.stream.minor, reserved = struct.unpack("<II", head[8:])
        if reserved:
            raise StreamError("reserved bytes of the file header are not zero")

    def truncated(self):
        raise StreamError(f"it is cut short: it ends at byte {self.input.at}, without the END mark")

    def record(self):
        offset, index = self.input.at, self.index()
        head = self.input.upto(32)
        if len(head) < 32:
            self.truncated()
        tag, flags, length, payload_sum, head_sum = struct.unpack("<4sIQQQ", head)
        if xxh64(head[:24]) != head_sum:
            raise StreamError(f"the header of record {index} is damaged (checksum), at byte {offset}")
        if not TAG_BYTES.issuperset(tag):
            raise StreamError(f"the tag of record {index} is malformed, at byte {offset}")
        record = Record(tag.decode("ascii"), flags, offset, length)
        if flags & MUST_BE_ZERO:
            raise StreamError(f"record {index} ({record.tag}) has reserved flags set")
        if length > LENGTH_LIMIT:
            raise StreamError(f"record {index} ({record.tag}) claims {length} bytes; the limit is 2^40")
        self.payload(record, payload_sum)
        self.sums += head[24:]
        self.stream.records.append(record)

    def index(self) -> int:
        return len(self.stream.records)

    def payload(self, record: Record, payload_sum: int):
        handler = self.HANDLERS.get(record.tag)
        if handler is None and record.flags & CRITICAL:
            raise StreamError(f"it has a record '{record.tag}' that must be understood, and is not known here")
        padding = -record.length % 8
        data = self.input.upto(record.length + padding)
        if len(data) < record.length + padding:
            self.truncated()
        if any(data[record.length:]):
            raise StreamError(f"the padding of record {self.index()} ({record.tag}) is not zero")
        data = data[:record.length]
        if xxh64(data) != payload_sum:
            raise StreamError(f"record {self.index()} ({record.tag}) is damaged (checksum)")
        if handler is None:
            record.payload = data
            self.pending.append(record)
            return
        p = _Payload(record, data)
        self.order(record.tag)
        handler(self, p)
        self.seen.add(record.tag)

    def order(self, tag: str):
        formed = "FORM" in self.seen
        if tag in ("FRAM", "END ") and not formed:
            raise StreamError("it has a frame before its FORM record" if tag == "FRAM" else "it has no FORM record")
        if tag in ("FRAM", "END ", "FAIL"):
            return
        if formed:
            raise StreamError(f"record {tag} must come before FORM" if tag != "FORM" else "it has two FORM records")
        if tag in self.seen and tag != "PROV":
            raise StreamError(f"it has two {tag} records")
        needed = NEEDS.get(tag)
        if needed and needed not in self.seen:
            raise StreamError(f"record {tag} must come after {needed}")

    # Header records: first the fields, as the tables of section 3 have them, then what these must hold.

    def prov(self, p: _Payload):
        nparents, nargs = p.u64(), p.u64()
        parents = list(p.u32s(nparents))
        program, version, args = p.text(), p.text(), p.texts(nargs)
        p.end()
        if any(x >= len(self.stream.provenance) for x in parents):
            p.fail("it names a parent that does not come before it")
        self.stream.provenance.append(Provenance(program, version, parents, args))

    def mesh(self, p: _Payload):
        nv, nf = p.u64(), p.u64()
        start = p.u32s(nf + 1)
        vert = p.u32s(start[-1])
        p.end()
        if nv >= INDEX_LIMIT:
            p.fail("more than 2^32 - 2 vertices")
        if start[0] != 0 or any(a > b for a, b in zip(start, start[1:])):
            p.fail("its faces are not in order")
        if nf >= INDEX_LIMIT or start[-1] >= INDEX_LIMIT:
            p.fail("it has too many vertices, faces or corners")
        mesh = Mesh(nv, start, vert)
        for f in range(nf):
            face = mesh.face(f)
            if len(face) < 2:
                p.fail(f"face {f} has fewer than 2 vertices")
            if max(face) >= nv:
                p.fail(f"face {f} names vertex {max(face)} of {nv}")
            if len(set(face)) < len(face):
                p.fail(f"face {f} names a vertex twice")
        self.stream.mesh = mesh

    def texc(self, p: _Payload):
        dim, nt = p.word(), p.u64()
        coordinates, corners = p.f64s(nt * dim), p.u32s(len(self.stream.mesh.vert))
        p.end()
        if not 1 <= dim <= 3:
            p.fail("a texture coordinate must have 1 to 3 numbers")
        if any(c >= nt and c != NO_TEXTURE for c in corners):
            p.fail("a corner names a texture coordinate that does not exist")
        self.stream.texture = Texture(dim, coordinates, corners)

    def labl(self, p: _Payload):
        n = p.u64()
        faces, kinds, texts = p.u64s(n), p.u32s(n), p.texts(n)
        p.end()
        if any(f > self.stream.mesh.nf for f in faces) or any(a > b for a, b in zip(faces, faces[1:])):
            p.fail("labels are not in the order of their faces, or of a face that does not exist")
        if any(k not in LABEL_KINDS for k in kinds):
            p.fail("a label is of unknown kind")
        self.stream.labels = [(f, LABEL_KINDS[k], x) for f, k, x in zip(faces, kinds, texts)]

    def colv(self, p: _Payload):
        n = p.u64()
        colours = bytes(p.u8s(4 * n))
        p.end()
        if n != self.stream.mesh.nv:
            p.fail("it must have a colour for each vertex")
        self.stream.colours = colours

    def asst(self, p: _Payload):
        n, digest, size = p.u64(), p.u64(), p.u64()
        vertex, data = p.u32s(n), bytes(p.u8s(size))
        p.end()
        if not 1 <= n < INDEX_LIMIT or size == 0:
            p.fail("its counts are out of range")
        if any(v >= self.stream.mesh.nv for v in vertex):
            p.fail("it names a vertex that does not exist")
        self.stream.asset = (digest, vertex, data)

    def indices(self, p: _Payload, width: int = 1) -> array:
        a = p.u32s(p.u64() * width)
        p.end()
        return a

    def ascending(self, p: _Payload, a: array, limit: int) -> array:
        if any(x >= limit for x in a):
            p.fail("an index is out of range")
        if any(x >= y for x, y in zip(a, a[1:])):
            p.fail("indices are not ascending")
        return a

    def sele(self, p: _Payload):
        self.stream.selection = self.ascending(p, self.indices(p), self.stream.mesh.nf)

    def anch(self, p: _Payload):
        self.stream.anchors = self.ascending(p, self.indices(p), self.stream.mesh.nv)

    def link(self, p: _Payload):
        self.stream.links = a = self.indices(p, 2)
        if any(x >= self.stream.mesh.nv for x in a):
            p.fail("an index is out of range")
        if any(x == y for x, y in zip(a[::2], a[1::2])):
            p.fail("a link joins a vertex to itself")

    def refp(self, p: _Payload):
        self.stream.reference_name = p.text()
        self.stream.reference = p.f64s(3 * self.stream.mesh.nv)
        p.end()

    def joints(self, p: _Payload) -> list:
        n = p.u64()
        parents, counts, channels = p.u32s(n), p.u32s(n), p.u8s(6 * n)
        offsets, names = p.f64s(3 * n), p.texts(n)
        return [(names[j], parents[j], list(offsets[3 * j:3 * j + 3]), counts[j], channels[6 * j:6 * j + 6])
                for j in range(n)]

    def checked(self, p: _Payload, rows: list) -> list:
        joints = []
        for j, (name, parent, offset, n, channels) in enumerate(rows):
            if parent != NO_PARENT and parent >= j:
                p.fail("a joint's parent does not come before it")
            if n > 6:
                p.fail("a joint has more than 6 channels")
            if any(not 1 <= c <= 6 for c in channels[:n]) or any(channels[n:]):
                p.fail("a joint has an unknown channel")
            joints.append(Joint(name, None if parent == NO_PARENT else parent, offset, channels[:n]))
        return joints

    def skel(self, p: _Payload):
        rows = self.joints(p)
        p.end()
        if len(rows) != self.stream.mesh.nv:
            p.fail("it does not have one joint for each vertex")
        self.stream.skeleton = self.checked(p, rows)

    def corr(self, p: _Payload):
        source, target = (p.u64(), p.u64(), p.u64()), (p.u64(), p.u64(), p.u64())
        nf = target[1]
        first = p.u32s(nf + 1)
        source_face, weight = p.u32s(first[nf]), p.f64s(first[nf])
        distance, matched = p.f64s(nf), p.u8s(nf)
        p.end()
        if first[0] != 0 or any(a > b for a, b in zip(first, first[1:])):
            p.fail("its lists of pairs are not in order")
        bound = all(m == 2 for m in matched)  # the target rides on the source
        for f in range(nf):
            mine = slice(first[f], first[f + 1])
            if first[f] == first[f + 1]:
                p.fail("a target face has no driver")
            if any(s >= source[1] for s in source_face[mine]):
                p.fail("a source face is out of range")
            if not all(w > 0 for w in weight[mine]):
                p.fail("a weight is not positive")
            if abs(sum(weight[mine]) - 1) >= 1e-9:
                p.fail("the weights of a face do not sum to 1")
            if distance[f] < 0 or matched[f] > 1 and not bound:
                p.fail("a distance or mark is out of range")
        self.stream.correspondence = Correspondence(source, target, first, source_face, weight, distance, matched)

    def check_turns(self, p: _Payload, turns: array):
        for i in range(0, len(turns), 4):
            if abs(sum(x * x for x in turns[i:i + 4]) - 1) > 2e-6:
                p.fail("a turn is not a unit quaternion")

    def rig(self, p: _Payload):
        rows = self.joints(p)
        at, turns = p.f64s(3 * len(rows)), p.f64s(4 * len(rows))
        p.end()
        if not rows:
            p.fail("it has no joints")
        joints = self.checked(p, rows)
        self.check_turns(p, turns)
        if not any(j.channels for j in joints):
            p.fail("none of its joints rotates")
        self.stream.rig = Rig(joints, at, turns, None, None)

    def skin(self, p: _Payload):
        rig, nv = self.stream.rig, self.stream.mesh.nv
        bone, weight = p.u32s(4 * nv), p.f64s(4 * nv)
        p.end()
        for v in range(0, 4 * nv, 4):
            if any(b >= rig.bones() for b in bone[v:v + 4]):
                p.fail("a vertex is moved by a bone that does not exist")
            if weight[v + 3] < 0 or any(a < b for a, b in zip(weight[v:v + 3], weight[v + 1:v + 4])):
                p.fail("weights are negative, or do not descend")
            if abs(sum(weight[v:v + 4]) - 1) >= 1e-9:
                p.fail("the weights of a vertex do not sum to 1")
        rig.skin_bone, rig.skin_weight = bone, weight

    def ptch(self, p: _Payload):
        count, patches = p.u64(), p.u32s(self.stream.mesh.nf)
        p.end()
        if not 1 <= count <= INDEX_LIMIT:
            p.fail("its count is out of range")
        if any(x >= count for x in patches):
            p.fail("a face is in a patch that does not exist")
        self.stream.patches = (count, patches)

    def map_driver(self, p: _Payload, n: int, ng: int, bones: bool, per_corner: int):
        if not bones:
            if per_corner != 1:
                p.fail("a corner must have one patch")
            return
        if self.stream.rig is None:
            p.fail("a RIG record must come before it")
        if n != self.stream.rig.bones():
            p.fail("its number of bones is not that of the rig")
        if not 1 <= per_corner <= 2:
            p.fail("a corner must have 1 or 2 bones")
        if ng:
            p.fail("a map of bones has hinges")

    def map(self, p: _Payload):
        n, nv, ng, nc, nh = (p.u64() for _ in range(5))
        kind, has_home, nnames, per_corner = p.word(), p.flag(), p.u64(), p.u64()
        size, bones = p.f64(), kind == 2
        lengths = (4 * nv * n, 3 * n * n, 3 * n, 3 * n, n, 3 * nv if has_home else 0, 3 * ng, ng,
                   4 * per_corner * nc, 0 if bones else 3 * nh)
        weights, place, centre, home_centre, share, home, hinge_at, hinge_weight, corners, held_at = (
            p.f64s(length) for length in lengths)
        hinges, held, held_patch = p.u32s(2 * ng), p.u32s(nh), p.u32s(0 if bones else nh)
        corner_bones = p.u32s(per_corner * nc if bones else 0)
        names = p.texts(nnames)
        p.end()
        if not 1 <= n < INDEX_LIMIT or ng >= INDEX_LIMIT or nc >= INDEX_LIMIT or nh > nv:
            p.fail("its counts are out of range")
        if nv != self.stream.mesh.nv:
            p.fail("its count does not fit the mesh")
        if kind not in (1, 2):
            p.fail("its kind of transforms is unknown")
        if nnames not in (0, n):
            p.fail("names are missing")
        if size <= 0:
            p.fail("its size is not positive")
        self.map_driver(p, n, ng, bones, per_corner)
        if min(share) < 0 or abs(sum(share) - 1) >= 1e-9:
            p.fail("a share is negative, or the shares do not sum to 1")
        pairs = list(zip(hinges[::2], hinges[1::2]))
        if any(a >= n or b >= n or a == b for a, b in pairs) or any(w <= 0 for w in hinge_weight):
            p.fail("a hinge is malformed")
        if any(not any(corners[i:i + 4 * per_corner]) for i in range(0, len(corners), 4 * per_corner)):
            p.fail("a quaternion is zero")
        if any(x >= n for x in corner_bones):
            p.fail("a corner is moved by a bone that does not exist")
        if any(x >= n for x in held_patch):
            p.fail("a vertex is held by a transform that does not exist")
        self.ascending(p, held, nv)
        self.stream.map = Map("bones" if bones else "patches", n, size, names, weights, place, centre, home_centre, share,
                              home if has_home else None, hinge_at, hinge_weight, corners, held_at, hinges, held,
                              held_patch, per_corner, corner_bones)

    def check_signal(self, p: _Payload, n: int, space: int, d: int, sites: int, k: int, bits: int, layout: int):
        if n < 2:
            p.fail("it has fewer than 2 frames")
        if n > 1 << 20:
            p.fail("it has too many frames")
        if k < 4:
            p.fail("its curve has fewer than 4 control points")
        if not 1 <= sites <= n:
            p.fail("it has no sites, or more than frames")
        if not 1 <= space <= 5:
            p.fail("its shape space is not known")
        if space == 1 and d != 3 * self.stream.mesh.nv:
            p.fail("its shapes are not of this mesh")
        if bits not in (64, 32, 16):
            p.fail("the precision of its basis is not known")
        if layout > 4:
            p.fail("its layout is not known")

    def sign(self, p: _Payload):
        n, space, d, m, sites, k, bits = (p.u64() for _ in range(7))
        rooted, timed, examples, turns, layout = p.flag(), p.flag(), p.flag(), p.u64(), p.word()
        numbers, mean = p.f64s(6), p.f64s(d)
        basis = array("d", [*p.f64s(m * d if bits == 64 else 0), *p.f64s(m * d if bits == 32 else 0, code="f")])
        p.pad()
        short = p.u8s(2 * m * d if bits == 16 else 0)
        unit, coordinate, position = p.f64s(m if bits == 16 else 0), p.f64s(n * m), p.f64s(2 * n)
        site, parameter, knot, control = p.u32s(sites), p.f64s(n), p.f64s(k + 2), p.f64s(2 * k)
        turn, shift, home = p.f64s(4 * n if rooted else 0), p.f64s(3 * n if rooted else 0), p.f64s(4 * turns)
        times, names = p.f64s(n if timed else 0), p.texts(n)
        p.end()
        self.check_signal(p, n, space, d, sites, k, bits, layout)
        if space == 1 and turns and not (examples and rooted):
            p.fail("its shapes have no turns")
        if space == 1 and turns and turns - 1 != m:
            p.fail("its turns are not those of its examples")
        if space > 1 and examples:
            p.fail("only shapes of vertices can be sums of examples")
        if space > 1 and not rooted:
            p.fail("the kind of its shapes is unknown")
        if space > 1 and (space in (2, 3)) != (turns > 0):
            p.fail("its turns are not those of its shape space")
        self.check_turns(p, home)
        if any(not a < b for a, b in zip(parameter, parameter[1:])):
            p.fail("its parameters do not ascend")
        if any(not a <= b for a, b in zip(knot, knot[1:])):
            p.fail("its knots fall")
        if not knot[2] < knot[k - 1]:
            p.fail("its knots span an empty interval")
        for what, numbers_ in (("a knot is too large", [*knot, *parameter]), ("a control point is too far away", control)):
            if any(abs(x) > 1e100 for x in numbers_):
                p.fail(what)
        if any(x >= n for x in site):
            p.fail("a site is not a frame")
        if len(set(site)) < sites:
            p.fail("a frame is a site twice")
        if any(abs(x) > 1e100 for x in position):
            p.fail("a frame is too far away in the plane")
        self.check_turns(p, turn)
        if any(u <= 0 for u in unit):
            p.fail("a unit of its basis is not positive")
        if bits == 16:
            basis = array("d", (int.from_bytes(bytes(short[i:i + 2]), "little", signed=True) for i in range(0, len(short), 2)))
        self.stream.signal = Signal(n, space, d, m, bits, examples, layout, numbers, mean, basis, unit, coordinate, position,
                                    site, parameter, knot, control, turn, shift, times, names)
        self.shape_turns = turns

    def netw(self, p: _Payload):
        c = {name: int(p.flag()) if name in ("open", "uncertain") else p.u64() for name in NETWORK_COUNTS}
        features, k = c["vertices"] * c["width"], c["rank"]
        numbers, errors, mean = p.f64s(10), p.f64s(30), p.f64s(features)
        scale, range_ = p.f64s(2 * k), p.f64s(2 * k)
        regression = p.f64s(2 * (3 * k * k + 2 * k) if c["model"] == 1 else 0)
        root = p.f64s(3 * (2 * k + 1) * (c["parts"] + 1))
        count = c["sets"] * c["parameters"]
        lists = []
        for n in (count, k * features, 3 * c["curve_length"], 2 * count if c["open"] else 0, count if c["open"] else 0):
            lists.append(p.f64s(n, code="f"))
            p.pad()
        p.end()
        for wrong, why in self.wrong_network(c, features, numbers, errors, scale, range_, lists[2]):
            if wrong:
                p.fail(why)
        self.stream.network = Network(c, numbers, errors, mean, scale, range_, regression, root, *lists)

    def wrong_network(self, c: dict, features: int, numbers: array, errors: array, scale: array, range_: array, curve: array):
        """What may be wrong with a network whose fields have the right sizes."""
        linear, k, low, high = c["model"] in (1, 2), c["rank"], numbers[3:5], numbers[5:7]
        yield not 1 <= c["model"] <= 4, "its model is not known"
        yield c["direction"] > 2, "its direction is not known"
        yield c["width"] not in (9, 12), "its features are not 9 or 12 numbers"
        yield 0 in (k, c["parts"], c["step"]), "a count is 0"
        yield c["numbers"] != (k if linear else features), "its frames have a wrong number of numbers"
        yield c["sets"] != (2 if c["direction"] == 1 else 1), "its sets of parameters do not match its direction"
        yield linear and c["uncertain"], "a network of coordinates has no variance"
        yield c["step"] > 1 << 16, "its step is too large"
        yield c["numbers"] > (1 << 27) - 2, "its frames have too many numbers"
        yield not 1 <= c["layers"] <= 8, "its layers are not 1 to 8"
        yield not 1 <= c["hidden"] <= 4096, "its layers have not 1 to 4096 cells"
        yield c["convolutions"] > (8 if c["model"] == 4 else 0), "it has too many convolutions"
        yield c["parameters"] != parameters_of(c, linear), "its parameters are not those of its layers"
        yield any(x < 0 and x != -1 for x in [numbers[0], *errors]), "an error is below 0"
        yield numbers[2] <= 0, "the diagonal is not above 0"
        yield any(a >= b for a, b in zip(low, high)), "a range is empty"
        yield any(x <= 0 for x in scale), "a scale is not above 0"
        yield any(a > b for a, b in zip(range_[:k], range_[k:])), "a range of coordinates is empty"
        yield c["phase"] > 1, "its phase of training is not known"
        yield c["curve_block"] > c["curve_length"], "its curve is shorter than its part beside a validation block"
        yield any(x < 0 and (i % 3 < 2 or x != -1) for i, x in enumerate(curve)) or (numbers[1] < 0 and numbers[1] != -1), "a number of its curve is below 0"
        yield c["vertices"] != self.stream.mesh.nv or c["mesh_digest"] != self.stream.digest(), "the network's mesh"
        yield c["parts"] != self.stream.mesh.components(), "the mesh has another number of components"

    def elements(self, element: str):
        """How many elements of that sort there are; None: that is not known."""
        s = self.stream
        m = s.mesh
        return {"vertex": m.nv if m else 0, "corner": sum(map(len, s.graph())) if m else 0, "frame": 1,
                "joint": len(s.skeleton or ()), "anchor": len(s.anchors or ()),
                "transform": s.count if s.element == "transform" else None}.get(element)

    def form(self, p: _Payload):
        s = self.stream
        s.kind, s.element = p.text(), p.text()
        p.fits("it has a wrong length")
        s.width, s.count, s.precision = p.u64(), p.u64(), p.u64()
        p.end()
        if not s.kind:
            p.fail("frames have no form")
        if s.element == "vertex list":
            p.fail("elements of frames are no lists")
        element, width = FORMS.get(s.kind, (s.element, None))
        if s.element != element or width not in (None, s.width):
            p.fail("its elements or their width are not those of the form")
        if s.precision not in (4, 8):
            p.fail("numbers are of unknown precision")
        self.fits_form(p)
        s.extra, self.pending = self.pending, []

    def fits_form(self, p: _Payload):
        s = self.stream
        if s.map and len(s.map.corners) not in (0, 4 * s.map.per_corner * sum(map(len, s.graph()))):
            p.fail("the corners of record MAP do not fit the mesh")
        if s.map and s.map.kind == "patches" and (s.patches is None or s.patches[0] != len(s.map.centre) // 3):
            p.fail("records MAP and PTCH have different numbers of patches")
        if s.signal and s.signal.space > 1 and s.links is None:
            p.fail("record SIGN needs a LINK record")
        if s.width == 0:
            p.fail("its elements have no width")
        if s.reference is None and (s.mesh is not None or s.element in ("vertex", "corner", "joint")):
            p.fail("a MESH and a REFP record must come before it")
        if s.element == "corner" and s.links is None:
            p.fail("a LINK record must come before it")
        if self.elements(s.element) not in (None, s.count):
            p.fail("its count does not fit its elements")
        if s.signal and s.signal.space > 1:
            self.fits_shapes(p, s.signal)

    def fits_shapes(self, p: _Payload, g: Signal):
        """Whether the numbers of a shape and its turns are those of the graph."""
        faces = self.stream.pieces()
        if not faces:
            p.fail("the mesh has no faces")
        pieces = [piece for face in faces for piece in face]
        pairs, edges, parts = neighbours(faces)
        if g.space > 3 and parts > 1:
            p.fail("parts that no links join")
        hinges = sum(edge is not None and len(pieces[a]) == len(pieces[b]) == 3 for a, b, edge in pairs)
        numbers = {2: 4 * self.elements("corner"), 3: 9 * len(pieces), 4: 3 * len(pairs) + 6 * len(pieces) + 3,
                   5: len(edges) + 3 * len(pairs) - 2 * hinges + 3}
        if g.d != numbers[g.space] or self.shape_turns != {2: len(faces), 3: len(pieces)}.get(g.space, 0):
            p.fail("the shapes of the signal are not of this mesh")

    def channel(self, p: _Payload, seen: dict) -> Channel:
        name, unit, element = p.text(), p.text(), p.text()
        width, count, kind = p.u64(), p.u64(), p.u64()
        if not name:
            p.fail("a channel has no name")

        def fail(what):
            p.fail(f"channel '{name}': {what}")
        if name in seen:
            fail("the frame has another one")
        if width == 0:
            fail("its elements have no width")
        if (element == "vertex list") != (kind == INDICES):
            fail("its type does not fit its elements")
        if kind not in (INDICES, F32, F64):
            fail("its type is unknown")
        if kind == INDICES and width != 1:
            fail("a list has one vertex for each element")
        if self.elements(element) not in (None, count) or (kind == INDICES and count == 0):
            fail("its count does not fit its elements")
        if CHANNELS.get(name, (element, width)) != (element, width):
            fail("its elements or their width are not those of its name")
        s = self.stream
        if (name in ("root", "anchors") and s.element != "corner") or (name == "pins" and s.kind != "vectors") or \
                (name == "turns" and (s.kind != "vertices" or not s.skeleton)):
            fail("it does not belong to these frames")
        if width * count * (8 if kind == F64 else 4) > p.left():
            fail("it is shorter than its counts say")
        if kind == INDICES:
            values = self.ascending(p, p.u32s(count), s.mesh.nv if s.mesh else 0)
        else:
            values = p.f64s(width * count, f"channel '{name}': a number", "d" if kind == F64 else "f")
            p.pad()
        if name == "turns":
            self.check_turns(p, values)
        return Channel(name, unit, element, width, count, kind, values)

    def fram(self, p: _Payload):
        s = self.stream
        p.where = f"frame {len(s.frames)}"
        name, channels = p.text(), {}
        n = p.u64()
        if n > MOST_CHANNELS:
            p.fail("it has more than 255 channels")
        for _ in range(n):
            c = self.channel(p, channels)
            channels[c.name] = c
        if s.element == "corner" and "root" not in channels:
            p.fail("it has no channel 'root'")
        if s.element == "corner" and s.anchors and "anchors" not in channels:
            p.fail("it has no channel 'anchors'")
        p.fits("its length does not fit the count of FORM")
        values = p.f64s(s.count * s.width, "a value", "d" if s.precision == 8 else "f")
        if -p.at % 8 > p.left() or any(p.take(-p.at % 8)):
            p.fail(p.short)
        p.end()
        if s.kind in ("deformations", "transforms"):
            for i in range(0, len(values), s.width):
                if not any(values[i:i + 4]):
                    p.fail("a quaternion is zero")
        s.frames.append(Frame(name, values, channels, self.pending))
        self.pending = []

    def fail(self, p: _Payload):
        status, program, message = p.u64(), p.text(), p.text()
        p.end()
        raise StreamError(f"it was cut short: {program} failed with status {status}: {message}")

    def end(self, p: _Payload):
        if p.left() != 16:
            raise StreamError("the END record has a wrong length")
        count, running = p.u64(), p.u64()
        if count != self.index():
            raise StreamError(f"the END mark states {count} records, but there were {self.index()}")
        if running != xxh64(bytes(self.sums)):
            raise StreamError("the END mark's checksum is wrong: records were changed or moved")
        self.stream.tail, self.stream.checksum, self.done = self.pending, running, True

    HANDLERS = {"PROV": prov, "MESH": mesh, "TEXC": texc, "LABL": labl, "COLV": colv, "ASST": asst, "SELE": sele, "LINK": link, "ANCH": anch,
                "REFP": refp, "SKEL": skel, "CORR": corr, "PTCH": ptch,
                "RIG ": rig, "SKIN": skin, "MAP ": map, "SIGN": sign, "NETW": netw, "FORM": form, "FRAM": fram, "FAIL": fail, "END ": end}


def read_stream(file) -> Stream:
    """Read a whole stream from a path or an open binary file; StreamError unless it is valid to the last byte."""
    if hasattr(file, "read"):
        return _Reader(file).read()
    with open(file, "rb") as opened:
        return _Reader(opened).read()


# ---- the command ---------------------------------------------------------------------------------------------------


def _rows(a, width: int) -> list:
    return [list(a[i:i + width]) for i in range(0, len(a), width)]


def _extra_json(records) -> list:
    return [{"tag": r.tag, "flags": r.flags, "payload": r.payload.hex()} for r in records]


def _channel_json(c: Channel) -> dict:
    return {"name": c.name, "unit": c.unit, "element": c.element, "width": c.width, "type": c.type,
            "values": _rows(c.values, c.width)}


def _frame_json(f: Frame, width: int) -> dict:
    return {"name": f.name, "channels": [_channel_json(c) for c in f.channels.values()],
            "values": _rows(f.values, width), "extra": _extra_json(f.extra)}


def _correspondence_json(c: Correspondence) -> dict:
    pairs = list(zip(c.source_face, c.weight))
    return {
        "source": {"vertices": c.source[0], "faces": c.source[1], "digest": f"{c.source[2]:016x}"},
        "target": {"vertices": c.target[0], "faces": c.target[1], "digest": f"{c.target[2]:016x}"},
        "faces": [{"driven_by": [list(x) for x in pairs[c.first[f]:c.first[f + 1]]], "distance": c.distance[f],
                   "matched": bool(c.matched[f])} for f in range(c.target[1])],
    }


def _rig_json(r: Rig) -> dict:
    skin = r.skin_bone and {"bones": _rows(r.skin_bone, 4), "weights": _rows(r.skin_weight, 4)}
    return {"joints": [vars(j) for j in r.joints], "at": _rows(r.at, 3), "turns": _rows(r.turns, 4), "skin": skin}


def _map_json(m: Map) -> dict:
    return {"kind": m.kind, "per_corner": m.per_corner, "corner_bones": _rows(m.corner_bones, m.per_corner), "size": m.size, "names": m.names, "weights": _rows(m.weights, 4 * m.n), "place": _rows(m.place, 3 * m.n),
            "centre": _rows(m.centre, 3), "home_centre": _rows(m.home_centre, 3), "share": list(m.share),
            "home": m.home and _rows(m.home, 3), "hinge_at": _rows(m.hinge_at, 3), "hinge_weight": list(m.hinge_weight),
            "corners": _rows(m.corners, 4), "held_at": _rows(m.held_at, 3), "hinges": _rows(m.hinges, 2),
            "held": list(m.held), "held_patch": list(m.held_patch)}


def _network_json(n: Network) -> dict:
    counts = dict(n.counts, mesh_digest=f"{n.counts['mesh_digest']:016x}", data_digest=f"{n.counts['data_digest']:016x}")
    return dict({k: list(v) for k, v in vars(n).items() if k != "counts"}, counts=counts)


def _signal_json(s: Signal) -> dict:
    flat = {k: list(v) if isinstance(v, array) else v for k, v in vars(s).items() if k not in ("n", "d", "m")}
    return dict(flat, basis=_rows(s.basis, s.d) if s.d else [], coordinate=_rows(s.coordinate, s.m) if s.m else [],
                position=_rows(s.position, 2), control=_rows(s.control, 2), turn=_rows(s.turn, 4), shift=_rows(s.shift, 3))


def to_json(s: Stream) -> dict:
    """The whole content as plain lists, dictionaries and numbers; what is absent is None."""
    m, t = s.mesh, s.texture
    return {
        "minor": s.minor,
        "provenance": [{"program": p.program, "version": p.version, "parents": p.parents, "args": p.args}
                       for p in s.provenance],
        "mesh": m and {"vertices": m.nv, "faces": m.faces()},
        "texture": t and {"dim": t.dim, "coordinates": _rows(t.coordinates, t.dim),
                          "corners": [None if c == NO_TEXTURE else c for c in t.corners]},
        "labels": None if s.labels is None else [{"face": f, "kind": k, "text": x} for f, k, x in s.labels],
        "colours": s.colours and _rows(list(s.colours), 4),
        "asset": s.asset and {"digest": f"{s.asset[0]:016x}", "vertex": list(s.asset[1]),
                              "data": s.asset[2].decode("latin-1")},
        "selection": None if s.selection is None else list(s.selection),
        "links": None if s.links is None else _rows(s.links, 2),
        "anchors": None if s.anchors is None else list(s.anchors),
        "reference": m and {"name": s.reference_name, "positions": _rows(s.reference, 3)},
        "skeleton": None if s.skeleton is None else [vars(j) for j in s.skeleton],
        "correspondence": s.correspondence and _correspondence_json(s.correspondence),
        "patches": s.patches and {"count": s.patches[0], "of_face": list(s.patches[1])},
        "rig": s.rig and _rig_json(s.rig),
        "map": s.map and _map_json(s.map),
        "signal": s.signal and _signal_json(s.signal),
        "network": s.network and _network_json(s.network),
        "kind": s.kind, "element": s.element, "width": s.width, "precision": s.precision, "count": s.count,
        "extra": _extra_json(s.extra),
        "frames": [_frame_json(f, s.width) for f in s.frames],
        "tail": _extra_json(s.tail),
        "records": len(s.records) - 1, "checksum": f"{s.checksum:016x}",
    }


def _summary(s: Stream) -> str:
    lines = [f"{len(s.frames)} frames of {s.count} {s.kind}, binary{8 * s.precision}"]
    if s.mesh is not None:
        m = s.mesh
        lines.append(f"{m.nv} vertices, {m.nf} faces, {len(m.vert)} corners, reference '{s.reference_name}'")
    for what, n in (("selected faces", s.selection and len(s.selection)), ("links", s.links and len(s.links) // 2),
                    ("anchors", s.anchors and len(s.anchors)), ("joints", s.skeleton and len(s.skeleton)),
                    ("driven faces", s.correspondence and s.correspondence.target[1]),
                    ("patches", s.patches and s.patches[0]), ("transforms of a map", s.map and s.map.n),
                    ("labels", s.labels and len(s.labels))):
        if n:
            lines.append(f"{n} {what}")
    lines += [f"made by {p.program} {p.version}: {' '.join(p.args)}" for p in s.provenance]
    unknown = s.extra + [r for f in s.frames for r in f.extra] + s.tail
    if unknown:
        lines.append("unknown records: " + " ".join(sorted({r.tag.strip() for r in unknown})))
    return "\n".join(lines)


def main(argv) -> int:
    options = {a for a in argv[1:] if a.startswith("-") and a != "-"}
    files = [a for a in argv[1:] if a not in options]
    if options - {"--json", "--check"} or len(files) > 1:
        print("usage: read_stream.py [--json | --check] [FILE]", file=sys.stderr)
        return 2
    name = files[0] if files else "-"
    try:
        stream = read_stream(sys.stdin.buffer if name == "-" else name)
        if "--json" in options:
            json.dump(to_json(stream), sys.stdout, indent=1)
            print()
        elif "--check" not in options:
            print(_summary(stream))
        sys.stdout.flush()
    except StreamError as error:
        shown = "standard input" if name == "-" else name
        print(f"read_stream.py: '{shown}': {error}", file=sys.stderr)
        return 3
    except OSError as error:
        print(f"read_stream.py: {error}", file=sys.stderr)
        return 4
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
