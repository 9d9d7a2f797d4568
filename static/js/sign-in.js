// Asks for a token when the service requires one. The session is a cookie that scripts cannot read.
// @ts-check
import { beginSession, endSession } from "./api.js";
import { byId, showProblem } from "./element.js";

/** Key of local storage that records a session, because the page cannot see the cookie. */
const SIGNED_IN = "flockreel-signed-in";

export function signIn() {
  const form = byId("sign-in-form");
  byId("sign-out").hidden = !localStorage.getItem(SIGNED_IN);

  addEventListener("signed-out", () => {
    localStorage.removeItem(SIGNED_IN);
    document.body.classList.add("signed-out");
    byId("sign-out").hidden = true;
    byId("sign-in").hidden = false;
    form.elements.token.focus();
  });
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    try {
      await beginSession(form.elements.token.value);
      localStorage.setItem(SIGNED_IN, "yes");
      location.reload();
    } catch (problem) {
      showProblem(byId("sign-in-problem"), problem);
    }
  });
  byId("sign-out").addEventListener("click", async () => {
    await endSession();
    localStorage.removeItem(SIGNED_IN);
    location.reload();
  });
}
