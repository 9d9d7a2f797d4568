// Names of the films that jobs work on, which may be deleted, just made, or not to be had.
import assert from "node:assert/strict";
import { mock, test } from "node:test";

// The page's words ask the browser for its language.
Object.assign(globalThis, { location: new URL("http://page/"), localStorage: { getItem: () => null }, navigator: { languages: ["en"] }, document: { documentElement: {} } });
const { subjectOf } = await import("../../static/js/app/names.js");

const job = (id) => ({ id: "j", kind: "analysis", state: "running", subject: { kind: "footage", id }, links: { result: "/v1/libraries/none" } });

/** Answers lists with some films, and films by their ids. Returns the addresses that are asked for. */
function serve(t, { films, listed = films, status = 200 }) {
  mock.timers.enable({ apis: ["setTimeout"] });
  t.after(() => { mock.timers.tick(1000); mock.timers.reset(); });
  const asked = [];
  t.mock.method(globalThis, "fetch", async (path) => {
    asked.push(path);
    if (status !== 200) return Response.json({ title: "Not now.", code: "busy" }, { status });
    if (path.includes("?")) return Response.json({ items: listed, next_cursor: null });
    const film = films.find(({ id }) => path.endsWith(id));
    return film ? Response.json(film) : Response.json({ code: "not_found" }, { status: 404 });
  });
  return asked;
}

test("a film that the list lacks is deleted, and is not asked for", async (t) => {
  const asked = serve(t, { films: [{ id: "b2", name: "carp.mp4" }] });
  assert.deepEqual(await subjectOf(job("b1")), { name: "a deleted film", poster: "", isGone: true });
  assert.equal((await subjectOf(job("b2"))).name, "carp");
  assert.deepEqual(asked, ["/v1/footage?limit=100"]);
});

test("a film that is younger than the list is asked for", async (t) => {
  serve(t, { films: [{ id: "c9", name: "young carp.mp4" }, { id: "c1", name: "old.mp4" }], listed: [{ id: "c1", name: "old.mp4" }] });
  assert.equal((await subjectOf(job("c9"))).name, "young carp");
  assert.equal((await subjectOf(job("c8"))).isGone, true);
});

test("without an answer of the service, no film counts as deleted", async (t) => {
  serve(t, { films: [], status: 503 });
  await assert.rejects(subjectOf(job("d1")), { status: 503 });
});
