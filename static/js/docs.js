// The API description as a page, from which requests can be tried. It loads nothing from other servers.
// @ts-check
/* global SwaggerUIBundle */
// Its own class for a dark theme; the theme is the one chosen on the page, or else that of the browser.
const preference = matchMedia("(prefers-color-scheme: dark)");
const chosen = localStorage.getItem("flockreel-theme") ?? "";
const use = () => { document.documentElement.classList.toggle("dark-mode", chosen ? chosen === "dark" : preference.matches); };
document.documentElement.style.colorScheme = chosen;
preference.addEventListener("change", use);
use();

SwaggerUIBundle({
  url: "/openapi.json",
  dom_id: "#api",
  presets: [SwaggerUIBundle.presets.apis],
  deepLinking: true,
  validatorUrl: null,
});
