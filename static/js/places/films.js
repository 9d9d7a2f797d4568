// The place of all films: what is known of each, search, delete.
// @ts-check
import { list } from "../app/api.js";
import { element } from "../app/element.js";
import { isUnderWay, jobs, subjectIdOf } from "../app/jobs.js";
import { filmName } from "../app/names.js";
import { setTitle } from "../app/router.js";
import { say, stageOf } from "../app/words.js";
import { filmCard } from "../parts/cards.js";
import { fileButton } from "../parts/drop.js";
import { pinButton, spaceSentence } from "../parts/pin.js";
import { problemBox, reasonOf } from "../parts/problem.js";
import { deleted, deleteLater } from "../parts/undo.js";

/** Films of a page. */
const PAGE = 30;

/** @typedef {{film: Api.Footage, library: Api.Library, node: HTMLElement, state: HTMLElement}} Entry library: the newest one of the film */

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { life }) {
  setTitle(say("films.title"));
  const search = element("input", { type: "search", placeholder: say("films.search"), "aria-label": say("films.search"), oninput: () => sift() });
  const cards = element("ul.cards");
  const more = element("button.quiet", { type: "button", hidden: true, onclick: () => fill().catch(tell) }, say("more"));
  const empty = element("div.empty", { hidden: true }, element("p", {}, say("films.empty")), element("p.actions", {}, fileButton(say("home.choose"))));
  const found = element("p.soft", { role: "status" });
  const trouble = element("div");
  const space = element("p.soft.narrow");
  root.append(element("header.place-head", {}, element("h1", { tabIndex: -1 }, say("films.title")), element("div.actions", {}, search, fileButton(say("home.choose")))),
    element("p.soft.narrow", {}, say("films.help")), space, found, trouble, empty, cards, element("p", {}, more));
  /** @type {Entry[]} */
  let all = [];
  /** @type {Api.Next<"/v1/footage">} */
  let next = `/v1/footage?limit=${PAGE}`;
  const tell = (/** @type {unknown} */ problem) => { if (!life.aborted) trouble.replaceChildren(problemBox(problem)); };

  /** @param {Api.Footage} film @returns {Promise<Entry>} */
  const entry = async (film) => {
    const [library] = (await list(`/v1/libraries?footage_id=${film.id}&limit=1`, life)).items;
    const state = element("p.film-state");
    const name = filmName(film);
    const drop = element("button.quiet.small", { type: "button", "aria-label": say("reels.delete.of", { name }), onclick: () => deleteLater({ id: film.id, path: `/v1/footage/${film.id}`, name }).focus() }, say("film.delete"));
    const pin = pinButton({ path: `/v1/footage/${film.id}`, isPinned: film.pinned, name }, tell);
    return { film, library, node: filmCard(film, { library, state: element("div.card-foot", {}, state, pin, drop) }), state };
  };
  /** Makes the entries of films that are not shown yet. @param {Api.Footage[]} films */
  const entriesOf = async (films) => {
    const made = await Promise.all(films.filter((film) => !all.some((one) => one.film.id === film.id)).map(entry));
    return made.filter(({ film }) => !all.some((one) => one.film.id === film.id));
  };
  const sift = () => {
    const wanted = search.value.trim().toLocaleLowerCase();
    const kept = all.filter(({ film }) => !deleted.value.has(film.id));
    const fit = kept.filter(({ film }) => filmName(film).toLocaleLowerCase().includes(wanted));
    for (const one of all) one.node.hidden = !fit.includes(one);
    more.hidden = !next;
    found.textContent = wanted ? say("films.found", { n: fit.length }) : "";
    found.hidden = !wanted;
    empty.hidden = Boolean(wanted || kept.length || next);
    search.hidden = all.length < 2;
  };
  const tellStates = () => {
    for (const { film, library, state, node } of all) {
      const mine = jobs.value.filter((job) => job.kind === "analysis" && job.subject?.id === film.id);
      const job = mine.find(isUnderWay) ?? mine[0];
      node.dataset.state = job && isUnderWay(job) ? "running" : library ? "measured" : job?.state === "failed" ? "refused" : "bare";
      state.textContent = job && isUnderWay(job) ? stageOf(job) : library ? say("film.measured") : say(job?.state === "failed" ? "state.failed" : "film.not_measured");
      if (node.dataset.state === "refused") reasonOf(job?.error).then((reason) => { if (node.dataset.state === "refused") state.textContent = reason; });
    }
  };
  const fill = async () => {
    if (!next) return;
    const page = await list(next, life);
    const made = await entriesOf(page.items);
    all.push(...made);
    cards.append(...made.map(({ node }) => node));
    next = page.next;
    sift();
    tellStates();
  };
  /** Shows films that came meanwhile, and the measurements of others. @param {Set<string>} measured ids of films */
  const refresh = async (measured) => {
    const again = await Promise.all(all.filter(({ film }) => measured.has(film.id)).map(({ film }) => entry(film)));
    for (const one of again) {
      const idx = all.findIndex(({ film }) => film.id === one.film.id);
      all[idx].node.replaceWith(one.node);
      all[idx] = one;
    }
    const made = await entriesOf((await list(`/v1/footage?limit=${PAGE}`, life)).items);
    all.unshift(...made);
    cards.prepend(...made.map(({ node }) => node));
    sift();
    tellStates();
  };
  deleted.watch(sift, life);
  const tellSpace = () => spaceSentence(life).then((sentence) => { space.textContent = sentence; }).catch(() => {});
  tellSpace();
  await fill();
  /** Jobs and their states that the cards show. */
  let known = new Set(jobs.value.map(stateKey));
  jobs.watch((every) => {
    tellStates();
    // A new job may be of a new film, a done one makes a library.
    const fresh = every.filter((job) => !["flock", "views", "dataset"].includes(job.kind) && !known.has(stateKey(job)));
    known = new Set(every.map(stateKey));
    if (fresh.length) {
      refresh(new Set(fresh.map(subjectIdOf))).catch(() => {});
      tellSpace();
    }
  }, life);
}

/** @param {Api.Job} job */
const stateKey = (job) => `${job.id} ${job.state === "done"}`;
