// The matrix of distances: the moment as a crosshair, the two moments under the pointer as pictures, and a click
// that plays the jump from one to the other.
// @ts-check
import { element } from "../app/element.js";
import { percent, say } from "../app/words.js";
import { drawnCanvas, keptLayer, loadPicture } from "./canvas.js";
import { framesOf, hasFile } from "./instrument.js";
import { shownJumps } from "./jumps.js";

/** Distance within which the pointer takes a marked jump, px, and side of the pictures, px. */
const REACH = 7;
const SIDE = 192;

/**
 * @param {import("./instrument.js").Instrument} desk
 * @param {{player: import("./player.js").Player, pictures: import("./pictures.js").Pictures}} parts
 * @returns {HTMLElement}
 */
export function createMatrix(desk, { player, pictures }) {
  const { life, moment, facts, library } = desk;
  const layer = keptLayer();
  const { canvas, ask } = drawnCanvas(life, draw, { className: "matrix", "aria-label": say("desk.matrix.label") });
  const pair = [0, 1].map(() => element("canvas", { width: SIDE, height: SIDE, "aria-hidden": "true", hidden: true }));
  const words = element("p.matrix-words", {}, say("desk.matrix.help"));
  const pictured = element("div.matrix-pair", {}, pair[0], pair[1], words);
  /** @type {ImageBitmap | null} */
  let picture = null;
  // One pixel: reading a whole picture back takes a second without a graphics card.
  const cell = /** @type {CanvasRenderingContext2D} */ (element("canvas", { width: 1, height: 1 }).getContext("2d", { willReadFrequently: true }));
  /** Jump under the pointer. @type {{from: number, to: number, mirrored: boolean} | null} */
  let pointed = null;

  const clipFrames = () => facts.value?.clip_frames ?? library.clip_frames;
  /** Clips of the measured part; the picture has those of the whole film. */
  const nClips = () => Math.max(1, desk.last() - desk.first + 1 - clipFrames() + 1);
  const nPictured = () => Math.max(nClips(), desk.count() - clipFrames() + 1);
  const half = () => clipFrames() >> 1;
  /** Returns the place of a frame on the side of the matrix, a share. */
  const shareOf = (/** @type {number} */ frame) => Math.min(1, Math.max(0, (frame - desk.first - half() + 0.5) / nClips()));

  /** @param {import("./canvas.js").Paper} paper */
  function draw(paper) {
    const { context, width, height, colors } = paper;
    // Where only a part was measured, the frames of the film are known when it is loaded.
    if (desk.first > 0 && !desk.isLoaded.value) return;
    layer(paper, [Boolean(picture), facts.value?.jumps.length, desk.showsMirrored.value, desk.count(), desk.isLoaded.value].join(" "), (under) => {
      if (picture) {
        under.imageSmoothingEnabled = picture.width > width;
        const [x, side] = [picture.width * desk.first / nPictured(), picture.width * nClips() / nPictured()];
        under.drawImage(picture, x, x, side, side, 0, 0, width, height);
        brighten(under, { width, height, white: whiteOf(picture, x, side) });
      }
      for (const one of marks()) {
        under.fillStyle = one.mirrored ? "#2f9fd0" : "#e8641b";
        for (const [a, b] of [[one.from, one.to], [one.to, one.from]]) under.fillRect(shareOf(a) * width - 2, shareOf(b) * height - 2, 4, 4);
      }
    });
    const now = shareOf(moment.value);
    cross(context, now * width, now * height, { width, height, color: colors.accent });
    if (pointed) cross(context, shareOf(pointed.to) * width, shareOf(pointed.from + 1) * height, { width, height, color: colors.water });
  }

  /** Returns the jumps that are marked. */
  const marks = () => shownJumps(facts.value, desk.showsMirrored.value).map((one) => framesOf(one, clipFrames()));

  /** Returns the jump at a point: a marked one nearby, else that of the cell. The row is the moment before the cut, the column the moment after it. */
  function jumpAt(/** @type {PointerEvent | MouseEvent} */ event) {
    const box = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const frame = (/** @type {number} */ share) => Math.min(nClips() - 1, Math.max(0, Math.floor(share * nClips()))) + half() + desk.first;
    /** @type {{from: number, to: number, mirrored: boolean}} */
    let best = { from: frame(y / box.height) - 1, to: frame(x / box.width), mirrored: false };
    let least = REACH;
    for (const one of marks()) {
      for (const [from, to] of [[one.from, one.to], [one.to - 1, one.from + 1]]) {
        const far = Math.hypot(shareOf(to) * box.width - x, shareOf(from + 1) * box.height - y);
        if (far < least) [best, least] = [{ from, to, mirrored: one.mirrored }, far];
      }
    }
    return best;
  }

  let last = "";
  canvas.addEventListener("pointermove", (event) => {
    // A finger plays the jump at once.
    if (event.pointerType === "touch") return;
    pointed = jumpAt(event);
    ask();
    const { from, to, mirrored } = pointed;
    if (last === `${from} ${to}`) return;
    last = `${from} ${to}`;
    for (const one of pair) one.hidden = false;
    pictures.fill([{ frame: Math.max(0, from), canvas: pair[0], mirrored: false }, { frame: to, canvas: pair[1], mirrored }]);
    const values = { a: desk.timeOf(Math.max(0, from)).toFixed(2), b: desk.timeOf(to).toFixed(2), share: percent(distanceAt(from + 1, to)) };
    words.textContent = say(mirrored ? "desk.matrix.mirrored" : "desk.matrix.pair", values);
  }, { signal: life });
  canvas.addEventListener("pointerleave", () => { pointed = null; ask(); }, { signal: life });
  canvas.addEventListener("click", (event) => player.playJump(jumpAt(event)), { signal: life });

  /** Returns the distance of two moments as a share of the largest. */
  function distanceAt(/** @type {number} */ i, /** @type {number} */ j) {
    if (!picture) return 0;
    const { width, height } = picture;
    const at = (/** @type {number} */ frame, /** @type {number} */ side) => Math.min(side - 1, Math.floor(((desk.first + shareOf(frame) * nClips()) / nPictured()) * side));
    cell.drawImage(picture, at(j, width), at(i, height), 1, 1, 0, 0, 1, 1);
    return cell.getImageData(0, 0, 1, 1).data[0] / 255;
  }

  void Promise.resolve(hasFile(library, "distance.png") ? loadPicture(`/v1/libraries/${library.id}/distance.png`, life) : null).then((found) => {
    picture = found;
    if (!found) words.textContent = say("desk.matrix.none");
    ask();
  });
  for (const seen of [moment, facts, desk.showsMirrored, desk.isLoaded]) seen.watch(ask, life);
  const mirrored = element("input", { type: "checkbox", onchange: () => desk.showsMirrored.set(mirrored.checked) });
  desk.showsMirrored.watch((on) => { mirrored.checked = on; }, life);
  const key = element("p.matrix-key", {}, element("span.dot-plain", {}, say("desk.jumps.plain")), element("label.choice", {}, mirrored, element("span.dot-mirrored", {}, say("desk.mirrored_on"))));
  return element("div.matrix-box", {}, canvas, key, pictured);
}

/** Returns the gray of a part of the picture that only few of its cells exceed, 1 to 255. @param {ImageBitmap} picture @param {number} x @param {number} side */
function whiteOf(picture, x, side) {
  const small = /** @type {CanvasRenderingContext2D} */ (element("canvas", { width: 64, height: 64 }).getContext("2d", { willReadFrequently: true }));
  small.drawImage(picture, x, x, side, side, 0, 0, 64, 64);
  const grays = small.getImageData(0, 0, 64, 64).data.filter((_, k) => k % 4 === 0).sort();
  return Math.max(1, grays[Math.floor(0.98 * grays.length)]);
}

/** Makes a gray white: a few distances may be far greater than the rest. @param {CanvasRenderingContext2D} context @param {{width: number, height: number, white: number}} look */
function brighten(context, { width, height, white }) {
  context.globalCompositeOperation = "color-dodge";
  context.fillStyle = `rgb(${255 - white} ${255 - white} ${255 - white})`;
  context.fillRect(0, 0, width, height);
  context.globalCompositeOperation = "source-over";
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {{width: number, height: number, color: string}} look */
function cross(context, x, y, { width, height, color }) {
  context.beginPath();
  for (const [style, wide] of /** @type {[string, number][]} */ ([["rgb(255 255 255 / 0.7)", 3], [color, 1.25]])) {
    context.strokeStyle = style;
    context.lineWidth = wide;
    context.beginPath();
    context.moveTo(0, y);
    context.lineTo(width, y);
    context.moveTo(x, 0);
    context.lineTo(x, height);
    context.stroke();
  }
}
