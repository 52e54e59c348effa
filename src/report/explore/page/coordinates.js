// A BRDF in a parametrization: two of its axes, with the third on a slider, and the poses of a set.

import { colours, data, materials, signedPlace } from "./data.js";
import { RAD, angles, charts, direction, warps } from "./geometry.js";
import { bar, isDifference, paint, quantity, ratio, shown, tone, value } from "./look.js";
import { Axis, digits, frame } from "./plot.js";
import { about, isTaken, readings } from "./readings.js";
import { set, state } from "./state.js";
import { theme } from "./theme.js";
import { View, nearest } from "./view.js";

/** @typedef {import("./geometry.js").Pair} Pair */

/** Pixels along each side of the picture. */
const SIDE = 128;

/** The most poses that are drawn. */
const MOST = 5000;

/** Isolines to a factor of ten, by how many such factors there are. @param {number} decades */
const perDecade = (decades) => [10, 5, 4, 3, 2, 1].find((n) => n * decades <= 12) ?? 0.5;

/** A coordinate, in degrees or a length, where its warp places it. */
class Warped extends Axis {
  /** @param {import("./data.js").ChartFacts["axes"][0]} axis @param {{family: string, parameter: number}} warp */
  constructor({ low, high, angle }, warp) {
    super(angle ? low / RAD : low, angle ? high / RAD : high);
    this.warp = warp;
  }

  /** @param {number} v */
  place(v) {
    return warps[this.warp.family][1](super.place(v), this.warp.parameter);
  }

  /** Round values that are not too near each other. */
  ticks() {
    let last = -1;
    return super.ticks(8).filter((v) => {
      const isFar = this.place(v) - last >= 0.09;
      if (isFar) last = this.place(v);
      return isFar;
    });
  }
}

export class Coordinates extends View {
  constructor() {
    super({
      id: "coordinates",
      title: "Coordinates",
      about: "The first two axes of a parametrization, warped or not; the slider moves along the third. Lines are values in equal ratios. Points are poses: brighter ones lie near the slice. Drag or arrow keys move the pair of directions that the hemisphere shows.",
      command: (name) => (name ? `gonio distortion ${name} --table shares` : `gonio schedule CONFIG --parametrization ${state.chart}`),
      needs: ["chart", "warp1", "warp2", "third", "show", "scale", "channel", "cosine", "light", "sensor", "time", "look"],
    });
    this.key = "";
    this.placedKey = "";
    /** @type {{reading: import("./readings.js").Reading, at: number[]}[]} */
    this.placed = [];
    /** @type {Float32Array} */
    this.values = new Float32Array(SIDE * SIDE);
  }

  /** The parametrization. */
  chart() {
    return data.charts.find((c) => c.kind === state.chart) ?? data.charts[0];
  }

  /** The warp of an axis; the third has none. @param {number} axis */
  warp(axis) {
    const { warps: all } = this.chart().axes[axis];
    return all.find((w) => w.name === [state.warp1, state.warp2][axis]) ?? all[0];
  }

  /** Coordinates of places in [0, 1]. @param {number} u @param {number} v @param {number} w */
  coordinates(u, v, w) {
    const { axes } = this.chart();
    return [u, v, w].map((place, i) => {
      const { low, high } = axes[i];
      const { family, parameter } = this.warp(i);
      return low + warps[family][0](place, parameter) * (high - low);
    });
  }

  /** Places in [0, 1] on paper. @param {number} u @param {number} v */
  onPaper(u, v) {
    const [left, top, w, h] = this.box;
    return [left + u * w, top + (1 - v) * h];
  }

  /** The pair at places in [0, 1]. @param {number} u @param {number} v @returns {Pair | undefined} */
  pair(u, v, w = state.third) {
    return charts[this.chart().kind].inverse(this.coordinates(u, v, w));
  }

  /** Places in [0, 1] of a pair. @param {Pair} pair */
  places(pair) {
    const { axes, kind } = this.chart();
    return charts[kind].forward(pair).map((c, i) => {
      const { low, high } = axes[i];
      const { family, parameter } = this.warp(i);
      return warps[family][1](Math.min(1, Math.max(0, (c - low) / (high - low))), parameter);
    });
  }

  /** Values of the slice, by rows from the top; drawn again only where they change. */
  fill() {
    const { chart, warp1, warp2, third, show, scale, channel, cosine, look } = state;
    const key = [chart, warp1, warp2, third, show, scale, channel, cosine, look, materials.map((m) => m.serial)].join();
    if (key === this.key || !materials.length) return;
    this.key = key;
    const difference = isDifference(show);
    const axis = tone(shown());
    paint(this.image, SIDE, SIDE, (x, y) => {
      const pair = this.pair((x + 0.5) / SIDE, 1 - (y + 0.5) / SIDE);
      const v = !pair ? NaN : difference ? ratio(...pair) : value(shown(), ...pair);
      this.values[y * SIDE + x] = v;
      if (!pair) return 0;
      return difference ? colours.signed.word(0.5 + 0.5 * signedPlace(v)) : colours.sequential.word(axis.place(v));
    });
  }

  /** @param {import("./pen.js").Pen} pen @param {number} width @param {number} height */
  draw(pen, width, height) {
    const { faint, paper, accent } = theme();
    const { axes } = this.chart();
    const [left, top, w, h] = this.lay(62, 12, width - 76, height - 120);
    const [x, y] = axes.slice(0, 2).map((axis, i) => new Warped(axis, this.warp(i)));
    const names = axes.map((a, i) => `${a.symbol}${a.angle ? ", degrees" : ""}${i < 2 && this.warp(i).name !== "none" ? ` (${this.warp(i).name})` : ""}`);
    frame(pen, this.box, x, y, names[0], names[1]);
    this.fill();
    pen.path([[left, top], [left + w, top], [left + w, top + h], [left, top + h]], { fill: faint, alpha: 0.5 }, true);
    if (materials.length) pen.image(this.box, this.image);
    if (materials.length && !isDifference(state.show)) this.isolines(pen, paper);
    this.poses(pen);
    const [u, v] = this.places([direction(...state.light), direction(...state.sensor)]);
    const [px, py] = this.onPaper(u, v);
    pen.circle(px, py, 7, { stroke: paper, width: 4 });
    pen.circle(px, py, 7, { stroke: accent, width: 2 });
    const box = /** @type {import("./pen.js").Box} */ ([left, top + h + 52, w, 10]);
    if (materials.length) bar(pen, box, isDifference(state.show), tone(shown()), isDifference(state.show) ? "ln(B/A)" : quantity());
  }

  /** Lines of equal values, by marching squares. @param {import("./pen.js").Pen} pen @param {string} stroke */
  isolines(pen, stroke) {
    const { lo, hi } = tone(shown());
    const least = Math.max(lo, hi * 1e-6);
    const n = perDecade(Math.log10(hi / least));
    const { values } = this;
    const points = [];
    for (let k = Math.ceil(Math.log10(least) * n); k <= Math.log10(hi) * n; k++) {
      const level = 10 ** (k / n);
      for (let y = 0; y + 1 < SIDE; y++) {
        for (let x = 0; x + 1 < SIDE; x++) {
          const i = y * SIDE + x;
          const [a, b, c, d] = [values[i], values[i + 1], values[i + SIDE + 1], values[i + SIDE]];
          const high = (a > level ? 1 : 0) + (b > level ? 2 : 0) + (c > level ? 4 : 0) + (d > level ? 8 : 0);
          if (high === 0 || high === 15 || a + b + c + d !== a + b + c + d) continue;
          const ends = [];
          if ((a > level) !== (b > level)) ends.push([x + (level - a) / (b - a), y]);
          if ((b > level) !== (c > level)) ends.push([x + 1, y + (level - b) / (c - b)]);
          if ((d > level) !== (c > level)) ends.push([x + (level - d) / (c - d), y + 1]);
          if ((a > level) !== (d > level)) ends.push([x, y + (level - a) / (d - a)]);
          for (let e = 0; e + 1 < ends.length; e += 2) points.push(ends[e], ends[e + 1], [NaN, 0]);
        }
      }
    }
    pen.path(points.map(([x, y]) => this.onPaper((x + 0.5) / SIDE, 1 - (y + 0.5) / SIDE)), { stroke, width: 0.8, alpha: 0.8 });
  }

  /** Poses of the set that is shown. */
  posed() {
    const key = [state.chart, state.warp1, state.warp2, about.name, readings.length].join();
    if (key !== this.placedKey) {
      this.placedKey = key;
      const every = Math.ceil(readings.length / MOST);
      const some = readings.filter((_, i) => i % every === 0);
      this.placed = some.map((reading) => ({ reading, at: this.places([reading.light, reading.sensor]) }));
    }
    return this.placed.filter(({ reading }) => isTaken(reading));
  }

  /** @param {import("./pen.js").Pen} pen */
  poses(pen) {
    const { ink, paper } = theme();
    for (const { at } of this.posed()) {
      const isNear = Math.abs(at[2] - state.third) < 0.08;
      const [x, y] = this.onPaper(at[0], at[1]);
      pen.circle(x, y, isNear ? 2.5 : 1.2, { fill: isNear ? paper : ink, stroke: isNear ? ink : undefined, width: 0.7, alpha: isNear ? 1 : 0.4 });
    }
  }

  /** Shares of variance along the axes, as the program has them. */
  shares() {
    const name = materials[shown()]?.facts.name;
    const found = data.distortion.find((d) => d.chart === this.chart().kind && d.material === name);
    if (!found) return "";
    const { axes } = this.chart();
    const percent = (/** @type {number | null | undefined} */ v) => (v == null ? "–" : `${(100 * v).toFixed(1)} %`);
    const along = axes.map((a, i) => `${a.symbol} ${percent(found.gradients?.[i])}`).join(", ");
    const alone = axes.slice(0, 2).map((a, i) => `${a.symbol} ${percent(found.shares?.[i])}`).join(", ");
    return ` Squared gradient of ln(f + 0.001): ${along} (± ${(100 * found.error).toFixed(1)}). Variance that a function of one axis has: ${alone}; of both ${percent(found.both)}.`;
  }

  words() {
    const pair = /** @type {Pair} */ ([direction(...state.light), direction(...state.sensor)]);
    const { axes, kind } = this.chart();
    const c = charts[kind].forward(pair).map((v, i) => `${axes[i].symbol} ${axes[i].angle ? `${(v / RAD).toFixed(2)}°` : v.toFixed(4)}`);
    const values = materials.map((m, i) => `${"AB"[i]} ${digits(value(i, ...pair))}`);
    const at = this.coordinates(0, 0, state.third)[2];
    const slice = `Slice at ${axes[2].symbol} ${axes[2].angle ? `${(at / RAD).toFixed(0)}°` : at.toFixed(2)}. `;
    return `${slice}${c.join(", ")}${values.length ? `: ${values.join(", ")}` : ""}.${this.shares()}`;
  }

  rows() {
    const head = [...this.chart().axes.map((a) => a.symbol), "value"];
    this.fill();
    /** @type {(string | number)[][]} */
    const rows = [head];
    for (let y = 0; y < SIDE; y += 4) {
      for (let x = 0; x < SIDE; x += 4) {
        const c = this.coordinates((x + 0.5) / SIDE, 1 - (y + 0.5) / SIDE, state.third);
        rows.push([...c, this.values[y * SIDE + x]]);
      }
    }
    return rows;
  }

  /** Shows a pair on the hemisphere. @param {Pair | undefined} pair */
  go(pair) {
    if (!pair) return;
    const [light, sensor] = pair.map(angles);
    set({ light: [Math.min(89, light[0]), light[1]], sensor: [Math.min(89, sensor[0]), sensor[1]] });
  }

  /** @param {number} x @param {number} y */
  placeAt(x, y) {
    const [left, top, w, h] = this.box;
    return [(x - left) / w, 1 - (y - top) / h].map((v) => Math.min(1, Math.max(0, v)));
  }

  /** @param {number} x @param {number} y */
  drag(x, y) {
    const [u, v] = this.placeAt(x, y);
    this.go(this.pair(u, v));
  }

  /** @param {number} x @param {number} y */
  hover(x, y) {
    if (Number.isNaN(x)) return;
    const found = nearest(this.posed(), ({ at }) => this.onPaper(at[0], at[1]), x, y, 6)?.reading;
    if (found) this.go([found.light, found.sensor]);
  }

  /** @param {number} right @param {number} up */
  step(right, up) {
    const [u, v, w] = this.places([direction(...state.light), direction(...state.sensor)]);
    const moved = [u + right / 90, v + up / 90].map((p) => Math.min(1, Math.max(0, p)));
    this.go(this.pair(moved[0], moved[1], w));
  }
}
