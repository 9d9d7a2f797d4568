// Patches: runs of frames between jumps, as the second paper draws them. Its figure 7.1, the heading of each patch over
// time, and the sentence "from a to b, d, f" are buttons that walk from patch to patch; figure 7.2 is in patch-map.js.
// @ts-check
import { element, svg } from "../app/element.js";
import { count, heading, say } from "../app/words.js";
import { createMap } from "./patch-map.js";
import { leapsFrom, longestPatches, patchAt } from "./patch-graph.js";

/** Ways on that are shown, longest patches that are shown, side of a picture, and time until cards follow the moment, ms. */
const [MOST, LONGEST, SIDE, FOLLOW_MS] = [8, 8, 128, 120];
/** Size of a curve. */
const [WIDE, TALL] = [96, 48];

/**
 * @param {import("./instrument.js").Instrument} desk
 * @param {{player: import("./player.js").Player, pictures: import("./pictures.js").Pictures, chosen: import("../app/store.js").Signal<string>}} parts
 */
export function patchPanel(desk, { player, pictures, chosen }) {
  const { moment, facts, life } = desk;
  const now = element("p.patch-now");
  const ways = element("ul.patch-ways");
  const waysOn = element("section", { hidden: true }, element("h3", {}, say("desk.patch.ways")), ways);
  const longest = element("ul.patch-ways");
  let current = -1;
  const map = createMap(desk, { player });
  const none = element("p.soft", { hidden: true }, say("desk.patch.none"));

  let timer = 0;
  const later = () => { clearTimeout(timer); timer = setTimeout(fill, FOLLOW_MS); };
  const tell = () => {
    const found = facts.value;
    if (!found || !desk.isLoaded.value) return;
    none.hidden = found.patches.start.length > 0;
    const k = patchAt(found.patches, moment.value);
    now.textContent = k < 0 ? say("desk.patch.outside") : patchWords(k);
    current = k;
    later();
  };
  const patches = () => /** @type {import("./instrument.js").Facts} */ (facts.value).patches;
  const timed = (/** @type {number} */ frame) => desk.timeOf(frame).toFixed(2);
  const patchWords = (/** @type {number} */ k) => {
    const { start, end } = patches();
    return say("desk.patch.is", { id: String(k), from: timed(start[k]), to: timed(end[k] - 1), n: end[k] - start[k] });
  };
  const walk = (/** @type {number} */ frame) => () => { player.pause(); desk.goTo(frame); };

  /**
   * Returns the button of one patch. @param {number} k
   * @param {{way: "next" | "jump" | "listed", mirrored?: boolean, act: () => void}} options way: how it is reached from the moment
   */
  function patchButton(k, { way, mirrored = false, act }) {
    const { start, end } = patches();
    const picture = element("canvas", { width: SIDE, height: SIDE, "aria-hidden": "true" });
    const kind = way === "next" ? say("desk.patch.on") : say(mirrored ? "desk.jumps.mirrored" : "desk.jumps.plain");
    const words = element("span", {}, element("strong", {}, say("desk.patch.name", { id: String(k) })), " ", element("small", {}, say("desk.patch.when", { time: timed(start[k]), n: end[k] - start[k] })), way !== "listed" && element("small.kind", {}, kind));
    const node = element("li", { className: mirrored ? "mirrored" : way === "next" ? "goes-on" : "" }, element("button.quiet", { type: "button", onclick: act }, picture, curveOf(desk.columns.value, start[k], end[k], mirrored), words));
    return { node, wish: { frame: start[k], canvas: picture, mirrored } };
  }

  /** @type {string} */
  let drawn = "";
  const fill = () => {
    const found = facts.value;
    const k = current;
    if (!found || !desk.isLoaded.value || chosen.value !== "patches" || life.aborted) return;
    const { patches: { start, end }, leaps } = found;
    if (drawn === String(k)) return;
    drawn = String(k);
    const isAfter = k >= 0 && start[k + 1] === end[k];
    const on = k < 0 ? [] : leapsFrom(leaps, end[k] - 1);
    const buttons = [
      ...(isAfter ? [patchButton(k + 1, { way: "next", act: walk(start[k + 1]) })] : []),
      ...on.slice(0, MOST).flatMap(({ from, to, mirrored }) => {
        const target = patchAt(found.patches, to);
        return target < 0 ? [] : [patchButton(target, { way: "jump", mirrored, act: () => player.playJump({ from, to, mirrored }) })];
      })];
    const hadFocus = ways.contains(document.activeElement);
    waysOn.hidden = !buttons.length;
    ways.replaceChildren(...buttons.map(({ node }) => node));
    if (hadFocus) ways.querySelector("button")?.focus({ preventScroll: true });
    const best = longest.childElementCount ? [] : longestPatches(found.patches, LONGEST).map((one) => patchButton(one, { way: "listed", act: walk(start[one]) }));
    if (best.length) longest.replaceChildren(...best.map(({ node }) => node));
    void pictures.loaded.then(() => pictures.fill([...buttons, ...best].map(({ wish }) => wish)));
  };
  for (const seen of [moment, facts, desk.isLoaded]) seen.watch(tell, life);
  chosen.watch((name) => { if (name === "patches") { later(); map.ask(); } }, life);
  life.addEventListener("abort", () => clearTimeout(timer));
  return element("div.panel-patches", {}, element("p.soft", {}, say("desk.patch.help")), none, now,
    waysOn,
    element("section", {}, element("h3", {}, say("desk.patch.map")), map.node),
    element("section", {}, element("h3", {}, say("desk.patch.longest")), longest));
}

/** Returns the heading of a patch over its time, as in figure 7.1; a mirrored patch is drawn mirrored. @param {import("./columns.js").Columns} columns @param {number} from @param {number} to @param {boolean} mirrored */
function curveOf({ heading_rad }, from, to, mirrored) {
  const xOf = (/** @type {number} */ k) => (to - from < 2 ? WIDE / 2 : 3 + ((k - from) / (to - from - 1)) * (WIDE - 6));
  let path = "";
  let last = NaN;
  for (let k = from; k < to; k++) {
    const value = mirrored ? Math.atan2(Math.sin(heading_rad[k]), -Math.cos(heading_rad[k])) : heading_rad[k];
    if (!Number.isFinite(value)) { last = NaN; continue; }
    const y = TALL / 2 + (value / Math.PI) * (TALL / 2 - 3);
    path += `${Number.isNaN(last) || Math.abs(value - last) > Math.PI ? "M" : "L"}${xOf(k).toFixed(1)} ${y.toFixed(1)}`;
    if (to - from < 2) path += "h0.1";
    last = value;
  }
  const known = [...heading_rad.subarray(from, to)].filter((rad) => !Number.isNaN(rad));
  const words = known.length ? say("desk.patch.turns", { from: heading(known[0]), to: heading(known[known.length - 1]) }) : say("desk.no_heading");
  return svg("svg", { class: "curve", preserveAspectRatio: "none", viewBox: `0 0 ${WIDE} ${TALL}`, role: "img", "aria-label": words }, svg("path", { class: "zero", d: `M0 ${TALL / 2}H${WIDE}` }), svg("path", { class: "line", d: path }));
}
