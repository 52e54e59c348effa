// What is looked at: one state for all views. It stands in the fragment of the URL.

/**
 * @typedef {object} State
 * @property {[number, number]} light elevation and azimuth, degrees
 * @property {[number, number]} sensor elevation and azimuth, degrees
 * @property {number} channel 0: luminance, n: the n-th channel
 * @property {string} show A, B or difference
 * @property {string} scale of values: logarithm, linear, cube root
 * @property {number} cosine 1: values are times cos θ_i
 * @property {number} plane azimuth of a slice over that of the light, degrees
 * @property {number} near how far a reading's light may be from the light, degrees
 * @property {string} chart the parametrization
 * @property {string} warp1 of its first axis
 * @property {string} warp2 of its second axis
 * @property {number} third place on its third axis, in [0, 1]
 * @property {number} time seconds of the tour; −1: its end
 * @property {string} lit sky or point
 * @property {number} exposure factors of two
 * @property {number} wipe share of the sphere that A has, in [0, 1]
 * @property {[number, number]} turn of the lobe, degrees
 * @property {[number, number]} lamp elevation and azimuth of the point light of the sphere, seen by the camera, degrees
 * @property {[number, number]} scene yaw and pitch of the machine, degrees
 * @property {number} view elevation of the view of moments, degrees
 * @property {string} moment the column of profiles
 * @property {string} look light or dark; auto: the system's
 */

/** @type {State} */
const START = {
  light: [30, 0],
  sensor: [30, 180],
  channel: 0,
  show: "A",
  scale: "logarithm",
  cosine: 0,
  plane: 0,
  near: 2,
  chart: "half-difference",
  warp1: "none",
  warp2: "none",
  third: 0,
  time: -1,
  lit: "point",
  exposure: 0,
  wipe: 0.5,
  turn: [30, 30],
  lamp: [44, 130],
  scene: [35, 20],
  view: 45,
  moment: "",
  look: "auto",
};

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

/** @type {State} */
export const state = structuredClone(START);

/** @type {((changed: Set<string>) => void)[]} */
const listeners = [];
/** @type {Set<string>} */
let changed = new Set();
let isAsked = false;

/** Calls with the names of what has changed, once a frame. @param {(changed: Set<string>) => void} listener */
export function onChange(listener) {
  listeners.push(listener);
}

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
  const words = Object.entries(state)
    .filter(([key, value]) => String(value) !== String(/** @type {any} */ (START)[key]))
    .map(([key, value]) => `${key}=${encodeURIComponent(String(value))}`);
  return `#${words.join("&")}`;
}

/** Takes over what a fragment states; what it does not state, or cannot be, is as at the start. @param {string} text */
export function readFragment(text) {
  Object.assign(state, structuredClone(START));
  for (const word of text.replace(/^#/, "").split("&")) {
    const [key, value] = word.split("=").map((part) => {
      try {
        return decodeURIComponent(part);
      } catch {
        return "";
      }
    });
    if (!Object.hasOwn(START, key) || value === undefined) continue;
    const start = /** @type {any} */ (START)[key];
    const [low, high] = RANGES[key] ?? [0, 0];
    const numbers = value.split(",").map((part) => Math.min(high, Math.max(low, Number(part))));
    const are = numbers.every(Number.isFinite) && value !== "";
    if (Array.isArray(start)) {
      if (are && numbers.length === start.length) Object.assign(state, { [key]: numbers });
    } else if (typeof start === "number") {
      if (are && numbers.length === 1) Object.assign(state, { [key]: numbers[0] });
    } else if (value.length <= 40) {
      Object.assign(state, { [key]: value });
    }
  }
  state.light[0] = Math.min(89, Math.max(0, state.light[0]));
  state.sensor[0] = Math.min(89, Math.max(0, state.sensor[0]));
}
