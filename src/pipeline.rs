//! The bake: every step in order, one line each. Read this first.

use crate::beside::{alone, hierarchy, instanced, told};
use crate::botany::load::{load, load_slice, read};
use crate::botany::model::Model;
use crate::botany::portrait;
use crate::botany::recognise::{RecogniseOptions, recognise};
use crate::botany::tree::Tree;
use crate::describe::Describer;
use crate::detail::element::elements;
use crate::detail::merge::merge;
use crate::detail::optimal_cut::Candidate;
use crate::detail::optimal_distance::TEXELS;
use crate::detail::wood::Wood;
use crate::error::{Error, Result};
use crate::export::combined::{Packed, extras};
use crate::export::manifest::{self, FORMAT, Manifest, Range, VERSION, Visibility};
use crate::export::original::Original;
use crate::export::package::{Package, remove_beside};
use crate::export::surface::scene_of_model;
use crate::knobs::check;
use crate::ladder::{LEAST_TRIANGLES, Rung, WHOLE_TREE_TRIANGLES, ranges, rungs, seen};
pub use crate::ladder::{Limit, Wanted};
use crate::level::{Baker, LevelRequest, MASK_HEIGHT};
use crate::measured_visibility::measure_subtrees;
use crate::provenance::check_name;
pub use crate::provenance::provenance;
use crate::recipe::Method;
use crate::report::schema::Report;
use crate::report::{Cuts, Judged, Recognised, Settings, heights, judge};
pub use crate::request::Request;
use crate::scene::Scene;
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
    check_name(&request.input)?;
    let package = Package::start(&request.output, request.force)?;
    begin(watch, "load", 1)?;
    // Read once, so that what is described is what is baked (files that it refers to are read twice).
    let limits = &request.recipe.limits;
    let input = read(&request.input, limits)?;
    let provenance = provenance(request, &input)?;
    let model = load_slice(&input, &request.input, limits)?;
    drop(input);
    let rungs = rungs(
        &request.wanted,
        &request.scene,
        model.triangles.len() as u64,
        match request.recipe.method {
            Method::CrossedQuads => 4,
            _ => LEAST_TRIANGLES,
        },
    )?;
    let rungs = seen(rungs, &request.scene, height_m(&model));
    begin(watch, "recognise", 1)?;
    let organs = request.recipe.organs.clone();
    let tree = recognise(model, &RecogniseOptions { organs })?;
    let ranges = ranges(
        &rungs,
        &request.scene,
        height_m(&tree.model),
        width_to_height(&tree.model),
    );
    let Levels {
        packed,
        manifest: levels,
        shares,
        candidates,
    } = levels(request, &tree, &rungs, &ranges, watch)?;
    begin(watch, "write", packed.len() as u64 + 1)?;
    let mut files = write(&package, &tree, &packed, watch)?;
    let shares = sheets(&package, &packed[1..], shares, &mut files)?;
    let instancing = match request.recipe.instancing {
        true => instanced(&package, &tree, &request.recipe, &packed[0], &mut files)?,
        false => None,
    };
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
    let measured = (&tree.model, files[0].as_str());
    let report = judge(measured, &judged, &settings(&request.scene), || step(watch))?;
    let sharing = sharing::told(&report, shares);
    let mut warnings = levels.tree.warnings.clone();
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
    if request.recipe.instancing {
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

fn cuts(best: Vec<Candidate>, made: &Manifest) -> Cuts {
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
struct Levels {
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
) -> Result<Levels> {
    begin(watch, "group", 1)?;
    let elements = elements(tree);
    let hierarchy = merge(&elements, request.recipe.locality);
    let wood = Wood::new(tree, true);
    begin(watch, "look", 1)?;
    let original = Original::new(&tree.model, request.recipe.training_views, MASK_HEIGHT);
    let baker = Baker {
        tree,
        elements: &elements,
        hierarchy: &hierarchy,
        wood: &wood,
        original: &original,
        recipe: &request.recipe,
    };
    begin(watch, "describe", 1)?;
    let describer = Describer::new(tree, &elements, &request.scene);
    let mut manifest = Manifest {
        format: FORMAT.into(),
        version: VERSION,
        recipe: request.recipe.clone().as_described(),
        scene: request.scene.clone(),
        tree: describer.original(),
        subtree_texels: TEXELS,
        subtrees: describer.subtrees(),
        ..Manifest::default()
    };
    let height_m = manifest.tree.height_m;
    begin(watch, "bake levels", rungs.len() as u64 + 1)?;
    let name = |level: usize| format!("{}_LOD{level}", tree.model.name);
    let all = scene_of_model(&tree.model, 0..tree.model.triangles.len() as u32);
    manifest.levels.push(manifest::Level {
        file: name(0) + ".glb",
        triangles: all.triangles(),
        range: ranges[0],
        ..manifest::Level::default()
    });
    let mut packed = Vec::with_capacity(rungs.len() + 1);
    let mut last = Packed {
        name: name(0),
        pngs: Vec::new(),
        scene: all,
        extras: extras(0, &ranges[0], 0.0, height_m, &request.scene),
        range: ranges[0],
    };
    step(watch)?;
    let mut shares = Vec::with_capacity(rungs.len());
    let heights: Vec<u32> = rungs.iter().map(|r| pixels(r.height_px)).collect();
    let ruler = (request.recipe.sharing > 0.0)
        .then(|| sharing::Ruler::new(&tree.model, &heights, &settings(&request.scene)));
    for (rung, &range) in rungs.iter().zip(&ranges[1..]) {
        let level = packed.len() + 1;
        let enough = request.max_error_px.map_or(u64::MAX, |pixels| {
            baker
                .triangles_within(pixels, rung.height_px)
                .max(WHOLE_TREE_TRIANGLES)
        });
        let rung = Rung {
            triangles: rung.triangles.min(enough),
            ..*rung
        };
        let level_wanted = LevelRequest::of(&rung, request.recipe.method);
        // A level's images are encoded while the next one is made: PNG of one page keeps one core busy.
        let (made, encoded) = rayon::join(
            || baker.level(level_wanted, watch),
            || encode_images_of(&mut last),
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
        let described = describer.level(level, &(name(level) + ".glb"), &made, range);
        let next = Packed {
            name: name(level),
            pngs: Vec::new(),
            scene: made.scene,
            extras: extras(level, &range, described.error_m, height_m, &request.scene),
            range,
        };
        packed.push(std::mem::replace(&mut last, next));
        manifest.levels.push(described);
        step(watch)?;
    }
    part(watch, "encode")?;
    encode_images_of(&mut last)?;
    packed.push(last);
    let candidates = baker.candidates(tree.model.frame.radius);
    Ok(Levels {
        packed,
        manifest,
        shares,
        candidates,
    })
}

/// Loads the levels as an engine would: from their files.
fn read_back(package: &Package, packed: &[Packed], rungs: &[Rung]) -> Result<Vec<Judged>> {
    let read = |(level, rung): (&Packed, &Rung)| {
        let file = format!("{}.glb", level.name);
        let mut model = load(&package.file(&file))?;
        model.keep_only_base_colors();
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
fn pixels(height: f64) -> u32 {
    (height.round() as u32).max(8)
}

/// The lens of the screen that a scene states distances for.
pub fn lens(scene: &Scene) -> Lens {
    Lens::of_screen(scene.screen_height_px.into(), scene.fov_deg)
}

/// The views of the report.
fn settings(scene: &Scene) -> Settings {
    Settings {
        azimuth_offset_deg: REPORT_OFFSET_DEG,
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

fn height_m(model: &Model) -> f64 {
    f64::from(model.height()) * model.frame.radius
}

/// Wider side of the bounding box over its height.
fn width_to_height(model: &Model) -> f64 {
    let (mut low, mut high) = (glam::Vec3::MAX, glam::Vec3::MIN);
    for p in model
        .triangles
        .iter()
        .flatten()
        .map(|&i| model.positions[i as usize])
    {
        (low, high) = (low.min(p), high.max(p));
    }
    let size = (high - low).as_dvec3();
    size.x.max(size.z) / size.y.max(1e-9)
}
