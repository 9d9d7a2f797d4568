// A reel for friends: the film and its figures by a signed link, without a token.
// @ts-check
import { unreachable } from "../app/api.js";
import { element } from "../app/element.js";
import { isCalm } from "../app/motion.js";
import { replaceAddress, setTitle } from "../app/router.js";
import { day, say, seconds } from "../app/words.js";
import { decodePlan } from "../flock/plan.js";
import { timeline } from "../parts/timeline.js";
import { film, wholeScreen } from "../reel/film.js";
import { readLink } from "../reel/shared-link.js";
import { sharedTitle } from "../reel/shared-title.js";
import { strips } from "../reel/strips.js";
import { factsBox } from "../studio/facts.js";

/** Names of the formats that keep transparency. @type {Record<string, string>} */
const NAMES = { webm: "WebM", mov: "MOV" };

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { id, query, life }) {
  root.classList.add("place-reel");
  const link = readLink(id);
  if (!link) return refuse(root, "shared.broken");
  if (link.expires_s * 1000 <= Date.now()) return refuse(root, "shared.over", { time: day(new Date(link.expires_s * 1000).toISOString()) });
  const [saved, planned] = link.files;
  const { webm } = link.offered;
  const isClear = Boolean(webm);
  const clear = Object.entries(link.offered);
  const source = webm ?? saved;
  // Without the sign-in form: a friend has no token.
  const answer = await fetch(planned, { signal: life }).catch((error) => { throw error.name === "AbortError" ? error : unreachable(); });
  if (!answer.ok) return refuse(root, "shared.gone");
  const plan = decodePlan(await answer.arrayBuffer());
  const size = plan.head.params?.render?.size_px ?? plan.sizePx;
  const name = sharedTitle(plan, answer.headers.get("content-disposition") ?? "");
  setTitle(name);

  const asked = query.get("t");
  const startFrame = asked === null ? null : Math.min(plan.nFrames - 1, Math.max(0, Math.round(Number(asked) * plan.fps) || 0));
  const tell = (/** @type {string | null} */ moment) => replaceAddress(`/s/${id}${moment === null ? "" : `?t=${moment}`}`);
  const seek = (/** @type {number} */ frame) => { shot.pause(); shot.seek(frame); onFrame(frame); };
  const time = timeline({ life, seek, toggle: () => (shot.isPlaying ? shot.pause() : shot.play()), onScrub: (time_s) => tell(time_s.toFixed(2)) });
  const figures = strips(plan, { seek: (frame) => { seek(frame); tell((frame / plan.fps).toFixed(2)); } });
  const onFrame = (/** @type {number} */ frame) => { time.setFrame(frame); figures?.setFrame(frame); };
  const stage = element("div.stage");
  stage.dataset.look = "film";
  stage.classList.toggle("is-clear", isClear);
  stage.style.aspectRatio = size.join(" / ");
  stage.style.maxInlineSize = `calc(max(15rem, 100dvh - 21rem) * ${size[0] / size[1]})`;
  const shot = film({ src: source, poster: undefined, fps: plan.fps, n_frames: plan.nFrames, label: say("reel.film"), life, onFrame,
    onState(isPlaying) { time.setPlaying(isPlaying); if (isPlaying) tell(null); }, onBroken: () => stage.append(element("p.stage-note", {}, say("shared.unplayable"))) });
  stage.append(shot.node);
  time.setSpan(plan.nFrames, plan.fps);
  onFrame(startFrame ?? 0);
  if (startFrame !== null) shot.seek(startFrame);
  else if (!isCalm()) shot.play();
  const facts = factsBox({ advises: false });
  facts.update(plan);
  root.append(
    element("header.place-head", {}, element("div", {}, element("h1", { tabIndex: -1 }, name), element("p.soft", {}, [seconds(plan.nFrames / plan.fps), size.join(" × "), say("reel.link.until", { time: day(new Date(link.expires_s * 1000).toISOString()) })].join(" · "))),
      element("p.actions", {}, ...clear.map(([word, href]) => element("a.button", { href, download: "" }, say("shared.save_clear", { format: NAMES[word] }))), element("a.button.quiet", { href: saved, download: "" }, say(clear.length ? "shared.save_opaque" : "shared.save")))),
    element("section.reel-view", { "aria-label": say("reel.watch") }, stage, element("div.stage-controls", {}, element("p.soft", {}, say("shared.what")), wholeScreen(stage, life)), time.node, figures?.node ?? ""),
    facts.node);
  return undefined;
}

/** @param {HTMLElement} root @param {string} key @param {import("../app/words.js").Values} [values] */
function refuse(root, key, values) {
  setTitle(say(key));
  root.append(element("h1", { tabIndex: -1 }, say(key)), element("p", {}, say(`${key}.help`, values)));
}
