// Uploads a film and reports the progress. It uses XMLHttpRequest, because fetch reports no upload progress.
// @ts-check
import { problemFrom, unreachable } from "./api.js";

/**
 * @param {File} file
 * @param {(sent: number, total: number) => void} onProgress bytes
 * @returns {{footage: Promise<any>, cancel: () => void}}
 */
export function upload(file, onProgress) {
  const request = new XMLHttpRequest();
  const footage = new Promise((resolve, reject) => {
    request.upload.addEventListener("progress", (event) => onProgress(event.loaded, event.total || file.size));
    request.addEventListener("load", () => {
      if (request.status >= 200 && request.status < 300) resolve(JSON.parse(request.responseText));
      else reject(problemFrom(request.responseText, request.status));
    });
    request.addEventListener("error", () => reject(unreachable()));
    request.addEventListener("abort", () => reject(new DOMException("cancelled", "AbortError")));
    request.open("POST", `/v1/footage?name=${encodeURIComponent(file.name)}`);
    request.setRequestHeader("Content-Type", file.type || "application/octet-stream");
    request.send(file);
  });
  return { footage, cancel: () => request.abort() };
}
