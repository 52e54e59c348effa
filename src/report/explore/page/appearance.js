// A sphere of the material under a point light or the sky, and the lobe in three dimensions.

import { bytesOf, colours, data, materials, signedPlace } from "./data.js";
import { RAD, cross, direction, dot, projection, unit } from "./geometry.js";
import { hatched, isDifference, paint, shown, tone, value } from "./look.js";
import { digits } from "./plot.js";
import { set, state } from "./state.js";
import { decoded } from "./table.js";
import { theme } from "./theme.js";
import { View } from "./view.js";

/** @typedef {import("./geometry.js").Vector} Vector */

/** Pixels along each side of a sphere: while something is held, and at rest. */
const SIDES = [96, 256];

/** Linear light as the byte of a screen (IEC 61966-2-1), in steps of 1/4096. */
const ENCODED = Uint8Array.from({ length: 4097 }, (_, i) => {
  const v = i / 4096;
  return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
});

/** @param {number} v */
const encoded = (v) => ENCODED[Math.round(4096 * Math.min(1, Math.max(0, v)))] ?? 0;

export class Appearance extends View {
  constructor() {
    super({
      id: "appearance",
      title: "Appearance",
      about: "A sphere: left of the line A, right of it B. Drag over it moves a point light; drag the line to wipe. Below, the lobe of the light on the hemisphere; drag turns it. Arrow keys turn it by 5°, with shift they move the line.",
      ratio: 1.3,
      command: (name) => (name ? `gonio picture sphere ${name} -o pictures` : ""),
      needs: ["light", "channel", "show", "scale", "lit", "exposure", "wipe", "turn", "lamp", "look"],
    });
    /** R, G, B of each material. @type {Float32Array[][]} */
    this.skies = [];
    this.key = "";
    this.held = "";
    this.from = [0, 0, 0, 0];
  }

  /** Unpacks the pictures. */
  async unpack() {
    this.skies = await Promise.all(data.sky.map(async (facts) => (facts ? decoded(await bytesOf(facts.blob), facts) : [])));
  }

  sphere() {
    const r = this.size[0] * 0.4;
    return { x: this.size[0] / 2, y: r + 8, r };
  }

  /** Linear R, G, B of a place of the sphere under the point light, whose irradiance is π, into `out`. @param {number} place @param {Vector} n @param {number[]} out */
  lit(place, n, out) {
    const material = materials[place];
    const lamp = direction(...state.lamp);
    const cos = dot(n, lamp);
    if (cos <= 0) {
      out[0] = out[1] = out[2] = 0;
      return;
    }
    const t = unit(cross([0, 1, 0], n));
    const b = cross(n, t);
    const [ix, iy, ox, oy] = [dot(lamp, t), dot(lamp, b), t[2], b[2]];
    const of = (/** @type {number} */ plane) => Math.PI * cos * material.table.value(plane, ix, iy, cos, ox, oy, n[2]);
    if (material.facts.coloured && state.channel === 0) for (let c = 0; c < 3; c++) out[c] = of(c + 1);
    else {
      const plane = material.plane(state.channel);
      out[0] = out[1] = out[2] = plane < 0 ? NaN : of(plane);
    }
  }

  /** The same under the sky, of a picture that the program has drawn. @param {number} place @param {number} u @param {number} v @param {number[]} out */
  underSky(place, u, v, out) {
    const facts = data.sky[place];
    if (!facts || !this.skies[place]?.length) {
      out[0] = NaN;
      return;
    }
    const { dims: [side], white } = facts;
    const at = (/** @type {number} */ w) => Math.min(side - 1, Math.max(0, Math.floor(((w + 1) / 2) * side)));
    const i = at(-v) * side + at(u);
    for (let c = 0; c < 3; c++) out[c] = this.skies[place][c][i] / white;
    if (state.channel === 0) return;
    const { coloured } = materials[place].facts;
    out[0] = out[1] = out[2] = coloured ? out[state.channel - 1] : NaN;
  }

  /** Paints the sphere, unless it is as it was. */
  fill() {
    const side = SIDES[this.isMoving ? 0 : 1];
    const { show, channel, lit, exposure, wipe, look } = state;
    const key = [side, show, channel, lit, exposure, wipe, look, state.lamp, materials.map((m) => m.serial), this.skies.length].join();
    if (key === this.key) return;
    this.key = key;
    const difference = isDifference(show);
    const gain = 2 ** exposure;
    const [one, other] = [[0, 0, 0], [0, 0, 0]];
    const of = (/** @type {number} */ place, /** @type {number} */ u, /** @type {number} */ v, /** @type {Vector} */ n, /** @type {number[]} */ out) =>
      lit === "sky" ? this.underSky(place, u, v, out) : this.lit(place, n, out);
    const y709 = (/** @type {number[]} */ c) => 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    paint(this.image, side, side, (column, row) => {
      const [u, v] = [(2 * column + 1) / side - 1, 1 - (2 * row + 1) / side];
      const z2 = 1 - u * u - v * v;
      if (z2 <= 0) return 0;
      const n = /** @type {Vector} */ ([u, v, Math.sqrt(z2)]);
      const place = materials.length > 1 && (u + 1) / 2 > wipe ? 1 : 0;
      if (difference) {
        of(0, u, v, n, one);
        of(1, u, v, n, other);
        return colours.signed.word(0.5 + 0.5 * signedPlace((y709(other) - y709(one)) * gain)) || hatched(column, row);
      }
      of(place, u, v, n, one);
      if (Number.isNaN(one[0])) return hatched(column, row);
      return (0xff000000 | (encoded(one[2] * gain) << 16) | (encoded(one[1] * gain) << 8) | encoded(one[0] * gain)) >>> 0;
    });
  }

  /** @param {import("./pen.js").Pen} pen */
  draw(pen) {
    const { ink, paper } = theme();
    const { x, y, r } = this.sphere();
    if (materials.length) {
      this.fill();
      pen.image([x - r, y - r, 2 * r, 2 * r], this.image);
    }
    pen.circle(x, y, r, { stroke: ink, width: 0.7 });
    if (materials.length > 1 && !isDifference(state.show)) {
      const at = x + r * (2 * state.wipe - 1);
      pen.path([[at, y - r - 4], [at, y + r + 4]], { stroke: paper, width: 3 });
      pen.path([[at, y - r - 4], [at, y + r + 4]], { stroke: ink });
      pen.text(at - 6, y - r + 8, "A", { colour: ink, align: "end" });
      pen.text(at + 6, y - r + 8, "B", { colour: ink });
    }
    if (isDifference(state.show)) {
      pen.text(x, y + r + 16, "B − A: red is more, blue less; from 0.001 of white to white", { colour: ink, align: "middle", size: 11 });
    }
    if (materials.length) this.lobes(pen);
  }

  /** Lobes of the light as lines of the sensor's elevation and azimuth. @param {import("./pen.js").Pen} pen */
  lobes(pen) {
    const { ink, faint, a, b } = theme();
    const [width, height] = this.size;
    const r = width * 0.3;
    const at = projection(state.turn, width / 2, height - 30, r);
    const light = direction(...state.light);
    const axis = tone(shown());
    const along = Array.from({ length: 24 }, (_, k) => Array.from({ length: 46 }, (_, j) => direction(Math.max(0, 2 * j - 0.5), state.light[1] + 15 * k)));
    const lengths = materials.map((_, place) => along.map((line) => line.map((v) => Math.max(0, axis.place(value(place, light, v)) || 0))));
    // The longest of both reaches the circle.
    const longest = Math.max(1e-9, ...lengths.flat(2));
    const cells = lengths.map((all) =>
      all.map((line, k) => line.map((n, j) => /** @type {Vector} */ (along[k][j].map((c) => (c * n) / longest)))),
    );
    const circle = Array.from({ length: 49 }, (_, k) => at(direction(90, 7.5 * k)));
    pen.path(circle, { stroke: faint });
    cells.forEach((lines, place) => {
      const style = { stroke: [a, b][place], width: place ? 1 : 0.8, alpha: 0.75, dash: place ? [4, 3] : [] };
      for (const line of lines) pen.path(line.map(at), style);
      for (let j = 5; j < 46; j += 5) pen.path([...lines, lines[0]].map((line) => at(line[j])), style);
    });
    pen.path([at([0, 0, 0]), at([1.25 * light[0], 1.25 * light[1], 1.25 * light[2]])], { stroke: "#d49b00", width: 2 });
    pen.path([at([0, 0, 0]), at([0, 0, 1.1])], { stroke: ink, dash: [2, 3] });
  }

  words() {
    const errors = data.errors.map((e) => `${e.measure} nrmse ${e.nrmse === null ? "–" : digits(e.nrmse)} ± ${e.error === null ? "–" : digits(e.error)}`);
    const nrmse = data.sky[1]?.nrmse ?? null;
    const image = nrmse === null ? "" : `; of the picture under the sky nrmse ${digits(nrmse)}`;
    const names = materials.map((m, i) => `${"AB"[i]} ${m.facts.name} (${m.facts.symmetry})`).join(", ");
    return `${names}${errors.length ? `. B against A: ${errors.join(", ")}${image}` : ""}. ${state.lit === "sky" ? "Sky" : "Point light"}, exposure ${state.exposure}.`;
  }

  rows() {
    const rows = /** @type {(string | number)[][]} */ ([["x", "y", ...materials.flatMap((_, i) => ["r", "g", "b"].map((c) => `${c}_${"ab"[i]}`))]]);
    const out = [0, 0, 0];
    for (let v = -0.9; v < 1; v += 0.1) {
      for (let u = -0.9; u < 1; u += 0.1) {
        if (u * u + v * v >= 1) continue;
        const all = materials.flatMap((_, i) => {
          if (state.lit === "sky") this.underSky(i, u, v, out);
          else this.lit(i, [u, v, Math.sqrt(1 - u * u - v * v)], out);
          return [...out];
        });
        rows.push([Number(u.toFixed(2)), Number(v.toFixed(2)), ...all]);
      }
    }
    return rows;
  }

  /** @param {number} x @param {number} y */
  grab(x, y) {
    const s = this.sphere();
    const line = s.x + s.r * (2 * state.wipe - 1);
    const isOn = y < s.y + s.r + 8;
    this.held = !isOn ? "lobe" : materials.length > 1 && Math.abs(x - line) < 10 ? "line" : "lamp";
    this.from = [x, y, ...state.turn];
    this.drag(x, y);
  }

  /** @param {number} x @param {number} y */
  drag(x, y) {
    const s = this.sphere();
    if (this.held === "line") set({ wipe: Math.min(1, Math.max(0, ((x - s.x) / s.r + 1) / 2)) });
    else if (this.held === "lobe") set({ turn: [this.from[2] - (x - this.from[0]) / 2, Math.min(90, Math.max(0, this.from[3] + (y - this.from[1]) / 2))] });
    else {
      // The normal that faces the lamp; beyond the rim it turns behind the sphere.
      const [u, v] = [(x - s.x) / s.r, (s.y - y) / s.r];
      const lamp = /** @type {[number, number]} */ ([Math.min(170, 90 * Math.hypot(u, v)), Math.atan2(v, u) / RAD]);
      set({ lamp, lit: "point" });
    }
    this.move();
    this.show();
  }

  /** @param {number} right @param {number} up @param {boolean} shift */
  step(right, up, shift) {
    if (shift) set({ wipe: Math.min(1, Math.max(0, state.wipe + 0.02 * right)) });
    else set({ turn: [state.turn[0] + 5 * right, Math.min(90, Math.max(0, state.turn[1] + 5 * up))] });
  }
}
