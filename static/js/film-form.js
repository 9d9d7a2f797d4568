// The form for a film: uploads a chosen or dropped file and starts its analysis.
// @ts-check
import { createAnalysis } from "./api.js";
import { byId, showProblem } from "./element.js";
import { progressCard, showJob } from "./job-card.js";
import { upload } from "./upload.js";
import { megabytes } from "./words.js";

/** @param {(libraryId: string) => void} onLibrary */
export function filmForm(onLibrary) {
  const form = byId("film-form");
  const input = byId("film-file");
  const drop = byId("drop");

  input.addEventListener("change", () => { if (input.files[0]) measure(input.files[0]); });
  // A film dropped outside the drop area must not replace the page.
  for (const name of ["dragover", "drop"]) addEventListener(name, (event) => event.preventDefault());
  for (const name of ["dragenter", "dragover"]) drop.addEventListener(name, (event) => { event.preventDefault(); drop.classList.add("over"); });
  for (const name of ["dragleave", "drop"]) drop.addEventListener(name, () => drop.classList.remove("over"));
  drop.addEventListener("drop", (event) => {
    event.preventDefault();
    const file = event.dataTransfer?.files[0];
    if (file) measure(file);
  });

  /** @param {File} file */
  async function measure(file) {
    form.hidden = true;
    const place = byId("film-job");
    try {
      const footage = await send(file, place);
      const { job_id, library_id } = await createAnalysis(footage.id, paramsOf(form));
      if (await showJob(place, job_id)) onLibrary(library_id);
    } catch (problem) {
      if (problem.name === "AbortError") place.replaceChildren();
      else showProblem(place, problem);
    } finally {
      form.hidden = false;
      input.value = "";
    }
  }
}

/** @param {File} file @param {Element} place */
function send(file, place) {
  const sending = upload(file, (sent, total) => {
    update(sent < total ? "Sending the film" : "Checking the film", sent / total, `${file.name}: ${megabytes(sent)} of ${megabytes(total)}`);
  });
  const update = progressCard(place, sending.cancel);
  update("Sending the film", 0, file.name);
  return sending.footage;
}

/** Returns the parameters that the person set. The service has defaults for the others. */
export function paramsOf(form) {
  return Object.fromEntries([...new FormData(form)].filter(([, value]) => value !== "" && typeof value === "string"));
}
