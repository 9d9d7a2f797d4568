// The editor: which settings it sends.
import assert from "node:assert/strict";
import { test } from "node:test";
import { changesOf, settingsOf } from "../../static/js/editor/settings.js";

const field = (name, kind, value = null) => [name, { name, kind, default: value }];
const fields = new Map([field("follow", "choice", "one"), field("threshold", "whole", 18), field("view", "choice"), field("ignore", "other", []), field("animal_at", "group"), field("camera", "group"), field("camera.z_min_m", "number"), field("preset", "choice"), field("smooth", "boolean", true)]);
const send = (former, change = {}) => changesOf({ ...settingsOf(former, fields), ...change }, fields);

test("only settings that differ from the defaults are sent, and those of the former measurement stay", () => {
  assert.deepEqual(send({ follow: "one", threshold: 18, view: null, ignore: [] }), {});
  assert.deepEqual(send({ threshold: 10 }, { view: "top" }), { threshold: 10, view: "top" });
  assert.deepEqual(send({ threshold: 10 }, { threshold: 18 }), {});
  assert.deepEqual(send({ gone: 1, ignore: [{ box_px: [1, 2, 3, 4] }] }), { ignore: [{ box_px: [1, 2, 3, 4] }] });
});

test("a setting that was put back to its default is sent beside a preset, which has other defaults", () => {
  assert.deepEqual(send({}, { preset: "papers", smooth: true }), { preset: "papers", smooth: true });
  assert.deepEqual(send({}, { smooth: true, preset: undefined }), { });
});

test("a group is one object again, and what was drawn stays whole", () => {
  const params = { camera: { z_min_m: 0.7 }, animal_at: { frame: 3, at_px: [1, 2] } };
  assert.deepEqual(send(params), params);
});
