//! The program: arguments, logging, one command, exit code (DESIGN.md, Command line).

use std::process::ExitCode;

fn main() -> ExitCode {
    flockreel::cli::main(&std::env::args_os().collect::<Vec<_>>())
}
