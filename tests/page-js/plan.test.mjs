import assert from "node:assert/strict";
import { test } from "node:test";
import { decodePlan } from "../../static/js/flock/plan.js";
import { planFile, randomFrom, swimmers } from "./plan-file.mjs";

const near = (a, b) => assert.ok(Math.abs(a - b) < 1e-9, `${a} is not ${b}`);

test("cells and fades have their scaled values", () => {
  const plan = decodePlan(planFile().buffer);
  assert.deepEqual([plan.nFrames, plan.nIndividuals, plan.fps, plan.lengthPx, plan.sizePx], [12, 3, 30, 40, [640, 480]]);
  const cell = plan.cell(2, 5);
  assert.deepEqual([cell.sourceFrame, cell.mirrored, cell.state], [305, false, 2]);
  for (const [name, value] of Object.entries({ x: 210, y: 110, rotation: -0.02, scale: 0.95, depth: 2 })) near(cell[name], value);
  assert.equal(plan.cell(1, 0).mirrored, true);
  const fade = plan.fadeAt(1, 5);
  assert.deepEqual([fade.sourceFrame, fade.mirrored], [8, true]);
  near(fade.weight, 0.5);
  assert.deepEqual([plan.fadeAt(1, 3), plan.fadeAt(1, 6), plan.fadeAt(0, 4)], [null, null, null]);
});

test("a plan without fades is whole", () => {
  const columns = Object.fromEntries(Object.entries(swimmers(3, 12)).map(([name, [type, scale, values]]) => [name, [type, scale, name.startsWith("fade_") ? [] : values]]));
  assert.equal(decodePlan(planFile({ columns, change: (head) => { head.fades = []; } }).buffer).fadeAt(1, 4), null);
});

const read = (bytes) => decodePlan(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));

test("a truncated file is refused at every length", () => {
  const file = planFile();
  for (let n = 0; n < file.length; n++) assert.throws(() => read(file.subarray(0, n)), /^Error: This plan cannot be read: .+\.$/, `${n} bytes`);
});

for (const [what, change, sentence] of [
  ["counts beyond the buffer", (head) => { head.n_frames = 2 ** 40; }, /must have/],
  ["a column beyond the buffer", (head) => { head.columns[0].n = 2 ** 50; }, /truncated in column source_frame/],
  ["a column before the buffer", (head) => { head.columns[0].at = -4; }, /at of source_frame/],
  ["a column at an odd place", (head) => { head.columns[0].at = 2; }, /truncated in column/],
  ["a type of another object", (head) => { head.columns[0].type = "constructor"; }, /unknown type/],
  ["a column named as a prototype", (head) => { head.columns[0].name = "__proto__"; }, /column source_frame/],
  ["a scale that is text", (head) => { head.columns[2].scale = "1"; }, /scale of x/],
  ["a column that comes twice", (head) => { head.columns.push({ ...head.columns[2] }); }, /comes twice/],
  ["a missing column", (head) => { head.columns.pop(); }, /fade_weight/],
  ["a fade beyond the end", (head) => { head.fades[0].start = 11; }, /n of a fade/],
  ["a fade of nobody", (head) => { head.fades[0].individual = 3; }, /individual of a fade/],
  ["fades shorter than their columns", (head) => { head.fades[0].n = 1; }, /1 of 2/],
  ["a huge picture", (head) => { head.image_size_px = [1e6, 480]; }, /image_size_px/],
  ["a predator of few frames", (head) => { head.predator = [[1, 2, 3]]; }, /predator/],
  ["another schema", (head) => { head.schema = "flockreel/plan@2"; }, /schema/],
]) test(`${what}: refused with the reason`, () => assert.throws(() => decodePlan(planFile({ change }).buffer), sentence));

test("a head longer than the file, or of an odd length, is refused with the reason", () => {
  const file = planFile();
  const view = new DataView(file.buffer);
  for (const nBytes of [file.length, 2 ** 32 - 4, view.getUint32(12, true) - 1]) {
    view.setUint32(12, nBytes, true);
    assert.throws(() => decodePlan(file.buffer), /truncated in its head/);
  }
});

test("corrupt files are read or refused within 50 ms of processor time", () => {
  const random = randomFrom(7);
  const file = planFile();
  const nHead = new DataView(file.buffer).getUint32(12, true);
  let nRefused = 0;
  for (let round = 0; round < 2000; round++) {
    const bytes = file.slice();
    // Half of the changes hit the head, where they matter most; digits stay digits, so that JSON stays JSON.
    const most = round % 2 ? 16 + nHead : bytes.length;
    for (let k = 0; k <= round % 4; k++) {
      const at = Math.floor(random() * most);
      const isDigit = bytes[at] >= 48 && bytes[at] <= 57;
      bytes[at] = isDigit && at >= 16 ? 48 + Math.floor(random() * 10) : Math.floor(random() * 256);
    }
    const began = process.cpuUsage();
    try {
      const plan = decodePlan(bytes.buffer);
      for (let i = 0; i < plan.nIndividuals; i++) for (let t = 0; t < plan.nFrames; t++) assert.ok(Number.isFinite(plan.cell(i, t).x + (plan.fadeAt(i, t)?.weight ?? 0)));
    } catch (error) {
      nRefused++;
      assert.match(String(error), /^Error: This plan cannot be read: /);
    }
    assert.ok(process.cpuUsage(began).user < 50_000, `round ${round}`);
  }
  assert.ok(nRefused > 500, `${nRefused} refused`);
});
