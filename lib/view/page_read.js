/* page_read.js: the first part of the player inside a page: its state, and the sequences as they are unpacked.
 * Leaves out how the data was packed (page.h has the format) and drawing (page_draw.js).
 * A page that vg-view makes holds this file; as an exception to the licence, such pages may be passed on under any terms.
 * SPDX-License-Identifier: GPL-3.0-or-later */
"use strict";
(() => {
const $ = (id) => document.getElementById(id);
const facts = JSON.parse($("facts").textContent);
const canvas = $("canvas");
const CREASE = Math.cos(50 * Math.PI / 180), HALF_CREASE = Math.cos(25 * Math.PI / 180), MOST_RING = 64, TEXTURE_WIDTH = 2048, FRAMES_PER_SECOND = 24;
const TINT = facts.tint || null; /* what colours say: numbers of vertices, of scales their logarithms to base 2 */
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const state = {
    frame: 0, part: 0, playing: false, speed: 1, wire: facts.edges ? 1 : 0, ground: facts.ground, follow: facts.fit === "figure",
    colour: "plain", layout: "beside", wipe: 0.5, joints: true, shown: facts.sequences.map(() => true),
    azimuth: facts.azimuth, elevation: facts.elevation, zoom: facts.zoom, shift: [0, 0],
};
let sequences = [], frames = 0, gl = null, programs = null, wanted = false, clock = null;

function tell(text) {
    $("message").textContent = text;
    $("message").hidden = !text;
}
window.addEventListener("error", (event) => tell("This page does not work here: " + event.message));
window.addEventListener("unhandledrejection", (event) => tell("This page does not work here: " + (event.reason.message || event.reason)));

/* ---- data ---- */

async function unpack(element) {
    const text = atob(element.textContent), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    element.remove(); /* the text is not needed any more */
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function unpackList(sequence, name, differences) {
    const element = document.querySelector(`script[data-sequence="${sequence}"][data-list="${name}"]`);
    if (!element) return null;
    const bytes = await unpack(element), n = bytes.length / 4, list = new Uint32Array(n);
    for (let i = 0; i < n; i++) {
        list[i] = (bytes[i] << 24 | bytes[n + i] << 16 | bytes[2 * n + i] << 8 | bytes[3 * n + i]) >>> 0;
        if (differences && i) list[i] += list[i - 1];
    }
    return list;
}

/* The numbers of a chunk, as they were quantised: axis by axis. */
function predictBack(bytes, n, nv, width) {
    const size = nv * width, total = n * size, q = new Uint16Array(total);
    for (let f = 0; f < n; f++) {
        const how = bytes[f], base = f * size;
        for (let k = 0; k < width; k++) {
            let before = 0;
            for (let i = base + k * nv, end = i + nv; i < end; i++) {
                const rest = bytes[n + i] << 8 | bytes[n + total + i];
                let x = rest & 1 ? ~(rest >> 1) : rest >> 1;
                if (how & 4) x += before;
                before = x;
                if (how & 1) x += q[i - size];
                if (how & 2) x += 2 * q[i - size] - q[i - 2 * size];
                q[i] = x;
            }
        }
    }
    return q;
}

function readChunks(s) {
    const numbers = (text) => text.split(" ").map(Number);
    for (const element of document.querySelectorAll(`script[data-sequence="${s.number}"][data-frames]`)) {
        const d = element.dataset, list = d.frames === "places" ? s.places : s.numbers;
        const first = list.length ? list[list.length - 1].first + list[list.length - 1].n : 0;
        list.push({element, first, n: +d.count, origin: numbers(d.origin), step: numbers(d.step), q: null, waits: null});
    }
}

function need(chunk, nv, width) {
    chunk.waits = chunk.waits || unpack(chunk.element).then((bytes) => {
        chunk.q = predictBack(bytes, chunk.n, nv, width);
        chunk.element = null;
    });
    return chunk.waits;
}

function chunkOf(list, frame) {
    let low = 0, high = list.length - 1;
    while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (list[middle].first <= frame) low = middle;
        else high = middle - 1;
    }
    return list[low];
}

/* ---- meshes ---- */

/* The three axes of the page (y up, in units, from the centre) as axes of the mesh, with their signs. */
const AXES = facts.zUp ? [[0, 1], [2, 1], [1, -1]] : [[0, 1], [1, 1], [2, 1]];

async function makeSequence(number) {
    const about = facts.sequences[number];
    const s = {number, about, nv: about.vertices, unit: about.diagonal || 1, places: [], numbers: []};
    const sizes = await unpackList(number, "sizes", false), triangles = await unpackList(number, "triangles", false);
    s.corners = await unpackList(number, "corners", true);
    s.patches = facts.patches ? await unpackList(number, "patches", false) : null;
    s.materials = facts.patches && about.materials ? await unpackList(number, "materials", false) : null;
    s.coordinates = s.materials && about.pictures ? await unpackList(number, "coordinates", false) : null;
    s.pictures = s.coordinates ? await loadPictures(about.pictures) : [];
    s.nf = sizes.length;
    s.start = new Uint32Array(s.nf + 1);
    for (let f = 0; f < s.nf; f++) s.start[f + 1] = s.start[f] + sizes[f];
    const index = new Uint32Array(triangles.length);
    for (let f = 0, at = 0; f < s.nf; f++)
        for (let i = 0; i < 3 * Math.max(sizes[f] - 2, 0); i++, at++) index[at] = s.start[f] + triangles[at];
    s.index = index;
    s.points = s.nf === 0;
    findEdges(s, sizes);
    findRings(s);
    readChunks(s);
    s.frames = s.about.names.length;
    s.faceNormals = new Float32Array(4 * s.nf);
    s.slots = [makeSlot(s), makeSlot(s)]; /* the frame that is shown, and the next one */
    s.path = pointsOf(s, about.path, true);
    s.figure = pointsOf(s, about.figure, false);
    s.component = findComponents(s);
    s.middle = [0, 0, 0];
    return s;
}

/* A frame as it is drawn: places (the fourth number is what colours say), normals of the corners. */
function makeSlot(s) {
    return {frame: -1, middle: [0, 0, 0], normals: new Float32Array(3 * s.corners.length),
            xyz: new Float32Array(4 * TEXTURE_WIDTH * Math.max(1, Math.ceil(s.nv / TEXTURE_WIDTH)))};
}

/* Numbers of the mesh's axes and unit to points on the axes of the page. */
function pointsOf(s, list, centred) {
    const points = [];
    for (let i = 0; i < list.length; i += 3)
        points.push(AXES.map(([axis, sign]) => sign * (list[i + axis] - (centred ? s.about.centre[axis] : 0)) / s.unit));
    return points;
}

/* The connected component of each vertex, numbered from 1; 0: it is in no face. */
function findComponents(s) {
    const up = new Uint32Array(s.nv).map((_, v) => v), root = (v) => { while (up[v] !== v) v = up[v] = up[up[v]]; return v; };
    for (let f = 0; f < s.nf; f++)
        for (let c = s.start[f] + 1; c < s.start[f + 1]; c++) up[root(s.corners[c])] = root(s.corners[s.start[f]]);
    const number = new Map(), component = new Uint32Array(s.nv);
    for (const v of s.corners) {
        const r = root(v);
        if (!number.has(r)) number.set(r, number.size + 1);
        component[v] = number.get(r);
    }
    s.components = number.size;
    return component;
}

function findEdges(s, sizes) {
    const seen = new Set(), edges = [], bones = [];
    for (let f = 0; f < s.nf; f++) {
        const n = sizes[f], start = s.start[f];
        for (let i = 0; i < (n === 2 ? 1 : n); i++) {
            const a = s.corners[start + i], b = s.corners[start + (i + 1) % n];
            const key = Math.min(a, b) * s.nv + Math.max(a, b);
            if (n === 2) bones.push(a, b);
            else if (!seen.has(key)) seen.add(key), edges.push(a, b);
        }
    }
    s.edges = new Uint32Array(edges);
    s.bones = new Uint32Array(bones);
}

/* The faces and corners around each vertex, and the face of each corner. */
function findRings(s) {
    s.ringStart = new Uint32Array(s.nv + 1);
    s.faceOf = new Uint32Array(s.corners.length);
    for (let f = 0; f < s.nf; f++)
        for (let c = s.start[f]; c < s.start[f + 1]; c++) s.faceOf[c] = f, s.ringStart[s.corners[c] + 1]++;
    for (let v = 0; v < s.nv; v++) s.ringStart[v + 1] += s.ringStart[v];
    const at = s.ringStart.slice();
    s.ring = new Uint32Array(s.corners.length);
    s.ringCorner = new Uint32Array(s.corners.length);
    for (let c = 0; c < s.corners.length; c++) s.ringCorner[at[s.corners[c]]] = c, s.ring[at[s.corners[c]]++] = s.faceOf[c];
}

/* Normals of length 1 of the faces, and their areas. */
function findFaceNormals({corners, start, nf, faceNormals: fn}, xyz) {
    for (let f = 0, c = 0; f < nf; f++) {
        let x = 0, y = 0, z = 0;
        const end = start[f + 1], o = 4 * corners[c], ox = xyz[o], oy = xyz[o + 1], oz = xyz[o + 2];
        let b = 4 * corners[c + 1], bx = xyz[b] - ox, by = xyz[b + 1] - oy, bz = xyz[b + 2] - oz;
        for (c += 2; c < end; c++) {
            const ax = bx, ay = by, az = bz;
            b = 4 * corners[c], bx = xyz[b] - ox, by = xyz[b + 1] - oy, bz = xyz[b + 2] - oz;
            x += ay * bz - az * by, y += az * bx - ax * bz, z += ax * by - ay * bx;
        }
        const size = Math.sqrt(x * x + y * y + z * z), scale = size > 0 ? 1 / size : 0;
        fn[4 * f] = x * scale, fn[4 * f + 1] = y * scale, fn[4 * f + 2] = z * scale, fn[4 * f + 3] = size;
        c = end;
    }
}

/* The normal of a corner where faces meet in an edge: the mean of those that turn less than the crease from its own. */
function creasedNormal({faceNormals: fn, faceOf, ring}, c, from, to, normals) {
    const own = 4 * faceOf[c], all = to - from > MOST_RING, ux = fn[own], uy = fn[own + 1], uz = fn[own + 2];
    let x = 0, y = 0, z = 0;
    for (let i = from; i < to; i++) {
        const g = 4 * ring[i];
        if (all || fn[g] * ux + fn[g + 1] * uy + fn[g + 2] * uz >= CREASE) {
            const area = fn[g + 3];
            x += area * fn[g], y += area * fn[g + 1], z += area * fn[g + 2];
        }
    }
    if (x * x + y * y + z * z < 1e-24 * fn[own + 3] * fn[own + 3]) x = ux, y = uy, z = uz;
    const size = Math.sqrt(x * x + y * y + z * z) || 1;
    normals[3 * c] = x / size, normals[3 * c + 1] = y / size, normals[3 * c + 2] = z / size;
}

/* Area-weighted normals of the corners. Where all faces around a vertex are within half the crease of their mean, they
 * are within the crease of one another, and the corners share the mean. */
function findNormals(s, {xyz, normals}) {
    const {faceNormals: fn, ring, ringCorner, ringStart, nv} = s;
    findFaceNormals(s, xyz);
    for (let v = 0; v < nv; v++) {
        const from = ringStart[v], to = ringStart[v + 1];
        let x = 0, y = 0, z = 0, smooth = true;
        for (let i = from; i < to; i++) {
            const g = 4 * ring[i], area = fn[g + 3];
            x += area * fn[g], y += area * fn[g + 1], z += area * fn[g + 2];
        }
        const size = Math.sqrt(x * x + y * y + z * z), least = HALF_CREASE * size;
        for (let i = from; i < to && smooth; i++) {
            const g = 4 * ring[i];
            smooth = fn[g] * x + fn[g + 1] * y + fn[g + 2] * z > least;
        }
        if (smooth) x /= size, y /= size, z /= size;
        for (let i = from; i < to; i++) {
            const c = ringCorner[i];
            if (smooth) normals[3 * c] = x, normals[3 * c + 1] = y, normals[3 * c + 2] = z;
            else creasedNormal(s, c, from, to, normals);
        }
    }
}

/* Positions of a frame, on the axes of the page, four numbers a vertex; returns their mean. */
function readPlaces(s, chunk, frame, xyz) {
    const {nv} = s, at = (frame - chunk.first) * 3 * nv, sum = [0, 0, 0];
    for (let k = 0; k < 3; k++) {
        const [axis, sign] = AXES[k], from = at + axis * nv;
        const origin = sign * (chunk.origin[axis] - s.about.centre[axis]) / s.unit, step = sign * chunk.step[axis] / s.unit;
        let total = 0;
        for (let v = 0; v < nv; v++) {
            const x = origin + step * chunk.q[from + v];
            xyz[4 * v + k] = x;
            total += x;
        }
        sum[k] = nv ? total / nv : 0;
    }
    return sum;
}

/* Where one vertex is in a frame that is unpacked; null: it is not yet. */
function placeIn(s, v, frame) {
    if (s.live) return s.live.placeOf(v, frame);
    const chunk = chunkOf(s.places, frame);
    if (!chunk.q) return null;
    return AXES.map(([axis, sign]) => sign * (chunk.origin[axis] - s.about.centre[axis] +
        chunk.step[axis] * chunk.q[((frame - chunk.first) * 3 + axis) * s.nv + v]) / s.unit);
}

/* What colours say of one vertex in a frame that is unpacked. */
function numberIn(s, v, frame) {
    const chunk = s.numbers.length ? chunkOf(s.numbers, frame) : null;
    return chunk && chunk.q ? chunk.origin[0] + chunk.step[0] * chunk.q[(frame - chunk.first) * s.nv + v] : null;
}

/* Fill a slot with a frame, as soon as that is unpacked. True: it is there. */
function fill(s, slot, frame) {
    if (slot.frame === frame) return true;
    const chunk = chunkOf(s.places, frame), numbers = s.numbers.length ? chunkOf(s.numbers, frame) : null;
    if (!chunk.q || (numbers && !numbers.q)) {
        Promise.all([need(chunk, s.nv, 3), numbers && need(numbers, s.nv, 1)]).then(draw);
        return false;
    }
    slot.middle = readPlaces(s, chunk, frame, slot.xyz);
    for (let v = 0; numbers && v < s.nv; v++) {
        const x = numbers.origin[0] + numbers.step[0] * numbers.q[(frame - numbers.first) * s.nv + v];
        slot.xyz[4 * v + 3] = (x - TINT.low) / (TINT.high - TINT.low);
    }
    slot.frame = frame;
    findNormals(s, slot);
    upload(s, slot);
    return true;
}

/* The frame that is shown, and how far the sequence is on its way to the next one. True: it is there. */
function take(s) {
    if (s.live) return s.live.take();
    const frame = Math.min(state.frame, s.frames - 1), next = Math.min(frame + 1, s.frames - 1);
    if (s.slots[1].frame === frame) s.slots.reverse();
    if (!fill(s, s.slots[0], frame)) return false;
    const moves = state.part > 0 && next > frame && fill(s, s.slots[1], next);
    s.part = moves ? state.part : 0;
    s.middle = s.slots[0].middle.map((x, k) => moves ? x + s.part * (s.slots[1].middle[k] - x) : x);
    return true;
}

/* Where a vertex is drawn now. */
function placeNow(s, v) {
    const [a, b] = s.slots.map((slot) => slot.xyz), i = 4 * v;
    return [0, 1, 2].map((k) => s.part > 0 ? a[i + k] + s.part * (b[i + k] - a[i + k]) : a[i + k]);
}

