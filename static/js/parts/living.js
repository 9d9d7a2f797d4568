// A living flock: the canvas on which a planned flock swims, made of the atlas and the plan of a library.
// @ts-check
import { get, request } from "../app/api.js";
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { planSource } from "../flock/appearance.js";
import { loadAtlas } from "../flock/atlas.js";
import { createDrawer, sceneOf } from "../flock/drawer.js";
import { decodePlan } from "../flock/plan.js";
import { attach, createPlayer } from "../flock/play.js";

/** Media type of a binary plan. */
const PLAN = "application/vnd.flockreel.plan";
/** Time between two updates of the sentence for screen readers, ms. */
const DESCRIBE_MS = 5000;

/** Asks the service for a plan. @param {string} libraryId @param {Api.FlockChanges} params @param {AbortSignal} [signal] */
export async function preview(libraryId, params, signal) {
  /** @type {Api.Body<"post", "/v1/flocks/preview">} */
  const body = { library_id: libraryId, ...params };
  const response = await request("POST", "/v1/flocks/preview", { body, accept: PLAN, signal });
  return decodePlan(await response.arrayBuffer());
}

/** Returns the plan of a flock that was made. @param {string} flockId @param {AbortSignal} [signal] */
export async function planOf(flockId, signal) {
  return decodePlan(await (await request("GET", `/v1/flocks/${flockId}/flock.plan`, { signal })).arrayBuffer());
}

/**
 * @typedef {import("../flock/plan.js").Plan} Plan
 * @typedef {import("../flock/atlas.js").Atlas} Atlas
 * @typedef {import("../flock/appearance.js").Source} Source
 * @typedef {{node: HTMLElement, canvas: HTMLCanvasElement, player: ReturnType<typeof createPlayer>, atlas: Atlas, readonly plan: Plan,
 *   show: (plan: Plan) => void, showSource: (source: Source) => void}} Living `show` swaps to another plan
 */

/**
 * Shows a flock in a canvas until `life` ends.
 * @param {{libraryId: string, plan: Plan, life: AbortSignal, small?: boolean, pictures?: Promise<[Atlas, ImageBitmap]>, onFrame?: (frame: number) => void, onState?: (isPlaying: boolean) => void}} options
 *   `small` loads the small sheet of the atlas, for little canvases and phones; `pictures` are under way already
 * @returns {Promise<Living>}
 */
export async function living({ libraryId, plan, life, small = false, pictures = loadPictures(libraryId, { life, small }), onFrame, onState }) {
  const canvas = element("canvas", { role: "img" });
  canvas.style.aspectRatio = plan.sizePx.join(" / ");
  const [atlas, picture] = await pictures;
  /** @type {ReturnType<typeof createPlayer> | null} */
  let player = null;
  const drawer = await createDrawer(canvas, sceneOf(plan, atlas, picture), { onResize: () => player?.redraw() });
  if (life.aborted) {
    drawer.dispose();
    throw life.reason;
  }
  player = createPlayer(drawer, planSource(plan, atlas), { onFrame, onState });
  const detach = attach(canvas, player);
  const tell = () => sentence(plan, player.frame).then((text) => canvas.setAttribute("aria-label", text), () => {});
  tell();
  const telling = setInterval(tell, DESCRIBE_MS);
  life.addEventListener("abort", () => { clearInterval(telling); detach(); drawer.dispose(); });
  const showSource = (/** @type {Source} */ source) => player.swap(source);
  return {
    node: element("div.living", {}, canvas), canvas, player, atlas, showSource,
    get plan() { return plan; },
    show(next) {
      plan = next;
      drawer.setScene(sceneOf(plan, atlas, picture));
      showSource(planSource(plan, atlas));
      tell();
    },
  };
}

/**
 * Loads what a living flock is drawn with until `life` ends: the atlas and the background.
 * @param {string} libraryId @param {{life: AbortSignal, small?: boolean}} options @returns {Promise<[Atlas, ImageBitmap]>}
 */
export function loadPictures(libraryId, { life, small = false }) {
  const base = `/v1/libraries/${libraryId}/`;
  const pictures = Promise.all([loadAtlas(base, { small, signal: life }), loadPicture(`${base}background.png`, life)]);
  pictures.catch(() => {});
  life.addEventListener("abort", () => pictures.then(([atlas, background]) => { atlas.close(); background.close(); }, () => {}));
  return pictures;
}

/** @param {string} address @param {AbortSignal} signal */
async function loadPicture(address, signal) {
  return createImageBitmap(await (await request("GET", address, { signal })).blob());
}

/** Returns what a frame shows as a sentence. @param {Plan} plan @param {number} frame */
async function sentence(plan, frame) {
  const { factsOf } = await import("../flock/describe.js");
  const { n, heading, isResting, nGroups } = factsOf(plan, frame);
  const motion = isResting ? say("living.rest") : heading === null ? say("living.all_ways") : say("living.heading", { direction: say(`direction.${heading}`) });
  return [say("living.n", { n }), motion, say("living.groups", { n: nGroups })].join(", ");
}

/** Returns the data that play mode needs. @param {string} libraryId @param {AbortSignal} life */
export async function filmOf(libraryId, life) {
  const [library, poses] = await Promise.all([get(`/v1/libraries/${libraryId}/library.json`, life), get(`/v1/libraries/${libraryId}/poses.json`, life)]);
  return { library, poses };
}
