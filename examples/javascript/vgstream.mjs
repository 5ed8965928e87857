// vgstream.mjs: read and write vg streams in node and in browsers; a module without dependencies.
//
//     import { read, write, mesh } from './vgstream.mjs';
//     const walk = read(new Uint8Array(await response.arrayBuffer()));   // or await fs.readFile('walk.vgs')
//     for (const frame of walk.frames) frame.values[1] += 0.1;            // Float64Array of count * width numbers
//     const bytes = write(walk);
//
// Every checksum and length is checked; what is wrong throws a StreamError. Records of the header are kept as bytes, so that
// what this file does not interpret goes through unchanged. A stream is held as a whole: it leaves out reading piece by piece.
// SPDX-License-Identifier: GPL-3.0-or-later

const MAGIC = [0x89, 0x56, 0x47, 0x53, 0x0d, 0x0a, 0x1a, 0x31];
const CRITICAL = 1, COPY_SAFE = 2;
const PLAIN = ['TEXC', 'LABL', 'COLV', 'ASST', 'SKEL', 'PTCH', 'RIG ', 'SKIN'];
const KNOWN = new Set([...PLAIN, 'PROV', 'MESH', 'SELE', 'LINK', 'ANCH', 'REFP', 'CORR', 'MAP ', 'SIGN', 'NETW', 'FORM', 'FRAM', 'FAIL', 'END ']);
const flagsOf = (tag) => (tag === 'PROV' ? COPY_SAFE : PLAIN.includes(tag) ? 0 : CRITICAL);
const pad = (n) => (8 - (n % 8)) % 8;

export class StreamError extends Error {}

// ---- XXH64 with seed 0 (github.com/Cyan4973/xxHash, doc/xxhash_spec.md) ----

const M = 0xffffffffffffffffn;
const P1 = 0x9e3779b185ebca87n, P2 = 0xc2b2ae3d27d4eb4fn, P3 = 0x165667b19e3779f9n, P4 = 0x85ebca77c2b2ae63n, P5 = 0x27d4eb2f165667c5n;
const rotate = (x, n) => ((x << n) | (x >> (64n - n))) & M;
const round = (lane, word) => (rotate((lane + word * P2) & M, 31n) * P1) & M;

export function xxh64(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), n = bytes.byteLength;
    const word = (at) => view.getBigUint64(at, true);
    let h = P5, at = 0;
    if (n >= 32) {
        let a = (P1 + P2) & M, b = P2, c = 0n, d = -P1 & M;
        for (; at + 32 <= n; at += 32) a = round(a, word(at)), b = round(b, word(at + 8)), c = round(c, word(at + 16)), d = round(d, word(at + 24));
        h = (rotate(a, 1n) + rotate(b, 7n) + rotate(c, 12n) + rotate(d, 18n)) & M;
        for (const lane of [a, b, c, d]) h = ((h ^ round(0n, lane)) * P1 + P4) & M;
    }
    h = (h + BigInt(n)) & M;
    for (; at + 8 <= n; at += 8) h = (rotate(h ^ round(0n, word(at)), 27n) * P1 + P4) & M;
    if (at + 4 <= n) h = (rotate(h ^ ((BigInt(view.getUint32(at, true)) * P1) & M), 23n) * P2 + P3) & M, at += 4;
    for (; at < n; at++) h = (rotate(h ^ ((BigInt(bytes[at]) * P5) & M), 11n) * P1) & M;
    h = ((h ^ (h >> 33n)) * P2) & M;
    h = ((h ^ (h >> 29n)) * P3) & M;
    return h ^ (h >> 32n);
}

// ---- fields of a record ----

class Fields {
    constructor(bytes, where) {
        this.bytes = bytes, this.where = where, this.at = 0;
        this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    }
    take(n) {
        const from = this.at, end = from + n;
        if (!(end + pad(n) <= this.bytes.length)) throw new StreamError(`${this.where} is shorter than its fields`);
        for (let i = end; i < end + pad(n); i++) if (this.bytes[i]) throw new StreamError(`${this.where} has padding that is not zero`);
        this.at = end + pad(n);
        return from;
    }
    u64() {
        const x = this.view.getBigUint64(this.take(8), true);
        if (x > BigInt(Number.MAX_SAFE_INTEGER)) throw new StreamError(`${this.where} has a count that is out of range`);
        return Number(x);
    }
    text() {
        const n = this.u64(), from = this.take(n);
        try {
            return new TextDecoder('utf-8', { fatal: true, ignoreBOM: true }).decode(this.bytes.subarray(from, from + n));
        } catch {
            throw new StreamError(`${this.where} has a text that is not UTF-8`);
        }
    }
    numbers(type, n) { // type: 1 u32, 4 f32, 8 f64
        const size = type === 8 ? 8 : 4, from = this.take(size * n), get = type === 1 ? 'getUint32' : type === 4 ? 'getFloat32' : 'getFloat64';
        const out = type === 1 ? new Uint32Array(n) : type === 4 ? new Float32Array(n) : new Float64Array(n);
        for (let i = 0; i < n; i++) {
            out[i] = this.view[get](from + size * i, true);
            if (!Number.isFinite(out[i])) throw new StreamError(`${this.where} has a number that is not finite`);
        }
        return out;
    }
    end() {
        if (this.at !== this.bytes.length) throw new StreamError(`${this.where} is longer than its fields`);
    }
}

class Bytes { // they grow
    constructor() { this.data = new Uint8Array(1 << 16), this.size = 0; }
    room(n) {
        if (this.size + n > this.data.length) {
            const larger = new Uint8Array(Math.max(2 * this.data.length, this.size + n));
            larger.set(this.data.subarray(0, this.size));
            this.data = larger;
        }
        const from = this.size;
        this.size += n;
        return new DataView(this.data.buffer, from, n);
    }
    add(bytes) { new Uint8Array(this.room(bytes.length + pad(bytes.length)).buffer, this.size - bytes.length - pad(bytes.length)).set(bytes); return this; }
    u64(x) { this.room(8).setBigUint64(0, BigInt(x), true); return this; }
    text(s) { const b = new TextEncoder().encode(s); return this.u64(b.length).add(b); }
    numbers(type, x) {
        const size = type === 8 ? 8 : 4, view = this.room(size * x.length + pad(size * x.length)), set = type === 1 ? 'setUint32' : type === 4 ? 'setFloat32' : 'setFloat64';
        for (let i = 0; i < x.length; i++) {
            if (!Number.isFinite(type === 4 ? Math.fround(x[i]) : x[i])) throw new RangeError(`number ${i} does not fit the precision of the stream`);
            view[set](size * i, x[i], true);
        }
        return this;
    }
    done() { return this.data.slice(0, this.size); }
}

// ---- reading ----

function readRecord(bytes, at, index) {
    if (at + 32 > bytes.length) throw new StreamError('the stream ends before its END record');
    const view = new DataView(bytes.buffer, bytes.byteOffset + at, 32), tag = String.fromCharCode(...bytes.subarray(at, at + 4));
    if (xxh64(bytes.subarray(at, at + 24)) !== view.getBigUint64(24, true)) throw new StreamError(`the header of record ${index} is damaged`);
    const flags = view.getUint32(4, true), length = view.getBigUint64(8, true);
    if (!/^[A-Z0-9 ]{4}$/.test(tag) || flags & 0xfffc || length > 1n << 40n) throw new StreamError(`record ${index} has a header that is against the rules`);
    const n = Number(length), end = at + 32 + n;
    if (end + pad(n) > bytes.length) throw new StreamError('the stream ends before its END record');
    const payload = bytes.subarray(at + 32, end);
    if (xxh64(payload) !== view.getBigUint64(16, true) || bytes.subarray(end, end + pad(n)).some((b) => b)) throw new StreamError(`record ${index}, '${tag}', is damaged`);
    if (tag === 'FAIL') {
        const f = new Fields(payload, 'record FAIL');
        f.u64();
        throw new StreamError(`${f.text()} failed: ${f.text()}`);
    }
    if (!KNOWN.has(tag) && flags & CRITICAL) throw new StreamError(`record '${tag}' is critical, and this reader does not know it`);
    return { tag, flags, payload, sum: bytes.subarray(at + 24, at + 32), next: end + pad(n) };
}

function readFrame(payload, head, extra) {
    const f = new Fields(payload, 'a frame'), frame = { name: f.text(), channels: [], values: null, extra };
    for (let n = f.u64(); n > 0; n--) {
        const c = { name: f.text(), unit: f.text(), element: f.text(), width: f.u64() }, count = f.u64();
        c.type = f.u64();
        if (![1, 4, 8].includes(c.type)) throw new StreamError(`channel '${c.name}' has type ${c.type}`);
        c.numbers = f.numbers(c.type, c.width * count);
        frame.channels.push(c);
    }
    frame.values = Float64Array.from(f.numbers(head.precision, head.count * head.width));
    f.end();
    return frame;
}

function readForm(stream, payload) {
    const f = new Fields(payload, 'record FORM');
    Object.assign(stream, { form: f.text(), element: f.text(), width: f.u64(), count: f.u64(), precision: f.u64() });
    f.end();
    if (stream.precision !== 4 && stream.precision !== 8) throw new StreamError(`record FORM has precision ${stream.precision}`);
}

// Uint8Array -> { records, form, element, width, count, precision, frames, tail }
export function read(bytes) {
    if (!bytes.length) throw new StreamError('no bytes: has the program before failed?');
    if (bytes.length < 16 || MAGIC.some((b, i) => bytes[i] !== b) || bytes.subarray(12, 16).some((b) => b)) throw new StreamError('this is not a vg stream of version 1');
    const stream = { records: [], form: null, frames: [], tail: [] }, sums = new Bytes();
    let at = 16, index = 0, extra = [];
    for (;;) {
        const { tag, flags, payload, sum, next } = readRecord(bytes, at, index);
        at = next;
        if (tag === 'END ') {
            const f = new DataView(payload.buffer, payload.byteOffset, payload.byteLength);
            if (stream.form === null) throw new StreamError("record 'END ' comes before FORM");
            if (payload.length !== 16 || f.getBigUint64(0, true) !== BigInt(index) || f.getBigUint64(8, true) !== xxh64(sums.done())) throw new StreamError('the END record does not agree with what came before it');
            if (at !== bytes.length) throw new StreamError('something follows the END record');
            stream.tail = extra;
            return stream;
        }
        sums.add(sum);
        index++;
        if (tag === 'FORM' && stream.form === null) readForm(stream, payload);
        else if (tag === 'FRAM' && stream.form !== null) stream.frames.push(readFrame(payload, stream, extra)), (extra = []);
        else if (stream.form === null && tag !== 'FRAM') stream.records.push({ tag, flags, payload });
        else if (!KNOWN.has(tag)) extra.push({ tag, flags, payload });
        else throw new StreamError(`record '${tag}' is not in its place`);
    }
}

// { nv, faces, reference } of a stream with a mesh; else null
export function meshOf(stream) {
    const topology = stream.records.find((r) => r.tag === 'MESH'), pose = stream.records.find((r) => r.tag === 'REFP');
    if (!topology || !pose) return null;
    const f = new Fields(topology.payload, 'record MESH'), nv = f.u64(), nf = f.u64(), start = f.numbers(1, nf + 1), vert = f.numbers(1, start[nf]);
    const p = new Fields(pose.payload, 'record REFP');
    p.text();
    return { nv, faces: Array.from({ length: nf }, (_, i) => Array.from(vert.subarray(start[i], start[i + 1]))), reference: p.numbers(8, 3 * nv) };
}

// ---- writing ----

// a stream of vertices without frames: points is flat x y z, faces are lists of vertices
export function mesh(points, faces, precision = 8) {
    const start = [0];
    for (const face of faces) start.push(start[start.length - 1] + face.length);
    const nv = points.length / 3;
    if (faces.some((f) => f.length < 2 || new Set(f).size !== f.length || f.some((v) => !(v >= 0 && v < nv)))) throw new RangeError('a face needs two different vertices or more, each below the number of points');
    const topology = new Bytes().u64(nv).u64(faces.length).numbers(1, start).numbers(1, faces.flat()).done();
    const records = [{ tag: 'MESH', flags: CRITICAL, payload: topology }, { tag: 'REFP', flags: CRITICAL, payload: new Bytes().text('reference').numbers(8, points).done() }];
    return { records, form: 'vertices', element: 'vertex', width: 3, count: nv, precision, frames: [], tail: [] };
}

// stream -> Uint8Array. Unknown records that are not copy-safe are left out.
export function write(stream) {
    const out = new Bytes().add(Uint8Array.from(MAGIC)).u64(0), sums = new Bytes();
    let count = 0;
    const put = (tag, flags, payload) => {
        const header = new Bytes(), first = header.room(16);
        for (let i = 0; i < 4; i++) first.setUint8(i, tag.charCodeAt(i));
        first.setUint32(4, flags, true);
        first.setBigUint64(8, BigInt(payload.length), true);
        header.u64(xxh64(payload));
        const sum = xxh64(header.done());
        out.add(header.u64(sum).done()).add(payload);
        if (tag !== 'END ') sums.u64(sum), count++;
    };
    const putAll = (records) => {
        for (const { tag, flags, payload } of records) {
            if (KNOWN.has(tag)) put(tag, flagsOf(tag), payload);
            else if (flags & COPY_SAFE) put(tag, flags, payload);
        }
    };
    putAll(stream.records);
    put('FORM', CRITICAL, new Bytes().text(stream.form).text(stream.element).u64(stream.width).u64(stream.count).u64(stream.precision).done());
    for (const frame of stream.frames) {
        if (frame.values.length !== stream.count * stream.width) throw new RangeError(`frame '${frame.name}' has ${frame.values.length} numbers, not ${stream.count} x ${stream.width}`);
        const channels = frame.channels ?? [], b = new Bytes().text(frame.name).u64(channels.length);
        for (const c of channels) b.text(c.name).text(c.unit).text(c.element).u64(c.width).u64(c.numbers.length / c.width).u64(c.type).numbers(c.type, c.numbers);
        b.numbers(stream.precision, frame.values);
        putAll(frame.extra ?? []);
        put('FRAM', CRITICAL, b.done());
    }
    putAll(stream.tail ?? []);
    put('END ', CRITICAL, new Bytes().u64(count).u64(xxh64(sums.done())).done());
    return out.done();
}
