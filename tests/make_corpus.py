#!/usr/bin/env python3
"""make_corpus.py: writes the golden streams and the corpora of streams to take and to refuse.

    python3 tests/make_corpus.py [ROOT]     writes ROOT/fmt/golden, ROOT/tests/corpus/accept, ROOT/tests/corpus/reject

It is a second writer of the stream, made from fmt/STREAM.md and sharing no code with the programs or with
examples/read_stream.py, so that the readers are checked against something else than their own writer. Same bytes
every time. It leaves out what readers have to say about the streams to refuse: reject/expected.txt, kept by hand.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import copy
import json
import os
import struct
import sys

MAGIC = b"\x89VGS\r\n\x1a1"
CRITICAL, COPY_SAFE = 1, 2
FORMS = {"vertices": ("vertex", 3), "vectors": ("corner", 3), "deformations": ("corner", 4), "transforms": ("transform", 7)}
U32, F32, F64 = 1, 4, 8  # Type of a channel
LABELS = {"object": 1, "group": 2, "material": 3, "smoothing": 4, "library": 5}
NAN, INF = float("nan"), float("inf")


def xxh64(data):
    """XXH64 with seed 0, step by step as the public specification numbers them."""
    mask = (1 << 64) - 1
    p1, p2, p3 = 11400714785074694791, 14029467366897019727, 1609587929392839161
    p4, p5 = 9650029242287828579, 2870177450012600261

    def rotl(x, n):
        return (x << n | x >> (64 - n)) & mask

    def turn(acc, lane):
        return rotl((acc + lane * p2) & mask, 31) * p1 & mask

    at = 0
    if len(data) < 32:  # step 1
        acc = p5
    else:
        accs = [(p1 + p2) & mask, p2, 0, -p1 & mask]
        while len(data) - at >= 32:  # step 2
            accs = [turn(a, lane) for a, lane in zip(accs, struct.unpack_from("<4Q", data, at))]
            at += 32
        acc = sum(rotl(a, n) for a, n in zip(accs, (1, 7, 12, 18))) & mask  # step 3
        for a in accs:
            acc = ((acc ^ turn(0, a)) * p1 + p4) & mask
    acc = (acc + len(data)) & mask  # step 4
    while len(data) - at >= 8:  # step 5
        acc = (rotl(acc ^ turn(0, struct.unpack_from("<Q", data, at)[0]), 27) * p1 + p4) & mask
        at += 8
    if len(data) - at >= 4:
        acc = (rotl(acc ^ struct.unpack_from("<I", data, at)[0] * p1 & mask, 23) * p2 + p3) & mask
        at += 4
    for byte in data[at:]:
        acc = rotl(acc ^ byte * p5 & mask, 11) * p1 & mask
    acc = (acc ^ acc >> 33) * p2 & mask  # step 6
    acc = (acc ^ acc >> 29) * p3 & mask
    return acc ^ acc >> 32


# ---- from content to records ---------------------------------------------------------------------------------------


def u32(*x):
    return struct.pack(f"<{len(x)}I", *x)


def u64(*x):
    return struct.pack(f"<{len(x)}Q", *x)


def f64(*x):
    return struct.pack(f"<{len(x)}d", *x)


def pad(data):
    return data + bytes(-len(data) % 8)


def text(s):
    """A text field: length, bytes, padding."""
    return pad(u64(len(s.encode())) + s.encode())


def indices(*x):
    """A field of u32."""
    return pad(u32(*x))


def flat(rows):
    return [x for row in rows for x in row]


class Record:
    """A record about to be written. Any of its fields may be made to lie before that."""

    def __init__(self, tag, payload, flags):
        self.tag, self.payload, self.flags = tag.encode(), payload, flags
        self.length = self.payload_sum = self.header_sum = self.padding = None

    def bytes(self):
        length = len(self.payload) if self.length is None else self.length
        payload_sum = xxh64(self.payload) if self.payload_sum is None else self.payload_sum
        head = self.tag + u32(self.flags) + u64(length, payload_sum)
        head += u64(xxh64(head) if self.header_sum is None else self.header_sum)
        padding = bytes(-len(self.payload) % 8) if self.padding is None else self.padding
        return head + self.payload + padding


def unknown(records):
    return [Record(r["tag"], bytes.fromhex(r["payload"]), r["flags"]) for r in records]


def provenance(p):
    counts = u64(len(p["parents"]), len(p["args"])) + indices(*p["parents"])
    return Record("PROV", counts + b"".join(map(text, [p["program"], p["version"], *p["args"]])), COPY_SAFE)


def starts(lists):
    """Where each of the lists begins in all of them together, and where the last one ends."""
    out = [0]
    for x in lists:
        out.append(out[-1] + len(x))
    return out


def mesh(m):
    faces = m["faces"]
    return Record("MESH", u64(m["vertices"], len(faces)) + indices(*starts(faces)) + indices(*flat(faces)), CRITICAL)


def texture(t):
    corners = [0xFFFFFFFF if c is None else c for c in t["corners"]]
    counts = u64(t["dim"], len(t["coordinates"]))
    return Record("TEXC", counts + f64(*flat(t["coordinates"])) + indices(*corners), 0)


def labels(entries):
    kinds = indices(*(LABELS[x["kind"]] for x in entries))
    texts = b"".join(text(x["text"]) for x in entries)
    return Record("LABL", u64(len(entries), *(x["face"] for x in entries)) + kinds + texts, 0)


def colours(rows):
    return Record("COLV", u64(len(rows)) + pad(bytes(flat(rows))), 0)


def asset(a):
    data = a["data"].encode()
    counts = u64(len(a["vertex"]), int(a["digest"], 16), len(data))
    return Record("ASST", counts + indices(*a["vertex"]) + pad(data), 0)


def index_list(tag, rows):
    """SELE, ANCH: faces or vertices; LINK: pairs of vertices."""
    return Record(tag, u64(len(rows)) + indices(*(flat(rows) if tag == "LINK" else rows)), CRITICAL)


def reference(r):
    return Record("REFP", text(r["name"]) + f64(*flat(r["positions"])), CRITICAL)


def joint_list(joints):
    parents = indices(*(0xFFFFFFFF if j["parent"] is None else j["parent"] for j in joints))
    counts = indices(*(len(j["channels"]) for j in joints))
    channels = pad(b"".join((bytes(j["channels"]) + bytes(6))[:6] for j in joints))
    names = b"".join(text(j["name"]) for j in joints)
    return u64(len(joints)) + parents + counts + channels + f64(*flat(j["offset"] for j in joints)) + names


def skeleton(joints):
    return Record("SKEL", joint_list(joints), 0)


def rig(r):
    return Record("RIG ", joint_list(r["joints"]) + f64(*flat(r["at"]), *flat(r["turns"])), 0)


def skin(s):
    return Record("SKIN", indices(*flat(s["bones"])) + f64(*flat(s["weights"])), 0)


def digest(m):
    """What a correspondence calls a mesh."""
    words = [m["vertices"], len(m["faces"])]
    for face in m["faces"]:
        words += [len(face), *face]
    return xxh64(u64(*words))


def correspondence(c):
    ends = [u64(m["vertices"], m["faces"], int(m["digest"], 16)) for m in (c["source"], c["target"])]
    lists = [f["driven_by"] for f in c["faces"]]
    pairs = flat(lists)
    numbers = f64(*(w for _, w in pairs), *(f["distance"] for f in c["faces"]))
    matched = pad(bytes(f["matched"] for f in c["faces"]))
    return Record("CORR", b"".join(ends) + indices(*starts(lists)) + indices(*(s for s, _ in pairs)) + numbers + matched,
                  CRITICAL)


def patches(p):
    return Record("PTCH", u64(p["count"]) + indices(*p["of_face"]), 0)


def fitted(m):
    n, corners, held = len(m["share"]), len(m["corners"]), len(m["held"])
    counts = u64(n, len(m["weights"]), len(m["hinges"]), corners // m["per_corner"], held)
    counts += u64({"patches": 1, "bones": 2}[m["kind"]], m["home"] is not None, len(m["names"]), m["per_corner"])
    rows = ("weights", "place", "centre", "home_centre")
    numbers = [f64(m["size"])] + [f64(*flat(m[k])) for k in rows] + [f64(*m["share"]), f64(*flat(m["home"] or []))]
    numbers += [f64(*flat(m["hinge_at"])), f64(*m["hinge_weight"]), f64(*flat(m["corners"])), f64(*flat(m["held_at"]))]
    lists = [flat(m["hinges"]), m["held"], m["held_patch"], flat(m["corner_bones"])]
    return Record("MAP ", counts + b"".join(numbers) + b"".join(indices(*x) for x in lists) +
                  b"".join(map(text, m["names"])), CRITICAL)


def signals(s):
    n, m, d, bits = len(s["names"]), len(s["basis"]), len(s["mean"]), s["bits"]
    head = u64(n, s["space"], d, m, len(s["site"]), len(s["control"]), bits, bool(s["turn"]), bool(s["times"]), s["examples"], len(s.get("home", [])),
               s["layout"]) + f64(*s["numbers"], *s["mean"])
    form = {64: "d", 32: "f", 16: "h"}[bits]
    basis = pad(struct.pack(f"<{m * d}{form}", *flat(s["basis"])))
    return Record("SIGN", head + basis + f64(*s["unit"], *flat(s["coordinate"]), *flat(s["position"])) + indices(*s["site"]) +
                  f64(*s["parameter"], *s["knot"], *flat(s["control"]), *flat(s["turn"]), *flat(s["shift"]), *flat(s.get("home", [])),
                      *s["times"]) + b"".join(map(text, s["names"])), CRITICAL)


def network(n):
    c, lists = n["counts"], [n["numbers"], n["errors"], n["mean"], n["scale"], n["range"], n["regression"], n["root"]]
    head = u64(*(int(x, 16) if isinstance(x, str) else x for x in c.values())) + b"".join(f64(*x) for x in lists)
    return Record("NETW", head + b"".join(pad(struct.pack(f"<{len(n[k])}f", *n[k])) for k in ("parameters", "basis", "curve", "moments", "best")),
                  CRITICAL)


def form_of(c):
    """Element and width of a content's frames."""
    return (c["element"], c["width"]) if "element" in c else FORMS[c["kind"]]


def form(c):
    element, width = form_of(c)
    return Record("FORM", text(c["kind"]) + text(element) + u64(width, c["count"], c["precision"]), CRITICAL)


def channel_of(name, element, rows, kind=F64, unit="", width=None):
    """A channel as JSON shows it: a row of numbers for each element."""
    rows = [list(r) for r in rows]
    return {"name": name, "unit": unit, "element": element, "width": len(rows[0]) if width is None else width, "type": kind,
            "values": rows}


def channels_of(c, f):
    """The channels of a frame, in the order in which programs write them."""
    out = []
    if f["time"] is not None:
        out.append(channel_of("time", "frame", [[f["time"]]], unit="s"))
    if f["root"] is not None:
        out.append(channel_of("root", "frame", [f["root"]]))
    if f["anchors"]:
        out.append(channel_of("anchors", "anchor", f["anchors"]))
    if f["pins"] is not None:
        out.append(channel_of("pins", "vertex list", [[v] for v in f["pins"]], U32, width=1))
    if f["turns"] is not None:
        out.append(channel_of("turns", "joint", f["turns"]))
    if "scalars" in f:
        k = f["scalars"]
        out.append(channel_of(k["name"], "vertex", [[x] for x in k["numbers"]], c["precision"], k["unit"], 1))
    return out + f.get("channels", [])


def array_of(kind, numbers):
    return pad(struct.pack(f"<{len(numbers)}{ {U32: 'I', F32: 'f', F64: 'd'}[kind]}", *numbers))


def channel(k):
    head = text(k["name"]) + text(k["unit"]) + text(k["element"]) + u64(k["width"], len(k["values"]), k["type"])
    return head + array_of(k["type"], flat(k["values"]))


def frame(c, f):
    channels = channels_of(c, f)
    head = text(f["name"]) + u64(len(channels)) + b"".join(map(channel, channels))
    return Record("FRAM", head + array_of(c["precision"], flat(f["values"])), CRITICAL)


def records_of(c):
    """The records of a content, END left out. `order` of the content moves header records about."""
    out = [provenance(p) for p in c["provenance"]]
    if c["mesh"] is not None:
        out.append(mesh(c["mesh"]))
    if c["texture"] is not None:
        out.append(texture(c["texture"]))
    if c["labels"] is not None:
        out.append(labels(c["labels"]))
    if c["colours"] is not None:
        out.append(colours(c["colours"]))
    if c["asset"] is not None:
        out.append(asset(c["asset"]))
    for tag, value in (("SELE", c["selection"]), ("LINK", c["links"]), ("ANCH", c["anchors"])):
        if value is not None:
            out.append(index_list(tag, value))
    if c["reference"] is not None:
        out.append(reference(c["reference"]))
    if c["skeleton"] is not None:
        out.append(skeleton(c["skeleton"]))
    if c["correspondence"] is not None:
        out.append(correspondence(c["correspondence"]))
    if c["patches"] is not None:
        out.append(patches(c["patches"]))
    if c["rig"] is not None:
        out.append(rig(c["rig"]))
        if c["rig"]["skin"] is not None:
            out.append(skin(c["rig"]["skin"]))
    if c["map"] is not None:
        out.append(fitted(c["map"]))
    if c["signal"] is not None:
        out.append(signals(c["signal"]))
    if c["network"] is not None:
        out.append(network(c["network"]))
    out += unknown(c["extra"])
    out.append(form(c))
    for f in c["frames"]:
        out += unknown(f["extra"]) + [frame(c, f)]
    return out + unknown(c["tail"])


def end_of(records):
    sums = b"".join(r.bytes()[24:32] for r in records)
    return Record("END ", u64(len(records), xxh64(sums)), CRITICAL)


def assemble(records, minor=0, reserved=0, magic=MAGIC):
    return magic + u32(minor, reserved) + b"".join(r.bytes() for r in records)


def whole(c, records=None):
    records = records_of(c) if records is None else records
    return assemble(records + [end_of(records)], c["minor"])


# ---- contents ------------------------------------------------------------------------------------------------------

# a quad, a triangle that shares its edge 2-1, and a line segment that hangs on it
QUAD, TRIANGLE, SEGMENT = [0, 1, 2, 3], [2, 1, 4], [4, 5]
FACES = [QUAD, TRIANGLE, SEGMENT]
POINTS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1.5, 0.5, 0.25], [2, 0.5, 0.75]]
BENT = [[0, 0, 0.5], [1, 0, 0], [1, 1, 0], [0, 1, 0.5], [1.5, 0.5, 0.75], [1.75, 0.5, 1.5]]


COLOURS = [[255, 0, 0, 255], [0, 128, 0, 255], [0, 0, 1, 255], [7, 8, 9, 128]]
ASSET = {"digest": "0123456789abcdef", "vertex": [0, 1, 2, 3, 2], "data": "not a GLB! "}


def content(**changes):
    """A stream of vertices, as small as it gets: a mesh of two triangles, one frame. With `changes`."""
    c = {
        "minor": 0, "provenance": [], "mesh": {"vertices": 4, "faces": [[0, 1, 2], [0, 2, 3]]}, "texture": None,
        "labels": None, "colours": None, "asset": None, "selection": None, "links": None, "anchors": None,
        "reference": {"name": "rest", "positions": POINTS[:4]}, "skeleton": None, "correspondence": None,
        "patches": None, "rig": None, "map": None, "signal": None, "network": None,
        "kind": "vertices", "precision": 8, "count": 4, "extra": [],
        "frames": [pose("pose1", BENT[:4])], "tail": [],
    }
    c.update(changes)
    return c


def pose(name, values, time=None, root=None, anchors=None, pins=None, turns=None, extra=()):
    return {"name": name, "time": time, "root": root, "anchors": anchors, "pins": pins, "turns": turns, "values": values,
            "extra": list(extra)}


def scaled(numbers=(0, 0.25, -1, 5e-324), name="error", unit="D", **changes):
    """Two frames of vertices, the first with a number for each vertex."""
    first = dict(pose("pose1", BENT[:4]), scalars={"name": name, "unit": unit, "numbers": list(numbers)})
    return content(frames=[first, pose("pose2", POINTS[:4])], **changes)


def pinned(*pins):
    """Vectors in two frames, the first with these pins."""
    c = graph_content("vectors")
    free = c["frames"][0]
    return dict(c, frames=[dict(free, name="pinned", pins=list(pins)), dict(free, name="free")])


def mixed(**changes):
    """A mesh of a quad, a triangle and a line segment."""
    return content(mesh={"vertices": 6, "faces": FACES}, reference={"name": "rest", "positions": POINTS}, count=6,
                   frames=[pose("bent", BENT)], **changes)


def corner_vectors(faces, points):
    """Vertex minus mean, per corner. Exact on faces of 2 and 4 corners, since the points are multiples of 1/4."""
    out = []
    for face in faces:
        mean = [sum(points[v][k] for v in face) / len(face) for k in range(3)]
        out += [[points[v][k] - mean[k] for k in range(3)] for v in face]
    return out


def mean_of(points):
    return [sum(p[k] for p in points) / len(points) for k in range(3)]


def graph_content(kind, **changes):
    """Two components, a quad and a segment, joined by one link; anchors 0 and 5."""
    faces, links = [QUAD, SEGMENT], [[1, 4]]
    vectors = corner_vectors(faces + links, BENT)
    turn = [0.5, 0.5, 0.5, 0.5]  # a third of a turn about 1 1 1, scale 1
    values = vectors if kind == "vectors" else [turn, [1, 0, 0, 0], [0, 0, 0, -2], [-1, 0, 0, 0], [0.5, 0, 0, 0.5],
                                                [1, 1, 0, 0], [0.25, 0, 0.5, 0], [2, 0, 0, 0]]
    root = mean_of(BENT) if kind == "vectors" else [0.5, 0.25, -1]
    c = content(mesh={"vertices": 6, "faces": faces}, reference={"name": "rest", "positions": POINTS}, kind=kind,
                links=links, anchors=[0, 5], count=8,
                frames=[pose("bent", values, time=0.5, root=root, anchors=[BENT[0], BENT[5]])])
    c.update(changes)
    return c


JOINTS = [dict(zip(("name", "parent", "offset", "channels"), j)) for j in (
    ("Hips", None, [0, 1, 0], [1, 2, 3, 6, 4, 5]), ("Spine", 0, [0, 0.5, 0], [6, 4, 5]),
    ("Spine.end", 1, [0, 0.25, 0], []), ("K\u00fcken", 0, [0.125, -1, 0], [4]))]


def skeleton_content(turns=None, **changes):
    """Hips, a spine with its end, and a leg; the mesh has the bones as its faces."""
    rest = [[0, 1, 0], [0, 1.5, 0], [0, 1.75, 0], [0.125, 0, 0]]
    bent = [[0, 1, 0], [0.5, 1, 0], [0.75, 1, 0], [0.125, 0, 0]]
    return content(mesh={"vertices": 4, "faces": [[0, 1], [1, 2], [0, 3]]}, frames=[pose("bent", bent, turns=turns)],
                   reference={"name": "rest", "positions": rest}, skeleton=JOINTS, **changes)


def feature_content(**changes):
    """9 numbers for each vertex."""
    rows = [[v + k / 8 for k in range(9)] for v in range(4)]
    return content(**{**dict(kind="features", element="vertex", width=9, frames=[pose("f", rows)]), **changes})


def coordinate_content(**changes):
    """2 numbers for each frame, no mesh; with them a parameter, and numbers of two components."""
    first = dict(pose("c", [[0.25, -1]], time=1), channels=[
        channel_of("parameter", "frame", [[3.5]]), channel_of("mass", "component", [[1], [2.5]], F32, "kg")])
    return content(**{**dict(mesh=None, reference=None, kind="coordinates", element="frame", width=2, count=1,
                             frames=[first, pose("d", [[0, 0]])]), **changes})


def unknown_form_content(**changes):
    """Frames of which nobody knows what they are, and of what."""
    first = dict(pose("u", [[1, 2], [3, 4], [5, 6]]), channels=[channel_of("hue", "whisker", [[1, 0, 0]] * 5, F32, "1/m")])
    return content(**{**dict(kind="m\u00f6bius", element="whisker", width=2, count=3, frames=[first]), **changes})


HALF = [0.5, 0.5, 0.5, 0.5]  # a third of a turn
STRAIGHT = [1.0, 0.0, 0.0, 0.0]
TURNED = [HALF, [0.6, 0.8, 0.0, 0.0], [0.6, 0.8, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]]


def rig_content(skin=True, **changes):
    """Three bones, of which one has an end site, move the four vertices of two triangles; the joints are no vertices."""
    bones = [[0, 1, 2, 0], [2, 0, 0, 0], [1, 0, 2, 0], [0, 0, 0, 0]]
    weights = [[0.5, 0.25, 0.25, 0], [1, 0, 0, 0], [0.375, 0.375, 0.25, 0], [0.25, 0.25, 0.25, 0.25]]
    r = {"joints": JOINTS, "at": [[0, 1, 0], [0, 1.5, 0], [0, 1.5, 0.25], [0.125, 0, 0]],
         "turns": [STRAIGHT, HALF, HALF, STRAIGHT], "skin": {"bones": bones, "weights": weights} if skin else None}
    return content(rig=r, **changes)


def bone_map_content(per_corner=2, corners=True, **changes):
    """A map of the three bones of that rig, whose corners go with two bones each, the last with the second alone."""
    two = [[0.5, 0.5, 0, 0], [0, 0, 0.25, 1]]
    lists = [two] * 5 + [[[0, 0, 0, 0], [1, 0, 0, 0]]]
    rest = POINTS[:4]
    m = {"kind": "bones", "per_corner": per_corner, "size": 1.0, "names": [],
         "weights": [[*[x / 2 for x in p], 0.5, 0, 0, 0, 0, *[x / 2 for x in p], 0.5] for p in rest],
         "place": [[0.25 * k for k in range(9)]] * 3, "centre": rest[:3], "home_centre": rest[:3], "share": [0.5, 0.25, 0.25],
         "home": None, "hinge_at": [], "hinge_weight": [], "held_at": [], "hinges": [], "held": [1, 3], "held_patch": [],
         "corners": [q for c in lists for q in c[-per_corner:]] if corners else [],
         "corner_bones": [[0, 1, 2][-per_corner:] if per_corner < 3 else [0, 1, 2]] * 6 if corners else []}
    return rig_content(links=[], frames=[], map=m, **changes)


def driven(by, distance=0.0, matched=True):
    return {"driven_by": by, "distance": distance, "matched": matched}


def register_content(matched=None, **changes):
    """Like what vg-register writes: source mesh and reference, one frame of it fitted to the target (three faces).
    matched: of all faces; 2: the target rides on the source."""
    c = content(frames=[pose("fitted", BENT[:4])])
    target = {"vertices": 5, "faces": [[0, 1, 2], [0, 2, 3], [0, 3, 4]]}
    ends = [{"vertices": m["vertices"], "faces": len(m["faces"]), "digest": f"{digest(m):016x}"}
            for m in (c["mesh"], target)]
    faces = [driven([[0, 1.0]], 0.25), driven([[1, 0.75], [0, 0.25]]), driven([[1, 1.0]], 2.5, False)]
    faces = [f if matched is None else dict(f, matched=matched) for f in faces]
    return dict(c, correspondence={"source": ends[0], "target": ends[1], "faces": faces}, **changes)


def map_content(home=False, corners=True, **changes):
    """Two triangles, a patch each: vertices 0 and 3 go with one patch, 1 and 2 half with each."""
    rest, half = POINTS[:4], [[0, 0, 0, 0], [0, 0, 0, 0]]
    half = [[x / 2 for x in p] + [0.5] for p in rest]
    nobody, whole_of = [0, 0, 0, 0], [[*p, 1] for p in rest]
    weights = [whole_of[0] + nobody, half[1] + half[1], half[2] + half[2], nobody + whole_of[3]]
    centre = [[0.75, 0.25, 0], [0.25, 0.75, 0]]
    m = {"kind": "patches", "per_corner": 1, "corner_bones": [], "size": 1.5 if home else 1.0, "names": ["left", "r\u00e9st"] if home else [], "weights": weights,
         "place": [[-0.5, -0.25, 0, -0.25, -0.25, 0], [-0.5, -0.25, 0, -0.25, -0.25, 0]], "centre": centre,
         "home_centre": centre, "share": [0.5, 0.5], "home": [[2, 0, 0], [3, 0, 0], [3, 1, 0], [2, 1, 0]] if home else None,
         "hinge_at": [[0.5, 0.5, 0]], "hinge_weight": [2.0], "corners": [[1, 0, 0, 0]] * 6 if corners else [], "held_at": [[0, 0, 0], [0, 1, 0]],
         "hinges": [[0, 1]], "held": [0, 3], "held_patch": [0, 1]}
    return content(links=[], frames=[], patches={"count": 2, "of_face": [0, 1]}, map=m, **changes)


def signal_content(**changes):
    """Two triangles at three times: two shape coordinates, three sites, a straight curve."""
    s = {"space": 1, "bits": 64, "examples": False, "layout": 1, "numbers": [0, 0.25, 0, 0, 0, 0], "mean": flat(POINTS[:4]),
         "basis": [[1] + [0] * 11, [0, 0, 0, 0, 1] + [0] * 7], "unit": [], "coordinate": [[-1, 0], [0, 0.5], [1, 0]],
         "position": [[-1, 0], [0, 1], [1, 0]], "site": [2, 0, 1], "parameter": [0, 1, 2], "knot": [0, 0, 0, 2, 2, 2],
         "control": [[-1, 0], [-0.25, 0.5], [0.25, 0.5], [1, 0]], "turn": [[1, 0, 0, 0]] * 3, "shift": [[0, 0, 0], [0, 0, 1], [0, 0, 2]],
         "times": [0, 0.5, 1], "names": ["one", "tw\u00f6", ""]}
    s.update(changes)
    return content(frames=[], signal=s, links=None if s["space"] == 1 else [])


MIXED = {"mesh": {"vertices": 6, "faces": [[0, 1, 2, 3], [0, 3, 4], [4, 5]]}, "count": 6,
         "reference": {"name": "", "positions": POINTS[:4] + [[-1, 0.5, 0], [-2, 0, 0]]}}


def shapes(space, d, turns=0, **changes):
    """A signal of shapes that are not vertices: d numbers each, measured from so many turns."""
    return dict(signal_content(space=space, mean=[0] * d, basis=[[0] * d] * 2, home=[[1, 0, 0, 0]] * turns), **changes)


def network_content(counts=(), **changes):
    """Two triangles, one coordinate, one layer of one: 2 numbers of the output, 12 of the gates; training goes on."""
    c = {"model": 1, "direction": 0, "mesh_digest": f"{digest(content()['mesh']):016x}", "data_digest": "0123456789abcdef", "vertices": 4,
         "parts": 1, "width": 9, "numbers": 1, "rank": 1, "layers": 1, "hidden": 1, "convolutions": 0, "uncertain": 0, "sets": 1,
         "parameters": 14, "seed": 7, "frames": 32, "iterations": 300, "step": 2, "windows": 8, "open": 1, "phase": 0,
         "best_iteration": 200, "curve_length": 3, "curve_block": 2}
    c.update(counts)
    features, p = c["vertices"] * c["width"], c["sets"] * c["parameters"]
    n = {"counts": c, "numbers": [0.5, 0.625, 2.5, -1, -2, 1, 2, 0.125, 0.01, 0.8], "errors": [-1.0] * 29 + [1.5], "mean": [0.25] * features,
         "scale": [1.5, 0.5], "range": [-1, 1], "regression": [0.5] * 10 if c["model"] == 1 else [], "root": [0.0] * 17 + [1.0],
         "parameters": [0.5] * p, "basis": [1.0] + [0.0] * (c["rank"] * features - 1),
         "curve": [0.5, 2.0, 0.25, 0.375, 1.5, -1, 0.625, 3.0, -1], "moments": [0.25] * (2 * p if c["open"] else 0),
         "best": [0.75] * (p if c["open"] else 0)}
    n.update(changes)
    return content(frames=[], network=n)


NOTE = {"tag": "XNOT", "flags": COPY_SAFE, "payload": b"copied".hex()}
FUTURE = {"tag": "X 1 ", "flags": COPY_SAFE | 0xABCD0000, "payload": bytes(range(8)).hex()}
DROPPED = {"tag": "XTMP", "flags": 0, "payload": b"a filter drops this".hex()}
EMPTY = {"tag": "XNON", "flags": COPY_SAFE, "payload": ""}


def golden():
    """name -> (what it shows, content)"""
    prov = [{"program": "vg-encode", "version": "0.1.0", "parents": [], "args": ["vg-encode", "a.obj"]},
            {"program": "vg-encode", "version": "0.1.0", "parents": [], "args": ["vg-encode", "b c.obj", ""]},
            {"program": "vg-deform", "version": "0.1.0", "parents": [0, 1],
             "args": ["vg-deform", "--onto", "t\u00eate-\u5934.vgs"]}]
    two = [pose("pose1", BENT[:4], time=0), pose("pose2", POINTS[:4], time=1 / 24)]
    selected = [QUAD, SEGMENT]
    vectors = corner_vectors(selected, BENT)
    used = mean_of(BENT)
    return {
        "smallest": ("one frame of vertices, nothing that may be left out", content()),
        "f32": ("values in binary32; the reference stays binary64", content(precision=4)),
        "times": ("two named frames with times in seconds", content(frames=two)),
        "empty-sequence": ("a mesh and no frame: valid", content(frames=[])),
        "every-header-record": (
            "PROV three times with a merge, TEXC, LABL, SELE, LINK, ANCH; a face of 4, of 3 and of 2 vertices",
            mixed(provenance=prov, selection=[0, 2], links=[[1, 4]], anchors=[3],
                  texture={"dim": 2, "coordinates": [[0, 0], [1, 0], [1, 1], [0, 1]],
                           "corners": [0, 1, 2, 3, 2, 1, None, None, None]},
                  labels=[{"face": 0, "kind": "library", "text": "cloth.mtl"},
                          {"face": 0, "kind": "group", "text": "body"},
                          {"face": 1, "kind": "material", "text": "d\u00fcnn"},
                          {"face": 3, "kind": "object", "text": "nothing follows"}])),
        "vectors": ("two components joined by a link, two anchors, a root", graph_content("vectors")),
        "vectors-selected-f32": (
            "vectors of the selected faces 0 and 2 only, binary32; the triangle carries none",
            dict(mixed(selection=[0, 2], links=[[1, 4]], precision=4), kind="vectors", count=8,
                 frames=[pose("bent", vectors + corner_vectors([[1, 4]], BENT), root=used, anchors=[])])),
        "pins": ("vectors with three vertices pinned in the first frame and none in the second", pinned(1, 2, 4)),
        "scalars": ("two frames of vertices, the first with a number for each vertex", scaled()),
        "deformations": ("a quaternion w x y z per corner, squared length = scale", graph_content("deformations")),
        "transforms": (
            "two transforms a frame, no mesh at all",
            content(mesh=None, reference=None, kind="transforms", count=2,
                    frames=[pose("t", [[1, 0, 0, 0, 0, 0, 0], [0.5, 0.5, -0.5, 0.5, 1, 2, 3]], time=-1.5)])),
        "skeleton": ("the joints of a skeleton, whose bones are the mesh's faces", skeleton_content()),
        "correspondence": ("three faces of a target driven by two faces of a source", register_content()),
        "colours": ("a colour for each vertex, one of which is half transparent", content(colours=COLOURS)),
        "asset": ("two vertices of a file for one of the mesh, and 11 bytes that only writers of such files know",
                  content(asset=ASSET)),
        "patches": ("three faces in two patches", mixed(patches={"count": 2, "of_face": [1, 0, 1]})),
        "turns": ("a skeleton whose frame says how its joints have turned", skeleton_content(TURNED)),
        "map": ("two transforms, half of a quad each", map_content()),
        "signal": ("three frames as signals", signal_content()),
        "network": ("a network whose training goes on", network_content()),
        "rig": ("three bones that move the vertices of two triangles: their skin, and a map with two bones a corner",
                bone_map_content()),
        "features": ("9 numbers for each vertex", feature_content()),
        "coordinates": ("2 numbers for the frame as a whole, with channels of the frame and of components",
                        coordinate_content()),
        "unknown-form": ("frames of a form, and channels of elements, that no version has; vg-info and vg-encode pass them on",
                         unknown_form_content()),
        "unknown-records": (
            "copy-safe records before FORM, between frames and at the end; one that a filter drops",
            content(extra=[NOTE, DROPPED], tail=[NOTE],
                    frames=[pose("a", BENT[:4], extra=[FUTURE]), pose("b", POINTS[:4], extra=[EMPTY])])),
        "future-minor": ("minor version 7: read like minor 0", content(minor=7)),
    }


def accept():
    """name -> bytes: valid, and odd."""
    moved = records_of(mixed(provenance=[{"program": "p", "version": "", "parents": [], "args": []}], anchors=[],
                             labels=[], links=[], selection=[2]))
    by_tag = {r.tag.strip().decode(): r for r in moved}
    order = ["MESH", "REFP", "ANCH", "LABL", "LINK", "PROV", "SELE", "FORM", "FRAM"]
    names = ["", "", "dup", "dup", "\u00e4\u4e2d\U0001f40e", "x" * 300, "a/b", "%n %s"]
    points = {"vertices": 3, "faces": []}
    nobody = {"vertices": 0, "faces": 0, "digest": "0"}
    ignored = records_of(content())
    for r in ignored:
        r.flags |= 0xFFFF0000
    return {
        "header-in-another-order": whole(content(), [by_tag[t] for t in order]),
        "names": whole(content(frames=[pose(n, BENT[:4]) for n in names])),
        "points-without-faces": whole(content(mesh=points, count=3, reference={"name": "", "positions": POINTS[:3]},
                                              frames=[pose("p", BENT[:3])])),
        "no-vertices": whole(content(mesh={"vertices": 0, "faces": []}, reference={"name": "", "positions": []},
                                     count=0, frames=[pose("nothing", [])])),
        "vectors-of-nothing": whole(content(mesh=points, kind="vectors", count=0, links=[], frames=[
            pose("p", [], root=[0, 0, 0], anchors=[])], reference={"name": "", "positions": POINTS[:3]})),
        "no-transforms": whole(content(mesh=None, reference=None, kind="transforms", count=0,
                                       frames=[pose("t", [])])),
        "transforms-with-mesh": whole(content(kind="transforms", count=1,
                                              frames=[pose("t", [[1, 0, 0, 0, 1, 2, 3]])])),
        "line-segments-only": whole(content(mesh={"vertices": 4, "faces": [[0, 1], [1, 2], [3, 1]]})),
        "ignored-flags": whole(content(), ignored),
        "pins-even": whole(pinned(0, 5)),
        "scalars-f32-without-unit": whole(scaled(numbers=(1, 2, 3, 0.5), name="t\u00eate 1", unit="", precision=4)),
        "scalars-of-nothing": whole(content(
            mesh={"vertices": 0, "faces": []}, reference={"name": "", "positions": []}, count=0,
            frames=[dict(pose("nothing", []), scalars={"name": "x", "unit": "m/s", "numbers": []})])),
        "channels-255": whole(with_channels(content(), 255)),
        "channels-of-all-elements": whole(dict(skeleton_content(TURNED), frames=[dict(
            skeleton_content(TURNED)["frames"][0], channels=[
                channel_of("a", "vertex", [[1, 2]] * 4), channel_of("b", "corner", [[k] for k in range(6)], F32),
                channel_of("c", "joint", [[1]] * 4, unit="rad"), channel_of("d", "transform", [[1]] * 5),
                channel_of("e", "frame", [[1, 2, 3, 4, 5]]), channel_of("f", "component", [], width=3),
                channel_of("g", "vertex list", [[0], [3]], U32), channel_of("h", "anchor", [], width=1)])])),
        "features-f32": whole(feature_content(precision=4)),
        "form-unknown-of-vertices": whole(unknown_form_content(element="vertex", count=4, frames=[
            pose("v", [[1, 2], [3, 4], [5, 6], [7, 8]])])),
        "form-unknown-of-corners": whole(dict(graph_content("vectors"), kind="strains", element="corner", width=6, frames=[
            dict(graph_content("vectors")["frames"][0], values=[[1, 2, 3, 4, 5, 6]] * 8)])),
        "scalars-behind-unknown": whole(dict(scaled(), frames=[dict(scaled()["frames"][0], extra=[FUTURE])])),
        "pins-with-selection": whole(dict(pinned(3), selection=[0], links=[[1, 4], [4, 5]])),
        "skeleton-of-nothing": whole(content(mesh={"vertices": 0, "faces": []}, count=0, frames=[], skeleton=[],
                                             reference={"name": "", "positions": []})),
        "correspondence-without-mesh": whole(content(mesh=None, reference=None, kind="transforms", count=0, frames=[],
                                                     correspondence=register_content()["correspondence"])),
        "correspondence-bound": whole(register_content(matched=2)),
        "correspondence-of-nothing": whole(content(correspondence={"source": nobody, "target": nobody, "faces": []})),
        "sign-single": whole(signal_content(bits=32, times=[], turn=[], shift=[])),
        "sign-int16": whole(signal_content(bits=16, unit=[1e-4, 2.5], basis=[[32767] + [0] * 11, [0, 0, -32768] + [0] * 9])),
        "sign-examples": whole(signal_content(examples=True, home=[[1, 0, 0, 0], [0.6, 0, 0.8, 0], [0, 0, 0, -1]])),
        "sign-of-vectors": whole(signal_content(space=2, mean=[0] * 24, basis=[[0] * 24] * 2, home=[[1, 0, 0, 0]] * 2)),
        "sign-of-gradients": whole(shapes(3, 18, 2)),
        "sign-of-rotations": whole(shapes(4, 18)),
        "sign-of-lengths": whole(shapes(5, 9)),
        "sign-of-rotations-of-mixed-faces": whole(shapes(4, 36, **MIXED)),
        "sign-of-lengths-of-mixed-faces": whole(shapes(5, 16, **MIXED)),
        "sign-no-coordinates": whole(signal_content(basis=[], coordinate=[[], [], []])),
        "map-with-home-and-names": whole(map_content(home=True)),
        "map-of-bones-one-per-corner": whole(bone_map_content(per_corner=1)),
        "map-of-bones-without-corners": whole(bone_map_content(corners=False)),
        "rig-without-skin": whole(rig_content(skin=False)),
        "rig-of-transforms": whole(rig_content(kind="transforms", count=3, frames=[pose("t", [[1, 0, 0, 0, 1, 2, 3]] * 3)])),
        "turns-f32": whole(skeleton_content(TURNED, precision=4)),
        "turns-in-one-frame": whole(dict(skeleton_content(), frames=skeleton_content(TURNED)["frames"] + skeleton_content()["frames"])),
        "patch-without-face": whole(content(patches={"count": 9, "of_face": [8, 0]})),
        "extreme-numbers": whole(content(frames=[pose("x", [
            [1.7976931348623157e308, -1.7976931348623157e308, 5e-324], [-0.0, 0.0, 2.2250738585072014e-308],
            [1, 2, 3], [4, 5, 6]], time=-1e300)])),
        "minor-4294967295": whole(content(minor=0xFFFFFFFF)),
        "texture-of-three": whole(content(texture={"dim": 3, "coordinates": [[0, 1, 2]],
                                                   "corners": [0, None, 0, 0, None, 0]})),
        "texture-of-none": whole(content(texture={"dim": 1, "coordinates": [], "corners": [None] * 6})),
    }


# ---- streams to refuse ---------------------------------------------------------------------------------------------


def lie(c, tag, **fields):
    """The content with fields of its first record of that tag made false."""
    records = records_of(c)
    record = next(r for r in records if r.tag.decode() == tag)
    for name, value in fields.items():
        setattr(record, name, value(record) if callable(value) else value)
    return whole(c, records)


def patched(c, tag, at, data):
    """The content with bytes of a payload replaced, and checksums that agree with that."""
    def change(record):
        where = at if at >= 0 else len(record.payload) + at
        return record.payload[:where] + data + record.payload[where + len(data):]
    return lie(c, tag, payload=change)


def flipped(data, at):
    return data[:at] + bytes([data[at] ^ 1]) + data[at + 1:]


def without(c, tag):
    return whole(c, [r for r in records_of(c) if r.tag.decode() != tag])


def inserted(c, before, *more):
    records = records_of(c)
    at = len(records) if before is None else next(i for i, r in enumerate(records) if r.tag.decode() == before)
    return whole(c, records[:at] + list(more) + records[at:])


def bad_end(count=0, running=0, length=None, **fields):
    records = records_of(content())
    end = end_of(records)
    right_count, right_sum = struct.unpack("<QQ", end.payload)
    end.payload = u64(right_count + count, right_sum ^ running)
    if length is not None:
        end.payload = (end.payload + bytes(8))[:length]
    for name, value in fields.items():
        setattr(end, name, value)
    return assemble(records + [end])


def failed(message=text("frame 'x' is not finite"), after=None):
    fail = Record("FAIL", u64(3) + text("vg-solve") + message, CRITICAL)
    return assemble(records_of(content())[:after] + [fail])


def reject_container():
    """Faults of the file header, record headers and the end: name -> bytes"""
    c = content()
    good = whole(c)
    records = records_of(c)
    size = {r.tag.decode(): len(r.bytes()) for r in records}
    form_at = 16 + size["MESH"] + size["REFP"]
    return {
        "empty": b"",
        "zero-byte": b"\0",
        "magic-wrong": b"\x88" + good[1:],
        "magic-text-mode": good.replace(b"\r\n", b"\n", 1),
        "magic-cut": good[:5],
        "major-2": assemble(records, magic=MAGIC[:7] + b"2"),
        "file-header-cut": good[:15],
        "file-header-reserved": assemble(records + [end_of(records)], reserved=1),
        "only-file-header": good[:16],
        "cut-in-record-header": good[:16 + 31],
        "cut-in-payload": good[:16 + 40],
        "cut-before-form": good[:form_at],
        "cut-before-frames": good[:form_at + size["FORM"]],
        "cut-in-frame": good[:-60],
        "cut-before-end": good[:-48],
        "cut-in-end": good[:-1],
        "no-end": assemble(records),
        "end-count": bad_end(count=1),
        "end-sum": bad_end(running=1),
        "end-short": bad_end(length=8),
        "end-long": bad_end(length=24),
        "end-not-critical-and-damaged": flipped(good, len(good) - 48 + 4),
        "trailing-byte": good + b"\n",
        "trailing-stream": good + good,
        "trailing-zeros": good + bytes(512),
        "header-checksum": lie(c, "MESH", header_sum=0),
        "payload-checksum": lie(c, "REFP", payload_sum=0),
        "bit-in-payload": flipped(good, 16 + size["MESH"] + 32 + 20),
        "bit-in-tag": flipped(good, 16),
        "padding-not-zero": lie(c, "FRAM", payload=lambda r: r.payload[:-4], padding=b"\0\0\0\1"),
        "tag-lower-case": inserted(c, "FORM", Record("note", b"", COPY_SAFE)),
        "tag-nul": inserted(c, "FORM", Record("AB\0\0", b"", COPY_SAFE)),
        "flags-reserved": inserted(c, "FORM", Record("XNOT", b"", COPY_SAFE | 4)),
        "length-2-31": lie(c, "MESH", length=1 << 31),
        "length-2-40": lie(c, "FRAM", length=1 << 40),
        "length-2-40-and-one": lie(c, "FRAM", length=(1 << 40) + 1),
        "length-2-63": lie(c, "FRAM", length=1 << 63),
        "length-2-64-less-1": lie(c, "REFP", length=(1 << 64) - 1),
        "critical-before-form": inserted(c, "FORM", Record("XCRI", b"1234", CRITICAL)),
        "critical-and-copy-safe": inserted(c, "FORM", Record("XBOT", b"", CRITICAL | COPY_SAFE)),
        "critical-between-frames": inserted(c, "FRAM", Record("X 2 ", b"", CRITICAL)),
        "critical-before-end": inserted(c, None, Record("XEND", b"", CRITICAL)),
        "fail": failed(),
        "fail-before-form": failed(after=1),
        "fail-cut": failed(u64(0xFFFFFFFF)),
    }


def reject_order():
    """Records that are missing, there twice, or in the wrong place."""
    c, v = content(), graph_content("vectors")
    of = {r.tag.decode(): r for r in records_of(c)}
    first = [index_list("SELE", [0]), index_list("LINK", []), index_list("ANCH", []),
             Record("TEXC", u64(1, 0) + u32(0xFFFFFFFF) * 6, 0), labels([]), of["REFP"]]
    joints = skeleton(skeleton_content()["skeleton"])
    b = bone_map_content()
    by = {r.tag.strip().decode(): r for r in records_of(b)}
    drives = correspondence(register_content()["correspondence"])
    out = {f"{r.tag.decode().lower()}-before-mesh": whole(c, [r, of["MESH"], of["FORM"]]) for r in first}
    for r in first[:-1]:
        out[f"{r.tag.decode().lower()}-twice"] = whole(c, [of["MESH"], r, r, of["REFP"], of["FORM"], of["FRAM"]])
    orphan = Record("PROV", u64(1, 0) + indices(0) + text("p") + text("1"), COPY_SAFE)
    late = Record("PROV", u64(0, 0) + text("p") + text("1"), COPY_SAFE)
    out.update({
        "sign-before-mesh": whole(c, [signals(signal_content()["signal"]), of["MESH"], of["REFP"], of["FORM"]]),
        "rig-before-mesh": whole(c, [rig(rig_content()["rig"]), of["MESH"], of["REFP"], of["FORM"]]),
        "rig-twice": inserted(rig_content(), "FORM", rig(rig_content()["rig"])),
        "rig-after-map": whole(b, [by[t] for t in ("MESH", "LINK", "REFP", "MAP", "RIG", "SKIN", "FORM")]),
        "rig-missing": whole(b, [by[t] for t in ("MESH", "LINK", "REFP", "MAP", "FORM")]),
        "skin-before-rig": whole(b, [by[t] for t in ("MESH", "REFP", "SKIN", "RIG", "FORM")]),
        "skin-twice": inserted(rig_content(), "FORM", by["SKIN"]),
        "skel-before-mesh": whole(c, [joints, of["MESH"], of["REFP"], of["FORM"]]),
        "skel-twice": inserted(c, "FORM", joints, joints),
        "corr-twice": inserted(c, "FORM", drives, drives),
        "corr-after-form": inserted(c, "FRAM", drives),
        "mesh-twice": inserted(c, "REFP", of["MESH"]),
        "refp-twice": inserted(c, "FORM", of["REFP"]),
        "form-twice": inserted(c, "FRAM", of["FORM"]),
        "mesh-after-form": whole(c, [of["FORM"], of["MESH"], of["REFP"], of["FRAM"]]),
        "prov-after-form": inserted(c, "FRAM", late),
        "no-form": without(c, "FORM"),
        "nothing-but-end": whole(c, []),
        "no-mesh": whole(c, [of["FORM"], of["FRAM"]]),
        "no-refp": without(c, "REFP"),
        "no-refp-transforms": without(content(kind="transforms", count=0, frames=[pose("t", [])]), "REFP"),
        "no-link": without(v, "LINK"),
        "prov-parent-itself": inserted(c, "MESH", orphan),
    })
    return out


def reject_header():
    """Header records with content that does not hold."""
    c, m = content(), mixed()

    def with_record(tag, payload, flags=CRITICAL):
        return inserted(c, "REFP", Record(tag, payload, flags))

    tex_head = u64(2, 1) + f64(0, 0)
    label = {"face": 0, "kind": "group", "text": "abc"}
    prov = u64(0, 1) + text("p") + text("1")

    def with_list(tag, rows):
        return inserted(c, "REFP", index_list(tag, rows))

    def with_labels(*entries):
        return whole(content(labels=list(entries)))

    g = content(labels=[label])  # payload: count, face, kind from byte 16, length of the text from 24, text from 32

    return {
        "mesh-length-short": lie(c, "MESH", payload=lambda r: r.payload[:-4]),
        "mesh-length-long": lie(c, "MESH", payload=lambda r: r.payload + u32(0)),
        "mesh-empty": lie(c, "MESH", payload=b""),
        "mesh-nv-2-32-less-1": patched(c, "MESH", 0, u64(0xFFFFFFFF)),
        "mesh-nv-2-63": patched(c, "MESH", 0, u64(1 << 63)),
        "mesh-nf-2-31": patched(c, "MESH", 8, u64(1 << 31)),
        "mesh-nf-2-62": patched(c, "MESH", 8, u64(1 << 62)),
        "mesh-nf-2-64-less-1": patched(c, "MESH", 8, u64((1 << 64) - 1)),
        "mesh-face-size-0": patched(c, "MESH", 16, u32(0, 0, 6)),
        "mesh-face-size-1": patched(c, "MESH", 16, u32(0, 1, 6)),
        "mesh-starts-descend": patched(c, "MESH", 16, u32(0, 7, 6)),
        "mesh-start-not-zero": patched(c, "MESH", 16, u32(1, 3, 6)),
        "mesh-corners-2-32-less-1": patched(c, "MESH", 24, u32(0xFFFFFFFF)),
        "mesh-padding": patched(c, "MESH", 28, u32(1)),
        "mesh-index-out-of-range": patched(c, "MESH", -4, u32(4)),
        "mesh-index-2-32-less-1": patched(c, "MESH", -4, u32(0xFFFFFFFF)),
        "mesh-vertex-twice": patched(c, "MESH", -4, u32(0)),
        "mesh-segment-twice": patched(m, "MESH", -8, u32(4)),
        "texc-dim-0": with_record("TEXC", u64(0, 0) + u32(0xFFFFFFFF) * 6, 0),
        "texc-dim-4": with_record("TEXC", u64(4, 0) + u32(0xFFFFFFFF) * 6, 0),
        "texc-dim-2-32": with_record("TEXC", u64(1 << 32, 0) + u32(0xFFFFFFFF) * 6, 0),
        "texc-corner-out-of-range": with_record("TEXC", tex_head + u32(0, 0, 0, 0, 0, 1), 0),
        "texc-corner-missing": with_record("TEXC", tex_head + u32(0) * 5, 0),
        "texc-nan": with_record("TEXC", u64(1, 1) + f64(NAN) + u32(0) * 6, 0),
        "texc-nt-2-61": with_record("TEXC", u64(1, 1 << 61) + u32(0) * 6, 0),
        "labl-kind-0": patched(g, "LABL", 16, u32(0)),
        "labl-kind-6": patched(g, "LABL", 16, u32(6)),
        "labl-face-out-of-range": with_labels(dict(label, face=3)),
        "labl-order": with_labels(dict(label, face=2), label),
        "labl-count-2-61": patched(g, "LABL", 0, u64(1 << 61)),
        "labl-length-2-31": patched(g, "LABL", 24, u64(1 << 31)),
        "labl-cut": lie(g, "LABL", payload=lambda r: r.payload[:-8]),
        "labl-padding": patched(g, "LABL", -1, b"\1"),
        "labl-utf8": patched(g, "LABL", 32, b"\xc3\x28"),
        "sele-order": with_list("SELE", [1, 0]),
        "sele-twice-the-same": with_list("SELE", [1, 1]),
        "sele-out-of-range": with_list("SELE", [2]),
        "sele-length": with_record("SELE", u64(3) + u32(0, 1)),
        "sele-padding": with_record("SELE", u64(1) + u32(0, 1)),
        "link-to-itself": with_list("LINK", [[2, 2]]),
        "link-out-of-range": with_list("LINK", [[0, 4]]),
        "link-length": with_record("LINK", u64(2) + u32(0, 1)),
        "link-2-63": with_record("LINK", u64(1 << 63) + u32(0, 1)),
        "anch-order": with_list("ANCH", [2, 1]),
        "anch-out-of-range": with_list("ANCH", [4]),
        "anch-length": with_record("ANCH", u64(1) + u32(0)),
        "anch-long": with_record("ANCH", u64(1) + u32(0, 0, 0, 0)),
        "refp-short": lie(c, "REFP", payload=lambda r: r.payload[:-8]),
        "refp-long": lie(c, "REFP", payload=lambda r: r.payload + bytes(8)),
        "refp-nan": patched(c, "REFP", -8, f64(NAN)),
        "refp-name-2-32-less-1": patched(c, "REFP", 0, u64(0xFFFFFFFF)),
        "refp-name-2-64-less-1": patched(c, "REFP", 0, u64((1 << 64) - 1)),
        "refp-name-padding": patched(c, "REFP", 12, b"\0\0\0\1"),
        "refp-name-utf8": patched(c, "REFP", 8, b"\xff"),
        "refp-name-nul": patched(c, "REFP", 9, b"\0"),
        "form-name-empty": whole(content(kind="", element="vertex", width=3)),
        "form-element": whole(content(element="corner", width=3)),
        "form-width": whole(content(element="vertex", width=4, frames=[])),
        "form-width-0": whole(feature_content(width=0, frames=[])),
        "form-width-2-63": whole(feature_content(width=1 << 63, frames=[pose("f", [])])),
        "form-of-lists": whole(content(kind="lists", element="vertex list", width=1, frames=[])),
        "form-precision-2": patched(c, "FORM", -8, u64(2)),
        "form-precision-16": patched(c, "FORM", -8, u64(16)),
        "form-precision-2-32-and-8": patched(c, "FORM", -8, u64(1 << 32 | 8)),
        "form-count-less": patched(c, "FORM", -16, u64(3)),
        "form-count-2-63": patched(c, "FORM", -16, u64(1 << 63)),
        "form-count-of-vectors": patched(graph_content("vectors"), "FORM", -16, u64(6)),
        "form-count-of-coordinates": whole(coordinate_content(count=2, frames=[])),
        "form-count-of-features": whole(feature_content(count=5, frames=[])),
        "form-features-without-mesh": whole(feature_content(mesh=None, reference=None, frames=[])),
        "form-unknown-without-mesh": whole(unknown_form_content(mesh=None, reference=None, element="vertex", frames=[])),
        "form-unknown-without-link": whole(unknown_form_content(element="corner", frames=[])),
        "form-transforms-2-63": whole(content(kind="transforms", count=1 << 63, frames=[pose("t", [[1, 0, 0, 0, 1, 2, 3]])])),
        "form-length": lie(c, "FORM", payload=lambda r: r.payload + bytes(8)),
        "form-cut": lie(c, "FORM", payload=lambda r: r.payload[:-8]),
        "form-empty": lie(c, "FORM", payload=b""),
        "form-name-utf8": patched(c, "FORM", 8, b"\xff"),
        "prov-args-missing": inserted(c, "MESH", Record("PROV", prov, COPY_SAFE)),
        "prov-args-2-32-less-1": inserted(c, "MESH", Record("PROV", prov[:8] + u64(0xFFFFFFFF) + prov[16:], COPY_SAFE)),
        "prov-parents-2-32-less-1": inserted(c, "MESH", Record("PROV", u64(0xFFFFFFFF) + prov[8:], COPY_SAFE)),
        "prov-string-2-32-less-1": inserted(c, "MESH", Record("PROV", prov[:16] + u64(0xFFFFFFFF) + prov[24:], COPY_SAFE)),
        "prov-too-long": inserted(c, "MESH", Record("PROV", prov + text("a") + b"x", COPY_SAFE)),
        "prov-utf8": inserted(c, "MESH", Record("PROV", prov + pad(u64(3) + b"\xed\xa0\x80"), COPY_SAFE)),
    }


def joint(parent=None, channels=(), offset=(0, 0, 0), name="j"):
    return {"parent": parent, "channels": channels, "offset": offset, "name": name}


def reject_attachments():
    """Skeletons and correspondences with content that does not hold."""
    s, r = skeleton_content(), register_content()
    # payload of CORR: 6 numbers of 8 bytes, first[4] from byte 48, source[4] from 64, weight[4] from 80, distance[3]
    # from 112, matched[3] from 136, padding[5]
    # payload of SKEL: their number, parent[4] from byte 8, channel count[4] from 24, channels[24] from 40, offset[12] from
    # 64, the first name from 160

    def skeleton_of(*joints):
        return whole(dict(s, skeleton=list(joints)))

    def driving(*faces):
        return whole(dict(r, correspondence=dict(r["correspondence"], faces=list(faces))))

    g, b, c = rig_content(), bone_map_content(), shapes(2, 24, 2, selection=[0])

    def rigged(**fields):
        return whole(dict(g, rig=dict(g["rig"], skin=None, **fields)))

    def skinned(**fields):
        return whole(dict(g, rig=dict(g["rig"], skin=dict(g["rig"]["skin"], **fields))))

    def mapped(**fields):
        return whole(dict(map_content(), map=dict(map_content()["map"], **fields)))

    joints_but_one = [dict(j, channels=[] if i == 3 else j["channels"]) for i, j in enumerate(JOINTS)]
    one = driven([[0, 1.0]])
    return {
        "skel-joint-missing": skeleton_of(*s["skeleton"][:3]),
        "skel-joint-too-many": skeleton_of(*s["skeleton"], joint(0)),
        "skel-parent-itself": skeleton_of(joint(), joint(1), joint(0), joint(0)),
        "skel-parent-after": skeleton_of(joint(), joint(2), joint(0), joint(0)),
        "skel-channel-7": skeleton_of(joint(), joint(0, [7]), joint(0), joint(0)),
        "skel-channel-0": skeleton_of(joint(), joint(0, [4, 0, 5]), joint(0), joint(0)),
        "skel-channels-7": patched(s, "SKEL", 24, u32(7)),
        "skel-channel-unused": patched(s, "SKEL", 49, b"\1"),
        "skel-offset-nan": skeleton_of(joint(), joint(0, offset=(0, NAN, 0)), joint(0), joint(0)),
        "skel-name-2-32-less-1": patched(s, "SKEL", 160, u64(0xFFFFFFFF)),
        "skel-name-utf8": patched(s, "SKEL", 168, b"\xff"),
        "skel-padding": patched(skeleton_content(), "SKEL", -1, b"\1"),
        "skel-cut": lie(s, "SKEL", payload=lambda record: record.payload[:-8]),
        "colv-cut": lie(content(colours=COLOURS), "COLV", payload=lambda record: record.payload[:-8]),
        "colv-long": lie(content(colours=COLOURS), "COLV", payload=lambda record: record.payload + bytes(8)),
        "colv-few": whole(content(colours=COLOURS[:3])),
        "colv-count-2-62": patched(content(colours=COLOURS), "COLV", 0, u64(1 << 62)),
        "colv-padding": patched(content(colours=COLOURS[:3]), "COLV", -1, b"\1"),
        "colv-before-mesh": whole(content(), [colours(COLOURS)] + records_of(content())),
        "asst-cut": lie(content(asset=ASSET), "ASST", payload=lambda record: record.payload[:-8]),
        "asst-long": lie(content(asset=ASSET), "ASST", payload=lambda record: record.payload + bytes(8)),
        "asst-empty": whole(content(asset=dict(ASSET, vertex=[]))),
        "asst-no-data": whole(content(asset=dict(ASSET, data=""))),
        "asst-vertex-out-of-range": whole(content(asset=dict(ASSET, vertex=[0, 4]))),
        "asst-size-2-63": patched(content(asset=ASSET), "ASST", 16, u64(1 << 63)),
        "asst-padding": patched(content(asset=ASSET), "ASST", -1, b"\1"),
        "asst-before-mesh": whole(content(), [asset(ASSET)] + records_of(content())),
        "ptch-cut": lie(content(patches={"count": 2, "of_face": [0, 1]}), "PTCH", payload=lambda record: record.payload[:-4]),
        "ptch-long": lie(content(patches={"count": 2, "of_face": [0, 1]}), "PTCH", payload=lambda record: record.payload + bytes(8)),
        "ptch-none": whole(content(patches={"count": 0, "of_face": [0, 0]})),
        "ptch-out-of-range": whole(content(patches={"count": 2, "of_face": [0, 2]})),
        "ptch-padding": patched(mixed(patches={"count": 2, "of_face": [1, 0, 1]}), "PTCH", -1, b"\1"),
        "map-cut": lie(map_content(), "MAP ", payload=lambda record: record.payload[:-4]),
        "map-long": lie(map_content(), "MAP ", payload=lambda record: record.payload + bytes(4)),
        "map-empty": lie(map_content(), "MAP ", payload=b""),
        "map-transforms-0": mapped(share=[], weights=[[]] * 4, place=[], centre=[], home_centre=[], hinges=[], hinge_at=[],
                                   hinge_weight=[], held=[], held_at=[], held_patch=[], corners=[]),
        "map-transforms-2-31": patched(map_content(), "MAP ", 0, u64(1 << 31)),
        "map-vertices": mapped(weights=map_content()["map"]["weights"] + [[0, 0, 0, 1, 0, 0, 0, 0]]),
        "map-vertices-2-63": patched(map_content(), "MAP ", 8, u64(1 << 63)),
        "map-joints-2-31": patched(map_content(), "MAP ", 16, u64(1 << 31)),
        "map-corners": patched(map_content(), "MAP ", 24, u64(7)),
        "map-held-2-63": patched(map_content(), "MAP ", 32, u64(1 << 63)),
        "map-kind-3": patched(map_content(), "MAP ", 40, u64(3)),
        "map-kind-2-32": patched(map_content(), "MAP ", 40, u64(1 << 32 | 1)),
        "map-flag": patched(map_content(), "MAP ", 48, u64(2)),
        "map-name-missing": mapped(names=["one"]),
        "map-names-2-61": patched(map_content(), "MAP ", 56, u64(1 << 61)),
        "map-per-corner-2": mapped(per_corner=2),
        "map-per-corner-0": patched(map_content(corners=False), "MAP ", 64, u64(0)),
        "map-of-bones-per-corner-3": whole(dict(b, map=dict(b["map"], per_corner=3, corners=[STRAIGHT] * 18, corner_bones=[[0, 1, 2]] * 6))),
        "map-of-bones-of-another-rig": whole(dict(b, rig=dict(b["rig"], joints=joints_but_one, skin=None))),
        "map-of-bones-with-joints": whole(dict(b, map=dict(b["map"], hinges=[[0, 1]], hinge_at=[[0, 0, 0]], hinge_weight=[1.0]))),
        "map-of-bones-corner-bone": patched(b, "MAP ", -4, u32(3)),
        "map-of-bones-corner-zero": whole(dict(b, map=dict(b["map"], corners=[[0, 0, 0, 0]] * 12))),
        "map-of-bones-held-twice": whole(dict(b, map=dict(b["map"], held=[1, 1]))),
        "netw-cut": lie(network_content(), "NETW", payload=lambda record: record.payload[:-8]),
        "netw-long": lie(network_content(), "NETW", payload=lambda record: record.payload + bytes(8)),
        "netw-model-5": patched(network_content({"model": 4, "numbers": 36}), "NETW", 0, u64(5)),
        "netw-direction-3": patched(network_content(), "NETW", 8, u64(3)),
        "netw-other-mesh": patched(network_content(), "NETW", 16, u64(1)),
        "netw-model-0": whole(network_content({"model": 0, "numbers": 36})),
        "netw-parts-0": whole(network_content({"parts": 0}, root=[0.0] * 9)),
        "netw-parts-2": whole(network_content({"parts": 2}, root=[0.0] * 27)),
        "netw-layers-0": whole(network_content({"layers": 0, "parameters": 2})),
        "netw-layers-9": whole(network_content({"layers": 9, "parameters": 110})),
        "netw-layers-2-63": patched(network_content(), "NETW", 72, u64(1 << 63)),
        "netw-hidden-0": whole(network_content({"hidden": 0, "parameters": 1})),
        "netw-hidden-2-62": patched(network_content(), "NETW", 80, u64(1 << 62)),
        "netw-convolutions-1": whole(network_content({"convolutions": 1})),
        "netw-convolutions-9": whole(network_content({"model": 4, "numbers": 36, "convolutions": 9, "parameters": 1668})),
        "netw-parameters-0": whole(network_content({"parameters": 0})),
        "netw-parameters-13": whole(network_content({"parameters": 13})),
        "netw-step-2-16-and-1": whole(network_content({"step": (1 << 16) + 1})),
        "netw-error-below-0": whole(network_content(errors=[-1.0] * 29 + [-0.5])),
        "netw-best-error-below-0": whole(network_content(numbers=[-2, 0.625, 2.5, -1, -2, 1, 2, 0.125, 0.01, 0.8])),
        "netw-width-10": whole(network_content({"width": 10})),
        "netw-numbers": patched(network_content(), "NETW", 56, u64(2)),
        "netw-rank-2-32": patched(network_content(), "NETW", 64, u64(1 << 32)),
        "netw-rank-2-63": patched(network_content(), "NETW", 64, u64(1 << 63)),
        "netw-uncertain": whole(network_content({"uncertain": 1})),
        "netw-uncertain-2": patched(network_content({"model": 4, "numbers": 36}), "NETW", 96, u64(2)),
        "netw-sets-2": whole(network_content({"sets": 2})),
        "netw-parameters-2-62": patched(network_content(), "NETW", 112, u64(1 << 62)),
        "netw-step-0": patched(network_content(), "NETW", 144, u64(0)),
        "netw-open-2": patched(network_content(), "NETW", 160, u64(2)),
        "netw-phase-2": patched(network_content(), "NETW", 168, u64(2)),
        "netw-diagonal-0": whole(network_content(numbers=[0.5, 0.5, 0, -1, -2, 1, 2, 0.125, 0.01, 0.8])),
        "netw-range-empty": whole(network_content(numbers=[0.5, 0.5, 2.5, 1, -2, 1, 2, 0.125, 0.01, 0.8])),
        "netw-curve-block-4": whole(network_content({"curve_block": 4})),
        "netw-curve-2-63": patched(network_content(), "NETW", 184, u64(1 << 63)),
        "netw-curve-negative": whole(network_content(curve=[0.5, 2.0, 0.25, -0.375, 1.5, -1, 0.625, 3.0, -1])),
        "netw-curve-validation": whole(network_content(curve=[0.5, 2.0, -0.25, 0.375, 1.5, -1, 0.625, 3.0, -1])),
        "netw-curve-nan": whole(network_content(curve=[0.5, 2.0, NAN, 0.375, 1.5, -1, 0.625, 3.0, -1])),
        "netw-curve-start": whole(network_content(numbers=[0.5, -0.5, 2.5, -1, -2, 1, 2, 0.125, 0.01, 0.8])),
        "netw-scale-0": whole(network_content(scale=[1.5, 0])),
        "netw-coordinates-empty": whole(network_content(range=[1, -1])),
        "netw-parameter-nan": whole(network_content(parameters=[NAN] * 14)),
        "netw-before-mesh": whole(content(), [network(network_content()["network"])] + records_of(content())),
        "sign-cut": lie(signal_content(), "SIGN", payload=lambda record: record.payload[:-8]),
        "sign-long": lie(signal_content(), "SIGN", payload=lambda record: record.payload + bytes(8)),
        "sign-frames-2-31": patched(signal_content(), "SIGN", 0, u64(1 << 31)),
        "sign-space-9": whole(signal_content(space=9)),
        "sign-dimension": whole(signal_content(mean=[0] * 9, basis=[[0] * 9] * 2)),
        "sign-coordinates-2-63": patched(signal_content(), "SIGN", 24, u64(1 << 63)),
        "sign-no-sites": whole(signal_content(site=[])),
        "sign-site-twice": whole(signal_content(site=[2, 0, 2])),
        "sign-site-out-of-range": whole(signal_content(site=[2, 0, 3])),
        "sign-controls-3": whole(signal_content(control=[[0, 0]] * 3, knot=[0, 0, 1, 2, 2])),
        "sign-controls-2-64-less-1": patched(signal_content(), "SIGN", 40, u64((1 << 64) - 1)),
        "sign-bits-8": patched(signal_content(), "SIGN", 48, u64(8)),
        "sign-flag": patched(signal_content(), "SIGN", 56, u64(2)),
        "sign-turns": patched(signal_content(), "SIGN", 80, u64(1)),
        "sign-layout-5": whole(signal_content(layout=5)),
        "sign-mean-nan": whole(signal_content(mean=[NAN] * 12)),
        "sign-parameters-fall": whole(signal_content(parameter=[0, 1, 1])),
        "sign-knots-fall": whole(signal_content(knot=[0, 0, 0, 2, 2, 1])),
        "sign-knots-of-no-length": whole(signal_content(knot=[0] * 6)),
        "sign-control-far": whole(signal_content(control=[[0, 0], [0, 0], [0, 0], [0, 1e101]])),
        "sign-position-far": whole(signal_content(position=[[0, 0], [0, 1e101], [1, 0]])),
        "sign-home-without-examples": whole(signal_content(home=[[1, 0, 0, 0]] * 3)),
        "sign-home-without-root": whole(signal_content(examples=True, home=[[1, 0, 0, 0]] * 3, turn=[], shift=[])),
        "sign-home-of-two": whole(signal_content(examples=True, home=[[1, 0, 0, 0]] * 2)),
        "sign-home-long": whole(signal_content(examples=True, home=[[1, 0, 0, 0], [1, 0.01, 0, 0], [1, 0, 0, 0]])),
        "sign-turn-long": whole(signal_content(turn=[[1, 0.01, 0, 0]] * 3)),
        "sign-vectors-of-examples": whole(signal_content(space=2, examples=True, mean=[0] * 24, basis=[[0] * 24] * 2, home=[[1, 0, 0, 0]] * 2)),
        "sign-vectors-without-root": whole(signal_content(space=2, mean=[0] * 24, basis=[[0] * 24] * 2, home=[[1, 0, 0, 0]] * 2, turn=[], shift=[])),
        "sign-vectors-without-turns": whole(signal_content(space=2, mean=[0] * 24, basis=[[0] * 24] * 2)),
        "sign-lengths-with-turns": whole(signal_content(space=5, mean=[0] * 9, basis=[[0] * 9] * 2, home=[[1, 0, 0, 0]])),
        "sign-vectors-dimension": whole(shapes(2, 1, 2)),
        "sign-vectors-turns": whole(shapes(2, 24, 5)),
        "sign-vectors-before-selection": whole(c, sorted(records_of(c), key=lambda r: {"SELE": 1, "FORM": 2}.get(r.tag, 0))),
        "sign-gradients-turns": whole(shapes(3, 18, 1)),
        "sign-rotations-dimension": whole(shapes(4, 21)),
        "sign-lengths-dimension": whole(shapes(5, 10)),
        "sign-of-no-faces": whole(shapes(4, 3, selection=[])),
        "sign-of-two-parts": whole(shapes(4, 15, mesh={"vertices": 4, "faces": [[0, 1], [2, 3]]})),
        "sign-without-links": whole(shapes(2, 24, 2, links=None)),
        "sign-unit-0": whole(signal_content(bits=16, unit=[1, 0])),
        "rig-cut": lie(g, "RIG ", payload=lambda record: record.payload[:-8]),
        "rig-long": lie(g, "RIG ", payload=lambda record: record.payload + bytes(8)),
        "rig-empty": lie(g, "RIG ", payload=b""),
        "rig-joints-0": whole(dict(g, rig={"joints": [], "at": [], "turns": [], "skin": None})),
        "rig-joints-2-63": patched(g, "RIG ", 0, u64(1 << 63)),
        "rig-joints-less": patched(g, "RIG ", 0, u64(3)),
        "rig-parent-itself": rigged(joints=[dict(j, parent=i) for i, j in enumerate(JOINTS)]),
        "rig-without-channels": rigged(joints=[dict(j, channels=[]) for j in JOINTS]),
        "rig-position-inf": rigged(at=[[0, 0, 0], [0, INF, 0], [0, 0, 0], [0, 0, 0]]),
        "rig-turn-long": rigged(turns=[STRAIGHT, [1, 0.01, 0, 0], STRAIGHT, STRAIGHT]),
        "rig-turn-nan": rigged(turns=[STRAIGHT, [NAN, 0, 0, 0], STRAIGHT, STRAIGHT]),
        "skin-cut": lie(g, "SKIN", payload=lambda record: record.payload[:-8]),
        "skin-long": lie(g, "SKIN", payload=lambda record: record.payload + bytes(8)),
        "skin-bone-out-of-range": skinned(bones=[[0, 1, 2, 3]] * 4),
        "skin-weights-ascend": skinned(weights=[[0.25, 0.5, 0.25, 0]] * 4),
        "skin-weight-negative": skinned(weights=[[1, 0.5, -0.5, 0]] * 4),
        "skin-weight-nan": skinned(weights=[[NAN, 0, 0, 0]] * 4),
        "skin-weights-sum": skinned(weights=[[0.5, 0.25, 0.125, 0]] * 4),
        "map-size-0": patched(map_content(), "MAP ", 72, f64(0)),
        "map-weight-nan": patched(map_content(), "MAP ", 80, f64(NAN)),
        "map-held-patch": patched(map_content(), "MAP ", -4, u32(2)),
        "map-held-vertex": patched(map_content(), "MAP ", -12, u32(4)),
        "map-joint-itself": patched(map_content(), "MAP ", -24, u32(1)),
        "map-corners-of-another-graph": whole(dict(map_content(), selection=[0])),
        "map-of-other-patches": whole(dict(map_content(), patches={"count": 3, "of_face": [0, 1]})),
        "map-of-patches-without-them": whole(dict(map_content(), patches=None)),
        "map-without-mesh": whole(content(mesh=None, reference=None, kind="transforms", count=0, frames=[], map=map_content()["map"])),
        "corr-cut": lie(r, "CORR", payload=lambda record: record.payload[:-8]),
        "corr-long": lie(r, "CORR", payload=lambda record: record.payload + bytes(8)),
        "corr-empty": lie(r, "CORR", payload=b""),
        "corr-target-faces-2-32-less-1": patched(r, "CORR", 32, u64(0xFFFFFFFF)),
        "corr-target-faces-2-31": patched(r, "CORR", 32, u64(1 << 31)),
        "corr-first-not-zero": patched(r, "CORR", 48, u32(1)),
        "corr-first-descends": patched(r, "CORR", 52, u32(3, 1)),
        "corr-first-last": patched(r, "CORR", 60, u32(3)),
        "corr-first-2-32-less-1": patched(r, "CORR", 60, u32(0xFFFFFFFF)),
        "corr-driven-by-none": driving(one, driven([]), one),
        "corr-source-out-of-range": driving(one, one, driven([[2, 1.0]])),
        "corr-padding": patched(r, "CORR", -1, b"\1"),
        "corr-weight-zero": driving(one, one, driven([[0, 1.0], [1, 0.0]])),
        "corr-weight-negative": driving(one, one, driven([[0, 1.5], [1, -0.5]])),
        "corr-weight-nan": driving(one, one, driven([[0, NAN]])),
        "corr-weights-sum": driving(one, one, driven([[0, 0.5], [1, 0.25]])),
        "corr-distance-negative": driving(one, one, driven([[0, 1.0]], -1.0)),
        "corr-distance-inf": driving(one, one, driven([[0, 1.0]], INF)),
        "corr-matched-2": patched(r, "CORR", 136, b"\2"),
    }


def with_channel(c, **changes):
    """The content with a channel more in its first frame: one number for each vertex, but for `changes`."""
    k = channel_of("x", "vertex", [[1], [2], [3], [4]])
    first = c["frames"][0]
    return dict(c, frames=[dict(first, channels=[dict(k, **changes)])] + c["frames"][1:])


def reject_frames():
    """Frames with content that does not hold."""
    c, v, q = content(), graph_content("vectors"), graph_content("deformations")
    t = content(mesh=None, reference=None, kind="transforms", count=1, frames=[pose("t", [[1, 0, 0, 0, 1, 2, 3]])])
    second = content(frames=[pose("fine", BENT[:4]), pose("broken", BENT[:4])])
    records = records_of(second)
    records[-1].payload = records[-1].payload[:-8] + f64(INF)
    swapped = copy.deepcopy(c)
    k = with_channel(c)
    # payload of a frame: length of the name, name from byte 8, number of channels at 16; of its first channel, named x:
    # 24 length of the name, 32 name, 40 length of the unit, 48 length of the element, 56 'vertex', 64 width, 72 count,
    # 80 type, 88 numbers
    p = pinned(1, 2, 4)
    free = pinned(1)["frames"][1]

    def holding(**changes):
        return whole(with_channel(c, **changes))

    def one(name, element, rows, kind=F64, of=c, width=None):
        first = of["frames"][0]
        return whole(dict(of, frames=[dict(first, channels=[channel_of(name, element, rows, kind, width=width)])]))

    return {
        "fram-before-form": whole(c, [records_of(swapped)[i] for i in (0, 1, 3, 2)]),
        "fram-short": lie(c, "FRAM", payload=lambda r: r.payload[:-8]),
        "fram-long": lie(c, "FRAM", payload=lambda r: r.payload + bytes(8)),
        "fram-empty": lie(c, "FRAM", payload=b""),
        "fram-f32-padding": patched(content(mesh={"vertices": 3, "faces": []}, count=3, precision=4,
                                            reference={"name": "", "positions": POINTS[:3]}, frames=[pose("p", BENT[:3])]),
                                    "FRAM", -4, u32(1)),
        "fram-name-2-32-less-1": patched(c, "FRAM", 0, u64(0xFFFFFFFF)),
        "fram-name-utf8": patched(c, "FRAM", 8, b"\xc0\x80"),
        "fram-name-nul": patched(c, "FRAM", 9, b"\0"),
        "fram-name-padding": patched(c, "FRAM", 13, b"\0\0\1"),
        "fram-value-nan": patched(c, "FRAM", -8, f64(NAN)),
        "fram-second-inf": whole(second, records),
        "fram-f32-inf": patched(content(precision=4), "FRAM", -4, struct.pack("<f", -INF)),
        "fram-channels-256": whole(with_channels(c, 256)),
        "fram-channels-2-64-less-1": patched(c, "FRAM", 16, u64((1 << 64) - 1)),
        "fram-channels-missing": patched(c, "FRAM", 16, u64(1)),
        "channel-cut": lie(k, "FRAM", payload=lambda r: r.payload[:80]),
        "channel-numbers-cut": lie(k, "FRAM", payload=lambda r: r.payload[:100]),
        "channel-padding": patched(with_channel(c, element="whisker", type=F32, values=[[1]]), "FRAM", 92, b"\1"),
        "channel-no-name": holding(name=""),
        "channel-name-2-64-less-1": patched(k, "FRAM", 24, u64((1 << 64) - 1)),
        "channel-name-utf8": patched(k, "FRAM", 32, b"\xff"),
        "channel-unit-2-32-less-1": patched(k, "FRAM", 40, u64(0xFFFFFFFF)),
        "channel-element-utf8": patched(k, "FRAM", 56, b"\xff"),
        "channel-twice": whole(dict(c, frames=[dict(c["frames"][0], channels=[channel_of("x", "frame", [[1]])] * 2)])),
        "channel-time-twice": whole(dict(c, frames=[dict(pose("t", BENT[:4], time=1), channels=[
            channel_of("time", "frame", [[2]])])])),
        "channel-width-0": holding(width=0, values=[[]] * 4),
        "channel-count-of-vertices": holding(values=[[1], [2], [3]]),
        "channel-count-of-frames": one("x", "frame", [[1], [2]]),
        "channel-count-of-joints": one("x", "joint", [[1]]),
        "channel-count-of-anchors": one("x", "anchor", [[1]]),
        "channel-count-of-corners": one("x", "corner", [[1]]),
        "channel-count-of-transforms": one("x", "transform", [[1], [2]], of=t),
        "channel-count-2-63": patched(k, "FRAM", 72, u64(1 << 63)),
        "channel-size-2-64": whole(dict(c, frames=[dict(c["frames"][0], channels=[
            channel_of("x", "whisker", [[]] * 16, width=1 << 60)])])),
        "channel-type-0": patched(k, "FRAM", 80, u64(0)),
        "channel-type-2": patched(k, "FRAM", 80, u64(2)),
        "channel-type-2-32-and-8": patched(k, "FRAM", 80, u64(1 << 32 | 8)),
        "channel-indices-of-vertices": holding(type=U32),
        "channel-nan": holding(values=[[1], [2], [NAN], [4]]),
        "channel-f32-inf": holding(type=F32, values=[[1], [2], [3], [-INF]]),
        "list-of-numbers": one("x", "vertex list", [[0.0]]),
        "list-of-pairs": one("x", "vertex list", [[0, 1]], U32),
        "list-of-nothing": one("x", "vertex list", [], U32, width=1),
        "list-twice": one("x", "vertex list", [[1], [1]], U32),
        "list-out-of-range": one("x", "vertex list", [[1], [4]], U32),
        "list-without-mesh": one("x", "vertex list", [[0]], U32, of=t),
        "time-nan": whole(content(frames=[pose("pose1", BENT[:4], time=NAN)])),
        "time-of-vertices": holding(name="time"),
        "time-of-two": one("time", "frame", [[1, 2]]),
        "root-of-vertices": one("root", "frame", [[0, 0, 0]]),
        "root-missing": whole(dict(v, frames=[dict(v["frames"][0], root=None)])),
        "root-nan": whole(dict(v, frames=[dict(v["frames"][0], root=[0, NAN, 0])])),
        "root-of-two": whole(dict(v, frames=[dict(v["frames"][0], root=[0, 0])])),
        "anchors-missing": whole(dict(v, frames=[dict(v["frames"][0], anchors=None)])),
        "anchors-inf": whole(dict(v, frames=[dict(v["frames"][0], anchors=[[0, 0, 0], [INF, 0, 0]])])),
        "anchors-less": whole(dict(v, frames=[dict(v["frames"][0], anchors=[[0, 0, 0]])])),
        "anchors-of-vertices": one("anchors", "anchor", [[0, 0, 0]], of=content(anchors=[0])),
        "turns-without-skeleton": one("turns", "joint", [], width=4),
        "turns-of-vectors": whole(dict(v, frames=[dict(v["frames"][0], channels=[channel_of("turns", "joint", [], width=4)])])),
        "turns-of-three": whole(skeleton_content([[1, 0, 0]] * 4)),
        "turns-less": whole(skeleton_content(TURNED[:3])),
        "turns-short": whole(skeleton_content([[0.9, 0, 0, 0]] + TURNED[1:])),
        "turns-nan": whole(skeleton_content(TURNED[:3] + [[NAN, 0, 0, 0]])),
        "pins-none": whole(pinned()),
        "pins-twice": whole(pinned(2, 2)),
        "pins-order": whole(pinned(4, 1)),
        "pins-out-of-range": whole(pinned(1, 6)),
        "pins-of-vertices": one("pins", "vertex list", [[0]], U32),
        "pins-of-deformations": whole(dict(q, frames=[dict(q["frames"][0], pins=[0])])),
        "pins-of-numbers": one("pins", "vertex", [[1]] * 6, of=dict(v, frames=[free])),
        "pins-padding": lie(p, "FRAM", payload=lambda r: odd_padding(r.payload)),
        "fram-quaternion-zero": patched(q, "FRAM", -32, f64(0, 0, 0, 0)),
        "fram-transform-zero": patched(t, "FRAM", -56, f64(0, 0, 0, -0.0)),
    }


def with_channels(c, n):
    return dict(c, frames=[dict(c["frames"][0], channels=[channel_of(f"x{i}", "frame", [[i]]) for i in range(n)])])


def odd_padding(payload):
    """A frame whose list of the pins 1 2 4 is padded with something."""
    at = payload.index(u32(1, 2, 4)) + 12
    return payload[:at] + b"\1" + payload[at + 1:]


# ---- files ---------------------------------------------------------------------------------------------------------


def write(path, data):
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with open(path, "wb") as f:
        f.write(data)


def expected_json(c, data):
    """The content as examples/read_stream.py --json shows it."""
    records = records_of(c)
    element, width = form_of(c)
    frames = [{"name": f["name"], "channels": channels_of(c, f), "values": f["values"], "extra": f["extra"]}
              for f in c["frames"]]
    out = dict(c, frames=frames, element=element, width=width, records=len(records), checksum=f"{struct.unpack('<Q', data[-8:])[0]:016x}")
    return (json.dumps(out, indent=1, sort_keys=True, ensure_ascii=False) + "\n").encode()


def main(root):
    for name, (_, c) in golden().items():
        data = whole(c)
        write(f"{root}/fmt/golden/{name}.vgs", data)
        write(f"{root}/fmt/golden/{name}.json", expected_json(c, data))
    for name, data in accept().items():
        write(f"{root}/tests/corpus/accept/{name}.vgs", data)
    rejected = {**reject_container(), **reject_order(), **reject_header(), **reject_attachments(), **reject_frames()}
    for name, data in rejected.items():
        write(f"{root}/tests/corpus/reject/{name}.vgs", data)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
