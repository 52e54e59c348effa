// Drawings on a canvas or as SVG text by the same calls; lengths are CSS pixels.

/**
 * @typedef {object} Style
 * @property {string} [stroke] colour of the line; none: no line
 * @property {string} [fill] colour of the area; none: not filled
 * @property {number} [width] of the line, 1 by default
 * @property {number[]} [dash] lengths of dashes and gaps
 * @property {number} [alpha] opacity in [0, 1]
 */

/**
 * @typedef {object} Lettering
 * @property {string} [colour]
 * @property {"start" | "middle" | "end"} [align]
 * @property {number} [size] of the letters, 12 by default
 * @property {boolean} [upright] turned by a quarter, read from below
 */

/**
 * @typedef {object} Pen
 * @property {(points: ArrayLike<number>[], style: Style, closed?: boolean) => void} path through points (x, y); a point that is not finite is a gap
 * @property {(x: number, y: number, r: number, style: Style) => void} circle
 * @property {(x: number, y: number, words: string, lettering?: Lettering) => void} text on its baseline
 * @property {(box: Box, image: HTMLCanvasElement) => void} image stretched over a box, without interpolation
 * @property {(box: Box, draw: () => void) => void} within draws what lies in a box
 */

/** @typedef {[x: number, y: number, width: number, height: number]} Box */

const FONT = "system-ui, sans-serif";

/** Points between gaps. @param {ArrayLike<number>[]} points */
function pieces(points) {
  /** @type {ArrayLike<number>[][]} */
  const all = [[]];
  for (const p of points) {
    if (Number.isFinite(p[0]) && Number.isFinite(p[1])) all[all.length - 1].push(p);
    else all.push([]);
  }
  return all.filter((piece) => piece.length);
}

/** A pen on a canvas, which it covers with paper. @implements {Pen} */
export class CanvasPen {
  /** @param {HTMLCanvasElement} canvas @param {number} width @param {number} height @param {string} paper its colour */
  constructor(canvas, width, height, paper) {
    const ratio = Math.min(globalThis.devicePixelRatio || 1, 2);
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
    const to = canvas.getContext("2d");
    if (!to) throw new Error("this browser has no canvas");
    this.to = to;
    to.setTransform(ratio, 0, 0, ratio, 0, 0);
    to.fillStyle = paper;
    to.fillRect(0, 0, width, height);
  }

  /** @param {Style} style */
  finish(style) {
    const to = this.to;
    to.globalAlpha = style.alpha ?? 1;
    if (style.fill) {
      to.fillStyle = style.fill;
      to.fill();
    }
    if (style.stroke) {
      to.strokeStyle = style.stroke;
      to.lineWidth = style.width ?? 1;
      to.setLineDash(style.dash ?? []);
      to.stroke();
    }
    to.globalAlpha = 1;
  }

  /** @param {ArrayLike<number>[]} points @param {Style} style */
  path(points, style, closed = false) {
    this.to.beginPath();
    for (const piece of pieces(points)) {
      piece.forEach((p, i) => (i ? this.to.lineTo(p[0], p[1]) : this.to.moveTo(p[0], p[1])));
      if (closed) this.to.closePath();
    }
    this.finish(style);
  }

  /** @param {number} x @param {number} y @param {number} r @param {Style} style */
  circle(x, y, r, style) {
    this.to.beginPath();
    this.to.arc(x, y, r, 0, 2 * Math.PI);
    this.finish(style);
  }

  /** @param {number} x @param {number} y @param {string} words @param {Lettering} [lettering] */
  text(x, y, words, lettering = {}) {
    const to = this.to;
    to.save();
    to.translate(x, y);
    if (lettering.upright) to.rotate(-Math.PI / 2);
    to.font = `${lettering.size ?? 12}px ${FONT}`;
    to.textAlign = lettering.align === "middle" ? "center" : (lettering.align ?? "start");
    to.fillStyle = lettering.colour ?? "#000";
    to.fillText(words, 0, 0);
    to.restore();
  }

  /** @param {Box} box @param {HTMLCanvasElement} image */
  image(box, image) {
    this.to.imageSmoothingEnabled = false;
    this.to.drawImage(image, ...box);
  }

  /** @param {Box} box @param {() => void} draw */
  within(box, draw) {
    this.to.save();
    this.to.beginPath();
    this.to.rect(...box);
    this.to.clip();
    draw();
    this.to.restore();
  }
}

/** Text as it stands in XML. @param {string} text */
const escaped = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

/** @param {number} v */
const short = (v) => String(Math.round(v * 100) / 100);

/** A pen that writes SVG. @implements {Pen} */
export class SvgPen {
  /** @param {number} width @param {number} height @param {string} paper its colour */
  constructor(width, height, paper) {
    const size = `width="${short(width)}" height="${short(height)}"`;
    const view = `viewBox="0 0 ${short(width)} ${short(height)}"`;
    this.parts = [
      `<svg xmlns="http://www.w3.org/2000/svg" ${size} ${view} font-family="${FONT}">`,
      `<rect width="100%" height="100%" fill="${paper}"/>`,
    ];
    this.clips = 0;
  }

  /** @param {Style} style */
  style(style) {
    const dash = style.dash?.length ? ` stroke-dasharray="${style.dash.join(" ")}"` : "";
    const line = style.stroke ? ` stroke="${style.stroke}" stroke-width="${style.width ?? 1}"${dash}` : "";
    const alpha = style.alpha === undefined ? "" : ` opacity="${style.alpha}"`;
    return `fill="${style.fill ?? "none"}"${line}${alpha}`;
  }

  /** @param {ArrayLike<number>[]} points @param {Style} style */
  path(points, style, closed = false) {
    const piece = (/** @type {ArrayLike<number>[]} */ all) =>
      `M${all.map((p) => `${short(p[0])} ${short(p[1])}`).join("L")}${closed ? "Z" : ""}`;
    const line = pieces(points).map(piece).join("");
    if (line) this.parts.push(`<path d="${line}" ${this.style(style)}/>`);
  }

  /** @param {number} x @param {number} y @param {number} r @param {Style} style */
  circle(x, y, r, style) {
    this.parts.push(`<circle cx="${short(x)}" cy="${short(y)}" r="${short(r)}" ${this.style(style)}/>`);
  }

  /** @param {number} x @param {number} y @param {string} words @param {Lettering} [lettering] */
  text(x, y, words, lettering = {}) {
    const at = `x="${short(x)}" y="${short(y)}"`;
    const turn = lettering.upright ? ` transform="rotate(-90 ${short(x)} ${short(y)})"` : "";
    const look = `font-size="${lettering.size ?? 12}" fill="${lettering.colour ?? "#000"}"`;
    const anchor = `text-anchor="${lettering.align ?? "start"}"`;
    this.parts.push(`<text ${at} ${look} ${anchor}${turn}>${escaped(words)}</text>`);
  }

  /** @param {Box} box @param {HTMLCanvasElement} image */
  image(box, image) {
    const [x, y, width, height] = box.map(short);
    const place = `x="${x}" y="${y}" width="${width}" height="${height}"`;
    const look = 'preserveAspectRatio="none" style="image-rendering:pixelated"';
    this.parts.push(`<image ${place} ${look} href="${image.toDataURL("image/png")}"/>`);
  }

  /** @param {Box} box @param {() => void} draw */
  within(box, draw) {
    const [x, y, width, height] = box.map(short);
    const id = `within-${this.clips++}`;
    const rect = `<rect x="${x}" y="${y}" width="${width}" height="${height}"/>`;
    this.parts.push(`<clipPath id="${id}">${rect}</clipPath><g clip-path="url(#${id})">`);
    draw();
    this.parts.push("</g>");
  }

  toString() {
    return `${this.parts.join("\n")}\n</svg>\n`;
  }
}
