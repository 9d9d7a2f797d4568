// Film and virtual fish side by side with one play head.
// @ts-check
import { element } from "../app/element.js";
import { isCalm } from "../app/motion.js";
import { watchViews } from "../app/names.js";
import { say } from "../app/words.js";
import { timeline } from "../parts/timeline.js";
import { film } from "../reel/film.js";
import { createFlat } from "./flat.js";
import { startKeys } from "./keys.js";
import { filmLens } from "./lens.js";
import { createWireframe } from "./wireframe.js";
import { postureAt, boundsOf } from "./posture.js";
import { createSpace, directionText } from "./space.js";

/**
 * @param {{library: Api.Library, id: string, fish: import("./glb.js").VirtualFish | null, startFrame: number | null, life: AbortSignal,
 *   onRest: (frame: number | null) => void}} options id: of the virtual fish; fish: null if its model cannot be drawn;
 *   startFrame: null plays at once; onRest hears the frame at which it rests, null while it plays
 */
export function createPair({ library, id, fish, startFrame, life, onRest }) {
  const { fps, image_size_px: size } = library;
  const n = library.n_frames;
  const base = `/v1/libraries/${library.id}`;
  const lens = fish && filmLens(library.params?.camera, fish.yfov, size, reachOf(fish));
  const space = fish && createSpace({ fish, lens, size, fps, isFromAbove: library.view === "top", life });
  const wireframe = space && lens && fish ? createWireframe({ fish, lens, size, life }) : null;
  const flat = space ? null : createFlat({ id, fps, size, life });
  const reading = element("p.reading");
  let [frame, ticking, isBroken] = [0, 0, false];

  const show = (/** @type {number} */ next) => {
    frame = Math.min(n - 1, Math.max(0, next));
    time.setFrame(frame);
    for (const part of [space, wireframe, flat]) part?.setFrame(frame);
    reading.textContent = fish ? directionText(postureAt(fish, frame), library.view === "top") : "";
    left.dataset.frame = String(frame);
  };
  const tell = (/** @type {boolean} */ isPlaying) => { time.setPlaying(isPlaying); flat?.setPlaying(isPlaying); onRest(isPlaying ? null : frame); };
  const player = film({ src: undefined, poster: undefined, fps, n_frames: n, label: say("desk.film"), life, onFrame: show, onState: tell, onBroken: () => onBroken() });

  // While there is no film, or where the browser cannot play it, a clock moves both sides, and the background stands for the film.
  const still = element("img", { src: `${base}/background.png`, alt: "" });
  function onBroken(sentence = say("fish.no_film")) {
    isBroken = true;
    player.node.replaceWith(still);
    note.textContent = sentence;
    note.hidden = false;
  }
  function onFilm() {
    const goesOn = isPlaying();
    pause();
    isBroken = false;
    still.replaceWith(player.node);
    note.hidden = true;
    player.video.src = `${base}/film.mp4`;
    player.seek(frame);
    if (goesOn) player.play();
  }
  const tick = () => { show(frame + 1 < n ? frame + 1 : 0); };
  const setTicking = (/** @type {boolean} */ on) => { clearInterval(ticking); ticking = on ? setInterval(tick, 1000 / fps) : 0; tell(on); };
  life.addEventListener("abort", () => clearInterval(ticking));
  const isPlaying = () => (isBroken ? ticking > 0 : player.isPlaying);
  const pause = () => {
    if (!isPlaying()) return;
    if (isBroken) return setTicking(false);
    player.pause();
    // The film may have gone on by a frame.
    return player.seek(frame);
  };
  const play = () => { if (isBroken) setTicking(true); else player.play(); };
  const toggle = () => (isPlaying() ? pause() : play());
  const seek = (/** @type {number} */ to) => { pause(); show(to); player.seek(frame); onRest(frame); };

  const time = timeline({ life, seek, toggle });
  const note = element("p.stage-note", { hidden: true });
  const left = element("div.stage.film-stage", { "data-look": "film", onclick: toggle }, player.node, wireframe?.canvas, note);
  left.style.aspectRatio = size.join(" / ");
  const shows = element("input", { type: "checkbox", checked: true, onchange: () => { if (wireframe) wireframe.canvas.hidden = !shows.checked; } });
  if (space) startKeys(life, space.orbit);
  const node = element("div.fish-pair", {},
    element("section.fish-side", { "aria-label": say("fish.left") }, element("h2", {}, say("fish.left")), left, wireframe ? element("div.stage-controls", {}, element("label.choice", {}, shows, element("span", {}, say("fish.wireframe")))) : null),
    element("section.fish-side", { "aria-label": say("fish.right") }, element("h2", {}, say("fish.right")), (space ?? flat)?.node, (space ?? flat)?.controls),
    element("div.fish-time", {}, time.node, reading, element("p.soft.keys", {}, say(space ? "fish.keys" : "fish.keys.flat"))));

  time.setSpan(n, fps);
  show(startFrame ?? 0);
  watchViews(library, life, (state) => { if (state === "done") onFilm(); else onBroken(say(`views.${state}`)); });
  if (startFrame !== null) player.seek(frame);
  if (startFrame === null && !isCalm()) play();
  return node;
}

/** Returns the farthest depth of the fish, metres. @param {import("./glb.js").VirtualFish} fish */
const reachOf = (fish) => Math.max(1e-3, -boundsOf(fish).low[2]);
