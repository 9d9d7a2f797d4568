// The files of a flock in a table: name, use, size.
// @ts-check
import { request } from "../app/api.js";
import { element } from "../app/element.js";
import { say, sayOr, size } from "../app/words.js";
import { filesOf, savedName } from "./settings.js";

/** Time after which a size is left out, ms. */
const SIZE_MS = 4000;
/** File that the service computes when it is downloaded: its size is not known before. */
const SCHOOL = "school.glb";

/** @param {Api.Flock} flock @param {string} film name of the film @param {AbortSignal} life */
export function fileTable(flock, film, life) {
  const heads = ["name", "use", "size"].map((name) => element("th", { scope: "col" }, say(`reel.files.${name}`)));
  const rows = [...filesOf(flock), SCHOOL].map((name) => row(name, { flock, film, life }));
  return element("section", {}, element("h2", {}, say("reel.files")),
    element("div.table-scroll", { tabIndex: 0, role: "region", "aria-label": say("reel.files") }, element("table.files", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...rows))));
}

/** @param {string} name @param {{flock: Api.Flock, film: string, life: AbortSignal}} of */
function row(name, { flock, film, life }) {
  const address = `/v1/flocks/${flock.id}/${name}`;
  const told = (flock.files ?? []).find((file) => file.name === name);
  const bytes = element("td.size", {}, told ? size(told.size_bytes) : "");
  const node = element("tr", {}, element("th", { scope: "row" }, element("a", { href: address, download: savedName(name, flock, film) }, name)), element("td", {}, sayOr(`reel.file.${name}`, "")), bytes);
  if (!told && name !== SCHOOL) sizeOf(address, life).then((n) => { if (n > 0) bytes.textContent = size(n); }, (problem) => { if (problem.status === 404) node.remove(); });
  return node;
}

/** Returns the bytes of a file; fails with 404 where a flock of an older version lacks it. @param {string} address @param {AbortSignal} life */
async function sizeOf(address, life) {
  const response = await request("HEAD", address, { signal: AbortSignal.any([life, AbortSignal.timeout(SIZE_MS)]) });
  // A response that is not read counts as a failed request.
  await response.arrayBuffer();
  return Number(response.headers.get("Content-Length"));
}
