// The jobs of the page: answers and events in any order.
import assert from "node:assert/strict";
import { mock, test } from "node:test";

// The page's words ask the browser for its language, and its jobs open an event stream.
const streams = [];
class EventSource extends EventTarget { constructor() { super(); streams.push(this); } }
Object.assign(globalThis, { EventSource, location: new URL("http://page/"), localStorage: { getItem: () => null }, navigator: { languages: ["en"] }, document: { documentElement: {} } });

/** Requests that wait for their answers. @type {{path: string, answer: (body: any) => void}[]} */
const asked = [];
globalThis.fetch = (path) => new Promise((resolve) => asked.push({ path, answer: (body) => resolve(new Response(JSON.stringify(body))) }));
mock.timers.enable({ apis: ["setTimeout", "setInterval"] });
const { aheadOf, ended, expect, isUnderWay, jobs, startJobs } = await import("../../static/js/app/jobs.js");

const { timeLeft } = await import("../../static/js/parts/time-left.js");
const { stageOf } = await import("../../static/js/app/words.js");

const job = (n, state, more = {}) => ({ id: String(n).padStart(4, "0"), state, attempt: 1, links: { result: `/v1/flocks/${n}` }, ...more });
const settle = async () => { for (let k = 0; k < 20; k++) await Promise.resolve(); };
const tell = (name, data) => streams[0].dispatchEvent(Object.assign(new Event(name), { data: JSON.stringify(data) }));
/** Answers the oldest request. */
const answer = async (body) => { asked.shift().answer(body); await settle(); };
const states = () => jobs.value.map(({ id, state }) => `${Number(id)} ${state}`);

startJobs();
await answer({ items: [job(1, "running")] });
mock.timers.tick(1500);
// The module of the stream is loaded.
while (!streams.length) await new Promise((resolve) => setImmediate(resolve));
// The page polled meanwhile, and asks again when the stream opens.
while (asked.length) await answer({ items: [job(1, "running")] });
streams[0].dispatchEvent(new Event("open"));
await settle();

test("the time left never rises within a stage, and is told only while the speed is known", () => {
  const left = timeLeft();
  const at = (s, progress, stage = "rendering") => left({ stage, progress }, s * 1000);
  assert.deepEqual([at(0, 0.1, "planning"), at(4, 0.3, "planning")], [null, null]);
  assert.equal(Math.round(at(10, 0.3, "planning")), 35);
  // The next stage is slower than the first ones let expect.
  assert.deepEqual([at(11, 0.4), at(15, 0.41)], [null, null]);
  const told = Array.from({ length: 50 }, (_, k) => at(17 + k, 0.46 + 0.01 * k + 0.004 * Math.sin(k)));
  assert.ok(told.every((value, k) => !k || value <= told[k - 1]), String(told));
  assert.ok(told[0] > 40 && told.at(-1) < 8, String(told));
  // The work halts: no number is better than one that grows.
  assert.equal(at(90, 0.955), null);
  assert.equal(at(91, 0.996), null);
});

test("at the end of a job the page tells what happens, and no whole percentage", () => {
  const running = { state: "running", stage: "rendering" };
  assert.match(stageOf({ ...running, progress: 0.99 }), /^Drawing the film . 99%$/);
  assert.equal(stageOf({ ...running, progress: 0.996 }), "Writing files");
  assert.equal(stageOf({ ...running, progress: 1, cancel_requested: true }), "Stopping");
});

test("an answer that is older than an event changes nothing", async () => {
  tell("job", job(1, "done"));
  tell("job", job(2, "queued"));
  tell("gone", { id: "0003" });
  assert.equal(asked.length, 1);
  await answer({ items: [job(3, "running"), job(1, "running")] });
  assert.deepEqual(states(), ["2 queued", "1 done"]);
  const waiting = expect("0002");
  tell("job", job(2, "done"));
  await answer(job(2, "queued"));
  await waiting;
  assert.deepEqual(states(), ["2 done", "1 done"]);
});

test("jobs under way stay, however many are newer", () => {
  tell("job", job(10, "queued"));
  for (let n = 100; n < 220; n++) tell("job", job(n, "done"));
  assert.equal(jobs.value.length, 101);
  assert.deepEqual(jobs.value.filter(isUnderWay).map(({ id }) => id), ["0010"]);
});

test("a job tells how many come before it", () => {
  tell("job", job(300, "running"));
  tell("job", job(301, "queued"));
  assert.deepEqual([aheadOf(job(301, "queued")), aheadOf(job(10, "queued"))], [2, 0]);
});

test("the end of a job is heard once, and no state after it", async () => {
  const seen = [];
  const done = ended("0301", new AbortController().signal, ({ state }) => seen.push(state));
  tell("job", job(301, "running"));
  tell("job", job(301, "done"));
  assert.equal((await done).state, "done");
  tell("job", job(302, "queued"));
  assert.deepEqual(seen, ["queued", "running", "done"]);
});

test("a job that failed, was cancelled or deleted, or that nobody waits for any more, ends with a reason", async () => {
  const { signal } = new AbortController();
  const failing = assert.rejects(ended("0302", signal), { title: "Too dark." });
  tell("job", job(302, "failed", { error: { title: "Too dark." } }));
  await failing;
  await assert.rejects(Promise.all([ended("0300", signal), tell("job", job(300, "cancelled"))]), { name: "AbortError" });
  tell("job", job(303, "running"));
  await assert.rejects(Promise.all([ended("0303", signal), tell("gone", { id: "0303" })]), { name: "AbortError" });
  tell("job", job(304, "running"));
  const leaving = new AbortController();
  const left = assert.rejects(ended("0304", leaving.signal), { name: "AbortError" });
  leaving.abort();
  await left;
  await assert.rejects(ended("0304", leaving.signal), { name: "AbortError" });
});
