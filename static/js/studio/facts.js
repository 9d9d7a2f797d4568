// What a plan is like, in plain words, and all figures in a table.
// @ts-check
import { element } from "../app/element.js";
import { count, percent, say } from "../app/words.js";

/** Share of near pairs that show almost the same frame, from which it is seen. Free choice. */
const CLONES = 0.05;
/** Steps of animals from which the order is computed, so that the page does not halt. */
const MOST_CELLS = 20_000;

/** Returns what most of a flock does, by its measures of order. @param {Pick<Api.FlockStats, "polarization" | "milling">} stats */
export const orderKindOf = ({ milling, polarization }) => (milling > 0.6 ? "mill" : polarization > 0.8 ? "school" : polarization > 0.5 ? "loose" : "swarm");

/** Returns the sentences about a plan. @param {import("../flock/plan.js").Plan} plan */
function sentencesOf({ head: { params, stats }, nIndividuals: n, isPart, nFrames, fps }) {
  const facts = [];
  const advice = [];
  const order = stats.polarization;
  if (order !== undefined && n > 1) {
    const kind = orderKindOf(stats);
    facts.push(say(`facts.order.${kind}`, { order: percent(kind === "mill" ? stats.milling : order) }));
  }
  const apart = stats.spacing_bl ?? stats.nearest_neighbor_bl;
  if (apart && n > 1) facts.push(say("facts.apart", { n: count(apart) }));
  if (stats.clone_share >= 0.005 && n > 1) facts.push(say("facts.clones", { share: percent(stats.clone_share) }));
  const room = stats.room_for;
  const where = say(`facts.where.${params?.tank ?? "seen"}`);
  if (room && n > room) advice.push(say("advice.little_room", { n, room, where }));
  else if (room) facts.push(say("facts.room", { n: room, where }));
  if (stats.clone_share > CLONES && n > 1) advice.push(say("advice.clones", { n: stats.distinct_looks ?? n }));
  if (stats.wall_violations > 0) advice.push(say("advice.walls"));
  if (isPart) advice.push(say("advice.part", { time: count(nFrames / fps) }));
  return { facts, advice };
}

/** Returns the order of a flock over time: as told, or from the steps of the animals. @param {import("../flock/plan.js").Plan} plan @returns {number[]} */
export function orderOf(plan) {
  const told = plan.head.stats?.per_frame?.polarization;
  if (told?.length) return told;
  const last = plan.nFrames - 1;
  const stride = Math.ceil((plan.nFrames * plan.nIndividuals) / MOST_CELLS);
  const moments = Array.from({ length: Math.ceil(plan.nFrames / stride) }, (_, k) => {
    const t = k * stride;
    let [sumX, sumY, n] = [0, 0, 0];
    for (let i = 0; i < plan.nIndividuals; i++) {
      const [from, to] = [plan.cell(i, Math.max(0, t - 2)), plan.cell(i, Math.min(last, t + 2))];
      const [x, y] = [to.x - from.x, to.y - from.y];
      const way = Math.hypot(x, y);
      if (way < 0.5) continue;
      [sumX, sumY, n] = [sumX + x / way, sumY + y / way, n + 1];
    }
    return n ? Math.hypot(sumX, sumY) / n : 0;
  });
  return Array.from({ length: plan.nFrames }, (_, t) => moments[Math.floor(t / stride)]);
}

/** The box of the facts of a plan, with advice unless its reader cannot change the flock. */
export function factsBox({ advises = true } = {}) {
  const sentences = element("ul.facts");
  const cards = element("ul.hints");
  const table = element("table", { translate: false, lang: "en" });
  const node = element("section.about", { hidden: true }, element("h2", {}, say("facts.title")), cards, sentences, element("details", {}, element("summary", {}, say("facts.all")), table));
  return {
    node,
    /** @param {import("../flock/plan.js").Plan} plan */
    update(plan) {
      node.hidden = false;
      const { facts, advice } = sentencesOf(plan);
      const told = (plan.head.advice ?? []).map(({ sentence }) => sentence);
      sentences.replaceChildren(...facts.map((text) => element("li", {}, text)));
      cards.replaceChildren(...(advises ? [...advice, ...told] : []).map((text) => element("li", {}, text)));
      const rows = Object.entries(plan.head.stats ?? {}).filter(([, value]) => typeof value === "number");
      table.replaceChildren(...rows.map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, String(Number(Number(value).toPrecision(4)))))));
    },
  };
}
