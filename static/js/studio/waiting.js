// Films that are being measured while the studio is open, and the studio before its first animal is measured.
// @ts-check
import { list } from "../app/api.js";
import { element } from "../app/element.js";
import { isUnderWay, jobs, resultOf, subjectIdOf, whenReady } from "../app/jobs.js";
import { subjectOf, thing } from "../app/names.js";
import { setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { dismiss, dismissed, isDismissed } from "../parts/dismissed.js";
import { fileButton } from "../parts/drop.js";
import { jobCard, reconcile } from "../parts/tray.js";

/** Kinds of jobs that lead to an animal. */
const KINDS = ["sample", "analysis"];
/** Animals to choose from: as many as the service lists at once. */
const ANIMALS = 200;

/**
 * Returns the cards of the measurements under way; hidden if there are none. Of those that fail, a line leads to the film.
 * @param {{life: AbortSignal, isMeant?: (job: Api.Job) => boolean, onMeasured: (libraryId: string) => void}} options
 *   `isMeant`: jobs that matter here; onMeasured hears of each that is done
 */
export function underWay({ life, isMeant = () => true, onMeasured }) {
  const cards = element("div.list");
  const node = element("section.under-way", { hidden: true, "aria-label": say("tray.title") }, cards);
  /** Ids of the jobs that were under way since this is shown. */
  const seen = new Set();
  const draw = () => {
    const meant = jobs.value.filter((job) => KINDS.includes(job.kind) && isMeant(job));
    for (const job of meant) if (isUnderWay(job)) seen.add(job.id);
    const done = meant.filter((job) => job.state === "done" && seen.has(job.id));
    for (const { id } of done) seen.delete(id);
    const shown = meant.filter((job) => seen.has(job.id) && !isDismissed(job.id)).reverse();
    reconcile(cards, shown.map((job) => ({ key: `${job.id} ${job.state === "failed"}`, draw: job.state === "failed" ? refusalLine : jobCard, of: job })));
    node.hidden = shown.length === 0;
    for (const job of done) if (job.kind === "analysis") onMeasured(resultOf(job));
  };
  jobs.watch(draw, life);
  dismissed.watch(draw, life);
  return node;
}

/** Returns the line of a measurement that failed: it leads to the film, and can be put away. @param {Api.Job} job */
function refusalLine(job) {
  const text = element("span");
  subjectOf(job).then(({ name }) => { text.textContent = say("studio.refused", { film: name }); }).catch(() => {});
  const away = element("button.quiet", { type: "button", onclick: () => dismiss(job.id) }, say("dismiss"));
  const node = element("p.refused", { role: "status" }, text, element("a.button.quiet", { href: `/films/${subjectIdOf(job)}` }, say("job.mend")), away);
  return Object.assign(node, { update() {} });
}

/**
 * Shows what is under way, or how to begin. @param {HTMLElement} root
 * @param {{id: string, life: AbortSignal, onMeasured: () => void}} options `id` of the library that is awaited; empty: any
 */
export async function showWaiting(root, { id, life, onMeasured }) {
  await whenReady(life);
  const waiting = new AbortController();
  const signal = AbortSignal.any([life, waiting.signal]);
  const end = () => { if (!signal.aborted) { waiting.abort(); onMeasured(); } };
  setTitle(say("nav.studio"));
  const empty = element("div.empty", {}, element("p", {}, say("studio.empty")), element("p.actions", {}, fileButton(say("home.choose"))));
  const wait = element("p", { role: "status" });
  const cards = underWay({ life: signal, isMeant: (job) => !id || (job.kind === "analysis" && resultOf(job) === id), onMeasured: end });
  root.append(element("h1", { tabIndex: -1 }, say("nav.studio")), wait, cards, empty);
  jobs.watch(() => {
    empty.hidden = !cards.hidden;
    wait.textContent = cards.hidden ? "" : say("film.wait");
  }, signal);
  // A measurement may have ended before its job was watched here.
  if (await findLibrary(id, signal).catch(() => null)) end();
}

/**
 * Returns the library with this id, or the newest one, and all to choose from; null while it is measured or if there is
 * none. @param {string} id @param {AbortSignal} life @returns {Promise<{library: Api.Library, libraries: Api.Library[]} | null>}
 */
export async function findLibrary(id, life) {
  const asked = id ? thing("libraries", id) : null;
  asked?.catch(() => {});
  const libraries = (await list(`/v1/libraries?limit=${ANIMALS}`, life)).items;
  const library = asked ? await asked.catch((problem) => { if (problem.code !== "not_ready") throw problem; return null; }) : libraries[0];
  if (!library) return null;
  return { library, libraries: libraries.some((one) => one.id === library.id) ? libraries : [library, ...libraries] };
}
