// Axes, ticks and frames of plots.

import { theme } from "./theme.js";

/** @typedef {import("./pen.js").Pen} Pen */
/** @typedef {import("./pen.js").Box} Box */
/** @typedef {"linear" | "logarithm" | "cube root"} Scale */

/** A number for people, with three significant digits. @param {number} v */
export function digits(v) {
  if (Number.isNaN(v)) return "no data";
  if (v === 0 || !Number.isFinite(v)) return String(v).replace("-", "−");
  const size = Math.floor(Math.log10(Math.abs(Number(v.toPrecision(3)))));
  const text = size < -3 || size > 4 ? v.toExponential(2) : v.toFixed(Math.max(0, 2 - size));
  return text.replace("-", "−");
}

/** Degrees with one decimal. @param {number} v */
export const degrees = (v) => `${v.toFixed(1).replace("-", "−")}°`;

/** A tick without needless zeros. @param {number} v */
export const tick = (v) => {
  const text = Math.abs(v) >= 1e4 || (v !== 0 && Math.abs(v) < 1e-3) ? v.toExponential(0) : String(Number(v.toPrecision(6)));
  return text.replace("-", "−");
};

/** A range of values along a line, on a scale. */
export class Axis {
  /** @param {number} lo @param {number} hi @param {Scale} scale */
  constructor(lo, hi, scale = "linear") {
    this.scale = scale;
    if (!(hi > lo)) hi = lo + (lo === 0 ? 1 : 0.1 * Math.abs(lo));
    if (scale === "logarithm") lo = Math.max(lo, hi * 1e-12);
    this.lo = lo;
    this.hi = hi;
    this.from = this.bent(lo);
    this.to = this.bent(hi);
  }

  /** The value where steps are equal. @param {number} v */
  bent(v) {
    if (this.scale === "logarithm") return Math.log(v);
    return this.scale === "cube root" ? Math.cbrt(v) : v;
  }

  /** Place of a value: 0 at the lower end, 1 at the upper; of 0 and less on a logarithm far below. @param {number} v */
  place(v) {
    if (this.scale === "logarithm" && v <= 0) return Number.isNaN(v) ? NaN : -1;
    return (this.bent(v) - this.from) / (this.to - this.from);
  }

  /** About as many round values. @param {number} most @returns {number[]} */
  ticks(most) {
    if (this.scale === "logarithm" && this.hi > 3 * this.lo) {
      const [a, b] = [Math.floor(Math.log10(this.lo)), Math.floor(Math.log10(this.hi) + 1e-9)];
      const step = Math.ceil((b - a) / most);
      const parts = b - a > 2 ? [1] : [1, 2, 5];
      const all = [];
      for (let k = a; k <= b; k += Math.max(1, step)) all.push(...parts.map((part) => part * 10 ** k));
      return all.filter((v) => v >= this.lo * (1 - 1e-9) && v <= this.hi * (1 + 1e-9));
    }
    const rough = (this.hi - this.lo) / most;
    const size = 10 ** Math.floor(Math.log10(rough));
    const steps = this.hi > 60 && rough > 5 && rough <= 90 ? [10, 15, 30, 45, 60, 90] : [size, 2 * size, 5 * size, 10 * size];
    const step = steps.find((s) => s >= rough) ?? rough;
    const all = [];
    for (let k = Math.ceil(this.lo / step - 1e-9); k * step <= this.hi + 1e-9 * step; k++) all.push(k * step);
    return all;
  }
}

/**
 * Draws a frame with ticks; returns the places on paper of values.
 * @param {Pen} pen @param {Box} box @param {Axis} x @param {Axis} y @param {string} under what x is @param {string} beside what y is
 */
export function frame(pen, box, x, y, under, beside) {
  const [left, top, width, height] = box;
  const { ink, faint } = theme();
  const at = (/** @type {number} */ a, /** @type {number} */ b) => [left + width * x.place(a), top + height * (1 - y.place(b))];
  for (const v of x.ticks(Math.max(2, Math.floor(width / 70)))) {
    const [px] = at(v, y.lo);
    pen.path([[px, top], [px, top + height + 4]], { stroke: faint });
    pen.text(px, top + height + 15, tick(v), { colour: ink, align: "middle", size: 11 });
  }
  for (const v of y.ticks(Math.max(2, Math.floor(height / 45)))) {
    const [, py] = at(x.lo, v);
    pen.path([[left - 4, py], [left + width, py]], { stroke: faint });
    pen.text(left - 5, py + 4, tick(v), { colour: ink, align: "end", size: 11 });
  }
  pen.path([[left, top], [left + width, top], [left + width, top + height], [left, top + height]], { stroke: ink }, true);
  pen.text(left + width / 2, top + height + 31, under, { colour: ink, align: "middle" });
  pen.text(left - 45, top + height / 2, beside, { colour: ink, align: "middle", upright: true });
  return at;
}

/**
 * Names beside pieces of their lines, from the left.
 * @param {Pen} pen @param {number} x @param {number} y @param {{name: string, style: import("./pen.js").Style}[]} all
 */
export function legend(pen, x, y, all) {
  const { ink } = theme();
  for (const { name, style } of all) {
    if (style.stroke) pen.path([[x, y - 4], [x + 18, y - 4]], { ...style, fill: undefined });
    else pen.circle(x + 9, y - 4, 4, style);
    pen.text(x + 23, y, name, { colour: ink, size: 11 });
    x += 34 + 5.6 * name.length;
  }
}
