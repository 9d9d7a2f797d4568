// The plot of the heading: a static drawing first, replaced by the zooming plot if that is available.
// @ts-check
import { byId, element } from "./element.js";
import { headingPoints, pathOf } from "./heading-series.js";
import { zoomingPlot } from "./heading-zoom.js";
import { direction, percent, seconds } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";

const MOST_POINTS = 4000;

/** @param {any} poses */
export async function showHeading(poses) {
  const slider = byId("heading-moment");
  slider.max = String(poses.frames.length - 1);
  slider.value = "0";
  const plain = drawing(poses, show);
  let point = plain.point;
  byId("heading-plot").replaceChildren(...plain.nodes);

  function show(frame) {
    slider.value = String(frame);
    byId("heading-reading").textContent = reading(poses, slider.valueAsNumber);
  }
  slider.oninput = () => { show(slider.valueAsNumber); point(slider.valueAsNumber); };
  slider.oninput();
  const zooming = await zoomingPlot(poses, show);
  byId("heading-zoom-help").hidden = !zooming;
  if (zooming) point = zooming;
}

function drawing(poses, onFrame) {
  const n_frames = Math.max(2, poses.frames.length);
  const points = headingPoints(poses, MOST_POINTS);
  const line = (name, d) => {
    const path = document.createElementNS(SVG, "path");
    path.setAttribute("class", name);
    path.setAttribute("d", d);
    return path;
  };
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", `0 -180 ${n_frames - 1} 360`);
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", "Heading of the animal over time; the slider below shows the value at one time");
  const now = line("now", "");
  svg.append(line("grid", [-90, 0, 90].map((y) => `M0 ${y}H${n_frames - 1}`).join("")),
    line("unsure", pathOf(points, false)), line("sure", pathOf(points, true)), now);
  const side = element("div", { className: "heading-side", "aria-hidden": "true" },
    ...["← left", "↑ up", "→ right", "↓ down", "← left"].map((text) => element("span", {}, text)));
  const last_s = poses.frames.at(-1)?.time_s ?? 0;
  const foot = element("div", { className: "heading-foot", "aria-hidden": "true" },
    ...[0, 0.25, 0.5, 0.75, 1].map((share) => element("span", {}, seconds(share * last_s))));
  const point = (frame) => now.setAttribute("d", `M${frame} -180V180`);
  svg.onpointermove = (event) => {
    const box = svg.getBoundingClientRect();
    const frame = Math.round(((event.clientX - box.left) / box.width) * (poses.frames.length - 1));
    onFrame(frame);
    point(frame);
  };
  return { nodes: [side, svg, foot], point };
}

function reading(poses, frame) {
  const pose = poses.frames[frame];
  const when = `${seconds(pose.time_s)}, frame ${frame}: `;
  if (pose.heading_rad === null || pose.heading_rad === undefined) return `${when}no heading was measured`;
  const sure = pose.head_confidence ? `, head confidence ${percent(pose.head_confidence)}` : "";
  return `${when}heading ${direction(pose.heading_rad)}${sure}`;
}
