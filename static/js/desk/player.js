// The film: plays, steps by exact frames, follows the moment, and plays jumps (a second before, the cut, a
// second after). While there is no film, or where the browser cannot play it, a clock moves the moment.
// @ts-check
import { element, releaseVideo } from "../app/element.js";
import { signal } from "../app/store.js";
import { viewsState, watchViews } from "../app/names.js";
import { say } from "../app/words.js";

/** Time that is played before and after the cut of a jump, s. */
const AROUND_S = 1;
/** Share of a frame by which the film's clock may be early, against rounding. */
const EARLY = 0.3;

/** @typedef {ReturnType<typeof createPlayer>} Player */

/** @param {import("./instrument.js").Instrument} desk */
export function createPlayer(desk) {
  const { library, moment, life } = desk;
  const { fps } = library;
  const base = `/v1/libraries/${library.id}`;
  const video = element("video", { poster: `${base}/poster.jpg`, muted: true, playsInline: true, preload: "auto", tabIndex: -1, "aria-label": say("desk.film") });
  const isPlaying = signal(false);
  const views = signal(viewsState(library));
  const isBroken = signal(views.value !== "done");
  let rate = 1;
  /** Frame that the film shows or seeks. */
  let shown = -1;
  let isSeeking = false;
  /** Frame of the seek under way. */
  let sought = -1;
  /** Frame at which playing stops, or jumps. */
  let until = Infinity;
  /** @type {{from: number, to: number, mirrored: boolean} | null} */
  let cut = null;
  let isCutting = false;

  const frameOfClock = () => desk.first + Math.floor(video.currentTime * fps + EARLY);
  const seek = (/** @type {number} */ frame) => {
    shown = frame;
    if (isBroken.value || isSeeking || video.readyState < 1) return;
    isSeeking = true;
    sought = frame;
    video.currentTime = (frame - desk.first + 0.5) / fps;
  };
  video.addEventListener("seeked", () => {
    isSeeking = false;
    if (shown !== sought) seek(shown);
    else if (isPlaying.value && video.paused && !isCutting) video.play().catch(() => {});
  }, { signal: life });
  video.addEventListener("loadedmetadata", () => { if (moment.value > desk.first || shown > desk.first) seek(moment.value); }, { signal: life });
  // Until the film is played or sought, a browser goes on showing the poster, which is another moment.
  video.addEventListener("loadeddata", () => video.removeAttribute("poster"), { signal: life });
  video.addEventListener("error", () => { isBroken.set(true); video.remove(); }, { signal: life });
  // A busy machine shows none of the last frames.
  video.addEventListener("ended", () => { const goesOn = cut; step(desk.last()); if (!goesOn) pause(); }, { signal: life });
  life.addEventListener("abort", () => releaseVideo(video));

  // The moment follows the playing film, and the film follows the moment when something else moved it.
  const step = (/** @type {number} */ frame) => {
    if (!isPlaying.value || isCutting || frame < 0) return;
    if (frame >= until) return arrive();
    shown = frame;
    desk.goTo(frame);
    return undefined;
  };
  const arrive = () => {
    shown = Math.min(until, desk.last());
    desk.goTo(shown);
    if (!cut) return pause();
    // The last frame before the cut is shown as long as any other.
    const { to } = cut;
    const before = shown;
    [cut, until, isCutting] = [null, Math.min(desk.last(), to + Math.round(AROUND_S * fps)), true];
    video.pause();
    return setTimeout(() => {
      isCutting = false;
      if (!isPlaying.value || moment.value !== before || life.aborted) return;
      seek(to);
      restart(to);
      desk.goTo(to);
    }, 1000 / fps / rate);
  };
  const onFrame = (/** @type {number} */ _, /** @type {VideoFrameCallbackMetadata} */ { mediaTime }) => {
    if (life.aborted) return;
    if (!isSeeking && !video.paused) step(desk.first + Math.round(mediaTime * fps));
    video.requestVideoFrameCallback(onFrame);
  };
  if (video.requestVideoFrameCallback) video.requestVideoFrameCallback(onFrame);
  else video.addEventListener("timeupdate", () => { if (!isSeeking && !video.paused) step(frameOfClock()); }, { signal: life });
  moment.watch((frame) => {
    if (frame === shown) return;
    if (isPlaying.value) { [cut, until, isCutting] = [null, Infinity, false]; restart(frame); }
    seek(frame);
  }, life);

  // A clock plays where there is no film.
  let [begun_ms, begun] = [0, 0];
  const restart = (/** @type {number} */ frame) => { [begun_ms, begun] = [performance.now(), frame]; };
  const tick = (/** @type {number} */ now_ms) => {
    if (!isPlaying.value || life.aborted) return;
    const frame = begun + Math.floor((Math.max(0, now_ms - begun_ms) / 1000) * fps * rate);
    if (frame !== moment.value) step(frame);
    if (moment.value >= desk.last() && !cut && !isCutting) pause();
    requestAnimationFrame(tick);
  };

  function play() {
    if (isPlaying.value) return;
    if (!cut && moment.value >= desk.last()) desk.goTo(desk.first);
    isPlaying.set(true);
    if (isBroken.value) { restart(moment.value); requestAnimationFrame(tick); } else if (!isSeeking) video.play().catch(() => {});
  }
  function pause() {
    if (!isPlaying.value) return;
    [cut, until, isCutting] = [null, Infinity, false];
    isPlaying.set(false);
    video.pause();
    // The film may have gone on by a frame.
    seek(moment.value);
  }
  /** Plays a jump. @param {{from: number, to: number, mirrored: boolean}} jump */
  function playJump(jump) {
    pause();
    desk.goTo(jump.from - Math.round(AROUND_S * fps));
    desk.jump.set(jump);
    [cut, until] = [jump, Math.max(desk.first + 1, jump.from)];
    play();
  }
  watchViews(library, life, (state) => {
    views.set(state);
    if (state !== "done") return;
    const goesOn = isPlaying.value;
    pause();
    isBroken.set(false);
    video.src = `${base}/film.mp4`;
    if (goesOn) play();
  });
  return {
    video, views, isPlaying, isBroken, play, pause, playJump,
    toggle: () => (isPlaying.value ? pause() : play()),
    setRate: (/** @type {number} */ next) => { rate = next; video.playbackRate = next; restart(moment.value); },
    /** Moves by frames and stops. */
    move: (/** @type {number} */ frames) => { pause(); desk.goTo(moment.value + frames); },
    get isPastCut() { return isPlaying.value && !cut && !isCutting && until < Infinity; },
  };
}
