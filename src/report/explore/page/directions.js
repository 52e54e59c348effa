// The hemisphere of the sensor's directions at a light that is dragged, and the readings there.

import { colours, materials, signedPlace } from "./data.js";
import { RAD, angles, direction } from "./geometry.js";
import { bar, hatched, isDifference, paint, quantity, ratio, shown, tone, value } from "./look.js";
import { degrees, digits } from "./plot.js";
import { about, add, basket, near, poseOf, schedule, shownValue } from "./readings.js";
import { set, state } from "./state.js";
import { theme } from "./theme.js";
import { View, button, element, nearest, save } from "./view.js";

/** @typedef {import("./geometry.js").Vector} Vector */
/** @typedef {import("./readings.js").Reading} Reading */

/** Pixels along each side of the picture: while something is held, and at rest. */
const SIDES = [96, 192];

export class Directions extends View {
  constructor() {
    super({
      id: "directions",
      title: "Directions",
      about: "Values over the hemisphere of the sensor: elevation is the radius. Drag the light (sun) or the sensor (cross); arrow keys move the light by 1°, with shift the sensor. Dots are readings whose light is near; N and P go from one to the next.",
      command: (name) => (name ? `gonio slice ${name} --view-deg ${Number(state.light[0].toFixed(2))} -o slice` : "gonio explore A B -o page.html"),
      needs: ["light", "sensor", "channel", "show", "scale", "cosine", "near", "time", "look"],
    });
    this.held = "";
    /** @type {Reading | undefined} */
    this.pointed = undefined;
    this.count = element("span", { "aria-live": "polite" });
    this.again = button("Read again", () => this.pointed && add(poseOf(this.pointed)));
    this.controls.append(
      this.again,
      button("Add this pose", () => add([...state.light, ...state.sensor])),
      button("Save schedule", () => basket.length && save("poses.csv", new Blob([schedule()], { type: "text/csv" }))),
      this.count,
    );
  }

  /** Centre and radius on paper. */
  disc() {
    const width = this.size[0];
    const r = width / 2 - 24;
    return { x: width / 2, y: r + 20, r };
  }

  /** A direction on paper. @param {[number, number]} at elevation and azimuth, degrees @returns {[number, number]} */
  place([theta, phi]) {
    const { x, y, r } = this.disc();
    return [x + (r * theta * Math.cos(phi * RAD)) / 90, y - (r * theta * Math.sin(phi * RAD)) / 90];
  }

  /** A place on paper as elevation, up to 89°, and azimuth. @param {number} px @param {number} py @returns {[number, number]} */
  at(px, py) {
    const { x, y, r } = this.disc();
    const theta = Math.min(89, (90 * Math.hypot(px - x, py - y)) / r);
    return [theta, Math.atan2(y - py, px - x) / RAD];
  }

  /** The colour of a value. @param {Vector} light @param {Vector} sensor @param {import("./plot.js").Axis} axis */
  word(light, sensor, axis) {
    if (isDifference(state.show)) {
      const r = ratio(light, sensor);
      return Number.isNaN(r) ? 0 : colours.signed.word(0.5 + 0.5 * signedPlace(r));
    }
    return colours.sequential.word(axis.place(value(shown(), light, sensor)));
  }

  /** @param {import("./pen.js").Pen} pen @param {number} width */
  draw(pen, width) {
    const { ink, faint, paper, accent, warn } = theme();
    const { x, y, r } = this.disc();
    const light = direction(...state.light);
    const axis = tone(shown());
    const close = near(light);
    if (!close.some(({ reading }) => reading === this.pointed)) this.pointed = undefined;
    if (materials.length) {
      const isDear = this.isMoving && materials[shown()].table.turns > 1;
      const side = isDear ? SIDES[0] / 2 : SIDES[this.isMoving ? 0 : 1];
      const sensor = /** @type {Vector} */ ([0, 0, 1]);
      paint(this.image, side, side, (column, row) => {
        const [u, v] = [(2 * column + 1) / side - 1, 1 - (2 * row + 1) / side];
        const radius = Math.hypot(u, v);
        if (radius >= 1) return 0;
        const s = Math.sin((radius * Math.PI) / 2) / (radius || 1);
        sensor[0] = u * s;
        sensor[1] = v * s;
        sensor[2] = Math.cos((radius * Math.PI) / 2);
        return this.word(light, sensor, axis) || hatched(column, row);
      });
      pen.image([x - r, y - r, 2 * r, 2 * r], this.image);
    }
    for (const ring of [30, 60, 90]) {
      pen.circle(x, y, (r * ring) / 90, { stroke: ring === 90 ? ink : faint, width: 1 });
      pen.text(x + 3, y - (r * ring) / 90 - 3, `${ring}°`, { colour: ink, size: 10 });
    }
    for (const { reading, sensor } of close) {
      const [px, py] = this.place(angles(sensor));
      const isHollow = isDifference(state.show);
      const fill = isHollow ? undefined : materials.length ? colours.sequential.css(axis.place(shownValue(reading))) : accent;
      pen.circle(px, py, reading === this.pointed ? 6 : 4, { fill, stroke: reading.suspected ? warn : ink, width: reading.suspected ? 3 : 1 });
    }
    const [mx, my] = this.place([state.light[0], state.light[1] + 180]);
    pen.circle(mx, my, 7, { stroke: paper, width: 3 });
    pen.circle(mx, my, 7, { stroke: ink, dash: [2, 2] });
    const [sx, sy] = this.place(state.sensor);
    for (const [stroke, wide] of /** @type {[string, number][]} */ ([[paper, 5], [ink, 2]])) {
      pen.path([[sx - 8, sy], [sx + 8, sy], [NaN, 0], [sx, sy - 8], [sx, sy + 8]], { stroke, width: wide });
    }
    const [lx, ly] = this.place(state.light);
    const rays = Array.from({ length: 8 }, (_, k) => (k * Math.PI) / 4);
    pen.circle(lx, ly, 13, { fill: paper, alpha: 0.8 });
    pen.path(rays.flatMap((a) => [[lx + 9 * Math.cos(a), ly + 9 * Math.sin(a)], [lx + 13 * Math.cos(a), ly + 13 * Math.sin(a)], [NaN, 0]]), { stroke: ink, width: 1.5 });
    pen.circle(lx, ly, 6, { fill: "#f5c518", stroke: ink });
    const box = /** @type {import("./pen.js").Box} */ ([x - r, y + r + 18, 2 * r, 10]);
    if (materials.length) bar(pen, box, isDifference(state.show), axis, isDifference(state.show) ? "ln(B/A)" : quantity());
    if (this.pointed && this.pointed.spectrum.length > 3) this.spectrum(pen, width, this.pointed);
    this.count.textContent = basket.length ? `${basket.length} poses to read` : "";
    this.again.toggleAttribute("disabled", !this.pointed);
  }

  /** The spectrum of a reading in a corner. @param {import("./pen.js").Pen} pen @param {number} width @param {Reading} reading */
  spectrum(pen, width, { spectrum }) {
    const { ink, paper, a } = theme();
    const [x, y, w, h] = [width - 116, 6, 110, 50];
    pen.path([[x, y], [x + w, y], [x + w, y + h], [x, y + h]], { fill: paper, stroke: ink }, true);
    const most = Math.max(...spectrum, 1e-12);
    pen.path(spectrum.map((v, i) => [x + 4 + ((w - 8) * i) / (spectrum.length - 1), y + h - 4 - ((h - 18) * Math.max(0, v)) / most]), { stroke: a, width: 1.5 });
    pen.text(x + 4, y + 11, `${about.channels[0]} to ${about.channels[spectrum.length - 1]}`, { colour: ink, size: 9 });
  }

  words() {
    const [light, sensor] = [direction(...state.light), direction(...state.sensor)];
    const values = materials.map((m, i) => `${"AB"[i]} ${digits(value(i, light, sensor))}`);
    if (values.length) values[values.length - 1] += " sr⁻¹";
    if (materials.length > 1) values.push(`ln(B/A) ${digits(ratio(light, sensor))}`);
    const where = `light ${degrees(state.light[0])}, ${degrees(state.light[1])}; sensor ${degrees(state.sensor[0])}, ${degrees(state.sensor[1])}`;
    return `${where}${values.length ? `: ${values.join(", ")}` : ""}${this.pointed ? `. ${this.ofReading(this.pointed)}` : ""}`;
  }

  /** @param {Reading} reading */
  ofReading(reading) {
    const u = reading.u > 0 ? ` ± ${digits(reading.u)}` : "";
    const line = reading.line > 0 ? `, line ${reading.line} of ${about.name}` : "";
    const known = Number.isFinite(reading.expected);
    const within = reading.expectedU > 0 ? ` ± ${digits(reading.expectedU)}` : "";
    const expected = known ? `; the others let expect ${digits(reading.expected)}${within}` : "";
    return `Reading ${digits(reading.value)}${u} sr⁻¹${line}${expected}${reading.suspected ? "; they contradict it" : ""}`;
  }

  rows() {
    const light = direction(...state.light);
    const head = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", ...materials.map((_, i) => `value_${"ab"[i]}`)];
    /** @type {(string | number)[][]} */
    const rows = [head];
    for (let theta = 0; theta < 90; theta += 5) {
      for (let phi = 0; phi < (theta ? 360 : 1); phi += 15) {
        const sensor = direction(theta, phi);
        rows.push([...state.light, theta, phi, ...materials.map((_, i) => value(i, light, sensor))]);
      }
    }
    return rows;
  }

  /** The reading under a place. @param {number} px @param {number} py */
  reading(px, py) {
    return nearest(near(direction(...state.light)), ({ sensor }) => this.place(angles(sensor)), px, py, 9);
  }

  /** @param {number} x @param {number} y */
  grab(x, y) {
    const [lx, ly] = this.place(state.light);
    this.held = Math.hypot(x - lx, y - ly) < 20 ? "light" : "sensor";
    const found = this.held === "sensor" && this.reading(x, y);
    if (found) this.pointed = found.reading;
    this.drag(x, y);
  }

  /** @param {number} x @param {number} y */
  drag(x, y) {
    const at = this.at(x, y);
    set(this.held === "light" ? { light: at } : { sensor: at });
    this.move();
  }

  /** @param {number} x @param {number} y */
  hover(x, y) {
    const found = Number.isNaN(x) ? undefined : this.reading(x, y);
    if (!found || found.reading === this.pointed) return;
    this.point(found.reading, found.sensor);
  }

  /** To the next reading near the light. @param {number} way */
  next(way) {
    const close = near(direction(...state.light));
    if (!close.length) return;
    const at = close.findIndex(({ reading }) => reading === this.pointed);
    const { reading, sensor } = close[(at + way + close.length) % close.length];
    this.point(reading, sensor);
  }

  /** Points at a reading that is seen in a direction. @param {Reading} reading @param {Vector} sensor */
  point(reading, sensor) {
    this.pointed = reading;
    const [theta, phi] = angles(sensor);
    set({ sensor: [Math.min(89, theta), phi] });
    this.show();
  }

  /** @param {number} right @param {number} up @param {boolean} shift */
  step(right, up, shift) {
    const [theta, phi] = shift ? state.sensor : state.light;
    const moved = /** @type {[number, number]} */ ([Math.min(89, Math.max(0, theta + up)), ((phi + right + 540) % 360) - 180]);
    set(shift ? { sensor: moved } : { light: moved });
  }
}
