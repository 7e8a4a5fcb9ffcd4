//! `pleach study`: the papers' experiments on a tree.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::botany::load::load;
use crate::botany::recognise::{RecogniseOptions, recognise};
use crate::botany::tree::Tree;
use crate::error::{Error, Result};
use crate::study::lee;

/// Repeats a paper's experiment on a tree.
#[derive(Args, Debug)]
pub struct StudyArgs {
    #[command(subcommand)]
    study: Study,
}

#[derive(Subcommand, Debug)]
enum Study {
    /// Incorrect pixels at budgets of 80, 50, 30 and 10 % of the leaves, by four priorities.
    Lee(LeeArgs),
}

#[derive(Args, Debug)]
struct Common {
    /// The tree (.glb or .gltf).
    input: PathBuf,
    /// Folder for the study's picture.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

#[derive(Args, Debug)]
struct LeeArgs {
    #[command(flatten)]
    common: Common,
    /// Height of the tree, pixels.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=2048))]
    height: u32,
    /// Views at least: around the tree at three elevations, and the top.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1000))]
    views: u32,
    /// Layers of the layer-plus-normal priority.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    layers: u32,
    /// Leaves that are drawn or left out together.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    group: u32,
}

/// Runs the command.
///
/// # Errors
/// Where the file can't be read or the picture can't be written.
pub fn run(args: &StudyArgs) -> Result<()> {
    match &args.study {
        Study::Lee(args) => run_lee(args),
    }
}

fn run_lee(args: &LeeArgs) -> Result<()> {
    let tree = read(&args.common)?;
    if tree.leaves.is_empty() {
        return Err(Error::input(
            &args.common.input,
            "model",
            "no leaf was recognised",
            "this study is about leaves; --organ of `pleach inspect` shows what is taken for what",
        ));
    }
    let settings = lee::Settings {
        height_px: args.height,
        views: args.views as usize,
        layers: args.layers,
        group: args.group as usize,
        ..lee::Settings::default()
    };
    let study = lee::study(&tree, &settings);
    if let Some(folder) = &args.common.output {
        study.write(folder)?;
    }
    match args.common.json {
        true => println!("{}", study.to_json()),
        false => print!("{}", study.table()),
    }
    Ok(())
}

/// Reads the tree, and makes the folder before anything takes long.
fn read(common: &Common) -> Result<Tree> {
    if let Some(folder) = &common.output {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    }
    recognise(load(&common.input)?, &RecogniseOptions::default())
}
