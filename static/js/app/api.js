// The requests of the page. Every error response becomes a Problem.
// @ts-check
import { say } from "./words.js";

/** An error as a problem document of the service (RFC 9457). */
export class Problem extends Error {
  /** @param {Partial<Api.Schemas["ProblemBody"]> & Partial<Pick<Api.Schemas["JobFailure"], "picture" | "params">>} body */
  constructor(body) {
    super(body.title ?? say("problem.title"));
    this.title = this.message;
    this.detail = body.detail ?? "";
    this.code = body.code ?? "";
    this.advice = body.advice ?? "";
    this.picture = body.picture ?? null;
    this.mends = body.mends ?? [];
    this.params = body.params ?? null;
    this.status = body.status ?? 0;
  }
}

/** Key of local storage that records a session, because the page cannot see its cookie. */
const SIGNED_IN = "flockreel-signed-in";
/** Whether the person has signed in, and so the service asks for a token. */
export const isSignedIn = () => localStorage.getItem(SIGNED_IN) !== null;
export const rememberSession = () => localStorage.setItem(SIGNED_IN, "yes");
export const forgetSession = () => localStorage.removeItem(SIGNED_IN);

export const unreachable = () => new Problem({ title: say("problem.unreachable"), detail: say("problem.unreachable.detail") });

/** @param {string} text @param {number} status */
export function problemFrom(text, status) {
  if (status === 401) dispatchEvent(new Event("signed-out"));
  try {
    return new Problem({ status, ...JSON.parse(text) });
  } catch {
    return new Problem({ status, title: say("problem.status", { status }), detail: text.slice(0, 200) });
  }
}

/**
 * Sends a request and returns the response, or throws a Problem.
 * @param {string} method @param {string} path
 * @param {{body?: unknown, accept?: string, signal?: AbortSignal, headers?: Record<string, string>}} [options] the body is sent as JSON, or as the form that it is
 */
export async function request(method, path, { body, accept, signal, headers = {} } = {}) {
  const isForm = body instanceof FormData;
  if (body !== undefined && !isForm) headers = { "Content-Type": "application/json", ...headers };
  if (accept) headers = { Accept: accept, ...headers };
  const response = await fetch(path, { method, headers, signal, body: body === undefined || isForm ? body : JSON.stringify(body) })
    .catch((error) => { throw error.name === "AbortError" ? error : unreachable(); });
  if (!response.ok) throw problemFrom(await response.text(), response.status);
  return response;
}

/** @param {string} method @param {string} path @param {Parameters<typeof request>[2]} [options] @returns {Promise<any>} the JSON of the response; null if it has none */
async function call(method, path, options) {
  const text = await (await request(method, path, options)).text();
  return text ? JSON.parse(text) : null;
}

/** @template {Api.Address<"get">} P @param {P} path @param {AbortSignal} [signal] @returns {Promise<Api.Json<"get", P>>} */
export const get = (path, signal) => call("GET", path, { signal });
/** @template {Api.Address<"post">} P @param {P} path @param {Api.Body<"post", P>} [body] @param {AbortSignal} [signal] @returns {Promise<Api.Json<"post", P>>} */
export const post = (path, body, signal) => call("POST", path, { body, signal });
/** @template {Api.Address<"patch">} P @param {P} path @param {Api.Body<"patch", P>} body @returns {Promise<Api.Json<"patch", P>>} */
export const patch = (path, body) => call("PATCH", path, { body });
/** @param {Api.Address<"delete">} path */
export const remove = (path) => call("DELETE", path);

/**
 * Returns the items of a list, newest first, and the address of the next page.
 * @template {Api.Address<"get">} P
 * @param {P} path @param {AbortSignal} [signal] @returns {Promise<{items: Api.Item<P>[], next: Api.Next<P>}>}
 */
export async function list(path, signal) {
  const page = await call("GET", path, { signal });
  const url = new URL(path, location.origin);
  url.searchParams.set("cursor", page.next_cursor);
  return { items: page.items, next: page.next_cursor && url.pathname + url.search };
}
