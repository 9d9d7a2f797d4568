// Signed addresses of files, and of a page with the film: whoever has one needs no token until it expires.
// @ts-check
import { post } from "../app/api.js";
import { element } from "../app/element.js";
import { day, say, sayOr } from "../app/words.js";
import { isHere, linkTo } from "../parts/film-buttons.js";
import { problemBox } from "../parts/problem.js";
import { copyTextOf } from "../studio/share.js";
import { filesOf } from "./settings.js";

/** How long a link works, s. The service allows a minute to a week. */
const LIVES_S = { hour: 3600, day: 86_400, week: 604_800 };
/** The choice of a page, among names of files. */
const PAGE = "page";

/** @param {Api.Flock} flock @param {AbortSignal} life */
export function linkMaker(flock, life) {
  const file = element("select", {}, element("option", { value: PAGE }, say("reel.link.page")), ...filesOf(flock).map((name) => element("option", { value: name }, [name, sayOr(`reel.file.${name}`, "")].filter(Boolean).join(": "))));
  const lasting = element("select", {}, ...Object.keys(LIVES_S).map((name) => element("option", { value: name, selected: name === "week" }, say(`reel.link.${name}`))));
  const button = element("button", { type: "submit" }, say("reel.link.make"));
  const made = element("ul.links", { "aria-live": "polite" });
  const trouble = element("div");

  async function make(/** @type {SubmitEvent} */ event) {
    event.preventDefault();
    button.disabled = true;
    try {
      const expires_s = /** @type {Record<string, number>} */ (LIVES_S)[lasting.value];
      const name = file.value;
      const link = name === PAGE ? await linkTo(flock, expires_s, life) : await signed(name, expires_s);
      trouble.replaceChildren();
      made.prepend(row(name === PAGE ? say("reel.link.page") : name, link));
    } catch (problem) {
      if (!life.aborted) trouble.replaceChildren(problemBox(problem));
    }
    button.disabled = false;
  }

  async function signed(/** @type {string} */ name, /** @type {number} */ expires_s) {
    const { url, expires_at } = await post(`/v1/flocks/${flock.id}/links`, { file: name, expires_s }, life);
    return { url: location.origin + url, expires_at };
  }

  return element("section", {}, element("h2", {}, say("reel.share")), element("p.soft", {}, say("reel.share.help"), isHere() && ` ${say("reel.share.here", { host: location.host })}`),
    element("form.link-form", { onsubmit: make }, element("label.field", {}, say("reel.link.file"), file), element("label.field", {}, say("reel.link.lasting"), lasting), button), trouble, made);
}

/** @param {string} name @param {{url: string, expires_at: string}} link */
function row(name, { url, expires_at }) {
  const text = element("pre", { tabIndex: 0 }, url);
  const copy = copyTextOf(text, say("share.copy"));
  copy.setAttribute("aria-label", say("share.copy.of", { name }));
  return element("li", {}, element("div.way-head", {}, element("span", {}, element("strong", {}, name), " ", element("small", {}, say("reel.link.until", { time: day(expires_at) }))), copy), text, qrCode(url));
}

/** Returns a part that opens and shows a link as a QR code. @param {string} url */
function qrCode(url) {
  const open = async () => {
    if (!node.open || node.childElementCount > 1) return;
    const { qrOf, qrPicture } = await import("./qr.js");
    const rows = qrOf(url);
    node.append(rows ? qrPicture(rows, say("reel.link.qr")) : say("reel.link.qr.none"));
  };
  const node = element("details", { ontoggle: () => open().catch(() => { node.open = false; }) }, element("summary", {}, say("reel.link.qr")));
  return node;
}
