//! Table of allowed imports, and the reader that finds the imports of a file.

pub(super) const VALUES: &[&str] = &[
    "geometry",
    "raster",
    "random",
    "cpu",
    "progress",
    "code",
    "ids",
    "scratch",
    "order",
    "parameters",
];
pub(super) const MIDDLE: &[&str] = &["library", "footage"];
pub(super) const ALGORITHMS: &[&str] = &["analysis", "flock", "fish"];

/// The import table of ARCHITECTURE.md.
pub(super) fn may_use(file: &str, module: &str, used: &str) -> bool {
    let within = |sets: &[&[&str]]| sets.iter().any(|set| set.contains(&used));
    module == used
        || match module {
            "main" | "lib" => true,
            _ if VALUES.contains(&module) => within(&[VALUES]),
            _ if MIDDLE.contains(&module) => within(&[VALUES, MIDDLE]),
            _ if ALGORITHMS.contains(&module) => within(&[VALUES, MIDDLE]),
            "formats" => within(&[VALUES, MIDDLE, ALGORITHMS]),
            "dataset" => used == "formats" || within(&[VALUES, MIDDLE, ALGORITHMS]),
            "config" | "traces" => false,
            "logging" => used == "traces",
            "media" => ["raster", "footage", "progress", "code", "config"].contains(&used),
            "store" => ["ids", "code", "scratch", "config"].contains(&used),
            "jobs" => !["api", "cli"].contains(&used),
            "api" => used != "cli",
            "cli" => used != "api" || ["cli/serve.rs", "cli/worker.rs"].contains(&file),
            _ => false,
        }
}

/// Returns the modules of this repository that the code names after its crate, by a path or at the top of a
/// group.
pub(super) fn modules_used(code: &str) -> Vec<String> {
    let mut modules = Vec::new();
    for rest in code
        .replace("flockreel_core::", "crate::")
        .split("crate::")
        .skip(1)
    {
        match rest.strip_prefix('{') {
            Some(group) => modules.extend(top_of_group(group)),
            None => modules.push(first_name(rest)),
        }
    }
    // A name with a capital is an item of the crate's root, such as an exported macro.
    modules.retain(|name| name.starts_with(|letter: char| letter.is_ascii_lowercase()));
    modules
}

fn top_of_group(group: &str) -> Vec<String> {
    let mut names = vec![first_name(group)];
    let mut depth = 0;
    for (index, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.push(first_name(&group[index + 1..])),
            _ => {}
        }
    }
    names
}

fn first_name(text: &str) -> String {
    text.trim_start()
        .chars()
        .take_while(|letter| letter.is_alphanumeric() || *letter == '_')
        .collect()
}

#[test]
fn imports_are_found_in_paths_and_in_groups() {
    let code =
        "use flockreel_core::{geometry::{Rect, Camera}, order};\nlet job = crate::jobs::Job;\n";
    assert_eq!(modules_used(code), ["geometry", "order", "jobs"]);
}

#[test]
fn forbidden_imports_are_refused() {
    assert!(may_use("analysis/pose.rs", "analysis", "library"));
    assert!(!may_use("analysis/pose.rs", "analysis", "flock"));
    assert!(!may_use("raster/frame.rs", "raster", "library"));
    assert!(!may_use("media/decode.rs", "media", "store"));
    assert!(may_use("cli/serve.rs", "cli", "api"));
    assert!(!may_use("cli/flock.rs", "cli", "api"));
}
