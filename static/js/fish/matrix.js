// Matrices of 4 x 4 numbers, column by column, as WebGL and glTF have them.
// @ts-check

/** @typedef {ArrayLike<number>} Matrix */

/** Returns the product of two matrices: first b, then a. @param {Matrix} a @param {Matrix} b @returns {number[]} */
export function multiply(a, b) {
  const product = new Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      product[4 * column + row] = sum;
    }
  }
  return product;
}

/** Returns the matrix of a turn (a unit quaternion x, y, z, w), followed by a move. @param {ArrayLike<number>} turn @param {ArrayLike<number>} move @returns {number[]} */
export function rigid(turn, move) {
  const [x, y, z, w] = [turn[0], turn[1], turn[2], turn[3]];
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
    2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
    2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0,
    move[0], move[1], move[2], 1,
  ];
}

/** Returns a point moved by a matrix. @param {Matrix} m @param {ArrayLike<number>} point */
export const moved = (m, { 0: x, 1: y, 2: z }) => [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
