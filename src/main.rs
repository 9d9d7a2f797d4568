//! The program: arguments, logging, one command, exit code (DESIGN.md, Command line).

use std::process::ExitCode;

use clap::Parser;
use flockreel::cli::Cli;

fn main() -> ExitCode {
    flockreel::cli::main(Cli::parse())
}
