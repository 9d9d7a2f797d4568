//! The step from one pixel of a picture row to the next, in the sprite.

/// The step through the sprite for one picture column, in 1/65536 of a sprite pixel.
pub(super) struct Step {
    pub(super) per_column: [i32; 2],
    /// Steps per 1/65536 of a pixel, as a fraction of 2^32, rounded down.
    per_unit: [u64; 2],
}

impl Step {
    pub(super) fn new(per_column: [i32; 2]) -> Step {
        Step {
            per_column,
            per_unit: per_column.map(|step| (1 << 32) / u64::from(step.unsigned_abs().max(1))),
        }
    }

    /// Returns the same path in the opposite direction.
    pub(super) fn reversed(&self) -> Step {
        Step {
            per_column: self.per_column.map(|step| -step),
            per_unit: self.per_unit,
        }
    }

    /// Returns the position after `n` steps.
    #[inline(always)]
    pub(super) fn position_after(&self, from: [i32; 2], n: i32) -> [i32; 2] {
        std::array::from_fn(|k| from[k] + self.per_column[k] * n)
    }

    /// Returns a number of steps, at least 1. Fewer steps stay within `distance` along the axis.
    #[inline(always)]
    pub(super) fn n_steps_beyond(&self, distance: u32, axis: usize) -> usize {
        ((u64::from(distance) * self.per_unit[axis]) >> 32) as usize + 1
    }
}
