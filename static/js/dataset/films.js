// The films of which a data set is made: one box for each measured film.
// @ts-check
import { element } from "../app/element.js";
import { filmName } from "../app/names.js";
import { say } from "../app/words.js";

/**
 * Returns the choice of films. @param {Api.Library[]} libraries the newest one of each film @param {string[]} chosen ids to begin with
 * @param {() => void} onChange
 */
export function filmChoice(libraries, chosen, onChange) {
  const boxes = libraries.map((library) => {
    const input = element("input", { type: "checkbox", value: library.id, checked: chosen.includes(library.id), onchange: onChange });
    return { input, node: element("label.data-film", {}, element("img", { src: `/v1/libraries/${library.id}/poster.jpg`, alt: "", loading: "lazy", width: 96, height: 64 }), input, element("span", {}, filmName(library))) };
  });
  return {
    node: element("fieldset.data-films", {}, element("legend", {}, say("data.films")), ...boxes.map(({ node }) => node)),
    chosen: () => boxes.filter(({ input }) => input.checked).map(({ input }) => input.value),
  };
}
