// Keys of film and fish: those of the desk, and + - 0 for the 3-D view.
// @ts-check
import { listenForKeys } from "../parts/keys.js";

const FAR = 10;
const ZOOM = 1.25;

/**
 * @param {AbortSignal} life
 * @param {{move: (frames: number) => void, go: (frame: number) => void, last: number, toggle: () => void, orbit?: import("./orbit.js").Orbit}} acts
 */
export function startKeys(life, { move, go, last, toggle, orbit }) {
  listenForKeys(life, {
    " ": toggle,
    ArrowLeft: ({ shiftKey }) => move(shiftKey ? -FAR : -1),
    ArrowRight: ({ shiftKey }) => move(shiftKey ? FAR : 1),
    Home: () => go(0),
    End: () => go(last),
    "+": () => orbit?.zoom(ZOOM),
    "=": () => orbit?.zoom(ZOOM),
    "-": () => orbit?.zoom(1 / ZOOM),
    0: () => orbit?.reset(),
  });
}
