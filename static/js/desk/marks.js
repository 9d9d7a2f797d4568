// Draws the measurement of one frame in pixels of the film: box, trace of the last two seconds, midline, centroid,
// and the heading as an arrow with the head at its root.
// @ts-check
import { headOf, MIDLINE, SURE } from "./columns.js";

/** Length of the trace, s. */
const TRACE_S = 2;

/** @typedef {import("./columns.js").Columns} Columns */

/**
 * @param {CanvasRenderingContext2D} context scaled to pixels of the film
 * @param {Columns} columns @param {number} k the frame
 * @param {{zoom: number, colors: Record<string, string>, isMoving?: boolean}} look zoom: CSS pixels per pixel of the film
 */
export function drawMarks(context, columns, k, { zoom, colors, isMoving = true }) {
  if (k >= columns.n || !columns.detected[k]) return;
  const unit = 1 / zoom;
  context.lineCap = context.lineJoin = "round";
  const stroke = (/** @type {string} */ color, /** @type {number} */ width) => {
    context.strokeStyle = "rgb(10 17 20 / 0.65)";
    context.lineWidth = (width + 2) * unit;
    context.stroke();
    context.strokeStyle = color;
    context.lineWidth = width * unit;
    context.stroke();
    context.setLineDash([]);
  };
  if (isMoving) drawTrace(context, columns, k, unit, colors);
  const [x, y, w, h] = columns.box_px.subarray(4 * k, 4 * k + 4);
  context.beginPath();
  context.rect(x, y, w, h);
  stroke(colors.ink, 1);
  if (columns.hasMidline && !Number.isNaN(columns.midline_px[2 * MIDLINE * k])) {
    context.beginPath();
    for (let i = 0; i < MIDLINE; i++) context.lineTo(columns.midline_px[2 * (MIDLINE * k + i)], columns.midline_px[2 * (MIDLINE * k + i) + 1]);
    stroke(colors.water, 2.5);
  }
  drawArrow(context, columns, k, unit, (isDashed) => {
    if (isDashed) context.setLineDash([4 * unit, 5 * unit]);
    stroke(colors.accent, 2.5);
  });
  const [cx, cy] = columns.centroid_px.subarray(2 * k, 2 * k + 2);
  context.beginPath();
  context.arc(cx, cy, 3.5 * unit, 0, 7);
  context.fillStyle = colors.ink;
  stroke(colors.ink, 0.5);
  context.fill();
}

/**
 * Draws the path of the last two seconds, fading into the past.
 * @param {CanvasRenderingContext2D} context @param {Columns} columns @param {number} k @param {number} unit @param {Record<string, string>} colors
 */
function drawTrace(context, { fps, centroid_px: at }, k, unit, colors) {
  const from = Math.max(1, k - Math.round(TRACE_S * fps));
  context.strokeStyle = colors.accent;
  context.lineWidth = 2 * unit;
  for (let i = from; i <= k; i++) {
    if (Number.isNaN(at[2 * i]) || Number.isNaN(at[2 * i - 2])) continue;
    context.globalAlpha = 0.15 + (0.75 * (i - from)) / (k - from + 1);
    context.beginPath();
    context.moveTo(at[2 * i - 2], at[2 * i - 1]);
    context.lineTo(at[2 * i], at[2 * i + 1]);
    context.stroke();
  }
  context.globalAlpha = 1;
}

/**
 * Draws the head as a ring and the heading as an arrow; dashed if it is unsure.
 * @param {CanvasRenderingContext2D} context @param {Columns} columns @param {number} k @param {number} unit
 * @param {(isDashed: boolean) => void} stroke
 */
function drawArrow(context, columns, k, unit, stroke) {
  const angle = columns.heading_rad[k];
  const head = headOf(columns, k);
  if (Number.isNaN(angle) || !head) return;
  const long = Math.max(26 * unit, 0.45 * columns.length_px[k]);
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const [tipX, tipY] = [head[0] + long * cos, head[1] + long * sin];
  const barb = 9 * unit;
  context.beginPath();
  context.arc(head[0], head[1], 5 * unit, 0, 7);
  context.moveTo(head[0] + 5 * unit * cos, head[1] + 5 * unit * sin);
  context.lineTo(tipX, tipY);
  for (const side of [-0.45, 0.45]) {
    context.moveTo(tipX, tipY);
    context.lineTo(tipX - barb * Math.cos(angle + side), tipY - barb * Math.sin(angle + side));
  }
  stroke(columns.head_confidence[k] < SURE);
}
