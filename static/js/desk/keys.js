// Keys of the desk.
// @ts-check
import { listenForKeys } from "../parts/keys.js";

/**
 * @param {AbortSignal} life
 * @param {{player: import("./player.js").Player, desk: import("./instrument.js").Instrument, axis: {zoomIn: () => void, zoomOut: () => void}, nextJump: () => void, focusFrame: () => void}} parts
 */
export function startKeys(life, { player, desk, axis, nextJump, focusFrame }) {
  const jump = (/** @type {number} */ frame) => () => { player.pause(); desk.goTo(frame); };
  listenForKeys(life, {
    " ": player.toggle,
    ArrowLeft: (event) => player.move(event.shiftKey ? -10 : -1),
    ArrowRight: (event) => player.move(event.shiftKey ? 10 : 1),
    Home: jump(desk.first),
    End: () => jump(desk.last())(),
    j: nextJump,
    m: () => desk.showsMirrored.set(!desk.showsMirrored.value),
    g: focusFrame,
    "+": axis.zoomIn,
    "=": axis.zoomIn,
    "-": axis.zoomOut,
  });
}
