/* signal_edit.js: edits of a signal: what they make of it, as text that vg-sample --edit reads, undo and redo.
 * Leaves out how they are made by hand (signal_plane.js, signal_time.js).
 * SPDX-License-Identifier: GPL-3.0-or-later */

let base = null;     /* the signal as it came: {n, m, curve, position, site, x} */
let now = null;      /* the signal as it is edited: {curve, position, site, plate, retime, sketch, hull} */
let edits = {ops: [], retime: [], sketch: null}; /* ops: [verb, numbers ...]; retime: [old, new] pairs; sketch: {points, controls} */
const past = [], future = [];

/* ---- what edits do ---- */

const wholeIn = (x, most) => Number.isInteger(x) && x >= 1 && x <= most;

/* Apply one edit to a draft; returns what is wrong with it. */
const verbs = {
    control(draft, [i, x, y]) {
        if (!wholeIn(i, draft.curve.k)) return `there is no control point ${i}: they are numbered from 1 to ${draft.curve.k}`;
        draft.curve.control.set([x, y], 2 * (i - 1));
    },
    insert(draft, [time]) {
        const more = insertControl(draft.curve, parameterAt(draft.curve, time));
        if (!more) return "a control point can only be added between the first and the last frame";
        draft.curve = more;
    },
    remove(draft, [i]) {
        if (!wholeIn(i, draft.curve.k)) return `there is no control point ${i}: they are numbered from 1 to ${draft.curve.k}`;
        if (draft.curve.k <= 4) return "a curve has at least 4 control points";
        if (!removable(draft.curve, i - 1)) return "the first and last two control points cannot be removed";
        draft.curve = removeControl(draft.curve, i - 1);
    },
    frame(draft, [i, x, y]) {
        if (!wholeIn(i, base.n)) return `there is no frame ${i}: they are numbered from 1 to ${base.n}`;
        draft.position.set([x, y], 2 * (i - 1));
    },
    site(draft, [i]) {
        if (!wholeIn(Math.abs(i), base.n)) return `there is no frame ${Math.abs(i)}: they are numbered from 1 to ${base.n}`;
        const at = draft.site.indexOf(Math.abs(i) - 1);
        if (i > 0 && at < 0) draft.site.push(i - 1);
        if (i > 0) return;
        if (at < 0) return `frame ${-i} is no site`;
        if (draft.site.length === 1) return "the last site cannot be removed";
        draft.site.splice(at, 1);
    },
};
const NUMBERS = {control: 3, insert: 1, remove: 1, frame: 3, site: 1, time: 2};

function draftOf(ops) {
    const draft = {curve: {...base.curve, control: base.curve.control.slice()}, position: base.position.slice(), site: [...base.site]};
    for (const [verb, ...numbers] of ops) {
        const wrong = verbs[verb](draft, numbers);
        if (wrong) throw new Error(wrong);
    }
    return draft;
}

/* The surface follows positions and sites alone: it is solved again only when these have changed. */
let plateKey = null, plate = null;
function plateFor(draft, ops) {
    const key = JSON.stringify(ops.filter(([verb]) => verb === "frame" || verb === "site"));
    if (key !== plateKey) plate = makePlate(draft.position, draft.site, base.x, base.m), plateKey = key;
    return plate;
}

function retimeOf(pairs) {
    if (pairs.length < 2) return null;
    const olds = Float64Array.from(pairs, (p) => p[0]), news = Float64Array.from(pairs, (p) => p[1]);
    return {olds, news, slope: monotoneSlopes(news, olds)};
}

function applyEdits() {
    const draft = draftOf(edits.ops), {sketch} = edits;
    now = {...draft, plate: plateFor(draft, edits.ops), retime: retimeOf(edits.retime), hull: hullOf(draft.position),
           sketch: sketch ? makeSketch(sketch.points, sketch.controls) : null};
}

/* ---- times ---- */

const firstTime = () => now.retime ? now.retime.news[0] : 1;
const lastTime = () => now.retime ? now.retime.news[now.retime.news.length - 1] : base.n;
/* The old time at a new one. */
const oldTime = (time) => now.retime ? monotoneAt(now.retime.news, now.retime.olds, now.retime.slope, time) : Math.max(1, Math.min(base.n, time));
/* The place of the plane at an old time. */
const placeAt = (old) => now.sketch ? now.sketch(base.n > 1 ? (old - 1) / (base.n - 1) : 0) : curveAt(now.curve, old);

/* ---- undo ---- */

const snapshot = () => JSON.stringify({...edits, sketch: edits.sketch && {...edits.sketch, points: [...edits.sketch.points]}});

/* Before an edit: what it changes can be undone in one step. */
function remember() {
    past.push(snapshot());
    future.length = 0;
}

function restore(text) {
    edits = JSON.parse(text);
    changed(true);
}

function undo() {
    if (!past.length) return;
    future.push(snapshot());
    restore(past.pop());
}

function redo() {
    if (!future.length) return;
    past.push(snapshot());
    restore(future.pop());
}

function resetEdits() {
    if (snapshot() === JSON.stringify({ops: [], retime: [], sketch: null})) return;
    remember();
    edits = {ops: [], retime: [], sketch: null};
    changed(true);
}

/* ---- making edits ---- */

/* A later position of the same point replaces the earlier one, unless the numbers of the points have changed in between. */
function put(op) {
    const [verb, number] = op, {ops} = edits;
    for (let i = ops.length - 1; i >= 0; i--) {
        if (verb === "control" && (ops[i][0] === "insert" || ops[i][0] === "remove")) break;
        if ((verb === "control" || verb === "frame") && ops[i][0] === verb && ops[i][1] === number) {
            ops[i] = op;
            return;
        }
        if (verb === "site" && number < 0 && ops[i][0] === "site" && Math.abs(ops[i][1]) === -number) {
            if (ops[i][1] > 0 && !ops.slice(i + 1).some((o) => o[0] === "site")) {
                ops.splice(i, 1);
                return;
            }
            break;
        }
    }
    ops.push(op);
}

/* One edit, as a step of its own. */
function edit(op) {
    remember();
    put(op);
    changed(true);
}

/* ---- text ---- */

function editText() {
    const lines = [`# edits of ${facts.sequences[0].label}, for vg-sample --edit`, ...edits.ops.map((op) => op.join(" ")),
                   ...edits.retime.map((pair) => `time ${pair.join(" ")}`)];
    return lines.join("\n") + "\n";
}

function curveText() {
    const {points, controls} = edits.sketch, lines = [`# a curve through the pose plane of ${facts.sequences[0].label}, for vg-sample --curve`];
    for (let i = 0; i < points.length; i += 2) lines.push(`${controls ? "control " : ""}${points[i]} ${points[i + 1]}`);
    return lines.join("\n") + "\n";
}

/* Lines of words, without comments: [{number, words}]. */
const linesOf = (text) => text.split("\n").map((line, i) => ({number: i + 1, words: line.split("#")[0].trim().split(/[ \t\r]+/).filter(Boolean)}))
    .filter(({words}) => words.length);

function numbersOf(words, number, want) {
    const list = words.map(Number);
    if (words.length !== want) throw new Error(`line ${number}: ${want} number${want > 1 ? "s are" : " is"} wanted`);
    list.forEach((x, i) => { if (!Number.isFinite(x) || Math.abs(x) > 1e100) throw new Error(`line ${number}: '${words[i]}' is no number`); });
    return list;
}

function addPair(pairs, [old, time], number) {
    if (!(old >= 1 && old <= base.n)) throw new Error(`line ${number}: time ${old} is not in the sequence, which is from 1 to ${base.n}`);
    pairs.push([old, time]);
    pairs.sort((a, b) => a[1] - b[1]);
    if (pairs.some((p, i) => i && !(p[1] > pairs[i - 1][1] && p[0] >= pairs[i - 1][0])))
        throw new Error(`line ${number}: time ${old} at new time ${time} does not follow the others: both times rise together`);
}

function readEdits(lines) {
    const draft = draftOf([]), ops = [], retime = [];
    for (const {number, words: [verb, ...words]} of lines) {
        if (!NUMBERS[verb]) throw new Error(`line ${number}: '${verb}' is not known: control, insert, remove, frame, site or time`);
        const numbers = numbersOf(words, number, NUMBERS[verb]);
        if (verb === "time") addPair(retime, numbers, number);
        else {
            const wrong = verbs[verb](draft, numbers);
            if (wrong) throw new Error(`line ${number}: ${wrong}`);
            ops.push([verb, ...numbers]);
        }
    }
    if (retime.length === 1) throw new Error("there is one line 'time': at least two say how time goes");
    return {ops, retime, sketch: edits.sketch};
}

function readCurve(lines) {
    const controls = lines[0].words[0] === "control", points = [];
    for (const {number, words} of lines) {
        if ((words[0] === "control") !== controls) throw new Error(`line ${number}: control points and points that the curve goes through are mixed`);
        points.push(...numbersOf(controls ? words.slice(1) : words, number, 2));
    }
    const least = controls ? 4 : 2;
    if (points.length < 2 * least) throw new Error(`a curve takes at least ${least} points`);
    return {...edits, sketch: {points, controls}};
}

/* Take edits or a curve from text; returns what is wrong with it, and then nothing has changed. */
function loadText(text) {
    const lines = linesOf(text);
    try {
        const isCurve = lines.length && (!Number.isNaN(Number(lines[0].words[0])) || (lines[0].words[0] === "control" && lines[0].words.length === 3));
        const taken = isCurve ? readCurve(lines) : readEdits(lines);
        remember();
        edits = taken;
    } catch (error) {
        return error.message;
    }
    changed(true);
    return "";
}

/* ---- what has changed ---- */

let baseShapes = null; /* n rows of m coordinates: of the frames as they came */

/* Coordinates of all frames as they are now. */
function shapesOfFrames() {
    const out = new Float64Array(base.n * base.m);
    for (let i = 0; i < base.n; i++) plateAt(now.plate, placeAt(i + 1), out.subarray(i * base.m, (i + 1) * base.m));
    return out;
}

/* Root mean squared distance of the vertices that coordinates differ by, in D. */
function sizeOf(difference) {
    const {m, gram} = base;
    let sum = 0;
    if (!gram) for (let j = 0; j < m; j++) sum += difference[j] * difference[j];
    for (let j = 0; gram && j < m; j++) for (let k = 0; k < m; k++) sum += gram[j * m + k] * difference[j] * difference[k];
    return Math.sqrt(Math.max(sum, 0) / (base.nv || 1)) / base.diagonal;
}

/* How far each frame is from what it was. */
function changesOf(shapes) {
    const {n, m} = base, difference = new Float64Array(m), change = new Float64Array(n);
    for (let i = 0; i < n; i++) {
        for (let j = 0; j < m; j++) difference[j] = shapes[i * m + j] - baseShapes[i * m + j];
        change[i] = sizeOf(difference);
    }
    return change;
}

/* Between frames: the distance from a cubic spline through the shapes of the frames, beside the rms of that of straight
 * lines. PARTS places between two frames each. */
const PARTS = 4;
function deviationsOf(shapes) {
    const {n, m} = base, times = base.curve.times, second = naturalSeconds(times, shapes, m), at = new Float64Array(m), want = new Float64Array(m);
    const deviation = new Float64Array((n - 1) * PARTS + 1);
    let straight = 0;
    for (let i = 0; i + 1 < n; i++)
        for (let q = 1; q < PARTS; q++) {
            const b = q / PARTS;
            naturalAt(times, shapes, second, m, i + 1 + b, want);
            plateAt(now.plate, placeAt(i + 1 + b), at);
            for (let j = 0; j < m; j++) at[j] -= want[j];
            deviation[i * PARTS + q] = sizeOf(at);
            for (let j = 0; j < m; j++) at[j] = (1 - b) * shapes[i * m + j] + b * shapes[(i + 1) * m + j] - want[j];
            straight += sizeOf(at) ** 2;
        }
    straight = Math.sqrt(straight / Math.max(1, (n - 1) * (PARTS - 1)));
    return deviation.map((x) => straight > 0 ? x / straight : 0);
}

/* Numbers of frames as people write them: 3, 5 to 9. */
function rangesOf(flags) {
    const parts = [];
    for (let i = 0; i < flags.length; i++) {
        if (!flags[i]) continue;
        let last = i;
        while (last + 1 < flags.length && flags[last + 1]) last++;
        parts.push(last > i ? `${i + 1} to ${last + 1}` : `${i + 1}`);
        i = last;
    }
    return parts.join(", ");
}
