import assert from "node:assert/strict";
import { test } from "node:test";
import { factsOf } from "../../static/js/flock/describe.js";

/** Returns a plan of individuals at places that move by (dx, dy) pixels a frame; a body length is 40 px. */
const plan = (starts, moves) => ({
  nIndividuals: starts.length, nFrames: 30, fps: 30, lengthPx: 40,
  cell: (i, t) => ({ x: starts[i][0] + moves[i % moves.length][0] * t, y: starts[i][1] + moves[i % moves.length][1] * t, depth: starts[i][2] ?? 0 }),
});
const row = (n, x = 0) => Array.from({ length: n }, (_, k) => [x + 50 * k, 100]);

test("number, direction and groups are told", () => {
  assert.deepEqual(factsOf(plan([...row(10), ...row(10, 1000)], [[-2, 0.5]]), 10), { n: 20, heading: "left", isResting: false, nGroups: 2 });
});

test("directions are those of the picture, y down", () => {
  for (const [move, heading] of [[[2, 0], "right"], [[0, 2], "down"], [[-2, 0], "left"], [[0, -2], "up"]]) assert.equal(factsOf(plan(row(5), [move]), 0).heading, heading);
});

test("different directions and rest are not called a heading", () => {
  assert.deepEqual(factsOf(plan(row(4), [[2, 0], [-2, 0]]), 29), { n: 4, heading: null, isResting: false, nGroups: 1 });
  assert.deepEqual(factsOf(plan(row(4), [[0.01, 0]]), 3), { n: 4, heading: null, isResting: true, nGroups: 1 });
});

test("a single animal is one group", () => {
  assert.deepEqual(factsOf(plan([[0, 0]], [[0, 3]]), 29), { n: 1, heading: "down", isResting: false, nGroups: 1 });
});

test("groups are linked in depth too, and a chain is one group", () => {
  assert.equal(factsOf(plan([[0, 0, 0], [10, 0, 170]], [[1, 0]]), 0).nGroups, 2);
  assert.equal(factsOf(plan(Array.from({ length: 12 }, (_, k) => [150 * k, 0]), [[1, 0]]), 0).nGroups, 1);
  assert.equal(factsOf(plan(Array.from({ length: 12 }, (_, k) => [170 * k, 0]), [[1, 0]]), 0).nGroups, 12);
});
