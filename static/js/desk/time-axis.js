// The time axis: one cursor over all plots. Click and drag scrub; the wheel (while the axis has the focus, or with
// Ctrl), Shift and dragging, and buttons zoom. The axis is a slider for keyboards and screen readers.
// @ts-check
import { element } from "../app/element.js";
import { clock, say, seconds } from "../app/words.js";
import { readingOf } from "./transport.js";

/** Room left of the plots for their labels, and right of them, px; desk.css has the same. */
export const LEFT = 66;
export const RIGHT = 12;
/** Steps between labels, s. */
const STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400];
/** Change of the span by one click of a button, and by one unit of the wheel. */
const ZOOM = 2;
const WHEEL = 0.0016;

/** Returns the times of the labels of a span. @param {number[]} span @param {number} width px */
export function ticksOf([from, to], width) {
  const step = STEPS.find((one) => (to - from) / one <= Math.max(2, width / 90)) ?? 14400;
  const ticks = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9; k++) ticks.push(k * step + 0);
  return { ticks, step };
}

/** Returns the words of a label. @param {number} time_s @param {number} step @param {number} end_s */
export const tickWords = (time_s, step, end_s) => (step < 1 || end_s < 60 ? seconds(Math.round(time_s * 10) / 10) : clock(time_s + 1e-6));

/** @param {import("./instrument.js").Instrument} desk @param {import("./player.js").Player} player @param {HTMLElement[]} rows */
export function createTimeAxis(desk, player, rows) {
  const { span, moment, life, start_s, end_s, library } = desk;
  const now = element("i.now");
  const hovered = element("span");
  const hover = element("div.hover", { hidden: true }, hovered);
  const chosen = element("i.chosen", { hidden: true });
  const axis = element("div.axis", { tabIndex: 0, role: "slider", "aria-label": say("desk.axis"), "aria-valuemin": desk.first }, ...rows, chosen, hover, now);
  const width = () => Math.max(1, axis.clientWidth - LEFT - RIGHT);
  const xOf = (/** @type {number} */ time_s) => LEFT + ((time_s - span.value[0]) / (span.value[1] - span.value[0])) * width();
  const timeAt = (/** @type {number} */ clientX) => {
    const share = (clientX - axis.getBoundingClientRect().left - LEFT) / width();
    return span.value[0] + Math.min(1, Math.max(0, share)) * (span.value[1] - span.value[0]);
  };
  const middleOf = (/** @type {number} */ frame) => desk.timeOf(frame) + 0.5 / library.fps;

  const place = () => {
    const time_s = middleOf(moment.value);
    now.style.translate = `${xOf(time_s)}px 0`;
    now.hidden = time_s < span.value[0] || time_s > span.value[1];
  };
  moment.watch((frame) => {
    const [from, to] = span.value;
    const time_s = middleOf(frame);
    // The plots turn over like pages when the moment leaves them.
    if (time_s < from || time_s > to) desk.showSpan(time_s - 0.1 * (to - from), time_s + 0.9 * (to - from));
    place();
    axis.setAttribute("aria-valuenow", String(frame));
    axis.setAttribute("aria-valuemax", String(desk.last()));
    axis.setAttribute("aria-valuetext", readingOf(desk, frame));
  }, life);
  span.watch(place, life);
  desk.columns.watch(place, life);
  const observer = new ResizeObserver(place);
  observer.observe(axis);
  life.addEventListener("abort", () => observer.disconnect());

  const zoom = (/** @type {number} */ factor, about_s = middleOf(moment.value)) => {
    const [from, to] = span.value;
    desk.showSpan(about_s - (about_s - from) * factor, about_s + (to - about_s) * factor);
  };
  /** @type {{from_s: number} | null} */
  let drag = null;
  let isDown = false;
  const scrub = (/** @type {PointerEvent} */ event) => desk.goTo(desk.frameOf(timeAt(event.clientX)));
  axis.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    axis.setPointerCapture(event.pointerId);
    isDown = true;
    if (event.shiftKey) drag = { from_s: timeAt(event.clientX) };
    else { player.pause(); scrub(event); }
  });
  axis.addEventListener("pointermove", (event) => {
    const time_s = timeAt(event.clientX);
    hover.hidden = event.pointerType !== "mouse";
    hover.style.translate = `${xOf(time_s)}px 0`;
    hovered.textContent = say("desk.at", { time: time_s.toFixed(2), frame: String(desk.frameOf(time_s)) });
    hover.classList.toggle("is-late", time_s > (span.value[0] + span.value[1]) / 2);
    if (!isDown) return;
    if (!drag) return scrub(event);
    const [a, b] = [drag.from_s, time_s].sort((p, q) => p - q).map(xOf);
    chosen.hidden = false;
    chosen.style.translate = `${a}px 0`;
    chosen.style.inlineSize = `${b - a}px`;
  });
  const release = (/** @type {PointerEvent} */ event) => {
    const time_s = timeAt(event.clientX);
    if (drag && Math.abs(xOf(time_s) - xOf(drag.from_s)) > 4) desk.showSpan(Math.min(time_s, drag.from_s), Math.max(time_s, drag.from_s));
    [drag, isDown, chosen.hidden] = [null, false, true];
  };
  axis.addEventListener("pointerup", release);
  axis.addEventListener("pointercancel", () => { [drag, isDown, chosen.hidden] = [null, false, true]; });
  axis.addEventListener("pointerleave", () => { hover.hidden = true; });
  axis.addEventListener("dblclick", () => desk.showSpan(start_s, end_s));
  axis.addEventListener("wheel", (event) => {
    const [from, to] = span.value;
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      event.preventDefault();
      const by = (event.deltaX / width()) * (to - from);
      return span.set(shifted(from, to, by, desk));
    }
    // Without the focus, the wheel scrolls the page.
    if (document.activeElement !== axis && !event.ctrlKey && !event.metaKey) return undefined;
    event.preventDefault();
    return zoom(Math.exp(Math.max(-200, Math.min(200, event.deltaY)) * WHEEL), timeAt(event.clientX));
  }, { passive: false });
  const zoomIn = () => zoom(1 / ZOOM);
  const zoomOut = () => zoom(ZOOM);
  const button = (/** @type {string} */ text, /** @type {string} */ key, /** @type {() => void} */ act) => element("button.quiet.icon", { type: "button", "aria-label": say(key), title: say(key), onclick: act }, text);
  const whole = element("button.quiet", { type: "button", onclick: () => desk.showSpan(start_s, end_s) }, say("desk.zoom.whole"));
  const closer = button("+", "desk.zoom.in", zoomIn);
  const farther = button("−", "desk.zoom.out", zoomOut);
  span.watch(([from, to]) => { whole.disabled = farther.disabled = to - from >= end_s - start_s - 1e-6; }, life);
  return { node: axis, buttons: element("p.actions", {}, closer, farther, whole), zoomIn, zoomOut };
}

/** Returns a span moved by a time and kept within the measured part. @param {number} from @param {number} to @param {number} by @param {{start_s: number, end_s: number}} part */
function shifted(from, to, by, { start_s, end_s }) {
  const move = Math.min(end_s - to, Math.max(start_s - from, by));
  return [from + move, to + move];
}
