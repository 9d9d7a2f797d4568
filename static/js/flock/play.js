// The play head of a flock. It follows real time at the plan's frame rate and shows whole frames only.
// @ts-check

import { reducedMotion } from "../app/motion.js";

/** @typedef {import("./appearance.js").Source} Source */

const CROSS_FADE_MS = 150;
/** Longest step of the play head, after the page could not draw for a while, milliseconds. */
const LONGEST_STEP_MS = 1000;

/** What the player asks of the browser; tests pass their own. */
const BROWSER = {
  now: () => performance.now(),
  request: (/** @type {() => void} */ step) => requestAnimationFrame(step),
  cancel: (/** @type {number} */ id) => cancelAnimationFrame(id),
};

/**
 * @param {{draw: (layers: import("./drawer.js").Layer[]) => void}} drawer @param {Source} source
 * @param {{onFrame?: (frame: number) => void, onState?: (isPlaying: boolean) => void, clock?: typeof BROWSER}} [options]
 *   onFrame receives the frame of the time line whenever it changes
 */
export function createPlayer(drawer, source, { onFrame = () => {}, onState = () => {}, clock = BROWSER } = {}) {
  let [position, isPlaying, isSeen] = [0, false, true];
  let [request, last, shown] = [0, 0, -1];
  let drawn = /** @type {unknown} */ (null);
  let former = /** @type {{source: Source, since: number} | null} */ (null);

  const frame = () => Math.floor(position);
  const picture = (/** @type {Source} */ one) => one.at(frame() % one.nFrames);

  function step() {
    request = 0;
    const now = clock.now();
    if (isPlaying && !source.isLive) {
      position = (position + (Math.min(now - last, LONGEST_STEP_MS) / 1000) * source.fps) % source.span;
    }
    last = now;
    if (former && now - former.since >= CROSS_FADE_MS) {
      former = null;
      shown = -1;
    }
    if (former || source.isLive || frame() !== shown) draw(now);
    ask();
  }

  /** @param {number} now ms */
  function draw(now) {
    const fresh = frame() !== shown;
    shown = frame();
    const appearances = picture(source);
    if (appearances === drawn && !former && !fresh) return;
    drawn = appearances;
    const share = former ? (now - former.since) / CROSS_FADE_MS : 1;
    const layers = [{ appearances, opacity: share }];
    if (former) layers.unshift({ appearances: picture(former.source), opacity: 1 - share });
    drawer.draw(layers);
    if (fresh) onFrame(shown);
  }

  /** Asks for the next step if there is something to do. There is never more than one request. */
  function ask() {
    if (!request && isSeen && (isPlaying || former || frame() !== shown)) request = clock.request(step);
  }

  /** @param {boolean} next */
  function setPlaying(next) {
    if (isPlaying === next) return;
    isPlaying = next;
    last = clock.now();
    onState(next);
    ask();
  }

  const player = {
    get frame() { return frame(); },
    get isPlaying() { return isPlaying; },
    play: () => setPlaying(true),
    pause: () => setPlaying(false),
    /** Shows a frame of the time line. @param {number} to */
    seek(to) {
      position = Math.min(source.span - 1, Math.max(0, Math.floor(to) || 0));
      ask();
    },
    /** Cross-fades to another flock. The play head stays where it is. @param {Source} next */
    swap(next) {
      if (shown >= 0) former = { source, since: clock.now() };
      source = next;
      if (position >= source.span) position %= source.span;
      shown = -1;
      ask();
    },
    /** Draws the present frame again, such as after a resize. */
    redraw() {
      shown = -1;
      ask();
    },
    /** Stops the loop while nobody sees the canvas. @param {boolean} next */
    setSeen(next) {
      if (next === isSeen) return;
      isSeen = next;
      last = clock.now();
      clock.cancel(request);
      request = 0;
      ask();
    },
  };
  ask();
  return player;
}

/**
 * Ties a player to its page: it rests while the canvas is off screen or the tab is hidden, and starts by
 * itself unless the person prefers reduced motion. Returns a function that ends this.
 * @param {Element} canvas @param {ReturnType<typeof createPlayer>} player
 */
export function attach(canvas, player) {
  const calm = reducedMotion();
  let isOnScreen = true;
  const look = () => player.setSeen(isOnScreen && !document.hidden);
  const obey = () => { if (calm.matches) player.pause(); };
  const observer = new IntersectionObserver((entries) => {
    isOnScreen = entries[entries.length - 1].isIntersecting;
    look();
  });
  observer.observe(canvas);
  document.addEventListener("visibilitychange", look);
  calm.addEventListener("change", obey);
  look();
  if (!calm.matches) player.play();
  return () => {
    observer.disconnect();
    document.removeEventListener("visibilitychange", look);
    calm.removeEventListener("change", obey);
    player.pause();
    player.setSeen(false);
  };
}
