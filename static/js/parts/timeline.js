// A time line: play and pause, a slider over the frames, keys, and a strip with one quantity over time.
// @ts-check
import { element, svg } from "../app/element.js";
import { clock, count, say } from "../app/words.js";
import { listenForKeys } from "./keys.js";

/** Frames of a step with Shift. */
const FAR = 10;
/** Time between two updates while frames follow one another, ms. Drawing the time line costs more than drawing a flock. */
const SHOWN_MS = 100;
/** Points of the strip. */
const POINTS = 240;
/** Rows of the strip's table. */
const ROWS = 12;

/**
 * @typedef {{node: HTMLElement, setFrame: (frame: number) => void, setPlaying: (isPlaying: boolean) => void,
 *   setSpan: (n_frames: number, fps: number) => void, setSeries: (series: {name: string, values: number[], most: number} | null) => void}} Timeline
 */

/**
 * @param {{life: AbortSignal, seek: (frame: number) => void, toggle: () => void, onScrub?: (time_s: number) => void}} options
 *   onScrub hears the moment that a person chose
 * @returns {Timeline}
 */
export function timeline({ life, seek, toggle, onScrub = () => {} }) {
  let [frame, n_frames, fps, shown, timer] = [0, 1, 30, -1, 0];
  const play = element("button.quiet.play", { type: "button", onclick: toggle });
  const range = element("input", { type: "range", min: 0, step: 1, value: 0, "aria-label": say("timeline.slider") });
  const time = element("output.time");
  const strip = svg("svg", { viewBox: `0 0 ${POINTS} 100`, preserveAspectRatio: "none", "aria-hidden": "true" });
  const line = svg("polyline", { class: "series" });
  const now = svg("line", { class: "now", y1: 0, y2: 100 });
  const name = element("span");
  const table = element("table");
  const chart = element("figure.strip", { hidden: true }, strip, element("figcaption", {}, name), element("details", {}, element("summary", {}, say("timeline.table")), table));
  strip.append(line, now);
  const node = element("div.timeline", { role: "group", "aria-label": say("timeline.label") }, element("div.timeline-line", {}, play, range, time), chart);

  function show() {
    shown = frame;
    range.value = String(frame);
    const text = say("timeline.now", { time: `${clock(frame / fps)}.${Math.floor((10 * frame) / fps) % 10}`, total: clock(n_frames / fps), frame: String(frame) });
    time.textContent = text;
    range.setAttribute("aria-valuetext", text);
    const x = (POINTS * frame) / Math.max(1, n_frames - 1);
    now.setAttribute("x1", String(x));
    now.setAttribute("x2", String(x));
  }

  /** Shows the frame at once if none was shown lately, else soon. */
  function showInTime() {
    if (timer || shown === frame) return;
    show();
    timer = setTimeout(() => { timer = 0; showInTime(); }, SHOWN_MS);
  }

  /** @param {number} to */
  function scrub(to) {
    frame = Math.min(n_frames - 1, Math.max(0, to));
    seek(frame);
    show();
    onScrub(frame / fps);
  }

  life.addEventListener("abort", () => clearTimeout(timer));
  range.addEventListener("input", () => scrub(Number(range.value)));
  strip.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
    const box = strip.getBoundingClientRect();
    scrub(Math.round(((event.clientX - box.left) / box.width) * (n_frames - 1)));
  });
  const far = (/** @type {KeyboardEvent} */ { shiftKey }) => (shiftKey ? FAR : 1);
  listenForKeys(life, {
    " ": toggle,
    ArrowLeft: (event) => scrub(frame - far(event)),
    ArrowRight: (event) => scrub(frame + far(event)),
    Home: () => scrub(0),
    End: () => scrub(n_frames - 1),
  }, range);

  /** @param {boolean} isPlaying */
  function setPlaying(isPlaying) {
    play.textContent = isPlaying ? "❚❚" : "▶";
    play.setAttribute("aria-label", say(isPlaying ? "timeline.pause" : "timeline.play"));
  }
  setPlaying(false);

  return {
    node, setPlaying,
    setFrame(next) { frame = next; showInTime(); },
    setSpan(n, rate) { [n_frames, fps] = [n, rate]; range.max = String(n - 1); show(); },
    setSeries(series) {
      chart.hidden = !series;
      if (!series) return;
      const { values, most } = series;
      name.textContent = series.name;
      const points = Array.from({ length: POINTS + 1 }, (_, k) => [k, 100 - (96 * Math.min(most, values[Math.round((k / POINTS) * (values.length - 1))])) / most - 2]);
      line.setAttribute("points", points.map(String).join(" "));
      const rows = Array.from({ length: ROWS }, (_, k) => Math.round((k / (ROWS - 1)) * (values.length - 1)));
      table.replaceChildren(element("tr", {}, element("th", {}, say("timeline.time")), element("th", {}, series.name)),
        ...rows.map((k) => element("tr", {}, element("td", {}, clock(k / fps)), element("td", {}, count(Number(values[k].toFixed(2)))))));
    },
  };
}
