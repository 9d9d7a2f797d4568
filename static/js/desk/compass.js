// The compass of headings: how many playable frames head each way. A sector without frames is marked, because a
// flock cannot head there.
// @ts-check
import { element, svg } from "../app/element.js";
import { direction, percent, say } from "../app/words.js";
import { gapsOf } from "./gaps.js";

/** Radius of the compass and of the smallest petal; side of the picture. */
const [RADIUS, HOLE, SIDE] = [88, 14, 240];
/** Returns the picture of headings and its words. @param {number[]} bins of 10 degrees from -180 */
export function compass(bins) {
  const sum = bins.reduce((a, b) => a + b, 0) || 1;
  const sides = sidesOf(bins).map(([name, count]) => element("li", {}, say("desk.compass.share", { direction: say(`direction.${name}`), share: percent(count / sum) })));
  return element("figure.compass-box", {}, compassPicture(bins), element("figcaption", {}, element("p", {}, compassWords(bins)), element("ul", {}, ...sides)));
}

/**
 * Returns the picture of headings. @param {number[]} bins of 10 degrees from -180
 * @param {number[][]} [sectors] sectors that are marked instead of those without frames: middle and half width, degrees
 */
export function compassPicture(bins, sectors) {
  const n = bins.length;
  const most = Math.max(1, ...bins);
  const angle = (/** @type {number} */ bin) => ((bin / n) * 2 - 1) * Math.PI;
  const point = (/** @type {number} */ bin, /** @type {number} */ radius) => `${(radius * Math.cos(angle(bin))).toFixed(2)} ${(radius * Math.sin(angle(bin))).toFixed(2)}`;
  const sector = (/** @type {number} */ from, /** @type {number} */ to, /** @type {number} */ radius) => {
    const wide = to - from > n / 2 ? 1 : 0;
    return `M${point(from, HOLE)}L${point(from, radius)}A${radius} ${radius} 0 ${wide} 1 ${point(to, radius)}L${point(to, HOLE)}A${HOLE} ${HOLE} 0 ${wide} 0 ${point(from, HOLE)}Z`;
  };
  // The area of a petal, not its length, shows the share.
  const reach = (/** @type {number} */ count) => HOLE + (RADIUS - HOLE) * Math.sqrt(count / most);
  const gaps = sectors ? sectors.map(([middle, half]) => [((middle - half + 180) / 360) * n, (half / 180) * n]) : gapsOf(bins);
  const words = [["right", RADIUS + 6, 4, "start"], ["down", 0, RADIUS + 17, "middle"], ["left", -RADIUS - 6, 4, "end"], ["up", 0, -RADIUS - 8, "middle"]];
  return svg("svg", { class: "compass", viewBox: `${-SIDE / 2 - 20} ${-SIDE / 2} ${SIDE + 40} ${SIDE}`, role: "img", "aria-label": compassWords(bins) },
    ...[0.5, 1].map((share) => svg("circle", { class: "ring", r: HOLE + (RADIUS - HOLE) * Math.sqrt(share) })),
    ...gaps.map(([first, length]) => svg("path", { class: "missing", d: sector(first, first + Math.min(length, n - 0.01), RADIUS) })),
    ...bins.map((count, k) => svg("path", { class: "petal", d: count ? sector(k + 0.06, k + 0.94, reach(count)) : "" })),
    ...words.map(([name, x, y, anchor]) => { const text = svg("text", { x, y, "text-anchor": anchor }); text.textContent = say(`direction.${name}`); return text; }));
}

/** Returns the frames of the four sides, each 90 degrees wide. @param {number[]} bins @returns {[string, number][]} */
function sidesOf(bins) {
  /** @type {Record<string, number>} */
  const sides = { right: 0, down: 0, left: 0, up: 0 };
  bins.forEach((count, k) => {
    const degrees = ((k + 0.5) / bins.length) * 360 - 180;
    sides[Math.abs(degrees) < 45 ? "right" : Math.abs(degrees) > 135 ? "left" : degrees > 0 ? "down" : "up"] += count;
  });
  return Object.entries(sides);
}

/** Returns what the compass shows as a sentence. @param {number[]} bins */
function compassWords(bins) {
  const gaps = gapsOf(bins).sort((a, b) => b[1] - a[1]);
  if (!gaps.length) return say("desk.compass.whole");
  const [first, length] = gaps[0];
  const middle_rad = ((first + length / 2) / bins.length) * 2 * Math.PI - Math.PI;
  return say("desk.compass.missing", { direction: direction(middle_rad), n: Math.round((length / bins.length) * 360) });
}
