// The reel: settings of a made flock as a link, files, the ground truth, and strips over time.
import assert from "node:assert/strict";
import { test } from "node:test";

// The page's words ask the browser for its language.
Object.assign(globalThis, { location: new URL("http://page/"), localStorage: { getItem: () => null }, navigator: { languages: ["en"] }, document: { documentElement: {} } });
const { piecesOf } = await import("../../static/js/reel/pieces.js");
const { qrOf } = await import("../../static/js/reel/qr.js");
const { changedOf, filesOf, filmFileOf, savedName, sharedFilesOf, studioAddress } = await import("../../static/js/reel/settings.js");
const { pathOf, readLink } = await import("../../static/js/reel/shared-link.js");
const { sharedTitle } = await import("../../static/js/reel/shared-title.js");
const { roundUp, seriesOf, thin } = await import("../../static/js/reel/strips.js");
const { createTracks, readTracks } = await import("../../static/js/reel/tracks.js");

const field = (name, value, kind = "number", nullable = false) => [name, { name, kind, default: value, nullable }];
const FIELDS = new Map([
  field("count", null, "whole", true), field("frames", 400, "whole"), field("rules", { wander: 0.25, zones: null }, "group"), field("rules.wander", 0.25),
  field("rules.zones", null, "group", true), field("rules.zones.noise_rad", 0.1), field("goals", [], "other"), field("render", {}, "group"), field("render.formats", ["poster"], "other"), field("render.background", "plate", "other"), field("preset", null, "choice", true),
]);
const PARAMS = { count: 20, frames: 400, rules: { wander: 0.25, zones: null }, goals: [], render: { formats: ["poster"], background: "plate" }, later: 3 };

test("the title of a shared reel tells the film and what its flock does", () => {
  const saved = (name) => `inline; filename="_"; filename*=UTF-8''${encodeURIComponent(name)}_40x60_s1.plan`;
  const plan = (predator, stats, nIndividuals = 40) => ({ head: { params: { predator }, stats }, nIndividuals });
  assert.equal(sharedTitle(plan({}, {}), saved("zebra-finch")), "40 × zebra finch, fleeing");
  assert.equal(sharedTitle(plan(null, { milling: 0.7 }), saved("two.dots")), "40 × two.dots, circling");
  assert.equal(sharedTitle(plan(null, { milling: 0, polarization: 0.9 }, 1), saved("魚")), "1 × 魚");
  assert.equal(sharedTitle(plan(null, {}), ""), "A film of 40 animals, heading in different directions");
});

test("a QR code is as large as its text needs", () => {
  const sideOf = (length) => qrOf("a".repeat(length))?.length;
  assert.deepEqual([17, 18, 106, 107, 230, 231, 425].map(sideOf), [21, 25, 37, 41, 53, 57, 69]);
  assert.equal(qrOf("a".repeat(426)), null);
});

test("settings that are the default are left out", () => {
  assert.deepEqual(changedOf(PARAMS, FIELDS), { count: 20 });
});

test("a group that is off by default is kept, with what differs in it", () => {
  const params = { ...PARAMS, rules: { wander: 1, zones: { noise_rad: 0.1 } } };
  assert.deepEqual(changedOf(params, FIELDS), { count: 20, "rules.wander": 1, "rules.zones": {} });
  params.rules.zones.noise_rad = 0.3;
  assert.deepEqual(changedOf(params, FIELDS), { count: 20, "rules.wander": 1, "rules.zones": {}, "rules.zones.noise_rad": 0.3 });
});

test("the link to the studio has the settings as its query", () => {
  assert.equal(studioAddress({ library_id: "L", params: { ...PARAMS, render: { formats: [], background: "#102030" } } }, FIELDS), "/libraries/L/studio?count=20&render.formats=%5B%5D&render.background=%23102030");
  assert.equal(studioAddress({ library_id: "L", params: {} }, FIELDS), "/libraries/L/studio");
});

test("only files that the flock has are listed", () => {
  const files = (render) => filesOf({ params: { render } });
  assert.deepEqual(files({ formats: ["png", "webm"], overlay: true, ground_truth: false }), ["video.mp4", "video.webm", "frames.zip", "overlay.mp4", "flock.json", "flock.plan", "plan.svg"]);
  assert.deepEqual(files({ formats: ["poster"], overlay: false, ground_truth: true }), ["video.mp4", "poster.png", "tracks.csv", "ground-truth.zip", "flock.json", "flock.plan", "plan.svg"]);
  assert.deepEqual(filesOf({ files: [{ name: "a.csv" }], params: {} }), ["a.csv"]);
});

test("the film of a transparent flock is the one that is transparent, and its link offers that film", () => {
  const flock = (background, formats) => ({ params: { render: { background, formats } } });
  assert.equal(filmFileOf(flock("transparent", ["webm"])), "video.webm");
  assert.equal(filmFileOf(flock("transparent", ["mov", "gif"])), "video.mov");
  assert.equal(filmFileOf(flock("transparent", [])), "video.mp4");
  assert.equal(filmFileOf(flock("plate", ["webm"])), "video.mp4");
  assert.deepEqual(sharedFilesOf(flock("transparent", ["webm"])), ["video.mp4", "flock.plan", "video.webm"]);
  assert.deepEqual(sharedFilesOf(flock("transparent", ["mov", "webm"])), ["video.mp4", "flock.plan", "video.webm", "video.mov"]);
  assert.deepEqual(sharedFilesOf(flock("plate", ["webm"])), ["video.mp4", "flock.plan"]);
});

test("files are saved under a name that a person understands", () => {
  const flock = { count: 20, frames: 400, seed: 1 };
  assert.equal(savedName("video.mp4", flock, "goldfish <b>one"), "goldfish-b-one_20x400_s1.mp4");
  assert.equal(savedName("tracks.csv", flock, "金魚"), "金魚_20x400_s1_tracks.csv");
  assert.equal(savedName("flock.plan", flock, "../"), "flock_20x400_s1.plan");
});

const HEAD = "frame,time_s,id,x_px,y_px,heading_rad,scale,depth_m,source_frame,mirrored,rotation_rad,visible_x_px,visible_y_px,visible_w_px,visible_h_px,visible_area_px,amodal_x_px,amodal_y_px,amodal_w_px,amodal_h_px,amodal_area_px,visibility";
const ROWS = ["0,0,0,392.5,329.25,0.1,1.25,,106,0,0.1,341,307,96,45,2303,341,307,96,45,2303,1", "0,0,1,355.5,333.5,-0.1,1.5,,365,1,-0.1,,,,,0,318,312,75,40,1636,0", "2,0.1,0,1,2,0,1,,1,0,0,3,4,5,6,7,3,4,5,6,7,1"];

test("the ground truth is read in pieces of any length", async () => {
  const bytes = new TextEncoder().encode([HEAD, ...ROWS].join("\n"));
  for (const length of [7, 100, 5000]) {
    const pieces = Array.from({ length: Math.ceil(bytes.length / length) }, (_, k) => bytes.slice(k * length, (k + 1) * length));
    const tracks = await readTracks(new Response(new ReadableStream({ start(control) { for (const piece of pieces) control.enqueue(piece); control.close(); } })));
    assert.deepEqual(tracks.at(0), [
      { id: 0, x: 392.5, y: 329.25, scale: 1.25, visible: [341, 307, 96, 45], amodal: [341, 307, 96, 45], visibility: 1 },
      { id: 1, x: 355.5, y: 333.5, scale: 1.5, visible: null, amodal: [318, 312, 75, 40], visibility: 0 }]);
    assert.deepEqual([tracks.at(1), tracks.at(2).length, tracks.at(9), tracks.nFrames], [[], 1, [], 3]);
  }
});

test("a ground truth without its columns is refused", () => {
  assert.throws(() => createTracks().add("frame,id"), /column/);
  const tracks = createTracks();
  tracks.add(HEAD);
  assert.throws(() => tracks.add(ROWS[0].replace("0", "x")), /frame x/);
});

test("strips show what the plan tells for every frame", () => {
  const per_frame = { polarization: [0.5, 1], milling: [0, 0.1], nearest_neighbor_bl: [0.8, 1.3], groups: [1, 1] };
  const plan = { head: { stats: { polarization: 0.75, per_frame } }, nFrames: 2, nIndividuals: 3 };
  assert.deepEqual(seriesOf(plan).map(({ name, mean, most }) => [name, mean.toFixed(2), most]), [["polarization", "0.75", 1], ["milling", "0.05", 1], ["nearest_neighbor_bl", "1.05", 2]]);
  assert.deepEqual(seriesOf({ ...plan, nIndividuals: 1 }), []);
  assert.deepEqual(seriesOf({ ...plan, nFrames: 3 }), []);
});

test("a long line keeps its peaks, and an axis ends at a round number", () => {
  const values = Array.from({ length: 10_000 }, (_, t) => (t === 7321 ? 9 : 1));
  assert.equal(Math.max(...thin(values, 600)), 9);
  assert.equal(thin(values, 600).length, 600);
  assert.deepEqual([0, 0.03, 0.5, 0.8, 1.2, 4.9, 77].map(roundUp), [1, 0.05, 0.5, 1, 2, 5, 100]);
});

test("a shared link holds the signatures of its files, and nothing else is read from it", () => {
  const id = "01a21fc9-7d95-7277-b444-2600ce840b02";
  const [ab, cd, ef] = ["ab", "cd", "ef"].map((pair) => pair.repeat(16));
  const address = (name, expires, signature) => `/v1/flocks/${id}/${name}?expires=${expires}&signature=${signature}`;
  const link = (name, ...of) => ({ name, url: address(name, ...of) });
  const links = [link("video.mp4", 1796516109, ab), link("flock.plan", 1796516108, cd)];
  const path = pathOf(id, links);
  const [base, video, plan] = path.slice(3).split("~");
  assert.deepEqual([path.length, base.length, video.length, plan.length], [3 + 22 + 2 * 28, 22, 27, 27]);
  const files = links.map(({ url }) => url);
  assert.deepEqual(readLink(path.slice(3)), { files, offered: {}, expires_s: 1796516108 });
  const both = pathOf(id, [...links, link("video.webm", 1796516110, ef), link("video.mov", 1796516107, ab)]).slice(3);
  assert.deepEqual(readLink(both), { files, offered: { webm: address("video.webm", 1796516110, ef), mov: address("video.mov", 1796516107, ab) }, expires_s: 1796516107 });
  for (const text of ["", base, `${base}~${video}`, `${base}~${video}~${plan}~${video}`, `${base}~${video}~${plan}~zip.${video}`, `${base}~${video}~${plan.slice(1)}`, `../../x~${video}~${plan}`, `${base}~${video}~<b>${plan.slice(3)}`]) assert.equal(readLink(text), null, text);
});

test("pieces of film end at jumps and where the mirror side changes, and tell the mean difference of heading", () => {
  const individual = { source_frame: [5, 6, 7, 8, 2], mirrored: [false, false, true, true, true], heading_rad: [0, 0, 3.1, 0, 0], boid: { heading_rad: [0.1, 0.3, -3.1, 0, 0] } };
  const pieces = piecesOf(individual).map((one) => ({ ...one, gap_deg: Math.round(10 * one.gap_deg) / 10 }));
  assert.deepEqual(pieces, [
    { at: 0, n: 2, from: 5, mirrored: false, gap_deg: 11.5 },
    { at: 2, n: 2, from: 7, mirrored: true, gap_deg: 2.4 },
    { at: 4, n: 1, from: 2, mirrored: true, gap_deg: 0 },
  ]);
});
