//! The command line: one file a command (DESIGN.md, Command line).
//!
//! Results go to files, progress and errors to stderr, and with `--json` one line of JSON to
//! stdout (`token` prints to stdout without it too). Exit codes: 0; 2 for bad usage or input; 1 for a failure inside.

pub mod analyze;
pub mod backup;
pub mod check;
pub mod check_plan;
pub mod config_file;
pub mod doctor;
pub mod error;
pub mod fish;
pub mod flock;
pub mod gc;
pub mod matrix;
pub mod progress;
pub mod sample;
pub mod serve;
mod set;
pub mod sprites;
pub mod token;
pub mod worker;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Parser, Subcommand};
use serde_json::Value;

pub use error::Error;
pub use progress::Listener;

use crate::config;
use crate::formats::library_dir::{self, StoredLibrary};
use crate::logging::{self, LogFormat, say};
use crate::media::{self, Tool};
use crate::scratch::Scratch;
use crate::store::Spill;

/// flockreel: film one animal, get a flock of it.
#[derive(Debug, Parser)]
#[command(name = "flockreel", version, about, propagate_version = true)]
pub struct Cli {
    /// Print a one-line JSON summary to stdout when done.
    #[arg(long, global = true)]
    json: bool,
    /// What to log to stderr, for example `debug` or `flockreel::jobs=debug`.
    #[arg(long, global = true, env = "FLOCKREEL_LOG", value_name = "FILTER")]
    log: Option<String>,
    #[command(flatten)]
    media: config::Media,
    /// How log lines are written: for people, or a JSON object a line.
    #[arg(
        long,
        global = true,
        env = "FLOCKREEL_LOG_FORMAT",
        default_value = "text",
        value_name = "FORMAT"
    )]
    log_format: LogFormat,
    /// A file of settings (TOML), each called as its flag: `max-upload-bytes = 1000000`. Flags win over
    /// environment variables, those over the file, that over the defaults.
    #[arg(long, global = true, env = "FLOCKREEL_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// What to do.
    #[command(subcommand)]
    command: Command,
}

/// The commands, in the order in which a newcomer meets them.
#[derive(Debug, Subcommand)]
enum Command {
    /// Start the service: API, page and workers in one process.
    Serve(serve::Args),
    /// Run the jobs of a service on a further machine: workers alone.
    Worker(worker::Args),
    /// Make, list and revoke the tokens with which the service is reached from elsewhere.
    Token(token::Args),
    /// Verify that the data folder is sound: every file has its row and its hash, every job one legal state.
    Check(check::Args),
    /// Remove what nobody refers to any more: leftovers of crashes, uploads that were given up.
    Gc(gc::Args),
    /// Copy the data folder, beside a running service too; `serve --data` on the copy restores it.
    Backup(backup::Args),
    /// Measure the animal in a video: footage to library.
    Analyze(analyze::Args),
    /// Make a flock out of a library, as a video.
    Flock(flock::Args),
    /// Check a flock's plan: every step, every cost, and that nothing cheaper exists.
    CheckPlan(check_plan::Args),
    /// Let the virtual fish swim as the animal swam, as a video or a model.
    Fish(fish::Args),
    /// Write the distance matrix of a library, as numbers or as a picture.
    Matrix(matrix::Args),
    /// Write the animal of every frame as a picture with transparency.
    Sprites(sprites::Args),
    /// Film the virtual fish: footage whose truth is known.
    Sample(sample::Args),
    /// Say what this machine has of what flockreel needs, and what each lack means.
    Doctor(doctor::Args),
}

/// What a command did: the one line of JSON that `--json` prints.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary(pub Value);

/// Runs the command and says how it went; never panics on a user's input.
pub fn main(arguments: &[OsString]) -> ExitCode {
    let cli = match config_file::parse(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            say(&format!("flockreel: {error}"));
            return ExitCode::from(error.exit_code());
        }
    };
    let serves = matches!(cli.command, Command::Serve(_) | Command::Worker(_));
    // Everything worth knowing of a service, only warnings of the other commands.
    let default = if serves { "info" } else { "warn" };
    let _log = logging::start(cli.log.as_deref().unwrap_or(default), cli.log_format);
    if serves {
        logging::log_panics();
    }
    media::set_up(&cli.media);
    match run(cli.command, cli.json) {
        Ok(summary) => print(cli.json, &summary),
        Err(error) => {
            say(&format!("flockreel: {error}"));
            if let Some(advice) = error.advice() {
                say(&format!("flockreel: {advice}"));
            }
            ExitCode::from(error.exit_code())
        }
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
        Command::Flock(args) => flock::run(args),
        Command::CheckPlan(args) => check_plan::run(args),
        Command::Fish(args) => fish::run(args),
        Command::Matrix(args) => matrix::run(args),
        Command::Sprites(args) => sprites::run(args),
        Command::Sample(args) => sample::run(args),
        Command::Doctor(args) => doctor::run(args, json),
    }
}

/// Reads a library for a command whose output goes to `output`, beside which there is room for what memory
/// should not hold.
fn read_library(folder: &Path, output: &Path) -> Result<StoredLibrary, Error> {
    library_dir::read(folder, scratch_beside(output))
        .map_err(|error| Error::Usage(format!("not a library: {}: {error}", folder.display())))
}

/// Room on the disk that the output goes to, in the nearest folder that is there already.
fn scratch_beside(output: &Path) -> Arc<dyn Scratch> {
    let folder = output.ancestors().find(|folder| folder.is_dir());
    Arc::new(Spill::into(folder.unwrap_or(Path::new("."))))
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

/// Refuses to start a command that takes strangers' films where the sandbox is not as demanded; what is
/// missing otherwise is logged.
fn check_walls() -> Result<(), Error> {
    media::look_for(&[Tool::Ffprobe, Tool::Ffmpeg]);
    match media::demanded_walls() {
        Err(error @ media::Error::SandboxIncomplete { .. }) => Err(Error::Usage(error.to_string())),
        // That there is no ffmpeg is said where it is looked for.
        Err(_) => Ok(()),
        Ok(walls) => {
            for (layer, lack) in walls.layers {
                if let Some(reason) = lack {
                    let (layer, meaning) = (layer.name(), layer.meaning());
                    tracing::warn!(layer, reason, meaning, "a layer of the sandbox is missing");
                }
            }
            Ok(())
        }
    }
}

/// Writes lines to stdout, for commands whose answer is text.
fn print_lines(lines: &[String]) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    lines.iter().try_for_each(|line| writeln!(out, "{line}"))
}
