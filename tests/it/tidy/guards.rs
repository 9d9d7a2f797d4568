//! The guards that `make guards` takes out stand where its table says: a change of their text changes the table too.

use std::collections::HashMap;

use super::reading::{assert_no, read};

#[test]
fn every_guard_stands_once_where_the_table_says() {
    let table: toml::Table = read("tests/guards/guards.toml").parse().unwrap();
    let mut texts: HashMap<String, String> = HashMap::new();
    let mut faults = Vec::new();
    for guard in table["guard"].as_array().unwrap() {
        let edits = guard.get("edit").and_then(toml::Value::as_array);
        for edit in edits.into_iter().flatten() {
            let [file, old] = ["file", "old"].map(|key| edit[key].as_str().unwrap());
            let text = texts.entry(file.to_owned()).or_insert_with(|| read(file));
            let n = text.matches(old).count();
            if n != 1 {
                faults.push(format!(
                    "{}: stands {n} times in {file}: {old}",
                    guard["name"].as_str().unwrap_or_default()
                ));
            }
        }
    }
    assert_no(faults);
}
