/* page_pairs.js: pairs of vertices of two meshes, picked by clicks: the markers of vg-register.
 * Leaves out what is under the pointer (page_pick.js), and the fit of pairs (page_pairs_fit.js).
 * A page that vg-view makes holds this file; as an exception to the licence, such pages may be passed on under any terms.
 * SPDX-License-Identifier: GPL-3.0-or-later */

const SIDES = ["a", "b"]; /* the vertex of the source, the vertex of the target */
const marking = {pairs: [], open: -1, past: [], fit: null, suggested: null, leftOver: false};
const whole = (pair) => pair.a !== null && pair.b !== null;
const openPair = () => marking.pairs[marking.open] || null;
const mid = {}; /* the middle of the sequences along x, by side */

/* ---- changes ---- */

function remember() {
    marking.past.push(JSON.stringify([marking.pairs, marking.open]));
    if (marking.past.length > 500) marking.past.shift();
}

function undo() {
    if (marking.past.length) [marking.pairs, marking.open] = JSON.parse(marking.past.pop());
    changed();
}

/* The first pair that lacks a vertex, from one on. */
function nextOpen(from) {
    const n = marking.pairs.length;
    for (let i = 0; i < n; i++)
        if (!whole(marking.pairs[(from + i) % n])) return (from + i) % n;
    return -1;
}

function freeName() {
    const used = new Set(marking.pairs.map((p) => p.name));
    let i = marking.pairs.length + 1;
    while (used.has("p" + i)) i++;
    return "p" + i;
}

/* A click on a side: it completes or corrects the open pair, or begins a new one. */
function put(side, v) {
    remember();
    if (!openPair()) marking.open = marking.pairs.push({name: freeName(), a: null, b: null}) - 1;
    openPair()[side] = v;
    if (whole(openPair())) marking.open = nextOpen(marking.open);
    changed();
}

function accept() {
    if (marking.suggested) put(marking.suggested.side, marking.suggested.v);
}

function removePair(i) {
    remember();
    marking.pairs.splice(i, 1);
    marking.open = -1;
    changed();
}

function selectPair(i) {
    marking.open = marking.open === i ? -1 : i;
    changed();
}

/* ---- mirroring ---- */

/* Exchange the words for left and right in a name. */
function otherName(name) {
    for (const [x, y] of [["Left", "Right"], ["left", "right"]]) {
        if (name.includes(x)) return name.replace(x, y);
        if (name.includes(y)) return name.replace(y, x);
    }
    const end = name.match(/^(.*[._-])([lrLR])$/);
    return end ? end[1] + {l: "r", r: "l", L: "R", R: "L"}[end[2]] : name + "-mirrored";
}

/* The vertex across the middle; null: the point is in the middle, or nothing is there. */
function acrossVertex(side, v) {
    const s = sequences[SIDES.indexOf(side)], p = placeNow(s, v), n = normalOf(s, v);
    if (Math.abs(p[0] - mid[side]) < 0.004) return null;
    return nearestVertex(s, [2 * mid[side] - p[0], p[1], p[2]], [-n[0], n[1], n[2]], 0.03);
}

/* How far vertices v and w of a side are apart; Infinity where the surface faces another way, as a lip does from the other. */
function apart(side, v, w) {
    const s = sequences[SIDES.indexOf(side)], p = placeNow(s, v), q = placeNow(s, w), n = normalOf(s, v), m = normalOf(s, w);
    return n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < 0 ? Infinity : Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

/* For each whole pair the pair across, unless one is near there; the pair nearest to it that lacks its target vertex takes it. */
function mirror() {
    remember();
    for (const pair of marking.pairs.filter(whole)) {
        const a = acrossVertex("a", pair.a), b = acrossVertex("b", pair.b), near = (p) => apart("a", p.a, a);
        if (a === null || b === null) continue;
        if (marking.pairs.some((p) => whole(p) && (p.a === a || p.b === b || near(p) < 0.01 && apart("b", p.b, b) < 0.03))) continue;
        const waiting = marking.pairs.filter((p) => p.a !== null && p.b === null && near(p) < 0.01).sort((p, q) => near(p) - near(q))[0];
        if (waiting) waiting.b = b;
        else marking.pairs.push({name: otherName(pair.name), a, b});
    }
    marking.open = nextOpen(0);
    changed();
}

/* ---- files ---- */

const markersText = () => `# ${facts.sequences.map((s) => s.label).join(", ")}: name, vertex of the first, vertex of the second, counted from 0\n` +
    marking.pairs.filter(whole).map((p) => `${p.name} ${p.a} ${p.b}\n`).join("");

/* Lines of markers, or a name and a vertex of the source, whose partner is still to be clicked. */
function parseMarkers(text) {
    const pairs = [];
    text.split(/\r?\n/).forEach((line, i) => {
        const words = line.replace(/#.*/, "").split(/[\s,;]+/).filter((w) => w);
        if (!words.length) return;
        const named = !/^\d+$/.test(words[0]) || words.length > 2, numbers = words.slice(named ? 1 : 0).map((w) => /^\d+$/.test(w) ? +w : NaN);
        if (numbers.length < 1 || numbers.length > 2 || numbers.some((v, k) => !(v < sequences[k].nv)))
            throw new Error(`line ${i + 1}: not a name and vertices of the two meshes: '${line.slice(0, 60)}'`);
        pairs.push({name: named ? words[0] : "p" + (pairs.length + 1), a: numbers[0], b: numbers.length > 1 ? numbers[1] : null});
    });
    return pairs;
}

async function load(file) {
    try {
        const pairs = parseMarkers(await file.text());
        remember();
        marking.pairs = pairs;
        marking.open = nextOpen(0);
        tell("");
    } catch (error) {
        tell(`'${file.name}' is no file of markers: ${error.message}`);
    }
    changed();
}

/* ---- what is shown ---- */

const colourAt = (x) => "#" + facts.map.slice(6 * Math.round(64 * Math.max(0, Math.min(1, x))), 6 * Math.round(64 * Math.max(0, Math.min(1, x))) + 6);
const percent = (x) => `${(100 * x).toFixed(1)} %`;

function changed() {
    marking.fit = fitPairs(marking.pairs.filter(whole));
    marking.suggested = suggest(openPair());
    showRows();
    if (marking.leftOver) colourLeftOver();
    const root = document.documentElement.dataset;
    root.pairs = marking.pairs.map((p) => `${p.name}:${p.a ?? ""}:${p.b ?? ""}`).join(" ");
    root.suggested = marking.suggested ? `${marking.suggested.side}${marking.suggested.v}` : "";
    draw();
}

function rowOf(pair, i) {
    const row = document.createElement("li"), name = document.createElement("button"), drop = document.createElement("button");
    const error = marking.fit && marking.fit.leftOver.get(pair);
    name.type = drop.type = "button";
    name.className = "name";
    name.textContent = `${i + 1} ${pair.name}${error === undefined || error === null ? whole(pair) ? "" : " \u2026" : " " + percent(error)}`;
    name.title = `vertex ${pair.a ?? "?"}, vertex ${pair.b ?? "?"}`;
    name.setAttribute("aria-pressed", String(i === marking.open));
    name.style.borderLeftColor = error === undefined || error === null ? "gray" : colourAt(error / marking.fit.scale);
    name.addEventListener("click", () => selectPair(i));
    drop.textContent = "\u00d7";
    drop.setAttribute("aria-label", `Delete ${pair.name}`);
    drop.addEventListener("click", () => removePair(i));
    row.append(name, drop);
    return row;
}

function showRows() {
    const open = openPair(), n = marking.pairs.filter(whole).length;
    $("pair-list").replaceChildren(...marking.pairs.map(rowOf));
    const current = $("pair-list").children[marking.open];
    if (current) current.scrollIntoView({block: "nearest"});
    $("pair-hint").textContent = !open ? "Click a point of either mesh." :
        `${open.name}: click ${open.a === null ? "the left mesh" : open.b === null ? "the right mesh" : "either mesh to correct it"}` +
        (marking.suggested ? ", or Enter takes the suggestion." : ".");
    $("pair-fit").textContent = marking.fit ? `Left over: mean ${percent(marking.fit.mean)}, largest ${percent(marking.fit.most)} of the size.${marking.leftOver ? " Colours end at 5 %." : ""}` :
        `${n} of at least 3 pairs.`;
    $("pair-undo").disabled = !marking.past.length;
    $("pair-save").disabled = !n;
    $("pair-mirror").disabled = !n;
    $("pair-accept").disabled = !marking.suggested;
    $("pair-colours").disabled = !marking.fit;
}

/* A mark turns pale when its surface looks away. */
function placeMark(panel, side, v, text, look) {
    const p = placeNow(panel.s, v), at = onCanvas(panel, p), n = normalOf(panel.s, v);
    if (!at || at[0] < panel.x || at[0] > panel.x + panel.w) return null;
    const mark = document.createElement("span");
    mark.textContent = text;
    mark.className = look.kind;
    mark.dataset.vertex = v;
    mark.style.transform = `translate(${at[0]}px, ${at[1]}px)`;
    mark.style.setProperty("--ink", look.colour);
    if (dot(n, panel.cam.eye.map((x, k) => x - p[k])) < 0) mark.classList.add("behind");
    return mark;
}

function showMarks() {
    const marks = [];
    for (const panel of drawn) {
        const side = SIDES[panel.s.number];
        marking.pairs.forEach((pair, i) => {
            if (pair[side] === null) return;
            const error = marking.fit && marking.fit.leftOver.get(pair);
            marks.push(placeMark(panel, side, pair[side], String(i + 1), {
                kind: i === marking.open ? "mark open" : "mark",
                colour: error === undefined || error === null ? "gray" : colourAt(error / marking.fit.scale)}));
        });
        if (marking.suggested && marking.suggested.side === side)
            marks.push(placeMark(panel, side, marking.suggested.v, "?", {kind: "mark suggested", colour: "transparent"}));
    }
    $("marks").replaceChildren(...marks.filter((m) => m));
}

/* ---- the panel ---- */

function button(id, text, help, click) {
    const b = document.createElement("button");
    b.type = "button", b.id = id, b.textContent = text, b.title = help;
    b.addEventListener("click", click);
    return b;
}

function buildPanel() {
    const aside = document.createElement("aside"), bar = document.createElement("p"), file = document.createElement("input");
    file.type = "file", file.id = "pair-file", file.hidden = true;
    file.addEventListener("change", () => { if (file.files.length) load(file.files[0]); file.value = ""; });
    bar.append(button("pair-undo", "Undo", "Ctrl+Z", undo), button("pair-accept", "Accept", "Enter: take the suggested point", accept),
        button("pair-mirror", "Mirror", "add the pairs across x", mirror),
        button("pair-colours", "Left over", "colour the right mesh by its distance from the fitted left mesh", toggleLeftOver),
        button("pair-load", "Load", "a file of markers, or names and vertices of the left mesh", () => file.click()),
        button("pair-save", "Save", "a file of markers for vg-register", () => offer(new Blob([markersText()], {type: "text/plain"}), "markers.txt")), file);
    const line = (id) => Object.assign(document.createElement("p"), {id});
    const marks = Object.assign(document.createElement("div"), {id: "marks"}), list = Object.assign(document.createElement("ol"), {id: "pair-list"});
    aside.id = "pairs";
    aside.setAttribute("aria-label", "Pairs");
    aside.append(bar, line("pair-hint"), line("pair-fit"), list);
    $("stage").append(marks, aside);
    $("stage").classList.add("picking");
}

function onPairKey(event) {
    if (event.target.closest("input, select, dialog")) return;
    if ((event.ctrlKey || event.metaKey) && event.key === "z") undo();
    else if (event.key === "Enter" && marking.suggested && event.target.tagName !== "BUTTON") accept();
    else if (event.key === "Delete" && openPair()) removePair(marking.open);
    else return;
    event.preventDefault();
    event.stopPropagation();
}

onClick = (x, y) => {
    const found = pickAt(x, y);
    if (found && found.v !== undefined) put(SIDES[found.s.number], found.v);
};
afterDraw = showMarks;
beforeListening = () => {
    buildPanel();
    document.addEventListener("keydown", onPairKey, true);
};
whenThere = () => {
    for (const side of SIDES) {
        const s = sequences[SIDES.indexOf(side)], {xyz} = s.slots[0];
        let low = Infinity, high = -Infinity;
        for (const c of s.corners) low = Math.min(low, xyz[4 * c]), high = Math.max(high, xyz[4 * c]);
        mid[side] = (low + high) / 2;
    }
    changed();
};
