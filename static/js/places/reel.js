// The reel of one flock: its film with the ground truth over it, figures in step, files, links, and the way
// back into the studio.
// @ts-check
import { get } from "../app/api.js";
import { element } from "../app/element.js";
import { filmName, thing } from "../app/names.js";
import { go, replaceAddress, setTitle } from "../app/router.js";
import { ago, say, sayOr, seconds, size as bytesOf } from "../app/words.js";
import { flockName, posterOf } from "../parts/cards.js";
import { linkButton } from "../parts/film-buttons.js";
import { planOf } from "../parts/living.js";
import { problemBox } from "../parts/problem.js";
import { timeline } from "../parts/timeline.js";
import { deleteLater } from "../parts/undo.js";
import { askedAndShown } from "../reel/asked.js";
import { fileTable } from "../reel/files.js";
import { wholeScreen } from "../reel/film.js";
import { linkMaker } from "../reel/links.js";
import { changedOf, studioAddress } from "../reel/settings.js";
import { strips } from "../reel/strips.js";
import { PARTS, truthLayer } from "../reel/truth.js";
import { createViews, VIEWS } from "../reel/views.js";
import { factsBox } from "../studio/facts.js";
import { loadFields } from "../studio/schema.js";
import { share } from "../studio/share.js";

/** Advice that the facts of the plan give too. */
const IN_FACTS = ["little_room"];

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { id, query, life }) {
  const flock = await get(`/v1/flocks/${encodeURIComponent(id)}`, life);
  const [name, library] = await Promise.all([flockName(flock), thing("libraries", flock.library_id).catch(() => null)]);
  life.throwIfAborted();
  setTitle(name);
  const size = flock.params.render?.size_px ?? flock.image_size_px;
  const last = flock.frames - 1;
  /** @type {Promise<import("../flock/plan.js").Plan> | null} */
  let planned = null;
  const plan = () => {
    planned ??= planOf(flock.id, life);
    planned.catch(() => { planned = null; });
    return planned;
  };
  const trouble = element("div");
  const onProblem = (/** @type {unknown} */ problem) => trouble.replaceChildren(problemBox(problem));

  // What the address holds: the moment where the flock rests, the view, and the parts of the ground truth.
  const asked = { t: query.get("t"), view: VIEWS.find((one) => one === query.get("view")) ?? "film", truth: (query.get("truth") ?? "").split(",").filter((one) => PARTS.includes(one)) };
  const startFrame = asked.t === null ? null : Math.min(last, Math.max(0, Math.round(Number(asked.t) * flock.fps) || 0));
  let moment = startFrame === null ? null : (startFrame / flock.fps).toFixed(2);
  let { view, truth: parts } = asked;
  function tellAddress() {
    const now = new URLSearchParams();
    if (moment !== null) now.set("t", moment);
    if (view !== "film") now.set("view", view);
    if (parts.length) now.set("truth", parts.join(","));
    replaceAddress(`/flocks/${flock.id}${now.size ? `?${now}`.replaceAll("%2C", ",") : ""}`);
  }

  /** @type {ReturnType<typeof strips>} */
  let figures = null;
  const seek = (/** @type {number} */ frame) => { views.seek(frame); onFrame(frame); };
  const scrub = (/** @type {number} */ frame) => { seek(frame); moment = (frame / flock.fps).toFixed(2); tellAddress(); };
  function onFrame(/** @type {number} */ frame) {
    time.setFrame(frame);
    figures?.setFrame(frame);
    askedPart.setFrame(frame);
    truth?.setFrame(frame);
    shown = frame;
  }
  let shown = startFrame ?? 0;
  const askedPart = askedAndShown(flock, { seek: scrub, life });
  const time = timeline({ life, seek, toggle: () => views.toggle(), onScrub: (time_s) => { moment = time_s.toFixed(2); tellAddress(); } });
  time.setSpan(flock.frames, flock.fps);
  const views = createViews({
    flock, plan, size, poster: flock.params.render?.formats?.includes("poster") && startFrame === null ? posterOf(flock) : undefined, startFrame, life, onFrame, onProblem,
    onState(isPlaying) { time.setPlaying(isPlaying); if (isPlaying && moment !== null) { moment = null; tellAddress(); } },
  });
  const hasTruth = flock.params.render?.ground_truth !== false;
  const truth = hasTruth ? truthLayer({ flock, plan, on: parts, life, onProblem, size: () => (views.video.videoWidth ? [views.video.videoWidth, views.video.videoHeight] : size), onChange(on) { parts = on; tellAddress(); } }) : null;
  if (truth) views.stage.append(truth.canvas);

  const radios = VIEWS.map((one) => element("input", { type: "radio", name: "view", value: one, checked: one === view, onchange: () => { view = one; tellAddress(); choose(); } }));
  const choices = element("fieldset.choices", {}, element("legend.unseen", {}, say("reel.view")), ...radios.map((input) => element("label.choice", {}, input, element("span", {}, say(`reel.view.${input.value}`)))));
  function choose() {
    if (truth) truth.choices.disabled = view !== "film";
    views.choose(view);
  }
  const studio = element("a.button", { href: `/libraries/${flock.library_id}/studio` }, say("reel.studio"));
  const drop = element("button.quiet", { type: "button", onclick: discard }, say("reel.delete"));
  const [copy, told] = linkButton(flock.id, { isTold: true });
  const facts = factsBox();
  const ways = share(library ?? { id: flock.library_id });
  const strip = element("div");
  root.append(
    element("header.place-head", {}, element("div", {}, element("h1", { tabIndex: -1 }, name), element("p.soft", {}, factsOf(flock, size))), element("p.actions", {}, studio, copy, drop, told)),
    element("section.reel-view", { "aria-label": say("reel.watch") }, views.stage,
      element("div.stage-controls", {}, choices, truth?.choices, wholeScreen(views.stage, life)), time.node, strip, askedPart.node, trouble, truth?.table),
    facts.node,
    element("div.reel-more", {}, fileTable(flock, filmName(library), life), element("div", {}, linkMaker(flock, life), ways.node)));
  onFrame(shown);
  choose();

  loadFields().then((fields) => {
    if (life.aborted) return;
    const address = studioAddress(flock, fields);
    studio.href = address;
    ways.update(changedOf(flock.params, fields), location.origin + address);
  }).catch((problem) => { if (!life.aborted) onProblem(problem); });
  plan().then((made) => {
    if (life.aborted) return;
    figures = strips(made, { seek: scrub });
    if (figures) strip.append(figures.node);
    figures?.setFrame(shown);
    facts.update({ ...made, head: { ...made.head, advice: adviceOf(flock) } });
  }).catch((problem) => { if (!life.aborted) onProblem(problem); });

  async function discard() {
    const undo = deleteLater({ id: flock.id, path: `/v1/flocks/${flock.id}`, name });
    await go("/flocks");
    undo.focus();
  }
}

/** Returns length, size, seed, age and bytes of a flock. @param {Api.Flock} flock @param {number[]} size */
const factsOf = ({ frames, fps, seed, created_at, size_bytes }, size) => [seconds(frames / fps), size.join(" × "), say("flock.seed", { seed: String(seed) }), say("reel.all_files", { size: bytesOf(size_bytes) }), ago(created_at)].join(" · ");

/** Returns the advice of the service as sentences. @param {Api.Flock} flock */
const adviceOf = (flock) => (flock.advice ?? []).filter(({ code }) => !IN_FACTS.includes(code)).map(({ code, sentence }) => ({ code, sentence: sayOr(`reel.advice.${code}`, sentence[0].toUpperCase() + sentence.slice(1)) }));
