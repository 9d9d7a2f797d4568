// The virtual fish beside the film: turned in 3-D, in step, and as a wireframe over the film.
// @ts-check
import { get, request } from "../app/api.js";
import { element } from "../app/element.js";
import { isUnderWay, jobs } from "../app/jobs.js";
import { filmName } from "../app/names.js";
import { go, replaceAddress, setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { NotAFish, readGlb } from "../fish/glb.js";
import { maker, optionsBox } from "../fish/options.js";
import { createPair } from "../fish/pair.js";
import { fishOf, versionTable } from "../fish/versions.js";
import { problemBox, showProblem } from "../parts/problem.js";
/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export async function show(root, { id, query, life }) {
  const [library, all] = await Promise.all([get(`/v1/libraries/${encodeURIComponent(id)}`, life), fishOf(id, life)]);
  setTitle(say("fish.title", { film: filmName(library) }));
  const trouble = element("div");
  root.append(element("header.place-head", {}, element("div", {}, element("h1", { tabIndex: -1 }, say("fish.title", { film: filmName(library) })), element("p.soft", {}, say(library.view === "top" ? "fish.what.top" : "fish.what"))),
    element("p.actions", {}, element("a.button.quiet", { href: `/libraries/${id}` }, say("studio.desk")), element("a.button.quiet", { href: `/films/${library.footage_id}` }, say("desk.the_film")))), trouble);
  const fish = all.find((one) => one.id === query.get("fish")) ?? all[0];
  const open = (/** @type {string} */ fishId) => go(`/libraries/${id}/fish?fish=${fishId}`);
  if (!fish) return showNone(root, { library, life, open });

  const asked = Number.parseFloat(query.get("t") ?? "");
  const startFrame = Number.isFinite(asked) ? Math.min(library.n_frames - 1, Math.max(0, Math.floor(asked * library.fps + 1e-6))) : null;
  /** @param {number | null} frame at which it rests */
  const onRest = (frame) => {
    const now = new URLSearchParams();
    // Rounded up, so that the time lies within its frame.
    if (frame !== null) now.set("t", String(Math.ceil((frame / library.fps) * 1000 - 1e-6) / 1000));
    if (fish !== all[0]) now.set("fish", fish.id);
    if (!life.aborted) replaceAddress(`/libraries/${id}/fish${now.size ? `?${now}` : ""}`);
  };
  const model = await modelOf(fish.id, life).catch((problem) => {
    if (life.aborted) return null;
    if (problem instanceof NotAFish) trouble.replaceChildren(element("p.soft", {}, say("fish.not_ours")));
    else showProblem(trouble, problem);
    return null;
  });
  if (life.aborted) return undefined;
  const onDelete = (/** @type {string} */ gone) => { if (gone === fish.id) go(`/libraries/${id}/fish`); };
  const below = element("div.fish-below", {}, versionTable(all, { library, shown: fish.id, life, onDelete }));
  root.append(createPair({ library, id: fish.id, fish: model, startFrame, life, onRest }), below);
  return optionsBox({ library, params: fish.params, life, onMade: open }).then((box) => below.append(box), (problem) => { if (!life.aborted) below.append(problemBox(problem)); });
}

/** @param {string} id @param {AbortSignal} life */
const modelOf = async (id, life) => readGlb(await (await request("GET", `/v1/fish/${id}/model.glb`, { signal: life })).arrayBuffer());

/** A film without a virtual fish: one button makes it. @param {HTMLElement} root @param {{library: Api.Library, life: AbortSignal, open: (fishId: string) => void}} options */
function showNone(root, { library, life, open }) {
  const { button, state, follow } = maker({ libraryId: library.id, settings: () => ({}), life, onMade: open, isFirst: true });
  root.append(element("section.fish-none", {}, element("img", { src: `/v1/libraries/${library.id}/poster.jpg`, alt: say("fish.left") }), element("p", {}, say("fish.none")), element("p.actions", {}, button), state));
  const running = jobs.value.find((job) => job.kind === "fish" && job.subject?.id === library.id && isUnderWay(job));
  if (running) follow(running.id).catch((problem) => { if (!life.aborted && problem.name !== "AbortError") state.replaceChildren(problemBox(problem)); });
}
