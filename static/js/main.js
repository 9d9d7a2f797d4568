// Starts the page: words of the frame, session, jobs, and the place of the current address.
// @ts-check
import { isSignedIn } from "./app/api.js";
import { startJobs } from "./app/jobs.js";
import { byId } from "./app/element.js";
import { startRouter } from "./app/router.js";
import { language, say, setLanguage } from "./app/words.js";
import { startDrop } from "./parts/drop.js";
import { startTray } from "./parts/tray-button.js";

for (const node of document.querySelectorAll("[data-say]")) node.textContent = say(/** @type {HTMLElement} */ (node).dataset.say ?? "");
for (const node of document.querySelectorAll("[data-say-label]")) node.setAttribute("aria-label", say(/** @type {HTMLElement} */ (node).dataset.sayLabel ?? ""));
byId("language").textContent = language === "ja" ? "English" : "日本語";
byId("language").lang = language === "ja" ? "en" : "ja";
byId("language").addEventListener("click", () => setLanguage(language === "ja" ? "en" : "ja"));
startTheme();
startSessionWhenNeeded();
// A guest with a shared link has no token: nothing may ask for one.
const isGuest = location.pathname.startsWith("/s/");
document.body.classList.toggle("guest", isGuest);
if (!isGuest) {
  startTray();
  startDrop();
  startJobs();
}
startRouter();

/** Light or dark: as the system has it, or as the person chose. Canvases hear of a change by the event `theme`. */
function startTheme() {
  const button = byId("theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (document.documentElement.style.colorScheme || (system.matches ? "dark" : "light")) === "dark";
  const use = (/** @type {string} */ theme) => {
    document.documentElement.style.colorScheme = theme;
    button.title = say(isDark() ? "theme.light" : "theme.dark");
    button.setAttribute("aria-label", button.title);
    dispatchEvent(new Event("theme"));
  };
  use(localStorage.getItem("flockreel-theme") ?? "");
  system.addEventListener("change", () => use(document.documentElement.style.colorScheme));
  button.addEventListener("click", () => {
    const theme = isDark() ? "light" : "dark";
    localStorage.setItem("flockreel-theme", theme);
    use(theme);
  });
}

/** Most services need no token: the form and the button to sign out are loaded when they are needed. */
function startSessionWhenNeeded() {
  const load = async () => (await import("./app/session.js")).startSession();
  if (isSignedIn()) load();
  else addEventListener("signed-out", async () => { await load(); dispatchEvent(new Event("signed-out")); }, { once: true });
}
