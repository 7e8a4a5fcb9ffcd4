//! `pleach grow`: a sample tree with a known skeleton.

use std::path::{Path, PathBuf};

use clap::Args;

use super::out::print;
use crate::botany::grow::{
    Foliage, Grown, MAX_LEAVES, Nodes, Options, Species, TrueSkeleton, Wood, grow,
};
use crate::{Error, Result};

/// Grows a sample tree and writes its true skeleton beside it.
#[derive(Args, Debug)]
pub struct GrowArgs {
    /// Species file (RON), or oak, spruce, palm, willow, birch_winter.
    #[arg(default_value = "oak")]
    species: PathBuf,
    /// File to write; FILE.skeleton.ron goes beside it.
    #[arg(short, long, value_name = "FILE.glb")]
    output: PathBuf,
    /// Number of leaves; the species' own where it is not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_LEAVES)))]
    leaves: Option<u32>,
    /// Seed of all chance.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// How bark is meshed.
    #[arg(long, value_enum, default_value_t)]
    wood: Wood,
    /// How leaves are meshed.
    #[arg(long, value_enum, default_value_t)]
    foliage: Foliage,
    /// How geometry is spread over nodes.
    #[arg(long, value_enum, default_value_t)]
    nodes: Nodes,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
    /// Print nothing.
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
}

/// Runs the command.
///
/// # Errors
/// Where the species is wrong or a file can't be written.
pub fn run(args: &GrowArgs) -> Result<()> {
    let species = find(&args.species)?;
    let options = Options {
        leaves: args.leaves,
        seed: args.seed,
        wood: args.wood,
        foliage: args.foliage,
        nodes: args.nodes,
    };
    let grown = grow(&species, &options)?;
    write_whole(&args.output, &grown.glb)?;
    let truth = TrueSkeleton::path_beside(&args.output);
    write_whole(&truth, grown.skeleton.to_ron().as_bytes())?;
    if args.json {
        print(&format!("{}\n", summary(&grown, args, &truth)))?;
    } else if !args.quiet {
        print(&format!(
            "{}: {} branches, {} leaves, {} triangles ({} wood, {} foliage), {:.1} MB; skeleton in {}\n",
            args.output.display(),
            grown.skeleton.chains.len(),
            grown.skeleton.leaves.len(),
            grown.triangles[0] + grown.triangles[1],
            grown.triangles[0],
            grown.triangles[1],
            grown.glb.len() as f64 / 1e6,
            truth.display(),
        ))?;
    }
    Ok(())
}

/// What was grown, for programs.
fn summary(grown: &Grown, args: &GrowArgs, truth: &Path) -> serde_json::Value {
    serde_json::json!({
        "file": args.output.display().to_string(),
        "skeleton_file": truth.display().to_string(),
        "branches": grown.skeleton.chains.len(),
        "leaves": grown.skeleton.leaves.len(),
        "wood_triangles": grown.triangles[0],
        "foliage_triangles": grown.triangles[1],
        "file_bytes": grown.glb.len(),
        "seed": args.seed,
    })
}

/// A species by its name, or from its file.
fn find(species: &Path) -> Result<Species> {
    if let Some(built_in) = species.to_str().and_then(Species::named) {
        return Ok(built_in);
    }
    if species.extension().is_none() && !species.exists() {
        let names: Vec<_> = Species::names().collect();
        return Err(Error::usage(
            format!("no species \"{}\"", species.display()),
            format!("give a RON file or one of {}", names.join(", ")),
        ));
    }
    Species::read(species)
}

/// Writes beside the place and moves there: a file is whole or absent.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    let done = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path));
    done.map_err(|e| {
        let _ = std::fs::remove_file(&part);
        Error::io(path, "write", e)
    })
}
