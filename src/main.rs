//! The program: passes the command-line arguments to `cli` and returns the exit code
//! (docs/reference/command-line.md).

use std::process::ExitCode;

fn main() -> ExitCode {
    flockreel::cli::main(&std::env::args_os().collect::<Vec<_>>())
}
