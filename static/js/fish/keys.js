// Keys of the 3-D view. The time line has those that move film and fish.
// @ts-check
import { listenForKeys } from "../parts/keys.js";

/** Zoom of a key. */
const ZOOM = 1.25;

/** @param {AbortSignal} life @param {import("./orbit.js").Orbit} orbit */
export function startKeys(life, orbit) {
  listenForKeys(life, {
    "+": () => orbit.zoom(ZOOM),
    "=": () => orbit.zoom(ZOOM),
    "-": () => orbit.zoom(1 / ZOOM),
    0: () => orbit.reset(),
  });
}
