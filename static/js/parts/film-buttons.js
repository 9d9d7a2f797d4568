// What a person does with the finished film of a flock: download it, or send a link to it.
// @ts-check
import { post } from "../app/api.js";
import { element } from "../app/element.js";
import { thing } from "../app/names.js";
import { say } from "../app/words.js";
import { filmFileOf, sharedFilesOf } from "../reel/settings.js";
import { pathOf } from "../reel/shared-link.js";
import { copyButton } from "./copy.js";
import { problemBox } from "./problem.js";

/** How long a copied link works, s: a week, the most that the service allows. */
const LASTING_S = 604_800;
/** Whether the page is open on the computer of the service. Then, links begin with an address that no other computer knows. */
export const isHere = () => /^(localhost|127\.|\[::1\])/.test(location.hostname);

/**
 * Makes a link to the page with the film of a flock.
 * @param {Api.Flock} flock @param {number} expires_s @param {AbortSignal} [life] @returns {Promise<{url: string, expires_at: string}>}
 */
export async function linkTo(flock, expires_s, life) {
  const files = sharedFilesOf(flock);
  const links = await Promise.all(files.map((file) => post(`/v1/flocks/${flock.id}/links`, { file, expires_s }, life)));
  return { url: location.origin + pathOf(flock.id, files.map((name, k) => ({ name, url: links[k].url }))), expires_at: links[0].expires_at };
}

/**
 * Returns the buttons, and the place in which they tell what they did.
 * @param {string} flockId @param {{isTold?: boolean}} [options] @returns {HTMLElement[]}
 */
export function filmButtons(flockId, options) {
  const save = element("a.button.quiet", { href: `/v1/flocks/${flockId}/video.mp4`, download: "", onclick: async (/** @type {MouseEvent} */ event) => {
    event.preventDefault();
    // A transparent flock is saved as the film that is transparent.
    const name = await thing("flocks", flockId).then(filmFileOf, () => "video.mp4");
    element("a", { href: `/v1/flocks/${flockId}/${name}`, download: "" }).click();
  } }, say("job.download"));
  return [save, ...linkButton(flockId, options)];
}

/**
 * Returns the button that copies a link, and the place in which it tells more.
 * @param {string} flockId @param {{isTold?: boolean}} [options] `isTold` tells from the start how the link works, so that a click moves nothing
 * @returns {HTMLElement[]}
 */
export function linkButton(flockId, { isTold = false } = {}) {
  const told = element("span.copied", { role: "status" });
  const tell = () => told.replaceChildren([say("link.lasts"), isHere() && say("reel.share.here", { host: location.host })].filter(Boolean).join(" "));
  if (isTold) tell();
  const button = copyButton(say("link.copy"), async () => (await linkTo(await thing("flocks", flockId), LASTING_S)).url, {
    onCopied: tell,
    onRefused(url) {
      const field = element("input", { readOnly: true, value: url, "aria-label": say("link.copy") });
      told.replaceChildren(say("link.refused"), field);
      field.select();
    },
    onProblem: (problem) => told.replaceChildren(problemBox(problem)),
  });
  return [button, told];
}
