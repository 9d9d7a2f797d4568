// Numbers, directions and job stages as text. Angles are converted to degrees only here.
// @ts-check

const number = new Intl.NumberFormat("en", { maximumFractionDigits: 1 });
const date = new Intl.DateTimeFormat("en", { dateStyle: "medium", timeStyle: "short" });

export const count = (value) => number.format(value);
export const percent = (share) => `${number.format(100 * share)} %`;
export const degrees = (rad) => (rad * 180) / Math.PI;
export const seconds = (value) => `${number.format(value)} s`;
export const megabytes = (bytes) => `${number.format(bytes / 1e6)} MB`;
export const quoted = (film) => (film ? `“${film}”` : "The film");
export const day = (time) => (time ? date.format(new Date(time)) : "");

const DIRECTIONS = ["right", "down right", "down", "down left", "left", "up left", "up", "up right"];

/** Returns a heading as text, such as "34° (down right)". */
export function direction(heading_rad) {
  const heading_deg = Math.round(degrees(heading_rad));
  const eighth = ((Math.round(heading_deg / 45) % 8) + 8) % 8;
  return `${number.format(heading_deg).replace("-", "−")}° (${DIRECTIONS[eighth]})`;
}

const STAGES = {
  filming: "Filming a virtual goldfish",
  background: "Estimating the background",
  tracking: "Following the animal",
  distances: "Comparing moments",
  writing: "Storing the result",
  overlay: "Drawing the measurement over the film",
  loading: "Opening the film’s library",
  simulating: "Simulating the boids",
  planning: "Choosing frames for every individual",
  rendering: "Drawing the flock",
};

/** Returns the current stage of a job as text. */
export function stageOf(job) {
  if (job.state === "queued") return "Waiting in the queue";
  const stage = job.stage ?? "";
  return STAGES[stage] ?? (stage ? stage[0].toUpperCase() + stage.slice(1).replaceAll("_", " ") : "Starting");
}
