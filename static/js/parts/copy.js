// Buttons that copy a text with one click.
// @ts-check
import { element } from "../app/element.js";
import { say } from "../app/words.js";

/** Time for which a button says that it has copied, ms. */
const TOLD_MS = 4000;

/**
 * Returns a button that copies a text, which may take a request to get.
 * @param {string} label @param {() => string | Promise<string>} textOf
 * @param {{onCopied?: (text: string) => void, onRefused: (text: string) => void, onProblem?: (problem: unknown) => void}} acts
 *   onRefused: the browser does not let the page copy, so the person must
 */
export function copyButton(label, textOf, { onCopied = () => {}, onRefused, onProblem = () => {} }) {
  let [timer, isBusy] = [0, false];
  const button = element("button.quiet", { type: "button", onclick: async () => {
    if (isBusy) return;
    isBusy = true;
    try {
      const coming = Promise.resolve(textOf());
      const isCopied = await copy(coming);
      const text = await coming;
      if (isCopied) onCopied(text); else onRefused(text);
      // The shorter word must not move what stands beside the button.
      button.style.minInlineSize = `${button.offsetWidth}px`;
      button.textContent = say(isCopied ? "share.copied" : "share.select");
      clearTimeout(timer);
      timer = setTimeout(() => { button.textContent = label; }, TOLD_MS);
    } catch (problem) {
      onProblem(problem);
    }
    isBusy = false;
  } }, label);
  return button;
}

/** Copies a text and returns whether the browser did. Fails if the text does not come. @param {Promise<string>} coming */
async function copy(coming) {
  const blob = coming.then((text) => new Blob([text], { type: "text/plain" }));
  blob.catch(() => {});
  try {
    // Safari copies only what is promised while it handles the click.
    await navigator.clipboard.write([new ClipboardItem({ "text/plain": blob })]);
    return true;
  } catch {
    return copySelected(await coming);
  }
}

/** Copies a text as a person would: without HTTPS, browsers offer no other way. @param {string} text */
function copySelected(text) {
  const focused = /** @type {HTMLElement | null} */ (document.activeElement);
  const field = element("textarea", { value: text, readOnly: true, "aria-hidden": "true" });
  Object.assign(field.style, { position: "fixed", insetBlockStart: "0", opacity: "0" });
  document.body.append(field);
  field.select();
  const isCopied = document.execCommand("copy");
  field.remove();
  focused?.focus({ preventScroll: true });
  return isCopied;
}
