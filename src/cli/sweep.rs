//! `pleach sweep`: what speed costs in accuracy, on the user's own trees.

use std::path::{Path, PathBuf};

use super::bake::limit;
use super::out::print;
use super::progress::{Bars, catch_ctrl_c};
use super::scene::scene;
use super::sweep_table::{table, table_of_all};
use crate::error::{Error, Result};
use crate::pipeline::{Limit, Wanted};
use crate::sweep::{Asked, Sweep, plot, sweep, whole};
use crate::threads::pool;

/// Measure speed against accuracy: every preset, and each knob alone.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The trees: .glb or .gltf. Of several, each has a folder of its name under DIR, and DIR holds
    /// what they come to together.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Folder for sweep.json, sweep.csv and sweep.svg.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// One level for each: a count ("5000") or a share of the original ("10%"), wood included.
    #[arg(long, value_delimiter = ',', value_name = "N|%", value_parser = limit, default_value = "10%,3%,1%,24")]
    triangles: Vec<Limit>,
    /// Screen, field of view and distances: hero, game, landscape, map, or a file (RON).
    #[arg(long, value_name = "NAME|FILE.ron")]
    scene: Option<PathBuf>,
    /// Only these variants beside the balanced preset, for example "draft,best,samples 2".
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Threads; 0: one for each core.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// No progress, no table.
    #[arg(long)]
    quiet: bool,
    /// Print sweep.json instead of a table.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let asked = Asked {
        inputs: args.inputs.clone(),
        wanted: Wanted::Limits(args.triangles.clone()),
        scene: scene(args.scene.as_deref())?,
        only: args.only.clone(),
    };
    let folders = folders(&args.inputs, &args.output)?;
    catch_ctrl_c()?;
    std::fs::create_dir_all(&args.output).map_err(|e| Error::io(&args.output, "create", e))?;
    let pool = pool(args.threads.into())?;
    let scratch = args.output.join(format!(".sweep-{}", std::process::id()));
    let bars = Bars::new(args.quiet);
    let mut left = folders.iter();
    // Written tree by tree: what was measured stays, whatever becomes of the next.
    let write_one = |sweep: &Sweep| {
        left.next()
            .map_or(Ok(()), |folder| write_tree(folder, sweep))
    };
    let found = pool.install(|| sweep(&asked, &scratch, &bars, write_one));
    bars.finish();
    // Each run removed its package; the folder is left where one failed.
    let _ = std::fs::remove_dir_all(&scratch);
    if found.is_err() {
        // Nothing half-written: the folder goes if it was made for this, or was empty.
        let _ = std::fs::remove_dir(&args.output);
    }
    let found = found?;
    let (json, table) = match &found[..] {
        [one] => (to_json(one)?, table(one)),
        several => write_whole(&args.output, several)?,
    };
    match (args.json, args.quiet) {
        (true, _) => print(&json),
        (false, true) => Ok(()),
        (false, false) => print(&table),
    }
}

/// Where each tree's files go: DIR itself for one, a folder of its name for each of several.
fn folders(inputs: &[PathBuf], output: &Path) -> Result<Vec<PathBuf>> {
    if inputs.len() == 1 {
        return Ok(vec![output.into()]);
    }
    let mut out: Vec<PathBuf> = Vec::with_capacity(inputs.len());
    for input in inputs {
        let folder = output.join(input.file_stem().unwrap_or(input.as_os_str()));
        if let Some(first) = out.iter().position(|f| *f == folder) {
            return Err(Error::usage(
                format!(
                    "{} and {} have one name, and so one folder",
                    inputs[first].display(),
                    input.display()
                ),
                "rename one of them, or sweep them separately",
            ));
        }
        out.push(folder);
    }
    Ok(out)
}

fn write_tree(folder: &Path, found: &Sweep) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    write(folder, "sweep.json", &to_json(found)?)?;
    write(folder, "sweep.csv", &found.csv())?;
    write(folder, "sweep.svg", &plot(found))
}

/// What several trees come to, as JSON and as the tables of all.
fn write_whole(folder: &Path, found: &[Sweep]) -> Result<(String, String)> {
    let whole = whole(found);
    let json = to_json(&whole)?;
    write(folder, "sweep.json", &json)?;
    write(folder, "sweep.csv", &whole.csv())?;
    let trees = found.iter().map(|s| format!("{}\n{}\n", s.input, table(s)));
    Ok((json, trees.collect::<String>() + &table_of_all(&whole)))
}

fn to_json(found: &impl serde::Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(found).map_err(|e| Error::Internal {
        step: "report",
        what: e.to_string(),
    })?;
    Ok(text + "\n")
}

fn write(folder: &Path, name: &str, text: &str) -> Result<()> {
    let file = folder.join(name);
    std::fs::write(&file, text).map_err(|e| Error::io(&file, "write", e))
}
