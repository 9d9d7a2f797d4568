// Films dropped anywhere on the page, or chosen with a button: each is sent and measured.
// @ts-check
import { list, post, Problem, unreachable } from "../app/api.js";
import { byId, element } from "../app/element.js";
import { expect, uploads } from "../app/jobs.js";
import { go } from "../app/router.js";
import { say } from "../app/words.js";
import { openTray } from "./tray-button.js";

/** Endings of files that the service may be able to read; the choice of files begins with these. */
const ACCEPT = "video/*,.mkv,.avi,.mov,.ts,.mts,.m2ts,.mpg,.vob,.wmv,.asf,.flv,.ogv,.3gp,.h264,.hevc,.gif,.png,.apng,.webp,.zip,.tif,.tiff";

/** Accepts films that are dropped on the page. */
export function startDrop() {
  const veil = element("div.veil", { hidden: true, "aria-hidden": "true" }, element("strong", {}, say("drop.here")));
  document.body.append(veil);
  let depth = 0;
  const hasFiles = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files");
  const show = (/** @type {number} */ change) => { depth = Math.max(0, depth + change); veil.hidden = depth === 0; };
  addEventListener("dragenter", (event) => { if (hasFiles(event)) show(1); });
  addEventListener("dragleave", (event) => { if (hasFiles(event)) show(-1); });
  addEventListener("dragover", (event) => { if (hasFiles(event)) event.preventDefault(); });
  addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    depth = 0;
    veil.hidden = true;
    const data = /** @type {DataTransfer} */ (event.dataTransfer);
    // A folder looks like a file that cannot be read.
    const folders = [...data.items].map((item) => item.webkitGetAsEntry?.()).filter((entry) => entry?.isDirectory).map((entry) => entry?.name ?? "");
    for (const name of folders) refuseFolder(name);
    measureAll([...data.files].filter((file) => !folders.includes(file.name)));
  });
}

/** Puts a folder into the tray as refused. @param {string} name */
const refuseFolder = (name) => tellInTray(name, new Problem({ title: say("drop.folder"), detail: say("drop.folder.detail") }));

let n_told = 0;

/** Shows a problem in the tray. @param {string} name @param {unknown} problem */
function tellInTray(name, problem) {
  /** @type {import("../app/upload.js").Upload} */
  const told = { id: n_told -= 1, name, address: "", sent: 0, total: 0, state: "failed", problem, cancel: () => uploads.set(uploads.value.filter((other) => other !== told)) };
  uploads.set([told, ...uploads.value]);
  openTray();
}

/**
 * Returns a button that opens the choice of files. @param {string} label @param {{camera?: boolean}} [options] with
 * `camera`, a phone films at once
 */
export function fileButton(label, { camera = false } = {}) {
  const input = element("input.file", { type: "file", accept: camera ? "video/*" : ACCEPT, multiple: !camera, "aria-label": label });
  if (camera) input.setAttribute("capture", "environment");
  input.addEventListener("change", () => { measureAll([...input.files ?? []]); input.value = ""; });
  return element("label.button.file-button", {}, label, input);
}

/**
 * Sends films and starts their analyses. One film's place is shown once it has arrived; of several, the place
 * of all films. If the person has left the place meanwhile, it is not changed. @param {File[]} files
 */
async function measureAll(files) {
  if (!files.length) return;
  openTray();
  const sender = await import("../app/upload.js").catch(() => null);
  if (!sender) return files.forEach(({ name }) => tellInTray(name, unreachable()));
  const { send } = sender;
  const from = location.pathname;
  const isOne = files.length === 1;
  const arrived = await Promise.all(files.map(async (file) => {
    // The tray shows the reason of a failure.
    const footage = await send(file).catch(() => null);
    if (!footage) return false;
    const show = isOne && location.pathname === from;
    if (await isMeasured(footage.id).catch(() => false)) {
      if (show) go(`/films/${footage.id}`, { isKnown: true });
    } else await measure(footage.id, {}, { show });
    return true;
  }));
  if (arrived.every(Boolean)) byId("tray").hidePopover?.();
  if (!isOne && arrived.some(Boolean) && location.pathname === from) go("/films");
  return undefined;
}

/** @param {string} footageId */
const isMeasured = async (footageId) => (await list(`/v1/libraries?footage_id=${footageId}&limit=1`)).items.length > 0;

/**
 * Starts an analysis and shows its film. The tray tells why if it cannot start.
 * @param {string} footageId @param {Api.AnalysisChanges} params @param {{show: boolean}} options
 */
export async function measure(footageId, params, { show }) {
  try {
    const { job_id } = await post("/v1/analyses", { footage_id: footageId, params });
    await expect(job_id);
    if (!show) return;
    byId("tray").hidePopover?.();
    go(`/films/${footageId}`, { job: job_id });
  } catch (problem) {
    tellInTray(say("film.measure"), problem);
  }
}
