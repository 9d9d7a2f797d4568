// The same flock elsewhere: as a link, with curl, on the command line, in Python.
// @ts-check
import { isSignedIn } from "../app/api.js";
import { element } from "../app/element.js";
import { say } from "../app/words.js";
import { copyButton } from "../parts/copy.js";
import { analysisDefaults } from "./schema.js";
import { waysOf } from "./ways.js";

/** @param {import("./ways.js").Library} library */
export function share(library) {
  /** What is shown now. @type {{settings: import("./settings.js").Settings, link: string} | null} */
  let shown = null;
  /** @type {Api.AnalysisParams | undefined} */
  let defaults;
  analysisDefaults().then((known) => { defaults = known; if (shown) update(shown.settings, shown.link); }).catch(() => {});
  const rows = ["link", "curl", "command", "python"].map((name) => {
    const text = element("pre", { tabIndex: 0 });
    const copy = copyTextOf(text, say("share.copy"));
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
  return { node, update };
}

/** Returns a button that copies the text of an element; where the browser refuses, the text is selected. @param {HTMLElement} node @param {string} label */
export const copyTextOf = (node, label) => copyButton(label, () => node.textContent ?? "", { onRefused: () => getSelection()?.selectAllChildren(node) });
