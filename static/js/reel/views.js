// Two ways to see a flock on one time line: its film with the ground truth over it, and the flock alive.
// @ts-check
import { element } from "../app/element.js";
import { isCalm } from "../app/motion.js";
import { say } from "../app/words.js";
import { chase } from "../parts/chase.js";
import { living } from "../parts/living.js";
import { film } from "./film.js";
import { shownFileOf } from "./settings.js";

/** Names of the views. */
export const VIEWS = ["film", "living"];

/**
 * @param {{flock: Api.Flock, plan: () => Promise<import("../flock/plan.js").Plan>, size: number[], poster: string | undefined, startFrame: number | null, life: AbortSignal,
 *   onFrame: (frame: number) => void, onState: (isPlaying: boolean) => void, onProblem: (problem: unknown) => void}} options
 *   `startFrame`: the flock rests at this frame; null plays
 */
export function createViews({ flock, plan, size, poster, startFrame, life, onFrame, onState, onProblem }) {
  const starts = startFrame === null && !isCalm();
  let [frame, name] = [startFrame ?? 0, ""];
  // Only the present view is heard. The living flock starts by itself, which does not count.
  const from = (/** @type {string} */ of) => ({
    onFrame(/** @type {number} */ next) { if (name === of && present()) { frame = next; onFrame(next); } },
    onState(/** @type {boolean} */ isPlaying) { if (name === of && present()) onState(isPlaying); },
  });
  const stage = element("div.stage", { id: "reel-stage" });
  stage.style.aspectRatio = size.join(" / ");
  stage.style.maxInlineSize = `calc(max(15rem, 100dvh - 21rem) * ${size[0] / size[1]})`;
  stage.dataset.look = "film";
  const shown = shownFileOf(flock);
  stage.classList.toggle("is-clear", shown !== "video.mp4");
  const shot = film({ src: `/v1/flocks/${flock.id}/${shown}`, poster, fps: flock.fps, n_frames: flock.frames, label: say("reel.film"), life, ...from("film"), onBroken: () => stage.append(element("p.stage-note", {}, say("reel.broken"))) });
  stage.append(shot.node);
  /** @type {Promise<import("../parts/living.js").Living> | null} */
  let loading = null;
  /** @type {import("./film.js").View | null} */
  let alive = null;

  /** The living flock; made when it is asked for. */
  function enliven() {
    loading ??= (async () => {
      const planned = await plan();
      const made = await living({ libraryId: flock.library_id, plan: planned, life, small: innerWidth < 700, ...from("living") });
      chase(made, flock.library_id, life);
      stage.append(made.node);
      made.player.pause();
      return made;
    })();
    loading.catch(() => { loading = null; });
    return loading;
  }
  /** @returns {import("./film.js").View | null} */
  const present = () => (name === "film" ? shot : name === "living" ? alive : null);

  /** Shows a view, at the frame of the former one. @param {string} next */
  async function choose(next) {
    const wasPlaying = name ? present()?.isPlaying ?? false : starts;
    present()?.pause();
    name = next;
    stage.dataset.view = next;
    stage.classList.toggle("is-living", next === "living");
    if (next === "living" && !alive) {
      try {
        const { node, player } = await enliven();
        alive = { node, get isPlaying() { return player.isPlaying; }, play: player.play, pause: player.pause, seek: player.seek };
      } catch (problem) {
        if (!life.aborted) onProblem(problem);
        return;
      }
    }
    // The person may have gone back meanwhile.
    if (name !== next || life.aborted) return;
    if (frame > 0 || next !== "film") present()?.seek(frame);
    onState(false);
    if (wasPlaying) present()?.play();
  }

  return {
    stage, choose, video: shot.video,
    seek(/** @type {number} */ to) { frame = to; present()?.pause(); present()?.seek(to); },
    toggle() { if (present()?.isPlaying) present()?.pause(); else present()?.play(); },
  };
}
