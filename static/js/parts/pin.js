// The pin of a film or flock, which then stays even if nobody uses it, and the space that everything takes.
// @ts-check
import { get, patch } from "../app/api.js";
import { element } from "../app/element.js";
import { say, size } from "../app/words.js";

/**
 * Returns a button that pins a thing or unpins it.
 * @param {{path: Api.Address<"patch">, isPinned: boolean, name: string}} thing @param {(problem: unknown) => void} tell
 */
export function pinButton({ path, isPinned, name }, tell) {
  const button = element("button.quiet.small", { type: "button", title: say("pin.help"), "aria-label": say("pin.of", { name }), "aria-pressed": isPinned, onclick: toggle }, say("pin"));
  async function toggle() {
    try {
      const changed = await patch(path, { pinned: button.getAttribute("aria-pressed") === "false" });
      button.setAttribute("aria-pressed", String(changed.pinned));
    } catch (problem) {
      tell(problem);
    }
  }
  return button;
}

/** Returns a sentence about the space that everything takes, and about its deletion by age; empty if there is nothing. @param {AbortSignal} life */
export async function spaceSentence(life) {
  const { used_bytes, max_bytes, keep_days } = await get("/v1/usage", life);
  if (used_bytes === 0) return "";
  const used = max_bytes == null ? say("space.used", { used: size(used_bytes) }) : say("space.of", { used: size(used_bytes), max: size(max_bytes) });
  return keep_days == null ? used : `${used} ${say("space.keep", { n: keep_days })}`;
}
