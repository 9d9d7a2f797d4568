import assert from "node:assert/strict";
import { test } from "node:test";
import { appearance, keptColor, planSource } from "../../static/js/flock/appearance.js";
import { decodePlan } from "../../static/js/flock/plan.js";
import { planFile } from "./plan-file.mjs";

// The page's words ask the browser for its language.
Object.assign(globalThis, { location: new URL("http://page/"), localStorage: { getItem: () => null }, navigator: { languages: ["en"] }, document: { documentElement: {} } });
const { loadAtlas, lookup } = await import("../../static/js/flock/atlas.js");

const sheet = (scale, file) => ({ scale, pages: [{ file, size_px: [64, 64] }], page: [0, 0], x: [1, 20], y: [1, 2], w: [10, 30], h: [8, 9] });
const table = () => ({ schema: "flockreel/atlas@1", frame: [3, 300], center_px: [[5, 4], [16, 6]], sheets: [sheet(1, "atlas-0.webp"), sheet(0.5, "atlas-small.webp")] });

test("sprites are found by their source frame, centroids in pixels of the page", () => {
  const spriteOf = lookup(table(), table().sheets[1]);
  assert.deepEqual(spriteOf(300), { page: 0, x: 20, y: 2, w: 30, h: 9, cx: 28, cy: 5 });
  assert.equal(spriteOf(4), null);
});

test("sprites off their page are refused", () => {
  for (const change of [(one) => { one.x[1] = 40; }, (one) => { one.page[1] = 1; }, (one) => { one.w[0] = 0; }, (one) => { one.h[1] = 63; }, (one) => { one.y.pop(); }]) {
    const wrong = table();
    change(wrong.sheets[0]);
    assert.throws(() => lookup(wrong, wrong.sheets[0]), /is not on its page/);
  }
  assert.throws(() => lookup({ ...table(), schema: "other" }, sheet(1, "")), /cannot be read/);
});

/** Puts a service and a picture decoder in place of the browser's. */
function browser(t, missing = "") {
  const [asked, closed] = [[], []];
  t.mock.method(globalThis, "fetch", async (path, { signal }) => {
    signal?.throwIfAborted();
    asked.push(path);
    return path === missing ? new Response("", { status: 404 }) : path.endsWith("json") ? Response.json(table()) : new Response(path);
  });
  globalThis.createImageBitmap = async (_blob, options) => ({ options, close: () => closed.push(1) });
  t.after(() => { delete globalThis.createImageBitmap; });
  return { asked, closed };
}

test("the small sheet is loaded on request, premultiplied", async (t) => {
  const { asked, closed } = browser(t);
  const atlas = await loadAtlas("/lib/", { small: true });
  assert.deepEqual(asked, ["/lib/atlas.json", "/lib/atlas-small.webp"]);
  assert.equal(atlas.pages[0].options.premultiplyAlpha, "premultiply");
  atlas.close();
  assert.equal(closed.length, 1);
});

test("a missing page and an abort end the loading with their reason", async (t) => {
  browser(t, "/lib/atlas-0.webp");
  await assert.rejects(loadAtlas("/lib/"), { status: 404 });
  await assert.rejects(loadAtlas("/lib/", { signal: AbortSignal.abort() }), { name: "AbortError" });
});

test("individuals are sorted far to near, at equal depth by index", () => {
  const plan = decodePlan(planFile().buffer);
  const atlas = { spriteOf: () => lookup(table(), sheet(1, ""))(3) };
  assert.deepEqual(planSource(plan, atlas).at(0).map((one) => Math.round(one.depth)), [2, 1, 0]);
  const flat = planSource({ ...plan, cell: (i, t) => ({ ...plan.cell(i, t), depth: 0 }) }, atlas);
  assert.deepEqual(flat.at(0).map((one) => Math.round(one.x)), [200, 210, 220]);
});

test("the time line of a partial plan is that of the whole flock", () => {
  const plan = decodePlan(planFile({ change: (head) => { head.params.frames = 90; } }).buffer);
  const { span, nFrames } = planSource(plan, { spriteOf: () => null });
  assert.deepEqual([span, nFrames], [90, 12]);
});

test("a frame without a sprite is left out, also in a fade", () => {
  const atlas = { spriteOf: lookup(table(), table().sheets[0]) };
  const place = { x: 1, y: 2, depth: 0 };
  assert.equal(appearance(atlas, place, { sourceFrame: 9 }, null), null);
  assert.deepEqual(appearance(atlas, place, { sourceFrame: 3 }, { sourceFrame: 9, weight: 0.4 }).weight, 0);
  assert.equal(appearance(atlas, place, { sourceFrame: 3 }, { sourceFrame: 300, weight: 0.4 }).weight, 0.4);
});

test("haze takes its share per body length", () => {
  const haze = { perBl: 0.2, lengthPx: 50 };
  assert.deepEqual([keptColor(haze, 0), keptColor(haze, 50), keptColor(haze, -9)], [1, 0.8, 1]);
  assert.equal(keptColor({ perBl: 0, lengthPx: 50 }, 400), 1);
});
