// Settings of virtual fish: what differs from the defaults, ranges for sliders, and names of files.
// @ts-check

/** @typedef {import("../studio/schema.js").Field} Field @typedef {ReturnType<typeof shownAs>} ShownField */

/** The rigid, upright, unsmoothed fish of Nakajima et al. */
export const PAPERS = { swim: false, bank_rad: 0, smooth_s: 0 };

/** What a shown unit is in the API: lengths are shown in centimetres, angles in degrees. */
const PER_UNIT = /** @type {Record<string, number>} */ ({ length_m: 0.01, height_m: 0.01, bank_rad: Math.PI / 180 });
/** Ranges of sliders whose schema has no upper limit, metres. */
const RANGES = /** @type {Record<string, number[]>} */ ({ length_m: [0.005, 1], height_m: [0.002, 0.5] });

/**
 * Returns a field as the page shows it. A size that is not set is the one of the measured animal.
 * @param {Field} field @param {Api.Library} library
 */
export function shownAs(field, library) {
  const perUnit = PER_UNIT[field.name] ?? 1;
  const measured = library.params?.animal?.[/** @type {keyof Api.Schemas["AnimalParams"]} */ (field.name)];
  let [min, max] = RANGES[field.name] ?? [field.min, field.max];
  if (measured && RANGES[field.name]) [min, max] = [Math.min(min, measured / 4), Math.max(max, measured * 4)];
  return { ...field, min, max, perUnit };
}

/** Returns the settings that differ from the defaults. @param {Api.FishParams | null} params null = none @param {Map<string, Field>} fields @returns {Api.FishParams} */
export function changedFrom(params, fields) {
  return Object.fromEntries(Object.entries(params ?? {}).filter(([name, value]) => fields.has(name) && value !== undefined && value !== null && value !== /** @type {Field} */ (fields.get(name)).default));
}

/** Returns the name under which a file is saved, such as "goldfish-virtual-fish-silver.glb"; the filmed animal itself is "own". @param {string} film @param {Api.FishParams} params @param {string} ending */
export function savedName(film, { body, palette, swim }, ending) {
  const stem = film.replace(/[^\p{L}\p{N}._-]+/gu, "-").replace(/^[-.]+|-+$/g, "") || "film";
  return `${stem}-virtual-fish-${body === "own" ? body : palette}${swim === false ? "-rigid" : ""}.${ending}`;
}
