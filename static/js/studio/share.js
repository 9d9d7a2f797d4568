// The same flock elsewhere: as a link, with curl, on the command line, in Python.
// @ts-check
import { isSignedIn } from "../app/api.js";
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { analysisDefaults } from "./schema.js";
import { waysOf } from "./ways.js";

/** @param {import("./ways.js").Library} library */
export function share(library) {
  /** What is shown now. @type {{settings: import("./settings.js").Settings, link: string} | null} */
  let shown = null;
  /** @type {any} */
  let defaults;
  analysisDefaults().then((known) => { defaults = known; if (shown) update(shown.settings, shown.link); }).catch(() => {});
  const rows = ["link", "curl", "command", "python"].map((name) => {
    const text = element("pre", { tabIndex: 0 });
    const copy = copyButton(say("share.copy"), text);
    copy.setAttribute("aria-label", say("share.copy.of", { name: say(`share.${name}`) }));
    return { name, text, node: element("div.way", {}, element("div.way-head", {}, element("strong", {}, say(`share.${name}`)), copy), text) };
  });
  const node = element("details.group#group-share", {}, element("summary", {}, say("share.title")), element("p.soft", {}, say("share.help")), ...rows.map((row) => row.node));

  /** @param {import("./settings.js").Settings} settings @param {string} link */
  function update(settings, link) {
    shown = { settings, link };
    const ways = /** @type {Record<string, string>} */ (waysOf(library, settings, { link, origin: location.origin, needsToken: isSignedIn(), defaults }));
    for (const { name, text } of rows) text.textContent = ways[name];
  }
  return { node, update, button: copyButton(say("share.copy_link"), rows[0].text, () => { node.open = true; }) };
}

/** A button that copies a text; without access to the clipboard the text is selected. @param {string} label @param {HTMLElement} text @param {() => void} [reveal] */
export function copyButton(label, text, reveal = () => {}) {
  const button = element("button.quiet", { type: "button", onclick: async () => {
    const copied = await navigator.clipboard?.writeText(text.textContent ?? "").then(() => true, () => false) ?? false;
    if (!copied) { reveal(); getSelection()?.selectAllChildren(text); }
    button.textContent = say(copied ? "share.copied" : "share.select");
    setTimeout(() => { button.textContent = label; }, 2000);
  } }, label);
  return button;
}
