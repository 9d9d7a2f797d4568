// The picture of the studio: the living flock with its layers, play mode, and the comparison with the flock before.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { chase } from "../parts/chase.js";
import { living, preview } from "../parts/living.js";
import { bodyOf } from "./settings.js";
import { pathOfPointer } from "./things.js";

/** @typedef {import("../flock/plan.js").Plan} Plan */

/**
 * @param {{libraryId: string, size: number[], life: AbortSignal, tool: import("../app/store.js").Signal<string>, startFrame: number | null,
 *   onFrame: (frame: number) => void, onState: (isPlaying: boolean) => void, onPath: (path: Api.Waypoint[]) => void, length_s: () => number}} options
 *   `startFrame`: the flock rests at this frame; onPath hears the path of the pointer in play mode
 */
export function stage({ libraryId, size, life, tool, startFrame, onFrame, onState, onPath, length_s }) {
  const picture = element("img.still", { src: `/v1/libraries/${libraryId}/background.png`, alt: "" });
  const frame = element("div.living", {}, picture);
  const bar = element("div.planning", { hidden: true });
  const badge = element("p.badge", { hidden: true }, say("studio.before"));
  const node = element("div.studio-stage", {}, frame, badge, bar);
  picture.style.aspectRatio = size.join(" / ");
  /** @type {import("../parts/living.js").Living | null} */
  let flock = null;
  /** @type {Plan | null} */
  let plan = null;
  let isLoading = false;
  /** @type {Element[]} */
  let layers = [];
  let comparing = "";

  /** Shows a plan; the first one brings the flock to life. @param {Plan} next */
  async function show(next) {
    plan = next;
    if (flock) return comparing ? undefined : flock.show(next);
    if (isLoading) return undefined;
    isLoading = true;
    flock = await living({ libraryId, plan: next, life, small: innerWidth < 700, onFrame, onState }).finally(() => { isLoading = false; });
    flock.canvas.tabIndex = -1;
    frame.replaceChildren(...flock.node.childNodes, ...layers);
    // Play mode and the player look at this node and canvas.
    chase({ ...flock, node: frame, get plan() { return plan ?? next; } }, libraryId, life, { isOn: () => tool.value === "chase", onEnd });
    onState(flock.player.isPlaying);
    if (startFrame !== null) { flock.player.pause(); flock.player.seek(startFrame); }
    if (plan !== next) flock.show(plan);
    return undefined;
  }

  /** @param {import("../parts/chase.js").Path} path */
  function onEnd(path) {
    if (!flock || !plan) return undefined;
    const kept = pathOfPointer(path, length_s(), size);
    const entry = kept.find(({ at_px }) => at_px.every((value, k) => value >= 0 && value <= size[k]));
    if (!entry) return flock.show(plan);
    onPath(kept);
    // The planned chase plays from its beginning.
    return flock.player.seek(Math.floor(entry.time_s * plan.fps));
  }

  return {
    node, show,
    get plan() { return plan; },
    get canvas() { return { focus: (/** @type {FocusOptions | undefined} */ options) => flock?.canvas.focus(options) }; },
    put(/** @type {Element[]} */ ...next) { layers = next; },
    setBusy(/** @type {boolean} */ isBusy) { bar.hidden = !isBusy; node.setAttribute("aria-busy", String(isBusy)); },
    seek(/** @type {number} */ to) { flock?.player.pause(); flock?.player.seek(to); },
    toggle() { if (flock?.player.isPlaying) flock.player.pause(); else flock?.player.play(); },
    /** Shows the flock of other settings while they are given. @param {import("./settings.js").Settings | null | undefined} settings @param {ReturnType<typeof import("./planner.js").createPlanner>} planner */
    async compare(settings, planner) {
      const key = comparing = settings ? JSON.stringify(settings) : "";
      badge.hidden = !settings;
      if (!flock || !plan) return undefined;
      if (!settings) return flock.show(plan);
      const former = planner.kept(settings) ?? await preview(libraryId, bodyOf(settings), life).catch(() => null);
      if (former && comparing === key) flock.show(former);
      return undefined;
    },
  };
}
