//! Documents that sources and documents cite: each file and each heading exists.

use std::path::Path;

use super::reading::{assert_no, files, read};

/// Documents of the plan that the repository does not hold.
const ELSEWHERE: [&str; 5] = ["ALGORITHMS", "RELIABILITY", "DESIGN", "STUDIO", "ECOSYSTEM"];

/// A document with the heading that is cited, as in `docs/explanation/algorithms.md, "Mattes"`.
struct Citation {
    document: String,
    heading: Option<String>,
}

/// A text with the comment signs at the beginnings of its lines taken away and its lines joined.
fn joined(text: &str) -> String {
    let lines = text
        .lines()
        .map(|line| line.trim().trim_start_matches(['/', '!', '#', '-']).trim());
    lines.collect::<Vec<_>>().join(" ")
}

/// The citations of documents below `docs/`.
fn citations(text: &str) -> Vec<Citation> {
    let text = joined(text);
    let is_path = |letter: char| letter.is_ascii_alphanumeric() || "/-_.".contains(letter);
    text.match_indices("docs/")
        .filter_map(|(at, _)| {
            let end = text[at..].find(|letter| !is_path(letter));
            let (document, rest) = text[at..].split_at(end.unwrap_or(text.len() - at));
            let document = document.strip_suffix('.').unwrap_or(document);
            let quoted = rest.strip_prefix(", \"");
            document.ends_with(".md").then(|| Citation {
                document: document.to_owned(),
                heading: quoted.and_then(|rest| Some(rest.split_once('"')?.0.to_owned())),
            })
        })
        .collect()
}

fn has_heading(document: &str, heading: &str) -> bool {
    read(document).lines().any(|line| {
        let title = line.trim_start_matches('#');
        title.len() < line.len() && title.trim().trim_matches('`') == heading
    })
}

#[test]
fn cited_documents_and_headings_exist() {
    let mut faults = Vec::new();
    let folders = [
        "src", "crates", "tests", "benches", "bench", "docs", "deploy", "scripts", "static",
    ];
    let pages = [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "Makefile",
        "SECURITY.md",
        "Dockerfile",
    ];
    let below = folders.iter().flat_map(|folder| files(folder));
    for file in below.chain(pages.map(str::to_owned)) {
        if file == "tests/it/tidy/citations.rs" {
            continue;
        }
        let text = read(&file);
        for Citation { document, heading } in citations(&text) {
            if !Path::new(&document).is_file() {
                faults.push(format!("{file}: there is no {document}"));
            } else if let Some(heading) = heading.filter(|title| !has_heading(&document, title)) {
                faults.push(format!("{file}: {document} has no heading {heading:?}"));
            }
        }
        for name in ELSEWHERE {
            if text.contains(&format!("{name}.md")) {
                faults.push(format!("{file}: {name}.md is not in the repository"));
            }
        }
    }
    assert_no(faults);
}

#[test]
fn citation_goes_on_in_the_next_line_of_a_comment() {
    let found = citations("//! (docs/a/b.md, \"Two\n//! words\"; docs/c.md).");
    let first = &found[0];
    assert_eq!(first.document, "docs/a/b.md");
    assert_eq!(first.heading.as_deref(), Some("Two words"));
    assert_eq!(found[1].document, "docs/c.md");
    assert_eq!(found.len(), 2);
}
