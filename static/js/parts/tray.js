// The tray of jobs: what runs, how far it is, and buttons to cancel, open, mend or retry.
// @ts-check
import { byId, element } from "../app/element.js";
import { addressOf, aheadOf, cancel, isUnderWay, jobs, resultOf, retry, subjectIdOf, uploads } from "../app/jobs.js";
import { subjectOf } from "../app/names.js";
import { ago, say, size, stageOf } from "../app/words.js";
import { isDismissed, dismiss, dismissed } from "./dismissed.js";
import { fileButton } from "./drop.js";
import { filmButtons } from "./film-buttons.js";
import { problemBox } from "./problem.js";
import { timeLeft } from "./time-left.js";

/** Number of ended jobs in the tray; the place of all jobs shows more. */
const ENDED = 4;

/** Fills the tray and keeps it up to date. */
export function fillTray() {
  const tray = byId("tray");
  const list = element("div.tray-list");
  const close = element("button.quiet", { type: "button", onclick: () => tray.hidePopover() }, say("close"));
  tray.append(element("div.tray-head", {}, element("h2", {}, say("tray.title")), close), list, element("a", { href: "/jobs" }, say("tray.all")));
  // A link inside leads away from what the tray covers.
  tray.addEventListener("click", ({ target }) => { if (target instanceof Element && target.closest("a[href]")) tray.hidePopover(); });
  const draw = () => {
    const running = jobs.value.filter(isUnderWay);
    const shown = [...running, ...jobs.value.filter((job) => !isUnderWay(job) && !isDismissed(job.id)).slice(0, ENDED)];
    reconcile(list, [...uploads.value.map((one) => ({ key: `upload-${one.id}`, draw: uploadCard, of: one })), ...shown.map((job) => ({ key: job.id, draw: trayCard, of: job }))]);
    if (!list.childElementCount) list.append(element("p.soft", {}, say("tray.empty")));
  };
  for (const seen of [jobs, uploads, dismissed]) seen.watch(draw);
}

/** @template T @typedef {{key: string, draw: (of: T) => HTMLElement & {update: (of: T) => void}, of: T}} Entry */

/**
 * Keeps one element per entry, updates it, and removes those of former entries. Focus and open parts stay.
 * @param {Element} list @param {(Entry<Api.Job> | Entry<import("../app/upload.js").Upload>)[]} entries
 */
export function reconcile(list, entries) {
  const old = new Map([...list.children].map((node) => ["key" in node ? node.key : "", node]));
  const nodes = /** @type {Entry<any>[]} */ (entries).map(({ key, draw, of }) => {
    const node = /** @type {ReturnType<typeof draw> | undefined} */ (old.get(key)) ?? Object.assign(draw(of), { key });
    node.update(of);
    return node;
  });
  if (nodes.some((node, idx) => list.children[idx] !== node) || list.childElementCount !== nodes.length) list.replaceChildren(...nodes);
}

/** Returns the card of a job that can be put away once it has failed. @param {Api.Job} job */
function trayCard(job) {
  const card = jobCard(job);
  const away = element("button.quiet.small", { type: "button", hidden: true, onclick: () => dismiss(job.id) }, say("dismiss"));
  card.querySelector(".job-line")?.append(away);
  const { update } = card;
  return Object.assign(card, { update: (/** @type {Api.Job} */ seen) => { away.hidden = seen.state !== "failed"; update(seen); } });
}

/** Returns the card of a job. Its `update` shows a newer state. @param {Pick<Api.Job, "kind">} job */
export function jobCard(job) {
  const name = element("strong");
  const stage = element("span.job-stage", { role: "status" });
  const bar = element("progress", { max: 1, "aria-label": say("job.progress") });
  const more = element("p.soft");
  const actions = element("p.actions");
  const problem = element("div");
  const thumb = element("img.job-thumb", { alt: "", width: 64, height: 48, hidden: true });
  const card = element("article.job", {}, thumb, element("div.job-body", {}, element("div.job-line", {}, name, stage), bar, more, problem, actions));
  const left = timeLeft();
  let [drawn, isNamed] = ["", true];
  const tellSubject = async (/** @type {Api.Job} */ seen) => {
    // Without an answer of the service, it is asked again at the next change.
    const film = await subjectOf(seen).catch(() => ({ name: say("film.unnamed"), poster: "", isGone: false, isUnknown: true }));
    isNamed = !("isUnknown" in film);
    name.textContent = say(`job.${job.kind}`, { film: film.name });
    thumb.hidden = !film.poster;
    if (film.poster) thumb.src = film.poster;
    if (drawn.startsWith(seen.state) && !isUnderWay(seen)) actions.replaceChildren(...buttonsOf(seen, film));
  };
  const update = (/** @type {Api.Job} */ seen) => {
    bar.value = seen.progress ?? 0;
    bar.hidden = !isUnderWay(seen);
    stage.textContent = stageOf(seen);
    more.textContent = isUnderWay(seen) ? [aheadText(seen), leftText(left(seen, Date.now())), seen.attempt > 1 ? say("job.restarted", { n: seen.attempt }) : ""].filter(Boolean).join(" ") : ago(seen.finished_at ?? seen.created_at);
    // The line is shown even while it is empty. Otherwise its first text would move the buttons below.
    more.hidden = !isUnderWay(seen) && !more.textContent;
    const state = `${seen.state} ${seen.cancel_requested}`;
    if (state === drawn) return isNamed ? undefined : void tellSubject(seen);
    drawn = state;
    card.dataset.state = seen.state;
    problem.replaceChildren(...(seen.state === "failed" ? [problemBox(seen.error ?? {})] : []));
    actions.replaceChildren(...buttonsOf(seen));
    return void tellSubject(seen);
  };
  return Object.assign(card, { update });
}

/** @param {Api.Job} job @param {{isGone: boolean}} [film] what the job works on, once it is known */
function buttonsOf(job, film) {
  if (isUnderWay(job)) {
    return [element("button.quiet", { type: "button", disabled: job.cancel_requested, onclick: once(() => cancel(job.id)) }, say("cancel"))];
  }
  if (!film || film.isGone) return [];
  if (job.state === "done") return job.kind === "sample" ? [] : [element("a.button.quiet", { href: addressOf(job) }, say("job.open")), ...(job.kind === "flock" ? filmButtons(resultOf(job)) : [])];
  const again = job.retriable ? [element("button.quiet", { type: "button", onclick: once(() => retry(job.id)) }, say("job.retry"))] : [];
  // The place of a refused film has its mends.
  if (job.kind === "analysis") return [...again, element("a.button.quiet", { href: `/films/${subjectIdOf(job)}` }, say(job.state === "failed" ? "job.mend" : "job.film"))];
  return job.kind === "flock" ? [...again, element("a.button.quiet", { href: `/libraries/${subjectIdOf(job)}/studio` }, say("reels.studio"))] : again;
}

/** Returns how many jobs come before a job that waits. @param {Api.Job} job */
function aheadText(job) {
  const n = job.state === "queued" ? aheadOf(job) : 0;
  return n ? say("job.ahead", { n }) : "";
}

/** Returns a handler of clicks that disables its button, unless the request fails. @param {() => Promise<unknown>} request */
const once = (request) => (/** @type {Event} */ { target }) => {
  const button = /** @type {HTMLButtonElement} */ (target);
  button.disabled = true;
  request().catch(() => { button.disabled = false; });
};

/** Returns the time left as text; empty if it is unknown. @param {number | null} left_s */
function leftText(left_s) {
  if (left_s === null) return "";
  return say("job.left", { time: left_s < 90 ? say("unit.seconds", { n: Math.round(left_s) }) : say("unit.minutes", { n: Math.round(left_s / 60) }) });
}

/** Returns the card of an upload. @param {import("../app/upload.js").Upload} upload */
function uploadCard(upload) {
  const name = element("strong", {}, upload.name);
  const stage = element("span.job-stage", { role: "status" });
  const bar = element("progress", { max: 1, "aria-label": say("job.progress") });
  const more = element("p.soft");
  const problem = element("div");
  const stop = element("button.quiet", { type: "button", onclick: () => upload.cancel() });
  const again = upload.state === "paused" && fileButton(say("home.choose"));
  const film = upload.address && element("video.job-thumb", { src: upload.address, muted: true, preload: "metadata", "aria-hidden": "true", onerror: () => film && film.remove() });
  const card = element("article.job", {}, film, element("div.job-body", {}, element("div.job-line", {}, name, stage), bar, more, problem, element("p.actions", {}, again, stop)));
  const update = (/** @type {typeof upload} */ seen) => {
    bar.value = seen.total ? seen.sent / seen.total : 0;
    bar.hidden = seen.state !== "sending";
    stage.textContent = say(`upload.${seen.state}`);
    more.textContent = seen.state === "sending" ? say("upload.of", { sent: size(seen.sent), total: size(seen.total) }) : seen.state === "paused" ? say("upload.choose") : "";
    more.hidden = !more.textContent;
    stop.textContent = say(seen.state === "failed" ? "dismiss" : "cancel");
    if (seen.state === "failed" && !problem.childElementCount) problem.replaceChildren(problemBox(seen.problem));
  };
  return Object.assign(card, { update });
}
