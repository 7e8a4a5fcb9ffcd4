//! Minimal bakers of what others make of a tree, to compare with: `node tests/bench/others.mjs` runs it.
//!
//! ```text
//! others decoret TREE.glb -o CLOUD.glb    Décoret's billboard cloud: 24 planes, epsilon 0.03 of the
//!                                         bounding box's diagonal, one page of 1024 x 1024
//! others impostor TREE.glb KIND TEXELS -o PAGE.png
//!                                         azimuths (8), hemisphere or sphere (16 x 16), so many texels;
//!                                         baked and judged as its shader would draw it
//! ```
//!
//! Either prints one line of JSON.

mod cloud_file;
mod decoret;
mod impostor;
mod judge;
mod octahedron;
mod paint;
mod plane_space;
#[cfg(test)]
mod sample;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use glam::Vec3;
use pleach::botany::Model;
use pleach::botany::load::load;
use pleach::botany::model::Image;
use pleach::export::png::encode_png;
use pleach::watch::{Clock, Unwatched, Watch};
use pleach::{Error, Result};
use serde_json::{Value, json};

use decoret::Settings;
use impostor::{Impostor, Kind};

/// Planes of a billboard cloud.
const PLANES: usize = 24;
/// How far from its plane a face may be, over the diagonal of the bounding box.
const EPSILON: f32 = 0.03;
/// Side of its page, texels.
const PAGE: u32 = 1024;
/// Height of the tree at which impostors are judged, pixels.
const HEIGHT_PX: u32 = 256;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["decoret", tree, "-o", file] => cloud(Path::new(tree), Path::new(file)),
        ["impostor", tree, kind, texels, "-o", page] => {
            picture(Path::new(tree), kind, texels, Path::new(page))
        }
        _ => Err(Error::usage(
            "others: not understood",
            "others decoret TREE -o CLOUD.glb, or others impostor TREE azimuths|hemisphere|sphere TEXELS -o PAGE.png",
        )),
    };
    match done {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn cloud(tree: &Path, file: &Path) -> Result<Value> {
    let model = load(tree)?;
    let faces = decoret::faces(&model);
    let settings = Settings {
        planes: PLANES,
        epsilon: EPSILON * diagonal(&model),
    };
    let cloud = decoret::billboards(&faces, &settings);
    cloud_file::write(&model, &cloud, PAGE, file)?;
    let area = |face: u32| f64::from(faces[face as usize].area.length());
    let all: f64 = (0..faces.len() as u32).map(area).sum();
    let kept: f64 = cloud.iter().flat_map(|b| &b.faces).map(|&f| area(f)).sum();
    Ok(json!({ "planes": cloud.len(), "area_share": kept / all }))
}

/// Diagonal of the bounding box, normalised units.
fn diagonal(model: &Model) -> f32 {
    let used = model.triangles.as_flattened().iter();
    let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
    for p in used.map(|&i| model.positions[i as usize]) {
        (low, high) = (low.min(p), high.max(p));
    }
    (high - low).length()
}

fn picture(tree: &Path, kind: &str, texels: &str, page: &Path) -> Result<Value> {
    let kind = match kind {
        "azimuths" => Kind::Azimuths,
        "hemisphere" => Kind::Hemisphere,
        "sphere" => Kind::Sphere,
        _ => {
            return Err(Error::usage(
                format!("no kind {kind:?}"),
                "azimuths, hemisphere or sphere",
            ));
        }
    };
    let texels = texels.parse().map_err(|_| {
        Error::usage(
            format!("{texels:?} is no number"),
            "give a number of texels",
        )
    })?;
    let clock = Clock::new(Unwatched);
    clock.stage("bake", 1);
    let model = load(tree)?;
    let baked = impostor::bake(&model, kind, texels);
    let [width, height] = write_page(&baked, page)?;
    clock.stage("judge", 1);
    let reference = judge::reference(&model, HEIGHT_PX);
    let row = |blend| {
        let found = judge::figures(&reference, &baked, blend);
        json!({ "blend": blend, "f1": found.f1, "area_ratio": found.area_ratio })
    };
    let rows = [row(false), row(true)];
    let stages = clock.finish();
    let bake = stages.iter().find(|s| s.name == "bake");
    Ok(json!({
        "page": [width, height],
        "cpu_seconds": bake.map(|s| s.cpu_seconds),
        "shown": rows,
    }))
}

/// All pictures on one page; its size.
fn write_page(baked: &Impostor, file: &Path) -> Result<[u32; 2]> {
    let grid = baked.kind.grid();
    let [width, height] = [0, 1].map(|i| grid[i] * baked.size[i]);
    let mut page = vec![0; width as usize * height as usize * 4];
    for (frame, image) in (0..).zip(&baked.frames) {
        let place = [
            frame % grid[0] * baked.size[0],
            frame / grid[0] * baked.size[1],
        ];
        paint::paste(&mut page, width, image, baked.size[0], place);
    }
    let png = encode_png(&Image {
        name: "page".into(),
        width,
        height,
        rgba: Arc::new(page),
    })?;
    std::fs::write(file, png).map_err(|e| Error::io(file, "write", e))?;
    Ok([width, height])
}
