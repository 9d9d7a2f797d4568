// The button of the tray in the header: how many jobs run and how far the first one is. The tray itself is
// loaded when it opens.
// @ts-check
import { byId, element } from "../app/element.js";
import { isUnderWay, jobs, uploads } from "../app/jobs.js";
import { percent, say } from "../app/words.js";

/** Shows the button and keeps it up to date. */
export function startTray() {
  const button = byId("tray-button");
  const [what, share] = [element("span.tray-what"), element("span.tray-share")];
  button.append(element("span.ring", { "aria-hidden": "true" }), what, share);
  const draw = () => {
    const running = jobs.value.filter(isUnderWay);
    const sending = uploads.value.filter((one) => one.state === "sending" || one.state === "checking");
    const refused = uploads.value.filter((one) => one.state === "failed").length;
    const paused = uploads.value.filter((one) => one.state === "paused").length;
    const first = running.find((job) => job.state === "running") ?? running[0];
    const part = sending.length ? sending[0].sent / (sending[0].total || 1) : first?.progress ?? 0;
    what.textContent = sending.length ? say("tray.sending", { n: sending.length }) : first ? say("tray.busy", { n: running.length }) : refused ? say("tray.refused", { n: refused }) : paused ? say("tray.paused", { n: paused }) : say("tray.idle");
    share.textContent = sending.length || first ? percent(Math.min(0.99, part)) : "";
    button.style.setProperty("--share", `${Math.round(100 * part)}%`);
    button.classList.toggle("busy", sending.length > 0 || running.length > 0);
    button.classList.toggle("refused", refused > 0);
  };
  jobs.watch(draw);
  uploads.watch(draw);
  if (Object.keys(localStorage).some((key) => key.startsWith("tus::"))) import("../app/upload.js").then(({ tellInterrupted }) => tellInterrupted(), () => {});
  let isFilled = false;
  byId("tray").addEventListener("beforetoggle", async (/** @type {ToggleEvent} */ event) => {
    if (event.newState !== "open" || isFilled) return;
    isFilled = true;
    const filler = await import("./tray.js").catch(() => null);
    isFilled = filler !== null;
    byId("tray").replaceChildren(isFilled ? "" : element("p.problem", { role: "alert" }, say("problem.unreachable")));
    filler?.fillTray();
  });
}

/** Opens the tray, for instance when files arrive. */
export const openTray = () => { if (!byId("tray").matches(":popover-open")) byId("tray").showPopover?.(); };
