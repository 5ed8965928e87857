/* page_pairs_fit.js: the fit of picked pairs: a similarity, then what it leaves is spread around the pairs. It says where the
 * partner of a point should be, and how far each pair is from where the others expect it.
 * A page that vg-view makes holds this file; as an exception to the licence, such pages may be passed on under any terms.
 * SPDX-License-Identifier: GPL-3.0-or-later */

const LEAST_SCALE = 0.05, REACH = 0.05; /* where colours end, and the largest distance that is coloured; in D */

/* ---- points of a mesh ---- */

function normalOf(s, v) {
    const sum = [0, 0, 0];
    for (let i = s.ringStart[v]; i < s.ringStart[v + 1]; i++)
        for (let k = 0; k < 3; k++) sum[k] += s.faceNormals[4 * s.ring[i] + 3] * s.faceNormals[4 * s.ring[i] + k];
    const size = Math.hypot(...sum) || 1;
    return sum.map((x) => x / size);
}

/* The nearest vertex of a face, no farther than `limit`, whose normal does not look away; null: there is none. */
function nearestVertex(s, at, normal, limit) {
    const {xyz} = s.slots[0];
    let best = null, least = limit * limit;
    for (let v = 0; v < s.nv; v++) {
        const d = (xyz[4 * v] - at[0]) ** 2 + (xyz[4 * v + 1] - at[1]) ** 2 + (xyz[4 * v + 2] - at[2]) ** 2;
        if (d < least && s.component[v] && dot(normalOf(s, v), normal) > 0) least = d, best = v;
    }
    return best;
}

/* ---- the similarity ---- */

/* The eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix, by Jacobi's rotations. */
function largestEigenvector(m) {
    const a = m.map((row) => row.slice()), q = [0, 1, 2, 3].map((i) => [0, 1, 2, 3].map((j) => +(i === j)));
    for (let sweep = 0; sweep < 30; sweep++)
        for (let i = 0; i < 3; i++)
            for (let j = i + 1; j < 4; j++) {
                if (Math.abs(a[i][j]) < 1e-300) continue;
                const theta = (a[j][j] - a[i][i]) / (2 * a[i][j]), t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.hypot(theta, 1));
                const c = 1 / Math.hypot(t, 1), s = t * c;
                for (let k = 0; k < 4; k++) [a[k][i], a[k][j]] = [c * a[k][i] - s * a[k][j], s * a[k][i] + c * a[k][j]];
                for (let k = 0; k < 4; k++) [a[i][k], a[j][k]] = [c * a[i][k] - s * a[j][k], s * a[i][k] + c * a[j][k]];
                for (let k = 0; k < 4; k++) [q[k][i], q[k][j]] = [c * q[k][i] - s * q[k][j], s * q[k][i] + c * q[k][j]];
            }
    const best = [0, 1, 2, 3].reduce((b, i) => a[i][i] > a[b][b] ? i : b, 0);
    return q.map((row) => row[best]);
}

const meanOf = (points) => [0, 1, 2].map((k) => points.reduce((sum, p) => sum + p[k], 0) / points.length);

/* Horn (1987): the rotation, scale and shift of least squares from points to points; null: the points coincide. */
function similarity(from, to) {
    const c = meanOf(from), d = meanOf(to), S = [0, 1, 2].map((i) => [0, 1, 2].map((j) =>
        from.reduce((sum, p, n) => sum + (p[i] - c[i]) * (to[n][j] - d[j]), 0)));
    const [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = S;
    const [w, x, y, z] = largestEigenvector([
        [xx + yy + zz, yz - zy, zx - xz, xy - yx], [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy], [xy - yx, zx + xz, yz + zy, zz - xx - yy]]);
    const R = [[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
               [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
               [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]];
    const spread = (points, m) => Math.sqrt(points.reduce((sum, p) => sum + p.reduce((s, q, k) => s + (q - m[k]) ** 2, 0), 0));
    const a = spread(from, c), b = spread(to, d);
    if (!(a > 0 && b > 0)) return null;
    const turn = (p) => R.map((row) => dot(row, p));
    return {scale: b / a, turn, to: (p) => turn(p.map((q, k) => q - c[k])).map((q, k) => d[k] + b / a * q)};
}

/* ---- the fit ---- */

/* What pairs leave at a point: their own leftovers, weighted by the inverse square of their distance. */
function spreadLeft(list, p) {
    let total = 0;
    const sum = [0, 0, 0];
    for (const x of list) {
        const weight = 1 / (x.from.reduce((s, q, k) => s + (q - p[k]) ** 2, 0) + 1e-6) ** 1.5;
        total += weight;
        for (let k = 0; k < 3; k++) sum[k] += weight * x.left[k];
    }
    return sum.map((s) => total > 0 ? s / total : 0);
}

function mapped(rigid, list, p) {
    const left = spreadLeft(list, p);
    return rigid.to(p).map((q, k) => q + left[k]);
}

function withLeft(rigid, points) {
    return points.map((x) => ({...x, left: rigid.to(x.from).map((q, k) => x.to[k] - q)}));
}

/* How far a pair is from where the others expect it. */
function leftOverOf(points, i) {
    const others = points.filter((_, k) => k !== i), rigid = similarity(others.map((x) => x.from), others.map((x) => x.to));
    if (!rigid) return null;
    const at = mapped(rigid, withLeft(rigid, others), points[i].from);
    return Math.hypot(...at.map((q, k) => q - points[i].to[k]));
}

function fitPairs(pairs) {
    if (pairs.length < 3) return null;
    const points = pairs.map((pair) => ({pair, from: placeNow(sequences[0], pair.a), to: placeNow(sequences[1], pair.b)}));
    const rigid = similarity(points.map((x) => x.from), points.map((x) => x.to));
    if (!rigid) return null;
    const list = withLeft(rigid, points), back = similarity(points.map((x) => x.to), points.map((x) => x.from));
    const backList = withLeft(back, points.map((x) => ({pair: x.pair, from: x.to, to: x.from})));
    const errors = points.map((x, i) => points.length > 3 ? leftOverOf(points, i) : Math.hypot(...list[i].left));
    const known = errors.filter((x) => x !== null), most = Math.max(0, ...known);
    return {rigid, list, back, backList, most, scale: Math.max(LEAST_SCALE, most), leftOver: new Map(pairs.map((p, i) => [p, errors[i]])),
            mean: known.reduce((sum, x) => sum + x, 0) / Math.max(1, known.length)};
}

/* Where the fit expects the partner of a pair that has one vertex. */
function suggest(pair) {
    if (!pair || !marking.fit || whole(pair) || (pair.a === null && pair.b === null)) return null;
    const forth = pair.b === null, s = sequences[forth ? 0 : 1], other = sequences[forth ? 1 : 0], v = forth ? pair.a : pair.b;
    const {rigid, list, back, backList} = marking.fit, way = forth ? rigid : back;
    const found = nearestVertex(other, mapped(way, forth ? list : backList, placeNow(s, v)), way.turn(normalOf(s, v)), Infinity);
    return found === null ? null : {side: forth ? "b" : "a", v: found};
}

/* ---- colours ---- */

/* The vertices of the fitted source by cells as large as the reach. */
function fittedCells() {
    const cells = new Map(), s = sequences[0], {rigid, list} = marking.fit;
    for (let v = 0; v < s.nv; v++) {
        if (!s.component[v]) continue;
        const p = mapped(rigid, list, placeNow(s, v)), key = p.map((x) => Math.floor(x / REACH)).join();
        if (!cells.has(key)) cells.set(key, []);
        cells.get(key).push({p, n: rigid.turn(normalOf(s, v))});
    }
    return cells;
}

/* The distance of a point from the tangent plane of the nearest fitted vertex. */
function distanceFrom(cells, q) {
    const cell = q.map((x) => Math.floor(x / REACH));
    let least = REACH * REACH, nearest = null;
    for (let i = -1; i < 2; i++)
        for (let j = -1; j < 2; j++)
            for (let k = -1; k < 2; k++)
                for (const x of cells.get([cell[0] + i, cell[1] + j, cell[2] + k].join()) || []) {
                    const d = (x.p[0] - q[0]) ** 2 + (x.p[1] - q[1]) ** 2 + (x.p[2] - q[2]) ** 2;
                    if (d < least) least = d, nearest = x;
                }
    return nearest ? Math.abs(dot(nearest.n, q.map((x, k) => x - nearest.p[k]))) : REACH;
}

function colourLeftOver() {
    const s = sequences[1], slot = s.slots[0], cells = marking.fit ? fittedCells() : null;
    s.tinted = Boolean(cells);
    for (let v = 0; cells && v < s.nv; v++) slot.xyz[4 * v + 3] = distanceFrom(cells, placeNow(s, v)) / REACH;
    upload(s, slot);
    document.documentElement.dataset.leftOver = cells ? "shown" : "";
}

function toggleLeftOver() {
    marking.leftOver = !marking.leftOver;
    $("pair-colours").setAttribute("aria-pressed", String(marking.leftOver));
    if (marking.leftOver) colourLeftOver();
    else sequences[1].tinted = false, document.documentElement.dataset.leftOver = "";
    draw();
}
