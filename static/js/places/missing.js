// The place of addresses that do not exist.
// @ts-check
import { element } from "../app/element.js";
import { setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { noPicture } from "../parts/cards.js";

/** @param {HTMLElement} root */
export function show(root) {
  setTitle(say("missing.title"));
  root.append(element("section.lost", {}, noPicture(), element("h1", { tabIndex: -1 }, say("missing.title")), element("p", {}, say("missing.text")),
    element("p.actions", {}, element("a.button", { href: "/" }, say("missing.home")), element("a.button.quiet", { href: "/films" }, say("nav.films")))));
}
