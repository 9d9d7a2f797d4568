// The rendered film of a flock: plays, seeks by exact frames, and tells which frame is on the screen.
// @ts-check
import { element, releaseVideo } from "../app/element.js";
import { say } from "../app/words.js";

/** Share of a frame by which the film's clock may be early, against rounding. */
const EARLY = 0.3;

/**
 * @typedef {{node: HTMLElement, readonly isPlaying: boolean, play: () => void, pause: () => void, seek: (frame: number) => void}} View
 *   a way to see the flock: `seek` does not stop it
 */

/**
 * @param {{src: string | undefined, poster: string | undefined, fps: number, n_frames: number, label: string, life: AbortSignal,
 *   onFrame: (frame: number) => void, onState: (isPlaying: boolean) => void, onBroken: () => void}} options
 * @returns {View & {video: HTMLVideoElement}}
 */
export function film({ src, poster, fps, n_frames, label, life, onFrame, onState, onBroken }) {
  const video = element("video", { src, poster, muted: true, loop: true, playsInline: true, preload: "auto", tabIndex: -1, "aria-label": label });
  let isPlaying = false;
  /** Frame to seek to; -1 if there is none. */
  let wanted = -1;
  let isSeeking = false;

  const tell = (/** @type {boolean} */ next) => { if (next !== isPlaying) { isPlaying = next; onState(next); } };
  const show = (/** @type {number} */ frame) => onFrame(Math.min(n_frames - 1, Math.max(0, frame)));
  // Seeking to the middle of a frame shows that frame, whichever way the browser rounds.
  const start = () => {
    if (wanted < 0 || isSeeking || video.readyState < 1) return;
    isSeeking = true;
    video.currentTime = (wanted + 0.5) / fps;
    wanted = -1;
  };
  const onPicture = (/** @type {number} */ _, /** @type {VideoFrameCallbackMetadata} */ { mediaTime }) => {
    if (life.aborted) return;
    if (wanted < 0 && !isSeeking) show(Math.round(mediaTime * fps));
    video.requestVideoFrameCallback(onPicture);
  };
  if (video.requestVideoFrameCallback) video.requestVideoFrameCallback(onPicture);
  else for (const name of ["timeupdate", "seeked"]) video.addEventListener(name, () => { if (wanted < 0) show(Math.floor(video.currentTime * fps + EARLY)); }, { signal: life });
  video.addEventListener("seeked", () => { isSeeking = false; start(); }, { signal: life });
  video.addEventListener("loadedmetadata", start, { signal: life });
  // Until the film is played or sought, a browser goes on showing the poster, which is another moment.
  video.addEventListener("loadeddata", () => video.removeAttribute("poster"), { signal: life });
  video.addEventListener("play", () => tell(true), { signal: life });
  video.addEventListener("pause", () => tell(false), { signal: life });
  video.addEventListener("error", () => { tell(false); onBroken(); }, { signal: life });
  life.addEventListener("abort", () => releaseVideo(video));

  return {
    node: video, video,
    get isPlaying() { return isPlaying; },
    play: () => { video.play().catch(() => {}); },
    pause: () => video.pause(),
    seek(frame) { wanted = frame; start(); },
  };
}

/** The button that shows an element on the whole screen; null where the browser cannot. @param {HTMLElement} node @param {AbortSignal} life */
export function wholeScreen(node, life) {
  if (!document.fullscreenEnabled) return null;
  const button = element("button.quiet", { type: "button", onclick: () => (document.fullscreenElement ? document.exitFullscreen() : node.requestFullscreen()).catch(() => {}) }, say("reel.whole_screen"));
  life.addEventListener("abort", () => { if (document.fullscreenElement === node) document.exitFullscreen().catch(() => {}); });
  return button;
}
