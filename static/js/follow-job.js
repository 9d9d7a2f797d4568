// Follows jobs until they end. States come from the event stream and from polling, which is more frequent
// while the stream is down.
// @ts-check
import { getJob } from "./api.js";
import { openEvents } from "./job-events.js";

const FINAL = ["done", "failed", "cancelled"];
const ASK_MS = { live: 5000, down: 700 };

/** Followed jobs, with the callbacks for their states. @type {Set<{id: string, see: (job: any) => void}>} */
const followers = new Set();
/** Ids of all jobs that this tab has followed. @type {Set<string>} */
const known = new Set();
let live = false;
let onNews = (_job) => {};

/**
 * Opens the event stream for as long as the page is open.
 * @param {(job: any) => void} tell receives the states of jobs that this tab has not followed; only the id if
 *   the job was deleted
 */
export function listen(tell) {
  onNews = tell;
  if (!globalThis.SharedWorker) return void openEvents(hear);
  const { port } = new SharedWorker("/static/js/job-worker.js", { type: "module" });
  port.onmessage = ({ data }) => hear(data);
  port.postMessage({ listening: true });
  addEventListener("pagehide", () => port.postMessage({ listening: false }));
  addEventListener("pageshow", (event) => { if (event.persisted) port.postMessage({ listening: true }); });
}

function hear({ job, live: isLive }) {
  live = isLive;
  if (!job) return;
  for (const { id, see } of followers) if (id === job.id) see(job);
  if (!known.has(job.id)) onNews(job);
}

/**
 * @param {string} id
 * @param {(job: any) => void} onChange receives every observed state, including the final one
 * @returns {Promise<any>} the job in its final state
 */
export async function followJob(id, onChange) {
  let ended = null;
  let wake = () => {};
  const see = (job) => {
    if (ended || !job.state) return wake(); // deleted: polling returns the error
    onChange(job);
    if (FINAL.includes(job.state)) { ended = job; wake(); }
  };
  const follower = { id, see };
  followers.add(follower);
  known.add(id);
  try {
    for (let failures = 0; !ended;) {
      try {
        see(await getJob(id));
        failures = 0;
      } catch (problem) {
        // A restart of the service takes seconds and loses no job. An unknown job stays unknown.
        failures += 1;
        if (problem.status || failures > 30) throw problem;
      }
      if (!ended) await new Promise((go) => { wake = go; setTimeout(go, live ? ASK_MS.live : ASK_MS.down); });
    }
    return ended;
  } finally {
    followers.delete(follower);
  }
}
