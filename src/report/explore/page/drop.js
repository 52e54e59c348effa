// Files that are dropped onto the page: MERL tables and gonio's readings. Nothing leaves the page.

import { Material, data, materials, relative } from "./data.js";
import { direction } from "./geometry.js";
import { about, clock, showReadings } from "./readings.js";
import { redraw } from "./state.js";
import { Table } from "./table.js";

/** @typedef {import("./readings.js").Reading} Reading */

/** Scales of R, G, B of the database's tables, and weights of their luminance. */
const SCALES = [1 / 1500, 1.15 / 1500, 1.66 / 1500];
const LUMINANCE = [0.2126, 0.7152, 0.0722];

/** The largest file that is read: a table of 360 columns with room to spare. */
const MOST_BYTES = 80e6;
const MOST_READINGS = 20_000;

/** Reads a MERL table. @param {string} name @param {ArrayBuffer} buffer @returns {Material | string} or what is wrong */
function merl(name, buffer) {
  const dims = buffer.byteLength >= 12 ? Array.from(new Int32Array(buffer, 0, 3)) : [];
  const cells = dims[0] * dims[1] * dims[2];
  const isTable = dims[0] === 90 && dims[1] === 90 && (dims[2] === 180 || dims[2] === 360);
  if (!isTable) return `${name} is no MERL table of 90 × 90 × 180 or 360 cells: its header says ${dims.join(" × ") || "nothing"}`;
  if (buffer.byteLength !== 12 + 24 * cells) return `${name} has ${buffer.byteLength} bytes, where its header asks for ${12 + 24 * cells}`;
  // Doubles lie at multiples of eight; every machine with a browser stores them as the file does.
  const stored = new Float64Array(buffer.slice(12));
  const channels = SCALES.map(() => new Float32Array(cells));
  const shown = [];
  for (let j = 0; j < cells; j++) {
    const [r, g, b] = [stored[j], stored[cells + j], stored[2 * cells + j]];
    const isData = r >= 0 && g >= 0 && b >= 0 && r + g + b < Infinity;
    channels[0][j] = isData ? r * SCALES[0] : NaN;
    channels[1][j] = isData ? g * SCALES[1] : NaN;
    channels[2][j] = isData ? b * SCALES[2] : NaN;
    if (isData && j % 97 === 0) shown.push(LUMINANCE.reduce((sum, w, c) => sum + w * channels[c][j], 0));
  }
  if (!shown.length) return `${name} has no cell with data`;
  const bright = shown.filter((v) => v > 0).sort((a, b) => a - b);
  const most = bright[bright.length - 1] ?? 1;
  const range = /** @type {[number, number]} */ ([bright[Math.floor(bright.length / 100)] ?? most / 10, bright[Math.floor((bright.length - 1) * 0.99)] ?? most]);
  const table = { dims, reciprocal: dims[2] === 180, shift: 0.5, nearest: false, step: 0, low: 0, luminance: LUMINANCE };
  const facts = {
    name: name.replace(/\.binary$/, ""),
    argument: quoted(name),
    symmetry: "isotropic",
    channels: ["R", "G", "B"],
    coloured: true,
    table: { ...table, blob: "" },
    note: bright.length ? "a dropped file" : "all of its values are 0",
    range,
  };
  return new Material(facts, new Table(table, channels));
}

/** Cells of a line of CSV. @param {string} line */
const cells = (line) => line.split(",").map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));

/** Weights of channels in luminance: of wavelengths those of a mean by the trapezoid rule. @param {string[]} channels */
function luminanceOf(channels) {
  if (channels.join() === "R,G,B") return LUMINANCE;
  const nm = channels.map((name) => parseFloat(name));
  const last = nm.length - 1;
  if (last < 1 || nm.some(Number.isNaN)) return channels.map(() => 1 / channels.length);
  return nm.map((_, i) => (nm[Math.min(i + 1, last)] - nm[Math.max(i - 1, 0)]) / 2 / (nm[last] - nm[0]));
}

/** Reads the program's readings. @param {string} name @param {string} text @returns {{readings: Reading[], channels: string[], isotropic: boolean, every: number, left: number} | string} or what is wrong */
function readCsv(name, text) {
  const lines = text.split(/\r?\n/);
  const head = lines.findIndex((line) => line && !line.startsWith("#"));
  const names = head < 0 ? [] : cells(lines[head]);
  const column = (/** @type {string} */ key) => names.indexOf(key);
  const angle = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"].map(column);
  const values = names.flatMap((key, i) => (/^value(_|$)/.test(key) ? [i] : []));
  const has = angle[0] >= 0 && angle[2] >= 0 && angle[3] >= 0 && values.length > 0;
  if (!has) return `${name} has not the columns theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg and value of gonio's readings; gonio explore --readings ${quoted(name)} -o page.html reads what others write`;
  const channels = values.map((i) => names[i].replace(/^value_?/, "").replace(/^([rgb])$/, (c) => c.toUpperCase()).replace(/(\d)nm$/, "$1 nm"));
  const symmetry = lines.slice(0, head).find((line) => /^# *symmetry *=/.test(line));
  const isotropic = !symmetry || !/isotropic"? *: *false/.test(symmetry);
  const weights = luminanceOf(channels);
  const uncertainty = column(names[values[0]].replace("value", "uncertainty"));
  const full = lines.flatMap((line, i) => (i > head && line && !line.startsWith("#") ? [i] : []));
  const every = Math.ceil(full.length / MOST_READINGS);
  /** @type {Reading[]} */
  const readings = [];
  let left = 0;
  for (const at of full.filter((_, i) => i % every === 0)) {
    const row = cells(lines[at]);
    const number = (/** @type {number} */ i) => (i < 0 || row[i] === "" || row[i] === undefined ? NaN : Number(row[i]));
    const [ti, pi, to, po] = angle.map((i) => (i < 0 ? 0 : number(i)));
    const spectrum = values.map(number);
    const value = spectrum.reduce((sum, v, c) => sum + v * weights[c], 0);
    const isDirection = Math.abs(ti) <= 90 && Math.abs(to) <= 90 && Math.abs(pi) <= 360.001 && Math.abs(po) <= 360.001;
    if (!isDirection) return `${name}:${at + 1}: a direction is not above the surface, or no number of degrees`;
    if (!Number.isFinite(value)) {
      left++;
      continue;
    }
    const u = number(uncertainty);
    const unknown = { expected: NaN, expectedU: 0, suspected: false, visit: 0 };
    const known = { value, u: u > 0 && channels.length === 1 ? u : 0, spectrum, line: at + 1 };
    readings.push({ light: direction(ti, pi), sensor: direction(to, po), ...known, ...unknown });
  }
  return readings.length ? { readings, channels, isotropic, every, left } : `${name} has no reading with a value`;
}

/** A name as one word of a shell. @param {string} name */
const quoted = (name) => (/^[\w./=,:@+-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`);

/** Shows a dropped file; returns a sentence about it. @param {File} file */
export async function drop(file) {
  const name = file.name.slice(0, 200);
  const ending = name.toLowerCase();
  if (file.size > MOST_BYTES) return `${name} has ${(file.size / 1e6).toFixed(0)} MB; a page reads up to ${MOST_BYTES / 1e6}`;
  if (ending.endsWith(".binary")) {
    const made = merl(name, await file.arrayBuffer());
    if (typeof made === "string") return made;
    // The first is A, the next B; of a page with both A is replaced.
    const place = materials.length === 1 ? 1 : 0;
    materials[place] = made;
    forget(place);
    redraw();
    return `${"AB"[place]} is ${made.facts.name}`;
  }
  if (ending.endsWith(".csv")) {
    const made = readCsv(name, await file.text());
    if (typeof made === "string") return made;
    const { readings, channels, isotropic, every, left } = made;
    const thinned = every > 1 ? `every ${every}th of its readings` : "";
    const note = [thinned, left ? `${left} rows without a value` : ""].filter(Boolean).join("; ");
    data.machine = null;
    clock.visits = Infinity;
    showReadings(readings, { ...about, name, note, channels, isotropic });
    return `${readings.length} readings of ${name}${note ? `: ${note}` : ""}`;
  }
  return `${name} is neither a MERL table (.binary) nor gonio's readings (.csv); for others: gonio explore ${quoted(name)} -o page.html`;
}

/** Forgets what was computed of a material that is no longer shown. @param {number} place */
function forget(place) {
  data.errors = [];
  for (const facts of data.sky) if (facts) facts.nrmse = null;
  relative.table = undefined;
  data.distortion = [];
  data.sky[place] = null;
  data.moments[place] = null;
  if (data.machine) data.machine.errors = [];
}
