//! The flag `--set NAME=JSON` of `analyze`, `flock` and `fish`: any parameter by its name in the API.
//!
//! A dot leads into an object: `--set matching.w_v=0.5` sets the field `w_v` of `matching` and leaves the others.

use serde_json::{Map, Value, json};

use super::Error;

/// Parameters given by name.
#[derive(Debug, clap::Args)]
pub(super) struct Set {
    /// Set any parameter by its name in the API; the value is JSON, a bare word is a string. Repeatable. Example:
    /// --set threshold=25.
    #[arg(long = "set", value_name = "NAME=JSON")]
    set: Vec<String>,
}

impl Set {
    /// Overrides what `overrides` holds with the parameters given. Fails where one has no `=`, or a name leads into a value
    /// that is not an object.
    pub(super) fn apply(&self, overrides: &mut Map<String, Value>) -> Result<(), Error> {
        for setting in &self.set {
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
    use super::*;

    fn applied(set: &[&str]) -> Result<Value, String> {
        let set = Set {
            set: set.iter().map(|&one| one.to_owned()).collect(),
        };
        let mut overrides = Map::from_iter([("rules".to_owned(), json!({"alignment": 2}))]);
        let done = set.apply(&mut overrides).map_err(|error| error.to_string());
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
}
