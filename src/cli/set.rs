//! Flags of `analyze`, `flock` and `fish` that set parameters: `--set NAME=JSON` for any parameter by its name in
//! the API, and the help of flags for one parameter, which follows from its schema.
//!
//! A dot leads into an object: `--set matching.w_v=0.5` sets the field `w_v` of `matching` and leaves the others.

use serde_json::{Map, Value, json};

use super::Error;
use flockreel_core::parameters::{Parameters, Schemas};

/// Overrides parameters with the values of `--set`. Fails where one has no `=`, or a name leads into a value that is
/// not an object.
pub fn apply(settings: &[String], overrides: &mut Map<String, Value>) -> Result<(), Error> {
    for setting in settings {
        let (name, value) = setting
            .split_once('=')
            .ok_or_else(|| Error::Usage(format!("--set takes NAME=JSON: {setting}")))?;
        let value = serde_json::from_str(value).unwrap_or_else(|_| json!(value));
        insert(overrides, name, value).ok_or_else(|| {
            Error::Usage(format!(
                "--set: the name leads into a value that is not an object: {name}"
            ))
        })?;
    }
    Ok(())
}

/// Parses a number. JSON has no infinity: a number such as 1e999 would become null, and so the default.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_not_a_number| "not a number")?;
    let too_large = || "the number must be finite".to_owned();
    number.is_finite().then_some(number).ok_or_else(too_large)
}

/// Returns the help of `--set`, with an example of the command.
pub(super) fn help(example: &str) -> String {
    format!(
        "Set any parameter by its name in the API; the value is JSON, or a word without quotes. Repeatable. Example: \
         --set {example}"
    )
}

/// Returns the help of `--preset`.
pub(super) fn presets_help<P: Parameters>() -> String {
    let names = P::PRESETS.join(", ");
    format!("Preset to start from. Other flags override its values [possible values: {names}]")
}

/// Returns the help of a flag that sets one parameter: its description, limits, default and values.
pub(super) fn parameter_help<P: Parameters>(name: &str) -> String {
    let schemas = Schemas::new::<P>();
    let schema = schemas.parameter(name);
    let inner = schema["oneOf"].get(0).unwrap_or(schema);
    let description = inner["description"].as_str().unwrap_or_default();
    let description = description.replace('\n', " ");
    let mut help = description.replace("null = ", "Default: ");
    match (
        &schema["minimum"],
        &schema["maximum"],
        &schema["exclusiveMinimum"],
    ) {
        (min, max, _) if min.is_number() && max.is_number() => {
            help += &format!(" Limits: {min} to {max}.");
        }
        (_, max, min) if min.is_number() && max.is_number() => {
            help += &format!(" Above {min}, at most {max}.");
        }
        _ => {}
    }
    let mut help = help.trim_end_matches('.').to_owned();
    match &schema["default"] {
        Value::Null => {}
        Value::String(name) => help += &format!(" [default: {name}]"),
        Value::Array(items) => {
            let words = items.iter().map(|item| match item {
                Value::String(word) => word.clone(),
                other => other.to_string(),
            });
            help += &format!(" [default: {}]", words.collect::<Vec<_>>().join(" "));
        }
        default => help += &format!(" [default: {default}]"),
    }
    let choices = schemas.choices(name);
    if !choices.is_empty() {
        help += &format!(" [possible values: {}]", choices.join(", "));
    }
    help
}

/// Inserts a value at a dotted name; `None` where the name leads into a value that is not an object.
fn insert(fields: &mut Map<String, Value>, name: &str, value: Value) -> Option<()> {
    match name.split_once('.') {
        None => {
            fields.insert(name.to_owned(), value);
            Some(())
        }
        Some((outer, inner)) => {
            let object = fields.entry(outer).or_insert_with(|| json!({}));
            insert(object.as_object_mut()?, inner, value)
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::cli::Cli;

    fn applied(set: &[&str]) -> Result<Value, String> {
        let set: Vec<String> = set.iter().map(|&one| one.to_owned()).collect();
        let mut overrides = Map::from_iter([("rules".to_owned(), json!({"alignment": 2}))]);
        let done = apply(&set, &mut overrides).map_err(|error| error.to_string());
        done.map(|()| Value::Object(overrides))
    }

    #[test]
    fn dotted_name_sets_one_field_of_an_object() {
        let wanted = json!({"rules": {"alignment": 2, "wander": 0.5}, "position": "boid"});
        assert_eq!(
            applied(&["rules.wander=0.5", "position=boid"]),
            Ok(wanted.clone())
        );
    }

    #[test]
    fn setting_without_a_value_or_into_a_number_is_refused() {
        assert!(applied(&["seed"]).unwrap_err().contains("NAME=JSON"));
        let sentence = applied(&["rules.alignment.x=1"]).unwrap_err();
        assert!(sentence.contains("rules.alignment.x"), "{sentence}");
    }

    #[test]
    fn infinite_number_is_no_default() {
        assert_eq!(finite("2.5"), Ok(2.5));
        for text in ["1e999", "inf", "-inf", "NaN", "", "1,5"] {
            assert!(finite(text).is_err(), "{text}");
        }
        for line in [
            "analyze a -o b --fps",
            "analyze a -o b --pixel-aspect",
            "analyze a -o b --from",
            "analyze a -o b --to",
            "analyze a -o b --animal-height 1 --animal-length",
            "analyze a -o b --animal-length 1 --animal-height",
            "flock a -o b --spacing",
            "flock a -o b --haze",
            "flock a -o b --shadow",
        ] {
            let line = format!("flockreel {line} 1e999");
            let parsed = Cli::command().try_get_matches_from(line.split(' '));
            assert!(parsed.unwrap_err().to_string().contains("finite"), "{line}");
        }
    }

    #[test]
    fn help_of_a_flag_follows_from_the_parameter() {
        let help = parameter_help::<flockreel_core::flock::Params>("variation");
        assert!(help.contains("Limits: 0 to 0.3 [default: 0.05]"), "{help}");
        let help = parameter_help::<flockreel_core::flock::Params>("render.cut");
        assert!(
            help.ends_with("[default: fade] [possible values: fade, morph]"),
            "{help}"
        );
        let help = parameter_help::<flockreel_core::analysis::Params>("view");
        assert!(
            help.ends_with("Default: guessed [possible values: side, top]"),
            "{help}"
        );
        let help = parameter_help::<flockreel_core::analysis::Params>("kappa");
        assert!(
            help.ends_with("Above 0, at most 1000000 [default: 2.0]"),
            "{help}"
        );
    }
}
