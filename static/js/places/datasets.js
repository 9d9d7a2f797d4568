// The place of data sets: the form of a new one, those under way, and the finished ones with their files.
// @ts-check
import { list } from "../app/api.js";
import { byId, element } from "../app/element.js";
import { isUnderWay, jobs } from "../app/jobs.js";
import { setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { datasetCard } from "../dataset/card.js";
import { datasetForm } from "../dataset/form.js";
import { problemBox } from "../parts/problem.js";
import { jobCard, reconcile } from "../parts/tray.js";
import { deleted } from "../parts/undo.js";

/** Data sets of a page, and most films to choose from. */
const PAGE = 24;
const FILMS = 200;

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { query, life }) {
  setTitle(say("data.title"));
  const [running, cards, trouble] = [element("div.list"), element("ul.cards"), element("div")];
  const more = element("button.quiet", { type: "button", hidden: true, onclick: () => fill().catch(tell) }, say("more"));
  const form = element("div");
  root.append(element("header.place-head", {}, element("div", {}, element("h1", { tabIndex: -1 }, say("data.title")), element("p.soft", {}, say("data.what")))), form, running, trouble, cards, element("p", {}, more));
  const tell = (/** @type {unknown} */ problem) => { if (!life.aborted) trouble.replaceChildren(problemBox(problem)); };

  /** @type {{id: string, node: HTMLElement}[]} */
  let all = [];
  /** @type {Api.Next<"/v1/datasets">} */
  let next = `/v1/datasets?limit=${PAGE}`;
  const made = (/** @type {Api.Dataset[]} */ items) => items.filter(({ id }) => !all.some((one) => one.id === id)).map((dataset) => ({ id: dataset.id, node: datasetCard(dataset, tell) }));
  const sift = () => {
    for (const { id, node } of all) node.hidden = deleted.value.has(id);
    more.hidden = !next;
  };
  const fill = async () => {
    if (!next) return;
    const page = await list(next, life);
    const found = made(page.items);
    all.push(...found);
    cards.append(...found.map(({ node }) => node));
    next = page.next;
    sift();
  };
  /** Puts data sets that were made meanwhile in front. */
  const refresh = async () => {
    const found = made((await list(`/v1/datasets?limit=${PAGE}`, life)).items);
    all = [...found, ...all];
    cards.prepend(...found.map(({ node }) => node));
    sift();
  };
  deleted.watch(sift, life);
  const libraries = newestOfEach((await list(`/v1/libraries?limit=${FILMS}`, life)).items);
  const asked = query.getAll("library");
  const chosen = asked.length ? asked : libraries.slice(0, 1).map(({ id }) => id);
  form.append(libraries.length ? await datasetForm({ libraries: withAsked(libraries, asked), chosen, life }) : element("p", {}, say("data.no_films"), " ", element("a", { href: "/films" }, say("nav.films"))));
  life.throwIfAborted();
  await fill();
  byId(`dataset-${query.get("made")}`)?.scrollIntoView();

  let n_done = -1;
  jobs.watch((every) => {
    const mine = every.filter((job) => job.kind === "dataset");
    reconcile(running, mine.filter((job) => isUnderWay(job) || job.retriable).map((job) => ({ key: job.id, draw: jobCard, of: job })));
    const done = mine.filter((job) => job.state === "done").length;
    if (n_done >= 0 && done !== n_done) refresh().catch(() => {});
    n_done = done;
  }, life);
}

/** Returns the newest library of each film. @param {Api.Library[]} libraries newest first */
const newestOfEach = (libraries) => libraries.filter(({ footage_id }, k) => libraries.findIndex((one) => one.footage_id === footage_id) === k);

/** Returns the libraries with those of the address in front. @param {Api.Library[]} libraries @param {string[]} asked */
const withAsked = (libraries, asked) => [...libraries].sort((a, b) => Number(asked.includes(b.id)) - Number(asked.includes(a.id)));
