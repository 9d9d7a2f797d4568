//! Parameters of analyses, flocks and fish: where their defaults and limits are written, and their check.
//!
//! A parameter is one field of a struct. Its doc comment is its description, `#[default]` its default, and
//! `#[schema]` its limits. [`Parameters::check`], `/openapi.json`, `--help` and docs/reference/settings.md all
//! read the schema that follows from the field.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use utoipa::ToSchema;

/// Parameters with limits and presets.
pub trait Parameters: Serialize + DeserializeOwned + PartialEq + Default + ToSchema {
    /// Names of the presets.
    const PRESETS: &'static [&'static str];

    /// Returns the parameters of a preset, or `None` for an unknown name.
    fn preset(name: &str) -> Option<Self>;

    /// Checks the rules that no single field can state, such as a limit that depends on another parameter.
    fn check_combinations(&self) -> Result<(), String>;

    /// Checks all limits and rules. The error names the parameter, its limits and its value.
    fn check(&self) -> Result<(), String> {
        let json = serde_json::to_value(self).map_err(|error| error.to_string())?;
        let schemas = Schemas::new::<Self>();
        schemas.check("", &schemas.root, &json)?;
        // JSON has no NaN and no infinity. They have become null, which is another value.
        if serde_json::from_value::<Self>(json).ok().as_ref() != Some(self) {
            return Err("all numbers must be finite".into());
        }
        self.check_combinations()
    }
}

/// Schema of a coordinate in the image of the footage, pixels. The limits are a free choice.
#[derive(ToSchema)]
#[schema(minimum = -100000, maximum = 100000)]
#[expect(dead_code, reason = "it only describes numbers in the schema")]
pub(crate) struct CoordinatePx(f64);

/// JSON Schema of a type, with the schemas that it refers to.
pub struct Schemas {
    root: Value,
    referred: Map<String, Value>,
}

impl Schemas {
    /// Returns the schemas of a type.
    pub fn new<T: ToSchema>() -> Schemas {
        let mut referred = Vec::new();
        T::schemas(&mut referred);
        let json = |schema| serde_json::to_value(schema).unwrap_or_default();
        let referred = referred.into_iter();
        Schemas {
            root: json(T::schema()),
            referred: referred.map(|(name, to)| (name, json(to))).collect(),
        }
    }

    /// Returns the schema of a parameter, null if there is none. A dot leads into an object: `rules.wander`.
    pub fn parameter(&self, name: &str) -> &Value {
        (name.split('.')).fold(&self.root, |schema, field| {
            &self.resolve(schema)["properties"][field]
        })
    }

    /// Returns the values that a parameter may have, if they are names.
    pub fn choices(&self, name: &str) -> Vec<&str> {
        let schema = self.parameter(name);
        let schema = schema["oneOf"].get(0).unwrap_or(schema);
        let names = self.resolve(schema)["enum"].as_array();
        names
            .into_iter()
            .flatten()
            .flat_map(Value::as_str)
            .collect()
    }

    /// Returns the schema that a schema refers to, or the schema itself.
    fn resolve<'a>(&'a self, schema: &'a Value) -> &'a Value {
        let reference = schema["$ref"].as_str();
        let name = reference.and_then(|to| to.rsplit('/').next());
        name.and_then(|name| self.referred.get(name))
            .unwrap_or(schema)
    }

    /// Checks the limits of all numbers and lists in a value.
    fn check(&self, name: &str, schema: &Value, value: &Value) -> Result<(), String> {
        let schema = self.resolve(schema);
        for choice in schema["oneOf"].as_array().into_iter().flatten() {
            self.check(name, choice, value)?;
        }
        match value {
            Value::Number(number) => {
                check_number(name, schema, number.as_f64().unwrap_or(f64::NAN))
            }
            Value::Array(items) => {
                check_length(name, schema, items.len())?;
                (items.iter()).try_for_each(|item| self.check(name, &schema["items"], item))
            }
            Value::Object(fields) => fields.iter().try_for_each(|(field, value)| {
                let dot = if name.is_empty() { "" } else { "." };
                let name = format!("{name}{dot}{field}");
                self.check(&name, &schema["properties"][field], value)
            }),
            Value::Null | Value::Bool(_) | Value::String(_) => Ok(()),
        }
    }
}

fn check_number(name: &str, schema: &Value, value: f64) -> Result<(), String> {
    let limit = |keyword: &str| schema[keyword].as_f64();
    let minimum = limit("minimum").unwrap_or(f64::NEG_INFINITY);
    let maximum = limit("maximum").unwrap_or(f64::INFINITY);
    let rule = if !(minimum..=maximum).contains(&value) {
        match (minimum.is_finite(), maximum.is_finite()) {
            (true, true) => format!("lie in {minimum}..={maximum}"),
            (true, false) => format!("be at least {minimum}"),
            (false, _) => format!("be at most {maximum}"),
        }
    } else if let Some(limit) = limit("exclusiveMinimum").filter(|&limit| value <= limit) {
        format!("be above {limit}")
    } else if let Some(step) = limit("multipleOf").filter(|step| value % step != 0.0) {
        format!("be a multiple of {step}")
    } else {
        return Ok(());
    };
    Err(format!("{name} must {rule}: {value}"))
}

fn check_length(name: &str, schema: &Value, n: usize) -> Result<(), String> {
    match schema["maxItems"].as_u64() {
        Some(max) if n as u64 > max => Err(format!("{name} must have at most {max} entries: {n}")),
        _ => Ok(()),
    }
}
