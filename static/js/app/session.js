// Asks for a token when the service requires one. The session is a cookie that scripts cannot read.
// @ts-check
import { forgetSession, isSignedIn, post, rememberSession, remove } from "./api.js";
import { byId, element } from "./element.js";
import { showProblem } from "../parts/problem.js";
import { styled } from "./router.js";
import { say } from "./words.js";

/** Shows the form for the token when the service refuses a request, and the button to sign out. */
export function startSession() {
  const out = byId("sign-out");
  out.hidden = !isSignedIn();
  out.addEventListener("click", async () => {
    try {
      await remove("/v1/session");
      forgetSession();
      location.reload();
    } catch (problem) {
      showProblem(byId("place"), problem);
    }
  });
  addEventListener("signed-out", () => {
    forgetSession();
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
  styled("/static/css/form.css");
  document.body.classList.add("signed-out");
  place.before(form);
  token.focus();

  /** @param {SubmitEvent} event */
  async function send(event) {
    event.preventDefault();
    try {
      await post("/v1/session", { token: token.value });
      rememberSession();
      location.reload();
    } catch (reason) {
      showProblem(problem, reason);
    }
  }
}
