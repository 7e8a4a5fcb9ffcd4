//! `pleach plan`: what a scene needs of its trees, what that costs, and just that baked.

use std::path::{Path, PathBuf};

use super::out::{print, say};
use super::progress::{Bars, catch_ctrl_c};
use super::scene::scene;
use crate::batch::{Batch, Done, bake_all};
use crate::error::{Error, Result};
use crate::knobs::read;
use crate::pipeline::{Request, Wanted};
use crate::plan::{Answer, Spec, SpeciesAnswer, plan};
use crate::recipe::{Preset, Recipe};
use crate::report::schema::Report;

/// Say what a scene needs of its trees and what that costs; with --bake, bake just that.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Species, where they stand, and the camera's path (RON).
    #[arg(value_name = "PLAN.ron")]
    plan: PathBuf,
    /// Folder for plan.json and, with --bake, a package for each species.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Bake the levels that are needed.
    #[arg(long, requires = "output")]
    bake: bool,
    /// Scene where the plan has none: hero, game, landscape, map, or a file (RON).
    #[arg(long, value_name = "NAME|FILE.ron")]
    scene: Option<PathBuf>,
    /// Where the recipe starts from.
    #[arg(long, value_enum, default_value_t)]
    preset: Preset,
    /// Knobs that differ from the preset (RON).
    #[arg(long, value_name = "FILE.ron")]
    recipe: Option<PathBuf>,
    /// Keep levels that left their band instead of refusing the bake.
    #[arg(long)]
    accept: bool,
    /// Threads; 0: one for each core.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// No progress, no table.
    #[arg(long)]
    quiet: bool,
    /// Print plan.json instead of a table.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let base = Spec {
        scene: scene(args.scene.as_deref())?,
        ..Spec::default()
    };
    let spec = read(&args.plan, &base)?;
    let folder = args.plan.parent().unwrap_or(Path::new(""));
    catch_ctrl_c()?;
    let mut answer = plan(&spec, folder)?;
    if args.bake {
        bake(args, &spec, &mut answer)?;
    }
    let text = serde_json::to_string_pretty(&answer).map_err(|e| Error::Internal {
        step: "plan",
        what: e.to_string(),
    })? + "\n";
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
        let file = folder.join("plan.json");
        std::fs::write(&file, &text).map_err(|e| Error::io(&file, "write", e))?;
    }
    match (args.json, args.quiet) {
        (true, _) => print(&text),
        (false, true) => Ok(()),
        (false, false) => print(&table(&answer, &spec)),
    }
}

/// Bakes each species with a scene of its own, and puts what was measured into the answer.
fn bake(args: &Args, spec: &Spec, answer: &mut Answer) -> Result<()> {
    let Some(output) = &args.output else {
        return Ok(());
    };
    let preset = Recipe::preset(args.preset);
    let recipe = match &args.recipe {
        Some(file) => read(file, &preset)?,
        None => preset,
    };
    let mut disk = 0;
    for species in answer.species.iter_mut() {
        let Some(request) = request(species, spec, &recipe, args.accept) else {
            continue;
        };
        let batch = Batch {
            inputs: vec![species.input.clone()],
            output: output.clone(),
            request,
            rebake: false,
            threads: args.threads.into(),
        };
        let bars = Bars::new(args.quiet);
        let outcomes = bake_all(&batch, &bars);
        bars.finish();
        for outcome in outcomes? {
            let report = match outcome.done {
                Done::Baked(baked) => {
                    for warning in baked.warnings.iter().filter(|_| !args.quiet) {
                        say(format_args!("warning: {}: {warning}", species.name));
                    }
                    baked.report
                }
                Done::Unchanged => report(&outcome.output)?,
                Done::Failed(error) => return Err(error),
            };
            measured(species, &report, spec);
            disk += size(&outcome.output)?;
        }
    }
    answer.texture_bytes_estimated = false;
    answer.disk_bytes = Some(disk);
    answer.add_up();
    Ok(())
}

/// What to bake of a species; `None` where it is never seen.
fn request(species: &SpeciesAnswer, spec: &Spec, recipe: &Recipe, accept: bool) -> Option<Request> {
    species.nearest_m?;
    Some(Request {
        wanted: Wanted::Levels(spec.levels.into()),
        recipe: recipe.clone(),
        scene: species.scene.clone(),
        accept,
        ..Request::default()
    })
}

fn report(package: &Path) -> Result<Report> {
    let file = package.join("report.json");
    let text = std::fs::read_to_string(&file).map_err(|e| Error::io(&file, "read", e))?;
    serde_json::from_str(&text)
        .map_err(|e| Error::input(&file, "the report", e.to_string(), "bake the tree again"))
}

/// Textures and triangles of the levels that were baked.
fn measured(species: &mut SpeciesAnswer, report: &Report, spec: &Spec) {
    for level in &report.levels {
        let height = level.sizes.first().map(|s| f64::from(s.height_px));
        let same = |px: Option<f64>| {
            px.zip(height)
                .is_some_and(|(a, b)| (a.round() - b).abs() < 1.0)
        };
        if let Some(found) = species.levels.iter_mut().find(|l| same(l.height_px)) {
            found.triangles = level.triangles;
            found.texture_bytes = (level.texture_bytes as f64 / 4.0 * spec.texel_bytes) as u64;
        }
    }
}

/// Bytes of all files of a folder.
fn size(folder: &Path) -> Result<u64> {
    let fail = |e| Error::io(folder, "list", e);
    let mut sum = 0;
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        sum += entry.and_then(|e| e.metadata()).map_err(fail)?.len();
    }
    Ok(sum)
}

fn table(answer: &Answer, spec: &Spec) -> String {
    let mib = |bytes: u64| bytes as f64 / 1_048_576.0;
    let mut out = format!(
        "{:<24}{:>7}{:>11}{:>10}{:>10}{:>7}{:>12}{:>11}\n",
        "species", "level", "triangles", "from m", "at px", "needed", "trees mean", "tex MB"
    );
    for species in &answer.species {
        let mut head = species.name.as_str();
        for (number, level) in species.levels.iter().enumerate() {
            let px = level.height_px.map_or("-".into(), |px| format!("{px:.0}"));
            out += &format!(
                "{head:<24}{number:>7}{:>11}{:>10.1}{px:>10}{:>7}{:>12.1}{:>11.1}\n",
                level.triangles,
                level.distance_m,
                if level.needed { "yes" } else { "no" },
                level.shown.mean,
                mib(level.texture_bytes),
            );
            head = "";
        }
        out += &match (species.nearest_m, species.farthest_m) {
            (Some(near), Some(far)) => format!(
                "{:<24}{} trees, {:.1} m high, seen from {near:.1} m to {far:.1} m\n",
                "", species.trees, species.height_m
            ),
            _ => format!("{:<24}{} trees, none is ever seen\n", "", species.trees),
        };
    }
    let (with, without) = (answer.triangles, answer.triangles_original);
    out += &format!(
        "\nTriangles a frame over {} frames: mean {:.0}, worst {} (frame {}); without levels {:.0} and {}.\n",
        answer.frames, with.mean, with.worst, with.worst_frame, without.mean, without.worst
    );
    if answer.hidden_trees.worst > 0 {
        let (less, hidden) = (answer.triangles_unhidden, answer.hidden_trees);
        out += &format!(
            "Trees hide others: {:.1} a frame, {} at most; without these, and coarser where half hidden: mean {:.0}, worst {} triangles.\n",
            hidden.mean, hidden.worst, less.mean, less.worst
        );
    }
    if answer.moved_nearer > 1.0 {
        out += &format!(
            "Levels start {:.2} times nearer than asked, for the budget of {} triangles: so much larger are their errors.\n",
            answer.moved_nearer, spec.triangles_per_frame
        );
    }
    if answer.budget_met == Some(false) {
        out += "The budget is too small: even so the worst frame draws more. Ask for more levels, or for fewer trees.\n";
    }
    out += &format!(
        "Textures of what is needed: {}{:.0} MB with mips, at {} bytes a texel.\n",
        if answer.texture_bytes_estimated {
            "about "
        } else {
            ""
        },
        mib(answer.texture_bytes),
        spec.texel_bytes
    );
    if let Some(disk) = answer.disk_bytes {
        out += &format!("On disk: {:.0} MB.\n", mib(disk));
    }
    out
}
