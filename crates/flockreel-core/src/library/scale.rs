//! The scale of a film: pixels per centimetre of the floor (seen from above) or of the plane in which the
//! animal moves (seen from the side). It is set after the measurement and changes none of its files.

use std::ops::RangeInclusive;

use crate::geometry::rounded;

/// Pixels per centimetre. Free choice: from a film of ten metres a pixel to one of ten nanometres.
const PX_PER_CM: RangeInclusive<f64> = 1e-3..=1e6;
/// Least unit in which lengths are written, pixels. Positions in the picture are rounded to it too.
const UNIT_PX: f64 = 1e-3;

/// Decimals of a scale that follows from a length: a millionth of the least scale.
const DECIMALS: i32 = 9;

/// A number of pixels per centimetre that lies within the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale(f64);

/// Reasons why a scale is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ScaleError {
    /// The number is outside of the limits or not finite.
    #[error("px_per_cm must lie in {}..={}: {px_per_cm}", PX_PER_CM.start(), PX_PER_CM.end())]
    OutOfRange {
        /// Given scale, pixels per centimetre.
        px_per_cm: f64,
    },
    /// The length of the animal in the picture is unknown.
    #[error("no frame shows the whole animal, so its length gives no scale: give px_per_cm")]
    LengthUnknown,
    /// The length of the animal gives a scale outside of the limits.
    #[error("length_cm is not the length of an animal of {length_px} pixels: {length_cm}")]
    WrongLength {
        /// Given length, centimetres.
        length_cm: f64,
        /// Measured length, pixels.
        length_px: f64,
    },
}

impl Scale {
    /// Returns the scale with this number of pixels per centimetre, 0.001..=1000000.
    pub fn new(px_per_cm: f64) -> Result<Scale, ScaleError> {
        let is_valid = PX_PER_CM.contains(&px_per_cm);
        (is_valid.then_some(Scale(px_per_cm))).ok_or(ScaleError::OutOfRange { px_per_cm })
    }

    /// Returns the scale at which an animal of `length_px` pixels is `length_cm` centimetres long. An animal of
    /// 50 pixels that is 10 cm long gives 5 pixels per centimetre.
    pub fn from_length(length_cm: f64, length_px: Option<f64>) -> Result<Scale, ScaleError> {
        let length_px = length_px.ok_or(ScaleError::LengthUnknown)?;
        let wrong = |_out_of_range| ScaleError::WrongLength {
            length_cm,
            length_px,
        };
        Scale::new(rounded(length_px / length_cm, DECIMALS)).map_err(wrong)
    }

    /// Returns the number of pixels per centimetre.
    pub fn px_per_cm(self) -> f64 {
        self.0
    }

    /// Returns a length in centimetres, rounded to a decimal place below a thousandth of a pixel.
    pub fn cm(self, length_px: f64) -> f64 {
        rounded(length_px / self.0, self.decimals())
    }

    /// Returns an area in square centimetres, rounded like [`Scale::cm`].
    pub fn cm2(self, area_px: f64) -> f64 {
        rounded(area_px / (self.0 * self.0), 2 * self.decimals())
    }

    fn decimals(self) -> i32 {
        (libm::log10(self.0 / UNIT_PX).ceil() as i32).max(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_and_areas_follow_from_the_scale() {
        let scale = Scale::from_length(10.0, Some(50.0)).expect("in range");
        assert_eq!(scale.px_per_cm(), 5.0);
        assert_eq!((scale.cm(12.5), scale.cm2(12.5)), (2.5, 0.5));
        // A thousandth of a pixel is 0.0002 cm.
        assert_eq!(scale.cm(1.0 / 3.0), 0.0667);
    }

    #[test]
    fn scales_out_of_range_are_refused() {
        for px_per_cm in [0.0, -1.0, 1e-4, 1e7, f64::NAN, f64::INFINITY] {
            assert!(Scale::new(px_per_cm).is_err(), "{px_per_cm}");
        }
        for length_cm in [0.0, -1.0, 1e9, f64::NAN, f64::INFINITY] {
            let refused = Scale::from_length(length_cm, Some(50.0));
            assert!(
                matches!(refused, Err(ScaleError::WrongLength { .. })),
                "{length_cm}"
            );
        }
        assert_eq!(
            Scale::from_length(10.0, None),
            Err(ScaleError::LengthUnknown)
        );
        let sentence = Scale::new(0.0).expect_err("too small").to_string();
        assert_eq!(sentence, "px_per_cm must lie in 0.001..=1000000: 0");
    }
}
