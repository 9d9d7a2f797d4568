// The stage of Home and of a film: the film of the one animal, and its flock alive beside it.
// @ts-check
import { element, releaseVideo } from "../app/element.js";
import { isCalm } from "../app/motion.js";
import { filmName, watchViews } from "../app/names.js";
import { say, seconds } from "../app/words.js";
import { living, loadPictures } from "./living.js";

/** Width of the page below which the small sheet of the atlas is sharp enough, pixels. */
const SMALL_PX = 700;

/** Fills the stage around the picture with its blurred colors. @param {HTMLElement} stage @param {string} src */
export function setBack(stage, src) {
  const back = element("img.hero-back", { src, alt: "" });
  back.addEventListener("error", () => back.remove());
  stage.prepend(back);
}

/**
 * Shows a flock and its film on the stage until `life` ends.
 * @param {HTMLElement} stage
 * @param {{library: Api.Library, planning: Promise<import("../flock/plan.js").Plan>, life: AbortSignal, links: Node[]}} options
 */
export async function showFlock(stage, { library, planning, life, links }) {
  const base = `/v1/libraries/${library.id}`;
  const small = innerWidth < SMALL_PX;
  const pictures = loadPictures(library.id, { life, small });
  const pause = element("button.hero-pause", { type: "button" });
  const tell = (/** @type {boolean} */ isPlaying) => {
    pause.replaceChildren(isPlaying ? "❚❚" : "▶");
    pause.setAttribute("aria-label", say(isPlaying ? "timeline.pause" : "timeline.play"));
  };
  tell(!isCalm());
  const plan = await planning;
  const flock = await living({ libraryId: library.id, plan, life, small, pictures, onState: tell });
  if (life.aborted) return;
  stage.style.setProperty("--ratio", String(plan.sizePx[0] / plan.sizePx[1]));
  const film = element("video", { poster: `${base}/poster.jpg`, muted: true, loop: true, playsInline: true, "aria-label": say("home.film") });
  const words = element("span", { role: "status" });
  const figcaption = element("figcaption", {}, words);
  const one = element("figure.hero-one", {}, film, figcaption);
  watchViews(library, life, (state) => {
    words.textContent = state === "done" ? say("hero.one", { time: seconds(Math.round(library.n_frames / library.fps)) }) : say(`views.${state}`);
    if (state !== "done") return void (figcaption.dataset.views = state);
    delete figcaption.dataset.views;
    film.autoplay = flock.player.isPlaying && !isCalm();
    film.src = `${base}/film.mp4`;
  });
  film.addEventListener("error", () => one.remove());
  life.addEventListener("abort", () => releaseVideo(film));
  pause.addEventListener("click", () => {
    if (flock.player.isPlaying) { flock.player.pause(); film.pause(); } else { flock.player.play(); film.play().catch(() => {}); }
  });
  const caption = element("div.hero-caption", {},
    element("p.hero-times", { "aria-hidden": "true" }, say("hero.times", { n: plan.nIndividuals })),
    element("p", {}, say("hero.caption", { n: plan.nIndividuals, film: filmName(library) })),
    element("p.hero-hint", {}, say("hero.chase")),
    element("p.actions", {}, ...links));
  for (const video of stage.querySelectorAll("video")) releaseVideo(video);
  stage.replaceChildren(one, flock.node, caption);
  flock.node.append(pause);
  setBack(stage, `${base}/poster.jpg`);
  stage.classList.add("alive");
  const { chase } = await import("./chase.js");
  if (!life.aborted) chase(flock, library.id, life);
}
