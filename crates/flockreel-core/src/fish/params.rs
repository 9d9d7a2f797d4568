//! Parameters of the virtual fish, with defaults and limits: colors, size, and motion
//! (docs/explanation/algorithms.md, "Virtual fish").

use serde::{Deserialize, Serialize};
use smart_default::SmartDefault;
use utoipa::ToSchema;

use crate::library::Animal;
use crate::parameters::Parameters;

/// Parameters of the virtual fish. Every field has a default.
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[schema(as = FishParams)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Body of the virtual animal: the filmed one, or a goldfish that moves as it does.
    #[default(Body::Own)]
    pub body: Body,
    /// Colors of the goldfish.
    #[default(Palette::Goldfish)]
    pub palette: Palette,
    /// Length from the nose to the tip of the tail, in metres. null = the length of the measured animal,
    /// or 0.10 if it is unknown.
    #[schema(minimum = 0.000001, maximum = 10000)]
    pub length_m: Option<f64>,
    /// Height of the whole silhouette, fins included, in metres. null = the height of the measured animal,
    /// or 0.47 times the length if it is unknown.
    #[schema(minimum = 0.000001, maximum = 10000)]
    pub height_m: Option<f64>,
    /// Whether the body bends. false = the rigid fish of Nakajima et al.
    #[default = true]
    pub swim: bool,
    /// Maximum roll angle in a turn, in radians. 0 = the fish stays upright.
    #[default = 0.2]
    #[schema(minimum = 0, maximum = 0.8)]
    pub bank_rad: f64,
    /// Standard deviation of the Gaussian that smooths the motion over time, in seconds. 0 = no smoothing.
    #[default = 0.06]
    #[schema(minimum = 0, maximum = 1)]
    pub smooth_s: f64,
    /// Longest gap in the measurement that is filled by interpolation, in seconds. The fish is invisible
    /// during longer gaps.
    #[default = 0.5]
    #[schema(minimum = 0, maximum = 5)]
    pub bridge_s: f64,
}

/// Body of the virtual animal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Body {
    /// Outline and colors of the filmed animal.
    Own,
    /// Model of a common goldfish.
    Goldfish,
}

/// Color scheme of the virtual fish.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Palette {
    /// Common goldfish: orange, darker above, pale gold below.
    Goldfish,
    /// Silver with a slate back.
    Silver,
    /// Nearly black above, bronze below.
    Bronze,
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
}

impl Parameters for Params {
    const PRESETS: &'static [&'static str] = &["papers"];

    fn preset(name: &str) -> Option<Params> {
        (name == "papers").then(Params::papers)
    }

    fn check_combinations(&self) -> Result<(), String> {
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
    fn presets_pass_the_check_and_a_negative_length_does_not() {
        assert_eq!(Params::default().check(), Ok(()));
        assert_eq!(Params::papers().check(), Ok(()));
        let wrong = Params {
            length_m: Some(-0.1),
            ..Params::default()
        };
        let sentence = "length_m must lie in 0.000001..=10000: -0.1";
        assert_eq!(wrong.check(), Err(sentence.into()));
        let wrong = Params {
            bank_rad: f64::NAN,
            ..Params::default()
        };
        assert!(wrong.check().is_err());
    }

    #[test]
    fn explicit_size_overrides_the_measured_one() {
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
