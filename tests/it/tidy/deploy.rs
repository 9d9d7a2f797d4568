//! Files for operators: settings, commands and metrics in `deploy/` and the Dockerfile exist, and the values of settings
//! are valid.

use std::collections::BTreeMap;

use clap::{Command, CommandFactory};
use flockreel::cli::Cli;
use flockreel_core::code::Code;

use super::reading::{assert_no, files, read, sources};

/// Endings that the format of Prometheus adds to the name of a metric, by its type and unit.
const METRIC_ENDINGS: [&str; 7] = [
    "_total", "_bucket", "_sum", "_count", "_info", "_seconds", "_bytes",
];

/// Returns the words of a text that begin with `start` and consist of the characters of names.
fn words<'a>(text: &'a str, start: &str) -> Vec<&'a str> {
    let is_name = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let words = text.split(|letter| !is_name(letter));
    let mut words: Vec<&str> = words.filter(|word| word.starts_with(start)).collect();
    words.sort_unstable();
    words.dedup();
    words
}

/// Collects the flags of all commands by their environment variables.
fn flags(command: &Command, found: &mut BTreeMap<String, String>) {
    for option in command.get_arguments() {
        if let (Some(variable), Some(flag)) = (option.get_env(), option.get_long()) {
            found.insert(variable.to_string_lossy().into_owned(), flag.to_owned());
        }
    }
    for command in command.get_subcommands() {
        flags(command, found);
    }
}

/// Returns the settings of a text with their values, from lines such as `NAME: value` and `Environment=NAME=value`.
fn settings(text: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for name in words(text, "FLOCKREEL_") {
        for (at, _) in text.match_indices(name) {
            let rest = &text[at + name.len()..];
            let Some(value) = rest.strip_prefix([':', '=']) else {
                continue;
            };
            let value = value.trim_start_matches(' ');
            let value = value.split([' ', '\n']).next().unwrap_or_default();
            found.push((name.to_owned(), value.trim_matches('"').to_owned()));
        }
    }
    found
}

#[test]
fn settings_of_deployments_exist_with_valid_values() {
    let mut known = BTreeMap::new();
    flags(&Cli::command(), &mut known);
    let mut faults = Vec::new();
    let mut n_settings = 0;
    for file in files("deploy").into_iter().chain(["Dockerfile".to_owned()]) {
        let text = read(&file);
        for name in words(&text, "FLOCKREEL_")
            .iter()
            .filter(|name| !known.contains_key(**name))
        {
            faults.push(format!("{file}: no setting has the variable {name}"));
        }
        for (name, value) in settings(&text) {
            n_settings += 1;
            // The file is not on this machine.
            let Some(flag) = known.get(&name).filter(|flag| *flag != "config") else {
                continue;
            };
            let arguments = ["flockreel", "serve", &format!("--{flag}={value}")];
            if let Err(error) = Cli::command().try_get_matches_from(arguments) {
                faults.push(format!("{file}: {name}={value}: {error}"));
            }
        }
    }
    assert!(n_settings >= 10, "{n_settings} settings were found");
    assert_no(faults);
}

#[test]
fn commands_of_deployments_and_their_guides_are_valid() {
    let guides = [
        "run-in-containers",
        "run-under-systemd",
        "watch-with-prometheus",
        "trace-requests",
    ];
    let guides = guides.map(|guide| format!("docs/how-to/{guide}.md"));
    let mut faults = Vec::new();
    let mut n_commands = 0;
    for file in files("deploy").into_iter().chain(guides) {
        for line in read(&file).lines() {
            // The last name of the program in a line begins its arguments, as in `docker exec flockreel flockreel`.
            let Some((_, arguments)) = line.rsplit_once("flockreel ") else {
                continue;
            };
            let line = line.trim_start_matches("ExecStart=");
            let is_command = [
                "flockreel ",
                "/usr/local/bin/flockreel ",
                "sudo -u ",
                "docker exec",
                "docker compose",
                "#   docker",
            ];
            if !is_command.iter().any(|start| line.starts_with(start)) {
                continue;
            }
            let arguments = arguments.split(" # ").next().unwrap_or_default();
            let arguments = arguments
                .split_whitespace()
                .filter(|word| !word.starts_with("2>"));
            n_commands += 1;
            let parsed =
                Cli::command().try_get_matches_from(["flockreel"].into_iter().chain(arguments));
            if let Err(error) = parsed {
                faults.push(format!("{file}: {line}: {error}"));
            }
        }
    }
    assert!(n_commands >= 6, "{n_commands} commands were found");
    assert_no(faults);
}

/// Returns whether the sources register a metric under this name, or under the name without the endings of its type.
fn is_registered(metric: &str, sources: &str) -> bool {
    let shorter = || {
        METRIC_ENDINGS
            .iter()
            .filter_map(|ending| metric.strip_suffix(ending))
    };
    sources.contains(&format!("\"{metric}\"")) || shorter().any(|name| is_registered(name, sources))
}

#[test]
fn metrics_of_alerts_and_their_guide_exist() {
    let sources: String = sources().iter().map(|file| read(file)).collect();
    let mut faults = Vec::new();
    for file in ["deploy/alerts.yml", "docs/how-to/watch-with-prometheus.md"] {
        let metrics = read(file);
        let metrics = words(&metrics, "flockreel_");
        assert!(metrics.len() >= 5, "{file}: {metrics:?}");
        let absent = metrics
            .into_iter()
            .filter(|metric| !is_registered(metric, &sources));
        faults.extend(absent.map(|metric| format!("{file}: there is no metric {metric}")));
    }
    assert_no(faults);
}

#[test]
fn labels_of_alerts_exist_with_their_values() {
    let sources: String = sources().iter().map(|file| read(file)).collect();
    let alerts = read("deploy/alerts.yml");
    let mut faults = Vec::new();
    let mut n_labels = 0;
    for metric in alerts.match_indices("flockreel_") {
        let (_, rest) = alerts.split_at(metric.0);
        let name_end = rest.find(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'));
        let Some(labels) = rest[name_end.unwrap_or(rest.len())..].strip_prefix('{') else {
            continue;
        };
        for label in labels.split('}').next().unwrap_or_default().split(',') {
            n_labels += 1;
            let Some((name, value)) = label.split_once('=') else {
                faults.push(format!("{label}: is no label"));
                continue;
            };
            let (name, value) = (name.trim(), value.trim_matches(['~', '"']));
            if !sources.contains(&format!("    {name}: ")) {
                faults.push(format!("{label}: no metric has this label"));
            }
            for value in value.split('|') {
                let exists = match name {
                    "code" => Code::from_name(value).is_some(),
                    "status" => value
                        .parse::<u16>()
                        .is_ok_and(|status| (200..600).contains(&status)),
                    _ => sources.contains(&format!("\"{value}\"")),
                };
                if !exists {
                    faults.push(format!("{label}: no metric has this value"));
                }
            }
        }
    }
    assert!(n_labels >= 6, "{n_labels} labels were found");
    assert_no(faults);
}

#[test]
fn guides_name_every_alert() {
    let guide = read("docs/how-to/watch-with-prometheus.md");
    let alerts = read("deploy/alerts.yml");
    let names = alerts
        .lines()
        .filter_map(|line| line.trim().strip_prefix("- alert: "));
    let absent = names.filter(|name| !guide.contains(&format!("| `{name}` |")));
    assert_no(
        absent
            .map(|name| format!("docs/how-to/watch-with-prometheus.md: does not name {name}"))
            .collect(),
    );
}
