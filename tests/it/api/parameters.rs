//! Parameters in the OpenAPI document: their defaults, limits and presets, and that the check agrees with them.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use flockreel_core::formats::params::{Error, read};
use flockreel_core::parameters::Parameters;
use flockreel_core::{analysis, fish, flock};

use crate::common::TestApp;

/// A schema of parameters, and the reader of these parameters.
type Noun = (&'static str, fn(Map<String, Value>) -> Result<(), Error>);

const NOUNS: [Noun; 3] = [
    ("AnalysisParams", |json| {
        read::<analysis::Params>(json).map(drop)
    }),
    ("FlockParams", |json| read::<flock::Params>(json).map(drop)),
    ("FishParams", |json| read::<fish::Params>(json).map(drop)),
];

/// Keywords that the schema of a parameter may have. `Parameters::check` or the type of the field enforces each.
const KEYWORDS: [&str; 18] = [
    "$ref",
    "additionalProperties",
    "default",
    "description",
    "enum",
    "exclusiveMinimum",
    "format",
    "items",
    "maxItems",
    "maximum",
    "minItems",
    "minimum",
    "multipleOf",
    "oneOf",
    "pattern",
    "properties",
    "required",
    "type",
];

/// The schemas of the OpenAPI document.
struct Schemas(Value);

/// A field of an object in the document.
struct Field<'a> {
    name: String,
    schema: &'a Value,
    is_required: bool,
}

/// A value, and the name of the parameter that is tried in it.
type Trial = (String, Value);

/// Values to try in place of a parameter with this schema.
type Choose<'a> = &'a dyn Fn(&Value) -> Vec<Value>;

impl Schemas {
    async fn new() -> Schemas {
        let app = TestApp::idle().await;
        let document = app.json("/openapi.json").await;
        app.assert_sound().await;
        Schemas(document["components"]["schemas"].clone())
    }

    /// Returns the schema that a schema refers to, or the schema itself.
    fn resolve<'a>(&'a self, schema: &'a Value) -> &'a Value {
        let reference = schema["$ref"].as_str();
        let name = reference.and_then(|to| to.rsplit('/').next());
        name.map_or(schema, |name| &self.0[name])
    }

    /// Returns the schemas of which a value must fulfil one; null is not among them.
    fn choices<'a>(&'a self, schema: &'a Value) -> Vec<&'a Value> {
        let schema = self.resolve(schema);
        match schema["oneOf"].as_array() {
            Some(choices) => (choices.iter().filter(|choice| choice["type"] != "null"))
                .map(|choice| self.resolve(choice))
                .collect(),
            None => vec![schema],
        }
    }

    /// Returns the fields of all objects that a schema allows, and of the objects in them.
    fn fields<'a>(&'a self, name: &str, schema: &'a Value) -> Vec<Field<'a>> {
        let mut fields = Vec::new();
        for object in self.choices(schema) {
            let required = object["required"].as_array();
            for (field, schema) in object["properties"].as_object().into_iter().flatten() {
                let name = format!("{name}.{field}");
                fields.extend(self.fields(&name, schema));
                fields.push(Field {
                    name,
                    schema,
                    is_required: required.is_some_and(|all| all.contains(&json!(field))),
                });
            }
            fields.extend(
                object
                    .get("items")
                    .map_or(Vec::new(), |items| self.fields(name, items)),
            );
        }
        fields
    }

    /// Returns a valid value.
    fn sample(&self, schema: &Value) -> Value {
        let schema = self.choices(schema)[0];
        if has_type(schema, "object") {
            let required = schema["required"].as_array().into_iter().flatten();
            let names = required.map(|name| name.as_str().unwrap());
            let fields = names.map(|name| (name.into(), self.sample(&schema["properties"][name])));
            Value::Object(fields.collect())
        } else if has_type(schema, "array") {
            self.list(schema, schema["minItems"].as_u64().unwrap_or(1))
        } else {
            let number = schema["minimum"].as_f64().unwrap_or(1.0).max(1.0);
            if has_type(schema, "integer") {
                json!(number as u64)
            } else {
                json!(number)
            }
        }
    }

    /// Returns a list of valid values. Those with a time are in order of time.
    fn list(&self, schema: &Value, n: u64) -> Value {
        let entries = (0..n).map(|index| {
            let mut entry = self.sample(&schema["items"]);
            if let Some(time_s) = entry.get_mut("time_s") {
                *time_s = json!(index);
            }
            entry
        });
        entries.collect()
    }

    /// Returns values in which one parameter after the other has each of the values to try.
    fn trials(&self, name: &str, schema: &Value, choose: Choose) -> Vec<Trial> {
        let mut trials = Vec::new();
        for schema in self.choices(schema) {
            let properties = schema["properties"].as_object().into_iter().flatten();
            for (field, inner) in properties {
                for (name, value) in self.trials(&format!("{name}.{field}"), inner, choose) {
                    let mut object = self.sample(schema);
                    object[field] = value;
                    trials.push((name, object));
                }
            }
            if has_type(schema, "array") {
                for (name, value) in self.trials(name, &schema["items"], choose) {
                    let mut list = self.sample(schema);
                    list[0] = value;
                    trials.push((name, list));
                }
            }
            let values = choose(schema).into_iter();
            trials.extend(values.map(|value| (name.to_owned(), value)));
        }
        trials
    }

    /// Returns the error for each trial of the parameters of a noun; `None` if they are accepted.
    fn outcomes(&self, (noun, read): Noun, choose: Choose) -> Vec<(Trial, Option<String>)> {
        let trials = self.trials(noun, &self.0[noun], choose).into_iter();
        let outcome = |(name, mut json): Trial| {
            // The most frames need few individuals.
            if json.get("frames").is_some() {
                json["count"] = json!(1);
            }
            let overrides = json.as_object().unwrap().clone();
            let error = read(overrides).err().map(|error| error.to_string());
            ((name, json), error)
        };
        trials.map(outcome).collect()
    }
}

fn has_type(schema: &Value, wanted: &str) -> bool {
    let types = &schema["type"];
    types == wanted
        || types
            .as_array()
            .is_some_and(|all| all.contains(&json!(wanted)))
}

/// Returns what the schema of a value lacks or has too much.
fn fault(schema: &Value) -> Option<String> {
    let has = |keyword: &str| schema.get(keyword).is_some();
    let is_number = has_type(schema, "number") || has_type(schema, "integer");
    let mut keywords = schema.as_object().unwrap().keys();
    if let Some(unknown) = keywords.find(|key| !KEYWORDS.contains(&key.as_str())) {
        Some(format!("the keyword {unknown}, which nothing enforces"))
    } else if is_number && !has("minimum") && !has("exclusiveMinimum") {
        Some("no limits".to_owned())
    } else if has_type(schema, "string") && !has("enum") && !has("pattern") {
        Some("no list of names and no pattern".to_owned())
    } else {
        None
    }
}

#[tokio::test]
async fn every_parameter_has_its_default_and_limits_in_the_document() {
    let schemas = Schemas::new().await;
    let fields = NOUNS.map(|(noun, _)| schemas.fields(noun, &schemas.0[noun]));
    let fields: Vec<Field> = fields.into_iter().flatten().collect();
    assert!(fields.len() > 80, "only {} parameters", fields.len());
    let mut faults = BTreeSet::new();
    for Field {
        name,
        schema,
        is_required,
    } in fields
    {
        if schema.get("default").is_none() && !is_required {
            faults.insert(format!("{name} has no default"));
        }
        for schema in schemas.choices(schema) {
            // The coordinates of a point may be any numbers.
            let items = schema
                .get("items")
                .filter(|items| items["type"] != "number");
            let items = items.into_iter().flat_map(|items| schemas.choices(items));
            let found = items.chain([schema]).filter_map(fault);
            faults.extend(found.map(|fault| format!("{name} has {fault}")));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[tokio::test]
async fn values_at_the_limits_of_the_document_are_accepted() {
    let schemas = Schemas::new().await;
    let at_limits = |schema: &Value| {
        let mut values: Vec<Value> = ["minimum", "maximum"]
            .iter()
            .filter_map(|limit| schema.get(*limit).cloned())
            .collect();
        let above = schema["exclusiveMinimum"].as_f64();
        values.extend(above.map(|limit| json!(limit + 1e-9)));
        let n_items = schema["maxItems"].as_u64();
        values.extend(n_items.map(|n| schemas.list(schema, n)));
        values
    };
    for noun in NOUNS {
        let outcomes = schemas.outcomes(noun, &at_limits);
        assert!(outcomes.len() > 5, "{} {}", noun.0, outcomes.len());
        for ((name, json), error) in outcomes {
            assert_eq!(error, None, "{name}: {json}");
        }
    }
}

#[tokio::test]
async fn values_beyond_the_limits_of_the_document_are_refused() {
    let schemas = Schemas::new().await;
    let beyond = |schema: &Value| {
        let is_integer = has_type(schema, "integer");
        let moved = |limit: f64, up: bool| match (is_integer, up) {
            (true, true) => json!(limit as i64 + 1),
            (true, false) => json!(limit as i64 - 1),
            (false, true) => json!(limit.next_up()),
            (false, false) => json!(limit.next_down()),
        };
        let limit = |keyword: &str| schema[keyword].as_f64();
        let n_items = schema["maxItems"].as_u64();
        let values = [
            limit("minimum").map(|limit| moved(limit, false)),
            limit("maximum").map(|limit| moved(limit, true)),
            limit("exclusiveMinimum").map(|limit| json!(limit)),
            limit("multipleOf").map(|step| json!(step as u64 + 1)),
            n_items.map(|n| schemas.list(schema, n + 1)),
        ];
        values.into_iter().flatten().collect()
    };
    for noun in NOUNS {
        let outcomes = schemas.outcomes(noun, &beyond);
        assert!(outcomes.len() > 5, "{} {}", noun.0, outcomes.len());
        for ((name, json), error) in outcomes {
            let field = name.rsplit('.').next().unwrap();
            let error = error.unwrap_or_else(|| panic!("{name} was accepted: {json}"));
            assert!(
                error.contains(field) || error.contains("invalid"),
                "{name}: {error}"
            );
        }
    }
}

#[tokio::test]
async fn presets_in_the_document_are_those_that_requests_may_name() {
    let schemas = Schemas::new().await;
    let flock_presets = flock::Params::PRESETS;
    assert!(flock_presets.contains(&"zonal"), "{flock_presets:?}");
    for ((_, read), name, presets) in [
        (NOUNS[0], "AnalysisOverrides", analysis::Params::PRESETS),
        (NOUNS[1], "FlockOverrides", flock_presets),
        (NOUNS[1], "FlockRequest", flock_presets),
        (NOUNS[2], "FishRequest", fish::Params::PRESETS),
    ] {
        let presets: Vec<Value> = presets
            .iter()
            .map(|&name| json!(name))
            .chain([Value::Null])
            .collect();
        assert_eq!(
            schemas.0[name]["properties"]["preset"]["enum"],
            json!(presets)
        );
        for preset in presets {
            let overrides = Map::from_iter([("preset".to_owned(), preset.clone())]);
            assert_eq!(read(overrides), Ok(()), "{name} {preset}");
        }
    }
}
