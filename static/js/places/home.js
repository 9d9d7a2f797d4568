// Home: the newest flock alive on a canvas, the film that it came from, and the way to an own one.
// @ts-check
import { list } from "../app/api.js";
import { element, releaseVideo } from "../app/element.js";
import { isUnderWay, jobs, ready, subjectIdOf } from "../app/jobs.js";
import { isCalm } from "../app/motion.js";
import { remember, thing } from "../app/names.js";
import { setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { fileButton } from "../parts/drop.js";
import { setBack, showFlock } from "../parts/hero.js";
import { planOf, preview } from "../parts/living.js";

/** Length of the flock of a library that has none yet, and number of recent cards. */
const FIRST = { frames: 300 };
const RECENT = 8;

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { life }) {
  setTitle();
  const stage = element("section.hero", { "aria-label": say("home.stage") }, element("p.hero-note", { role: "status" }, say("home.looking")));
  const recent = element("ul.cards");
  const hasCamera = matchMedia("(pointer: coarse)").matches;
  root.append(stage,
    element("section.intro", {}, element("h1", { tabIndex: -1 }, say("home.title")),
      element("p.actions", {}, fileButton(say("home.choose")), hasCamera && fileButton(say("home.camera"), { camera: true }), element("span.soft.drop-hint", {}, say("home.drop")))),
    element("ol.steps", {}, ...["film", "measured", "flock"].map((step) => element("li", {}, element("strong", {}, say(`home.step.${step}`)), element("span", {}, say(`home.step.${step}.help`))))),
    element("section", { hidden: true }, element("h2", {}, say("home.recent")), recent));
  // The key of the flock on the stage; null until the service has answered.
  let shown = /** @type {string | null} */ (null);
  let shownLife = new AbortController();
  life.addEventListener("abort", () => shownLife.abort());

  const fill = async () => {
    const [flocks, libraries] = await Promise.all([list(`/v1/flocks?limit=${RECENT}`, life), list(`/v1/libraries?limit=${RECENT}`, life)]);
    remember("libraries", libraries.items);
    const newest = newestOf(flocks.items[0], libraries.items[0]);
    if (!newest.key && shown !== "") {
      shown = "";
      hear(jobs.value);
    } else if (newest.key !== shown) {
      shown = newest.key;
      shownLife.abort();
      shownLife = new AbortController();
      await enliven(stage, newest, shownLife.signal).catch((problem) => tell(stage, problem, shownLife.signal));
    }
    await showRecent(recent, flocks.items, libraries.items, life);
  };
  // Results of other tabs and of the sample appear by themselves.
  let n_done = -1;
  const hear = (/** @type {Api.Job[]} */ all) => {
    if (!ready.value) return;
    const running = all.filter(isUnderWay);
    if (shown === "") showWaiting(stage, running, life).catch(() => {});
    const done = all.filter((job) => job.state === "done").length;
    if (done === n_done) return;
    n_done = done;
    fill().catch((problem) => { if (!shown) tell(stage, problem, life); });
  };
  jobs.watch(hear, life);
  ready.watch(() => hear(jobs.value), life);
}

/** Returns the newest thing to show: a flock, or a library without one. @param {Api.Flock | undefined} flock @param {Api.Library | undefined} library */
function newestOf(flock, library) {
  if (library && (!flock || (flock.library_id !== library.id && flock.created_at < library.created_at))) return { key: library.id, libraryId: library.id, flock: null };
  return { key: flock?.id ?? "", libraryId: flock?.library_id ?? "", flock };
}

/** Shows the first jobs of an empty service, or what to do. @param {HTMLElement} stage @param {Api.Job[]} running @param {AbortSignal} life */
async function showWaiting(stage, running, life) {
  if (!running.length) return showEmpty(stage);
  const { jobCard, reconcile } = await import("../parts/tray.js");
  if (stage.classList.contains("alive")) return undefined;
  let cards = stage.querySelector(".hero-jobs");
  if (!cards) {
    const sample = running.some((job) => job.kind === "sample");
    cards = element("div.hero-jobs");
    stage.replaceChildren(element("div.hero-wait", {}, element("p.hero-note", { role: "status" }, say(sample ? "home.waiting.sample" : "home.waiting")), cards));
  }
  const chain = [...running].reverse().slice(0, 3);
  // The film under measurement plays behind, as soon as it exists.
  const measured = chain.find((job) => job.kind === "analysis");
  if (measured?.state === "running" && !stage.querySelector(".hero-behind")) stage.prepend(filmBehind(subjectIdOf(measured), life));
  reconcile(cards, chain.map((job) => ({ key: job.id, draw: jobCard, of: job })));
  return undefined;
}

/** Says what to do while there is no flock, or which film could not be measured. @param {HTMLElement} stage */
function showEmpty(stage) {
  const newest = jobs.value.find((job) => job.kind === "analysis");
  const isRefused = newest?.state === "failed" || newest?.state === "cancelled";
  stage.replaceChildren(element("div.hero-wait", {}, element("p.hero-note", { role: "status" }, say(isRefused ? "home.failed" : "home.empty")),
    isRefused && element("p.actions", {}, element("a.button.quiet", { href: `/films/${subjectIdOf(newest)}` }, say("job.film")))));
}

/** @param {string} footageId @param {AbortSignal} life */
function filmBehind(footageId, life) {
  const film = element("video.hero-behind", { src: `/v1/footage/${footageId}/file`, muted: true, loop: true, playsInline: true, autoplay: !isCalm(), "aria-label": say("home.film") });
  film.addEventListener("error", () => film.remove());
  life.addEventListener("abort", () => releaseVideo(film));
  return film;
}

/** @param {HTMLElement} stage @param {{libraryId: string, flock?: Api.Flock | null}} newest @param {AbortSignal} life */
async function enliven(stage, { libraryId, flock }, life) {
  const planning = flock ? planOf(flock.id, life) : preview(libraryId, FIRST, life);
  planning.catch(() => {});
  const library = await thing("libraries", libraryId);
  life.throwIfAborted();
  if (!stage.classList.contains("alive")) {
    setBack(stage, `/v1/libraries/${libraryId}/poster.jpg`);
    stage.querySelector(".hero-wait, .hero-note")?.remove();
  }
  const links = [element("a.button", { href: `/libraries/${libraryId}/studio` }, say("home.play"))];
  if (flock) links.push(element("a.button.quiet", { href: `/flocks/${flock.id}` }, say("home.open")));
  else links.push(element("a.button.quiet", { href: `/libraries/${libraryId}` }, say("film.desk")));
  await showFlock(stage, { library, planning, life, links });
}

/** @param {HTMLElement} recent @param {Api.Flock[]} flocks @param {Api.Library[]} libraries @param {AbortSignal} life */
async function showRecent(recent, flocks, libraries, life) {
  const { flockCard, libraryCard } = await import("../parts/cards.js");
  const bare = libraries.filter((library) => !flocks.some((flock) => flock.library_id === library.id));
  const all = [...flocks.map((one) => ({ time: one.created_at, draw: () => flockCard(one) })), ...bare.map((one) => ({ time: one.created_at, draw: () => libraryCard(one) }))]
    .sort((a, b) => (a.time < b.time ? 1 : -1)).slice(0, RECENT);
  const cards = await Promise.all(all.map(({ draw }) => draw()));
  if (life.aborted) return;
  recent.replaceChildren(...cards);
  /** @type {HTMLElement} */ (recent.parentElement).hidden = cards.length === 0;
}

/** @param {HTMLElement} stage @param {any} problem @param {AbortSignal} life */
async function tell(stage, problem, life) {
  const { showProblem } = await import("../parts/problem.js");
  if (!life.aborted && problem.name !== "AbortError") showProblem(stage, problem);
}
