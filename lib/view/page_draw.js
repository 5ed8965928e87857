/* page_draw.js: how sequences are drawn with WebGL 2: surfaces, lines, points, shadow; the camera; panels.
 * Leaves out unpacking (page_read.js), picking (page_pick.js), and what drives it (page_play.js).
 * SPDX-License-Identifier: GPL-3.0-or-later */

/* ---- WebGL ---- */

const PLACE = `
uniform highp sampler2D places, nextPlaces;
uniform float part; /* of the way from this frame to the next one */
uniform mat4 view, projection;
vec4 placeOf(uint v) {
    ivec2 at = ivec2(int(v) % ${TEXTURE_WIDTH}, int(v) / ${TEXTURE_WIDTH});
    vec4 here = texelFetch(places, at, 0);
    return part > 0.0 ? mix(here, texelFetch(nextPlaces, at, 0), part) : here;
}
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
layout(location = 3) in vec3 nextNormal;
layout(location = 4) in vec4 look; /* of its material: colour, and from where on it is opaque */
layout(location = 5) in vec3 spot; /* in a picture: u, v, which one; -1: none, -2: no material */
uniform float ground;
out vec3 eye, turned, tint, where;
out vec4 material;
out float value, height;
void main() {
    vec4 p = placeOf(vertex), e = view * vec4(p.xyz, 1.0);
    vec3 n = mix(normal, nextNormal, part);
    eye = e.xyz, turned = mat3(view) * n, tint = patchColour, material = look, where = spot, value = p.w, height = p.y - ground;
    gl_Position = projection * e;
}`, HEAD + LIGHT + `
uniform sampler2D map;
uniform mediump sampler2DArray pictures;
uniform int mode;
uniform vec4 wash; /* the colour of a sequence that lies over another one, and how much shows through */
in vec3 eye, turned, tint, where;
in vec4 material;
in float value, height;
out vec4 colour;
void main() {
    vec3 v = normalize(-eye), n = normalize(turned);
    float side = gl_FrontFacing ? 1.0 : -1.0;
    n *= side;
    if (dot(n, v) < 0.0) n = normalize(n - 1.02 * dot(n, v) * v);
    vec3 c;
    if (mode == 0 || mode == 3) {
        vec3 base = gl_FrontFacing ? vec3(0.60, 0.47, 0.37) : vec3(0.16, 0.28, 0.55);
        if (mode == 3 && where.z > -1.5) {
            vec4 seen = where.z < -0.5 ? vec4(1.0) : texture(pictures, where);
            if (seen.a < material.a) discard;
            base = material.rgb * fromScreen(seen.rgb);
        }
        float key = max(dot(n, normalize(vec3(-0.45, 0.65, 0.62))), 0.0), fill = max(dot(n, normalize(vec3(0.75, 0.1, 0.5))), 0.0);
        float sky = 0.5 + 0.5 * n.y;
        sky *= 1.0 - 0.45 * exp(-height / 0.08) * clamp(0.6 - n.y, 0.0, 1.0); /* little light comes from the ground nearby */
        float edge = pow(1.0 - max(dot(n, v), 0.0), 3.0);
        vec3 h = normalize(v + normalize(vec3(-0.45, 0.65, 0.62)));
        c = base * (0.95 * key * vec3(1.0, 0.97, 0.92) + 0.22 * fill * vec3(0.8, 0.9, 1.0) + mix(vec3(0.10, 0.09, 0.08), vec3(0.26, 0.28, 0.32), sky));
        c += 0.05 * pow(max(dot(n, h), 0.0), 24.0) + 0.06 * edge * sky;
    } else {
        vec3 base = mode == 1 ? texture(map, vec2(clamp(value, 0.0, 1.0), 0.5)).rgb : tint;
        float facing = max(dot(n, v), 0.0);
        c = fromScreen(base) * (0.35 + 0.65 * facing);
    }
    if (wash.a > 0.0) c = mix(c, fromScreen(wash.rgb) * (0.3 + 0.7 * max(dot(n, v), 0.0)), 0.7);
    colour = vec4(toScreen(c), 1.0 - wash.a);
}`];
/* The back of a surface, a little thicker: what of it is seen around the surface is its outline. */
const OUTLINE = [HEAD + PLACE + `
layout(location = 0) in uint vertex;
layout(location = 1) in vec3 normal;
layout(location = 3) in vec3 nextNormal;
uniform vec2 size;
uniform float width;
void main() {
    vec4 e = view * vec4(placeOf(vertex).xyz, 1.0), q = projection * e;
    vec2 out_ = (mat3(view) * mix(normal, nextNormal, part)).xy;
    float l = length(out_);
    gl_Position = vec4(q.xy + (l > 1e-6 ? out_ / l * width / size * 2.0 * q.w : vec2(0.0)), q.z + 1.5e-3 * q.w, q.w);
}`, HEAD + `
uniform vec4 ink;
out vec4 colour;
void main() { colour = ink; }`];
/* The figure from above, darker where it is nearer to the ground. */
const SHADOW = [HEAD + PLACE + `
layout(location = 0) in uint vertex;
uniform float ground, reach;
uniform vec2 about;
out float height;
void main() {
    vec4 p = placeOf(vertex);
    height = p.y - ground;
    gl_Position = vec4((p.xz - about) / reach, 0.0, 1.0);
}`, HEAD + `
in float height;
out vec4 colour;
void main() { colour = vec4(exp(-max(height, 0.0) / 0.15)); }`];
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
/* The shadow with soft edges: once for its few pixels, not for each pixel of the ground. */
const SOFTEN = [HEAD + `
out vec2 at;
void main() {
    vec2 corner = vec2(gl_VertexID % 2, gl_VertexID / 2);
    at = corner;
    gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}`, HEAD + `
uniform sampler2D shadow;
in vec2 at;
out vec4 colour;
void main() {
    float sum = 0.0, total = 0.0;
    for (int i = -3; i <= 3; i++)
        for (int j = -3; j <= 3; j++) {
            float w = exp(-float(i * i + j * j) / 6.0);
            sum += w * texture(shadow, at + vec2(i, j) / 160.0).r;
            total += w;
        }
    colour = vec4(sum / total);
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
uniform sampler2D shadow;
uniform float spacing, reach, shadowReach, grid;
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
    vec2 p = (at - about) / shadowReach;
    float dark = max(abs(p.x), abs(p.y)) < 1.0 ? 0.45 * texture(shadow, 0.5 + 0.5 * p).r : 0.0;
    float line = grid * ink.a * fade * max(0.6 * lines(at / spacing), lines(at / spacing / 5.0));
    colour = vec4(mix(ink.rgb * line, vec3(0.0), dark) / max(line + dark - line * dark, 1e-4), line + dark - line * dark);
}`];
const BACKDROP = [HEAD + `
out float height;
void main() {
    vec2 corner = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0;
    height = 0.5 + 0.5 * corner.y;
    gl_Position = vec4(corner, 0.9999, 1.0);
}`, HEAD + `
uniform vec3 low, high;
in float height;
out vec4 colour;
void main() { colour = vec4(mix(low, high, height), 1.0); }`];

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

/* The surface from one slot to the other. */
function surfaceArray(s, tints, looks, here, next) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, s.cornerBuffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 1, gl.UNSIGNED_INT, 0, 0);
    for (const [location, slot] of [[1, here], [3, next]]) {
        gl.bindBuffer(gl.ARRAY_BUFFER, slot.normalBuffer);
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 0, 0);
    }
    if (tints) {
        gl.bindBuffer(gl.ARRAY_BUFFER, tints);
        gl.enableVertexAttribArray(2);
        gl.vertexAttribPointer(2, 3, gl.UNSIGNED_BYTE, true, 4, 0);
    }
    if (looks) bindLooks(looks);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, s.indexBuffer);
    return array;
}

function prepare(s) {
    let tints = null;
    s.cornerBuffer = makeBuffer(gl.ARRAY_BUFFER, s.corners);
    if (s.patches) {
        const colours = new Uint8Array(4 * s.corners.length);
        for (let c = 0; c < s.corners.length; c++) colours.set(patchColour(s.patches[s.faceOf[c]]), 4 * c);
        tints = makeBuffer(gl.ARRAY_BUFFER, colours);
    }
    s.indexBuffer = makeBuffer(gl.ELEMENT_ARRAY_BUFFER, s.index);
    for (const slot of s.slots) {
        slot.frame = -1;
        slot.texture = makeTexture();
        slot.normalBuffer = makeBuffer(gl.ARRAY_BUFFER, slot.normals);
    }
    const [a, b] = s.slots, looks = s.materials ? makeLooks(s) : null;
    a.surface = surfaceArray(s, tints, looks, a, b);
    b.surface = surfaceArray(s, tints, looks, b, a);
    s.edgeArray = lineArray(s.edges);
    s.boneArray = lineArray(s.bones);
    s.empty = gl.createVertexArray();
    s.rig = s.about.jointsAt ? makeTrack(pointsOf(s, s.about.jointsAt, true), s.about.parents.flatMap((p, j) => p >= 0 ? [p, j] : [])) : null;
}

/* Points of their own, joined by lines: the bones of a rig, the path of a vertex. */
function makeTrack(points, ends) {
    const rows = Math.max(1, Math.ceil(points.length / TEXTURE_WIDTH)), xyz = new Float32Array(4 * TEXTURE_WIDTH * rows);
    points.forEach((p, i) => xyz.set(p, 4 * i));
    const texture = makeTexture();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, TEXTURE_WIDTH, rows, 0, gl.RGBA, gl.FLOAT, xyz);
    return {texture, array: lineArray(new Uint32Array(ends)), n: ends.length / 2, points};
}

function upload(s, slot) {
    gl.bindTexture(gl.TEXTURE_2D, slot.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, TEXTURE_WIDTH, slot.xyz.length / 4 / TEXTURE_WIDTH, 0, gl.RGBA, gl.FLOAT, slot.xyz);
    gl.bindBuffer(gl.ARRAY_BUFFER, slot.normalBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, slot.normals, gl.DYNAMIC_DRAW);
}

function mapColours() {
    const colours = [];
    for (let i = 0; i < facts.map.length; i += 6) colours.push("#" + facts.map.slice(i, i + 6));
    return colours;
}

const SHADOW_SIZE = 128;

function makeShadow() {
    const texture = makeTexture(), buffer = gl.createFramebuffer();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, SHADOW_SIZE, SHADOW_SIZE, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
    for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, gl.LINEAR);
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return {texture, buffer};
}

/* All that lives in the graphics memory but the sequences. */
function makePrograms() {
    programs = {surface: compile(SURFACE), outline: compile(OUTLINE), shadow: compile(SHADOW), line: compile(LINE),
                point: compile(POINT), ground: compile(GROUND), backdrop: compile(BACKDROP), soften: compile(SOFTEN), cast: makeShadow(), soft: makeShadow()};
    const colours = mapColours(), bytes = new Uint8Array(4 * colours.length).fill(255);
    colours.forEach((c, i) => [1, 3, 5].forEach((at, k) => { bytes[4 * i + k] = parseInt(c.slice(at, at + 2), 16); }));
    programs.map = makeTexture();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, colours.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
}

function startGl() {
    gl = canvas.getContext("webgl2", {antialias: true, alpha: true, premultipliedAlpha: false, preserveDrawingBuffer: true});
    if (!gl) throw new Error("this browser has no WebGL 2, or it is switched off");
    makePrograms();
    canvas.addEventListener("webglcontextlost", (event) => {
        event.preventDefault();
        tell("The graphics were reset. They come back as soon as the browser allows it.");
    });
    canvas.addEventListener("webglcontextrestored", () => {
        makePrograms();
        sequences.forEach(prepare);
        if (pinned) pinned.track = null;
        tell("");
        draw();
    });
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

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const MARGIN = 1.07;

/* What has to be seen: the outermost points of all frames, or when the camera follows, of the figure around its centroid. */
function pointsToFit(list, follow) {
    const points = list.flatMap((s) => follow ? s.figure : s.path);
    return points.length ? points : [[0, 0, 0]];
}

/* The middle and the least distance from which all points are seen. */
function fitPoints(points, aspect) {
    const {right, up, toward} = directions(), tangent = Math.tan(HALF_FIELD);
    const seen = points.map((p) => [dot(p, right), dot(p, up), dot(p, toward)]), middle = [0, 0], reach = [tangent * aspect, tangent];
    const near = seen.reduce((most, p) => Math.max(most, p[2]), -Infinity);
    let distance = 0;
    for (let pass = 0; pass < 6; pass++) {
        distance = near + 0.05;
        for (const p of seen)
            for (let k = 0; k < 2; k++) distance = Math.max(distance, p[2] + MARGIN * Math.abs(p[k] - middle[k]) / reach[k]);
        for (let k = 0; k < 2; k++) { /* put what is seen into the middle of the picture */
            const at = seen.map((p) => (p[k] - middle[k]) / (distance - p[2]));
            middle[k] += distance * (Math.min(...at) + Math.max(...at)) / 2;
        }
    }
    return {distance, middle: right.map((x, k) => middle[0] * x + middle[1] * up[k])};
}

/* Does the figure go so far that it is small when its whole path is shown? */
function goesFar() {
    const list = shownSequences(), aspect = canvas.clientWidth / (canvas.clientHeight || 1);
    return fitPoints(pointsToFit(list, false), aspect).distance > 1.5 * fitPoints(pointsToFit(list, true), aspect).distance;
}

function camera(aspect, s, list) {
    const {right, up, toward} = directions(), tangent = Math.tan(HALF_FIELD), points = pointsToFit(list, state.follow);
    const fit = fitPoints(points, aspect), distance = fit.distance / state.zoom;
    const middle = state.follow ? fit.middle.map((x, k) => x + s.middle[k]) : fit.middle;
    const target = middle.map((x, k) => x - state.shift[0] * right[k] - state.shift[1] * up[k]);
    const eye = target.map((x, k) => x + distance * toward[k]);
    const view = [right[0], up[0], toward[0], 0, right[1], up[1], toward[1], 0, right[2], up[2], toward[2], 0,
                  -dot(right, eye), -dot(up, eye), -dot(toward, eye), 1];
    const radius = Math.max(...points.map((p) => Math.hypot(...p))) + 2, near = Math.max(distance - radius, distance * 0.01), far = distance + radius + 10;
    const projection = [1 / (tangent * aspect), 0, 0, 0, 0, 1 / tangent, 0, 0, 0, 0, (near + far) / (near - far), -1,
                        0, 0, 2 * near * far / (near - far), 0];
    return {view, projection, distance, tangent, aspect, eye, right, up, toward};
}

/* ---- drawing ---- */

const dark = window.matchMedia("(prefers-color-scheme: dark)");

function shownSequences() {
    return sequences.filter((s) => state.shown[s.number]);
}

/* Where on the canvas each sequence is, in CSS pixels; `cut`: the part of it that is drawn, when one wipes over another. */
function panels() {
    const list = shownSequences(), w = canvas.clientWidth, h = canvas.clientHeight, beside = w >= h, n = list.length;
    if (n > 1 && state.layout === "overlay") return list.map((s, i) => ({s, x: 0, y: 0, w, h, cut: [0, 1], over: i > 0}));
    if (n > 1 && state.layout === "wipe")
        return list.slice(0, 2).map((s, i) => ({s, x: 0, y: 0, w, h, cut: i ? [state.wipe, 1] : [0, state.wipe], over: false}));
    return list.map((s, i) => ({s, x: beside ? i * w / n : 0, y: beside ? 0 : i * h / n, w: beside ? w / n : w, h: beside ? h : h / n,
                                cut: [0, 1], over: false}));
}

function use(program, cam, s) {
    gl.useProgram(program.program);
    gl.uniformMatrix4fv(program.at.view, false, cam.view);
    gl.uniformMatrix4fv(program.at.projection, false, cam.projection);
    gl.uniform1f(program.at.part, s ? s.part : 0);
    if (program.at.nextPlaces) gl.uniform1i(program.at.nextPlaces, 2);
    if (program.at.map) gl.uniform1i(program.at.map, 1);
    return program.at;
}

/* The textures of a sequence's two frames, or of points of their own. */
function bindPlaces(here, next) {
    for (const [unit, texture] of [[gl.TEXTURE1, programs.map], [gl.TEXTURE2, next], [gl.TEXTURE0, here]]) {
        gl.activeTexture(unit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
    }
}

function drawLines(cam, s, array, n, size, width, ink, lift, mode = 0) {
    const at = use(programs.line, cam, s);
    gl.uniform1i(at.mode, mode);
    gl.uniform2f(at.size, size[0] / 2, size[1] / 2);
    gl.uniform1f(at.width, width);
    gl.uniform1f(at.lift, lift);
    gl.uniform4fv(at.ink, ink);
    gl.bindVertexArray(array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, n);
}

/* Lines that lie over everything: the bones of a rig, the path of a vertex. */
function drawTrack(cam, track, size, width, ink) {
    bindPlaces(track.texture, track.texture);
    gl.disable(gl.DEPTH_TEST);
    drawLines(cam, null, track.array, track.n, size, width, ink, 0);
    gl.enable(gl.DEPTH_TEST);
}

const groundOf = (s) => (s.about.ground - s.about.centre[AXES[1][0]]) / s.unit;

/* Where the shadow of a sequence lies: around its figure. */
function shadowPlace(s) {
    return {about: [s.middle[0], s.middle[2]], reach: 1.15 * Math.max(0.1, ...s.figure.map((p) => Math.max(Math.abs(p[0]), Math.abs(p[2]))))};
}

function castShadow(s, cam) {
    const {about, reach} = shadowPlace(s);
    gl.bindFramebuffer(gl.FRAMEBUFFER, programs.cast.buffer);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.disable(gl.SCISSOR_TEST);
    gl.disable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const at = use(programs.shadow, cam, s);
    gl.uniform1f(at.ground, groundOf(s));
    gl.uniform1f(at.reach, reach);
    gl.uniform2f(at.about, ...about);
    gl.blendEquation(gl.MAX);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.bindVertexArray(s.slots[0].surface);
    gl.drawElements(gl.TRIANGLES, s.index.length, gl.UNSIGNED_INT, 0);
    gl.blendEquation(gl.FUNC_ADD);
    softenShadow();
    blendNormally();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.DEPTH_TEST);
}

function softenShadow() {
    gl.bindFramebuffer(gl.FRAMEBUFFER, programs.soft.buffer);
    gl.useProgram(programs.soften.program);
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, programs.cast.texture);
    gl.uniform1i(programs.soften.at.shadow, 3);
    gl.blendFunc(gl.ONE, gl.ZERO);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.activeTexture(gl.TEXTURE0);
}

function blendNormally() {
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
}

function drawGround(cam, s, ink) {
    const at = use(programs.ground, cam), {about, reach} = shadowPlace(s);
    let spacing = 10 ** Math.floor(Math.log10(s.unit / 8));
    spacing = [1, 2, 5, 10].map((x) => x * spacing).find((x) => x >= s.unit / 12) / s.unit;
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, programs.soft.texture);
    gl.uniform1i(at.shadow, 3);
    gl.uniform1f(at.grid, state.ground ? 1 : 0);
    gl.uniform1f(at.shadowReach, reach);
    gl.uniform1f(at.height, groundOf(s));
    gl.uniform1f(at.reach, 2.5);
    gl.uniform2f(at.about, ...about);
    gl.uniform1f(at.spacing, spacing);
    gl.uniform4fv(at.ink, ink);
    gl.bindVertexArray(s.empty);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
    gl.activeTexture(gl.TEXTURE0);
}

function modeOf(s) {
    if (s.tinted) return 1;
    if (TINT && state.colour === TINT.kind) return s.numbers.length ? 1 : 0;
    return state.colour === "patches" && s.patches ? 2 : state.colour === "materials" && s.materials ? 3 : 0;
}

const WASHES = [[0.15, 0.45, 0.85], [0.85, 0.35, 0.15], [0.2, 0.6, 0.3], [0.6, 0.3, 0.7]];

function drawSurface(panel, cam, size, scale) {
    const {s} = panel, at = use(programs.surface, cam, s);
    gl.uniform1i(at.mode, modeOf(s));
    showPictures(s, at.pictures);
    gl.uniform1f(at.ground, groundOf(s));
    gl.uniform4fv(at.wash, panel.over ? [...WASHES[(s.number - 1) % WASHES.length], 0.5] : [0, 0, 0, 0]);
    gl.bindVertexArray(s.slots[0].surface);
    gl.drawElements(gl.TRIANGLES, s.index.length, gl.UNSIGNED_INT, 0);
    const outline = use(programs.outline, cam, s);
    gl.uniform2f(outline.size, ...size);
    gl.uniform1f(outline.width, 1.1 * scale);
    gl.uniform4fv(outline.ink, dark.matches ? [0.02, 0.03, 0.05, 0.75] : [0.08, 0.09, 0.12, 0.6]);
    gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.FRONT);
    gl.drawElements(gl.TRIANGLES, s.index.length, gl.UNSIGNED_INT, 0);
    gl.disable(gl.CULL_FACE);
}

function drawBones(s, cam, size, scale) {
    const bone = dark.matches ? [0.85, 0.72, 0.6, 1] : [0.45, 0.33, 0.25, 1];
    if (s.bones.length) drawLines(cam, s, s.boneArray, s.bones.length / 2, size, 3 * scale, bone, 0, modeOf(s));
    if (!s.points) return;
    const at = use(programs.point, cam, s);
    gl.uniform1f(at.width, 5 * scale);
    gl.uniform1i(at.mode, modeOf(s));
    gl.uniform4fv(at.ink, bone);
    gl.bindVertexArray(s.empty);
    gl.drawArrays(gl.POINTS, 0, s.nv);
}

function drawPanel(panel, scale) {
    const {s, cut} = panel, w = Math.round(panel.w * scale), h = Math.round(panel.h * scale);
    const x = Math.round(panel.x * scale), y = canvas.height - Math.round(panel.y * scale) - h;
    const cam = panel.cam = camera(w / h, s, shownSequences()), alone = state.wire === 2;
    const ink = dark.matches ? [0.9, 0.92, 0.95] : [0.1, 0.11, 0.14], shaded = !alone && s.index.length > 0;
    bindPlaces(s.slots[0].texture, s.slots[1].texture);
    if (shaded) castShadow(s, cam);
    gl.viewport(x, y, w, h);
    gl.scissor(x + Math.round(cut[0] * w), y, Math.round((cut[1] - cut[0]) * w), h);
    if (shaded || state.ground) drawGround(cam, s, [...ink, 0.3]);
    if (shaded) drawSurface(panel, cam, [w, h], scale);
    drawBones(s, cam, [w, h], scale);
    if (state.wire && s.edges.length)
        drawLines(cam, s, s.edgeArray, s.edges.length / 2, [w, h], scale, alone ? [...ink, 0.7] : [0.05, 0.05, 0.08, 0.55], alone ? 0 : 0.0015);
    if (s.rig && state.joints) drawTrack(cam, s.rig, [w, h], 2.5 * scale, dark.matches ? [1, 0.75, 0.3, 0.95] : [0.75, 0.3, 0.05, 0.95]);
    if (pinned && pinned.s === s && pinned.track) drawTrack(cam, pinned.track, [w, h], 2 * scale, [0.1, 0.5, 0.9, 0.9]);
}

function drawBackdrop() {
    gl.useProgram(programs.backdrop.program);
    gl.uniform3fv(programs.backdrop.at.low, dark.matches ? [0.062, 0.071, 0.086] : [0.894, 0.906, 0.925]);
    gl.uniform3fv(programs.backdrop.at.high, dark.matches ? [0.110, 0.125, 0.149] : [0.980, 0.984, 0.988]);
    gl.bindVertexArray(sequences[0].empty);
    gl.disable(gl.DEPTH_TEST);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.enable(gl.DEPTH_TEST);
}

let drawn = []; /* the panels of the last picture, with their cameras */

function render() {
    wanted = false;
    const scale = Math.min(window.devicePixelRatio || 1, 2), w = Math.round(canvas.clientWidth * scale), h = Math.round(canvas.clientHeight * scale);
    if (!w || !h || gl.isContextLost()) return;
    const list = panels();
    const there = list.map(({s}) => take(s)).every((x) => x);
    if (!there) return; /* draws when it is */
    if (canvas.width !== w || canvas.height !== h) canvas.width = w, canvas.height = h;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    gl.enable(gl.BLEND);
    blendNormally();
    gl.viewport(0, 0, w, h);
    gl.scissor(0, 0, w, h);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    drawBackdrop();
    for (const panel of list) drawPanel(panel, scale);
    drawn = list;
    showPicked();
    if (afterDraw) afterDraw();
    document.documentElement.dataset.part = state.part.toFixed(4);
    document.documentElement.dataset.drawn = String(state.frame);
}

function draw() {
    if (!wanted) wanted = true, requestAnimationFrame(render);
}

