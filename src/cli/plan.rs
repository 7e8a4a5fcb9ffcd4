//! `pleach plan`: what a scene needs of its trees, what that costs, and just that baked.

use std::path::{Path, PathBuf};

use super::out::print;
use super::plan_bake::Baking;
use super::progress::catch_ctrl_c;
use super::scene::scene;
use crate::client::Takes;
use crate::error::{Error, Result};
use crate::knobs::read;
use crate::plan::{Answer, Spec, SpeciesAnswer, plan};
use crate::recipe::{Preset, Recipe};
use crate::scene::Mips;

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
    let preset = Recipe::preset(args.preset);
    let recipe = match &args.recipe {
        Some(file) => read(file, &preset)?,
        None => preset,
    };
    let mut answer = plan(&spec, &recipe, folder)?;
    if let (true, Some(output)) = (args.bake, &args.output) {
        let baking = Baking {
            spec: &spec,
            recipe,
            output,
            accept: args.accept,
            threads: args.threads.into(),
            quiet: args.quiet,
        };
        baking.bake(&mut answer)?;
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

fn table(answer: &Answer, spec: &Spec) -> String {
    let mib = |bytes: u64| bytes as f64 / 1_048_576.0;
    let mut out = format!(
        "{:<24}{:>7}{:>11}{:>10}{:>10}{:>10}{:>7}{:>12}{:>11}\n",
        "species",
        "level",
        "triangles",
        "from m",
        "at px",
        "texels/m",
        "needed",
        "trees mean",
        "tex MB"
    );
    for species in &answer.species {
        let mut head = species.name.as_str();
        for (number, level) in species.levels.iter().enumerate() {
            let px = level.height_px.map_or("-".into(), |px| format!("{px:.0}"));
            let texels = level.texels_per_m.map_or("-".into(), |n| format!("{n:.1}"));
            out += &format!(
                "{head:<24}{number:>7}{:>11}{:>10.1}{px:>10}{texels:>10}{:>7}{:>12.1}{:>11.1}\n",
                level.triangles,
                level.distance_m,
                if level.needed { "yes" } else { "no" },
                level.shown.mean,
                mib(level.texture_bytes),
            );
            head = "";
        }
        for line in told(species) {
            out += &format!("{:<24}{line}\n", "");
        }
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
    let about = |estimated: bool| if estimated { "about " } else { "" };
    out += &format!(
        "Textures of what is needed: {}{:.0} MB with mips, as {:?}. On disk: {}{:.0} MB.\n",
        about(answer.texture_bytes_estimated),
        mib(answer.texture_bytes),
        spec.scene.texture_format,
        about(answer.disk_bytes_estimated),
        mib(answer.disk_bytes)
    );
    out + &engine(answer, spec)
}

/// What is told of a species beside its levels.
fn told(species: &SpeciesAnswer) -> Vec<String> {
    let (Some(near), Some(far)) = (species.nearest_m, species.farthest_m) else {
        return vec![format!("{} trees, none is ever seen", species.trees)];
    };
    let mut lines = vec![format!(
        "{} trees, {:.1} m high, seen from {near:.1} m to {far:.1} m",
        species.trees, species.height_m
    )];
    if let (Some([from, to]), Some([low, high])) = (species.azimuths_deg, species.elevations_deg) {
        let azimuths = match to - from >= 360.0 {
            true => "all around".into(),
            false => format!("azimuths {from:.0} to {to:.0}"),
        };
        let sides = match species.both_sides {
            0.0 => "no back side of a card is ever seen".into(),
            1.0 => "cards are seen from both sides".into(),
            share => format!(
                "{:.0} % of upright cards are seen from both sides",
                100.0 * share
            ),
        };
        lines.push(format!(
            "levels: {azimuths}, elevations {low:.0} to {high:.0} degrees; {sides}"
        ));
        lines.push(format!("maps: {}", species.maps.join("; ")));
    }
    if !species.can_share_with.is_empty() {
        let others = species.can_share_with.join(", ");
        lines.push(match species.atlas.as_str() {
            "" => format!("painted as {others}: can share an atlas (say atlas: \"NAME\" of each)"),
            atlas => format!("painted as {others}; shares the atlas {atlas}"),
        });
    } else if !species.atlas.is_empty() {
        lines.push(format!("shares the atlas {}", species.atlas));
    }
    lines
}

/// What the engine does with it all.
fn engine(answer: &Answer, spec: &Spec) -> String {
    let engine = &answer.engine;
    let mut out = format!(
        "Engine {:?}: {}",
        engine.name,
        match engine.takes {
            Takes::SingleFiles => "load NAME_LODn.glb, switch at the distances in their extras",
            Takes::Combined => "load NAME.glb, it switches by MSFT_lod",
            Takes::Tiles => "load NAME_tileset.json (recipe: hierarchy), it refines by itself",
        }
    );
    if !engine.makes_mips && spec.scene.mips == Mips::Engine {
        out += "; it makes no mips of PNG: ship them (mips: Shipped)";
    }
    if !engine.draws_instances {
        out += "; it does not draw instances (no --instancing)";
    }
    out + ".\n"
}
