//! `pleach bake`: a tree becomes a package of levels.

use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::pipeline::{Limit, Request, bake};
use crate::recipe::Recipe;

/// Bake levels of detail of a tree.
#[derive(clap::Args)]
pub struct Args {
    /// The tree: .glb or .gltf.
    input: PathBuf,
    /// Folder of the package.
    #[arg(short, long)]
    output: PathBuf,
    /// One level for each: a count ("5000") or a share of the original ("10%"), wood included.
    #[arg(long, value_delimiter = ',')]
    triangles: Vec<String>,
}

/// Runs the command.
pub fn run(args: Args) -> Result<()> {
    let limits = args
        .triangles
        .iter()
        .map(|t| limit(t))
        .collect::<Result<Vec<Limit>>>()?;
    bake(&Request {
        input: args.input,
        output: args.output,
        limits,
        recipe: Recipe::default(),
    })
}

fn limit(text: &str) -> Result<Limit> {
    let wrong = || {
        Error::usage(
            format!("--triangles: {text:?} is neither a count nor a share"),
            "write a count such as 5000 or a share such as 10%, separated by commas",
        )
    };
    if let Some(share) = text.trim().strip_suffix('%') {
        let share: f64 = share.trim().parse().map_err(|_| wrong())?;
        if !(share > 0.0 && share <= 100.0) {
            return Err(wrong());
        }
        return Ok(Limit::Share(share / 100.0));
    }
    text.trim().parse().map(Limit::Count).map_err(|_| wrong())
}
