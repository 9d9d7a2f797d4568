// A canvas for WebGL that is sharp on every screen and drawn again at most once a frame.
// @ts-check
import { element } from "../app/element.js";
import { fishDrawer } from "./gl.js";

/**
 * @param {{fish: import("./glb.js").VirtualFish, life: AbortSignal, props: Page.Props<HTMLCanvasElement>,
 *   sceneAt: (width: number, height: number) => import("./gl.js").Scene}} options sizes in pixels of the canvas
 * @returns {{canvas: HTMLCanvasElement, ask: () => void} | null} null without WebGL 2
 */
export function glCanvas({ fish, life, props, sceneAt }) {
  const canvas = element("canvas", { role: "img", ...props });
  const drawer = fishDrawer(canvas, fish);
  if (!drawer) return null;
  let asked = 0;
  const paint = () => {
    asked = 0;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    const ratio = Math.min(2, devicePixelRatio || 1);
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    drawer.draw(sceneAt(w, h));
  };
  const ask = () => { asked ||= requestAnimationFrame(paint); };
  const observer = new ResizeObserver(ask);
  observer.observe(canvas);
  life.addEventListener("abort", () => {
    observer.disconnect();
    cancelAnimationFrame(asked);
    drawer.dispose();
  });
  return { canvas, ask };
}

/** Returns where a picture lies on a canvas, whole and in the middle: left, bottom, width, height. @param {number[]} size @param {number} width @param {number} height */
export function boxOf([w, h], width, height) {
  const zoom = Math.min(width / w, height / h);
  return [Math.round((width - w * zoom) / 2), Math.round((height - h * zoom) / 2), Math.round(w * zoom), Math.round(h * zoom)];
}
