//! The bake: every step in order, one line each. Read this first.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use crate::beside::{alone, hierarchy, instanced, told};
use crate::botany::load::{load, load_slice, read, references};
use crate::botany::model::Model;
use crate::botany::recognise::{RecogniseOptions, recognise};
use crate::botany::tree::Tree;
use crate::describe::Describer;
use crate::detail::element::elements;
use crate::detail::merge::merge;
use crate::detail::optimal_distance::TEXELS;
use crate::detail::wood::Wood;
use crate::error::{Error, Result};
use crate::export::combined::{Packed, extras, write_combined};
use crate::export::gltf::write_glb;
use crate::export::manifest::{
    self, FORMAT, Manifest, Provenance, Range, Reference, SUFFIX, VERSION, Visibility,
};
use crate::export::original::Original;
use crate::export::package::{Package, remove_beside};
use crate::export::png::encode_images;
use crate::export::surface::{self, scene_of_model};
use crate::knobs::check;
use crate::ladder::{LEAST_TRIANGLES, Rung, WHOLE_TREE_TRIANGLES, ranges, rungs, seen};
pub use crate::ladder::{Limit, Wanted};
use crate::level::{Baker, LevelRequest, MASK_HEIGHT};
use crate::measured_visibility::measure_subtrees;
use crate::recipe::{Method, Recipe};
use crate::report::schema::Report;
use crate::report::{Judged, Settings, heights, judge};
use crate::scene::Scene;
use crate::space::sha256::sha256;
use crate::verdict::{REFUSED, in_band, refusal};
use crate::watch::{Deadline, Watch, begin, part, step};

/// What to bake.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// The tree.
    pub input: PathBuf,
    /// The package's folder.
    pub output: PathBuf,
    /// Which levels.
    pub wanted: Wanted,
    /// Levels take no more triangles than this error needs, in pixels where they start. Beside a
    /// limit of triangles, both hold.
    pub max_error_px: Option<f64>,
    /// Knobs.
    pub recipe: Recipe,
    /// The screen that levels are for.
    pub scene: Scene,
    /// Whether to write into a folder that holds other files.
    pub force: bool,
    /// Whether to keep levels that left their band.
    pub accept: bool,
}

/// What was baked.
#[derive(Clone, Debug, Default)]
pub struct Baked {
    /// Figures of the written files.
    pub report: Report,
    /// The package's files, the manifest last.
    pub files: Vec<String>,
    /// What was repaired, guessed or, by `accept`, tolerated.
    pub warnings: Vec<String>,
}

/// Azimuth of the first view of the report, degrees: not one of those that levels were fitted to.
const REPORT_OFFSET_DEG: f32 = 11.0;

/// Bytes of the longest name of a tree: the rest of 255 is for "_hierarchy.glb" and names of drafts.
const LONGEST_NAME: usize = 220;

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
    let (packed, levels) = levels(request, &tree, &rungs, &ranges, watch)?;
    begin(watch, "write", packed.len() as u64 + 1)?;
    let mut files = write(&package, &tree, &packed, watch)?;
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
    let report = Report {
        instancing,
        hierarchy: tiles.as_ref().map(told),
        ..measure(&tree.model, &files[0], &judged, watch)?
    };
    let mut warnings = levels.tree.warnings.clone();
    if request.recipe.instancing {
        warnings.extend(alone(&tree, &request.recipe, report.instancing.as_ref()));
    }
    let found = in_band(&tree, &rungs, &judged, &report);
    if !found.is_empty() && !request.accept {
        let beside = package.write_beside(REFUSED, to_json(&report)?.as_bytes())?;
        return Err(refusal(&found, &beside));
    }
    warnings.extend(found.into_iter().map(|f| f.what));
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
        warnings,
    })
}

/// File systems take names of 255 bytes, and a package's files are named after the tree.
fn check_name(input: &Path) -> Result<()> {
    let bytes = input.file_stem().map_or(0, |stem| stem.len());
    if bytes <= LONGEST_NAME {
        return Ok(());
    }
    Err(Error::usage(
        format!(
            "{}: the tree's name has {bytes} bytes, and the files of its package would have more than file systems take",
            input.display()
        ),
        format!("rename it: {LONGEST_NAME} bytes before the extension at most"),
    ))
}

/// Where a package comes from; `input` are the input's bytes.
///
/// # Errors
/// Those of [`references`].
pub fn provenance(request: &Request, input: &[u8]) -> Result<Provenance> {
    let name = request.input.file_name().unwrap_or_default();
    let others = references(input, &request.input, &request.recipe.limits)?;
    let mut asked = request.wanted.to_string();
    if let Some(pixels) = request.max_error_px {
        asked += &format!(" --max-error {pixels}");
    }
    if request.accept {
        asked += " --accept";
    }
    Ok(Provenance {
        generator: concat!("pleach ", env!("CARGO_PKG_VERSION")).into(),
        input: name.to_string_lossy().into_owned(),
        input_bytes: input.len() as u64,
        input_sha256: sha256(input),
        references: others
            .into_iter()
            .map(|(uri, bytes)| Reference {
                uri,
                sha256: sha256(&bytes),
            })
            .collect(),
        asked,
    })
}

/// Makes all levels, level 0 included, and describes them.
fn levels(
    request: &Request,
    tree: &Tree,
    rungs: &[Rung],
    ranges: &[Range],
    watch: &dyn Watch,
) -> Result<(Vec<Packed>, Manifest)> {
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
    let (pngs, all) = encoded(all)?;
    let mut packed = vec![Packed {
        name: name(0),
        pngs,
        scene: all,
        extras: extras(0, &ranges[0], 0.0, height_m, &request.scene),
        range: ranges[0],
    }];
    step(watch)?;
    for (rung, &range) in rungs.iter().zip(&ranges[1..]) {
        let level = packed.len();
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
        let made = baker.level(level_wanted, watch)?;
        part(watch, "encode")?;
        let described = describer.level(level, &(name(level) + ".glb"), &made, range);
        let (pngs, scene) = encoded(made.scene)?;
        packed.push(Packed {
            name: name(level),
            pngs,
            scene,
            extras: extras(level, &range, described.error_m, height_m, &request.scene),
            range,
        });
        manifest.levels.push(described);
        step(watch)?;
    }
    Ok((packed, manifest))
}

/// A scene's images as PNG, and the scene without their pixels: all levels wait for the last one.
fn encoded(mut scene: surface::Scene) -> Result<(Vec<Vec<u8>>, surface::Scene)> {
    let pngs = encode_images(&scene)?;
    for image in &mut scene.images {
        image.rgba = Arc::default();
    }
    Ok((pngs, scene))
}

/// Writes every level alone and all in one; returns the names of the package's files.
fn write(
    package: &Package,
    tree: &Tree,
    packed: &[Packed],
    watch: &dyn Watch,
) -> Result<Vec<String>> {
    let frame = &tree.model.frame;
    let mut files = Vec::with_capacity(packed.len() + 3);
    for level in packed {
        let file = format!("{}.glb", level.name);
        let extras: Value = level.extras.clone();
        let bytes = write_glb(&level.name, &level.scene, &level.pngs, frame, extras)?;
        package.write(&file, &bytes)?;
        files.push(file);
        step(watch)?;
    }
    let all = format!("{}.glb", tree.model.name);
    package.write(&all, &write_combined(packed, frame)?)?;
    files.extend([all, "report.json".into(), tree.model.name.clone() + SUFFIX]);
    step(watch)?;
    Ok(files)
}

/// Loads the levels as an engine would: from their files.
fn read_back(package: &Package, packed: &[Packed], rungs: &[Rung]) -> Result<Vec<Judged>> {
    let pixels = |height: f64| (height.round() as u32).max(8);
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

fn measure(original: &Model, file: &str, judged: &[Judged], watch: &dyn Watch) -> Result<Report> {
    let settings = Settings {
        azimuth_offset_deg: REPORT_OFFSET_DEG,
        ..Settings::default()
    };
    judge((original, file), judged, &settings, || step(watch))
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
