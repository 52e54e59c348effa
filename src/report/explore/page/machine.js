// The instrument along its tour: arms, lamp, sensor and sample in the laboratory, and the error of the readings so far.

import { rowsOf } from "./data.js";
import { angles, cross, dot, projection } from "./geometry.js";
import { Axis, digits, frame } from "./plot.js";
import { set, state } from "./state.js";
import { theme } from "./theme.js";
import { View, button, element } from "./view.js";

/** @typedef {import("./geometry.js").Vector} Vector */

/** Columns of the visits: see MachineFacts. */
const [STOP, UNTIL, LIGHT, SENSOR, AXES] = [1, 2, 3, 6, 9];

/** The whole tour takes this long when it is played, seconds. */
const PLAYED = 40;

/** A turn about an axis of length 1. @param {Vector} v @param {Vector} axis @param {number} angle @returns {Vector} */
function turn(v, axis, angle) {
  const [c, s, along] = [Math.cos(angle), Math.sin(angle), dot(v, axis)];
  const side = cross(axis, v);
  return /** @type {Vector} */ ([0, 1, 2].map((i) => v[i] * c + side[i] * s + axis[i] * along * (1 - c)));
}

export class Machine extends View {
  /** @param {import("./data.js").MachineFacts} facts */
  constructor(facts) {
    super({
      id: "machine",
      title: "The machine",
      about: "Light (sun), sensor (box) and sample of the instrument on its tour. Play it, or move along it by the slider or the arrow keys; readings appear in the other views as they are taken. Drag turns the scene.",
      command: () => facts.command,
      needs: ["time", "scene", "look"],
    });
    this.facts = facts;
    /** @type {number[][]} */
    this.visits = [];
    this.playing = 0;
    this.grabbed = [0, 0, 0, 0];
    this.play = button("Play", () => this.toggle());
    this.slider = /** @type {HTMLInputElement} */ (element("input", { type: "range", min: "0", max: "1000", value: "1000", "aria-label": "time along the tour" }));
    this.slider.addEventListener("input", () => this.go((this.total() * Number(this.slider.value)) / 1000));
    this.controls.append(this.play, this.slider);
  }

  /** Unpacks the tour. */
  async unpack() {
    this.visits = await rowsOf(this.facts);
  }

  count() {
    return this.visits.length;
  }

  /** A number of a visit; 0 before the first. @param {number} visit @param {number} column */
  cell(visit, column) {
    return this.visits[visit]?.[column] ?? 0;
  }

  /** Seconds of the whole tour. */
  total() {
    return this.visits.at(-1)?.[UNTIL] ?? 0;
  }

  now() {
    return state.time < 0 ? this.total() : Math.min(state.time, this.total());
  }

  /** Goes to a time. @param {number} seconds */
  go(seconds) {
    const time = Math.min(this.total(), Math.max(0, seconds));
    set({ time: time >= this.total() ? -1 : time });
  }

  /** Visits that are over at a time. @param {number} time */
  done(time) {
    const next = this.visits.findIndex((visit) => visit[UNTIL] > time + 1e-6);
    return next < 0 ? this.count() : next;
  }

  toggle() {
    if (this.playing) {
      cancelAnimationFrame(this.playing);
      this.playing = 0;
    } else {
      if (state.time < 0) this.go(0);
      let last = performance.now();
      const tick = (/** @type {number} */ at) => {
        this.go(this.now() + ((at - last) * this.total()) / PLAYED / 1000);
        last = at;
        this.playing = state.time < 0 ? 0 : requestAnimationFrame(tick);
        if (!this.playing) this.play.textContent = "Play";
      };
      this.playing = requestAnimationFrame(tick);
    }
    this.play.textContent = this.playing ? "Pause" : "Play";
  }

  /** Positions of the axes at a time, rad: moved evenly from visit to visit. @param {number} time */
  positions(time) {
    const next = Math.min(this.done(time), this.count() - 1);
    const [from, to] = [this.cell(next - 1, UNTIL), this.cell(next, UNTIL)];
    const share = to > from ? Math.min(1, Math.max(0, (time - from) / (to - from))) : 1;
    return this.facts.axes.map((axis, i) => {
      const [a, b] = [this.cell(next - 1, AXES + i), this.cell(next, AXES + i)];
      const isShorter = axis.wraps && Math.abs(b - a) > Math.PI;
      const way = isShorter ? b - a - 2 * Math.PI * Math.sign(b - a) : b - a;
      return a + share * way;
    });
  }

  /** A direction that is fixed to an axis, in the laboratory. @param {Vector} v @param {number} axis @param {number[]} positions @returns {Vector} */
  inLab(v, axis, positions) {
    const { axes } = this.facts;
    for (let i = axis; i >= 0; i = axes[i].parent) v = turn(v, axes[i].vector, positions[i]);
    return v;
  }

  /** @param {import("./pen.js").Pen} pen @param {number} width @param {number} height */
  draw(pen, width, height) {
    const { facts } = this;
    const { ink, faint, a, b, accent } = theme();
    const hasErrors = facts.errors.length > 0;
    const [cx, cy] = [width / 2, height * (hasErrors ? 0.31 : 0.5)];
    const r = Math.min(width, height * (hasErrors ? 0.62 : 1)) * 0.4;
    const positions = this.positions(this.now());
    const at = projection(state.scene, cx, cy, r);
    const z = /** @type {Vector} */ ([0, 0, 1]);
    const [light, sensor] = [facts.ends.light, facts.ends.sensor].map((axis) => this.inLab(z, axis, positions));
    const sample = (/** @type {Vector} */ v) => this.inLab(v, facts.ends.sample, positions);
    // The base, and the sample with its normal and its tangent.
    const ring = (/** @type {number} */ size, /** @type {(v: Vector) => Vector} */ map, /** @type {number} */ height) =>
      Array.from({ length: 49 }, (_, k) => at(map([size * Math.cos((k * Math.PI) / 24), size * Math.sin((k * Math.PI) / 24), height])));
    pen.path(ring(1.1, (v) => v, 0), { stroke: faint });
    pen.path(ring(0.28, sample, 0), { stroke: ink, fill: faint }, true);
    const here = at([0, 0, 0]);
    pen.path([here, at(sample([0, 0, 0.45]))], { stroke: ink, width: 1.5 });
    pen.path([here, at(sample([0.28, 0, 0]))], { stroke: ink, width: 2.5 });
    this.trail(pen, at);
    const arm = (/** @type {Vector} */ end, /** @type {string} */ stroke) => pen.path([here, at(end)], { stroke, width: 3 });
    arm(light, "#d49b00");
    arm(sensor, a);
    const [lx, ly] = at(light);
    pen.circle(lx, ly, 9, { fill: "#f5c518", stroke: ink });
    const [sx, sy] = at(sensor);
    pen.path([[sx - 8, sy - 8], [sx + 8, sy - 8], [sx + 8, sy + 8], [sx - 8, sy + 8]], { fill: a, stroke: ink }, true);
    pen.text(lx + 13, ly, "light", { colour: ink, size: 11 });
    pen.text(sx + 13, sy, "sensor", { colour: ink, size: 11 });
    facts.axes.forEach((axis, i) => {
      const word = `${axis.name} ${((positions[i] ?? 0) * 180 / Math.PI).toFixed(1)}°`.replace("-", "−");
      pen.text(10, 16 + 15 * i, word, { colour: ink, size: 11 });
    });
    if (hasErrors) this.errors(pen, width, height, b, accent);
    const place = String(Math.round((1000 * this.now()) / (this.total() || 1)));
    if (this.slider.value !== place) this.slider.value = place;
  }

  /** Where the sensor has been, seen from the sample. @param {import("./pen.js").Pen} pen @param {(v: Vector) => number[]} at */
  trail(pen, at) {
    const done = this.done(this.now());
    const { accent } = theme();
    for (let i = Math.max(0, done - 400); i < done; i++) {
      const [x, y] = at(/** @type {Vector} */ (this.visits[i].slice(SENSOR, AXES)));
      pen.circle(x, y, 1.5, { fill: accent, alpha: 0.5 });
    }
  }

  /** Errors of reconstructions from the readings so far. @param {import("./pen.js").Pen} pen @param {number} width @param {number} height @param {string} stroke @param {string} accent */
  errors(pen, width, height, stroke, accent) {
    const known = this.facts.errors.filter((e) => e.nrmse !== null);
    const values = known.map((e) => e.nrmse ?? 0).filter((v) => v > 0);
    const x = new Axis(0, this.total() / 60);
    const y = new Axis(Math.min(...values, 1) / 1.3, Math.max(...values, 0.01) * 1.3, "logarithm");
    const box = /** @type {import("./pen.js").Box} */ ([62, height * 0.66, width - 76, height * 0.34 - 44]);
    const at = frame(pen, box, x, y, "minutes of the instrument", "nrmse");
    pen.path(known.map((e) => at(e.minutes, e.nrmse ?? NaN)), { stroke, width: 2 });
    for (const e of known) {
      const [px, py] = at(e.minutes, e.nrmse ?? NaN);
      pen.circle(px, py, 3, { fill: stroke });
    }
    const now = this.now() / 60;
    pen.path([at(now, y.lo), at(now, y.hi)], { stroke: accent, dash: [3, 3] });
  }

  words() {
    const { facts } = this;
    const done = this.done(this.now());
    const stop = done ? this.cell(done - 1, STOP) + 1 : 0;
    const last = facts.errors.filter((e) => e.visits <= done).at(-1);
    const error = last && last.nrmse !== null ? `; from the first ${last.visits} by ${last.method} nrmse ${digits(last.nrmse)} ± ${digits(last.error ?? 0)}` : "";
    const lost = facts.lostCount ? `; ${facts.lostCount} poses out of reach: ${facts.lost.slice(0, 3).map((l) => `${l.pose} ${l.why}`).join(", ")}${facts.lostCount > 3 ? ", …" : ""}` : "";
    return `${facts.name}: minute ${(this.now() / 60).toFixed(1)} of ${(this.total() / 60).toFixed(1)}, ${done} of ${this.count()} readings, stop ${stop}${error}${lost}.`;
  }

  rows() {
    const { facts } = this;
    /** @type {(string | number)[][]} */
    const rows = [["pose", "minutes", "theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", ...facts.axes.map((a) => `${a.name}_deg`), "out_of_reach"]];
    for (let i = 0; i < this.count(); i++) {
      const vector = (/** @type {number} */ c) => angles(/** @type {Vector} */ (this.visits[i].slice(c, c + 3)));
      const axes = facts.axes.map((_, k) => (this.cell(i, AXES + k) * 180) / Math.PI);
      rows.push([this.cell(i, 0), this.cell(i, UNTIL) / 60, ...vector(LIGHT), ...vector(SENSOR), ...axes, ""]);
    }
    const gaps = Array(rows[0].length - 2).fill("");
    for (const { pose, why } of facts.lost) rows.push([pose, ...gaps, why]);
    return rows;
  }

  /** @param {number} x @param {number} y */
  grab(x, y) {
    this.grabbed = [x, y, ...state.scene];
  }

  /** @param {number} x @param {number} y */
  drag(x, y) {
    const [x0, y0, yaw, pitch] = this.grabbed;
    set({ scene: [yaw + (x - x0) / 2, Math.min(89, Math.max(-10, pitch + (y - y0) / 2))] });
  }

  /** To the next visit, or the one before. @param {number} right @param {number} up */
  step(right, up) {
    const done = this.done(this.now());
    if (right + up > 0) return this.go(this.cell(Math.min(done, this.count() - 1), UNTIL));
    // All pairs of a picture are read at once.
    const end = this.cell(done - 1, UNTIL);
    this.go(this.visits.findLast((visit) => visit[UNTIL] < end)?.[UNTIL] ?? 0);
  }
}
