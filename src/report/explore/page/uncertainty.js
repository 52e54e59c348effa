// Standard uncertainty of B, where the program has one: a table of its ratio to the value.

import { data } from "./data.js";
import { direction } from "./geometry.js";
import { state } from "./state.js";
import { Table } from "./table.js";

/** @type {Table | undefined} */
let table;

/** Takes over the unpacked table. @param {Table} made */
export function useUncertainty(made) {
  table = made;
}

/** Curves of B − 2u and B + 2u of luminance; none where the program has none. @param {[number, number][][]} curves by elevation @param {(at: number) => import("./geometry.js").Vector} sensorAt an elevation @returns {[number, number, number][] | undefined} */
export function band(curves, sensorAt) {
  if (!table || !data.uncertainty || state.channel > 0 || curves.length === 0) return undefined;
  const known = table;
  const light = direction(...state.light);
  return curves[curves.length - 1].map(([at, v]) => {
    const u = v * known.value(0, ...light, ...sensorAt(at));
    return [at, v - 2 * u, v + 2 * u];
  });
}
