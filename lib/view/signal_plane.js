/* signal_plane.js: the pose plane: the curve, frames, sites, control points, thumbnails; choosing and dragging them.
 * Leaves out what an edit does (signal_edit.js).
 * SPDX-License-Identifier: GPL-3.0-or-later */

const SVG = "http://www.w3.org/2000/svg";
const plane = $("plane");
let eye = {x: 0, y: 0, unit: 1}; /* the middle of what is seen of the plane, and pixels for a unit */
let tool = "edit", chosen = null; /* {kind: "control" or "frame", i} */
const pinnedFrames = new Set();
let deviation = null, change = null, crossings = [], stroke = null;

function element(name, attributes, parent) {
    const e = document.createElementNS(SVG, name);
    for (const key of Object.keys(attributes)) e.setAttribute(key, attributes[key]);
    if (parent) parent.append(e);
    return e;
}

/* ---- from the plane to the screen and back ---- */

const toScreen = (p) => [plane.clientWidth / 2 + (p[0] - eye.x) * eye.unit, plane.clientHeight / 2 - (p[1] - eye.y) * eye.unit];
const toPlane = (x, y) => [eye.x + (x - plane.clientWidth / 2) / eye.unit, eye.y - (y - plane.clientHeight / 2) / eye.unit];
const controlPlace = (i) => [now.curve.control[2 * i], now.curve.control[2 * i + 1]];
const framePlace = (i) => [now.position[2 * i], now.position[2 * i + 1]];
const pathOf = (points) => points.map((p, i) => (i ? "L" : "M") + toScreen(p).map((x) => x.toFixed(1)).join(" ")).join("");
const pointsText = (points) => points.map((p) => toScreen(p).map((x) => x.toFixed(1)).join(",")).join(" ");

function showWholePlane() {
    const all = [...now.position, ...now.curve.control], xs = all.filter((_, i) => !(i & 1)), ys = all.filter((_, i) => i & 1);
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    eye = {x: (x0 + x1) / 2, y: (y0 + y1) / 2,
           unit: Math.min((plane.clientWidth - 90) / (x1 - x0 || 1), (plane.clientHeight - 130) / (y1 - y0 || 1))};
    showPlane();
    later();
}

function zoomPlane(factor, x, y) {
    const before = toPlane(x, y);
    eye.unit *= factor;
    const after = toPlane(x, y);
    eye.x += before[0] - after[0], eye.y += before[1] - after[1];
    showPlane();
    later();
}

/* ---- drawing ---- */

const BUCKETS = 16;

/* The curve in pieces, sorted by their colour, so that there are few paths. */
function showCurve() {
    const colours = mapColours(), steps = (base.n - 1) * PARTS, buckets = Array.from({length: BUCKETS}, () => []);
    const points = Array.from({length: steps + 1}, (_, i) => placeAt(1 + i / PARTS));
    for (let i = 0; i < steps; i++) {
        const size = deviation ? Math.max(deviation[i], deviation[i + 1]) : 0;
        buckets[Math.min(BUCKETS - 1, Math.floor(size * BUCKETS))].push([points[i], points[i + 1]]);
    }
    const group = $("plane-curve");
    group.textContent = "";
    buckets.forEach((list, b) => {
        if (list.length) element("path", {d: list.map(pathOf).join(""), stroke: colours[Math.round((b + 0.5) / BUCKETS * (colours.length - 1))]}, group);
    });
}

function showMarks() {
    const group = $("plane-marks"), sites = new Set(now.site);
    group.textContent = "";
    for (let i = 0; i < base.n; i++) {
        const [x, y] = toScreen(framePlace(i)), own = chosen && chosen.kind === "frame" && chosen.i === i, pinnedOne = pinnedFrames.has(i);
        const name = `frame${sites.has(i) ? " site" : ""}${pinnedOne ? " pinned" : ""}${own ? " chosen" : ""}`;
        if (pinnedOne) element("rect", {class: name, x: x - 6, y: y - 6, width: 12, height: 12}, group);
        else element("circle", {class: name, cx: x, cy: y, r: sites.has(i) ? 4 : 2.5}, group);
    }
    for (const p of crossings) {
        const [x, y] = toScreen(p);
        element("path", {class: "crossing", d: `M${x - 5} ${y - 5}L${x + 5} ${y + 5}M${x - 5} ${y + 5}L${x + 5} ${y - 5}`}, group);
    }
    for (let i = 0; i < now.curve.k && !now.sketch; i++) {
        const [x, y] = toScreen(controlPlace(i)), own = chosen && chosen.kind === "control" && chosen.i === i;
        element("circle", {class: own ? "control chosen" : "control", cx: x, cy: y, r: own ? 7 : 5}, group);
    }
}

function showHead() {
    const [x, y] = toScreen(exploring || placeAt(oldTime(time)));
    $("plane-head").setAttribute("cx", x);
    $("plane-head").setAttribute("cy", y);
}

function showPlane() {
    if (!now) return;
    $("plane-hull").setAttribute("points", pointsText([...now.hull, ...now.hull.slice(0, 1)]));
    const before = edits.ops.length || now.sketch ? Array.from({length: (base.n - 1) * PARTS + 1}, (_, i) => curveAt(base.curve, 1 + i / PARTS)) : [];
    $("plane-before").setAttribute("points", pointsText(before));
    $("plane-lines").textContent = "";
    if (!now.sketch) element("path", {d: pathOf(Array.from({length: now.curve.k}, (_, i) => controlPlace(i)))}, $("plane-lines"));
    showCurve();
    showMarks();
    showHead();
    placeThumbs();
}

/* ---- thumbnails: poses of frames far from one another, and paler ones on a grid between them ---- */

let thumbs = []; /* {place, pale, image} */

/* Frames far from one another on the screen. */
function spreadFrames(most, apart) {
    const all = Array.from({length: base.n}, (_, i) => framePlace(i)), picked = [0], far = (p) => Math.min(...picked.map((j) => Math.hypot(p[0] - all[j][0], p[1] - all[j][1])));
    while (picked.length < most) {
        let best = 0, most_ = 0;
        all.forEach((p, i) => { const d = far(p); if (d > most_) most_ = d, best = i; });
        if (most_ * eye.unit < apart) break;
        picked.push(best);
    }
    return picked.map((i) => all[i]);
}

/* Places of a grid in what is seen that are among the frames: it gets finer with the zoom. */
function gridPlaces(taken) {
    const cell = 2 ** Math.round(Math.log2(THUMB * 0.9 / eye.unit)), [x0, y1] = toPlane(0, 0), [x1, y0] = toPlane(plane.clientWidth, plane.clientHeight), list = [];
    for (let x = Math.ceil(x0 / cell) * cell; x <= x1; x += cell)
        for (let y = Math.ceil(y0 / cell) * cell; y <= y1 && list.length < 60; y += cell)
            if (insideHull(now.hull, [x, y]) && taken.every((p) => Math.hypot(p[0] - x, p[1] - y) > 0.7 * cell)) list.push([x, y]);
    return list;
}

function placeThumbs() {
    for (const {place, image} of thumbs) {
        const [x, y] = toScreen(place);
        image.setAttribute("x", x - THUMB * 0.36);
        image.setAttribute("y", y - THUMB * 0.36);
    }
}

function makeThumbs() {
    const some = spreadFrames(7, 110), pale = gridPlaces(some), places = [...pale, ...some], pictures = portraits(places), group = $("plane-grid");
    group.textContent = "";
    thumbs = pictures.map((href, i) => ({place: places[i], image: element("image", {href, width: THUMB * 0.72, height: THUMB * 0.72, opacity: i < pale.length ? 0.28 : 0.95}, group)}));
    placeThumbs();
    document.documentElement.dataset.thumbs = String(thumbs.length);
}

/* Thumbnails follow when nothing has moved for a moment. */
let waiting = 0;
function later() {
    clearTimeout(waiting);
    waiting = setTimeout(() => { if (!state.playing) makeThumbs(); else later(); }, 250);
}

/* ---- after an edit ---- */

/* What follows from the edits; `whole`: also what takes longer, when nothing is dragged any more. */
function changed(whole) {
    applyEdits();
    time = Math.max(firstTime(), Math.min(lastTime(), time));
    if (chosen && chosen.kind === "control" && (now.sketch || chosen.i >= now.curve.k)) chosen = null;
    if (whole || base.n * base.m * now.plate.l < 2e6) {
        const shapes = shapesOfFrames();
        if (!baseShapes) baseShapes = shapes;
        change = changesOf(shapes);
        deviation = deviationsOf(shapes);
        crossings = crossingsOf(Array.from({length: (base.n - 1) * PARTS * 2 + 1}, (_, i) => placeAt(1 + i / PARTS / 2)));
    }
    if (whole) later();
    showEverything();
}

function tellChanges() {
    const flags = change.map((x) => x > 1e-7), most = change.reduce((a, b) => Math.max(a, b), 0), list = rangesOf(flags);
    const what = list ? `Changed: frame${/[ ,]/.test(list) ? "s" : ""} ${list}; at most ${(100 * most).toPrecision(2)} % of D (rms).` : "No frame is changed.";
    const speed = now.retime ? ` Retimed: ${base.n} frames become ${Math.floor(lastTime() - firstTime() + 1e-9) + 1}.` : "";
    const one = !chosen ? "" : chosen.kind === "frame" ? `Frame ${chosen.i + 1}${now.site.includes(chosen.i) ? ", a site" : ""}${pinnedFrames.has(chosen.i) ? ", pinned" : ""}. ` :
        `Control point ${chosen.i + 1} at ${controlPlace(chosen.i).map((x) => x.toFixed(3)).join(", ")}, moves frames ${supportOf(now.curve, chosen.i).map((x) => x + 1).join(" to ")}. `;
    $("status").textContent = one + what + speed;
    document.documentElement.dataset.changed = list;
}

/* ---- choosing and dragging ---- */

/* What lies under the pointer: the time on the curve, a control point, a frame. */
function underPointer(x, y, reach) {
    let best = null, least = reach * reach;
    const test = (kind, i, place, favour) => {
        const [px, py] = toScreen(place), d = ((px - x) ** 2 + (py - y) ** 2) * favour;
        if (d < least) least = d, best = {kind, i};
    };
    for (let i = 0; i < base.n; i++) test("frame", i, framePlace(i), pinnedFrames.has(i) ? 0.5 : 2);
    for (let i = 0; i < now.curve.k && !now.sketch; i++) test("control", i, controlPlace(i), 0.6);
    test("head", 0, placeAt(oldTime(time)), 1);
    return best;
}

/* The time whose place is nearest to a point, near `from`: so that the head does not jump where the curve crosses itself. */
function nearestTime(point, from, span) {
    let best = from, least = Infinity;
    const steps = 400, first = Math.max(firstTime(), from - span), last = Math.min(lastTime(), from + span);
    for (let i = 0; i <= steps; i++) {
        const t = first + (last - first) * i / steps, p = placeAt(oldTime(t)), d = (p[0] - point[0]) ** 2 + (p[1] - point[1]) ** 2;
        if (d < least) least = d, best = t;
    }
    return best;
}

function explore(place) {
    exploring = place;
    $("outside").hidden = !place || insideHull(now.hull, place);
    showHead();
    drawPose();
}

function choose(what) {
    chosen = what;
    if (what && what.kind === "frame" && !now.retime) setTime(what.i + 1);
    showEverything();
}

/* Points that are on a straight line between their neighbours are left out (Ramer, Douglas and Peucker). */
function simplify(points, tolerance) {
    if (points.length < 3) return points;
    const [a, b] = [points[0], points[points.length - 1]], ux = b[0] - a[0], uy = b[1] - a[1], length = Math.hypot(ux, uy);
    let at = 0, most = tolerance;
    for (let i = 1; i + 1 < points.length; i++) {
        const [x, y] = [points[i][0] - a[0], points[i][1] - a[1]], d = length > 0 ? Math.abs(ux * y - uy * x) / length : Math.hypot(x, y);
        if (d > most) most = d, at = i;
    }
    return at ? [...simplify(points.slice(0, at + 1), tolerance).slice(0, -1), ...simplify(points.slice(at), tolerance)] : [a, b];
}

function endStroke() {
    const points = simplify(stroke, 4 / eye.unit);
    stroke = null;
    $("plane-stroke").setAttribute("points", "");
    if (points.length < 2 || Math.hypot(points[0][0] - points[points.length - 1][0], points[0][1] - points[points.length - 1][1]) * eye.unit + points.length < 12) return;
    remember();
    edits = {...edits, sketch: {points: points.flat(), controls: false}};
    changed(true);
}

function moveChosen(place) {
    const {kind, i} = chosen;
    put([kind, i + 1, ...place]);
    changed(false);
}

const pointers = new Map();
let drag = null; /* {kind, i, from, moved} */

function planeDown(event) {
    plane.setPointerCapture(event.pointerId);
    plane.focus();
    const [x, y] = [event.offsetX, event.offsetY];
    pointers.set(event.pointerId, [x, y]);
    play(false);
    if (pointers.size > 1) {
        if (drag && drag.moved) endDrag();
        drag = null;
        return;
    }
    if (tool === "explore" || event.shiftKey) drag = {kind: "explore"}, explore(toPlane(x, y));
    else if (tool === "draw") drag = {kind: "draw"}, stroke = [toPlane(x, y)];
    else {
        const found = underPointer(x, y, event.pointerType === "mouse" ? 11 : 24);
        drag = found || {kind: "plane"};
        if (found && found.kind !== "head") choose(found);
        if (!found) choose(null);
    }
    drag.start = [x, y];
}

function planeMove(event) {
    const [x, y] = [event.offsetX, event.offsetY], before = pointers.get(event.pointerId);
    if (!before) {
        if (event.shiftKey || (exploring && tool === "edit")) explore(event.shiftKey ? toPlane(x, y) : null);
        return;
    }
    if (pointers.size > 1) {
        const other = [...pointers].find(([id]) => id !== event.pointerId)[1], was = Math.hypot(before[0] - other[0], before[1] - other[1]);
        eye.x -= (x - before[0]) / 2 / eye.unit, eye.y += (y - before[1]) / 2 / eye.unit;
        if (was > 10) zoomPlane(Math.hypot(x - other[0], y - other[1]) / was, (x + other[0]) / 2, (y + other[1]) / 2);
    } else if (drag) dragTo(x, y, before);
    pointers.set(event.pointerId, [x, y]);
}

function dragTo(x, y, before) {
    if (!drag.moved && Math.hypot(x - drag.start[0], y - drag.start[1]) < 3) return;
    if (!drag.moved && (drag.kind === "control" || (drag.kind === "frame" && pinnedFrames.has(drag.i)))) remember();
    drag.moved = true;
    if (drag.kind === "explore") explore(toPlane(x, y));
    else if (drag.kind === "draw") {
        stroke.push(toPlane(x, y));
        $("plane-stroke").setAttribute("points", pointsText(stroke));
    } else if (drag.kind === "head") setTime(nearestTime(toPlane(x, y), time, Math.max(2, base.n / 12)));
    else if (drag.kind === "control" || (drag.kind === "frame" && pinnedFrames.has(drag.i))) moveChosen(toPlane(x, y));
    else {
        eye.x -= (x - before[0]) / eye.unit, eye.y += (y - before[1]) / eye.unit;
        showPlane();
    }
}

function endDrag() {
    if (drag.kind === "draw") endStroke();
    else if (drag.kind === "explore") explore(null);
    else if (drag.moved && (drag.kind === "control" || drag.kind === "frame")) changed(true);
    else if (drag.moved && drag.kind === "plane") later();
    drag = null;
}

function planeUp(event) {
    pointers.delete(event.pointerId);
    if (drag) endDrag();
}

/* ---- buttons and keys ---- */

/* A control point at the time that is shown. */
function addPoint() {
    const old = oldTime(time);
    if (now.sketch || !insertControl(now.curve, parameterAt(now.curve, old))) return say("A control point can be added between the first and the last frame.");
    edit(["insert", +old.toPrecision(12)]);
    const near = Array.from({length: now.curve.k}, (_, i) => i), here = placeAt(old);
    const far = (i) => Math.hypot(controlPlace(i)[0] - here[0], controlPlace(i)[1] - here[1]);
    choose({kind: "control", i: near.reduce((a, b) => far(b) < far(a) ? b : a)});
}

function removePoint() {
    if (!chosen || chosen.kind !== "control") return;
    if (!removable(now.curve, chosen.i)) return say("The first and last two control points cannot be removed.");
    const {i} = chosen;
    chosen = null;
    edit(["remove", i + 1]);
}

const shownFrame = () => chosen && chosen.kind === "frame" ? chosen.i : Math.round(oldTime(time)) - 1;

function pinFrame() {
    const i = shownFrame();
    if (!pinnedFrames.delete(i)) pinnedFrames.add(i);
    choose({kind: "frame", i});
}

function changeSite() {
    const i = shownFrame(), is = now.site.includes(i);
    if (is && now.site.length < 4) return say("A surface keeps at least three sites.");
    edit(["site", is ? -(i + 1) : i + 1]);
    choose({kind: "frame", i});
}

function dropCurve() {
    remember();
    edits = {...edits, sketch: null};
    changed(true);
}

function chooseNext(by) {
    if (now.sketch) return;
    const {k} = now.curve, i = chosen && chosen.kind === "control" ? (chosen.i + by + k) % k : by > 0 ? 0 : k - 1;
    choose({kind: "control", i});
}

/* Arrow keys move what is chosen: true when something was. */
function nudge(key, fine) {
    const by = {arrowleft: [-1, 0], arrowright: [1, 0], arrowup: [0, 1], arrowdown: [0, -1]}[key];
    if (!by || !chosen || (chosen.kind === "frame" && !pinnedFrames.has(chosen.i))) return false;
    const from = chosen.kind === "control" ? controlPlace(chosen.i) : framePlace(chosen.i), unit = (fine ? 1 : 10) / eye.unit;
    remember();
    put([chosen.kind, chosen.i + 1, from[0] + by[0] * unit, from[1] + by[1] * unit]);
    changed(true);
    return true;
}

const planeKeys = {
    n: () => chooseNext(1), b: () => chooseNext(-1), insert: addPoint, delete: removePoint, backspace: removePoint, p: pinFrame, t: changeSite,
};

function onPlaneKey(event) {
    const key = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey) return;
    if (nudge(key, event.altKey)) event.preventDefault();
    else if (planeKeys[key]) planeKeys[key](), event.preventDefault();
    if (event.defaultPrevented) event.stopPropagation();
}

function listenToPlane() {
    plane.addEventListener("pointerdown", planeDown);
    plane.addEventListener("pointermove", planeMove);
    plane.addEventListener("pointerup", planeUp);
    plane.addEventListener("pointercancel", planeUp);
    plane.addEventListener("pointerleave", () => { if (!drag && exploring) explore(null); });
    plane.addEventListener("keydown", onPlaneKey);
    plane.addEventListener("dblclick", (event) => {
        if (now.sketch || tool !== "edit") return;
        const place = toPlane(event.offsetX, event.offsetY), t = nearestTime(place, (firstTime() + lastTime()) / 2, lastTime()), on = placeAt(oldTime(t));
        if (Math.hypot(on[0] - place[0], on[1] - place[1]) * eye.unit > 14) return;
        setTime(t);
        addPoint();
    });
    plane.addEventListener("wheel", (event) => {
        event.preventDefault();
        zoomPlane(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.offsetX, event.offsetY);
    }, {passive: false});
    window.addEventListener("keyup", (event) => { if (event.key === "Shift" && exploring && tool === "edit" && !drag) explore(null); });
    new ResizeObserver(showWholePlane).observe(plane);
    for (const [id, what] of [["add-point", addPoint], ["remove-point", removePoint], ["pin", pinFrame], ["site", changeSite], ["drop-curve", dropCurve], ["whole-plane", showWholePlane]])
        $(id).addEventListener("click", what);
}
