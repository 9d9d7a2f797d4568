// Settings in the address, and things on the picture of the studio.
import assert from "node:assert/strict";
import { test } from "node:test";
import { frameLimits, mostCount } from "../../static/js/studio/limits.js";
import { placedOf } from "../../static/js/studio/placed.js";
import { bodyOf, createSettings, readQuery, textOf, writeQuery } from "../../static/js/studio/settings.js";
import { drawn, moved, pathOf, pathOfPointer, sized, thingsOf, withThing } from "../../static/js/studio/things.js";
import { waysOf } from "../../static/js/studio/ways.js";

const SIZE = [640, 480];
const KINDS = { rules: "group", "rules.wander": "number", "rules.zones": "group", "rules.zones.noise_rad": "number", goals: "other", count: "whole", preset: "choice", "render.background": "other" };
const FIELDS = new Map(Object.entries(KINDS).map(([name, kind]) => [name, { name, kind }]));
const read = (text) => readQuery(new URLSearchParams(text), FIELDS);

test("settings survive the way through an address", () => {
  const settings = { preset: "school", count: 40, "rules.wander": 0.3, "render.background": "#102030", goals: [{ at_px: [1, 2] }], "rules.zones": null };
  assert.deepEqual(read(writeQuery(settings)), { settings, unknown: [] });
});

test("groups given as JSON become single settings, and unknown names are told", () => {
  assert.deepEqual(read('rules={"wander":2,"zones":{"noise_rad":0.1}}&t=3&speed=9&__proto__=1'),
    { settings: { "rules.wander": 2, "rules.zones.noise_rad": 0.1 }, unknown: ["speed", "__proto__"] });
});

test("words that look like JSON are quoted", () => {
  assert.equal(textOf("plate"), "plate");
  assert.equal(textOf("40"), '"40"');
  assert.deepEqual(read(writeQuery({ preset: "null" })).settings, { preset: "null" });
});

test("a body nests settings, a whole group before its members", () => {
  assert.deepEqual(bodyOf({ "rules.zones.noise_rad": 0.1, "rules.zones": {}, "rules.wander": 1 }), { rules: { wander: 1, zones: { noise_rad: 0.1 } } });
  assert.deepEqual(bodyOf({ "rules.zones": null, "rules.zones.noise_rad": 0.1 }), { rules: { zones: { noise_rad: 0.1 } } });
});

test("changes of one gesture are one step of the history", () => {
  const settings = createSettings({});
  settings.change({ count: 3 });
  for (const x of [1, 2, 3]) settings.change({ goals: [x] }, { step: "gesture-1", isGesture: true });
  settings.undo();
  assert.deepEqual(settings.now.value, { count: 3 });
  settings.undo();
  assert.deepEqual(settings.now.value, {});
  assert.equal(settings.canUndo, false);
  settings.redo();
  settings.redo();
  assert.deepEqual(settings.now.value, { count: 3, goals: [3] });
});

test("limits follow the other settings", () => {
  assert.deepEqual(frameLimits({ loop: true }, 10), [30, 5000]);
  assert.deepEqual(frameLimits({ position: "boid" }, 10), [1, 10_000]);
  assert.deepEqual(frameLimits({}, 1000), [1, 4000]);
  assert.equal(mostCount(400), 10_000);
  assert.equal(mostCount(100_000), 40);
});

test("a click draws an obstacle of usual size, a drag its own", () => {
  assert.deepEqual(drawn("circle", [100, 100], [101, 100], SIZE), { circle: { center_px: [100, 100], radius_px: 48 } });
  assert.deepEqual(drawn("circle", [100, 100], [130, 140], SIZE), { circle: { center_px: [100, 100], radius_px: 50 } });
  assert.deepEqual(drawn("box", [200, 180], [120, 100], SIZE), { box: { box_px: [120, 100, 80, 80] } });
});

test("things stay in the picture and keep their least size", () => {
  const goal = { kind: "goal", value: { at_px: [5, 5], weight: 2 } };
  assert.deepEqual(moved(goal, [-50, 10], SIZE), { at_px: [0, 15], weight: 2 });
  const box = { kind: "box", value: { box: { box_px: [10, 10, 50, 50] } } };
  assert.deepEqual(sized(box, 1, [0, 100], SIZE), { box: { box_px: [10, 10, 4, 90] } });
  assert.deepEqual(sized(box, 0, [100, 0], SIZE), { box: { box_px: [56, 0, 4, 60] } });
});

test("the last thing that goes takes its setting along", () => {
  const placed = { goals: [{ at_px: [1, 2] }], obstacles: [], predator: { path: [{ time_s: 0, at_px: [1, 1] }] } };
  const [goal, predator] = thingsOf(placed);
  assert.deepEqual(withThing(placed, goal, undefined), { goals: undefined });
  assert.deepEqual(withThing(placed, predator, undefined), { predator: undefined });
});

test("a drawn line becomes at most 30 waypoints over the whole time", () => {
  const line = Array.from({ length: 500 }, (_, k) => [320 + 200 * Math.cos(k / 40), 240 + 150 * Math.sin(k / 17)]);
  const path = pathOf(line, 13, SIZE);
  assert.ok(path.length > 10 && path.length <= 30, String(path.length));
  assert.equal(path[0].time_s, 0);
  assert.equal(path.at(-1).time_s, 13);
  assert.ok(path.every(({ time_s }, k) => !k || time_s >= path[k - 1].time_s));
  assert.equal(pathOf([[1, 1]], 13, SIZE).length, 1);
});

test("a link with malformed things shows the others", () => {
  const values = { goals: [{ at_px: "x" }, { at_px: [1, 2] }], obstacles: "no", predator: { path: [null, { at_px: [3, 4] }] } };
  assert.deepEqual(placedOf((name) => values[name]), { goals: [{ at_px: [1, 2] }], obstacles: [], predator: { path: [{ at_px: [3, 4] }] } });
});

test("the predator of play mode comes from outside and leaves again", () => {
  const chase = (from_s, n) => Array.from({ length: n }, (_, k) => ({ time_s: from_s + k / 10, at_px: [600 - 10 * k, 240 + 40 * Math.sin(k)] }));
  const path = pathOfPointer(chase(5, 20), 13, SIZE);
  assert.deepEqual(path.slice(0, 2), [{ time_s: 0, at_px: [1280, 240] }, { time_s: 4.7, at_px: [1280, 240] }]);
  assert.deepEqual(path[2], { time_s: 5, at_px: [600, 240] });
  assert.ok(path.at(-1).time_s < 7.3 && Math.min(...path.at(-1).at_px) < -600 || Math.max(...path.at(-1).at_px) > 1000);
  assert.ok(path.every(({ time_s }, k) => !k || time_s > path[k - 1].time_s));
});

test("a chase that outlasts the flock begins earlier", () => {
  const path = pathOfPointer(Array.from({ length: 40 }, (_, k) => ({ time_s: 12 + k / 10, at_px: [100 + 5 * k, 100 + (k % 2)] })), 13, SIZE);
  assert.equal(path.at(-1).time_s, 13);
  assert.equal(path[2].time_s, 9.1);
  assert.deepEqual(pathOfPointer([{ time_s: 1, at_px: [1, 1] }], 13, SIZE), []);
});

test("the code of a flock quotes settings and makes the library as it was made", () => {
  const library = { id: "L", footage_id: "F", params: { threshold: 12, kappa: 2, animal_at: { frame: 3, at_px: [1, 2] } } };
  const ways = waysOf(library, { preset: "zonal", goals: [{ at_px: [1, 2] }], "render.formats": ["poster"] }, { link: "l", origin: "http://h", needsToken: true, defaults: { threshold: 18, kappa: 2 } });
  assert.match(ways.command, /analyze film -o library \\\n {2}--set threshold=12 \\\n {2}--set 'animal_at=\{"frame":3,"at_px":\[1,2\]\}'\n/);
  assert.match(ways.command, /-o flock\.mp4 \\\n {2}--plan flock\.json \\\n {2}--preset zonal \\\n {2}--set 'goals=\[\{"at_px":\[1,2\]\}\]' \\\n {2}--poster poster\.png$/);
  assert.match(ways.curl, /Bearer \$FLOCKREEL_TOKEN/);
  assert.match(ways.python, /os\.environ\["FLOCKREEL_TOKEN"\]/);
  assert.doesNotMatch(waysOf({ id: "L" }, {}, { link: "l", origin: "http://h" }).command, /analyze|Bearer/);
});
