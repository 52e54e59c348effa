// Directions, half and difference angles, parametrizations. z is the normal; both directions point away from the surface.

/** @typedef {[number, number, number]} Vector */
/** @typedef {[light: Vector, sensor: Vector]} Pair */

export const RAD = Math.PI / 180;

/** @param {number} theta degrees @param {number} phi degrees @returns {Vector} */
export function direction(theta, phi) {
  const s = Math.sin(theta * RAD);
  return [s * Math.cos(phi * RAD), s * Math.sin(phi * RAD), Math.cos(theta * RAD)];
}

/** Elevation and azimuth, degrees. @param {Vector} v @returns {[number, number]} */
export function angles([x, y, z]) {
  return [Math.atan2(Math.hypot(x, y), z) / RAD, x === 0 && y === 0 ? 0 : Math.atan2(y, x) / RAD];
}

/** @param {Vector} a @param {Vector} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @param {Vector} a @param {Vector} b @returns {Vector} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** @param {Vector} v @returns {Vector} */
export function unit(v) {
  const n = Math.hypot(...v);
  return n > 0 ? [v[0] / n, v[1] / n, v[2] / n] : [0, 0, 1];
}

/** Angle between directions, degrees. @param {Vector} a @param {Vector} b */
export const apart = (a, b) => Math.atan2(Math.hypot(...cross(a, b)), dot(a, b)) / RAD;

/** Where a point of space is on paper: turned by yaw and pitch (degrees), around (x, y), a length of 1 as r. @param {[number, number]} turn @param {number} x @param {number} y @param {number} r */
export function projection(turn, x, y, r) {
  const [[cos, sin], [c, s]] = turn.map((v) => [Math.cos(v * RAD), Math.sin(v * RAD)]);
  return (/** @type {Vector} */ p) => [x + r * (p[0] * cos - p[1] * sin), y - r * (p[2] * c - (p[0] * sin + p[1] * cos) * s)];
}

/**
 * θ_h, θ_d, φ_d in (−π, π] and φ_h (rad) of a pair, into `out`.
 * @param {Float64Array} out @param {number} ix @param {number} iy @param {number} iz @param {number} ox @param {number} oy @param {number} oz
 */
export function halfDifference(out, ix, iy, iz, ox, oy, oz) {
  const [hx, hy, hz] = [(ix + ox) / 2, (iy + oy) / 2, (iz + oz) / 2];
  const [kx, ky, kz] = [(ix - ox) / 2, (iy - oy) / 2, (iz - oz) / 2];
  const flat = Math.sqrt(hx * hx + hy * hy);
  const h = Math.sqrt(flat * flat + hz * hz);
  const [px, py] = flat > 0 ? [hx / flat, hy / flat] : [1, 0];
  out[0] = Math.atan2(flat, hz);
  out[1] = Math.atan2(Math.sqrt(kx * kx + ky * ky + kz * kz), h);
  out[2] = Math.atan2(px * ky - py * kx, (hz * (px * kx + py * ky) - flat * kz) / h);
  out[3] = flat > 0 ? Math.atan2(hy, hx) : 0;
}

/** An angle without its sign and its side. @param {number} a */
const acute = (a) => Math.min(Math.abs(a), Math.PI - Math.abs(a));

/** @param {Vector} h @param {Vector} k @returns {Pair} */
const both = (h, k) => [
  [h[0] + k[0], h[1] + k[1], h[2] + k[2]],
  [h[0] - k[0], h[1] - k[1], h[2] - k[2]],
];

/** @param {Pair} pair @returns {Pair} h and k, not of length 1 */
const parts = ([i, o]) => [
  [(i[0] + o[0]) / 2, (i[1] + o[1]) / 2, (i[2] + o[2]) / 2],
  [(i[0] - o[0]) / 2, (i[1] - o[1]) / 2, (i[2] - o[2]) / 2],
];

/** Angle in the plane between h and k, acute. @param {Vector} h @param {Vector} k */
const between = (h, k) => acute(Math.atan2(h[0] * k[1] - h[1] * k[0], h[0] * k[0] + h[1] * k[1]));

const frameOf = new Float64Array(4);

/**
 * Parametrizations of isotropic, reciprocal and bilateral BRDFs: `forward` has the coordinates of a pair (rad, lengths), `inverse` a
 * pair of coordinates, or none if it is below the horizon. See the docs of gonio::parametrization.
 * @type {Record<string, {forward: (pair: Pair) => number[], inverse: (c: number[]) => Pair | undefined}>}
 */
export const charts = {
  spherical: {
    forward([i, o]) {
      const two = [i, o].map((v) => Math.atan2(Math.hypot(v[0], v[1]), v[2])).sort((a, b) => b - a);
      return [...two, Math.abs(Math.atan2(o[0] * i[1] - o[1] * i[0], i[0] * o[0] + i[1] * o[1]))];
    },
    inverse: ([i, o, azimuth]) => [direction(i / RAD, azimuth / RAD), direction(o / RAD, 0)],
  },
  "half-difference": {
    forward([i, o]) {
      halfDifference(frameOf, ...i, ...o);
      return [frameOf[0], frameOf[1], acute(frameOf[2])];
    },
    inverse([th, td, phi]) {
      const [sh, ch, sp, cp] = [Math.sin(th), Math.cos(th), Math.sin(phi), Math.cos(phi)];
      const [sd, cd] = [Math.sin(td), Math.cos(td)];
      return above(both([cd * sh, 0, cd * ch], [sd * cp * ch, sd * sp, -sd * cp * sh]));
    },
  },
  orthographic: {
    forward(pair) {
      const [h, k] = parts(pair);
      return [Math.hypot(h[0], h[1]), Math.hypot(k[0], k[1]), between(h, k)];
    },
    inverse([h, k, delta]) {
      const [x, y] = [k * Math.cos(delta), k * Math.sin(delta)];
      const high = (/** @type {number} */ a, /** @type {number} */ b) => Math.sqrt(1 - a * a - b * b);
      const pair = /** @type {Pair} */ ([
        [h + x, y, high(h + x, y)],
        [h - x, -y, high(h - x, y)],
      ]);
      return Number.isNaN(pair[0][2] + pair[1][2]) ? undefined : pair;
    },
  },
  hybrid: {
    forward(pair) {
      const [h, k] = parts(pair);
      return [Math.hypot(h[0], h[1]), Math.hypot(...k), between(h, k)];
    },
    inverse([h, k, delta]) {
      const hz2 = (1 - k) * (1 + k) - h * h;
      if (hz2 < 0) return undefined;
      const hz = Math.sqrt(hz2);
      const along = h * Math.cos(delta);
      const n = Math.hypot(hz, along);
      const [flat, kz] = n > 0 ? [(k * hz) / n, (-k * along) / n] : [k, 0];
      return above(both([h, 0, hz], [flat * Math.cos(delta), flat * Math.sin(delta), kz]));
    },
  },
  stark: {
    forward(pair) {
      const [h, k, delta] = charts.hybrid.forward(pair);
      return [h * h, k * k, delta];
    },
    inverse: ([sigma, alpha, delta]) => charts.hybrid.inverse([Math.sqrt(sigma), Math.sqrt(alpha), delta]),
  },
  edwards: {
    forward([i, o]) {
      const of = (/** @type {Vector} */ a, /** @type {Vector} */ b) => {
        const sum = a[2] + b[2];
        const d = sum > 0 ? [(a[2] * b[0] - b[2] * a[0]) / sum, (a[2] * b[1] - b[2] * a[1]) / sum] : [-a[0], -a[1]];
        const s = Math.hypot(a[0], a[1]);
        const length = s > 0 ? s : Math.hypot(d[0], d[1]) || 1;
        const [x, y] = s > 0 ? [a[0] / length, a[1] / length] : [d[0] / length, d[1] / length];
        return [s, x * d[0] + y * d[1], -Math.abs(x * d[1] - y * d[0])];
      };
      const [first, second] = [of(i, o), of(o, i)];
      const at = first.findIndex((v, n) => Math.abs(v - second[n]) > 1e-12);
      return at < 0 || first[at] < second[at] ? first : second;
    },
    inverse([s, u, v]) {
      if (u * u + v * v > 1) return undefined;
      const i = /** @type {Vector} */ ([s, 0, Math.sqrt(1 - s * s)]);
      const h = unit([i[0] + u, v, i[2]]);
      const twice = 2 * dot(i, h);
      const o = /** @type {Vector} */ ([twice * h[0] - i[0], twice * h[1] - i[1], twice * h[2] - i[2]]);
      return above([i, o]);
    },
  },
};

/** A pair above the horizon. @param {Pair} pair */
function above(pair) {
  return pair[0][2] > 1e-14 && pair[1][2] > 1e-14 ? pair : undefined;
}

/**
 * Warps by their family: from the place on a warped axis to that on the plain one, both in [0, 1], and back.
 * @type {Record<string, [(u: number, p: number) => number, (t: number, p: number) => number]>}
 */
export const warps = {
  none: [(u) => u, (t) => t],
  power: [(u, p) => u ** (1 / p), (t, p) => t ** p],
  sine: [(u) => Math.sin((u * Math.PI) / 2), (t) => (Math.asin(Math.min(1, t)) * 2) / Math.PI],
  sinh: [(u, s) => s * Math.sinh(u * Math.asinh(1 / s)), (t, s) => Math.asinh(t / s) / Math.asinh(1 / s)],
};
