// Goals, obstacles and the predator of a flock as things on its picture: adding, moving, sizing, removing.
// @ts-check

/**
 * @typedef {"goal" | "circle" | "box" | "predator"} Kind
 * @typedef {Extract<Api.Schemas["Obstacle"], {circle: unknown}>} Circle
 * @typedef {Extract<Api.Schemas["Obstacle"], {box: unknown}>} Box
 * @typedef {{kind: "goal", value: Api.Goal} | {kind: "circle", value: Circle} | {kind: "box", value: Box} | {kind: "predator", value: Api.Predator}} Shape
 * @typedef {Shape & {key: string, index: number}} Thing `value` as in the API
 * @typedef {Pick<Thing, "key" | "kind" | "index">} Slot what a thing is called, also before it has a value
 * @typedef {{goals: Api.Goal[], obstacles: (Circle | Box)[], predator: Api.Predator | null}} Placed
 * @typedef {number[]} Point pixels of the film
 */

/** Most waypoints of a drawn path. */
const WAYPOINTS = 30;
/** Time in which a predator in play mode comes into the picture and leaves it, s. Free choice. */
const COME_S = 0.3;
/** Least radius and side of an obstacle, pixels. */
const LEAST_PX = 4;

/** @param {Placed} placed @returns {Thing[]} */
export function thingsOf({ goals, obstacles, predator }) {
  /** @type {(Shape & {index: number})[]} */
  const all = [
    ...goals.map((value, index) => ({ kind: /** @type {const} */ ("goal"), index, value })),
    ...obstacles.map((value, index) => ("circle" in value ? { kind: /** @type {const} */ ("circle"), index, value } : { kind: /** @type {const} */ ("box"), index, value })),
  ];
  if (predator?.path?.length) all.push({ kind: "predator", index: 0, value: predator });
  return all.map((one) => ({ ...one, key: `${one.kind}-${one.index}` }));
}

/** Returns the settings with a thing in place of that of the same kind and index; without one, it is taken away.
 * @param {Placed} placed @param {Pick<Slot, "kind" | "index">} thing @param {Thing["value"]} [value] */
export function withThing({ goals, obstacles }, { kind, index }, value) {
  if (kind === "predator") return { predator: value };
  const list = kind === "goal" ? goals : obstacles;
  const next = value === undefined ? list.filter((_, k) => k !== index) : Object.assign([...list], { [index]: value });
  return { [kind === "goal" ? "goals" : "obstacles"]: next.length ? next : undefined };
}

/** Returns the thing that a drag from one point to another draws. A click draws one of usual size.
 * @param {Kind} kind @param {Point} from @param {Point} to @param {Point} size of the film */
export function drawn(kind, from, to, size) {
  const usual = Math.min(...size) / 10;
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const isClick = Math.hypot(dx, dy) < usual / 8;
  if (kind === "goal") return { at_px: inside(to, size) };
  if (kind === "circle") return { circle: { center_px: whole(from), radius_px: Math.round(isClick ? usual : Math.max(LEAST_PX, Math.hypot(dx, dy))) } };
  if (isClick) return { box: { box_px: whole([from[0] - usual, from[1] - usual, 2 * usual, 2 * usual]) } };
  return { box: { box_px: whole([Math.min(from[0], to[0]), Math.min(from[1], to[1]), Math.max(LEAST_PX, Math.abs(dx)), Math.max(LEAST_PX, Math.abs(dy))]) } };
}

/** Returns the value of a moved thing. @param {Thing} thing @param {Point} by @param {Point} size */
export function moved({ kind, value }, [dx, dy], size) {
  const shift = (/** @type {Point} */ [x, y]) => inside([x + dx, y + dy], size);
  if (kind === "goal") return { ...value, at_px: shift(value.at_px) };
  if (kind === "circle") return { circle: { ...value.circle, center_px: shift(value.circle.center_px) } };
  if (kind === "predator") return { ...value, path: (value.path ?? []).map((one) => ({ ...one, at_px: isInside(one.at_px, size) ? shift(one.at_px) : one.at_px })) };
  const [x, y, w, h] = value.box.box_px;
  return { box: { box_px: whole([Math.min(size[0] - 1, Math.max(1 - w, x + dx)), Math.min(size[1] - 1, Math.max(1 - h, y + dy)), w, h]) } };
}

/** Points at which a thing is sized or bent. @param {Thing} thing @returns {Point[]} */
export function handlesOf({ kind, value }) {
  if (kind === "circle") return [[value.circle.center_px[0] + value.circle.radius_px, value.circle.center_px[1]]];
  if (kind === "predator") return (value.path ?? []).map((one) => one.at_px);
  if (kind !== "box") return [];
  const [x, y, w, h] = value.box.box_px;
  return [[x, y], [x + w, y + h]];
}

/** Returns the value of a thing whose handle is at another point. @param {Thing} thing @param {number} handle @param {Point} to @param {Point} size */
export function sized({ kind, value }, handle, to, size) {
  if (kind === "circle") return { circle: { ...value.circle, radius_px: Math.max(LEAST_PX, Math.round(Math.hypot(to[0] - value.circle.center_px[0], to[1] - value.circle.center_px[1]))) } };
  if (kind === "predator") return { ...value, path: (value.path ?? []).map((one, k) => (k === handle ? { ...one, at_px: inside(to, size) } : one)) };
  if (kind === "goal") return value;
  const [x, y, w, h] = value.box.box_px;
  const [left, top, right, bottom] = handle ? [x, y, Math.max(x + LEAST_PX, to[0]), Math.max(y + LEAST_PX, to[1])] : [Math.min(to[0], x + w - LEAST_PX), Math.min(to[1], y + h - LEAST_PX), x + w, y + h];
  return { box: { box_px: whole([left, top, right - left, bottom - top]) } };
}

/** Returns a drawn line as the waypoints of a predator that takes the whole time at one speed. @param {Point[]} line @param {number} length_s @param {Point} size */
export function pathOf(line, length_s, size) {
  const points = simplified(line.map((point) => inside(point, size)));
  const ways = points.map((point, k) => (k ? Math.hypot(point[0] - points[k - 1][0], point[1] - points[k - 1][1]) : 0));
  const total = ways.reduce((sum, way) => sum + way, 0) || 1;
  let way = 0;
  return points.map((at_px, k) => ({ time_s: Number(((length_s * (way += ways[k])) / total).toFixed(2)), at_px }));
}

/**
 * Returns the path of the pointer in play mode as waypoints, with its own times. Before and after it, the predator is far
 * outside the picture, as the pointer was. A chase that outlasts the flock begins earlier.
 * @param {{time_s: number, at_px: Point}[]} path @param {number} length_s @param {Point} size
 */
export function pathOfPointer(path, length_s, size) {
  if (path.length < 2) return [];
  const [start, end] = [path[0].time_s, path[path.length - 1].time_s];
  const early = Math.min(start, Math.max(0, end - length_s));
  const kept = simplified(path.filter(({ time_s }) => time_s - early <= length_s).map(({ time_s, at_px }) => [...inside(at_px, size), time_s - early]));
  const points = kept.map(([x, y, time_s]) => waypoint(time_s, [x, y]));
  if (points.length < 2) return [];
  const [first, last] = [points[0], points[points.length - 1]];
  const comes = first.time_s > 2 * COME_S ? [waypoint(0, outside(first.at_px, size)), waypoint(first.time_s - COME_S, outside(first.at_px, size))] : [];
  const goes = last.time_s + COME_S < length_s ? [waypoint(last.time_s + COME_S, outside(last.at_px, size))] : [];
  return [...comes, ...points, ...goes];
}

/** @param {number} time_s @param {Point} at_px */
const waypoint = (time_s, at_px) => ({ time_s: Number(time_s.toFixed(2)), at_px });

/** Returns a point far outside the picture, beyond the border that is nearest. @param {Point} point @param {Point} size @returns {Point} */
function outside([x, y], [width, height]) {
  const far = Math.max(width, height);
  const ways = [{ gap: x, to: [-far, y] }, { gap: width - x, to: [width + far, y] }, { gap: y, to: [x, -far] }, { gap: height - y, to: [x, height + far] }];
  return ways.sort((a, b) => a.gap - b.gap)[0].to;
}

/** Drops the points that matter least until few enough are left (Ramer, Douglas and Peucker). @param {Point[]} points */
function simplified(points) {
  let kept = points.filter(([x, y], k) => !k || x !== points[k - 1][0] || y !== points[k - 1][1]);
  for (let tolerance = 1; kept.length > 2 && tolerance < 1e6; tolerance *= 1.5) {
    kept = thinned(kept, tolerance);
    if (kept.length <= WAYPOINTS) break;
  }
  return kept;
}

/** @param {Point[]} points @param {number} tolerance @returns {Point[]} */
function thinned(points, tolerance) {
  const [a, b] = [points[0], points[points.length - 1]];
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  let [farthest, at] = [tolerance, 0];
  for (let k = 1; k < points.length - 1; k++) {
    const [x, y] = points[k];
    const gap = length ? Math.abs((b[0] - a[0]) * (a[1] - y) - (a[0] - x) * (b[1] - a[1])) / length : Math.hypot(x - a[0], y - a[1]);
    if (gap > farthest) [farthest, at] = [gap, k];
  }
  return at ? [...thinned(points.slice(0, at + 1), tolerance).slice(0, -1), ...thinned(points.slice(at), tolerance)] : [a, b];
}

/** @param {Point} point @param {Point} size */
const inside = (point, size) => point.map((value, k) => Math.round(Math.min(size[k], Math.max(0, value))));
/** @param {Point} point @param {Point} size */
const isInside = (point, size) => point.every((value, k) => value >= 0 && value <= size[k]);
const whole = (/** @type {number[]} */ values) => values.map(Math.round);
