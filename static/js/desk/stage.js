// The stage: the film, the background or the cut-out animal, with the measurement of the moment drawn over it.
// @ts-check
import { element } from "../app/element.js";
import { signal } from "../app/store.js";
import { say } from "../app/words.js";
import { drawnCanvas, fitted, loadPicture } from "./canvas.js";
import { drawMarks } from "./marks.js";
import { drawPath, nearestFrame } from "./path.js";

/** @typedef {"film" | "background" | "sprite" | "difference"} Look */
/** @template T @typedef {import("../app/store.js").Signal<T>} Signal */

/**
 * @param {import("./instrument.js").Instrument} desk
 * @param {{player: import("./player.js").Player, pictures: import("./pictures.js").Pictures}} parts
 */
export function createStage(desk, { player, pictures }) {
  const { library, life, moment, columns } = desk;
  /** @type {import("../app/store.js").Signal<Look>} */
  const look = signal(/** @type {Look} */ ("film"));
  const showsMarks = signal(true);
  /** @type {ImageBitmap | null} */
  let background = null;
  const { canvas, ask } = drawnCanvas(life, draw);
  const note = element("p.stage-note", { hidden: true });
  const node = element("div.stage", {}, player.video, canvas, note);
  node.style.aspectRatio = library.image_size_px.join(" / ");

  /** @param {import("./canvas.js").Paper} paper */
  function draw({ context, width, height, colors }) {
    const k = moment.value;
    const isMirrored = player.isPastCut && desk.jump.value?.mirrored;
    const [w, h] = library.image_size_px;
    const { zoom, left, top } = fitted([w, h], width, height);
    if (isMirrored) { context.translate(width, 0); context.scale(-1, 1); }
    if (look.value === "sprite") return drawAnimal(context, k, { width, height, colors });
    context.translate(left, top);
    context.scale(zoom, zoom);
    if (look.value === "difference") drawDifference(context, w, h);
    else if (background && (look.value === "background" || player.isBroken.value)) context.drawImage(background, 0, 0, w, h);
    if (look.value === "background") drawPath(context, columns.value, { zoom, colors });
    if (showsMarks.value) drawMarks(context, columns.value, k, { zoom, colors, isMoving: look.value === "film" || look.value === "difference" });
    return undefined;
  }

  /** Draws how much the film differs from the background, four times as strong: what the threshold judges. @param {CanvasRenderingContext2D} context @param {number} w @param {number} h */
  function drawDifference(context, w, h) {
    context.fillStyle = "#000";
    context.fillRect(0, 0, w, h);
    if (!background || player.isBroken.value || player.video.readyState < 2) return;
    context.save();
    context.drawImage(player.video, 0, 0, w, h);
    context.globalCompositeOperation = "difference";
    context.drawImage(background, 0, 0, w, h);
    context.globalCompositeOperation = "color-dodge";
    context.fillStyle = "#bfbfbf";
    context.fillRect(0, 0, w, h);
    context.restore();
  }

  /**
   * Draws only the animal, large and in the middle, so that a jump shows its seam.
   * @param {CanvasRenderingContext2D} context @param {number} k @param {Omit<import("./canvas.js").Paper, "context">} paper
   */
  function drawAnimal(context, k, { width, height, colors }) {
    const zoom = 0.7 * pictures.zoomFor(Math.min(width, height));
    const at = columns.value.centroid_px.subarray(2 * k, 2 * k + 2);
    pictures.drawSprite(context, k, { x: width / 2, y: height / 2, zoom });
    if (showsMarks.value && k < columns.value.n && columns.value.detected[k]) {
      context.translate(width / 2, height / 2);
      context.scale(zoom, zoom);
      context.translate(-at[0], -at[1]);
      drawMarks(context, columns.value, k, { zoom, colors, isMoving: false });
    }
  }

  const tell = () => {
    const isMirrored = player.isPastCut && desk.jump.value?.mirrored === true;
    node.classList.toggle("is-mirrored", isMirrored);
    const lacks = desk.isLoaded.value && !columns.value.detected[moment.value];
    const views = player.views.value;
    note.textContent = lacks ? say("desk.not_seen") : isMirrored ? say("desk.mirrored_now") : views === "done" ? "" : say(`views.${views}`);
    note.hidden = !note.textContent;
    ask();
  };
  for (const seen of [moment, columns, showsMarks, desk.isLoaded, player.isPlaying, player.views]) seen.watch(tell, life);
  look.watch((now) => {
    node.dataset.look = now;
    canvas.setAttribute("aria-label", say(`desk.look.${now}.label`));
    if ((now === "background" || now === "difference") && !background) void needBackground();
    ask();
  }, life);
  const needBackground = async () => { background = await loadPicture(`/v1/libraries/${library.id}/background.png`, life); ask(); };
  player.isBroken.watch((broken) => { if (broken) void needBackground(); }, life);
  // The difference is made of the picture that the film has reached.
  for (const name of ["seeked", "loadeddata", "timeupdate"]) player.video.addEventListener(name, ask, { signal: life });
  void pictures.loaded.then(ask);

  canvas.addEventListener("click", (event) => {
    if (look.value !== "background") return player.toggle();
    const box = canvas.getBoundingClientRect();
    const { zoom, left, top } = fitted(library.image_size_px, box.width, box.height);
    player.pause();
    return desk.goTo(nearestFrame(columns.value, [(event.clientX - box.left - left) / zoom, (event.clientY - box.top - top) / zoom], moment.value));
  }, { signal: life });

  return { node, controls: controlsOf({ look, showsMarks, pictures, player, life }), look };
}

/**
 * Returns the choice of what the stage shows.
 * @param {{look: Signal<Look>, showsMarks: Signal<boolean>, pictures: import("./pictures.js").Pictures, player: import("./player.js").Player, life: AbortSignal}} parts
 */
function controlsOf({ look, showsMarks, pictures, player, life }) {
  let isChosen = false;
  const radios = /** @type {Look[]} */ (["film", "background", "sprite", "difference"]).map((name) => {
    const input = element("input", { type: "radio", name: "desk-look", value: name, checked: name === look.value, onchange: () => { isChosen = true; look.set(name); } });
    return { name, input, label: element("label.choice", {}, input, element("span", {}, say(`desk.look.${name}`))) };
  });
  look.watch((now) => { for (const { name, input } of radios) input.checked = name === now; }, life);
  radios[2].label.hidden = true;
  void pictures.loaded.then((found) => { radios[2].label.hidden = !found; });
  player.isBroken.watch((broken) => {
    radios[0].label.hidden = radios[3].label.hidden = broken;
    if (broken && (look.value === "film" || look.value === "difference")) look.set("background");
    if (!broken && !isChosen) look.set("film");
  }, life);
  const marks = element("input", { type: "checkbox", checked: showsMarks.value, onchange: () => showsMarks.set(marks.checked) });
  return element("div.stage-controls", {}, element("fieldset.choices", {}, element("legend.unseen", {}, say("desk.look")), ...radios.map(({ label }) => label)), element("label.choice", {}, marks, element("span", {}, say("desk.marks"))));
}
