// The virtual fish: its file, its posture, the lenses that show it, and the names of its files.
import assert from "node:assert/strict";
import { test } from "node:test";
import { lengthOf, NotAFish, readGlb } from "../../static/js/fish/glb.js";
import { filmLens, seenAt } from "../../static/js/fish/lens.js";
import { moved, multiply, rigid } from "../../static/js/fish/matrix.js";
import { createOrbit, viewOf } from "../../static/js/fish/orbit.js";
import { directionOf, postureAt, boundsOf } from "../../static/js/fish/posture.js";
import { floorOf, plumbOf, wayOf } from "../../static/js/fish/scenery.js";
import { changedFrom, PAPERS, savedName, shownAs } from "../../static/js/fish/settings.js";
import { glbFile } from "./glb-file.mjs";

const close = (got, want, why) => [...got].forEach((value, k) => assert.ok(Math.abs(value - want[k]) < 1e-6, `${why ?? ""} ${[...got]} is not ${want}`));

test("a fish has its mesh, joints and a posture for every frame", () => {
  const fish = readGlb(glbFile());
  assert.deepEqual([fish.nFrames, fish.body.length, fish.fins.length, fish.offsets.length], [2, 3, 3, 2]);
  close([lengthOf(fish), fish.yfov], [0.1, Math.PI / 2]);
});

test("a flat animal has a picture and no body", async () => {
  const flat = (root) => {
    const [{ attributes, indices }] = root.meshes[0].primitives;
    const { COLOR_0, ...others } = attributes;
    root.meshes[0].primitives = [{ attributes: { ...others, TEXCOORD_0: attributes.POSITION }, indices }];
    root.images = [{ bufferView: 0, mimeType: "image/png" }];
  };
  const fish = readGlb(glbFile(flat));
  assert.deepEqual([fish.body.length, fish.fins.length, fish.vertices.color], [0, 3, null]);
  assert.deepEqual([fish.picture.type, fish.picture.size, fish.vertices.place.length], ["image/png", 36, 9]);
  assert.equal(readGlb(glbFile()).picture, null);
});

test("other files are refused", () => {
  const refused = (file) => assert.throws(() => readGlb(file), NotAFish);
  refused(new ArrayBuffer(0));
  refused(new TextEncoder().encode("glTF, but not of version 2").buffer);
  refused(glbFile((root) => { root.animations = []; }));
  refused(glbFile((root) => { root.accessors[0].count = 1e9; }));
  refused(glbFile((root) => { root.animations[0].channels.splice(0, 1); }));
  refused(glbFile().slice(0, 400));
});

test("at rest the mesh lies where the fish is", () => {
  const { skin, place, isShown } = postureAt(readGlb(glbFile()), 0);
  assert.ok(isShown);
  close(place, [0, 0, -1]);
  close(moved(skin.subarray(0, 16), [0.05, 0, 0]), [0.05, 0, -1]);
  close(moved(skin.subarray(16, 32), [-0.05, 0, 0]), [-0.05, 0, -1]);
});

test("a turned fish takes its mesh along, and a bent joint the points behind it", () => {
  const posture = postureAt(readGlb(glbFile()), 1);
  assert.equal(posture.isShown, false);
  close(moved(posture.skin.subarray(0, 16), [0.05, 0, 0]), [0.1, 0.25, -1], "nose");
  // The second joint is at x = -0.01 and bends by a quarter turn, from the tail to the side.
  close(moved(posture.skin.subarray(16, 32), [-0.05, 0, 0]), [0.1, 0.19, -0.96], "tail");
  const { heading_rad, away_rad } = directionOf(posture);
  close([heading_rad, away_rad], [-Math.PI / 2, 0]);
});

test("a direction away from the camera is told as such", () => {
  close([directionOf({ forward: [0, 0, -1] }).away_rad, directionOf({ forward: [0.8, -0.6, 0] }).heading_rad], [Math.PI / 2, Math.atan2(0.6, 0.8)]);
});

test("frames beyond the film show its ends, and hidden frames have no bounds", () => {
  const fish = readGlb(glbFile());
  assert.deepEqual(postureAt(fish, 9), postureAt(fish, 1));
  assert.deepEqual(postureAt(fish, -1), postureAt(fish, 0));
  assert.deepEqual(boundsOf(fish), { low: [0, 0, -1], high: [0, 0, -1] });
});

test("the lens of the film shows a point where the measured camera saw it", () => {
  const size = [640, 480];
  const camera = { z_min_m: 0.7, pane_px_per_m: 1000, center_px: [300, 250], medium_index: 4 / 3 };
  // Camera::image_from_camera in crates/flockreel-core/src/geometry/camera.rs, with y and z turned.
  const depth = 0.7 + 0.2 / (4 / 3);
  const want = [300 + (0.1 * 700) / depth, 250 + (-0.05 * 700) / depth];
  const got = seenAt(filmLens(camera, null, size, 1), [0.1, 0.05, -0.9]);
  close([got[0] * 640, got[1] * 480], want);
  const assumed = seenAt(filmLens(null, Math.PI / 2, size, 1), [0.5, 0, -1]);
  close([assumed[0] * 640, assumed[1] * 480], [440, 240]);
  assert.equal(filmLens(null, null, size, 1), null);
});

test("an unturned camera stands before the fish, and a turned one keeps it in the middle", () => {
  const target = [0.1, 0.2, -1];
  const still = viewOf({ yaw: 0, pitch: 0, zoom: 1 }, target, 0.5);
  close(still.eye, [0.1, 0.2, -0.5]);
  close(moved(still.view, [0.2, 0.2, -1]), [0.1, 0, -0.5]);
  const turned = viewOf({ yaw: 1, pitch: -0.4, zoom: 2 }, target, 0.5);
  close(moved(turned.view, target), [0, 0, -0.25]);
  close(moved(viewOf({ yaw: 0, pitch: 1, zoom: 1 }, [0, 0, 0], 1).view, [0, 1, 0]), [0, Math.cos(1), Math.sin(1) - 1], "from above, a higher point is nearer");
});

test("turning stops short of straight above, zooming at its ends, and a reset goes back", () => {
  let n_changes = 0;
  const orbit = createOrbit({ yaw: 0, pitch: 0.2, zoom: 1 }, () => { n_changes += 1; });
  orbit.turn(0.5, 9);
  orbit.zoom(1000);
  assert.deepEqual(orbit.turned, { yaw: 0.5, pitch: 1.5, zoom: 8 });
  orbit.reset();
  assert.deepEqual([orbit.turned, n_changes], [{ yaw: 0, pitch: 0.2, zoom: 1 }, 3]);
});

test("the floor is below the fish, or behind one seen from above", () => {
  const bounds = { low: [0, 0, -2], high: [1, 1, -1] };
  const heights = (isFromAbove, axis) => new Set(Array.from(floorOf(bounds, 0.1, isFromAbove).lines).filter((_, k) => k % 3 === axis).map((value) => value.toFixed(3)));
  assert.deepEqual([...heights(false, 1)], ["-0.080"]);
  assert.deepEqual([...heights(true, 2)], ["-2.080"]);
  assert.ok(floorOf({ low: [0, 0, 0], high: [100, 1, 100] }, 0.01, false).lines.length < 1000, "large bounds have large squares");
});

test("the way leaves gaps open and the plumb line ends on the floor", () => {
  assert.equal(wayOf(readGlb(glbFile()), 0, 30).length, 0);
  assert.equal(wayOf(readGlb(glbFile((root) => { root.animations[0].channels.splice(2, 1); })), 0, 30).length, 6);
  assert.equal(plumbOf([1, 2, 3], { up: 1, height: -1 }, 0.1)[4], -1);
});

test("matrices are applied from the right", () => {
  const turn = rigid([0, 0, Math.SQRT1_2, Math.SQRT1_2], [1, 0, 0]);
  close(moved(multiply(turn, rigid([0, 0, 0, 1], [0.5, 0, 0])), [0, 0, 0]), [1, 0.5, 0]);
});

test("only what differs from the defaults is sent", () => {
  const fields = new Map(Object.entries({ palette: "goldfish", swim: true, bank_rad: 0.2, smooth_s: 0.06, length_m: null }).map(([name, value]) => [name, { name, default: value }]));
  assert.deepEqual(changedFrom({ palette: "silver", swim: true, length_m: null, later: 1 }, fields), { palette: "silver" });
  assert.deepEqual(changedFrom({ ...PAPERS }, fields), PAPERS);
  assert.deepEqual(changedFrom(null, fields), {});
});

test("sizes are shown in centimetres, around the size of the measured animal", () => {
  const field = { name: "length_m", min: 0, max: 20 };
  assert.deepEqual([shownAs(field, {}).min, shownAs(field, {}).max, shownAs(field, {}).perUnit], [0.005, 1, 0.01]);
  assert.equal(shownAs(field, { params: { animal: { length_m: 0.004 } } }).min, 0.001);
  assert.equal(shownAs({ name: "bank_rad", min: 0, max: 0.8 }, {}).max, 0.8);
});

test("files are saved under a name that a person understands", () => {
  assert.equal(savedName("goldfish <b>one", { palette: "silver", swim: true }, "glb"), "goldfish-b-one-virtual-fish-silver.glb");
  assert.equal(savedName("koi", { body: "own", palette: "silver" }, "mp4"), "koi-virtual-fish-own.mp4");
  assert.equal(savedName("../", { palette: "bronze", swim: false }, "mp4"), "film-virtual-fish-bronze-rigid.mp4");
});
