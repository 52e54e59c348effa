// Values as the state asks for them, and pictures of them.

import { channelName, colours, materials, signedPlace } from "./data.js";
import { state } from "./state.js";
import { Axis, tick } from "./plot.js";
import { theme } from "./theme.js";

/** @typedef {import("./geometry.js").Vector} Vector */
/** @typedef {import("./plot.js").Scale} Scale */

/** The value of a material at a pair, of the channel that is chosen, times the cosine where that is asked for. @param {number} place 0: A, 1: B @param {Vector} light @param {Vector} sensor */
export function value(place, light, sensor) {
  const material = materials[place];
  const plane = material.plane(state.channel);
  if (plane < 0) return NaN;
  const f = material.table.value(plane, ...light, ...sensor);
  return state.cosine ? f * light[2] : f;
}

/** ln(B/A) at a pair. @param {Vector} light @param {Vector} sensor */
export function ratio(light, sensor) {
  const [a, b] = [value(0, light, sensor), value(1, light, sensor)];
  if (a === 0 && b === 0) return 0;
  if (Number.isNaN(a + b)) return NaN;
  return Math.log(Math.max(b, 1e-9) / Math.max(a, 1e-9));
}

/** True if the difference of B and A is shown. @param {string} show */
export const isDifference = (show) => show === "difference" && materials.length > 1;

/** What commands call a material; nothing where there is none. @param {number} place */
export const argument = (place) => materials[place]?.facts.argument;

/** The place of the material that is shown. */
export const shown = () => (state.show === "B" && materials.length > 1 ? 1 : 0);

/** The scale of values for all pictures of a material: the same wherever the light is. @param {number} [place] */
export function tone(place = 0) {
  const [lo, hi] = materials[place]?.facts.range ?? [0, 1];
  const isLogarithm = state.scale === "logarithm";
  return new Axis(isLogarithm ? lo : 0, Math.max(hi, lo * 1.0001), /** @type {Scale} */ (state.scale));
}

/**
 * A picture of so many pixels; `word` has the colour of each.
 * @param {HTMLCanvasElement} canvas @param {number} width @param {number} height @param {(x: number, y: number) => number} word
 */
export function paint(canvas, width, height, word) {
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const to = canvas.getContext("2d");
  if (!to) throw new Error("this browser has no canvas");
  const image = to.createImageData(width, height);
  const words = new Uint32Array(image.data.buffer);
  for (let y = 0, i = 0; y < height; y++) {
    for (let x = 0; x < width; x++, i++) words[i] = word(x, y);
  }
  to.putImageData(image, 0, 0);
  return canvas;
}

/** Grey stripes: no data. @param {number} x @param {number} y */
export const hatched = (x, y) => ((x + y) & 4 ? 0xff969696 : 0xffbebebe);

const ramp = document.createElement("canvas");

/**
 * A bar of colours with ticks below it.
 * @param {import("./pen.js").Pen} pen @param {import("./pen.js").Box} box @param {boolean} signed @param {Axis} axis @param {string} says
 */
export function bar(pen, box, signed, axis, says) {
  const [x, y, width, height] = box;
  const { ink } = theme();
  const map = signed ? colours.signed : colours.sequential;
  pen.image(box, paint(ramp, 128, 1, (i) => map.word(i / 127)));
  pen.path([[x, y], [x + width, y], [x + width, y + height], [x, y + height]], { stroke: ink, width: 0.5 }, true);
  const values = signed ? [-1, -0.1, -0.01, 0, 0.01, 0.1, 1] : axis.ticks(Math.floor(width / 60));
  for (const v of values) {
    const place = signed ? 0.5 + 0.5 * signedPlace(v) : axis.place(v);
    pen.text(x + place * width, y + height + 12, tick(v), { colour: ink, align: "middle", size: 10 });
  }
  pen.text(x + width / 2, y + height + 26, says, { colour: ink, align: "middle", size: 11 });
}

/** What values are, in words. */
export function quantity() {
  const channel = channelName(state.channel);
  const of = channel ? `, ${channel}` : materials[0]?.facts.channels.length === 1 ? "" : ", luminance";
  return `f${state.cosine ? " cos θ_i" : ""}${of} (sr⁻¹)`;
}
