//! `pleach bake`: a tree becomes a package of levels.

use std::path::PathBuf;
use std::time::Instant;

use super::bake_table::table;
use super::batch;
use super::out::{print, say};
use super::page;
use super::progress::{Bars, catch_ctrl_c};
use super::scene::scene;
use super::species;
use crate::batch::Batch;
use crate::error::{Error, Result};
use crate::knobs::read;
use crate::pipeline::{Limit, Request, Wanted, bake, to_json};
use crate::recipe::{Preset, Recipe};
use crate::report::schema::{Bake, Report};
use crate::species::Species;
use crate::threads::pool_with_caller;
use crate::watch::Clock;

/// Bake levels of detail of a tree, or of many.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The tree: .glb or .gltf. Several are a batch.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Folder of the package; in a batch, of a folder for each tree.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// A package for each tree in a folder of its name under DIR, also where there is one tree; what has not changed
    /// since the last run is not baked again.
    #[arg(long)]
    batch: bool,
    /// In a batch or a species: bake again what has not changed.
    #[arg(long)]
    rebake: bool,
    /// The inputs are trees of one species, which is named after DIR: one package, in which levels that start at one
    /// size share a page, and cards that look alike share texels, whosever they are (by --sharing, here .01 unless
    /// said otherwise).
    #[arg(long, conflicts_with_all = ["batch", "instancing", "hierarchy", "page"])]
    species: bool,
    /// One level for each: a count ("5000") or a share of the original ("10%"), wood included.
    #[arg(long, value_delimiter = ',', value_name = "N|%", value_parser = limit)]
    triangles: Vec<Limit>,
    /// No more triangles than this error needs: pixels, where the level starts. Beside --triangles, both hold.
    #[arg(long, value_name = "PX", value_parser = pixels)]
    max_error: Option<f64>,
    /// Number of levels beside the original, at doubling distances; the last is a billboard of the whole tree [default: 4].
    #[arg(long, conflicts_with = "triangles", value_parser = clap::value_parser!(u8).range(1..=12))]
    levels: Option<u8>,
    /// Where the recipe starts from.
    #[arg(long, value_enum, default_value_t)]
    preset: Preset,
    /// Knobs that differ from the preset (RON).
    #[arg(long, value_name = "FILE.ron")]
    recipe: Option<PathBuf>,
    /// Screen, field of view and distances: hero, game, landscape, map, or a file (RON).
    #[arg(long, value_name = "NAME|FILE.ron")]
    scene: Option<PathBuf>,
    /// Write level 0 also as prototypes of leaves and their places (NAME_instanced.glb).
    #[arg(long)]
    instancing: bool,
    /// Also bake billboards for every sub-tree that a cut may use, as nodes of one file (NAME_hierarchy.glb) and as
    /// 3D Tiles (NAME_tileset.json).
    #[arg(long)]
    hierarchy: bool,
    /// Let cards that look alike share texels, on a page of half the size, a quarter and so on, while a level loses no
    /// more F1 than this; NAME_LODn_sharing.png shows which.
    #[arg(long, value_name = "F1", num_args = 0..=1, require_equals = true, default_missing_value = "0.01")]
    sharing: Option<f64>,
    /// Also write DIR.report.html, beside the package: figures and pictures of all levels, every budget's best cut, the
    /// skeleton, where time and bytes went. Takes about as long as the bake.
    #[arg(long)]
    page: bool,
    /// Keep levels that left their band instead of refusing the bake.
    #[arg(long)]
    accept: bool,
    /// Write into a folder that holds other files; they are kept.
    #[arg(long)]
    force: bool,
    /// Threads; 0: one for each core. The package is the same with any number.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// No progress, no table.
    #[arg(long)]
    quiet: bool,
    /// Print the report as one JSON object instead of a table.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: Args) -> Result<()> {
    let started = Instant::now();
    let request = request(&args)?;
    catch_ctrl_c()?;
    if args.species {
        let species = Species {
            inputs: args.inputs,
            request,
            ..Species::default()
        };
        let threads = args.threads.into();
        return species::run(&species, args.rebake, threads, args.quiet, args.json);
    }
    if args.batch || args.inputs.len() > 1 {
        if args.page {
            return Err(Error::usage(
                "--page shows one tree, and this is a batch",
                "bake the tree alone, or run pleach evaluate on its package",
            ));
        }
        let batch = Batch {
            inputs: args.inputs,
            output: args.output,
            request,
            rebake: args.rebake,
            threads: args.threads.into(),
        };
        return batch::run(&batch, args.quiet, args.json);
    }
    let clock = Clock::new(Bars::new(args.quiet));
    let pool = pool_with_caller(args.threads.into())?;
    let baked = pool.install(|| bake(&request, &clock))?;
    clock.inner().finish();
    let stages = clock.finish();
    let took = Bake {
        seconds: started.elapsed().as_secs_f64(),
        peak_bytes: stages.iter().map(|s| s.peak_bytes).max().filter(|&b| b > 0),
        stages,
    };
    for warning in baked.warnings.iter().filter(|_| !args.quiet) {
        say(format_args!("warning: {warning}"));
    }
    let page = match args.page {
        true => Some(pool.install(|| page::write(&request, &baked, &took))?),
        false => None,
    };
    if args.json {
        let report = Report {
            bake: Some(took),
            ..baked.report
        };
        print(&(to_json(&report)? + "\n"))
    } else if !args.quiet {
        let page = page.map_or(String::new(), |p| format!("{} shows it.\n", p.display()));
        print(&(table(&baked, &took, &request) + &page))
    } else {
        Ok(())
    }
}

fn request(args: &Args) -> Result<Request> {
    let preset = Recipe::preset(args.preset);
    Ok(Request {
        // The first of them; a batch fills in each.
        input: args.inputs.first().cloned().unwrap_or_default(),
        output: args.output.clone(),
        wanted: match args.triangles.is_empty() {
            true => args
                .levels
                .map_or_else(Wanted::default, |n| Wanted::Levels(n.into())),
            false => Wanted::Limits(args.triangles.clone()),
        },
        max_error_px: args.max_error,
        recipe: {
            let recipe = match &args.recipe {
                Some(file) => read(file, &preset)?,
                None => preset,
            };
            Recipe {
                instancing: recipe.instancing || args.instancing,
                hierarchy: recipe.hierarchy || args.hierarchy,
                sharing: args.sharing.unwrap_or(recipe.sharing),
                ..recipe
            }
        },
        scene: scene(args.scene.as_deref())?,
        page: args.page,
        force: args.force,
        accept: args.accept,
    })
}

fn pixels(text: &str) -> std::result::Result<f64, String> {
    match text.parse() {
        Ok(pixels) if pixels > 0.0 && pixels <= 1000.0 => Ok(pixels),
        _ => Err("give a number of pixels from above 0 to 1000".into()),
    }
}

pub(super) fn limit(text: &str) -> std::result::Result<Limit, String> {
    let wrong = || "write a count such as 5000 or a share such as 10%".to_string();
    if let Some(share) = text.trim().strip_suffix('%') {
        let share: f64 = share.trim().parse().map_err(|_| wrong())?;
        return match share > 0.0 && share <= 100.0 {
            true => Ok(Limit::Share(share / 100.0)),
            false => Err("a share is more than 0% and at most 100%".into()),
        };
    }
    text.trim().parse().map(Limit::Count).map_err(|_| wrong())
}
