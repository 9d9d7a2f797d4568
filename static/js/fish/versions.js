// The virtual fish of a film: every one that was made, with its files.
// @ts-check
import { list, request } from "../app/api.js";
import { element } from "../app/element.js";
import { filmName } from "../app/names.js";
import { ago, day, say, size } from "../app/words.js";
import { choiceOf } from "../studio/control.js";
import { deleted, deleteLater } from "../parts/undo.js";
import { savedName } from "./settings.js";

/** Time in which the browser begins to save a file, ms. */
const KEPT_MS = 60_000;

/** Returns the virtual fish of a library, newest first. @param {string} libraryId @param {AbortSignal} life */
export async function fishOf(libraryId, life) {
  /** @type {Api.Fish[]} */
  const found = [];
  let address = /** @type {Api.Next<"/v1/fish">} */ (`/v1/fish?library_id=${encodeURIComponent(libraryId)}&limit=200`);
  while (address) {
    const { items, next } = await list(address, life);
    found.push(...items.filter((one) => !deleted.value.has(one.id)));
    address = next;
  }
  return found;
}

/**
 * Saves a file under a name that tells this fish from others of its film. The service's name has only the film.
 * @param {MouseEvent} event @param {string} href @param {string} download
 */
async function save(event, href, download) {
  if (event.ctrlKey || event.metaKey || event.shiftKey || event.altKey) return;
  event.preventDefault();
  try {
    const url = URL.createObjectURL(await (await request("GET", href)).blob());
    element("a", { href: url, download }).click();
    setTimeout(() => URL.revokeObjectURL(url), KEPT_MS);
  } catch {
    location.assign(href);
  }
}

/** Returns what a virtual fish is, in a few words. @param {Api.Fish} fish */
const fishName = ({ params }) => [params.body === "own" ? choiceOf("body", "own") : choiceOf("palette", params.palette ?? ""), params.swim === false && say("fish.rigid"), params.bank_rad === 0 && say("fish.upright")].filter(Boolean).join(", ");

/**
 * Returns the table of the fish of a film with their downloads.
 * @param {Api.Fish[]} all @param {{library: Api.Library, shown: string, life: AbortSignal, onDelete: (id: string) => void}} options
 */
export function versionTable(all, { library, shown, life, onDelete }) {
  const film = filmName(library);
  const file = (/** @type {Api.Fish} */ fish, /** @type {string} */ name) => {
    const ending = name.split(".")[1];
    const [href, download] = [`/v1/fish/${fish.id}/${name}`, savedName(film, fish.params, ending)];
    return element("a.file-link", { href, download, onclick: (/** @type {MouseEvent} */ event) => save(event, href, download) }, say(`fish.file.${ending}`));
  };
  const rows = all.map((fish) => {
    const name = fishName(fish);
    const drop = element("button.quiet", { type: "button", "aria-label": say("fish.delete.of", { name }), onclick: () => {
      const undo = deleteLater({ id: fish.id, path: `/v1/fish/${fish.id}`, name });
      onDelete(fish.id);
      undo.focus();
    } }, say("reel.delete"));
    const here = fish.id === shown;
    const node = element("tr", here ? { "aria-current": "true" } : {},
      element("th", { scope: "row" }, here ? name : element("a", { href: `/libraries/${library.id}/fish?fish=${fish.id}` }, name), element("small", { title: day(fish.created_at) }, ` ${here ? say("fish.shown") : ago(fish.created_at)}`)),
      element("td", {}, file(fish, "model.glb")), element("td", {}, file(fish, "video.mp4")), element("td.size", {}, size(fish.size_bytes)), element("td", {}, drop));
    deleted.watch((gone) => { node.hidden = gone.has(fish.id); }, life);
    return node;
  });
  const heads = ["which", "model", "film", "size", "delete"].map((name) => element("th", { scope: "col" }, name === "delete" ? element("span.unseen", {}, say("reel.delete")) : say(`fish.table.${name}`)));
  return element("section", {}, element("h2", {}, say("fish.files")), element("p.soft", {}, say("fish.files.help")),
    element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("fish.files") }, element("table.files", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...rows))));
}
