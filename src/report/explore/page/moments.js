// Profiles of moments over the view, and the ellipse of a slice at one of them.

import { colours, data, materials } from "./data.js";
import { RAD, direction } from "./geometry.js";
import { hatched, paint, shown, tone, value } from "./look.js";
import { Axis, degrees, digits, frame, legend } from "./plot.js";
import { set, state } from "./state.js";
import { lineOf, theme } from "./theme.js";
import { View, element } from "./view.js";

/** @typedef {import("./geometry.js").Vector} Vector */

const SIDE = 96;

/** Columns that the ellipse is made of. */
const [MEAN, OTHER, C20, C11, C02] = ["mean_10", "mean_01", "covariance_20", "covariance_11", "covariance_02"];

export class Moments extends View {
  constructor() {
    super({
      id: "moments",
      title: "Moments",
      about: "A moment of slices over the elevation of the view, with its uncertainty, and the slice at the view of the slider over angles of the light in and across the plane of view, with the ellipse of one standard deviation. Drag or arrow keys move the view.",
      touch: "pan-y",
      command: (name) => (name ? `gonio moments ${name}` : ""),
      needs: ["view", "moment", "show", "scale", "channel", "look"],
    });
    this.choice = /** @type {HTMLSelectElement} */ (element("select", { "aria-label": "moment" }));
    this.choice.addEventListener("change", () => set({ moment: this.choice.value }));
    for (const name of this.names()) this.choice.append(element("option", { value: name }, name));
    if (this.names().length) this.controls.append(element("label", {}, "moment ", this.choice));
  }

  names() {
    return data.moments.find(Boolean)?.columns ?? [];
  }

  column() {
    return this.names().includes(state.moment) ? state.moment : this.names()[0];
  }

  /** A column at the view, between the views that the program has. @param {number} place @param {string} name */
  at(place, name) {
    const facts = data.moments[place];
    const values = facts?.values[facts.columns.indexOf(name)];
    if (!facts || !values) return NaN;
    const after = facts.views.findIndex((v) => v >= state.view);
    const i = Math.max(1, after < 0 ? facts.views.length - 1 : after);
    const [a, b] = [facts.views[i - 1], facts.views[i]];
    const t = Math.min(1, Math.max(0, (state.view - a) / (b - a)));
    return t === 0 ? (values[i - 1] ?? NaN) : t === 1 ? (values[i] ?? NaN) : (values[i - 1] ?? NaN) * (1 - t) + t * (values[i] ?? NaN);
  }

  /** @param {import("./pen.js").Pen} pen @param {number} width @param {number} height */
  draw(pen, width, height) {
    const { ink, a, b, accent } = theme();
    const name = this.column();
    this.lay(62, 26, width - 76, height * 0.4 - 20);
    if (name) {
      if (this.choice.value !== name) this.choice.value = name;
      const curves = data.moments.map((facts) => {
        if (!facts) return [];
        const c = facts.columns.indexOf(name);
        return facts.views.map((v, i) => [v, facts.values[c][i] ?? NaN, facts.uncertainties[c][i] ?? 0]);
      });
      const values = curves.flat().flatMap((p) => [p[1] - p[2], p[1] + p[2]]).filter(Number.isFinite);
      const [lo, hi] = values.length ? [Math.min(...values), Math.max(...values)] : [0, 1];
      const room = 0.06 * (hi - lo);
      const y = new Axis(lo - room, hi + room);
      const at = frame(pen, this.box, new Axis(0, 90), y, "elevation of the view, degrees", name);
      pen.within(this.box, () => {
        curves.forEach((curve, i) => {
          const known = curve.filter((p) => Number.isFinite(p[1]));
          const area = [...known.map((p) => at(p[0], p[1] + p[2])), ...known.reverse().map((p) => at(p[0], p[1] - p[2]))];
          pen.path(area, { fill: [a, b][i], alpha: 0.25 }, true);
          pen.path(curve.map((p) => at(p[0], p[1])), lineOf(i));
        });
        pen.path([at(state.view, y.lo), at(state.view, y.hi)], { stroke: accent, dash: [2, 3] });
      });
      legend(pen, 62, 16, materials.map((m, i) => ({ name: `${"AB"[i]} ${m.facts.name}`.slice(0, 24), style: lineOf(i) })));
    } else {
      pen.text(62, height * 0.2, "there are no profiles here", { colour: ink });
    }
    if (materials.length) this.slice(pen, width, height);
  }

  /** The slice with the ellipse. @param {import("./pen.js").Pen} pen @param {number} width @param {number} height */
  slice(pen, width, height) {
    const { ink, paper, accent } = theme();
    const top = height * 0.4 + 56;
    const side = Math.min(width - 90, height - top - 40);
    const left = (width - side) / 2 + 16;
    const box = /** @type {import("./pen.js").Box} */ ([left, top, side, side]);
    const sensor = direction(state.view, 0);
    const axis = tone(shown());
    const place = shown();
    pen.image(box, paint(this.image, SIDE, SIDE, (column, row) => {
      const [theta, phi] = [(180 * (column + 0.5)) / SIDE - 90, 90 - (180 * (row + 0.5)) / SIDE].map((v) => v * RAD);
      const light = /** @type {Vector} */ ([Math.sin(theta) * Math.cos(phi), Math.sin(phi), Math.cos(theta) * Math.cos(phi)]);
      return colours.sequential.word(axis.place(value(place, light, sensor))) || hatched(column, row);
    }));
    const at = frame(pen, box, new Axis(-90, 90), new Axis(-90, 90), "θ of the light, degrees", "φ of the light, degrees");
    const has = (/** @type {string} */ name) => data.moments[place]?.columns.includes(name);
    // What vanishes by symmetry is no column.
    const [mean, other, c20, c11, c02] = [MEAN, OTHER, C20, C11, C02].map((name) => (has(name) || !has(MEAN) ? this.at(place, name) : 0));
    const a = Math.sqrt(c20);
    const along = c11 / a;
    const across = Math.sqrt(Math.max(0, c02 - along * along));
    const points = Array.from({ length: 61 }, (_, k) => {
      const t = (k * Math.PI) / 30;
      return at((mean + a * Math.cos(t)) / RAD, (other + along * Math.cos(t) + across * Math.sin(t)) / RAD);
    });
    pen.within(box, () => {
      for (const [stroke, line] of /** @type {[string, number][]} */ ([[ink, 4], [paper, 2]])) pen.path(points, { stroke, width: line });
      const [px, py] = at(state.view, 0);
      pen.circle(px, py, 4, { fill: accent, stroke: paper });
      const [mx, my] = at(-state.view, 0);
      pen.circle(mx, my, 4, { stroke: paper, width: 2 });
    });
  }

  words() {
    const name = this.column();
    const values = name ? materials.map((_, i) => `${"AB"[i]} ${digits(this.at(i, name))}`).join(", ") : "no profiles";
    return `view ${degrees(state.view)}: ${name ?? ""} ${values}. Angles in rad; the point is the view, the ring its mirror direction.`;
  }

  rows() {
    const names = this.names();
    const rows = /** @type {(string | number)[][]} */ ([["material", "theta_o_deg", ...names.flatMap((n) => [n, `${n}_uncertainty`])]]);
    data.moments.forEach((facts, place) => {
      facts?.views.forEach((view, i) => {
        rows.push([materials[place].facts.name, view, ...names.flatMap((_, c) => [facts.values[c][i] ?? "", facts.uncertainties[c][i] ?? ""])]);
      });
    });
    return rows;
  }

  /** @param {number} x */
  drag(x) {
    const [left, , width] = this.box;
    this.go((90 * (x - left)) / width);
  }

  /** @param {number} right @param {number} up */
  step(right, up) {
    this.go(state.view + right + up);
  }

  /** Goes to a view, within those of the profiles. @param {number} view degrees */
  go(view) {
    const last = data.moments.find(Boolean)?.views.at(-1) ?? 89;
    set({ view: Math.min(last, Math.max(0, view)) });
  }
}
