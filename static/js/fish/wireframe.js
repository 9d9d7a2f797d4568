// The wireframe: the surface of the virtual fish as lines over the film, where the film's camera would see it.
// @ts-check
import { say } from "../app/words.js";
import { boxOf, glCanvas } from "./gl-canvas.js";
import { lengthOf } from "./glb.js";
import { postureAt } from "./posture.js";

/** Rings along the fish, and the least distance between two of them, CSS pixels. */
const RINGS = 24;
const LEAST_PX = 9;
/** The filming camera is the origin. */
const UNTURNED = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/**
 * @param {{fish: import("./glb.js").VirtualFish, lens: import("./lens.js").Lens, size: number[], life: AbortSignal}} options size of the film, pixels
 * @returns {{canvas: HTMLCanvasElement, setFrame: (frame: number) => void} | null} null without WebGL 2
 */
export function createWireframe({ fish, lens, size, life }) {
  let frame = 0;
  const length = lengthOf(fish);
  const made = glCanvas({ fish, life, props: { className: "wireframe", "aria-label": say("fish.wireframe.label") }, sceneAt(width, height) {
    const posture = postureAt(fish, frame);
    const box = boxOf(size, width, height);
    const depth = lens.depths[0] + (-posture.place[2] - lens.depths[0]) / lens.depths[1];
    const px_per_m = (lens.across[0] * box[2]) / 2 / depth;
    const ring = Math.max(length / RINGS, (LEAST_PX * Math.min(2, devicePixelRatio || 1)) / px_per_m);
    return { posture, lens, box, view: UNTURNED, eye: [0, 0, 0], isWireframe: true, slice: ring > (1.5 * length) / RINGS ? Math.PI / 3 : Math.PI / 8, ring };
  } });
  return made && { canvas: made.canvas, setFrame(next) { frame = next; made.ask(); } };
}
