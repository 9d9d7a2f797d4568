//! Parameters from JSON: `{"preset": "papers", "kappa": 3}` overrides values of a preset; without a preset it
//! overrides the defaults. All kinds of parameters use this module.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};

use crate::analysis;
use crate::parameters::Parameters;

/// Reasons why a JSON object is not a valid set of parameters.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The preset is unknown.
    #[error("the preset is unknown: {0}")]
    UnknownPreset(String),
    /// A parameter is unknown, of the wrong type, or out of its range.
    #[error("{0}")]
    Invalid(String),
}

/// Returns the parameters of an object with an optional `preset` and overrides. The error names the
/// parameter.
pub fn read<P: Parameters>(mut overrides: Map<String, Value>) -> Result<P, Error> {
    let start = match overrides.remove("preset") {
        None | Some(Value::Null) => P::default(),
        Some(name) => {
            let found = name.as_str().and_then(P::preset);
            found.ok_or_else(|| Error::UnknownPreset(name.to_string()))?
        }
    };
    let mut merged = serde_json::to_value(start).map_err(invalid)?;
    override_with(&mut merged, Value::Object(overrides));
    let params: P = serde_json::from_value(merged).map_err(invalid)?;
    params.check().map_err(Error::Invalid)?;
    Ok(params)
}

/// Merges overrides into a value. Objects are merged field by field, other values are replaced.
fn override_with(value: &mut Value, overrides: Value) {
    match (value, overrides) {
        (Value::Object(fields), Value::Object(overrides)) => {
            for (name, value) in overrides {
                override_with(fields.entry(name).or_insert(Value::Null), value);
            }
        }
        (value, overrides) => *value = overrides,
    }
}

/// Parameters of an analysis that no longer exist. Files of older versions hold them.
const REMOVED: [&str; 1] = ["approximate"];

/// Reads the parameters of an analysis from a file of any version; null if the file has none.
pub(super) fn of_any_version<'de, D: Deserializer<'de>>(
    file: D,
) -> Result<Option<analysis::Params>, D::Error> {
    let Some(mut fields) = Option::<Map<String, Value>>::deserialize(file)? else {
        return Ok(None);
    };
    fields.retain(|name, _| !REMOVED.contains(&name.as_str()));
    let params = serde_json::from_value(Value::Object(fields));
    params.map(Some).map_err(D::Error::custom)
}

fn invalid(error: serde_json::Error) -> Error {
    Error::Invalid(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock;

    fn analysis(json: &str) -> Result<analysis::Params, Error> {
        read(serde_json::from_str(json).unwrap())
    }

    #[test]
    fn empty_object_gives_the_defaults() {
        assert_eq!(analysis("{}"), Ok(analysis::Params::default()));
    }

    #[test]
    fn parameters_override_the_values_of_the_preset() {
        let papers = analysis::Params::papers();
        assert_eq!(
            analysis(r#"{"preset": "papers", "mirror": true}"#),
            Ok(analysis::Params {
                mirror: true,
                ..papers
            })
        );
    }

    #[test]
    fn every_preset_of_a_flock_is_read_by_name() {
        for &name in flock::Params::PRESETS {
            let overrides = Map::from_iter([("preset".to_owned(), Value::from(name))]);
            assert_eq!(read(overrides).ok(), flock::Params::preset(name), "{name}");
        }
        let json = r#"{"matching": {"by": "position"}}"#;
        let params: flock::Params = read(serde_json::from_str(json).unwrap()).unwrap();
        assert_eq!(params.matching.by, flock::params::MatchBy::Position);
    }

    #[test]
    fn numbers_are_stored_and_read_back_exactly() {
        for kappa in [
            "0.218446744073709551615",
            "1.7976931348623157",
            "2.2250738585072011e-5",
        ] {
            let params = analysis(&format!(r#"{{"kappa": {kappa}}}"#)).unwrap();
            let stored = serde_json::to_string(&params).unwrap();
            assert_eq!(serde_json::from_str(&stored).ok(), Some(params), "{kappa}");
        }
    }

    #[test]
    fn unknown_names_and_values_out_of_range_are_named() {
        let error = |json| analysis(json).unwrap_err().to_string();
        assert_eq!(error(r#"{"preset": "p"}"#), "the preset is unknown: \"p\"");
        assert!(error(r#"{"colour": 1}"#).contains("colour"));
        assert_eq!(
            error(r#"{"threshold": 0}"#),
            "threshold must lie in 1..=254: 0"
        );
    }
}
