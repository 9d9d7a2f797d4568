//! The rules of the house as tests: who may import whom, why every file exists, how large a thing may
//! grow, which words have another word here, what the page may hold. Where a rule fails, its message
//! names the file and the rule; the rule itself is argued in CONTRIBUTING.md and ARCHITECTURE.md.

mod citations;
mod cycles;
mod deploy;
mod guards;
mod imports;
mod reading;

use std::fs;
use std::path::Path;

use imports::{ALGORITHMS, MIDDLE, VALUES, may_use, modules_used};
use reading::{
    SOURCES, assert_no, code_of, files, folders, has_word, read, sources, stands_alone,
    within_package,
};

/// Files that may start processes: media tools in their sandbox, and attempts at jobs, which compute apart from the
/// service.
const STARTERS: [&str; 2] = ["src/media/gate/mod.rs", "src/jobs/attempt/process.rs"];

#[test]
fn modules_import_only_their_ring_and_those_above() {
    let mut faults = Vec::new();
    for file in sources() {
        let name = within_package(&file);
        let module = name.split(['/', '.']).next().unwrap_or_default();
        for used in modules_used(&code_of(&file)) {
            if !may_use(name, module, &used) {
                faults.push(format!("{file}: `{module}` may not use `crate::{used}`"));
            }
        }
    }
    assert_no(faults);
}

#[test]
fn only_the_intended_modules_reach_the_outside_world() {
    let algorithms: Vec<&str> = [VALUES, MIDDLE, ALGORITHMS].concat();
    // Forbidden texts, and the modules that may not contain them. Cargo keeps axum, sqlx and tokio out of
    // the algorithms.
    let rules: Vec<(&[&str], Vec<&str>)> = vec![
        (
            &["axum::", "tower_http::", "hyper::"],
            vec!["config", "media", "store", "jobs"],
        ),
        (&["sqlx::"], vec!["config", "media", "jobs", "api", "cli"]),
        (&["tokio::", ".await", "async fn"], vec!["config", "media"]),
        (
            &["std::fs", "std::net", "std::env", "std::process"],
            algorithms.clone(),
        ),
        (
            &["tracing::", "image::", "png::", "SystemTime", "println!"],
            algorithms.clone(),
        ),
    ];
    let mut faults = Vec::new();
    for file in sources() {
        let module = within_package(&file)
            .split(['/', '.'])
            .next()
            .unwrap_or_default()
            .to_owned();
        let code = code_of(&file);
        for (needles, modules) in &rules {
            for needle in needles.iter().filter(|needle| stands_alone(&code, needle)) {
                if modules.contains(&module.as_str()) {
                    faults.push(format!("{file}: `{needle}` has no place in `{module}`"));
                }
            }
        }
        if code.contains("Command::new(") && !STARTERS.contains(&file.as_str()) {
            faults.push(format!(
                "{file}: only media/gate and jobs/attempt/process.rs may start processes"
            ));
        }
        let is_folder = file.starts_with("crates/flockreel-core/src/formats/library_dir/");
        if module == "formats" && code.contains("std::fs") && !is_folder {
            faults.push(format!("{file}: only library_dir may use files in formats"));
        }
    }
    assert_no(faults);
}

#[test]
fn source_files_begin_with_their_purpose() {
    let mut faults = Vec::new();
    for file in sources() {
        let text = read(&file);
        let header: Vec<&str> = text
            .lines()
            .take_while(|line| line.starts_with("//!"))
            .collect();
        let n_words: usize = header
            .iter()
            .map(|line| line.split_whitespace().count() - 1)
            .sum();
        if !(1..=15).contains(&header.len())
            || n_words < 5
            || header.concat().contains("To be written")
        {
            faults.push(format!(
                "{file}: begins with {} lines of `//!`, wants 1 to 15 that say why",
                header.len()
            ));
        }
    }
    assert_no(faults);
}

#[test]
fn files_and_folders_keep_their_sizes() {
    let mut faults = Vec::new();
    for (folder, extension, limit) in [
        ("crates", "rs", 400),
        ("src", "rs", 400),
        ("tests", "rs", 400),
        ("tests", "py", 400),
        ("static", "css", 300),
        ("static/js", "js", 150),
    ] {
        for file in files(folder)
            .iter()
            .filter(|file| file.ends_with(&format!(".{extension}")))
        {
            let n_lines = read(file).lines().count();
            if n_lines > limit {
                faults.push(format!("{file}: {n_lines} lines, limit {limit}"));
            }
        }
    }
    for (top, folder) in SOURCES.iter().flat_map(|top| {
        let below = folders(Path::new(top)).into_iter();
        below.map(move |folder| (Path::new(top), folder))
    }) {
        let n_entries = fs::read_dir(&folder).expect("a folder of ours").count();
        if folder != top && n_entries > 20 {
            faults.push(format!(
                "{}: {n_entries} entries, limit 20",
                folder.display()
            ));
        }
        if folder.components().count() > top.components().count() + 3 {
            faults.push(format!(
                "{}: more than three deep below src",
                folder.display()
            ));
        }
    }
    assert_no(faults);
}

#[test]
fn source_has_no_forbidden_names() {
    let not_a_name = [
        "utils", "util", "helpers", "helper", "common", "misc", "types", "manager",
    ];
    let elsewhere = [
        "succeeded",
        "theta",
        "cutout",
        "retry_count",
        "work_item",
        "center_of_mass",
        "reaper",
    ];
    let british = [
        "centre",
        "colour",
        "neighbour",
        "analyse",
        "normalise",
        "optimise",
        "behaviour",
        "grey",
    ];
    let mut faults = Vec::new();
    for file in sources() {
        let path = Path::new(&file);
        let stem = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .unwrap_or_default();
        if not_a_name.contains(&stem)
            || path
                .iter()
                .any(|part| not_a_name.iter().any(|word| part == *word))
        {
            faults.push(format!("{file}: the name says nothing about the content"));
        }
        let code = code_of(&file).to_lowercase();
        for word in elsewhere
            .iter()
            .chain(&british)
            .filter(|word| has_word(&code, word))
        {
            faults.push(format!(
                "{file}: `{word}` has another word here (CONTRIBUTING.md, Names)"
            ));
        }
    }
    assert_no(faults);
}

#[test]
fn comments_about_later_work_name_an_issue() {
    let mut faults = Vec::new();
    for file in sources()
        .iter()
        .chain(&files("tests"))
        .chain(&files("static"))
    {
        for (index, line) in read(file).lines().enumerate() {
            if line.contains(&["TO", "DO"].concat()) && !line.contains('#') {
                faults.push(format!(
                    "{file}:{}: a comment about later work names no issue",
                    index + 1
                ));
            }
        }
    }
    assert_no(faults);
}

#[test]
fn package_registries_are_not_named() {
    let hosts: Vec<String> = [
        ["registry.npmjs", "org"],
        ["pypi", "org"],
        ["pythonhosted", "org"],
        ["crates", "io"],
    ]
    .iter()
    .map(|parts| parts.join("."))
    .collect();
    let mut faults = Vec::new();
    for file in files(".") {
        // Cargo names its default index so in every lock; it is no address that is fetched from.
        let text = read(&file).replace(&format!("{}-index", hosts[3]), "");
        for host in hosts.iter().filter(|host| text.contains(host.as_str())) {
            faults.push(format!("{file}: names {host}"));
        }
    }
    assert_no(faults);
}

#[test]
fn page_keeps_its_content_security_policy() {
    let mut faults = Vec::new();
    let page = read("static/index.html");
    for forbidden in [
        " style=",
        "<style",
        "<script>",
        " onclick=",
        " onload=",
        "javascript:",
    ] {
        if page.contains(forbidden) {
            faults.push(format!(
                "static/index.html: `{forbidden}` is refused by the policy"
            ));
        }
    }
    for file in files("static") {
        let text = read(&file).replace("http://www.w3.org/", "");
        for forbidden in ["http://", "https://", "innerHTML", "eval("] {
            if text.contains(forbidden) {
                faults.push(format!("{file}: `{forbidden}` has no place in the page"));
            }
        }
    }
    assert_no(faults);
}

#[test]
fn settings_page_names_every_setting() {
    let page = read("docs/reference/settings.md");
    let config = read("src/config.rs");
    let faults = (config.split("env = \"").skip(1))
        .filter_map(|rest| rest.split('"').next())
        .filter(|variable| !page.contains(&format!("`{variable}`")))
        .map(|variable| format!("docs/reference/settings.md: does not name {variable}"));
    assert_no(faults.collect());
}

#[test]
fn error_codes_are_raised() {
    let sources: Vec<String> = (sources().iter())
        .filter(|file| {
            !["crates/flockreel-core/src/code.rs", "src/api/problem.rs"].contains(&file.as_str())
        })
        .map(|file| code_of(file))
        .collect();
    let faults = (flockreel_core::code::Code::ALL.iter())
        .filter(|code| {
            !sources
                .iter()
                .any(|source| source.contains(&format!("Code::{code:?}")))
        })
        .map(|code| format!("crates/flockreel-core/src/code.rs: nothing raises {code}"));
    assert_no(faults.collect());
}
