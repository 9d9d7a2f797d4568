//! Settings from a TOML file. Flags override environment variables, which override the file of `--config`,
//! which overrides the defaults.
//!
//! A setting is any option that has an environment variable, so there is only one definition of settings. The
//! file replaces the defaults of the options, so `--help` shows the values in effect.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

use clap::{ArgAction, Command, CommandFactory, FromArgMatches, ValueEnum};
use toml::{Table, Value};

use super::{Cli, Error};
use crate::logging::{self, LogFormat};

/// Environment variable with the path of the file.
const VARIABLE: &str = "FLOCKREEL_CONFIG";
/// Id of the option for the file itself, which a file cannot set.
const CONFIG: &str = "config";

/// Values by option id.
pub type Settings = BTreeMap<String, String>;

/// Parses the arguments, with defaults from the settings file if there is one. Fails if the file is invalid.
/// If the arguments are invalid or ask for help, clap prints a message and ends the process. If log lines are
/// JSON, invalid arguments are an error instead.
pub fn parse(arguments: &[OsString]) -> Result<Cli, Error> {
    let file = last_value(arguments, "--config").or_else(|| std::env::var_os(VARIABLE));
    let settings = file.map(|file| read(Path::new(&file))).transpose();
    logging::set_format(log_format(
        arguments,
        settings.as_ref().ok().and_then(Option::as_ref),
    ));
    let command = match settings? {
        Some(settings) => with_defaults(Cli::command(), &settings),
        None => Cli::command(),
    };
    let parsed = command.try_get_matches_from(arguments);
    let parsed = parsed.and_then(|matches| Cli::from_arg_matches(&matches));
    parsed.map_err(|error| {
        if !error.use_stderr() || !logging::is_json() {
            error.exit();
        }
        Error::Usage(first_line(&error))
    })
}

/// Returns the format of log lines that arguments, environment and settings ask for, before they are checked.
fn log_format(arguments: &[OsString], settings: Option<&Settings>) -> LogFormat {
    let of_file = || settings?.get("log_format").map(OsString::from);
    let name = last_value(arguments, "--log-format")
        .or_else(|| std::env::var_os("FLOCKREEL_LOG_FORMAT"))
        .or_else(of_file);
    let name = name.unwrap_or_default();
    LogFormat::from_str(&name.to_string_lossy(), false).unwrap_or(LogFormat::Text)
}

/// Returns the value of the last `FLAG VALUE` or `FLAG=VALUE`.
fn last_value(arguments: &[OsString], flag: &str) -> Option<OsString> {
    let words = arguments.iter().enumerate();
    let words = words.take_while(|(_, word)| *word != "--");
    let values = words.filter_map(|(idx, word)| match word.to_str()?.strip_prefix(flag)? {
        "" => arguments.get(idx + 1).cloned(),
        rest => rest.strip_prefix('=').map(OsString::from),
    });
    values.last()
}

/// Reads the file. Fails if it is not TOML, or has an unknown setting or an invalid value.
fn read(file: &Path) -> Result<Settings, Error> {
    let invalid = |what: &str| Error::Usage(format!("{what}: {}", file.display()));
    let text = std::fs::read_to_string(file);
    let text = text.map_err(|error| invalid(&format!("the settings cannot be read: {error}")))?;
    settings_of_text(&text).map_err(|why| invalid(&why))
}

/// Returns the settings in the text of a file, by the ids of their options. Fails with the reason.
pub fn settings_of_text(text: &str) -> Result<Settings, String> {
    let table: Table = (text.parse()).map_err(|error: toml::de::Error| {
        let line = text[..error.span().map_or(0, |span| span.start)]
            .matches('\n')
            .count()
            + 1;
        format!("line {line} is not valid TOML: {}", error.message())
    })?;
    let known = settings_of(&Cli::command());
    let mut settings = Settings::new();
    for (key, value) in table {
        let id = key.replace('-', "_");
        let Some((flag, is_switch)) = known.get(&id) else {
            return Err(format!("the setting {key} is unknown, in"));
        };
        let text = to_text(&value, *is_switch);
        let text = text.ok_or_else(|| format!("the value of {key} has the wrong type, in"))?;
        check(flag, &text, *is_switch).map_err(|why| format!("{key}: {why}, in"))?;
        settings.insert(id, text);
    }
    Ok(settings)
}

/// Returns all options that have an environment variable, by id: the flag, and whether it takes no value.
fn settings_of(command: &Command) -> BTreeMap<String, (String, bool)> {
    let mut known = BTreeMap::new();
    for command in command.get_subcommands() {
        known.extend(settings_of(command));
    }
    for option in command.get_arguments() {
        let id = option.get_id().as_str();
        if let (Some(_), Some(flag)) = (option.get_env(), option.get_long())
            && id != CONFIG
        {
            let is_switch = matches!(option.get_action(), ArgAction::SetTrue);
            known.insert(id.to_owned(), (flag.to_owned(), is_switch));
        }
    }
    known
}

fn to_text(value: &Value, is_switch: bool) -> Option<String> {
    match value {
        Value::Boolean(on) => is_switch.then(|| on.to_string()),
        Value::String(text) if !is_switch => Some(text.clone()),
        Value::Integer(number) if !is_switch => Some(number.to_string()),
        _ => None,
    }
}

/// Checks that `serve` accepts the value as a flag. Fails with the reason in one line.
fn check(flag: &str, text: &str, is_switch: bool) -> Result<(), String> {
    let given = match (is_switch, text) {
        (false, _) => vec![format!("--{flag}={text}")],
        (true, "true") => vec![format!("--{flag}")],
        (true, _) => Vec::new(),
    };
    let arguments = ["flockreel", "serve"].into_iter().map(str::to_owned);
    let result = Cli::command().try_get_matches_from(arguments.chain(given));
    result.map_or_else(|error| Err(first_line(&error)), |_| Ok(()))
}

/// Returns the message of clap without its usage and tips.
fn first_line(error: &clap::Error) -> String {
    let sentence = error.to_string();
    let line = sentence.lines().next().unwrap_or_default();
    line.trim_start_matches("error: ").to_owned()
}

/// Returns the command and its subcommands with the settings as defaults of their options.
fn with_defaults(command: Command, settings: &Settings) -> Command {
    command
        .mut_args(|option| {
            let value = settings.get(option.get_id().as_str());
            match value.filter(|_| option.get_env().is_some()) {
                Some(value) => option.default_value(value.clone()),
                None => option,
            }
        })
        .mut_subcommands(|command| with_defaults(command, settings))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn config_file_is_found_among_the_arguments() {
        let of = |line: &str| {
            let arguments: Vec<OsString> = line.split(' ').map(OsString::from).collect();
            last_value(&arguments, "--config")
        };
        assert_eq!(of("flockreel serve --config a.toml"), Some("a.toml".into()));
        assert_eq!(
            of("flockreel --config=b --config=c serve"),
            Some("c".into())
        );
        assert_eq!(of("flockreel analyze -- --config=b"), None);
        assert_eq!(of("flockreel serve --config"), None);
    }

    #[test]
    fn file_overrides_the_default_and_a_flag_the_file() {
        let settings = Settings::from([
            ("rate".to_owned(), "7".to_owned()),
            ("no_sample".to_owned(), "true".to_owned()),
        ]);
        let of = |line: &str| {
            let command = with_defaults(Cli::command(), &settings);
            let matches = command.try_get_matches_from(line.split(' ')).unwrap();
            let (_, serve) = matches.subcommand().unwrap();
            (
                *serve.get_one::<u32>("rate").unwrap(),
                serve.get_flag("no_sample"),
            )
        };
        assert_eq!(of("flockreel serve"), (7, true));
        assert_eq!(of("flockreel serve --rate 9"), (9, true));
        let mut command = with_defaults(Cli::command(), &settings);
        let serve = command.find_subcommand_mut("serve").unwrap();
        assert!(
            serve
                .render_long_help()
                .to_string()
                .contains("[default: 7]")
        );
    }

    #[test]
    fn errors_of_the_file_name_the_setting_or_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("flockreel.toml");
        let said = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read(&file)
                .err()
                .map_or_else(String::new, |error| error.to_string())
        };
        assert_eq!(
            said("bind = '127.0.0.1:1'\nmax-upload-bytes = 5\nno_sample = false"),
            ""
        );
        for (text, start) in [
            ("speed = 1", "the setting speed is unknown, in: "),
            ("config = 'b'", "the setting config is unknown"),
            (
                "rate = 'many'",
                "rate: invalid value 'many' for '--rate <N>'",
            ),
            ("auth = 'never'", "auth: invalid value 'never'"),
            ("rate = 1.5", "the value of rate has the wrong type"),
            (
                "no_sample = 'yes'",
                "the value of no_sample has the wrong type",
            ),
            ("bind = '127.0.0.1:1'\nrate = ", "line 2 is not valid TOML"),
        ] {
            assert!(said(text).starts_with(start), "{}", said(text));
        }
    }
}
