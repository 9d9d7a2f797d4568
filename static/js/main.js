// The page: what is shown, and how it changes when jobs end.
// @ts-check
import { getFlock, getFootage, getLibrary, listFlocks, listJobs, listLibraries } from "./api.js";
import { showEarlier } from "./earlier.js";
import { byId, element, showProblem } from "./element.js";
import { filmForm } from "./film-form.js";
import { flockForm } from "./flock-form.js";
import { listen } from "./follow-job.js";
import { showJob } from "./job-card.js";
import { showLibrary } from "./library-view.js";
import { signIn } from "./sign-in.js";
import { showEmptyStage, showFlock } from "./stage.js";
import { quoted } from "./words.js";

signIn();
const current = { library: null, flock: null };
const made = { libraries: [], flocks: [] };
/** Ids of results shown since the page was opened. They are shown again only when they are chosen. */
const shown = new Set();
/** True once the person has made or chosen something. Other results then appear only in the lists. */
let isOwn = false;
const own = (show) => async (/** @type {string} */ id) => { isOwn = true; await show(id); };
const makeFlocksOf = flockForm(own(async (id) => { await refresh(); await watch(id); byId("stage").focus(); }));
filmForm(own(async (id) => { await refresh(); await chooseLibrary(id); byId("library").scrollIntoView(); byId("library-title").focus(); }));

async function refresh() {
  const [libraries, flocks] = await Promise.all([listLibraries(), listFlocks()]);
  made.libraries = libraries.filter(isReady);
  made.flocks = flocks.filter(isReady);
  redrawLists();
}

const isReady = (thing) => (thing.state ?? "done") === "done";
const redrawLists = () => showEarlier(made.libraries, made.flocks, current, { onLibrary: own(chooseLibrary), onFlock: own(watch) });

/** Shows a library and its newest flock. Without a flock, the stage shows the text `next`. */
async function chooseLibrary(id, next = "Press “Make the flock”. The flock will play here.") {
  const flock = made.flocks.find((one) => one.library_id === id);
  if (flock) return chooseFlock(flock.id);
  current.flock = null;
  const { name } = await chooseFilm(id);
  showEmptyStage(`${quoted(name)} is measured. ${next}`);
}

async function chooseFilm(id) {
  const library = await getLibrary(id);
  current.library = id;
  shown.add(id);
  makeFlocksOf(library);
  redrawLists();
  await showLibrary(library);
  return library;
}

async function chooseFlock(id) {
  const mine = isOwn;
  const flock = await getFlock(id);
  if (mine !== isOwn) return; // the person has chosen another result meanwhile
  current.flock = id;
  shown.add(id);
  showFlock(flock, made.libraries.find((library) => library.id === flock.library_id)?.name ?? "");
  redrawLists();
  if (current.library !== flock.library_id) await chooseFilm(flock.library_id);
}

async function watch(id) {
  await chooseFlock(id);
  byId("stage").scrollIntoView();
}

const isUnderWay = (job) => ["queued", "running"].includes(job.state);
const hasResult = (job) => isUnderWay(job) || (job.state === "done" && job.kind !== "sample");

/** @param {any} job the newest job that has a result, is queued or is running */
async function showNewest(job) {
  if (isOwn) return;
  if (job && isUnderWay(job)) {
    if (!current.library) await announce(job);
  } else if (job) {
    const id = job.links.result.split("/").at(-1);
    if (!shown.has(id)) await (job.kind === "flock" ? chooseFlock(id) : chooseLibrary(id));
  } else if (!current.library) {
    if (made.libraries[0]) await chooseLibrary(made.flocks[0]?.library_id ?? made.libraries[0].id);
    else showEmptyStage("No flock yet. Choose a film of one animal to make one.");
  }
}

/** Fills an empty page during a job: with the library of a flock if it is ready, else with a sentence. */
async function announce({ kind, subject }) {
  if (made.libraries.some((library) => library.id === subject?.id)) return chooseLibrary(subject.id, "A flock of this film is being made and will play here.");
  if (kind !== "analysis") return showEmptyStage("A flock is being made. It will play here.");
  const { name } = await getFootage(subject.id).catch(() => ({ name: "" }));
  showEmptyStage(`${quoted(name)} is being measured. The result will be shown here.`);
}

/** Returns the element for a job that no form of this tab started; detached while a form uses its own. */
function placeOf({ kind }) {
  const [id, isTaken] = kind === "flock" && !byId("make").hidden ? ["flock-job", byId("make-button").disabled] : ["film-job", byId("film-form").hidden];
  return isTaken ? element("div") : byId(id);
}

let isListening = false;
let isFollowing = false;
let hasNews = false;

/**
 * Follows the jobs of all tabs and programs until none is left. Shows the newest result before and after
 * each of them.
 */
async function followJobs() {
  hasNews = true;
  if (isFollowing) return;
  isFollowing = true;
  try {
    while (hasNews) {
      hasNews = false;
      await refresh();
      // Open the stream only after the first successful requests: without a session it would be refused.
      if (!isListening) listen((job) => { if (job.kind !== "fish") followJobs(); });
      isListening = true;
      const jobs = (await listJobs()).filter((job) => job.kind !== "fish");
      await showNewest(jobs.find(hasResult));
      const next = jobs.find((job) => job.state === "running") ?? jobs.findLast(isUnderWay);
      if (next) {
        await showJob(placeOf(next), next.id);
        hasNews = true;
      }
    }
  } catch (problem) {
    if (current.library) return; // keep the page; the stream reports the next job
    showEmptyStage("");
    showProblem(byId("stage-note"), problem);
  } finally {
    isFollowing = false;
  }
}

followJobs();
