// Asks for a token when the service requires one. The session is a cookie that scripts cannot read.
// @ts-check
import { post, remove } from "./api.js";
import { byId, element } from "./element.js";
import { showProblem } from "../parts/problem.js";
import { styled } from "./router.js";
import { say } from "./words.js";

/** Key of local storage that records a session, because the page cannot see the cookie. */
const SIGNED_IN = "flockreel-signed-in";

/** Shows the form for the token when the service refuses a request, and the button to sign out. */
export function startSession() {
  const out = byId("sign-out");
  out.hidden = !localStorage.getItem(SIGNED_IN);
  out.addEventListener("click", async () => {
    try {
      await remove("/v1/session");
      localStorage.removeItem(SIGNED_IN);
      location.reload();
    } catch (problem) {
      showProblem(byId("place"), problem);
    }
  });
  addEventListener("signed-out", () => {
    localStorage.removeItem(SIGNED_IN);
    out.hidden = true;
    askForToken(byId("place"));
  });
}

/** @param {HTMLElement} place */
function askForToken(place) {
  if (document.getElementById("sign-in")) return;
  const token = element("input", { type: "password", name: "token", required: true, autocomplete: "current-password", spellcheck: false });
  const problem = element("div");
  const form = element("form#sign-in.sign-in.card", { method: "post", onsubmit: send },
    element("h1", { tabIndex: -1 }, say("session.title")), element("p.soft", {}, say("session.help")),
    element("label.field", {}, say("session.token"), token), element("button", { type: "submit" }, say("session.begin")), problem);
  styled("form");
  document.body.classList.add("signed-out");
  place.before(form);
  token.focus();

  /** @param {SubmitEvent} event */
  async function send(event) {
    event.preventDefault();
    try {
      await post("/v1/session", { token: token.value });
      localStorage.setItem(SIGNED_IN, "yes");
      location.reload();
    } catch (reason) {
      (await import("../parts/problem.js")).showProblem(problem, reason);
    }
  }
}
