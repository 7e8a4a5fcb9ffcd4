//! The command line: one file a command.

mod bake;
mod bake_table;
mod batch;
mod evaluate;
mod evaluate_folder;
mod grow;
mod inspect;
mod out;
mod page;
mod plan;
mod plan_bake;
mod progress;
mod scene;
mod species;
mod study;
mod sweep;
mod sweep_table;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "pleach", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bake(bake::Args),
    Evaluate(evaluate::Args),
    Grow(grow::GrowArgs),
    Inspect(inspect::InspectArgs),
    Plan(plan::Args),
    Sweep(sweep::Args),
    Study(study::StudyArgs),
}

/// Parses the arguments, runs one command and says how it ended.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    let result = match cli.command {
        Command::Bake(args) => bake::run(args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Grow(args) => grow::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Plan(args) => plan::run(&args),
        Command::Sweep(args) => sweep::run(&args),
        Command::Study(args) => study::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            out::say(format_args!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}
