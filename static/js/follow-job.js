// Follows a job to its end: by server-sent events, and by asking again where those fail.
// @ts-check
import { getJob } from "./api.js";

const FINAL = ["done", "failed", "cancelled"];
const ASK_AGAIN_MS = 700;

/**
 * @param {string} id
 * @param {(job: any) => void} onChange called with every state seen, the last one included
 * @returns {Promise<any>} the job in its final state
 */
export function followJob(id, onChange) {
  return new Promise((resolve, reject) => {
    const events = new EventSource(`/v1/jobs/${id}/events`);
    const see = (job) => {
      onChange(job);
      if (!FINAL.includes(job.state)) return false;
      events.close();
      resolve(job);
      return true;
    };
    const onEvent = (event) => see(JSON.parse(event.data));
    for (const name of ["message", "job"]) events.addEventListener(name, onEvent);
    events.addEventListener("error", () => {
      events.close();
      poll(id, see).catch(reject);
    }, { once: true });
  });
}

async function poll(id, see) {
  let failures = 0;
  for (;;) {
    try {
      if (see(await getJob(id))) return;
      failures = 0;
    } catch (problem) {
      // A restart of the service takes seconds and loses no job; a job that is unknown stays so.
      failures += 1;
      if (problem.status || failures > 30) throw problem;
    }
    await new Promise((wake) => setTimeout(wake, ASK_AGAIN_MS));
  }
}
