/* signal_math.js: a signal as numbers: time -> curve -> surface -> shape coordinates, as lib/signal computes them.
 * Leaves out edits (signal_edit.js) and the mesh (signal_live.js). Frames are at times 1, 2, ..., n.
 * SPDX-License-Identifier: GPL-3.0-or-later */

/* ---- monotone and natural interpolation ---- */

/* Fritsch and Carlson's slopes of the monotone interpolant of y at the places x. */
function monotoneSlopes(x, y) {
    const n = y.length, slope = new Float64Array(n), secant = (i) => (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    if (n < 3) return n === 2 ? slope.fill(Math.max(secant(0), 0)) : slope;
    const atEnd = (h, d, g, c) => ((2 * h + g) * d - h * c) / (h + g);
    for (let i = 0; i < n; i++) {
        const j = i === 0 ? 0 : i + 1 < n ? i - 1 : n - 3, h = x[j + 1] - x[j], g = x[j + 2] - x[j + 1], d = secant(j), c = secant(j + 1);
        slope[i] = Math.max(0, i === 0 ? atEnd(h, d, g, c) : i + 1 < n ? (g * d + h * c) / (h + g) : atEnd(g, c, h, d));
    }
    for (let i = 0; i + 1 < n; i++) if (!(secant(i) > 0)) slope[i] = slope[i + 1] = 0;
    for (let i = 0; i + 1 < n; i++) {
        const d = secant(i), a = slope[i] / d, b = slope[i + 1] / d, square = a * a + b * b;
        if (d > 0 && square > 9) slope[i] = 3 / Math.sqrt(square) * a * d, slope[i + 1] = 3 / Math.sqrt(square) * b * d;
    }
    return slope;
}

/* The interval of the rising list x that holds `at`. */
function intervalOf(x, at) {
    let low = 0, high = x.length - 1;
    while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (at < x[middle]) high = middle;
        else low = middle;
    }
    return low;
}

function monotoneAt(x, y, slope, at) {
    const n = y.length;
    if (!(at > x[0])) return y[0];
    if (!(at < x[n - 1])) return y[n - 1];
    const i = intervalOf(x, at), width = x[i + 1] - x[i], h = (at - x[i]) / width, g = 1 - h;
    return y[i] * (1 + 2 * h) * g * g + width * slope[i] * h * g * g + y[i + 1] * h * h * (3 - 2 * h) - width * slope[i + 1] * h * h * g;
}

/* Second derivatives of the natural cubic spline through rows of w numbers at the places x. */
function naturalSeconds(x, rows, w) {
    const n = x.length, second = new Float64Array(n * w), factor = new Float64Array(n);
    for (let i = 1; i + 1 < n; i++) {
        const g = x[i] - x[i - 1], h = x[i + 1] - x[i], pivot = 2 * (g + h) - g * factor[i - 1];
        factor[i] = h / pivot;
        for (let c = 0; c < w; c++) {
            const bend = (rows[(i + 1) * w + c] - rows[i * w + c]) / h - (rows[i * w + c] - rows[(i - 1) * w + c]) / g;
            second[i * w + c] = (6 * bend - g * second[(i - 1) * w + c]) / pivot;
        }
    }
    for (let i = n - 2; i > 0; i--)
        for (let c = 0; c < w; c++) second[i * w + c] -= factor[i] * second[(i + 1) * w + c];
    return second;
}

function naturalAt(x, rows, second, w, at, out) {
    const n = x.length, t = Math.max(x[0], Math.min(x[n - 1], at)), i = n > 1 ? intervalOf(x, t) : 0, next = Math.min(i + 1, n - 1);
    const h = next > i ? x[next] - x[i] : 1, b = (t - x[i]) / h, a = 1 - b, p = (a * a * a - a) * h * h / 6, q = (b * b * b - b) * h * h / 6;
    for (let c = 0; c < w; c++) out[c] = a * rows[i * w + c] + b * rows[next * w + c] + p * second[i * w + c] + q * second[next * w + c];
    return out;
}

/* ---- the time signal: a cubic B-spline ---- */

/* Knots in the page leave out the first and the last, which say nothing. */
function makeCurve(parameter, knots, control) {
    const knot = Float64Array.from([knots[0], ...knots, knots[knots.length - 1]]);
    const times = Float64Array.from(parameter, (_, i) => i + 1);
    return {times, t: parameter, slope: monotoneSlopes(times, parameter), knot, control: Float64Array.from(control), k: control.length / 2};
}

const parameterAt = (c, time) => monotoneAt(c.times, c.t, c.slope, time);

/* The number of the first of four control points that matter at u, and their weights. */
const weights = new Float64Array(4);
function basisAt(knot, k, u) {
    let low = 3, high = k;
    while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (u < knot[middle]) high = middle;
        else low = middle;
    }
    while (low > 3 && knot[low] === knot[low + 1]) low--;
    weights[0] = 1;
    for (let d = 1; d < 4; d++) {
        let kept = 0;
        for (let a = 0; a < d; a++) {
            const right = knot[low + a + 1], left = knot[low + 1 + a - d], w = right > left ? weights[a] / (right - left) : 0;
            weights[a] = kept + (right - u) * w;
            kept = (u - left) * w;
        }
        weights[d] = kept;
    }
    return low - 3;
}

function curvePoint(c, parameter) {
    const u = Math.max(c.knot[3], Math.min(c.knot[c.k], parameter)), f = 2 * basisAt(c.knot, c.k, u), [b0, b1, b2, b3] = weights, p = c.control;
    return [b0 * p[f] + b1 * p[f + 2] + (b2 * p[f + 4] + b3 * p[f + 6]), b0 * p[f + 1] + b1 * p[f + 3] + (b2 * p[f + 5] + b3 * p[f + 7])];
}

const curveAt = (c, time) => curvePoint(c, parameterAt(c, time));

/* The first and the last frame that a control point moves. */
function supportOf(c, i) {
    const from = c.knot[i], to = c.knot[i + 4], n = c.t.length;
    let first = n, last = -1;
    for (let f = 0; f < n; f++)
        if ((c.t[f] > from || (i < 1 && f === 0)) && (c.t[f] < to || (i === c.k - 1 && f === n - 1))) first = Math.min(first, f), last = f;
    return [first, last];
}

/* One more knot and control point; the curve stays as it is (Boehm). null: outside of the ends. */
function insertControl(c, parameter) {
    const {k, knot, control: old} = c, control = new Float64Array(2 * (k + 1));
    if (!(parameter > knot[3] && parameter < knot[k])) return null;
    let at = 3;
    while (at + 1 < k && knot[at + 1] <= parameter) at++;
    for (let i = 0; i <= k; i++) {
        const w = i + 3 <= at ? 1 : i > at ? 0 : (parameter - knot[i]) / (knot[i + 3] - knot[i]);
        for (let q = 0; q < 2; q++) control[2 * i + q] = (i < k && w > 0 ? w * old[2 * i + q] : 0) + (i > 0 && w < 1 ? (1 - w) * old[2 * (i - 1) + q] : 0);
    }
    return {...c, k: k + 1, control, knot: Float64Array.from([...knot.slice(0, at + 1), parameter, ...knot.slice(at + 1)])};
}

const removable = (c, i) => c.k > 4 && i >= 2 && i + 2 < c.k;

function removeControl(c, i) {
    return {...c, k: c.k - 1, control: Float64Array.from([...c.control.slice(0, 2 * i), ...c.control.slice(2 * i + 2)]),
            knot: Float64Array.from([...c.knot.slice(0, i + 2), ...c.knot.slice(i + 3)])};
}

/* ---- a curve that somebody has drawn: its position at a share of its length in parameters ---- */

function makeSketch(points, controls) {
    const n = points.length / 2;
    if (controls) {
        const c = {k: n, control: Float64Array.from(points), knot: Float64Array.from({length: n + 4}, (_, i) => i - 1)};
        return (share) => curvePoint(c, c.knot[3] + (c.knot[n] - c.knot[3]) * share);
    }
    const steps = Array.from({length: n - 1}, (_, i) => Math.sqrt(Math.hypot(points[2 * i + 2] - points[2 * i], points[2 * i + 3] - points[2 * i + 1])));
    const mean = steps.reduce((sum, x) => sum + x / (n - 1), 0) || 1, t = new Float64Array(n);
    steps.forEach((x, i) => { t[i + 1] = t[i] + Math.max(x, 1e-3 * mean); });
    const second = naturalSeconds(t, points, 2);
    return (share) => naturalAt(t, points, second, 2, t[n - 1] * share, [0, 0]);
}

/* ---- the pose signal: a thin-plate spline, least squares over all frames ---- */

const phi = (square) => square > 0 ? 0.5 * square * Math.log(square) : 0;
const NEAREST = 1e-3, DEPENDENT = 1e-9;

/* Three frames far apart among the sites: fewer when all lie on a line or at a point. */
function chooseAnchors(p, among) {
    const square = (i, x, y) => (p[2 * i] - x) ** 2 + (p[2 * i + 1] - y) ** 2;
    const farthest = (x, y, least) => among.reduce((best, i) => { const far = square(i, x, y); return far > best.far ? {i, far} : best; }, {i: -1, far: least});
    const a = farthest(0, 0, -1).i, ax = p[2 * a], ay = p[2 * a + 1], b = farthest(ax, ay, 0);
    if (!(b.far > NEAREST * NEAREST)) return [a];
    const bx = p[2 * b.i] - ax, by = p[2 * b.i + 1] - ay;
    let large = 1e-9 * b.far, third = -1;
    for (const i of among) {
        const area = Math.abs(bx * (p[2 * i + 1] - ay) - by * (p[2 * i] - ax));
        if (area > large) large = area, third = i;
    }
    return third < 0 ? [a, b.i] : [a, b.i, third];
}

/* Rows of (1, x, y) that give the barycentric coordinates in the anchors. */
function barycentricRows(p, anchors) {
    const m = new Float64Array(9), at = (k) => [p[2 * anchors[k]], p[2 * anchors[k] + 1]], a = at(0);
    const u = anchors.length > 1 ? at(1).map((x, k) => x - a[k]) : [0, 0], v = anchors.length > 2 ? at(2).map((x, k) => x - a[k]) : [0, 0];
    if (anchors.length === 3) {
        const det = u[0] * v[1] - u[1] * v[0];
        m[4] = v[1] / det, m[5] = -v[0] / det, m[7] = -u[1] / det, m[8] = u[0] / det;
    } else if (anchors.length === 2) {
        const square = u[0] * u[0] + u[1] * u[1];
        m[4] = u[0] / square, m[5] = u[1] / square;
    }
    for (let k = 3; k < 9; k += 3) m[k] = -(m[k + 1] * a[0] + m[k + 2] * a[1]);
    m[0] = 1 - m[3] - m[6], m[1] = -m[4] - m[7], m[2] = -m[5] - m[8];
    return m;
}

const lambdaOf = (m, a, x, y) => m[3 * a] + m[3 * a + 1] * x + m[3 * a + 2] * y;

/* v loses what the first rows of q say, twice; what is left gets norm 1. The upper triangle r notes how. */
function orthogonalise(q, rows, n, v, column) {
    for (let pass = 0; pass < 2; pass++)
        for (let j = 0; j < rows; j++) {
            const a = j * n;
            let t = 0;
            for (let i = 0; i < n; i++) t += q[a + i] * v[i];
            column[j] += t;
            for (let i = 0; i < n; i++) v[i] -= t * q[a + i];
        }
    let sum = 0;
    for (let i = 0; i < n; i++) sum += v[i] * v[i];
    return Math.sqrt(sum);
}

/* The surface through the coordinates x (n rows of m numbers) of frames at positions, with these sites. */
function makePlate(position, sites, x, m) {
    const n = position.length / 2, centre = [0, 0], p = new Float64Array(2 * n);
    let spread = 0;
    for (let i = 0; i < 2 * n; i++) centre[i & 1] += position[i] / n;
    for (let i = 0; i < 2 * n; i++) spread += (position[i] - centre[i & 1]) ** 2;
    const scale = Math.sqrt(spread / n) || 1;
    for (let i = 0; i < 2 * n; i++) p[i] = (position[i] - centre[i & 1]) / scale;
    const anchors = chooseAnchors(p, sites), bary = barycentricRows(p, anchors), na = anchors.length;
    const q = new Float64Array(Math.max(3, sites.length) * n), columns = [], used = [], lambda = [];
    const radial = anchors.map((a) => Float64Array.from({length: n}, (_, i) => phi((p[2 * i] - p[2 * a]) ** 2 + (p[2 * i + 1] - p[2 * a + 1]) ** 2)));
    const add = (site, v, size, weight) => {
        const column = new Float64Array(used.length + 1), left = orthogonalise(q, used.length, n, v, column);
        if (!(left > DEPENDENT * size)) return;
        column[used.length] = left;
        for (let i = 0; i < n; i++) q[used.length * n + i] = v[i] / left;
        columns.push(column), used.push(site), lambda.push(weight);
    };
    anchors.forEach((site, a) => {
        const v = Float64Array.from({length: n}, (_, i) => lambdaOf(bary, a, p[2 * i], p[2 * i + 1]));
        add(site, v, Math.sqrt(v.reduce((sum, f) => sum + f * f, 0)), null);
    });
    for (const site of sites) {
        if (anchors.includes(site)) continue;
        const sx = p[2 * site], sy = p[2 * site + 1], weight = anchors.map((_, a) => lambdaOf(bary, a, sx, sy)), v = new Float64Array(n);
        let size = 0;
        for (let i = 0; i < n; i++) {
            let f = phi((p[2 * i] - sx) ** 2 + (p[2 * i + 1] - sy) ** 2);
            size += f * f;
            for (let a = 0; a < na; a++) f -= weight[a] * radial[a][i];
            v[i] = f;
        }
        add(site, v, Math.sqrt(size), weight);
    }
    return {centre, scale, bary, na, m, l: used.length, lambda, at: Float64Array.from(used.flatMap((s) => [p[2 * s], p[2 * s + 1]])),
            coefficient: solvePlate(q, columns, n, x, m)};
}

/* Coefficients of the functions: products with the orthogonal ones, then back through the triangle. */
function solvePlate(q, columns, n, x, m) {
    const l = columns.length, c = new Float64Array(l * m);
    for (let j = 0; j < l; j++)
        for (let i = 0; i < n; i++) {
            const f = q[j * n + i];
            for (let k = 0; k < m; k++) c[j * m + k] += f * x[i * m + k];
        }
    for (let j = l - 1; j >= 0; j--) {
        for (let i = j + 1; i < l; i++) {
            const f = columns[i][j];
            for (let k = 0; k < m; k++) c[j * m + k] -= f * c[i * m + k];
        }
        for (let k = 0; k < m; k++) c[j * m + k] /= columns[j][j];
    }
    return c;
}

/* The m shape coordinates at a place of the plane. */
function plateAt(g, place, out) {
    const {na, m, at, coefficient} = g, x = (place[0] - g.centre[0]) / g.scale, y = (place[1] - g.centre[1]) / g.scale, base = [0, 0, 0];
    out.fill(0);
    for (let a = 0; a < na; a++) {
        const f = lambdaOf(g.bary, a, x, y);
        base[a] = phi((x - at[2 * a]) ** 2 + (y - at[2 * a + 1]) ** 2);
        for (let k = 0; k < m; k++) out[k] += f * coefficient[a * m + k];
    }
    for (let j = na; j < g.l; j++) {
        let f = phi((x - at[2 * j]) ** 2 + (y - at[2 * j + 1]) ** 2);
        for (let a = 0; a < na; a++) f -= g.lambda[j][a] * base[a];
        for (let k = 0; k < m; k++) out[k] += f * coefficient[j * m + k];
    }
    return out;
}

/* ---- the plane ---- */

/* The convex hull of points (x, y, x, y, ...), counter-clockwise. */
function hullOf(points) {
    const list = Array.from({length: points.length / 2}, (_, i) => [points[2 * i], points[2 * i + 1]]).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const half = (order) => {
        const hull = [];
        for (const p of order) {
            while (hull.length > 1) {
                const [a, b] = hull.slice(-2);
                if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
                hull.pop();
            }
            hull.push(p);
        }
        return hull.slice(0, -1);
    };
    return [...half(list), ...half([...list].reverse())];
}

function insideHull(hull, [x, y]) {
    return hull.length > 2 && hull.every((a, i) => {
        const b = hull[(i + 1) % hull.length];
        return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= -1e-12;
    });
}

/* Where a polyline crosses itself. Pieces are sorted into cells, so that only near ones are compared. */
function crossingsOf(points) {
    const n = points.length, found = [], cells = new Map();
    let longest = 0;
    for (let i = 0; i + 1 < n; i++) longest = Math.max(longest, Math.abs(points[i + 1][0] - points[i][0]), Math.abs(points[i + 1][1] - points[i][1]));
    if (!(longest > 0)) return found;
    const cellOf = (x) => Math.floor(x / longest / 2);
    for (let i = 0; i + 1 < n; i++) {
        const [a, b] = [points[i], points[i + 1]], seen = new Set();
        for (let cx = cellOf(Math.min(a[0], b[0])); cx <= cellOf(Math.max(a[0], b[0])); cx++)
            for (let cy = cellOf(Math.min(a[1], b[1])); cy <= cellOf(Math.max(a[1], b[1])); cy++) {
                const key = cx + "," + cy, list = cells.get(key) || [];
                for (const j of list) {
                    if (j >= i - 1 || seen.has(j)) continue;
                    seen.add(j);
                    const [c, d] = [points[j], points[j + 1]], ux = b[0] - a[0], uy = b[1] - a[1], vx = d[0] - c[0], vy = d[1] - c[1], det = ux * vy - uy * vx;
                    const s = ((c[0] - a[0]) * vy - (c[1] - a[1]) * vx) / det, t = ((c[0] - a[0]) * uy - (c[1] - a[1]) * ux) / det;
                    if (s >= 0 && s < 1 && t >= 0 && t < 1) found.push([a[0] + s * ux, a[1] + s * uy]);
                }
                list.push(i);
                cells.set(key, list);
            }
    }
    return found;
}
