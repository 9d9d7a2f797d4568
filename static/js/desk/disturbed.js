// Times in which the camera shakes, its focus hunts, or the light differs from that of the rest of the film.
// @ts-check

/** The kinds by the code of their advice. @type {Record<string, string>} */
const KINDS = { camera_unsteady: "camera", light_changes: "light" };

/** Returns the longest of the times in which the whole picture is disturbed in the way that an advice names, and their number. @param {string} code @param {{kind: string, from_s: number, to_s: number}[]} [all] */
export function disturbed(code, all = []) {
  const alike = all.filter(({ kind }) => kind === KINDS[code]).sort((a, b) => (b.to_s - b.from_s) - (a.to_s - a.from_s));
  return { longest: alike[0], n: alike.length };
}
