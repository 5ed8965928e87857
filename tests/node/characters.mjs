// characters.mjs: three.js as an independent judge of glTF: plays an animation of two files and says how far their vertices,
// normals, texture coordinates, materials and names are apart.
//
//   node characters.mjs BEFORE.glb AFTER.glb [ANIMATION]       ('*': all of them)
//
// Both files are played at the times of the keys of BEFORE's animation (its morph targets when there is none are not
// played: the rest pose is compared). One line of JSON: {"position": of D, "normal": degrees at rest, "turned": degrees when it
// plays, ...}
// SPDX-License-Identifier: GPL-3.0-or-later
import fs from "fs";
import { createRequire } from "module";
import path from "path";
import { pathToFileURL } from "url";

const require = createRequire(path.join((process.env.NODE_PATH || process.cwd()).split(":")[0], "x.js"));
const root = path.dirname(path.dirname(require.resolve("three")));
const THREE = await import(pathToFileURL(path.join(root, "build/three.module.js")));
globalThis.self = globalThis;
const { GLTFLoader } = await import(pathToFileURL(path.join(root, "examples/jsm/loaders/GLTFLoader.js")));

// Pictures are compared as bytes, in the file itself: there is no canvas here.
async function load(file) {
    const bytes = fs.readFileSync(file);
    const loader = new GLTFLoader();
    loader.register(() => ({ name: "no pictures", loadTexture: () => Promise.resolve(new THREE.Texture()) }));
    const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
    return new Promise((done, failed) => loader.parse(data, path.dirname(file) + "/", done, failed));
}

function meshes(gltf) {
    const found = [];
    gltf.scene.updateMatrixWorld(true);
    gltf.scene.traverse(o => { if (o.isMesh || o.isLine || o.isPoints) found.push(o); });
    return found;
}

function positions(gltf) {
    const out = [], p = new THREE.Vector3();
    for (const m of meshes(gltf))
        for (let i = 0; i < m.geometry.attributes.position.count; i++) {
            m.getVertexPosition(i, p).applyMatrix4(m.matrixWorld);
            out.push(p.x, p.y, p.z);
        }
    return out;
}

// Normals as they are shown: morph targets, then the mean of the joints, then the node.
function normals(gltf) {
    const out = [], n = new THREE.Vector3(), d = new THREE.Vector3(), sum = new THREE.Matrix4(), bone = new THREE.Matrix4();
    for (const m of meshes(gltf)) {
        const g = m.geometry, a = g.attributes.normal, targets = g.morphAttributes.normal || [];
        for (let i = 0; a && i < a.count; i++) {
            n.fromBufferAttribute(a, i);
            targets.forEach((t, k) => n.addScaledVector(d.fromBufferAttribute(t, i), m.morphTargetInfluences[k]));
            if (m.isSkinnedMesh) {
                sum.elements.fill(0);
                for (let k = 0; k < 4; k++) {
                    const j = g.attributes.skinIndex.getComponent(i, k), w = g.attributes.skinWeight.getComponent(i, k);
                    bone.multiplyMatrices(m.skeleton.bones[j].matrixWorld, m.skeleton.boneInverses[j]);
                    bone.elements.forEach((x, e) => { sum.elements[e] += w * x; });
                }
                n.transformDirection(sum);
            } else {
                n.applyNormalMatrix(new THREE.Matrix3().getNormalMatrix(m.matrixWorld));
            }
            out.push(n.x, n.y, n.z);
        }
    }
    return out;
}

function attribute(gltf, name, width) {
    const out = [];
    for (const m of meshes(gltf)) {
        const a = m.geometry.attributes[name];
        for (let i = 0; a && i < a.count; i++)
            for (let k = 0; k < width; k++) out.push(a.getComponent(i, k));
    }
    return out;
}

function diagonal(p) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    p.forEach((x, i) => { low[i % 3] = Math.min(low[i % 3], x); high[i % 3] = Math.max(high[i % 3], x); });
    return Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

function farthest(a, b) {
    if (a.length !== b.length) return Infinity;
    let worst = 0;
    for (let i = 0; i < a.length; i += 3)
        worst = Math.max(worst, Math.hypot(a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]));
    return worst;
}

function largest(a, b) {
    return a.length === b.length ? a.reduce((w, x, i) => Math.max(w, Math.abs(x - b[i])), 0) : Infinity;
}

function widest(a, b) {
    if (a.length !== b.length) return Infinity;
    let worst = 0;
    for (let i = 0; i < a.length; i += 3) {
        const p = new THREE.Vector3(a[i], a[i + 1], a[i + 2]), q = new THREE.Vector3(b[i], b[i + 1], b[i + 2]);
        if (p.length() > 0) worst = Math.max(worst, p.angleTo(q) * 180 / Math.PI);
    }
    return worst;
}

// A node of three.js has the material of one primitive; what a texture shows is compared by its settings.
function materials(gltf) {
    return meshes(gltf).map(m => [m.material.name, m.material.type, m.material.color && m.material.color.getHex(),
        !!m.material.map, !!m.material.normalMap, m.material.roughness, m.material.metalness, m.material.side].join("|"));
}

// three.js calls an animation without a name animation_0; vg calls it after the file.
function find_clip(gltf, name) {
    const all = gltf.animations;
    return all.find(c => c.name === name) || (all.length === 1 && before.animations[0].name === "animation_0" ? all[0] : null);
}

function play(gltf, name, times, look) {
    const clip = find_clip(gltf, name);
    if (!clip) throw new Error(`no animation ${name}: ${gltf.animations.map(c => c.name)}`);
    const mixer = new THREE.AnimationMixer(gltf.scene), action = mixer.clipAction(clip);
    action.setLoop(THREE.LoopOnce);
    action.clampWhenFinished = true;
    action.play();
    const looks = times.map(t => { action.time = 0; action.paused = false; action.enabled = true; mixer.setTime(t); return look(gltf); });
    mixer.stopAllAction(); // what this animation does not move is at rest in the next one
    return looks;
}

function key_times(gltf, name) {
    const clip = gltf.animations.find(c => c.name === name), all = new Set();
    if (!clip) throw new Error(`no animation ${name}: ${gltf.animations.map(c => c.name)}`);
    clip.tracks.forEach(t => t.times.forEach(x => all.add(x)));
    return [...all].sort((a, b) => a - b);
}

const [before_file, after_file, name] = process.argv.slice(2);
const before = await load(before_file), after = await load(after_file);
const at_rest = positions(before), d = diagonal(at_rest);
const report = {
    vertices: at_rest.length / 3,
    rest: farthest(at_rest, positions(after)) / d,
    normal: widest(attribute(before, "normal", 3), attribute(after, "normal", 3)),
    uv: largest(attribute(before, "uv", 2), attribute(after, "uv", 2)),
    materials: JSON.stringify(materials(before)) === JSON.stringify(materials(after)),
    nodes: JSON.stringify(names(before)) === JSON.stringify(names(after)),
    animations: after.animations.map(c => c.name),
    named: JSON.stringify(before.animations.map(c => c.name)) === JSON.stringify(after.animations.map(c => c.name)),
};
function names(gltf) {
    const out = [];
    gltf.scene.traverse(o => out.push(o.name));
    return out.sort(); // a mesh with a skin may become a root
}
// Largest values over the animations; NaN stays.
function worst(all) {
    return all.reduce((w, x) => (x <= w ? w : x), 0);
}
const played = name === "*" ? before.animations.map(c => c.name) : name ? [name] : [];
const found = { moved: [], position: [], turned: [] };
for (const clip of played) {
    const times = key_times(before, clip), a = play(before, clip, times, positions), b = play(after, clip, times, positions);
    const c = play(before, clip, times, normals), e = play(after, clip, times, normals);
    report.frames = (report.frames || 0) + times.length;
    a.forEach((p, i) => {
        found.moved.push(farthest(p, at_rest) / d);
        found.position.push(farthest(p, b[i]) / d);
        found.turned.push(widest(c[i], e[i]));
    });
}
if (played.length) for (const key in found) report[key] = worst(found[key]);
console.log(JSON.stringify(report));
