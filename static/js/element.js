// Builds elements without HTML strings, so that text from file names is never parsed as markup.
// @ts-check

/**
 * @param {string} tag
 * @param {Record<string, any>} [props] properties; names with a dash become attributes
 * @param {...(Node | string)} children
 */
export function element(tag, props = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (name.includes("-")) node.setAttribute(name, value);
    else node[name] = value;
  }
  node.append(...children);
  return node;
}

/** @param {string} id @returns {any} */
export const byId = (id) => document.getElementById(id);

/** Shows a problem in an element next to its cause. @param {Element} place @param {any} problem */
export function showProblem(place, problem) {
  const box = element("div", { className: "problem", role: "alert" }, element("strong", {}, problem.title ?? problem.message));
  if (problem.detail && problem.detail !== problem.title) box.append(problem.detail);
  if (problem.picture) box.append(element("img", { src: problem.picture, alt: "Frames that show the reason" }));
  if (problem.advice) box.append(element("p", {}, problem.advice.replaceAll("`", "")));
  if (problem.code) box.append(element("small", {}, `Reason code: ${problem.code}`));
  place.replaceChildren(box);
}
