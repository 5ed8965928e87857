/* signal_live.js: the mesh of a signal: vertices from shape coordinates, at any time or place of the plane; thumbnails.
 * Leaves out where in the plane that is (signal_plane.js).
 * SPDX-License-Identifier: GPL-3.0-or-later */

const S = facts.signal;
let body = null; /* the mesh that is drawn */
let exploring = null; /* a place of the plane that is looked at, off the curve */
let time = 1; /* new time: of the sequence as it is edited */

/* ---- data ---- */

const doublesOf = (list) => new Float64Array(list.buffer);

async function readSignal() {
    const mean = doublesOf(await unpackList(0, "mean", false)), coordinate = doublesOf(await unpackList(0, "coordinate", false));
    const basis = await unpackList(0, "basis", false), {m, n} = S, d = mean.length, nv = d / 3;
    const rows = S.bits === 16 ? new Int16Array(basis.buffer) : new Float32Array(basis.buffer); /* m numbers for each of d */
    const unit = S.bits === 16 ? Float64Array.from(S.unit) : null, parameter = Float64Array.from(S.parameter);
    base = {n, m, d, nv, mean, rows, unit, x: coordinate, curve: makeCurve(parameter, S.knot, S.control), position: Float64Array.from(S.position),
            site: S.site, diagonal: facts.sequences[0].diagonal || 1, gram: null};
    if (S.examples) base.gram = gramOf();
    if (S.turn) {
        const times = base.curve.times, turn = Float64Array.from(S.turn), shift = Float64Array.from(S.shift);
        base.root = {times, turn, shift, turns: naturalSeconds(times, turn, 4), shifts: naturalSeconds(times, shift, 3)};
    }
}

/* Products of the basis vectors, which are orthonormal unless they are examples. */
function gramOf() {
    const {d, m, rows, unit} = base, gram = new Float64Array(m * m), row = new Float64Array(m);
    for (let c = 0; c < d; c++) {
        for (let j = 0; j < m; j++) row[j] = rows[c * m + j] * (unit ? unit[j] : 1);
        for (let j = 0; j < m; j++) for (let k = 0; k < m; k++) gram[j * m + k] += row[j] * row[k];
    }
    return gram;
}

/* ---- vertices ---- */

/* Three numbers a vertex: the mean and a sum of the basis vectors. */
function shapeOf(x, out) {
    const {d, m, mean, rows, unit} = base, w = unit ? x.map((f, j) => f * unit[j]) : x;
    for (let c = 0, at = 0; c < d; c++) {
        let sum = 0;
        for (let j = 0; j < m; j++) sum += w[j] * rows[at++];
        out[c] = mean[c] + sum;
    }
    return out;
}

/* The rigid motion of the body at an old time. */
function rootAt(old) {
    const {root} = base, q = naturalAt(root.times, root.turn, root.turns, 4, old, [0, 0, 0, 0]), size = Math.hypot(...q);
    const [w, x, y, z] = size > 0 ? q.map((f) => f / size) : [1, 0, 0, 0];
    return {shift: naturalAt(root.times, root.shift, root.shifts, 3, old, [0, 0, 0]),
            turn: [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                   2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]};
}

function placeRoot(old, p) {
    const {turn: r, shift: s} = rootAt(old);
    for (let i = 0; i < p.length; i += 3) {
        const x = p[i], y = p[i + 1], z = p[i + 2];
        p[i] = r[0] * x + r[1] * y + r[2] * z + s[0], p[i + 1] = r[3] * x + r[4] * y + r[5] * z + s[1], p[i + 2] = r[6] * x + r[7] * y + r[8] * z + s[2];
    }
}

let vertices = null, coordinates = null;

/* The vertices that are shown: at the time, or where the plane is explored. A drawn curve goes without the root, as in
 * vg-sample --curve. */
function evaluate() {
    const old = oldTime(time), at = exploring || placeAt(old);
    vertices = vertices || new Float64Array(base.d), coordinates = coordinates || new Float64Array(base.m);
    shapeOf(plateAt(now.plate, at, coordinates), vertices);
    if (base.root && !now.sketch) placeRoot(old, vertices);
    return vertices;
}

/* Vertices to the axes and unit of the page, with normals. */
function showVertices(p) {
    const [slot] = body.slots, {xyz} = slot, {centre} = body.about, sum = [0, 0, 0];
    for (let k = 0; k < 3; k++) {
        const [axis, sign] = AXES[k], scale = sign / body.unit, from = centre[axis];
        for (let v = 0, i = axis, o = k; v < body.nv; v++, i += 3, o += 4) sum[k] += xyz[o] = scale * (p[i] - from);
    }
    slot.middle = sum.map((x) => x / (body.nv || 1));
    findNormals(body, slot);
    upload(body, slot);
    body.part = 0, body.middle = slot.middle;
}

/* ---- drawn by page_draw.js ---- */

let stale = true;
const live = {
    take() {
        if (!stale && body.slots[0].frame === 0) return true; /* -1: the graphics were reset */
        const start = performance.now();
        showVertices(evaluate());
        document.documentElement.dataset.spent = (performance.now() - start).toFixed(2); /* milliseconds */
        stale = false;
        body.slots[0].frame = 0;
        return true;
    },
    placeOf: (v) => placeNow(body, v),
};

function drawPose() {
    stale = true;
    draw();
}

/* ---- thumbnails ---- */

const THUMB = 96;

/* A picture of the pose at a place of the plane, without the root, as a data URL. */
function portrait(place) {
    const x = plateAt(now.plate, place, new Float64Array(base.m)), saved = {follow: state.follow, shift: state.shift, zoom: state.zoom};
    Object.assign(state, {follow: true, shift: [0, 0], zoom: 1});
    showVertices(shapeOf(x, new Float64Array(base.d)));
    gl.viewport(0, 0, THUMB, THUMB);
    gl.scissor(0, 0, THUMB, THUMB);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    bindPlaces(body.slots[0].texture, body.slots[1].texture);
    const cam = camera(1, body, [body]);
    if (body.index.length) drawSurface({s: body, over: false}, cam, [THUMB, THUMB], 1);
    drawBones(body, cam, [THUMB, THUMB], 1);
    Object.assign(state, saved);
    return canvas.toDataURL();
}

/* Portraits of places, and then the canvas as it was. */
function portraits(places) {
    if (!gl || gl.isContextLost()) return [];
    const w = canvas.width, h = canvas.height;
    canvas.width = canvas.height = THUMB;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.BLEND);
    blendNormally();
    const list = places.map(portrait);
    canvas.width = w, canvas.height = h;
    stale = true;
    render();
    return list;
}

/* ---- a pose as a file ---- */

function objText() {
    const p = evaluate(), lines = [`# ${facts.title}: time ${+time.toPrecision(9)}`];
    for (let i = 0; i < p.length; i += 3) lines.push(`v ${p[i]} ${p[i + 1]} ${p[i + 2]}`);
    for (let f = 0; f < body.nf; f++) {
        const face = body.corners.subarray(body.start[f], body.start[f + 1]);
        lines.push((face.length === 2 ? "l " : face.length === 1 ? "p " : "f ") + Array.from(face, (v) => v + 1).join(" "));
    }
    return lines.join("\n") + "\n";
}
