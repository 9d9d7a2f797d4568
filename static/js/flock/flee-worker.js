// The worker of play mode: plays as many frames as are due whenever the page asks.
// @ts-check
import { createFlee } from "./flee-flock.js";

/** Frames played at once at most, after a pause. */
const MOST_FRAMES = 3;

let flee = /** @type {ReturnType<typeof createFlee> | null} */ (null);
let [fps, last] = [30, 0];

onmessage = ({ data: { start, now, pointer } }) => {
  if (start) {
    flee = createFlee(start);
    ({ fps } = start);
    last = now;
  }
  let due = Math.floor(((now - last) * fps) / 1000);
  last = due > MOST_FRAMES ? now : last + (due * 1000) / fps;
  for (due = Math.min(due, MOST_FRAMES); due > 0; due--) {
    flee?.step(pointer);
    if (due === 1) return void postMessage(flee?.rows());
  }
  postMessage(null);
};
