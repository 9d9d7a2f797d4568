// Motion that begins by itself, which some people do not want.
// @ts-check

/** Whether the person asks for less motion, as a query that can be watched. */
export const reducedMotion = () => matchMedia("(prefers-reduced-motion: reduce)");

/** Whether nothing may begin to move by itself. */
export const isCalm = () => reducedMotion().matches;
