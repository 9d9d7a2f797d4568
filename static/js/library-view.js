// The view of a library: numbers, heading, distances, pictures.
// @ts-check
import { getPoses } from "./api.js";
import { byId, element, showProblem } from "./element.js";
import { showHeading } from "./heading.js";
import { count, percent, seconds } from "./words.js";

const PICTURES = [["overlay", "overlay.mp4"], ["trajectory", "trajectory.svg"], ["confidence", "confidence.svg"], ["transitions", "transitions.svg"]];

/** @param {any} library */
export async function showLibrary(library) {
  const at = `/v1/libraries/${library.id}`;
  byId("library-title").textContent = library.name || "Measurements";
  byId("library-numbers").replaceChildren(...numbersOf(library).map(([term, value]) => element("div", {}, element("dt", {}, term), element("dd", {}, value))));
  byId("library-distance").src = `${at}/distance.png`;
  byId("library-candidates").src = `${at}/candidates.png`;
  byId("library-background").src = `${at}/background.png`;
  for (const [name, file] of PICTURES) {
    byId(`library-${name}`).src = `${at}/${file}`;
    byId(`library-${name}-file`).href = `${at}/${file}`;
  }
  const advice = library.advice ?? [];
  byId("library-advice-list").replaceChildren(...advice.map((one) => element("li", {}, one.sentence)));
  byId("library-advice").hidden = advice.length === 0;
  byId("library-headings-file").href = `${at}/headings.svg`;
  byId("library-table").href = `${at}/poses.csv`;
  byId("library-poses").href = `${at}/poses.json`;
  byId("library").hidden = false;
  try {
    await showHeading(await getPoses(library.id));
    byId("heading").hidden = false;
    byId("library-problem").replaceChildren();
  } catch (problem) {
    byId("heading").hidden = true;
    showProblem(byId("library-problem"), problem);
  }
}

/** Returns terms and values. Unknown values are omitted. */
function numbersOf(library) {
  const view = { side: "side", top: "above" }[library.view];
  const length_s = library.n_frames / library.fps;
  return [
    [`frames, ${seconds(length_s)} at ${count(library.fps)} a second`, library.n_frames, count],
    ["of the frames show the animal", library.detected_share, percent],
    ["seen from", view, String],
    ["transitions of playback", library.n_transitions, count],
    ["of the film can be used by endless playback", library.component_share, percent],
  ].filter(([, value]) => value !== undefined && value !== null).map(([term, value, say]) => [term, say(value)]);
}
