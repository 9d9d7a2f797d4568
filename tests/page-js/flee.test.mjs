import assert from "node:assert/strict";
import { test } from "node:test";
import { stepBoids, wrap } from "../../static/js/flock/flee-boids.js";
import { N_ROW, createFlee } from "../../static/js/flock/flee-flock.js";
import { createChooser } from "../../static/js/flock/flee-frames.js";
import { fleeStart } from "../../static/js/flock/flee.js";
import { decodePlan } from "../../static/js/flock/plan.js";
import { planFile, randomFrom } from "./plan-file.mjs";

const TANK = { width: 16, height: 12, speed: 0.8, isSide: true };
const DT = 1 / 30;

/** Returns boids in a tank, at random. */
function school(n, seed = 1) {
  const random = randomFrom(seed);
  return Array.from({ length: n }, () => ({ x: 16 * random(), y: 12 * random(), depth: 3 * random(), heading: 6.28 * random(), speed: 0.8, fear: 0, phase: 6.28 * random() }));
}

test("boids stay in the picture and within their speed, whatever the pointer does", () => {
  const random = randomFrom(3);
  const boids = school(40);
  for (let t = 0; t < 1500; t++) {
    stepBoids(boids, TANK, DT, t % 90 < 60 ? [20 * random() - 2, 15 * random() - 2] : null);
    for (const { x, y, speed, heading } of boids) {
      assert.ok(x >= 0.5 && x <= 15.5 && y >= 0.5 && y <= 11.5, `${x}, ${y}`);
      assert.ok(speed >= 0 && speed <= 5 * TANK.speed, `${speed} BL/s`);
      assert.ok(Math.abs(heading) <= Math.PI + 1e-9);
    }
  }
});

test("boids beside the pointer move away within a second", () => {
  const boids = school(20, 5).map((boid, k) => ({ ...boid, x: 8 + Math.cos(k) * 1.2, y: 6 + Math.sin(k) * 1.2 }));
  const distance = ({ x, y }) => Math.hypot(x - 8, y - 6);
  const before = boids.map(distance);
  for (let t = 0; t < 30; t++) stepBoids(boids, TANK, DT, [8, 6]);
  for (const [k, boid] of boids.entries()) assert.ok(distance(boid) > before[k] + 0.5, `boid ${k}: ${distance(boid)}`);
});

test("without a pointer boids calm down and school", () => {
  const boids = school(20).map((boid) => ({ ...boid, fear: 1 }));
  for (let t = 0; t < 900; t++) stepBoids(boids, TANK, DT, null);
  const mean = ["cos", "sin"].map((of) => boids.reduce((sum, { heading }) => sum + Math[of](heading), 0) / 20);
  assert.ok(Math.hypot(...mean) > 0.7, `polarization ${Math.hypot(...mean)}`);
  for (const { x, y, speed } of boids) {
    assert.ok(Math.abs(speed - 0.8) < 0.01);
    assert.ok(x > 0.6 && x < 15.4 && y > 0.6 && y < 11.4, `at the wall: ${x}, ${y}`);
  }
});

test("a boid beside a wall leaves it", () => {
  const boids = school(1).map((boid) => ({ ...boid, x: 0.6, y: 10, heading: -Math.PI / 2 }));
  for (let t = 0; t < 60; t++) stepBoids(boids, TANK, DT, null);
  assert.ok(boids[0].x > 1.2, `${boids[0].x}`);
});

// Frames 0 to 19 head right, 20 to 39 left, 40 to 49 up; jumps lead from each to the next.
const FILM = {
  headings: Array.from({ length: 50 }, (_, k) => (k < 20 ? 0 : k < 40 ? Math.PI : -Math.PI / 2)),
  playable: Array.from({ length: 50 }, (_, k) => k),
  jumps: [[10, 25, 9], [19, 2, 9], [30, 45, 9], [39, 21, 9], [48, 5, 9], [49, 41, 9], [12, 3, 9, true]],
  canMirror: false, isSide: true,
};

/** Plays frames toward a heading and returns those shown. */
function played(film, heading, n, state = { frame: 0, mirrored: false }) {
  const chooser = createChooser(film);
  return Array.from({ length: n }, () => { state = chooser.next(state, heading); return state; });
}

test("the frames lead to the heading of the boid, through other headings if they must", () => {
  assert.deepEqual(played(FILM, Math.PI, 12).slice(-2).map(({ frame }) => frame), [25, 26]);
  const up = played(FILM, -Math.PI / 2, 60);
  assert.ok(up.slice(-20).every(({ frame }) => frame >= 40), JSON.stringify(up.slice(-20)));
  assert.ok(played(FILM, 0, 60).every(({ frame, mirrored }) => frame < 20 && !mirrored));
});

test("a detour over the wrong heading is taken if it pays", () => {
  const film = { ...FILM, headings: FILM.headings.map((heading, k) => (k < 40 ? heading : 0.9)), jumps: [[10, 28, 9], [19, 2, 9], [30, 42, 9], [49, 41, 9]] };
  assert.ok(played(film, 0.9, 40).slice(-20).every(({ frame }) => frame >= 40));
});

test("mirrored frames are used only where the flock allows them", () => {
  const film = { ...FILM, jumps: FILM.jumps.filter(([from]) => from !== 10) };
  assert.deepEqual(played({ ...film, canMirror: true }, Math.PI, 15).at(-1), { frame: 5, mirrored: true, isJump: false });
  assert.ok(played(film, Math.PI, 60).every(({ mirrored }) => !mirrored));
});

test("a mirrored animal shows the mirror image of its heading", () => {
  assert.ok(played(FILM, Math.PI, 60, { frame: 0, mirrored: true }).every(({ frame, mirrored }) => frame < 20 && mirrored));
});

test("only frames and jumps of the film follow each other", () => {
  const film = { ...FILM, canMirror: true };
  const chooser = createChooser(film);
  const random = randomFrom(9);
  let state = { frame: 0, mirrored: false };
  for (let t = 0; t < 2000; t++) {
    const next = chooser.next(state, 6.28 * random());
    const isJump = FILM.jumps.some(([from, to, , flip = false]) => from === state.frame && to === next.frame && flip === (next.mirrored !== state.mirrored));
    assert.ok(isJump || (next.frame === state.frame + 1 && next.mirrored === state.mirrored), JSON.stringify([state, next]));
    state = next;
  }
});

test("a frame outside of the playable ones is left for the best of them", () => {
  assert.ok(played(FILM, Math.PI, 1, { frame: 80, mirrored: false })[0].frame >= 20);
});

const poses = (view) => ({ view, frames: Array.from({ length: 400 }, (_, k) => ({ heading_rad: k % 7 ? Math.PI - 0.001 * k : null })) });
const library = { component: Array.from({ length: 100 }, (_, k) => 300 + k), playback: [[399, 300, 5]], stats: { speed_bl_per_s: null } };

test("play mode starts where the plan is", () => {
  const plan = decodePlan(planFile().buffer);
  const start = fleeStart(plan, 5, { library, poses: poses("side") });
  const [x, y, depth, frame, mirrored, rotation, scale, , , , , weight] = createFlee(start).rows().subarray(N_ROW);
  const cell = plan.cell(1, 5);
  for (const [found, wanted] of [[x, cell.x], [y, cell.y], [depth, cell.depth], [frame, 305], [mirrored, 1], [rotation, cell.rotation], [scale, cell.scale], [weight, 0]]) assert.ok(Math.abs(found - wanted) < 1e-3, `${found} is not ${wanted}`);
});

for (const [view, limit] of [["side", (10 * Math.PI) / 180], ["top", Math.PI]]) {
  test(`seen from the ${view}, sprites turn as far as allowed`, () => {
    const flee = createFlee(fleeStart(decodePlan(planFile().buffer), 0, { library, poses: poses(view) }));
    let most = 0;
    for (let t = 0; t < 300; t++) {
      flee.step([320, 240]);
      const rows = flee.rows();
      for (let at = 0; at < rows.length; at += N_ROW) {
        most = Math.max(most, Math.abs(wrap(rows[at + 5])));
        assert.ok(rows.subarray(at, at + N_ROW).every(Number.isFinite));
        assert.ok(rows[at + 3] >= 300 && rows[at + 3] < 400 && rows[at + 11] >= 0 && rows[at + 11] < 1);
        if (view === "top") assert.equal(rows[at + 4], at === N_ROW ? 1 : 0);
      }
    }
    assert.ok(most <= limit + 1e-6, `${most}`);
    assert.ok(most > limit / 2, `${most}`);
  });
}
