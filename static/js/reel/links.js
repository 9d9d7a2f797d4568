// Signed addresses of files, and of a page with the film: whoever has one needs no token until it expires.
// @ts-check
import { post } from "../app/api.js";
import { element } from "../app/element.js";
import { day, say } from "../app/words.js";
import { problemBox } from "../parts/problem.js";
import { copyButton } from "../studio/share.js";
import { filesOf } from "./settings.js";
import { pathOf, SHARED } from "./shared-link.js";

/** How long a link works, s. The service allows a minute to a week. */
const LIVES_S = { hour: 3600, day: 86_400, week: 604_800 };
/** The choice of a page, among names of files. */
const PAGE = "page";

/** @param {any} flock @param {AbortSignal} life */
export function linkMaker(flock, life) {
  const file = element("select", {}, element("option", { value: PAGE }, say("reel.link.page")), ...filesOf(flock).map((name) => element("option", { value: name }, name)));
  const lasting = element("select", {}, ...Object.keys(LIVES_S).map((name) => element("option", { value: name, selected: name === "day" }, say(`reel.link.${name}`))));
  const button = element("button", { type: "submit" }, say("reel.link.make"));
  const made = element("ul.links", { "aria-live": "polite" });
  const trouble = element("div");

  async function make(/** @type {SubmitEvent} */ event) {
    event.preventDefault();
    button.disabled = true;
    try {
      const expires_s = /** @type {Record<string, number>} */ (LIVES_S)[lasting.value];
      const sign = (/** @type {string} */ name) => post(`/v1/flocks/${flock.id}/links`, { file: name, expires_s }, life);
      const links = await Promise.all((file.value === PAGE ? SHARED : [file.value]).map(sign));
      trouble.replaceChildren();
      made.prepend(file.value === PAGE ? row(say("reel.link.page"), { url: pathOf(flock.id, links), expires_at: links[0].expires_at }) : row(file.value, links[0]));
    } catch (problem) {
      if (!life.aborted) trouble.replaceChildren(problemBox(problem));
    }
    button.disabled = false;
  }

  const isHere = /^(localhost|127\.|\[::1\])/.test(location.hostname);
  return element("section", {}, element("h2", {}, say("reel.share")), element("p.soft", {}, say("reel.share.help"), isHere && ` ${say("reel.share.here", { host: location.host })}`),
    element("form.link-form", { onsubmit: make }, element("label.field", {}, say("reel.link.file"), file), element("label.field", {}, say("reel.link.lasting"), lasting), button), trouble, made);
}

/** @param {string} name @param {{url: string, expires_at: string}} link */
function row(name, { url, expires_at }) {
  const text = element("pre", { tabIndex: 0 }, location.origin + url);
  const copy = copyButton(say("share.copy"), text);
  copy.setAttribute("aria-label", say("share.copy.of", { name }));
  return element("li", {}, element("div.way-head", {}, element("span", {}, element("strong", {}, name), " ", element("small", {}, say("reel.link.until", { time: day(expires_at) }))), copy), text);
}
