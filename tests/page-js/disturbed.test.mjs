// The longest of the times in which the whole picture is disturbed, and their number, by the code of the advice.
import assert from "node:assert/strict";
import { test } from "node:test";
import { disturbed } from "../../static/js/desk/disturbed.js";

const all = [
  { kind: "camera", from_s: 0, to_s: 1.8 }, { kind: "camera", from_s: 14.2, to_s: 14.9 },
  { kind: "light", from_s: 3, to_s: 3.5 }, { kind: "light", from_s: 6, to_s: 9 }, { kind: "light", from_s: 12, to_s: 13 },
];

test("the longest time and the number are those of the advice's kind", () => {
  assert.deepEqual(disturbed("camera_unsteady", all), { n: 2, longest: all[0] });
  assert.deepEqual(disturbed("light_changes", all), { n: 3, longest: all[3] });
});

test("other advice and older libraries have none", () => {
  assert.equal(disturbed("seldom_found", all).longest, undefined);
  assert.equal(disturbed("camera_unsteady").longest, undefined);
});
