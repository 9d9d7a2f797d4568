// Play mode: individuals flee the pointer or a finger at once, simulated in the page. When the person lets
// go, the planned flock returns.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { planSource } from "../flock/appearance.js";
import { pointOf } from "../flock/drawer.js";
import { startFlee } from "../flock/flee.js";
import { filmOf } from "./living.js";

/** Time after the last motion of the pointer at which play mode ends, ms. Free choice. */
const REST_MS = 4000;

/** @typedef {{time_s: number, at_px: number[]}[]} Path of the pointer, in the time and pixels of the flock */

/**
 * Lets the pointer chase a living flock.
 * @param {import("./living.js").Living} flock @param {string} libraryId @param {AbortSignal} life
 * @param {{isOn?: () => boolean, onEnd?: (path: Path) => void}} [options] onEnd receives the path of the pointer
 */
export function chase(flock, libraryId, life, { isOn = () => true, onEnd } = {}) {
  const note = element("p.playing", { hidden: true, role: "status" }, say("playing"));
  flock.node.append(note);
  /** @type {ReturnType<typeof filmOf> | null} */
  let film = null;
  /** @type {ReturnType<typeof startFlee> | null} */
  let flee = null;
  /** @type {Path} */
  let path = [];
  let [resting, startFrame, startMs] = [0, 0, 0];
  let wanted = false;

  const begin = async () => {
    film ??= filmOf(libraryId, life);
    const { library, poses } = await film;
    if (!wanted || flee || life.aborted) return;
    [startFrame, startMs] = [flock.player.frame, performance.now()];
    flee = startFlee(flock.plan, startFrame, { atlas: flock.atlas, library, poses });
    flock.showSource(flee.source);
    flock.player.play();
    note.hidden = false;
  };
  const end = () => {
    clearTimeout(resting);
    wanted = false;
    if (!flee) return;
    flee.stop();
    flee = null;
    note.hidden = true;
    if (onEnd) onEnd(path);
    else flock.showSource(planSource(flock.plan, flock.atlas));
    path = [];
  };
  const move = (/** @type {PointerEvent} */ event) => {
    if (!isOn() || (event.pointerType === "touch" && event.type !== "pointerdown" && !flee)) return;
    clearTimeout(resting);
    resting = setTimeout(end, REST_MS);
    wanted = true;
    const at_px = pointOf(flock.canvas, flock.plan.sizePx, event);
    if (!flee) return void begin().catch(() => { film = null; });
    // The play head rests in play mode.
    path.push({ time_s: startFrame / flock.plan.fps + (performance.now() - startMs) / 1000, at_px });
    flee.point(at_px);
    return undefined;
  };
  for (const name of /** @type {const} */ (["pointermove", "pointerdown"])) flock.canvas.addEventListener(name, move, { signal: life });
  for (const name of ["pointerleave", "pointercancel"]) flock.canvas.addEventListener(name, end, { signal: life });
  life.addEventListener("abort", () => { clearTimeout(resting); flee?.stop(); });
}
