// A view: a canvas that answers the pointer and the keys, with what it shows in words, and files of it.

import { argument, shown } from "./look.js";
import { CanvasPen, SvgPen } from "./pen.js";
import { theme } from "./theme.js";
import { onChange } from "./state.js";

/** @typedef {import("./pen.js").Pen} Pen */

/**
 * @typedef {object} Options
 * @property {string} id
 * @property {string} title
 * @property {string} about what it shows and how it is moved, for the reader of a screen too
 * @property {(material?: string) => string} command one that makes the same, of what commands call the material that is shown
 * @property {number} [ratio] height over width of the drawing
 * @property {"none" | "pan-y"} [touch] what a finger that moves does besides dragging, nothing by default
 * @property {string[]} needs names of the state that it shows
 */

/** An element with attributes and children. @param {string} tag @param {Record<string, string>} [attributes] @param {(Node | string)[]} children */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** A button. @param {string} name @param {() => void} act */
export function button(name, act) {
  const made = element("button", { type: "button" }, name);
  made.addEventListener("click", act);
  return made;
}

/** Offers a file to be kept. @param {string} name @param {Blob} blob */
export function save(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A cell of CSV. @param {string | number} cell */
const cell = (cell) => (/[",\n]/.test(String(cell)) ? `"${String(cell).replaceAll('"', '""')}"` : String(cell));

/** Rows as CSV. @param {(string | number)[][]} rows */
export const csv = (rows) => rows.map((row) => `${row.map(cell).join(",")}\n`).join("");

/**
 * What has the place on paper that is nearest to (x, y), less than `most` away.
 * @template T @param {T[]} all @param {(one: T) => number[]} place @param {number} x @param {number} y @param {number} most
 */
export function nearest(all, place, x, y, most) {
  return all.reduce((/** @type {{one?: T, off: number}} */ best, one) => {
    const [px, py] = place(one);
    const off = Math.hypot(x - px, y - py);
    return off < best.off ? { one, off } : best;
  }, { off: most }).one;
}

/** Base of all views. */
export class View {
  /** @param {Options} options */
  constructor(options) {
    this.options = options;
    const { id, title, about } = options;
    const described = { "aria-label": title, "aria-describedby": `${id}-about` };
    this.canvas = /** @type {HTMLCanvasElement} */ (element("canvas", { tabindex: "0", role: "application", ...described }));
    this.canvas.style.touchAction = options.touch ?? "none";
    this.said = element("output", { id: `${id}-said`, "aria-live": "off" });
    this.controls = element("div", { class: "controls" });
    this.files = element("p", { class: "files" });
    this.root = element(
      "section",
      { id, "aria-labelledby": `${id}-title` },
      element("h2", { id: `${id}-title` }, title),
      element("p", { id: `${id}-about`, class: "about" }, about),
      this.controls,
      element("div", { class: "drawing" }, this.canvas),
      this.said,
      this.files,
    );
    this.size = [0, 0];
    /** A picture of values, and where it or a plot lies. */
    this.image = document.createElement("canvas");
    /** @type {import("./pen.js").Box} */
    this.box = [62, 26, 100, 100];
    /** While something is dragged pictures are coarse. */
    this.isMoving = false;
    this.timer = 0;
    this.isSeen = true;
    this.isStale = true;
  }

  /** Puts the view into the page. @param {HTMLElement} into */
  open(into) {
    into.append(this.root);
    for (const [name, make] of Object.entries(this.saves())) this.files.append(button(name, make), " ");
    this.command = element("code");
    this.files.append(this.command);
    this.listen();
    new IntersectionObserver((all) => {
      this.isSeen = all[all.length - 1].isIntersecting;
      if (this.isSeen && this.isStale) this.show();
    }).observe(this.canvas);
    new ResizeObserver(() => this.show()).observe(this.canvas.parentElement ?? this.canvas);
    onChange((changed) => {
      if (!this.options.needs.some((name) => changed.has(name))) return;
      this.isStale = true;
      if (this.isSeen) this.show();
    });
  }

  /** Draws the view on its canvas. */
  show() {
    const width = Math.max(240, Math.round(this.canvas.parentElement?.clientWidth ?? 0));
    const height = Math.round(width * (this.options.ratio ?? 1.14));
    this.canvas.style.height = `${height}px`;
    this.size = [width, height];
    this.draw(new CanvasPen(this.canvas, width, height, theme().paper), width, height);
    this.isStale = false;
    const said = this.words();
    if (this.said.textContent !== said) this.said.textContent = said;
    if (this.command && this.command.textContent !== this.commandLine()) this.command.textContent = this.commandLine();
  }

  /** Files of the view, by what they are. @returns {Record<string, () => void>} */
  saves() {
    const { id } = this.options;
    return {
      SVG: () => save(`${id}.svg`, new Blob([this.svg()], { type: "image/svg+xml" })),
      PNG: () => this.canvas.toBlob((blob) => blob && save(`${id}.png`, blob)),
      CSV: () => save(`${id}.csv`, new Blob([csv(this.rows())], { type: "text/csv" })),
    };
  }

  /** The drawing as SVG. */
  svg() {
    const [width, height] = this.size;
    const pen = new SvgPen(width, height, theme().paper);
    this.draw(pen, width, height);
    return pen.toString();
  }

  listen() {
    const canvas = this.canvas;
    const place = (/** @type {PointerEvent} */ event) => {
      const box = canvas.getBoundingClientRect();
      return /** @type {[number, number]} */ ([event.clientX - box.left, event.clientY - box.top]);
    };
    canvas.addEventListener("pointerdown", (event) => {
      this.grab(...place(event));
      canvas.setPointerCapture(event.pointerId);
      event.preventDefault();
      canvas.focus({ preventScroll: true });
    });
    canvas.addEventListener("pointermove", (event) => {
      this[canvas.hasPointerCapture(event.pointerId) ? "drag" : "hover"](...place(event));
    });
    canvas.addEventListener("pointerleave", () => this.hover(NaN, NaN));
    // Of several regions only that of the view in hand is read out.
    canvas.addEventListener("focus", () => this.said.setAttribute("aria-live", "polite"));
    canvas.addEventListener("blur", () => this.said.setAttribute("aria-live", "off"));
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "n" || event.key === "p") this.next(event.key === "n" ? 1 : -1);
      const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
      const step = /** @type {Record<string, number[]>} */ (steps)[event.key];
      if (!step || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      this.step(step[0], step[1], event.shiftKey);
    });
  }

  /** Draws into a box at the origin. @param {Pen} pen @param {number} width @param {number} height */
  draw(pen, width, height) {}

  /** What is shown, in words. @returns {string} */
  words() {
    return "";
  }

  /** A command that makes the same. */
  commandLine() {
    return this.options.command(argument(shown()));
  }

  /** What is shown, in numbers: the first row is of names. @returns {(string | number)[][]} */
  rows() {
    return [];
  }

  /** Moves the box. @param {import("./pen.js").Box} box */
  lay(...box) {
    return (this.box = box);
  }

  /** A place is pressed. @param {number} x @param {number} y */
  grab(x, y) {
    this.drag(x, y);
  }

  /** Coarse pictures until nothing has moved for a while. */
  move() {
    this.isMoving = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.isMoving = false;
      this.show();
    }, 160);
  }

  /** @param {number} x @param {number} y */
  drag(x, y) {}

  /** The pointer is over a place; not a number: it has left. @param {number} x @param {number} y */
  hover(x, y) {}

  /** The key N, or P: to the next thing of its kind, or the one before. @param {number} way */
  next(way) {}

  /** An arrow key, with the shift key held or not. @param {number} right @param {number} up @param {boolean} shift */
  step(right, up, shift) {}
}
