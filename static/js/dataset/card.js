// The card of a finished data set: its samples, what it has, and its files.
// @ts-check
import { element } from "../app/element.js";
import { filmName } from "../app/names.js";
import { ago, count, say, size } from "../app/words.js";
import { pinButton } from "../parts/pin.js";
import { deleteLater } from "../parts/undo.js";

/** Files beside the archive. */
const OTHERS = ["README.md", "manifest.json"];

/** @param {Api.Dataset} dataset @param {(problem: unknown) => void} tell */
export function datasetCard(dataset, tell) {
  const path = /** @type {`/v1/datasets/${string}`} */ (`/v1/datasets/${dataset.id}`);
  const name = say("data.of", { film: filmName(dataset), pictures: count(dataset.pictures) });
  const other = (/** @type {string} */ file) => element("a.file-link", { href: `${path}/${file}`, target: "_blank", rel: "noopener", "aria-label": say("data.file.of", { file, name }) }, file);
  const drop = element("button.quiet.small", { type: "button", "aria-label": say("reels.delete.of", { name }), onclick: () => deleteLater({ id: dataset.id, path, name }).focus() }, say("reel.delete"));
  return element("li.card-small", { id: `dataset-${dataset.id}` },
    element("a", { href: `${path}/sheet.jpg`, target: "_blank", rel: "noopener", "aria-label": say("data.sheet.of", { name }) }, element("img", { src: `${path}/sheet.jpg`, alt: "", loading: "lazy", width: 320, height: 180 })),
    element("strong", {}, name), element("small", {}, [say("data.flocks", { n: dataset.flocks }), size(dataset.size_bytes), ago(dataset.created_at)].join(" · ")),
    element("p.actions", {}, element("a.button", { href: `${path}/dataset.zip`, download: "", "aria-label": say("data.save.of", { name }) }, say("data.save")), ...OTHERS.map(other)),
    element("div.card-foot", {}, pinButton({ path, isPinned: dataset.pinned, name }, tell), drop));
}
