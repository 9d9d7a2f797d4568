// The files of a library in a table: name, use, size. The views have a state while they are made.
// @ts-check
import { element } from "../app/element.js";
import { VIEWS, watchViews } from "../app/names.js";
import { sayOr, say, size } from "../app/words.js";

/** Files that follow from the poses and the scale. The service computes them when they are asked for, so it does not list them. */
const COMPUTED = ["summary.csv", "motion.csv", "motion.json"];
/** Files of every library, in the order of use. The service may tell more. */
const FILES = [...COMPUTED, "poses.csv", "poses.json", "library.json", "overlay.mp4", "film.mp4", "sprites.zip", "mattes.zip", "distance.npy", "distance.png", "background.png", "headings.svg", "trajectory.svg", "confidence.svg", "transitions.svg"];

/** @param {Api.Library} library @param {AbortSignal} life */
export function downloadTable(library, life) {
  /** @type {{name: string, size_bytes?: number}[]} */
  const told = library.files ? [...[...COMPUTED, ...VIEWS.filter((name) => !library.files?.some((file) => file.name === name))].map((name) => ({ name })), ...library.files] : FILES.map((name) => ({ name }));
  const hasSizes = told.some(({ size_bytes }) => size_bytes !== undefined);
  const place = (/** @type {string} */ name) => { const idx = FILES.indexOf(name); return idx < 0 ? FILES.length : idx; };
  const rows = [...told].sort((a, b) => place(a.name) - place(b.name)).map(({ name, size_bytes }) => element("tr", {},
    element("th", { scope: "row" }, fileLink(library, name, life)),
    element("td", {}, sayOr(`desk.file.${name}`, "")),
    hasSizes && element("td.size", {}, size_bytes === undefined ? "" : size(size_bytes))));
  const heads = ["name", "use", ...(hasSizes ? ["size"] : [])].map((name) => element("th", { scope: "col" }, say(`desk.files.${name}`)));
  return element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("desk.files") }, element("table.files", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...rows)));
}

/** Returns the link to a file. Without a file of the views, it is their state. @param {Api.Library} library @param {string} name @param {AbortSignal} life */
function fileLink(library, name, life) {
  const link = element("a", { href: `/v1/libraries/${library.id}/${encodeURIComponent(name)}`, download: "" }, name);
  if (!VIEWS.includes(name)) return link;
  const node = element("span.file-name");
  watchViews(library, life, (state) => {
    if (state === "done") node.replaceChildren(link);
    else node.replaceChildren(`${name} · ${say(`views.${state}.short`)}`);
  });
  return node;
}
