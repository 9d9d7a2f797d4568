// The stage: the video of one flock, played in a loop, with its downloads.
// @ts-check
import { byId, element } from "./element.js";
import { count } from "./words.js";

const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** @param {any} flock @param {string} filmName */
export function showFlock(flock, filmName) {
  const video = byId("stage-video");
  const source = `/v1/flocks/${flock.id}/video.mp4`;
  if (video.getAttribute("src") !== source) video.src = source;
  video.hidden = false;
  const origin = flock.sample ? "A sample, made of a film of a virtual fish" : filmName && `Made of “${filmName}”`;
  video.onerror = () => { video.hidden = true; showNote("This video cannot be played here. It can still be downloaded."); };
  video.setAttribute("aria-label", `${flock.count} individuals made of the film ${filmName}`);
  if (!calm.matches) video.play().catch(() => {});
  byId("stage-note").hidden = true;
  byId("stage-title").textContent = `A flock of ${count(flock.count)}`;
  byId("stage-facts").textContent = [origin, `${count(flock.frames)} frames`, `seed ${flock.seed}`].filter(Boolean).join(" · ");
  byId("stage-advice").replaceChildren(...(flock.advice ?? []).map((/** @type {any} */ one) => element("li", {}, one.sentence)));
  byId("stage-video-link").href = source;
  byId("stage-plan-link").href = `/v1/flocks/${flock.id}/flock.json`;
  for (const [name, file] of [["tracks", "tracks.csv"], ["truth", "ground-truth.zip"]]) {
    const link = byId(`stage-${name}-link`);
    link.href = `/v1/flocks/${flock.id}/${file}`;
    link.hidden = !flock.params.render?.ground_truth;
  }
  byId("stage-caption").hidden = false;
}

/** @param {string} text shown in place of a flock */
export function showEmptyStage(text) {
  const video = byId("stage-video");
  video.hidden = true;
  video.removeAttribute("src");
  video.load();
  byId("stage-caption").hidden = true;
  showNote(text);
}

function showNote(text) {
  byId("stage-note").textContent = text;
  byId("stage-note").hidden = false;
}
