//! `pleach study`: the papers' experiments on a tree.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde_json::Value;

use super::out;
use crate::botany::load::load;
use crate::botany::recognise::{RecogniseOptions, recognise};
use crate::botany::tree::Tree;
use crate::error::{Error, Result};
use crate::recipe::Preset;
use crate::study::species::Species;
use crate::study::{deng, el_sana, kratt, lee, scenes};

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
    /// Billboards, texels and F1 along a camera path: distance, dot product, density, occlusion.
    Deng(PathArgs),
    /// Triangles, splits and merges, time and changed triangles along a path, with and without occlusion.
    ElSana(PathArgs),
    /// Precision and recall of the levels of trees: adaptive loop beside optimal cut.
    Kratt(KrattArgs),
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
    /// Number of views: around the tree at three elevations, and the top.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1000))]
    views: u32,
    /// Layers of the layer-plus-normal priority.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    layers: u32,
    /// Leaves that are drawn or left out together.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    group: u32,
}

#[derive(Args, Debug)]
struct PathArgs {
    #[command(flatten)]
    common: Common,
    /// Frames of the camera's path.
    #[arg(long, default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Frames that are drawn and compared; drawing the forest leaf by leaf takes seconds for each.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pictures: u32,
    /// How much farther off what is right behind a dense crown counts.
    #[arg(long, default_value_t = 1.0, value_parser = at_least_0)]
    strength: f32,
    /// Share of a grid's extinction that counts: leaves crowd, and hide less than evenly spread ones.
    #[arg(long, default_value_t = scenes::CLUMPING, value_parser = at_least_0)]
    clumping: f32,
}

impl PathArgs {
    fn settings(&self) -> deng::Settings {
        deng::Settings {
            frames: self.frames as usize,
            pictures: self.pictures.min(self.frames) as usize,
            strength: self.strength,
            clumping: self.clumping,
        }
    }
}

fn at_least_0(text: &str) -> std::result::Result<f32, String> {
    match text.parse() {
        Ok(number) if (0.0..=1000.0).contains(&number) => Ok(number),
        _ => Err("give a number from 0 to 1000".into()),
    }
}

#[derive(Args, Debug)]
struct KrattArgs {
    /// The trees (.glb or .gltf).
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// Folder for the baked packages and their pictures; without it they are thrown away.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Accuracy against time.
    #[arg(long, value_enum, default_value_t = Preset::Draft)]
    preset: Preset,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Where the file can't be read or the picture can't be written.
pub fn run(args: &StudyArgs) -> Result<()> {
    match &args.study {
        Study::Lee(args) => run_lee(args),
        Study::Deng(args) => {
            let study = deng::study(species(&args.common)?, &args.settings())?;
            print(&args.common, &study.to_json(), &study.table(), |folder| {
                study.write(folder)
            })
        }
        Study::ElSana(args) => {
            let study = el_sana::study(species(&args.common)?, &args.settings())?;
            print(&args.common, &study.to_json(), &study.table(), |folder| {
                study.write(folder)
            })
        }
        Study::Kratt(args) => run_kratt(args),
    }
}

/// The tree with billboards for all its nodes.
fn species(common: &Common) -> Result<Species> {
    Species::new(read(common)?, scenes::focal_px(), scenes::TEXELS)
}

fn print(
    common: &Common,
    json: &Value,
    table: &str,
    write: impl Fn(&Path) -> Result<()>,
) -> Result<()> {
    if let Some(folder) = &common.output {
        write(folder)?;
    }
    match common.json {
        true => out::print(&format!("{json}\n")),
        false => out::print(table),
    }
}

fn run_kratt(args: &KrattArgs) -> Result<()> {
    let thrown_away = std::env::temp_dir().join(format!("pleach-study-{}", std::process::id()));
    let folder = args.output.as_ref().unwrap_or(&thrown_away);
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    let rows = kratt::study(&args.inputs, args.preset, folder, args.output.is_some());
    if args.output.is_none() {
        let _ = std::fs::remove_dir_all(folder);
    }
    let rows = rows?;
    match args.json {
        true => out::print(&format!("{}\n", kratt::to_json(&rows))),
        false => out::print(&kratt::table(&rows)),
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
    print(&args.common, &study.to_json(), &study.table(), |folder| {
        study.write(folder)
    })
}

/// Reads the tree, and makes the folder before anything takes long.
fn read(common: &Common) -> Result<Tree> {
    if let Some(folder) = &common.output {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    }
    recognise(load(&common.input)?, &RecogniseOptions::default())
}
