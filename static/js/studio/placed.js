// Goals, obstacles and predator of the settings, as far as they are well formed: a link may hold anything.
// @ts-check

const isPoint = (/** @type {any} */ point, n = 2) => Array.isArray(point) && point.length === n && point.every(Number.isFinite);
const list = (/** @type {any} */ value) => (Array.isArray(value) ? value : []);

/** @param {(name: string) => any} valueOf @returns {import("./things.js").Placed} */
export function placedOf(valueOf) {
  const predator = valueOf("predator");
  return {
    goals: list(valueOf("goals")).filter((one) => isPoint(one?.at_px)),
    obstacles: list(valueOf("obstacles")).filter((one) => (isPoint(one?.circle?.center_px) && Number.isFinite(one.circle.radius_px)) || isPoint(one?.box?.box_px, 4)),
    predator: predator && typeof predator === "object" ? { ...predator, ...(predator.path ? { path: list(predator.path).filter((one) => isPoint(one?.at_px)) } : {}) } : null,
  };
}
