// Tables of BRDFs over half and difference angles, and their values between nodes.

import { halfDifference } from "./geometry.js";

/**
 * @typedef {object} TableFacts
 * @property {number[]} dims cells along θ_h, θ_d, φ_d, and of a material that changes as it is turned along φ_h
 * @property {boolean} reciprocal φ_d has a period of 180°, else of 360°
 * @property {number} shift of a node from the lower edge of its cell: .5 or 0
 * @property {boolean} nearest values are constant over cells
 * @property {number} step of ln f between codes
 * @property {number} low ln f of the lowest code
 * @property {number[]} luminance weights of the channels; none: the first plane is luminance
 */

/** Code 0 is no data, code 1 a value of 0; those above are of ln f. */
const [NO_DATA, FIRST] = [0, 2];
const CODES = 65534;

/**
 * Channels of values from differences of codes, low bytes before high ones; not a number: no data.
 * @param {Uint8Array} bytes @param {{dims: number[], low: number, step: number}} facts
 */
export function decoded(bytes, { dims, low, step: size }) {
  const cells = dims.reduce((a, b) => a * b);
  const n = bytes.length / 2;
  const values = new Float32Array(CODES + FIRST);
  values[NO_DATA] = NaN;
  for (let code = 0; code < CODES; code++) values[code + FIRST] = Math.exp(low + code * size);
  const channels = [];
  /** @type {Int32Array | undefined} */
  let before;
  for (let first = 0; first < n; first += cells) {
    const plane = new Float32Array(cells);
    const steps = new Int32Array(cells);
    let code = 0;
    for (let j = 0; j < cells; j++) {
      const word = bytes[first + j] | (bytes[n + first + j] << 8);
      if (word < FIRST) {
        plane[j] = values[word];
        continue;
      }
      const step = ((word - FIRST) >> 1) ^ -((word - FIRST) & 1);
      steps[j] = before ? step + before[j] : step;
      code = (code + steps[j] + 2 * CODES) % CODES;
      plane[j] = values[code + FIRST];
    }
    before ??= steps;
    channels.push(plane);
  }
  return channels;
}

const at = new Float64Array(4);

/** Values of f_r (sr⁻¹): plane 0 is luminance, plane n the n-th channel. */
export class Table {
  /** @param {TableFacts} facts @param {Float32Array[]} channels not a number: no data */
  constructor(facts, channels) {
    this.facts = facts;
    const [nh, nd, nphi, turns] = facts.dims;
    this.nh = nh;
    this.nd = nd;
    this.nphi = nphi;
    this.turns = turns ?? 1;
    this.planes = facts.luminance.length ? [mixed(channels, facts.luminance), ...channels] : channels;
    this.means = this.turns === 1 ? this.planes.map((plane) => this.meansOf(plane)) : [];
  }

  /** Means over φ_d at θ_h = 0 and at θ_d = 0, where φ_d has no meaning. @param {Float32Array} plane */
  meansOf(plane) {
    const { nh, nd, nphi } = this;
    const means = new Float32Array(nd + nh);
    for (let i = 0; i < nd + nh; i++) {
      const row = (i < nd ? i : nd * (i - nd)) * nphi;
      let [sum, n] = [0, 0];
      for (let j = row; j < row + nphi; j++) {
        if (plane[j] !== plane[j]) continue;
        sum += plane[j];
        n++;
      }
      means[i] = sum / n;
    }
    return means;
  }

  /**
   * f_r of a pair: 0 below the horizon, not a number without data.
   * @param {number} ix @param {number} iy @param {number} iz @param {number} ox @param {number} oy @param {number} oz
   */
  value(channel = 0, ix = 0, iy = 0, iz = 1, ox = 0, oy = 0, oz = 1) {
    if (iz <= 0 || oz <= 0) return 0;
    halfDifference(at, ix, iy, iz, ox, oy, oz);
    const { nh, nd, nphi } = this;
    let phi = at[2];
    if (this.facts.reciprocal) {
      if (phi < 0) phi += Math.PI;
    } else if (phi < 0) phi += 2 * Math.PI;
    const round = this.facts.reciprocal ? Math.PI : 2 * Math.PI;
    const xh = nh * Math.sqrt(at[0] / (Math.PI / 2));
    const xd = (nd * at[1]) / (Math.PI / 2);
    const xphi = (nphi * phi) / round;
    if (this.turns > 1) return this.turnedValue(channel, xh, xd, xphi, at[3]);
    if (this.facts.nearest) {
      const [h, d] = [Math.min(nh - 1, Math.floor(xh + 1e-8)), Math.min(nd - 1, Math.floor(xd + 1e-8))];
      return this.planes[channel][(Math.floor(xphi + 1e-8) % nphi) + nphi * (d + nd * h)];
    }
    return this.between(channel, xh, xd, xphi);
  }

  /** Between the eight nodes around a place. @param {number} channel @param {number} xh @param {number} xd @param {number} xphi */
  between(channel, xh, xd, xphi) {
    const { nh, nd, nphi } = this;
    const shift = this.facts.shift;
    const before = shift > 0 ? 1 : 0;
    const [lastH, lastD] = [nh - 1 + before, nd - 1 + before];
    const [yh, yd, yphi] = [Math.min(xh + shift, lastH), Math.min(xd + shift, lastD), xphi - shift];
    const [h, d] = [Math.floor(yh), Math.floor(yd)];
    let phi = Math.floor(yphi);
    const fphi = yphi - phi;
    const fh = h > 0 ? yh - h : (yh - shift) / (1 - shift);
    const fd = d > 0 ? yd - d : (yd - shift) / (1 - shift);
    if (phi < 0) phi += nphi;
    if (phi >= nphi) phi = 0;
    const next = phi + 1 < nphi ? phi + 1 : 0;
    const [plane, means] = [this.planes[channel], this.means[channel]];
    let [sum, total] = [0, 0];
    for (let corner = 0; corner < 4; corner++) {
      const row = corner & 2 ? Math.min(h + 1, lastH) : h;
      const column = corner & 1 ? Math.min(d + 1, lastD) : d;
      const weight = (corner & 2 ? fh : 1 - fh) * (corner & 1 ? fd : 1 - fd);
      const [cellH, cellD] = [Math.max(row, before) - before, Math.max(column, before) - before];
      let [one, other] = [0, 0];
      if (row === 0) one = other = means[cellD];
      else if (column === 0) one = other = means[nd + cellH];
      else {
        const start = nphi * (cellD + nd * cellH);
        one = plane[start + phi];
        other = plane[start + next];
      }
      const [w, v] = [weight * (1 - fphi), weight * fphi];
      if (one === one) {
        sum += w * one;
        total += w;
      }
      if (other === other) {
        sum += v * other;
        total += v;
      }
    }
    return total > 0 ? sum / total : NaN;
  }

  /** Between sixteen nodes. @param {number} channel @param {number} xh @param {number} xd @param {number} xphi @param {number} azimuth of the half vector */
  turnedValue(channel, xh, xd, xphi, azimuth) {
    const { nh, nd, nphi, turns } = this;
    const plane = this.planes[channel];
    const full = 2 * Math.PI;
    const xturn = (turns * ((azimuth + full) % full)) / full - 0.5;
    const places = [Math.min(Math.max(xh - 0.5, 0), nh - 1), Math.min(Math.max(xd - 0.5, 0), nd - 1), xphi - 0.5, xturn];
    const low = places.map(Math.floor);
    let [sum, total] = [0, 0];
    for (let corner = 0; corner < 16; corner++) {
      let weight = 1;
      for (let k = 0; k < 4; k++) weight *= (corner >> k) & 1 ? places[k] - low[k] : 1 - places[k] + low[k];
      if (weight === 0) continue;
      const h = Math.min(nh - 1, low[0] + (corner & 1));
      const d = Math.min(nd - 1, low[1] + ((corner >> 1) & 1));
      const phi = (low[2] + ((corner >> 2) & 1) + nphi) % nphi;
      const turn = (low[3] + ((corner >> 3) & 1) + turns) % turns;
      const value = plane[turn + turns * (phi + nphi * (d + nd * h))];
      if (value !== value) continue;
      // Lobes are smoother in logarithms, and these nodes are far apart.
      sum += weight * Math.log(Math.max(value, 1e-12));
      total += weight;
    }
    return total > 0 ? Math.exp(sum / total) : NaN;
  }
}

/** Luminance of channels. @param {Float32Array[]} channels @param {number[]} weights */
function mixed(channels, weights) {
  const all = new Float32Array(channels[0].length);
  channels.forEach((plane, c) => {
    for (let j = 0; j < all.length; j++) all[j] += weights[c] * plane[j];
  });
  return all;
}
