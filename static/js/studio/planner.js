// Plans of the present settings: at most one request under way besides the one it replaces, the newest wins, and
// long flocks show their beginning first.
// @ts-check
import { preview } from "../parts/living.js";
import { FIRST_CELLS, FIRST_FRAMES, PREVIEW_CELLS } from "./limits.js";
import { bodyOf, writeQuery } from "./settings.js";

/** Rest after a change before a request is sent, ms. */
const REST_MS = 30;
/** Time until a request is sent although changes go on, if none is under way, ms. */
const LONGEST_REST_MS = 120;
/** Plans that are kept for undo and for comparing. */
const KEPT = 4;
/** Time before a request is repeated when the service is busy, ms. */
const BUSY_MS = 700;

/** Individuals where `count` is not set and no plan has told their number. */
const USUAL_COUNT = 20;

/** @typedef {import("../flock/plan.js").Plan} Plan @typedef {import("./settings.js").Settings} Settings */

/**
 * @param {{libraryId: string, life: AbortSignal, onPlan: (plan: Plan, settings: Settings) => void, onBusy: (isBusy: boolean) => void,
 *   onProblem: (problem: unknown) => void}} options
 */
export function createPlanner({ libraryId, life, onPlan, onBusy, onProblem }) {
  /** @type {Map<string, Plan>} */
  const kept = new Map();
  /** @type {Settings | null} */
  let wanted = null;
  /** @type {AbortController | null} */
  let running = null;
  let [timer, since, filled, pinned, planning] = [0, 0, USUAL_COUNT, "", ""];
  /** The plan that is shown, as it came. @type {{plan: Plan, settings: Settings} | null} */
  let shown = null;
  /** The settings of the newest request. @type {Settings} */
  let newest = {};

  /** @param {Plan} plan @param {Settings} settings */
  function tell(plan, settings) {
    shown = { plan, settings };
    onPlan(dressed(plan, settings), settings);
  }

  /**
   * Asks for the plan of some settings; the former request is given up.
   * @param {Settings} settings @param {Settings} [before] settings whose plan is kept, for comparing
   */
  function ask(settings, before) {
    clearTimeout(timer);
    pinned = before ? keyOf(before) : "";
    const known = kept.get(keyOf(settings));
    if (known) return finish(known, settings);
    // What is only drawn in another way is drawn at once.
    if (shown && JSON.stringify(ofDrawing(shown.settings)) !== JSON.stringify(ofDrawing(settings))) tell(shown.plan, { ...ofPlan(shown.settings), ...ofDrawing(settings) });
    newest = settings;
    if (running && !wanted && planning === keyOf(settings)) return undefined;
    if (!wanted) since = performance.now();
    wanted = settings;
    onBusy(true);
    const waited = performance.now() - since;
    timer = setTimeout(start, !running && waited > LONGEST_REST_MS ? 0 : REST_MS);
    return undefined;
  }

  /** @param {Plan} plan @param {Settings} settings */
  function finish(plan, settings) {
    running?.abort();
    running = wanted = null;
    onBusy(false);
    tell(plan, settings);
  }

  async function start() {
    running?.abort();
    const settings = wanted ?? {};
    const mine = running = new AbortController();
    wanted = null;
    planning = keyOf(settings);
    const current = () => (keyOf(newest) === keyOf(settings) ? newest : settings);
    const signal = AbortSignal.any([mine.signal, life]);
    try {
      const plan = await planOf(settings, signal, (first) => { if (!mine.signal.aborted) tell(first, current()); });
      keep(settings, plan);
      if (mine.signal.aborted) return;
      running = null;
      onBusy(wanted !== null);
      tell(plan, current());
    } catch (problem) {
      if (life.aborted || mine.signal.aborted) return;
      running = null;
      if (/** @type {any} */ (problem).code === "busy" && !wanted) {
        wanted = settings;
        timer = setTimeout(start, BUSY_MS);
        return;
      }
      onBusy(wanted !== null);
      onProblem(problem);
    }
  }

  /** @param {Settings} settings @param {AbortSignal} signal @param {(plan: Plan) => void} onFirst */
  async function planOf(settings, signal, onFirst) {
    const body = bodyOf(ofPlan(settings));
    const n = body.count ?? filled;
    const frames = body.frames ?? 400;
    const most = Math.floor(PREVIEW_CELLS / n);
    if (n * frames > FIRST_CELLS && Math.min(frames, most) > FIRST_FRAMES) {
      const first = await preview(libraryId, { ...body, frames: FIRST_FRAMES, loop: false }, signal);
      // The time line has the whole length, so that the play head stays where it is.
      first.head.params.frames = Math.min(frames, most);
      onFirst(Object.assign(first, { isFirst: true }));
    }
    const plan = await preview(libraryId, frames > most ? { ...body, frames: most, loop: false } : body, signal);
    if (body.count == null) filled = plan.nIndividuals;
    return Object.assign(plan, { isPart: frames > most });
  }

  /** @param {Settings} settings @param {Plan} plan */
  function keep(settings, plan) {
    kept.delete(keyOf(settings));
    kept.set(keyOf(settings), plan);
    for (const key of kept.keys()) if (kept.size > KEPT && key !== pinned) kept.delete(key);
  }

  life.addEventListener("abort", () => clearTimeout(timer));
  return {
    ask,
    /** Returns the plan of some settings if it is kept. @param {Settings} settings */
    kept(settings) {
      const plan = kept.get(keyOf(settings));
      return plan && dressed(plan, settings);
    },
  };
}

/** Settings of the drawing, and those that decide the plan. @param {Settings} settings */
const ofDrawing = (settings) => Object.fromEntries(Object.entries(settings).filter(([name]) => name.startsWith("render.")));
/** @param {Settings} settings */
const ofPlan = (settings) => Object.fromEntries(Object.entries(settings).filter(([name]) => !name.startsWith("render.")));

/** @param {Settings} settings */
const keyOf = (settings) => writeQuery(ofPlan(settings));

/** Returns a plan that is drawn as the settings say. @param {Plan} plan @param {Settings} settings */
function dressed(plan, settings) {
  const { params } = plan.head;
  return { ...plan, head: { ...plan.head, params: { ...params, render: { ...params.render, ...bodyOf(settings).render } } } };
}
