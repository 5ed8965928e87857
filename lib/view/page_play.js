/* page_play.js: the last part of the player: texts, playing, keys, mouse and touch, saving; it starts the page.
 * Leaves out drawing (page_draw.js) and picking (page_pick.js).
 * SPDX-License-Identifier: GPL-3.0-or-later */

/* ---- texts ---- */

const short = (x) => x === 0 ? "0" : x.toExponential(x < 1e-3 || x >= 1e3 ? 2 : 0).includes("e+0") ? String(+x.toPrecision(3)) :
    x < 1e-3 || x >= 1e3 ? x.toExponential(2) : String(+x.toPrecision(3));

/* A number that colours show, as people read it: scales are factors. */
const amount = (x) => x < 0 ? `\u2212${short(-x)}` : TINT.kind === "scales" ? `${short(x)}\u00d7` : short(x);
const unit = () => TINT.unit ? ` ${TINT.unit}` : "";

function longest() {
    return sequences.reduce((a, b) => b.frames > a.frames ? b : a);
}

function showCaptions() {
    const list = panels(), at = $("captions");
    while (at.children.length > list.length) at.lastChild.remove();
    list.forEach(({s, x, y, w, cut}, i) => {
        let caption = at.children[i];
        if (!caption) {
            caption = document.createElement("div");
            caption.className = "caption";
            caption.append(document.createElement("b"), document.createElement("span"));
            at.append(caption);
        }
        const f = Math.min(state.frame, s.frames - 1), {means, minima, maxima, names} = s.about;
        const right = state.layout === "wipe" && cut[0] > 0, under = state.layout === "overlay" ? 40 * i : 0;
        caption.style.left = x + "px", caption.style.top = y + under + "px", caption.style.width = w + "px";
        caption.style.textAlign = right ? "right" : "left";
        caption.children[0].textContent = list.length > 1 || sequences.length > 1 ? s.about.label : "";
        caption.children[1].textContent = !means ? sequences.length > 1 ? names[f] : "" :
            TINT.diverging ? `${amount(minima[f])} to ${amount(maxima[f])}, mean ${amount(means[f])}` :
                `mean ${TINT.kind === "errors" ? "error " : ""}${amount(means[f])}${unit()}, max ${amount(maxima[f])}${unit()}`;
    });
}

function showFrame() {
    const s = longest(), f = Math.min(state.frame, s.frames - 1), name = sequences[0].about.names[Math.min(state.frame, sequences[0].frames - 1)];
    const time = s.about.times ? `, ${s.about.times[f].toFixed(3)} s` : "", text = `${state.frame + 1} / ${frames}: ${name}${time}`;
    $("frame").textContent = text;
    $("scrub").value = state.frame;
    $("scrub").setAttribute("aria-valuetext", text);
    canvas.setAttribute("aria-label", `${facts.title}: frame ${text}, seen from ${Math.round(state.azimuth)} degrees around and ${Math.round(state.elevation)} up`);
    document.documentElement.dataset.frame = String(state.frame);
    showCaptions();
    rememberView();
}

/* The colours of the patches, as far as a legend helps. */
function showPatchColours(list) {
    const most = Math.max(...list.map((s) => s.about.patches)), box = $("legend-patches");
    box.textContent = "";
    for (let i = 0; i < Math.min(most, 48); i++) {
        const item = document.createElement("span");
        item.style.setProperty("--colour", `rgb(${patchColour(i).map(Math.round).join(",")})`);
        item.textContent = i;
        box.append(item);
    }
    if (most > 48) box.append(`\u2026 ${most - 1}`);
}

function showControls() {
    const press = (id, on) => $(id).setAttribute("aria-pressed", String(Boolean(on)));
    press("play", state.playing);
    $("play").textContent = state.playing ? "Pause" : "Play";
    press("edges", state.wire > 0);
    $("edges").textContent = ["Wireframe", "Wireframe: over", "Wireframe: alone"][state.wire];
    press("ground", state.ground);
    press("follow", state.follow);
    press("joints", state.joints);
    $("joints").hidden = !sequences.some((s) => s.rig);
    $("layout").value = state.layout;
    $("layout-label").hidden = shownSequences().length < 2;
    $("wipe").hidden = state.layout !== "wipe" || shownSequences().length < 2;
    $("wipe").style.left = 100 * state.wipe + "%";
    $("wipe").setAttribute("aria-valuenow", String(Math.round(100 * state.wipe)));
    $("colour").value = state.colour;
    $("speed").value = String(state.speed);
    for (const button of $("shown").children) button.setAttribute("aria-pressed", String(state.shown[button.dataset.number]));
    const legend = TINT && state.colour === TINT.kind && state.wire < 2 && shownSequences().some((s) => s.numbers.length);
    const counts = state.colour === "patches" && state.wire < 2 ? shownSequences().filter((s) => s.patches).map((s) => s.about.patches) : [];
    $("legend").hidden = !legend && !counts.length;
    $("legend-bar").hidden = $("legend-numbers").hidden = !legend;
    $("legend-patches").hidden = legend || !counts.length;
    if (!legend && counts.length) showPatchColours(shownSequences().filter((s) => s.patches));
    const what = () => TINT.kind === "errors" ? `Distance from ${sequences[1].about.label}${facts.centred ? ", centred" : ""}, in D` : TINT.title;
    const spread = () => TINT.diverging ? `${amount(facts.least)} to ${amount(facts.max)}, mean ${amount(facts.mean)}` :
        `mean ${amount(facts.mean)}, max ${amount(facts.max)}`;
    $("legend-text").textContent = legend ? `${what()}. All frames: ${spread()}` : `${counts.join(" and ")} patches, a colour each`;
    document.documentElement.dataset.playing = String(state.playing);
    document.documentElement.dataset.shown = shownSequences().map((s) => s.number + 1).join(",");
}

function refresh() {
    showControls();
    showFrame();
    draw();
}

/* The errors of all frames as two lines over the slider. */
function showGraph() {
    const {means, minima, maxima} = sequences[0].about, svg = $("graph"), n = means ? means.length : 0;
    if (n < 2) return;
    const low = TINT.diverging ? minima.reduce((a, b) => Math.min(a, b)) : 0;
    const top = maxima.reduce((a, b) => Math.max(a, b), low), range = top - low || 1;
    const path = (list) => list.map((x, i) => `${i ? "L" : "M"}${(i / (n - 1) * 1000).toFixed(1)} ${(98 - 96 * (x - low) / range).toFixed(2)}`).join("");
    svg.setAttribute("viewBox", "0 0 1000 100");
    svg.setAttribute("aria-label", `${TINT.kind === "errors" ? "Errors" : TINT.title} of the frames: mean (blue) and largest (grey), up to ${amount(top)}${unit()}`);
    $("graph-mean").setAttribute("d", path(means));
    $("graph-max").setAttribute("d", path(maxima));
    svg.removeAttribute("hidden"); /* an SVG element has no property of this name */
}

function showAbout() {
    const first = sequences[0].about, plural = (n, what) => `${n} ${what}${n === 1 ? "" : "s"}`;
    document.title = facts.title;
    $("title").textContent = facts.title;
    $("about").textContent = `${plural(frames, "frame")}, ${plural(first.vertices, "vertex").replace("vertexs", "vertices")}, ${plural(first.faces, "face")}`;
    const lost = Math.max(...facts.sequences.map((s) => s.loss));
    $("made").textContent = `Positions are within ${short(lost)} D of the data (16 bits an axis; D: diagonal of the bounding box of the reference pose). Made by vg-view ${facts.version}.`;
    const made = facts.sequences.filter((s) => s.provenance.length);
    $("provenance").hidden = !made.length;
    for (const s of made) {
        const title = document.createElement("p");
        title.textContent = facts.sequences.length > 1 ? s.label : "";
        $("provenance").append(title, provenanceTree(s.provenance));
    }
    if (TINT) showLegendEnds();
}

/* A command line whose paths are shortened to their last parts. */
const shortened = (line) => line.split(" ").map((word) => word.replace(/^(?:[^=/]*=)?(?:[^/]*\/)+(?=[^/])/, (path) => /^[^/]*=/.test(path) ? path.match(/^[^=]*=/)[0] : "")).join(" ");

/* Which process read the output of which: the last one, and under each those before it. */
function provenanceTree(list) {
    const children = new Set(list.flatMap((p) => p.parents)), seen = new Set();
    const item = (i) => {
        const entry = document.createElement("li"), code = document.createElement("code");
        code.textContent = shortened(list[i].line);
        code.title = list[i].line;
        entry.append(code);
        if (list[i].parents.length && !seen.has(i)) entry.append(branch(list[i].parents));
        seen.add(i);
        return entry;
    };
    const branch = (numbers) => {
        const tree = document.createElement("ul");
        for (const i of numbers) tree.append(item(i));
        return tree;
    };
    return branch(list.map((_, i) => i).filter((i) => !children.has(i)));
}

/* The bar shows the colours that occur: one that has a middle keeps it, but ends where the numbers do. */
function showLegendEnds() {
    const colours = mapColours(), spread = TINT.high - TINT.low, scale = (x) => TINT.kind === "scales" ? Math.log2(x) : x;
    const low = TINT.diverging ? Math.max(TINT.low, Math.min(scale(facts.least), 0)) : TINT.low;
    const high = TINT.diverging ? Math.min(TINT.high, Math.max(scale(facts.max), 0)) : TINT.high;
    const colourAt = (x) => colours[Math.round((x - TINT.low) / spread * (colours.length - 1))];
    const stops = Array.from({length: 33}, (_, i) => colourAt(low + (high - low) * i / 32));
    $("legend-bar").style.background = `linear-gradient(to right, ${stops.join(",")})`;
    for (let i = 0; i <= 4; i++) {
        const number = document.createElement("span"), at = low + (high - low) * i / 4, shown = TINT.kind === "scales" ? 2 ** at : at;
        const beyond = i === 4 && scale(facts.max) > TINT.high ? "\u2265 " : i === 0 && scale(facts.least) < TINT.low ? "\u2264 " : "";
        number.textContent = beyond + amount(shown);
        $("legend-numbers").append(number);
    }
}

/* ---- playing ---- */

function timeOf(frame) {
    const {times} = longest().about;
    return times ? times[frame] - times[0] : frame / FRAMES_PER_SECOND;
}

function show(frame) {
    state.frame = Math.max(0, Math.min(frames - 1, Math.round(frame)));
    state.part = 0;
    showFrame();
    draw();
}

/* The frame at a time, and how far it is to the next one. */
function showTime(time) {
    let low = 0, high = frames - 1;
    while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (timeOf(middle) <= time + 1e-9) low = middle;
        else high = middle - 1;
    }
    const moved = low !== state.frame;
    state.frame = low;
    state.part = low < frames - 1 ? Math.max(0, Math.min(1, (time - timeOf(low)) / (timeOf(low + 1) - timeOf(low)))) : 0;
    if (moved) showFrame();
    draw();
}

function tick(now) {
    if (!state.playing) return;
    const gap = frames > 1 ? timeOf(frames - 1) / (frames - 1) : 1, length = timeOf(frames - 1) + gap;
    if (clock === null) clock = {now, time: timeOf(state.frame)};
    clock.time = (clock.time + Math.max(0, Math.min(now - clock.now, 1000)) / 1000 * state.speed) % length;
    clock.now = now;
    showTime(clock.time);
    requestAnimationFrame(tick);
}

function play(on) {
    state.playing = on && frames > 1;
    clock = null;
    showControls();
    rememberView();
    if (state.playing) requestAnimationFrame(tick);
}

function step(by) {
    play(false);
    show((state.frame + by + frames) % frames);
}

function setSpeed(by) {
    const at = Math.max(0, Math.min(SPEEDS.length - 1, SPEEDS.indexOf(state.speed) + by));
    state.speed = SPEEDS[at];
    showControls();
}

function toggle(number) {
    state.shown[number] = !state.shown[number];
    if (!state.shown.some((x) => x)) state.shown[number] = true; /* one stays */
    refresh();
}

function nextLayout() {
    const all = ["beside", "overlay", "wipe"];
    state.layout = all[(all.indexOf(state.layout) + 1) % all.length];
    refresh();
}

function nextColour() {
    const options = [...$("colour").options].map((o) => o.value);
    state.colour = options[(options.indexOf(state.colour) + 1) % options.length];
    refresh();
}

function resetView() {
    Object.assign(state, {azimuth: facts.azimuth, elevation: facts.elevation, zoom: facts.zoom, shift: [0, 0]});
    refresh();
}

function turn(azimuth, elevation) {
    state.azimuth = ((state.azimuth + azimuth + 540) % 360) - 180;
    state.elevation = Math.max(-90, Math.min(90, state.elevation + elevation));
    showFrame();
    draw();
}

function zoom(factor) {
    state.zoom = Math.max(0.1, Math.min(200, state.zoom * factor));
    draw();
}

function move(dx, dy) {
    const {s, w, h} = panels()[0], cam = camera(w / h, s, shownSequences()), unit = 2 * cam.distance * cam.tangent / h;
    state.shift[0] += dx * unit, state.shift[1] -= dy * unit;
    draw();
}

/* ---- saving ---- */

function offer(blob, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const fileName = (ending) => facts.title.replace(/[^\p{L}\p{N}._-]+/gu, "-") + ending;

function savePicture() {
    render();
    canvas.toBlob((blob) => blob && offer(blob, fileName(`-${state.frame + 1}.png`)));
}

/* Record the sequence once, from its first frame to its last one, as the browser draws it. */
function saveAnimation() {
    const kind = ["video/webm;codecs=vp9", "video/webm"].find((k) => window.MediaRecorder && canvas.captureStream && MediaRecorder.isTypeSupported(k));
    if (!kind) return tell("This browser cannot record animations.");
    const recorder = new MediaRecorder(canvas.captureStream(30), {mimeType: kind, videoBitsPerSecond: 8e6}), parts = [];
    recorder.addEventListener("dataavailable", (event) => parts.push(event.data));
    recorder.addEventListener("stop", () => {
        offer(new Blob(parts, {type: "video/webm"}), fileName(".webm"));
        document.documentElement.dataset.recorded = String(parts.reduce((n, p) => n + p.size, 0));
        play(false);
    });
    play(false);
    show(0);
    recorder.start();
    play(true);
    const whole = (timeOf(frames - 1) / state.speed + 0.05) * 1000;
    setTimeout(() => recorder.stop(), Math.max(whole, 200));
}

function fullScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else if ($("stage").requestFullscreen) $("stage").requestFullscreen();
}

/* The address says what is seen, so that it can be passed on. */
let remembering = 0;
function rememberView() {
    clearTimeout(remembering);
    remembering = setTimeout(() => {
        const hash = new URLSearchParams({view: `${Math.round(state.azimuth)},${Math.round(state.elevation)}`, play: state.playing ? 1 : 0});
        if (!state.playing) hash.set("frame", state.frame);
        if (state.zoom !== facts.zoom) hash.set("zoom", state.zoom.toPrecision(3));
        if (sequences.length > 1 && state.shown.includes(false)) hash.set("show", shownSequences().map((s) => s.number + 1).join(","));
        if (state.layout !== "beside") hash.set("layout", state.layout);
        if (state.colour !== initialColour()) hash.set("colour", state.colour);
        if (state.wire) hash.set("edges", state.wire);
        history.replaceState(null, "", "#" + hash.toString().replace(/%2C/g, ","));
    }, 300);
}

/* ---- input ---- */

const keys = {
    " ": () => play(!state.playing),
    arrowleft: (e) => step(e.shiftKey ? -10 : -1),
    arrowright: (e) => step(e.shiftKey ? 10 : 1),
    home: () => { play(false); show(0); },
    end: () => { play(false); show(frames - 1); },
    "<": () => setSpeed(-1), ",": () => setSpeed(-1), ">": () => setSpeed(1), ".": () => setSpeed(1),
    w: () => { state.wire = (state.wire + 1) % 3; refresh(); },
    c: nextColour,
    g: () => { state.ground = !state.ground; refresh(); },
    f: () => { state.follow = !state.follow; refresh(); },
    r: resetView,
    l: nextLayout,
    j: () => { state.joints = !state.joints; refresh(); },
    p: savePicture,
    m: saveAnimation,
    enter: fullScreen,
    escape: () => { pinned = null; refresh(); },
    0: () => { state.shown.fill(true); refresh(); },
    a: () => turn(10, 0), d: () => turn(-10, 0), s: () => turn(0, 10), x: () => turn(0, -10),
    "+": () => zoom(1.2), "=": () => zoom(1.2), "-": () => zoom(1 / 1.2),
    "?": () => $("help").showModal(),
};

function onKey(event) {
    const key = event.key.toLowerCase(), {target} = event;
    if (event.ctrlKey || event.metaKey || event.altKey || $("help").open || target.tagName === "SELECT") return;
    if (["BUTTON", "SUMMARY"].includes(target.tagName) && (key === " " || key === "enter")) return; /* presses it */
    if (target.id === "wipe" && key.startsWith("arrow")) return;
    const number = /^[1-9]$/.test(key) ? +key - 1 : -1;
    if (number >= 0 && number < sequences.length && sequences.length > 1) toggle(number);
    else if (keys[key]) keys[key](event);
    else return;
    event.preventDefault();
}

function listenToWipe() {
    const move = (share) => { state.wipe = Math.max(0, Math.min(1, share)); showControls(); draw(); };
    $("wipe").addEventListener("pointerdown", (event) => { $("wipe").setPointerCapture(event.pointerId); event.preventDefault(); $("wipe").focus(); });
    $("wipe").addEventListener("pointermove", (event) => { if (event.buttons) move(placeOf(event)[0] / canvas.clientWidth); });
    $("wipe").addEventListener("keydown", (event) => {
        const by = {ArrowLeft: -0.02, ArrowRight: 0.02}[event.key];
        if (by) move(state.wipe + by), event.preventDefault();
    });
}

/* Where an event is on the canvas. */
function placeOf(event) {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
}

function listenToPointers() {
    const down = new Map();
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        canvas.classList.add("moving");
        down.set(event.pointerId, {x: event.clientX, y: event.clientY, x0: event.clientX, y0: event.clientY});
    });
    for (const name of ["pointerup", "pointercancel"])
        canvas.addEventListener(name, (event) => {
            const start = down.get(event.pointerId), [x, y] = placeOf(event);
            if (name === "pointerup" && start && down.size === 1 && Math.hypot(event.clientX - start.x0, event.clientY - start.y0) < 4) onClick(x, y);
            down.delete(event.pointerId);
            if (!down.size) canvas.classList.remove("moving");
        });
    canvas.addEventListener("pointermove", (event) => {
        const before = down.get(event.pointerId);
        if (!before) {
            if (event.pointerType === "mouse") hover(...placeOf(event));
            return;
        }
        const dx = event.clientX - before.x, dy = event.clientY - before.y, points = [...down.values()];
        if (down.size > 1) { /* half of the way of each finger, and the change of their distance */
            const other = points.find((p) => p !== before), was = Math.hypot(before.x - other.x, before.y - other.y);
            move(dx / 2, dy / 2);
            if (was > 10) zoom(Math.hypot(event.clientX - other.x, event.clientY - other.y) / was);
        } else if (event.shiftKey || event.buttons & 6) {
            move(dx, dy);
        } else {
            turn(-0.4 * dx, 0.4 * dy);
        }
        before.x = event.clientX, before.y = event.clientY;
    });
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
    }, {passive: false});
    canvas.addEventListener("pointerleave", () => { hovered = null; showPicked(); });
    canvas.addEventListener("dblclick", resetView);
}

function option(select, value, text) {
    select.add(new Option(text, value));
}

function listen() {
    for (const x of SPEEDS) option($("speed"), String(x), x + "\u00d7");
    option($("colour"), "plain", "plain");
    if (TINT) option($("colour"), TINT.kind, TINT.kind === "scalars" ? TINT.title.split(" in units")[0] : TINT.kind);
    if (sequences.some((s) => s.patches)) option($("colour"), "patches", "patches");
    if (sequences.some((s) => s.materials)) option($("colour"), "materials", "materials");
    $("colour-label").hidden = $("colour").options.length < 2;
    sequences.forEach((s, i) => {
        if (sequences.length < 2) return;
        const button = document.createElement("button");
        button.type = "button";
        button.textContent = s.about.label;
        button.dataset.number = i;
        button.setAttribute("aria-keyshortcuts", String(i + 1));
        button.addEventListener("click", () => toggle(i));
        $("shown").append(button);
    });
    $("colour").addEventListener("change", () => { state.colour = $("colour").value; refresh(); });
    $("speed").addEventListener("change", () => { state.speed = +$("speed").value; });
    $("scrub").addEventListener("input", () => { play(false); show(+$("scrub").value); });
    for (const [value, text] of [["beside", "side by side"], ["overlay", "one over another"], ["wipe", "wipe"]]) option($("layout"), value, text);
    $("layout").addEventListener("change", () => { state.layout = $("layout").value; refresh(); });
    const clicks = {joints: keys.j, picture: savePicture, animation: saveAnimation, full: fullScreen, back: () => step(-1), forth: () => step(1), play: keys[" "], edges: keys.w, ground: keys.g, follow: keys.f, reset: resetView, "help-button": keys["?"]};
    for (const id of Object.keys(clicks)) $(id).addEventListener("click", clicks[id]);
    document.addEventListener("keydown", onKey);
    listenToPointers();
    listenToWipe();
    new ResizeObserver(() => { showCaptions(); draw(); }).observe(canvas);
    dark.addEventListener("change", draw);
    window.addEventListener("hashchange", readHash);
}

function readHash() {
    const hash = new URLSearchParams(location.hash.slice(1)), view = (hash.get("view") || "").split(",").map(Number);
    if (view.length === 2 && view.every(Number.isFinite)) state.azimuth = view[0], state.elevation = Math.max(-90, Math.min(90, view[1]));
    if (hash.has("show")) {
        const list = hash.get("show").split(",").map(Number), shown = state.shown.map((_, i) => list.includes(i + 1));
        if (shown.some((x) => x)) state.shown = shown;
    }
    if ([...$("colour").options].some((o) => o.value === hash.get("colour"))) state.colour = hash.get("colour");
    if (["beside", "overlay", "wipe"].includes(hash.get("layout"))) state.layout = hash.get("layout");
    if (+hash.get("zoom") > 0) state.zoom = Math.max(0.1, Math.min(200, +hash.get("zoom")));
    if (hash.has("edges")) state.wire = Math.max(0, Math.min(2, Math.floor(+hash.get("edges")) || 0));
    if (hash.has("frame")) state.frame = Math.max(0, Math.min(frames - 1, Math.floor(+hash.get("frame")) || 0)), state.part = 0;
    refresh();
    if (hash.has("play")) play(hash.get("play") !== "0");
}

const initialColour = () => TINT ? TINT.kind : sequences.some((s) => s.patches) ? "patches" : sequences.some((s) => s.materials) ? "materials" : "plain";

/* A page opens playing, unless its address names a frame, or the reader prefers that nothing moves. */
function playsAtFirst() {
    const hash = new URLSearchParams(location.hash.slice(1));
    return !hash.has("play") && !hash.has("frame") && !window.matchMedia("(prefers-reduced-motion: reduce)").matches;
}

async function main() {
    tell("Loading ...");
    if (!window.DecompressionStream) throw new Error("this browser is too old: it has no DecompressionStream");
    startGl();
    for (let i = 0; i < facts.sequences.length; i++) {
        sequences.push(await makeSequence(i));
        prepare(sequences[i]);
    }
    frames = longest().frames;
    $("scrub").max = frames - 1;
    state.colour = initialColour();
    if (!facts.fit) state.follow = goesFar();
    if (beforeListening) beforeListening();
    listen();
    showAbout();
    showGraph();
    readHash();
    await Promise.all(sequences.flatMap((s) => [[s.places, 3], [s.numbers, 1]].filter(([list]) => list.length)
        .map(([list, width]) => need(chunkOf(list, Math.min(state.frame, s.frames - 1)), s.nv, width))));
    tell("");
    if (whenThere) sequences.forEach((s) => take(s)), whenThere();
    draw();
    if (playsAtFirst()) play(true);
    for (const s of sequences) /* the others, one after the other, so that the page answers meanwhile */
        for (const [list, width] of [[s.places, 3], [s.numbers, 1]])
            for (const chunk of list) await need(chunk, s.nv, width);
    document.documentElement.dataset.whole = "true";
}
main().catch((error) => tell("This page does not work here: " + error.message));
})();
