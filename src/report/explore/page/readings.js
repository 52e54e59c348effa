// Readings of the page, and a basket of poses to be read.

import { channelName, data, rowsOf } from "./data.js";
import { RAD, angles, apart } from "./geometry.js";
import { redraw, state } from "./state.js";

/** @typedef {import("./geometry.js").Vector} Vector */

/**
 * A reading.
 * @typedef {object} Reading
 * @property {Vector} light
 * @property {Vector} sensor
 * @property {number} value luminance, sr⁻¹
 * @property {number} u its standard uncertainty; 0: unknown
 * @property {number} expected by the others; not a number: unknown
 * @property {number} expectedU
 * @property {boolean} suspected the others contradict it
 * @property {number} line of its file; 0: none
 * @property {number} visit of the tour that it was read at, from 0
 * @property {number[]} spectrum
 */

/** @type {Reading[]} */
export const readings = [];

/** Facts of the readings on show. */
export const about = { name: "", note: "", channels: /** @type {string[]} */ ([]), isotropic: true };

/** Shows other readings. @param {Reading[]} all @param {typeof about} facts */
export function showReadings(all, facts) {
  readings.splice(0, readings.length);
  for (const reading of all) readings.push(reading);
  Object.assign(about, facts);
  redraw();
}

/** Unpacks the readings of the page. */
export async function unpackReadings() {
  const facts = data.readings;
  if (!facts) return;
  for (const [ix, iy, iz, ox, oy, oz, value, u, expected, expectedU, suspected, line, visit, ...spectrum] of await rowsOf(facts)) {
    const known = { value, u, expected, expectedU, suspected: suspected > 0, line, visit, spectrum };
    readings.push({ light: [ix, iy, iz], sensor: [ox, oy, oz], ...known });
  }
  Object.assign(about, { name: facts.name, note: facts.note, channels: facts.channels, isotropic: facts.isotropic });
}

/** Visits of the tour that are over. */
export const clock = { visits: Infinity };

/** True if a reading has been taken by now. @param {Reading} reading */
export const isTaken = (reading) => reading.visit < clock.visits;

/** A reading's directions, turned so that the light has the azimuth of the state. @param {Reading} reading @returns {[Vector, Vector]} */
function seen(reading) {
  if (!about.isotropic) return [reading.light, reading.sensor];
  const by = state.light[1] * RAD - Math.atan2(reading.light[1], reading.light[0]);
  const [c, s] = [Math.cos(by), Math.sin(by)];
  const turn = (/** @type {Vector} */ [x, y, z]) => /** @type {Vector} */ ([c * x - s * y, s * x + c * y, z]);
  return [turn(reading.light), turn(reading.sensor)];
}

/** The value of a reading in the channel of the state, times the cosine where that is asked for; not a number: it has none. @param {Reading} reading */
export function shownValue(reading) {
  const at = about.channels.indexOf(channelName(state.channel) ?? "");
  const value = state.channel === 0 ? reading.value : (reading.spectrum[at] ?? NaN);
  return state.cosine ? value * reading.light[2] : value;
}

/** Readings whose light is near a direction: where each is seen. @param {Vector} light @returns {{reading: Reading, sensor: Vector}[]} */
export function near(light) {
  const all = [];
  for (const reading of readings) {
    if (!isTaken(reading) || Number.isNaN(shownValue(reading))) continue;
    const [at, sensor] = seen(reading);
    if (apart(at, light) <= state.near) all.push({ reading, sensor });
  }
  return all;
}

/** A pose: elevation and azimuth of light and sensor, degrees. @typedef {[number, number, number, number]} Pose */

/** Poses to be read. @type {Pose[]} */
export const basket = [];

/** The pose of a reading. @param {Reading} reading @returns {Pose} */
export const poseOf = (reading) => [...angles(reading.light), ...angles(reading.sensor)];

/** Adds a pose; one that is there is not added again. @param {Pose} pose */
export function add(pose) {
  const rounded = /** @type {Pose} */ (pose.map((v) => Number(v.toFixed(4))));
  if (!basket.some((p) => p.every((v, i) => Math.abs(v - rounded[i]) < 1e-4))) basket.push(rounded);
  redraw();
}

/** The basket as a schedule that the program reads. */
export function schedule() {
  const rows = basket.map((pose, i) => `${i},${pose.join(",")}\n`);
  return `index,theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg\n${rows.join("")}`;
}
