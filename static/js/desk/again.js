// The film of the desk is measured again: the editor opens, and the new numbers appear beside the former ones.
// @ts-check
import { get } from "../app/api.js";
import { element } from "../app/element.js";
import { ended } from "../app/jobs.js";
import { thing } from "../app/names.js";
import { say } from "../app/words.js";
import { openedBy, openEditor } from "../editor/editor.js";
import { mendsOf } from "../editor/mends.js";
import { problemBox } from "../parts/problem.js";
import { jobCard } from "../parts/tray.js";
import { comparison } from "./numbers.js";

/**
 * @param {import("./instrument.js").Instrument} desk
 * @param {{player: import("./player.js").Player, results: HTMLElement, opening: Partial<import("../editor/editor.js").Opening>}} options
 */
export async function measureAgain(desk, { player, results, opening }) {
  const { library, life } = desk;
  player.pause();
  const film = await thing("footage", library.footage_id);
  await openEditor({ film, library, former: library.params, frame: desk.moment.value, ...opening, life, onBegun });

  /** @param {Api.Schemas["AnalysisAccepted"]} begun @param {Api.AnalysisChanges} params */
  async function onBegun({ job_id, library_id }, params) {
    const card = jobCard({ kind: "analysis" });
    results.replaceChildren(element("h2", {}, say("editor.title")), card);
    results.scrollIntoView({ block: "center" });
    try {
      await ended(job_id, life, card.update);
      const measured = await get(`/v1/libraries/${library_id}`, life);
      const link = element("a.button", { href: `/libraries/${library_id}?compare=${library.id}` }, say("editor.open"));
      results.replaceChildren(element("h2", {}, say("desk.compare.title")), comparison({ library }, { library: measured }), element("p.actions", {}, link));
    } catch (reason) {
      if (life.aborted) return;
      const problem = /** @type {import("../app/api.js").Problem} */ (reason);
      if (problem.name === "AbortError") return void results.replaceChildren();
      const reopen = (/** @type {Partial<import("../editor/editor.js").Opening>} */ more) => measureAgain(desk, { player, results, opening: more });
      results.replaceChildren(problemBox(problem, [...mendsOf(problem, (mend) => reopen(openedBy(mend, problem))), { label: say("editor.again"), act: () => reopen({ former: params }), quiet: true }]));
    }
  }
}
