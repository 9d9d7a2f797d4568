// The studio: a flock swims while its settings change. The settings are the query of the address, so a link is a flock.
// @ts-check
import { element } from "../app/element.js";
import { filmName, thing } from "../app/names.js";
import { go, replaceAddress, setTitle } from "../app/router.js";
import { signal } from "../app/store.js";
import { say } from "../app/words.js";
import { timeline } from "../parts/timeline.js";
import { factsBox, orderOf } from "../studio/facts.js";
import { maker } from "../studio/make.js";
import { overlay } from "../studio/overlay.js";
import { panel } from "../studio/panel.js";
import { placedOf } from "../studio/placed.js";
import { createPlanner } from "../studio/planner.js";
import { loadFields } from "../studio/schema.js";
import { at, createSettings, readQuery, writeQuery } from "../studio/settings.js";
import { share } from "../studio/share.js";
import { stage } from "../studio/stage.js";
import { thingsList } from "../studio/things-list.js";
import { toolbar } from "../studio/toolbar.js";
import { findLibrary, showWaiting, underWay } from "../studio/waiting.js";
import { problemBox, showProblem } from "../parts/problem.js";

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, visit) {
  const { id, query, life } = visit;
  const loading = loadFields();
  loading.catch(() => {});
  const found = await findLibrary(id, life);
  if (!found) return showWaiting(root, { id, life, onMeasured: () => fill(root, visit) });
  const { library, libraries } = found;
  const libraryId = library.id;
  const fields = await loading;
  life.throwIfAborted();
  const film = { fps: library.fps, size: library.image_size_px };
  const { settings: start, unknown } = readQuery(query, fields);
  const settings = createSettings(start);
  const tool = signal("");
  let [moment, planned] = [query.get("t"), /** @type {{plan: import("../flock/plan.js").Plan | null, settings: import("../studio/settings.js").Settings}} */ ({ plan: null, settings: {} })];

  /** The value in force: the person's, else that of the plan, else the default. @param {string} name */
  const valueOf = (name) => {
    if (name in settings.now.value) return settings.now.value[name];
    const told = planned.plan && !(name in planned.settings) ? at(planned.plan.head.params, name) : undefined;
    return told === undefined ? fields.get(name)?.default : told;
  };
  const placed = () => placedOf(valueOf);
  const n = () => valueOf("count") ?? planned.plan?.nIndividuals ?? 20;
  const length_s = () => (valueOf("frames") ?? 400) / film.fps;
  const queryText = () => writeQuery(settings.now.value);
  const address = () => `/libraries/${libraryId}/studio${queryText() && `?${queryText()}`}`;
  const tellAddress = () => replaceAddress(moment === null ? address() : `${address()}${queryText() ? "&" : "?"}t=${moment}`);

  const time = timeline({ life, seek: (frame) => view.seek(frame), toggle: () => view.toggle(), onScrub: (time_s) => { moment = time_s.toFixed(2); tellAddress(); } });
  const view = stage({ libraryId, size: film.size, life, tool, startFrame: moment === null ? null : Math.round(Number(moment) * film.fps) || 0,
    onFrame: (frame) => { time.setFrame(frame); layer.mark(view.plan, frame); },
    onState: (isPlaying) => { time.setPlaying(isPlaying); if (isPlaying && moment !== null) { moment = null; tellAddress(); } },
    onPath: (path) => settings.change({ predator: { ...placed().predator, path } }), length_s });
  const layer = overlay({ canvas: view.canvas, size: film.size, life, tool, placed, length_s, change: settings.change, onSelect: (key) => things.select(key) });
  const side = panel({ fields, change: settings.change, valueOf, film, formats: fields.get("render.formats")?.choices ?? [] });
  const things = thingsList({ node: side.things, life, placed, change: settings.change, layer, tool });
  const tools = toolbar({ tool, life, add: layer.add, undo: settings.undo, redo: settings.redo, compare: (isOn) => view.compare(isOn ? settings.before : null, planner) });
  view.put(layer.node, tools.hint);
  const facts = factsBox();
  const ways = share(library);
  const again = element("button.quiet.again", { type: "button", title: say("studio.again.help"), onclick: () => settings.change(Object.fromEntries(Object.keys(settings.now.value).map((name) => [name, undefined])), { step: "all" }) }, element("span.sign", { "aria-hidden": "true" }, "↺"), element("span", {}, say("studio.again")));
  const cards = underWay({ life, onMeasured: offer });
  const trouble = element("div.trouble");
  view.node.append(trouble);
  const place = element("section.studio-view", { "aria-label": say("studio.view") }, tools.node, view.node, time.node);
  const below = element("div.studio-about");
  // On a phone the picture stays in sight above the settings, so it has room for nothing else.
  const isWide = matchMedia("(min-width: 48rem)");
  const lay = () => (isWide.matches ? place : below).append(facts.node);
  isWide.addEventListener("change", lay, { signal: life });
  lay();
  setTitle(say("studio.title", { film: filmName(library) }));
  root.append(
    element("header.place-head", {}, element("div.studio-title", {}, element("h1", { tabIndex: -1 }, say("studio.title", { film: filmName(library) })), element("a", { href: `/libraries/${libraryId}` }, say("studio.desk"))),
      element("p.actions", {}, animals(libraries, libraryId, queryText), again, tools.acts)),
    unknown.length > 0 && element("p.advice-line", {}, say("studio.unknown", { names: unknown.join(", ") })) || "",
    cards,
    element("div.studio", {},
      place,
      element("section.studio-panel", { "aria-label": say("studio.panel") }, side.node, maker({ libraryId, settings: () => settings.now.value, life }).node, ways.node),
      below));

  const planner = createPlanner({
    libraryId, life, onBusy: view.setBusy,
    onPlan(plan, of) {
      planned = { plan, settings: of };
      trouble.replaceChildren();
      view.show(plan).catch((problem) => { if (!life.aborted) trouble.replaceChildren(problemBox(problem)); });
      time.setSpan(Math.max(plan.nFrames, plan.head.params.frames ?? 0), plan.fps);
      refresh();
      if (plan.isFirst) return;
      time.setSeries(plan.nIndividuals > 1 ? { name: say("facts.series"), values: orderOf(plan), most: 1 } : null);
      facts.update(plan);
    },
    onProblem: (problem) => {
      if (view.plan) view.show(view.plan).catch(() => {});
      trouble.replaceChildren(problemBox(problem, settings.canUndo ? [{ label: say("tool.undo"), act: settings.undo }] : [{ label: say("studio.again"), act: () => again.click() }]));
    },
  });
  function refresh() {
    side.update(settings.now.value, n());
    layer.draw();
    things.draw();
    tools.update(settings);
    ways.update(settings.now.value, location.origin + address());
    again.hidden = Object.keys(settings.now.value).length === 0;
  }
  settings.now.watch(() => {
    tellAddress();
    refresh();
    planner.ask(settings.now.value, settings.before);
  }, life);
  tool.watch(() => things.draw(), life);

  /** Goes to an animal that was measured meanwhile, or offers it to a person who has begun. @param {string} measured its library */
  async function offer(measured) {
    const there = `/libraries/${measured}/studio`;
    if (!id && !settings.canUndo && again.hidden) return go(there);
    const film = filmName(await thing("libraries", measured).catch(() => null));
    return cards.before(element("p.done", { role: "status" }, say("studio.measured", { film }), " ", element("a.button", { href: there }, say("film.studio"))));
  }
}

/** Fills the place when its animal is measured. @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
async function fill(root, visit) {
  const hadFocus = root.contains(document.activeElement);
  root.replaceChildren();
  await show(root, visit).catch((problem) => { if (!visit.life.aborted) showProblem(root, problem); });
  if (hadFocus) /** @type {HTMLElement | null} */ (root.querySelector("h1"))?.focus({ preventScroll: true });
}

/** The choice of the animal, if there are several. @param {Api.Library[]} libraries @param {string} libraryId @param {() => string} query */
function animals(libraries, libraryId, query) {
  const options = libraries.map((one) => element("option", { value: one.id, selected: one.id === libraryId }, filmName(one)));
  const choose = element("select.animals", { "aria-label": say("studio.animal"), onchange: () => go(`/libraries/${choose.value}/studio?${query()}`) }, ...options);
  choose.hidden = libraries.length < 2;
  return choose;
}
