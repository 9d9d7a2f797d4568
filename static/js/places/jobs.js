// The place of all jobs.
// @ts-check
import { element } from "../app/element.js";
import { isUnderWay, jobs, ready } from "../app/jobs.js";
import { setTitle } from "../app/router.js";
import { say } from "../app/words.js";
import { jobCard, reconcile } from "../parts/tray.js";

/** @param {HTMLElement} root @param {import("../app/router.js").Visit} visit */
export function show(root, { life }) {
  const title = element("h1", { tabIndex: -1 }, say("jobs.title"));
  const summary = element("p.soft", { role: "status" });
  const running = element("div.list");
  const ended = element("div.list");
  const before = element("h2", {}, say("jobs.ended"));
  root.append(element("header.place-head", {}, title, summary), running, before, ended);
  const draw = () => {
    const all = jobs.value;
    const live = all.filter(isUnderWay);
    setTitle(live.length ? say("jobs.running", { n: live.length }) : say("jobs.title"));
    summary.textContent = !ready.value ? "" : live.length ? say("jobs.running", { n: live.length }) : all.length ? say("jobs.idle") : say("jobs.empty");
    const entries = (/** @type {Api.Job[]} */ some) => some.map((job) => ({ key: job.id, draw: jobCard, of: job }));
    reconcile(running, entries(live));
    reconcile(ended, entries(all.filter((job) => !isUnderWay(job))));
    before.hidden = live.length === all.length;
  };
  jobs.watch(draw, life);
  ready.watch(draw, life);
}
