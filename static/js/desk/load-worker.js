// A worker that loads poses.json and library.json of a film. It reads the poses line by line while they arrive and
// sends what it has from time to time, so that the page shows the start of a long film early and never waits for
// the parser.
// @ts-check
import { append, derive, emptyColumns, fillTailBeat, measureRanges } from "./columns.js";

/** Time until the first report, ms; it doubles from report to report, because each one copies all columns. */
const REPORT_MS = 300;
/** Most jumps that are sent, the best first. More cannot be told apart on a screen. */
const MOST_JUMPS = 2000;

/** @type {Page.Worker} The declarations of tsc are those of a window. */
const page = /** @type {any} */ (self);
page.onmessage = (/** @type {MessageEvent} */ { data }) => {
  load(data).then((message) => page.postMessage(message, buffersOf(message.columns)), (error) => page.postMessage({ failed: { status: error.status ?? 0, text: error.text ?? "" } }));
};

/** Returns the memory of the columns, which moves to the page without a copy. @param {import("./columns.js").Columns} columns */
const buffersOf = (columns) => Object.values(columns).filter((one) => ArrayBuffer.isView(one)).map(({ buffer }) => buffer);

/** @param {{base: string, most: number, fps: number}} asked base: address of the library */
async function load({ base, most, fps }) {
  const [columns] = await Promise.all([loadPoses(`${base}/poses.json`, emptyColumns(most, fps)), loadLibrary(`${base}/library.json`)]);
  return { columns, done: true };
}

/** @param {string} address */
async function fetched(address) {
  const answer = await fetch(address);
  if (!answer.ok) throw Object.assign(new Error(), { status: answer.status, text: await answer.text() });
  return answer;
}

/** @param {string} address @param {import("./columns.js").Columns} columns */
async function loadPoses(address, columns) {
  const reader = /** @type {ReadableStream<BufferSource>} */ ((await fetched(address)).body).pipeThrough(new TextDecoderStream()).getReader();
  let [rest, head, n_derived, next, pause_ms] = ["", "", 0, performance.now() + REPORT_MS, REPORT_MS];
  for (;;) {
    const { value, done } = await reader.read();
    const lines = (rest + (value ?? "")).split("\n");
    rest = done ? "" : lines.pop() ?? "";
    for (const line of lines) {
      if (line.startsWith('{"frame":')) {
        if (columns.n === columns.time_s.length) columns = longer(columns);
        append(columns, JSON.parse(line.endsWith(",") ? line.slice(0, -1) : line));
      } else head += line;
    }
    if (done) break;
    if (performance.now() < next || columns.n < 2) continue;
    derive(columns, n_derived, columns.n);
    n_derived = Math.max(0, columns.n - Math.ceil(columns.fps));
    measureRanges(columns);
    page.postMessage({ columns });
    pause_ms *= 2;
    next = performance.now() + pause_ms;
  }
  /** @type {Api.PosesFile} */
  const { frames, ...facts } = JSON.parse(head);
  // A file that was written by another program may hold its frames otherwise.
  if (!columns.n && frames.length) {
    columns = emptyColumns(frames.length, columns.fps);
    for (const pose of frames) append(columns, pose);
  }
  derive(columns);
  fillTailBeat(columns, facts.tail_beat?.spans ?? []);
  measureRanges(columns);
  page.postMessage({ head: facts });
  return columns;
}

/** Returns columns with twice the room: the film has more frames than it said. @param {import("./columns.js").Columns} old */
function longer(old) {
  const columns = emptyColumns(2 * old.n, old.fps);
  if (old.hasMidline) columns.midline_px = new Float32Array(2 * old.midline_px.length).fill(NaN);
  const into = /** @type {Record<string, unknown>} */ (columns);
  for (const [name, value] of Object.entries(old)) {
    if (ArrayBuffer.isView(value)) /** @type {Float64Array} */ (into[name]).set(/** @type {Float64Array} */ (value));
    else into[name] = value;
  }
  return columns;
}

/** @param {string} address */
async function loadLibrary(address) {
  /** @type {Api.LibraryFile} */
  const { clip_frames, natural_step, stats, transitions, patches = [], playback = [] } = await (await fetched(address)).json();
  const jumps = transitions.map((one) => ({ from: one.from, to: one.to, mirrored: one.mirrored, distance: one.distance }))
    .sort((a, b) => a.distance - b.distance).slice(0, MOST_JUMPS);
  const found = { start: Int32Array.from(patches, (one) => one.start), end: Int32Array.from(patches, (one) => one.end) };
  const leaps = { from: Int32Array.from(playback, ([from]) => from), to: Int32Array.from(playback, ([, to]) => to), mirrored: Uint8Array.from(playback, (row) => (row[3] ? 1 : 0)) };
  page.postMessage({ library: { clip_frames, natural_step, stats, jumps, patches: found, leaps } });
}
