// The boids of play mode: they school and flee the pointer. All lengths are body lengths (BL) here.
// @ts-check

/** Reach of separation, alignment and cohesion; of the pointer; and of the walls, BL. Free choices. */
const [APART, ALONG, TOGETHER, FEAR, WALL] = [1, 3, 5, 3.5, 1.5];
/** Weights of alignment, cohesion, separation, wandering, walls and fear, against 1 for the present heading. */
const [W_ALONG, W_TOGETHER, W_APART, W_WANDER, W_WALL, W_FEAR] = [0.6, 0.5, 2.5, 0.5, 5, 8];
/** Speed of flight relative to the usual speed, and the time in which fear fades, s. */
const [FLIGHT, CALM_S] = [5, 1];
/** Largest turn rate, rad/s: undisturbed, and in flight. */
const TURN = [2.5, 12];
/** Speed at which boids that touch drift apart, BL/s. */
const DRIFT = 0.8;
/** Share of the vertical in side view, where few animals are filmed swimming steeply. */
const STEEP = 0.5;

/** @typedef {{x: number, y: number, depth: number, heading: number, speed: number, fear: number, phase: number}} Boid phase of its wandering, rad
 * @typedef {{width: number, height: number, speed: number, isSide: boolean}} Tank sides in BL, usual speed in BL/s */

/**
 * Moves all boids in place.
 * @param {Boid[]} boids @param {Tank} tank @param {number} dt s @param {number[] | null} pointer BL
 */
export function stepBoids(boids, tank, dt, pointer) {
  // In a full tank they come closer.
  const reach = Math.min(APART, 0.7 * Math.sqrt((tank.width * tank.height) / boids.length));
  const wishes = boids.map((boid) => wish(boid, boids, { ...tank, reach }, pointer));
  for (const [k, boid] of boids.entries()) {
    const { sum, apart } = wishes[k];
    const turn = wrap(Math.atan2(sum[1], sum[0]) - boid.heading);
    const most = (TURN[0] + (TURN[1] - TURN[0]) * boid.fear) * dt;
    boid.heading = wrap(boid.heading + Math.max(-most, Math.min(most, turn)));
    boid.phase += dt;
    boid.fear = Math.max(boid.fear - dt / CALM_S, fearOf(boid, pointer));
    const speed = tank.speed * (1 + (FLIGHT - 1) * boid.fear);
    boid.speed += (speed - boid.speed) * Math.min(1, 8 * dt);
    boid.x = within(boid.x + (boid.speed * Math.cos(boid.heading) + DRIFT * apart[0]) * dt, tank.width);
    boid.y = within(boid.y + (boid.speed * Math.sin(boid.heading) + DRIFT * apart[1]) * dt, tank.height);
  }
}

/**
 * Returns the direction in which a boid wants to go, and the part that keeps it apart from its neighbors.
 * @param {Boid} boid @param {Boid[]} boids @param {Tank & {reach: number}} tank @param {number[] | null} pointer
 */
function wish(boid, boids, { width, height, isSide, reach }, pointer) {
  const [along, middle, apart] = [[0, 0], [0, 0], [0, 0]];
  let [nAlong, nMiddle] = [0, 0];
  for (const other of boids) {
    const [dx, dy, dz] = [other.x - boid.x, other.y - boid.y, other.depth - boid.depth];
    const distance = Math.hypot(dx, dy, dz);
    if (other === boid || distance > TOGETHER) continue;
    add(middle, dx / TOGETHER, dy / TOGETHER, 1);
    nMiddle++;
    if (distance < reach) add(apart, -dx, -dy, (reach - distance) / Math.max(0.1, distance));
    if (distance > ALONG) continue;
    add(along, Math.cos(other.heading), Math.sin(other.heading), 1);
    nAlong++;
  }
  const length = Math.hypot(...apart);
  if (length > 1) apart.forEach((value, axis) => { apart[axis] = value / length; });
  const sum = [Math.cos(boid.heading), Math.sin(boid.heading)];
  add(sum, -sum[1], sum[0], W_WANDER * Math.sin(boid.phase));
  add(sum, along[0], along[1], W_ALONG / Math.max(1, nAlong));
  add(sum, middle[0], middle[1], W_TOGETHER / Math.max(1, nMiddle));
  add(sum, apart[0], apart[1], W_APART);
  if (isSide) sum[1] *= STEEP;
  const fear = fearOf(boid, pointer);
  if (pointer && fear) add(sum, boid.x - pointer[0], boid.y - pointer[1], (W_FEAR * fear) / Math.max(0.1, Math.hypot(boid.x - pointer[0], boid.y - pointer[1])));
  for (const [axis, at, side] of [[0, boid.x, width], [1, boid.y, height]]) {
    const inward = push(at, side) - push(side - at, side);
    if (inward * sum[axis] < 0) sum[axis] *= 1 - Math.abs(inward); // turn along the wall
    sum[axis] += W_WALL * inward;
  }
  return { sum, apart };
}

/** Returns how much a boid fears the pointer: 1 at half the reach or nearer, 0 beyond it. @param {Boid} boid @param {number[] | null} pointer */
function fearOf({ x, y }, pointer) {
  if (!pointer) return 0;
  return Math.max(0, Math.min(1, 2 - (2 * Math.hypot(x - pointer[0], y - pointer[1])) / FEAR));
}

/** @param {number[]} sum @param {number} x @param {number} y @param {number} weight */
function add(sum, x, y, weight) {
  sum[0] += weight * x;
  sum[1] += weight * y;
}

/** @param {number} distance @param {number} side */
const push = (distance, side) => Math.max(0, Math.min(1, 1 - (distance - 0.5) / Math.min(WALL, side / 6)));
/** Keeps a centroid half a body length inside, if the picture has room for that. @param {number} at @param {number} side */
const within = (at, side) => Math.max(Math.min(0.5, side / 2), Math.min(side - Math.min(0.5, side / 2), at));

/** Returns an angle between -pi and pi. @param {number} angle */
export const wrap = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
