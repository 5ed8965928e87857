/* signal_play.js: the last part of the page of a signal: playing, buttons, keys, files; it starts the page.
 * SPDX-License-Identifier: GPL-3.0-or-later */

const short = (x) => String(+x.toPrecision(3));
const say = (text) => { $("status").textContent = text; };

/* ---- what is shown ---- */

function showTime() {
    const old = oldTime(time), at = Math.max(0, Math.min(base.n - 1, Math.floor(old + 1e-9) - 1)), rest = old - 1 - at;
    const text = `${time.toFixed(2)} of ${+lastTime().toFixed(2)}: ${facts.sequences[0].names[at]}${rest > 1e-6 ? " + " + rest.toFixed(2) : ""}`;
    state.frame = at;
    $("frame").textContent = text;
    $("scrub").min = firstTime(), $("scrub").max = lastTime(), $("scrub").value = time;
    $("scrub").setAttribute("aria-valuetext", text);
    canvas.setAttribute("aria-label", `${facts.title}: time ${text}`);
    document.documentElement.dataset.time = String(time);
    document.documentElement.dataset.frame = String(at);
}

function showEverything() {
    const press = (id, on) => $(id).setAttribute("aria-pressed", String(Boolean(on)));
    showTime();
    showPlane();
    showStrip();
    tellChanges();
    drawPose();
    for (const name of ["edit", "explore", "draw"]) press("tool-" + name, tool === name);
    $("undo").disabled = !past.length;
    $("redo").disabled = !future.length;
    $("reset-edits").disabled = !edits.ops.length && !edits.retime.length && !edits.sketch;
    $("save-curve").hidden = $("drop-curve").hidden = !edits.sketch;
    $("remove-point").disabled = !(chosen && chosen.kind === "control" && removable(now.curve, chosen.i));
    $("add-point").disabled = Boolean(now.sketch);
    press("pin", pinnedFrames.has(shownFrame()));
    press("site", now.site.includes(shownFrame()));
    press("edges", state.wire > 0);
    press("ground", state.ground);
    press("follow", state.follow);
    document.documentElement.dataset.edits = String(edits.ops.length + edits.retime.length);
}

function setTime(t) {
    time = Math.max(firstTime(), Math.min(lastTime(), t));
    exploring = null;
    $("outside").hidden = true;
    showTime();
    showHead();
    showStripHead();
    drawPose();
}

/* ---- playing ---- */

function framesPerSecond() {
    const {times, names} = facts.sequences[0], all = times ? times[times.length - 1] - times[0] : 0;
    return all > 0 ? (names.length - 1) / all : FRAMES_PER_SECOND;
}

function tick(moment) {
    if (!state.playing) return;
    if (clock !== null) {
        const length = lastTime() - firstTime() + 1, gone = time - firstTime() + Math.min(moment - clock, 1000) / 1000 * state.speed * framesPerSecond();
        time = firstTime() + Math.min(gone % length, lastTime() - firstTime());
        showTime();
        showHead();
        showStripHead();
        drawPose();
    }
    clock = moment;
    requestAnimationFrame(tick);
}

function play(on) {
    state.playing = on && base.n > 1;
    clock = null;
    $("play").setAttribute("aria-pressed", String(state.playing));
    $("play").textContent = state.playing ? "Pause" : "Play";
    document.documentElement.dataset.playing = String(state.playing);
    if (state.playing) explore(null), requestAnimationFrame(tick);
}

function step(by) {
    play(false);
    setTime(by > 0 ? Math.floor(time + 1e-9) + by : Math.ceil(time - 1e-9) + by);
}

/* ---- files ---- */

function offer(text, ending) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], {type: "text/plain"}));
    link.download = facts.title.replace(/\.[a-z]+$/i, "").replace(/[^\p{L}\p{N}._-]+/gu, "-") + ending;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

async function loadFile(file) {
    const wrong = loadText(await file.text());
    if (wrong) say(`${file.name}: ${wrong}. Nothing is changed.`);
    $("file").value = "";
}

/* ---- input ---- */

function useTool(name) {
    tool = name;
    explore(null);
    showEverything();
}

function turn(azimuth, elevation) {
    state.azimuth = ((state.azimuth + azimuth + 540) % 360) - 180;
    state.elevation = Math.max(-90, Math.min(90, state.elevation + elevation));
    draw();
}

function zoom(factor) {
    state.zoom = Math.max(0.1, Math.min(200, state.zoom * factor));
    draw();
}

function move(dx, dy) {
    const cam = camera(canvas.clientWidth / canvas.clientHeight, body, [body]), unit = 2 * cam.distance * cam.tangent / canvas.clientHeight;
    state.shift[0] += dx * unit, state.shift[1] -= dy * unit;
    draw();
}

function resetView() {
    Object.assign(state, {azimuth: facts.azimuth, elevation: facts.elevation, zoom: facts.zoom, shift: [0, 0]});
    later();
    draw();
}

const keys = {
    " ": () => play(!state.playing), arrowleft: () => step(-1), arrowright: () => step(1), home: () => setTime(firstTime()), end: () => setTime(lastTime()),
    v: () => useTool("edit"), e: () => useTool("explore"), d: () => useTool("draw"), 0: showWholePlane, r: resetView,
    w: () => { state.wire = (state.wire + 1) % 3; showEverything(); }, g: () => { state.ground = !state.ground; showEverything(); },
    f: () => { state.follow = !state.follow; showEverything(); }, "?": () => $("help").showModal(),
    escape: () => { pinned = null; choose(null); }, ...planeKeys,
};

function onKey(event) {
    const key = event.key.toLowerCase(), {target} = event;
    if ($("help").open || target.tagName === "SELECT" || event.altKey) return;
    if (event.ctrlKey || event.metaKey) {
        if (key === "z" && !event.shiftKey) undo();
        else if (key === "y" || key === "z") redo();
        else return;
    } else if (["BUTTON", "SUMMARY"].includes(target.tagName) && (key === " " || key === "enter")) return;
    else if (target.tagName === "INPUT" && /^(arrow|home|end|page)/.test(key)) return;
    else if (keys[key]) keys[key]();
    else return;
    event.preventDefault();
}

function placeOf(event) {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
}

function listenToCanvas() {
    const down = new Map();
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        down.set(event.pointerId, {x: event.clientX, y: event.clientY, moved: 0});
    });
    for (const name of ["pointerup", "pointercancel"])
        canvas.addEventListener(name, (event) => {
            const start = down.get(event.pointerId);
            if (name === "pointerup" && start && down.size === 1 && start.moved < 4) pin(...placeOf(event));
            else later();
            down.delete(event.pointerId);
        });
    canvas.addEventListener("pointermove", (event) => {
        const before = down.get(event.pointerId);
        if (!before) return event.pointerType === "mouse" && hover(...placeOf(event));
        const dx = event.clientX - before.x, dy = event.clientY - before.y;
        before.moved += Math.hypot(dx, dy);
        if (down.size > 1) {
            const other = [...down.values()].find((p) => p !== before), was = Math.hypot(before.x - other.x, before.y - other.y);
            move(dx / 2, dy / 2);
            if (was > 10) zoom(Math.hypot(event.clientX - other.x, event.clientY - other.y) / was);
        } else if (event.shiftKey || event.buttons & 6) move(dx, dy);
        else turn(-0.4 * dx, 0.4 * dy);
        before.x = event.clientX, before.y = event.clientY;
    });
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
    }, {passive: false});
    canvas.addEventListener("pointerleave", () => { hovered = null; showPicked(); });
    canvas.addEventListener("dblclick", resetView);
    new ResizeObserver(draw).observe(canvas);
}

function listen() {
    for (const x of SPEEDS) $("speed").add(new Option(x + "\u00d7", String(x), x === 1, x === 1));
    $("speed").addEventListener("change", () => { state.speed = +$("speed").value; });
    $("scrub").addEventListener("input", () => { play(false); setTime(+$("scrub").value); });
    const clicks = {"tool-edit": keys.v, "tool-explore": keys.e, "tool-draw": keys.d, undo, redo, "reset-edits": resetEdits,
                    save: () => offer(editText(), ".edits.txt"), "save-curve": () => offer(curveText(), ".curve.txt"), load: () => $("file").click(),
                    pose: () => offer(objText(), ".obj"), edges: keys.w, ground: keys.g, follow: keys.f, reset: resetView, "help-button": keys["?"],
                    back: () => step(-1), forth: () => step(1), play: keys[" "]};
    for (const id of Object.keys(clicks)) $(id).addEventListener("click", clicks[id]);
    $("file").addEventListener("change", () => $("file").files[0] && loadFile($("file").files[0]));
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => { event.preventDefault(); if (event.dataTransfer.files[0]) loadFile(event.dataTransfer.files[0]); });
    document.addEventListener("keydown", onKey);
    listenToPlane();
    listenToStrip();
    listenToCanvas();
    dark.addEventListener("change", () => { draw(); later(); });
}

function showAbout() {
    document.title = facts.title;
    $("title").textContent = facts.title;
    $("about").textContent = `${base.n} frames as ${base.m} coordinates, ${base.site.length} sites, ${base.curve.k} control points; ${base.nv} vertices`;
    $("made").textContent = `D: diagonal of the bounding box of the reference pose. Made by vg-view ${facts.version}.`;
    $("key-bar").style.background = `linear-gradient(to right, ${mapColours().join(",")})`;
}

async function main() {
    tell("Loading ...");
    if (!window.DecompressionStream) throw new Error("this browser is too old: it has no DecompressionStream");
    startGl();
    await readSignal();
    body = await makeSequence(0);
    body.live = live;
    sequences.push(body);
    prepare(body);
    frames = base.n;
    if (!facts.fit) state.follow = goesFar();
    listen();
    showAbout();
    changed(true);
    showWholePlane();
    tell("");
    const hash = new URLSearchParams(location.hash.slice(1));
    if (+hash.get("time") > 0) setTime(+hash.get("time"));
    else if (!window.matchMedia("(prefers-reduced-motion: reduce)").matches && hash.get("play") !== "0") play(true);
    document.documentElement.dataset.whole = "true";
}
main().catch((error) => tell("This page does not work here: " + error.message));
})();
