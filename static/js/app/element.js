// Builds elements without HTML strings, so that text from file names is never parsed as markup.
// @ts-check

/**
 * Returns an element with properties and children.
 * @template {string} S
 * @param {S} selector a tag with optional id and classes, such as "button.quiet#make"
 * @param {Page.Props<Page.ElementOf<S>>} [props] properties; names with a dash and `role` become attributes, names that
 *   begin with "on" become listeners, and an undefined or null value is left out
 * @param {...Page.Child} children falsy ones are left out
 * @returns {Page.ElementOf<S>}
 */
export function element(selector, props, ...children) {
  const [tag, ...marks] = selector.split(/(?=[.#])/);
  const node = document.createElement(tag);
  for (const mark of marks) {
    if (mark[0] === "#") node.id = mark.slice(1);
    else node.classList.add(mark.slice(1));
  }
  for (const [name, value] of Object.entries(props ?? {})) {
    if (value === undefined || value === null) continue;
    if (name.startsWith("on") && typeof value === "function") node.addEventListener(name.slice(2), /** @type {EventListener} */ (value));
    else if (name.includes("-") || name === "role") node.setAttribute(name, String(value));
    else Object.assign(node, { [name]: value });
  }
  node.append(.../** @type {(Node | string)[]} */ (children.filter((child) => child || child === "")));
  return /** @type {Page.ElementOf<S>} */ (node);
}

const SVG = "http://www.w3.org/2000/svg";

/**
 * Returns an SVG element. @template {string} T @param {T} tag @param {Record<string, string | number>} [attributes] @param {...Node} children
 * @returns {Page.SvgOf<T>}
 */
export function svg(tag, attributes = {}, ...children) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, String(value));
  node.append(...children);
  return /** @type {Page.SvgOf<T>} */ (node);
}

/** Ends the download of a video. Out of the page, it would go on and hold a connection. @param {HTMLVideoElement} video */
export function releaseVideo(video) {
  video.pause();
  video.removeAttribute("src");
  video.load();
}

/** Returns an element of index.html. @param {string} id */
export const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
