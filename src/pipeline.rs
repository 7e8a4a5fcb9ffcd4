//! The bake: every step in order, one line each. Read this first.

use crate::beside::{alone, hierarchy, instanced, told};
use crate::botany::load::load_base_colors;
use crate::botany::portrait;
use crate::botany::tree::Tree;
use crate::detail::optimal_cut::Candidate;
use crate::error::{Error, Result};
use crate::export::combined::Packed;
use crate::export::manifest::{Manifest, Provenance, Range, Visibility};
use crate::export::package::{Package, remove_beside};
use crate::knobs::check;
use crate::ladder::Rung;
pub use crate::ladder::{Limit, Wanted};
use crate::level::LevelRequest;
use crate::levels::{Levels, needed};
use crate::measured_visibility::measure_subtrees;
use crate::prepared::{Pieces, Prepared};
pub use crate::provenance::provenance;
use crate::report::schema::Report;
use crate::report::{Cuts, Judged, Recognised, Settings, as_written, heights, judge};
pub use crate::request::Request;
use crate::scene::{Mips, Scene};
use crate::sharing;
use crate::space::view::Lens;
use crate::verdict::{REFUSED, in_band, refusal};
use crate::watch::{Deadline, Watch, begin, part, step};
use crate::written::{Share, encode_images_of, sheets, write};

/// What was baked.
#[derive(Clone, Debug, Default)]
pub struct Baked {
    /// Figures of the written files.
    pub report: Report,
    /// The package's files, the manifest last.
    pub files: Vec<String>,
    /// Pictures of what was recognised, where a page was asked for.
    pub recognised: Vec<Recognised>,
    /// What was repaired, guessed or, by `accept`, tolerated.
    pub warnings: Vec<String>,
}

/// Azimuth of the first view of the report, degrees: not one of those that levels were fitted to.
pub const REPORT_OFFSET_DEG: f32 = 11.0;

/// Bakes a tree into a package: complete, or nothing.
///
/// # Errors
/// See [`Error`]; whatever it is, the output folder is as it was.
pub fn bake(request: &Request, watch: &dyn Watch) -> Result<Baked> {
    check(&request.recipe)?;
    let deadline = Deadline::new(watch, request.recipe.most_seconds);
    made(request, &deadline).map_err(|error| deadline.explain(error))
}

fn made(request: &Request, watch: &dyn Watch) -> Result<Baked> {
    check(&request.scene)?;
    request.recipe.packer.check()?;
    let package = Package::start(&request.output, request.force)?;
    let Prepared {
        provenance,
        tree,
        rungs,
        ranges,
    } = Prepared::new(request, watch)?;
    let Made {
        mut packed,
        manifest: levels,
        shares,
        candidates,
    } = levels(request, &tree, &rungs, &ranges, watch)?;
    begin(watch, "write", packed.len() as u64 + 1)?;
    let mut files = write(&package, &tree, &packed, &request.scene, watch)?;
    let shares = sheets(&package, &packed[1..], shares, &mut files)?;
    let instancing = match request.recipe.instancing {
        true if packed[0].shown => {
            instanced(&package, &tree, &request.recipe, &packed[0], &mut files)?
        }
        _ => None,
    };
    packed.iter_mut().for_each(Packed::forget);
    let tiles = match request.recipe.hierarchy {
        true => Some(hierarchy(
            &package,
            &tree,
            (&request.recipe, &request.scene),
            &mut files,
            watch,
        )?),
        false => None,
    };
    let visibility = match request.recipe.hierarchy {
        true => Some(Visibility::of(&measure_subtrees(&tree, watch)?)),
        false => None,
    };
    let judged = read_back(&package, &packed[1..], &rungs)?;
    begin(watch, "measure", heights(&judged).len() as u64)?;
    let measured = (&tree.model, original_file(&levels, &provenance));
    let mut report = judge(measured, &judged, &settings(&request.scene), || step(watch))?;
    tell_written(&mut report, &package, &packed[0]);
    let sharing = sharing::told(&report, shares);
    let mut warnings = levels.tree.warnings.clone();
    warnings.extend(not_done_by(&request.scene, request.recipe.instancing));
    if request.recipe.sharing > 0.0 {
        warnings.extend(sharing::kept(&sharing, request.recipe.sharing));
    }
    let report = Report {
        sharing: Some(sharing),
        instancing,
        hierarchy: tiles.as_ref().map(told),
        cuts: Some(cuts(candidates, &levels)),
        ..report
    };
    if request.recipe.instancing && packed[0].shown {
        warnings.extend(alone(&tree, &request.recipe, report.instancing.as_ref()));
    }
    let found = in_band(&tree, &rungs, &judged, &report);
    if !found.is_empty() && !request.accept {
        let beside = package.write_beside(REFUSED, to_json(&report)?.as_bytes())?;
        return Err(refusal(&found, &beside));
    }
    warnings.extend(found.into_iter().map(|f| f.what));
    let recognised = match request.page {
        true => recognised(&tree)?,
        false => Vec::new(),
    };
    let manifest = Manifest {
        provenance,
        files: files.clone(),
        visibility,
        tiles,
        ..levels
    };
    package.write("report.json", (to_json(&report)? + "\n").as_bytes())?;
    package.write(&files[files.len() - 1], manifest.to_ron()?.as_bytes())?;
    package.commit(&files)?;
    remove_beside(&request.output, REFUSED);
    Ok(Baked {
        report,
        files,
        recognised,
        warnings,
    })
}

/// Where the original can be looked at: its file in the package, the input where the scene shows no level 0.
pub fn original_file<'a>(made: &'a Manifest, from: &'a Provenance) -> &'a str {
    let level = made.levels.first().map(|level| level.file.as_str());
    level.filter(|file| !file.is_empty()).unwrap_or(&from.input)
}

/// Lets a report tell what level 0 costs as it was written, if it was.
pub fn tell_written(report: &mut Report, package: &Package, level: &Packed) {
    if let Some(row) = report.original.as_mut().filter(|_| level.shown) {
        as_written(row, &package.file(&format!("{}.glb", level.name)));
    }
}

/// The best cuts of a tree, and the levels that were made of some.
pub fn cuts(best: Vec<Candidate>, made: &Manifest) -> Cuts {
    let levels = made.levels.iter().skip(1).map(|level| Candidate {
        triangles: level.triangles,
        error_m: level.error_m,
    });
    Cuts {
        best,
        levels: levels.collect(),
    }
}

/// Pictures of what is seen in a tree.
///
/// # Errors
/// Where a picture can't be encoded, which would be a fault of ours.
pub fn recognised(tree: &Tree) -> Result<Vec<Recognised>> {
    let pictures = portrait::all(tree)?.into_iter();
    let named = pictures.map(|(name, png)| Recognised {
        name: name.into(),
        png,
    });
    Ok(named.collect())
}

/// All levels, level 0 first, and what is told of them.
struct Made {
    packed: Vec<Packed>,
    manifest: Manifest,
    shares: Vec<Share>,
    candidates: Vec<Candidate>,
}

/// Makes all levels, level 0 included, and describes them.
fn levels(
    request: &Request,
    tree: &Tree,
    rungs: &[Rung],
    ranges: &[Range],
    watch: &dyn Watch,
) -> Result<Made> {
    let pieces = Pieces::new(tree, &request.recipe, &request.scene, watch)?;
    let baker = pieces.baker(&request.recipe);
    begin(watch, "describe", 1)?;
    let mut levels = Levels::new(request, tree, &pieces.elements, ranges);
    begin(watch, "bake levels", rungs.len() as u64 + 1)?;
    step(watch)?;
    let mut shares = Vec::with_capacity(rungs.len());
    let heights: Vec<u32> = rungs.iter().map(|r| pixels(r.height_px)).collect();
    let ruler = (request.recipe.sharing > 0.0)
        .then(|| sharing::Ruler::new(&tree.model, &heights, &settings(&request.scene)));
    for rung in rungs {
        let level = levels.packed.len();
        let rung = needed(rung, request.max_error_px, &baker);
        let level_wanted = LevelRequest::of(&rung, request.recipe.method);
        // A level's images are encoded while the next one is made: PNG of one page keeps one core busy.
        let last = levels.packed.last_mut();
        let (made, encoded) = rayon::join(
            || baker.level(level_wanted, watch),
            || last.map_or(Ok(()), encode_images_of),
        );
        let (made, ()) = (made?, encoded?);
        let (made, share) = match &ruler {
            Some(ruler) => {
                let most = (pixels(rung.height_px), request.recipe.sharing);
                let chosen = ruler.choose(made, level, most)?;
                (chosen.level, (chosen.told, chosen.sheet))
            }
            None => {
                let told = sharing::alone(&made, level);
                (made, (told, None))
            }
        };
        shares.push(share);
        part(watch, "describe")?;
        levels.add(made);
        step(watch)?;
    }
    part(watch, "encode")?;
    levels.packed.last_mut().map_or(Ok(()), encode_images_of)?;
    let candidates = baker.candidates(tree.model.frame.radius);
    levels.add_original();
    Ok(Made {
        packed: levels.packed,
        manifest: levels.manifest,
        shares,
        candidates,
    })
}

/// Loads the levels as an engine would: from their files.
///
/// # Errors
/// Those of reading what was just written.
pub fn read_back(package: &Package, packed: &[Packed], rungs: &[Rung]) -> Result<Vec<Judged>> {
    let read = |(level, rung): (&Packed, &Rung)| {
        let file = format!("{}.glb", level.name);
        let model = load_base_colors(&package.file(&file))?;
        Ok(Judged {
            model,
            file,
            distance_m: level.range.distance_m,
            heights_px: vec![pixels(rung.height_px)],
        })
    };
    packed.iter().zip(rungs).map(read).collect()
}

/// Height of a tree at which a level is measured.
pub fn pixels(height: f64) -> u32 {
    (height.round() as u32).max(8)
}

/// The lens of the screen that a scene states distances for.
pub fn lens(scene: &Scene) -> Lens {
    Lens::of_screen(scene.screen_height_px.into(), scene.fov_deg)
}

/// What the engine that a scene names will not do with the package.
pub fn not_done_by(scene: &Scene, instancing: bool) -> Vec<String> {
    let engine = scene.engine;
    let mut out = Vec::new();
    if !engine.makes_mips() && scene.mips == Mips::Engine {
        out.push(format!(
            "{engine:?} makes no mips of the PNGs in a file that it loads: crowns flicker from afar; ship them (scene: mips: \
             Shipped)"
        ));
    }
    if instancing && !engine.draws_instances() {
        out.push(format!(
            "{engine:?} does not draw instances: it will refuse the instanced file, or show one leaf of each kind"
        ));
    }
    out
}

/// The views of the report.
pub fn settings(scene: &Scene) -> Settings {
    Settings {
        azimuth_offset_deg: REPORT_OFFSET_DEG,
        sector: scene.sector(),
        lens: lens(scene),
        ..Settings::default()
    }
}

/// The report as text.
///
/// # Errors
/// [`Error::Internal`].
pub fn to_json(report: &Report) -> Result<String> {
    serde_json::to_string_pretty(report).map_err(|error| Error::Internal {
        step: "report",
        what: error.to_string(),
    })
}
