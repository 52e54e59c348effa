// Values along the sensor's elevation at a light, in a plane: Cartesian and polar.

import { materials, relative } from "./data.js";
import { RAD, angles, cross, direction, dot, unit } from "./geometry.js";
import { quantity, value } from "./look.js";
import { Axis, degrees, digits, frame, legend } from "./plot.js";
import { near, shownValue } from "./readings.js";
import { set, state } from "./state.js";
import { lineOf, theme } from "./theme.js";
import { View } from "./view.js";

/** @typedef {import("./geometry.js").Vector} Vector */
/** @typedef {{at: number, value: number, u: number, suspected: boolean}} Dot */

/** Steps of the curves, degrees. */
const STEP = 0.25;

/** A reading counts to a plane up to this angle off it, degrees. */
const OFF = 1.5;

/** The sensor at an elevation in the plane: negative on the side of the light's mirror direction. @param {number} at degrees @returns {Vector} */
const sensorAt = (at) => direction(Math.abs(at), state.light[1] + state.plane + (at < 0 ? 180 : 0));

export class Slices extends View {
  constructor() {
    super({
      id: "slices",
      title: "Slices",
      about: "Values along the sensor's elevation at the light of the hemisphere, in the plane of the azimuth that the slider turns (0°: the plane of incidence; negative elevations are on the side of the mirror direction). Drag moves the sensor; arrow keys by 1°, up and down turn the plane.",
      touch: "pan-y",
      command: (name) => (name ? `gonio picture slices ${name} -o pictures` : ""),
      needs: ["light", "sensor", "channel", "scale", "cosine", "plane", "near", "time", "look", "show"],
    });
    /** The point of the polar plot that lengths are from. */
    this.foot = [0, 0];
  }

  /** A curve of a material. @param {number} place @returns {[number, number][]} */
  curve(place) {
    const light = direction(...state.light);
    const all = /** @type {[number, number][]} */ ([]);
    for (let at = -89.5; at <= 89.5; at += STEP) all.push([at, value(place, light, sensorAt(at))]);
    return all;
  }

  /** Elevations with B − 2u and B + 2u of luminance; none where the program has no u. @param {[number, number][][]} curves */
  band(curves) {
    const { table } = relative;
    if (!table || state.channel > 0 || curves.length === 0) return undefined;
    const light = direction(...state.light);
    return curves[curves.length - 1].map(([at, v]) => {
      const u = v * table.value(0, ...light, ...sensorAt(at));
      return [at, v - 2 * u, v + 2 * u];
    });
  }

  /** Readings in the plane. @returns {Dot[]} */
  dots() {
    const light = direction(...state.light);
    const along = sensorAt(90);
    const normal = unit(cross([0, 0, 1], along));
    return near(light).flatMap(({ reading, sensor }) => {
      if (Math.abs(Math.asin(Math.min(1, Math.abs(dot(sensor, normal)))) / RAD) > OFF) return [];
      const at = Math.atan2(dot(sensor, along), sensor[2]) / RAD;
      const u = state.channel > 0 ? 0 : reading.u * (state.cosine ? reading.light[2] : 1);
      return [{ at, value: shownValue(reading), u, suspected: reading.suspected }];
    });
  }

  /** The sensor's elevation in the plane. */
  marked() {
    const sensor = direction(...state.sensor);
    return Math.atan2(dot(sensor, sensorAt(90)), sensor[2]) / RAD;
  }

  /** @param {import("./pen.js").Pen} pen @param {number} width @param {number} height */
  draw(pen, width, height) {
    const { ink, b, accent, warn } = theme();
    const curves = materials.map((_, i) => this.curve(i));
    const dots = this.dots();
    const values = [...curves.flat().map((p) => p[1]), ...dots.map((d) => d.value)].filter((v) => v > 0 && v < Infinity);
    const most = values.length ? values.reduce((m, v) => Math.max(m, v), 0) : 1;
    const least = values.length ? values.reduce((m, v) => Math.min(m, v), Infinity) : 0.1;
    const scale = /** @type {import("./plot.js").Scale} */ (state.scale);
    const isLogarithm = scale === "logarithm";
    const y = new Axis(isLogarithm ? Math.max(least / 1.3, most * 1e-7) : 0, isLogarithm ? most * 1.5 : most * 1.08, scale);
    const x = new Axis(-90, 90);
    this.lay(62, 26, width - 76, height * 0.52 - 26);
    const at = frame(pen, this.box, x, y, "elevation of the sensor, degrees", quantity());
    const bands = this.band(curves);
    pen.within(this.box, () => {
      if (bands) {
        const upper = bands.map((p) => at(p[0], p[2]));
        const lower = bands.map((p) => at(p[0], Math.max(p[1], 0))).reverse();
        const floor = this.box[1] + this.box[3] + 4;
        const area = [...upper, ...lower].filter((p) => Number.isFinite(p[1]));
        pen.path(area.map((p) => [p[0], Math.min(p[1], floor)]), { fill: b, alpha: 0.2 }, true);
      }
      const marked = this.marked();
      pen.path([at(marked, y.lo), at(marked, y.hi)], { stroke: accent, dash: [2, 3] });
      curves.forEach((curve, i) => pen.path(curve.map((p) => at(...p)), lineOf(i)));
      for (const dot of dots) {
        const [px, py] = at(dot.at, dot.value);
        if (dot.u > 0) pen.path([at(dot.at, dot.value + 2 * dot.u), at(dot.at, Math.max(dot.value - 2 * dot.u, y.lo))], { stroke: ink });
        pen.circle(px, py, 3.5, { fill: dot.suspected ? warn : ink });
      }
    });
    const all = [...materials.map((_, i) => ({ name: "AB"[i], style: lineOf(i) })), ...(bands ? [{ name: "± 2u", style: { fill: b, alpha: 0.3 } }] : []), ...(dots.length ? [{ name: "readings", style: { fill: ink } }] : [])];
    legend(pen, 62, 16, all);
    this.polar(pen, width, height, curves, dots, y);
  }

  /**
   * The same as lengths from a point.
   * @param {import("./pen.js").Pen} pen @param {number} width @param {number} height @param {[number, number][][]} curves @param {Dot[]} dots @param {Axis} y
   */
  polar(pen, width, height, curves, dots, y) {
    const { ink, faint, accent } = theme();
    const top = height * 0.52 + 52;
    const r = Math.min(width / 2 - 30, height - top - 14);
    const [cx, cy] = [width / 2, top + r];
    this.foot = [cx, cy];
    const at = (/** @type {number} */ angle, /** @type {number} */ v) => {
      const length = r * Math.min(1, Math.max(0, y.place(v)));
      return [cx + length * Math.sin(angle * RAD), cy - length * Math.cos(angle * RAD)];
    };
    for (const v of y.ticks(4)) {
      pen.path(Array.from({ length: 61 }, (_, k) => at(-90 + 3 * k, v)), { stroke: faint });
    }
    for (let angle = -90; angle <= 90; angle += 30) {
      pen.path([[cx, cy], at(angle, y.hi)], { stroke: faint });
      const [px, py] = [cx + (r + 8) * Math.sin(angle * RAD), cy - (r + 8) * Math.cos(angle * RAD)];
      pen.text(px, py + 3, `${angle}°`.replace("-", "−"), { colour: ink, size: 10, align: angle < 0 ? "end" : angle ? "start" : "middle" });
    }
    curves.forEach((curve, i) => pen.path(curve.map((p) => at(...p)), lineOf(i)));
    for (const dot of dots) {
      const [px, py] = at(dot.at, dot.value);
      pen.circle(px, py, 2.5, { fill: ink });
    }
    // The light, where it lies in the plane.
    if (Math.abs(Math.sin(state.plane * RAD)) < 1e-6) {
      const angle = (Math.cos(state.plane * RAD) > 0 ? 1 : -1) * state.light[0];
      pen.path([[cx, cy], at(angle, y.hi)], { stroke: accent, dash: [2, 3], width: 1.5 });
    }
  }

  words() {
    const [light, marked] = [direction(...state.light), this.marked()];
    const values = materials.map((m, i) => `${"AB"[i]} ${digits(value(i, light, sensorAt(marked)))}`);
    return `light ${degrees(state.light[0])}, plane ${degrees(state.plane)}, elevation ${degrees(marked)}: ${values.join(", ")}; ${this.dots().length} readings in the plane`;
  }

  rows() {
    const curves = materials.map((_, i) => this.curve(i));
    const head = ["theta_i_deg", "plane_deg", "elevation_deg", ...materials.map((_, i) => `value_${"ab"[i]}`)];
    const rows = (curves[0] ?? []).map((p, i) => [state.light[0], state.plane, p[0], ...curves.map((c) => c[i][1])]);
    return [head, ...rows];
  }

  /** @param {number} at */
  mark(at) {
    set({ sensor: angles(sensorAt(Math.min(89, Math.max(-89, at)))) });
  }

  /** @param {number} x @param {number} y */
  drag(x, y) {
    const [left, top, width, height] = this.box;
    if (y > top + height + 40) {
      const [cx, cy] = this.foot;
      return this.mark(Math.atan2(x - cx, Math.max(1e-9, cy - y)) / RAD);
    }
    this.mark(-90 + (180 * (x - left)) / width);
  }

  /** @param {number} right @param {number} up */
  step(right, up) {
    if (up) set({ plane: (state.plane + up + 360) % 360 });
    else this.mark(this.marked() + right);
  }
}
