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
