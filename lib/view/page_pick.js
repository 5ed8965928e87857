/* page_pick.js: what is under the pointer: vertex, face, component, joint and number; a pinned vertex and its path over time.
 * Leaves out drawing (page_draw.js).
 * SPDX-License-Identifier: GPL-3.0-or-later */

let hovered = null, pinned = null; /* {s, v, face, track} */

/* What a page for picking pairs sets (page_pairs.js). */
let onClick = pin, afterDraw = null, beforeListening = null, whenThere = null;

/* From the eye through a place on the canvas, in CSS pixels. */
function rayOf(panel, x, y) {
    const {cam} = panel, a = (2 * (x - panel.x) / panel.w - 1) * cam.tangent * cam.aspect, b = (1 - 2 * (y - panel.y) / panel.h) * cam.tangent;
    return {from: cam.eye, to: cam.right.map((r, k) => r * a + cam.up[k] * b - cam.toward[k])};
}

/* The nearest triangle that a ray meets (Moeller and Trumbore): how far away, and its first number in s.index. */
function meetSurface(s, {from, to}) {
    const {index, corners} = s, xyz = s.slots[0].xyz;
    let nearest = Infinity, at = -1;
    for (let i = 0; i < index.length; i += 3) {
        const o = 4 * corners[index[i]], p = 4 * corners[index[i + 1]], q = 4 * corners[index[i + 2]];
        const ax = xyz[p] - xyz[o], ay = xyz[p + 1] - xyz[o + 1], az = xyz[p + 2] - xyz[o + 2];
        const bx = xyz[q] - xyz[o], by = xyz[q + 1] - xyz[o + 1], bz = xyz[q + 2] - xyz[o + 2];
        const nx = to[1] * bz - to[2] * by, ny = to[2] * bx - to[0] * bz, nz = to[0] * by - to[1] * bx;
        const det = ax * nx + ay * ny + az * nz;
        if (det === 0) continue;
        const dx = from[0] - xyz[o], dy = from[1] - xyz[o + 1], dz = from[2] - xyz[o + 2], u = (dx * nx + dy * ny + dz * nz) / det;
        if (!(u >= 0 && u <= 1)) continue;
        const cx = dy * az - dz * ay, cy = dz * ax - dx * az, cz = dx * ay - dy * ax, v = (to[0] * cx + to[1] * cy + to[2] * cz) / det;
        const t = (bx * cx + by * cy + bz * cz) / det;
        if (v >= 0 && u + v <= 1 && t > 0 && t < nearest) nearest = t, at = i;
    }
    return {nearest, at};
}

/* Where a point of a panel is on the canvas, in CSS pixels. */
function onCanvas(panel, p) {
    const {cam} = panel, d = p.map((x, k) => x - cam.eye[k]), depth = -dot(d, cam.toward);
    if (depth <= 0) return null;
    return [panel.x + (1 + dot(d, cam.right) / depth / cam.tangent / cam.aspect) * panel.w / 2,
            panel.y + (1 - dot(d, cam.up) / depth / cam.tangent) * panel.h / 2];
}

function nearestOnCanvas(panel, n, placeOf, x, y, reach) {
    let best = -1, least = reach * reach;
    for (let v = 0; v < n; v++) {
        const at = onCanvas(panel, placeOf(v)), d = at ? (at[0] - x) ** 2 + (at[1] - y) ** 2 : Infinity;
        if (d < least) least = d, best = v;
    }
    return best;
}

/* The vertex of a panel at a place on the canvas; null: there is none. */
function pickIn(panel, x, y) {
    const {s} = panel, share = (x - panel.x) / panel.w;
    if (!panel.cam || share < panel.cut[0] || share > panel.cut[1] || y < panel.y || y > panel.y + panel.h) return null;
    if (s.rig && state.joints) {
        const joint = nearestOnCanvas(panel, s.rig.points.length, (j) => s.rig.points[j], x, y, 8);
        if (joint >= 0) return {s, joint};
    }
    const ray = rayOf(panel, x, y), {nearest, at} = s.index.length ? meetSurface(s, ray) : {at: -1};
    if (at < 0) {
        const v = s.bones.length || s.points ? nearestOnCanvas(panel, s.nv, (w) => placeNow(s, w), x, y, 14) : -1;
        return v < 0 ? null : {s, v, face: -1};
    }
    const hit = ray.from.map((p, k) => p + nearest * ray.to[k]), three = [0, 1, 2].map((k) => s.corners[s.index[at + k]]);
    const away = three.map((v) => Math.hypot(...placeNow(s, v).map((p, k) => p - hit[k])));
    return {s, v: three[away.indexOf(Math.min(...away))], face: s.faceOf[s.index[at]]};
}

function pickAt(x, y) {
    for (const panel of [...drawn].reverse()) {
        const found = pickIn(panel, x, y);
        if (found) return found;
    }
    return null;
}

/* What is known of a vertex, line by line. */
function describe({s, v, face, joint}) {
    const lines = sequences.length > 1 ? [s.about.label] : [], names = s.about.joints;
    if (joint !== undefined) return [...lines, `joint ${names[joint]}`];
    lines.push(names.length && !s.about.jointsAt ? `joint ${names[v]} (vertex ${v})` : `vertex ${v}`);
    if (face >= 0) lines.push(`face ${face}${s.patches ? `, patch ${s.patches[face]}` : ""}${s.materials && s.materials[face] ? `, ${s.about.materials[s.materials[face] - 1].name}` : ""}`);
    if (s.components > 1 && s.component[v]) lines.push(`component ${s.component[v]} of ${s.components}`);
    const number = TINT ? numberIn(s, v, Math.min(state.frame, s.frames - 1)) : null;
    if (number !== null) lines.push(`${TINT.kind === "errors" ? "error" : TINT.kind === "scales" ? "length" : TINT.title.split(" in units")[0]} ` +
        `${amount(TINT.kind === "scales" ? 2 ** number : number)}${unit()}`);
    const p = placeIn(s, v, Math.min(state.frame, s.frames - 1));
    if (p) { /* in the mesh's own axes and unit */
        const own = [0, 0, 0];
        AXES.forEach(([axis, sign], k) => { own[axis] = sign * p[k] * s.unit + s.about.centre[axis]; });
        lines.push(`at ${own.map((x) => +x.toPrecision(5)).join(" ")}`);
    }
    return lines;
}

/* The path of the pinned vertex over all frames, once these are unpacked. */
function trackPinned() {
    const {s, v} = pinned, points = [];
    if (v === undefined || s.frames < 2 || s.live) return;
    for (let f = 0; f < s.frames; f++) {
        const p = placeIn(s, v, f);
        if (!p) return;
        points.push(p);
    }
    pinned.track = makeTrack(points, points.slice(1).flatMap((_, i) => [i, i + 1]));
}

/* The readout follows what it describes. */
function showPicked() {
    const shown = pinned || hovered, readout = $("readout"), panel = shown && drawn.find((p) => p.s === shown.s);
    if (pinned && !pinned.track) trackPinned();
    readout.hidden = $("dot").hidden = !panel;
    if (!panel) return;
    const at = onCanvas(panel, shown.joint !== undefined ? shown.s.rig.points[shown.joint] : placeNow(shown.s, shown.v));
    readout.textContent = describe(shown).join("\n");
    readout.classList.toggle("pinned", Boolean(pinned));
    if (!at) return;
    $("dot").style.transform = `translate(${at[0]}px, ${at[1]}px)`;
    const left = at[0] + 14 + readout.offsetWidth > canvas.clientWidth ? at[0] - 14 - readout.offsetWidth : at[0] + 14;
    readout.style.transform = `translate(${Math.max(4, left)}px, ${Math.max(4, Math.min(at[1] + 10, canvas.clientHeight - readout.offsetHeight - 4))}px)`;
}

function hover(x, y) {
    hovered = pickAt(x, y);
    document.documentElement.dataset.hovered = hovered ? String(hovered.v ?? hovered.joint) : "";
    showPicked();
}

/* A click pins what is under the pointer, and a click on nothing lets go. */
function pin(x, y) {
    pinned = pickAt(x, y);
    document.documentElement.dataset.pinned = pinned ? String(pinned.v ?? pinned.joint) : "";
    draw();
}

