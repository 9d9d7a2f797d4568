// Canvases of the desk: sharp on every screen, drawn again at most once a frame, in the colors of the theme.
// @ts-check
import { element } from "../app/element.js";

/** Names of the tokens that canvases draw with. */
const TOKENS = ["ink", "ink-soft", "line", "line-strong", "accent", "water", "card", "sunken", "paper"];

/** Returns the colors of the theme at an element. @param {Element} node @returns {Record<string, string>} */
export function colorsAt(node) {
  const probe = element("span");
  node.append(probe);
  const colors = Object.fromEntries(TOKENS.map((name) => {
    probe.style.color = `var(--${name})`;
    return [name, getComputedStyle(probe).color];
  }));
  probe.remove();
  return colors;
}

/** @typedef {{context: CanvasRenderingContext2D, width: number, height: number, colors: Record<string, string>}} Paper sizes in CSS pixels */

/**
 * Returns a canvas that fills its parent's box and a function that asks for a drawing.
 * @param {AbortSignal} life @param {(paper: Paper) => void} draw @param {Page.Props<HTMLCanvasElement>} [props]
 */
export function drawnCanvas(life, draw, props = {}) {
  const canvas = element("canvas", { role: "img", ...props });
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  let isAsked = false;
  /** @type {Record<string, string> | null} */
  let colors = null;
  const paint = () => {
    isAsked = false;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height || life.aborted) return;
    const ratio = Math.min(3, devicePixelRatio || 1);
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    colors ??= colorsAt(canvas.parentElement ?? canvas);
    context.setTransform(w / width, 0, 0, h / height, 0, 0);
    context.clearRect(0, 0, width, height);
    context.save();
    draw({ context, width, height, colors });
    context.restore();
  };
  const ask = () => {
    if (isAsked) return;
    isAsked = true;
    requestAnimationFrame(paint);
  };
  const observer = new ResizeObserver(ask);
  observer.observe(canvas);
  addEventListener("theme", () => { colors = null; ask(); }, { signal: life });
  life.addEventListener("abort", () => observer.disconnect());
  return { canvas, ask };
}

/** Returns the picture at an address until `life` ends, or null if there is none. @param {string} address @param {AbortSignal} life */
export async function loadPicture(address, life) {
  try {
    const answer = await fetch(address, { signal: life });
    if (!answer.ok) return null;
    const picture = await createImageBitmap(await answer.blob());
    life.addEventListener("abort", () => picture.close());
    return picture;
  } catch {
    return null;
  }
}

/** Returns how a picture lies in a box: contained, centered. @param {number[]} size @param {number} width @param {number} height */
export function fitted([w, h], width, height) {
  const zoom = Math.min(width / w, height / h);
  return { zoom, left: (width - w * zoom) / 2, top: (height - h * zoom) / 2 };
}

/**
 * Returns a function that keeps a drawing: it is drawn again only when its key changes, and else copied.
 * @returns {(paper: Paper, key: string, draw: (context: CanvasRenderingContext2D) => void) => void}
 */
export function keptLayer() {
  const kept = document.createElement("canvas");
  let keptFor = "";
  return ({ context, width, height }, key, draw) => {
    const { canvas } = context;
    const whole = [key, canvas.width, canvas.height].join(" ");
    if (whole !== keptFor) {
      [kept.width, kept.height] = [canvas.width, canvas.height];
      const under = /** @type {CanvasRenderingContext2D} */ (kept.getContext("2d"));
      under.setTransform(context.getTransform());
      draw(under);
      keptFor = whole;
    }
    context.drawImage(kept, 0, 0, width, height);
  };
}
