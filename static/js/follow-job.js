// Follows jobs to their ends: by the one stream of all jobs, and by asking, often while the stream is down.
// @ts-check
import { getJob } from "./api.js";
import { openEvents } from "./job-events.js";

const FINAL = ["done", "failed", "cancelled"];
const ASK_MS = { live: 5000, down: 700 };

/** Whom to tell of which job. @type {Set<{id: string, see: (job: any) => void}>} */
const followers = new Set();
let live = false;
let announce = null;

/**
 * @param {string} id
 * @param {(job: any) => void} onChange called with every state seen, the last one included
 * @returns {Promise<any>} the job in its final state
 */
export async function followJob(id, onChange) {
  let ended = null;
  let wake = () => {};
  const see = (job) => {
    if (ended || !job.state) return wake(); // one that was deleted: asking says so
    onChange(job);
    if (FINAL.includes(job.state)) { ended = job; wake(); }
  };
  const follower = { id, see };
  followers.add(follower);
  announce ??= connect();
  announce(followers.size);
  try {
    for (let failures = 0; !ended;) {
      try {
        see(await getJob(id));
        failures = 0;
      } catch (problem) {
        // A restart of the service takes seconds and loses no job; a job that is unknown stays so.
        failures += 1;
        if (problem.status || failures > 30) throw problem;
      }
      if (!ended) await new Promise((go) => { wake = go; setTimeout(go, live ? ASK_MS.live : ASK_MS.down); });
    }
    return ended;
  } finally {
    followers.delete(follower);
    announce(followers.size);
  }
}

/** To the worker that all tabs share; without one, to the service. @returns {(following: number) => void} */
function connect() {
  const hear = (message) => {
    live = message.live;
    for (const { id, see } of followers) if (id === message.job?.id) see(message.job);
  };
  if (!globalThis.SharedWorker) {
    let close = null;
    return (following) => {
      if (following && !close) close = openEvents(hear);
      if (!following && close) { close(); close = null; }
    };
  }
  const { port } = new SharedWorker("/static/js/job-worker.js", { type: "module" });
  port.onmessage = ({ data }) => hear(data);
  addEventListener("pagehide", () => port.postMessage({ following: 0 }));
  return (following) => port.postMessage({ following });
}
