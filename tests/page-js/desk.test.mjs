import assert from "node:assert/strict";
import { test } from "node:test";
import { append, derive, emptyColumns, fillTailBeat, firstFrame, frameAt, headOf } from "../../static/js/desk/columns.js";
import { gapsOf } from "../../static/js/desk/gaps.js";
import { svgPen, thinned, trace } from "../../static/js/desk/lines.js";
import { leapsFrom, longestPatches, patchAt } from "../../static/js/desk/patch-graph.js";
import { weakest } from "../../static/js/desk/weakest.js";

const times = (n) => Float64Array.from({ length: n }, (_, k) => k);
const line = (values, { turn = 0, most = 1000 } = {}) => {
  const { x, y, n } = thinned(times(values.length), Float32Array.from(values), { from: 0, to: values.length, most, turn });
  return Array.from({ length: n }, (_, k) => [Math.round(100 * x[k]) / 100, y[k]]);
};
const pathOf = (points) => {
  const pen = svgPen();
  trace({ x: Float64Array.from(points, ([x]) => x), y: Float32Array.from(points, ([, y]) => y), n: points.length }, pen, (x) => x, (y) => y);
  return pen.path();
};

test("a line has a break where nothing was measured", () => {
  assert.deepEqual(line([1, 2, NaN, NaN, 3]), [[0, 1], [1, 2], [2, NaN], [4, 3]]);
});

test("a heading that crosses 180 degrees ends at the border and begins at the other one", () => {
  assert.deepEqual(line([170, -170], { turn: 360 }), [[0, 170], [0.5, 180], [0.5, NaN], [0.5, -180], [1, -170]]);
  assert.deepEqual(line([-170, 170], { turn: 360 }), [[0, -170], [0.5, -180], [0.5, NaN], [0.5, 180], [1, 170]]);
});

test("no line joins two sides of a gap, whatever the headings beside it", () => {
  assert.equal(pathOf(line([175, NaN, NaN, -175, 179, -179], { turn: 360 })), "M0.0 175.0L1.0 175.0M3.0 -175.0L3.8 -180.0M3.8 180.0L4.0 179.0L4.5 180.0M4.5 -180.0L5.0 -179.0");
});

test("a thinned line keeps every extreme and draws nothing between them that is not in the data", () => {
  const values = Array.from({ length: 10000 }, (_, k) => (k === 5003 ? 90 : k % 7));
  const points = line(values, { most: 200 });
  assert.ok(points.length < 400);
  assert.ok(points.some(([x, y]) => x === 5003 && y === 90));
  assert.ok(points.every(([x, y]) => values[x] === y));
});

test("a thinned line keeps its gaps", () => {
  const values = Array.from({ length: 10000 }, (_, k) => (k >= 4000 && k < 6000 ? NaN : 1));
  const path = pathOf(line(values, { most: 200 }));
  assert.equal(path.match(/M/g).length, 2);
});

const pose = (k, more = {}) => ({ frame: k, time_s: k / 10, detected: true, cut: false, confidence: 0.99, head_confidence: 0.99, centroid_px: [10 * k, 0], box_px: [0, 0, 4, 2], heading_rad: 0, length_px: 20, height_px: 8, midline_px: null, bend_rad: null, ...more });
const filled = (poses) => {
  const columns = emptyColumns(poses.length, 10);
  for (const one of poses) append(columns, one);
  derive(columns);
  return columns;
};

test("speed is measured in pixels per second", () => {
  const { speed_px_per_s } = filled(Array.from({ length: 9 }, (_, k) => pose(k)));
  assert.equal(speed_px_per_s[4], 100);
});

test("a moment without the animal has no values", () => {
  const columns = filled([pose(0), { frame: 1, time_s: 0.1, detected: false, cut: false, centroid_px: null, heading_rad: null }, pose(2)]);
  assert.ok(Number.isNaN(columns.sure_deg[1]) && Number.isNaN(columns.unsure_deg[1]));
  assert.equal(headOf(columns, 1), null);
});

test("a piece of heading beside an unsure moment is unsure", () => {
  const { sure_deg, unsure_deg } = filled([pose(0), pose(1, { head_confidence: 0.5 }), pose(2)]);
  assert.deepEqual([...sure_deg], [0, NaN, 0]);
  assert.deepEqual([...unsure_deg], [0, 0, 0]);
});

test("a time belongs to the frame that begins before it", () => {
  const columns = filled(Array.from({ length: 5 }, (_, k) => pose(k)));
  assert.deepEqual([0, 0.05, 0.1, 0.399, 9, -1].map((time_s) => frameAt(columns, time_s)), [0, 0, 1, 3, 4, 0]);
});

test("the head is the first point of the midline, else half a length ahead", () => {
  assert.deepEqual(headOf(filled([pose(0, { box_px: [-10, -4, 20, 8] })]), 0), [10, 0]);
  assert.deepEqual(headOf(filled([pose(0, { midline_px: Array.from({ length: 11 }, (_, i) => [7 - i, 1]) })]), 0), [7, 1]);
});

test("missing headings are found across the border of the compass", () => {
  const bins = Array(36).fill(1);
  for (const k of [34, 35, 0, 1, 10]) bins[k] = 0;
  assert.deepEqual(gapsOf(bins), [[34, 4]]);
  assert.deepEqual(gapsOf(Array(36).fill(2)), []);
  assert.deepEqual(gapsOf(Array(36).fill(0)), [[0, 36]]);
});

test("the weakest moments are apart and say why", () => {
  const { moments, shares } = weakest(filled(Array.from({ length: 60 }, (_, k) => pose(k, k === 20 ? { detected: false } : k > 29 && k < 34 ? { head_confidence: 0.5 + (k - 30) / 100 } : {}))));
  assert.deepEqual(moments.map(({ frame, why }) => [frame, why]), [[20, "lost"], [30, "head"]]);
  assert.ok(Math.abs(shares.seen - 59 / 60) < 1e-9);
});

test("a frame belongs to the patch that holds it, and jumps leave its last frame", () => {
  const patches = { start: Int32Array.from([4, 6, 9]), end: Int32Array.from([6, 9, 10]) };
  assert.deepEqual([3, 4, 5, 6, 8, 9, 10].map((frame) => patchAt(patches, frame)), [-1, 0, 0, 1, 1, 2, -1]);
  const leaps = { from: Int32Array.from([5, 8, 8]), to: Int32Array.from([9, 4, 6]), mirrored: Uint8Array.from([0, 1, 0]) };
  assert.deepEqual(leapsFrom(leaps, 8), [{ from: 8, to: 4, mirrored: true }, { from: 8, to: 6, mirrored: false }]);
  assert.deepEqual(leapsFrom(leaps, 9), []);
  assert.deepEqual(longestPatches(patches, 2), [1, 0]);
});

test("a measured part begins at the rounded frame of its start", () => {
  assert.equal(firstFrame({ params: { from_s: 2.1 }, fps: 30 }), 63);
  assert.equal(firstFrame({ params: { from_s: null }, fps: 30 }), 0);
  assert.equal(firstFrame({ fps: 30 }), 0);
});

test("frames outside the measured part are not counted as lost", () => {
  const columns = emptyColumns(20, 10);
  for (let frame = 0; frame < 20; frame++) append(columns, { detected: frame >= 10, head_confidence: 1, confidence: 1 });
  const { shares, moments } = weakest(columns, { from: 10, to: 20 });
  assert.equal(shares.seen, 1);
  assert.deepEqual(moments, []);
});

test("the tail beat is written to the frames of its span only", () => {
  const columns = emptyColumns(6, 10);
  for (let frame = 0; frame < 6; frame++) append(columns, { detected: true });
  fillTailBeat(columns, [{ frames: [2, 4], frequency_hz: 2.5 }]);
  assert.deepEqual([...columns.tail_beat_hz].map((hz) => (Number.isNaN(hz) ? null : hz)), [null, null, 2.5, 2.5, null, null]);
});

test("the head of a foreshortened animal is not outside of its box", () => {
  const columns = emptyColumns(2, 10);
  for (const heading_rad of [0, Math.PI / 2]) append(columns, { detected: true, centroid_px: [50, 50], box_px: [40, 20, 20, 60], heading_rad, length_px: 60 });
  assert.deepEqual([0, 1].map((k) => headOf(columns, k).map(Math.round)), [[60, 50], [50, 80]]);
});

test("the heat map shows where the animal was longest", async () => {
  const { heatOf } = await import("../../static/js/desk/heat.js");
  const columns = emptyColumns(40, 10);
  for (let k = 0; k < 40; k++) append(columns, { time_s: k / 10, detected: k !== 3, centroid_px: k === 3 ? null : k < 30 ? [100, 50] : [150, 20] });
  const { width, height, cell_px, share } = heatOf(columns, [192, 96]);
  assert.deepEqual([width, height, cell_px], [96, 48, 2]);
  assert.equal(share.indexOf(1), 25 * width + 50);
  assert.ok(Math.abs(share[10 * width + 75] - 10 / 29) < 1e-6, "a third of the time");
  assert.equal(share[0], 0);
});
