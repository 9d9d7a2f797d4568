// The place of one film: it plays while it is measured. When the analysis is done, its flock swims here.
// @ts-check
import { get, list } from "../app/api.js";
import { element, releaseVideo } from "../app/element.js";
import { ended, expect, isUnderWay, jobs, resultOf, whenReady } from "../app/jobs.js";
import { isCalm } from "../app/motion.js";
import { filmName } from "../app/names.js";
import { go, setTitle } from "../app/router.js";
import { sent } from "../app/upload.js";
import { count, say, seconds } from "../app/words.js";
import { filmPicture } from "../parts/cards.js";
import { mendsOf } from "../editor/mends.js";
import { measure } from "../parts/drop.js";
import { showFlock } from "../parts/hero.js";
import { preview } from "../parts/living.js";
import { problemBox, showProblem } from "../parts/problem.js";
import { jobCard } from "../parts/tray.js";
import { deleteLater } from "../parts/undo.js";

/** First flock of a film: as many as have room. */
const FIRST = { frames: 300 };

/** @typedef {{film: Api.Footage, stage: HTMLElement, status: HTMLElement, life: AbortSignal, known: Known}} Parts */
/** @typedef {{library?: Api.Library, former?: Record<string, any>}} Known the newest measurement, and the parameters of the last one, which may have failed */

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { id, life, state }) {
  const film = await get(`/v1/footage/${id}`, life);
  const name = filmName(film);
  setTitle(name);
  const stage = element("section.hero", { "aria-label": say("home.film") });
  const status = element("div.status", { "aria-live": "polite" });
  const drop = element("button.quiet.small", { type: "button", onclick: discard }, say("film.delete"));
  const settings = element("button.quiet.small#change-settings", { type: "button", onclick: () => edit(parts) }, say("film.settings"));
  root.append(element("header.place-head", {}, element("div", {}, element("h1", { tabIndex: -1 }, name),
    element("p.soft", {}, [seconds(film.n_frames_hint / film.fps), film.image_size_px.join(" × "), say("unit.fps", { n: count(film.fps) })].join(" · "))),
  element("p.actions", {}, settings, drop)), stage, status);
  /** @type {Parts} */
  const parts = { film, stage, status, life, known: {} };
  await whenReady(life);
  const job = await jobOf(id, state?.job, life);
  // The place is shown now: the router need not wait for the end of the job to set the focus.
  if (job) return void follow(job, parts);
  const [library] = (await list(`/v1/libraries?footage_id=${id}&limit=1`, life)).items;
  if (library) return showMeasured(library.id, parts, state?.isKnown ? say("film.known") : "");
  showFilm(parts);
  return void offer(parts, say("film.not_measured"));

  async function discard() {
    const undo = deleteLater({ id, path: `/v1/footage/${id}`, name });
    await go("/films");
    undo.focus();
  }
}

/** Returns the newest analysis of a film if it is under way or failed, or the given one. @param {string} id @param {string | undefined} jobId @param {AbortSignal} life */
async function jobOf(id, jobId, life) {
  const mine = jobs.value.filter((job) => job.kind === "analysis" && job.subject?.id === id);
  const newest = mine.find(isUnderWay) ?? mine[0];
  if (newest) return newest.state === "done" || newest.state === "cancelled" ? null : newest;
  return jobId ? get(`/v1/jobs/${jobId}`, life).catch((problem) => { if (problem.status !== 404) throw problem; return null; }) : null;
}

/** Plays the film as it was sent, if this browser can. @param {Parts} parts */
function showFilm({ film, stage, life }) {
  const video = element("video", { src: sent.get(film.id) ?? `/v1/footage/${film.id}/file`, muted: true, loop: true, playsInline: true, controls: true, autoplay: !isCalm(), "aria-label": say("home.film") });
  video.addEventListener("error", () => video.replaceWith(element("p.hero-note", {}, filmPicture(film), say("film.unplayable"))));
  video.style.setProperty("--ratio", String(film.image_size_px[0] / film.image_size_px[1]));
  stage.classList.remove("alive");
  const back = element("video.hero-back", { src: `${video.src}#t=0.1`, muted: true, preload: "metadata", tabIndex: -1, "aria-hidden": "true" });
  back.addEventListener("error", () => back.remove());
  stage.replaceChildren(back, video);
  life.addEventListener("abort", () => [back, video].forEach(releaseVideo));
}

/** Offers to measure the film. @param {Parts} parts @param {string} sentence */
function offer({ film, status }, sentence) {
  const button = element("button", { type: "button", onclick: () => measure(film.id, {}, { show: true }) }, say("film.measure"));
  status.replaceChildren(element("p", {}, sentence), element("p.actions", {}, button));
  return button;
}

/** @param {Api.Job} job @param {Parts} parts */
async function follow(job, parts) {
  const { film, status, life } = parts;
  showFilm(parts);
  const card = jobCard(job);
  card.update(job);
  status.replaceChildren(element("p", {}, say("film.wait")), card);
  try {
    const done = await ended(job.id, life, card.update);
    await showMeasured(resultOf(done), parts);
  } catch (problem) {
    if (life.aborted) return;
    // A disabled button has lost its focus to the page.
    const hadFocus = card.contains(document.activeElement) || [document.body, document.querySelector("#place h1")].includes(/** @type {HTMLElement} */ (document.activeElement));
    if (/** @type {any} */ (problem).name === "AbortError") {
      const button = offer(parts, say("film.cancelled"));
      if (hadFocus) button.focus();
    } else showRefusal(/** @type {import("../app/api.js").Problem} */ (problem), parts);
  }
}

/** Shows why the film was refused, with its mends. @param {import("../app/api.js").Problem} problem @param {Parts} parts */
function showRefusal(problem, parts) {
  parts.known.former = problem.params ?? {};
  const mends = mendsOf(problem, (mend) => edit(parts, (editor) => editor.openedBy(mend, problem)));
  parts.status.replaceChildren(problemBox(problem, mends), ...(mends.length ? [] : [element("p.soft", {}, say("mend.none"))]));
}

/**
 * Opens the editor. @param {Parts} parts
 * @param {(editor: typeof import("../editor/editor.js")) => Partial<import("../editor/editor.js").Opening>} [opened]
 */
async function edit({ film, status, life, known }, opened = () => ({})) {
  try {
    const editor = await import("../editor/editor.js");
    await editor.openEditor({ film, library: known.library, former: known.former ?? known.library?.params, ...opened(editor), life, async onBegun({ job_id, footage_id }) {
      await expect(job_id);
      go(`/films/${footage_id}`, { job: job_id });
    } });
  } catch (problem) {
    if (!life.aborted) showProblem(status, problem);
  }
}

/** @param {string} libraryId @param {Parts} parts @param {string} [note] */
async function showMeasured(libraryId, parts, note = "") {
  const { film, stage, status, life } = parts;
  try {
    const planning = preview(libraryId, FIRST, life);
    planning.catch(() => {});
    const library = await get(`/v1/libraries/${libraryId}`, life);
    parts.known.library = library;
    const studio = element("a.button", { href: `/libraries/${libraryId}/studio` }, say("film.studio"));
    const links = [studio, element("a.button.quiet", { href: `/libraries/${libraryId}` }, say("film.desk"))];
    await showFlock(stage, { library, planning, life, links });
    const again = element("button.quiet", { type: "button", onclick: () => edit(parts) }, say("job.again"));
    const fish = element("a.button.quiet", { href: `/libraries/${libraryId}/fish`, title: say("desk.fish.help") }, say("desk.fish"));
    const hadFocus = status.contains(document.activeElement);
    status.replaceChildren(element("p", {}, note || say("film.flock"), " ", say("film.next")), element("p.actions", {}, again, fish));
    if (hadFocus) studio.focus({ preventScroll: true });
  } catch (problem) {
    if (life.aborted) return;
    showFilm(parts);
    showProblem(status, problem);
    status.append(element("p.actions", {}, element("a.button.quiet", { href: `/libraries/${libraryId}` }, say("film.desk"))));
  }
}
