//! Several trees of one species: a package whose levels share pages.
//!
//! At every size at which levels start, the cards of all trees lie on one page: the largest keep tiles, and
//! the others show pieces of them, whosever they are ([`share`](crate::export::share)). All trees are in
//! memory together.

mod files;
mod page;
mod standing;

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::export::manifest::Manifest;
use crate::export::package::{Package, remove_beside};
use crate::knobs::check;
use crate::level::{Baker, Level, LevelRequest};
use crate::levels::{Levels, needed};
use crate::pipeline::{
    cuts, not_done_by, original_file, pixels, read_back, settings, tell_written,
};
use crate::prepared::{Pieces, Prepared};
use crate::recipe::Recipe;
use crate::report::band::Fault;
use crate::report::species::{SharedPage, SpeciesReport, SpeciesTree};
use crate::report::{Cuts, judge};
use crate::request::Request;
use crate::scene::Scene;
use crate::sharing::Ruler;
use crate::verdict::{REFUSED, in_band, refusal};
use crate::watch::{Deadline, Watch, begin, part, step};
use files::Files;
pub use files::to_json;
use page::{Candidate, Copied};
use standing::check_memory;
pub use standing::standing;

/// What to bake.
#[derive(Clone, Debug, Default)]
pub struct Species {
    /// The trees.
    pub inputs: Vec<PathBuf>,
    /// Everything else: `output` is the package's folder, whose name is the species'; `input` is filled in for
    /// each tree.
    pub request: Request,
    /// What each tree is looked at with, where that differs in distances and sizes; those of one size share a page.
    /// Where there is none for a tree, the request's.
    pub scenes: Vec<Scene>,
}

/// What was baked.
#[derive(Clone, Debug, Default)]
pub struct BakedSpecies {
    /// Figures of the written files.
    pub report: SpeciesReport,
    /// The package's files.
    pub files: Vec<String>,
    /// What was repaired, guessed or, by `accept`, tolerated; each begins with the tree.
    pub warnings: Vec<String>,
}

/// F1 that levels may lose where the recipe says nothing of sharing.
pub const LOSS: f64 = 0.01;

/// Bakes trees of one species into a package: complete, or nothing.
///
/// # Errors
/// See [`Error`]; whatever it is, the output folder is as it was.
pub fn bake_species(species: &Species, watch: &dyn Watch) -> Result<BakedSpecies> {
    let recipe = &species.request.recipe;
    check(recipe)?;
    of_all(species).iter().try_for_each(|r| check(&r.scene))?;
    recipe.packer.check()?;
    if recipe.instancing || recipe.hierarchy {
        return Err(Error::usage(
            "trees of a species share their levels' pages; instancing and hierarchy are of one tree each",
            "leave them out of the recipe, or bake the trees without --species",
        ));
    }
    let deadline = Deadline::new(watch, recipe.most_seconds);
    made(species, &deadline).map_err(|error| deadline.explain(error))
}

fn made(species: &Species, watch: &dyn Watch) -> Result<BakedSpecies> {
    let name = name(species)?;
    let output = &species.request.output;
    let mut warnings: Vec<String> = check_memory(species)?.into_iter().collect();
    warnings.extend(not_done_by(&species.request.scene, false));
    let package = Package::start(output, species.request.force)?;
    let requests = of_all(species);
    let prepared = requests.iter().map(|r| Prepared::new(r, watch));
    let trees: Vec<Prepared> = prepared.collect::<Result<_>>()?;
    let recipe = &recipe(species);
    let pieces = trees.iter().zip(&requests);
    let pieces = pieces.map(|(t, r)| Pieces::new(&t.tree, recipe, &r.scene, watch));
    let pieces: Vec<Pieces> = pieces.collect::<Result<_>>()?;
    let bakers: Vec<Baker> = pieces.iter().map(|p| p.baker(recipe)).collect();
    begin(watch, "describe", 1)?;
    let all = requests.iter().zip(&trees).zip(&pieces);
    let mut levels: Vec<Levels> = all
        .map(|((request, t), p)| Levels::new(request, &t.tree, &p.elements, &t.ranges))
        .collect();
    let mut files = Files::new(&package, &name, &species.request.scene);
    let pages = bake_pages(
        &mut levels,
        &trees,
        &bakers,
        &mut files,
        (&species.request, watch),
    )?;
    let candidates = bakers.iter().zip(&trees);
    let candidates: Vec<_> = candidates
        .map(|(baker, t)| baker.candidates(t.tree.model.frame.radius))
        .collect();
    begin(watch, "write", 1)?;
    levels.iter_mut().for_each(Levels::add_original);
    files.write(&trees, &levels)?;
    let mut report = SpeciesReport {
        name: name.clone(),
        pages,
        ..SpeciesReport::default()
    };
    let mut found = Vec::new();
    begin(watch, "measure", trees.len() as u64)?;
    for ((t, levels), best) in trees.iter().zip(&levels).zip(candidates) {
        let own = cuts(best, &levels.manifest);
        let (measured, faults) = measure(&package, t, levels, own, watch)?;
        let told = levels.manifest.tree.warnings.iter();
        warnings.extend(told.map(|w| format!("{}: {w}", measured.name)));
        report.trees.push(measured);
        found.extend(faults);
        step(watch)?;
    }
    page::add_up(&mut report);
    let text = files::to_json(&report)?;
    if !found.is_empty() && !species.request.accept {
        let beside = package.write_beside(REFUSED, text.as_bytes())?;
        return Err(refusal(&found, &beside));
    }
    warnings.extend(found.into_iter().map(|f| f.what));
    package.write("report.json", (text + "\n").as_bytes())?;
    let mut names = files.names;
    names.push("report.json".into());
    names.extend(trees.iter().map(|t| files::manifest_of(&t.tree.model.name)));
    for (t, levels) in trees.iter().zip(levels) {
        let manifest = Manifest {
            provenance: t.provenance.clone(),
            files: names.clone(),
            species: name.clone(),
            ..levels.manifest
        };
        let file = files::manifest_of(&t.tree.model.name);
        package.write(&file, manifest.to_ron()?.as_bytes())?;
    }
    package.commit(&names)?;
    remove_beside(output, REFUSED);
    Ok(BakedSpecies {
        report,
        files: names,
        warnings,
    })
}

/// Reads a tree's levels back and measures them; what left its band is named after the tree.
fn measure(
    package: &Package,
    t: &Prepared,
    levels: &Levels,
    cuts: Cuts,
    watch: &dyn Watch,
) -> Result<(SpeciesTree, Vec<Fault>)> {
    let name = &t.tree.model.name;
    let judged = read_back(package, &levels.packed[1..], &t.rungs)?;
    let original = (
        &t.tree.model,
        original_file(&levels.manifest, &t.provenance),
    );
    let screen = settings(&levels.manifest.scene);
    let mut report = judge(original, &judged, &screen, || part(watch, "view"))?;
    tell_written(&mut report, package, &levels.packed[0]);
    report.cuts = Some(cuts);
    let mut faults = in_band(&t.tree, &t.rungs, &judged, &report);
    for fault in &mut faults {
        fault.what = format!("{name}: {}", fault.what);
    }
    let name = name.clone();
    Ok((SpeciesTree { name, report }, faults))
}

/// The species' name: that of the package's folder.
fn name(species: &Species) -> Result<String> {
    let output = std::path::absolute(&species.request.output)
        .map_err(|e| Error::io(&species.request.output, "find", e))?;
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    let mut taken = BTreeMap::from([(name.to_lowercase(), output.clone())]);
    for input in &species.inputs {
        let stem = input.file_stem().unwrap_or_default().to_string_lossy();
        // Some file systems take upper and lower case for the same.
        if let Some(other) = taken.insert(stem.to_lowercase(), input.clone()) {
            return Err(Error::usage(
                format!(
                    "{} and {} have one name, and files of the package are named after both",
                    other.display(),
                    input.display()
                ),
                "rename a tree, or give the species another folder with -o",
            ));
        }
    }
    Ok(name.into_owned())
}

/// The species' recipe, which shares.
fn recipe(species: &Species) -> Recipe {
    let recipe = species.request.recipe.clone();
    let sharing = match recipe.sharing {
        0.0 => LOSS,
        asked => asked,
    };
    Recipe { sharing, ..recipe }
}

/// What is asked for each tree.
fn of_all(species: &Species) -> Vec<Request> {
    let (request, recipe) = (&species.request, recipe(species));
    let of = |(i, input): (usize, &PathBuf)| Request {
        input: input.clone(),
        recipe: recipe.clone(),
        scene: species.scenes.get(i).unwrap_or(&request.scene).clone(),
        ..request.clone()
    };
    species.inputs.iter().enumerate().map(of).collect()
}

/// Makes the levels of all trees, those that start at one size together.
fn bake_pages<'t>(
    levels: &mut [Levels],
    trees: &'t [Prepared],
    bakers: &[Baker],
    files: &mut Files,
    (request, watch): (&Request, &dyn Watch),
) -> Result<Vec<SharedPage>> {
    let heights = heights(trees);
    begin(watch, "bake levels", heights.len() as u64 + 1)?;
    let originals = levels.iter_mut().filter_map(|l| l.packed.last_mut());
    files.images(None, originals.collect())?;
    step(watch)?;
    let mut pages = Vec::with_capacity(heights.len());
    for height_px in heights {
        let at = |t: &Prepared| t.rungs.iter().position(|r| r.height_px == height_px);
        let mut candidates = Vec::new();
        let mut made: Vec<(usize, Level)> = Vec::new();
        for (i, (t, baker)) in trees.iter().zip(bakers).enumerate() {
            let Some(rung) = at(t) else { continue };
            let rung = needed(&t.rungs[rung], request.max_error_px, baker);
            let wanted = LevelRequest::of(&rung, baker.recipe.method);
            match baker.fitted(wanted, watch)? {
                Some(fitted) => {
                    candidates.push(Candidate { tree: i, fitted });
                }
                // The original fits into the budget.
                None => made.push((i, baker.original_itself(wanted))),
            }
        }
        let px = pixels(height_px);
        let ruler = |(t, levels): (&'t Prepared, &Levels)| {
            Ruler::new(&t.tree.model, &[px], &settings(&levels.manifest.scene))
        };
        let rulers: Vec<Ruler> = trees.iter().zip(levels.iter()).map(ruler).collect();
        let seated = page::seat(candidates, bakers, &rulers, px, watch)?;
        let number = pages.len() + 1;
        if let Some(sheet) = seated.sheet()? {
            files.sheet(number, &sheet)?;
        }
        let copies = seated.copies();
        let numbers: Vec<usize> = levels.iter().map(|l| l.packed.len()).collect();
        pages.push(SharedPage {
            page: number as u32,
            height_px,
            ..seated.told(trees, &numbers, &copies)
        });
        let page = seated.is_shared().then_some(number);
        part(watch, "describe")?;
        let mut here = vec![false; trees.len()];
        for (i, level) in made.into_iter().chain(seated.levels) {
            levels[i].add(level);
            here[i] = true;
        }
        for Copied { card, of } in copies {
            let other = (of.0 != card.0).then_some(&trees[of.0].tree.model.name);
            levels[card.0].copy(card.1, of.1, other);
        }
        part(watch, "encode")?;
        let new = levels.iter_mut().zip(here).filter(|(_, here)| *here);
        files.images(page, new.filter_map(|(l, _)| l.packed.last_mut()).collect())?;
        step(watch)?;
    }
    Ok(pages)
}

/// Sizes at which levels start, largest first, pixels.
fn heights(trees: &[Prepared]) -> Vec<f64> {
    let all = trees.iter().flat_map(|t| &t.rungs);
    let mut heights: Vec<f64> = all.map(|r| r.height_px).collect();
    heights.sort_by(|a, b| b.total_cmp(a));
    heights.dedup();
    heights
}
