//! Parameters of the virtual fish: colors, size, and motion
//! (docs/explanation/algorithms.md, "Virtual fish").

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::library::Animal;

/// Parameters of the virtual fish. Every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = FishParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Colors of the fish.
    pub palette: Palette,
    /// Length from the nose to the tip of the tail, in metres, > 0. null = the length of the measured
    /// animal, or 0.10 if it is unknown.
    pub length_m: Option<f64>,
    /// Height of the whole silhouette, fins included, in metres, > 0. null = the height of the measured
    /// animal, or 0.47 times the length if it is unknown.
    pub height_m: Option<f64>,
    /// Whether the body bends. false = the rigid fish of Nakajima et al.
    pub swim: bool,
    /// Maximum roll angle in a turn, in radians, 0..=0.8. 0 = the fish stays upright.
    pub bank_rad: f64,
    /// Standard deviation of the Gaussian that smooths the motion over time, in seconds, 0..=1. 0 = no
    /// smoothing.
    pub smooth_s: f64,
    /// Longest gap in the measurement that is filled by interpolation, in seconds, 0..=5. The fish is
    /// invisible during longer gaps.
    pub bridge_s: f64,
}

/// Color scheme of the virtual fish.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Palette {
    /// Common goldfish: orange, darker above, pale gold below.
    #[default]
    Goldfish,
    /// Silver with a slate back.
    Silver,
    /// Nearly black above, bronze below.
    Bronze,
}

impl Default for Params {
    fn default() -> Params {
        Params {
            palette: Palette::Goldfish,
            length_m: None,
            height_m: None,
            swim: true,
            bank_rad: 0.2,
            smooth_s: 0.06,
            bridge_s: 0.5,
        }
    }
}

impl Params {
    /// Returns the parameters of Nakajima et al.: a rigid, upright body and unsmoothed values.
    pub fn papers() -> Params {
        Params {
            swim: false,
            bank_rad: 0.0,
            smooth_s: 0.0,
            ..Params::default()
        }
    }

    /// Returns the size of the fish. Each dimension is the one set here, else the measured one, else the
    /// default.
    pub fn size(&self, measured: Option<Animal>) -> Animal {
        let length_m = self
            .length_m
            .or(measured.map(|a| a.length_m))
            .unwrap_or(DEFAULT_LENGTH_M);
        let height_m = self.height_m.or(measured.map(|a| a.height_m));
        Animal {
            length_m,
            height_m: height_m.unwrap_or(length_m * DEFAULT_HEIGHT_BL),
        }
    }

    /// Checks the range of every field. The error names the field and its range.
    pub fn check(&self) -> Result<(), String> {
        for (name, value) in [("length_m", self.length_m), ("height_m", self.height_m)] {
            if value.is_some_and(|v| !(v.is_finite() && v > 0.0)) {
                return Err(format!("{name} must be above 0: {value:?}"));
            }
        }
        for (name, value, most) in [
            ("bank_rad", self.bank_rad, 0.8),
            ("smooth_s", self.smooth_s, 1.0),
            ("bridge_s", self.bridge_s, 5.0),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(format!("{name} must lie in 0..={most}: {value}"));
            }
        }
        Ok(())
    }
}

/// Length of the fish if none is set or measured, in metres. Free choice.
const DEFAULT_LENGTH_M: f64 = 0.10;
/// Height of the silhouette if none is set or measured, in body lengths. A common goldfish with raised fins
/// has about this height.
const DEFAULT_HEIGHT_BL: f64 = 0.47;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_presets_lie_in_their_ranges_and_a_negative_length_does_not() {
        assert_eq!(Params::default().check(), Ok(()));
        assert_eq!(Params::papers().check(), Ok(()));
        let wrong = Params {
            length_m: Some(-0.1),
            ..Params::default()
        };
        assert!(wrong.check().is_err_and(|why| why.contains("length_m")));
        let wrong = Params {
            bank_rad: f64::NAN,
            ..Params::default()
        };
        assert!(wrong.check().is_err());
    }

    #[test]
    fn a_set_size_wins_over_the_measured_one() {
        let measured = Animal {
            length_m: 0.2,
            height_m: 0.08,
        };
        let params = Params {
            length_m: Some(0.3),
            ..Params::default()
        };
        let size = params.size(Some(measured));
        assert_eq!((size.length_m, size.height_m), (0.3, 0.08));
        assert_eq!(Params::default().size(Some(measured)), measured);
    }
}
