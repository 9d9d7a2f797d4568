// Places and their addresses. Links inside the page change the place without loading the page again.
// @ts-check
import { byId, element } from "./element.js";
import { placeModule } from "./place-module.js";
import { showProblem } from "../parts/problem.js";
import { say } from "./words.js";

/**
 * @typedef {{job?: string, isKnown?: boolean}} Given the job that measures a film; or that it was measured before
 * @typedef {{id: string, query: URLSearchParams, life: AbortSignal, state?: Given}} Visit id of the address, its
 *   query, and a signal that is aborted when the person leaves the place
 * @typedef {{show: (root: HTMLElement, visit: Visit) => Promise<void> | void}} Place
 */

/** Patterns of addresses with the module of their place, and the part of the navigation they belong to. */
const ROUTES = [
  { pattern: /^\/$/, place: "home", nav: "" },
  { pattern: /^\/films$/, place: "films", nav: "films" },
  { pattern: /^\/films\/([^/]+)$/, place: "film", nav: "films" },
  { pattern: /^\/libraries\/([^/]+)$/, place: "desk", nav: "films" },
  { pattern: /^\/libraries\/([^/]+)\/studio$/, place: "studio", nav: "studio" },
  { pattern: /^\/studio$/, place: "studio", nav: "studio" },
  { pattern: /^\/libraries\/([^/]+)\/fish$/, place: "fish", nav: "films" },
  { pattern: /^\/flocks$/, place: "reels", nav: "flocks" },
  { pattern: /^\/flocks\/([^/]+)$/, place: "reel", nav: "flocks" },
  { pattern: /^\/datasets$/, place: "datasets", nav: "flocks" },
  { pattern: /^\/jobs$/, place: "jobs", nav: "jobs" },
  { pattern: /^\/s\/([^/]+)$/, place: "shared", nav: "" },
];

/** Style sheets of the places that are instruments, in the order of the cascade. The others use those of index.html. */
const STYLES = ["form", "timeline", "studio", "reel", "desk", "fish", "editor"];
const PLAIN = ["home", "films", "film", "jobs", "missing"];

let leaving = new AbortController();

/** Starts the router: shows the place of the current address. */
export function startRouter() {
  history.scrollRestoration = "manual";
  addEventListener("popstate", () => show({ scroll: history.state?.scroll ?? 0 }));
  document.addEventListener("click", (event) => {
    const link = /** @type {HTMLElement} */ (event.target).closest?.("a[href]");
    // A link within the place moves the focus only: following it would build the place again.
    if (link instanceof HTMLAnchorElement && link.hash && link.pathname === location.pathname && link.origin === location.origin) {
      event.preventDefault();
      byId(link.hash.slice(1))?.focus();
      return;
    }
    if (!(link instanceof HTMLAnchorElement) || !isInside(link, event)) return;
    event.preventDefault();
    go(link.pathname + link.search);
  });
  return show({});
}

/** @param {HTMLAnchorElement} link @param {MouseEvent} event */
function isInside(link, event) {
  const plain = event.button === 0 && !event.metaKey && !event.ctrlKey && !event.shiftKey && !event.altKey;
  // The page of a guest has not started its jobs, so its links load the page.
  return plain && !document.body.classList.contains("guest") && !event.defaultPrevented && !link.target && !link.hasAttribute("download") &&
    link.origin === location.origin && routeOf(link.pathname) !== undefined && !link.hash;
}

/** @param {string} path */
const routeOf = (path) => ROUTES.find(({ pattern }) => pattern.test(path));

/** Goes to an address of the page. @param {string} address @param {Given} [state] handed to the place */
export function go(address, state) {
  history.replaceState({ ...history.state, scroll: scrollY }, "");
  history.pushState({ given: state }, "", address);
  return show({ focus: true });
}

/** Changes the address of the current place, for instance while scrubbing. @param {string} address */
export const replaceAddress = (address) => history.replaceState(history.state, "", address);

/** Sets the title of the document. @param {string} [title] */
export const setTitle = (title) => { document.title = title ? `${title} · flockreel` : "flockreel"; };

/** Style sheets that were asked for, by address. @type {Map<string, Promise<unknown>>} */
const styles = new Map();

/** Loads a style sheet once and waits for it. @param {string} href */
export function styled(href) {
  const loading = styles.get(href) ?? new Promise((resolve) => document.head.append(element("link", { rel: "stylesheet", href, onload: resolve, onerror: resolve })));
  styles.set(href, loading);
  return loading;
}

/** @returns {Promise<void>} */
async function show({ focus = false, scroll = 0 }) {
  leaving.abort();
  leaving = new AbortController();
  const life = leaving.signal;
  const route = routeOf(location.pathname);
  for (const link of document.querySelectorAll("[data-nav]")) {
    const isHere = /** @type {HTMLElement} */ (link).dataset.nav === (route?.nav || "none");
    if (isHere) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  const root = byId("place");
  setTitle();
  try {
    const id = decodeURIComponent(route?.pattern.exec(location.pathname)?.[1] ?? "");
    const name = route?.place ?? "missing";
    /** @type {[Place, ...unknown[]]} */
    const [place] = await Promise.all([placeModule(name, life, (problem) => fail(root, problem)), ...(PLAIN.includes(name) ? [] : STYLES.map((sheet) => styled(`/static/css/${sheet}.css`)))]);
    if (life.aborted) return;
    root.replaceChildren();
    root.className = `place place-${name}`;
    const shown = place.show(root, { id, query: new URLSearchParams(location.search), life, state: history.state?.given });
    scrollTo(0, scroll);
    await shown;
    if (life.aborted) return;
    if (focus) root.querySelector("h1")?.focus({ preventScroll: true });
    if (scroll) scrollTo(0, scroll);
  } catch (problem) {
    if (life.aborted || /** @type {any} */ (problem).name === "AbortError") return;
    await fail(root, problem);
    if (focus) root.querySelector("h1")?.focus({ preventScroll: true });
  }
}

/** Shows why a place cannot be shown. @param {HTMLElement} root @param {any} problem */
async function fail(root, problem) {
  // An address such as /films/%ff names nothing.
  const isMissing = problem.status === 404 || problem instanceof URIError;
  const missing = isMissing && !root.querySelector("h1") && await import("../places/missing.js").catch(() => null);
  if (missing) return missing.show(root);
  setTitle(say("problem.title"));
  showProblem(root, problem);
  root.prepend(element("h1", { tabIndex: -1 }, say("problem.title")));
}
