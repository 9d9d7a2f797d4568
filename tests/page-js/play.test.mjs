import assert from "node:assert/strict";
import { test } from "node:test";
import { createPlayer } from "../../static/js/flock/play.js";

const source = (name, nFrames = 100, span = nFrames) => ({ fps: 30, nFrames, span, at: (t) => `${name}${t}` });

/** Returns a player with a clock that `pass` moves on in steps of 16 ms, as a screen does. */
function setUp(options = {}, first = source("a")) {
  let now = 0;
  const asked = new Map();
  const [drawn, frames] = [[], []];
  let id = 0;
  const clock = { now: () => now, request: (step) => { asked.set(++id, step); return id; }, cancel: (one) => asked.delete(one) };
  const player = createPlayer({ draw: (layers) => drawn.push(layers) }, first, { clock, onFrame: (frame) => frames.push(frame), ...options });
  const pass = (ms) => {
    for (const end = now + ms; now < end;) {
      now = Math.min(end, now + 16);
      assert.ok(asked.size <= 1, "one request at most");
      const steps = [...asked.values()];
      asked.clear();
      for (const step of steps) step();
    }
  };
  const shown = () => drawn.at(-1).map(({ appearances, opacity }) => [appearances, Math.round(opacity * 100) / 100]);
  return { player, pass, drawn, frames, shown, asked, jump: (ms) => { now += ms; } };
}

test("it shows the first frame and then rests", () => {
  const { pass, drawn, frames, asked } = setUp();
  pass(500);
  assert.deepEqual([drawn.length, frames, asked.size], [1, [0], 0]);
});

test("it follows real time and tells every frame once", () => {
  const { player, pass, frames, drawn } = setUp();
  player.play();
  pass(1001);
  assert.deepEqual(frames, Array.from({ length: 31 }, (_, k) => k));
  assert.equal(drawn.length, 31);
});

test("a stall of the page moves it by one second at most", () => {
  const { player, pass, jump } = setUp();
  player.play();
  pass(16);
  jump(60_000);
  pass(16);
  assert.equal(player.frame, 30);
});

test("it loops, and tells when it plays and rests", () => {
  const states = [];
  const { player, pass, asked } = setUp({ onState: (isPlaying) => states.push(isPlaying) });
  player.play();
  pass(4001);
  assert.equal(player.frame, 20);
  player.pause();
  pass(1000);
  assert.deepEqual([player.frame, states, asked.size], [20, [true, false], 0]);
});

test("being seen again and again does not draw twice at a time", () => {
  const { player, pass } = setUp();
  player.play();
  for (let k = 0; k < 3; k++) player.setSeen(true);
  // `pass` checks that one step at most is asked for.
  pass(100);
  assert.equal(player.frame, 3);
});

test("seeking shows the very frame, playing or not", () => {
  const { player, pass, shown } = setUp();
  for (const [to, frame] of [[42, 42], [-3, 0], [1e9, 99], [NaN, 0], [7.9, 7]]) {
    player.seek(to);
    pass(16);
    assert.deepEqual(shown(), [[`a${frame}`, 1]]);
  }
});

test("swapping cross-fades in 150 ms and leaves the play head", () => {
  const { player, pass, shown, drawn, frames } = setUp();
  player.seek(50);
  pass(16);
  player.swap(source("b"));
  pass(75);
  assert.deepEqual(shown(), [["a50", 0.5], ["b50", 0.5]]);
  pass(100);
  assert.deepEqual(shown(), [["b50", 1]]);
  const n = drawn.length;
  pass(100);
  assert.deepEqual([drawn.length, frames.at(-1)], [n, 50]);
});

test("a partial plan repeats its beginning until the whole comes", () => {
  const { player, pass, shown } = setUp();
  player.seek(70);
  pass(16);
  player.swap(source("part", 60, 100));
  pass(200);
  assert.deepEqual(shown(), [["part10", 1]]);
  player.swap(source("whole"));
  pass(200);
  assert.deepEqual(shown(), [["whole70", 1]]);
});

test("a swap to a shorter flock stays on its time line", () => {
  const { player, pass, shown } = setUp();
  player.seek(70);
  pass(16);
  player.swap(source("b", 40));
  assert.equal(player.frame, 30);
  pass(200);
  assert.deepEqual(shown(), [["b30", 1]]);
});

test("nothing is drawn while nobody sees it, and no time passes", () => {
  const { player, pass, drawn, asked } = setUp();
  player.play();
  pass(500);
  const [n, frame] = [drawn.length, player.frame];
  player.setSeen(false);
  assert.equal(asked.size, 0);
  pass(5000);
  assert.deepEqual([drawn.length, asked.size, player.frame], [n, 0, frame]);
  player.setSeen(true);
  pass(100);
  assert.ok(player.frame > frame && player.frame <= frame + 4);
});

test("live flocks hold the play head and are drawn when they change", () => {
  const { player, pass, drawn, frames, shown } = setUp();
  player.seek(20);
  player.play();
  pass(16);
  let list = ["live"];
  player.swap({ fps: 30, nFrames: Infinity, span: Infinity, isLive: true, at: () => list });
  pass(400);
  const [n, told] = [drawn.length, frames.length];
  pass(160);
  assert.equal(drawn.length, n);
  list = ["moved"];
  pass(16);
  assert.deepEqual([shown(), frames.length], [[[["moved"], 1]], told]);
  player.swap(source("a"));
  pass(16);
  assert.equal(player.frame, 20);
});
