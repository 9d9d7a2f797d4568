// A setting that is a list of choices: one box for each.
// @ts-check
import { element } from "../app/element.js";
import { choiceOf, framed, nameOf } from "../studio/control.js";

/**
 * @param {import("../studio/schema.js").Field} field @param {string} words name of the words for its choices @param {import("../studio/control.js").Studio} studio
 * @returns {import("../studio/control.js").Control}
 */
export function checks(field, words, studio) {
  const all = field.choices.map((name) => {
    const input = element("input", { type: "checkbox", value: name, onchange: choose });
    return { name, input, node: element("label.check", {}, input, element("span", {}, choiceOf(words, name))) };
  });
  /** The last box stays checked: the list cannot be empty. Of the formats of YOLO, only one is possible. @param {Event} event */
  function choose({ target }) {
    const box = /** @type {HTMLInputElement} */ (target);
    const yolo = /^yolo_/;
    for (const { input } of all) if (box.checked && input !== box && yolo.test(box.value) && yolo.test(input.value)) input.checked = false;
    const checked = all.filter(({ input }) => input.checked).map(({ name }) => name);
    if (checked.length) studio.change({ [field.name]: checked });
    else box.checked = true;
  }
  const { node, setReset } = framed(field, studio, { input: null, below: element("div.checks", { role: "group", "aria-label": nameOf(field.name) }, ...all.map((one) => one.node)) });
  return {
    node, name: field.name,
    update(value, { isSet }) {
      for (const { name, input } of all) input.checked = Array.isArray(value) && value.includes(name);
      setReset(isSet);
    },
  };
}
