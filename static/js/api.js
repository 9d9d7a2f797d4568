// The requests of the page. Every error response becomes a Problem.
// @ts-check

/** An error as a problem document of the service (RFC 9457). */
export class Problem extends Error {
  /** @param {{title?: string, detail?: string, code?: string, advice?: string, picture?: string | null, status?: number}} body */
  constructor(body) {
    super(body.title ?? "The request failed");
    this.title = this.message;
    this.detail = body.detail ?? "";
    this.code = body.code ?? "";
    this.advice = body.advice ?? "";
    this.picture = body.picture ?? null;
    this.status = body.status ?? 0;
  }
}

export const unreachable = () => new Problem({
  title: "The service cannot be reached",
  detail: "The service may have stopped, or the connection was interrupted. Stored data is not lost.",
});

/** @param {string} text @param {number} status */
export function problemFrom(text, status) {
  if (status === 401) dispatchEvent(new Event("signed-out"));
  try {
    return new Problem({ status, ...JSON.parse(text) });
  } catch {
    return new Problem({ status, title: `The service answered with ${status}`, detail: text.slice(0, 200) });
  }
}

/** @param {string} method @param {string} path @param {unknown} [body] */
async function call(method, path, body) {
  const headers = body === undefined ? {} : { "Content-Type": "application/json" };
  const answer = await fetch(path, { method, headers, body: body === undefined ? undefined : JSON.stringify(body) })
    .catch(() => { throw unreachable(); });
  const text = await answer.text();
  if (!answer.ok) throw problemFrom(text, answer.status);
  return text ? JSON.parse(text) : null;
}

export const beginSession = (token) => call("POST", "/v1/session", { token });
export const endSession = () => call("DELETE", "/v1/session");
export const createAnalysis = (footageId, params) => call("POST", "/v1/analyses", { footage_id: footageId, params });
export const createFlock = (wishes) => call("POST", "/v1/flocks", wishes);
export const getFootage = (id) => call("GET", `/v1/footage/${id}`);
export const getLibrary = (id) => call("GET", `/v1/libraries/${id}`);
export const getPoses = (id) => call("GET", `/v1/libraries/${id}/poses.json`);
export const getFlock = (id) => call("GET", `/v1/flocks/${id}`);
export const getJob = (id) => call("GET", `/v1/jobs/${id}`);
export const cancelJob = (id) => call("DELETE", `/v1/jobs/${id}`);
export const listLibraries = async () => (await call("GET", "/v1/libraries?limit=20")).items;
export const listFlocks = async () => (await call("GET", "/v1/flocks?limit=20")).items;
export const listJobs = async () => (await call("GET", "/v1/jobs?limit=20")).items;
