// Opens the page: controls, views that make sense, files that are dropped.

import { Appearance } from "./appearance.js";
import { Coordinates } from "./coordinates.js";
import { data, materials, unpack } from "./data.js";
import { Directions } from "./directions.js";
import { drop } from "./drop.js";
import { Machine } from "./machine.js";
import { Moments } from "./moments.js";
import { about, clock, isTaken, readings, schedule, unpackReadings } from "./readings.js";
import { Slices } from "./slices.js";
import { frames, onChange, readFragment, redraw, set, state } from "./state.js";
import { forgetTheme } from "./theme.js";
import { element } from "./view.js";

const bar = document.getElementById("controls") ?? document.body;
const views = document.getElementById("views") ?? document.body;
const said = document.getElementById("said") ?? document.body;

/** @typedef {keyof import("./state.js").State} Key */

/** A control that is filled whenever the state changes. @param {() => void} fill @param {(Node | string)[]} parts */
function control(fill, ...parts) {
  onChange(fill);
  fill();
  return element("label", {}, ...parts);
}

/**
 * A list of values of the state.
 * @param {Key} key @param {string} label @param {() => [value: string | number, name: string][]} options that there are now
 */
function choice(key, label, options) {
  const select = /** @type {HTMLSelectElement} */ (element("select", { "aria-label": label, id: `choice-${key}` }));
  const fill = () => {
    const all = options();
    const names = all.map(([value, name]) => `${value} ${name}`).join();
    if (select.dataset.names !== names) {
      select.replaceChildren(...all.map(([value, name]) => element("option", { value: String(value) }, name)));
      select.dataset.names = names;
    }
    const wanted = String(state[key]);
    if (!all.some(([value]) => String(value) === wanted)) set({ [key]: all[0]?.[0] ?? state[key] });
    select.value = String(state[key]);
  };
  select.addEventListener("change", () => set({ [key]: typeof state[key] === "number" ? Number(select.value) : select.value }));
  return control(fill, `${label} `, select);
}

/** A slider of a number of the state. @param {Key} key @param {string} label @param {number} low @param {number} high @param {number} step */
function slider(key, label, low, high, step) {
  const input = /** @type {HTMLInputElement} */ (
    element("input", { type: "range", min: String(low), max: String(high), step: String(step), "aria-label": label, id: `slider-${key}` })
  );
  input.addEventListener("input", () => set({ [key]: Number(input.value) }));
  const shown = element("span", { class: "number" });
  const fill = () => {
    if (input.value !== String(state[key])) input.value = String(state[key]);
    shown.textContent = String(Number(Number(state[key]).toFixed(2))).replace("-", "−");
  };
  return control(fill, `${label} `, input, shown);
}

/** @type {() => [string | number, string][]} */
const channels = () => {
  const names = materials[0]?.facts.channels ?? [];
  return [[0, "luminance"], ...(names.length > 1 ? names.map((name, i) => /** @type {[number, string]} */ ([i + 1, name])) : [])];
};

function openControls() {
  bar.append(
    choice("show", "show", () => (materials.length > 1 ? [["A", `A ${materials[0].facts.name}`], ["B", `B ${materials[1].facts.name}`], ["difference", "ln(B/A)"]] : [["A", materials[0]?.facts.name ?? "A"]])),
    choice("channel", "channel", channels),
    choice("scale", "scale", () => ["logarithm", "linear", "cube root"].map((s) => [s, s])),
    choice("cosine", "values", () => [[0, "f"], [1, "f cos θ_i"]]),
    choice("look", "theme", () => ["auto", "light", "dark"].map((s) => [s, s])),
  );
}

/** What the look of the page is: the system's, light or dark. */
function applyLook() {
  if (state.look === "auto") delete document.documentElement.dataset.look;
  else document.documentElement.dataset.look = state.look;
  forgetTheme();
}

async function open() {
  if (typeof DecompressionStream === "undefined") throw new Error("this browser cannot inflate data; allowed: one of 2023 or later");
  readFragment(location.hash);
  applyLook();
  const machine = data.machine && new Machine(data.machine);
  const appearance = new Appearance();
  await Promise.all([unpack(), unpackReadings(), machine?.unpack(), appearance.unpack()]);
  openControls();
  const directions = new Directions();
  directions.controls.prepend(slider("near", "readings within, degrees", 0.5, 15, 0.5));
  const slices = new Slices();
  slices.controls.append(slider("plane", "plane", 0, 180, 1));
  const coordinates = new Coordinates();
  const warpsOf = (/** @type {number} */ axis) => () => coordinates.chart().axes[axis].warps.map((w) => /** @type {[string, string]} */ ([w.name, w.name]));
  coordinates.controls.append(
    choice("chart", "parametrization", () => data.charts.map((c) => [c.kind, c.kind])),
    choice("warp1", "first axis", warpsOf(0)),
    choice("warp2", "second", warpsOf(1)),
    slider("third", "third", 0, 1, 0.01),
  );
  appearance.controls.append(
    choice("lit", "light", () => (data.sky.some(Boolean) ? [["point", "point"], ["sky", "sky"]] : [["point", "point"]])),
    slider("exposure", "exposure", -6, 6, 0.25),
  );
  const moments = new Moments();
  moments.controls.append(slider("view", "view", 0, data.moments.find(Boolean)?.views.at(-1) ?? 89, 1));
  const all = [directions, slices, coordinates, ...(machine ? [machine] : []), appearance, moments];
  // Before any view is drawn.
  onChange((changed) => {
    if (changed.has("time")) clock.visits = machine && data.machine ? machine.done(machine.now()) : Infinity;
  });
  for (const view of all) view.open(views);
  onChange((changed) => {
    if (changed.has("look")) {
      applyLook();
      for (const view of all) view.show();
    }
    for (const view of all) view.root.hidden = isEmpty(view.options.id);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    forgetTheme();
    redraw();
  });
  addEventListener("hashchange", () => {
    readFragment(location.hash);
    redraw();
  });
  listenToFiles();
  // What tests and the curious ask for.
  const named = Object.fromEntries(all.map((v) => [v.options.id, v]));
  const taken = () => readings.filter(isTaken).length;
  Object.assign(globalThis, { gonio: { state, set, frames, data, materials, readings, schedule, taken, views: named } });
  redraw();
  const notes = data.materials.map((m) => m.note && `${m.name}: ${m.note}`);
  say([...notes, about.note && `${about.name}: ${about.note}`].filter(Boolean).join("; "));
  document.documentElement.dataset.open = "yes";
}

/** True if there is nothing for a view. @param {string} id */
function isEmpty(id) {
  if (id === "machine") return !data.machine;
  if (id === "directions" || id === "coordinates") return false;
  if (id === "slices") return !materials.length && !readings.length;
  return !materials.length;
}

function listenToFiles() {
  const take = async (/** @type {FileList | null | undefined} */ files) => {
    const words = [];
    for (const file of [...(files ?? [])].slice(0, 3)) words.push(await drop(file));
    say(words.join("; "));
    const names = materials.map((m) => m.facts.name).join(" and ");
    document.title = names || document.title;
    const heading = document.querySelector("h1");
    if (heading && names) heading.textContent = names;
  };
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    void take(event.dataTransfer?.files).catch((error) => say(String(error.message ?? error)));
  });
  const input = /** @type {HTMLInputElement} */ (element("input", { type: "file", multiple: "", accept: ".binary,.csv", "aria-label": "MERL tables or readings" }));
  input.addEventListener("change", () => void take(input.files));
  bar.append(element("label", {}, "open ", input));
}

/** @param {string} words */
function say(words) {
  said.textContent = words;
}

open().catch((error) => say(`This page cannot be shown: ${error.message ?? error}`));
