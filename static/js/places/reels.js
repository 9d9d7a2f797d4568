// The place of all flocks: newest first, searched by the name of the film, with those under way on top.
// @ts-check
import { list } from "../app/api.js";
import { element } from "../app/element.js";
import { isUnderWay, jobs } from "../app/jobs.js";
import { replaceAddress, setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { flockCard, flockName } from "../parts/cards.js";
import { pinButton } from "../parts/pin.js";
import { problemBox } from "../parts/problem.js";
import { jobCard, reconcile } from "../parts/tray.js";
import { deleted, deleteLater } from "../parts/undo.js";
import { studioAddress } from "../reel/settings.js";
import { loadFields } from "../studio/schema.js";

/** Flocks of a page, and of a page while a search goes through all of them. */
const PAGE = 24;
const SEARCHED = 100;

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { query, life }) {
  setTitle(say("reels.title"));
  const fields = loadFields();
  fields.catch(() => {});
  const search = element("input", { type: "search", value: query.get("q") ?? "", placeholder: say("reels.search"), "aria-label": say("reels.search") });
  const found = element("p.soft", { role: "status" });
  const empty = element("div", { hidden: true }, element("p", {}, say("reels.empty")), element("p.actions", {}, element("a.button", { href: "/studio" }, say("nav.studio"))));
  const running = element("div.list");
  const cards = element("ul.cards");
  const more = element("button.quiet", { type: "button", hidden: true, onclick: () => fill(PAGE).catch(tell) }, say("more"));
  const trouble = element("div");
  root.append(element("header.place-head", {}, element("h1", { tabIndex: -1 }, say("reels.title")), element("div.reels-search", {}, search, element("a.button.quiet", { href: "/datasets" }, say("data.title")))), running, found, empty, trouble, cards, element("p", {}, more));
  /** @type {{id: string, name: string, node: HTMLElement}[]} */
  let all = [];
  /** @type {Api.Next<"/v1/flocks">} */
  let next = `/v1/flocks?limit=${PAGE}`;
  /** The loading under way: pages come one after another. @type {Promise<void>} */
  let turn = Promise.resolve();
  const tell = (/** @type {unknown} */ problem) => { if (!life.aborted) trouble.replaceChildren(problemBox(problem)); };

  const wanted = () => search.value.trim().toLocaleLowerCase();
  /** Loads the next page. @param {number} limit */
  const fill = (limit) => {
    turn = turn.catch(() => {}).then(async () => {
      if (!next || life.aborted) return;
      const page = await list(/** @type {`/v1/flocks?${string}`} */ (next.replace(/limit=\d+/, `limit=${limit}`)), life);
      const made = await Promise.all(page.items.filter((flock) => !all.some((one) => one.id === flock.id)).map(entry));
      all.push(...made);
      cards.append(...made.map(({ node }) => node));
      next = page.next;
      sift();
    });
    return turn;
  };
  /** Puts flocks that were made meanwhile in front. */
  const refresh = async () => {
    const page = await list(`/v1/flocks?limit=${PAGE}`, life);
    const made = await Promise.all(page.items.filter((flock) => !all.some((one) => one.id === flock.id)).map(entry));
    all.unshift(...made);
    cards.prepend(...made.map(({ node }) => node));
    sift();
  };
  const entry = async (/** @type {Api.Flock} */ flock) => {
    const [node, name] = await Promise.all([flockCard(flock), flockName(flock)]);
    const studio = element("a.button.quiet.small", { href: `/libraries/${flock.library_id}/studio`, "aria-label": say("reels.studio.of", { name }) }, say("reels.studio"));
    fields.then((known) => { studio.href = studioAddress(flock, known); }).catch(() => {});
    const drop = element("button.quiet.small", { type: "button", "aria-label": say("reels.delete.of", { name }), onclick: () => deleteLater({ id: flock.id, path: `/v1/flocks/${flock.id}`, name }).focus() }, say("reel.delete"));
    const pin = pinButton({ path: `/v1/flocks/${flock.id}`, isPinned: flock.pinned, name }, tell);
    node.append(element("div.card-foot", {}, studio, pin, drop));
    return { id: flock.id, name: name.toLocaleLowerCase(), node };
  };
  /** Shows the cards that fit the search. */
  const sift = () => {
    const kept = all.filter(({ id }) => !deleted.value.has(id));
    const fit = kept.filter(({ name }) => name.includes(wanted()));
    for (const one of all) one.node.hidden = !fit.includes(one);
    more.hidden = !next;
    found.textContent = wanted() ? say("reels.found", { n: fit.length, query: search.value.trim() }) : "";
    empty.hidden = Boolean(wanted() || kept.length || next);
    search.hidden = !wanted() && !kept.length && !next;
  };
  /** The service searches the names of files, a person the names on the cards: all pages are loaded. */
  const searchAll = async () => {
    while (next && wanted() && !life.aborted) await fill(SEARCHED);
  };
  search.addEventListener("input", () => {
    replaceAddress(`/flocks${wanted() ? `?q=${encodeURIComponent(search.value.trim())}` : ""}`);
    sift();
    searchAll().catch(tell);
  });
  deleted.watch(sift, life);
  await fill(PAGE);
  searchAll().catch(tell);

  let n_done = -1;
  jobs.watch((every) => {
    const mine = every.filter((job) => job.kind === "flock");
    reconcile(running, mine.filter(isUnderWay).map((job) => ({ key: job.id, draw: jobCard, of: job })));
    const done = mine.filter((job) => job.state === "done").length;
    if (n_done >= 0 && done !== n_done) refresh().catch(() => {});
    n_done = done;
  }, life);
}
