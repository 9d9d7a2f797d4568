//! Program text that `make guards` and `make ablation` replace: each entry of their tables occurs exactly once in its file.

use std::collections::HashMap;

use super::reading::{assert_no, read};

/// Returns a fault for each entry whose `old` text does not occur exactly once in its `file`.
fn misplaced<'a>(entries: impl Iterator<Item = (&'a str, &'a toml::Value)>) -> Vec<String> {
    let mut texts: HashMap<String, String> = HashMap::new();
    let mut faults = Vec::new();
    for (name, entry) in entries {
        let [file, old] = ["file", "old"].map(|key| entry[key].as_str().unwrap());
        let text = texts.entry(file.to_owned()).or_insert_with(|| read(file));
        let n = text.matches(old).count();
        if n != 1 {
            faults.push(format!("{name}: occurs {n} times in {file}: {old}"));
        }
    }
    faults
}

fn name(entry: &toml::Value) -> &str {
    entry["name"].as_str().unwrap_or_default()
}

#[test]
fn text_of_every_guard_occurs_once() {
    let table: toml::Table = read("tests/guards/guards.toml").parse().unwrap();
    let guards = table["guard"].as_array().unwrap().iter();
    let edits = guards.flat_map(|guard| {
        let edits = guard.get("edit").and_then(toml::Value::as_array);
        edits.into_iter().flatten().map(|edit| (name(guard), edit))
    });
    assert_no(misplaced(edits));
}

#[test]
fn text_of_every_rule_of_the_ablation_occurs_once() {
    let table: toml::Table = read("bench/ablation.toml").parse().unwrap();
    let rules = table["rule"].as_array().unwrap().iter();
    assert_no(misplaced(rules.map(|rule| (name(rule), rule))));
}
