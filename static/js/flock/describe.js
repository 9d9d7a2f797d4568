// What a frame of a flock shows, for people who do not see it.
// @ts-check

/** Individuals within this distance are of one group, body lengths, as in the statistics of a flock. */
const GROUP_BL = 4;
/** An individual is at rest below this speed, body lengths per second. */
const REST_BL_PER_S = 0.1;
/** Frames before and after, between which the direction of motion is taken. */
const REACH = 5;
const DIRECTIONS = ["right", "down", "left", "up"];

/**
 * Returns how many individuals there are, where most of them (three fifths) head, whether most rest, and in
 * how many groups they are.
 * @param {import("./plan.js").Plan} plan @param {number} frame
 */
export function factsOf(plan, frame) {
  const [first, last] = [Math.max(0, frame - REACH), Math.min(plan.nFrames - 1, frame + REACH)];
  const heads = [0, 0, 0, 0];
  let nResting = 0;
  const points = [];
  for (let i = 0; i < plan.nIndividuals; i++) {
    const [from, to, at] = [first, last, frame].map((t) => plan.cell(i, t));
    const [dx, dy] = [to.x - from.x, to.y - from.y];
    const speed = Math.hypot(dx, dy) / plan.lengthPx / (Math.max(1, last - first) / plan.fps);
    if (speed < REST_BL_PER_S) nResting++;
    else heads[Math.round(Math.atan2(dy, dx) / (Math.PI / 2)) & 3]++;
    points.push([at.x, at.y, at.depth]);
  }
  const most = 0.6 * plan.nIndividuals;
  const heading = DIRECTIONS.find((_, k) => heads[k] >= most) ?? null;
  return { n: plan.nIndividuals, heading, isResting: nResting >= most, nGroups: groups(points, GROUP_BL * plan.lengthPx) };
}

/** Returns the number of groups of points that links up to `reach` connect. @param {number[][]} points @param {number} reach */
function groups(points, reach) {
  const left = new Set(points);
  let n = 0;
  for (const seed of points) {
    if (!left.delete(seed)) continue;
    n++;
    const open = [seed];
    for (let one = open.pop(); one; one = open.pop()) {
      for (const other of left) {
        if (Math.hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]) > reach) continue;
        left.delete(other);
        open.push(other);
      }
    }
  }
  return n;
}
