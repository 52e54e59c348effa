// What the program has put into the page.

import { Table, decoded } from "./table.js";
import { Colours } from "./theme.js";

/** @typedef {import("./table.js").TableFacts} TableFacts */
/** @typedef {import("./geometry.js").Vector} Vector */

/**
 * A material.
 * @typedef {object} MaterialFacts
 * @property {string} name
 * @property {string} argument of commands
 * @property {string} symmetry
 * @property {string[]} channels names of the planes of its table but the first, which is luminance
 * @property {boolean} coloured the channels are R, G, B
 * @property {TableFacts & {blob: string}} table
 * @property {string} note how the table differs from the material
 * @property {[number, number]} range of luminance that colours are for, sr⁻¹
 */

/**
 * A sphere under the sky: planes of linear R, G, B by rows of pixels; of B the error of its picture against that of A.
 * @typedef {{blob: string, dims: number[], step: number, low: number, white: number, nrmse: number | null}} SkyFacts
 */

/**
 * Readings: columns of numbers, each as long as there are readings.
 * @typedef {object} ReadingFacts
 * @property {string} name of the file, or of the material that was read
 * @property {string} note
 * @property {string} blob light x y z, sensor x y z, luminance, uncertainty (0: unknown), expected, its uncertainty (0: unknown), suspected, line, visit, then the spectrum
 * @property {number} columns
 * @property {string[]} channels of the spectrum
 * @property {boolean} isotropic
 */

/**
 * An instrument and its tour.
 * @typedef {object} MachineFacts
 * @property {string} name
 * @property {{name: string, parent: number, vector: Vector, wraps: boolean}[]} axes parent: −1 is the base
 * @property {{light: number, sensor: number, sample: number}} ends the axis that each is on, −1: fixed
 * @property {string} blob of the visits: pose, stop, seconds until it is read, light x y z, sensor x y z, the axes' positions (rad)
 * @property {number} columns
 * @property {{pose: number, why: string}[]} lost poses out of reach
 * @property {number} lostCount as many there are
 * @property {{visits: number, minutes: number, nrmse: number | null, error: number | null, method: string}[]} errors of reconstructions from the first readings
 * @property {string} command
 */

/**
 * Profiles of moments over the view.
 * @typedef {object} MomentFacts
 * @property {string[]} columns
 * @property {number[]} views degrees
 * @property {(number | null)[][]} values a list a column
 * @property {(number | null)[][]} uncertainties
 */

/**
 * A parametrization.
 * @typedef {object} ChartFacts
 * @property {string} kind
 * @property {{symbol: string, low: number, high: number, angle: boolean, warps: {name: string, family: string, parameter: number}[]}[]} axes
 */

/**
 * @typedef {object} PageData
 * @property {MaterialFacts[]} materials A, and B
 * @property {{sequential: string, signed: string}} colours
 * @property {{least: number, most: number}} signed sizes of differences of the first and of the last colour
 * @property {ChartFacts[]} charts
 * @property {{chart: string, material: string, shares: number[] | null, gradients: number[] | null, error: number, both: number | null}[]} distortion
 * @property {{measure: string, nrmse: number | null, error: number | null}[]} errors of B against A
 * @property {(SkyFacts | null)[]} sky
 * @property {(MomentFacts | null)[]} moments
 * @property {{dims: number[], blob: string, step: number, low: number} | null} uncertainty of B, over its value
 * @property {ReadingFacts | null} readings
 * @property {MachineFacts | null} machine
 */

/** @type {PageData} */
export const data = JSON.parse(document.getElementById("data")?.textContent ?? "{}");

/** Colours of values, and of differences. */
export const colours = {
  sequential: new Colours(data.colours.sequential),
  signed: new Colours(data.colours.signed),
};

/** Bytes of a part of the page. @param {string} id */
export async function bytesOf(id) {
  const text = document.getElementById(id)?.textContent ?? "";
  const raw = atob(text.trim());
  const packed = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) packed[i] = raw.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Rows of numbers of a part of the page. @param {{blob: string, columns: number}} part @returns {Promise<number[][]>} */
export async function rowsOf({ blob, columns }) {
  const all = await bytesOf(blob);
  const n = Math.floor(all.length / 4 / columns);
  return Array.from({ length: n }, (_, i) => Array.from(new Float32Array(all.buffer, 4 * columns * i, columns)));
}

/** A material whose table is there. */
export class Material {
  /** @param {MaterialFacts} facts @param {Table} table */
  constructor(facts, table) {
    this.facts = facts;
    this.table = table;
    /** Another number for each material that is shown. */
    this.serial = Material.made++;
  }

  static made = 0;

  /** The plane of a channel of A: 0 is luminance; −1: the material has none of that name. @param {number} channel */
  plane(channel) {
    if (channel === 0) return 0;
    return this.facts.channels.indexOf(channelName(channel) ?? "") + 1 || -1;
  }
}

/** The name of a channel of A; none of luminance. @param {number} channel */
export const channelName = (channel) => materials[0]?.facts.channels[channel - 1];

/** Materials on show: A, and B. @type {Material[]} */
export const materials = [];

/** Standard uncertainty of B over its value, where the program has one. @type {{table?: Table}} */
export const relative = {};

/** Unpacks the tables. */
export async function unpack() {
  const tables = data.materials.map(async (facts) => new Material(facts, new Table(facts.table, decoded(await bytesOf(facts.table.blob), facts.table))));
  materials.splice(0, 2, ...(await Promise.all(tables)));
  if (!data.uncertainty) return;
  const facts = { ...data.uncertainty, reciprocal: true, shift: 0.5, nearest: false, luminance: [] };
  relative.table = new Table(facts, decoded(await bytesOf(facts.blob), facts));
}

/** A place on the scale of differences, in [−1, 1]. @param {number} difference */
export function signedPlace(difference) {
  const { least, most } = data.signed;
  const size = Math.log(Math.max(1, Math.abs(difference) / least)) / Math.log(most / least);
  return Math.min(1, size) * Math.sign(difference);
}
