// The panels beside the film: jumps, patches, path, zones, trust, size. Each is made when it is first shown.
// @ts-check
import { element } from "../app/element.js";
import { signal } from "../app/store.js";
import { percent, say } from "../app/words.js";
import { drawnCanvas, fitted, keptLayer, loadPicture } from "./canvas.js";
import { compass } from "./compass.js";
import { jumpTable } from "./jumps.js";
import { drawMarks } from "./marks.js";
import { createMatrix } from "./matrix.js";
import { patchPanel } from "./patches.js";
import { drawPath, nearestFrame } from "./path.js";
import { scalePanel } from "./scale.js";
import { weakest } from "./weakest.js";
import { zonesPanel } from "./zones.js";

const TABS = ["jumps", "patches", "pose", "zones", "trust", "size"];

/** @typedef {import("./player.js").Player} Player @typedef {import("./shots.js").Shoot} Shoot */

/**
 * @param {import("./instrument.js").Instrument} desk
 * @param {{player: Player, pictures: import("./pictures.js").Pictures, shoot: Shoot, tab: string, remeasure: (tool?: string) => void}} parts
 */
export function createPanels(desk, { player, pictures, shoot, tab, remeasure }) {
  const chosen = signal(TABS.includes(tab) ? tab : TABS[0]);
  /** @type {Record<string, () => HTMLElement>} */
  const make = {
    jumps: () => element("div.panel-jumps", {}, createMatrix(desk, { player, pictures }), element("details", {}, element("summary", {}, say("desk.jumps.best")), jumpTable(desk, player))),
    patches: () => patchPanel(desk, { player, pictures, chosen }),
    pose: () => pathPanel(desk, player),
    zones: () => zonesPanel(desk),
    trust: () => trustPanel(desk, { player, shoot, remeasure }),
    size: () => scalePanel(desk, player),
  };
  const panels = TABS.map((name) => element(`div.panel#panel-${name}`, { role: "tabpanel", tabIndex: -1, "aria-labelledby": `tab-${name}`, hidden: true }));
  const tabs = TABS.map((name) => element(`button.tab#tab-${name}`, { type: "button", role: "tab", "aria-controls": `panel-${name}`, onclick: () => chosen.set(name) }, say(`desk.tab.${name}`)));
  const list = element("div.tabs", { role: "tablist", "aria-label": say("desk.tabs") }, ...tabs);
  list.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    const next = (TABS.indexOf(chosen.value) + by + TABS.length) % TABS.length;
    chosen.set(TABS[next]);
    tabs[next].focus();
  });
  chosen.watch((now) => TABS.forEach((name, k) => {
    const isChosen = name === now;
    tabs[k].setAttribute("aria-selected", String(isChosen));
    tabs[k].tabIndex = isChosen ? 0 : -1;
    panels[k].hidden = !isChosen;
    if (isChosen && !panels[k].childElementCount) panels[k].append(make[name]());
  }), desk.life);
  return { node: element("div.panels", {}, list, ...panels), chosen };
}

/** The path over the background, and the compass. @param {import("./instrument.js").Instrument} desk @param {Player} player */
function pathPanel(desk, player) {
  const { library, life, moment, columns, facts } = desk;
  const size = library.image_size_px;
  /** @type {ImageBitmap | null} */
  let background = null;
  // Only the marks change with the moment.
  const layer = keptLayer();
  const { canvas, ask } = drawnCanvas(life, (paper) => {
    const { context, width, height, colors } = paper;
    const { zoom, left, top } = fitted(size, width, height);
    layer(paper, [columns.value.n, Boolean(background), colors.accent].join(" "), (under) => {
      under.translate(left, top);
      under.scale(zoom, zoom);
      if (background) under.drawImage(background, 0, 0, size[0], size[1]);
      drawPath(under, columns.value, { zoom, colors });
    });
    context.translate(left, top);
    context.scale(zoom, zoom);
    drawMarks(context, columns.value, moment.value, { zoom, colors, isMoving: false });
  }, { className: "path", "aria-label": say("desk.path.label") });
  canvas.style.aspectRatio = size.join(" / ");
  canvas.addEventListener("click", (event) => {
    const box = canvas.getBoundingClientRect();
    const { zoom, left, top } = fitted(size, box.width, box.height);
    player.pause();
    desk.goTo(nearestFrame(columns.value, [(event.clientX - box.left - left) / zoom, (event.clientY - box.top - top) / zoom], moment.value));
  }, { signal: life });
  for (const seen of [moment, columns]) seen.watch(ask, life);
  void loadPicture(`/v1/libraries/${library.id}/background.png`, life).then((found) => { background = found; ask(); });
  const compassBox = element("div");
  facts.watch((now) => { if (now?.stats.heading_histogram) compassBox.replaceChildren(compass(now.stats.heading_histogram)); }, life);
  return element("div.panel-pose", {}, element("div.path-box", {}, canvas), element("p.path-key", {}, element("span", {}, say("desk.path.start")), element("i"), element("span", {}, say("desk.path.end")), element("span.soft", {}, say("desk.path.help"))), compassBox);
}

/** Where the measurement is sure, and the moments to look at. @param {import("./instrument.js").Instrument} desk @param {{player: Player, shoot: Shoot, remeasure: (tool?: string) => void}} parts */
function trustPanel(desk, { player, shoot, remeasure }) {
  const node = element("div.panel-trust", {}, element("p.soft", {}, say("desk.reading.wait")));
  const fill = () => {
    if (!desk.isLoaded.value) return;
    const { shares, moments } = weakest(desk.columns.value, { from: desk.first, to: desk.last() + 1 });
    const bars = Object.entries(shares).map(([name, share]) => element("li", {}, element("strong", {}, percent(share)), " ", say(`desk.trust.${name}`)));
    const rows = moments.map(({ frame, why, value }) => {
      const words = say("desk.trust.moment", { time: desk.timeOf(frame).toFixed(2), why: say(`desk.trust.why.${why}`, { share: percent(value) }) });
      // Where the animal is lost, the picture shows the surroundings of its last place.
      const around_px = [...desk.columns.value.box_px.subarray(4 * (why === "lost" ? frame - 1 : frame)).slice(0, 4)];
      return element("li", {}, element("button.quiet", { type: "button", onclick: () => { player.pause(); desk.goTo(frame); } }, shoot({ frame, label: words, hasMarks: true, around_px }), element("span", {}, words)));
    });
    node.replaceChildren(...[element("ul.shares", {}, ...bars), element("h3", {}, say("desk.trust.look")), moments.length ? element("ul.weak", {}, ...rows) : element("p.soft", {}, say("desk.trust.fine")),
      moments.length > 0 && element("p.actions", {}, ...["head", "animal"].map((tool) => element("button.quiet", { type: "button", onclick: () => remeasure(tool === "head" ? "head" : "animal_at") }, say(`desk.trust.${tool}_at`)))) || ""]);
  };
  desk.isLoaded.watch(fill, desk.life);
  return node;
}
