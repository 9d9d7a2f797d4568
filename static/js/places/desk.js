// The desk: what was measured in a film. Film, plots, matrix and path show one moment.
// @ts-check
import { get } from "../app/api.js";
import { element } from "../app/element.js";
import { filmName } from "../app/names.js";
import { replaceAddress, setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { adviceCards } from "../desk/advice.js";
import { createArcs } from "../desk/arcs.js";
import { dataTable } from "../desk/data-table.js";
import { downloadTable } from "../desk/downloads.js";
import { createInstrument } from "../desk/instrument.js";
import { jumpPlayer } from "../desk/jumps.js";
import { startKeys } from "../desk/keys.js";
import { comparison, numberList } from "../desk/numbers.js";
import { createPanels } from "../desk/panels.js";
import { createPictures } from "../desk/pictures.js";
import { createPlayer } from "../desk/player.js";
import { createPlots } from "../desk/plots.js";
import { createShots } from "../desk/shots.js";
import { createStage } from "../desk/stage.js";
import { summaryCard } from "../desk/summary.js";
import { createTimeAxis } from "../desk/time-axis.js";
import { createTransport } from "../desk/transport.js";
import { showProblem } from "../parts/problem.js";

/** Time without a change after which the address follows, ms. Browsers limit how often it may change. */
const ADDRESS_MS = 300;

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { id, query, life }) {
  const library = await get(`/v1/libraries/${id}`, life);
  setTitle(say("desk.title", { film: filmName(library) }));
  const desk = createInstrument(library, Number(query.get("t")) || 0, life);
  const player = createPlayer(desk);
  const pictures = createPictures(desk);
  const shoot = createShots(desk);
  const nextJump = jumpPlayer(desk, player);
  const stage = createStage(desk, { player, pictures });
  const transport = createTransport(desk, { player, nextJump });
  const axis = createTimeAxis(desk, player, [...createPlots(desk), createArcs(desk)]);
  const results = element("section.results", { "aria-live": "polite" });
  const remeasure = (focus = "animal_at", patch = {}) => import("../desk/again.js")
    .then(({ measureAgain }) => measureAgain(desk, { player, results, opening: { focus, patch } }))
    .catch((problem) => { if (!life.aborted) showProblem(results, problem); });
  const panels = createPanels(desk, { player, pictures, shoot, tab: query.get("tab") ?? "", remeasure });
  const showTab = (/** @type {string} */ tab) => { panels.chosen.set(tab); panels.node.scrollIntoView({ block: "nearest" }); /** @type {HTMLElement | null} */ (panels.node.querySelector(`#tab-${tab}`))?.focus({ preventScroll: true }); };
  const numbers = element("div");
  const failure = element("div");

  root.append(
    element("header.place-head", {}, element("h1", { tabIndex: -1 }, filmName(library)),
      element("p.actions", {}, element("a.button", { href: `/libraries/${id}/studio` }, say("film.studio")), element("a.button.quiet", { href: `/films/${library.footage_id}` }, say("desk.the_film")), element("button.quiet#measure-again", { type: "button", onclick: () => remeasure() }, say("job.again")), element("a.button.quiet", { href: `/libraries/${id}/fish`, title: say("desk.fish.help") }, say("desk.fish")))),
    failure,
    element("div.desk-pair", {},
      element("section.desk-film", { "aria-label": say("desk.film") }, stage.node, stage.controls, transport.node, transport.reading),
      element("section.desk-time", {}, element("header.place-head", {}, element("h2", {}, say("desk.over_time")), axis.buttons), axis.node, element("p.soft.keys", {}, say("desk.keys")), dataTable(desk)),
      panels.node),
    results,
    element("section", {}, element("h2", {}, say("desk.motion")), summaryCard(desk)),
    element("section", {}, element("h2", {}, say("desk.numbers")), numbers),
    element("section", {}, element("h2", {}, say("desk.advice")), element("p.soft", {}, say("desk.advice.help")), adviceCards(desk, { pictures, shoot, acts: { remeasure, showTab } })),
    element("section", {}, element("h2", {}, say("desk.files")), downloadTable(library, life)));

  const tellNumbers = () => numbers.replaceChildren(numberList({ library, head: desk.head.value, px_per_cm: desk.scale.value }));
  desk.head.watch(tellNumbers, life);
  desk.scale.watch(tellNumbers, life);
  desk.failure.watch((problem) => { if (problem) showProblem(failure, problem); }, life);
  desk.moment.watch((frame) => { root.dataset.frame = String(frame); }, life);
  desk.isLoaded.watch((loaded) => { root.dataset.loaded = String(loaded); }, life);
  startKeys(life, { player, desk, axis, nextJump, focusFrame: transport.focusFrame });
  followAddress(desk, panels.chosen, life);
  compareWith(query.get("compare"), { desk, results }).catch(() => {});
}

/** Keeps the moment and the tab in the address. @param {import("../desk/instrument.js").Instrument} desk @param {import("../app/store.js").Signal<string>} tab @param {AbortSignal} life */
function followAddress(desk, tab, life) {
  let timer = 0;
  let isFirst = true;
  const write = () => {
    const address = new URL(location.href);
    // Rounded up, so that the time lies within its frame.
    address.searchParams.set("t", String(Math.ceil((desk.moment.value / desk.library.fps) * 1000 - 1e-6) / 1000));
    address.searchParams.set("tab", tab.value);
    if (!life.aborted) replaceAddress(address.pathname + address.search);
  };
  const later = () => {
    clearTimeout(timer);
    if (!isFirst) timer = setTimeout(write, ADDRESS_MS);
  };
  desk.moment.watch(later, life);
  tab.watch(later, life);
  isFirst = false;
  life.addEventListener("abort", () => clearTimeout(timer));
}

/** Shows the numbers of another measurement beside these. @param {string | null} other @param {{desk: import("../desk/instrument.js").Instrument, results: HTMLElement}} parts */
async function compareWith(other, { desk, results }) {
  if (!other) return;
  const library = await get(`/v1/libraries/${encodeURIComponent(other)}`, desk.life);
  results.replaceChildren(element("h2", {}, say("desk.compare.title")), comparison({ library }, { library: desk.library }), element("p.actions", {}, element("a.button.quiet", { href: `/libraries/${other}` }, say("desk.compare.back"))));
}
