//! Files of one folder do not use each other in a circle, so each can be understood and moved by itself.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::reading::{SOURCES, assert_no, code_of, folders, within_package};

/// Returns, for each module of a folder, the modules beside it that its program text names.
fn uses(folder: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let files: Vec<(String, String)> = std::fs::read_dir(folder)
        .expect("a folder of ours")
        .flatten()
        .filter_map(|entry| {
            let path = entry.path();
            let stem = path.file_stem()?.to_str()?.to_owned();
            let is_module = path.extension()? == "rs" && stem != "mod" && stem != "tests";
            is_module.then(|| (stem, code_of(path.to_str().expect("our names are plain"))))
        })
        .collect();
    let folder = within_package(folder.to_str().expect("our names are plain"));
    let whole = format!("crate::{}::", folder.replace('/', "::"));
    let named = |code: &str, other: &str| {
        let after = |prefix: &str| {
            code.match_indices(&format!("{prefix}{other}"))
                .any(|(at, found)| {
                    let next = code[at + found.len()..].chars().next().unwrap_or(' ');
                    !(next.is_alphanumeric() || next == '_')
                })
        };
        after("super::") || after(&whole)
    };
    files
        .iter()
        .map(|(name, code)| {
            let others = files.iter().map(|(other, _)| other);
            let used = others.filter(|other| *other != name && named(code, other));
            (name.clone(), used.cloned().collect())
        })
        .collect()
}

/// Returns the modules that can be reached from one.
fn reached(uses: &BTreeMap<String, BTreeSet<String>>, from: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut next = vec![from.to_owned()];
    while let Some(name) = next.pop() {
        for other in &uses[&name] {
            if found.insert(other.clone()) {
                next.push(other.clone());
            }
        }
    }
    found
}

#[test]
fn files_of_a_folder_use_each_other_in_one_direction() {
    let mut faults = BTreeSet::new();
    for folder in SOURCES.iter().flat_map(|top| folders(Path::new(top))) {
        let uses = uses(&folder);
        let circle_of = |name: &String| -> Vec<String> {
            let all = uses.keys();
            all.filter(|&other| {
                reached(&uses, name).contains(other) && reached(&uses, other).contains(name)
            })
            .cloned()
            .collect()
        };
        for circle in uses.keys().map(circle_of).filter(|circle| circle.len() > 1) {
            faults.insert(format!("{}: {}", folder.display(), circle.join(", ")));
        }
    }
    assert_no(faults.into_iter().collect());
}
