// Colours of the page, which its style sheet states for light and dark.

/** @typedef {{ink: string, faint: string, paper: string, a: string, b: string, accent: string, warn: string}} Theme */

/** @type {Theme | undefined} */
let known;

/** The colours of today's theme. @returns {Theme} */
export function theme() {
  if (!known) {
    const style = getComputedStyle(document.documentElement);
    const of = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
    known = { ink: of("ink"), faint: of("faint"), paper: of("paper"), a: of("a"), b: of("b"), accent: of("accent"), warn: of("warn") };
  }
  return known;
}

/** The line of a material: of A whole, of B dashed. @param {number} place */
export const lineOf = (place) => ({ stroke: [theme().a, theme().b][place], width: 2, dash: place ? [6, 4] : [] });

/** Reads the colours again. */
export function forgetTheme() {
  known = undefined;
}

/** A map of colours of [0, 1]: red, green and blue of equal steps. */
export class Colours {
  /** @param {string} hex six digits a colour, without signs between */
  constructor(hex) {
    const n = hex.length / 6;
    this.last = n - 1;
    this.words = new Uint32Array(n);
    for (let i = 0; i < n; i++) {
      const rgb = parseInt(hex.slice(6 * i, 6 * i + 6), 16);
      // As a pixel lies in memory: red first.
      this.words[i] = (0xff000000 | ((rgb & 255) << 16) | (rgb & 0xff00) | (rgb >> 16)) >>> 0;
    }
  }

  /** The pixel of a place; of none (NaN) it is transparent. @param {number} t */
  word(t) {
    if (t !== t) return 0;
    return this.words[Math.round(Math.min(1, Math.max(0, t)) * this.last)];
  }

  /** @param {number} t */
  css(t) {
    const w = this.word(t);
    return `rgb(${w & 255},${(w >> 8) & 255},${(w >> 16) & 255})`;
  }
}
