//! The command line: one file per command (docs/reference/command-line.md).
//!
//! Results go to files, progress and errors to stderr. `--json` prints one line of JSON to stdout. `token`,
//! `gc`, `doctor` and `summary` print to stdout in any case. Exit status: 0 for success, 2 for bad usage or bad input, 1
//! for an internal failure.

pub mod analyze;
mod attempt;
pub mod backup;
pub mod check;
pub mod check_plan;
pub mod config_file;
pub mod dataset;
pub mod doctor;
pub mod error;
pub mod fish;
pub mod flock;
pub mod gc;
pub mod library;
pub mod progress;
pub mod sample;
pub mod serve;
pub mod set;
pub mod token;
pub mod worker;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Parser, Subcommand};
use serde_json::Value;
use tokio::runtime::Runtime;

pub use error::Error;
pub use progress::Listener;

use crate::config;
use crate::logging::{self, LogFormat, say, say_error};
use crate::media::{self, Tool};
use crate::store::{Spill, tls};
use crate::traces::Exporter;
use flockreel_core::formats::library_dir::{self, StoredLibrary};
use flockreel_core::scratch::Scratch;

/// flockreel: film one animal, get a flock of it.
#[derive(Debug, Parser)]
#[command(name = "flockreel", version, about, propagate_version = true)]
pub struct Cli {
    /// Print a one-line JSON summary to stdout when done.
    #[arg(long, global = true)]
    json: bool,
    /// Filter of the log on stderr, such as `debug` or `flockreel::jobs=debug`. Default: `info` for `serve`
    /// and `worker`, else `warn`.
    #[arg(long, global = true, env = "FLOCKREEL_LOG", value_name = "FILTER",
        value_parser = logging::check_filter)]
    log: Option<String>,
    #[command(flatten)]
    media: config::MediaTools,
    /// Format of log lines: plain text, or one JSON object per line.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_LOG_FORMAT",
        default_value = "text",
        value_name = "FORMAT"
    )]
    log_format: LogFormat,
    /// File with settings (TOML). Its keys are the names of flags: `max-upload-bytes = 1000000`. Flags
    /// override environment variables, which override the file, which overrides the defaults.
    #[arg(long, global = true, env = "FLOCKREEL_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// Command to run.
    #[command(subcommand)]
    command: Command,
}

/// The commands, in the order of the help.
#[derive(Debug, Subcommand)]
enum Command {
    /// Start the service: API, page and workers in one process.
    Serve(serve::Args),
    /// Run jobs of a service on another machine, without API and page.
    Worker(worker::Args),
    /// Create, list and revoke the tokens that give access to the service from other machines.
    Token(token::Args),
    /// Check the data folder: every file must match its record in the database, and every job must have a
    /// valid state.
    Check(check::Args),
    /// Remove unused data: leftovers of crashes, expired uploads, sessions and stored responses, and data
    /// older than the settings allow.
    Gc(gc::Args),
    /// Copy the data folder, even while a service uses it. To restore, run `serve --data` on the copy.
    Backup(backup::Args),
    /// Measure the animal in a video and write a library.
    Analyze(analyze::Args),
    /// Set the scale of a library, for results in centimetres. Nothing is measured again.
    Scale(library::scale::Args),
    /// Write place, speed and size of the animal in every frame, in centimetres if the library has a scale.
    Motion(library::motion::Args),
    /// Print distance, speeds, rest and turns of films as CSV, one row each.
    Summary(library::summary::Args),
    /// Make a flock from a library and write it as a video.
    Flock(flock::Args),
    /// Make a labelled data set of many flocks, for a detector or tracker.
    Dataset(dataset::Args),
    /// Check the plan of a flock: every step, every cost, and that no cheaper plan exists.
    CheckPlan(check_plan::Args),
    /// Make a virtual fish that swims like the animal, as a video or a 3-D model.
    Fish(fish::Args),
    /// Write the distance matrix of a library, as numbers or as a picture.
    Matrix(library::matrix::Args),
    /// Write the animal of every frame as a picture with a transparent background.
    Sprites(library::sprites::Args),
    /// Write sample footage: a virtual fish whose exact poses are known.
    Sample(sample::Args),
    /// Check whether this machine has everything that flockreel needs, and explain what is missing.
    Doctor(doctor::Args),
    /// Compute one attempt at a job; a worker starts this command and gives the order on stdin.
    #[command(hide = true)]
    Attempt(attempt::Args),
}

/// Result of a command: the line of JSON that `--json` prints.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary(pub Value);

/// Runs the command and returns the exit status. Invalid input never causes a panic.
pub fn main(arguments: &[OsString]) -> ExitCode {
    let cli = match config_file::parse(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            say_error(&format!("flockreel: {error}"));
            return ExitCode::from(error.exit_code());
        }
    };
    let serves = matches!(cli.command, Command::Serve(_) | Command::Worker(_));
    // Services log all their events, other commands only warnings.
    let default = if serves { "info" } else { "warn" };
    let endpoint =
        monitoring(&cli.command).and_then(|monitoring| monitoring.otlp_endpoint.as_ref());
    if endpoint.is_some() {
        tls::choose_cryptography();
    }
    let exporter = match endpoint.map(Exporter::start).transpose() {
        Ok(exporter) => exporter,
        Err(error) => {
            say_error(&format!("flockreel: traces cannot be exported: {error}"));
            return ExitCode::FAILURE;
        }
    };
    let filter = cli.log.as_deref().unwrap_or(default);
    let _log = logging::start(filter, cli.log_format, exporter.as_ref());
    // Ends before the log, to which it reports.
    let _exporter = exporter;
    if serves || logging::is_json() || matches!(cli.command, Command::Attempt(_)) {
        logging::log_panics();
    }
    media::configure(&cli.media);
    match run(cli.command, cli.json) {
        Ok(summary) => print(cli.json, &summary),
        Err(error) => {
            say_error(&format!("flockreel: {error}"));
            if let Some(advice) = error.advice() {
                say(&format!("flockreel: {advice}"));
            }
            ExitCode::from(error.exit_code())
        }
    }
}

/// Returns how a service is monitored; `None` for other commands.
fn monitoring(command: &Command) -> Option<&config::Monitoring> {
    match command {
        Command::Serve(args) => Some(args.monitoring()),
        Command::Worker(args) => Some(args.monitoring()),
        _ => None,
    }
}

fn run(command: Command, json: bool) -> Result<Option<Summary>, Error> {
    match command {
        Command::Serve(args) => serve::run(args),
        Command::Worker(args) => worker::run(args),
        Command::Token(args) => token::run(args, json),
        Command::Check(args) => check::run(args),
        Command::Gc(args) => gc::run(args, json),
        Command::Backup(args) => backup::run(args),
        Command::Analyze(args) => analyze::run(args),
        Command::Scale(args) => library::scale::run(args),
        Command::Motion(args) => library::motion::run(args),
        Command::Summary(args) => library::summary::run(args, json),
        Command::Flock(args) => flock::run(args),
        Command::Dataset(args) => dataset::run(args),
        Command::CheckPlan(args) => check_plan::run(args),
        Command::Fish(args) => fish::run(args),
        Command::Matrix(args) => library::matrix::run(args),
        Command::Sprites(args) => library::sprites::run(args),
        Command::Sample(args) => sample::run(args),
        Command::Doctor(args) => doctor::run(args, json),
        Command::Attempt(args) => attempt::run(args),
    }
}

/// Reads a library for a command that writes to `output`. Temporary data that is too large for memory goes to
/// the same disk.
fn read_library(folder: &Path, output: &Path) -> Result<StoredLibrary, Error> {
    library_dir::read(folder, scratch_beside(output)).map_err(unreadable(folder))
}

/// Returns the error of a library folder that cannot be read.
fn unreadable(folder: &Path) -> impl FnOnce(library_dir::Error) -> Error {
    let folder = folder.display().to_string();
    move |error| Error::Usage(format!("cannot read the library: {folder}: {error}"))
}

/// Returns temporary storage on the disk of the output, in its nearest existing parent folder.
fn scratch_beside(output: &Path) -> Arc<dyn Scratch> {
    Arc::new(Spill::into(nearest_folder(output)))
}

/// Returns the nearest existing folder that contains a path, or the current folder.
fn nearest_folder(path: &Path) -> &Path {
    let folder = path.ancestors().find(|folder| folder.is_dir());
    folder.unwrap_or(Path::new("."))
}

/// Returns the extension of a file name in lower case; empty if there is none.
fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().to_lowercase()
}

fn write_file(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    std::fs::write(path, bytes).map_err(Error::io(format!("cannot write {}", path.display())))
}

fn runtime() -> Result<Runtime, Error> {
    Runtime::new().map_err(Error::io("starting the threads"))
}

fn print(json: bool, summary: &Option<Summary>) -> ExitCode {
    let Some(Summary(value)) = summary.as_ref().filter(|_| json) else {
        return ExitCode::SUCCESS;
    };
    match writeln!(std::io::stdout(), "{value}") {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::FAILURE,
    }
}

/// Fails if the sandbox lacks a layer that `--sandbox` requires. Other missing layers are logged. Commands
/// that read videos of untrusted people call this at their start.
fn check_sandbox() -> Result<(), Error> {
    media::search_in_background(&[Tool::Ffprobe, Tool::Ffmpeg]);
    match media::required_sandbox() {
        Err(error @ media::Error::SandboxIncomplete { .. }) => Err(Error::Usage(error.to_string())),
        // The search for ffmpeg reports a missing ffmpeg.
        Err(_) => Ok(()),
        Ok(sandbox) => {
            for (layer, reason) in sandbox.layers {
                if let Some(reason) = reason {
                    let (layer, meaning) = (layer.name(), layer.meaning());
                    tracing::warn!(layer, reason, meaning, "a layer of the sandbox is missing");
                }
            }
            Ok(())
        }
    }
}

/// Writes lines to stdout, for commands whose result is text.
fn print_lines(lines: &[String]) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    let mut lines = lines.iter();
    let written = lines.try_for_each(|line| writeln!(out, "{line}"));
    written.map_err(Error::io("writing to stdout"))
}
