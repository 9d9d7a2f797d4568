// A value that can be watched: the state that several parts of the page share.
// @ts-check

/**
 * @template T
 * @typedef {{readonly value: T, set: (next: T) => void, watch: (listener: (value: T) => void, life?: AbortSignal) => void}} Signal
 */

/**
 * Returns a watched value. Listeners hear the value at once and after each change.
 * @template T
 * @param {T} value
 * @returns {Signal<T>}
 */
export function signal(value) {
  /** @type {Set<(value: T) => void>} */
  const listeners = new Set();
  return {
    get value() { return value; },
    set(next) {
      if (Object.is(next, value)) return;
      value = next;
      for (const listener of [...listeners]) listener(value);
    },
    watch(listener, life) {
      if (life?.aborted) return;
      listeners.add(listener);
      life?.addEventListener("abort", () => listeners.delete(listener));
      listener(value);
    },
  };
}
