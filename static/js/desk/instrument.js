// What all parts of the desk share: the moment, the part of the film that the plots show, and the measurements.
// @ts-check
import { problemFrom, unreachable } from "../app/api.js";
import { signal } from "../app/store.js";
import { emptyColumns, firstFrame, frameAt } from "./columns.js";

/**
 * @typedef {{from: number, to: number, mirrored: boolean, distance: number}} Jump two clips that look alike
 * @typedef {{clip_frames: number, natural_step: number, stats: Api.LibraryStats, jumps: Jump[],
 *   patches: {start: Int32Array, end: Int32Array}, leaps: {from: Int32Array, to: Int32Array, mirrored: Uint8Array}}} Facts
 *   of library.json; a leap is a jump that playback may take, sorted by its first frame
 * @typedef {ReturnType<typeof createInstrument>} Instrument
 */

/** Shortest part of the film that the plots show, s. */
const LEAST_SPAN_S = 0.4;

/**
 * @param {Api.Library} library @param {number} t the first moment, s @param {AbortSignal} life
 */
export function createInstrument(library, t, life) {
  // Frames keep the numbers of the whole film, but n_frames counts only the measured part, and film.mp4 begins with it.
  const first = firstFrame(library);
  const n = first + Math.max(1, library.n_frames);
  const isPart = typeof (library.params?.from_s ?? library.params?.to_s) === "number";
  const [start_s, end_s] = [first / library.fps, n / library.fps];
  /** The frame that everything shows. */
  const moment = signal(0);
  /** @type {import("../app/store.js").Signal<import("./columns.js").Columns>} */
  const columns = signal(emptyColumns(n, library.fps));
  /** @type {import("../app/store.js").Signal<Facts | null>} */
  const facts = signal(/** @type {Facts | null} */ (null));
  /** Head of poses.json, without the frames. */
  const head = signal(/** @type {Api.PosesHead | null} */ (null));
  const failure = signal(/** @type {import("../app/api.js").Problem | null} */ (null));
  const isLoaded = signal(false);
  /** What the time axis shows, s. */
  const span = signal([start_s, end_s]);
  const showsMirrored = signal(true);
  /** Scale, pixels per centimetre; null if nobody has set it. */
  const scale = signal(library.px_per_cm ?? null);
  /** The jump that plays or was played last, as frames. */
  const jump = signal(/** @type {{from: number, to: number, mirrored: boolean} | null} */ (null));

  /** Number of frames known so far. */
  const count = () => (isLoaded.value ? Math.max(1, columns.value.n) : Math.max(n, columns.value.n));
  /** Last frame of the measured part. */
  const last = () => (isPart ? Math.min(n, count()) : count()) - 1;
  const goTo = (/** @type {number} */ frame) => moment.set(Math.min(last(), Math.max(first, Number.isNaN(frame) ? first : Math.round(frame))));
  const timeOf = (/** @type {number} */ frame) => (frame < columns.value.n ? columns.value.time_s[frame] : frame / library.fps);
  const frameOf = (/** @type {number} */ time_s) => (columns.value.n === count() ? frameAt(columns.value, time_s) : Math.min(last(), Math.max(first, Math.floor(time_s * library.fps + 1e-6))));
  /** Shows a part of the film, kept within it. */
  const showSpan = (/** @type {number} */ from_s, /** @type {number} */ to_s) => {
    const length_s = Math.min(end_s - start_s, Math.max(LEAST_SPAN_S, to_s - from_s));
    const begin_s = Math.min(end_s - length_s, Math.max(start_s, from_s + (to_s - from_s - length_s) / 2));
    span.set([begin_s, begin_s + length_s]);
  };

  const worker = new Worker("/static/js/desk/load-worker.js", { type: "module" });
  worker.onmessage = ({ data }) => {
    if (data.library) facts.set(data.library);
    if (data.head) head.set(data.head);
    if (data.columns) columns.set(data.columns);
    if (data.failed) failure.set(data.failed.status ? problemFrom(data.failed.text, data.failed.status) : unreachable());
    if (data.done) { isLoaded.set(true); goTo(moment.value); }
    if (data.done || data.failed) worker.terminate();
  };
  worker.onerror = () => failure.set(unreachable());
  worker.postMessage({ base: `${location.origin}/v1/libraries/${library.id}`, most: n, fps: library.fps });
  life.addEventListener("abort", () => worker.terminate());
  goTo(Math.floor(t * library.fps + 1e-6));

  return { library, life, start_s, end_s, moment, columns, facts, head, failure, isLoaded, span, scale, showsMirrored, jump, first, last, count, goTo, timeOf, frameOf, showSpan };
}

/** Returns the frames of a jump: the last one shown before it and the first one after it. @param {Jump} one @param {number} clipFrames */
export function framesOf({ from, to, mirrored }, clipFrames) {
  const half = clipFrames >> 1;
  return { from: from + half - 1, to: to + half, mirrored };
}

/** Returns whether a library has a file. Services that do not list files are asked for it. @param {Api.Library} library @param {string} name */
export const hasFile = ({ files }, name) => !files || files.some((file) => file.name === name);
