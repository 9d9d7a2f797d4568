// Times in which the camera shakes or its focus hunts, or the light is another one.
// @ts-check

/** Returns the number of times in which the whole picture is disturbed in the way that an advice names, and the longest of them. @param {string} code @param {{kind: string, from_s: number, to_s: number}[]} [all] */
export function disturbed(code, all = []) {
  const alike = all.filter(({ kind }) => kind === (code === "light_changes" ? "light" : "camera"));
  const [longest] = [...alike].sort((a, b) => (b.to_s - b.from_s) - (a.to_s - a.from_s));
  return { n: alike.length, longest };
}
