// The tools on the picture: goal and obstacles, and those for the path of a predator; and undo, redo, compare.
// @ts-check
import { element, svg } from "../app/element.js";
import { say } from "../app/words.js";

/** Paths of the icons, in a box of 24. @type {Record<string, string>} */
const ICONS = {
  chase: "M5 3l14 8-6 1.5L10 19z",
  goal: "M12 2v5m0 10v5M2 12h5m10 0h5M12 7a5 5 0 1 0 0 10a5 5 0 1 0 0-10",
  circle: "M12 4a8 8 0 1 0 0 16a8 8 0 1 0 0-16",
  box: "M4 6h16v12H4z",
  predator: "M3 17c4 0 4-10 9-10s4 8 9 6M17 9l4 4-5 2",
  undo: "M9 6L4 11l5 5M4 11h10a5 5 0 0 1 0 10h-3", redo: "M15 6l5 5-5 5M20 11H10a5 5 0 0 0 0 10h3", compare: "M4 5h7v14H4zM13 5h7v14h-7z",
};
const TOOLS = ["goal", "circle", "box"];

/** @param {string} name */
const icon = (name) => svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true", class: "tool-icon" }, svg("path", { d: ICONS[name] }));

/**
 * Returns buttons that take a tool and put it back.
 * @param {string[]} names @param {{tool: import("../app/store.js").Signal<string>, life: AbortSignal, add: (kind: import("./things.js").Kind) => void}} options
 *   `add` puts a thing in the middle, for the keyboard
 */
export function toolButtons(names, { tool, life, add }) {
  const choose = (/** @type {string} */ name, /** @type {boolean} */ byKey) => {
    if (byKey && name !== "chase") add(/** @type {import("./things.js").Kind} */ (name));
    else tool.set(tool.value === name ? "" : name);
  };
  return names.map((name) => {
    const button = element("button.tool", { type: "button", title: say(`tool.${name}.help`), onclick: (/** @type {MouseEvent} */ event) => choose(name, event.detail === 0) }, icon(name), element("span", {}, say(`tool.${name}`)));
    button.dataset.tool = name;
    tool.watch((now) => button.setAttribute("aria-pressed", String(now === name)), life);
    return button;
  });
}

/**
 * @param {{tool: import("../app/store.js").Signal<string>, life: AbortSignal, add: (kind: import("./things.js").Kind) => void, undo: () => void, redo: () => void,
 *   compare: (isOn: boolean) => void}} options
 */
export function toolbar({ tool, life, add, undo, redo, compare }) {
  const buttons = toolButtons(TOOLS, { tool, life, add });
  const act = (/** @type {string} */ name, /** @type {() => void} */ onclick) => element("button.tool", { type: "button", title: say(`tool.${name}.help`), "aria-label": say(`tool.${name}`), onclick }, icon(name));
  const [back, forth] = [act("undo", undo), act("redo", redo)];
  const other = act("compare", () => {});
  const hint = element("p.tool-hint", { role: "status", hidden: true });
  const node = element("div.toolbar", { role: "toolbar", "aria-label": say("tool.label") }, ...buttons);
  const acts = element("span.actions", {}, back, forth, other);

  tool.watch((name) => {
    hint.hidden = !name;
    if (name) hint.textContent = say(`tool.${name}.help`);
  }, life);
  node.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    const all = /** @type {HTMLElement[]} */ ([...node.querySelectorAll("button:not(:disabled)")]);
    const at = all.indexOf(/** @type {HTMLElement} */ (document.activeElement));
    const way = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!way || at < 0) return;
    event.preventDefault();
    all[(at + way + all.length) % all.length].focus();
  });
  let held = false;
  const hold = (/** @type {boolean} */ isOn) => { if (held !== isOn && !(isOn && other.disabled)) { held = isOn; other.setAttribute("aria-pressed", String(isOn)); compare(isOn); } };
  for (const name of ["pointerdown", "pointerup", "pointerleave", "pointercancel", "blur"]) other.addEventListener(name, () => hold(name === "pointerdown"));
  const inField = (/** @type {Event} */ event) => event.target instanceof Element && event.target.closest("input:not([type=range], [type=checkbox], [type=radio]), select, textarea");
  addEventListener("keydown", (event) => {
    const key = event.key.toLowerCase();
    if ((event.ctrlKey || event.metaKey) && (key === "z" || key === "y")) { event.preventDefault(); (key === "y" || event.shiftKey ? redo : undo)(); }
    else if (event.ctrlKey || event.metaKey || event.altKey || inField(event)) return;
    else if (key === "t") { event.preventDefault(); buttons[0].focus(); }
    else if (key === "b") { event.preventDefault(); hold(true); }
    else if (key === " " && document.activeElement === other) { event.preventDefault(); hold(true); }
    else if (key === "escape" && tool.value) tool.set("");
  }, { signal: life });
  addEventListener("keyup", ({ key }) => { if (key.toLowerCase() === "b" || key === " ") hold(false); }, { signal: life });
  addEventListener("blur", () => hold(false), { signal: life });
  return {
    node, hint, acts,
    update(/** @type {{canUndo: boolean, canRedo: boolean}} */ { canUndo, canRedo }) {
      back.disabled = other.disabled = !canUndo;
      forth.disabled = !canRedo;
    },
  };
}
