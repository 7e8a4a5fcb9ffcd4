//! `pleach inspect`: what was recognised, in words, numbers and pictures.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde_json::{Value, json};

use super::out::print;
use crate::botany::recognise::{OrganRule, RecogniseOptions, recognise};
use crate::botany::tree::{Organ, Tree};
use crate::botany::{load, portrait};
use crate::{Error, Result};

/// Shows what is recognised in a tree: parts, organs, leaves, skeleton, sub-trees.
#[derive(Args, Debug)]
pub struct InspectArgs {
    /// Tree to look at (.glb or .gltf).
    input: PathBuf,
    /// Folder for pictures: organs, branches by order, and what hangs on which branch.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
    /// Overrule an organ: what has NAME in its material's or object's name is wood or foliage.
    #[arg(long, value_name = "NAME=wood|foliage", value_parser = parse_rule)]
    organ: Vec<OrganRule>,
}

fn parse_rule(text: &str) -> std::result::Result<OrganRule, String> {
    let (name, organ) = text.rsplit_once('=').unwrap_or((text, ""));
    let organ = match organ {
        "wood" => Organ::Wood,
        "foliage" => Organ::Foliage,
        _ => return Err("write NAME=wood or NAME=foliage".to_owned()),
    };
    Ok(OrganRule {
        name_contains: name.to_owned(),
        organ,
    })
}

/// Runs the command.
///
/// # Errors
/// Where the file can't be read or a picture can't be written.
pub fn run(args: &InspectArgs) -> Result<()> {
    let options = RecogniseOptions {
        organs: args.organ.clone(),
    };
    let start = Instant::now();
    let model = load::load(&args.input)?;
    let loaded = start.elapsed().as_secs_f64();
    let tree = recognise(model, &options)?;
    let recognised = start.elapsed().as_secs_f64() - loaded;
    let pictures = match &args.output {
        Some(folder) => write_pictures(&tree, folder)?,
        None => Vec::new(),
    };
    let summary = Summary::of(&tree);
    if args.json {
        let json = summary.to_json(&tree, &pictures, [loaded, recognised]);
        print(&format!("{json:#}\n"))
    } else {
        print(&summary.text(&tree, &pictures, [loaded, recognised]))
    }
}

fn write_pictures(tree: &Tree, folder: &Path) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    let mut written = Vec::new();
    for (what, png) in portrait::all(tree)? {
        let path = folder.join(format!("{}_{what}.png", tree.model.name));
        std::fs::write(&path, png).map_err(|e| Error::io(&path, "write", e))?;
        written.push(path);
    }
    Ok(written)
}

/// The counts that are printed.
struct Summary {
    wood: usize,
    foliage: usize,
    chains_by_order: Vec<usize>,
    leaves_by_order: Vec<usize>,
    class_sizes: Vec<u32>,
}

impl Summary {
    fn of(tree: &Tree) -> Self {
        let wood = tree.organ.iter().filter(|o| **o == Organ::Wood).count();
        let chains = &tree.skeleton.chains;
        let orders = chains.iter().map(|c| c.order + 1).max().unwrap_or(0) as usize;
        let (mut chains_by_order, mut leaves_by_order) = (vec![0; orders], vec![0; orders]);
        for chain in chains {
            chains_by_order[chain.order as usize] += 1;
        }
        for node in tree.leaves.iter().map(|l| l.node as usize) {
            if let Some(node) = tree.skeleton.nodes.get(node) {
                leaves_by_order[chains[node.chain as usize].order as usize] += 1;
            }
        }
        let mut class_sizes: Vec<u32> = tree.leaf_classes.iter().map(|c| c.count).collect();
        class_sizes.sort_unstable_by(|a, b| b.cmp(a));
        Self {
            wood,
            foliage: tree.organ.len() - wood,
            chains_by_order,
            leaves_by_order,
            class_sizes,
        }
    }

    fn warnings<'a>(&self, tree: &'a Tree) -> Vec<&'a String> {
        tree.model.warnings.iter().chain(&tree.warnings).collect()
    }

    fn to_json(&self, tree: &Tree, pictures: &[PathBuf], [loaded, recognised]: [f64; 2]) -> Value {
        json!({
            "name": tree.model.name,
            "triangles": { "wood": self.wood, "foliage": self.foliage },
            "parts": tree.part_count,
            "leaves": tree.leaves.len(),
            "leaf_classes": tree.leaf_classes.len(),
            "largest_leaf_classes": self.class_sizes.iter().take(10).collect::<Vec<_>>(),
            "branches": tree.skeleton.chains.len(),
            "branches_by_order": self.chains_by_order,
            "leaves_by_order": self.leaves_by_order,
            "skeleton_nodes": tree.skeleton.nodes.len(),
            "subtrees": tree.subtrees.len(),
            "world": {
                "center_m": tree.model.frame.center.to_array(),
                "radius_m": tree.model.frame.radius,
                "position_step_m": tree.model.position_step,
            },
            "warnings": self.warnings(tree),
            "pictures": pictures,
            "seconds": { "load": loaded, "recognise": recognised },
        })
    }

    fn text(&self, tree: &Tree, pictures: &[PathBuf], [loaded, recognised]: [f64; 2]) -> String {
        let mut out = String::new();
        out += &format!(
            "{}: {} triangles ({} wood, {} foliage) in {} parts\n",
            tree.model.name,
            self.wood + self.foliage,
            self.wood,
            self.foliage,
            tree.part_count
        );
        out += &format!(
            "leaves     {} in {} classes of congruent ones (largest {:?})\n",
            tree.leaves.len(),
            tree.leaf_classes.len(),
            &self.class_sizes[..self.class_sizes.len().min(5)]
        );
        out += &format!(
            "skeleton   {} branches, {} nodes\n",
            tree.skeleton.chains.len(),
            tree.skeleton.nodes.len()
        );
        for (order, (chains, leaves)) in
            (self.chains_by_order.iter().zip(&self.leaves_by_order)).enumerate()
        {
            out += &format!("  order {order}  {chains} branches with {leaves} leaves\n");
        }
        out += &format!("sub-trees  {}\n", tree.subtrees.len());
        out += &format!(
            "positions  every {:.1e} m of a radius of {:.3} m\n",
            tree.model.position_step, tree.model.frame.radius
        );
        out += &format!("time       {loaded:.2} s to load, {recognised:.2} s to recognise\n");
        for warning in self.warnings(tree) {
            out += &format!("warning: {warning}\n");
        }
        for picture in pictures {
            out += &format!("wrote {}\n", picture.display());
        }
        out
    }
}
