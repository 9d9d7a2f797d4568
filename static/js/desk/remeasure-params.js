// The settings that "Measure again" sends: those that differ from the defaults of the service. They include the
// settings of the former measurement, unless the person changed them.
// @ts-check

/**
 * @param {{draft: Record<string, unknown>, former: Record<string, unknown>, defaults: Record<string, unknown>, preset: "" | "papers"}} settings
 *   With a preset, which replaces the defaults, only what the person changed is sent besides it.
 * @returns {Api.AnalysisChanges}
 */
export function changedParams({ draft, former, defaults, preset }) {
  const isSame = (/** @type {unknown} */ a, /** @type {unknown} */ b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
  // Parameters that the service no longer knows are dropped.
  const names = Object.keys(draft).filter((name) => name in defaults && !isSame(draft[name], preset ? former[name] : defaults[name]));
  return { ...(preset ? { preset } : {}), ...Object.fromEntries(names.map((name) => [name, draft[name]])) };
}

/**
 * Returns camera and animal from a ruler. The animal has the proportions that were measured.
 * @param {{line_px: number, line_cm: number, away_cm: number, medium_index: number, length_px: number, height_px: number}} ruler
 */
export function sizeFromRuler({ line_px, line_cm, away_cm, medium_index, length_px, height_px }) {
  const px_per_m = (100 * line_px) / line_cm;
  const rounded = (/** @type {number} */ value) => Number(value.toPrecision(6));
  return {
    camera: { z_min_m: rounded(away_cm / 100), pane_px_per_m: rounded(px_per_m), medium_index },
    animal: { length_m: rounded(length_px / px_per_m), height_m: rounded(height_px / px_per_m) },
  };
}
