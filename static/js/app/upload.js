// Uploads of films. Small files are sent at once, larger ones in pieces by tus, which goes on after a cut
// connection or a reload of the page.
// @ts-check
import { get, problemFrom, unreachable } from "./api.js";
import { uploads } from "./jobs.js";

/** Size above which a file is sent by tus, bytes. Free choice: a few seconds on a slow connection. */
const RESUMED_BYTES = 4e6;
/** Size of a piece of tus, bytes. */
const PIECE_BYTES = 8e6;

/**
 * @typedef {{id: number, name: string, address: string, sent: number, total: number, state: "sending" | "checking" | "failed" | "paused", problem: unknown, cancel: () => void}} Upload
 *   address: the film itself, in this tab
 */

/** Addresses of films that this tab has sent, by the id of their footage: they play before they are measured. @type {Map<string, string>} */
export const sent = new Map();
let n_uploads = 0;
const newId = () => n_uploads += 1;

/** Shows uploads that a reload interrupted: the browser forgets the file, so a person must choose it again. */
export function tellInterrupted() {
  for (const [key, text] of Object.entries({ ...localStorage })) {
    if (!key.startsWith("tus::")) continue;
    /** @type {Upload} */
    const upload = { id: newId(), name: JSON.parse(text).metadata?.filename ?? "", address: "", sent: 0, total: 0, state: "paused", problem: null,
      cancel: () => { localStorage.removeItem(key); forget(upload); } };
    uploads.set([...uploads.value, upload]);
  }
}

/** @param {Upload} upload @param {Partial<Upload>} change */
function update(upload, change) {
  Object.assign(upload, change);
  uploads.set([...uploads.value]);
}

/** @param {Upload} upload */
const forget = (upload) => uploads.set(uploads.value.filter((other) => other !== upload));

/**
 * Sends a film. Its card in the tray shows the progress.
 * @param {File} file @returns {Promise<Api.Footage>} the footage; an AbortError if the person cancelled
 */
export async function send(file) {
  const stop = new AbortController();
  /** @type {Upload} */
  const upload = { id: newId(), name: file.name, address: URL.createObjectURL(file), sent: 0, total: file.size, state: "sending", problem: null, cancel: () => stop.abort() };
  uploads.set([upload, ...uploads.value.filter((other) => other.state !== "paused" || other.name !== file.name)]);
  const discard = () => { forget(upload); URL.revokeObjectURL(upload.address); };
  try {
    const tus = file.size > RESUMED_BYTES ? await import("/vendor/tus.js").catch(() => null) : null;
    stop.signal.throwIfAborted();
    const footage = await (tus ? sendInPieces(tus, file, upload, stop.signal) : sendAtOnce(file, upload, stop.signal));
    forget(upload);
    URL.revokeObjectURL(sent.get(footage.id) ?? "");
    sent.set(footage.id, upload.address);
    return footage;
  } catch (problem) {
    if (/** @type {any} */ (problem).name === "AbortError") discard();
    else update(upload, { state: "failed", problem, cancel: discard });
    throw problem;
  }
}

/** @param {Upload} upload @param {number} sent @param {number} total */
const report = (upload, sent, total) => update(upload, { sent, total, state: sent < total ? "sending" : "checking" });

/** @param {File} file @param {Upload} upload @param {AbortSignal} stop @returns {Promise<Api.Footage>} */
function sendAtOnce(file, upload, stop) {
  return new Promise((resolve, reject) => {
    // fetch reports no progress of an upload.
    const request = new XMLHttpRequest();
    stop.addEventListener("abort", () => request.abort());
    request.upload.addEventListener("progress", (event) => report(upload, event.loaded, event.total || file.size));
    request.addEventListener("load", () => {
      if (request.status >= 200 && request.status < 300) resolve(JSON.parse(request.responseText));
      else reject(problemFrom(request.responseText, request.status));
    });
    request.addEventListener("error", () => reject(unreachable()));
    request.addEventListener("abort", () => reject(stop.reason));
    request.open("POST", `/v1/footage?name=${encodeURIComponent(file.name)}`);
    request.setRequestHeader("Content-Type", file.type || "application/octet-stream");
    request.send(file);
  });
}

/**
 * @param {Pick<typeof import("/vendor/tus.js"), "Upload">} tus @param {File} file @param {Upload} upload @param {AbortSignal} stop
 * @returns {Promise<Api.Footage>}
 */
function sendInPieces(tus, file, upload, stop) {
  return new Promise((resolve, reject) => {
    let address = "";
    const sending = new tus.Upload(file, {
      endpoint: "/v1/uploads",
      metadata: { filename: file.name, filetype: file.type || "application/octet-stream" },
      chunkSize: PIECE_BYTES,
      retryDelays: [0, 500, 1000, 2000, 4000, 8000, 16000, 30000],
      removeFingerprintOnSuccess: true,
      onProgress: (sent, total) => report(upload, sent, total),
      // The response to the last piece names the footage.
      onAfterResponse: (_, response) => { address = /<([^>]+)>/.exec(response.getHeader("Link") ?? "")?.[1] ?? address; },
      onError: (error) => {
        const response = "originalResponse" in error && error.originalResponse;
        reject(response ? problemFrom(response.getBody(), response.getStatus()) : unreachable());
      },
      onSuccess: () => get(/** @type {`/v1/footage/${string}`} */ (address)).then(resolve, reject),
    });
    stop.addEventListener("abort", () => {
      reject(stop.reason);
      // The service forgets what was sent; if it cannot be reached, it does so by itself after a while.
      sending.abort(true).catch(() => {});
    });
    sending.findPreviousUploads().then((former) => {
      if (stop.aborted) return;
      if (former[0]) sending.resumeFromPreviousUpload(former[0]);
      sending.start();
    }).catch(reject);
  });
}
