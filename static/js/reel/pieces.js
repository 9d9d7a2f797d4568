// The pieces of film that were put together for one individual: runs of source frames that follow each other.
// @ts-check

/** Returns an angle in radians as degrees from -180 to 180. @param {number} rad */
export const turnsOf = (rad) => (Math.atan2(Math.sin(rad), Math.cos(rad)) * 180) / Math.PI;

/**
 * Returns the pieces of an individual in the order of time: first shown frame, number of frames, first source frame,
 * whether it is mirrored, and the mean angle between the heading that was asked and the one that is shown.
 * @param {{source_frame: number[], mirrored: boolean[], heading_rad: number[], boid: {heading_rad: number[]}}} individual
 */
export function piecesOf({ source_frame, mirrored, heading_rad, boid }) {
  /** @type {{at: number, n: number, from: number, mirrored: boolean, gap_deg: number}[]} */
  const pieces = [];
  source_frame.forEach((frame, t) => {
    const follows = t > 0 && frame === source_frame[t - 1] + 1 && mirrored[t] === mirrored[t - 1];
    if (!follows) pieces.push({ at: t, n: 0, from: frame, mirrored: mirrored[t], gap_deg: 0 });
    const piece = pieces[pieces.length - 1];
    const gap = Math.abs(turnsOf(heading_rad[t] - boid.heading_rad[t]));
    piece.gap_deg += (gap - piece.gap_deg) / (piece.n + 1);
    piece.n += 1;
  });
  return pieces;
}
