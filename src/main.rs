//! The command line: arguments in, one command, error and exit code out.

use std::process::ExitCode;

fn main() -> ExitCode {
    pleach::cli::run(std::env::args_os())
}
