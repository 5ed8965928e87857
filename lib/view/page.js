/* page.js: the player inside of a page: unpacks the sequences, draws them with WebGL 2, and answers keys, mouse and touch.
 * Leaves out how the data came to be: page.h has their format.
 * A page that vg-view makes holds this file; as an exception to the licence, such pages may be passed on under any terms.
 * SPDX-License-Identifier: GPL-3.0-or-later */
"use strict";
(() => {
const $ = (id) => document.getElementById(id);
const facts = JSON.parse($("facts").textContent);
const canvas = $("canvas");
const CREASE = Math.cos(50 * Math.PI / 180), MOST_RING = 64, TEXTURE_WIDTH = 2048, FRAMES_PER_SECOND = 25;
const TINT = facts.tint || null; /* what colours say: numbers of vertices, of scales their logarithms to base 2 */
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const state = {
    frame: 0, playing: false, speed: 1, wire: facts.edges ? 1 : 0, ground: facts.ground, follow: facts.follow, colour: "plain",
    shown: facts.sequences.map(() => true), azimuth: facts.azimuth, elevation: facts.elevation, zoom: facts.zoom, shift: [0, 0],
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
    s.xyz = new Float32Array(4 * TEXTURE_WIDTH * Math.max(1, Math.ceil(s.nv / TEXTURE_WIDTH))); /* the fourth: a value */
    s.normals = new Float32Array(3 * s.corners.length);
    s.faceNormals = new Float32Array(4 * s.nf);
    s.have = -1;
    s.middle = [0, 0, 0];
    return s;
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

/* The faces around each vertex, and the face of each corner. */
function findRings(s) {
    s.ringStart = new Uint32Array(s.nv + 1);
    s.faceOf = new Uint32Array(s.corners.length);
    for (let f = 0; f < s.nf; f++)
        for (let c = s.start[f]; c < s.start[f + 1]; c++) s.faceOf[c] = f, s.ringStart[s.corners[c] + 1]++;
    for (let v = 0; v < s.nv; v++) s.ringStart[v + 1] += s.ringStart[v];
    const at = s.ringStart.slice();
    s.ring = new Uint32Array(s.corners.length);
    for (let c = 0; c < s.corners.length; c++) s.ring[at[s.corners[c]]++] = s.faceOf[c];
}

/* Area-weighted normals of the faces, and for each corner the mean of those around the vertex that turn less than the crease. */
function findNormals(s) {
    const {xyz, corners, start, faceNormals: fn, normals, ring, ringStart} = s;
    for (let f = 0; f < s.nf; f++) {
        let x = 0, y = 0, z = 0;
        const end = start[f + 1], o = 4 * corners[start[f]];
        for (let c = start[f] + 1; c + 1 < end; c++) {
            const a = 4 * corners[c], b = 4 * corners[c + 1];
            const ax = xyz[a] - xyz[o], ay = xyz[a + 1] - xyz[o + 1], az = xyz[a + 2] - xyz[o + 2];
            const bx = xyz[b] - xyz[o], by = xyz[b + 1] - xyz[o + 1], bz = xyz[b + 2] - xyz[o + 2];
            x += ay * bz - az * by, y += az * bx - ax * bz, z += ax * by - ay * bx;
        }
        const size = Math.hypot(x, y, z), scale = size > 0 ? 1 / size : 0;
        fn[4 * f] = x * scale, fn[4 * f + 1] = y * scale, fn[4 * f + 2] = z * scale, fn[4 * f + 3] = size;
    }
    for (let c = 0; c < corners.length; c++) {
        const v = corners[c], own = 4 * s.faceOf[c], from = ringStart[v], to = ringStart[v + 1], all = to - from > MOST_RING;
        const ux = fn[own], uy = fn[own + 1], uz = fn[own + 2];
        let x = 0, y = 0, z = 0;
        for (let i = from; i < to; i++) {
            const g = 4 * ring[i];
            if (all || fn[g] * ux + fn[g + 1] * uy + fn[g + 2] * uz >= CREASE) {
                const area = fn[g + 3];
                x += area * fn[g], y += area * fn[g + 1], z += area * fn[g + 2];
            }
        }
        if (x * x + y * y + z * z < 1e-24 * fn[own + 3] * fn[own + 3]) x = ux, y = uy, z = uz;
        const size = Math.hypot(x, y, z) || 1;
        normals[3 * c] = x / size, normals[3 * c + 1] = y / size, normals[3 * c + 2] = z / size;
    }
}

/* Put a frame, as soon as it is unpacked, where it is drawn from. True: it is there. */
function take(s, frame) {
    const i = Math.min(frame, s.frames - 1);
    if (s.have === i) return true;
    const chunk = chunkOf(s.places, i), numbers = s.numbers.length ? chunkOf(s.numbers, i) : null;
    if (!chunk.q || (numbers && !numbers.q)) {
        Promise.all([need(chunk, s.nv, 3), numbers && need(numbers, s.nv, 1)]).then(draw);
        return false;
    }
    const nv = s.nv, at = (i - chunk.first) * 3 * nv, {xyz} = s, sum = [0, 0, 0];
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
    for (let v = 0; numbers && v < nv; v++) {
        const x = numbers.origin[0] + numbers.step[0] * numbers.q[(i - numbers.first) * nv + v];
        xyz[4 * v + 3] = (x - TINT.low) / (TINT.high - TINT.low);
    }
    s.middle = sum;
    s.have = i;
    findNormals(s);
    upload(s);
    return true;
}

/* ---- WebGL ---- */

const PLACE = `
uniform highp sampler2D places;
uniform mat4 view, projection;
vec4 placeOf(uint v) { return texelFetch(places, ivec2(int(v) % ${TEXTURE_WIDTH}, int(v) / ${TEXTURE_WIDTH}), 0); }
`;
const HEAD = "#version 300 es\nprecision highp float;\nprecision highp int;\n";
const LIGHT = `
vec3 toScreen(vec3 c) { return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)); }
vec3 fromScreen(vec3 c) { return pow(c, vec3(2.2)); }
`;
const SURFACE = [HEAD + PLACE + `
layout(location = 0) in uint vertex;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 patchColour;
out vec3 eye, turned, tint;
out float value;
void main() {
    vec4 p = placeOf(vertex), e = view * vec4(p.xyz, 1.0);
    eye = e.xyz, turned = mat3(view) * normal, tint = patchColour, value = p.w;
    gl_Position = projection * e;
}`, HEAD + LIGHT + `
uniform sampler2D map;
uniform int mode;
in vec3 eye, turned, tint;
in float value;
out vec4 colour;
void main() {
    vec3 v = normalize(-eye), n = normalize(turned);
    float side = gl_FrontFacing ? 1.0 : -1.0;
    n *= side;
    if (dot(n, v) < 0.0) n = normalize(n - 1.02 * dot(n, v) * v);
    vec3 c;
    if (mode == 0) {
        vec3 base = gl_FrontFacing ? vec3(0.60, 0.47, 0.37) : vec3(0.16, 0.28, 0.55);
        float key = max(dot(n, normalize(vec3(-0.45, 0.65, 0.62))), 0.0), fill = max(dot(n, normalize(vec3(0.75, 0.1, 0.5))), 0.0);
        float sky = 0.5 + 0.5 * n.y, edge = pow(1.0 - max(dot(n, v), 0.0), 3.0);
        vec3 h = normalize(v + normalize(vec3(-0.45, 0.65, 0.62)));
        c = base * (0.95 * key * vec3(1.0, 0.97, 0.92) + 0.22 * fill * vec3(0.8, 0.9, 1.0) + mix(vec3(0.10, 0.09, 0.08), vec3(0.26, 0.28, 0.32), sky));
        c += 0.05 * pow(max(dot(n, h), 0.0), 24.0) + 0.06 * edge * sky;
    } else {
        vec3 base = mode == 1 ? texture(map, vec2(clamp(value, 0.0, 1.0), 0.5)).rgb : tint;
        float facing = max(dot(n, v), 0.0);
        c = fromScreen(base) * (0.35 + 0.65 * facing);
    }
    colour = vec4(toScreen(c), 1.0);
}`];
/* A line as a strip of four corners, a little nearer to the viewer than the surface it lies on. */
const LINE = [HEAD + PLACE + `
layout(location = 0) in uvec2 ends;
uniform vec2 size;
uniform float width, lift;
out float across, value;
void main() {
    vec4 first = placeOf(ends.x), second = placeOf(ends.y);
    vec4 a = view * vec4(first.xyz, 1.0), b = view * vec4(second.xyz, 1.0);
    float near = -0.001;
    if (a.z > near) a = mix(b, a, (near - b.z) / (a.z - b.z));
    if (b.z > near) b = mix(a, b, (near - a.z) / (b.z - a.z));
    vec4 p = projection * a, q = projection * b;
    vec2 s = p.xy / p.w * size, t = q.xy / q.w * size, along = t - s;
    along = dot(along, along) > 1e-12 ? normalize(along) : vec2(1.0, 0.0);
    bool last = gl_VertexID > 1;
    value = last ? second.w : first.w;
    float side = gl_VertexID % 2 == 0 ? -1.0 : 1.0, reach = width / 2.0 + 1.0;
    across = side * reach;
    vec2 at = (last ? t : s) + side * reach * vec2(-along.y, along.x);
    vec4 e = last ? b : a, lifted = projection * vec4(e.xyz * (1.0 - lift), 1.0), whole = last ? q : p;
    gl_Position = vec4(at / size * whole.w, lifted.z / lifted.w * whole.w, whole.w);
}`, HEAD + `
uniform sampler2D map;
uniform int mode;
uniform float width;
uniform vec4 ink;
in float across, value;
out vec4 colour;
void main() {
    float cover = clamp(width / 2.0 + 0.5 - abs(across), 0.0, 1.0);
    if (cover <= 0.0) discard;
    colour = vec4(mode == 1 ? texture(map, vec2(clamp(value, 0.0, 1.0), 0.5)).rgb : ink.rgb, ink.a * cover);
}`];
const POINT = [HEAD + PLACE + `
uniform float width;
out float value;
void main() {
    vec4 p = placeOf(uint(gl_VertexID));
    value = p.w;
    gl_Position = projection * (view * vec4(p.xyz, 1.0));
    gl_PointSize = width;
}`, HEAD + `
uniform sampler2D map;
uniform int mode;
uniform vec4 ink;
in float value;
out vec4 colour;
void main() {
    if (length(gl_PointCoord - 0.5) > 0.5) discard;
    colour = mode == 1 ? vec4(texture(map, vec2(clamp(value, 0.0, 1.0), 0.5)).rgb, 1.0) : ink;
}`];
const GROUND = [HEAD + `
uniform mat4 view, projection;
uniform float height, reach;
uniform vec2 about;
out vec2 at;
void main() {
    vec2 corner = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0;
    at = about + reach * corner;
    gl_Position = projection * (view * vec4(at.x, height, at.y, 1.0));
}`, HEAD + `
uniform float spacing, reach;
uniform vec2 about;
uniform vec4 ink;
in vec2 at;
out vec4 colour;
float lines(vec2 p) {
    vec2 off = abs(p - round(p)) / max(fwidth(p), vec2(1e-6));
    return clamp(1.2 - min(off.x, off.y), 0.0, 1.0) * clamp(2.0 - 4.0 * max(fwidth(p).x, fwidth(p).y), 0.0, 1.0);
}
void main() {
    float fade = 1.0 - smoothstep(0.4, 1.0, length(at - about) / reach);
    colour = vec4(ink.rgb, ink.a * fade * max(0.6 * lines(at / spacing), lines(at / spacing / 5.0)));
}`];

function compile([vertex, fragment]) {
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, text.trim());
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) || "no shaders");
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "no shaders");
    const at = {};
    for (let i = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
        const {name} = gl.getActiveUniform(program, i);
        at[name] = gl.getUniformLocation(program, name);
    }
    return {program, at};
}

function makeTexture() {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, gl.NEAREST);
    for (const which of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, which, gl.CLAMP_TO_EDGE);
    return texture;
}

function makeBuffer(target, data) {
    const buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return buffer;
}

/* A colour for each patch: hues a golden angle apart, in three lightnesses. */
function patchColour(i) {
    const hue = (i * 137.508) % 360, light = [0.62, 0.48, 0.74][i % 3];
    const f = (n) => { const k = (n + hue / 30) % 12; return light - 0.6 * Math.min(light, 1 - light) * Math.max(-1, Math.min(k - 3, 9 - k, 1)); };
    return [255 * f(0), 255 * f(8), 255 * f(4)];
}

function lineArray(ends) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    makeBuffer(gl.ARRAY_BUFFER, ends);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 2, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    return array;
}

function prepare(s) {
    s.texture = makeTexture();
    s.surface = gl.createVertexArray();
    gl.bindVertexArray(s.surface);
    makeBuffer(gl.ARRAY_BUFFER, s.corners);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    s.normalBuffer = makeBuffer(gl.ARRAY_BUFFER, s.normals);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
    if (s.patches) {
        const tints = new Uint8Array(4 * s.corners.length);
        for (let c = 0; c < s.corners.length; c++) tints.set(patchColour(s.patches[s.faceOf[c]]), 4 * c);
        makeBuffer(gl.ARRAY_BUFFER, tints);
        gl.enableVertexAttribArray(2);
        gl.vertexAttribPointer(2, 3, gl.UNSIGNED_BYTE, true, 4, 0);
    }
    makeBuffer(gl.ELEMENT_ARRAY_BUFFER, s.index);
    s.edgeArray = lineArray(s.edges);
    s.boneArray = lineArray(s.bones);
    s.empty = gl.createVertexArray();
}

function upload(s) {
    gl.bindTexture(gl.TEXTURE_2D, s.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, TEXTURE_WIDTH, s.xyz.length / 4 / TEXTURE_WIDTH, 0, gl.RGBA, gl.FLOAT, s.xyz);
    gl.bindBuffer(gl.ARRAY_BUFFER, s.normalBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, s.normals, gl.DYNAMIC_DRAW);
}

function mapColours() {
    const colours = [];
    for (let i = 0; i < facts.map.length; i += 6) colours.push("#" + facts.map.slice(i, i + 6));
    return colours;
}

function startGl() {
    gl = canvas.getContext("webgl2", {antialias: true, alpha: true, premultipliedAlpha: false});
    if (!gl) throw new Error("this browser has no WebGL 2, or it is switched off");
    programs = {surface: compile(SURFACE), line: compile(LINE), point: compile(POINT), ground: compile(GROUND)};
    const colours = mapColours(), bytes = new Uint8Array(4 * colours.length).fill(255);
    colours.forEach((c, i) => [1, 3, 5].forEach((at, k) => { bytes[4 * i + k] = parseInt(c.slice(at, at + 2), 16); }));
    programs.map = makeTexture();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, colours.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); tell("The graphics were reset: load the page again."); });
}

/* ---- camera ---- */

const HALF_FIELD = 14 * Math.PI / 180;

function directions() {
    const a = state.azimuth * Math.PI / 180, b = state.elevation * Math.PI / 180;
    return {
        right: [Math.cos(a), 0, -Math.sin(a)],
        up: [-Math.sin(a) * Math.sin(b), Math.cos(b), -Math.cos(a) * Math.sin(b)],
        toward: [Math.sin(a) * Math.cos(b), Math.sin(b), Math.cos(a) * Math.cos(b)],
    };
}

/* The box of all frames of what is shown, on the axes of the page; about the size of one pose, when the camera follows. */
function boxOf(list) {
    if (state.follow) return {least: [-0.4, -0.4, -0.4], most: [0.4, 0.4, 0.4]};
    const least = [Infinity, Infinity, Infinity], most = [-Infinity, -Infinity, -Infinity];
    for (const s of list)
        for (const chunk of s.places)
            for (let k = 0; k < 3; k++) {
                const [axis, sign] = AXES[k];
                for (const end of [0, 65535]) {
                    const x = sign * (chunk.origin[axis] + end * chunk.step[axis] - s.about.centre[axis]) / s.unit;
                    least[k] = Math.min(least[k], x), most[k] = Math.max(most[k], x);
                }
            }
    return least[0] <= most[0] ? {least, most} : {least: [0, 0, 0], most: [0, 0, 0]};
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function camera(aspect, s, list) {
    const {right, up, toward} = directions(), box = boxOf(list), tangent = Math.tan(HALF_FIELD);
    const half = box.most.map((x, k) => (x - box.least[k]) / 2);
    let whole = 0.05; /* the least distance from where all corners of the box are seen */
    for (let i = 0; i < 8; i++) {
        const p = half.map((x, k) => i >> k & 1 ? x : -x);
        whole = Math.max(whole, 1.1 * Math.max(Math.abs(dot(p, up)), Math.abs(dot(p, right)) / aspect) / tangent + dot(p, toward));
    }
    const distance = whole / state.zoom, middle = state.follow ? s.middle : box.most.map((x, k) => (x + box.least[k]) / 2);
    const target = middle.map((x, k) => x - state.shift[0] * right[k] - state.shift[1] * up[k]);
    const eye = target.map((x, k) => x + distance * toward[k]);
    const view = [right[0], up[0], toward[0], 0, right[1], up[1], toward[1], 0, right[2], up[2], toward[2], 0,
                  -dot(right, eye), -dot(up, eye), -dot(toward, eye), 1];
    const radius = Math.hypot(...half) + 2, near = Math.max(distance - radius, distance * 0.01), far = distance + radius + 10;
    const projection = [1 / (tangent * aspect), 0, 0, 0, 0, 1 / tangent, 0, 0, 0, 0, (near + far) / (near - far), -1,
                        0, 0, 2 * near * far / (near - far), 0];
    return {view, projection, distance, tangent};
}

/* ---- drawing ---- */

const dark = window.matchMedia("(prefers-color-scheme: dark)");

function shownSequences() {
    return sequences.filter((s) => state.shown[s.number]);
}

/* Where on the canvas each sequence is, in CSS pixels. */
function panels() {
    const list = shownSequences(), w = canvas.clientWidth, h = canvas.clientHeight, beside = w >= h;
    return list.map((s, i) => beside ? {s, x: i * w / list.length, y: 0, w: w / list.length, h}
                                     : {s, x: 0, y: i * h / list.length, w, h: h / list.length});
}

function use(program, cam) {
    gl.useProgram(program.program);
    gl.uniformMatrix4fv(program.at.view, false, cam.view);
    gl.uniformMatrix4fv(program.at.projection, false, cam.projection);
    if (program.at.map) gl.uniform1i(program.at.map, 1);
    return program.at;
}

function drawLines(cam, array, n, size, width, ink, lift, mode = 0) {
    const at = use(programs.line, cam);
    gl.uniform1i(at.mode, mode);
    gl.uniform2f(at.size, size[0] / 2, size[1] / 2);
    gl.uniform1f(at.width, width);
    gl.uniform1f(at.lift, lift);
    gl.uniform4fv(at.ink, ink);
    gl.bindVertexArray(array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, n);
}

function drawGround(cam, s, ink) {
    const at = use(programs.ground, cam), axis = AXES[1][0];
    let spacing = 10 ** Math.floor(Math.log10(s.unit / 8));
    spacing = [1, 2, 5, 10].map((x) => x * spacing).find((x) => x >= s.unit / 12) / s.unit;
    gl.uniform1f(at.height, (s.about.ground - s.about.centre[axis]) / s.unit);
    gl.uniform1f(at.reach, 2.5);
    gl.uniform2f(at.about, state.follow ? s.middle[0] : 0, state.follow ? s.middle[2] : 0);
    gl.uniform1f(at.spacing, spacing);
    gl.uniform4fv(at.ink, ink);
    gl.bindVertexArray(s.empty);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
}

function modeOf(s) {
    if (TINT && state.colour === TINT.kind) return s.numbers.length ? 1 : 0;
    return state.colour === "patches" && s.patches ? 2 : 0;
}

function drawPanel(panel, scale) {
    const {s} = panel, w = Math.round(panel.w * scale), h = Math.round(panel.h * scale);
    const x = Math.round(panel.x * scale), y = canvas.height - Math.round(panel.y * scale) - h;
    const cam = camera(w / h, s, shownSequences()), ink = dark.matches ? [0.9, 0.92, 0.95] : [0.1, 0.11, 0.14], alone = state.wire === 2;
    gl.viewport(x, y, w, h);
    gl.scissor(x, y, w, h);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, programs.map);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, s.texture);
    if (!alone && s.index.length) {
        gl.uniform1i(use(programs.surface, cam).mode, modeOf(s));
        gl.bindVertexArray(s.surface);
        gl.drawElements(gl.TRIANGLES, s.index.length, gl.UNSIGNED_INT, 0);
    }
    if (state.ground) drawGround(cam, s, [...ink, 0.3]);
    if (s.bones.length) drawLines(cam, s.boneArray, s.bones.length / 2, [w, h], 3 * scale, dark.matches ? [0.85, 0.72, 0.6, 1] : [0.45, 0.33, 0.25, 1], 0, modeOf(s));
    if (state.wire && s.edges.length)
        drawLines(cam, s.edgeArray, s.edges.length / 2, [w, h], scale, alone ? [...ink, 0.7] : [0.05, 0.05, 0.08, 0.55], alone ? 0 : 0.0015);
    if (s.points) {
        const at = use(programs.point, cam);
        gl.uniform1f(at.width, 5 * scale);
        gl.uniform1i(at.mode, modeOf(s));
        gl.uniform4fv(at.ink, dark.matches ? [0.85, 0.72, 0.6, 1] : [0.45, 0.33, 0.25, 1]);
        gl.bindVertexArray(s.empty);
        gl.drawArrays(gl.POINTS, 0, s.nv);
    }
}

function render() {
    wanted = false;
    const scale = Math.min(window.devicePixelRatio || 1, 2), w = Math.round(canvas.clientWidth * scale), h = Math.round(canvas.clientHeight * scale);
    if (!w || !h) return;
    const list = panels();
    const there = list.map(({s}) => take(s, state.frame)).every((x) => x);
    if (!there) return; /* draws when it is */
    if (canvas.width !== w || canvas.height !== h) canvas.width = w, canvas.height = h;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.scissor(0, 0, w, h);
    gl.clearColor(...(dark.matches ? [0.082, 0.094, 0.114, 1] : [0.957, 0.961, 0.969, 1]));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const panel of list) drawPanel(panel, scale);
    document.documentElement.dataset.drawn = String(state.frame);
}

function draw() {
    if (!wanted) wanted = true, requestAnimationFrame(render);
}

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
    list.forEach(({s, x, y, w}, i) => {
        let caption = at.children[i];
        if (!caption) {
            caption = document.createElement("div");
            caption.className = "caption";
            caption.append(document.createElement("b"), document.createElement("span"));
            at.append(caption);
        }
        const f = Math.min(state.frame, s.frames - 1), {means, minima, maxima, names} = s.about;
        caption.style.left = x + "px", caption.style.top = y + "px", caption.style.width = w + "px";
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
}

function showControls() {
    const press = (id, on) => $(id).setAttribute("aria-pressed", String(Boolean(on)));
    press("play", state.playing);
    $("play").textContent = state.playing ? "Pause" : "Play";
    press("edges", state.wire > 0);
    $("edges").textContent = ["Wireframe", "Wireframe: over", "Wireframe: alone"][state.wire];
    press("ground", state.ground);
    press("follow", state.follow);
    $("colour").value = state.colour;
    $("speed").value = String(state.speed);
    for (const button of $("shown").children) button.setAttribute("aria-pressed", String(state.shown[button.dataset.number]));
    const legend = TINT && state.colour === TINT.kind && state.wire < 2 && shownSequences().some((s) => s.numbers.length);
    const counts = state.colour === "patches" && state.wire < 2 ? shownSequences().filter((s) => s.patches).map((s) => s.about.patches) : [];
    $("legend").hidden = !legend && !counts.length;
    $("legend-bar").hidden = $("legend-numbers").hidden = !legend;
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
    const made = facts.sequences.map((s) => s.provenance.length ? `${s.label}: ${s.provenance.join(" | ")}` : s.label);
    $("provenance").textContent = `Positions are within ${short(lost)} D of the data (16 bits an axis; D: diagonal of the bounding box of the reference pose). ` +
        `${made.join("; ")}. Made by vg-view ${facts.version}.`;
    const colours = mapColours();
    $("legend-bar").style.background = `linear-gradient(to right, ${colours.join(",")})`;
    for (let i = 0; i <= 4; i++) {
        const number = document.createElement("span");
        if (!TINT) break;
        const at = TINT.low + (TINT.high - TINT.low) * i / 4, shown = TINT.kind === "scales" ? 2 ** at : at;
        const beyond = i === 4 && facts.max > facts.scale ? "\u2265 " : i === 0 && facts.least < shown ? "\u2264 " : "";
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
    showFrame();
    draw();
}

function tick(now) {
    if (!state.playing) return;
    const gap = frames > 1 ? timeOf(frames - 1) / (frames - 1) : 1, length = timeOf(frames - 1) + gap;
    if (clock === null) clock = {now, time: timeOf(state.frame)};
    clock.time = (clock.time + Math.max(0, Math.min(now - clock.now, 1000)) / 1000 * state.speed) % length;
    clock.now = now;
    let low = 0, high = frames - 1;
    while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (timeOf(middle) <= clock.time + 1e-9) low = middle;
        else high = middle - 1;
    }
    if (low !== state.frame) show(low);
    requestAnimationFrame(tick);
}

function play(on) {
    state.playing = on && frames > 1;
    clock = null;
    showControls();
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
    0: () => { state.shown.fill(true); refresh(); },
    a: () => turn(10, 0), d: () => turn(-10, 0), s: () => turn(0, 10), x: () => turn(0, -10),
    "+": () => zoom(1.2), "=": () => zoom(1.2), "-": () => zoom(1 / 1.2),
    "?": () => $("help").showModal(),
};

function onKey(event) {
    const key = event.key.toLowerCase(), {target} = event;
    if (event.ctrlKey || event.metaKey || event.altKey || $("help").open || target.tagName === "SELECT") return;
    if (target.tagName === "BUTTON" && key === " ") return; /* presses the button */
    const number = /^[1-9]$/.test(key) ? +key - 1 : -1;
    if (number >= 0 && number < sequences.length && sequences.length > 1) toggle(number);
    else if (keys[key]) keys[key](event);
    else return;
    event.preventDefault();
}

function listenToPointers() {
    const down = new Map();
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        canvas.classList.add("moving");
        down.set(event.pointerId, {x: event.clientX, y: event.clientY});
    });
    for (const name of ["pointerup", "pointercancel"])
        canvas.addEventListener(name, (event) => {
            down.delete(event.pointerId);
            if (!down.size) canvas.classList.remove("moving");
        });
    canvas.addEventListener("pointermove", (event) => {
        const before = down.get(event.pointerId);
        if (!before) return;
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
    const clicks = {back: () => step(-1), forth: () => step(1), play: keys[" "], edges: keys.w, ground: keys.g, follow: keys.f, reset: resetView, "help-button": keys["?"]};
    for (const id of Object.keys(clicks)) $(id).addEventListener("click", clicks[id]);
    document.addEventListener("keydown", onKey);
    listenToPointers();
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
    if (hash.has("edges")) state.wire = Math.max(0, Math.min(2, Math.floor(+hash.get("edges")) || 0));
    if (hash.has("frame")) state.frame = Math.max(0, Math.min(frames - 1, Math.floor(+hash.get("frame")) || 0));
    refresh();
    if (hash.has("play")) play(hash.get("play") !== "0");
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
    state.colour = TINT ? TINT.kind : sequences.some((s) => s.patches) ? "patches" : "plain";
    listen();
    showAbout();
    showGraph();
    readHash();
    await Promise.all(sequences.flatMap((s) => [[s.places, 3], [s.numbers, 1]].filter(([list]) => list.length)
        .map(([list, width]) => need(chunkOf(list, Math.min(state.frame, s.frames - 1)), s.nv, width))));
    tell("");
    draw();
    for (const s of sequences) /* the others, one after the other, so that the page answers meanwhile */
        for (const [list, width] of [[s.places, 3], [s.numbers, 1]])
            for (const chunk of list) await need(chunk, s.nv, width);
    document.documentElement.dataset.whole = "true";
}
main().catch((error) => tell("This page does not work here: " + error.message));
})();
