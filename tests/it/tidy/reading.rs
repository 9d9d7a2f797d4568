//! Reading our own files: which there are, and what in them is program text.

use std::fs;
use std::path::{Path, PathBuf};

/// The program text of a file: no comments, and no unit tests, which may reach further.
pub(super) fn code_of(file: &str) -> String {
    if file.ends_with("/tests.rs") || file.contains("/tests/") {
        return String::new();
    }
    let text = read(file);
    let program = text
        .split("#[cfg(test)]\nmod tests")
        .next()
        .unwrap_or_default();
    program
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// True where the text occurs and is not the end of a longer name, as `image::` is of `my_image::`.
pub(super) fn stands_alone(code: &str, needle: &str) -> bool {
    let is_our_own =
        needle.ends_with("::") && code.contains(&format!("mod {};", &needle[..needle.len() - 2]));
    !is_our_own
        && code.match_indices(needle).any(|(index, _)| {
            let before = code[..index].chars().next_back().unwrap_or(' ');
            needle.starts_with('.') || !(before.is_alphanumeric() || before == '_' || before == ':')
        })
}

/// True where one of the names in the code is the word or has it as a part between underscores.
pub(super) fn has_word(code: &str, word: &str) -> bool {
    let is_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    code.split(|letter| !is_name(letter))
        .any(|name| format!("_{name}_").contains(&format!("_{word}_")))
}

pub(super) fn assert_no(faults: Vec<String>) {
    assert!(faults.is_empty(), "\n{}\n", faults.join("\n"));
}

/// The source folders of the packages.
pub(super) const SOURCES: [&str; 2] = ["crates/flockreel-core/src", "src"];

/// Returns the source files of all packages, in order.
pub(super) fn sources() -> Vec<String> {
    let all = SOURCES.iter().flat_map(|folder| files(folder));
    all.filter(|file| file.ends_with(".rs")).collect()
}

/// Returns the path of a source file below the `src` of its package, such as `media/gate.rs`.
pub(super) fn within_package(file: &str) -> &str {
    let parts = SOURCES.iter().find_map(|folder| file.strip_prefix(folder));
    parts.map_or(file, |rest| rest.trim_start_matches('/'))
}

/// Every text file of ours below a folder, in order, as a path from the root of the repository.
pub(super) fn files(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    for folder in folders(Path::new(folder)) {
        for entry in fs::read_dir(&folder).expect("a folder of ours").flatten() {
            let path = entry.path();
            if path.is_file() && fs::read_to_string(&path).is_ok() {
                let path = path.strip_prefix(".").unwrap_or(&path);
                found.push(path.to_str().expect("our names are plain").to_owned());
            }
        }
    }
    found.sort();
    found
}

/// A folder and all below it that are ours: not what was built, fetched or made by running.
pub(super) fn folders(top: &Path) -> Vec<PathBuf> {
    let mut found = vec![top.to_owned()];
    let mut next = 0;
    while let Some(folder) = found.get(next).cloned() {
        next += 1;
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let is_ours = !["target", ".git", "data", "node_modules", "__pycache__"]
                .iter()
                .any(|other| name == *other);
            if is_ours && entry.path().is_dir() {
                found.push(entry.path());
            }
        }
    }
    found
}

pub(super) fn read(file: &str) -> String {
    fs::read_to_string(file).unwrap_or_else(|error| panic!("{file}: {error}"))
}
