// What is looked at: one state for all views. It stands in the fragment of the URL.

/** @type {(a: number, b: number) => [number, number]} */
const pair = (a, b) => [a, b];

/** What a page opens with. */
const START = {
  light: pair(30, 0), // elevation and azimuth, degrees
  sensor: pair(30, 180), // elevation and azimuth, degrees
  channel: 0, // 0: luminance, n: the n-th channel
  show: "A", // A, B or difference
  scale: "logarithm", // of values: logarithm, linear, cube root
  cosine: 0, // 1: values are times cos θ_i
  plane: 0, // azimuth of a slice over that of the light, degrees
  near: 2, // how far a reading's light may be from the light, degrees
  chart: "half-difference", // the parametrization
  warp1: "none", // of its first axis
  warp2: "none", // of its second axis
  third: 0, // place on its third axis, in [0, 1]
  time: -1, // seconds of the tour; −1: its end
  lit: "point", // sky or point
  exposure: 0, // factors of two
  wipe: 0.5, // share of the sphere that A has, in [0, 1]
  turn: pair(30, 30), // of the lobe, degrees
  lamp: pair(44, 130), // elevation and azimuth of the point light of the sphere, seen by the camera, degrees
  scene: pair(35, 20), // yaw and pitch of the machine, degrees
  view: 45, // elevation of the view of moments, degrees
  moment: "", // the column of profiles
  look: "auto", // light or dark; auto: the system's
};

/** @typedef {typeof START} State */

/** Ranges of numbers. @type {Record<string, [number, number]>} */
const RANGES = {
  light: [-360, 360],
  sensor: [-360, 360],
  channel: [0, 3],
  cosine: [0, 1],
  plane: [0, 360],
  near: [0.5, 15],
  third: [0, 1],
  time: [-1, Infinity],
  exposure: [-6, 6],
  wipe: [0, 1],
  turn: [-1e4, 1e4],
  lamp: [-360, 360],
  scene: [-1e4, 1e4],
  view: [0, 89],
};

export const state = structuredClone(START);

/** @type {((changed: Set<string>) => void)[]} */
const listeners = [];
/** @type {Set<string>} */
let changed = new Set();
let isAsked = false;

/** Calls with the names of what has changed, once a frame. @param {(changed: Set<string>) => void} listener */
export const onChange = (listener) => void listeners.push(listener);

/** Changes the state; views are drawn in the next frame. @param {Partial<State>} patch */
export function set(patch) {
  for (const [key, value] of Object.entries(patch)) {
    if (String(/** @type {any} */ (state)[key]) !== String(value)) changed.add(key);
  }
  Object.assign(state, patch);
  if (changed.size) draw();
}

/** Draws everything in the next frame, as for a change of everything. */
export function redraw() {
  for (const key of Object.keys(state)) changed.add(key);
  draw();
}

function draw() {
  if (isAsked) return;
  isAsked = true;
  requestAnimationFrame(() => {
    isAsked = false;
    const names = changed;
    changed = new Set();
    const start = performance.now();
    for (const listener of listeners) listener(names);
    frames.push(performance.now() - start);
    if (frames.length > 400) frames.shift();
    writeFragment();
  });
}

/** Milliseconds that the last frames took. @type {number[]} */
export const frames = [];

let timer = 0;

function writeFragment() {
  clearTimeout(timer);
  timer = setTimeout(() => {
    try {
      history.replaceState(null, "", fragment());
    } catch {
      // A page inside a notebook has no address of its own.
    }
  }, 200);
}

/** The state as a fragment: what differs from the start. */
function fragment() {
  const words = Object.entries(state).map(([key, value]) => [key, String(value)]);
  return `#${new URLSearchParams(words.filter(([key, value]) => value !== String(/** @type {any} */ (START)[key])))}`;
}

/** Takes over what a fragment states; what it does not state, or cannot be, is as at the start. @param {string} text */
export function readFragment(text) {
  Object.assign(state, structuredClone(START));
  for (const [key, value] of new URLSearchParams(text.replace(/^#/, ""))) {
    if (!Object.hasOwn(START, key) || value === "") continue;
    const start = /** @type {any} */ (START)[key];
    const [low, high] = RANGES[key] ?? [0, 0];
    const numbers = value.split(",").map((part) => Math.min(high, Math.max(low, Number(part))));
    const are = (/** @type {number} */ n) => numbers.length === n && numbers.every(Number.isFinite);
    if (Array.isArray(start) && are(start.length)) Object.assign(state, { [key]: numbers });
    if (typeof start === "number" && are(1)) Object.assign(state, { [key]: numbers[0] });
    if (typeof start === "string" && value.length <= 40) Object.assign(state, { [key]: value });
  }
  for (const at of [state.light, state.sensor]) at[0] = Math.min(89, Math.max(0, at[0]));
}
