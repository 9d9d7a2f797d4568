//! Who is near and how many are nearer, in plain Rust: the definition.

use super::Near;
use crate::flock::boids::grid::Grid;
use crate::flock::boids::vector::{dot, minus};

/// Everybody is looked at whose cell may be within the radius.
#[inline(always)]
pub(super) fn gather(grid: &Grid, (slot, radius_bl): (usize, f64), near: &mut Near) {
    let place = grid.at(slot).position;
    let most_bl2 = radius_bl * radius_bl;
    near.n = 0;
    for (from, to) in grid.rows(place, radius_bl) {
        near.make_room(to - from);
        for at in from..to {
            let offset = minus([0, 1, 2].map(|axis| grid.along(axis)[at]), place);
            let square_bl2 = dot(offset, offset);
            // Written in any case, kept when near: nothing to be guessed wrong.
            (near.squares_bl2[near.n], near.slots[near.n]) = (square_bl2, at as u64);
            near.n += usize::from((square_bl2 < most_bl2) & (at != slot));
        }
    }
}

/// Counted one by one, which knows no branch.
#[inline(always)]
pub(super) fn rank(near: &mut Near) {
    let squares = &near.squares_bl2[..near.n];
    for (rank, square) in near.ranks.iter_mut().zip(squares) {
        *rank = squares.iter().map(|other| u64::from(other < square)).sum();
    }
}
