//! Mends: parameters of the analysis that may mend a refusal, with proposed values where the film tells them, and files
//! beside the film. The page makes controls of them, the command line flags.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::ToSchema;

use flockreel_core::analysis::{self, Params};
use flockreel_core::code::Code;
use flockreel_core::footage::FootageFormat;
use flockreel_core::geometry::Rect;

/// Shortest part of a film that is proposed, seconds. Free choice; an analysis needs 16 frames.
const MIN_PART_S: f64 = 1.0;
/// Largest box that is proposed to be ignored, as a share of the picture. Free choice: a larger one leaves the animal no
/// room.
const MAX_IGNORED_SHARE: f64 = 0.5;
/// Proposed threshold for a film in which nothing was found, as a share of the one that was used. Free choice.
const LOWER_THRESHOLD: f64 = 0.5;

/// A change of the request that may mend a refusal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Mend {
    /// Parameter of the analysis, or `background` or `masks`: a file beside the film.
    pub param: String,
    /// Proposed value of the parameter. null = the user chooses it.
    pub value: Value,
}

/// Returns the names of the parameters and files that may mend a failure with this code, the most promising first. Empty
/// if none does.
pub fn names_for(code: Code) -> &'static [&'static str] {
    match code {
        Code::SeveralAnimals => &["animal_at", "follow"],
        Code::NothingMoves => &["threshold", "background", "masks"],
        Code::NothingAtPoint => &["animal_at", "threshold"],
        Code::BackgroundNotStatic => &["ignore", "to_s", "masks"],
        Code::CameraMoved | Code::LightChanges | Code::SceneChanges => &["to_s", "masks"],
        Code::AnimalTooLarge => &["masks"],
        Code::TooFewFrames => &["from_s"],
        Code::AnimalTooSmall => &["sprites"],
        Code::BackgroundSizeDiffers => &["background"],
        Code::MasksDiffer => &["masks", "fps"],
        Code::MasksEmpty => &["masks"],
        Code::TimeLimit | Code::MemoryLimit => &["to_s"],
        _ => &[],
    }
}

impl Mend {
    /// Returns the mends of a failure of which only the code is known.
    pub fn all_for(code: Code) -> Vec<Mend> {
        let names = names_for(code).iter();
        names.map(|name| Mend::new(name, Value::Null)).collect()
    }

    /// Returns the mends of a refusal, for a film that was measured with these parameters.
    pub fn all_of(cause: &analysis::Error, params: &Params, format: &FootageFormat) -> Vec<Mend> {
        let names = names_for(cause.code()).iter();
        names
            .flat_map(|name| {
                let values = proposed(name, cause, params, format);
                values.into_iter().map(|value| Mend::new(name, value))
            })
            .collect()
    }

    fn new(name: &str, value: Value) -> Mend {
        Mend {
            param: name.to_owned(),
            value,
        }
    }
}

/// Returns the values that are proposed for a parameter: none if it does not help, null if the user chooses it.
fn proposed(
    name: &str,
    cause: &analysis::Error,
    params: &Params,
    format: &FootageFormat,
) -> Vec<Value> {
    use analysis::Error::*;
    match (name, cause) {
        ("animal_at", SeveralAnimals { frame, boxes_px }) => {
            let at =
                |of: &Rect| json!({"frame": frame, "at_px": [of.x + of.w / 2, of.y + of.h / 2]});
            boxes_px.iter().map(at).collect()
        }
        ("follow", _) => vec![json!("largest")],
        ("threshold", _) => {
            let lower = (f64::from(params.threshold) * LOWER_THRESHOLD) as u8;
            Vec::from_iter((lower >= 1).then(|| json!(lower)))
        }
        ("ignore", BackgroundNotStatic { box_px, .. }) => vec![ignored(*box_px, params, format)],
        (
            "to_s",
            BackgroundNotStatic { at_s, .. }
            | CameraMoves { at_s }
            | LightChanges { at_s }
            | SceneChanges { at_s },
        ) => {
            // Rounded down, so that the change is outside of the part.
            let end_s = (10.0 * at_s).floor() / 10.0;
            let is_long = end_s - params.from_s.unwrap_or(0.0) >= MIN_PART_S;
            vec![if is_long { json!(end_s) } else { Value::Null }]
        }
        ("from_s", TooFewFrames { .. }) => {
            let is_part = params.from_s.is_some() || params.to_s.is_some();
            Vec::from_iter(is_part.then_some(Value::Null))
        }
        _ => vec![Value::Null],
    }
}

/// Returns the boxes to ignore with one more, or null if the new one would hide most of the picture.
fn ignored(box_px: Option<Rect>, params: &Params, format: &FootageFormat) -> Value {
    let n_px = f64::from(format.width) * f64::from(format.height);
    let area = |rect: &Rect| f64::from(rect.w) * f64::from(rect.h);
    match box_px.filter(|rect| area(rect) <= MAX_IGNORED_SHARE * n_px) {
        Some(Rect { x, y, w, h }) => {
            let mut boxes: Vec<Value> = params.ignore.iter().map(|one| json!(one)).collect();
            boxes.push(json!({"box_px": [x, y, w, h], "from_s": null, "to_s": null}));
            json!(boxes)
        }
        None => Value::Null,
    }
}

#[cfg(test)]
mod tests {
    use flockreel_core::analysis::Error;
    use flockreel_core::raster::ColorSpec;

    use super::*;

    fn mends(cause: &Error, params: &Params) -> Vec<(String, Value)> {
        let format = FootageFormat {
            width: 100,
            height: 80,
            fps: 20.0,
            n_frames_hint: 200,
            color: ColorSpec::default(),
        };
        let mends = Mend::all_of(cause, params, &format).into_iter();
        mends.map(|mend| (mend.param, mend.value)).collect()
    }

    fn value_of(name: &str, cause: &Error, params: &Params) -> Value {
        let mends = mends(cause, params);
        let found = mends.into_iter().find(|(param, _)| param == name);
        found.expect("it is proposed").1
    }

    #[test]
    fn each_of_several_animals_can_be_followed() {
        let boxes_px = [Rect::new(10, 20, 4, 6), Rect::new(50, 20, 8, 6)];
        let several = Error::SeveralAnimals { frame: 7, boxes_px };
        let at = |x, y| ("animal_at".to_owned(), json!({"frame": 7, "at_px": [x, y]}));
        let follow = ("follow".to_owned(), json!("largest"));
        assert_eq!(
            mends(&several, &Params::default()),
            [at(12, 23), at(54, 23), follow]
        );
    }

    #[test]
    fn the_region_that_moves_is_ignored_besides_others_unless_it_is_most_of_the_picture() {
        let moves = |w| Error::BackgroundNotStatic {
            at_s: 0.0,
            box_px: Some(Rect::new(0, 0, w, 80)),
        };
        let known = json!({"box_px": [1, 2, 3, 4], "from_s": null, "to_s": null});
        let params = Params {
            ignore: vec![serde_json::from_value(known.clone()).unwrap()],
            ..Params::default()
        };
        let new = json!({"box_px": [0, 0, 50, 80], "from_s": null, "to_s": null});
        assert_eq!(value_of("ignore", &moves(50), &params), json!([known, new]));
        assert_eq!(value_of("ignore", &moves(51), &params), Value::Null);
    }

    #[test]
    fn the_part_before_a_change_is_proposed_if_it_is_long_enough() {
        let end = |at_s, from_s| {
            let params = Params {
                from_s,
                ..Params::default()
            };
            value_of("to_s", &Error::CameraMoves { at_s }, &params)
        };
        assert_eq!(end(4.29, None), json!(4.2));
        assert_eq!(end(4.29, Some(3.5)), Value::Null);
        assert_eq!(end(0.9, None), Value::Null);
    }

    #[test]
    fn too_few_frames_are_mended_only_where_a_part_was_chosen() {
        let few = Error::TooFewFrames {
            n_frames: 9,
            least: 16,
        };
        assert_eq!(mends(&few, &Params::default()), []);
        let part = Params {
            to_s: Some(0.5),
            ..Params::default()
        };
        assert_eq!(mends(&few, &part), [("from_s".to_owned(), Value::Null)]);
    }

    #[test]
    fn a_threshold_is_lowered_until_it_is_the_lowest() {
        let lower = |threshold| {
            let params = Params {
                threshold,
                ..Params::default()
            };
            mends(&Error::NothingMoves, &params)
        };
        assert_eq!(lower(18)[0], ("threshold".to_owned(), json!(9)));
        assert!(lower(1).iter().all(|(param, _)| param != "threshold"));
    }

    #[test]
    fn every_mend_is_a_parameter_or_a_file_beside_the_film() {
        let known = serde_json::to_value(Params::default()).unwrap();
        for &code in Code::ALL {
            for name in names_for(code) {
                let is_file = ["background", "masks"].contains(name);
                assert!(is_file || known.get(name).is_some(), "{code}: {name}");
            }
        }
    }
}
