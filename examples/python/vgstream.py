"""vgstream: read and write vg streams, frame by frame, and run pipes of vg programs. Python 3.9 or later; the standard library
is enough, NumPy is used where it is installed. One file: copy it beside your script.

    import vgstream

    with vgstream.Reader("walk.vgs") as walk, vgstream.Writer("calm.vgs", walk) as calm:
        for frame in walk:                          # one frame in memory at a time
            frame.values[:] = process(frame.values)
            frame.drop_channels()                   # what came with the old values
            calm.put(frame)

    with vgstream.pipe(["vg-encode", "walk.zip"], ["vg-deform", "--onto", "b.obj"], ["vg-solve"]) as frames:
        for frame in frames: ...                    # a failure of any program is a StreamError that names it

    with vgstream.Writer("made.vgs", vgstream.mesh(points, faces)) as out:
        out.put_pose("a", points)

Values are an array('d') of count * width numbers, or with NumPy an array of (count, width). Every checksum and length is checked;
a stream without END is a StreamError. Records of the header are kept as bytes, so that what this file does not interpret
(patches, rigs, maps, ...) goes through unchanged; read_stream.py, beside the examples, takes all of them apart and checks them.

SPDX-License-Identifier: GPL-3.0-or-later
"""
from __future__ import annotations

import ctypes
import ctypes.util
import os
import struct
import subprocess
import sys
from array import array

try:
    import numpy
except ImportError:
    numpy = None

MAGIC = b"\x89VGS\r\n\x1a1"
CRITICAL, COPY_SAFE = 1, 2
FLAGS = {"PROV": COPY_SAFE, **dict.fromkeys(("TEXC", "LABL", "COLV", "ASST", "SKEL", "PTCH", "RIG ", "SKIN"), 0)}  # of known tags; else CRITICAL
KNOWN = set(FLAGS) | {"MESH", "SELE", "LINK", "ANCH", "REFP", "CORR", "MAP ", "SIGN", "NETW", "FORM", "FRAM", "FAIL", "END "}
MOST_BYTES = 1 << 40


class StreamError(ValueError):
    """The stream is malformed or cut short, or a program of a pipe has failed."""


# ---- XXH64 with seed 0 (github.com/Cyan4973/xxHash, doc/xxhash_spec.md) ----

_M = 0xFFFFFFFFFFFFFFFF
_P1, _P2, _P3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
_P4, _P5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5


def _rotate(x: int, n: int) -> int:
    return (x << n | x >> (64 - n)) & _M


def _round(lane: int, word: int) -> int:
    return _rotate(lane + word * _P2 & _M, 31) * _P1 & _M


def xxh64_plain(data) -> int:
    """XXH64 in Python alone: some 5 MB/s."""
    data = memoryview(data).cast("B")
    n, whole = len(data), len(data) & ~31
    if whole:
        lanes = [(_P1 + _P2) & _M, _P2, 0, -_P1 & _M]
        for words in struct.iter_unpack("<4Q", data[:whole]):
            lanes = [_round(lane, word) for lane, word in zip(lanes, words)]
        h = sum(_rotate(lane, k) for lane, k in zip(lanes, (1, 7, 12, 18))) & _M
        for lane in lanes:
            h = ((h ^ _round(0, lane)) * _P1 + _P4) & _M
    else:
        h = _P5
    h = (h + n) & _M
    at = whole
    for at in range(whole, n - 7, 8):
        h = (_rotate(h ^ _round(0, int.from_bytes(data[at:at + 8], "little")), 27) * _P1 + _P4) & _M
    at = whole + (n - whole) // 8 * 8
    if at + 4 <= n:
        h = (_rotate(h ^ int.from_bytes(data[at:at + 4], "little") * _P1 & _M, 23) * _P2 + _P3) & _M
        at += 4
    for byte in data[at:]:
        h = _rotate(h ^ byte * _P5 & _M, 11) * _P1 & _M
    h = (h ^ h >> 33) * _P2 & _M
    h = (h ^ h >> 29) * _P3 & _M
    return h ^ h >> 32


def _load_xxhash():
    name = ctypes.util.find_library("xxhash")
    try:
        function = ctypes.CDLL(name).XXH64 if name else None
    except (OSError, AttributeError):
        return None
    if function:
        function.argtypes, function.restype = (ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint64), ctypes.c_uint64
    return function


_library = _load_xxhash()


def xxh64(data) -> int:
    """XXH64 by the library that the programs use, if it is installed."""
    return _library(bytes(data), len(data), 0) if _library else xxh64_plain(data)


# ---- fields of a record ----


def _pad(n: int) -> int:
    return -n % 8


def _text(s: str) -> bytes:
    b = s.encode()
    return struct.pack("<Q", len(b)) + b + bytes(_pad(len(b)))


def _bytes_of(code: str, numbers) -> bytes:
    """Numbers, little-endian, padded. code: 'I' u32, 'f', 'd'."""
    if numpy is not None:
        b = numpy.ascontiguousarray(numbers, {"I": "<u4", "f": "<f4", "d": "<f8"}[code]).tobytes()
    else:
        a = array(code if code != "I" else _U32, numbers)
        if sys.byteorder == "big":
            a.byteswap()
        b = a.tobytes()
    return b + bytes(_pad(len(b)))


_U32 = next(code for code in "IL" if array(code).itemsize == 4)


class _Fields:
    def __init__(self, payload: bytes, where: str):
        self.payload, self.at, self.where = payload, 0, where

    def take(self, n: int) -> bytes:
        end = self.at + n
        whole = end + _pad(n)
        if n > MOST_BYTES or whole > len(self.payload):
            raise StreamError(f"{self.where} is shorter than its fields")
        if any(self.payload[end:whole]):
            raise StreamError(f"{self.where} has padding that is not zero")
        piece, self.at = self.payload[self.at:end], whole
        return piece

    def u64(self) -> int:
        return struct.unpack("<Q", self.take(8))[0]

    def text(self) -> str:
        try:
            return self.take(self.u64()).decode()
        except UnicodeDecodeError:
            raise StreamError(f"{self.where} has a text that is not UTF-8") from None

    def numbers(self, code: str, n: int) -> array:
        a = array(_U32 if code == "I" else code)
        if n > MOST_BYTES:
            raise StreamError(f"{self.where} is shorter than its fields")
        a.frombytes(self.take(n * a.itemsize))
        if sys.byteorder == "big":
            a.byteswap()
        return a

    def end(self) -> None:
        if self.at != len(self.payload):
            raise StreamError(f"{self.where} is longer than its fields")


# ---- what a stream is made of ----


class Channel:
    """What comes with a frame beside its values; numbers is an array."""

    def __init__(self, name, unit, element, width, numbers, code="d"):
        self.name, self.unit, self.element, self.width, self.numbers, self.code = name, unit, element, width, numbers, code


class Frame:
    """name, values, channels, and the unknown records before it. time: the channel of that name, or None."""

    def __init__(self, name, values, channels=(), extra=()):
        self.name, self.values, self.channels, self.extra = name, values, list(channels), list(extra)

    def channel(self, name):
        return next((c for c in self.channels if c.name == name), None)

    @property
    def time(self):
        c = self.channel("time")
        return c.numbers[0] if c else None

    @time.setter
    def time(self, seconds):
        self.channels = [c for c in self.channels if c.name != "time"]
        if seconds is not None:
            self.channels.insert(0, Channel("time", "s", "frame", 1, array("d", [seconds])))

    def drop_channels(self):
        """All but the time: what is not true of other values."""
        self.channels = [c for c in self.channels if c.name == "time"]


class Head:
    """What stands before the frames: records (tag, flags, payload) in order, and the form of the frames."""

    def __init__(self, records, form, element, width, count, precision):
        self.records, self.form, self.element, self.width, self.count, self.precision = list(records), form, element, width, count, precision

    def record(self, tag):
        return next((payload for t, _, payload in self.records if t == tag), None)

    @property
    def nv(self) -> int:
        payload = self.record("MESH")
        return struct.unpack_from("<Q", payload)[0] if payload else 0

    @property
    def faces(self) -> list:
        payload = self.record("MESH")
        if payload is None:
            return []
        f = _Fields(payload, "record MESH")
        f.u64()
        start = f.numbers("I", f.u64() + 1)
        vert = f.numbers("I", start[-1])
        return [list(vert[start[i]:start[i + 1]]) for i in range(len(start) - 1)]

    @property
    def reference(self) -> array:
        payload = self.record("REFP")
        if payload is None:
            return array("d")
        f = _Fields(payload, "record REFP")
        f.text()
        return f.numbers("d", 3 * self.nv)


def mesh(points, faces, precision=8, name="reference") -> Head:
    """The head of a sequence of vertices. points: rows of x y z; faces: lists of vertices."""
    flat = [float(x) for p in points for x in p]
    start, vert = [0], []
    for face in faces:
        vert.extend(face)
        start.append(len(vert))
    nv = len(flat) // 3
    if any(not 0 <= v < nv for v in vert) or any(len(set(f)) != len(f) or len(f) < 2 for f in faces):
        raise ValueError("a face needs two different vertices or more, each below the number of points")
    topology = struct.pack("<QQ", nv, len(faces)) + _bytes_of("I", start) + _bytes_of("I", vert)
    records = [("MESH", CRITICAL, topology), ("REFP", CRITICAL, _text(name) + _bytes_of("d", flat))]
    return Head(records, "vertices", "vertex", 3, nv, precision)


# ---- reading ----


class Reader(Head):
    """Iterate over it for the frames. file: a path, or a binary file such as sys.stdin.buffer."""

    def __init__(self, file):
        self.owned = isinstance(file, (str, bytes, os.PathLike))
        self.file = open(file, "rb") if self.owned else file
        self.where = str(file) if self.owned else getattr(file, "name", "the input")
        self.count_of_records, self.sums, self.tail, self.ended, self.programs = 0, b"", [], False, []
        try:
            self._read_head()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        if self.owned:
            self.file.close()
        for program in self.programs:
            if program.poll() is None:
                program.terminate()
            program.wait()

    def _fail(self, text):
        raise StreamError(f"{self.where}: {text}")

    def _exactly(self, n: int) -> bytes:
        pieces, left = [], n
        while left:
            piece = self.file.read(min(left, 1 << 24))
            if not piece:
                self._fail("the stream ends before its END record" if self.count_of_records or pieces else
                           "no bytes: has the program before failed?")
            pieces.append(piece)
            left -= len(piece)
        return pieces[0] if len(pieces) == 1 else b"".join(pieces)

    def _record(self):
        header = self._exactly(32)
        tag, flags, n, payload_sum, header_sum = struct.unpack("<4sIQQQ", header)
        if xxh64(header[:24]) != header_sum:
            self._fail(f"the header of record {self.count_of_records} is damaged")
        if not all(c in b"ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 " for c in tag) or flags & 0xFFFC or n > MOST_BYTES:
            self._fail(f"record {self.count_of_records} has a header that is against the rules")
        payload = self._exactly(n)
        if any(self._exactly(_pad(n)) if _pad(n) else b"") or xxh64(payload) != payload_sum:
            self._fail(f"record {self.count_of_records}, {tag.decode()!r}, is damaged")
        tag = tag.decode()
        if tag == "FAIL":
            f = _Fields(payload, "record FAIL")
            f.u64()
            self._fail(f"{f.text()} failed: {f.text()}")
        if tag not in KNOWN and flags & CRITICAL:
            self._fail(f"record {tag!r} is critical, and this reader does not know it")
        if tag != "END ":
            self.count_of_records += 1
            self.sums += header[24:]
        return tag, flags, payload

    def _read_head(self):
        magic = self._exactly(16)
        if magic[:8] != MAGIC or any(magic[12:]):
            self._fail("this is not a vg stream of version 1")
        records = []
        while True:
            record = self._record()
            if record[0] == "FORM":
                break
            if record[0] in ("FRAM", "END "):
                self._fail(f"record {record[0]!r} comes before FORM")
            records.append(record)
        f = _Fields(record[2], "record FORM")
        super().__init__(records, f.text(), f.text(), f.u64(), f.u64(), f.u64())
        f.end()
        if self.precision not in (4, 8):
            self._fail(f"record FORM has precision {self.precision}")

    def _frame(self, payload, extra):
        f = _Fields(payload, f"{self.where}: frame")
        name = f.text()
        channels = []
        for _ in range(f.u64()):
            label, unit, element, width, count = f.text(), f.text(), f.text(), f.u64(), f.u64()
            kind = f.u64()
            if kind not in (1, 4, 8):
                self._fail(f"channel '{label}' of frame '{name}' has type {kind}")
            code = {1: "I", 4: "f", 8: "d"}[kind]
            channels.append(Channel(label, unit, element, width, f.numbers(code, width * count), code))
        values = f.numbers("f" if self.precision == 4 else "d", self.count * self.width)
        f.end()
        if numpy is not None:
            values = numpy.array(values, "f8").reshape(self.count, self.width)
        elif self.precision == 4:
            values = array("d", values)
        return Frame(name, values, channels, extra)

    def _check_end(self, payload):
        count, running = struct.unpack("<QQ", payload) if len(payload) == 16 else (None, None)
        if count != self.count_of_records or running != xxh64(self.sums):
            self._fail("the END record does not agree with what came before it")
        if self.file.read(1):
            self._fail("something follows the END record")
        for program in self.programs:
            if program.wait():
                self._fail(f"{program.args[0]} ended with status {program.returncode}")

    def __iter__(self):
        extra = []
        while not self.ended:
            tag, flags, payload = self._record()
            if tag == "FRAM":
                yield self._frame(payload, extra)
                extra = []
            elif tag == "END ":
                self._check_end(payload)
                self.ended, self.tail = True, extra
            elif tag in KNOWN:
                self._fail(f"record {tag!r} comes after FORM")
            else:
                extra.append((tag, flags, payload))


# ---- writing ----


class Writer:
    """file: a path, which gets its name when the stream is complete, or a binary file. head: a Head, a Reader, or mesh(...).
    Unknown records that are not copy-safe are left out. An exception in its `with` leaves no file behind."""

    def __init__(self, file, head: Head):
        self.head, self.owned = head, isinstance(file, (str, os.PathLike))
        self.path = os.fspath(file) if self.owned else None
        self.part = f"{self.path}.{os.getpid()}.part" if self.owned else None
        self.file = open(self.part, "xb") if self.owned else file
        self.count, self.sums = 0, b""
        self.file.write(MAGIC + bytes(8))
        self._put_all(head.records)
        self._put("FORM", CRITICAL, _text(head.form) + _text(head.element) + struct.pack("<QQQ", head.width, head.count, head.precision))

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind is None:
            self.close()
        else:
            self.abandon()

    def _put(self, tag, flags, payload):
        header = struct.pack("<4sIQQ", tag.encode(), flags, len(payload), xxh64(payload))
        own = struct.pack("<Q", xxh64(header))
        if tag != "END ":
            self.count += 1
            self.sums += own
        self.file.write(header + own + payload + bytes(_pad(len(payload))))

    def _put_all(self, records):
        for tag, flags, payload in records:
            if tag in KNOWN:
                self._put(tag, FLAGS.get(tag, CRITICAL), payload)
            elif flags & COPY_SAFE:
                self._put(tag, flags, payload)

    def put(self, frame: Frame):
        values = frame.values.reshape(-1) if hasattr(frame.values, "reshape") else frame.values
        if len(values) != self.head.count * self.head.width:
            raise ValueError(f"frame '{frame.name}' has {len(values)} numbers, not {self.head.count} x {self.head.width}")
        parts = [_text(frame.name), struct.pack("<Q", len(frame.channels))]
        for c in frame.channels:
            parts += [_text(c.name), _text(c.unit), _text(c.element),
                      struct.pack("<QQQ", c.width, len(c.numbers) // c.width, {"I": 1, "f": 4, "d": 8}[c.code]), _bytes_of(c.code, c.numbers)]
        data = _bytes_of("f" if self.head.precision == 4 else "d", values)
        if not _all_finite(data, self.head.precision):
            raise ValueError(f"frame '{frame.name}' has a number that is not finite, or too large for the precision of the stream")
        self._put_all(frame.extra)
        self._put("FRAM", CRITICAL, b"".join(parts) + data)

    def put_pose(self, name: str, points, time=None):
        """A frame of rows, or of a flat list of numbers."""
        flat = points if not len(points) or not hasattr(points[0], "__len__") else [x for p in points for x in p]
        frame = Frame(name, flat if hasattr(flat, "reshape") else array("d", flat))
        frame.time = time
        self.put(frame)

    def close(self, tail=()):
        self._put_all(tail)
        self._put("END ", CRITICAL, struct.pack("<QQ", self.count, xxh64(self.sums)))
        self.file.flush()
        if self.owned:
            self.file.close()
            os.replace(self.part, self.path)

    def abandon(self):
        if self.owned:
            self.file.close()
            os.unlink(self.part)


def _all_finite(data: bytes, precision: int) -> bool:
    if numpy is not None:
        return bool(numpy.isfinite(numpy.frombuffer(data, "<f4" if precision == 4 else "<f8")).all())
    a = array("f" if precision == 4 else "d")
    a.frombytes(data[:len(data) // a.itemsize * a.itemsize])
    if sys.byteorder == "big":
        a.byteswap()
    return all(x - x == 0 for x in a)


# ---- pipes ----


def pipe(*commands) -> Reader:
    """Run programs one behind the other, each a list of words, and read what the last one writes."""
    programs, before = [], None
    for command in commands:
        programs.append(subprocess.Popen(command, stdin=before if before else subprocess.DEVNULL, stdout=subprocess.PIPE))
        if before:
            before.close()
        before = programs[-1].stdout
    try:
        reader = Reader(before)
    except StreamError as error:
        before.close()
        failed = [p for p in programs if p.wait()]
        raise StreamError(f"{failed[0].args[0]} ended with status {failed[0].returncode}") if failed else error
    reader.owned, reader.programs, reader.where = True, programs, programs[-1].args[0]
    return reader
