// The page as a whole: what is shown now, and what happens when something was made.
// @ts-check
import { getFlock, getLibrary, listFlocks, listJobs, listLibraries } from "./api.js";
import { showEarlier } from "./earlier.js";
import { byId, showProblem } from "./element.js";
import { filmForm } from "./film-form.js";
import { flockForm } from "./flock-form.js";
import { showJob } from "./job-card.js";
import { showLibrary } from "./library-view.js";
import { signIn } from "./sign-in.js";
import { showEmptyStage, showFlock } from "./stage.js";

signIn();
const current = { library: null, flock: null };
const made = { libraries: [], flocks: [] };
const makeFlocksOf = flockForm(async (id) => { await refresh(); await chooseFlock(id); byId("stage").scrollIntoView(); byId("stage").focus(); });
filmForm(async (id) => { await refresh(); await chooseLibrary(id); byId("library").scrollIntoView(); byId("library-title").focus(); });

async function refresh() {
  const [libraries, flocks] = await Promise.all([listLibraries(), listFlocks()]);
  made.libraries = libraries.filter(isReady);
  made.flocks = flocks.filter(isReady);
  redrawLists();
}

const isReady = (thing) => (thing.state ?? "done") === "done";
const redrawLists = () => showEarlier(made.libraries, made.flocks, current, { onLibrary: chooseLibrary, onFlock: watch });

async function chooseLibrary(id) {
  const library = await getLibrary(id);
  current.library = id;
  makeFlocksOf(library);
  redrawLists();
  await showLibrary(library);
}

async function chooseFlock(id) {
  const flock = await getFlock(id);
  current.flock = id;
  showFlock(flock, made.libraries.find((library) => library.id === flock.library_id)?.name ?? "");
  redrawLists();
  if (current.library !== flock.library_id) await chooseLibrary(flock.library_id);
}

async function watch(id) {
  await chooseFlock(id);
  byId("stage").scrollIntoView();
}

/** The newest of what there is, unless something was chosen; jobs from before the visit are followed. */
async function open() {
  await refresh();
  if (made.flocks[0] && !current.flock) await chooseFlock(made.flocks[0].id);
  else if (made.libraries[0] && !current.library) await chooseLibrary(made.libraries[0].id);
  const jobs = (await listJobs()).filter((job) => ["queued", "running"].includes(job.state));
  if (!current.flock) showEmptyStage(jobs.length ? "The first flock is being made. It will play here." : "No flock yet. Choose a film of one animal, and its flock will play here.");
  const oldest = jobs.at(-1);
  if (!oldest || !await showJob(placeOf(oldest), oldest.id)) return;
  if (oldest.kind === "flock") current.flock = null; // what was waited for takes the stage
  await open();
}

/** Where a job that was under way before the visit is shown. */
function placeOf(job) {
  if (job.kind !== "flock" || byId("make").hidden) return byId("film-job");
  return byId("flock-job");
}

open().catch((problem) => { showEmptyStage(""); showProblem(byId("stage-note"), problem); });
