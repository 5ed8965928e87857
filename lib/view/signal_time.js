/* signal_time.js: the speed curve: which old time is shown at which new one, and which frames have changed.
 * SPDX-License-Identifier: GPL-3.0-or-later */

const strip = $("speed-curve");
let chosenTime = -1, dragTime = -1, timeMoved = false;
let onStrip = null; /* what the playhead needs of the strip: scales, speeds, its line and text */
const PAD = 30;

/* The pairs of times; without a retiming, those that leave everything as it is. */
const pairsNow = () => edits.retime.length ? edits.retime : [[1, 1], [base.n, base.n]];

function stripScale() {
    const pairs = pairsNow(), w = strip.clientWidth - 2 * PAD, h = strip.clientHeight - 16, first = pairs[0][1], last = pairs[pairs.length - 1][1], width = last - first || 1;
    return {first, last, toX: (t) => PAD + (t - first) / width * w, toY: (old) => 8 + (1 - (old - 1) / (base.n - 1 || 1)) * h,
            toTime: (x) => first + (x - PAD) / w * width, toOld: (y) => 1 + (1 - (y - 8) / h) * (base.n - 1)};
}

function showStrip() {
    const {first, last, toX, toY} = stripScale(), steps = 120, points = Array.from({length: steps + 1}, (_, i) => first + (last - first) * i / steps);
    const bottom = strip.clientHeight - 4, speed = points.slice(1).map((t, i) => (oldTime(t) - oldTime(points[i])) / (t - points[i])), top = Math.max(2, ...speed);
    strip.textContent = "";
    element("path", {class: "fast", d: `M${toX(first)} ${bottom}` + speed.map((v, i) => `L${toX(points[i])} ${bottom - v / top * (bottom - 8)}L${toX(points[i + 1])} ${bottom - v / top * (bottom - 8)}`).join("") + `L${toX(last)} ${bottom}Z`}, strip);
    element("line", {class: "even", x1: toX(first), y1: toY(1), x2: toX(last), y2: toY(base.n)}, strip);
    const most = change ? change.reduce((a, b) => Math.max(a, b), 0) : 0;
    for (let i = 0; change && most > 1e-7 && i < base.n; i++) {
        if (change[i] <= 1e-7) continue;
        const x = toX(newTime(i + 1)), h = 2 + 14 * change[i] / most;
        element("rect", {class: "change", x: x - 1.5, y: bottom - h, width: 3, height: h}, strip);
    }
    element("path", {class: "map", d: points.map((t, i) => `${i ? "L" : "M"}${toX(t).toFixed(1)} ${toY(oldTime(t)).toFixed(1)}`).join("")}, strip);
    pairsNow().forEach(([old, t], i) => element("circle", {class: i === chosenTime ? "time chosen" : "time", cx: toX(t), cy: toY(old), r: i === chosenTime ? 7 : 5}, strip));
    onStrip = {first, last, toX, speed, line: element("line", {class: "head", y1: 2, y2: bottom}, strip), text: element("text", {x: PAD + 4, y: 12}, strip)};
    showStripHead();
}

/* The playhead alone: the rest of the strip stays while the time goes. */
function showStripHead() {
    const {first, last, toX, speed, line, text} = onStrip, x = toX(time);
    const here = speed[Math.max(0, Math.min(speed.length - 1, Math.floor((time - first) / (last - first || 1) * speed.length)))];
    line.setAttribute("x1", x);
    line.setAttribute("x2", x);
    text.textContent = `speed here ${short(here)}\u00d7${now.retime ? "" : "; two clicks add a time"}`;
}

/* The first new time at which an old one is reached. */
function newTime(old) {
    let low = firstTime(), high = lastTime();
    for (let step = 0; step < 30; step++) {
        const middle = (low + high) / 2;
        if (oldTime(middle) < old) low = middle;
        else high = middle;
    }
    return high;
}

/* Move pair i; both times keep rising. */
function movePair(i, old, t) {
    const pairs = pairsNow().map((p) => [...p]), before = pairs[i - 1], after = pairs[i + 1], gap = 0.05;
    const t2 = i === 0 ? pairs[0][1] : Math.max(before[1] + gap, after ? Math.min(after[1] - gap, t) : t);
    pairs[i] = [Math.max(before ? before[0] : 1, Math.min(after ? after[0] : base.n, old)), t2].map((x) => +x.toPrecision(8));
    edits = {...edits, retime: pairs};
}

function addTime(t) {
    if (!(t > firstTime() && t < lastTime())) return;
    const pairs = [...pairsNow(), [+oldTime(t).toPrecision(8), +t.toPrecision(8)]].sort((a, b) => a[1] - b[1]);
    remember();
    edits = {...edits, retime: pairs};
    chosenTime = pairs.findIndex((p) => p[1] === +t.toPrecision(8));
    changed(true);
}

function removeTime() {
    const pairs = pairsNow();
    if (chosenTime < 1 || chosenTime > pairs.length - 2) return say("The first and the last time stay.");
    remember();
    const left = pairs.filter((_, i) => i !== chosenTime), same = left.length === 2 && left.every((p, i) => p[0] === p[1] && p[0] === (i ? base.n : 1));
    edits = {...edits, retime: same ? [] : left};
    chosenTime = -1;
    changed(true);
}

function stripDown(event) {
    const {toX, toY, toTime} = stripScale(), [x, y] = [event.offsetX, event.offsetY], reach = event.pointerType === "mouse" ? 12 : 24;
    strip.setPointerCapture(event.pointerId);
    strip.focus();
    play(false);
    chosenTime = dragTime = pairsNow().findIndex(([old, t]) => Math.hypot(toX(t) - x, toY(old) - y) < reach);
    timeMoved = false;
    if (dragTime < 0) setTime(toTime(x));
    showStrip();
}

function stripMove(event) {
    const {toTime, toOld} = stripScale();
    if (!event.buttons) return;
    if (dragTime < 0) return setTime(toTime(event.offsetX));
    if (!timeMoved) remember(), timeMoved = true;
    movePair(dragTime, toOld(event.offsetY), toTime(event.offsetX));
    changed(false);
}

function stripUp() {
    if (dragTime < 0) return;
    dragTime = -1;
    if (timeMoved) changed(true);
}

function onStripKey(event) {
    const key = event.key.toLowerCase(), pairs = pairsNow(), {length} = pairs, by = event.altKey ? 0.1 : 1;
    const moves = {arrowleft: [0, -by], arrowright: [0, by], arrowup: [by, 0], arrowdown: [-by, 0]}[key];
    if (event.ctrlKey || event.metaKey) return;
    if (key === "n" || key === "b") chosenTime = (chosenTime + (key === "n" ? 1 : -1) + length) % length, showStrip();
    else if (key === "insert") addTime(time);
    else if (key === "delete" || key === "backspace") removeTime();
    else if (moves && chosenTime >= 0) {
        remember();
        movePair(chosenTime, pairs[chosenTime][0] + moves[0], pairs[chosenTime][1] + moves[1]);
        changed(true);
    } else return;
    if (chosenTime >= 0) say(`Time ${short(pairsNow()[chosenTime][0])} at new time ${short(pairsNow()[chosenTime][1])}.`);
    event.preventDefault();
    event.stopPropagation();
}

function listenToStrip() {
    strip.addEventListener("pointerdown", stripDown);
    strip.addEventListener("pointermove", stripMove);
    strip.addEventListener("pointerup", stripUp);
    strip.addEventListener("pointercancel", stripUp);
    strip.addEventListener("dblclick", (event) => addTime(stripScale().toTime(event.offsetX)));
    strip.addEventListener("keydown", onStripKey);
    new ResizeObserver(() => now && showStrip()).observe(strip);
}
